//! Tails of the gamma law, also where the numbers leave what the functions of the crate `statrs` take.
//!
//! Check: closed forms of one window; limits.

use statrs::function::erf::erfc;
use statrs::function::gamma::checked_gamma_ur;

/// Above this shape the cube root of a gamma variable is normal far below what is asked for (Wilson and Hilferty 1931), and the
/// series would take too long.
const LARGE_SHAPE: f64 = 1e7;

/// Probability that a gamma variable of shape `a` and scale 1 exceeds `x`; NaN for a shape that is none.
pub(crate) fn gamma_tail(a: f64, x: f64) -> f64 {
    match x {
        x if x <= 0.0 => 1.0,
        f64::INFINITY => 0.0,
        _ if a > LARGE_SHAPE && a.is_finite() => {
            let deviations = 3.0 * a.sqrt() * ((x / a).cbrt() - 1.0 + 1.0 / (9.0 * a));
            0.5 * erfc(deviations * std::f64::consts::FRAC_1_SQRT_2)
        }
        _ => checked_gamma_ur(a, x).unwrap_or(f64::NAN),
    }
}

/// Ends of the interval about the place up to which `is_below` holds, after this number of bisections.
pub(crate) fn bisected(
    mut low: f64,
    mut high: f64,
    steps: usize,
    is_below: impl Fn(f64) -> bool,
) -> [f64; 2] {
    for _ in 0..steps {
        let middle = 0.5 * (low + high);
        if is_below(middle) {
            low = middle
        } else {
            high = middle
        }
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_of_impossible_and_extreme_numbers_are_limits_or_none() {
        assert_eq!(
            [gamma_tail(2.0, 0.0), gamma_tail(2.0, f64::INFINITY)],
            [1.0, 0.0]
        );
        assert!((gamma_tail(1.0, 3.0) - (-3.0_f64).exp()).abs() < 1e-15);
        // of one shape on both sides of the limit
        let at = |a: f64| gamma_tail(a, a + 2.0 * a.sqrt());
        assert!(
            (at(1.001 * LARGE_SHAPE) / at(0.999 * LARGE_SHAPE) - 1.0).abs() < 1e-4
                && at(1e200) < 1.0
        );
        for impossible in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            assert!(gamma_tail(impossible, 1.0).is_nan(), "{impossible}");
        }
    }
}
