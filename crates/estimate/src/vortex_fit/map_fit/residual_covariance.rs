//! Covariance of the gradient of a fit, B of the sandwich A^-1 B A^-1, from its residuals: two models of how they are correlated.
//!
//! B = sum over cells i, k of C(i - k) s_i s_k^T, s the slopes over the deviations, C the covariance of the weighted residuals psi that there would
//! be without the fit. All sums over pairs of cells are taken by Fourier transforms.
//!
//! **Of neighbours**: C is the correlogram of the residuals, the mean of psi psi over all pairs of cells so far apart, until it first falls below a
//! twentieth along each axis. Its size is that of the cells that decide the fit, with the weights h_i = s_i^T A^-1 s_i: in the cores residuals have
//! wider tails than elsewhere. What the fit has taken out of the residuals is given back: n_eff/(n_eff - parameters), n_eff = (sum h)^2/sum h^2 cells
//! over sum of C/C(0). That is right for our own maps, where windows and regions are what neighbours share.
//!
//! **Decaying**: C is white noise and, if the residuals show it, a part that decays exponentially along and across the lines:
//!
//! ```text
//! C = c_0 [0] + c_1 exp(-sqrt((lines / L_t)^2 + (gates / L_r)^2))
//! ```
//!
//! The fit takes from the residuals what looks like a wake or a wind, which is most of what is long, so a correlogram of
//! residuals falls too soon. It is therefore compared with what is expected of it *after* the fit: sums over pairs of cells of
//! M C M, M = 1 - Q Q^T, Q an orthonormal basis of the slopes. c_1 is kept if the white correlogram is beyond chance. That is right for turbulence;
//! own maps it serves worse than the first (measured over 60 scans: scatter over stated 1.14 instead of 1.05).
//!
//! Check: the spread of fits over many maps; synthetic noise, white and with known correlations, and with more in some cells.

use ndarray::{Array2, ArrayView1};
use num_complex::Complex;
use rustfft::Fft;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::linalg::dot;
use crate::spectrum::transform::complex_transforms;
use crate::vortex_fit::map_fit::cells::{Cell, Rows, orthonormal, products, scaled};

/// Correlations below this part do not count.
const LEAST: f64 = 0.05;
/// Reduction of chi-square that a correlated part must bring.
const BEYOND_CHANCE: f64 = 12.0;
/// Ratio of the lengths that are tried at first, and the last ratio.
const COARSE: f64 = 1.8;
const FINE: f64 = 1.15;

/// The least length from `least` on without prime factors but 2, 3 and 5, whose transforms are quick.
fn fast_length(least: usize) -> usize {
    let mut length = least.max(1);
    while !is_fast_length(length) {
        length += 1;
    }
    length
}

fn is_fast_length(length: usize) -> bool {
    let mut rest = length;
    for factor in [2, 3, 5] {
        while rest.is_multiple_of(factor) {
            rest /= factor;
        }
    }
    rest == 1
}

/// Sums over all pairs of cells that are so far apart, by Fourier transforms on a grid with at least as much room again.
struct Plane<'a> {
    cells: &'a [Cell],
    /// Lines and gates of the cells.
    extent: (usize, usize),
    /// And of the grid.
    lines: usize,
    gates: usize,
    along: [Arc<dyn Fft<f64>>; 2],
    across: [Arc<dyn Fft<f64>>; 2],
}

impl<'a> Plane<'a> {
    fn new(cells: &'a [Cell]) -> Self {
        let last_line = cells.iter().map(|cell| cell.line).max().unwrap_or(0);
        let last_gate = cells.iter().map(|cell| cell.gate).max().unwrap_or(0);
        let extent = (last_line + 1, last_gate + 1);
        let lines = fast_length(2 * extent.0);
        let gates = fast_length(2 * extent.1);
        Self {
            cells,
            extent,
            lines,
            gates,
            along: complex_transforms(gates),
            across: complex_transforms(lines),
        }
    }

    fn transform(&self, grid: &mut [Complex<f64>], inverse: usize) {
        self.along[inverse].process(grid);
        let mut turned = vec![Complex::default(); grid.len()];
        for (i, row) in grid.chunks_exact(self.gates).enumerate() {
            row.iter()
                .enumerate()
                .for_each(|(j, value)| turned[j * self.lines + i] = *value);
        }
        self.across[inverse].process(&mut turned);
        let scale = if inverse == 1 {
            (grid.len() as f64).recip()
        } else {
            1.0
        };
        for (j, column) in turned.chunks_exact(self.lines).enumerate() {
            column
                .iter()
                .enumerate()
                .for_each(|(i, value)| grid[i * self.gates + j] = value * scale);
        }
    }

    /// Transform of numbers of the cells, 0 elsewhere.
    fn spectrum(&self, numbers: &[f64]) -> Vec<Complex<f64>> {
        let mut grid = vec![Complex::default(); self.lines * self.gates];
        self.cells
            .iter()
            .zip(numbers)
            .for_each(|(cell, x)| grid[cell.line * self.gates + cell.gate] = (*x).into());
        self.transform(&mut grid, 0);
        grid
    }

    fn back(&self, mut grid: Vec<Complex<f64>>) -> Vec<f64> {
        self.transform(&mut grid, 1);
        grid.into_iter().map(|value| value.re).collect()
    }

    /// Distances (lines, gates) beyond which pairs of cells are few.
    fn half(&self) -> (f64, f64) {
        (0.5 * self.extent.0 as f64, 0.5 * self.extent.1 as f64)
    }

    /// Sum of a function of the distance over all distances of cells, with either sign.
    fn sum(&self, function: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (line, row) in function.chunks_exact(self.gates).enumerate() {
            for (gate, value) in row.iter().enumerate() {
                let is_within = is_distance(line, self.extent.0, self.lines)
                    && is_distance(gate, self.extent.1, self.gates);
                if is_within {
                    sum += value;
                }
            }
        }
        sum
    }

    /// A function of the distances (lines, gates) on the grid.
    fn of_distance<T>(&self, f: impl Fn(f64, f64) -> T) -> Vec<T> {
        let mut values = Vec::with_capacity(self.lines * self.gates);
        for line in 0..self.lines {
            let lines = line.min(self.lines - line) as f64;
            for gate in 0..self.gates {
                values.push(f(lines, gate.min(self.gates - gate) as f64));
            }
        }
        values
    }

    /// Sums of products of the numbers of all pairs of cells, by distance.
    fn power(&self, numbers: &[f64]) -> Vec<f64> {
        self.back(
            self.spectrum(numbers)
                .into_iter()
                .map(|value| value.norm_sqr().into())
                .collect(),
        )
    }

    /// Transform of a function of the distance.
    fn transformed(&self, function: &[f64]) -> Vec<Complex<f64>> {
        let mut grid: Vec<Complex<f64>> = function.iter().map(|value| (*value).into()).collect();
        self.transform(&mut grid, 0);
        grid
    }

    /// Sums over all pairs of cells of a function of their distance times the products of columns of numbers.
    fn quadratic(&self, columns: &[Vec<f64>], function: &[f64]) -> Array2<f64> {
        let function = self.transformed(function);
        let smooth: Vec<Vec<f64>> = columns
            .iter()
            .map(|column| self.convolve(column, &function))
            .collect();
        Array2::from_shape_fn((columns.len(), columns.len()), |(i, j)| {
            dot(&columns[j], &smooth[i])
        })
    }

    /// Sums of the numbers of the cells with the weights of a function of the distance, whose transform is given.
    fn convolve(&self, numbers: &[f64], function: &[Complex<f64>]) -> Vec<f64> {
        let product = self
            .spectrum(numbers)
            .iter()
            .zip(function)
            .map(|(a, b)| a * b)
            .collect();
        let grid = self.back(product);
        self.cells
            .iter()
            .map(|cell| grid[cell.line * self.gates + cell.gate])
            .collect()
    }
}

/// Whether an index of a periodic axis of the grid is a distance of two cells, with either sign.
fn is_distance(index: usize, extent: usize, size: usize) -> bool {
    index <= extent || index > size - extent
}

/// Correlation at those lengths.
fn exponential(plane: &Plane<'_>, (lines, gates): (f64, f64)) -> Vec<f64> {
    plane.of_distance(|i, j| (-(i / lines).hypot(j / gates)).exp())
}

/// Covariance of the residuals.
#[derive(Debug, Clone, Copy)]
struct Fitted {
    white: f64,
    correlated: f64,
    lengths: (f64, f64),
    /// Sum of squares of what is left of the correlogram.
    left: f64,
}

impl Fitted {
    /// The one that leaves less, the first of equals.
    fn or_better(self, other: Self) -> Self {
        if other.left < self.left { other } else { self }
    }
}

/// Correlogram of the residuals and what is needed to say what is expected of it.
struct Correlogram<'a> {
    plane: &'a Plane<'a>,
    basis: Vec<Vec<f64>>,
    basis_spectra: Vec<Vec<Complex<f64>>>,
    /// Pairs of cells, sums of products and expected sums of unit white noise, by distance.
    pairs: Vec<f64>,
    sums: Vec<f64>,
    white: Vec<f64>,
    /// Weights of the distances.
    weights: Vec<f64>,
}

impl<'a> Correlogram<'a> {
    fn new(plane: &'a Plane<'a>, residuals: &[f64], slopes: &[Vec<f64>]) -> Self {
        let pairs = plane.power(&vec![1.0; residuals.len()]);
        let sums = plane.power(residuals);
        let basis = orthonormal(slopes);
        let basis_spectra: Vec<_> = basis.iter().map(|column| plane.spectrum(column)).collect();
        let mut white: Vec<f64> = vec![0.0; pairs.len()];
        white[0] = residuals.len() as f64;
        for column in &basis {
            white
                .iter_mut()
                .zip(plane.power(column))
                .for_each(|(white, taken)| *white -= taken);
        }
        // far cells are few and have little to say
        let (most_lines, most_gates) = plane.half();
        let near = plane.of_distance(|i, j| {
            if i <= most_lines && j <= most_gates {
                1.0
            } else {
                0.0
            }
        });
        let mut weights: Vec<f64> = near
            .iter()
            .zip(&pairs)
            .map(|(near, pairs)| if *pairs > 0.5 { near / pairs } else { 0.0 })
            .collect();
        weights[0] *= 0.5;
        Self {
            plane,
            basis,
            basis_spectra,
            pairs,
            sums,
            white,
            weights,
        }
    }

    /// Expected sums of products of residuals of noise with that correlation.
    fn expected(&self, correlation: &[f64]) -> Vec<f64> {
        let plane = self.plane;
        let function = plane.transformed(correlation);
        let smooth: Vec<Vec<f64>> = self
            .basis
            .iter()
            .map(|column| plane.convolve(column, &function))
            .collect();
        let mut taken = vec![Complex::default(); function.len()];
        for (column, spectrum) in smooth.iter().zip(&self.basis_spectra) {
            let mut rest = column.clone();
            for other in &self.basis {
                let part = 0.5 * dot(other, column);
                rest.iter_mut()
                    .zip(other)
                    .for_each(|(rest, other)| *rest -= part * other);
            }
            let rest = plane.spectrum(&rest);
            for ((taken, a), b) in taken.iter_mut().zip(spectrum).zip(rest) {
                *taken += 2.0 * (a.conj() * b).re;
            }
        }
        let mut expected = scaled(correlation, &self.pairs);
        for (expected, taken) in expected.iter_mut().zip(plane.back(taken)) {
            *expected -= taken;
        }
        expected
    }

    fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        let factors = self.weights.iter().zip(a).zip(b);
        factors.map(|((w, a), b)| w * a * b).sum()
    }

    /// White noise alone.
    fn white_alone(&self) -> Fitted {
        let white = self.product(&self.sums, &self.white) / self.product(&self.white, &self.white);
        Fitted {
            white,
            correlated: 0.0,
            lengths: (0.0, 0.0),
            left: self.left(white, 0.0, &self.white),
        }
    }

    /// Sum of squares of what white noise and a correlated part of that shape leave of the correlogram.
    fn left(&self, white: f64, correlated: f64, shape: &[f64]) -> f64 {
        let left = self.sums.iter().zip(&self.white).zip(shape);
        let left: Vec<f64> = left
            .map(|((sum, w), s)| sum - white * w - correlated * s)
            .collect();
        self.product(&left, &left)
    }

    /// The best strengths at given lengths.
    fn at(&self, lengths: (f64, f64)) -> Fitted {
        let shape = self.expected(&exponential(self.plane, lengths));
        let aa = self.product(&self.white, &self.white);
        let ab = self.product(&self.white, &shape);
        let bb = self.product(&shape, &shape);
        let a = self.product(&self.sums, &self.white);
        let b = self.product(&self.sums, &shape);
        let determinant = aa * bb - ab * ab;
        let mut white = (a * bb - b * ab) / determinant;
        let mut correlated = (b * aa - a * ab) / determinant;
        if white < 0.0 {
            white = 0.0;
            correlated = b / bb;
        }
        let left = if correlated > 0.0 {
            self.left(white, correlated, &shape)
        } else {
            f64::INFINITY
        };
        Fitted {
            white,
            correlated,
            lengths,
            left,
        }
    }

    fn fit(&self) -> Fitted {
        let alone = self.white_alone();
        let longest = self.plane.half();
        let parts = (0..)
            .map(|i| COARSE.powi(-i))
            .take_while(|part| longest.0.max(longest.1) * part > 0.4);
        let best = parts
            .map(|part| self.at((longest.0 * part, longest.1 * part)))
            .fold(alone, Fitted::or_better);
        // distances come twice, one for each sign
        if alone.left - best.left < 2.0 * BEYOND_CHANCE * alone.white * alone.white {
            return alone;
        }
        let mut best = best;
        let mut ratio = COARSE;
        while ratio > FINE {
            let (i, j) = best.lengths;
            let tried = [
                (i * ratio, j),
                (i / ratio, j),
                (i, j * ratio),
                (i, j / ratio),
            ];
            let next = tried
                .map(|lengths| self.at(lengths))
                .into_iter()
                .fold(best, Fitted::or_better);
            if next.left >= best.left {
                ratio = ratio.sqrt();
            }
            best = next;
        }
        best
    }
}

/// B, and the number of cells that count as one, from the correlogram of the weighted residuals over at most `lines` lines; `bread` is A^-1.
pub(crate) fn of_neighbours(
    cells: &[Cell],
    all: &Rows,
    bread: &Array2<f64>,
    lines: usize,
) -> (Array2<f64>, f64) {
    let order = all.slopes.len();
    let plane = Plane::new(cells);
    let Some(correlation) = neighbours(&plane, &all.residuals, lines) else {
        return (Array2::zeros((order, order)), 1.0);
    };
    let alike = correlation.iter().sum::<f64>().max(1.0);
    let mut scores = plane.quadratic(&all.slopes, &correlation);
    let mut weights = 0.0;
    let mut weights2 = 0.0;
    let mut squares = 0.0;
    for (i, residual) in all.residuals.iter().enumerate().filter(|_| order > 0) {
        let slopes: Vec<f64> = all.slopes.iter().map(|slope| slope[i]).collect();
        let slopes = ArrayView1::from(&slopes);
        let weight = slopes.dot(&bread.dot(&slopes)).abs();
        weights += weight;
        weights2 += weight * weight;
        squares += weight * residual * residual;
    }
    if weights > 0.0 {
        let independent = weights * weights / weights2 / alike;
        let given_back = independent / (independent - order as f64).max(1.0);
        scores *= squares / weights * given_back;
    }
    (scores, alike)
}

/// Correlation of residuals with those of their neighbours on the grid, 0 beyond where it ends.
fn neighbours(plane: &Plane<'_>, residuals: &[f64], lines: usize) -> Option<Vec<f64>> {
    let sums = plane.power(residuals);
    let pairs = plane.power(&vec![1.0; residuals.len()]);
    let means = sums
        .iter()
        .zip(&pairs)
        .map(|(sum, pairs)| if *pairs > 0.5 { sum / pairs } else { 0.0 });
    let means: Vec<f64> = means.collect();
    let variance = means[0];
    if variance <= 0.0 || !variance.is_finite() {
        return None;
    }
    let across = (1..=lines.min(plane.extent.0 / 3)).map(|line| means[line * plane.gates]);
    let along = (1..=plane.extent.1 / 3).map(|gate| means[gate]);
    let last_line = across.take_while(|mean| *mean >= LEAST * variance).count() as f64;
    let last_gate = along.take_while(|mean| *mean >= LEAST * variance).count() as f64;
    let near = plane.of_distance(|line, gate| line <= last_line && gate <= last_gate);
    let mut correlations = Vec::with_capacity(means.len());
    for (mean, is_near) in means.iter().zip(near) {
        let correlation = mean / variance;
        let counts = is_near && correlation.abs() >= LEAST;
        correlations.push(if counts { correlation } else { 0.0 });
    }
    Some(correlations)
}

/// B, and the number of cells that count as one. Residuals and slopes are summed over blocks of so many lines and gates, over the root of their
/// number: what is white keeps its variance, and what is correlated within a block is counted as white of more.
pub(crate) fn decaying(
    cells: &[Cell],
    all: &Rows,
    (lines, gates): (usize, usize),
) -> (Array2<f64>, f64) {
    let mut places: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for (i, cell) in cells.iter().enumerate() {
        places
            .entry((cell.line / lines, cell.gate / gates))
            .or_default()
            .push(i);
    }
    let blocks: Vec<Cell> = places
        .keys()
        .map(|&(line, gate)| Cell {
            line,
            gate,
            velocity_m_s: 0.0,
            sigma_m_s: 1.0,
        })
        .collect();
    let slopes = all.slopes.iter().map(|slope| block_sums(&places, slope));
    let slopes: Vec<Vec<f64>> = slopes.collect();
    let plane = Plane::new(&blocks);
    let residuals = block_sums(&places, &all.residuals);
    let found = Correlogram::new(&plane, &residuals, &slopes).fit();
    let white = products(&vec![found.white; cells.len()], &all.slopes);
    if found.correlated == 0.0 {
        return (white, 1.0);
    }
    let correlation = exponential(&plane, found.lengths);
    let alike =
        1.0 + found.correlated / (found.white + found.correlated) * (plane.sum(&correlation) - 1.0);
    (
        white + plane.quadratic(&slopes, &correlation) * found.correlated,
        alike,
    )
}

/// Sums of numbers over the cells of each block, over the root of their count.
fn block_sums(blocks: &BTreeMap<(usize, usize), Vec<usize>>, numbers: &[f64]) -> Vec<f64> {
    let mut sums = Vec::with_capacity(blocks.len());
    for cells in blocks.values() {
        let sum: f64 = cells.iter().map(|i| numbers[*i]).sum();
        sums.push(sum / (cells.len() as f64).sqrt());
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
        rng.sample(rand_distr::StandardNormal)
    }

    fn cells(lines: usize, gates: usize, is_there: impl Fn(usize, usize) -> bool) -> Vec<Cell> {
        let places = (0..lines).flat_map(|line| (0..gates).map(move |gate| (line, gate)));
        let cell = |(line, gate)| Cell {
            line,
            gate,
            velocity_m_s: 0.0,
            sigma_m_s: 1.0,
        };
        places
            .filter(|(line, gate)| is_there(*line, *gate))
            .map(cell)
            .collect()
    }

    fn neighbours_of(
        cells: &[Cell],
        residuals: &[f64],
        slopes: &[Vec<f64>],
        lines: usize,
    ) -> Array2<f64> {
        let rows = Rows {
            residuals: residuals.to_vec(),
            slopes: slopes.to_vec(),
        };
        of_neighbours(cells, &rows, &Array2::eye(slopes.len()), lines).0
    }

    /// Where the slopes are, the residuals are three times as large as elsewhere.
    #[test]
    fn cells_that_decide_the_fit_give_the_size_of_its_scatter() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let cells = cells(60, 60, |_, _| true);
        let inside = |cell: &Cell| cell.line.is_multiple_of(3) && cell.gate.is_multiple_of(3);
        let residuals: Vec<f64> = cells
            .iter()
            .map(|cell| if inside(cell) { 3.0 } else { 1.0 } * normal(&mut rng))
            .collect();
        let slope = cells
            .iter()
            .map(|cell| f64::from(u8::from(inside(cell))))
            .collect();
        let stated = neighbours_of(&cells, &residuals, &[slope], 8)[[0, 0]];
        // 400 independent cells of variance 9: the mean square is known to 7 %.
        assert!((stated / (400.0 * 9.0) - 1.0).abs() < 0.21, "{stated}");
    }

    /// Moving sums of 4 x 3 independent numbers: the variance of a sum of all cells is that of the numbers below.
    #[test]
    fn sums_of_correlated_residuals_have_their_variance() {
        let lines = 60;
        let gates = 40;
        let repeats = 40;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let cells = cells(lines, gates, |_, _| true);
        // a wave over the map
        let slope: Vec<f64> = cells
            .iter()
            .map(|cell| (0.2 * cell.line as f64).sin() * (0.25 * cell.gate as f64).cos())
            .collect();
        let mut stated = 0.0;
        let mut squares = 0.0;
        for _ in 0..repeats {
            let white = Array2::from_shape_fn((lines + 3, gates + 2), |_| normal(&mut rng));
            let moving = |cell: &Cell| {
                white
                    .slice(ndarray::s![
                        cell.line..cell.line + 4,
                        cell.gate..cell.gate + 3
                    ])
                    .sum()
            };
            let residuals: Vec<f64> = cells.iter().map(moving).collect();
            stated += neighbours_of(&cells, &residuals, std::slice::from_ref(&slope), 8)[[0, 0]]
                / f64::from(repeats);
            squares += dot(&residuals, &slope).powi(2) / f64::from(repeats);
        }
        // the mean of 40 squares scatters by sqrt(2/40)
        assert!(
            (stated / squares - 1.0).abs() < 3.0 * (2.0 / f64::from(repeats)).sqrt(),
            "{stated} {squares}"
        );
    }

    /// Every pair of cells written out, with holes.
    #[test]
    fn pairs_about_holes_are_those_of_the_sum_written_out() {
        let lines = 9;
        let gates = 7;
        let cells = cells(lines, gates, |line, gate| line * gate % 5 != 3);
        let of = |number: fn(f64) -> f64| -> Vec<f64> {
            cells
                .iter()
                .map(|cell| number((cell.line * gates + cell.gate) as f64))
                .collect()
        };
        let residuals = of(|x| (x * x).sin() + 1.0);
        let slopes = [of(|x| (1.3 * x).cos()), of(f64::sin)];
        let plane = Plane::new(&cells);
        let correlation = neighbours(&plane, &residuals, 3).unwrap();
        let at = |a: &Cell, b: &Cell| {
            let apart = |a: usize, b: usize, size: usize| (b + size - a) % size;
            apart(a.line, b.line, plane.lines) * plane.gates + apart(a.gate, b.gate, plane.gates)
        };
        let pairs = || (0..cells.len()).flat_map(|i| (0..cells.len()).map(move |k| (i, k)));
        let variance = dot(&residuals, &residuals) / cells.len() as f64;
        let (mut products, mut counts) =
            (vec![0.0; correlation.len()], vec![0.0; correlation.len()]);
        let mut sum = Array2::<f64>::zeros((2, 2));
        for (i, k) in pairs() {
            let place = at(&cells[i], &cells[k]);
            products[place] += residuals[i] * residuals[k];
            counts[place] += 1.0;
            sum.indexed_iter_mut()
                .for_each(|((a, b), sum)| *sum += correlation[place] * slopes[a][i] * slopes[b][k]);
        }
        for (place, correlation) in correlation
            .iter()
            .enumerate()
            .filter(|(_, correlation)| **correlation != 0.0)
        {
            assert!(
                (correlation * variance - products[place] / counts[place]).abs() < 1e-12,
                "{place}"
            );
        }
        assert!(
            correlation
                .iter()
                .filter(|correlation| **correlation != 0.0)
                .count()
                > 8
        );
        let found = neighbours_of(&cells, &residuals, &slopes, 3);
        // but for the size of the residuals
        let shape = |a: &Array2<f64>| a / a[[0, 0]];
        assert!(
            (shape(&found) - shape(&sum))
                .iter()
                .all(|d| d.abs() < 1e-12),
            "{found} {sum}"
        );
    }

    /// Variance of the sums of residuals with slopes that the fit takes out, stated and found.
    #[test]
    fn sums_of_white_and_correlated_noise_have_their_variance_although_the_fit_takes_from_the_residuals()
     {
        let lines = 40;
        let gates = 24;
        let repeats = 24;
        let cells = cells(lines, gates, |line, gate| (7 * line + gate) % 23 != 0);
        let wave = |a: f64, b: f64| -> Vec<f64> {
            cells
                .iter()
                .map(|cell| (a * cell.line as f64).cos() * (b * cell.gate as f64).sin() + 0.3 * b)
                .collect()
        };
        let slopes = vec![wave(0.1, 0.2), wave(0.25, 0.15), wave(0.0, 0.5)];
        let basis = orthonormal(&slopes);
        for (smooth, white) in [(0, 1.0), (9, 0.3)] {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
            let mut stated = 0.0;
            let mut found = 0.0;
            for _ in 0..repeats {
                // moving means of white numbers: correlated over about `smooth` lines and half as many gates
                let room = smooth + 1;
                let numbers =
                    Array2::from_shape_fn((lines + room, gates + room), |_| normal(&mut rng));
                let noise: Vec<f64> = cells
                    .iter()
                    .map(|cell| {
                        let block = numbers.slice(ndarray::s![
                            cell.line..=cell.line + smooth,
                            cell.gate..=cell.gate + smooth / 2
                        ]);
                        let correlated = if smooth > 0 {
                            block.sum() / (block.len() as f64).sqrt()
                        } else {
                            0.0
                        };
                        correlated + white * normal(&mut rng)
                    })
                    .collect();
                let mut residuals = noise.clone();
                for column in &basis {
                    let part = dot(column, &noise);
                    residuals
                        .iter_mut()
                        .zip(column)
                        .for_each(|(r, c)| *r -= part * c);
                }
                let all = Rows {
                    residuals,
                    slopes: slopes.clone(),
                };
                let scores = decaying(&cells, &all, (1, 1)).0;
                for (i, slope) in slopes.iter().enumerate() {
                    stated += scores[[i, i]] / dot(slope, slope);
                    found += dot(slope, &noise).powi(2) / dot(slope, slope);
                }
            }
            // 72 squares, not quite independent, scatter by 17 to 20 %
            let ratio = stated / found;
            assert!((0.6..1.6).contains(&ratio), "{smooth}: {ratio}");
        }
    }

    #[test]
    fn white_residuals_are_taken_as_white() {
        let cells = cells(60, 30, |line, gate| (7 * line + gate) % 23 != 0);
        let slopes = vec![
            vec![1.0; cells.len()],
            cells.iter().map(|cell| cell.line as f64).collect(),
        ];
        let white = (0..20).filter(|&seed| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let all = Rows {
                residuals: cells.iter().map(|_| 2.0 * normal(&mut rng)).collect(),
                slopes: slopes.clone(),
            };
            decaying(&cells, &all, (1, 1)).1 == 1.0
        });
        assert!(white.count() >= 18);
    }
}
