//! `wakescope budget`: the power budget of a scene.

use super::{Cli, load, paths, progress, say};
use crate::Error;
use crate::io::{Existing, FileGroup};
use crate::measure::budget::{Budget, scan_ranges_m};
use crate::plan::{Plan, Target};
use crate::write;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

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
    /// Replace the table although this program did not write it, or it was changed since.
    #[arg(long)]
    overwrite: bool,
}

fn range(word: &str) -> Result<f64, String> {
    let range_m = word.trim().parse().ok().filter(|m| (1.0..=1e6).contains(m));
    range_m.ok_or_else(|| "a range from 1 to 1e6 m, or several with commas between them, e.g. 280,400".into())
}

pub(super) fn budget(words: &BudgetWords, cli: &Cli) -> Result<(), Error> {
    const NAME: &str = "budget.csv";
    let plan = Plan::new(load(&words.scene, cli)?, Target::Efficiency)?;
    let existing = if words.overwrite { Existing::Any } else { Existing::Own };
    if let Some(folder) = &words.out {
        write::prepare(folder, [NAME], existing)?;
    }
    let ranges_m = if words.range.is_empty() { scan_ranges_m(&plan.scene.scene) } else { words.range.clone() };
    let found = match cli.quiet {
        true => Budget::new(&plan, &ranges_m, &progress::Quiet)?,
        false => Budget::new(&plan, &ranges_m, &progress::Bars::new())?,
    };
    let mut text = found.text();
    let mut files = Vec::new();
    if let Some(folder) = &words.out {
        let mut group = FileGroup::new(folder);
        group.add(NAME, found.table().to_csv(&write::provenance(&plan))?)?;
        files = write::put(group, folder, existing)?;
        text += &format!("wrote {}\n", folder.join(NAME).display());
    }
    let rows: Vec<serde_json::Value> = found
        .rows
        .iter()
        .map(|row| json!({ "row": row.name, "symbol": row.symbol, "value": row.value, "db": row.db }))
        .collect();
    let limits: serde_json::Map<_, _> =
        found.limits.values.iter().map(|(key, value)| ((*key).to_owned(), json!(value))).collect();
    let object = json!({
        "version": crate::VERSION, "scene_hash": plan.scene.hash, "range_m": found.range_m, "rows": rows,
        "limits": limits, "warnings": found.warnings, "files": paths(&files),
    });
    say(cli.json, &object, &text)
}
