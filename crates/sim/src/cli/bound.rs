//! `wakescope bound` and `wakescope budget`: what the instrument of a scene can measure at best, and its power budget.

use super::words::range;
use super::{Cli, paths};
use crate::io::Existing;
use crate::measure::bound::{bound as of_plan, points};
use crate::measure::budget::{Budget, scan_ranges_m};
use crate::outputs::Outputs;
use crate::plan::{Plan, Target};
use crate::setup::progress::Silent;
use crate::{Error, scene};
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Words of `wakescope bound`.
#[derive(Debug, Args)]
pub(super) struct BoundWords {
    /// The scene.
    scene: PathBuf,
    /// File for the whole table, as CSV.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long)]
    overwrite: bool,
    /// Compute even if the forecast of the memory is more than the machine has.
    #[arg(long)]
    allow_large: bool,
}

pub(super) fn bound(words: &BoundWords, cli: &Cli) -> Result<(), Error> {
    let plan = Plan::new(cli.scene(&words.scene)?, Target::Map)?;
    if !words.allow_large {
        plan.bound_fits()?;
    }
    if let Some(file) = &words.out {
        cli.prepare_file(file, Existing::with_overwrite(words.overwrite))?;
    }
    let found = of_plan(&plan, &Silent)?;
    let mut text = found.text();
    if let Some(file) = &words.out {
        cli.write_file(file, found.table().to_csv(&plan.scene.provenance())?)?;
        text += &format!("wrote {}\n", file.display());
    }
    let file = words.out.as_ref().map(|file| file.display().to_string());
    let object = json!({
        "version": crate::VERSION, "scene_hash": plan.scene.hash, "by_snr": points(&found.by_snr).objects(),
        "by_range": points(&found.by_range).objects(),
        "files": file,
    });
    cli.say(&object, &text)
}

/// Words of `wakescope budget`.
#[derive(Debug, Args)]
pub(super) struct BudgetWords {
    /// The scene.
    scene: PathBuf,
    /// Ranges, m, such as 280,400; those of the beginning, the middle and the end of the scan without them.
    #[arg(long, value_name = "M,M,...", value_delimiter = ',', value_parser = range)]
    range: Vec<f64>,
    /// Folder for the table, budget.csv; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace an existing table.
    #[arg(long)]
    overwrite: bool,
}

pub(super) fn budget(words: &BudgetWords, cli: &Cli) -> Result<(), Error> {
    let plan = Plan::new(cli.scene(&words.scene)?, Target::Efficiency)?;
    let existing = Existing::with_overwrite(words.overwrite);
    if let Some(folder) = &words.out {
        cli.prepare(folder, &["budget.csv".into()], existing)?;
    }
    let ranges_m = if words.range.is_empty() {
        scan_ranges_m(&plan.scene.content)
    } else {
        words.range.clone()
    };
    let found = Budget::new(&plan, &ranges_m, &*cli.observer())?;
    let mut text = found.text();
    let mut files = Vec::new();
    if let Some(folder) = &words.out {
        let of = (scene::Outputs::default(), plan.scene.provenance());
        let list =
            |files: &mut Outputs| files.table("budget", Some(&found), |found| Ok(found.table()));
        files = cli.write(folder, existing, of, list)?;
        text += &format!("wrote {}\n", folder.join("budget.csv").display());
    }
    let object = json!({
        "version": crate::VERSION, "scene_hash": plan.scene.hash, "range_m": found.range_m, "rows": found.rows,
        "limits": found.limits.values.iter().copied().collect::<BTreeMap<_, _>>(), "warnings": found.warnings, "files": paths(&files),
    });
    cli.say(&object, &text)
}
