//! Winds that are known at some times and linear between them.
//!
//! Check: the series of planes and of fields.

use super::wind::Wind;
use crate::Error;
use crate::error::check;

/// Points handled at once, so that the scratch stays on the stack.
pub(super) const BATCH: usize = 256;

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
    later: &impl Wind,
    weight: f64,
    points_m: &[[f64; 3]],
    time_s: f64,
    out_m_s: &mut [[f64; 3]],
) -> Result<(), Error> {
    let mut scratch = [[0.0; 3]; BATCH];
    for (points, outs) in points_m.chunks(BATCH).zip(out_m_s.chunks_mut(BATCH)) {
        let part = &mut scratch[..points.len()];
        later.velocity_into(points, time_s, part)?;
        for (out, later) in outs.iter_mut().zip(part.iter()) {
            for (o, l) in out.iter_mut().zip(later) {
                *o += weight * (l - *o);
            }
        }
    }
    Ok(())
}
