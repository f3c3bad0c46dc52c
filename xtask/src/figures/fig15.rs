//! Figure 15: error against run time of the solvers, the estimators and the whole chain.

use super::context::{Context, Rendered};
use crate::cost::machine;
use crate::profile::Profile;
use crate::work_precision::show::{fronts, table};
use crate::work_precision::{Group, Row, measure};
use fixtures::failure::Failure;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let quick = context.profile == Profile::Quick;
    let measured = measure(&Group::ALL, quick)?;
    let groups: Vec<(Group, &[Row])> = measured.iter().map(|(group, rows)| (*group, rows.as_slice())).collect();
    let origin = context.provenance_of_formula(&format!("profile = \"{}\"\nthreads = 1\n", context.profile_name()));
    let mut out = Rendered::new(&table(&groups), &fronts(&groups), &origin)?;
    out.caption = format!(
        "Relative error against processor time, one thread of {}, the smallest of three times below 0.2 s: of each case the settings that no other \
         beats in both{}. All settings, also those that fail, are in the table (fig15.csv); times differ from run to run.",
        machine(),
        if quick { "; a few settings, the whole is `cargo xtask work-precision`" } else { "" }
    );
    Ok(out)
}
