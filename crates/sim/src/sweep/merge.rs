//! The tables of all cases, from the folders of shards or of a whole run.
//!
//! Check: bytes of shards that were merged; shards of different sweeps and cases without a result are refused.

use super::cases::Sweep;
use super::stored::{Definition, Row, SWEEP, stored};
use super::tables;
use crate::io::Existing;
use crate::scene::Outputs;
use crate::{Error, outputs};
use std::path::{Path, PathBuf};

/// Writes the tables of a sweep whose cases are all in some folders, of shards or of a whole run; returns the paths.
///
/// # Errors
/// Folders that are of different sweeps, or of another one than `sweep`; cases that none of them has; what the system says.
pub fn merge(
    folders: &[PathBuf],
    sweep: Option<&Sweep>,
    out: &Path,
    existing: Existing,
) -> Result<Vec<PathBuf>, Error> {
    let mut first: Option<(Definition, String)> = None;
    for folder in folders {
        let found = Definition::read(folder)?;
        let asked = sweep.map(|sweep| (Definition::of(sweep, found.fits), "the sweep that was asked for".to_owned()));
        for (other, of) in first.iter().chain(&asked) {
            if !other.is_same(&found) {
                let reason = format!(
                    "it is of sweep {} by {}, {of} is {} by {}: only shards of one sweep by one version, all with or all \
                     without --no-circulation, fit together",
                    found.origin.scene_hash, found.origin.program, other.origin.scene_hash, other.origin.program
                );
                return Err(Error::Input { path: folder.join(SWEEP), reason });
            }
        }
        first = first.or(Some((found, folder.display().to_string())));
    }
    let Some((definition, _)) = first else {
        return Err(Error::Input { path: "--merge".into(), reason: "at least one folder of a sweep is needed".into() });
    };
    let (mut rows, mut missing) = (Vec::new(), Vec::new());
    for case in 0..definition.scene_hashes.len() {
        match folders.iter().find_map(|folder| stored(folder, &definition, case)) {
            Some(row) => rows.push(row),
            None => missing.push(case),
        }
    }
    if !missing.is_empty() {
        let first: Vec<String> = missing.iter().take(10).map(ToString::to_string).collect();
        let more = if missing.len() > 10 { ", ..." } else { "" };
        let reason = format!(
            "{} of the {} cases have no result in the folders to merge, numbers {}{more}: run their shards, or those that were \
             cut off with --resume",
            missing.len(),
            definition.scene_hashes.len(),
            first.join(", ")
        );
        return Err(Error::Input { path: "--merge".into(), reason });
    }
    write_tables(&definition, &rows, out, existing)
}

/// Writes the tables of all rows.
pub(super) fn write_tables(
    definition: &Definition,
    rows: &[Row],
    out: &Path,
    existing: Existing,
) -> Result<Vec<PathBuf>, Error> {
    let of = (Outputs::default(), definition.origin.clone());
    outputs::Outputs::write(out, existing, of, |files| tables::list(definition, Some(rows), files))
}
