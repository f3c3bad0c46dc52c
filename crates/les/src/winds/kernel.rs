//! The M'4 interpolation kernel, equation (27), and its four weights in a cell.
//!
//! M'4 (Monaghan 1985) is the cubic convolution kernel of Keys (1981) with a = -1/2: third order, once differentiable.
//!
//! Check: the weights sum to 1, give back 1, x and x^2 exactly, and x^3 with the residual `s (1 - s)(1 - 2 s)`.

/// The kernel `W` of (27) at `x` cells from its node; zero beyond two cells.
///
/// ```
/// assert_eq!(wakescope_les::winds::m4_prime(0.0), 1.0);
/// assert_eq!(wakescope_les::winds::m4_prime(0.5), 0.5625);
/// ```
pub fn m4_prime(x: f64) -> f64 {
    let a = x.abs();
    if a <= 1.0 {
        1.0 + a * a * (1.5 * a - 2.5)
    } else if a <= 2.0 {
        0.5 * (2.0 - a) * (2.0 - a) * (1.0 - a)
    } else {
        0.0
    }
}

/// Weights of the nodes -1, 0, 1, 2 for a point at the fraction `s` (0 to 1) between nodes 0 and 1, from (27).
pub fn m4_prime_weights(s: f64) -> [f64; 4] {
    let t = 1.0 - s;
    [-0.5 * s * t * t, 1.0 + s * s * (1.5 * s - 2.5), 1.0 + t * t * (1.5 * t - 2.5), -0.5 * t * s * s]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    #[test]
    fn kernel_and_weights_are_those_of_the_reference() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference/signal/m4prime_kernel.csv");
        let text = std::fs::read_to_string(path).unwrap();
        let mut rows = (0, 0);
        for line in text.lines().filter(|l| !l.starts_with('#') && !l.starts_with('x')) {
            let row: Vec<Option<f64>> = line.split(',').map(|v| v.trim().parse().ok()).collect();
            let (x, w) = (row[0].unwrap(), row[1].unwrap());
            assert_abs_diff_eq!(m4_prime(x), w, epsilon = 1e-15);
            assert_abs_diff_eq!(m4_prime(-x), w, epsilon = 1e-15);
            rows.0 += 1;
            if let [Some(a), Some(b), Some(c), Some(d)] = row[2..6] {
                for (found, expected) in m4_prime_weights(x).iter().zip([a, b, c, d]) {
                    assert_abs_diff_eq!(*found, expected, epsilon = 1e-15);
                }
                rows.1 += 1;
            }
        }
        assert!(rows.0 > 20 && rows.1 > 9, "{rows:?}");
    }

    #[test]
    fn weights_give_back_parabolas_and_miss_cubics_by_the_known_residual() {
        for step in 0..=100 {
            let s = 0.01 * f64::from(step);
            let moment = |power: i32| {
                m4_prime_weights(s)
                    .iter()
                    .zip([-1.0_f64, 0.0, 1.0, 2.0])
                    .map(|(w, node)| w * node.powi(power))
                    .sum::<f64>()
            };
            for power in 0..3 {
                assert_abs_diff_eq!(moment(power), s.powi(power), epsilon = 1e-15);
            }
            let residual = s * (1.0 - s) * (1.0 - 2.0 * s);
            assert_abs_diff_eq!(moment(3) - s.powi(3), residual, epsilon = 2e-15);
        }
    }

    #[test]
    fn weights_are_the_kernel_at_the_four_distances() {
        let s = 0.37;
        for (w, distance) in m4_prime_weights(s).iter().zip([1.0 + s, s, 1.0 - s, 2.0 - s]) {
            assert_relative_eq!(*w, m4_prime(distance), max_relative = 1e-13);
        }
    }

    #[test]
    fn kernel_ends_at_two_cells_and_dips_to_minus_two_27ths() {
        assert_eq!((m4_prime(1.0), m4_prime(2.0), m4_prime(2.5)), (0.0, 0.0, 0.0));
        assert_relative_eq!(m4_prime(4.0 / 3.0), -2.0 / 27.0, max_relative = 1e-14);
    }
}
