//! Scans from CfRadial 1.x by any writer, and from the groups of NetCDF-4 files that hold a sweep each (CfRadial 2, Windcube).
//!
//! A sweep is a scan if its elevations differ and its azimuths do not, whatever it calls itself. Velocities are found by their
//! standard names, which say the sign, or by the names that instruments use. Check: maps of this program, and of Py-ART and
//! xradar in the tests of the program; files without Nyquist velocity, with ragged gates, another sign, several sweeps.

use super::grid::{RayRow, mean_count, of_mean, scan_map};
use super::{Found, ReadScan, ScanFormat, planes};
use crate::io::netcdf_input::NetcdfFile;
use crate::io::units::Quantity;
use crate::io::{UtcTime, cfradial::MIRRORED};
use crate::machine;
use std::path::Path;

const AWAY: &str = "radial_velocity_of_scatterers_away_from_instrument";
const TOWARDS: &str = "radial_velocity_of_scatterers_toward_instrument";
/// Names of the velocity where no standard name says it, positive away.
const VELOCITIES: &str = "radial_velocity velocity radial_wind_speed VEL VR VRAD VRADH doppler_velocity mean_doppler_velocity";
/// Names of its standard deviation.
const SIGMAS: [&str; 4] = [
    "velocity_standard_deviation",
    "sigma_m_s",
    "radial_velocity_error",
    "velocity_error",
];
/// Whether a Windcube trusts a velocity; its times are those of the ends of rays.
const STATUS: &str = "radial_wind_speed_status";
/// The largest velocity that can be told apart, m/s: that of the first ray is taken.
const NYQUIST: &str = "nyquist_velocity";
/// Names of the signal-to-noise ratio in dB.
const RATIOS: [&str; 4] = ["signal_to_noise_ratio", "SNR", "snr", "cnr"];

/// The scans of a file or a group, and what was left out; `sweep` is the number of its first sweep.
pub(super) fn scans(
    file: &NetcdfFile,
    path: &Path,
    format: &ScanFormat,
    sweep: usize,
) -> Result<Found, String> {
    let (range_m, velocity) = (ranges(file)?, Field::velocity(file, format)?);
    let (rays, reference, scans) = rays(file, format, &velocity, range_m.len())?;
    let moving = optional(file, "antenna_transition")?;
    // Mirrored velocities are no multiple away from those of the air.
    let is_mirrored = file
        .text(NYQUIST, "folding")
        .is_some_and(|folding| folding == MIRRORED);
    let fold_m_s = if is_mirrored {
        None
    } else {
        first(file, NYQUIST)?.map(|nyquist| 2.0 * nyquist)
    };
    let pulse_width_s = first(file, "pulse_width")?;
    let place_deg = place(file)?;
    let of_field = |name| file.text(&velocity.name, name);
    let scene_toml = file
        .global_text("scene")
        .or_else(|| of_field("scene"))
        .or_else(|| of_field("instrument"));
    let is_own = file
        .global_text("source")
        .is_some_and(|source| source.starts_with("wakescope "));
    let (mut out, mut left_out) = (Vec::new(), Vec::new());
    for (number, range) in sweeps(file, rays.len())?.into_iter().enumerate() {
        let number = number + sweep;
        let what = format!("sweep {number}");
        let is_still = |ray: &usize| moving.get(*ray).is_none_or(|moves| *moves != 1.0);
        let rows: Vec<RayRow> = range
            .filter(is_still)
            .map(|ray| rays[ray].clone())
            .collect();
        let (found, skipped) = match planes::in_order(rows) {
            Ok(split) => split,
            Err(reason) => {
                left_out.push(format!("{what}: {reason}"));
                continue;
            }
        };
        left_out.extend(skipped.iter().map(|text| format!("{what}: {text}")));
        for scan in found {
            match scan_map(scan.rays, range_m.clone(), fold_m_s, &what) {
                Err(reason) => left_out.push(reason),
                Ok(map) => out.push(ReadScan {
                    azimuth_rad: scan.azimuth_rad,
                    place_deg,
                    reference,
                    gate_length_m: range_m.get(1).map(|second_m| second_m - range_m[0]),
                    pulse_width_s,
                    scene_toml: scene_toml.map(str::to_owned),
                    is_own,
                    scans,
                    ..ReadScan::new(path, number, map)
                }),
            }
        }
    }
    Ok((out, left_out))
}

/// All rays, the date from which their times count, and the scans of which their velocities are means.
fn rays(
    file: &NetcdfFile,
    format: &ScanFormat,
    velocity: &Field,
    gates: usize,
) -> Result<(Vec<RayRow>, Option<UtcTime>, f64), String> {
    let (elevation_rad, azimuth_rad) = (angles(file, "elevation")?, angles(file, "azimuth")?);
    let count = elevation_rad.len();
    if azimuth_rad.len() != count {
        return Err(format!(
            "azimuth has {} values, elevation {count}: one for each ray",
            azimuth_rad.len()
        ));
    }
    let (time_s, reference) = times(file, count)?;
    let layout = GateLayout::new(file, &velocity.name, count, gates)?;
    let velocity_m_s = layout.read(file, &velocity.name)?;
    // A fraction of realisations, or 0 and 1.
    let flagged = layout.optional(file, &["flagged"])?;
    // 1 where the instrument trusts its velocity.
    let status = layout.optional(file, &[STATUS])?;
    let ratio_db = if format.min_snr_db.is_some() {
        layout.optional(file, &RATIOS)?
    } else {
        None
    };
    let sigma_m_s = layout.optional(file, &SIGMAS)?;
    let realisations = if velocity.is_mean {
        layout.optional(file, &["count"])?
    } else {
        None
    };
    let known = |at: usize| {
        let is_noise = ratio_db
            .as_ref()
            .is_some_and(|ratios_db| format.is_noise(ratios_db[at]))
            || flagged.as_ref().is_some_and(|flagged| flagged[at] > 0.5)
            || status.as_ref().is_some_and(|status| status[at] != 1.0);
        if is_noise {
            f64::NAN
        } else {
            velocity.sign * velocity_m_s[at]
        }
    };
    let ray = |ray: usize| {
        let cells = ray * gates..(ray + 1) * gates;
        let sigma = |sigma_m_s: &Vec<f64>| {
            let of =
                |at: usize| of_mean(sigma_m_s[at], realisations.as_ref().map(|count| count[at]));
            cells.clone().map(of).collect()
        };
        RayRow {
            elevation_rad: elevation_rad[ray],
            azimuth_rad: azimuth_rad[ray],
            time_s: time_s[ray],
            sigma_m_s: sigma_m_s.as_ref().map(sigma).unwrap_or_default(),
            velocity_m_s: cells.map(known).collect(),
        }
    };
    Ok((
        (0..count).map(ray).collect(),
        reference,
        mean_count(realisations.iter().flatten().copied()),
    ))
}

/// The variable that holds the velocities.
struct Field {
    name: String,
    /// 1 for velocities in m/s that are positive away from the lidar.
    sign: f64,
    /// Whether it is the mean of several scans.
    is_mean: bool,
}

impl Field {
    fn velocity(file: &NetcdfFile, format: &ScanFormat) -> Result<Self, String> {
        let standard = |name: &str| file.text(name, "standard_name").unwrap_or_default();
        let name = match &format.field {
            Some(name) if file.has(name) => name.clone(),
            Some(name) => return Err(format!("it has no variable {name}, which --field names")),
            None => {
                let known = VELOCITIES
                    .split(' ')
                    .find(|name| file.has(name))
                    .map(str::to_owned);
                let by_standard = || {
                    file.names()
                        .find(|name| [AWAY, TOWARDS].contains(&standard(name)))
                        .map(str::to_owned)
                };
                known.or_else(by_standard).ok_or(
                    "it has no radial velocity: none of its variables has that standard name or a usual name; --field names it",
                )?
            }
        };
        let unit_m_s = file.unit(&name, Quantity::Velocity)?;
        let is_towards = standard(&name) == TOWARDS || format.towards;
        let is_mean = file
            .text(&name, "cell_methods")
            .is_some_and(|methods| methods.contains("realization: mean"));
        Ok(Self {
            name,
            sign: if is_towards { -unit_m_s } else { unit_m_s },
            is_mean,
        })
    }
}

/// How the gates of the rays stand in a variable: \[time, range\], or one ray after the other, each with its own number of gates.
struct GateLayout {
    /// Where each ray begins, and its gates.
    rays: Vec<(usize, usize)>,
    gates: usize,
    /// Whether all rays have all gates.
    is_full: bool,
}

impl GateLayout {
    fn new(file: &NetcdfFile, name: &str, rays: usize, gates: usize) -> Result<Self, String> {
        let shape = file.shape(name).unwrap_or_default();
        match &shape[..] {
            [a, b] if (*a, *b) == (rays as u64, gates as u64) => Ok(Self {
                rays: (0..rays).map(|ray| (ray * gates, gates)).collect(),
                gates,
                is_full: true,
            }),
            [a, b] => Err(format!(
                "variable {name} is {a} x {b}; {rays} rays x {gates} ranges are needed"
            )),
            [_] if file.has("ray_start_index") && file.has("ray_n_gates") => {
                let whole = |name: &str| -> Result<Vec<usize>, String> {
                    let values = file.floats(name)?;
                    let bad = values.iter().any(|v| !(*v >= 0.0 && *v < 1e9));
                    match bad || values.len() != rays {
                        true => Err(format!("{name} must have a whole number for each ray")),
                        false => Ok(values.into_iter().map(|v| v as usize).collect()),
                    }
                };
                let own: Vec<_> = whole("ray_start_index")?
                    .into_iter()
                    .zip(whole("ray_n_gates")?)
                    .collect();
                if let Some((_, count)) = own.iter().find(|(_, count)| *count > gates) {
                    return Err(format!("a ray has {count} gates, range {gates} values"));
                }
                // Velocities, what stands beside them, and the lines of the map.
                machine::holds(
                    &format!("{rays} rays x {gates} ranges"),
                    40.0 * rays as f64 * gates as f64,
                )?;
                Ok(Self {
                    rays: own,
                    gates,
                    is_full: false,
                })
            }
            _ => Err(format!(
                "variable {name} has {} dimensions; [time, range] are needed",
                shape.len()
            )),
        }
    }

    /// The values \[ray, gate\], one ray after the other.
    fn read(&self, file: &NetcdfFile, name: &str) -> Result<Vec<f64>, String> {
        let (values, rays, gates) = (file.floats(name)?, self.rays.len(), self.gates);
        let count = values.len();
        if self.is_full && count != rays * gates {
            return Err(format!(
                "variable {name} has {count} values; {rays} rays x {gates} ranges are needed"
            ));
        }
        let mut out = vec![f64::NAN; rays * gates];
        for (ray, (start, count)) in self.rays.iter().enumerate() {
            let own = values.get(*start..start + count);
            let own =
                own.ok_or_else(|| format!("variable {name} ends before the gates of ray {ray}"))?;
            out[ray * gates..ray * gates + count].copy_from_slice(own);
        }
        Ok(out)
    }

    /// The first of some variables that is there.
    fn optional(&self, file: &NetcdfFile, names: &[&str]) -> Result<Option<Vec<f64>>, String> {
        match names.iter().find(|name| file.has(name)) {
            Some(name) => self.read(file, name).map(Some),
            None => Ok(None),
        }
    }
}

/// An angle of each ray, rad; NaN where it is missing.
fn angles(file: &NetcdfFile, name: &str) -> Result<Vec<f64>, String> {
    let units = file
        .text(name, "units")
        .unwrap_or_default()
        .to_ascii_lowercase();
    let values = file.floats(name)?;
    match units.starts_with("rad") {
        true => Ok(values),
        false => Ok(values.into_iter().map(f64::to_radians).collect()),
    }
}

/// Ranges of the centres of the gates, m.
fn ranges(file: &NetcdfFile) -> Result<Vec<f64>, String> {
    let unit_m = file.unit("range", Quantity::Length)?;
    // One row for each ray where gates differ.
    if file.shape("range").is_some_and(|shape| shape.len() > 1) {
        return Err(
            "range has two dimensions: gates that are the same for all rays are needed".into(),
        );
    }
    Ok(file
        .floats("range")?
        .into_iter()
        .map(|range| unit_m * range)
        .collect())
}

/// Times of the rays in s, and the date from which they count.
fn times(file: &NetcdfFile, count: usize) -> Result<(Vec<f64>, Option<UtcTime>), String> {
    if !file.has("time") {
        return Ok((vec![f64::NAN; count], None));
    }
    let units = file.text("time", "units").unwrap_or_default();
    let since = units.split_once(" since ").map_or("", |(_, since)| since);
    // 2024-01-31T12:00:00Z, or with a blank, without the time, with parts of a second or another zone at the end.
    let mut text = since.trim().replace(' ', "T");
    text.truncate(text.char_indices().nth(19).map_or(text.len(), |(at, _)| at));
    if text.len() == 10 {
        text += "T00:00:00";
    }
    let reference = UtcTime::parse(&format!("{text}Z"));
    let mut time_s = file.seconds("time")?;
    if file.has(STATUS) {
        let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let half_s = 0.5 * steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        time_s.iter_mut().for_each(|time_s| *time_s -= half_s);
    }
    match time_s.len() {
        found if found == count => Ok((time_s, reference)),
        found => Err(format!(
            "time has {found} values, elevation {count}: one for each ray"
        )),
    }
}

/// The rays of each sweep.
fn sweeps(file: &NetcdfFile, count: usize) -> Result<Vec<std::ops::Range<usize>>, String> {
    let (start, end) = ("sweep_start_ray_index", "sweep_end_ray_index");
    if !(file.has(start) && file.has(end)) {
        return Ok(std::iter::once(0..count).collect());
    }
    let (starts, ends, last) = (file.floats(start)?, file.floats(end)?, count.max(1) - 1);
    let range = |(sweep, (start, end)): (usize, (&f64, &f64))| match 0.0 <= *start
        && start <= end
        && *end < count as f64
    {
        true => Ok(*start as usize..*end as usize + 1),
        false => Err(format!(
            "sweep {sweep} goes from ray {start} to ray {end}; the file has rays 0 to {last}"
        )),
    };
    starts.iter().zip(&ends).enumerate().map(range).collect()
}

/// The values of a variable; none where it is not there.
fn optional(file: &NetcdfFile, name: &str) -> Result<Vec<f64>, String> {
    if file.has(name) {
        file.floats(name)
    } else {
        Ok(Vec::new())
    }
}

/// Latitude and longitude of an instrument that stands, degrees; nothing where they are missing or change from ray to ray.
fn place(file: &NetcdfFile) -> Result<Option<[f64; 2]>, String> {
    let [latitude, longitude] = ["latitude", "longitude"].map(|name| optional(file, name));
    match (&latitude?[..], &longitude?[..]) {
        ([latitude], [longitude]) if (latitude + longitude).is_finite() => {
            Ok(Some([*latitude, *longitude]))
        }
        _ => Ok(None),
    }
}

/// The first value of a variable, if it is there and above 0.
fn first(file: &NetcdfFile, name: &str) -> Result<Option<f64>, String> {
    Ok(optional(file, name)?
        .first()
        .copied()
        .filter(|value| *value > 0.0 && value.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::netcdf::{self, Data};
    use crate::io::netcdf_input::open;
    use crate::io::provenance::example;
    use std::collections::BTreeMap;

    /// Variables with their lengths, text attributes and values.
    #[derive(Default)]
    struct Made(BTreeMap<&'static str, Variable>);

    type Variable = (Vec<u64>, Vec<(&'static str, &'static str)>, Vec<f64>);

    impl Made {
        /// A file that holds them. Dimensions are called by their lengths; many values are zeros, in a byte each.
        fn open(&self) -> NetcdfFile {
            let (mut dims, mut variables) = (Vec::new(), Vec::new());
            for (name, (shape, attributes, values)) in &self.0 {
                let shape = if shape.len() == 1 {
                    vec![values.len() as u64]
                } else {
                    shape.clone()
                };
                let mut own: Vec<&'static str> = Vec::new();
                for length in &shape {
                    own.push(format!("of_{length}").leak());
                    if !dims.contains(&(own[own.len() - 1], *length as usize)) {
                        dims.push((own[own.len() - 1], *length as usize));
                    }
                }
                let mut values = values.clone();
                values.resize(shape.iter().product::<u64>() as usize, 0.0);
                let are_zero = values.len() > 1_000_000 && values.iter().all(|value| *value == 0.0);
                let data = if are_zero {
                    Data::i8(vec![0; values.len()])
                } else {
                    Data::f64(values)
                };
                let variable = netcdf::Variable::new(name, own.leak(), data);
                variables.push(
                    attributes
                        .iter()
                        .fold(variable, |variable, (name, text)| variable.text(name, text)),
                );
            }
            let layout = netcdf::Layout {
                dims,
                globals: Vec::new(),
                variables,
            };
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), layout.into_bytes(&example()).unwrap()).unwrap();
            open(file.path()).unwrap()
        }
    }

    const RAYS: usize = 12;
    const GATES: usize = 6;

    /// Two sweeps of six rays, the second one in azimuth, without Nyquist velocity.
    fn made() -> Made {
        let mut made = Made::default();
        let velocity: Vec<f64> = (0..RAYS * GATES).map(|i| i as f64 * 0.1).collect();
        let up = (0..RAYS).map(|ray| 2.0 + (ray % 6) as f64);
        let round = (0..RAYS).map(|ray| {
            if ray < 6 {
                359.9 + 0.02 * ray as f64
            } else {
                30.0 * ray as f64
            }
        });
        let ray = |values: Vec<f64>| (vec![RAYS as u64], vec![("units", "degrees")], values);
        made.0.insert("elevation", ray(up.collect()));
        made.0
            .insert("azimuth", ray(round.map(|a| a % 360.0).collect()));
        let units = vec![("units", "seconds since 2024-01-31 12:00:00.5 +00:00")];
        made.0.insert(
            "time",
            (
                vec![RAYS as u64],
                units,
                (0..RAYS).map(|i| i as f64).collect(),
            ),
        );
        made.0.insert(
            "range",
            (
                vec![GATES as u64],
                vec![("units", "km")],
                (0..GATES).map(|i| 0.3 + 0.01 * i as f64).collect(),
            ),
        );
        made.0
            .insert("sweep_start_ray_index", (vec![2], vec![], vec![0.0, 6.0]));
        made.0
            .insert("sweep_end_ray_index", (vec![2], vec![], vec![5.0, 11.0]));
        made.0.insert(
            "VEL",
            (
                vec![RAYS as u64, GATES as u64],
                vec![("units", "m/s"), ("standard_name", AWAY)],
                velocity,
            ),
        );
        made
    }

    fn read(made: &Made) -> Result<(Vec<ReadScan>, Vec<String>), String> {
        scans(&made.open(), Path::new("x.nc"), &ScanFormat::default(), 0)
    }

    #[test]
    fn the_sweep_in_elevation_is_read_and_others_are_told() {
        let (found, left_out) = read(&made()).unwrap();
        assert_eq!((found.len(), left_out.len()), (1, 1));
        assert!(
            left_out[0].contains("sweep 1") && left_out[0].contains("azimuths"),
            "{left_out:?}"
        );
        let map = &found[0].map;
        assert_eq!(
            (
                map.velocity_m_s.dim(),
                map.fold_m_s,
                map.velocity_m_s[[5, 5]]
            ),
            ((6, 6), None, 3.5)
        );
        assert!(
            (map.range_m[1] - 310.0).abs() < 1e-9
                && (map.elevation_rad[0] - 2f64.to_radians()).abs() < 1e-12
        );
        assert_eq!(
            found[0].reference.unwrap().to_string(),
            "2024-01-31T12:00:00Z"
        );
    }

    #[test]
    fn rays_without_an_elevation_are_skipped_and_counted() {
        let mut made = made();
        made.0.get_mut("elevation").unwrap().2[3] = f64::NAN;
        let (found, left_out) = read(&made).unwrap();
        assert_eq!(found[0].map.elevation_rad.len(), 5);
        assert!(
            left_out[0].contains("sweep 0: 1 of 6 rays have no elevation"),
            "{left_out:?}"
        );
    }

    #[test]
    fn sign_folds_masks_and_ragged_gates_follow_the_file() {
        let mut towards = made();
        let (shape, _, values) = towards.0.remove("VEL").unwrap();
        towards.0.insert(
            "speed",
            (shape, vec![("standard_name", TOWARDS)], values.clone()),
        );
        towards.0.insert(
            "nyquist_velocity",
            (vec![RAYS as u64], vec![], vec![12.0; RAYS]),
        );
        let moving = (0..RAYS).map(|ray| f64::from(u8::from(ray == 2))).collect();
        towards
            .0
            .insert("antenna_transition", (vec![RAYS as u64], vec![], moving));
        let map = read(&towards).unwrap().0.remove(0).map;
        assert_eq!(
            (
                map.velocity_m_s[[4, 5]],
                map.fold_m_s,
                map.elevation_rad.len()
            ),
            (-3.5, Some(24.0), 5)
        );
        // Real currents are mirrored: no multiple is lost.
        towards.0.insert(
            "nyquist_velocity",
            (
                vec![RAYS as u64],
                vec![("folding", MIRRORED)],
                vec![12.0; RAYS],
            ),
        );
        assert_eq!(read(&towards).unwrap().0.remove(0).map.fold_m_s, None);
        // The same gates one ray after the other, the last gate of the first ray missing.
        let mut ragged = made();
        let own = values
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != 5)
            .map(|(_, v)| *v)
            .collect::<Vec<_>>();
        let starts = (0..RAYS)
            .map(|ray| {
                if ray == 0 {
                    0.0
                } else {
                    (ray * GATES - 1) as f64
                }
            })
            .collect();
        let counts = (0..RAYS)
            .map(|ray| if ray == 0 { 5.0 } else { 6.0 })
            .collect();
        ragged
            .0
            .insert("VEL", (vec![own.len() as u64], vec![], own));
        ragged
            .0
            .insert("ray_start_index", (vec![RAYS as u64], vec![], starts));
        ragged
            .0
            .insert("ray_n_gates", (vec![RAYS as u64], vec![], counts));
        let map = read(&ragged).unwrap().0.remove(0).map;
        assert!(
            map.velocity_m_s[[0, 5]].is_nan()
                && map.velocity_m_s[[0, 4]] == 0.4
                && map.velocity_m_s[[5, 5]] == 3.5
        );
    }

    /// Rays of different lengths can ask for far more than the file holds.
    #[test]
    fn gates_that_no_memory_holds_are_refused_before_they_are_made() {
        const MANY: usize = 3_000_000;
        let mut made = made();
        let many = |value: f64| (vec![MANY as u64], vec![], vec![value; MANY]);
        for name in [
            "elevation",
            "azimuth",
            "time",
            "ray_start_index",
            "ray_n_gates",
            "VEL",
        ] {
            made.0.insert(name, many(0.0));
        }
        made.0.insert(
            "range",
            (
                vec![MANY as u64],
                vec![],
                (0..MANY).map(|i| i as f64).collect(),
            ),
        );
        let refused = read(&made).unwrap_err();
        assert!(
            refused.contains("3000000 rays x 3000000 ranges would take"),
            "{refused}"
        );
    }

    #[test]
    fn what_contradicts_itself_is_refused_by_name() {
        let refused = |change: &dyn Fn(&mut Made)| {
            let mut made = made();
            change(&mut made);
            read(&made).unwrap_err()
        };
        assert!(
            refused(&|m| m.0.get_mut("VEL").unwrap().0 = vec![7, 6])
                .contains("VEL is 7 x 6; 12 rays x 6 ranges")
        );
        assert!(refused(&|m| drop(m.0.remove("VEL"))).contains("no radial velocity"));
        assert!(refused(&|m| drop(m.0.remove("elevation"))).contains("elevation"));
        assert!(
            refused(&|m| m.0.get_mut("VEL").unwrap().1 = vec![("units", "furlongs")])
                .contains("units of VEL")
        );
        assert!(
            refused(&|m| m.0.get_mut("time").unwrap().2 = vec![0.0]).contains("time has 1 values")
        );
        assert!(
            refused(&|m| m.0.get_mut("sweep_end_ray_index").unwrap().2 = vec![5.0, 99.0])
                .contains("ray 99")
        );
        let all_missing = |m: &mut Made| m.0.get_mut("VEL").unwrap().2.fill(f64::NAN);
        let (found, left_out) = {
            let mut made = made();
            all_missing(&mut made);
            read(&made).unwrap()
        };
        assert!(found.is_empty() && left_out[0].contains("all of its velocities are missing"));
    }
}
