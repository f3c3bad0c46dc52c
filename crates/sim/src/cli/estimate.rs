//! `wakescope estimate`: velocities from raw signals, simulated or measured.

use super::words::{FolderWords, noise, positive};
use super::{Cli, load, paths, say};
use crate::Error;
use crate::io::number::ByteOrder;
use crate::io::raw::{Order, RawFormat, RawRecords};
use crate::measure::recorded::{self, NoiseLevel, RayTable, Recorded, RecordedOptions, record_shape};
use crate::plan::Plan;
use crate::write;
use clap::Args;
use clap::builder::PossibleValuesParser;
use serde_json::json;
use std::path::PathBuf;

/// Words of `wakescope estimate`.
#[derive(Debug, Args)]
pub(super) struct EstimateWords {
    /// The signals: signals.nc or another NetCDF file, NPY, NPZ, text (.csv, .txt), or a binary file with --format.
    data: PathBuf,
    /// The scene whose instrument recorded them and whose estimator they go through.
    #[arg(long, value_name = "SCENE.toml")]
    scene: PathBuf,
    #[command(flatten)]
    folder: FolderWords,
    /// Numbers of a binary file.
    #[arg(long, value_name = "KIND", value_parser = PossibleValuesParser::new(["i8", "u8", "i16", "u16", "i32", "u32", "f32", "f64"]))]
    format: Option<String>,
    /// Their byte order: the lowest or the highest byte first.
    #[arg(long, value_enum, default_value_t, requires = "format")]
    byte_order: ByteOrder,
    /// Bytes before the first number.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "format")]
    header_bytes: u64,
    /// Samples are pairs of numbers, in phase and quadrature.
    #[arg(long)]
    complex: bool,
    /// Which index runs fastest: [line, pulse, sample], [pulse, line, sample] or [sample, line, pulse].
    #[arg(long, value_enum, default_value_t)]
    order: Order,
    /// What the numbers are multiplied with, such as ampere per count.
    #[arg(long, value_name = "A", default_value_t = 1.0, value_parser = positive)]
    scale: f64,
    /// The variable of a NetCDF file, or the array of an NPZ file, that holds the samples.
    #[arg(long, value_name = "NAME")]
    variable: Option<String>,
    /// The variable of a NetCDF file that holds the second quadrature.
    #[arg(long, value_name = "NAME")]
    quadrature: Option<String>,
    /// Table of elevation_rad or elevation_deg, and time_s, of each record or line.
    #[arg(long, value_name = "FILE.csv")]
    rays: Option<PathBuf>,
    /// Power of the noise in the band: that of the scene, of the quietest gates, or a number in the square of the samples' unit.
    #[arg(long, value_name = "scene|quietest|POWER", value_parser = noise)]
    noise: Option<NoiseLevel>,
    /// Write the spectrum of each gate, spectra.nc.
    #[arg(long)]
    spectra: bool,
}

pub(super) fn estimate(words: &EstimateWords, cli: &Cli) -> Result<(), Error> {
    let scene = load(&words.scene, cli)?;
    let format = RawFormat {
        number: words.format.clone(),
        byte_order: words.byte_order,
        complex: words.complex,
        order: words.order,
        header_bytes: words.header_bytes,
        scale: words.scale,
        variable: words.variable.clone(),
        quadrature: words.quadrature.clone(),
    };
    let mut records = RawRecords::open(&words.data, &format, record_shape(&scene.scene))?;
    let rays = words.rays.as_deref().map(RayTable::read).transpose()?;
    let (plan, is_own) = recorded::plan(scene, &records)?;
    words.folder.prepare(&write::recorded_names(&plan)?)?;
    let options = RecordedOptions { rays, noise: words.noise, spectra: words.spectra, block_bytes: None };
    let found = recorded::estimate((&plan, is_own), &mut records, &options, &*cli.observer())?;
    let (text, results) = told(&plan, &found, records.records());
    let files = write::write_recorded(&plan, found, &words.folder.out, words.folder.existing())?;
    let object = json!({
        "version": crate::VERSION, "scene_hash": plan.scene.hash, "data": words.data.to_string_lossy(), "results": results,
        "files": paths(&files),
    });
    say(cli.json, &object, &(text + &words.folder.wrote(&files)))
}

/// The result in a few numbers.
fn told(plan: &Plan, found: &Recorded, records: usize) -> (String, serde_json::Value) {
    match found {
        Recorded::OfRun { map, .. } => {
            let scans = plan.realisations();
            let text = format!(
                "{records} records of {scans} scans of this scene: the map has the truth of its flow beside it\n"
            );
            let cells = map.v_mean_m_s.len();
            (text, json!({ "records": records, "scans": scans, "gates": cells, "truth": true }))
        }
        Recorded::Measured { scans, .. } => {
            let gates: usize = scans.iter().map(|scan| scan.velocity_m_s.len()).sum();
            let flagged: f64 = scans.iter().map(|scan| scan.flagged.sum()).sum();
            let lines: usize = scans.iter().map(|scan| scan.lines.elevation_rad.len()).sum();
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
