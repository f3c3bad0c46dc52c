//! The files of the workspace, and what is written about those that a task makes.

use fixtures::failure::{Failure, Outcome};
use std::path::{Path, PathBuf};
use wakescope_sim::io::Provenance;

/// Provenance of what follows from formulas and the parameters given as TOML.
pub(crate) fn provenance(parameters: &str, seed: u64) -> Provenance {
    Provenance {
        program: wakescope_sim::PROGRAM.into(),
        scene_toml: parameters.into(),
        scene_hash: wakescope_sim::scene::hash_of(parameters),
        seed,
    }
}

/// Well, unless some are named: then what is wrong with them, in words.
pub(crate) fn unless(what: &str, named: &[impl ToString]) -> Outcome {
    let named: Vec<String> = named.iter().map(ToString::to_string).collect();
    if named.is_empty() {
        Ok(())
    } else {
        Err(Failure::new(format!("{what}: {}", named.join("; "))))
    }
}

/// The root folder of the workspace.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap_or(Path::new("."))
        .to_owned()
}

/// The folder of what cargo builds.
pub(crate) fn built() -> PathBuf {
    root().join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or("target".into()))
}

/// The text of a file, by its path from the root.
pub(crate) fn read(file: &str) -> Result<String, Failure> {
    std::fs::read_to_string(root().join(file))
        .map_err(|e| Failure::new(format!("cannot read {file}: {e}")))
}

/// Numbers of a reference file without its comments, row by row.
pub(crate) fn numbers(file: &str) -> Result<Vec<Vec<f64>>, Failure> {
    let text = read(&format!("tests/reference/les/{file}"))?;
    let mut rows = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let cells: Result<Vec<f64>, _> = line.split(',').map(|cell| cell.trim().parse()).collect();
        // The names of the columns are no numbers.
        rows.extend(cells.ok());
    }
    Ok(rows)
}
