//! Peak of the spectrum of an accumulated correlogram inside the detector band: the periodogram estimator (29), (30).
//!
//! Computes the velocity of the highest density in the band, refined between the frequencies of the grid. Check: a
//! tone returns its velocity within the leakage of its mirror image; zero, constant and out-of-band
//! signals are flagged.

use crate::error::Error;
use crate::estimators::search::{PeakSearch, unusable};
use crate::estimators::{Estimator, GateVelocity, Quality, Refinement};
use crate::spectrum::density_at;
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
        let search = PeakSearch::new(
            sampling,
            kind,
            (padded_samples, padded_samples),
            lag_weights,
        )?;
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

    /// Frequency \[Hz\] of the maximum of the exact spectrum within one bin of `top`.
    fn exact(&self, correlogram: &[f64], top: i64, start: f64) -> f64 {
        let padded = self.search.padded as f64;
        let at = |bin: f64| {
            let frequency_hz = self.search.band.frequency_hz(bin);
            density_at(
                correlogram,
                self.search.kind,
                frequency_hz,
                &self.search.sampling,
            )
        };
        // d(angle)/d(bin) turns the derivatives into those per bin
        let per_bin = std::f64::consts::TAU / padded;
        let (mut low, mut high) = (top as f64 - 1.0, top as f64 + 1.0);
        let mut bin = start;
        for _ in 0..60 {
            let [_, slope, curvature] = at(bin);
            (low, high) = if slope > 0.0 { (bin, high) } else { (low, bin) };
            let newton = bin - slope / (curvature * per_bin);
            let next = if curvature < 0.0 && newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            let moved = (next - bin).abs();
            bin = next;
            if moved < 1e-12 * padded {
                break;
            }
        }
        self.search.band.frequency_hz(bin)
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
        let Some(found) = self.search.find(mean, self.refinement, false, scratch) else {
            return GateVelocity::none(Quality::Invalid);
        };
        let frequency_hz = match (self.refinement, found.flag) {
            (Refinement::Exact, Quality::Good) => self.exact(mean, found.top, found.bin),
            _ => self.search.band.frequency_hz(found.bin),
        };
        self.search.velocity(&found, frequency_hz)
    }
}
