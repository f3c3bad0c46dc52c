//! The lines of sight of records from a file: which records belong to which line and scan, and when.
//!
//! Check: scans that go up, up and down, or repeat; angles that are missing.

use crate::Error;
use crate::io::csv_input::TextTable;
use crate::io::raw::RawRecords;
use crate::io::units::Quantity;
use crate::io::variable::{self, TIME};
use crate::plan::Plan;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Largest elevation, with rounding, rad.
const MOST_RAD: f64 = std::f64::consts::FRAC_PI_2 + 1e-9;

/// Angles and times of records, or of lines, from a table of the user's.
#[derive(Debug, Clone, PartialEq)]
pub struct RayTable {
    path: PathBuf,
    /// Elevations, rad.
    elevation_rad: Vec<f64>,
    /// Times, s.
    time_s: Option<Vec<f64>>,
}

impl RayTable {
    /// Reads elevations, and times where there are some, a row for each record or for each line.
    ///
    /// # Errors
    /// A table that cannot be read, without an elevation, or with a cell that is no number.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let table = TextTable::read(path)?;
        Self::interpolate(&table, path).map_err(|reason| Error::Input {
            path: path.to_owned(),
            reason,
        })
    }

    fn interpolate(table: &TextTable, path: &Path) -> Result<Self, String> {
        let known = |name: &str, values: Vec<f64>| match values.iter().position(|v| !v.is_finite())
        {
            Some(row) => Err(format!("row {}: {name} is no number", row + 1)),
            None => Ok(values),
        };
        let (name, elevation_rad) = variable::elevations_rad(table)?
            .ok_or("it has no column elevation_rad or elevation_deg")?;
        let time_s = match variable::find(table, &TIME) {
            Some(name) => Some(known(name, variable::values(table, name, Quantity::Time)?)?),
            None => None,
        };
        Ok(Self {
            path: path.to_owned(),
            elevation_rad: known(name, elevation_rad)?,
            time_s,
        })
    }
}

/// The lines of one scan, in the order of their records.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScanLines {
    /// Elevation of each line, rad.
    pub elevation_rad: Vec<f64>,
    /// Time of each line, s.
    pub time_s: Vec<f64>,
    /// First record of each line, and the end of the last.
    pub(super) first_record: Vec<usize>,
}

impl ScanLines {
    /// The records of some lines.
    pub(super) fn records(&self, lines: &Range<usize>) -> Range<usize> {
        self.first_record[lines.start]..self.first_record[lines.end]
    }

    /// All records of the scan, and the elevation of each, rad.
    pub(crate) fn all_records(&self) -> (Range<usize>, Vec<f64>) {
        let all = 0..self.elevation_rad.len();
        (self.records(&all), self.record_elevation_rad(&all))
    }

    /// Elevation of each record of some lines, rad.
    pub(super) fn record_elevation_rad(&self, lines: &Range<usize>) -> Vec<f64> {
        let of = |line: usize| {
            let count = self.first_record[line + 1] - self.first_record[line];
            std::iter::repeat_n(self.elevation_rad[line], count)
        };
        lines.clone().flat_map(of).collect()
    }
}

/// Some lines in the order of their elevations, rad.
pub(crate) fn upward(lines: impl IntoIterator<Item = usize>, elevation_rad: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = lines.into_iter().collect();
    order.sort_by(|a, b| elevation_rad[*a].total_cmp(&elevation_rad[*b]));
    order
}

/// Records of a file by scan and line: by the table, by what the file says, or as the scene has them. A file that numbers the lines
/// of its records is believed; else the records of a line have one elevation.
///
/// # Errors
/// Records that do not fit the angles, angles that are none, times that do not increase.
pub(super) fn scans(
    plan: &Plan,
    records: &RawRecords,
    table: Option<&RayTable>,
) -> Result<Vec<ScanLines>, Error> {
    let count = records.records;
    let per_line = plan.scene().scan.pulses_per_line;
    let (elevation_rad, time_s) = match table {
        Some(table) => interpolate(table, records, per_line)?,
        None => match &records.elevation_rad {
            Some(elevation_rad) => (elevation_rad.clone(), records.time_s.clone()),
            None => (of_scene(plan, records)?, records.time_s.clone()),
        },
    };
    let prt_s = 1.0 / plan.scene().laser.pulse_repetition_hz;
    let time_s = time_s.unwrap_or_else(|| {
        (0..count)
            .map(|i| plan.wind.start_s + i as f64 * prt_s)
            .collect()
    });
    if let Some(bad) = elevation_rad
        .iter()
        .find(|angle| !(-MOST_RAD..=MOST_RAD).contains(*angle))
    {
        return Err(records.refuse(format!(
            "an elevation is {bad} rad: from -pi/2 to pi/2 are allowed; degrees need the unit degrees, or a column elevation_deg"
        )));
    }
    for (name, found) in [("elevations", elevation_rad.len()), ("times", time_s.len())] {
        if found != count {
            return Err(records.refuse(format!("it has {count} records and {found} {name}")));
        }
    }
    if let Some(bad) = time_s.iter().find(|time| !time.is_finite()) {
        return Err(records.refuse(format!(
            "the time of a record is {bad}: each must be finite"
        )));
    }
    let marks = records
        .line
        .as_ref()
        .filter(|_| table.is_none())
        .unwrap_or(&elevation_rad);
    let mut found: Vec<ScanLines> = Vec::new();
    let mut direction = 0.0;
    let all: Vec<usize> = (0..count).collect();
    // Pulses of a line may share its time; a time that goes back begins another line.
    for line in all.chunk_by(|a, b| marks[*a] == marks[*b] && time_s[*b] >= time_s[*a]) {
        let first = line[0];
        let last = line[line.len() - 1];
        // The middle of angles that pulses may have of their own.
        let beside = elevation_rad[first..=last]
            .iter()
            .map(|angle| angle - elevation_rad[first]);
        let angle_rad = elevation_rad[first] + beside.sum::<f64>() / line.len() as f64;
        let before = found.last().and_then(|scan| scan.elevation_rad.last());
        let step = before.map_or(0.0, |before| angle_rad - before);
        // A line that goes back, or stays, begins another scan.
        if found.is_empty() || step == 0.0 || step * direction < 0.0 {
            found.push(ScanLines::default());
            direction = 0.0;
        } else {
            direction = step.signum();
        }
        if let Some(scan) = found.last_mut() {
            scan.elevation_rad.push(angle_rad);
            // The middle of the pulses.
            scan.time_s.push(0.5 * (time_s[first] + time_s[last]));
            scan.first_record.push(first);
        }
    }
    let ends: Vec<usize> = found
        .iter()
        .skip(1)
        .map(|scan| scan.first_record[0])
        .chain([count])
        .collect();
    found
        .iter_mut()
        .zip(ends)
        .for_each(|(scan, end)| scan.first_record.push(end));
    let times: Vec<f64> = found
        .iter()
        .flat_map(|scan| scan.time_s.iter().copied())
        .collect();
    if let Some(last) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        // Realisations of a simulated scan, of one sweep or several, have the same times.
        let lines = last + 1;
        let mut begins = found.iter().scan(0, |begin, scan| {
            *begin += scan.time_s.len();
            Some(*begin)
        });
        if !begins.any(|begin| begin == lines)
            || times
                .iter()
                .enumerate()
                .any(|(line, time_s)| *time_s != times[line % lines])
        {
            let reason = format!(
                "the times of its lines do not increase: {} s, then {} s",
                times[last], times[lines]
            );
            return Err(records.refuse(reason));
        }
        let whole_s = times[last] - times[0] + prt_s;
        for (line, time_s) in found
            .iter_mut()
            .flat_map(|scan| &mut scan.time_s)
            .enumerate()
        {
            *time_s += (line / lines) as f64 * whole_s;
        }
    }
    Ok(found)
}

/// Angles and times of all records from those of records, in the order of the file, or of lines.
fn interpolate(
    table: &RayTable,
    records: &RawRecords,
    per_line: usize,
) -> Result<(Vec<f64>, Option<Vec<f64>>), Error> {
    let count = records.records;
    let rows = table.elevation_rad.len();
    if rows == count {
        let elevation_rad = records.line_by_line(&table.elevation_rad);
        let time_s = table.time_s.as_deref();
        return Ok((elevation_rad, time_s.map(|own| records.line_by_line(own))));
    }
    if rows * per_line != count {
        let reason = format!(
            "it has {rows} rows; the {count} records need as many, or {} lines of scan.pulses_per_line = {per_line}",
            count / per_line.max(1)
        );
        return Err(Error::Input {
            path: table.path.clone(),
            reason,
        });
    }
    let each = |values: &Vec<f64>| {
        values
            .iter()
            .flat_map(|v| std::iter::repeat_n(*v, per_line))
            .collect::<Vec<_>>()
    };
    Ok((each(&table.elevation_rad), table.time_s.as_ref().map(each)))
}

/// Angles as the scene has them.
fn of_scene(plan: &Plan, records: &RawRecords) -> Result<Vec<f64>, Error> {
    let count = records.records;
    let lines = &plan.geometry.elevation_rad;
    let per_line = plan.scene().scan.pulses_per_line;
    let whole = lines.len() * per_line;
    if !count.is_multiple_of(whole) {
        return Err(records.refuse(format!(
            "it has {count} records and no elevations; the scene has {} lines of scan.pulses_per_line = {per_line}, {whole} \
             records a scan: change scan, or give the angles with --rays",
            lines.len()
        )));
    }
    let scan = lines
        .iter()
        .flat_map(|angle| std::iter::repeat_n(*angle, per_line));
    Ok(scan.cycle().take(count).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::raw::{Order, RawFormat};

    #[test]
    fn rows_of_records_are_in_the_order_of_the_file_and_rows_of_lines_are_not() {
        let reference = "../../tests/reference/sim/numpy.npz";
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(reference);
        let of_rows = |order: Order, rows: usize| {
            let format = RawFormat {
                order,
                ..RawFormat::default()
            };
            let records = RawRecords::open(&path, &format, 6, 2).unwrap();
            let table = RayTable {
                path: path.clone(),
                elevation_rad: (0..rows).map(|row| 0.1 * row as f64).collect(),
                time_s: Some((0..rows).map(|row| row as f64).collect()),
            };
            interpolate(&table, &records, 2).unwrap()
        };
        let by_lines = of_rows(Order::LineMajor, 4);
        assert_eq!(by_lines.1, Some(vec![0.0, 1.0, 2.0, 3.0]));
        let by_pulses = of_rows(Order::PulseMajor, 4);
        assert_eq!(by_pulses.0, [0.0, 0.2, 0.1, 0.1 * 3.0]);
        assert_eq!(by_pulses.1, Some(vec![0.0, 2.0, 1.0, 3.0]));
        for order in [Order::LineMajor, Order::PulseMajor] {
            let of_lines = of_rows(order, 2);
            assert_eq!(of_lines.1, Some(vec![0.0, 0.0, 1.0, 1.0]));
        }
    }
}
