//! What a scan without a wake holds besides the wind: noise, and turbulence if there is any; and how both are made white.
//!
//! ```text
//! C = sigma_c^2 exp(-d/L) + diag(sigma^2),   C = A A^T (Cholesky),   white = A^-1 x
//! ```
//!
//! with d the distance of two cells. Check: drawn scans become white; C is symmetric and has the right diagonal.

use ndarray::{Array2, Axis};

use crate::error::{Error, not_negative, positive};
use crate::linalg::cholesky::{cholesky, forward, forward_one};
use crate::retrieval::Turbulence;
use crate::wake_detection::cells::Cells;

fn covariance_m2_s2(turbulence: &Turbulence, a_m: (f64, f64), b_m: (f64, f64)) -> f64 {
    let distance_m = (a_m.0 - b_m.0).hypot(a_m.1 - b_m.1);
    turbulence.deviation_m_s.powi(2) * (-distance_m / turbulence.length_m).exp()
}

/// Makes the background of a map white, of unit variance.
#[derive(Debug, Clone)]
pub(super) enum Whitening {
    /// Divides by standard deviations.
    Deviations(Vec<f64>),
    /// Solves with the lower factor of the covariance.
    Factor(Array2<f64>),
}

impl Whitening {
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible turbulence, [`Error::Linalg`] for a covariance without a factor.
    pub(super) fn new(cells: &Cells, turbulence: Option<&Turbulence>) -> Result<Self, Error> {
        let cells = &cells.cells;
        let Some(turbulence) = turbulence else {
            return Ok(Self::Deviations(cells.iter().map(|cell| cell.deviation_m_s).collect()));
        };
        not_negative("deviation_m_s of the turbulence", turbulence.deviation_m_s)?;
        positive("length_m of the turbulence", turbulence.length_m)?;
        let order = cells.len();
        let covariance = Array2::from_shape_fn((order, order), |(i, j)| match j.cmp(&i) {
            std::cmp::Ordering::Less => covariance_m2_s2(turbulence, cells[i].place_m, cells[j].place_m),
            std::cmp::Ordering::Equal => turbulence.deviation_m_s.powi(2) + cells[i].deviation_m_s.powi(2),
            std::cmp::Ordering::Greater => 0.0,
        });
        let reason = "is not positive definite: turbulence without noise in close cells has none";
        cholesky(covariance).map(Self::Factor).ok_or(Error::Linalg {
            what: "covariance of the background",
            order,
            reason,
        })
    }

    /// Columns of numbers by cell, made white in place.
    pub(super) fn apply(&self, columns: &mut Array2<f64>) {
        match self {
            Self::Deviations(deviations) => {
                columns.axis_iter_mut(Axis(0)).zip(deviations).for_each(|(mut row, deviation)| row /= *deviation);
            }
            Self::Factor(lower) => forward(lower.view(), columns),
        }
    }

    /// One number by cell, made white in place.
    pub(super) fn apply_one(&self, numbers: &mut [f64]) {
        match self {
            Self::Deviations(deviations) => {
                numbers.iter_mut().zip(deviations).for_each(|(x, deviation)| *x /= deviation)
            }
            Self::Factor(lower) => forward_one(lower.view(), numbers),
        }
    }
}
