//! The pressure equation, `sum_b (prod_{d != b} m_d) Dw_b f_b^-1 Dw_b^T phi = -g`, by two independent methods.
//!
//! `g` is the weighted divergence; the operator is the product of the very divergence and gradient of the projection, so that
//! the residual of the solution is the divergence left in the flow.

mod apply;
mod banded_cholesky;
mod cost;
mod direct;
mod eigen;
mod equation;
mod gemm;
mod kernel;
mod lines;
mod multigrid;
mod refine;
mod transform;

#[cfg(test)]
mod checks;
#[cfg(test)]
mod long_waves;

use super::layout::{Layout, Shape};
use crate::Error;
use crate::error::check;
use multigrid::Multigrid;

pub(crate) use apply::norm;
pub(crate) use direct::direct;
pub use equation::PressureEquation;

/// How the pressure equation is solved.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PressureMethod {
    /// The faster one for the mesh.
    #[default]
    Auto,
    /// Transforms and a banded factorisation: the residual is round-off.
    Direct,
    /// A transform along one direction, and for each of its modes conjugate gradients with multigrid in the other two.
    Multigrid,
}

/// Cells of a dense direction from which multigrid is faster to a residual of 1e-6.
const DENSE_LIMIT: usize = 3000;

/// The solver that `method` asks for.
///
/// # Errors
/// Those of the solvers.
pub(crate) fn build(layout: &Layout, method: PressureMethod) -> Result<Box<dyn PressureSolver>, Error> {
    match method {
        PressureMethod::Auto if direct::dense_cells(layout) > DENSE_LIMIT => Ok(Box::new(Multigrid::new(layout))),
        PressureMethod::Auto | PressureMethod::Direct => direct(layout),
        PressureMethod::Multigrid => Ok(Box::new(Multigrid::new(layout))),
    }
}

/// Refuses a field of another size and a tolerance that is no number.
fn check_request(shape: Shape, field: &[f64], tolerance: f64) -> Result<(), Error> {
    check_length(shape, field)?;
    check("tolerance", tolerance, "above 0 and below 1", |t| t > 0.0 && t < 1.0)
}

/// Refuses a field of another size.
fn check_length(shape: Shape, field: &[f64]) -> Result<(), Error> {
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

    /// The method and what it is made of, for the log.
    fn describe(&self) -> String;
}
