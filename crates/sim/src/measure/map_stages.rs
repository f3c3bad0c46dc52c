//! The stages of the map: estimates and their errors; what each needs.

use crate::Error;
use crate::measure::accumulation::{draws_products, lags_per_window};
use crate::measure::region;
use crate::measure::scan_stages::{scan_bytes, wind_bytes};
use crate::plan::{Plan, PlannedStage, Stage};
use crate::scene::{DetectorSignal, Estimator, PulseShape, RegionRadius};
use wakescope_estimate::map::PolarPoint;

/// Fields of a map of estimates.
pub(crate) const MAP_FIELDS: f64 = 16.0;
/// Memory of a point of the map, bytes: sums over the realisations, truth, thresholds.
const MAPPER_POINT_BYTES: f64 = 200.0;
/// Memory of a point and a realisation, bytes: the error, and whether it was flagged.
const SCAN_POINT_BYTES: f64 = 9.0;
/// Memory of a point of the map of one realisation, bytes: the estimate.
const MAP_POINT_BYTES: f64 = 88.0;

/// The stage of the estimates.
pub(crate) fn estimates(plan: &Plan) -> PlannedStage {
    if !plan.target.has_map() {
        return PlannedStage::skipped(Stage::Estimates, "not asked for");
    }
    let n = &plan.counts;
    let reason = format!(
        "{} x {} gates, {}",
        n.lines,
        plan.geometry.gate_range_m.len(),
        plan.scene().estimator.regions()
    );
    let windows = n.lines * windows_per_record(plan);
    let sums_bytes = windows * numbers_per_window(plan) * 8.0;
    let (planned_bytes, planning_bytes) = planning_bytes(plan);
    // Of each point: sums over the realisations, their errors, truth and thresholds; then the
    // velocities of one realisation.
    let scans_bytes = n.cells * n.realisations * SCAN_POINT_BYTES;
    let points_bytes = n.cells * MAPPER_POINT_BYTES + scans_bytes;
    // While windows are added there is a piece of records, while velocities are estimated there are
    // sums over blocks of windows.
    let adding = scan_bytes(plan) + sums_bytes;
    let estimating =
        wind_bytes(plan) + sums_bytes * 1.125 + windows * 8.0 + n.cells * MAP_POINT_BYTES;
    let at_work = adding.max(estimating) + points_bytes + planned_bytes;
    let working = at_work.max(wind_bytes(plan) + planning_bytes);
    let kept_bytes = n.cells * MAP_FIELDS * 8.0 + scans_bytes;
    PlannedStage::running(Stage::Estimates, reason)
        .with_memory(working, kept_bytes, plan.fewer_points())
        .with_time(estimates_s(plan))
}

/// The stage of the errors.
pub(crate) fn errors(plan: &Plan) -> PlannedStage {
    if !plan.target.has_map() {
        return PlannedStage::skipped(Stage::Errors, "not asked for");
    }
    let reason = format!(
        "against v_pulse (28) and v_gate over {} realisations",
        plan.counts.realisations
    );
    PlannedStage::running(Stage::Errors, reason).with_memory(0.0, 0.0, plan.fewer_points())
}

/// Windows of a record.
fn windows_per_record(plan: &Plan) -> f64 {
    let e = &plan.scene().estimator;
    ((plan.geometry.samples - e.window_samples) / e.window_step_samples + 1) as f64
}

/// Real numbers that are kept of a window.
fn numbers_per_window(plan: &Plan) -> f64 {
    plan.counts.parts * lags_per_window(plan) as f64
}

/// Frequencies among which the peak of a spectrum is looked for.
fn frequencies(plan: &Plan) -> f64 {
    let d = &plan.scene().detector;
    plan.scene().estimator.padded_samples as f64 * d.bandwidth_hz / d.sampling_hz
}

/// Largest radius of a region, m.
fn largest_radius_m(plan: &Plan) -> f64 {
    let mut largest_m = 0.0_f64;
    for range_m in &plan.geometry.gate_range_m {
        largest_m = largest_m.max(plan.scene().estimator.largest_radius_m(*range_m));
    }
    largest_m
}

/// Lines of sight that share a region in the middle of the scan.
fn lines_per_region(plan: &Plan) -> f64 {
    let gates_m = &plan.geometry.gate_range_m;
    let middle_m = gates_m.get(gates_m.len() / 2).copied().unwrap_or(1.0);
    let radius_m = largest_radius_m(plan);
    let half_rad = if radius_m < middle_m {
        (radius_m / middle_m).asin()
    } else {
        std::f64::consts::PI
    };
    (2.0 * half_rad / step_rad(plan) + 1.0).min(plan.counts.lines)
}

/// Angle between consecutive lines, rad; half a turn where no two share a region.
fn step_rad(plan: &Plan) -> f64 {
    let schedule = &plan.geometry.schedule;
    match &schedule.lines[..] {
        _ if schedule.is_plane() => plan.scene().scan.elevation_step_rad,
        [first, second, ..] if first.group == second.group => {
            let direction = schedule.middle(0).direction;
            let (_, sin) = direction.cos_sin_to(&schedule.middle(1).direction);
            sin.max(1e-7)
        }
        _ => std::f64::consts::PI,
    }
}

/// Samples of the longest record whose covariance the bound needs: those of the windows of a
/// region, or as many as still add information.
fn bound_samples(plan: &Plan) -> f64 {
    let g = &plan.geometry;
    let window = plan.scene().estimator.window_samples as f64;
    let informative =
        window + g.layers_per_sample as f64 * g.layer_thickness_m / g.sample_spacing_m;
    (window + 2.0 * largest_radius_m(plan) / g.sample_spacing_m).min(informative.max(256.0))
}

/// Memory of the matrices of the bound of a record, bytes: the signal, the covariance and its
/// derivative, its factor, a transposed copy.
pub(crate) fn bound_bytes(plan: &Plan) -> f64 {
    6.0 * 8.0 * bound_rows(plan).powi(2)
}

/// Rows of these matrices: those of complex samples of a pulse with phase hold real and imaginary parts.
fn bound_rows(plan: &Plan) -> f64 {
    let scene = plan.scene();
    let has_phase = match &scene.pulse.shape {
        PulseShape::Sampled(shape) => !shape.phase_rad.is_empty(),
        PulseShape::Gaussian(_) => false,
    };
    let is_complex = scene.detector.signal == DetectorSignal::Baseband;
    if has_phase && is_complex {
        2.0 * bound_samples(plan)
    } else {
        bound_samples(plan)
    }
}

/// What is prepared once, tapers from a covariance and weights of the lags: memory of the result,
/// and memory while it is made, bytes.
fn planning_bytes(plan: &Plan) -> (f64, f64) {
    let e = &plan.scene().estimator;
    let matrix_bytes = (e.window_samples as f64).powi(2) * 8.0;
    let covariances = e.method.behaviour().covariances();
    let bound_bytes = match e.radius {
        RegionRadius::Target { .. } => bound_bytes(plan),
        _ => 0.0,
    };
    let kept_bytes = covariances * matrix_bytes + frequencies(plan) * 32.0;
    let making_bytes = bound_bytes.max(8.0 * covariances * matrix_bytes);
    (kept_bytes, kept_bytes + making_bytes)
}

/// Time of estimates, their errors and the files of both, s of one core.
fn estimates_s(plan: &Plan) -> f64 {
    let n = &plan.counts;
    let scene = plan.scene();
    let e = &scene.estimator;
    let window = e.window_samples as f64;
    let numbers = numbers_per_window(plan);
    let numbers_s = numbers * 6e-9;
    let spectrum_s = frequencies(plan) * (6e-9 + numbers.min(window) * 6e-11);
    let method = e.method.behaviour();
    let window_s = numbers_s * method.window_cost(scene);
    let point_s = lines_per_region(plan) * numbers * 5e-9 + spectrum_s;
    let points_s = n.cells * n.realisations * point_s;
    let bounded = match e.radius {
        // Once for each gate.
        RegionRadius::Target { .. } => {
            let gates = plan.geometry.gate_range_m.len() as f64;
            gates / 17.0 * bound_rows(plan).powi(3)
        }
        _ => 0.0,
    };
    let planned_s = 4e-8 * (method.covariances() * window.powi(3) + bounded);
    let pictures_s = 0.12 * f64::from(u8::from(scene.outputs.svg) + u8::from(scene.outputs.png));
    let windows = n.realisations * windows_per_record(plan);
    let windows_s = if draws_products(plan) {
        windows * n.lines * numbers * window * 4e-10
    } else {
        windows * n.records * window_s
    };
    windows_s + points_s + planned_s + n.cells * 3e-6 + pictures_s
}

/// Gates without a window: windows may be farther apart than regions are wide. Regions as large as
/// a standard deviation asks for are examined at their largest.
///
/// # Errors
/// Fails if the estimators refuse the scene; a checked scene is not refused.
pub(crate) fn warnings(plan: &Plan) -> Result<Option<String>, Error> {
    if !plan.target.has_map() {
        return Ok(None);
    }
    let e = &plan.scene().estimator;
    let gates_m = &plan.geometry.gate_range_m;
    let windows = region::places(plan.scene(), &plan.geometry)?;
    let windows_m = windows.gate_ranges_m();
    let mut empty = 0;
    let mut farthest_m = 0.0_f64;
    for &range_m in gates_m {
        let point = PolarPoint::on_line(range_m, 0);
        let mut chords = windows.chords(point, e.largest_radius_m(range_m));
        if chords.next().is_none() {
            empty += 1;
        }
        let mut nearest_m = f64::INFINITY;
        for window_m in &windows_m {
            nearest_m = nearest_m.min((window_m - range_m).abs());
        }
        farthest_m = farthest_m.max(nearest_m);
    }
    if empty == 0 {
        return Ok(None);
    }
    let step_m = e.window_step_samples as f64 * plan.scene().sample_spacing_m();
    Ok(Some(format!(
        "{empty} of {} gates of a line have no window in their region and stay empty: windows are {step_m:.2} m apart \
         (estimator.window_step_samples = {}), regions are {:.2} m wide; none is empty with an {} of {:.3} or more, or \
         with windows that gates are a multiple of apart",
        gates_m.len(),
        e.window_step_samples,
        2.0 * e.largest_radius_m(gates_m[0]),
        Estimator::RADIUS,
        // Rounded up, so that the number given is good.
        (1000.0 * farthest_m).ceil() / 1000.0,
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
    use crate::scene::{Scene, SceneFile};
    use wakescope_estimate::map::ScanGeometry;

    #[test]
    fn gates_that_no_window_is_near_are_counted_with_a_remedy() {
        let plan = |step: usize, radius_m: f64| {
            let mut scene = Scene::default();
            scene.estimator.window_step_samples = step;
            scene.estimator.radius_m = radius_m;
            Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap()
        };
        for (step, radius_m) in [(16, 2.0), (7, 0.5), (12, 1.5)] {
            let planned = plan(step, radius_m);
            let found: Vec<&String> = planned
                .warnings
                .iter()
                .filter(|text| text.contains("have no window"))
                .collect();
            let text = found
                .first()
                .unwrap_or_else(|| panic!("{step} {radius_m}: {:?}", planned.warnings));
            let empty: usize = text.split(' ').next().unwrap().parse().unwrap();
            // by the distances themselves
            let g = &planned.geometry;
            let scene = planned.scene();
            let places: ScanGeometry = region::places(scene, g).unwrap();
            let windows_m = places.gate_ranges_m();
            let near = |gate_m: &f64| {
                windows_m
                    .iter()
                    .any(|window_m| (window_m - gate_m).abs() <= radius_m + 1e-5)
            };
            assert_eq!(
                empty,
                g.gate_range_m.iter().filter(|gate_m| !near(gate_m)).count(),
                "{text}"
            );
            let words = text.split("estimator.radius_m of ").nth(1).unwrap();
            let good_m: f64 = words.split(' ').next().unwrap().parse().unwrap();
            assert!(
                plan(step, good_m)
                    .warnings
                    .iter()
                    .all(|text| !text.contains("have no window")),
                "{text}"
            );
        }
        assert!(plan(1, 1.0).warnings.is_empty());
    }
}
