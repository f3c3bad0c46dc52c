//! The table with one row for each step, written as the run goes and cut back when it is resumed.
//!
//! The energy budget of a step closes with the next one, so each row waits for it; a checkpoint keeps the waiting row. A run
//! that is resumed thus leaves the same table, byte for byte, as one that was not interrupted.
//!
//! Check: the tests of `flow` interrupt runs and compare the bytes.

use crate::Error;
use crate::io::csv::float_text;
use crate::io::{Provenance, write_atomic};
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use wakescope_les::solver::{EnergyBudget, StepRecord};

const HEADER: &str = "step,time_s,step_s,courant,kinetic_energy_m5_s2,viscous_power_m5_s3,subgrid_power_m5_s3,\
                      force_power_m5_s3,relative_divergence,subgrid_viscosity_m2_s,subgrid_decay,pressure_iterations,\
                      pressure_residual,pressure_factor,energy_rate_m5_s3,energy_residual_m5_s3";

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
    pub(super) fn open(path: &Path, origin: &Provenance, kept: &[u8]) -> Result<Self, Error> {
        let waiting = (!kept.is_empty()).then(|| String::from_utf8_lossy(kept).into_owned());
        let step_of = |row: &str| row.split(',').next().and_then(|cell| cell.parse::<u64>().ok());
        let next = waiting.as_deref().and_then(step_of).unwrap_or(0);
        // A table that was removed begins again with the rows to come.
        let old = std::fs::read_to_string(path).unwrap_or_default();
        let rows = old.lines().filter(|line| step_of(line).is_some_and(|step| step < next));
        let rows: String = rows.map(|line| format!("{line}\n")).collect();
        write_atomic(path, format!("{}{HEADER}\n{rows}", origin.comment_lines()))?;
        let file = OpenOptions::new().append(true).open(path).map_err(Error::io("write", path))?;
        Ok(Self { path: path.to_owned(), file, waiting })
    }

    /// Takes the record of a step; the row before it is written.
    pub(super) fn push(&mut self, record: &StepRecord) -> Result<(), Error> {
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
    pub(super) fn kept(&self) -> Vec<u8> {
        self.waiting.clone().unwrap_or_default().into_bytes()
    }

    /// Writes the row that waits with its budget, which stays open of the last one.
    pub(super) fn write_waiting(&mut self, budget: Option<EnergyBudget>) -> Result<(), Error> {
        let Some(row) = self.waiting.take() else { return Ok(()) };
        let [rate, residual] = budget.map_or([f64::NAN; 2], |b| [b.rate_m5_s3, b.residual_m5_s3()]);
        let line = format!("{row},{},{}\n", float_text(rate), float_text(residual));
        self.file.write_all(line.as_bytes()).map_err(Error::io("write", &self.path))
    }
}
