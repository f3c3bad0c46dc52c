//! Cholesky factor of the covariance of correlated velocities, by which residuals and slopes are made white.
//!
//! C_ik = deviation^2 exp(-distance / length) + sigma_i^2 [i = k]. Check: white residuals of made-up turbulence; the inverse.

use ndarray::Array2;

use crate::linalg::cholesky::{cholesky, forward, forward_one};

/// Lower factor L of C = L L^T.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Whitening {
    pub(crate) lower: Array2<f64>,
}

impl Whitening {
    /// Of cells at (lateral position, height) with their standard deviations in turbulence of that deviation \[m/s\] and length \[m\]; nothing
    /// if C is singular to working precision.
    pub(crate) fn exponential(
        cells: &[((f64, f64), f64)],
        deviation_m_s: f64,
        length_m: f64,
    ) -> Option<Self> {
        let variance = deviation_m_s.powi(2);
        let covariance = Array2::from_shape_fn((cells.len(), cells.len()), |(i, k)| {
            let ((ya, za), sigma) = cells[i];
            let ((yb, zb), _) = cells[k];
            match k.cmp(&i) {
                std::cmp::Ordering::Less => variance * (-(ya - yb).hypot(za - zb) / length_m).exp(),
                std::cmp::Ordering::Equal => variance + sigma * sigma,
                // the lower triangle says all
                std::cmp::Ordering::Greater => 0.0,
            }
        });
        Self::new(covariance)
    }

    /// Of a covariance, whose lower triangle is read; nothing if it is singular to working precision.
    pub(crate) fn new(covariance: Array2<f64>) -> Option<Self> {
        cholesky(covariance).map(|lower| Self { lower })
    }

    /// L^-T x: weights of the velocities in the product of x with white ones.
    pub(crate) fn contrast(&self, x: &[f64]) -> Vec<f64> {
        let mut rest = x.to_vec();
        for i in (0..rest.len()).rev() {
            let row = self.lower.row(i);
            rest[i] /= row[i];
            let own = rest[i];
            for j in 0..i {
                rest[j] -= row[j] * own;
            }
        }
        rest
    }

    /// L^-1 A L^-T of a symmetric matrix A, of which the lower triangle is read.
    pub(crate) fn whitened_both_sides(&self, mut matrix: Array2<f64>) -> Array2<f64> {
        for i in 0..matrix.nrows() {
            for j in 0..i {
                matrix[[j, i]] = matrix[[i, j]];
            }
        }
        forward(self.lower.view(), &mut matrix);
        let mut turned = matrix.reversed_axes().as_standard_layout().into_owned();
        forward(self.lower.view(), &mut turned);
        turned
    }

    /// Replaces x by L^-1 x.
    pub(crate) fn whiten(&self, x: &mut [f64]) {
        // rows of a factor lie in one piece
        if let Some(rows) = self.lower.as_slice() {
            forward_one(rows, x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_times_its_transpose_is_the_covariance() {
        let cells: Vec<((f64, f64), f64)> = (0..130)
            .map(|i| {
                (
                    (f64::from(i % 13) * 4.0, f64::from(i / 13) * 2.0),
                    0.3 + 0.01 * f64::from(i % 7),
                )
            })
            .collect();
        let factor = Whitening::exponential(&cells, 1.2, 25.0).unwrap();
        for (i, k) in [(0, 0), (7, 3), (100, 60), (129, 129)] {
            let (((ya, za), sigma), ((yb, zb), _)) = (cells[i], cells[k]);
            let own = if i == k { sigma * sigma } else { 0.0 };
            let expected = 1.44 * (-(ya - yb).hypot(za - zb) / 25.0).exp() + own;
            let product = factor.lower.row(i).dot(&factor.lower.row(k));
            assert!((product - expected).abs() < 1e-12, "{i} {k}");
        }
        // columns of L become those of the unit matrix
        let mut column = factor.lower.column(60).to_vec();
        factor.whiten(&mut column);
        assert!(
            column
                .iter()
                .enumerate()
                .all(|(i, x)| (x - f64::from(u8::from(i == 60))).abs() < 1e-12)
        );
        // C itself becomes the unit matrix
        let covariance = factor.lower.dot(&factor.lower.t());
        let unit = factor.whitened_both_sides(covariance) - Array2::<f64>::eye(130);
        assert!(unit.iter().all(|x| x.abs() < 1e-12));
        // L^T times the weights of a contrast is the pattern
        let pattern: Vec<f64> = (0..130).map(|i| f64::from(i % 11) - 5.0).collect();
        let weights = factor.contrast(&pattern);
        for j in [0, 64, 129] {
            let product = factor.lower.column(j).dot(&ndarray::aview1(&weights));
            assert!((product - pattern[j]).abs() < 1e-12, "{j}");
        }
        // two cells at one place without noise of their own
        assert!(
            Whitening::exponential(&[((1.0, 1.0), 0.0), ((1.0, 1.0), 0.0)], 1.2, 25.0).is_none()
        );
    }
}
