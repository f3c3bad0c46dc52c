//! Arrays as numpy stores them: one in an NPY file, several in an NPZ archive that is not compressed.
//!
//! Only where an array is and how its numbers stand is read here. Check: files that numpy wrote; damaged ones.

use crate::io::number::{ByteOrder, NumberType};
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
const NO_ARRAY: &str = "it is no sound NPY file: its header is damaged";
const NO_ARCHIVE: &str = "it is no sound NPZ file: its table of contents is damaged";
/// Longest header that is read \[bytes\].
const LONGEST_HEADER_BYTES: u64 = 1 << 20;

impl StoredArray {
    /// Reads the header of an array that begins at `at` and ends at `end`.
    pub(super) fn read(file: &mut File, at: u64, end: u64) -> Result<Self, String> {
        let mut bytes = Vec::new();
        let read = file.seek(SeekFrom::Start(at)).and_then(|_| {
            Read::by_ref(file).take(LONGEST_HEADER_BYTES.min(end.saturating_sub(at))).read_to_end(&mut bytes)
        });
        read.map_err(|e| e.to_string())?;
        let (length, head) = match bytes.get(..12) {
            Some([0x93, b'N', b'U', b'M', b'P', b'Y', 1, _, a, b, ..]) => (u32::from(u16::from_le_bytes([*a, *b])), 10),
            Some([0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _, a, b, c, d]) => {
                (u32::from_le_bytes([*a, *b, *c, *d]), 12)
            }
            _ => return Err(NO_ARRAY.into()),
        };
        let text = bytes.get(head..head + length as usize).ok_or(NO_ARRAY)?;
        let found = Self::of_text(&String::from_utf8_lossy(text), at + head as u64 + u64::from(length))?;
        let numbers = found.shape.iter().try_fold(1_u64, |n, length| n.checked_mul(*length));
        let bytes = numbers.and_then(|n| n.checked_mul(found.number.bytes * if found.is_complex { 2 } else { 1 }));
        let over = bytes.and_then(|bytes| bytes.checked_add(found.begin)).ok_or(TRUNCATED)?;
        match over {
            over if over > end => Err(format!("{TRUNCATED} by {} bytes", over - end)),
            over if over < end => Err(format!("it has {} bytes more than its header says", end - over)),
            _ => Ok(found),
        }
    }

    fn of_text(text: &str, begin: u64) -> Result<Self, String> {
        let after = |key: &str| Some(text.split_once(&format!("'{key}':"))?.1.trim_start());
        let kind = after("descr").and_then(|rest| rest.strip_prefix('\'')?.split('\'').next()).ok_or(NO_ARRAY)?;
        let fortran_order = after("fortran_order").ok_or(NO_ARRAY)?.starts_with("True");
        let shape = after("shape").and_then(|rest| rest.strip_prefix('(')?.split(')').next()).ok_or(NO_ARRAY)?;
        let shape: Option<Vec<u64>> =
            shape.split(',').map(str::trim).filter(|n| !n.is_empty()).map(|n| n.parse().ok()).collect();
        // A sign of the byte order, then the kind; bytes that are no text may be several to a sign.
        let mut signs = kind.chars();
        let (order, name) = (signs.next(), signs.as_str());
        let (number, is_complex) = match name {
            "c8" => (Some(NumberType::F32), true),
            "c16" => (Some(NumberType::F64), true),
            name => (NumberType::of_numpy(name), false),
        };
        let byte_order = if order == Some('>') { ByteOrder::Big } else { ByteOrder::Little };
        let number = number.ok_or_else(|| {
            format!(
                "its numbers are of the kind {kind:?}; integers, floats of 32 and 64 bits and complex numbers are read: \
                 numpy's astype(\"f4\") makes them"
            )
        })?;
        Ok(Self { number, byte_order, is_complex, fortran_order, shape: shape.ok_or(NO_ARRAY)?, begin })
    }
}

/// The arrays of an archive, by name.
pub(super) fn archive(file: &mut File, length: u64) -> Result<Vec<(String, StoredArray)>, String> {
    let (table, count) = contents(file, length)?;
    let (mut rest, mut found) = (&table[..], Vec::new());
    for _ in 0..count {
        if rest.len() < 46 || !rest.starts_with(b"PK\x01\x02") {
            return Err(NO_ARCHIVE.into());
        }
        let lengths = [number(rest, 28, 2), number(rest, 30, 2), number(rest, 32, 2)].map(|n| n as usize);
        let (own, after) = rest.split_at_checked(46 + lengths.iter().sum::<usize>()).ok_or(NO_ARCHIVE)?;
        rest = after;
        let (name, extra) = own[46..].split_at(lengths[0]);
        let mut wide = wide_numbers(&extra[..lengths[1]]).into_iter();
        let mut of = |short: u64| if short == u64::from(u32::MAX) { wide.next() } else { Some(short) };
        let (bytes, _, at) = (of(number(own, 24, 4)), of(number(own, 20, 4)), of(number(own, 42, 4)));
        let (bytes, at) = (bytes.ok_or(NO_ARCHIVE)?, at.ok_or(NO_ARCHIVE)?);
        let name = String::from_utf8_lossy(name);
        let Some(name) = name.strip_suffix(".npy") else { continue };
        if number(own, 10, 2) != 0 {
            return Err(
                "its arrays are compressed: numpy.savez writes them as they are, savez_compressed does not".into()
            );
        }
        // The name and the extra field stand there again, and may differ in length.
        let head = bytes_at(file, at, 30)?;
        if !head.starts_with(b"PK\x03\x04") {
            return Err(NO_ARCHIVE.into());
        }
        let begin = at + 30 + number(&head, 26, 2) + number(&head, 28, 2);
        let end = begin.checked_add(bytes).filter(|end| *end <= length).ok_or(TRUNCATED)?;
        found.push((name.to_owned(), StoredArray::read(file, begin, end)?));
    }
    Ok(found)
}

/// The table of contents and the number of its entries, of files beyond 4 GiB too.
fn contents(file: &mut File, length: u64) -> Result<(Vec<u8>, u64), String> {
    let tail_at = length.saturating_sub(66_000);
    let tail = bytes_at(file, tail_at, length - tail_at)?;
    let last = tail.windows(4).rposition(|w| w == b"PK\x05\x06").filter(|at| at + 22 <= tail.len()).ok_or(TRUNCATED)?;
    let end = &tail[last..];
    let (mut count, mut size, mut at) = (number(end, 10, 2), number(end, 12, 4), number(end, 16, 4));
    if at == u64::from(u32::MAX) || count == u64::from(u16::MAX) {
        let locator = last.checked_sub(20).map(|at| &tail[at..]).filter(|l| l.starts_with(b"PK\x06\x07"));
        let record = bytes_at(file, number(locator.ok_or(NO_ARCHIVE)?, 8, 8), 56)?;
        (count, size, at) = (number(&record, 32, 8), number(&record, 40, 8), number(&record, 48, 8));
    }
    if size > LONGEST_HEADER_BYTES {
        return Err(NO_ARCHIVE.into());
    }
    Ok((bytes_at(file, at, size)?, count))
}

/// The numbers of eight bytes of an extra field.
fn wide_numbers(mut extra: &[u8]) -> Vec<u64> {
    while let Some((head, rest)) = extra.split_at_checked(4) {
        let (kind, length) = (number(head, 0, 2), number(head, 2, 2) as usize);
        let Some((own, after)) = rest.split_at_checked(length) else { break };
        if kind == 1 {
            return own.chunks_exact(8).map(|bytes| number(bytes, 0, 8)).collect();
        }
        extra = after;
    }
    Vec::new()
}

/// A number of some bytes, the lowest first; 0 beyond the end.
fn number(bytes: &[u8], at: usize, count: usize) -> u64 {
    let own = bytes.get(at..at + count).unwrap_or(&[]);
    own.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

fn bytes_at(file: &mut File, at: u64, count: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(at))
        .and_then(|_| Read::by_ref(file).take(count).read_to_end(&mut bytes))
        .map_err(|e| e.to_string())?;
    if bytes.len() as u64 == count { Ok(bytes) } else { Err(TRUNCATED.into()) }
}
