//! Every option of every command, given with each kind of input that the command takes: it changes
//! what the command gives, or is refused. An option that is not known here fails the test.

use super::data_sets;
use super::estimate::{npy, npz, samples};
use super::score::data_set;
use super::wakescope;
use rayon::prelude::*;
use std::cell::LazyCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use wakescope_sim::cli::command;
use wakescope_sim::io::csv_input::TextTable;

/// A pair and its signals, in so many lines and gates that fits find it.
const SCENE: &str = r#"
seed = 3
[detector.snr]
reference = "fixed"
snr_db = 10.0
[flow]
kind = "vortex_pair"
cross_wind_m_s = 3.0
[scan]
elevation_min_rad = 0.06
elevation_max_rad = 0.18
elevation_step_rad = 5e-3
range_min_m = 330.0
range_max_m = 470.0
pulses_per_line = 2
realisations = 1
[estimator]
gate_step_samples = 16
[outputs]
signals = true
flow = false
svg = false
png = false
"#;

/// A scene that is run in no time.
const TINY: &str = r#"
[detector.snr]
reference = "fixed"
snr_db = 10.0
[scan]
elevation_min_rad = 0.1
elevation_max_rad = 0.12
elevation_step_rad = 5e-3
range_min_m = 380.0
range_max_m = 440.0
pulses_per_line = 1
realisations = 2
[outputs]
svg = false
png = false
"#;

/// A data set of two chunks.
const DATASET: &str = r#"
title = "two chunks"
sites = 2
flights_per_site = 8
flights_per_chunk = 8
[scene.detector.snr]
reference = "fixed"
snr_db = 10.0
[scene.scan]
elevation_min_rad = 0.1
elevation_max_rad = 0.12
elevation_step_rad = 5e-3
range_min_m = 380.0
range_max_m = 440.0
pulses_per_line = 1
[flight]
"flow.height_m" = { uniform = [30.0, 60.0] }
"#;

const FLOW: &str = r#"
[case]
kind = "vortex_pair"
cells = [1, 16, 16]
[time]
end_s = 0.02
step_s = 0.002
"#;

const WAKE: &str = r#"
[case]
kind = "wake"
cells = [4, 32, 20]
[wake]
end_tau = 0.02
fields_tau = [0.02]
planes_tau = [0.02]
"#;

/// Options of the program itself, on which no result depends, and the one that acts only where a
/// forecast exceeds the memory of the machine: other tests of the command line hold them.
const IS_OF_THE_PROGRAM: [&str; 6] = ["threads", "quiet", "json", "help", "version", "allow-large"];

/// Options that act on what an earlier run of the same command has written.
const AFTER_A_RUN: [&str; 4] = ["overwrite", "force", "restart", "resume"];

/// A command with one kind of its inputs.
struct Kind {
    command: &'static str,
    /// Its arguments, as a user writes them in the folder of [`inputs`].
    words: &'static str,
    /// The options that are given; all if there are none.
    options: &'static [&'static str],
    /// The command line that wrote the files on which [`AFTER_A_RUN`] acts.
    before: &'static str,
}

/// A kind of inputs with which all options are given.
const fn all(command: &'static str, words: &'static str) -> Kind {
    some(command, words, &[])
}

/// A kind of inputs with which some options are given: those that depend on it.
const fn some(
    command: &'static str,
    words: &'static str,
    options: &'static [&'static str],
) -> Kind {
    Kind {
        command,
        words,
        options,
        before: "",
    }
}

/// Options of the estimator of a file's velocities.
const OF_ESTIMATOR: &[&str] = &["estimator", "pulse", "window", "weighting"];

/// Options that depend on the scans of a data set.
const ON_DATA_SET: &[&str] = &[
    "scene",
    "estimator",
    "pulse",
    "window",
    "weighting",
    "gate-std",
    "scale",
    "field",
    "towards",
    "min-snr",
    "seed",
    "method",
    "threshold",
    "false-alarm",
    "stride",
];

/// Options by which scans are read.
const OF_READING: &[&str] = &["scale", "field", "towards", "min-snr", "seed", "pulse"];

const KINDS: &[Kind] = &[
    all("init", "new.toml"),
    all("check", "tiny.toml"),
    Kind {
        before: "run tiny.toml --out out",
        ..some("check", "tiny.toml --out out", &["overwrite"])
    },
    some("check", "tiny.toml --picture set-up.svg", &["overwrite"]),
    all("run", "tiny.toml --out out"),
    all("efficiency", "tiny.toml --out out"),
    all("signal", "tiny.toml --out out"),
    all("map", "tiny.toml --out out"),
    all("estimate", "o/signals.nc --scene s.toml --out out"),
    all("estimate", "signals.npy --scene s.toml --out out"),
    all("estimate", "fortran.npy --scene s.toml --out out"),
    all("estimate", "signals.npz --scene s.toml --out out"),
    all(
        "estimate",
        "signals.bin --format f64 --scene s.toml --out out",
    ),
    all("estimate", "bytes.bin --format i8 --scene s.toml --out out"),
    all(
        "estimate",
        "pairs.npy --complex --scene complex.toml --out out",
    ),
    some(
        "estimate",
        "signals.npy --noise scene --scene s.toml --out out",
        &["scale"],
    ),
    some(
        "estimate",
        "signals.npy --noise 1e-13 --scene s.toml --out out",
        &["scale"],
    ),
    some(
        "estimate",
        "signals.npy --spectra --scene s.toml --out out",
        &["scale"],
    ),
    all("retrieve", "table.csv --out out"),
    some("retrieve", "timed.csv --out out", &["motion"]),
    all("retrieve", "o/map.nc --out out"),
    some("retrieve", "halo/halo.hpl --out out", OF_READING),
    some(
        "retrieve",
        "o/signals.nc --scene s.toml --out out",
        OF_READING,
    ),
    all("retrieve", "signals.npy --scene s.toml --out out"),
    some(
        "retrieve",
        "timed.csv --method rv --out out",
        &[
            "turbulence",
            "secondary",
            "motion",
            "core",
            "threshold",
            "profile",
        ],
    ),
    some(
        "retrieve",
        "o/map.nc --turbulence auto --out out",
        &["secondary"],
    ),
    some("retrieve", "table.csv --gate-std 9 --out out", OF_ESTIMATOR),
    some("retrieve", "table.csv --gate-std 0 --out out", OF_ESTIMATOR),
    some(
        "retrieve",
        "table.csv --gate-std 9 --estimator means --out out",
        OF_ESTIMATOR,
    ),
    some(
        "retrieve",
        "table.csv --estimator means --out out",
        OF_ESTIMATOR,
    ),
    some(
        "retrieve",
        "table.csv --estimator periodogram --out out",
        OF_ESTIMATOR,
    ),
    some(
        "retrieve",
        "table.csv --scene s.toml --out out",
        OF_ESTIMATOR,
    ),
    some(
        "retrieve",
        "table.csv --turbulence 0.5,25 --out out",
        &["secondary"],
    ),
    some(
        "retrieve",
        "table.csv --turbulence auto --out out",
        &["secondary"],
    ),
    some("retrieve", "made --split test_home --out out", ON_DATA_SET),
    some("retrieve", "made --method rv --out out", &["split"]),
    some(
        "detect",
        "made --split test_home --empty-scans 2000 --spacing 40,60 --out out",
        ON_DATA_SET,
    ),
    all("wind", "fan.csv --out out"),
    some(
        "wind",
        "o/map.nc --out out",
        &["kind", "every", "wind", "seed"],
    ),
    some("wind", "halo/halo.hpl --out out", &["field", "towards"]),
    all("bound", "tiny.toml"),
    all("bound", "tiny.toml --out bound.csv"),
    all("budget", "tiny.toml"),
    all("budget", "tiny.toml --out out"),
    some(
        "detect",
        "--scene few.toml --empty-scans 2000 --out out",
        &["spacing", "empty-scans"],
    ),
    all(
        "detect",
        "--scene few.toml --empty-scans 2000 --spacing 40,60 --out out",
    ),
    all(
        "detect",
        "few.csv --empty-scans 2000 --spacing 40,60 --out out",
    ),
    all(
        "detect",
        "few/map.nc --empty-scans 2000 --spacing 40,60 --out out",
    ),
    all(
        "detect",
        "few/signals.nc --scene few.toml --empty-scans 2000 --spacing 40,60 --out out",
    ),
    all(
        "detect",
        "few.npy --scene few.toml --empty-scans 2000 --spacing 40,60 --out out",
    ),
    all(
        "sweep",
        "tiny.toml --vary scan.lidar_height_m=1,2 --out out",
    ),
    all("sweep", "--merge swept --out out"),
    all(
        "sweep",
        "tiny.toml --vary scan.lidar_height_m=1,2 --merge swept --out out",
    ),
    all("score", "d d/p.csv"),
    all("score", "d d/p.csv --out out"),
    all("dataset", "plan.toml --out out"),
    all("dataset", "plan.toml --check"),
    all("dataset", "plan.toml --scene 1"),
    all("dataset", "--preset tiny --print"),
    all("accuracy", "tiny.toml --within 0.1 --out out"),
    all("flow", "flow.toml --out out"),
    all("flow", "flow.toml --check"),
    Kind {
        before: "flow flow.toml --out out",
        ..all("flow", "flow.toml --check --out out")
    },
    all("flow", "--example free"),
    all("wake", "wake.toml --out out"),
    all("wake", "wake.toml --print"),
];

/// Kinds whose fits need long.
const SLOW_KINDS: &[Kind] = &[
    all(
        "retrieve",
        "signals.npy --scene s.toml --method rv --out out",
    ),
    all(
        "retrieve",
        "signals.npy --scene s.toml --method envelope --out out",
    ),
    all(
        "retrieve",
        "signals.npy --scene s.toml --method signals --out out",
    ),
];

/// A value of an option that differs from its default, and from what the kinds have.
fn value(command: &str, option: &str) -> Option<&'static [&'static str]> {
    Some(match (command, option) {
        (_, "seed") => &["9"],
        ("bound", "out") => &["bound.csv"],
        ("flow" | "wake", "out") => &["flown"],
        (_, "out") => &["run"],
        ("dataset", "scene") => &["1"],
        ("dataset", "flights") => &["3"],
        ("dataset", "preset") => &["tiny"],
        (_, "scene") => &["other.toml"],
        ("init", "preset") => &["halo_streamline"],
        ("accuracy" | "wake", "preset") => &["fine"],
        (_, "picture") => &["picture.svg"],
        (_, "format") => &["f32"],
        (_, "byte-order") => &["big"],
        (_, "order") => &["pulse-major"],
        (_, "header-bytes") => &["16"],
        (_, "variable") => &["other"],
        (_, "quadrature") => &["other"],
        (_, "scale") => &["2"],
        (_, "rays") => &["rays.csv"],
        (_, "noise") => &["1e-13"],
        (_, "estimator") => &["first_moment"],
        (_, "pulse") => &["100e-9"],
        (_, "window") => &["200e-9"],
        (_, "weighting") => &["hann"],
        (_, "method") => &["rv"],
        (_, "turbulence") => &["1.2,25"],
        (_, "gate-std") => &["7"],
        (_, "ground") => &["no"],
        (_, "profile") => &["lamb-oseen"],
        (_, "core") => &["3"],
        (_, "secondary") => &["always"],
        (_, "motion") => &["yes"],
        (_, "threshold") => &["1e9"],
        (_, "lidar-height") => &["2"],
        (_, "field") => &["raw_m_s"],
        (_, "min-snr") => &["99"],
        (_, "kind") => &["up"],
        (_, "every") => &["7"],
        (_, "height-step") => &["40"],
        (_, "layer") => &["50"],
        (_, "outer-scale") => &["50"],
        (_, "wind") => &["4.2,4.2"],
        (_, "range") => &["400"],
        (_, "false-alarm") => &["0.1"],
        (_, "spacing") => &["20,40"],
        (_, "stride") => &["2,1"],
        (_, "empty-scans") => &["3000"],
        (_, "vary") => &["scan.lidar_height_m=3"],
        (_, "cases") => &["cases.csv"],
        (_, "let") => &["scan.range_max_m = 430"],
        (_, "where") => &["scan.lidar_height_m > 1"],
        (_, "merge") => &["swept"],
        (_, "shard") => &["1/2"],
        (_, "split") => &["test_home"],
        (_, "least") => &["100"],
        (_, "within") => &["0.2"],
        (_, "of") => &["std"],
        (_, "end") => &["0.01"],
        (_, "example") => &["vortex_pair"],
        (
            _,
            "complex" | "towards" | "spectra" | "pairs-only" | "independent" | "no-circulation"
            | "print" | "check" | "overwrite" | "force" | "restart" | "resume" | "use-status"
            | "missing-is-none",
        ) => &[],
        _ => return None,
    })
}

/// Files by their paths in a folder.
type Files = BTreeMap<PathBuf, Vec<u8>>;

/// All files of a folder.
fn files(folder: &Path) -> Files {
    let mut found = Files::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_owned();
                found.insert(name, fs::read(path).unwrap());
            }
        }
    }
    found
}

/// A cone with two vertical beams, some velocities flagged, in noise and turbulence of a kind.
fn fan() -> String {
    let mut text = String::from(
        "time_s,azimuth_deg,elevation_deg,range_m,velocity_m_s,raw_m_s,sigma_m_s,snr_db,flagged\n",
    );
    for beam in 0..14 {
        for gate in 0..12 {
            let azimuth_deg = 30.0 * f64::from(beam);
            let elevation_deg = if beam < 12 { 60.0 } else { 90.0 };
            let (sin, cos) = f64::to_radians(azimuth_deg).sin_cos();
            let level = f64::to_radians(elevation_deg).cos();
            let ripple = 0.4 * (2.3 * f64::from(beam) + 0.7 * f64::from(gate)).sin()
                + 0.2 * f64::from(beam * 31 + gate * gate * 7).sin();
            let velocity_m_s = level * (5.0 * sin + 2.0 * cos) + ripple;
            let range_m = 100 + 30 * gate;
            let flagged = u8::from(beam == 3);
            text += &format!(
                "{beam},{azimuth_deg},{elevation_deg},{range_m},{velocity_m_s},{level},0.3,{gate},{flagged}\n"
            );
        }
    }
    text
}

/// A folder with every kind of input.
fn inputs() -> TempDir {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let write = |name: &str, content: &[u8]| fs::write(folder.join(name), content).unwrap();
    write("s.toml", SCENE.as_bytes());
    write("tiny.toml", TINY.as_bytes());
    write("plan.toml", DATASET.as_bytes());
    write("flow.toml", FLOW.as_bytes());
    write("wake.toml", WAKE.as_bytes());
    let other = SCENE.replace("[estimator]", "[estimator]\nwindow_samples = 48");
    write("other.toml", other.as_bytes());
    let complex = SCENE.replace(
        "[detector.snr]",
        "[detector]\nsignal = \"baseband\"\n[detector.snr]",
    );
    write("complex.toml", complex.as_bytes());
    let fine = SCENE
        .replace("elevation_step_rad = 5e-3", "elevation_step_rad = 4e-3")
        .replace("range_max_m = 470.0", "range_max_m = 480.0");
    write("fine.toml", fine.as_bytes());
    let touching = fine.replace(
        "gate_step_samples = 16",
        "gate_step_samples = 32\nwindow_samples = 32",
    );
    let touching = touching.replace("range_min_m = 330.0", "range_min_m = 306.9875");
    let touching = touching.replace("[outputs]", "[outputs]\nhpl = true");
    write("halo.toml", touching.as_bytes());
    let few = SCENE.replace("elevation_step_rad = 5e-3", "elevation_step_rad = 1e-2");
    write(
        "few.toml",
        few.replace("gate_step_samples = 16", "gate_step_samples = 32")
            .as_bytes(),
    );
    write("fan.csv", fan().as_bytes());
    write("cases.csv", b"scan.lidar_height_m\n4\n5\n");
    for line in [
        "run s.toml --out o",
        "run fine.toml --out fine",
        "run tiny.toml --out run",
        "run halo.toml --out halo",
        "run few.toml --out few",
        "flow flow.toml --out flown",
        "sweep tiny.toml --vary scan.lidar_height_m=1,2 --out swept",
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let out = wakescope(folder, &words);
        assert!(out.status.success(), "{line}: {out:?}");
    }
    let (all, count) = samples(&folder.join("o/signals.nc"));
    let records = all.len() / count;
    let bytes: Vec<u8> = all.iter().flat_map(|a| a.to_le_bytes()).collect();
    write("signals.bin", &bytes);
    write("signals.npy", &npy(false, &[records, count], &all));
    let mut across = Vec::new();
    for sample in 0..count {
        for record in 0..records {
            across.push(all[record * count + sample]);
        }
    }
    write("fortran.npy", &npy(true, &[records, count], &across));
    let reversed: Vec<f64> = all.iter().rev().copied().collect();
    let shape = [records, count];
    write(
        "signals.npz",
        &npz(&[("signals", &all, &shape), ("other", &reversed, &shape)]),
    );
    let largest = all.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
    let codes: Vec<u8> = all
        .iter()
        .map(|a| (a / largest * 120.0) as i8 as u8)
        .collect();
    write("bytes.bin", &codes);
    let pairs: Vec<f64> = all
        .iter()
        .zip(&reversed)
        .flat_map(|(re, im)| [*re, *im])
        .collect();
    write("pairs.npy", &npy(false, &[records, count, 2], &pairs));
    let mut rays = String::from("elevation_rad\n");
    for line in 0..records / 2 {
        rays += &format!("{}\n", 0.05 + 0.005 * line as f64);
    }
    write("rays.csv", rays.as_bytes());
    write(
        "table.csv",
        table(&folder.join("fine/map.csv"), false).as_bytes(),
    );
    write(
        "timed.csv",
        table(&folder.join("fine/map.csv"), true).as_bytes(),
    );
    write(
        "few.csv",
        table(&folder.join("few/map.csv"), false).as_bytes(),
    );
    data_set(&folder.join("d"), None);
    let small = data_sets::PLAN.replace("sweeps = 2", "sweeps = 1");
    write("small.toml", small.as_bytes());
    let out = wakescope(folder, &["dataset", "small.toml", "--out", "made"]);
    assert!(out.status.success(), "{out:?}");
    let (few, _) = samples(&folder.join("few/signals.nc"));
    write("few.npy", &npy(false, &[few.len() / count, count], &few));
    temp
}

/// The map of a run as a table of another instrument, with a time for each line if it is timed.
fn table(map: &Path, is_timed: bool) -> String {
    let map = TextTable::read(map).unwrap();
    let columns = ["range_m", "elevation_rad", "v_scan_m_s", "snr_db"];
    let columns = columns.map(|name| map.column(name).unwrap());
    let mut text = String::from("range_m,elevation_rad,velocity_m_s,snr_db,raw_m_s,sigma_m_s");
    text += if is_timed { ",time_s\n" } else { "\n" };
    for row in 0..map.rows.len() {
        for column in columns {
            text += &format!("{:?},", map.number(row, column));
        }
        text += "0.4,0.5";
        if is_timed {
            text += &format!(",{}", 100.0 * map.number(row, columns[1]));
        }
        text += "\n";
    }
    text
}

/// What a command gives: its exit code, what it prints or why it refuses, and the files that it
/// writes.
type Given = (Option<i32>, Vec<u8>, Files);

/// A folder of inputs in which commands are run.
struct Place<'i> {
    folder: TempDir,
    inputs: &'i Files,
}

impl<'i> Place<'i> {
    fn new(inputs: &'i Files) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in inputs {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        Self { folder, inputs }
    }

    /// What a command gives with the files of the inputs, and of `before`, alone.
    fn given(&self, before: &Files, words: &[&str]) -> Given {
        let folder = self.folder.path();
        for name in files(folder).into_keys() {
            if !self.inputs.contains_key(&name) {
                fs::remove_file(folder.join(name)).unwrap();
            }
        }
        for (name, content) in before {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        let out = wakescope(
            folder,
            &[words, &["--quiet", "--json", "--threads", "1"]].concat(),
        );
        let mut written = files(folder);
        written.retain(|name, _| !self.inputs.contains_key(name));
        let printed = if out.status.code() == Some(2) {
            out.stderr
        } else {
            out.stdout
        };
        (out.status.code(), printed, written)
    }
}

/// Whether a kind of input leaves nothing to chance. Its files have the seed in them, so that they
/// differ where the seed has no effect, too.
fn is_without_chance(kind: &Kind) -> bool {
    kind.command == "estimate" && !kind.words.contains("o/signals.nc")
}

/// The command lines, of all options with one kind of input, that give what they give without the
/// option.
fn idle(definition: &clap::Command, place: &Place<'_>, kind: &Kind) -> Vec<String> {
    let command = definition.find_subcommand(kind.command).unwrap();
    let mut base = vec![kind.command];
    base.extend(kind.words.split_whitespace());
    let nothing = Files::new();
    let fresh = place.given(&nothing, &base);
    assert!(
        !kind.before.is_empty() || fresh.0 != Some(2),
        "{}: {}",
        base.join(" "),
        String::from_utf8_lossy(&fresh.1)
    );
    let before = if kind.before.is_empty() {
        fresh.2.clone()
    } else {
        let words: Vec<&str> = kind.before.split_whitespace().collect();
        place.given(&nothing, &words).2
    };
    // Only some kinds have an option that needs it.
    let again = LazyCell::new(|| place.given(&before, &base));
    let mut idle = Vec::new();
    for argument in command.get_arguments() {
        let Some(option) = argument.get_long() else {
            continue;
        };
        let long = format!("--{option}");
        // The scale states the unit of the samples, on which ratios to their own noise do not depend.
        let is_unit = (kind.command, option) == ("estimate", "scale") && kind.options.is_empty();
        let is_meant = !is_unit && (kind.options.is_empty() || kind.options.contains(&option));
        if IS_OF_THE_PROGRAM.contains(&option) || !is_meant || base.contains(&long.as_str()) {
            continue;
        }
        let value = value(kind.command, option)
            .unwrap_or_else(|| panic!("{} --{option} is not known to this test", kind.command));
        let words = [&base[..], &[&long], value].concat();
        let is_idle = if AFTER_A_RUN.contains(&option) {
            place.given(&before, &words) == *again
        } else {
            let given = place.given(&nothing, &words);
            let is_seed = option == "seed" && is_without_chance(kind);
            given == fresh || (is_seed && given.0 != Some(2))
        };
        if is_idle {
            idle.push(words.join(" "));
        }
    }
    idle
}

/// Fails if an option is given without effect and is not refused.
fn check(kinds: &[Kind]) {
    let inputs = files(inputs().path());
    let definition = command();
    // Threads of its own: they wait for processes, and other tests need those of all.
    let pool = rayon::ThreadPoolBuilder::new().build().unwrap();
    let idle: Vec<String> = pool.install(|| {
        kinds
            .par_iter()
            .flat_map(|kind| idle(&definition, &Place::new(&inputs), kind))
            .collect()
    });
    assert!(
        idle.is_empty(),
        "without effect and not refused:\n{}",
        idle.join("\n")
    );
}

#[test]
fn every_option_acts_or_is_refused_with_every_kind_of_input() {
    for command in command()
        .get_subcommands()
        .map(|command| command.get_name())
    {
        let has_kind = KINDS.iter().any(|kind| kind.command == command);
        assert!(
            has_kind || command == "help",
            "{command} has no kind of input in this test"
        );
    }
    check(KINDS);
}

#[test]
#[ignore = "minutes: each option is given with fits of all signals"]
fn every_option_acts_or_is_refused_with_every_method_of_raw_signals() {
    check(SLOW_KINDS);
}
