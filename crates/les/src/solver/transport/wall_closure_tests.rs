//! The closures of transport at a no-slip wall, found again from the conditions that were imposed
//! on them.
//!
//! Check: the linear systems have one solution each, and it is the tables'.

use std::collections::BTreeMap;

use super::super::mesh::{Direction, Wall};
use super::*;

/// Cells of the mesh on which the conditions are written: unit cells, the wall at 0.
const CELLS: usize = 24;

/// An entry of one of the tables: matrix, row, column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Entry {
    /// `P`: face, cell.
    Mean(usize, usize),
    /// `S^n`: flux, the smaller and the larger of two faces.
    Skew(usize, usize, usize),
    /// Extra coupling of cells by flux 3: the smaller and the larger.
    Pair(usize, usize),
}
use Entry::{Mean, Pair, Skew};

/// A number, or an unknown of coefficient 1 or -1.
#[derive(Debug, Clone, Copy)]
enum Value {
    Known(f64),
    Unknown(Entry, f64),
}
use Value::{Known, Unknown};

/// Linear equations for some entries.
struct System {
    column: BTreeMap<Entry, usize>,
    rows: Vec<Vec<f64>>,
}

impl System {
    fn new(unknown: impl IntoIterator<Item = Entry>) -> Self {
        Self {
            column: unknown
                .into_iter()
                .enumerate()
                .map(|(i, entry)| (entry, i))
                .collect(),
            rows: Vec::new(),
        }
    }

    /// Demands that the sum of factors times values be `right`.
    fn demand(&mut self, sum: impl IntoIterator<Item = (f64, Value)>, right: f64) {
        let mut row = vec![0.0; self.column.len() + 1];
        row[self.column.len()] = right;
        for (factor, value) in sum {
            match value {
                Known(value) => row[self.column.len()] -= factor * value,
                Unknown(entry, sign) => row[self.column[&entry]] += factor * sign,
            }
        }
        self.rows.push(row);
    }

    /// The only solution; there must be one, and all equations must agree with it.
    fn solve(mut self) -> BTreeMap<Entry, f64> {
        let n = self.column.len();
        for c in 0..n {
            let size = |row: &Vec<f64>| row[c].abs();
            let pivot = (c..self.rows.len())
                .max_by(|&a, &b| size(&self.rows[a]).total_cmp(&size(&self.rows[b])))
                .unwrap();
            assert!(
                size(&self.rows[pivot]) > 1e-6,
                "the conditions leave {:?} open",
                self.column.iter().find(|e| *e.1 == c)
            );
            self.rows.swap(c, pivot);
            let lead = self.rows[c].clone();
            for (_, row) in self.rows.iter_mut().enumerate().filter(|(r, _)| *r != c) {
                let factor = row[c] / lead[c];
                row.iter_mut()
                    .zip(&lead)
                    .for_each(|(value, lead)| *value -= factor * lead);
            }
        }
        for row in &self.rows[n..] {
            assert!(
                row[n].abs() < 1e-13,
                "a condition is not met by the others' solution: {:e}",
                row[n]
            );
        }
        self.column
            .iter()
            .map(|(entry, &c)| (*entry, self.rows[c][n] / self.rows[c][c]))
            .collect()
    }
}

fn wall() -> Operators1d {
    Operators1d::new(&Direction::between(
        CELLS,
        0.0,
        CELLS as f64,
        Wall::AT_REST,
        Wall::Slip,
    ))
}

/// Weighted divergence that a unit flux through `face` makes in `cell`.
fn made(line: &Operators1d, cell: usize, face: usize) -> f64 {
    line.divergence[cell]
        .iter()
        .filter(|tap| tap.0 == face)
        .map(|tap| tap.1)
        .sum()
}

/// Entries of `P` that differ from the plain mean; row 0, which is never evaluated, belongs to the
/// conditions.
const OPEN_MEANS: [(usize, &[usize]); 5] = [
    (0, &[0, 2]),
    (1, &[0, 2]),
    (2, &[0, 1, 2]),
    (3, &[0, 1, 2]),
    (4, &[2]),
];
/// Entries of `S^1` to `S^4` that differ from the interior's.
const OPEN_SKEWS: [(usize, &[(usize, usize)]); 4] = [
    (1, &[(0, 1), (1, 2), (2, 3), (3, 4)]),
    (2, &[(0, 1), (0, 4), (1, 3)]),
    (3, &[(0, 1), (0, 2), (0, 4), (1, 3), (1, 4), (2, 4), (3, 4)]),
    (4, &[(0, 1), (0, 3), (1, 4), (2, 3)]),
];

/// `P_mc`, the mean of weighted fluxes.
fn mean(face: usize, cell: usize) -> Value {
    if OPEN_MEANS
        .iter()
        .any(|(m, cells)| *m == face && cells.contains(&cell))
    {
        return Unknown(Mean(face, cell), 1.0);
    }
    Known(
        (cell + 2)
            .checked_sub(face)
            .and_then(|i| MEAN.get(i))
            .copied()
            .unwrap_or(0.0),
    )
}

/// `S^n_ab`.
fn skew(flux: usize, a: usize, b: usize) -> Value {
    if a > b {
        return match skew(flux, b, a) {
            Known(value) => Known(-value),
            Unknown(entry, sign) => Unknown(entry, -sign),
        };
    }
    if OPEN_SKEWS
        .iter()
        .any(|(n, pairs)| *n == flux && pairs.contains(&(a, b)))
    {
        return Unknown(Skew(flux, a, b), 1.0);
    }
    let products = interior_products(Stencil::PLAIN, a as isize);
    Known(
        products
            .filter(|p| (p.0, p.1) == (flux as isize, b as isize))
            .map(|p| p.2)
            .sum(),
    )
}

#[test]
fn the_conditions_on_the_normal_velocity_have_one_solution_and_it_is_the_tables() {
    let line = wall();
    let means = OPEN_MEANS
        .iter()
        .flat_map(|(m, cells)| cells.iter().map(|c| Mean(*m, *c)));
    let skews = OPEN_SKEWS
        .iter()
        .flat_map(|(n, pairs)| pairs.iter().map(|&(a, b)| Skew(*n, a, b)));
    let mut system = System::new(means.chain(skews));
    let near = 0..CELLS - 8;
    for m in 0..9 {
        // The mean of the fluxes along the wall is exact for constants and slopes.
        for power in [0, 1] {
            let flux = |c: usize| {
                (
                    line.cell_mass_m[c] * (c as f64 + 0.5).powi(power),
                    mean(m, c),
                )
            };
            system.demand(
                near.clone().map(flux),
                line.face_mass_m[m] * (m as f64).powi(power),
            );
        }
        // The rows of S^n sum to half the mean divergence that flux n makes.
        for n in 1..9 {
            let sums = near.clone().map(|l| (1.0, skew(n, m, l)));
            let divergences = near.clone().map(|c| (-0.5 * made(&line, c, n), mean(m, c)));
            system.demand(sums.chain(divergences), 0.0);
        }
        // The flux z carries the velocity z exactly: F dw/dz + w/2 dF/dz = 3/2 z.
        let products =
            (1..CELLS - 4).flat_map(|n| near.clone().map(move |l| ((n * l) as f64, skew(n, m, l))));
        system.demand(products, 1.5 * m as f64 * line.face_mass_m[m]);
    }
    for (entry, value) in system.solve() {
        let table = match entry {
            Mean(0, _) | Pair(..) => continue,
            Mean(face, cell) => WALL_MEAN[face - 1][cell],
            Skew(flux, a, b) => {
                WALL_SKEW[flux - 1]
                    .iter()
                    .find(|e| (e.0, e.1) == (a, b))
                    .unwrap()
                    .2
            }
        };
        assert!(
            (value - table).abs() < 1e-14,
            "{entry:?}: {value} by its conditions, {table} in the table"
        );
    }
}

#[test]
fn entries_of_the_tables_without_condition_are_those_of_the_interior() {
    for (n, table) in (1..).zip(WALL_SKEW) {
        for a in 0..9 {
            for b in a + 1..9 {
                let found = table
                    .iter()
                    .find(|e| (e.0, e.1) == (a, b))
                    .map_or(0.0, |e| e.2);
                if let Known(value) = skew(n, a, b) {
                    assert!(
                        (found - value).abs() < 1e-16,
                        "S^{n}, {a}, {b}: {found}, interior {value}"
                    );
                }
            }
        }
    }
    for (m, row) in (1..).zip(WALL_MEAN) {
        for (c, found) in row.into_iter().enumerate() {
            if let Known(value) = mean(m, c) {
                assert_eq!(found, value, "P, {m}, {c}");
            }
        }
    }
}

#[test]
fn the_conditions_on_velocities_along_the_wall_have_one_solution_and_it_is_the_tables() {
    let line = wall();
    let open = [(0, 1), (0, 2), (1, 2)];
    let mut system = System::new(open.map(|(a, b)| Pair(a, b)));
    let regular = |n: usize, k: usize, l: usize| -> f64 {
        let products = Stencil::PLAIN
            .products()
            .map(|(flux, value, c)| (k as isize + flux, k as isize + value, c));
        products
            .filter(|p| (p.0, p.1) == (n as isize, l as isize))
            .map(|p| p.2)
            .sum()
    };
    let coupling = |n: usize, k: usize, l: usize| {
        let extra = open.iter().any(|pair| *pair == (k.min(l), k.max(l)));
        let unknown = Unknown(Pair(k.min(l), k.max(l)), if k < l { 1.0 } else { -1.0 });
        [
            Known(regular(n, k, l)),
            if n == 3 && extra { unknown } else { Known(0.0) },
        ]
        .map(|value| (1.0, value))
    };
    let near = 0..CELLS - 8;
    for k in 0..6 {
        for n in 1..9 {
            system.demand(
                near.clone().flat_map(|l| coupling(n, k, l)),
                0.5 * made(&line, k, n),
            );
        }
        // The flux z carries the velocity z exactly.
        let products = (1..CELLS - 4).flat_map(|n| {
            near.clone().flat_map(move |l| {
                coupling(n, k, l).map(|(c, value)| (c * n as f64 * (l as f64 + 0.5), value))
            })
        });
        system.demand(products, 1.5 * (k as f64 + 0.5) * line.cell_mass_m[k]);
    }
    for (entry, value) in system.solve() {
        let table = WALL_PAIRS
            .iter()
            .find(|e| Pair(e.0, e.1) == entry)
            .unwrap()
            .2;
        assert!(
            (value - table).abs() < 1e-15,
            "{entry:?}: {value} by its conditions, {table} in the table"
        );
    }
}
