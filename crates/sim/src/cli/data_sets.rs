//! Data sets as inputs of `retrieve` and `detect`: predictions for the scans of some splits, flight by flight.
//!
//! A method reads the cells of the store and is given the instrument of the flight by its plan, in still air: nothing of the truth.
//! Check: predictions of a small data set are scored, in the tests of the program.

use crate::Error;
use crate::dataset::PLAN;
use crate::dataset::plan::DatasetPlan;
use crate::io::Provenance;
use crate::io::data_set::{DataSet, Split};
use crate::io::scans::{ReadScan, ScanFormat, StoredLines};
use crate::outputs::Outputs;
use crate::plan::Stage;
use crate::progress::Observer;
use crate::scene::SceneFile;
use crate::score::{PredictedScan, prediction_table};
use clap::Args;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Which flights of a data set are read.
#[derive(Debug, Args)]
pub(super) struct SplitArgs {
    /// Splits of the data set.
    #[arg(
        long = "split",
        value_enum,
        value_name = "SPLIT,...",
        value_delimiter = ',',
        default_value = "test_home,test_away"
    )]
    splits: Vec<Split>,
}

impl SplitArgs {
    /// Each once, in the order of their numbers.
    pub(super) fn splits(&self) -> Vec<Split> {
        let mut splits = self.splits.clone();
        splits.sort_unstable();
        splits.dedup();
        splits
    }
}

/// The data set among the inputs of a command.
///
/// # Errors
/// One beside other inputs.
pub(super) fn data_set_of(data: &[PathBuf]) -> Result<Option<&Path>, Error> {
    let found = data.iter().find(|path| DataSet::is_at(path));
    match (found, data) {
        (Some(path), [_, _, ..]) => {
            let reason = "it is a data set: a command reads one alone, without other inputs";
            Err(Error::input(path, reason))
        }
        (found, _) => Ok(found.map(PathBuf::as_path)),
    }
}

/// What a method found in a scan of a data set, with the numbers of flight and scan.
type Found = (usize, usize, PredictedScan);

/// Applies a method to the scans of each flight of some splits, read as a format says; the scene of the flight is that of one scan of the instrument in
/// still air. Returns what it found, flight after flight, and the plan of the data set.
///
/// # Errors
/// A data set that is damaged or has another plan beside it; a split without ready flights; scans that are not across the flight; what
/// the method refuses.
pub(super) fn predict(
    folder: &Path,
    splits: &[Split],
    format: &ScanFormat,
    (stage, observer): (Stage, &dyn Observer),
    method: impl Fn(usize, &SceneFile, Vec<ReadScan>) -> Result<Vec<PredictedScan>, Error> + Sync,
) -> Result<(Vec<Found>, Provenance), Error> {
    let data_set = DataSet::open(folder)?;
    data_set.check_splits(splits)?;
    let path = folder.join(PLAN);
    let plan = DatasetPlan::read(&path, None)?;
    let origin = data_set.origin();
    if plan.hash != origin.scene_hash {
        let [own, other] = [&plan.hash, &origin.scene_hash];
        let reason = format!("it is plan {own}, the store beside it was made from plan {other}");
        return Err(Error::input(&path, reason));
    }
    let lines = StoredLines::read(&data_set)?;
    let mut flights = Vec::new();
    for (flight, split) in data_set.splits.iter().enumerate() {
        if split.is_some_and(|split| splits.contains(&split)) {
            flights.push(flight);
        }
    }
    observer.begin(stage, flights.len() as u64);
    let found: Result<Vec<_>, Error> = flights
        .par_iter()
        .map(|flight| {
            let scans = lines.scans_of_flight(&data_set, *flight, format)?;
            let scene = plan.flight(*flight)?.scene.of_one_scan_in_still_air()?;
            refuse_other_planes(&scene)?;
            let found = method(*flight, &scene, scans)?;
            observer.advance(1);
            Ok(found)
        })
        .collect();
    observer.end();
    let mut scans = Vec::new();
    for (flight, found) in flights.iter().zip(found?) {
        for (scan, found) in found.into_iter().enumerate() {
            scans.push((*flight, scan, found));
        }
    }
    Ok((scans, origin))
}

/// Refuses scans whose vortices would be at other places than those that methods report: ranges and elevations from y = 0 towards +y.
fn refuse_other_planes(scene: &SceneFile) -> Result<(), Error> {
    if scene.content.scan.is_across() {
        return Ok(());
    }
    let reason = "retrieve and detect need data sets of scan.pattern.kind = \"rhi\" in the plane across the flight, towards +y, with a lidar \
                  at rest at y_m = 0.0; other methods may read this one";
    Err(Error::Key {
        key: "scan",
        reason: reason.into(),
    })
}

/// What is said of a scan of a flight that a method refuses.
pub(super) fn without_wake(flight: usize, scan: usize, error: &Error) -> String {
    format!("flight {flight}, scan {scan}: {error}: taken for a scan without a wake")
}

/// What was found, for people and as an object.
pub(super) fn report(found: &[Found]) -> (Value, String) {
    let scans = found.len();
    let wakes = found.iter().filter(|(.., scan)| !scan.vortices.is_empty());
    let wakes = wakes.count();
    let flights = found.chunk_by(|a, b| a.0 == b.0).count();
    let text = format!("vortices in {wakes} of {scans} scans of {flights} flights\n");
    let object = json!({ "flights": flights, "scan_count": scans, "scans_with_vortices": wakes });
    (object, text)
}

/// The table of predictions; before they are made its name alone.
pub(super) fn list(stem: &str, found: Option<&[Found]>, files: &mut Outputs) -> Result<(), Error> {
    files.table(stem, found, |found| Ok(prediction_table(found)))
}
