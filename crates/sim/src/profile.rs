//! Efficiency and signal-to-noise ratio against range.

use crate::scene::{Scene, SnrReference, Turbulence};
use crate::{Error, join};
use wakescope_optics::EfficiencyProfile;
use wakescope_optics::theory::free_space_efficiency;

/// Efficiency (19) and signal-to-noise ratio (14) at the same ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeProfile {
    /// Efficiency with its scatter and error.
    pub efficiency: EfficiencyProfile,
    /// Mean signal-to-noise ratio in the detector band, dB, for a pulse short against the changes
    /// of the path.
    pub snr_db: Vec<f64>,
}

/// The profile that the scene's outputs ask for.
///
/// # Errors
/// What the optics refuse; a checked scene gives none.
pub fn range_profile(scene: &Scene) -> Result<RangeProfile, Error> {
    let o = &scene.outputs;
    let ranges_m = spaced(o.profile_range_min_m, o.profile_range_max_m, o.profile_points);
    let efficiency = efficiency_at(scene, &ranges_m)?;
    let model = join::snr_model(scene)?;
    let snr_db = efficiency
        .range_m
        .iter()
        .zip(&efficiency.mean)
        .map(|(&range_m, &mean)| match scene.detector.snr {
            SnrReference::Fixed { snr_db } => Ok(snr_db),
            _ => Ok(10.0 * model.snr(range_m, mean)?.log10()),
        })
        .collect::<Result<_, Error>>()?;
    Ok(RangeProfile { efficiency, snr_db })
}

/// The efficiency at given ranges, m, increasing.
///
/// # Errors
/// What the optics refuse, such as a range of 0.
pub fn efficiency_at(scene: &Scene, range_m: &[f64]) -> Result<EfficiencyProfile, Error> {
    let telescope = join::telescope(scene)?;
    Ok(match scene.atmosphere.turbulence {
        Turbulence::None {} => {
            EfficiencyProfile::from_theory(range_m, |range_m| free_space_efficiency(&telescope, range_m))?
        }
    })
}

/// `points` values from `low` to `high`, both included.
pub(crate) fn spaced(low: f64, high: f64, points: usize) -> Vec<f64> {
    let step = (high - low) / (points.max(2) - 1) as f64;
    (0..points).map(|i| if i + 1 == points { high } else { low + i as f64 * step }).collect()
}
