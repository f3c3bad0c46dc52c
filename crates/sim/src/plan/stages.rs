//! The stages of a run but the optics and the files: what each does, and the numbers that it holds.

use super::files::files;
use super::sizes::{MAP_FIELDS, Sizes, is_calm};
use super::stage::{PlannedStage, Target, run, skip};
use crate::measure::sizes::{AIRS_BYTES, records_at_once};
use crate::plan::Setup;
use crate::plan::geometry::Geometry;
use crate::progress::Stage;
use crate::scene::{Method, NoiseModel, RegionRadius, RetrievalMethod, Scene, WindOfPulses};

/// Numbers of a cell that fits hold.
const RETRIEVED_NUMBERS: f64 = 60.0;

/// All stages, in the order in which they run.
pub(super) fn stages(
    setup: &Setup,
    target: Target,
    n: &Sizes,
    optics: [PlannedStage; 2],
) -> Vec<PlannedStage> {
    let (scene, g) = (&setup.scene.content, &setup.geometry);
    let mut out = vec![
        skip(Stage::FlowSimulation, &setup.wind.source),
        cross_plane(scene, target),
    ];
    out.extend(optics);
    if target == Target::Efficiency {
        let rest = [
            Stage::LinesOfSight,
            Stage::Signals,
            Stage::Noise,
            Stage::Estimates,
            Stage::Errors,
        ];
        out.extend(rest.map(|stage| skip(stage, "not asked for")));
    } else {
        out.extend([lines_of_sight(g, n), signals(scene, g, n), noise(scene, n)]);
        out.extend(match target {
            Target::Signal => [
                skip(Stage::Estimates, "not asked for"),
                skip(Stage::Errors, "not asked for"),
            ],
            _ => {
                let truth = format!(
                    "against v_pulse (28) and v_gate over {} realisations",
                    n.realisations
                );
                [estimates(scene, g, n), run(Stage::Errors, truth, [0.0; 2])]
            }
        });
    }
    out.extend(retrieval(scene, target, n));
    out.push(files(scene, target, g, n));
    out
}

/// Vortices of every realisation, if the scene asks for them.
fn retrieval(scene: &Scene, target: Target, n: &Sizes) -> Option<PlannedStage> {
    let wanted = scene.retrieval.as_ref().filter(|_| target == Target::Run)?;
    let has = |method| wanted.methods.contains(&method);
    let signals = if has(RetrievalMethod::Signals) || has(RetrievalMethod::Envelope) {
        3.0
    } else {
        0.0
    };
    let working = n.cells * 8.0 * (n.realisations + RETRIEVED_NUMBERS)
        + signals * n.records * n.samples * n.parts * 8.0;
    let names: Vec<&str> = wanted.methods.iter().map(|method| method.name()).collect();
    let reason = format!("{} scans by {}", n.realisations, names.join(", "));
    let kept = n.realisations * wanted.methods.len() as f64 * 600.0;
    Some(run(Stage::Retrieval, reason, [working, kept]))
}

fn cross_plane(scene: &Scene, target: Target) -> PlannedStage {
    if target != Target::Run || !scene.outputs.flow {
        return skip(Stage::CrossPlane, "not asked for");
    }
    if is_calm(scene) {
        return skip(Stage::CrossPlane, "flow.kind is \"calm\"");
    }
    let (ny, nz) = crate::measure::sizes::PLANE_POINTS;
    let points = (ny * nz) as f64;
    // Places and velocities are at work; two components are kept.
    run(
        Stage::CrossPlane,
        format!("{ny} x {nz} points"),
        [points * 48.0, points * 16.0],
    )
}

fn lines_of_sight(g: &Geometry, n: &Sizes) -> PlannedStage {
    let reason = format!(
        "{} lines of {} layers of {:.3} m",
        n.lines, g.layers, g.layer_thickness_m
    );
    // Places and velocities of the lines at work.
    let bytes = air_bytes(n) + n.threads * n.layers * 64.0;
    run(Stage::LinesOfSight, reason, [bytes, 0.0])
}

/// What signals are made of, held while they are made: velocity and weight of each layer, and efficiencies where pulses have
/// their own.
fn air_bytes(n: &Sizes) -> f64 {
    8.0 * n.layers * (2.0 * n.lines + n.drawn)
}

/// What is held while signals are made: the air, the plans of carrier and noise, and for each thread the layers and the
/// transforms of a record; a piece of records.
fn scan_bytes(g: &Geometry, n: &Sizes) -> f64 {
    let of_thread = n.layers * 48.0 + n.samples * 100.0;
    let at_once =
        records_at_once::<f64>(g.samples * n.parts as usize, n.records.min(1e15) as usize) as f64;
    air_bytes(n)
        + n.samples * 80.0
        + n.threads * of_thread
        + at_once * (n.samples * n.parts * 8.0 + 64.0)
}

fn signals(scene: &Scene, g: &Geometry, n: &Sizes) -> PlannedStage {
    let reason = format!(
        "{} x {} records of {} samples, {} layers each",
        n.realisations, n.records, g.samples, g.layers_per_sample
    );
    let kept_line_bytes = if n.kept > 0.0 {
        n.lines * n.layers * 8.0
    } else {
        0.0
    };
    let kept_bytes = n.kept * n.records * n.samples * n.parts * 8.0 + kept_line_bytes;
    // The echo of the pulse before is made of lines of its own.
    let before = if scene.scan.second_trip.is_some() {
        16.0 * n.layers * n.lines
    } else {
        0.0
    };
    // Pulses with airs of their own: a piece of airs.
    let airs = if scene.scan.wind_of_pulses == WindOfPulses::default() {
        0.0
    } else {
        AIRS_BYTES
    };
    run(
        Stage::Signals,
        reason,
        [scan_bytes(g, n) + before + airs, kept_bytes],
    )
}

fn noise(scene: &Scene, n: &Sizes) -> PlannedStage {
    if scene.detector.noise == NoiseModel::None {
        return skip(Stage::Noise, "detector.noise is \"none\"");
    }
    let values = n.realisations * n.records * n.samples * n.parts;
    run(Stage::Noise, format!("{values} samples"), [0.0; 2])
}

fn estimates(scene: &Scene, g: &Geometry, n: &Sizes) -> PlannedStage {
    let e = &scene.estimator;
    let reason = format!(
        "{} x {} gates, {}",
        n.lines,
        g.gate_range_m.len(),
        e.regions()
    );
    let sums_bytes = n.lines * n.windows * n.numbers * 8.0;
    let (planned_bytes, planning_bytes) = planning(scene, n);
    // Of each point: sums over the realisations, their errors, truth and thresholds; then the velocities of one realisation.
    let scans_bytes = n.cells * n.realisations * SCAN_POINT_BYTES;
    let points_bytes = n.cells * MAPPER_POINT_BYTES + scans_bytes;
    // While windows are added there is a piece of records, while velocities are sought there are sums over blocks of windows.
    let air = air_bytes(n);
    let adding = scan_bytes(g, n) + sums_bytes;
    let seeking = air + sums_bytes * 1.125 + n.lines * n.windows * 8.0 + n.cells * MAP_POINT_BYTES;
    let at_work = adding.max(seeking) + points_bytes + planned_bytes;
    let working = at_work.max(air + planning_bytes);
    run(
        Stage::Estimates,
        reason,
        [working, n.cells * MAP_FIELDS * 8.0 + scans_bytes],
    )
}

/// Of a point of the map: sums over the realisations, truth, thresholds.
const MAPPER_POINT_BYTES: f64 = 200.0;
/// Of a point and a realisation: the error, and whether it was flagged.
const SCAN_POINT_BYTES: f64 = 9.0;
/// Of a point of the map of one realisation: the estimate.
const MAP_POINT_BYTES: f64 = 88.0;

/// What is prepared once, tapers from a covariance and weights of the lags: the memory of what comes of it, and that which it takes,
/// bytes.
fn planning(scene: &Scene, n: &Sizes) -> (f64, f64) {
    let matrix_bytes = n.window.powi(2) * 8.0;
    let (kept_matrices, matrices) = match scene.estimator.method {
        Method::Likelihood { .. } => (1.0, 8.0),
        _ => (0.0, 0.0),
    };
    let has_bound = matches!(scene.estimator.radius, RegionRadius::Target { .. });
    let bound_bytes = if has_bound { bound_bytes(n) } else { 0.0 };
    let kept_bytes = kept_matrices * matrix_bytes + n.frequencies * 32.0;
    (
        kept_bytes,
        kept_bytes + bound_bytes.max(matrices * matrix_bytes),
    )
}

/// Matrices of the bound of a record: the signal, the covariance and its derivative, its factor, a turned copy.
fn bound_bytes(n: &Sizes) -> f64 {
    6.0 * 8.0 * n.chord.powi(2)
}

/// What is held for the Cramer-Rao bound in place of a run of these stages: that of the air and the matrices of a record.
pub(super) fn of_bound(stages: &[PlannedStage], n: &Sizes) -> Vec<PlannedStage> {
    let first = [Stage::PhaseScreens, Stage::Efficiency, Stage::LinesOfSight];
    let mut out: Vec<PlannedStage> = stages
        .iter()
        .filter(|s| first.contains(&s.stage))
        .cloned()
        .collect();
    out.push(run(
        Stage::Estimates,
        String::new(),
        [air_bytes(n) + bound_bytes(n), 0.0],
    ));
    out
}
