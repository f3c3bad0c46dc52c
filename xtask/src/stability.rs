//! `cargo xtask stability`: every stiff and extreme case of the crates, what it must come to and what it came to.
//!
//! A case is a number within bounds or a refusal in stated words; a panic is neither. What the cases are: the lists of the
//! numerics, which a solver that fears nothing would pass.

use crate::figures::context::Rendered;
use crate::profile::Profile;
use crate::statistics::Verdict;
use crate::workspace::{provenance, root, unless};
use fixtures::failure::Outcome;
use std::path::PathBuf;
use std::time::Instant;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};
use wakescope_tests::extreme::{Ended, PARTS, Row, rows};

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Quick leaves out what takes more than a few seconds.
    #[arg(long, value_enum, default_value_t = Profile::Full)]
    profile: Profile,
    /// Only the cases whose name contains this.
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
    /// Folder to write to.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the cases, prints and writes them.
///
/// # Errors
/// A case that did not end as it must, an unusable output.
pub(crate) fn run(options: &Options) -> Outcome {
    let start = Instant::now();
    println!(
        "{:<8} {:<50} {:<7} {:>7}  {:<30} outcome",
        "crate", "case", "verdict", "time", "expected"
    );
    let named = |name: &str| {
        options
            .only
            .as_ref()
            .is_none_or(|word| name.contains(word.as_str()))
    };
    let rows =
        rows(|_, case| named(case.name) && !(case.long && options.profile == Profile::Quick));
    for Row { part, case, ended } in &rows {
        let (name, verdict, expected) = (case.name, verdict(ended), case.expected.to_string());
        println!(
            "{part:<8} {name:<50} {verdict:<7} {:>5.1} s  {expected:<30} {}",
            ended.took_s, ended.outcome
        );
    }
    let folder = options
        .out
        .clone()
        .unwrap_or_else(|| root().join("target/stability"));
    let origin = provenance(&format!("profile = \"{}\"\n", options.profile.name()), 1);
    Rendered::new(&table(&rows), &picture(&rows), &origin)?
        .files_in(&folder, "stability")?
        .commit()?;
    let missed: Vec<&str> = rows
        .iter()
        .filter(|row| !row.ended.passes)
        .map(|row| row.case.name)
        .collect();
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
        .text("case", rows.iter().map(|r| r.case.name))
        .text("crate", rows.iter().map(|r| r.part))
        .text("input", rows.iter().map(|r| r.case.input))
        .text("outcome", rows.iter().map(|r| r.ended.outcome.clone()))
        .text("expected", rows.iter().map(|r| r.case.expected.to_string()))
        .text("verdict", rows.iter().map(|r| verdict(&r.ended)))
        .text("quantity", rows.iter().map(|r| r.case.quantity))
        .float("share_of_allowance", rows.iter().map(|r| r.ended.used))
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
    let of = |accept: &dyn Fn(&Row) -> bool, height: &dyn Fn(&Row) -> f64| -> Vec<(f64, f64)> {
        let chosen = rows.iter().enumerate().filter(|(_, row)| accept(row));
        chosen
            .map(|(number, row)| (number as f64 + 1.0, height(row)))
            .collect()
    };
    let is_number = |row: &Row| row.ended.used.is_finite();
    for (colour, (part, _)) in PARTS.into_iter().enumerate() {
        let numbers = of(
            &|row| row.part == part && row.ended.passes && is_number(row),
            &|row| row.ended.used.max(FLOOR),
        );
        plot = plot.with(Series::new(part, Style::Markers, numbers).in_colour(colour));
    }
    let refused = of(&|row| row.ended.passes && !is_number(row), &|_| 0.5 * FLOOR);
    let missed = of(&|row| !row.ended.passes, &|_| TOP);
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
