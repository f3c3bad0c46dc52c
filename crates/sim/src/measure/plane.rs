//! The wind on a cross-plane around the scan, for the files.

use crate::Error;
use crate::interpolation::linspace;
use crate::io::{CrossPlanes, OPEN_EDGES};
use crate::measure::sizes::PLANE_POINTS;
use crate::plan::Plan;
use ndarray::Array3;

/// The wind at the start of the scan, over the ground that the scan covers.
///
/// # Errors
/// What the wind refuses; a checked scene gives none.
pub(crate) fn cross_plane(plan: &Plan) -> Result<CrossPlanes, Error> {
    let scene = &plan.scene.content;
    let top_rad = scene.scan.elevation_max_rad.max(0.0);
    let bottom_rad = scene.scan.elevation_min_rad.abs().max(top_rad.abs());
    let far_m = scene.scan.range_max_m;
    let (low_y_m, high_y_m) = (scene.scan.range_min_m * bottom_rad.cos(), far_m);
    let top_m = (scene.scan.lidar_height_m + far_m * top_rad.sin()).max(0.1 * far_m);
    let y_m = linspace(low_y_m, high_y_m, PLANE_POINTS.0);
    let z_m = linspace(0.0, top_m, PLANE_POINTS.1);
    let points_m: Vec<[f64; 3]> = z_m
        .iter()
        .flat_map(|&z| y_m.iter().map(move |&y| [0.0, y, z]))
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
