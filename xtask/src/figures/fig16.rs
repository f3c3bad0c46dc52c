//! Figure 16: stiff and extreme cases of the crates, what each must come to and what it came to.

use super::context::*;
use crate::stability;
use wakescope_tests::extreme::rows;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let rows = rows(|_, case| !(case.long && context.profile == Profile::Quick));
    let origin = context.provenance_of_run();
    let mut out = Rendered::new(&stability::table(&rows), &stability::picture(&rows), &origin)?;
    let missed: Vec<&str> = rows.iter().filter(|row| !row.ended.passes).map(|row| row.case.name).collect();
    out.caption = format!(
        "Each of {} stiff and extreme cases must come to a number within bounds, or be refused in stated words: how much of what \
         is allowed it takes, 1 being the bar (dashed). Names, inputs and outcomes are in the table (fig16.csv).",
        rows.len()
    );
    let measured = match missed.is_empty() {
        true => format!("{} cases", rows.len()),
        false => format!("{} cases; not: {}", rows.len() - missed.len(), missed.join(", ")),
    };
    let claim = Claim::exact("F16", measured, missed.is_empty());
    out.claims = vec![claim.expecting(format!("{} cases", rows.len()))];
    Ok(out)
}
