//! Lists of lines of sight: CSV with a header, or the lines of HALO's step-stare scans, azimuth and elevation in degrees without
//! a separator.
//!
//! Columns: `azimuth_rad` or `azimuth_deg`, `elevation_rad` or `elevation_deg` in the same unit; and as wanted `time_s`,
//! `pulses`, `sweep`, `mode`, `x_m, y_m, z_m`, `u_m_s, v_m_s, w_m_s`. Check: both forms of one scan are read alike; each fault
//! is named with its row and column.

use super::csv_input::TextTable;
use super::text_file;
use crate::Error;
use crate::beams::{Stop, SweepMode};
use std::ops::RangeInclusive;
use std::path::Path;

/// Most rows that are read.
const MOST_ROWS: usize = 100_000;

/// All columns that a list may have.
const COLUMNS: &str = "time_s, azimuth_rad, azimuth_deg, elevation_rad, elevation_deg, pulses, sweep, mode, x_m, y_m, z_m, u_m_s, v_m_s, \
                       w_m_s";

/// Reads a list.
///
/// # Errors
/// A file that cannot be read; an empty list; the first row that does not fit, with column, value and what is allowed.
pub fn read(path: &Path) -> Result<Vec<Stop>, Error> {
    let text = text_file::read(path).map_err(Error::io("read", path))?;
    parse(&text).map_err(|reason| Error::input(path, reason))
}

/// Reads the text of a list.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str) -> Result<Vec<Stop>, String> {
    let first = text
        .lines()
        .map(str::trim)
        .find(|line| !line.is_empty() && !line.starts_with('#'));
    let lines = match first {
        Some(line) if step_stare(line).is_some() => step_stare_lines(text)?,
        _ => table(&TextTable::parse(text)?)?,
    };
    if lines.is_empty() || lines.len() > MOST_ROWS {
        return Err(format!(
            "{} lines of sight: from 1 to {MOST_ROWS} are allowed",
            lines.len()
        ));
    }
    Ok(lines)
}

/// The lines of a step-stare scan.
fn step_stare_lines(text: &str) -> Result<Vec<Stop>, String> {
    let mut lines = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        let angles_rad = step_stare(line).ok_or_else(|| {
            format!(
                "line {}: azimuth and elevation in degrees as 340.004090.000 are needed",
                index + 1
            )
        })?;
        lines.push(Stop::new(SweepMode::Pointing, angles_rad));
    }
    Ok(lines)
}

/// Angles, rad, of a line such as `340.004090.000`.
fn step_stare(line: &str) -> Option<[f64; 2]> {
    let azimuth = line.get(..7)?;
    let elevation = line.get(7..14).filter(|_| line.len() == 14)?;
    Some([step_stare_angle(azimuth)?, step_stare_angle(elevation)?])
}

/// An angle in degrees of seven characters with the point at the fourth, in rad.
fn step_stare_angle(text: &str) -> Option<f64> {
    for (index, byte) in text.bytes().enumerate() {
        let is_allowed = match byte {
            b'.' => index == 3,
            b'-' => index == 0,
            byte => byte.is_ascii_digit(),
        };
        if !is_allowed {
            return None;
        }
    }
    Some(text.parse::<f64>().ok()?.to_radians())
}

fn table(table: &TextTable) -> Result<Vec<Stop>, String> {
    for name in &table.header {
        let mut known = COLUMNS.split(", ");
        if !known.any(|known| known.eq_ignore_ascii_case(name)) {
            return Err(format!("column {name:?} is not known: {COLUMNS} are"));
        }
    }
    let (azimuth, in_degrees) = angle_column(table, "azimuth")?;
    let (elevation, elevation_in_degrees) = angle_column(table, "elevation")?;
    if in_degrees != elevation_in_degrees {
        return Err(
            "azimuth and elevation are in different units: both in _rad, or both in _deg".into(),
        );
    }
    let unit_rad = if in_degrees {
        std::f64::consts::PI / 180.0
    } else {
        1.0
    };
    let position = vector_columns(table, ["x_m", "y_m", "z_m"])?;
    let velocity = vector_columns(table, ["u_m_s", "v_m_s", "w_m_s"])?;
    let up = 90f64.to_radians() / unit_rad;
    let turns = 720f64.to_radians() / unit_rad;
    let mut lines: Vec<Stop> = Vec::with_capacity(table.rows.len());
    for row in 0..table.rows.len() {
        let angles_rad = [
            number(table, row, azimuth, -turns..=turns)? * unit_rad,
            number(table, row, elevation, -up..=up)? * unit_rad,
        ];
        let mut line = Stop::new(SweepMode::Pointing, angles_rad);
        line.time_s = optional_number(table, row, "time_s", 0.0..=1e9)?;
        line.pulses = whole_number(table, row, "pulses", 1.0..=1e6)?;
        line.sweep = whole_number(table, row, "sweep", 0.0..=1e5)?.unwrap_or(line.sweep);
        place_in_sweep(table, row, lines.last(), &mut line)?;
        let position_m = match position {
            Some(columns) => Some(vector(table, row, columns, 1e6)?),
            None => None,
        };
        let velocity_m_s = match velocity {
            Some(columns) => vector(table, row, columns, 1e3)?,
            None => [0.0; 3],
        };
        if velocity.is_some() && position.is_none() {
            return Err("columns u_m_s, v_m_s, w_m_s need x_m, y_m, z_m".into());
        }
        line.carrier = position_m.map(|position_m| (position_m, velocity_m_s));
        lines.push(line);
    }
    Ok(lines)
}

/// Column of an angle, and whether it is in degrees.
fn angle_column(table: &TextTable, name: &str) -> Result<(usize, bool), String> {
    let in_rad = table.column(&format!("{name}_rad"));
    let in_degrees = table.column(&format!("{name}_deg"));
    match (in_rad, in_degrees) {
        (Some(column), None) => Ok((column, false)),
        (None, Some(column)) => Ok((column, true)),
        (Some(_), Some(_)) => Err(format!("{name}_rad and {name}_deg: one of them")),
        (None, None) => Err(format!("no column {name}_rad or {name}_deg")),
    }
}

/// Columns of the three components of a vector, if the table has them.
fn vector_columns(table: &TextTable, names: [&str; 3]) -> Result<Option<[usize; 3]>, String> {
    match names.map(|name| table.column(name)) {
        [Some(a), Some(b), Some(c)] => Ok(Some([a, b, c])),
        [None, None, None] => Ok(None),
        _ => Err(format!("columns {}: all three or none", names.join(", "))),
    }
}

/// The number in a cell.
fn number(
    table: &TextTable,
    row: usize,
    column: usize,
    allowed: RangeInclusive<f64>,
) -> Result<f64, String> {
    let value = table.number(row, column);
    if allowed.contains(&value) {
        return Ok(value);
    }
    let name = &table.header[column];
    let cell = &table.rows[row][column];
    let low = allowed.start();
    let high = allowed.end();
    Err(format!(
        "row {}: {name} = {cell:?}: a number from {low} to {high}",
        row + 1
    ))
}

/// The number in a cell of a column that need not be there.
fn optional_number(
    table: &TextTable,
    row: usize,
    name: &str,
    allowed: RangeInclusive<f64>,
) -> Result<Option<f64>, String> {
    match table.column(name) {
        Some(column) => number(table, row, column, allowed).map(Some),
        None => Ok(None),
    }
}

/// The whole number in a cell of a column that need not be there.
fn whole_number(
    table: &TextTable,
    row: usize,
    name: &str,
    allowed: RangeInclusive<f64>,
) -> Result<Option<usize>, String> {
    match optional_number(table, row, name, allowed)? {
        Some(value) if value.fract() != 0.0 => {
            Err(format!("row {}: {name} = {value}: a whole number", row + 1))
        }
        value => Ok(value.map(|value| value as usize)),
    }
}

/// The three components of a vector, each at most `most` in size.
fn vector(
    table: &TextTable,
    row: usize,
    columns: [usize; 3],
    most: f64,
) -> Result<[f64; 3], String> {
    let mut vector = [0.0; 3];
    for (component, column) in vector.iter_mut().zip(columns) {
        *component = number(table, row, column, -most..=most)?;
    }
    Ok(vector)
}

/// Checks the sweep of a line against the line before it, and reads its mode.
fn place_in_sweep(
    table: &TextTable,
    row: usize,
    before: Option<&Stop>,
    line: &mut Stop,
) -> Result<(), String> {
    let next = before.map_or(0, |before| before.sweep + 1);
    if line.sweep > next || before.is_some_and(|before| line.sweep < before.sweep) {
        return Err(format!(
            "row {}: sweep = {}: sweeps count from 0 without gaps",
            row + 1,
            line.sweep
        ));
    }
    let Some(column) = table.column("mode") else {
        return Ok(());
    };
    let name = table.rows[row][column].trim();
    let mut modes = SweepMode::ALL.into_iter();
    line.mode = modes.find(|mode| mode.name() == name).ok_or_else(|| {
        let names = SweepMode::ALL.map(SweepMode::name).join(", ");
        format!("row {}: mode = {name:?}: one of {names}", row + 1)
    })?;
    line.apart = line.mode.is_pointing();
    if before.is_some_and(|before| before.sweep == line.sweep && before.mode != line.mode) {
        return Err(format!(
            "row {}: mode = {name:?}: the rows of a sweep have one mode",
            row + 1
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_of_a_list_are_read_alike() {
        let halo = parse("340.004090.000\n000.500-01.250\n").unwrap();
        let csv = parse("# a scan\nazimuth_deg,elevation_deg\n340.004,90\n0.5,-1.25\n").unwrap();
        assert_eq!(halo, csv);
        assert_eq!(
            halo[1].angles_rad,
            [0.5f64.to_radians(), (-1.25f64).to_radians()]
        );
        let whole = "time_s,azimuth_rad,elevation_rad,pulses,sweep,mode,x_m,y_m,z_m,u_m_s,v_m_s,w_m_s\n\
                     0.5,0.1,0.2,30,0,sector,1,2,3,70,0,-3\n";
        let row = &parse(whole).unwrap()[0];
        assert_eq!(
            (row.time_s, row.pulses, row.mode),
            (Some(0.5), Some(30), SweepMode::Sector)
        );
        assert_eq!(row.carrier, Some(([1.0, 2.0, 3.0], [70.0, 0.0, -3.0])));
    }

    #[test]
    fn faults_are_named_with_their_row_and_column() {
        for (text, wanted) in [
            ("azimuth_rad,elevation_deg\n0,0\n", "different units"),
            ("azimuth_rad,elevation_rad\n", "0 lines of sight"),
            (
                "azimuth_rad,elevation_rad\n0,0\n1,x\n",
                "row 2: elevation_rad = \"x\"",
            ),
            (
                "azimuth_rad,elevation_rad\n0,90\n",
                "row 1: elevation_rad = \"90\": a number from -1.57",
            ),
            (
                "azimuth_rad,elevation_rad,speed\n0,0,1\n",
                "column \"speed\" is not known",
            ),
            (
                "azimuth_rad,elevation_rad,pulses\n0,0,1.5\n",
                "row 1: pulses = 1.5: a whole number",
            ),
            (
                "azimuth_rad,elevation_rad,sweep\n0,0,1\n",
                "row 1: sweep = 1",
            ),
            (
                "azimuth_rad,elevation_rad,mode\n0,0,cone\n",
                "row 1: mode = \"cone\": one of rhi",
            ),
            (
                "azimuth_rad,elevation_rad,u_m_s\n0,0,1\n",
                "all three or none",
            ),
            ("340.004090.000\nnorth\n", "line 2"),
        ] {
            let message = parse(text).unwrap_err();
            assert!(message.contains(wanted), "{message}");
        }
    }
}
