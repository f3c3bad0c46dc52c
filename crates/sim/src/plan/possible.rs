//! What a run would refuse after it has begun to compute, found from the sizes and a few points of the wind.
//!
//! Check: scenes that only a run used to refuse are refused by the plan, with the words of the run.

use super::sizes::Sizes;
use super::stages::{keeps_signals, netcdf_bytes};
use super::{Plan, Target};
use crate::Error;
use crate::scan::radial_velocity_m_s;
use crate::scene::{Flow, Outside, Problem};

/// Refuses what a run of the plan would refuse.
///
/// # Errors
/// Lines that leave a simulated flow; results that a NetCDF file cannot hold; a detector band too narrow for a detection
/// threshold.
pub(super) fn check(plan: &Plan) -> Result<(), Error> {
    if plan.target != Target::Efficiency {
        lines_stay_inside(plan)?;
    }
    let mut problems = Vec::new();
    #[cfg(feature = "netcdf")]
    problems.extend(netcdf_problem(plan));
    problems.extend(threshold_problem(plan));
    match problems.is_empty() {
        true => Ok(()),
        false => Err(Error::Impossible { problems }),
    }
}

/// Layers of a line that are looked at one by one.
const LAYERS_LOOKED_AT: usize = 1_000_000;

/// A simulated flow is known in a rectangle, so a line is inside if both its ends above the ground are; the line of which one
/// is not is looked at layer by layer.
fn lines_stay_inside(plan: &Plan) -> Result<(), Error> {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    if !matches!(scene.flow, Flow::Simulated(_)) || scene.scan.outside_flow != (Outside::Error {}) {
        return Ok(());
    }
    let last_m = g.first_layer_range_m + g.layers.saturating_sub(1) as f64 * g.layer_thickness_m;
    for (line, elevation_rad) in g.elevation_rad.iter().enumerate() {
        // Where a line that points down meets the ground.
        let sin = elevation_rad.sin();
        let ground_m = if sin < 0.0 { -scene.scan.lidar_height_m / sin } else { f64::INFINITY };
        let ends_m = [g.first_layer_range_m, last_m.min(ground_m)];
        if g.first_layer_range_m <= ground_m && radial_velocity_m_s(plan, line, &ends_m).is_err() {
            // The words of the run: the first layer outside.
            let ranges_m: Vec<f64> = g.layer_range_m().take(LAYERS_LOOKED_AT).collect();
            radial_velocity_m_s(plan, line, &ranges_m)?;
            radial_velocity_m_s(plan, line, &ends_m)?;
        }
    }
    Ok(())
}

/// A file that would be larger than NetCDF files of this program can be.
#[cfg(feature = "netcdf")]
fn netcdf_problem(plan: &Plan) -> Option<Problem> {
    let scene = &plan.scene.scene;
    let n = Sizes::new(scene, plan.target, &plan.geometry);
    let [signals, map] = netcdf_bytes(&n);
    let kept = if keeps_signals(scene, plan.target) { signals } else { 0.0 };
    let (bytes, what, less) = match kept > map {
        true => (kept, "raw signals", "scan.pulses_per_line, or outputs.signals = false"),
        false => (map, "the map", "a larger estimator.gate_step_samples or scan.elevation_step_rad"),
    };
    let limit = crate::export::NETCDF_MAX_BYTES as f64;
    let maps = plan.target != Target::Efficiency;
    (scene.outputs.netcdf && maps && bytes > 0.98 * limit).then(|| Problem {
        key: "outputs.netcdf".into(),
        value: "true".into(),
        allowed: format!(
            "false where {what} take {}; one NetCDF file holds {}. Fewer numbers: {less}",
            super::units::bytes(bytes),
            super::units::bytes(limit)
        ),
    })
}

/// A threshold needs more than one independent frequency in the band.
fn threshold_problem(plan: &Plan) -> Option<Problem> {
    let (e, d) = (&plan.scene.scene.estimator, &plan.scene.scene.detector);
    let cells = d.bandwidth_hz * e.window_samples as f64 / d.sampling_hz;
    let maps = matches!(plan.target, Target::Run | Target::Map);
    (maps && e.false_alarm.is_some() && cells <= 1.0).then(|| Problem {
        key: "estimator.window_samples".into(),
        value: e.window_samples.to_string(),
        allowed: format!(
            "above {:.0} with estimator.false_alarm: a threshold needs more than one resolved frequency in \
             detector.bandwidth_hz",
            d.sampling_hz / d.bandwidth_hz
        ),
    })
}
