//! The fastest air on the lines of sight, which the band of the detector must hold.
//!
//! Check: the peaks of flows with known ones.

use crate::Error;
use crate::interpolation::linspace;
use crate::measure::air::known_velocity_m_s;
use crate::plan::Setup;

/// Lines and places along them at which the fastest air is looked for first.
const MOST_LINES: usize = 1000;
const MOST_PLACES: usize = 100_000;

/// Largest radial velocity of the air on the lines of sight, seen from the lidar, m/s.
///
/// # Errors
/// What the wind refuses.
pub(super) fn fastest_m_s(setup: &Setup) -> Result<f64, Error> {
    let (scan, schedule, wind) = (
        &setup.scene.content.scan,
        &setup.geometry.schedule,
        &setup.wind,
    );
    let fastest_of = |line: usize, range_m: &[f64]| -> Result<(f64, f64), Error> {
        let mut beam = schedule.middle(line);
        if wind.max_speed_m_s > 0.0 {
            // Fields are not all read for this: what no node of them exceeds is known.
            beam.time_s = 0.0;
        }
        let (points_m, velocity_m_s) = known_velocity_m_s(setup, &beam, range_m)?;
        let seen = points_m
            .iter()
            .zip(velocity_m_s)
            .zip(range_m)
            .filter(|((point, v), _)| point[2] >= 0.0 && !v.is_nan());
        let speeds = seen.map(|((_, v), range_m)| (v.abs(), *range_m));
        Ok(speeds
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((0.0, scan.range_min_m)))
    };
    let lines = schedule.lines.len().min(MOST_LINES);
    let line = |i: usize| i * schedule.lines.len() / lines;
    let range_m = linspace(
        scan.range_min_m,
        scan.range_max_m,
        (MOST_PLACES / lines).clamp(16, 1000),
    );
    let on_line = |i: usize| fastest_of(line(i), &range_m).map(|(v, at_m)| (v, at_m, line(i)));
    let mut found = (0..lines).map(on_line).collect::<Result<Vec<_>, Error>>()?;
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    // The peak of a vortex lies between places: about those of the fastest lines again.
    let step_m = range_m[1] - range_m[0];
    let mut fastest_m_s = found.first().map_or(0.0, |fastest| fastest.0);
    for (_, at_m, line) in found.into_iter().take(8) {
        let near_m = linspace(
            (at_m - step_m).max(scan.range_min_m),
            (at_m + step_m).min(scan.range_max_m),
            65,
        );
        fastest_m_s = fastest_m_s.max(fastest_of(line, &near_m)?.0);
    }
    let own_m_s = scan
        .lidar
        .velocity_m_s
        .iter()
        .map(|v| v * v)
        .sum::<f64>()
        .sqrt();
    let of_fields_m_s = if wind.max_speed_m_s > 0.0 {
        wind.max_speed_m_s + own_m_s
    } else {
        0.0
    };
    Ok(fastest_m_s.max(of_fields_m_s))
}
