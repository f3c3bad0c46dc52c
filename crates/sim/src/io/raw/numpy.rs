//! Arrays as numpy stores them: one in an NPY file, several in an NPZ archive that is not compressed.
//!
//! Only where an array is and how its numbers are stored is read here. Check: files that numpy wrote; damaged ones.

use crate::io::number::{ByteOrder, NumberType};
use rawzip::{CompressionMethod, RECOMMENDED_BUFFER_SIZE, ZipArchive};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

/// An array as a header or a user states it, and its place in a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StoredArray {
    pub(super) number: NumberType,
    pub(super) byte_order: ByteOrder,
    pub(super) is_complex: bool,
    pub(super) fortran_order: bool,
    pub(super) shape: Vec<u64>,
    /// Where its numbers begin.
    pub(super) begin: u64,
}

const TRUNCATED: &str = "it is cut short: it ends before its last array does";
const NO_ARRAY: &str = "it is not a valid NPY file: its header is damaged";
const NO_ARCHIVE: &str =
    "it is not a valid NPZ file: it is cut short, or its table of contents is damaged";
/// Longest header that is read \[bytes\].
const LONGEST_HEADER_BYTES: u64 = 1 << 20;

impl StoredArray {
    /// Bytes of a sample.
    pub(super) fn sample_bytes(&self) -> u64 {
        self.number.bytes * if self.is_complex { 2 } else { 1 }
    }

    /// Reads the header of an array that begins at `at` and ends at `end`.
    pub(super) fn read(file: &mut File, at: u64, end: u64) -> Result<Self, String> {
        let mut bytes = Vec::new();
        let read = file.seek(SeekFrom::Start(at)).and_then(|_| {
            Read::by_ref(file)
                .take(LONGEST_HEADER_BYTES.min(end.saturating_sub(at)))
                .read_to_end(&mut bytes)
        });
        read.map_err(|e| e.to_string())?;
        let (length, head) = match bytes.get(..12) {
            Some([0x93, b'N', b'U', b'M', b'P', b'Y', 1, _, a, b, ..]) => {
                (u32::from(u16::from_le_bytes([*a, *b])), 10)
            }
            Some([0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _, a, b, c, d]) => {
                (u32::from_le_bytes([*a, *b, *c, *d]), 12)
            }
            _ => return Err(NO_ARRAY.into()),
        };
        let text = bytes.get(head..head + length as usize).ok_or(NO_ARRAY)?;
        let found = Self::from_header(
            &String::from_utf8_lossy(text),
            at + head as u64 + u64::from(length),
        )?;
        let numbers = found
            .shape
            .iter()
            .try_fold(1_u64, |n, length| n.checked_mul(*length));
        let bytes = numbers.and_then(|n| n.checked_mul(found.sample_bytes()));
        let over = bytes
            .and_then(|bytes| bytes.checked_add(found.begin))
            .ok_or(TRUNCATED)?;
        match over {
            over if over > end => Err(format!("{TRUNCATED} by {} bytes", over - end)),
            over if over < end => Err(format!(
                "it has {} bytes more than its header says",
                end - over
            )),
            _ => Ok(found),
        }
    }

    fn from_header(text: &str, begin: u64) -> Result<Self, String> {
        let description = entry(text, "descr").ok_or(NO_ARRAY)?;
        if description.starts_with('[') {
            return Err("its numbers have several fields; plain or complex numbers are read: a[\"i\"] + 1j * a[\"q\"] in numpy, by the names of \
                 its fields"
                .into());
        }
        let kind = Some(description)
            .and_then(|rest| rest.strip_prefix('\'')?.split('\'').next())
            .ok_or(NO_ARRAY)?;
        let fortran_order = entry(text, "fortran_order")
            .ok_or(NO_ARRAY)?
            .starts_with("True");
        let lengths = entry(text, "shape")
            .and_then(|rest| rest.strip_prefix('(')?.split(')').next())
            .ok_or(NO_ARRAY)?;
        // A sign of the byte order, then the kind; bytes that are no text may be several to a sign.
        let mut signs = kind.chars();
        let order = signs.next();
        let name = signs.as_str();
        let (number, is_complex) = match name {
            "c8" => (Some(NumberType::F32), true),
            "c16" => (Some(NumberType::F64), true),
            name => (NumberType::from_numpy(name), false),
        };
        let byte_order = if order == Some('>') {
            ByteOrder::Big
        } else {
            ByteOrder::Little
        };
        let number = number.ok_or_else(|| {
            format!(
                "its numbers are of the kind {kind:?}; integers, floats of 32 and 64 bits and complex numbers are read: \
                 numpy's astype(\"f4\") makes them"
            )
        })?;
        let mut shape = Vec::new();
        for length in lengths.split(',').map(str::trim) {
            if !length.is_empty() {
                shape.push(length.parse().map_err(|_| NO_ARRAY)?);
            }
        }
        Ok(Self {
            number,
            byte_order,
            is_complex,
            fortran_order,
            shape,
            begin,
        })
    }
}

/// What follows a key of a header.
fn entry<'t>(text: &'t str, key: &str) -> Option<&'t str> {
    let (_, rest) = text.split_once(&format!("'{key}':"))?;
    Some(rest.trim_start())
}

/// The arrays of an archive, by name.
pub(super) fn archive(file: &mut File, length: u64) -> Result<Vec<(String, StoredArray)>, String> {
    let own = file.try_clone().map_err(|e| e.to_string())?;
    let [mut tail, mut table] = [(); 2].map(|()| vec![0; RECOMMENDED_BUFFER_SIZE]);
    let archive = ZipArchive::from_file(own, &mut tail).map_err(|_| NO_ARCHIVE)?;
    let mut entries = archive.entries(&mut table);
    let mut found = Vec::new();
    while let Some(entry) = entries.next_entry().map_err(|_| NO_ARCHIVE)? {
        let name = String::from_utf8_lossy(entry.file_path().as_bytes()).into_owned();
        let Some(name) = name.strip_suffix(".npy") else {
            continue;
        };
        if entry.compression_method() != CompressionMethod::STORE {
            return Err(
                "its arrays are compressed: numpy.savez writes them as they are, savez_compressed does not".into()
            );
        }
        let (begin, end) = archive
            .get_entry(entry.wayfinder())
            .map_err(|_| NO_ARCHIVE)?
            .compressed_data_range();
        if end > length {
            return Err(NO_ARCHIVE.into());
        }
        found.push((name.to_owned(), StoredArray::read(file, begin, end)?));
    }
    Ok(found)
}
