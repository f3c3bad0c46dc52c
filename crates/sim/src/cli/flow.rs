//! `wakescope flow` and `wakescope wake`: simulations from case files, and of the wake of an aircraft near the ground from presets, on the
//! processes of `mpirun` or in one.

use super::options::{BESIDE_EXAMPLE, BESIDE_PRINT, WITHOUT_OUTPUT};
use super::{Cli, paths};
use crate::Error;
#[cfg(feature = "plots")]
use crate::flow::FinishedWake;
use crate::flow::{Begin, CaseFile, CaseKind, FlowOutcome, WakePreset, check_on, example, run_on};
use crate::progress::{Observer, Silent};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use wakescope_les::ranks::{Ranks, Single};

/// Where a simulation writes and how it begins.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// Output folder; created if missing.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Continue from the checkpoint in the output folder.
    #[arg(long, conflicts_with = "overwrite")]
    restart: bool,
    /// Start again and replace existing files, checkpoint included.
    #[arg(long)]
    overwrite: bool,
    /// Check the case and print the forecast; write nothing.
    #[arg(long)]
    check: bool,
    /// End of the run: tau of a wake, else time in s.
    #[arg(long, value_name = "END")]
    pub(super) end: Option<f64>,
    /// Run even if the memory forecast exceeds the machine's.
    #[arg(long)]
    allow_large: bool,
}

/// Runs `wakescope flow`: prints an example, or simulates a case.
pub(super) fn flow(
    example_name: Option<&str>,
    case: Option<&Path>,
    run: &RunArgs,
    cli: &Cli,
) -> Result<(), Error> {
    if example_name.is_some() {
        cli.refuse_idle("--example", BESIDE_EXAMPLE)?;
    }
    ranked(cli, |ranks| {
        match (example_name.and_then(example), case) {
            (Some(text), _) => print(text, cli, ranks),
            (None, Some(case)) => simulate(cli.case(case, None)?, run, cli, ranks),
            // Arguments were checked: without an example there is a case.
            (None, None) => Ok(()),
        }
    })
}

/// Runs `wakescope wake`: simulates a case file, a preset, or the one over the other.
pub(super) fn wake(
    case: Option<&Path>,
    preset: Option<WakePreset>,
    run: &RunArgs,
    cli: &Cli,
) -> Result<(), Error> {
    ranked(cli, |ranks| {
        simulate(wake_file(case, preset, cli)?, run, cli, ranks)
    })
}

/// Runs `wakescope wake --print`: prints the case file, with the end of the command line.
pub(super) fn print_wake(
    case: Option<&Path>,
    preset: Option<WakePreset>,
    end: Option<f64>,
    cli: &Cli,
) -> Result<(), Error> {
    cli.refuse_idle("--print", BESIDE_PRINT)?;
    ranked(cli, |ranks| {
        let mut file = seeded(wake_file(case, preset, cli)?, cli)?;
        if let Some(end) = end {
            file = file.with_end(end)?;
        }
        print(&file.toml, cli, ranks)
    })
}

/// Prints a text, on rank 0.
fn print(text: &str, cli: &Cli, ranks: &Arc<dyn Ranks>) -> Result<(), Error> {
    if ranks.rank() > 0 {
        return Ok(());
    }
    cli.print(text)
}

/// The case file of a wake.
fn wake_file(
    path: Option<&Path>,
    preset: Option<WakePreset>,
    cli: &Cli,
) -> Result<CaseFile, Error> {
    let file = case_file(path, preset, cli)?;
    if matches!(file.content.case, CaseKind::Wake(_)) {
        return Ok(file);
    }
    Err(Error::Input {
        path: path.unwrap_or(Path::new("")).to_owned(),
        reason: "case.kind is not \"wake\": wakescope flow runs it".into(),
    })
}

/// A case with the seed of the command line.
pub(super) fn seeded(file: CaseFile, cli: &Cli) -> Result<CaseFile, Error> {
    match cli.seed {
        Some(seed) => Ok(file.with_seed(seed)?),
        None => Ok(file),
    }
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

/// Runs a case and prints its results, on rank 0.
fn simulate(
    mut file: CaseFile,
    args: &RunArgs,
    cli: &Cli,
    ranks: &Arc<dyn Ranks>,
) -> Result<(), Error> {
    let is_first = ranks.rank() == 0;
    if args.out.is_none() {
        cli.refuse_idle(file.path(), WITHOUT_OUTPUT)?;
    }
    if let Some(end) = args.end {
        file = file.with_end(end)?;
    }
    let file = seeded(file, cli)?;
    let begin = match (args.restart, args.overwrite) {
        (true, _) => Begin::Restart,
        (_, true) => Begin::Overwrite,
        _ => Begin::New,
    };
    if args.check {
        if !is_first {
            return Ok(());
        }
        let forecast = check_on(ranks, &file, args.out.as_deref(), begin, args.allow_large)?;
        for text in &forecast.notes {
            cli.observer().warn(text);
        }
        let mut object = json!(forecast);
        object["version"] = crate::VERSION.into();
        return cli.say(&object, &format!("good\n{forecast}"));
    }
    let Some(out) = &args.out else {
        let reason = "a run needs a folder to write to";
        return Err(Error::input(Path::new("--out DIR"), reason));
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
    let mut outcome = run_on(ranks, &file, out, begin, args.allow_large, &*observer)?;
    if !is_first {
        return Ok(());
    }
    #[cfg(feature = "plots")]
    if outcome.is_complete && file.content.wake.is_some() {
        draw(out, &mut outcome, cli);
    }
    report(&file, &outcome, ranks.count(), out, cli)
}

/// Draws a finished wake; a wake that cannot be drawn is a warning, as its run is complete.
#[cfg(feature = "plots")]
fn draw(folder: &Path, outcome: &mut FlowOutcome, cli: &Cli) {
    match FinishedWake::read(folder).and_then(|wake| wake.draw()) {
        Ok(files) => outcome.files.extend(files),
        Err(error) => {
            let text = format!("the wake is not drawn: {error}");
            cli.observer().warn(&text);
            outcome.warnings.push(text);
        }
    }
}

/// Prints the results of a run.
fn report(
    file: &CaseFile,
    outcome: &FlowOutcome,
    ranks: usize,
    folder: &Path,
    cli: &Cli,
) -> Result<(), Error> {
    let FlowOutcome {
        steps,
        time_s,
        is_complete,
        kinetic_energy_m5_s2,
        relative_divergence,
        steps_wall_s,
        exchange_wall_s,
        files,
        warnings,
    } = outcome;
    let object = json!({
        "version": crate::VERSION, "case_hash": file.hash, "steps": steps, "time_s": time_s, "is_complete": is_complete,
        "kinetic_energy_m5_s2": kinetic_energy_m5_s2, "relative_divergence": relative_divergence, "steps_wall_s": steps_wall_s,
        "exchange_wall_s": exchange_wall_s, "files": paths(files), "warnings": warnings,
    });
    let state = if *is_complete {
        "done"
    } else {
        "paused, --restart continues it"
    };
    let mut text = format!(
        "{state}: step {steps}, t = {time_s:?} s, energy {kinetic_energy_m5_s2:.6e} m^5/s^2, "
    );
    text += &format!("relative divergence {relative_divergence:.1e}\n");
    if ranks > 1 {
        let share = 100.0 * exchange_wall_s / steps_wall_s;
        text += &format!("steps took {steps_wall_s:.1} s, {share:.1} % of it in turns and halos\n");
    }
    let count = files.len();
    text += &format!("wrote {count} files to {}", folder.display());
    cli.say(&object, &text)
}

/// Variables in which Open MPI and MPICH (with its relatives) give each process the number of processes.
const COUNTS: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

/// Runs `work` on the processes that share it. Where it fails, rank 0 alone says so, and all end.
fn ranked(cli: &Cli, work: impl FnOnce(&Arc<dyn Ranks>) -> Result<(), Error>) -> Result<(), Error> {
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
        let count = ranks.count();
        let threads = rayon::current_num_threads();
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
