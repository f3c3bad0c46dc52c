//! The set is what it says, and the program's own readers, `wakescope wind` and `wakescope retrieve` pass it by the tolerances of
//! `docs/conformance/check.py`.

use super::cases::Cases;
use super::truth::{beam_swinging_m_s, sine_fit_m_s};
use super::{LARGEST_FILE, LARGEST_SET, files};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use wakescope_sim::cli::{Answer, Host, call};
use wakescope_sim::io::scans::{Ray, ScanFormat, read_rays};
use wakescope_sim::io::write_atomic;
use wakescope_sim::scene::LinearWind;

/// Largest error of a wind of exact velocities, m/s.
const WIND_M_S: f64 = 2e-3;
/// Least error of a place that is allowed, m: of millimetres in the table, and of HALO files, whose angles of two decimals move what is 400 m
/// away by up to 0.035 m. Circulations ten times as much, m^2/s.
const PLACE_M: f64 = 1e-3;
const HALO_M: f64 = 0.035;

/// A row of a table, by its columns.
type Row = BTreeMap<String, String>;

fn rows(text: &str) -> Vec<Row> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut out = Vec::new();
    for line in lines {
        let names = header.iter().map(|name| (*name).to_owned());
        out.push(names.zip(line.split(',').map(str::to_owned)).collect());
    }
    out
}

fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap_or(f64::NAN)
}

/// The set in a folder.
struct Set {
    folder: tempfile::TempDir,
    manifest: Vec<Row>,
}

impl Set {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut manifest = Vec::new();
        for (name, bytes) in files().unwrap() {
            if name == "manifest.csv" {
                manifest = rows(std::str::from_utf8(&bytes).unwrap());
            }
            write_atomic(&folder.path().join(name), bytes).unwrap();
        }
        Self { folder, manifest }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Names of the data files.
    fn data(&self) -> Vec<String> {
        let data = self.manifest.iter().filter(|row| row["format"] != "truth");
        data.map(|row| row["file"].clone()).collect()
    }

    fn truth(&self, file: &str) -> (Value, Vec<Row>) {
        let stem = super::truth_stem(file);
        let read = |ending: &str| {
            std::fs::read_to_string(self.path(&format!("{stem}.truth.{ending}"))).unwrap()
        };
        let json: Value = serde_json::from_str(&read("json")).unwrap();
        assert!(json["files"][file].is_u64(), "{file} is none of {stem}");
        (json, rows(&read("csv")))
    }

    /// Runs a command of the program on files.
    fn command(&self, command: &str, files: &[&str], options: &str) -> Result<Answer, Value> {
        let mut words = vec![OsString::from(command)];
        words.extend(files.iter().map(|file| self.path(file).into_os_string()));
        words.extend(options.split_whitespace().map(OsString::from));
        words.extend(["--out".into(), self.path("out").into_os_string()]);
        let host = Host {
            observer: Arc::new(wakescope_sim::Silent),
            texts: BTreeMap::new(),
            signals: Mutex::new(None),
            keeps_files: true,
        };
        call(&words, host)
    }

    fn table(&self, command: &str, files: &[&str], options: &str) -> Vec<Row> {
        let answer = self.command(command, files, options).unwrap();
        let name = match command {
            "wind" => "wind.csv",
            _ => "retrieval.csv",
        };
        let found = answer.files.into_iter().find(|file| file.0 == name);
        rows(std::str::from_utf8(&found.unwrap().1).unwrap())
    }
}

fn floats(value: &Value) -> Vec<f64> {
    let values = value.as_array().unwrap().iter();
    values.map(|value| value.as_f64().unwrap()).collect()
}

#[test]
fn two_runs_with_other_threads_give_the_same_small_files_of_all_cases() {
    let one = files().unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let other = pool.unwrap().install(files).unwrap();
    assert!(one == other, "another number of threads, other bytes");
    let mut size = 0;
    for (name, bytes) in &one {
        size += bytes.len();
        assert!(bytes.len() <= LARGEST_FILE, "{name}: {}", bytes.len());
    }
    assert!(size <= LARGEST_SET, "{size}");
    let cases = Cases::read().unwrap();
    let numbers = cases.scan.iter().flat_map(|scan| scan.files.values());
    let mut numbers: Vec<u32> = numbers.copied().collect();
    numbers.sort_unstable();
    assert_eq!(numbers, (1..=32).collect::<Vec<u32>>());
    let manifest = one.iter().find(|file| file.0 == "manifest.csv").unwrap();
    let manifest = rows(std::str::from_utf8(&manifest.1).unwrap());
    let listed: BTreeSet<&String> = manifest.iter().map(|row| &row["file"]).collect();
    for (name, bytes) in &one {
        if name == "manifest.csv" || name == "README.md" {
            continue;
        }
        assert!(listed.contains(name), "{name}");
        let row = manifest.iter().find(|row| row["file"] == *name).unwrap();
        assert_eq!(row["bytes"], bytes.len().to_string());
    }
    assert_eq!(listed.len() + 2, one.len());
}

#[test]
fn the_programs_own_readers_and_retrievals_pass_the_set() {
    let set = Set::new();
    every_file_is_read_as_it_was_written_and_those_cut_short_are_refused(&set);
    winds_are_the_closed_forms_and_those_of_signals_within_their_errors(&set);
    vortices_are_within_their_stated_deviations_and_none_where_there_is_none(&set, false);
    variances_of_the_six_beams_are_those_of_the_velocities(&set);
}

#[test]
#[ignore = "fits with the scene's estimator: cargo test -p xtask -- --ignored conformance"]
fn vortices_of_signals_are_retrieved_and_none_where_there_is_none() {
    vortices_are_within_their_stated_deviations_and_none_where_there_is_none(&Set::new(), true);
}

fn every_file_is_read_as_it_was_written_and_those_cut_short_are_refused(set: &Set) {
    for file in set.data() {
        let path = set.path(&file);
        if file.contains("cut") {
            let error = read_rays(&path, &ScanFormat::default()).unwrap_err();
            let text = error.to_string();
            assert!(text.contains(&file), "{text}");
            for command in ["wind", "retrieve"] {
                let refused = set.command(command, &[&file], "").unwrap_err();
                assert!(refused.to_string().contains(&file), "{refused}");
            }
            continue;
        }
        let (truth, cells) = set.truth(&file);
        let (sweeps, _) = read_rays(&path, &ScanFormat::default()).unwrap();
        let mut reference_s = 0.0;
        let mut rays = Vec::new();
        for (number, sweep) in sweeps.into_iter().enumerate() {
            if let Some(reference) = sweep.reference {
                let start = wakescope_sim::io::UtcTime::parse("2024-01-01T00:00:00Z");
                reference_s = reference.seconds_since(start.unwrap());
            }
            rays.extend(sweep.rays.into_iter().map(|ray| (number, ray)));
        }
        are_rays(&file, &truth, &rays, reference_s);
        are_velocities(&file, &truth, &rays, &cells);
    }
}

/// Holds number, sweeps, angles and times of rays against the truth.
fn are_rays(file: &str, truth: &Value, rays: &[(usize, Ray)], reference_s: f64) {
    let azimuth_deg = floats(&truth["azimuth_deg"]);
    let elevation_deg = floats(&truth["elevation_deg"]);
    let time_s = floats(&truth["time_s"]);
    let sweep = floats(&truth["sweep"]);
    assert_eq!(rays.len(), time_s.len(), "{file}");
    let is_halo = file.ends_with(".hpl");
    let angle_deg = if is_halo { 5.001e-3 } else { 1e-5 };
    let allowed_s = if is_halo { 4e-3 } else { 1e-3 };
    // A group of a WindCube is one sweep, whatever the cycles.
    let has_sweeps = !file.ends_with(".wc.nc") && !file.ends_with(".csv");
    for (number, (own_sweep, ray)) in rays.iter().enumerate() {
        let what = format!("{file}: ray {number}");
        assert!(
            !has_sweeps || *own_sweep as f64 == sweep[number],
            "{what} is in sweep {own_sweep}"
        );
        let elevation_off = ray.elevation_rad.to_degrees() - elevation_deg[number];
        assert!(elevation_off.abs() < angle_deg, "{what}: {elevation_off}");
        if file.ends_with(".csv") {
            continue;
        }
        let azimuth_off = ray.azimuth_rad.to_degrees() - azimuth_deg[number];
        let azimuth_off = azimuth_off - 360.0 * (azimuth_off / 360.0).round();
        assert!(azimuth_off.abs() < angle_deg, "{what}: {azimuth_off}");
        let off_s = reference_s + ray.time_s - time_s[number];
        assert!(off_s.abs() < allowed_s, "{what}: {off_s} s");
    }
}

/// Holds velocities and what is missing of them against the truth; those of signals against the truth with noise.
fn are_velocities(file: &str, truth: &Value, rays: &[(usize, Ray)], cells: &[Row]) {
    let before = truth["gates_before"].as_u64().unwrap() as usize;
    let range_m = floats(&truth["range_m"]);
    let nyquist_m_s = floats(&truth["nyquist_m_s"]);
    let is_folded = nyquist_m_s[0] < 10.0;
    let is_exact = !["noise", "vad_eddies", "rhi_wake_eddies", "rhi_empty"]
        .iter()
        .any(|name| file.contains(name));
    let mut missing = BTreeSet::new();
    for cell in truth["missing"].as_array().unwrap() {
        let cell = floats(cell);
        missing.insert((cell[0] as usize, cell[1] as usize));
    }
    let mut squares = 0.0;
    for cell in cells {
        let ray = number(cell, "ray") as usize;
        let gate = number(cell, "gate") as usize;
        let (sweep, found) = &rays[ray];
        let what = format!("{file}: ray {ray}, gate {gate}");
        let off_m = found.range_m[gate] - range_m[gate - before];
        assert!(off_m.abs() < 1e-3, "{what}: {off_m} m");
        let mut off_m_s = found.velocity_m_s[gate] - number(cell, "true_m_s");
        assert_eq!(off_m_s.is_nan(), missing.contains(&(ray, gate)), "{what}");
        if off_m_s.is_nan() {
            continue;
        }
        if is_folded {
            let fold_m_s = 2.0 * nyquist_m_s[*sweep];
            assert!(
                found
                    .fold_m_s
                    .is_some_and(|fold| (fold - fold_m_s).abs() < 1e-5)
            );
            off_m_s -= fold_m_s * (off_m_s / fold_m_s).round();
        }
        squares += off_m_s * off_m_s;
        let value_m_s = found.velocity_m_s[gate].abs();
        let allowed_m_s = match file.ends_with(".hpl") {
            true => 5.1e-5,
            false => 3e-7 * value_m_s + 1.6e-6,
        };
        assert!(
            !is_exact || off_m_s.abs() < allowed_m_s,
            "{what}: {off_m_s}"
        );
    }
    for (_, ray) in rays {
        assert_eq!(ray.velocity_m_s.len(), before + range_m.len(), "{file}");
    }
    let rms_m_s = (squares / cells.len() as f64).sqrt();
    assert!(
        is_exact || (0.02..1.5).contains(&rms_m_s),
        "{file}: {rms_m_s}"
    );
}

fn winds_are_the_closed_forms_and_those_of_signals_within_their_errors(set: &Set) {
    let mut winds = 0;
    let turns: Vec<String> = (1..=6)
        .map(|turn| format!("vad_uniform_{turn}.hpl"))
        .collect();
    for file in set.data() {
        let is_turn = file.starts_with("vad_uniform_");
        if file.contains("cut") || file.starts_with("stare") || (is_turn && file != turns[0]) {
            continue;
        }
        // Many cells, and read as those of CfRadial 1.4.
        if file == "ppi_uniform.cf2.nc" {
            continue;
        }
        let (truth, _) = set.truth(&file);
        let has_wake = truth["vortices"].as_array().is_some_and(|v| !v.is_empty());
        if has_wake || file.starts_with("rhi_empty") {
            continue;
        }
        let read: Vec<&str> = match is_turn {
            true => turns.iter().map(String::as_str).collect(),
            false => vec![&file],
        };
        // A sweep that is folded alone does not tell its wind from the next one.
        let options = match file.contains("nyquist") {
            true => "--gate-std 0 --every 600",
            false => "--gate-std 0",
        };
        for row in set.table("wind", &read, options) {
            winds += usize::from(is_wind(&file, &truth, &row));
        }
    }
    assert!(winds > 300, "{winds}");
}

/// Holds the wind of a height against the truth; whether it has one.
fn is_wind(file: &str, truth: &Value, row: &Row) -> bool {
    let wind = &truth["wind"];
    let of_method = match (file.starts_with("dbs"), &wind["sine_fit"]) {
        (true, Value::Object(_)) => &wind["beam_swinging"],
        (false, of_method @ Value::Object(_)) => of_method,
        _ => wind,
    };
    let height_m = floats(&wind["height_m"]);
    let has_eddies = truth["dissipation_m2_s3"].is_f64();
    let by_errors =
        has_eddies || file.contains("noise") || row["flags"].contains("vertical_taken_as_zero");
    let mut is_found = false;
    for (column, component) in [
        ("east", "east_m_s"),
        ("north", "north_m_s"),
        ("up", "up_m_s"),
        ("along", "east_m_s"),
    ] {
        let found = number(row, &format!("{column}_m_s"));
        if found.is_nan() {
            continue;
        }
        is_found = true;
        let at_m = number(row, "height_m");
        let expected = at_height(&height_m, &floats(&of_method[component]), at_m);
        // Turbulence has hundreds of winds, of which one may be beyond three standard errors.
        let errors = if has_eddies { 4.0 } else { 3.0 };
        let allowed = match by_errors {
            true => errors * number(row, &format!("{column}_std_m_s")) + WIND_M_S,
            false => WIND_M_S,
        };
        let off = found - expected;
        assert!(
            off.abs() < allowed,
            "{file}: {column} at {at_m} m: {off} > {allowed}"
        );
    }
    is_found
}

fn at_height(height_m: &[f64], values: &[f64], at_m: f64) -> f64 {
    let above = height_m.partition_point(|height| *height < at_m - 1e-3);
    if above == 0 || (height_m[above.min(height_m.len() - 1)] - at_m).abs() < 0.01 {
        return values[above.min(values.len() - 1)];
    }
    let above = above.min(height_m.len() - 1);
    let fraction = (at_m - height_m[above - 1]) / (height_m[above] - height_m[above - 1]);
    values[above - 1] + fraction * (values[above] - values[above - 1])
}

fn vortices_are_within_their_stated_deviations_and_none_where_there_is_none(
    set: &Set,
    of_signals: bool,
) {
    let mut vortices = 0;
    for file in set.data() {
        if !file.starts_with("rhi") || file.contains("cut") || file.contains("nyquist") {
            continue;
        }
        let is_of_signals = file.contains("noise") || file.contains("eddies");
        if is_of_signals != of_signals {
            continue;
        }
        let (truth, _) = set.truth(&file);
        let truth = truth["vortices"].as_array().unwrap();
        let options = if is_of_signals { "" } else { "--gate-std 0" };
        let found = set.table("retrieve", &[&file], options);
        if truth.is_empty() {
            assert!(
                found.iter().all(|row| row["side"] == "none"),
                "{file}: {found:?}"
            );
            continue;
        }
        assert_eq!(found.len(), truth.len(), "{file}: {found:?}");
        for (row, truth) in found.iter().zip(truth) {
            assert_eq!(row["side"], truth["side"].as_str().unwrap(), "{file}");
            let least_m = if file.ends_with(".hpl") {
                HALO_M
            } else {
                PLACE_M
            };
            for (value, deviation, least) in [
                ("y_m", "y_std_m", least_m),
                ("z_m", "z_std_m", least_m),
                ("gamma_5_15_m2_s", "gamma_5_15_std_m2_s", 10.0 * least_m),
            ] {
                let off = number(row, value) - truth[value].as_f64().unwrap();
                let allowed = 3.0 * number(row, deviation) + least;
                assert!(
                    off.abs() <= allowed,
                    "{file}: {value} off by {off} > {allowed}"
                );
                vortices += 1;
            }
        }
    }
    assert_eq!(vortices, 3 * 2 * if of_signals { 2 } else { 7 });
}

#[test]
fn the_closed_forms_are_those_of_fits_to_beams_in_the_linear_wind() {
    let wind = LinearWind {
        velocity_m_s: [2.0, -1.0, 0.3],
        gradient_u_per_s: [1e-3, 5e-4, 2e-2],
        gradient_v_per_s: [7e-4, 3e-3, 1e-2],
        gradient_w_per_s: [2e-3, -4e-3, 6e-3],
        ..LinearWind::default()
    };
    let elevation_rad = 1.1_f64;
    let range_m = 130.0;
    let velocity_m_s = |azimuth_rad: f64, elevation_rad: f64| {
        let (up, level) = elevation_rad.sin_cos();
        let along = [level * azimuth_rad.cos(), level * azimuth_rad.sin(), up];
        let gradients = [
            wind.gradient_u_per_s,
            wind.gradient_v_per_s,
            wind.gradient_w_per_s,
        ];
        let mut sum = 0.0;
        for i in 0..3 {
            let mut component = wind.velocity_m_s[i];
            for j in 0..3 {
                component += gradients[i][j] * range_m * along[j];
            }
            sum += along[i] * component;
        }
        sum
    };
    let beams = 24;
    let mut harmonics = [0.0; 3];
    for beam in 0..beams {
        let azimuth_rad = std::f64::consts::TAU * f64::from(beam) / f64::from(beams);
        let velocity = velocity_m_s(azimuth_rad, elevation_rad) / f64::from(beams);
        harmonics[0] += 2.0 * velocity * azimuth_rad.cos() / elevation_rad.cos();
        harmonics[1] += 2.0 * velocity * azimuth_rad.sin() / elevation_rad.cos();
        harmonics[2] += velocity / elevation_rad.sin();
    }
    let height_m = range_m * elevation_rad.sin();
    let of_sine = sine_fit_m_s(&wind, elevation_rad, height_m);
    let mut of_beams = [0.0; 3];
    for (component, from_rad) in [(0, 0.0), (1, 0.5 * std::f64::consts::PI)] {
        let opposite = velocity_m_s(from_rad + std::f64::consts::PI, elevation_rad);
        let difference = velocity_m_s(from_rad, elevation_rad) - opposite;
        of_beams[component] = 0.5 * difference / elevation_rad.cos();
    }
    of_beams[2] = velocity_m_s(0.0, 0.5 * std::f64::consts::PI);
    for component in 0..3 {
        assert!((harmonics[component] - of_sine[component]).abs() < 1e-12);
        // The vertical beam is at its own range.
        let at_m = if component == 2 { range_m } else { height_m };
        let expected = beam_swinging_m_s(&wind, at_m)[component];
        assert!(
            (of_beams[component] - expected).abs() < 1e-12,
            "{component}"
        );
    }
}

fn variances_of_the_six_beams_are_those_of_the_velocities(set: &Set) {
    let (truth, cells) = set.truth("six_beam_eddies.wc.nc");
    let beams = truth["variances"].as_array().unwrap();
    assert_eq!(beams.len(), 6);
    let zenith = beams.iter().find(|beam| beam["elevation_deg"] == 90.0);
    let mut of_gate = Vec::new();
    for cell in &cells {
        if number(cell, "ray") as usize % 6 == 5 && number(cell, "gate") == 4.0 {
            of_gate.push(number(cell, "true_m_s"));
        }
    }
    assert_eq!(of_gate.len(), 40);
    let mean = of_gate.iter().sum::<f64>() / 40.0;
    let variance = of_gate.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 40.0;
    let stated = floats(&zenith.unwrap()["variance_m2_s2"])[4];
    assert!(
        (stated - variance).abs() < 1e-5 && stated > 0.01,
        "{stated} {variance}"
    );
}

#[test]
fn the_page_of_the_set_names_every_file() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/conformance/README.md");
    let text = std::fs::read_to_string(page).unwrap();
    for scan in Cases::read().unwrap().scan {
        for name in scan.files.keys() {
            let stem = name.split(['.', 'N']).next().unwrap();
            assert!(text.contains(stem), "{name}");
        }
    }
}
