//! Convection along one direction, in skew-symmetric form: it makes no energy, and no momentum
//! where the flow is divergence-free, stretched meshes and walls included.
//!
//! The weighted convection of `q` by the fluxes `F_n` through the faces `n` is `sum_n F_n S^n q`
//! with skew matrices `S^n`. With `d^n` the weighted divergence that a unit flux through face `n`
//! makes at the points of `q`, the rows satisfy `S^n 1 = d^n/2`: then the divergence form
//! `S^n + diag(d^n)/2` and this one agree for divergence-free fluxes, constants are convected
//! exactly, and energy is conserved whatever the divergence. Inside the flow this is the scheme of
//! Vasilyev (2000).
//!
//! - `q` at the centres (velocities along the wall): pairs `(n-1, n)` with 9/16 and `(n-2, n+1)`
//!   with -1/48.
//! - `q` at the faces (velocity normal to the wall): pairs of faces about each cell, times the
//!   fourth-order mean of the flux.
//!
//! These pairs carry waves of four cells a quarter too slowly. Any skew matrix whose row sums
//! vanish may be added to `S^n` without touching energy or momentum; on the four cells about a face
//! there is one that keeps the order, and its weight is chosen such that a uniform flux carries
//! waves with the error of the sixth-order central difference. It is left out along all directions
//! if one of them has a no-slip wall, whose closure belongs to the pairs: a vortex that turns is to
//! meet the same errors in all directions.
//!
//! Check: the tables are the solution of their conditions (`wall_closure_tests`); skewness, row
//! sums, speed of waves, exactness for parabolas, mirror symmetry of the two walls.

// The tables are written as they were derived, with all digits.
#![allow(clippy::excessive_precision)]

use super::operators_1d::{Operators1d, Taps, resolve_cell, resolve_face};

/// Weights of the pairs at distance 1 and 3 that Vasilyev's scheme has.
pub(crate) const PAIR: [f64; 2] = [9.0 / 16.0, -1.0 / 48.0];
/// Share of the skew matrix of vanishing row sums, `s t^T - t s^T` with the second differences `s`
/// and `t` of the cells before and after the face, that makes the transport by a uniform flux one
/// of sixth order.
const SIXTH: f64 = 3.0 / 80.0;
/// Fourth-order mean of four neighbours.
pub(crate) const MEAN: [f64; 4] = [-1.0 / 16.0, 9.0 / 16.0, 9.0 / 16.0, -1.0 / 16.0];

/// One product of a flux and a value: face of the flux, index of the value, coefficient.
pub(crate) type Product = (usize, usize, f64);

/// Transport of the values of one kind along one direction.
#[derive(Debug, Clone)]
pub(crate) struct Transport {
    /// For each row the products; rows inside `regular` may be computed by the formula of the
    /// interior.
    pub(crate) rows: Vec<Vec<Product>>,
    /// Rows to which the interior's formula applies within the stored values, without wrapping or
    /// mirroring.
    pub(crate) regular: std::ops::Range<usize>,
    /// The interior's formula.
    pub(crate) stencil: Stencil,
}

/// Coefficients of the interior for the point 0: the fluxes at -1, 0, 1, 2 (the point lies between
/// those at 0 and 1) with the values at -3 to 3. The fluxes at 0 and -1 have the mirrored
/// coefficients with the other sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stencil {
    /// Flux at 1 with the values at -1, 1, 2.
    pub(crate) near: [f64; 3],
    /// Flux at 2 with the values at 1, 2, 3.
    pub(crate) far: [f64; 3],
}

impl Stencil {
    /// Pairs alone.
    pub(crate) const PLAIN: Self = Self::with_sixth_order(0.0);
    /// Sixth order in a uniform flux.
    pub(crate) const WIDE: Self = Self::with_sixth_order(SIXTH);

    /// The stencil of a mesh with these directions.
    pub(crate) fn for_lines(lines: &[Operators1d]) -> Self {
        if lines.iter().all(|line| line.ends.no_slip() == [false; 2]) {
            Self::WIDE
        } else {
            Self::PLAIN
        }
    }

    const fn with_sixth_order(weight: f64) -> Self {
        Self {
            near: [-weight, PAIR[0] + 3.0 * weight, -2.0 * weight],
            far: [weight, -2.0 * weight, PAIR[1] + weight],
        }
    }

    /// Whether only the pairs are there.
    #[inline(always)]
    pub(crate) fn is_plain(&self) -> bool {
        self.near[0] == 0.0
    }

    /// Places of flux and value, and the coefficient.
    fn products(self) -> impl Iterator<Item = (isize, isize, f64)> {
        let [near, far] = [self.near, self.far];
        let near = [-1, 1, 2]
            .into_iter()
            .zip(near)
            .map(|(value, c)| (1, value, c));
        let far = [1, 2, 3]
            .into_iter()
            .zip(far)
            .map(|(value, c)| (2, value, c));
        near.chain(far)
            .filter(|p| p.2 != 0.0)
            .flat_map(|(flux, value, c)| [(flux, value, c), (1 - flux, -value, -c)])
    }
}

/// Rows of the normal velocity that a no-slip wall changes.
const WALL_ROWS: usize = 7;

/// An entry of a skew matrix: row, column, value.
type SkewEntry = (usize, usize, f64);

/// Extra products of flux 3 on the cells 0, 1, 2 at a no-slip wall (the upper triangle; the lower
/// is its negative).
const WALL_PAIRS: [SkewEntry; 3] = [(0, 1, -1.0 / 48.0), (0, 2, 1.0 / 36.0), (1, 2, -1.0 / 24.0)];

/// Mean of the weighted fluxes along the wall at the faces 1 to 4: coefficients of the cells 0
/// to 5.
#[rustfmt::skip]
const WALL_MEAN: [[f64; 6]; 4] = [
    [0.551_682_692_307_692_4, 0.5625, 0.03375, 0.0, 0.0, 0.0],
    [-0.029_446_363_690_511_63, 0.572_914_805_328_885_95, 0.569_375_781_761_867_87, -0.0625, 0.0, 0.0],
    [0.003_805_338_049_485_998_3, -0.072_914_805_328_885_959, 0.523_957_551_571_465_51, 0.5625, -0.0625, 0.0],
    [0.0, 0.0, -0.06, 0.5625, 0.5625, -0.0625],
];

/// Upper triangles of `S^1` to `S^4` at a no-slip wall for the normal velocity at the faces.
#[rustfmt::skip]
const WALL_SKEW: [&[SkewEntry]; 4] = [
    &[(0, 1, 0.313_476_562_5), (0, 3, -3.0 / 256.0), (1, 2, 0.306_089_743_589_743_56), (1, 4, 1.0 / 768.0),
      (2, 3, -0.032_738_413_983_667_558), (3, 4, -1.0 / 768.0)],
    &[(0, 1, 0.003_016_493_055_555_5), (0, 3, -3.0 / 256.0), (0, 4, 0.001_406_25), (1, 2, 81.0 / 256.0),
      (1, 3, -0.015_742_521_367_521_349), (1, 4, -3.0 / 256.0), (2, 3, 81.0 / 256.0), (2, 5, 1.0 / 768.0), (3, 4, -9.0 / 256.0)],
    &[(0, 1, -0.017_989_444_357_422_977), (0, 2, -0.001_607_413_324_976_628_8), (0, 3, 1.0 / 768.0),
      (0, 4, -0.014_475_769_632_415_305), (1, 2, -9.0 / 256.0), (1, 3, 0.007_399_861_459_197_113_7),
      (1, 4, 0.009_613_698_991_072_231_6), (2, 3, 81.0 / 256.0), (2, 4, -0.002_188_977_973_787_721_8), (2, 5, -3.0 / 256.0),
      (3, 4, 0.311_165_631_948_464_08), (3, 6, 1.0 / 768.0), (4, 5, -9.0 / 256.0)],
    &[(0, 1, 0.002_057_291_666_666_669_5), (0, 3, -0.000_659_722_222_222_22), (1, 4, 0.001_354_166_666_666_666_7),
      (2, 3, -0.035_299_495_453_372_25), (2, 5, -3.0 / 256.0), (3, 4, 81.0 / 256.0), (3, 6, -3.0 / 256.0), (4, 5, 81.0 / 256.0),
      (4, 7, 1.0 / 768.0), (5, 6, -9.0 / 256.0)],
];

impl Operators1d {
    /// Mean of the weighted fluxes along a wall at the stored faces: cells and coefficients, the
    /// masses of the cells included. The rows of wall faces are empty.
    pub(crate) fn flux_mean(&self) -> Vec<Taps> {
        let n = self.cells;
        let sticks = self.ends.no_slip();
        (0..n)
            .map(|face| {
                let mut sums = vec![0.0; n];
                if self.is_thin() {
                    sums[0] = 1.0;
                } else if face < self.first_face() {
                    return Taps::new();
                } else if sticks[0] && face <= 4 {
                    sums[..6].copy_from_slice(&WALL_MEAN[face - 1]);
                } else if sticks[1] && face + 4 >= n {
                    for (i, c) in WALL_MEAN[n - face - 1].iter().enumerate() {
                        sums[n - 1 - i] += c;
                    }
                } else {
                    for (i, c) in MEAN.iter().enumerate() {
                        sums[resolve_cell(n, self.ends, (face + i) as isize - 2)] += c;
                    }
                }
                let weighted = sums.iter().zip(&self.cell_mass_m).enumerate();
                weighted
                    .filter(|(_, (c, _))| **c != 0.0)
                    .map(|(i, (c, mass))| (i, c * mass))
                    .collect()
            })
            .collect()
    }

    /// Transport of values at the centres by the fluxes through the faces; pairs alone at a no-slip
    /// wall.
    pub(crate) fn transport_of_cells(&self, stencil: Stencil) -> Transport {
        let n = self.cells;
        let mut rows = vec![Vec::new(); n];
        if self.is_thin() {
            return Transport {
                rows,
                regular: 0..0,
                stencil,
            };
        }
        let sticks = self.ends.no_slip();
        for (k, row) in rows.iter_mut().enumerate() {
            for (face, cell, c) in stencil.products() {
                let face = k as isize + face;
                let cell = k as isize + cell;
                // No ghosts behind a no-slip wall.
                if (sticks[0] && cell < 0) || (sticks[1] && cell >= n as isize) {
                    continue;
                }
                let (face, sign) = resolve_face(n, self.ends, face);
                if self.is_periodic() || (face > 0 && face < n) {
                    row.push((face, resolve_cell(n, self.ends, cell), sign * c));
                }
            }
        }
        for entry in WALL_PAIRS {
            add_closure(&mut rows, sticks, [n, n - 1], 3, entry);
        }
        Transport {
            rows,
            regular: 3..n.saturating_sub(3),
            stencil,
        }
    }

    /// Transport of the normal velocity at the faces by itself; pairs alone at a no-slip wall.
    pub(crate) fn transport_of_faces(&self, stencil: Stencil) -> Transport {
        let n = self.cells;
        let mut rows = vec![Vec::new(); n];
        if self.is_thin() {
            return Transport {
                rows,
                regular: 0..0,
                stencil,
            };
        }
        let sticks = self.ends.no_slip();
        for (m, row) in rows.iter_mut().enumerate().skip(self.first_face()) {
            for (face, value, c) in interior_products(stencil, m as isize) {
                let (face, face_sign) = resolve_face(n, self.ends, face);
                let (value, value_sign) = resolve_face(n, self.ends, value);
                let walls =
                    !self.is_periodic() && (face == 0 || face == n || value == 0 || value == n);
                let from_table = (sticks[0] && face <= 4) || (sticks[1] && face + 4 >= n);
                if !walls && !from_table {
                    row.push((face, value, face_sign * value_sign * c));
                }
            }
        }
        for (i, table) in WALL_SKEW.iter().enumerate() {
            for entry in table.iter().filter(|entry| entry.0 > 0) {
                add_closure(&mut rows, sticks, [n, n], i + 1, *entry);
            }
        }
        let [low, high] = sticks.map(|sticks| if sticks { WALL_ROWS + 1 } else { 3 });
        Transport {
            rows,
            regular: low..n.saturating_sub(high),
            stencil,
        }
    }
}

/// Adds the skew entry `(a, b, c)` of the flux through `face` at each end that sticks, places
/// counted from there; the last face and the last place of a value are `last`.
fn add_closure(
    rows: &mut [Vec<Product>],
    sticks: [bool; 2],
    last: [usize; 2],
    face: usize,
    (a, b, c): SkewEntry,
) {
    if sticks[0] {
        rows[a].push((face, b, c));
        rows[b].push((face, a, -c));
    }
    if sticks[1] {
        let [face, a, b] = [last[0] - face, last[1] - a, last[1] - b];
        rows[a].push((face, b, -c));
        rows[b].push((face, a, c));
    }
}

/// Products of row `m` of the normal velocity away from walls: pairs of faces times the mean flux
/// of the cell between.
fn interior_products(stencil: Stencil, m: isize) -> impl Iterator<Item = (isize, isize, f64)> {
    stencil.products().flat_map(move |(flux, value, c)| {
        // The flux at 1 is that of the cell between the faces m and m + 1.
        let cell = m + flux - 1;
        MEAN.iter()
            .enumerate()
            .map(move |(i, mean)| (cell + i as isize - 1, m + value, c * mean))
    })
}

#[cfg(test)]
mod wall_closure_tests;

#[cfg(test)]
mod tests {
    use super::super::mesh::{Direction, Spread, Wall};
    use super::*;

    fn kinds() -> Vec<Direction> {
        vec![
            Direction::periodic(20, 0.0, 1.0).stretched(Spread::Sine.by(0.4)),
            Direction::between(20, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST)
                .stretched(Spread::TanhBoth.by(1.5)),
            Direction::between(21, 0.0, 1.0, Wall::AT_REST, Wall::Slip)
                .stretched(Spread::TanhLow.by(1.5)),
            Direction::between(19, 0.0, 1.0, Wall::Slip, Wall::Slip),
        ]
    }

    /// What may be used along a direction.
    fn stencils(line: &Operators1d) -> Vec<Stencil> {
        if line.ends.no_slip() == [false; 2] {
            vec![Stencil::PLAIN, Stencil::WIDE]
        } else {
            vec![Stencil::PLAIN]
        }
    }

    /// `S^n` of a transport as dense matrices.
    fn dense(rows: &[Vec<Product>], n: usize) -> Vec<Vec<Vec<f64>>> {
        let mut matrices = vec![vec![vec![0.0; n]; n]; n];
        for (row, products) in rows.iter().enumerate() {
            for &(face, value, c) in products {
                matrices[face][row][value] += c;
            }
        }
        matrices
    }

    #[test]
    fn transport_is_skew_for_every_flux() {
        for direction in kinds() {
            let line = Operators1d::new(&direction);
            let both = |s| [line.transport_of_cells(s), line.transport_of_faces(s)];
            for transport in stencils(&line).into_iter().flat_map(both) {
                for matrix in dense(&transport.rows, line.cells) {
                    for i in 0..line.cells {
                        for j in 0..line.cells {
                            assert!(
                                (matrix[i][j] + matrix[j][i]).abs() < 1e-17,
                                "{direction:?} ({i}, {j})"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn row_sums_are_half_the_divergence_that_the_flux_makes() {
        for direction in kinds() {
            let line = Operators1d::new(&direction);
            let n = line.cells;
            let first = line.first_face();
            for stencil in stencils(&line) {
                let matrices = dense(&line.transport_of_cells(stencil).rows, n);
                for face in first..n {
                    for cell in 0..n {
                        let sum: f64 = matrices[face][cell].iter().sum();
                        let made: f64 = line.divergence[cell]
                            .iter()
                            .filter(|t| t.0 == face)
                            .map(|t| t.1)
                            .sum();
                        assert!(
                            (sum - 0.5 * made).abs() < 4e-16,
                            "{direction:?}: flux {face}, cell {cell}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn tables_of_the_normal_velocity_meet_their_row_sums() {
        let n = 24;
        let line = Operators1d::new(&Direction::between(
            n,
            0.0,
            24.0,
            Wall::AT_REST,
            Wall::AT_REST,
        ));
        let mean = line.flux_mean();
        for face in 1..=4 {
            for row in 1..10 {
                let mut sum = 0.0;
                for &(a, b, c) in WALL_SKEW[face - 1] {
                    sum += if a == row { c } else { 0.0 } - if b == row { c } else { 0.0 };
                }
                // The mean of the weighted divergence; the cells' masses belong to the fluxes along
                // the wall alone.
                let made: f64 = mean[row]
                    .iter()
                    .map(|&(cell, c)| {
                        let divergence: f64 = line.divergence[cell]
                            .iter()
                            .filter(|t| t.0 == face)
                            .map(|t| t.1)
                            .sum();
                        c / line.cell_mass_m[cell] * divergence
                    })
                    .sum();
                assert!(
                    (sum - 0.5 * made).abs() < 2e-16,
                    "flux {face}, row {row}: {sum} against {}",
                    0.5 * made
                );
            }
        }
    }

    #[test]
    fn the_flux_mean_keeps_constants_and_slopes_at_a_wall() {
        let line = Operators1d::new(&Direction::between(
            24,
            0.0,
            24.0,
            Wall::AT_REST,
            Wall::Slip,
        ));
        for (face, row) in line.flux_mean().iter().enumerate().skip(1) {
            let sum: f64 = row.iter().map(|t| t.1).sum();
            assert!(
                (sum - line.face_mass_m[face]).abs() < 1e-15,
                "face {face}: {sum}"
            );
            let slope: f64 = row.iter().map(|t| t.1 * (t.0 as f64 + 0.5)).sum();
            let at_slip_wall = face + 2 > 24;
            assert!(
                at_slip_wall || (slope - face as f64 * line.face_mass_m[face]).abs() < 1e-13,
                "face {face}: {slope}"
            );
        }
    }

    #[test]
    fn transport_along_a_wall_is_exact_for_a_parabolic_flux() {
        let line = Operators1d::new(&Direction::between(
            24,
            0.0,
            24.0,
            Wall::AT_REST,
            Wall::AT_REST,
        ));
        let transport = line.transport_of_cells(Stencil::PLAIN);
        // q = 1, F = z^2: the skew form gives half the derivative of F, and the same for F = z, q =
        // z is exact to z^2.
        for (k, row) in transport.rows.iter().take(6).enumerate() {
            let z = k as f64 + 0.5;
            let sum: f64 = row.iter().map(|&(f, _, c)| c * (f as f64).powi(2)).sum();
            assert!(
                (sum / line.cell_mass_m[k] - z).abs() < 1e-14,
                "cell {k}: {sum}"
            );
            let sum: f64 = row
                .iter()
                .map(|&(f, l, c)| c * f as f64 * (l as f64 + 0.5))
                .sum();
            // z dq/dz + q/2 with q = z.
            assert!(
                (sum / line.cell_mass_m[k] - 1.5 * z).abs() < 1e-13,
                "cell {k}: {sum}"
            );
        }
    }

    #[test]
    fn a_uniform_flux_carries_waves_with_sixth_order_away_from_no_slip_walls() {
        let speed = |stencil: Stencil, theta: f64| {
            let sum: f64 = stencil
                .products()
                .map(|(_, value, c)| c * (theta * value as f64).sin())
                .sum();
            sum / theta
        };
        let central = |theta: f64| {
            (45.0 * theta.sin() - 9.0 * (2.0 * theta).sin() + (3.0 * theta).sin()) / (30.0 * theta)
        };
        for theta in [0.1, 0.7, 1.5, 3.0] {
            assert!(
                (speed(Stencil::WIDE, theta) - central(theta)).abs() < 1e-15,
                "{theta}"
            );
        }
        let loss = 1.0 - speed(Stencil::PLAIN, 0.1);
        assert!((loss / (0.075 * 1e-4) - 1.0).abs() < 1e-2, "{loss}");
    }

    #[test]
    fn one_no_slip_wall_takes_the_wide_stencil_from_all_directions() {
        let around = || Operators1d::new(&Direction::periodic(20, 0.0, 1.0));
        let between = |wall| Operators1d::new(&Direction::between(20, 0.0, 1.0, wall, Wall::Slip));
        assert_eq!(
            Stencil::for_lines(&[around(), around(), between(Wall::Slip)]),
            Stencil::WIDE
        );
        assert_eq!(
            Stencil::for_lines(&[around(), around(), between(Wall::AT_REST)]),
            Stencil::PLAIN
        );
    }

    #[test]
    fn rows_called_regular_follow_the_formula_of_the_interior() {
        for direction in kinds() {
            let line = Operators1d::new(&direction);
            for (faces, m) in stencils(&line).into_iter().flat_map(|stencil| {
                let faces = line.transport_of_faces(stencil);
                faces.regular.clone().map(move |m| (faces.clone(), m))
            }) {
                let matrices = dense(&faces.rows, line.cells);
                for (face, value, _) in interior_products(faces.stencil, m as isize) {
                    let expected: f64 = interior_products(faces.stencil, m as isize)
                        .filter(|p| (p.0, p.1) == (face, value))
                        .map(|p| p.2)
                        .sum();
                    // Fluxes and values on a wall are zero and leave no product.
                    if (face > 0 && value > 0) || line.is_periodic() {
                        let found = matrices[face as usize][m][value as usize];
                        assert!((found - expected).abs() < 1e-16, "{direction:?}, row {m}");
                    }
                }
            }
        }
    }
}
