//! `wakescope score`: predictions of any method against the truth of a data set, with confidence.
//!
//! | module | what it does |
//! |---|---|
//! | `truth`, `predictions` | plain structures; reading of predictions |
//! | `matching` | which predicted vortex is which true one |
//! | `bins`, `sums`, `ranked`, `statistics` | groups of scans; errors, coverage, detection where flights count several times |
//! | `table`, `pictures` | the files |
//! | `readings` | which predictions the test splits were scored with |
//!
//! Confidence intervals are percentiles of bootstrap draws of whole flights (Efron 1979): scans of one flight share air and
//! instrument and are no independent sample.
//! Check: a case of an independent program (`tests/reference/score`); perfect predictions; the order of rows; coverage of the
//! intervals.

mod bins;
mod matching;
#[cfg(feature = "plots")]
mod pictures;
mod predictions;
mod ranked;
mod readings;
mod statistics;
mod sums;
mod table;
mod truth;

#[cfg(test)]
mod score_tests;

#[cfg(feature = "plots")]
pub use pictures::figure;
pub use predictions::{
    MOST_VORTICES, PredictedScan, PredictedVortex, Predictions, prediction_table,
};
pub use readings::add_reading;
pub use table::{json, summary, table};
pub use truth::{TrueFlight, TrueScan, TrueVortex, Truth, VortexValues};

use crate::io::data_set::Split;
use crate::streams::stream;
use bins::{Bin, Group, bins};
use matching::MatchedScan;
use rand_xoshiro::rand_core::Rng;
use ranked::{operating_curve, quantile};
use rayon::prelude::*;
use statistics::Statistic;

/// Bootstrap draws.
const DRAWS: usize = 1000;

/// Fewest flights of a bin that has intervals.
const LEAST_FLIGHTS: usize = 5;

/// Probabilities of the ends of an interval of 95 %.
const ENDS: [f64; 2] = [0.025, 0.975];

crate::keys::choice! {
    /// What is predicted of a vortex, by the name of its column.
    Quantity {
        /// Lateral coordinate, m.
        LateralPosition = "y_m",
        /// Height above ground, m.
        Height = "z_m",
        /// Circulation averaged over radii of 5 to 15 m, m²/s.
        Circulation = "gamma_5_15_m2_s",
    }
}

impl Quantity {
    /// All, in the order of columns.
    pub const ALL: [Self; 3] = [Self::LateralPosition, Self::Height, Self::Circulation];

    /// The name of its standard deviation.
    #[must_use]
    pub fn deviation_name(self) -> &'static str {
        match self {
            Self::LateralPosition => "y_std_m",
            Self::Height => "z_std_m",
            Self::Circulation => "gamma_5_15_std_m2_s",
        }
    }
}

/// How predictions are scored.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreOptions {
    /// The splits whose flights count.
    pub splits: Vec<Split>,
    /// Least circulation of scored vortices, m²/s.
    pub least_m2_s: f64,
    /// Whether a scan without a row is one in which nothing was found.
    pub missing_is_none: bool,
    /// Seed of the bootstrap draws.
    pub seed: u64,
}

impl Default for ScoreOptions {
    fn default() -> Self {
        Self {
            splits: vec![Split::TestHome, Split::TestAway],
            least_m2_s: 50.0,
            missing_is_none: false,
            seed: 1,
        }
    }
}

/// A statistic of the scans of a bin.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreRow {
    /// What the scans are grouped by.
    pub group: &'static str,
    /// Their value or range of values of it.
    pub bin: String,
    /// What the statistic is of.
    pub quantity: &'static str,
    /// Its name.
    pub statistic: &'static str,
    /// Its value; NaN where it is not defined.
    pub value: f64,
    /// Ends of its 95 % interval; NaN where there is none.
    pub interval: [f64; 2],
    /// Vortices or scans that it is of.
    pub count: u64,
    /// Flights in the bin.
    pub flights: usize,
}

/// Scores of predictions.
#[derive(Debug, Clone, PartialEq)]
pub struct Scores {
    /// By group, bin, quantity and statistic.
    pub rows: Vec<ScoreRow>,
    /// Fraction of empty scans and of wakes above each threshold of the score, from the highest down; empty without scores.
    pub operating_curve: Vec<(f64, f64)>,
    /// Flights that were scored.
    pub flights: usize,
    /// Scans that were scored.
    pub scans: usize,
    /// Flights of any split that are not ready.
    pub flights_not_ready: usize,
}

impl Scores {
    /// The row of a statistic.
    #[must_use]
    pub fn row(
        &self,
        (group, bin): (&str, &str),
        quantity: &str,
        statistic: &str,
    ) -> Option<&ScoreRow> {
        self.rows.iter().find(|row| {
            let is_bin = row.group == group && row.bin == bin;
            is_bin && row.quantity == quantity && row.statistic == statistic
        })
    }
}

/// Scores predictions that were read for the same truth and options. Draws use the caller's threads, whose number does not change
/// the result.
#[must_use]
pub fn score(truth: &Truth, predictions: &Predictions, options: &ScoreOptions) -> Scores {
    let mut scored = Vec::new();
    let mut flights_not_ready = 0;
    for (number, flight) in truth.flights.iter().enumerate() {
        match flight {
            Some(flight) if options.splits.contains(&flight.split) => {
                scored.push((number, flight));
            }
            Some(_) => {}
            None => flights_not_ready += 1,
        }
    }
    let nothing = PredictedScan::default();
    let mut matched = Vec::new();
    for (index, (number, flight)) in scored.iter().enumerate() {
        let reach_m = 0.5 * flight.spacing_m;
        for (scan_number, scan) in flight.scans.iter().enumerate() {
            let predicted = predictions.scans.get(&(*number, scan_number));
            let predicted = predicted.unwrap_or(&nothing);
            let found = MatchedScan::new(scan, predicted, reach_m, options.least_m2_s);
            matched.push((index, *flight, scan, found));
        }
    }
    let means = Quantity::ALL.map(|quantity| truth.training_mean(quantity, options.least_m2_s));
    let bins = bins(&matched, means);
    let rows = rows(&bins, scored.len(), options.seed);
    let all = bins.iter().find(|bin| bin.group == Group::All);
    Scores {
        rows,
        operating_curve: all.map_or_else(Vec::new, |all| operating_curve(&all.wakes, &all.empty)),
        flights: scored.len(),
        scans: matched.len(),
        flights_not_ready,
    }
}

/// The statistics of all bins with their intervals.
fn rows(bins: &[Bin], flights: usize, seed: u64) -> Vec<ScoreRow> {
    let drawn: Vec<Vec<f64>> = (0..DRAWS as u64)
        .into_par_iter()
        .map(|draw| {
            let weights = drawn_weights(flights, seed, draw);
            let mut values = Vec::new();
            for bin in bins {
                for statistic in bin.statistics(&weights) {
                    values.push(statistic.found.map_or(f64::NAN, |(value, _)| value));
                }
            }
            values
        })
        .collect();
    let once = vec![1.0; flights];
    let mut rows = Vec::new();
    let mut column = 0;
    for bin in bins {
        for statistic in bin.statistics(&once) {
            rows.extend(row(bin, &statistic, || interval(&drawn, column)));
            column += 1;
        }
    }
    rows
}

/// How often each flight is in a bootstrap draw.
fn drawn_weights(flights: usize, seed: u64, draw: u64) -> Vec<f64> {
    let mut random = stream(seed, "score", draw);
    let mut weights = vec![0.0; flights];
    for _ in 0..flights {
        // The high half of the product is uniform below `flights` to 1 part in 2^64 / flights.
        let product = u128::from(random.next_u64()) * flights as u128;
        weights[(product >> 64) as usize] += 1.0;
    }
    weights
}

/// The row of a statistic that the scans of its bin have.
fn row(bin: &Bin, statistic: &Statistic, interval: impl FnOnce() -> [f64; 2]) -> Option<ScoreRow> {
    let (value, count) = statistic.found?;
    let flights = bin.flights.len();
    Some(ScoreRow {
        group: bin.group.name(),
        bin: bin.name.clone(),
        quantity: statistic.quantity,
        statistic: statistic.name,
        value,
        interval: match flights < LEAST_FLIGHTS {
            true => [f64::NAN; 2],
            false => interval(),
        },
        count: count as u64,
        flights,
    })
}

/// Percentiles of the draws of a statistic; those that leave its bin empty are passed over.
fn interval(drawn: &[Vec<f64>], column: usize) -> [f64; 2] {
    let mut values = Vec::with_capacity(drawn.len());
    for draw in drawn {
        if draw[column].is_finite() {
            values.push((draw[column], 0));
        }
    }
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    match values.len() {
        0 | 1 => [f64::NAN; 2],
        _ => ENDS.map(|end| quantile(&values, &[1.0], end)),
    }
}
