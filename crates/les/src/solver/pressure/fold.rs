//! Symmetries of eigenvectors, which halve the product with their matrix.
//!
//! Where every eigenvector is even or odd about a point, the sums and the differences of the places that mirror each other are
//! all that it sees: two products of half the size. That is so on equal cells, and the halves may have mirrors of their
//! own: 64 periodic cells take a fifth of the operations, 64 between slip planes a third.
//!
//! Check: the products against the sums over all places, with and without symmetry.

/// A square matrix of columns that are even or odd, and what is left of it.
#[derive(Debug, Default)]
pub(crate) struct Fold {
    /// Places that are replaced by their sum and their difference, one pair after the other.
    pub(crate) pairs: Vec<[usize; 2]>,
    /// First place, and for each column that is not zero there its entries at this and the following places.
    pub(crate) blocks: Vec<(usize, Vec<Vec<f64>>)>,
    /// The columns in the order of the blocks.
    pub(crate) columns: Vec<usize>,
}

/// Places from which a fold saves more than it costs.
const WORTH: usize = 16;
/// Departure from symmetry, relative to the largest entry, that is round-off; the mean of both sides has none.
const ROUND_OFF: f64 = 1e-12;

impl Fold {
    /// Folds the matrix of `n` rows, given row by row.
    pub(crate) fn new(n: usize, matrix: &[f64]) -> Self {
        let mut fold = Self::default();
        let column = |m: usize| matrix.iter().skip(m).step_by(n).copied().collect();
        fold.add(0, (0..n).map(|m| (m, column(m))).collect());
        fold
    }

    /// The matrix as it is.
    pub(crate) fn none(n: usize, matrix: &[f64]) -> Self {
        let column = |m: usize| matrix.iter().skip(m).step_by(n).copied().collect();
        Self {
            pairs: Vec::new(),
            blocks: vec![(0, (0..n).map(column).collect())],
            columns: (0..n).collect(),
        }
    }

    /// Adds a block of columns that begins at the place `start`, folded as often as it can be.
    fn add(&mut self, start: usize, columns: Vec<(usize, Vec<f64>)>) {
        let n = columns.len();
        let about = |centre: usize| move |place: usize| (centre + n - place) % n;
        let (Some(split), true) = (
            [n - 1, 0]
                .into_iter()
                .find_map(|c| halves(&columns, about(c))),
            n >= WORTH,
        ) else {
            self.columns.extend(columns.iter().map(|column| column.0));
            self.blocks
                .push((start, columns.into_iter().map(|column| column.1).collect()));
            return;
        };
        let (pairs, even, odd) = split;
        self.pairs.extend(
            pairs
                .into_iter()
                .map(|pair| pair.map(|place| start + place)),
        );
        let middle = start + even.len();
        self.add(start, even);
        self.add(middle, odd);
    }
}

type Columns = Vec<(usize, Vec<f64>)>;

/// Pairs of places, even columns and odd ones, if all are one or the other. Differences take the higher place of a pair.
fn halves(
    columns: &Columns,
    mirror: impl Fn(usize) -> usize,
) -> Option<(Vec<[usize; 2]>, Columns, Columns)> {
    let n = columns.len();
    let small = ROUND_OFF
        * columns
            .iter()
            .flat_map(|column| &column.1)
            .fold(0.0, |a: f64, b| a.max(b.abs()));
    let (mut even, mut odd) = (Columns::new(), Columns::new());
    for (m, column) in columns {
        let is = |sign: f64| (0..n).all(|i| (column[i] - sign * column[mirror(i)]).abs() <= small);
        if is(1.0) {
            even.push((
                *m,
                (0..n)
                    .filter(|&i| i <= mirror(i))
                    .map(|i| 0.5 * (column[i] + column[mirror(i)]))
                    .collect(),
            ));
        } else if is(-1.0) {
            odd.push((
                *m,
                (0..n)
                    .filter(|&i| i > mirror(i))
                    .map(|i| 0.5 * (column[mirror(i)] - column[i]))
                    .collect(),
            ));
        } else {
            return None;
        }
    }
    let is_square = |half: &Columns| half.iter().all(|column| column.1.len() == half.len());
    let pairs = (0..n)
        .map(|i| [i, mirror(i)])
        .filter(|[low, high]| low < high)
        .collect();
    (is_square(&even) && is_square(&odd)).then_some((pairs, even, odd))
}
