//! Scans from CfRadial 1.x by any writer, and from the groups of NetCDF-4 files that hold a sweep each (CfRadial 2, Windcube).
//!
//! A sweep is a scan if its elevations differ and its azimuths do not, whatever it calls itself; rays of another Nyquist velocity are
//! another scan. Variables are read as `variable` says. Check: maps of this program, and of Py-ART and xradar in the tests of the program;
//! files without Nyquist velocity, with ragged gates, another sign, several sweeps.

use super::gate_layout::GateLayout;
use super::grid::{mean_count, of_mean, scan_map};
use super::rays::{FoundRays, Ray, RaySweep};
use super::{Found, ReadScan, ScanFormat, WITHOUT_TIMES, planes};
use crate::io::netcdf_input::{NetcdfFile, quoted};
use crate::io::units::Quantity;
use crate::io::variable::{
    self, AZIMUTH, ELEVATION, NYQUIST, PULSE_WIDTH, RANGE, RATIO, SIGMA, TRANSITION, Times,
    VELOCITY, VariableNames, ZENITH,
};
use crate::io::{UtcTime, cfradial::MIRRORED};
use crate::machine;
use std::path::Path;

/// Whether a Windcube trusts a velocity; its times are those of the ends of rays.
const STATUS: &str = "radial_wind_speed_status";
/// Words of flags of velocities that are trusted.
const TRUSTED: [&str; 7] = [
    "good", "valid", "ok", "trusted", "reliable", "accepted", "usable",
];
/// Nyquist velocities that differ by less than this fraction are one.
const ONE_NYQUIST: f64 = 1e-3;
/// Ranges farther than this fraction of a gate from the middles of its bounds are not those of its middle.
const SAME_MIDDLE: f64 = 0.01;

/// The scans of a file or a group, and what was skipped; `sweep` is the number of its first sweep.
pub(super) fn scans(
    file: &NetcdfFile,
    path: &Path,
    format: &ScanFormat,
    sweep: usize,
) -> Result<Found, String> {
    let mut range_m = ranges(file)?;
    let velocity = velocity_name(file, format)?;
    let mut rays = Rays::read(file, format, &velocity, range_m.len())?;
    turn_falling(&mut range_m, &mut rays.rows);
    if let Some(text) = rays.rounded {
        rays.rows.iter_mut().for_each(|row| row.time_s = f64::NAN);
        rays.warnings.push(format!("{text}; {WITHOUT_TIMES}"));
    }
    let pulse_width_s = pulse_width(file)?;
    let place_deg = place(file)?;
    let scene_toml = scene_of(file, &velocity);
    let is_own = file
        .global_text("source")
        .is_some_and(|source| source.starts_with("wakescope "));
    let mut found = Found {
        warnings: rays.warnings,
        ..Found::default()
    };
    for (number, range) in rays.sweeps.into_iter().enumerate() {
        let number = number + sweep;
        let what = format!("sweep {number}");
        let known: Vec<usize> = range.filter(|ray| rays.is_still[*ray]).collect();
        for (fold_m_s, own) in by_fold(&known, &rays.rows) {
            let (scans, skipped) = match planes::in_order(own) {
                Ok(split) => split,
                Err(reason) => {
                    found.skipped.push(format!("{what}: {reason}"));
                    continue;
                }
            };
            let skipped = skipped.iter().map(|text| format!("{what}: {text}"));
            found.skipped.extend(skipped);
            for scan in scans {
                match scan_map(scan.rays, range_m.clone(), fold_m_s, &what) {
                    Err(reason) => found.skipped.push(reason),
                    Ok(map) => found.scans.push(ReadScan {
                        azimuth_rad: scan.azimuth_rad,
                        place_deg,
                        reference: rays.reference,
                        gate_length_m: gate_length_m(&range_m),
                        pulse_width_s,
                        scene_toml: scene_toml.map(str::to_owned),
                        is_own,
                        scans: rays.scans,
                        ..ReadScan::new(path, number, map)
                    }),
                }
            }
        }
    }
    Ok(found)
}

/// The rays of a file or a group, sweep by sweep; `sweep` is the number of its first sweep.
pub(super) fn rays(
    file: &NetcdfFile,
    path: &Path,
    format: &ScanFormat,
    sweep: usize,
) -> Result<FoundRays, String> {
    let mut ranges_m = ray_ranges(file, elevations_rad(file)?.len())?;
    let velocity = velocity_name(file, format)?;
    let gates = ranges_m.first().map_or(0, Vec::len);
    let mut rays = Rays::read(file, format, &velocity, gates)?;
    if let [common_m] = &mut ranges_m[..] {
        turn_falling(common_m, &mut rays.rows);
    }
    let place_deg = standing_place(file)?;
    let pulse_width_s = pulse_width(file)?;
    let scene_toml = scene_of(file, &velocity).map(str::to_owned);
    let mut sweeps = Vec::with_capacity(rays.sweeps.len());
    for (number, range) in rays.sweeps.into_iter().enumerate() {
        let mut own = Vec::with_capacity(range.len());
        for ray in range.filter(|ray| rays.is_still[*ray]) {
            own.push(Ray {
                range_m: ranges_m[ray.min(ranges_m.len() - 1)].clone(),
                ..rays.rows[ray].clone()
            });
        }
        sweeps.push(RaySweep {
            path: path.to_owned(),
            sweep: sweep + number,
            place_deg,
            reference: rays.reference,
            gate_length_m: gate_length_m(&ranges_m[0]),
            pulse_width_s,
            scene_toml: scene_toml.clone(),
            has_status: file.has(STATUS) || file.has("flagged"),
            gate_stride: 1,
            rays: own,
        });
    }
    rays.warnings.extend(rays.rounded);
    Ok((sweeps, rays.warnings))
}

/// The scene of a file of this program, whole or what other programs left of it.
fn scene_of<'f>(file: &'f NetcdfFile, velocity: &str) -> Option<&'f str> {
    file.global_text("scene")
        .or_else(|| file.text(velocity, "scene"))
        .or_else(|| file.text(velocity, "instrument"))
        .filter(|text| !text.is_empty())
}

/// Distance of the first two gates of known ranges, m.
fn gate_length_m(range_m: &[f64]) -> Option<f64> {
    let mut steps_m = range_m.windows(2).map(|pair| pair[1] - pair[0]);
    steps_m.find(|step_m| step_m.is_finite())
}

/// Ranges of the gates, m: those of all rays, or of each ray.
fn ray_ranges(file: &NetcdfFile, rays: usize) -> Result<Vec<Vec<f64>>, String> {
    let refused = match ranges(file) {
        Ok(common_m) if !common_m.is_empty() => return Ok(vec![common_m]),
        Ok(_) => return Err("variable range has no value".into()),
        Err(reason) => reason,
    };
    let name = variable::find(file, &RANGE).ok_or("it has no variable range")?;
    let range_m = variable::values(file, name, Quantity::Length)?;
    match file.shape(name).as_deref() {
        Some([first, gates]) if *first == rays as u64 && *gates > 0 => {
            let rows = range_m.chunks_exact(*gates as usize);
            Ok(rows.map(<[f64]>::to_vec).collect())
        }
        _ => Err(refused),
    }
}

/// Latitude and longitude of an instrument, degrees, if the file has them.
///
/// # Errors
/// An instrument that moves.
fn standing_place(file: &NetcdfFile) -> Result<Option<[f64; 2]>, String> {
    let mut place_deg = [f64::NAN; 2];
    for (name, place_deg) in ["latitude", "longitude"].into_iter().zip(&mut place_deg) {
        if !file.has(name) {
            continue;
        }
        let values = file.floats(name)?;
        let (low, high) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(*v), b.max(*v))
            });
        if high - low > planes::SAME_PLACE_DEG {
            return Err(format!(
                "its lidar moves, {name} from {low} to {high} degrees: winds are found from lidars that stand still"
            ));
        }
        *place_deg = values.first().copied().unwrap_or(f64::NAN);
    }
    Ok((place_deg[0] + place_deg[1])
        .is_finite()
        .then_some(place_deg))
}

/// Whether a file or a group has rays: angles up, in no unit of length as the elevation of a place has.
pub(super) fn has_rays(file: &NetcdfFile) -> bool {
    let name = variable::find(file, &ELEVATION).or_else(|| variable::find(file, &ZENITH));
    name.is_some_and(|name| {
        let units = file.text(name, "units").unwrap_or_default();
        units.is_empty() || Quantity::Length.si(units).is_err()
    })
}

/// Elevations of the rays, rad; one that all rays have is repeated for each azimuth.
fn elevations_rad(file: &NetcdfFile) -> Result<Vec<f64>, String> {
    let (_, mut elevation_rad) =
        variable::elevations_rad(file)?.ok_or("it has no variable elevation")?;
    if let [only_rad] = elevation_rad[..] {
        let shape = variable::find(file, &AZIMUTH).and_then(|name| file.shape(name));
        let azimuths = shape.map_or(1, |shape| shape.iter().product::<u64>());
        machine::holds("its rays", 100.0 * azimuths as f64)?;
        elevation_rad = vec![only_rad; azimuths as usize];
    }
    Ok(elevation_rad)
}

/// Turns ranges that fall from gate to gate round, with the velocities along them.
fn turn_falling(range_m: &mut [f64], rows: &mut [Ray]) {
    if range_m.len() < 2 || range_m.windows(2).any(|pair| pair[1] >= pair[0]) {
        return;
    }
    range_m.reverse();
    for row in rows {
        row.velocity_m_s.reverse();
        row.sigma_m_s.reverse();
    }
}

/// The rays of a file.
struct Rays {
    rows: Vec<Ray>,
    /// Whether the head did not move to another place during a ray.
    is_still: Vec<bool>,
    sweeps: Vec<std::ops::Range<usize>>,
    /// The date from which times count.
    reference: Option<UtcTime>,
    /// Scans of which velocities are means.
    scans: f64,
    warnings: Vec<String>,
    /// That times do not tell rays apart, in words.
    rounded: Option<String>,
}

impl Rays {
    fn read(
        file: &NetcdfFile,
        format: &ScanFormat,
        velocity: &str,
        gates: usize,
    ) -> Result<Self, String> {
        let elevation_rad = elevations_rad(file)?;
        let count = elevation_rad.len();
        let sweeps = sweeps(file, count)?;
        let azimuth_rad = ray_values(file, &AZIMUTH, Quantity::Angle, count, &sweeps)?
            .ok_or("it has no variable azimuth")?;
        let nyquist_m_s = ray_values(file, &NYQUIST, Quantity::Velocity, count, &sweeps)?;
        let moving = match variable::find(file, &TRANSITION) {
            Some(name) => Some(variable::of_rays(name, file.floats(name)?, count, &sweeps)?),
            None => None,
        };
        let times = times(file, count)?;
        let layout = GateLayout::new(file, velocity, [count, gates])?;
        let velocity_m_s = velocities_m_s(format, velocity, &layout)?;
        // The velocity may be the mean of several scans.
        let counts = match file.text(velocity, "cell_methods") {
            Some(methods) if methods.contains("realization: mean") => layout.optional("count")?,
            _ => None,
        };
        let sigma_m_s = sigmas_m_s(&layout, counts.as_deref())?;
        // Mirrored velocities are no multiple away from those of the air.
        let is_mirrored = variable::find(file, &NYQUIST)
            .and_then(|name| file.text(name, "folding"))
            .is_some_and(|folding| folding == MIRRORED);
        let nyquist_m_s = nyquist_m_s.filter(|_| !is_mirrored);
        let mut rows = Vec::with_capacity(count);
        let mut is_still = Vec::with_capacity(count);
        for ray in 0..count {
            let cells = ray * gates..(ray + 1) * gates;
            let sigma_m_s = sigma_m_s.as_ref().map(|all| all[cells.clone()].to_vec());
            let fold_m_s = nyquist_m_s.as_ref().map(|all| 2.0 * all[ray]);
            rows.push(Ray {
                elevation_rad: elevation_rad[ray],
                azimuth_rad: azimuth_rad[ray],
                time_s: times.time_s[ray],
                velocity_m_s: velocity_m_s[cells].to_vec(),
                sigma_m_s: sigma_m_s.unwrap_or_default(),
                fold_m_s: fold_m_s.filter(|fold| *fold > 0.0 && fold.is_finite()),
                ..Ray::default()
            });
            is_still.push(moving.as_ref().is_none_or(|moves| moves[ray] != 1.0));
        }
        Ok(Self {
            rows,
            is_still,
            sweeps,
            reference: times.reference,
            scans: mean_count(counts.iter().flatten().copied()),
            warnings: times.not_understood.into_iter().collect(),
            rounded: times.rounded,
        })
    }
}

/// Values of a variable for each ray, in SI, if the file has it.
fn ray_values(
    file: &NetcdfFile,
    known: &VariableNames,
    quantity: Quantity,
    rays: usize,
    sweeps: &[std::ops::Range<usize>],
) -> Result<Option<Vec<f64>>, String> {
    match variable::find(file, known) {
        Some(name) => {
            let values = variable::values(file, name, quantity)?;
            variable::of_rays(name, values, rays, sweeps).map(Some)
        }
        None => Ok(None),
    }
}

/// Rays of some numbers in groups of one Nyquist velocity, with the multiple of which their velocities may lack: its double, if it is known.
fn by_fold(numbers: &[usize], rays: &[Ray]) -> Vec<(Option<f64>, Vec<Ray>)> {
    let mut groups: Vec<(Option<f64>, Vec<Ray>)> = Vec::new();
    for number in numbers {
        let ray = rays[*number].clone();
        match groups
            .iter_mut()
            .find(|(fold, _)| is_one_fold(*fold, ray.fold_m_s))
        {
            Some((_, group)) => group.push(ray),
            None => groups.push((ray.fold_m_s, vec![ray])),
        }
    }
    groups
}

fn is_one_fold(fold_m_s: Option<f64>, other_m_s: Option<f64>) -> bool {
    match (fold_m_s, other_m_s) {
        (Some(fold), Some(other)) => (other / fold - 1.0).abs() < ONE_NYQUIST,
        (fold, other) => fold == other,
    }
}

/// Velocities of the gates of all rays, one ray after the other, m/s: positive away, NaN where they are noise or the instrument
/// flags them.
fn velocities_m_s(
    format: &ScanFormat,
    velocity: &str,
    layout: &GateLayout,
) -> Result<Vec<f64>, String> {
    let file = layout.file;
    let mut velocity_m_s = layout.spread(
        velocity,
        variable::values(file, velocity, Quantity::Velocity)?,
    )?;
    let status_of = |name: &str| match format.ignores_status {
        true => Ok(None),
        false => layout.optional(name),
    };
    // A fraction of realisations, or 0 and 1.
    let flagged = status_of("flagged")?;
    let status = status_of(STATUS)?;
    let trusted = match status {
        Some(_) => trusted_values(file)?,
        None => Vec::new(),
    };
    let ratio_db = match (format.min_snr_db, variable::find(file, &RATIO)) {
        (None, _) => None,
        (Some(_), Some(name)) => Some(layout.spread(name, variable::ratio_db(file, name)?)?),
        (Some(_), None) => return Err(super::NO_RATIO.to_owned()),
    };
    let sign = if variable::is_towards(file, velocity) {
        -1.0
    } else {
        format.sign()
    };
    for (at, value) in velocity_m_s.iter_mut().enumerate() {
        let is_noise = ratio_db
            .as_ref()
            .is_some_and(|ratios_db| format.is_noise(ratios_db[at]))
            || flagged.as_ref().is_some_and(|flagged| flagged[at] > 0.5)
            || status
                .as_ref()
                .is_some_and(|status| !trusted.contains(&status[at]));
        *value = if is_noise { f64::NAN } else { sign * *value };
    }
    Ok(velocity_m_s)
}

/// Values of the status where the instrument trusts its velocity: those that the file calls so, or else 1.
fn trusted_values(file: &NetcdfFile) -> Result<Vec<f64>, String> {
    let values = file.numbers(STATUS, "flag_values");
    let (Some(values), Some(meanings)) = (values, file.text(STATUS, "flag_meanings")) else {
        return Ok(vec![1.0]);
    };
    let mut trusted = Vec::new();
    for (value, meaning) in values.iter().zip(meanings.split_whitespace()) {
        let meaning = meaning.to_lowercase();
        let mut words = meaning.split(['_', '-']);
        if words.clone().all(|word| word != "not") && words.any(|word| TRUSTED.contains(&word)) {
            trusted.push(*value);
        }
    }
    if trusted.is_empty() {
        return Err(format!(
            "{STATUS} has flag_meanings = {}: none of {} among them",
            quoted(meanings),
            TRUSTED.join(", ")
        ));
    }
    Ok(trusted)
}

/// Standard deviations of the velocities, m/s, if the file has them; of means over scans as many as it counts.
fn sigmas_m_s(layout: &GateLayout, counts: Option<&[f64]>) -> Result<Option<Vec<f64>>, String> {
    let file = layout.file;
    let Some(name) = variable::find(file, &SIGMA) else {
        return Ok(None);
    };
    let values = variable::values(file, name, Quantity::Velocity)?;
    let mut sigma_m_s = layout.spread(name, values)?;
    for (cell, sigma_m_s) in sigma_m_s.iter_mut().enumerate() {
        *sigma_m_s = of_mean(*sigma_m_s, counts.map(|counts| counts[cell]));
    }
    Ok(Some(sigma_m_s))
}

/// The name of the variable that holds the velocities.
fn velocity_name(file: &NetcdfFile, format: &ScanFormat) -> Result<String, String> {
    let name = match &format.field {
        Some(name) if file.has(name) => {
            variable::refuse_other_than_velocity(file, name)?;
            name.clone()
        }
        Some(name) => return Err(format!("it has no variable {name}, which --field names")),
        None => variable::find(file, &VELOCITY)
            .map(str::to_owned)
            .ok_or_else(|| no_velocity(file))?,
    };
    if format.towards && variable::is_away(file, &name) {
        return Err(format!(
            "--towards: the standard name of its variable {name} says that velocities are positive away from the lidar"
        ));
    }
    Ok(name)
}

/// What is said of a file without a variable of velocities, or with one of a type that is not read.
fn no_velocity(file: &NetcdfFile) -> String {
    let unread = file.unread();
    let unread = match unread.first() {
        Some(name) => format!(
            "; its variable {name} is of a type that is not read: store it as 32-bit floats"
        ),
        None => String::new(),
    };
    format!(
        "it has no radial velocity: none of its variables has that standard name or a usual name; --field names it{unread}"
    )
}

/// Ranges of the centres of the gates, m, which are those of all rays.
fn ranges(file: &NetcdfFile) -> Result<Vec<f64>, String> {
    let name = variable::find(file, &RANGE).ok_or("it has no variable range")?;
    let range_m = variable::values(file, name, Quantity::Length)?;
    let mut shape = file.shape(name).unwrap_or_default();
    shape.retain(|length| *length != 1);
    match shape[..] {
        [_, gates] => same_rows(name, &range_m, gates as usize),
        [] | [_] => within_bounds(file, name, range_m),
        _ => Err(format!("variable {name} has more than two dimensions")),
    }
}

/// The middles of gates whose edges the file has (the attribute `bounds` of CF), where its ranges are others, such as those of their
/// starts. Edges between which their ranges do not lie are not used.
///
/// # Errors
/// Edges that cannot be read.
fn within_bounds(file: &NetcdfFile, name: &str, range_m: Vec<f64>) -> Result<Vec<f64>, String> {
    let shape = [range_m.len() as u64, 2];
    let bounds = file.text(name, "bounds");
    let Some(bounds) = bounds.filter(|name| file.shape(name).is_some_and(|own| own == shape))
    else {
        return Ok(range_m);
    };
    // Edges have the unit of their ranges unless they state one.
    let of_unit = file.text(bounds, "units").map_or(name, |_| bounds);
    let unit_m = file.unit(of_unit, Quantity::Length)?;
    let edges = file.floats(bounds)?;
    let mut middles_m = Vec::with_capacity(range_m.len());
    let mut is_off = false;
    for (own_m, edges) in range_m.iter().zip(edges.chunks_exact(2)) {
        let low_m = unit_m * edges[0].min(edges[1]);
        let high_m = unit_m * edges[0].max(edges[1]);
        let middle_m = 0.5 * (low_m + high_m);
        let error_m = SAME_MIDDLE * (high_m - low_m);
        if !(low_m - error_m..=high_m + error_m).contains(own_m) {
            return Ok(range_m);
        }
        is_off |= (middle_m - own_m).abs() > error_m;
        middles_m.push(middle_m);
    }
    Ok(if is_off { middles_m } else { range_m })
}

/// The one row that a variable repeats for each ray; rows without a value are passed over.
fn same_rows(name: &str, values: &[f64], gates: usize) -> Result<Vec<f64>, String> {
    let mut rows = values
        .chunks_exact(gates.max(1))
        .filter(|row| row.iter().all(|value| value.is_finite()));
    let first = rows.next().unwrap_or_default();
    if rows.all(|row| are_same(row, first)) {
        return Ok(first.to_vec());
    }
    // The ranges along the first dimension.
    match is_constant(values, gates) {
        true => Ok(values.iter().step_by(gates).copied().collect()),
        false => Err(format!(
            "{name} has two dimensions: gates that are the same for all rays are needed"
        )),
    }
}

fn are_same(row: &[f64], other: &[f64]) -> bool {
    let mut pairs = row.iter().zip(other);
    pairs.all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs())
}

/// Whether each row is one value.
fn is_constant(values: &[f64], gates: usize) -> bool {
    values
        .chunks_exact(gates)
        .all(|row| row.iter().all(|value| *value == row[0]))
}

/// Times of the middles of the rays.
fn times(file: &NetcdfFile, count: usize) -> Result<Times, String> {
    let mut times = variable::times(file, count)?;
    if file.has(STATUS) {
        let mut steps: Vec<f64> = times
            .time_s
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect();
        steps.sort_by(f64::total_cmp);
        let half_s = 0.5 * steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        times.time_s.iter_mut().for_each(|time_s| *time_s -= half_s);
    }
    Ok(times)
}

/// The rays of each sweep.
fn sweeps(file: &NetcdfFile, count: usize) -> Result<Vec<std::ops::Range<usize>>, String> {
    let start = "sweep_start_ray_index";
    let end = "sweep_end_ray_index";
    if !(file.has(start) && file.has(end)) {
        return Ok(std::iter::once(0..count).collect());
    }
    let starts = file.floats(start)?;
    let ends = file.floats(end)?;
    let last = count.max(1) - 1;
    let mut sweeps = Vec::with_capacity(starts.len());
    for (start, end) in starts.into_iter().zip(ends) {
        if !(0.0 <= start && start <= end && end < count as f64) {
            let sweep = sweeps.len();
            return Err(format!(
                "sweep {sweep} goes from ray {start} to ray {end}; the file has rays 0 to {last}"
            ));
        }
        sweeps.push(start as usize..end as usize + 1);
    }
    Ok(sweeps)
}

/// The duration of a pulse, s: the first one above 0, if the file has any.
fn pulse_width(file: &NetcdfFile) -> Result<Option<f64>, String> {
    let Some(name) = variable::find(file, &PULSE_WIDTH) else {
        return Ok(None);
    };
    let values = variable::values(file, name, Quantity::Time)?;
    Ok(values
        .first()
        .copied()
        .filter(|value| *value > 0.0 && value.is_finite()))
}

/// Latitude and longitude of an instrument that does not move, degrees; nothing where they are missing or change from ray to ray.
fn place(file: &NetcdfFile) -> Result<Option<[f64; 2]>, String> {
    let [latitude, longitude] = ["latitude", "longitude"].map(|name| match file.has(name) {
        true => file.floats(name),
        false => Ok(Vec::new()),
    });
    match (&latitude?[..], &longitude?[..]) {
        ([latitude], [longitude]) if (latitude + longitude).is_finite() => {
            Ok(Some([*latitude, *longitude]))
        }
        _ => Ok(None),
    }
}

#[cfg(test)]
#[path = "cfradial_tests.rs"]
mod tests;
