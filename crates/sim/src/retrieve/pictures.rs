//! A scan, the wake that was found in it, and what is left.
//!
//! Check: by eye; the files of a retrieval are named in its test.

use super::RetrievedScan;
use crate::Error;
use crate::io::{Field, Ray, Sweep, Unit, VelocityMap};
use crate::plot::{Figure, MapPlot};
use wakescope_estimate::retrieval::{Flag, Side, expected_velocities};

/// Velocities, the fitted wake and the residual of a scan side by side; velocities alone where no wake was found.
///
/// # Errors
/// What cannot be drawn, such as a scan without any velocity.
pub fn figure(scan: &RetrievedScan, number: usize) -> Result<Figure, Error> {
    let map = &scan.scan.map;
    let mut fields = vec![("radial_velocity", "measured", map.velocity_m_s.clone())];
    if let Some(wake) = &scan.result.wake {
        let moving = !scan.result.has(Flag::MotionIgnored);
        let model = expected_velocities(map, &scan.options, wake, moving)?;
        let residual = &map.velocity_m_s - &model;
        fields.extend([("v_model", "fitted wake", model), ("v_residual", "measured less fitted", residual)]);
    }
    let rays = map.elevation_rad.iter().enumerate().map(|(i, elevation_rad)| Ray {
        sweep: 0,
        // The picture knows no times, and lines of a map may have any.
        time_s: i as f64,
        elevation_rad: *elevation_rad,
        azimuth_rad: 0.0,
    });
    let shown = VelocityMap {
        rays: rays.collect(),
        range_m: map.range_m.clone(),
        sweeps: vec![Sweep::rhi(f64::NAN, 0.0)],
        fields: fields
            .iter()
            .map(|(name, text, values)| Field::float(name, Unit::METRE_PER_SECOND, text, values.clone()))
            .collect(),
        lidar_y_m: scan.options.model.lidar_lateral_position_m,
        lidar_height_m: scan.options.model.lidar_height_m,
        ..VelocityMap::default()
    };
    let centres_m: Vec<(f64, f64)> =
        scan.result.vortices.iter().map(|v| (v.lateral_position_m.value, v.height_m.value)).collect();
    let mut panels = Vec::new();
    for (name, title, _) in &fields {
        let mut plot = MapPlot::new(&shown, 0, name)?.titled(title).labelled("m/s");
        if let Some(first) = panels.first().filter(|_| *name == "v_model") {
            let first: &MapPlot = first;
            plot = plot.coloured(first.colours);
        }
        plot.points_m.clone_from(&centres_m);
        panels.push(plot);
    }
    let columns = panels.len();
    let mut figure = Figure::stacked(panels).titled(&title(scan, number));
    (figure.columns, figure.width) = (columns, 520.0 * columns as f64);
    Ok(figure)
}

fn title(scan: &RetrievedScan, number: usize) -> String {
    let of = |side: Side| {
        let vortex = scan.result.vortex(side)?;
        let name = super::side(side);
        let mean = vortex.circulation_5_15_m2_s;
        Some(format!("{name} Γ(5-15 m) = {:.0} ± {:.0} m²/s", mean.value, mean.std))
    };
    let found: Vec<String> = [of(Side::Left), of(Side::Right)].into_iter().flatten().collect();
    let found = if found.is_empty() { "no wake".to_owned() } else { found.join(", ") };
    format!("Scan {number}, radial velocity [m/s]: {found}")
}
