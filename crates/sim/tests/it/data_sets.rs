//! Data sets as inputs of `retrieve` and `detect`: predictions that `score` reads.

use super::wakescope;
use std::fs;
use std::path::Path;
use wakescope_sim::io::csv_input::TextTable;

/// Two sites of eight flights of two scans, a quarter without a wake.
pub(super) const PLAN: &str = r#"
title = "two sites"
sites = 2
flights_per_site = 8
flights_per_chunk = 4
empty = 0.25
spectra = false
[split]
test_away = [1]
[scene.detector.snr]
reference = "fixed"
snr_db = 10.0
[scene.flow]
kind = "vortex_pair"
[scene.scan]
elevation_min_rad = 0.06
elevation_max_rad = 0.2
elevation_step_rad = 5e-3
range_min_m = 330.0
range_max_m = 470.0
pulses_per_line = 4
head = { sweeps = 2 }
[scene.estimator]
gate_step_samples = 16
[flight]
"flow.height_m" = { uniform = [40.0, 60.0] }
"flow.circulation_m2_s" = { uniform = [300.0, 500.0] }
"#;

/// What a command prints.
fn stdout(folder: &Path, words: &[&str]) -> String {
    let out = wakescope(folder, words);
    assert!(out.status.success(), "{words:?}: {out:?}");
    String::from_utf8(out.stdout).unwrap()
}

/// The message of a command that is refused.
fn refused(folder: &Path, words: &[&str]) -> String {
    let out = wakescope(folder, words);
    assert_eq!(out.status.code(), Some(2), "{words:?}: {out:?}");
    String::from_utf8(out.stderr).unwrap()
}

/// A statistic of all scans.
fn statistic(folder: &Path, quantity: &str, name: &str) -> f64 {
    let table = TextTable::read(&folder.join("score.csv")).unwrap();
    let wanted = ["all", "all", quantity, name];
    let row = table.rows.iter().position(|row| row[..4] == wanted);
    table.number(row.unwrap(), table.column("value").unwrap())
}

/// Makes the data set in a folder.
fn make(folder: &Path) {
    fs::write(folder.join("p.toml"), PLAN).unwrap();
    stdout(folder, &["dataset", "p.toml", "--out", "d", "--quiet"]);
}

/// Scores each method on some splits, and returns its recall and the error of its circulations, m²/s.
fn scores(folder: &Path, splits: &str) -> [(f64, f64); 3] {
    ["fit", "rv", "detect"].map(|method| {
        let (words, file): (&[&str], _) = match method {
            "detect" => (
                &["detect", "d", "--empty-scans", "2000", "--spacing", "40,60"],
                "detection",
            ),
            _ => (&["retrieve", "d", "--method", method], "retrieval"),
        };
        let options = ["--split", splits, "--out", method, "--quiet"];
        stdout(folder, &[words, &options].concat());
        let path = format!("{method}/{file}.csv");
        let out = format!("{method}/scores");
        stdout(
            folder,
            &["score", "d", &path, "--split", splits, "--out", &out],
        );
        let of = |quantity, name| statistic(&folder.join(&out), quantity, name);
        (of("vortices", "recall"), of("gamma_5_15_m2_s", "rms"))
    })
}

#[test]
fn methods_of_the_program_are_scored_on_a_data_set() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    make(folder);
    let [fit, rv, detect] = scores(folder, "test_home");
    // Two scans of one flight.
    assert!(fit.0 == 1.0 && fit.1 < 60.0, "{fit:?}");
    assert!(rv.0 >= 0.5 && rv.1 < 150.0, "{rv:?}");
    assert!(detect.0 == 1.0 && detect.1 < 200.0, "{detect:?}");
    refusals(folder);
}

#[test]
#[ignore = "a minute: fits of 36 scans"]
fn methods_find_the_wakes_of_another_site_alike_for_any_number_of_threads() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    make(folder);
    let [fit, rv, detect] = scores(folder, "test_home,test_away");
    assert!(fit.0 > 0.95 && fit.1 < 50.0, "{fit:?}");
    // Four pulses are few for a method without a model of the estimator.
    assert!(rv.0 > 0.6 && rv.1 < 150.0, "{rv:?}");
    assert!(detect.0 > 0.95 && detect.1 < 200.0, "{detect:?}");
    let auc = statistic(&folder.join("detect/scores"), "scans", "auc");
    assert!(auc > 0.9, "{auc}");
    stdout(
        folder,
        &["retrieve", "d", "--out", "one", "--threads", "1", "--quiet"],
    );
    let read = |name: &str| fs::read(folder.join(name).join("retrieval.csv")).unwrap();
    assert!(read("fit") == read("one"));
}

fn refusals(folder: &Path) {
    let beside = PLAN.replace(
        "pulses_per_line = 4",
        "pulses_per_line = 1\nlidar = { y_m = 10.0 }",
    );
    fs::write(folder.join("q.toml"), beside).unwrap();
    let words = [
        "dataset",
        "q.toml",
        "--out",
        "e",
        "--quiet",
        "--flights",
        "1",
    ];
    stdout(folder, &words);
    for method in ["retrieve", "detect"] {
        let text = refused(folder, &[method, "e", "--split", "train", "--out", "o"]);
        assert!(text.contains("scan: retrieve and detect need"), "{text}");
    }
    for (words, message) in [
        (
            &["retrieve", "d", "--scene", "p.toml"][..],
            "--scene has no effect: the plan",
        ),
        (
            &["retrieve", "d", "--towards"],
            "--towards has no effect: the velocities",
        ),
        (
            &["retrieve", "d", "--method", "signals"],
            "raw signals, which this method needs",
        ),
        (
            &["retrieve", "d", "p.toml"],
            "d: it is a data set: a command reads one alone",
        ),
        (
            &["detect", "d", "--gate-std", "9"],
            "--gate-std has no effect: the plan",
        ),
        (
            &["detect", "p.toml", "--split", "train"],
            "--split has no effect: no input",
        ),
    ] {
        let text = refused(folder, &[words, &["--out", "o"]].concat());
        assert!(text.contains(message), "{words:?}: {text}");
    }
    let chunk = folder.join("d/scans.zarr/velocity/c/2/0/0/0");
    fs::write(&chunk, b"x").unwrap();
    let text = refused(folder, &["retrieve", "d", "--out", "o"]);
    assert!(
        text.contains("velocity/c/2/0/0/0: this chunk of the store"),
        "{text}"
    );
    let plan = fs::read_to_string(folder.join("d/plan.toml")).unwrap();
    let other = plan.replace("two sites", "other sites");
    fs::write(folder.join("d/plan.toml"), other).unwrap();
    let text = refused(folder, &["retrieve", "d", "--out", "o"]);
    assert!(text.contains("d/plan.toml: it is plan"), "{text}");
    assert!(!folder.join("o").exists());
}
