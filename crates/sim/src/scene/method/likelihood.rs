//! Maximum likelihood of the velocity for the known pulse, as a periodogram with several tapers.

use super::EstimationMethod;
use crate::Error;
use crate::keys::keys;
use crate::scene::{Estimator, Scene};
use ndarray::Array2;
use num_complex::Complex;
use wakescope_estimate::bound::{Noise, WindowModel};
use wakescope_estimate::estimators::likelihood_tapers;
use wakescope_estimate::spectrum::Taper;

keys! {
    /// Maximum likelihood of the velocity for the known pulse, by tapers.
    table Likelihood {
        /// Signal-to-noise ratio that the estimator assumes, dB; that of the scene if absent.
        likelihood_snr_db: Option<f64> = None => -100.0..=100.0,
    }
}

impl EstimationMethod for Likelihood {
    fn tapers(
        &self,
        scene: &Scene,
        pulse: &wakescope_signal::Pulse,
        snr: f64,
    ) -> Result<Vec<Taper>, Error> {
        let requested = self.likelihood_snr_db.map(|db| 10f64.powf(0.1 * db));
        let snr = requested.unwrap_or(snr).clamp(1e-8, 1e8);
        let n = scene.estimator.window_samples;
        // Tapers are real: those of the real part.
        let correlation = scene.real_pulse_correlation(pulse);
        let envelope = Array2::from_shape_fn((n, n), |(a, b)| {
            Complex::from(correlation.get(a.abs_diff(b)).copied().unwrap_or(0.0))
        });
        // The tapers are those of white noise and need no inverse, whatever the noise.
        let model = WindowModel::with_envelope(&scene.sampling()?, envelope, Noise::White)?;
        Ok(likelihood_tapers(&model, snr)?)
    }

    fn unused_keys(&self) -> &'static [(&'static str, &'static str)] {
        &[(Estimator::WEIGHTING, "has tapers of its own")]
    }

    fn window_cost(&self, scene: &Scene) -> f64 {
        // About as many tapers as a window has independent parts.
        let pulse_samples = scene.detector.sampling_hz * scene.pulse_sigma_s();
        let parts = scene.estimator.window_samples as f64 / pulse_samples.max(1.0);
        2.0 + 0.5 * parts
    }

    fn covariances(&self) -> f64 {
        1.0
    }
}
