//! Pictures of a sweep: every result against each key that is a number, and the front of precision against resolution.
//!
//! Check: by eye; a test of the program compares the names of the files.

use super::front::on_front;
use super::key_path::Holds;
use super::results::results;
use super::stored::{CaseResult, Definition};
use crate::Error;
use crate::outputs::Outputs;
use crate::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Panels of a picture: title, axis, whether it is logarithmic, the result and a bound, which is dashed.
const PANELS: [(&str, &str, bool, [&str; 2]); 6] = [
    (
        "Signal-to-noise ratio in the middle of the scan",
        "SNR [dB]",
        false,
        ["snr_db", ""],
    ),
    (
        "Error outside the vortices; dashed: bound",
        "rms [m/s]",
        true,
        ["rms_outside_m_s", "bound_m_s"],
    ),
    (
        "Error inside the vortices",
        "rms [m/s]",
        true,
        ["rms_inside_m_s", ""],
    ),
    (
        "Estimates outside that are spread over the band",
        "fraction",
        false,
        ["bad_fraction", ""],
    ),
    (
        "Range resolution",
        "full width at half maximum [m]",
        false,
        ["resolution_m", ""],
    ),
    (
        "Error of the circulation; dashed: bound",
        "rms [m^{2}/s]",
        true,
        ["circulation_rms_m2_s", "circulation_bound_m2_s"],
    ),
];

/// Most curves of a panel in a legend; more are drawn as points alone.
const MOST_CURVES: usize = 6;

/// The pictures: of each key that is a number, and the front.
pub(super) fn list(
    definition: &Definition,
    rows: Option<&[CaseResult]>,
    files: &mut Outputs,
) -> Result<(), Error> {
    for name in definition
        .free()
        .filter(|key| key.holds != Holds::Texts)
        .map(|key| &key.name)
    {
        files.figure(
            &format!("results_{}", name.replace('.', "_")),
            rows,
            |rows| {
                let panels = PANELS.map(|panel| against(definition, rows, name, &panel));
                let figure = Figure::stacked(panels.into_iter().flatten());
                Ok(Figure {
                    columns: 2,
                    width: 1240.0,
                    ..figure
                })
            },
        )?;
    }
    files.figure("front", rows, |rows| Ok(Figure::stacked([front(rows)])))
}

/// A panel of a result against a key; none where no case has any.
fn against(
    definition: &Definition,
    rows: &[CaseResult],
    key: &str,
    (title, label, is_log, [result, bound]): &(&str, &str, bool, [&str; 2]),
) -> Option<CurvePlot> {
    let mut low = f64::INFINITY;
    let mut high = f64::NEG_INFINITY;
    for x in rows.iter().map(|row| row.key(key)) {
        if x.is_finite() {
            low = low.min(x);
            high = high.max(x);
        }
    }
    let axis = if low > 0.0 && high >= 8.0 * low {
        Axis::log(key)
    } else {
        Axis::linear(key)
    };
    let result_axis = if *is_log {
        Axis::log(label)
    } else {
        Axis::linear(label)
    };
    let mut plot = CurvePlot::new(title, axis, result_axis);
    plot.shape = 0.6;
    let error = standard_error_of(result, results().map(|(name, ..)| name));
    let curves = curves(definition, rows, key);
    let mut any = false;
    // Without a name either no other key varies, or there are too many curves.
    let curves_are_whole = definition.free().count() == 1;
    for (colour, (curve, members)) in curves.iter().enumerate() {
        let values = points(members, key, result);
        any |= !values.is_empty();
        if !curve.is_empty() || curves_are_whole {
            let bound = points(members, key, bound);
            plot = plot.with(Series::new("", Style::Line, values.clone()).in_colour(colour));
            plot = plot.with(Series::new("", Style::Dash, bound).in_colour(colour));
        }
        // In the order of the values, whose x they share.
        let errors = error.map_or(Vec::new(), |error| points(members, key, error));
        let mut half = Vec::with_capacity(values.len());
        for (x, _) in &values {
            let error = errors.iter().find(|(at, _)| at == x);
            half.push(error.map_or(0.0, |(_, error)| *error));
        }
        plot = plot.with(
            Series::new(curve, Style::Markers, values)
                .with_band(&half)
                .in_colour(colour),
        );
    }
    any.then_some(plot)
}

/// Finite values of a result against a key, in the order of the key.
fn points(rows: &[&CaseResult], key: &str, result: &str) -> Vec<(f64, f64)> {
    let mut points = Vec::new();
    for row in rows {
        let x = row.key(key);
        let y = row.result(result);
        if x.is_finite() && y.is_finite() {
            points.push((x, y));
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// Name of the column that has the standard error of a column: `std_m_s` has `std_standard_error_m_s`.
fn standard_error_of<'a>(
    name: &str,
    mut columns: impl Iterator<Item = &'a str>,
) -> Option<&'a str> {
    columns.find(|column| {
        column.contains("_standard_error") && column.replacen("_standard_error", "", 1) == name
    })
}

/// Cases that differ in one key alone belong to one curve; all to one without a name where there are too many.
fn curves<'r>(
    definition: &Definition,
    rows: &'r [CaseResult],
    key: &str,
) -> Vec<(String, Vec<&'r CaseResult>)> {
    let mut curves: Vec<(String, Vec<&CaseResult>)> = Vec::new();
    for row in rows {
        let mut labels = Vec::new();
        for other in definition.free() {
            if other.name != key {
                let short = other.name.rsplit('.').next().unwrap_or_default();
                labels.push(format!("{short} {}", row.text(&other.name)));
            }
        }
        let label = labels.join(", ");
        match curves.iter_mut().find(|(known, _)| *known == label) {
            Some((_, members)) => members.push(row),
            None => curves.push((label, vec![row])),
        }
    }
    if curves.len() <= MOST_CURVES {
        curves
    } else {
        vec![(String::new(), rows.iter().collect())]
    }
}

/// Precision against resolution, with the front.
fn front(rows: &[CaseResult]) -> CurvePlot {
    let mut best = Vec::new();
    for row in on_front(rows) {
        best.push((row.result("resolution_m"), row.result("std_m_s")));
    }
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut all = Vec::with_capacity(rows.len());
    let mut errors = Vec::with_capacity(rows.len());
    for row in rows {
        let error = row.result("std_standard_error_m_s");
        all.push((row.result("resolution_m"), row.result("std_m_s")));
        errors.push(if error.is_finite() { error } else { 0.0 });
    }
    let x = Axis::linear("full width at half maximum in range [m]");
    CurvePlot::new(
        "Precision against resolution",
        x,
        Axis::log("standard deviation [m/s]"),
    )
    .with(Series::new("front", Style::Line, best))
    .with(Series::new("cases", Style::Markers, all).with_band(&errors))
}
