//! Winds as CF NetCDF (classic) over time and height.
//!
//! Check: `wind` in the tests of the program reads it back.

use super::WindProfiles;
use super::rows::WindRow;
use super::table::date;
use crate::Error;
use crate::io::Provenance;
use crate::io::netcdf::{Data, Layout, described};
use std::collections::BTreeMap;

/// Heights that are closer than this are one, m.
const SAME_HEIGHT_M: f64 = 0.05;

/// A variable, and the number of a row that it holds.
type Field = (&'static str, fn(&WindRow) -> f64);

/// Variables over time and height.
const FIELDS: [Field; 16] = [
    ("eastward_wind", |row| row.east_m_s.value),
    ("eastward_wind_std", |row| row.east_m_s.std),
    ("northward_wind", |row| row.north_m_s.value),
    ("northward_wind_std", |row| row.north_m_s.std),
    ("upward_air_velocity", |row| row.up_m_s.value),
    ("upward_air_velocity_std", |row| row.up_m_s.std),
    ("wind_along", |row| row.along_m_s.value),
    ("wind_along_std", |row| row.along_m_s.std),
    ("radial_wind", |row| row.radial_m_s.value),
    ("radial_wind_std", |row| row.radial_m_s.std),
    ("wind_speed", |row| row.speed_m_s.value),
    ("wind_from_direction", |row| row.from_deg.value),
    ("edr", |row| row.edr_m23_s),
    ("edr_low", |row| row.edr_low_m23_s),
    ("edr_high", |row| row.edr_high_m23_s),
    ("good_cells", |row| row.good_cells),
];

/// The file's bytes.
///
/// # Errors
/// A result too large for one file.
pub fn netcdf(profiles: &WindProfiles, origin: &Provenance) -> Result<Vec<u8>, Error> {
    let rows = &profiles.rows;
    let mut heights: BTreeMap<i64, f64> = BTreeMap::new();
    for row in rows {
        heights
            .entry(height_number(row.height_m))
            .or_insert(row.height_m);
    }
    let mut windows: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
    for row in rows {
        windows.insert(row.window, (row.start_s, row.end_s));
    }
    let mut cells: BTreeMap<(usize, i64), &WindRow> = BTreeMap::new();
    for row in rows {
        cells.insert((row.window, height_number(row.height_m)), row);
    }
    let middles = windows
        .values()
        .map(|(start_s, end_s)| 0.5 * (start_s + end_s));
    let bounds = windows
        .values()
        .flat_map(|(start_s, end_s)| [*start_s, *end_s]);
    let units = match date(profiles.reference, 0.0) {
        date if date.is_empty() => "s".to_owned(),
        date => format!("seconds since {date}"),
    };
    let heights_m: Vec<f64> = heights.values().copied().collect();
    let mut values = vec![
        ("time", Data::f64(middles)),
        ("time:units", Data::text(units)),
        ("time_bounds", Data::f64(bounds)),
        ("height", Data::f64_slice(&heights_m)),
    ];
    for (name, of) in FIELDS {
        let mut field = Vec::with_capacity(windows.len() * heights.len());
        for window in windows.keys() {
            for height in heights.keys() {
                let cell = cells.get(&(*window, *height));
                field.push(cell.map_or(f64::NAN, |row| of(row)));
            }
        }
        values.push((name, Data::filled(&field)));
    }
    let variables = described(include_str!("wind.cdl"), values);
    let dims = vec![
        ("time", windows.len()),
        ("bounds", 2),
        ("height", heights_m.len()),
    ];
    Layout::cf("wind over height", dims, variables, origin).into_bytes(origin)
}

fn height_number(height_m: f64) -> i64 {
    (height_m / SAME_HEIGHT_M).round() as i64
}
