//! Peak of the spectrum of an accumulated correlogram inside the detector band: the periodogram estimator (29), (30).
//!
//! Computes the velocity of the highest density in the band, refined between the frequencies of the grid. Check: a
//! tone returns its velocity within the leakage of its mirror image; zero, constant and out-of-band
//! signals are flagged.

use crate::error::Error;
use crate::estimators::search::{PeakSearch, unusable};
use crate::estimators::{Estimator, GateVelocity, Quality, Refinement};
use crate::window::{Sampling, Scratch, SignalKind};

/// Highest peak of the spectrum of an accumulated correlogram inside the detector band.
///
/// With all lags of a biased correlogram this is the periodogram estimator (29), (30).
#[derive(Clone)]
pub struct SpectralPeak {
    pub(crate) search: PeakSearch,
    refinement: Refinement,
}

impl SpectralPeak {
    /// Plans the search over `padded_samples` frequencies for correlograms whose lags carry the weights w_0 = 1, w_1, ... of their
    /// window ([`Correlogram::lag_weights`](crate::Correlogram::lag_weights)); spectral width and flag depend on them.
    ///
    /// # Errors
    /// [`Error::Band`] or [`Error::OutOfRange`] if band, lags or padding make no sense.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        lag_weights: &[f64],
        padded_samples: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        let search = PeakSearch::new(sampling, kind, padded_samples, lag_weights)?;
        Ok(Self { search, refinement })
    }

    /// The sampling that the search was planned for.
    #[must_use]
    pub fn sampling(&self) -> &Sampling {
        &self.search.sampling
    }

    /// Frequencies searched \[Hz\], in increasing order.
    #[must_use]
    pub fn band_frequencies_hz(&self) -> Vec<f64> {
        (0..self.search.band.bins)
            .map(|bin| self.search.band.frequency_hz(bin as f64))
            .collect()
    }

    /// Densities at [`SpectralPeak::band_frequencies_hz`].
    ///
    /// # Errors
    /// [`Error::Length`] if `correlogram` has not the planned number of lags.
    pub fn band_density<'s>(
        &self,
        correlogram: &[f64],
        scratch: &'s mut Scratch,
    ) -> Result<&'s [f64], Error> {
        self.search
            .zoom
            .density_into(correlogram, &mut scratch.band)?;
        Ok(&scratch.band[1..=self.search.band.bins])
    }
}

impl Estimator for SpectralPeak {
    fn statistic_len(&self) -> usize {
        self.search.statistic_len()
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        if let Some(flag) = unusable(mean) {
            return GateVelocity::none(flag);
        }
        match self.search.find(mean, self.refinement, scratch) {
            Some(found) => self.search.velocity(&found),
            None => GateVelocity::none(Quality::Invalid),
        }
    }
}
