//! Scans from a table: a row for each velocity in any order, the grid recognised from the cells.
//!
//! Check: maps of a run, references, cells that are missing, twice there, or make no grid.

use super::grid::{RayRow, mean_count, of_mean, scan_map};
use super::{Found, ReadScan, ScanFormat, planes};
use crate::io::csv_input::TextTable;
use crate::io::netcdf_input::quoted;
use crate::io::units::Quantity;
use crate::io::variable::{self, AZIMUTH, RANGE, RATIO, SIGMA, Times, VELOCITY, VariableNames};
use std::collections::BTreeMap;
use std::path::Path;

/// The velocity among the estimates of this program.
const OWN: &str = "v_mean_m_s";
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

/// The scans of a table.
pub(super) fn scans(text: &str, path: &Path, format: &ScanFormat) -> Result<Found, String> {
    let table = TextTable::parse(text)?;
    // Programs that write it again keep the names of its columns.
    let is_own =
        table.comment.trim_start().starts_with("source: wakescope ") || table.column(OWN).is_some();
    let Rows {
        sweeps,
        times,
        without_elevation,
    } = rows(&table, format, is_own)?;
    if sweeps.is_empty() {
        return Err("it has a header and no rows with an elevation".into());
    }
    let scene_toml = Some(table.origin().scene_toml).filter(|text| !text.is_empty());
    let mut found = Found::default();
    if without_elevation > 0 {
        let all = table.rows.len();
        found.left_out.push(format!(
            "{without_elevation} of {all} rows have no elevation"
        ));
    }
    for (sweep, rows) in sweeps {
        let (rays, range_m) = grid(&rows)?;
        let what = format!("sweep {sweep}");
        let (scans, skipped) =
            planes::in_any_order(rays).map_err(|reason| format!("{what}: {reason}"))?;
        let skipped = skipped.iter().map(|text| format!("{what}: {text}"));
        found.left_out.extend(skipped);
        for scan in scans {
            match scan_map(scan.rays, range_m.clone(), None, &what) {
                Err(reason) => found.left_out.push(reason),
                Ok(map) => found.scans.push(ReadScan {
                    azimuth_rad: scan.azimuth_rad,
                    reference: times.reference,
                    scene_toml: scene_toml.clone(),
                    scans: mean_count(rows.iter().map(|row| row.count)),
                    is_own,
                    ..ReadScan::new(path, sweep as usize, map)
                }),
            }
        }
    }
    found.warnings.extend(times.not_understood);
    Ok(found)
}

/// The rows of a table.
struct Rows {
    sweeps: BTreeMap<u64, Vec<Row>>,
    times: Times,
    without_elevation: usize,
}

/// The rows of each sweep. Numbers of this program's maps have the digits of their NetCDF files, single precision and angles in degrees:
/// fits to what jumps tell the same of both.
fn rows(table: &TextTable, format: &ScanFormat, is_own: bool) -> Result<Rows, String> {
    let missing = |name: &str| {
        format!(
            "it has no column {name}: range_m, elevation_rad (or elevation_deg), velocity_m_s and, if known, time_s and sigma_m_s are \
             read, or other units in their names; it has {}",
            columns(table)
        )
    };
    let velocity = match &format.field {
        Some(name) => table
            .column(name)
            .map(|at| table.header[at].as_str())
            .ok_or_else(|| {
                format!(
                    "it has no column {name}, which --field names; it has {}",
                    columns(table)
                )
            })?,
        None => variable::find(table, &VELOCITY).ok_or_else(|| missing("velocity_m_s"))?,
    };
    let optional = |known: &VariableNames, quantity| match variable::find(table, known) {
        Some(name) => variable::values(table, name, quantity).map(Some),
        None => Ok::<_, String>(None),
    };
    let range = variable::find(table, &RANGE).ok_or_else(|| missing("range_m"))?;
    let ranges_m = variable::values(table, range, Quantity::Length)?;
    let (elevation, elevations_rad) =
        variable::elevations_rad(table)?.ok_or_else(|| missing("elevation_rad"))?;
    let elevation = table.column(elevation).unwrap_or_default();
    let velocities_m_s = variable::values(table, velocity, Quantity::Velocity)?;
    let azimuths_rad = optional(&AZIMUTH, Quantity::Angle)?;
    let sigmas_m_s = optional(&SIGMA, Quantity::Velocity)?;
    let times = variable::times(table, table.rows.len())?;
    let ratios_db = match (format.min_snr_db, variable::find(table, &RATIO)) {
        (None, _) => None,
        (Some(_), Some(name)) => Some(variable::ratio_db(table, name)?),
        (Some(_), None) => return Err(super::NO_RATIO.to_owned()),
    };
    let is_mean = velocity == OWN;
    let velocity = table.column(velocity).unwrap_or_default();
    let sweep = table.column("sweep").or_else(|| table.column("scan"));
    let flagged = table.column("flagged");
    let count = table.column("count").filter(|_| is_mean);
    let mut sweeps: BTreeMap<u64, Vec<Row>> = BTreeMap::new();
    let mut without_elevation = 0;
    for (row, cells) in table.rows.iter().enumerate() {
        let refuse = |reason: &str| Err(format!("row {}: {reason}", row + 1));
        let number = |column: usize| table.number(row, column);
        let single = |value: f64| {
            if is_own {
                f64::from(value as f32)
            } else {
                value
            }
        };
        let sweep = sweep.map_or(0.0, number);
        if !(sweep >= 0.0 && sweep.fract() == 0.0) {
            return refuse("sweep is no whole number");
        }
        if is_missing(&cells[elevation]) {
            without_elevation += 1;
            continue;
        }
        let range_m = single(ranges_m[row]);
        let elevation_rad = elevations_rad[row];
        if !(range_m.is_finite() && elevation_rad.is_finite()) {
            return refuse("its range or elevation is no number");
        }
        let velocity_m_s = single(velocities_m_s[row]);
        if velocity_m_s.is_nan() && !is_missing(&cells[velocity]) {
            return refuse("its velocity is no number; an empty cell is a missing one");
        }
        let is_noise = ratios_db
            .as_ref()
            .is_some_and(|ratios_db| format.is_noise(ratios_db[row]))
            || flagged.is_some_and(|c| number(c) > 0.5);
        sweeps.entry(sweep as u64).or_default().push(Row {
            number: row + 1,
            range_m,
            elevation_rad: match is_own {
                true => f64::from(elevation_rad.to_degrees() as f32).to_radians(),
                false => elevation_rad,
            },
            azimuth_rad: azimuths_rad.as_ref().map_or(f64::NAN, |all| all[row]),
            time_s: times.time_s[row],
            velocity_m_s: if is_noise {
                f64::NAN
            } else {
                format.sign() * velocity_m_s
            },
            sigma_m_s: sigmas_m_s
                .as_ref()
                .map(|all| of_mean(single(all[row]), count.map(number))),
            count: count.map_or(f64::NAN, number),
        });
    }
    Ok(Rows {
        sweeps,
        times,
        without_elevation,
    })
}

/// Whether a cell says that there is no number.
fn is_missing(cell: &str) -> bool {
    let text = cell.trim();
    text.is_empty() || text.eq_ignore_ascii_case("nan")
}

/// The names of the first columns of a table.
fn columns(table: &TextTable) -> String {
    let names = table.header.iter().take(8).map(|name| quoted(name));
    names.collect::<Vec<_>>().join(", ")
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
