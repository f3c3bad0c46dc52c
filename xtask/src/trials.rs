//! What estimators are tried on: windows of a uniform wind, and scans of the analytic vortex pair.
//!
//! Figures and work-precision share these, so that both speak of the same signals.

pub(crate) mod methods;
pub(crate) mod mixture;
pub(crate) mod pair;
pub(crate) mod uniform;

use wakescope_estimate::Sampling;
use wakescope_signal::{NoiseModel, PlanckConvention, Receiver};

/// Energy of the pulses \[J\]; only the signal-to-noise ratio matters here.
pub(crate) const ENERGY_J: f64 = 150e-6;

/// The chapter's receiver with the given noise.
pub(crate) fn receiver(noise: NoiseModel) -> Receiver {
    Receiver {
        wavelength_m: 1.55e-6,
        sample_rate_hz: 250e6,
        intermediate_frequency_hz: 80e6,
        bandwidth_hz: 50e6,
        quantum_efficiency: 1.0,
        local_oscillator_w: 1e-3,
        planck: PlanckConvention::H,
        noise,
    }
}

/// The same in the words of the estimators.
pub(crate) fn sampling() -> Result<Sampling, wakescope_estimate::Error> {
    Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6))
}

/// Name of a noise in tables.
pub(crate) fn noise_name(noise: NoiseModel) -> &'static str {
    match noise {
        NoiseModel::White => "white",
        NoiseModel::BandLimited => "band",
        NoiseModel::None => "none",
    }
}
