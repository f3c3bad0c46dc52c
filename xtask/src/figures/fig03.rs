//! Figure 3: the scan pattern on the runway, with the vortices and the lines of sight.

use super::context::*;
use super::study::Sight;
use wakescope_sim::scene::VortexPair;

/// One line in this many is drawn; the table has all.
const DRAWN: usize = 8;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let plan = Plan::new(context.scene_file(Scene::default())?, Target::Run)?;
    let scan = &plan.scene().scan;
    let elevation_rad = &plan.geometry.elevation_rad;
    let first = points(elevation_rad, scan.range_min_m, scan.lidar_height_m);
    let last = points(elevation_rad, scan.range_max_m, scan.lidar_height_m);
    let table = Table::new()
        .int("line", (0..elevation_rad.len()).map(|i| i as i64))
        .float("elevation_rad", elevation_rad.iter().copied())
        .float("y_first_sample_m", column(&first, |p| p.0))
        .float("z_first_sample_m", column(&first, |p| p.1))
        .float("y_last_sample_m", column(&last, |p| p.0))
        .float("z_last_sample_m", column(&last, |p| p.1));
    let mut fan = Vec::new();
    for &elevation_rad in elevation_rad.iter().step_by(DRAWN) {
        let lidar = point(0.0, elevation_rad, scan.lidar_height_m);
        let far = point(scan.range_max_m, elevation_rad, scan.lidar_height_m);
        // There and back, so that one series draws the whole fan.
        fan.extend([lidar, far, lidar]);
    }
    let ground = vec![(0.0, 0.0), (1.05 * scan.range_max_m, 0.0)];
    let cores = Sight::of_pair(VortexPair::default()).cores;
    let series = vec![
        Series::new(&format!("line of sight, every {DRAWN}th"), Style::Line, fan),
        Series::new("first and last sample", Style::Dash, first),
        Series::new("", Style::Dash, last).in_colour(1),
        Series::new("ground", Style::Line, ground),
        Series::new("vortices", Style::Markers, cores),
    ];
    let x = Axis::linear("distance from the lidar [m]");
    let y = Axis::linear("height [m]");
    let plot = CurvePlot {
        series,
        equal_scales: true,
        ..CurvePlot::new("Scan across the runway", x, y)
    };
    let origin = plan.file.provenance();
    let mut out = Rendered::new(&table, &Figure::stacked([plot]), &origin)?;
    out.values = vec![
        elevation_rad.len().to_string(),
        (1e3 * scan.elevation_step_rad).to_string(),
        DRAWN.to_string(),
    ];
    Ok(out)
}

/// Distance and height \[m\] of a point of a line of sight.
fn point(range_m: f64, elevation_rad: f64, lidar_height_m: f64) -> (f64, f64) {
    (
        range_m * elevation_rad.cos(),
        lidar_height_m + range_m * elevation_rad.sin(),
    )
}

/// The points of all lines at a range.
fn points(elevation_rad: &[f64], range_m: f64, lidar_height_m: f64) -> Vec<(f64, f64)> {
    elevation_rad
        .iter()
        .map(|&elevation_rad| point(range_m, elevation_rad, lidar_height_m))
        .collect()
}
