//! What the ways to solve the pressure equation have in common.

use crate::Error;

/// A way to solve the pressure equation.
pub(super) trait Method: Send + Sync + std::fmt::Debug {
    /// Its name in errors.
    fn name(&self) -> &'static str;

    /// Replaces the right side in the planes that are owned, of norm `size` over all, by a solution
    /// of about the relative residual `tolerance`; returns the iterations, 0 of a direct method.
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    fn solve(&self, own: &mut [f64], size: f64, tolerance: f64) -> Result<usize, Error>;
}
