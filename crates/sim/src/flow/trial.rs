//! Runs of a case beside each other, in memory: the same flow with other cells and other steps, and the history of a run.
//!
//! Check: the tests of `accuracy`, which compares them with a closed form.

use super::execute::prepare;
use super::{Begin, CaseFile, CaseKind};
use crate::Error;
use crate::progress::Observer;
use std::path::Path;
use std::sync::Arc;
use wakescope_les::analysis::WakeMeter;
use wakescope_les::ranks::{Ranks, Single};
use wakescope_les::solver::{Run, RunObserver, StepRecord};
use wakescope_les::{Flow, TimeStep};

/// Numbers of a run at its output times after the start: energy \[m^5/s^2\], dissipation \[m^5/s^3\], of a wake circulation \[m^2/s\] and height \[m\],
/// the means of both vortices; NaN where there is none.
pub(crate) type History = [Vec<f64>; 4];

/// Output times of a history whose case has hardly any.
const TIMES: f64 = 16.0;

impl CaseFile {
    /// The same case with cells `ratio` times as long, rounded to even numbers but for directions in which nothing varies.
    pub(crate) fn coarser(&self, ratio: f64) -> Self {
        let mut case = self.content.clone();
        for cells in case.case.cells_mut() {
            if *cells > 1 {
                *cells = 2 * (0.5 * *cells as f64 / ratio).round() as usize;
            }
        }
        self.changed(case)
    }

    /// The same case and time scheme with steps `times` as long; the key of the step, and its value.
    ///
    /// # Errors
    /// As [`super::check_on`].
    pub(crate) fn with_longer_steps(&self, times: f64) -> Result<(Self, &'static str, f64), Error> {
        let settings = prepare(self, Path::new(""), Begin::New, false, &alone())?
            .0
            .settings;
        let mut case = self.content.clone();
        let time = &mut case.time;
        time.scheme = Some(settings.scheme);
        let (key, value) = match settings.time_step {
            TimeStep::Fixed { step_s } => ("time.step_s", *time.step_s.insert(times * step_s)),
            TimeStep::Courant { courant, longest_s } => {
                time.longest_step_s = Some(times * longest_s).filter(|_| longest_s < f64::MAX);
                ("time.courant", *time.courant.insert(times * courant))
            }
        };
        Ok((self.changed(case), key, value))
    }

    /// The same case for a history, with enough output times to compare it; nothing is written.
    fn for_history(&self, end_s: f64) -> Self {
        let mut case = self.content.clone();
        case.output.fields.clear();
        case.output.planes.clear();
        case.checkpoint.write = false;
        case.time.pause_after_steps = None;
        if let Some(wake) = &mut case.wake {
            wake.fields_tau = Some(Vec::new());
            wake.planes_tau = Some(Vec::new());
            wake.series_tau = None;
            wake.every_tau = wake.every_tau.min(wake.end_tau / TIMES);
        } else if case.output.every_s.is_none() && case.output.times_s.len() < 4 {
            case.output.times_s = (0..=TIMES as usize)
                .map(|i| end_s * i as f64 / TIMES)
                .collect();
        }
        self.changed(case)
    }

    /// A refusal of its cells.
    pub(crate) fn refuse_cells(&self, allowed: String) -> Error {
        let is_free = matches!(self.content.case, CaseKind::Free(_));
        self.refuse(
            if is_free { "case" } else { "case.cells" },
            self.content.case.cells(),
            allowed,
        )
    }
}

fn alone() -> Arc<dyn Ranks> {
    Arc::new(Single)
}

/// Runs a case to its end and returns its history; nothing is written.
///
/// # Errors
/// What the case refuses; a flow that blows up.
pub(crate) fn history_of(file: &CaseFile, observer: &dyn Observer) -> Result<History, Error> {
    let end_s = prepare(file, Path::new(""), Begin::New, false, &alone())?
        .3
        .end_s;
    let (mut setup, mut plan, ..) = prepare(
        &file.for_history(end_s),
        Path::new(""),
        Begin::New,
        false,
        &alone(),
    )?;
    plan.checkpoint = None;
    let meter = setup.wake.take().map(|wake| wake.meter);
    let cells = setup.mesh.cells();
    let mut recorder = Recorder {
        meter,
        history: History::default(),
        observer,
        cells,
    };
    let (flow, _) = setup.start()?;
    let mut run = Run::new(flow, plan).map_err(Error::Flow)?;
    run.to_end(&mut recorder).map_err(Error::Flow)?;
    let mut history = recorder.history;
    // The dissipation at the end would need one more step.
    history[1].resize(history[0].len(), f64::NAN);
    Ok(history)
}

/// Records the history of a run.
struct Recorder<'a> {
    meter: Option<WakeMeter>,
    history: History,
    observer: &'a dyn Observer,
    cells: [usize; 3],
}

impl RunObserver for Recorder<'_> {
    fn step(&mut self, _: &Flow, record: &StepRecord) -> Result<(), String> {
        let report = &record.report;
        let [nx, ny, nz] = self.cells;
        self.observer
            .reach(&format!("{nx} x {ny} x {nz} cells, step {}", report.step));
        // Powers are those of the start of a step.
        let [energy, dissipation, ..] = &mut self.history;
        dissipation.resize(
            energy.len(),
            -report.viscous_power_m5_s3 - report.subgrid_power_m5_s3,
        );
        Ok(())
    }

    fn output(&mut self, flow: &Flow, _: usize) -> Result<(), String> {
        let [energy, _, circulation, height] = &mut self.history;
        // The meter follows the vortices from the start, which is the same on all meshes but for the jump at a wall.
        let record = self
            .meter
            .as_mut()
            .map(|meter| meter.measure(flow))
            .transpose()
            .map_err(|e| e.to_string())?;
        if flow.steps() == 0 {
            return Ok(());
        }
        energy.push(flow.kinetic_energy_m5_s2());
        let Some(record) = record else { return Ok(()) };
        let [left, right] = [record.left, record.right];
        circulation.push(0.5 * (left.gamma_5_15_m2_s.abs() + right.gamma_5_15_m2_s.abs()));
        height.push(0.5 * (left.z_m + right.z_m));
        Ok(())
    }
}
