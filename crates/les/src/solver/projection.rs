//! The projection onto divergence-free fields: the weighted divergence, and the correction by the
//! gradient of the pressure.
//!
//! Check: adjointness with the gradient, divergence after a projection (tests of `flow`).

use multiversion::multiversion;
use rayon::prelude::*;

use super::component_operators::{ComponentOperators, Scratch};
use super::layout::{Layout, Shape};
use super::row_operator::RowOperator;
use super::rows::{HALO, add_across, wrap};

/// The weighted divergence `sum_b (prod_{d != b} m_d) Dw_b u_b` \[m^3/s\].
#[derive(Debug, Clone)]
pub(crate) struct Divergence {
    shape: Shape,
    along: [RowOperator; 3],
    cell_mass: [Vec<f64>; 3],
    /// What the third component needs of its halos.
    pub(super) reach: [usize; 2],
}

impl Divergence {
    pub(crate) fn new(layout: &Layout) -> Self {
        let along = std::array::from_fn(|b| {
            RowOperator::new(layout, b, layout.line[b].stored_divergence())
        });
        Self {
            shape: layout.shape,
            reach: layout.slabs.reach(&along[2].rows),
            along,
            cell_mass: std::array::from_fn(|b| layout.line[b].cell_mass_m.clone()),
        }
    }

    /// Writes `scale` times the weighted divergence of `velocity` to `out`.
    pub(crate) fn apply(&self, velocity: [&[f64]; 3], scale: f64, out: &mut [f64]) {
        let n = self.shape.n[0];
        let planes = out[self.shape.own_range()]
            .par_chunks_mut(self.shape.plane())
            .zip(self.shape.own());
        planes.for_each_init(
            || vec![0.0; n + 2 * HALO],
            |padded, (plane, k)| {
                for (j, row) in plane.chunks_mut(n).enumerate() {
                    divergence_row(self, velocity, scale, j, k, row, padded);
                }
            },
        );
    }

    /// Largest modulus of the divergence in the planes that are owned \[1/s\].
    pub(crate) fn largest_per_s(&self, velocity: [&[f64]; 3]) -> f64 {
        let n = self.shape.n[0];
        let largest = self.shape.own().into_par_iter().map_init(
            || (vec![0.0; n + 2 * HALO], vec![0.0; n]),
            |(padded, row), k| {
                let mut largest = 0.0_f64;
                for j in 0..self.shape.n[1] {
                    divergence_row(self, velocity, 1.0, j, k, row, padded);
                    let across = self.cell_mass[1][j] * self.cell_mass[2][k];
                    for (value, mass) in row.iter().zip(&self.cell_mass[0]) {
                        largest = largest.max((value / (mass * across)).abs());
                    }
                }
                largest
            },
        );
        largest.reduce(|| 0.0, f64::max)
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn divergence_row(
    ops: &Divergence,
    velocity: [&[f64]; 3],
    scale: f64,
    j: usize,
    k: usize,
    out: &mut [f64],
    padded: &mut [f64],
) {
    let n = out.len();
    let mass_1 = scale * ops.cell_mass[1][j];
    let mass_2 = scale * ops.cell_mass[2][k];
    out.fill(0.0);
    add_across(
        out,
        velocity[1],
        mass_2,
        &ops.along[1].rows[j],
        ops.shape.row_offsets(1, [j, k]),
    );
    add_across(
        out,
        velocity[2],
        mass_1,
        &ops.along[2].rows[k],
        ops.shape.row_offsets(2, [j, k]),
    );
    for (out, mass) in out.iter_mut().zip(&ops.cell_mass[0]) {
        *out *= mass;
    }
    let across = mass_1 * ops.cell_mass[2][k];
    let start = ops.shape.place([0, j, k]);
    for (to, from) in padded[HALO..]
        .iter_mut()
        .zip(&velocity[0][start..start + n])
    {
        *to = across * from;
    }
    wrap(padded, n, ops.along[0].periodic);
    ops.along[0].columns.add(out, padded);
}

/// `velocity = predicted - scale grad(phi)`; returns of each plane `1/2 sum mass u^2` \[m^5/s^2\]
/// and the largest `sum_a |u_a|/h_a` \[1/s\].
pub(crate) fn correct(
    ops: &[ComponentOperators; 3],
    predicted: [&[f64]; 3],
    phi: &[f64],
    scale: f64,
    velocity: &mut [&mut [f64]; 3],
) -> Vec<[f64; 2]> {
    let shape = ops[0].shape;
    let n = shape.n[0];
    let [u, v, w] = velocity
        .each_mut()
        .map(|field| field[shape.own_range()].par_chunks_mut(shape.plane()));
    (u, v, w, shape.own())
        .into_par_iter()
        .map_init(
            || (Scratch::new(n), vec![0.0; n], vec![0.0; n]),
            |(scratch, rate, across_metric), (u, v, w, k)| {
                let mut planes = [u, v, w];
                let mut energy = 0.0;
                let mut courant_per_s = 0.0;
                for j in 0..shape.n[1] {
                    rate.fill(0.0);
                    for ((a, ops), plane) in ops.iter().enumerate().zip(&mut planes) {
                        scratch.gradient(ops, phi, j, k);
                        let (across, mass) = ops.row_mass(j, k);
                        let inverse_metric = if a == 0 {
                            &ops.inverse_metric
                        } else {
                            across_metric.fill(ops.inverse_metric[[j, k][a - 1]]);
                            &*across_metric
                        };
                        let squares = correct_row(
                            &mut plane[j * n..(j + 1) * n],
                            &predicted[a][shape.row(j, k)],
                            &scratch.pressure,
                            mass,
                            inverse_metric,
                            scale,
                            rate,
                        );
                        energy += 0.5 * across * squares;
                    }
                    for &value in rate.iter() {
                        if value > courant_per_s {
                            courant_per_s = value;
                        }
                    }
                }
                [energy, courant_per_s]
            },
        )
        .collect()
}

/// Corrects one row, adds its part of the Courant rate, and returns `sum mass u^2`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn correct_row(
    row: &mut [f64],
    predicted: &[f64],
    gradient: &[f64],
    mass: &[f64],
    inverse_metric: &[f64],
    scale: f64,
    rate: &mut [f64],
) -> f64 {
    let n = row.len();
    let predicted = &predicted[..n];
    let gradient = &gradient[..n];
    let mass = &mass[..n];
    let inverse_metric = &inverse_metric[..n];
    let rate = &mut rate[..n];
    for i in 0..n {
        row[i] = predicted[i] - scale * gradient[i];
        rate[i] += row[i].abs() * inverse_metric[i];
    }
    weighted_dot(row, row, mass)
}

/// `sum mass x y` with fixed lanes, so that the sum vectorises and does not depend on the
/// instruction set.
#[inline(always)]
pub(crate) fn weighted_dot(x: &[f64], y: &[f64], mass: &[f64]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let (x, x_rest) = x.as_chunks::<LANES>();
    let (y, y_rest) = y.as_chunks::<LANES>();
    let (m, m_rest) = mass.as_chunks::<LANES>();
    for ((x, y), m) in x.iter().zip(y).zip(m) {
        for i in 0..LANES {
            sums[i] += m[i] * (x[i] * y[i]);
        }
    }
    let products = x_rest.iter().zip(y_rest);
    let rest: f64 = products.zip(m_rest).map(|((x, y), m)| m * (x * y)).sum();
    sums.iter().sum::<f64>() + rest
}
