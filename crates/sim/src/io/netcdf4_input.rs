//! What NetCDF-4 (HDF5) must not be before the library follows it: groups in circles and without end; and what the library passes over.
//!
//! Check: groups in circles and values that no file of that length holds are refused; a field that another program compressed in chunks
//! gives the wind that it was sampled from.

use super::number::{PACKING, Packing};
use hdf5_reader::Hdf5File;
use netcdf_reader::{NcFile, NcValue};
use std::path::Path;

/// Groups within groups, and groups of one depth, that anybody makes.
const DEEPEST: usize = 32;
const MOST_GROUPS: usize = 10_000;

/// Refuses a file whose groups hold each other, or are nested too deep: the library would follow them until its stack ends; a damaged
/// one in the words given. Returns the attributes that say how the numbers of its variables are packed, as far as they are there: the
/// library passes over those of types that it does not know.
///
/// # Errors
/// What is wrong with it; a damaged file.
pub(super) fn check_groups(path: &Path, unsound: &'static str) -> Result<Packing, &'static str> {
    let mut packing = Packing::new();
    let root = Hdf5File::open(path).and_then(|file| file.root_group());
    let mut groups = vec![(String::new(), root.map_err(|_| unsound)?)];
    for _ in 0..=DEEPEST {
        let mut below = Vec::new();
        for (path, group) in &groups {
            let (children, datasets) = group.members().map_err(|_| unsound)?;
            for dataset in datasets {
                let mut names: Vec<String> =
                    dataset.attributes().into_iter().map(|a| a.name).collect();
                names.retain(|name| PACKING.contains(&name.as_str()));
                packing.insert(format!("{path}{}", leaf(dataset.name())), names);
            }
            for child in children {
                below.push((format!("{path}{}/", leaf(child.name())), child));
            }
        }
        groups = below;
        if groups.is_empty() {
            return Ok(packing);
        }
        if groups.len() > MOST_GROUPS {
            break;
        }
    }
    Err("its groups hold each other, or are nested more than 32 deep")
}

/// The codes of a variable whose values have names, such as flags and booleans.
pub(super) fn codes(file: &NcFile, path: &str) -> Option<Vec<f64>> {
    let mut codes = Vec::new();
    for value in file.read_variable_user_defined(path).ok()? {
        let NcValue::Enum(named) = value else {
            return None;
        };
        codes.push(named.value.as_i128()? as f64);
    }
    Some(codes)
}

/// The last name of a path.
fn leaf(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

/// Small files for tests, made byte by byte.
#[cfg(test)]
pub(crate) mod made {
    /// An object of HDF5 with hard links to these places, and further messages.
    pub(crate) fn object(links: &[(&str, u64)], messages: &[(u16, Vec<u8>)]) -> Vec<u8> {
        let link = |(name, at): &(&str, u64)| {
            (
                6,
                [
                    &[1, 0, name.len() as u8][..],
                    name.as_bytes(),
                    &at.to_le_bytes(),
                ]
                .concat(),
            )
        };
        let all: Vec<(u16, Vec<u8>)> = links
            .iter()
            .map(link)
            .chain(messages.iter().cloned())
            .collect();
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
        let lengths: Vec<u8> = shape
            .iter()
            .flat_map(|length| length.to_le_bytes())
            .collect();
        let space = [&[1, shape.len() as u8, 0, 0, 0, 0, 0, 0][..], &lengths].concat();
        let double = vec![
            0x11, 0x20, 0x3F, 0, 8, 0, 0, 0, 0, 0, 64, 0, 52, 11, 0, 52, 0xFF, 3, 0, 0,
        ];
        let bytes = 8 * shape.iter().product::<u64>();
        let place = [&[3, 1][..], &at.to_le_bytes(), &bytes.to_le_bytes()].concat();
        object(
            &[],
            &[(1, space), (3, double), (5, vec![2, 2, 1, 0]), (8, place)],
        )
    }

    /// A file with these arrays in its root.
    pub(crate) fn of_arrays(arrays: &[(&str, &[u64], Vec<f64>)]) -> Vec<u8> {
        let names = |at: &dyn Fn(usize) -> u64| -> Vec<u8> {
            let links: Vec<(&str, u64)> = arrays
                .iter()
                .enumerate()
                .map(|(i, (name, ..))| (*name, at(i)))
                .collect();
            object(&links, &[])
        };
        let root = names(&|_| 0).len() as u64;
        let sizes: Vec<u64> = arrays
            .iter()
            .map(|(_, shape, _)| array(shape, 0).len() as u64)
            .collect();
        let ends: u64 = 96 + root + sizes.iter().sum::<u64>();
        let before = |i: usize| {
            arrays[..i]
                .iter()
                .map(|(.., values)| 8 * values.len() as u64)
                .sum::<u64>()
        };
        let mut objects = vec![names(&|i| 96 + root + sizes[..i].iter().sum::<u64>())];
        objects.extend(
            arrays
                .iter()
                .enumerate()
                .map(|(i, (_, shape, _))| array(shape, ends + before(i))),
        );
        objects.extend(
            arrays
                .iter()
                .map(|(.., values)| values.iter().flat_map(|v| v.to_le_bytes()).collect()),
        );
        file(&objects)
    }
}

#[cfg(test)]
mod tests {
    use super::made::{array, empty_group, file, object};
    use crate::io::netcdf_input::{NetcdfFile, open, open_groups};

    fn opened(bytes: &[u8]) -> Result<NetcdfFile, String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        open(file.path()).map_err(|e| e.to_string())
    }

    #[test]
    fn groups_in_circles_and_without_end_are_refused() {
        let size = object(&[("g", 0)], &[]).len() as u64;
        let first = object(&[("g", 96 + size)], &[]);
        assert_eq!(
            opened(&file(&[first, empty_group()])).map(|_| ()),
            Ok(()),
            "a group in a group is nothing strange"
        );
        let refused = |bytes: &[u8]| opened(bytes).err().unwrap_or_default();
        assert!(refused(&file(&[object(&[("g", 96)], &[])])).contains("hold each other"));
        assert!(
            refused(&file(&[object(&[("g", 96), ("h", 96)], &[])])).contains("hold each other")
        );
        let mut deep: Vec<Vec<u8>> = (1..3000)
            .map(|i| object(&[("g", 96 + i * size)], &[]))
            .collect();
        deep.push(empty_group());
        assert!(refused(&file(&deep)).contains("more than 32 deep"));
    }

    #[test]
    fn files_of_weather_radars_are_named_with_what_can_be_done() {
        // An attribute: sizes of its name, type and space, then these in whole words, then its text.
        let text = b"ODIM_H5/V2_2";
        let sizes = [1, 0, 12, 0, 8, 0, 8, 0];
        let of_type = [0x13, 0, 0, 0, 12, 0, 0, 0];
        let of_space = [1, 0, 0, 0, 0, 0, 0, 0];
        let name = b"Conventions\0\0\0\0\0";
        let attribute = [&sizes[..], name, &of_type, &of_space, text].concat();
        let root = |at: u64| object(&[("g", at)], &[(12, attribute.clone())]);
        let group = 96 + root(0).len() as u64;
        let radar = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(radar.path(), file(&[root(group), empty_group()])).unwrap();
        let refused = open_groups(radar.path(), "elevation", |file| file.has("elevation"));
        let said = refused.map(|_| ()).unwrap_err().to_string();
        assert!(
            said.contains("ODIM_H5") && said.contains("CfRadial"),
            "{said}"
        );
    }

    #[test]
    fn more_values_than_a_file_of_that_length_holds_are_refused() {
        // Never written: a fill value stands for all of them.
        let read = |count: u64| {
            let root = object(&[("g", 96 + object(&[("g", 0)], &[]).len() as u64)], &[]);
            let file = opened(&file(&[root, array(&[count], u64::MAX)])).unwrap();
            assert_eq!(file.shape("g"), Some(vec![count]));
            file.floats("g")
        };
        assert_eq!(read(5).map(|values| values.len()), Ok(5));
        let refused = read(1 << 24).unwrap_err();
        assert!(refused.contains("16777216 values, more than"), "{refused}");
    }
}
