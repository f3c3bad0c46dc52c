//! Figure 16: what is stable, measured points on the lines of their theory, and stiff and extreme cases, what each must come to and what it came to.

use super::context::*;
use crate::{stability, stability_maps as maps};
use wakescope_tests::extreme::rows;

/// Largest distance of a point from the line of its theory.
const APART: f64 = 0.01;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let rows = rows(|_, case| !(case.long && context.profile != Profile::Full));
    let panels = maps::measure(context.profile)?;
    let origin = context.provenance_of_run();
    let mut out = Rendered::new(&stability::table(&rows), &maps::picture(&panels), &origin)?;
    out.add("maps.csv", &maps::table(&panels), &origin)?;
    let missed: Vec<&str> = rows
        .iter()
        .filter(|row| !row.ended.passes)
        .map(|row| row.case.name)
        .collect();
    out.values = vec![rows.len().to_string()];
    let measured = match missed.is_empty() {
        true => format!("{} cases", rows.len()),
        false => format!(
            "{} cases; not: {}",
            rows.len() - missed.len(),
            missed.join(", ")
        ),
    };
    let cases = Claim::exact("F16", measured, missed.is_empty());
    let furthest = maps::furthest(&panels);
    let on_theory = Claim::exact(
        "F16b",
        format!("at most {:.2} %", 100.0 * furthest),
        furthest <= APART,
    );
    out.claims = vec![cases.expecting(format!("{} cases", rows.len())), on_theory];
    Ok(out)
}
