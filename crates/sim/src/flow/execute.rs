//! Running a case: from its file to the files of the run.
//!
//! Check: the tests of `flow` interrupt runs, kill them and let two of them meet in one folder.

use super::files::{Files, agree, checkpoint_paths};
use super::forecast::{FlowForecast, refuse_too_large};
use super::setup::Setup;
use super::wake::{age_tau, plain_schedule, wake_schedule};
use super::writer::{DIVISIONS, Writer, growth_note};
use super::{Begin, CaseFile, FlowCase, FlowOutcome};
use crate::io::Existing;
use crate::io::lock::FolderLock;
use crate::keys::Problem;
use crate::progress::{Observer, Stage};
use crate::{Error, machine};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use wakescope_les::ranks::{Ranks, Single, all_gather};
use wakescope_les::solver::{
    CheckpointPlan, Ends, Interval, NOTICED_GROWTH, Run, RunPlan, check_checkpoint,
};
use wakescope_les::{SubgridModel, TimeStep};

/// Steps between checkpoints where a case states nothing.
const STEPS_PER_CHECKPOINT: u64 = 500;

/// All that a run needs, found without computing.
pub(super) type Prepared = (Setup, RunPlan, Files, FlowForecast);

/// What a run on ranks would take, of which one calls this; nothing is written. With the folder that it would write to this is checked, too.
///
/// # Errors
/// All that [`run_on`] refuses before it computes.
pub fn check_on(
    ranks: &Arc<dyn Ranks>,
    file: &CaseFile,
    folder: Option<&Path>,
    begin: Begin,
    allow_large: bool,
) -> Result<FlowForecast, Error> {
    if let Some(folder) = folder {
        refuse_folder(folder, begin)?;
    }
    let folder = folder.unwrap_or(Path::new(""));
    let (setup, _, _, mut forecast) = prepare(file, folder, begin, allow_large, ranks)?;
    // A run reports these itself.
    let growth = setup.stability().undamped(forecast.step_s);
    let is_modelled = setup.settings.subgrid != SubgridModel::None;
    let noticed = growth.filter(|g| !is_modelled && g.rate_per_s * forecast.end_s > NOTICED_GROWTH);
    forecast.notes.extend(noticed.as_ref().map(growth_note));
    Ok(forecast)
}

/// As [`run_on`], in one process, for a case that fits into the memory of the machine.
///
/// # Errors
/// As there.
pub fn run(
    file: &CaseFile,
    folder: &Path,
    begin: Begin,
    observer: &dyn Observer,
) -> Result<FlowOutcome, Error> {
    let alone = Arc::new(Single) as Arc<dyn Ranks>;
    run_on(&alone, file, folder, begin, false, observer)
}

/// Runs a case on ranks, all of which call this, and writes its files to `folder`, in which no other run may be writing; one whose
/// forecast exceeds the memory of the machine only with `allow_large`. The
/// files have the same bytes for any number of ranks; of fields and checkpoints each writes what it has, rank 0 the rest, and it
/// alone reports to the observer.
///
/// # Errors
/// A case that the solver refuses or that needs more memory than there is, a checkpoint that does not fit, a flow that blows
/// up, files that cannot be written, a rank that is lost. The last good checkpoint stays.
pub fn run_on(
    ranks: &Arc<dyn Ranks>,
    file: &CaseFile,
    folder: &Path,
    begin: Begin,
    allow_large: bool,
    observer: &dyn Observer,
) -> Result<FlowOutcome, Error> {
    let is_first = ranks.rank() == 0;
    let prepared = if is_first {
        refuse_folder(folder, begin)
    } else {
        Ok(())
    };
    let prepared = prepared.and_then(|()| prepare(file, folder, begin, allow_large, ranks));
    let (mut setup, plan, files, forecast) = agree(ranks, prepared)?;
    let mut warnings = forecast.notes.clone();
    let opened = is_first.then(|| {
        files.refuse_existing(begin)?;
        observer.forecast(&forecast.to_string());
        open(folder, begin, &mut warnings)
    });
    let opened = agree(ranks, opened.transpose())?;
    let number = opened.as_ref().map_or(0, |(_, number)| *number);
    let checkpoint = agreed_checkpoint(ranks, folder, number)?;
    let tau_per_s = setup.tau_per_s;
    let wake = setup.wake.take();
    let (mut run, kept) = match &checkpoint {
        None => (start(setup, plan, &mut warnings)?, Vec::new()),
        Some(path) => resume(path, setup, plan, &file.content)?,
    };
    let reached_s = run.flow().time_s();
    let end_s = run.plan().end_s;
    refuse_passed_end(file, end_s, reached_s, tau_per_s)?;
    if is_first {
        for text in &warnings {
            observer.warn(text);
        }
        observer.begin(Stage::FlowSimulation, DIVISIONS as u64);
    }
    let mut writer = Writer {
        ranks: ranks.clone(),
        files,
        steps: None,
        wake,
        written: Vec::new(),
        warnings,
        observer,
        done: 0,
        start_s: reached_s,
        end_s,
        error: None,
    };
    let begun = writer.begin(file, checkpoint, &kept);
    agree(ranks, begun)?;
    let is_complete = run_to_end(&mut run, &mut writer)?;
    if is_first && is_complete {
        observer.end();
    }
    Ok(outcome(&run, is_complete, writer.written, writer.warnings))
}

/// The checkpoint from which a run continues: rank 0 says which, by its number from 1, or 0 for none.
fn agreed_checkpoint(
    ranks: &Arc<dyn Ranks>,
    folder: &Path,
    number: usize,
) -> Result<Option<PathBuf>, Error> {
    let numbers = all_gather(&**ranks, vec![number as f64]).map_err(Error::Flow)?;
    let place = (numbers[0] as usize).checked_sub(1);
    Ok(place.and_then(|place| checkpoint_paths(folder).into_iter().nth(place)))
}

/// Refuses an end before the time that a checkpoint has reached.
fn refuse_passed_end(
    file: &CaseFile,
    end_s: f64,
    reached_s: f64,
    tau_per_s: f64,
) -> Result<(), Error> {
    if reached_s <= (1.0 + 1e-9) * end_s {
        return Ok(());
    }
    let reached_tau = age_tau(reached_s, tau_per_s);
    Err(Error::input(
        file.path(),
        format!(
            "the end, {end_s:?} s, lies before {reached_s:?} s (tau = {reached_tau:?}), which the checkpoint has reached"
        ),
    ))
}

/// Runs a flow to its end or its pause, and completes the tables; returns whether the end is reached.
fn run_to_end(run: &mut Run, writer: &mut Writer<'_>) -> Result<bool, Error> {
    let result = run.to_end(writer);
    // Also of a run that failed: its last row shows why.
    let finished = writer.finish();
    let error = writer.error.take();
    let is_complete = result.map_err(|e| error.unwrap_or(Error::Flow(e)))?;
    agree(&writer.ranks, finished)?;
    Ok(is_complete)
}

fn outcome(
    run: &Run,
    is_complete: bool,
    files: Vec<PathBuf>,
    warnings: Vec<String>,
) -> FlowOutcome {
    let flow = run.flow();
    FlowOutcome {
        steps: flow.steps(),
        time_s: flow.time_s(),
        is_complete,
        steps_wall_s: run.steps_wall_s(),
        exchange_wall_s: run.exchange_wall_s(),
        kinetic_energy_m5_s2: flow.kinetic_energy_m5_s2(),
        relative_divergence: flow.relative_divergence(),
        files,
        warnings,
    }
}

/// A run from the initial field of its case, and a warning where the projection takes much from that.
fn start(setup: Setup, plan: RunPlan, warnings: &mut Vec<String>) -> Result<Run, Error> {
    let (flow, given_m5_s2) = setup.start()?;
    let removed = 1.0 - flow.kinetic_energy_m5_s2() / given_m5_s2;
    if removed > 0.01 {
        warnings.push(format!(
            "the projection of the initial field onto fields without divergence removed {:.3} % of its energy",
            100.0 * removed
        ));
    }
    Run::new(flow, plan).map_err(Error::Flow)
}

/// Takes the folder, and finds from which checkpoint the run goes on: the newer one, 1, or the one before it where that is gone or
/// damaged, 2; 0 for none.
fn open(
    folder: &Path,
    begin: Begin,
    warnings: &mut Vec<String>,
) -> Result<(FolderLock, usize), Error> {
    std::fs::create_dir_all(folder).map_err(Error::io("make the folder", folder))?;
    let lock = FolderLock::take(folder)?;
    let [checkpoint, previous] = checkpoint_paths(folder);
    let number = match begin {
        Begin::New | Begin::Overwrite => 0,
        // Killed before there was anything to continue from.
        Begin::Restart if !checkpoint.exists() && !previous.exists() => {
            warnings.push(format!(
                "there is no checkpoint in {}: the run begins anew",
                folder.display()
            ));
            0
        }
        Begin::Restart => match check_checkpoint(&checkpoint) {
            Err(error) if check_checkpoint(&previous).is_ok() => {
                warnings.push(format!(
                    "{error}: the one before it is used, {}",
                    previous.display()
                ));
                2
            }
            _ => 1,
        },
    };
    Ok((lock, number))
}

/// Refuses a folder that holds a run that is not to be overwritten, that cannot be written to, or that is in use.
fn refuse_folder(folder: &Path, begin: Begin) -> Result<(), Error> {
    if begin == Begin::New
        && let Some(path) = checkpoint_paths(folder)
            .into_iter()
            .find(|path| path.exists())
    {
        return Err(Error::CheckpointInTheWay { path });
    }
    crate::outputs::prepare(folder, &[], Existing::Refuse, true)
}

/// The setup and the plan of a case, with all that can be refused before the computing.
pub(super) fn prepare(
    file: &CaseFile,
    folder: &Path,
    begin: Begin,
    allow_large: bool,
    ranks: &Arc<dyn Ranks>,
) -> Result<Prepared, Error> {
    // Of several ranks each is taken to have a machine of its own.
    let machines = ranks.count() as f64;
    let available = machine::available_memory_bytes()
        .filter(|_| !allow_large)
        .map(|bytes| bytes * machines);
    // Before the setup, which holds the initial field.
    refuse_too_large(&file.content, file.content.case.cells(), &[], available)?;
    let setup = Setup::new(&file.content, file.folder());
    let mut setup = setup.map_err(|error| match error {
        Error::Flow(error) => refused_case(file, &error),
        error => error,
    })?;
    setup.settings.ranks = ranks.clone();
    let dense = setup.settings.pressure.dense_directions(&setup.mesh);
    refuse_too_large(&file.content, setup.mesh.cells(), &dense, available)?;
    setup
        .settings
        .validate(&setup.mesh)
        .map_err(|error| match error {
            wakescope_les::Error::TooManyRanks { .. } => Error::Flow(error),
            error => refused_case(file, &error),
        })?;
    if begin != Begin::Restart {
        refuse_unstable(file, &setup)?;
    }
    let (plan, files) = plan(file, &setup, folder)?;
    plan.check(if begin == Begin::Restart {
        f64::NEG_INFINITY
    } else {
        0.0
    })
    .map_err(Error::Flow)?;
    let forecast = FlowForecast::new(file, &setup, &plan, &files);
    Ok((setup, plan, files, forecast))
}

/// What the solver refuses of a case, as an error of its file.
fn refused_case(file: &CaseFile, error: &wakescope_les::Error) -> Error {
    Error::input(file.path(), format!("[case]: {error}"))
}

/// Refuses a step that the run would refuse at its start.
fn refuse_unstable(file: &CaseFile, setup: &Setup) -> Result<(), Error> {
    let stability = setup.stability();
    let step_s = stability.first_step_s();
    let Some(limit) = stability.refused(step_s) else {
        return Ok(());
    };
    let (key, value, most) = match setup.settings.time_step {
        TimeStep::Fixed { .. } => ("time.step_s", step_s, limit / stability.courant_per_s()),
        TimeStep::Courant { courant, .. } => ("time.courant", courant, limit),
    };
    let allowed = format!(
        "at most {most:.4} with this scheme, mesh and viscosity: beyond a Courant number of {limit:.3} waves of the mesh grow"
    );
    Err(file.refuse(key, value, allowed))
}

/// The run of a checkpoint. Which scheme suits a flow depends on the step, which may be changed: where the case does not name
/// one, that of the checkpoint goes on.
fn resume(
    path: &Path,
    setup: Setup,
    plan: RunPlan,
    case: &FlowCase,
) -> Result<(Run, Vec<u8>), Error> {
    let mesh = setup.mesh.clone();
    let settings = setup.settings.clone();
    let resumed = match Run::resume(path, mesh, settings, plan.clone()) {
        Err(wakescope_les::Error::CheckpointMismatch { what, .. })
            if what == "the time scheme" && case.time.scheme.is_none() =>
        {
            let other = setup.with_other_scheme(case);
            Run::resume(path, other.mesh, other.settings, plan)
        }
        resumed => resumed,
    };
    resumed.map_err(Error::Flow)
}

/// The plan of the run and of its files, with all that can be refused before the computing.
fn plan(file: &CaseFile, setup: &Setup, folder: &Path) -> Result<(RunPlan, Files), Error> {
    let case = &file.content;
    let end_s = end_s(file, setup)?;
    let mut output = case.output.clone();
    let schedule = match (&case.wake, &setup.wake) {
        (Some(wake), Some(history)) => {
            let spacing_m = history.scales.spacing_m;
            output.planes_x_m = wake.planes_x.iter().map(|x| x * spacing_m).collect();
            wake_schedule(wake, setup.tau_per_s, end_s)
        }
        _ => plain_schedule(
            case.output_times_s(end_s)
                .map_err(|problem| file.located(vec![problem]))?,
        ),
    };
    let output_times_s: Vec<f64> = schedule.iter().map(|due| due.time_s).collect();
    if let Some(late) = output_times_s.iter().find(|t| **t > end_s) {
        return Err(file.refuse(
            "output.times_s",
            late,
            format!("at most the end, {end_s:?} s"),
        ));
    }
    let along = &setup.mesh.directions()[0];
    for x_m in &case.output.planes_x_m {
        if along.ends != Ends::Periodic && !(along.low_m..=along.high_m).contains(x_m) {
            let allowed = format!("within the mesh, {:?} to {:?} m", along.low_m, along.high_m);
            return Err(file.refuse("output.planes_x_m", x_m, allowed));
        }
    }
    let every = match (case.checkpoint.every_steps, case.checkpoint.every_s) {
        (Some(steps), _) => Interval::Steps(steps),
        (None, Some(time_s)) => Interval::Time { time_s },
        (None, None) => Interval::Steps(STEPS_PER_CHECKPOINT),
    };
    let [path, _] = checkpoint_paths(folder);
    let run = RunPlan {
        end_s,
        output_times_s,
        checkpoint: case
            .checkpoint
            .write
            .then_some(CheckpointPlan { path, every }),
        pause_after_steps: case.time.pause_after_steps,
    };
    let files = Files {
        folder: folder.to_owned(),
        output,
        origin: file.provenance(),
        schedule,
        is_wake: setup.wake.is_some(),
        tau_per_s: setup.tau_per_s,
        title: format!("Simulated flow, case {}", file.hash),
    };
    Ok((run, files))
}

/// End of the run, s: that of the case, of its wake, or of its flow.
fn end_s(file: &CaseFile, setup: &Setup) -> Result<f64, Error> {
    let case = &file.content;
    let wake = case.wake.as_ref();
    let wake_end_s = wake.map(|wake| wake.end_tau / setup.tau_per_s);
    let end_s = case.time.end_s.or(wake_end_s).or(setup.end_s);
    end_s.ok_or_else(|| {
        let problem = Problem::new(
            "time.end_s",
            Problem::ABSENT,
            "a number in s, e.g. 30.0, is required for a flow with kind = \"free\"",
        );
        file.located(vec![problem])
    })
}

#[cfg(test)]
#[path = "execute_tests.rs"]
mod tests;
