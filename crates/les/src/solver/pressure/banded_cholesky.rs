//! Direct solution along one bounded axis: `(K + s M) x = r` for many shifts `s` side by side.
//!
//! `K = Dw F^-1 Dw^T` has seven bands, and where a no-slip wall closes it an entry between cells 0
//! and 4 (counted from the wall): the factorisation `L D L^T` fills only the fourth entry of those
//! two columns. The factors are formed anew for each line, 16 lines at a time: that costs less than
//! reading them from memory.
//!
//! Check: against the dense operator; both walls' corner entries; the singular line.

use multiversion::multiversion;

use super::super::operators_1d::Operators1d;
use super::apply::stiffness;

/// Lines that are solved side by side.
const LANES: usize = 16;
type Lanes = [f64; LANES];
const ZERO: Lanes = [0.0; LANES];

/// The operator of one direction, by columns.
#[derive(Debug)]
pub(crate) struct BandedCholesky {
    columns: Vec<Column>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Column {
    diagonal: f64,
    /// Entries 1, 2 and 3 below the diagonal.
    below: [f64; 3],
    /// The entry 4 below the diagonal, which only columns at a no-slip wall have.
    corner: f64,
    mass: f64,
}

/// Entries 1 to 4 of a column of `L` below its diagonal.
type Factor = [Lanes; 4];

/// Space that a thread needs.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    factors: Vec<Factor>,
    right: Vec<Lanes>,
}

impl BandedCholesky {
    /// The operator of `line`, or `None` if it is not banded (periodic directions).
    pub(crate) fn new(line: &Operators1d) -> Option<Self> {
        let n = line.cells;
        let mut columns: Vec<Column> = line
            .cell_mass_m
            .iter()
            .map(|mass| Column {
                mass: *mass,
                ..Column::default()
            })
            .collect();
        for (i, row) in stiffness(line).iter().enumerate() {
            for &(j, c) in row.iter().filter(|tap| tap.0 <= i) {
                match i - j {
                    0 => columns[j].diagonal = c,
                    below @ 1..=3 => columns[j].below[below - 1] = c,
                    4 if j == 0 || i == n - 1 => columns[j].corner = c,
                    _ => return None,
                }
            }
        }
        Some(Self { columns })
    }

    /// Replaces `rows` (one for each cell, one value for each line) by the solution, times `scale`,
    /// for the shifts `shift + shifts[line]`. For a shift of exactly zero the solution has zero
    /// weighted mean, and what is left of the right side's mean is ignored.
    pub(crate) fn solve(
        &self,
        rows: &mut [&mut [f64]],
        shift: f64,
        shifts: &[f64],
        scale: f64,
        scratch: &mut Scratch,
    ) {
        let singular: Vec<usize> = (0..shifts.len())
            .filter(|&l| shift + shifts[l] == 0.0)
            .collect();
        for &l in &singular {
            self.remove_mean(rows, l, |column| column.mass);
        }
        let n = self.columns.len();
        scratch.factors.resize(n, [ZERO; 4]);
        scratch.right.resize(n, ZERO);
        for (shifts, start) in shifts.chunks(LANES).zip((0..).step_by(LANES)) {
            let range = start..start + shifts.len();
            // Lines that do not exist are given a harmless shift.
            let mut shift_of = [1.0; LANES];
            for (out, s) in shift_of.iter_mut().zip(shifts) {
                *out = shift + s;
            }
            for (lanes, row) in scratch.right.iter_mut().zip(rows.iter()) {
                lanes[..shifts.len()].copy_from_slice(&row[range.clone()]);
            }
            eliminate(&self.columns, &shift_of, scale, scratch);
            substitute(scratch);
            for (lanes, row) in scratch.right.iter().zip(rows.iter_mut()) {
                row[range.clone()].copy_from_slice(&lanes[..shifts.len()]);
            }
        }
        for l in singular {
            self.remove_mean(rows, l, |_| 1.0);
        }
    }

    /// Subtracts from line `l` the multiple of `shape` that makes its sum, weighted so that `shape`
    /// is a constant, zero.
    fn remove_mean(&self, rows: &mut [&mut [f64]], l: usize, shape: impl Fn(&Column) -> f64) {
        let length: f64 = self.columns.iter().map(|column| column.mass).sum();
        let weighted = rows
            .iter()
            .zip(&self.columns)
            .map(|(row, column)| row[l] * column.mass / shape(column));
        let mean = weighted.sum::<f64>() / length;
        for (row, column) in rows.iter_mut().zip(&self.columns) {
            row[l] -= mean * shape(column);
        }
    }
}

/// A column that reaches four places down, while it does.
struct Reach {
    /// Places that it still reaches down.
    remaining: usize,
    entry: Lanes,
    factor: Factor,
    value: Lanes,
}

/// A column less the columns before it.
#[derive(Clone, Copy)]
struct Reduced {
    diagonal: Lanes,
    /// Entries 1, 2 and 3 below the diagonal, before division by the pivot.
    undivided: [Lanes; 3],
    /// The same after it.
    divided: [Lanes; 3],
    /// Value of the right side.
    value: Lanes,
}

impl Reduced {
    const ZERO: Self = Self {
        diagonal: ZERO,
        undivided: [ZERO; 3],
        divided: [ZERO; 3],
        value: ZERO,
    };
}

/// Factorises and eliminates downwards; leaves the right side divided by the pivots.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn eliminate(columns: &[Column], shift: &Lanes, scale: f64, scratch: &mut Scratch) {
    let last = columns.len() - 1;
    // The last three columns, each in the place of its number modulo 3.
    let mut before = [Reduced::ZERO; 3];
    let mut reach: Option<Reach> = None;
    for (k, column) in columns.iter().enumerate() {
        let right = &mut scratch.right[k];
        let mut current = Reduced::ZERO;
        subtract_columns(&mut current, column, shift, right, scale, &before, k);
        if let Some(reach) = &mut reach {
            subtract_reach(&mut current, reach);
        }
        reach = reach.filter(|reach| reach.remaining > 0);
        let mut factor = [ZERO; 4];
        for l in 0..LANES {
            // The constant is free where the shift is zero.
            let inverse = if k == last && shift[l] == 0.0 {
                0.0
            } else {
                1.0 / current.diagonal[l]
            };
            factor[0][l] = current.undivided[0][l] * inverse;
            factor[1][l] = current.undivided[1][l] * inverse;
            factor[2][l] = current.undivided[2][l] * inverse;
            factor[3][l] = column.corner * inverse;
            right[l] = current.value[l] * inverse;
        }
        if column.corner != 0.0 {
            reach = Some(Reach {
                remaining: 4,
                entry: [column.corner; LANES],
                factor,
                value: current.value,
            });
        }
        current.divided = [factor[0], factor[1], factor[2]];
        before[k % 3] = current;
        scratch.factors[k] = factor;
    }
}

/// Column `k` less the three columns before it.
#[inline(always)]
fn subtract_columns(
    current: &mut Reduced,
    column: &Column,
    shift: &Lanes,
    right: &Lanes,
    scale: f64,
    before: &[Reduced; 3],
    k: usize,
) {
    let one = &before[(k + 2) % 3];
    let two = &before[(k + 1) % 3];
    let three = &before[k % 3];
    for l in 0..LANES {
        let a = shift[l].mul_add(column.mass, column.diagonal);
        let a = (-three.undivided[2][l]).mul_add(three.divided[2][l], a);
        let a = (-two.undivided[1][l]).mul_add(two.divided[1][l], a);
        current.diagonal[l] = (-one.undivided[0][l]).mul_add(one.divided[0][l], a);
        let b = (-two.undivided[2][l]).mul_add(two.divided[1][l], column.below[0]);
        current.undivided[0][l] = (-one.undivided[1][l]).mul_add(one.divided[0][l], b);
        current.undivided[1][l] =
            (-one.undivided[2][l]).mul_add(one.divided[0][l], column.below[1]);
        current.undivided[2][l] = column.below[2];
        let c = (-three.divided[2][l]).mul_add(three.value[l], right[l] * scale);
        let c = (-two.divided[1][l]).mul_add(two.value[l], c);
        current.value[l] = (-one.divided[0][l]).mul_add(one.value[l], c);
    }
}

/// The current column less the one that reaches down to it.
#[inline(always)]
fn subtract_reach(current: &mut Reduced, reach: &mut Reach) {
    reach.remaining -= 1;
    if reach.remaining == 0 {
        for l in 0..LANES {
            current.diagonal[l] -= reach.entry[l] * reach.factor[3][l];
            current.value[l] -= reach.factor[3][l] * reach.value[l];
        }
        return;
    }
    let entry = &mut current.undivided[reach.remaining - 1];
    let factor = &reach.factor[3 - reach.remaining];
    for l in 0..LANES {
        entry[l] -= reach.entry[l] * factor[l];
    }
}

/// Substitutes upwards.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn substitute(scratch: &mut Scratch) {
    let mut x = [ZERO; 4];
    for (factor, right) in scratch.factors.iter().zip(&mut scratch.right).rev() {
        for l in 0..LANES {
            let b = (-factor[2][l]).mul_add(x[2][l], right[l]);
            let b = (-factor[1][l]).mul_add(x[1][l], b);
            let b = (-factor[3][l]).mul_add(x[3][l], b);
            right[l] = (-factor[0][l]).mul_add(x[0][l], b);
        }
        x = [*right, x[0], x[1], x[2]];
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::mesh::{Direction, Spread, Wall};
    use super::super::apply::stiffness;
    use super::*;

    #[test]
    fn the_factors_invert_the_operator_with_walls_at_either_end() {
        let rest = Wall::AT_REST;
        let slip = Wall::Slip;
        for (n, low, high) in [
            (4, slip, slip),
            (12, rest, slip),
            (13, slip, rest),
            (16, rest, rest),
            (40, rest, rest),
        ] {
            let mapping = Spread::TanhLow.by(0.8);
            let line = Operators1d::new(
                &Direction::between(n, 0.0, n as f64, low, high).stretched(mapping),
            );
            let band = BandedCholesky::new(&line).unwrap();
            let shifts: Vec<f64> = (0..19).map(|l| 0.05 * f64::from(l)).collect();
            let mut right: Vec<Vec<f64>> = (0..n)
                .map(|k| (0..19).map(|l| ((k * 19 + l) as f64 * 0.7).sin()).collect())
                .collect();
            // The singular line, of shift zero, needs a balanced right side.
            let mean =
                right.iter().map(|row| row[0]).sum::<f64>() / line.cell_mass_m.iter().sum::<f64>();
            right
                .iter_mut()
                .zip(&line.cell_mass_m)
                .for_each(|(row, mass)| row[0] -= mean * mass);
            let mut x = right.clone();
            let mut rows: Vec<&mut [f64]> = x.iter_mut().map(Vec::as_mut_slice).collect();
            band.solve(&mut rows, 0.0, &shifts, -2.0, &mut Scratch::default());
            for (k, row) in stiffness(&line).iter().enumerate() {
                for (l, shift) in shifts.iter().enumerate() {
                    let sum: f64 = row.iter().map(|&(i, c)| c * x[i][l]).sum();
                    let left = sum + shift * line.cell_mass_m[k] * x[k][l] + 2.0 * right[k][l];
                    assert!(
                        left.abs() < 1e-11,
                        "{n} cells, cell {k}, line {l}: {left:e}"
                    );
                }
            }
            let mean: f64 = x
                .iter()
                .zip(&line.cell_mass_m)
                .map(|(x, mass)| x[0] * mass)
                .sum();
            assert!(mean.abs() < 1e-10, "{n} cells: {mean:e}");
        }
    }

    #[test]
    fn a_periodic_direction_is_not_banded() {
        assert!(
            BandedCholesky::new(&Operators1d::new(&Direction::periodic(12, 0.0, 1.0))).is_none()
        );
    }
}
