//! Settings of a simulation besides its mesh and its initial field.

use std::sync::Arc;

use super::layout::Layout;
use super::mesh::{Mesh, refused};
use super::pressure::PressureMethod;
use super::subgrid::{self, SubgridModel};
use crate::error::{Error, check};
use crate::ranks::{Ranks, Single};

/// Growth in a step that is round-off.
pub(super) const ROUND_OFF: f64 = 1e-12;

/// Time integration of convection and subgrid stresses; viscosity is Crank-Nicolson along implicit
/// axes in both.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TimeScheme {
    /// Second-order Adams-Bashforth, (22): one pressure solve per step; the first step, which has
    /// no history, is one of Runge-Kutta.
    #[default]
    AdamsBashforth2,
    /// The low-storage Runge-Kutta scheme of three stages of Wray (Spalart, Moser and Rogers 1991):
    /// three pressure solves per step, about four times the step.
    RungeKutta3,
}

impl TimeScheme {
    /// Fraction of the time step and the weights of the new and of the old terms, stage by stage;
    /// `ratio` is the step over the one before, `None` where no old terms exist: then a step of
    /// Runge-Kutta needs none.
    pub(crate) fn stages(self, ratio: Option<f64>) -> Vec<Stage> {
        match (self, ratio) {
            (Self::AdamsBashforth2, Some(r)) => vec![Stage {
                fraction: 1.0,
                new: 1.0 + 0.5 * r,
                old: -0.5 * r,
            }],
            (Self::AdamsBashforth2, None) | (Self::RungeKutta3, _) => {
                vec![
                    Stage::from_weights(8.0 / 15.0, 0.0),
                    Stage::from_weights(5.0 / 12.0, -17.0 / 60.0),
                    Stage::from_weights(3.0 / 4.0, -5.0 / 12.0),
                ]
            }
        }
    }

    /// Courant number that the scheme runs at by default. Runge-Kutta lets no wave grow there;
    /// Adams-Bashforth lets all grow that viscosity does not damp
    /// ([`Stability`](super::Stability)): short runs or a smaller number without it.
    pub fn default_courant(self) -> f64 {
        match self {
            Self::AdamsBashforth2 => 0.35,
            Self::RungeKutta3 => 1.0,
        }
    }

    /// Largest product of step and decay rate at which terms integrated like convection are stable:
    /// the reach of the stability region along the real axis.
    pub(crate) fn largest_decay(self) -> f64 {
        match self {
            Self::AdamsBashforth2 => 1.0,
            Self::RungeKutta3 => 2.5,
        }
    }

    /// Growth of a wave of the mesh in a step, `ln |G|`, beyond which the step is refused. Under
    /// Adams-Bashforth some wave grows at any step without viscosity: what shows after hundreds of
    /// steps is noted, what spoils a flow in ten is refused.
    pub(crate) fn allowed_growth(self) -> f64 {
        match self {
            Self::AdamsBashforth2 => 0.1,
            Self::RungeKutta3 => ROUND_OFF,
        }
    }
}

/// One stage of a time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stage {
    pub(crate) fraction: f64,
    pub(crate) new: f64,
    pub(crate) old: f64,
}

impl Stage {
    /// The stage in which the new terms count for the fraction `gamma` of the step and the old
    /// ones for `zeta`.
    fn from_weights(gamma: f64, zeta: f64) -> Self {
        let fraction = gamma + zeta;
        Self {
            fraction,
            new: gamma / fraction,
            old: zeta / fraction,
        }
    }
}

/// How long a time step is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeStep {
    /// Always the same.
    Fixed {
        /// Time step \[s\].
        step_s: f64,
    },
    /// As long as a Courant number `dt max sum |u_i|/h_i` and a longest step allow; it grows by at
    /// most a tenth per step.
    Courant {
        /// Courant number.
        courant: f64,
        /// Longest step \[s\].
        longest_s: f64,
    },
}

impl TimeStep {
    /// Length of a step of a flow whose largest `sum |u_i|/h_i` is `courant_per_s` \[s\].
    pub fn step_s(self, courant_per_s: f64) -> f64 {
        match self {
            Self::Fixed { step_s } => step_s,
            Self::Courant { courant, longest_s } => longest_s.min(courant / courant_per_s),
        }
    }
}

/// The physical and numerical settings of a [`Flow`](super::Flow). Viscosity is implicit
/// (Crank-Nicolson with line solves) along the directions in which the first time step exceeds a
/// tenth of the explicit limit, and integrated as convection is along the others.
#[derive(Debug, Clone)]
pub struct FlowSettings {
    /// Kinematic viscosity \[m^2/s\]; zero is allowed between slip walls.
    pub viscosity_m2_s: f64,
    /// Body force per mass along x, y, z \[m/s^2\].
    pub force_m_s2: [f64; 3],
    /// Time integration.
    pub scheme: TimeScheme,
    /// Length of the time step.
    pub time_step: TimeStep,
    /// Which pressure solver.
    pub pressure: PressureMethod,
    /// Relative residual at which the pressure equation counts as solved.
    pub pressure_tolerance: f64,
    /// Subgrid model.
    pub subgrid: SubgridModel,
    /// The ranks that share the flow; one process by default. They change nothing of a
    /// result. All ranks must have the same settings but for their own number, and make the same
    /// calls.
    pub ranks: Arc<dyn Ranks>,
}

impl FlowSettings {
    /// The defaults for a viscosity and a way to step in time.
    pub fn new(viscosity_m2_s: f64, time_step: TimeStep) -> Self {
        Self {
            viscosity_m2_s,
            force_m_s2: [0.0; 3],
            scheme: TimeScheme::default(),
            time_step,
            pressure: PressureMethod::Auto,
            pressure_tolerance: 1e-10,
            subgrid: SubgridModel::None,
            ranks: Arc::new(Single),
        }
    }

    /// Refuses what a flow on `mesh` would refuse, before anything is allocated.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a setting, [`Error::BadDirection`] for no-slip walls without
    /// viscosity, [`Error::TooManyRanks`].
    pub fn validate(&self, mesh: &Mesh) -> Result<(), Error> {
        self.check()?;
        subgrid::filter_order(self.subgrid)?;
        Layout::new(mesh).shared(self.ranks.clone())?;
        refuse_sticking_without_viscosity(mesh, self.viscosity_m2_s)
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        check(
            "viscosity_m2_s",
            self.viscosity_m2_s,
            "finite and not negative",
            |nu| nu >= 0.0,
        )?;
        for force in self.force_m_s2 {
            check("force_m_s2", force, "finite", |_| true)?;
        }
        check(
            "pressure_tolerance",
            self.pressure_tolerance,
            "between 1e-15 and 0.1",
            |t| (1e-15..=0.1).contains(&t),
        )?;
        match self.time_step {
            TimeStep::Fixed { step_s } => {
                check("step_s", step_s, "finite and positive", |dt| dt > 0.0)?
            }
            TimeStep::Courant { courant, longest_s } => {
                check("courant", courant, "finite and positive", |c| c > 0.0)?;
                check("longest_s", longest_s, "finite and positive", |dt| dt > 0.0)?;
            }
        }
        Ok(())
    }
}

/// Without viscosity nothing can stick to a wall.
pub(super) fn refuse_sticking_without_viscosity(
    mesh: &Mesh,
    viscosity_m2_s: f64,
) -> Result<(), Error> {
    let found = (0..3).find(|&axis| mesh.directions()[axis].ends.no_slip() != [false; 2]);
    let Some(axis) = found.filter(|_| viscosity_m2_s == 0.0) else {
        return Ok(());
    };
    let allowed = "positive: an inviscid flow cannot stick to a wall, so make it a slip wall";
    Err(refused(
        axis,
        "no-slip wall with viscosity_m2_s",
        0.0,
        allowed,
    ))
}
