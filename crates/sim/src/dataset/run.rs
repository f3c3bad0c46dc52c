//! Running a plan: metadata first, then chunk after chunk of flights, each file put into place as a whole.
//!
//! Processes share nothing but the folder: a chunk belongs to one shard, and two processes that make the same chunk write the same
//! bytes. A chunk is done when its file of `ready` is there, which is written last.
//!
//! Check: the same bytes of every file for shards, threads, kills with a second run (`tests/it/dataset.rs`); a foreign plan, a full
//! disk and a file in the way are refused.

use super::documents;
use super::flight;
use super::plan::{DatasetPlan, Flight};
use super::refusals::refuse_without_truth;
use super::schema::{self, Shape};
use super::{PLAN, STORE};
use crate::Error;
use crate::io::atomic::{StagingFolder, sweep_stages};
use crate::io::zarr::{Array, METADATA, Store, Writer, compressed, group_json, json_text};
use crate::plan::Plan;
use crate::progress::{Observer, Stage};
use crate::sweep::{Common, Shard};
use rayon::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

/// Bytes of a cell on disk: seven packed fields and flags; and those of a number of a spectrum.
const CELL_BYTES: f64 = 10.0;
const SPECTRUM_BYTES: f64 = 0.7;

/// How a data set is run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct Settings {
    /// Run part NUMBER of COUNT, e.g. 2/8.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NUMBER/COUNT"))]
    pub shard: Option<Shard>,
    /// Skip chunks that exist.
    #[cfg_attr(feature = "cli", arg(long))]
    pub resume: bool,
    /// Remove the arrays in the folder and begin anew.
    #[cfg_attr(feature = "cli", arg(long, conflicts_with_all = ["resume", "shard"]))]
    pub overwrite: bool,
    /// Run only the first N flights of every site.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub flights: Option<usize>,
}

/// What became of a run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Summary {
    /// Flights that were run.
    pub flights: usize,
    /// Chunks that were written.
    pub chunks: usize,
    /// Chunks that were there.
    pub kept: usize,
}

/// A checked plan, ready to run.
#[derive(Debug)]
pub struct Dataset<'p> {
    plan: &'p DatasetPlan,
    pub(crate) shape: Shape,
    arrays: Vec<Array>,
    settings: Settings,
    /// Run time of a flight on one core, s, and its memory, bytes.
    flight_core_s: f64,
    flight_bytes: f64,
}

impl<'p> Dataset<'p> {
    /// Draws all flights, and plans those at the ends of each distribution.
    ///
    /// # Errors
    /// The first flight that is refused; shapes that differ between flights; vortices without truth; more flights of a site than it
    /// has.
    pub fn new(plan: &'p DatasetPlan, settings: Settings) -> Result<Self, Error> {
        let of_site = plan.keys.flights_per_site;
        if let Some(flights) = settings
            .flights
            .filter(|flights| !(1..=of_site).contains(flights))
        {
            let reason =
                format!("--flights {flights} is not allowed: 1 to flights_per_site, {of_site}");
            return Err(Error::input(plan.path(), reason));
        }
        plan.check()?;
        let common = Common::default();
        let mut first: Option<(Shape, Plan)> = None;
        for flight in plan.extreme_flights()? {
            let of_flight = |error| refused(plan, &flight, error);
            let planned = flight::planned(&flight.scene, &common).map_err(of_flight)?;
            let shape = Shape::new(&planned, plan.keys.spectra).map_err(of_flight)?;
            refuse_without_truth(plan, &planned, &shape)?;
            match &first {
                Some((known, _)) => schema::refuse_other_shape(plan, &flight, [&shape, known])?,
                None => first = Some((shape, planned)),
            }
        }
        let Some((shape, planned)) = first else {
            return Err(Error::input(plan.path(), "it has no flight"));
        };
        Ok(Self {
            arrays: schema::arrays(plan, &shape)?,
            flight_core_s: planned.core_s(),
            flight_bytes: planned.memory_bytes(),
            plan,
            shape,
            settings,
        })
    }

    /// Number of flights that are to be run.
    pub fn flights(&self) -> usize {
        (0..self.plan.keys.chunks())
            .filter(|chunk| self.is_mine(*chunk))
            .map(|chunk| self.wanted(chunk).len())
            .sum()
    }

    /// What they need on disk, bytes.
    pub fn disk_bytes(&self) -> f64 {
        let cells = self.shape.cells() as f64;
        let spectra = self.shape.bin_velocity_m_s.len() as f64 * SPECTRUM_BYTES;
        self.flights() as f64 * cells * (CELL_BYTES + spectra)
    }

    /// Their run time on one core, to a factor of two, s.
    pub fn core_s(&self) -> f64 {
        self.flights() as f64 * self.flight_core_s
    }

    /// Memory of a run, bytes.
    pub fn memory_bytes(&self) -> f64 {
        let threads = rayon::current_num_threads() as f64;
        let chunk_bytes: usize = self.chunked().map(|(_, array)| array.chunk_bytes()).sum();
        chunk_bytes as f64 + threads * self.flight_bytes
    }

    /// Whether a chunk belongs to the shard.
    fn is_mine(&self, chunk: usize) -> bool {
        self.settings.shard.is_none_or(|shard| shard.has(chunk))
    }

    /// Flights of a chunk that are to be run.
    fn wanted(&self, chunk: usize) -> Vec<usize> {
        let keys = &self.plan.keys;
        let first = chunk * keys.flights_per_chunk;
        let most = self.settings.flights.unwrap_or(keys.flights_per_site);
        let mut flights: Vec<usize> = (first..first + keys.flights_per_chunk).collect();
        flights.retain(|flight| flight % keys.flights_per_site < most);
        flights
    }

    /// Arrays whose chunks hold several flights, with their indices; `ready` is the last one.
    fn chunked(&self) -> impl Iterator<Item = (usize, &Array)> {
        let all = self.arrays.iter().enumerate();
        all.filter(|(_, array)| {
            array.dimensions[0] == "flight"
                && !["flight", "spectrum"].contains(&array.name.as_str())
        })
    }

    /// Runs the chunks of the shard that are not there yet.
    ///
    /// # Errors
    /// A folder of another plan; chunks in the way without `resume`; what the system says, with the path. Chunks that are finished
    /// remain, and nothing is written in part.
    pub fn run(&self, out: &Path, observer: &dyn Observer) -> Result<Summary, Error> {
        let root = out.join(STORE);
        if self.settings.overwrite {
            remove(&root)?;
        }
        fs::create_dir_all(out).map_err(Error::io("make the folder", out))?;
        sweep_stages(out);
        let writer = Writer::new(&root)?;
        self.write_metadata(out, &writer)?;
        let store = Store::open(&root)?;
        let mut due = Vec::new();
        let mut summary = Summary::default();
        for chunk in (0..self.plan.keys.chunks()).filter(|chunk| self.is_mine(*chunk)) {
            let wanted = self.wanted(chunk);
            let there = self.ready(&store, chunk)?;
            if wanted.is_empty() {
                continue;
            }
            if there.is_some() && !self.settings.resume {
                let path = store.chunk_path(store.array("ready")?, chunk);
                let reason = "these flights are there: --resume runs those that are not, --overwrite begins anew";
                return Err(Error::input(&path, reason));
            }
            match there.is_some_and(|there| wanted.iter().all(|flight| there.contains(flight))) {
                true => summary.kept += 1,
                false => due.push((chunk, wanted)),
            }
        }
        let flights: usize = due.iter().map(|(_, wanted)| wanted.len()).sum();
        observer.begin(Stage::Flights, flights as u64);
        let common = Common::default();
        for (chunk, wanted) in due {
            self.run_chunk(chunk, &wanted, &writer, &common, observer)?;
            summary.chunks += 1;
            summary.flights += wanted.len();
            observer.reach(&format!("chunk {chunk}"));
        }
        observer.end();
        Ok(summary)
    }

    /// Numbers of the flights of a chunk that are there; `None` where the chunk is not.
    fn ready(&self, store: &Store, chunk: usize) -> Result<Option<Vec<usize>>, Error> {
        let array = store.array("ready")?;
        if !store.chunk_path(array, chunk).exists() {
            return Ok(None);
        }
        let first = chunk * array.chunk_rows;
        let ready = store.integers("ready", first..first + array.chunk_rows)?;
        let flights = ready.iter().enumerate().filter(|(_, ready)| **ready == 1);
        Ok(Some(flights.map(|(index, _)| first + index).collect()))
    }

    /// Writes what says what the arrays are, or compares it with what is there.
    fn write_metadata(&self, out: &Path, writer: &Writer) -> Result<(), Error> {
        let attributes = schema::attributes(self.plan);
        let group = json_text(&group_json(&attributes, &self.arrays));
        let mut documents = vec![
            (PLAN, self.plan.text.clone()),
            ("README.md", documents::readme(self.plan, &self.arrays)),
            ("croissant.json", documents::croissant(self.plan, &group)),
        ];
        let rows = self.plan.keys.flight_rows.first();
        if let (Some(rows), Some(text)) = (rows, &self.plan.drawn.rows_text) {
            documents.push((&rows.file, text.clone()));
        }
        let path = out.join(STORE).join(METADATA);
        match fs::read(&path) {
            Ok(there) if there == group.as_bytes() => {}
            Ok(there) => return Err(Error::input(&path, self.difference(&there))),
            Err(_) => {
                for array in &self.arrays {
                    let text = json_text(&array.to_json());
                    writer.put(&format!("{}/{METADATA}", array.name), text.as_bytes())?;
                }
                for (name, values) in schema::coordinates(self.plan, &self.shape) {
                    let Some(array) = self.arrays.iter().find(|array| array.name == name) else {
                        continue;
                    };
                    let mut bytes = Vec::new();
                    array.pack(values, &mut bytes);
                    writer.put(&array.chunk_key(0), &compressed(&bytes))?;
                }
                // Last: a folder without it is no store.
                writer.put(METADATA, group.as_bytes())?;
            }
        }
        for (name, text) in documents {
            let path = out.join(name);
            match fs::read(&path) {
                Ok(there) if there == text.as_bytes() => {}
                Ok(_) if !self.settings.overwrite => {
                    let reason = "it is there and differs from that of this plan: another folder, or --overwrite";
                    return Err(Error::input(&path, reason));
                }
                _ => writer.put_beside(name, text.as_bytes())?,
            }
        }
        Ok(())
    }

    /// What differs between the metadata that are there and those of this plan.
    fn difference(&self, there: &[u8]) -> String {
        let there: serde_json::Value = serde_json::from_slice(there).unwrap_or_default();
        let mut differ = Vec::new();
        for (name, own) in schema::attributes(self.plan) {
            if there["attributes"][&name] != own && name != "plan" {
                differ.push(format!(
                    "{name} is {} there, {own} here",
                    there["attributes"][&name]
                ));
            }
        }
        if differ.is_empty() {
            differ.push("its arrays differ".into());
        }
        format!(
            "it is of another plan, seed or version of the program ({}): another folder, or --overwrite",
            differ.join("; ")
        )
    }

    /// Runs the flights of a chunk, as many at a time as there are threads, and writes it.
    fn run_chunk(
        &self,
        chunk: usize,
        wanted: &[usize],
        writer: &Writer,
        common: &Common,
        observer: &dyn Observer,
    ) -> Result<(), Error> {
        let mut buffers: Vec<Vec<u8>> = Vec::new();
        let chunked: Vec<(usize, &Array)> = self.chunked().collect();
        for (_, array) in &chunked {
            let mut bytes = Vec::with_capacity(array.chunk_bytes());
            array.pack_fill(array.chunk_rows, &mut bytes);
            buffers.push(bytes);
        }
        let first = chunk * self.plan.keys.flights_per_chunk;
        for batch in wanted.chunks(rayon::current_num_threads()) {
            let rows: Vec<_> = batch
                .par_iter()
                .map(|flight| {
                    let rows = self.run_flight(*flight, writer, common)?;
                    observer.advance(1);
                    Ok(rows)
                })
                .collect::<Result<_, Error>>()?;
            for (flight, rows) in batch.iter().zip(rows) {
                for (index, bytes) in rows {
                    let Some(at) = chunked.iter().position(|(own, _)| *own == index) else {
                        continue;
                    };
                    let start = (flight - first) * bytes.len();
                    buffers[at][start..start + bytes.len()].copy_from_slice(&bytes);
                }
            }
        }
        let files: Vec<Vec<u8>> = buffers.par_iter().map(|bytes| compressed(bytes)).collect();
        // In their order: `ready` is the last one.
        for ((_, array), content) in chunked.iter().zip(&files) {
            writer.put(&array.chunk_key(chunk), content)?;
        }
        Ok(())
    }

    /// Runs a flight; its spectrum, a file of its own, is written at once. Returns the other rows with the indices of their arrays.
    fn run_flight(
        &self,
        number: usize,
        writer: &Writer,
        common: &Common,
    ) -> Result<Vec<(usize, Vec<u8>)>, Error> {
        let flight = self.plan.flight(number)?;
        let rows = flight::rows(self.plan, &flight, &self.arrays, common);
        let mut rows = rows.map_err(|error| refused(self.plan, &flight, error))?;
        let of_spectrum = |(index, _): &(usize, Vec<u8>)| self.arrays[*index].name == "spectrum";
        if let Some(at) = rows.iter().position(of_spectrum) {
            let (index, bytes) = rows.swap_remove(at);
            let key = self.arrays[index].chunk_key(number);
            writer.put(&key, &compressed(&bytes))?;
        }
        Ok(rows)
    }
}

/// An error of a flight with its keys.
fn refused(plan: &DatasetPlan, flight: &Flight, error: Error) -> Error {
    Error::Flight {
        flight: flight.number,
        site: flight.site,
        keys: plan.drawn.described(&flight.values),
        others: 0,
        source: Box::new(error),
    }
}

/// Removes the arrays of a data set; anything else is left.
fn remove(root: &Path) -> Result<(), Error> {
    if root.symlink_metadata().is_err() {
        return Ok(());
    }
    if !root.join(METADATA).is_file() {
        let reason = "it is no Zarr group that --overwrite may replace: another folder";
        return Err(Error::input(root, reason));
    }
    fs::remove_dir_all(root).map_err(Error::io("remove", root))
}

/// Finds out whether a data set can be written to a folder; leaves no trace.
///
/// # Errors
/// What the system says.
pub fn check_folder(out: &Path) -> Result<(), Error> {
    crate::io::atomic::in_folder(out, false, || {
        StagingFolder::make(out)?;
        Ok(())
    })
}

/// Paths of the documents and the store of a data set.
pub fn paths(out: &Path) -> Vec<PathBuf> {
    [PLAN, "README.md", "croissant.json", STORE]
        .map(|name| out.join(name))
        .into()
}
