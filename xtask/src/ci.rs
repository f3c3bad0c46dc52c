//! `cargo xtask ci`: every check that continuous integration makes, in its order.
//!
//! `.ci/run` calls it, so that a person can run the same before a commit. Examples are compiled with the tests, benchmarks
//! are checked with clippy: neither is built once more.

use crate::workspace::{read, root};
use fixtures::failure::{Failure, Outcome};
use std::process::Command;
use std::time::Instant;

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Run only the steps whose name contains this.
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
}

struct Step {
    name: &'static str,
    command: String,
    environment: &'static [(&'static str, &'static str)],
}

/// Feature sets that must build: each crate with nothing, and each feature alone. Crates that know nothing of each other are checked at once.
const FEATURES: [(&str, &str); 9] = [
    ("wakescope-optics --package wakescope-les --package wakescope-signal --package wakescope-estimate", ""),
    (
        "wakescope-optics --package wakescope-signal --package wakescope-estimate",
        "wakescope-optics/rayon wakescope-signal/rayon wakescope-estimate/rayon",
    ),
    (
        "wakescope-optics --package wakescope-les --package wakescope-estimate",
        "wakescope-optics/screens wakescope-les/solver wakescope-estimate/bundled-lapack",
    ),
    ("wakescope-sim", ""),
    ("wakescope-sim", "cli"),
    ("wakescope-sim", "flow"),
    ("wakescope-sim", "netcdf4"),
    ("wakescope-sim", "plots"),
    ("wakescope-sim", "vtk"),
];

/// The wake that the figures show in continuous integration, and where it is put.
const WAKE: &str = "xtask/small_wake.toml";
const WAKE_OUT: &str = "target/small-wake";

fn steps() -> Result<Vec<Step>, Failure> {
    let plain = |name, command: String| Step { name, command, environment: &[] };
    let mut out = vec![
        plain("format", "cargo fmt --all --check".into()),
        plain("clippy", "cargo clippy --workspace --all-targets -- -D warnings".into()),
        plain("test", readme_test_command(&read("README.md")?)?),
        Step {
            name: "docs",
            command: "cargo doc --workspace --no-deps --document-private-items".into(),
            environment: &[("RUSTDOCFLAGS", "-D warnings")],
        },
    ];
    for (packages, features) in FEATURES {
        let command = format!("cargo check --package {packages} --no-default-features --features '{features}'");
        out.push(plain("features", command));
    }
    // Whether each crate can be taken by others: its files, its dependencies with versions; built they are above.
    out.push(plain(
        "package",
        "cargo package --workspace --exclude xtask --exclude fixtures --exclude wakescope-tests --no-verify --allow-dirty --quiet".into(),
    ));
    // This very program: in another profile the workspace would be compiled once more.
    let own = std::env::current_exe()?.display().to_string();
    out.push(plain("tidy", format!("'{own}' tidy")));
    // Beside it is the program, in the same profile.
    let both = if cfg!(debug_assertions) { "--bins --tests" } else { "--bins --release" };
    out.push(plain("program", format!("cargo build --quiet --workspace {both}")));
    let sibling = std::env::current_exe()?.with_file_name("wakescope").display().to_string();
    // On a wake of a few cells: that of the profile takes several minutes and shows no other fault of the program.
    out.push(plain("wake", format!("'{sibling}' wake {WAKE} --out {WAKE_OUT} --overwrite --quiet")));
    out.push(plain("audit", format!("'{own}' audit --program '{sibling}'")));
    // Installs what it needs, or says what is lacking and fails.
    out.push(plain("python", format!("WAKESCOPE_PROGRAM='{sibling}' python/check")));
    // Says so where there is no MPI.
    out.push(plain("mpi", format!("'{own}' ranks")));
    out.push(plain("figures", format!("'{own}' reproduce-figs --profile quick --no-cache --wake {WAKE_OUT}")));
    let again = "if command -v python3 >/dev/null; then python3 docs/claims.py; else echo 'SKIPPED, for there is no python3: what claims measured was not computed again'; fi";
    out.push(plain("figures: what claims measured, from their tables", again.into()));
    Ok(out)
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
pub(crate) fn run(options: &Options) -> Outcome {
    let wanted = |s: &Step| options.only.as_ref().is_none_or(|word| s.name.contains(word.as_str()));
    for step in steps()?.into_iter().filter(wanted) {
        println!("== {}: {}", step.name, step.command);
        let start = Instant::now();
        let status = Command::new("sh")
            .args(["-c", &step.command])
            .envs(step.environment.iter().copied())
            .current_dir(root())
            .status()
            .map_err(|e| Failure::new(format!("cannot run sh: {e}")))?;
        if !status.success() {
            return Err(Failure::new(format!("ci: {} failed: {}", step.name, step.command)));
        }
        println!("== {}: passed in {:.0} s", step.name, start.elapsed().as_secs_f64());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_test_command_is_the_readmes() {
        let readme = "text\n```sh\ncargo xtask reproduce-figs   # figures\ncargo test --workspace   # tests\n```\n";
        assert_eq!(readme_test_command(readme).unwrap(), "cargo test --workspace");
        assert!(readme_test_command("nothing").is_err());
    }
}
