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
mod fold;
mod gemm;
mod kernel;
mod lines;
mod multigrid;
mod solver;
mod transform;

#[cfg(test)]
mod long_waves_tests;
#[cfg(test)]
mod tests;

pub(crate) use apply::norm;
pub use equation::PressureEquation;
pub(crate) use solver::PressureSolver;
pub use solver::Solved;

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
