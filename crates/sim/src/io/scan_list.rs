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
    parse(&text).map_err(|reason| Error::Input {
        path: path.to_owned(),
        reason,
    })
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
    let stare = |(i, line): (usize, &str)| match step_stare(line.trim()) {
        Some(angles_rad) => Ok(Stop::new(SweepMode::Pointing, angles_rad)),
        None => Err(format!(
            "line {}: azimuth and elevation in degrees as 340.004090.000 are needed",
            i + 1
        )),
    };
    let stops = match first {
        Some(line) if step_stare(line).is_some() => {
            let lines = text
                .lines()
                .enumerate()
                .filter(|(_, line)| !line.trim().is_empty());
            lines.map(stare).collect::<Result<Vec<_>, String>>()?
        }
        _ => table(&TextTable::parse(text)?)?,
    };
    if stops.is_empty() || stops.len() > MOST_ROWS {
        return Err(format!(
            "{} lines of sight: from 1 to {MOST_ROWS} are allowed",
            stops.len()
        ));
    }
    Ok(stops)
}

/// Angles, rad, of a line such as `340.004090.000`.
fn step_stare(line: &str) -> Option<[f64; 2]> {
    let azimuth = line.get(..7)?;
    let elevation = line.get(7..14).filter(|_| line.len() == 14)?;
    let angle = |text: &str| {
        let digits = text
            .bytes()
            .enumerate()
            .all(|(i, b)| b.is_ascii_digit() || (i == 3 && b == b'.') || (i == 0 && b == b'-'));
        text.parse::<f64>()
            .ok()
            .filter(|_| digits)
            .map(f64::to_radians)
    };
    Some([angle(azimuth)?, angle(elevation)?])
}

fn table(table: &TextTable) -> Result<Vec<Stop>, String> {
    if let Some(other) = table.header.iter().find(|name| {
        !COLUMNS
            .split(", ")
            .any(|known| known.eq_ignore_ascii_case(name))
    }) {
        return Err(format!("column {other:?} is not known: {COLUMNS} are"));
    }
    let column = |name: &str| table.column(name);
    let angle = |name: &str| match (
        column(&format!("{name}_rad")),
        column(&format!("{name}_deg")),
    ) {
        (Some(at), None) => Ok((at, false)),
        (None, Some(at)) => Ok((at, true)),
        (Some(_), Some(_)) => Err(format!("{name}_rad and {name}_deg: one of them")),
        (None, None) => Err(format!("no column {name}_rad or {name}_deg")),
    };
    let (azimuth, in_degrees) = angle("azimuth")?;
    let (elevation, also) = angle("elevation")?;
    if in_degrees != also {
        return Err(
            "azimuth and elevation are in different units: both in _rad, or both in _deg".into(),
        );
    }
    let unit = if in_degrees {
        std::f64::consts::PI / 180.0
    } else {
        1.0
    };
    let number = |row: usize, at: usize, low: f64, high: f64| -> Result<f64, String> {
        let value = table.number(row, at);
        let name = &table.header[at];
        let cell = &table.rows[row][at];
        let good = (low..=high).contains(&value);
        if good {
            Ok(value)
        } else {
            Err(format!(
                "row {}: {name} = {cell:?}: a number from {low} to {high}",
                row + 1
            ))
        }
    };
    let triple = |names: [&str; 3]| -> Result<Option<[usize; 3]>, String> {
        let places = names.map(column);
        match places {
            [Some(a), Some(b), Some(c)] => Ok(Some([a, b, c])),
            [None, None, None] => Ok(None),
            _ => Err(format!("columns {}: all three or none", names.join(", "))),
        }
    };
    let place = triple(["x_m", "y_m", "z_m"])?;
    let velocity = triple(["u_m_s", "v_m_s", "w_m_s"])?;
    let mut out: Vec<Stop> = Vec::with_capacity(table.rows.len());
    for row in 0..table.rows.len() {
        let up = 90f64.to_radians() / unit;
        let turns = 720f64.to_radians() / unit;
        let angles_rad = [
            number(row, azimuth, -turns, turns)? * unit,
            number(row, elevation, -up, up)? * unit,
        ];
        let mut stop = Stop::new(SweepMode::Pointing, angles_rad);
        let of_column = |name: &str, low, high| {
            column(name)
                .map(|at| number(row, at, low, high))
                .transpose()
        };
        let whole = |name: &str, low, high| match of_column(name, low, high)? {
            Some(value) if value.fract() != 0.0 => {
                Err(format!("row {}: {name} = {value}: a whole number", row + 1))
            }
            value => Ok(value.map(|value| value as usize)),
        };
        stop.time_s = of_column("time_s", 0.0, 1e9)?;
        stop.pulses = whole("pulses", 1.0, 1e6)?;
        stop.sweep = whole("sweep", 0.0, 1e5)?.unwrap_or(stop.sweep);
        let before = out.last();
        let next = before.map_or(0, |b| b.sweep + 1);
        if stop.sweep > next || before.is_some_and(|b| stop.sweep < b.sweep) {
            return Err(format!(
                "row {}: sweep = {}: sweeps count from 0 without gaps",
                row + 1,
                stop.sweep
            ));
        }
        if let Some(at) = column("mode") {
            let name = table.rows[row][at].trim();
            let names = SweepMode::ALL.map(SweepMode::name).join(", ");
            let known = SweepMode::ALL.into_iter().find(|mode| mode.name() == name);
            stop.mode =
                known.ok_or_else(|| format!("row {}: mode = {name:?}: one of {names}", row + 1))?;
            stop.apart = stop.mode.is_pointing();
            if before.is_some_and(|b| b.sweep == stop.sweep && b.mode != stop.mode) {
                return Err(format!(
                    "row {}: mode = {name:?}: the rows of a sweep have one mode",
                    row + 1
                ));
            }
        }
        let vector = |places: [usize; 3], most: f64| -> Result<[f64; 3], String> {
            let [a, b, c] = places.map(|at| number(row, at, -most, most));
            Ok([a?, b?, c?])
        };
        let place_m = place.map(|places| vector(places, 1e6)).transpose()?;
        let velocity_m_s = velocity
            .map(|places| vector(places, 1e3))
            .transpose()?
            .unwrap_or_default();
        if velocity.is_some() && place.is_none() {
            return Err("columns u_m_s, v_m_s, w_m_s need x_m, y_m, z_m".into());
        }
        stop.carrier = place_m.map(|place_m| (place_m, velocity_m_s));
        out.push(stop);
    }
    Ok(out)
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
