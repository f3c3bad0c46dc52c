//! Scans from a table: a row for each velocity in any order, the grid recognised from the cells.
//!
//! Check: maps of a run, references, cells that are missing, twice there, or make no grid.

use super::grid::{RayRow, mean_count, of_mean, one_plane, scan_map};
use super::{ReadScan, ScanFormat};
use crate::io::csv_input::TextTable;
use std::collections::BTreeMap;
use std::path::Path;

/// Names of the velocity, the first that is there is taken.
const VELOCITIES: [&str; 4] = ["velocity_m_s", OWN, "radial_velocity_m_s", "radial_velocity"];
/// That of the estimates of this program.
const OWN: &str = "v_mean_m_s";
/// Names of its standard deviation.
const SIGMAS: [&str; 3] = ["sigma_m_s", "std_m_s", "predicted_std_m_s"];
/// Values of an axis that differ by less than this part of its mean step are the same.
const SAME: f64 = 1e-3;

/// Columns of a table that are read.
struct Columns {
    range: usize,
    elevation: (usize, f64),
    azimuth: Option<(usize, f64)>,
    time: Option<usize>,
    velocity: usize,
    sigma: Option<usize>,
    sweep: Option<usize>,
    snr: Option<usize>,
    flagged: Option<usize>,
    count: Option<usize>,
}

impl Columns {
    fn new(table: &TextTable, format: &ScanFormat) -> Result<Self, String> {
        let one_of = |names: &[&str]| names.iter().find_map(|name| table.column(name));
        let needed = |names: &[&str]| {
            one_of(names).ok_or_else(|| {
                format!(
                    "it has no column {}: range_m, elevation_rad (or elevation_deg), velocity_m_s and, if known, time_s and sigma_m_s \
                     are read",
                    names.join(" or ")
                )
            })
        };
        let angle = |name: &str| {
            let in_degrees = || Some((table.column(&format!("{name}_deg"))?, 1f64.to_radians()));
            table.column(&format!("{name}_rad")).map(|column| (column, 1.0)).or_else(in_degrees)
        };
        let velocity = match &format.field {
            Some(name) => needed(&[name])?,
            None => needed(&VELOCITIES)?,
        };
        let is_mean = table.header.get(velocity).is_some_and(|name| name == OWN);
        Ok(Self {
            elevation: angle("elevation").map_or_else(|| Ok((needed(&["elevation_rad"])?, 1.0)), Ok::<_, String>)?,
            velocity,
            range: needed(&["range_m"])?,
            azimuth: angle("azimuth"),
            time: table.column("time_s"),
            sigma: one_of(&SIGMAS),
            sweep: one_of(&["sweep", "scan"]),
            snr: table.column("snr_db"),
            flagged: table.column("flagged"),
            // The mean of so many scans.
            count: table.column("count").filter(|_| is_mean),
        })
    }
}

/// The scans of a table.
pub(super) fn scans(text: &str, path: &Path, format: &ScanFormat) -> Result<Vec<ReadScan>, String> {
    let table = TextTable::parse(text)?;
    let columns = Columns::new(&table, format)?;
    let mut rows: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for row in 0..table.rows.len() {
        let sweep = columns.sweep.map_or(0.0, |column| table.number(row, column));
        if !(sweep >= 0.0 && sweep.fract() == 0.0) {
            return Err(format!("row {}: sweep is no whole number", row + 1));
        }
        rows.entry(sweep as u64).or_default().push(row);
    }
    if rows.is_empty() {
        return Err("it has a header and no rows".into());
    }
    let origin = table.origin();
    // Programs that write it again keep the names of its columns.
    let is_own = table.comment.trim_start().starts_with("source: wakescope ") || table.column(OWN).is_some();
    rows.into_iter()
        .map(|(sweep, rows)| {
            let (rays, range_m) = cells(&table, &columns, &rows, format, is_own)?;
            let what = format!("sweep {sweep}");
            one_plane(&rays, &what)?;
            Ok(ReadScan {
                scene_toml: Some(origin.scene_toml.clone()).filter(|text| !text.is_empty()),
                scans: mean_count(columns.count.iter().flat_map(|c| rows.iter().map(|row| table.number(*row, *c)))),
                is_own,
                ..ReadScan::new(path, sweep as usize, scan_map(rays, range_m, None, &what)?)
            })
        })
        .collect()
}

/// The rays of one scan on the ranges of all. Numbers of this program's maps have the digits of their NetCDF files, single precision and angles in
/// degrees: fits to what jumps tell the same of both.
fn cells(
    table: &TextTable,
    columns: &Columns,
    rows: &[usize],
    format: &ScanFormat,
    is_own: bool,
) -> Result<(Vec<RayRow>, Vec<f64>), String> {
    let number = |row: usize, column: usize| table.number(row, column);
    let single = |row: usize, column: usize| match number(row, column) {
        value if is_own => f64::from(value as f32),
        value => value,
    };
    let angle = |row: usize, (column, unit): (usize, f64)| match unit * number(row, column) {
        angle_rad if is_own => f64::from(angle_rad.to_degrees() as f32).to_radians(),
        angle_rad => angle_rad,
    };
    let mut places = Vec::with_capacity(rows.len());
    for &row in rows {
        let (range_m, elevation_rad) = (single(row, columns.range), angle(row, columns.elevation));
        if !(range_m.is_finite() && elevation_rad.is_finite()) {
            return Err(format!("row {}: its range or elevation is no number", row + 1));
        }
        places.push((range_m, elevation_rad));
    }
    let range_m = axis(places.iter().map(|place| place.0));
    let elevation_rad = axis(places.iter().map(|place| place.1));
    if range_m.len() * elevation_rad.len() > 10 * rows.len() + 1000 {
        return Err(format!(
            "its {} rows make no polar grid: they have {} different ranges and {} different elevations",
            rows.len(),
            range_m.len(),
            elevation_rad.len()
        ));
    }
    let empty = |elevation_rad: &f64| RayRow {
        elevation_rad: *elevation_rad,
        azimuth_rad: f64::NAN,
        time_s: f64::NAN,
        velocity_m_s: vec![f64::NAN; range_m.len()],
        sigma_m_s: if columns.sigma.is_some() { vec![f64::NAN; range_m.len()] } else { Vec::new() },
    };
    let mut rays: Vec<RayRow> = elevation_rad.iter().map(empty).collect();
    let mut seen = vec![false; range_m.len() * elevation_rad.len()];
    for (&row, (range, elevation)) in rows.iter().zip(places) {
        let (line, gate) = (nearest(&elevation_rad, elevation), nearest(&range_m, range));
        if std::mem::replace(&mut seen[line * range_m.len() + gate], true) {
            return Err(format!(
                "row {}: range {range} m at elevation {elevation} rad is there twice: a column sweep tells scans apart",
                row + 1
            ));
        }
        let ray = &mut rays[line];
        let text = table.rows[row][columns.velocity].trim();
        let velocity_m_s = single(row, columns.velocity);
        if velocity_m_s.is_nan() && !(text.is_empty() || text.eq_ignore_ascii_case("nan")) {
            return Err(format!("row {}: its velocity is no number; an empty cell is a missing one", row + 1));
        }
        let noisy = columns.snr.is_some_and(|c| format.is_noise(number(row, c)));
        let is_flagged = columns.flagged.is_some_and(|c| number(row, c) > 0.5);
        if !noisy && !is_flagged {
            ray.velocity_m_s[gate] = format.sign() * velocity_m_s;
        }
        if let Some(column) = columns.sigma {
            let count = columns.count.map(|c| number(row, c));
            ray.sigma_m_s[gate] = of_mean(single(row, column), count);
        }
        for (of, value) in [
            (&mut ray.time_s, columns.time.map(|c| number(row, c))),
            (&mut ray.azimuth_rad, columns.azimuth.map(|(c, unit)| unit * number(row, c))),
        ] {
            if let Some(value) = value.filter(|value| value.is_finite()) {
                *of = value;
            }
        }
    }
    Ok((rays, range_m))
}

/// Different values, increasing; those that rounding alone sets apart are one.
fn axis(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    let step = match (all.first(), all.last()) {
        (Some(first), Some(last)) if all.len() > 1 => (last - first) / (all.len() - 1) as f64,
        _ => 0.0,
    };
    all.dedup_by(|next, kept| *next - *kept <= SAME * step);
    all
}

fn nearest(axis: &[f64], value: f64) -> usize {
    let above = axis.partition_point(|x| *x <= value);
    let near = [above.saturating_sub(1), above.min(axis.len().saturating_sub(1))];
    if (axis[near[0]] - value).abs() <= (axis[near[1]] - value).abs() { near[0] } else { near[1] }
}
