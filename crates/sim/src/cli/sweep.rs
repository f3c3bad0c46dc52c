//! `wakescope sweep`: design studies.

use super::{Cli, paths};
use crate::io::Existing;
use crate::sweep::{Request, Settings, merge, run};
use crate::{Error, sweep};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Words of `wakescope sweep`.
#[derive(Debug, Args)]
pub(super) struct SweepWords {
    /// The scene that all cases begin with.
    #[arg(required_unless_present = "merge")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    request: Request,
    /// Run nothing: make the tables from the results in these folders.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["shard", "resume"])]
    merge: Vec<PathBuf>,
    #[command(flatten)]
    settings: Settings,
    /// Folder to write to; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn sweep(words: &SweepWords, cli: &Cli) -> Result<(), Error> {
    let request = Request {
        seed: cli.seed,
        ..words.request.clone()
    };
    let sweep = words
        .scene
        .as_deref()
        .map(|scene| cli.sweep(scene, &request))
        .transpose()?;
    let Some(sweep) = sweep.as_ref().filter(|_| words.merge.is_empty()) else {
        let existing = Existing::with_overwrite(words.settings.overwrite);
        let files = merge(&words.merge, sweep.as_ref(), &words.out, existing)?;
        let text = format!("wrote {} files to {}", files.len(), words.out.display());
        return cli.say(
            &json!({ "version": crate::VERSION, "files": paths(&files) }),
            &text,
        );
    };
    let summary = run(sweep, &words.out, words.settings, &*cli.observer())?;
    let sweep::Summary {
        run: ran,
        kept,
        flows,
        efficiencies,
        signals,
        files,
    } = summary;
    let text = format!(
        "{ran} cases run, {kept} kept; computed once for all that share them: flows {flows}, efficiency curves {efficiencies}, signals \
         {signals}\nwrote {} files and the folders of the cases to {}",
        files.len(),
        words.out.display()
    );
    let object = json!({
        "version": crate::VERSION, "sweep_hash": sweep.origin.scene_hash, "cases": sweep.cases.len(), "run": ran, "kept": kept,
        "flows": flows, "efficiencies": efficiencies, "signals": signals, "files": paths(&files),
    });
    cli.say(&object, &text)
}
