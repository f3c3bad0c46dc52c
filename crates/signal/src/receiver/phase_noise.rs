//! Phase noise of a laser with a Lorentzian line: its effect on velocities, and random
//! phases that have it.
//!
//! The phase is a random walk that spreads by `2 pi dnu` a second; the beat has that of the local
//! oscillator less that of the pulse, which left the laser earlier. Check: the stored table;
//! velocities of a simulated point target.

use std::f64::consts::PI;

use num_complex::Complex;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// Standard deviation \[m/s\] of the mean frequency of a still point target over `window_s`, when
/// its light comes back after `delay_s`: `(lambda/2) sqrt(dnu min(delay, T)/(pi T^2))`.
pub fn mean_frequency_sd_m_s(
    wavelength_m: f64,
    linewidth_hz: f64,
    delay_s: f64,
    window_s: f64,
) -> f64 {
    0.5 * wavelength_m * (linewidth_hz * delay_s.min(window_s) / PI).sqrt() / window_s
}

/// How much larger the variance of the peak of a spectrum is than that of the mean frequency, for
/// light that comes back after more than the window: `T int K^2 dt`, `K(t)` the integral of `h s`
/// from t to the end over that of `h s^2`. 6/5 for `h` = 1, 1.685 for a Hann window.
///
/// `weight` is the window as a function of position, -1/2 to 1/2.
pub fn peak_variance_factor(weight: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 20_000;
    let step = 1.0 / f64::from(STEPS);
    let mut first = 0.0;
    let mut second = 0.0;
    let mut squares = 0.0;
    for i in (0..STEPS).rev() {
        let s = (f64::from(i) + 0.5) * step - 0.5;
        let moment = weight(s) * s * step;
        // The integral from the middle of the step.
        let tail: f64 = first + 0.5 * moment;
        squares += tail * tail * step;
        first += moment;
        second += moment * s;
    }
    squares / (second * second)
}

/// Writes `exp(j phase)` of a random walk, one value every `step_s`, the first at phase 0.
pub(crate) fn walk<R: Rng + ?Sized>(
    linewidth_hz: f64,
    step_s: f64,
    rng: &mut R,
    out: &mut [Complex<f64>],
) {
    let step_rad = (2.0 * PI * linewidth_hz * step_s).sqrt();
    let mut phase_rad = 0.0;
    for turn in out {
        *turn = Complex::cis(phase_rad);
        let normal: f64 = rng.sample(StandardNormal);
        phase_rad += step_rad * normal;
    }
}
