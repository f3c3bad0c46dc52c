//! Estimators that work on an accumulated correlogram beside the periodogram and the models: lag window and pulse pair.
//!
//! Computes velocities from the mean biased correlogram of a region: CA-BT multiplies it by a Hann window and
//! transforms it; the pulse pair takes the phase of lag 1. Check: spectra evaluated frequency by frequency, tones, noise.

use num_complex::Complex;

use crate::error::Error;
use crate::estimators::{Estimator, GateVelocity, Quality, Refinement, SpectralPeak};
use crate::models::autoregressive::check_order;
use crate::window::{Sampling, Scratch, SignalKind};

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
        let step_rad = std::f64::consts::PI / reach_lags as f64;
        let weights: Vec<f64> = (0..reach_lags).map(|m| 0.5 + 0.5 * (step_rad * m as f64).cos()).collect();
        let triangle = |m: usize| 1.0 - m as f64 / lags as f64;
        let seen: Vec<f64> = weights.iter().enumerate().map(|(m, weight)| weight * triangle(m)).collect();
        let peak =
            SpectralPeak::new(sampling, kind, reach_lags, padded_samples, refinement)?.with_lag_weights(&seen)?;
        Ok(Self { weights, lags, kind, peak })
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
    /// exp(2 pi i f / F_s) at the frequencies of the band.
    phasors: Vec<Complex<f64>>,
}

impl PulsePair {
    /// Plans the estimator for correlograms with `lags` lags, at least 2.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with less than 2 lags; [`Error::Band`] for an impossible band.
    pub fn new(sampling: &Sampling, kind: SignalKind, lags: usize) -> Result<Self, Error> {
        check_order(1, lags)?;
        let band = SpectralPeak::new(sampling, kind, lags, 4 * lags, Refinement::None)?;
        let rad_per_hz = std::f64::consts::TAU * sampling.period_s();
        let phasors =
            band.band_frequencies_hz().iter().map(|f_hz| Complex::from_polar(1.0, rad_per_hz * f_hz)).collect();
        Ok(Self { sampling: *sampling, kind, lags, band, phasors })
    }

    /// Lag 1 of the band-limited analytic signal.
    fn band_limited(&self, mean: &[f64], scratch: &mut Scratch) -> Option<Complex<f64>> {
        let density = self.band.band_density(mean, scratch).ok()?;
        Some(density.iter().zip(&self.phasors).map(|(s, phasor)| phasor * s).sum())
    }
}

impl Estimator for PulsePair {
    fn statistic_len(&self) -> usize {
        self.kind.lag_numbers(self.lags)
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        // all but the velocity is that of the spectrum in the band
        let peak = self.band.estimate(mean, scratch);
        if !matches!(peak.flag, Quality::Good | Quality::OutOfBand) {
            return peak;
        }
        let lag = match self.kind {
            SignalKind::Complex => Some(self.kind.lag(mean, 1)),
            SignalKind::Real => self.band_limited(mean, scratch),
        };
        let Some(lag) = lag else {
            return GateVelocity::none(Quality::Invalid);
        };
        let frequency_hz = lag.arg() / std::f64::consts::TAU * self.sampling.sample_rate_hz;
        let (low_hz, high_hz) = self.sampling.band_hz;
        let inside = (low_hz..=high_hz).contains(&frequency_hz);
        GateVelocity {
            velocity_m_s: self.sampling.velocity_m_s(frequency_hz),
            flag: if inside { peak.flag } else { Quality::OutOfBand },
            ..peak
        }
    }
}
