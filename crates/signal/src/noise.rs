//! Detector noise: Gaussian numbers with the spectrum of shot noise, (13), real at the intermediate
//! frequency or complex at baseband.
//!
//! Band-limited noise is made from its spectrum on a circular record of at least twice the length,
//! then cut, so that the end of the record is not correlated with its beginning. Frequencies at the
//! edge of the band have the power of the fraction inside, so the variance is exact.
//!
//! Check: variance (13); nothing outside the band; flat inside.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use realfft::{ComplexToReal, RealFftPlanner};
use rustfft::{Fft, FftPlanner};

use crate::{NoiseModel, Receiver};

/// Buffers for the synthesis of noise.
#[derive(Debug, Default)]
pub struct NoiseScratch {
    spectrum: Vec<Complex<f64>>,
    circular: Vec<f64>,
    transform: Vec<Complex<f64>>,
}

/// Noise of one receiver for records of one length; `T` is the transform from its spectrum.
pub(crate) enum Noise<T: ?Sized> {
    None,
    /// Standard deviation of a sample, or of each part of a complex one.
    White {
        sd_a: f64,
    },
    Band {
        transform: Arc<T>,
        /// Index of the first frequency of the band.
        first: usize,
        /// Standard deviation of the real and of the imaginary part at each frequency
        /// from `first` on.
        sd_a: Vec<f64>,
    },
}

/// Noise of the measured current, at the intermediate frequency.
pub(crate) type RealNoise = Noise<dyn ComplexToReal<f64>>;

/// Complex circular noise about zero frequency.
pub(crate) type BasebandNoise = Noise<dyn Fft<f64>>;

impl<T: ?Sized> Noise<T> {
    /// Noise in the detector's bandwidth about `centre_hz`: either part at a frequency has the
    /// variance `fraction` times the one-sided density. `last` is the last frequency of a record of
    /// the given length, `plan` its transform.
    fn planned(
        receiver: &Receiver,
        samples: usize,
        centre_hz: f64,
        fraction: f64,
        last: fn(usize) -> usize,
        plan: impl FnOnce(usize) -> Arc<T>,
    ) -> Self {
        let density_a2_hz = receiver.noise_density_a2_hz();
        match receiver.noise {
            NoiseModel::None => Self::None,
            NoiseModel::White => Self::White {
                sd_a: (0.5 * density_a2_hz * receiver.sample_rate_hz).sqrt(),
            },
            NoiseModel::BandLimited => {
                let length = smooth_even_length(2 * samples);
                let cell_hz = receiver.sample_rate_hz / length as f64;
                let low_hz = centre_hz - 0.5 * receiver.bandwidth_hz;
                let high_hz = centre_hz + 0.5 * receiver.bandwidth_hz;
                let first = ((low_hz / cell_hz - 0.5).ceil().max(0.0) as usize).min(last(length));
                let end = ((high_hz / cell_hz + 0.5).floor() as usize).min(last(length));
                let mut sd_a = Vec::new();
                for cell in first..=end {
                    let from_hz = cell as f64 * cell_hz - 0.5 * cell_hz;
                    let to_hz = cell as f64 * cell_hz + 0.5 * cell_hz;
                    let width_hz = (to_hz.min(high_hz) - from_hz.max(low_hz)).max(0.0);
                    sd_a.push((fraction * density_a2_hz * width_hz).sqrt());
                }
                Self::Band {
                    transform: plan(length),
                    first,
                    sd_a,
                }
            }
        }
    }
}

impl<T: ?Sized> Noise<T> {
    /// Covariance of samples `lag` apart, for each lag below `lags`; it is real for both kinds of
    /// noise. `length` is that of the transform; `white` and `edge` are the factors of `sd_a^2` in
    /// the variance of white noise and at zero frequency, which has no mirror.
    fn covariance_with(
        &self,
        lags: usize,
        length: fn(&T) -> usize,
        white: f64,
        edge: f64,
    ) -> Vec<f64> {
        let mut covariance_a2 = vec![0.0; lags];
        match self {
            Self::None => {}
            Self::White { sd_a } => {
                if let Some(variance_a2) = covariance_a2.first_mut() {
                    *variance_a2 = white * sd_a * sd_a;
                }
            }
            Self::Band {
                transform,
                first,
                sd_a,
            } => {
                let length = length(transform);
                for (lag, sum_a2) in covariance_a2.iter_mut().enumerate() {
                    for (cell, sd_a) in (*first..).zip(sd_a) {
                        let factor = if cell == 0 { edge } else { 4.0 };
                        let turns = (cell * lag % length) as f64 / length as f64;
                        *sum_a2 += factor * sd_a * sd_a * (2.0 * PI * turns).cos();
                    }
                }
            }
        }
        covariance_a2
    }
}

impl RealNoise {
    /// Covariance of samples at each lag below `lags` \[A^2\].
    pub(crate) fn covariance_a2(&self, lags: usize) -> Vec<f64> {
        self.covariance_with(lags, |transform| transform.len(), 1.0, 4.0)
    }

    /// A frequency and its mirror give 2 Re{X}: variance 4 sd^2.
    pub(crate) fn new(receiver: &Receiver, samples: usize) -> Self {
        Self::planned(
            receiver,
            samples,
            receiver.intermediate_frequency_hz,
            0.25,
            |length| length / 2,
            |length| RealFftPlanner::new().plan_fft_inverse(length),
        )
    }

    /// Adds the noise of one record to `out_a`.
    pub(crate) fn add_to<R: Rng + ?Sized>(
        &self,
        rng: &mut R,
        scratch: &mut NoiseScratch,
        out_a: &mut [f64],
    ) {
        match self {
            Self::None => {}
            Self::White { sd_a } => {
                out_a
                    .iter_mut()
                    .for_each(|out| *out += sd_a * rng.sample::<f64, _>(StandardNormal));
            }
            Self::Band {
                transform,
                first,
                sd_a,
            } => {
                let NoiseScratch {
                    spectrum,
                    circular,
                    transform: work,
                } = scratch;
                let length = transform.len();
                spectrum.clear();
                spectrum.resize(length / 2 + 1, Complex::ZERO);
                circular.resize(length, 0.0);
                work.resize(transform.get_scratch_len(), Complex::ZERO);
                spectrum[*first..]
                    .iter_mut()
                    .zip(sd_a)
                    .for_each(|(value, sd_a)| *value = normal(rng, *sd_a));
                // The two ends have no mirror.
                for end in [0, length / 2] {
                    spectrum[end] = Complex::new(2.0 * spectrum[end].re, 0.0);
                }
                let done = transform.process_with_scratch(spectrum, circular, work);
                debug_assert!(
                    done.is_ok(),
                    "buffers have the lengths of the plan and the end frequencies are real"
                );
                out_a
                    .iter_mut()
                    .zip(circular)
                    .for_each(|(out, noise)| *out += *noise);
            }
        }
    }
}

impl BasebandNoise {
    /// Covariance of samples at each lag below `lags` \[A^2\].
    pub(crate) fn covariance_a2(&self, lags: usize) -> Vec<f64> {
        self.covariance_with(lags, |transform| transform.len(), 2.0, 2.0)
    }

    /// A complex envelope has its power on both sides of zero, with the one-sided density of
    /// the real noise.
    pub(crate) fn new(receiver: &Receiver, samples: usize) -> Self {
        Self::planned(
            receiver,
            samples,
            0.0,
            0.5,
            |length| length / 2 - 1,
            |length| FftPlanner::new().plan_fft_inverse(length),
        )
    }

    /// Adds the noise of one record to `out_a`.
    pub(crate) fn add_to<R: Rng + ?Sized>(
        &self,
        rng: &mut R,
        scratch: &mut NoiseScratch,
        out_a: &mut [Complex<f64>],
    ) {
        match self {
            Self::None => {}
            Self::White { sd_a } => out_a.iter_mut().for_each(|out| *out += normal(rng, *sd_a)),
            Self::Band {
                transform,
                first,
                sd_a,
            } => {
                let NoiseScratch {
                    spectrum,
                    transform: work,
                    ..
                } = scratch;
                let length = transform.len();
                spectrum.clear();
                spectrum.resize(length, Complex::ZERO);
                work.resize(transform.get_inplace_scratch_len(), Complex::ZERO);
                for (cell, sd_a) in (*first..).zip(sd_a) {
                    spectrum[cell] = normal(rng, *sd_a);
                    if cell > 0 {
                        spectrum[length - cell] = normal(rng, *sd_a);
                    }
                }
                transform.process_with_scratch(spectrum, work);
                out_a
                    .iter_mut()
                    .zip(spectrum)
                    .for_each(|(out, noise)| *out += *noise);
            }
        }
    }
}

/// A complex number whose parts have the standard deviation `sd_a`.
fn normal<R: Rng + ?Sized>(rng: &mut R, sd_a: f64) -> Complex<f64> {
    let re: f64 = rng.sample(StandardNormal);
    let im: f64 = rng.sample(StandardNormal);
    Complex::new(re, im) * sd_a
}

/// Smallest even product of powers of 2, 3 and 5 that is at least `least` (and 512, so that the
/// band of a short record is resolved).
fn smooth_even_length(least: usize) -> usize {
    (least.max(512).next_multiple_of(2)..)
        .step_by(2)
        .find(|&length| is_smooth(length))
        .unwrap_or(least)
}

/// Whether a number is a product of powers of 2, 3 and 5.
fn is_smooth(number: usize) -> bool {
    let mut rest = number;
    for factor in [2, 3, 5] {
        while rest.is_multiple_of(factor) {
            rest /= factor;
        }
    }
    rest == 1
}
