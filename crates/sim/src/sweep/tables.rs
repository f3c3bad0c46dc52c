//! The results of all cases as tables: CSV, NetCDF, and the pictures of them.
//!
//! Check: the same rows give the same bytes; the NetCDF file is read back by an independent reader.

use super::results::RESULTS;
use super::stored::{Definition, Holds, Row, VaryingKey};
use crate::Error;
use crate::io::Table;
use crate::outputs::Outputs;

/// The files of all cases, whose rows are not there before they are run.
pub(super) fn list(definition: &Definition, rows: Option<&[Row]>, files: &mut Outputs) -> Result<(), Error> {
    files.table("results", rows, |rows| Ok(table(definition, rows)))?;
    #[cfg(feature = "netcdf")]
    files.netcdf("results", rows, |rows, _| netcdf(definition, rows))?;
    #[cfg(feature = "plots")]
    super::pictures::list(definition, rows, files)?;
    Ok(())
}

fn table(definition: &Definition, rows: &[Row]) -> Table {
    let mut table = Table::new().int("case", rows.iter().map(|row| row.case as i64));
    for (place, VaryingKey { name, holds, .. }) in definition.keys.iter().enumerate() {
        table = match holds {
            Holds::Numbers => table.float(name, rows.iter().map(|row| row.key(place))),
            Holds::WholeNumbers | Holds::Texts => {
                table.text(name, rows.iter().map(|row| row.keys.get(place).cloned().unwrap_or_default()))
            }
        };
    }
    table = table.text("scene_hash", rows.iter().map(|row| row.scene_hash.clone()));
    for (name, ..) in RESULTS {
        table = table.float(name, rows.iter().map(|row| row.result(name)));
    }
    table
}

/// Whole numbers below this are doubles without a loss.
#[cfg(feature = "netcdf")]
const EXACT_BELOW: f64 = 9_007_199_254_740_992.0;

#[cfg(feature = "netcdf")]
fn netcdf(definition: &Definition, rows: &[Row]) -> Result<Vec<u8>, Error> {
    use crate::io::netcdf::{Data, Layout, Variable};
    use crate::keys::unit_of;
    let text = |row: &Row, place: usize| row.keys.get(place).cloned().unwrap_or_default();
    let texts = (0..definition.keys.len()).flat_map(|place| rows.iter().map(move |row| text(row, place).len()));
    let width = texts.chain(rows.iter().map(|row| row.scene_hash.len())).chain([1]).max().unwrap_or(1);
    // What is not used is NUL: blanks stay in the words of readers.
    let words = |name: &str, of: &dyn Fn(&Row) -> String| {
        let padded =
            |row: &Row| of(row).into_bytes().into_iter().chain(std::iter::repeat(0)).take(width).collect::<Vec<u8>>();
        Variable::new(name, &["case", "string_length"], Data::text(rows.iter().flat_map(padded).collect::<Vec<u8>>()))
    };
    let case = rows.iter().map(|row| i32::try_from(row.case).unwrap_or(i32::MAX));
    let mut variables = vec![Variable::new("case", &["case"], Data::i32(case)).text("long_name", "number of the case")];
    for (place, VaryingKey { name, holds, .. }) in definition.keys.iter().enumerate() {
        // Whole numbers that a double would round, such as drawn seeds, are words.
        let is_round = rows.iter().all(|row| row.key(place).abs() < EXACT_BELOW || *holds == Holds::Numbers);
        let variable = match holds {
            Holds::Numbers | Holds::WholeNumbers if is_round => {
                Variable::new(name, &["case"], Data::f64(rows.iter().map(|row| row.key(place))))
                    .text("units", unit_of(name).unwrap_or("1"))
            }
            _ => words(name, &|row| text(row, place)),
        };
        variables.push(variable.text("long_name", &format!("key {name} of the scene")));
    }
    variables
        .push(words("scene_hash", &|row| row.scene_hash.clone()).text("long_name", "hash of the scene of the case"));
    for (name, unit, meaning) in RESULTS {
        let values = rows.iter().map(|row| row.result(name));
        let variable = Variable::new(name, &["case"], Data::f64(values));
        let variable = variable.attr("_FillValue", Data::f64([f64::NAN]));
        variables.push(variable.text("units", unit).text("long_name", meaning));
    }
    let dims = vec![("case", rows.len()), ("string_length", width)];
    let origin = &definition.origin;
    Ok(Layout::cf("Results of a sweep over scenes", dims, variables, origin).into_bytes(origin)?)
}
