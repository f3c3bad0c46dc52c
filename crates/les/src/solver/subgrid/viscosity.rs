//! The eddy viscosity at the centres, from the gradient tensor there.
//!
//! Derivatives of a component along its own axis are the terms of the divergence; the others are
//! the means of the gradients at the four edges about a centre, edges on a wall included with the
//! gradient at the wall.
//!
//! Check: closed forms for uniform gradients, zero in shear flows, cubic growth from a wall.

use multiversion::multiversion;
use rayon::prelude::*;

use super::super::rows::{HALO, cut_rows};
use super::SubgridModel;
use super::operators::{Operators, Row};

/// Values of one row at a time.
#[derive(Debug)]
struct Scratch {
    /// `[component][axis]`.
    gradient: [[Vec<f64>; 3]; 3],
    row: Vec<f64>,
    padded: Vec<f64>,
}

/// Writes the eddy viscosity \[m^2/s\] of `velocity`, at most as large as lets no wave decay faster
/// than `limit_per_s`, and returns the largest viscosity and the largest decay rate that it would
/// have had without this limit.
pub(super) fn eddy_viscosity(
    operators: &Operators,
    model: SubgridModel,
    velocity: [&[f64]; 3],
    limit_per_s: f64,
    viscosity: &mut [f64],
) -> Largest {
    let shape = operators.shape;
    let n = shape.n[0];
    let planes = viscosity[shape.own_range()]
        .par_chunks_mut(shape.plane())
        .zip(shape.own());
    let largest = planes.map_init(
        || Scratch::new(n),
        |scratch, (plane, k)| {
            viscosity_plane(operators, model, velocity, limit_per_s, k, plane, scratch)
        },
    );
    largest.reduce(Largest::default, larger)
}

impl Scratch {
    fn new(n: usize) -> Self {
        Self {
            gradient: [0; 3].map(|_| [0; 3].map(|_| vec![0.0; n])),
            row: vec![0.0; n + 1],
            padded: vec![0.0; n + 2 * HALO],
        }
    }
}

/// The largest eddy viscosity \[m^2/s\], and the largest decay rate of the shortest waves, before
/// the limit \[1/s\].
pub(crate) type Largest = [f64; 2];

fn larger(a: Largest, b: Largest) -> Largest {
    [a[0].max(b[0]), a[1].max(b[1])]
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn viscosity_plane(
    operators: &Operators,
    model: SubgridModel,
    velocity: [&[f64]; 3],
    limit_per_s: f64,
    k: usize,
    plane: &mut [f64],
    scratch: &mut Scratch,
) -> Largest {
    let n = operators.shape.n[0];
    let mut largest = Largest::default();
    for (j, row) in plane.chunks_mut(n).enumerate() {
        Row {
            operators,
            velocity,
            at: [j, k],
        }
        .gradient(scratch);
        let across = operators.width[1][j] * operators.width[2][k];
        let gradient = &scratch.gradient;
        let width = &operators.width[0];
        match model {
            SubgridModel::None => row.fill(0.0),
            SubgridModel::Smagorinsky { constant } => {
                let scale = constant * constant * across;
                apply(row, gradient, scale, width, smagorinsky);
            }
            SubgridModel::Wale { constant } | SubgridModel::MultiscaleWale { constant, .. } => {
                apply(row, gradient, constant * constant * across, width, wale);
            }
        }
        let decay = operators.decay[1][j] + operators.decay[2][k];
        largest = larger(largest, limit(row, &operators.decay[0], decay, limit_per_s));
    }
    largest
}

/// Cuts a row at the viscosity of the largest decay rate.
#[inline(always)]
fn limit(row: &mut [f64], along: &[f64], across: f64, limit_per_s: f64) -> Largest {
    let mut largest = [Largest::default(); LANES];
    for (row, along) in row.chunks_mut(LANES).zip(along.chunks(LANES)) {
        for ((value, along), [most_m2_s, most_per_s]) in row.iter_mut().zip(along).zip(&mut largest)
        {
            let decay = *value * (along + across);
            let cut = if decay > limit_per_s {
                limit_per_s / (along + across)
            } else {
                *value
            };
            *value = cut;
            *most_per_s = if decay > *most_per_s {
                decay
            } else {
                *most_per_s
            };
            *most_m2_s = if cut > *most_m2_s { cut } else { *most_m2_s };
        }
    }
    largest.into_iter().fold(Largest::default(), larger)
}

/// Maxima that are kept side by side.
const LANES: usize = 8;

impl Row<'_> {
    /// The nine derivatives at the centres.
    #[inline(always)]
    fn gradient(
        &self,
        Scratch {
            gradient,
            row,
            padded,
        }: &mut Scratch,
    ) {
        for (component, gradient) in gradient.iter_mut().enumerate() {
            for (axis, out) in gradient.iter_mut().enumerate() {
                if axis == component {
                    out.fill(0.0);
                    self.operators.to_cells[axis].add(out, self.velocity[axis], self.at, padded);
                } else if component == 0 {
                    self.mean_along(axis, out, row, padded);
                } else {
                    self.mean_across([component, axis], out, row, padded);
                }
            }
        }
    }

    /// Derivative along `axis` of the component along axis 0: taken at the faces, then averaged
    /// over those of each cell.
    #[inline(always)]
    fn mean_along(&self, axis: usize, out: &mut [f64], row: &mut [f64], padded: &mut [f64]) {
        let n = out.len();
        let operators = self.operators;
        row.fill(operators.wall_source[axis][0][self.at[axis - 1]]);
        operators.half_mean_gradient[axis].add(&mut row[..n], self.velocity[0], self.at, padded);
        if operators.periodic[0] {
            row[n] = row[0];
        }
        let low = &row[..n];
        let high = &row[1..n + 1];
        for i in 0..n {
            out[i] = low[i] + high[i];
        }
    }

    /// Derivative along `axis` of a component along axis 1 or 2, averaged over the two faces of
    /// each cell of the row.
    #[inline(always)]
    fn mean_across(
        &self,
        [component, axis]: [usize; 2],
        out: &mut [f64],
        row: &mut [f64],
        padded: &mut [f64],
    ) {
        let operators = self.operators;
        let field = self.velocity[component];
        let at = self.at;
        let gradient = &operators.half_mean_gradient[axis];
        let source = &operators.wall_source[axis][component];
        let next = operators.after(component, at[component - 1]).map(|index| {
            let mut next = at;
            next[component - 1] = index;
            next
        });
        if axis == 0 {
            let row = &mut row[..out.len()];
            row.copy_from_slice(&field[operators.shape.row(at[0], at[1])]);
            if let Some([j, k]) = next {
                for (sum, value) in row.iter_mut().zip(&field[operators.shape.row(j, k)]) {
                    *sum += value;
                }
            }
            for (out, source) in out.iter_mut().zip(source) {
                *out = 2.0 * source;
            }
            gradient.add_along(out, row, padded);
        } else {
            out.fill(2.0 * source[at[axis - 1]]);
            gradient.add_across(out, field, at);
            if let Some(next) = next {
                gradient.add_across(out, field, next);
            }
        }
    }
}

/// `S:S` of a gradient.
#[inline(always)]
fn strain_square(g: [[f64; 3]; 3]) -> f64 {
    let [xy, xz, yz] = [g[0][1] + g[1][0], g[0][2] + g[2][0], g[1][2] + g[2][1]];
    (g[0][0] * g[0][0] + g[1][1] * g[1][1] + g[2][2] * g[2][2])
        + 0.5 * (xy * xy + xz * xz + yz * yz)
}

/// `Sd:Sd`, `Sd` the deviator of the symmetric part of `g g`.
#[inline(always)]
fn squared_gradient_square(g: [[f64; 3]; 3]) -> f64 {
    let mean = (squared(g, 0, 0) + squared(g, 1, 1) + squared(g, 2, 2)) * (1.0 / 3.0);
    let xx = squared(g, 0, 0) - mean;
    let yy = squared(g, 1, 1) - mean;
    let zz = squared(g, 2, 2) - mean;
    let xy = squared(g, 0, 1) + squared(g, 1, 0);
    let xz = squared(g, 0, 2) + squared(g, 2, 0);
    let yz = squared(g, 1, 2) + squared(g, 2, 1);
    (xx * xx + yy * yy + zz * zz) + 0.5 * (xy * xy + xz * xz + yz * yz)
}

/// Entry `(a, b)` of `g g`.
#[inline(always)]
fn squared(g: [[f64; 3]; 3], a: usize, b: usize) -> f64 {
    g[a][0] * g[0][b] + g[a][1] * g[1][b] + g[a][2] * g[2][b]
}

/// Replaces each value by `scale width` times what `formula` makes of the gradient there.
#[inline(always)]
fn apply(
    out: &mut [f64],
    gradient: &[[Vec<f64>; 3]; 3],
    scale: f64,
    width: &[f64],
    formula: impl Fn([[f64; 3]; 3]) -> f64,
) {
    let n = out.len();
    let width = &width[..n];
    let [x, y, z] = gradient;
    let [xx, xy, xz] = cut_rows!(x, n, 0 1 2);
    let [yx, yy, yz] = cut_rows!(y, n, 0 1 2);
    let [zx, zy, zz] = cut_rows!(z, n, 0 1 2);
    for i in 0..n {
        let g = [
            [xx[i], xy[i], xz[i]],
            [yx[i], yy[i], yz[i]],
            [zx[i], zy[i], zz[i]],
        ];
        out[i] = scale * width[i] * formula(g);
    }
}

#[inline(always)]
fn smagorinsky(g: [[f64; 3]; 3]) -> f64 {
    (2.0 * strain_square(g)).sqrt()
}

#[inline(always)]
fn wale(g: [[f64; 3]; 3]) -> f64 {
    let s = strain_square(g);
    let d = squared_gradient_square(g);
    let root = d.sqrt();
    // The smallest number only keeps a fluid at rest from dividing by zero.
    let rate = s * s * s.sqrt() + d * root.sqrt() + f64::MIN_POSITIVE;
    d * root / rate
}
