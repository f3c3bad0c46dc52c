//! Search for the spectral peak inside the detector band: the periodogram estimator (29), (30).
//!
//! Computes the velocity of the highest density in the band, refined between the frequencies of the grid. Check: a
//! tone returns its velocity within the leakage of its mirror image; zero, constant and out-of-band
//! signals are flagged.

use crate::error::Error;
use crate::sample::{Scratch, SignalKind};
use crate::sampling::Sampling;
use crate::spectrum::{Band, LagSpectrum, density_at};
use crate::statistic::Estimator;
use crate::velocity::{GateVelocity, Quality, Refinement};

/// Below this fraction of the highest density outside, the band may hold nothing but sidelobes: the
/// first sidelobe of an unweighted window is 0.047 of its main lobe.
const SIDELOBE: f64 = 0.05;

/// The flag of a mean correlogram that cannot hold a velocity: not finite, or without power.
pub(crate) fn unusable(correlogram: &[f64]) -> Option<Quality> {
    if !correlogram.iter().all(|value| value.is_finite()) {
        Some(Quality::Invalid)
    } else if correlogram.first().is_none_or(|power| *power <= 0.0) {
        Some(Quality::NoSignal)
    } else {
        None
    }
}

/// The peak search on any density over 0 .. F_s, whatever made it.
#[derive(Debug, Clone)]
pub(crate) struct PeakSearch {
    pub(crate) sampling: Sampling,
    pub(crate) band: Band,
    kind: SignalKind,
    padded: usize,
    /// A line closer to 0 Hz than this \[cycles per sample\] counts as a constant.
    resolution: f64,
}

/// What the search found.
pub(crate) struct Located {
    pub(crate) top: i64,
    /// Fractional bin of the peak in the band.
    pub(crate) bin: f64,
    peak: f64,
    sum: f64,
    pub(crate) flag: Quality,
}

impl PeakSearch {
    pub(crate) fn new(sampling: &Sampling, kind: SignalKind, padded: usize, resolution: f64) -> Result<Self, Error> {
        let band = Band::new(sampling, kind, padded)?;
        Ok(Self { sampling: *sampling, band, kind, padded, resolution })
    }

    /// Highest density in the band, by bin or by parabola through its logarithm.
    pub(crate) fn locate(&self, density: &[f64], refinement: Refinement) -> Located {
        let pieces = self.band.pieces(density);
        let [(left, low), (right, high)] = pieces.map(highest);
        let (top, peak) = if high > low { (pieces[0].len() + right, high) } else { (left, low) };
        let sum = pieces.iter().flat_map(|piece| piece.iter()).sum();
        let top = top as i64;
        let bin = match refinement {
            Refinement::None => top as f64,
            _ => self.parabola(density, top),
        };
        Located { top, bin, peak, sum, flag: self.flag(density, peak, top) }
    }

    /// The estimate for a peak placed at `frequency_hz`.
    pub(crate) fn velocity(&self, found: &Located, frequency_hz: f64) -> GateVelocity {
        let sides = match self.kind {
            SignalKind::Real => 2.0,
            SignalKind::Complex => 1.0,
        };
        let velocity_m_s = match found.flag {
            Quality::NoSignal => f64::NAN,
            _ => self.sampling.velocity_m_s(frequency_hz),
        };
        GateVelocity {
            velocity_m_s,
            power: sides * found.sum / self.padded as f64,
            quality: found.peak * self.band.bins as f64 / found.sum,
            flag: found.flag,
        }
    }

    /// Fractional bin of the peak next to bin `top`, by parabola.
    fn parabola(&self, density: &[f64], top: i64) -> f64 {
        let floor = density[self.band.index(top)] * 1e-30;
        let [left, middle, right] = [-1, 0, 1].map(|k| density[self.band.index(top + k)].max(floor).ln());
        let curvature = left - 2.0 * middle + right;
        if curvature < 0.0 { top as f64 + (0.5 * (left - right) / curvature).clamp(-0.5, 0.5) } else { top as f64 }
    }

    /// Flag of a search whose highest density in the band is `peak`, in bin `top`.
    fn flag(&self, density: &[f64], peak: f64, top: i64) -> Quality {
        let (place, highest) = highest(density);
        if peak < SIDELOBE * highest {
            let from_zero = place.min(self.padded - place) as f64 / self.padded as f64;
            let constant = self.kind == SignalKind::Real && from_zero < self.resolution;
            return if constant { Quality::NoSignal } else { Quality::OutOfBand };
        }
        let edge = top == 0 || top + 1 == self.band.bins as i64;
        if edge && !self.band.cyclic { Quality::OutOfBand } else { Quality::Good }
    }
}

/// Highest peak of the spectrum of an accumulated correlogram inside the detector band.
///
/// With all lags of a biased correlogram this is the periodogram estimator (29), (30).
#[derive(Clone)]
pub struct SpectralPeak {
    spectrum: LagSpectrum,
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
        let spectrum = LagSpectrum::new(kind, lags, padded_samples)?;
        let search = PeakSearch::new(sampling, kind, padded_samples, 1.0 / lags as f64)?;
        Ok(Self { spectrum, search, refinement })
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

    /// Densities at [`SpectralPeak::band_frequencies_hz`].
    ///
    /// # Errors
    /// [`Error::Length`] if `correlogram` has not the planned number of lags.
    pub fn band_density(&self, correlogram: &[f64], scratch: &mut Scratch) -> Result<Vec<f64>, Error> {
        let density = self.spectrum.density(correlogram, scratch)?;
        Ok(self.search.band.pieces(density).concat())
    }

    /// Frequency \[Hz\] of the maximum of the exact spectrum within one bin of `top`.
    fn exact(&self, correlogram: &[f64], top: i64, start: f64) -> f64 {
        let kind = self.spectrum.kind();
        let at = |bin: f64| {
            let frequency_hz = self.search.band.frequency_hz(bin);
            density_at(correlogram, kind, frequency_hz, &self.search.sampling)
        };
        // d(angle)/d(bin) turns the derivatives into those per bin
        let per_bin = std::f64::consts::TAU / self.spectrum.padded_samples() as f64;
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
            if moved < 1e-12 * self.spectrum.padded_samples() as f64 {
                break;
            }
        }
        self.search.band.frequency_hz(bin)
    }
}

impl Estimator for SpectralPeak {
    fn statistic_len(&self) -> usize {
        self.spectrum.kind().lag_numbers(self.spectrum.lags())
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        if let Some(flag) = unusable(mean) {
            return GateVelocity::none(flag);
        }
        let Ok(density) = self.spectrum.density(mean, scratch) else {
            return GateVelocity::none(Quality::Invalid);
        };
        let found = self.search.locate(density, self.refinement);
        let frequency_hz = match (self.refinement, found.flag) {
            (Refinement::Exact, Quality::Good) => self.exact(mean, found.top, found.bin),
            _ => self.search.band.frequency_hz(found.bin),
        };
        self.search.velocity(&found, frequency_hz)
    }
}

/// Place and value of the first highest number; (0, -inf) if there is none.
fn highest(values: &[f64]) -> (usize, f64) {
    // independent lanes, so that the comparisons need not wait for each other
    let mut lanes = [f64::NEG_INFINITY; 8];
    let chunks = values.chunks_exact(8);
    let rest = chunks.remainder();
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane = if *value > *lane { *value } else { *lane };
        }
    }
    let highest = lanes.iter().chain(rest).copied().fold(f64::NEG_INFINITY, f64::max);
    (values.iter().position(|value| *value == highest).unwrap_or(0), highest)
}
