//! The subgrid stress `2 nu S` and its divergence.
//!
//! Diagonal strains live at the centres, `m^-1 Dw u`; the others at the edges, half the sum of the two gradients, with the
//! mean viscosity of the four centres about the edge. The divergence is built from the transposed operators, so that the
//! work that it does on the flow is `-sum weights tau:S`, for any viscosity, mesh and wall. Edges on walls carry no stress:
//! an eddy viscosity vanishes at a no-slip wall, and so does the strain at a slip wall.
//!
//! Of the divergence, what comes from the stresses in a plane of axis 2 goes to fields that the flow lends; for the rest the three
//! stresses that act across that axis are kept.
//!
//! Check: the energy identity to round-off.

use multiversion::multiversion;
use rayon::prelude::*;

use super::super::row_operator::RowOperator;
use super::super::rows::{HALO, cut_rows, pad};
use super::operators::Operators;
use crate::solver::aligned::Aligned;

/// What the divergence needs of the stress.
#[derive(Debug, Clone)]
pub(super) struct Stress {
    /// `tau_02`, `tau_12` at the edges and `tau_22` at the centres \[m^2/s^2\].
    pub(super) across: [Aligned; 3],
}

#[derive(Debug)]
struct Scratch {
    /// `tau_01` of a plane.
    shear: Vec<f64>,
    /// `tau_11` of a plane.
    normal: Vec<f64>,
    row: Vec<f64>,
    viscosity: Vec<f64>,
    padded: Vec<f64>,
}

/// One plane of each array that is written.
struct Planes<'a> {
    in_plane: [&'a mut [f64]; 3],
    across: [&'a mut [f64]; 3],
}

impl Stress {
    pub(super) fn new(cells: usize) -> Self {
        Self { across: [0, 1, 2].map(|_| Aligned::zeros(cells)) }
    }

    /// The stress by the viscosity at the centres and the strain of `velocity`. `in_plane` gets the acceleration of each component by
    /// the stresses whose divergence is taken along the axes 0 and 1 \[m/s^2\].
    pub(super) fn update(
        &mut self,
        operators: &Operators,
        viscosity: &[f64],
        velocity: [&[f64]; 3],
        in_plane: &mut [Aligned; 3],
    ) {
        let shape = operators.shape;
        let (n, plane) = (shape.n[0], shape.plane());
        let [a0, a1, a2] = in_plane.each_mut().map(|field| field[shape.own_places()].par_chunks_mut(plane));
        let [t0, t1, t2] = self.across.each_mut().map(|field| field[shape.own_places()].par_chunks_mut(plane));
        (a0, a1, a2, t0, t1, t2, shape.own()).into_par_iter().for_each_init(
            || Scratch {
                shear: vec![0.0; plane],
                normal: vec![0.0; plane],
                row: vec![0.0; n],
                viscosity: vec![0.0; n],
                padded: vec![0.0; n + 2 * HALO],
            },
            |scratch, (a0, a1, a2, t0, t1, t2, k)| {
                let mut planes = Planes { in_plane: [a0, a1, a2], across: [t0, t1, t2] };
                stress_plane(operators, viscosity, velocity, k, &mut planes, scratch);
            },
        );
    }

    /// Adds the divergence of the stresses across the planes to the acceleration of the row `at` of `component` \[m/s^2\].
    pub(super) fn add_divergence_row(&self, operators: &Operators, component: usize, at: [usize; 2], out: &mut [f64]) {
        let operator = if component == 2 { &operators.to_faces[2] } else { &operators.to_cells[2] };
        add_divergence_row(operator, &self.across[component], at, out);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn add_divergence_row(operator: &RowOperator, across: &[f64], at: [usize; 2], out: &mut [f64]) {
    operator.add_across(out, across, at);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn stress_plane(
    operators: &Operators,
    viscosity: &[f64],
    velocity: [&[f64]; 3],
    k: usize,
    planes: &mut Planes<'_>,
    scratch: &mut Scratch,
) {
    let shape = operators.shape;
    let n = shape.n[0];
    for j in 0..shape.n[1] {
        let (at, place) = ([j, k], j * n..(j + 1) * n);
        let [in_0, in_1, in_2] = &mut planes.in_plane;
        let (in_0, in_1, in_2) = (&mut in_0[place.clone()], &mut in_1[place.clone()], &mut in_2[place.clone()]);
        let [across_0, across_1, across_2] = &mut planes.across;
        let (across_0, across_1) = (&mut across_0[place.clone()], &mut across_1[place.clone()]);
        let across_2 = &mut across_2[place.clone()];
        let Scratch { shear, normal, row, viscosity: sum, padded } = scratch;
        let (shear, normal) = (&mut shear[place.clone()], &mut normal[place]);
        let (before_j, before_k) = (operators.before(1, j), operators.before(2, k));
        let nu = |j: usize, k: usize| &viscosity[shape.row(j, k)];

        diagonal(operators, nu(j, k), velocity, 0, at, row, padded);
        in_0.fill(0.0);
        operators.to_faces[0].add_along(in_0, row, padded);
        diagonal(operators, nu(j, k), velocity, 1, at, normal, padded);
        diagonal(operators, nu(j, k), velocity, 2, at, across_2, padded);

        sum_of_two(sum, nu(before_j, k), nu(j, k));
        edge_along(operators, sum, velocity, 1, at, shear, padded);
        in_1.fill(0.0);
        operators.to_cells[0].add_along(in_1, shear, padded);

        sum_of_two(sum, nu(j, before_k), nu(j, k));
        edge_along(operators, sum, velocity, 2, at, across_0, padded);
        in_2.fill(0.0);
        operators.to_cells[0].add_along(in_2, across_0, padded);

        shear_strain(operators, velocity, [1, 2], at, across_1, padded);
        scale_by_mean(across_1, [nu(before_j, before_k), nu(j, before_k), nu(before_j, k), nu(j, k)]);
    }
    for j in 0..shape.n[1] {
        let [in_0, in_1, in_2] = planes.in_plane.each_mut().map(|plane| &mut plane[j * n..(j + 1) * n]);
        operators.to_cells[1].add_in_plane(in_0, &scratch.shear, j);
        operators.to_faces[1].add_in_plane(in_1, &scratch.normal, j);
        operators.to_cells[1].add_in_plane(in_2, planes.across[1], j);
    }
}

/// `tau_aa` at the centres.
#[inline(always)]
fn diagonal(
    operators: &Operators,
    viscosity: &[f64],
    velocity: [&[f64]; 3],
    axis: usize,
    at: [usize; 2],
    out: &mut [f64],
    padded: &mut [f64],
) {
    out.fill(0.0);
    operators.to_cells[axis].add(out, velocity[axis], at, padded);
    for (out, viscosity) in out.iter_mut().zip(viscosity) {
        *out *= 2.0 * viscosity;
    }
}

/// `2 S_ab` at the edges.
#[inline(always)]
fn shear_strain(
    operators: &Operators,
    velocity: [&[f64]; 3],
    [a, b]: [usize; 2],
    at: [usize; 2],
    out: &mut [f64],
    padded: &mut [f64],
) {
    out.fill(0.0);
    operators.to_faces[b].add(out, velocity[a], at, padded);
    operators.to_faces[a].add(out, velocity[b], at, padded);
}

/// `tau_0b` at the edges from the viscosity summed over the two centres beside each face of axis `b`.
#[inline(always)]
fn edge_along(
    operators: &Operators,
    viscosity: &[f64],
    velocity: [&[f64]; 3],
    b: usize,
    at: [usize; 2],
    out: &mut [f64],
    padded: &mut [f64],
) {
    let n = out.len();
    shear_strain(operators, velocity, [0, b], at, out, padded);
    pad(padded, viscosity, operators.periodic[0]);
    let (low, high) = (&padded[HALO - 1..][..n], &padded[HALO..][..n]);
    for i in 0..n {
        out[i] *= 0.25 * (low[i] + high[i]);
    }
}

#[inline(always)]
fn sum_of_two(out: &mut [f64], a: &[f64], b: &[f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = a + b;
    }
}

#[inline(always)]
fn scale_by_mean(out: &mut [f64], rows: [&[f64]; 4]) {
    let n = out.len();
    let [a, b, c, d] = cut_rows!(rows, n, 0 1 2 3);
    for i in 0..n {
        out[i] *= 0.25 * ((a[i] + b[i]) + (c[i] + d[i]));
    }
}
