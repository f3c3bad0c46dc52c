//! Lines of sight of files as they were measured, in any directions, for winds: with the formats, units and signs of scans, but without
//! the demand that they make a scan in elevation.
//!
//! Check: files of all formats with cones, stares and gates that differ from ray to ray; what no ray of a lidar has.

use super::grid::check_extent;
use super::planes::ALLOWED_RAD;
use super::velocities::drop_missing;
use super::{ScanFormat, cfradial, hpl, table};
use crate::Error;
use crate::io::netcdf_input::open_groups;
use crate::io::{UtcTime, text_file};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::{Path, PathBuf};

/// Fraction of the rays whose elevations may be impossible; more say that the unit is another one.
const IMPOSSIBLE: f64 = 0.1;

/// Cosine of the elevation below which a beam counts as vertical.
const VERTICAL: f64 = 0.02;
/// Azimuths that count several turns are at most this in size.
const MOST_AZIMUTH_RAD: f64 = 2.0 * TAU;

/// One line of sight with the velocities of its gates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ray {
    /// Azimuth, rad, clockwise from north.
    pub azimuth_rad: f64,
    /// Elevation, rad, up to pi: beyond a right angle it looks to the other side.
    pub elevation_rad: f64,
    /// Time of its middle, s; NaN if it is unknown.
    pub time_s: f64,
    /// Ranges of its gates, m; empty while all rays of the file have the same.
    pub range_m: Vec<f64>,
    /// Velocities of its gates, m/s, positive away; NaN where there is none.
    pub velocity_m_s: Vec<f64>,
    /// Their standard deviations, m/s; empty if they are unknown.
    pub sigma_m_s: Vec<f64>,
    /// Velocities repeat after this width, m/s.
    pub fold_m_s: Option<f64>,
}

impl Ray {
    /// Unit vector of the beam: east, north, up.
    #[must_use]
    pub fn direction(&self) -> [f64; 3] {
        let (east, north) = self.azimuth_rad.sin_cos();
        let (up, level) = self.elevation_rad.sin_cos();
        [level * east, level * north, up]
    }
}

/// Lines of sight of one sweep of a file, in the order in which they were measured.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RaySweep {
    /// The file.
    pub path: PathBuf,
    /// Number of the sweep in the file, from 0.
    pub sweep: usize,
    /// Latitude and longitude of the instrument, degrees, if the file has them.
    pub place_deg: Option<[f64; 2]>,
    /// Date from which times count, if the file has one.
    pub reference: Option<UtcTime>,
    /// Length of a gate that touches its neighbours, m, if the file says so.
    pub gate_length_m: Option<f64>,
    /// Duration of a pulse, s, if the file has it.
    pub pulse_width_s: Option<f64>,
    /// The scene that this program wrote the file for.
    pub scene_toml: Option<String>,
    /// Whether the file says which velocities its instrument trusts.
    pub has_status: bool,
    /// Gates this many apart share no samples, by the file: more than 1 for gates that overlap.
    pub gate_stride: usize,
    /// The lines of sight.
    pub rays: Vec<Ray>,
}

/// The sweeps of a file or a group of it, and what was not understood.
pub(super) type FoundRays = (Vec<RaySweep>, Vec<String>);

/// Reads the lines of sight of a file; the texts say what was skipped or not understood.
///
/// # Errors
/// A file that cannot be read, is damaged or cut short, or has no velocity; a lidar that moves; numbers that no ray has.
pub fn read_rays(path: &Path, format: &ScanFormat) -> Result<(Vec<RaySweep>, Vec<String>), Error> {
    let (_, length, magic) = text_file::begin(path)?;
    let (mut sweeps, mut notes) = match &magic[..] {
        [b'C', b'D', b'F', ..] | [0x89, b'H', b'D', b'F', ..] => netcdf(path, format)?,
        _ => {
            let bytes = super::text_bytes(path, length)?;
            of_text(&bytes, path, format).map_err(|reason| Error::input(path, reason))?
        }
    };
    let skipped = check(&mut sweeps).map_err(|reason| Error::input(path, reason))?;
    notes.extend(skipped);
    Ok((sweeps, notes))
}

fn netcdf(path: &Path, format: &ScanFormat) -> Result<FoundRays, Error> {
    let mut sweeps = Vec::new();
    let mut notes = Vec::new();
    let groups = open_groups(path, "elevation", cfradial::has_rays)?;
    let mut refused = Vec::new();
    for (number, group) in groups.into_iter().enumerate() {
        match cfradial::rays(&group, path, format, number) {
            Ok((own, warnings)) => {
                sweeps.extend(own);
                notes.extend(warnings);
            }
            Err(reason) => refused.push(group.named(reason)),
        }
    }
    if sweeps.is_empty() {
        return Err(Error::input(path, refused.join("; ")));
    }
    notes.extend(refused.into_iter().map(|what| format!("{what}: skipped")));
    Ok((sweeps, notes))
}

fn of_text(bytes: &[u8], path: &Path, format: &ScanFormat) -> Result<FoundRays, String> {
    let text = super::decoded(bytes, path, format)?;
    if super::is_hpl(&text) {
        hpl::rays_of_text(&text, path, format)
    } else {
        table::rays_of_text(&text, path, format)
    }
}

/// Counts elevations below the horizon from it, and takes azimuths that no beam has for missing ones.
fn correct_angles(ray: &mut Ray) {
    if ray.elevation_rad > 1.5 * PI {
        ray.elevation_rad -= TAU;
    }
    // A fill value that the file does not name.
    if ray.azimuth_rad.abs() > MOST_AZIMUTH_RAD {
        ray.azimuth_rad = f64::NAN;
    }
    // Straight up all azimuths are one.
    if ray.azimuth_rad.is_nan() && ray.elevation_rad.cos().abs() < VERTICAL {
        ray.azimuth_rad = 0.0;
    }
}

/// Removes what no line of sight has, in words; elevations below the horizon may count on from 270 degrees.
fn check(sweeps: &mut [RaySweep]) -> Result<Vec<String>, String> {
    let mut dropped = Vec::new();
    let all: usize = sweeps.iter().map(|sweep| sweep.rays.len()).sum();
    let mut impossible = None;
    let mut count = 0;
    for sweep in sweeps.iter_mut() {
        for ray in &mut sweep.rays {
            correct_angles(ray);
            if ray.elevation_rad.is_finite() && !ALLOWED_RAD.contains(&ray.elevation_rad) {
                impossible = impossible.or(Some(ray.elevation_rad));
                count += 1;
            }
        }
        sweep
            .rays
            .retain(|ray| ALLOWED_RAD.contains(&ray.elevation_rad) && ray.azimuth_rad.is_finite());
    }
    if let Some(elevation_rad) = impossible
        && f64::from(count) > (IMPOSSIBLE * all as f64).max(1.0)
    {
        return Err(format!(
            "elevation is {} degrees: from -90 to 180 are allowed, beyond 90 to the other side",
            elevation_rad.to_degrees()
        ));
    }
    let kept: usize = sweeps.iter().map(|sweep| sweep.rays.len()).sum();
    if kept == 0 {
        return Err("it has no ray with an azimuth and an elevation".into());
    }
    if kept < all {
        dropped.push(format!(
            "{} of {all} rays have no azimuth, or no elevation from -90 to 180 degrees",
            all - kept
        ));
    }
    let mut lines_m_s = Vec::with_capacity(kept);
    for ray in sweeps.iter_mut().flat_map(|sweep| &mut sweep.rays) {
        lines_m_s.push(ray.velocity_m_s.as_mut_slice());
    }
    dropped.extend(drop_missing(&mut lines_m_s)?);
    check_gates(sweeps)?;
    for text in &mut dropped {
        text.push_str(": skipped");
    }
    dropped.extend(as_of_radians(sweeps));
    Ok(dropped)
}

/// That angles in degrees have the values that cones and sectors have in radians, in words.
fn as_of_radians(sweeps: &[RaySweep]) -> Option<String> {
    let mut azimuths_deg = (f64::INFINITY, f64::NEG_INFINITY);
    let mut highest_deg = 0.0_f64;
    for ray in sweeps.iter().flat_map(|sweep| &sweep.rays) {
        let azimuth_deg = ray.azimuth_rad.to_degrees();
        azimuths_deg.0 = azimuths_deg.0.min(azimuth_deg);
        azimuths_deg.1 = azimuths_deg.1.max(azimuth_deg);
        highest_deg = highest_deg.max(ray.elevation_rad.to_degrees().abs());
    }
    let (low_deg, high_deg) = azimuths_deg;
    let is_within = high_deg.max(-low_deg) <= TAU && highest_deg <= FRAC_PI_2;
    (is_within && high_deg - low_deg > PI && highest_deg > 0.0).then(|| {
        format!(
            "its azimuths are {low_deg:.2} to {high_deg:.2} degrees, its elevations at most {highest_deg:.2}: if they are radians, they need that unit"
        )
    })
}

/// Refuses ranges before the lidar or in another unit, and rays without any velocity.
fn check_gates(sweeps: &[RaySweep]) -> Result<(), String> {
    let mut velocities = 0;
    let mut farthest_m = f64::NEG_INFINITY;
    for ray in sweeps.iter().flat_map(|sweep| &sweep.rays) {
        for (range_m, velocity_m_s) in ray.range_m.iter().zip(&ray.velocity_m_s) {
            farthest_m = farthest_m.max(*range_m);
            if !velocity_m_s.is_finite() {
                continue;
            }
            if *range_m < 0.0 {
                return Err(format!("range is {range_m} m: at least 0 m is needed"));
            }
            velocities += usize::from(range_m.is_finite());
        }
    }
    if velocities == 0 {
        return Err("all of its velocities are missing".into());
    }
    check_extent(farthest_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_in_radians_that_are_said_to_be_degrees_are_noticed() {
        let warnings = |scale: f64| {
            let ray = |step: i32| Ray {
                azimuth_rad: (scale * f64::from(step)).to_radians(),
                elevation_rad: (1.2 * scale).to_radians(),
                range_m: vec![100.0, 200.0],
                velocity_m_s: vec![1.0, 2.0],
                ..Ray::default()
            };
            let mut sweeps = [RaySweep {
                rays: (0..7).map(ray).collect(),
                ..RaySweep::default()
            }];
            check(&mut sweeps).unwrap()
        };
        assert_eq!(warnings(57.3), Vec::<String>::new());
        let said = warnings(1.0);
        assert!(said[0].contains("0.00 to 6.00 degrees"), "{said:?}");
    }

    #[test]
    fn rays_with_an_azimuth_that_no_beam_has_are_skipped() {
        let ray = |azimuth_deg: f64| Ray {
            azimuth_rad: azimuth_deg.to_radians(),
            elevation_rad: 0.5,
            range_m: vec![100.0, 200.0],
            velocity_m_s: vec![1.0, 2.0],
            ..Ray::default()
        };
        let mut sweeps = [RaySweep {
            rays: [0.0, -999.0, 400.0, -170.0, 1e20].map(ray).into(),
            ..RaySweep::default()
        }];
        let warnings = check(&mut sweeps).unwrap();
        assert!(
            warnings.len() == 1 && warnings[0].starts_with("2 of 5 rays have no azimuth"),
            "{warnings:?}"
        );
        assert_eq!(sweeps[0].rays.len(), 3);
    }
}
