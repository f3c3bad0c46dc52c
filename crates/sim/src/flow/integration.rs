//! How a case has its flow integrated: pressure, subgrid model, scheme and steps.

use super::case::{FlowCase, Subgrid};
use super::setup::Setup;
use crate::Error;
use std::path::Path;
use wakescope_les::{SubgridModel, TimeScheme, TimeStep};

impl Setup {
    /// The setup of a case whose file lies in `folder`.
    pub(super) fn new(case: &FlowCase, folder: &Path) -> Result<Self, Error> {
        let mut setup = case.case.setup(folder)?;
        let s = &mut setup.settings;
        let solver = &case.solver;
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
