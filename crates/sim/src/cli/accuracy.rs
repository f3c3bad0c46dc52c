//! `wakescope accuracy`: numerical error and run time of a scene or flow, setting by setting.

use super::Cli;
use super::args::FolderArgs;
use super::flow::{case_file, seeded};
use crate::Error;
use crate::accuracy::{Report, Request};
use crate::flow::WakePreset;
use serde_json::json;
use std::path::Path;

/// Reports on a scene, or on the case file of a flow or wake, whose keys override those of a preset.
/// Returns the exit code: 1 where a setting has no value within the error.
pub(super) fn accuracy(
    path: Option<&Path>,
    preset: Option<WakePreset>,
    request: &Request,
    folder: &FolderArgs,
    cli: &Cli,
) -> Result<u8, Error> {
    let scene = path.filter(|path| preset.is_none() && !cli.is_case(path));
    let report = match scene {
        Some(path) => {
            let file = cli.scene(path)?;
            folder.prepare(cli, |files| Report::list(None, files))?;
            Report::of_scene(&file, request, &*cli.observer())?
        }
        None => {
            let file = seeded(case_file(path, preset, cli)?, cli)?;
            folder.prepare(cli, |files| Report::list(None, files))?;
            Report::of_case(&file, request, &*cli.observer())?
        }
    };
    let cheapest = report.cheapest();
    let cheapest_setting = cheapest.map(|(setting, _)| setting.key);
    let cheapest_value = cheapest.map(|(_, row)| row.value);
    let mut object = json!({
        "within": report.within,
        "is_reached": report.is_reached(),
        "cheapest_setting": cheapest_setting,
        "cheapest_value": cheapest_value,
        "realisations": report.realisations,
        "rows": report.table().objects(),
        "notes": report.notes,
    });
    object[format!("{}_hash", report.subject)] = json!(report.provenance.scene_hash);
    folder.finish(
        cli,
        (Default::default(), report.provenance.clone()),
        |files| Report::list(Some(&report), files),
        (object, report.text()),
    )?;
    Ok(u8::from(!report.is_reached()))
}
