//! Direct solution along one bounded axis: `(K + s M) x = r` for many shifts `s` side by side.
//!
//! `K = Dw F^-1 Dw^T` has seven bands, and where a no-slip wall closes it an entry between cells 0 and 4 (counted from the
//! wall): the factorisation `L D L^T` fills only the fourth entry of those two columns. The factors are formed anew for each
//! line, 16 lines at a time: that costs less than reading them from memory.
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

/// Factors of one column: inverse pivot and the entries of `L`.
#[derive(Debug, Clone, Copy)]
struct Factor {
    below: [Lanes; 3],
    corner: Lanes,
}

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

    /// Replaces `rows` (one for each cell, one value for each line) by the solution, times `scale`, for the shifts
    /// `shift + shifts[line]`. For a shift of exactly zero the solution has zero weighted mean, and what is left of the
    /// right side's mean is ignored.
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
        scratch.factors.resize(
            n,
            Factor {
                below: [ZERO; 3],
                corner: ZERO,
            },
        );
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

    /// Subtracts from line `l` the multiple of `shape` that makes its sum, weighted so that `shape` is a constant, zero.
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
    left: usize,
    entry: Lanes,
    factor: Factor,
    value: Lanes,
}

/// Factorises and eliminates downwards; leaves the right side divided by the pivots.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn eliminate(columns: &[Column], shift: &Lanes, scale: f64, scratch: &mut Scratch) {
    let last = columns.len() - 1;
    // Of the three columns before, in the place of each modulo 3: entries before and after division by the pivot, and values of
    // the right side.
    let (mut u1, mut u2, mut u3) = ([ZERO; 3], [ZERO; 3], [ZERO; 3]);
    let (mut l1, mut l2, mut l3) = ([ZERO; 3], [ZERO; 3], [ZERO; 3]);
    let mut y = [ZERO; 3];
    let mut reach: Option<Reach> = None;
    for (k, column) in columns.iter().enumerate() {
        let right = &mut scratch.right[k];
        let (one, two, three) = ((k + 2) % 3, (k + 1) % 3, k % 3);
        let (mut d, mut e1, mut e2, mut e3) = (ZERO, ZERO, ZERO, ZERO);
        let mut r = ZERO;
        for l in 0..LANES {
            let a = shift[l].mul_add(column.mass, column.diagonal);
            let a = (-u3[three][l]).mul_add(l3[three][l], a);
            let a = (-u2[two][l]).mul_add(l2[two][l], a);
            d[l] = (-u1[one][l]).mul_add(l1[one][l], a);
            let b = (-u3[two][l]).mul_add(l2[two][l], column.below[0]);
            e1[l] = (-u2[one][l]).mul_add(l1[one][l], b);
            e2[l] = (-u3[one][l]).mul_add(l1[one][l], column.below[1]);
            e3[l] = column.below[2];
            let b = (-l3[three][l]).mul_add(y[three][l], right[l] * scale);
            let b = (-l2[two][l]).mul_add(y[two][l], b);
            r[l] = (-l1[one][l]).mul_add(y[one][l], b);
        }
        if let Some(reach) = &mut reach {
            reach.left -= 1;
            let into = match reach.left {
                3 => &mut e3,
                2 => &mut e2,
                1 => &mut e1,
                _ => &mut d,
            };
            let by = if reach.left == 0 {
                &reach.factor.corner
            } else {
                &reach.factor.below[3 - reach.left]
            };
            for l in 0..LANES {
                into[l] -= reach.entry[l] * by[l];
                if reach.left == 0 {
                    r[l] -= reach.factor.corner[l] * reach.value[l];
                }
            }
        }
        reach = reach.filter(|reach| reach.left > 0);
        let mut factor = Factor {
            below: [ZERO; 3],
            corner: ZERO,
        };
        for l in 0..LANES {
            // The constant is free where the shift is zero.
            let inverse = if k == last && shift[l] == 0.0 {
                0.0
            } else {
                1.0 / d[l]
            };
            factor.below[0][l] = e1[l] * inverse;
            factor.below[1][l] = e2[l] * inverse;
            factor.below[2][l] = e3[l] * inverse;
            factor.corner[l] = column.corner * inverse;
            right[l] = r[l] * inverse;
        }
        if column.corner != 0.0 {
            reach = Some(Reach {
                left: 4,
                entry: [column.corner; LANES],
                factor,
                value: r,
            });
        }
        (u1[three], u2[three], u3[three]) = (e1, e2, e3);
        [l1[three], l2[three], l3[three]] = factor.below;
        y[three] = r;
        scratch.factors[k] = factor;
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
            let b = (-factor.below[2][l]).mul_add(x[2][l], right[l]);
            let b = (-factor.below[1][l]).mul_add(x[1][l], b);
            let b = (-factor.corner[l]).mul_add(x[3][l], b);
            right[l] = (-factor.below[0][l]).mul_add(x[0][l], b);
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
        let (rest, slip) = (Wall::AT_REST, Wall::Slip);
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
