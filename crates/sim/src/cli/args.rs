//! Arguments that several commands share: output folder, how scans are read, how numbers are written.

use super::Cli;
use super::options::{ON_SIGNALS, ON_VELOCITIES, refusal_of_idle};
use super::output::paths;
use crate::io::netcdf_input;
use crate::io::raw::{RawFormat, RawRecords};
use crate::io::scans::{self, ReadScan, ScanFormat};
use crate::io::{Existing, Provenance};
use crate::measure::recorded::{
    self, MeasuredScan, NoiseLevel, Recorded, RecordedOptions, Spectra,
};
use crate::outputs::Outputs;
use crate::plan::{Plan, Target};
use crate::progress::{Observer, Silent};
use crate::scene::SceneFile;
use crate::{Error, retrieve, scene};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{ArgAction, Args};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use wakescope_estimate::retrieval::Turbulence;

/// The folder of a command.
#[derive(Debug, Args)]
pub(super) struct FolderArgs {
    /// Output folder; created if missing.
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Replace existing files in the output folder.
    #[arg(long)]
    overwrite: bool,
}

impl FolderArgs {
    fn existing(&self) -> Existing {
        Existing::with_overwrite(self.overwrite)
    }

    /// Finds out whether the files of a list can be written.
    pub(super) fn prepare(
        &self,
        cli: &Cli,
        list: impl FnOnce(&mut Outputs) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.prepare_names(cli, &Outputs::names(scene::Outputs::default(), list)?)
    }

    /// Finds out whether files of these names can be written.
    pub(super) fn prepare_names(&self, cli: &Cli, names: &[String]) -> Result<(), Error> {
        cli.prepare(&self.out, names, self.existing())
    }

    /// Writes the files of a list, and gives the result as an object and as a text, to which they are added.
    pub(super) fn finish(
        &self,
        cli: &Cli,
        of: (scene::Outputs, Provenance),
        list: impl FnOnce(&mut Outputs) -> Result<(), Error>,
        (mut object, text): (Value, String),
    ) -> Result<(), Error> {
        let files = cli.write(&self.out, self.existing(), of, list)?;
        (object["version"], object["files"]) = (crate::VERSION.into(), paths(&files).into());
        cli.say(
            &object,
            &format!(
                "{text}wrote {} files to {}",
                files.len(),
                self.out.display()
            ),
        )
    }
}

/// What is known of the air and of the gates.
#[derive(Debug, Args)]
pub(super) struct AirArgs {
    /// Turbulence: auto, or deviation and length (m/s, m); default none.
    #[arg(long, value_name = "auto|SIGMA,LENGTH", value_parser = turbulence)]
    pub(super) turbulence: Option<Turbulence>,
    /// Standard deviation of the gate's range weighting in m; 0 for points.
    #[arg(long, value_name = "M", value_parser = not_negative)]
    pub(super) gate_std: Option<f64>,
    /// Image vortices below the ground.
    #[arg(long = "ground", action = ArgAction::Set, default_value = "yes", value_parser = switch(["yes", "no"]))]
    pub(super) images: bool,
}

/// How scans of files are read.
#[derive(Debug, Args)]
pub(super) struct ScanArgs {
    /// Scale factor of raw samples; the noise is then the scene's.
    #[arg(long, value_name = "A", value_parser = positive)]
    scale: Option<f64>,
    #[command(flatten)]
    pub(super) velocities: ScanFormat,
}

/// What a file of scans holds.
pub(super) struct Scans {
    pub(super) maps: Vec<ReadScan>,
    /// What was skipped or not understood.
    pub(super) left_out: Vec<String>,
    /// The raw signals that the maps are made of.
    pub(super) signals: Option<Signals>,
}

/// Raw signals of scans.
pub(super) struct Signals {
    pub(super) records: RawRecords,
    pub(super) plan: Plan,
    pub(super) scans: Vec<MeasuredScan>,
    pub(super) spectra: Option<Spectra>,
}

impl ScanArgs {
    /// The scans of a file; raw signals go through the estimator of the scene, whose spectra are kept if requested.
    pub(super) fn read(
        &self,
        path: &Path,
        scene: Option<&SceneFile>,
        spectra: bool,
        observer: &dyn Observer,
    ) -> Result<Scans, Error> {
        if is_signals(path) {
            return self.signals(path, scene, spectra, observer);
        }
        let (maps, left_out) = scans::read(path, &self.velocities)?;
        Ok(Scans {
            maps,
            left_out,
            signals: None,
        })
    }

    fn signals(
        &self,
        path: &Path,
        scene: Option<&SceneFile>,
        spectra: bool,
        observer: &dyn Observer,
    ) -> Result<Scans, Error> {
        let Some(scene) = scene else {
            let reason = "it holds raw signals: --scene says which instrument recorded them";
            return Err(Error::input(path, reason));
        };
        let mut records = recorded::open(path, &RawFormat::default(), &scene.content)?;
        records.scale = self.scale.unwrap_or(1.0);
        records.is_reversed = self.velocities.towards;
        let (scene, is_own) = recorded::scene_of_records(scene.clone(), &records, observer)?;
        let plan = Plan::new(scene, Target::Map)?;
        if is_own && self.scale.is_some() {
            let reason = "signals of a simulation are in ampere";
            return Err(refusal_of_idle(path, "scale", reason));
        }
        let noise = if is_own || self.scale.is_some() {
            NoiseLevel::OfScene
        } else {
            NoiseLevel::Quietest
        };
        // What is known of the air is not looked at: this is a retrieval.
        let options = RecordedOptions {
            noise: Some(noise),
            spectra,
            ..RecordedOptions::default()
        };
        let (scans, spectra) =
            match recorded::estimate((&plan, false), &mut records, &options, &Silent)? {
                Recorded::Measured { scans, spectra } => (scans, spectra),
                Recorded::OfRun { .. } => (Vec::new(), None),
            };
        let mut maps = Vec::with_capacity(scans.len());
        for (sweep, scan) in scans.iter().enumerate() {
            maps.push(retrieve::scan_of_signals(path, sweep, &plan, scan));
        }
        Ok(Scans {
            maps,
            left_out: Vec::new(),
            signals: Some(Signals {
                records,
                plan,
                scans,
                spectra,
            }),
        })
    }
}

/// Refuses options of scans that have no effect on the files that are given.
pub(super) fn refuse_idle(data: &[PathBuf], cli: &Cli) -> Result<(), Error> {
    for path in data {
        let idle = if is_signals(path) {
            ON_SIGNALS
        } else {
            ON_VELOCITIES
        };
        cli.refuse_idle(path, idle)?;
    }
    Ok(())
}

/// Whether a file holds raw signals and no map.
pub(super) fn is_signals(path: &Path) -> bool {
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default();
    ["npy", "npz"].contains(&extension)
        || netcdf_input::open(path).is_ok_and(|file| file.has("current_a"))
}

/// A number of which `is_allowed` holds, or what is allowed.
fn read<T: FromStr>(
    word: &str,
    is_allowed: impl Fn(&T) -> bool,
    allowed: &str,
) -> Result<T, String> {
    word.trim()
        .parse()
        .ok()
        .filter(is_allowed)
        .ok_or_else(|| allowed.to_owned())
}

/// Two numbers with a comma between.
fn two<T: FromStr>(
    word: &str,
    are_allowed: impl Fn(&(T, T)) -> bool,
    allowed: &str,
) -> Result<(T, T), String> {
    let both = word
        .split_once(',')
        .and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
    both.filter(are_allowed).ok_or_else(|| allowed.to_owned())
}

pub(super) fn not_negative(word: &str) -> Result<f64, String> {
    read(
        word,
        |value| (0.0..f64::INFINITY).contains(value),
        "a number from 0 on, e.g. 14.4",
    )
}

pub(super) fn positive(word: &str) -> Result<f64, String> {
    read(
        word,
        |value: &f64| *value > 0.0 && value.is_finite(),
        "a number above 0, e.g. 2.35 or 1e-6",
    )
}

pub(super) fn rate(word: &str) -> Result<f64, String> {
    read(
        word,
        |rate| (1e-9..=0.5).contains(rate),
        "a rate from 1e-9 to 0.5, e.g. 0.01",
    )
}

pub(super) fn range(word: &str) -> Result<f64, String> {
    let allowed = "a range from 1 to 1e6 m, or several with commas between them, e.g. 280,400";
    read(word, |range_m| (1.0..=1e6).contains(range_m), allowed)
}

pub(super) fn turbulence(word: &str) -> Result<Turbulence, String> {
    if word == "auto" {
        return Ok(Turbulence::OfScan);
    }
    let (deviation_m_s, length_m) = two(
        word,
        |(deviation_m_s, length_m): &(f64, f64)| {
            let are_finite = deviation_m_s.is_finite() && length_m.is_finite();
            are_finite && *deviation_m_s > 0.0 && *length_m > 0.0
        },
        "auto, or two numbers above 0, m/s and m, with a comma between, e.g. 1.2,25",
    )?;
    Ok(Turbulence::Exponential {
        deviation_m_s,
        length_m,
    })
}

pub(super) fn horizontal_wind(word: &str) -> Result<(f64, f64), String> {
    let allowed = "east and north in m/s with a comma between, from -200 to 200, e.g. 4.2,-1.5; or a wind.csv";
    two(
        word,
        |(east, north): &(f64, f64)| {
            let is_allowed = |speed: f64| (-200.0..=200.0).contains(&speed);
            is_allowed(*east) && is_allowed(*north)
        },
        allowed,
    )
}

pub(super) fn spacing(word: &str) -> Result<(f64, f64), String> {
    let allowed = "two distances from 1 to 1e4 m, the smaller one first, e.g. 16,63";
    two(
        word,
        |(least, most)| *least >= 1.0 && least <= most && *most <= 1e4,
        allowed,
    )
}

pub(super) fn stride(word: &str) -> Result<(usize, usize), String> {
    two(
        word,
        |(lines, gates)| (1..=1000).contains(lines) && (1..=1000).contains(gates),
        "two whole numbers from 1 to 1000, e.g. 4,8",
    )
}

pub(super) fn noise(word: &str) -> Result<NoiseLevel, String> {
    match word {
        "scene" => Ok(NoiseLevel::OfScene),
        "quietest" => Ok(NoiseLevel::Quietest),
        _ => positive(word)
            .map(NoiseLevel::Given)
            .map_err(|_| "scene, quietest or a power above 0, e.g. 2.5e-13".to_owned()),
    }
}

/// Words of which the first one is true.
pub(super) fn switch([on, off]: [&'static str; 2]) -> impl TypedValueParser<Value = bool> {
    PossibleValuesParser::new([on, off]).map(move |word| word == on)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_or_refused_with_an_example() {
        assert_eq!(
            (spacing("47,47"), stride("4,8"), rate("1e-3")),
            (Ok((47.0, 47.0)), Ok((4, 8)), Ok(1e-3))
        );
        assert!(
            spacing("60,20").is_err()
                && spacing("0,20").is_err()
                && stride("0,1").is_err()
                && stride("a").is_err()
        );
        assert!(rate("0").is_err() && rate("0.7").is_err() && rate("inf").is_err());
    }
}
