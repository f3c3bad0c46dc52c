//! The driver of a simulation: to an end time, with outputs at exact times, a record of every step, and checkpoints.
//!
//! It prints nothing and writes nothing but checkpoints; who watches a run is told of everything through [`RunObserver`].
//! Every decision follows from the state and the plan, so that a run resumed from a checkpoint makes the same steps, records
//! and outputs, bit for bit, as one that was not interrupted.
//!
//! A state whose energy is more than the flow can have ends the run before anything is written of it.
//!
//! Check: resumed against uninterrupted runs, times hit, the energy budget against a flow with known decay, runs that blow
//! up, observers that fail.

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
use energy::{EnergyBound, Window};
pub use energy::{EnergyBudget, StepEnergy};

/// A step shorter than this share of the time of the run does not lead to its end.
const SHORTEST_SHARE: f64 = 1e-10;
/// Times closer than this share of the time of the run are the same.
const SAME_TIME: f64 = 1e-12;
/// Steps between checks for waves that grow.
const STEPS_PER_CHECK: u64 = 64;
/// Growth of the worst wave over the rest of the run, as an exponent, that is warned of.
pub const NOTICED_GROWTH: f64 = 0.1;

/// How often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// After so many steps.
    Steps(u64),
    /// After so much simulated time \[s\].
    Time {
        /// The time between \[s\].
        time_s: f64,
    },
}

/// Where and how often checkpoints are written.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckpointPlan {
    /// The file. The one before it is kept beside it, with `.previous` at the end of its name.
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

/// One step as the observer sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRecord {
    /// What the flow reported.
    pub report: StepReport,
    /// Largest divergence over the largest `sum |u_i|/h_i`.
    pub relative_divergence: f64,
    /// The energy budget of the step before: the powers at its end are known only now. None in the first step.
    pub budget_before: Option<EnergyBudget>,
}

/// What deserves attention but does not stop a run; each kind is told once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RunWarning {
    /// The time step feeds the flow, or takes from it, more than a tenth of what viscosity and model take.
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

/// Who watches a run. An `Err` with a reason stops it; the last checkpoint stays. Of a run on several ranks the observers of all
/// are asked, for readers of the flow must be called by all; one that fails alone must do so after them. Warnings go to that
/// of rank 0, which says what checkpoints keep.
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

/// An observer that takes no notice.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl RunObserver for Silent {}

/// Wall time that a run has spent in steps.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stepping {
    /// All of it \[s\].
    pub wall_s: f64,
    /// In exchanges between ranks, waiting for them included \[s\].
    pub exchange_s: f64,
}

/// A simulation with its plan.
#[derive(Debug)]
pub struct Run {
    flow: Flow,
    plan: RunPlan,
    kept: Kept,
    has_warned_of_energy: bool,
    has_warned_of_growth: bool,
    is_fresh: bool,
    stepping: Stepping,
}

/// What a run remembers of its steps, and keeps in its checkpoints beside the flow.
#[derive(Debug, Clone, Copy)]
struct Kept {
    /// The budget of the last step, which waits for the powers at its end: those at its start.
    open: Option<EnergyBudget>,
    energy: EnergyBound,
    window: Window,
}

impl Run {
    /// A run that begins with the present state of `flow`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for times that do not increase or lie outside the run, and empty intervals.
    pub fn new(flow: Flow, plan: RunPlan) -> Result<Self, Error> {
        plan.check(flow.time_s())?;
        let kept = Kept {
            open: None,
            energy: EnergyBound::new(&flow),
            window: Window::default(),
        };
        Ok(Self::with(flow, plan, kept, true))
    }

    /// A run that continues from a checkpoint written by a run, with the bytes that the observer had given.
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
        let Some((kept, user_data)) = Kept::read(&bytes) else {
            return Err(Error::CheckpointDamaged {
                path: path.to_owned(),
                what,
            });
        };
        plan.check(f64::NEG_INFINITY)?;
        Ok((Self::with(flow, plan, kept, false), user_data.to_vec()))
    }

    fn with(flow: Flow, plan: RunPlan, kept: Kept, is_fresh: bool) -> Self {
        let (has_warned_of_energy, has_warned_of_growth, stepping) = Default::default();
        Self {
            flow,
            plan,
            kept,
            has_warned_of_energy,
            has_warned_of_growth,
            is_fresh,
            stepping,
        }
    }

    /// The simulation, or the part that this rank has.
    pub fn flow(&self) -> &Flow {
        &self.flow
    }

    /// What the steps of this run have taken so far.
    pub fn stepping(&self) -> Stepping {
        self.stepping
    }

    /// The plan.
    pub fn plan(&self) -> &RunPlan {
        &self.plan
    }

    /// Runs to the end, or to the pause; returns whether it is the end.
    ///
    /// # Errors
    /// What [`Flow::step`] refuses, [`Error::EnergyGrew`], [`Error::StepTooShort`], [`Error::Stopped`] by the observer,
    /// [`Error::File`] for a checkpoint. The last good checkpoint stays as it was.
    pub fn to_end(&mut self, observer: &mut dyn RunObserver) -> Result<bool, Error> {
        let (start_s, end_s) = (self.flow.time_s(), self.plan.end_s);
        // A fresh run gives the output of its start; a resumed one gave it before its checkpoint.
        let (was_fresh, begun_at) = (self.is_fresh, self.flow.steps());
        let given = |&t: &f64| {
            if self.is_fresh {
                t < start_s
            } else {
                self.is_reached(t)
            }
        };
        let mut next_output = self
            .plan
            .output_times_s
            .iter()
            .take_while(|t| given(t))
            .count();
        self.is_fresh = false;
        self.give_outputs(&mut next_output, observer)?;
        while !self.is_reached(end_s) {
            if self
                .plan
                .pause_after_steps
                .is_some_and(|steps| self.flow.steps() >= steps)
            {
                break;
            }
            let target_s = self
                .plan
                .output_times_s
                .get(next_output)
                .map_or(end_s, |t| t.min(end_s));
            let before_s = self.flow.time_s();
            let energy = self.flow.kinetic_energy_m5_s2();
            self.look_for_growth(observer);
            let (begun, exchanged_s) = (Instant::now(), self.flow.layout.slabs.ranks.spent_s());
            let report = self.flow.step_towards(target_s)?;
            self.stepping.wall_s += begun.elapsed().as_secs_f64();
            self.stepping.exchange_s += self.flow.layout.slabs.ranks.spent_s() - exchanged_s;
            if report.step_s < SHORTEST_SHARE * (end_s - start_s) && !self.is_reached(target_s) {
                let (step, step_s) = (report.step, report.step_s);
                return Err(Error::StepTooShort {
                    step,
                    time_s: report.time_s,
                    step_s,
                    end_s,
                });
            }
            let record = self.record(report, energy)?;
            self.all_agree(observer.step(&self.flow, &record))?;
            self.kept.energy.pass(&self.flow, energy, report.step_s)?;
            self.watch(&report, observer)?;
            self.give_outputs(&mut next_output, observer)?;
            if self.checkpoint_is_due(before_s, &report) {
                self.write_checkpoint(observer)?;
            }
        }
        let is_complete = self.is_reached(end_s);
        // What a run resumed from is not written again.
        if was_fresh || self.flow.steps() > begun_at {
            self.write_checkpoint(observer)?;
        }
        Ok(is_complete)
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
    fn all_agree(&self, seen: Result<(), String>) -> Result<(), Error> {
        let flow = &self.flow;
        let stopped = |reason| Error::Stopped {
            step: flow.steps(),
            time_s: flow.time_s(),
            reason,
        };
        flow.layout.slabs.all_agree(seen.map_err(stopped))
    }

    /// Tells who watches, once for all ranks.
    fn tell(&self, observer: &mut dyn RunObserver, warning: &RunWarning) {
        if self.flow.layout.slabs.is_first() {
            observer.warning(warning);
        }
    }

    /// Tells of energy that the steps themselves feed or take, and refuses more than viscosity and model take.
    fn watch(&mut self, report: &StepReport, observer: &mut dyn RunObserver) -> Result<(), Error> {
        let Some(energy) = self.kept.window.close(&self.flow, report) else {
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
            self.tell(
                observer,
                &RunWarning::StepEnergy {
                    step: report.step,
                    energy,
                },
            );
        }
        Ok(())
    }

    fn look_for_growth(&mut self, observer: &mut dyn RunObserver) {
        let step = self.flow.steps();
        // What a model takes from the waves, the energy of the steps tells.
        let is_modelled = self.flow.settings().subgrid != SubgridModel::None;
        if self.has_warned_of_growth || is_modelled || !step.is_multiple_of(STEPS_PER_CHECK) {
            return;
        }
        let left_s = self.plan.end_s - self.flow.time_s();
        let step_s = self.flow.next_step_s();
        // If a rank is lost, the next step says so.
        let growth = self
            .flow
            .stability()
            .ok()
            .and_then(|s| s.undamped(self.flow.judged_step_s(&s, step_s)));
        if let Some(growth) = growth.filter(|g| g.rate_per_s * left_s > NOTICED_GROWTH) {
            self.has_warned_of_growth = true;
            self.tell(observer, &RunWarning::UndampedGrowth { step, growth });
        }
    }

    fn record(&mut self, report: StepReport, energy_before: f64) -> Result<StepRecord, Error> {
        let power_m5_s3 =
            report.viscous_power_m5_s3 + report.subgrid_power_m5_s3 + report.force_power_m5_s3;
        let mean = |open: EnergyBudget| EnergyBudget {
            power_m5_s3: 0.5 * (open.power_m5_s3 + power_m5_s3),
            ..open
        };
        let budget_before = self.kept.open.map(mean);
        if let (Some(open), Some(closed)) = (self.kept.open, budget_before) {
            self.kept.window.add(open, closed, &report);
        }
        let rate_m5_s3 = (report.kinetic_energy_m5_s2 - energy_before) / report.step_s;
        self.kept.open = Some(EnergyBudget {
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
        self.flow.refuse_courant(courant, report.step_s).is_ok()
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
        let bytes = [self.kept.bytes(), observer.user_data()].concat();
        self.flow
            .save_and_keep(&plan.path, Some(Path::new(&previous)), &bytes)
    }
}

impl RunPlan {
    /// Refuses what a run that starts at `start_s` would refuse.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for times that do not increase or lie outside the run, and empty intervals.
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

impl Kept {
    /// The first number is 3 if a budget is open, else 2.
    fn bytes(&self) -> Vec<u8> {
        let open = self.open.map_or([2, 0, 0, 0], |b| {
            [3, b.step, b.rate_m5_s3.to_bits(), b.power_m5_s3.to_bits()]
        });
        let Self { energy, window, .. } = self;
        let numbers = [
            energy.bound_m5_s2,
            energy.largest_m5_s2,
            window.fed_m5_s3,
            window.taken_m5_s3,
        ];
        open.into_iter()
            .chain(numbers.map(f64::to_bits))
            .flat_map(u64::to_le_bytes)
            .collect()
    }

    fn read(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let number = |at: usize| Some(u64::from_le_bytes(*bytes.get(8 * at..)?.first_chunk()?));
        let float = |at: usize| number(at).map(f64::from_bits);
        let is_open = number(0).filter(|kind| matches!(kind, 2 | 3))? == 3;
        let (rate_m5_s3, power_m5_s3) = (float(2)?, float(3)?);
        let open = is_open.then_some(EnergyBudget {
            step: number(1)?,
            rate_m5_s3,
            power_m5_s3,
        });
        let energy = EnergyBound {
            bound_m5_s2: float(4)?,
            largest_m5_s2: float(5)?,
        };
        let window = Window {
            fed_m5_s3: float(6)?,
            taken_m5_s3: float(7)?,
        };
        Some((
            Self {
                open,
                energy,
                window,
            },
            bytes.get(64..)?,
        ))
    }
}

#[cfg(test)]
mod ranks_tests;
#[cfg(test)]
mod tests;
