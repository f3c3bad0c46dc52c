//! `cargo xtask audit`: every number that the program writes or prints beside its definition, on random scenes and cases.
//!
//! The definitions and the draws are in `tests/audit`; the table says where each number is defined
//! and how far it deviates.

use crate::process::program;
use fixtures::failure::{Failure, Outcome};
use std::path::PathBuf;
use wakescope_tests::audit::{Report, audit};

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct AuditArgs {
    /// How many scenes and cases.
    #[arg(long, default_value_t = 100)]
    scenes: usize,
    /// Number of the first one.
    #[arg(long, default_value_t = 0)]
    first: usize,
    /// Seed of the draws.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The program to run, instead of the release build.
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Folder in which scenes and outputs stay, a folder for each draw.
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
}

impl Default for AuditArgs {
    /// The draws of continuous integration.
    fn default() -> Self {
        Self {
            scenes: 100,
            first: 0,
            seed: 1,
            program: None,
            keep: None,
        }
    }
}

/// Runs the draws and prints the table.
///
/// # Errors
/// Fails if a number is wrong or has no definition.
pub(crate) fn run(args: &AuditArgs) -> Outcome {
    checked_report(args).map(drop)
}

/// Runs the draws of continuous integration, prints the table and returns it for the page of the book.
///
/// # Errors
/// As [`run`].
pub(crate) fn page() -> Result<String, Failure> {
    let args = AuditArgs::default();
    let report = checked_report(&args)?;
    let last = args.first + args.scenes - 1;
    Ok(format!(
        "Draws {} to {last} of seed {}: {}",
        args.first, args.seed, report.page
    ))
}

fn checked_report(args: &AuditArgs) -> Result<Report, Failure> {
    let program = program(args.program.as_deref())?;
    let threads = std::thread::available_parallelism()?.get();
    let keep = args.keep.as_ref().map(std::path::absolute).transpose()?;
    let report = audit(
        &program,
        args.seed,
        args.first,
        args.scenes,
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
