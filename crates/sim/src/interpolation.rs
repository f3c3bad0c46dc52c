//! Points of a table: evenly spaced ones, and what lies between them.
//!
//! Check: wherever they are used; ends and straight lines.

/// `points` values from `low` to `high`, both included.
pub(crate) fn linspace(low: f64, high: f64, points: usize) -> Vec<f64> {
    let step = (high - low) / (points.max(2) - 1) as f64;
    (0..points)
        .map(|i| {
            if i + 1 == points {
                high
            } else {
                low + i as f64 * step
            }
        })
        .collect()
}

/// Straight lines between the points of a table that is not empty; beyond its ends as at the ends.
pub(crate) fn interpolate(range_m: &[f64], values: &[f64], at_m: f64) -> f64 {
    let above = range_m.partition_point(|r| *r <= at_m);
    match (values.get(above.wrapping_sub(1)), values.get(above)) {
        (Some(low), Some(high)) => {
            let part = (at_m - range_m[above - 1]) / (range_m[above] - range_m[above - 1]);
            low + part * (high - low)
        }
        (Some(end), None) | (None, Some(end)) => *end,
        (None, None) => f64::NAN,
    }
}
