//! `wakescope flow` and `wakescope wake`: simulations from case files, and of the wake of an aircraft near the ground from presets, on the
//! processes of `mpirun` or in one.

use super::{Cli, paths};
use crate::Error;
#[cfg(feature = "plots")]
use crate::flow::FinishedWake;
use crate::flow::{
    Begin, CaseFile, CaseKind, EXAMPLES, FlowOutcome, RunOptions, WakePreset, check_on, example,
    run_on,
};
use crate::setup::progress::{Observer, Silent};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use wakescope_les::ranks::{Ranks, Single};

/// Words of `wakescope flow`.
#[derive(Debug, Args)]
pub(super) struct FlowWords {
    /// The case file; --example prints one.
    #[arg(required_unless_present = "example")]
    case: Option<PathBuf>,
    #[command(flatten)]
    run: RunWords,
    /// Print a commented case file and do nothing else.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["case", "out"], value_parser = EXAMPLES.map(|(name, _)| name))]
    example: Option<String>,
}

/// Words of `wakescope wake`.
#[derive(Debug, Args)]
pub(super) struct WakeWords {
    /// A case file with kind = "wake"; keys that it lacks are those of the preset.
    case: Option<PathBuf>,
    /// How fine the flow is; coarse without one, unless a case file is given.
    #[arg(long, value_enum)]
    preset: Option<WakePreset>,
    /// Print the case file and do nothing else.
    #[arg(long)]
    print: bool,
    #[command(flatten)]
    run: RunWords,
}

/// Where a simulation writes and how it begins.
#[derive(Debug, Args)]
pub(super) struct RunWords {
    /// Folder to write to; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Continue from the checkpoint in the folder.
    #[arg(long, conflicts_with = "overwrite")]
    restart: bool,
    /// Begin anew and replace existing files, the checkpoint included.
    #[arg(long)]
    overwrite: bool,
    /// Print what the run would take and check it; nothing is computed or written.
    #[arg(long)]
    check: bool,
    /// End of the run in place of the case's: the age tau of a wake, of other flows a time in seconds.
    #[arg(long, value_name = "END")]
    end: Option<f64>,
    /// Run even if the forecast of the memory is more than the machine has.
    #[arg(long)]
    allow_large: bool,
}

pub(super) fn flow(words: &FlowWords, cli: &Cli, ranks: &Arc<dyn Ranks>) -> Result<(), Error> {
    if let Some(text) = words.example.as_deref().and_then(example) {
        return if ranks.rank() == 0 {
            cli.print(text)
        } else {
            Ok(())
        };
    }
    // The words were checked: without an example there is a case.
    let Some(case) = &words.case else {
        return Ok(());
    };
    let file = cli.case(case, None)?;
    simulate(file, &words.run, cli, ranks)
}

pub(super) fn wake(words: &WakeWords, cli: &Cli, ranks: &Arc<dyn Ranks>) -> Result<(), Error> {
    let file = case_file(words.case.as_deref(), words.preset, cli)?;
    if !matches!(file.content.case, CaseKind::Wake(_)) {
        let path = words.case.clone().unwrap_or_default();
        return Err(Error::Input {
            path,
            reason: "case.kind is not \"wake\": wakescope flow runs it".into(),
        });
    }
    if words.print {
        let file = cli
            .seed
            .map_or(Ok(file.clone()), |seed| file.with_seed(seed))?;
        return if ranks.rank() == 0 {
            cli.print(&file.toml)
        } else {
            Ok(())
        };
    }
    simulate(file, &words.run, cli, ranks)
}

/// A case file, a preset, or the one over the other; the coarse preset without either.
pub(super) fn case_file(
    path: Option<&Path>,
    preset: Option<WakePreset>,
    cli: &Cli,
) -> Result<CaseFile, Error> {
    match path {
        Some(path) => cli.case(path, preset),
        None => Ok(CaseFile::parse_over(
            preset.or(Some(WakePreset::Coarse)),
            "",
            Path::new("preset"),
        )?),
    }
}

/// Runs a case and says what came of it, on rank 0.
fn simulate(
    mut file: CaseFile,
    words: &RunWords,
    cli: &Cli,
    ranks: &Arc<dyn Ranks>,
) -> Result<(), Error> {
    let is_first = ranks.rank() == 0;
    if let Some(end) = words.end {
        file = file.with_end(end)?;
    }
    if let Some(seed) = cli.seed {
        file = file.with_seed(seed)?;
    }
    let begin = match (words.restart, words.overwrite) {
        (true, _) => Begin::Restart,
        (_, true) => Begin::Overwrite,
        _ => Begin::New,
    };
    let options = RunOptions {
        begin,
        allow_large: words.allow_large,
    };
    if words.check {
        if !is_first {
            return Ok(());
        }
        let forecast = check_on(ranks, &file, words.out.as_deref(), options)?;
        forecast
            .notes
            .iter()
            .for_each(|text| cli.observer().warn(text));
        let mut object = json!(forecast);
        object["version"] = crate::VERSION.into();
        return cli.say(&object, &format!("good\n{forecast}"));
    }
    let Some(out) = &words.out else {
        return Err(Error::Input {
            path: "--out DIR".into(),
            reason: "a run needs a folder to write to".into(),
        });
    };
    let observer: Arc<dyn Observer> = if is_first {
        cli.observer()
    } else {
        Arc::new(Silent)
    };
    #[cfg_attr(
        not(feature = "plots"),
        expect(unused_mut, reason = "there is nothing to draw with")
    )]
    let mut outcome = run_on(ranks, &file, out, options, &*observer)?;
    if !is_first {
        return Ok(());
    }
    #[cfg(feature = "plots")]
    if outcome.is_complete && file.content.wake.is_some() {
        match FinishedWake::read(out).and_then(|wake| wake.draw()) {
            Ok(files) => outcome.files.extend(files),
            // The run is done all the same.
            Err(error) => {
                let text = format!("the wake is not drawn: {error}");
                cli.observer().warn(&text);
                outcome.warnings.push(text);
            }
        }
    }
    let FlowOutcome {
        steps,
        time_s,
        is_complete,
        kinetic_energy_m5_s2,
        relative_divergence,
        stepping,
        ..
    } = outcome;
    let object = json!({
        "version": crate::VERSION, "case_hash": file.hash, "steps": steps, "time_s": time_s, "is_complete": is_complete,
        "kinetic_energy_m5_s2": kinetic_energy_m5_s2, "relative_divergence": relative_divergence, "steps_wall_s": stepping.wall_s,
        "exchange_wall_s": stepping.exchange_s, "files": paths(&outcome.files), "warnings": outcome.warnings,
    });
    let state = if is_complete {
        "done"
    } else {
        "paused, --restart continues it"
    };
    let mut text = format!(
        "{state}: step {steps}, t = {time_s:?} s, energy {kinetic_energy_m5_s2:.6e} m^5/s^2, "
    );
    text += &format!("relative divergence {relative_divergence:.1e}\n");
    if ranks.count() > 1 {
        let share = 100.0 * stepping.exchange_s / stepping.wall_s;
        text += &format!(
            "steps took {:.1} s, {share:.1} % of it in turns and halos\n",
            stepping.wall_s
        );
    }
    cli.say(
        &object,
        &format!(
            "{text}wrote {} files to {}",
            outcome.files.len(),
            out.display()
        ),
    )
}

/// What Open MPI and MPICH (with its relatives) tell each process of their number.
const COUNTS: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

/// Runs `work` on the processes that share it. Where it fails, rank 0 alone says so, and all end.
pub(super) fn ranked(
    cli: &Cli,
    work: impl FnOnce(&Arc<dyn Ranks>) -> Result<(), Error>,
) -> Result<(), Error> {
    let started = COUNTS
        .iter()
        .find_map(|name| std::env::var(name).ok()?.parse::<usize>().ok());
    match started.filter(|count| *count > 1) {
        None => work(&(Arc::new(Single) as Arc<dyn Ranks>)),
        Some(count) => on_processes(count, cli, work),
    }
}

#[cfg(feature = "mpi")]
fn on_processes(
    _: usize,
    cli: &Cli,
    work: impl FnOnce(&Arc<dyn Ranks>) -> Result<(), Error>,
) -> Result<(), Error> {
    let world = crate::processes::World::join()?;
    let ranks = world.ranks();
    if ranks.rank() == 0 && !cli.quiet {
        use std::io::Write as _;
        let (count, threads) = (ranks.count(), rayon::current_num_threads());
        let _ = writeln!(
            std::io::stderr(),
            "{count} ranks; threads of the first: {threads}"
        );
    }
    work(&ranks).or_else(|error| world.fail(|| super::output::complain(&error, cli.json)))
}

#[cfg(not(feature = "mpi"))]
fn on_processes(
    count: usize,
    _: &Cli,
    _: impl FnOnce(&Arc<dyn Ranks>) -> Result<(), Error>,
) -> Result<(), Error> {
    let reason = format!(
        "{count} processes were started, but this build shares no flow among them: build with `--features mpi`, or start one"
    );
    Err(Error::Input {
        path: "mpirun".into(),
        reason,
    })
}
