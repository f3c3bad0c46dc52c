//! The pictures of a run: what the tables of the same names hold, nothing else.
//! Check: by eye; a test of the program compares the names of the files.

use crate::Error;
use crate::io::{FileGroup, Provenance, VelocityMap};
use crate::measure::profile::RangeProfile;
use crate::plan::Plan;
use crate::plot::{Axis, CurvePlot, Figure, MapPlot, Series, Style};
use crate::scene::{Flow, SnrReference};
use wakescope_optics::EfficiencyProfile;

/// Adds a figure in the formats that the scene asks for.
pub(super) fn add(
    files: &mut FileGroup,
    plan: &Plan,
    name: &str,
    figure: &Figure,
    origin: &Provenance,
) -> Result<(), Error> {
    let outputs = &plan.scene.scene.outputs;
    if outputs.svg {
        files.add(&format!("{name}.svg"), figure.svg(origin)?)?;
    }
    if outputs.png {
        files.add(&format!("{name}.png"), figure.png(origin)?)?;
    }
    Ok(())
}

/// Signal-to-noise ratio and efficiency against range, each with its standard error as a band.
pub(super) fn profile(plan: &Plan, profile: &RangeProfile) -> Figure {
    let e = &profile.efficiency;
    let range = || Axis::linear("range [m]");
    let points = |y: &[f64]| e.range_m.iter().copied().zip(y.iter().copied()).collect::<Vec<_>>();
    let curve = |label: &str, style: Style, profile: &EfficiencyProfile| {
        let series = Series::new(label, style, points(&profile.mean));
        match has_error(profile) {
            true => series.with_band(&profile.standard_error),
            false => series,
        }
    };
    let mut efficiency = CurvePlot::new("System efficiency", range(), Axis::linear("efficiency"));
    if profile.others.is_empty() {
        efficiency = efficiency.with(curve("", Style::Line, e));
    }
    let styles = [Style::Line, Style::Dash, Style::DashDot, Style::Dot];
    for ((name, other), style) in profile.others.iter().zip(styles) {
        efficiency = efficiency.with(curve(&label_of(name), style, other));
    }
    let mut snr = Series::new("", Style::Line, points(&profile.snr_db));
    let is_fixed = matches!(plan.scene.scene.detector.snr, SnrReference::Fixed { .. });
    if has_error(e) && !is_fixed {
        snr.band = Some(snr_band_db(profile));
    }
    let snr = CurvePlot::new("Signal-to-noise ratio", range(), Axis::linear("SNR [dB]")).with(snr);
    let mut figure = Figure::side_by_side([snr, efficiency].map(|plot| CurvePlot { shape: 0.75, ..plot }));
    figure.width = 1120.0;
    figure
}

/// The column of a model in words.
fn label_of(column: &str) -> String {
    column.replace("efficiency_", "").replace('_', " ").replace("monte carlo", "Monte Carlo")
}

fn has_error(profile: &EfficiencyProfile) -> bool {
    profile.standard_error.iter().any(|&error| error > 0.0)
}

/// The ratio with an efficiency one standard error below and above its mean: the ratio is in proportion to it.
fn snr_band_db(profile: &RangeProfile) -> Vec<(f64, f64)> {
    let e = &profile.efficiency;
    let all = profile.snr_db.iter().zip(&e.mean).zip(&e.standard_error);
    all.map(|((snr_db, mean), error)| {
        let off_db = |sign: f64| 10.0 * (1.0 + sign * error / mean).max(1e-3).log10();
        (snr_db + off_db(-1.0), snr_db + off_db(1.0))
    })
    .collect()
}

/// The air, one scan of it and the mean of all; below them the errors. One scan alone has its error beside it.
pub(super) fn add_map(files: &mut FileGroup, plan: &Plan, map: &VelocityMap, origin: &Provenance) -> Result<(), Error> {
    let centres_m = centres_m(plan);
    let panel = |field: &str, title: &str| -> Result<MapPlot, Error> {
        let mut plot = MapPlot::new(map, 0, field)?.titled(title).labelled("m/s");
        plot.points_m.clone_from(&centres_m);
        Ok(plot)
    };
    let realisations = plan.scene.scene.scan.realisations;
    let exact = panel("v_exact", "exact field")?;
    let colours = exact.colours;
    let scan = panel("v_scan", "one scan, estimated")?.coloured(colours);
    let panels = if realisations == 1 {
        vec![exact, scan, panel("bias", "its error")?]
    } else {
        let mean = panel("radial_velocity", &format!("mean of {realisations} realisations"))?.coloured(colours);
        vec![
            exact,
            scan,
            mean,
            panel("bias", "mean error (bias)")?,
            panel("velocity_standard_deviation", "standard deviation of one scan")?,
            panel("rms", "root mean square error")?,
        ]
    };
    let has_gaps = panels.iter().any(|plot| plot.cells.values().iter().any(|v| v.is_nan()));
    let mut figure = Figure::stacked(panels).titled(&title(plan, has_gaps));
    (figure.columns, figure.width) = (3, 1560.0);
    add(files, plan, "map", &figure, origin)
}

/// The first scan of recorded signals: velocity, its predicted error, signal-to-noise ratio.
pub(super) fn add_measured(
    files: &mut FileGroup,
    plan: &Plan,
    map: &VelocityMap,
    origin: &Provenance,
) -> Result<(), Error> {
    let panel = |field: &str, title: &str, unit: &str| -> Result<MapPlot, Error> {
        Ok(MapPlot::new(map, 0, field)?.titled(title).labelled(unit))
    };
    let panels = vec![
        panel("radial_velocity", "radial velocity, positive away from the lidar", "m/s")?,
        panel("velocity_standard_deviation", "predicted standard deviation", "m/s")?,
        panel("signal_to_noise_ratio", "signal-to-noise ratio", "dB")?,
    ];
    let mut figure = Figure::stacked(panels).titled("One scan of recorded signals; grey: no value");
    (figure.columns, figure.width) = (3, 1560.0);
    add(files, plan, "map", &figure, origin)
}

/// What is shown, of which age and from how many realisations.
fn title(plan: &Plan, has_gaps: bool) -> String {
    let mut words = vec!["Radial velocity [m/s], positive away from the lidar".to_owned()];
    if matches!(plan.scene.scene.flow, Flow::VortexPair(_) | Flow::Simulated(_)) {
        let scan_s = plan.scan_end_s() - plan.wind.start_s;
        words.push(format!("age τ = {:.2} at the start of the scan, which takes {scan_s:.2} s", plan.wind.tau));
    }
    words.push(match plan.scene.scene.scan.realisations {
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
    match &plan.scene.scene.flow {
        Flow::VortexPair(pair) => {
            let c = crate::measure::wind::vortex_pair(pair).centres(plan.wind.start_s);
            vec![(c.left_y_m, c.height_m), (c.right_y_m, c.height_m)]
        }
        _ => Vec::new(),
    }
}
