//! Peak of the spectrum of an accumulated correlogram inside the detector band: the periodogram estimator (29), (30).
//!
//! Computes the velocity of the highest density in the band, refined between the frequencies of the grid. Check: a
//! tone returns its velocity within the leakage of its mirror image; zero, constant and out-of-band
//! signals are flagged.

use crate::error::{Error, length};
use crate::estimators::search::{PeakSearch, highest, unusable};
use crate::estimators::{Estimator, GateVelocity, Quality, Refinement};
use crate::spectrum::{LagSpectrum, ZoomSpectrum, density_at};
use crate::window::{Sampling, Scratch, SignalKind};

/// Highest peak of the spectrum of an accumulated correlogram inside the detector band.
///
/// With all lags of a biased correlogram this is the periodogram estimator (29), (30).
#[derive(Clone)]
pub struct SpectralPeak {
    kind: SignalKind,
    zoom: ZoomSpectrum,
    whole: LagSpectrum,
    search: PeakSearch,
    refinement: Refinement,
}

impl SpectralPeak {
    /// Plans the search over `padded_samples` frequencies for correlograms of `lags` lags.
    ///
    /// # Errors
    /// [`Error::Band`] or [`Error::OutOfRange`] if band, lags or padding make no sense.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        lags: usize,
        padded_samples: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        let whole = LagSpectrum::new(kind, lags, padded_samples)?;
        let unweighted: Vec<f64> = (0..lags).map(|m| 1.0 - m as f64 / lags as f64).collect();
        let search = PeakSearch::new(sampling, kind, padded_samples, &unweighted)?;
        let zoom = ZoomSpectrum::new(kind, lags, sampling, &search.band.with_neighbours_hz())?;
        Ok(Self { kind, zoom, whole, search, refinement })
    }

    /// The same for correlograms whose lags carry the weights w_0 = 1, w_1, ... of their window
    /// ([`Correlogram::lag_weights`](crate::Correlogram::lag_weights)); spectral width and flag depend on them.
    ///
    /// Without this call the weights of an unweighted window, 1 - m / N, are assumed.
    ///
    /// # Errors
    /// [`Error::Length`] if there are not as many weights as lags.
    pub fn with_lag_weights(mut self, lag_weights: &[f64]) -> Result<Self, Error> {
        length("lag_weights", self.zoom.lags(), lag_weights.len())?;
        self.search = PeakSearch::new(&self.search.sampling, self.kind, self.whole.padded_samples(), lag_weights)?;
        Ok(self)
    }

    /// The sampling that the search was planned for.
    #[must_use]
    pub fn sampling(&self) -> &Sampling {
        &self.search.sampling
    }

    /// Frequencies searched \[Hz\], in increasing order.
    #[must_use]
    pub fn band_frequencies_hz(&self) -> Vec<f64> {
        (0..self.search.band.bins).map(|bin| self.search.band.frequency_hz(bin as f64)).collect()
    }

    /// First of [`SpectralPeak::band_frequencies_hz`] and the distance between them \[Hz\].
    pub(crate) fn first_and_spacing_hz(&self) -> (f64, f64) {
        let first_hz = self.search.band.frequency_hz(0.0);
        (first_hz, self.search.band.frequency_hz(1.0) - first_hz)
    }

    /// Densities at [`SpectralPeak::band_frequencies_hz`].
    ///
    /// # Errors
    /// [`Error::Length`] if `correlogram` has not the planned number of lags.
    pub fn band_density<'s>(&self, correlogram: &[f64], scratch: &'s mut Scratch) -> Result<&'s [f64], Error> {
        self.zoom.density_into(correlogram, &mut scratch.band)?;
        Ok(&scratch.band[1..=self.search.band.bins])
    }

    /// Frequency \[Hz\] of the maximum of the exact spectrum within one bin of `top`.
    fn exact(&self, correlogram: &[f64], top: i64, start: f64) -> f64 {
        let padded = self.whole.padded_samples() as f64;
        let at = |bin: f64| {
            let frequency_hz = self.search.band.frequency_hz(bin);
            density_at(correlogram, self.kind, frequency_hz, &self.search.sampling)
        };
        // d(angle)/d(bin) turns the derivatives into those per bin
        let per_bin = std::f64::consts::TAU / padded;
        let (mut low, mut high) = (top as f64 - 1.0, top as f64 + 1.0);
        let mut bin = start;
        for _ in 0..60 {
            let [_, slope, curvature] = at(bin);
            if slope > 0.0 {
                low = bin;
            } else {
                high = bin;
            }
            let newton = bin - slope / (curvature * per_bin);
            let next = if curvature < 0.0 && newton > low && newton < high { newton } else { 0.5 * (low + high) };
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
        self.kind.lag_numbers(self.zoom.lags())
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        if let Some(flag) = unusable(mean) {
            return GateVelocity::none(flag);
        }
        let mut band = std::mem::take(&mut scratch.band);
        if self.zoom.density_into(mean, &mut band).is_err() {
            return GateVelocity::none(Quality::Invalid);
        }
        let found = self.search.locate(&band, self.refinement, mean, || {
            let density = self.whole.density(mean, scratch).ok()?;
            let (place, highest) = highest(density);
            Some((highest, place as f64 / density.len() as f64))
        });
        scratch.band = band;
        let frequency_hz = match (self.refinement, found.flag) {
            (Refinement::Exact, Quality::Good) => self.exact(mean, found.top, found.bin),
            _ => self.search.band.frequency_hz(found.bin),
        };
        self.search.velocity(&found, frequency_hz)
    }
}
