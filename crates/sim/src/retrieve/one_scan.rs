//! Retrieval of one map.

use super::own::retold;
use super::table::{RetrievedScan, refused};
use crate::Error;
use crate::detection::strided;
use crate::io::scans::ReadScan;
use crate::measure::response::SceneResponse;
use crate::scene::{Flow, RetrievalMethod as Method, Scene};
use ndarray::Array2;
use wakescope_estimate::retrieval::{
    Flag, Gate, RetrievalOptions, ScanMap, ScanResult, fit_scan, radial_velocity_method, with_secondary_vortices,
};
use wakescope_estimate::vortex_fit::{CorePrior, Sharing, WakeModel};

/// Gates that share most of their window are left out unless fewer velocities are left.
const ENOUGH: usize = 500;
/// Standard deviation of the weight of gates that do not show cores, m.
const LONG_GATE_M: f64 = 3.0;

/// How scans are retrieved: with the ground, the profile and the secondary vortices of the scene, if it is known; cores are fitted
/// unless one is to be kept.
pub fn options(scene: Option<&Scene>, gate: Gate, core_radius_m: Option<f64>) -> RetrievalOptions {
    let profile = scene.and_then(|scene| match scene.flow {
        Flow::VortexPair(pair) => Some(pair.profile),
        _ => None,
    });
    // Long gates do not show cores: without what is known of them they run away with the circulation.
    let is_long = match &gate {
        Gate::Point => false,
        Gate::Gaussian { std_m } => *std_m > LONG_GATE_M,
        Gate::Kernel(_) => true,
    };
    let lidar_height_m = scene.map_or(0.0, |scene| scene.scan.lidar_height_m);
    let wanted = scene.and_then(|scene| scene.retrieval.as_ref());
    let mut options = RetrievalOptions {
        model: WakeModel { profile: profile.unwrap_or_default(), lidar_height_m, ..WakeModel::default() },
        gate,
        core_radius_m,
        core_prior: is_long.then_some(CorePrior::TYPICAL),
        other_profile: profile.is_none(),
        secondary: wanted.map(|wanted| wanted.secondary).unwrap_or_default(),
        ..RetrievalOptions::default()
    };
    if core_radius_m.is_some() {
        options.free.core_radius = Sharing::Fixed;
    }
    options
}

/// What the velocities of a map are of the air in its gates.
#[derive(Clone, Copy)]
pub enum Velocities<'s> {
    /// Means, as somebody says.
    Means,
    /// Nobody knows: they are taken for means.
    Unknown,
    /// What the estimator of a scene shows.
    Shown(&'s SceneResponse),
    /// Most likely what the estimator of such a scene shows: the difference to means counts as an error.
    LikelyShown(&'s SceneResponse),
}

/// Retrieves one map.
///
/// Where it is known what an estimator shows, means only lead to the start of the fit: taken for means, peaks mislead about the core above
/// all, which is a typical one until then. Secondary vortices that the map shows are in the options that come back.
///
/// # Errors
/// What the fits refuse, with the file and the sweep.
pub fn retrieve_map(
    scan: ReadScan,
    method: Method,
    options: RetrievalOptions,
    velocities: Velocities<'_>,
) -> Result<RetrievedScan, Error> {
    let refuse = |error: wakescope_estimate::Error| refused(&scan, &error);
    if method == Method::Rv {
        let result = radial_velocity_method(&scan.map, &options).map_err(refuse)?;
        return Ok(RetrievedScan { scan, options, result });
    }
    let own = match velocities {
        Velocities::Shown(own) | Velocities::LikelyShown(own) => Some(own),
        Velocities::Means | Velocities::Unknown => None,
    };
    let few = own.map(|own| strided(&scan.map, (1, own.gate_step(&scan.map.range_m))));
    let is_enough = |few: &&ScanMap| few.velocity_m_s.iter().filter(|v| v.is_finite()).count() >= ENOUGH;
    let map = few.as_ref().filter(is_enough).unwrap_or(&scan.map);
    let shown = match own.zip(few.as_ref()) {
        Some((own, few)) => {
            let mut rough = RetrievalOptions { core_radius_m: None, other_profile: false, ..options.clone() };
            rough.free.core_radius = Sharing::Fixed;
            let found = fit_scan(map, &rough).map_err(refuse)?;
            own.refined(few, &options, &found)
        }
        None => None,
    };
    let (mut result, options) = match (shown, velocities) {
        (Some(shown), Velocities::Shown(_)) => return Ok(RetrievedScan { result: shown.0, options: shown.1, scan }),
        (Some((mut result, with_secondary)), _) => {
            let means = fit_scan(map, &options).map_err(refuse)?;
            doubt(&mut result, &means, &scan, &with_secondary);
            (result, with_secondary)
        }
        (None, _) => {
            let found = fit_scan(map, &options).map_err(refuse)?;
            with_secondary_vortices(map, &options, &found).map_err(refuse)?.unwrap_or((found, options))
        }
    };
    let are_means = matches!(velocities, Velocities::Means);
    result.set(Flag::TakenForMeans, !are_means && !result.vortices.is_empty());
    Ok(RetrievedScan { scan, options, result })
}

/// Counts the distance from another result as an error of one: of all numbers that it knows.
fn doubt(result: &mut ScanResult, other: &ScanResult, scan: &ReadScan, options: &RetrievalOptions) {
    let (Some(wake), Some(there)) = (result.wake, other.wake) else { return };
    let (a, b) = (wake.to_array(), there.to_array());
    let known: Vec<f64> = result.covariance.diag().iter().map(|variance| f64::from(*variance > 0.0)).collect();
    let apart = |i: usize| known[i] * (a[i] - b[i]);
    let covariance =
        Array2::from_shape_fn(result.covariance.dim(), |(i, j)| result.covariance[[i, j]] + apart(i) * apart(j));
    let moves = !result.has(Flag::MotionIgnored);
    *result = retold(result, &scan.map, options, (wake, covariance), result.tops.clone(), moves);
}
