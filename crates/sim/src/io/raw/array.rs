//! Records that stand in a file as one array of numbers, read by places: no more is in memory than what was asked for.
//!
//! Check: every order of an array gives the same records.

use super::RawFormat;
use crate::io::number::{ByteOrder, NumberType};
use num_complex::Complex;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

/// Where the parts of complex samples are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Parts {
    /// Samples are real.
    Real,
    /// Both parts of a sample stand together.
    Together,
    /// The second parts are an array of their own, which begins here; of NetCDF alone.
    Apart(u64),
}

/// Which index of an array runs fastest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Order {
    /// \[line, pulse, sample\]: the pulses of a line stand together, and the samples of a pulse.
    #[default]
    LineMajor,
    /// \[pulse, line, sample\]: each scan has one pulse a line.
    PulseMajor,
    /// \[sample, line, pulse\]: the first samples of all pulses, then the second ones (an array of Fortran).
    SampleMajor,
}

/// An array \[record, sample\] of numbers in a file.
#[derive(Debug)]
pub(super) struct ArrayInFile {
    pub(super) file: File,
    pub(super) number: NumberType,
    pub(super) byte_order: ByteOrder,
    pub(super) parts: Parts,
    pub(super) order: Order,
    /// Where the first number is.
    pub(super) begin: u64,
    /// Bytes from one record to the next where there is something else between them.
    pub(super) stride: Option<u64>,
    pub(super) records: usize,
    pub(super) samples: usize,
    /// Pulses of a line, for [`Order::PulseMajor`].
    pub(super) pulses_per_line: usize,
    /// Stand for a missing number.
    pub(super) fills: Vec<f64>,
    pub(super) scale: f64,
    pub(super) offset: f64,
}

impl ArrayInFile {
    /// Records with so many samples, as a user states them for a file of nothing but numbers.
    pub(super) fn new(
        file: File,
        number: NumberType,
        [records, samples]: [usize; 2],
        (format, pulses_per_line): (&RawFormat, usize),
    ) -> Self {
        Self {
            file,
            number,
            byte_order: format.byte_order,
            parts: if format.complex { Parts::Together } else { Parts::Real },
            order: format.order,
            begin: format.header_bytes,
            stride: None,
            records,
            samples,
            pulses_per_line,
            fills: Vec::new(),
            scale: format.scale,
            offset: 0.0,
        }
    }

    /// Bytes from one record to the next where samples run fastest.
    pub(super) fn record_bytes(&self) -> u64 {
        self.stride.unwrap_or(self.samples as u64 * self.sample_bytes())
    }

    /// Numbers of a sample.
    fn numbers(&self) -> usize {
        if self.parts == Parts::Together { 2 } else { 1 }
    }

    /// Bytes of a sample.
    pub(super) fn sample_bytes(&self) -> u64 {
        self.number.bytes() * self.numbers() as u64
    }

    /// Place in the file of a record in the order of lines and their pulses.
    fn row(&self, record: usize) -> u64 {
        match self.order {
            Order::LineMajor | Order::SampleMajor => record as u64,
            Order::PulseMajor => {
                let lines = self.records / self.pulses_per_line.max(1);
                (record % self.pulses_per_line.max(1) * lines + record / self.pulses_per_line.max(1)) as u64
            }
        }
    }

    /// Some samples of some records, one record after the other.
    pub(super) fn read(&mut self, records: Range<usize>, samples: Range<usize>) -> std::io::Result<Vec<Complex<f64>>> {
        let mut out = vec![Complex::new(0.0, 0.0); records.len() * samples.len()];
        let places = (records, samples);
        self.read_part(&places, self.begin, &mut out, |sample, numbers| {
            *sample = Complex::new(numbers[0], numbers.get(1).copied().unwrap_or(0.0));
        })?;
        if let Parts::Apart(begin) = self.parts {
            self.read_part(&places, begin, &mut out, |sample, numbers| sample.im = numbers[0])?;
        }
        Ok(out)
    }

    fn read_part(
        &mut self,
        (records, samples): &(Range<usize>, Range<usize>),
        begin: u64,
        out: &mut [Complex<f64>],
        put: impl Fn(&mut Complex<f64>, &[f64]),
    ) -> std::io::Result<()> {
        let (count, sample_bytes) = (samples.len(), self.sample_bytes());
        let mut raw = Vec::new();
        if self.order == Order::SampleMajor {
            for (place, sample) in samples.clone().enumerate() {
                let at = begin + (sample as u64 * self.records as u64 + records.start as u64) * sample_bytes;
                self.bytes(at, records.len() as u64 * sample_bytes, &mut raw)?;
                let places = out.iter_mut().skip(place).step_by(count);
                self.decode(&raw, places, &put);
            }
            return Ok(());
        }
        let row_bytes = count as u64 * sample_bytes;
        // Records without a gap between them are read at once.
        let together = match self.order == Order::LineMajor && self.record_bytes() == row_bytes {
            true => records.len().max(1),
            false => 1,
        };
        let firsts = records.clone().step_by(together);
        for (first, out) in firsts.zip(out.chunks_mut(together * count)) {
            let length = row_bytes * (out.len() / count.max(1)) as u64;
            let at = self.row(first) * self.record_bytes() + samples.start as u64 * sample_bytes;
            self.bytes(begin + at, length, &mut raw)?;
            self.decode(&raw, out.iter_mut(), &put);
        }
        Ok(())
    }

    fn bytes(&mut self, at: u64, length: u64, raw: &mut Vec<u8>) -> std::io::Result<()> {
        raw.resize(length as usize, 0);
        self.file.seek(SeekFrom::Start(at))?;
        self.file.read_exact(raw)
    }

    fn decode<'o>(
        &self,
        raw: &[u8],
        out: impl Iterator<Item = &'o mut Complex<f64>>,
        put: &impl Fn(&mut Complex<f64>, &[f64]),
    ) {
        let bytes = self.number.bytes() as usize;
        let value = |bytes: &[u8]| {
            let stored = self.number.value(bytes, self.byte_order);
            if self.fills.contains(&stored) { f64::NAN } else { stored * self.scale + self.offset }
        };
        let mut numbers = [0.0; 2];
        let numbers = &mut numbers[..self.numbers()];
        for (sample, raw) in out.zip(raw.chunks_exact(bytes * numbers.len())) {
            for (number, raw) in numbers.iter_mut().zip(raw.chunks_exact(bytes)) {
                *number = value(raw);
            }
            put(sample, numbers);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn file(numbers: &[f64], order: ByteOrder) -> File {
        let mut file = tempfile::tempfile().unwrap();
        for number in numbers {
            let number = *number as i16;
            let bytes = if order == ByteOrder::Big { number.to_be_bytes() } else { number.to_le_bytes() };
            file.write_all(&bytes).unwrap();
        }
        file
    }

    fn array(numbers: &[f64], order: Order) -> ArrayInFile {
        ArrayInFile {
            file: file(numbers, ByteOrder::Big),
            number: NumberType::I16,
            byte_order: ByteOrder::Big,
            parts: Parts::Real,
            order,
            begin: 0,
            stride: None,
            records: 4,
            samples: 3,
            pulses_per_line: 2,
            fills: vec![-1.0],
            scale: 2.0,
            offset: 1.0,
        }
    }

    #[test]
    fn every_order_gives_the_same_records() {
        // Records of two lines with two pulses: hundreds count lines, tens pulses, ones samples.
        let of = |line: usize, pulse: usize, sample: usize| (100 * line + 10 * pulse + sample) as f64;
        let wanted: Vec<f64> =
            (0..12).map(|i| if i == 5 { f64::NAN } else { 2.0 * of(i / 6, i / 3 % 2, i % 3) + 1.0 }).collect();
        let with = |places: &dyn Fn(usize) -> (usize, usize, usize)| -> Vec<f64> {
            let value = |place: (usize, usize, usize)| {
                if place == (0, 1, 2) { -1.0 } else { of(place.0, place.1, place.2) }
            };
            (0..12).map(|i| value(places(i))).collect()
        };
        for (order, numbers) in [
            (Order::LineMajor, with(&|i| (i / 6, i / 3 % 2, i % 3))),
            (Order::PulseMajor, with(&|i| (i / 3 % 2, i / 6, i % 3))),
            (Order::SampleMajor, with(&|i| (i / 2 % 2, i % 2, i / 4))),
        ] {
            let mut array = array(&numbers, order);
            for records in [0..4, 1..3, 3..4] {
                for samples in [0..3, 1..2, 1..3] {
                    let found = array.read(records.clone(), samples.clone()).unwrap();
                    let wanted: Vec<f64> =
                        records.clone().flat_map(|record| &wanted[3 * record..][samples.clone()]).copied().collect();
                    let same =
                        |(a, b): (&Complex<f64>, &f64)| a.im == 0.0 && (a.re == *b || (a.re.is_nan() && b.is_nan()));
                    assert!(found.iter().zip(&wanted).all(same), "{order:?} {records:?} {samples:?}: {found:?}");
                    assert_eq!(found.len(), wanted.len());
                }
            }
        }
    }

    #[test]
    fn complex_samples_may_stand_together_or_apart() {
        let mut together = ArrayInFile { samples: 3, records: 2, ..array(&[], Order::LineMajor) };
        together.file = file(&(0..12).map(f64::from).collect::<Vec<_>>(), ByteOrder::Big);
        (together.parts, together.scale, together.offset) = (Parts::Together, 1.0, 0.0);
        let found = together.read(1..2, 0..3).unwrap();
        assert_eq!(found, [(6.0, 7.0), (8.0, 9.0), (10.0, 11.0)].map(|(re, im)| Complex::new(re, im)));
        let mut apart = ArrayInFile { parts: Parts::Apart(12), ..together };
        let found = apart.read(0..2, 0..3).unwrap();
        assert!(found.iter().enumerate().all(|(i, z)| *z == Complex::new(i as f64, i as f64 + 6.0)), "{found:?}");
    }
}
