//! Convection of one row of a velocity component: what `literal` does point by point, the formulas of which stand there.
//!
//! Check: the literal form on every kind of mesh.

use multiversion::multiversion;

use super::momentum::{FluxCache, Momentum, SLOTS, Scratch};
use super::rows::{
    HALO, add_product, add_transport, cut_rows, even_mean, from_places, pad, round, rows_from,
};
use super::transport::{MEAN, Transport};

/// The row that is computed: indices `j` and `k` along the axes 1 and 2.
struct Row<'a> {
    ops: &'a Momentum,
    velocity: [&'a [f64]; 3],
    j: usize,
    k: usize,
}

impl Scratch {
    /// Convection of one row into `self.convection`. A scratch belongs to one component of one velocity field.
    pub(crate) fn convection(&mut self, ops: &Momentum, velocity: [&[f64]; 3], j: usize, k: usize) {
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

/// Convection of row `(j, k)`, `(u . grad) u_a`, with its sign as on the left of the momentum equation \[m/s^2\].
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
            across_rows(row, axis, out, padded, (&mut flux[0], cache));
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
    let n = out.len();
    let periodic = ops.periodic[0];
    let start = ops.shape.place([0, j, k]);
    let [values, fluxes] = padded;
    pad(values, &velocity[ops.axis][start..start + n], periodic);
    let transport = &ops.transport[0];
    if ops.axis == 0 {
        // Mean fluxes of the cells -2 to n + 1, at which the padded places 2 to n + 5 hold them.
        for c in 2..n + 6 {
            fluxes[c] = (MEAN[0] * values[c - 1] + MEAN[1] * values[c])
                + (MEAN[2] * values[c + 1] + MEAN[3] * values[c + 2]);
        }
        let at = |offset: usize| &fluxes[HALO + offset - 3..];
        let q = |offset: usize| &values[HALO + offset - 3..];
        let values = [q(0), q(1), q(2), q(3), q(4), q(5), q(6)];
        add_transport(
            out,
            1.0,
            transport.stencil,
            &[at(1), at(2), at(3), at(4)],
            &values,
        );
        if !periodic {
            // Columns to which the formula of the interior does not apply are replaced.
            let values = &velocity[0][start..start + n];
            for i in irregular(transport, n) {
                out[i] = transport.rows[i]
                    .iter()
                    .map(|&(face, cell, c)| c * values[face] * values[cell])
                    .sum();
            }
        }
    } else {
        flux_row(target, 0, 0, &mut flux[0], fluxes);
        pad(fluxes, &flux[0], periodic);
        let at = |offset: usize| &fluxes[HALO + offset - 1..];
        let q = |offset: usize| &values[HALO + offset - 3..];
        let line = &mut flux[1];
        line.fill(0.0);
        let values = [q(0), q(1), q(2), q(3), q(4), q(5), q(6)];
        add_transport(
            line,
            1.0,
            transport.stencil,
            &[at(0), at(1), at(2), at(3)],
            &values,
        );
        let inverse = &ops.inverse_cell_mass[0];
        for ((out, line), inverse) in out.iter_mut().zip(line.iter()).zip(inverse) {
            *out += inverse * line;
        }
        if !periodic {
            // The regular formula was added to every column; the others are computed anew.
            let (done, fresh) = (&flux[1], &flux[0]);
            let values = &velocity[ops.axis][start..start + n];
            for i in irregular(transport, n) {
                let sum: f64 = transport.rows[i]
                    .iter()
                    .map(|&(face, cell, c)| c * fresh[face] * values[cell])
                    .sum();
                out[i] += inverse[i] * (sum - done[i]);
            }
        }
    }
}

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
    (fresh, cache): (&mut [f64], &mut FluxCache),
) {
    let &Row {
        ops,
        ref velocity,
        j,
        k,
    } = target;
    let length = out.len();
    let index = if axis == 1 { j } else { k };
    let count = ops.shape.n[axis];
    let transport = &ops.transport[axis];
    let scale = if axis == ops.axis {
        1.0
    } else {
        ops.inverse_cell_mass[axis][index]
    };
    let values = velocity[ops.axis];
    let rows = ops.shape.row_offsets(axis, [j, k]);
    if ops.periodic[axis] || transport.regular.contains(&index) {
        // The row itself is the fourth; a regular row of a bounded direction never wraps.
        let first = index + count - 3;
        let q = rows_from::<7>(values, length, rows, first, count);
        let (values, offsets) = (&mut cache.values[axis - 1], &mut cache.offsets[axis - 1]);
        // The flux at offset 2 to 5 from the row has the same place for all four rows on which it acts.
        let (across, j_of) = if axis == 1 {
            (1, 0)
        } else {
            (ops.shape.n[1], j)
        };
        let mut places = [0; SLOTS];
        for slot in 0..SLOTS {
            let place = (first + slot + 2) % SLOTS * across + j_of;
            let face = round(first + slot + 2, count);
            let start = rows.of(face);
            places[slot] = place * length;
            if offsets[place] != start {
                offsets[place] = start;
                let flux = &mut values[place * length..][..length];
                if axis == ops.axis {
                    mean_row(flux, [q[slot], q[slot + 1], q[slot + 2], q[slot + 3]]);
                } else {
                    flux_row(target, axis, face, flux, &mut padded[0]);
                }
            }
        }
        let flux = from_places!(values, places[0], places[1], places[2], places[3]);
        add_transport(out, scale, transport.stencil, &flux, &q);
    } else {
        for &(face, cell, c) in &transport.rows[index] {
            let value = &values[rows.of(cell)..][..length];
            if axis == ops.axis {
                add_product(out, scale * c, &values[rows.of(face)..][..length], value);
            } else {
                flux_row(target, axis, face, fresh, &mut padded[0]);
                add_product(out, scale * c, fresh, value);
            }
        }
    }
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

/// The flux along `along` through its face `face`, weighted along the component's axis and brought to its faces.
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
