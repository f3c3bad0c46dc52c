//! Simulations of the air: a case file goes in; a table of the steps, fields, planes and checkpoints come out.
//!
//! A [`CaseFile`] names a flow with a known answer and its parameters, or gives a mesh, a viscosity and an initial field of
//! one's own. [`run`] runs it with the solver of `wakescope-les`, which does the computing; this module reads the case,
//! writes the files and continues runs from their checkpoints.
//!
//! Check: every example file is read and run; interrupted runs leave the same files as others; wrong cases are refused with
//! key, value and what is allowed.

mod case;
mod examples;
mod files;
mod free;
#[cfg(feature = "netcdf")]
mod initial_file;
mod named;
#[cfg(feature = "netcdf")]
mod read;
mod setup;
mod steps;
mod text;
mod wake;
mod writer;

pub use case::{
    AxisName, CaseKind, Checkpoint, FORMAT, FileFormat, FlowCase, Output, Pressure, Scheme, Solver, Subgrid, Time,
};
pub use examples::{EXAMPLES, example};
pub use free::{Axis, EndName, Free, InitialName, InitialPair, MappingName};
pub use named::{
    Channel, Dipole, LidDrivenCavity, OrrSommerfeld, PlateDriven, TaylorGreen, TaylorGreenPlane, VortexPairFlow,
};

#[cfg(feature = "netcdf")]
pub use read::{FieldInSpace, read_field, read_planes};
pub use wake::{PairScale, WakeFlow, WakeOutput, WakePreset, WakeProfile};

use crate::Error;
use crate::export::{Existing, Provenance, write_atomic};
use crate::scene::{Problem, SceneError, hash_of, located, parsed};
use crate::text_file;
use files::{Files, checkpoint_paths};
use setup::{Setup, WakeSetup};
use std::path::{Path, PathBuf};
use steps::StepTable;
use wake::{Schedule, WakeRun};
use wakescope_les::{CheckpointPlan, Ends, Interval, Run, RunPlan, StepRecord};
use writer::{Kept, Writer};

/// Steps between checkpoints where a case states nothing.
const STEPS_PER_CHECKPOINT: u64 = 500;

/// A valid case, with what names it.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseFile {
    /// The case.
    pub case: FlowCase,
    /// The case as TOML, every default written out.
    pub toml: String,
    /// First 16 hexadecimal digits of the SHA-256 of `toml`.
    pub hash: String,
    path: PathBuf,
    text: String,
}

impl CaseFile {
    /// Reads and checks a case file.
    ///
    /// # Errors
    /// What the system says; [`SceneError`] names the file, the line, the key, the value and what is allowed.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = case_text(path)?;
        Ok(Self::parse(&text, path)?)
    }

    /// Checks the text of a case file; `path` serves the messages, and its folder is where files of the case are looked for.
    ///
    /// # Errors
    /// As [`CaseFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        Ok(Self::of(text::read(text, path, None)?, text, path))
    }

    /// A preset.
    ///
    /// # Errors
    /// None of a preset as it is.
    pub fn preset(preset: WakePreset) -> Result<Self, SceneError> {
        let toml = toml::to_string(&preset.case()).unwrap_or_else(|e| unreachable!("a case is plain data: {e}"));
        Self::parse(&toml, Path::new("preset"))
    }

    /// Reads a case file of a wake over a preset.
    ///
    /// # Errors
    /// As [`CaseFile::read`].
    pub fn read_over(preset: WakePreset, path: &Path) -> Result<Self, Error> {
        Ok(Self::parse_over(preset, &case_text(path)?, path)?)
    }

    /// The text of a case file of a wake over a preset: keys that it does not have are those of the preset.
    ///
    /// # Errors
    /// As [`CaseFile::parse`].
    pub fn parse_over(preset: WakePreset, text: &str, path: &Path) -> Result<Self, SceneError> {
        Ok(Self::of(text::read(text, path, Some(&preset.case()))?, text, path))
    }

    fn of(case: FlowCase, text: &str, path: &Path) -> Self {
        let toml = toml::to_string(&case).unwrap_or_else(|e| unreachable!("a case is plain data: {e}"));
        let hash = hash_of(&toml);
        Self { case, toml, hash, path: path.to_owned(), text: text.to_owned() }
    }

    fn refuse(&self, key: &str, value: impl std::fmt::Debug, allowed: String) -> Error {
        Error::Scene(self.located(Problem { key: key.into(), value: format!("{value:?}"), allowed }))
    }

    /// A problem with the line of its key.
    fn located(&self, problem: Problem) -> SceneError {
        match parsed(&self.text, &self.path) {
            Ok(document) => located(&document, &self.path, vec![problem]),
            Err(error) => error,
        }
    }

    fn provenance(&self) -> Provenance {
        Provenance {
            program: crate::PROGRAM.into(),
            scene_toml: self.toml.clone(),
            scene_hash: self.hash.clone(),
            seed: 0,
        }
    }
}

/// The text of a case file.
fn case_text(path: &Path) -> Result<String, Error> {
    text_file::read(path).map_err(|source| Error::Io { action: "read the case", path: path.to_owned(), source })
}

/// Whether a run begins or continues.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Begin {
    /// From the initial field; an earlier checkpoint in the folder is not overwritten.
    #[default]
    New,
    /// From the initial field, over whatever is there.
    Overwrite,
    /// From the checkpoint in the folder.
    Restart,
}

/// Told of the progress of a run.
pub trait Watch {
    /// After every step, with the share of the run that is done.
    fn step(&mut self, share: f64, record: &StepRecord) {
        let _ = (share, record);
    }

    /// Something that deserves attention.
    fn note(&mut self, text: &str) {
        let _ = text;
    }
}

/// A watch that looks away.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwatched;

impl Watch for Unwatched {}

/// What a run did.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowOutcome {
    /// Steps of the flow, those before a restart included.
    pub steps: u64,
    /// Time reached \[s\].
    pub time_s: f64,
    /// Whether that is the end, not a pause.
    pub is_complete: bool,
    /// Kinetic energy, integral of `u^2/2` \[m^5/s^2\].
    pub kinetic_energy_m5_s2: f64,
    /// Largest divergence over the largest `sum |u_i|/h_i`.
    pub relative_divergence: f64,
    /// Files written, in the order of writing.
    pub files: Vec<PathBuf>,
    /// What deserves attention.
    pub warnings: Vec<String>,
}

/// Runs a case and writes its files to `folder`.
///
/// # Errors
/// A case that the solver refuses, a checkpoint that does not fit, a flow that blows up, files that cannot be written. The
/// last good checkpoint stays.
pub fn run(file: &CaseFile, folder: &Path, begin: Begin, watch: &mut dyn Watch) -> Result<FlowOutcome, Error> {
    let [checkpoint, previous] = checkpoint_paths(folder);
    if begin == Begin::New && checkpoint.exists() {
        return Err(Error::CheckpointInTheWay { path: checkpoint });
    }
    let mut setup = Setup::new(&file.case, file.path.parent().unwrap_or(Path::new("")))?;
    let (plan, files, schedule) = plan(file, &setup, folder)?;
    files.refuse_foreign(&schedule.due, setup.wake.is_some(), begin)?;
    crate::write::prepare(folder, [], Existing::Own)?;
    std::fs::create_dir_all(folder).map_err(|source| Error::Io {
        action: "make the folder",
        path: folder.to_owned(),
        source,
    })?;
    let mut warnings = file.case.case.unresolved(&setup.mesh);
    let meter = setup.wake.take().map(|wake| wake.meter);
    let (mut run, kept) = if begin == Begin::Restart {
        let path = readable(&checkpoint, &previous, &mut warnings);
        Run::resume(path, setup.mesh, setup.settings, plan).map_err(Error::Flow)?
    } else {
        let (flow, start) = setup.start()?;
        let removed = 1.0 - start.kinetic_energy_m5_s2 / start.given_energy_m5_s2;
        if removed > 0.01 {
            warnings.push(format!(
                "the projection of the initial field onto fields without divergence removed {:.3} % of its energy",
                100.0 * removed
            ));
        }
        (Run::new(flow, plan).map_err(Error::Flow)?, Vec::new())
    };
    warnings.iter().for_each(|text| watch.note(text));
    let mut wake = meter.map(|meter| WakeRun::new(meter, run.flow(), folder.to_owned(), file.provenance()));
    let kept = Kept::read(&kept, wake.is_some());
    if let (Some(wake), true) = (&mut wake, begin == Begin::Restart) {
        let what = "its history of the wake is not that of this case";
        wake.restore(&kept.wake)
            .ok_or_else(|| Error::Flow(wakescope_les::Error::CheckpointDamaged { path: checkpoint.clone(), what }))?;
    }
    let case_toml = folder.join(files::CASE);
    write_atomic(&case_toml, format!("# {}, case {}\n{}", crate::PROGRAM, file.hash, file.toml))?;
    let steps_path = files.steps_path();
    let steps = match (files.output.steps, begin) {
        (false, _) => None,
        (true, Begin::Restart) => Some(StepTable::resume(&steps_path, &files.origin, &kept.steps)?),
        (true, _) => Some(StepTable::begin(&steps_path, &files.origin)?),
    };
    let mut written = vec![case_toml];
    written.extend(steps.is_some().then_some(steps_path));
    written.extend(wake.iter().flat_map(WakeRun::paths));
    let (start_s, end_s) = (run.flow().time_s(), run.plan().end_s);
    let mut writer = Writer { files, schedule, steps, wake, written, warnings, watch, start_s, end_s, error: None };
    let result = run.to_end(&mut writer);
    // Also of a run that failed: its last row is what one wants to see.
    let finished = writer.finish();
    let Writer { written, warnings, error, .. } = writer;
    let summary = result.map_err(|e| error.unwrap_or(Error::Flow(e)))?;
    finished?;
    let flow = run.flow();
    Ok(FlowOutcome {
        steps: summary.steps,
        time_s: summary.time_s,
        is_complete: summary.is_complete,
        kinetic_energy_m5_s2: flow.kinetic_energy_m5_s2(),
        relative_divergence: flow.relative_divergence(),
        files: written,
        warnings,
    })
}

/// The newer checkpoint, or the one before it where that is gone or damaged.
fn readable<'a>(checkpoint: &'a Path, previous: &'a Path, warnings: &mut Vec<String>) -> &'a Path {
    match wakescope_les::check_checkpoint(checkpoint) {
        Err(error) if wakescope_les::check_checkpoint(previous).is_ok() => {
            warnings.push(format!("{error}: the one before it is used, {}", previous.display()));
            previous
        }
        _ => checkpoint,
    }
}

/// The plan of the run and of its files, with all that can be refused before the computing.
fn plan(file: &CaseFile, setup: &Setup, folder: &Path) -> Result<(RunPlan, Files, Schedule), Error> {
    let case = &file.case;
    let wake_end_s = case.wake.as_ref().map(|wake| wake.end_tau / setup.tau_per_s);
    let Some(end_s) = case.time.end_s.or(wake_end_s).or(setup.end_s) else {
        let allowed = "a number in s, e.g. 30.0, is needed for a flow of one's own".into();
        let problem = Problem { key: "time.end_s".into(), value: Problem::ABSENT.into(), allowed };
        return Err(Error::Scene(file.located(problem)));
    };
    let mut output = case.output.clone();
    let schedule = match (&case.wake, &setup.wake) {
        (Some(wake), Some(WakeSetup { scales, .. })) => {
            output.planes_x_m = wake.planes_x.iter().map(|x| x * scales.spacing_m).collect();
            Schedule::of_wake(wake, setup.tau_per_s, end_s)
        }
        _ => Schedule::plain(case.output_times_s(end_s).map_err(|problem| Error::Scene(file.located(problem)))?),
    };
    if let Some(late) = schedule.times_s.iter().find(|t| **t > end_s) {
        return Err(file.refuse("output.times_s", late, format!("at most the end, {end_s:?} s")));
    }
    let along = &setup.mesh.directions()[0];
    let inside = |x: &f64| along.ends == Ends::Periodic || (along.low_m..=along.high_m).contains(x);
    if let Some(bad) = case.output.planes_x_m.iter().find(|x| !inside(x)) {
        let allowed = format!("within the mesh, {:?} to {:?} m", along.low_m, along.high_m);
        return Err(file.refuse("output.planes_x_m", bad, allowed));
    }
    let every = match (case.checkpoint.every_steps, case.checkpoint.every_s) {
        (Some(steps), _) => Interval::Steps(steps),
        (None, Some(time_s)) => Interval::Time { time_s },
        (None, None) => Interval::Steps(STEPS_PER_CHECKPOINT),
    };
    let [path, _] = checkpoint_paths(folder);
    let run = RunPlan {
        end_s,
        output_times_s: schedule.times_s.clone(),
        checkpoint: case.checkpoint.write.then_some(CheckpointPlan { path, every }),
        pause_after_steps: case.time.pause_after_steps,
    };
    let files = Files {
        folder: folder.to_owned(),
        output,
        origin: file.provenance(),
        #[cfg(feature = "vtk")]
        times_s: [schedule.times_of(|due| due.fields), schedule.times_of(|due| due.planes)],
        with_vorticity: setup.wake.is_some(),
        tau_per_s: setup.tau_per_s,
        title: format!("Simulated flow, case {}", file.hash),
    };
    Ok((run, files, schedule))
}

#[cfg(test)]
mod tests;
