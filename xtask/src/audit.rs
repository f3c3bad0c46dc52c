//! `cargo xtask audit`: every number that the program writes or prints beside its definition, on random scenes and cases.
//!
//! The definitions and the draws are in `tests/audit`; the table says where each number is defined and how far it is off.

use crate::process::program;
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use std::path::PathBuf;

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
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
    /// Store the table for the book.
    #[arg(long)]
    store: bool,
}

/// Where the book reads the table.
const STORED: &str = "docs/src/audit-table.md";

pub(crate) fn run(options: &Options) -> Outcome {
    let program = program(options.program.as_deref())?;
    let threads = std::thread::available_parallelism()?.get();
    let Options {
        seed,
        first,
        scenes,
        ..
    } = *options;
    let keep = options.keep.as_ref().map(std::path::absolute).transpose()?;
    let report =
        wakescope_tests::audit::audit(&program, seed, first, scenes, threads, keep.as_deref());
    print!("{}", report.text);
    if options.store {
        let page = format!(
            "Draws {first} to {} of seed {seed}: {}",
            first + scenes - 1,
            report.page
        );
        wakescope_sim::io::write_atomic(&root().join(STORED), page.as_bytes())?;
        println!("stored {STORED}");
    }
    match report.faults.is_empty() {
        true => Ok(()),
        false => Err(Failure::new(format!(
            "{} numbers are wrong or have no definition",
            report.faults.len()
        ))),
    }
}
