//! Error of estimates against the truth over realisations: bias, standard deviation and root mean square apart.
//!
//! Computes the mean of (33) and its two parts, rms^2 = bias^2 + variance (population form), each with its
//! standard error. The squared error alone hides that inside a vortex it is mostly bias. Moments up to the
//! fourth are updated in one pass (Pebay 2008). Check: against two-pass formulas on skewed data.

use ndarray::{Array, ArrayView, Dimension, Zip};

use crate::error::Error;

/// Running moments of the error at one point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Moments {
    count: f64,
    missing: usize,
    mean: f64,
    m2: f64,
    m3: f64,
    m4: f64,
}

impl Moments {
    fn add(&mut self, error: f64) {
        if !error.is_finite() {
            self.missing += 1;
            return;
        }
        let before = self.count;
        self.count += 1.0;
        let n = self.count;
        let delta = error - self.mean;
        let step = delta / n;
        let step2 = step * step;
        let term = delta * step * before;
        self.mean += step;
        self.m4 += term * step2 * (n * n - 3.0 * n + 3.0) + 6.0 * step2 * self.m2 - 4.0 * step * self.m3;
        self.m3 += term * step * (n - 2.0) - 3.0 * step * self.m2;
        self.m2 += term;
    }

    fn statistics(&self) -> ErrorStatistics {
        let n = self.count;
        let some = |enough: bool, value: f64| if enough { value } else { f64::NAN };
        let variance = self.m2 / (n - 1.0);
        let std_m_s = some(n > 1.5, variance.sqrt());
        // central moments in population form
        let (c2, c3, c4) = (self.m2 / n, self.m3 / n, self.m4 / n);
        let bias_m_s = some(n > 0.5, self.mean);
        let rms_m_s = (bias_m_s * bias_m_s + c2).sqrt();
        let variance_error = ((c4 - c2 * c2 * (n - 3.0) / (n - 1.0)) / n).max(0.0).sqrt();
        let square_variance = c4 + 4.0 * bias_m_s * c3 + 4.0 * bias_m_s * bias_m_s * c2 - c2 * c2;
        let square_error = (square_variance.max(0.0) / (n - 1.0)).sqrt();
        let half_ratio = |error: f64, of: f64| if error == 0.0 { 0.0 } else { error / (2.0 * of) };
        ErrorStatistics {
            count: n as usize,
            missing: self.missing,
            bias_m_s,
            bias_standard_error_m_s: some(n > 1.5, (variance / n).sqrt()),
            std_m_s,
            std_standard_error_m_s: some(n > 2.5, half_ratio(variance_error, std_m_s)),
            rms_m_s,
            rms_standard_error_m_s: some(n > 1.5, half_ratio(square_error, rms_m_s)),
        }
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
    /// Standard error of the standard deviation, from the fourth moment \[m/s\].
    pub std_standard_error_m_s: f64,
    /// Root of the mean of (33) \[m/s\].
    pub rms_m_s: f64,
    /// Standard error of the root mean square \[m/s\].
    pub rms_standard_error_m_s: f64,
}

/// Accumulates errors over realisations, point by point, for arrays of any dimension.
///
/// Add realisations in a fixed order for the same bits; another order changes only the rounding.
#[derive(Debug, Clone)]
pub struct ErrorMap<D: Dimension> {
    moments: Array<Moments, D>,
}

impl<D: Dimension> ErrorMap<D> {
    /// An empty accumulator for maps of the given shape.
    #[must_use]
    pub fn new(shape: D) -> Self {
        Self { moments: Array::default(shape) }
    }

    /// Adds one realisation: estimates and truth \[m/s\], of the shape of the map.
    ///
    /// An estimate that should not count (a flag other than good) goes in as NaN and is counted as missing.
    ///
    /// # Errors
    /// [`Error::Length`] if a shape differs.
    pub fn add(&mut self, estimate_m_s: ArrayView<'_, f64, D>, truth_m_s: ArrayView<'_, f64, D>) -> Result<(), Error> {
        for (field, view) in [("estimate_m_s", &estimate_m_s), ("truth_m_s", &truth_m_s)] {
            if view.raw_dim() != self.moments.raw_dim() {
                return Err(Error::Length { field, expected: self.moments.len(), found: view.len() });
            }
        }
        Zip::from(&mut self.moments)
            .and(&estimate_m_s)
            .and(&truth_m_s)
            .for_each(|moments, estimate, truth| moments.add(estimate - truth));
        Ok(())
    }

    /// The statistics at every point.
    #[must_use]
    pub fn statistics(&self) -> Array<ErrorStatistics, D> {
        self.moments.map(Moments::statistics)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use ndarray::{Array1, Array2, Ix1, array};

    #[test]
    fn one_pass_moments_agree_with_two_passes_on_skewed_data() {
        let errors: Vec<f64> = (0..200).map(|i| 2.0 + (i as f64 * 0.37).sin().powi(3).exp()).collect();
        let mut map = ErrorMap::new(Ix1(1));
        for error in &errors {
            map.add(array![error + 5.0].view(), array![5.0].view()).unwrap();
        }
        let found = map.statistics()[0];
        let n = errors.len() as f64;
        let bias = errors.iter().sum::<f64>() / n;
        let moment = |p: i32| errors.iter().map(|e| (e - bias).powi(p)).sum::<f64>() / n;
        let std = (moment(2) * n / (n - 1.0)).sqrt();
        let squares: Vec<f64> = errors.iter().map(|e| e * e).collect();
        let mean_square = squares.iter().sum::<f64>() / n;
        let spread = (squares.iter().map(|s| (s - mean_square).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        let fourth = ((moment(4) - moment(2).powi(2) * (n - 3.0) / (n - 1.0)) / n).sqrt();
        for (value, expected) in [
            (found.bias_m_s, bias),
            (found.bias_standard_error_m_s, std / n.sqrt()),
            (found.std_m_s, std),
            (found.std_standard_error_m_s, fourth / (2.0 * std)),
            (found.rms_m_s, mean_square.sqrt()),
            (found.rms_standard_error_m_s, spread / (2.0 * mean_square.sqrt())),
        ] {
            assert_relative_eq!(value, expected, max_relative = 1e-9);
        }
        // rms^2 = bias^2 + population variance
        assert_relative_eq!(found.rms_m_s.powi(2), bias * bias + moment(2), max_relative = 1e-12);
    }

    #[test]
    fn order_of_realisations_changes_only_the_rounding() {
        let errors: Vec<f64> = (0..500).map(|i| (i as f64 * 1.7).sin() * 3.0 + 0.2).collect();
        let run = |order: &mut dyn Iterator<Item = &f64>| {
            let mut map = ErrorMap::new(Ix1(1));
            for error in order {
                map.add(array![*error].view(), array![0.0].view()).unwrap();
            }
            map.statistics()[0]
        };
        let (forward, backward) = (run(&mut errors.iter()), run(&mut errors.iter().rev()));
        assert_relative_eq!(forward.bias_m_s, backward.bias_m_s, max_relative = 1e-13, epsilon = 1e-14);
        assert_relative_eq!(forward.std_m_s, backward.std_m_s, max_relative = 1e-13);
        assert_relative_eq!(forward.rms_m_s, backward.rms_m_s, max_relative = 1e-13);
    }

    #[test]
    fn missing_estimates_are_counted_and_left_out() {
        let mut map = ErrorMap::new(ndarray::Ix2(1, 2));
        let truth = Array2::zeros((1, 2));
        map.add(array![[1.0, f64::NAN]].view(), truth.view()).unwrap();
        map.add(array![[3.0, f64::NAN]].view(), truth.view()).unwrap();
        let found = map.statistics();
        assert_eq!((found[[0, 0]].count, found[[0, 0]].missing), (2, 0));
        assert_relative_eq!(found[[0, 0]].bias_m_s, 2.0);
        assert_relative_eq!(found[[0, 0]].std_m_s, 2.0_f64.sqrt());
        assert_eq!((found[[0, 1]].count, found[[0, 1]].missing), (0, 2));
        assert!(found[[0, 1]].bias_m_s.is_nan() && found[[0, 1]].rms_m_s.is_nan());
    }

    #[test]
    fn shapes_must_agree() {
        let mut map = ErrorMap::new(Ix1(3));
        let short = Array1::zeros(2);
        let right = Array1::zeros(3);
        assert!(map.add(short.view(), right.view()).is_err());
        assert!(map.add(right.view(), short.view()).is_err());
    }
}
