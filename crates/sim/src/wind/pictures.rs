//! Winds and dissipation over height, each window a curve with bands of two standard deviations.
//!
//! Check: by eye.

use super::rows::{Flag, WindRow};
use super::{Kind, WindProfiles};
use crate::plot::{Axis, CurvePlot, Figure, Series, Style};
use wakescope_estimate::Measured;

/// Windows that are drawn, evenly from all.
const DRAWN_WINDOWS: usize = 6;

/// A panel: its label, and the number that it shows with the ends of its band.
type Shown = (&'static str, fn(&WindRow) -> [f64; 3]);

/// A number with two standard deviations to either side.
fn with_band(number: Measured) -> [f64; 3] {
    let half = 2.0 * number.std;
    [number.value, number.value - half, number.value + half]
}

/// Components that a kind has.
fn shown(kind: Kind) -> Vec<Shown> {
    match kind {
        Kind::Full => vec![
            ("east [m/s]", |row| with_band(row.east_m_s)),
            ("north [m/s]", |row| with_band(row.north_m_s)),
            ("up [m/s]", |row| with_band(row.up_m_s)),
        ],
        Kind::Plane => vec![
            ("along the azimuth [m/s]", |row| with_band(row.along_m_s)),
            ("up [m/s]", |row| with_band(row.up_m_s)),
        ],
        Kind::Up => vec![("up [m/s]", |row| with_band(row.up_m_s))],
        Kind::Radial => vec![("along the beam [m/s]", |row| with_band(row.radial_m_s))],
    }
}

/// The dissipation with its 95 % interval.
fn edr(row: &WindRow) -> [f64; 3] {
    [row.edr_m23_s, row.edr_low_m23_s, row.edr_high_m23_s]
}

/// The figure of winds; none without a wind.
#[must_use]
pub fn figure(profiles: &WindProfiles) -> Option<Figure> {
    let first = profiles.rows.iter().find(|row| row.has_wind())?;
    let mut panels = shown(first.kind);
    if profiles.rows.iter().any(|row| row.edr_m23_s.is_finite()) {
        panels.push(("EDR [m^(2/3)/s]", edr));
    }
    let last = profiles.rows.iter().map(|row| row.window).max()?;
    let stride = last.div_ceil(DRAWN_WINDOWS);
    let mut plots = Vec::with_capacity(panels.len());
    for (label, of) in panels {
        let mut plot = CurvePlot::new("", Axis::linear("height [m]"), Axis::linear(label));
        for (colour, window) in (1..=last).step_by(stride).enumerate() {
            let own = profiles.rows.iter().filter(|row| row.window == window);
            let rows: Vec<&WindRow> = own.filter(|row| row.kind == first.kind).collect();
            let points = rows.iter().map(|row| (row.height_m, of(row)[0]));
            let band = rows.iter().map(|row| (of(row)[1], of(row)[2])).collect();
            let name = match last {
                1 => String::new(),
                _ => format!("window {window}"),
            };
            let mut series = Series::new(&name, Style::LineMarkers, points).in_colour(colour);
            series.band = Some(band);
            plot = plot.with(series);
        }
        plots.push(CurvePlot {
            shape: 0.75,
            ..plot
        });
    }
    let assumed = profiles
        .rows
        .iter()
        .any(|row| row.flags.contains(&Flag::WindAssumed));
    let remark = if assumed {
        ", wind across the beam assumed"
    } else {
        ""
    };
    let title = format!("Wind over height, with two standard deviations{remark}");
    Some(Figure {
        width: 520.0 * plots.len() as f64,
        ..Figure::side_by_side(plots).titled(&title)
    })
}
