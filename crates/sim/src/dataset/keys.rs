//! What a plan may say beside its scene and the keys that vary.
//!
//! Check: each limit is broken once, in the tests of `plan`.

use super::draw::MOST_POINTS;
use crate::keys::{Checker, Is, Named, table};

/// The version of the plan format that this program reads.
pub const FORMAT: u32 = 1;

/// Fractions of the flights of a site that a split may have: blocks of a power of two.
const FRACTIONS: [f64; 5] = [0.0, 0.5, 0.25, 0.125, 0.0625];

table! {
    /// A plan of a data set, but for its tables `[scene]`, `[site]` and `[flight]`.
    PlanKeys {
        /// Version of the format.
        format: u32 = FORMAT => Is(|format: &u32| *format == FORMAT, "1, the format of this program"),
        /// Title of the data set.
        title: String = String::new() => Named("a title of the data set"),
        /// Description of the data set.
        description: String = String::new(),
        /// Creator of the data set.
        creator: String = String::new(),
        /// SPDX name of the licence.
        licence: String = "CC-BY-4.0".into() => Is(
            |name: &String| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-.+".contains(c)),
            "an SPDX name, e.g. \"CC-BY-4.0\"",
        ),
        /// Address of the data set.
        url: String = String::new(),
        /// Seed of all random numbers.
        seed: u64 = 1,
        /// Number of sites.
        sites: usize = 8 => 1..=1000,
        /// Flights of each site.
        flights_per_site: usize = 64 => Is(
            |flights: &usize| flights.is_power_of_two() && (8..=MOST_POINTS).contains(flights),
            "a power of two from 8 to 65536; more flights need more sites",
        ),
        /// Flights of each chunk: the unit of work and of files.
        flights_per_chunk: usize = 16 => Is(
            |flights: &usize| flights.is_power_of_two() && *flights <= 256,
            "a power of two from 1 to 256",
        ),
        /// Fraction of the flights without a wake.
        empty: f64 = 0.2 => 0.0..=1.0,
        /// Whether spectra are stored.
        spectra: bool = true,
        /// Heights of the true wind, m.
        heights_m: Vec<f64> = (1..=20).map(|i| 10.0 * f64::from(i)).collect() => Is(
            |heights: &Vec<f64>| !heights.is_empty() && heights[0] >= 0.0 && heights.windows(2).all(|pair| pair[0] < pair[1])
                && heights.iter().all(|height| height.is_finite()),
            "at least one height, from 0 on, finite and increasing",
        ),
        /// Flights for training, validation and tests.
        split: SplitKeys = SplitKeys::default(),
        /// Rows of a table of keys, of which each flight draws one as a whole.
        flight_rows: Vec<FlightRows> as omitted = Vec::new(),
    }
}

table! {
    /// Flights for training, validation and tests.
    SplitKeys {
        /// Sites whose flights are for tests alone; the last quarter of the sites if absent.
        test_away: Option<Vec<usize>> = None,
        /// Fraction of the flights of every other site for validation, and as many for tests.
        home: f64 = 0.125 => Is(|home: &f64| FRACTIONS.contains(home), "0, 1/2, 1/4, 1/8 or 1/16, e.g. 0.125"),
    }
}

table! {
    /// A table of keys.
    FlightRows {
        /// CSV file beside the plan, with keys of the scene as header.
        file: String = String::new() => Named("a CSV file beside the plan"),
        /// Column with the weight of each row; all alike if absent.
        weight: Option<String> = None,
    }
}

impl PlanKeys {
    /// Flights of all sites.
    pub fn flights(&self) -> usize {
        self.sites * self.flights_per_site
    }

    /// Chunks along the flights.
    pub fn chunks(&self) -> usize {
        self.flights() / self.flights_per_chunk
    }

    /// Whether the flights of a site are for tests alone.
    pub fn is_away(&self, site: usize) -> bool {
        match &self.split.test_away {
            Some(sites) => sites.contains(&site),
            None => site >= self.sites - self.sites / 4,
        }
    }

    /// The split of a flight: 0 `train`, 1 `validation`, 2 `test_home`, 3 `test_away`.
    pub fn split_of(&self, flight: usize) -> u8 {
        if self.is_away(flight / self.flights_per_site) {
            return 3;
        }
        let held = (self.split.home * self.flights_per_site as f64) as usize;
        let left = self.flights_per_site - flight % self.flights_per_site;
        match left {
            left if left <= held => 2,
            left if left <= 2 * held => 1,
            _ => 0,
        }
    }

    /// Limits between keys.
    pub(super) fn check_between(&self, c: &mut Checker<'_>) {
        let tables = self.flight_rows.len();
        if tables > 1 {
            let allowed = format!("at most one [[flight_rows]]: there are {tables}");
            c.refuse("flight_rows", "", allowed);
        }
        let chunk = self.flights_per_chunk;
        let of_site = self.flights_per_site;
        let fewer = format!("at most flights_per_site, {of_site}");
        // A chunk that the plan states is blamed itself.
        let more = format!(
            "at least flights_per_chunk, which is {chunk} by default: flights_per_chunk = {of_site} allows it"
        );
        let sides = [
            ("flights_per_chunk", chunk.to_string(), fewer),
            ("flights_per_site", of_site.to_string(), more),
        ];
        c.between(chunk <= of_site, &sides);
        let held = self.split.home * self.flights_per_site as f64;
        let allowed = "0, or a fraction of flights_per_site that is a whole number of flights";
        c.require(held.fract() == 0.0, "split.home", self.split.home, allowed);
        for (index, site) in self.split.test_away.iter().flatten().enumerate() {
            let key = format!("split.test_away[{index}]");
            let most = self.sites - 1;
            c.require(
                *site <= most,
                &key,
                site,
                format!("the number of a site, from 0 to {most}"),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_are_aligned_blocks_of_whole_flights() {
        let keys = PlanKeys {
            sites: 5,
            ..PlanKeys::default()
        };
        let count = |split: u8| {
            (0..keys.flights())
                .filter(|flight| keys.split_of(*flight) == split)
                .count()
        };
        assert_eq!([0, 1, 2, 3].map(count), [4 * 48, 4 * 8, 4 * 8, 64]);
        assert_eq!(
            [47, 48, 55, 56, 63].map(|flight| keys.split_of(flight)),
            [0, 1, 1, 2, 2]
        );
        assert_eq!(keys.split_of(4 * 64), 3);
    }
}
