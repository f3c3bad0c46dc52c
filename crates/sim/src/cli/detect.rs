//! `wakescope detect`: whether scans hold a wake, and how small a wake is found in scans like them.

use super::retrieve::{YesNo, is_signals, not_negative, positive, signals, turbulence};
use super::{Cli, load, paths, progress, say, shown};
use crate::Error;
use crate::detection::{
    Calibration, DetectionSettings, Power, ScanDetection, SceneNoise, background, detect as test, gate_table,
    power_table, roc_table, scan_table, strided,
};
use crate::io::scans::{self, ReadScan, ScanFormat};
use crate::io::{Existing, FileGroup, Provenance};
use crate::plan::{Plan, Target};
use crate::retrieve::{gate_of, scene_of};
use crate::scene::{NoiseKind, SceneFile};
use crate::setup::progress::Observer;
use crate::write;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use wakescope_estimate::retrieval::{ScanMap, Turbulence};
use wakescope_estimate::wake_detection::DetectorOptions;

/// Words of `wakescope detect`.
#[derive(Debug, Args)]
pub(super) struct DetectWords {
    /// Scans: CfRadial, HALO .hpl or tables; or raw signals, with --scene; without any the scene says what would be found.
    data: Vec<PathBuf>,
    /// The scene whose instrument measured them: gates, place of the lidar, noise and how far apart velocities are independent.
    #[arg(long, value_name = "SCENE.toml", required_unless_present = "data")]
    scene: Option<PathBuf>,
    /// Rate of false alarms of a scan.
    #[arg(long, value_name = "RATE", default_value_t = 1e-2, value_parser = rate)]
    false_alarm: f64,
    /// Standard deviation, m/s, and length, m, of turbulence that neighbouring velocities share, e.g. 0.8,25.
    #[arg(long, value_name = "SIGMA,LENGTH", value_parser = turbulence)]
    turbulence: Option<Turbulence>,
    /// Standard deviation of a gate's weight along the line, m; 0 for velocities at points.
    #[arg(long, value_name = "M", value_parser = not_negative)]
    gate_std: Option<f64>,
    /// Least and largest distance of the vortices of a pair, m.
    #[arg(long, value_name = "MIN,MAX", default_value = "16,63", value_parser = spacing)]
    spacing: (f64, f64),
    /// Look for pairs only, not for single vortices.
    #[arg(long)]
    pairs_only: bool,
    /// Whether image vortices make the ground a streamline.
    #[arg(long, value_enum, default_value_t = YesNo::Yes)]
    ground: YesNo,
    /// Height of the lidar above the ground, m; that of the scene, or 0.
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = finite)]
    lidar_height: Option<f64>,
    /// Use every so many lines and gates: of neighbours that share pulses or windows; as the scene's noise asks, or 1,1.
    #[arg(long, value_name = "LINES,GATES", value_parser = stride)]
    stride: Option<(usize, usize)>,
    /// Empty scans that are drawn for the threshold.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(2000..=1_000_000))]
    empty_scans: u32,
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
    #[arg(long, value_name = "DB", allow_negative_numbers = true, value_parser = finite)]
    min_snr: Option<f64>,
    /// Folder to write to; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace files in the folder that this program did not write, or that were changed since.
    #[arg(long)]
    overwrite: bool,
}

fn number(word: &str) -> Option<f64> {
    word.trim().parse::<f64>().ok().filter(|value| value.is_finite())
}

fn finite(word: &str) -> Result<f64, String> {
    number(word).ok_or_else(|| "a number, e.g. 1.5".into())
}

fn rate(word: &str) -> Result<f64, String> {
    let rate = number(word).filter(|rate| (1e-9..=0.5).contains(rate));
    rate.ok_or_else(|| "a rate from 1e-9 to 0.5, e.g. 0.01".into())
}

fn two(word: &str) -> Option<(f64, f64)> {
    let (a, b) = word.split_once(',')?;
    Some((number(a)?, number(b)?))
}

fn spacing(word: &str) -> Result<(f64, f64), String> {
    let found = two(word).filter(|(least, most)| *least >= 1.0 && least <= most && *most <= 1e4);
    found.ok_or_else(|| "two distances from 1 to 1e4 m, the smaller one first, e.g. 16,63".into())
}

fn stride(word: &str) -> Result<(usize, usize), String> {
    let whole = |word: &str| word.trim().parse::<usize>().ok().filter(|n| (1..=1000).contains(n));
    let found = word.split_once(',').and_then(|(lines, gates)| Some((whole(lines)?, whole(gates)?)));
    found.ok_or_else(|| "two whole numbers from 1 to 1000, e.g. 4,8".into())
}

/// What was read and how it is tested.
struct Task {
    scans: Vec<ReadScan>,
    settings: DetectionSettings,
    /// The grid of the scene, if there are no scans.
    empty: Option<ScanMap>,
    scene: Option<SceneFile>,
    /// Of the scene in still air.
    plan: Option<Plan>,
    notes: Vec<String>,
}

pub(super) fn detect(words: &DetectWords, cli: &Cli) -> Result<(), Error> {
    match cli.quiet {
        true => run(words, cli, &progress::Quiet),
        false => run(words, cli, &progress::Bars::new()),
    }
}

fn run(words: &DetectWords, cli: &Cli, observer: &dyn Observer) -> Result<(), Error> {
    let existing = if words.overwrite { Existing::Any } else { Existing::Own };
    let task = Task::new(words, cli, observer, existing)?;
    let maps: Vec<ScanMap> = task.scans.iter().map(|scan| scan.map.clone()).collect();
    let (found, calibration) = test(&maps, &task.settings).map_err(|error| task.of_file(error))?;
    let calibration = match (calibration, &task.empty) {
        (None, Some(empty)) => Some(Calibration::new(&strided(empty, task.settings.stride), &task.settings)?),
        (known, _) => known,
    };
    let power = calibration.map(|known| known.power(&task.settings)).transpose()?;
    let files = task.write(words, &found, power.as_ref(), existing, observer)?;
    let has_sigma = found.iter().all(|scan| scan.assumed_sigma_m_s.is_none());
    let holds = background(&task.settings, has_sigma);
    let mut text = task.told(&found, power.as_ref());
    text.push(format!("the rate of false alarms holds for {holds}"));
    text.push(format!("wrote {} files to {}", files.len(), words.out.display()));
    let object = json!({
        "version": crate::VERSION, "false_alarm": words.false_alarm, "background": holds,
        "scans": task.scans.iter().zip(&found).map(as_json).collect::<Vec<_>>(),
        "smallest_detectable_m2_s": power.as_ref().map(|power| power.smallest_m2_s.0),
        "smallest_detectable_error_m2_s": power.as_ref().map(|power| power.smallest_error_m2_s),
        "smallest_foretold_m2_s": power.as_ref().map(|power| power.smallest_m2_s.1),
        "threshold": power.as_ref().map(|power| power.threshold),
        "circulation_std_m2_s": power.as_ref().map(|power| power.circulation_std_m2_s),
        "gumbel": power.as_ref().map(|power| [power.gumbel.0, power.gumbel.1]),
        "notes": task.notes, "files": paths(&files),
    });
    say(cli.json, &object, &text.join("\n"))
}

impl Task {
    fn new(words: &DetectWords, cli: &Cli, observer: &dyn Observer, existing: Existing) -> Result<Self, Error> {
        let format = ScanFormat { field: words.field.clone(), towards: words.towards, min_snr_db: words.min_snr };
        let (mut scans, mut notes) = (Vec::new(), Vec::new());
        let scene = words.scene.as_deref().map(|path| load(path, cli)).transpose()?;
        for path in &words.data {
            if is_signals(path) {
                scans.extend(signals(path, scene.clone(), words.scale, false)?.maps());
                continue;
            }
            let (read, left_out) = scans::read(path, &format)?;
            scans.extend(read);
            notes.extend(left_out);
        }
        let scene = match (scene, scans.first()) {
            (Some(scene), _) => Some(scene),
            (None, Some(scan)) => scene_of(scan)?,
            (None, None) => None,
        };
        let still = scene.as_ref().map(SceneFile::in_still_air).transpose()?;
        let plan = still.map(|scene| Plan::new(scene, Target::Map)).transpose()?;
        let names = names(words.data.is_empty(), plan.as_ref());
        write::prepare(&words.out, names.iter().copied(), existing)?;
        let mut settings = DetectionSettings {
            false_alarm: words.false_alarm,
            options: DetectorOptions {
                spacing_m: words.spacing,
                single_vortices: !words.pairs_only,
                turbulence: words.turbulence,
            },
            empty_scans: words.empty_scans as usize,
            seed: cli.seed.or(plan.as_ref().map(|plan| plan.scene.scene.seed)).unwrap_or(1),
            ..DetectionSettings::default()
        };
        let height_m = plan.as_ref().map_or(0.0, |plan| plan.scene.scene.scan.lidar_height_m);
        settings.model.lidar_height_m = words.lidar_height.unwrap_or(height_m);
        settings.model.images = words.ground == YesNo::Yes;
        let (gate, note) = gate_of(scans.first(), words.gate_std, plan.as_ref().map(|plan| &plan.scene.scene))?;
        settings.gate = gate;
        notes.extend(note.map(str::to_owned));
        let mut empty = None;
        if let Some(plan) = &plan {
            let noise = SceneNoise::new(plan, observer)?;
            settings.stride = noise.stride;
            scans.iter_mut().for_each(|scan| noise.give(&mut scan.map, scan.scans));
            empty = scans.is_empty().then(|| noise.empty_scan(plan));
        }
        settings.stride = words.stride.unwrap_or(settings.stride);
        Ok(Self { scans, settings, empty, scene, plan, notes })
    }

    /// An error of a test with the file it is of, if there is one.
    fn of_file(&self, error: Error) -> Error {
        match self.scans.as_slice() {
            [only] => Error::Input { path: only.path.clone(), reason: error.to_string() },
            _ => error,
        }
    }

    fn provenance(&self) -> Provenance {
        let of_scene = write::provenance_of(self.scene.as_ref());
        Provenance { seed: self.scene.as_ref().map_or(self.settings.seed, |_| of_scene.seed), ..of_scene }
    }

    fn write(
        &self,
        words: &DetectWords,
        found: &[ScanDetection],
        power: Option<&Power>,
        existing: Existing,
        observer: &dyn Observer,
    ) -> Result<Vec<PathBuf>, Error> {
        let origin = self.provenance();
        let mut files = FileGroup::new(&words.out);
        if !self.scans.is_empty() {
            let name = |scan: &ReadScan| {
                let times = scan.map.time_s.iter().copied().filter(|t| t.is_finite());
                (shown_path(&scan.path), scan.sweep, times.fold(f64::NAN, f64::min))
            };
            let names: Vec<_> = self.scans.iter().map(name).collect();
            files.add("detection.csv", scan_table(&names, found).to_csv(&origin)?)?;
        }
        if let Some(power) = power {
            files.add("detection_power.csv", power_table(power).to_csv(&origin)?)?;
            files.add("detection_roc.csv", roc_table(power).to_csv(&origin)?)?;
            #[cfg(feature = "plots")]
            crate::detection::picture(power).add_to(&mut files, "detection", &origin)?;
        }
        if let Some(plan) = self.plan.as_ref().filter(|plan| has_gates(plan)) {
            let table = gate_table(plan, words.false_alarm, observer)?;
            files.add("detection_gates.csv", table.to_csv(&origin)?)?;
        }
        write::put(files, &words.out, existing)
    }

    fn told(&self, found: &[ScanDetection], power: Option<&Power>) -> Vec<String> {
        let mut text = self.notes.clone();
        for (scan, found) in self.scans.iter().zip(found) {
            let name = format!("{} sweep {}", scan.path.display(), scan.sweep);
            let (statistic, rate) = (found.statistic.value, found.false_alarm);
            let verdict = if found.is_wake() { "wake" } else { "no wake" };
            let reached = if rate < 1e-12 { "less than 1e-12".into() } else { shown(rate) };
            text.push(format!(
                "{name}: {verdict}; statistic {statistic:.1}, threshold {:.1}; an empty scan reaches it with probability {reached}",
                found.threshold
            ));
            if let Some(sigma_m_s) = found.assumed_sigma_m_s {
                text.push(format!("  no deviations are stated: {} m/s is taken for all", shown(sigma_m_s)));
            }
            if found.is_correlated() {
                let (along, across) = found.statistic.neighbour_correlation;
                text.push(format!(
                    "  warning: neighbours are correlated, {along:.2} along the lines and {across:.2} across: this is not the background \
                     that the rate holds for; state --turbulence, or --stride for lines and gates that share pulses"
                ));
            }
        }
        if let Some(power) = power {
            let (mu, beta) = power.gumbel;
            text.push(format!(
                "threshold {:.2} for {} false alarms a scan; Gumbel's mu {mu:.2}, beta {beta:.2}{}",
                power.threshold,
                power.false_alarm,
                if (1.5..2.6).contains(&beta) { "" } else { " (should be near 2: is the noise what was stated?)" }
            ));
            let (measured, foretold) = power.smallest_m2_s;
            text.push(format!(
                "circulation found nine times in ten: {measured:.1} +- {:.1} m^2/s (the bound of {:.2} m^2/s foretells {foretold:.1})",
                power.smallest_error_m2_s, power.circulation_std_m2_s
            ));
        }
        text
    }
}

/// Names of the files that will be written.
fn names(is_scene_alone: bool, plan: Option<&Plan>) -> Vec<&'static str> {
    let mut names = vec!["detection_power.csv", "detection_roc.csv"];
    if !is_scene_alone {
        names.push("detection.csv");
    }
    if cfg!(feature = "plots") {
        names.extend(["detection.svg", "detection.png"]);
    }
    if plan.is_some_and(has_gates) {
        names.push("detection_gates.csv");
    }
    names
}

/// Whether the closed forms of single gates are known: there must be noise.
fn has_gates(plan: &Plan) -> bool {
    plan.scene.scene.detector.noise != NoiseKind::None
}

fn shown_path(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

fn as_json((scan, found): (&ReadScan, &ScanDetection)) -> Value {
    let vortex = |vortex: wakescope_estimate::vortex_fit::Vortex| {
        let there = vortex.circulation_m2_s > 0.0;
        there.then(|| json!({ "gamma_m2_s": vortex.circulation_m2_s, "y_m": vortex.lateral_position_m, "z_m": vortex.height_m }))
    };
    let statistic = &found.statistic;
    json!({
        "file": scan.path.to_string_lossy(), "sweep": scan.sweep, "wake": found.is_wake(), "statistic": statistic.value,
        "threshold": found.threshold, "false_alarm": found.false_alarm, "left": vortex(statistic.wake.left),
        "right": vortex(statistic.wake.right), "gamma_std_m2_s": statistic.circulation_std_m2_s,
        "chi2_per_dof": { "wind": statistic.wind_chi2_per_dof, "wake": statistic.wake_chi2_per_dof },
        "velocities": found.velocities, "outliers": found.outliers, "assumed_sigma_m_s": found.assumed_sigma_m_s,
        "neighbour_correlation": [statistic.neighbour_correlation.0, statistic.neighbour_correlation.1],
        "correlated": found.is_correlated(), "gumbel": [found.gumbel.0, found.gumbel.1],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_or_refused_with_an_example() {
        assert_eq!((spacing("47,47"), stride("4,8"), rate("1e-3")), (Ok((47.0, 47.0)), Ok((4, 8)), Ok(1e-3)));
        assert!(
            spacing("60,20").is_err() && spacing("0,20").is_err() && stride("0,1").is_err() && stride("a").is_err()
        );
        assert!(rate("0").is_err() && rate("0.7").is_err() && rate("inf").is_err());
    }
}
