//! What the draws find: each number beside its definition, with the tolerance that the definition itself gives.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::Location;

/// All comparisons of one number.
#[derive(Debug, Clone)]
pub(crate) struct Tally {
    /// Where its definition is computed.
    pub(crate) place: &'static Location<'static>,
    /// Draws that held it.
    pub(crate) draws: usize,
    /// Comparisons, all draws together.
    pub(crate) comparisons: usize,
    /// Largest deviation in tolerances, or in standard errors where `is_random`.
    pub(crate) worst: f64,
    /// Where that was: draw, value found, value by the definition.
    pub(crate) at: String,
    is_random: bool,
    /// Sum over the draws of the mean deviation in standard errors.
    drift: f64,
}

impl Tally {
    /// Deviation over what is allowed; above 1 is a fault.
    pub(crate) fn excess(&self) -> f64 {
        if !self.is_random {
            return self.worst;
        }
        // The largest of n normal numbers exceeds this one time in ten thousand, the mean of the draws one in 16 000.
        let largest = (2.0 * (2e4 * self.comparisons as f64).ln()).sqrt();
        (self.worst / largest).max(self.drift.abs() / (self.draws as f64).sqrt() / 4.0)
    }

    /// The worst deviation in words.
    pub(crate) fn shown(&self) -> String {
        match self.is_random {
            true => format!("{:.2} standard errors", self.worst),
            false => format!("{:.3} of the tolerance", self.worst),
        }
    }

    fn add(&mut self, other: Self) {
        self.draws += other.draws;
        self.comparisons += other.comparisons;
        self.drift += other.drift;
        if other.worst > self.worst || other.worst.is_nan() {
            (self.worst, self.at, self.place) = (other.worst, other.at, other.place);
        }
    }
}

/// The comparisons of one draw, or of all.
#[derive(Debug, Default)]
pub(crate) struct Ledger {
    /// Which draw.
    pub(crate) draw: String,
    /// Each number.
    pub(crate) tallies: BTreeMap<String, Tally>,
    /// Names of all numbers that the program wrote or printed: file or command, and column or key.
    pub(crate) seen: BTreeSet<String>,
    /// Draws that the program refused.
    pub(crate) refused: Vec<String>,
    drift: BTreeMap<String, (f64, f64)>,
}

impl Ledger {
    pub(crate) fn new(draw: String) -> Self {
        Self {
            draw,
            ..Self::default()
        }
    }

    /// A number and its definition, apart by at most `tolerance`; both may be missing (NaN).
    #[track_caller]
    pub(crate) fn equal(&mut self, number: &str, found: f64, right: f64, tolerance: f64) {
        let apart = match found == right || found.is_nan() && right.is_nan() {
            true => 0.0,
            false => (found - right).abs() / tolerance,
        };
        // What is missing on one side only is as wrong as can be.
        let apart = if apart.is_nan() { f64::INFINITY } else { apart };
        self.enter(number, apart, false, &format!("{found:.9} for {right:.9}"));
    }

    /// A mean of random numbers against its expectation.
    #[track_caller]
    pub(crate) fn mean(&mut self, number: &str, found: f64, right: f64, standard_error: f64) {
        let z = (found - right) / standard_error;
        let z = if z.is_nan() { f64::INFINITY } else { z };
        let (sum, count) = self.drift.entry(number.into()).or_default();
        (*sum, *count) = (*sum + z, *count + 1.0);
        self.enter(
            number,
            z.abs(),
            true,
            &format!("{found:.6} for {right:.6} +- {standard_error:.6}"),
        );
    }

    /// Something that holds or does not.
    #[track_caller]
    pub(crate) fn holds(&mut self, number: &str, is_so: bool, what: &str) {
        self.enter(number, if is_so { 0.0 } else { f64::INFINITY }, false, what);
    }

    /// The program wrote or printed this number.
    pub(crate) fn saw(&mut self, source: &str, name: &str) {
        self.seen.insert(format!("{source}: {name}"));
    }

    #[track_caller]
    fn enter(&mut self, number: &str, apart: f64, is_random: bool, at: &str) {
        let (place, at) = (Location::caller(), format!("draw {}: {at}", self.draw));
        let one = Tally {
            place,
            draws: 1,
            comparisons: 1,
            worst: apart,
            at,
            is_random,
            drift: 0.0,
        };
        match self.tallies.get_mut(number) {
            Some(tally) => {
                tally.add(one);
                tally.draws = 1;
            }
            None => drop(self.tallies.insert(number.into(), one)),
        }
    }

    /// Takes the comparisons of a draw in.
    pub(crate) fn add(&mut self, draw: Self) {
        for (number, mut tally) in draw.tallies {
            tally.drift = draw
                .drift
                .get(&number)
                .map_or(0.0, |(sum, count)| sum / count);
            match self.tallies.get_mut(&number) {
                Some(known) => known.add(tally),
                None => drop(self.tallies.insert(number, tally)),
            }
        }
        self.seen.extend(draw.seen);
        self.refused.extend(draw.refused);
    }
}
