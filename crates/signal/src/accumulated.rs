//! Products of samples, summed over the records of many pulses, drawn at once and exactly.
//!
//! With one wind and one efficiency for all pulses, records are independent zero-mean Gaussian
//! vectors `x` with the covariance `S` of signal and noise, and `W = sum x x*` over `n` records is
//! Wishart-distributed. With `S = L L*` it is `W = (L B)(L B)*`, where `B` is lower triangular with
//! independent elements (Bartlett 1933; complex: Goodman 1963): below the diagonal normal numbers
//! of mean square 1, on it, counted from 0, the root of the sum of the squares of `n - i` of them.
//! For fewer records than rows `B` has `n` columns.
//!
//! `L` is Cholesky's factor with diagonal pivots (Higham 1990), which ends where all variances that
//! are left are round-off: a band-limited record has fewer degrees of freedom than samples, and `L`
//! as many columns.
//!
//! Check: the covariance against records; means, variances and covariances of the products against
//! the moments of the Wishart distribution.

use ndarray::linalg::general_mat_mul;
use ndarray::{Array2, ArrayView2, s};
use num_complex::ComplexFloat;
use rand::Rng;

use crate::error::check;
use crate::{Error, Sample, Shot, Simulator};

/// Columns of a block of the matrix products.
const BLOCK: usize = 64;

/// Variance of a sample given others, over its variance and the number of samples, that is taken
/// for zero; more than this below zero is no round-off.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

impl Simulator {
    /// The covariance `E{x_m x_n*}` of the samples of a record with its noise and the echo of the
    /// previous pulse \[A^2\]; row m, column n, Hermitian.
    ///
    /// # Errors
    /// As [`Simulator::covariance_a2`]; [`Error::OutOfRange`] for a linewidth of the laser or a
    /// reflex of the telescope, whose records are not Gaussian.
    pub fn record_covariance_a2<'a, T: Sample>(
        &self,
        shot: impl Into<Shot<'a>>,
    ) -> Result<Array2<T>, Error> {
        let front = &self.receiver().front_end;
        let allowed = "0 where products of samples are drawn at once";
        check("linewidth_hz", front.linewidth_hz, allowed, |v| v == 0.0)?;
        check("reflection", front.reflection, allowed, |v| v == 0.0)?;
        T::check_band(self.receiver())?;
        let shot = shot.into();
        let mut envelope_a2 = self.covariance_a2(shot)?;
        if let Some(previous) = shot.previous {
            envelope_a2 += &self.covariance_a2(previous)?;
        }
        let noise_a2 = T::noise_covariance_a2(self.detector(), envelope_a2.nrows());
        Ok(Array2::from_shape_fn(envelope_a2.dim(), |(m, n)| {
            let noise = T::one().scaled(noise_a2[m.abs_diff(n)]);
            T::covariance_a2(self.detector(), m, n, envelope_a2[(m, n)]) + noise
        }))
    }
}

/// Draws products of the samples of many records along one line of sight, summed over the records.
#[derive(Debug, Clone)]
pub struct AccumulatedProducts<T> {
    /// `L` \[sample, column\], A.
    factor_a: Array2<T>,
}

impl<T: Sample> AccumulatedProducts<T> {
    /// Prepares the draws for the records of a shot.
    ///
    /// # Errors
    /// As [`Simulator::record_covariance_a2`]; [`Error::NotPositiveDefinite`].
    pub fn new<'a>(simulator: &Simulator, shot: impl Into<Shot<'a>>) -> Result<Self, Error> {
        Self::from_covariance(simulator.record_covariance_a2(shot)?)
    }

    /// Prepares the draws for a Hermitian covariance \[A^2\].
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`].
    pub fn from_covariance(mut covariance_a2: Array2<T>) -> Result<Self, Error> {
        let sd_a = normalise(&mut covariance_a2);
        let mut factor_a = factor(&covariance_a2)?;
        for (mut row, sd_a) in factor_a.rows_mut().into_iter().zip(sd_a) {
            row.mapv_inplace(|value| value.scaled(sd_a));
        }
        Ok(Self { factor_a })
    }

    /// Samples of a record.
    pub fn samples(&self) -> usize {
        self.factor_a.nrows()
    }

    /// Draws `sum x_(k+lag) x_k*` over so many records into row k, column lag \[A^2\]; zero where
    /// the record ends before k + lag. As many columns, as many lags.
    ///
    /// The random numbers that it takes depend on the number of records; one stream gives one
    /// result, bit for bit, whatever the number of lags.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`] unless `out_a2` has one row for each sample.
    pub fn draw_into<R: Rng + ?Sized>(
        &self,
        records: usize,
        rng: &mut R,
        out_a2: &mut Array2<T>,
    ) -> Result<(), Error> {
        crate::error::check_length("out_a2", out_a2.nrows(), self.samples())?;
        let triangle = draw_triangle(self.factor_a.ncols(), records, rng);
        let product_a = times_triangle(self.factor_a.view(), triangle.view());
        out_a2.fill(T::zero());
        sum_lags(product_a.view(), out_a2);
        Ok(())
    }
}

/// Divides a covariance by the standard deviations, which it returns; rows without variance stay.
fn normalise<T: Sample>(covariance: &mut Array2<T>) -> Vec<f64> {
    let mut sd = Vec::with_capacity(covariance.nrows());
    for variance in covariance.diag() {
        sd.push(variance.re().max(0.0).sqrt());
    }
    for ((m, n), value) in covariance.indexed_iter_mut() {
        let scale = sd[m] * sd[n];
        if scale > 0.0 {
            *value = value.scaled(1.0 / scale);
        }
    }
    sd
}

/// Factor \[row, column\] of a covariance of numbers of variance 1, its columns in the order of the
/// pivots. Each pivot is the largest variance that is left.
fn factor<T: Sample>(covariance: &Array2<T>) -> Result<Array2<T>, Error> {
    let rows = covariance.nrows();
    let limit = ROUND_OFF * rows as f64;
    let mut left: Vec<f64> = covariance.diag().iter().map(|v| v.re()).collect();
    let mut factor = Array2::zeros((rows, rows));
    for column in 0..rows {
        if let Some(sample) = left.iter().position(|v| *v < -limit || v.is_nan()) {
            return Err(Error::NotPositiveDefinite { sample });
        }
        let pivot = largest(&left);
        if left[pivot] <= limit {
            return Ok(factor.slice_move(s![.., ..column]));
        }
        let scale = 1.0 / left[pivot].sqrt();
        let (before, mut current) = factor.multi_slice_mut((s![.., ..column], s![.., column]));
        let known = before.row(pivot).mapv(ComplexFloat::conj);
        let explained = before.dot(&known);
        for (row, value) in current.indexed_iter_mut() {
            let entry = covariance[(row, pivot)] - explained[row];
            *value = entry.scaled(scale);
            left[row] -= value.abs().powi(2);
        }
        left[pivot] = 0.0;
    }
    Ok(factor)
}

/// Index of the largest number, the first of equal ones.
fn largest(values: &[f64]) -> usize {
    let mut best = 0;
    for (index, value) in values.iter().enumerate() {
        if *value > values[best] {
            best = index;
        }
    }
    best
}

/// Bartlett's triangle \[row, column\] for so many records, drawn row after row.
fn draw_triangle<T: Sample, R: Rng + ?Sized>(
    rows: usize,
    records: usize,
    rng: &mut R,
) -> Array2<T> {
    let columns = rows.min(records);
    let mut triangle = Array2::zeros((rows, columns));
    for row in 0..rows {
        for column in 0..row.min(columns) {
            triangle[(row, column)] = T::normal(rng);
        }
        if row < columns {
            triangle[(row, row)] = T::root_of_squares(records - row, rng);
        }
    }
    triangle
}

/// `L B` for a lower triangle `B`, without its zeros, block by block.
fn times_triangle<T: Sample>(factor: ArrayView2<'_, T>, triangle: ArrayView2<'_, T>) -> Array2<T> {
    let columns = triangle.ncols();
    let mut product = Array2::zeros((factor.nrows(), columns));
    for start in (0..columns).step_by(BLOCK) {
        let end = (start + BLOCK).min(columns);
        general_mat_mul(
            T::one(),
            &factor.slice(s![.., start..]),
            &triangle.slice(s![start.., start..end]),
            T::zero(),
            &mut product.slice_mut(s![.., start..end]),
        );
    }
    product
}

/// `sum_c M_(k+lag,c) M_(k,c)*` for each lag, block by block; blocks lie where they do for any
/// number of lags, so that an element has the same bits in all of them.
fn sum_lags<T: Sample>(product: ArrayView2<'_, T>, out: &mut Array2<T>) {
    let samples = product.nrows();
    let lags = out.ncols();
    for start in (0..samples).step_by(BLOCK) {
        let end = (start + BLOCK).min(samples);
        let last = (end + lags).min(samples + 1) - 1;
        let conjugate = product.slice(s![start..end, ..]).mapv(ComplexFloat::conj);
        for ahead in (start..last).step_by(BLOCK) {
            let ahead_end = (ahead + BLOCK).min(samples);
            let sums = product.slice(s![ahead..ahead_end, ..]).dot(&conjugate.t());
            for ((row, column), sum) in sums.indexed_iter() {
                let k = start + column;
                let sample = ahead + row;
                if sample >= k && sample - k < lags {
                    out[(k, sample - k)] = *sum;
                }
            }
        }
    }
}
