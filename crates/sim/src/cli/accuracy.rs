//! `wakescope accuracy`: numerical error and run time of a scene or flow, setting by setting.

use super::Cli;
use super::flow::{case_file, seeded};
use super::words::FolderWords;
use crate::Error;
use crate::accuracy::{Report, Request};
use crate::flow::WakePreset;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `wakescope accuracy`.
#[derive(Debug, Args)]
pub(super) struct AccuracyArgs {
    /// Scene file, or case file of a flow or wake.
    #[arg(required_unless_present = "preset")]
    scene: Option<PathBuf>,
    /// Wake preset; a case file overrides its keys.
    #[arg(long, value_enum)]
    preset: Option<WakePreset>,
    #[command(flatten)]
    request: Request,
    #[command(flatten)]
    folder: FolderWords,
}

/// Returns the exit code: 1 where a setting has no value within the error.
pub(super) fn accuracy(args: &AccuracyArgs, cli: &Cli) -> Result<u8, Error> {
    let prepare = || args.folder.prepare(cli, |files| Report::list(None, files));
    let path = args.scene.as_deref();
    let scene = path.filter(|path| args.preset.is_none() && !cli.is_case(path));
    let report = match scene {
        Some(path) => {
            let file = cli.scene(path)?;
            prepare()?;
            Report::of_scene(&file, &args.request, &*cli.observer())?
        }
        None => {
            let file = seeded(case_file(path, args.preset, cli)?, cli)?;
            prepare()?;
            Report::of_case(&file, &args.request, &*cli.observer())?
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
    args.folder.finish(
        cli,
        (Default::default(), report.provenance.clone()),
        |files| Report::list(Some(&report), files),
        (object, report.text()),
    )?;
    Ok(u8::from(!report.is_reached()))
}
