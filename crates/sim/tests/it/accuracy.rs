//! `wakescope accuracy`: keys that are known to be good or bad, budgets, targets out of reach, threads.

use super::wakescope;
use std::path::Path;
use wakescope_sim::accuracy::Accuracy;
use wakescope_sim::accuracy::Request;
use wakescope_sim::accuracy::figures::Figure;
use wakescope_sim::accuracy::keys::{GRID_SPACING, LAYERS, WINDOW_STEP};
use wakescope_sim::accuracy::ladder::Verdict;
use wakescope_sim::{SceneFile, Silent};

const SCENE: &str = "seed = 5\n[detector.snr]\nreference = \"fixed\"\nsnr_db = 10.0\n[scan]\nelevation_min_rad = 0.1\n\
                     elevation_max_rad = 0.11\nelevation_step_rad = 2.5e-3\nrange_min_m = 350.0\nrange_max_m = 420.0\n\
                     pulses_per_line = 16\nrealisations = 8\n";

/// A collimated beam through weak turbulence that both ways share.
const TURBULENT: &str = "seed = 5\n[scan]\nelevation_min_rad = 0.1\nelevation_max_rad = 0.105\nelevation_step_rad = 2.5e-3\n\
                         range_min_m = 350.0\nrange_max_m = 420.0\npulses_per_line = 2\nrealisations = 8\n\
                         [atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-14\ngrid_points = 64\n\
                         grid_spacing_m = 0.004\nlayers = 8\nrealisations = 256\n[outputs]\nprofile_points = 2\n\
                         profile_range_min_m = 360.0\nprofile_range_max_m = 400.0\n";

/// A small wake, which cannot be right and is quick.
const WAKE: &str = "[case]\nkind = \"wake\"\ncells = [8, 24, 24]\ncore_radius = 0.3\n[wake]\nend_tau = 0.1\nevery_tau = 0.02\n";

fn of(scene: &str, request: &Request) -> Accuracy {
    Accuracy::of(
        &SceneFile::parse(scene, Path::new("s.toml")).unwrap(),
        request,
        &Silent,
    )
    .unwrap()
}

#[test]
fn settings_that_lose_gates_are_never_chosen_and_the_budget_is_kept() {
    let found = of(SCENE, &Request::new(0.5, &[Figure::Rms, Figure::Std]));
    let step = found
        .ladders
        .iter()
        .find(|ladder| ladder.key == WINDOW_STEP)
        .unwrap();
    let lost = step
        .steps
        .iter()
        .find(|step| matches!(step.verdict, Verdict::Lost(_)));
    assert!(
        lost.is_some_and(
            |step| step.value > found.scene.content.estimator.window_step_samples as f64
        ),
        "{step:?}"
    );
    assert!(
        found.spent_s <= 1.2 * found.allowed_s,
        "{} {}",
        found.spent_s,
        found.allowed_s
    );
    assert!(found.verified.is_confirmed);
    for (figure, _, shift) in &found.verified.rows {
        assert!(shift.bound() <= 0.5, "{figure:?} {shift:?}");
    }
}

#[test]
fn a_target_out_of_reach_is_answered_with_a_forecast() {
    let found = of(SCENE, &Request::new(1e-3, &[Figure::Std]));
    let [noise] = found.noises[..] else {
        panic!("{:?}", found.noises)
    };
    assert!(
        !found.is_reached() && !noise.is_reached && noise.of_budget > 1e-3,
        "{noise:?}"
    );
    // By the square-root law.
    let expected = 8.0 * (noise.now / 1e-3).powi(2);
    assert!(
        (noise.needed / expected - 1.0).abs() < 0.2,
        "{} {expected}",
        noise.needed
    );
    assert!(noise.forecast_s > found.allowed_s && found.spent_s <= 1.2 * found.allowed_s);
    assert_eq!(
        found.scene.content.scan.realisations, 8,
        "the noise stays as it is"
    );
}

#[test]
fn two_layers_of_weak_turbulence_shift_a_collimated_beam_by_less_than_a_fifth_of_a_percent() {
    let found = of(
        TURBULENT,
        &Request::new(0.05, &[Figure::Efficiency, Figure::Rms]),
    );
    let layers = found
        .ladders
        .iter()
        .find(|ladder| ladder.key == LAYERS)
        .unwrap();
    let two = layers.steps.iter().find(|step| step.value == 2.0).unwrap();
    assert!(
        two.verdict == Verdict::Kept && two.shifts[0].1.bound() <= 2e-3,
        "{two:?}"
    );
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.contains("independent paths")),
        "{:?}",
        found.notes
    );
    assert!(
        layers.value() <= 2.0 && found.spent_s <= 1.2 * found.allowed_s,
        "{} {}",
        found.spent_s,
        found.allowed_s
    );
    let grid = found
        .ladders
        .iter()
        .find(|ladder| ladder.key == GRID_SPACING)
        .unwrap();
    assert!(grid.steps.iter().any(
        |step| matches!(&step.verdict, Verdict::Refused(why) if why.contains("grid_spacing_m"))
    ));
    for (figure, _, shift) in &found.verified.rows {
        assert!(shift.bound() <= 0.05, "{figure:?} {shift:?}");
    }
}

#[test]
fn files_have_the_same_bytes_for_any_number_of_threads_but_for_times() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SCENE).unwrap();
    std::fs::write(temp.path().join("c.toml"), WAKE).unwrap();
    let without_times = |folder: &str, file: &str| -> String {
        let bytes = std::fs::read(temp.path().join(folder).join(file)).unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        if file != "accuracy.csv" {
            return text;
        }
        let header: Vec<&str> = text
            .lines()
            .find(|line| line.starts_with("key,"))
            .unwrap()
            .split(',')
            .collect();
        let timed = header
            .iter()
            .position(|name| *name == "measured_s")
            .unwrap();
        let cells = |line: &str| {
            line.split(',')
                .enumerate()
                .filter(|(i, _)| *i != timed)
                .map(|(_, cell)| cell.to_owned())
                .collect()
        };
        text.lines()
            .map(|line| {
                if line.starts_with('#') {
                    vec![line.to_owned()]
                } else {
                    cells(line)
                }
                .join(",")
                    + "\n"
            })
            .collect()
    };
    let tell = |of: &str, figure: &str, [folder, threads]: [&str; 2]| {
        let words = [
            "accuracy",
            of,
            "--within",
            "10%",
            "--of",
            figure,
            "--out",
            folder,
            "--threads",
            threads,
            "--quiet",
        ];
        let out = wakescope(temp.path(), &words);
        let text = String::from_utf8_lossy(&out.stdout).into_owned();
        let written = std::fs::read_to_string(temp.path().join(folder).join("accuracy.txt"))
            .unwrap_or_default();
        let told = String::from_utf8_lossy(&out.stderr);
        assert!(
            !written.is_empty() && text.starts_with(&written),
            "the screen shows the file: {text}{told}"
        );
        assert_eq!(
            out.status.code(),
            Some(i32::from(written.contains("not reached"))),
            "{text}{told}"
        );
        written
    };
    for (of, figure, folders) in [
        ("s.toml", "rms", ["one", "two"]),
        ("c.toml", "height", ["a", "b"]),
    ] {
        tell(of, figure, [folders[0], "1"]);
        let written = tell(of, figure, [folders[1], "2"]);
        let is_case = of == "c.toml";
        assert!(
            !is_case || written.contains("8 x 24 x 24") && written.contains("4 x 12 x 12"),
            "{written}"
        );
        let own = if is_case {
            "case_accuracy.toml"
        } else {
            "scene_accuracy.toml"
        };
        let mut files = [
            "accuracy.csv",
            "accuracy.png",
            "accuracy.svg",
            "accuracy.txt",
            own,
        ];
        files.sort_unstable();
        assert_eq!(super::cli::names(&temp.path().join(folders[0])), files);
        for file in files {
            assert!(
                without_times(folders[0], file) == without_times(folders[1], file),
                "{file}"
            );
        }
    }
    let out = wakescope(
        temp.path(),
        &["wake", "a/case_accuracy.toml", "--out", "run", "--quiet"],
    );
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    // The scene that it wrote is one, and this program's own.
    let out = wakescope(
        temp.path(),
        &["check", "one/scene_accuracy.toml", "--quiet"],
    );
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let again = [
        "accuracy", "s.toml", "--within", "10%", "--of", "rms", "--out", "one", "--quiet",
    ];
    assert!(matches!(
        wakescope(temp.path(), &again).status.code(),
        Some(0 | 1)
    ));
}

#[test]
fn what_cannot_be_asked_is_refused_with_what_can() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SCENE).unwrap();
    for (words, wanted) in [
        (["--within", "0"], "from 0.001% to 50%"),
        (["--within", "3%,4"], "from 0.001% to 50%"),
        (["--of", "colour"], "possible values"),
        (["--of", "u"], "\"vad\" or \"dbs\""),
        (["--of", "height"], "the case of a flow"),
        (["--budget", "0.5"], "from 1 to 1000000"),
    ] {
        let more: &[&str] = if words[0] == "--within" {
            &[]
        } else {
            &["--within", "3%"]
        };
        let out = wakescope(
            temp.path(),
            &[&["accuracy", "s.toml", "--out", "o"], &words[..], more].concat(),
        );
        let told = String::from_utf8_lossy(&out.stderr);
        assert!(
            out.status.code() == Some(2) && told.contains(wanted),
            "{words:?}: {told}"
        );
    }
    assert!(!temp.path().join("o").exists());
}
