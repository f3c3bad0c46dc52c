//! Likelihood of all raw signals of a scan, its gradient, and the Fisher information: the bound on any unbiased fit.
//!
//! The baseband z of a ray is circular Gaussian with the covariance R of its line, so that, but for a constant,
//! ln p = -ln det R - z^H R^-1 z (Frehlich and Sharman 2005), with the gradient Re tr((x x^H - R^-1) dR), x = R^-1 z, and the
//! information tr(R^-1 dR_i R^-1 dR_j) (Kay 1993, section 3.9). Rays are independent. Besides the wake there are two
//! numbers: the logarithms of the power of signal and noise over what the model states.
//! Check: against dense matrices and the plain sum over layers; the covariance of the gradient over draws is the information.

use ndarray::{Array2, ArrayView2};
use num_complex::Complex;

use crate::error::{Error, length, not_empty, positive};
use crate::linalg::dot;
use crate::parallel::{map_each, map_indexed};
use crate::vortex_fit::signal_fit::banded_cholesky::{Banded, factorize, forward, inverse_into};
use crate::vortex_fit::signal_fit::line_covariance::Work;
use crate::vortex_fit::signal_fit::scan_model::Line;
use crate::vortex_fit::{FreeParameters, PARAMETERS, ScanModel, Wake};
use crate::window::Sample;

/// Powers of signal and noise relative to the model; equal to it by default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Powers {
    /// Natural logarithm of the signal power over the SNR of the model times its unit noise power.
    pub log_signal: f64,
    /// Natural logarithm of the noise power over that by which the records were scaled.
    pub log_noise: f64,
}

/// Log-likelihood and its derivatives.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LikelihoodValue {
    /// Log-likelihood, but for a constant.
    pub log_likelihood: f64,
    /// Derivatives in the order of [`Parameter`](crate::vortex_fit::Parameter).
    pub by_wake: [f64; PARAMETERS],
    /// Derivatives with respect to the logarithms of signal and noise power.
    pub by_powers: [f64; 2],
}

/// The records of a scan in complex baseband, in units of the root of the noise power.
#[derive(Debug, Clone)]
pub struct ScanSignals {
    rays: Vec<Option<Vec<Complex<f64>>>>,
}

impl ScanSignals {
    /// From `records` \[ray, sample\], whose noise in the detector band has the power `noise_power` (mean square, in the
    /// square of the unit of the samples).
    ///
    /// Rays with a sample that is not finite are skipped.
    ///
    /// # Errors
    /// [`Error::Length`] if rays or samples are not those of the model, [`Error::OutOfRange`] for a power that is not positive,
    /// [`Error::Empty`] if no ray remains.
    pub fn new<S: Sample>(
        model: &ScanModel,
        records: ArrayView2<'_, S>,
        noise_power: f64,
    ) -> Result<Self, Error> {
        length("rays of the records", model.rays, records.nrows())?;
        length("samples of a record", model.record_samples, records.ncols())?;
        positive("noise_power", noise_power)?;
        let scale = noise_power.sqrt().recip();
        positive("1 / sqrt(noise_power)", scale)?;
        let rays = map_each(records.nrows(), |ray| {
            let samples = records.row(ray);
            let row: Vec<S> = samples.iter().map(|s| s.scaled(scale)).collect();
            if row.iter().all(|sample| sample.is_finite()) {
                model.baseband.convert(&row).map(Some)
            } else {
                Ok(None)
            }
        });
        let signals = Self {
            rays: rays.into_iter().collect::<Result<_, _>>()?,
        };
        not_empty("rays without missing samples", signals.used_rays())?;
        Ok(signals)
    }

    /// Number of rays that are used.
    #[must_use]
    pub fn used_rays(&self) -> usize {
        self.rays.iter().flatten().count()
    }
}

/// Work space of one worker.
#[derive(Debug, Default)]
struct Space {
    work: Work,
    signal: Banded,
    factor: Banded,
    inverse: Banded,
}

impl ScanModel {
    /// Log-likelihood and gradient of a wake; nothing where the model does not exist (a core without radius, or a
    /// covariance that is not positive definite).
    #[must_use]
    pub fn log_likelihood(
        &self,
        signals: &ScanSignals,
        wake: &Wake,
        powers: Powers,
    ) -> Option<LikelihoodValue> {
        wake.validate().ok()?;
        let mut sum = LikelihoodValue::default();
        // in the order of the lines, whichever thread computed them
        for line in map_indexed(self.lines.len(), Space::default, |space, index| {
            self.line_log_likelihood(&self.lines[index], signals, wake, powers, space)
        }) {
            let line = line?;
            sum.log_likelihood += line.log_likelihood;
            for (sum, slope) in sum.by_wake.iter_mut().zip(line.by_wake) {
                *sum += slope;
            }
            for (sum, slope) in sum.by_powers.iter_mut().zip(line.by_powers) {
                *sum += slope;
            }
        }
        sum.log_likelihood.is_finite().then_some(sum)
    }

    /// Log-likelihood and gradient from the rays of one line.
    fn line_log_likelihood(
        &self,
        line: &Line,
        signals: &ScanSignals,
        wake: &Wake,
        powers: Powers,
        space: &mut Space,
    ) -> Option<LikelihoodValue> {
        let mut value = LikelihoodValue::default();
        let mut rays: Vec<&Vec<Complex<f64>>> = Vec::with_capacity(line.rays.len());
        for &ray in &line.rays {
            rays.extend(signals.rays[ray].as_ref());
        }
        if rays.is_empty() {
            return Some(value);
        }
        self.covariance_into(line, wake, powers, space);
        let log_determinant = factorize(&mut space.factor)?;
        inverse_into(&space.factor, &mut space.inverse);
        // the inverse becomes the weight of the gradient: sum of x x^H - R^-1, off the diagonal for both triangles
        let weight = &mut space.inverse;
        weight.scale(-(rays.len() as f64));
        for z in rays {
            let x = solve(&space.factor, z);
            let mut quadratic = 0.0;
            for (x, z) in x.iter().zip(z) {
                quadratic += x.re * z.re + x.im * z.im;
            }
            value.log_likelihood -= log_determinant + quadratic;
            add_outer(weight, &x);
        }
        double_off_diagonal(weight);
        let signal_power = powers.log_signal.exp();
        let noise_power = powers.log_noise.exp();
        value.by_powers = [
            signal_power * product(weight, &space.signal),
            noise_power * self.noise_product(weight),
        ];
        weight.scale(signal_power);
        self.pull_back(line, weight, &mut space.work, &mut value.by_wake);
        Some(value)
    }

    /// Covariance of a line in `space.factor`, that of its signal for unit noise power in `space.signal`.
    fn covariance_into(&self, line: &Line, wake: &Wake, powers: Powers, space: &mut Space) {
        let Space {
            work,
            signal,
            factor,
            ..
        } = space;
        self.wind_into(line, wake, work);
        self.signal_into(line, work, signal);
        factor.clone_from(signal);
        factor.scale(powers.log_signal.exp());
        self.add_noise(powers.log_noise.exp(), factor);
    }

    /// Adds the covariance of noise of a power.
    fn add_noise(&self, power: f64, band: &mut Banded) {
        for column in band.re.chunks_exact_mut(band.width + 1) {
            for (element, noise) in column.iter_mut().zip(&self.noise) {
                *element += power * noise;
            }
        }
    }

    /// Sum of the weights times the covariance of the noise.
    fn noise_product(&self, weight: &Banded) -> f64 {
        let mut sum = 0.0;
        for column in weight.re.chunks_exact(weight.width + 1) {
            let mut of_column = 0.0;
            for (weight, noise) in column.iter().zip(&self.noise) {
                of_column += weight * noise;
            }
            sum += of_column;
        }
        sum
    }

    /// Fisher information \[n, n\] of all rays of the scan on the free parameters of a wake; with `powers_free` the logarithms of
    /// signal and noise power follow them.
    ///
    /// With `stride` above 1 every `stride`-th line represents all.
    ///
    /// # Errors
    /// [`Error::Linalg`] if a covariance is not positive definite; [`Error::OutOfRange`] for an impossible wake or a stride of 0.
    pub fn information(
        &self,
        wake: &Wake,
        powers: Powers,
        free: &FreeParameters,
        powers_free: bool,
        stride: usize,
    ) -> Result<Array2<f64>, Error> {
        wake.validate()?;
        positive("stride", stride as f64)?;
        let groups = groups(free, powers_free);
        let lines: Vec<&Line> = self.lines.iter().step_by(stride).collect();
        let order = groups.len();
        let mut sum = Array2::zeros((order, order));
        for of_line in map_indexed(lines.len(), Space::default, |space, index| {
            self.line_information(lines[index], wake, powers, &groups, space)
        }) {
            sum += &of_line?;
        }
        let rays: usize = lines.iter().map(|line| line.rays.len()).sum();
        Ok(sum * (self.rays as f64 / rays as f64))
    }

    /// Fisher information of the rays of one line on the free numbers.
    fn line_information(
        &self,
        line: &Line,
        wake: &Wake,
        powers: Powers,
        groups: &[Vec<usize>],
        space: &mut Space,
    ) -> Result<Array2<f64>, Error> {
        self.covariance_into(line, wake, powers, space);
        let order = space.factor.order;
        let indefinite = Error::Linalg {
            what: "covariance of a line of sight",
            order,
            reason: "is not positive definite",
        };
        factorize(&mut space.factor).ok_or(indefinite)?;
        let signal_power = powers.log_signal.exp();
        let noise_power = powers.log_noise.exp();
        let mut whitened = Vec::with_capacity(groups.len());
        for group in groups {
            let change = &mut space.inverse;
            match group[0] {
                SIGNAL => {
                    change.clone_from(&space.signal);
                    change.scale(signal_power);
                }
                NOISE => {
                    change.reset(order, space.signal.width);
                    self.add_noise(noise_power, change);
                }
                _ => self.change_into(line, &mut space.work, group, signal_power, change),
            }
            whitened.push(whiten(&space.factor, change));
        }
        let rays = line.rays.len() as f64;
        Ok(Array2::from_shape_fn(
            (groups.len(), groups.len()),
            |(i, j)| rays * dot(&whitened[i.max(j)], &whitened[i.min(j)]),
        ))
    }
}

/// Indices of the logarithms of the powers behind the parameters of the wake.
const SIGNAL: usize = PARAMETERS;
const NOISE: usize = PARAMETERS + 1;

/// The indices that change together with each free number; with `powers_free` the powers follow the wake.
pub(crate) fn groups(free: &FreeParameters, powers_free: bool) -> Vec<Vec<usize>> {
    let mut groups = free.groups();
    if powers_free {
        groups.push(vec![SIGNAL]);
        groups.push(vec![NOISE]);
    }
    groups
}

/// R^-1 z from the factor of R.
fn solve(factor: &Banded, z: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let mut re: Vec<f64> = z.iter().map(|z| z.re).collect();
    let mut im: Vec<f64> = z.iter().map(|z| z.im).collect();
    forward(factor, &mut re, &mut im, 0, z.len());
    let mut x = Vec::with_capacity(z.len());
    for (re, im) in re.iter().zip(&im) {
        x.push(Complex::new(*re, *im));
    }
    factor.backward(&mut x);
    x
}

/// band += x x^H.
fn add_outer(band: &mut Banded, x: &[Complex<f64>]) {
    for column in 0..band.order {
        let conjugate = x[column].conj();
        for down in 0..=band.width.min(band.order - 1 - column) {
            let index = band.at(column, down);
            let value = x[column + down] * conjugate;
            band.re[index] += value.re;
            band.im[index] += value.im;
        }
    }
}

/// Counts the entries below the diagonal for those above it too.
fn double_off_diagonal(band: &mut Banded) {
    let stride = band.width + 1;
    for part in [&mut band.re, &mut band.im] {
        for column in part.chunks_exact_mut(stride) {
            for element in &mut column[1..] {
                *element *= 2.0;
            }
        }
    }
}

/// Re sum of conj(a) b over the stored entries.
fn product(a: &Banded, b: &Banded) -> f64 {
    dot(&a.re, &b.re) + dot(&a.im, &b.im)
}

/// L^-1 D L^-H of a Hermitian D as real numbers whose scalar product is the trace of a product: the upper triangle, real
/// and imaginary parts, off-diagonal entries times sqrt 2.
fn whiten(factor: &Banded, d: &Banded) -> Vec<f64> {
    let n = factor.order;
    let mut half_re = vec![0.0; n * n];
    let mut half_im = vec![0.0; n * n];
    let mut re = vec![0.0; n];
    let mut im = vec![0.0; n];
    for column in 0..n {
        let first = column.saturating_sub(d.width);
        re.fill(0.0);
        im.fill(0.0);
        for row in first..column {
            let index = d.at(row, column - row);
            re[row] = d.re[index];
            im[row] = -d.im[index];
        }
        for row in column..n.min(column + d.width + 1) {
            let index = d.at(column, row - column);
            re[row] = d.re[index];
            im[row] = d.im[index];
        }
        forward(factor, &mut re, &mut im, first, n);
        // stored as the column of the adjoint
        for row in first..n {
            half_re[row * n + column] = re[row];
            half_im[row * n + column] = -im[row];
        }
    }
    let mut out = Vec::with_capacity(n * (n + 1));
    for column in 0..n {
        let re = &mut half_re[column * n..(column + 1) * n];
        let im = &mut half_im[column * n..(column + 1) * n];
        forward(factor, re, im, 0, column + 1);
        for value in re[..column].iter().chain(&im[..column]) {
            out.push(value * std::f64::consts::SQRT_2);
        }
        out.push(re[column]);
    }
    out
}

#[cfg(test)]
#[path = "likelihood_tests.rs"]
mod tests;
