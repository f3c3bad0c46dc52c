//! One V-cycle, for 16 modes side by side: the fourth-order operator on the finest mesh, second-order ones below.
//!
//! Before and after the coarse mesh the lines along both axes are relaxed, once on the finest mesh and twice on the others,
//! afterwards in reverse order, which makes the cycle symmetric. Restriction is the transpose of the interpolation.
//!
//! Check: that the cycle is symmetric; the factor per iteration of the whole solver.

use multiversion::multiversion;

use super::super::super::operators_1d::Taps;
use super::grid::{Axis, Weights};
use super::lanes::{LANES, Lanes};
use super::relax::{Scratch, Side, relax, residual_at};

/// One mesh of the hierarchy: axis 1 is contiguous, axis 2 has its length as stride.
#[derive(Debug)]
pub(crate) struct Level {
    side: [Side; 2],
    /// Interpolation from the next mesh along the two axes; empty on the coarsest.
    weights: [Vec<Weights>; 2],
}

/// The meshes from fine to coarse.
#[derive(Debug)]
pub(crate) struct Hierarchy {
    levels: Vec<Level>,
}

/// Solution and right side on one mesh.
#[derive(Debug, Default)]
struct Fields {
    u: Vec<Lanes>,
    f: Vec<Lanes>,
}

/// What one thread needs for a cycle.
#[derive(Debug, Default)]
pub(crate) struct Work {
    fields: Vec<Fields>,
    scratch: Scratch,
    row: Vec<Lanes>,
    coarse_row: Vec<Lanes>,
}

/// Relaxations of both directions on the meshes between the finest and the coarsest.
const COARSE_SWEEPS: usize = 2;
/// Relaxations on the coarsest mesh.
const COARSEST_SWEEPS: usize = 4;

impl Hierarchy {
    /// The hierarchy under the mesh with `axes` and the rows of the fourth-order operator along them.
    pub(crate) fn new(axes: [Axis; 2], stiffness: &[Vec<Taps>; 2]) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        let mut axes = axes;
        loop {
            let stride = [1, axes[0].len()];
            let side = std::array::from_fn(|a| match levels.is_empty() {
                true => Side::finest(&axes[a], stride[a], &stiffness[a]),
                false => Side::new(&axes[a], stride[a]),
            });
            // A single line is solved exactly.
            let single = axes.iter().any(|axis| axis.len() == 1);
            if single || !axes.iter().any(Axis::is_fine) {
                levels.push(Level { side, weights: [Vec::new(), Vec::new()] });
                return Self { levels };
            }
            let [(first, first_weights), (second, second_weights)] = axes.each_ref().map(Axis::coarsened);
            levels.push(Level { side, weights: [first_weights, second_weights] });
            axes = [first, second];
        }
    }

    /// Number of meshes.
    pub(crate) fn depth(&self) -> usize {
        self.levels.len()
    }

    /// The right side of the finest mesh, to be filled, and the solution.
    pub(crate) fn finest<'a>(&self, work: &'a mut Work) -> (&'a mut [Lanes], &'a [Lanes]) {
        work.fields.resize_with(self.levels.len(), Fields::default);
        for (fields, level) in work.fields.iter_mut().zip(&self.levels) {
            let n = level.side[0].len() * level.side[1].len();
            fields.u.resize(n, [0.0; LANES]);
            fields.f.resize(n, [0.0; LANES]);
        }
        let row = self.levels[0].side[0].len();
        work.row.resize(row, [0.0; LANES]);
        work.coarse_row.resize(row, [0.0; LANES]);
        let finest = &mut work.fields[0];
        (&mut finest.f, &finest.u)
    }

    /// One cycle from zero for the modes of eigenvalues `mode`.
    pub(crate) fn cycle(&self, mode: &Lanes, work: &mut Work) {
        self.descend(0, mode, work);
    }

    fn descend(&self, l: usize, mode: &Lanes, work: &mut Work) {
        let level = &self.levels[l];
        let [first, second] = &level.side;
        let Work { fields, scratch, row, coarse_row } = work;
        let (fine, coarse) = fields.split_at_mut(l + 1);
        let Some(Fields { u, f }) = fine.last_mut() else { return };
        u.fill([0.0; LANES]);
        let Some(coarse) = coarse.first_mut() else {
            level.coarsest(mode, u, f, scratch);
            return;
        };
        let sweeps = if l == 0 { 1 } else { COARSE_SWEEPS };
        for _ in 0..sweeps {
            relax((first, second), mode, u, f, false, scratch);
            relax((second, first), mode, u, f, false, scratch);
        }
        coarse.f.fill([0.0; LANES]);
        restrict(level, mode, u, f, &mut coarse.f, row, coarse_row);
        self.descend(l + 1, mode, work);
        let Work { fields, scratch, coarse_row, .. } = work;
        let (fine, coarse) = fields.split_at_mut(l + 1);
        let (Some(Fields { u, f }), Some(coarse)) = (fine.last_mut(), coarse.first()) else { return };
        interpolate(level, &coarse.u, u, coarse_row);
        for _ in 0..sweeps {
            relax((second, first), mode, u, f, true, scratch);
            relax((first, second), mode, u, f, true, scratch);
        }
    }
}

impl Level {
    fn coarsest(&self, mode: &Lanes, u: &mut [Lanes], f: &[Lanes], scratch: &mut Scratch) {
        let [first, second] = &self.side;
        let single =
            if first.len() == 1 { Some((second, first)) } else { (second.len() == 1).then_some((first, second)) };
        if let Some(sides) = single {
            relax(sides, mode, u, f, false, scratch);
            relax(sides, mode, u, f, true, scratch);
            return;
        }
        self.solve_mean(mode, u, f);
        for _ in 0..COARSEST_SWEEPS {
            relax((second, first), mode, u, f, false, scratch);
            relax((first, second), mode, u, f, false, scratch);
            relax((first, second), mode, u, f, true, scratch);
            relax((second, first), mode, u, f, true, scratch);
        }
        self.solve_mean(mode, u, f);
    }

    /// Adds the constant that leaves no sum: relaxation hardly moves it in modes that almost ignore constants.
    fn solve_mean(&self, mode: &Lanes, u: &mut [Lanes], f: &[Lanes]) {
        let [first, second] = &self.side;
        let n = first.len();
        let (mut left, mut volume) = ([0.0; LANES], 0.0);
        for (p, (u, f)) in u.iter().zip(f).enumerate() {
            let mass = first.mass(p % n) * second.mass(p / n);
            volume += mass;
            for l in 0..LANES {
                left[l] += f[l] - mode[l] * mass * u[l];
            }
        }
        for u in u {
            for l in 0..LANES {
                if mode[l] != 0.0 {
                    u[l] += left[l] / (mode[l] * volume);
                }
            }
        }
    }

    fn coarse_len(&self) -> usize {
        let last = |weights: &[Weights]| weights.iter().flatten().map(|w| w.0).max().map_or(0, |last| last + 1);
        last(&self.weights[0])
    }
}

/// Adds to `coarse` the transposed interpolation of the residual.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn restrict(
    level: &Level,
    mode: &Lanes,
    u: &[Lanes],
    f: &[Lanes],
    coarse: &mut [Lanes],
    row: &mut [Lanes],
    coarse_row: &mut [Lanes],
) {
    let [first, second] = &level.side;
    let (n, coarse_n) = (first.len(), level.coarse_len());
    for k in 0..second.len() {
        residual_row(level, mode, u, f, k, row);
        let coarse_row = &mut coarse_row[..coarse_n];
        coarse_row.fill([0.0; LANES]);
        for (residual, weights) in row[..n].iter().zip(&level.weights[0]) {
            for &(to, weight) in weights {
                add(&mut coarse_row[to], weight, residual);
            }
        }
        for &(to, weight) in &level.weights[1][k] {
            for (out, value) in coarse[to * coarse_n..][..coarse_n].iter_mut().zip(&*coarse_row) {
                add(out, weight, value);
            }
        }
    }
}

/// Residual of one row at index `k` of axis 2.
#[inline(always)]
fn residual_row(level: &Level, mode: &Lanes, u: &[Lanes], f: &[Lanes], k: usize, row: &mut [Lanes]) {
    let [first, second] = &level.side;
    for (j, out) in row.iter_mut().enumerate().take(first.len()) {
        *out = residual_at([first, second], [j, k], mode, u, f);
    }
}

/// Adds the interpolated coarse solution to `u`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn interpolate(level: &Level, coarse: &[Lanes], u: &mut [Lanes], coarse_row: &mut [Lanes]) {
    let (n, coarse_n) = (level.side[0].len(), level.coarse_len());
    for (u, [a, b]) in u.chunks_mut(n).zip(&level.weights[1]) {
        let rows = [a, b].map(|w| &coarse[w.0 * coarse_n..][..coarse_n]);
        for (out, (x, y)) in coarse_row.iter_mut().zip(rows[0].iter().zip(rows[1])) {
            for l in 0..LANES {
                out[l] = a.1.mul_add(x[l], b.1 * y[l]);
            }
        }
        for (u, weights) in u.iter_mut().zip(&level.weights[0]) {
            for &(from, weight) in weights {
                add(u, weight, &coarse_row[from]);
            }
        }
    }
}

/// `out += weight value`.
#[inline(always)]
fn add(out: &mut Lanes, weight: f32, value: &Lanes) {
    for l in 0..LANES {
        out[l] = weight.mul_add(value[l], out[l]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::super::mesh::{Direction, Mapping, Wall};
    use super::super::super::super::operators_1d::Operators1d;
    use super::super::super::apply::stiffness;
    use super::*;

    fn cycled(hierarchy: &Hierarchy, mode: &Lanes, wave: impl Fn(usize, usize) -> f32) -> (Vec<Lanes>, Vec<Lanes>) {
        let mut work = Work::default();
        let (f, _) = hierarchy.finest(&mut work);
        for (p, f) in f.iter_mut().enumerate() {
            *f = std::array::from_fn(|l| wave(p, l));
        }
        hierarchy.cycle(mode, &mut work);
        (work.fields[0].f.clone(), work.fields[0].u.clone())
    }

    #[test]
    fn a_cycle_is_symmetric() {
        let ground =
            Direction::between(25, 0.0, 25.0, Wall::AT_REST, Wall::Slip).stretched(Mapping::TanhLow { strength: 2.0 });
        let sides = [ground, Direction::periodic(14, 0.0, 14.0)];
        let lines = sides.each_ref().map(Operators1d::new);
        let hierarchy =
            Hierarchy::new(lines.each_ref().map(|line| Axis::new(line, 1.0)), &lines.each_ref().map(stiffness));
        let mode: Lanes = std::array::from_fn(|l| 0.02 * (l + 1) as f32);
        let (f, bf) = cycled(&hierarchy, &mode, |p, l| ((p * 16 + l) as f32 * 0.71).sin());
        let (g, bg) = cycled(&hierarchy, &mode, |p, l| ((p * 16 + l) as f32 * 1.3).cos());
        for l in 0..LANES {
            let dot = |a: &[Lanes], b: &[Lanes]| a.iter().zip(b).map(|(a, b)| f64::from(a[l] * b[l])).sum::<f64>();
            let (one, other, size) = (dot(&g, &bf), dot(&f, &bg), dot(&f, &bf));
            assert!((one - other).abs() < 2e-6 * size && size > 0.0, "{l}: {one} {other} of {size}");
        }
    }
}
