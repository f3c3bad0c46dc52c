//! Pulse pair: the phase of the first lag of an accumulated correlogram.
//!
//! Check: tones; white noise, which does not bias complex windows.

use num_complex::Complex;

use crate::error::Error;
use crate::estimators::{Estimator, GateVelocity, Quality, Refinement, SpectralPeak};
use crate::models::autoregressive::check_order;
use crate::window::{Sampling, Scratch, SignalKind};

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
        let mut phasors = Vec::new();
        for f_hz in band.band_frequencies_hz() {
            phasors.push(Complex::from_polar(1.0, rad_per_hz * f_hz));
        }
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
