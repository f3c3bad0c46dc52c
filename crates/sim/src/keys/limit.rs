//! Limits of single keys, which stand beside their defaults where they are declared.
//!
//! Check: each limit of a scene and of a case is broken once, and the refusal names its key.

use super::checker::Checker;
use super::words::unit_of;
use std::fmt::Debug;
use std::ops::RangeInclusive;

/// What a value must be.
pub(crate) trait Limit<T> {
    /// Holds the value of a key against it.
    fn hold(&self, key: &str, value: &T, c: &mut Checker<'_>);
}

/// A condition on a number, and its words, in which `{}` is the unit of the key.
pub(crate) struct Number(pub(crate) fn(f64) -> bool, pub(crate) &'static str);

/// A condition on a whole value, lists among them, and its words.
pub(crate) struct Is<T, W>(pub(crate) fn(&T) -> bool, pub(crate) W);

/// In a range; `-inf` stands for none.
pub(crate) struct NothingOr(pub(crate) RangeInclusive<f64>);

/// Above 0; `inf` stands for none.
pub(crate) const ABOVE_ZERO_OR_INF: Number = Number(|value| value > 0.0, "above 0 {}, or inf for none");
/// Above 0.
#[cfg(feature = "flow")]
pub(crate) const ABOVE_ZERO: Number = Number(|value| value.is_finite() && value > 0.0, "a finite number above 0");
/// 0 or more.
pub(crate) const ZERO_OR_MORE: Number = Number(|value| value.is_finite() && value >= 0.0, "a finite number, 0 or more");
/// Neither infinite nor no number.
#[cfg(feature = "flow")]
pub(crate) const FINITE: Number = Number(f64::is_finite, "finite");

impl Limit<f64> for Number {
    fn hold(&self, key: &str, value: &f64, c: &mut Checker<'_>) {
        c.require((self.0)(*value), key, value, self.1.replace("{}", unit_of(key).unwrap_or_default()));
    }
}

impl<T: Debug, W: ToString> Is<T, W> {
    pub(crate) fn hold(&self, key: &str, value: &T, c: &mut Checker<'_>) {
        c.require((self.0)(value), key, value, self.1.to_string());
    }
}

impl Limit<f64> for RangeInclusive<f64> {
    fn hold(&self, key: &str, value: &f64, c: &mut Checker<'_>) {
        let (low, high, unit) = (self.start(), self.end(), unit_of(key).unwrap_or_default());
        c.require(self.contains(value), key, value, format!("a number from {low:?} to {high:?} {unit}").trim_end());
    }
}

impl Limit<f64> for NothingOr {
    fn hold(&self, key: &str, value: &f64, c: &mut Checker<'_>) {
        let (low, high, unit) = (self.0.start(), self.0.end(), unit_of(key).unwrap_or_default());
        let allowed = format!("a number from {low:?} to {high:?} {unit}, or -inf for none");
        c.require(*value == f64::NEG_INFINITY || self.0.contains(value), key, value, allowed);
    }
}

/// Ranges of whole numbers.
macro_rules! whole {
    ($($ty:ty),*) => {
        $(impl Limit<$ty> for RangeInclusive<$ty> {
            fn hold(&self, key: &str, value: &$ty, c: &mut Checker<'_>) {
                let allowed = format!("a whole number from {} to {}", self.start(), self.end());
                c.require(self.contains(value), key, value, allowed);
            }
        })*
    };
}

whole!(u32, u64, usize);

/// What is absent has no limit.
impl<T, L: Limit<T>> Limit<Option<T>> for L {
    fn hold(&self, key: &str, value: &Option<T>, c: &mut Checker<'_>) {
        value.iter().for_each(|value| self.hold(key, value, c));
    }
}

/// Each value of a list, which is named itself.
impl<T, L: Limit<T>> Limit<Vec<T>> for L {
    fn hold(&self, key: &str, values: &Vec<T>, c: &mut Checker<'_>) {
        values.iter().enumerate().for_each(|(i, value)| self.hold(&format!("{key}[{i}]"), value, c));
    }
}

/// Each part of a vector, which is shown whole.
impl<T: Debug, L: Limit<T>, const N: usize> Limit<[T; N]> for L {
    fn hold(&self, key: &str, values: &[T; N], c: &mut Checker<'_>) {
        let mut parts = Checker::new(&|_| true);
        values.iter().for_each(|value| self.hold(key, value, &mut parts));
        if let Some(problem) = parts.into_problems().into_iter().next() {
            c.refuse(key, &format!("{values:?}"), problem.allowed);
        }
    }
}
