//! `wakescope accuracy`: how accurate the numbers of a scene or of a flow are, and the cheapest keys for an accuracy.

use super::Cli;
use super::flow::case_file;
use super::words::FolderWords;
use crate::Error;
use crate::accuracy::{Accuracy, Request, Subject};
use crate::flow::WakePreset;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Words of `wakescope accuracy`.
#[derive(Debug, Args)]
pub(super) struct AccuracyWords {
    /// The scene, or the case of a flow or wake: its keys tell which.
    #[arg(required_unless_present = "preset")]
    scene: Option<PathBuf>,
    /// A ready-made wake; a case file has keys of its own over it.
    #[arg(long, value_enum)]
    preset: Option<WakePreset>,
    #[command(flatten)]
    request: Request,
    #[command(flatten)]
    folder: FolderWords,
}

/// Returns the exit code: 1 where the accuracy is out of reach.
pub(super) fn accuracy(words: &AccuracyWords, cli: &Cli) -> Result<u8, Error> {
    let (path, request) = (words.scene.as_deref(), &words.request);
    if let Some(path) = path.filter(|path| words.preset.is_none() && !cli.is_case(path)) {
        let file = cli.scene(path)?;
        return answer(words, cli, || {
            Accuracy::of(&file, request, &*cli.observer())
        });
    }
    let file = case_file(path, words.preset, cli)?;
    let file = cli
        .seed
        .map_or(Ok(file.clone()), |seed| file.with_seed(seed))?;
    answer(words, cli, || {
        Accuracy::of_case(&file, request, &*cli.observer())
    })
}

fn answer<S: Subject>(
    words: &AccuracyWords,
    cli: &Cli,
    find: impl FnOnce() -> Result<Accuracy<S>, Error>,
) -> Result<u8, Error> {
    words
        .folder
        .prepare(cli, |files| Accuracy::<S>::list(None, files))?;
    let found = find()?;
    let text = format!("{}search took {:.1} s\n", found.text(), found.took_s);
    let mut object = json!({
        "is_reached": found.is_reached(), "took_s": found.took_s,
        "is_confirmed": found.verified.is_confirmed, "own_s": found.own_s, "search_s": found.spent_s, "run_s": found.run_s,
        "rows": found.table().objects(), "notes": found.notes,
    });
    object[format!("{}_hash", S::NAME)] = json!(found.of_scene);
    let of = (Default::default(), found.scene.provenance());
    words.folder.finish(
        cli,
        of,
        |files| Accuracy::list(Some(&found), files),
        (object, text),
    )?;
    Ok(u8::from(!found.is_reached()))
}
