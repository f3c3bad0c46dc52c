//! The bound where the covariance is too near a singular one for double precision, in numbers of twice its length.
//!
//! Only for a covariance that is known beyond double precision: that of a Gaussian pulse. Check: values from 60 digits.

use num_complex::Complex;
use twofloat::TwoFloat;

use crate::window::{Sampling, SignalKind};

/// A number of some 31 digits.
type Long = Complex<TwoFloat>;

/// Most samples of a window for which it is done: the time grows by their cube.
const MOST_SAMPLES: usize = 256;

/// tr(R^-1 dR R^-1 dR) = |L^-1 dR L^-H|^2 with R = L L^H, of a window of so many samples of a Gaussian pulse of that half-width
/// \[s\] of |f|^2 at 1/e, in noise with `floor` times its density outside the band.
///
/// None for a window that is too long, and where the smallest eigenvalue, that of the floor, is below the rounding of
/// samples in double precision.
pub(super) fn information(
    (sampling, samples, sigma_s): (&Sampling, usize, f64),
    floor: f64,
    velocity_m_s: f64,
    snr: f64,
    kind: SignalKind,
) -> Option<f64> {
    let rate_hz = sampling.sample_rate_hz;
    let (low, high) = (sampling.band_hz.0 / rate_hz, sampling.band_hz.1 / rate_hz);
    // density of the noise in the band, where that of the samples' power is 1
    let density = 1.0 / (snr * (high - low));
    let smallest = floor * density * kind.one_sided_share();
    let largest = samples as f64 * (1.0 + density * (high - low));
    if samples > MOST_SAMPLES || smallest < f64::EPSILON * largest {
        return None;
    }
    let (sigma, cycles) = (
        sigma_s * rate_hz,
        sampling.frequency_hz(velocity_m_s) / rate_hz,
    );
    let slope = sampling.phase_slope();
    let phasor = |cycles: TwoFloat, size: TwoFloat| {
        let (sine, cosine) = (twofloat::consts::TAU * (cycles - cycles.round())).sin_cos();
        Long::new(cosine * size, sine * size)
    };
    // exp of the crate is good for small arguments alone, powers are good for all
    let unit = (TwoFloat::from(-1.0 / 256.0) / (TwoFloat::from(sigma) * sigma)).exp();
    let (low, high) = (TwoFloat::from(low), TwoFloat::from(high));
    // covariance and its derivative
    let at_lag = |lag: usize| {
        let steps = TwoFloat::from(lag as f64);
        let signal = phasor(steps * cycles, unit.powi((64 * lag * lag) as i32));
        let (in_band, white) = match lag {
            0 => (Long::from(high - low), kind.one_sided_share() * floor),
            _ => {
                let half = phasor(steps * (high - low) * 0.5, TwoFloat::from(1.0)).im;
                (
                    phasor(
                        steps * (high + low) * 0.5,
                        half / (twofloat::consts::PI * steps),
                    ),
                    0.0,
                )
            }
        };
        let noise = in_band.scale(TwoFloat::from(1.0) - floor) + TwoFloat::from(white);
        let parts = (
            signal + noise.scale(TwoFloat::from(density)),
            signal * Long::new(0.0.into(), steps * slope),
        );
        match kind {
            SignalKind::Real => (Long::from(parts.0.re), Long::from(parts.1.re)),
            SignalKind::Complex => parts,
        }
    };
    let (covariance, derivative): (Vec<Long>, Vec<Long>) = (0..samples).map(at_lag).unzip();
    let factor = cholesky(&covariance)?;
    let square = |of: &dyn Fn(usize, usize) -> Long| -> Vec<Vec<Long>> {
        (0..samples)
            .map(|n| (0..samples).map(|m| of(n, m)).collect())
            .collect()
    };
    let mut whitened = square(&|n, m| element(&derivative, n, m));
    for _ in 0..2 {
        solve_lower(&factor, &mut whitened);
        whitened = square(&|n, m| whitened[m][n].conj());
    }
    Some(
        whitened
            .iter()
            .flatten()
            .map(|value| f64::from(value.norm_sqr()))
            .sum(),
    )
}

fn element(by_lag: &[Long], n: usize, m: usize) -> Long {
    if n >= m {
        by_lag[n - m]
    } else {
        by_lag[m - n].conj()
    }
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
            rest[0]
                .iter_mut()
                .zip(solved)
                .for_each(|(value, x)| *value -= row[m] * x);
        }
        rest[0]
            .iter_mut()
            .for_each(|value| *value = value.unscale(row[n].re));
    }
}
