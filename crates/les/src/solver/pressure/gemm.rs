//! Products of a small dense matrix with many rows or columns of a field, in place.
//!
//! One tile of the result, 6 rows by 32 columns, stays in registers while the inner index runs over
//! its whole length; the operands are packed so that each step reads 6 and 32 neighbouring numbers.
//! The order of operations of one element never depends on the tile it falls into or on the number
//! of threads. Every multiply-add is fused, on every machine.
//!
//! Check: against the sum written out, for all remainders of the tile.

use multiversion::{multiversion, target::target_cfg_f};

use super::fold::Fold;

/// Rows of a tile.
const ROWS: usize = 6;
/// Columns of a tile.
pub(crate) const COLUMNS: usize = 32;
/// Columns of a tile where registers are few or the matrix ends.
const NARROW: usize = 8;

type TileRow = [f64; COLUMNS];
/// Six rows of a matrix, column by column.
type Group = Vec<[f64; ROWS]>;

/// A square matrix packed for products from the left, `A f`: of each of its blocks groups of 6
/// rows, column by column.
#[derive(Debug)]
pub(crate) struct PackedMatrix {
    n: usize,
    /// Rows that are replaced by their sum and their difference before the product, one pair after
    /// the other.
    before: Vec<[usize; 2]>,
    /// First row of each block on the diagonal, rows, and groups.
    blocks: Vec<(usize, usize, Vec<Group>)>,
    /// The same after it, in the opposite order.
    after: Vec<[usize; 2]>,
}

/// Space for one packed operand and for the product with it.
pub(crate) type Panels = [Vec<TileRow>; 2];

impl PackedMatrix {
    /// The transpose of a matrix with the columns in the order of `fold`.
    pub(crate) fn transpose(fold: &Fold) -> Self {
        Self {
            n: fold.columns.len(),
            before: fold.pairs.clone(),
            blocks: packed_blocks(fold, |block, i, k| block[i][k]),
            after: Vec::new(),
        }
    }

    /// A matrix with the columns in the order of `fold`.
    pub(crate) fn same(fold: &Fold) -> Self {
        Self {
            n: fold.columns.len(),
            before: Vec::new(),
            blocks: packed_blocks(fold, |block, i, k| block[k][i]),
            after: fold.pairs.clone(),
        }
    }

    /// Replaces the `n` rows `f` of equal length by `A f`.
    pub(crate) fn apply(&self, f: &mut [&mut [f64]], packed: &mut Panels) {
        let [panel, product] = resized(packed, self.n);
        for columns in panels(f) {
            load_panel(&self.before, f, columns, panel);
            self.multiply(panel, columns, product);
            store_panel(&self.after, product, f, columns);
        }
    }

    /// Replaces each row `f` of `n` values, all of which follow one another, by `A f`; of a matrix
    /// without symmetries.
    pub(crate) fn apply_to_rows(&self, f: &mut [f64], packed: &mut Panels) {
        let [panel, product] = resized(packed, self.n);
        for rows in f.chunks_mut(COLUMNS * self.n) {
            for (i, row) in rows.chunks(self.n).enumerate() {
                panel
                    .iter_mut()
                    .zip(row)
                    .for_each(|(packed, value)| packed[i] = *value);
            }
            self.multiply(panel, [0, rows.len() / self.n], product);
            for (i, row) in rows.chunks_mut(self.n).enumerate() {
                row.iter_mut()
                    .zip(&*product)
                    .for_each(|(value, packed)| *value = packed[i]);
            }
        }
    }

    /// The product with one panel.
    fn multiply(&self, panel: &[TileRow], [start, end]: [usize; 2], product: &mut [TileRow]) {
        for &(first, rows, ref groups) in &self.blocks {
            let panel = &panel[first..first + rows];
            for (group, out) in groups
                .iter()
                .zip(product[first..first + rows].chunks_mut(ROWS))
            {
                multiply(group, panel, end - start, out);
            }
        }
    }
}

/// The blocks of a fold in groups of rows, `value_at` giving the entry of a row and a column of a
/// block; the last group is filled up with zeros.
fn packed_blocks(
    fold: &Fold,
    value_at: impl Fn(&[Vec<f64>], usize, usize) -> f64,
) -> Vec<(usize, usize, Vec<Group>)> {
    let mut blocks = Vec::with_capacity(fold.blocks.len());
    for (start, block) in &fold.blocks {
        let n = block.len();
        let mut groups = Vec::with_capacity(n.div_ceil(ROWS));
        for first in (0..n).step_by(ROWS) {
            let mut group: Group = vec![[0.0; ROWS]; n];
            for (k, column) in group.iter_mut().enumerate() {
                for i in 0..ROWS.min(n - first) {
                    column[i] = value_at(block, first + i, k);
                }
            }
            groups.push(group);
        }
        blocks.push((*start, n, groups));
    }
    blocks
}

/// Two panels of `n` rows.
fn resized(packed: &mut Panels, n: usize) -> [&mut [TileRow]; 2] {
    packed.each_mut().map(|rows| {
        rows.resize(n, [0.0; COLUMNS]);
        &mut rows[..]
    })
}

/// First column of each panel of `f`, and the one after its last.
fn panels(f: &[&mut [f64]]) -> impl Iterator<Item = [usize; 2]> + use<> {
    let width = f.first().map_or(0, |row| row.len());
    (0..width)
        .step_by(COLUMNS)
        .map(move |start| [start, width.min(start + COLUMNS)])
}

/// Copies some columns of `f` and puts sums and differences of pairs of rows in their places.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn load_panel(
    pairs: &[[usize; 2]],
    f: &[&mut [f64]],
    [start, end]: [usize; 2],
    panel: &mut [TileRow],
) {
    for (row, packed) in f.iter().zip(&mut *panel) {
        copy(&row[start..end], packed);
    }
    for pair in pairs {
        sum_and_difference(*pair, panel);
    }
}

/// The other way round.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn store_panel(
    pairs: &[[usize; 2]],
    product: &mut [TileRow],
    f: &mut [&mut [f64]],
    [start, end]: [usize; 2],
) {
    for pair in pairs.iter().rev() {
        sum_and_difference(*pair, product);
    }
    for (row, packed) in f.iter_mut().zip(product) {
        paste(packed, &mut row[start..end]);
    }
}

#[inline(always)]
fn sum_and_difference(pair: [usize; 2], rows: &mut [TileRow]) {
    let Ok([low, high]) = rows.get_disjoint_mut(pair) else {
        return;
    };
    for l in 0..COLUMNS {
        (low[l], high[l]) = (low[l] + high[l], low[l] - high[l]);
    }
}

/// Copies into a row of a panel; a whole row at once where it can.
#[inline(always)]
fn copy(from: &[f64], to: &mut TileRow) {
    match <&TileRow>::try_from(from) {
        Ok(whole) => *to = *whole,
        Err(_) => to[..from.len()].copy_from_slice(from),
    }
}

/// Copies the beginning of a row of a tile; a whole row at once where it can.
#[inline(always)]
fn paste(from: &TileRow, to: &mut [f64]) {
    if let Ok(whole) = <&mut TileRow>::try_from(&mut *to) {
        *whole = *from;
    } else {
        let length = to.len();
        to.copy_from_slice(&from[..length]);
    }
}

/// The rows of `tile`, at most 6, `= a b` over the first `columns` columns (rounded up to 8).
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn multiply(a: &[[f64; ROWS]], b: &[TileRow], columns: usize, tile: &mut [TileRow]) {
    if target_cfg_f!(target_feature = "avx512f") && columns > COLUMNS - NARROW {
        multiply_part::<COLUMNS>(a, b, 0, tile);
    } else {
        for first in (0..columns).step_by(NARROW) {
            multiply_part::<NARROW>(a, b, first, tile);
        }
    }
}

/// The columns `first` to `first + WIDTH` of a tile.
#[inline(always)]
fn multiply_part<const WIDTH: usize>(
    a: &[[f64; ROWS]],
    b: &[TileRow],
    first: usize,
    tile: &mut [TileRow],
) {
    let mut sum = [[0.0_f64; WIDTH]; ROWS];
    for (a, b) in a.iter().zip(b) {
        let b = &b[first..first + WIDTH];
        for i in 0..ROWS {
            for l in 0..WIDTH {
                sum[i][l] = a[i].mul_add(b[l], sum[i][l]);
            }
        }
    }
    for (row, sum) in tile.iter_mut().zip(&sum) {
        row[first..first + WIDTH].copy_from_slice(sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(i: usize, j: usize) -> f64 {
        ((i * 7 + j * 13) % 11) as f64 - 4.5 + 0.1 * i as f64
    }

    #[test]
    fn products_from_both_sides_equal_the_sum_written_out() {
        for (n, width) in [(1, 1), (4, 3), (6, 32), (13, 41), (37, 64), (65, 8)] {
            let f: Vec<f64> = (0..n * width).map(|i| (i as f64 * 0.37).sin()).collect();
            let mut left = f.clone();
            let mut rows: Vec<&mut [f64]> = left.chunks_mut(width).collect();
            let matrix: Vec<f64> = (0..n * n).map(|p| entry(p / n, p % n)).collect();
            PackedMatrix::same(&Fold::new(n, &matrix)).apply(&mut rows, &mut Panels::default());
            let mut right = f.clone();
            PackedMatrix::transpose(&Fold::none(n, &matrix))
                .apply_to_rows(&mut right, &mut Panels::default());
            for r in 0..n {
                for c in 0..width {
                    let sum: f64 = (0..n).map(|k| entry(r, k) * f[k * width + c]).sum();
                    assert!(
                        (left[r * width + c] - sum).abs() < 1e-11,
                        "{n} {width} left ({r}, {c})"
                    );
                }
            }
            for r in 0..width {
                for c in 0..n {
                    let sum: f64 = (0..n).map(|k| f[r * n + k] * entry(k, c)).sum();
                    assert!(
                        (right[r * n + c] - sum).abs() < 1e-11,
                        "{n} {width} right ({r}, {c})"
                    );
                }
            }
        }
    }
}
