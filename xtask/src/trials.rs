//! What estimators are tried on: windows of a uniform wind, and scans of the analytic vortex pair.
//!
//! Figures and work-precision share these, so that both speak of the same signals.

pub(crate) mod fits;
pub(crate) mod methods;
pub(crate) mod mixture;
pub(crate) mod pair;
pub(crate) mod uniform;

use wakescope_estimate::Sampling;
use wakescope_signal::{NoiseModel, Receiver};
use wakescope_sim::{estimators, instrument, scene::Scene};

/// Energy of the pulses \[J\]; only the signal-to-noise ratio matters here.
pub(crate) const ENERGY_J: f64 = 150e-6;

/// The receiver of Table 2 with the given noise.
pub(crate) fn receiver(noise: NoiseModel) -> Receiver {
    Receiver { noise, ..instrument::receiver(&Scene::default()) }
}

/// The same in the words of the estimators.
pub(crate) fn sampling() -> Result<Sampling, wakescope_sim::Error> {
    estimators::sampling(&Scene::default())
}

/// Name of a noise in tables.
pub(crate) fn noise_name(noise: NoiseModel) -> &'static str {
    match noise {
        NoiseModel::White => "white",
        NoiseModel::BandLimited => "band",
        NoiseModel::None => "none",
    }
}
