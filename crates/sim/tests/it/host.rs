//! Commands that another program runs in its own process: kept files are those that the program writes, signals of an array are those
//! of a file, refusals are objects.

use num_complex::Complex;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use wakescope_sim::cli::{Answer, Host, Refusal, call};
use wakescope_sim::io::Existing;
use wakescope_sim::io::raw::{RawRecords, RecordSource};
use wakescope_sim::{Silent, write_contents};

const SCENE: &str = "scan.elevation_min_rad = 0.1\nscan.elevation_max_rad = 0.11\nscan.pulses_per_line = 1\n\
                     outputs.signals = true\noutputs.svg = false\noutputs.png = false\n";

fn run(
    words: &[&str],
    text: &str,
    signals: Option<RawRecords>,
    keeps_files: bool,
) -> Result<Answer, Refusal> {
    let words: Vec<OsString> = words.iter().map(OsString::from).collect();
    let texts = BTreeMap::from([(PathBuf::from("scene"), text.to_owned())]);
    call(
        &words,
        Host {
            observer: Arc::new(Silent),
            texts,
            signals: Mutex::new(signals),
            keeps_files,
        },
    )
}

#[test]
fn kept_files_are_those_that_are_written() {
    let temp = tempfile::tempdir().unwrap();
    let out = temp.path().join("out");
    let kept = run(&["run", "scene", "--out", "."], SCENE, None, true).unwrap();
    let written = run(
        &["run", "scene", "--out", out.to_str().unwrap()],
        SCENE,
        None,
        false,
    )
    .unwrap();
    assert!(
        written.files.is_empty()
            && kept.files.len() > 4
            && kept.object["results"] == written.object["results"]
    );
    for (name, content) in &kept.files {
        assert_eq!(&std::fs::read(out.join(name)).unwrap(), content, "{name}");
    }
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), kept.files.len());
    let again = write_contents(
        &temp.path().join("again"),
        kept.files.clone(),
        Existing::Refuse,
    )
    .unwrap();
    assert_eq!(again.len(), kept.files.len());
    let bound = run(&["bound", "scene", "--out", "bound.csv"], SCENE, None, true).unwrap();
    assert!(bound.files[0].0 == "bound.csv" && !Path::new("bound.csv").exists());
}

/// Signals in memory \[record, sample\].
#[derive(Debug)]
struct Memory(Vec<f64>, usize);

impl RecordSource for Memory {
    fn read(
        &mut self,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> Result<Vec<Complex<f64>>, String> {
        let of_record = |record: usize| {
            self.0[record * self.1..][samples.clone()]
                .iter()
                .map(|a| Complex::new(*a, 0.0))
        };
        Ok(records.flat_map(of_record).collect())
    }
}

#[test]
fn signals_of_an_array_give_the_map_of_those_of_a_file() {
    let temp = tempfile::tempdir().unwrap();
    let out = temp.path().to_str().unwrap();
    run(&["run", "scene", "--out", out], SCENE, None, false).unwrap();
    let mut file = netcdf3::FileReader::open(temp.path().join("signals.nc")).unwrap();
    let samples = file.data_set().dim_size("time").unwrap();
    let current_a = file.read_var_f64("current_a").unwrap();
    let records = current_a.len() / samples;
    let npy = temp.path().join("signals.npy");
    let head =
        format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({records}, {samples}), }}");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((head.len() as u16).to_le_bytes());
    bytes.extend(head.bytes());
    bytes.extend(current_a.iter().flat_map(|a| a.to_le_bytes()));
    std::fs::write(&npy, bytes).unwrap();
    let of = |scale: f64, records: usize| {
        let memory = Memory(current_a.iter().map(|a| a * scale).collect(), samples);
        RawRecords::new(
            Path::new("signals"),
            memory,
            [records, samples],
            false,
            false,
        )
    };
    let array = |scale: f64| of(scale, records);
    let words = |data| {
        [
            "estimate", data, "--scene", "scene", "--noise", "scene", "--out", ".",
        ]
    };
    let of_file = run(&words(npy.to_str().unwrap()), SCENE, None, true).unwrap();
    let of_array = run(&words("signals"), SCENE, Some(array(1.0)), true).unwrap();
    assert_eq!(of_array.files, of_file.files);
    let scaled = run(
        &[&words("signals")[..], &["--scale", "0.125"]].concat(),
        SCENE,
        Some(array(8.0)),
        true,
    )
    .unwrap();
    assert_eq!(scaled.files, of_file.files);
    let none = run(&words("signals"), SCENE, Some(of(1.0, 0)), true).unwrap_err();
    assert!(
        none["error"].as_str().unwrap().contains("no records"),
        "{none:?}"
    );
}

#[test]
fn refusals_are_objects_with_key_value_and_limit_and_no_line_of_a_text_that_nobody_wrote() {
    let refused = run(
        &["run", "scene", "--out", "."],
        "[scan]\nrealisations = 0\n",
        None,
        true,
    )
    .unwrap_err();
    let problem = &refused["problems"][0];
    assert_eq!(problem["key"], "scan.realisations");
    assert!(
        problem["line"].is_null() && problem["value"] == "0" && problem["file"] == "scene",
        "{refused}"
    );
    assert_eq!(
        refused["error"],
        "scene: scan.realisations = 0 is not allowed: a whole number from 1 to 1000000"
    );
    let word = run(
        &[
            "detect",
            "--scene",
            "scene",
            "--false-alarm",
            "0.7",
            "--out",
            ".",
        ],
        SCENE,
        None,
        true,
    );
    let problem = &word.unwrap_err()["problems"][0];
    assert_eq!(
        (problem["key"].as_str(), problem["value"].as_str()),
        (Some("--false-alarm <RATE>"), Some("0.7"))
    );
}
