//! Records as text: a row of numbers for each record, or the long table `ray, time_s, current_a` of `signals.csv`.
//!
//! The first pass finds where each record begins, so that any of them can be read without the others. Check: both forms give
//! the same records; rows of different lengths and words are refused with their line.

use num_complex::Complex;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use wakescope_estimate::window::MissingSamples;

/// Longest line that is read \[bytes\].
const LONGEST_LINE_BYTES: u64 = 64 << 20;

/// Records in a text file.
#[derive(Debug)]
pub(super) struct TextRecords {
    reader: BufReader<File>,
    /// Where the text of each record begins, and its line, from 1.
    records: Vec<(u64, usize)>,
    pub(super) samples: usize,
    pub(super) is_complex: bool,
    /// Columns of both parts in the long table.
    columns: Option<Vec<usize>>,
    /// Stand for a missing number.
    fills: Vec<f64>,
}

impl TextRecords {
    /// Finds the records; numbers of a row are pairs of both parts where `is_complex` says so.
    pub(super) fn open(file: File, is_complex: bool) -> Result<Self, String> {
        let (reader, fills) = (BufReader::new(file), MissingSamples::default().fill);
        let mut out = Self { reader, records: Vec::new(), samples: 0, is_complex, columns: None, fills };
        let (mut at, mut line, mut text) = (0, 0, String::new());
        // Column of the long table that numbers the records, the last number there, and the samples that the record has so far.
        let (mut key, mut last, mut samples) = (0, String::new(), 0);
        loop {
            text.clear();
            let some = Read::by_ref(&mut out.reader).take(LONGEST_LINE_BYTES).read_line(&mut text);
            let read = some.map_err(|_| format!("line {} is no text", line + 1))?;
            if read == 0 {
                break;
            }
            if read as u64 == LONGEST_LINE_BYTES && !text.ends_with('\n') {
                let most = LONGEST_LINE_BYTES >> 20;
                return Err(format!("line {} is longer than {most} MiB: each record is a line of its own", line + 1));
            }
            line += 1;
            let begin = at;
            at += read as u64;
            let Some(content) = content(&text) else { continue };
            let is_first = out.records.is_empty();
            if is_first && out.columns.is_none() && cells(content).any(|cell| cell.parse::<f64>().is_err()) {
                let header: Vec<&str> = cells(content).collect();
                let place = |name: &str| header.iter().position(|cell| *cell == name);
                key = place("ray").ok_or("its header names no column ray: rows of numbers have none")?;
                let value = place("current_a").ok_or("its header names no column current_a")?;
                let quadrature = place("quadrature_a");
                out.is_complex = quadrature.is_some();
                out.columns = Some([Some(value), quadrature].into_iter().flatten().collect());
                continue;
            }
            let ray = cells(content).nth(key).unwrap_or_default();
            if is_first || out.columns.is_none() || ray != last {
                out.check_samples(samples)?;
                out.records.push((begin, line));
                (last, samples) = (ray.to_owned(), 0);
            }
            samples += if out.columns.is_some() { 1 } else { cells(content).count() / out.numbers() };
        }
        out.check_samples(samples)?;
        Ok(out)
    }

    fn numbers(&self) -> usize {
        if self.is_complex { 2 } else { 1 }
    }

    /// Holds the samples of the last record against those of the first.
    fn check_samples(&mut self, samples: usize) -> Result<(), String> {
        if self.records.len() == 1 {
            self.samples = samples;
        }
        match self.records.last() {
            Some((_, line)) if samples != self.samples => {
                Err(format!("line {line}: the record has {samples} samples, those before it {}", self.samples))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn records(&self) -> usize {
        self.records.len()
    }

    /// Some samples of some records, one record after the other.
    pub(super) fn read(&mut self, records: Range<usize>, samples: Range<usize>) -> Result<Vec<Complex<f64>>, String> {
        let mut out = Vec::with_capacity(records.len() * samples.len());
        let mut text = String::new();
        for record in records {
            let Some((begin, mut line)) = self.records.get(record).copied() else { break };
            self.reader.seek(SeekFrom::Start(begin)).map_err(|e| e.to_string())?;
            let begun = out.len();
            while out.len() < begun + self.samples {
                text.clear();
                if self.reader.read_line(&mut text).map_err(|e| e.to_string())? == 0 {
                    return Err("it became shorter while it was read".into());
                }
                if let Some(content) = content(&text) {
                    self.push(content, line, &mut out)?;
                }
                line += 1;
            }
            out.truncate(begun + samples.end);
            out.drain(begun..begun + samples.start);
        }
        Ok(out)
    }

    fn push(&self, content: &str, line: usize, out: &mut Vec<Complex<f64>>) -> Result<(), String> {
        let number = |cell: &str| -> Result<f64, String> {
            if cell.is_empty() {
                return Ok(f64::NAN);
            }
            let value = cell.parse().map_err(|_| format!("line {line}: {cell:?} is no number"))?;
            Ok(if self.fills.contains(&value) { f64::NAN } else { value })
        };
        match &self.columns {
            Some(columns) => {
                let cells: Vec<&str> = cells(content).collect();
                let mut parts = columns.iter().map(|column| number(cells.get(*column).copied().unwrap_or_default()));
                let re = parts.next().transpose()?.unwrap_or(f64::NAN);
                out.push(Complex::new(re, parts.next().transpose()?.unwrap_or(0.0)));
            }
            None => {
                let numbers = cells(content).map(number).collect::<Result<Vec<f64>, String>>()?;
                let sample = |parts: &[f64]| Complex::new(parts[0], parts.get(1).copied().unwrap_or(0.0));
                out.extend(numbers.chunks_exact(self.numbers()).map(sample));
            }
        }
        Ok(())
    }
}

/// What a line holds beside blanks; nothing of a comment.
fn content(line: &str) -> Option<&str> {
    let content = line.trim_start_matches('\u{feff}').trim();
    (!content.is_empty() && !content.starts_with('#')).then_some(content)
}

/// Cells of a row: between commas or semicolons, or between blanks.
fn cells(row: &str) -> Box<dyn Iterator<Item = &str> + '_> {
    let separator = [',', ';'].into_iter().find(|separator| row.contains(*separator));
    match separator {
        Some(separator) => Box::new(row.split(separator).map(str::trim)),
        None => Box::new(row.split_whitespace()),
    }
}
