//! `wakescope wake` from outside: presets, a run that is killed and continued.

use super::wakescope;
use std::path::Path;
use std::process::{Command, Stdio};

/// A wake of few cells whose run takes a second or so.
const SMALL: &str = r#"
[case]
kind = "wake"
cells = [8, 64, 40]
[wake]
end_tau = 0.6
every_tau = 0.05
fields_tau = [0.3]
planes_tau = [0.6]
[checkpoint]
every_steps = 10
"#;

#[test]
fn a_run_that_is_killed_and_continued_ends_with_the_same_bits() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("case.toml"), SMALL).unwrap();
    let words = |out, more: &[&'static str]| {
        [&["wake", "case.toml", "--out", out, "--quiet"], more].concat()
    };
    let whole = wakescope(temp.path(), &words("whole", &["--threads", "2"]));
    assert!(
        whole.status.success(),
        "{}",
        String::from_utf8_lossy(&whole.stderr)
    );
    let mut child = Command::new(env!("CARGO_BIN_EXE_wakescope"))
        .args(words("killed", &["--threads", "1"]))
        .current_dir(temp.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    // Killed outright (SIGKILL) once there is something to continue from; a run that was faster has nothing left to do.
    let checkpoint = temp.path().join("killed/flow.checkpoint");
    while !checkpoint.exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let refused = wakescope(temp.path(), &words("killed", &[]));
    assert_eq!(
        refused.status.code(),
        Some(2),
        "a checkpoint is not overwritten by mistake"
    );
    let rest = wakescope(temp.path(), &words("killed", &["--restart"]));
    assert!(
        rest.status.success(),
        "{}",
        String::from_utf8_lossy(&rest.stderr)
    );
    let read =
        |folder: &str, name: &str| std::fs::read(temp.path().join(folder).join(name)).unwrap();
    let tables = ["case.toml", "wake.csv", "steps.csv", "flow.checkpoint"];
    for name in tables.into_iter().chain(["wake.nc", "plane1_0001.nc"]) {
        assert!(
            read("whole", name) == read("killed", name),
            "{name} differs"
        );
    }
}

/// Starts a run and waits until `is_there`, or the run's end.
fn started(folder: &Path, words: &[&str], is_there: impl Fn() -> bool) -> std::process::Child {
    let mut child = Command::new(env!("CARGO_BIN_EXE_wakescope"))
        .args(words)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !is_there() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child
}

#[test]
fn one_run_at_a_time_and_one_killed_before_its_first_checkpoint_begins_anew() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    // No checkpoint before the end, which is far away.
    let case = SMALL
        .replace("every_steps = 10", "every_steps = 1000000")
        .replace("end_tau = 0.6", "end_tau = 50.0");
    std::fs::write(folder.join("case.toml"), case).unwrap();
    let words = |more: &[&'static str]| {
        [
            &[
                "wake",
                "case.toml",
                "--out",
                "o",
                "--quiet",
                "--threads",
                "1",
            ],
            more,
        ]
        .concat()
    };
    let steps = folder.join("o/steps.csv");
    let mut child = started(folder, &words(&[]), || steps.exists());
    assert!(child.try_wait().unwrap().is_none(), "the run goes on");
    let second = wakescope(folder, &words(&["--overwrite"]));
    let message = String::from_utf8(second.stderr).unwrap();
    assert_eq!(second.status.code(), Some(2), "{message}");
    assert!(
        message.contains("o is in use") && message.contains("another run"),
        "{message}"
    );
    child.kill().unwrap();
    child.wait().unwrap();
    // The lock went with the process; a stage that was open when it died is swept.
    std::fs::create_dir_all(folder.join("o/.wakescope-stage-1-0/new")).unwrap();
    std::fs::write(folder.join("o/.wakescope-stage-1-0/lock"), "").unwrap();
    let again = wakescope(folder, &words(&["--restart", "--end", "0.05"]));
    let message = String::from_utf8(again.stderr).unwrap();
    assert!(
        again.status.success() && message.contains("begins anew"),
        "{message}"
    );
    let fresh = wakescope(
        folder,
        &[
            "wake",
            "case.toml",
            "--out",
            "p",
            "--quiet",
            "--end",
            "0.05",
        ],
    );
    let message = String::from_utf8(fresh.stderr).unwrap();
    assert!(
        fresh.status.success() && !message.contains("begins anew"),
        "{message}"
    );
    let read = |out: &str, name: &str| std::fs::read(folder.join(out).join(name)).unwrap();
    for name in ["wake.csv", "steps.csv", "flow.checkpoint"] {
        assert!(read("o", name) == read("p", name), "{name} differs");
    }
    let hidden = std::fs::read_dir(folder.join("o"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap());
    assert!(
        hidden.filter(|name| name.starts_with('.')).count() == 0,
        "nothing is left behind"
    );
    // What replaced a damaged checkpoint is said although quiet was asked for.
    std::fs::write(
        folder.join("o/flow.checkpoint.previous"),
        read("o", "flow.checkpoint"),
    )
    .unwrap();
    std::fs::write(folder.join("o/flow.checkpoint"), "half").unwrap();
    let rest = wakescope(folder, &words(&["--restart", "--end", "0.06"]));
    let message = String::from_utf8(rest.stderr).unwrap();
    assert!(
        rest.status.success() && message.contains("the one before it is used"),
        "{message}"
    );
}

#[test]
fn a_check_says_what_a_run_would_take_refuses_what_it_would_and_writes_nothing() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    std::fs::write(folder.join("case.toml"), SMALL).unwrap();
    let out = wakescope(
        folder,
        &["wake", "case.toml", "--check", "--out", "o", "--end", "0.3"],
    );
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    for wanted in [
        "8 x 64 x 40 = 20480",
        "tau = 0.3",
        "runge_kutta3",
        "memory",
        "steps.csv",
        "flow.checkpoint*",
    ] {
        assert!(text.contains(wanted), "{wanted} is not in: {text}");
    }
    assert!(!folder.join("o").exists());
    // Its steps and files are those of the run.
    let json = wakescope(
        folder,
        &["wake", "case.toml", "--check", "--json", "--end", "0.3"],
    );
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let run = wakescope(
        folder,
        &[
            "wake",
            "case.toml",
            "--json",
            "--quiet",
            "--out",
            "o",
            "--end",
            "0.3",
        ],
    );
    let run: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let ratio = run["steps"].as_f64().unwrap() / json["steps"].as_f64().unwrap();
    assert!(
        (0.5..2.0).contains(&ratio),
        "{} steps, forecast {}",
        run["steps"],
        json["steps"]
    );
    let size = |name: &str| {
        std::fs::metadata(folder.join("o").join(name))
            .unwrap()
            .len() as f64
    };
    let forecast = |name: &str| {
        let kinds = json["files"].as_array().unwrap();
        kinds
            .iter()
            .find(|kind| kind["name"].as_str().unwrap().starts_with(name))
            .unwrap()["bytes"]
            .as_f64()
            .unwrap()
    };
    // One of the two checkpoints is there at the end of a short run; tables vary with their digits.
    for (actual, expected, within) in [
        (
            size("flow.checkpoint"),
            0.5 * forecast("flow.checkpoint"),
            1.02,
        ),
        (size("steps.csv"), forecast("steps.csv"), 2.0),
    ] {
        assert!(
            (1.0 / within..within).contains(&(actual / expected)),
            "{actual} bytes, forecast {expected}"
        );
    }
    let taken = wakescope(folder, &["wake", "case.toml", "--check", "--out", "o"]);
    assert_eq!(
        taken.status.code(),
        Some(2),
        "the folder holds a checkpoint"
    );
    // Sizes beyond any machine are refused at once, by the run as by the check, with what fits.
    let free = |cells: usize| {
        let axis = format!("{{ cells = {cells} }}");
        format!("[case]\nkind = \"free\"\nx = {axis}\ny = {axis}\n[time]\nend_s = 1.0\n")
    };
    for case in [
        "[case]\nkind = \"vortex_pair\"\ncells = [4000, 4000, 4000]\n".to_owned(),
        "[case]\nkind = \"vortex_pair\"\ncells = [1, 100000, 100000]\n".to_owned(),
        free(100_000),
    ] {
        std::fs::write(folder.join("large.toml"), case).unwrap();
        for more in [&["--check"][..], &["--out", "l"]] {
            let out = wakescope(folder, &[&["flow", "large.toml"], more].concat());
            let message = String::from_utf8(out.stderr).unwrap();
            assert_eq!(out.status.code(), Some(2), "{message}");
            assert!(
                message.contains("would fit") && message.contains("--allow-large"),
                "{message}"
            );
            assert!(!folder.join("l").exists());
        }
    }
}

#[test]
fn presets_print_themselves_and_other_cases_are_refused() {
    let temp = tempfile::tempdir().unwrap();
    let printed = wakescope(temp.path(), &["wake", "--preset", "medium", "--print"]);
    let text = String::from_utf8(printed.stdout).unwrap();
    assert!(
        printed.status.success() && text.contains("cells = [48, 240, 128]"),
        "{text}"
    );
    std::fs::write(
        temp.path().join("c.toml"),
        "[case]\nkind = \"vortex_pair\"\n",
    )
    .unwrap();
    let other = wakescope(temp.path(), &["wake", "c.toml", "--out", "o"]);
    let message = String::from_utf8(other.stderr).unwrap();
    assert!(
        other.status.code() == Some(2) && message.contains("wakescope flow"),
        "{message}"
    );
    let nowhere = wakescope(temp.path(), &["wake"]);
    assert!(
        nowhere.status.code() == Some(2)
            && String::from_utf8_lossy(&nowhere.stderr).contains("--out")
    );
}
