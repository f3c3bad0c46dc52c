//! What a solver of the pressure equation is asked for and what it tells.

use super::super::layout::Shape;
use crate::Error;
use crate::error::check;
use crate::solver::aligned::Aligned;

/// Refuses a field of another size and a tolerance that is no number.
pub(super) fn check_request(shape: Shape, field: &[f64], tolerance: f64) -> Result<(), Error> {
    check_length(shape, field)?;
    check("tolerance", tolerance, "above 0 and below 1", |t| t > 0.0 && t < 1.0)
}

/// Refuses a field of another size.
pub(super) fn check_length(shape: Shape, field: &[f64]) -> Result<(), Error> {
    if field.len() == shape.len() {
        Ok(())
    } else {
        Err(Error::WrongFieldLength { values: field.len(), cells: shape.n })
    }
}

/// What a solve did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved {
    /// 2-norm of the residual over that of the right side less its imbalance, measured on the solution.
    pub residual: f64,
    /// Iterations, 0 for a direct solve.
    pub iterations: usize,
    /// Mean factor by which an iteration reduced the residual.
    pub factor: Option<f64>,
    /// Sum of the right side over the sum of its moduli: what no pressure can balance, and was removed.
    pub imbalance: f64,
}

/// A solver of the pressure equation of one mesh.
pub(crate) trait PressureSolver: Send + std::fmt::Debug {
    /// Replaces the weighted divergence `g` in `field` by `phi`, of zero weighted mean.
    ///
    /// # Errors
    /// If the residual does not reach `tolerance` (2-norm, relative to the right side); `field` is then the best solution
    /// found.
    fn solve(&mut self, field: &mut [f64], tolerance: f64) -> Result<Solved, Error>;

    /// A field of this solver that is free between its solves.
    fn spare(&mut self) -> &mut Aligned;

    /// The method and what it is made of, for the log.
    fn describe(&self) -> String;
}
