//! The simulation: state, time step, what a step reports.
//!
//! One stage of a step is (22)-(24) in delta form,
//! `(1 - nu dt/2 L)(u* - u) = dt [c N + c' N' - grad p + nu L u]`, `div grad phi = div u*/dt`,
//! `u = u* - dt grad phi`, `p += phi`, with `N` the convection, the subgrid stress, the force and
//! the explicit viscosity, and `N'` those of the stage before, the only history that is kept. The
//! boundary values of `u*` are those of the walls; the slip that `grad phi` leaves is of second
//! order in the time step and is not reset, which would bring divergence back.
//!
//! Check: energy and momentum without viscosity, orders in space and time, exact solutions, bits
//! against threads and restart.

use momentum_rhs::Prediction;
use rayon::prelude::*;

mod momentum_rhs;
mod project;

use super::component_operators::ComponentOperators;
use super::implicit::{LineSolver, solvers_for_stage};
use super::layout::{Layout, Shape};
use super::mesh::Mesh;
use super::pressure::{PressureSolver, Solved, accept_round_off};
use super::projection::{Divergence, correct, weighted_dot};
use super::report::{Powers, StepReport};
use super::settings::{FlowSettings, Stage, TimeScheme, refuse_sticking_without_viscosity};
use super::stiffness::{implicit_axes, viscous_rates_per_s};
use super::subgrid::Subgrid;
use crate::Error;
use crate::solver::aligned::Aligned;

/// An incompressible flow that is being simulated.
#[derive(Debug)]
pub struct Flow {
    pub(super) mesh: Mesh,
    pub(super) settings: FlowSettings,
    pub(crate) layout: Layout,
    pub(super) ops: [ComponentOperators; 3],
    pub(super) divergence: Divergence,
    pressure_solver: PressureSolver,
    pub(super) model: Option<Subgrid>,
    /// Viscosity times the implicit part of the last stages \[m^2\], with the factors for it.
    line_solvers: Vec<(f64, Vec<LineSolver>)>,
    /// Largest decay rate of the viscous term along each memory axis \[1/s\].
    pub(super) viscous_per_s: [f64; 3],
    pub(super) predicted: [Aligned; 3],
    pub(super) phi: Aligned,
    pub(crate) state: State,
}

/// What a simulation carries from step to step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct State {
    pub(crate) velocity: [Aligned; 3],
    pub(crate) previous_terms: [Aligned; 3],
    pub(crate) pressure: Aligned,
    pub(crate) time_s: f64,
    pub(crate) step: u64,
    /// Length of the last step, zero before the first.
    pub(crate) last_step_s: f64,
    /// Largest `sum |u_i|/h_i` of the present field.
    pub(crate) courant_per_s: f64,
    pub(crate) energy: f64,
    /// Memory axes along which viscosity is implicit.
    pub(crate) implicit: [bool; 3],
}

impl Flow {
    /// A simulation on `mesh` that starts from `initial(position_m) -> velocity_m_s`. The field is
    /// evaluated at the faces, projected onto divergence-free fields, and the pressure that belongs
    /// to it is computed. Also returns the kinetic energy of the initial field before its projection
    /// \[m^5/s^2\].
    ///
    /// # Errors
    /// Settings out of range, a mesh that the pressure solver cannot take, an initial field that is
    /// not finite.
    pub fn new(
        mesh: Mesh,
        settings: FlowSettings,
        initial: impl Fn([f64; 3]) -> [f64; 3] + Sync,
    ) -> Result<(Self, f64), Error> {
        Self::at_rest(mesh, settings)?.with_field(initial)
    }

    /// Starts from `initial(position_m) -> velocity_m_s`.
    pub(super) fn with_field(
        self,
        initial: impl Fn([f64; 3]) -> [f64; 3] + Sync,
    ) -> Result<(Self, f64), Error> {
        let direction = self.layout.direction;
        let at_m = [0, 1, 2].map(|axis| self.face_position_m(axis));
        self.with_face_velocity(|axis, index| initial(at_m[axis](index))[direction[axis]])
    }

    /// Starts from the velocity along each memory axis at the indices of its faces; nothing flows
    /// through walls.
    pub(super) fn with_face_velocity(
        mut self,
        velocity_m_s: impl Fn(usize, [usize; 3]) -> f64 + Sync,
    ) -> Result<(Self, f64), Error> {
        let shape = self.layout.shape;
        for axis in 0..3 {
            let first = self.layout.line[axis].first_face();
            let own = &mut self.state.velocity[axis][shape.own_range()];
            own.par_chunks_mut(shape.plane())
                .zip(shape.own())
                .for_each(|(plane, k)| {
                    for (place, value) in plane.iter_mut().enumerate() {
                        let index = [place % shape.n[0], place / shape.n[0], k];
                        *value = if index[axis] < first {
                            0.0
                        } else {
                            velocity_m_s(axis, index)
                        };
                    }
                });
        }
        let given_m5_s2 = self.start()?;
        Ok((self, given_m5_s2))
    }

    /// Where a component lies at the indices along the memory axes, x, y, z \[m\].
    pub(super) fn face_position_m(
        &self,
        axis: usize,
    ) -> impl Fn([usize; 3]) -> [f64; 3] + Sync + use<> {
        let direction = self.layout.direction;
        let along: [Vec<f64>; 3] = std::array::from_fn(|b| {
            if b == axis {
                self.mesh.face_m(direction[b])
            } else {
                self.mesh.centre_m(direction[b])
            }
        });
        move |index| {
            let mut at_m = [0.0; 3];
            (0..3).for_each(|b| at_m[direction[b]] = along[b][index[b]]);
            at_m
        }
    }

    /// All arrays zero; nothing projected yet.
    pub(crate) fn at_rest(mesh: Mesh, settings: FlowSettings) -> Result<Self, Error> {
        let layout = Layout::new(&mesh).shared(settings.ranks.clone())?;
        Self::with_layout(mesh, settings, layout)
    }

    /// All arrays zero, with the memory axes of a layout; nothing projected yet.
    pub(super) fn with_layout(
        mesh: Mesh,
        settings: FlowSettings,
        layout: Layout,
    ) -> Result<Self, Error> {
        settings.check()?;
        refuse_sticking_without_viscosity(&mesh, settings.viscosity_m2_s)?;
        let n = layout.shape.len();
        let viscous_per_s = viscous_rates_per_s(&mesh, settings.viscosity_m2_s);
        let state = State {
            velocity: zero_fields(n),
            previous_terms: zero_fields(n),
            pressure: Aligned::zeros(n),
            time_s: 0.0,
            step: 0,
            last_step_s: 0.0,
            courant_per_s: 0.0,
            energy: 0.0,
            implicit: [false; 3],
        };
        Ok(Self {
            ops: std::array::from_fn(|axis| ComponentOperators::new(&layout, axis)),
            divergence: Divergence::new(&layout),
            pressure_solver: PressureSolver::new(&layout, settings.pressure),
            model: Subgrid::new(&layout, settings.subgrid)?,
            line_solvers: Vec::new(),
            viscous_per_s: layout.direction.map(|d| viscous_per_s[d]),
            predicted: zero_fields(n),
            phi: Aligned::zeros(n),
            mesh,
            settings,
            layout,
            state,
        })
    }

    /// Projects the initial field, decides which directions are implicit, finds the pressure that
    /// keeps the field's acceleration free of divergence. Returns the kinetic energy before the
    /// projection \[m^5/s^2\].
    pub(crate) fn start(&mut self) -> Result<f64, Error> {
        if let (true, axis, place) = self.first_not_finite()? {
            return Err(self.diverged(axis, place, "initial velocity"));
        }
        let [given] = self.layout.slabs.sums(self.kinetic_energy())?;
        std::mem::swap(&mut self.state.velocity, &mut self.predicted);
        self.project(1.0)?;
        self.reproject(1.0, 0.0)?;
        let implicit = implicit_axes(&self.mesh, &self.settings, self.state.courant_per_s);
        self.state.implicit = self.layout.direction.map(|d| implicit[d]);
        // The pressure of the initial field belongs to the whole stress: there is no step yet that
        // could be too long. The terms are no history.
        self.update_model(1.0, 0.0)?;
        self.predict(Prediction {
            stage: Stage {
                fraction: 1.0,
                new: 1.0,
                old: 0.0,
            },
            stage_s: 1.0,
            is_increment: true,
            measures_powers: false,
        })?;
        for terms in &mut self.state.previous_terms {
            terms.fill(0.0);
        }
        self.set_poisson_source(1.0)?;
        let tolerance = self.settings.pressure_tolerance;
        let solved = self.pressure_solver.solve(&mut self.phi, tolerance);
        accept_round_off(solved)?;
        self.state.pressure.copy_from_slice(&self.phi);
        Ok(given)
    }

    /// Makes one time step of the length that the settings give.
    ///
    /// # Errors
    /// [`Error::Diverged`] and [`Error::CourantTooLarge`] name the step, the component and the
    /// place; the pressure solver may fail to converge. The state is then that of a failed step: go
    /// back to a checkpoint.
    pub fn step(&mut self) -> Result<StepReport, Error> {
        let step_s = self.next_step_s();
        self.step_by(step_s)
    }

    /// Makes time steps until `end_s` \[s\].
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn run_to(&mut self, end_s: f64) -> Result<(), Error> {
        while self.state.time_s < end_s {
            self.step_towards(end_s)?;
        }
        Ok(())
    }

    /// Makes one time step, shortened if it would pass `end_s`; steps are evened out so that no
    /// sliver is left.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_towards(&mut self, end_s: f64) -> Result<StepReport, Error> {
        let remaining_s = end_s - self.state.time_s;
        let full_step_s = self.next_step_s();
        let steps = (remaining_s / full_step_s - 1e-6).ceil().max(1.0);
        // Far from the end the full step is taken.
        let step_s = if steps > 8.0 {
            full_step_s
        } else {
            remaining_s / steps
        };
        let mut report = self.step_by(step_s)?;
        if steps == 1.0 {
            self.state.time_s = end_s;
            report.time_s = end_s;
        }
        Ok(report)
    }

    fn step_by(&mut self, step_s: f64) -> Result<StepReport, Error> {
        let courant = step_s * self.state.courant_per_s;
        self.check_courant(courant, step_s)?;
        let (powers, solved) = self.advance(step_s)?;
        let [viscous_power_m5_s3, subgrid_power_m5_s3, force_power_m5_s3] = powers;
        self.state.step += 1;
        self.state.time_s += step_s;
        self.state.last_step_s = step_s;
        if !self.state.energy.is_finite() {
            let (_, axis, place) = self.first_not_finite()?;
            return Err(self.diverged(axis, place, "velocity"));
        }
        let [subgrid_viscosity_m2_s, decay_per_s] = self
            .model
            .as_ref()
            .map(|model| model.largest)
            .unwrap_or_default();
        Ok(StepReport {
            step: self.state.step,
            time_s: self.state.time_s,
            step_s,
            courant,
            kinetic_energy_m5_s2: self.state.energy,
            viscous_power_m5_s3,
            subgrid_power_m5_s3,
            force_power_m5_s3,
            subgrid_viscosity_m2_s,
            subgrid_decay: step_s * decay_per_s,
            pressure_iterations: solved.map_or(0, |s| s.iterations),
            pressure_residual: solved.map(|s| s.residual),
            pressure_factor: solved.and_then(|s| s.factor),
        })
    }

    /// The stages of a step: each predicts the velocity, solves for implicit viscosity, projects,
    /// and adds the pressure. Returns the powers of the field that the step started from, and the
    /// last solution of the pressure.
    fn advance(&mut self, step_s: f64) -> Result<(Powers, Option<Solved>), Error> {
        let has_history = self.state.last_step_s > 0.0;
        let ratio = has_history.then(|| step_s / self.state.last_step_s);
        let is_increment = self.state.implicit != [false; 3];
        // The first step of Adams-Bashforth is one of Runge-Kutta, after which the history is the
        // terms of the initial field.
        let takes_first_terms = self.settings.scheme == TimeScheme::AdamsBashforth2 && !has_history;
        let mut powers = Powers::default();
        let mut first_terms = None;
        let mut solved = None;
        for (number, stage) in self.settings.scheme.stages(ratio).into_iter().enumerate() {
            let is_first = number == 0;
            let stage_s = stage.fraction * step_s;
            self.update_model(stage.fraction, stage_s)?;
            let stage_powers = self.predict(Prediction {
                stage,
                stage_s,
                is_increment,
                measures_powers: is_first,
            })?;
            if is_first {
                powers = stage_powers;
                first_terms = takes_first_terms.then(|| self.state.previous_terms.clone());
            }
            self.solve_viscous(stage_s * self.settings.viscosity_m2_s)?;
            solved = Some(self.project(stage_s)?);
            // (25).
            add(&mut self.state.pressure, &self.phi, self.layout.shape);
        }
        if let Some(first_terms) = first_terms {
            self.state.previous_terms = first_terms;
        }
        Ok((powers, solved))
    }

    /// Takes `nu_s_m2`, viscosity times the stage, along the implicit axes: solves for the
    /// increments by Crank-Nicolson and adds the velocity.
    fn solve_viscous(&mut self, nu_s_m2: f64) -> Result<(), Error> {
        let Self {
            state,
            layout,
            ops,
            predicted,
            ..
        } = self;
        if state.implicit == [false; 3] {
            return Ok(());
        }
        let a_m2 = 0.5 * nu_s_m2;
        let own = layout.shape.own_range();
        for solver in solvers_for_stage(&mut self.line_solvers, ops, state.implicit, a_m2) {
            let predicted = &mut predicted[solver.component];
            solver.solve(&layout.slabs, &mut predicted[own.clone()])?;
        }
        for (predicted, velocity) in predicted.iter_mut().zip(&state.velocity) {
            add(
                &mut predicted[own.clone()],
                &velocity[own.clone()],
                layout.shape,
            );
        }
        Ok(())
    }

    /// Kinetic energy of each plane that is owned.
    fn kinetic_energy(&self) -> Vec<[f64; 1]> {
        let shape = self.layout.shape;
        let mut planes = Vec::with_capacity(shape.own().len());
        for k in shape.own() {
            let mut energy = 0.0;
            for component in 0..3 {
                let rows = 0..shape.n[1];
                energy += rows.map(|j| self.row_energy(component, j, k)).sum::<f64>();
            }
            planes.push([energy]);
        }
        planes
    }

    /// Kinetic energy of one row of a component.
    fn row_energy(&self, component: usize, j: usize, k: usize) -> f64 {
        let row = &self.state.velocity[component][self.layout.shape.row(j, k)];
        let (across, along) = self.ops[component].row_mass(j, k);
        0.5 * across * weighted_dot(row, row, along)
    }
}

/// Three fields of zeros.
fn zero_fields(length: usize) -> [Aligned; 3] {
    std::array::from_fn(|_| Aligned::zeros(length))
}

/// `to += from`, plane by plane.
fn add(to: &mut [f64], from: &[f64], shape: Shape) {
    let planes = to
        .par_chunks_mut(shape.plane())
        .zip(from.par_chunks(shape.plane()));
    planes.for_each(|(to, from)| to.iter_mut().zip(from).for_each(|(to, from)| *to += from));
}

#[cfg(test)]
#[path = "flow_tests.rs"]
mod tests;
