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
mod cost;
mod figures;
mod fit_trials;
mod left_out;
mod process;
mod profile;
mod ranks;
#[cfg(test)]
mod ranks_model;
mod regress;
mod reproduce;
mod sources;
mod stability;
mod stability_maps;
mod statistics;
#[cfg(test)]
#[path = "../../crates/les/src/ranks/threads.rs"]
mod thread_ranks;
mod tidy;
mod wakes;
mod work_precision;
mod workspace;

use clap::{Parser, Subcommand};

#[derive(Debug, Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    about = "Tasks of the wakescope workspace"
)]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Draw the figures, measure the claims, write the report.
    ReproduceFigs(reproduce::ReproduceFigsArgs),
    /// Compare what the crates compute now with the stored reference curves.
    Regress(regress::RegressArgs),
    /// Compare a wake under `mpirun` with one process; kill a process of a run.
    Ranks(ranks::RanksArgs),
    /// Write stored reference curves from what the crates compute now.
    Bless(bless::BlessArgs),
    /// Measure error against run time.
    WorkPrecision(work_precision::WorkPrecisionArgs),
    /// Cost of each part of a scene and of each feature of a crate.
    LeftOut(left_out::LeftOutArgs),
    /// Fit many scans of a vortex pair: bias, scatter, reported error, bound.
    FitTrials(fit_trials::FitTrialsArgs),
    /// Run every stiff and extreme case of the crates against its expected outcome.
    Stability(stability::StabilityArgs),
    /// Compare every number of the program with its definition on random scenes and cases.
    Audit(audit::AuditArgs),
    /// Build the book as a static site, with the documentation of the crates beside it.
    Book,
    /// Check the rules of the house.
    Tidy,
    /// Run everything that continuous integration runs.
    Ci(ci::CiArgs),
}

fn main() -> std::process::ExitCode {
    let result = match Cli::parse().task {
        Task::ReproduceFigs(options) => reproduce::run(&options),
        Task::Regress(options) => regress::run(&options),
        Task::Ranks(options) => ranks::run(&options),
        Task::Bless(options) => bless::run(&options),
        Task::WorkPrecision(options) => work_precision::run(&options),
        Task::LeftOut(options) => left_out::run(&options),
        Task::FitTrials(options) => fit_trials::run(&options),
        Task::Stability(options) => stability::run(&options),
        Task::Audit(options) => audit::run(&options),
        Task::Book => book::run(),
        Task::Tidy => tidy::run(),
        Task::Ci(options) => ci::run(&options),
    };
    if let Err(failure) = result {
        eprintln!("error: {failure}");
        return std::process::ExitCode::from(2);
    }
    std::process::ExitCode::SUCCESS
}
