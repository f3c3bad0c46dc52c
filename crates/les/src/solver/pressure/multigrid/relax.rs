//! Relaxation of whole lines on one mesh: the tridiagonal problem along a line is solved exactly, for 16 modes side by side.
//!
//! The elimination works with the excess of the pivot over the link ahead, `e_k = s m_k + e_{k-1} c_{k-1}/(c_{k-1} +
//! e_{k-1})`, a sum of positive terms: single precision suffices on cells of any aspect ratio. A line that is singular (no
//! neighbours, and a mode that is constant) has an excess of exactly zero at its end and keeps its level.
//!
//! Check: lines that were relaxed leave no residual; the singular line.

use multiversion::multiversion;

use super::grid::Axis;
use super::lanes::{LANES, Lanes};

/// Lines that are solved together, to hide the delay of a division.
const TOGETHER: usize = 4;

/// One direction of one mesh in single precision.
#[derive(Debug)]
pub(crate) struct Side {
    mass: Vec<f32>,
    link: Vec<f32>,
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
}

impl Side {
    pub(crate) fn new(axis: &Axis, stride: usize) -> Self {
        Self {
            mass: axis.mass.iter().map(|m| *m as f32).collect(),
            link: axis.link.iter().map(|c| *c as f32).collect(),
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

    /// The neighbours of cell `i` before and behind it and the links to them; a link of zero where there is none.
    #[inline(always)]
    pub(crate) fn neighbours(&self, i: usize) -> [(usize, f32); 2] {
        let last = self.mass.len() - 1;
        let before = if i > 0 { (i - 1, self.link[i - 1]) } else { (last, self.link[last]) };
        let behind = if i < last { (i + 1, self.link[i]) } else { (0, self.link[last]) };
        [before, behind]
    }
}

/// Relaxes all lines along `along`, colour by colour; the colours in reverse order if `back`.
pub(crate) fn relax(
    (along, across): (&Side, &Side),
    mode: &Lanes,
    u: &mut [Lanes],
    f: &[Lanes],
    back: bool,
    scratch: &mut Scratch,
) {
    let n = along.len();
    scratch.inverse.resize(n, [[0.0; LANES]; TOGETHER]);
    scratch.border.resize(n, [[0.0; LANES]; TOGETHER]);
    let count = across.colours.len();
    for c in 0..count {
        let colour = &across.colours[if back { count - 1 - c } else { c }];
        relax_colour(along, across, colour, mode, u, f, scratch);
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
    scratch: &mut Scratch,
) {
    let (groups, rest) = colour.as_chunks::<TOGETHER>();
    for group in groups {
        relax_lines::<TOGETHER>(along, across, group, mode, u, f, scratch);
    }
    for line in rest {
        relax_lines::<1>(along, across, &[*line], mode, u, f, scratch);
    }
}

/// What one line sees of the direction across it.
#[derive(Clone, Copy)]
struct Across {
    start: usize,
    /// Starts of the neighbouring lines and the links to them, over the own mass.
    neighbours: [(usize, f32); 2],
    inverse_mass: f32,
    shift: Lanes,
}

#[inline(always)]
fn across_line(across: &Side, line: usize, mode: &Lanes) -> Across {
    let inverse_mass = 1.0 / across.mass[line];
    let neighbours = across.neighbours(line).map(|(i, link)| (i * across.stride, link * inverse_mass));
    let links = neighbours[0].1 + neighbours[1].1;
    Across { start: line * across.stride, neighbours, inverse_mass, shift: mode.map(|lambda| lambda + links) }
}

/// Solves `GROUP` lines together.
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
    let side: [Across; GROUP] = std::array::from_fn(|g| across_line(across, lines[g], mode));
    let n = along.mass.len();
    // A periodic line is cut before its last cell, which is solved for at the end.
    let inner = if along.wraps { n - 1 } else { n };
    let wrap = if along.wraps { along.link[n - 1] } else { 0.0 };
    let mut excess = [[0.0_f32; LANES]; GROUP];
    let mut last = [[0.0_f32; LANES]; GROUP];
    let mut ratio = [[0.0_f32; LANES]; GROUP];
    let mut border = [[0.0_f32; LANES]; GROUP];
    for k in 0..n {
        let (mass, at) = (along.mass[k], k * along.stride);
        // The link ahead; that of the last cell of a cut line leads to the cut.
        let ahead = if k + 1 < n { along.link[k] } else { 0.0 };
        for g in 0..GROUP {
            let s = &side[g];
            let right = right_side(s, mass, at, u, f);
            let out = &mut u[s.start + at];
            if k >= inner {
                *out = right;
                continue;
            }
            let first = if k == 0 { wrap } else { 0.0 };
            for l in 0..LANES {
                let e = mass.mul_add(s.shift[l], ratio[g][l].mul_add(excess[g][l], first));
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
            *out = last[g];
            scratch.border[k][g] = border[g];
        }
    }
    substitute::<GROUP>(along, &side, inner, u, scratch);
}

/// Right side of a line at one cell, with the neighbouring lines' share.
#[inline(always)]
fn right_side(s: &Across, mass: f32, at: usize, u: &[Lanes], f: &[Lanes]) -> Lanes {
    let own = &f[s.start + at];
    let [a, b] = s.neighbours;
    let (ua, ub) = (&u[a.0 + at], &u[b.0 + at]);
    let (ca, cb) = (a.1 * mass, b.1 * mass);
    std::array::from_fn(|l| ca.mul_add(ua[l], cb.mul_add(ub[l], own[l] * s.inverse_mass)))
}

/// Substitutes back along `GROUP` lines whose eliminated right sides are in `u`.
#[inline(always)]
fn substitute<const GROUP: usize>(
    along: &Side,
    side: &[Across; GROUP],
    inner: usize,
    u: &mut [Lanes],
    scratch: &mut Scratch,
) {
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
            let out = &mut u[side[g].start + k * along.stride];
            for l in 0..LANES {
                let inverse = scratch.inverse[k][g][l];
                let x = inverse * ahead.mul_add(next[g][l], out[l]);
                next[g][l] = x;
                out[l] = x;
                if cut {
                    let w = inverse * ahead.mul_add(next_border[g][l], scratch.border[k][g][l] + to_cut);
                    next_border[g][l] = w;
                    scratch.border[k][g][l] = w;
                    weighted[g][l] = along.mass[k].mul_add(w, weighted[g][l]);
                }
            }
        }
    }
    if !cut {
        return;
    }
    for g in 0..GROUP {
        let s = &side[g];
        let place = |k: usize| s.start + k * along.stride;
        let (first, before, right) = (u[place(0)], u[place(inner - 1)], u[place(inner)]);
        let (wrap, link) = (along.link[inner], along.link[inner - 1]);
        let value: Lanes = std::array::from_fn(|l| {
            let pivot = s.shift[l] * (along.mass[inner] + weighted[g][l]);
            let right = wrap.mul_add(first[l], link.mul_add(before[l], right[l]));
            if pivot == 0.0 { 0.0 } else { right / pivot }
        });
        u[place(inner)] = value;
        for k in 0..inner {
            let out = &mut u[place(k)];
            for l in 0..LANES {
                out[l] = scratch.border[k][g][l].mul_add(value[l], out[l]);
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
        let mut worst = 0.0_f32;
        for &j in across.colours.last().unwrap() {
            for k in 0..along.len() {
                for l in 0..LANES {
                    let at = |k: usize, j: usize| u[k * along.stride + j * across.stride][l];
                    let mut sum = mode[l] * along.mass[k] * across.mass[j] * at(k, j);
                    for (i, link) in along.neighbours(k) {
                        sum += across.mass[j] * link * (at(k, j) - at(i, j));
                    }
                    for (i, link) in across.neighbours(j) {
                        sum += along.mass[k] * link * (at(k, j) - at(k, i));
                    }
                    worst = worst.max((sum - f[k * along.stride + j * across.stride][l]).abs());
                }
            }
        }
        worst
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
