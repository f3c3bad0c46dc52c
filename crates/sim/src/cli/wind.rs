//! `wakescope wind`: wind over height and turbulence from scans of any instrument.

use super::Cli;
use super::args::{FolderArgs, horizontal_wind, is_signals, not_negative, positive};
use super::data_files::each_usable;
use super::options::{OF_FULL_WINDS, OF_WINDS, WITHOUT_STATUS};
use crate::Error;
use crate::io::Provenance;
use crate::io::scans::{RaySweep, ScanFormat, read_rays};
use crate::outputs::Outputs;
use crate::progress::Observer;
use crate::retrieve::{WIDTH_OVER_STD, gate_of_instrument, scene_in_file};
use crate::scene::SceneFile;
use crate::wind::{
    self, CrossWind, Every, Kind, WindOptions, WindProfiles, wind_profiles, windows,
};
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `wakescope wind`.
#[derive(Debug, Args)]
pub(super) struct WindArgs {
    /// Scans of one lidar (CfRadial, HALO, WindCube, CSV), in any directions.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// Components of the wind; by default those that the beams determine.
    #[arg(long, value_enum)]
    kind: Option<Kind>,
    /// Window in s, or sweep; default: sweeps that determine winds, else 600.
    #[arg(long, value_name = "S", value_parser = every)]
    every: Option<Every>,
    /// Step of heights in m; by default that of gates, or 25.
    #[arg(long, value_name = "M", value_parser = positive)]
    height_step: Option<f64>,
    /// Thickness in m of layers of one dissipation rate.
    #[arg(long, value_name = "M", default_value_t = 100.0, value_parser = positive)]
    layer: f64,
    /// Outer scale of turbulence in m; by default found.
    #[arg(long, value_name = "M", value_parser = outer_scale)]
    outer_scale: Option<f64>,
    /// Wind across stares in m/s, east and north, or a wind.csv.
    #[arg(long, value_name = "E,N", allow_hyphen_values = true)]
    wind: Option<String>,
    /// Standard deviation of the gate's range weighting in m; 0 for points.
    #[arg(long, value_name = "M", value_parser = not_negative)]
    gate_std: Option<f64>,
    /// Skip velocities that the instrument flags.
    #[arg(long)]
    use_status: bool,
    #[command(flatten)]
    velocities: ScanFormat,
    #[command(flatten)]
    folder: FolderArgs,
}

fn every(word: &str) -> Result<Every, String> {
    match word {
        "sweep" => Ok(Every::Sweep),
        _ => match word.trim().parse() {
            Ok(seconds) if (1.0..=86_400.0).contains(&seconds) => Ok(Every::Seconds(seconds)),
            _ => Err("sweep, or seconds from 1 to 86400, e.g. 600".to_owned()),
        },
    }
}

fn outer_scale(word: &str) -> Result<f64, String> {
    positive(word)
        .ok()
        .filter(|outer_scale_m| (1.0..=1e5).contains(outer_scale_m))
        .ok_or_else(|| "an outer scale from 1 to 1e5 m, e.g. 100".to_owned())
}

/// What is said of raw signals.
const SIGNALS: &str = "it holds raw signals: `wakescope estimate` makes velocities of them";

pub(super) fn wind(args: &WindArgs, cli: &Cli) -> Result<(), Error> {
    cli.refuse_idle("wind", OF_WINDS)?;
    let cross_winds = match &args.wind {
        Some(word) => cross_winds(word)?,
        None => Vec::new(),
    };
    args.folder.prepare(cli, |files| list(None, files))?;
    let observer = cli.observer();
    let format = ScanFormat {
        ignores_status: !args.use_status,
        ..args.velocities.clone()
    };
    let read = each_usable(&args.data, &*observer, |path| match is_signals(path) {
        true => Err(Error::input(path, SIGNALS)),
        false => Ok((path.to_owned(), read_rays(path, &format)?)),
    })?;
    let mut sweeps = Vec::new();
    for (path, (own, notes)) in read {
        for note in notes {
            observer.warn(&format!("{}: {note}", path.display()));
        }
        sweeps.extend(own);
    }
    sweeps.retain(|sweep: &RaySweep| !sweep.rays.is_empty());
    if !sweeps.iter().any(|sweep| sweep.has_status) {
        cli.refuse_idle(&args.data[0], WITHOUT_STATUS)?;
    }
    let mut options = WindOptions {
        kind: args.kind,
        height_step_m: args.height_step,
        layer_m: args.layer,
        outer_scale_m: args.outer_scale,
        cross_winds,
        ..WindOptions::default()
    };
    let scene = add_gate(&mut options, &sweeps, args.gate_std, &*observer)?;
    let (windows, reference, notes) = windows(sweeps, args.every.unwrap_or(Every::Auto))?;
    for note in notes {
        observer.warn(&note);
    }
    let profiles = wind_profiles(&windows, reference, &options)?;
    if profiles.rows.iter().all(|row| row.kind == Kind::Full) {
        cli.refuse_idle(&args.data[0], OF_FULL_WINDS)?;
    }
    let origin = scene.map_or_else(|| Provenance::new("", "", 0), |scene| scene.provenance());
    let object = wind::json(&profiles, &options);
    let result = (&profiles, &options);
    args.folder.finish(
        cli,
        (Default::default(), origin),
        |files| list(Some(result), files),
        (object, wind::summary(&profiles)),
    )
}

/// Wind of a command line: two numbers, or a table.
fn cross_winds(word: &str) -> Result<Vec<CrossWind>, Error> {
    if Path::new(word)
        .extension()
        .is_some_and(|extension| extension == "csv")
    {
        return CrossWind::read(Path::new(word));
    }
    let (east, north) = horizontal_wind(word)
        .map_err(|allowed| Error::input(Path::new("--wind"), format!("{word:?}: {allowed}")))?;
    Ok(vec![CrossWind::uniform([east, north])])
}

/// Adds the weight of the gates: as stated, or that of the first file, whose scene comes back if it has one.
fn add_gate(
    options: &mut WindOptions,
    sweeps: &[RaySweep],
    stated_m: Option<f64>,
    observer: &dyn Observer,
) -> Result<Option<SceneFile>, Error> {
    let Some(first) = sweeps.first() else {
        return Ok(None);
    };
    let scene = scene_in_file(&first.path, first.scene_toml.as_deref(), observer)?;
    let content = scene.as_ref().map(|scene| &scene.content);
    let (gate, note) =
        gate_of_instrument(first.pulse_width_s, first.gate_length_m, stated_m, content)?;
    if let Some(note) = note {
        observer.warn(&format!("{}: {note}", first.path.display()));
    }
    options.gate_std_m = gate.std_m();
    for sweep in sweeps {
        let own = sweep
            .gate_stride
            .max(overlapping(sweep, options.gate_std_m));
        options.gate_stride = options.gate_stride.max(own);
    }
    if let Some(scene) = content {
        options.gate_stride = wind::gate_stride(scene);
    }
    let other = sweeps.iter().find(|sweep| {
        !are_alike(sweep.pulse_width_s, first.pulse_width_s)
            || !are_alike(sweep.gate_length_m, first.gate_length_m)
    });
    if let Some(other) = other.filter(|_| stated_m.is_none()) {
        observer.warn(&format!(
            "{}: its pulse or gates are others than those of {}, whose weight is taken for all: give files of one kind at a time",
            other.path.display(),
            first.path.display()
        ));
    }
    Ok(scene)
}

/// Whether two lengths differ by no more than a tenth, if both are known.
fn are_alike(a: Option<f64>, b: Option<f64>) -> bool {
    a.zip(b).is_none_or(|(a, b)| (a / b - 1.0).abs() < 0.1)
}

/// Gates of a sweep whose weights have widths, at half their heights, from one to the next; at least 1.
fn overlapping(sweep: &RaySweep, gate_std_m: f64) -> usize {
    let range_m = sweep.rays.first().map_or(&[][..], |ray| &ray.range_m);
    match range_m {
        [first_m, second_m, ..] => {
            let gates = gate_std_m * WIDTH_OVER_STD / (second_m - first_m).abs();
            // The larger of two of which one is not known is the other one.
            gates.max(1.0).min(range_m.len() as f64) as usize
        }
        _ => 1,
    }
}

/// Winds with the options by which they were found.
type Found<'f> = (&'f WindProfiles, &'f WindOptions);

/// The files; before the winds are found their names alone.
fn list(found: Option<Found<'_>>, files: &mut Outputs) -> Result<(), Error> {
    files.table("wind", found.as_ref(), |(profiles, _)| {
        Ok(wind::table(profiles))
    })?;
    files.add(
        "wind.json",
        found.as_ref(),
        |(profiles, options), origin| {
            let mut object = wind::json(profiles, options);
            object["source"] = origin.program.clone().into();
            object["scene_hash"] = origin.scene_hash.clone().into();
            Ok(format!("{object:#}\n"))
        },
    )?;
    files.netcdf("wind", found.as_ref(), |(profiles, _), origin| {
        wind::netcdf(profiles, origin)
    })?;
    #[cfg(feature = "plots")]
    {
        let figure = found.and_then(|(profiles, _)| wind::figure(profiles));
        files.figure("wind", figure.as_ref(), |figure| Ok(figure.clone()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::scans::Ray;

    #[test]
    fn gates_that_overlap_are_counted_for_any_ranges() {
        let count = |range_m: &[f64]| {
            let ray = Ray {
                range_m: range_m.to_vec(),
                ..Ray::default()
            };
            let sweep = RaySweep {
                rays: vec![ray],
                ..RaySweep::default()
            };
            overlapping(&sweep, 14.0)
        };
        assert_eq!(count(&[100.0, 105.0, 110.0, 115.0, 120.0, 125.0, 130.0]), 6);
        assert_eq!(count(&[100.0, 125.0, 150.0]), 1);
        assert_eq!(count(&[0.0, 0.0, 30.0]), 3);
        assert_eq!(count(&[f64::NAN, 30.0]), 1);
        assert_eq!(count(&[]), 1);
    }
}
