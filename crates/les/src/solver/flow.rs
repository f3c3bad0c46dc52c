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

use super::implicit::LineSolver;
use super::layout::Layout;
use super::mesh::{AXIS_NAMES, Ends, Mesh, Wall};
use super::momentum::{Momentum, Scratch};
use super::pressure::{self, PressureSolver, Solved};
use super::projection::{Divergence, correct, weighted_dot};
use super::settings::{FlowSettings, Stage, TimeScheme, TimeStep, ViscousTreatment};
use super::subgrid::Subgrid;
use crate::Error;

/// Largest symbol of the Laplacian times the square of the spacing.
const LAPLACIAN_SYMBOL: f64 = 49.0 / 9.0;
/// Share of the explicit viscous limit beyond which a direction is taken implicitly.
const IMPLICIT_SHARE: f64 = 0.1;
/// Largest share of the explicit viscous limit that a variable time step may use.
const EXPLICIT_SHARE: f64 = 0.5;
/// Largest growth of the time step from one step to the next.
const LARGEST_GROWTH: f64 = 1.1;

/// An incompressible flow that is being simulated.
#[derive(Debug)]
pub struct Flow {
    mesh: Mesh,
    settings: FlowSettings,
    pub(crate) layout: Layout,
    ops: [Momentum; 3],
    divergence: Divergence,
    pressure_solver: Box<dyn PressureSolver>,
    model: Option<Subgrid>,
    line_solvers: Vec<(f64, Vec<(usize, LineSolver)>)>,
    work: Work,
    pub(crate) state: State,
}

/// What a simulation carries from step to step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct State {
    pub(crate) velocity: [Vec<f64>; 3],
    pub(crate) history: [Vec<f64>; 3],
    pub(crate) pressure: Vec<f64>,
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
    star: [Vec<f64>; 3],
    phi: Vec<f64>,
    /// Weighted divergence, kept for the rotational form.
    divergence: Vec<f64>,
}

/// What one step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// Number of the step, from 1.
    pub step: u64,
    /// Time after the step \[s\].
    pub time_s: f64,
    /// Length of the step \[s\].
    pub step_s: f64,
    /// Courant number `dt max sum |u_i|/h_i` of the field that the step started from.
    pub courant: f64,
    /// Kinetic energy after the step, integral of `u^2/2` \[m^5/s^2\].
    pub kinetic_energy_m5_s2: f64,
    /// Power of the viscous term at the start of the step, negative where it dissipates \[m^5/s^3\].
    pub viscous_power_m5_s3: f64,
    /// Power of the subgrid stress at the start of the step \[m^5/s^3\].
    pub subgrid_power_m5_s3: f64,
    /// Power of the body force at the start of the step \[m^5/s^3\].
    pub force_power_m5_s3: f64,
    /// Largest subgrid viscosity \[m^2/s\].
    pub subgrid_viscosity_m2_s: f64,
    /// Iterations of the last pressure solve; 0 of the direct solver.
    pub pressure_iterations: usize,
    /// Relative residual of the last pressure solve, where it was measured.
    pub pressure_residual: Option<f64>,
    /// Mean reduction of the residual per iteration.
    pub pressure_factor: Option<f64>,
}

/// What the projection of the initial field changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartReport {
    /// Kinetic energy of the field given \[m^5/s^2\].
    pub given_energy_m5_s2: f64,
    /// Kinetic energy after the projection \[m^5/s^2\].
    pub kinetic_energy_m5_s2: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Powers {
    viscous: f64,
    subgrid: f64,
    force: f64,
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
        let mut flow = Self::at_rest(mesh, settings)?;
        for axis in 0..3 {
            let layout = &flow.layout;
            let direction = layout.direction;
            let position: [Vec<f64>; 3] = std::array::from_fn(|b| {
                let d = direction[b];
                if b == axis { flow.mesh.face_m(d) } else { flow.mesh.centre_m(d) }
            });
            let [n0, n1, _] = layout.shape.n;
            let first = layout.line[axis].first_face();
            let field = &mut flow.state.velocity[axis];
            field.par_chunks_mut(n0 * n1).enumerate().for_each(|(k, plane)| {
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
        let report = flow.start()?;
        Ok((flow, report))
    }

    /// All arrays zero; nothing projected yet.
    pub(crate) fn at_rest(mesh: Mesh, settings: FlowSettings) -> Result<Self, Error> {
        settings.check()?;
        refuse_sticking_without_viscosity(&mesh, settings.viscosity_m2_s)?;
        let layout = Layout::new(&mesh, settings.memory_order);
        let n = layout.shape.len();
        let field = || vec![0.0; n];
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
        let divergence = if settings.rotational { field() } else { Vec::new() };
        Ok(Self {
            ops: std::array::from_fn(|axis| Momentum::new(&layout, axis)),
            divergence: Divergence::new(&layout),
            pressure_solver: pressure::build(&layout, settings.pressure)?,
            model: Subgrid::new(&layout, settings.subgrid)?,
            line_solvers: Vec::new(),
            work: Work { star: fields(), phi: field(), divergence },
            mesh,
            settings,
            layout,
            state,
        })
    }

    /// Projects the initial field, finds its pressure, decides which directions are implicit.
    pub(crate) fn start(&mut self) -> Result<StartReport, Error> {
        if let Some(axis) = (0..3).find(|&a| self.state.velocity[a].iter().any(|v| !v.is_finite())) {
            return Err(self.diverged(axis, "initial velocity"));
        }
        let given = self.kinetic_energy();
        let velocity = std::mem::take(&mut self.state.velocity);
        self.work.star = velocity;
        self.state.velocity = std::array::from_fn(|_| vec![0.0; self.layout.shape.len()]);
        self.project(1.0)?;
        self.state.implicit = self.choose_implicit();
        // The pressure that belongs to the field: that which keeps its acceleration free of divergence.
        let velocity = self.state.velocity.clone();
        let summary = (self.state.energy, self.state.courant_per_s);
        self.momentum(&Stage { fraction: 1.0, new: 1.0, old: 0.0 }, 1.0, true);
        self.project(1.0)?;
        std::mem::swap(&mut self.state.pressure, &mut self.work.phi);
        self.state.velocity = velocity;
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
        let implicit_share = if self.state.step < self.settings.damped_steps { 1.0 } else { 0.5 };
        // Adams-Bashforth starts with a step of Runge-Kutta and then wants the terms of the initial field.
        let starting = self.settings.scheme == TimeScheme::AdamsBashforth2 && ratio.is_none();
        let mut first_terms = None;
        let mut powers = None;
        let mut solved = None;
        for stage in self.settings.scheme.stages(ratio) {
            let stage_s = stage.fraction * step_s;
            let found = self.momentum(&stage, stage_s, false);
            if powers.is_none() && starting {
                first_terms = Some(self.state.history.clone());
            }
            powers.get_or_insert(found);
            self.solve_lines(implicit_share * stage_s * self.settings.viscosity_m2_s);
            solved = Some(self.project(stage_s)?);
            self.update_pressure();
        }
        if let Some(terms) = first_terms {
            self.state.history = terms;
        }
        self.state.step += 1;
        self.state.time_s += step_s;
        self.state.last_step_s = step_s;
        if !self.state.energy.is_finite() {
            let axis = (0..3).find(|&a| self.state.velocity[a].iter().any(|v| !v.is_finite())).unwrap_or(0);
            return Err(self.diverged(axis, "velocity"));
        }
        let powers = powers.unwrap_or_default();
        Ok(StepReport {
            step: self.state.step,
            time_s: self.state.time_s,
            step_s,
            courant,
            kinetic_energy_m5_s2: self.state.energy,
            viscous_power_m5_s3: powers.viscous,
            subgrid_power_m5_s3: powers.subgrid,
            force_power_m5_s3: powers.force,
            subgrid_viscosity_m2_s: self.model.as_ref().map_or(0.0, Subgrid::max_viscosity_m2_s),
            pressure_iterations: solved.map_or(0, |s| s.iterations),
            pressure_residual: solved.and_then(|s| s.residual),
            pressure_factor: solved.and_then(|s| s.factor),
        })
    }

    /// Length of the next step \[s\].
    fn next_step_s(&self) -> f64 {
        match self.settings.time_step {
            TimeStep::Fixed { step_s } => step_s,
            TimeStep::Courant { courant, longest_s } => {
                let mut step_s = longest_s.min(courant / self.state.courant_per_s);
                let explicit = self.explicit_viscous_rate_per_s();
                if explicit > 0.0 {
                    step_s = step_s.min(EXPLICIT_SHARE / explicit);
                }
                if self.state.last_step_s > 0.0 {
                    step_s = step_s.min(LARGEST_GROWTH * self.state.last_step_s);
                }
                step_s
            }
        }
    }

    /// Largest decay rate of the viscous term along one memory axis \[1/s\].
    fn viscous_rate_per_s(&self, axis: usize) -> f64 {
        let line = &self.layout.line[axis];
        if line.is_thin() {
            return 0.0;
        }
        let least_m = line.cell_metric_m.iter().copied().fold(f64::INFINITY, f64::min);
        LAPLACIAN_SYMBOL * self.settings.viscosity_m2_s / least_m.powi(2)
    }

    fn explicit_viscous_rate_per_s(&self) -> f64 {
        (0..3).filter(|&axis| !self.state.implicit[axis]).map(|axis| self.viscous_rate_per_s(axis)).sum()
    }

    fn choose_implicit(&self) -> [bool; 3] {
        if self.settings.viscosity_m2_s == 0.0 {
            return [false; 3];
        }
        match self.settings.viscous {
            ViscousTreatment::Implicit(directions) => self.layout.direction.map(|d| directions[d]),
            ViscousTreatment::Auto => {
                let step_s = match self.settings.time_step {
                    TimeStep::Fixed { step_s } => step_s,
                    TimeStep::Courant { courant, longest_s } => longest_s.min(courant / self.state.courant_per_s),
                };
                std::array::from_fn(|axis| step_s * self.viscous_rate_per_s(axis) > IMPLICIT_SHARE)
            }
        }
    }

    /// The right side of (22) into `star`: with the velocity added if no line solve follows; `acceleration_only` leaves out
    /// the old pressure and the velocity.
    fn momentum(&mut self, stage: &Stage, stage_s: f64, acceleration_only: bool) -> Powers {
        let shape = self.layout.shape;
        let n = shape.n[0];
        let Self { ops, state, work, model, layout, settings, .. } = self;
        let velocity = state.velocity.each_ref().map(Vec::as_slice);
        if let Some(model) = model.as_mut() {
            model.update(velocity);
        }
        let task = Task {
            layout,
            ops,
            velocity,
            pressure: &state.pressure,
            model: model.as_ref(),
            viscosity_m2_s: settings.viscosity_m2_s,
            force_m_s2: layout.direction.map(|d| settings.force_m_s2[d]),
            implicit: state.implicit,
            stage: *stage,
            stage_s,
            add_velocity: !acceleration_only && state.implicit == [false; 3],
            acceleration_only,
        };
        let mut total = Powers::default();
        for axis in 0..3 {
            let star = work.star[axis].par_chunks_mut(shape.plane());
            let history = state.history[axis].par_chunks_mut(shape.plane());
            let planes: Vec<Powers> = (star, history)
                .into_par_iter()
                .enumerate()
                .map_init(
                    || Scratch::new(n),
                    |scratch, (k, (star, history))| task.plane(axis, k, star, history, scratch),
                )
                .collect();
            for plane in planes {
                total.viscous += plane.viscous;
                total.subgrid += plane.subgrid;
                total.force += plane.force;
            }
        }
        total
    }

    /// Solves for the increments along the implicit axes and adds the velocity.
    fn solve_lines(&mut self, a_m2: f64) {
        if self.state.implicit == [false; 3] {
            return;
        }
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
        let Some((_, solvers)) = self.line_solvers.iter().find(|(a, _)| *a == a_m2) else { return };
        for (component, solver) in solvers {
            solver.solve(self.layout.shape, &mut self.work.star[*component]);
        }
        let plane = self.layout.shape.plane();
        for (star, velocity) in self.work.star.iter_mut().zip(&self.state.velocity) {
            star.par_chunks_mut(plane).zip(velocity.par_chunks(plane)).for_each(|(star, velocity)| {
                for (star, velocity) in star.iter_mut().zip(velocity) {
                    *star += velocity;
                }
            });
        }
    }

    /// Projects `star` to the new velocity; `phi` is left in the work array.
    fn project(&mut self, stage_s: f64) -> Result<Solved, Error> {
        let star = self.work.star.each_ref().map(Vec::as_slice);
        self.divergence.apply(star, 1.0 / stage_s, &mut self.work.phi);
        if self.settings.rotational {
            self.work.divergence.copy_from_slice(&self.work.phi);
            // The pressure takes the plain divergence of u*.
            divide_by_volume(&self.layout, stage_s, &mut self.work.divergence);
        }
        let solved = self.pressure_solver.solve(&mut self.work.phi, self.settings.pressure_tolerance)?;
        let velocity = self.state.velocity.each_mut().map(Vec::as_mut_slice);
        let summary = correct(&self.ops, &self.layout, star, &self.work.phi, stage_s, velocity);
        self.state.energy = summary.energy;
        self.state.courant_per_s = summary.courant_per_s;
        Ok(solved)
    }

    /// (25), or the rotational form.
    fn update_pressure(&mut self) {
        let plane = self.layout.shape.plane();
        let phi = &self.work.phi;
        self.state.pressure.par_chunks_mut(plane).zip(phi.par_chunks(plane)).for_each(|(p, phi)| {
            for (p, phi) in p.iter_mut().zip(phi) {
                *p += phi;
            }
        });
        if self.settings.rotational {
            let half = 0.5 * self.settings.viscosity_m2_s;
            let divergence = &self.work.divergence;
            self.state.pressure.par_chunks_mut(plane).zip(divergence.par_chunks(plane)).for_each(|(p, divergence)| {
                for (p, divergence) in p.iter_mut().zip(divergence) {
                    *p -= half * divergence;
                }
            });
        }
    }

    fn refuse_courant(&self, courant: f64, step_s: f64) -> Result<(), Error> {
        let limit = self.settings.scheme.largest_courant();
        if courant <= limit {
            return Ok(());
        }
        let mut worst = (0, 0, 0.0);
        for (axis, field) in self.state.velocity.iter().enumerate() {
            for (place, value) in field.iter().enumerate() {
                if value.abs() > worst.2 {
                    worst = (axis, place, value.abs());
                }
            }
        }
        let (axis, place, _) = worst;
        Err(Error::CourantTooLarge {
            step: self.state.step + 1,
            step_s,
            courant,
            limit,
            component: self.component_name(axis),
            position_m: self.position_m(place),
        })
    }

    fn diverged(&self, axis: usize, field: &'static str) -> Error {
        let place = self.state.velocity[axis].iter().position(|v| !v.is_finite()).unwrap_or(0);
        Error::Diverged {
            field,
            step: self.state.step,
            time_s: self.state.time_s,
            component: self.component_name(axis),
            cell: self.cell(place),
            position_m: self.position_m(place),
        }
    }

    fn component_name(&self, axis: usize) -> &'static str {
        ["u", "v", "w"][self.layout.direction[axis]]
    }

    /// Indices along x, y, z of a place in memory.
    fn cell(&self, place: usize) -> [usize; 3] {
        let [n0, n1, _] = self.layout.shape.n;
        let index = [place % n0, place / n0 % n1, place / (n0 * n1)];
        let mut cell = [0; 3];
        for (axis, index) in index.into_iter().enumerate() {
            cell[self.layout.direction[axis]] = index;
        }
        cell
    }

    fn position_m(&self, place: usize) -> [f64; 3] {
        let cell = self.cell(place);
        std::array::from_fn(|d| self.mesh.directions()[d].at(cell[d] as f64 + 0.5).0)
    }

    pub(crate) fn mesh_ref(&self) -> &Mesh {
        &self.mesh
    }

    pub(crate) fn settings_ref(&self) -> &FlowSettings {
        &self.settings
    }

    pub(crate) fn divergence_ref(&self) -> &Divergence {
        &self.divergence
    }

    fn kinetic_energy(&self) -> f64 {
        let shape = self.layout.shape;
        let mut energy = 0.0;
        for (ops, field) in self.ops.iter().zip(&self.state.velocity) {
            for k in 0..shape.n[2] {
                for j in 0..shape.n[1] {
                    let row = &field[shape.row(j, k)];
                    let (across, along) = ops.row_mass(j, k);
                    energy += 0.5 * across * weighted_dot(row, row, along);
                }
            }
        }
        energy
    }
}

/// `scale` times a weighted field over the masses of the cells.
fn divide_by_volume(layout: &Layout, scale: f64, field: &mut [f64]) {
    let shape = layout.shape;
    let mass: [&[f64]; 3] = std::array::from_fn(|b| layout.line[b].cell_mass_m.as_slice());
    field.par_chunks_mut(shape.plane()).enumerate().for_each(|(k, plane)| {
        for (j, row) in plane.chunks_mut(shape.n[0]).enumerate() {
            let factor = scale / (mass[1][j] * mass[2][k]);
            for (value, mass) in row.iter_mut().zip(mass[0]) {
                *value *= factor / mass;
            }
        }
    });
}

/// Without viscosity nothing can stick to a wall.
fn refuse_sticking_without_viscosity(mesh: &Mesh, viscosity_m2_s: f64) -> Result<(), Error> {
    let sticks = |ends: Ends| match ends {
        Ends::Periodic => false,
        Ends::Walls { low, high } => [low, high].iter().any(|w| matches!(w, Wall::NoSlip { .. })),
    };
    let found = (0..3).find(|&axis| sticks(mesh.directions()[axis].ends));
    match found {
        Some(axis) if viscosity_m2_s == 0.0 => Err(Error::BadDirection {
            axis: AXIS_NAMES[axis],
            what: "no-slip wall with viscosity_m2_s",
            value: 0.0,
            allowed: "positive: an inviscid flow cannot stick to a wall, so make it a slip wall",
        }),
        _ => Ok(()),
    }
}

/// What the planes of the momentum equation read.
struct Task<'a> {
    layout: &'a Layout,
    ops: &'a [Momentum; 3],
    velocity: [&'a [f64]; 3],
    pressure: &'a [f64],
    model: Option<&'a Subgrid>,
    viscosity_m2_s: f64,
    force_m_s2: [f64; 3],
    implicit: [bool; 3],
    stage: Stage,
    stage_s: f64,
    add_velocity: bool,
    acceleration_only: bool,
}

impl Task<'_> {
    fn plane(&self, axis: usize, k: usize, star: &mut [f64], history: &mut [f64], scratch: &mut Scratch) -> Powers {
        let shape = self.layout.shape;
        let n = shape.n[0];
        let mut powers = Powers::default();
        for (j, (star, history)) in star.chunks_mut(n).zip(history.chunks_mut(n)).enumerate() {
            if self.ops[axis].is_wall_row(j, k) {
                star.fill(0.0);
                continue;
            }
            self.row(axis, j, k, star, history, scratch, &mut powers);
        }
        powers
    }

    fn row(
        &self,
        axis: usize,
        j: usize,
        k: usize,
        star: &mut [f64],
        history: &mut [f64],
        scratch: &mut Scratch,
        powers: &mut Powers,
    ) {
        let ops = &self.ops[axis];
        let own = &self.velocity[axis][self.layout.shape.row(j, k)];
        let (across, along) = ops.row_mass(j, k);
        scratch.convection(ops, self.velocity, j, k);
        scratch.implicit.fill(0.0);
        scratch.explicit.fill(0.0);
        if self.viscosity_m2_s > 0.0 {
            scratch.laplacians(ops, self.velocity[axis], self.implicit, j, k);
            let work = weighted_dot(own, &scratch.implicit, along) + weighted_dot(own, &scratch.explicit, along);
            powers.viscous += across * self.viscosity_m2_s * work;
        }
        if let Some(model) = self.model {
            scratch.model.fill(0.0);
            model.add_divergence_row(axis, j, k, &mut scratch.model);
            powers.subgrid += across * weighted_dot(own, &scratch.model, along);
        }
        let force = self.force_m_s2[axis];
        if force != 0.0 {
            let momentum: f64 = own.iter().zip(along).map(|(u, mass)| u * mass).sum();
            powers.force += across * force * momentum;
        }
        if !self.acceleration_only {
            scratch.gradient(ops, self.pressure, j, k);
        }
        let new = NewTerms {
            convection: &scratch.convection,
            explicit: &scratch.explicit,
            model: self.model.map(|_| scratch.model.as_slice()),
            nu: self.viscosity_m2_s,
            force,
        };
        if self.acceleration_only {
            new.write(star);
            for (star, implicit) in star.iter_mut().zip(&scratch.implicit) {
                *star += self.viscosity_m2_s * implicit;
            }
        } else {
            self.advance(&new, &scratch.implicit, &scratch.pressure, own, star, history);
        }
        if axis == 0 && self.layout.line[0].first_face() == 1 {
            star[0] = 0.0;
        }
    }

    /// `star = dt (c N + c' N' - grad p + nu L u) [+ u]`, and the history.
    fn advance(
        &self,
        new: &NewTerms<'_>,
        implicit: &[f64],
        pressure: &[f64],
        own: &[f64],
        star: &mut [f64],
        history: &mut [f64],
    ) {
        let Stage { new: weight, old, .. } = self.stage;
        let dt = self.stage_s;
        new.write(star);
        let n = star.len();
        let (implicit, pressure, own, history) = (&implicit[..n], &pressure[..n], &own[..n], &mut history[..n]);
        let keep = if self.add_velocity { 1.0 } else { 0.0 };
        for i in 0..n {
            let term = star[i];
            let total = weight * term + old * history[i] - pressure[i] + new.nu * implicit[i];
            history[i] = term;
            star[i] = dt * total + keep * own[i];
        }
    }
}

/// The terms that are integrated explicitly.
struct NewTerms<'a> {
    convection: &'a [f64],
    explicit: &'a [f64],
    model: Option<&'a [f64]>,
    nu: f64,
    force: f64,
}

impl NewTerms<'_> {
    fn write(&self, out: &mut [f64]) {
        let n = out.len();
        let (convection, explicit) = (&self.convection[..n], &self.explicit[..n]);
        for i in 0..n {
            out[i] = self.nu * explicit[i] - convection[i] + self.force;
        }
        if let Some(model) = self.model {
            for (out, model) in out.iter_mut().zip(model) {
                *out += model;
            }
        }
    }
}

#[cfg(test)]
#[path = "flow_tests.rs"]
mod tests;
