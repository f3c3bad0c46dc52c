//! The pressure equation, `sum_b (prod_{d != b} m_d) Dw_b f_b^-1 Dw_b^T phi = -g`, by two
//! independent methods.
//!
//! `g` is the weighted divergence; the operator is the product of the very divergence and gradient
//! of the projection, so that the residual of the solution is the divergence left in the flow.

mod apply;
mod banded_cholesky;
mod direct;
mod eigen;
mod fold;
mod gemm;
mod kernel;
mod lines;
mod method;
mod multigrid;
mod solver;
mod transform;
mod v_cycle;

#[cfg(test)]
mod long_waves_tests;
#[cfg(test)]
mod tests;

pub(crate) use apply::norm;
pub(crate) use lines::{Pencil, pencils};
pub use solver::PressureMethod;
pub(crate) use solver::{PressureSolver, Solved, accept_round_off};
