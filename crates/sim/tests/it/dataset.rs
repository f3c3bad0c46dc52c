//! `wakescope dataset` as a user meets it: the same bytes for threads, shards and after kills, the truth, refusals.

use super::cli::names;
use super::wakescope;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use wakescope_sim::Silent;
use wakescope_sim::dataset::plan::DatasetPlan;
use wakescope_sim::io::zarr::Store;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::run::run;

/// Two sites of eight flights of three scans, a passage after the first one.
const PLAN: &str = "title = \"two sites\"\nsites = 2\nflights_per_site = 8\nflights_per_chunk = 4\nempty = 0.25\n\
                    [scene.laser]\npulse_repetition_hz = 40.0\n\
                    [scene.detector.snr]\nreference = \"fixed\"\nsnr_db = 5.0\n\
                    [scene.flow]\nkind = \"vortex_pair\"\nmotion = \"transported\"\ncross_wind_m_s = 1.0\naircraft = { speed_m_s = 70.0, x_m = -56.0 }\n\
                    [[scene.added_flows]]\nkind = \"eddies\"\nsmallest_m = 10.0\nmodes = 256\n\
                    [scene.scan]\nlidar_height_m = 2.0\nelevation_max_rad = 0.21\nelevation_step_rad = 0.03\n\
                    range_min_m = 350.0\nrange_max_m = 420.0\npulses_per_line = 4\nhead = { sweeps = 3 }\n\
                    [scene.estimator]\nwindow_step_samples = 4\ngate_step_samples = 10\n\
                    [site]\n\"scan.lidar_height_m\" = { uniform = [1.0, 5.0] }\n\
                    [flight]\n\"flow.height_m\" = { uniform = [30.0, 60.0] }\n\
                    \"added_flows.0.dissipation_m2_s3\" = { log_uniform = [1e-5, 1e-2] }\n";

/// A folder with the plan.
fn folder() -> tempfile::TempDir {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("p.toml"), PLAN).unwrap();
    temp
}

fn words<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["dataset", "p.toml", "--quiet"], more].concat()
}

fn ran(folder: &Path, more: &[&str]) -> String {
    let out = wakescope(folder, &words(more));
    let text = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{more:?}: {text}");
    String::from_utf8(out.stdout).unwrap()
}

/// What a refused command tells.
fn refused(folder: &Path, more: &[&str]) -> String {
    let out = wakescope(folder, &words(more));
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(2), "{more:?}: {text}");
    text
}

/// Paths of all files below a folder with their contents.
fn tree(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(at) = open.pop() {
        for name in names(&at) {
            let path = at.join(name);
            match path.is_dir() {
                true => open.push(path),
                false => {
                    let content = std::fs::read(&path).unwrap();
                    found.push((path.strip_prefix(folder).unwrap().to_owned(), content));
                }
            }
        }
    }
    found.sort();
    found
}

#[track_caller]
fn assert_same(folder: &Path, one: &str, other: &str) {
    let [one, other] = [one, other].map(|name| tree(&folder.join(name)));
    for (own, there) in one.iter().zip(&other) {
        assert_eq!(own.0, there.0);
        assert!(own.1 == there.1, "{} differs", own.0.display());
    }
    assert_eq!(one.len(), other.len());
}

#[test]
fn files_have_the_same_bytes_for_threads_shards_and_after_ten_kills() {
    let temp = folder();
    let at = temp.path();
    ran(at, &["--out", "one", "--threads", "1"]);
    assert_eq!(
        names(&at.join("one")),
        ["README.md", "croissant.json", "plan.toml", "scans.zarr"]
    );
    ran(at, &["--out", "two", "--threads", "2"]);
    assert_same(at, "one", "two");
    let program = env!("CARGO_BIN_EXE_wakescope");
    let mut shards = Vec::new();
    for shard in ["1/4", "2/4", "3/4", "4/4"] {
        let more = ["--out", "four", "--shard", shard, "--threads", "1"];
        let child = Command::new(program)
            .args(words(&more))
            .current_dir(at)
            .stdout(Stdio::null())
            .spawn();
        shards.push(child.unwrap());
    }
    for mut shard in shards {
        assert!(shard.wait().unwrap().success());
    }
    assert_same(at, "one", "four");
    for kill in 0..10 {
        let more = ["--out", "killed", "--resume", "--threads", "1"];
        let mut child = Command::new(program)
            .args(words(&more))
            .current_dir(at)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(10 + 17 * kill));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    ran(at, &["--out", "killed", "--resume"]);
    assert_same(at, "one", "killed");
    // A flight is run again with those that lack in its chunk.
    ran(at, &["--out", "few", "--flights", "2"]);
    let store = Store::open(&at.join("few/scans.zarr")).unwrap();
    let ready = store.integers("ready", 0..16).unwrap();
    let there: Vec<i64> = ready.iter().copied().collect();
    assert_eq!(there, [1, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0]);
    let velocity = store.values("velocity", 2..3).unwrap();
    assert!(velocity.iter().all(|value| value.is_nan()));
    ran(at, &["--out", "few", "--resume"]);
    assert_same(at, "one", "few");
}

#[test]
fn cells_are_those_of_a_run_of_the_scene_and_vortices_are_where_lines_pass_them() {
    let temp = folder();
    let at = temp.path();
    ran(at, &["--out", "d", "--flights", "4"]);
    let store = Store::open(&at.join("d/scans.zarr")).unwrap();
    let plan = DatasetPlan::read(&at.join("d/plan.toml"), None).unwrap();
    let value = |name: &str| {
        store
            .values(name, 0..store.array(name).unwrap().shape[0])
            .unwrap()
    };
    let elevation_deg = value("elevation");
    let line_time_s = value("line_time");
    let has_wake = value("has_wake");
    let mut wakes = 0;
    for flight in [0, 1, 2, 3, 8] {
        let scene = plan.flight(flight).unwrap().scene;
        let text = ran(at, &["--scene", &flight.to_string()]);
        assert!(text.contains(&scene.hash), "{text}");
        let lidar_height_m = scene.content.scan.lidar_height_m;
        let planned = Plan::new(scene, Target::Map).unwrap();
        let map = run(&planned, &Silent).unwrap().map.unwrap();
        for (name, cells, half_step) in [
            ("velocity", &map.v_scan_m_s, 0.0025),
            ("signal_to_noise_ratio", &map.snr_db, 0.005),
            ("spectral_width", &map.width_m_s, 0.0025),
            ("quality", &map.quality, 0.005),
            ("true_velocity", &map.v_gate_m_s, 0.0025),
            ("point_velocity", &map.v_exact_m_s, 0.0025),
        ] {
            let stored = store.values(name, flight..flight + 1).unwrap();
            for (stored, measured) in stored.iter().zip(cells) {
                let apart = (stored - measured).abs();
                let is_same = stored.is_nan() && measured.is_nan();
                assert!(
                    is_same || apart <= half_step * 1.0001,
                    "{name}: {stored} {measured}"
                );
            }
        }
        let of = |name: &str| store.values(name, flight..flight + 1).unwrap();
        let [y_m, z_m, time_s, age] = ["vortex_y", "vortex_z", "passing_time", "wake_age"].map(of);
        for scan in 0..3 {
            let passed = has_wake[flight] == 1.0 && scan > 0;
            assert_eq!(age[[0, scan]].is_nan(), !passed);
            for side in 0..2 {
                let [y, z, time] = [&y_m, &z_m, &time_s].map(|values| values[[0, scan, side]]);
                assert_eq!(y.is_nan(), !passed, "{flight} {scan}");
                if !passed {
                    continue;
                }
                wakes += 1;
                let times = line_time_s.index_axis(ndarray::Axis(0), scan);
                let line = times
                    .iter()
                    .position(|line| (line - time).abs() < 1e-9)
                    .unwrap();
                let off_deg = (z - lidar_height_m).atan2(y).to_degrees() - elevation_deg[line];
                assert!(off_deg.abs() <= 0.5 * 0.03_f64.to_degrees(), "{off_deg}");
            }
        }
    }
    assert!(wakes >= 12, "{wakes}");
}

/// A plan of eight flights with a pair at rest at a lateral position, m, and further keys of the scan and tables.
fn still_plan(lateral_position_m: f64, scan: &str, tables: &str) -> String {
    format!(
        "title = \"still\"\nsites = 1\nflights_per_site = 8\nflights_per_chunk = 8\nempty = 0.0\nspectra = false\n\
         [scene.detector.snr]\nreference = \"fixed\"\nsnr_db = 10.0\n\
         [scene.flow]\nkind = \"vortex_pair\"\nmotion = \"frozen\"\nlateral_position_m = {lateral_position_m:?}\n\
         [scene.scan]\nrange_max_m = 560.0\npulses_per_line = 1\n{scan}\n\
         [scene.estimator]\ngate_step_samples = 10\n{tables}\n\
         [flight]\n\"flow.height_m\" = {{ uniform = [36.0, 44.0] }}\n"
    )
}

#[test]
fn vortices_are_in_view_wherever_the_lidar_is_and_looks() {
    let temp = tempfile::tempdir().unwrap();
    let at = temp.path();
    let mut times_s = Vec::new();
    let back = "azimuth_rad = 4.71238898038469\nlidar = { flight_azimuth_rad = 0.0 }";
    let oblique = "azimuth_rad = 0.7853981633974483\nlidar = { flight_azimuth_rad = 0.0 }";
    for (lateral_position_m, lidar) in [
        (400.0, ""),
        (520.0, "lidar = { y_m = 120.0 }"),
        (-400.0, back),
        (300.0, oblique),
        (400.0, "lidar = { velocity_m_s = [0.0, -20.0, 0.0] }"),
    ] {
        let scan = format!("elevation_step_rad = 0.01\n{lidar}");
        let text = still_plan(lateral_position_m, &scan, "");
        std::fs::write(at.join("p.toml"), text).unwrap();
        let out = format!("d{}", times_s.len());
        ran(at, &["--out", &out, "--flights", "2"]);
        let store = Store::open(&at.join(out).join("scans.zarr")).unwrap();
        let in_view = store.values("in_view", 0..2).unwrap();
        assert!(in_view.iter().all(|value| *value == 1.0), "{lidar}");
        times_s.push(store.values("passing_time", 0..2).unwrap());
    }
    assert_eq!(times_s[0], times_s[1]);
    for flight in 0..2 {
        // On the other side the right vortex is the nearer one.
        assert_eq!(times_s[0][[flight, 0, 0]], times_s[2][[flight, 0, 1]]);
        assert_eq!(times_s[0][[flight, 0, 1]], times_s[2][[flight, 0, 0]]);
    }
}

#[test]
fn the_true_wind_is_the_sum_of_all_mean_winds() {
    let temp = tempfile::tempdir().unwrap();
    let at = temp.path();
    let winds = "[[scene.added_flows]]\nkind = \"linear\"\nvelocity_m_s = [1.0, 2.0, 0.0]\ngradient_v_per_s = [1e-3, 1e-3, 0.01]\n\
                 [[scene.added_flows]]\nkind = \"uniform\"\nlateral_m_s = 0.5\nvertical_m_s = 0.1";
    let text = still_plan(400.0, "elevation_step_rad = 0.05", winds);
    std::fs::write(at.join("p.toml"), text).unwrap();
    ran(at, &["--out", "d", "--flights", "1"]);
    let store = Store::open(&at.join("d/scans.zarr")).unwrap();
    let along_m_s = store.values("wind_x", 0..1).unwrap();
    let across_m_s = store.values("wind_y", 0..1).unwrap();
    for index in 0..20 {
        let height_m = 10.0 * (index as f64 + 1.0);
        assert_eq!(along_m_s[[0, index]], 1.0);
        let off_m_s = across_m_s[[0, index]] - (2.5 + 0.01 * height_m);
        assert!(off_m_s.abs() < 1e-12, "{height_m} m: {off_m_s}");
    }
}

#[test]
fn vortices_without_truth_are_refused_and_winds_alone_are_not() {
    let temp = tempfile::tempdir().unwrap();
    let at = temp.path();
    let elevations = "elevation_step_rad = 0.01\n";
    let ppi = "lidar = { flight_azimuth_rad = 0.0 }\npattern = { kind = \"ppi\", elevations_rad = [0.1], azimuth_min_rad = 1.2, azimuth_max_rad = 1.9, azimuth_step_rad = 0.1 }";
    let stare = "pattern = { kind = \"stare\", elevation_rad = 0.1, lines = 3 }";
    let along = format!("{elevations}azimuth_rad = 1.0\nlidar = {{ flight_azimuth_rad = 1.0 }}");
    let pair = "[[scene.added_flows]]\nkind = \"calm\"\n[[scene.added_flows]]\nkind = \"vortex_pair\"\nlateral_position_m = 380.0";
    for (scan, tables, wanted) in [
        (
            ppi,
            "",
            "p.toml:18: scan.pattern.kind = \"ppi\" is not allowed: \"rhi\"",
        ),
        (stare, "", "scan.pattern.kind = \"stare\" is not allowed"),
        (
            along.as_str(),
            "",
            "scan.azimuth_rad = 1.0 is not allowed: an azimuth across",
        ),
        (
            elevations,
            pair,
            "added_flows[1].kind = \"vortex_pair\" is not allowed: a flow without vortices",
        ),
    ] {
        let text = still_plan(400.0, scan, tables);
        std::fs::write(at.join("p.toml"), &text).unwrap();
        let message = refused(at, &["--out", "d"]);
        assert!(message.contains(wanted), "{message}");
        // A pair among the added flows is there in empty flights, too.
        let text = text.replace("empty = 0.0", "empty = 1.0");
        std::fs::write(at.join("p.toml"), &text).unwrap();
        match tables {
            "" => drop(ran(at, &["--check"])),
            _ => assert!(refused(at, &["--check"]).contains(wanted)),
        }
    }
    assert_eq!(names(at), ["p.toml"]);
}

#[test]
fn plans_and_folders_that_cannot_be_are_refused_and_nothing_is_written() {
    let temp = folder();
    let at = temp.path();
    for (more, wanted) in [
        (
            &["--out", "d", "--flights", "9"][..],
            "--flights 9 is not allowed: 1 to flights_per_site, 8",
        ),
        (&["--scene", "16"], "a flight from 0 to 15"),
        (&["--scene", "1", "--resume"], "--resume has no effect"),
        (&["--check", "--resume"], "--resume has no effect"),
        (&["--out", "d", "--shard", "5/4"], "a shard is NUMBER/COUNT"),
        (
            &["--out", "d", "--shard", "1/4", "--overwrite"],
            "cannot be used with",
        ),
        (&["--out", "p.toml/d"], "p.toml"),
    ] {
        let text = refused(at, more);
        assert!(text.contains(wanted), "{more:?}: {text}");
    }
    let sweeps = PLAN.replace(
        "head = { sweeps = 3 }",
        "head = { sweeps = 3, direction = \"alternate\" }",
    );
    std::fs::write(at.join("p.toml"), sweeps).unwrap();
    let text = refused(at, &["--out", "d"]);
    assert!(
        text.contains("the same lines") && text.contains("flight "),
        "{text}"
    );
    let few_lags = PLAN.replace(
        "[scene.estimator]\n",
        "[scene.estimator]\nweighting = \"rectangular\"\nmethod = { kind = \"autoregressive\", order = 4 }\n",
    );
    std::fs::write(at.join("p.toml"), few_lags).unwrap();
    let text = refused(at, &["--out", "d"]);
    assert!(text.contains("spectra need the correlogram"), "{text}");
    assert_eq!(names(at), ["p.toml"]);
    std::fs::write(at.join("p.toml"), PLAN).unwrap();
    ran(at, &["--out", "d", "--flights", "1"]);
    let before = tree(&at.join("d"));
    let text = refused(at, &["--out", "d"]);
    assert!(
        text.contains("ready/c/0") && text.contains("--resume"),
        "{text}"
    );
    let text = refused(at, &["--out", "d", "--resume", "--seed", "2"]);
    assert!(text.contains("seed is 1 there, 2 here"), "{text}");
    std::fs::create_dir_all(at.join("other/scans.zarr/kept")).unwrap();
    let text = refused(at, &["--out", "other", "--overwrite"]);
    assert!(
        text.contains("no Zarr group that --overwrite may replace"),
        "{text}"
    );
    assert!(tree(&at.join("d")) == before);
    let version = std::fs::read_to_string(at.join("d/scans.zarr/zarr.json")).unwrap();
    let other = version.replace("\"program\": \"wakescope ", "\"program\": \"wakescope 9");
    std::fs::write(at.join("d/scans.zarr/zarr.json"), other).unwrap();
    let text = refused(at, &["--out", "d", "--resume"]);
    assert!(text.contains("program is"), "{text}");
}

/// A limit on the size of files stands for a full disk.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_is_full_leaves_whole_chunks_and_a_resumed_run_goes_on() {
    let temp = folder();
    let at = temp.path();
    ran(at, &["--out", "whole"]);
    let limited = format!(
        "trap '' XFSZ; ulimit -f 8; exec {} dataset p.toml --quiet --out d",
        env!("CARGO_BIN_EXE_wakescope")
    );
    let out = Command::new("bash")
        .args(["-c", &limited])
        .current_dir(at)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{text}");
    assert!(
        text.contains("cannot write d/") && text.contains("File too large"),
        "{text}"
    );
    for (path, content) in tree(&at.join("d")) {
        assert!(
            std::fs::read(at.join("whole").join(&path)).unwrap() == content,
            "{}",
            path.display()
        );
    }
    ran(at, &["--out", "d", "--resume"]);
    assert_same(at, "whole", "d");
}
