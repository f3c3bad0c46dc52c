//! A scan, the wake that was found in it, and what is left; the track of vortices through several scans.
//!
//! Check: by eye; the files of a retrieval are named in its test.

use super::table::{PlaneTrack, RetrievedScan, TRACK};
use crate::Error;
use crate::io::{Field, Ray, Sweep, Unit, VelocityMap};
use crate::plot::{Axis, CurvePlot, Figure, MapPlot, Series, Style};
use wakescope_estimate::Measured;
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
        fields.extend([
            ("v_model", "fitted wake", model),
            ("v_residual", "measured less fitted", residual),
        ]);
    }
    let rays = map
        .elevation_rad
        .iter()
        .enumerate()
        .map(|(i, elevation_rad)| Ray {
            sweep: 0,
            // The picture knows no times, and lines of a map may have any.
            time_s: i as f64,
            elevation_rad: *elevation_rad,
            ..Ray::default()
        });
    let map_fields = fields.iter().map(|(name, text, values)| {
        Field::float(name, Unit::METRE_PER_SECOND, text, values.clone())
    });
    let shown = VelocityMap {
        rays: rays.collect(),
        range_m: map.range_m.clone(),
        sweeps: vec![Sweep::rhi(f64::NAN, 0.0)],
        fields: map_fields.collect(),
        lidar_y_m: scan.options.model.lidar_lateral_position_m,
        lidar_height_m: scan.options.model.lidar_height_m,
        ..VelocityMap::default()
    };
    let centres_m: Vec<(f64, f64)> = scan
        .result
        .vortices
        .iter()
        .map(|vortex| vortex.place_m())
        .collect();
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
    let width = 520.0 * panels.len() as f64;
    Ok(Figure {
        width,
        ..Figure::side_by_side(panels).titled(&title(scan, number))
    })
}

fn title(scan: &RetrievedScan, number: usize) -> String {
    let mut found = Vec::new();
    for side in Side::BOTH {
        if let Some(vortex) = scan.result.vortex(side) {
            let name = super::name(side);
            let Measured { value, std } = vortex.circulation_5_15_m2_s;
            found.push(format!("{name} Γ(5-15 m) = {value:.0} ± {std:.0} m²/s"));
        }
    }
    let found = if found.is_empty() {
        "no wake".to_owned()
    } else {
        found.join(", ")
    };
    format!("Scan {number}, radial velocity [m/s]: {found}")
}

/// Circulation, lateral position and height against time, with bands of one standard deviation and the results of the scans.
pub fn track_figure(of_plane: &PlaneTrack, scans: &[RetrievedScan]) -> Figure {
    let panels = [
        ("Circulation", "circulation [m²/s]", 0),
        ("Lateral position", "distance [m]", 1),
        ("Height", "height [m]", 2),
    ]
    .map(|(title, label, column)| {
        let mut plot = CurvePlot::new(title, Axis::linear("time [s]"), Axis::linear(label));
        for (colour, side) in Side::BOTH.into_iter().enumerate() {
            plot = plot
                .with(track_line(of_plane, side, column).in_colour(colour))
                .with(scan_dots(of_plane, scans, side, column).in_colour(colour));
        }
        CurvePlot {
            shape: 0.75,
            ..plot
        }
    });
    let plane = of_plane
        .azimuth_rad
        .map_or_else(String::new, |azimuth_rad| {
            format!(" at azimuth {:.1}°", azimuth_rad.to_degrees())
        });
    let title = format!("Track of the vortices{plane}: smoothed, with one standard deviation");
    Figure {
        width: 1560.0,
        ..Figure::side_by_side(panels).titled(&title)
    }
}

/// A column of the track of a vortex against time, with a band of one standard deviation.
fn track_line(of_plane: &PlaneTrack, side: Side, column: usize) -> Series {
    let (_, get) = TRACK[column];
    let mut points = Vec::new();
    let mut stds = Vec::new();
    for point in &of_plane.track.points {
        if let Some(vortex) = point.vortices.iter().find(|vortex| vortex.side == side) {
            let Measured { value, std } = get(vortex);
            points.push((point.time_s, value));
            stds.push(std);
        }
    }
    Series::new(&super::name(side), Style::Line, points).with_band(&stds)
}

/// Circulation, lateral position or height of a vortex in each scan of the track.
fn scan_dots(of_plane: &PlaneTrack, scans: &[RetrievedScan], side: Side, column: usize) -> Series {
    let mut points = Vec::new();
    for number in &of_plane.scans {
        let result = &scans[*number].result;
        if let Some(vortex) = result.vortex(side) {
            let columns = [
                vortex.circulation_m2_s,
                vortex.lateral_position_m,
                vortex.height_m,
            ];
            points.push((result.reference_time_s, columns[column].value));
        }
    }
    Series::new("", Style::Markers, points)
}
