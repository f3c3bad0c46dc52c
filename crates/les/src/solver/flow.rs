//! The simulation: state, time step, what a step reports.
//!
//! One stage of a step is (22)-(24) in delta form,
//! `(1 - nu dt/2 L)(u* - u) = dt [c N + c' N' - grad p + nu L u]`, `div grad phi = div u*/dt`, `u = u* - dt grad phi`, `p += phi`,
//! with `N` the convection, the subgrid stress, the force and the explicit viscosity, and `N'` those of the stage before, the
//! only history that is kept. The boundary values of `u*` are those of the walls; the slip that `grad phi` leaves is of second
//! order in the time step and is not reset, which would bring divergence back.
//!
//! Check: energy and momentum without viscosity, orders in space and time, exact solutions, bits against threads and restart.

use rayon::prelude::*;

mod project;

use super::implicit::LineSolver;
use super::layout::{Layout, Shape};
use super::mesh::Mesh;
use super::momentum::{Momentum, Scratch, add_laplacian_row};
use super::pressure::{PressureSolver, Solved};
use super::projection::{Divergence, correct, weighted_dot};
use super::report::{StartReport, StepReport};
use super::settings::{FlowSettings, Stage, TimeScheme, refuse_sticking_without_viscosity};
use super::slabs::WHOLE;
use super::stage::{Powers, Task, blocks};
use super::subgrid::{Lent, Subgrid};
use crate::Error;
use crate::solver::aligned::Aligned;

/// Share of the explicit limit beyond which the subgrid viscosity is cut. In the core of a vortex WALE's viscosity has no
/// work to do but would make an explicit step unstable; the cut keeps the step that convection allows.
const SUBGRID_SHARE: f64 = 0.8;

/// An incompressible flow that is being simulated.
#[derive(Debug)]
pub struct Flow {
    pub(super) mesh: Mesh,
    pub(super) settings: FlowSettings,
    pub(crate) layout: Layout,
    ops: [Momentum; 3],
    pub(super) divergence: Divergence,
    pressure_solver: PressureSolver,
    pub(super) model: Option<Subgrid>,
    line_solvers: Vec<(f64, Vec<(usize, LineSolver)>)>,
    work: Work,
    pub(crate) state: State,
}

/// What a simulation carries from step to step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct State {
    pub(crate) velocity: [Aligned; 3],
    pub(crate) history: [Aligned; 3],
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

#[derive(Debug, Default)]
struct Work {
    star: [Aligned; 3],
    phi: Aligned,
}

impl Flow {
    /// A simulation on `mesh` that starts from `initial(position_m) -> velocity_m_s`. The field is evaluated at the
    /// faces, projected onto divergence-free fields, and the pressure that belongs to it is computed.
    ///
    /// # Errors
    /// Settings out of range, a mesh that the pressure solver cannot take, an initial field that is not finite.
    pub fn new(
        mesh: Mesh,
        settings: FlowSettings,
        initial: impl Fn([f64; 3]) -> [f64; 3] + Sync,
    ) -> Result<(Self, StartReport), Error> {
        Self::at_rest(mesh, settings)?.filled(initial)
    }

    /// Starts from `initial`.
    fn filled(mut self, initial: impl Fn([f64; 3]) -> [f64; 3] + Sync) -> Result<(Self, StartReport), Error> {
        for axis in 0..3 {
            let layout = &self.layout;
            let direction = layout.direction;
            let position: [Vec<f64>; 3] = std::array::from_fn(|b| {
                let d = direction[b];
                if b == axis { self.mesh.face_m(d) } else { self.mesh.centre_m(d) }
            });
            let (n0, shape) = (layout.shape.n[0], layout.shape);
            let first = layout.line[axis].first_face();
            let own = &mut self.state.velocity[axis][shape.own_places()];
            own.par_chunks_mut(shape.plane()).zip(shape.own()).for_each(|(plane, k)| {
                for (place, value) in plane.iter_mut().enumerate() {
                    let index = [place % n0, place / n0, k];
                    let mut at_m = [0.0; 3];
                    for b in 0..3 {
                        at_m[direction[b]] = position[b][index[b]];
                    }
                    *value = if index[axis] < first { 0.0 } else { initial(at_m)[direction[axis]] };
                }
            });
        }
        let report = self.start()?;
        Ok((self, report))
    }

    /// All arrays zero; nothing projected yet.
    pub(crate) fn at_rest(mesh: Mesh, settings: FlowSettings) -> Result<Self, Error> {
        let layout = Layout::on(&mesh, settings.ranks.clone())?;
        Self::laid_out(mesh, settings, layout)
    }

    /// The same with the memory axes of a layout.
    fn laid_out(mesh: Mesh, settings: FlowSettings, layout: Layout) -> Result<Self, Error> {
        settings.check()?;
        refuse_sticking_without_viscosity(&mesh, settings.viscosity_m2_s)?;
        let n = layout.shape.len();
        let field = || Aligned::zeros(n);
        let fields = || [field(), field(), field()];
        let state = State {
            velocity: fields(),
            history: fields(),
            pressure: field(),
            time_s: 0.0,
            step: 0,
            last_step_s: 0.0,
            courant_per_s: 0.0,
            energy: 0.0,
            implicit: [false; 3],
        };
        Ok(Self {
            ops: std::array::from_fn(|axis| Momentum::new(&layout, axis)),
            divergence: Divergence::new(&layout),
            pressure_solver: PressureSolver::new(&layout, settings.pressure),
            model: Subgrid::new(&layout, settings.subgrid)?,
            line_solvers: Vec::new(),
            work: Work { star: fields(), phi: field() },
            mesh,
            settings,
            layout,
            state,
        })
    }

    /// Projects the initial field, finds its pressure, decides which directions are implicit.
    pub(crate) fn start(&mut self) -> Result<StartReport, Error> {
        let slabs = self.layout.slabs.clone();
        if let (true, axis, place) = self.first_not_finite()? {
            return Err(self.diverged(axis, place, "initial velocity"));
        }
        let [given] = slabs.sums(self.kinetic_energy())?;
        std::mem::swap(&mut self.state.velocity, &mut self.work.star);
        self.project(1.0)?;
        self.repeat(1.0, 0.0)?;
        self.state.implicit = self.choose_implicit();
        // The pressure that belongs to the field: that which keeps its acceleration free of divergence.
        let summary = (self.state.energy, self.state.courant_per_s);
        self.accelerations()?;
        // The fields of the history, which begins with the first step, keep the velocity meanwhile.
        std::mem::swap(&mut self.state.velocity, &mut self.state.history);
        self.project(1.0)?;
        std::mem::swap(&mut self.state.pressure, &mut self.work.phi);
        std::mem::swap(&mut self.state.velocity, &mut self.state.history);
        self.state.history.iter_mut().for_each(|terms| terms.fill(0.0));
        (self.state.energy, self.state.courant_per_s) = summary;
        Ok(StartReport { given_energy_m5_s2: given, kinetic_energy_m5_s2: self.state.energy })
    }

    /// Makes one time step of the length that the settings give.
    ///
    /// # Errors
    /// [`Error::Diverged`] and [`Error::CourantTooLarge`] name the step, the component and the place; the pressure solver
    /// may fail to converge. The state is then that of a failed step: go back to a checkpoint.
    pub fn step(&mut self) -> Result<StepReport, Error> {
        let step_s = self.next_step_s();
        self.step_by(step_s)
    }

    /// Makes one time step, shortened if it would pass `end_s`; steps are evened out so that no sliver is left.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_towards(&mut self, end_s: f64) -> Result<StepReport, Error> {
        let left_s = end_s - self.state.time_s;
        let step_s = self.next_step_s();
        let steps = (left_s / step_s - 1e-6).ceil().max(1.0);
        // Far from the end the full step is taken.
        let step_s = if steps > 8.0 { step_s } else { left_s / steps };
        let mut report = self.step_by(step_s)?;
        if steps == 1.0 {
            self.state.time_s = end_s;
            report.time_s = end_s;
        }
        Ok(report)
    }

    fn step_by(&mut self, step_s: f64) -> Result<StepReport, Error> {
        let courant = step_s * self.state.courant_per_s;
        self.refuse_courant(courant, step_s)?;
        let ratio = (self.state.last_step_s > 0.0).then(|| step_s / self.state.last_step_s);
        let is_damped = self.state.step < self.settings.damped_steps;
        // Adams-Bashforth starts with a step of Runge-Kutta and then wants the terms of the initial field.
        let starting = self.settings.scheme == TimeScheme::AdamsBashforth2 && ratio.is_none();
        let mut first_terms = None;
        let mut powers = None;
        let mut solved = None;
        for stage in self.settings.scheme.stages(ratio) {
            let stage_s = stage.fraction * step_s;
            // The report tells the powers of the field that the step began with.
            let first = powers.is_none();
            let found = self.increments(&stage, stage_s, first, is_damped)?;
            if first && starting {
                first_terms = Some(self.state.history.clone());
            }
            powers.get_or_insert(found);
            self.solve_lines(stage_s * self.settings.viscosity_m2_s, is_damped)?;
            solved = Some(self.project(stage_s)?);
            self.add_pressure();
        }
        if let Some(terms) = first_terms {
            self.state.history = terms;
        }
        self.state.step += 1;
        self.state.time_s += step_s;
        self.state.last_step_s = step_s;
        if !self.state.energy.is_finite() {
            let (_, axis, place) = self.first_not_finite()?;
            return Err(self.diverged(axis, place, "velocity"));
        }
        let powers = powers.unwrap_or_default();
        Ok(StepReport {
            step: self.state.step,
            time_s: self.state.time_s,
            step_s,
            courant,
            kinetic_energy_m5_s2: self.state.energy,
            viscous_power_m5_s3: powers[0],
            subgrid_power_m5_s3: powers[1],
            force_power_m5_s3: powers[2],
            subgrid_viscosity_m2_s: self.model.as_ref().map_or(0.0, Subgrid::max_viscosity_m2_s),
            subgrid_decay: step_s * self.model.as_ref().map_or(0.0, Subgrid::max_decay_per_s),
            pressure_iterations: solved.map_or(0, |s| s.iterations),
            pressure_residual: solved.map(|s| s.residual),
            pressure_factor: solved.and_then(|s| s.factor),
        })
    }

    /// The right side of (22) into `star`, or the velocity with all but implicit viscosity if no line solve follows or a damped one;
    /// the work of its terms if `measured`.
    fn increments(&mut self, stage: &Stage, stage_s: f64, measured: bool, is_damped: bool) -> Result<Powers, Error> {
        let explicit_per_s = self.settings.scheme.largest_decay() * stage.fraction / stage_s;
        self.update_model((SUBGRID_SHARE * explicit_per_s - self.explicit_viscous_rate_per_s()).max(0.0))?;
        let shape = self.layout.shape;
        let (task, star, history) = self.task();
        let keep = if is_damped || task.implicit == [false; 3] { 1.0 } else { 0.0 };
        let powers: Vec<[Powers; 3]> = blocks(shape, star, history)
            .into_par_iter()
            .map_init(
                || std::array::from_fn(|_| Scratch::new(shape.n[0])),
                |scratch, block| task.increments(block, (stage, stage_s, keep, measured), scratch),
            )
            .collect();
        let mut total = Powers::default();
        if measured {
            // Those of each plane, component after component, then of all.
            let of_plane = |k| -> [f64; 9] {
                let blocks = || powers.iter().skip(k).step_by(shape.own().len());
                std::array::from_fn(|i| blocks().map(|powers| powers[i / 3][i % 3]).sum())
            };
            let planes = self.layout.slabs.planes((0..shape.own().len()).map(of_plane).collect())?;
            for (component, plane) in (0..3).flat_map(|component| planes.iter().map(move |plane| (component, plane))) {
                total = std::array::from_fn(|i| total[i] + plane[3 * component + i]);
            }
        }
        Ok(total)
    }

    /// The acceleration by everything but pressure into `star`.
    fn accelerations(&mut self) -> Result<(), Error> {
        // The pressure of the initial field belongs to the whole stress: there is no step yet that could be too long.
        self.update_model(f64::INFINITY)?;
        let shape = self.layout.shape;
        let (task, star, _) = self.task();
        for (axis, star) in star.iter_mut().enumerate() {
            let planes = star[shape.own_places()].par_chunks_mut(shape.plane()).zip(shape.own());
            planes.for_each_init(
                || Scratch::new(shape.n[0]),
                |scratch, (star, k)| task.accelerations([axis, k], star, scratch),
            );
        }
        Ok(())
    }

    /// The viscosity of the model for the present field, at most such that it decays by `limit_per_s`; a part of its acceleration
    /// into `star`.
    fn update_model(&mut self, limit_per_s: f64) -> Result<(), Error> {
        let Self { state, work, pressure_solver, model: Some(model), .. } = self else { return Ok(()) };
        let lent = Lent { in_plane: &mut work.star, small: [&mut work.phi, pressure_solver.spare()] };
        model.update(state.velocity.each_ref().map(Aligned::as_slice), limit_per_s, lent)
    }

    /// What the momentum equation reads, and what it writes: `star` and the history.
    fn task(&mut self) -> (Task<'_>, &mut [Aligned; 3], &mut [Aligned; 3]) {
        let Self { ops, state, work, model, layout, settings, .. } = self;
        let task = Task {
            layout,
            ops,
            velocity: state.velocity.each_ref().map(Aligned::as_slice),
            pressure: &state.pressure,
            model: model.as_ref(),
            viscosity_m2_s: settings.viscosity_m2_s,
            force_m_s2: layout.direction.map(|d| settings.force_m_s2[d]),
            implicit: state.implicit,
        };
        (task, &mut work.star, &mut state.history)
    }

    /// Takes `nu_s_m2`, viscosity times the stage, along the implicit axes: solves for the increments by Crank-Nicolson and adds the
    /// velocity, or by backward Euler along one axis after the other. The factored increments of backward Euler would leave waves
    /// that are stiff along two axes as they are, `1 - (d1 + d2)/((1 + d1) (1 + d2))`; one after the other it is
    /// `1/((1 + d1) (1 + d2))`.
    fn solve_lines(&mut self, nu_s_m2: f64, is_damped: bool) -> Result<(), Error> {
        if self.state.implicit == [false; 3] {
            return Ok(());
        }
        let a_m2 = if is_damped { nu_s_m2 } else { 0.5 * nu_s_m2 };
        if !self.line_solvers.iter().any(|(a, _)| *a == a_m2) {
            // A fixed step has at most three stages of different length; a variable one always needs new factors.
            self.line_solvers.truncate(2);
            let implicit = self.state.implicit;
            let solvers = (0..3)
                .flat_map(|component| (0..3).filter(|&axis| implicit[axis]).map(move |axis| (component, axis)))
                .map(|(component, axis)| (component, LineSolver::new(&self.ops[component], axis, a_m2)))
                .collect();
            self.line_solvers.insert(0, (a_m2, solvers));
        }
        let Some((_, solvers)) = self.line_solvers.iter().find(|(a, _)| *a == a_m2) else { return Ok(()) };
        let own = self.layout.shape.own_places();
        let Work { star, phi, .. } = &mut self.work;
        for (component, solver) in solvers {
            if !is_damped {
                solver.solve(&self.layout.slabs, &mut star[*component][own.clone()])?;
                continue;
            }
            self.layout.slabs.halos(&mut [&mut star[*component]], WHOLE)?;
            viscous_increment(&self.layout, &self.ops[*component], (solver.axis, a_m2), &star[*component], phi);
            solver.solve(&self.layout.slabs, &mut phi[own.clone()])?;
            add(&mut star[*component], phi, self.layout.shape);
        }
        if is_damped {
            return Ok(());
        }
        for (star, velocity) in self.work.star.iter_mut().zip(&self.state.velocity) {
            add(&mut star[own.clone()], &velocity[own.clone()], self.layout.shape);
        }
        Ok(())
    }

    /// (25).
    fn add_pressure(&mut self) {
        add(&mut self.state.pressure, &self.work.phi, self.layout.shape);
    }

    /// Kinetic energy of each plane that is owned.
    fn kinetic_energy(&self) -> Vec<[f64; 1]> {
        let shape = self.layout.shape;
        let of_row = |component: usize, j: usize, k: usize| {
            let row = &self.state.velocity[component][shape.row(j, k)];
            let (across, along) = self.ops[component].row_mass(j, k);
            0.5 * across * weighted_dot(row, row, along)
        };
        let of_plane = |k| [(0..3).map(|a| (0..shape.n[1]).map(|j| of_row(a, j, k)).sum::<f64>()).sum::<f64>()];
        shape.own().map(of_plane).collect()
    }
}

/// `a L field` along one axis for one component into `out`; zero on walls.
fn viscous_increment(layout: &Layout, ops: &Momentum, (axis, a_m2): (usize, f64), field: &[f64], out: &mut [f64]) {
    let (shape, n) = (layout.shape, layout.shape.n[0]);
    let starts_at_wall = ops.axis == 0 && layout.line[0].first_face() == 1;
    let planes = out[shape.own_places()].par_chunks_mut(shape.plane()).zip(shape.own());
    planes.for_each_init(
        || Scratch::new(n),
        |scratch, (plane, k)| {
            for (j, row) in plane.chunks_mut(n).enumerate() {
                row.fill(0.0);
                if !ops.is_wall_row(j, k) {
                    add_laplacian_row(ops, field, axis, j, k, row, &mut scratch.padded[0]);
                }
                row.iter_mut().for_each(|value| *value *= a_m2);
                if starts_at_wall {
                    row[0] = 0.0;
                }
            }
        },
    );
}

/// `to += from`, plane by plane.
fn add(to: &mut [f64], from: &[f64], shape: Shape) {
    let planes = to.par_chunks_mut(shape.plane()).zip(from.par_chunks(shape.plane()));
    planes.for_each(|(to, from)| to.iter_mut().zip(from).for_each(|(to, from)| *to += from));
}

#[cfg(test)]
impl Flow {
    /// As [`Self::new`], with the directions of the memory axes given.
    pub(crate) fn in_order(
        direction: [usize; 3],
        mesh: Mesh,
        settings: FlowSettings,
        initial: &super::cases::Initial,
    ) -> Result<Self, Error> {
        let layout = Layout::on_in_order(&mesh, settings.ranks.clone(), direction)?;
        let flow = Self::laid_out(mesh, settings, layout)?;
        let started = match initial {
            super::cases::Initial::Field(field) => flow.filled(field),
            super::cases::Initial::Faces(faces) => flow.with_faces(faces.each_ref().map(Vec::as_slice)),
        };
        started.map(|(flow, _)| flow)
    }
}

#[cfg(test)]
#[path = "flow_tests.rs"]
mod tests;
