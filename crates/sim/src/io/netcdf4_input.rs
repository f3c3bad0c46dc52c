//! NetCDF-4 (HDF5) files as the readers of classic ones see them: a header, and variables as `f64`, whole or one place of the
//! slowest dimension at a time.
//!
//! Check: a field that another program compressed in chunks gives the wind that it was sampled from; groups in circles and values
//! that no file of that length holds are refused.

use crate::io::netcdf_header::{Attribute, Header, Variable, is_default_fill};
use crate::io::number::NumberType;
use crate::machine;
use hdf5_reader::Hdf5File;
use netcdf_reader::{NcAttribute, NcFile, NcSliceInfo, NcSliceInfoElem, NcType};
use std::path::Path;

/// What is said of a file that the library does not read, and what may help.
const UNREADABLE: &str = "it is NetCDF-4 (HDF5), but damaged or of a kind that is not read: nccopy -k cdf2 in.nc out.nc makes classic \
                          NetCDF of it";

/// Groups within groups, and groups of one depth, that anybody makes.
const DEEPEST: usize = 32;
const MOST_GROUPS: usize = 10_000;
/// Deflate makes no more than so many bytes of one.
const MOST_EXPANDED: f64 = 1032.0;

/// A file whose groups are sound, and how long it is.
pub(super) struct Nc4File {
    file: NcFile,
    bytes: u64,
}

impl Nc4File {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that is not sound or of a kind that is not read; groups that hold each other, or are nested too deep: the library
    /// would follow them until its stack ends.
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        // What the library says would tell bytes of a file that may be anything.
        let damaged = |_: hdf5_reader::error::Error| UNREADABLE.to_owned();
        let root = Hdf5File::open(path).and_then(|file| file.root_group()).map_err(damaged)?;
        let mut groups = vec![root];
        for depth in 0.. {
            let below: Result<Vec<_>, _> = groups.iter().map(|group| group.groups()).collect();
            groups = below.map_err(damaged)?.into_iter().flatten().collect();
            if groups.is_empty() {
                break;
            }
            if depth == DEEPEST || groups.len() > MOST_GROUPS {
                return Err(format!("its groups hold each other, or are nested more than {DEEPEST} deep"));
            }
        }
        let bytes = std::fs::metadata(path).map_err(|e| e.to_string())?.len();
        Ok(Self { file: NcFile::open(path).map_err(|_| UNREADABLE.to_owned())?, bytes })
    }

    /// Names of the root, which is empty, and of the groups in it.
    ///
    /// # Errors
    /// A damaged file.
    pub(super) fn groups(&self) -> Result<Vec<String>, String> {
        let root = self.file.root_group().map_err(|_| UNREADABLE.to_owned())?;
        Ok(std::iter::once(String::new()).chain(root.groups.iter().map(|group| group.name.clone())).collect())
    }

    /// Dimensions and variables of a group, with the attributes of the root.
    ///
    /// # Errors
    /// A damaged file, no such group.
    pub(super) fn header(&self, group: &str) -> Result<Header, String> {
        let root = self.file.root_group().map_err(|_| UNREADABLE.to_owned())?;
        let own = if group.is_empty() { Some(root) } else { root.groups.iter().find(|own| own.name == group) };
        let mut header = Header { attributes: attributes(&root.attributes), ..Header::default() };
        for variable in &own.ok_or(UNREADABLE)?.variables {
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
        Ok(header)
    }

    /// Values of a variable of a group, unpacked and NaN where they are missing: all, or those at one place of its slowest dimension.
    ///
    /// # Errors
    /// A variable that is damaged, packed in a way that is not read, or larger than the file and the memory can hold.
    pub(super) fn read(
        &self,
        group: &str,
        name: &str,
        shape: &[u64],
        place: Option<usize>,
    ) -> Result<Vec<f64>, String> {
        let path = if group.is_empty() { name.to_owned() } else { format!("{group}/{name}") };
        let place = place.filter(|_| !shape.is_empty());
        let numbers: f64 = shape[usize::from(place.is_some())..].iter().map(|length| *length as f64).product();
        if numbers > MOST_EXPANDED * self.bytes as f64 {
            return Err(format!("variable {name} has {numbers} values, more than {} bytes can hold", self.bytes));
        }
        // As they are in the file, as the library and as this program hands them on.
        machine::holds(&format!("variable {name}"), 32.0 * numbers)?;
        let values = match place {
            Some(place) => {
                let mut part = NcSliceInfo::all(shape.len());
                part.selections[0] = NcSliceInfoElem::Index(place as u64);
                self.file.read_variable_slice_unpacked_masked(&path, &part)
            }
            None => self.file.read_variable_unpacked_masked(&path),
        };
        let values = values.map_err(|_| format!("variable {name} cannot be read: {UNREADABLE}"))?;
        // The library knows fills that the file states, not those of values that were never written.
        Ok(values.into_iter().map(|value| if is_default_fill(value) { f64::NAN } else { value }).collect())
    }
}

fn attributes(list: &[NcAttribute]) -> Vec<(String, Attribute)> {
    let of = |a: &NcAttribute| {
        let number = a.value.as_f64().map(Attribute::Number);
        Some((a.name.clone(), a.value.as_string().map(Attribute::Text).or(number)?))
    };
    list.iter().filter_map(of).collect()
}

/// Small files for tests, made byte by byte.
#[cfg(test)]
pub(crate) mod made {
    /// An object of HDF5 with hard links to these places, and further messages.
    pub(crate) fn object(links: &[(&str, u64)], messages: &[(u16, Vec<u8>)]) -> Vec<u8> {
        let link = |(name, at): &(&str, u64)| {
            (6, [&[1, 0, name.len() as u8][..], name.as_bytes(), &at.to_le_bytes()].concat())
        };
        let all: Vec<(u16, Vec<u8>)> = links.iter().map(link).chain(messages.iter().cloned()).collect();
        let mut body = Vec::new();
        for (kind, data) in &all {
            let padded = data.len().div_ceil(8) * 8;
            body.extend(kind.to_le_bytes());
            body.extend((padded as u16).to_le_bytes());
            body.extend([0; 4]);
            body.extend(data);
            body.resize(body.len() + padded - data.len(), 0);
        }
        let mut out = vec![1, 0];
        out.extend((all.len() as u16).to_le_bytes());
        out.extend(1_u32.to_le_bytes());
        out.extend((body.len() as u32).to_le_bytes());
        out.extend([0; 4]);
        out.extend(body);
        out
    }

    /// A group without anything in it.
    pub(crate) fn empty_group() -> Vec<u8> {
        object(&[], &[(2, [&[0; 2][..], &[0xFF; 16]].concat())])
    }

    /// A file whose objects follow each other from byte 96 on, the root first.
    pub(crate) fn file(objects: &[Vec<u8>]) -> Vec<u8> {
        let length = 96 + objects.iter().map(Vec::len).sum::<usize>() as u64;
        let mut out = b"\x89HDF\r\n\x1a\n".to_vec();
        out.extend([0, 0, 0, 0, 0, 8, 8, 0, 4, 0, 16, 0, 0, 0, 0, 0]);
        for word in [0, u64::MAX, length, u64::MAX, 0, 96, 0, 0, 0] {
            out.extend(word.to_le_bytes());
        }
        objects.iter().for_each(|object| out.extend(object));
        out
    }

    /// An array of doubles whose numbers are at a place of the file.
    pub(crate) fn array(shape: &[u64], at: u64) -> Vec<u8> {
        let lengths: Vec<u8> = shape.iter().flat_map(|length| length.to_le_bytes()).collect();
        let space = [&[1, shape.len() as u8, 0, 0, 0, 0, 0, 0][..], &lengths].concat();
        let double = vec![0x11, 0x20, 0x3F, 0, 8, 0, 0, 0, 0, 0, 64, 0, 52, 11, 0, 52, 0xFF, 3, 0, 0];
        let bytes = 8 * shape.iter().product::<u64>();
        let place = [&[3, 1][..], &at.to_le_bytes(), &bytes.to_le_bytes()].concat();
        object(&[], &[(1, space), (3, double), (5, vec![2, 2, 1, 0]), (8, place)])
    }

    /// A file with these arrays in its root.
    pub(crate) fn of_arrays(arrays: &[(&str, &[u64], Vec<f64>)]) -> Vec<u8> {
        let names = |at: &dyn Fn(usize) -> u64| -> Vec<u8> {
            let links: Vec<(&str, u64)> = arrays.iter().enumerate().map(|(i, (name, ..))| (*name, at(i))).collect();
            object(&links, &[])
        };
        let root = names(&|_| 0).len() as u64;
        let sizes: Vec<u64> = arrays.iter().map(|(_, shape, _)| array(shape, 0).len() as u64).collect();
        let ends: u64 = 96 + root + sizes.iter().sum::<u64>();
        let before = |i: usize| arrays[..i].iter().map(|(.., values)| 8 * values.len() as u64).sum::<u64>();
        let mut objects = vec![names(&|i| 96 + root + sizes[..i].iter().sum::<u64>())];
        objects.extend(arrays.iter().enumerate().map(|(i, (_, shape, _))| array(shape, ends + before(i))));
        objects.extend(arrays.iter().map(|(.., values)| values.iter().flat_map(|v| v.to_le_bytes()).collect()));
        file(&objects)
    }
}

#[cfg(test)]
mod tests {
    use super::made::{array, empty_group, file, object};
    use super::*;

    fn opened(bytes: &[u8]) -> Result<(Nc4File, Header), String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.nc");
        std::fs::write(&path, bytes).unwrap();
        let file = Nc4File::open(&path)?;
        let header = file.header("")?;
        Ok((file, header))
    }

    #[test]
    fn groups_in_circles_and_without_end_are_refused() {
        let size = object(&[("g", 0)], &[]).len() as u64;
        let first = object(&[("g", 96 + size)], &[]);
        assert_eq!(opened(&file(&[first, empty_group()])).map(|_| ()), Ok(()), "a group in a group is nothing strange");
        let refused = |bytes: &[u8]| opened(bytes).err().unwrap_or_default();
        assert!(refused(&file(&[object(&[("g", 96)], &[])])).contains("hold each other"));
        assert!(refused(&file(&[object(&[("g", 96), ("h", 96)], &[])])).contains("hold each other"));
        let mut deep: Vec<Vec<u8>> = (1..3000).map(|i| object(&[("g", 96 + i * size)], &[])).collect();
        deep.push(empty_group());
        assert!(refused(&file(&deep)).contains("more than 32 deep"));
    }

    #[test]
    fn more_values_than_a_file_of_that_length_holds_are_refused() {
        // Never written: a fill value stands for all of them.
        let read = |count: u64| {
            let root = object(&[("g", 96 + object(&[("g", 0)], &[]).len() as u64)], &[]);
            let (file, header) = opened(&file(&[root, array(&[count], u64::MAX)])).unwrap();
            assert_eq!(header.variables[0].run, count);
            file.read("", "g", &[count], None)
        };
        assert_eq!(read(5).map(|values| values.len()), Ok(5));
        let refused = read(1 << 24).unwrap_err();
        assert!(refused.contains("16777216 values, more than"), "{refused}");
    }
}
