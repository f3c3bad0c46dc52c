//! Options of the fit of signals: free parameters, starts, tolerances.
//!
//! Check: fits with and without several starts.

use crate::vortex_fit::FreeParameters;

/// Options of the fit of signals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalFitOptions {
    /// The free parameters.
    pub free: FreeParameters,
    /// Whether the powers of signal and noise are fitted too, one factor each for the whole scan.
    pub fit_powers: bool,
    /// Stride of the lines whose information starts the ascent; the covariance of the result uses all.
    pub information_stride: usize,
    /// Most evaluations of the likelihood in a round.
    pub max_iterations: usize,
    /// The fit ends when the remaining step is below this fraction of the standard deviations.
    pub tolerance_sigmas: f64,
    /// Whether other starts follow the guess: core radii from 1.5 to 12 % of the spacing and heights about the first maximum. From
    /// the guess alone, which maximum is found depends on it.
    pub several_starts: bool,
}

impl Default for SignalFitOptions {
    /// All parameters and powers; the information of every fourth line; at most 60 evaluations; to 0.01 standard deviations;
    /// several starts.
    fn default() -> Self {
        Self {
            free: FreeParameters::default(),
            fit_powers: true,
            information_stride: 4,
            max_iterations: 60,
            tolerance_sigmas: 1e-2,
            several_starts: true,
        }
    }
}
