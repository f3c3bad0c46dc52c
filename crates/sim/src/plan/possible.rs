//! What a run would refuse after it has begun to compute, found from the sizes and a few points of the wind.
//!
//! Check: scenes that only a run used to refuse are refused by the plan, with the words of the run.

use super::{Plan, Target};
use crate::Error;
use crate::scene::{Flow, Outside};
use crate::setup::air::radial_velocity_m_s;
use wakescope_estimate::wake_detection::WakeDetector;

/// Refuses what a run of the plan would refuse: lines that leave a simulated flow, a test for a wake in a scan of a few velocities.
///
/// # Errors
/// The first place outside, in the words of the run.
pub(super) fn check(plan: &Plan) -> Result<(), Error> {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    let velocities = g.elevation_rad.len() * g.gate_range_m.len();
    let is_tested = plan.target == Target::Run && scene.retrieval.as_ref().is_some_and(|r| r.false_alarm.is_some());
    if is_tested && velocities < WakeDetector::NEEDED {
        let reason = format!(
            "the scan has {velocities} velocities: a test for a wake needs {} lines times gates at least, or no retrieval.false_alarm",
            WakeDetector::NEEDED
        );
        return Err(Error::Input { path: "retrieval.false_alarm".into(), reason });
    }
    if plan.target == Target::Efficiency { Ok(()) } else { lines_stay_inside(plan) }
}

/// Layers of a line that are looked at one by one.
const LAYERS_LOOKED_AT: usize = 1_000_000;

/// A simulated flow is known in a rectangle, so a line is inside if both its ends above the ground are; the line of which one
/// is not is looked at layer by layer.
fn lines_stay_inside(plan: &Plan) -> Result<(), Error> {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    if !matches!(scene.flow, Flow::Simulated(_) | Flow::Fields(_)) || scene.scan.outside_flow != (Outside::Error {}) {
        return Ok(());
    }
    let last_m = g.first_layer_range_m + g.layers.saturating_sub(1) as f64 * g.layer_thickness_m;
    for line in 0..g.schedule.lines.len() {
        // Where a line that points down meets the ground.
        let beam = g.schedule.middle(line);
        let sin = beam.direction.0[2];
        let ground_m = if sin < 0.0 { -beam.position_m[2] / sin } else { f64::INFINITY };
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
