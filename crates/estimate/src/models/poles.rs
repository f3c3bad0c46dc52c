//! Poles of an autoregressive model: the roots of z^p + a_1 z^(p-1) + ... + a_p.
//!
//! All roots together by the iteration of Aberth (1973), which converges cubically from a circle of starting points and needs no
//! matrix. Check: polynomials built from known roots, with clusters and roots on the circle; the residual of every root.

use num_complex::Complex;

/// Iterations after which the roots have settled for any order of a window (10 to 20 are usual).
const ITERATIONS: usize = 200;

/// Roots of the monic polynomial with the coefficients `a` of falling powers, the leading 1 left out.
///
/// `None` if a coefficient is not finite or the iteration does not settle.
pub(crate) fn roots(a: &[Complex<f64>]) -> Option<Vec<Complex<f64>>> {
    if a.iter().any(|a| !a.is_finite()) {
        return None;
    }
    // every root lies within 1 + the largest coefficient; trailing zeros are roots at 0
    let degree = a.len();
    let sizes: Vec<f64> = a.iter().map(|a| a.norm()).collect();
    let bound = 1.0 + sizes.iter().copied().fold(0.0, f64::max);
    let radius = sizes
        .last()
        .map_or(1.0, |last| last.powf(1.0 / degree as f64))
        .clamp(1e-3, bound);
    // the offset keeps the start from the symmetry of real coefficients
    let start = |k: usize| {
        Complex::from_polar(
            radius,
            std::f64::consts::TAU * (k as f64 + 0.35) / degree as f64,
        )
    };
    let mut roots: Vec<Complex<f64>> = (0..degree).map(start).collect();
    for _ in 0..ITERATIONS {
        let mut moved = 0.0_f64;
        for k in 0..degree {
            let z = roots[k];
            let Some(newton) = newton_step(a, &sizes, z) else {
                continue;
            };
            let crowd: Complex<f64> = roots
                .iter()
                .enumerate()
                .filter(|(j, other)| *j != k && **other != z)
                .map(|(_, other)| (z - other).inv())
                .sum();
            let step = newton / (1.0 - newton * crowd);
            if !step.is_finite() {
                return None;
            }
            roots[k] = z - step;
            moved = moved.max(step.norm() / roots[k].norm().max(1e-3));
        }
        if moved < 1e-14 {
            return Some(roots);
        }
    }
    // a cluster converges only linearly and to the root of the rounding: accepted where the polynomial vanishes
    let settled =
        |z: &Complex<f64>| newton_step(a, &sizes, *z).is_none_or(|step| step.norm() < 1e-5);
    roots.iter().all(settled).then_some(roots)
}

/// P(z) / P'(z), with the absolute values of the coefficients; `None` where P is zero to rounding.
fn newton_step(a: &[Complex<f64>], sizes: &[f64], z: Complex<f64>) -> Option<Complex<f64>> {
    let radius = z.norm();
    let (mut value, mut slope, mut size): (Complex<f64>, Complex<f64>, f64) =
        (Complex::ONE, Complex::ZERO, 1.0);
    for (a, a_size) in a.iter().zip(sizes) {
        slope = slope * z + value;
        value = value * z + a;
        size = size * radius + a_size;
    }
    if value.norm() <= 4.0 * f64::EPSILON * size {
        None
    } else {
        Some(value / slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(roots: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let mut a = vec![Complex::ONE];
        for root in roots {
            a.push(Complex::ZERO);
            for k in (1..a.len()).rev() {
                let lower = a[k - 1];
                a[k] -= root * lower;
            }
        }
        a[1..].to_vec()
    }

    fn check(expected: &[Complex<f64>], tolerance: f64) {
        let mut found = roots(&polynomial(expected)).unwrap();
        for root in expected {
            let nearest = (0..found.len()).min_by(|&i, &j| {
                (found[i] - root)
                    .norm()
                    .total_cmp(&(found[j] - root).norm())
            });
            let place = found.swap_remove(nearest.unwrap());
            assert!((place - root).norm() < tolerance, "{root}: {place}");
        }
    }

    #[test]
    fn roots_of_products_are_their_factors() {
        let ring =
            |n: usize, r: f64| (0..n).map(move |k| Complex::from_polar(r, 0.3 + 1.9 * k as f64));
        check(&ring(16, 0.95).collect::<Vec<_>>(), 1e-9);
        check(&ring(9, 1.0).chain(ring(7, 0.4)).collect::<Vec<_>>(), 1e-9);
        check(&[Complex::new(-0.7, 0.0)], 1e-14);
        check(&[Complex::ZERO, Complex::new(0.5, 0.2)], 1e-12);
        // conjugate pairs, as real coefficients give
        check(
            &[
                Complex::new(0.1, 0.9),
                Complex::new(0.1, -0.9),
                Complex::new(0.8, 0.0),
            ],
            1e-12,
        );
        // a double root is known to the root of the rounding
        check(
            &[
                Complex::new(0.6, 0.3),
                Complex::new(0.6, 0.3),
                Complex::new(-0.2, 0.0),
            ],
            1e-6,
        );
        assert!(roots(&[]).unwrap().is_empty());
        assert!(roots(&[Complex::new(f64::NAN, 0.0)]).is_none());
    }
}
