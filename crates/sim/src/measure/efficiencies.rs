//! Efficiency curves that several scans share, each computed once.
//!
//! A curve is known by what it depends on: laser, telescope, turbulence, the seed of its phase screens, ranges. Check: scenes
//! that differ in anything else share a curve, and the curve is that of the scene by itself.

use crate::Error;
use crate::measure::instrument::Instrument;
use crate::measure::profile::{OF_SCREENS, Screens, efficiency_at, turbulence};
use crate::measure::progress::Observer;
use crate::plan::{Plan, Stage};
use crate::scene::{Scene, hash_of};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use wakescope_optics::{EfficiencyProfile, curved_ranges_m};

/// Values by the hash of what they depend on.
#[derive(Debug)]
pub(crate) struct Known<T>(Mutex<HashMap<String, Arc<T>>>);

impl<T> Default for Known<T> {
    fn default() -> Self {
        Self(Mutex::new(HashMap::new()))
    }
}

impl<T> Known<T> {
    /// The value of a cause, made if it is not known; one at a time.
    ///
    /// # Errors
    /// Those of `make`.
    pub(crate) fn of(&self, cause: String, make: impl FnOnce() -> Result<T, Error>) -> Result<Arc<T>, Error> {
        // A value that could not be made left nothing behind.
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = known.get(&cause) {
            return Ok(Arc::clone(value));
        }
        let made = Arc::new(make()?);
        known.insert(cause, Arc::clone(&made));
        Ok(made)
    }

    /// How many were made.
    #[cfg(feature = "sweep")]
    pub(crate) fn len(&self) -> usize {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).len()
    }
}

/// The curves of some scenes.
#[derive(Debug, Default)]
pub(crate) struct Efficiencies {
    layers: Known<EfficiencyProfile>,
    screens: Known<Screens>,
}

impl Efficiencies {
    /// The efficiency at the layers of the lines, as [`efficiency_at`].
    pub(crate) fn of_layers(&self, plan: &Plan, observer: &dyn Observer) -> Result<Arc<EfficiencyProfile>, Error> {
        let ranges_m: Vec<f64> = plan.geometry.layer_range_m().collect();
        self.layers.of(cause(&plan.scene.scene, &ranges_m), || {
            observer.begin(Stage::Efficiency, 1);
            let profile = efficiency_at(plan, self, &ranges_m, observer)?;
            observer.end();
            Ok(profile)
        })
    }

    /// The phase screens of a stretch of range, m.
    pub(crate) fn screens(
        &self,
        scene: &Scene,
        instrument: &Instrument,
        [from_m, to_m]: [f64; 2],
        observer: &dyn Observer,
    ) -> Result<Arc<Screens>, Error> {
        let t = turbulence(scene).unwrap_or_default();
        let range_m = curved_ranges_m(&instrument.telescope, from_m, to_m, OF_SCREENS);
        let cause = cause(scene, &range_m);
        self.screens.of(cause, || Screens::run(scene, instrument, &t, range_m, observer))
    }

    /// How many were computed.
    #[cfg(feature = "sweep")]
    pub(crate) fn computed(&self) -> usize {
        self.layers.len()
    }
}

/// What a curve depends on: on the seed only in turbulence, where screens may be drawn.
fn cause(scene: &Scene, range_m: &[f64]) -> String {
    let (air, laser) = (&scene.atmosphere.turbulence, scene.laser.wavelength_m);
    let seed = turbulence(scene).map(|_| scene.seed);
    hash_of(&format!("{:?}", (laser, &scene.telescope, air, seed, range_m)))
}
