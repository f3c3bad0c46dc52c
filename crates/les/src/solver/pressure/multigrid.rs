//! Multigrid for the pressure equation: a check on the direct solver that shares none of its steps
//! but the transform of axis 0.
//!
//! The transform along axis 0 leaves one problem in two dimensions for each mode. There, line
//! relaxation in both directions with the transposed interpolation as restriction converges at the
//! same rate for any stretching; in three dimensions it does not, because errors that are smooth
//! along two strong couplings and rough along a weak third escape all lines. The cycle works in
//! single precision, with the fourth-order operator on the finest mesh and second-order ones on the
//! others, and preconditions flexible (Polak-Ribiere) conjugate gradients in double precision.
//!
//! Modes are solved 16 at a time, each group by one thread from beginning to end, till its share of
//! the tolerance is reached: short waves take two or three iterations. Nothing is summed across
//! groups, so the result has the same bits for any number of threads.
//!
//! Check: factor per iteration and count on the meshes of the table, agreement with the direct
//! solver.

use multiversion::multiversion;
use rayon::prelude::*;

use super::super::layout::Layout;
use super::super::operators_1d::{Operators1d, Taps};
use super::super::slabs::Slabs;
use super::apply::stiffness;
use super::lines::columns;
use super::method::Method;
use super::transform::{self, RowTransform, TransformDirection};
use super::v_cycle::{Axis, LANES, Lanes, Level, Lines, v_cycle};
use crate::Error;

/// One value of each mode outside of the cycle.
type Wide = [f64; LANES];

/// Iterations after which a solve is given up.
const MAX_ITERATIONS: usize = 40;
/// Iterations without a smaller residual after which it is. The first may raise the residual of
/// long waves, a thousandfold at most: what falls in each is the energy of the error.
const PATIENCE: usize = 8;
/// Part of the tolerance that is shared in proportion to the right side of each group of modes; the
/// rest equally among all modes.
const PROPORTIONAL: f64 = 0.99;

/// The multigrid solver of one mesh.
#[derive(Debug)]
pub(crate) struct Multigrid {
    slabs: Slabs,
    rows: RowTransform,
    /// Eigenvalue of each mode, in units of the mean cell; groups are filled up with ones.
    mode: Vec<Wide>,
    /// Square of a field's norm over that of its modes.
    weight: Vec<Wide>,
    /// Factor of the transforms, with the sign of the right side.
    scale: f64,
    /// Rows of the fourth-order operator along the axes 1 and 2, in units of the mean cell.
    stiffness: [Vec<Taps>; 2],
    /// The meshes from fine to coarse.
    levels: Vec<Level>,
}

/// What one thread needs: the fields of conjugate gradients, solution and right side on each mesh,
/// a line, a coarse row.
#[derive(Debug)]
struct Work {
    x: Vec<Wide>,
    r: Vec<Wide>,
    p: Vec<Wide>,
    q: Vec<Wide>,
    fields: Vec<[Vec<Lanes>; 2]>,
    lines: Lines,
}

impl Multigrid {
    /// The hierarchy of meshes of `layout`.
    pub(crate) fn new(layout: &Layout) -> Self {
        let (rows, value, factor) = RowTransform::new(&layout.line[0]);
        let lines = [&layout.line[1], &layout.line[2]];
        let unit_m = mean_cell_m(lines[usize::from(lines[1].cells >= lines[0].cells)]);
        let stiffness = lines.map(|line| {
            let mut rows = stiffness(line);
            for (_, c) in rows.iter_mut().flatten() {
                *c *= unit_m;
            }
            rows
        });
        let finest = std::array::from_fn(|a| Axis::finest(lines[a], unit_m, &stiffness[a]));
        let modes = value.len();
        let cell_0_m = mean_cell_m(&layout.line[0]);
        Self {
            slabs: layout.slabs.clone(),
            mode: in_groups(modes, |m| value[m] * unit_m * unit_m),
            weight: in_groups(modes, |m| rows.weight(m, cell_0_m)),
            rows,
            scale: -factor,
            stiffness,
            levels: Level::hierarchy(finest),
        }
    }

    /// Solves one group of modes for the right side in `rows`, one for each cell of the plane, till
    /// its share of `tolerance` is reached, of which `allowed` is the square for all modes; returns
    /// the iterations.
    fn group(
        &self,
        group: usize,
        rows: &mut [&mut [f64]],
        allowed: f64,
        tolerance: f64,
        work: &mut Work,
    ) -> usize {
        for field in [&mut work.x, &mut work.r, &mut work.p, &mut work.q] {
            field.fill([0.0; LANES]);
        }
        for (out, row) in work.r.iter_mut().zip(rows.iter()) {
            for (out, value) in out.iter_mut().zip(row.iter()) {
                *out = value * self.scale;
            }
        }
        // The sum of the residual of a mode that ignores constants is round-off; left alone, it
        // would grow.
        let constant = self.constant_mode(group);
        self.remove_mean(&mut work.r, constant, |mass| mass);
        // Each mode is solved in units of its right side, which suit single precision.
        let size = dot(&work.r, &work.r).map(f64::sqrt);
        let inverse = size.map(|size| if size == 0.0 { 0.0 } else { 1.0 / size });
        for r in &mut work.r {
            for l in 0..LANES {
                r[l] *= inverse[l];
            }
        }
        let weight: Wide = std::array::from_fn(|l| self.weight[group][l] * size[l] * size[l]);
        let squares = weighted_sum(&weight, &dot(&work.r, &work.r));
        let n0 = self.slabs.shape.n[0];
        let fraction = (n0 - group * LANES).min(LANES) as f64 / n0 as f64;
        let target = PROPORTIONAL * tolerance * tolerance * squares
            + (1.0 - PROPORTIONAL) * fraction * allowed;
        let iterations = self.conjugate_gradients(group, &weight, squares, target, work);
        self.remove_mean(&mut work.x, constant, |_| 1.0);
        for (value, row) in work.x.iter().zip(rows) {
            for (l, out) in row.iter_mut().enumerate() {
                *out = size[l] * value[l];
            }
        }
        iterations
    }

    /// The mode of a group that ignores constants, if there is one.
    fn constant_mode(&self, group: usize) -> Option<usize> {
        self.mode[group].iter().position(|lambda| *lambda == 0.0)
    }

    /// Iterates until the weighted square of the residual, at first `squares`, is at most `target`;
    /// returns the iterations.
    fn conjugate_gradients(
        &self,
        group: usize,
        weight: &Wide,
        mut squares: f64,
        target: f64,
        work: &mut Work,
    ) -> usize {
        let mode = &self.mode[group];
        let single = mode.map(|lambda| lambda as f32);
        let constant = self.constant_mode(group);
        let masses = self.levels[0].axes.each_ref().map(|axis| &*axis.mass);
        let Work {
            x,
            r,
            p,
            q,
            fields,
            lines,
        } = work;
        let mut rz = [0.0; LANES];
        let mut alpha = [0.0; LANES];
        let mut iterations = 0;
        let mut least = f64::INFINITY;
        let mut since = 0;
        while squares > target && iterations < MAX_ITERATIONS && since < PATIENCE {
            for (f, r) in fields[0][1].iter_mut().zip(&*r) {
                *f = r.map(|r| r as f32);
            }
            v_cycle(&self.levels, &single, fields, lines);
            let z = &fields[0][0];
            let before = rz;
            rz = dot(z, r);
            let zq = dot(z, q);
            let beta = std::array::from_fn(|l| quotient(-alpha[l] * zq[l], before[l]));
            update_search_direction(z, &beta, p);
            self.remove_mean(p, constant, |_| 1.0);
            apply(&self.stiffness, masses, mode, p, q);
            let pq = dot(p, q);
            alpha = std::array::from_fn(|l| quotient(rz[l], pq[l]));
            advance(&alpha, p, q, x, r);
            self.remove_mean(r, constant, |mass| mass);
            squares = weighted_sum(weight, &dot(r, r));
            since = if squares < least { 0 } else { since + 1 };
            least = least.min(squares);
            iterations += 1;
        }
        iterations
    }

    /// Subtracts from mode `l` the multiple of `shape(mass)` that makes its sum, weighted so that
    /// this is a constant, zero.
    fn remove_mean(&self, field: &mut [Wide], l: Option<usize>, shape: impl Fn(f64) -> f64) {
        let Some(l) = l else { return };
        let volume: f64 = (0..field.len()).map(|place| self.cell_mass(place)).sum();
        let terms = field.iter().enumerate().map(|(place, value)| {
            let mass = self.cell_mass(place);
            value[l] * mass / shape(mass)
        });
        let sum: f64 = terms.sum();
        for (place, value) in field.iter_mut().enumerate() {
            value[l] -= sum / volume * shape(self.cell_mass(place));
        }
    }

    /// Mass of a cell of the plane.
    fn cell_mass(&self, place: usize) -> f64 {
        let [first, second] = &self.levels[0].axes;
        let n = first.mass.len();
        first.mass[place % n] * second.mass[place / n]
    }

    /// Room for the work of one thread.
    fn work(&self) -> Work {
        let cells = self.levels[0].cells();
        let fields = self.levels.iter().map(|level| {
            let field = vec![[0.0; LANES]; level.cells()];
            [field.clone(), field]
        });
        Work {
            x: vec![[0.0; LANES]; cells],
            r: vec![[0.0; LANES]; cells],
            p: vec![[0.0; LANES]; cells],
            q: vec![[0.0; LANES]; cells],
            fields: fields.collect(),
            lines: Lines::new(&self.levels[0]),
        }
    }

    /// Transforms the rows.
    fn transform(&self, direction: TransformDirection, field: &mut [f64]) {
        let n0 = self.slabs.shape.n[0];
        let rows = (field.len() / n0).div_ceil(64).next_multiple_of(6);
        let slabs = field.par_chunks_mut(rows * n0);
        slabs.for_each_init(transform::Work::default, |work, slab| {
            self.rows.apply(direction, slab, work)
        });
    }
}

impl Method for Multigrid {
    fn name(&self) -> &'static str {
        "multigrid"
    }

    fn solve(&self, own: &mut [f64], size: f64, tolerance: f64) -> Result<usize, Error> {
        self.transform(TransformDirection::Forward, own);
        let allowed = (tolerance * size * self.scale).powi(2);
        let most = self.slabs.transposed(own, LANES, |field, shape, first| {
            let mut groups = columns(field, shape, LANES);
            let groups = groups.par_iter_mut().enumerate().map_init(
                || self.work(),
                |work, (group, rows)| {
                    self.group(first / LANES + group, rows, allowed, tolerance, work)
                },
            );
            groups.max()
        })?;
        self.transform(TransformDirection::Inverse, own);
        let [most] = self.slabs.largest([most.unwrap_or(0) as f64])?;
        Ok(most as usize)
    }
}

/// Mean length of the cells of a direction \[m\].
fn mean_cell_m(line: &Operators1d) -> f64 {
    line.cell_mass_m.iter().sum::<f64>() / line.cells as f64
}

/// The values of the modes in groups, filled up with ones.
fn in_groups(modes: usize, value: impl Fn(usize) -> f64) -> Vec<Wide> {
    let mut groups = vec![[1.0; LANES]; modes.div_ceil(LANES)];
    for m in 0..modes {
        groups[m / LANES][m % LANES] = value(m);
    }
    groups
}

fn weighted_sum(weight: &Wide, values: &Wide) -> f64 {
    (0..LANES).map(|l| weight[l] * values[l]).sum()
}

/// `a / b`, and zero in a mode that has nothing left to solve.
fn quotient(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}

/// `a b` of each mode.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn dot<T: Copy + Into<f64>>(a: &[[T; LANES]], b: &[Wide]) -> Wide {
    let mut sum = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            sum[l] = b[l].mul_add(a[l].into(), sum[l]);
        }
    }
    sum
}

/// `p = z + beta p`.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn update_search_direction(z: &[Lanes], beta: &Wide, p: &mut [Wide]) {
    for (p, z) in p.iter_mut().zip(z) {
        for l in 0..LANES {
            p[l] = beta[l].mul_add(p[l], f64::from(z[l]));
        }
    }
}

/// `q = (K1 M2 + M1 K2 + lambda M1 M2) p` with the fourth-order rows of `K1` and `K2`.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn apply(stiffness: &[Vec<Taps>; 2], mass: [&[f64]; 2], mode: &Wide, p: &[Wide], q: &mut [Wide]) {
    let n = mass[0].len();
    for (k, row) in q.chunks_mut(n).enumerate() {
        for (j, q) in row.iter_mut().enumerate() {
            let m1 = mass[0][j];
            let m2 = mass[1][k];
            let own = &p[k * n + j];
            let mut sum = [0.0; LANES];
            for l in 0..LANES {
                sum[l] = mode[l] * (m1 * m2) * own[l];
            }
            for &(i, c) in &stiffness[0][j] {
                add_wide(&mut sum, c * m2, &p[k * n + i]);
            }
            for &(i, c) in &stiffness[1][k] {
                add_wide(&mut sum, c * m1, &p[i * n + j]);
            }
            *q = sum;
        }
    }
}

/// `sum += c p`.
#[inline(always)]
fn add_wide(sum: &mut Wide, c: f64, p: &Wide) {
    for l in 0..LANES {
        sum[l] = c.mul_add(p[l], sum[l]);
    }
}

/// `x += alpha p`, `r -= alpha q`.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn advance(alpha: &Wide, p: &[Wide], q: &[Wide], x: &mut [Wide], r: &mut [Wide]) {
    for ((p, q), (x, r)) in p.iter().zip(q).zip(x.iter_mut().zip(r)) {
        for l in 0..LANES {
            x[l] = alpha[l].mul_add(p[l], x[l]);
            r[l] = (-alpha[l]).mul_add(q[l], r[l]);
        }
    }
}
