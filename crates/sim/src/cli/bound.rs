//! `wakescope bound`: the Cramer-Rao bound for a scene.

use super::Cli;
use super::words::TableWords;
use crate::Error;
use crate::measure::bound::{bound as of_plan, points};
use crate::plan::{Plan, Target};
use crate::setup::progress::Silent;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Words of `wakescope bound`.
#[derive(Debug, Args)]
pub(super) struct BoundWords {
    /// The scene.
    scene: PathBuf,
    #[command(flatten)]
    table: TableWords,
    /// Compute even if the forecast of the memory is more than the machine has.
    #[arg(long)]
    allow_large: bool,
}

pub(super) fn bound(words: &BoundWords, cli: &Cli) -> Result<(), Error> {
    let plan = Plan::new(cli.scene(&words.scene)?, Target::Map)?;
    if !words.allow_large {
        plan.bound_fits()?;
    }
    words.table.prepare(cli)?;
    let found = of_plan(&plan, &Silent)?;
    let mut text = found.text();
    let file = words.table.write(cli, &found.table(), &plan.scene.provenance(), &mut text)?;
    let object = json!({
        "version": crate::VERSION, "scene_hash": plan.scene.hash, "by_snr": points(&found.by_snr).objects(),
        "by_range": points(&found.by_range).objects(),
        "files": file,
    });
    cli.say(&object, &text)
}
