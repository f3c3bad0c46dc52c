//! Groups of scans, and what of a bin does not change with the flights that are drawn: sums over each flight, ranks of all.
//!
//! Check: edges belong to the upper bin; unknown values have a bin of their own; the reference case.

use super::Quantity;
use super::matching::MatchedScan;
use super::predictions::PredictedVortex;
use super::ranked::Ranked;
use super::sums::FlightSums;
use super::truth::{TrueFlight, TrueScan, TrueVortex};
use crate::io::data_set::Split;

/// What scans are grouped by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Group {
    All,
    Split,
    Site,
    Snr,
    Dissipation,
    Age,
    /// Of vortices, not of scans.
    Height,
}

impl Group {
    /// The name that files have for it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Split => "split",
            Self::Site => "site",
            Self::Snr => "snr_db",
            Self::Dissipation => "dissipation_m2_s3",
            Self::Age => "age_tau",
            Self::Height => "height_over_spacing",
        }
    }

    /// Edges of its bins.
    pub(super) fn edges(self) -> &'static [f64] {
        match self {
            Self::All | Self::Split | Self::Site => &[],
            Self::Snr => &[-10.0, -5.0, 0.0, 5.0, 10.0, 15.0],
            Self::Dissipation => &[1e-5, 1e-4, 1e-3, 1e-2],
            Self::Age => &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            Self::Height => &[0.25, 0.5, 0.75, 1.0, 1.5, 2.0],
        }
    }

    /// The bin of a value: how many edges it reaches, and after the last one that of values that are not known.
    fn position(self, value: f64) -> usize {
        let edges = self.edges();
        match value.is_nan() {
            true => edges.len() + 1,
            false => edges.partition_point(|edge| value >= *edge),
        }
    }

    /// Its bin at a position.
    fn bin_name(self, position: usize) -> String {
        let edges = self.edges();
        match self {
            Self::All => "all".into(),
            Self::Split => Split::ALL[position].name().into(),
            Self::Site => position.to_string(),
            _ if position > edges.len() => "unknown".into(),
            _ => {
                let edge = |index: Option<usize>| {
                    let value = index.and_then(|index| edges.get(index));
                    value.map_or_else(String::new, |value| format!("{value:?}"))
                };
                format!(
                    "{}..{}",
                    edge(position.checked_sub(1)),
                    edge(Some(position))
                )
            }
        }
    }
}

/// The scans, or for [`Group::Height`] the vortices, of a bin.
#[derive(Debug, Clone)]
pub(super) struct Bin {
    pub(super) group: Group,
    /// In the order of the bins of a group.
    position: usize,
    pub(super) name: String,
    /// Index and sums of each flight.
    pub(super) flights: Vec<(usize, FlightSums)>,
    /// Absolute errors of each quantity, then distances, in rising order.
    pub(super) errors: [Vec<Ranked>; 4],
    /// Scores of scans with a wake in rising order; negative infinity for a scan without a score.
    pub(super) wakes: Vec<Ranked>,
    /// As `wakes`, of empty scans.
    pub(super) empty: Vec<Ranked>,
}

impl Bin {
    fn new(group: Group, position: usize) -> Self {
        Self {
            group,
            position,
            name: group.bin_name(position),
            flights: Vec::new(),
            errors: Default::default(),
            wakes: Vec::new(),
            empty: Vec::new(),
        }
    }

    /// The sums of a flight; flights come one after the other.
    fn sums(&mut self, flight: usize) -> &mut FlightSums {
        if self.flights.last().is_none_or(|(last, _)| *last != flight) {
            self.flights.push((flight, FlightSums::default()));
        }
        let last = self.flights.len() - 1;
        &mut self.flights[last].1
    }

    /// Adds a scored vortex, with its prediction if it was found.
    fn add_vortex(
        &mut self,
        flight: usize,
        truth: &TrueVortex,
        predicted: Option<&PredictedVortex>,
        means: [f64; 3],
    ) {
        let Some(predicted) = predicted else {
            self.sums(flight).missed += 1.0;
            return;
        };
        self.sums(flight).add_hit(truth, predicted, means);
        for (errors, quantity) in self.errors.iter_mut().zip(Quantity::ALL) {
            errors.push((predicted.error(truth, quantity).abs(), flight));
        }
        self.errors[3].push((predicted.distance_m(truth), flight));
    }

    fn add_scan(&mut self, flight: usize, scan: &MatchedScan, means: [f64; 3]) {
        for (truth, predicted) in &scan.scored {
            self.add_vortex(flight, truth, predicted.as_ref(), means);
        }
        self.sums(flight).add_scan(scan);
        let ranked = (scan.score.unwrap_or(f64::NEG_INFINITY), flight);
        if scan.has_wake() {
            self.wakes.push(ranked);
        } else if scan.is_empty {
            self.empty.push(ranked);
        }
    }

    fn sort(&mut self) {
        let lists = self.errors.iter_mut();
        for list in lists.chain([&mut self.wakes, &mut self.empty]) {
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
    }
}

/// A scan with the index of its flight among the scored ones.
pub(super) type OfFlight<'t> = (usize, &'t TrueFlight, &'t TrueScan, MatchedScan);

/// All bins that have scans. `means`: of each quantity over the training flights.
pub(super) fn bins(scans: &[OfFlight<'_>], means: [f64; 3]) -> Vec<Bin> {
    let mut bins = Vec::new();
    for (index, flight, scan, matched) in scans {
        for (group, position) in [
            (Group::All, 0),
            (Group::Split, flight.split as usize),
            (Group::Site, flight.site),
            (Group::Snr, Group::Snr.position(flight.snr_db)),
            (
                Group::Dissipation,
                Group::Dissipation.position(flight.dissipation_m2_s3),
            ),
            (Group::Age, Group::Age.position(scan.age_tau)),
        ] {
            bin(&mut bins, group, position).add_scan(*index, matched, means);
        }
        for (truth, predicted) in &matched.scored {
            let position = height_position(truth, flight);
            let bin = bin(&mut bins, Group::Height, position);
            bin.add_vortex(*index, truth, predicted.as_ref(), means);
        }
    }
    bins.sort_by_key(|bin| (bin.group, bin.position));
    bins.iter_mut().for_each(Bin::sort);
    bins
}

fn height_position(vortex: &TrueVortex, flight: &TrueFlight) -> usize {
    Group::Height.position(vortex.values.z_m / flight.spacing_m)
}

/// The bin of a group at a position, added where it is new.
fn bin(bins: &mut Vec<Bin>, group: Group, position: usize) -> &mut Bin {
    let found = bins
        .iter()
        .position(|bin| bin.group == group && bin.position == position);
    let index = found.unwrap_or_else(|| {
        bins.push(Bin::new(group, position));
        bins.len() - 1
    });
    &mut bins[index]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bin_has_its_lower_edge() {
        for (value, name) in [
            (-10.1, "..-10.0"),
            (-10.0, "-10.0..-5.0"),
            (14.9, "10.0..15.0"),
            (15.0, "15.0.."),
            (f64::NAN, "unknown"),
        ] {
            assert_eq!(Group::Snr.bin_name(Group::Snr.position(value)), name);
        }
        assert_eq!(Group::Site.bin_name(12), "12");
        assert_eq!(Group::Split.bin_name(3), "test_away");
    }
}
