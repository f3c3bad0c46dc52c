//! `wakescope wind` on files of known winds by an independent program (`tests/reference/wind`), and on bad ones.

use crate::wakescope;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::run::run as sim_run;
use wakescope_sim::scene::SceneFile;
use wakescope_sim::wind::{WindOptions, winds_of_map};
use wakescope_sim::write::velocity_map;

const HEADER: &str = "window,start_utc,end_utc,height_m,kind,azimuth_deg,elevation_deg,east_m_s,north_m_s,up_m_s,along_m_s,radial_m_s,\
    east_std_m_s,north_std_m_s,up_std_m_s,along_std_m_s,radial_std_m_s,speed_m_s,speed_std_m_s,from_deg,from_std_deg,\
    edr_m23_s,edr_low_m23_s,edr_high_m23_s,dissipation_m2_s3,outer_scale_m,noise_std_m_s,residual_std_m_s,cells,good_cells,bad_share,\
    likelihood,flags";

fn reference() -> PathBuf {
    PathBuf::from(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/wind"
    ))
}

/// Rows of a table by its columns.
type Rows = Vec<BTreeMap<String, String>>;

fn table(path: &Path) -> Rows {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut rows = Vec::new();
    for line in lines {
        let cells = line.split(',').map(str::to_owned);
        rows.push(
            header
                .iter()
                .map(|name| (*name).to_owned())
                .zip(cells)
                .collect(),
        );
    }
    rows
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or(f64::NAN)
}

/// Runs the program on files of a pattern of the reference, or on a path.
fn run(data: &[PathBuf], words: &str) -> (tempfile::TempDir, Output) {
    let temp = tempfile::tempdir().unwrap();
    let mut line = vec!["wind"];
    line.extend(data.iter().map(|path| path.to_str().unwrap()));
    line.extend(words.split_whitespace());
    line.extend(["--out", "out"]);
    let output = wakescope(temp.path(), &line);
    (temp, output)
}

fn winds(data: &[PathBuf], words: &str) -> Rows {
    let (temp, output) = run(data, words);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{message}");
    for name in ["wind.json", "wind.nc"] {
        assert!(temp.path().join("out").join(name).exists(), "{name}");
    }
    table(&temp.path().join("out/wind.csv"))
}

/// What the program says of input that it refuses.
fn refusal(data: &[PathBuf], words: &str) -> String {
    let (_, output) = run(data, words);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn file(name: &str) -> Vec<PathBuf> {
    vec![reference().join(format!("{name}.nc"))]
}

/// The truth of a file at a height, if it has one within a metre and a half.
fn truth_at(truth: &Rows, name: &str, height_m: f64) -> Option<BTreeMap<String, String>> {
    let away = |row: &&BTreeMap<String, String>| (number(row, "height_m") - height_m).abs();
    let own = truth.iter().filter(|row| row["file"] == name);
    let nearest = own.min_by(|a, b| away(a).total_cmp(&away(b)))?;
    (away(&nearest) < 13.0).then(|| nearest.clone())
}

/// Errors over standard errors of a component against the truth of the same height, or one that is linear in it.
fn holds(
    rows: &Rows,
    name: &str,
    component: &str,
    truth_of: impl Fn(&BTreeMap<String, String>, f64) -> f64,
) -> usize {
    let truth = table(&reference().join("truth.csv"));
    let mut squares = 0.0;
    let mut count = 0;
    for row in rows {
        let found = number(row, &format!("{component}_m_s"));
        if !found.is_finite() {
            continue;
        }
        let height_m = number(row, "height_m");
        let Some(known) = truth_at(&truth, name, height_m) else {
            continue;
        };
        let std = number(row, &format!("{component}_std_m_s"));
        let error = (found - truth_of(&known, height_m)) / std;
        assert!(
            error.abs() < 5.0,
            "{name} {component} at {height_m} m: {error}"
        );
        squares += error * error;
        count += 1;
        // The dissipation with its interval.
        let edr = number(row, "edr_m23_s");
        if edr.is_finite() {
            let std = (number(row, "edr_high_m23_s").powi(2) - edr * edr) / 1.96;
            let eps23 = number(&known, "eps_m2_s3").powf(2.0 / 3.0);
            assert!(
                (edr * edr - eps23).abs() < 3.0 * std,
                "{name} at {height_m} m: {row:?}"
            );
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    eprintln!("{name} {component}: rms {rms:.2} of {count}");
    assert!(
        (0.4..=1.6).contains(&rms),
        "{name} {component}: {rms} of {count}"
    );
    count as usize
}

#[test]
fn winds_of_cones_agree_with_the_truth_within_their_standard_errors() {
    for name in ["vad_uniform", "vad_sheared", "vad_turbulent"] {
        let rows = winds(&file(name), "--gate-std 14.36");
        assert_eq!(rows[0]["kind"], "full");
        for component in ["east", "north", "up"] {
            let column = format!("{component}_m_s");
            let found = holds(&rows, name, component, |known, _| number(known, &column));
            assert!(found >= 20, "{name}: {found}");
        }
        let flagged = |flag: &str| {
            rows.iter()
                .filter(|row| row["flags"].contains(flag))
                .count()
        };
        match name {
            // Bad gates grow to 90 % at the top.
            "vad_turbulent" => assert!(flagged("noise") >= 1),
            _ => assert!(flagged("edr_below_noise") > 20, "{name}"),
        }
    }
}

#[test]
fn stares_of_several_files_are_one_wind() {
    let mut files = Vec::new();
    for number in 0..30 {
        files.extend(file(&format!("dbs_{number:03}")));
    }
    let rows = winds(&files, "--gate-std 14.36 --every 600");
    assert!(rows.iter().all(|row| row["window"] == "1"));
    for component in ["east", "north", "up"] {
        let column = format!("{component}_m_s");
        holds(&rows, "dbs", component, |known, _| number(known, &column));
    }
    // One cycle has five velocities at a height.
    let rows = winds(&files[..5], "--gate-std 14.36 --every 600");
    assert!(
        rows.iter().any(|row| row["flags"].contains("few_cells")),
        "{rows:?}"
    );
}

#[test]
fn a_scan_in_elevation_shows_the_wind_in_its_plane() {
    let rows = winds(&file("rhi"), "--gate-std 14.36");
    assert_eq!(rows[0]["kind"], "plane");
    // 3 m/s + 0.02 z along azimuth 90 degrees.
    let count = holds(&rows, "rhi", "along", |_, height_m| 3.0 + 0.02 * height_m);
    assert!(count >= 3);
    // What carries the air across the plane is not known unless it is given.
    let flag = "cross_wind_unknown";
    assert!(
        rows.iter().all(|row| row["flags"].contains(flag)),
        "{rows:?}"
    );
    let (_, output) = run(&file("rhi"), "--gate-std 14.36");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        text.contains("across the plane") && text.contains("--wind E,N"),
        "{text}"
    );
    let given = winds(&file("rhi"), "--gate-std 14.36 --wind 3,0");
    assert!(
        given.iter().all(|row| !row["flags"].contains(flag)),
        "{given:?}"
    );
}

#[test]
fn a_vertical_stare_needs_the_wind_across_it_for_its_dissipation() {
    let known = winds(
        &file("stare_vertical"),
        "--gate-std 14.36 --every 600 --wind 0,8",
    );
    assert_eq!(known[0]["kind"], "up");
    holds(&known, "stare_vertical", "up", |known, _| {
        number(known, "up_m_s")
    });
    assert!(
        known
            .iter()
            .all(|row| !row["flags"].contains("wind_assumed"))
    );
    let (_, output) = run(&file("stare_vertical"), "--gate-std 14.36 --every 600");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("--wind E,N"), "{text}");
    // The wind of a cone at the heights of the stare.
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path().join("wind.csv");
    let header = "start_utc,end_utc,height_m,east_m_s,north_m_s";
    std::fs::write(&path, format!("{header}\n,,200,0,8\n,,400,0,8\n")).unwrap();
    let words = format!("--gate-std 14.36 --every 600 --wind {}", path.display());
    let of_table = winds(&file("stare_vertical"), &words);
    assert_eq!(of_table, known);
}

#[test]
fn the_table_has_its_columns_and_the_same_bytes_for_any_number_of_threads() {
    let bytes = |threads: &str| {
        let words = format!("--gate-std 14.36 --threads {threads}");
        let (temp, output) = run(&file("vad_turbulent"), &words);
        assert!(output.status.success(), "{output:?}");
        std::fs::read_to_string(temp.path().join("out/wind.csv")).unwrap()
    };
    let one = bytes("1");
    assert!(one.lines().any(|line| line == HEADER), "{one}");
    assert_eq!(one, bytes("4"));
}

/// A table of beams with velocities of a wind, as `edit` changes each row: time, azimuth, elevation, range, velocity.
fn csv(
    folder: &Path,
    name: &str,
    rows: usize,
    edit: impl Fn(usize, &mut [f64; 5]),
) -> Vec<PathBuf> {
    let mut text = String::from("time_s,azimuth_deg,elevation_deg,range_m,velocity_m_s\n");
    for row in 0..rows {
        let azimuth_deg = (30 * (row / 4)) as f64;
        let range_m = 100.0 + 30.0 * (row % 4) as f64;
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        let ripple = 0.1 * (1.7 * row as f64).sin();
        let velocity_m_s = 0.5 * (4.0 * sin - 3.0 * cos) + ripple;
        let mut cells = [(row / 4) as f64, azimuth_deg, 60.0, range_m, velocity_m_s];
        edit(row, &mut cells);
        let cells = cells.map(|cell| {
            if cell.is_nan() {
                String::new()
            } else {
                cell.to_string()
            }
        });
        text += &(cells.join(",") + "\n");
    }
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    vec![path]
}

#[test]
fn bad_input_is_refused_or_left_out_with_its_reason() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).unwrap();
        vec![folder.join(name)]
    };
    refusal(&write("empty.csv", b""), "");
    let whole = std::fs::read(reference().join("vad_uniform.nc")).unwrap();
    let cut = write("cut.nc", &whole[..whole.len() / 2]);
    assert!(refusal(&cut, "").contains("cut.nc"));
    let mut both = cut;
    both.extend(file("vad_uniform"));
    let (_, output) = run(&both, "--gate-std 14.36");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.success() && message.contains("cut.nc"),
        "{message}"
    );
    let high = csv(folder, "high.csv", 48, |_, cells| cells[2] = 200.0);
    assert!(refusal(&high, "").contains("elevation is 200"));
    let fast = csv(folder, "fast.csv", 48, |_, cells| cells[4] = -9999.0);
    assert!(refusal(&fast, "").contains("fill value"));
    let one = csv(folder, "one.csv", 4, |_, _| {});
    assert!(refusal(&one, "--kind full").contains("three directions"));
    let undated = csv(folder, "undated.csv", 48, |_, cells| cells[0] = f64::NAN);
    assert!(refusal(&undated, "--every 60").contains("--every sweep"));
    assert!(refusal(&undated, "--wind north").contains("east and north"));
    assert!(refusal(&undated, "--wind 4,4").contains("no effect"));
    assert!(refusal(&undated, "--use-status").contains("no effect"));
    assert!(refusal(&undated, "--seed 3").contains("no effect"));
    assert!(refusal(&undated, "--min-snr 3").contains("signal-to-noise"));
}

#[test]
fn odd_input_gives_what_it_determines() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    // One ray: the wind along it.
    let rows = winds(&csv(folder, "one.csv", 4, |_, _| {}), "");
    assert!(rows.iter().all(|row| row["kind"] == "radial"));
    // Noise alone: no wind, exit code 0.
    let noise = csv(folder, "noise.csv", 400, |row, cells| {
        cells[4] = 30.0 * (0.618_033_988 * (row * row + 7 * row) as f64).fract() - 15.0;
    });
    let rows = winds(&noise, "");
    assert!(
        rows.iter()
            .all(|row| row["flags"] == "noise" && row["east_m_s"].is_empty()),
        "{rows:?}"
    );
    // Nor does a single wrong number make wind of noise.
    let spoiled = csv(folder, "spoiled.csv", 400, |row, cells| {
        cells[4] = 30.0 * (0.618_033_988 * (row * row + 7 * row) as f64).fract() - 15.0;
        if row == 17 {
            cells[4] = -99.0;
        }
    });
    let rows = winds(&spoiled, "");
    assert!(rows.iter().all(|row| row["flags"] == "noise"), "{rows:?}");
    // Angles that are not there: these rays are skipped.
    let holes = csv(folder, "holes.csv", 96, |row, cells| {
        if row < 8 {
            cells[1] = f64::NAN;
        }
    });
    let (_, output) = run(&holes, "");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.success() && message.contains("no azimuth"),
        "{message}"
    );
    // Times that go backwards give the wind of those that go forwards; elevations beyond 90 degrees look to the other side.
    let whole = csv(folder, "f.csv", 96, |_, _| {});
    let forward = winds(&whole, "");
    assert_eq!(winds(&whole, "--gate-std 0.5").len(), forward.len());
    let backward = csv(folder, "b.csv", 96, |_, cells| cells[0] = 100.0 - cells[0]);
    let over = csv(folder, "o.csv", 96, |_, cells| {
        cells[1] += 180.0;
        cells[2] = 120.0;
    });
    // Gate by gate instead of ray by ray: each row is a ray of one gate.
    let by_gate = csv(folder, "g.csv", 96, |row, cells| {
        let beam = row % 24;
        let gate = row / 24;
        let (sin, cos) = (30.0 * beam as f64).to_radians().sin_cos();
        let ripple = 0.1 * (1.7 * (4 * beam + gate) as f64).sin();
        let velocity_m_s = 0.5 * (4.0 * sin - 3.0 * cos) + ripple;
        let range_m = 100.0 + 30.0 * gate as f64;
        *cells = [beam as f64, 30.0 * beam as f64, 60.0, range_m, velocity_m_s];
    });
    for other in [winds(&backward, ""), winds(&over, ""), winds(&by_gate, "")] {
        assert_eq!(other.len(), forward.len());
        for (a, b) in forward.iter().zip(&other) {
            assert!(
                (number(a, "east_m_s") - number(b, "east_m_s")).abs() < 0.05,
                "{a:?} {b:?}"
            );
            assert!((number(a, "east_m_s") - 4.0).abs() < 0.3, "{a:?}");
        }
    }
}

#[test]
fn a_vertical_wind_that_no_air_has_is_no_answer() {
    let temp = tempfile::tempdir().unwrap();
    let at = |up_m_s: f64| {
        csv(temp.path(), "up.csv", 96, |_, cells| {
            cells[4] += up_m_s * 60f64.to_radians().sin();
        })
    };
    let rows = winds(&at(20.0), "");
    assert!(
        rows.iter()
            .all(|row| (number(row, "up_m_s") - 20.0).abs() < 1.0)
    );
    for up_m_s in [60.0, -60.0] {
        let data = at(up_m_s);
        let rows = winds(&data, "");
        for row in &rows {
            let has_none = row["flags"] == "vertical_impossible" && row["up_m_s"].is_empty();
            assert!(has_none && row["east_m_s"].is_empty(), "{row:?}");
        }
        let (_, output) = run(&data, "");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains("0 of 4 heights have a wind"), "{text}");
        assert!(text.contains("4 have no wind since it would"), "{text}");
    }
}

#[test]
fn lidars_at_two_places_are_not_one() {
    let temp = tempfile::tempdir().unwrap();
    let mut bytes = std::fs::read(reference().join("vad_uniform.nc")).unwrap();
    // The latitude is stored as a big-endian double; the other file is a degree away.
    let reader = |bytes: &[u8]| {
        let path = temp.path().join("a.nc");
        std::fs::write(&path, bytes).unwrap();
        let read = wakescope_sim::io::scans::read_rays(&path, &Default::default()).unwrap();
        read.0[0].place_deg
    };
    let Some([latitude_deg, _]) = reader(&bytes) else {
        return;
    };
    let old = latitude_deg.to_be_bytes();
    let at = bytes.windows(8).position(|window| window == old).unwrap();
    bytes[at..at + 8].copy_from_slice(&(latitude_deg + 1.0).to_be_bytes());
    let other = temp.path().join("b.nc");
    std::fs::write(&other, &bytes).unwrap();
    let mut both = file("vad_uniform");
    both.push(other);
    let message = refusal(&both, "--every 600");
    assert!(message.contains("latitude"), "{message}");
}

/// Lower factor of a covariance.
fn cholesky(mut a: ndarray::Array2<f64>) -> ndarray::Array2<f64> {
    let order = a.nrows();
    for i in 0..order {
        for j in 0..=i {
            let done = a
                .row(i)
                .slice(ndarray::s![..j])
                .dot(&a.row(j).slice(ndarray::s![..j]));
            let rest = a[[i, j]] - done;
            a[[i, j]] = if i == j {
                rest.sqrt()
            } else {
                rest / a[[j, j]]
            };
        }
        for j in i + 1..order {
            a[[i, j]] = 0.0;
        }
    }
    a
}

/// `cargo test --release -p wakescope-sim --test it -- --ignored intervals_of_a_cone --nocapture`
#[test]
#[ignore = "1200 winds: minutes"]
fn intervals_of_a_cone_cover_the_wind_in_turbulence_with_and_without_bad_gates() {
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use wakescope_estimate::wind_profile::{GateCovariance, GatePosition};
    use wakescope_sim::io::scans::Ray;
    use wakescope_sim::wind::{WindOptions, Window, wind_profiles};

    const DRAWS: usize = 200;
    let wind_m_s = [6.0, -4.0, 0.2];
    let gate_std_m = 14.36;
    let noise_m_s = 0.2;
    let half_band_m_s = 19.4;
    let mut rays = Vec::new();
    let mut gates = Vec::new();
    for beam in 0..24 {
        let ray = Ray {
            azimuth_rad: (15.0 * f64::from(beam)).to_radians(),
            elevation_rad: 60f64.to_radians(),
            time_s: f64::from(beam),
            range_m: (0..30).map(|gate| 90.0 + 30.0 * f64::from(gate)).collect(),
            ..Ray::default()
        };
        for range_m in &ray.range_m {
            gates.push(GatePosition::new(
                ray.direction(),
                *range_m,
                ray.time_s,
                wind_m_s,
            ));
        }
        rays.push(ray);
    }
    let covariance = GateCovariance::new(gate_std_m, &[60.0], 3000.0).unwrap();
    let unit = covariance.matrices(&gates).remove(0);
    let options = WindOptions {
        gate_std_m,
        ..WindOptions::default()
    };
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(66);
    for dissipation in [4e-5f64, 5e-4, 1.45e-2] {
        let mut total = &unit * dissipation.powf(2.0 / 3.0);
        // Nearly parallel beams have another rule than others, which leaves negative eigenvalues of a thousandth.
        total
            .diag_mut()
            .mapv_inplace(|variance| 1.002 * variance + noise_m_s * noise_m_s);
        let lower = cholesky(total);
        for bad_fraction in [0.0, 0.3] {
            let mut inside = [0usize; 3];
            let mut count = 0;
            for _ in 0..DRAWS {
                let normal: Vec<f64> = (0..gates.len())
                    .map(|_| StandardNormal.sample(&mut rng))
                    .collect();
                let air = lower.dot(&ndarray::Array1::from(normal));
                let mut scan = rays.clone();
                for (beam, ray) in scan.iter_mut().enumerate() {
                    let e = ray.direction();
                    let mean: f64 = (0..3).map(|d| e[d] * wind_m_s[d]).sum();
                    for gate in 0..30 {
                        let velocity = match rng.random::<f64>() < bad_fraction {
                            true => half_band_m_s * (2.0 * rng.random::<f64>() - 1.0),
                            false => mean + air[30 * beam + gate],
                        };
                        ray.velocity_m_s.push(velocity);
                    }
                }
                let window = Window {
                    start_s: 0.0,
                    end_s: 23.0,
                    rays: scan,
                };
                let found = wind_profiles(&[window], None, &options).unwrap();
                for row in found.rows.iter().filter(|row| row.has_wind()) {
                    let components = [row.east_m_s, row.north_m_s, row.up_m_s];
                    for (d, component) in components.into_iter().enumerate() {
                        let error = (component.value - wind_m_s[d]).abs();
                        inside[d] += usize::from(error <= 1.96 * component.std);
                    }
                    count += 1;
                }
            }
            let share = inside.map(|inside| inside as f64 / count as f64);
            eprintln!("dissipation {dissipation}, bad {bad_fraction}: {share:.3?} of {count}");
            assert!(
                share.iter().all(|share| (0.90..=0.995).contains(share)),
                "{share:?}"
            );
        }
    }
}

/// A scan of one realisation, whose map is that of its file.
const OWN: &str = "[flow]\nkind = \"wind\"\nprofile = \"power\"\nexponent = 0.3\nspeed_m_s = 6.0\ntoward_rad = 1.0\n\
    [detector.snr]\nreference = \"fixed\"\nsnr_db = 10.0\n[scan]\npattern = { kind = \"vad\", beams = 18 }\nrealisations = 1\n\
    range_min_m = 300.0\nrange_max_m = 400.0\n[estimator]\ngate_step_samples = 20\n[outputs]\npng = false\n";

/// Stares whose gates overlap, as those of a scene do by default.
const STARES: &str = "seed = SEED\nflow = { kind = \"uniform\", lateral_m_s = 6.0, vertical_m_s = -1.0 }\n\
    [detector.snr]\nreference = \"fixed\"\nsnr_db = 5.0\n[scan]\npattern = { kind = \"dbs\", elevation_rad = 1.0 }\n\
    range_min_m = 280.0\nrange_max_m = 420.0\n[estimator]\ngate_step_samples = 8\n";

#[test]
fn errors_of_winds_of_gates_that_overlap_are_as_large_as_stated() {
    let seeds = 20;
    let mut squares = [0.0; 3];
    for seed in 1..=seeds {
        let text = STARES.replace("SEED", &seed.to_string());
        let file = SceneFile::parse(&text, Path::new("s.toml")).unwrap();
        let plan = Plan::new(file, Target::Map).unwrap();
        let map = sim_run(&plan, &Silent).unwrap().map.unwrap();
        let options = WindOptions::of_scene(plan.scene()).unwrap();
        let found = winds_of_map(&plan, &velocity_map(&plan, &map), &options).unwrap();
        for (row, true_m_s) in found.rows.iter().zip(&found.true_m_s) {
            let winds = [row.east_m_s, row.north_m_s, row.up_m_s];
            for (square, (wind, true_m_s)) in squares.iter_mut().zip(winds.iter().zip(true_m_s)) {
                let errors = (wind.value - true_m_s) / wind.std;
                *square += errors * errors / found.rows.len() as f64;
            }
        }
    }
    // Heights share most of their noise: 20 scans have some 20 independent errors of each component.
    for square in squares {
        let rms = (square / f64::from(seeds)).sqrt();
        assert!((0.65..1.4).contains(&rms), "{rms}");
    }
}

/// Four beams in turn, each 250 times, in noise of 0.3 m/s. Some of the 1000 velocities of a height stand for the others where turbulence is
/// concerned, and they must be of all beams.
#[test]
fn errors_of_many_turns_of_four_beams_are_those_of_their_noise() {
    let temp = tempfile::tempdir().unwrap();
    let data = csv(temp.path(), "turns.csv", 4000, |row, cells| {
        let beam = row / 4 % 4;
        let (east, north) = (90.0 * beam as f64).to_radians().sin_cos();
        let chance = (12.9898 * row as f64).sin() * 43_758.545_3;
        let noise_m_s = 0.3 * 3f64.sqrt() * (2.0 * (chance - chance.floor()) - 1.0);
        cells[1] = 90.0 * beam as f64;
        cells[4] = 0.5 * (4.0 * east - 3.0 * north) + noise_m_s;
    });
    let rows = winds(&data, "--outer-scale 100 --every 3600");
    assert_eq!(rows.len(), 4);
    let expected_m_s = 0.3 / (60f64.to_radians().cos() * 500f64.sqrt());
    for row in &rows {
        for name in ["east_std_m_s", "north_std_m_s"] {
            let over = number(row, name) / expected_m_s;
            assert!((0.9..1.2).contains(&over), "{name}: {over}");
        }
        let east = number(row, "east_m_s");
        assert!((east - 4.0).abs() < 5.0 * expected_m_s, "{east}");
    }
}

#[test]
fn winds_of_a_run_are_those_of_the_command_and_beside_the_true_ones() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), OWN).unwrap();
    let output = wakescope(temp.path(), &["run", "s.toml", "--out", "out"]);
    assert!(output.status.success(), "{output:?}");
    let own = table(&temp.path().join("out/wind.csv"));
    let read = winds(&[temp.path().join("out/map.nc")], "--every sweep");
    assert!(!own.is_empty() && own.len() == read.len());
    for (own, read) in own.iter().zip(&read) {
        for name in HEADER.split(',') {
            let apart = number(own, name) - number(read, name);
            // Files have floats of four bytes.
            let is_equal = own[name] == read[name] || apart.abs() < 1e-3;
            assert!(is_equal, "{name}: {} {}", own[name], read[name]);
        }
        let speed_m_s = 6.0 * (number(own, "height_m") / 10.0).powf(0.3);
        for (name, part) in [("east", 1f64.sin()), ("north", 1f64.cos()), ("up", 0.0)] {
            let true_m_s = number(own, &format!("{name}_true_m_s"));
            assert!((true_m_s - speed_m_s * part).abs() < 1e-6, "{own:?}");
            let error_m_s = number(own, &format!("{name}_m_s")) - true_m_s;
            let std_m_s = number(own, &format!("{name}_std_m_s"));
            assert!(error_m_s.abs() < 5.0 * std_m_s, "{own:?}");
        }
    }
}
