//! Figure 23, beyond the chapter: dissipation rate of simulated RHI scans and wind of cones, as they are and as `wakescope wind` finds
//! them.

use super::context::*;
use rayon::prelude::*;
use std::path::Path;
use wakescope_sim::run::run;
use wakescope_sim::wind::{WindOptions, WindProfiles, winds_of_map};
use wakescope_sim::write::velocity_map;

/// Dissipation rates \[m²/s³\]: still, moderate and strong turbulence near an airport, and those that `full` adds.
const DISSIPATIONS_M2_S3: [f64; 3] = [4e-5, 5e-4, 1.45e-2];
const MORE_M2_S3: [f64; 2] = [1e-5, 3e-3];

/// One layer holds the whole scan: a dissipation rate is not negative, and the mean over layers dominated by noise is too large.
const WHOLE_M: f64 = 1e4;

/// The ratio of mean eps^(2/3) that is found to the true one: peaks of spectra raise it by some percent.
const FOUND: Bar = Bar::Between(0.97, 1.14);

/// Errors of the wind over their stated deviations.
const STATED: Bar = Bar::Between(0.75, 1.3);

/// Scans at 0 dB in a wind that grows linearly with height, as the fit assumes, so that no shear is taken for turbulence.
const SCENE: &str = r#"
[detector.snr]
reference = "fixed"
snr_db = 0.0
[flow]
kind = "wind"
profile = "power"
exponent = 1.0
speed_m_s = 5.0
reference_height_m = 400.0
toward_rad = 1.0
[[added_flows]]
kind = "eddies"
dissipation_m2_s3 = DISSIPATION
outer_scale_m = 60.0
[estimator]
gate_step_samples = 64
radius_m = 0.0
[scan]
realisations = 1
"#;

/// A cone of 24 beams at 60 degrees, which shows the wind.
const CONE: &str = r#"
pattern = { kind = "vad", elevation_rad = 1.0471975511965976, beams = 24 }
range_min_m = 90.0
range_max_m = 960.0
"#;

/// An RHI of 43 lines and 11 ranges, whose neighbouring lines show the turbulence.
const RHI: &str = r#"
elevation_min_rad = 0.04
elevation_max_rad = 0.208
elevation_step_rad = 4e-3
range_min_m = 300.0
range_max_m = 690.0
"#;

/// A cone and an RHI in the same air.
struct Scans {
    /// eps^(2/3) of the RHI \[m^(4/3)/s²\].
    eps23: f64,
    /// Of the cone, mean square of the errors of the east and north wind over their stated deviations.
    reduced_square: f64,
    /// Of the cone, speed at the middle height, found and true \[m/s\].
    speed_m_s: [f64; 2],
}

impl Scans {
    fn new(rhi: &WindProfiles, cone: &WindProfiles) -> Self {
        let rows = &cone.rows;
        let mut squares = Vec::new();
        for (row, true_m_s) in rows.iter().zip(&cone.true_m_s) {
            for (found, true_m_s) in [row.east_m_s, row.north_m_s].into_iter().zip(true_m_s) {
                let reduced = (found.value - true_m_s) / found.std;
                if reduced.is_finite() {
                    squares.push(reduced * reduced);
                }
            }
        }
        let middle = rows.len() / 2;
        let [east_m_s, north_m_s, _] = cone.true_m_s[middle];
        Self {
            eps23: mean_eps23(rhi),
            reduced_square: mean(&squares, None),
            speed_m_s: [rows[middle].speed_m_s.value, east_m_s.hypot(north_m_s)],
        }
    }
}

/// Mean over heights, which share one layer.
fn mean_eps23(winds: &WindProfiles) -> f64 {
    let mut eps23 = Vec::new();
    for row in &winds.rows {
        if row.edr_m23_s.is_finite() {
            eps23.push(row.edr_m23_s.powi(2));
        }
    }
    mean(&eps23, None)
}

/// The scans of one dissipation rate.
struct Row {
    dissipation_m2_s3: f64,
    scans: Vec<Scans>,
}

impl Row {
    fn eps23(&self) -> Estimate {
        Estimate::mean(&column(&self.scans, |scan| scan.eps23))
    }

    fn ratio(&self) -> Estimate {
        self.eps23().times(self.dissipation_m2_s3.powf(-2.0 / 3.0))
    }

    fn reduced_rms(&self) -> Estimate {
        let squares = column(&self.scans, |scan| scan.reduced_square);
        Estimate::of(squares.len(), |without| mean(&squares, without).sqrt())
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let scans = context.profile.choose(8, 60, 60);
    let mut dissipations_m2_s3 = DISSIPATIONS_M2_S3.to_vec();
    if context.profile == Profile::Full {
        dissipations_m2_s3.extend(MORE_M2_S3);
        dissipations_m2_s3.sort_by(f64::total_cmp);
    }
    let mut rows = Vec::new();
    for dissipation_m2_s3 in dissipations_m2_s3 {
        let text = SCENE.replace("DISSIPATION", &format!("{dissipation_m2_s3:?}"));
        let found: Result<Vec<Scans>, Failure> = (0..scans as u64)
            .into_par_iter()
            .map(|scan| {
                let rhi = winds(context, &format!("{text}{RHI}"), scan)?;
                let cone = winds(context, &format!("{text}{CONE}"), scan)?;
                Ok(Scans::new(&rhi, &cone))
            })
            .collect();
        rows.push(Row {
            dissipation_m2_s3,
            scans: found?,
        });
    }
    let origin = context.provenance_of_formula(&format!("{SCENE}{RHI}{CONE}"));
    let mut out = Rendered::new(&table(&rows), &picture(&rows), &origin)?;
    out.values = vec![scans.to_string()];
    let mut found = Vec::new();
    let mut stated = Vec::new();
    for row in &rows {
        let name = format!("{:e} m²/s³", row.dissipation_m2_s3);
        found.push(Part::new(name.clone(), row.ratio(), "", FOUND));
        stated.push(Part::new(name, row.reduced_rms(), "", STATED));
    }
    out.claims = vec![Claim::judged("KA1", &found), Claim::judged("KA2", &stated)];
    Ok(out)
}

/// The winds of one scan.
fn winds(context: &Context, text: &str, scan: u64) -> Result<WindProfiles, Failure> {
    let own = Context {
        seed: context.seed + scan,
        ..context.clone()
    };
    let file = own.scene_file(SceneFile::parse(text, Path::new("scan.toml"))?.content)?;
    let plan = Plan::new(file, Target::Map)?;
    let estimates = run(&plan, &Silent)?.map;
    let estimates = estimates.ok_or_else(|| Failure::new("the run has no map".into()))?;
    let options = WindOptions {
        layer_m: WHOLE_M,
        ..WindOptions::of_scene(plan.scene())?
    };
    Ok(winds_of_map(
        &plan,
        &velocity_map(&plan, &estimates),
        &options,
    )?)
}

fn table(rows: &[Row]) -> Table {
    let mut lines = Vec::new();
    for row in rows {
        for scan in &row.scans {
            let [found_m_s, true_m_s] = scan.speed_m_s;
            lines.push([
                row.dissipation_m2_s3,
                scan.eps23,
                scan.reduced_square,
                found_m_s,
                true_m_s,
            ]);
        }
    }
    numbers_table(
        "dissipation_m2_s3 eps23_m43_s2 reduced_square speed_m_s speed_true_m_s",
        &lines,
    )
}

fn picture(rows: &[Row]) -> Figure {
    let mut edr = CurvePlot::new(
        "Turbulence",
        Axis::log("EDR of the scene [m^(2/3)/s]"),
        Axis::log("EDR found [m^(2/3)/s]"),
    );
    let mut speed = CurvePlot::new(
        "Speed at the middle height",
        Axis::log("EDR of the scene [m^(2/3)/s]"),
        Axis::linear("speed [m/s]"),
    );
    let mut diagonal = Vec::new();
    let mut means = Vec::new();
    let mut single = Vec::new();
    let mut speeds = [Vec::new(), Vec::new()];
    for row in rows {
        let true_m23_s = row.dissipation_m2_s3.cbrt();
        diagonal.push((true_m23_s, true_m23_s));
        means.push((true_m23_s, row.eps23().value.sqrt()));
        for scan in &row.scans {
            single.push((true_m23_s, scan.eps23.sqrt()));
            for (points, speed_m_s) in speeds.iter_mut().zip(scan.speed_m_s) {
                points.push((true_m23_s, speed_m_s));
            }
        }
    }
    edr = edr.with(Series::new("one scan", Style::Markers, single));
    edr = edr.with(Series::new(
        "root of the mean square",
        Style::LineMarkers,
        means,
    ));
    edr = edr.with(Series::new("equal", Style::Dash, diagonal));
    let [found, truth] = speeds;
    speed = speed.with(Series::new("one scan", Style::Markers, found));
    speed = speed.with(Series::new("mean wind of the scene", Style::Dash, truth));
    Figure::stacked([edr, speed])
}
