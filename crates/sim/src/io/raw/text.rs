//! Records as text: a row of numbers for each record, or the long table `ray, time_s, current_a` of `signals.csv`.
//!
//! A text is read as a whole: whoever has more than the memory holds has them as NPY or NetCDF. Check: both forms give the same
//! records; rows of different lengths and words are refused with their line.

use super::{RawRecords, Source};
use crate::machine;
use num_complex::Complex;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::ops::Range;
use std::path::Path;

/// Longest line that is read \[bytes\].
const LONGEST_LINE_BYTES: u64 = 64 << 20;

/// Records of a text, each with the line where it begins.
#[derive(Debug)]
struct TextRecords(Vec<(usize, Vec<Complex<f64>>)>);

impl Source for TextRecords {
    fn read(
        &mut self,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> Result<Vec<Complex<f64>>, String> {
        let own = self.0.get(records).unwrap_or_default().iter();
        Ok(own
            .flat_map(|(_, record)| record.get(samples.clone()).unwrap_or_default())
            .copied()
            .collect())
    }
}

/// Reads a file of so many bytes; numbers of a row are pairs of both parts where `is_complex` says so.
pub(super) fn read(
    path: &Path,
    file: File,
    bytes: u64,
    mut is_complex: bool,
) -> Result<RawRecords, String> {
    let mut reader = BufReader::new(file);
    // Of the long table: columns of the number of the record and of the parts of a sample, and the last number.
    let (mut table, mut last) = (None::<(usize, Vec<usize>)>, String::new());
    let (mut records, mut text) = (Vec::<(usize, Vec<Complex<f64>>)>::new(), String::new());
    for line in 1.. {
        text.clear();
        let some = Read::by_ref(&mut reader)
            .take(LONGEST_LINE_BYTES)
            .read_line(&mut text);
        let read = some.map_err(|_| format!("line {line} is no text"))?;
        if read == 0 {
            break;
        }
        if read as u64 == LONGEST_LINE_BYTES && !text.ends_with('\n') {
            let most = LONGEST_LINE_BYTES >> 20;
            return Err(format!(
                "line {line} is longer than {most} MiB: each record is a line of its own"
            ));
        }
        let Some(content) = content(&text) else {
            continue;
        };
        let cells = cells(content);
        if records.is_empty() && table.is_none() {
            // A sample takes sixteen bytes, and in the text as many as it has digits.
            machine::holds("its table", 3.0 * bytes as f64)?;
            if cells.iter().any(|cell| cell.parse::<f64>().is_err()) {
                let place = |name: &str| cells.iter().position(|cell| *cell == name);
                let needed = |name: &str| {
                    place(name).ok_or_else(|| {
                        format!("its header names no column {name}: rows of numbers have none")
                    })
                };
                let (ray, value, quadrature) =
                    (needed("ray")?, needed("current_a")?, place("quadrature_a"));
                is_complex = quadrature.is_some();
                table = Some((ray, std::iter::once(value).chain(quadrature).collect()));
                continue;
            }
        }
        let number = |cell: &str| match cell {
            "" => Ok(f64::NAN),
            cell => cell
                .parse()
                .map_err(|_| format!("line {line}: {cell:?} is no number")),
        };
        let cell = |at: &usize| cells.get(*at).copied().unwrap_or_default();
        let ray = table.as_ref().map(|(ray, _)| cell(ray));
        if records.is_empty() || ray.is_none_or(|ray| ray != last) {
            records.push((line, Vec::new()));
            last = ray.unwrap_or_default().to_owned();
        }
        let own: Vec<&str> = table
            .as_ref()
            .map_or(cells.clone(), |(_, parts)| parts.iter().map(cell).collect());
        let parts = own
            .into_iter()
            .map(number)
            .collect::<Result<Vec<f64>, String>>()?;
        let samples = parts.chunks_exact(if is_complex { 2 } else { 1 });
        let samples =
            samples.map(|parts| Complex::new(parts[0], parts.get(1).copied().unwrap_or(0.0)));
        if let Some((_, record)) = records.last_mut() {
            record.extend(samples);
        }
    }
    let whole = records.first().map_or(0, |(_, record)| record.len());
    if let Some((line, record)) = records.iter().find(|(_, record)| record.len() != whole) {
        return Err(format!(
            "line {line}: the record has {} samples, those before it {whole}",
            record.len()
        ));
    }
    let shape = [records.len(), whole];
    Ok(RawRecords::new(
        path,
        TextRecords(records),
        shape,
        is_complex,
        false,
    ))
}

/// What a line holds beside blanks; nothing of a comment.
fn content(line: &str) -> Option<&str> {
    let content = line.trim_start_matches('\u{feff}').trim();
    (!content.is_empty() && !content.starts_with('#')).then_some(content)
}

/// Cells of a row: between commas or semicolons, or between blanks.
fn cells(row: &str) -> Vec<&str> {
    let separator = [',', ';']
        .into_iter()
        .find(|separator| row.contains(*separator));
    match separator {
        Some(separator) => row.split(separator).map(str::trim).collect(),
        None => row.split_whitespace().collect(),
    }
}
