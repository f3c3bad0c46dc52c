//! `wakescope accuracy`: how accurate the numbers of a scene are, and the cheapest keys for an accuracy.

use super::words::FolderWords;
use super::{Cli, paths};
use crate::Error;
use crate::accuracy::{Accuracy, Request};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Words of `wakescope accuracy`.
#[derive(Debug, Args)]
pub(super) struct AccuracyWords {
    /// The scene.
    scene: PathBuf,
    #[command(flatten)]
    request: Request,
    #[command(flatten)]
    folder: FolderWords,
}

/// Returns the exit code: 1 where the accuracy is out of reach.
pub(super) fn accuracy(words: &AccuracyWords, cli: &Cli) -> Result<u8, Error> {
    let file = cli.scene(&words.scene)?;
    words.folder.prepare(cli, |files| Accuracy::list(None, files))?;
    let found = Accuracy::of(&file, &words.request, &*cli.observer())?;
    let files = words.folder.write_all(cli, file.provenance(), |files| Accuracy::list(Some(&found), files))?;
    let text = format!("{}search took {:.1} s\n{}", found.text(), found.took_s, words.folder.wrote(&files));
    let object = json!({
        "version": crate::VERSION, "scene_hash": found.of_scene, "is_reached": found.is_reached(), "took_s": found.took_s,
        "is_confirmed": found.verified.is_confirmed, "own_s": found.own_s, "search_s": found.spent_s, "run_s": found.run_s,
        "rows": found.table().objects(), "notes": found.notes, "files": paths(&files),
    });
    cli.say(&object, &text)?;
    Ok(u8::from(!found.is_reached()))
}
