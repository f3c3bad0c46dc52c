//! One sweep of a map as a HALO Photonics raw file (`.hpl`), which doppy, halo-reader and xradar read. A lossy
//! export: velocity to 5e-5 m/s, angles to 0.005 degrees, no place for errors or for the scene (the table beside it
//! has both), and no code for a missing value, which becomes velocity 0 at intensity 1 (no signal). A velocity without a
//! signal-to-noise ratio has intensity 1. Check: the tests read the text back line by line.

use super::csv::Table;
use super::map::VelocityMap;
use super::utc::DAY_S;
use crate::Error;
use crate::SPEED_OF_LIGHT_M_S;
use crate::beams::SweepMode;
use ndarray::Array2;

/// No instrument has the number 0: with the file's own name it is all by which this program's files can be recognised, for readers
/// refuse every other remark.
pub(super) const SYSTEM_ID: &str = "System ID:\t0";

/// Name of the format in messages.
const FORMAT: &str = "HALO .hpl";

/// The bytes of the file called `file_name` (the header repeats it) with the rays of sweep `sweep`.
///
/// Gate 0 of the format starts at the lidar, so gates before the first of the map are filled with no signal.
///
/// # Errors
/// What [`VelocityMap::check`] finds; no such sweep; no field `radial_velocity` or `signal_to_noise_ratio`; gates
/// that overlap or leave gaps, or do not start a whole number of gates from the lidar (the format derives the range
/// from the gate number); a sweep across midnight UTC.
pub fn hpl_bytes(map: &VelocityMap, sweep: usize, file_name: &str) -> Result<Vec<u8>, Error> {
    let (first, last) = sweep_rays(map, sweep)?;
    let velocity = values(map, "radial_velocity")?;
    let snr_db = values(map, "signal_to_noise_ratio")?;
    let (gate_m, before) = gate_grid(&map.range_m)?;
    within_a_day(map.rays[first].time_s, map.rays[last].time_s, map.start())?;
    let mut out = header(
        map,
        file_name,
        gate_m,
        before + map.range_m.len(),
        (first, last),
    );
    for ray in first..=last {
        let hours = second_of_day(map, ray) / 3600.0;
        let azimuth_deg = map.rays[ray]
            .azimuth_rad
            .rem_euclid(std::f64::consts::TAU)
            .to_degrees();
        let elevation_deg = map.rays[ray].elevation_rad.to_degrees();
        out += &format!(
            "{hours:11.8} {azimuth_deg:6.2} {elevation_deg:6.2} {:.2} {:.2}\r\n",
            0.0, 0.0
        );
        for gate in 0..before {
            push_gate(gate, f64::NAN, f64::NAN, &mut out);
        }
        for gate in 0..map.range_m.len() {
            let cell = [ray, gate];
            push_gate(before + gate, velocity[cell], snr_db[cell], &mut out);
        }
    }
    Ok(out.into_bytes())
}

/// Content of the file of a sweep as a table: `time_s, elevation_rad, range_m, v_mean_m_s, snr_db, ray`, a row for each finite
/// velocity; the ratio is minus infinity where the file has intensity 1.
///
/// # Errors
/// As [`hpl_bytes`].
pub fn hpl_table(map: &VelocityMap, sweep: usize) -> Result<Table, Error> {
    let (first, last) = sweep_rays(map, sweep)?;
    let velocity = values(map, "radial_velocity")?;
    let snr_db = values(map, "signal_to_noise_ratio")?;
    let mut time_s = Vec::new();
    let mut elevation_rad = Vec::new();
    let mut range_m = Vec::new();
    let mut velocity_m_s = Vec::new();
    let mut ratio_db = Vec::new();
    let mut rays = Vec::new();
    for ray in first..=last {
        for (gate, gate_range_m) in map.range_m.iter().enumerate() {
            if !velocity[[ray, gate]].is_finite() {
                continue;
            }
            let snr_db = snr_db[[ray, gate]];
            time_s.push(map.rays[ray].time_s);
            elevation_rad.push(map.rays[ray].elevation_rad);
            range_m.push(*gate_range_m);
            velocity_m_s.push(velocity[[ray, gate]]);
            ratio_db.push(if snr_db.is_nan() {
                f64::NEG_INFINITY
            } else {
                snr_db
            });
            rays.push((ray - first) as i64);
        }
    }
    Ok(Table::new()
        .float("time_s", time_s)
        .float("elevation_rad", elevation_rad)
        .float("range_m", range_m)
        .float("v_mean_m_s", velocity_m_s)
        .float("snr_db", ratio_db)
        .int("ray", rays))
}

/// First and last ray of a sweep of a valid map.
fn sweep_rays(map: &VelocityMap, sweep: usize) -> Result<(usize, usize), Error> {
    map.check()?;
    let bounds = map.sweep_bounds();
    let rays = bounds.get(sweep).copied();
    rays.ok_or_else(|| Error::value("sweep", sweep, format!("below {}", bounds.len())))
}

/// Values of a field that the format needs.
fn values<'m>(map: &'m VelocityMap, name: &str) -> Result<&'m Array2<f64>, Error> {
    let field = map.field(name).ok_or_else(|| Error::Missing {
        what: format!("field {name}"),
        needed: "an .hpl file holds velocity and intensity".into(),
    })?;
    Ok(&field.values)
}

/// The format counts hours of one day.
///
/// # Errors
/// A sweep that begins on one day and ends on the next, with both times.
pub fn within_a_day(first_s: f64, last_s: f64, start: super::UtcTime) -> Result<(), Error> {
    let first = start.after_s(first_s);
    let last = start.after_s(last_s);
    if first.date() == last.date() {
        return Ok(());
    }
    let both = format!("{first} to {last}");
    Err(Error::value(
        "time of the rays",
        both,
        "an .hpl file holds a sweep within one day",
    ))
}

/// Gate length in metres, and number of gates between the lidar and the first one.
fn gate_grid(range_m: &[f64]) -> Result<(f64, usize), Error> {
    if range_m.len() < 2 {
        return Err(Error::unsupported(
            FORMAT,
            "a map of one gate has no gate length",
        ));
    }
    let gate_m = (range_m[range_m.len() - 1] - range_m[0]) / (range_m.len() - 1) as f64;
    let before = (range_m[0] / gate_m - 0.5).round();
    for (i, r) in range_m.iter().enumerate() {
        // Readers compute the centre as (gate + 0.5) * length; a millimetre is below what they keep.
        let expected = (before + i as f64 + 0.5) * gate_m;
        if before < 0.0 || (expected - r).abs() > 1e-3 {
            return Err(Error::unsupported(
                FORMAT,
                format!(
                    "gate {i} is at {r} m; the format puts it at {expected} m: gates must touch, and start a whole number of gates from \
                     the lidar"
                ),
            ));
        }
    }
    Ok((gate_m, before as usize))
}

/// The head of the file; its focus range 65535 means a collimated beam, where readers ask for an integer.
fn header(
    map: &VelocityMap,
    name: &str,
    gate_m: f64,
    gates: usize,
    rays: (usize, usize),
) -> String {
    let pulse = &map.pulse;
    let points = (2.0 * gate_m / SPEED_OF_LIGHT_M_S * pulse.sampling_hz)
        .round()
        .max(1.0);
    let resolution_m_s = 0.5 * pulse.wavelength_m() * pulse.sampling_hz / points;
    let header = format!(
        include_str!("hpl_header.txt"),
        name = name,
        system_id = SYSTEM_ID,
        gates = gates,
        // Readers multiply it with the number of a gate.
        gate_m = gate_m,
        points = points,
        pulses = pulse.samples,
        rays = rays.1 - rays.0 + 1,
        scan_type = scan_type(map, rays),
        start_time = start_time(map, rays.0),
        resolution_m_s = resolution_m_s
    );
    header.replace('\n', "\r\n")
}

/// The word of the instrument for a sweep, by its rays.
fn scan_type(map: &VelocityMap, (first, last): (usize, usize)) -> &'static str {
    let still = map.rays[first..=last].windows(2).all(|pair| {
        pair[0].azimuth_rad == pair[1].azimuth_rad && pair[0].elevation_rad == pair[1].elevation_rad
    });
    match map.sweeps[map.rays[first].sweep].mode {
        SweepMode::Rhi => "RHI",
        SweepMode::AzimuthSurveillance | SweepMode::Sector => "VAD - stepped",
        SweepMode::VerticalPointing | SweepMode::Pointing if still => "Stare",
        SweepMode::VerticalPointing | SweepMode::Pointing => "User file 1 - stepped",
    }
}

/// Seconds since midnight UTC of a ray.
fn second_of_day(map: &VelocityMap, ray: usize) -> f64 {
    (map.start().second_of_day() as f64 + map.rays[ray].time_s).rem_euclid(DAY_S)
}

fn start_time(map: &VelocityMap, ray: usize) -> String {
    let date = map.start().after_s(map.rays[ray].time_s).date();
    let s = second_of_day(map, ray);
    let h = (s / 3600.0) as u32;
    let m = (s / 60.0) as u32 % 60;
    // Hundredths are cut, not rounded: 59.999 s must not become 60.00.
    let rest = ((s % 60.0) * 100.0).floor() / 100.0;
    format!(
        "{:04}{:02}{:02} {h:02}:{m:02}:{rest:05.2}",
        date.year(),
        date.month(),
        date.day()
    )
}

fn push_gate(gate: usize, velocity_m_s: f64, snr_db: f64, out: &mut String) {
    let velocity = if velocity_m_s.is_nan() {
        0.0
    } else {
        velocity_m_s
    };
    let has_ratio = velocity_m_s.is_finite() && snr_db.is_finite();
    let intensity = if has_ratio {
        1.0 + 10_f64.powf(snr_db / 10.0)
    } else {
        1.0
    };
    let backscatter = format!("{:.6E}", 0.0);
    *out += &format!("{gate:3} {velocity:.4} {intensity:.6} {backscatter:>13}\r\n");
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    fn lines(map: &VelocityMap, sweep: usize) -> Vec<String> {
        let text = String::from_utf8(hpl_bytes(map, sweep, "x_1.hpl").unwrap()).unwrap();
        assert_eq!(text.matches('\n').count(), text.matches("\r\n").count());
        text.split("\r\n").map(str::to_owned).collect()
    }

    #[test]
    fn header_has_seventeen_lines_and_the_body_its_values() {
        let map = samples::map();
        let lines = lines(&map, 1);
        assert_eq!(lines[0], "Filename:\tx_1.hpl");
        assert_eq!(
            lines[2], "Number of gates:\t6",
            "one empty gate before the first at 45 m"
        );
        assert_eq!(lines[9], "Start time:\t20240101 00:01:20.00");
        assert_eq!(lines[16], "****");
        assert_eq!(lines.len(), 17 + 6 * 7 + 1);
        let ray: Vec<f64> = lines[17]
            .split_whitespace()
            .map(|c| c.parse().unwrap())
            .collect();
        assert_eq!(ray.len(), 5);
        approx::assert_abs_diff_eq!(ray[0], 80.0 / 3600.0, epsilon = 1e-8);
        approx::assert_abs_diff_eq!(
            ray[2],
            map.rays[6].elevation_rad.to_degrees(),
            epsilon = 5e-3
        );
        assert_eq!(
            lines[18].split_whitespace().collect::<Vec<_>>()[..3],
            ["0", "0.0000", "1.000000"]
        );
        let gate: Vec<f64> = lines[19]
            .split_whitespace()
            .map(|c| c.parse().unwrap())
            .collect();
        let value = |name: &str| map.field(name).unwrap().values[[6, 0]];
        approx::assert_abs_diff_eq!(gate[1], value("radial_velocity"), epsilon = 5e-5);
        let snr = 10.0 * (gate[2] - 1.0).log10();
        approx::assert_abs_diff_eq!(snr, value("signal_to_noise_ratio"), epsilon = 1e-3);
    }

    #[test]
    fn the_scan_type_is_the_word_of_the_instrument_for_the_sweep() {
        let mut map = samples::map();
        for (mode, word) in [
            (SweepMode::Rhi, "RHI"),
            (SweepMode::AzimuthSurveillance, "VAD - stepped"),
            (SweepMode::Sector, "VAD - stepped"),
            (SweepMode::Pointing, "User file 1 - stepped"),
        ] {
            map.sweeps[0].mode = mode;
            assert_eq!(lines(&map, 0)[7], format!("Scan type:\t{word}"));
        }
        for mode in [SweepMode::VerticalPointing, SweepMode::Pointing] {
            map.sweeps[0].mode = mode;
            let up = map.rays[0].elevation_rad;
            map.rays.iter_mut().for_each(|ray| ray.elevation_rad = up);
            assert_eq!(lines(&map, 0)[7], "Scan type:\tStare");
        }
    }

    #[test]
    fn a_missing_value_is_no_signal() {
        let map = samples::map();
        let lines = lines(&map, 1);
        let last: Vec<&str> = lines[lines.len() - 2].split_whitespace().collect();
        assert_eq!(last[..3], ["5", "0.0000", "1.000000"]);
    }

    #[test]
    fn gates_that_the_format_cannot_place_are_refused() {
        let mut map = samples::map();
        map.range_m.iter_mut().for_each(|r| *r += 7.0);
        assert!(matches!(
            hpl_bytes(&map, 0, "x.hpl"),
            Err(Error::Unsupported { .. })
        ));
        assert!(matches!(
            hpl_bytes(&samples::map(), 2, "x.hpl"),
            Err(Error::Value { .. })
        ));
    }

    #[test]
    fn a_date_of_ones_own_is_in_the_header_and_in_the_hours_and_ends_at_midnight() {
        let mut map = samples::map();
        map.site.start_utc = "2023-12-31T23:58:00Z".into();
        let lines = lines(&map, 0);
        assert_eq!(
            lines[9], "Start time:\t20231231 23:58:40.00",
            "the sweep begins 40 s after the flow"
        );
        let hours: f64 = lines[17]
            .split_whitespace()
            .next()
            .unwrap()
            .parse()
            .unwrap();
        approx::assert_abs_diff_eq!(hours, 23.0 + 58.0 / 60.0 + 40.0 / 3600.0, epsilon = 1e-8);
        map.site.start_utc = "2023-12-31T23:59:19Z".into();
        let error = hpl_bytes(&map, 0, "x.hpl").unwrap_err().to_string();
        assert!(
            error.contains("2023-12-31T23:59:59Z to 2024-01-01T00:00:01Z"),
            "{error}"
        );
    }

    #[test]
    fn the_table_has_the_rows_that_the_file_has() {
        let map = samples::map();
        let table = hpl_table(&map, 1).unwrap();
        assert_eq!(table.columns()[0].1, {
            let times =
                (6..12).flat_map(|ray| vec![map.rays[ray].time_s; if ray == 11 { 4 } else { 5 }]);
            super::super::csv::Column::Float(times.collect())
        });
    }
}
