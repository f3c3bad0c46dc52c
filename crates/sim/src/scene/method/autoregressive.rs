//! CA: the peak of the autoregressive spectrum of the mean correlogram (Table 3).

use super::{EstimationMethod, warning_unless_rectangular};
use crate::Error;
use crate::keys::{Checker, keys};
use crate::scene::{Estimator, Scene};
use wakescope_estimate::estimators::{ModelPeak, model_lag_weights};
use wakescope_estimate::{self as estimate, SignalKind};

keys! {
    /// CA: peak of the autoregressive spectrum of the mean correlogram (Table 3).
    table Autoregressive {
        /// Order of the model.
        order: usize = 16 => 1..=65_535,
    }
}

impl EstimationMethod for Autoregressive {
    fn estimator(
        &self,
        scene: &Scene,
        kind: SignalKind,
        lag_weights: &[f64],
    ) -> Result<Box<dyn estimate::Estimator>, Error> {
        let e = &scene.estimator;
        Ok(Box::new(ModelPeak::new(
            &scene.sampling()?,
            kind,
            lag_weights.len(),
            self.order,
            e.padded_samples,
            e.refinement,
        )?))
    }

    fn lags(&self) -> Option<usize> {
        Some(self.order + 1)
    }

    fn test_lag_weights(&self) -> Option<Vec<f64>> {
        Some(model_lag_weights(self.order))
    }

    fn check(&self, e: &Estimator, c: &mut Checker<'_>) {
        c.compare(
            ["estimator.method.order", Estimator::WINDOW_SAMPLES],
            [self.order, e.window_samples],
            "below",
        );
    }

    fn warning(&self, e: &Estimator) -> Option<String> {
        warning_unless_rectangular(e)
    }
}
