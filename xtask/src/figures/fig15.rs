//! Figure 15: error against run time of the solvers, the estimators and the whole chain.

use super::context::*;
use crate::cost::machine;
use crate::work_precision::{measure, picture, table};

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let is_part = context.profile != Profile::Full;
    let rows = measure(None, is_part)?;
    let origin = context.provenance_of_formula(&format!("profile = \"{}\"\nthreads = 1\n", context.profile.name()));
    let mut out = Rendered::new(&table(&rows), &picture(&rows), &origin)?;
    out.caption = format!(
        "Relative error against processor time, one thread of {}, the smallest of three times below 0.2 s, the set-up apart; other programs as measured by the scripts of \
         docs/peers, their times scaled by what a transform takes here{}. All settings, also those that fail, are in the table (fig15.csv); times differ from run to run.",
        machine(),
        if is_part { "; a few settings, the whole is `cargo xtask work-precision`" } else { "" }
    );
    Ok(out)
}
