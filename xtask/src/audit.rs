//! `cargo xtask audit`: every number that the program writes or prints beside its definition, on random scenes and cases.
//!
//! The definitions and the draws are in `tests/audit`; the table says where each number is defined
//! and how far it deviates.

use crate::process::program;
use fixtures::failure::{Failure, Outcome};
use std::ops::Range;
use std::path::{Path, PathBuf};
use wakescope_tests::audit::{Report, audit};

/// How many scenes and cases continuous integration draws, with which seed.
pub(crate) const SCENES: usize = 100;
pub(crate) const SEED: u64 = 1;

/// Runs the draws of these numbers and prints the table.
///
/// # Errors
/// Fails if a number is wrong or has no definition.
pub(crate) fn run(
    given: Option<&Path>,
    seed: u64,
    draws: Range<usize>,
    keep: Option<PathBuf>,
) -> Outcome {
    checked_report(given, seed, draws, keep).map(drop)
}

/// Runs the draws of continuous integration, prints the table and returns it for the page of the book.
///
/// # Errors
/// As [`run`].
pub(crate) fn page() -> Result<String, Failure> {
    let report = checked_report(None, SEED, 0..SCENES, None)?;
    let last = SCENES - 1;
    Ok(format!("Draws 0 to {last} of seed {SEED}: {}", report.page))
}

fn checked_report(
    given: Option<&Path>,
    seed: u64,
    draws: Range<usize>,
    keep: Option<PathBuf>,
) -> Result<Report, Failure> {
    let program = program(given)?;
    let threads = std::thread::available_parallelism()?.get();
    let keep = keep.map(std::path::absolute).transpose()?;
    let report = audit(
        &program,
        seed,
        draws.start,
        draws.len(),
        threads,
        keep.as_deref(),
    );
    print!("{}", report.text);
    if report.faults.is_empty() {
        return Ok(report);
    }
    Err(Failure::new(format!(
        "{} numbers are wrong or have no definition",
        report.faults.len()
    )))
}
