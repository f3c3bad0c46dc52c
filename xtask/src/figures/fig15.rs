//! Figure 15: error against run time of the solvers, the estimators and the whole chain.

use super::context::*;
use crate::cost::machine;
use crate::work_precision::{measure, picture, table};

/// What stands behind the caption of less than the whole.
const PART: &str = "; a few settings, the whole is `cargo xtask work-precision`";

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let is_part = context.profile != Profile::Full;
    let rows = measure(None, context.profile)?;
    let origin = context.provenance_of_formula(&format!(
        "profile = \"{}\"\nthreads = 1\n",
        context.profile.name()
    ));
    let mut out = Rendered::new(&table(&rows), &picture(&rows), &origin)?;
    out.values = vec![machine(), if is_part { PART.into() } else { String::new() }];
    Ok(out)
}
