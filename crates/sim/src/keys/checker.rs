//! The one validator of scenes and cases: it collects every value that is out of its limits.

use super::problem::Problem;
use std::fmt::Debug;

/// One side of a limit between keys: the key, its value, what is allowed beside the others.
pub(crate) type Side<'a> = (&'a str, String, String);

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

    /// A limit between keys: the first that the file states has to give way, or else the first.
    pub(crate) fn between(&mut self, ok: bool, sides: &[Side<'_>]) -> bool {
        let blamed = sides.iter().find(|(key, ..)| (self.is_stated)(key)).or(sides.first());
        if let Some((key, value, allowed)) = blamed.filter(|_| !ok) {
            self.refuse(key, value, allowed.clone());
        }
        ok
    }

    /// Finite and in `[low, high]`.
    pub(crate) fn within(&mut self, key: &str, value: f64, low: f64, high: f64, unit: &str) -> bool {
        let ok = value >= low && value <= high && value.is_finite();
        self.require(ok, key, value, format!("a number from {low:?} to {high:?} {unit}").trim_end())
    }

    /// A whole number in `[low, high]`.
    pub(crate) fn count(&mut self, key: &str, value: usize, low: usize, high: usize) -> bool {
        self.require((low..=high).contains(&value), key, value, format!("a whole number from {low} to {high}"))
    }

    #[cfg(feature = "flow")]
    pub(crate) fn positive(&mut self, key: &str, value: f64) {
        self.require(value.is_finite() && value > 0.0, key, value, "a finite number above 0");
    }

    #[cfg(feature = "flow")]
    pub(crate) fn not_negative(&mut self, key: &str, value: f64) {
        self.require(value.is_finite() && value >= 0.0, key, value, "a finite number, 0 or more");
    }

    /// Numbers of cells of a mesh.
    #[cfg(feature = "flow")]
    pub(crate) fn cells(&mut self, key: &str, cells: &[usize]) {
        let ok = cells.iter().all(|n| (1..=100_000).contains(n));
        self.require(ok, key, cells, "whole numbers from 1 to 100000");
    }

    /// Strength of the stretching of a mesh.
    #[cfg(feature = "flow")]
    pub(crate) fn stretch(&mut self, key: &str, value: f64) {
        self.require((0.0..=20.0).contains(&value), key, value, "a number from 0 (equal cells) to 20");
    }
}
