//! Scores as a table, as JSON, and as some twenty lines for people.
//!
//! Check: the table of the reference case; no number of the text that the table does not have.

use super::{Predictions, Quantity, ScoreOptions, ScoreRow, Scores};
use crate::io::Table;
use crate::io::csv::digits;
use crate::io::data_set::Split;
use serde_json::{Value, json};

/// A row for each group, bin, quantity and statistic.
#[must_use]
pub fn table(scores: &Scores) -> Table {
    let rows = &scores.rows;
    Table::new()
        .text("group", rows.iter().map(|row| row.group))
        .text("bin", rows.iter().map(|row| row.bin.as_str()))
        .text("quantity", rows.iter().map(|row| row.quantity))
        .text("statistic", rows.iter().map(|row| row.statistic))
        .float("value", rows.iter().map(|row| row.value))
        .float("low", rows.iter().map(|row| row.interval[0]))
        .float("high", rows.iter().map(|row| row.interval[1]))
        .int("count", rows.iter().map(|row| row.count as i64))
        .int("flights", rows.iter().map(|row| row.flights as i64))
}

/// Everything, with how it was scored and what was left out.
#[must_use]
pub fn json(scores: &Scores, predictions: &Predictions, options: &ScoreOptions) -> Value {
    let mut rows = Vec::with_capacity(scores.rows.len());
    for row in &scores.rows {
        rows.push(json!({
            "group": row.group, "bin": row.bin, "quantity": row.quantity, "statistic": row.statistic, "value": row.value,
            "low": row.interval[0], "high": row.interval[1], "count": row.count, "flights": row.flights,
        }));
    }
    json!({
        "splits": options.splits, "least_m2_s": options.least_m2_s, "seed": options.seed,
        "flights": scores.flights, "scans": scores.scans, "flights_not_ready": scores.flights_not_ready,
        "rows_of_other_splits": predictions.other_splits, "rows_not_ready": predictions.not_ready,
        "scans_without_row": options.missing_is_none.then_some(predictions.missing), "operating_curve": scores.operating_curve, "rows": rows,
    })
}

/// Statistics of vortices and scans that people read first.
const DETECTION: [(&str, &str); 7] = [
    ("vortices", "recall"),
    ("vortices", "precision"),
    ("vortices", "f1"),
    ("scans", "detected"),
    ("scans", "false_alarms"),
    ("scans", "auc"),
    ("scans", "detected_at_0.01"),
];

/// Statistics of errors that people read first.
const ERRORS: [&str; 3] = ["bias", "rms", "coverage_0.9"];

/// What was left out, and the statistics that people read first.
#[must_use]
pub fn summary(scores: &Scores, predictions: &Predictions, options: &ScoreOptions) -> String {
    let names: Vec<&str> = options.splits.iter().map(|split| split.name()).collect();
    let mut text = String::new();
    if options.missing_is_none {
        text += &format!(
            "scans without a row, taken for none: {}\n",
            predictions.missing
        );
    }
    let Scores { flights, scans, .. } = scores;
    text += &format!("{}: {scans} scans of {flights} flights", names.join(", "));
    for (count, what) in [
        (scores.flights_not_ready, "flights that are not ready"),
        (predictions.not_ready, "rows of these"),
        (predictions.other_splits, "rows of other splits"),
    ] {
        if count > 0 {
            text += &format!("; {what}, left out: {count}");
        }
    }
    text.push('\n');
    let mut rows: Vec<&ScoreRow> = Vec::new();
    for (quantity, statistic) in DETECTION {
        rows.extend(scores.row(("all", "all"), quantity, statistic));
    }
    for quantity in Quantity::ALL {
        for statistic in ERRORS {
            rows.extend(scores.row(("all", "all"), quantity.name(), statistic));
        }
    }
    for split in Split::ALL.into_iter().filter(|_| names.len() > 1) {
        let bin = ("split", split.name());
        rows.extend(scores.row(bin, "vortices", "f1"));
        rows.extend(scores.row(bin, Quantity::Circulation.name(), "rms"));
    }
    text + &aligned(&rows)
}

fn aligned(rows: &[&ScoreRow]) -> String {
    let intervals = rows.iter().map(|row| {
        let [low, high] = row.interval.map(digits);
        format!("{low} .. {high}")
    });
    Table::new()
        .text("bin", rows.iter().map(|row| row.bin.as_str()))
        .text("quantity", rows.iter().map(|row| row.quantity))
        .text("statistic", rows.iter().map(|row| row.statistic))
        .float("value", rows.iter().map(|row| row.value))
        .text("95 % interval", intervals)
        .int("count", rows.iter().map(|row| row.count as i64))
        .int("flights", rows.iter().map(|row| row.flights as i64))
        .aligned()
}
