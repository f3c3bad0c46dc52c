//! What a scan without a wake holds besides the wind: noise, and turbulence if there is any; and how both are made white.
//!
//! ```text
//! C = sigma_c^2 exp(-d/L) + diag(sigma^2),   C = A A^T (Cholesky),   white = A^-1 x
//! ```
//!
//! with d the distance of two cells. Check: drawn scans become white; C is symmetric and has the right diagonal.

use ndarray::{Array2, Axis};

use crate::error::{Error, not_negative, positive};
use crate::linalg::cholesky::forward;
use crate::retrieval::{Turbulence, Whitening};
use crate::wake_detection::cells::Cells;

/// Makes the background of a map white, of unit variance.
#[derive(Debug, Clone)]
pub(super) enum Background {
    /// Independent noise of those standard deviations.
    Noise(Vec<f64>),
    /// With turbulence.
    Turbulent(Whitening),
}

impl Background {
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible turbulence, [`Error::Linalg`] for a covariance without a factor.
    pub(super) fn new(cells: &Cells, turbulence: Option<&Turbulence>) -> Result<Self, Error> {
        let cells = &cells.cells;
        let Some(turbulence) = turbulence else {
            return Ok(Self::Noise(cells.iter().map(|cell| cell.deviation_m_s).collect()));
        };
        not_negative("deviation_m_s of the turbulence", turbulence.deviation_m_s)?;
        positive("length_m of the turbulence", turbulence.length_m)?;
        let places: Vec<_> = cells.iter().map(|cell| (cell.place_m, cell.deviation_m_s)).collect();
        let reason = "is not positive definite: turbulence without noise in close cells has none";
        let order = cells.len();
        let singular = Error::Linalg { what: "covariance of the background", order, reason };
        Whitening::new(&places, turbulence).map(Self::Turbulent).ok_or(singular)
    }

    /// Columns of numbers by cell, made white in place.
    pub(super) fn whiten(&self, columns: &mut Array2<f64>) {
        match self {
            Self::Noise(deviations) => {
                columns.axis_iter_mut(Axis(0)).zip(deviations).for_each(|(mut row, deviation)| row /= *deviation);
            }
            Self::Turbulent(whitening) => forward(whitening.lower.view(), columns),
        }
    }

    /// One number by cell, made white in place.
    pub(super) fn whiten_one(&self, numbers: &mut [f64]) {
        match self {
            Self::Noise(deviations) => numbers.iter_mut().zip(deviations).for_each(|(x, deviation)| *x /= deviation),
            Self::Turbulent(whitening) => whitening.whiten(numbers),
        }
    }
}
