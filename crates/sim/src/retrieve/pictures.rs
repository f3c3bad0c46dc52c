//! A scan, the wake that was found in it, and what is left; the track of vortices through several scans.
//!
//! Check: by eye; the files of a retrieval are named in its test.

use super::table::{PlaneTrack, RetrievedScan, TRACK};
use crate::Error;
use crate::io::{Field, Ray, Sweep, Unit, VelocityMap};
use crate::plot::{Axis, CurvePlot, Figure, MapPlot, Series, Style};
use ndarray::Array2;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{Flag, ScanResult, Side, TrackPoint, expected_velocities};

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
    let field = |(name, text, values): &(&'static str, &str, Array2<f64>)| {
        Field::float(name, Unit::METRE_PER_SECOND, text, values.clone())
    };
    let shown = VelocityMap {
        rays: rays.collect(),
        range_m: map.range_m.clone(),
        sweeps: vec![Sweep::rhi(f64::NAN, 0.0)],
        fields: fields.iter().map(field).collect(),
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
    let of = |side: Side| {
        let vortex = scan.result.vortex(side)?;
        let name = super::name(side);
        let mean = vortex.circulation_5_15_m2_s;
        Some(format!(
            "{name} Γ(5-15 m) = {:.0} ± {:.0} m²/s",
            mean.value, mean.std
        ))
    };
    let found: Vec<String> = Side::BOTH.into_iter().filter_map(of).collect();
    let found = if found.is_empty() {
        "no wake".to_owned()
    } else {
        found.join(", ")
    };
    format!("Scan {number}, radial velocity [m/s]: {found}")
}

/// Circulation, lateral position and height against time, with bands of one standard deviation and the results of the scans.
pub fn track_figure(of_plane: &PlaneTrack, scans: &[RetrievedScan]) -> Figure {
    let track = &of_plane.track;
    let panels = [
        ("Circulation", "circulation [m²/s]", 0),
        ("Lateral position", "distance [m]", 1),
        ("Height", "height [m]", 2),
    ];
    let panel = |(title, label, column): (&str, &str, usize)| {
        let (_, get) = TRACK[column];
        let mut plot = CurvePlot::new(title, Axis::linear("time [s]"), Axis::linear(label));
        for (colour, side) in Side::BOTH.into_iter().enumerate() {
            let of_point = |point: &TrackPoint| {
                let vortex = point.vortices.iter().find(|vortex| vortex.side == side)?;
                Some((point.time_s, get(vortex)))
            };
            let of_track: Vec<(f64, Measured)> = track.points.iter().filter_map(of_point).collect();
            let of_scan = |result: &ScanResult| {
                let vortex = result.vortex(side)?;
                let of = [
                    vortex.circulation_m2_s,
                    vortex.lateral_position_m,
                    vortex.height_m,
                ];
                Some((result.reference_time_s, of[column].value))
            };
            let stds: Vec<f64> = of_track.iter().map(|(_, m)| m.std).collect();
            let line = Series::new(
                &super::name(side),
                Style::Line,
                of_track.iter().map(|(t, m)| (*t, m.value)),
            );
            let own = of_plane.scans.iter();
            let dots = own.filter_map(|number| of_scan(&scans[*number].result));
            plot = plot
                .with(line.with_band(&stds).in_colour(colour))
                .with(Series::new("", Style::Markers, dots).in_colour(colour));
        }
        CurvePlot {
            shape: 0.75,
            ..plot
        }
    };
    let plane = of_plane
        .azimuth_rad
        .map_or_else(String::new, |azimuth_rad| {
            format!(" at azimuth {:.1}°", azimuth_rad.to_degrees())
        });
    let title = format!("Track of the vortices{plane}: smoothed, with one standard deviation");
    Figure {
        width: 1560.0,
        ..Figure::side_by_side(panels.map(panel)).titled(&title)
    }
}
