//! Tasks of the wakescope workspace: `cargo xtask --help`.

#![warn(clippy::too_many_lines, clippy::type_complexity)]
// A task talks to a person at a terminal.
#![allow(clippy::print_stdout)]

mod audit;
mod bless;
mod book;
mod cause;
mod ci;
mod claim;
mod column_tables;
mod conformance;
mod cost;
mod figures;
mod fit_trials;
mod key_tables;
mod left_out;
mod process;
mod profile;
mod ranks;
#[cfg(test)]
mod ranks_model_tests;
mod regress;
mod reproduce;
mod sources;
mod stability;
mod stability_maps;
mod statistics;
#[cfg(test)]
#[path = "../../crates/les/src/ranks/threads_for_tests.rs"]
mod thread_ranks;
mod tidy;
mod wakes;
mod work_precision;
mod workspace;

use clap::Parser;
use figures::context::Context;
use fixtures::failure::Outcome;
use profile::Profile;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    about = "Tasks of the wakescope workspace"
)]
enum Task {
    /// Draw the figures, measure the claims, write the report.
    ReproduceFigs {
        /// Numbers of the figures to draw, such as 1,5; the default is all.
        #[arg(long, value_delimiter = ',', value_name = "LIST")]
        only: Vec<u32>,
        /// Folder to write to.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Threads to compute with; the default is one for each core. Results do not depend on it.
        #[arg(long, default_value_t = 0, value_name = "N")]
        threads: usize,
        #[command(flatten)]
        context: Context,
    },
    /// Compare what the crates compute now with the stored reference curves.
    Regress {
        /// Compare only the curves whose name contains this.
        #[arg(long, value_name = "WORD")]
        only: Option<String>,
    },
    /// Compare a wake under `mpirun` with one process; kill a process of a run.
    Ranks {
        /// Also measure two ranks against one, and single exchanges; decides nothing.
        #[arg(long)]
        measure: bool,
    },
    /// Write stored reference curves from what the crates compute now.
    Bless {
        /// Names of the curves, as `cargo xtask regress` prints them; `wake`, which the figures of the profile quick look at.
        #[arg(required = true)]
        names: Vec<String>,
    },
    /// Measure error against run time.
    WorkPrecision {
        /// Group to measure; the default is all.
        #[arg(long, value_parser = work_precision::GROUPS.map(|group| group.0))]
        group: Option<String>,
        /// Folder to write to.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Few and coarse settings: a minute instead of many.
        #[arg(long)]
        quick: bool,
        /// Print only the processor time of the kernel by which times of other machines are scaled.
        #[arg(long)]
        kernel: bool,
    },
    /// Cost of each part of a scene and of each feature of a crate.
    LeftOut {
        /// The program to run, instead of the release build.
        #[arg(long, value_name = "FILE")]
        program: Option<PathBuf>,
        /// Also compile each crate with its features from nothing, which is slow.
        #[arg(long)]
        compile: bool,
    },
    /// Fit many scans of a vortex pair: bias, scatter, reported error, bound.
    FitTrials(fit_trials::FitTrialsArgs),
    /// Run every stiff and extreme case of the crates against its expected outcome.
    Stability {
        /// Quick leaves out what takes more than a few seconds.
        #[arg(long, value_enum, default_value_t = Profile::Full)]
        profile: Profile,
        /// Only the cases whose name contains this.
        #[arg(long, value_name = "WORD")]
        only: Option<String>,
        /// Folder to write to.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Compare every number of the program with its definition on random scenes and cases.
    Audit {
        /// How many scenes and cases.
        #[arg(long, default_value_t = audit::SCENES)]
        scenes: usize,
        /// Number of the first one.
        #[arg(long, default_value_t = 0)]
        first: usize,
        /// Seed of the draws.
        #[arg(long, default_value_t = audit::SEED)]
        seed: u64,
        /// The program to run, instead of the release build.
        #[arg(long, value_name = "FILE")]
        program: Option<PathBuf>,
        /// Folder in which scenes and outputs stay, a folder for each draw.
        #[arg(long, value_name = "DIR")]
        keep: Option<PathBuf>,
    },
    /// Write the conformance set: scans with exact truth in files of every format.
    Conformance {
        /// Folder to write to.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Replace the files of an earlier set.
        #[arg(long)]
        overwrite: bool,
    },
    /// Build the book as a static site, with the documentation of the crates beside it.
    Book,
    /// Check the rules of the house.
    Tidy,
    /// Run everything that continuous integration runs.
    Ci {
        /// Run only the steps whose name contains this.
        #[arg(long, value_name = "WORD")]
        only: Option<String>,
    },
}

fn run(task: Task) -> Outcome {
    match task {
        Task::ReproduceFigs {
            only,
            out,
            threads,
            context,
        } => reproduce::run(&only, out, threads, &context),
        Task::Regress { only } => regress::run(only.as_deref()),
        Task::Ranks { measure } => ranks::run(measure),
        Task::Bless { names } => bless::run(&names),
        Task::WorkPrecision { kernel: true, .. } => work_precision::print_kernel(),
        Task::WorkPrecision {
            group, out, quick, ..
        } => work_precision::run(group.as_deref(), out, quick),
        Task::LeftOut { program, compile } => left_out::run(program.as_deref(), compile),
        Task::FitTrials(options) => fit_trials::run(&options),
        Task::Stability { profile, only, out } => stability::run(profile, only.as_deref(), out),
        Task::Audit {
            scenes,
            first,
            seed,
            program,
            keep,
        } => audit::run(program.as_deref(), seed, first..first + scenes, keep),
        Task::Conformance { out, overwrite } => conformance::run(&out, overwrite),
        Task::Book => book::run(),
        Task::Tidy => tidy::run(),
        Task::Ci { only } => ci::run(only.as_deref()),
    }
}

fn main() -> std::process::ExitCode {
    let result = run(Task::parse());
    if let Err(failure) = result {
        eprintln!("error: {failure}");
        return std::process::ExitCode::from(2);
    }
    std::process::ExitCode::SUCCESS
}
