//! The driver of a simulation: to an end time, with outputs at exact times, a record of every step,
//! and checkpoints.
//!
//! It prints nothing and writes nothing but checkpoints; who watches a run is told of everything
//! through [`RunObserver`]. Every decision follows from the state and the plan, so that a run
//! resumed from a checkpoint makes the same steps, records and outputs, bit for bit, as one that
//! was not interrupted.
//!
//! A state whose energy is more than the flow can have ends the run before anything is written of
//! it.
//!
//! Check: resumed against uninterrupted runs, times hit, the energy budget against a flow with
//! known decay, runs that blow up, observers that fail.

mod energy;

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::flow::Flow;
use super::growth::UndampedGrowth;
use super::mesh::Mesh;
use super::report::StepReport;
use super::settings::FlowSettings;
use super::subgrid::SubgridModel;
use crate::error::{Error, check};
use energy::EnergyAccount;
pub use energy::{EnergyBudget, StepEnergy};

/// A step shorter than this fraction of the time of the run does not lead to its end.
const SHORTEST_FRACTION: f64 = 1e-10;
/// Times closer than this fraction of the time of the run are the same.
const SAME_TIME: f64 = 1e-12;
/// Steps between checks for waves that grow.
const STEPS_PER_CHECK: u64 = 64;
/// Growth of the worst wave over the rest of the run, as an exponent, that is warned of.
pub const NOTICED_GROWTH: f64 = 0.1;

/// Time between checkpoints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// A number of steps.
    Steps(u64),
    /// A simulated time \[s\].
    Time {
        /// The time between \[s\].
        time_s: f64,
    },
}

/// Where and how often checkpoints are written.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckpointPlan {
    /// The file. The one before it stays beside it, with `.previous` at the end of its name.
    pub path: PathBuf,
    /// How often; one is written at the end as well.
    pub every: Interval,
}

/// What a run is to do.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunPlan {
    /// Time at which it ends \[s\].
    pub end_s: f64,
    /// Times of the outputs \[s\], increasing; that of the start may be among them.
    pub output_times_s: Vec<f64>,
    /// Checkpoints, if any.
    pub checkpoint: Option<CheckpointPlan>,
    /// The run pauses when the flow has made this many steps.
    pub pause_after_steps: Option<u64>,
}

/// One step as it is reported to the observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRecord {
    /// What the flow reported.
    pub report: StepReport,
    /// Largest divergence over the largest `sum |u_i|/h_i`.
    pub relative_divergence: f64,
    /// The energy budget of the step before: the powers at its end are known only now. None in the
    /// first step.
    pub budget_before: Option<EnergyBudget>,
}

/// What deserves attention but does not stop a run; each kind is reported once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RunWarning {
    /// The time step feeds the flow, or takes from it, more than a tenth of what viscosity and
    /// model take.
    StepEnergy {
        /// Number of the last of the steps over which this was summed.
        step: u64,
        /// What they did.
        energy: StepEnergy,
    },
    /// Adams-Bashforth lets waves of the mesh grow, for all that viscosity takes from them.
    UndampedGrowth {
        /// Steps made.
        step: u64,
        /// The waves.
        growth: UndampedGrowth,
    },
}

/// Who watches a run. An `Err` with a reason stops it; the last checkpoint stays. Of a run on
/// several ranks the observers of all are asked, for readers of the flow must be called by all; one
/// that fails alone must do so after them. Warnings go to that of rank 0, which says what
/// checkpoints keep.
pub trait RunObserver {
    /// After every step.
    ///
    /// # Errors
    /// A reason to stop.
    fn step(&mut self, _flow: &Flow, _record: &StepRecord) -> Result<(), String> {
        Ok(())
    }

    /// At output `index` of the plan.
    ///
    /// # Errors
    /// A reason to stop, such as an output that cannot be written.
    fn output(&mut self, _flow: &Flow, _index: usize) -> Result<(), String> {
        Ok(())
    }

    /// When something deserves attention.
    fn warning(&mut self, _warning: &RunWarning) {}

    /// Bytes that the next checkpoint keeps; they come back from [`Run::resume`].
    fn user_data(&self) -> Vec<u8> {
        Vec::new()
    }
}

/// Observes nothing.
impl RunObserver for () {}

/// A simulation with its plan.
#[derive(Debug)]
pub struct Run {
    flow: Flow,
    plan: RunPlan,
    energy: EnergyAccount,
    has_warned_of_energy: bool,
    has_warned_of_growth: bool,
    is_fresh: bool,
    steps_wall_s: f64,
    exchange_wall_s: f64,
}

impl Run {
    /// A run that begins with the present state of `flow`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for times that do not increase or lie outside the run, and empty
    /// intervals.
    pub fn new(flow: Flow, plan: RunPlan) -> Result<Self, Error> {
        plan.check(flow.time_s())?;
        let energy = EnergyAccount::new(&flow);
        Ok(Self::from_parts(flow, plan, energy, true))
    }

    /// A run that continues from a checkpoint written by a run, with the bytes that the observer
    /// had given.
    ///
    /// # Errors
    /// As [`Flow::restore`] and [`Run::new`].
    pub fn resume(
        path: impl AsRef<Path>,
        mesh: Mesh,
        settings: FlowSettings,
        plan: RunPlan,
    ) -> Result<(Self, Vec<u8>), Error> {
        let path = path.as_ref();
        let (flow, bytes) = Flow::restore(path, mesh, settings)?;
        let what = "it was written by another kind of program";
        let Some((energy, user_data)) = EnergyAccount::read(&bytes) else {
            return Err(Error::CheckpointDamaged {
                path: path.to_owned(),
                what,
            });
        };
        plan.check(f64::NEG_INFINITY)?;
        Ok((
            Self::from_parts(flow, plan, energy, false),
            user_data.to_vec(),
        ))
    }

    fn from_parts(flow: Flow, plan: RunPlan, energy: EnergyAccount, is_fresh: bool) -> Self {
        Self {
            flow,
            plan,
            energy,
            has_warned_of_energy: false,
            has_warned_of_growth: false,
            is_fresh,
            steps_wall_s: 0.0,
            exchange_wall_s: 0.0,
        }
    }

    /// The simulation, or the part that this rank has.
    pub fn flow(&self) -> &Flow {
        &self.flow
    }

    /// Wall time that the steps of this run have taken so far \[s\].
    pub fn steps_wall_s(&self) -> f64 {
        self.steps_wall_s
    }

    /// Part of it in exchanges between ranks, waiting for them included \[s\].
    pub fn exchange_wall_s(&self) -> f64 {
        self.exchange_wall_s
    }

    /// The plan.
    pub fn plan(&self) -> &RunPlan {
        &self.plan
    }

    /// Runs to the end, or to the pause; returns whether it is the end.
    ///
    /// # Errors
    /// What [`Flow::step`] refuses, [`Error::EnergyGrew`], [`Error::StepTooShort`],
    /// [`Error::Stopped`] by the observer, [`Error::File`] for a checkpoint. The last good
    /// checkpoint stays as it was.
    pub fn to_end(&mut self, observer: &mut dyn RunObserver) -> Result<bool, Error> {
        let start_s = self.flow.time_s();
        let end_s = self.plan.end_s;
        let was_fresh = self.is_fresh;
        let first_step = self.flow.steps();
        let mut next_output = self.first_output();
        self.is_fresh = false;
        self.give_outputs(&mut next_output, observer)?;
        while !self.is_reached(end_s) && !self.is_paused() {
            let output_s = self.plan.output_times_s.get(next_output);
            let target_s = output_s.map_or(end_s, |t| t.min(end_s));
            let before_s = self.flow.time_s();
            let energy = self.flow.kinetic_energy_m5_s2();
            self.check_growth(observer);
            let report = self.timed_step(target_s)?;
            let is_too_short = report.step_s < SHORTEST_FRACTION * (end_s - start_s);
            if is_too_short && !self.is_reached(target_s) {
                return Err(Error::StepTooShort {
                    step: report.step,
                    time_s: report.time_s,
                    step_s: report.step_s,
                    end_s,
                });
            }
            let record = self.record(report, energy)?;
            self.all_agree(observer.step(&self.flow, &record))?;
            self.energy.pass(&self.flow, energy, report.step_s)?;
            self.check_step_energy(&report, observer)?;
            self.give_outputs(&mut next_output, observer)?;
            if self.checkpoint_is_due(before_s, &report) {
                self.write_checkpoint(observer)?;
            }
        }
        let is_complete = self.is_reached(end_s);
        // What a run resumed from is not written again.
        if was_fresh || self.flow.steps() > first_step {
            self.write_checkpoint(observer)?;
        }
        Ok(is_complete)
    }

    /// Number of the first output that is still to be given. A fresh run gives the output of its
    /// start; a resumed one gave it before its checkpoint.
    fn first_output(&self) -> usize {
        let start_s = self.flow.time_s();
        let mut given = 0;
        for &time_s in &self.plan.output_times_s {
            let is_given = if self.is_fresh {
                time_s < start_s
            } else {
                self.is_reached(time_s)
            };
            if !is_given {
                break;
            }
            given += 1;
        }
        given
    }

    fn is_paused(&self) -> bool {
        let pause = self.plan.pause_after_steps;
        pause.is_some_and(|steps| self.flow.steps() >= steps)
    }

    /// Makes a step towards `target_s` and adds its wall time.
    fn timed_step(&mut self, target_s: f64) -> Result<StepReport, Error> {
        let started = Instant::now();
        let exchanged_s = self.flow.layout.slabs.ranks.spent_s();
        let report = self.flow.step_towards(target_s)?;
        self.steps_wall_s += started.elapsed().as_secs_f64();
        self.exchange_wall_s += self.flow.layout.slabs.ranks.spent_s() - exchanged_s;
        Ok(report)
    }

    fn is_reached(&self, time_s: f64) -> bool {
        time_s - self.flow.time_s() <= SAME_TIME * time_s.abs().max(self.plan.end_s.abs())
    }

    fn give_outputs(
        &mut self,
        next: &mut usize,
        observer: &mut dyn RunObserver,
    ) -> Result<(), Error> {
        while self
            .plan
            .output_times_s
            .get(*next)
            .is_some_and(|&t| self.is_reached(t))
        {
            self.all_agree(observer.output(&self.flow, *next))?;
            *next += 1;
        }
        Ok(())
    }

    /// What stops one rank stops all.
    fn all_agree(&self, result: Result<(), String>) -> Result<(), Error> {
        let flow = &self.flow;
        let result = result.map_err(|reason| Error::Stopped {
            step: flow.steps(),
            time_s: flow.time_s(),
            reason,
        });
        flow.layout.slabs.all_agree(result)
    }

    /// Reports a warning to the observer of rank 0.
    fn warn(&self, observer: &mut dyn RunObserver, warning: &RunWarning) {
        if self.flow.layout.slabs.is_first() {
            observer.warning(warning);
        }
    }

    /// Tells of energy that the steps themselves feed or take, and refuses more than viscosity and
    /// model take.
    fn check_step_energy(
        &mut self,
        report: &StepReport,
        observer: &mut dyn RunObserver,
    ) -> Result<(), Error> {
        let Some(energy) = self.energy.close(&self.flow, report) else {
            return Ok(());
        };
        if energy.share > 1.0 && energy.share.is_finite() {
            return Err(Error::StepFeeds {
                step: report.step,
                time_s: report.time_s,
                share: energy.share,
                suited_courant: energy.suited_courant(),
                cause: energy.to_string(),
            });
        }
        if !self.has_warned_of_energy {
            self.has_warned_of_energy = true;
            self.warn(
                observer,
                &RunWarning::StepEnergy {
                    step: report.step,
                    energy,
                },
            );
        }
        Ok(())
    }

    fn check_growth(&mut self, observer: &mut dyn RunObserver) {
        let step = self.flow.steps();
        // With a model, which damps the waves as well, the energy of the steps is checked instead.
        let is_modelled = self.flow.settings().subgrid != SubgridModel::None;
        if self.has_warned_of_growth || is_modelled || !step.is_multiple_of(STEPS_PER_CHECK) {
            return;
        }
        let remaining_s = self.plan.end_s - self.flow.time_s();
        let step_s = self.flow.next_step_s();
        // If a rank is lost, the next step says so.
        let Ok(stability) = self.flow.stability() else {
            return;
        };
        let judged_step_s = self.flow.judged_step_s(&stability, step_s);
        if let Some(growth) = stability.undamped(judged_step_s)
            && growth.rate_per_s * remaining_s > NOTICED_GROWTH
        {
            self.has_warned_of_growth = true;
            self.warn(observer, &RunWarning::UndampedGrowth { step, growth });
        }
    }

    fn record(&mut self, report: StepReport, energy_before: f64) -> Result<StepRecord, Error> {
        let power_m5_s3 =
            report.viscous_power_m5_s3 + report.subgrid_power_m5_s3 + report.force_power_m5_s3;
        let budget_before = self.energy.open.map(|open| EnergyBudget {
            power_m5_s3: 0.5 * (open.power_m5_s3 + power_m5_s3),
            ..open
        });
        if let (Some(open), Some(closed)) = (self.energy.open, budget_before) {
            self.energy.add(open, closed, &report);
        }
        let rate_m5_s3 = (report.kinetic_energy_m5_s2 - energy_before) / report.step_s;
        self.energy.open = Some(EnergyBudget {
            step: report.step,
            rate_m5_s3,
            power_m5_s3,
        });
        Ok(StepRecord {
            report,
            relative_divergence: self.flow.measure_divergence()?,
            budget_before,
        })
    }

    fn checkpoint_is_due(&self, before_s: f64, report: &StepReport) -> bool {
        // The last step's checkpoint is written by the end of the run.
        let Some(plan) = &self.plan.checkpoint else {
            return false;
        };
        if self.is_reached(self.plan.end_s) {
            return false;
        }
        // One whose next step would be refused is not worth keeping.
        let courant = self.flow.state.courant_per_s * report.step_s;
        self.flow.check_courant(courant, report.step_s).is_ok()
            && match plan.every {
                Interval::Steps(steps) => report.step.is_multiple_of(steps),
                Interval::Time { time_s } => {
                    (report.time_s / time_s).floor() > (before_s / time_s).floor()
                }
            }
    }

    fn write_checkpoint(&self, observer: &dyn RunObserver) -> Result<(), Error> {
        let Some(plan) = &self.plan.checkpoint else {
            return Ok(());
        };
        let mut previous = plan.path.clone().into_os_string();
        previous.push(".previous");
        let bytes = [self.energy.bytes(), observer.user_data()].concat();
        self.flow
            .save_and_keep(&plan.path, Some(Path::new(&previous)), &bytes)
    }
}

impl RunPlan {
    /// Refuses what a run that starts at `start_s` would refuse.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for times that do not increase or lie outside the run, and empty
    /// intervals.
    pub fn check(&self, start_s: f64) -> Result<(), Error> {
        check(
            "end_s",
            self.end_s,
            "finite and not before the start",
            |t| t >= start_s,
        )?;
        let mut last_s = start_s;
        for (i, &time_s) in self.output_times_s.iter().enumerate() {
            let apart = if i == 0 { 0.0 } else { 1e-9 * self.end_s.abs() };
            check(
                "output_times_s",
                time_s,
                "increasing, from the start to the end of the run",
                |t| t >= last_s + apart && t <= self.end_s,
            )?;
            last_s = time_s;
        }
        match self.checkpoint.as_ref().map(|plan| plan.every) {
            Some(Interval::Steps(steps)) => check(
                "checkpoint interval",
                steps as f64,
                "at least 1 step",
                |n| n >= 1.0,
            ),
            Some(Interval::Time { time_s }) => {
                check("checkpoint interval", time_s, "positive", |t| t > 0.0)
            }
            None => Ok(()),
        }
    }
}

impl EnergyAccount {
    /// The first number is 3 if a budget is open, else 2.
    fn bytes(&self) -> Vec<u8> {
        let [kind, step, rate, power] = self.open.map_or([2, 0, 0, 0], |b| {
            [3, b.step, b.rate_m5_s3.to_bits(), b.power_m5_s3.to_bits()]
        });
        let numbers = [
            kind,
            step,
            rate,
            power,
            self.bound_m5_s2.to_bits(),
            self.largest_m5_s2.to_bits(),
            self.fed_m5_s3.to_bits(),
            self.taken_m5_s3.to_bits(),
        ];
        numbers.into_iter().flat_map(u64::to_le_bytes).collect()
    }

    fn read(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (numbers, user_data) = bytes.split_first_chunk::<64>()?;
        let numbers = numbers.as_chunks::<8>().0;
        let [kind, step, ..] = *numbers else {
            return None;
        };
        let floats: Vec<f64> = numbers.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let [_, _, rate_m5_s3, power_m5_s3, bound, largest, fed, taken] = floats[..] else {
            return None;
        };
        let open = EnergyBudget {
            step: u64::from_le_bytes(step),
            rate_m5_s3,
            power_m5_s3,
        };
        let energy = Self {
            open: match u64::from_le_bytes(kind) {
                2 => None,
                3 => Some(open),
                _ => return None,
            },
            bound_m5_s2: bound,
            largest_m5_s2: largest,
            fed_m5_s3: fed,
            taken_m5_s3: taken,
        };
        Some((energy, user_data))
    }
}

#[cfg(test)]
mod ranks_tests;
#[cfg(test)]
mod tests;
