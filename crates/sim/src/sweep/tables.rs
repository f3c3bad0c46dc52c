//! The results of all cases as tables, from the folders of a run or of its shards: CSV, NetCDF, the front, and the pictures.
//!
//! Check: the same rows give the same bytes; the NetCDF file is read back by an independent reader.

use super::cases::Sweep;
use super::front::on_front;
use super::key_path::{Holds, VaryingKey};
use super::results::results;
use super::stored::{CaseResult, Definition, SWEEP};
use crate::Error;
use crate::io::{Existing, Table};
use crate::outputs::Outputs;
use crate::scene::Outputs as Formats;
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
        let asked = sweep.map(|sweep| {
            (
                Definition::from_sweep(sweep, found.circulation),
                "the requested sweep".into(),
            )
        });
        for (other, of) in first.iter().chain(&asked) {
            if !other.is_same(&found) {
                let reason = format!(
                    "it is of sweep {} by {}, {of} is {} by {}: only shards of one sweep by one version, all with or all \
                     without --no-circulation, fit together",
                    found.sweep_hash, found.source, other.sweep_hash, other.source
                );
                return Err(Error::input(&folder.join(SWEEP), reason));
            }
        }
        first = first.or(Some((found, folder.display().to_string())));
    }
    let Some((definition, _)) = first else {
        let reason = "at least one folder of a sweep is needed";
        return Err(Error::input(Path::new("--merge"), reason));
    };
    let mut rows = Vec::new();
    let mut missing = Vec::new();
    for case in 0..definition.scene_hashes.len() {
        match folders
            .iter()
            .find_map(|folder| definition.stored(folder, case))
        {
            Some(row) => rows.push(row),
            None => missing.push(case.to_string()),
        }
    }
    if !missing.is_empty() {
        let more = if missing.len() > 10 { ", ..." } else { "" };
        let reason = format!(
            "{} of the {} cases have no result in the folders to merge, numbers {}{more}: run their shards, or those that were \
             cut off with --resume",
            missing.len(),
            definition.scene_hashes.len(),
            missing[..missing.len().min(10)].join(", ")
        );
        return Err(Error::input(Path::new("--merge"), reason));
    }
    write(&definition, &rows, out, existing)
}

/// Names of the files of all rows.
pub(super) fn names(definition: &Definition) -> Result<Vec<String>, Error> {
    Outputs::names(Formats::default(), |files| list(definition, None, files))
}

/// Writes the tables of all rows.
pub(super) fn write(
    definition: &Definition,
    rows: &[CaseResult],
    out: &Path,
    existing: Existing,
) -> Result<Vec<PathBuf>, Error> {
    let of = (Formats::default(), definition.origin());
    Outputs::write(out, existing, of, |files| {
        list(definition, Some(rows), files)
    })
}

/// The files of all cases, whose rows are not there before they are run.
pub(super) fn list(
    definition: &Definition,
    rows: Option<&[CaseResult]>,
    files: &mut Outputs,
) -> Result<(), Error> {
    files.table("results", rows, |rows| Ok(table(definition, rows)))?;
    files.table("front", rows, |rows| Ok(table(definition, on_front(rows))))?;
    files.netcdf("results", rows, |rows, _| netcdf(definition, rows))?;
    #[cfg(feature = "plots")]
    super::pictures::list(definition, rows, files)?;
    Ok(())
}

fn table<'r>(definition: &Definition, rows: impl IntoIterator<Item = &'r CaseResult>) -> Table {
    let rows: Vec<&CaseResult> = rows.into_iter().collect();
    let mut table = Table::new().int("case", rows.iter().map(|row| row.case as i64));
    for VaryingKey { name, holds, .. } in &definition.keys {
        table = match holds {
            Holds::Numbers => table.float(name, rows.iter().map(|row| row.key(name))),
            Holds::WholeNumbers | Holds::Texts => {
                table.text(name, rows.iter().map(|row| row.text(name)))
            }
        };
    }
    table = table.text("scene_hash", rows.iter().map(|row| row.scene_hash.clone()));
    for (name, ..) in results() {
        table = table.float(name, rows.iter().map(|row| row.result(name)));
    }
    table
}

/// Whole numbers below this are doubles without a loss.
const EXACT_BELOW: f64 = 9_007_199_254_740_992.0;

fn netcdf(definition: &Definition, rows: &[CaseResult]) -> Result<Vec<u8>, Error> {
    use crate::io::netcdf::{Data, Layout, Variable};
    use crate::keys::unit_of;
    let mut width = 1;
    for row in rows {
        width = width.max(row.scene_hash.len());
        for key in &definition.keys {
            width = width.max(row.text(&key.name).len());
        }
    }
    let mut numbers = Vec::with_capacity(rows.len());
    let mut hashes = Vec::new();
    for row in rows {
        numbers.push(i32::try_from(row.case).unwrap_or(i32::MAX));
        hashes.extend(padded(&row.scene_hash, width));
    }
    let case = Variable::new("case", &["case"], Data::i32(numbers));
    let mut variables = vec![case.text("long_name", "number of the case")];
    for VaryingKey { name, holds, .. } in &definition.keys {
        // Whole numbers that a double would round, such as drawn seeds, are texts.
        let is_round = rows
            .iter()
            .all(|row| row.key(name).abs() < EXACT_BELOW || *holds == Holds::Numbers);
        let variable = if is_round && *holds != Holds::Texts {
            let values = Data::f64(rows.iter().map(|row| row.key(name)));
            Variable::new(name, &["case"], values).text("units", unit_of(name).unwrap_or("1"))
        } else {
            let mut texts = Vec::new();
            for row in rows {
                texts.extend(padded(row.text(name), width));
            }
            Variable::new(name, &["case", "string_length"], Data::text(texts))
        };
        variables.push(variable.text("long_name", &format!("key {name} of the scene")));
    }
    variables.push(
        Variable::new("scene_hash", &["case", "string_length"], Data::text(hashes))
            .text("long_name", "hash of the scene of the case"),
    );
    for (name, unit, meaning) in results() {
        let values = Data::f64(rows.iter().map(|row| row.result(name)));
        let variable = Variable::new(name, &["case"], values)
            .attr("_FillValue", Data::f64([f64::NAN]))
            .text("units", unit);
        variables.push(variable.text("long_name", meaning));
    }
    let dims = vec![("case", rows.len()), ("string_length", width)];
    let origin = &definition.origin();
    Layout::cf("Results of a sweep over scenes", dims, variables, origin).into_bytes(origin)
}

/// The bytes of a text of a fixed width. What is not used is NUL: blanks stay in the texts of readers.
fn padded(text: &str, width: usize) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(width, 0);
    bytes
}
