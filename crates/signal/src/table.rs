//! Tables over range: checks, and linear interpolation.
//!
//! Check: the tests of `medium` and `efficiency`.

use crate::Error;
use crate::error::{check_amounts, check_any, check_increasing, check_length};

/// Ranges that are finite and increase, at least one.
pub(crate) fn check_ranges(range_m: &[f64]) -> Result<(), Error> {
    check_any("range_m", range_m.len())?;
    check_increasing("range_m", range_m, "larger than the range before")
}

/// One value per range, finite and not negative.
pub(crate) fn check_values(
    field: &'static str,
    values: &[f64],
    ranges: usize,
) -> Result<(), Error> {
    check_length(field, values.len(), ranges)?;
    check_amounts(field, values)
}

/// Interval of a table that holds a range, and the fraction of it before the range; `None`
/// beyond the table.
pub(crate) fn locate(table_m: &[f64], range_m: f64) -> Option<(usize, f64)> {
    let first_m = *table_m.first()?;
    let last_m = *table_m.last()?;
    if !(range_m >= first_m && range_m <= last_m) {
        return None;
    }
    let index = table_m
        .partition_point(|r| *r <= range_m)
        .saturating_sub(1)
        .min(table_m.len().saturating_sub(2));
    match table_m.get(index + 1) {
        Some(next) => Some((index, (range_m - table_m[index]) / (next - table_m[index]))),
        None => Some((index, 0.0)),
    }
}

/// Value of a table at a fraction of an interval, as found by [`locate`].
pub(crate) fn value(values: &[f64], index: usize, fraction: f64) -> f64 {
    match values.get(index + 1) {
        Some(next) => values[index] + fraction * (next - values[index]),
        None => values[index],
    }
}
