//! The curves of detection: operating curves, and the share of wakes found against their circulation.
//! Check: by eye.

use super::Power;
use crate::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Both curves side by side.
#[must_use]
pub fn picture(power: &Power) -> Figure {
    let mut roc = CurvePlot::new(
        "Operating curves",
        Axis::log("rate of false alarms"),
        Axis::linear("share of wakes found"),
    );
    for (curve, style) in power.roc.chunk_by(|a, b| a.0 == b.0).zip([
        Style::Dot,
        Style::DashDot,
        Style::Dash,
        Style::Line,
    ]) {
        let circulation_m2_s = curve.first().map_or(f64::NAN, |row| row.0);
        let bounds = circulation_m2_s / power.circulation_std_m2_s;
        let label = format!("{circulation_m2_s:.0} m²/s ({bounds:.0} σ)");
        let errors: Vec<f64> = curve.iter().map(|row| row.3.std).collect();
        roc = roc.with(
            Series::new(&label, style, curve.iter().map(|row| (row.1, row.3.value)))
                .with_band(&errors),
        );
    }
    let errors: Vec<f64> = power.found.iter().map(|row| row.3.std).collect();
    let found = Series::new(
        "",
        Style::Line,
        power.found.iter().map(|row| (row.0, row.3.value)),
    )
    .with_band(&errors);
    let title = format!(
        "Found at {} false alarms; 9 in 10: {:.0} m²/s",
        power.false_alarm, power.smallest_m2_s.0
    );
    let found = CurvePlot::new(
        &title,
        Axis::linear("circulation [m²/s]"),
        Axis::linear("share of wakes found"),
    )
    .with(found);
    let figure = Figure::side_by_side([roc, found].map(|plot| CurvePlot {
        shape: 0.75,
        ..plot
    }));
    Figure {
        width: 1120.0,
        ..figure
    }
}
