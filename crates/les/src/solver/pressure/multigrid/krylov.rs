//! Conjugate gradients on the fourth-order operator of two axes, for 16 modes side by side, with a multigrid cycle in single
//! precision as preconditioner.
//!
//! Every mode has its own step lengths; the flexible (Polak-Ribiere) form allows for the round-off of the cycle. All sums run
//! over the cells in their order, so the result does not depend on threads.

use multiversion::multiversion;

use super::super::super::operators_1d::Taps;
use super::cycle::{self, Hierarchy};
use super::lanes::{LANES, Lanes, Wide};

/// The fourth-order operator `K1 M2 + M1 K2 + lambda M1 M2`.
#[derive(Debug)]
pub(crate) struct Plane {
    /// Rows of the stiffness of the two axes, in units of the mean cell.
    pub(crate) stiffness: [Vec<Taps>; 2],
    /// Masses of the two axes.
    pub(crate) mass: [Vec<f64>; 2],
}

impl Plane {
    /// Subtracts from mode `l` the multiple of `shape(mass)` that makes its sum, weighted so that this is a constant, zero.
    pub(crate) fn remove_mean(&self, field: &mut [Wide], l: usize, shape: impl Fn(f64) -> f64) {
        let n = self.mass[0].len();
        let mass = |p: usize| self.mass[0][p % n] * self.mass[1][p / n];
        let volume: f64 = (0..field.len()).map(mass).sum();
        let sum: f64 = field.iter().enumerate().map(|(p, value)| value[l] * mass(p) / shape(mass(p))).sum();
        for (p, value) in field.iter_mut().enumerate() {
            value[l] -= sum / volume * shape(mass(p));
        }
    }
}

/// What one thread needs to solve 16 modes.
#[derive(Debug, Default)]
pub(crate) struct Work {
    x: Vec<Wide>,
    r: Vec<Wide>,
    p: Vec<Wide>,
    q: Vec<Wide>,
    cycle: cycle::Work,
}

/// Iterations after which a solve is given up.
const MAX_ITERATIONS: usize = 40;
/// Iterations without a smaller residual after which it is. The first may raise the residual of long waves, a thousandfold at
/// most: what falls in each is the energy of the error.
const PATIENCE: usize = 8;

impl Work {
    /// The right side, to be filled: one place for each cell of the plane.
    pub(crate) fn right(&mut self, cells: usize) -> &mut [Wide] {
        self.r.resize(cells, [0.0; LANES]);
        &mut self.r
    }

    /// The solution.
    pub(crate) fn solution(&mut self) -> &mut [Wide] {
        &mut self.x
    }
}

/// Solves till the squares of the residuals, with the modes' weights, sum to at most `allowed`; returns these sums, from the
/// start and after each iteration.
pub(crate) fn solve(
    plane: &Plane,
    hierarchy: &Hierarchy,
    (mode, weight): (&Wide, &Wide),
    allowed: f64,
    work: &mut Work,
) -> Vec<f64> {
    let Work { x, r, p, q, cycle } = work;
    for field in [&mut *x, &mut *p, &mut *q] {
        field.clear();
        field.resize(r.len(), [0.0; LANES]);
    }
    let single: Lanes = mode.map(|lambda| lambda as f32);
    // The sum of the residual of a mode that ignores constants is round-off; left alone, it would grow.
    let constant = mode.iter().position(|lambda| *lambda == 0.0);
    let mut squares = sum_of_squares(r);
    let total = |squares: &Wide| squares.iter().zip(weight).map(|(s, w)| s * w).sum::<f64>();
    let mut history = vec![total(&squares)];
    let mut rz = [0.0; LANES];
    let mut alpha = [0.0; LANES];
    let (mut least, mut since) = (f64::INFINITY, 0);
    while history.len() <= MAX_ITERATIONS && since < PATIENCE && total(&squares) > allowed {
        let (right, _) = hierarchy.finest(cycle);
        let size = squares.map(f64::sqrt);
        scale_down(r, &size, right);
        hierarchy.cycle(&single, cycle);
        let (_, z) = hierarchy.finest(cycle);
        let [new, zq] = two_dots(z, &size, r, q);
        let beta = std::array::from_fn(|l| quotient(-alpha[l] * zq[l], rz[l]));
        rz = new;
        advance(z, &size, &beta, p);
        if let Some(l) = constant {
            plane.remove_mean(p, l, |_| 1.0);
        }
        let pq = apply(plane, mode, p, q);
        alpha = std::array::from_fn(|l| quotient(rz[l], pq[l]));
        squares = step(&alpha, p, q, x, r);
        if let Some(l) = constant {
            plane.remove_mean(r, l, |mass| mass);
        }
        since = if total(&squares) < least { 0 } else { since + 1 };
        least = least.min(total(&squares));
        history.push(total(&squares));
    }
    history
}

/// `a / b`, and zero in a mode that has nothing left to solve.
fn quotient(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn sum_of_squares(r: &[Wide]) -> Wide {
    let mut sum = [0.0; LANES];
    for r in r {
        for l in 0..LANES {
            sum[l] = r[l].mul_add(r[l], sum[l]);
        }
    }
    sum
}

/// `out = r / size` in single precision.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn scale_down(r: &[Wide], size: &Wide, out: &mut [Lanes]) {
    let inverse = size.map(|size| if size == 0.0 { 0.0 } else { 1.0 / size });
    for (out, r) in out.iter_mut().zip(r) {
        for l in 0..LANES {
            out[l] = (r[l] * inverse[l]) as f32;
        }
    }
}

/// `z r` and `z q`, with `z` scaled back.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn two_dots(z: &[Lanes], size: &Wide, r: &[Wide], q: &[Wide]) -> [Wide; 2] {
    let mut sums = [[0.0; LANES]; 2];
    for (z, (r, q)) in z.iter().zip(r.iter().zip(q)) {
        for l in 0..LANES {
            let z = f64::from(z[l]);
            sums[0][l] = z.mul_add(r[l], sums[0][l]);
            sums[1][l] = z.mul_add(q[l], sums[1][l]);
        }
    }
    sums.map(|sum| std::array::from_fn(|l| sum[l] * size[l]))
}

/// `p = z + beta p`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn advance(z: &[Lanes], size: &Wide, beta: &Wide, p: &mut [Wide]) {
    for (p, z) in p.iter_mut().zip(z) {
        for l in 0..LANES {
            p[l] = f64::from(z[l]).mul_add(size[l], beta[l] * p[l]);
        }
    }
}

/// `q = A p`; returns `p q`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn apply(plane: &Plane, mode: &Wide, p: &[Wide], q: &mut [Wide]) -> Wide {
    let n = plane.mass[0].len();
    let mut dot = [0.0; LANES];
    for (k, row) in q.chunks_mut(n).enumerate() {
        let m2 = plane.mass[1][k];
        for (j, q) in row.iter_mut().enumerate() {
            let m1 = plane.mass[0][j];
            let own = &p[k * n + j];
            let mut sum: Wide = std::array::from_fn(|l| mode[l] * (m1 * m2) * own[l]);
            for &(i, c) in &plane.stiffness[0][j] {
                accumulate(&mut sum, c * m2, &p[k * n + i]);
            }
            for &(i, c) in &plane.stiffness[1][k] {
                accumulate(&mut sum, c * m1, &p[i * n + j]);
            }
            for l in 0..LANES {
                dot[l] = own[l].mul_add(sum[l], dot[l]);
            }
            *q = sum;
        }
    }
    dot
}

#[inline(always)]
fn accumulate(sum: &mut Wide, c: f64, p: &Wide) {
    for l in 0..LANES {
        sum[l] = c.mul_add(p[l], sum[l]);
    }
}

/// `x += alpha p`, `r -= alpha q`; returns the sums of squares of `r`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn step(alpha: &Wide, p: &[Wide], q: &[Wide], x: &mut [Wide], r: &mut [Wide]) -> Wide {
    let mut squares = [0.0; LANES];
    for ((p, q), (x, r)) in p.iter().zip(q).zip(x.iter_mut().zip(r)) {
        for l in 0..LANES {
            x[l] = alpha[l].mul_add(p[l], x[l]);
            r[l] = (-alpha[l]).mul_add(q[l], r[l]);
            squares[l] = r[l].mul_add(r[l], squares[l]);
        }
    }
    squares
}
