//! The pictures of a run: what the tables of the same names hold, nothing else.
//! Check: by eye; a test of the program compares the names of the files.

use crate::Error;
use crate::beams::SweepMode;
use crate::io::VelocityMap;
use crate::measure::profile::RangeProfile;
use crate::plan::Plan;
use crate::plot::{Axis, CurvePlot, Figure, MapPlot, Series, Style};
use crate::scene::SnrReference;
use crate::wind::{WindProfiles, WindRow};
use wakescope_les::winds::Vortex;
use wakescope_optics::EfficiencyProfile;

/// Signal-to-noise ratio and efficiency against range, each with its standard error as a band.
pub(super) fn profile(plan: &Plan, profile: &RangeProfile) -> Figure {
    let e = &profile.efficiency;
    let range = Axis::linear("range [m]");
    let mut efficiency = CurvePlot::new(
        "System efficiency",
        range.clone(),
        Axis::linear("efficiency"),
    );
    if profile.others.is_empty() {
        efficiency = efficiency.with(efficiency_curve("", Style::Line, &e.range_m, e));
    }
    let styles = [Style::Line, Style::Dash, Style::DashDot, Style::Dot];
    for ((name, other), style) in profile.others.iter().zip(styles) {
        // The column of a model in words.
        let label = name
            .replace("efficiency_", "")
            .replace('_', " ")
            .replace("monte carlo", "Monte Carlo");
        efficiency = efficiency.with(efficiency_curve(&label, style, &e.range_m, other));
    }
    let mut snr = Series::new("", Style::Line, points(&e.range_m, &profile.snr_db));
    let is_fixed = matches!(plan.scene().detector.snr, SnrReference::Fixed { .. });
    if has_error(e) && !is_fixed {
        snr.band = Some(snr_band_db(profile));
    }
    let snr = CurvePlot::new("Signal-to-noise ratio", range, Axis::linear("SNR [dB]")).with(snr);
    let figure = Figure::side_by_side([snr, efficiency].map(|plot| CurvePlot {
        shape: 0.75,
        ..plot
    }));
    Figure {
        width: 1120.0,
        ..figure
    }
}

fn has_error(profile: &EfficiencyProfile) -> bool {
    profile.standard_error.iter().any(|&error| error > 0.0)
}

/// The ratio with an efficiency one standard error below and above its mean: the ratio is in proportion to it.
fn snr_band_db(profile: &RangeProfile) -> Vec<(f64, f64)> {
    let e = &profile.efficiency;
    let mut band = Vec::with_capacity(profile.snr_db.len());
    for (index, snr_db) in profile.snr_db.iter().enumerate() {
        let relative = e.standard_error[index] / e.mean[index];
        let below_db = 10.0 * (1.0 - relative).max(1e-3).log10();
        let above_db = 10.0 * (1.0 + relative).max(1e-3).log10();
        band.push((snr_db + below_db, snr_db + above_db));
    }
    band
}

/// Points of a curve.
fn points(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().zip(y).map(|(x, y)| (*x, *y)).collect()
}

/// An efficiency against range, with its standard error as a band if it has one.
fn efficiency_curve(
    label: &str,
    style: Style,
    range_m: &[f64],
    efficiency: &EfficiencyProfile,
) -> Series {
    let series = Series::new(label, style, points(range_m, &efficiency.mean));
    match has_error(efficiency) {
        true => series.with_band(&efficiency.standard_error),
        false => series,
    }
}

/// The air, one scan of it and the mean of all; below them the errors. One scan alone has its error beside it.
///
/// Sweeps of elevation are drawn from the side, those of azimuth from above, the middle one of several; beams of few directions
/// are curves over range. A VAD has its sine curve beside it.
pub(super) fn map(
    plan: &Plan,
    map: &VelocityMap,
    winds: Option<&WindProfiles>,
) -> Result<Figure, Error> {
    let centres_m = centres_m(plan);
    let sweep = if plan.geometry.schedule.is_plane() {
        0
    } else {
        map.sweeps.len() / 2
    };
    if let Some(SweepMode::VerticalPointing | SweepMode::Pointing) =
        map.sweeps.get(sweep).map(|sweep| sweep.mode)
    {
        return Ok(lines(plan, map));
    }
    if let Some(winds) = winds {
        return Ok(azimuth_display(plan, map, winds));
    }
    let mean = format!("mean of {} realisations", plan.scene().scan.realisations);
    let titles = [
        ("v_exact", "exact field"),
        ("v_scan", "one scan, estimated"),
        ("radial_velocity", &mean),
        ("bias", "mean error (bias)"),
        (
            "velocity_standard_deviation",
            "standard deviation of one scan",
        ),
        ("rms", "root mean square error"),
    ];
    let titles = match plan.scene().scan.realisations {
        1 => &[titles[0], titles[1], ("bias", "its error")],
        _ => &titles[..],
    };
    let mut panels: Vec<MapPlot> = Vec::with_capacity(titles.len());
    for (field, title) in titles {
        let mut plot = MapPlot::new(map, sweep, field)?
            .titled(title)
            .labelled("m/s");
        if !plot.from_above {
            plot.points_m.clone_from(&centres_m);
        }
        // Estimates have the colours of the exact field.
        if let Some(exact) = panels.first()
            && ["v_scan", "radial_velocity"].contains(field)
        {
            plot = plot.coloured(exact.colours);
        }
        panels.push(plot);
    }
    let has_gaps = panels
        .iter()
        .any(|plot| plot.cells.values.iter().any(|v| v.is_nan()));
    Ok(Figure {
        columns: 3,
        width: 1560.0,
        ..Figure::stacked(panels).titled(&title(plan, has_gaps))
    })
}

/// The first scan of recorded signals: velocity, its predicted error, signal-to-noise ratio.
pub(super) fn measured(map: &VelocityMap) -> Result<Figure, Error> {
    let mut panels = Vec::new();
    for (field, title, unit) in [
        (
            "radial_velocity",
            "radial velocity, positive away from the lidar",
            "m/s",
        ),
        (
            "velocity_standard_deviation",
            "predicted standard deviation",
            "m/s",
        ),
        ("signal_to_noise_ratio", "signal-to-noise ratio", "dB"),
    ] {
        panels.push(MapPlot::new(map, 0, field)?.titled(title).labelled(unit));
    }
    let figure = Figure::stacked(panels).titled("One scan of recorded signals; grey: no value");
    Ok(Figure {
        columns: 3,
        width: 1560.0,
        ..figure
    })
}

/// Curves of the first lines over range: the air, and the mean estimates.
fn lines(plan: &Plan, map: &VelocityMap) -> Figure {
    let mut plot = CurvePlot::new(
        "",
        Axis::linear("range [m]"),
        Axis::linear("radial velocity [m/s]"),
    );
    for line in 0..map.rays.len().min(5) {
        let ray = &map.rays[line];
        let azimuth = ray.azimuth_rad.to_degrees();
        let elevation = ray.elevation_rad.to_degrees();
        for (field, style, what) in [
            ("v_pulse", Style::Line, "air"),
            ("radial_velocity", Style::Markers, "estimate"),
        ] {
            let Some(field) = map.field(field) else {
                continue;
            };
            let points: Vec<(f64, f64)> = map
                .range_m
                .iter()
                .enumerate()
                .map(|(gate, range_m)| (*range_m, field.values[[line, gate]]))
                .collect();
            let label = format!("{what}, azimuth {azimuth:.0}°, elevation {elevation:.0}°");
            plot = plot.with(Series::new(&label, style, points).in_colour(line));
        }
    }
    Figure::stacked([plot]).titled(&title(plan, false))
}

/// Radial velocity over azimuth at the middle range of the first sweep, with the sine curve of its wind.
fn azimuth_display(plan: &Plan, map: &VelocityMap, winds: &WindProfiles) -> Figure {
    let gate = map.range_m.len() / 2;
    let x = Axis::linear("azimuth [degrees]");
    let mut plot = CurvePlot::new("", x, Axis::linear("radial velocity [m/s]"));
    let rays: Vec<usize> = (0..map.rays.len())
        .filter(|ray| map.rays[*ray].sweep == 0)
        .collect();
    for (field, label) in [
        ("v_pulse", "air, weighted with the pulse"),
        ("v_scan", "one scan, estimated"),
    ] {
        let Some(field) = map.field(field) else {
            continue;
        };
        let points = rays.iter().map(|&ray| {
            (
                map.rays[ray].azimuth_rad.to_degrees(),
                field.values[[ray, gate]],
            )
        });
        plot = plot.with(Series::new(label, Style::Markers, points));
    }
    if let (Some(wind), Some(&ray)) = (wind_of_gate(winds, map, gate), rays.first()) {
        let (up, level) = map.rays[ray].elevation_rad.sin_cos();
        let mut curve = Vec::with_capacity(181);
        for azimuth_deg in (0..=360).step_by(2).map(f64::from) {
            let (east, north) = azimuth_deg.to_radians().sin_cos();
            let level_m_s = east * wind.east_m_s.value + north * wind.north_m_s.value;
            curve.push((azimuth_deg, level * level_m_s + up * wind.up_m_s.value));
        }
        plot = plot.with(Series::new("its sine curve", Style::Line, curve));
    }
    let range_m = map.range_m.get(gate).copied().unwrap_or(f64::NAN);
    Figure::stacked([plot]).titled(&format!("{}; at {range_m:.0} m", title(plan, false)))
}

/// The wind of the first sweep at the height of a gate of its first line.
fn wind_of_gate<'w>(
    winds: &'w WindProfiles,
    map: &VelocityMap,
    gate: usize,
) -> Option<&'w WindRow> {
    let first = map.rays.first()?;
    let height_m = map.range_m.get(gate)? * first.elevation_rad.sin();
    let mut nearest_m = f64::INFINITY;
    let mut nearest = None;
    for row in &winds.rows {
        let from_m = (row.height_m - height_m).abs();
        if row.window == 1 && row.has_wind() && from_m < nearest_m {
            nearest_m = from_m;
            nearest = Some(row);
        }
    }
    nearest
}

/// Lines of sight that a plan of the scan draws.
const DRAWN_LINES: usize = 24;

/// The set-up, from above and from behind: the lidar, each line from the first gate to the last, the ground and the vortices.
pub(super) fn scan(plan: &Plan) -> Figure {
    let panels = [
        set_up_panel(plan, "from above", "along the flight [m]", 0),
        set_up_panel(plan, "from behind", "height [m]", 2),
    ];
    Figure {
        width: 1120.0,
        ..Figure::side_by_side(panels).titled(&plan.schedule().to_string())
    }
}

/// The set-up with one axis (0 along the flight, 2 up) over the axis across the flight.
fn set_up_panel(plan: &Plan, title: &str, label: &str, axis: usize) -> CurvePlot {
    let g = &plan.geometry;
    let start_m = g.schedule.mount.position_m;
    let near_m = g.gate_range_m.first().copied().unwrap_or(0.0);
    let far_m = g.gate_range_m.last().copied().unwrap_or(0.0);
    let lines = g.schedule.lines.len();
    let mut plot = CurvePlot::new(
        title,
        Axis::linear("across the flight [m]"),
        Axis::linear(label),
    );
    plot.equal_scales = true;
    for line in (0..lines).step_by(lines.div_ceil(DRAWN_LINES).max(1)) {
        let beam = g.schedule.middle(line);
        let ends_m = [near_m, far_m].map(|range_m| beam.at_range_m(range_m));
        let points = ends_m.map(|end_m| (end_m[1], end_m[axis]));
        plot = plot.with(Series::new("", Style::Line, points).in_colour(0));
    }
    // Along the flight, vortices are drawn a little beyond the lidar and the farthest gates.
    let x_m = drawn_m(plan, 0, 0.2 * far_m);
    for (number, (centre_m, height_m)) in centres_m(plan).into_iter().enumerate() {
        let label = if number == 0 { "vortices" } else { "" };
        let vortex = match axis {
            2 => Series::new(label, Style::Markers, [(centre_m, height_m)]),
            _ => Series::new(label, Style::Dash, x_m.map(|x_m| (centre_m, x_m))),
        };
        plot = plot.with(vortex.in_colour(1));
    }
    if axis == 2 {
        let ground = drawn_m(plan, 1, 0.0).map(|y_m| (y_m, 0.0));
        plot = plot.with(Series::new("ground", Style::Line, ground).in_colour(3));
    }
    let lidar = [(start_m[1], start_m[axis])];
    plot.with(Series::new("lidar", Style::Markers, lidar).in_colour(2))
}

/// Range of a coordinate in which lines are drawn, at least so far from the lidar \[m\].
fn drawn_m(plan: &Plan, axis: usize, least_m: f64) -> [f64; 2] {
    let g = &plan.geometry;
    let start_m = g.schedule.mount.position_m[axis];
    let far_m = g.gate_range_m.last().copied().unwrap_or(0.0);
    let mut low_m = start_m - least_m;
    let mut high_m = start_m + least_m;
    for line in 0..g.schedule.lines.len() {
        let end_m = g.schedule.middle(line).at_range_m(far_m)[axis];
        low_m = low_m.min(end_m);
        high_m = high_m.max(end_m);
    }
    [low_m, high_m]
}

/// What is shown, of which age and from how many realisations.
fn title(plan: &Plan, has_gaps: bool) -> String {
    let mut words = vec!["Radial velocity [m/s], positive away from the lidar".to_owned()];
    if plan.scene().flow.is_wake() {
        let scan_s = plan.scan_end_s() - plan.wind.start_s;
        words.push(format!(
            "age τ = {:.2} at the start of the scan, which takes {scan_s:.2} s",
            plan.wind.tau
        ));
    }
    words.push(match plan.scene().scan.realisations {
        1 => "one realisation".into(),
        n => format!("{n} realisations"),
    });
    if has_gaps {
        words.push("grey: no known air".into());
    }
    words.join("; ")
}

/// Centres of the vortices that the picture marks, where they are known.
fn centres_m(plan: &Plan) -> Vec<(f64, f64)> {
    let pair = plan.wind.pair.as_ref();
    let vortices = pair.and_then(|pair| pair.vortices(plan.wind.start_s).ok());
    let centre = |vortex: &Vortex| (vortex.lateral_position_m, vortex.height_m);
    vortices.iter().flatten().map(centre).collect()
}
