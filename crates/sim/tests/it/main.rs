//! The crate from outside: whole runs of scenes and flows, and the program as a user meets it.

// A test that cannot set up its input has failed.
#![allow(clippy::unwrap_used)]

mod accumulation;
#[cfg(all(feature = "cli", feature = "plots"))]
mod accuracy;
mod air;
#[cfg(all(feature = "cli", feature = "plots"))]
mod book;
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "cli")]
mod data_sets;
mod dataset;
#[cfg(feature = "cli")]
mod detection;
#[cfg(feature = "cli")]
mod estimate;
#[cfg(feature = "cli")]
mod files_of_others;
#[cfg(feature = "cli")]
mod host;
#[cfg(feature = "cli")]
mod hostile_files;
#[cfg(feature = "cli")]
mod messages;
#[cfg(all(feature = "cli", feature = "plots"))]
mod options;
#[cfg(all(feature = "cli", feature = "plots"))]
mod planes;
mod receiver;
#[cfg(all(feature = "cli", feature = "plots"))]
mod retrieve;
#[cfg(feature = "plots")]
mod scan_fields;
#[cfg(feature = "plots")]
mod scans;
mod scene_features;
mod score;
mod simulated_flow;
#[cfg(all(feature = "cli", feature = "plots"))]
mod sweep;
#[cfg(feature = "cli")]
mod wake;
#[cfg(all(feature = "cli", feature = "plots"))]
mod wind;

/// The program, run in a folder.
#[cfg(feature = "cli")]
fn wakescope(folder: &std::path::Path, words: &[&str]) -> std::process::Output {
    std::process::Command::new(env!("CARGO_BIN_EXE_wakescope"))
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap()
}
