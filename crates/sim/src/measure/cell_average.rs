//! Averages of the errors of a map over some of its cells, with their standard errors.
//!
//! Estimates of neighbouring cells share their windows: so many cells count as one where a standard error is made.

use crate::measure::map::VelocityEstimates;
use ndarray::Array2;

/// Errors over a set of cells: the mean bias, and root means of squares; NaN for no cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellAverage {
    /// Mean error against the velocity weighted with the pulse, m/s.
    pub bias_m_s: f64,
    /// Standard deviation of one realisation, m/s.
    pub std_m_s: f64,
    /// Root mean square error, m/s.
    pub rms_m_s: f64,
    /// Standard error of `rms_m_s`, m/s.
    pub standard_error_m_s: f64,
}

impl CellAverage {
    /// Over the cells (line, gate) of a map that have an estimate, of which `shared` are worth one that is independent.
    #[must_use]
    pub fn over(map: &VelocityEstimates, cells: &[(usize, usize)], shared: f64) -> Self {
        let has_estimate = |cell: &(usize, usize)| map.rms_m_s.get(*cell).is_some_and(|rms| rms.is_finite());
        let known: Vec<(usize, usize)> = cells.iter().copied().filter(has_estimate).collect();
        let n = known.len() as f64;
        let mean = |field: &Array2<f64>| known.iter().map(|c| field[*c]).sum::<f64>() / n;
        let square = |field: &Array2<f64>| (known.iter().map(|c| field[*c].powi(2)).sum::<f64>() / n).sqrt();
        Self {
            bias_m_s: mean(&map.bias_m_s),
            std_m_s: square(&map.std_m_s),
            rms_m_s: square(&map.rms_m_s),
            standard_error_m_s: square(&map.standard_error_m_s) / (n / shared).max(1.0).sqrt(),
        }
    }

    /// Averages of independent batches of equal size as one.
    #[must_use]
    pub fn joined(batches: impl ExactSizeIterator<Item = Self>) -> Self {
        let n = batches.len() as f64;
        let mut sums = [0.0; 4];
        for b in batches {
            let squares = [b.bias_m_s, b.std_m_s.powi(2), b.rms_m_s.powi(2), b.standard_error_m_s.powi(2)];
            sums.iter_mut().zip(squares).for_each(|(sum, value)| *sum += value / n);
        }
        let [bias_m_s, std, rms, error] = sums;
        Self { bias_m_s, std_m_s: std.sqrt(), rms_m_s: rms.sqrt(), standard_error_m_s: (error / n).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_of_equal_errors_keep_them_and_halve_the_standard_error_of_four() {
        let one = CellAverage { bias_m_s: -0.2, std_m_s: 0.5, rms_m_s: 0.6, standard_error_m_s: 0.1 };
        let four = CellAverage::joined([one; 4].into_iter());
        assert!((four.bias_m_s + 0.2).abs() < 1e-12 && (four.std_m_s - 0.5).abs() < 1e-12);
        assert!((four.rms_m_s - 0.6).abs() < 1e-12 && (four.standard_error_m_s - 0.05).abs() < 1e-12);
    }
}
