//! Figure 22, beyond the chapter: errors of circulations in turbulence, of each method, what the fits state of them, and the circulation that is
//! detected nine times in ten.

use super::context::*;
use std::path::Path;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{ScanMap, Turbulence};
use wakescope_estimate::wake_detection::DetectorOptions;
use wakescope_sim::detection::{DetectionSettings, detect};
use wakescope_sim::measure::map::velocities;
use wakescope_sim::retrieve::{RetrievalRow, gate_of};
use wakescope_sim::run::run;
use wakescope_sim::scene::{RetrievalMethod, RetrievalTurbulence};

/// Dissipation rates \[m²/s³\], and those that `full` adds.
const DISSIPATIONS_M2_S3: [f64; 3] = [4e-5, 5e-4, 1.45e-2];
const MORE_M2_S3: [f64; 2] = [1e-5, 3e-3];
const LEVELS_DB: [f64; 2] = [10.0, 0.0];

/// The fit to independent velocities, that with the turbulence of the scan, and the method of radial velocities.
const METHODS: [&str; 3] = ["fit", "fit, turbulence of the scan", "rv"];
const FIT: usize = 0;
const OF_SCAN: usize = 1;
const RV: usize = 2;
/// The test for a wake, after the methods.
const DETECT: usize = METHODS.len();

/// Stated standard errors over the scatter of errors.
const STATED: Bar = Bar::Between(0.7, 1.4);
const WEAK_M2_S3: f64 = DISSIPATIONS_M2_S3[0];
/// Circulation that is detected nine times in ten, in the strongest turbulence over that in the weakest.
const RISES: Bar = Bar::Above(1.0);

/// A pair in turbulence that each scan has anew.
const SCENE: &str = r#"
[detector.snr]
reference = "fixed"
snr_db = LEVEL
[flow]
circulation_m2_s = 400.0
height_m = 60.0
[[added_flows]]
kind = "eddies"
dissipation_m2_s3 = DISSIPATION
outer_scale_m = 60.0
realisations = "each"
[scan]
elevation_min_rad = 0.02
elevation_max_rad = 0.265
elevation_step_rad = STEP
range_min_m = 300.0
range_max_m = 500.0
pulses_per_line = 4
realisations = SCANS
[estimator]
ESTIMATOR
[retrieval]
methods = ["fit", "rv"]
"#;

/// Of maps in which wakes are fitted, and of those in which they are detected: gates that share no sample, whose noise would count as turbulence.
const FITTED: &str = "gate_step_samples = 15";
const TESTED: &str = r#"
window_samples = 24
gate_step_samples = 24
weighting = "rectangular"
radius_m = 0.0
method = { kind = "first_moment" }
"#;

/// One vortex of one scan by one method, NaN where it was not found, or what is detected in the turbulence of a scan.
struct Row {
    dissipation_m2_s3: f64,
    snr_db: f64,
    method: usize,
    scan: usize,
    error_m2_s: f64,
    stated_m2_s: f64,
    /// The circulation that is detected nine times in ten, at a rate of false alarms of one in a hundred.
    detected_m2_s: Measured,
}

impl Row {
    fn method_name(&self) -> &'static str {
        METHODS.get(self.method).copied().unwrap_or("detect")
    }
}

/// A circulation that is not known.
const UNKNOWN: Measured = Measured {
    value: f64::NAN,
    std: f64::NAN,
};

/// The rows of one method at one dissipation rate and one signal-to-noise ratio.
struct Case {
    dissipation_m2_s3: f64,
    snr_db: f64,
    method: usize,
    /// Errors and standard errors of the vortices of each scan in which some were found \[m²/s\].
    scans: Vec<Vec<(f64, f64)>>,
}

impl Case {
    fn new(rows: &[Row], dissipation_m2_s3: f64, snr_db: f64, method: usize) -> Self {
        let mut scans: Vec<Vec<(f64, f64)>> = Vec::new();
        for row in rows {
            let is_in_air = row.dissipation_m2_s3 == dissipation_m2_s3 && row.snr_db == snr_db;
            if !is_in_air || row.method != method {
                continue;
            }
            scans.resize(scans.len().max(row.scan + 1), Vec::new());
            if row.error_m2_s.is_finite() {
                scans[row.scan].push((row.error_m2_s, row.stated_m2_s));
            }
        }
        scans.retain(|vortices| !vortices.is_empty());
        Self {
            dissipation_m2_s3,
            snr_db,
            method,
            scans,
        }
    }

    /// Root mean square of a number of the vortices, without one of the scans.
    fn rms(&self, number: fn(&(f64, f64)) -> f64, without: Option<usize>) -> f64 {
        let mut squares = Vec::new();
        for (scan, vortices) in self.scans.iter().enumerate() {
            if Some(scan) != without {
                squares.extend(vortices.iter().map(|vortex| number(vortex).powi(2)));
            }
        }
        mean(&squares, None).sqrt()
    }

    fn rms_error(&self) -> Estimate {
        Estimate::of(self.scans.len(), |without| self.rms(|v| v.0, without))
    }

    fn rms_stated(&self) -> Estimate {
        Estimate::of(self.scans.len(), |without| self.rms(|v| v.1, without))
    }

    /// Standard error that the fit states over the scatter of its errors.
    fn stated_over_scatter(&self) -> Estimate {
        Estimate::of(self.scans.len(), |without| {
            self.rms(|v| v.1, without) / self.rms(|v| v.0, without)
        })
    }

    fn edr_m23_s(&self) -> f64 {
        self.dissipation_m2_s3.cbrt()
    }

    fn name(&self) -> String {
        format!("{:e} m²/s³, {} dB", self.dissipation_m2_s3, self.snr_db)
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let scans = context.profile.choose(8, 48, 200);
    let mut dissipations_m2_s3 = context.profile.choose(
        vec![DISSIPATIONS_M2_S3[0], DISSIPATIONS_M2_S3[2]],
        DISSIPATIONS_M2_S3.to_vec(),
        DISSIPATIONS_M2_S3.to_vec(),
    );
    if context.profile == Profile::Full {
        dissipations_m2_s3.extend(MORE_M2_S3);
        dissipations_m2_s3.sort_by(f64::total_cmp);
    }
    let levels_db = context
        .profile
        .choose(&LEVELS_DB[..1], &LEVELS_DB[..], &LEVELS_DB[..]);
    let mut rows = Vec::new();
    let mut cases = Vec::new();
    let mut detected = Vec::new();
    for &snr_db in levels_db {
        for &dissipation_m2_s3 in &dissipations_m2_s3 {
            let of_case = Scans {
                context,
                dissipation_m2_s3,
                snr_db,
                scans,
            };
            rows.extend(of_case.retrieved()?);
            detected.push(of_case.detected(context.profile.choose(1000, 10_000, 10_000))?);
            for method in 0..METHODS.len() {
                cases.push(Case::new(&rows, dissipation_m2_s3, snr_db, method));
            }
        }
    }
    let origin = context.provenance_of_formula(SCENE);
    let picture = picture(levels_db, &cases, &detected);
    let rises = rises(&detected);
    rows.append(&mut detected);
    let mut out = Rendered::new(&table(&rows), &picture, &origin)?;
    out.values = vec![scans.to_string()];
    out.claims = claims(&cases);
    out.claims.push(Claim::judged("CT2", &rises));
    Ok(out)
}

/// Scans of one scene, each with turbulence of its own.
struct Scans<'c> {
    context: &'c Context,
    dissipation_m2_s3: f64,
    snr_db: f64,
    scans: usize,
}

impl Scans<'_> {
    fn scene(&self, estimator: &str) -> Result<Scene, Failure> {
        let text = SCENE
            .replace("LEVEL", &format!("{:?}", self.snr_db))
            .replace("DISSIPATION", &format!("{:?}", self.dissipation_m2_s3))
            .replace(
                "STEP",
                self.context.profile.choose("1e-2", "5e-3", "2.5e-3"),
            )
            .replace("SCANS", &self.scans.to_string())
            .replace("ESTIMATOR", estimator);
        Ok(SceneFile::parse(&text, Path::new("turbulence.toml"))?.content)
    }

    /// The vortices of all scans by all methods.
    fn retrieved(&self) -> Result<Vec<Row>, Failure> {
        let mut rows = Vec::new();
        for row in self.run(self.scene(FITTED)?)? {
            let is_fit = row.method == RetrievalMethod::Fit;
            rows.push(self.row(&row, if is_fit { FIT } else { RV }));
        }
        let mut scene = self.scene(FITTED)?;
        if let Some(retrieval) = &mut scene.retrieval {
            retrieval.methods = vec![RetrievalMethod::Fit];
            retrieval.turbulence = RetrievalTurbulence::Auto;
        }
        for row in self.run(scene)? {
            rows.push(self.row(&row, OF_SCAN));
        }
        Ok(rows)
    }

    fn run(&self, scene: Scene) -> Result<Vec<RetrievalRow>, Failure> {
        let plan = Plan::new(self.context.scene_file(scene)?, Target::Run)?;
        let retrieval = run(&plan, &Silent)?.retrieval;
        Ok(retrieval.map_or_else(Vec::new, |retrieval| retrieval.rows))
    }

    fn row(&self, row: &RetrievalRow, method: usize) -> Row {
        let found = row.found.as_ref().map(|vortex| vortex.circulation_m2_s);
        let true_m2_s = row.truth.circulation_m2_s.value;
        Row {
            dissipation_m2_s3: self.dissipation_m2_s3,
            snr_db: self.snr_db,
            method,
            scan: row.realisation,
            error_m2_s: found.map_or(f64::NAN, |gamma| gamma.value - true_m2_s),
            stated_m2_s: found.map_or(f64::NAN, |gamma| gamma.std),
            detected_m2_s: UNKNOWN,
        }
    }

    /// What the test for a wake detects in the turbulence of one scan; `empty_scans` are drawn for its threshold.
    fn detected(&self, empty_scans: usize) -> Result<Row, Failure> {
        let mut scene = self.scene(TESTED)?;
        scene.retrieval = None;
        scene.scan.realisations = 1;
        let plan = Plan::new(self.context.scene_file(scene)?, Target::Map)?;
        let mut maps = Vec::new();
        for velocity_m_s in velocities(&plan, &Silent)? {
            maps.push(ScanMap {
                elevation_rad: plan.geometry.elevation_rad.clone(),
                time_s: plan.geometry.line_time_s.clone(),
                range_m: plan.geometry.gate_range_m.clone(),
                velocity_m_s,
                sigma_m_s: None,
                fold_m_s: None,
            });
        }
        let settings = DetectionSettings {
            gate: gate_of(None, None, Some(plan.scene()))?.0,
            options: DetectorOptions {
                turbulence: Some(Turbulence::OfScan),
                ..DetectorOptions::default()
            },
            seed: plan.scene().seed,
            empty_scans,
            ..DetectionSettings::default()
        };
        let (_, calibration) = detect(&maps, &settings, &Silent)?;
        let lacking = || Failure::new("no scan to detect a wake in".to_owned());
        let power = calibration.ok_or_else(lacking)?.power(&settings, &Silent)?;
        Ok(Row {
            dissipation_m2_s3: self.dissipation_m2_s3,
            snr_db: self.snr_db,
            method: DETECT,
            scan: 0,
            error_m2_s: f64::NAN,
            stated_m2_s: f64::NAN,
            detected_m2_s: Measured {
                value: power.smallest_m2_s.0,
                std: power.smallest_error_m2_s,
            },
        })
    }
}

/// A row for each vortex of each scan and method, and one for what is detected in each case.
fn table(rows: &[Row]) -> Table {
    Table::new()
        .text("method", column(rows, Row::method_name))
        .int("scan", column(rows, |row| row.scan as i64))
        .float(
            "dissipation_m2_s3",
            column(rows, |row| row.dissipation_m2_s3),
        )
        .float("snr_db", column(rows, |row| row.snr_db))
        .float("gamma_error_m2_s", column(rows, |row| row.error_m2_s))
        .float("gamma_std_m2_s", column(rows, |row| row.stated_m2_s))
        .float("detected_m2_s", column(rows, |row| row.detected_m2_s.value))
        .float(
            "detected_error_m2_s",
            column(rows, |row| row.detected_m2_s.std),
        )
}

fn picture(levels_db: &[f64], cases: &[Case], detected: &[Row]) -> Figure {
    let mut panels = Vec::with_capacity(levels_db.len() + 1);
    for &snr_db in levels_db {
        let title = format!("Γ at {snr_db} dB: errors, and standard errors (dashed)");
        panels.push(errors(
            &title,
            cases.iter().filter(|case| case.snr_db == snr_db),
        ));
    }
    let edr = Axis::log("EDR [m^(2/3)/s]");
    let circulation = Axis::log("circulation [m²/s]");
    let mut plot = CurvePlot::new("Detected with probability 0.9", edr, circulation);
    for (colour, &snr_db) in levels_db.iter().enumerate() {
        let mut points = Vec::new();
        for case in detected.iter().filter(|case| case.snr_db == snr_db) {
            let Measured { value, std } = case.detected_m2_s;
            points.push((case.dissipation_m2_s3.cbrt(), Estimate::stated(value, std)));
        }
        let name = format!("{snr_db} dB");
        plot = plot.with(banded(&name, Style::LineMarkers, points).in_colour(colour));
    }
    panels.push(plot);
    Figure::stacked(panels)
}

/// Errors of each method, and what it states of them, against the dissipation rate.
fn errors<'c>(title: &str, cases: impl Iterator<Item = &'c Case> + Clone) -> CurvePlot {
    let edr = Axis::log("EDR [m^(2/3)/s]");
    let mut plot = CurvePlot::new(title, edr, Axis::log("root mean square [m²/s]"));
    for (method, name) in METHODS.into_iter().enumerate() {
        let mut errors = Vec::new();
        let mut stated = Vec::new();
        for case in cases.clone().filter(|case| case.method == method) {
            errors.push((case.edr_m23_s(), case.rms_error()));
            stated.push((case.edr_m23_s(), case.rms_stated()));
        }
        plot = plot.with(banded(name, Style::LineMarkers, errors).in_colour(method));
        plot = plot.with(banded("", Style::Dash, stated).in_colour(method));
    }
    plot
}

/// By how much stronger turbulence raises the circulation that is detected, at each level.
fn rises(detected: &[Row]) -> Vec<Part> {
    let mut parts = Vec::new();
    for weak in detected
        .iter()
        .filter(|case| case.dissipation_m2_s3 == WEAK_M2_S3)
    {
        let strong = detected.iter().rfind(|case| case.snr_db == weak.snr_db);
        if let Some(strong) = strong {
            let [of_weak, of_strong] = [weak, strong].map(|case| case.detected_m2_s);
            let ratio = of_strong.value / of_weak.value;
            let relative = (of_weak.std / of_weak.value).hypot(of_strong.std / of_strong.value);
            let ratio = Estimate::stated(ratio, ratio * relative);
            parts.push(Part::new(format!("{} dB", weak.snr_db), ratio, "", RISES));
        }
    }
    parts
}

fn claims(cases: &[Case]) -> Vec<Claim> {
    let mut stated = Vec::new();
    for case in cases.iter().filter(|case| case.method == OF_SCAN) {
        stated.push(Part::new(
            case.name(),
            case.stated_over_scatter(),
            "",
            STATED,
        ));
    }
    vec![Claim::judged("CT1", &stated)]
}
