//! What the velocities of a scan are: means over gates, or what an estimator makes of the wind.
//!
//! Check: the tests of [`fit_scan`](super::fit_scan), with velocities of each kind.

use crate::vortex_fit::EstimatorResponse;

/// The estimator that made the velocities of a scan.
pub trait ScanEstimator {
    /// What it makes of a wake about a range \[m\]; nothing if there is no such model of it.
    fn response(&self, range_m: f64) -> Option<EstimatorResponse<'_>>;

    /// Neighbouring lines, `spacing_rad` apart, that share windows at a range \[m\].
    fn correlated_lines(&self, spacing_rad: f64, range_m: f64) -> usize;

    /// Every Nth gate at those ranges \[m\] is independent: neighbours that share most of their window show the same.
    fn gate_stride(&self, range_m: &[f64]) -> usize;

    /// Half the length of a window along the line \[m\]: the outermost gates observe that much beyond their middles.
    fn half_window_m(&self) -> f64;
}

/// What the velocities of a map are of the wind in its gates.
#[derive(Clone, Copy)]
pub enum Velocities<'e> {
    /// Means with the weight of [`RetrievalOptions::gate`](super::RetrievalOptions::gate).
    Means,
    /// Unknown: they are taken for means, which the flag [`Flag::TakenForMeans`](super::Flag::TakenForMeans) says.
    Unknown,
    /// Estimates of a known estimator.
    Estimates(&'e dyn ScanEstimator),
    /// Most likely estimates of such an estimator: the difference to a fit of means counts as an error.
    LikelyEstimates(&'e dyn ScanEstimator),
}
