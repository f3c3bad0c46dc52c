//! What the time step itself does to the energy, over some hundred steps, beside what viscosity and the subgrid model take.
//!
//! The residual of a step's budget is the change of the energy less the mean of the powers at both ends. That mean is uncertain by
//! half the difference of the two, which is large where a flow starts with slip at a wall; only what is beyond counts. Where walls
//! move, which drive a flow through its viscous power, or viscosity is stiff, the powers do not tell what is taken, and nothing is said.
//!
//! Check: a flow that Adams-Bashforth feeds, one that Runge-Kutta damps more than viscosity does, and flows that are left alone.

use super::energy::LOOSE;
use crate::solver::flow::Flow;
use crate::solver::mesh::Wall;
use crate::solver::report::StepReport;
use crate::solver::settings::TimeScheme;

/// Steps over which is summed.
pub(super) const STEPS: u64 = 100;
/// Share of what viscosity and model take that is told of.
const NOTED: f64 = 0.1;
/// Less than this share of the energy in so many steps is nothing.
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
    /// What the powers do not explain: the error of the time step, and of the pressure solve \[m^5/s^3\].
    pub fn residual_m5_s3(&self) -> f64 {
        self.rate_m5_s3 - self.power_m5_s3
    }
}

/// What the time step itself did to the energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepEnergy {
    /// Sum of the residuals over what viscosity and subgrid model took: positive where the step feeds the flow; infinite where
    /// there is neither.
    pub share: f64,
    /// Courant number of the steps.
    pub courant: f64,
    /// The scheme.
    pub scheme: TimeScheme,
    /// Tolerance of the pressure equation, which feeds energy where it is loose.
    pub pressure_tolerance: f64,
}

impl StepEnergy {
    /// Courant number at which the share is well below a tenth: what waves that grow feed falls with the square at least, what Runge-Kutta
    /// takes about with the cube.
    pub fn suited_courant(&self) -> f64 {
        let part = 0.5 * NOTED / self.share.abs();
        let factor = if self.share > 0.0 { part.sqrt() } else { part.cbrt() };
        (100.0 * self.courant * factor).floor() / 100.0
    }
}

impl std::fmt::Display for StepEnergy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { pressure_tolerance, .. } = self;
        let does = if self.share > 0.0 { "feeds the flow with" } else { "takes" };
        if self.share.is_finite() {
            write!(f, "the time step {does} {:.2} times what viscosity and subgrid model take", self.share.abs())?;
        } else {
            write!(f, "the time step {does} energy, of which nothing else takes any,")?;
        }
        write!(f, " (energy_residual over {STEPS} steps at Courant number {:.2}): ", self.courant)?;
        if self.share > 0.0 && *pressure_tolerance > LOOSE {
            return write!(f, "the pressure tolerance {pressure_tolerance:e} leaves divergence, take 1e-8 or less");
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

/// Sums over the steps since the last one whose number is a multiple of [`STEPS`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Window {
    /// Residuals of the budgets \[m^5/s^3\].
    pub(super) fed_m5_s3: f64,
    /// What viscosity and model took \[m^5/s^3\].
    pub(super) taken_m5_s3: f64,
}

impl Window {
    /// Takes the budget that `report` closed, open with the power at its start and the mean of both ends.
    pub(super) fn add(&mut self, open: EnergyBudget, closed: EnergyBudget, report: &StepReport) {
        let residual = closed.residual_m5_s3();
        let uncertain = (closed.power_m5_s3 - open.power_m5_s3).abs();
        self.fed_m5_s3 += residual.signum() * (residual.abs() - uncertain).max(0.0);
        self.taken_m5_s3 += report.viscous_power_m5_s3.abs() + report.subgrid_power_m5_s3.abs();
    }

    /// What it adds up to after its last step, if that is more than a tenth of what viscosity and model took; then it is empty.
    pub(super) fn close(&mut self, flow: &Flow, report: &StepReport) -> Option<StepEnergy> {
        if !report.step.is_multiple_of(STEPS) {
            return None;
        }
        let Self { fed_m5_s3, taken_m5_s3 } = std::mem::take(self);
        let settings = flow.settings();
        let energy = StepEnergy {
            share: fed_m5_s3 / taken_m5_s3,
            courant: report.courant,
            scheme: settings.scheme,
            pressure_tolerance: settings.pressure_tolerance,
        };
        let mut walls = flow.mesh().directions().iter().flat_map(|d| d.ends.walls());
        let moves = |wall| matches!(wall, Wall::NoSlip { velocity_m_s } if velocity_m_s != [0.0; 3]);
        if walls.any(moves) || !flow.stiffness().is_resolved(report.step_s) {
            return None;
        }
        let negligible = if taken_m5_s3 > 0.0 { NEGLIGIBLE } else { UNDAMPED_NEGLIGIBLE };
        let is_seen = fed_m5_s3.abs() * report.step_s > negligible * report.kinetic_energy_m5_s2;
        (is_seen && energy.share.abs() > NOTED).then_some(energy)
    }
}
