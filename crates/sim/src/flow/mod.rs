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
mod setup;
mod steps;

pub use case::{
    AxisName, CaseKind, Checkpoint, FORMAT, FileFormat, FlowCase, Output, Pressure, Scheme, Solver, Subgrid, Time,
};
pub use examples::{EXAMPLES, example};
pub use free::{Axis, EndName, Free, InitialName, InitialPair, MappingName};
pub use named::{
    Channel, Dipole, LidDrivenCavity, OrrSommerfeld, PlateDriven, TaylorGreen, TaylorGreenPlane, VortexPairFlow,
};

use crate::Error;
use crate::export::{Provenance, write_atomic};
use crate::scene::{Problem, SceneError, hash_of, invalid, malformed};
use files::{Files, checkpoint_paths};
use setup::Setup;
use std::path::{Path, PathBuf};
use steps::StepTable;
use wakescope_les::{CheckpointPlan, Ends, Flow, Interval, Run, RunObserver, RunPlan, RunWarning, StepRecord};

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
        let text = std::fs::read_to_string(path).map_err(|source| Error::Io {
            action: "read the case",
            path: path.to_owned(),
            source,
        })?;
        Ok(Self::parse(&text, path)?)
    }

    /// Checks the text of a case file; `path` serves the messages, and its folder is where files of the case are looked for.
    ///
    /// # Errors
    /// As [`CaseFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        let case: FlowCase = toml::from_str(text).map_err(|e| malformed(text, path, &e))?;
        let problems = case.problems();
        if !problems.is_empty() {
            return Err(invalid(text, path, problems));
        }
        let toml = toml::to_string(&case).unwrap_or_else(|e| unreachable!("a case is plain data: {e}"));
        let hash = hash_of(&toml);
        Ok(Self { case, toml, hash, path: path.to_owned(), text: text.to_owned() })
    }

    fn refuse(&self, key: &str, value: impl std::fmt::Debug, allowed: String) -> Error {
        let problem = Problem { key: key.into(), value: format!("{value:?}"), allowed };
        Error::Scene(invalid(&self.text, &self.path, vec![problem]))
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
    let setup = Setup::new(&file.case, file.path.parent().unwrap_or(Path::new("")))?;
    let (plan, files) = plan(file, &setup, folder)?;
    crate::write::prepare(folder)?;
    std::fs::create_dir_all(folder).map_err(|source| Error::Io {
        action: "make the folder",
        path: folder.to_owned(),
        source,
    })?;
    let mut warnings = Vec::new();
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
    let case_toml = folder.join("case.toml");
    write_atomic(&case_toml, format!("# {}, case {}\n{}", crate::PROGRAM, file.hash, file.toml))?;
    let steps_path = files.steps_path();
    let steps = match (files.output.steps, begin) {
        (false, _) => None,
        (true, Begin::Restart) => Some(StepTable::resume(&steps_path, &files.origin, &kept)?),
        (true, _) => Some(StepTable::begin(&steps_path, &files.origin)?),
    };
    let mut written = vec![case_toml];
    written.extend(steps.is_some().then_some(steps_path));
    let (start_s, end_s) = (run.flow().time_s(), run.plan().end_s);
    let mut writer = Writer { files, steps, written, warnings, watch, start_s, end_s, error: None };
    let result = run.to_end(&mut writer);
    // Also of a run that failed: its last row is what one wants to see.
    let finished = writer.steps.as_mut().map_or(Ok(()), StepTable::finish);
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
fn plan(file: &CaseFile, setup: &Setup, folder: &Path) -> Result<(RunPlan, Files), Error> {
    let case = &file.case;
    let Some(end_s) = case.time.end_s.or(setup.end_s) else {
        return Err(file.refuse("time.end_s", "absent", "needed for a flow of one's own".into()));
    };
    let output_times_s =
        case.output_times_s(end_s).map_err(|problem| Error::Scene(invalid(&file.text, &file.path, vec![problem])))?;
    if let Some(late) = output_times_s.iter().find(|t| **t > end_s) {
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
        output_times_s: output_times_s.clone(),
        checkpoint: case.checkpoint.write.then_some(CheckpointPlan { path, every }),
        pause_after_steps: case.time.pause_after_steps,
    };
    let files = Files {
        folder: folder.to_owned(),
        output: case.output.clone(),
        origin: file.provenance(),
        #[cfg(feature = "vtk")]
        times_s: output_times_s,
        tau_per_s: setup.tau_per_s,
        title: format!("Simulated flow, case {}", file.hash),
    };
    Ok((run, files))
}

/// Writes what the run gives.
struct Writer<'a> {
    files: Files,
    steps: Option<StepTable>,
    written: Vec<PathBuf>,
    warnings: Vec<String>,
    watch: &'a mut dyn Watch,
    start_s: f64,
    end_s: f64,
    /// What stopped the run, in full.
    error: Option<Error>,
}

impl Writer<'_> {
    fn keep<T>(&mut self, result: Result<T, Error>) -> Result<T, String> {
        result.map_err(|error| {
            let reason = error.to_string();
            self.error = Some(error);
            reason
        })
    }
}

impl RunObserver for Writer<'_> {
    fn step(&mut self, _: &Flow, record: &StepRecord) -> Result<(), String> {
        let done = (record.report.time_s - self.start_s) / (self.end_s - self.start_s);
        self.watch.step(done, record);
        let pushed = self.steps.as_mut().map_or(Ok(()), |steps| steps.push(record));
        self.keep(pushed)
    }

    fn output(&mut self, flow: &Flow, index: usize) -> Result<(), String> {
        let written = self.files.write(flow, index);
        let mut written = self.keep(written)?;
        // A collection is written anew with each output.
        written.retain(|path| !self.written.contains(path));
        self.written.append(&mut written);
        Ok(())
    }

    fn warning(&mut self, warning: &RunWarning) {
        let text = match warning {
            RunWarning::Courant { step, courant, limit } => {
                format!("step {step} has Courant number {courant:.3}, near the limit {limit}: shorten the time step")
            }
            _ => format!("{warning:?}"),
        };
        self.watch.note(&text);
        self.warnings.push(text);
    }

    fn user_data(&self) -> Vec<u8> {
        self.steps.as_ref().map_or_else(Vec::new, StepTable::kept)
    }
}

#[cfg(test)]
mod tests;
