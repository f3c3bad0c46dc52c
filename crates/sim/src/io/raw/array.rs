//! Records that are one array of numbers in a file, read piece by piece: no more is in memory than what is requested.
//!
//! Check: every order of an array gives the same records.

use super::RecordSource;
use super::numpy::StoredArray;
use num_complex::Complex;
use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;

/// Which index of an array runs fastest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Order {
    /// \[line, pulse, sample\]: the pulses of a line follow each other, and the samples of a pulse.
    #[default]
    LineMajor,
    /// \[pulse, line, sample\]: each scan has one pulse a line.
    PulseMajor,
    /// \[sample, line, pulse\]: the first samples of all pulses, then the second ones (an array of Fortran).
    SampleMajor,
}

impl Order {
    /// The place in a file, among its `records`, of a record in the order of lines and their pulses.
    pub(super) fn place(self, record: usize, records: usize, pulses_per_line: usize) -> usize {
        let pulses = pulses_per_line.max(1);
        match self {
            Self::PulseMajor => record % pulses * (records / pulses) + record / pulses,
            Self::LineMajor | Self::SampleMajor => record,
        }
    }

    /// Refuses records that have no places in this order.
    ///
    /// # Errors
    /// What is needed.
    pub(super) fn check(self, records: usize, pulses_per_line: usize) -> Result<(), String> {
        match self == Self::PulseMajor && !records.is_multiple_of(pulses_per_line.max(1)) {
            true => Err(format!(
                "it has {records} records, which --order pulse-major cannot divide into lines: a multiple of scan.pulses_per_line = \
                 {pulses_per_line} is needed"
            )),
            false => Ok(()),
        }
    }
}

/// An array \[record, sample\] of numbers in a file.
#[derive(Debug)]
pub(super) struct ArrayInFile {
    pub(super) file: File,
    /// Where its numbers begin and how they are stored; complex ones as pairs, the first quadrature before the second.
    pub(super) stored: StoredArray,
    pub(super) order: Order,
    pub(super) records: usize,
    pub(super) samples: usize,
    /// Pulses of a line, for [`Order::PulseMajor`].
    pub(super) pulses_per_line: usize,
}

impl RecordSource for ArrayInFile {
    fn read(
        &mut self,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> Result<Vec<Complex<f64>>, String> {
        self.part(records, samples).map_err(|e| match e.kind() {
            ErrorKind::UnexpectedEof => "it became shorter while it was read".into(),
            _ => e.to_string(),
        })
    }
}

impl ArrayInFile {
    /// Some samples of some records, one record after the other.
    fn part(
        &mut self,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> std::io::Result<Vec<Complex<f64>>> {
        let count = samples.len();
        let mut out = vec![Complex::new(0.0, 0.0); records.len() * count];
        if self.order == Order::SampleMajor {
            for (place, sample) in samples.enumerate() {
                let row = self.run(
                    sample as u64 * self.records as u64 + records.start as u64,
                    records.len(),
                )?;
                for (record, value) in row.into_iter().enumerate() {
                    out[record * count + place] = value;
                }
            }
            return Ok(out);
        }
        // Records without a gap between them are read at once.
        let together = match self.order == Order::LineMajor && count == self.samples {
            true => records.len().max(1),
            false => 1,
        };
        for (first, out) in records
            .step_by(together)
            .zip(out.chunks_mut((together * count).max(1)))
        {
            let row = self.order.place(first, self.records, self.pulses_per_line);
            out.copy_from_slice(&self.run((row * self.samples + samples.start) as u64, out.len())?);
        }
        Ok(out)
    }

    /// Samples that follow each other in the file, from one of them on.
    fn run(&mut self, first: u64, count: usize) -> std::io::Result<Vec<Complex<f64>>> {
        let stored = &self.stored;
        let size = self.stored.sample_bytes();
        let mut raw = vec![0; count * size as usize];
        self.file
            .seek(SeekFrom::Start(stored.begin + first * size))?;
        self.file.read_exact(&mut raw)?;
        let mut samples = Vec::with_capacity(count);
        for bytes in raw.chunks_exact(size as usize) {
            let (first, second) = bytes.split_at(stored.number.bytes as usize);
            let re = stored.number.value(first, stored.byte_order);
            let im = match stored.is_complex {
                true => stored.number.value(second, stored.byte_order),
                false => 0.0,
            };
            samples.push(Complex::new(re, im));
        }
        Ok(samples)
    }
}

#[cfg(test)]
mod tests {
    use super::super::RawRecords;
    use super::*;
    use crate::io::number::{ByteOrder, NumberType};
    use std::io::Write;
    use std::path::Path;

    fn file(numbers: &[f64], order: ByteOrder) -> File {
        let mut file = tempfile::tempfile().unwrap();
        for number in numbers {
            let number = *number as i16;
            let bytes = if order == ByteOrder::Big {
                number.to_be_bytes()
            } else {
                number.to_le_bytes()
            };
            file.write_all(&bytes).unwrap();
        }
        file
    }

    fn array(numbers: &[f64], order: Order) -> ArrayInFile {
        ArrayInFile {
            file: file(numbers, ByteOrder::Big),
            stored: StoredArray {
                number: NumberType::named("i16").unwrap(),
                byte_order: ByteOrder::Big,
                is_complex: false,
                fortran_order: false,
                shape: Vec::new(),
                begin: 0,
            },
            order,
            records: 4,
            samples: 3,
            pulses_per_line: 2,
        }
    }

    #[test]
    fn every_order_gives_the_same_records() {
        // Records of two lines with two pulses: hundreds count lines, tens pulses, ones samples.
        let of =
            |line: usize, pulse: usize, sample: usize| (100 * line + 10 * pulse + sample) as f64;
        let wanted: Vec<f64> = (0..12)
            .map(|i| {
                if i == 5 {
                    f64::NAN
                } else {
                    2.0 * of(i / 6, i / 3 % 2, i % 3)
                }
            })
            .collect();
        let with = |places: &dyn Fn(usize) -> (usize, usize, usize)| -> Vec<f64> {
            let value = |place: (usize, usize, usize)| {
                if place == (0, 1, 2) {
                    20_000.0
                } else {
                    of(place.0, place.1, place.2)
                }
            };
            (0..12).map(|i| value(places(i))).collect()
        };
        for (order, numbers) in [
            (Order::LineMajor, with(&|i| (i / 6, i / 3 % 2, i % 3))),
            (Order::PulseMajor, with(&|i| (i / 3 % 2, i / 6, i % 3))),
            (Order::SampleMajor, with(&|i| (i / 2 % 2, i % 2, i / 4))),
        ] {
            let mut array =
                RawRecords::new(Path::new("x"), array(&numbers, order), [4, 3], false, true);
            array.scale = 2.0;
            array.outsized = 30_000.0;
            for records in [0..4, 1..3, 3..4] {
                for samples in [0..3, 1..2, 1..3] {
                    let found = array
                        .read_samples(records.clone(), samples.clone())
                        .unwrap();
                    let wanted: Vec<f64> = records
                        .clone()
                        .flat_map(|record| &wanted[3 * record..][samples.clone()])
                        .copied()
                        .collect();
                    let same = |(a, b): (&Complex<f64>, &f64)| {
                        a.im == 0.0 && (a.re == *b || (a.re.is_nan() && b.is_nan()))
                    };
                    assert!(
                        found.iter().zip(&wanted).all(same),
                        "{order:?} {records:?} {samples:?}: {found:?}"
                    );
                    assert_eq!(found.len(), wanted.len());
                }
            }
        }
    }

    #[test]
    fn the_parts_of_complex_samples_stand_together() {
        let mut together = ArrayInFile {
            samples: 3,
            records: 2,
            ..array(&[], Order::LineMajor)
        };
        together.file = file(&(0..12).map(f64::from).collect::<Vec<_>>(), ByteOrder::Big);
        together.stored.is_complex = true;
        let found = together.read(1..2, 0..3).unwrap();
        assert_eq!(
            found,
            [(6.0, 7.0), (8.0, 9.0), (10.0, 11.0)].map(|(re, im)| Complex::new(re, im))
        );
    }
}
