//! Plans whose vortices have no truth in the arrays of a data set.
//!
//! A vortex is a line along x. It is at one place in a scan only where the lines of sight are in one vertical plane that crosses it, at
//! several elevations. The arrays hold one vortex of each side: those of the flow.
//!
//! Check: each refusal, and the patterns and flows that are accepted, in `tests/it/dataset.rs`.

use super::plan::DatasetPlan;
use super::schema::Shape;
use crate::Error;
use crate::keys::Problem;
use crate::plan::Plan;
use crate::scene::Flow;

/// Angles of lines that differ by less are equal, degrees.
const SAME_DEG: f64 = 1e-9;

/// Refuses a planned flight whose vortices the arrays cannot hold.
///
/// # Errors
/// Vortices among the added flows; vortices beside lines of sight that are not in one plane across the flight.
pub(super) fn refuse_without_truth(
    of: &DatasetPlan,
    plan: &Plan,
    shape: &Shape,
) -> Result<(), Error> {
    let scene = plan.scene();
    let mut problems = Vec::new();
    for (at, flow) in scene.flows().skip(1) {
        if flow.has_vortices() {
            problems.push(of_added_flow(&at, flow));
        }
    }
    if scene.flow.has_vortices() {
        problems.extend(of_lines(plan, shape));
    }
    match problems.is_empty() {
        true => Ok(()),
        false => Err(of.refused(problems)),
    }
}

/// What is wrong with vortices in an added flow.
fn of_added_flow(at: &str, flow: &Flow) -> Problem {
    let value = format!("\"{}\"", flow.name());
    let allowed = "a flow without vortices: the truth of a data set is that of the pair of flow alone, and flow.kind = \"vortex_pair\" \
                   makes it";
    Problem::new(format!("{at}.kind"), value, allowed)
}

/// What is wrong with the lines of sight beside vortices.
fn of_lines(plan: &Plan, shape: &Shape) -> Option<Problem> {
    let scan = &plan.scene().scan;
    if !are_in_one_plane(shape) {
        let value = format!("\"{}\"", scan.pattern.name());
        let allowed = "\"rhi\", or \"list\" with several elevations at one azimuth: the truth of vortices is where they cross the vertical \
                       plane of a scan, and other patterns need a flow without vortices";
        return Some(Problem::new("scan.pattern.kind", value, allowed));
    }
    let schedule = &plan.geometry.schedule;
    let [_, across, _] = schedule.ahead(&schedule.middle(0)).0;
    if across != 0.0 {
        return None;
    }
    let azimuth_rad = schedule.middle(0).azimuth_rad;
    let key = match scan.pattern.has_scan_azimuth() {
        true => "scan.azimuth_rad",
        false => "scan.pattern.kind",
    };
    let allowed = "an azimuth across the flight, whose own is scan.lidar.flight_azimuth_rad: a plane along it crosses no vortex";
    Some(Problem::new(key, format!("{azimuth_rad:?}"), allowed))
}

/// Whether all lines have one azimuth, and several elevations.
fn are_in_one_plane(shape: &Shape) -> bool {
    are_equal(&shape.azimuth_deg) && !are_equal(&shape.elevation_deg)
}

/// Whether all angles of lines are equal.
fn are_equal(angles_deg: &[f64]) -> bool {
    let mut pairs = angles_deg.windows(2);
    pairs.all(|pair| (pair[1] - pair[0]).abs() < SAME_DEG)
}
