//! Scans from a table: a row for each velocity in any order, the grid recognised from the cells.
//!
//! Check: maps of a run, references, cells that are missing, twice there, or make no grid.

use super::grid::{RayRow, mean_count, of_mean, scan_map};
use super::{Found, ReadScan, ScanFormat, planes};
use crate::io::csv_input::TextTable;
use std::collections::BTreeMap;
use std::path::Path;

/// Names of the velocity, the first that is there is taken.
const VELOCITIES: [&str; 4] = [
    "velocity_m_s",
    OWN,
    "radial_velocity_m_s",
    "radial_velocity",
];
/// That of the estimates of this program.
const OWN: &str = "v_mean_m_s";
/// Names of its standard deviation.
const SIGMAS: [&str; 3] = ["sigma_m_s", "std_m_s", "predicted_std_m_s"];
/// Values of an axis that differ by less than this part of its mean step are the same.
const SAME: f64 = 1e-3;

/// A row of a table; NaN is what it does not say.
struct Row {
    /// In the table, from 1.
    number: usize,
    range_m: f64,
    elevation_rad: f64,
    azimuth_rad: f64,
    time_s: f64,
    /// NaN of noise, too.
    velocity_m_s: f64,
    /// None in a table without.
    sigma_m_s: Option<f64>,
    /// Scans of which the velocity is the mean.
    count: f64,
}

/// The scans of a table, and what was left out.
pub(super) fn scans(text: &str, path: &Path, format: &ScanFormat) -> Result<Found, String> {
    let table = TextTable::parse(text)?;
    // Programs that write it again keep the names of its columns.
    let is_own =
        table.comment.trim_start().starts_with("source: wakescope ") || table.column(OWN).is_some();
    let (rows, skipped) = rows(&table, format, is_own)?;
    if rows.is_empty() {
        return Err("it has a header and no rows with an elevation".into());
    }
    let scene_toml = Some(table.origin().scene_toml).filter(|text| !text.is_empty());
    let (mut out, mut left_out) = (Vec::new(), Vec::new());
    if skipped > 0 {
        let all = table.rows.len();
        left_out.push(format!("{skipped} of {all} rows have no elevation"));
    }
    for (sweep, rows) in rows {
        let (rays, range_m) = grid(&rows)?;
        let what = format!("sweep {sweep}");
        let (found, skipped) =
            planes::in_any_order(rays).map_err(|reason| format!("{what}: {reason}"))?;
        left_out.extend(skipped.iter().map(|text| format!("{what}: {text}")));
        for scan in found {
            match scan_map(scan.rays, range_m.clone(), None, &what) {
                Err(reason) => left_out.push(reason),
                Ok(map) => out.push(ReadScan {
                    azimuth_rad: scan.azimuth_rad,
                    scene_toml: scene_toml.clone(),
                    scans: mean_count(rows.iter().map(|row| row.count)),
                    is_own,
                    ..ReadScan::new(path, sweep as usize, map)
                }),
            }
        }
    }
    Ok((out, left_out))
}

/// The rows of each sweep, and the number of rows without an elevation. Numbers of this program's maps have the digits of their NetCDF files, single precision and angles in degrees:
/// fits to what jumps tell the same of both.
fn rows(
    table: &TextTable,
    format: &ScanFormat,
    is_own: bool,
) -> Result<(BTreeMap<u64, Vec<Row>>, usize), String> {
    let one_of = |names: &[&str]| names.iter().find_map(|name| table.column(name));
    let needed = |names: &[&str]| {
        one_of(names).ok_or_else(|| {
            format!(
                "it has no column {}: range_m, elevation_rad (or elevation_deg), velocity_m_s and, if known, time_s and sigma_m_s are read",
                names.join(" or ")
            )
        })
    };
    let velocity = match &format.field {
        Some(name) => needed(&[name])?,
        None => needed(&VELOCITIES)?,
    };
    let elevation = table.angle("elevation").map_or_else(
        || needed(&["elevation_rad"]).map(|column| (column, 1.0)),
        Ok,
    )?;
    let (range, azimuth, time) = (
        needed(&["range_m"])?,
        table.angle("azimuth"),
        table.column("time_s"),
    );
    let (sweep, snr, flagged) = (
        one_of(&["sweep", "scan"]),
        table.column("snr_db"),
        table.column("flagged"),
    );
    let is_mean = table.header[velocity] == OWN;
    let (sigma, count) = (one_of(&SIGMAS), table.column("count").filter(|_| is_mean));
    let mut out: BTreeMap<u64, Vec<Row>> = BTreeMap::new();
    let mut skipped = 0;
    for (row, cells) in table.rows.iter().enumerate() {
        let refuse = |reason: &str| Err(format!("row {}: {reason}", row + 1));
        let number = |column: usize| table.number(row, column);
        let single = |column: usize| {
            if is_own {
                f64::from(number(column) as f32)
            } else {
                number(column)
            }
        };
        let radians = |(column, unit): (usize, f64)| unit * number(column);
        let sweep = sweep.map_or(0.0, number);
        if !(sweep >= 0.0 && sweep.fract() == 0.0) {
            return refuse("sweep is no whole number");
        }
        if is_missing(&cells[elevation.0]) {
            skipped += 1;
            continue;
        }
        let (range_m, elevation_rad) = (single(range), radians(elevation));
        if !(range_m.is_finite() && elevation_rad.is_finite()) {
            return refuse("its range or elevation is no number");
        }
        let velocity_m_s = single(velocity);
        if velocity_m_s.is_nan() && !is_missing(&cells[velocity]) {
            return refuse("its velocity is no number; an empty cell is a missing one");
        }
        let is_noise = snr.is_some_and(|c| format.is_noise(number(c)))
            || flagged.is_some_and(|c| number(c) > 0.5);
        out.entry(sweep as u64).or_default().push(Row {
            number: row + 1,
            range_m,
            elevation_rad: match is_own {
                true => f64::from(elevation_rad.to_degrees() as f32).to_radians(),
                false => elevation_rad,
            },
            azimuth_rad: azimuth.map_or(f64::NAN, radians),
            time_s: time.map_or(f64::NAN, number),
            velocity_m_s: if is_noise {
                f64::NAN
            } else {
                format.sign() * velocity_m_s
            },
            sigma_m_s: sigma.map(|column| of_mean(single(column), count.map(number))),
            count: count.map_or(f64::NAN, number),
        });
    }
    Ok((out, skipped))
}

/// Whether a cell says that there is no number.
fn is_missing(cell: &str) -> bool {
    let text = cell.trim();
    text.is_empty() || text.eq_ignore_ascii_case("nan")
}

/// The rays of one sweep on the ranges of all, in the order in which they first come.
fn grid(rows: &[Row]) -> Result<(Vec<RayRow>, Vec<f64>), String> {
    let range_m = axis(rows.iter().map(|row| row.range_m));
    let elevation_rad = axis(rows.iter().map(|row| row.elevation_rad));
    let gates = range_m.len();
    let mut lines: BTreeMap<(usize, u64), usize> = BTreeMap::new();
    let line_of: Vec<usize> = rows
        .iter()
        .map(|row| {
            let direction = (
                nearest(&elevation_rad, row.elevation_rad),
                row.azimuth_rad.to_bits(),
            );
            let next = lines.len();
            *lines.entry(direction).or_insert(next)
        })
        .collect();
    let lines = lines.len();
    if gates * lines > 10 * rows.len() + 1000 {
        return Err(format!(
            "its {} rows make no polar grid: they have {gates} different ranges and {lines} different directions",
            rows.len()
        ));
    }
    let has_sigma = rows.iter().any(|row| row.sigma_m_s.is_some());
    let empty = RayRow {
        elevation_rad: f64::NAN,
        azimuth_rad: f64::NAN,
        time_s: f64::NAN,
        velocity_m_s: vec![f64::NAN; gates],
        sigma_m_s: if has_sigma {
            vec![f64::NAN; gates]
        } else {
            Vec::new()
        },
    };
    let mut rays = vec![empty; lines];
    let mut seen = vec![false; gates * lines];
    for (row, line) in rows.iter().zip(line_of) {
        let gate = nearest(&range_m, row.range_m);
        if std::mem::replace(&mut seen[line * gates + gate], true) {
            return Err(format!(
                "row {}: range {} m at elevation {} rad is there twice: a column sweep tells scans apart",
                row.number, row.range_m, row.elevation_rad
            ));
        }
        let ray = &mut rays[line];
        ray.elevation_rad = elevation_rad[nearest(&elevation_rad, row.elevation_rad)];
        ray.azimuth_rad = row.azimuth_rad;
        ray.velocity_m_s[gate] = row.velocity_m_s;
        if let Some(sigma_m_s) = row.sigma_m_s {
            ray.sigma_m_s[gate] = sigma_m_s;
        }
        if row.time_s.is_finite() {
            ray.time_s = row.time_s;
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
    let near = [
        above.saturating_sub(1),
        above.min(axis.len().saturating_sub(1)),
    ];
    if (axis[near[0]] - value).abs() <= (axis[near[1]] - value).abs() {
        near[0]
    } else {
        near[1]
    }
}
