//! How signals are fitted: what may change, where the fit begins and ends.
//!
//! Check: fits with and without several starts.

use crate::vortex_fit::FreeParameters;

/// How the signals are fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalFitOptions {
    /// What may change.
    pub free: FreeParameters,
    /// Whether the powers of signal and noise are fitted too, one factor each for the whole scan.
    pub fit_powers: bool,
    /// The ascent begins with the information of every so-manyth line; the covariance of the result uses all.
    pub information_stride: usize,
    /// Most evaluations of the likelihood in a round.
    pub max_iterations: usize,
    /// The fit ends when the step that is left is below this part of its standard deviations.
    pub tolerance_sigmas: f64,
    /// Where the fit begins.
    pub starts: Starts,
}

/// Where a fit of signals begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Starts {
    /// The guess alone: the top that is found depends on it.
    Guess,
    /// The guess, then core radii from 1.5 to 12 % of the spacing and heights about the first top.
    Several,
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
            starts: Starts::Several,
        }
    }
}
