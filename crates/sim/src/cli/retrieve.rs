//! `wakescope retrieve`: vortices from scans, maps of any instrument or signals of a scene.

use super::{Cli, load, paths, progress, say};
use crate::Error;
use crate::io::raw::{RawFormat, RawRecords};
use crate::io::scans::{self, ReadScan, ScanFormat};
use crate::io::{Existing, FileGroup};
use crate::measure::recorded::{self, MeasuredScan, NoiseLevel, Recorded, RecordedOptions, Spectra, record_shape};
use crate::plan::{Plan, Stage};
use crate::retrieve::{self, Method, OwnScene, RetrievedScan, StatedEstimator, Velocities, gate_of};
use crate::scene::{Flow, SceneFile, VortexProfile};
use crate::setup::progress::{Observer, Silent};
use crate::write;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};
use wakescope_estimate::retrieval::{
    Covariance, EnvelopeResult, Flag, Gate, Movement, RetrievalOptions, Track, Turbulence,
};
use wakescope_estimate::vortex_fit::{CorePrior, CoreProfile, Loss, Sharing, Wake, WakeModel};

/// Words of `wakescope retrieve`.
#[derive(Debug, Args)]
pub(super) struct RetrieveWords {
    /// Maps of scans: CfRadial 1.4 (classic NetCDF), HALO .hpl, CSV; or raw signals, signals.nc, NPY or NPZ, with --scene.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// The scene of the instrument and its estimator; a map of this program has its own in it.
    #[arg(long, value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// How velocities were estimated, without a scene: a method of scenes such as periodogram or first_moment, or means over the gates.
    #[arg(long, value_name = "METHOD", conflicts_with = "scene")]
    estimator: Option<String>,
    /// Full width of the pulse at half its maximum, s, e.g. 200e-9; of the file without it.
    #[arg(long, value_name = "S", value_parser = positive, conflicts_with = "scene")]
    pulse: Option<f64>,
    /// Length of the estimator's window, s, e.g. 256e-9; of the gates without it.
    #[arg(long, value_name = "S", value_parser = positive, requires = "estimator")]
    window: Option<f64>,
    /// Weighting of that window, as in scenes; rectangular without it.
    #[arg(long, value_name = "WORD", requires = "estimator")]
    weighting: Option<String>,
    /// How circulations are found.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// Folder to write to; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Whether image vortices make the ground a streamline.
    #[arg(long, value_enum, default_value_t = YesNo::Yes)]
    ground: YesNo,
    /// Standard deviation of the weight of a gate along the line, m, for velocities that are taken for means; 0 for those at points.
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
    /// What raw samples are multiplied with, such as ampere per count; the noise is then that of the scene.
    #[arg(long, value_name = "A", value_parser = positive)]
    scale: Option<f64>,
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
pub(super) enum YesNo {
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

/// Few lines cross a core, and the likelihood of their speckle is no parabola.
const HEIGHTS: &str = "fits of signals state the deviations of heights a quarter too small\n";
/// Standard deviation of the weight of gates that do not show cores, m.
const LONG_GATE_M: f64 = 3.0;

pub(super) fn not_negative(word: &str) -> Result<f64, String> {
    let value = word.trim().parse::<f64>().ok().filter(|v| *v >= 0.0 && v.is_finite());
    value.ok_or_else(|| "a number from 0 on, e.g. 14.4".into())
}

pub(super) fn positive(word: &str) -> Result<f64, String> {
    let value = word.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
    value.ok_or_else(|| "a number above 0, e.g. 2.35".into())
}

pub(super) fn turbulence(word: &str) -> Result<Turbulence, String> {
    let both = word.split_once(',').and_then(|(a, b)| Some((positive(a).ok()?, positive(b).ok()?)));
    let (deviation_m_s, length_m) = both.ok_or("two numbers above 0, m/s and m, with a comma between, e.g. 1.2,25")?;
    Ok(Turbulence { deviation_m_s, length_m })
}

impl RetrieveWords {
    fn options(&self, scene: Option<&SceneFile>, gate: Gate) -> RetrievalOptions {
        let of_scene = scene.map(|file| &file.scene);
        let profile = match (self.profile, of_scene.map(|scene| &scene.flow)) {
            (Some(Profile::LambOseen), _) => CoreProfile::LambOseen,
            (None, Some(Flow::VortexPair(pair))) if pair.profile == VortexProfile::LambOseen => CoreProfile::LambOseen,
            _ => CoreProfile::Algebraic,
        };
        let of_pair = of_scene.is_some_and(|scene| matches!(scene.flow, Flow::VortexPair(_)));
        let height_m = self.lidar_height.or(of_scene.map(|scene| scene.scan.lidar_height_m));
        // Long gates do not show cores: without what is known of them they run away with the circulation.
        let is_long = match &gate {
            Gate::Point => false,
            Gate::Gaussian { std_m } => *std_m > LONG_GATE_M,
            Gate::Kernel(_) => true,
        };
        let mut options = RetrievalOptions {
            core_prior: is_long.then_some(CorePrior::TYPICAL),
            other_profile: self.profile.is_none() && !of_pair,
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
    Signals(Box<Signals>),
}

pub(super) struct Signals {
    path: PathBuf,
    records: RawRecords,
    plan: Plan,
    scans: Vec<MeasuredScan>,
    spectra: Option<Spectra>,
}

impl Signals {
    /// The maps of their scans.
    pub(super) fn maps(&self) -> impl Iterator<Item = ReadScan> + '_ {
        let map = |(sweep, scan)| retrieve::scan_of_signals(&self.path, sweep, &self.plan, scan);
        self.scans.iter().enumerate().map(map)
    }
}

/// What was found in all scans.
#[derive(Default)]
struct Found {
    scans: Vec<RetrievedScan>,
    /// The scene of each scan, where one is known.
    scenes: Vec<Option<SceneFile>>,
    /// Circulations by envelopes, with the number of their scan.
    envelopes: Vec<(usize, EnvelopeResult)>,
}

pub(super) fn retrieve(words: &RetrieveWords, cli: &Cli) -> Result<(), Error> {
    let stated = words.scene.as_deref().map(|path| load(path, cli)).transpose()?;
    let format = ScanFormat { field: words.field.clone(), towards: words.towards, min_snr_db: words.min_snr };
    let mut told = progress_of(cli);
    let mut inputs = Vec::new();
    for path in &words.data {
        if is_signals(path) {
            let spectra = words.method == Method::Envelope;
            inputs.push(Input::Signals(Box::new(signals(path, stated.clone(), words.scale, spectra)?)));
            continue;
        }
        if matches!(words.method, Method::Signals | Method::Envelope) {
            let reason = "it is no file of raw signals, which this method needs: --method fit takes maps".into();
            return Err(Error::Input { path: path.clone(), reason });
        }
        let (found, left_out) = scans::read(path, &format)?;
        found.iter().try_for_each(|scan| words.scene_of(scan, stated.as_ref()).map(|_| ()))?;
        left_out.iter().for_each(|text| told.warn(&format!("{}: {text}: left out", path.display())));
        inputs.extend(found.into_iter().map(|scan| Input::Map(Box::new(scan))));
    }
    let scans_of = |input: &Input| if let Input::Signals(signals) = input { signals.scans.len() } else { 1 };
    let count: usize = inputs.iter().map(scans_of).sum();
    let existing = if words.overwrite { Existing::Any } else { Existing::Own };
    write::prepare(&words.out, names(count).iter().map(String::as_str), existing)?;
    let mut found = Found::default();
    told.begin(Stage::Retrieval, count as u64);
    for input in inputs {
        match input {
            Input::Map(scan) => {
                let start = prediction(&found.scans, &scan);
                let scene = words.scene_of(&scan, stated.as_ref())?;
                found.scans.push(of_map(words, scene.as_ref(), *scan, start, told.as_mut())?);
                found.scenes.push(scene);
                told.advance(1);
            }
            Input::Signals(signals) => of_signals(words, *signals, &mut found, told.as_ref())?,
        }
    }
    told.end();
    same_origin(&mut found.scans);
    let track = retrieve::track_of(&found.scans)?;
    let files = files(words, &found, track.as_ref(), existing)?;
    let object = json!({ "version": crate::VERSION, "scans": retrieve::json(&found.scans), "files": paths(&files) });
    let is_of_signals =
        words.method == Method::Signals && found.scans.iter().any(|scan| !scan.result.vortices.is_empty());
    let note = if is_of_signals { HEIGHTS } else { "" };
    say(
        cli.json,
        &object,
        &format!("{}{note}wrote {} files to {}", text(&found.scans), files.len(), words.out.display()),
    )
}

/// Where the track of the scans so far says that the wake is, to start from beside the blind search.
fn prediction(before: &[RetrievedScan], scan: &ReadScan) -> Option<Wake> {
    let last = before.last()?;
    let times = scan.map.time_s.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
    let (reference, of_last) = (scan.reference.zip(last.scan.reference), 0.5 * (times.0 + times.1));
    let time_s = of_last + reference.map_or(0.0, |(own, of_last)| own.seconds_since(of_last));
    let core_m = last.result.wake.map_or(2.0, |wake| wake.left.core_radius_m);
    retrieve::track_of(before).ok().flatten()?.prediction(time_s, core_m)
}

fn progress_of(cli: &Cli) -> Box<dyn Observer> {
    if cli.quiet { Box::new(progress::Quiet) } else { Box::new(progress::Bars::new()) }
}

/// Whether a file holds raw signals and no map.
pub(super) fn is_signals(path: &Path) -> bool {
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
pub(super) fn signals(
    path: &Path,
    scene: Option<SceneFile>,
    scale: Option<f64>,
    spectra: bool,
) -> Result<Signals, Error> {
    let Some(scene) = scene else {
        let reason = "it holds raw signals: --scene says which instrument recorded them".into();
        return Err(Error::Input { path: path.to_owned(), reason });
    };
    let mut records = RawRecords::open(
        path,
        &RawFormat { scale: scale.unwrap_or(1.0), ..RawFormat::default() },
        record_shape(&scene.scene),
    )?;
    let (plan, is_own) = recorded::plan(scene, &records)?;
    let noise = if is_own || scale.is_some() { NoiseLevel::OfScene } else { NoiseLevel::Quietest };
    // What is known of the air is not looked at: this is a retrieval.
    let options = RecordedOptions { noise: Some(noise), spectra, ..RecordedOptions::default() };
    let (scans, spectra) = match recorded::estimate((&plan, false), &mut records, &options, &Silent)? {
        Recorded::Measured { scans, spectra } => (scans, spectra),
        Recorded::OfRun { .. } => (Vec::new(), None),
    };
    Ok(Signals { path: path.to_owned(), records, plan, scans, spectra })
}

impl RetrieveWords {
    /// The scene of a map: as stated, else its own.
    fn scene_of(&self, scan: &ReadScan, stated: Option<&SceneFile>) -> Result<Option<SceneFile>, Error> {
        match stated {
            Some(scene) => Ok(Some(scene.clone())),
            None => retrieve::scene_of(scan),
        }
    }

    fn estimator(&self) -> StatedEstimator {
        let Self { estimator, pulse, window, weighting, .. } = self;
        StatedEstimator { method: estimator.clone(), pulse_s: *pulse, window_s: *window, weighting: weighting.clone() }
    }
}

/// The word for velocities that are means over the gates.
const MEANS: &str = "means";
const UNKNOWN: &str = "velocities are taken for means over the gates: those of spectral peaks give circulations that are a quarter to a half too \
                       small; --estimator with --pulse and --window says how they were estimated, --estimator means that they are means, or \
                       --scene everything";

fn of_map(
    words: &RetrieveWords,
    scene: Option<&SceneFile>,
    scan: ReadScan,
    start: Option<Wake>,
    told: &mut dyn Observer,
) -> Result<RetrievedScan, Error> {
    let stated = words.estimator();
    let are_means = stated.method.as_deref() == Some(MEANS) || words.gate_std == Some(0.0);
    // What is stated goes before what the file says.
    let (instrument, is_likely) = match (words.gate_std, &stated.method, scene) {
        _ if are_means => (None, false),
        (None, None, Some(scene)) => (Some(scene.clone()), false),
        (None, Some(_), _) => (Some(retrieve::stated_scene(&scan, &stated)?), false),
        (None, None, None) if scan.is_own => (Some(retrieve::stated_scene(&scan, &stated)?), true),
        _ => (None, false),
    };
    let of_gate = instrument.as_ref().or(scene).map(|file| &file.scene);
    let (gate, remark) = gate_of(Some(&scan), words.gate_std, of_gate)?;
    let own = instrument.as_ref().map(|scene| OwnScene::new(scene, &Silent)).transpose()?.flatten();
    let velocities = match &own {
        Some(own) if is_likely => Velocities::LikelyShown(own),
        Some(own) => Velocities::Shown(own),
        None if are_means => Velocities::Means,
        None => Velocities::Unknown,
    };
    let options = RetrievalOptions { start, ..words.options(scene, gate) };
    let found = retrieve::retrieve_map(scan, words.method, options, velocities)?;
    let lost = "it is a map of this program that has lost its scene, as some programs drop it: the estimator is taken for the default one, and \
                the deviations hold what means would differ by; --scene gives the circulations of the original";
    let taken = found.result.has(Flag::TakenForMeans);
    for remark in [remark, taken.then_some(if is_likely { lost } else { UNKNOWN })].into_iter().flatten() {
        told.warn(&format!("{}: {remark}", found.scan.path.display()));
    }
    Ok(found)
}

fn of_signals(words: &RetrieveWords, signals: Signals, found: &mut Found, told: &dyn Observer) -> Result<(), Error> {
    let Signals { path, mut records, plan, scans, spectra } = signals;
    let own = OwnScene::new(&plan.scene, &Silent)?;
    let velocities = own.as_ref().map_or(Velocities::Unknown, Velocities::Shown);
    let mut first_line = 0;
    for (sweep, measured) in scans.iter().enumerate() {
        let scan = retrieve::scan_of_signals(&path, sweep, &plan, measured);
        let (gate, _) = gate_of(Some(&scan), words.gate_std, Some(&plan.scene.scene))?;
        let mut one = retrieve::retrieve_map(scan, words.method, words.options(Some(&plan.scene), gate), velocities)?;
        let lines = first_line..first_line + measured.lines.elevation_rad.len();
        first_line = lines.end;
        match (&own, words.method) {
            (Some(own), Method::Signals) => one = retrieve::retrieve_signals(own, &mut records, measured, one)?,
            (Some(own), Method::Envelope) => {
                if let (Some(spectra), Some(wake)) = (&spectra, one.result.wake) {
                    let snr = own.snr_of(&wake);
                    let results = retrieve::envelopes(&plan, spectra, lines, snr, &mut one)?;
                    found.envelopes.extend(results.into_iter().map(|result| (found.scans.len() + 1, result)));
                }
            }
            (None, Method::Signals | Method::Envelope) => {
                let reason = "this method needs noise and a Gaussian pulse without chirp in the scene".into();
                return Err(Error::Input { path, reason });
            }
            _ => {}
        }
        found.scans.push(one);
        found.scenes.push(Some(plan.scene.clone()));
        told.advance(1);
    }
    Ok(())
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
    let tables =
        ["retrieval.csv", "retrieval.json", "envelopes.csv", "profiles.csv", "track.csv", "track.svg", "track.png"];
    let mut out = tables.map(str::to_owned).to_vec();
    if cfg!(feature = "plots") {
        out.extend((1..=scans).flat_map(|number| ["svg", "png"].map(|kind| format!("scan_{number:03}.{kind}"))));
    }
    out
}

fn files(
    words: &RetrieveWords,
    Found { scans, scenes, envelopes }: &Found,
    track: Option<&Track>,
    existing: Existing,
) -> Result<Vec<PathBuf>, Error> {
    // Scans of several scenes have none in common.
    let scene = scenes
        .first()
        .and_then(Option::as_ref)
        .filter(|first| scenes.iter().all(|scene| scene.as_ref().is_some_and(|scene| scene.hash == first.hash)));
    let origin = write::provenance_of(scene);
    let mut files = FileGroup::new(&words.out);
    files.add("retrieval.csv", retrieve::rows(scans).to_csv(&origin)?)?;
    files.add(
        "retrieval.json",
        format!(
            "{{\"source\": \"{}\", \"scene_hash\": \"{}\", \"scans\": {}}}\n",
            origin.program,
            origin.scene_hash,
            retrieve::json(scans)
        ),
    )?;
    if words.method == Method::Envelope {
        files.add("envelopes.csv", retrieve::envelope_table(envelopes).to_csv(&origin)?)?;
    }
    if words.method == Method::Integral {
        files.add("profiles.csv", retrieve::profile_table(scans)?.to_csv(&origin)?)?;
    }
    if let Some(track) = track {
        files.add("track.csv", retrieve::track_table(track).to_csv(&origin)?)?;
    }
    #[cfg(feature = "plots")]
    {
        for (number, scan) in scans.iter().enumerate() {
            let name = format!("scan_{:03}", number + 1);
            retrieve::figure(scan, number + 1)?.add_to(&mut files, &name, &origin)?;
        }
        if let Some(track) = track {
            retrieve::track_figure(track, scans).add_to(&mut files, "track", &origin)?;
        }
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
            let why = if statistic < threshold { "below" } else { "above" };
            let certain = if statistic < threshold { "" } else { ", but no circulation is certain" };
            out += &format!(
                "scan {}: no wake, statistic {statistic:.1} {why} {threshold:.1}{certain}{flags}\n",
                number + 1
            );
        }
        for vortex in &scan.result.vortices {
            let (mean, y_m, z_m) = (vortex.circulation_5_15_m2_s, vortex.lateral_position_m, vortex.height_m);
            let circulation = match (mean.value.is_finite(), mean.std.is_finite()) {
                (false, _) => "unknown: no line of it has an envelope that ends in the band".into(),
                (true, false) => format!("{:.1} m^2/s, its error unknown,", mean.value),
                (true, true) => format!("{:.1} +- {:.1} m^2/s", mean.value, mean.std),
            };
            out += &format!(
                "scan {}: {:<5} Gamma(5-15 m) {circulation} at y {:.2} +- {:.2} m, z {:.2} +- {:.2} m{flags}\n",
                number + 1,
                if vortex.side == wakescope_estimate::retrieval::Side::Left { "left" } else { "right" },
                y_m.value,
                y_m.std,
                z_m.value,
                z_m.std,
            );
        }
    }
    out
}
