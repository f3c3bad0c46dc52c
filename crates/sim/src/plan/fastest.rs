//! The fastest air on the lines of sight, which the band of the detector must hold.

use crate::Error;
use crate::interpolation::linspace;
use crate::plan::Plan;
use crate::plan::line_wind::known_velocity_m_s;

/// Most lines, and most points along all of them, at which the fastest air is looked for first.
const MOST_LINES: usize = 300;
const MOST_POINTS: usize = 100_000;

/// Largest radial velocity of the air on the lines of sight, relative to the lidar, m/s.
///
/// # Errors
/// Fails if the wind refuses a point.
pub(super) fn fastest_m_s(plan: &Plan) -> Result<f64, Error> {
    let scan = &plan.scene().scan;
    let all_lines = plan.geometry.schedule.lines.len();
    let lines = all_lines.min(MOST_LINES);
    let range_m = linspace(
        scan.range_min_m,
        scan.range_max_m,
        (MOST_POINTS / lines).clamp(16, 1000),
    );
    let mut found = Vec::with_capacity(lines);
    for i in 0..lines {
        let line = i * all_lines / lines;
        let (fastest_m_s, at_m) = fastest_of_line(plan, line, &range_m)?;
        found.push((fastest_m_s, at_m, line));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    // The peak of a vortex lies between the points and the lines: about those of the fastest lines again.
    let stride = all_lines.div_ceil(lines);
    let step_m = range_m[1] - range_m[0];
    let mut fastest_m_s = found.first().map_or(0.0, |fastest| fastest.0);
    for (_, at_m, line) in found.into_iter().take(8) {
        let near_m = linspace(
            (at_m - step_m).max(scan.range_min_m),
            (at_m + step_m).min(scan.range_max_m),
            65,
        );
        let end = (line + stride).min(all_lines);
        for beside in (line + 1).saturating_sub(stride)..end {
            let (near_m_s, _) = fastest_of_line(plan, beside, &near_m)?;
            fastest_m_s = fastest_m_s.max(near_m_s);
        }
    }
    let [x_m_s, y_m_s, z_m_s] = scan.lidar.velocity_m_s;
    let lidar_m_s = (x_m_s * x_m_s + y_m_s * y_m_s + z_m_s * z_m_s).sqrt();
    let of_fields_m_s = if plan.wind.max_speed_m_s > 0.0 {
        plan.wind.max_speed_m_s + lidar_m_s
    } else {
        0.0
    };
    Ok(fastest_m_s.max(of_fields_m_s))
}

/// Largest speed along the middle of a line above the ground, m/s, and its range, m.
fn fastest_of_line(plan: &Plan, line: usize, range_m: &[f64]) -> Result<(f64, f64), Error> {
    let mut beam = plan.geometry.schedule.middle(line);
    if plan.wind.max_speed_m_s > 0.0 {
        // Fields are not all read for this: the largest speed of their nodes is known.
        beam.time_s = 0.0;
    }
    let (points_m, velocity_m_s) = known_velocity_m_s(&plan.wind, &beam, range_m)?;
    let mut fastest_m_s = 0.0;
    let mut fastest_at_m = plan.scene().scan.range_min_m;
    for (i, point_m) in points_m.iter().enumerate() {
        let speed_m_s = velocity_m_s[i].abs();
        if point_m[2] >= 0.0 && speed_m_s >= fastest_m_s {
            fastest_m_s = speed_m_s;
            fastest_at_m = range_m[i];
        }
    }
    Ok((fastest_m_s, fastest_at_m))
}
