//! Writes what a run gives, as it goes, and keeps in its checkpoints what the files need to be continued.
//!
//! The energy budget of a step closes with the next one, so each row of the table of the steps waits for it; a checkpoint keeps the
//! waiting row. A run that is resumed thus leaves the same table, byte for byte, as one that was not interrupted.
//!
//! Check: the tests of `flow` interrupt runs and compare the bytes.

use super::CaseFile;
use super::files::{CASE, Files, STEPS, agree};
use super::wake::{HISTORIES, WakeHistory};
use crate::Error;
use crate::io::csv::float_text;
use crate::io::{Provenance, write_atomic};
use crate::progress::Observer;
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use wakescope_les::Flow;
use wakescope_les::ranks::Ranks;
use wakescope_les::solver::{EnergyBudget, RunObserver, RunWarning, StepRecord, UndampedGrowth};

/// What a checkpoint keeps for the files: the row of the table of the steps that waits, and the history of a wake, whose bytes begin
/// with the length of the row.
fn parted(bytes: &[u8], is_wake: bool) -> (&[u8], &[u8]) {
    if !is_wake {
        return (bytes, &[]);
    }
    let Some((length, rest)) = bytes.split_first_chunk::<8>() else {
        return Default::default();
    };
    let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
    rest.split_at_checked(length).unwrap_or_default()
}

/// Parts of the simulated time that an observer is notified of.
pub(super) const DIVISIONS: f64 = 10_000.0;

/// Writes the results of a run, on each rank those that it has; tables and reports on rank 0.
pub(super) struct Writer<'a> {
    pub(super) ranks: Arc<dyn Ranks>,
    pub(super) files: Files,
    pub(super) steps: Option<StepTable>,
    pub(super) wake: Option<WakeHistory>,
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
    pub(super) fn begin(
        &mut self,
        file: &CaseFile,
        checkpoint: Option<PathBuf>,
        kept: &[u8],
    ) -> Result<(), Error> {
        let (row, history) = parted(kept, self.wake.is_some());
        if let (Some(wake), Some(path)) = (&mut self.wake, checkpoint) {
            let what = "its history of the wake is not that of this case";
            wake.restore(history)
                .ok_or(Error::Flow(wakescope_les::Error::CheckpointDamaged {
                    path,
                    what,
                }))?;
        }
        if self.ranks.rank() > 0 {
            return Ok(());
        }
        let folder = &self.files.folder;
        self.written.push(folder.join(CASE));
        write_atomic(
            &folder.join(CASE),
            format!("# {}, case {}\n{}", crate::PROGRAM, file.hash, file.toml),
        )?;
        if self.files.output.steps {
            let path = folder.join(STEPS);
            self.steps = Some(StepTable::open(&path, &self.files.origin, row)?);
            self.written.push(path);
        }
        self.written.extend(
            self.wake
                .iter()
                .flat_map(|_| HISTORIES.map(|name| folder.join(name))),
        );
        Ok(())
    }

    /// Completes the tables.
    pub(super) fn finish(&mut self) -> Result<(), Error> {
        let steps = self
            .steps
            .as_mut()
            .map_or(Ok(()), |steps| steps.write_waiting(None));
        match &self.wake {
            Some(wake) if self.ranks.rank() == 0 => {
                steps.and(wake.finish(&self.files.folder, &self.files.origin))
            }
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
        let time = if is_plain {
            format!("{:.4}", r.time_s)
        } else {
            format!("{:.3e}", r.time_s)
        };
        self.observer.reach(&format!(
            "step {}, t = {time} s, Courant {:.2}",
            r.step, r.courant
        ));
        let pushed = self
            .steps
            .as_mut()
            .map_or(Ok(()), |steps| steps.push(record));
        self.keep(pushed)
    }

    fn output(&mut self, flow: &Flow, index: usize) -> Result<(), String> {
        let due = self.files.schedule.get(index).copied().unwrap_or_default();
        if due.record
            && let Some(wake) = &mut self.wake
        {
            let mut recorded = wake.record(flow);
            if self.ranks.rank() == 0 {
                recorded = recorded
                    .and_then(|()| wake.write_table(&self.files.folder, &self.files.origin));
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
            Some(wake) => [
                &(steps.len() as u64).to_le_bytes()[..],
                &steps,
                &wake.kept(),
            ]
            .concat(),
        }
    }
}

const HEADER: &str = "step,time_s,step_s,courant,kinetic_energy_m5_s2,viscous_power_m5_s3,subgrid_power_m5_s3,\
                      force_power_m5_s3,relative_divergence,subgrid_viscosity_m2_s,subgrid_decay,pressure_iterations,\
                      pressure_residual,pressure_factor,energy_rate_m5_s3,energy_residual_m5_s3";

/// Number of the step of a row; none of a header or comment.
fn step_of_row(row: &str) -> Option<u64> {
    row.split(',').next()?.parse().ok()
}

/// The table and the row that waits.
#[derive(Debug)]
pub(super) struct StepTable {
    path: PathBuf,
    file: File,
    waiting: Option<String>,
}

impl StepTable {
    /// The table of a run that continues with the row that its checkpoint kept, later rows taken off; an empty one where nothing was
    /// kept.
    fn open(path: &Path, origin: &Provenance, kept: &[u8]) -> Result<Self, Error> {
        let waiting = (!kept.is_empty()).then(|| String::from_utf8_lossy(kept).into_owned());
        let next = waiting.as_deref().and_then(step_of_row).unwrap_or(0);
        // A table that was removed begins again with the rows to come.
        let old = std::fs::read_to_string(path).unwrap_or_default();
        let mut rows = String::new();
        for line in old.lines() {
            if step_of_row(line).is_some_and(|step| step < next) {
                rows += line;
                rows.push('\n');
            }
        }
        write_atomic(path, format!("{}{HEADER}\n{rows}", origin.comment_lines()))?;
        let file = OpenOptions::new()
            .append(true)
            .open(path)
            .map_err(Error::io("write", path))?;
        Ok(Self {
            path: path.to_owned(),
            file,
            waiting,
        })
    }

    /// Takes the record of a step; the row before it is written.
    fn push(&mut self, record: &StepRecord) -> Result<(), Error> {
        self.write_waiting(record.budget_before)?;
        let r = &record.report;
        let missing = f64::NAN;
        let numbers = [
            r.time_s,
            r.step_s,
            r.courant,
            r.kinetic_energy_m5_s2,
            r.viscous_power_m5_s3,
            r.subgrid_power_m5_s3,
            r.force_power_m5_s3,
            record.relative_divergence,
            r.subgrid_viscosity_m2_s,
            r.subgrid_decay,
            r.pressure_iterations as f64,
            r.pressure_residual.unwrap_or(missing),
            r.pressure_factor.unwrap_or(missing),
        ];
        let cells: Vec<String> = numbers.into_iter().map(float_text).collect();
        self.waiting = Some(format!("{},{}", r.step, cells.join(",")));
        Ok(())
    }

    /// What a checkpoint must keep.
    fn kept(&self) -> Vec<u8> {
        self.waiting.clone().unwrap_or_default().into_bytes()
    }

    /// Writes the row that waits with its budget, which stays open of the last one.
    fn write_waiting(&mut self, budget: Option<EnergyBudget>) -> Result<(), Error> {
        let Some(row) = self.waiting.take() else {
            return Ok(());
        };
        let [rate, residual] = budget.map_or([f64::NAN; 2], |b| [b.rate_m5_s3, b.residual_m5_s3()]);
        let line = format!("{row},{},{}\n", float_text(rate), float_text(residual));
        self.file
            .write_all(line.as_bytes())
            .map_err(Error::io("write", &self.path))
    }
}
