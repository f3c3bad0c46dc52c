//! `cargo xtask forecast`: the time and memory that `wakescope check` forecasts, and what the runs take.
//!
//! Ten diverse scenes, each a run of the release program in a process of its own with one thread, drawing and writing
//! included. Memory is the largest resident set less that of a run that does next to nothing.

use crate::process::{program, run_scene};
use crate::workspace::unless;
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

/// Largest ratio of forecast and time, and of forecast and memory, either way.
const MOST: [f64; 2] = [2.0, 1.5];

/// The scenes.
#[derive(Deserialize)]
struct Scenes {
    /// A run that does next to nothing.
    empty: String,
    scene: Vec<Scene>,
}

#[derive(Deserialize)]
struct Scene {
    name: String,
    command: String,
    text: String,
}

pub(crate) fn run(options: &Options) -> Outcome {
    let (program, folder) = (program(options.program.as_deref())?, tempfile::tempdir()?);
    let Scenes { empty, scene } = toml::from_str(include_str!("forecast.toml"))?;
    let [_, [_, empty_bytes]] = measured(&program, folder.path(), &empty, "run")?;
    println!("a run of next to nothing: {:.1} MB", empty_bytes / 1e6);
    println!(
        "{:<28} time: forecast, run [s], ratio; memory: forecast, run [MB], ratio",
        "scene"
    );
    let mut beyond = Vec::new();
    let wanted = |name: &str| {
        options
            .only
            .as_ref()
            .is_none_or(|word| name.contains(word.as_str()))
    };
    for Scene {
        name,
        command,
        text,
    } in scene.iter().filter(|s| wanted(&s.name))
    {
        let [[forecast_s, forecast_bytes], [time_s, bytes]] =
            measured(&program, folder.path(), text, command)?;
        let bytes = (bytes - empty_bytes).max(1e5);
        let ratios = [forecast_s / time_s, forecast_bytes / bytes];
        let time = format!("{forecast_s:>10.2} {time_s:>10.2} {:>6.2}", ratios[0]);
        let memory = format!(
            "{:>10.1} {:>10.1} {:>6.2}",
            forecast_bytes / 1e6,
            bytes / 1e6,
            ratios[1]
        );
        println!("{name:<28} {time}   {memory}");
        let inside = ratios
            .iter()
            .zip(MOST)
            .all(|(ratio, most)| (1.0 / most..=most).contains(ratio));
        beyond.extend((!inside).then_some(name));
    }
    unless(
        &format!("beyond {} in time or {} in memory", MOST[0], MOST[1]),
        &beyond,
    )
}

/// Time \[s\] and memory \[bytes\] as they are forecast, and as they are found.
fn measured(
    program: &Path,
    folder: &Path,
    scene: &str,
    command: &str,
) -> Result<[[f64; 2]; 2], Failure> {
    let run = run_scene(program, folder, scene, &[command, "--json"])?;
    // The plan is part of what a run tells; the numbers of the whole are those at the first level of the object.
    let told: serde_json::Value = serde_json::from_str(&run.stdout)?;
    let number = |key: &str| {
        told[key]
            .as_f64()
            .ok_or_else(|| Failure::new(format!("{command} tells no {key}: {told}")))
    };
    Ok([
        [number("core_s")?, number("memory_bytes")?],
        [run.cpu_s, run.peak_bytes],
    ])
}
