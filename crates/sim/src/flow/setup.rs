//! All that a simulation is made of: the flow of a case, how the case has it integrated, and its start.

use super::case::{FlowCase, Subgrid};
use crate::Error;
use std::path::Path;
use wakescope_les::analysis::{WakeMeter, WakeScales};
pub(super) use wakescope_les::cases::Initial;
use wakescope_les::solver::{Stability, StartReport, UndampedGrowth};
use wakescope_les::{Flow, FlowSettings, Mesh, SubgridModel, TimeScheme, TimeStep};

/// All that a simulation is made of.
pub(super) struct Setup {
    pub(super) mesh: Mesh,
    pub(super) settings: FlowSettings,
    pub(super) initial: Initial,
    /// The case's own end \[s\].
    pub(super) end_s: Option<f64>,
    /// Age of the wake per time \[1/s\]; 1 where there is no wake.
    pub(super) tau_per_s: f64,
    /// What a wake is measured by.
    pub(super) wake: Option<WakeSetup>,
    /// Waves for which Runge-Kutta was taken in place of Adams-Bashforth.
    pub(super) undamped: Option<UndampedGrowth>,
}

/// The meter of a wake and its scales.
pub(super) struct WakeSetup {
    pub(super) meter: WakeMeter,
    /// Radii between which the circulation is averaged \[m\].
    pub(super) circulation_radii_m: [f64; 2],
    pub(super) scales: WakeScales,
    /// Core radius at the start \[m\].
    pub(super) core_radius_m: f64,
}

impl Setup {
    /// The setup of a case whose file lies in `folder`.
    pub(super) fn new(case: &FlowCase, folder: &Path) -> Result<Self, Error> {
        let mut setup = case.case.setup(folder)?;
        let (s, solver) = (&mut setup.settings, &case.solver);
        s.pressure = solver.pressure;
        s.pressure_tolerance = solver.pressure_tolerance;
        s.subgrid = subgrid(solver.subgrid);
        match case.time.scheme {
            Some(scheme) => setup.integrate(case, scheme),
            None => {
                setup.integrate(case, setup.settings.scheme);
                // What a model will take is not known at the start.
                let stability = setup.stability();
                setup.undamped = stability.undamped(stability.first_step_s());
                if setup.undamped.is_some() {
                    setup.integrate(case, TimeScheme::RungeKutta3);
                }
            }
        }
        Ok(setup)
    }

    /// Takes a scheme, with the steps that the case asks of it.
    fn integrate(&mut self, case: &FlowCase, scheme: TimeScheme) {
        let s = &mut self.settings;
        s.time_step = time_step(case, s.time_step, s.scheme != scheme, scheme);
        s.scheme = scheme;
    }

    /// The same flow with the other scheme.
    pub(super) fn with_other_scheme(mut self, case: &FlowCase) -> Self {
        let other = match self.settings.scheme {
            TimeScheme::AdamsBashforth2 => TimeScheme::RungeKutta3,
            TimeScheme::RungeKutta3 => TimeScheme::AdamsBashforth2,
        };
        self.integrate(case, other);
        self
    }

    /// How the cells carry and damp the waves of the initial field.
    pub(super) fn stability(&self) -> Stability {
        Stability::of(&self.mesh, &self.settings, self.initial_velocity())
    }

    /// Velocity of the initial field in the cell of the indices along x, y, z: at its centre, or at its low faces.
    pub(super) fn initial_velocity(&self) -> impl Fn([usize; 3]) -> [f64; 3] + Sync {
        let centre_m = [0, 1, 2].map(|axis| self.mesh.centre_m(axis));
        let [nx, ny, _] = self.mesh.cells();
        move |cell| match &self.initial {
            Initial::Field(field) => field([0, 1, 2].map(|axis| centre_m[axis][cell[axis]])),
            Initial::Faces(faces) => faces
                .each_ref()
                .map(|face| face[(cell[2] * ny + cell[1]) * nx + cell[0]]),
        }
    }

    pub(super) fn start(self) -> Result<(Flow, StartReport), Error> {
        let Self {
            mesh,
            settings,
            initial,
            ..
        } = self;
        initial.start(mesh, settings).map_err(Error::Flow)
    }
}

fn time_step(case: &FlowCase, own: TimeStep, other_scheme: bool, scheme: TimeScheme) -> TimeStep {
    let time = case.time;
    if let Some(step_s) = time.step_s {
        return TimeStep::Fixed { step_s };
    }
    let (own_courant, own_longest_s) = match own {
        TimeStep::Courant { courant, longest_s } if !other_scheme => (courant, longest_s),
        TimeStep::Courant { longest_s, .. } => (scheme.default_courant(), longest_s),
        TimeStep::Fixed { step_s } => (scheme.default_courant(), step_s),
    };
    TimeStep::Courant {
        courant: time.courant.unwrap_or(own_courant),
        longest_s: time.longest_step_s.unwrap_or(own_longest_s),
    }
}

fn subgrid(choice: Subgrid) -> SubgridModel {
    match choice {
        Subgrid::None {} => SubgridModel::None,
        Subgrid::Smagorinsky { constant: None } => SubgridModel::SMAGORINSKY,
        Subgrid::Smagorinsky {
            constant: Some(constant),
        } => SubgridModel::Smagorinsky { constant },
        Subgrid::Wale { constant: None } => SubgridModel::WALE,
        Subgrid::Wale {
            constant: Some(constant),
        } => SubgridModel::Wale { constant },
        Subgrid::MultiscaleWale {
            constant: None,
            order: None,
        } => SubgridModel::MULTISCALE_WALE,
        Subgrid::MultiscaleWale { constant, order } => {
            // The constant of the order that gives WALE's dissipation with the constant of its authors.
            let order = order.unwrap_or(3);
            let constant =
                constant.unwrap_or_else(|| SubgridModel::multiscale_constant(0.5, order));
            SubgridModel::MultiscaleWale { constant, order }
        }
    }
}
