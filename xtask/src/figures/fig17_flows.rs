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

/// Ages of the simulated wake; the pair has none.
const AGES: [Option<f64>; 4] = [None, Some(1.0), Some(2.5), Some(4.0)];
/// The method that is judged: what `[retrieval]` does unless it is told otherwise.
const JUDGED: &str = "fit";
const METHODS: [Method; 4] = [Method::Fit, Method::Rv, Method::Envelope, Method::Signals];
/// The operational method on what it is made for: radial velocities that are means over the gate, which peaks of spectra are not.
const OF_MEANS: &str = "rv of first moments";

/// All rows by name, in their order.
fn names() -> impl Iterator<Item = &'static str> {
    METHODS.into_iter().map(Method::name).chain([OF_MEANS])
}
const SNR_DB: f64 = 10.0;

/// All methods on one flow.
pub(super) struct OfFlow {
    tau: Option<f64>,
    rows: Vec<(&'static str, RetrievalRow)>,
}

impl OfFlow {
    fn name(&self) -> String {
        self.tau.map_or("analytic pair".into(), |tau| {
            format!("simulated wake, tau = {tau}")
        })
    }

    /// Errors of the circulation over 5 to 15 m in per cent of the truth, how many vortices are missing, and the mean of the errors, each scan
    /// a batch.
    fn errors(&self, method: &str) -> (Vec<f64>, usize, Estimate) {
        let rows: Vec<&RetrievalRow> = self
            .rows
            .iter()
            .filter(|(name, _)| *name == method)
            .map(|(_, row)| row)
            .collect();
        let error = |row: &&RetrievalRow| {
            let error = 100.0
                * (row.found?.circulation_5_15_m2_s.value / row.truth.circulation_5_15_m2_s.value
                    - 1.0);
            error.is_finite().then_some(error)
        };
        let scans = rows.chunk_by(|a, b| a.realisation == b.realisation);
        let scans: Vec<Vec<f64>> = scans
            .map(|scan| scan.iter().filter_map(error).collect())
            .collect();
        let means = scans
            .iter()
            .filter(|errors| !errors.is_empty())
            .map(|errors| mean(errors, None));
        let (known, bias) = (scans.concat(), Estimate::mean(&means.collect::<Vec<_>>()));
        let missing = rows.len() - known.len();
        (known, missing, bias)
    }
}

pub(super) fn all(context: &Context) -> Result<Vec<OfFlow>, Failure> {
    let wake = wakes::of(context)?;
    AGES.par_iter()
        .map(|tau| of_flow(context, *tau, &wake))
        .collect()
}

fn of_flow(context: &Context, tau: Option<f64>, wake: &FinishedWake) -> Result<OfFlow, Failure> {
    let pair = || Ok(Sight::of_pair(VortexPair::default()));
    let sight = tau.map_or_else(pair, |tau| Sight::of_wake(wake, tau))?;
    let mut scene = sight.scene(
        context,
        Scene {
            seed: 0,
            ..scene()?
        },
    );
    if context.profile != Profile::Quick {
        (
            scene.scan.elevation_step_rad,
            scene.estimator.gate_step_samples,
        ) = (1.25e-3, 5);
    }
    scene.scan.realisations = context.profile.choose(3, 12, 32);
    // Signals take longest: the fits of all samples of the pair are in the other part of the figure.
    let some = METHODS[..context.profile.choose(4, 4, 5)].to_vec();
    let by = |scene: &Scene, methods| {
        retrieved(
            scene,
            Retrieval {
                methods,
                ..Retrieval::default()
            },
            &sight.folder,
        )
    };
    let mut rows: Vec<_> = by(&scene, some)?
        .into_iter()
        .map(|row| (row.method.name(), row))
        .collect();
    scene.estimator.method = Estimator::FirstMoment(FirstMoment::default());
    scene.estimator.weighting = Weighting::Rectangular;
    rows.extend(
        by(&scene, vec![Method::Rv])?
            .into_iter()
            .map(|row| (OF_MEANS, row)),
    );
    Ok(OfFlow { tau, rows })
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

/// Rows as those of the first part; positions have no stated deviation there where the method states none.
pub(super) fn table(flows: &[OfFlow]) -> Table {
    let rows: Vec<((&OfFlow, &str), &RetrievalRow)> = flows
        .iter()
        .flat_map(|flow| {
            flow.rows
                .iter()
                .map(move |(name, row)| ((flow, *name), row))
        })
        .collect();
    let float = |get: &dyn Fn(&RetrievalRow) -> Option<f64>| -> Vec<f64> {
        rows.iter()
            .map(|(_, row)| get(row).unwrap_or(f64::NAN))
            .collect()
    };
    let found = |get: fn(&VortexResult) -> f64| {
        float(&move |row: &RetrievalRow| row.found.as_ref().map(get))
    };
    Table::new()
        .text("flow", rows.iter().map(|((flow, _), _)| flow.name()))
        .int("scan", rows.iter().map(|(_, row)| row.realisation as i64))
        .text("method", rows.iter().map(|((_, name), _)| *name))
        .float(
            "gamma_true_m2_s",
            float(&|row| Some(row.truth.circulation_5_15_m2_s.value)),
        )
        .float("gamma_m2_s", found(|v| v.circulation_5_15_m2_s.value))
        .float("gamma_std_m2_s", found(|v| v.circulation_5_15_m2_s.std))
        .float(
            "y_error_m",
            float(&|row| {
                Some(row.found?.lateral_position_m.value - row.truth.lateral_position_m.value)
            }),
        )
        .float(
            "z_error_m",
            float(&|row| Some(row.found?.height_m.value - row.truth.height_m.value)),
        )
        .text("vortex", rows.iter().map(|(_, row)| name(row.truth.side)))
        .float("y_std_m", found(|v| v.lateral_position_m.std))
        .float("z_std_m", found(|v| v.height_m.std))
        .float("snr_db", rows.iter().map(|_| SNR_DB))
}

/// Errors of the circulations over 5 to 15 m by age, the pair at 0.
pub(super) fn picture(flows: &[OfFlow]) -> CurvePlot {
    let title = "all methods: bias and scatter of Γ_{5-15} (age 0: analytic pair)";
    let mut plot = CurvePlot::new(title, Axis::linear("τ"), Axis::linear("error [%]"));
    for (k, name) in names().enumerate() {
        let known = flows
            .iter()
            .map(|flow| (flow.tau.unwrap_or(0.0), flow.errors(name).0));
        let points: Vec<(f64, Vec<f64>)> = known.filter(|(_, errors)| !errors.is_empty()).collect();
        if points.is_empty() {
            continue;
        }
        let scatter =
            |errors: &[f64]| Estimate::stated(mean(errors, None), Estimate::deviation(errors));
        let points = points
            .iter()
            .map(|(tau, errors)| (tau + 0.05 * (k as f64 - 2.0), scatter(errors)));
        plot = plot.with(banded(name, Style::Markers, points).in_colour(k));
    }
    plot.with(Series::new("", Style::Dash, [(-0.2, 0.0), (4.2, 0.0)]).in_colour(6))
}

pub(super) fn claims(flows: &[OfFlow]) -> Vec<Claim> {
    let ids = ["F17g", "F17h", "F17i", "F17j"];
    ids.into_iter()
        .zip(flows)
        .map(|(id, flow)| claim(id, flow))
        .collect()
}

/// The bias of the method that is judged; all are told.
fn claim(id: &str, flow: &OfFlow) -> Claim {
    let others = names()
        .filter(|name| *name != JUDGED)
        .map(|name| (name, flow.errors(name)));
    let told = others.filter(|(_, (errors, ..))| !errors.is_empty()).map(
        |(name, (errors, failures, bias))| {
            let scatter = Estimate::deviation(&errors);
            format!(
                "{name} {} %, scatter {scatter:.1} %, {failures} failed",
                bias.words()
            )
        },
    );
    let (_, failures, bias) = flow.errors(JUDGED);
    let words = format!("{failures} failed; {}", told.collect::<Vec<_>>().join("; "));
    Claim::judged_alone(id, bias, " %", Bar::Between(-5.0, 5.0)).of_fits(failures, &words)
}
