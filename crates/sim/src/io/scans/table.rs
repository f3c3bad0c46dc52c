//! Scans from a table: a row for each velocity in any order, the grid recognised from the cells.
//!
//! Check: maps of a run, references, cells that are missing, twice there, or make no grid.

use super::grid::{mean_count, of_mean, scan_map};
use super::rays::{FoundRays, Ray, RaySweep};
use super::{Found, ReadScan, ScanFormat, WITHOUT_TIMES, planes};
use crate::io::UtcTime;
use crate::io::csv_input::{TextTable, comma_remark};
use crate::io::netcdf_input::quoted;
use crate::io::units::Quantity;
use crate::io::variable::{self, AZIMUTH, RANGE, RATIO, SIGMA, Times, VELOCITY, VariableNames};
use std::collections::BTreeMap;
use std::path::Path;

/// The velocity among the estimates of this program.
const OWN: &str = "v_mean_m_s";
/// Values of an axis that differ by less than this part of its mean step are the same.
const SAME: f64 = 1e-3;

/// A velocity of a table; NaN is what it does not say.
struct TableVelocity {
    /// Number of its row in the table, from 1.
    row: usize,
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
    let is_own = is_own(&table);
    let columns = Columns::new(&table, format, is_own)?;
    let mut sweeps: BTreeMap<u64, Vec<TableVelocity>> = BTreeMap::new();
    let mut without_elevation = 0;
    for row in 0..table.rows.len() {
        let sweep = columns.sweep(row)?;
        match columns.velocity(row)? {
            Some(velocity) => sweeps.entry(sweep).or_default().push(velocity),
            None => without_elevation += 1,
        }
    }
    if sweeps.is_empty() {
        return Err("it has a header and no rows with an elevation".into());
    }
    let scene_toml = Some(table.origin().scene_toml).filter(|text| !text.is_empty());
    let mut found = Found::default();
    if without_elevation > 0 {
        let all = table.rows.len();
        found.skipped.push(format!(
            "{without_elevation} of {all} rows have no elevation"
        ));
    }
    for (sweep, velocities) in sweeps {
        let what = format!("sweep {sweep}");
        let ((scans, skipped), range_m) = columns.split(&what, &velocities)?;
        let skipped = skipped.iter().map(|text| format!("{what}: {text}"));
        found.skipped.extend(skipped);
        for scan in scans {
            match scan_map(scan.rays, range_m.clone(), None, &what) {
                Err(reason) => found.skipped.push(reason),
                Ok(map) => found.scans.push(ReadScan {
                    azimuth_rad: scan.azimuth_rad,
                    reference: columns.times.reference,
                    scene_toml: scene_toml.clone(),
                    scans: mean_count(velocities.iter().map(|velocity| velocity.count)),
                    is_own,
                    ..ReadScan::new(path, sweep as usize, map)
                }),
            }
        }
    }
    found.warnings.extend(columns.times.not_understood);
    if let Some(text) = columns.times.rounded {
        // They have split the scans, which is all that they are good for.
        for scan in &mut found.scans {
            scan.map.time_s.fill(f64::NAN);
        }
        found.warnings.push(format!("{text}; {WITHOUT_TIMES}"));
    }
    Ok(found)
}

/// The rays of a table, sweep by sweep: rows of one direction and time that follow each other are one ray.
pub(super) fn rays_of_text(
    text: &str,
    path: &Path,
    format: &ScanFormat,
) -> Result<FoundRays, String> {
    let table = TextTable::parse(text)?;
    let is_own = is_own(&table);
    let columns = Columns::new(&table, format, is_own)?;
    if columns.azimuth_rad.is_none() {
        return Err(missing_column(&table, "azimuth_rad"));
    }
    let scene_toml = Some(table.origin().scene_toml).filter(|text| !text.is_empty());
    let mut sweeps: BTreeMap<u64, RaySweep> = BTreeMap::new();
    for row in 0..table.rows.len() {
        let sweep = columns.sweep(row)?;
        let Some(found) = columns.velocity(row)? else {
            continue;
        };
        let own = sweeps.entry(sweep).or_insert_with(|| RaySweep {
            path: path.to_owned(),
            sweep: sweep as usize,
            reference: columns.times.reference,
            scene_toml: scene_toml.clone(),
            has_status: columns.flagged.is_some(),
            gate_stride: 1,
            ..RaySweep::default()
        });
        let is_same_ray = own.rays.last().is_some_and(|ray| {
            let is_farther = ray
                .range_m
                .last()
                .is_some_and(|last_m| found.range_m > *last_m);
            let is_same_time = ray.time_s.to_bits() == found.time_s.to_bits();
            let is_same_direction =
                ray.azimuth_rad == found.azimuth_rad && ray.elevation_rad == found.elevation_rad;
            is_farther && is_same_time && is_same_direction
        });
        if !is_same_ray {
            own.rays.push(Ray {
                azimuth_rad: found.azimuth_rad,
                elevation_rad: found.elevation_rad,
                time_s: found.time_s,
                ..Ray::default()
            });
        }
        if let Some(ray) = own.rays.last_mut() {
            ray.range_m.push(found.range_m);
            ray.velocity_m_s.push(found.velocity_m_s);
            ray.sigma_m_s.extend(found.sigma_m_s);
        }
    }
    if sweeps.is_empty() {
        return Err("it has a header and no rows with an elevation".into());
    }
    let sweeps = sweeps.into_values().collect();
    let times = columns.times;
    let warnings = times.not_understood.into_iter().chain(times.rounded);
    Ok((sweeps, warnings.collect()))
}

/// Whether this program wrote a table. Programs that write it again keep the names of its columns.
fn is_own(table: &TextTable) -> bool {
    table.comment.trim_start().starts_with("source: wakescope ") || table.column(OWN).is_some()
}

/// The columns of a table that a scan needs, in SI.
struct Columns<'t> {
    table: &'t TextTable,
    format: &'t ScanFormat,
    /// Whether this program wrote the table.
    is_own: bool,
    velocity: usize,
    range: usize,
    elevation: usize,
    sweep: Option<usize>,
    flagged: Option<usize>,
    /// Scans of which each velocity is the mean.
    count: Option<usize>,
    range_m: Vec<f64>,
    elevation_rad: Vec<f64>,
    velocity_m_s: Vec<f64>,
    azimuth_rad: Option<Vec<f64>>,
    sigma_m_s: Option<Vec<f64>>,
    ratio_db: Option<Vec<f64>>,
    times: Times,
}

impl<'t> Columns<'t> {
    fn new(table: &'t TextTable, format: &'t ScanFormat, is_own: bool) -> Result<Self, String> {
        let velocity = match &format.field {
            Some(name) => {
                let column = table.column(name).ok_or_else(|| {
                    format!(
                        "it has no column {name}, which --field names; it has {}",
                        column_names(table)
                    )
                })?;
                let name = table.header[column].as_str();
                variable::refuse_other_than_velocity(table, name)?;
                name
            }
            None => needed_column(table, &VELOCITY, "velocity_m_s")?,
        };
        let named = table.header.iter().filter(|name| *name == velocity);
        if named.count() > 1 {
            return Err(format!(
                "it has more than one column {velocity}: one is needed"
            ));
        }
        let range = needed_column(table, &RANGE, "range_m")?;
        let range_m = variable::values(table, range, Quantity::Length)?;
        let (elevation, elevation_rad) = variable::elevations_rad(table)?
            .ok_or_else(|| missing_column(table, "elevation_rad"))?;
        let velocity_m_s = variable::values(table, velocity, Quantity::Velocity)?;
        let azimuth_rad = optional_column(table, &AZIMUTH, Quantity::Angle)?;
        let sigma_m_s = optional_column(table, &SIGMA, Quantity::Velocity)?;
        let times = variable::times(table, table.rows.len())?;
        let ratio_db = match (format.min_snr_db, variable::find(table, &RATIO)) {
            (None, _) => None,
            (Some(_), Some(name)) => Some(variable::ratio_db(table, name)?),
            (Some(_), None) => return Err(super::NO_RATIO.to_owned()),
        };
        let is_mean = velocity == OWN;
        Ok(Self {
            table,
            format,
            is_own,
            velocity: table.column(velocity).unwrap_or_default(),
            range: table.column(range).unwrap_or_default(),
            elevation: table.column(elevation).unwrap_or_default(),
            sweep: table.column("sweep").or_else(|| table.column("scan")),
            flagged: table.column("flagged"),
            count: table.column("count").filter(|_| is_mean),
            range_m,
            elevation_rad,
            velocity_m_s,
            azimuth_rad,
            sigma_m_s,
            ratio_db,
            times,
        })
    }

    /// Number of the sweep of a row; 0 in a table without sweeps.
    fn sweep(&self, row: usize) -> Result<u64, String> {
        let sweep = self
            .sweep
            .map_or(0.0, |column| self.table.number(row, column));
        match sweep >= 0.0 && sweep.fract() == 0.0 {
            true => Ok(sweep as u64),
            false => Err(format!("row {}: sweep is not a whole number", row + 1)),
        }
    }

    /// The velocity of a row; none of a row without an elevation. Numbers of this program's maps have the digits of their NetCDF
    /// files, single precision and angles in degrees, so that a fit gives the same result for both.
    fn velocity(&self, row: usize) -> Result<Option<TableVelocity>, String> {
        let number = row + 1;
        let cells = &self.table.rows[row];
        if is_missing(&cells[self.elevation]) {
            return Ok(None);
        }
        let range_m = self.rounded(self.range_m[row]);
        let mut elevation_rad = self.elevation_rad[row];
        if !(range_m.is_finite() && elevation_rad.is_finite()) {
            let cell = match range_m.is_finite() {
                true => &cells[self.elevation],
                false => &cells[self.range],
            };
            return Err(format!(
                "row {number}: its range or elevation is not a number: {}{}",
                quoted(cell),
                comma_remark(cell)
            ));
        }
        if self.is_own {
            elevation_rad = f64::from(elevation_rad.to_degrees() as f32).to_radians();
        }
        let velocity_m_s = self.rounded(self.velocity_m_s[row]);
        if velocity_m_s.is_nan() && !is_missing(&cells[self.velocity]) {
            let cell = &cells[self.velocity];
            return Err(format!(
                "row {number}: its velocity is not a number: {}; leave the cell of a missing one empty{}",
                quoted(cell),
                comma_remark(cell)
            ));
        }
        let count = self.count.map(|column| self.table.number(row, column));
        let sigma_m_s = self.sigma_m_s.as_ref();
        Ok(Some(TableVelocity {
            row: number,
            range_m,
            elevation_rad,
            azimuth_rad: self.azimuth_rad.as_ref().map_or(f64::NAN, |all| all[row]),
            time_s: self.times.time_s[row],
            velocity_m_s: match self.is_noise(row) {
                true => f64::NAN,
                false => self.format.sign() * velocity_m_s,
            },
            sigma_m_s: sigma_m_s.map(|all| of_mean(self.rounded(all[row]), count)),
            count: count.unwrap_or(f64::NAN),
        }))
    }

    /// The scans of the velocities of the sweep `what`, and the ranges of all, m.
    ///
    /// # Errors
    /// Velocities that make no grid, with what is not understood of their times where these could tell scans apart; no scans.
    fn split(
        &self,
        what: &str,
        velocities: &[TableVelocity],
    ) -> Result<(planes::Split, Vec<f64>), String> {
        let have_times = velocities.iter().all(|row| row.time_s.is_finite());
        let (split, range_m) = match grid(velocities, false) {
            Ok((rays, range_m)) => (planes::in_time_or_any_order(rays), range_m),
            // The same directions again, at other times: these alone tell the scans apart.
            Err(_) if have_times => {
                let remark = self.times.rounded.as_deref();
                let remark = remark.map_or(String::new(), |text| format!("; {text}"));
                let (rays, range_m) = grid(velocities, true).map_err(|reason| reason + &remark)?;
                (planes::in_time(rays), range_m)
            }
            Err(reason) if reason.contains("is there twice") => {
                return Err(reason + &self.time_remark());
            }
            Err(reason) => return Err(reason),
        };
        let split = split.map_err(|reason| format!("{what}: {reason}"))?;
        Ok((split, range_m))
    }

    /// What is not understood of the times, as the end of a message: their texts, or a column that seems to hold them.
    fn time_remark(&self) -> String {
        let words = ["time", "hour", "day", "date", "clock"];
        if let Some(text) = &self.times.not_understood {
            return format!("; {text}");
        }
        if self.times.time_s.iter().any(|time_s| time_s.is_finite()) {
            return String::new();
        }
        let mut columns = self.table.header.iter().enumerate();
        let found = columns.find(|(_, name)| {
            let lower = name.to_ascii_lowercase();
            words.iter().any(|word| lower.contains(word))
        });
        let Some((column, name)) = found else {
            return String::new();
        };
        let cell = self
            .table
            .rows
            .first()
            .map_or("", |row| row[column].as_str());
        format!(
            "; its column {} ({}) is not understood as a time: time_s, or time with dates such as {}, is needed",
            quoted(name),
            quoted(cell),
            UtcTime::FORM
        )
    }

    /// A number with the digits of this program's NetCDF files, in a table of this program.
    fn rounded(&self, value: f64) -> f64 {
        match self.is_own {
            true => f64::from(value as f32),
            false => value,
        }
    }

    /// Whether the velocity of a row is noise: by its signal-to-noise ratio, or by its flag.
    fn is_noise(&self, row: usize) -> bool {
        if let Some(ratio_db) = &self.ratio_db
            && self.format.is_noise(ratio_db[row])
        {
            return true;
        }
        let flagged = self.flagged.filter(|_| !self.format.ignores_status);
        flagged.is_some_and(|column| self.table.number(row, column) > 0.5)
    }
}

/// The column that is known by one of these names.
fn needed_column<'t>(
    table: &'t TextTable,
    known: &VariableNames,
    name: &str,
) -> Result<&'t str, String> {
    variable::find(table, known).ok_or_else(|| missing_column(table, name))
}

fn missing_column(table: &TextTable, name: &str) -> String {
    let numbered = table.header.iter().filter(|name| {
        let first = name.split_whitespace().next().unwrap_or_default();
        first.parse::<f64>().is_ok()
    });
    if numbered.count() > 2 {
        return format!(
            "its columns are named by numbers ({}): a row for each gate is needed, with range_m, elevation_deg and velocity_m_s",
            column_names(table)
        );
    }
    format!(
        "it has no column {name}: range_m, elevation_rad (or elevation_deg), velocity_m_s and, if known, time_s and sigma_m_s are \
         read, or other units in their names; it has {}",
        column_names(table)
    )
}

/// Values of a column that need not be there, in SI.
fn optional_column(
    table: &TextTable,
    known: &VariableNames,
    quantity: Quantity,
) -> Result<Option<Vec<f64>>, String> {
    match variable::find(table, known) {
        Some(name) => variable::values(table, name, quantity).map(Some),
        None => Ok(None),
    }
}

/// Whether a cell says that there is no number.
fn is_missing(cell: &str) -> bool {
    let words = ["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"];
    let text = cell.trim();
    words.iter().any(|word| text.eq_ignore_ascii_case(word))
}

/// The names of the first columns of a table.
fn column_names(table: &TextTable) -> String {
    let names = table.header.iter().take(8).map(|name| quoted(name));
    names.collect::<Vec<_>>().join(", ")
}

/// The rays of one sweep on the ranges of all, in the order in which they first come. Rows of one direction are one ray, or with
/// `at_one_time` those of one direction and time.
fn grid(rows: &[TableVelocity], at_one_time: bool) -> Result<(Vec<Ray>, Vec<f64>), String> {
    let range_m = axis(rows.iter().map(|row| row.range_m).collect());
    let elevation_rad = axis(rows.iter().map(|row| row.elevation_rad).collect());
    let gates = range_m.len();
    let mut lines: BTreeMap<(usize, u64, u64), usize> = BTreeMap::new();
    let mut line_of_row = Vec::with_capacity(rows.len());
    for row in rows {
        let elevation = nearest(&elevation_rad, row.elevation_rad);
        let next = lines.len();
        let time = if at_one_time { row.time_s } else { 0.0 };
        let line = lines.entry((elevation, row.azimuth_rad.to_bits(), time.to_bits()));
        line_of_row.push(*line.or_insert(next));
    }
    let lines = lines.len();
    if gates * lines > 10 * rows.len() + 1000 {
        return Err(format!(
            "its {} rows make no polar grid: they have {gates} different ranges and {lines} different directions",
            rows.len()
        ));
    }
    let has_sigma = rows.iter().any(|row| row.sigma_m_s.is_some());
    let empty = Ray {
        elevation_rad: f64::NAN,
        azimuth_rad: f64::NAN,
        time_s: f64::NAN,
        velocity_m_s: vec![f64::NAN; gates],
        sigma_m_s: if has_sigma {
            vec![f64::NAN; gates]
        } else {
            Vec::new()
        },
        ..Ray::default()
    };
    let mut rays = vec![empty; lines];
    let mut seen = vec![false; gates * lines];
    for (row, line) in rows.iter().zip(line_of_row) {
        let gate = nearest(&range_m, row.range_m);
        if std::mem::replace(&mut seen[line * gates + gate], true) {
            return Err(format!(
                "row {}: range {} m at elevation {} rad is there twice: a column sweep tells scans apart",
                row.row, row.range_m, row.elevation_rad
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
fn axis(mut all: Vec<f64>) -> Vec<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two scans of eight lines in seconds with a last column of times: the second of a line takes the place of `SS`.
    fn two_scans(header: &str, times: [&str; 2]) -> Result<Found, String> {
        let mut text = format!("range_m,elevation_deg,velocity_m_s,{header}\n");
        for (scan, time) in times.into_iter().enumerate() {
            for line in 0..8 {
                let time = time.replace("SS", &format!("{:02}", 10 + line));
                for gate in 0..8 {
                    let velocity_m_s = 0.37 * (scan + 2 * line + gate * gate) as f64;
                    let range_m = 100 + 10 * gate;
                    text += &format!("{range_m},{},{velocity_m_s},{time}\n", 2 + line);
                }
            }
        }
        scans(&text, Path::new("a.csv"), &ScanFormat::default())
    }

    #[test]
    fn times_of_a_german_date_tell_scans_apart() {
        let times = ["31.01.2024 23:59:SS.0", "01.02.2024 00:00:SS.0"];
        let found = two_scans("time", times).unwrap_or_else(|reason| panic!("{reason}"));
        assert_eq!(found.scans.len(), 2);
        let first_s = [0, 1].map(|scan| found.scans[scan].map.time_s[0]);
        assert_eq!(first_s[1] - first_s[0], 60.0);
    }

    #[test]
    fn times_that_had_32_bits_tell_scans_apart_and_are_unknown() {
        let found = two_scans("time_s", ["1706702464", "1706702592"]);
        let found = found.unwrap_or_else(|reason| panic!("{reason}"));
        assert_eq!(found.scans.len(), 2);
        let mut times = found.scans.iter().flat_map(|scan| &scan.map.time_s);
        assert!(times.all(|time_s| time_s.is_nan()));
        let said = &found.warnings[0];
        assert!(said.contains("differ by 128 s or not at all"), "{said}");
        let refused = two_scans("time_s", ["1706702464", "1706702464"]);
        let refused = refused.err().expect("equal times");
        assert!(
            refused.contains("is there twice") && refused.contains("128 s"),
            "{refused}"
        );
        let exact = two_scans("time_s", ["1706702465", "1706702593"]);
        assert!(exact.is_ok_and(|found| found.warnings.is_empty()));
    }

    #[test]
    fn scans_that_no_time_tells_apart_are_refused_with_the_times_that_are_not_understood() {
        for (header, times, said) in [
            (
                "time",
                ["11:59:SS PM", "12:00:SS AM"],
                "not understood (time: \"11:59:10 PM\")",
            ),
            (
                "Timestamp",
                ["01/31/2024 23:59:SS", "02/01/2024 00:00:SS"],
                "not understood (Timestamp: \"01/31/2024 23:59:10\")",
            ),
            (
                "day_of_year",
                ["31.99SS", "32.00SS"],
                "its column \"day_of_year\" (\"31.9910\") is not understood as a time",
            ),
        ] {
            let refused = two_scans(header, times).err().expect(header);
            assert!(refused.contains("is there twice"), "{refused}");
            assert!(refused.contains(said), "{refused}");
        }
        let refused = two_scans("quality", ["1", "1"]).err().expect("no times");
        assert!(refused.ends_with("tells scans apart"), "{refused}");
    }
}
