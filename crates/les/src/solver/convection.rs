//! Convection of one row of a velocity component: what `literal` does point by point, the formulas
//! of which are given there.
//!
//! Check: the literal form on every kind of mesh.

use multiversion::multiversion;

use super::component_operators::{ComponentOperators, FluxCache, SLOTS, Scratch};
use super::rows::{
    HALO, add_product, add_transport, cut_rows, even_mean, from_places, pad, round, rows_from,
};
use super::transport::{MEAN, Transport};

/// The row that is computed: indices `j` and `k` along the axes 1 and 2.
struct Row<'a> {
    ops: &'a ComponentOperators,
    velocity: [&'a [f64]; 3],
    j: usize,
    k: usize,
}

impl Scratch {
    /// Convection of one row into `self.convection`. A scratch belongs to one component of one
    /// velocity field.
    pub(crate) fn convection(
        &mut self,
        ops: &ComponentOperators,
        velocity: [&[f64]; 3],
        j: usize,
        k: usize,
    ) {
        self.fluxes.fit(ops.shape.n);
        convection_row(
            &Row {
                ops,
                velocity,
                j,
                k,
            },
            self,
        );
    }
}

/// Convection of row `(j, k)`, `(u . grad) u_a`, with its sign as on the left of the momentum
/// equation \[m/s^2\].
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn convection_row(
    row: &Row<'_>,
    Scratch {
        convection: out,
        padded,
        flux,
        fluxes: cache,
        ..
    }: &mut Scratch,
) {
    let &Row { ops, j, k, .. } = row;
    out.fill(0.0);
    if !ops.thin[0] {
        along_row(row, out, padded, flux);
    }
    for axis in 1..3 {
        if !ops.thin[axis] {
            across_rows(row, axis, out, padded, &mut flux[0], cache);
        }
    }
    match ops.axis {
        0 => {
            for (out, inverse) in out.iter_mut().zip(&ops.inverse_face_mass) {
                *out *= inverse;
            }
        }
        axis => {
            let inverse = ops.inverse_face_mass[if axis == 1 { j } else { k }];
            for out in out.iter_mut() {
                *out *= inverse;
            }
        }
    }
}

/// The part of the convection along axis 0.
#[inline(always)]
fn along_row(
    target: &Row<'_>,
    out: &mut [f64],
    padded: &mut [Vec<f64>; 2],
    flux: &mut [Vec<f64>; 2],
) {
    let &Row {
        ops,
        ref velocity,
        j,
        k,
    } = target;
    let own = &velocity[ops.axis][ops.shape.place([0, j, k])..][..out.len()];
    let [values, fluxes] = padded;
    pad(values, own, ops.periodic[0]);
    if ops.axis == 0 {
        own_flux_along(ops, own, out, values, fluxes);
    } else {
        flux_row(target, 0, 0, &mut flux[0], fluxes);
        weighted_flux_along(ops, own, out, values, fluxes, flux);
    }
}

/// Convection along axis 0 of the velocity along that axis by itself.
#[inline(always)]
fn own_flux_along(
    ops: &ComponentOperators,
    own: &[f64],
    out: &mut [f64],
    values: &[f64],
    fluxes: &mut [f64],
) {
    let n = out.len();
    let transport = &ops.transport[0];
    // Mean fluxes of the cells -2 to n + 1, at which the padded places 2 to n + 5 hold them.
    for c in 2..n + 6 {
        fluxes[c] = (MEAN[0] * values[c - 1] + MEAN[1] * values[c])
            + (MEAN[2] * values[c + 1] + MEAN[3] * values[c + 2]);
    }
    let flux = from_places!(fluxes, HALO - 2, HALO - 1, HALO, HALO + 1);
    add_transport(out, 1.0, transport.stencil, &flux, &stencil_values(values));
    if !ops.periodic[0] {
        // Columns to which the formula of the interior does not apply are replaced.
        for i in irregular(transport, n) {
            out[i] = transport.rows[i]
                .iter()
                .map(|&(face, cell, c)| c * own[face] * own[cell])
                .sum();
        }
    }
}

/// Convection along axis 0 of another component by the weighted fluxes, the first row of `flux`;
/// the second is a work row.
#[inline(always)]
fn weighted_flux_along(
    ops: &ComponentOperators,
    own: &[f64],
    out: &mut [f64],
    values: &[f64],
    fluxes: &mut [f64],
    flux: &mut [Vec<f64>; 2],
) {
    let n = out.len();
    let transport = &ops.transport[0];
    let [at_faces, line] = flux;
    pad(fluxes, at_faces, ops.periodic[0]);
    line.fill(0.0);
    let padded_flux = from_places!(fluxes, HALO - 1, HALO, HALO + 1, HALO + 2);
    let values = stencil_values(values);
    add_transport(line, 1.0, transport.stencil, &padded_flux, &values);
    let inverse = &ops.inverse_cell_mass[0];
    for ((out, line), inverse) in out.iter_mut().zip(line.iter()).zip(inverse) {
        *out += inverse * line;
    }
    if !ops.periodic[0] {
        // The regular formula was added to every column; the others are computed anew.
        for i in irregular(transport, n) {
            let sum: f64 = transport.rows[i]
                .iter()
                .map(|&(face, cell, c)| c * at_faces[face] * own[cell])
                .sum();
            out[i] += inverse[i] * (sum - line[i]);
        }
    }
}

/// The values at -3 to 3 of a padded row.
#[inline(always)]
fn stencil_values(padded: &[f64]) -> [&[f64]; 7] {
    from_places!(
        padded,
        HALO - 3,
        HALO - 2,
        HALO - 1,
        HALO,
        HALO + 1,
        HALO + 2,
        HALO + 3
    )
}

/// Columns to which the formula of the interior does not apply.
fn irregular(transport: &Transport, n: usize) -> impl Iterator<Item = usize> + use<> {
    let regular = transport.regular.clone();
    (0..n).filter(move |i| !regular.contains(i))
}

/// The part of the convection along axis 1 or 2.
#[inline(always)]
fn across_rows(
    target: &Row<'_>,
    axis: usize,
    out: &mut [f64],
    padded: &mut [Vec<f64>; 2],
    fresh_flux: &mut [f64],
    cache: &mut FluxCache,
) {
    let &Row {
        ops,
        ref velocity,
        j,
        k,
    } = target;
    let length = out.len();
    let index = if axis == 1 { j } else { k };
    let transport = &ops.transport[axis];
    let scale = if axis == ops.axis {
        1.0
    } else {
        ops.inverse_cell_mass[axis][index]
    };
    if ops.periodic[axis] || transport.regular.contains(&index) {
        across_regular_rows(target, axis, index, scale, out, &mut padded[0], cache);
        return;
    }
    let values = velocity[ops.axis];
    let rows = ops.shape.row_offsets(axis, [j, k]);
    for &(face, cell, c) in &transport.rows[index] {
        let value = &values[rows.start(cell)..][..length];
        if axis == ops.axis {
            let flux = &values[rows.start(face)..][..length];
            add_product(out, scale * c, flux, value);
        } else {
            flux_row(target, axis, face, fresh_flux, &mut padded[0]);
            add_product(out, scale * c, fresh_flux, value);
        }
    }
}

/// Convection along axis 1 or 2 by the formula of the interior; fluxes that other rows have
/// computed come from the cache.
#[inline(always)]
fn across_regular_rows(
    target: &Row<'_>,
    axis: usize,
    index: usize,
    scale: f64,
    out: &mut [f64],
    padded: &mut [f64],
    cache: &mut FluxCache,
) {
    let &Row {
        ops,
        ref velocity,
        j,
        k,
    } = target;
    let length = out.len();
    let count = ops.shape.n[axis];
    let rows = ops.shape.row_offsets(axis, [j, k]);
    // The row itself is the fourth; a regular row of a bounded direction never wraps.
    let first = index + count - 3;
    let q = rows_from::<7>(velocity[ops.axis], length, rows, first, count);
    let values = &mut cache.values[axis - 1];
    let offsets = &mut cache.offsets[axis - 1];
    // The flux at offset 2 to 5 from the row has the same place for all four rows on which it acts.
    let places_per_slot = if axis == 1 { 1 } else { ops.shape.n[1] };
    let place_in_slot = if axis == 1 { 0 } else { j };
    let mut places = [0; SLOTS];
    for slot in 0..SLOTS {
        let place = (first + slot + 2) % SLOTS * places_per_slot + place_in_slot;
        let face = round(first + slot + 2, count);
        let start = rows.start(face);
        places[slot] = place * length;
        if offsets[place] != start {
            offsets[place] = start;
            let flux = &mut values[place * length..][..length];
            if axis == ops.axis {
                mean_row(flux, [q[slot], q[slot + 1], q[slot + 2], q[slot + 3]]);
            } else {
                flux_row(target, axis, face, flux, padded);
            }
        }
    }
    let flux = from_places!(values, places[0], places[1], places[2], places[3]);
    add_transport(out, scale, ops.transport[axis].stencil, &flux, &q);
}

/// Mean flux of a cell from the fluxes at the four faces about it.
#[inline(always)]
fn mean_row(out: &mut [f64], rows: [&[f64]; 4]) {
    let n = out.len();
    let [a, b, c, d] = cut_rows!(rows, n, 0 1 2 3);
    for i in 0..n {
        out[i] = (MEAN[0] * a[i] + MEAN[1] * b[i]) + (MEAN[2] * c[i] + MEAN[3] * d[i]);
    }
}

/// The flux along `along` through its face `face`, weighted along the component's axis and brought
/// to its faces.
#[inline(always)]
fn flux_row(target: &Row<'_>, along: usize, face: usize, out: &mut [f64], padded: &mut [f64]) {
    let &Row {
        ops,
        ref velocity,
        mut j,
        mut k,
    } = target;
    let field = velocity[along];
    let n = out.len();
    match along {
        1 => j = face,
        2 => k = face,
        _ => {}
    }
    if ops.axis == 0 {
        let row = &field[ops.shape.row(j, k)];
        if let Some(mass) = ops.equal_mass {
            pad(padded, row, ops.periodic[0]);
            let first = HALO - 2;
            even_mean(
                out,
                mass,
                &from_places!(padded, first, first + 1, first + 2, first + 3),
            );
            return;
        }
        out.fill(0.0);
        ops.flux_mean.add_along(out, row, padded);
        return;
    }
    let own = if ops.axis == 1 { j } else { k };
    if let Some(mass) = ops.equal_mass {
        let count = ops.shape.n[ops.axis];
        even_mean(
            out,
            mass,
            &rows_from(
                field,
                n,
                ops.shape.row_offsets(ops.axis, [j, k]),
                own + 2 * count - 2,
                count,
            ),
        );
        return;
    }
    out.fill(0.0);
    ops.flux_mean.add_across(out, field, [j, k]);
}
