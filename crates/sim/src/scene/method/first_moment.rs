//! The first moment: the mean of the main peak of the spectrum.

use super::{EstimationMethod, warning_unless_rectangular};
use crate::Error;
use crate::keys::keys;
use crate::scene::{Estimator, Scene};
use wakescope_estimate::{self as estimate, SignalKind, estimators};

keys! {
    /// Mean of the main peak of the spectrum.
    table FirstMoment {
        /// Half width of the averaged interval of the spectrum, in standard deviations of the peak.
        moment_reach: f64 = 3.5 => 0.1..=100.0,
    }
}

impl EstimationMethod for FirstMoment {
    fn estimator(
        &self,
        scene: &Scene,
        kind: SignalKind,
        lag_weights: &[f64],
    ) -> Result<Box<dyn estimate::Estimator>, Error> {
        Ok(Box::new(estimators::FirstMoment::new(
            &scene.sampling()?,
            kind,
            lag_weights,
            scene.estimator.padded_samples,
            self.moment_reach,
        )?))
    }

    fn unused_keys(&self) -> &'static [(&'static str, &'static str)] {
        &[(Estimator::REFINEMENT, "refines no peak")]
    }

    fn warning(&self, e: &Estimator) -> Option<String> {
        warning_unless_rectangular(e)
    }
}
