//! Scans from HALO Photonics raw files, in their dialects.
//!
//! The header says how gates lie, and not always truly: files of overlapping gates print the formula of gates that touch, so that
//! the scan type decides. Noise has velocities over the whole band; it is recognised by its intensity.
//! Check: a map written by this program comes back; each dialect; files that are cut short, and scans that were stopped.

use super::grid::scan_map;
use super::rays::{FoundRays, Ray, RaySweep};
use super::{Found, ReadScan, ScanFormat, planes};
use crate::io::UtcTime;
use crate::io::units::FASTEST_M_S;
use crate::io::utc::DAY_S;
use crate::io::variable::not_understood;
use std::path::Path;

/// Gates of which this program knows nothing better overlap by so much, m (samples at 50 MHz).
const OVERLAP_STEP_M: f64 = 3.0;
/// Intensities above 1 by this many standard deviations of those below 1 are no noise.
const SIGMAS_ABOVE_NOISE: f64 = 4.0;
/// Most gates of a ray.
const MOST_GATES: usize = 1_000_000;

struct Header {
    gates: usize,
    rays: Option<usize>,
    gate_length_m: f64,
    gate_step_m: f64,
    /// That before the file was opened, from which the hours of rays count.
    midnight: Option<UtcTime>,
    /// When the file was opened, s after it.
    second_of_day: Option<f64>,
    /// What its date is, if it is none.
    not_understood: Option<String>,
    /// That it has fewer rays than it states, as of a scan that was stopped.
    too_few_rays: Option<String>,
    /// Whether this program wrote it.
    is_own: bool,
}

/// The header of a text and its rays, before they are put into scans.
fn parse(text: &str, format: &ScanFormat) -> Result<(Header, Vec<Ray>), String> {
    let mut lines = text.lines().enumerate();
    let mut head = Vec::new();
    for (_, line) in lines.by_ref() {
        if line.trim_start().starts_with("****") {
            break;
        }
        head.push(line.trim());
    }
    let mut header = Header::new(&head)?;
    let lines: Vec<(usize, &str)> = lines.filter(|(_, line)| !line.trim().is_empty()).collect();
    let (mut rays, intensities) = rays(&header, &lines)?;
    check_intensities(&intensities)?;
    if let Some(stated) = header.rays.filter(|stated| *stated > rays.len()) {
        let found = rays.len();
        header.too_few_rays = Some(format!(
            "it has {found} of the {stated} rays that its header states"
        ));
    }
    mask_noise(&mut rays, &intensities, format);
    Ok((header, rays))
}

/// The rays of a text.
pub(super) fn rays_of_text(
    text: &str,
    path: &Path,
    format: &ScanFormat,
) -> Result<FoundRays, String> {
    let (header, mut rays) = parse(text, format)?;
    let range_m = header.range_m();
    for ray in &mut rays {
        ray.range_m.clone_from(&range_m);
    }
    let sweep = RaySweep {
        path: path.to_owned(),
        reference: header.midnight,
        gate_length_m: Some(header.gate_length_m),
        has_status: true,
        gate_stride: (header.gate_length_m / header.gate_step_m - 1e-6).ceil() as usize,
        rays,
        ..RaySweep::default()
    };
    let warnings = header.not_understood.into_iter().chain(header.too_few_rays);
    Ok((vec![sweep], warnings.collect()))
}

/// The scans of a text.
pub(super) fn scans(text: &str, path: &Path, format: &ScanFormat) -> Result<Found, String> {
    let (header, rays) = parse(text, format)?;
    let range_m = header.range_m();
    let (scans, skipped) = planes::in_order(rays)?;
    let mut found = Found {
        skipped,
        ..Found::default()
    };
    for (sweep, scan) in scans.into_iter().enumerate() {
        let what = format!("scan {}", sweep + 1);
        match scan_map(scan.rays, range_m.clone(), None, &what) {
            Err(reason) => found.skipped.push(reason),
            Ok(map) => found.scans.push(ReadScan {
                azimuth_rad: scan.azimuth_rad,
                reference: header.midnight,
                gate_length_m: Some(header.gate_length_m),
                is_own: header.is_own,
                ..ReadScan::new(path, sweep, map)
            }),
        }
    }
    found.warnings.extend(header.not_understood);
    found.warnings.extend(header.too_few_rays);
    Ok(found)
}

/// The rays of numbered lines and the intensities of their gates.
fn rays(header: &Header, lines: &[(usize, &str)]) -> Result<(Vec<Ray>, Vec<Vec<f64>>), String> {
    let mut rays: Vec<Ray> = Vec::new();
    let mut intensities: Vec<Vec<f64>> = Vec::new();
    let mut all_hours = Vec::new();
    let mut rest = lines.iter();
    while let Some((number, line)) = rest.next() {
        let [hours, azimuth, elevation] = numbers(line)
            .and_then(|n| n.get(..3)?.try_into().ok())
            .ok_or_else(|| {
            format!(
                "line {}: hours, azimuth and elevation of a ray are expected",
                number + 1
            )
        })?;
        let mut velocity_m_s = vec![f64::NAN; header.gates];
        let mut intensity = vec![f64::NAN; header.gates];
        let ray = rays.len() + 1;
        for gate in 0..header.gates {
            let (number, line) = rest.next().ok_or_else(|| {
                format!(
                    "it is cut short: ray {ray} has {gate} of {} gates",
                    header.gates
                )
            })?;
            let row = first_numbers(line, 3).filter(|row| row[0] == gate as f64);
            let row = row.ok_or_else(|| {
                format!(
                    "line {}: gate {gate} of ray {ray} is expected, with velocity and intensity",
                    number + 1
                )
            })?;
            // A HALO file cannot name its fill values (-999, 9999): no air is as fast, and no ratio plus 1 is below 0 by as much.
            if row[1].abs() < FASTEST_M_S && row[2] > -FASTEST_M_S {
                velocity_m_s[gate] = row[1];
                intensity[gate] = row[2];
            }
        }
        rays.push(Ray {
            elevation_rad: elevation.to_radians(),
            azimuth_rad: azimuth.to_radians(),
            time_s: f64::NAN,
            velocity_m_s,
            ..Ray::default()
        });
        intensities.push(intensity);
        all_hours.push(hours);
    }
    for (ray, time_s) in rays.iter_mut().zip(times_s(header, &all_hours)) {
        ray.time_s = time_s;
    }
    Ok((rays, intensities))
}

/// Times of rays, s, from their hours since midnight, which begin anew on the next day; NaN in a file whose date is not understood.
fn times_s(header: &Header, hours: &[f64]) -> Vec<f64> {
    let mut times_s = Vec::with_capacity(hours.len());
    // That of the ray before, or of the opening of the file, since the midnight before it.
    let mut last_s = header.second_of_day;
    let mut days_s = 0.0;
    for hours in hours {
        let own_s = 3600.0 * hours;
        let later_s = last_s.map_or(0.0, |last_s| own_s + days_s - last_s);
        if later_s < -0.5 * DAY_S {
            days_s += DAY_S;
        } else if later_s > 0.5 * DAY_S {
            // Opened after midnight with a ray of the day before.
            days_s -= DAY_S;
        }
        last_s = Some(own_s + days_s);
        times_s.push(match header.not_understood {
            None => own_s + days_s,
            Some(_) => f64::NAN,
        });
    }
    times_s
}

impl Header {
    fn new(lines: &[&str]) -> Result<Self, String> {
        let gates = header_number(lines, "number of gates")
            .filter(|n| *n >= 1.0 && *n <= MOST_GATES as f64 && n.fract() == 0.0);
        let gates = gates.ok_or("its header has no number of gates")? as usize;
        let gate_length_m = header_number(lines, "range gate length")
            .filter(|length| *length > 0.0 && length.is_finite());
        let gate_length_m = gate_length_m.ok_or("its header has no range gate length above 0 m")?;
        let points = header_number(lines, "gate length (pts)").filter(|points| *points >= 1.0);
        let gate_step_m = match (have_overlap(lines), points) {
            (false, _) => gate_length_m,
            (true, Some(points)) => gate_length_m / points,
            (true, None) => OVERLAP_STEP_M,
        };
        let rays = header_number(lines, "no. of rays in file").map(|rays| rays.max(0.0) as usize);
        let stated = header_value(lines, "start time");
        let start = stated.and_then(UtcTime::parse_reference);
        let second_of_day = start.map(|(start, _)| start.second_of_day() as f64);
        Ok(Self {
            gates,
            rays,
            gate_length_m,
            gate_step_m,
            midnight: start.map(|(start, _)| start.after_s(-(start.second_of_day() as f64))),
            second_of_day,
            not_understood: stated
                .filter(|_| start.is_none())
                .map(|text| not_understood("Start time", text)),
            too_few_rays: None,
            is_own: lines.contains(&crate::io::hpl::SYSTEM_ID),
        })
    }

    /// Ranges of the gates.
    fn range_m(&self) -> Vec<f64> {
        let mut range_m = Vec::with_capacity(self.gates);
        for gate in 0..self.gates {
            range_m.push(0.5 * self.gate_length_m + gate as f64 * self.gate_step_m);
        }
        range_m
    }
}

/// Numbers of a line.
fn numbers(line: &str) -> Option<Vec<f64>> {
    line.split_whitespace().map(number).collect()
}

/// The first numbers of a line, whatever follows them; none of a line with fewer.
fn first_numbers(line: &str, count: usize) -> Option<Vec<f64>> {
    let words = line.split_whitespace().take(count);
    let found: Option<Vec<f64>> = words.map(number).collect();
    found.filter(|numbers| numbers.len() == count)
}

/// A number of a line, as Fortran may write it: a comma is its point, D stands for E, and stars for one that its column could not hold.
fn number(word: &str) -> Option<f64> {
    match word.bytes().all(|byte| byte == b'*') {
        true => Some(f64::NAN),
        false => word.replace(',', ".").replace(['D', 'd'], "E").parse().ok(),
    }
}

/// The value of a key of the header; keys differ in case and in what follows them.
fn header_value<'t>(lines: &[&'t str], key: &str) -> Option<&'t str> {
    for line in lines {
        if let Some((name, value)) = line.split_once(':')
            && name.trim().to_ascii_lowercase().starts_with(key)
        {
            return Some(value.trim());
        }
    }
    None
}

fn header_number(lines: &[&str], key: &str) -> Option<f64> {
    numbers(header_value(lines, key)?)?.first().copied()
}

/// Whether gates overlap: by the scan type, or by the first formula of the ranges.
fn have_overlap(lines: &[&str]) -> bool {
    let kind = header_value(lines, "scan type").unwrap_or_default();
    if kind.to_ascii_lowercase().contains("overlapping") {
        return true;
    }
    for line in lines {
        let line = line.to_ascii_lowercase();
        if line.starts_with("range of measurement") || line.starts_with("altitude of measurement") {
            return line.replace(' ', "").contains("/2+");
        }
    }
    false
}

/// Standard deviation of the intensities of noise, which are on both sides of 1, where those of signals are above.
fn noise_deviation(intensities: &[Vec<f64>]) -> f64 {
    let mut sum = 0.0;
    let mut count = 0;
    for intensity in intensities.iter().flatten() {
        if *intensity < 1.0 {
            sum += (intensity - 1.0).powi(2);
            count += 1;
        }
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// Refuses intensities that are no ratio of signal and noise plus 1, which is about 1 in noise.
fn check_intensities(intensities: &[Vec<f64>]) -> Result<(), String> {
    let known = intensities
        .iter()
        .flatten()
        .filter(|value| value.is_finite());
    let low = known.clone().filter(|value| **value < 0.5).count();
    match 2 * low > known.count() {
        true => Err("its third column should be the intensity, a ratio of signal and noise plus 1, but most of its values are below 0.5".into()),
        false => Ok(()),
    }
}

/// Takes out the velocities of noise.
fn mask_noise(rays: &mut [Ray], intensities: &[Vec<f64>], format: &ScanFormat) {
    let least = match format.min_snr_db {
        Some(db) => 1.0 + 10f64.powf(0.1 * db),
        None if format.ignores_status => f64::NEG_INFINITY,
        None => 1.0 + SIGMAS_ABOVE_NOISE * noise_deviation(intensities),
    };
    for (ray, intensity) in rays.iter_mut().zip(intensities) {
        for (velocity, intensity) in ray.velocity_m_s.iter_mut().zip(intensity) {
            // This program writes intensity 1 where there is none, others below 1 where there is noise.
            let is_signal = *intensity > 1.0 || (format.ignores_status && *intensity != 1.0);
            *velocity = if is_signal && *intensity >= least {
                format.sign() * *velocity
            } else {
                f64::NAN
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::{Unit, VelocityMap, hpl, samples};

    /// Six rays of eight gates; noise in the last two gates and in one below 1.
    fn file(changes: &[(&str, &str)]) -> String {
        let mut out = String::from(
            "Filename:\tx.hpl\nNumber of gates:\t8\nRange gate length (m):\t30.0\nGate length (pts):\t10\nPulses/ray:\t9\n\
             No. of rays in file:\t6\nScan type:\tRHI\nFocus range:\t65535\nStart time:\t20240131 23:59:00.00\n\
             Range of measurement (center of gate) = (range gate + 0.5) * Gate length\n****\n",
        );
        for ray in 0..6 {
            let hours = (23.99 + 0.005 * f64::from(ray)) % 24.0;
            out += &format!(
                "{hours:.5} 90.00 {:.2} 0.0 0.0\n",
                1.0 + 3.0 * f64::from(ray)
            );
            for gate in 0..8 {
                let intensity = if gate < 6 {
                    1.2
                } else {
                    1.0 + 0.004 * f64::from(2 * (ray % 2) - 1)
                };
                out += &format!(
                    "{gate:3} {:.4} {intensity:.6} 1.0E-6\n",
                    f64::from(gate) - 2.5
                );
            }
        }
        changes
            .iter()
            .fold(out, |text, (from, to)| text.replace(from, to))
    }

    fn read(text: &str, format: &ScanFormat) -> ReadScan {
        let mut found = scans(text, Path::new("x.hpl"), format).unwrap().scans;
        assert_eq!(found.len(), 1);
        found.remove(0)
    }

    #[test]
    fn noise_is_skipped_and_hours_go_on_after_midnight() {
        let found = read(&file(&[]), &ScanFormat::default());
        let map = &found.map;
        assert_eq!(
            (map.range_m[0], map.range_m[7], map.velocity_m_s.dim()),
            (15.0, 225.0, (6, 8))
        );
        assert!(
            map.velocity_m_s.column(5).iter().all(|v| *v == 2.5)
                && map.velocity_m_s.column(6).iter().all(|v| v.is_nan())
        );
        assert!(
            map.time_s
                .windows(2)
                .all(|pair| (pair[1] - pair[0] - 18.0).abs() < 0.1),
            "{:?}",
            map.time_s
        );
        assert_eq!(found.reference.unwrap().to_string(), "2024-01-31T00:00:00Z");
        let loud = ScanFormat {
            min_snr_db: Some(-6.0),
            towards: true,
            ..ScanFormat::default()
        };
        assert!(
            scans(&file(&[]), Path::new("x.hpl"), &loud)
                .unwrap()
                .scans
                .is_empty(),
            "0.2 is -7 dB"
        );
        let towards = ScanFormat {
            towards: true,
            ..ScanFormat::default()
        };
        assert_eq!(read(&file(&[]), &towards).map.velocity_m_s[[0, 5]], -2.5);
    }

    #[test]
    fn what_no_column_could_hold_and_fill_values_are_missing() {
        let plain = read(&file(&[]), &ScanFormat::default()).map;
        for (from, to) in [
            ("1.0E-6", "1.0D-06"),
            ("1.0E-6", "********"),
            (" 1.0E-6", ""),
        ] {
            let map = read(&file(&[(from, to)]), &ScanFormat::default()).map;
            assert_eq!(
                map.velocity_m_s.column(5),
                plain.velocity_m_s.column(5),
                "{to}"
            );
        }
        for missing in ["-999.0 -999.0", "-9999.0 1.2", "****** 1.2"] {
            let text = file(&[(" 1.5000 1.200000", &format!(" {missing}"))]);
            let map = read(&text, &ScanFormat::default()).map;
            assert!(
                map.velocity_m_s.column(4).iter().all(|v| v.is_nan()),
                "{missing}"
            );
            assert_eq!(map.velocity_m_s.column(5), plain.velocity_m_s.column(5));
        }
        for other in ["0.200000", "-7.000000"] {
            let text = file(&[
                ("1.200000", other),
                ("1.004000", "0.004"),
                ("0.996000", "-0.004"),
            ]);
            let refused = scans(&text, Path::new("x.hpl"), &ScanFormat::default());
            assert!(
                refused
                    .err()
                    .unwrap()
                    .contains("third column should be the intensity")
            );
        }
    }

    #[test]
    fn hours_belong_to_the_day_of_the_opening_or_to_its_neighbours() {
        let date = |changes: &[(&str, &str)]| {
            let found = read(&file(changes), &ScanFormat::default());
            let first_s = found.map.time_s[0];
            found.reference.unwrap().after_s(first_s + 0.5).to_string()
        };
        assert_eq!(date(&[]), "2024-01-31T23:59:24Z");
        let opened_before = ("20240131 23:59:00.00", "20240130 23:59:59.50");
        let after = ("23.99000", "0.00010");
        assert_eq!(date(&[opened_before, after]), "2024-01-31T00:00:00Z");
        let opened_after = ("20240131 23:59:00.00", "20240201 0:00:0.5");
        assert_eq!(date(&[opened_after]), "2024-01-31T23:59:24Z");
    }

    #[test]
    fn a_scan_that_was_stopped_is_read_and_a_ray_that_ends_early_is_not() {
        let stopped = file(&[("rays in file:\t6", "rays in file:\t60")]);
        let found = scans(&stopped, Path::new("x.hpl"), &ScanFormat::default()).unwrap();
        assert_eq!(found.scans.len(), 1);
        assert!(
            found.warnings[0].contains("6 of the 60 rays"),
            "{:?}",
            found.warnings
        );
        let end = stopped.trim_end().rfind('\n').unwrap();
        let cut = scans(&stopped[..end], Path::new("x.hpl"), &ScanFormat::default());
        assert!(cut.is_err_and(|reason| reason.contains("ray 6 has 7 of 8 gates")));
    }

    #[test]
    fn a_date_that_is_not_understood_is_named_and_gives_no_times() {
        let text = file(&[("20240131 23:59:00.00", "01/31/2024 23:59")]);
        let found = scans(&text, Path::new("x.hpl"), &ScanFormat::default()).unwrap();
        assert!(
            found.warnings[0].contains("01/31/2024 23:59"),
            "{:?}",
            found.warnings
        );
        assert!(
            found.scans[0]
                .map
                .time_s
                .iter()
                .all(|time_s| time_s.is_nan())
        );
    }

    #[test]
    fn dialects_of_the_header_are_understood() {
        let ranges = |changes: &[(&str, &str)]| {
            let map = read(&file(changes), &ScanFormat::default()).map;
            (map.range_m[0], map.range_m[1] - map.range_m[0])
        };
        // Whatever the formula says: the scan type is right.
        assert_eq!(
            ranges(&[("Scan type:\tRHI", "Scan type:\tRHI - overlapping")]),
            (15.0, 3.0)
        );
        assert_eq!(
            ranges(&[(
                "(range gate + 0.5) * Gate length",
                "gate length / 2 + (range gate x 3)"
            )]),
            (15.0, 3.0)
        );
        assert_eq!(
            ranges(&[
                ("Range of measurement", "Altitude of measurement"),
                ("No. of rays", "No. of waypoints")
            ]),
            (15.0, 30.0)
        );
        let commas = file(&[])
            .replace(".000000", ",000000")
            .replace(".200000", ",200000")
            .replace("30.0", "30,0");
        let velocities = |text: &str| {
            read(text, &ScanFormat::default())
                .map
                .velocity_m_s
                .mapv(f64::to_bits)
        };
        assert_eq!(velocities(&commas), velocities(&file(&[])));
    }

    #[test]
    fn a_map_of_this_program_comes_back() {
        let mut map: VelocityMap = samples::map();
        let shape = map.field("radial_velocity").unwrap().values.dim();
        let ratio = ndarray::Array2::from_elem(shape, 3.0);
        map.fields
            .retain(|field| field.name != "signal_to_noise_ratio");
        map.fields.push(crate::io::Field::float(
            "signal_to_noise_ratio",
            Unit::DECIBEL,
            "ratio",
            ratio,
        ));
        // Two sweeps of six rays and five gates: 30 velocities are as few as a scan may have.
        let bytes = hpl::hpl_bytes(&map, 0, "halo.hpl").unwrap();
        let found = read(&String::from_utf8(bytes).unwrap(), &ScanFormat::default());
        let written = &map.field("radial_velocity").unwrap().values;
        let gates = map.range_m.len();
        let before = found.map.range_m.len() - gates;
        for ((ray, gate), velocity) in found
            .map
            .velocity_m_s
            .indexed_iter()
            .filter(|((_, gate), _)| *gate >= before)
        {
            assert!((velocity - written[[ray, gate - before]]).abs() < 1e-4);
        }
        assert!((found.map.range_m[before] - map.range_m[0]).abs() < 1e-3);
    }
}
