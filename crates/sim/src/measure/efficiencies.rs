//! Efficiency curves that several scans share, each computed once.
//!
//! A curve is known by what it depends on: laser, telescope, turbulence, the seed of its phase screens, ranges. Check: scenes
//! that differ in anything else share a curve, and the curve is that of the scene by itself.

use crate::Error;
use crate::measure::instrument::Instrument;
use crate::measure::profile::{efficiency_at, efficiency_realisations, turbulence};
use crate::measure::progress::Observer;
use crate::plan::Stage;
use crate::scene::{RefractiveTurbulence, Scene, hash_of};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use wakescope_optics::EfficiencyProfile;

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
    means: Known<EfficiencyProfile>,
    realisations: Known<Vec<Vec<f64>>>,
}

impl Efficiencies {
    /// As [`efficiency_at`].
    pub(crate) fn mean(
        &self,
        scene: &Scene,
        instrument: &Instrument,
        range_m: &[f64],
        observer: &dyn Observer,
    ) -> Result<Arc<EfficiencyProfile>, Error> {
        self.means.of(cause(scene, range_m), || {
            observer.begin(Stage::Efficiency, 1);
            let profile = efficiency_at(scene, instrument, range_m, observer)?;
            observer.end();
            Ok(profile)
        })
    }

    /// As [`efficiency_realisations`].
    pub(crate) fn of_realisations(
        &self,
        scene: &Scene,
        instrument: &Instrument,
        t: &RefractiveTurbulence,
        range_m: &[f64],
        observer: &dyn Observer,
    ) -> Result<Arc<Vec<Vec<f64>>>, Error> {
        let make = || efficiency_realisations(scene, instrument, t, range_m, observer);
        self.realisations.of(cause(scene, range_m), make)
    }

    /// How many were computed.
    #[cfg(feature = "sweep")]
    pub(crate) fn computed(&self) -> usize {
        self.means.len() + self.realisations.len()
    }
}

/// What a curve depends on: on the seed only in turbulence, where screens may be drawn.
fn cause(scene: &Scene, range_m: &[f64]) -> String {
    let (air, laser) = (&scene.atmosphere.turbulence, scene.laser.wavelength_m);
    let seed = turbulence(scene).map(|_| scene.seed);
    hash_of(&format!("{:?}", (laser, &scene.telescope, air, seed, range_m)))
}
