//! `wakescope sweep`: design studies.

use super::options::{BESIDE_MERGE, OF_MERGED_WITHOUT_SCENE};
use super::{Cli, paths};
use crate::io::Existing;
use crate::sweep::{Request, Settings, Sweep, merge, run};
use crate::{Error, sweep};
use serde_json::json;
use std::path::{Path, PathBuf};

/// The cases of a sweep over a scene, if there is one.
pub(super) fn cases(
    scene: Option<&Path>,
    request: &Request,
    cli: &Cli,
) -> Result<Option<Sweep>, Error> {
    let request = Request {
        seed: cli.seed,
        ..request.clone()
    };
    scene.map(|scene| cli.sweep(scene, &request)).transpose()
}

/// Runs the cases, or, if there are folders to merge, makes the tables from the results in these.
pub(super) fn sweep(
    cases: Option<&Sweep>,
    folders: &[PathBuf],
    out: &Path,
    settings: Settings,
    cli: &Cli,
) -> Result<(), Error> {
    let Some(sweep) = cases.filter(|_| folders.is_empty()) else {
        cli.refuse_idle("--merge", BESIDE_MERGE)?;
        if cases.is_none() {
            cli.refuse_idle("--merge", OF_MERGED_WITHOUT_SCENE)?;
        }
        let existing = Existing::with_overwrite(settings.overwrite);
        let files = merge(folders, cases, out, existing)?;
        let text = format!("wrote {} files to {}", files.len(), out.display());
        let object = json!({ "version": crate::VERSION, "files": paths(&files) });
        return cli.say(&object, &text);
    };
    let summary = run(sweep, out, settings, &*cli.observer())?;
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
        out.display()
    );
    let object = json!({
        "version": crate::VERSION, "sweep_hash": sweep.origin.scene_hash, "cases": sweep.cases.len(), "run": ran, "kept": kept,
        "flows": flows, "efficiencies": efficiencies, "signals": signals, "files": paths(&files),
    });
    cli.say(&object, &text)
}
