//! Estimators that work on an accumulated correlogram beside the periodogram and the models: lag window and pulse pair.
//!
//! Computes velocities from the mean biased correlogram of a region: CA-BT multiplies it by a Hann window and
//! transforms it; the pulse pair takes the phase of lag 1. Check: spectra evaluated frequency by frequency, tones, noise.

use num_complex::Complex;

use crate::error::Error;
use crate::estimators::{
    Estimator, GateVelocity, Quality, Refinement, SpectralPeak, model_lag_weights,
};
use crate::models::autoregressive::check_order;
use crate::window::{Sampling, Scratch, SignalKind};

/// Peak of the transform of the accumulated correlogram times a Hann lag window (Blackman and Tukey 1958).
#[derive(Clone)]
pub struct LagWindowPeak {
    weights: Vec<f64>,
    peak: SpectralPeak,
    /// The same of all lags, whose peak shows the width where the lag window's fills the band.
    sharp: SpectralPeak,
}

impl LagWindowPeak {
    /// Plans the lag window w_m = (1 + cos(pi m / `reach_lags`)) / 2, which falls to 0 at lag `reach_lags`, for
    /// correlograms as [`SpectralPeak::new`] takes them, and the search over `padded_samples` frequencies. A reach of 16 suits 64 samples.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless 1 <= `reach_lags` < lags; [`Error::Band`] for an impossible band.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        lag_weights: &[f64],
        reach_lags: usize,
        padded_samples: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        check_order(reach_lags, lag_weights.len())?;
        let weights = model_lag_weights(reach_lags - 1);
        let seen: Vec<f64> = weights
            .iter()
            .zip(lag_weights)
            .map(|(weight, own)| weight * own)
            .collect();
        let [peak, sharp] = [&seen, lag_weights].map(|lag_weights| {
            SpectralPeak::new(sampling, kind, lag_weights, padded_samples, refinement)
        });
        Ok(Self {
            weights,
            peak: peak?,
            sharp: sharp?,
        })
    }

    /// The peak of the lag-windowed spectrum alone, without a width.
    pub(crate) fn smooth(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        let mut numbers = std::mem::take(&mut scratch.numbers);
        numbers.clear();
        numbers.extend(self.peak.search.kind.weighted_lags(mean, &self.weights));
        let estimate = self.peak.estimate(&numbers, scratch);
        scratch.numbers = numbers;
        GateVelocity {
            spread_m2_s2: f64::NAN,
            ..estimate
        }
    }
}

impl Estimator for LagWindowPeak {
    fn statistic_len(&self) -> usize {
        self.sharp.statistic_len()
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        let estimate = self.smooth(mean, scratch);
        let sharp = self.sharp.estimate(mean, scratch);
        let sampling = self.peak.sampling();
        let resolution_m_s =
            0.5 * sampling.wavelength_m * sampling.sample_rate_hz / self.weights.len() as f64;
        // the width of another peak is not that of this one
        let is_one = (sharp.velocity_m_s - estimate.velocity_m_s).abs() < resolution_m_s;
        let GateVelocity {
            spread_m2_s2,
            resolution_m2_s2,
            ..
        } = if is_one { sharp } else { estimate };
        GateVelocity {
            spread_m2_s2,
            resolution_m2_s2,
            ..estimate
        }
    }
}

/// Pulse pair: the phase of lag 1 (Miller and Rochwarger 1972), a first moment on the circle of frequencies.
///
/// Complex windows use lag 1 as it is, which white noise does not bias. Real windows have no phase: their lag 1 is
/// rebuilt from the spectrum inside the detector band, and the noise in the band pulls the velocity to the middle of the band by
/// the share of its power.
#[derive(Clone)]
pub struct PulsePair {
    band: SpectralPeak,
    /// exp(2 pi i f / F_s) at the frequencies of the band.
    phasors: Vec<Complex<f64>>,
}

impl PulsePair {
    /// Plans the estimator for correlograms as [`SpectralPeak::new`] takes them, with at least 2 lags.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with less than 2 lags; [`Error::Band`] for an impossible band.
    pub fn new(sampling: &Sampling, kind: SignalKind, lag_weights: &[f64]) -> Result<Self, Error> {
        check_order(1, lag_weights.len())?;
        let band = SpectralPeak::new(
            sampling,
            kind,
            lag_weights,
            4 * lag_weights.len(),
            Refinement::None,
        )?;
        let rad_per_hz = std::f64::consts::TAU * sampling.period_s();
        let phasor = |f_hz: f64| Complex::from_polar(1.0, rad_per_hz * f_hz);
        let phasors = band.band_frequencies_hz().into_iter().map(phasor).collect();
        Ok(Self { band, phasors })
    }
}

impl Estimator for PulsePair {
    fn statistic_len(&self) -> usize {
        self.band.statistic_len()
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        // all but the velocity is that of the spectrum in the band
        let peak = self.band.estimate(mean, scratch);
        if !matches!(peak.flag, Quality::Good | Quality::OutOfBand) {
            return peak;
        }
        let lag: Complex<f64> = match self.band.search.kind {
            SignalKind::Complex => SignalKind::Complex.lag(mean, 1),
            // lag 1 of the band-limited analytic signal
            SignalKind::Real => match self.band.band_density(mean, scratch) {
                Ok(density) => density
                    .iter()
                    .zip(&self.phasors)
                    .map(|(s, phasor)| phasor * s)
                    .sum(),
                Err(_) => return GateVelocity::none(Quality::Invalid),
            },
        };
        let sampling = self.band.sampling();
        let frequency_hz = lag.arg() / std::f64::consts::TAU * sampling.sample_rate_hz;
        let (low_hz, high_hz) = sampling.band_hz;
        let inside = (low_hz..=high_hz).contains(&frequency_hz);
        GateVelocity {
            velocity_m_s: sampling.velocity_m_s(frequency_hz),
            flag: if inside {
                peak.flag
            } else {
                Quality::OutOfBand
            },
            ..peak
        }
    }
}
