//! Maps of what is stable: measured points on the lines of their theory.
//!
//! | module | what is in it |
//! |---|---|
//! | `flow` | waves on a periodic line of equal cells: amplification of the time schemes, their limits, what stiff viscosity leaves; eddies on flat cells: pressure solvers; flows without viscosity, and turbulent vortices at Reynolds numbers up to 1e12: energy that steps feed or lose |
//! | `lidar` | the grid that a focused beam needs, single precision through many layers, phasors of long records, estimators over 120 dB and all orders, starts of fits |

mod flow;
mod lidar;

use fixtures::failure::Failure;
use rayon::prelude::*;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// A point of a panel.
pub(crate) struct Point {
    panel: &'static str,
    curve: String,
    x: f64,
    measured: f64,
    /// NaN where no theory is drawn.
    theory: f64,
}

impl Point {
    /// Without a theory.
    fn measured(panel: &'static str, curve: String, x: f64, measured: f64) -> Self {
        Self { panel, curve, x, measured, theory: f64::NAN }
    }
}

const GROWTH: &str = "growth of a wave in a step";
const LIMITS: &str = "largest stable Courant number";
const STIFF: &str = "what the first step leaves of a stiff wave";
const PRESSURE: &str = "pressure solvers on flat cells";
const DRIFT: &str = "energy lost without viscosity";
const FED: &str = "energy that steps feed, over what is taken";
const REYNOLDS: &str = "energy of turbulent vortices";
const FOCUS: &str = "grid of a focused beam";
const LAYERS: &str = "single precision through many layers";
const PHASORS: &str = "end of a long record against the literal sum";
const BOUND: &str = "good estimates over the bound";
const OUTLIERS: &str = "bad estimates";
const ORDERS: &str = "autoregressive models over the bound";
const BASINS: &str = "starts that end at the true pair";

/// Of a wave of which a step leaves less the solver's round-off is left.
const ROUND_OFF: f64 = 1e-9;

type Measurement = fn() -> Result<Vec<Point>, Failure>;

/// All points, in the order of the panels.
pub(crate) fn measure() -> Result<Vec<Point>, Failure> {
    let panels: [Measurement; 13] = [
        flow::growth,
        flow::limits,
        flow::stiff,
        flow::pressure,
        flow::drift,
        flow::fed,
        flow::reynolds,
        lidar::focus,
        lidar::layers,
        lidar::phasors,
        lidar::ratios,
        lidar::orders,
        lidar::basins,
    ];
    let points = panels.into_par_iter().map(|panel| panel()).collect::<Result<Vec<_>, Failure>>()?;
    Ok(points.into_iter().flatten().collect())
}

/// Largest distance of a point from the line of its theory, relative, of the panels whose theory is exact and above what round-off leaves.
pub(crate) fn furthest(points: &[Point]) -> f64 {
    let exact = points.iter().filter(|p| [GROWTH, LIMITS, STIFF].contains(&p.panel) && p.theory > ROUND_OFF);
    exact.map(|p| (p.measured / p.theory - 1.0).abs()).fold(0.0, f64::max)
}

/// One row a point.
pub(crate) fn table(points: &[Point]) -> Table {
    Table::new()
        .text("panel", points.iter().map(|p| p.panel))
        .text("curve", points.iter().map(|p| p.curve.clone()))
        .float("x", points.iter().map(|p| p.x))
        .float("measured", points.iter().map(|p| p.measured))
        .float("theory", points.iter().map(|p| p.theory))
}

/// Axes of a panel, and the limit that the program keeps: its name, where it is, whether it is a level.
type Frame = (Axis, Axis, Option<(&'static str, f64, bool)>);

fn frame(panel: &str) -> Frame {
    let logs = |x: &str, y: &str| (Axis::log(x), Axis::log(y), None);
    let share = |label: &str| Axis::linear(label).between(-0.05, 1.05);
    match panel {
        GROWTH => logs("angle in a step [rad]", "||G| − 1|"),
        LIMITS => logs("ν Δt/h²", "Courant number"),
        STIFF => logs("ν Δt/h²", "share of the wave"),
        PRESSURE => {
            let bar = Some(("at most 0.10 an iteration", 0.1, true));
            (Axis::log("aspect of the cells"), Axis::log("residual left"), bar)
        }
        DRIFT => logs("step [s]", "energy lost, relative"),
        FED => (Axis::linear("Courant number"), Axis::linear("fed over taken"), Some(("nothing fed", 0.0, true))),
        REYNOLDS => logs("Reynolds number", "energy over that of the start"),
        FOCUS => {
            let bar = Some(("largest spacing accepted", 1.0, false));
            (Axis::log("spacing over λF/(4a)"), Axis::log("error of the efficiency"), bar)
        }
        LAYERS => logs("layers", "change of the efficiency"),
        PHASORS => logs("samples", "difference over rms"),
        BOUND => (Axis::linear("SNR [dB]"), Axis::log("std over the bound"), None),
        OUTLIERS => (Axis::linear("SNR [dB]"), share("share"), None),
        ORDERS => logs("order", "std over the bound"),
        _ => (Axis::linear("distance of each vortex [m]"), share("share of starts"), None),
    }
}

/// A panel each: points measured, lines of theory in the same colour, and the limits that the program keeps, dashed. Points without a theory are joined.
pub(crate) fn panels(points: &[Point]) -> Figure {
    let drawn = points.chunk_by(|a, b| a.panel == b.panel).map(|of_panel| {
        let (x, y, bar) = frame(of_panel[0].panel);
        let mut plot = CurvePlot { shape: 0.7, ..CurvePlot::new(of_panel[0].panel, x, y) };
        for (colour, of_curve) in of_panel.chunk_by(|a, b| a.curve == b.curve).enumerate() {
            // Below that a stiff wave is round-off.
            let least = if of_curve[0].panel == STIFF { 1e-12 } else { 0.0 };
            let theory = of_curve.iter().map(|p| (p.x, p.theory)).filter(|p| p.1 > least);
            let measured = of_curve.iter().map(|p| (p.x, p.measured)).filter(|p| p.1 <= 0.0 || p.1 > 1e-17);
            let style = if of_curve[0].theory.is_nan() { Style::LineMarkers } else { Style::Markers };
            plot = plot.with(Series::new(&of_curve[0].curve, style, measured).in_colour(colour));
            plot = plot.with(Series::new("", Style::Line, theory).in_colour(colour));
        }
        if let Some((name, at, is_level)) = bar {
            let ends = |of: fn(&Point) -> f64| {
                let all = of_panel.iter().map(of).filter(|value| value.is_finite());
                all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
            };
            let (x, y) = (ends(|p| p.x), ends(|p| p.measured));
            let line = if is_level { [(x.0, at), (x.1, at)] } else { [(at, y.0), (at, y.1)] };
            plot = plot.with(Series::new(name, Style::Dash, line).in_colour(6));
        }
        plot
    });
    let mut figure = Figure::stacked(drawn);
    (figure.columns, figure.width) = (2, 1300.0);
    figure
}
