//! `wakescope detect`: whether scans hold a wake, and how small a wake is found in scans like them.

use super::Cli;
use super::args::{AirArgs, FolderArgs, ScanArgs, rate, refuse_idle, spacing, stride};
use super::data_files::each_usable;
use super::data_sets::{self, SplitArgs, data_set_of};
use super::options::{ON_DATA_SET, WITHOUT_DATA_SET, WITHOUT_SCANS, refusal_of_idle};
use crate::Error;
use crate::detection::scan_turbulence::{overlap_warning, turbulence_json, turbulence_text};
use crate::detection::{
    Calibration, DetectionSettings, Power, ScanDetection, SceneNoise, background, detect as test,
    scan_table, share_table,
};
use crate::io::Provenance;
use crate::io::csv::digits;
use crate::io::scans::{ReadScan, finite};
use crate::outputs::Outputs;
use crate::plan::{Plan, Stage, Target};
use crate::progress::{Observer, Silent};
use crate::retrieve::{gate_of, scene_of};
use crate::scene::{Scene, SceneFile};
use crate::score::PredictedScan;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use wakescope_estimate::Error as EstimateError;
use wakescope_estimate::retrieval::{Gate, ScanMap, Turbulence};
use wakescope_estimate::vortex_fit::{Vortex, WakeModel};
use wakescope_estimate::wake_detection::DetectorOptions;

/// Arguments of `wakescope detect`.
#[derive(Debug, Args)]
pub(super) struct DetectArgs {
    /// Scans, raw signals or a data set; none: detectability of the scene.
    data: Vec<PathBuf>,
    /// Scene of the instrument: gates, position, noise, correlation of velocities.
    #[arg(long, value_name = "SCENE.toml", required_unless_present = "data")]
    scene: Option<PathBuf>,
    /// False-alarm rate per scan.
    #[arg(long, value_name = "RATE", default_value_t = 1e-2, value_parser = rate)]
    false_alarm: f64,
    #[command(flatten)]
    air: AirArgs,
    /// Smallest and largest vortex spacing in m.
    #[arg(long, value_name = "MIN,MAX", default_value = "16,63", value_parser = spacing)]
    spacing: (f64, f64),
    /// Search for pairs only, not for single vortices.
    #[arg(long)]
    pairs_only: bool,
    /// Lidar height above ground in m; by default the scene's, or 0.
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = finite)]
    lidar_height: Option<f64>,
    /// Stride in lines and gates; by default the scene's correlation, or 1,1.
    #[arg(long, value_name = "LINES,GATES", value_parser = stride)]
    stride: Option<(usize, usize)>,
    /// Number of empty scans simulated for the threshold.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(2000..=1_000_000))]
    empty_scans: u32,
    #[command(flatten)]
    splits: SplitArgs,
    #[command(flatten)]
    scans: ScanArgs,
    #[command(flatten)]
    folder: FolderArgs,
}

pub(super) fn detect(args: &DetectArgs, cli: &Cli) -> Result<(), Error> {
    refuse_idle(&args.data, cli)?;
    if args.data.is_empty() {
        cli.refuse_idle("detect", WITHOUT_SCANS)?;
        if args.air.turbulence == Some(Turbulence::OfScan) {
            let reason = "auto finds it in scans, and no file of scans is read";
            return Err(refusal_of_idle("detect", "turbulence", reason));
        }
    }
    if let Some(folder) = data_set_of(&args.data)? {
        return of_data_set(args, folder, cli);
    }
    cli.refuse_idle("detect", WITHOUT_DATA_SET)?;
    let observer = cli.observer();
    let stated = match &args.scene {
        Some(path) => Some(cli.scene(path)?),
        None => None,
    };
    let mut scans = Vec::new();
    let mut notes = Vec::new();
    for read in each_usable(&args.data, &*observer, |path| {
        args.scans.read(path, stated.as_ref(), false, &*observer)
    })? {
        scans.extend(read.maps);
        notes.extend(read.left_out);
    }
    let scene = match (stated, scans.first()) {
        (None, Some(scan)) => scene_of(scan, &*observer)?,
        (stated, _) => stated,
    };
    let plan = match &scene {
        Some(scene) => Some(Plan::new(scene.of_one_scan_in_still_air()?, Target::Map)?),
        None => None,
    };
    if let Some(plan) = plan.as_ref().filter(|_| scans.is_empty()) {
        refuse_other_patterns(plan)?;
    }
    args.folder.prepare(cli, |files| list(args, None, files))?;
    let plan_scene = plan.as_ref().map(|plan| plan.scene());
    let (gate, note) = gate_of(scans.first(), args.air.gate_std, plan_scene)?;
    notes.extend(note.map(str::to_owned));
    let mut settings = args.settings(cli.seed, plan_scene, gate);
    // The grid of the scene, if there are no scans.
    let mut empty = None;
    if let Some(plan) = &plan {
        let noise = SceneNoise::new(plan, &*observer)?;
        settings.stride = args.stride.unwrap_or(noise.stride);
        for scan in &mut scans {
            noise.give(&mut scan.map, scan.scans);
        }
        empty = scans.is_empty().then(|| noise.empty_scan(plan));
    }
    if settings.options.turbulence == Some(Turbulence::OfScan) {
        notes.extend(overlap_of(&scans, &settings));
    }
    let (found, mut calibration) = test_scans(&scans, &settings, &*observer)?;
    if let Some(empty) = empty {
        let (lines, gates) = settings.stride;
        let grid = empty.strided(lines, gates);
        calibration = Some(Calibration::new(&grid, &settings, &*observer)?);
    }
    let power = match calibration {
        Some(calibration) => Some(calibration.power(&settings, &*observer)?),
        None => None,
    };
    let origin = match &scene {
        Some(scene) => scene.provenance(),
        None => Provenance::new("", "", settings.seed),
    };
    let result = (&scans[..], &found[..], power.as_ref());
    report(args, cli, &settings, result, &notes, origin)
}

/// Refuses a scene without files of scans unless its scan is one of a vertical plane.
fn refuse_other_patterns(plan: &Plan) -> Result<(), Error> {
    if plan.geometry.schedule.is_plane() {
        return Ok(());
    }
    let reason = "\"rhi\" without files of scans: wakes are sought in scans of a vertical plane";
    Err(plan.file.of_key(Error::Key {
        key: "scan.pattern.kind",
        reason: reason.into(),
    }))
}

/// Predictions for the scans of a data set.
fn of_data_set(args: &DetectArgs, folder: &Path, cli: &Cli) -> Result<(), Error> {
    cli.refuse_idle(folder, ON_DATA_SET)?;
    args.folder
        .prepare(cli, |files| data_sets::list("detection", None, files))?;
    let observer = cli.observer();
    let splits = args.splits.splits();
    let (found, origin) = data_sets::predict(
        folder,
        &splits,
        &args.scans.velocities,
        (Stage::Detection, &*observer),
        |flight, scene, scans| of_flight((args, cli.seed), (flight, scene), scans, &*observer),
    )?;
    let of = (Default::default(), origin);
    let list = |files: &mut Outputs| data_sets::list("detection", Some(&found), files);
    args.folder.finish(cli, of, list, data_sets::report(&found))
}

/// The best trial wakes of the scans of a flight in which one is found. In a scan that cannot be tested there is none.
fn of_flight(
    (args, seed): (&DetectArgs, Option<u64>),
    (flight, scene): (usize, &SceneFile),
    scans: Vec<ReadScan>,
    observer: &dyn Observer,
) -> Result<Vec<PredictedScan>, Error> {
    let plan = Plan::new(scene.clone(), Target::Map)?;
    let (gate, _) = gate_of(None, None, Some(plan.scene()))?;
    let noise = SceneNoise::new(&plan, &Silent)?;
    let mut settings = args.settings(seed, Some(plan.scene()), gate);
    settings.stride = args.stride.unwrap_or(noise.stride);
    let mut maps = Vec::with_capacity(scans.len());
    for mut scan in scans {
        noise.give(&mut scan.map, scan.scans);
        maps.push(scan.map);
    }
    if let Ok((found, _)) = test(&maps, &settings, &Silent) {
        let of = |found| PredictedScan::from_detection(found, &settings.model);
        return Ok(found.iter().map(of).collect());
    }
    // At least one of them cannot be tested.
    let mut predicted = Vec::with_capacity(maps.len());
    for (scan, map) in maps.iter().enumerate() {
        match test(std::slice::from_ref(map), &settings, &Silent) {
            Ok((found, _)) => predicted.extend(
                found
                    .iter()
                    .map(|found| PredictedScan::from_detection(found, &settings.model)),
            ),
            Err(error @ Error::Estimate(EstimateError::TooFewVelocities { .. })) => {
                observer.warn(&data_sets::without_wake(flight, scan, &error));
                predicted.push(PredictedScan::default());
            }
            Err(error) => return Err(error),
        }
    }
    Ok(predicted)
}

/// The warning of gates that overlap after the stride, of the first scan.
fn overlap_of(scans: &[ReadScan], settings: &DetectionSettings) -> Option<String> {
    let first = scans.first()?.map.strided(1, settings.stride.1);
    overlap_warning(&first.range_m, &settings.gate)
}

/// Tests scans for wakes; an error of a single one names its file.
fn test_scans(
    scans: &[ReadScan],
    settings: &DetectionSettings,
    observer: &dyn Observer,
) -> Result<(Vec<ScanDetection>, Option<Calibration>), Error> {
    let maps: Vec<ScanMap> = scans.iter().map(|scan| scan.map.clone()).collect();
    test(&maps, settings, observer).map_err(|error| match scans {
        [only] => Error::input(&only.path, error.to_string()),
        _ => error,
    })
}

/// Scans, the results of their tests, and how often wakes are detected in scans like them.
type Tested<'t> = (&'t [ReadScan], &'t [ScanDetection], Option<&'t Power>);

/// Writes the files and prints the results.
fn report(
    args: &DetectArgs,
    cli: &Cli,
    settings: &DetectionSettings,
    result: Tested<'_>,
    notes: &[String],
    origin: Provenance,
) -> Result<(), Error> {
    let (scans, found, power) = result;
    let is_known = found.iter().all(|scan| scan.assumed_sigma_m_s.is_none());
    let background = background(settings, is_known);
    let mut lines = notes.to_vec();
    let mut objects = Vec::with_capacity(scans.len());
    for (scan, found) in scans.iter().zip(found) {
        add_scan(scan, found, &mut lines);
        objects.push(scan_object(scan, found));
    }
    if let Some(power) = power {
        add_power(power, &mut lines);
    }
    lines.push(format!("the false-alarm rate holds for {background}\n"));
    let mut object = json!({
        "false_alarm": args.false_alarm, "background": background, "scans": objects,
        "smallest_detectable_m2_s": null, "smallest_detectable_error_m2_s": null, "smallest_foretold_m2_s": null,
        "threshold": null, "circulation_std_m2_s": null, "gumbel": null, "notes": notes,
    });
    if let Some(power) = power {
        object["smallest_detectable_m2_s"] = json!(power.smallest_m2_s.0);
        object["smallest_detectable_error_m2_s"] = json!(power.smallest_error_m2_s);
        object["smallest_foretold_m2_s"] = json!(power.smallest_m2_s.1);
        object["threshold"] = json!(power.threshold);
        object["circulation_std_m2_s"] = json!(power.circulation_std_m2_s);
        object["gumbel"] = json!([power.gumbel.0, power.gumbel.1]);
    }
    args.folder.finish(
        cli,
        (Default::default(), origin),
        |files| list(args, Some(result), files),
        (object, lines.join("\n")),
    )
}

impl DetectArgs {
    /// How wakes are looked for, but for the strides that the noise of a scene asks for.
    fn settings(&self, seed: Option<u64>, scene: Option<&Scene>, gate: Gate) -> DetectionSettings {
        let height_m = scene.map_or(0.0, |scene| scene.scan.lidar_height_m);
        let lidar_height_m = self.lidar_height.unwrap_or(height_m);
        DetectionSettings {
            false_alarm: self.false_alarm,
            model: WakeModel {
                lidar_height_m,
                images: self.air.images,
                ..WakeModel::default()
            },
            gate,
            options: DetectorOptions {
                spacing_m: self.spacing,
                single_vortices: !self.pairs_only,
                turbulence: self.air.turbulence,
            },
            empty_scans: self.empty_scans as usize,
            stride: self.stride.unwrap_or((1, 1)),
            seed: seed.or(scene.map(|scene| scene.seed)).unwrap_or(1),
        }
    }
}

/// Adds a description of the test of a scan.
fn add_scan(scan: &ReadScan, found: &ScanDetection, lines: &mut Vec<String>) {
    let verdict = if found.is_wake() { "wake" } else { "no wake" };
    let statistic = found.statistic.value;
    let threshold = found.threshold;
    let rate = found.false_alarm;
    let reached = if rate < 1e-12 {
        "less than 1e-12".into()
    } else {
        digits(rate)
    };
    let mut line = format!(
        "{} sweep {}: {verdict}; statistic {statistic:.1}, ",
        scan.path.display(),
        scan.sweep
    );
    line +=
        &format!("threshold {threshold:.1}; an empty scan reaches it with probability {reached}");
    lines.push(line);
    if let Some(sigma_m_s) = found.assumed_sigma_m_s {
        lines.push(format!(
            "  no standard deviations are given: {} m/s is assumed for all velocities",
            digits(sigma_m_s)
        ));
    }
    if let Some(turbulence) = &found.turbulence {
        lines.push(format!("  {}", turbulence_text(turbulence)));
    }
    if found.is_correlated() {
        let (along, across) = found.statistic.neighbour_correlation;
        lines.push(format!(
            "  warning: neighbours are correlated, {along:.2} along the lines and {across:.2} across: this is not the background that \
             the rate holds for; state --turbulence, or --stride for lines and gates that share pulses"
        ));
    }
}

/// Adds the threshold and the smallest wake that is detected.
fn add_power(power: &Power, lines: &mut Vec<String>) {
    let (mu, beta) = power.gumbel;
    let (measured, foretold) = power.smallest_m2_s;
    let threshold = power.threshold;
    let rate = power.false_alarm;
    let doubt = if (1.5..2.6).contains(&beta) {
        ""
    } else {
        " (should be near 2: is the stated noise right?)"
    };
    let law = format!("Gumbel's mu {mu:.2}, beta {beta:.2}{doubt}");
    lines.push(format!(
        "threshold {threshold:.2} for {rate} false alarms a scan; {law}"
    ));
    let error = power.smallest_error_m2_s;
    let bound = power.circulation_std_m2_s;
    let by_bound = format!("from the bound of {bound:.2} m^2/s: {foretold:.1}");
    lines.push(format!(
        "circulation detected with probability 0.9: {measured:.1} +- {error:.1} m^2/s ({by_bound})"
    ));
}

/// The files; before the tests their names alone.
fn list(args: &DetectArgs, result: Option<Tested<'_>>, files: &mut Outputs) -> Result<(), Error> {
    if !args.data.is_empty() {
        files.table("detection", result.as_ref(), |(scans, found, _)| {
            Ok(scan_table(scans, found))
        })?;
    }
    let power = result.and_then(|(_, _, power)| power);
    files.table("detection_power", power, |power| {
        Ok(share_table(power, &power.found, true))
    })?;
    files.table("detection_roc", power, |power| {
        Ok(share_table(power, &power.roc, false))
    })?;
    #[cfg(feature = "plots")]
    files.figure("detection", power, |power| {
        Ok(crate::detection::picture(power))
    })?;
    Ok(())
}

fn scan_object(scan: &ReadScan, found: &ScanDetection) -> Value {
    let statistic = &found.statistic;
    let mut object = json!({
        "file": scan.path.to_string_lossy(), "sweep": scan.sweep, "wake": found.is_wake(), "statistic": statistic.value,
        "threshold": found.threshold, "false_alarm": found.false_alarm, "left": vortex_object(statistic.wake.left),
        "right": vortex_object(statistic.wake.right), "gamma_std_m2_s": statistic.circulation_std_m2_s,
        "chi2_per_dof": { "wind": statistic.wind_chi2_per_dof, "wake": statistic.wake_chi2_per_dof },
        "velocities": found.velocities, "outliers": found.outliers, "assumed_sigma_m_s": found.assumed_sigma_m_s,
        "neighbour_correlation": [statistic.neighbour_correlation.0, statistic.neighbour_correlation.1],
        "correlated": found.is_correlated(), "gumbel": [found.gumbel.0, found.gumbel.1],
    });
    if let Some(turbulence) = &found.turbulence {
        object["turbulence"] = turbulence_json(turbulence);
    }
    object
}

/// A vortex; null without circulation.
fn vortex_object(vortex: Vortex) -> Option<Value> {
    (vortex.circulation_m2_s > 0.0).then(|| {
        json!({ "gamma_m2_s": vortex.circulation_m2_s, "y_m": vortex.lateral_position_m, "z_m": vortex.height_m })
    })
}
