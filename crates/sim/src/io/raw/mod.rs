//! Raw signals of an instrument or of a simulation, from a file: records of samples, read piece by piece, and what the file says
//! of them.
//!
//! | format | how it is known | what it says by itself |
//! |---|---|---|
//! | NetCDF, classic or NetCDF-4 | its first bytes | shape, kind of number; `signals.nc` also angles, times and how it was recorded |
//! | NPY, NPZ | its first bytes | shape, kind of number, byte order; NPZ also `elevation_rad` and `time_s` |
//! | text | the name ends with `.csv` or `.txt` | shape |
//! | binary | [`RawFormat::number`] is stated | nothing |
//!
//! Check: the same records come from every format.

mod array;
mod netcdf;
mod numpy;
mod text;

pub use array::Order;

use crate::Error;
use crate::io::number::{ByteOrder, NumberType};
use crate::io::text_file;
use crate::machine;
use array::ArrayInFile;
use num_complex::Complex;
use numpy::StoredArray;
use std::fs::File;
use std::io::Seek as _;
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::TextRecords;
use wakescope_estimate::window::MissingSamples;

/// How the numbers of a file stand, as far as the file does not say it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct RawFormat {
    /// Numbers of a binary file.
    #[cfg_attr(feature = "cli", arg(id = "format", long, value_name = "KIND", value_parser = KINDS))]
    pub number: Option<String>,
    /// Their byte order: the lowest or the highest byte first.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t, requires = "format"))]
    pub byte_order: ByteOrder,
    /// Samples are pairs of numbers, in phase and quadrature.
    #[cfg_attr(feature = "cli", arg(long))]
    pub complex: bool,
    /// Which index runs fastest: `line, pulse, sample`, `pulse, line, sample` or `sample, line, pulse`.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t))]
    pub order: Order,
    /// Bytes before the first number.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = 0, requires = "format"))]
    pub header_bytes: u64,
    /// What a number is multiplied with, A for signals in counts.
    #[cfg_attr(feature = "cli", arg(skip = 1.0))]
    pub scale: f64,
    /// The variable of a NetCDF file, or the array of an NPZ file, that holds the samples.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME"))]
    pub variable: Option<String>,
    /// The variable of a NetCDF file that holds the second quadrature.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME"))]
    pub quadrature: Option<String>,
}

/// Kinds of the numbers of binary files.
#[cfg(feature = "cli")]
const KINDS: [&str; 8] = ["i8", "u8", "i16", "u16", "i32", "u32", "f32", "f64"];

impl Default for RawFormat {
    fn default() -> Self {
        Self {
            number: None,
            byte_order: ByteOrder::default(),
            complex: false,
            order: Order::default(),
            header_bytes: 0,
            scale: 1.0,
            variable: None,
            quadrature: None,
        }
    }
}

/// What a scene says of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordShape {
    /// Samples of a record.
    pub samples: usize,
    /// Pulses of a line of sight.
    pub pulses_per_line: usize,
}

/// What a file says of its records.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// Elevation of each record, rad.
    pub elevation_rad: Option<Vec<f64>>,
    /// Time of each record, s.
    pub time_s: Option<Vec<f64>>,
    /// Number of the line of each record.
    pub line: Option<Vec<f64>>,
    /// Constants of the recording: their name in the file, the key of a scene that says the same, and the value.
    pub constants: Vec<(&'static str, &'static str, f64)>,
    /// The scene that the signals were simulated for.
    pub scene_toml: Option<String>,
}

/// Records of samples in a file.
#[derive(Debug)]
pub struct RawRecords {
    path: PathBuf,
    stored: Stored,
    /// Samples of this size and above are missing.
    outsized: f64,
    /// What the file says of them.
    pub about: About,
}

/// Where samples come from.
pub trait Source: std::fmt::Debug {
    /// Some samples of some records as they stand there, one record after the other; the second parts of real ones are of no matter.
    ///
    /// # Errors
    /// Why they cannot be read.
    fn read(&mut self, records: Range<usize>, samples: Range<usize>) -> Result<Vec<Complex<f64>>, String>;
}

/// Signals in the memory of a program.
#[derive(Debug)]
pub struct SampleArray {
    /// What stands for it in words and messages.
    pub name: PathBuf,
    /// What reads it.
    pub source: Box<dyn Source + Send>,
    /// Number of records.
    pub records: usize,
    /// Samples of a record.
    pub samples: usize,
    /// Whether samples are complex.
    pub is_complex: bool,
    /// Whether the numbers are codes of a converter.
    pub are_integers: bool,
}

/// Records as they stand in a file.
#[derive(Debug)]
struct Stored {
    source: Box<dyn Source>,
    records: usize,
    samples: usize,
    is_complex: bool,
    /// Whether the numbers are codes of a converter.
    are_integers: bool,
    /// Stand for a missing number.
    fills: Vec<f64>,
    /// Factors that the numbers of the source have had, and that they still get.
    scale: [f64; 2],
    about: About,
}

impl Stored {
    fn of_array(array: ArrayInFile, fills: Vec<f64>, scale: f64) -> Self {
        Self {
            records: array.records,
            samples: array.samples,
            is_complex: array.are_pairs,
            are_integers: !array.number.is_float(),
            fills,
            scale: [1.0, scale],
            about: About::default(),
            source: Box::new(array),
        }
    }
}

impl RawRecords {
    /// Opens a file; nothing but its header is read, or a whole text.
    ///
    /// # Errors
    /// A file that cannot be read, is damaged, has another shape than its header says or needs words that `format` lacks.
    pub fn open(path: &Path, format: &RawFormat, shape: RecordShape) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Input { path: path.to_owned(), reason };
        let (mut file, length, magic) = text_file::begin(path)?;
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let stored = match &magic[..] {
            _ if format.number.is_some() => {
                binary(length, format, shape).and_then(|array| in_file(file, &array, format, shape))
            }
            [b'C', b'D', b'F', ..] | [0x89, b'H', b'D', b'F', ..] => Ok(netcdf::read(path, format)?),
            [0x93, b'N', b'U', b'M', ..] => {
                StoredArray::read(&mut file, 0, length).and_then(|array| in_file(file, &array, format, shape))
            }
            [b'P', b'K', 3, 4, ..] => of_archive(file, length, format, shape),
            _ if ["csv", "txt"].contains(&extension.as_str()) => {
                file.rewind().map_err(Error::io("read", path))?;
                TextRecords::open(file, length, format.complex)
            }
            _ => Err("it is neither NetCDF, NPY, NPZ nor a text whose name ends with .csv or .txt: of a binary file, --format \
                      states the numbers, e.g. --format i16 --byte-order little"
                .into()),
        };
        let stored = stored.map_err(refuse)?;
        if stored.records == 0 || stored.samples == 0 {
            return Err(refuse("it holds no records".into()));
        }
        Ok(Self::new(path, stored))
    }

    /// Records of an array in memory, whose numbers are multiplied with `scale`.
    ///
    /// # Errors
    /// An array without a sample.
    pub fn of_array(array: SampleArray, scale: f64) -> Result<Self, Error> {
        let SampleArray { name, source, records, samples, is_complex, are_integers } = array;
        if records == 0 || samples == 0 {
            return Err(Error::Input { path: name, reason: "it holds no records".into() });
        }
        // Of a converter's codes each may be a sample.
        let fills = if are_integers { Vec::new() } else { MissingSamples::default().fill };
        let (scale, about) = ([1.0, scale], About::default());
        Ok(Self::new(&name, Stored { source, records, samples, is_complex, are_integers, fills, scale, about }))
    }

    fn new(path: &Path, mut stored: Stored) -> Self {
        let about = std::mem::take(&mut stored.about);
        Self { path: path.to_owned(), stored, outsized: f64::INFINITY, about }
    }

    /// Number of records.
    pub fn records(&self) -> usize {
        self.stored.records
    }

    /// Samples of a record.
    pub fn samples(&self) -> usize {
        self.stored.samples
    }

    /// Whether samples are complex.
    pub fn is_complex(&self) -> bool {
        self.stored.is_complex
    }

    /// Whether the numbers are codes of a converter.
    pub fn is_of_integers(&self) -> bool {
        self.stored.are_integers
    }

    /// What the numbers of the file were multiplied with.
    pub fn scale(&self) -> f64 {
        self.stored.scale[0] * self.stored.scale[1]
    }

    /// An error of this file.
    pub fn refuse(&self, reason: String) -> Error {
        Error::Input { path: self.path.clone(), reason }
    }

    /// Counts samples of this size and above as missing.
    pub fn leave_out(&mut self, outsized: f64) {
        self.outsized = outsized;
    }

    /// The samples of some records, one record after the other; the second parts of real samples are 0. A missing sample has a
    /// part that is not finite.
    ///
    /// # Errors
    /// What the system says; words in place of numbers.
    pub fn read(&mut self, records: Range<usize>) -> Result<Vec<Complex<f64>>, Error> {
        self.read_samples(records, 0..self.samples())
    }

    /// The same of some samples of each of them.
    ///
    /// # Errors
    /// As [`RawRecords::read`].
    pub fn read_samples(&mut self, records: Range<usize>, samples: Range<usize>) -> Result<Vec<Complex<f64>>, Error> {
        let mut found = self.stored.source.read(records, samples).map_err(|reason| self.refuse(reason))?;
        let Stored { is_complex, fills, scale, .. } = &self.stored;
        let number = |stored: f64| if fills.contains(&stored) { f64::NAN } else { stored * scale[1] };
        for sample in &mut found {
            *sample = Complex::new(number(sample.re), if *is_complex { number(sample.im) } else { 0.0 });
            if sample.re.abs().max(sample.im.abs()) >= self.outsized {
                sample.re = f64::NAN;
            }
        }
        Ok(found)
    }
}

/// A file of nothing but numbers behind a header.
fn binary(length: u64, format: &RawFormat, shape: RecordShape) -> Result<StoredArray, String> {
    let name = format.number.as_deref().unwrap_or_default();
    let number =
        NumberType::named(name).ok_or_else(|| format!("{name} is no kind of number: --format i16, for example"))?;
    let sample_bytes = number.bytes * if format.complex { 2 } else { 1 };
    let record_bytes = shape.samples as u64 * sample_bytes;
    let data = length.checked_sub(format.header_bytes);
    let data = data.ok_or_else(|| format!("it has {length} bytes, --header-bytes says {}", format.header_bytes))?;
    let rest = data.checked_rem(record_bytes).unwrap_or(data);
    if rest != 0 {
        return Err(format!(
            "behind a header of {} bytes it holds {data} bytes, no whole number of records of {} samples of {sample_bytes} bytes: {rest} \
             are left over; scan.range_min_m and range_max_m say how many samples a record has",
            format.header_bytes, shape.samples
        ));
    }
    let mut lengths = vec![data.checked_div(record_bytes).unwrap_or(0), shape.samples as u64];
    if format.order == Order::SampleMajor {
        lengths.reverse();
    }
    Ok(StoredArray {
        number,
        byte_order: format.byte_order,
        is_complex: format.complex,
        fortran_order: false,
        shape: lengths,
        begin: format.header_bytes,
    })
}

/// An array, its records and their samples.
fn in_file(file: File, found: &StoredArray, format: &RawFormat, shape: RecordShape) -> Result<Stored, String> {
    let mut lengths = found.shape.clone();
    let pairs = format.complex && !found.is_complex && lengths.len() > 1 && lengths.last() == Some(&2);
    if pairs {
        lengths.pop();
    }
    let order = match (found.fortran_order && lengths.len() > 1, lengths.len()) {
        (false, _) => format.order,
        (true, 2) if !pairs => Order::SampleMajor,
        (true, _) => {
            return Err("it is an array in the order of Fortran: numpy.ascontiguousarray makes one that is read".into());
        }
    };
    // Whatever the order, the header says how long each dimension is; the samples are the last, or the first.
    let samples = match (found.fortran_order, order) {
        (false, Order::SampleMajor) => (!lengths.is_empty()).then(|| lengths.remove(0)),
        _ => lengths.pop(),
    };
    let samples = samples.ok_or("it holds a single number, no records")?;
    // Of a converter's codes each may be a sample.
    let fills = if found.number.is_float() { MissingSamples::default().fill } else { Vec::new() };
    let array = ArrayInFile {
        file,
        number: found.number,
        byte_order: found.byte_order,
        are_pairs: found.is_complex || pairs,
        order,
        begin: found.begin,
        records: lengths.iter().product::<u64>() as usize,
        samples: samples as usize,
        pulses_per_line: shape.pulses_per_line,
    };
    Ok(Stored::of_array(array, fills, format.scale))
}

fn of_archive(mut file: File, length: u64, format: &RawFormat, shape: RecordShape) -> Result<Stored, String> {
    let arrays = numpy::archive(&mut file, length)?;
    let large: Vec<&(String, StoredArray)> = arrays.iter().filter(|(_, array)| array.shape.len() > 1).collect();
    let chosen = match (&format.variable, &large[..]) {
        (Some(name), _) => arrays.iter().find(|(own, _)| own == name),
        (None, [one]) => Some(*one),
        (None, _) => arrays.iter().find(|(name, _)| name == "signals" || name == "current_a"),
    };
    let (_, signals) =
        chosen.ok_or("it has several arrays, or none: --variable names the one that holds the samples")?;
    let mut signals = in_file(file.try_clone().map_err(|e| e.to_string())?, signals, format, shape)?;
    let records = signals.records;
    let values = |names: [&str; 2]| -> Result<Option<Vec<f64>>, String> {
        let Some((name, array)) = arrays.iter().find(|(name, _)| names.contains(&name.as_str())) else {
            return Ok(None);
        };
        let count = array.shape.iter().try_fold(1_u64, |n, length| n.checked_mul(*length)).unwrap_or(u64::MAX);
        if count != records as u64 {
            return Err(format!("{name} has {count} values; one for each of the {records} records is needed"));
        }
        // The numbers of the array, both parts of them, and what is made of them.
        machine::holds(name, 40.0 * records as f64)?;
        let own = file.try_clone().map_err(|e| e.to_string())?;
        // A row of numbers is one record.
        let mut array = in_file(own, array, &RawFormat::default(), shape)?;
        let read = array.source.read(0..array.records, 0..array.samples)?;
        Ok(Some(read.into_iter().map(|value| value.re).collect()))
    };
    signals.about.elevation_rad = values(["elevation_rad", "elevation"])?;
    signals.about.time_s = values(["time_s", "pulse_time"])?;
    Ok(signals)
}
