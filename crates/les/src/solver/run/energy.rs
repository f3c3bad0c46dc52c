//! What a run does to the energy of its flow: how much that may have, and what the steps themselves
//! feed or take.
//!
//! Nothing but a force or a moving wall can give a flow any energy. Pressure, convection and
//! boundaries at rest do no work, viscosity and subgrid stresses take energy away. So the energy
//! may not exceed the lowest that it had, but for what a force did since: by Cauchy and Schwarz
//! `d sqrt(E)/dt <= |f| sqrt(M/2)`, with `M` the volume. Walls of speed `U` can bring the fluid to
//! that speed on top of its own, `sqrt(M/2) U` more in `sqrt(E)`. What is beyond comes from the
//! numbers: the state is not to be kept.
//!
//! Over a hundred steps what the time step does to the energy is compared with what viscosity and
//! the subgrid model take. The residual of a step's budget is the change of the energy less the
//! mean of the powers at both ends. That mean is uncertain by half the difference of the two, which
//! is large where a flow starts with slip at a wall; only what is beyond counts. Where walls move,
//! which drive a flow through its viscous power, or viscosity is stiff, the powers do not tell what
//! is taken, and nothing is said.
//!
//! Check: growing flows are stopped; forced, dragged and decaying ones are not; a flow that
//! Adams-Bashforth feeds, one that Runge-Kutta damps more than viscosity does, and flows that are
//! left alone.

use super::super::flow::Flow;
use super::super::mesh::Wall;
use super::super::settings::TimeScheme;
use crate::error::Error;
use crate::solver::report::StepReport;

/// Share of the energy by which a flow may exceed what it may have. A stable step errs by much
/// less; where errors of the time step have added this much the solution is theirs.
pub(super) const SHARE: f64 = 0.01;
/// Below this fraction of the largest energy of the run the energy is round-off.
const ROUND_OFF: f64 = 1e-24;
/// A pressure tolerance above this may itself feed energy.
pub(super) const LOOSE: f64 = 1e-6;

/// What a run remembers of the energy of its steps, and keeps in its checkpoints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EnergyAccount {
    /// The budget of the last step, which waits for the powers at its end: those at its start.
    pub(super) open: Option<EnergyBudget>,
    /// What the flow may have without walls that move \[m^5/s^2\].
    pub(super) bound_m5_s2: f64,
    /// Largest energy so far \[m^5/s^2\].
    pub(super) largest_m5_s2: f64,
    /// Residuals of the budgets of up to [`STEPS`] steps \[m^5/s^3\].
    pub(super) fed_m5_s3: f64,
    /// What viscosity and model took in these steps \[m^5/s^3\].
    pub(super) taken_m5_s3: f64,
}

impl EnergyAccount {
    pub(super) fn new(flow: &Flow) -> Self {
        let energy = flow.kinetic_energy_m5_s2();
        Self {
            open: None,
            bound_m5_s2: energy,
            largest_m5_s2: energy,
            fed_m5_s3: 0.0,
            taken_m5_s3: 0.0,
        }
    }

    /// Takes a step of `step_s` that brought `energy_before` to the present energy.
    ///
    /// # Errors
    /// [`Error::EnergyGrew`] if the energy is more than the flow may have.
    pub(super) fn pass(
        &mut self,
        flow: &Flow,
        energy_before: f64,
        step_s: f64,
    ) -> Result<(), Error> {
        let energy = flow.kinetic_energy_m5_s2();
        let [force, wall] = sources(flow);
        let forced = (self.bound_m5_s2.sqrt() + step_s * force).powi(2);
        let allowed = (forced.sqrt() + wall).powi(2);
        if energy > (1.0 + SHARE) * allowed {
            return Err(grew(flow, allowed, (energy / energy_before).ln() / step_s)?);
        }
        self.largest_m5_s2 = self.largest_m5_s2.max(energy);
        self.bound_m5_s2 = energy.min(forced).max(ROUND_OFF * self.largest_m5_s2);
        Ok(())
    }

    /// Takes the budget that `report` closed, open with the power at its start and the mean of both
    /// ends.
    pub(super) fn add(&mut self, open: EnergyBudget, closed: EnergyBudget, report: &StepReport) {
        let residual = closed.residual_m5_s3();
        let uncertain = (closed.power_m5_s3 - open.power_m5_s3).abs();
        self.fed_m5_s3 += residual.signum() * (residual.abs() - uncertain).max(0.0);
        self.taken_m5_s3 += report.viscous_power_m5_s3.abs() + report.subgrid_power_m5_s3.abs();
    }

    /// What it adds up to after its last step, if that is more than a tenth of what viscosity and
    /// model took; then it is empty.
    pub(super) fn close(&mut self, flow: &Flow, report: &StepReport) -> Option<StepEnergy> {
        if !report.step.is_multiple_of(STEPS) {
            return None;
        }
        let fed_m5_s3 = std::mem::take(&mut self.fed_m5_s3);
        let taken_m5_s3 = std::mem::take(&mut self.taken_m5_s3);
        let settings = flow.settings();
        let energy = StepEnergy {
            share: fed_m5_s3 / taken_m5_s3,
            courant: report.courant,
            scheme: settings.scheme,
            pressure_tolerance: settings.pressure_tolerance,
        };
        let mut walls = flow.mesh().directions().iter().flat_map(|d| d.ends.walls());
        let is_driven = walls
            .any(|wall| matches!(wall, Wall::NoSlip { velocity_m_s } if velocity_m_s != [0.0; 3]));
        if is_driven || !flow.stiffness().is_resolved(report.step_s) {
            return None;
        }
        let negligible = if taken_m5_s3 > 0.0 {
            NEGLIGIBLE
        } else {
            UNDAMPED_NEGLIGIBLE
        };
        let is_significant =
            fed_m5_s3.abs() * report.step_s > negligible * report.kinetic_energy_m5_s2;
        (is_significant && energy.share.abs() > REPORTED).then_some(energy)
    }
}

/// What the force adds to `sqrt(E)` in a second, and what walls that move add once.
fn sources(flow: &Flow) -> [f64; 2] {
    let lines = flow.layout.line.iter();
    let volume_m3: f64 = lines
        .map(|line| line.cell_mass_m.iter().sum::<f64>())
        .product();
    let mut fastest_m_s = 0.0_f64;
    for wall in flow.mesh().directions().iter().flat_map(|d| d.ends.walls()) {
        if let Wall::NoSlip { velocity_m_s } = wall {
            fastest_m_s = fastest_m_s.max(magnitude(velocity_m_s));
        }
    }
    let force_m_s2 = magnitude(flow.settings().force_m_s2);
    [force_m_s2, fastest_m_s].map(|v| v * (0.5 * volume_m3).sqrt())
}

fn magnitude(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

fn grew(flow: &Flow, allowed_m5_s2: f64, rate_per_s: f64) -> Result<Error, Error> {
    let (axis, place) = flow.strongest_short_wave()?;
    Ok(Error::EnergyGrew {
        step: flow.steps(),
        time_s: flow.time_s(),
        energy_m5_s2: flow.kinetic_energy_m5_s2(),
        allowed_m5_s2,
        rate_per_s,
        place: Box::new(flow.place(axis, place)),
        cause: cause(flow)?,
    })
}

/// The likeliest cause, and what to do.
fn cause(flow: &Flow) -> Result<String, Error> {
    let settings = flow.settings();
    let step_s = flow.state.last_step_s;
    let decay = step_s * flow.explicit_viscous_rate_per_s();
    if decay > settings.scheme.largest_decay() {
        return Ok(format!(
            "viscosity is explicit with {decay:.2} per step, stable up to {}: shorten the step or take it implicitly",
            settings.scheme.largest_decay()
        ));
    }
    let stability = flow.stability()?;
    if let Some(growth) = stability.undamped(flow.judged_step_s(&stability, step_s)) {
        let remedy = if settings.scheme == TimeScheme::AdamsBashforth2 {
            "take Runge-Kutta"
        } else {
            "shorten the step"
        };
        return Ok(format!("{growth}: {remedy}"));
    }
    if let Some(note) = flow.stiffness().note(step_s) {
        return Ok(note);
    }
    let tolerance = settings.pressure_tolerance;
    if tolerance > LOOSE {
        return Ok(format!(
            "the pressure tolerance {tolerance:e} leaves divergence, which feeds energy: take 1e-8 or less"
        ));
    }
    Ok("the time step is too long for this flow: shorten it".into())
}

/// Steps over which is summed.
pub(super) const STEPS: u64 = 100;
/// Fraction of what viscosity and model take from which on a step is reported.
const REPORTED: f64 = 0.1;
/// Less than this fraction of the energy over [`STEPS`] steps is negligible.
const NEGLIGIBLE: f64 = 1e-5;
/// The same where neither viscosity nor a model takes any.
const UNDAMPED_NEGLIGIBLE: f64 = 1e-3;

/// What became of the kinetic energy in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyBudget {
    /// Number of the step.
    pub step: u64,
    /// Change of the energy over the length of the step \[m^5/s^3\].
    pub rate_m5_s3: f64,
    /// Viscous, subgrid and force power, mean of both ends of the step \[m^5/s^3\].
    pub power_m5_s3: f64,
}

impl EnergyBudget {
    /// What the powers do not explain: the error of the time step, and of the pressure solve
    /// \[m^5/s^3\].
    pub fn residual_m5_s3(&self) -> f64 {
        self.rate_m5_s3 - self.power_m5_s3
    }
}

/// What the time step itself did to the energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepEnergy {
    /// Sum of the residuals over what viscosity and subgrid model took: positive where the step
    /// feeds the flow; infinite where there is neither.
    pub share: f64,
    /// Courant number of the steps.
    pub courant: f64,
    /// The scheme.
    pub scheme: TimeScheme,
    /// Tolerance of the pressure equation, which feeds energy where it is loose.
    pub pressure_tolerance: f64,
}

impl StepEnergy {
    /// Courant number at which the share is well below a tenth: what waves that grow feed falls
    /// with the square at least, what Runge-Kutta takes about with the cube.
    pub fn suited_courant(&self) -> f64 {
        let ratio = 0.5 * REPORTED / self.share.abs();
        let factor = if self.share > 0.0 {
            ratio.sqrt()
        } else {
            ratio.cbrt()
        };
        (100.0 * self.courant * factor).floor() / 100.0
    }
}

impl std::fmt::Display for StepEnergy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            pressure_tolerance, ..
        } = self;
        let does = if self.share > 0.0 {
            "feeds the flow with"
        } else {
            "takes"
        };
        if self.share.is_finite() {
            write!(
                f,
                "the time step {does} {:.2} times what viscosity and subgrid model take",
                self.share.abs()
            )?;
        } else {
            write!(
                f,
                "the time step {does} energy, of which nothing else takes any,"
            )?;
        }
        write!(
            f,
            " (energy_residual over {STEPS} steps at Courant number {:.2}): ",
            self.courant
        )?;
        if self.share > 0.0 && *pressure_tolerance > LOOSE {
            return write!(
                f,
                "the pressure tolerance {pressure_tolerance:e} leaves divergence, take 1e-8 or less"
            );
        }
        if self.share > 0.0 && self.scheme == TimeScheme::AdamsBashforth2 {
            write!(f, "take Runge-Kutta, or ")?;
        }
        match self.suited_courant() {
            suited if suited > 0.0 => write!(f, "take a Courant number of at most {suited:.2}"),
            _ => write!(f, "half the step does an eighth of it"),
        }
    }
}
