//! The wind on a cross-plane around the scan, for the files.
//!
//! Check: it is where the lidar is.

use crate::Error;
use crate::interpolation::linspace;
use crate::io::{CrossPlanes, OPEN_EDGES};
use crate::plan::{Plan, PlannedStage, Stage, Target};
use ndarray::Array3;

/// Points of the cross-plane across and up.
pub(crate) const POINTS: [usize; 2] = [161, 81];

/// Keys that reduce the memory of profile and cross-plane.
pub(crate) const FEWER_POINTS: &str = "fewer outputs.profile_points, or outputs.flow = false";

/// Whether a plan has the wind on a cross-plane.
pub(crate) fn is_wanted(plan: &Plan) -> bool {
    plan.target == Target::Run && plan.scene().outputs.flow
}

/// The stage of the cross-plane.
pub(crate) fn planned(plan: &Plan) -> PlannedStage {
    if !is_wanted(plan) {
        return PlannedStage::skipped(Stage::CrossPlane, "not asked for");
    }
    if plan.scene().is_calm() {
        return PlannedStage::skipped(Stage::CrossPlane, "flow.kind is \"calm\"");
    }
    let [across, up] = POINTS;
    let points = (across * up) as f64;
    // Positions and velocities are in memory at work; two components are kept.
    PlannedStage::running(Stage::CrossPlane, format!("{across} x {up} points")).with_memory(
        points * 48.0,
        points * 16.0,
        FEWER_POINTS.into(),
    )
}

/// The wind at the start of the scan, over the ground that the scan covers: across the flight through the place of the lidar.
///
/// # Errors
/// What the wind refuses; a checked scene gives none.
pub(crate) fn cross_plane(plan: &Plan) -> Result<CrossPlanes, Error> {
    let scene = plan.scene();
    let top_rad = scene.scan.elevation_max_rad.max(0.0);
    let bottom_rad = scene.scan.elevation_min_rad.abs().max(top_rad.abs());
    let far_m = scene.scan.range_max_m;
    let x_m = scene.scan.lidar.x_m;
    let lidar_y_m = scene.scan.lidar.y_m;
    let low_y_m = lidar_y_m + scene.scan.range_min_m * bottom_rad.cos();
    let high_y_m = lidar_y_m + far_m;
    let top_m = (scene.scan.lidar_height_m + far_m * top_rad.sin()).max(0.1 * far_m);
    let y_m = linspace(low_y_m, high_y_m, POINTS[0]);
    let z_m = linspace(0.0, top_m, POINTS[1]);
    let points_m: Vec<[f64; 3]> = z_m
        .iter()
        .flat_map(|&z| y_m.iter().map(move |&y| [x_m, y, z]))
        .collect();
    let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
    let time_s = plan.wind.start_s;
    plan.wind
        .wind()
        .velocity_into(&points_m, time_s, &mut velocity_m_s)?;
    let at = |component: usize| {
        Array3::from_shape_fn((1, z_m.len(), y_m.len()), |(_, k, j)| {
            velocity_m_s[k * y_m.len() + j][component]
        })
    };
    Ok(CrossPlanes {
        title: "Wind across the runway at the start of the scan".into(),
        tau: vec![plan.wind.tau],
        time_s: vec![time_s],
        v_m_s: at(1),
        w_m_s: at(2),
        y_m,
        z_m,
        y_edges: OPEN_EDGES,
        z_edges: OPEN_EDGES,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneFile;
    use std::path::Path;

    #[test]
    fn the_plane_is_where_the_lidar_is() {
        // Nothing is before the aircraft, where x = 0 is.
        let text = "[flow]\nmotion = \"inviscid\"\naircraft = { speed_m_s = 70.0, x_m = -300.0 }\n\
            [scan.lidar]\nx_m = -350.0\ny_m = -25.0\n";
        let file = SceneFile::parse(text, Path::new("s.toml")).unwrap();
        let plan = Plan::new(file, Target::Run).unwrap();
        let planes = cross_plane(&plan).unwrap();
        let low_y_m = 280.0 * 0.2304_f64.cos() - 25.0;
        assert!((planes.y_m[0] - low_y_m).abs() < 1e-9, "{}", planes.y_m[0]);
        let high_y_m = planes.y_m[POINTS[0] - 1];
        assert!((high_y_m - 495.0).abs() < 1e-9, "{high_y_m}");
        assert!(planes.v_m_s.iter().any(|v_m_s| *v_m_s != 0.0));
    }
}
