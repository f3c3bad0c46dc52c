//! The right side of the momentum equation, in blocks of rows.

use multiversion::multiversion;

use super::aligned::Aligned;
use super::layout::{Layout, Shape};
use super::momentum::{Momentum, Scratch};
use super::projection::weighted_dot;
use super::settings::Stage;
use super::subgrid::Subgrid;

/// Work done on the fluid per time by viscosity, the subgrid stress and the force.
pub(super) type Powers = [f64; 3];

/// Values of a block: what its stencils reach, and the fluxes that are kept for it, stay in the cache of a core.
const BLOCK: usize = 4096;

/// Some rows of one plane, of the three components.
#[derive(Debug)]
pub(super) struct Block<'a> {
    plane: usize,
    /// The first of its rows.
    row: usize,
    star: [&'a mut [f64]; 3],
    history: [&'a mut [f64]; 3],
}

/// Cuts the planes that are owned into blocks of the same rows of one plane after the other, so that rows of the planes about a
/// block have just been read.
pub(super) fn blocks<'a>(shape: Shape, star: &'a mut [Aligned; 3], history: &'a mut [Aligned; 3]) -> Vec<Block<'a>> {
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

/// What the planes of the momentum equation read.
pub(super) struct Task<'a> {
    pub(super) layout: &'a Layout,
    pub(super) ops: &'a [Momentum; 3],
    pub(super) velocity: [&'a [f64]; 3],
    pub(super) pressure: &'a [f64],
    pub(super) model: Option<&'a Subgrid>,
    pub(super) viscosity_m2_s: f64,
    pub(super) force_m_s2: [f64; 3],
    pub(super) implicit: [bool; 3],
}

impl Task<'_> {
    /// `star = dt (c N + c' N' - grad p + nu L u) + keep u`, without `nu L u` if `keep` is 1, in the rows of a block, with the history; returns the work of each
    /// component if `measured`.
    pub(super) fn increments(
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
    pub(super) fn accelerations(&self, [axis, k]: [usize; 2], star: &mut [f64], scratch: &mut Scratch) {
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

    /// `N`, the terms that are integrated explicitly, of one row into `out`, which holds what the model was lent; the Laplacian along
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
