//! The one validator of scenes and cases: it collects every value that is out of its limits.

use super::problem::Problem;
use super::words::unit_of;
use std::fmt::{Debug, Display};

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
        Self { found: Vec::new(), is_stated }
    }

    /// What was found, in the order in which it was asked for.
    pub(crate) fn into_problems(self) -> Vec<Problem> {
        self.found
    }

    /// Whether nothing was found so far.
    pub(crate) fn is_good(&self) -> bool {
        self.found.is_empty()
    }

    /// A problem whose value is shown as `value` says it.
    pub(crate) fn refuse(&mut self, key: &str, value: &str, allowed: impl Into<String>) {
        self.found.push(Problem { key: key.into(), value: value.into(), allowed: allowed.into() });
    }

    /// A condition on a value.
    pub(crate) fn require(&mut self, ok: bool, key: &str, value: impl Debug, allowed: impl Into<String>) -> bool {
        if !ok {
            // `{:?}` writes 1e-9 where `{}` would write all the zeros, and quotation marks about texts.
            self.refuse(key, &format!("{value:?}"), allowed);
        }
        ok
    }

    /// Two keys of the same unit, of which the first is `word` the second: "above", "below", "at least" or "at most".
    pub(crate) fn compare<T: PartialOrd + Debug + Display>(
        &mut self,
        keys: [&str; 2],
        values: [T; 2],
        word: &str,
    ) -> bool {
        let [a, b] = &values;
        let (ok, reverse) = match word {
            "above" => (a > b, "below"),
            "below" => (a < b, "above"),
            "at least" => (a >= b, "at most"),
            _ => (a <= b, "at least"),
        };
        let side = |i: usize, word: &str| {
            let other = format!("{word} {}, {} {}", keys[1 - i], values[1 - i], unit_of(keys[0]).unwrap_or_default());
            (keys[i], format!("{:?}", values[i]), other.trim_end().to_owned())
        };
        self.between(ok, &[side(0, word), side(1, reverse)])
    }

    /// A limit between keys: the first that the file states has to give way, or else the first.
    pub(crate) fn between(&mut self, ok: bool, sides: &[Side<'_>]) -> bool {
        let blamed = sides.iter().find(|(key, ..)| (self.is_stated)(key)).or(sides.first());
        if let Some((key, value, allowed)) = blamed.filter(|_| !ok) {
            self.refuse(key, value, allowed.clone());
        }
        ok
    }
}
