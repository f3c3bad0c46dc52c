//! `wakescope bound` and `wakescope budget`: what the instrument of a scene can measure at best, and its power budget.

use super::options::WITHOUT_OUTPUT;
use super::{Cli, paths};
use crate::io::Existing;
use crate::measure::bound::{bound as of_plan, fits, points};
use crate::measure::budget::{Budget, scan_ranges_m};
use crate::plan::{Plan, Target};
use crate::progress::Silent;
use crate::{Error, scene};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;

/// The plan of the map of a scene, whose bound fits into the memory of the machine.
pub(super) fn plan(scene: &Path, allow_large: bool, cli: &Cli) -> Result<Plan, Error> {
    let plan = Plan::new(cli.scene(scene)?, Target::Map)?;
    if !allow_large {
        fits(&plan)?;
    }
    Ok(plan)
}

/// Prints the bound of a plan and writes its table to a file, if there is one.
pub(super) fn bound(
    plan: &Plan,
    out: Option<&Path>,
    overwrite: bool,
    cli: &Cli,
) -> Result<(), Error> {
    match out {
        Some(file) => cli.prepare_file(file, Existing::with_overwrite(overwrite))?,
        None => cli.refuse_idle(plan.file.path(), WITHOUT_OUTPUT)?,
    }
    let found = of_plan(plan, &Silent)?;
    let mut text = found.text() + &air_note(plan);
    if let Some(file) = out {
        cli.write_file(file, found.table().to_csv(&plan.file.provenance())?)?;
        text += &format!("wrote {}\n", file.display());
    }
    let file = out.map(|file| file.display().to_string());
    let mut object = json!({
        "version": crate::VERSION, "scene_hash": plan.file.hash, "by_snr": points(&found.by_snr).objects(),
        "by_range": points(&found.by_range).objects(),
        "files": file,
    });
    state_air(plan, &mut object);
    cli.say(&object, &text)
}

/// Which air the numbers are for, where it changes with height.
fn air_note(plan: &Plan) -> String {
    plan.air_elevation_rad().map_or(String::new(), |elevation_rad| {
        format!("air of the line in the middle of the scan, at an elevation of {elevation_rad:.4} rad\n")
    })
}

/// The same in a JSON object.
fn state_air(plan: &Plan, object: &mut serde_json::Value) {
    if let Some(elevation_rad) = plan.air_elevation_rad() {
        object["air_elevation_rad"] = json!(elevation_rad);
    }
}

/// Prints the budget of a scene at some ranges, m, or those of its scan, and writes its table to a
/// folder, if there is one.
pub(super) fn budget(
    scene: &Path,
    range_m: &[f64],
    out: Option<&Path>,
    overwrite: bool,
    cli: &Cli,
) -> Result<(), Error> {
    let plan = Plan::new(cli.scene(scene)?, Target::Efficiency)?;
    let existing = Existing::with_overwrite(overwrite);
    match out {
        Some(folder) => cli.prepare(folder, &["budget.csv".into()], existing)?,
        None => cli.refuse_idle(scene, WITHOUT_OUTPUT)?,
    }
    let ranges_m = if range_m.is_empty() {
        scan_ranges_m(plan.scene())
    } else {
        range_m.to_vec()
    };
    let found = Budget::new(&plan, &ranges_m, &*cli.observer())?;
    let mut text = found.text() + &air_note(&plan);
    let mut files = Vec::new();
    if let Some(folder) = out {
        let of = (scene::Outputs::default(), plan.file.provenance());
        files = cli.write(folder, existing, of, |files| {
            files.table("budget", Some(&found), |found| Ok(found.table()))
        })?;
        text += &format!("wrote {}\n", folder.join("budget.csv").display());
    }
    let mut object = json!({
        "version": crate::VERSION, "scene_hash": plan.file.hash, "range_m": found.range_m, "rows": found.rows,
        "limits": found.limits.iter().copied().collect::<BTreeMap<_, _>>(), "warnings": found.warnings, "files": paths(&files),
    });
    state_air(&plan, &mut object);
    cli.say(&object, &text)
}
