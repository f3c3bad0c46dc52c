//! `wakescope score`: the reference case as a data set on disk, and what is refused.

use super::wakescope;
use serde_json::{Map, Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use wakescope_sim::io::csv_input::TextTable;
use wakescope_sim::io::zarr::{Array, METADATA, Writer, compressed, group_json, json_text};

const FLIGHTS: usize = 80;
const SCANS: usize = 6;
const FLIGHTS_PER_CHUNK: usize = 16;

fn reference(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/reference/score")
        .join(name)
}

/// Writes an array; chunks that `is_there` refuses are left out.
fn put(
    writer: &Writer,
    arrays: &mut Vec<Array>,
    (name, number): (&str, &str),
    values: &[f64],
    is_there: &dyn Fn(usize) -> bool,
) {
    let all = [("flight", FLIGHTS), ("scan", SCANS), ("vortex", 2)];
    let axes = match values.len() / FLIGHTS {
        1 => &all[..1],
        SCANS => &all[..2],
        _ => &all[..],
    };
    let array = Array::new(name, number, axes, FLIGHTS_PER_CHUNK).unwrap();
    for chunk in 0..array.chunks() {
        let rows = FLIGHTS_PER_CHUNK * array.row_len();
        let mut bytes = Vec::new();
        array.pack(
            values[chunk * rows..(chunk + 1) * rows].iter().copied(),
            &mut bytes,
        );
        if is_there(chunk) {
            let key = array.chunk_key(chunk);
            writer.put(&key, &compressed(&bytes)).unwrap();
        }
    }
    arrays.push(array);
}

/// The column of a reference table, by flight and scan, and by vortex where it has sides.
fn column(table: &str, name: &str, of: fn(&str) -> f64) -> Vec<f64> {
    let table = TextTable::read(&reference(table)).unwrap();
    let index = |name: &str| table.column(name).unwrap();
    let side = table.column("side");
    let vortices = side.map_or(1, |_| 2);
    let mut values = vec![f64::NAN; FLIGHTS * SCANS * vortices];
    for row in 0..table.rows.len() {
        let number = |name: &str| table.number(row, index(name)) as usize;
        let mut at = (number("flight") * SCANS + number("scan")) * vortices;
        if side.is_some_and(|side| table.rows[row][side] == "right") {
            at += 1;
        }
        values[at] = of(&table.rows[row][index(name)]);
    }
    values
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or(f64::NAN)
}

fn split(text: &str) -> f64 {
    let names = ["train", "validation", "test_home", "test_away"];
    names.iter().position(|name| *name == text).unwrap() as f64
}

/// The values of the first scan of each flight.
fn of_flights(values: &[f64]) -> Vec<f64> {
    values.iter().copied().step_by(SCANS).collect()
}

/// The reference case as a data set whose chunk `absent`, if any, is not there yet.
pub(super) fn data_set(folder: &Path, absent: Option<usize>) {
    let root = folder.join("scans.zarr");
    fs::create_dir_all(folder).unwrap();
    let writer = Writer::new(&root).unwrap();
    let is_there = |chunk: usize| Some(chunk) != absent;
    let mut arrays = Vec::new();
    for (name, kind, column_name, of) in [
        ("split", "uint8", "split", split as fn(&str) -> f64),
        ("site", "uint16", "site", number),
        ("snr_middle", "float64", "snr_db", number),
        ("dissipation", "float64", "dissipation_m2_s3", number),
        ("spacing", "float64", "spacing_m", number),
    ] {
        let values = of_flights(&column("scans.csv", column_name, of));
        put(&writer, &mut arrays, (name, kind), &values, &is_there);
    }
    let ages = column("scans.csv", "age_tau", number);
    put(
        &writer,
        &mut arrays,
        ("wake_age", "float64"),
        &ages,
        &is_there,
    );
    for (name, kind, column_name) in [
        ("vortex_y", "float64", "y_m"),
        ("vortex_z", "float64", "z_m"),
        ("circulation_5_15", "float64", "gamma_5_15_m2_s"),
        ("in_view", "uint8", "in_view"),
    ] {
        let values = column("vortices.csv", column_name, number);
        put(&writer, &mut arrays, (name, kind), &values, &is_there);
    }
    put(
        &writer,
        &mut arrays,
        ("ready", "uint8"),
        &[1.0; FLIGHTS],
        &is_there,
    );
    let mut attributes = Map::new();
    for (name, value) in [
        ("plan", json!("title = \"reference\"\n")),
        ("plan_hash", json!("00ff")),
        ("seed", json!(5)),
    ] {
        attributes.insert(name.into(), value);
    }
    let text = json_text(&group_json(&attributes, &arrays));
    writer.put(METADATA, text.as_bytes()).unwrap();
    fs::copy(reference("predictions.csv"), folder.join("p.csv")).unwrap();
}

/// The message of a command that is refused.
fn refused(folder: &Path, words: &[&str]) -> String {
    let out = wakescope(folder, words);
    assert_eq!(out.status.code(), Some(2), "{words:?}: {out:?}");
    String::from_utf8(out.stderr).unwrap()
}

#[test]
fn a_data_set_scores_as_the_reference_case() {
    let temp = tempfile::tempdir().unwrap();
    data_set(&temp.path().join("d"), None);
    let words = ["score", "d", "d/p.csv", "--out", "s", "--threads", "1"];
    let out = wakescope(temp.path(), &words);
    assert!(out.status.success(), "{out:?}");
    let found = TextTable::read(&temp.path().join("s/score.csv")).unwrap();
    let expected = TextTable::read(&reference("expected.csv")).unwrap();
    assert_eq!(found.header, expected.header);
    assert_eq!(found.rows.len(), expected.rows.len());
    assert_eq!(
        (found.origin().seed, &*found.origin().scene_hash),
        (5, "00ff")
    );
    let rms = |table: &TextTable| {
        let wanted = ["all", "all", "gamma_5_15_m2_s", "rms"];
        let mut rows = table.rows.iter();
        let row = rows.position(|row| row[..4] == wanted).unwrap();
        table.number(row, table.column("value").unwrap())
    };
    assert!((rms(&found) / rms(&expected) - 1.0).abs() < 1e-9);
    for name in ["score.json", "score.svg", "score.png"] {
        assert!(temp.path().join("s").join(name).exists(), "{name}");
    }
    // Another number of threads, and a list of what was scored.
    let words = ["score", "d", "d/p.csv", "--out", "t", "--threads", "2"];
    assert!(wakescope(temp.path(), &words).status.success());
    let read = |name: &str| fs::read(temp.path().join(name)).unwrap();
    assert_eq!(read("s/score.csv"), read("t/score.csv"));
    let listed = String::from_utf8(read("d/scored.csv")).unwrap();
    assert_eq!(listed.lines().count(), 2);
    fs::write(
        temp.path().join("q.csv"),
        "flight,scan,side,y_m,z_m,gamma_5_15_m2_s\n",
    )
    .unwrap();
    let out = wakescope(temp.path(), &["score", "d", "q.csv", "--missing-is-none"]);
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(
        text.starts_with("scans without a row, taken for none: "),
        "{text}"
    );
    assert!(text.contains("with other predictions before: 1"), "{text}");
    // Only scores of test splits depend on how often these were scored before.
    let words = [
        "score",
        "d",
        "q.csv",
        "--missing-is-none",
        "--split",
        "train",
    ];
    let out = wakescope(temp.path(), &words);
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(text.contains("train: "), "{text}");
    assert!(!text.contains("predictions before"), "{text}");
    let again = wakescope(temp.path(), &["score", "d", "d/p.csv", "--out", "s"]);
    assert_eq!(again.status.code(), Some(2));
}

#[test]
fn what_cannot_be_scored_is_refused_with_its_path_and_writes_nothing() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    data_set(&folder.join("d"), Some(4));
    let score = |words: &[&str]| refused(folder, &[&["score"], words].concat());
    // Flights 64 to 79, of which test_away has some, are not there yet.
    let out = wakescope(folder, &["score", "d", "d/p.csv", "--json"]);
    let found: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(found["flights_not_ready"], 16);
    assert!(
        found["rows_not_ready"]
            .as_u64()
            .is_some_and(|rows| rows > 0)
    );
    let text = score(&["nothing", "d/p.csv"]);
    assert!(text.contains("scans.zarr/zarr.json"), "{text}");
    let text = score(&["d", "d/p.csv", "--split", "home"]);
    assert!(text.contains("test_home"), "{text}");
    let table = fs::read_to_string(folder.join("d/p.csv")).unwrap();
    fs::write(
        folder.join("bad.csv"),
        table.replacen(",none,", ",nothing,", 1),
    )
    .unwrap();
    let text = score(&["d", "bad.csv", "--out", "s"]);
    assert!(
        text.contains("bad.csv: row 1, column side = \"nothing\""),
        "{text}"
    );
    let text = score(&["d", "d/p.csv", "--overwrite"]);
    assert!(text.contains("--overwrite has no effect"), "{text}");
    let chunk = folder.join("d/scans.zarr/vortex_z/c/0/0/0");
    let whole = fs::read(&chunk).unwrap();
    fs::write(&chunk, &whole[..whole.len() / 2]).unwrap();
    let text = score(&["d", "d/p.csv", "--out", "s"]);
    assert!(
        text.contains("vortex_z/c/0/0/0: this chunk of the store is damaged"),
        "{text}"
    );
    fs::remove_file(&chunk).unwrap();
    let text = score(&["d", "d/p.csv", "--out", "s"]);
    assert!(
        text.contains("vortex_z/c/0/0/0: this chunk of the store is missing"),
        "{text}"
    );
    assert!(!folder.join("s").exists());
    fs::remove_dir_all(folder.join("d/scans.zarr/ready/c")).unwrap();
    let text = score(&["d", "d/p.csv"]);
    assert!(
        text.contains("d/scans.zarr: no flight of its split test_home is ready"),
        "{text}"
    );
    // All flights of the reference case are ready, and a set that has no other split.
    let only_train = folder.join("t");
    data_set(&only_train, None);
    let root = only_train.join("scans.zarr/split/c");
    for chunk in fs::read_dir(&root).unwrap() {
        let train = compressed(&[0; FLIGHTS_PER_CHUNK]);
        fs::write(chunk.unwrap().path(), train).unwrap();
    }
    let text = score(&["t", "d/p.csv"]);
    let wanted = "t/scans.zarr: it has no flight of the split test_home: --split train names those";
    assert!(text.contains(wanted), "{text}");
}
