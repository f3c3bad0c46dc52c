//! The operators of one direction: masses, weighted divergence, and what follows from them.
//!
//! Fourth order in the index coordinate (Vasilyev 2000), closed at no-slip walls by a
//! summation-by-parts pair: with the masses `m` of the cells and `f` of the faces and the weighted
//! divergence `Dw`, the divergence is `m^-1 Dw` and the gradient `-f^-1 Dw^T`, so that the pressure
//! does no work on a divergence-free flow and every Laplacian is symmetric. `Dw` is exact for
//! parabolas in the three cells at a wall. At slip walls the field is continued by its mirror
//! image.
//!
//! Faces are counted from 0 to `n`; a bounded direction stores faces 0 to `n - 1` (face 0 is the
//! wall, where the normal velocity is zero, and so is face `n`).
//!
//! Check: column sums, adjointness, exactness for polynomials, order on stretched meshes.

use super::mesh::{Direction, Ends};

/// One weighted sum: indices and coefficients.
pub(crate) type Taps = Vec<(usize, f64)>;

/// Largest symbol of the Laplacian times the square of the spacing.
pub(crate) const LAPLACIAN_SYMBOL: f64 = 49.0 / 9.0;
/// Weighted divergence of the first three cells at a no-slip wall over the faces 0 to 4.
const WALL_DIVERGENCE: [[f64; 5]; 3] = [
    [-79.0 / 72.0, 9.0 / 8.0, -1.0 / 24.0, 1.0 / 72.0, 0.0],
    [1.0 / 12.0, -9.0 / 8.0, 9.0 / 8.0, -1.0 / 12.0, 0.0],
    [1.0 / 72.0, 0.0, -9.0 / 8.0, 83.0 / 72.0, -1.0 / 24.0],
];
/// Weights of the first three cells at a no-slip wall.
const WALL_CELL_WEIGHT: [f64; 3] = [13.0 / 12.0, 7.0 / 8.0, 25.0 / 24.0];
/// Weights of the faces 0 to 3 at a no-slip wall.
const WALL_FACE_WEIGHT: [f64; 4] = [7.0 / 18.0, 9.0 / 8.0, 1.0, 71.0 / 72.0];
/// The staggered difference of fourth order over the faces `k - 1` to `k + 2` of cell `k`.
pub(crate) const DIFFERENCE: [f64; 4] = [1.0 / 24.0, -9.0 / 8.0, 9.0 / 8.0, -1.0 / 24.0];

/// One direction of the mesh with its operators.
#[derive(Debug, Clone)]
pub(crate) struct Operators1d {
    /// Number of cells, and of stored faces.
    pub(crate) cells: usize,
    /// What lies at the two ends.
    pub(crate) ends: Ends,
    /// Metric `dx/dxi` at the centres \[m\].
    pub(crate) cell_metric_m: Vec<f64>,
    /// Metric at the faces 0 to `n` \[m\].
    pub(crate) face_metric_m: Vec<f64>,
    /// Mass of each cell, weight times metric \[m\].
    pub(crate) cell_mass_m: Vec<f64>,
    /// Mass of each face 0 to `n` \[m\]; in a periodic direction face `n` is face 0.
    pub(crate) face_mass_m: Vec<f64>,
    /// Weighted divergence: for each cell the faces (0 to `n` in a bounded direction) and their
    /// coefficients.
    pub(crate) divergence: Vec<Taps>,
}

impl Operators1d {
    pub(crate) fn new(direction: &Direction) -> Self {
        let n = direction.cells;
        let cell_metric_m: Vec<f64> = (0..n).map(|k| direction.at(k as f64 + 0.5).1).collect();
        let face_metric_m: Vec<f64> = (0..=n).map(|k| direction.at(k as f64).1).collect();
        let mut cell_mass_m = cell_metric_m.clone();
        let mut face_mass_m = face_metric_m.clone();
        let sticks = direction.ends.no_slip();
        for (side, sticks) in sticks.into_iter().enumerate() {
            let is_low = side == 0;
            if sticks {
                for (i, weight) in WALL_CELL_WEIGHT.iter().enumerate() {
                    cell_mass_m[if is_low { i } else { n - 1 - i }] *= weight;
                }
                for (i, weight) in WALL_FACE_WEIGHT.iter().enumerate() {
                    face_mass_m[if is_low { i } else { n - i }] *= weight;
                }
            } else if direction.ends != Ends::Periodic {
                face_mass_m[if is_low { 0 } else { n }] *= 0.5;
            }
        }
        let divergence = (0..n)
            .map(|k| divergence_row(n, direction.ends, sticks, k))
            .collect();
        Self {
            cells: n,
            ends: direction.ends,
            cell_metric_m,
            face_metric_m,
            cell_mass_m,
            face_mass_m,
            divergence,
        }
    }

    /// Whether the flow cannot vary in this direction.
    pub(crate) fn is_thin(&self) -> bool {
        self.cells == 1
    }

    pub(crate) fn is_periodic(&self) -> bool {
        self.ends == Ends::Periodic
    }

    /// Whether all cells are equal and the direction periodic: what a Fourier transform needs.
    pub(crate) fn is_fourier(&self) -> bool {
        self.is_periodic()
            && self
                .cell_metric_m
                .iter()
                .all(|h| *h == self.cell_metric_m[0])
    }

    /// First stored face that carries a velocity: face 0 of a bounded direction is a wall.
    pub(crate) fn first_face(&self) -> usize {
        usize::from(!self.is_periodic())
    }

    /// The weighted divergence over the stored faces that carry a velocity.
    pub(crate) fn stored_divergence(&self) -> Vec<Taps> {
        let mut rows = self.divergence.clone();
        if !self.is_periodic() {
            for row in &mut rows {
                row.retain(|&(face, _)| face > 0 && face < self.cells);
            }
        }
        rows
    }

    /// Transposed rows of the weighted divergence: for each face 0 to `n` the cells and their
    /// coefficients.
    pub(crate) fn adjoint(&self) -> Vec<Taps> {
        let mut rows = vec![Taps::new(); self.cells + 1];
        for (cell, row) in self.divergence.iter().enumerate() {
            for &(face, coefficient) in row {
                rows[face].push((cell, coefficient));
            }
        }
        rows
    }

    /// Rows of the gradient `-f^-1 Dw^T` of a field at the centres, for the stored faces; empty at
    /// a wall.
    pub(crate) fn gradient(&self) -> Vec<Taps> {
        let mut rows = self.adjoint();
        rows.truncate(self.cells);
        for (face, row) in rows.iter_mut().enumerate() {
            if face < self.first_face() {
                row.clear();
            }
            for tap in row.iter_mut() {
                tap.1 /= -self.face_mass_m[face];
            }
        }
        rows
    }

    /// Laplacian of a field at the centres that sticks to the no-slip walls: rows over the cells,
    /// and for each row the coefficients of the velocities of the low and of the high wall.
    pub(crate) fn laplacian_at_cells(&self) -> (Vec<Taps>, Vec<[f64; 2]>) {
        let mut faces = self.divergence.clone();
        for (row, mass) in faces.iter_mut().zip(&self.cell_mass_m) {
            for (face, c) in row {
                *c /= mass * self.face_mass_m[*face];
            }
        }
        self.sums_of_gradients(&faces)
    }

    /// Half the mean of the gradients at the two faces of each cell of such a field, in the same
    /// form. At a slip wall the gradient of what flows along it is zero.
    pub(crate) fn half_mean_gradient(&self) -> (Vec<Taps>, Vec<[f64; 2]>) {
        let mut faces = Vec::with_capacity(self.cells);
        for cell in 0..self.cells {
            let high = if self.is_periodic() {
                (cell + 1) % self.cells
            } else {
                cell + 1
            };
            faces.push(vec![
                (cell, 0.25 / self.face_mass_m[cell]),
                (high, 0.25 / self.face_mass_m[high]),
            ]);
        }
        self.sums_of_gradients(&faces)
    }

    /// For each cell the sum of factors times the weighted gradients at faces: rows over the
    /// cells, and the coefficients of the velocities of the two walls.
    fn sums_of_gradients(&self, faces_of_cells: &[Taps]) -> (Vec<Taps>, Vec<[f64; 2]>) {
        let adjoint = self.adjoint();
        let sticks = self.ends.no_slip();
        let last = self.cells;
        let mut rows = Vec::with_capacity(self.cells);
        let mut wall_coefficients = Vec::with_capacity(self.cells);
        for faces in faces_of_cells {
            let mut sums = vec![0.0; self.cells];
            let mut walls = [0.0; 2];
            for &(face, factor) in faces {
                let side = usize::from(face == last);
                let at_wall = !self.is_periodic() && (face == 0 || face == last);
                if at_wall && !sticks[side] {
                    continue;
                }
                for &(other, weight) in &adjoint[face] {
                    sums[other] -= factor * weight;
                }
                if at_wall {
                    // The gradient at the wall has the wall's velocity with weight -1 at the low
                    // and +1 at the high end.
                    walls[side] += factor * if side == 0 { -1.0 } else { 1.0 };
                }
            }
            rows.push(nonzero(&sums));
            wall_coefficients.push(walls);
        }
        (rows, wall_coefficients)
    }

    /// Laplacian of the normal velocity at the stored faces, zero at the walls.
    pub(crate) fn laplacian_at_faces(&self) -> Vec<Taps> {
        let divergence = self.stored_divergence();
        let adjoint = self.adjoint();
        let mut rows = vec![Taps::new(); self.cells];
        for (face, row) in rows.iter_mut().enumerate().skip(self.first_face()) {
            let mut sums = vec![0.0; self.cells];
            for &(cell, coefficient) in &adjoint[face] {
                let factor = coefficient / (self.cell_mass_m[cell] * self.face_mass_m[face]);
                for &(other, weight) in &divergence[cell] {
                    sums[other] -= factor * weight;
                }
            }
            *row = nonzero(&sums);
        }
        rows
    }
}

/// The entries of a dense row that are not zero.
pub(crate) fn nonzero(sums: &[f64]) -> Taps {
    let mut taps = Taps::new();
    for (i, &c) in sums.iter().enumerate() {
        if c != 0.0 {
            taps.push((i, c));
        }
    }
    taps
}

/// One row of the weighted divergence.
fn divergence_row(n: usize, ends: Ends, sticks: [bool; 2], k: usize) -> Taps {
    if n == 1 {
        return Taps::new();
    }
    if sticks[0] && k < 3 {
        return (0..5)
            .map(|f| (f, WALL_DIVERGENCE[k][f]))
            .filter(|tap| tap.1 != 0.0)
            .collect();
    }
    if sticks[1] && k + 3 >= n {
        let row = WALL_DIVERGENCE[n - 1 - k];
        return (0..5)
            .map(|f| (n - f, -row[f]))
            .filter(|tap| tap.1 != 0.0)
            .collect();
    }
    let mut row = vec![0.0; n + 1];
    for (offset, coefficient) in DIFFERENCE.iter().enumerate() {
        let face = (k + offset) as isize - 1;
        let (face, sign) = resolve_face(n, ends, face);
        row[face] += sign * coefficient;
    }
    nonzero(&row)
}

/// The stored face whose normal velocity, times the sign, is that of face `index` beyond the ends.
pub(crate) fn resolve_face(n: usize, ends: Ends, index: isize) -> (usize, f64) {
    let last = n as isize;
    if ends == Ends::Periodic {
        (index.rem_euclid(last) as usize, 1.0)
    } else if index < 0 {
        (-index as usize, -1.0)
    } else if index > last {
        ((2 * last - index) as usize, -1.0)
    } else {
        (index as usize, 1.0)
    }
}

/// The cell of which cell `index` beyond the ends is a copy or the mirror image.
pub(crate) fn resolve_cell(n: usize, ends: Ends, index: isize) -> usize {
    let count = n as isize;
    if ends == Ends::Periodic {
        index.rem_euclid(count) as usize
    } else if index < 0 {
        (-1 - index) as usize
    } else if index >= count {
        (2 * count - 1 - index) as usize
    } else {
        index as usize
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::{Mapping, Spread, Wall};
    use super::*;

    fn apply(rows: &[Taps], x: &[f64]) -> Vec<f64> {
        rows.iter()
            .map(|row| row.iter().map(|&(i, c)| c * x[i]).sum())
            .collect()
    }

    fn walls(n: usize) -> Direction {
        Direction::between(n, 0.0, 2.0, Wall::AT_REST, Wall::AT_REST)
    }

    fn every_kind() -> Vec<Direction> {
        let tanh = Spread::TanhBoth.by(2.0);
        vec![
            Direction::periodic(24, 0.0, 2.0).stretched(Spread::Sine.by(0.5)),
            walls(24),
            walls(25).stretched(tanh.clone()),
            Direction::between(24, 0.0, 2.0, Wall::Slip, Wall::Slip).stretched(tanh),
            Direction::between(24, 0.0, 2.0, Wall::AT_REST, Wall::Slip)
                .stretched(Spread::TanhLow.by(1.5)),
        ]
    }

    #[test]
    fn the_weighted_divergence_lets_no_flux_appear_inside() {
        for direction in every_kind() {
            let line = Operators1d::new(&direction);
            let columns = line.adjoint();
            let inner = if line.is_periodic() {
                0..line.cells
            } else {
                1..line.cells
            };
            for face in inner {
                let sum: f64 = columns[face].iter().map(|tap| tap.1).sum();
                assert!(
                    sum.abs() < 2e-16,
                    "{direction:?}: column {face} sums to {sum}"
                );
            }
        }
    }

    #[test]
    fn divergence_and_gradient_are_exact_for_parabolas_at_a_wall() {
        let line = Operators1d::new(&walls(24));
        let h = 2.0 / 24.0;
        let face: Vec<f64> = (0..=24).map(|i| h * f64::from(i)).collect();
        let square: Vec<f64> = face.iter().map(|z| z * z).collect();
        for (k, value) in apply(&line.divergence, &square).iter().enumerate() {
            let expected = 2.0 * h * (k as f64 + 0.5);
            assert!(
                (value / line.cell_mass_m[k] - expected).abs() < 1e-13,
                "cell {k}"
            );
        }
        let centre: Vec<f64> = (0..24)
            .map(|k| (h * (f64::from(k) + 0.5)).powi(2))
            .collect();
        for (n, value) in apply(&line.gradient(), &centre).iter().enumerate().skip(1) {
            assert!((value - 2.0 * face[n]).abs() < 1e-12, "face {n}: {value}");
        }
        let (rows, wall) = line.laplacian_at_cells();
        for (k, value) in apply(&rows, &centre).iter().enumerate() {
            let value = value + wall[k][1] * 4.0;
            assert!((value - 2.0).abs() < 1e-11, "cell {k}: {value}");
        }
    }

    #[test]
    fn laplacians_are_symmetric_and_dissipate() {
        for direction in every_kind() {
            let line = Operators1d::new(&direction);
            let n = line.cells;
            for (rows, mass) in [
                (line.laplacian_at_cells().0, &line.cell_mass_m),
                (line.laplacian_at_faces(), &line.face_mass_m),
            ] {
                let mut dense = vec![vec![0.0; n]; n];
                for (i, row) in rows.iter().enumerate() {
                    for &(j, c) in row {
                        dense[i][j] = c * mass[i];
                    }
                }
                let scale = dense[n / 2][n / 2].abs();
                for i in 0..n {
                    for j in 0..n {
                        assert!(
                            (dense[i][j] - dense[j][i]).abs() < 1e-14 * scale,
                            "{direction:?} ({i}, {j})"
                        );
                    }
                }
                let x: Vec<f64> = (0..n).map(|i| ((i * i) as f64 * 0.7).sin()).collect();
                let work: f64 = (0..n)
                    .map(|i| (0..n).map(|j| x[i] * dense[i][j] * x[j]).sum::<f64>())
                    .sum();
                assert!(work < 0.0, "{direction:?}");
            }
        }
    }

    /// Largest errors of the Laplacians of `cos` at the centres and `sin` at the faces, interior
    /// and all.
    fn errors(direction: &Direction) -> [f64; 2] {
        let line = Operators1d::new(direction);
        let wave = std::f64::consts::PI;
        let centre: Vec<f64> = (0..line.cells)
            .map(|k| direction.at(k as f64 + 0.5).0)
            .collect();
        let face: Vec<f64> = (0..line.cells).map(|k| direction.at(k as f64).0).collect();
        let worst = |rows: Vec<Taps>, x: &[f64], f: fn(f64) -> f64| {
            let values = apply(&rows, &x.iter().map(|x| f(wave * x)).collect::<Vec<_>>());
            let errors = values
                .iter()
                .zip(x)
                .map(|(value, x)| (value + wave * wave * f(wave * x)).abs());
            errors.skip(8).take(line.cells - 16).fold(0.0, f64::max)
        };
        [
            worst(line.laplacian_at_cells().0, &centre, f64::cos),
            worst(line.laplacian_at_faces(), &face, f64::sin),
        ]
    }

    #[test]
    fn laplacians_are_of_fourth_order_on_stretched_meshes() {
        let sine = Spread::Sine.by(0.5);
        let tanh = Spread::TanhBoth.by(1.5);
        let cluster = Mapping {
            place: 0.3,
            ..Spread::Cluster.by(0.7)
        };
        for make in [
            |n, m| Direction::periodic(n, 0.0, 2.0).stretched(m),
            |n, m| Direction::between(n, 0.0, 2.0, Wall::Slip, Wall::Slip).stretched(m),
        ] {
            for mapping in [sine.clone(), tanh.clone(), cluster.clone()] {
                let periodic = make(8, Mapping::default()).ends == Ends::Periodic;
                let fits = match mapping.spread {
                    Spread::TanhBoth => !periodic,
                    Spread::Cluster => periodic,
                    _ => true,
                };
                if !fits {
                    continue;
                }
                let coarse = errors(&make(128, mapping.clone()));
                let fine = errors(&make(256, mapping.clone()));
                for (coarse, fine) in coarse.iter().zip(fine) {
                    let order = (coarse / fine).log2();
                    assert!(order > 3.8, "{mapping:?}: order {order}");
                }
            }
        }
    }
}
