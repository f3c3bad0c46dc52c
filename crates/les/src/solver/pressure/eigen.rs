//! Eigenvectors of the pressure operator of one direction: `K v = lambda M v` with
//! `K = Dw F^-1 Dw^T`.
//!
//! - Periodic, equal cells: waves, with the exact symbol.
//! - Slip planes, equal cells: cosines, with the same symbol.
//! - Everything else: `K` is never formed. The columns of `M^-1/2 Dw F^-1/2` are rotated in pairs
//!   until they are orthogonal (one-sided Jacobi, Hestenes 1958); they are then
//!   `sqrt(lambda) M^1/2 v`. This keeps the small eigenvalues of strongly stretched meshes
//!   accurate, which the eigenvalues of a formed `K` are not.
//!
//! The vectors satisfy `V^T M V = 1`; the first is the constant with the eigenvalue 0, exactly.
//!
//! Check: orthogonality, `K V = M V lambda`, all kinds of ends; the closed forms against the
//! rotations.

use std::f64::consts::PI;

use super::super::mesh::{Ends, Wall};
use super::super::operators_1d::Operators1d;
use super::kernel;

/// Sweeps after which the rotations have converged on every mesh (about 10 are needed).
const MAX_SWEEPS: usize = 40;
/// Cosine of the angle of two columns that is round-off.
const ORTHOGONAL: f64 = 2e-16;
/// Largest cosine in a sweep after which all are round-off: convergence is quadratic.
const LAST_SWEEP: f64 = 1e-10;
/// Norm of a column, relative to the largest, below which it is the null vector's.
const NULL: f64 = 1e-13;

/// Eigenvalues \[1/m^2\], ascending, and eigenvectors \[m^-1/2\], `[cell][mode]`.
pub(crate) type Basis = (Vec<f64>, Vec<f64>);

/// The basis of `line`; its first eigenvalue is 0.
pub(crate) fn basis(line: &Operators1d) -> Basis {
    let slip = matches!(
        line.ends,
        Ends::Walls {
            low: Wall::Slip,
            high: Wall::Slip
        }
    );
    let uniform = line
        .cell_metric_m
        .iter()
        .all(|h| *h == line.cell_metric_m[0]);
    if line.is_thin() {
        (vec![0.0], vec![1.0 / line.cell_mass_m[0].sqrt()])
    } else if line.is_fourier() {
        waves(line)
    } else if slip && uniform {
        cosines(line)
    } else {
        rotations(line)
    }
}

fn waves(line: &Operators1d) -> Basis {
    let n = line.cells;
    let h = line.cell_mass_m[0];
    let length = n as f64 * h;
    let mut vector = Vec::with_capacity(n * n);
    for i in 0..n {
        for m in 0..n {
            let wave = m.div_ceil(2);
            let angle = 2.0 * PI * ((i * wave) % n) as f64 / n as f64;
            let is_single = m == 0 || 2 * wave == n;
            let norm = if is_single {
                1.0 / length.sqrt()
            } else {
                (2.0 / length).sqrt()
            };
            let is_cosine = m % 2 == 1 || m == 0;
            vector.push(norm * if is_cosine { angle.cos() } else { -angle.sin() });
        }
    }
    (wave_values(n, h), vector)
}

/// Eigenvalues \[1/m^2\] of `n` periodic cells of width `h` \[m\]: the constant, then the
/// waves, in pairs.
pub(crate) fn wave_values(n: usize, h: f64) -> Vec<f64> {
    (0..n)
        .map(|m| symbol(2.0 * PI * m.div_ceil(2) as f64 / n as f64, h))
        .collect()
}

fn cosines(line: &Operators1d) -> Basis {
    let n = line.cells;
    let h = line.cell_mass_m[0];
    let length = n as f64 * h;
    let mut vector = Vec::with_capacity(n * n);
    for i in 0..n {
        vector.push(1.0 / length.sqrt());
        for m in 1..n {
            let angle = PI * (((2 * i + 1) * m) % (4 * n)) as f64 / (2 * n) as f64;
            vector.push((2.0 / length).sqrt() * angle.cos());
        }
    }
    let value = (0..n).map(|m| symbol(PI * m as f64 / n as f64, h));
    (value.collect(), vector)
}

fn rotations(line: &Operators1d) -> Basis {
    let n = line.cells;
    let mass = &line.cell_mass_m;
    let mut columns = scaled_columns(line);
    orthogonalise(&mut columns);
    let mut modes: Vec<(f64, Vec<f64>)> = columns
        .into_iter()
        .map(|column| (kernel::dot(&column, &column), column))
        .collect();
    modes.sort_by(|a, b| b.0.total_cmp(&a.0));
    modes.truncate(n - 1);
    modes.reverse();
    let length: f64 = mass.iter().sum();
    let mut value = vec![0.0];
    let mut vector = vec![1.0 / length.sqrt(); n * n];
    for (m, (lambda, column)) in modes.into_iter().enumerate() {
        value.push(lambda);
        let mut v: Vec<f64> = column
            .iter()
            .zip(mass)
            .map(|(w, mass)| w / (lambda * mass).sqrt())
            .collect();
        // Round-off along the constant would couple to the free level of the pressure.
        let weighted = v.iter().zip(mass).map(|(v, mass)| v * mass);
        let mean = weighted.sum::<f64>() / length;
        v.iter_mut().for_each(|v| *v -= mean);
        for (cell, v) in v.into_iter().enumerate() {
            vector[cell * n + m + 1] = v;
        }
    }
    (value, vector)
}

/// Eigenvalue \[1/m^2\] of the wave of phase `theta` per cell of width `h` \[m\].
pub(crate) fn symbol(theta: f64, h: f64) -> f64 {
    (2.0 * (0.5 * theta).sin() * (13.0 / 12.0 - theta.cos() / 12.0) / h).powi(2)
}

/// The columns of `M^-1/2 Dw F^-1/2`, one for each face that carries a velocity.
fn scaled_columns(line: &Operators1d) -> Vec<Vec<f64>> {
    let mut columns = vec![vec![0.0; line.cells]; line.cells];
    for (cell, row) in line.stored_divergence().iter().enumerate() {
        for &(face, c) in row {
            columns[face][cell] += c / (line.cell_mass_m[cell] * line.face_mass_m[face]).sqrt();
        }
    }
    columns.split_off(line.first_face())
}

/// Rotates the columns in pairs until all are orthogonal.
fn orthogonalise(columns: &mut [Vec<f64>]) {
    let largest = columns
        .iter()
        .map(|c| kernel::dot(c, c))
        .fold(0.0, f64::max);
    for _ in 0..MAX_SWEEPS {
        let mut worst = 0.0_f64;
        for p in 0..columns.len() {
            let (head, tail) = columns.split_at_mut(p + 1);
            let a = &mut head[p];
            for b in tail {
                let [aa, bb, ab] = kernel::three_dots(a, b);
                let cosine_of_angle = ab.abs() / (aa * bb).sqrt();
                if cosine_of_angle <= ORTHOGONAL || aa.min(bb) <= NULL * NULL * largest {
                    continue;
                }
                worst = worst.max(cosine_of_angle);
                let zeta = (bb - aa) / (2.0 * ab);
                let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let cosine = 1.0 / tangent.hypot(1.0);
                kernel::rotate(a, b, cosine, cosine * tangent);
            }
        }
        if worst < LAST_SWEEP {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::mesh::{Direction, Spread};
    use super::*;

    /// `K = Dw F^-1 Dw^T`, dense.
    fn stiffness(line: &Operators1d) -> Vec<f64> {
        let n = line.cells;
        let mut dense = vec![0.0; n * n];
        for (row, a) in line.stored_divergence().iter().enumerate() {
            for (column, b) in line.stored_divergence().iter().enumerate() {
                for &(face, x) in a {
                    let others = b.iter().filter(|tap| tap.0 == face);
                    dense[row * n + column] += others
                        .map(|tap| x * tap.1 / line.face_mass_m[face])
                        .sum::<f64>();
                }
            }
        }
        dense
    }

    fn every_kind() -> Vec<Direction> {
        let tanh = Spread::TanhBoth.by(2.0);
        let sine = Spread::Sine.by(0.8);
        vec![
            Direction::periodic(15, 0.0, 2.0),
            Direction::periodic(16, 0.0, 2.0),
            Direction::periodic(4, 0.0, 2.0),
            Direction::periodic(31, 0.0, 2.0).stretched(sine),
            Direction::between(17, 0.0, 2.0, Wall::Slip, Wall::Slip),
            Direction::between(4, 0.0, 2.0, Wall::Slip, Wall::Slip),
            Direction::between(33, 0.0, 2.0, Wall::Slip, Wall::Slip).stretched(tanh.clone()),
            Direction::between(32, 0.0, 2.0, Wall::AT_REST, Wall::AT_REST).stretched(tanh),
            Direction::between(64, 0.0, 2.0, Wall::AT_REST, Wall::Slip)
                .stretched(Spread::TanhLow.by(5.0)),
        ]
    }

    #[test]
    fn the_vectors_diagonalise_stiffness_and_mass_of_every_kind_of_direction() {
        for direction in every_kind() {
            let line = Operators1d::new(&direction);
            let n = line.cells;
            let (value, vector) = basis(&line);
            let dense = stiffness(&line);
            let largest = value.iter().fold(0.0, |a: f64, b| a.max(*b));
            assert_eq!(value[0], 0.0);
            assert!(
                value[1] > 0.0 && value.windows(2).all(|v| v[0] <= v[1]),
                "{direction:?}: {value:?}"
            );
            for m in 0..n {
                for other in 0..n {
                    let sum: f64 = (0..n)
                        .map(|i| vector[i * n + m] * line.cell_mass_m[i] * vector[i * n + other])
                        .sum();
                    let expected = f64::from(m == other);
                    assert!(
                        (sum - expected).abs() < 1e-12,
                        "{direction:?}: ({m}, {other}) {sum}"
                    );
                }
                for i in 0..n {
                    let product: f64 = (0..n).map(|j| dense[i * n + j] * vector[j * n + m]).sum();
                    let expected = value[m] * line.cell_mass_m[i] * vector[i * n + m];
                    let scale = largest * line.cell_mass_m[i].sqrt();
                    assert!(
                        (product - expected).abs() < 1e-12 * scale,
                        "{direction:?}: mode {m} cell {i}"
                    );
                }
            }
        }
    }

    #[test]
    fn rotations_find_the_closed_forms() {
        for direction in [
            Direction::periodic(21, 0.0, 2.0),
            Direction::between(21, 0.0, 2.0, Wall::Slip, Wall::Slip),
        ] {
            let line = Operators1d::new(&direction);
            let closed = basis(&line);
            let rotated = rotations(&line);
            for (a, b) in closed.0.iter().zip(&rotated.0) {
                assert!((a - b).abs() <= 1e-13 * a, "{direction:?}: {a} against {b}");
            }
        }
    }
}
