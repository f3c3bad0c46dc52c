//! The records of a scene in the terms of the estimators: sampling, windows, noise, and the
//! autocorrelation of the pulse.

use super::{
    DetectorSignal, Digitiser, EfficiencyOfPulse, NoiseModel, PulseDefinition, PulseShape,
};
use super::{Scene, Weighting, WindOfPulses};
use crate::{Error, SPEED_OF_LIGHT_M_S};
use num_complex::Complex;
use std::f64::consts::{LN_2, TAU};
use wakescope_estimate::bound::Noise;
use wakescope_estimate::{self as estimate, Sampling, SignalKind};

impl Scene {
    /// Samples recorded of each pulse: from `range_min_m` to `range_max_m`, ends included.
    pub fn samples_per_record(&self) -> usize {
        let length_m = self.scan.range_max_m - self.scan.range_min_m;
        (length_m / self.sample_spacing_m() + 1e-9) as usize + 1
    }

    /// Distance between samples, c T_s/2, m.
    pub fn sample_spacing_m(&self) -> f64 {
        0.5 * SPEED_OF_LIGHT_M_S / self.detector.sampling_hz
    }

    /// The 1/e half width sigma of |f|^2 in (7), s; for a sampled pulse that of the Gaussian with the same spread.
    pub fn pulse_sigma_s(&self) -> f64 {
        match &self.pulse.shape {
            PulseShape::Sampled(_) => self
                .pulse
                .simulated()
                .map_or(f64::NAN, |pulse| pulse.sigma_s()),
            PulseShape::Gaussian(shape) => shape.sigma_s(),
        }
    }

    /// Full width at half maximum of the power of the pulse, s; of a sampled one that of the Gaussian with the same spread.
    pub fn pulse_width_s(&self) -> f64 {
        match &self.pulse.shape {
            PulseShape::Gaussian(shape) if shape.definition == PulseDefinition::Fwhm => {
                shape.duration_s
            }
            _ => 2.0 * LN_2.sqrt() * self.pulse_sigma_s(),
        }
    }

    /// The key that gives the pulses of a line records which are not independent Gaussian vectors of
    /// one covariance, so that they are simulated one by one; `None` if no key does.
    pub(crate) fn key_of_records(&self) -> Option<&'static str> {
        let of_turbulence = self
            .refractive_turbulence()
            .is_some_and(|t| t.efficiency == EfficiencyOfPulse::Realisation);
        let keys = [
            (
                "scan.wind_of_pulses",
                self.scan.wind_of_pulses != WindOfPulses::default(),
            ),
            (
                "detector.digitiser",
                self.detector.digitiser != Digitiser::None {},
            ),
            ("atmosphere.turbulence.efficiency", of_turbulence),
            ("laser.linewidth_hz", self.laser.linewidth_hz > 0.0),
            (
                "telescope.reflection_db",
                self.telescope.reflection_db > f64::NEG_INFINITY,
            ),
        ];
        keys.into_iter().find(|(_, acts)| *acts).map(|(key, _)| key)
    }

    /// Sampling of the records.
    ///
    /// # Errors
    /// Fails if the estimators refuse the sampling; that of a checked scene is not refused.
    pub fn sampling(&self) -> Result<Sampling, Error> {
        let d = &self.detector;
        let wavelength_m = self.laser.wavelength_m;
        Ok(match d.signal {
            DetectorSignal::IntermediateFrequency => {
                let centre_hz = d.intermediate_frequency_hz;
                let half_hz = 0.5 * d.bandwidth_hz;
                let band_hz = (centre_hz - half_hz, centre_hz + half_hz);
                Sampling::new(d.sampling_hz, centre_hz, wavelength_m, band_hz)?
            }
            DetectorSignal::Baseband => {
                Sampling::baseband(d.sampling_hz, wavelength_m, d.bandwidth_hz)?
            }
        })
    }

    /// Whether the records are real or complex.
    pub(crate) fn signal_kind(&self) -> SignalKind {
        match self.detector.signal {
            DetectorSignal::IntermediateFrequency => SignalKind::Real,
            DetectorSignal::Baseband => SignalKind::Complex,
        }
    }

    /// The windows that are accumulated.
    ///
    /// # Errors
    /// Fails if the estimators refuse the windows; those of a checked scene are not refused.
    pub fn gates(&self) -> Result<estimate::Gates, Error> {
        let e = &self.estimator;
        let first_sample_time_s = 2.0 * self.scan.range_min_m / SPEED_OF_LIGHT_M_S;
        let gates =
            estimate::Gates::new(e.window_samples, e.window_step_samples, first_sample_time_s)?;
        Ok(gates)
    }

    /// Weighting of the windows; rectangular for a method with its own tapers, which together weight
    /// nearly all samples equally.
    pub fn weighting(&self) -> estimate::Weighting {
        if !self.estimator.is_weighted() {
            return estimate::Weighting::Rectangular;
        }
        match self.estimator.weighting {
            Weighting::Gaussian => estimate::Weighting::default(),
            Weighting::Rectangular => estimate::Weighting::Rectangular,
            Weighting::Hann => estimate::Weighting::Hann,
        }
    }

    /// Spectrum of the noise, if there is noise.
    pub(crate) fn noise_spectrum(&self) -> Option<Noise> {
        match self.detector.noise {
            NoiseModel::White => Some(Noise::White),
            NoiseModel::BandLimited => Some(Noise::Band { floor: 0.0 }),
            NoiseModel::None => None,
        }
    }

    /// Real part of [`Scene::pulse_correlation`], which is all of it for a pulse with a symmetric
    /// spectrum.
    pub(crate) fn real_pulse_correlation(&self, pulse: &wakescope_signal::Pulse) -> Vec<f64> {
        let correlation = self.pulse_correlation(pulse);
        correlation.into_iter().map(|value| value.re).collect()
    }

    /// Autocorrelation of the pulse at the lags of a record, as signals have it: the sum of f(t + lag)
    /// f*(t), its mean frequency removed; 1 at lag 0.
    ///
    /// `exp(-tau^2/(4 sigma^2))` for a Gaussian.
    pub(crate) fn pulse_correlation(&self, pulse: &wakescope_signal::Pulse) -> Vec<Complex<f64>> {
        let count = self.samples_per_record();
        let period_s = 1.0 / self.detector.sampling_hz;
        let mut correlation = vec![Complex::new(0.0, 0.0); count];
        if self.pulse.is_gaussian() {
            for (m, value) in correlation.iter_mut().enumerate() {
                let lag = m as f64 * period_s / pulse.sigma_s();
                *value = Complex::from((-0.25 * lag.powi(2)).exp());
            }
            return correlation;
        }
        // Fine enough for the spectrum of the pulse; the sum over a smooth pulse that ends at 0 converges fast.
        let parts = (16.0 * pulse.spectral_width_hz() * period_s).ceil();
        let parts = parts.max(1.0) as usize;
        let step_s = period_s / parts as f64;
        let (first_s, last_s) = pulse.support_s();
        let steps = ((last_s - first_s) / step_s).ceil() as usize;
        let turn = -TAU * pulse.mean_frequency_hz();
        let mut envelope = Vec::with_capacity(steps + 1);
        for i in 0..=steps {
            let time_s = first_s + i as f64 * step_s;
            let carrier = Complex::from_polar(1.0, turn * time_s);
            envelope.push(pulse.envelope_per_sqrt_s(time_s) * carrier);
        }
        let energy = lagged_product(&envelope, 0).re;
        for (m, value) in correlation.iter_mut().enumerate() {
            if m * parts <= steps {
                *value = lagged_product(&envelope, m * parts) / energy;
            }
        }
        correlation
    }
}

/// Sum of the products of samples `lag` apart, the earlier ones conjugate.
fn lagged_product(envelope: &[Complex<f64>], lag: usize) -> Complex<f64> {
    let mut sum = Complex::new(0.0, 0.0);
    for (late, early) in envelope[lag..].iter().zip(envelope) {
        sum += late * early.conj();
    }
    sum
}
