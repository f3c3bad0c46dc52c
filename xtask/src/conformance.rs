//! The conformance set: scans with exact truth, in files of every format that lidars have, for those who write readers and retrievals
//! of winds. `cases.toml` is the table of its cases; `docs/src/conformance.md` says what clients make of them.
//!
//! | module | content |
//! |---|---|
//! | `cases` | the table: which scans, of which scenes |
//! | `scan` | a scan with its peculiarities, and its true velocities |
//! | `netcdf4` | CfRadial 2 and WindCube |
//! | `truth` | what is true of a scan |
//!
//! Check: sizes, two runs, and the program's own readers on every file.

mod cases;
mod netcdf4;
mod scan;
#[cfg(test)]
mod tests;
mod truth;

use cases::{Cases, Cut, ScanCase};
use fixtures::failure::{Failure, Outcome};
use rayon::prelude::*;
use scan::Scan;
use serde_json::json;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use wakescope_sim::io::{Existing, Provenance, Table, VelocityMap, cfradial, hpl};
use wakescope_sim::write_contents;

/// What each file and the whole set may have at most, bytes.
const LARGEST_FILE: usize = 100_000;
const LARGEST_SET: usize = 2_000_000;

/// Contents of files by the numbers of their cases and their names.
type Contents = BTreeMap<(u32, String), Vec<u8>>;

/// Writes the set to a folder.
pub(crate) fn run(out: &Path, overwrite: bool) -> Outcome {
    let files = files()?;
    let count = files.len();
    let size: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
    write_contents(out, files, Existing::with_overwrite(overwrite))?;
    println!("{count} files, {size} bytes, in {}", out.display());
    Ok(())
}

/// Names and contents of all files.
fn files() -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let cases = Cases::read()?;
    let folder = tempfile::tempdir()?;
    let made: Vec<Result<Contents, Failure>> = cases
        .scan
        .par_iter()
        .map(|case| files_of_scan(&cases, case, folder.path()))
        .collect();
    let mut files = Contents::new();
    for of_scan in made {
        files.extend(of_scan?);
    }
    let mut contents = vec![
        ("manifest.csv".to_owned(), manifest(&files)?.into_bytes()),
        (
            "README.md".to_owned(),
            include_bytes!("conformance/README.md").to_vec(),
        ),
    ];
    contents.extend(files.into_iter().map(|((_, name), bytes)| (name, bytes)));
    check_sizes(&contents)?;
    Ok(contents)
}

fn check_sizes(files: &[(String, Vec<u8>)]) -> Outcome {
    let mut all = 0;
    for (name, bytes) in files {
        all += bytes.len();
        if bytes.len() > LARGEST_FILE {
            let size = bytes.len();
            let reason = format!("{name} has {size} bytes, at most {LARGEST_FILE} are allowed");
            return Err(Failure::new(reason));
        }
    }
    if all > LARGEST_SET {
        let reason = format!("the set has {all} bytes, at most {LARGEST_SET} are allowed");
        return Err(Failure::new(reason));
    }
    Ok(())
}

/// The list of the files.
fn manifest(files: &Contents) -> Result<String, Failure> {
    let mut out = String::from("file,format,case,bytes,sha256\n");
    for ((case, name), bytes) in files {
        let format = format_of(name)?;
        // Writing to a text cannot fail.
        let _ = write!(out, "{name},{format},{case},{},", bytes.len());
        for byte in Sha256::digest(bytes) {
            let _ = write!(out, "{byte:02x}");
        }
        out.push('\n');
    }
    Ok(out)
}

/// The files of a scan, with what is true of them.
fn files_of_scan(cases: &Cases, case: &ScanCase, folder: &Path) -> Result<Contents, Failure> {
    let scene = cases.scene(case, folder)?;
    let plan = wakescope_sim::Plan::new(scene, wakescope_sim::Target::Map)?;
    let scan = Scan::new(plan, case)?;
    let mut files = Contents::new();
    // By the name of the truth, the files that share it with their cases, and their first and last ray.
    let mut truths: BTreeMap<String, BTreeMap<String, u32>> = BTreeMap::new();
    let mut rays_by_truth = BTreeMap::new();
    for (name, number) in &case.files {
        let turns = if name.contains('N') {
            scan.map.sweeps.len()
        } else {
            1
        };
        for turn in 0..turns {
            let name = name.replace('N', &(turn + 1).to_string());
            let bytes = match &case.cut {
                Some(Cut::Bytes { of, kept }) if *of != name && name.contains("cut") => {
                    let whole = content(&scan, case, of, turn)?;
                    whole[..(kept * whole.len() as f64) as usize].to_vec()
                }
                Some(Cut::Ray { of, ray }) if *of != name => {
                    cut_in_ray(&content(&scan, case, of, turn)?, *ray, &scan)
                }
                _ => content(&scan, case, &name, turn)?,
            };
            let stem = truth_stem(&name).to_owned();
            rays_by_truth
                .entry(stem.clone())
                .or_insert_with(|| rays_of_turn(&scan, turn, turns));
            truths
                .entry(stem)
                .or_default()
                .insert(name.clone(), *number);
            files.insert((*number, name), bytes);
        }
    }
    for (stem, of_truth) in truths {
        let rays = rays_by_truth[&stem];
        let case = of_truth.values().copied().min().unwrap_or_default();
        let gates_before = if stem.ends_with(".hpl") {
            gates_before(&scan.map)
        } else {
            0
        };
        let json = truth::json_text(&scan, rays, gates_before, &json!(of_truth))?;
        let csv = truth::csv(&scan, rays, gates_before);
        for (ending, text) in [("json", json), ("csv", csv)] {
            let name = format!("{stem}.truth.{ending}");
            files.insert((case, name), text.into_bytes());
        }
    }
    Ok(files)
}

/// What the truth of a file is called: as the file without its ending, but for HALO files, which count gates from the lidar.
fn truth_stem(name: &str) -> &str {
    match name.strip_suffix(".hpl") {
        Some(_) => name,
        None => name.split('.').next().unwrap_or(name),
    }
}

fn format_of(name: &str) -> Result<&'static str, Failure> {
    let endings = [
        (".truth.json", "truth"),
        (".truth.csv", "truth"),
        (".cf2.nc", "CfRadial 2"),
        (".wc.nc", "WindCube"),
        (".nc", "CfRadial 1.4"),
        (".hpl", "HALO"),
        (".csv", "CSV"),
    ];
    for (ending, format) in endings {
        if name.ends_with(ending) {
            return Ok(format);
        }
    }
    Err(Failure::new(format!("{name} has no ending of a format")))
}

/// First and last ray of the file of a turn, or of the whole scan.
fn rays_of_turn(scan: &Scan, turn: usize, turns: usize) -> (usize, usize) {
    if turns > 1 {
        scan.map.sweep_bounds()[turn]
    } else {
        (0, scan.map.rays.len() - 1)
    }
}

/// Gates of a HALO file between the lidar and the first one of the map.
fn gates_before(map: &VelocityMap) -> usize {
    let gate_m = map.range_m[1] - map.range_m[0];
    (map.range_m[0] / gate_m - 0.5).round().max(0.0) as usize
}

/// What files of the set say of their origin: this program is not what measured them.
fn source() -> String {
    format!("conformance set of {}", wakescope_sim::PROGRAM)
}

/// The bytes of a whole file.
fn content(scan: &Scan, case: &ScanCase, name: &str, sweep: usize) -> Result<Vec<u8>, Failure> {
    let map = &scan.map;
    let origin = origin(scan, case);
    Ok(match format_of(name)? {
        "CfRadial 1.4" => cfradial::cfradial_bytes(map, &origin)?,
        "CfRadial 2" => netcdf4::cfradial2(map)?,
        "WindCube" => netcdf4::windcube(map)?,
        "HALO" => hpl::hpl_bytes(map, sweep, name)?,
        _ => table(map).to_csv(&origin)?.into_bytes(),
    })
}

/// Velocities of signals are of the program, with their scene; those of the air are not: no estimator is to be assumed.
fn origin(scan: &Scan, case: &ScanCase) -> Provenance {
    let own = scan.plan.file.provenance();
    match case.snr_db {
        Some(_) => own,
        None => Provenance {
            program: source(),
            scene_toml: String::new(),
            ..own
        },
    }
}

/// A scan as a table of few digits.
fn table(map: &VelocityMap) -> Table {
    let mut rays = Vec::new();
    let mut time_s = Vec::new();
    let mut azimuth_deg = Vec::new();
    let mut elevation_deg = Vec::new();
    let mut range_m = Vec::new();
    for (number, ray) in map.rays.iter().enumerate() {
        for gate_range_m in &map.range_m {
            rays.push(number as i64);
            time_s.push(decimals(ray.time_s, 6));
            azimuth_deg.push(decimals(ray.azimuth_rad.to_degrees(), 6));
            elevation_deg.push(decimals(ray.elevation_rad.to_degrees(), 6));
            range_m.push(decimals(*gate_range_m, 3));
        }
    }
    let velocity = map.field(scan::FIELDS[0]);
    let velocity_m_s = velocity.iter().flat_map(|field| field.values.iter());
    Table::new()
        .int("ray", rays)
        .float("time_s", time_s)
        .float("azimuth_deg", azimuth_deg)
        .float("elevation_deg", elevation_deg)
        .float("range_m", range_m)
        .float("velocity_m_s", velocity_m_s.map(|v| decimals(*v, 6)))
}

fn decimals(value: f64, digits: i32) -> f64 {
    let unit = 10_f64.powi(digits);
    (value * unit).round() / unit
}

/// A HALO file that ends in the middle of a ray, counted from 0.
fn cut_in_ray(bytes: &[u8], ray: usize, scan: &Scan) -> Vec<u8> {
    const HEAD: usize = 17;
    let gates = gates_before(&scan.map) + scan.map.range_m.len();
    let lines = HEAD + ray * (gates + 1) + gates / 2;
    let mut out = Vec::new();
    for line in bytes.split_inclusive(|byte| *byte == b'\n').take(lines) {
        out.extend(line);
    }
    out
}
