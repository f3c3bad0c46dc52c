//! Relaxation of whole lines on one mesh, for 16 modes side by side: what is left on a line is corrected by the solution of a
//! tridiagonal problem along it.
//!
//! The residual is that of the level's own operator, of fourth order on the finest mesh. The tridiagonal problem has that operator's
//! diagonal across the line and second-order links along it, on the finest mesh raised to the middle of the ratios of both.
//!
//! The elimination works with the excess of the pivot over the link ahead, `e_k = s m_k + e_{k-1} c_{k-1}/(c_{k-1} +
//! e_{k-1})`, a sum of positive terms, and residuals with differences between neighbours: single precision suffices on cells of
//! any aspect ratio. A line that is singular (no neighbours, and a mode that is constant) has an excess of exactly zero at its end and
//! keeps its level.
//!
//! Check: lines that were relaxed leave no residual on coarse meshes, hardly any on the finest; the singular line.

use multiversion::multiversion;

use super::super::super::operators_1d::Taps;
use super::grid::Axis;
use super::lanes::{LANES, Lanes};

/// Lines that are solved together, to hide the delay of a division.
const TOGETHER: usize = 4;
/// Factor of the links along a line on the finest mesh: the fourth-order operator exceeds the second-order one by up to 1.37.
const RAISED: f64 = 1.15;

/// One direction of one mesh in single precision.
#[derive(Debug)]
pub(crate) struct Side {
    mass: Vec<f32>,
    /// Links of the tridiagonal problems along this direction.
    link: Vec<f32>,
    /// Cells that each cell is coupled to, and the couplings.
    taps: Vec<Vec<(usize, f32)>>,
    /// Sum of these over the cell's mass.
    diagonal: Vec<f32>,
    colours: Vec<Vec<usize>>,
    wraps: bool,
    /// Distance in memory of two neighbours.
    stride: usize,
}

/// Space for one group of lines.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    inverse: Vec<[Lanes; TOGETHER]>,
    border: Vec<[Lanes; TOGETHER]>,
    solution: Vec<[Lanes; TOGETHER]>,
}

impl Side {
    /// That of a coarse mesh: second order.
    pub(crate) fn new(axis: &Axis, stride: usize) -> Self {
        Self::of(axis, stride, axis.couplings(), 1.0)
    }

    /// That of the finest mesh, with the rows `stiffness` of the fourth-order operator.
    pub(crate) fn finest(axis: &Axis, stride: usize, stiffness: &[Taps]) -> Self {
        let neighbours =
            |(i, row): (usize, &Taps)| row.iter().filter(|tap| tap.0 != i).map(|&(j, c)| (j, -c)).collect();
        Self::of(axis, stride, stiffness.iter().enumerate().map(neighbours).collect(), RAISED)
    }

    fn of(axis: &Axis, stride: usize, couplings: Vec<Taps>, raised: f64) -> Self {
        let sum = |(row, mass): (&Taps, &f64)| (row.iter().map(|tap| tap.1).sum::<f64>() / mass) as f32;
        Self {
            mass: axis.mass.iter().map(|m| *m as f32).collect(),
            link: axis.link.iter().map(|c| (raised * c) as f32).collect(),
            diagonal: couplings.iter().zip(&axis.mass).map(sum).collect(),
            taps: couplings.iter().map(|row| row.iter().map(|&(j, c)| (j, c as f32)).collect()).collect(),
            colours: super::grid::colours(axis),
            wraps: axis.wraps(),
            stride,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.mass.len()
    }

    pub(crate) fn mass(&self, i: usize) -> f32 {
        self.mass[i]
    }
}

/// What `u` leaves of `f` in the cell with the indices `a` and `b` along the two sides.
#[inline(always)]
pub(crate) fn residual_at(
    [first, second]: [&Side; 2],
    [a, b]: [usize; 2],
    mode: &Lanes,
    u: &[Lanes],
    f: &[Lanes],
) -> Lanes {
    let (m1, m2) = (first.mass[a], second.mass[b]);
    let at = a * first.stride + b * second.stride;
    let own = u[at];
    let right = &f[at];
    let mut sum: Lanes = std::array::from_fn(|l| mode[l].mul_add(-m1 * m2 * own[l], right[l]));
    let (row, column) = (b * second.stride, a * first.stride);
    for &(i, c) in &first.taps[a] {
        add_difference(&mut sum, c * m2, &u[i * first.stride + row], &own);
    }
    for &(i, c) in &second.taps[b] {
        add_difference(&mut sum, c * m1, &u[i * second.stride + column], &own);
    }
    sum
}

/// `sum += c (other - own)`.
#[inline(always)]
fn add_difference(sum: &mut Lanes, c: f32, other: &Lanes, own: &Lanes) {
    for l in 0..LANES {
        sum[l] = c.mul_add(other[l] - own[l], sum[l]);
    }
}

/// Relaxes all lines along `along`, colour by colour; everything in reverse order if `back`.
pub(crate) fn relax(
    (along, across): (&Side, &Side),
    mode: &Lanes,
    u: &mut [Lanes],
    f: &[Lanes],
    back: bool,
    scratch: &mut Scratch,
) {
    let n = along.len();
    for lines in [&mut scratch.inverse, &mut scratch.border, &mut scratch.solution] {
        lines.resize(n, [[0.0; LANES]; TOGETHER]);
    }
    let count = across.colours.len();
    for c in 0..count {
        let colour = &across.colours[if back { count - 1 - c } else { c }];
        relax_colour(along, across, colour, mode, u, f, back, scratch);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn relax_colour(
    along: &Side,
    across: &Side,
    colour: &[usize],
    mode: &Lanes,
    u: &mut [Lanes],
    f: &[Lanes],
    back: bool,
    scratch: &mut Scratch,
) {
    let (groups, rest) = colour.as_chunks::<TOGETHER>();
    let (count, all) = (groups.len(), groups.len() + rest.len());
    for step in 0..all {
        let place = if back { all - 1 - step } else { step };
        if place < count {
            relax_lines::<TOGETHER>(along, across, &groups[place], mode, u, f, scratch);
        } else {
            relax_lines::<1>(along, across, &[rest[place - count]], mode, u, f, scratch);
        }
    }
}

/// Corrects `GROUP` lines together.
#[inline(always)]
fn relax_lines<const GROUP: usize>(
    along: &Side,
    across: &Side,
    lines: &[usize; GROUP],
    mode: &Lanes,
    u: &mut [Lanes],
    f: &[Lanes],
    scratch: &mut Scratch,
) {
    let shift: [Lanes; GROUP] = lines.map(|line| mode.map(|lambda| lambda + across.diagonal[line]));
    let inverse_mass = lines.map(|line| 1.0 / across.mass[line]);
    let n = along.mass.len();
    // A periodic line is cut before its last cell, which is solved for at the end.
    let inner = if along.wraps { n - 1 } else { n };
    let wrap = if along.wraps { along.link[n - 1] } else { 0.0 };
    let mut excess = [[0.0_f32; LANES]; GROUP];
    let mut last = [[0.0_f32; LANES]; GROUP];
    let mut ratio = [[0.0_f32; LANES]; GROUP];
    let mut border = [[0.0_f32; LANES]; GROUP];
    for k in 0..n {
        let mass = along.mass[k];
        // The link ahead; that of the last cell of a cut line leads to the cut.
        let ahead = if k + 1 < n { along.link[k] } else { 0.0 };
        for g in 0..GROUP {
            let right = residual_at([along, across], [k, lines[g]], mode, u, f).map(|r| r * inverse_mass[g]);
            if k >= inner {
                scratch.solution[k][g] = right;
                continue;
            }
            let first = if k == 0 { wrap } else { 0.0 };
            for l in 0..LANES {
                let e = mass.mul_add(shift[g][l], ratio[g][l].mul_add(excess[g][l], first));
                let pivot = ahead + e;
                let inverse = if pivot == 0.0 { 0.0 } else { 1.0 / pivot };
                let y = ratio[g][l].mul_add(last[g][l], right[l]);
                let w = ratio[g][l].mul_add(border[g][l], first);
                scratch.inverse[k][g][l] = inverse;
                ratio[g][l] = ahead * inverse;
                excess[g][l] = e;
                last[g][l] = y;
                border[g][l] = w;
            }
            scratch.solution[k][g] = last[g];
            scratch.border[k][g] = border[g];
        }
    }
    substitute::<GROUP>(along, &shift, inner, scratch);
    for k in 0..n {
        for g in 0..GROUP {
            let out = &mut u[lines[g] * across.stride + k * along.stride];
            for l in 0..LANES {
                out[l] += scratch.solution[k][g][l];
            }
        }
    }
}

/// Substitutes back along `GROUP` lines whose eliminated right sides are in the scratch.
#[inline(always)]
fn substitute<const GROUP: usize>(along: &Side, shift: &[Lanes; GROUP], inner: usize, scratch: &mut Scratch) {
    let Scratch { inverse, border, solution } = scratch;
    let n = along.mass.len();
    let cut = inner < n;
    let mut next = [[0.0_f32; LANES]; GROUP];
    let mut next_border = [[0.0_f32; LANES]; GROUP];
    // Mass of the line, weighted with the response to the value at the cut.
    let mut weighted = [[0.0_f32; LANES]; GROUP];
    for k in (0..inner).rev() {
        let ahead = if k + 1 < n { along.link[k] } else { 0.0 };
        let to_cut = if k + 1 == inner && cut { ahead } else { 0.0 };
        for g in 0..GROUP {
            let out = &mut solution[k][g];
            for l in 0..LANES {
                let inverse = inverse[k][g][l];
                let x = inverse * ahead.mul_add(next[g][l], out[l]);
                next[g][l] = x;
                out[l] = x;
                if cut {
                    let w = inverse * ahead.mul_add(next_border[g][l], border[k][g][l] + to_cut);
                    next_border[g][l] = w;
                    border[k][g][l] = w;
                    weighted[g][l] = along.mass[k].mul_add(w, weighted[g][l]);
                }
            }
        }
    }
    if !cut {
        return;
    }
    for g in 0..GROUP {
        let (first, before, right) = (solution[0][g], solution[inner - 1][g], solution[inner][g]);
        let (wrap, link) = (along.link[inner], along.link[inner - 1]);
        let value: Lanes = std::array::from_fn(|l| {
            let pivot = shift[g][l] * (along.mass[inner] + weighted[g][l]);
            let right = wrap.mul_add(first[l], link.mul_add(before[l], right[l]));
            if pivot == 0.0 { 0.0 } else { right / pivot }
        });
        solution[inner][g] = value;
        for k in 0..inner {
            for l in 0..LANES {
                solution[k][g][l] = border[k][g][l].mul_add(value[l], solution[k][g][l]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::super::mesh::{Direction, Mapping, Wall};
    use super::super::super::super::operators_1d::Operators1d;
    use super::*;

    fn wave(n: usize, f: f32) -> Vec<Lanes> {
        (0..n).map(|p| std::array::from_fn(|l| ((p * LANES + l) as f32 * f).sin())).collect()
    }

    /// Largest residual on the lines of the last colour, relative to the largest right side.
    fn left_over(along: &Side, across: &Side, mode: &Lanes, u: &[Lanes], f: &[Lanes]) -> f32 {
        let places = across.colours.last().unwrap().iter().flat_map(|j| (0..along.len()).map(move |k| [k, *j]));
        let left = places.flat_map(|place| residual_at([along, across], place, mode, u, f));
        left.fold(0.0, |worst, r| worst.max(r.abs()))
    }

    #[test]
    fn relaxed_lines_leave_no_residual_in_all_kinds_of_directions() {
        let kinds = [
            Direction::between(13, 0.0, 13.0, Wall::AT_REST, Wall::Slip).stretched(Mapping::TanhLow { strength: 1.0 }),
            Direction::periodic(11, 0.0, 11.0).stretched(Mapping::Sine { amplitude: 0.5 }),
            Direction::periodic(8, 0.0, 8.0),
        ];
        let mode: Lanes = std::array::from_fn(|l| if l == 0 { 0.0 } else { 0.1 * l as f32 });
        for a in &kinds {
            for b in &kinds {
                let axes = [a, b].map(|d| Axis::new(&Operators1d::new(d), 1.0));
                let along = Side::new(&axes[0], axes[1].len());
                let across = Side::new(&axes[1], 1);
                let n = along.len() * across.len();
                let (mut u, f) = (wave(n, 0.3), wave(n, 0.7));
                relax((&along, &across), &mode, &mut u, &f, false, &mut Scratch::default());
                let left = left_over(&along, &across, &mode, &u, &f);
                assert!(left < 2e-5, "{a:?} {b:?}: {left}");
            }
        }
    }

    #[test]
    fn a_single_line_of_a_constant_mode_is_solved_up_to_its_level() {
        for direction in [Direction::periodic(9, 0.0, 9.0), Direction::between(9, 0.0, 9.0, Wall::Slip, Wall::Slip)] {
            let along = Side::new(&Axis::new(&Operators1d::new(&direction), 1.0), 1);
            let across = Side::new(&Axis::new(&Operators1d::new(&Direction::thin(1.0)), 1.0), 9);
            let mode = [0.0; LANES];
            let mut f = wave(9, 0.7);
            for l in 0..LANES {
                let mean = f.iter().map(|f| f[l]).sum::<f32>() / 9.0;
                f.iter_mut().for_each(|f| f[l] -= mean);
            }
            let mut u = vec![[0.0; LANES]; 9];
            relax((&along, &across), &mode, &mut u, &f, false, &mut Scratch::default());
            let left = left_over(&along, &across, &mode, &u, &f);
            assert!(left < 1e-5, "{direction:?}: {left}");
        }
    }
}
