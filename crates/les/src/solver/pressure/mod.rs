//! The pressure equation, `sum_b (prod_{d != b} m_d) Dw_b f_b^-1 Dw_b^T phi = -g`, by two independent methods.
//!
//! `g` is the weighted divergence; the operator is the product of the very divergence and gradient of the projection, so that
//! the residual of the solution is the divergence left in the flow.

use crate::Error;

/// What a solve did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Solved {
    /// Norm of the residual over that of the right side; `None` where a direct solve has not measured it.
    pub(crate) residual: Option<f64>,
    /// Iterations, 0 for a direct solve.
    pub(crate) iterations: usize,
    /// Mean factor by which an iteration reduced the residual.
    pub(crate) factor: Option<f64>,
    /// Sum of the right side over the sum of its moduli: what no pressure can balance, and was removed.
    pub(crate) imbalance: f64,
}

/// A solver of the pressure equation of one mesh.
pub(crate) trait PressureSolver: Send + std::fmt::Debug {
    /// Replaces the weighted divergence `g` in `field` by `phi`, of zero weighted mean.
    ///
    /// # Errors
    /// If the residual does not reach `tolerance` (relative, of the 2-norm).
    fn solve(&mut self, field: &mut [f64], tolerance: f64) -> Result<Solved, Error>;

    /// The method and what it is made of, for the log.
    fn describe(&self) -> String;
}
