//! `cargo xtask stability`: every stiff and extreme case of the crates, its expected and its actual outcome.
//!
//! A case is a number within bounds or a refusal in stated words; a panic is neither. What the cases are: the lists in
//! `tests/extreme`.

use crate::figures::context::{Rendered, column};
use crate::profile::Profile;
use crate::statistics::Verdict;
use crate::workspace::{provenance, root, unless};
use fixtures::failure::Outcome;
use std::path::PathBuf;
use std::time::Instant;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};
use wakescope_tests::extreme::{Ended, PARTS, Row, rows};

/// Runs the cases, prints and writes them.
///
/// # Errors
/// A case that did not end as it must, an unusable output.
pub(crate) fn run(profile: Profile, only: Option<&str>, out: Option<PathBuf>) -> Outcome {
    let start = Instant::now();
    println!(
        "{:<8} {:<50} {:<7} {:>7}  {:<30} outcome",
        "crate", "case", "verdict", "time", "expected"
    );
    let rows = rows(|_, case| {
        let is_named = only.is_none_or(|word| case.name.contains(word));
        let is_skipped = case.long && profile == Profile::Quick;
        is_named && !is_skipped
    });
    for row in &rows {
        println!(
            "{:<8} {:<50} {:<7} {:>5.1} s  {:<30} {}",
            row.part,
            row.case.name,
            verdict(&row.ended),
            row.ended.took_s,
            row.case.expected.to_string(),
            row.ended.outcome
        );
    }
    let folder = out.unwrap_or_else(|| root().join("target/stability"));
    let origin = provenance(&format!("profile = \"{}\"\n", profile.name()), 1);
    Rendered::new(&table(&rows), &picture(&rows), &origin)?
        .files_in(&folder, "stability")?
        .commit()?;
    let mut missed = Vec::new();
    for row in &rows {
        if !row.ended.passes {
            missed.push(row.case.name);
        }
    }
    println!(
        "{} of {} cases end as they must, in {:.1} s; {}",
        rows.len() - missed.len(),
        rows.len(),
        start.elapsed().as_secs_f64(),
        folder.join("stability.csv").display()
    );
    unless("not as expected", &missed)
}

fn verdict(ended: &Ended) -> &'static str {
    Verdict::of(ended.passes).name()
}

/// One row a case.
pub(crate) fn table(rows: &[Row]) -> Table {
    Table::new()
        .text("case", column(rows, |r| r.case.name))
        .text("crate", column(rows, |r| r.part))
        .text("input", column(rows, |r| r.case.input))
        .text("outcome", column(rows, |r| r.ended.outcome.clone()))
        .text("expected", column(rows, |r| r.case.expected.to_string()))
        .text("verdict", column(rows, |r| verdict(&r.ended)))
        .text("quantity", column(rows, |r| r.case.quantity))
        .float("share_of_allowance", column(rows, |r| r.ended.used))
}

/// How much of what is allowed each case takes: the bar is 1, refusals stand on the floor, what is not as it must be on top.
pub(crate) fn picture(rows: &[Row]) -> Figure {
    const FLOOR: f64 = 1e-6;
    const TOP: f64 = 30.0;
    let mut plot = CurvePlot::new(
        "Stiff and extreme cases",
        Axis::linear("case, in the order of the table"),
        Axis::log("share of what is allowed").between(0.2 * FLOOR, 2.0 * TOP),
    );
    let mut numbers = vec![Vec::new(); PARTS.len()];
    let mut refused = Vec::new();
    let mut missed = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let x = index as f64 + 1.0;
        if !row.ended.passes {
            missed.push((x, TOP));
        } else if !row.ended.used.is_finite() {
            refused.push((x, 0.5 * FLOOR));
        } else if let Some(part) = PARTS.iter().position(|(part, _)| *part == row.part) {
            numbers[part].push((x, row.ended.used.max(FLOOR)));
        }
    }
    for (colour, ((part, _), numbers)) in PARTS.into_iter().zip(numbers).enumerate() {
        plot = plot.with(Series::new(part, Style::Markers, numbers).in_colour(colour));
    }
    let bar = [(0.0, 1.0), (rows.len() as f64 + 1.0, 1.0)];
    plot = plot
        .with(Series::new("refused as it must be", Style::Markers, refused).in_colour(PARTS.len()))
        .with(Series::new("not as it must be", Style::Markers, missed).in_colour(PARTS.len() + 1))
        .with(Series::new("", Style::Dash, bar).in_colour(PARTS.len() + 1));
    Figure::stacked([plot])
}

#[cfg(test)]
mod tests {
    use super::*;
    use wakescope_tests::extreme::Extreme;

    #[test]
    fn a_case_that_is_missed_stands_in_the_table_and_in_the_picture() {
        let case = Extreme::at_most("a", "b", "c", 1.0, || Ok(2.0));
        let rows = [Row {
            part: "les",
            ended: case.run(),
            case,
        }];
        let origin = provenance("", 0);
        let text = table(&rows).to_csv(&origin).unwrap();
        assert!(text.ends_with("a,les,b,2,at most 1,fail,c,2.0\n"), "{text}");
        assert!(
            picture(&rows)
                .svg(&origin)
                .unwrap()
                .contains("not as it must be")
        );
    }
}
