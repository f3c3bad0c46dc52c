//! Reading classic NetCDF files: a file in memory, and its variables as `f64`.
//!
//! Check: the readers of initial fields and of cross-planes read back what the writers wrote.

use crate::Error;
use netcdf3::{DataVector, FileReader};
use std::io::Cursor;
use std::path::Path;

/// Opens a classic NetCDF file; it is read whole, since the reader asks for one number at a time.
///
/// # Errors
/// What the system says; a file of another kind.
pub(crate) fn open(path: &Path) -> Result<FileReader, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::Io { action: "read", path: path.to_owned(), source })?;
    FileReader::open_seek_read(&path.to_string_lossy(), Box::new(Cursor::new(bytes))).map_err(|e| Error::Input {
        path: path.to_owned(),
        reason: format!("no classic NetCDF file ({e:?}); from xarray, save with format=\"NETCDF3_64BIT\""),
    })
}

/// A variable as `f64`, whatever its type of number.
///
/// # Errors
/// A variable that is not there, or not made of numbers.
pub(crate) fn floats(file: &mut FileReader, name: &str) -> Result<Vec<f64>, String> {
    match file.read_var(name) {
        Ok(DataVector::F64(values)) => Ok(values),
        Ok(DataVector::F32(values)) => Ok(values.into_iter().map(f64::from).collect()),
        Ok(DataVector::I32(values)) => Ok(values.into_iter().map(f64::from).collect()),
        Ok(DataVector::I16(values)) => Ok(values.into_iter().map(f64::from).collect()),
        Ok(_) => Err(format!("variable {name} is not made of numbers")),
        Err(e) => Err(format!("coordinate or variable {name} cannot be read: {e:?}")),
    }
}
