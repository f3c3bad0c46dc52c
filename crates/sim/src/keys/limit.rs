//! Limits of single keys, which stand beside their defaults where a section is declared.
//!
//! Check: each limit of a scene is broken once, and the refusal names its key.

use super::checker::Checker;
use super::words::unit_of;
use std::ops::RangeInclusive;

/// A table that knows the limits of its keys.
pub(crate) trait Limited {
    /// Holds the keys of the table at `at` against their limits.
    fn check_limits(&self, at: &str, c: &mut Checker<'_>);
}

/// What a value must be.
pub(crate) trait Limit<T> {
    /// Holds the value of a key against it.
    fn hold(&self, key: &str, value: &T, c: &mut Checker<'_>);
}

/// The limits of the keys of a table.
pub(crate) struct Keys;

/// Above 0; `inf` stands for none.
pub(crate) struct AboveZeroOrInf;

/// In a range; `-inf` stands for none.
pub(crate) struct NothingOr(pub(crate) RangeInclusive<f64>);

impl<T: Limited> Limit<T> for Keys {
    fn hold(&self, key: &str, value: &T, c: &mut Checker<'_>) {
        value.check_limits(key, c);
    }
}

impl Limit<f64> for RangeInclusive<f64> {
    fn hold(&self, key: &str, value: &f64, c: &mut Checker<'_>) {
        c.within(key, *value, *self.start(), *self.end(), unit_of(key).unwrap_or_default());
    }
}

impl Limit<usize> for RangeInclusive<usize> {
    fn hold(&self, key: &str, value: &usize, c: &mut Checker<'_>) {
        c.count(key, *value, *self.start(), *self.end());
    }
}

impl Limit<u32> for RangeInclusive<u32> {
    fn hold(&self, key: &str, value: &u32, c: &mut Checker<'_>) {
        c.count(key, *value as usize, *self.start() as usize, *self.end() as usize);
    }
}

impl Limit<f64> for AboveZeroOrInf {
    fn hold(&self, key: &str, value: &f64, c: &mut Checker<'_>) {
        let allowed = format!("above 0 {}, or inf for none", unit_of(key).unwrap_or_default());
        c.require(*value > 0.0, key, value, allowed);
    }
}

impl Limit<f64> for NothingOr {
    fn hold(&self, key: &str, value: &f64, c: &mut Checker<'_>) {
        let ok = *value == f64::NEG_INFINITY || self.0.contains(value);
        let unit = unit_of(key).unwrap_or_default();
        c.require(
            ok,
            key,
            value,
            format!("a number from {:?} to {:?} {unit}, or -inf for none", self.0.start(), self.0.end()),
        );
    }
}

/// What is absent has no limit.
impl<T, L: Limit<T>> Limit<Option<T>> for L {
    fn hold(&self, key: &str, value: &Option<T>, c: &mut Checker<'_>) {
        value.iter().for_each(|value| self.hold(key, value, c));
    }
}

/// Each value of a list.
impl<T, L: Limit<T>> Limit<Vec<T>> for L {
    fn hold(&self, key: &str, values: &Vec<T>, c: &mut Checker<'_>) {
        values.iter().for_each(|value| self.hold(key, value, c));
    }
}

/// Each part of a vector.
impl<T, L: Limit<T>, const N: usize> Limit<[T; N]> for L {
    fn hold(&self, key: &str, values: &[T; N], c: &mut Checker<'_>) {
        values.iter().for_each(|value| self.hold(key, value, c));
    }
}
