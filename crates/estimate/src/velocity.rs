//! Velocity of one gate with its power, quality and flag, and the search for the spectral peak.
//!
//! Computes (30) from the highest density inside the detector band. Check: a tone returns its velocity
//! within the leakage of its mirror image; zero, constant and out-of-band signals are flagged, never silently 0 m/s.
//!
//! A velocity beyond the unambiguous interval folds before any estimator sees it:
//! [`Sampling::folded_velocity_m_s`] tells what it reads.

use crate::error::Error;
use crate::sample::{Scratch, SignalKind};
use crate::sampling::Sampling;
use crate::spectrum::{Band, LagSpectrum, density_at};
use crate::statistic::Estimator;

/// What a velocity estimate is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Quality {
    /// A peak inside the band.
    Good,
    /// Nothing in the band: zero power, or less than the sidelobes of a constant. Velocity is NaN.
    NoSignal,
    /// The peak sits on an edge of the band, or what the band holds can be sidelobes of a line
    /// outside. The velocity is that of the highest density in the band and should not be used.
    OutOfBand,
    /// Samples or spectrum are not finite. Velocity is NaN.
    Invalid,
    /// No valid window in the region. Velocity is NaN.
    Empty,
}

/// Velocity estimate of one gate or map point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateVelocity {
    /// Radial velocity, positive away from the lidar \[m/s\]; NaN where `flag` says that there is none.
    pub velocity_m_s: f64,
    /// Mean power inside the detector band, signal and noise, in signal units squared.
    ///
    /// Not in a unit of its own: it overflows to infinity or vanishes where the square of the samples does.
    pub power: f64,
    /// Density of the peak over the mean density in the band; 1 for a flat spectrum.
    pub quality: f64,
    /// What the estimate is worth.
    pub flag: Quality,
}

impl GateVelocity {
    /// An estimate without velocity, for the stated reason.
    #[must_use]
    pub fn none(flag: Quality) -> Self {
        Self { velocity_m_s: f64::NAN, power: 0.0, quality: f64::NAN, flag }
    }

    /// Whether the flag is [`Quality::Good`].
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.flag == Quality::Good
    }
}

/// How the peak is placed between the frequencies of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Refinement {
    /// Not at all: the frequency of the highest bin, as (30) is printed.
    None,
    /// Parabola through the logarithm of the highest bin and its neighbours.
    #[default]
    Parabola,
    /// Maximum of the exact spectrum, by Newton steps from the parabola, to round-off.
    Exact,
}

/// Highest peak of the spectrum of an accumulated correlogram inside the detector band.
///
/// With all lags of a biased correlogram this is the periodogram estimator (29), (30).
#[derive(Clone)]
pub struct SpectralPeak {
    sampling: Sampling,
    spectrum: LagSpectrum,
    band: Band,
    refinement: Refinement,
}

/// Below this fraction of the highest density outside, the band may hold nothing but sidelobes: the
/// first sidelobe of an unweighted window is 0.047 of its main lobe.
const SIDELOBE: f64 = 0.05;

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
        Ok(Self { sampling: *sampling, band: Band::new(sampling, kind, padded_samples)?, spectrum, refinement })
    }

    /// The sampling that the search was planned for.
    #[must_use]
    pub fn sampling(&self) -> &Sampling {
        &self.sampling
    }

    /// Frequencies searched \[Hz\], in increasing order.
    #[must_use]
    pub fn band_frequencies_hz(&self) -> Vec<f64> {
        (0..self.band.bins).map(|bin| self.band.frequency_hz(bin as f64)).collect()
    }

    /// Densities at [`SpectralPeak::band_frequencies_hz`].
    ///
    /// # Errors
    /// [`Error::Length`] if `correlogram` has not the planned number of lags.
    pub fn band_density(&self, correlogram: &[f64], scratch: &mut Scratch) -> Result<Vec<f64>, Error> {
        let density = self.spectrum.density(correlogram, scratch)?;
        Ok(self.band.pieces(density).concat())
    }

    /// Fractional bin of the peak next to bin `top`, by parabola.
    fn parabola(&self, density: &[f64], top: i64) -> f64 {
        let floor = density[self.band.index(top)] * 1e-30;
        let [left, middle, right] = [-1, 0, 1].map(|k| density[self.band.index(top + k)].max(floor).ln());
        let curvature = left - 2.0 * middle + right;
        if curvature < 0.0 { top as f64 + (0.5 * (left - right) / curvature).clamp(-0.5, 0.5) } else { top as f64 }
    }

    /// Frequency \[Hz\] of the maximum of the exact spectrum within one bin of `top`.
    fn exact(&self, correlogram: &[f64], top: i64, start: f64) -> f64 {
        let kind = self.spectrum.kind();
        let at = |bin: f64| {
            let frequency_hz = self.band.frequency_hz(bin);
            density_at(correlogram, kind, frequency_hz, &self.sampling)
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
        self.band.frequency_hz(bin)
    }

    /// Flag of a search whose highest density in the band is `peak`, in bin `top`.
    fn flag(&self, density: &[f64], peak: f64, top: i64) -> Quality {
        let padded = density.len();
        let (place, highest) = highest(density);
        if peak < SIDELOBE * highest {
            // distance from 0 Hz in units of the resolution 1/N, N lags wide windows
            let from_zero = place.min(padded - place) as f64 / padded as f64;
            let resolution = 1.0 / self.spectrum.lags() as f64;
            let constant = self.spectrum.kind() == SignalKind::Real && from_zero < resolution;
            return if constant { Quality::NoSignal } else { Quality::OutOfBand };
        }
        let edge = top == 0 || top + 1 == self.band.bins as i64;
        if edge && !self.band.cyclic { Quality::OutOfBand } else { Quality::Good }
    }
}

impl Estimator for SpectralPeak {
    fn statistic_len(&self) -> usize {
        self.spectrum.kind().lag_numbers(self.spectrum.lags())
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        if !mean.iter().all(|value| value.is_finite()) {
            return GateVelocity::none(Quality::Invalid);
        }
        if mean.first().is_none_or(|power| *power <= 0.0) {
            return GateVelocity::none(Quality::NoSignal);
        }
        let Ok(density) = self.spectrum.density(mean, scratch) else {
            return GateVelocity::none(Quality::Invalid);
        };
        let bins = self.band.bins;
        let pieces = self.band.pieces(density);
        let [(left, low), (right, high)] = pieces.map(highest);
        let (top, peak) = if high > low { (pieces[0].len() + right, high) } else { (left, low) };
        let sum: f64 = pieces.iter().flat_map(|piece| piece.iter()).sum();
        let top = top as i64;
        let sides = match self.spectrum.kind() {
            SignalKind::Real => 2.0,
            SignalKind::Complex => 1.0,
        };
        let flag = self.flag(density, peak, top);
        let start = match self.refinement {
            Refinement::None => top as f64,
            _ => self.parabola(density, top),
        };
        let frequency_hz = match (self.refinement, flag) {
            (Refinement::Exact, Quality::Good) => self.exact(mean, top, start),
            _ => self.band.frequency_hz(start),
        };
        let velocity_m_s = match flag {
            Quality::NoSignal => f64::NAN,
            _ => self.sampling.velocity_m_s(frequency_hz),
        };
        GateVelocity {
            velocity_m_s,
            power: sides * sum / self.spectrum.padded_samples() as f64,
            quality: peak * bins as f64 / sum,
            flag,
        }
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
