//! Estimators that work on an accumulated correlogram beside the periodogram: AR peak (CA), lag window, pulse pair.
//!
//! Computes velocities from the mean biased correlogram of a region: CA is the peak of the AR spectrum (32) of order 16 in the
//! literal form; the lag-window form multiplies the correlogram by a Hann window and transforms it. Check: both against spectra
//! evaluated frequency by frequency, a stored window, and tones.

use num_complex::Complex;

use crate::autoregressive::check_order;
use crate::error::Error;
use crate::peak::{PeakSearch, SpectralPeak, unusable};
use crate::sample::{Scratch, SignalKind};
use crate::sampling::Sampling;
use crate::spectrum::LagSpectrum;
use crate::statistic::Estimator;
use crate::velocity::{GateVelocity, Quality, Refinement};

/// CA: peak of the autoregressive spectrum of the accumulated correlogram in the detector band.
#[derive(Clone)]
pub struct AutoregressivePeak {
    order: usize,
    lags: usize,
    kind: SignalKind,
    inverse: LagSpectrum,
    search: PeakSearch,
    refinement: Refinement,
}

impl AutoregressivePeak {
    /// Plans AR(`order`) of correlograms with `lags` lags and a search over `padded_samples` frequencies.
    ///
    /// The chapter uses order 16; 2048 frequencies or more resolve its peaks. [`Refinement::Exact`] counts as
    /// the parabola.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless 1 <= `order` < `lags`; [`Error::Band`] for an impossible band.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        lags: usize,
        order: usize,
        padded_samples: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        check_order(order, lags)?;
        Ok(Self {
            order,
            lags,
            kind,
            inverse: LagSpectrum::new(kind, order + 1, padded_samples)?,
            search: PeakSearch::new(sampling, kind, padded_samples, 1.0 / lags as f64)?,
            refinement,
        })
    }
}

impl Estimator for AutoregressivePeak {
    fn statistic_len(&self) -> usize {
        self.kind.lag_numbers(self.lags)
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        if let Some(flag) = unusable(mean) {
            return GateVelocity::none(flag);
        }
        let mut model = std::mem::take(&mut scratch.model);
        let mut numbers = std::mem::take(&mut scratch.numbers);
        let solved = model.solve(mean, self.kind, self.order).is_ok();
        let mut estimate = GateVelocity::none(Quality::Invalid);
        if solved {
            model.inverse_lags(self.kind, &mut numbers);
            if self.inverse.density(&numbers, scratch).is_ok() {
                // a pole on the circle to rounding must not turn the density negative or infinite
                let least = f64::MIN_POSITIVE.max(1e-300 * model.noise_power);
                for value in &mut scratch.density {
                    *value = model.noise_power / value.max(least);
                }
                let found = self.search.locate(&scratch.density, self.refinement);
                estimate = self.search.velocity(&found, self.search.band.frequency_hz(found.bin));
            }
        }
        scratch.model = model;
        scratch.numbers = numbers;
        estimate
    }
}

/// Peak of the transform of the accumulated correlogram times a Hann lag window (Blackman and Tukey 1958).
#[derive(Clone)]
pub struct LagWindowPeak {
    weights: Vec<f64>,
    lags: usize,
    kind: SignalKind,
    peak: SpectralPeak,
}

impl LagWindowPeak {
    /// Plans the lag window w_m = (1 + cos(pi m / `reach_lags`)) / 2, which falls to 0 at lag `reach_lags`, for
    /// correlograms with `lags` lags, and the search over `padded_samples` frequencies. A reach of 16 suits 64 samples.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless 1 <= `reach_lags` < `lags`; [`Error::Band`] for an impossible band.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        lags: usize,
        reach_lags: usize,
        padded_samples: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        check_order(reach_lags, lags)?;
        let turn = std::f64::consts::PI / reach_lags as f64;
        Ok(Self {
            weights: (0..reach_lags).map(|m| 0.5 + 0.5 * (turn * m as f64).cos()).collect(),
            lags,
            kind,
            peak: SpectralPeak::new(sampling, kind, reach_lags, padded_samples, refinement)?,
        })
    }
}

impl Estimator for LagWindowPeak {
    fn statistic_len(&self) -> usize {
        self.kind.lag_numbers(self.lags)
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        let per_lag = self.kind.lag_numbers(1);
        let mut numbers = std::mem::take(&mut scratch.numbers);
        numbers.clear();
        numbers.extend(
            mean.iter()
                .enumerate()
                .map_while(|(place, value)| self.weights.get(place / per_lag).map(|weight| value * weight)),
        );
        let estimate = self.peak.estimate(&numbers, scratch);
        scratch.numbers = numbers;
        estimate
    }
}

/// Pulse pair: the phase of lag 1 (Miller and Rochwarger 1972), a first moment on the circle of frequencies.
///
/// Complex windows use lag 1 as it is, which white noise does not bias. Real windows have no phase: their lag 1 is
/// rebuilt from the spectrum inside the detector band, and the noise in the band pulls the velocity to the middle of the band by
/// the share of its power.
#[derive(Clone)]
pub struct PulsePair {
    sampling: Sampling,
    kind: SignalKind,
    lags: usize,
    band: SpectralPeak,
}

impl PulsePair {
    /// Plans the estimator for correlograms with `lags` lags, at least 2.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with less than 2 lags; [`Error::Band`] for an impossible band.
    pub fn new(sampling: &Sampling, kind: SignalKind, lags: usize) -> Result<Self, Error> {
        check_order(1, lags)?;
        let band = SpectralPeak::new(sampling, kind, lags, 4 * lags, Refinement::None)?;
        Ok(Self { sampling: *sampling, kind, lags, band })
    }

    /// Lag 1 of the band-limited analytic signal, and its lag 0.
    fn band_limited(&self, mean: &[f64], scratch: &mut Scratch) -> Option<(Complex<f64>, f64)> {
        let density = self.band.band_density(mean, scratch).ok()?;
        let frequencies_hz = self.band.band_frequencies_hz();
        let turn = std::f64::consts::TAU * self.sampling.period_s();
        let lag = density.iter().zip(frequencies_hz).map(|(s, f_hz)| Complex::from_polar(*s, turn * f_hz)).sum();
        Some((lag, density.iter().sum()))
    }
}

impl Estimator for PulsePair {
    fn statistic_len(&self) -> usize {
        self.kind.lag_numbers(self.lags)
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        // flags and power are those of the spectrum in the band
        let peak = self.band.estimate(mean, scratch);
        if !matches!(peak.flag, Quality::Good | Quality::OutOfBand) {
            return peak;
        }
        let lag = match self.kind {
            SignalKind::Complex => Some((self.kind.lag(mean, 1), self.kind.lag(mean, 0).re)),
            SignalKind::Real => self.band_limited(mean, scratch),
        };
        let Some((lag, power)) = lag else {
            return GateVelocity::none(Quality::Invalid);
        };
        let frequency_hz = lag.arg() / std::f64::consts::TAU * self.sampling.sample_rate_hz;
        let (low_hz, high_hz) = self.sampling.band_hz;
        let inside = (low_hz..=high_hz).contains(&frequency_hz);
        GateVelocity {
            velocity_m_s: self.sampling.velocity_m_s(frequency_hz),
            quality: lag.norm() / power,
            flag: if inside { peak.flag } else { Quality::OutOfBand },
            ..peak
        }
    }
}
