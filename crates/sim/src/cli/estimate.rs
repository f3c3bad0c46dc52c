//! `wakescope estimate`: velocities from raw signals, simulated or measured.

use super::Cli;
use super::args::{FolderArgs, noise, positive};
use super::options::{IN_MEMORY, OF_RECORDED_SIGNALS};
use crate::Error;
use crate::io::raw::RawFormat;
use crate::measure::recorded::{self, NoiseLevel, RayTable, Recorded, RecordedOptions};
use crate::plan::{Plan, Target};
use crate::write;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `wakescope estimate`.
#[derive(Debug, Args)]
pub(super) struct EstimateArgs {
    /// Raw signals: NetCDF, NPY, NPZ, or a binary file with --format.
    data: PathBuf,
    /// Scene of the instrument and the estimator.
    #[arg(long, value_name = "SCENE.toml")]
    scene: PathBuf,
    #[command(flatten)]
    folder: FolderArgs,
    #[command(flatten)]
    format: RawFormat,
    /// Scale factor of raw samples, e.g. A per count.
    #[arg(long, value_name = "A", default_value_t = 1.0, value_parser = positive)]
    scale: f64,
    /// Frequencies rise with velocities towards the lidar.
    #[arg(long)]
    towards: bool,
    /// CSV table of elevation_rad or elevation_deg, and time_s, per record or line.
    #[arg(long, value_name = "FILE.csv")]
    rays: Option<PathBuf>,
    /// In-band noise power: scene, quietest gates, or a number (sample unit squared).
    #[arg(long, value_name = "scene|quietest|POWER", value_parser = noise)]
    noise: Option<NoiseLevel>,
    /// Write the spectrum of each gate to spectra.nc.
    #[arg(long)]
    spectra: bool,
}

pub(super) fn estimate(args: &EstimateArgs, cli: &Cli) -> Result<(), Error> {
    let scene = cli.scene(&args.scene)?;
    let mut records = match cli.signals(&args.data) {
        Some(records) => {
            cli.refuse_idle(&args.data, IN_MEMORY)?;
            records.not_empty()?
        }
        None => recorded::open(&args.data, &args.format, &scene.content)?,
    };
    records.scale = args.scale;
    records.is_reversed = args.towards;
    let rays = args.rays.as_deref().map(RayTable::read).transpose()?;
    let observer = cli.observer();
    let (scene, is_own) = recorded::scene_of_records(scene, &records, &*observer)?;
    if !is_own {
        cli.refuse_idle(&args.data, OF_RECORDED_SIGNALS)?;
    }
    let plan = Plan::new(scene, Target::Map)?;
    args.folder
        .prepare_names(cli, &write::recorded_names(&plan)?)?;
    let options = RecordedOptions {
        rays,
        noise: args.noise,
        spectra: args.spectra,
        block_bytes: None,
    };
    let found = recorded::estimate((&plan, is_own), &mut records, &options, &*observer)?;
    let (text, results) = report(&plan, &found, records.records);
    let of = (plan.scene().outputs, plan.file.provenance());
    let object = json!({ "scene_hash": plan.file.hash, "data": args.data.to_string_lossy(), "results": results });
    args.folder.finish(
        cli,
        of,
        |files| write::list_recorded(&plan, found, files),
        (object, text),
    )
}

/// The result in a few numbers.
fn report(plan: &Plan, found: &Recorded, records: usize) -> (String, serde_json::Value) {
    match found {
        Recorded::OfRun { map, .. } => {
            let scans = plan.realisations();
            let text = format!(
                "{records} records of {scans} scans of this scene: the map has the truth of its flow beside it\n"
            );
            let cells = map.v_mean_m_s.len();
            (
                text,
                json!({ "records": records, "scans": scans, "gates": cells, "truth": true }),
            )
        }
        Recorded::Measured { scans, .. } => {
            let gates: usize = scans.iter().map(|scan| scan.velocity_m_s.len()).sum();
            let flagged: f64 = scans.iter().map(|scan| scan.flagged.sum()).sum();
            let lines: usize = scans
                .iter()
                .map(|scan| scan.lines.elevation_rad.len())
                .sum();
            let fraction = flagged / gates.max(1) as f64;
            let text = format!(
                "{records} records: {} scans of {lines} lines together\nfraction of flagged estimates {fraction:.4}\n",
                scans.len()
            );
            let object = json!({
                "records": records, "scans": scans.len(), "lines": lines, "gates": gates, "truth": false,
                "flagged_fraction": fraction,
            });
            (text, object)
        }
    }
}
