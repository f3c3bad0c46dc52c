//! `cargo xtask ci`: every check that continuous integration makes, in its order.
//!
//! `.ci/run` calls it, so that a person can run the same before a commit. Examples are compiled with the tests, benchmarks
//! are checked with clippy: neither is built once more.

use crate::process::call;
use crate::workspace::read;
use fixtures::failure::{Failure, Outcome};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::process::Command;
use std::time::Instant;

/// Commands of the shell under one name. In braces stand `xtask`, which is this very program: in another profile the workspace would be compiled
/// once more; `wakescope`, the program beside it; `bins`, by what cargo builds that in the same profile; and `test`, what a reader of the README runs.
#[derive(Deserialize)]
struct Step {
    name: String,
    commands: Vec<String>,
}

/// The test command as the README gives it, so that CI runs what a reader runs.
fn readme_test_command(readme: &str) -> Result<String, Failure> {
    readme
        .lines()
        .map(str::trim)
        .find(|l| l.starts_with("cargo test"))
        .map(|l| l.split('#').next().unwrap_or(l).trim().to_owned())
        .ok_or_else(|| Failure::new("README.md gives no line that begins with `cargo test`".into()))
}

/// Runs the steps; stops at the first that fails.
///
/// # Errors
/// The step that failed.
pub(crate) fn run(only: Option<&str>) -> Outcome {
    let own = std::env::current_exe()?;
    let program = own.with_file_name("wakescope");
    let bins = if cfg!(debug_assertions) {
        "--bins --tests"
    } else {
        "--bins --release"
    };
    let replacements = [
        ("{xtask}", format!("'{}'", own.display())),
        ("{wakescope}", format!("'{}'", program.display())),
        ("{bins}", bins.into()),
        ("{test}", readme_test_command(&read("README.md")?)?),
    ];
    let steps: BTreeMap<String, Vec<Step>> = toml::from_str(include_str!("ci.toml"))?;
    for step in steps.into_values().flatten() {
        if only.is_some_and(|word| !step.name.contains(word)) {
            continue;
        }
        for command in &step.commands {
            let mut command = command.clone();
            for (name, text) in &replacements {
                command = command.replace(name, text);
            }
            run_step(&step.name, &command)?;
        }
    }
    Ok(())
}

/// Runs a command of a step and prints its run time.
fn run_step(name: &str, command: &str) -> Outcome {
    println!("== {name}: {command}");
    let start = Instant::now();
    call(Command::new("sh").args(["-c", command]))
        .map_err(|failure| Failure::new(format!("ci: {name}: {failure}")))?;
    println!(
        "== {name}: passed in {:.0} s",
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::output;
    use std::collections::BTreeSet;

    #[test]
    fn the_test_command_is_the_readmes() {
        let readme = "text\n```sh\ncargo xtask reproduce-figs   # figures\ncargo test --workspace   # tests\n```\n";
        assert_eq!(
            readme_test_command(readme).unwrap(),
            "cargo test --workspace"
        );
        assert!(readme_test_command("nothing").is_err());
    }

    /// Lines of `cargo tree`: the crates that a package needs, each with its features.
    fn features_of(package: &str) -> BTreeSet<String> {
        let arguments = [
            "tree",
            "--edges=normal,build",
            "--prefix=none",
            "--format={p} [{f}]",
            "--package",
            package,
        ];
        let text = output(Command::new(env!("CARGO")).args(arguments)).unwrap();
        text.lines()
            .map(|line| line.trim_end_matches(" (*)").to_owned())
            .collect()
    }

    #[test]
    fn the_program_needs_no_crate_with_other_features_than_xtask() {
        let xtask = features_of("xtask");
        let missing: Vec<String> = features_of("wakescope-sim")
            .into_iter()
            .filter(|line| !xtask.contains(line))
            .collect();
        assert!(missing.is_empty(), "{missing:#?}");
    }
}
