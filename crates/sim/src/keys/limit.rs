//! Limits of single keys, which are declared beside their defaults, and the one validator of scenes and cases, which
//! collects every value that is out of its limits.
//!
//! Check: each limit of a scene and of a case is broken once, and the refusal names its key.

use super::problem::Problem;
use super::words::unit_of;
use std::fmt::{Debug, Display};
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

/// A name that has to be stated, and what it names.
pub(crate) struct Named(pub(crate) &'static str);

/// Above 0; `inf` means none.
pub(crate) const ABOVE_ZERO_OR_INF: Number =
    Number(|value| value > 0.0, "above 0 {}, or inf for none");
/// Above 0.
pub(crate) const ABOVE_ZERO: Number = Number(
    |value| value.is_finite() && value > 0.0,
    "a finite number above 0",
);
/// 0 or more.
pub(crate) const ZERO_OR_MORE: Number = Number(
    |value| value.is_finite() && value >= 0.0,
    "a finite number, 0 or more",
);
/// Neither infinite nor no number.
pub(crate) const FINITE: Number = Number(f64::is_finite, "finite");

impl Limit<String> for Named {
    fn hold(&self, key: &str, name: &String, c: &mut Checker<'_>) {
        if name.is_empty() {
            c.refuse(key, Problem::ABSENT, self.0);
        }
    }
}

impl Limit<f64> for Number {
    fn hold(&self, key: &str, value: &f64, c: &mut Checker<'_>) {
        c.require(
            (self.0)(*value),
            key,
            value,
            self.1.replace("{}", unit_of(key).unwrap_or_default()),
        );
    }
}

impl<T: Debug, W: ToString> Is<T, W> {
    pub(crate) fn hold(&self, key: &str, value: &T, c: &mut Checker<'_>) {
        c.require((self.0)(value), key, value, self.1.to_string());
    }
}

impl Limit<f64> for RangeInclusive<f64> {
    fn hold(&self, key: &str, value: &f64, c: &mut Checker<'_>) {
        let low = self.start();
        let high = self.end();
        let unit = unit_of(key).unwrap_or_default();
        c.require(
            self.contains(value),
            key,
            value,
            format!("a number from {low:?} to {high:?} {unit}").trim_end(),
        );
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
        values
            .iter()
            .enumerate()
            .for_each(|(i, value)| self.hold(&format!("{key}[{i}]"), value, c));
    }
}

/// Each part of a vector, which is shown whole.
impl<T: Debug, L: Limit<T>, const N: usize> Limit<[T; N]> for L {
    fn hold(&self, key: &str, values: &[T; N], c: &mut Checker<'_>) {
        let mut parts = Checker::new(&|_| true);
        values
            .iter()
            .for_each(|value| self.hold(key, value, &mut parts));
        if let Some(problem) = parts.into_problems().into_iter().next() {
            c.refuse(key, &format!("{values:?}"), problem.allowed);
        }
    }
}

/// One side of a limit between keys: the key, its value, what is allowed beside the others.
pub(crate) type Side<'a> = (&'a str, String, String);

/// The side of a number.
pub(crate) fn side(key: &str, value: f64, allowed: String) -> Side<'_> {
    (key, format!("{value:?}"), allowed)
}

/// Collects what is wrong; `is_stated` says which keys the file states.
pub(crate) struct Checker<'s> {
    found: Vec<Problem>,
    is_stated: &'s dyn Fn(&str) -> bool,
}

impl<'s> Checker<'s> {
    /// Nothing is wrong yet.
    pub(crate) fn new(is_stated: &'s dyn Fn(&str) -> bool) -> Self {
        Self {
            found: Vec::new(),
            is_stated,
        }
    }

    /// What was found, in the order of the checks.
    pub(crate) fn into_problems(self) -> Vec<Problem> {
        self.found
    }

    /// Whether nothing was found so far.
    pub(crate) fn is_good(&self) -> bool {
        self.found.is_empty()
    }

    /// Whether a key, one of its elements or a key of its table has a problem.
    pub(crate) fn has_problem_of(&self, key: &str) -> bool {
        self.found.iter().any(|problem| {
            let rest = problem.key.strip_prefix(key);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        })
    }

    /// A problem whose value is shown as `value` says it.
    pub(crate) fn refuse(&mut self, key: &str, value: &str, allowed: impl Into<String>) {
        self.found.push(Problem::new(key, value, allowed));
    }

    /// A condition on a value.
    pub(crate) fn require(
        &mut self,
        ok: bool,
        key: &str,
        value: impl Debug,
        allowed: impl Into<String>,
    ) -> bool {
        if !ok {
            // `{:?}` writes 1e-9 where `{}` would write all the zeros, and quotation marks about texts.
            self.refuse(key, &format!("{value:?}"), allowed);
        }
        ok
    }

    /// Two keys of the same unit, of which the first is `relation` the second: "above", "below", "at least" or "at most".
    pub(crate) fn compare<T: PartialOrd + Debug + Display>(
        &mut self,
        keys: [&str; 2],
        values: [T; 2],
        relation: &str,
    ) -> bool {
        let [a, b] = &values;
        let (is_fulfilled, reverse) = match relation {
            "above" => (a > b, "below"),
            "below" => (a < b, "above"),
            "at least" => (a >= b, "at most"),
            _ => (a <= b, "at least"),
        };
        let unit = unit_of(keys[0]).unwrap_or_default();
        let allowed = format!("{relation} {}, {b} {unit}", keys[1]);
        let reverse_allowed = format!("{reverse} {}, {a} {unit}", keys[0]);
        let sides = [
            (keys[0], format!("{a:?}"), allowed.trim_end().to_owned()),
            (
                keys[1],
                format!("{b:?}"),
                reverse_allowed.trim_end().to_owned(),
            ),
        ];
        self.between(is_fulfilled, &sides)
    }

    /// A limit between keys: the first that the file states has to give way, or else the first.
    pub(crate) fn between(&mut self, ok: bool, sides: &[Side<'_>]) -> bool {
        let blamed = sides
            .iter()
            .find(|(key, ..)| (self.is_stated)(key))
            .or(sides.first());
        if let Some((key, value, allowed)) = blamed.filter(|_| !ok) {
            self.refuse(key, value, allowed.clone());
        }
        ok
    }
}
