//! `wakescope retrieve`: vortices from scans, maps of any instrument or signals of a scene.

use super::Cli;
use super::args::{
    AirArgs, FolderArgs, ScanArgs, Scans, Signals, is_signals, not_negative, positive, refuse_idle,
};
use super::data_files::{each_usable, is_of_the_file};
use super::data_sets::{self, SplitArgs, data_set_of};
use super::options::{
    BESIDE_GATE_STD, BESIDE_OWN_SCENE, BY_RADIAL_VELOCITIES, ESTIMATOR_BESIDE_GATE_STD, OF_MEANS,
    ON_DATA_SET, WITHOUT_DATA_SET, WITHOUT_SCENE, refusal_of_idle,
};
use crate::detection::scan_turbulence::{overlap_warning, turbulence_text};
use crate::io::Provenance;
use crate::io::scans::{ReadScan, are_of_one_plane, face_alike, plane_numbers, share_origin};
use crate::outputs::Outputs;
use crate::plan::Stage;
use crate::progress::{Observer, Silent};
use crate::quantities::measured;
use crate::retrieve::{self, Method, PlaneTrack, RetrievedScan, SceneResponse, gate_of};
use crate::scene::{Estimator, SceneFile};
use crate::score::PredictedScan;
use crate::{Error, SPEED_OF_LIGHT_M_S};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use wakescope_estimate::retrieval::{
    EnvelopeResult, Flag, Gate, Movement, RetrievalOptions, Turbulence, Velocities,
};
use wakescope_estimate::vortex_fit::{CoreProfile, Secondary, Wake};

/// Arguments of `wakescope retrieve`.
#[derive(Debug, Args)]
pub(super) struct RetrieveArgs {
    /// Scans (CfRadial, HALO, WindCube, CSV), signals with --scene, data set.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// Scene of the instrument and estimator; maps of this program contain theirs.
    #[arg(long, value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// Velocity estimator without a scene, e.g. periodogram; gate means by default.
    #[arg(long, value_name = "METHOD", conflicts_with = "scene")]
    estimator: Option<String>,
    /// Full pulse width at half maximum in s; by default the file's.
    #[arg(long, value_name = "S", value_parser = positive, conflicts_with = "scene")]
    pulse: Option<f64>,
    /// Estimator window length in s; by default the gate length.
    #[arg(long, value_name = "S", value_parser = positive, requires = "estimator", conflicts_with = "scene")]
    window: Option<f64>,
    /// Weighting of that window; rectangular by default.
    #[arg(
        long,
        value_name = "WORD",
        requires = "estimator",
        conflicts_with = "scene"
    )]
    weighting: Option<String>,
    /// Retrieval method.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    #[command(flatten)]
    air: AirArgs,
    /// Vortex profile; by default the scene's, or algebraic.
    #[arg(long, value_enum)]
    profile: Option<CoreProfile>,
    /// Fixed core radius in m; fitted by default.
    #[arg(long, value_name = "M", value_parser = positive)]
    core: Option<f64>,
    /// Fit secondary vortices; by default the scene's, or auto.
    #[arg(long, value_enum)]
    secondary: Option<Secondary>,
    /// Vortex motion during a scan: whichever fits better, yes, or no.
    #[arg(long, value_enum, default_value_t = Movement::Auto)]
    motion: Movement,
    /// Minimum chi-square drop from a wind-only fit; 22, known estimator 35.
    #[arg(long, value_name = "T", value_parser = not_negative)]
    threshold: Option<f64>,
    /// Lidar height above ground in m; by default the scene's, or 0.
    #[arg(long, value_name = "M", value_parser = not_negative)]
    lidar_height: Option<f64>,
    #[command(flatten)]
    splits: SplitArgs,
    #[command(flatten)]
    scans: ScanArgs,
    #[command(flatten)]
    folder: FolderArgs,
}

/// Why turbulence of a given length is not in fits of estimates.
const INDEPENDENT: &str = "what the estimator shows of a wake is fitted with independent errors or, with --turbulence auto, in the turbulence of the \
                           scan";
/// Why turbulence is not in fits of signals.
const STILL: &str = "the likelihood of signals is that of still air: leave out --method signals";

/// Sampling of an instrument of which it is not known, Hz.
const WIDE_HZ: f64 = 500e6;

/// Few lines cross a core, and the likelihood of their speckle is no parabola.
const HEIGHTS: &str = "fits of signals state the deviations of heights a quarter too small\n";

impl RetrieveArgs {
    /// Refuses options that have no effect on the files or beside other options.
    fn refuse_idle(&self, cli: &Cli) -> Result<(), Error> {
        refuse_idle(&self.data, cli)?;
        if self.scene.is_none() {
            cli.refuse_idle("retrieve", WITHOUT_SCENE)?;
        }
        if self.method == Method::Rv {
            cli.refuse_idle("--method rv", BY_RADIAL_VELOCITIES)?;
        }
        let are_means = self.estimator.as_deref() == Some(MEANS);
        if are_means {
            cli.refuse_idle("--estimator means", OF_MEANS)?;
        }
        if let Some(std_m) = self.air.gate_std {
            cli.refuse_idle("--gate-std", BESIDE_GATE_STD)?;
            if !are_means || std_m == 0.0 {
                cli.refuse_idle("--gate-std", ESTIMATOR_BESIDE_GATE_STD)?;
            }
        }
        Ok(())
    }

    /// Refuses options that have no effect on a scan with velocities of a kind.
    fn refuse_idle_on(&self, scan: &ReadScan, velocities: Velocities<'_>) -> Result<(), Error> {
        let has_turbulence = self.air.turbulence.is_some();
        let is_of_scan = self.air.turbulence == Some(Turbulence::OfScan);
        let (name, reason) = match velocities {
            _ if self.motion != Movement::Auto && !scan.map.has_times() => {
                ("motion", "its lines have no times")
            }
            _ if self.method == Method::Signals && has_turbulence => ("turbulence", STILL),
            Velocities::Estimates(_) if has_turbulence && !is_of_scan => {
                ("turbulence", INDEPENDENT)
            }
            _ if has_turbulence && self.secondary.is_some() => (
                "secondary",
                "of velocities that share turbulence a pair alone is fitted: leave out --turbulence",
            ),
            _ => return Ok(()),
        };
        Err(refusal_of_idle(&scan.path, name, reason))
    }

    fn options(&self, scene: Option<&SceneFile>, gate: Gate) -> RetrievalOptions {
        let mut options = retrieve::options(scene.map(|file| &file.content), gate, self.core);
        if let Some(profile) = self.profile {
            (options.model.profile, options.other_profile) = (profile, false);
        }
        options.model.images = self.air.images;
        options.model.lidar_height_m = self.lidar_height.unwrap_or(options.model.lidar_height_m);
        options.secondary = self.secondary.unwrap_or(options.secondary);
        RetrievalOptions {
            turbulence: self.air.turbulence,
            movement: self.motion,
            threshold: self.threshold.unwrap_or(options.threshold),
            threshold_of_estimates: self.threshold.unwrap_or(options.threshold_of_estimates),
            ..options
        }
    }

    /// A scene with what is stated, else with what the file says, else with the defaults, at a signal-to-noise ratio of 10 dB in
    /// 50 MHz, which is 4 dB in the wide band of stated estimators. Periodograms show the same velocities at any ratio; the likelihood
    /// and pulse pairs do not.
    fn stated_scene(&self, scan: &ReadScan) -> Result<SceneFile, Error> {
        let snr_db = match self.estimator {
            Some(_) => 4.0,
            None => 10.0,
        };
        let mut keys = vec![
            ("detector.snr.reference", "\"fixed\"".to_owned()),
            ("detector.snr.snr_db", format!("{snr_db:?}")),
        ];
        if let Some(width_s) = scan.pulse_width_s {
            keys.push(("pulse.shape.duration_s", format!("{width_s:?}")));
        }
        if let Some(method) = &self.estimator {
            keys.push(("estimator.method.kind", format!("{method:?}")));
            let gate_length_m = scan.gate_length_m;
            let gate_s = gate_length_m.map(|length_m| 2.0 * length_m / SPEED_OF_LIGHT_M_S);
            if let Some(window_s) = self.window.or(gate_s) {
                let samples = (window_s * WIDE_HZ).round().max(1.0) as u64;
                keys.push(("estimator.window_samples", samples.to_string()));
            }
            // Gates of one line each, and a band that is wide enough for all instruments.
            for (key, stated, default) in [
                (
                    Estimator::WEIGHTING,
                    self.weighting.as_deref(),
                    "\"rectangular\"",
                ),
                (Estimator::RADIUS, None, "0.0"),
                (Estimator::PADDED_SAMPLES, None, "4096"),
            ] {
                match stated {
                    Some(word) => keys.push((key, format!("{word:?}"))),
                    None if used_by(method, key)? => keys.push((key, default.to_owned())),
                    None => {}
                }
            }
            for (key, value_hz) in [
                ("detector.sampling_hz", WIDE_HZ),
                ("detector.intermediate_frequency_hz", 0.25 * WIDE_HZ),
                ("detector.bandwidth_hz", 0.4 * WIDE_HZ),
            ] {
                keys.push((key, format!("{value_hz:?}")));
            }
        }
        let mut text = String::new();
        for (key, value) in keys {
            text += &format!("{key} = {value}\n");
        }
        SceneFile::parse(&text, Path::new(STATED))
    }
}

/// Source of the keys of a scene that options give, for messages.
const STATED: &str = "what --estimator, --pulse, --window and --weighting state";

/// Whether the estimator of that name uses a key.
///
/// # Errors
/// Fails if there is no estimator of that name.
fn used_by(method: &str, key: &str) -> Result<bool, Error> {
    let text = format!("estimator.method.kind = {method:?}");
    let scene = SceneFile::without_limits(&text, Path::new(STATED))?;
    Ok(scene.estimator.method.behaviour().uses(key))
}

/// What was found in all scans.
#[derive(Default)]
struct Found {
    scans: Vec<RetrievedScan>,
    /// Circulations by envelopes, with the number of their scan.
    envelopes: Vec<(usize, EnvelopeResult)>,
    tracks: Vec<PlaneTrack>,
}

pub(super) fn retrieve(args: &RetrieveArgs, cli: &Cli) -> Result<(), Error> {
    args.refuse_idle(cli)?;
    if let Some(folder) = data_set_of(&args.data)? {
        return of_data_set(args, folder, cli);
    }
    cli.refuse_idle("retrieve", WITHOUT_DATA_SET)?;
    let stated = args
        .scene
        .as_deref()
        .map(|path| cli.scene(path))
        .transpose()?;
    let observer = cli.observer();
    let mut inputs = each_usable(&args.data, &*observer, |path| {
        read_input(args, path, stated.as_ref(), &*observer)
    })?;
    for input in &inputs {
        refuse_beside_own_scene(input, args, cli)?;
    }
    let mut scans: Vec<&mut ReadScan> = Vec::new();
    for (input, _) in &mut inputs {
        scans.extend(&mut input.maps);
    }
    face_alike(&mut scans);
    for path in share_origin(&mut scans) {
        observer.warn(&format!(
            "{}: its times count from no date, those of other files do: its scans have no times and are in no track",
            path.display()
        ));
    }
    let planes = plane_numbers(scans.iter().map(|scan| &**scan));
    args.folder
        .prepare(cli, |files| list(args.method, &planes, None, files))?;
    let scenes: Vec<_> = inputs.iter().map(|(_, scene)| scene.clone()).collect();
    observer.begin(Stage::Retrieval, planes.len() as u64);
    let mut found = of_inputs(args, inputs, planes.len(), &*observer)?;
    observer.end();
    found.tracks = retrieve::tracks_of(&found.scans, &*observer)?;
    let is_of_signals = args.method == Method::Signals
        && found
            .scans
            .iter()
            .any(|scan| !scan.result.vortices.is_empty());
    let text = text(&found.scans) + if is_of_signals { HEIGHTS } else { "" };
    let of = (Default::default(), provenance(&scenes));
    let object = json!({ "scans": retrieve::json(&found.scans) });
    args.folder.finish(
        cli,
        of,
        |files| list(args.method, &planes, Some(&found), files),
        (object, text),
    )
}

/// Predictions for the scans of a data set.
fn of_data_set(args: &RetrieveArgs, folder: &Path, cli: &Cli) -> Result<(), Error> {
    cli.refuse_idle(folder, ON_DATA_SET)?;
    if matches!(args.method, Method::Signals | Method::Envelope) {
        return Err(Error::input(folder, NO_SIGNALS));
    }
    args.folder
        .prepare(cli, |files| data_sets::list("retrieval", None, files))?;
    let observer = cli.observer();
    let splits = args.splits.splits();
    let (found, origin) = data_sets::predict(
        folder,
        &splits,
        &args.scans.velocities,
        (Stage::Retrieval, &*observer),
        |flight, scene, scans| of_flight(args, (flight, scene), scans, &*observer),
    )?;
    let of = (Default::default(), origin);
    let list = |files: &mut Outputs| data_sets::list("retrieval", Some(&found), files);
    args.folder.finish(cli, of, list, data_sets::report(&found))
}

/// The vortices of the scans of a flight, each begun where those before it say that they are. In a scan that cannot be fitted there
/// are none.
fn of_flight(
    args: &RetrieveArgs,
    (flight, scene): (usize, &SceneFile),
    scans: Vec<ReadScan>,
    observer: &dyn Observer,
) -> Result<Vec<PredictedScan>, Error> {
    let own = SceneResponse::of_scene(scene, &Silent)?;
    let velocities = own
        .as_ref()
        .map_or(Velocities::Unknown, |own| Velocities::Estimates(own));
    let (gate, _) = gate_of(None, None, Some(&scene.content))?;
    let mut before = Vec::new();
    let mut predicted = Vec::with_capacity(scans.len());
    for scan in scans {
        args.refuse_idle_on(&scan, velocities)?;
        let options = RetrievalOptions {
            start: prediction(&before, &scan),
            ..args.options(Some(scene), gate.clone())
        };
        match retrieve::retrieve_map(scan, args.method, options, velocities) {
            Ok((found, _)) => {
                predicted.push(PredictedScan::from_retrieval(&found.result));
                before.push(found);
            }
            Err(error) if is_of_the_file(&error) => {
                observer.warn(&data_sets::without_wake(flight, predicted.len(), &error));
                predicted.push(PredictedScan::default());
            }
            Err(error) => return Err(error),
        }
    }
    Ok(predicted)
}

/// Fits the scans of all files, `count` in number; of several those that cannot be fitted are skipped with a warning.
fn of_inputs(
    args: &RetrieveArgs,
    inputs: Vec<Input>,
    count: usize,
    observer: &dyn Observer,
) -> Result<Found, Error> {
    let mut found = Found::default();
    let mut refused = None;
    for (scans, scene) in inputs {
        if let Some(signals) = scans.signals {
            of_signals(args, scans.maps, signals, &mut found, observer)?;
            continue;
        }
        for scan in scans.maps {
            let start = prediction(&found.scans, &scan);
            match of_map(args, scene.as_ref(), scan, start, observer) {
                Ok(one) => {
                    let mut before = found.scans.iter();
                    if before.all(|scan| !scan.result.has(Flag::OneVortex)) {
                        warn_of_sign(args, scene.as_ref(), &one, observer);
                    }
                    found.scans.push(one);
                }
                Err(error) if count > 1 && is_of_the_file(&error) => {
                    observer.warn(&format!("{error}: skipped"));
                    refused = refused.or(Some(error));
                }
                Err(error) => return Err(error),
            }
            observer.advance(1);
        }
    }
    match refused.filter(|_| found.scans.is_empty()) {
        Some(error) => Err(error),
        None => Ok(found),
    }
}

/// What is said of maps where a method needs signals.
const NO_SIGNALS: &str =
    "it is not a file of raw signals, which this method needs: --method fit takes maps";

/// A file, and the scene of its scans where one is known.
type Input = (Scans, Option<SceneFile>);

/// Refuses options in whose place the scene of the file is taken.
fn refuse_beside_own_scene(
    (scans, scene): &Input,
    args: &RetrieveArgs,
    cli: &Cli,
) -> Result<(), Error> {
    let states_estimator = args.estimator.as_deref().is_some_and(|name| name != MEANS);
    match scans.maps.first() {
        Some(scan) if scene.is_some() && !states_estimator => {
            cli.refuse_idle(&scan.path, BESIDE_OWN_SCENE)
        }
        _ => Ok(()),
    }
}

fn read_input(
    args: &RetrieveArgs,
    path: &Path,
    stated: Option<&SceneFile>,
    observer: &dyn Observer,
) -> Result<Input, Error> {
    if matches!(args.method, Method::Signals | Method::Envelope) && !is_signals(path) {
        return Err(Error::input(path, NO_SIGNALS));
    }
    let keeps_spectra = args.method == Method::Envelope;
    let scans = args.scans.read(path, stated, keeps_spectra, observer)?;
    let known = scans.signals.as_ref().map(|signals| &signals.plan.file);
    let scene = match (known.or(stated), scans.maps.first()) {
        (Some(scene), _) => Some(scene.clone()),
        (None, Some(scan)) => retrieve::scene_of(scan, observer)?,
        (None, None) => None,
    };
    for text in &scans.left_out {
        observer.warn(&format!("{}: {text}", path.display()));
    }
    Ok((scans, scene))
}

/// Time after which a wake has left or decayed, and nothing is concluded from it \[s\].
const REMEMBERED_S: f64 = 600.0;

/// Where the track of the latest scans of its plane says that the wake of a scan is, to start from beside the blind search.
fn prediction(before: &[RetrievedScan], scan: &ReadScan) -> Option<Wake> {
    let time_s = Some(scan.map.middle_s()).filter(|time_s| time_s.is_finite())?;
    let mut same_plane = Vec::new();
    for one in before {
        let is_old = (time_s - one.scan.map.middle_s()).abs() > REMEMBERED_S;
        if !is_old && are_of_one_plane(&one.scan, scan) {
            same_plane.push(&one.result);
        }
    }
    let last = same_plane.last()?;
    let core_m = last.wake.map_or(2.0, |wake| wake.left.core_radius_m);
    let track = retrieve::track_of(same_plane.iter().copied());
    track.ok()??.prediction(time_s, core_m)
}

/// The word for velocities that are means over the gates.
const MEANS: &str = "means";
const UNKNOWN: &str = "velocities are taken for means over the gates: those of spectral peaks give circulations that are a quarter to a half too \
                       small; --estimator with --pulse and --window says how they were estimated, --estimator means that they are means, or \
                       --scene everything";

fn of_map(
    args: &RetrieveArgs,
    scene: Option<&SceneFile>,
    mut scan: ReadScan,
    start: Option<Wake>,
    observer: &dyn Observer,
) -> Result<RetrievedScan, Error> {
    scan.pulse_width_s = args.pulse.or(scan.pulse_width_s);
    let are_means = args.estimator.as_deref() == Some(MEANS) || args.air.gate_std == Some(0.0);
    if are_means {
        let stated_m = args
            .window
            .map(|window_s| 0.5 * SPEED_OF_LIGHT_M_S * window_s);
        scan.gate_length_m = stated_m.or(scan.gate_length_m);
    }
    // What is stated goes before what the file says.
    let (instrument, is_likely) = match (args.air.gate_std, &args.estimator, scene) {
        _ if are_means => (None, false),
        (None, None, Some(scene)) => (Some(scene.clone()), false),
        (None, Some(_), _) => (Some(args.stated_scene(&scan)?), false),
        (None, None, None) if scan.is_own => (Some(args.stated_scene(&scan)?), true),
        _ => (None, false),
    };
    let of_gate = instrument.as_ref().or(scene).map(|file| &file.content);
    let (gate, remark) = gate_of(Some(&scan), args.air.gate_std, of_gate)?;
    let own = instrument
        .as_ref()
        .map(|scene| SceneResponse::of_scene(scene, &Silent))
        .transpose()?
        .flatten();
    let velocities = match &own {
        Some(own) if is_likely => Velocities::LikelyEstimates(own),
        Some(own) => Velocities::Estimates(own),
        None if are_means => Velocities::Means,
        None => Velocities::Unknown,
    };
    args.refuse_idle_on(&scan, velocities)?;
    if own.is_none()
        && args.air.turbulence == Some(Turbulence::OfScan)
        && let Some(text) = overlap_warning(&scan.map.range_m, &gate)
    {
        observer.warn(&format!("{}: {text}", scan.path.display()));
    }
    let options = RetrievalOptions {
        start,
        ..args.options(scene, gate)
    };
    let (found, implausible) = retrieve::retrieve_map(scan, args.method, options, velocities)?;
    let lost = "it is a map of this program that has lost its scene, as some programs drop it: the estimator is taken for the default one, and \
                the deviations hold what means would differ by; --scene gives the circulations of the original";
    let taken = found.result.has(Flag::TakenForMeans);
    let taken = taken.then_some(if is_likely { lost } else { UNKNOWN });
    let implausible = implausible.map(|reason| no_wake_since(&found.scan, &reason));
    let remarks = [remark, taken, implausible.as_deref()];
    for remark in remarks.into_iter().flatten() {
        observer.warn(&format!("{}: {remark}", found.scan.path.display()));
    }
    Ok(found)
}

/// Drop in chi-square of velocities with the other sign over that of the velocities from which on these have the wrong sign.
const OTHER_SIGN: f64 = 4.0;

/// Warns of the sign of the velocities of a file where it makes one vortex of a pair: with images below the ground a pair of the other
/// sense explains little of it.
fn warn_of_sign(
    args: &RetrieveArgs,
    scene: Option<&SceneFile>,
    found: &RetrievedScan,
    observer: &dyn Observer,
) {
    let scan = &found.scan;
    let is_own = scan.is_own || scan.scene_toml.is_some();
    if is_own || args.method != Method::Fit || !found.result.has(Flag::OneVortex) {
        return;
    }
    let mut negated = scan.clone();
    negated.map.velocity_m_s.mapv_inplace(|v| -v);
    let Ok(other) = of_map(args, scene, negated, None, &Silent) else {
        return;
    };
    let is_pair = other.result.vortices.len() == 2 && !other.result.has(Flag::NoWake);
    let is_far_better = other.result.statistic >= OTHER_SIGN * found.result.statistic;
    if !(is_pair && is_far_better) {
        return;
    }
    let cure = match args.scans.velocities.towards {
        true => "are they positive away from the lidar? Then omit --towards",
        false => {
            "are they positive towards the lidar? Then give --towards, or correct the direction that the file states"
        }
    };
    let path = scan.path.display();
    observer.warn(&format!(
        "{path}: sweep {}: its velocities make one vortex, with the other sign a pair (chi-square falls by {:.0} instead of {:.0}): {cure}",
        scan.sweep, other.result.statistic, found.result.statistic
    ));
}

/// Why the best fit of a scan is no wake, in words.
fn no_wake_since(scan: &ReadScan, reason: &str) -> String {
    format!("sweep {}: the best fit is not a wake: {reason}", scan.sweep)
}

fn of_signals(
    args: &RetrieveArgs,
    maps: Vec<ReadScan>,
    signals: Signals,
    found: &mut Found,
    observer: &dyn Observer,
) -> Result<(), Error> {
    let Signals {
        mut records,
        plan,
        scans,
        spectra,
    } = signals;
    let own = SceneResponse::of_scene(&plan.file, &Silent)?;
    let velocities = own
        .as_ref()
        .map_or(Velocities::Unknown, |own| Velocities::Estimates(own));
    let mut first_line = 0;
    for (mut scan, measured) in maps.into_iter().zip(&scans) {
        scan.azimuth_rad = Some(plan.scene().scan.azimuth_rad);
        args.refuse_idle_on(&scan, velocities)?;
        let (gate, _) = gate_of(Some(&scan), args.air.gate_std, Some(plan.scene()))?;
        let (mut one, implausible) = retrieve::retrieve_map(
            scan,
            args.method,
            args.options(Some(&plan.file), gate),
            velocities,
        )?;
        if let Some(reason) = implausible {
            let path = one.scan.path.display();
            observer.warn(&format!("{path}: {}", no_wake_since(&one.scan, &reason)));
        }
        let lines = first_line..first_line + measured.lines.elevation_rad.len();
        first_line = lines.end;
        match (&own, args.method) {
            (Some(own), Method::Signals) => {
                one = retrieve::retrieve_signals(own, &mut records, measured, one, observer)?
            }
            (Some(own), Method::Envelope) => {
                if let (Some(spectra), Some(wake)) = (&spectra, one.result.wake) {
                    let snr = own.snr_of(&wake);
                    let results = retrieve::envelopes(&plan, spectra, lines, snr, &mut one)?;
                    found.envelopes.extend(
                        results
                            .into_iter()
                            .map(|result| (found.scans.len() + 1, result)),
                    );
                }
            }
            (None, Method::Signals | Method::Envelope) => {
                let reason = "this method needs noise and a Gaussian pulse in the scene".into();
                return Err(records.refuse(reason));
            }
            _ => {}
        }
        found.scans.push(one);
        observer.advance(1);
    }
    Ok(())
}

/// Of the one scene of all scans; those of several scenes have none in common.
fn provenance(scenes: &[Option<SceneFile>]) -> Provenance {
    let one = scenes
        .iter()
        .map(Option::as_ref)
        .reduce(|a, b| a.filter(|a| b.is_some_and(|b| a.hash == b.hash)))
        .flatten();
    one.map_or_else(|| Provenance::new("", "", 0), SceneFile::provenance)
}

/// The files of scans of these planes, whose content is not there before the fits.
fn list(
    method: Method,
    planes: &[usize],
    found: Option<&Found>,
    files: &mut Outputs,
) -> Result<(), Error> {
    let scans = found.map(|found| found.scans.as_slice());
    files.table("retrieval", scans, |scans| Ok(retrieve::rows(scans)))?;
    files.add("retrieval.json", scans, |scans, origin| {
        let program = &origin.program;
        let hash = &origin.scene_hash;
        let scans = retrieve::json(scans);
        Ok(format!(
            "{{\"source\": \"{program}\", \"scene_hash\": \"{hash}\", \"scans\": {scans}}}\n"
        ))
    })?;
    if method == Method::Envelope {
        files.table("envelopes", found, |found| {
            Ok(retrieve::envelope_table(&found.envelopes))
        })?;
    }
    let tracks = found.map(|found| found.tracks.as_slice());
    files.table(
        "track",
        tracks.filter(|tracks| !tracks.is_empty()),
        |tracks| Ok(retrieve::track_table(tracks)),
    )?;
    #[cfg(feature = "plots")]
    {
        for number in 1..=planes.len() {
            let scan = scans.and_then(|scans| scans.get(number - 1));
            files.figure(&format!("scan_{number:03}"), scan, |scan| {
                retrieve::figure(scan, number)
            })?;
        }
        let count = planes.iter().max().map_or(1, |last| last + 1);
        for plane in 0..count {
            let track = tracks.and_then(|tracks| tracks.iter().find(|track| track.plane == plane));
            let name = match count {
                1 => "track".to_owned(),
                _ => format!("track_{:03}", plane + 1),
            };
            files.figure(&name, track.zip(scans).as_ref(), |(track, scans)| {
                Ok(retrieve::track_figure(track, scans))
            })?;
        }
    }
    #[cfg(not(feature = "plots"))]
    let _ = planes;
    Ok(())
}

/// A line for each vortex.
fn text(found: &[RetrievedScan]) -> String {
    let mut out = String::new();
    for (number, scan) in found.iter().enumerate() {
        let flags = retrieve::flags(&scan.result);
        let flags = if flags.is_empty() {
            String::new()
        } else {
            format!("  [{flags}]")
        };
        let name = format!("scan {}", number + 1);
        if scan.result.has(Flag::NoWake) || scan.result.vortices.is_empty() {
            let (what, why) = if scan.result.has(Flag::Uncertain) {
                ("a wake, but no circulation is certain", "above")
            } else {
                ("no wake", "below")
            };
            out += &format!(
                "{name}: {what}, statistic {:.1} {why} {:.1}{flags}\n",
                scan.result.statistic, scan.result.threshold
            );
        }
        for vortex in &scan.result.vortices {
            let mean = vortex.circulation_5_15_m2_s;
            let circulation = match (mean.value.is_finite(), mean.std.is_finite()) {
                (false, _) => "unknown: no line of it has an envelope that ends in the band".into(),
                (true, false) => format!("{:.1} m^2/s, its error unknown,", mean.value),
                (true, true) => format!("{:.1} +- {:.1} m^2/s", mean.value, mean.std),
            };
            let [y, z] = [vortex.lateral_position_m, vortex.height_m].map(|m| measured(m, 2));
            let side = retrieve::name(vortex.side);
            out += &format!(
                "{name}: {side:<5} Gamma(5-15 m) {circulation} at y {y} m, z {z} m{flags}\n"
            );
        }
        if let Some(turbulence) = &scan.result.turbulence {
            out += &format!("{name}: {}\n", turbulence_text(turbulence));
        }
    }
    out
}
