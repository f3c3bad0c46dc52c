//! Error of estimates against the truth over realisations: bias, standard deviation and root mean square apart.
//!
//! Computes the mean of (33) and its two parts, rms^2 = bias^2 + (n - 1)/n std^2 for n realisations, each with a
//! standard error that covers however few they are. The squared error alone hides that inside a vortex it is mostly bias. Moments up to the
//! fourth are updated in one pass (Pebay 2008). Check: against two-pass formulas on skewed data.

/// Realisations that the moments of Gaussian errors count as.
const GAUSSIAN: f64 = 4.0;

/// Mean of the errors and sums of the powers 2, 3 and 4 of their deviations from it.
fn moments(errors: &[f64]) -> [f64; 4] {
    let [mut mean, mut m2, mut m3, mut m4] = [0.0; 4];
    for (before, error) in errors.iter().enumerate() {
        let before = before as f64;
        let n = before + 1.0;
        let delta = error - mean;
        let step = delta / n;
        let step2 = step * step;
        let term = delta * step * before;
        mean += step;
        m4 += term * step2 * (n * n - 3.0 * n + 3.0) + 6.0 * step2 * m2 - 4.0 * step * m3;
        m3 += term * step * (n - 2.0) - 3.0 * step * m2;
        m2 += term;
    }
    [mean, m2, m3, m4]
}

/// The value if there are enough numbers, else NaN.
fn value_if(enough: bool, value: f64) -> f64 {
    if enough { value } else { f64::NAN }
}

/// A fourth moment of `n` errors, averaged with that of Gaussian errors of the same variance and bias, which counts as
/// [`GAUSSIAN`] errors more: fourth moments of few numbers are mostly too small.
fn with_gaussian(n: f64, found: f64, gaussian: f64) -> f64 {
    ((n - 1.0) * found + GAUSSIAN * gaussian) / (n - 1.0 + GAUSSIAN)
}

/// Standard error of a `root` from the variance of its square, times Student's factor; 0 where that variance is 0.
fn root_error(student: f64, variance: f64, root: f64) -> f64 {
    if variance == 0.0 {
        0.0
    } else {
        student * variance.sqrt() / (2.0 * root)
    }
}

/// Error statistics at one point; NaN where there are too few realisations to tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorStatistics {
    /// Realisations with a finite error.
    pub count: usize,
    /// Realisations whose estimate or truth was not finite; they enter nothing else.
    pub missing: usize,
    /// Mean error, estimate minus truth \[m/s\].
    pub bias_m_s: f64,
    /// Standard error of the bias \[m/s\].
    pub bias_standard_error_m_s: f64,
    /// Standard deviation of the error, with n - 1 \[m/s\].
    pub std_m_s: f64,
    /// Standard error of the standard deviation, from the fourth moment and that of Gaussian errors \[m/s\].
    pub std_standard_error_m_s: f64,
    /// Root of the mean of (33) \[m/s\].
    pub rms_m_s: f64,
    /// Standard error of the root mean square \[m/s\].
    pub rms_standard_error_m_s: f64,
}

impl ErrorStatistics {
    /// Of the errors of realisations at one point; what is not finite, such as an estimate that should not count, is missing. The
    /// same bits in the same order; another order changes only the rounding.
    #[must_use]
    pub fn of(errors_m_s: impl IntoIterator<Item = f64>) -> Self {
        let mut known = Vec::new();
        let mut missing = 0;
        for error_m_s in errors_m_s {
            if error_m_s.is_finite() {
                known.push(error_m_s);
            } else {
                missing += 1;
            }
        }
        let n = known.len() as f64;
        let [mean, m2, m3, m4] = moments(&known);
        let variance = m2 / (n - 1.0);
        let std_m_s = value_if(n > 1.5, variance.sqrt());
        // central moments in population form
        let c2 = m2 / n;
        let c3 = m3 / n;
        let c4 = m4 / n;
        let bias_m_s = value_if(n > 0.5, mean);
        let rms_m_s = (bias_m_s * bias_m_s + c2).sqrt();
        let fourth = variance * variance * (n - 1.0) / (n + 1.0);
        let squared_bias = (bias_m_s * bias_m_s - variance / n).max(0.0);
        let of_variance = ((c4 - c2 * c2 * (n - 3.0) / (n - 1.0)) / n).max(0.0);
        let of_variance = with_gaussian(n, of_variance, 2.0 * fourth / (n - 1.0));
        let of_squares = (c4 + 4.0 * bias_m_s * c3 + 4.0 * bias_m_s * bias_m_s * c2 - c2 * c2)
            .max(0.0)
            / (n - 1.0);
        let of_squares = with_gaussian(
            n,
            of_squares,
            (2.0 * fourth + 4.0 * squared_bias * variance) / n,
        );
        // About Student's factor for one and for two standard errors.
        let student = 1.0 + 0.75 / (n - 1.0);
        let std_error_m_s = root_error(student, of_variance, std_m_s);
        let rms_error_m_s = root_error(student, of_squares, rms_m_s);
        Self {
            count: n as usize,
            missing,
            bias_m_s,
            bias_standard_error_m_s: value_if(n > 1.5, student * (variance / n).sqrt()),
            std_m_s,
            std_standard_error_m_s: value_if(n > 1.5, std_error_m_s),
            rms_m_s,
            rms_standard_error_m_s: value_if(n > 1.5, rms_error_m_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn one_pass_moments_agree_with_two_passes_on_skewed_data() {
        let errors: Vec<f64> = (0..200)
            .map(|i| 2.0 + (i as f64 * 0.37).sin().powi(3).exp())
            .collect();
        let found = ErrorStatistics::of(errors.iter().copied());
        let n = errors.len() as f64;
        let bias = errors.iter().sum::<f64>() / n;
        let moment = |p: i32| errors.iter().map(|e| (e - bias).powi(p)).sum::<f64>() / n;
        let std = (moment(2) * n / (n - 1.0)).sqrt();
        let squares: Vec<f64> = errors.iter().map(|e| e * e).collect();
        let mean_square = squares.iter().sum::<f64>() / n;
        let spread = (squares
            .iter()
            .map(|s| (s - mean_square).powi(2))
            .sum::<f64>()
            / (n - 1.0)
            / n)
            .sqrt();
        let fourth = ((moment(4) - moment(2).powi(2) * (n - 3.0) / (n - 1.0)) / n).sqrt();
        let few = 1.0 + 0.75 / (n - 1.0);
        // With what Gaussian errors would have, as four more realisations.
        let with = |found: f64, gaussian: f64| {
            (((n - 1.0) * found * found + 4.0 * gaussian) / (n + 3.0)).sqrt()
        };
        let fourth = with(fourth, 2.0 * std.powi(4) / (n + 1.0));
        let of_bias = bias * bias - std * std / n;
        let spread = with(
            spread,
            (2.0 * std.powi(4) * (n - 1.0) / (n + 1.0) + 4.0 * of_bias * std * std) / n,
        );
        for (value, expected) in [
            (found.bias_m_s, bias),
            (found.bias_standard_error_m_s, few * std / n.sqrt()),
            (found.std_m_s, std),
            (found.std_standard_error_m_s, few * fourth / (2.0 * std)),
            (found.rms_m_s, mean_square.sqrt()),
            (
                found.rms_standard_error_m_s,
                few * spread / (2.0 * mean_square.sqrt()),
            ),
        ] {
            assert_relative_eq!(value, expected, max_relative = 1e-9);
        }
        // rms^2 = bias^2 + population variance
        assert_relative_eq!(
            found.rms_m_s.powi(2),
            bias * bias + moment(2),
            max_relative = 1e-12
        );
    }

    /// Share of 4000 root mean squares of `count` errors about `bias` that are within one and two of their standard errors of what
    /// very many have, and the stated error over their scatter.
    fn covered(count: usize, bias: f64) -> [f64; 3] {
        // Normal numbers by the sum of a shift register's: nothing else of this module is random.
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut normal =
            || (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
        let found: Vec<ErrorStatistics> = (0..4000)
            .map(|_| ErrorStatistics::of((0..count).map(|_| bias + normal()).collect::<Vec<_>>()))
            .collect();
        let share = |times: f64| {
            let truth = bias.hypot(1.0);
            let within =
                |s: &&ErrorStatistics| (s.rms_m_s - truth).abs() < times * s.rms_standard_error_m_s;
            found.iter().filter(within).count() as f64 / 4000.0
        };
        let mean =
            |of: &dyn Fn(&ErrorStatistics) -> f64| found.iter().map(of).sum::<f64>() / 4000.0;
        let middle = mean(&|s| s.rms_m_s);
        let scatter = mean(&|s| (s.rms_m_s - middle).powi(2)).sqrt();
        [
            share(1.0),
            share(2.0),
            mean(&|s| s.rms_standard_error_m_s) / scatter,
        ]
    }

    #[test]
    fn standard_errors_of_root_mean_squares_cover_however_few_realisations_there_are() {
        for count in [2, 3, 4, 8, 30] {
            for bias in [0.0, 1.0, 3.0] {
                let [one, two, size] = covered(count, bias);
                // A root of two squares is too skew for the second; then a factor would be needed that is far too large for the first.
                let least = match count {
                    2 => 0.75,
                    3 => 0.80,
                    4 => 0.84,
                    _ => 0.87,
                };
                assert!(
                    (0.59..0.75).contains(&one) && two > least,
                    "{count}, {bias}: {one} {two}"
                );
                assert!((0.85..1.5).contains(&size), "{count}, {bias}: {size}");
            }
        }
    }

    #[test]
    fn order_of_realisations_changes_only_the_rounding() {
        let errors: Vec<f64> = (0..500)
            .map(|i| (i as f64 * 1.7).sin() * 3.0 + 0.2)
            .collect();
        let forward = ErrorStatistics::of(errors.iter().copied());
        let backward = ErrorStatistics::of(errors.iter().rev().copied());
        assert_relative_eq!(
            forward.bias_m_s,
            backward.bias_m_s,
            max_relative = 1e-13,
            epsilon = 1e-14
        );
        assert_relative_eq!(forward.std_m_s, backward.std_m_s, max_relative = 1e-13);
        assert_relative_eq!(forward.rms_m_s, backward.rms_m_s, max_relative = 1e-13);
    }

    #[test]
    fn missing_estimates_are_counted_and_left_out() {
        let found = ErrorStatistics::of([1.0, f64::NAN, 3.0, f64::INFINITY]);
        assert_eq!((found.count, found.missing), (2, 2));
        assert_relative_eq!(found.bias_m_s, 2.0);
        assert_relative_eq!(found.std_m_s, 2.0_f64.sqrt());
        let none = ErrorStatistics::of([f64::NAN; 2]);
        assert_eq!((none.count, none.missing), (0, 2));
        assert!(none.bias_m_s.is_nan() && none.rms_m_s.is_nan());
    }
}
