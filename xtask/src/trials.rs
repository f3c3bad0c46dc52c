//! What estimators are tried on: windows of a uniform wind, and scans of the analytic vortex pair.
//!
//! Figures and work-precision share these, so that both speak of the same signals.

pub(crate) mod banded;
pub(crate) mod fits;
pub(crate) mod map_bound;
pub(crate) mod profile;

use wakescope_signal::NoiseModel;

/// Name of a noise in tables.
pub(crate) fn noise_name(noise: NoiseModel) -> &'static str {
    match noise {
        NoiseModel::White => "white",
        NoiseModel::BandLimited => "band",
        NoiseModel::None => "none",
    }
}
