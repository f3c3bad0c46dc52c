//! Raw signals of an instrument or of a simulation, from a file: records of samples, read piece by piece, and what the file says
//! of them.
//!
//! | format | how it is known | what it says by itself |
//! |---|---|---|
//! | NetCDF, classic or NetCDF-4 | its first bytes | shape, kind of number; `signals.nc` also angles, times and how it was recorded |
//! | NPY, NPZ | its first bytes | shape, kind of number, byte order; NPZ also `elevation_rad` and `time_s` |
//! | binary | [`RawFormat::number`] is stated | nothing |
//!
//! Check: the same records come from every format.

mod array;
mod netcdf;
mod numpy;

pub use array::Order;

use crate::Error;
use crate::io::number::{ByteOrder, NumberType};
use crate::io::text_file;
use crate::machine;
use array::ArrayInFile;
use num_complex::Complex;
use numpy::StoredArray;
use std::collections::BTreeMap;
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// How the numbers of a file are stored, as far as the file does not say it.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct RawFormat {
    /// Number type of a binary file.
    #[cfg_attr(feature = "cli", arg(id = "format", long, value_name = "KIND", value_parser = KINDS))]
    pub number: Option<String>,
    /// Byte order of a binary file.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_enum, default_value_t, requires = "format")
    )]
    pub byte_order: ByteOrder,
    /// Samples are pairs of numbers, in phase and quadrature.
    #[cfg_attr(feature = "cli", arg(long))]
    pub complex: bool,
    /// Order of the indices, the last running fastest.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t))]
    pub order: Order,
    /// Bytes before the first number.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "N", default_value_t = 0, requires = "format")
    )]
    pub header_bytes: u64,
    /// NetCDF variable or NPZ array of the samples.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME"))]
    pub variable: Option<String>,
    /// NetCDF variable of the second quadrature.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME"))]
    pub quadrature: Option<String>,
}

impl RawFormat {
    /// Refuses options that have no effect on a file that begins with `magic`.
    fn refuse_unused(&self, magic: &[u8]) -> Result<(), String> {
        let is_binary = self.number.is_some();
        let is_netcdf = !is_binary && (magic.starts_with(b"CDF") || magic.starts_with(b"\x89HDF"));
        let is_npy = !is_binary && magic.starts_with(b"\x93NUM");
        let has_bytes = matches!(self.number.as_deref(), Some("i8" | "u8"));
        let unused = [
            (
                self.variable.is_some() && (is_binary || is_npy),
                "--variable has no effect: it holds one array",
            ),
            (
                self.quadrature.is_some() && !is_netcdf,
                "--quadrature has no effect: it names a variable of a NetCDF file; --complex says that numbers are pairs",
            ),
            (
                self.byte_order != ByteOrder::default() && has_bytes,
                "--byte-order has no effect: a number has one byte",
            ),
            (
                self.order != Order::default() && is_netcdf,
                "--order has no effect: samples run fastest in a NetCDF file, then the other dimensions in their order",
            ),
        ];
        match unused.iter().find(|(is_unused, _)| *is_unused) {
            Some((_, reason)) => Err((*reason).into()),
            None => Ok(()),
        }
    }
}

/// Kinds of the numbers of binary files.
#[cfg(feature = "cli")]
const KINDS: [&str; 8] = ["i8", "u8", "i16", "u16", "i32", "u32", "f32", "f64"];

/// Where samples come from.
pub trait RecordSource: std::fmt::Debug {
    /// Some samples of some records as they are stored, one record after the other; the second parts of real ones are ignored.
    ///
    /// # Errors
    /// Why they cannot be read.
    fn read(
        &mut self,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> Result<Vec<Complex<f64>>, String>;
}

/// Records of samples, in a file or in the memory of a program.
#[derive(Debug)]
pub struct RawRecords {
    /// The file, or its name in messages.
    pub path: PathBuf,
    source: Box<dyn RecordSource + Send>,
    /// Number of records.
    pub records: usize,
    /// Samples of a record.
    pub samples: usize,
    /// Whether samples are complex.
    pub is_complex: bool,
    /// Whether the numbers are codes of a converter.
    pub are_integers: bool,
    /// The factor that the numbers of the source have had.
    packed_scale: f64,
    /// The order of the records in the file, and the pulses of a line for it.
    order: Order,
    pulses_per_line: usize,
    /// The stored number of zero of both parts, which is subtracted before scaling: the middle code of a converter without sign.
    pub zero: Complex<f64>,
    /// What its numbers are multiplied with, A for signals in counts.
    pub scale: f64,
    /// Samples of this size and above are missing.
    pub outsized: f64,
    /// Whether frequencies rise with velocities towards the lidar; samples are read with their
    /// spectrum reversed.
    pub is_reversed: bool,
    /// Elevation of each record, rad, if the file has it.
    pub elevation_rad: Option<Vec<f64>>,
    /// Time of each record, s.
    pub time_s: Option<Vec<f64>>,
    /// Number of the line of each record.
    pub line: Option<Vec<f64>>,
    /// Constants of the recording by their names in `signals.nc`.
    pub constants: BTreeMap<&'static str, f64>,
    /// The scene that the signals were simulated for.
    pub scene_toml: Option<String>,
}

impl RawRecords {
    /// Opens a file; only its header is read.
    ///
    /// # Errors
    /// A file that cannot be read, is damaged, has another shape than its header says or needs options that `format` lacks; an option
    /// of `format` that has no effect on a file of its kind.
    pub fn open(
        path: &Path,
        format: &RawFormat,
        samples: usize,
        pulses_per_line: usize,
    ) -> Result<Self, Error> {
        let (mut file, length, magic) = text_file::begin(path)?;
        format
            .refuse_unused(&magic)
            .map_err(|reason| Error::input(path, reason))?;
        let found = match &magic[..] {
            _ if format.number.is_some() => binary_array(format, samples, length)
                .and_then(|array| records_of_array(path, format, pulses_per_line, file, array)),
            [b'C', b'D', b'F', ..] | [0x89, b'H', b'D', b'F', ..] => {
                Ok(netcdf::read(path, format)?)
            }
            [0x93, b'N', b'U', b'M', ..] => StoredArray::read(&mut file, 0, length)
                .and_then(|array| records_of_array(path, format, pulses_per_line, file, array)),
            [b'P', b'K', 3, 4, ..] => archive(path, format, pulses_per_line, file, length),
            _ => Err(
                "it is neither NetCDF, NPY nor NPZ; --format names the numbers of a binary file, \
                 e.g. --format i16 --byte-order little"
                    .into(),
            ),
        };
        let found = found
            .map_err(|reason| Error::input(path, reason))?
            .not_empty()?;
        if format.complex && format.number.is_none() {
            let without = RawFormat {
                complex: false,
                ..format.clone()
            };
            let real = Self::open(path, &without, samples, pulses_per_line)?;
            if real.is_complex == found.is_complex {
                return Err(Error::input(
                    path,
                    "--complex has no effect: its last index does not run over pairs of numbers",
                ));
            }
        }
        Ok(found)
    }

    /// Records of a source by their number and their samples; `are_integers` says that the numbers are codes of a converter.
    pub fn new(
        path: &Path,
        source: impl RecordSource + Send + 'static,
        [records, samples]: [usize; 2],
        is_complex: bool,
        are_integers: bool,
    ) -> Self {
        Self {
            path: path.to_owned(),
            source: Box::new(source),
            records,
            samples,
            is_complex,
            are_integers,
            packed_scale: 1.0,
            order: Order::default(),
            pulses_per_line: 1,
            zero: Complex::new(0.0, 0.0),
            scale: 1.0,
            outsized: f64::INFINITY,
            is_reversed: false,
            elevation_rad: None,
            time_s: None,
            line: None,
            constants: BTreeMap::new(),
            scene_toml: None,
        }
    }

    /// The same records, if there are any.
    ///
    /// # Errors
    /// There is no sample.
    pub fn not_empty(self) -> Result<Self, Error> {
        match self.records == 0 || self.samples == 0 {
            true => Err(self.refuse("it holds no records".into())),
            false => Ok(self),
        }
    }

    /// What the numbers of the file were multiplied with in all.
    pub fn whole_scale(&self) -> f64 {
        self.packed_scale * self.scale
    }

    /// Values that the file, or a table beside it, has for the records in the order of the file, in that in which records are read:
    /// line by line.
    pub(crate) fn line_by_line(&self, of_file: &[f64]) -> Vec<f64> {
        let count = of_file.len();
        let places = (0..count).map(|record| self.order.place(record, count, self.pulses_per_line));
        places.map(|place| of_file[place]).collect()
    }

    /// An error of this file.
    pub fn refuse(&self, reason: String) -> Error {
        Error::input(&self.path, reason)
    }

    /// The samples of some records, one record after the other; the second parts of real samples are 0. A missing sample has a
    /// part that is not finite.
    ///
    /// # Errors
    /// What the system says; words in place of numbers.
    pub fn read(&mut self, records: Range<usize>) -> Result<Vec<Complex<f64>>, Error> {
        self.read_samples(records, 0..self.samples)
    }

    /// The same of some samples of each of them.
    ///
    /// # Errors
    /// As [`RawRecords::read`].
    pub fn read_samples(
        &mut self,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> Result<Vec<Complex<f64>>, Error> {
        let first_sample = samples.start;
        let count = samples.len();
        let mut found = self
            .source
            .read(records, samples)
            .map_err(|reason| self.refuse(reason))?;
        for sample in &mut found {
            let im = match self.is_complex {
                true => self.scaled(sample.im, self.zero.im),
                false => 0.0,
            };
            *sample = Complex::new(self.scaled(sample.re, self.zero.re), im);
            if sample.re.abs().max(sample.im.abs()) >= self.outsized {
                sample.re = f64::NAN;
            }
        }
        if self.is_reversed {
            for record in found.chunks_mut(count.max(1)) {
                self.reverse_spectrum(record, first_sample);
            }
        }
        Ok(found)
    }

    /// The value of a stored number.
    ///
    /// No number is taken for missing by its value: floats may be the counts of a converter, of
    /// which -9999 is one. Fill values that a file declares arrive as NaN.
    fn scaled(&self, stored: f64, zero: f64) -> f64 {
        (stored - zero) * self.scale
    }

    /// Reverses the spectrum of consecutive samples of a record: the conjugate of complex samples;
    /// real ones at index n times (-1)^n, which moves a frequency f to half the sampling rate less f.
    fn reverse_spectrum(&self, record: &mut [Complex<f64>], first_sample: usize) {
        for (index, sample) in record.iter_mut().enumerate() {
            if self.is_complex {
                *sample = sample.conj();
            } else if (first_sample + index) % 2 == 1 {
                *sample = -*sample;
            }
        }
    }
}

/// The first array of an archive that has one of these names.
fn named_array<'a>(
    arrays: &'a [(String, StoredArray)],
    names: &[&str],
) -> Option<&'a (String, StoredArray)> {
    arrays
        .iter()
        .find(|(name, _)| names.contains(&name.as_str()))
}

fn duplicate(file: &File) -> Result<File, String> {
    file.try_clone().map_err(|e| e.to_string())
}

/// A file of nothing but numbers behind a header.
fn binary_array(format: &RawFormat, samples: usize, length: u64) -> Result<StoredArray, String> {
    let name = format.number.as_deref().unwrap_or_default();
    let number = NumberType::named(name)
        .ok_or_else(|| format!("{name} is not a number type: --format i16, for example"))?;
    let array = StoredArray {
        number,
        byte_order: format.byte_order,
        is_complex: format.complex,
        fortran_order: false,
        shape: Vec::new(),
        begin: format.header_bytes,
    };
    let sample_bytes = array.sample_bytes();
    let record_bytes = samples as u64 * sample_bytes;
    let data = length.checked_sub(format.header_bytes);
    let data = data.ok_or_else(|| {
        format!(
            "it has {length} bytes, --header-bytes says {}",
            format.header_bytes
        )
    })?;
    let rest = data.checked_rem(record_bytes).unwrap_or(data);
    if rest != 0 {
        return Err(format!(
            "behind a header of {} bytes it holds {data} bytes, no whole number of records of {} samples of {sample_bytes} bytes: {rest} \
         are left over; scan.range_min_m and range_max_m say how many samples a record has",
            format.header_bytes, samples
        ));
    }
    let mut lengths = vec![data.checked_div(record_bytes).unwrap_or(0), samples as u64];
    if format.order == Order::SampleMajor {
        lengths.reverse();
    }
    Ok(StoredArray {
        shape: lengths,
        ..array
    })
}

/// The records of an array.
fn records_of_array(
    path: &Path,
    format: &RawFormat,
    pulses_per_line: usize,
    file: File,
    mut stored: StoredArray,
) -> Result<RawRecords, String> {
    let mut lengths = std::mem::take(&mut stored.shape);
    let pairs =
        format.complex && !stored.is_complex && lengths.len() > 1 && lengths.last() == Some(&2);
    if pairs {
        lengths.pop();
        stored.is_complex = true;
    }
    let is_fortran = stored.fortran_order && lengths.len() > 1;
    if is_fortran && (pairs || lengths.len() > 2) {
        return Err("it is an array in the order of Fortran: numpy.ascontiguousarray makes one that is read".into());
    }
    if is_fortran && format.order != Order::default() {
        return Err(
            "--order has no effect: the array says itself that it is in the order of Fortran"
                .into(),
        );
    }
    let order = if is_fortran {
        Order::SampleMajor
    } else {
        format.order
    };
    // Whatever the order, the header says how long each dimension is; the samples are the last, or the first.
    let are_first = order == Order::SampleMajor && !stored.fortran_order && !lengths.is_empty();
    let samples = if are_first {
        Some(lengths.remove(0))
    } else {
        lengths.pop()
    };
    let samples = samples.ok_or("it holds a single number, no records")? as usize;
    let records = lengths.iter().product::<u64>() as usize;
    order.check(records, pulses_per_line)?;
    let is_complex = stored.is_complex;
    let are_integers = !stored.number.is_float();
    let zero = stored.number.zero();
    let array = ArrayInFile {
        file,
        stored,
        order,
        records,
        samples,
        pulses_per_line,
    };
    Ok(RawRecords {
        zero: Complex::new(zero, zero),
        order,
        pulses_per_line,
        ..RawRecords::new(path, array, [records, samples], is_complex, are_integers)
    })
}

/// The records of an archive, with the elevations and times that are in it.
fn archive(
    path: &Path,
    format: &RawFormat,
    pulses_per_line: usize,
    mut file: File,
    length: u64,
) -> Result<RawRecords, String> {
    let arrays = numpy::archive(&mut file, length)?;
    let mut large = arrays.iter().filter(|(_, array)| array.shape.len() > 1);
    let chosen = match (&format.variable, large.next(), large.next()) {
        (Some(name), ..) => named_array(&arrays, &[name]),
        (None, Some(one), None) => Some(one),
        (None, ..) => named_array(&arrays, &["signals", "current_a"]),
    };
    let (_, signals) = chosen
        .ok_or("it has several arrays, or none: --variable names the one that holds the samples")?;
    let mut signals = records_of_array(
        path,
        format,
        pulses_per_line,
        duplicate(&file)?,
        signals.clone(),
    )?;
    let records = signals.records;
    let elevation = named_array(&arrays, &["elevation_rad", "elevation"]);
    let time = named_array(&arrays, &["time_s", "pulse_time"]);
    let elevation_rad = values(path, pulses_per_line, &file, elevation, records)?;
    let time_s = values(path, pulses_per_line, &file, time, records)?;
    // They lie in the file as its records do.
    signals.elevation_rad = elevation_rad.map(|own| signals.line_by_line(&own));
    signals.time_s = time_s.map(|own| signals.line_by_line(&own));
    Ok(signals)
}

/// The numbers of an array of an archive, one for each record.
fn values(
    path: &Path,
    pulses_per_line: usize,
    file: &File,
    array: Option<&(String, StoredArray)>,
    records: usize,
) -> Result<Option<Vec<f64>>, String> {
    let Some((name, array)) = array else {
        return Ok(None);
    };
    let mut lengths = array.shape.iter();
    let count = lengths.try_fold(1_u64, |count, length| count.checked_mul(*length));
    let count = count.unwrap_or(u64::MAX);
    if count != records as u64 {
        return Err(format!(
            "{name} has {count} values; one for each of the {records} records is needed"
        ));
    }
    // The numbers of the array, both parts of them, and what is made of them.
    machine::holds(name, 40.0 * records as f64)?;
    // A row of numbers is one record.
    let format = RawFormat::default();
    let mut array = records_of_array(
        path,
        &format,
        pulses_per_line,
        duplicate(file)?,
        array.clone(),
    )?;
    let read = array.source.read(0..array.records, 0..array.samples)?;
    Ok(Some(read.into_iter().map(|value| value.re).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four records of six samples, 0 to 23, with the elevations 0.1, 0.1, 0.2, 0.2 rad.
    fn opened(order: Order, pulses_per_line: usize) -> Result<RawRecords, Error> {
        let format = RawFormat {
            order,
            ..RawFormat::default()
        };
        let reference = "../../tests/reference/sim/numpy.npz";
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(reference);
        RawRecords::open(&path, &format, 6, pulses_per_line)
    }

    #[test]
    fn angles_of_an_archive_are_those_of_its_records_in_every_order() {
        let by_lines = opened(Order::LineMajor, 2).unwrap();
        assert_eq!(by_lines.elevation_rad, Some(vec![0.1, 0.1, 0.2, 0.2]));
        let mut by_pulses = opened(Order::PulseMajor, 2).unwrap();
        assert_eq!(by_pulses.elevation_rad, Some(vec![0.1, 0.2, 0.1, 0.2]));
        let first_samples = by_pulses.read_samples(0..4, 0..1).unwrap();
        let first_samples: Vec<f64> = first_samples.iter().map(|sample| sample.re).collect();
        assert_eq!(first_samples, [0.0, 12.0, 6.0, 18.0]);
    }

    #[test]
    fn records_that_are_no_whole_lines_have_no_order_of_pulses() {
        let refused = opened(Order::PulseMajor, 3).unwrap_err().to_string();
        assert!(refused.contains("4 records"), "{refused}");
        assert!(refused.contains("scan.pulses_per_line = 3"), "{refused}");
        assert!(opened(Order::LineMajor, 3).is_ok());
    }
}
