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

/// Measured points of one kind: where, what was measured, what theory says, which is NaN where none is drawn.
struct Curve {
    name: String,
    points: Vec<[f64; 3]>,
}

impl Curve {
    /// At some places, each with what is measured and its theory.
    fn new(
        name: impl Into<String>,
        places: &[f64],
        mut at: impl FnMut(f64) -> Result<[f64; 2], Failure>,
    ) -> Result<Self, Failure> {
        let points = places
            .iter()
            .map(|&x| at(x).map(|[measured, theory]| [x, measured, theory]));
        Ok(Self {
            name: name.into(),
            points: points.collect::<Result<_, _>>()?,
        })
    }
}

/// What stands for a theory where there is none.
const NO_THEORY: f64 = f64::NAN;

/// Curves over one pair of axes.
pub(crate) struct Panel {
    title: &'static str,
    axes: [Axis; 2],
    /// The limit that the program keeps: its name, where it is, whether it is a level.
    limit: Option<(&'static str, f64, bool)>,
    /// Theory that says no more is round-off, and not drawn.
    least: f64,
    curves: Vec<Curve>,
}

impl Panel {
    fn new(
        title: &'static str,
        axes: [Axis; 2],
        curves: impl IntoIterator<Item = Result<Curve, Failure>>,
    ) -> Result<Self, Failure> {
        Ok(Self {
            title,
            axes,
            limit: None,
            least: 0.0,
            curves: curves.into_iter().collect::<Result<_, _>>()?,
        })
    }
}

/// Two logarithmic axes.
fn logs(labels: [&str; 2]) -> [Axis; 2] {
    labels.map(Axis::log)
}

/// The first panels, whose theory is exact.
const EXACT: usize = 3;
/// Of a wave of which a step leaves less the solver's round-off is left.
const ROUND_OFF: f64 = 1e-9;

type Measurement = fn() -> Result<Vec<Panel>, Failure>;

/// All panels, in their order.
pub(crate) fn measure() -> Result<Vec<Panel>, Failure> {
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
    let panels = panels
        .into_par_iter()
        .map(|panel| panel())
        .collect::<Result<Vec<_>, Failure>>()?;
    Ok(panels.into_iter().flatten().collect())
}

/// Largest distance of a point from the line of its theory, relative, where the theory is exact and above what round-off leaves.
pub(crate) fn furthest(panels: &[Panel]) -> f64 {
    let points = panels[..EXACT]
        .iter()
        .flat_map(|panel| &panel.curves)
        .flat_map(|curve| &curve.points);
    let exact = points.filter(|[.., theory]| *theory > ROUND_OFF);
    exact
        .map(|[_, measured, theory]| (measured / theory - 1.0).abs())
        .fold(0.0, f64::max)
}

/// One row a point.
pub(crate) fn table(panels: &[Panel]) -> Table {
    let curves = panels
        .iter()
        .flat_map(|panel| panel.curves.iter().map(move |curve| (panel.title, curve)));
    let rows: Vec<(&str, &str, [f64; 3])> = curves
        .flat_map(|(title, curve)| {
            curve
                .points
                .iter()
                .map(move |p| (title, curve.name.as_str(), *p))
        })
        .collect();
    let table = Table::new()
        .text("panel", rows.iter().map(|r| r.0))
        .text("curve", rows.iter().map(|r| r.1));
    let numbers = ["x", "measured", "theory"].into_iter().enumerate();
    numbers.fold(table, |table, (k, name)| {
        table.float(name, rows.iter().map(|r| r.2[k]))
    })
}

/// A panel each: points measured, lines of theory in the same colour, and the limits that the program keeps, dashed. Points without a theory are joined.
pub(crate) fn picture(panels: &[Panel]) -> Figure {
    let drawn = panels.iter().map(
        |Panel {
             title,
             axes: [x, y],
             limit,
             least,
             curves,
         }| {
            let mut plot = CurvePlot {
                shape: 0.7,
                ..CurvePlot::new(title, x.clone(), y.clone())
            };
            for (colour, Curve { name, points }) in curves
                .iter()
                .filter(|curve| !curve.points.is_empty())
                .enumerate()
            {
                let theory = points.iter().map(|p| (p[0], p[2])).filter(|p| p.1 > *least);
                let measured = points
                    .iter()
                    .map(|p| (p[0], p[1]))
                    .filter(|p| p.1 <= 0.0 || p.1 > 1e-17);
                let style = if points[0][2].is_nan() {
                    Style::LineMarkers
                } else {
                    Style::Markers
                };
                plot = plot.with(Series::new(name, style, measured).in_colour(colour));
                plot = plot.with(Series::new("", Style::Line, theory).in_colour(colour));
            }
            if let &Some((name, at, is_level)) = limit {
                let [x, y] = [0, 1].map(|k| {
                    let all = curves
                        .iter()
                        .flat_map(|curve| &curve.points)
                        .map(|p| p[k])
                        .filter(|v| v.is_finite());
                    all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                        (low.min(value), high.max(value))
                    })
                });
                let line = if is_level {
                    [(x.0, at), (x.1, at)]
                } else {
                    [(at, y.0), (at, y.1)]
                };
                plot = plot.with(Series::new(name, Style::Dash, line).in_colour(6));
            }
            plot
        },
    );
    Figure {
        columns: 2,
        width: 1300.0,
        ..Figure::stacked(drawn)
    }
}
