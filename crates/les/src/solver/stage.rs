//! The right side of the momentum equation, in blocks of rows.

use multiversion::multiversion;
use rayon::prelude::*;

use super::aligned::Aligned;
use super::flow::{Flow, Work};
use super::layout::{Layout, Shape};
use super::momentum::{Momentum, Scratch};
use super::projection::weighted_dot;
use super::report::Powers;
use super::settings::Stage;
use super::subgrid::Subgrid;
use crate::Error;

/// Share of the explicit limit beyond which the subgrid viscosity is cut. In the core of a vortex WALE's viscosity has no
/// work to do but would make an explicit step unstable; the cut keeps the step that convection allows.
const SUBGRID_SHARE: f64 = 0.8;

/// Values of a block: what its stencils reach, and the fluxes that are kept for it, stay in the cache of a core.
const BLOCK: usize = 4096;

/// Some rows of one plane, of the three components.
#[derive(Debug)]
struct Block<'a> {
    plane: usize,
    /// The first of its rows.
    row: usize,
    star: [&'a mut [f64]; 3],
    history: [&'a mut [f64]; 3],
}

/// Cuts the planes that are owned into blocks of the same rows of one plane after the other, so that rows of the planes about a
/// block have just been read.
fn blocks<'a>(shape: Shape, star: &'a mut [Aligned; 3], history: &'a mut [Aligned; 3]) -> Vec<Block<'a>> {
    let [n0, n1, _] = shape.n;
    let rows = n1.div_ceil((n0 * n1).div_ceil(BLOCK));
    let pieces = |field: &'a mut Aligned| {
        let planes = field[shape.own_places()].chunks_mut(shape.plane());
        planes.flat_map(move |plane| plane.chunks_mut(rows * n0))
    };
    let (mut star, mut history) = (star.each_mut().map(pieces), history.each_mut().map(pieces));
    let mut blocks: Vec<Vec<Block<'_>>> = (0..n1.div_ceil(rows)).map(|_| Vec::new()).collect();
    for plane in shape.own() {
        for (at, blocks) in blocks.iter_mut().enumerate() {
            let star = star.each_mut().map(|pieces| pieces.next().unwrap_or_default());
            let history = history.each_mut().map(|pieces| pieces.next().unwrap_or_default());
            blocks.push(Block { plane, row: at * rows, star, history });
        }
    }
    blocks.into_iter().flatten().collect()
}

impl Flow {
    /// The right side of (22) into `star`, or the velocity with all but implicit viscosity if no line solve follows or a damped one; its
    /// terms into the history. The work of the terms if `measured`.
    pub(super) fn predict(
        &mut self,
        stage: &Stage,
        stage_s: f64,
        is_damped: bool,
        measured: bool,
    ) -> Result<Powers, Error> {
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
        if !measured {
            return Ok(Powers::default());
        }
        // Those of each plane, component after component, then of all.
        let of_plane = |k| -> [f64; 9] {
            let blocks = || powers.iter().skip(k).step_by(shape.own().len());
            std::array::from_fn(|i| blocks().map(|powers| powers[i / 3][i % 3]).sum())
        };
        let planes = self.layout.slabs.planes((0..shape.own().len()).map(of_plane).collect())?;
        let terms = (0..3).flat_map(|component| planes.iter().map(move |plane| &plane[3 * component..]));
        Ok(terms.fold(Powers::default(), |total, plane| std::array::from_fn(|i| total[i] + plane[i])))
    }

    /// The acceleration by everything but pressure into `star`.
    pub(super) fn accelerate(&mut self) -> Result<(), Error> {
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

    /// The viscosity of the model for the present field, at most such that it decays by `limit_per_s`; its acceleration by stresses in
    /// planes into `star`, where the terms of the momentum equation are summed.
    fn update_model(&mut self, limit_per_s: f64) -> Result<(), Error> {
        let Self { model: Some(model), work: Work { star, phi }, .. } = self else { return Ok(()) };
        model.update(self.state.velocity.each_ref().map(Aligned::as_slice), limit_per_s, star, phi)
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
}

impl Task<'_> {
    /// `star = dt (c N + c' N' - grad p + nu L u) + keep u`, without `nu L u` if `keep` is 1, in the rows of a block, with the history; returns the work of each
    /// component if `measured`.
    fn increments(
        &self,
        block: Block<'_>,
        (stage, stage_s, keep, measured): (&Stage, f64, f64, bool),
        scratch: &mut [Scratch; 3],
    ) -> [Powers; 3] {
        let (n, k) = (self.layout.shape.n[0], block.plane);
        let mut powers = [Powers::default(); 3];
        let components = block.star.into_iter().zip(block.history).zip(scratch).zip(&mut powers).enumerate();
        for (axis, (((star, history), scratch), powers)) in components {
            let rows = star.chunks_mut(n).zip(history.chunks_mut(n));
            for ((star, history), j) in rows.zip(block.row..) {
                if self.ops[axis].is_wall_row(j, k) {
                    star.fill(0.0);
                    continue;
                }
                self.terms([axis, j, k], star, scratch, measured.then_some(&mut *powers));
                scratch.gradient(&self.ops[axis], self.pressure, j, k);
                let own = &self.velocity[axis][self.layout.shape.row(j, k)];
                let nu = if keep == 1.0 { 0.0 } else { self.viscosity_m2_s };
                advance_row(
                    [stage.new, stage.old, nu, stage_s, keep],
                    star,
                    history,
                    [&scratch.implicit, &scratch.pressure, own],
                );
                self.hold_at_wall(axis, star);
            }
        }
        powers
    }

    /// `star = N + nu L u` in plane `k` of component `axis`.
    fn accelerations(&self, [axis, k]: [usize; 2], star: &mut [f64], scratch: &mut Scratch) {
        for (j, star) in star.chunks_mut(self.layout.shape.n[0]).enumerate() {
            if self.ops[axis].is_wall_row(j, k) {
                star.fill(0.0);
                continue;
            }
            self.terms([axis, j, k], star, scratch, None);
            for (star, implicit) in star.iter_mut().zip(&scratch.implicit) {
                *star += self.viscosity_m2_s * implicit;
            }
            self.hold_at_wall(axis, star);
        }
    }

    /// `N`, the terms that are integrated explicitly, of one row into `out`, which has the model's acceleration by stresses in planes; the Laplacian along
    /// the implicit axes into the scratch.
    fn terms(&self, [axis, j, k]: [usize; 3], out: &mut [f64], scratch: &mut Scratch, powers: Option<&mut Powers>) {
        let ops = &self.ops[axis];
        if self.model.is_some() {
            scratch.model.copy_from_slice(out);
        }
        scratch.convection(ops, self.velocity, j, k);
        let (nu, force) = (self.viscosity_m2_s, self.force_m_s2[axis]);
        if nu == 0.0 {
            scratch.implicit.fill(0.0);
            scratch.explicit.fill(0.0);
        } else {
            scratch.laplacians(ops, self.velocity[axis], self.implicit, j, k);
        }
        explicit_terms(out, nu, &scratch.explicit, &scratch.convection, force);
        if let Some(model) = self.model {
            model.add_divergence_row(axis, j, k, &mut scratch.model);
            for (out, model) in out.iter_mut().zip(&scratch.model) {
                *out += model;
            }
        }
        let Some(powers) = powers else { return };
        let own = &self.velocity[axis][self.layout.shape.row(j, k)];
        let (across, along) = ops.row_mass(j, k);
        if nu > 0.0 {
            let work = weighted_dot(own, &scratch.implicit, along) + weighted_dot(own, &scratch.explicit, along);
            powers[0] += across * nu * work;
        }
        if force != 0.0 {
            let momentum: f64 = own.iter().zip(along).map(|(u, mass)| u * mass).sum();
            powers[2] += across * force * momentum;
        }
        if self.model.is_some() {
            powers[1] += across * weighted_dot(own, &scratch.model, along);
        }
    }

    /// A velocity along axis 0 is zero at the wall that the row begins with.
    fn hold_at_wall(&self, axis: usize, row: &mut [f64]) {
        if axis == 0 && self.layout.line[0].first_face() == 1 {
            row[0] = 0.0;
        }
    }
}

/// `out = nu explicit - convection + force`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn explicit_terms(out: &mut [f64], nu: f64, explicit: &[f64], convection: &[f64], force: f64) {
    let n = out.len();
    let (explicit, convection) = (&explicit[..n], &convection[..n]);
    for i in 0..n {
        out[i] = nu * explicit[i] - convection[i] + force;
    }
}

/// `star = dt (c N + c' N' - grad p + nu L u) + keep u`, `N` being what `star` held, which goes into the history.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn advance_row(
    [new, old, nu, stage_s, keep]: [f64; 5],
    star: &mut [f64],
    history: &mut [f64],
    [implicit, pressure, own]: [&[f64]; 3],
) {
    let n = star.len();
    let (history, implicit, pressure, own) = (&mut history[..n], &implicit[..n], &pressure[..n], &own[..n]);
    for i in 0..n {
        let term = star[i];
        let total = new * term + old * history[i] - pressure[i] + nu * implicit[i];
        history[i] = term;
        star[i] = stage_s * total + keep * own[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_every_value_that_is_owned_once_and_in_its_place() {
        for shape in [Shape::whole([100, 130, 5]), Shape::slab([100, 41, 16], 1, 3), Shape::whole([5000, 2, 9])] {
            let values = |axis| (0..shape.len()).map(move |place| (3 * place + axis) as f64).collect::<Vec<f64>>();
            let mut star = [0, 1, 2].map(|axis| Aligned::from(&values(axis)[..]));
            let mut history = star.clone();
            let mut seen = 0;
            for Block { plane, row, star, history } in blocks(shape, &mut star, &mut history) {
                assert!(star[0].len() <= BLOCK.max(shape.n[0]));
                for (axis, (star, history)) in star.into_iter().zip(history).enumerate() {
                    assert_eq!(star[0], (3 * shape.place([0, row, plane]) + axis) as f64);
                    assert_eq!(star, history);
                    seen += star.len();
                }
            }
            assert_eq!(seen, 3 * shape.own_places().len());
        }
    }
}
