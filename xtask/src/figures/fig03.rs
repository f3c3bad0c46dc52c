//! Figure 3: the scan pattern on the runway, with the vortices and the lines of sight.

use super::context::*;
use super::study::Sight;
use wakescope_sim::scene::VortexPair;

/// Every so many lines are drawn; the table has all.
const DRAWN: usize = 8;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let plan = Plan::new(context.scene_file(Scene::default())?, Target::Run)?;
    let scene = &plan.scene.content;
    let elevation_rad = &plan.geometry.elevation_rad;
    let far_m = scene.scan.range_max_m;
    let at = |range_m: f64, el: f64| {
        (
            range_m * el.cos(),
            scene.scan.lidar_height_m + range_m * el.sin(),
        )
    };
    let near_m = scene.scan.range_min_m;

    let column = |f: fn((f64, f64)) -> f64, range_m: f64| {
        elevation_rad.iter().map(move |&el| f(at(range_m, el)))
    };
    let table = Table::new()
        .int("line", (0..elevation_rad.len()).map(|i| i as i64))
        .float("elevation_rad", elevation_rad.iter().copied())
        .float("y_first_sample_m", column(|p| p.0, near_m))
        .float("z_first_sample_m", column(|p| p.1, near_m))
        .float("y_last_sample_m", column(|p| p.0, far_m))
        .float("z_last_sample_m", column(|p| p.1, far_m));
    let origin = plan.scene.provenance();

    let mut fan = Vec::new();
    for &el in elevation_rad.iter().step_by(DRAWN) {
        // There and back, so that one series draws the whole fan.
        fan.extend([at(0.0, el), at(far_m, el), at(0.0, el)]);
    }
    let recorded: Vec<(f64, f64)> = elevation_rad.iter().map(|&el| at(near_m, el)).collect();
    let last: Vec<(f64, f64)> = elevation_rad.iter().map(|&el| at(far_m, el)).collect();
    let series = vec![
        Series::new(&format!("line of sight, every {DRAWN}th"), Style::Line, fan),
        Series::new("first and last sample", Style::Dash, recorded),
        Series::new("", Style::Dash, last).in_colour(1),
        Series::new("ground", Style::Line, vec![(0.0, 0.0), (1.05 * far_m, 0.0)]),
        Series::new(
            "vortices",
            Style::Markers,
            Sight::of_pair(VortexPair::default()).cores,
        ),
    ];
    let (x, y) = (
        Axis::linear("distance from the lidar [m]"),
        Axis::linear("height [m]"),
    );
    let plot = CurvePlot {
        series,
        equal_scales: true,
        ..CurvePlot::new("Scan across the runway", x, y)
    };
    let mut out = Rendered::new(&table, &Figure::stacked([plot]), &origin)?;
    out.values = vec![
        elevation_rad.len().to_string(),
        (1e3 * scene.scan.elevation_step_rad).to_string(),
        DRAWN.to_string(),
    ];
    Ok(out)
}
