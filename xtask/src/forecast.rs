//! `cargo xtask forecast`: the time and memory that `wakescope check` forecasts, and what the runs take.
//!
//! Ten diverse scenes, each a run of the release program in a process of its own with one thread, drawing and writing
//! included. Memory is the largest resident set less that of a run that does next to nothing.

use crate::process::{program, run_scene};
use fixtures::failure::{Failure, Outcome};
use serde::Deserialize;
use std::path::Path;

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The program to run, instead of the release build.
    #[arg(long, value_name = "FILE")]
    program: Option<std::path::PathBuf>,
    /// Only the scenes whose name contains this.
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
}

/// Largest ratio of forecast and time, either way, and of forecast and memory.
const TIME: f64 = 2.0;
const MEMORY: f64 = 1.5;

/// A run that does next to nothing.
const EMPTY: &str = "[detector.snr]\nreference = \"fixed\"\nsnr_db = 0.0\n[flow]\nkind = \"calm\"\n[scan]\n\
    elevation_max_rad = 0.0\nrange_max_m = 320.0\npulses_per_line = 1\nrealisations = 1\n[outputs]\nnetcdf = false\n\
    svg = false\npng = false\nprofile_points = 2\n";

/// The scenes.
#[derive(Deserialize)]
struct Scenes {
    scene: Vec<Scene>,
}

#[derive(Deserialize)]
struct Scene {
    name: String,
    command: String,
    text: String,
}

pub(crate) fn run(options: &Options) -> Outcome {
    let (program, folder) = (program(options.program.as_deref())?, std::env::temp_dir().join("wakescope-forecast"));
    std::fs::create_dir_all(&folder)?;
    let empty = measured(&program, &folder, EMPTY, "run")?;
    println!("a run of next to nothing: {:.1} MB", empty.actual.1 / 1e6);
    println!("{:<28} time: forecast, run [s], ratio; memory: forecast, run [MB], ratio", "scene");
    let mut beyond = Vec::new();
    let wanted = |name: &str| options.only.as_ref().is_none_or(|word| name.contains(word.as_str()));
    let Scenes { scene } = toml::from_str(include_str!("forecast.toml"))?;
    for Scene { name, command, text } in scene.iter().filter(|s| wanted(&s.name)) {
        let found = measured(&program, &folder, text, command)?;
        let (forecast, time, memory) = (found.forecast, found.actual.0, (found.actual.1 - empty.actual.1).max(1e5));
        let ratios = (forecast.0 / time, forecast.1 / memory);
        println!(
            "{name:<28} {:>10.2} {time:>10.2} {:>6.2}   {:>10.1} {:>10.1} {:>6.2}",
            forecast.0,
            ratios.0,
            forecast.1 / 1e6,
            memory / 1e6,
            ratios.1
        );
        let inside = |ratio: f64, limit: f64| (1.0 / limit..=limit).contains(&ratio);
        if !inside(ratios.0, TIME) || !inside(ratios.1, MEMORY) {
            beyond.push(name.as_str());
        }
    }
    std::fs::remove_dir_all(&folder)?;
    match beyond.is_empty() {
        true => Ok(()),
        false => Err(Failure::new(format!("beyond {TIME} in time or {MEMORY} in memory: {}", beyond.join(", ")))),
    }
}

/// Time \[s\] and memory \[bytes\], forecast and found.
struct Measured {
    forecast: (f64, f64),
    actual: (f64, f64),
}

fn measured(program: &Path, folder: &Path, scene: &str, command: &str) -> Result<Measured, Failure> {
    let run = run_scene(program, folder, scene, &[command, "--json"])?;
    // The plan is part of what a run tells; the numbers of the whole are those at the first level of the object.
    let number = |key: &str| {
        let line = run.stdout.lines().find_map(|l| l.strip_prefix(&format!("  \"{key}\": ")));
        let value = line.and_then(|l| l.trim_end_matches(',').parse::<f64>().ok());
        value.ok_or_else(|| Failure::new(format!("{command} tells no {key}: {}", run.stdout)))
    };
    let forecast = (number("core_s")?, number("memory_bytes")?);
    Ok(Measured { forecast, actual: (run.cpu_s, run.peak_bytes) })
}
