//! `wakescope wake` from outside: presets, a run that is killed and continued.

#![cfg(feature = "cli")]
// A test that cannot set up its files has failed.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output, Stdio};

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

fn wakescope(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wakescope")).args(words).current_dir(folder).output().unwrap()
}

#[test]
fn a_run_that_is_killed_and_continued_ends_with_the_same_bits() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("case.toml"), SMALL).unwrap();
    let words = |out, more: &[&'static str]| [&["wake", "case.toml", "--out", out, "--quiet"], more].concat();
    let whole = wakescope(temp.path(), &words("whole", &["--threads", "2"]));
    assert!(whole.status.success(), "{}", String::from_utf8_lossy(&whole.stderr));
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
    assert_eq!(refused.status.code(), Some(2), "a checkpoint is not overwritten by mistake");
    let rest = wakescope(temp.path(), &words("killed", &["--restart"]));
    assert!(rest.status.success(), "{}", String::from_utf8_lossy(&rest.stderr));
    let read = |folder: &str, name: &str| std::fs::read(temp.path().join(folder).join(name)).unwrap();
    let mut names = vec!["case.toml", "wake.csv", "wake_scaled.csv", "steps.csv", "flow.checkpoint"];
    if cfg!(feature = "netcdf") {
        names.extend(["wake.nc", "plane1_0001.nc"]);
    }
    for name in names {
        assert!(read("whole", name) == read("killed", name), "{name} differs");
    }
}

#[test]
fn presets_print_themselves_and_other_cases_are_refused() {
    let temp = tempfile::tempdir().unwrap();
    let printed = wakescope(temp.path(), &["wake", "--preset", "medium", "--print"]);
    let text = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.status.success() && text.contains("cells = [48, 240, 128]"), "{text}");
    std::fs::write(temp.path().join("c.toml"), "[case]\nkind = \"dipole\"\n").unwrap();
    let other = wakescope(temp.path(), &["wake", "c.toml", "--out", "o"]);
    let message = String::from_utf8(other.stderr).unwrap();
    assert!(other.status.code() == Some(2) && message.contains("wakescope flow"), "{message}");
    let nowhere = wakescope(temp.path(), &["wake"]);
    assert!(nowhere.status.code() == Some(2) && String::from_utf8_lossy(&nowhere.stderr).contains("--out"));
}
