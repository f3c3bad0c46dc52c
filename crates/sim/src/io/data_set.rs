//! A data set of scans with their truth, open to be read: its flights that are ready, their splits, and arrays without gaps.
//!
//! Flights come in chunks, and `ready` is the last array of a chunk that is written: the flights of a chunk without it are not in the
//! data set yet, and a chunk that is missing beside it is lost.
//! Check: missing and damaged chunks of ready flights are refused with their path.

use super::Provenance;
use super::zarr::{METADATA, Store};
use crate::Error;
use ndarray::ArrayD;
use serde::Serialize;
use serde_json::Value;
use std::ops::Range;
use std::path::Path;

/// Name of the group of arrays in the folder of a data set.
pub const GROUP: &str = "scans.zarr";

crate::keys::choice! {
    /// Which part of a data set a flight belongs to, with all of its scans.
    #[derive(PartialOrd, Ord, Serialize)]
    #[serde(rename_all = "snake_case")]
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    #[cfg_attr(feature = "cli", value(rename_all = "snake_case"))]
    Split {
        /// To train methods with.
        Train = "train",
        /// To choose between methods with.
        Validation = "validation",
        /// Flights at the sites of the training.
        TestHome = "test_home",
        /// Flights at sites that are in no other split.
        TestAway = "test_away",
    }
}

impl Split {
    /// All, in the order of their numbers in a store.
    pub const ALL: [Self; 4] = [
        Self::Train,
        Self::Validation,
        Self::TestHome,
        Self::TestAway,
    ];

    /// Whether it is to be read once, at the end.
    #[must_use]
    pub fn is_test(self) -> bool {
        matches!(self, Self::TestHome | Self::TestAway)
    }
}

/// A data set.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSet {
    /// Its arrays.
    pub store: Store,
    /// The split of each flight; none where the flight is not ready.
    pub splits: Vec<Option<Split>>,
    /// Scans of each flight.
    pub scans_per_flight: usize,
}

impl DataSet {
    /// Whether a path is the folder of a data set.
    #[must_use]
    pub fn is_at(folder: &Path) -> bool {
        folder.join(GROUP).join(METADATA).is_file()
    }

    /// Opens the data set in a folder.
    ///
    /// # Errors
    /// No such group; a chunk of `ready` or `split` that is damaged; an unknown split.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let store = Store::open(&folder.join(GROUP))?;
        let axis = |array: &str, axis: usize| {
            let length = store.array(array)?.shape.get(axis).copied();
            let reason = format!("its array \"{array}\" has too few axes");
            length.ok_or_else(|| Error::input(&store.root.join(METADATA), reason))
        };
        let flights = axis("ready", 0)?;
        let scans_per_flight = axis("wake_age", 1)?;
        let ready = store.values("ready", 0..flights)?;
        let mut data_set = Self {
            splits: ready
                .iter()
                .map(|ready| (*ready == 1.0).then_some(Split::Train))
                .collect(),
            store,
            scans_per_flight,
        };
        let numbers = data_set.values("split", 0..flights)?;
        for (split, number) in data_set.splits.iter_mut().zip(&numbers) {
            if split.is_some() {
                *split = Split::ALL.get(*number as usize).copied();
            }
        }
        Ok(data_set)
    }

    /// Values of some flights, \[flight, other axes..\], NaN where they are missing.
    ///
    /// # Errors
    /// No such array; a chunk of a ready flight that is missing, and any that is damaged, with its path.
    pub fn values(&self, name: &str, flights: Range<usize>) -> Result<ArrayD<f64>, Error> {
        let array = self.store.array(name)?;
        for flight in flights.clone() {
            let is_first = flight == flights.start || flight % array.chunk_rows == 0;
            let chunk = flight / array.chunk_rows;
            let last = flights.end.min((chunk + 1) * array.chunk_rows);
            let is_ready = |range: Range<usize>| {
                let splits = self.splits.get(range).unwrap_or_default();
                splits.iter().any(Option::is_some)
            };
            let path = self.store.chunk_path(array, chunk);
            if is_first && is_ready(flight..last) && !path.is_file() {
                let reason = "this chunk of the store is missing, although its flights are ready";
                return Err(Error::input(&path, reason));
            }
        }
        self.store.values(name, flights)
    }

    /// Refuses splits of which no flight is ready.
    ///
    /// # Errors
    /// The first such split.
    pub fn check_splits(&self, splits: &[Split]) -> Result<(), Error> {
        let absent = splits
            .iter()
            .find(|split| !self.splits.contains(&Some(**split)));
        let Some(absent) = absent else { return Ok(()) };
        let absent = absent.name();
        let mut reason = match self.splits.iter().all(Option::is_some) {
            true => format!("it has no flight of the split {absent}"),
            false => format!("no flight of its split {absent} is ready"),
        };
        let mut there = Split::ALL.to_vec();
        there.retain(|split| self.splits.contains(&Some(*split)));
        if !there.is_empty() {
            let names: Vec<&str> = there.into_iter().map(Split::name).collect();
            reason += &format!(": --split {} names those that it has", names.join(","));
        }
        Err(Error::input(&self.store.root, reason))
    }

    /// The plan that it was made from, and its seed.
    #[must_use]
    pub fn origin(&self) -> Provenance {
        let attributes = &self.store.attributes;
        let text = |name: &str| {
            attributes
                .get(name)
                .and_then(Value::as_str)
                .unwrap_or_default()
        };
        let seed = attributes.get("seed").and_then(Value::as_u64).unwrap_or(1);
        Provenance::new(text("plan"), text("plan_hash"), seed)
    }
}
