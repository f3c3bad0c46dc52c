//! Maps of what is stable: measured points on the lines of their theory.
//!
//! | module | what is in it |
//! |---|---|
//! | `flow` | waves on a periodic line of equal cells: amplification of the time schemes, their limits, what stiff viscosity leaves; eddies on flat cells: pressure solvers; flows without viscosity, and turbulent vortices at Reynolds numbers up to 1e12: energy that steps feed or lose |
//! | `lidar` | the grid that a focused beam needs, single precision through many layers, phasors of long records, estimators over 120 dB and all orders, starts of fits |

mod flow;
mod lidar;

use crate::profile::Profile;
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
        let mut points = Vec::new();
        for &x in places {
            let [measured, theory] = at(x)?;
            points.push([x, measured, theory]);
        }
        Ok(Self {
            name: name.into(),
            points,
        })
    }
}

/// What stands for a theory where there is none.
const NO_THEORY: f64 = f64::NAN;

/// A limit that the program keeps: its name, and where it is.
#[derive(Clone, Copy)]
enum Limit {
    /// Of what is measured.
    Level(&'static str, f64),
    /// Of what it is measured against.
    Abscissa(&'static str, f64),
}

/// Curves over one pair of axes.
pub(crate) struct Panel {
    title: &'static str,
    axes: [Axis; 2],
    /// The limit that the program keeps.
    limit: Option<Limit>,
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
/// Positive measurements below this are not drawn.
const LEAST_DRAWN: f64 = 1e-17;

/// What measures panels.
type Measurement<'m> = &'m (dyn Fn() -> Result<Vec<Panel>, Failure> + Sync);

/// All panels, in their order; with the profile quick fewer points of those that need the longest run time.
pub(crate) fn measure(profile: Profile) -> Result<Vec<Panel>, Failure> {
    let panels: [Measurement; 13] = [
        &flow::growth,
        &|| flow::limits(profile),
        &flow::stiff,
        &|| flow::pressure(profile),
        &flow::drift,
        &|| flow::fed(profile),
        &|| flow::reynolds(profile),
        &|| lidar::focus(profile),
        &|| lidar::layers(profile),
        &lidar::phasors,
        &lidar::ratios,
        &lidar::orders,
        &|| lidar::basins(profile),
    ];
    let panels = panels
        .into_par_iter()
        .map(|panel| panel())
        .collect::<Result<Vec<_>, Failure>>()?;
    Ok(panels.into_iter().flatten().collect())
}

/// Values of which the profile quick takes some.
fn thinned<'v>(profile: Profile, quick: &'v [f64], all: &'v [f64]) -> &'v [f64] {
    profile.choose(quick, all, all)
}

/// Largest distance of a point from the line of its theory, relative, where the theory is exact and above what round-off leaves.
pub(crate) fn furthest(panels: &[Panel]) -> f64 {
    let mut furthest = 0.0_f64;
    for curve in panels[..EXACT].iter().flat_map(|panel| &panel.curves) {
        for [_, measured, theory] in &curve.points {
            if *theory > ROUND_OFF {
                furthest = furthest.max((measured / theory - 1.0).abs());
            }
        }
    }
    furthest
}

/// One row a point.
pub(crate) fn table(panels: &[Panel]) -> Table {
    let mut titles = Vec::new();
    let mut names = Vec::new();
    let mut points = Vec::new();
    for panel in panels {
        for curve in &panel.curves {
            for point in &curve.points {
                titles.push(panel.title);
                names.push(curve.name.as_str());
                points.push(*point);
            }
        }
    }
    let mut table = Table::new().text("panel", titles).text("curve", names);
    for (k, name) in ["x", "measured", "theory"].into_iter().enumerate() {
        table = table.float(name, points.iter().map(|point| point[k]));
    }
    table
}

/// A panel each: points measured, lines of theory in the same colour, and the limits that the program keeps, dashed. Points without a theory are joined.
pub(crate) fn picture(panels: &[Panel]) -> Figure {
    Figure {
        columns: 2,
        width: 1300.0,
        ..Figure::stacked(panels.iter().map(Panel::plot))
    }
}

impl Panel {
    fn plot(&self) -> CurvePlot {
        let [x, y] = self.axes.clone();
        let mut plot = CurvePlot {
            shape: 0.7,
            ..CurvePlot::new(self.title, x, y)
        };
        let curves = self.curves.iter().filter(|curve| !curve.points.is_empty());
        for (colour, curve) in curves.enumerate() {
            let mut theory = Vec::new();
            let mut measured = Vec::new();
            for [x, measurement, expected] in &curve.points {
                if *expected > self.least {
                    theory.push((*x, *expected));
                }
                if *measurement <= 0.0 || *measurement > LEAST_DRAWN {
                    measured.push((*x, *measurement));
                }
            }
            let style = if curve.points[0][2].is_nan() {
                Style::LineMarkers
            } else {
                Style::Markers
            };
            plot = plot.with(Series::new(&curve.name, style, measured).in_colour(colour));
            plot = plot.with(Series::new("", Style::Line, theory).in_colour(colour));
        }
        let Some(limit) = self.limit else {
            return plot;
        };
        let (name, line) = match limit {
            Limit::Level(name, level) => {
                let (first, last) = self.extent(0);
                (name, [(first, level), (last, level)])
            }
            Limit::Abscissa(name, x) => {
                let (low, high) = self.extent(1);
                (name, [(x, low), (x, high)])
            }
        };
        plot.with(Series::new(name, Style::Dash, line).in_colour(6))
    }

    /// The least and the largest number of all points in a column: 0 where, 1 what was measured.
    fn extent(&self, column: usize) -> (f64, f64) {
        let mut low = f64::INFINITY;
        let mut high = f64::NEG_INFINITY;
        for curve in &self.curves {
            for point in &curve.points {
                if point[column].is_finite() {
                    low = low.min(point[column]);
                    high = high.max(point[column]);
                }
            }
        }
        (low, high)
    }
}
