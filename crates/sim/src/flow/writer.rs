//! Writes what a run gives, as it goes, and keeps in its checkpoints what the files need to be continued.
//!
//! Check: the tests of `flow` interrupt runs and compare the bytes.

use super::CaseFile;
use super::files::{CASE, Files, STEPS, agree};
use super::steps::StepTable;
use super::wake::{HISTORIES, WakeRun};
use crate::Error;
use crate::io::write_atomic;
use crate::setup::progress::Observer;
use std::path::PathBuf;
use std::sync::Arc;
use wakescope_les::Flow;
use wakescope_les::ranks::Ranks;
use wakescope_les::solver::{RunObserver, RunWarning, StepRecord, UndampedGrowth};

/// What a checkpoint keeps for the files: the row of the table of the steps that waits, and the history of a wake, whose bytes begin
/// with the length of the row.
fn parted(bytes: &[u8], is_wake: bool) -> (&[u8], &[u8]) {
    if !is_wake {
        return (bytes, &[]);
    }
    let Some((length, rest)) = bytes.split_first_chunk::<8>() else { return Default::default() };
    let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
    rest.split_at_checked(length).unwrap_or_default()
}

/// Parts of the simulated time of which an observer is told.
pub(super) const DIVISIONS: f64 = 10_000.0;

/// Writes what the run gives, on each rank what that has; tables, and what is told, on rank 0.
pub(super) struct Writer<'a> {
    pub(super) ranks: Arc<dyn Ranks>,
    pub(super) files: Files,
    pub(super) steps: Option<StepTable>,
    pub(super) wake: Option<WakeRun>,
    pub(super) written: Vec<PathBuf>,
    pub(super) warnings: Vec<String>,
    pub(super) observer: &'a dyn Observer,
    /// Of the divisions of the run, those that the observer knows of.
    pub(super) done: u64,
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    /// What stopped the run, in full.
    pub(super) error: Option<Error>,
}

impl Writer<'_> {
    fn keep<T>(&mut self, result: Result<T, Error>) -> Result<T, String> {
        result.map_err(|error| {
            let reason = error.to_string();
            self.error = Some(error);
            reason
        })
    }

    /// Begins the files of a run, or continues them from what a checkpoint kept; ranks other than the first have none.
    pub(super) fn begin(&mut self, file: &CaseFile, checkpoint: Option<PathBuf>, kept: &[u8]) -> Result<(), Error> {
        let (row, history) = parted(kept, self.wake.is_some());
        if let (Some(wake), Some(path)) = (&mut self.wake, checkpoint) {
            let what = "its history of the wake is not that of this case";
            wake.restore(history).ok_or(Error::Flow(wakescope_les::Error::CheckpointDamaged { path, what }))?;
        }
        if self.ranks.rank() > 0 {
            return Ok(());
        }
        let folder = &self.files.folder;
        self.written.push(folder.join(CASE));
        write_atomic(&folder.join(CASE), format!("# {}, case {}\n{}", crate::PROGRAM, file.hash, file.toml))?;
        if self.files.output.steps {
            let path = folder.join(STEPS);
            self.steps = Some(StepTable::open(&path, &self.files.origin, row)?);
            self.written.push(path);
        }
        self.written.extend(self.wake.iter().flat_map(|_| HISTORIES.map(|name| folder.join(name))));
        Ok(())
    }

    /// Completes the tables.
    pub(super) fn finish(&mut self) -> Result<(), Error> {
        let steps = self.steps.as_mut().map_or(Ok(()), |steps| steps.write_waiting(None));
        match &self.wake {
            Some(wake) if self.ranks.rank() == 0 => steps.and(wake.finish(&self.files.folder, &self.files.origin)),
            _ => steps,
        }
    }
}

/// What is said of waves that Adams-Bashforth lets grow.
pub(super) fn growth_note(growth: &UndampedGrowth) -> String {
    format!("with Adams-Bashforth {growth}: take time.scheme = \"runge_kutta3\"")
}

impl RunObserver for Writer<'_> {
    fn step(&mut self, _: &Flow, record: &StepRecord) -> Result<(), String> {
        if self.ranks.rank() > 0 {
            return Ok(());
        }
        let r = &record.report;
        let done = (DIVISIONS * (r.time_s - self.start_s) / (self.end_s - self.start_s)) as u64;
        self.observer.advance(done.saturating_sub(self.done));
        self.done = done.max(self.done);
        // Four decimals, or the exponent form of what these would not show.
        let is_plain = (1e-2..1e9).contains(&r.time_s);
        let time = if is_plain { format!("{:.4}", r.time_s) } else { format!("{:.3e}", r.time_s) };
        self.observer.reach(&format!("step {}, t = {time} s, Courant {:.2}", r.step, r.courant));
        let pushed = self.steps.as_mut().map_or(Ok(()), |steps| steps.push(record));
        self.keep(pushed)
    }

    fn output(&mut self, flow: &Flow, index: usize) -> Result<(), String> {
        let due = self.files.schedule.due.get(index).copied().unwrap_or_default();
        if due.record
            && let Some(wake) = &mut self.wake
        {
            let mut recorded = wake.record(flow);
            if self.ranks.rank() == 0 {
                recorded = recorded.and_then(|()| wake.write_tables(&self.files.folder, &self.files.origin));
            }
            let recorded = agree(&self.ranks, recorded);
            self.keep(recorded)?;
        }
        let written = self.files.write(flow, due, &self.ranks);
        let mut written = self.keep(written)?;
        // A collection is written anew with each output.
        written.retain(|path| !self.written.contains(path));
        self.written.append(&mut written);
        Ok(())
    }

    fn warning(&mut self, warning: &RunWarning) {
        let text = match warning {
            RunWarning::StepEnergy { step, energy } => format!("step {step}: {energy}"),
            RunWarning::UndampedGrowth { growth, .. } => growth_note(growth),
        };
        self.observer.warn(&text);
        self.warnings.push(text);
    }

    fn user_data(&self) -> Vec<u8> {
        let steps = self.steps.as_ref().map_or_else(Vec::new, StepTable::kept);
        match &self.wake {
            None => steps,
            Some(wake) => [&(steps.len() as u64).to_le_bytes()[..], &steps, &wake.kept()].concat(),
        }
    }
}
