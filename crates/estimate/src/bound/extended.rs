//! The bound where the covariance is too near a singular one for double precision, in numbers of twice its length.
//!
//! Only for a covariance that is known beyond double precision: that of a Gaussian pulse. Check: values computed with 60 digits.

use num_complex::Complex;
use twofloat::TwoFloat;

use crate::window::{Sampling, SignalKind};

/// A number of some 31 digits.
type Long = Complex<TwoFloat>;

/// Most samples of a window: the time grows by their cube.
const MOST_SAMPLES: usize = 256;

/// A window of samples of a Gaussian pulse in noise.
pub(super) struct GaussianWindow<'a> {
    pub(super) sampling: &'a Sampling,
    pub(super) samples: usize,
    /// Half-width of |f|^2 at 1/e \[s\].
    pub(super) sigma_s: f64,
    /// Density of the noise outside the band over that inside.
    pub(super) floor: f64,
    pub(super) velocity_m_s: f64,
    pub(super) snr: f64,
    pub(super) kind: SignalKind,
}

impl GaussianWindow<'_> {
    /// tr(R^-1 dR R^-1 dR) = |L^-1 dR L^-H|^2 with R = L L^H.
    ///
    /// None for a window that is too long, and where the smallest eigenvalue, that of the floor, is below the rounding of
    /// samples in double precision.
    pub(super) fn information(&self) -> Option<f64> {
        let smallest = self.floor * self.density() * self.kind.one_sided_share();
        let (low, high) = self.band();
        let largest = self.samples as f64 * (1.0 + self.density() * (high - low));
        if self.samples > MOST_SAMPLES || smallest < f64::EPSILON * largest {
            return None;
        }
        let mut covariance = Vec::with_capacity(self.samples);
        let mut derivative = Vec::with_capacity(self.samples);
        for lag in 0..self.samples {
            let signal = self.signal(lag);
            let noise = self.noise(lag).scale(TwoFloat::from(self.density()));
            let steps = TwoFloat::from(lag as f64);
            let slope = Long::new(0.0.into(), steps * self.sampling.phase_slope());
            covariance.push(self.sampled(signal + noise));
            derivative.push(self.sampled(signal * slope));
        }
        let factor = cholesky(&covariance)?;
        let mut whitened = matrix(self.samples, |n, m| element(&derivative, n, m));
        for _ in 0..2 {
            solve_lower(&factor, &mut whitened);
            whitened = matrix(self.samples, |n, m| whitened[m][n].conj());
        }
        let mut information = 0.0;
        for value in whitened.iter().flatten() {
            information += f64::from(value.norm_sqr());
        }
        Some(information)
    }

    /// Edges of the band in cycles per sample.
    fn band(&self) -> (f64, f64) {
        let rate_hz = self.sampling.sample_rate_hz;
        let (low_hz, high_hz) = self.sampling.band_hz;
        (low_hz / rate_hz, high_hz / rate_hz)
    }

    /// Density of the noise in the band for signal samples of unit power.
    fn density(&self) -> f64 {
        let (low, high) = self.band();
        1.0 / (self.snr * (high - low))
    }

    /// Covariance of the signal at a lag in samples.
    fn signal(&self, lag: usize) -> Long {
        let rate_hz = self.sampling.sample_rate_hz;
        let sigma = self.sigma_s * rate_hz;
        let cycles = self.sampling.frequency_hz(self.velocity_m_s) / rate_hz;
        // exp of the crate is accurate for small arguments only, powers are for all
        let unit = (TwoFloat::from(-1.0 / 256.0) / (TwoFloat::from(sigma) * sigma)).exp();
        let steps = TwoFloat::from(lag as f64);
        phasor(steps * cycles, unit.powi((64 * lag * lag) as i32))
    }

    /// Covariance of noise of unit density in the band at a lag in samples.
    fn noise(&self, lag: usize) -> Long {
        let (low, high) = self.band();
        let low = TwoFloat::from(low);
        let high = TwoFloat::from(high);
        let steps = TwoFloat::from(lag as f64);
        let mut in_band = Long::from(high - low);
        let mut white = self.kind.one_sided_share() * self.floor;
        if lag > 0 {
            let half = phasor(steps * (high - low) * 0.5, TwoFloat::from(1.0)).im;
            let size = half / (twofloat::consts::PI * steps);
            in_band = phasor(steps * (high + low) * 0.5, size);
            white = 0.0;
        }
        in_band.scale(TwoFloat::from(1.0) - self.floor) + TwoFloat::from(white)
    }

    /// The part of a covariance that samples of this kind have.
    fn sampled(&self, value: Long) -> Long {
        match self.kind {
            SignalKind::Real => Long::from(value.re),
            SignalKind::Complex => value,
        }
    }
}

/// size exp(2 pi i cycles).
fn phasor(cycles: TwoFloat, size: TwoFloat) -> Long {
    let angle = twofloat::consts::TAU * (cycles - cycles.round());
    let (sine, cosine) = angle.sin_cos();
    Long::new(cosine * size, sine * size)
}

/// A square matrix from its elements.
fn matrix(order: usize, value_at: impl Fn(usize, usize) -> Long) -> Vec<Vec<Long>> {
    let mut rows = Vec::with_capacity(order);
    for n in 0..order {
        rows.push((0..order).map(|m| value_at(n, m)).collect());
    }
    rows
}

/// Element of a Hermitian Toeplitz matrix from its first column.
fn element(by_lag: &[Long], n: usize, m: usize) -> Long {
    if n >= m {
        by_lag[n - m]
    } else {
        by_lag[m - n].conj()
    }
}

/// The lower factor of a Hermitian Toeplitz matrix; none unless it is positive definite.
fn cholesky(by_lag: &[Long]) -> Option<Vec<Vec<Long>>> {
    let mut factor: Vec<Vec<Long>> = Vec::with_capacity(by_lag.len());
    for n in 0..by_lag.len() {
        let mut row: Vec<Long> = Vec::with_capacity(n + 1);
        for m in 0..=n {
            let other = if m == n { &row } else { &factor[m] };
            let product: Long = row[..m].iter().zip(other).map(|(a, b)| a * b.conj()).sum();
            let rest = element(by_lag, n, m) - product;
            row.push(if m == n {
                let pivot = rest.re;
                if pivot <= TwoFloat::from(0.0) {
                    return None;
                }
                Complex::from(pivot.sqrt())
            } else {
                rest.unscale(factor[m][m].re)
            });
        }
        factor.push(row);
    }
    Some(factor)
}

/// Replaces each column x by L^-1 x.
fn solve_lower(factor: &[Vec<Long>], columns: &mut [Vec<Long>]) {
    for (n, row) in factor.iter().enumerate() {
        let (done, rest) = columns.split_at_mut(n);
        for (m, solved) in done.iter().enumerate() {
            for (value, x) in rest[0].iter_mut().zip(solved) {
                *value -= row[m] * x;
            }
        }
        for value in &mut rest[0] {
            *value = value.unscale(row[n].re);
        }
    }
}
