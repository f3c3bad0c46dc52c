//! Winds that are known at some times and linear between them.
//!
//! Check: the series of planes and of fields.

use super::wind::{Wind, combine};
use crate::Error;
use crate::error::check;

/// Refuses no times, and times that are not finite or do not increase \[s\].
pub(super) fn check_times(time_s: &[f64]) -> Result<(), Error> {
    check("number of times", time_s.len() as f64, "at least 1", |n| n >= 1.0)?;
    let mut last_s = f64::NEG_INFINITY;
    for &time_s in time_s {
        check("time_s", time_s, "finite and greater than the one before", |t| t > last_s)?;
        last_s = time_s;
    }
    Ok(())
}

/// The last of checked times that is not after `time_s`, and the weight of the next one if it counts.
pub(super) fn about(times_s: &[f64], time_s: f64) -> Result<(usize, Option<f64>), Error> {
    let last = times_s.len() - 1;
    check("time_s", time_s, "between the first and the last time of the series", |t| {
        times_s[0] <= t && t <= times_s[last]
    })?;
    let at = times_s.partition_point(|&t| t <= time_s) - 1;
    let from_s = times_s[at];
    let weight = (time_s != from_s && at != last).then(|| (time_s - from_s) / (times_s[at + 1] - from_s));
    Ok((at, weight))
}

/// Moves velocities by the share `weight` towards those of a later wind.
pub(super) fn blend(
    later: &dyn Wind,
    weight: f64,
    points_m: &[[f64; 3]],
    time_s: f64,
    out_m_s: &mut [[f64; 3]],
) -> Result<(), Error> {
    combine(later, points_m, time_s, out_m_s, |out, later| *out += weight * (later - *out))
}
