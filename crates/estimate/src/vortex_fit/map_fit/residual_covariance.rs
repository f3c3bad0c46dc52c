//! Covariance of a fit to a map whose velocities share air, noise and windows with their neighbours.
//!
//! The fit ends where the sum of psi_i j_i is zero (psi_i the weighted residual of cell i over its standard deviation, j_i the
//! slopes of its velocity over the same), so its covariance is the sandwich A^-1 B A^-1 (Huber 1967) with
//!
//! ```text
//! B = sum over cells i, k of C(i - k) j_i j_k^T,     C(lines, gates) = mean over all pairs of cells so far apart of psi psi
//! ```
//!
//! The shape of C is much the same everywhere, and the mean over the whole map knows it well; sums of psi j over lines, squared,
//! would be few and scatter widely. C ends where it first falls below a twentieth along each axis. Its size is that of the
//! cells that decide the fit, with the weights h_i = j_i^T A^-1 j_i: in the cores residuals have wider tails than elsewhere.
//! What the fit has taken out of the residuals is given back: n_eff/(n_eff - parameters), n_eff = (sum h)^2/sum h^2 cells over
//! sum of C/C(0). Check: the spread of fits over many maps; made-up noise with a known correlation, and with more in some cells.

use multiversion::multiversion;
use ndarray::{Array2, ArrayView1};
use std::ops::Range;

use crate::linalg::dot;

/// One cell of a map.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    /// Weighted residual over its standard deviation.
    pub(crate) residual: f64,
    /// Slopes over the same standard deviation, by free number.
    pub(crate) slopes: Vec<f64>,
}

/// Correlations below this part do not count.
const LEAST: f64 = 0.05;

/// Correlation of the residuals with those of their neighbours.
struct Correlation {
    /// (lines, gates, correlation) of the distances that count, of each pair of opposite ones one; itself first.
    at: Vec<(i64, i64, f64)>,
}

impl Correlation {
    /// Of cells \[line\]\[gate\] with nothing where a velocity is missing; it reaches over at most so many `lines`.
    fn new(field: &Field, lines: usize) -> Option<Self> {
        let (count, gates) = (field.lines as i64, field.gates as i64);
        let variance = field.correlation(0, 0)?;
        let share = |line: i64, gate: i64| field.correlation(line, gate).map_or(0.0, |c| c / variance);
        let last = |most: i64, of: &dyn Fn(i64) -> f64| (1..=most).find(|&k| of(k) < LEAST).map_or(most, |k| k - 1);
        let last_line = last((lines as i64).min(count / 3), &|m| share(m, 0));
        let last_gate = last(gates / 3, &|k| share(0, k));
        let mut at = Vec::new();
        for line in 0..=last_line {
            for gate in if line == 0 { 0 } else { -last_gate }..=last_gate {
                let c = share(line, gate);
                if c.abs() >= LEAST {
                    at.push((line, gate, c));
                }
            }
        }
        Some(Self { at })
    }

    /// Number of cells that count as one.
    fn alike(&self) -> f64 {
        self.at.iter().map(|&(line, gate, c)| both(line, gate) * c).sum::<f64>().max(1.0)
    }
}

/// Distances that a stored one stands for.
fn both(line: i64, gate: i64) -> f64 {
    if line == 0 && gate == 0 { 1.0 } else { 2.0 }
}

/// Number of cells \[line\]\[gate\] that count as one.
pub(crate) fn alike(cells: &[Vec<Option<Cell>>], lines: usize) -> f64 {
    Correlation::new(&Field::new(cells, 0), lines).map_or(1.0, |correlation| correlation.alike())
}

/// Sum over all pairs of cells of C j j^T, with cells \[line\]\[gate\] and nothing where a velocity is missing, and the number of
/// cells that count as one; `bread` is A^-1, correlation reaches over at most so many `lines`.
pub(crate) fn filling(cells: &[Vec<Option<Cell>>], bread: &Array2<f64>, lines: usize) -> (Array2<f64>, f64) {
    let order = bread.nrows();
    let field = Field::new(cells, order);
    let mut filling = Array2::<f64>::zeros((order, order));
    let Some(correlation) = Correlation::new(&field, lines) else { return (filling, 1.0) };
    // first what each cell has about it, then one product per cell: the pairs are many
    let mut about = vec![0.0; field.slopes.len()];
    for &(line, gate, c) in &correlation.at {
        let weight = 0.5 * both(line, gate) * c;
        for (a, b) in field.rows(line, gate) {
            let (a, b) = (a.start * order..a.end * order, b.start * order..b.end * order);
            add(&mut about[a.clone()], weight, &field.slopes[b.clone()]);
            add(&mut about[b], weight, &field.slopes[a]);
        }
    }
    for (slopes, sums) in field.slopes.chunks_exact(order.max(1)).zip(about.chunks_exact(order.max(1))) {
        for (mut row, slope) in filling.rows_mut().into_iter().zip(slopes) {
            row.iter_mut().zip(sums).for_each(|(entry, sum)| *entry += slope * sum);
        }
    }
    let alike = correlation.alike();
    let (mut weights, mut weights2, mut squares) = (0.0, 0.0, 0.0);
    for cell in cells.iter().flatten().flatten() {
        let slopes = ArrayView1::from(&cell.slopes);
        let weight = slopes.dot(&bread.dot(&slopes)).abs();
        weights += weight;
        weights2 += weight * weight;
        squares += weight * cell.residual * cell.residual;
    }
    if weights == 0.0 {
        return (filling, alike);
    }
    let independent = weights * weights / weights2 / alike;
    let given_back = independent / (independent - order as f64).max(1.0);
    (filling * (squares / weights * given_back), alike)
}

/// to += weight from, with the widest vectors that the processor has.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn add(to: &mut [f64], weight: f64, from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}

/// Numbers of all places of a map, one line after the other, with zeros where a velocity is missing.
struct Field {
    lines: usize,
    gates: usize,
    residual: Vec<f64>,
    /// 1 where there is a velocity.
    known: Vec<f64>,
    slopes: Vec<f64>,
}

impl Field {
    /// With the first `order` slopes of each cell.
    fn new(cells: &[Vec<Option<Cell>>], order: usize) -> Self {
        let (lines, gates) = (cells.len(), cells.first().map_or(0, Vec::len));
        let all = || cells.iter().flatten();
        let number = |of: fn(&Cell) -> f64| all().map(|cell| cell.as_ref().map_or(0.0, of)).collect();
        let mut slopes = vec![0.0; lines * gates * order];
        for (slopes, cell) in slopes.chunks_exact_mut(order.max(1)).zip(all()) {
            if let Some(cell) = cell {
                slopes.copy_from_slice(&cell.slopes[..order]);
            }
        }
        Self { lines, gates, residual: number(|cell| cell.residual), known: number(|_| 1.0), slopes }
    }

    /// The places of each line that have another so far away, and those.
    fn rows(&self, line: i64, gate: i64) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
        let (line, gates, size) = (line as usize, self.gates, gate.unsigned_abs() as usize);
        let (from, to) = if gate < 0 { (size, 0) } else { (0, size) };
        let count = gates.saturating_sub(size);
        (0..self.lines.saturating_sub(line)).map(move |first| {
            let (a, b) = (first * gates + from, (first + line) * gates + to);
            (a..a + count, b..b + count)
        })
    }

    /// Mean product of the residuals of all pairs that far apart; nothing without pairs.
    fn correlation(&self, line: i64, gate: i64) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for (a, b) in self.rows(line, gate) {
            sum += product(&self.residual[a.clone()], &self.residual[b.clone()]);
            count += product(&self.known[a], &self.known[b]);
        }
        (count > 0.0).then(|| sum / count)
    }
}

/// Scalar product with the widest vectors that the processor has.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn product(a: &[f64], b: &[f64]) -> f64 {
    dot(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Where the slopes are, the residuals are three times as large as elsewhere.
    #[test]
    fn cells_that_decide_the_fit_give_the_size_of_its_scatter() {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(2);
        let mut cell = |inside: bool| {
            let normal = rng.sample::<f64, _>(rand_distr::StandardNormal);
            let (size, slope) = if inside { (3.0, 1.0) } else { (1.0, 0.0) };
            Some(Cell { residual: size * normal, slopes: vec![slope] })
        };
        let cells: Vec<Vec<Option<Cell>>> =
            (0..60).map(|i| (0..60).map(|j| cell(i % 3 == 0 && j % 3 == 0)).collect()).collect();
        let stated = filling(&cells, &Array2::eye(1), 8).0[[0, 0]];
        // 400 independent cells of variance 9: the mean square is known to 7 %.
        assert!((stated / (400.0 * 9.0) - 1.0).abs() < 0.21, "{stated}");
    }

    /// Moving sums of 4 x 3 independent numbers: the variance of a sum of all cells is that of the numbers below.
    #[test]
    fn sums_of_correlated_residuals_have_their_variance() {
        let (lines, gates, repeats) = (60, 40, 40);
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let (mut stated, mut squares) = (0.0, 0.0);
        for _ in 0..repeats {
            let white =
                Array2::from_shape_fn((lines + 3, gates + 2), |_| rng.sample::<f64, _>(rand_distr::StandardNormal));
            let cells: Vec<Vec<Option<Cell>>> = (0..lines)
                .map(|i| {
                    (0..gates)
                        .map(|j| {
                            let residual = white.slice(ndarray::s![i..i + 4, j..j + 3]).sum();
                            // a wave over the map
                            let slope = (0.2 * i as f64).sin() * (0.25 * j as f64).cos();
                            Some(Cell { residual, slopes: vec![slope] })
                        })
                        .collect()
                })
                .collect();
            stated += filling(&cells, &Array2::eye(1), 8).0[[0, 0]] / f64::from(repeats);
            let sum: f64 = cells.iter().flatten().flatten().map(|c| c.residual * c.slopes[0]).sum();
            squares += sum * sum / f64::from(repeats);
        }
        // the mean of 40 squares scatters by sqrt(2/40)
        assert!((stated / squares - 1.0).abs() < 3.0 * (2.0 / f64::from(repeats)).sqrt(), "{stated} {squares}");
    }

    /// Every pair of cells written out, with holes.
    #[test]
    fn pairs_about_holes_are_those_of_the_sum_written_out() {
        let (lines, gates) = (9, 7);
        let cell = |line: usize, gate: usize| {
            let place = (line * gates + gate) as f64;
            let cell = Cell { residual: (place * place).sin() + 1.0, slopes: vec![(1.3 * place).cos(), place.sin()] };
            (line * gate % 5 != 3).then_some(cell)
        };
        let cells: Vec<Vec<Option<Cell>>> =
            (0..lines).map(|line| (0..gates).map(|gate| cell(line, gate)).collect()).collect();
        let field = Field::new(&cells, 2);
        let correlation = Correlation::new(&field, 3).unwrap();
        let mut sum = Array2::<f64>::zeros((2, 2));
        for &(line, gate, c) in &correlation.at {
            let (mut products, mut count) = (0.0, 0.0);
            for first in 0..lines as i64 - line {
                for from in (-gate).max(0)..(gates as i64).min(gates as i64 - gate) {
                    let at = |line: i64, gate: i64| cells[line as usize][gate as usize].as_ref();
                    let (Some(a), Some(b)) = (at(first, from), at(first + line, from + gate)) else { continue };
                    (products, count) = (products + a.residual * b.residual, count + 1.0);
                    for ((i, j), sum) in sum.indexed_iter_mut() {
                        let both_ways = a.slopes[i] * b.slopes[j] + b.slopes[i] * a.slopes[j];
                        *sum += 0.5 * both(line, gate) * c * both_ways;
                    }
                }
            }
            assert!((field.correlation(line, gate).unwrap() - products / count).abs() < 1e-12, "{line} {gate}");
        }
        assert!(correlation.at.iter().any(|&(_, gate, _)| gate < 0) && correlation.at.len() > 4);
        let found = filling(&cells, &Array2::eye(2), 3).0;
        // but for the size of the residuals
        let shape = |a: &Array2<f64>| a / a[[0, 0]];
        assert!((shape(&found) - shape(&sum)).iter().all(|d| d.abs() < 1e-12), "{found} {sum}");
    }
}
