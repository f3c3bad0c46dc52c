//! The stages of a run but the optics and the files: what each does, and its cost as a product of sizes and unit costs.
//!
//! The unit costs are those of one core, memory is counted in numbers held; `cargo xtask forecast` compares both with what
//! whole runs take.

use super::files::files;
use super::sizes::{MAP_FIELDS, Sizes, is_calm, keeps_few_lags};
use super::stage::{PlannedStage, Target, run, skip};
use crate::scene::{Flow, Method, NoiseModel, RegionRadius, RetrievalMethod, Scene, WindOfPulses};
use crate::setup::geometry::Geometry;
use crate::setup::progress::Stage;
use crate::setup::sizes::{AIRS_BYTES, records_at_once};
use crate::setup::wind::SceneWind;

// Unit costs on one core, s.
const ANALYTIC_WIND_S: f64 = 7e-8;
const SAMPLED_WIND_S: f64 = 2e-7;
const FIELD_WIND_S: f64 = 8e-7;
const LAYER_OF_RECORD_S: f64 = 5.4e-8;
const LAYER_OF_SAMPLE_S: f64 = 1.2e-10;
const SAMPLE_S: f64 = 4.8e-8;
const NOISE_SAMPLE_S: f64 = 3e-9;
/// Of a window, for each point of its transform times the logarithm of their number.
const TRANSFORM_POINT_S: f64 = 4.2e-10;
const SLIDING_LAG_S: f64 = 2e-9;
const GRADIENT_PAIR_S: f64 = 7e-10;
const SUMMED_NUMBER_S: f64 = 5e-9;
/// Of a covariance that is decomposed, for each sample cubed.
const DECOMPOSED_NUMBER_S: f64 = 4e-8;
const SPECTRUM_LAG_S: f64 = 6e-11;
const SPECTRUM_POINT_S: f64 = 6e-9;
/// Of the square of a model's order.
const POLE_S: f64 = 7.5e-8;
const TRUTH_LAYER_S: f64 = 5e-10;
const FITTED_CELL_S: f64 = 2e-4;
const RV_CELL_S: f64 = 2e-5;
const FITTED_SAMPLE_S: f64 = 3e-4;
/// Of the test for a wake: scans of still air, empty scans.
const TEST_S: f64 = 3.0;
/// Numbers of a cell that fits hold.
const RETRIEVED_NUMBERS: f64 = 60.0;

/// All stages, in the order in which they run.
pub(super) fn stages(
    scene: &Scene,
    target: Target,
    g: &Geometry,
    wind: &SceneWind,
    optics: [PlannedStage; 2],
) -> Vec<PlannedStage> {
    let n = Sizes::new(scene, target, g);
    let mut out = vec![skip(Stage::FlowSimulation, &wind.source), cross_plane(scene, target)];
    out.extend(optics);
    if target == Target::Efficiency {
        let rest = [Stage::LinesOfSight, Stage::Signals, Stage::Noise, Stage::Estimates, Stage::Errors];
        out.extend(rest.map(|stage| skip(stage, "not asked for")));
    } else {
        out.extend([lines_of_sight(scene, g, &n), signals(scene, g, &n), noise(scene, &n)]);
        out.extend(match target {
            Target::Signal => [skip(Stage::Estimates, "not asked for"), skip(Stage::Errors, "not asked for")],
            _ => [estimates(scene, g, &n), errors(scene, g, &n)],
        });
    }
    out.extend(retrieval(scene, target, &n));
    out.push(files(scene, target, g, &n));
    out
}

/// Vortices of every realisation, if the scene asks for them.
fn retrieval(scene: &Scene, target: Target, n: &Sizes) -> Option<PlannedStage> {
    let wanted = scene.retrieval.as_ref().filter(|_| target == Target::Run)?;
    let has = |method| wanted.methods.contains(&method);
    // The fit of the map is made once for all that need it.
    let cell_s = if wanted.methods[..] == [RetrievalMethod::Rv] { RV_CELL_S } else { FITTED_CELL_S };
    let fitted_s = if has(RetrievalMethod::Signals) { n.records * n.samples * FITTED_SAMPLE_S } else { 0.0 };
    let made_anew = has(RetrievalMethod::Signals) || has(RetrievalMethod::Envelope);
    let (signals_s, signals) = if made_anew { (n.records * record_s(n), 3.0) } else { (0.0, 0.0) };
    let scan_s = n.cells * cell_s + signals_s + fitted_s;
    let test_s = if wanted.false_alarm.is_some() { TEST_S } else { 0.0 };
    let working =
        n.cells * 8.0 * (n.realisations + RETRIEVED_NUMBERS) + signals * n.records * n.samples * n.parts * 8.0;
    let names: Vec<&str> = wanted.methods.iter().map(|method| method.name()).collect();
    let reason = format!("{} scans by {}", n.realisations, names.join(", "));
    let kept = n.realisations * wanted.methods.len() as f64 * 600.0;
    Some(run(Stage::Retrieval, reason, n.realisations * scan_s + test_s, [working, kept]))
}

/// Time of the wind at one point, s.
fn wind_point_s(scene: &Scene) -> f64 {
    let of = |flow: &Flow| match flow {
        Flow::Calm {} | Flow::Uniform { .. } | Flow::Linear(_) => 1e-8,
        Flow::VortexPair(_) => ANALYTIC_WIND_S,
        Flow::VortexLines(lines) => 0.5 * ANALYTIC_WIND_S * lines.nodes_m.len() as f64,
        Flow::Simulated(_) => SAMPLED_WIND_S,
        Flow::Fields(_) => FIELD_WIND_S,
    };
    of(&scene.flow) + scene.added_flows.iter().map(of).sum::<f64>()
}

fn cross_plane(scene: &Scene, target: Target) -> PlannedStage {
    if target != Target::Run || !scene.outputs.flow {
        return skip(Stage::CrossPlane, "not asked for");
    }
    if is_calm(scene) {
        return skip(Stage::CrossPlane, "flow.kind is \"calm\"");
    }
    let (ny, nz) = crate::setup::sizes::PLANE_POINTS;
    let points = (ny * nz) as f64;
    // Places and velocities are at work; two components are kept.
    run(Stage::CrossPlane, format!("{ny} x {nz} points"), points * wind_point_s(scene), [points * 48.0, points * 16.0])
}

fn lines_of_sight(scene: &Scene, g: &Geometry, n: &Sizes) -> PlannedStage {
    let reason = format!("{} lines of {} layers of {:.3} m", n.lines, g.layers, g.layer_thickness_m);
    let airs = scene.scan.wind_of_pulses.of_line(scene.scan.pulses_per_line) as f64;
    let points = n.lines * n.layers * airs;
    // Places and velocities of the lines at work.
    let bytes = air_bytes(n) + n.threads * n.layers * 64.0;
    run(Stage::LinesOfSight, reason, points * wind_point_s(scene), [bytes, 0.0])
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
    let at_once = records_at_once::<f64>(g.samples * n.parts as usize, n.records.min(1e15) as usize) as f64;
    air_bytes(n) + n.samples * 80.0 + n.threads * of_thread + at_once * (n.samples * n.parts * 8.0 + 64.0)
}

fn signals(scene: &Scene, g: &Geometry, n: &Sizes) -> PlannedStage {
    let reason = format!(
        "{} x {} records of {} samples, {} layers each",
        n.realisations, n.records, g.samples, g.layers_per_sample
    );
    let kept_line_bytes = if n.kept > 0.0 { n.lines * n.layers * 8.0 } else { 0.0 };
    let kept_bytes = n.kept * n.records * n.samples * n.parts * 8.0 + kept_line_bytes;
    // The echo of the pulse before is a record of its own, made of lines of its own.
    let (trips, more) = if scene.scan.second_trip.is_some() { (2.0, 16.0 * n.layers * n.lines) } else { (1.0, 0.0) };
    // Pulses with airs of their own: the wind again, and a piece of airs.
    let airs = scene.scan.wind_of_pulses.of_line(scene.scan.pulses_per_line) as f64;
    let (wind_s, more) = if airs > 1.0 || scene.scan.wind_of_pulses != WindOfPulses::default() {
        (n.realisations * n.lines * airs * n.layers * wind_point_s(scene), more + AIRS_BYTES)
    } else {
        (0.0, more)
    };
    let core_s = n.realisations * n.records * record_s(n) * trips + wind_s;
    run(Stage::Signals, reason, core_s, [scan_bytes(g, n) + more, kept_bytes])
}

/// Time of one record, s.
fn record_s(n: &Sizes) -> f64 {
    n.layers * LAYER_OF_RECORD_S + n.samples * (n.layers_per_sample * LAYER_OF_SAMPLE_S + SAMPLE_S)
}

fn noise(scene: &Scene, n: &Sizes) -> PlannedStage {
    if scene.detector.noise == NoiseModel::None {
        return skip(Stage::Noise, "detector.noise is \"none\"");
    }
    let values = n.realisations * n.records * n.samples * n.parts;
    run(Stage::Noise, format!("{values} samples"), values * NOISE_SAMPLE_S, [0.0, 0.0])
}

fn estimates(scene: &Scene, g: &Geometry, n: &Sizes) -> PlannedStage {
    let e = &scene.estimator;
    let region = match (&e.method, &e.radius) {
        (Method::Periodogram {}, _) => "no region".to_owned(),
        (_, RegionRadius::Fixed {}) => format!("regions of {} m", e.radius_m),
        (_, RegionRadius::OfRange { .. }) => "regions whose radius depends on range".to_owned(),
        (_, RegionRadius::Target { standard_deviation_m_s, .. }) => {
            format!("regions for a standard deviation of {standard_deviation_m_s} m/s")
        }
    };
    let reason = format!("{} x {} gates, {region}", n.lines, g.gate_range_m.len());
    let sums_bytes = n.lines * n.windows * n.numbers * 8.0;
    let realisation_s = n.records * n.windows * window_s(scene, n) + n.cells * point_s(scene, n);
    let (planning_s, planned_bytes, planning_bytes) = planning(scene, n);
    // Of each point: sums over the realisations, their errors, truth and thresholds; then the velocities of one realisation.
    let scans_bytes = n.cells * n.realisations * SCAN_POINT_BYTES;
    let points_bytes = n.cells * MAPPER_POINT_BYTES + scans_bytes;
    let maps = if e.follow_wind { 2.0 } else { 1.0 };
    // While windows are added there is a piece of records, while velocities are sought there are sums over blocks of windows.
    let air = air_bytes(n);
    let adding = scan_bytes(g, n) + sums_bytes;
    let seeking = air + sums_bytes * 1.125 + n.lines * n.windows * 8.0 + n.cells * MAP_POINT_BYTES * maps;
    let at_work = adding.max(seeking) + points_bytes + planned_bytes;
    let working = at_work.max(air + planning_bytes);
    let core_s = n.realisations * realisation_s + planning_s;
    run(Stage::Estimates, reason, core_s, [working, n.cells * MAP_FIELDS * 8.0 + scans_bytes])
}

/// Of a point of the map: sums over the realisations, truth, thresholds.
const MAPPER_POINT_BYTES: f64 = 200.0;
/// Of a point and a realisation: the error, and whether it was flagged.
const SCAN_POINT_BYTES: f64 = 9.0;
/// Of a point of the map of one realisation: the estimate.
const MAP_POINT_BYTES: f64 = 88.0;

/// Time of the statistic of one window, s.
fn window_s(scene: &Scene, n: &Sizes) -> f64 {
    let e = &scene.estimator;
    let transform_s = n.parts * TRANSFORM_POINT_S * 2.0 * n.window * (2.0 * n.window).log2();
    match e.method {
        Method::GradientLikelihood(g) => g.gradients as f64 * GRADIENT_PAIR_S * n.window * n.window,
        // As many tapers as a window has independent parts, about.
        Method::Likelihood(_) => {
            let parts = (n.window / (scene.detector.sampling_hz * scene.pulse_sigma_s())).min(n.window);
            transform_s * (2.0 + 0.5 * parts)
        }
        _ if keeps_few_lags(scene) => (2.0 * e.window_step_samples as f64).min(n.window) * n.numbers * SLIDING_LAG_S,
        _ => transform_s,
    }
}

/// Time of the velocity at one point of the map, s.
fn point_s(scene: &Scene, n: &Sizes) -> f64 {
    let e = &scene.estimator;
    let spectrum_s = n.frequencies * (n.numbers.min(n.parts * n.window) * SPECTRUM_LAG_S + SPECTRUM_POINT_S);
    let estimate_s = match e.method {
        Method::GradientLikelihood(g) => 2.0 * g.gradients as f64 * spectrum_s,
        Method::AutoregressivePole(model) => (model.order as f64).powi(2) * POLE_S,
        Method::PulsePair {} => 0.0,
        _ => spectrum_s,
    };
    let region_s = n.chords * (n.numbers * SUMMED_NUMBER_S + scene.scan.pulses_per_line as f64 * 1e-9);
    // A first map, and the shifts that follow it.
    (region_s + estimate_s) * if e.follow_wind { 2.5 } else { 1.0 }
}

/// What is prepared once: tapers from a covariance, weights of the lags. Its time, s, which only covariances make long, the
/// memory of what comes of it, and that which it takes, bytes.
fn planning(scene: &Scene, n: &Sizes) -> (f64, f64, f64) {
    let matrix_bytes = n.window.powi(2) * 8.0;
    let (models, kept_matrices, matrices) = match scene.estimator.method {
        Method::Likelihood(_) => (1.0, 1.0, 8.0),
        Method::GradientLikelihood(g) => {
            let gradients = g.gradients as f64;
            (7.0 * gradients, 2.0 * gradients, 2.0 * gradients + 24.0)
        }
        _ => (0.0, 0.0, 0.0),
    };
    let (bounds, bound_bytes) = match scene.estimator.radius {
        RegionRadius::Target { .. } => (1.0, bound_bytes(n)),
        _ => (0.0, 0.0),
    };
    let core_s = DECOMPOSED_NUMBER_S * (models * n.window.powi(3) + bounds * n.chord.powi(3));
    let kept_bytes = kept_matrices * matrix_bytes + n.frequencies * 32.0;
    (core_s, kept_bytes, kept_bytes + bound_bytes.max(matrices * matrix_bytes))
}

/// Matrices of the bound of a record: the signal, the covariance and its derivative, its factor, a turned copy.
fn bound_bytes(n: &Sizes) -> f64 {
    6.0 * 8.0 * n.chord.powi(2)
}

/// What is held for the Cramer-Rao bound in place of a run of these stages: that of the air and the matrices of a record.
pub(super) fn of_bound(stages: &[PlannedStage], n: &Sizes) -> Vec<PlannedStage> {
    let first = [Stage::PhaseScreens, Stage::Efficiency, Stage::LinesOfSight];
    let mut out: Vec<PlannedStage> = stages.iter().filter(|s| first.contains(&s.stage)).cloned().collect();
    out.push(run(Stage::Estimates, String::new(), 0.0, [air_bytes(n) + bound_bytes(n), 0.0]));
    out
}

fn errors(scene: &Scene, g: &Geometry, n: &Sizes) -> PlannedStage {
    let reason = format!("against v_pulse (28) and v_gate over {} realisations", n.realisations);
    let seen = 3.0 * n.layers_per_sample + n.window * g.sample_spacing_m / g.layer_thickness_m;
    run(Stage::Errors, reason, n.cells * (seen * TRUTH_LAYER_S + wind_point_s(scene)), [0.0, 0.0])
}
