//! The periodogram estimator as one plan.
//!
//! (29), corrected: |sum h(n) s(n) exp(-2 pi i k n / M)|^2 / sum h^2, divided by the sum of h^2 and not by N, so that
//! white noise reads its variance for every weighting. Check: the naive sum, white noise, and a tone's
//! velocity through (30). The default pads to 1024 frequencies and refines by a parabola;
//! [`PeriodogramPlan::literal`] does neither and stays on a grid of 3 m/s, as the equations are printed.

use crate::error::Error;
use crate::estimators::{GateVelocity, Refinement, SpectralPeak, estimate_window};
use crate::spectrum::Correlogram;
use crate::window::{Sample, Sampling, Scratch, Weighting};

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
    /// For windows of `window_samples` samples: Gaussian weighting, 1024 frequencies, parabola.
    ///
    /// # Errors
    /// As [`PeriodogramPlan::with`].
    pub fn new(sampling: &Sampling, window_samples: usize) -> Result<Self, Error> {
        let weighting = Weighting::default();
        Self::with(
            sampling,
            window_samples,
            weighting,
            1024,
            Refinement::Parabola,
        )
    }

    /// (29) and (30) as printed: as many frequencies as samples, no refinement.
    ///
    /// # Errors
    /// As [`PeriodogramPlan::with`].
    pub fn literal(
        sampling: &Sampling,
        window_samples: usize,
        weighting: Weighting,
    ) -> Result<Self, Error> {
        Self::with(
            sampling,
            window_samples,
            weighting,
            window_samples,
            Refinement::None,
        )
    }

    /// With the weighting h of the window, the number M of frequencies of the zero-padded spectrum over
    /// 0 .. F_s, and the placement of the peak between them.
    ///
    /// # Errors
    /// [`Error::Band`] or [`Error::OutOfRange`] if sampling, window or another argument makes no sense.
    pub fn with(
        sampling: &Sampling,
        window_samples: usize,
        weighting: Weighting,
        padded_samples: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        let statistic = Correlogram::new(weighting, window_samples)?;
        let weights = statistic.lag_weights();
        let estimator = SpectralPeak::new(sampling, S::KIND, &weights, padded_samples, refinement)?;
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
