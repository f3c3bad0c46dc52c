//! Symmetries of eigenvectors, which halve the product with their matrix.
//!
//! Where every eigenvector is even or odd about a point, the sums and the differences of the places
//! that mirror each other suffice: two products of half the size. That is so on equal
//! cells, and the halves may have mirrors of their own: 64 periodic cells take a fifth of the
//! operations, 64 between slip planes a third.
//!
//! Check: the products against the sums over all places, with and without symmetry.

/// A square matrix of columns that are even or odd, and what is left of it.
#[derive(Debug, Default)]
pub(crate) struct Fold {
    /// Places that are replaced by their sum and their difference, one pair after the other.
    pub(crate) pairs: Vec<[usize; 2]>,
    /// First place, and for each column that is not zero there its entries at this and the
    /// following places.
    pub(crate) blocks: Vec<(usize, Vec<Vec<f64>>)>,
    /// The columns in the order of the blocks.
    pub(crate) columns: Vec<usize>,
}

/// Places from which a fold saves more than it costs.
const WORTH: usize = 16;
/// Departure from symmetry, relative to the largest entry, that is round-off; the mean of both
/// sides has none.
const ROUND_OFF: f64 = 1e-12;

impl Fold {
    /// Folds the matrix of `n` rows, given row by row.
    pub(crate) fn new(n: usize, matrix: &[f64]) -> Self {
        let columns = (0..n).map(|m| (m, column(n, matrix, m))).collect();
        let mut fold = Self::default();
        fold.add(0, columns);
        fold
    }

    /// The matrix as it is.
    pub(crate) fn none(n: usize, matrix: &[f64]) -> Self {
        let columns = (0..n).map(|m| column(n, matrix, m)).collect();
        Self {
            pairs: Vec::new(),
            blocks: vec![(0, columns)],
            columns: (0..n).collect(),
        }
    }

    /// Adds a block of columns that begins at the place `start`, folded as often as it can be: if
    /// it is large enough and all its columns are even or odd about its middle or its first place.
    fn add(&mut self, start: usize, columns: Columns) {
        let n = columns.len();
        if n >= WORTH
            && (self.add_folded(start, &columns, n - 1) || self.add_folded(start, &columns, 0))
        {
            return;
        }
        let mut entries = Vec::with_capacity(n);
        for (number, column) in columns {
            self.columns.push(number);
            entries.push(column);
        }
        self.blocks.push((start, entries));
    }

    /// Adds the two halves of a block that the mirror image `centre - place`, in the periodic
    /// sense, has: sums of the places of pairs, and the places that mirror themselves, of the even
    /// columns; differences, at the higher place of each pair, of the odd columns. Returns whether
    /// the block has them.
    fn add_folded(&mut self, start: usize, columns: &Columns, centre: usize) -> bool {
        let n = columns.len();
        let mirrored: Vec<usize> = (0..n).map(|place| (centre + n - place) % n).collect();
        let mut largest = 0.0_f64;
        for (_, column) in columns {
            largest = column
                .iter()
                .fold(largest, |most, value| most.max(value.abs()));
        }
        let mut even = Columns::new();
        let mut odd = Columns::new();
        for (number, column) in columns {
            if has_parity(column, &mirrored, 1.0, ROUND_OFF * largest) {
                let low = (0..n).filter(|&i| i <= mirrored[i]);
                let means = low.map(|i| 0.5 * (column[i] + column[mirrored[i]]));
                even.push((*number, means.collect()));
            } else if has_parity(column, &mirrored, -1.0, ROUND_OFF * largest) {
                let high = (0..n).filter(|&i| i > mirrored[i]);
                let means = high.map(|i| 0.5 * (column[mirrored[i]] - column[i]));
                odd.push((*number, means.collect()));
            } else {
                return false;
            }
        }
        if !is_square(&even) || !is_square(&odd) {
            return false;
        }
        for (low, &high) in mirrored.iter().enumerate() {
            if low < high {
                self.pairs.push([start + low, start + high]);
            }
        }
        let middle = start + even.len();
        self.add(start, even);
        self.add(middle, odd);
        true
    }
}

/// Columns with their numbers.
type Columns = Vec<(usize, Vec<f64>)>;

/// Column `m` of a matrix of `n` rows, given row by row.
fn column(n: usize, matrix: &[f64], m: usize) -> Vec<f64> {
    matrix.chunks(n).map(|row| row[m]).collect()
}

/// Whether a column is `sign` times its mirror image.
fn has_parity(column: &[f64], mirrored: &[usize], sign: f64, tolerance: f64) -> bool {
    let mut places = column.iter().zip(mirrored);
    places.all(|(value, &mirror)| (value - sign * column[mirror]).abs() <= tolerance)
}

fn is_square(columns: &Columns) -> bool {
    columns
        .iter()
        .all(|(_, column)| column.len() == columns.len())
}
