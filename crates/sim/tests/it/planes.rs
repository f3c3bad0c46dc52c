//! `wakescope retrieve` of scans of several planes, over the zenith, with rays between the scans, of other instruments, and of files that
//! cannot be used.

use super::wakescope;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use wakescope_estimate::vortex_fit::{Wake, WakeModel};
use wakescope_sim::io::csv_input::TextTable;

const GATES: usize = 26;
const GATE_M: f64 = 10.0;
/// The first gate of the velocities; before it there is noise.
const FIRST: usize = 34;

/// A ray: azimuth and elevation in degrees, time in s, velocities.
struct Ray(f64, f64, f64, Vec<f64>);

/// Noise of 0.2 m/s that is the same in every test.
struct Noise(f64);

impl Noise {
    fn next(&mut self) -> f64 {
        let uniform = |place: f64| (place * 997.13 + 0.123).fract();
        let sum: f64 = (0..3)
            .map(|_| {
                self.0 = uniform(self.0);
                self.0 - 0.5
            })
            .sum();
        0.4 * sum
    }
}

/// Rays of a scan at elevations as the scanner states them; `wake` is that of the plane with azimuth `front`.
fn scan(
    wake: &Wake,
    front: f64,
    directions: &[(f64, f64)],
    start_s: f64,
    first: usize,
) -> Vec<Ray> {
    let model = WakeModel::default();
    let mut noise = Noise(0.1 + 1e-3 * (front + start_s) % 0.7);
    let ray = |(i, (azimuth, elevation)): (usize, &(f64, f64))| {
        let is_behind = (azimuth - front).to_radians().cos() < 0.0;
        let angle = if is_behind {
            180.0 - elevation
        } else {
            *elevation
        };
        let velocity = |gate: usize| {
            let range_m = GATE_M * ((first + gate) as f64 + 0.5);
            model.radial_velocity_m_s(wake, range_m, angle.to_radians()) + noise.next()
        };
        Ray(
            *azimuth,
            *elevation,
            start_s + 0.02 * i as f64,
            (0..GATES).map(velocity).collect(),
        )
    };
    directions.iter().enumerate().map(ray).collect()
}

/// Elevations from 2 to 14 degrees.
fn up(azimuth: f64) -> Vec<(f64, f64)> {
    (0..50)
        .map(|i| (azimuth, 2.0 + 0.25 * f64::from(i)))
        .collect()
}

fn pair(y_m: [f64; 2], z_m: f64, gamma_m2_s: f64, wind_m_s: f64) -> Wake {
    let [left, right] = y_m;
    Wake::from_array(&[
        gamma_m2_s, gamma_m2_s, left, z_m, right, z_m, 3.0, 3.0, wind_m_s, 0.0, 0.0,
    ])
}

/// A file of HALO.
fn hpl(rays: &[Ray], first: usize) -> String {
    let gates = first + GATES;
    let mut out = format!(
        "Filename:\tx.hpl\nNumber of gates:\t{gates}\nRange gate length (m):\t{GATE_M}\nGate length (pts):\t4\nPulses/ray:\t9\n\
         No. of rays in file:\t{}\nScan type:\tUser file 1 - csm\nStart time:\t20240131 12:00:00.00\n\
         Range of measurement (center of gate) = (range gate + 0.5) * Gate length\n****\n",
        rays.len()
    );
    for Ray(azimuth, elevation, time_s, velocities) in rays {
        let _ = writeln!(
            out,
            "{:.9} {azimuth:.2} {elevation:.2} 0.0 0.0",
            12.0 + time_s / 3600.0
        );
        for gate in 0..gates {
            let (velocity, intensity) = match gate.checked_sub(first) {
                Some(gate) => (velocities[gate], 1.3),
                None => (-14.1, if gate % 2 == 0 { 1.004 } else { 0.996 }),
            };
            let _ = writeln!(out, "{gate:3} {velocity:.4} {intensity:.6} 1.0E-6");
        }
    }
    out
}

/// A table without sweeps; azimuths from -180 to 180 degrees.
fn csv(rays: &[Ray], first: usize) -> String {
    let mut out = String::from("range_m,azimuth_deg,elevation_deg,time_s,velocity_m_s\n");
    for Ray(azimuth, elevation, time_s, velocities) in rays {
        let azimuth = if *azimuth > 180.0 {
            azimuth - 360.0
        } else {
            *azimuth
        };
        for (gate, velocity) in velocities.iter().enumerate() {
            let range_m = GATE_M * ((first + gate) as f64 + 0.5);
            let _ = writeln!(out, "{range_m},{azimuth},{elevation},{time_s},{velocity}");
        }
    }
    out
}

/// Runs a retrieval that must succeed; its table and what it warned of.
fn retrieved(folder: &Path, files: &[&str]) -> (TextTable, String) {
    let options = ["--gate-std", "0", "--out", "r", "--quiet", "--overwrite"];
    let out = wakescope(folder, &[&["retrieve"], files, &options].concat());
    let warned = String::from_utf8(out.stderr).unwrap();
    assert!(out.status.success(), "{files:?}: {warned}");
    (
        TextTable::read(&folder.join("r/retrieval.csv")).unwrap(),
        warned,
    )
}

fn number(table: &TextTable, row: usize, name: &str) -> f64 {
    table.number(row, table.column(name).unwrap())
}

fn text<'t>(table: &'t TextTable, row: usize, name: &str) -> &'t str {
    &table.rows[row][table.column(name).unwrap()]
}

/// Azimuth in whole degrees, side, and whole lateral position of each row.
fn summary(table: &TextTable) -> Vec<(i64, String, i64)> {
    let row = |row: usize| {
        let azimuth = number(table, row, "azimuth_rad").to_degrees().round() as i64;
        (
            azimuth,
            text(table, row, "side").to_owned(),
            number(table, row, "y_m").round() as i64,
        )
    };
    (0..table.rows.len()).map(row).collect()
}

/// Three planes, scanned twice in turn: a wake that stands across the first, oblique in the second, none in the third.
fn volume() -> Vec<Vec<Ray>> {
    let of = |turn: usize, plane: usize| {
        let (azimuth, wake) = match plane {
            0 => (359.0, pair([400.0, 440.0], 45.0, 400.0, 2.0)),
            1 => (29.0, pair([460.0, 506.0], 45.0, 346.0, 1.7)),
            _ => (179.0, pair([400.0, 440.0], 45.0, 0.0, -2.0)),
        };
        scan(
            &wake,
            azimuth,
            &up(azimuth),
            20.0 * (3 * turn + plane) as f64,
            FIRST,
        )
    };
    (0..6).map(|k| of(k / 3, k % 3)).collect()
}

fn standing(folder: &Path, what: &str) {
    let track = TextTable::read(&folder.join("r/track.csv")).unwrap();
    let planes: Vec<i64> = (0..track.rows.len())
        .map(|row| number(&track, row, "azimuth_rad").to_degrees().round() as i64)
        .collect();
    assert_eq!(planes, [359, 359, 359, 359, 29, 29, 29, 29], "{what}");
    for row in 0..8 {
        let rate = number(&track, row, "y_rate_m_s");
        assert!(rate.abs() < 0.05, "{what}: {rate} m/s");
    }
    for name in ["track_001.svg", "track_002.svg"] {
        assert!(folder.join("r").join(name).exists(), "{what}: {name}");
    }
}

#[test]
fn each_plane_has_its_azimuth_and_its_own_track_in_one_file_or_in_several() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let volume = volume();
    let mut names = Vec::new();
    for (i, rays) in volume.iter().enumerate() {
        let name = format!("{i}.hpl");
        fs::write(folder.join(&name), hpl(rays, FIRST)).unwrap();
        names.push(name);
    }
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (several, warned) = retrieved(folder, &names);
    assert_eq!(warned, "");
    standing(folder, "several files");
    let all: Vec<Ray> = volume.into_iter().flatten().collect();
    fs::write(folder.join("all.hpl"), hpl(&all, FIRST)).unwrap();
    let (one, warned) = retrieved(folder, &["all.hpl"]);
    assert_eq!((warned.as_str(), summary(&one)), ("", summary(&several)));
    standing(folder, "one file");
    let expected: Vec<(i64, &str, i64)> = [
        (359, "left", 400),
        (359, "right", 440),
        (29, "left", 460),
        (29, "right", 506),
        (179, "none", 0),
    ]
    .repeat(2);
    let expected: Vec<_> = expected
        .into_iter()
        .map(|(a, s, y)| (a, s.to_owned(), y))
        .collect();
    assert_eq!(summary(&one), expected);
    let json = fs::read_to_string(folder.join("r/retrieval.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let azimuth_rad = json["scans"][1]["azimuth_rad"].as_f64().unwrap();
    assert!((azimuth_rad - 29f64.to_radians()).abs() < 1e-9);
    // A table of one turn, whose azimuths are from -180 to 180 degrees.
    fs::write(folder.join("all.csv"), csv(&all[..150], FIRST)).unwrap();
    let (table, warned) = retrieved(folder, &["all.csv"]);
    assert_eq!(
        (warned.as_str(), &summary(&table)[..]),
        ("", &expected[..5])
    );
    // Of two turns the times tell the scans apart.
    fs::write(folder.join("turns.csv"), csv(&all, FIRST)).unwrap();
    let (table, warned) = retrieved(folder, &["turns.csv"]);
    assert_eq!((warned.as_str(), summary(&table)), ("", expected));
}

/// Angles as a scanner reads them back differ from scan to scan, so that no two rows have one direction.
#[test]
fn scans_of_a_table_without_a_column_for_them_are_told_apart_by_their_times() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let mut rays = Vec::new();
    for (number, y_m) in [[400.0, 440.0], [415.0, 455.0]].into_iter().enumerate() {
        // To the north and, read back, on the other side of it.
        let azimuth = [359.995, 0.005][number];
        let mut directions = up(azimuth);
        for (line, (_, elevation)) in directions.iter_mut().enumerate() {
            *elevation += 0.02 * ((line * 7 + 3 * number) % 5) as f64;
        }
        let wake = pair(y_m, 45.0, 400.0, 2.0);
        rays.extend(scan(&wake, 0.0, &directions, 20.0 * number as f64, FIRST));
    }
    fs::write(folder.join("two.csv"), csv(&rays, FIRST)).unwrap();
    let (table, warned) = retrieved(folder, &["two.csv"]);
    assert_eq!(warned, "");
    let expected = [(400, "left"), (440, "right"), (415, "left"), (455, "right")]
        .map(|(y_m, side)| (side.to_owned(), y_m));
    let found: Vec<(String, i64)> = summary(&table)
        .into_iter()
        .map(|(_, side, y_m)| (side, y_m))
        .collect();
    assert_eq!(found, expected);
}

/// Elevations from 20 to 160 degrees, as a scanner has them that turns its azimuth at the zenith.
fn over(front: f64) -> Vec<(f64, f64)> {
    let direction = |i: i32| match 20 + 2 * i {
        elevation @ ..=90 => (front, f64::from(elevation)),
        elevation => ((front + 180.0) % 360.0, f64::from(180 - elevation)),
    };
    (0..=70).map(direction).collect()
}

#[test]
fn a_scan_over_the_zenith_sees_one_wake_and_all_of_its_plane_have_one_azimuth() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let wake = pair([-15.0, 25.0], 70.0, 400.0, 2.0);
    let back: Vec<(f64, f64)> = over(200.0).into_iter().rev().collect();
    let there = scan(&wake, 200.0, &over(200.0), 0.0, 2);
    let back = scan(&wake, 200.0, &back, 10.0, 2);
    fs::write(folder.join("there.hpl"), hpl(&there, 2)).unwrap();
    fs::write(folder.join("back.csv"), csv(&back, 2)).unwrap();
    fs::write(folder.join("back.hpl"), hpl(&back, 2)).unwrap();
    let both: Vec<Ray> = there.into_iter().chain(back).collect();
    fs::write(folder.join("both.hpl"), hpl(&both, 2)).unwrap();
    for files in [&["both.hpl"][..], &["there.hpl", "back.hpl"]] {
        let (table, warned) = retrieved(folder, files);
        assert_eq!(warned, "");
        let one = [(200, "left".to_owned(), -15), (200, "right".to_owned(), 25)];
        assert_eq!(summary(&table), [one.clone(), one].concat(), "{files:?}");
        for row in 0..4 {
            let wind_m_s = number(&table, row, "wind_m_s");
            assert!((wind_m_s - 2.0).abs() < 0.2, "{files:?}: {wind_m_s}");
        }
        let track = TextTable::read(&folder.join("r/track.csv")).unwrap();
        for row in 0..4 {
            assert!(number(&track, row, "y_rate_m_s").abs() < 0.1, "{files:?}");
        }
    }
    // In a table without sweeps the times tell both ways apart.
    fs::write(folder.join("both.csv"), csv(&both, 2)).unwrap();
    let (table, _) = retrieved(folder, &["both.csv"]);
    assert_eq!(table.rows.len(), 4);
    // Alone, the way back is seen with the azimuth with which it begins.
    let (table, _) = retrieved(folder, &["back.csv"]);
    let mirrored = [(20, "left".to_owned(), -25), (20, "right".to_owned(), 15)];
    assert_eq!(summary(&table), mirrored);
}

#[test]
fn rays_between_the_scans_are_skipped_with_a_warning_that_counts_them() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let wake = pair([400.0, 440.0], 45.0, 400.0, 2.0);
    let still = pair([400.0, 440.0], 45.0, 0.0, 1.5);
    let mut rays = scan(
        &still,
        90.0,
        &[(40.0, -0.0), (62.3, -0.0), (84.4, -0.0), (88.5, 1.9)],
        0.0,
        FIRST,
    );
    rays.extend(scan(&wake, 90.0, &up(90.0), 1.0, FIRST));
    let cut: Vec<(f64, f64)> = (0..40).map(|i| (90.0 + 3.0 * f64::from(i), 3.0)).collect();
    rays.extend(scan(&still, 90.0, &cut, 3.0, FIRST));
    let mut down = up(90.0);
    down.reverse();
    rays.extend(scan(&wake, 90.0, &down, 10.0, FIRST));
    rays[20].1 = f64::NAN;
    rays[110].1 = 60.0;
    fs::write(folder.join("csm.hpl"), hpl(&rays, FIRST)).unwrap();
    let (table, warned) = retrieved(folder, &["csm.hpl"]);
    let one = [(90, "left".to_owned(), 400), (90, "right".to_owned(), 440)];
    assert_eq!(summary(&table), [one.clone(), one].concat());
    assert_eq!(warned.lines().count(), 2, "{warned}");
    for part in [
        "csm.hpl: 1 of 144 rays have no elevation",
        "csm.hpl: 45 of 143 rays lie outside its scans",
    ] {
        assert!(warned.contains(part), "{warned}");
    }
    for row in 0..4 {
        let [mean, std] =
            ["gamma_5_15_m2_s", "gamma_5_15_std_m2_s"].map(|name| number(&table, row, name));
        // (3) over radii of 5 to 15 m
        assert!((mean - 358.84).abs() < 4.0 * std, "{mean} +- {std}");
    }
}

#[test]
fn files_of_a_day_that_cannot_be_used_are_skipped_with_the_reason() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let wake = pair([400.0, 440.0], 45.0, 400.0, 2.0);
    let rays = |start_s| scan(&wake, 90.0, &up(90.0), start_s, FIRST);
    let whole = hpl(&rays(0.0), FIRST);
    fs::write(folder.join("a.hpl"), &whole).unwrap();
    fs::write(folder.join("b.csv"), csv(&rays(60.0), FIRST)).unwrap();
    fs::write(folder.join("cut.hpl"), &whole[..whole.len() / 2]).unwrap();
    fs::write(folder.join("ray.csv"), csv(&rays(0.0)[..1], FIRST)).unwrap();
    fs::write(folder.join("few.csv"), csv(&rays(0.0)[..3], FIRST)).unwrap();
    let ppi: Vec<(f64, f64)> = (0..60).map(|i| (6.0 * f64::from(i), 3.0)).collect();
    fs::write(
        folder.join("ppi.hpl"),
        hpl(&scan(&wake, 90.0, &ppi, 0.0, FIRST), FIRST),
    )
    .unwrap();
    fs::write(folder.join("empty.csv"), "").unwrap();
    fs::write(folder.join("copy.hpl"), &whole).unwrap();
    let (table, warned) = retrieved(
        folder,
        &[
            "a.hpl",
            "cut.hpl",
            "ray.csv",
            "b.csv",
            "b.csv",
            "copy.hpl",
            "ppi.hpl",
            "empty.csv",
            "few.csv",
        ],
    );
    let files: Vec<&str> = (0..4).map(|row| text(&table, row, "file")).collect();
    assert_eq!(files, ["a.hpl", "a.hpl", "b.csv", "b.csv"], "{warned}");
    for part in [
        "cut.hpl: it is cut short",
        "ray.csv: sweep 0: it has 1 different elevations",
        "ppi.hpl: it has azimuths from",
        "empty.csv: no header",
        "few.csv: sweep 0: ",
        "b.csv: its times count from no date, those of other files do",
        "few.csv: its times count from no date",
        "b.csv: it is a copy of b.csv",
        "copy.hpl: it is a copy of a.hpl",
    ] {
        assert!(warned.contains(part), "{part}: {warned}");
    }
    assert_eq!(warned.lines().count(), 9, "{warned}");
    // Nothing is left, or a file is not there at all.
    for (files, part) in [
        (["cut.hpl", "ppi.hpl"], "cut.hpl: it is cut short"),
        (["a.hpl", "none.hpl"], "none.hpl"),
    ] {
        let out = wakescope(
            folder,
            &[&["retrieve"][..], &files, &["--out", "x", "--quiet"]].concat(),
        );
        let message = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(2), "{message}");
        assert!(
            message.contains(part) && !folder.join("x").exists(),
            "{message}"
        );
    }
}

/// A weather radar sees rotors of kilometres, which a pair of vortices explains better than a wind.
#[test]
fn the_scan_of_a_weather_radar_is_no_wake_and_the_reason_is_given() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let (model, mut noise) = (WakeModel::default(), Noise(0.3));
    let rotors = Wake::from_array(&[1e5, 1e5, 9e3, 2e3, 15e3, 2e3, 500.0, 500.0, 4.0, 1e-3, 0.0]);
    let mut rows = String::from("range_m,azimuth_deg,elevation_deg,velocity_m_s\n");
    for (line, gate) in (0..60).flat_map(|line| (0..100).map(move |gate| (line, gate))) {
        let (range_m, elevation) = (
            1000.0 + 250.0 * f64::from(gate),
            0.5 + 0.5 * f64::from(line),
        );
        let velocity = model.radial_velocity_m_s(&rotors, range_m, elevation.to_radians());
        let velocity = velocity + noise.next();
        let _ = writeln!(rows, "{range_m},0,{elevation},{velocity}");
    }
    fs::write(folder.join("radar.csv"), rows).unwrap();
    for method in ["fit", "rv"] {
        let (table, warned) = retrieved(folder, &["radar.csv", "--method", method]);
        assert_eq!(
            (table.rows.len(), text(&table, 0, "side")),
            (1, "none"),
            "{method}"
        );
        let flags = text(&table, 0, "flags");
        assert!(flags.contains("no_wake implausible"), "{method}: {flags}");
        assert!(
            warned.contains("radar.csv: sweep 0: the best fit is not a wake: the "),
            "{method}: {warned}"
        );
    }
}
