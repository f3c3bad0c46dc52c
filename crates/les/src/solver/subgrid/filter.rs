//! The small-scale field of the multiscale model, `u - prod_j [1 - (-delta_j^2/4)^n] u`, with `delta^2 q_i = q_(i+1) - 2 q_i +
//! q_(i-1)` in the index space of each direction (Jeanmart and Winckelmans 2007).
//!
//! The filter removes `sin^(2n)(theta/2)` of a wave of phase `theta` per cell. Walls are not crossed: behind a no-slip wall
//! the velocity relative to the wall is continued oddly, so that a linear shear has no small scales; behind a slip wall what
//! flows along it is even and what flows through it odd. Differences vanish exactly where the field does not vary.
//!
//! Check: transfer function, constants and linear fields, bounds of the weights.

use multiversion::multiversion;
use rayon::prelude::*;

use super::super::layout::{Layout, Shape};
use super::super::operators_1d::{Operators1d, resolve_cell, resolve_face};
use super::super::rows::HALO;

/// Highest order: the stencil must fit the halo of a padded row.
pub(super) const HIGHEST_ORDER: usize = HALO;

/// A value beyond the end of an axis: `sign * value[index] + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ghost {
    index: usize,
    sign: f64,
    offset: f64,
}

/// The filter of one component along one axis.
#[derive(Debug, Clone)]
struct AxisFilter {
    /// For each place along the axis the values at distances 1 to `order` below and above; empty along a thin axis.
    neighbours: Vec<[[Ghost; 2]; HIGHEST_ORDER]>,
    /// Places whose neighbours are all plain values.
    plain: Vec<bool>,
}

/// The filter of all components.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    shape: Shape,
    order: usize,
    /// `[component][axis]`.
    axes: [[AxisFilter; 3]; 3],
}

/// Scratch of one task.
#[derive(Debug)]
struct Scratch {
    plane: Vec<f64>,
    row: Vec<f64>,
    padded: Vec<f64>,
}

impl Filter {
    pub(super) fn new(layout: &Layout, order: usize) -> Self {
        let axes = std::array::from_fn(|component| {
            std::array::from_fn(|axis| {
                let line = &layout.line[axis];
                if component == axis {
                    return AxisFilter::new(line, order, |index| face_ghost(line, index));
                }
                let wall_m_s = layout.wall_velocity_m_s(axis, component);
                AxisFilter::new(line, order, |index| cell_ghost(line, wall_m_s, index))
            })
        });
        Self { shape: layout.shape, order, axes }
    }

    /// Writes the small scales of `velocity` to `small`.
    pub(super) fn small_scales(&self, velocity: [&[f64]; 3], small: &mut [&mut [f64]; 3]) {
        let shape = self.shape;
        for (component, (field, small)) in velocity.into_iter().zip(small).enumerate() {
            small[shape.own_places()].par_chunks_mut(shape.plane()).zip(shape.own()).for_each_init(
                || Scratch {
                    plane: vec![0.0; shape.plane()],
                    row: vec![0.0; shape.n[0]],
                    padded: vec![0.0; shape.n[0] + 2 * HALO],
                },
                |scratch, (out, k)| match self.order {
                    1 => plane_of_order_1(self, field, component, k, out, scratch),
                    2 => plane_of_order_2(self, field, component, k, out, scratch),
                    3 => plane_of_order_3(self, field, component, k, out, scratch),
                    _ => plane_of_order_4(self, field, component, k, out, scratch),
                },
            );
        }
    }
}

impl AxisFilter {
    /// The filter whose values at any index, also beyond the ends, are given by `ghost`.
    fn new(line: &Operators1d, order: usize, ghost: impl Fn(isize) -> Ghost) -> Self {
        if line.is_thin() {
            return Self { neighbours: Vec::new(), plain: Vec::new() };
        }
        let own = Ghost { index: 0, sign: 1.0, offset: 0.0 };
        let neighbours: Vec<_> = (0..line.cells)
            .map(|place| {
                let mut near = [[own; 2]; HIGHEST_ORDER];
                for (m, pair) in near.iter_mut().enumerate().take(order) {
                    let distance = m as isize + 1;
                    *pair = [-distance, distance].map(|d| ghost(place as isize + d));
                }
                near
            })
            .collect();
        let plain =
            |near: &[[Ghost; 2]; HIGHEST_ORDER]| near.iter().flatten().all(|g| g.sign == 1.0 && g.offset == 0.0);
        Self { plain: neighbours.iter().map(plain).collect(), neighbours }
    }
}

/// What stands for the normal velocity at face `index`, which may lie beyond the ends.
fn face_ghost(line: &Operators1d, index: isize) -> Ghost {
    let (face, sign) = resolve_face(line.cells, line.ends, index);
    // The face on the high wall is not stored, and nothing flows through it.
    let at_high_wall = face == line.cells;
    Ghost { index: if at_high_wall { 0 } else { face }, sign: if at_high_wall { 0.0 } else { sign }, offset: 0.0 }
}

/// What stands for the velocity along the walls at cell `index`, which may lie beyond the ends.
fn cell_ghost(line: &Operators1d, wall_m_s: [f64; 2], index: isize) -> Ghost {
    let n = line.cells;
    let side = usize::from(index >= 0);
    let beyond = !line.is_periodic() && (index < 0 || index >= n as isize);
    let odd = beyond && line.no_slip()[side];
    Ghost {
        index: resolve_cell(n, line.ends, index),
        sign: if odd { -1.0 } else { 1.0 },
        offset: if odd { 2.0 * wall_m_s[side] } else { 0.0 },
    }
}

/// Weights of the pairs of neighbours in `1 - (-delta^2/4)^N`, to be applied to `(q_m - q_0) + (q_-m - q_0)`.
fn weights<const N: usize>() -> [f64; N] {
    let mut weights = [0.0; N];
    // The coefficient of q_m in (-delta^2/4)^N is (-1)^m C(2N, N + m)/4^N.
    let mut binomial = 1.0;
    for i in 0..N {
        binomial *= (2 * N - i) as f64 / (i + 1) as f64;
    }
    for (i, weight) in weights.iter_mut().enumerate() {
        let m = i + 1;
        binomial *= (N - i) as f64 / (N + m) as f64;
        let sign = if m % 2 == 0 { 1.0 } else { -1.0 };
        *weight = -sign * binomial / 4.0_f64.powi(N as i32);
    }
    weights
}

macro_rules! planes {
    ($($name:ident $order:literal),*) => {$(
        #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
        fn $name(filter: &Filter, field: &[f64], component: usize, k: usize, out: &mut [f64], scratch: &mut Scratch) {
            plane::<$order>(filter, field, component, k, out, scratch);
        }
    )*};
}
planes!(plane_of_order_1 1, plane_of_order_2 2, plane_of_order_3 3, plane_of_order_4 4);

/// The small scales of plane `k`.
#[inline(always)]
fn plane<const N: usize>(
    filter: &Filter,
    field: &[f64],
    component: usize,
    k: usize,
    out: &mut [f64],
    scratch: &mut Scratch,
) {
    let shape = filter.shape;
    let n = shape.n[0];
    let weights = weights::<N>();
    let [along, across, over] = &filter.axes[component];
    for j in 0..shape.n[1] {
        let low = &mut scratch.plane[j * n..(j + 1) * n];
        smooth_rows::<N>(low, over, &weights, k, |index| &field[shape.row(j, index)]);
    }
    for j in 0..shape.n[1] {
        let plane = &scratch.plane;
        smooth_rows::<N>(&mut scratch.row, across, &weights, j, |index| &plane[index * n..(index + 1) * n]);
        let (out, own) = (&mut out[j * n..(j + 1) * n], &field[shape.row(j, k)]);
        if along.neighbours.is_empty() {
            for ((out, own), low) in out.iter_mut().zip(own).zip(&scratch.row) {
                *out = own - low;
            }
        } else {
            pad_with_ghosts::<N>(&mut scratch.padded, &scratch.row, along);
            difference::<N>(out, own, &scratch.padded, &weights);
        }
    }
}

/// `out` = the row at `index` of an axis, smoothed along it.
#[inline(always)]
fn smooth_rows<'a, const N: usize>(
    out: &mut [f64],
    axis: &AxisFilter,
    weights: &[f64; N],
    index: usize,
    row: impl Fn(usize) -> &'a [f64],
) {
    let n = out.len();
    let own = &row(index)[..n];
    let Some(near) = axis.neighbours.get(index) else {
        out.copy_from_slice(own);
        return;
    };
    let mut rows: [[&[f64]; 2]; N] = [[&[]; 2]; N];
    for (rows, [low, high]) in rows.iter_mut().zip(near) {
        *rows = [&row(low.index)[..n], &row(high.index)[..n]];
    }
    if axis.plain[index] {
        for i in 0..n {
            let mut sum = own[i];
            for (weight, [low, high]) in weights.iter().zip(&rows) {
                sum += weight * ((high[i] - own[i]) + (low[i] - own[i]));
            }
            out[i] = sum;
        }
    } else {
        for i in 0..n {
            let mut sum = own[i];
            for ((weight, rows), ghosts) in weights.iter().zip(&rows).zip(near) {
                let low = ghosts[0].sign * rows[0][i] + ghosts[0].offset;
                let high = ghosts[1].sign * rows[1][i] + ghosts[1].offset;
                sum += weight * ((high - own[i]) + (low - own[i]));
            }
            out[i] = sum;
        }
    }
}

/// Copies `row` between halos that continue it.
#[inline(always)]
fn pad_with_ghosts<const N: usize>(padded: &mut [f64], row: &[f64], axis: &AxisFilter) {
    let n = row.len();
    padded[HALO..HALO + n].copy_from_slice(row);
    let value = |ghost: &Ghost| ghost.sign * row[ghost.index] + ghost.offset;
    for m in 0..N {
        padded[HALO - 1 - m] = value(&axis.neighbours[0][m][0]);
        padded[HALO + n + m] = value(&axis.neighbours[n - 1][m][1]);
    }
}

/// `out = own -` the padded row smoothed along itself.
#[inline(always)]
fn difference<const N: usize>(out: &mut [f64], own: &[f64], padded: &[f64], weights: &[f64; N]) {
    let n = out.len();
    let (own, centre) = (&own[..n], &padded[HALO..HALO + n]);
    let (mut low, mut high): ([&[f64]; N], [&[f64]; N]) = ([&[]; N], [&[]; N]);
    for m in 0..N {
        low[m] = &padded[HALO - 1 - m..][..n];
        high[m] = &padded[HALO + 1 + m..][..n];
    }
    for i in 0..n {
        let mut sum = centre[i];
        for m in 0..N {
            sum += weights[m] * ((high[m][i] - centre[i]) + (low[m][i] - centre[i]));
        }
        out[i] = own[i] - sum;
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::mesh::{Direction, Mesh};
    use super::*;

    #[test]
    fn the_filter_takes_the_wave_of_each_phase_down_by_its_transfer_function() {
        let mesh = Mesh::new(
            Direction::periodic(24, 0.0, 1.0),
            Direction::periodic(10, 0.0, 1.0),
            Direction::periodic(12, 0.0, 1.0),
        );
        let layout = Layout::in_order(&mesh.unwrap(), [0, 1, 2]);
        for order in 1..=HIGHEST_ORDER {
            for waves in [[1, 0, 0], [0, 3, 0], [0, 0, 6], [5, 2, 3], [12, 0, 1]] {
                let theta: [f64; 3] =
                    std::array::from_fn(|d| std::f64::consts::TAU * f64::from(waves[d]) / layout.shape.n[d] as f64);
                let removed = |t: f64| (0.5 * t).sin().powi(2 * order as i32);
                let share = 1.0 - theta.iter().map(|&t| 1.0 - removed(t)).product::<f64>();
                let value = |place: usize| {
                    let index = [place % 24, place / 24 % 10, place / 240];
                    (0..3).map(|d| theta[d] * index[d] as f64).sum::<f64>().cos()
                };
                let field: Vec<f64> = (0..layout.shape.len()).map(value).collect();
                let mut small = [0, 1, 2].map(|_| vec![0.0; field.len()]);
                let filter = Filter::new(&layout, order);
                filter.small_scales([&field, &field, &field], &mut small.each_mut().map(Vec::as_mut_slice));
                for (small, field) in small.iter().flatten().zip(field.iter().cycle()) {
                    assert!((small - share * field).abs() < 5e-14, "order {order}, {waves:?}: {small}");
                }
            }
        }
    }
}
