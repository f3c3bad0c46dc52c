//! NetCDF-4 (HDF5) files as the readers of classic ones see them: a header, and variables as `f64`, whole or one place of the
//! slowest dimension at a time.
//!
//! Check: a field that another program compressed in chunks gives the wind that it was sampled from.

use crate::io::netcdf_header::{Attribute, Header, Variable, is_default_fill};
use crate::io::number::NumberType;
use netcdf_reader::{NcAttribute, NcFile, NcSliceInfo, NcSliceInfoElem, NcType};
use std::path::Path;

/// What is said of a file that the library does not read, and what may help.
const UNREADABLE: &str = "it is NetCDF-4 (HDF5), but damaged or of a kind that is not read: nccopy -k cdf2 in.nc out.nc makes classic \
                          NetCDF of it";

/// Opens a file; dimensions, variables and attributes of its root group.
///
/// # Errors
/// A file that is not sound or of a kind that is not read.
pub(super) fn open(path: &Path) -> Result<(NcFile, Header), String> {
    // What the library says would tell bytes of a file that may be anything.
    let unreadable = |_: netcdf_reader::Error| UNREADABLE.to_owned();
    let file = NcFile::open(path).map_err(unreadable)?;
    let root = file.root_group().map_err(unreadable)?;
    let mut header = Header { attributes: attributes(&root.attributes), ..Header::default() };
    for variable in &root.variables {
        let mut dims = Vec::new();
        for dim in variable.dimensions() {
            let known = header.dims.iter().position(|(name, size)| *name == dim.name && *size == dim.size);
            dims.push(known.unwrap_or_else(|| {
                header.dims.push((dim.name.clone(), dim.size));
                header.dims.len() - 1
            }));
        }
        let number = match variable.dtype() {
            NcType::Byte | NcType::Short | NcType::Int | NcType::Float | NcType::Double => NumberType::F64,
            NcType::UByte | NcType::UShort | NcType::UInt | NcType::Int64 | NcType::UInt64 => NumberType::F64,
            _ => NumberType::Text,
        };
        let run = variable.shape().iter().try_fold(1_u64, |n, length| n.checked_mul(*length));
        header.variables.push(Variable {
            name: variable.name().to_owned(),
            dims,
            attributes: attributes(variable.attributes()),
            number,
            begin: 0,
            run: run.ok_or("a variable has more values than can be counted")?,
            runs: 1,
        });
    }
    Ok((file, header))
}

fn attributes(list: &[NcAttribute]) -> Vec<(String, Attribute)> {
    let of = |a: &NcAttribute| {
        let number = a.value.as_f64().map(Attribute::Number);
        Some((a.name.clone(), a.value.as_string().map(Attribute::Text).or(number)?))
    };
    list.iter().filter_map(of).collect()
}

/// Values of a variable over `dims` dimensions, unpacked and NaN where they are missing: all, or those at one place of its slowest
/// dimension.
///
/// # Errors
/// A variable that is damaged, or packed in a way that is not read.
pub(super) fn read(file: &NcFile, name: &str, dims: usize, place: Option<usize>) -> Result<Vec<f64>, String> {
    let mut part = NcSliceInfo::all(dims);
    if let (Some(place), Some(slowest)) = (place, part.selections.first_mut()) {
        *slowest = NcSliceInfoElem::Index(place as u64);
    }
    let values = match place {
        Some(_) if dims > 0 => file.read_variable_slice_unpacked_masked(name, &part),
        _ => file.read_variable_unpacked_masked(name),
    };
    let values = values.map_err(|_| format!("variable {name} cannot be read: {UNREADABLE}"))?;
    // The library knows fills that the file states, not those of values that were never written.
    Ok(values.into_iter().map(|value| if is_default_fill(value) { f64::NAN } else { value }).collect())
}
