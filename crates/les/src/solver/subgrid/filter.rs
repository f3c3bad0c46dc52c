//! The small-scale field of the multiscale model, `u - prod_j [1 - (-delta_j^2/4)^n] u`, with
//! `delta^2 q_i = q_(i+1) - 2 q_i + q_(i-1)` in the index space of each direction (Jeanmart and
//! Winckelmans 2007).
//!
//! The filter removes `sin^(2n)(theta/2)` of a wave of phase `theta` per cell. Walls are not
//! crossed: behind a no-slip wall the velocity relative to the wall is continued oddly, so that a
//! linear shear has no small scales; behind a slip wall what flows along it is even and what flows
//! through it odd. Differences vanish exactly where the field does not vary.
//!
//! Check: transfer function, constants and linear fields, bounds of the weights.

use multiversion::multiversion;
use rayon::prelude::*;

use super::super::layout::{Layout, Shape};
use super::super::operators_1d::{Operators1d, resolve_cell, resolve_face};
use super::super::rows::{HALO, cut_rows};

/// Highest order: the stencil must fit the halo of a padded row.
pub(super) const HIGHEST_ORDER: usize = HALO;

/// Source of the value at an index, which may lie beyond the end of an axis:
/// `sign * value[index] + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ghost {
    index: usize,
    sign: f64,
    offset: f64,
}

impl Ghost {
    /// A value as it is.
    const PLAIN: Self = Self {
        index: 0,
        sign: 1.0,
        offset: 0.0,
    };

    /// Its value in the row of values that are stored.
    #[inline(always)]
    fn value_in(self, row: &[f64]) -> f64 {
        self.sign * row[self.index] + self.offset
    }
}

/// For each place along an axis what stands for the values at distances 1, 2, ... below and above;
/// empty along a thin axis.
type Neighbours = Vec<Vec<[Ghost; 2]>>;

/// The filter of all components.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    shape: Shape,
    /// Weights of the pairs of neighbours at distances 1, 2, ...
    weights: Vec<f64>,
    /// `[component][axis]`.
    axes: [[Neighbours; 3]; 3],
}

impl Filter {
    pub(super) fn new(layout: &Layout, order: usize) -> Self {
        let axes = std::array::from_fn(|component| {
            std::array::from_fn(|axis| {
                let line = &layout.line[axis];
                if component == axis {
                    return neighbours(line, order, |index| face_ghost(line, index));
                }
                let wall_m_s = layout.wall_velocity_m_s(axis, component);
                neighbours(line, order, |index| cell_ghost(line, wall_m_s, index))
            })
        });
        Self {
            shape: layout.shape,
            weights: weights(order),
            axes,
        }
    }

    /// Writes the small scales of `velocity` to `small`.
    pub(super) fn small_scales(&self, velocity: [&[f64]; 3], small: &mut [&mut [f64]; 3]) {
        let shape = self.shape;
        for (axes, (field, small)) in self.axes.iter().zip(velocity.into_iter().zip(small)) {
            let planes = small[shape.own_range()]
                .par_chunks_mut(shape.plane())
                .zip(shape.own());
            planes.for_each_init(
                || {
                    let n = shape.n[0];
                    [shape.plane(), n, n + 2 * HALO].map(|length| vec![0.0; length])
                },
                |scratch, (out, k)| small_plane(self, axes, field, k, out, scratch),
            );
        }
    }
}

/// The neighbours of the places along an axis; `ghost` gives what stands for the value at any
/// index, also beyond the ends.
fn neighbours(line: &Operators1d, order: usize, ghost: impl Fn(isize) -> Ghost) -> Neighbours {
    if line.is_thin() {
        return Neighbours::new();
    }
    let mut neighbours = Neighbours::with_capacity(line.cells);
    for place in 0..line.cells as isize {
        let distances = 1..=order as isize;
        neighbours.push(
            distances
                .map(|d| [ghost(place - d), ghost(place + d)])
                .collect(),
        );
    }
    neighbours
}

/// Source of the normal velocity at face `index`, which may lie beyond the ends.
fn face_ghost(line: &Operators1d, index: isize) -> Ghost {
    let (face, sign) = resolve_face(line.cells, line.ends, index);
    // The face on the high wall is not stored, and nothing flows through it.
    let at_high_wall = face == line.cells;
    Ghost {
        index: if at_high_wall { 0 } else { face },
        sign: if at_high_wall { 0.0 } else { sign },
        offset: 0.0,
    }
}

/// Source of the velocity along the walls at cell `index`, which may lie beyond the ends.
fn cell_ghost(line: &Operators1d, wall_m_s: [f64; 2], index: isize) -> Ghost {
    let n = line.cells;
    let side = usize::from(index >= 0);
    let beyond = !line.is_periodic() && (index < 0 || index >= n as isize);
    let odd = beyond && line.ends.no_slip()[side];
    Ghost {
        index: resolve_cell(n, line.ends, index),
        sign: if odd { -1.0 } else { 1.0 },
        offset: if odd { 2.0 * wall_m_s[side] } else { 0.0 },
    }
}

/// Weights of the pairs of neighbours in `1 - (-delta^2/4)^order`, to be applied to
/// `(q_m - q_0) + (q_-m - q_0)`.
fn weights(order: usize) -> Vec<f64> {
    // The coefficient of q_m in (-delta^2/4)^n is (-1)^m C(2n, n + m)/4^n.
    let mut binomial = (0..order).fold(1.0, |product, i| {
        product * ((2 * order - i) as f64 / (i + 1) as f64)
    });
    let mut weights = Vec::with_capacity(order);
    for m in 1..=order {
        binomial *= (order + 1 - m) as f64 / (order + m) as f64;
        let sign = if m.is_multiple_of(2) { 1.0 } else { -1.0 };
        weights.push(-sign * binomial / 4.0_f64.powi(order as i32));
    }
    weights
}

/// The small scales of plane `k` of the component whose neighbours along the axes are `axes`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn small_plane(
    filter: &Filter,
    [along, across, over]: &[Neighbours; 3],
    field: &[f64],
    k: usize,
    out: &mut [f64],
    [plane, row, padded]: &mut [Vec<f64>; 3],
) {
    let shape = filter.shape;
    let n = shape.n[0];
    for (j, low) in plane.chunks_mut(n).enumerate() {
        smooth(low, &filter.weights, &over[..], k, |index| {
            &field[shape.row(j, index)]
        });
    }
    for (j, out) in out.chunks_mut(n).enumerate() {
        smooth(row, &filter.weights, &across[..], j, |index| {
            &plane[index * n..(index + 1) * n]
        });
        let own = &field[shape.row(j, k)];
        if let [first, .., last] = &along[..] {
            pad_with_ghosts(padded, row, first, last);
            for (m, weight) in filter.weights.iter().enumerate() {
                let beside = [&padded[HALO - 1 - m..], &padded[HALO + 1 + m..]];
                add_pair(row, &padded[HALO..], *weight, beside, [Ghost::PLAIN; 2]);
            }
        }
        for ((out, own), low) in out.iter_mut().zip(own).zip(row.iter()) {
            *out = own - low;
        }
    }
}

/// `out` = the row at `index` of an axis, smoothed along it.
#[inline(always)]
fn smooth<'a>(
    out: &mut [f64],
    weights: &[f64],
    axis: &[Vec<[Ghost; 2]>],
    index: usize,
    row: impl Fn(usize) -> &'a [f64],
) {
    let own = row(index);
    out.copy_from_slice(own);
    for (weight, pair) in weights.iter().zip(axis.get(index).into_iter().flatten()) {
        add_pair(
            out,
            own,
            *weight,
            [row(pair[0].index), row(pair[1].index)],
            *pair,
        );
    }
}

/// `out += weight [(q_m - q_0) + (q_-m - q_0)]` of a row `own` and the rows beside it.
#[inline(always)]
fn add_pair(out: &mut [f64], own: &[f64], weight: f64, rows: [&[f64]; 2], [low, high]: [Ghost; 2]) {
    let n = out.len();
    let own = &own[..n];
    let [x, y] = cut_rows!(rows, n, 0 1);
    for i in 0..n {
        let below = low.sign * x[i] + low.offset;
        let above = high.sign * y[i] + high.offset;
        out[i] += weight * ((above - own[i]) + (below - own[i]));
    }
}

/// Copies `row` between halos that continue it by the neighbours of its first and its last value.
#[inline(always)]
fn pad_with_ghosts(padded: &mut [f64], row: &[f64], first: &[[Ghost; 2]], last: &[[Ghost; 2]]) {
    let n = row.len();
    padded[HALO..HALO + n].copy_from_slice(row);
    for (m, (first, last)) in first.iter().zip(last).enumerate() {
        padded[HALO - 1 - m] = first[0].value_in(row);
        padded[HALO + n + m] = last[1].value_in(row);
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
                let theta: [f64; 3] = std::array::from_fn(|d| {
                    std::f64::consts::TAU * f64::from(waves[d]) / layout.shape.n[d] as f64
                });
                let removed = |t: f64| (0.5 * t).sin().powi(2 * order as i32);
                let share = 1.0 - theta.iter().map(|&t| 1.0 - removed(t)).product::<f64>();
                let value = |place: usize| {
                    let index = [place % 24, place / 24 % 10, place / 240];
                    (0..3)
                        .map(|d| theta[d] * index[d] as f64)
                        .sum::<f64>()
                        .cos()
                };
                let field: Vec<f64> = (0..layout.shape.len()).map(value).collect();
                let mut small = [0, 1, 2].map(|_| vec![0.0; field.len()]);
                let filter = Filter::new(&layout, order);
                filter.small_scales(
                    [&field, &field, &field],
                    &mut small.each_mut().map(Vec::as_mut_slice),
                );
                for (small, field) in small.iter().flatten().zip(field.iter().cycle()) {
                    assert!(
                        (small - share * field).abs() < 5e-14,
                        "order {order}, {waves:?}: {small}"
                    );
                }
            }
        }
    }
}
