//! Statistics of the flights of a bin, each of which counts several times or not at all: errors of vortices, coverage of stated
//! deviations, detection.
//!
//! | statistic | definition |
//! |---|---|
//! | `bias`, `rms`, `median`, `p90` | of errors, predicted less true; of their absolute values |
//! | `skill` | 1 - mean square / mean square of the truth about its mean over the training flights |
//! | `relative_rms` | of errors over the truth |
//! | `crps` | continuous ranked probability score of the stated normal law (Gneiting and others 2005, eq. 5) |
//! | `reduced_rms`, `coverage_P` | of errors over deviations; fraction within the central interval of probability P |
//! | `recall`, `precision`, `f1` | of scored vortices |
//! | `detected`, `false_alarms`, `f1` | of scans with a wake and of empty ones |
//! | `auc`, `detected_at_P` | area below the operating curve; wakes above the threshold that P of the empty scans exceed |
//!
//! Check: the reference case.

use super::Quantity;
use super::bins::{Bin, Group};
use super::ranked::{area, fraction_above, quantile, total, value_at};
use super::sums::{FlightSums, NOMINAL};

/// Rates of false alarms at which the fraction of wakes found is given, with its name.
const RATES: [(f64, &str); 2] = [(0.1, "detected_at_0.1"), (0.01, "detected_at_0.01")];

/// Fewest empty scans above a threshold that says anything.
const LEAST_FALSE_ALARMS: f64 = 3.0;

/// A statistic that all bins of a kind have in the same order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Statistic {
    pub(super) quantity: &'static str,
    pub(super) name: &'static str,
    /// Its value and the number of vortices or scans that it is of; absent where nothing in the bin has it.
    pub(super) found: Option<(f64, f64)>,
}

/// A ratio of sums and its count; absent where the sum below is 0.
fn ratio(above: f64, below: f64, count: f64) -> Option<(f64, f64)> {
    (below > 0.0).then(|| (above / below, count))
}

impl Bin {
    /// The statistics where each flight counts as often as its weight says, in an order that does not depend on the weights.
    pub(super) fn statistics(&self, weights: &[f64]) -> Vec<Statistic> {
        let mut sums = FlightSums::default();
        for (flight, own) in &self.flights {
            sums.add_weighted(own, weights[*flight]);
        }
        let mut list = Vec::new();
        for (index, quantity) in Quantity::ALL.into_iter().enumerate() {
            self.add_errors(&mut list, quantity, index, &sums, weights);
        }
        let rms = (sums.distance_square_m2 / sums.hits).sqrt();
        let distance = [("rms", rms)];
        self.add_ranks(&mut list, "distance_m", &distance, 3, &sums, weights);
        self.add_vortices(&mut list, &sums);
        if self.group != Group::Height {
            self.add_scans(&mut list, &sums, weights);
        }
        list
    }

    /// Means of a quantity, then its ranks and the coverage of stated deviations.
    fn add_errors(
        &self,
        list: &mut Vec<Statistic>,
        quantity: Quantity,
        index: usize,
        sums: &FlightSums,
        weights: &[f64],
    ) {
        let own = &sums.errors[index];
        // Without training flights, or where all vortices are as their mean, there is nothing to be better than.
        let skill = ratio(own.square, own.truth_square, sums.hits);
        let mut means = vec![
            ("bias", own.error / sums.hits),
            ("rms", (own.square / sums.hits).sqrt()),
            ("skill", skill.map_or(f64::NAN, |(ratio, _)| 1.0 - ratio)),
            ("crps", own.crps / sums.hits),
        ];
        if quantity == Quantity::Circulation {
            means.push(("relative_rms", (own.relative_square / sums.hits).sqrt()));
        }
        let name = quantity.name();
        self.add_ranks(list, name, &means, index, sums, weights);
        let reduced = ratio(own.reduced_square, own.stated, own.stated);
        list.push(Statistic {
            quantity: name,
            name: "reduced_rms",
            found: reduced.map(|(square, count)| (square.sqrt(), count)),
        });
        for (covered, (.., coverage)) in own.covered.into_iter().zip(NOMINAL) {
            list.push(Statistic {
                quantity: name,
                name: coverage,
                found: ratio(covered, own.stated, own.stated),
            });
        }
    }

    /// Means over the hits, and quantiles of the absolute errors of an index.
    fn add_ranks(
        &self,
        list: &mut Vec<Statistic>,
        quantity: &'static str,
        means: &[(&'static str, f64)],
        index: usize,
        sums: &FlightSums,
        weights: &[f64],
    ) {
        let errors = &self.errors[index];
        let median = ("median", quantile(errors, weights, 0.5));
        let p90 = ("p90", quantile(errors, weights, 0.9));
        for (name, value) in means.iter().copied().chain([median, p90]) {
            list.push(Statistic {
                quantity,
                name,
                found: (sums.hits > 0.0).then_some((value, sums.hits)),
            });
        }
    }

    fn add_vortices(&self, list: &mut Vec<Statistic>, sums: &FlightSums) {
        let scored = sums.hits + sums.missed;
        // It stands for the bin even where nothing is scored.
        let recall = Some((sums.hits / scored, scored));
        let mut of_vortices = vec![("recall", recall)];
        if self.group != Group::Height {
            let predicted = sums.hits + sums.false_vortices;
            of_vortices.push(("precision", ratio(sums.hits, predicted, predicted)));
            let all = 2.0 * sums.hits + sums.false_vortices + sums.missed;
            of_vortices.push(("f1", ratio(2.0 * sums.hits, all, scored)));
        }
        for (name, found) in of_vortices {
            list.push(Statistic {
                quantity: "vortices",
                name,
                found,
            });
        }
    }

    fn add_scans(&self, list: &mut Vec<Statistic>, sums: &FlightSums, weights: &[f64]) {
        let judged = sums.wakes + sums.empty;
        let all = sums.detected + sums.false_alarms + sums.wakes;
        let has_scores = sums.wakes > 0.0 && sums.empty > 0.0 && sums.with_score > 0.0;
        let auc = has_scores.then(|| (area(&self.wakes, &self.empty, weights), judged));
        let mut of_scans = vec![
            ("detected", ratio(sums.detected, sums.wakes, sums.wakes)),
            (
                "false_alarms",
                ratio(sums.false_alarms, sums.empty, sums.empty),
            ),
            ("f1", ratio(2.0 * sums.detected, all, judged)),
            ("auc", auc),
        ];
        for (rate, name) in RATES {
            let value = has_scores
                .then(|| self.detected_at(rate, weights))
                .flatten();
            of_scans.push((name, value.map(|value| (value, judged))));
        }
        for (name, found) in of_scans {
            list.push(Statistic {
                quantity: "scans",
                name,
                found,
            });
        }
    }

    /// Fraction of wakes above the lowest threshold that at most this fraction of empty scans exceeds; none where that is less
    /// than [`LEAST_FALSE_ALARMS`] scans.
    fn detected_at(&self, rate: f64, weights: &[f64]) -> Option<f64> {
        let empty = total(&self.empty, weights);
        if empty * rate < LEAST_FALSE_ALARMS {
            return None;
        }
        // The product may be a little below a whole number that it stands for.
        let above = (rate * empty + 1e-9).floor();
        let limit = value_at(&self.empty, weights, empty - 1.0 - above);
        Some(fraction_above(&self.wakes, weights, limit))
    }
}
