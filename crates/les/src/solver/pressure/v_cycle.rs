//! One cycle of multigrid in two dimensions, 16 modes side by side: line relaxation in both
//! directions, from fine to coarse and back.
//!
//! Check: symmetry of the cycle, interpolation, colours, relaxed lines.

use multiversion::multiversion;

use super::super::operators_1d::{Operators1d, Taps};
use super::apply::off_diagonal;

/// Modes that are solved side by side.
pub(super) const LANES: usize = 16;
/// One value of each mode.
pub(super) type Lanes = [f32; LANES];

/// Lines that are solved together, to hide the delay of a division.
const TOGETHER: usize = 4;
/// Factor of the links along a line on the finest mesh: the fourth-order operator exceeds the
/// second-order one by up to 1.37.
const RAISED: f32 = 1.15;
/// Relaxations of both directions before and after the coarser mesh, on the finest and on the
/// others.
const SWEEPS: [usize; 2] = [1, 2];

/// One mesh: axis 1 is contiguous.
#[derive(Debug)]
pub(super) struct Level {
    pub(super) axes: [Axis; 2],
    /// Interpolation from the next mesh: for each cell along an axis two coarse cells and their
    /// weights.
    weights: [Vec<[(usize, f32); 2]>; 2],
    sweeps: usize,
}

/// One direction of one mesh.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) mass: Vec<f64>,
    centre: Vec<f64>,
    /// Distance after which the positions repeat.
    period: Option<f64>,
    /// The tridiagonal problems of lines along it: inverse distance of cell `i` to cell `i + 1`;
    /// the last is the link to cell 0 of a periodic direction, or zero.
    link: Vec<f32>,
    /// Cells that each cell is coupled to, and the couplings.
    taps: Vec<Vec<(usize, f32)>>,
    /// Sum of these over the cell's mass.
    diagonal: Vec<f32>,
    /// The lines across it in the order of their relaxation: no two neighbours together.
    lines: Vec<Vec<usize>>,
}

/// A few lines that are solved together, and a coarse row.
#[derive(Debug)]
pub(super) struct Lines {
    line: Vec<[Cell; TOGETHER]>,
    row: Vec<Lanes>,
}

/// A cell of a line that is being solved.
#[derive(Debug, Clone, Copy)]
struct Cell {
    inverse: Lanes,
    right: Lanes,
    /// Response to the value at the cut of a periodic line.
    border: Lanes,
}

const NO_CELL: Cell = Cell {
    inverse: [0.0; LANES],
    right: [0.0; LANES],
    border: [0.0; LANES],
};

impl Lines {
    /// Those of the finest mesh, which are the longest.
    pub(super) fn new(finest: &Level) -> Self {
        let [first, second] = finest.axes.each_ref().map(Axis::len);
        Self {
            line: vec![[NO_CELL; TOGETHER]; first.max(second)],
            row: vec![[0.0; LANES]; first],
        }
    }
}

impl Axis {
    /// That of the finest mesh, in units of `unit_m` \[m\], with the rows `stiffness` of the
    /// fourth-order operator.
    pub(super) fn finest(line: &Operators1d, unit_m: f64, stiffness: &[Taps]) -> Self {
        // The centres follow each other at the distances about the faces; after the last of them a
        // periodic direction repeats itself.
        let mut centre = Vec::with_capacity(line.cells);
        let mut end = 0.0;
        for face_mass_m in &line.face_mass_m[1..] {
            centre.push(end);
            end += face_mass_m / unit_m;
        }
        let repeats = line.is_periodic() && line.cells > 1;
        let mass = line.cell_mass_m.iter().map(|mass| mass / unit_m).collect();
        let axis = Self::new(mass, centre, repeats.then_some(end));
        let link = axis.link.iter().map(|c| RAISED * c).collect();
        let mut couplings = off_diagonal(stiffness);
        for (_, c) in couplings.iter_mut().flatten() {
            *c = -*c;
        }
        Self {
            link,
            ..axis.coupled(&couplings)
        }
    }

    /// Cells of these masses and positions with couplings of second order: the masses of the
    /// fourth-order operator make its eigenvectors of long wavelength the same, and the eigenvalues
    /// within a factor 1.37 everywhere.
    fn new(mass: Vec<f64>, centre: Vec<f64>, period: Option<f64>) -> Self {
        let n = mass.len();
        let mut link: Vec<f64> = centre.windows(2).map(|x| 1.0 / (x[1] - x[0])).collect();
        let wrap = period.map_or(0.0, |period| 1.0 / (centre[0] + period - centre[n - 1]));
        if n == 2 {
            // Both links join the same two cells.
            link[0] += wrap;
        }
        link.push(if n > 2 { wrap } else { 0.0 });
        let mut couplings = vec![Taps::new(); n];
        for (i, couplings) in couplings.iter_mut().enumerate() {
            let before = (i + n - 1) % n;
            for (other, link) in [(before, link[before]), ((i + 1) % n, link[i])] {
                if link != 0.0 {
                    couplings.push((other, link));
                }
            }
        }
        // The last of an odd number of periodic lines touches the first.
        let end = n - usize::from(link[n - 1] != 0.0 && n % 2 == 1);
        let even: Vec<usize> = (0..end).step_by(2).collect();
        let odd: Vec<usize> = (1..end).step_by(2).collect();
        let last: Vec<usize> = (end..n).collect();
        let mut lines = Vec::new();
        for colour in [even, odd, last] {
            lines.extend(colour.chunks(TOGETHER).map(<[usize]>::to_vec));
        }
        let axis = Self {
            mass,
            centre,
            period,
            link: link.into_iter().map(|c| c as f32).collect(),
            taps: Vec::new(),
            diagonal: Vec::new(),
            lines,
        };
        axis.coupled(&couplings)
    }

    /// The same cells with other couplings.
    fn coupled(self, couplings: &[Taps]) -> Self {
        let mut taps = Vec::with_capacity(couplings.len());
        let mut diagonal = Vec::with_capacity(couplings.len());
        for (row, mass) in couplings.iter().zip(&self.mass) {
            taps.push(row.iter().map(|&(j, c)| (j, c as f32)).collect());
            diagonal.push((row.iter().map(|tap| tap.1).sum::<f64>() / mass) as f32);
        }
        Self {
            taps,
            diagonal,
            ..self
        }
    }

    fn len(&self) -> usize {
        self.mass.len()
    }

    /// Link of the last cell to the first; zero unless the direction is periodic.
    fn wrap(&self) -> f32 {
        self.link[self.len() - 1]
    }

    /// Cells of a line before the cut: all unless the direction is periodic.
    fn inner(&self) -> usize {
        self.len() - usize::from(self.wrap() != 0.0)
    }

    /// The mesh of pairs, of which the last of an odd number stays alone.
    fn coarsened(&self) -> Self {
        let mut mass = Vec::with_capacity(self.len().div_ceil(2));
        let mut centre = Vec::with_capacity(self.len().div_ceil(2));
        for (masses, centres) in self.mass.chunks(2).zip(self.centre.chunks(2)) {
            mass.push(masses.iter().sum());
            centre.push(centres.iter().sum::<f64>() / centres.len() as f64);
        }
        Self::new(mass, centre, self.period)
    }

    /// Linear interpolation from the cells of `coarse`; constant beyond the outermost of them.
    fn weights_from(&self, coarse: &Self) -> Vec<[(usize, f32); 2]> {
        let centre = &coarse.centre;
        let last = coarse.len() - 1;
        let mut weights = Vec::with_capacity(self.len());
        for (i, &x) in self.centre.iter().enumerate() {
            let own = i / 2;
            let is_above = x >= centre[own];
            let (other, position) = match self.period {
                _ if is_above && own < last => (own + 1, centre[own + 1]),
                _ if !is_above && own > 0 => (own - 1, centre[own - 1]),
                Some(period) if is_above => (0, centre[0] + period),
                Some(period) => (last, centre[last] - period),
                None => (own, x + 1.0),
            };
            let fraction = if other == own {
                0.0
            } else {
                (x - centre[own]) / (position - centre[own])
            };
            weights.push([(own, (1.0 - fraction) as f32), (other, fraction as f32)]);
        }
        weights
    }
}

impl Level {
    /// Its cells.
    pub(super) fn cells(&self) -> usize {
        self.axes[0].len() * self.axes[1].len()
    }

    /// The meshes from `finest` to one with a single line, which relaxation solves.
    pub(super) fn hierarchy(finest: [Axis; 2]) -> Vec<Self> {
        let mut levels = vec![Self {
            axes: finest,
            weights: Default::default(),
            sweeps: SWEEPS[0],
        }];
        while let Some(fine) = levels
            .last_mut()
            .filter(|level| level.axes.iter().all(|axis| axis.len() > 1))
        {
            let axes = fine.axes.each_ref().map(Axis::coarsened);
            fine.weights = std::array::from_fn(|a| fine.axes[a].weights_from(&axes[a]));
            levels.push(Self {
                axes,
                weights: Default::default(),
                sweeps: SWEEPS[1],
            });
        }
        levels
    }
}

/// One V-cycle from zero: relaxation afterwards in reverse order makes it symmetric.
pub(super) fn v_cycle(
    levels: &[Level],
    mode: &Lanes,
    fields: &mut [[Vec<Lanes>; 2]],
    lines: &mut Lines,
) {
    let ([level, coarser @ ..], [[u, f], below @ ..]) = (levels, fields) else {
        return;
    };
    u.fill([0.0; LANES]);
    for _ in 0..level.sweeps {
        relax(level, 0, mode, u, f, false, &mut lines.line);
        relax(level, 1, mode, u, f, false, &mut lines.line);
    }
    if let Some(coarse) = coarser.first() {
        let n = coarse.axes[0].len();
        restrict(level, mode, u, f, &mut below[0][1], &mut lines.row[..n]);
        v_cycle(coarser, mode, below, lines);
        interpolate(level, &below[0][0], u, &mut lines.row[..n]);
    }
    for _ in 0..level.sweeps {
        relax(level, 1, mode, u, f, true, &mut lines.line);
        relax(level, 0, mode, u, f, true, &mut lines.line);
    }
}

/// What `u` leaves of `f` in the cell with the indices `at`: differences between neighbours, so
/// that single precision suffices on cells of any aspect ratio.
#[inline(always)]
fn residual_at(level: &Level, [j, k]: [usize; 2], mode: &Lanes, u: &[Lanes], f: &[Lanes]) -> Lanes {
    let [first, second] = &level.axes;
    let n = first.len();
    let m1 = first.mass[j] as f32;
    let m2 = second.mass[k] as f32;
    let own = u[k * n + j];
    let right = f[k * n + j];
    let mut left = [0.0; LANES];
    for l in 0..LANES {
        left[l] = mode[l].mul_add(-m1 * m2 * own[l], right[l]);
    }
    for &(i, c) in &first.taps[j] {
        add_difference(&mut left, c * m2, &u[k * n + i], &own);
    }
    for &(i, c) in &second.taps[k] {
        add_difference(&mut left, c * m1, &u[i * n + j], &own);
    }
    left
}

/// `sum += c (other - own)`.
#[inline(always)]
fn add_difference(sum: &mut Lanes, c: f32, other: &Lanes, own: &Lanes) {
    for l in 0..LANES {
        sum[l] = c.mul_add(other[l] - own[l], sum[l]);
    }
}

/// Corrects all lines along axis `a` for what they leave, group after group, in reverse order if
/// `in_reverse`: by the solution of a tridiagonal problem with the diagonal of the level's operator
/// across the line and the links along it.
///
/// The elimination works with the excess of the pivot over the link ahead,
/// `e_k = s m_k + e_(k-1) c_(k-1)/(c_(k-1) + e_(k-1))`, a sum of positive terms. A line that is
/// singular (no neighbours, and a mode that is constant) has an excess of exactly zero at its end
/// and keeps its level. A periodic line is cut before its last cell, which is solved for at the
/// end.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn relax(
    level: &Level,
    a: usize,
    mode: &Lanes,
    u: &mut [Lanes],
    f: &[Lanes],
    in_reverse: bool,
    line: &mut [[Cell; TOGETHER]],
) {
    let along = &level.axes[a];
    let across = &level.axes[1 - a];
    let n = along.len();
    let groups = across.lines.len();
    for group in 0..groups {
        let number = if in_reverse {
            groups - 1 - group
        } else {
            group
        };
        let lines = &across.lines[number];
        level.eliminate(a, mode, lines, u, f, line);
        let weighted = level.substitute(a, lines.len(), line);
        for (g, &position) in lines.iter().enumerate() {
            let mut cut = [0.0; LANES];
            if along.inner() < n {
                cut = level.value_at_cut(a, mode, position, g, &weighted[g], line);
            }
            for (k, line) in line[..n].iter().enumerate() {
                let [j, k] = level.place(a, position, k);
                let out = &mut u[k * level.axes[0].len() + j];
                for l in 0..LANES {
                    out[l] += line[g].border[l].mul_add(cut[l], line[g].right[l]);
                }
            }
        }
    }
}

impl Level {
    /// Place of cell `k` of the line along an axis at a position across the lines.
    #[inline(always)]
    fn place(&self, axis: usize, position: usize, k: usize) -> [usize; 2] {
        if axis == 0 {
            [k, position]
        } else {
            [position, k]
        }
    }

    /// Eliminates a group of lines along an axis from the first cell to the last.
    #[inline(always)]
    fn eliminate(
        &self,
        axis: usize,
        mode: &Lanes,
        positions: &[usize],
        u: &[Lanes],
        f: &[Lanes],
        line: &mut [[Cell; TOGETHER]],
    ) {
        let along = &self.axes[axis];
        let across = &self.axes[1 - axis];
        let n = along.len();
        let wrap = along.wrap();
        let inner = along.inner();
        let mut excess = [[0.0; LANES]; TOGETHER];
        for k in 0..n {
            let mass = along.mass[k] as f32;
            let first = if k == 0 { wrap } else { 0.0 };
            let behind = if k == 0 { 0.0 } else { along.link[k - 1] };
            let ahead = if k + 1 < n { along.link[k] } else { 0.0 };
            for (g, &position) in positions.iter().enumerate() {
                let left = residual_at(self, self.place(axis, position, k), mode, u, f);
                let inverse_mass = 1.0 / across.mass[position] as f32;
                let before = if k == 0 || k == inner {
                    NO_CELL
                } else {
                    line[k - 1][g]
                };
                let current = &mut line[k][g];
                let excess = &mut excess[g];
                for l in 0..LANES {
                    let ratio = behind * before.inverse[l];
                    let shift = mode[l] + across.diagonal[position];
                    excess[l] = mass.mul_add(shift, ratio.mul_add(excess[l], first));
                    let pivot = ahead + excess[l];
                    current.inverse[l] = if pivot == 0.0 { 0.0 } else { 1.0 / pivot };
                    current.right[l] = ratio.mul_add(before.right[l], left[l] * inverse_mass);
                    current.border[l] = ratio.mul_add(before.border[l], first);
                }
            }
        }
    }

    /// Substitutes a group of `count` lines from the cut to the first cell; returns the masses of
    /// the lines weighted with the response to the value at the cut.
    #[inline(always)]
    fn substitute(
        &self,
        axis: usize,
        count: usize,
        line: &mut [[Cell; TOGETHER]],
    ) -> [Lanes; TOGETHER] {
        let along = &self.axes[axis];
        let n = along.len();
        let inner = along.inner();
        let mut weighted = [[0.0; LANES]; TOGETHER];
        let mut next = [NO_CELL; TOGETHER];
        for k in (0..inner).rev() {
            let ahead = if k + 1 < n { along.link[k] } else { 0.0 };
            let to_cut = if k + 1 == inner { ahead } else { 0.0 };
            for g in 0..count {
                let current = &mut line[k][g];
                let next = &mut next[g];
                for l in 0..LANES {
                    current.right[l] =
                        current.inverse[l] * ahead.mul_add(next.right[l], current.right[l]);
                    current.border[l] = current.inverse[l]
                        * ahead.mul_add(next.border[l], current.border[l] + to_cut);
                    weighted[g][l] =
                        (along.mass[k] as f32).mul_add(current.border[l], weighted[g][l]);
                }
                *next = *current;
            }
        }
        weighted
    }

    /// Solves for the cell behind the cut of line `g` of a group, which becomes its value there.
    #[inline(always)]
    fn value_at_cut(
        &self,
        axis: usize,
        mode: &Lanes,
        position: usize,
        g: usize,
        weighted: &Lanes,
        line: &mut [[Cell; TOGETHER]],
    ) -> Lanes {
        let along = &self.axes[axis];
        let across = &self.axes[1 - axis];
        let inner = along.inner();
        let wrap = along.wrap();
        let first = &line[0][g].right;
        let last = &line[inner - 1][g].right;
        let right = &line[inner][g].right;
        let mut cut = [0.0; LANES];
        for l in 0..LANES {
            let pivot =
                (mode[l] + across.diagonal[position]) * (along.mass[inner] as f32 + weighted[l]);
            let links = along.link[inner - 1].mul_add(last[l], right[l]);
            let right = wrap.mul_add(first[l], links);
            cut[l] = if pivot == 0.0 { 0.0 } else { right / pivot };
        }
        line[inner][g] = Cell {
            right: cut,
            ..NO_CELL
        };
        cut
    }
}

/// Replaces `coarse` by the transposed interpolation of the residual; `row` is as long as its rows.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn restrict(
    level: &Level,
    mode: &Lanes,
    u: &[Lanes],
    f: &[Lanes],
    coarse: &mut [Lanes],
    row: &mut [Lanes],
) {
    coarse.fill([0.0; LANES]);
    for (k, across) in level.weights[1].iter().enumerate() {
        row.fill([0.0; LANES]);
        for (j, along) in level.weights[0].iter().enumerate() {
            let left = residual_at(level, [j, k], mode, u, f);
            for &(to, weight) in along {
                add_multiple(&mut row[to], weight, &left);
            }
        }
        for &(to, weight) in across {
            for (out, value) in coarse[to * row.len()..].iter_mut().zip(&*row) {
                add_multiple(out, weight, value);
            }
        }
    }
}

/// Adds the interpolated coarse solution to `u`.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn interpolate(level: &Level, coarse: &[Lanes], u: &mut [Lanes], row: &mut [Lanes]) {
    let n = row.len();
    for (u, across) in u.chunks_mut(level.axes[0].len()).zip(&level.weights[1]) {
        row.fill([0.0; LANES]);
        for &(from, weight) in across {
            for (out, value) in row.iter_mut().zip(&coarse[from * n..]) {
                add_multiple(out, weight, value);
            }
        }
        for (u, along) in u.iter_mut().zip(&level.weights[0]) {
            for &(from, weight) in along {
                add_multiple(u, weight, &row[from]);
            }
        }
    }
}

/// `out += weight value`.
#[inline(always)]
fn add_multiple(out: &mut Lanes, weight: f32, value: &Lanes) {
    for l in 0..LANES {
        out[l] = weight.mul_add(value[l], out[l]);
    }
}

#[cfg(test)]
#[path = "v_cycle_tests.rs"]
mod tests;
