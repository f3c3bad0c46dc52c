//! `wakescope sweep` as a user meets it: threads, shards, kills, refusals.

use super::cli::names;
use super::wakescope;
use std::path::Path;

const SCENE: &str = "seed = 5\n[scan]\nelevation_min_rad = 0.1\nelevation_max_rad = 0.11\nelevation_step_rad = 2.5e-3\n\
                     range_min_m = 350.0\nrange_max_m = 420.0\npulses_per_line = 2\nrealisations = 3\n";

const SWEEP: [&str; 8] = [
    "sweep",
    "s.toml",
    "--vary",
    "pulse.energy_j=50e-6,150e-6,600e-6",
    "--vary",
    "pulse.duration_s=log:100e-9:400e-9:3",
    "--let",
    "detector.bandwidth_hz = 5/pulse.duration_s",
];

fn folder() -> tempfile::TempDir {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SCENE).unwrap();
    temp
}

fn ran(folder: &Path, words: &[&str]) -> String {
    let out = wakescope(folder, words);
    assert!(
        out.status.success(),
        "{words:?}: {}",
        String::from_utf8_lossy(&out.stderr)
    );
    String::from_utf8(out.stdout).unwrap()
}

/// The sweep into a folder, with more words.
fn swept(folder: &Path, more: &[&str]) -> String {
    ran(folder, &[&SWEEP[..], &["--quiet", "--json"], more].concat())
}

fn read(folder: &Path, file: &str) -> Vec<u8> {
    std::fs::read(folder.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

#[test]
fn results_have_the_same_bytes_for_threads_shards_and_after_a_kill() {
    let temp = folder();
    let at = temp.path();
    let summary: serde_json::Value =
        serde_json::from_str(&swept(at, &["--out", "one", "--threads", "1"])).unwrap();
    // A duration has its ranges and so its curve; an energy has its signals.
    let counts = ["cases", "run", "flows", "efficiencies", "signals"]
        .map(|name| summary[name].as_u64().unwrap());
    assert_eq!(counts, [9, 9, 1, 3, 9]);
    let files = [
        "cases",
        "front.csv",
        "front.png",
        "front.svg",
        "results.csv",
        "results.nc",
    ];
    assert!(
        files
            .iter()
            .all(|file| names(&at.join("one")).contains(&(*file).to_owned()))
    );
    assert_eq!(
        names(&at.join("one/cases/00008")),
        ["result.json", "scene.toml"]
    );
    let expected = read(at, "one/results.csv");
    assert!(
        String::from_utf8_lossy(&expected)
            .contains("\ncase,pulse.energy_j,pulse.duration_s,detector.bandwidth_hz,")
    );

    swept(at, &["--out", "two", "--threads", "2"]);
    for file in names(&at.join("one"))
        .iter()
        .filter(|f| !["cases", "times.csv"].contains(&f.as_str()))
    {
        assert!(
            read(at, &format!("one/{file}")) == read(at, &format!("two/{file}")),
            "{file}"
        );
    }

    // Three shards, two of them in one folder; one cannot be merged without the others.
    for (shard, out) in [("1/3", "a"), ("2/3", "b"), ("3/3", "b")] {
        swept(at, &["--shard", shard, "--out", out]);
    }
    assert!(!at.join("b/results.csv").exists());
    let lacking = wakescope(at, &["sweep", "--merge", "b", "--out", "half"]);
    let message = String::from_utf8(lacking.stderr).unwrap();
    assert_eq!(lacking.status.code(), Some(2));
    assert!(
        message.contains("3 of the 9 cases have no result") && message.contains("0, 3, 6"),
        "{message}"
    );
    assert!(!at.join("half").exists());
    ran(at, &["sweep", "--merge", "b", "a", "--out", "merged"]);
    assert!(
        read(at, "merged/results.csv") == expected
            && read(at, "merged/results.nc") == read(at, "one/results.nc")
    );
    ran(
        at,
        &[&SWEEP[..], &["--merge", "a", "b", "--out", "again"]].concat(),
    );
    assert!(read(at, "again/results.csv") == expected);

    // A shard of another sweep does not fit.
    ran(
        at,
        &[
            "sweep",
            "s.toml",
            "--vary",
            "pulse.energy_j=1e-6,2e-6",
            "--quiet",
            "--shard",
            "1/2",
            "--out",
            "other",
        ],
    );
    let foreign = wakescope(
        at,
        &["sweep", "--merge", "a", "b", "other", "--out", "mixed"],
    );
    let message = String::from_utf8(foreign.stderr).unwrap();
    assert!(
        foreign.status.code() == Some(2) && message.contains("only shards of one sweep"),
        "{message}"
    );

    // Killed as soon as two cases have results, then resumed; a result of another version is made anew.
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_wakescope"))
        .args([&SWEEP[..], &["--quiet", "--out", "killed"]].concat())
        .current_dir(at)
        .spawn()
        .unwrap();
    while !at.join("killed/cases/00001/result.json").exists() && child.try_wait().unwrap().is_none()
    {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let old = at.join("killed/cases/00000/result.json");
    let text = std::fs::read_to_string(&old)
        .unwrap()
        .replace("\"source\": \"wakescope ", "\"source\": \"wakescope 0.0.");
    std::fs::write(&old, text).unwrap();
    let summary: serde_json::Value =
        serde_json::from_str(&swept(at, &["--resume", "--out", "killed"])).unwrap();
    let (run, kept) = (
        summary["run"].as_u64().unwrap(),
        summary["kept"].as_u64().unwrap(),
    );
    assert!(run + kept == 9 && kept >= 1 && run >= 1, "{run} {kept}");
    assert!(read(at, "killed/results.csv") == expected);
    let summary: serde_json::Value =
        serde_json::from_str(&swept(at, &["--resume", "--out", "killed"])).unwrap();
    assert_eq!(summary["run"], 0);
}

#[test]
fn draws_of_many_pulses_have_the_same_bytes_for_any_shard() {
    let temp = folder();
    let at = temp.path();
    let words = [
        "sweep",
        "s.toml",
        "--vary",
        "scan.pulses_per_line=2000,4000,8000",
        "--quiet",
        "--out",
    ];
    ran(at, &[&words[..], &["whole", "--threads", "2"]].concat());
    for (shard, out) in [("1/2", "first"), ("2/2", "second")] {
        ran(at, &[&words[..], &[out, "--shard", shard]].concat());
    }
    ran(
        at,
        &["sweep", "--merge", "first", "second", "--out", "merged"],
    );
    assert!(read(at, "merged/results.csv") == read(at, "whole/results.csv"));
}

#[test]
fn shards_that_begin_together_in_one_folder_all_end() {
    let temp = folder();
    let at = temp.path();
    swept(at, &["--out", "one"]);
    let begin = |shard: usize| {
        let shard = format!("{shard}/9");
        std::process::Command::new(env!("CARGO_BIN_EXE_wakescope"))
            .args(
                [
                    &SWEEP[..],
                    &[
                        "--quiet",
                        "--threads",
                        "1",
                        "--shard",
                        &shard,
                        "--out",
                        "deep/all",
                    ],
                ]
                .concat(),
            )
            .current_dir(at)
            .stderr(std::process::Stdio::piped())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap()
    };
    let begun: Vec<_> = (1..=9).map(begin).collect();
    for child in begun {
        let out = child.wait_with_output().unwrap();
        assert!(
            out.status.success(),
            "{}",
            String::from_utf8_lossy(&out.stderr)
        );
    }
    ran(at, &["sweep", "--merge", "deep/all", "--out", "merged"]);
    assert!(read(at, "merged/results.csv") == read(at, "one/results.csv"));
    let hidden = names(&at.join("deep/all"));
    assert!(
        !hidden.iter().any(|name| name.starts_with('.')),
        "{hidden:?}"
    );
}

#[test]
fn a_sweep_continues_in_its_folder_and_replaces_another_one_only_with_overwrite() {
    let temp = folder();
    let at = temp.path();
    let of = |energies: &str, more: &[&str]| {
        let vary = format!("pulse.energy_j={energies}");
        wakescope(
            at,
            &[
                &[
                    "sweep",
                    "s.toml",
                    "--vary",
                    &vary,
                    "--quiet",
                    "--out",
                    "o",
                    "--no-circulation",
                ],
                more,
            ]
            .concat(),
        )
    };
    assert!(of("50e-6,150e-6", &[]).status.success());
    let expected = read(at, "o/results.csv");
    for (energies, words, wanted) in [
        ("50e-6,150e-6", &[][..], "--resume"),
        ("60e-6", &[], "another sweep"),
        ("60e-6", &["--resume"], "another sweep"),
    ] {
        let refused = of(energies, words);
        let message = String::from_utf8(refused.stderr).unwrap();
        assert_eq!(refused.status.code(), Some(2), "{message}");
        assert!(
            message.contains(wanted) && message.contains("--overwrite"),
            "{message}"
        );
    }
    assert!(read(at, "o/results.csv") == expected);
    // A damaged result is none.
    std::fs::write(at.join("o/cases/00001/result.json"), "[]").unwrap();
    let damaged = of("50e-6,150e-6", &["--resume"]);
    assert!(damaged.status.success(), "{damaged:?}");
    assert!(read(at, "o/results.csv") == expected);
    assert!(of("50e-6,150e-6", &["--overwrite"]).status.success());
    assert!(read(at, "o/results.csv") == expected);
    assert!(of("60e-6", &["--overwrite"]).status.success());
}

#[test]
fn what_cannot_be_swept_is_refused_before_anything_is_written() {
    let temp = folder();
    for (words, wanted) in [
        (
            &["--vary", "pulse.enrgy_j=1e-6"][..],
            "did you mean pulse.energy_j?",
        ),
        (
            &["--vary", "pulse.energy_j="],
            "at least one value is needed",
        ),
        (
            &["--vary", "estimator.radius.range_m=1,2"],
            "a list cannot vary",
        ),
        (
            &[
                "--vary",
                "seed=1",
                "--let",
                "pulse.energy_j = 1/scan.lidar_height_m",
            ],
            "divides by zero",
        ),
        (
            &["--vary", "pulse.energy_j=lin:1e-6:1e-3:1000000000"],
            "a count from 2 to 10000",
        ),
        (
            &["--vary", "pulse.energy_j=1e-6,2e-6", "--shard", "3/2"],
            "a number from 1 to the count",
        ),
        (&["--merge", "nowhere"], "sweep.json"),
        // The second case alone cannot be planned: its beam has too many Fresnel zones.
        (
            &["--vary", "telescope.focus_m=inf,1.777e-4"],
            "case 1 of the sweep (telescope.focus_m = 0.0001777): s.toml: telescope.focus_m = 0.0001777",
        ),
    ] {
        let out = wakescope(
            temp.path(),
            &[&["sweep", "s.toml", "--out", "o", "--json"], words].concat(),
        );
        let message = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(2), "{words:?}: {message}");
        assert!(message.contains(wanted), "{words:?}: {message}");
        assert_eq!(names(temp.path()), ["s.toml"], "nothing may be left behind");
    }
}

#[test]
fn the_front_holds_equal_rows_and_no_dominated_one() {
    let temp = folder();
    let at = temp.path();
    let scene = format!("{SCENE}[detector.snr]\nreference = \"fixed\"\nsnr_db = 10.0\n");
    std::fs::write(at.join("s.toml"), scene).unwrap();
    // At a fixed ratio the energy changes nothing; a smaller ratio costs precision at the same resolution.
    let words = [
        "sweep",
        "s.toml",
        "--vary",
        "detector.snr.snr_db=0,20",
        "--vary",
        "pulse.energy_j=50e-6,150e-6",
        "--no-circulation",
        "--quiet",
        "--out",
        "o",
    ];
    ran(at, &words);
    let table = |file: &str| {
        let bytes = read(at, file);
        let text = String::from_utf8(bytes).unwrap();
        let rows = text.lines().filter(|line| !line.starts_with('#'));
        rows.map(str::to_owned).collect::<Vec<String>>()
    };
    let results = table("o/results.csv");
    assert_eq!(results.len(), 5);
    assert_eq!(
        table("o/front.csv"),
        [&results[..1], &results[3..]].concat()
    );
}

#[test]
fn words_hashes_and_drawn_seeds_are_whole_in_netcdf() {
    let temp = folder();
    let words = [
        "sweep",
        "s.toml",
        "--vary",
        "estimator.weighting=hann,rectangular",
        "--independent",
        "--quiet",
    ];
    ran(
        temp.path(),
        &[&words[..], &["--no-circulation", "--out", "o"]].concat(),
    );
    let table =
        wakescope_sim::io::csv_input::TextTable::read(&temp.path().join("o/results.csv")).unwrap();
    let mut file = netcdf3::FileReader::open(temp.path().join("o/results.nc")).unwrap();
    for name in ["estimator.weighting", "scene_hash", "seed"] {
        let column = table.column(name).unwrap();
        let bytes = file.read_var_u8(name).unwrap();
        let found: Vec<&str> = bytes
            .chunks(bytes.len() / 2)
            .map(|row| std::str::from_utf8(row).unwrap())
            .collect();
        for (row, text) in found.iter().enumerate() {
            assert_eq!(
                text.trim_end_matches('\0'),
                table.rows[row][column],
                "{name}"
            );
        }
        assert!(
            file.data_set()
                .get_var_attr_as_string(name, "long_name")
                .is_some(),
            "{name}"
        );
    }
    // Drawn seeds have more digits than a double.
    let seed: i64 = table.rows[0][table.column("seed").unwrap()]
        .parse()
        .unwrap();
    assert!(seed > 1 << 53, "{seed}");
}
