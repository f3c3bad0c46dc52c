//! The periodogram estimator as one plan.
//!
//! (29), corrected: |sum h(n) s(n) exp(-2 pi i k n / M)|^2 / sum h^2, divided by the sum of h^2 and not by N, so that
//! white noise reads its variance for every weighting. Check: the naive sum, white noise, and a tone's
//! velocity through (30). The default pads to 1024 frequencies and refines by a parabola;
//! [`PeriodogramOptions::literal`] does neither and stays on a grid of 3 m/s, as the equations are printed.

use crate::error::Error;
use crate::estimators::{GateVelocity, Refinement, SpectralPeak, estimate_window};
use crate::spectrum::Correlogram;
use crate::window::{Sample, Sampling, Scratch, Weighting};

/// Choices of the periodogram estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodogramOptions {
    /// Weighting h of the window.
    pub weighting: Weighting,
    /// Frequencies M of the zero-padded spectrum over 0 .. F_s.
    pub padded_samples: usize,
    /// Placement of the peak between the frequencies.
    pub refinement: Refinement,
}

impl Default for PeriodogramOptions {
    /// Gaussian weighting, 1024 frequencies, parabola.
    fn default() -> Self {
        Self {
            weighting: Weighting::default(),
            padded_samples: 1024,
            refinement: Refinement::Parabola,
        }
    }
}

impl PeriodogramOptions {
    /// (29) and (30) as printed: as many frequencies as samples, no refinement.
    #[must_use]
    pub fn literal(weighting: Weighting, window_samples: usize) -> Self {
        Self {
            weighting,
            padded_samples: window_samples,
            refinement: Refinement::None,
        }
    }
}

/// The periodogram estimator: statistic and peak search, planned together.
///
/// `statistic` and `estimator` go to the accumulation as they are (PA).
#[derive(Clone)]
pub struct PeriodogramPlan<S> {
    /// Correlogram with all lags: carries the same information as the periodogram in fewer numbers.
    pub statistic: Correlogram<S>,
    /// Search for the peak of its spectrum.
    pub estimator: SpectralPeak,
}

impl<S: Sample> PeriodogramPlan<S> {
    /// Plans the estimator for windows of `window_samples` samples.
    ///
    /// # Errors
    /// [`Error::Band`] or [`Error::OutOfRange`] if sampling, window or options make no sense.
    pub fn new(
        sampling: &Sampling,
        window_samples: usize,
        options: &PeriodogramOptions,
    ) -> Result<Self, Error> {
        let statistic = Correlogram::new(options.weighting, window_samples)?;
        let weights = statistic.lag_weights();
        let estimator = SpectralPeak::new(
            sampling,
            S::KIND,
            &weights,
            options.padded_samples,
            options.refinement,
        )?;
        Ok(Self {
            statistic,
            estimator,
        })
    }

    /// Velocity of one window.
    ///
    /// # Errors
    /// [`Error::Length`] if the window has the wrong length.
    pub fn velocity(&self, window: &[S], scratch: &mut Scratch) -> Result<GateVelocity, Error> {
        estimate_window(&self.statistic, &self.estimator, window, scratch)
    }
}
