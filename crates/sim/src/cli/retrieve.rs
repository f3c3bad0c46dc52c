//! `wakescope retrieve`: vortices from scans, maps of any instrument or signals of a scene.

use super::{Cli, load, progress, say};
use crate::Error;
use crate::io::raw::{RawFormat, RawRecords};
use crate::io::scans::{self, ReadScan, ScanFormat};
use crate::io::{Existing, FileGroup, Provenance};
use crate::measure::progress::{Observer, Silent};
use crate::measure::recorded::{self, MeasuredScan, NoiseLevel, Recorded, RecordedOptions, record_shape};
use crate::measure::write;
use crate::plan::{Plan, Target};
use crate::retrieve::{self, Method, OwnScene, RetrievedScan, gate_of};
use crate::scene::{SceneFile, VortexProfile};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};
use wakescope_estimate::retrieval::{Covariance, Flag, Gate, Movement, RetrievalOptions, Turbulence};
use wakescope_estimate::vortex_fit::{CoreProfile, Loss, Sharing, WakeModel};

/// Words of `wakescope retrieve`.
#[derive(Debug, Args)]
pub(super) struct RetrieveWords {
    /// Maps of scans: CfRadial 1.4 (classic NetCDF), HALO .hpl, CSV; or raw signals, signals.nc, NPY or NPZ, with --scene.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// The scene of the instrument; a map of this program has its own in it.
    #[arg(long, value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// How circulations are found.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// Folder to write to; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Whether image vortices make the ground a streamline.
    #[arg(long, value_enum, default_value_t = YesNo::Yes)]
    ground: YesNo,
    /// Standard deviation of the weight of a gate along the line, m; 0 for velocities at points.
    #[arg(long, value_name = "M", value_parser = not_negative)]
    gate_std: Option<f64>,
    /// Circulation against radius; of the scene without it, else algebraic.
    #[arg(long, value_enum)]
    profile: Option<Profile>,
    /// Core radius that is kept, m; fitted without it.
    #[arg(long, value_name = "M", value_parser = positive)]
    core: Option<f64>,
    /// What residuals cost: cauchy bears outliers, squares does not.
    #[arg(long, value_enum, default_value_t = LossWord::Cauchy)]
    loss: LossWord,
    /// Standard deviation, m/s, and length, m, of turbulence that neighbouring velocities share, e.g. 1.2,25.
    #[arg(long, value_name = "SIGMA,LENGTH", value_parser = turbulence)]
    turbulence: Option<Turbulence>,
    /// Where deviations come from: the residuals, or the stated deviations of the velocities.
    #[arg(long, value_enum, default_value_t = CovarianceWord::Sandwich)]
    covariance: CovarianceWord,
    /// Whether vortices move while a scan lasts: whichever fits better, yes, or no.
    #[arg(long, value_enum, default_value_t = MotionWord::Auto)]
    motion: MotionWord,
    /// Least gain of chi-square over the wind alone that makes a wake.
    #[arg(long, value_name = "T", default_value_t = RetrievalOptions::DEFAULT_THRESHOLD, value_parser = not_negative)]
    threshold: f64,
    /// Height of the lidar above the ground, m; of the scene without it, else 0.
    #[arg(long, value_name = "M", value_parser = not_negative)]
    lidar_height: Option<f64>,
    /// The variable or column that holds the velocities.
    #[arg(long, value_name = "NAME")]
    field: Option<String>,
    /// Velocities are positive towards the lidar.
    #[arg(long)]
    towards: bool,
    /// Leave out velocities below this signal-to-noise ratio, dB.
    #[arg(long, value_name = "DB", allow_negative_numbers = true)]
    min_snr: Option<f64>,
    /// Replace files in the folder that this program did not write, or that were changed since.
    #[arg(long)]
    overwrite: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum YesNo {
    Yes,
    No,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Profile {
    Algebraic,
    LambOseen,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LossWord {
    Cauchy,
    Squares,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CovarianceWord {
    Sandwich,
    Model,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MotionWord {
    Auto,
    Yes,
    No,
}

fn not_negative(word: &str) -> Result<f64, String> {
    let value = word.trim().parse::<f64>().ok().filter(|v| *v >= 0.0 && v.is_finite());
    value.ok_or_else(|| "a number from 0 on, e.g. 14.4".into())
}

fn positive(word: &str) -> Result<f64, String> {
    let value = word.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
    value.ok_or_else(|| "a number above 0, e.g. 2.35".into())
}

fn turbulence(word: &str) -> Result<Turbulence, String> {
    let both = word.split_once(',').and_then(|(a, b)| Some((positive(a).ok()?, positive(b).ok()?)));
    let (deviation_m_s, length_m) = both.ok_or("two numbers above 0, m/s and m, with a comma between, e.g. 1.2,25")?;
    Ok(Turbulence { deviation_m_s, length_m })
}

impl RetrieveWords {
    fn options(&self, scene: Option<&SceneFile>, gate: Gate) -> RetrievalOptions {
        let of_scene = scene.map(|file| &file.scene);
        let profile = match (self.profile, of_scene.map(|scene| &scene.flow)) {
            (Some(Profile::LambOseen), _) => CoreProfile::LambOseen,
            (None, Some(crate::scene::Flow::VortexPair(pair))) if pair.profile == VortexProfile::LambOseen => {
                CoreProfile::LambOseen
            }
            _ => CoreProfile::Algebraic,
        };
        let height_m = self.lidar_height.or(of_scene.map(|scene| scene.scan.lidar_height_m));
        let mut options = RetrievalOptions {
            model: WakeModel {
                profile,
                images: self.ground == YesNo::Yes,
                lidar_height_m: height_m.unwrap_or(0.0),
                ..WakeModel::default()
            },
            gate,
            core_radius_m: self.core,
            turbulence: self.turbulence,
            covariance: match self.covariance {
                CovarianceWord::Sandwich => Covariance::Sandwich,
                CovarianceWord::Model => Covariance::Model,
            },
            movement: match self.motion {
                MotionWord::Auto => Movement::Auto,
                MotionWord::Yes => Movement::Moving,
                MotionWord::No => Movement::Frozen,
            },
            threshold: self.threshold,
            ..RetrievalOptions::default()
        };
        if self.loss == LossWord::Squares {
            options.loss = Loss::Squares;
        }
        if self.core.is_some() {
            options.free.core_radius = Sharing::Fixed;
        }
        options
    }
}

/// What is retrieved: maps, or signals with the maps of their scans.
enum Input {
    Map(Box<ReadScan>),
    Signals { path: PathBuf, records: Box<RawRecords>, plan: Box<Plan>, scans: Vec<MeasuredScan> },
}

pub(super) fn retrieve(words: &RetrieveWords, cli: &Cli) -> Result<(), Error> {
    let stated = words.scene.as_deref().map(|path| load(path, cli)).transpose()?;
    let format = ScanFormat { field: words.field.clone(), towards: words.towards, min_snr_db: words.min_snr };
    let mut told = progress_of(cli);
    let mut inputs = Vec::new();
    for path in &words.data {
        if is_signals(path) {
            inputs.push(signals(path, words, stated.clone())?);
            continue;
        }
        if words.method == Method::Signals {
            let reason = "it is no file of raw signals, which --method signals needs: --method fit takes maps".into();
            return Err(Error::Input { path: path.clone(), reason });
        }
        let (found, left_out) = scans::read(path, &format)?;
        left_out.iter().for_each(|text| told.warn(&format!("{}: {text}: left out", path.display())));
        inputs.extend(found.into_iter().map(|scan| Input::Map(Box::new(scan))));
    }
    let count: usize =
        inputs.iter().map(|input| if let Input::Signals { scans, .. } = input { scans.len() } else { 1 }).sum();
    let existing = if words.overwrite { Existing::Any } else { Existing::Own };
    write::prepare(&words.out, names(count).iter().map(String::as_str), existing)?;
    let mut found = Vec::new();
    for input in inputs {
        match input {
            Input::Map(scan) => found.push(of_map(words, stated.as_ref(), *scan, told.as_mut())?),
            Input::Signals { path, mut records, plan, scans } => {
                found.extend(of_signals(words, &path, &mut records, &plan, &scans)?);
            }
        }
    }
    same_origin(&mut found);
    let files = files(words, stated.as_ref(), &found, existing)?;
    let object = json!({ "version": crate::VERSION, "scans": retrieve::json(&found), "files": files });
    say(cli.json, &object, &format!("{}wrote {} files to {}", text(&found), files.len(), words.out.display()))
}

fn progress_of(cli: &Cli) -> Box<dyn Observer> {
    if cli.quiet { Box::new(progress::Quiet) } else { Box::new(progress::Bars::new()) }
}

/// Whether a file holds raw signals and no map.
fn is_signals(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    if ["npy", "npz"].contains(&extension) {
        return true;
    }
    #[cfg(feature = "netcdf")]
    return crate::io::netcdf_input::open(path).is_ok_and(|file| file.has("current_a"));
    #[cfg(not(feature = "netcdf"))]
    false
}

/// The map of signals first: it starts the fit.
fn signals(path: &Path, words: &RetrieveWords, scene: Option<SceneFile>) -> Result<Input, Error> {
    let Some(scene) = scene else {
        let reason = "it holds raw signals: --scene says which instrument recorded them".into();
        return Err(Error::Input { path: path.to_owned(), reason });
    };
    let mut records = RawRecords::open(path, &RawFormat::default(), record_shape(&scene.scene))?;
    let (plan, is_own) = recorded::plan(scene, &records)?;
    let noise = if is_own { NoiseLevel::OfScene } else { NoiseLevel::Quietest };
    // What is known of the air is not looked at: this is a retrieval.
    let options = RecordedOptions { noise: Some(noise), ..RecordedOptions::default() };
    let found = recorded::estimate((&plan, false), &mut records, &options, &Silent)?;
    let scans = if let Recorded::Measured { scans, .. } = found { scans } else { Vec::new() };
    debug_assert!(words.scene.is_some());
    Ok(Input::Signals { path: path.to_owned(), records: Box::new(records), plan: Box::new(plan), scans })
}

/// The scene of a map of this program, if it is one.
fn scene_of(scan: &ReadScan) -> Option<SceneFile> {
    SceneFile::parse(scan.scene_toml.as_deref()?, &scan.path).ok()
}

fn of_map(
    words: &RetrieveWords,
    stated: Option<&SceneFile>,
    scan: ReadScan,
    told: &mut dyn Observer,
) -> Result<RetrievedScan, Error> {
    let own = scene_of(&scan);
    let scene = stated.or(own.as_ref());
    let (gate, remark) = gate_of(&scan, words.gate_std, scene.map(|file| &file.scene))?;
    if let Some(remark) = remark {
        told.warn(&format!("{}: {remark}", scan.path.display()));
    }
    // What the estimator of a scene makes of a wake is in its own maps alone.
    let response = match (own.is_some() && words.gate_std.is_none(), scene) {
        (true, Some(scene)) => own_scene(&Plan::new(scene.clone(), Target::Map)?)?,
        _ => None,
    };
    retrieve::retrieve_map(scan, words.method, words.options(scene, gate), response.as_ref())
}

fn own_scene(plan: &Plan) -> Result<Option<OwnScene>, Error> {
    OwnScene::new(plan, &Silent)
}

fn of_signals(
    words: &RetrieveWords,
    path: &Path,
    records: &mut RawRecords,
    plan: &Plan,
    scans: &[MeasuredScan],
) -> Result<Vec<RetrievedScan>, Error> {
    let own = own_scene(plan)?;
    let of_scan = |(sweep, measured): (usize, &MeasuredScan)| {
        let scan = retrieve::scan_of_signals(path, sweep, plan, measured);
        let (gate, _) = gate_of(&scan, words.gate_std, Some(&plan.scene.scene))?;
        let map_method = if words.method == Method::Signals { Method::Fit } else { words.method };
        let found = retrieve::retrieve_map(scan, map_method, words.options(Some(&plan.scene), gate), own.as_ref())?;
        match &own {
            Some(own) if words.method == Method::Signals => retrieve::retrieve_signals(own, records, measured, found),
            None if words.method == Method::Signals => {
                let reason = "--method signals needs noise and a Gaussian pulse without chirp in the scene".into();
                Err(Error::Input { path: path.to_owned(), reason })
            }
            _ => Ok(found),
        }
    };
    scans.iter().enumerate().map(of_scan).collect()
}

/// Times of all scans from the date of the first one, where all have a date.
fn same_origin(scans: &mut [RetrievedScan]) {
    let Some(first) = scans.first().and_then(|scan| scan.scan.reference) else { return };
    if scans.iter().any(|scan| scan.scan.reference.is_none()) {
        return;
    }
    for scan in scans {
        let Some(reference) = scan.scan.reference.replace(first) else { continue };
        let later_s = reference.seconds_since(first);
        scan.scan.map.time_s.iter_mut().for_each(|time_s| *time_s += later_s);
        scan.result.reference_time_s += later_s;
        scan.result.vortices.iter_mut().for_each(|vortex| vortex.time_s += later_s);
    }
}

/// Names of the files.
fn names(scans: usize) -> Vec<String> {
    let mut out = vec!["retrieval.csv".to_owned(), "retrieval.json".to_owned()];
    if cfg!(feature = "plots") {
        out.extend((1..=scans).flat_map(|number| ["svg", "png"].map(|kind| format!("scan_{number:03}.{kind}"))));
    }
    out
}

fn files(
    words: &RetrieveWords,
    scene: Option<&SceneFile>,
    found: &[RetrievedScan],
    existing: Existing,
) -> Result<Vec<PathBuf>, Error> {
    let origin = Provenance {
        program: crate::PROGRAM.into(),
        scene_toml: scene.map(|scene| scene.toml.clone()).unwrap_or_default(),
        scene_hash: scene.map(|scene| scene.hash.clone()).unwrap_or_default(),
        seed: scene.map_or(0, |scene| scene.scene.seed),
    };
    let mut files = FileGroup::new(&words.out);
    files.add("retrieval.csv", retrieve::rows(found).to_csv(&origin)?)?;
    let text = format!("{{\"source\": \"{}\", \"scans\": {:#}}}\n", crate::PROGRAM, retrieve::json(found));
    files.add("retrieval.json", text)?;
    #[cfg(feature = "plots")]
    for (number, scan) in found.iter().enumerate() {
        let figure = retrieve::figure(scan, number + 1)?;
        files.add(&format!("scan_{:03}.svg", number + 1), figure.svg(&origin)?)?;
        files.add(&format!("scan_{:03}.png", number + 1), figure.png(&origin)?)?;
    }
    write::put(files, &words.out, existing)
}

/// A line for each vortex.
fn text(found: &[RetrievedScan]) -> String {
    let mut out = String::new();
    for (number, scan) in found.iter().enumerate() {
        let flags: Vec<&str> = scan.result.flags.iter().map(|flag| flag.name()).collect();
        let flags = if flags.is_empty() { String::new() } else { format!("  [{}]", flags.join(" ")) };
        if scan.result.has(Flag::NoWake) || scan.result.vortices.is_empty() {
            let (statistic, threshold) = (scan.result.statistic, scan.result.threshold);
            out += &format!("scan {}: no wake, statistic {statistic:.1} below {threshold:.1}{flags}\n", number + 1);
        }
        for vortex in &scan.result.vortices {
            let (mean, y_m, z_m) = (vortex.circulation_5_15_m2_s, vortex.lateral_position_m, vortex.height_m);
            out += &format!(
                "scan {}: {:<5} Gamma(5-15 m) {:.1} +- {:.1} m^2/s at y {:.2} +- {:.2} m, z {:.2} +- {:.2} m{flags}\n",
                number + 1,
                if vortex.side == wakescope_estimate::retrieval::Side::Left { "left" } else { "right" },
                mean.value,
                mean.std,
                y_m.value,
                y_m.std,
                z_m.value,
                z_m.std,
            );
        }
    }
    out
}
