//! The subgrid stress `2 nu S` and its divergence.
//!
//! Diagonal strains live at the centres, `m^-1 Dw u`; the others at the edges, half the sum of the
//! two gradients, with the mean viscosity of the four centres about the edge. The divergence is
//! built from the transposed operators, so that the work that it does on the flow is
//! `-sum weights tau:S`, for any viscosity, mesh and wall. Edges on walls carry no stress: an eddy
//! viscosity vanishes at a no-slip wall, and so does the strain at a slip wall.
//!
//! Of the divergence, what comes from the stresses in a plane of axis 2 goes to fields that the
//! flow lends; for the rest the three stresses that act across that axis are kept.
//!
//! Check: the energy identity to round-off.

use multiversion::multiversion;
use rayon::prelude::*;

use super::super::row_operator::RowOperator;
use super::super::rows::{HALO, cut_rows, pad};
use super::operators::{Operators, Row};
use crate::solver::aligned::Aligned;

/// The stress by the viscosity at the centres and the strain of `velocity`: `across` gets `tau_02`,
/// `tau_12` at the edges and `tau_22` at the centres \[m^2/s^2\], `in_plane` the acceleration of
/// each component by the stresses whose divergence is taken along the axes 0 and 1 \[m/s^2\].
pub(super) fn update_stress(
    operators: &Operators,
    viscosity: &[f64],
    velocity: [&[f64]; 3],
    across: &mut [Aligned; 3],
    in_plane: &mut [Aligned; 3],
) {
    let shape = operators.shape;
    let n = shape.n[0];
    let plane = shape.plane();
    let [a0, a1, a2] = in_plane
        .each_mut()
        .map(|field| field[shape.own_range()].par_chunks_mut(plane));
    let [t0, t1, t2] = across
        .each_mut()
        .map(|field| field[shape.own_range()].par_chunks_mut(plane));
    (a0, a1, a2, t0, t1, t2, shape.own())
        .into_par_iter()
        .for_each_init(
            || [plane, plane, n, n, n + 2 * HALO].map(|length| vec![0.0; length]),
            |scratch, (a0, a1, a2, t0, t1, t2, k)| {
                stress_plane(
                    operators,
                    viscosity,
                    velocity,
                    k,
                    [a0, a1, a2],
                    [t0, t1, t2],
                    scratch,
                );
            },
        );
}

/// Adds the divergence of the stresses `across` the planes to the acceleration of the row `at` of a
/// component \[m/s^2\].
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn add_divergence_row(
    operator: &RowOperator,
    across: &[f64],
    at: [usize; 2],
    out: &mut [f64],
) {
    operator.add_across(out, across, at);
}

/// The stresses of plane `k` and the acceleration by those in it. Of the buffers `shear` holds
/// `tau_01` and `normal` `tau_11` of the plane, the others rows.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn stress_plane(
    operators: &Operators,
    viscosity: &[f64],
    velocity: [&[f64]; 3],
    k: usize,
    [in_0, in_1, in_2]: [&mut [f64]; 3],
    [across_0, across_1, across_2]: [&mut [f64]; 3],
    [shear, normal, diagonal, sum, padded]: &mut [Vec<f64>; 5],
) {
    let shape = operators.shape;
    let n = shape.n[0];
    for j in 0..shape.n[1] {
        let row = Row {
            operators,
            velocity,
            at: [j, k],
        };
        let place = j * n..(j + 1) * n;
        let before_j = operators.before(1, j);
        let before_k = operators.before(2, k);
        // Viscosities of the row itself and of those before it along the axes 1, 2 and both.
        let nu = &viscosity[shape.row(j, k)];
        let nu_before_1 = &viscosity[shape.row(before_j, k)];
        let nu_before_2 = &viscosity[shape.row(j, before_k)];
        let nu_before_both = &viscosity[shape.row(before_j, before_k)];
        row.diagonal(nu, 0, diagonal, padded);
        operators.to_faces[0].along(&mut in_0[place.clone()], diagonal, padded);
        row.diagonal(nu, 1, &mut normal[place.clone()], padded);
        row.diagonal(nu, 2, &mut across_2[place.clone()], padded);
        sum_of_two(sum, nu_before_1, nu);
        row.edge_along(sum, 1, &mut shear[place.clone()], padded);
        operators.to_cells[0].along(&mut in_1[place.clone()], &shear[place.clone()], padded);
        sum_of_two(sum, nu_before_2, nu);
        row.edge_along(sum, 2, &mut across_0[place.clone()], padded);
        operators.to_cells[0].along(&mut in_2[place.clone()], &across_0[place.clone()], padded);
        let across_1 = &mut across_1[place];
        row.shear_strain([1, 2], across_1, padded);
        scale_by_mean(across_1, [nu_before_both, nu_before_2, nu_before_1, nu]);
    }
    for j in 0..shape.n[1] {
        let place = j * n..(j + 1) * n;
        operators.to_cells[1].add_in_plane(&mut in_0[place.clone()], shear, j);
        operators.to_faces[1].add_in_plane(&mut in_1[place.clone()], normal, j);
        operators.to_cells[1].add_in_plane(&mut in_2[place], across_1, j);
    }
}

impl Row<'_> {
    /// `tau_aa` at the centres.
    #[inline(always)]
    fn diagonal(&self, viscosity: &[f64], axis: usize, out: &mut [f64], padded: &mut [f64]) {
        out.fill(0.0);
        self.operators.to_cells[axis].add(out, self.velocity[axis], self.at, padded);
        for (out, viscosity) in out.iter_mut().zip(viscosity) {
            *out *= 2.0 * viscosity;
        }
    }

    /// `2 S_ab` at the edges.
    #[inline(always)]
    fn shear_strain(&self, [a, b]: [usize; 2], out: &mut [f64], padded: &mut [f64]) {
        out.fill(0.0);
        self.operators.to_faces[b].add(out, self.velocity[a], self.at, padded);
        self.operators.to_faces[a].add(out, self.velocity[b], self.at, padded);
    }

    /// `tau_0b` at the edges from the viscosity summed over the two centres beside each face of
    /// axis `b`.
    #[inline(always)]
    fn edge_along(&self, viscosity: &[f64], b: usize, out: &mut [f64], padded: &mut [f64]) {
        let n = out.len();
        self.shear_strain([0, b], out, padded);
        pad(padded, viscosity, self.operators.periodic[0]);
        let low = &padded[HALO - 1..][..n];
        let high = &padded[HALO..][..n];
        for i in 0..n {
            out[i] *= 0.25 * (low[i] + high[i]);
        }
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
