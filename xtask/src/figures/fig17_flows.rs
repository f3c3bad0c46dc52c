//! Figure 17, all methods side by side: the scenes of the analytic pair and of the simulated wake at several ages, retrieved as `run` does it.

use super::context::*;
use super::study::Sight;
use crate::statistics::mean;
use crate::wakes;
use rayon::prelude::*;
use std::path::Path;
use wakescope_estimate::retrieval::VortexResult;
use wakescope_sim::retrieve::{Method, RetrievalRow, name};
use wakescope_sim::scene::{FirstMoment, Method as Estimator, Retrieval, VortexPair, Weighting};

/// Age of the simulated wake, of which the pair has none, and the claim on the flow.
type Aged = (Option<f64>, &'static str);
const AGES: [Aged; 4] = [
    (None, "F17g"),
    (Some(1.0), "F17h"),
    (Some(2.5), "F17i"),
    (Some(4.0), "F17j"),
];
/// Of these the profile quick has every second one.
const QUICK_STEP: usize = 2;
/// The method that is judged: what `[retrieval]` does unless it is told otherwise.
const JUDGED: &str = "fit";
const METHODS: [Method; 4] = [Method::Fit, Method::Rv, Method::Envelope, Method::Signals];
/// The operational method on what it is made for: radial velocities that are means over the gate, which peaks of spectra are not.
const OF_MEANS: &str = "rv of first moments";

/// The methods of a profile: signals, whose fits need the longest run time, in full alone, since the fits of all samples of the
/// pair are in the other part of the figure.
fn methods(profile: Profile) -> &'static [Method] {
    match profile {
        Profile::Quick | Profile::Standard => &METHODS[..METHODS.len() - 1],
        Profile::Full => &METHODS,
    }
}

/// All rows by name, in their order.
fn names() -> impl Iterator<Item = &'static str> {
    METHODS.into_iter().map(Method::name).chain([OF_MEANS])
}
const SNR_DB: f64 = 10.0;

/// All methods on one flow.
pub(super) struct OfFlow {
    tau: Option<f64>,
    claim: &'static str,
    rows: Vec<(&'static str, RetrievalRow)>,
}

impl OfFlow {
    fn name(&self) -> String {
        self.tau.map_or("analytic pair".into(), |tau| {
            format!("simulated wake, tau = {tau}")
        })
    }

    /// The rows of a method.
    fn of_method(&self, method: &str) -> Vec<&RetrievalRow> {
        let mut rows = Vec::new();
        for (name, row) in &self.rows {
            if *name == method {
                rows.push(row);
            }
        }
        rows
    }

    /// Errors of the vortices that a method found, by scans in which there are some.
    fn errors_percent(&self, method: &str) -> Vec<Vec<f64>> {
        let mut errors = Vec::new();
        let rows = self.of_method(method);
        for scan in rows.chunk_by(|a, b| a.realisation == b.realisation) {
            errors.push(scan.iter().filter_map(|row| error_percent(row)).collect());
        }
        errors.retain(|scan: &Vec<f64>| !scan.is_empty());
        errors
    }

    /// Vortices that a method did not find.
    fn missing(&self, method: &str) -> usize {
        let rows = self.of_method(method);
        rows.iter()
            .filter(|row| error_percent(row).is_none())
            .count()
    }
}

/// Mean error, each scan a batch.
fn bias(errors_percent: &[Vec<f64>]) -> Estimate {
    Estimate::mean(&column(errors_percent, |scan| mean(scan, None)))
}

/// Error of the circulation over 5 to 15 m in per cent of the truth; none of a vortex that was not found.
fn error_percent(row: &RetrievalRow) -> Option<f64> {
    let found_m2_s = row.found?.circulation_5_15_m2_s.value;
    let error = 100.0 * (found_m2_s / row.truth.circulation_5_15_m2_s.value - 1.0);
    error.is_finite().then_some(error)
}

pub(super) fn all(context: &Context) -> Result<Vec<OfFlow>, Failure> {
    let wake = wakes::of(context)?;
    AGES.par_iter()
        .step_by(context.profile.choose(QUICK_STEP, 1, 1))
        .map(|aged| of_flow(context, *aged, &wake))
        .collect()
}

fn of_flow(context: &Context, (tau, claim): Aged, wake: &FinishedWake) -> Result<OfFlow, Failure> {
    let sight = match tau {
        Some(tau) => Sight::of_wake(wake, tau)?,
        None => Sight::of_pair(VortexPair::default()),
    };
    let scene = Scene {
        seed: 0,
        ..scene()?
    };
    let mut scene = sight.scene(context, scene);
    if context.profile != Profile::Quick {
        scene.scan.elevation_step_rad = 1.25e-3;
        scene.estimator.gate_step_samples = 5;
    }
    scene.scan.realisations = context.profile.choose(2, 12, 32);
    let retrieval = Retrieval {
        methods: methods(context.profile).to_vec(),
        ..Retrieval::default()
    };
    let mut rows = Vec::new();
    for row in retrieved(&scene, retrieval, &sight.folder)? {
        rows.push((row.method.name(), row));
    }
    scene.estimator.method = Estimator::FirstMoment(FirstMoment::default());
    scene.estimator.weighting = Weighting::Rectangular;
    let of_means = Retrieval {
        methods: vec![Method::Rv],
        ..Retrieval::default()
    };
    for row in retrieved(&scene, of_means, &sight.folder)? {
        rows.push((OF_MEANS, row));
    }
    Ok(OfFlow { tau, claim, rows })
}

/// The scan, of which quick has all.
pub(crate) fn scene() -> Result<Scene, Failure> {
    Ok(SceneFile::parse(include_str!("retrieved.toml"), Path::new("retrieved.toml"))?.content)
}

/// What retrievals find in the scans of a scene beside a wake.
pub(crate) fn retrieved(
    scene: &Scene,
    retrieval: Retrieval,
    wake: &Path,
) -> Result<Vec<RetrievalRow>, Failure> {
    let scene = Scene {
        retrieval: Some(retrieval),
        ..scene.clone()
    };
    let file = SceneFile::parse(&scene.to_toml(), &wake.join("scene.toml"))?;
    let result = wakescope_sim::run(&Plan::new(file, Target::Run)?, &Silent)?;
    Ok(result
        .retrieval
        .ok_or_else(|| Failure::new("a run without retrievals".into()))?
        .rows)
}

/// A number of the vortex that was found; NaN of one that was not.
fn found(row: &RetrievalRow, number: impl Fn(&VortexResult) -> f64) -> f64 {
    row.found.as_ref().map_or(f64::NAN, number)
}

/// Rows as those of the first part; positions have no standard deviation where the method reports none.
pub(super) fn table(flows: &[OfFlow]) -> Table {
    let mut flow_name = Vec::new();
    let mut scan = Vec::new();
    let mut snr_db = Vec::new();
    let mut methods = Vec::new();
    let mut gamma_true = Vec::new();
    let mut gamma = Vec::new();
    let mut gamma_std = Vec::new();
    let mut y_error = Vec::new();
    let mut y_std = Vec::new();
    let mut z_error = Vec::new();
    let mut z_std = Vec::new();
    let mut vortex = Vec::new();
    for flow in flows {
        for (method, row) in &flow.rows {
            let true_y_m = row.truth.lateral_position_m.value;
            let true_z_m = row.truth.height_m.value;
            flow_name.push(flow.name());
            scan.push(row.realisation as i64);
            snr_db.push(SNR_DB);
            methods.push(*method);
            gamma_true.push(row.truth.circulation_5_15_m2_s.value);
            gamma.push(found(row, |v| v.circulation_5_15_m2_s.value));
            gamma_std.push(found(row, |v| v.circulation_5_15_m2_s.std));
            y_error.push(found(row, |v| v.lateral_position_m.value - true_y_m));
            y_std.push(found(row, |v| v.lateral_position_m.std));
            z_error.push(found(row, |v| v.height_m.value - true_z_m));
            z_std.push(found(row, |v| v.height_m.std));
            vortex.push(name(row.truth.side));
        }
    }
    Table::new()
        .text("flow", flow_name)
        .int("scan", scan)
        .text("method", methods)
        .float("gamma_true_m2_s", gamma_true)
        .float("gamma_m2_s", gamma)
        .float("gamma_std_m2_s", gamma_std)
        .float("y_error_m", y_error)
        .float("z_error_m", z_error)
        .text("vortex", vortex)
        .float("y_std_m", y_std)
        .float("z_std_m", z_std)
        .float("snr_db", snr_db)
}

/// Errors of the circulations over 5 to 15 m by age, the pair at 0.
pub(super) fn picture(flows: &[OfFlow]) -> CurvePlot {
    let title = "all methods: bias and scatter of Γ_{5-15} (age 0: analytic pair)";
    let mut plot = CurvePlot::new(title, Axis::linear("τ"), Axis::linear("error [%]"));
    for (k, name) in names().enumerate() {
        let mut points = Vec::new();
        for flow in flows {
            let errors = flow.errors_percent(name).concat();
            if errors.is_empty() {
                continue;
            }
            let scatter = Estimate::stated(mean(&errors, None), Estimate::deviation(&errors));
            let x = flow.tau.unwrap_or(0.0) + 0.05 * (k as f64 - 2.0);
            points.push((x, scatter));
        }
        if !points.is_empty() {
            plot = plot.with(banded(name, Style::Markers, points).in_colour(k));
        }
    }
    plot.with(Series::new("", Style::Dash, [(-0.2, 0.0), (4.2, 0.0)]).in_colour(6))
}

pub(super) fn claims(flows: &[OfFlow]) -> Vec<Claim> {
    flows.iter().map(claim).collect()
}

/// The bias of the method that is judged; all are reported.
fn claim(flow: &OfFlow) -> Claim {
    let missing = flow.missing(JUDGED);
    let mut others = Vec::new();
    for name in names() {
        let errors = flow.errors_percent(name);
        if name == JUDGED || errors.is_empty() {
            continue;
        }
        others.push(format!(
            "{name} {} %, scatter {:.1} %, {} failed",
            bias(&errors).words(),
            Estimate::deviation(&errors.concat()),
            flow.missing(name)
        ));
    }
    let words = format!("{missing} failed; {}", others.join("; "));
    let bias = bias(&flow.errors_percent(JUDGED));
    Claim::judged_alone(flow.claim, bias, " %", Bar::Between(-5.0, 5.0)).of_fits(missing, &words)
}
