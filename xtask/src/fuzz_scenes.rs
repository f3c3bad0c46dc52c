//! `cargo xtask fuzz-scenes`: random changes of the default scene through `check` and short runs.
//!
//! What `check` passes must run; nothing may panic, abort or hang. Each scene is checked and run in a process of its own, with
//! its time limited. The scenes follow from the seed and their number alone.

mod change;

use crate::process::{Watched, program, watch};
use crate::workspace::unless;
use change::scene;
use fixtures::failure::Outcome;

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The program to run, instead of the release build.
    #[arg(long, value_name = "FILE")]
    program: Option<std::path::PathBuf>,
    /// Number of the first scene.
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// How many scenes.
    #[arg(long, default_value_t = 2000)]
    count: u64,
    /// Seed of the changes.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Longest processor time of a check, and of a run that was forecast to be short, s.
    #[arg(long, default_value_t = 10.0)]
    limit_s: f64,
    /// Longest forecast of a scene that is run, s of processor.
    #[arg(long, default_value_t = 1.0)]
    run_below_s: f64,
}

pub(crate) fn run(options: &Options) -> Outcome {
    let (program, folder) = (program(options.program.as_deref())?, tempfile::tempdir()?);
    let folder = folder.path();
    let (mut good, mut ran, mut faults) = (0, 0, Vec::new());
    for index in options.first..options.first + options.count {
        let text = scene(options.seed, index);
        std::fs::write(folder.join("s.toml"), &text)?;
        let check = watch(
            &program,
            &["check", "s.toml", "--json", "--threads", "1"],
            folder,
            options.limit_s,
        )?;
        good += u64::from(check.code == Some(0));
        let is_short = check.code == Some(0) && forecast_s(&check.stdout) < options.run_below_s;
        ran += u64::from(is_short);
        let fault = match (fault_of(&check, &[Some(0), Some(2)]), is_short) {
            (None, true) => {
                let words = ["run", "s.toml", "--out", "out", "--quiet", "--threads", "1"];
                let run = watch(&program, &words, folder, options.limit_s)?;
                std::fs::remove_dir_all(folder.join("out")).ok();
                fault_of(&run, &[Some(0)]).map(|fault| format!("check passes it, run {fault}"))
            }
            (fault, _) => fault.map(|fault| format!("check {fault}")),
        };
        if let Some(fault) = fault {
            println!("scene {index}: {fault}\n{text}");
            faults.push(index);
        }
    }
    let refused = options.count - good;
    println!(
        "{} scenes: {refused} refused, {good} good, {ran} of these run; {} faults",
        options.count,
        faults.len()
    );
    unless(
        &format!("faults in the scenes of seed {}", options.seed),
        &faults,
    )
}

/// What is wrong with an end that is not among the `allowed` ones.
fn fault_of(found: &Watched, allowed: &[Option<i32>]) -> Option<String> {
    match found.hung {
        true => Some(format!("takes more than {:.1} s", found.cpu_s)),
        false if allowed.contains(&found.code) => None,
        false => Some(format!(
            "ends with {:?}: {}",
            found.code,
            found.stderr.trim_end()
        )),
    }
}

/// Time that a plan forecasts, s.
fn forecast_s(json: &str) -> f64 {
    json.lines()
        .filter_map(|l| {
            l.trim()
                .strip_prefix("\"core_s\":")?
                .trim()
                .trim_end_matches(',')
                .parse::<f64>()
                .ok()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use wakescope_sim::plan::{Plan, Target};
    use wakescope_sim::scene::SceneFile;

    const SCENES: u64 = 2000;

    #[test]
    fn changed_scenes_are_refused_or_planned() {
        let mut good = 0;
        for index in 0..SCENES {
            let text = scene(1, index);
            let Ok(file) = SceneFile::parse(&text, Path::new("s.toml")) else {
                continue;
            };
            let Ok(plan) = Plan::new(file, Target::Run) else {
                continue;
            };
            let (core_s, memory_bytes) = (plan.core_s, plan.total().memory_bytes);
            assert!(
                core_s >= 0.0 && memory_bytes >= 0.0,
                "{index}: {core_s} {memory_bytes}\n{text}"
            );
            good += 1;
        }
        assert!(good > 400, "{good}");
    }
}
