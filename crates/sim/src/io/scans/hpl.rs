//! Scans from HALO Photonics raw files, in their dialects.
//!
//! The header says how gates lie, and not always truly: files of overlapping gates print the formula of gates that touch, so that
//! the scan type decides. Noise has velocities over the whole band; what tells it is the intensity.
//! Check: a map written by this program comes back; each dialect; files that are cut short.

use super::grid::{RayRow, between_turns, one_plane, scan_map};
use super::{ReadScan, ScanFormat};
use crate::io::UtcTime;
use std::path::Path;

/// Gates of which this program knows nothing better overlap by so much, m (samples at 50 MHz).
const OVERLAP_STEP_M: f64 = 3.0;
/// Intensities above 1 by so many standard deviations of those below 1 are no noise.
const SIGMAS_ABOVE_NOISE: f64 = 4.0;
/// Most gates of a ray.
const MOST_GATES: usize = 1_000_000;

struct Header {
    gates: usize,
    rays: Option<usize>,
    gate_length_m: f64,
    gate_step_m: f64,
    start: Option<UtcTime>,
}

/// The scans of a text.
pub(super) fn scans(text: &str, path: &Path, format: &ScanFormat) -> Result<Vec<ReadScan>, String> {
    let mut lines = text.lines().enumerate();
    let mut head = Vec::new();
    for (_, line) in lines.by_ref() {
        if line.trim_start().starts_with("****") {
            break;
        }
        head.push(line.trim());
    }
    let header = Header::new(&head)?;
    let range_m: Vec<f64> =
        (0..header.gates).map(|gate| 0.5 * header.gate_length_m + gate as f64 * header.gate_step_m).collect();
    let mut rays: Vec<RayRow> = Vec::new();
    let mut intensities: Vec<Vec<f64>> = Vec::new();
    let mut days_h = 0.0;
    let mut rest = lines.filter(|(_, line)| !line.trim().is_empty());
    while let Some((number, line)) = rest.next() {
        let [hours, azimuth, elevation] = numbers(line)
            .and_then(|n| n.get(..3)?.try_into().ok())
            .ok_or_else(|| format!("line {}: hours, azimuth and elevation of a ray are expected", number + 1))?;
        if let Some(before) = rays.last() {
            // Hours count from midnight.
            days_h += if 3600.0 * (hours + days_h) < before.time_s - 43_200.0 { 24.0 } else { 0.0 };
        }
        let (mut velocity_m_s, mut intensity) = (vec![f64::NAN; header.gates], vec![f64::NAN; header.gates]);
        for gate in 0..header.gates {
            let (number, line) = rest.next().ok_or_else(|| {
                format!("it is cut short: ray {} has {gate} of {} gates", rays.len() + 1, header.gates)
            })?;
            let row = numbers(line).filter(|row| row.len() >= 3 && row[0] == gate as f64).ok_or_else(|| {
                format!(
                    "line {}: gate {gate} of ray {} is expected, with velocity and intensity",
                    number + 1,
                    rays.len() + 1
                )
            })?;
            (velocity_m_s[gate], intensity[gate]) = (row[1], row[2]);
        }
        rays.push(RayRow {
            elevation_rad: elevation.to_radians(),
            azimuth_rad: azimuth.to_radians(),
            time_s: 3600.0 * (hours + days_h),
            velocity_m_s,
            sigma_m_s: Vec::new(),
        });
        intensities.push(intensity);
    }
    if let Some(stated) = header.rays.filter(|stated| *stated > rays.len()) {
        return Err(format!("it is cut short: it has {} of {stated} rays", rays.len()));
    }
    mask_noise(&mut rays, &intensities, format);
    let elevation_rad: Vec<f64> = rays.iter().map(|ray| ray.elevation_rad).collect();
    let mut out = Vec::new();
    for (sweep, part) in between_turns(&elevation_rad).into_iter().enumerate() {
        let rays = rays[part].to_vec();
        let what = format!("scan {}", sweep + 1);
        one_plane(&rays).map_err(|(low, high)| {
            format!("{what}: it has azimuths from {low:.2} to {high:.2} degrees; a scan in elevation (RHI) has one")
        })?;
        out.push(ReadScan {
            path: path.to_owned(),
            sweep,
            map: scan_map(rays, range_m.clone(), None, &what)?,
            reference: header.start,
            gate_length_m: Some(header.gate_length_m),
            pulse_width_s: None,
            scene_toml: None,
            is_own: false,
        });
    }
    Ok(out)
}

impl Header {
    fn new(lines: &[&str]) -> Result<Self, String> {
        // Keys differ in case and in what follows them.
        let value = |key: &str| {
            lines.iter().find_map(|line| {
                let (name, value) = line.split_once(':')?;
                name.trim().to_ascii_lowercase().starts_with(key).then(|| value.trim())
            })
        };
        let number = |key: &str| value(key).and_then(|text| numbers(text)?.first().copied());
        let gates = number("number of gates").filter(|n| *n >= 1.0 && *n <= MOST_GATES as f64 && n.fract() == 0.0);
        let gates = gates.ok_or("its header has no number of gates")? as usize;
        let gate_length_m = number("range gate length").filter(|length| *length > 0.0 && length.is_finite());
        let gate_length_m = gate_length_m.ok_or("its header has no range gate length above 0 m")?;
        let formula = lines
            .iter()
            .map(|line| line.to_ascii_lowercase())
            .find(|line| line.starts_with("range of measurement") || line.starts_with("altitude of measurement"));
        let overlapping = value("scan type").is_some_and(|kind| kind.to_ascii_lowercase().contains("overlapping"))
            || formula.is_some_and(|formula| formula.replace(' ', "").contains("/2+"));
        let points = number("gate length (pts)").filter(|points| *points >= 1.0);
        let gate_step_m = match (overlapping, points) {
            (false, _) => gate_length_m,
            (true, Some(points)) => gate_length_m / points,
            (true, None) => OVERLAP_STEP_M,
        };
        let rays = number("no. of rays in file").map(|rays| rays.max(0.0) as usize);
        // YYYYMMDD hh:mm:ss; times of rays count from its midnight.
        let start = value("start time").and_then(|text| {
            let day = text.get(..8)?;
            UtcTime::parse(&format!("{}-{}-{}T00:00:00Z", day.get(..4)?, day.get(4..6)?, day.get(6..8)?))
        });
        Ok(Self { gates, rays, gate_length_m, gate_step_m, start })
    }
}

/// Numbers of a line; a comma in a number is its point.
fn numbers(line: &str) -> Option<Vec<f64>> {
    line.split_whitespace().map(|word| word.replace(',', ".").parse().ok()).collect()
}

/// Takes out the velocities of noise.
fn mask_noise(rays: &mut [RayRow], intensities: &[Vec<f64>], format: &ScanFormat) {
    let least = match format.min_snr_db {
        Some(db) => 1.0 + 10f64.powf(0.1 * db),
        None => {
            // Noise is on both sides of 1, signals above.
            let below: Vec<f64> =
                intensities.iter().flatten().filter(|i| **i < 1.0).map(|i| (i - 1.0).powi(2)).collect();
            let deviation = (below.iter().sum::<f64>() / below.len().max(1) as f64).sqrt();
            1.0 + SIGMAS_ABOVE_NOISE * deviation
        }
    };
    let sign = if format.towards { -1.0 } else { 1.0 };
    for (ray, intensity) in rays.iter_mut().zip(intensities) {
        for (velocity, intensity) in ray.velocity_m_s.iter_mut().zip(intensity) {
            // This program writes intensity 1 where there is none.
            *velocity = if *intensity > 1.0 && *intensity >= least { sign * *velocity } else { f64::NAN };
        }
    }
}
