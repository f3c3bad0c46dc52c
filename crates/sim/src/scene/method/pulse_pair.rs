//! The pulse pair: the phase of the first lag.

use super::EstimationMethod;
use crate::Error;
use crate::keys::keys;
use crate::scene::{Estimator, Scene};
use wakescope_estimate::{self as estimate, SignalKind, estimators};

keys! {
    /// Phase of the first lag.
    table PulsePair {}
}

/// Frequencies per sample of a window in the spectrum of the pulse pair, which serves power and
/// flag.
const FREQUENCIES_PER_SAMPLE: usize = 4;

impl EstimationMethod for PulsePair {
    fn estimator(
        &self,
        scene: &Scene,
        kind: SignalKind,
        lag_weights: &[f64],
    ) -> Result<Box<dyn estimate::Estimator>, Error> {
        let sampling = scene.sampling()?;
        Ok(Box::new(estimators::PulsePair::new(
            &sampling,
            kind,
            lag_weights,
        )?))
    }

    fn frequencies_key(&self) -> (&'static str, usize) {
        (Estimator::WINDOW_SAMPLES, FREQUENCIES_PER_SAMPLE)
    }

    fn frequencies(&self, e: &Estimator) -> usize {
        FREQUENCIES_PER_SAMPLE * e.window_samples
    }

    fn unused_keys(&self) -> &'static [(&'static str, &'static str)] {
        &[
            (Estimator::REFINEMENT, "refines no peak"),
            (Estimator::PADDED_SAMPLES, "has no spectrum"),
        ]
    }
}
