//! Arrays of a Zarr v3 group: metadata, chunks, and their reader.
//!
//! The part of the format that data sets need, by the Zarr core specification 3.0: a regular grid that divides the first axis alone,
//! chunk keys of the default encoding with `/`, the codecs `bytes` (little-endian) and `gzip` (level 1, without time and name, so that
//! equal values have equal bytes), consolidated metadata of the group. Whole numbers may be packed by the CF conventions with
//! `scale_factor`, `add_offset` and `_FillValue`.
//!
//! Check: values come back within half a step; absent chunks are missing, damaged ones are refused with their path; a file is
//! there whole or not at all.

use super::atomic::StagingFolder;
use super::number::{ByteOrder, NumberType};
use crate::Error;
use flate2::{Compression, GzBuilder, read::GzDecoder};
use ndarray::{ArrayD, IxDyn};
use serde_json::{Map, Value, json};
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Name of the file with the metadata of a group or an array.
pub const METADATA: &str = "zarr.json";
/// Level of gzip: level 5 makes packed cells smaller by less than 1 % and needs three times the time.
const LEVEL: u32 = 1;

/// An array: what its metadata say.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Its name in the group.
    pub name: String,
    /// Lengths of its axes.
    pub shape: Vec<usize>,
    /// Names of its axes.
    pub dimensions: Vec<String>,
    /// Entries along the first axis in each chunk; chunks are whole along the others.
    pub chunk_rows: usize,
    /// How a number is stored.
    pub(crate) number: NumberType,
    /// The number of cells that were never written; NaN of floats.
    pub fill: f64,
    /// Attributes, those of CF among them.
    pub attributes: Map<String, Value>,
}

impl Array {
    /// An array with the name of a number type of Zarr, such as `int16`, and axes with names and lengths. Without attributes; its
    /// fill value is 0, of floats NaN. `None` for an unknown number type or no axis.
    pub fn new(
        name: &str,
        number: &str,
        axes: &[(&str, usize)],
        chunk_rows: usize,
    ) -> Option<Self> {
        let number = NumberType::from_zarr(number)?;
        axes.first()?;
        Some(Self {
            name: name.into(),
            shape: axes.iter().map(|(_, length)| *length).collect(),
            dimensions: axes.iter().map(|(axis, _)| (*axis).into()).collect(),
            chunk_rows: chunk_rows.max(1),
            number,
            fill: if number.is_float() { f64::NAN } else { 0.0 },
            attributes: Map::new(),
        })
    }

    /// The array with an attribute.
    #[must_use]
    pub fn with(mut self, attribute: &str, value: impl Into<Value>) -> Self {
        self.attributes.insert(attribute.into(), value.into());
        self
    }

    /// The array with whole numbers of this step, of which one code is missing.
    #[must_use]
    pub fn packed(mut self, step: f64, first: f64, missing: i32) -> Self {
        self.fill = f64::from(missing);
        if first != 0.0 {
            self = self.with("add_offset", first);
        }
        self.with("scale_factor", step).with("_FillValue", missing)
    }

    /// Numbers of one entry along the first axis.
    pub fn row_len(&self) -> usize {
        self.shape[1..].iter().product()
    }

    /// Number of chunks.
    pub fn chunks(&self) -> usize {
        self.shape[0].div_ceil(self.chunk_rows)
    }

    /// Bytes of a chunk before compression; the last one is filled up.
    pub fn chunk_bytes(&self) -> usize {
        self.chunk_rows * self.row_len() * self.number.bytes as usize
    }

    /// Path of a chunk in the folder of the group.
    pub fn chunk_key(&self, chunk: usize) -> String {
        let others = "/0".repeat(self.shape.len() - 1);
        format!("{}/c/{chunk}{others}", self.name)
    }

    /// The metadata as JSON.
    pub fn to_json(&self) -> Value {
        let mut chunk_shape = self.shape.clone();
        chunk_shape[0] = self.chunk_rows;
        let fill = match self.number.is_float() {
            true => json!("NaN"),
            false => json!(self.fill as i64),
        };
        let mut bytes = json!({ "name": "bytes" });
        if self.number.bytes > 1 {
            bytes["configuration"] = json!({ "endian": "little" });
        }
        json!({
            "zarr_format": 3,
            "node_type": "array",
            "shape": self.shape,
            "data_type": self.number.zarr_name(),
            "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": chunk_shape } },
            "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
            "fill_value": fill,
            "codecs": [bytes, { "name": "gzip", "configuration": { "level": LEVEL } }],
            "attributes": self.attributes,
            "dimension_names": self.dimensions,
        })
    }

    /// Reads metadata.
    ///
    /// # Errors
    /// The part that is missing, or of a kind that this module does not write.
    fn from_json(name: &str, value: &Value) -> Result<Self, String> {
        let refused = |what: &str| format!("its array \"{name}\" has {what}");
        let lengths = |pointer: &str| -> Option<Vec<usize>> {
            let all = value.pointer(pointer)?.as_array()?.iter();
            all.map(|length| usize::try_from(length.as_u64()?).ok())
                .collect()
        };
        let shape = lengths("/shape").ok_or_else(|| refused("no shape"))?;
        let chunk_shape = lengths("/chunk_grid/configuration/chunk_shape")
            .filter(|chunk| chunk.len() == shape.len() && !shape.is_empty() && chunk[0] > 0)
            .filter(|chunk| chunk[1..] == shape[1..])
            .ok_or_else(|| refused("chunks that are not whole along all axes but the first"))?;
        let mut sizes = shape.iter().chain(&chunk_shape);
        let cells = sizes.try_fold(1_usize, |cells, length| cells.checked_mul((*length).max(1)));
        if cells.is_none_or(|cells| cells > usize::MAX / 8) {
            return Err(refused("a shape that no memory holds"));
        }
        let number = value["data_type"]
            .as_str()
            .and_then(NumberType::from_zarr)
            .ok_or_else(|| refused("an unknown data_type"))?;
        let axes: Option<Vec<&str>> = value["dimension_names"]
            .as_array()
            .filter(|names| names.len() == shape.len())
            .and_then(|names| names.iter().map(Value::as_str).collect());
        let axes = axes.ok_or_else(|| refused("no dimension_names"))?;
        let axes: Vec<(&str, usize)> = axes.into_iter().zip(shape).collect();
        let mut array = Self::new(name, &number.zarr_name(), &axes, chunk_shape[0])
            .ok_or_else(|| refused("no axis"))?;
        if let Some(fill) = value["fill_value"].as_f64() {
            array.fill = fill;
        }
        if let Some(attributes) = value["attributes"].as_object() {
            array.attributes.clone_from(attributes);
        }
        for part in ["chunk_key_encoding", "codecs"] {
            if value[part] != array.to_json()[part] {
                return Err(refused(&format!(
                    "other {part} than {}",
                    array.to_json()[part]
                )));
            }
        }
        Ok(array)
    }

    fn attribute(&self, name: &str, default: f64) -> f64 {
        let value = self.attributes.get(name).and_then(Value::as_f64);
        value.unwrap_or(default)
    }

    /// Appends values as little-endian numbers: packed, NaN as the missing code and what is too large as the largest one. Whole
    /// numbers have at most 32 bits.
    pub fn pack(&self, values: impl IntoIterator<Item = f64>, out: &mut Vec<u8>) {
        if self.number.is_float() {
            for value in values {
                match self.number.bytes {
                    4 => out.extend((value as f32).to_le_bytes()),
                    _ => out.extend(value.to_le_bytes()),
                }
            }
            return;
        }
        let scale = self.attribute("scale_factor", 1.0);
        let offset = self.attribute("add_offset", 0.0);
        let (mut least, mut most) = self.number.code_limits();
        // Of packed numbers the first or the last code is the missing one.
        if self.attributes.contains_key("_FillValue") {
            least += f64::from(u8::from(self.fill == least));
            most -= f64::from(u8::from(self.fill == most));
        }
        let bytes = self.number.bytes as usize;
        for value in values {
            let code = match value.is_nan() {
                true => self.fill,
                false => ((value - offset) / scale)
                    .round_ties_even()
                    .clamp(least, most),
            };
            out.extend_from_slice(&(code as i64).to_le_bytes()[..bytes]);
        }
    }

    /// Bytes of entries along the first axis that were never written.
    pub fn pack_fill(&self, rows: usize, out: &mut Vec<u8>) {
        let mut one = Vec::new();
        self.pack([f64::NAN], &mut one);
        for _ in 0..rows * self.row_len() {
            out.extend_from_slice(&one);
        }
    }

    /// The value of one stored number; NaN for the missing code.
    fn unpacked(&self, bytes: &[u8]) -> f64 {
        let code = self.number.value(bytes, ByteOrder::Little);
        if self.number.is_float() {
            return code;
        }
        if self.attributes.contains_key("_FillValue") && code == self.fill {
            return f64::NAN;
        }
        let step = self.attribute("scale_factor", 1.0);
        code * step + self.attribute("add_offset", 0.0)
    }
}

/// The metadata of a group with those of its arrays, as JSON.
pub fn group_json(attributes: &Map<String, Value>, arrays: &[Array]) -> Value {
    let metadata: Map<String, Value> = arrays
        .iter()
        .map(|array| (array.name.clone(), array.to_json()))
        .collect();
    json!({
        "zarr_format": 3,
        "node_type": "group",
        "attributes": attributes,
        "consolidated_metadata": { "kind": "inline", "must_understand": false, "metadata": metadata },
    })
}

/// Metadata as the text of a file.
pub fn json_text(value: &Value) -> String {
    format!("{value:#}\n")
}

/// Compresses a chunk, with neither a time nor a name in its header.
pub fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzBuilder::new().write(Vec::new(), Compression::new(LEVEL));
    // Writing to memory cannot fail.
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.unwrap_or_default()
}

/// Puts the files of a group on disk, each whole or not at all. Several processes may write to one group.
#[derive(Debug)]
pub struct Writer {
    root: PathBuf,
    staging: StagingFolder,
    files: AtomicUsize,
}

impl Writer {
    /// For the group in a folder; files are staged in the folder above it, which must exist.
    ///
    /// # Errors
    /// Files cannot be written there.
    pub fn new(root: &Path) -> Result<Self, Error> {
        let parent = root.parent().filter(|p| !p.as_os_str().is_empty());
        Ok(Self {
            root: root.to_owned(),
            staging: StagingFolder::make(parent.unwrap_or(Path::new(".")))?,
            files: AtomicUsize::new(0),
        })
    }

    /// Writes a file by its path in the group; an older one is replaced.
    ///
    /// # Errors
    /// The refusal of the system; nothing of the file is then there.
    pub fn put(&self, key: &str, content: &[u8]) -> Result<(), Error> {
        let unique = self.files.fetch_add(1, Ordering::Relaxed);
        self.staging.put_file(unique, &self.root.join(key), content)
    }

    /// Writes a file beside the folder of the group.
    ///
    /// # Errors
    /// As [`Self::put`].
    pub fn put_beside(&self, name: &str, content: &[u8]) -> Result<(), Error> {
        let unique = self.files.fetch_add(1, Ordering::Relaxed);
        let path = self.root.with_file_name(name);
        self.staging.put_file(unique, &path, content)
    }
}

/// Reads a chunk of `length` bytes; `None` where the file is absent.
///
/// # Errors
/// A file that cannot be read, is damaged or has another length, with its path.
fn read_chunk(path: &Path, length: usize) -> Result<Option<Vec<u8>>, Error> {
    let file = match fs::File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(Error::io("read", path)(error)),
    };
    let mut bytes = Vec::new();
    let read = GzDecoder::new(std::io::BufReader::new(file))
        .take(length as u64 + 1)
        .read_to_end(&mut bytes);
    if let Err(error) = read {
        let reason = format!("this chunk of the store is damaged or cut off: {error}");
        return Err(Error::input(path, reason));
    }
    if bytes.len() != length {
        let found = bytes.len();
        let reason = format!("this chunk of the store has {found} bytes or more, not {length}");
        return Err(Error::input(path, reason));
    }
    Ok(Some(bytes))
}

/// A group of arrays on disk, open to be read.
#[derive(Debug, Clone, PartialEq)]
pub struct Store {
    /// Its folder.
    pub root: PathBuf,
    /// Attributes of the group.
    pub attributes: Map<String, Value>,
    /// Its arrays.
    pub arrays: Vec<Array>,
}

impl Store {
    /// Opens the group in a folder by its consolidated metadata.
    ///
    /// # Errors
    /// A file that cannot be read; metadata that are no group of the kind that this module writes.
    pub fn open(root: &Path) -> Result<Self, Error> {
        let path = root.join(METADATA);
        let text = fs::read_to_string(&path).map_err(Error::io("read", &path))?;
        let refused = |reason: String| Error::input(&path, reason);
        let value: Value = serde_json::from_str(&text)
            .map_err(|error| refused(format!("this is not valid JSON: {error}")))?;
        let metadata = value
            .pointer("/consolidated_metadata/metadata")
            .and_then(Value::as_object);
        let is_group = value["zarr_format"] == 3 && value["node_type"] == "group";
        let Some(metadata) = metadata.filter(|_| is_group) else {
            let reason = "this is not a Zarr v3 group with consolidated metadata";
            return Err(refused(reason.into()));
        };
        let mut arrays = Vec::with_capacity(metadata.len());
        for (name, array) in metadata {
            arrays.push(Array::from_json(name, array).map_err(refused)?);
        }
        let attributes = value["attributes"].as_object().cloned().unwrap_or_default();
        Ok(Self {
            root: root.to_owned(),
            attributes,
            arrays,
        })
    }

    /// An array by its name.
    ///
    /// # Errors
    /// There is none.
    pub fn array(&self, name: &str) -> Result<&Array, Error> {
        let found = self.arrays.iter().find(|array| array.name == name);
        found.ok_or_else(|| {
            let reason = format!("it has no array \"{name}\"");
            Error::input(&self.root.join(METADATA), reason)
        })
    }

    /// The path of a chunk of an array.
    pub fn chunk_path(&self, array: &Array, chunk: usize) -> PathBuf {
        self.root.join(array.chunk_key(chunk))
    }

    /// Values of some entries of an array along its first axis, unpacked, \[entry, other axes..\]; missing ones, and those of absent
    /// chunks of arrays that have a missing code or are floats, are NaN. Whole numbers of 64 bits are rounded.
    ///
    /// # Errors
    /// No such array or entries; a damaged chunk, with its path.
    pub fn values(&self, name: &str, rows: Range<usize>) -> Result<ArrayD<f64>, Error> {
        self.read(name, rows, Array::unpacked)
    }

    /// The same as stored whole numbers; unsigned ones of 64 bits wrap.
    ///
    /// # Errors
    /// As [`Self::values`]; an array of floats.
    pub fn integers(&self, name: &str, rows: Range<usize>) -> Result<ArrayD<i64>, Error> {
        if self.array(name)?.number.is_float() {
            let reason = format!("its array \"{name}\" holds floats, not whole numbers");
            return Err(Error::input(&self.root.join(METADATA), reason));
        }
        self.read(name, rows, |array, bytes| array.number.integer(bytes))
    }

    fn read<T: Clone>(
        &self,
        name: &str,
        rows: Range<usize>,
        value: impl Fn(&Array, &[u8]) -> T,
    ) -> Result<ArrayD<T>, Error> {
        let array = self.array(name)?;
        let refused = |reason: String| Error::input(&self.root.join(METADATA), reason);
        if rows.start > rows.end || rows.end > array.shape[0] {
            let has = array.shape[0];
            let reason = format!("its array \"{name}\" has {has} entries, not {rows:?}");
            return Err(refused(reason));
        }
        let bytes = array.number.bytes as usize;
        let row_bytes = array.row_len() * bytes;
        let mut out = Vec::new();
        let reserved = out.try_reserve_exact(rows.len() * array.row_len());
        reserved.map_err(|_| refused(format!("no memory holds its array \"{name}\"")))?;
        let mut row = rows.start;
        while row < rows.end {
            let chunk = row / array.chunk_rows;
            let first = chunk * array.chunk_rows;
            let last = rows.end.min(first + array.chunk_rows);
            let stored = read_chunk(&self.chunk_path(array, chunk), array.chunk_bytes())?;
            let stored = stored.unwrap_or_else(|| {
                let mut fill = Vec::new();
                array.pack_fill(array.chunk_rows, &mut fill);
                fill
            });
            let wanted = &stored[(row - first) * row_bytes..(last - first) * row_bytes];
            out.extend(wanted.chunks_exact(bytes).map(|one| value(array, one)));
            row = last;
        }
        let mut shape = array.shape.clone();
        shape[0] = rows.len();
        ArrayD::from_shape_vec(IxDyn(&shape), out).map_err(|error| refused(error.to_string()))
    }
}

#[cfg(test)]
#[path = "zarr_tests.rs"]
mod tests;
