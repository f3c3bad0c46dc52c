//! The operator of the pressure equation, applied to a field.
//!
//! Check: symmetry, constants, products of the directions' own operators.

use rayon::prelude::*;

use super::super::layout::{Layout, Shape};
use super::super::line::{Line, Taps};
use super::kernel;

/// `sum_b (prod_{d != b} m_d) Dw_b f_b^-1 Dw_b^T`.
#[derive(Debug)]
pub(crate) struct Operator {
    shape: Shape,
    mass_m: [Vec<f64>; 3],
    /// `Dw_b f_b^-1 Dw_b^T` of the three axes by rows.
    stiffness: [Vec<Taps>; 3],
}

impl Operator {
    /// The operator of a mesh.
    pub(crate) fn new(layout: &Layout) -> Self {
        Self {
            shape: layout.shape,
            mass_m: std::array::from_fn(|b| layout.line[b].cell_mass_m.clone()),
            stiffness: std::array::from_fn(|b| stiffness(&layout.line[b])),
        }
    }

    /// Shape of its fields.
    pub(crate) fn shape(&self) -> Shape {
        self.shape
    }

    /// Places in `residual` what `phi` leaves of the right side: `-g - A phi`.
    pub(crate) fn residual(&self, g: &[f64], phi: &[f64], residual: &mut [f64]) {
        let [n0, n1, _] = self.shape.n;
        residual.par_chunks_mut(n0).enumerate().for_each(|(r, out)| {
            let (j, k) = (r % n1, r / n1);
            let at = self.shape.row(j, k);
            for (out, g) in out.iter_mut().zip(&g[at.clone()]) {
                *out = -g;
            }
            let (m1, m2) = (self.mass_m[1][j], self.mass_m[2][k]);
            self.subtract_along_row(&phi[at], m1 * m2, out);
            for &(other, c) in &self.stiffness[1][j] {
                kernel::subtract_weighted(&phi[self.shape.row(other, k)], &self.mass_m[0], c * m2, out);
            }
            for &(other, c) in &self.stiffness[2][k] {
                kernel::subtract_weighted(&phi[self.shape.row(j, other)], &self.mass_m[0], c * m1, out);
            }
        });
    }

    /// 2-norm of the residual over that of the right side `g`.
    pub(crate) fn relative_residual(&self, g: &[f64], phi: &[f64]) -> f64 {
        let mut left = vec![0.0; g.len()];
        self.residual(g, phi, &mut left);
        let size = norm(self.shape, g);
        if size > 0.0 { norm(self.shape, &left) / size } else { 0.0 }
    }

    /// Subtracts from a right side the multiple of the cells' masses that makes its sum zero; returns the sum over the sum of
    /// the moduli.
    pub(crate) fn remove_imbalance(&self, g: &mut [f64]) -> f64 {
        let [n0, n1, _] = self.shape.n;
        let rows: Vec<[f64; 2]> = g.par_chunks(n0).map(kernel::sum_and_moduli).collect();
        let [sum, moduli] = rows.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        let volume: f64 = self.mass_m.iter().map(|mass| mass.iter().sum::<f64>()).product();
        g.par_chunks_mut(n0).enumerate().for_each(|(r, row)| {
            let mass = self.mass_m[1][r % n1] * self.mass_m[2][r / n1] * sum / volume;
            for (g, m0) in row.iter_mut().zip(&self.mass_m[0]) {
                *g -= mass * m0;
            }
        });
        if moduli > 0.0 { sum / moduli } else { 0.0 }
    }

    /// Multiplies each value by the mass of its cell.
    pub(crate) fn weigh(&self, field: &mut [f64]) {
        let [n0, n1, _] = self.shape.n;
        field.par_chunks_mut(n0).enumerate().for_each(|(r, row)| {
            let mass = self.mass_m[1][r % n1] * self.mass_m[2][r / n1];
            for (value, m0) in row.iter_mut().zip(&self.mass_m[0]) {
                *value *= mass * m0;
            }
        });
    }

    fn subtract_along_row(&self, phi: &[f64], mass: f64, out: &mut [f64]) {
        for (out, row) in out.iter_mut().zip(&self.stiffness[0]) {
            *out -= mass * row.iter().map(|&(i, c)| c * phi[i]).sum::<f64>();
        }
    }
}

/// Rows of `Dw F^-1 Dw^T`.
pub(crate) fn stiffness(line: &Line) -> Vec<Taps> {
    let divergence = line.stored_divergence();
    let mut faces = vec![Taps::new(); line.cells];
    for (cell, row) in divergence.iter().enumerate() {
        for &(face, c) in row {
            faces[face].push((cell, c));
        }
    }
    let row = |taps: &Taps| {
        let mut sums = vec![0.0; line.cells];
        for &(face, c) in taps {
            for &(cell, other) in &faces[face] {
                sums[cell] += c * other / line.face_mass_m[face];
            }
        }
        sums.into_iter().enumerate().filter(|(_, c)| *c != 0.0).collect()
    };
    divergence.iter().map(row).collect()
}

/// The weighted divergence of a flow with eddies of all sizes and one per cent of noise at the grid scale: what the time step
/// asks the solvers for.
pub(crate) fn turbulent_right_side(layout: &Layout) -> Vec<f64> {
    let shape = layout.shape;
    let n = shape.n;
    let mut g = vec![0.0; shape.len()];
    for b in 0..3 {
        let divergence = layout.line[b].stored_divergence();
        let velocity = eddies(shape, b);
        let mass = |d: usize, i: usize| if d == b { 1.0 } else { layout.line[d].cell_mass_m[i] };
        g.par_chunks_mut(n[0]).enumerate().for_each(|(r, row)| {
            let (j, k) = (r % n[1], r / n[1]);
            for (i, g) in row.iter_mut().enumerate() {
                let at = [i, j, k];
                let stride = [1, n[0], n[0] * n[1]][b];
                let line = (k * n[1] + j) * n[0] + i - at[b] * stride;
                let sum: f64 = divergence[at[b]].iter().map(|&(face, c)| c * velocity[line + face * stride]).sum();
                *g += mass(0, i) * mass(1, j) * mass(2, k) * sum;
            }
        });
    }
    g
}

/// Velocity along axis `b`: five octaves of `k^-5/3`, and noise.
fn eddies(shape: Shape, b: usize) -> Vec<f64> {
    use std::f64::consts::TAU;
    let n = shape.n;
    let wave = |d: usize, octave: usize| -> Vec<f64> {
        let k = f64::from(1 << octave);
        let angle = |i: usize| TAU * k * i as f64 / n[d] as f64 + 1.7 * (b + octave) as f64 + 0.9 * d as f64;
        (0..n[d]).map(|i| k.powf(-1.0 / 9.0) * angle(i).sin()).collect()
    };
    let waves: Vec<[Vec<f64>; 3]> = (0..5).map(|octave| std::array::from_fn(|d| wave(d, octave))).collect();
    let mut velocity = vec![0.0; shape.len()];
    velocity.par_chunks_mut(n[0]).enumerate().for_each(|(r, row)| {
        let (j, k) = (r % n[1], r / n[1]);
        for (i, velocity) in row.iter_mut().enumerate() {
            let hash = (i * 73_856_093 + j * 19_349_663 + k * 83_492_791 + b * 2_654_435) % 1_000_003;
            let eddies: f64 = waves.iter().map(|[x, y, z]| x[i] * y[j] * z[k]).sum();
            *velocity = eddies + 0.01 * (hash as f64 / 500_001.5 - 1.0);
        }
    });
    velocity
}

/// 2-norm of a field, by rows in their order.
pub(crate) fn norm(shape: Shape, field: &[f64]) -> f64 {
    let rows: Vec<f64> = field.par_chunks(shape.n[0]).map(|row| kernel::dot(row, row)).collect();
    rows.iter().sum::<f64>().sqrt()
}
