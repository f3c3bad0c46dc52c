//! The mean periodogram of the pulses of one line at one range.

use super::EstimationMethod;
use crate::keys::{Checker, keys};
use crate::scene::{Estimator, RegionRadius};

keys! {
    /// Mean periodogram of the pulses of one line at one range.
    table Periodogram {}
}

impl EstimationMethod for Periodogram {
    fn unused_keys(&self) -> &'static [(&'static str, &'static str)] {
        &[(Estimator::RADIUS, "has no region")]
    }

    fn check(&self, e: &Estimator, c: &mut Checker<'_>) {
        let allowed = "another one with estimator.radius: \"periodogram\" has no region";
        c.require(
            e.radius == (RegionRadius::Fixed {}),
            "estimator.method.kind",
            "periodogram",
            allowed,
        );
    }
}
