//! The methods of estimation: what the rest of the program asks of one, and the list of all.
//!
//! A method is one file, with its keys and its [`EstimationMethod`], and one line in [`Method`].

mod autoregressive;
mod first_moment;
mod likelihood;
mod periodogram;
mod periodogram_accumulation;
mod pulse_pair;

pub use autoregressive::Autoregressive;
pub use first_moment::FirstMoment;
pub use likelihood::Likelihood;
pub use periodogram::Periodogram;
pub use periodogram_accumulation::PeriodogramAccumulation;
pub use pulse_pair::PulsePair;

use super::{Estimator, Scene, Weighting};
use crate::Error;
use crate::keys::{Checker, keys};
use wakescope_estimate::spectrum::Taper;
use wakescope_estimate::{self as estimate, SignalKind, SpectralPeak};

keys! {
    /// Estimator of the map, with its keys.
    kinds Method by "kind" with EstimationMethod {
        /// Mean periodogram of the pulses of one line at one range, no region.
        "periodogram" => Periodogram(Periodogram),
        /// PA: mean periodogram of all windows of the region (Table 3).
        "periodogram_accumulation" => PeriodogramAccumulation(PeriodogramAccumulation),
        /// CA: peak of the autoregressive spectrum of the mean correlogram (Table 3).
        "autoregressive" => Autoregressive(Autoregressive),
        /// Phase of the first lag.
        "pulse_pair" => PulsePair(PulsePair),
        /// Mean of the main peak of the spectrum.
        "first_moment" => FirstMoment(FirstMoment),
        /// Maximum likelihood of the velocity for the known pulse, by tapers.
        "likelihood" => Likelihood(Likelihood),
    }
}

/// A method of estimation. By default it is the peak of the spectrum of all lags of weighted windows.
pub(crate) trait EstimationMethod {
    /// The estimator of a mean correlogram whose lags have `lag_weights`.
    ///
    /// # Errors
    /// Fails if the estimator refuses the scene; a checked scene is not refused.
    fn estimator(
        &self,
        scene: &Scene,
        kind: SignalKind,
        lag_weights: &[f64],
    ) -> Result<Box<dyn estimate::Estimator>, Error> {
        let e = &scene.estimator;
        Ok(Box::new(SpectralPeak::new(
            &scene.sampling()?,
            kind,
            lag_weights,
            e.padded_samples,
            e.refinement,
        )?))
    }

    /// The tapers of the windows; `snr` is the signal-to-noise ratio for which they are planned if
    /// the scene requests no other.
    ///
    /// # Errors
    /// Fails if a covariance cannot be diagonalised.
    fn tapers(
        &self,
        scene: &Scene,
        _pulse: &wakescope_signal::Pulse,
        _snr: f64,
    ) -> Result<Vec<Taper>, Error> {
        let weights = scene.weighting().weights(scene.estimator.window_samples)?;
        Ok(vec![Taper::unit(weights)?])
    }

    /// Number of lags that are needed of an unweighted window; `None`: all.
    fn lags(&self) -> Option<usize> {
        None
    }

    /// Weights of the lags of the spectrum that is tested against noise, other than those of the
    /// windows.
    fn test_lag_weights(&self) -> Option<Vec<f64>> {
        None
    }

    /// Key that sets the number of frequencies of the spectrum, and frequencies per unit of its
    /// value.
    fn frequencies_key(&self) -> (&'static str, usize) {
        (Estimator::PADDED_SAMPLES, 1)
    }

    /// Number of frequencies of the spectrum over the sampling rate.
    fn frequencies(&self, e: &Estimator) -> usize {
        e.padded_samples
    }

    /// Keys of the scene that the method does not use, each with the reason.
    fn unused_keys(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }

    /// Whether the method uses a key of the scene.
    fn uses(&self, key: &str) -> bool {
        self.unused_keys().iter().all(|(unused, _)| *unused != key)
    }

    /// Checks limits between the keys of the method and those of all methods.
    fn check(&self, _e: &Estimator, _c: &mut Checker<'_>) {}

    /// What the user should know of the method with these keys.
    fn warning(&self, _e: &Estimator) -> Option<String> {
        None
    }

    /// Time to compute the lags of a window over that of one taper.
    fn window_cost(&self, _scene: &Scene) -> f64 {
        1.0
    }

    /// Number of covariances of a window that are diagonalised when the estimator is planned.
    fn covariances(&self) -> f64 {
        0.0
    }
}

/// The warning of methods that are accurate for unweighted windows only.
fn warning_unless_rectangular(e: &Estimator) -> Option<String> {
    if e.weighting == Weighting::Rectangular {
        return None;
    }
    let text = "this estimator.method is meant for windows without weighting: estimator.weighting = \"rectangular\"";
    Some(text.into())
}
