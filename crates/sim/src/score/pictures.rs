//! Scores as a picture: coverage against nominal share, operating curve, error of circulations against signal-to-noise ratio, F1 by
//! site.
//!
//! Check: by eye; a panel without values is an empty frame.

use super::bins::Group;
use super::sums::NOMINAL;
use super::{Quantity, ScoreRow, Scores};
use crate::plot::{Axis, CurvePlot, Figure, Series, Style};

/// The four panels.
#[must_use]
pub fn figure(scores: &Scores) -> Figure {
    let panels = [
        coverage(scores),
        operating_curve(scores),
        circulation_error(scores),
        f1_by_site(scores),
    ];
    let mut figure = Figure::stacked(panels.map(|plot| CurvePlot {
        shape: 0.72,
        ..plot
    }));
    figure.columns = 2;
    figure.width = 1120.0;
    figure
}

/// Points of rows at their places, with their intervals.
fn with_intervals(label: &str, style: Style, points: &[(f64, &ScoreRow)]) -> Series {
    let mut series = Series::new(label, style, points.iter().map(|(x, row)| (*x, row.value)));
    series.band = Some(
        points
            .iter()
            .map(|(_, row)| (row.interval[0], row.interval[1]))
            .collect(),
    );
    series
}

fn coverage(scores: &Scores) -> CurvePlot {
    let mut plot = CurvePlot::new(
        "Coverage of stated deviations",
        Axis::linear("nominal fraction").between(0.4, 1.0),
        Axis::linear("fraction within").between(0.0, 1.05),
    );
    for quantity in Quantity::ALL {
        let mut points = Vec::new();
        for (nominal, _, name) in NOMINAL {
            let row = scores.row(("all", "all"), quantity.name(), name);
            points.extend(row.map(|row| (nominal, row)));
        }
        let label = match quantity {
            Quantity::LateralPosition => "y",
            Quantity::Height => "z",
            Quantity::Circulation => "Γ_{5-15}",
        };
        plot = plot.with(with_intervals(label, Style::Markers, &points));
    }
    let equal = Series::new("equal", Style::Dash, [(0.4, 0.4), (1.0, 1.0)]);
    plot.with(equal)
}

fn operating_curve(scores: &Scores) -> CurvePlot {
    let curve = scores.operating_curve.iter().copied();
    let chance = Series::new("chance", Style::Dash, [(0.0, 0.0), (1.0, 1.0)]);
    CurvePlot::new(
        "Operating curve of the score",
        Axis::linear("false alarms of empty scans").between(0.0, 1.0),
        Axis::linear("wakes found").between(0.0, 1.05),
    )
    .with(Series::new("", Style::Line, curve))
    .with(chance)
}

fn circulation_error(scores: &Scores) -> CurvePlot {
    let name = Quantity::Circulation.name();
    let mut points = Vec::new();
    for row in &scores.rows {
        let is_of_snr = row.group == Group::Snr.name();
        if is_of_snr && row.quantity == name && row.statistic == "rms" {
            points.extend(middle(&row.bin).map(|snr_db| (snr_db, row)));
        }
    }
    CurvePlot::new(
        "Error of circulations",
        Axis::linear("signal-to-noise ratio of a pulse [dB]"),
        Axis::linear("rms error of Γ_{5-15} [m²/s]"),
    )
    .with(with_intervals("", Style::Markers, &points))
}

/// The middle of a bin `LOW..HIGH`; one without an end is drawn beyond its edge by half a step of the others.
fn middle(bin: &str) -> Option<f64> {
    const HALF_STEP_DB: f64 = 2.5;
    let (low, high) = bin.split_once("..")?;
    match (low.parse::<f64>(), high.parse::<f64>()) {
        (Ok(low), Ok(high)) => Some(0.5 * (low + high)),
        (Ok(low), Err(_)) => Some(low + HALF_STEP_DB),
        (Err(_), Ok(high)) => Some(high - HALF_STEP_DB),
        _ => None,
    }
}

fn f1_by_site(scores: &Scores) -> CurvePlot {
    let mut points = Vec::new();
    for row in &scores.rows {
        let is_of_site = row.group == Group::Site.name();
        if is_of_site && row.quantity == "vortices" && row.statistic == "f1" {
            points.extend(row.bin.parse::<f64>().ok().map(|site| (site, row)));
        }
    }
    CurvePlot::new(
        "Vortices found by site",
        Axis::linear("number of the site"),
        Axis::linear("F1").between(0.0, 1.05),
    )
    .with(with_intervals("", Style::Markers, &points))
}
