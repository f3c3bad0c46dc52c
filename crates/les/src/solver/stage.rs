//! The right side of the momentum equation, in blocks of rows.

use multiversion::multiversion;
use rayon::prelude::*;

use super::aligned::Aligned;
use super::flow::Flow;
use super::layout::Shape;
use super::momentum::Scratch;
use super::projection::weighted_dot;
use super::report::Powers;
use super::settings::Stage;
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
    predicted: [&'a mut [f64]; 3],
    previous: [&'a mut [f64]; 3],
}

/// Cuts the planes that are owned into blocks of the same rows of one plane after the other, so that rows of the planes about a
/// block have just been read.
fn blocks<'a>(
    shape: Shape,
    predicted: &'a mut [Aligned; 3],
    previous: &'a mut [Aligned; 3],
) -> Vec<Block<'a>> {
    let [n0, n1, _] = shape.n;
    let rows = n1.div_ceil((n0 * n1).div_ceil(BLOCK));
    let pieces = |field: &'a mut Aligned| {
        let planes = field[shape.own_places()].chunks_mut(shape.plane());
        planes.flat_map(move |plane| plane.chunks_mut(rows * n0))
    };
    let (mut predicted, mut previous) = (
        predicted.each_mut().map(pieces),
        previous.each_mut().map(pieces),
    );
    let mut blocks: Vec<Vec<Block<'_>>> = (0..n1.div_ceil(rows)).map(|_| Vec::new()).collect();
    for plane in shape.own() {
        for (at, blocks) in blocks.iter_mut().enumerate() {
            let predicted = predicted
                .each_mut()
                .map(|pieces| pieces.next().unwrap_or_default());
            let previous = previous
                .each_mut()
                .map(|pieces| pieces.next().unwrap_or_default());
            blocks.push(Block {
                plane,
                row: at * rows,
                predicted,
                previous,
            });
        }
    }
    blocks.into_iter().flatten().collect()
}

impl Flow {
    /// The right side of (22) into `predicted`, or the velocity with all but implicit viscosity if `keeps` says that no line solve of the
    /// increments follows; its terms into the previous ones. The work of the terms if `measured`.
    pub(super) fn predict(
        &mut self,
        stage: Stage,
        stage_s: f64,
        keeps: bool,
        measured: bool,
    ) -> Result<Powers, Error> {
        let shape = self.layout.shape;
        let keep = if keeps { 1.0 } else { 0.0 };
        // What is written leaves the flow, which the blocks read.
        let mut predicted = std::mem::take(&mut self.predicted);
        let mut previous = std::mem::take(&mut self.state.previous_terms);
        let powers: Vec<[Powers; 3]> = blocks(shape, &mut predicted, &mut previous)
            .into_par_iter()
            .map_init(
                || std::array::from_fn(|_| Scratch::new(shape.n[0])),
                |scratch, block| self.increments(block, (stage, stage_s, keep, measured), scratch),
            )
            .collect();
        (self.predicted, self.state.previous_terms) = (predicted, previous);
        if !measured {
            return Ok(Powers::default());
        }
        // Those of each plane, component after component, then of all.
        let of_plane = |k| -> [f64; 9] {
            let blocks = || powers.iter().skip(k).step_by(shape.own().len());
            std::array::from_fn(|i| blocks().map(|powers| powers[i / 3][i % 3]).sum())
        };
        let planes = self
            .layout
            .slabs
            .planes((0..shape.own().len()).map(of_plane).collect())?;
        let terms =
            (0..3).flat_map(|component| planes.iter().map(move |plane| &plane[3 * component..]));
        Ok(terms.fold(Powers::default(), |total, plane| {
            std::array::from_fn(|i| total[i] + plane[i])
        }))
    }

    /// The viscosity of the model for the present field, at most such that `stage_s`, this fraction of a step, is stable; its
    /// acceleration by stresses in planes into `predicted`, where the terms of the momentum equation are summed.
    pub(super) fn update_model(&mut self, fraction: f64, stage_s: f64) -> Result<(), Error> {
        let explicit_per_s = self.settings.scheme.largest_decay() * fraction / stage_s;
        let limit_per_s =
            (SUBGRID_SHARE * explicit_per_s - self.explicit_viscous_rate_per_s()).max(0.0);
        let Self {
            model: Some(model),
            predicted,
            phi,
            ..
        } = self
        else {
            return Ok(());
        };
        model.update(
            self.state.velocity.each_ref().map(|field| &field[..]),
            limit_per_s,
            predicted,
            phi,
        )
    }

    /// `predicted = dt (c N + c' N' - grad p + nu L u) + keep u`, without `nu L u` if `keep` is 1, in the rows of a block, with the previous terms; returns the work of each
    /// component if `measured`.
    fn increments(
        &self,
        block: Block<'_>,
        (stage, stage_s, keep, measured): (Stage, f64, f64, bool),
        scratch: &mut [Scratch; 3],
    ) -> [Powers; 3] {
        let (n, k) = (self.layout.shape.n[0], block.plane);
        let mut powers = [Powers::default(); 3];
        let components = block
            .predicted
            .into_iter()
            .zip(block.previous)
            .zip(scratch)
            .zip(&mut powers)
            .enumerate();
        for (axis, (((predicted, previous), scratch), powers)) in components {
            let rows = predicted.chunks_mut(n).zip(previous.chunks_mut(n));
            for ((predicted, previous), j) in rows.zip(block.row..) {
                if self.ops[axis].is_wall_row(j, k) {
                    predicted.fill(0.0);
                    continue;
                }
                self.terms(
                    [axis, j, k],
                    predicted,
                    scratch,
                    measured.then_some(&mut *powers),
                );
                scratch.gradient(&self.ops[axis], &self.state.pressure, j, k);
                let own = &self.state.velocity[axis][self.layout.shape.row(j, k)];
                let nu = if keep == 1.0 {
                    0.0
                } else {
                    self.settings.viscosity_m2_s
                };
                advance_row(
                    [stage.new, stage.old, nu, stage_s, keep],
                    predicted,
                    previous,
                    [&scratch.implicit, &scratch.pressure, own],
                );
                self.ops[axis].hold_at_wall(predicted);
            }
        }
        powers
    }

    /// `N`, the terms that are integrated explicitly, of one row into `out`, which has the model's acceleration by stresses in planes; the Laplacian along
    /// the implicit axes into the scratch.
    fn terms(
        &self,
        [axis, j, k]: [usize; 3],
        out: &mut [f64],
        scratch: &mut Scratch,
        powers: Option<&mut Powers>,
    ) {
        let ops = &self.ops[axis];
        if self.model.is_some() {
            scratch.model.copy_from_slice(out);
        }
        scratch.convection(
            ops,
            self.state.velocity.each_ref().map(|field| &field[..]),
            j,
            k,
        );
        let nu = self.settings.viscosity_m2_s;
        let force = self.settings.force_m_s2[self.layout.direction[axis]];
        if nu == 0.0 {
            scratch.implicit.fill(0.0);
            scratch.explicit.fill(0.0);
        } else {
            scratch.laplacians(ops, &self.state.velocity[axis], self.state.implicit, j, k);
        }
        explicit_terms(out, nu, &scratch.explicit, &scratch.convection, force);
        if let Some(model) = &self.model {
            model.add_divergence_row(axis, j, k, &mut scratch.model);
            for (out, model) in out.iter_mut().zip(&scratch.model) {
                *out += model;
            }
        }
        let Some(powers) = powers else { return };
        let own = &self.state.velocity[axis][self.layout.shape.row(j, k)];
        let (across, along) = ops.row_mass(j, k);
        if nu > 0.0 {
            let work = weighted_dot(own, &scratch.implicit, along)
                + weighted_dot(own, &scratch.explicit, along);
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

/// `predicted = dt (c N + c' N' - grad p + nu L u) + keep u`, `N` being what `predicted` held, which goes into the previous terms.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn advance_row(
    [new, old, nu, stage_s, keep]: [f64; 5],
    predicted: &mut [f64],
    previous: &mut [f64],
    [implicit, pressure, own]: [&[f64]; 3],
) {
    let n = predicted.len();
    let (previous, implicit, pressure, own) = (
        &mut previous[..n],
        &implicit[..n],
        &pressure[..n],
        &own[..n],
    );
    for i in 0..n {
        let term = predicted[i];
        let total = new * term + old * previous[i] - pressure[i] + nu * implicit[i];
        previous[i] = term;
        predicted[i] = stage_s * total + keep * own[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_every_value_that_is_owned_once_and_in_its_place() {
        for shape in [
            Shape::whole([100, 130, 5]),
            Shape::slab([100, 41, 16], 1, 3),
            Shape::whole([5000, 2, 9]),
        ] {
            let mut predicted = [0, 1, 2].map(|_| Aligned::zeros(shape.len()));
            for (axis, field) in predicted.iter_mut().enumerate() {
                field
                    .iter_mut()
                    .enumerate()
                    .for_each(|(place, value)| *value = (3 * place + axis) as f64);
            }
            let mut previous = predicted.clone();
            let mut seen = 0;
            for Block {
                plane,
                row,
                predicted,
                previous,
            } in blocks(shape, &mut predicted, &mut previous)
            {
                assert!(predicted[0].len() <= BLOCK.max(shape.n[0]));
                for (axis, (predicted, previous)) in predicted.into_iter().zip(previous).enumerate()
                {
                    assert_eq!(
                        predicted[0],
                        (3 * shape.place([0, row, plane]) + axis) as f64
                    );
                    assert_eq!(predicted, previous);
                    seen += predicted.len();
                }
            }
            assert_eq!(seen, 3 * shape.own_places().len());
        }
    }
}
