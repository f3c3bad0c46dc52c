//! The bound where the covariance is too near a singular one for double precision, in numbers of twice its length.
//!
//! Only for a covariance that is known beyond double precision: that of a Gaussian pulse. Check: values from 60 digits.

use num_complex::Complex;
use twofloat::TwoFloat;

use crate::window::SignalKind;

/// A number of some 31 digits.
type Long = Complex<TwoFloat>;

/// Most samples of a window for which it is done: the time grows by their cube.
const MOST_SAMPLES: usize = 256;

/// Window of the signal of a Gaussian pulse in noise that is flat in a band and small outside it.
pub(super) struct GaussianWindow {
    pub(super) samples: usize,
    /// Half-width of |f|^2 at 1/e, in periods of the samples.
    pub(super) sigma: f64,
    /// Frequency of the signal, cycles per sample.
    pub(super) cycles: f64,
    /// Derivative of the phase per sample with respect to the parameter.
    pub(super) slope: f64,
    /// Band of the noise, cycles per sample.
    pub(super) band: (f64, f64),
    /// Two-sided density of the noise in the band, where that of the samples' power is 1.
    pub(super) density: f64,
    /// Density outside the band over that inside.
    pub(super) floor: f64,
    pub(super) kind: SignalKind,
}

impl GaussianWindow {
    /// tr(R^-1 dR R^-1 dR) = |L^-1 dR L^-H|^2 with R = L L^H.
    ///
    /// None for a window that is too long, and where the smallest eigenvalue, that of the floor, is below the rounding of
    /// samples in double precision.
    pub(super) fn information(&self) -> Option<f64> {
        let smallest = self.floor * self.density * self.white_share();
        let largest = self.samples as f64 * (1.0 + self.density * (self.band.1 - self.band.0));
        if self.samples > MOST_SAMPLES || smallest < f64::EPSILON * largest {
            return None;
        }
        let (covariance, derivative): (Vec<Long>, Vec<Long>) = (0..self.samples).map(|lag| self.at_lag(lag)).unzip();
        let factor = cholesky(&covariance)?;
        let order = 0..self.samples;
        let mut whitened: Vec<Vec<Long>> =
            order.clone().map(|n| order.clone().map(|m| element(&derivative, n, m)).collect()).collect();
        for _ in 0..2 {
            solve_lower(&factor, &mut whitened);
            whitened = order.clone().map(|n| order.clone().map(|m| whitened[m][n].conj()).collect()).collect();
        }
        Some(whitened.iter().flatten().map(|value| f64::from(value.norm_sqr())).sum())
    }

    /// Share of the density that a covariance of white noise shows at lag 0: real samples carry half at negative frequencies.
    fn white_share(&self) -> f64 {
        match self.kind {
            SignalKind::Real => 0.5,
            SignalKind::Complex => 1.0,
        }
    }

    /// Covariance and its derivative.
    fn at_lag(&self, lag: usize) -> (Long, Long) {
        let steps = TwoFloat::from(lag as f64);
        let phasor = |cycles: TwoFloat, size: TwoFloat| {
            let (sine, cosine) = (twofloat::consts::TAU * (cycles - cycles.round())).sin_cos();
            Long::new(cosine * size, sine * size)
        };
        // exp of the crate is good for small arguments alone, powers are good for all
        let unit = (TwoFloat::from(-1.0 / 256.0) / (TwoFloat::from(self.sigma) * self.sigma)).exp();
        let envelope = unit.powi((64 * lag * lag) as i32);
        let signal = phasor(steps * self.cycles, envelope);
        let (low, high) = (TwoFloat::from(self.band.0), TwoFloat::from(self.band.1));
        let in_band = match lag {
            0 => Long::from(high - low),
            _ => {
                let half = phasor(steps * (high - low) * 0.5, TwoFloat::from(1.0)).im;
                phasor(steps * (high + low) * 0.5, half / (twofloat::consts::PI * steps))
            }
        };
        let white = if lag == 0 { self.white_share() * self.floor } else { 0.0 };
        let noise = in_band.scale(TwoFloat::from(1.0) - self.floor) + TwoFloat::from(white);
        let parts =
            (signal + noise.scale(TwoFloat::from(self.density)), signal * Long::new(0.0.into(), steps * self.slope));
        match self.kind {
            SignalKind::Real => (Long::from(parts.0.re), Long::from(parts.1.re)),
            SignalKind::Complex => parts,
        }
    }
}

fn element(by_lag: &[Long], n: usize, m: usize) -> Long {
    if n >= m { by_lag[n - m] } else { by_lag[m - n].conj() }
}

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
            rest[0].iter_mut().zip(solved).for_each(|(value, x)| *value -= row[m] * x);
        }
        rest[0].iter_mut().for_each(|value| *value = value.unscale(row[n].re));
    }
}
