//! Change of basis along one axis to the eigenvectors of its pressure operator, and back, in place.
//!
//! Axis 0: real Fourier transform where the cells are equal, the direction periodic and their
//! number has small factors; otherwise a product with the matrix of eigenvectors. Axes 1 and 2: the
//! matrix product, folded by the symmetries of the eigenvectors.
//!
//! Check: there and back; the two forms of the Fourier transform against each other.

use std::fmt;
use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::super::operators_1d::Operators1d;
use super::eigen::{basis, wave_values};
use super::fold::Fold;
use super::gemm::{PackedMatrix, Panels};

/// Space that a thread needs for transforms.
#[derive(Debug, Default)]
pub(crate) struct Work {
    packed: Panels,
    spectrum: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

/// Direction of a transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TransformDirection {
    /// To the modes.
    Forward,
    /// To the values.
    Inverse,
}

/// Transform of the rows along axis 0.
pub(crate) enum RowTransform {
    /// One cell: nothing to do.
    Thin,
    /// Fourier transform; the modes are stored as real and imaginary parts in the places of the
    /// row.
    Fourier {
        cells: usize,
        forward: Arc<dyn RealToComplex<f64>>,
        inverse: Arc<dyn ComplexToReal<f64>>,
    },
    /// Products with the transpose of the eigenvectors, and with them.
    Dense(Box<[PackedMatrix; 2]>),
}

impl fmt::Debug for RowTransform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Thin => "Thin",
            Self::Fourier { .. } => "Fourier",
            Self::Dense(_) => "Dense",
        })
    }
}

/// Largest prime factor for which the Fourier transform is fast.
const SMOOTH: usize = 11;
/// Cells up to which the matrix product is faster than a Fourier transform of a number with large
/// factors.
const SMALL: usize = 150;
/// Cells up to which the matrix product is faster than any Fourier transform.
const TINY: usize = 12;

impl RowTransform {
    /// Whether a direction is transformed by products with a matrix.
    pub(crate) fn is_dense(line: &Operators1d) -> bool {
        let n = line.cells;
        // Powers of two add equal values exactly: a flow that does not vary stays as it is,
        // whatever the number of cells.
        let fast = n.is_power_of_two() || n > TINY && (n > SMALL || largest_factor(n) <= SMOOTH);
        !(line.is_thin() || line.is_fourier() && fast)
    }

    /// The transform, the eigenvalues in the order of its modes, and the factor by which forward
    /// and inverse transform together must be multiplied.
    pub(crate) fn new(line: &Operators1d) -> (Self, Vec<f64>, f64) {
        let n = line.cells;
        if line.is_thin() {
            (Self::Thin, vec![0.0], 1.0 / line.cell_mass_m[0])
        } else if !Self::is_dense(line) {
            let mut planner = RealFftPlanner::new();
            let transform = Self::Fourier {
                cells: n,
                forward: planner.plan_fft_forward(n),
                inverse: planner.plan_fft_inverse(n),
            };
            let h = line.cell_mass_m[0];
            (transform, wave_values(n, h), 1.0 / (n as f64 * h))
        } else {
            let (value, vector) = basis(line);
            let vectors = Fold::none(n, &vector);
            (
                Self::Dense(Box::new([
                    PackedMatrix::transpose(&vectors),
                    PackedMatrix::same(&vectors),
                ])),
                value,
                1.0,
            )
        }
    }

    /// Rows to modes, or back.
    pub(crate) fn apply(&self, direction: TransformDirection, rows: &mut [f64], work: &mut Work) {
        match self {
            Self::Thin => {}
            Self::Dense(ways) => ways[direction as usize].apply_to_rows(rows, &mut work.packed),
            Self::Fourier { cells, forward, .. } if direction == TransformDirection::Forward => {
                let (spectrum, scratch) = work.fourier(*cells, forward.get_scratch_len());
                for row in rows.chunks_mut(*cells) {
                    if forward
                        .process_with_scratch(row, spectrum, scratch)
                        .is_err()
                    {
                        invalidate(row);
                    }
                    row[0] = spectrum[0].re;
                    let (pairs, last) = row[1..].as_chunks_mut::<2>();
                    for (pair, mode) in pairs.iter_mut().zip(&spectrum[1..]) {
                        *pair = [mode.re, mode.im];
                    }
                    if let Some(last) = last.first_mut() {
                        *last = spectrum[cells / 2].re;
                    }
                }
            }
            Self::Fourier { cells, inverse, .. } => {
                let (spectrum, scratch) = work.fourier(*cells, inverse.get_scratch_len());
                for row in rows.chunks_mut(*cells) {
                    spectrum[0] = Complex::new(row[0], 0.0);
                    let (pairs, last) = row[1..].as_chunks::<2>();
                    for (pair, mode) in pairs.iter().zip(&mut spectrum[1..]) {
                        *mode = Complex::new(pair[0], pair[1]);
                    }
                    if let Some(last) = last.first() {
                        spectrum[cells / 2] = Complex::new(*last, 0.0);
                    }
                    if inverse
                        .process_with_scratch(spectrum, row, scratch)
                        .is_err()
                    {
                        invalidate(row);
                    }
                }
            }
        }
    }

    /// Square of the norm of a right side that consists of mode `m`, over that of the mode, for
    /// cells of mass `mass_m`. Of a stretched direction only the mean is known.
    pub(crate) fn weight(&self, m: usize, mass_m: f64) -> f64 {
        match self {
            Self::Fourier { cells, .. } => {
                let single = m == 0 || 2 * m.div_ceil(2) == *cells;
                if single {
                    1.0 / *cells as f64
                } else {
                    2.0 / *cells as f64
                }
            }
            Self::Thin => 1.0,
            Self::Dense(_) => mass_m,
        }
    }
}

/// Marks a row as invalid. A length that does not fit the plan cannot occur; if it did, the
/// solution would not be finite.
fn invalidate(row: &mut [f64]) {
    row.fill(f64::NAN);
}

impl Work {
    fn fourier(
        &mut self,
        cells: usize,
        scratch: usize,
    ) -> (&mut [Complex<f64>], &mut [Complex<f64>]) {
        self.spectrum.resize(cells / 2 + 1, Complex::default());
        if self.scratch.len() < scratch {
            self.scratch.resize(scratch, Complex::default());
        }
        (&mut self.spectrum, &mut self.scratch[..scratch])
    }
}

/// Transform of lines along axis 1 or 2.
#[derive(Debug)]
pub(crate) enum LineTransform {
    /// One cell: its scale alone.
    Thin(f64),
    /// Products with the transpose of the eigenvectors, and with them.
    Dense(Box<[PackedMatrix; 2]>),
}

impl LineTransform {
    /// The transform and the eigenvalues of its modes.
    pub(crate) fn new(line: &Operators1d) -> (Self, Vec<f64>) {
        let (value, vector) = basis(line);
        if line.is_thin() {
            return (Self::Thin(vector[0]), value);
        }
        let fold = Fold::new(line.cells, &vector);
        let value = fold.columns.iter().map(|&m| value[m]).collect();
        (
            Self::Dense(Box::new([
                PackedMatrix::transpose(&fold),
                PackedMatrix::same(&fold),
            ])),
            value,
        )
    }

    /// Lines to modes, or back.
    pub(crate) fn apply(
        &self,
        direction: TransformDirection,
        rows: &mut [&mut [f64]],
        work: &mut Work,
    ) {
        match self {
            Self::Thin(scale) => scale_rows(rows, *scale),
            Self::Dense(ways) => ways[direction as usize].apply(rows, &mut work.packed),
        }
    }
}

fn scale_rows(rows: &mut [&mut [f64]], scale: f64) {
    rows.iter_mut()
        .flat_map(|row| row.iter_mut())
        .for_each(|value| *value *= scale);
}

/// Largest prime factor.
fn largest_factor(n: usize) -> usize {
    let mut rest = n;
    let mut factor = 2;
    while factor * factor <= rest {
        if rest.is_multiple_of(factor) {
            rest /= factor;
        } else {
            factor += 1;
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::super::super::mesh::{Direction, Spread, Wall};
    use super::*;

    #[test]
    fn the_fourier_transform_and_the_matrix_of_waves_give_the_same_modes() {
        for n in [4, 16, 27, 60] {
            let line = Operators1d::new(&Direction::periodic(n, 0.0, 3.0));
            let (transform, value, factor) = RowTransform::new(&line);
            assert_eq!(format!("{transform:?}"), "Fourier");
            let (values, vectors) = basis(&line);
            assert_eq!(value, values);
            let row: Vec<f64> = (0..n).map(|i| (1.0 + i as f64).sqrt().sin()).collect();
            let mut modes = row.clone();
            transform.apply(
                TransformDirection::Forward,
                &mut modes,
                &mut Work::default(),
            );
            for (m, mode) in modes.iter().enumerate() {
                let product: f64 = (0..n).map(|i| vectors[i * n + m] * row[i]).sum();
                // The Fourier transform has no norm; waves in pairs have twice the norm of single
                // ones.
                let single = m == 0 || m == n - 1 && n % 2 == 0;
                let norm = if single { 1.0 } else { 0.5_f64.sqrt() } * factor.sqrt();
                let scaled = mode * norm * if single { 1.0 } else { 2.0 };
                assert!(
                    (product - scaled).abs() < 1e-13,
                    "{n}, mode {m}: {product} against {scaled}"
                );
            }
            transform.apply(
                TransformDirection::Inverse,
                &mut modes,
                &mut Work::default(),
            );
            for (a, b) in modes.iter().zip(&row) {
                assert!((a / n as f64 - b).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn folded_transforms_of_lines_are_products_with_the_eigenvectors() {
        let slip = |n| Direction::between(n, 0.0, 3.0, Wall::Slip, Wall::Slip);
        let sine = Spread::Sine.by(0.5);
        let low = Spread::TanhLow.by(1.5);
        for (direction, blocks) in [
            (Direction::periodic(64, 0.0, 3.0), 5),
            (Direction::periodic(27, 0.0, 3.0), 2),
            (Direction::periodic(12, 0.0, 3.0), 1),
            (slip(32), 3),
            (slip(33), 2),
            // Of stretched cells two vectors with nearly the same eigenvalue are found in any
            // mixture.
            (slip(40).stretched(Spread::TanhBoth.by(1.2)), 1),
            (slip(40).stretched(low), 1),
            (Direction::periodic(20, 0.0, 3.0).stretched(sine), 1),
        ] {
            let line = Operators1d::new(&direction);
            let n = line.cells;
            let width = 37;
            let (value, vector) = basis(&line);
            let fold = Fold::new(n, &vector);
            assert_eq!(fold.blocks.len(), blocks, "{direction:?}");
            let (transform, values) = LineTransform::new(&line);
            let field: Vec<f64> = (0..n * width).map(|i| (0.7 * i as f64).sin()).collect();
            let mut modes = field.clone();
            let mut rows: Vec<&mut [f64]> = modes.chunks_mut(width).collect();
            transform.apply(TransformDirection::Forward, &mut rows, &mut Work::default());
            for (at, &m) in fold.columns.iter().enumerate() {
                assert_eq!(values[at], value[m]);
                for l in 0..width {
                    let product: f64 = (0..n)
                        .map(|i| vector[i * n + m] * field[i * width + l])
                        .sum();
                    let mode = modes[at * width + l];
                    assert!(
                        (product - mode).abs() < 2e-13 * n as f64,
                        "{direction:?} mode {m}: {mode} for {product}"
                    );
                }
            }
            let mut rows: Vec<&mut [f64]> = modes.chunks_mut(width).collect();
            transform.apply(TransformDirection::Inverse, &mut rows, &mut Work::default());
            for (place, (back, given)) in modes.iter().zip(&field).enumerate() {
                let back = back * line.cell_mass_m[place / width];
                assert!(
                    (back - given).abs() < 1e-12,
                    "{direction:?}: {back} for {given}"
                );
            }
        }
    }

    #[test]
    fn the_largest_prime_factor_is_found() {
        assert_eq!(
            [1, 2, 64, 97, 98, 121, 510].map(largest_factor),
            [1, 2, 2, 97, 7, 11, 17]
        );
    }
}
