//! Draws one figure of each kind into a folder, to be looked at:
//!
//! `cargo run -p wakescope-sim --example sample_figures -- FOLDER`
//!
//! The content is a made-up vortex pair; the true figures come from the scenes.

#[path = "sample_data/mod.rs"]
mod sample_data;

use sample_data::{map, origin, wind};
use std::path::Path;
use wakescope_sim::Error;
use wakescope_sim::io::FileGroup;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, MapPlot, Series, Style};

fn main() -> Result<(), Error> {
    let folder = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "target/sample-figures".into());
    let origin = origin();
    let figures = [
        ("maps", maps()?),
        ("curves", curves()),
        ("pattern", pattern()),
        ("errors", errors()),
    ];
    let mut files = FileGroup::new(Path::new(&folder));
    for (name, figure) in figures {
        files.add(&format!("{name}.svg"), figure.svg(&origin)?)?;
        files.add(&format!("{name}.png"), figure.png(&origin)?)?;
    }
    files.commit()?;
    Ok(())
}

/// An early and a late map, and the spread of the estimate below.
fn maps() -> Result<Figure, Error> {
    let map = map(&[2.5, 5.0], true);
    let mut early = MapPlot::new(&map, 0, "radial_velocity")?
        .titled("estimated velocity, τ = 2.5")
        .labelled("v_{R} [m/s]");
    early.points_m = vec![(-24.0, 28.0), (26.0, 31.0)];
    let late = MapPlot::new(&map, 1, "radial_velocity")?
        .titled("estimated velocity, τ = 5")
        .labelled("v_{R} [m/s]")
        .coloured(early.colours);
    let mut spread = MapPlot::new(&map, 0, "velocity_standard_deviation")?
        .titled("standard deviation")
        .labelled("σ_{v} [m/s]");
    spread.show_lidar = true;
    Ok(Figure::stacked([early, late, spread]))
}

/// Profiles on linear axes, and falling curves with bands on a logarithmic one.
fn curves() -> Figure {
    let y = || (-600..=600).map(|i| f64::from(i) * 0.1);
    let through = |tau: f64| y().map(move |y_m| (y_m, wind(y_m, 29.0, tau).1));
    let profile = CurvePlot::new(
        "through the cores",
        Axis::linear("y [m]"),
        Axis::linear("w [m/s]"),
    )
    .with(Series::new("τ = 0", Style::Line, through(0.0)))
    .with(Series::new("τ = 2.5", Style::Dash, through(2.5)))
    .with(Series::new("τ = 5", Style::DashDot, through(5.0)));
    let ranges = || (1..60).map(|i| 50.0 * f64::from(i));
    let efficiency = |cn2: f64| {
        ranges().map(move |r| (r, 0.4 / (1.0 + (r / 400.0).powi(2) * (1.0 + cn2 * 1e13))))
    };
    let mut fall = CurvePlot::new(
        "heterodyne efficiency",
        Axis::linear("range R [m]"),
        Axis::log("η"),
    );
    for (label, cn2, style) in [
        ("free space", 0.0, Style::Line),
        ("C_{n}^{2} = 10^{−13} m^{−2/3}", 1e-13, Style::Dash),
        ("C_{n}^{2} = 10^{−12}", 1e-12, Style::Dot),
    ] {
        let series = Series::new(label, style, efficiency(cn2));
        let half: Vec<f64> = series.points.iter().map(|p| 0.15 * p.1).collect();
        fall.series.push(series.with_band(&half));
    }
    let mut figure = Figure::side_by_side([profile, fall]);
    for panel in &mut figure.panels {
        if let wakescope_sim::plot::Panel::Curves(plot) = panel {
            plot.shape = 0.85;
        }
    }
    figure
}

/// Lines of sight over a runway, in metres.
fn pattern() -> Figure {
    let mut plot = CurvePlot::new(
        "scan pattern",
        Axis::linear("distance [m]"),
        Axis::linear("height [m]"),
    );
    for i in 0..12 {
        let angle = f64::from(i).to_radians();
        let label = if i == 0 { "lines of sight" } else { "" };
        let line = [
            (-400.0, 2.0),
            (-400.0 + 700.0 * angle.cos(), 2.0 + 700.0 * angle.sin()),
        ];
        plot.series
            .push(Series::new(label, Style::Line, line).in_colour(5));
    }
    plot.series
        .push(Series::new("runway", Style::Line, [(-30.0, 0.0), (30.0, 0.0)]).in_colour(6));
    plot.series
        .push(Series::new("vortices", Style::Markers, [(-24.0, 28.0), (26.0, 31.0)]).in_colour(1));
    plot.equal_scales = true;
    Figure::stacked([plot])
}

/// Error against run time on two logarithmic axes, with error bars.
fn errors() -> Figure {
    let mut plot = CurvePlot::new("", Axis::log("run time [s]"), Axis::log("relative error"));
    for (i, name) in ["Hankel", "screens", "split step"].iter().enumerate() {
        let points = (0..6).map(|k| {
            (
                0.01 * 4_f64.powi(k) * (i + 1) as f64,
                0.1 * 6_f64.powi(-k) / (i + 1) as f64,
            )
        });
        let series = Series::new(
            name,
            if i == 0 {
                Style::LineMarkers
            } else {
                Style::Markers
            },
            points,
        );
        let half: Vec<f64> = series.points.iter().map(|p| 0.4 * p.1).collect();
        plot.series.push(series.with_band(&half));
    }
    Figure::stacked([plot]).titled("Error against run time")
}
