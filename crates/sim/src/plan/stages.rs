//! The stages of a run but the optics: what each does, and its cost as a product of sizes and unit costs.
//!
//! The unit costs are those of one core; `cargo xtask forecast` compares the sums with what whole runs take.

use super::sizes::{Sizes, is_calm, keeps_few_lags};
use super::{Cost, PlannedStage, Stage, Target};
use crate::measure::geometry::Geometry;
use crate::measure::scan::records_at_once;
use crate::measure::wind::SceneWind;
use crate::scene::{Flow, Method, NoiseKind, RegionRadius, Scene, SignalsOf};

// Unit costs on one core, s.
const ANALYTIC_WIND_S: f64 = 7e-8;
const SAMPLED_WIND_S: f64 = 2e-7;
const LAYER_OF_RECORD_S: f64 = 4.5e-8;
const LAYER_OF_SAMPLE_S: f64 = 1.0e-10;
const SAMPLE_S: f64 = 4e-8;
const NOISE_SAMPLE_S: f64 = 3e-9;
/// Of a window, for each point of its transform times the logarithm of their number.
const TRANSFORM_POINT_S: f64 = 3.4e-10;
const SLIDING_LAG_S: f64 = 2e-9;
const GRADIENT_PAIR_S: f64 = 7e-10;
const SUMMED_NUMBER_S: f64 = 5e-9;
const NEW_BYTE_S: f64 = 2.5e-10;
const SPECTRUM_LAG_S: f64 = 6e-11;
const SPECTRUM_POINT_S: f64 = 6e-9;
const TRUTH_LAYER_S: f64 = 5e-10;
const TABLE_NUMBER_S: f64 = 7e-8;
const NETCDF_NUMBER_S: f64 = 2e-8;
const MAP_PIXEL_S: f64 = 2.5e-7;
const PICTURE_S: f64 = 2.5e-2;

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
        out.extend([lines_of_sight(scene, g, &n), signals(scene, target, g, &n), noise(scene, &n)]);
        out.extend(match target {
            Target::Signal => [skip(Stage::Estimates, "not asked for"), skip(Stage::Errors, "not asked for")],
            _ => [estimates(scene, g, &n), errors(scene, g, &n)],
        });
    }
    out.push(files(scene, target, g, &n));
    out
}

fn run(stage: Stage, reason: String, core_s: f64, memory_bytes: f64) -> PlannedStage {
    PlannedStage { stage, reason, cost: Some(Cost { core_s, memory_bytes }) }
}

fn skip(stage: Stage, reason: &str) -> PlannedStage {
    PlannedStage { stage, reason: reason.into(), cost: None }
}

/// Time of the wind at one point, s.
fn wind_point_s(scene: &Scene) -> f64 {
    match scene.flow {
        Flow::Calm {} | Flow::Uniform { .. } => 1e-8,
        Flow::VortexPair(_) => ANALYTIC_WIND_S,
        Flow::Simulated(_) => SAMPLED_WIND_S,
    }
}

fn cross_plane(scene: &Scene, target: Target) -> PlannedStage {
    if target != Target::Run || !scene.outputs.flow {
        return skip(Stage::CrossPlane, "not asked for");
    }
    if is_calm(scene) {
        return skip(Stage::CrossPlane, "flow.kind is \"calm\"");
    }
    let (ny, nz) = crate::measure::plane::POINTS;
    let points = (ny * nz) as f64;
    run(Stage::CrossPlane, format!("{ny} x {nz} points"), points * wind_point_s(scene), points * 64.0)
}

fn lines_of_sight(scene: &Scene, g: &Geometry, n: &Sizes) -> PlannedStage {
    let reason = format!("{} lines of {} layers of {:.3} m", n.lines, g.layers, g.layer_thickness_m);
    let points = n.lines * n.layers;
    // Velocity and weight are kept; places and velocities of one line are at work.
    run(Stage::LinesOfSight, reason, points * wind_point_s(scene), points * 16.0 + n.layers * 48.0)
}

/// Realisations whose raw signals are kept for the files.
pub(super) fn kept_realisations(scene: &Scene, target: Target) -> usize {
    let keeps = match target {
        Target::Signal => true,
        Target::Run => scene.outputs.signals,
        Target::Efficiency | Target::Map => false,
    };
    match scene.outputs.signals_of {
        _ if !keeps => 0,
        SignalsOf::First => 1,
        SignalsOf::All => scene.scan.realisations,
    }
}

fn signals(scene: &Scene, target: Target, g: &Geometry, n: &Sizes) -> PlannedStage {
    let reason = format!(
        "{} x {} records of {} samples, {} layers each",
        n.realisations, n.records, g.samples, g.layers_per_sample
    );
    let record_s = n.layers * LAYER_OF_RECORD_S + n.samples * (n.layers_per_sample * LAYER_OF_SAMPLE_S + SAMPLE_S);
    let at_once = records_at_once::<f64>(g.samples * n.parts as usize, n.records.min(1e15) as usize) as f64;
    let kept = n.records * kept_realisations(scene, target) as f64;
    let bytes = (at_once + kept) * n.samples * n.parts * 8.0 + n.layers * 48.0 + n.samples * 200.0;
    run(Stage::Signals, reason, n.realisations * n.records * record_s, bytes)
}

fn noise(scene: &Scene, n: &Sizes) -> PlannedStage {
    if scene.detector.noise == NoiseKind::None {
        return skip(Stage::Noise, "detector.noise is \"none\"");
    }
    let values = n.realisations * n.records * n.samples * n.parts;
    run(Stage::Noise, format!("{values} samples"), values * NOISE_SAMPLE_S, n.samples * 64.0)
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
    let sums_bytes = n.lines * n.windows * (n.numbers + 1.0) * 9.0;
    let realisation_s =
        n.records * n.windows * window_s(scene, n) + n.cells * point_s(scene, n) + sums_bytes * NEW_BYTE_S;
    let planning = planning(scene, n);
    let core_s = n.realisations * realisation_s + planning.core_s;
    run(Stage::Estimates, reason, core_s, sums_bytes + n.cells * 250.0 + planning.memory_bytes)
}

/// Time of the statistic of one window, s.
fn window_s(scene: &Scene, n: &Sizes) -> f64 {
    let e = &scene.estimator;
    let transform_s = n.parts * TRANSFORM_POINT_S * 2.0 * n.window * (2.0 * n.window).log2();
    match e.method {
        Method::GradientLikelihood(g) => {
            g.gradients as f64 * GRADIENT_PAIR_S * n.window * n.window + n.numbers * SUMMED_NUMBER_S
        }
        Method::Likelihood(_) => transform_s * (2.0 + 0.5 * tapers(scene, n)),
        _ if keeps_few_lags(scene) => {
            let pairs = (2.0 * e.window_step_samples as f64).min(n.window);
            pairs * n.numbers * SLIDING_LAG_S
        }
        _ => transform_s,
    }
}

/// Tapers of the likelihood: about as many as a window has independent parts.
fn tapers(scene: &Scene, n: &Sizes) -> f64 {
    (n.window / (scene.detector.sampling_hz * scene.pulse_sigma_s())).min(n.window)
}

/// Time of the velocity at one point of the map, s.
fn point_s(scene: &Scene, n: &Sizes) -> f64 {
    let e = &scene.estimator;
    let order = e.method.order().map_or(0.0, |model| model.order as f64);
    let lags = n.numbers.min(n.parts * n.window);
    let spectrum_s = n.frequencies * (lags * SPECTRUM_LAG_S + SPECTRUM_POINT_S);
    let estimate_s = match e.method {
        Method::GradientLikelihood(g) => 2.0 * g.gradients as f64 * spectrum_s,
        Method::Autoregressive(_) => spectrum_s + order * order * 1.5e-9,
        Method::Capon(_) => spectrum_s + order * order * 2e-9,
        Method::AutoregressivePole(_) => order * order * 7.5e-8,
        Method::FirstMoment(_) => 2.0 * spectrum_s,
        Method::PulsePair {} => 1e-7,
        _ => spectrum_s,
    };
    let pulses = scene.scan.pulses_per_line as f64;
    let region_s = n.chords * (n.numbers * SUMMED_NUMBER_S + pulses * 1e-9 + 2e-8);
    match e.follow_wind {
        true => 2.0 * (region_s + estimate_s) + n.chords * n.numbers * SUMMED_NUMBER_S,
        false => region_s + estimate_s,
    }
}

/// What is prepared once: tapers from a covariance, weights of the lags, correlation of the windows.
fn planning(scene: &Scene, n: &Sizes) -> Cost {
    let (squared, cubed) = (n.window.powi(2), n.window.powi(3));
    let (core_s, matrices) = match scene.estimator.method {
        Method::Likelihood(_) => (3.5e-8 * cubed, 8.0),
        Method::GradientLikelihood(g) => (2.5e-7 * cubed * g.gradients as f64, 24.0),
        _ => (0.0, 0.0),
    };
    let model = match scene.estimator.radius {
        RegionRadius::Target { .. } => 16.0 * 5e-9 * cubed,
        _ => 0.0,
    };
    // The windows of a record that share samples or the pulse.
    let reach = (n.window + 2.0 * n.layers_per_sample).min(n.samples);
    let correlation_s = squared * 1e-9 + reach * n.window * 2e-9;
    Cost { core_s: core_s + model + correlation_s, memory_bytes: matrices * squared * 8.0 + n.frequencies * 32.0 }
}

fn errors(scene: &Scene, g: &Geometry, n: &Sizes) -> PlannedStage {
    let reason = format!("against v_pulse (28) and v_gate over {} realisations", n.realisations);
    let window_layers = n.window * g.sample_spacing_m / g.layer_thickness_m;
    let seen = 3.0 * n.layers_per_sample + window_layers;
    let core_s = n.cells * (seen * TRUTH_LAYER_S + wind_point_s(scene)) + n.window * n.layers_per_sample * 1e-8;
    run(Stage::Errors, reason, core_s, n.cells * 24.0)
}

/// Columns of the table of a map, and fields of its NetCDF file.
const MAP_COLUMNS: f64 = 24.0;
const MAP_FIELDS: f64 = 15.0;

fn files(scene: &Scene, target: Target, g: &Geometry, n: &Sizes) -> PlannedStage {
    let o = &scene.outputs;
    let maps = matches!(target, Target::Run | Target::Map);
    let kept = kept_realisations(scene, target) as f64;
    let on = |wanted: bool| f64::from(u8::from(wanted));
    let mut core_s = 5e-3;
    let mut memory = 0.0;
    if maps {
        core_s += n.cells * (on(o.csv) * MAP_COLUMNS * TABLE_NUMBER_S + on(o.netcdf) * MAP_FIELDS * NETCDF_NUMBER_S);
        memory += n.cells * (250.0 + on(o.csv) * 400.0 + on(o.netcdf) * 120.0);
        let pixels = 3.0 * map_pixels(scene, g);
        core_s += pixels * (on(o.svg) + on(o.png)) * MAP_PIXEL_S + (on(o.svg) + on(o.png)) * PICTURE_S;
        memory += pixels * (on(o.svg) * 5.0 + on(o.png) * 12.0);
    }
    if kept > 0.0 {
        let numbers = kept * n.records * n.samples * n.parts;
        core_s += on(o.csv) * n.lines * n.samples * (2.0 + n.parts) * TABLE_NUMBER_S;
        core_s += on(o.netcdf) * numbers * 1.5 * NETCDF_NUMBER_S;
        memory += 8.0 * numbers * (1.0 + on(o.netcdf) * 4.7) + on(o.csv) * n.lines * n.samples * 90.0;
    }
    if target == Target::Run && o.flow && !is_calm(scene) {
        core_s += on(o.csv) * 8e-3 + on(o.netcdf) * 1e-3;
        memory += on(o.csv) * 2.5e6 + on(o.netcdf) * 1e6;
    }
    if matches!(target, Target::Run | Target::Efficiency) {
        let points = o.profile_points as f64;
        core_s += on(o.csv) * points * 10.0 * TABLE_NUMBER_S + (on(o.svg) + on(o.png)) * (PICTURE_S + points * 1e-6);
        memory += points * 400.0 + on(o.png) * 3e6;
    }
    let kinds = [(o.csv, "CSV"), (o.netcdf, "NetCDF"), (o.svg, "SVG"), (o.png, "PNG")];
    let kinds: Vec<&str> = kinds.into_iter().filter(|k| k.0).map(|k| k.1).collect();
    run(Stage::Files, kinds.join(", "), core_s, memory)
}

/// Pixels of one panel of a map: some 1300 across, and as high as the scan.
fn map_pixels(scene: &Scene, g: &Geometry) -> f64 {
    let far_m = g.gate_range_m.last().copied().unwrap_or(1.0);
    let (low, high) = (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad);
    let top_m = (scene.scan.lidar_height_m + far_m * high.sin()).max(0.0);
    let bottom_m = (scene.scan.lidar_height_m + far_m * low.sin()).min(0.0);
    let shape = ((top_m - bottom_m) / far_m).clamp(0.07, 1.5);
    1300.0 * 1300.0 * shape
}
