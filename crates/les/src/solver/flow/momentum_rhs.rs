//! The right side of the momentum equation, in blocks of rows.

use multiversion::multiversion;
use rayon::prelude::*;

use super::Flow;
use crate::Error;
use crate::solver::aligned::Aligned;
use crate::solver::component_operators::Scratch;
use crate::solver::layout::Shape;
use crate::solver::projection::weighted_dot;
use crate::solver::report::Powers;
use crate::solver::settings::Stage;

/// Fraction of the explicit limit beyond which the subgrid viscosity is cut. In the core of a
/// vortex WALE's viscosity has no work to do but would make an explicit step unstable; the cut
/// retains the step that convection allows.
const SUBGRID_FRACTION: f64 = 0.8;

/// Values of a block: what its stencils reach, and the fluxes that are cached for it, stay in the
/// cache of a core.
const BLOCK: usize = 4096;

/// How one stage is predicted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prediction {
    pub(super) stage: Stage,
    /// Length of the stage \[s\].
    pub(super) stage_s: f64,
    /// Whether it writes the right side of (22), the increment for which the line solves of
    /// implicit viscosity follow; otherwise the velocity after all terms but implicit viscosity.
    pub(super) is_increment: bool,
    /// Whether the work of the terms is measured.
    pub(super) measures_powers: bool,
}

/// Some rows of one plane, of the three components.
#[derive(Debug)]
struct Block<'a> {
    plane: usize,
    /// The first of its rows.
    row: usize,
    predicted: [&'a mut [f64]; 3],
    previous: [&'a mut [f64]; 3],
}

/// Cuts the planes that are owned into blocks of the same rows of one plane after the other, so
/// that rows of the planes about a block have just been read.
fn blocks<'a>(
    shape: Shape,
    predicted: &'a mut [Aligned; 3],
    previous: &'a mut [Aligned; 3],
) -> Vec<Block<'a>> {
    let [n0, n1, _] = shape.n;
    let rows = n1.div_ceil((n0 * n1).div_ceil(BLOCK));
    let mut predicted = predicted.each_mut().map(|field| pieces(field, shape, rows));
    let mut previous = previous.each_mut().map(|field| pieces(field, shape, rows));
    // By their number within a plane.
    let mut blocks: Vec<Vec<Block<'_>>> = Vec::new();
    blocks.resize_with(n1.div_ceil(rows), Vec::new);
    for plane in shape.own() {
        for (number, blocks) in blocks.iter_mut().enumerate() {
            blocks.push(Block {
                plane,
                row: number * rows,
                predicted: next_of_each(&mut predicted),
                previous: next_of_each(&mut previous),
            });
        }
    }
    blocks.into_iter().flatten().collect()
}

/// The planes of a field that are owned, plane after plane in pieces of some rows.
fn pieces(field: &mut Aligned, shape: Shape, rows: usize) -> impl Iterator<Item = &mut [f64]> {
    let planes = field[shape.own_range()].chunks_mut(shape.plane());
    planes.flat_map(move |plane| plane.chunks_mut(rows * shape.n[0]))
}

/// The next piece of each component.
fn next_of_each<'a>(pieces: &mut [impl Iterator<Item = &'a mut [f64]>; 3]) -> [&'a mut [f64]; 3] {
    pieces
        .each_mut()
        .map(|pieces| pieces.next().unwrap_or_default())
}

impl Flow {
    /// Writes the field of a prediction to `predicted` and its terms to the previous ones; returns
    /// the work of the terms, zero unless it is measured.
    pub(super) fn predict(&mut self, prediction: Prediction) -> Result<Powers, Error> {
        let shape = self.layout.shape;
        // What is written leaves the flow, which the blocks read.
        let mut predicted = std::mem::take(&mut self.predicted);
        let mut previous = std::mem::take(&mut self.state.previous_terms);
        let powers: Vec<[Powers; 3]> = blocks(shape, &mut predicted, &mut previous)
            .into_par_iter()
            .map_init(
                || std::array::from_fn(|_| Scratch::new(shape.n[0])),
                |scratch, block| self.predict_block(block, &prediction, scratch),
            )
            .collect();
        self.predicted = predicted;
        self.state.previous_terms = previous;
        if !prediction.measures_powers {
            return Ok(Powers::default());
        }
        self.total_powers(&powers)
    }

    /// Sums the powers of the blocks to those of each plane, then component after component to
    /// those of the flow.
    fn total_powers(&self, blocks: &[[Powers; 3]]) -> Result<Powers, Error> {
        let own_planes = self.layout.shape.own().len();
        let mut of_planes = vec![[0.0; 9]; own_planes];
        for (number, powers) in blocks.iter().enumerate() {
            let of_plane = &mut of_planes[number % own_planes];
            for (sum, power) in of_plane.iter_mut().zip(powers.as_flattened()) {
                *sum += power;
            }
        }
        let planes = self.layout.slabs.planes(of_planes)?;
        let mut total = Powers::default();
        for component in 0..3 {
            for plane in &planes {
                for (total, power) in total.iter_mut().zip(&plane[3 * component..]) {
                    *total += power;
                }
            }
        }
        Ok(total)
    }

    /// The viscosity of the model for the present field, at most such that `stage_s`, this fraction
    /// of a step, is stable; its acceleration by stresses in planes into `predicted`, where the
    /// terms of the momentum equation are summed.
    pub(super) fn update_model(&mut self, fraction: f64, stage_s: f64) -> Result<(), Error> {
        let explicit_per_s = self.settings.scheme.largest_decay() * fraction / stage_s;
        let limit_per_s =
            (SUBGRID_FRACTION * explicit_per_s - self.explicit_viscous_rate_per_s()).max(0.0);
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

    /// Predicts the rows of a block; returns the work of each component if it is measured.
    fn predict_block(
        &self,
        block: Block<'_>,
        prediction: &Prediction,
        scratch: &mut [Scratch; 3],
    ) -> [Powers; 3] {
        let n = self.layout.shape.n[0];
        let k = block.plane;
        let implicit_viscosity_m2_s = if prediction.is_increment {
            self.settings.viscosity_m2_s
        } else {
            0.0
        };
        let mut powers = [Powers::default(); 3];
        let components = block.predicted.into_iter().zip(block.previous);
        for (axis, (predicted, previous)) in components.enumerate() {
            let scratch = &mut scratch[axis];
            let rows = predicted.chunks_mut(n).zip(previous.chunks_mut(n));
            for ((predicted, previous), j) in rows.zip(block.row..) {
                if self.ops[axis].is_wall_row(j, k) {
                    predicted.fill(0.0);
                    continue;
                }
                self.explicit_row([axis, j, k], predicted, scratch);
                if prediction.measures_powers {
                    self.add_powers([axis, j, k], scratch, &mut powers[axis]);
                }
                scratch.gradient(&self.ops[axis], &self.state.pressure, j, k);
                let own = &self.state.velocity[axis][self.layout.shape.row(j, k)];
                advance_row(
                    prediction,
                    implicit_viscosity_m2_s,
                    predicted,
                    previous,
                    &scratch.implicit,
                    &scratch.pressure,
                    own,
                );
                self.ops[axis].hold_at_wall(predicted);
            }
        }
        powers
    }

    /// Writes `N`, the terms of one row that are integrated explicitly, to `out`, which holds the
    /// model's acceleration by stresses in planes; the Laplacian along the implicit axes goes to
    /// the scratch.
    fn explicit_row(&self, [axis, j, k]: [usize; 3], out: &mut [f64], scratch: &mut Scratch) {
        let ops = &self.ops[axis];
        if self.model.is_some() {
            scratch.model.copy_from_slice(out);
        }
        let velocity = self.state.velocity.each_ref().map(|field| &field[..]);
        scratch.convection(ops, velocity, j, k);
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
    }

    /// Adds the work that viscosity, model and force do on one row, whose terms are in the scratch.
    fn add_powers(&self, [axis, j, k]: [usize; 3], scratch: &Scratch, powers: &mut Powers) {
        let nu = self.settings.viscosity_m2_s;
        let force = self.settings.force_m_s2[self.layout.direction[axis]];
        let own = &self.state.velocity[axis][self.layout.shape.row(j, k)];
        let (across, along) = self.ops[axis].row_mass(j, k);
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
    let explicit = &explicit[..n];
    let convection = &convection[..n];
    for i in 0..n {
        out[i] = nu * explicit[i] - convection[i] + force;
    }
}

/// `predicted = dt (c N + c' N' - grad p + nu L u) + w u`, `w` being the weight of the velocity `u`
/// in the predicted field and `N` what `predicted` held, which goes into the previous terms.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn advance_row(
    prediction: &Prediction,
    nu: f64,
    predicted: &mut [f64],
    previous: &mut [f64],
    implicit: &[f64],
    pressure: &[f64],
    own: &[f64],
) {
    let Stage { new, old, .. } = prediction.stage;
    let stage_s = prediction.stage_s;
    let velocity_weight = if prediction.is_increment { 0.0 } else { 1.0 };
    let n = predicted.len();
    let previous = &mut previous[..n];
    let implicit = &implicit[..n];
    let pressure = &pressure[..n];
    let own = &own[..n];
    for i in 0..n {
        let term = predicted[i];
        let total = new * term + old * previous[i] - pressure[i] + nu * implicit[i];
        previous[i] = term;
        predicted[i] = stage_s * total + velocity_weight * own[i];
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
            assert_eq!(seen, 3 * shape.own_range().len());
        }
    }
}
