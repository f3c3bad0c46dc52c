//! The stages along the lines of sight: wind, signals and noise; what each needs.

use crate::Error;
use crate::measure::accumulation::lags_per_window;
use crate::measure::accumulation::{
    draw_s, draws_products, factor_bytes, factor_s, reason_against_draws, record_s,
};
use crate::measure::efficiency_model::drawn_turbulence;
use crate::measure::scan::products::{kept_factors, lines_at_once};
use crate::measure::scan::{WINDS_BYTES, records_at_once};
use crate::plan::line_wind::radial_velocity_m_s;
use crate::plan::{Plan, PlannedStage, Stage, Target};
use crate::scene::{EddyEvaluation, EddyGround, Flow, NoiseModel, Outside, WindOfPulses};

/// The stage of the wind along the lines of sight.
///
/// # Errors
/// Fails if a line leaves a simulated flow and the scene does not mask that.
pub(crate) fn lines_of_sight(plan: &Plan) -> Result<PlannedStage, Error> {
    if plan.target == Target::Efficiency {
        return Ok(PlannedStage::skipped(Stage::LinesOfSight, "not asked for"));
    }
    refuse_lines_outside(plan)?;
    let n = &plan.counts;
    let g = &plan.geometry;
    let reason = format!(
        "{} lines of {} layers of {:.3} m",
        n.lines, g.layers, g.layer_thickness_m
    );
    // Positions and velocities of the lines at work.
    let working_bytes = wind_bytes(plan) + n.threads * n.layers * 64.0;
    Ok(
        PlannedStage::running(Stage::LinesOfSight, reason).with_memory(
            working_bytes,
            0.0,
            fewer_layers(plan),
        ),
    )
}

/// The stage of the signals.
pub(crate) fn signals(plan: &Plan) -> PlannedStage {
    if plan.target == Target::Efficiency {
        return PlannedStage::skipped(Stage::Signals, "not asked for");
    }
    let n = &plan.counts;
    let scan = &plan.scene().scan;
    let g = &plan.geometry;
    let reason = if draws_products(plan) {
        format!(
            "{} x {} lines of {} samples, products of all pulses drawn at once",
            n.realisations, n.lines, g.samples
        )
    } else {
        let why = reason_against_draws(plan);
        let why = why.map_or(String::new(), |why| format!("; not drawn at once: {why}"));
        format!(
            "{} x {} records of {} samples, {} layers each{why}",
            n.realisations, n.records, g.samples, n.layers_per_sample
        )
    };
    let kept_line_bytes = if n.kept > 0.0 {
        n.lines * n.layers * 8.0
    } else {
        0.0
    };
    let kept_bytes = n.kept * n.records * n.samples * n.parts * 8.0 + kept_line_bytes;
    // The echo of the previous pulse is made of lines of its own.
    let second_trip_bytes = if scan.second_trip.is_some() {
        16.0 * n.layers * n.lines
    } else {
        0.0
    };
    // Pulses with a wind of their own: a piece of winds.
    let winds_bytes = if scan.wind_of_pulses == WindOfPulses::default() {
        0.0
    } else {
        WINDS_BYTES
    };
    let working_bytes = scan_bytes(plan) + second_trip_bytes + winds_bytes;
    PlannedStage::running(Stage::Signals, reason)
        .with_memory(working_bytes, kept_bytes, fewer_layers(plan))
        .with_time(signals_s(plan))
}

/// The stage of the noise.
pub(crate) fn noise(plan: &Plan) -> PlannedStage {
    if plan.target == Target::Efficiency {
        return PlannedStage::skipped(Stage::Noise, "not asked for");
    }
    if plan.scene().detector.noise == NoiseModel::None {
        return PlannedStage::skipped(Stage::Noise, "detector.noise is \"none\"");
    }
    let n = &plan.counts;
    let reason = if draws_products(plan) {
        "in the products".into()
    } else {
        let values = n.realisations * n.records * n.samples * n.parts;
        format!("{values} samples")
    };
    PlannedStage::running(Stage::Noise, reason).with_memory(0.0, 0.0, fewer_layers(plan))
}

/// Keys that reduce the layers of all lines.
fn fewer_layers(plan: &Plan) -> String {
    plan.fewer_records_or(format!(
        "{} or a smaller scan.range_max_m",
        plan.fewer_lines()
    ))
}

/// Memory that is held while signals are made, bytes: velocity and weight of each layer, and
/// efficiencies where pulses have their own.
pub(crate) fn wind_bytes(plan: &Plan) -> f64 {
    let n = &plan.counts;
    let drawn = drawn_turbulence(plan.scene()).map_or(0.0, |t| t.realisations as f64);
    8.0 * n.layers * (2.0 * n.lines + drawn)
}

/// Memory that is held while signals are made, bytes: the winds, the plans of carrier and noise,
/// for each thread the layers and the transforms of a record, and a piece of records; for draws
/// the factors of lines, for each thread the matrices of one, and a piece of products.
pub(crate) fn scan_bytes(plan: &Plan) -> f64 {
    let n = &plan.counts;
    if draws_products(plan) {
        let products_bytes = n.samples * n.parts * 8.0 * lags_per_window(plan) as f64;
        let at_once = lines_at_once(plan.geometry.elevation_rad.len(), products_bytes as usize);
        // Beside the factor the covariance of the envelope, that of the record, the triangle and
        // their product.
        let of_thread = n.samples.powi(2) * 16.0 + 4.0 * factor_bytes(plan);
        return wind_bytes(plan)
            + kept_lines(plan) * factor_bytes(plan)
            + n.threads * of_thread
            + at_once as f64 * products_bytes;
    }
    let of_thread = n.layers * 48.0 + n.samples * 100.0;
    let numbers = plan.geometry.samples * n.parts as usize;
    let at_once = records_at_once::<f64>(numbers, n.records.min(1e15) as usize) as f64;
    wind_bytes(plan)
        + n.samples * 80.0
        + n.threads * of_thread
        + at_once * (n.samples * n.parts * 8.0 + 64.0)
}

/// Time of the signals of all realisations and their winds, s of one core.
fn signals_s(plan: &Plan) -> f64 {
    let n = &plan.counts;
    let scene = plan.scene();
    let mut wind_s = wind_point_s(&scene.flow);
    for flow in &scene.added_flows {
        wind_s += wind_point_s(flow);
    }
    let winds_per_line = match scene.scan.wind_of_pulses {
        WindOfPulses::Line {} => 1,
        WindOfPulses::Pulse {} => scene.scan.pulses_per_line,
    };
    let winds = n.lines * winds_per_line as f64;
    let kept_s = n.kept * n.records * n.samples * n.parts * 4e-8;
    let made_s = if draws_products(plan) {
        let again = (n.lines - kept_lines(plan)) * (n.realisations - 1.0);
        (n.lines + again) * factor_s(plan) + n.realisations * n.lines * draw_s(plan)
    } else {
        n.realisations * n.records * record_s(plan)
    };
    made_s + n.realisations * winds * n.layers * wind_s + kept_s
}

/// Lines whose factors are kept between realisations.
fn kept_lines(plan: &Plan) -> f64 {
    let lines = plan.geometry.elevation_rad.len();
    kept_factors(lines, factor_bytes(plan) as usize, plan.realisations()) as f64
}

/// Time of the wind at one point, s of one core.
fn wind_point_s(flow: &Flow) -> f64 {
    match flow {
        Flow::Eddies(eddies) => {
            let mode_s = match eddies.evaluation {
                EddyEvaluation::Levels => 1e-10,
                EddyEvaluation::All => 2e-10,
            };
            let images = match eddies.ground {
                EddyGround::Open => 1.0,
                EddyGround::Blocked => 3.0,
            };
            eddies.modes as f64 * mode_s * images
        }
        flow if flow.is_stored() => 4e-7,
        _ => 7e-8,
    }
}

/// Largest number of layers of a line that are examined one by one.
const LAYERS_EXAMINED: usize = 1_000_000;

/// Refuses lines that leave a simulated flow, with the error of a run. The domain is convex, so
/// both ends above the ground tell whether a line is inside; only failing lines are examined layer
/// by layer.
fn refuse_lines_outside(plan: &Plan) -> Result<(), Error> {
    let g = &plan.geometry;
    if !plan.scene().flow.is_stored() || plan.scene().scan.outside_flow != (Outside::Error {}) {
        return Ok(());
    }
    let last_m = g.first_layer_range_m + g.layers.saturating_sub(1) as f64 * g.layer_thickness_m;
    for line in 0..g.schedule.lines.len() {
        // Where a line that points down meets the ground.
        let beam = g.schedule.middle(line);
        let sin = beam.direction.0[2];
        let ground_m = if sin < 0.0 {
            -beam.position_m[2] / sin
        } else {
            f64::INFINITY
        };
        let ends_m = [g.first_layer_range_m, last_m.min(ground_m)];
        if g.first_layer_range_m <= ground_m
            && radial_velocity_m_s(plan, &plan.wind, line, &ends_m).is_err()
        {
            // The error of the run is that of the first layer outside.
            let ranges_m: Vec<f64> = g.layer_range_m().take(LAYERS_EXAMINED).collect();
            radial_velocity_m_s(plan, &plan.wind, line, &ranges_m)?;
            radial_velocity_m_s(plan, &plan.wind, line, &ends_m)?;
        }
    }
    Ok(())
}
