//! The program from outside: what a user types, what files come, and what wrong input gives.

use super::wakescope;
use std::path::Path;
use wakescope_sim::io::Existing;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::scene::SceneFile;
use wakescope_sim::write;

/// A scene small enough to run in a moment.
pub(super) const SMALL: &str = r#"
seed = 5
[detector.snr]
reference = "fixed"
snr_db = 10.0
[scan]
elevation_min_rad = 0.1
elevation_max_rad = 0.12
elevation_step_rad = 2.5e-3
range_min_m = 330.0
range_max_m = 430.0
pulses_per_line = 2
realisations = 3
[outputs]
signals = true
profile_points = 5
"#;

pub(super) fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Runs a scene that must be refused; returns the message.
fn refused(scene: &str, words: &[&str]) -> String {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), scene).unwrap();
    let out = wakescope(temp.path(), words);
    assert_eq!(
        out.status.code(),
        Some(2),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    assert_eq!(names(temp.path()), ["s.toml"], "nothing may be left behind");
    assert!(out.stdout.is_empty());
    String::from_utf8(out.stderr).unwrap()
}

const RUN: [&str; 4] = ["run", "s.toml", "--out", "o"];

#[test]
fn wrong_scenes_are_refused_with_key_value_range_and_line() {
    for (scene, wanted) in [
        (
            "[laser]\ncolour = 1.0\n",
            [
                "s.toml:2",
                "laser.colour = 1.0 is not allowed: there is no such key",
                "wavelength_m",
            ],
        ),
        (
            "[telescope]\naperture_radius_m = -0.05\n",
            [
                "s.toml:2",
                "telescope.aperture_radius_m = -0.05",
                "from 0.0001 to 10.0 m",
            ],
        ),
        (
            "[pulse.shape]\nduration_s = nan\n",
            ["s.toml:2", "pulse.shape.duration_s = nan", "1e-9"],
        ),
        (
            "[scan]\nelevation_min_rad = -0.1\n",
            [
                "s.toml:2",
                "scan.elevation_min_rad = -0.1",
                "below the ground",
            ],
        ),
        (
            "[scan]\nrange_max_m = 300.0\n",
            [
                "s.toml:2: scan.range_max_m = 300.0",
                "at least 317.774 m",
                "34 samples",
            ],
        ),
        (
            "[estimator]\nwindow_samples = 1000\npadded_samples = 2048\n",
            ["s.toml:2", "estimator.window_samples = 1000", "at most 401"],
        ),
    ] {
        let message = refused(scene, &RUN);
        for part in wanted {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
    }
}

#[test]
fn missing_files_and_unusable_outputs_are_refused() {
    assert!(refused("", &["run", "none.toml", "--out", "o"]).contains("none.toml"));
    assert!(refused("", &["run", "s.toml", "--out", "s.toml"]).contains("s.toml"));
    assert!(refused("", &["run", "s.toml", "--out", "s.toml/deeper"]).contains("s.toml/deeper"));
    assert!(refused("", &["init", "s.toml"]).contains("--force"));
    assert!(refused("", &["run", "s.toml"]).contains("--out"));
    assert!(refused("", &["run", "s.toml", "--out", "o", "--threads", "0"]).contains("--threads"));
    assert!(refused("", &["check", "s.toml", "--seed", "18446744073709551615"]).contains("seed"));
}

#[test]
fn a_folder_in_the_way_of_a_file_is_found_before_the_computing() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SMALL).unwrap();
    std::fs::create_dir_all(temp.path().join("o/map.csv")).unwrap();
    for words in [&["check", "s.toml", "--out", "o"][..], &RUN] {
        let out = wakescope(temp.path(), words);
        let message = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(2), "{message}");
        assert!(
            message.contains("o/map.csv") && !message.contains("phase screens"),
            "{words:?}: {message}"
        );
    }
    assert!(
        wakescope(temp.path(), &["check", "s.toml"])
            .status
            .success()
    );
    // Each file that a run writes is among those that are looked for.
    for (target, left_out) in [
        (Target::Efficiency, "none"),
        (Target::Signal, "none"),
        (Target::Map, "none"),
        (Target::Run, "csv"),
        (Target::Run, "netcdf"),
        (Target::Run, "svg"),
        (Target::Run, "png"),
        (Target::Run, "flow"),
    ] {
        let kinds = ["csv", "netcdf", "svg", "png", "flow"]
            .map(|kind| format!("{kind} = {}\n", kind != left_out));
        let scene = SMALL.replace("realisations = 3", "realisations = 1") + &kinds.concat();
        let plan = Plan::new(
            SceneFile::parse(&scene, Path::new("s.toml")).unwrap(),
            target,
        )
        .unwrap();
        let result = wakescope_sim::run::run(&plan, &Silent).unwrap();
        let written =
            write::write(&plan, &result, &temp.path().join("w"), Existing::Replace).unwrap();
        let written: Vec<_> = written
            .iter()
            .map(|p| p.file_name().unwrap().to_str().unwrap())
            .collect();
        assert_eq!(
            write::names(&plan).unwrap(),
            written,
            "{target:?} without {left_out}"
        );
    }
}

#[test]
fn what_is_larger_than_the_machine_is_refused_unless_asked_for() {
    let scene = "[scan]\npulses_per_line = 1000000\nrealisations = 100000\n[outputs]\nsignals = true\nnetcdf = false\n";
    for words in [&["check", "s.toml"][..], &RUN] {
        let message = refused(scene, words);
        for part in [
            "616.2 GB of memory",
            "are available",
            "outputs.signals = false",
            "--allow-large",
        ] {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
    }
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), scene).unwrap();
    let out = wakescope(temp.path(), &["check", "s.toml", "--allow-large"]);
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(
        out.status.success() && text.contains(" years") && text.contains("616.2 GB"),
        "{text}"
    );
    let too_large_for_a_file = scene.replace("netcdf = false", "netcdf = true");
    let message = refused(&too_large_for_a_file, &["check", "s.toml", "--allow-large"]);
    assert!(
        message.contains("outputs.signals") && message.contains("signals.nc"),
        "{message}"
    );
}

#[test]
fn the_summary_speaks_of_the_middle_of_the_scan() {
    let temp = tempfile::tempdir().unwrap();
    let scene = SMALL.replace(
        "reference = \"fixed\"\nsnr_db = 10.0",
        "reference = \"physical\"",
    ) + "profile_range_min_m = 340.0\nprofile_range_max_m = 420.0\nsvg = false\npng = false\n";
    std::fs::write(temp.path().join("s.toml"), scene).unwrap();
    let mut found = Vec::new();
    for stage in ["run", "efficiency", "map"] {
        let out = wakescope(temp.path(), &[stage, "s.toml", "--out", stage, "--json"]);
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        assert_eq!(json["results"]["scan_range_m"], 380.0);
        found.push(json["results"]["scan_snr_db"].as_f64().unwrap());
    }
    let text = std::fs::read_to_string(temp.path().join("run/profile.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .map(|l| l.split(',').collect())
        .collect();
    let column = rows[0].iter().position(|name| *name == "snr_db").unwrap();
    let at_380: f64 = rows.iter().find(|r| r[0] == "380.0").unwrap()[column]
        .parse()
        .unwrap();
    assert!(
        found.iter().all(|snr_db| (snr_db - at_380).abs() < 0.01),
        "{found:?} {at_380}"
    );
}

#[test]
fn an_initial_scene_is_good_and_its_plan_says_what_is_left_out() {
    let temp = tempfile::tempdir().unwrap();
    assert!(wakescope(temp.path(), &["init"]).status.success());
    let out = wakescope(temp.path(), &["check", "scene.toml"]);
    assert!(out.status.success());
    let text = String::from_utf8(out.stdout).unwrap();
    for part in [
        "skip  phase screens",
        "skip  flow simulation",
        "run   signals",
        "run   estimates",
    ] {
        assert!(text.contains(part), "{part} is not in:\n{text}");
    }
}

#[cfg(feature = "plots")]
#[test]
fn check_draws_the_set_up() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SMALL).unwrap();
    let draw = |file: &str| wakescope(temp.path(), &["check", "s.toml", "--picture", file]);
    assert!(draw("set-up.svg").status.success());
    let text = std::fs::read_to_string(temp.path().join("set-up.svg")).unwrap();
    assert!(
        ["lidar", "vortices", "ground"]
            .iter()
            .all(|word| text.contains(word))
    );
    assert!(
        String::from_utf8(draw("set-up.jpg").stderr)
            .unwrap()
            .contains(".svg or .png")
    );
    std::fs::write(temp.path().join("mine.svg"), "mine").unwrap();
    let mine = || std::fs::read_to_string(temp.path().join("mine.svg")).unwrap();
    let refused = draw("mine.svg");
    let message = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        message.contains("mine.svg") && message.contains("--overwrite"),
        "{message}"
    );
    assert_eq!(mine(), "mine");
    let words = ["check", "s.toml", "--picture", "mine.svg", "--overwrite"];
    assert!(wakescope(temp.path(), &words).status.success());
    assert_eq!(mine(), text);
}

#[test]
fn each_stage_can_be_asked_for_alone() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SMALL).unwrap();
    for (stage, file) in [
        ("efficiency", "profile.csv"),
        ("signal", "signals.nc"),
        ("map", "map.csv"),
    ] {
        let out = wakescope(temp.path(), &[stage, "s.toml", "--out", stage, "--quiet"]);
        assert!(
            out.status.success(),
            "{}",
            String::from_utf8_lossy(&out.stderr)
        );
        assert!(out.stderr.is_empty(), "--quiet");
        let files = names(&temp.path().join(stage));
        let stems: std::collections::BTreeSet<&str> = files
            .iter()
            .filter(|name| *name != "scene.toml")
            .filter_map(|name| name.split('.').next())
            .collect();
        let stem = file.split('.').next().unwrap();
        assert!(files.contains(&file.to_owned()), "{files:?}");
        assert_eq!(
            stems,
            [stem].into(),
            "{stage} gives nothing else: {files:?}"
        );
    }
}

#[test]
fn a_run_gives_the_same_tables_for_one_and_two_threads_and_says_where_they_come_from() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SMALL).unwrap();
    for threads in ["1", "2"] {
        let out = wakescope(
            temp.path(),
            &[
                "run",
                "s.toml",
                "--out",
                threads,
                "--threads",
                threads,
                "--json",
            ],
        );
        assert!(
            out.status.success(),
            "{}",
            String::from_utf8_lossy(&out.stderr)
        );
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        assert_eq!(json["seed"], 5);
        assert!(json["results"]["rms_mean_m_s"].as_f64().unwrap() > 0.0);
    }
    let (one, two) = (temp.path().join("1"), temp.path().join("2"));
    assert_eq!(names(&one), names(&two));
    let mut tables = 0;
    for name in names(&one) {
        let bytes = std::fs::read(one.join(&name)).unwrap();
        assert_eq!(
            bytes,
            std::fs::read(two.join(&name)).unwrap(),
            "{name} depends on the number of threads"
        );
        if name.ends_with(".csv") {
            let text = String::from_utf8(bytes).unwrap();
            assert!(
                text.contains("# seed: 5\n")
                    && text.contains(concat!("wakescope ", env!("CARGO_PKG_VERSION")))
            );
            assert!(text.contains("snr_db = 10.0"), "{name} carries the scene");
            tables += 1;
        }
    }
    assert_eq!(tables, 3);
}

#[test]
fn a_written_scene_runs_again_to_the_same_files() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SMALL).unwrap();
    assert!(
        wakescope(
            temp.path(),
            &["map", "s.toml", "--out", "a", "--seed", "9", "--quiet"]
        )
        .status
        .success()
    );
    assert!(
        wakescope(
            temp.path(),
            &["map", "a/scene.toml", "--out", "b", "--quiet"]
        )
        .status
        .success()
    );
    let read = |file: &str| std::fs::read_to_string(temp.path().join(file)).unwrap();
    assert_eq!(read("a/map.csv"), read("b/map.csv"));
    assert!(
        wakescope(temp.path(), &["map", "s.toml", "--out", "c", "--quiet"])
            .status
            .success()
    );
    let body = |text: String| {
        text.lines()
            .filter(|l| !l.starts_with('#'))
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert_ne!(
        body(read("a/map.csv")),
        body(read("c/map.csv")),
        "the seed matters"
    );
}

#[test]
fn existing_files_are_replaced_only_with_overwrite() {
    let temp = tempfile::tempdir().unwrap();
    let (folder, out) = (temp.path(), temp.path().join("o"));
    std::fs::write(folder.join("s.toml"), SMALL).unwrap();
    let run = |words: &[&str]| {
        wakescope(
            folder,
            &[&["run", "s.toml", "--out", "o", "--quiet"], words].concat(),
        )
    };
    assert!(run(&[]).status.success());
    let first = std::fs::read(out.join("map.csv")).unwrap();
    for name in names(&out) {
        std::fs::remove_file(out.join(name)).unwrap();
    }
    let measured = "# my own measurement\nrange_m,v_m_s\n1,2\n";
    std::fs::write(out.join("map.csv"), measured).unwrap();
    for command in ["run", "check"] {
        let refused = wakescope(folder, &[command, "s.toml", "--out", "o", "--quiet"]);
        assert_eq!(refused.status.code(), Some(2));
        let message = String::from_utf8(refused.stderr).unwrap();
        assert!(
            message.contains("o/map.csv exists") && message.contains("--overwrite"),
            "{message}"
        );
        assert_eq!(names(&out), ["map.csv"], "a refused run writes nothing");
    }
    assert_eq!(
        std::fs::read_to_string(out.join("map.csv")).unwrap(),
        measured
    );
    let words = ["check", "s.toml", "--out", "o", "--quiet", "--overwrite"];
    assert!(wakescope(folder, &words).status.success());
    assert!(run(&["--overwrite"]).status.success());
    assert_eq!(std::fs::read(out.join("map.csv")).unwrap(), first);
    // A folder in the way is found before the computing, and no option removes it.
    std::fs::remove_file(out.join("map.csv")).unwrap();
    std::fs::create_dir(out.join("map.csv")).unwrap();
    let blocked = run(&["--overwrite"]);
    assert!(
        String::from_utf8_lossy(&blocked.stderr).contains("a folder of that name"),
        "{blocked:?}"
    );
    std::fs::write(folder.join("bound.csv"), measured).unwrap();
    let bound = wakescope(folder, &["bound", "s.toml", "--out", "bound.csv"]);
    assert_eq!(bound.status.code(), Some(2));
    // The case file itself, in the folder of the run.
    let case =
        "# mine\n[case]\nkind = \"vortex_pair\"\ncells = [1, 16, 16]\n[time]\nend_s = 0.01\n";
    std::fs::write(folder.join("case.toml"), case).unwrap();
    let flow = wakescope(folder, &["flow", "case.toml", "--out", ".", "--quiet"]);
    assert_eq!(flow.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&flow.stderr).contains("case.toml"),
        "{flow:?}"
    );
    assert_eq!(
        std::fs::read_to_string(folder.join("case.toml")).unwrap(),
        case
    );
}

#[test]
fn the_files_of_a_run_are_those_that_it_announces() {
    use wakescope_sim::plan::{Plan, Target};
    let temp = tempfile::tempdir().unwrap();
    let all = SMALL.replace(
        "[outputs]",
        "[estimator]\ngate_step_samples = 64\n[outputs]\nhpl = true\nsignals_of = \"all\"",
    );
    let all = all
        .replace("range_min_m = 330.0", "range_min_m = 345.3609")
        .replace("430.0", "480.0");
    std::fs::write(temp.path().join("s.toml"), &all).unwrap();
    for (word, target) in [
        ("run", Target::Run),
        ("map", Target::Map),
        ("signal", Target::Signal),
    ] {
        let out = wakescope(temp.path(), &[word, "s.toml", "--out", word, "--quiet"]);
        assert!(
            out.status.success(),
            "{}",
            String::from_utf8_lossy(&out.stderr)
        );
        let file = wakescope_sim::scene::SceneFile::read(&temp.path().join("s.toml")).unwrap();
        let mut announced = wakescope_sim::write::names(&Plan::new(file, target).unwrap()).unwrap();
        announced.sort();
        assert_eq!(names(&temp.path().join(word)), announced, "{word}");
    }
    // Nine lines of two pulses, three times; the table has the first pulses of the first.
    let length = |word: &str| {
        std::fs::metadata(temp.path().join(word).join("signals.nc"))
            .unwrap()
            .len()
    };
    let samples = 225;
    assert!(length("run") > 9 * 2 * 3 * samples * 8, "{}", length("run"));
    let (run, signal) = ("run/signals.nc", "signal/signals.nc");
    assert_eq!(
        std::fs::read(temp.path().join(run)).unwrap(),
        std::fs::read(temp.path().join(signal)).unwrap()
    );
}

#[test]
fn extreme_scenes_run_to_the_end() {
    let nothing_returns = "[atmosphere]\nbackscatter_per_m_sr = 0.0\n";
    let short_pulse = "[pulse.shape]\nduration_s = 1e-9\n";
    let long_pulse =
        "[pulse.shape]\nduration_s = 1.2e-6\n[scan]\nrange_min_m = 500.0\nrange_max_m = 560.0\n";
    let faint = "[detector.snr]\nreference = \"fixed\"\nsnr_db = -40.0\n";
    let loud = "[detector.snr]\nreference = \"fixed\"\nsnr_db = 60.0\n";
    let silent = "[detector]\nnoise = \"none\"\n[flow]\nkind = \"calm\"\n";
    for scene in [
        nothing_returns,
        short_pulse,
        long_pulse,
        faint,
        loud,
        silent,
    ] {
        let temp = tempfile::tempdir().unwrap();
        let scan = "elevation_max_rad = 0.0025\npulses_per_line = 1\nrealisations = 2\n";
        let text = match scene.contains("[scan]") {
            true => scene.replace("[scan]\n", &format!("[scan]\n{scan}")),
            false => format!("{scene}[scan]\n{scan}"),
        };
        std::fs::write(temp.path().join("s.toml"), text).unwrap();
        let out = wakescope(temp.path(), &["run", "s.toml", "--out", "o", "--quiet"]);
        assert!(
            out.status.success(),
            "{scene}: {}",
            String::from_utf8_lossy(&out.stderr)
        );
    }
}

#[test]
fn a_profile_is_empty_where_no_light_comes_back() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(
        temp.path().join("s.toml"),
        "[atmosphere]\nbackscatter_per_m_sr = 0.0\n[outputs]\nprofile_points = 3\n",
    )
    .unwrap();
    let out = wakescope(
        temp.path(),
        &["efficiency", "s.toml", "--out", "o", "--quiet"],
    );
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let text = std::fs::read_to_string(temp.path().join("o/profile.csv")).unwrap();
    let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    assert!(
        rows[0].ends_with("snr_db") && rows[1..].iter().all(|row| row.ends_with(',')),
        "{rows:?}"
    );
}

#[test]
fn turbulence_gives_theory_and_monte_carlo_side_by_side() {
    let turbulent = "[atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-13\ngrid_points = 128\n\
                     grid_spacing_m = 0.004\nlayers = 3\nrealisations = 40\n\
                     [outputs]\nprofile_range_min_m = 200.0\nprofile_range_max_m = 600.0\nprofile_points = 3\n";
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), turbulent).unwrap();
    let out = wakescope(
        temp.path(),
        &["efficiency", "s.toml", "--out", "o", "--quiet"],
    );
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let text = std::fs::read_to_string(temp.path().join("o/profile.csv")).unwrap();
    let mut rows = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .map(|l| l.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let last: Vec<f64> = rows
        .next_back()
        .unwrap()
        .iter()
        .map(|c| c.parse().unwrap())
        .collect();
    let value = |name: &str| last[header.iter().position(|h| *h == name).unwrap()];
    assert_eq!(
        value("efficiency"),
        value("efficiency_monostatic_monte_carlo"),
        "the scene is monostatic"
    );
    let error = value("efficiency_bistatic_monte_carlo_standard_error");
    let z = (value("efficiency_bistatic_monte_carlo") - value("efficiency_bistatic_exact")) / error;
    assert!(error > 0.0 && z.abs() < 4.0, "z = {z}");
    assert!(value("efficiency_bistatic_exact") < value("efficiency_free_space"));

    // Independent paths have an exact theory: a map needs no screens.
    let bistatic = format!(
        "{turbulent}[telescope]\nreceiver = \"bistatic\"\n[scan]\nelevation_max_rad = 0.0025\n"
    );
    std::fs::write(temp.path().join("b.toml"), bistatic).unwrap();
    let out = wakescope(temp.path(), &["map", "b.toml", "--out", "b", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    let stage = json["stages"]
        .as_array()
        .unwrap()
        .iter()
        .find(|s| s["stage"] == "phase screens")
        .unwrap()
        .clone();
    assert_eq!(stage["runs"], false, "{stage}");
}

#[test]
fn screens_that_cannot_resolve_the_scene_are_refused_before_the_run() {
    let screens = |keys: &str| format!("[atmosphere.turbulence]\nkind = \"refractive\"\n{keys}");
    for (keys, wanted) in [
        ("cn2_m_m23 = 1e-13\ngrid_points = 16\n", "grid"),
        ("cn2_m_m23 = 1e-12\n", "grid"),
        (
            "spectrum = \"hill_andrews\"\ninner_scale_m = 0.0\n",
            "inner_scale_m",
        ),
    ] {
        let message = refused(&screens(keys), &["check", "s.toml"]);
        assert!(message.contains(wanted), "{wanted} is not in: {message}");
    }
    let temp = tempfile::tempdir().unwrap();
    let check = |keys: &str| {
        std::fs::write(temp.path().join("s.toml"), screens(keys)).unwrap();
        String::from_utf8(wakescope(temp.path(), &["check", "s.toml"]).stdout).unwrap()
    };
    assert!(
        check("cn2_m_m23 = 1e-13\n").contains("atmosphere.turbulence.layers = "),
        "thick layers are warned of"
    );
    assert!(!check("cn2_m_m23 = 1e-13\nsampling = \"derived\"\n").contains("Rytov"));
}

#[test]
fn a_flow_runs_pauses_and_continues_and_every_example_is_printed() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let printed = wakescope(folder, &["flow", "--example", "vortex_pair"]);
    let text = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.status.success() && text.contains("kind = \"vortex_pair\""));
    let unknown = wakescope(folder, &["flow", "--example", "tornado"]);
    assert!(
        !unknown.status.success()
            && String::from_utf8_lossy(&unknown.stderr).contains("vortex_pair")
    );
    let small = text
        .replace("cells = [24, 128, 80] ", "cells = [1, 16, 16] ")
        .replace(
            "end_s = 5.0",
            "end_s = 0.02\nstep_s = 0.002\npause_after_steps = 4",
        )
        .replace("courant = 0.65\n", "")
        .replace("every_s = 0.5\n", "");
    std::fs::write(folder.join("case.toml"), small).unwrap();
    let run = |words: &[&str]| {
        let out = wakescope(
            folder,
            &[&["flow", "case.toml", "--out", "o", "--json"], words].concat(),
        );
        assert!(
            out.status.success(),
            "{}",
            String::from_utf8_lossy(&out.stderr)
        );
        serde_json::from_slice::<serde_json::Value>(&out.stdout).unwrap()
    };
    let paused = run(&["--threads", "2"]);
    assert_eq!(
        (paused["steps"].as_u64(), paused["is_complete"].as_bool()),
        (Some(4), Some(false))
    );
    let text = std::fs::read_to_string(folder.join("case.toml")).unwrap();
    std::fs::write(
        folder.join("case.toml"),
        text.replace("pause_after_steps = 4", ""),
    )
    .unwrap();
    let again = wakescope(folder, &["flow", "case.toml", "--out", "o"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--restart"));
    let done = run(&["--restart", "--threads", "1"]);
    assert_eq!(
        (done["steps"].as_u64(), done["time_s"].as_f64()),
        (Some(10), Some(0.02))
    );
    let files = names(&folder.join("o"));
    assert!(
        files.contains(&"steps.csv".to_owned()) && files.contains(&"flow.checkpoint".to_owned()),
        "{files:?}"
    );

    // A flow that blows up: exit code, place, checkpoint.
    let text = std::fs::read_to_string(folder.join("case.toml")).unwrap();
    std::fs::write(
        folder.join("case.toml"),
        text.replace("step_s = 0.002", "step_s = 0.9")
            .replace("0.02", "1.0"),
    )
    .unwrap();
    let blown = wakescope(folder, &["flow", "case.toml", "--out", "p", "--quiet"]);
    assert_eq!(blown.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&blown.stderr).contains("Courant number"),
        "{blown:?}"
    );
}
