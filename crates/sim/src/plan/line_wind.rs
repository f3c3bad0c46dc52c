//! The air along beams: the radial velocity of each layer, and its mean over the pulses of a line.
//!
//! Check: the truth of a line is the mean over its pulses.

use crate::Error;
use crate::beams::Beam;
use crate::plan::Plan;
use crate::plan::geometry::Geometry;
use crate::plan::wind::SceneWind;
use crate::scene::{Outside, WindOfPulses};
use wakescope_les::winds::SampledLine;
use wakescope_signal::RangeFilter;

/// Mean velocity that a filter sees at the gates, m/s.
///
/// # Errors
/// What the filter refuses; a checked scene gives none.
pub(crate) fn weighted_at_gates_m_s(
    filter: &RangeFilter,
    g: &Geometry,
    velocity_m_s: &[f64],
) -> Result<Vec<f64>, Error> {
    let mut out = vec![0.0; g.gate_range_m.len()];
    filter.apply_into(
        g.first_layer_range_m,
        velocity_m_s,
        &g.gate_range_m,
        &mut out,
    )?;
    Ok(out)
}

/// Radial velocity, m/s, at ranges, m, in the middle of a line; NaN where nothing returns light. If its pulses have winds of their own,
/// the mean over them, and the standard deviation, m/s, of what they see at the gates through the filter of the pulse.
pub(crate) fn wind_of_line(
    plan: &Plan,
    wind: &SceneWind,
    filter: &RangeFilter,
    range_m: &[f64],
    line: usize,
) -> Result<(Vec<f64>, Option<Vec<f64>>), Error> {
    let g = &plan.geometry;
    let schedule = &g.schedule;
    let pulses = schedule.lines[line].pulses;
    if plan.scene().scan.wind_of_pulses == WindOfPulses::default() {
        let here_m_s = velocity_along_m_s(plan, wind, &schedule.middle(line), range_m)?;
        return Ok((here_m_s, None));
    }
    let mut sums_m_s = vec![0.0; range_m.len()];
    let mut sums = vec![(0.0, 0.0); g.gate_range_m.len()];
    let mut first_m_s = Vec::new();
    let mut first_seen_m_s = Vec::new();
    let share = 1.0 / pulses as f64;
    for pulse in 0..pulses {
        let beam = schedule.beam(line, pulse as f64);
        let here_m_s = velocity_along_m_s(plan, wind, &beam, range_m)?;
        let here_seen_m_s = weighted_at_gates_m_s(filter, g, &here_m_s)?;
        // About the first air, so that the mean of equal winds is that wind.
        if pulse == 0 {
            first_m_s = here_m_s.clone();
            first_seen_m_s = here_seen_m_s.clone();
        }
        for (sum, (v, first)) in sums_m_s.iter_mut().zip(here_m_s.iter().zip(&first_m_s)) {
            *sum += share * (v - first);
        }
        for ((sum, square), (v, first)) in sums
            .iter_mut()
            .zip(here_seen_m_s.iter().zip(&first_seen_m_s))
        {
            let beside = v - first;
            *sum += share * beside;
            *square += share * beside * beside;
        }
    }
    for (sum, first) in sums_m_s.iter_mut().zip(&first_m_s) {
        *sum += first;
    }
    let spread = |(sum, square): (f64, f64)| (square - sum * sum).max(0.0).sqrt();
    let spread_m_s = Some(sums.into_iter().map(spread).collect());
    Ok((sums_m_s, spread_m_s))
}

/// Radial velocity, m/s, positive away from the lidar, at ranges along the middle of line of sight `line`; NaN where nothing
/// returns light: below the ground or outside the flow, if the scene masks that.
pub(crate) fn radial_velocity_m_s(
    plan: &Plan,
    wind: &SceneWind,
    line: usize,
    range_m: &[f64],
) -> Result<Vec<f64>, Error> {
    velocity_along_m_s(plan, wind, &plan.geometry.schedule.middle(line), range_m)
}

/// [`known_velocity_m_s`] with what the scene says of places where the flow is not known.
pub(crate) fn velocity_along_m_s(
    plan: &Plan,
    wind: &SceneWind,
    beam: &Beam,
    range_m: &[f64],
) -> Result<Vec<f64>, Error> {
    let (points_m, known_m_s) = known_velocity_m_s(wind, beam, range_m)?;
    let scan = &plan.scene().scan;
    let elevation_rad = beam.elevation_rad;
    let checked = |((&[x_m, y_m, z_m], known_m_s), &range_m): ((&[f64; 3], f64), &f64)| {
        let outside = match (z_m < 0.0, known_m_s.is_nan()) {
            (true, _) => scan.below_ground,
            (false, true) => scan.outside_flow,
            (false, false) => return Ok(known_m_s),
        };
        match outside {
            // A scene with lines below the ground was refused, but for air behind its last sample.
            Outside::Error {} if z_m >= 0.0 => Err(Error::OutsideFlow {
                time_s: beam.time_s,
                elevation_rad,
                range_m,
                x_m,
                y_m,
                z_m,
            }),
            Outside::Error {} | Outside::Mask {} => Ok(f64::NAN),
        }
    };
    points_m
        .iter()
        .zip(known_m_s)
        .zip(range_m)
        .map(checked)
        .collect()
}

/// Places along a beam, m, and the radial velocity there, m/s.
type Along = (Vec<[f64; 3]>, Vec<f64>);

/// The radial velocity of the flow along a beam; NaN where it is not known.
///
/// Turbulence is summed along lines of equally spaced ranges, which layers and gates are.
pub(crate) fn known_velocity_m_s(
    wind: &SceneWind,
    beam: &Beam,
    range_m: &[f64],
) -> Result<Along, Error> {
    let points_m: Vec<[f64; 3]> = range_m
        .iter()
        .map(|range_m| beam.at_range_m(*range_m))
        .collect();
    let time_s = wind.start_s + beam.time_s;
    if let Some(step_m) = equal_step_m(range_m).filter(|_| wind.has_eddies()) {
        let line = SampledLine {
            origin_m: points_m[0],
            direction: beam.direction.0,
            step_m,
        };
        let mut along_m_s = vec![0.0; points_m.len()];
        wind.wind()
            .along_line_into(&line, 0, time_s, &mut along_m_s)?;
        // Air at rest, seen from a lidar that moves.
        let still_m_s = beam
            .direction
            .radial_velocity_m_s([0.0; 3], beam.velocity_m_s);
        for velocity_m_s in &mut along_m_s {
            *velocity_m_s += still_m_s;
        }
        return Ok((points_m, along_m_s));
    }
    let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
    wind.wind()
        .velocity_into(&points_m, time_s, &mut velocity_m_s)?;
    let along = velocity_m_s
        .iter()
        .map(|v| beam.direction.radial_velocity_m_s(*v, beam.velocity_m_s))
        .collect();
    Ok((points_m, along))
}

/// Distance between ranges that are equally spaced, m.
fn equal_step_m(range_m: &[f64]) -> Option<f64> {
    let first_m = range_m.first()?;
    let last_m = range_m.last()?;
    let steps = range_m.len() - 1;
    let step_m = (last_m - first_m) / steps.max(1) as f64;
    let is_equal = |(i, at_m): (usize, &f64)| {
        (at_m - first_m - i as f64 * step_m).abs() <= 1e-9 * last_m.abs()
    };
    let is_spaced = steps > 0 && step_m > 0.0 && range_m.iter().enumerate().all(is_equal);
    is_spaced.then_some(step_m)
}
