//! Detector noise: Gaussian numbers with the spectrum of shot noise, (13), real at the intermediate frequency or complex at
//! baseband.
//!
//! Band-limited noise is made from its spectrum on a circular record of at least twice the length, then cut, so that the
//! end of the record does not know its beginning. Frequencies that the edge of the band cuts have their share of the
//! power, so the variance is exact.
//!
//! Check: variance (13); nothing outside the band; flat inside.

use std::fmt;
use std::sync::Arc;

use num_complex::Complex;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use realfft::{ComplexToReal, RealFftPlanner};
use rustfft::{Fft, FftPlanner};

use crate::{NoiseModel, Receiver};

/// Buffers for the synthesis of noise.
#[derive(Debug, Default)]
pub(crate) struct NoiseScratch {
    spectrum: Vec<Complex<f64>>,
    circular: Vec<f64>,
    transform: Vec<Complex<f64>>,
}

/// Complex circular noise of one receiver about zero frequency, for records of one length.
#[derive(Clone)]
pub(crate) enum BasebandNoise {
    None,
    /// Standard deviation of each part.
    White {
        sd_a: f64,
    },
    Band {
        transform: Arc<dyn Fft<f64>>,
        /// Standard deviation of each part at the frequencies 0, 1, ... and, of the same size, at their mirrors.
        sd_a: Vec<f64>,
    },
}

/// Noise of one receiver for records of one length.
#[derive(Clone)]
pub(crate) enum NoiseSource {
    None,
    White { sd_a: f64 },
    Band(BandNoise),
}

impl fmt::Debug for NoiseSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("None"),
            Self::White { sd_a } => write!(f, "White {{ sd_a: {sd_a} }}"),
            Self::Band(band) => write!(f, "Band {{ frequencies: {} }}", band.sd_a.len()),
        }
    }
}

/// Noise synthesised from the frequencies of its band.
#[derive(Clone)]
pub(crate) struct BandNoise {
    transform: Arc<dyn ComplexToReal<f64>>,
    /// Index of the first frequency of the band.
    first: usize,
    /// Standard deviation of the real and of the imaginary part at each frequency from `first` on.
    sd_a: Vec<f64>,
}

impl NoiseSource {
    pub(crate) fn new(receiver: &Receiver, samples: usize) -> Self {
        match receiver.noise {
            NoiseModel::None => Self::None,
            NoiseModel::White => {
                let variance_a2 = receiver.noise_density_a2_hz() * 0.5 * receiver.sample_rate_hz;
                Self::White { sd_a: variance_a2.sqrt() }
            }
            NoiseModel::BandLimited => Self::Band(BandNoise::new(receiver, samples)),
        }
    }

    /// Adds the noise of one record to `out_a`.
    pub(crate) fn add_to<R: Rng + ?Sized>(&self, rng: &mut R, scratch: &mut NoiseScratch, out_a: &mut [f64]) {
        match self {
            Self::None => {}
            Self::White { sd_a } => {
                for out in out_a {
                    let normal: f64 = rng.sample(StandardNormal);
                    *out += sd_a * normal;
                }
            }
            Self::Band(band) => band.add_to(rng, scratch, out_a),
        }
    }
}

impl BandNoise {
    fn new(receiver: &Receiver, samples: usize) -> Self {
        let length = smooth_even_length(2 * samples);
        let cell_hz = receiver.sample_rate_hz / length as f64;
        let low_hz = receiver.intermediate_frequency_hz - 0.5 * receiver.bandwidth_hz;
        let high_hz = receiver.intermediate_frequency_hz + 0.5 * receiver.bandwidth_hz;
        let density = receiver.noise_density_a2_hz();
        let last = length / 2;
        let first = ((low_hz / cell_hz - 0.5).ceil().max(0.0) as usize).min(last);
        let end = ((high_hz / cell_hz + 0.5).floor() as usize).min(last);
        let sd_a = (first..=end)
            .map(|bin| {
                let centre_hz = bin as f64 * cell_hz;
                let upper = (centre_hz + 0.5 * cell_hz).min(high_hz);
                let lower = (centre_hz - 0.5 * cell_hz).max(low_hz);
                let variance_a2 = density * (upper - lower).max(0.0);
                // Inside, a frequency and its mirror give 2 Re{X}: variance 4 sd^2. The two ends have no mirror.
                if bin == 0 || bin == last { variance_a2.sqrt() } else { 0.5 * variance_a2.sqrt() }
            })
            .collect();
        let transform = RealFftPlanner::new().plan_fft_inverse(length);
        Self { transform, first, sd_a }
    }

    fn add_to<R: Rng + ?Sized>(&self, rng: &mut R, scratch: &mut NoiseScratch, out_a: &mut [f64]) {
        let length = self.transform.len();
        scratch.spectrum.clear();
        scratch.spectrum.resize(length / 2 + 1, Complex::ZERO);
        scratch.circular.resize(length, 0.0);
        scratch.transform.resize(self.transform.get_scratch_len(), Complex::ZERO);
        for (value, sd) in scratch.spectrum[self.first..].iter_mut().zip(&self.sd_a) {
            let re: f64 = rng.sample(StandardNormal);
            let im: f64 = rng.sample(StandardNormal);
            *value = Complex::new(re, im) * *sd;
        }
        scratch.spectrum[0].im = 0.0;
        scratch.spectrum[length / 2].im = 0.0;
        let done =
            self.transform.process_with_scratch(&mut scratch.spectrum, &mut scratch.circular, &mut scratch.transform);
        debug_assert!(done.is_ok(), "buffers have the lengths of the plan and the end frequencies are real");
        for (out, noise) in out_a.iter_mut().zip(&scratch.circular) {
            *out += noise;
        }
    }
}

impl fmt::Debug for BasebandNoise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("None"),
            Self::White { sd_a } => write!(f, "White {{ sd_a: {sd_a} }}"),
            Self::Band { sd_a, .. } => write!(f, "Band {{ frequencies: {} }}", 2 * sd_a.len() - 1),
        }
    }
}

impl BasebandNoise {
    pub(crate) fn new(receiver: &Receiver, samples: usize) -> Self {
        // A complex envelope has its power on both sides of zero, with the one-sided density of the real noise.
        let density = receiver.noise_density_a2_hz();
        match receiver.noise {
            NoiseModel::None => Self::None,
            NoiseModel::White => Self::White { sd_a: (0.5 * density * receiver.sample_rate_hz).sqrt() },
            NoiseModel::BandLimited => {
                let length = smooth_even_length(2 * samples);
                let cell_hz = receiver.sample_rate_hz / length as f64;
                let edge_hz = 0.5 * receiver.bandwidth_hz;
                let last = ((edge_hz / cell_hz + 0.5).floor() as usize).min(length / 2 - 1);
                let sd_a = (0..=last)
                    .map(|bin| {
                        let centre_hz = bin as f64 * cell_hz;
                        let upper_hz = (centre_hz + 0.5 * cell_hz).min(edge_hz);
                        let lower_hz = (centre_hz - 0.5 * cell_hz).max(-edge_hz);
                        (0.5 * density * (upper_hz - lower_hz).max(0.0)).sqrt()
                    })
                    .collect();
                Self::Band { transform: FftPlanner::new().plan_fft_inverse(length), sd_a }
            }
        }
    }

    /// Adds the noise of one record to `out_a`.
    pub(crate) fn add_to<R: Rng + ?Sized>(&self, rng: &mut R, scratch: &mut NoiseScratch, out_a: &mut [Complex<f64>]) {
        let mut normal = |sd_a: f64| {
            let (re, im): (f64, f64) = (rng.sample(StandardNormal), rng.sample(StandardNormal));
            Complex::new(re, im) * sd_a
        };
        match self {
            Self::None => {}
            Self::White { sd_a } => out_a.iter_mut().for_each(|out| *out += normal(*sd_a)),
            Self::Band { transform, sd_a } => {
                let length = transform.len();
                scratch.spectrum.clear();
                scratch.spectrum.resize(length, Complex::ZERO);
                scratch.transform.resize(transform.get_inplace_scratch_len(), Complex::ZERO);
                for (bin, sd_a) in sd_a.iter().enumerate() {
                    scratch.spectrum[bin] = normal(*sd_a);
                    if bin > 0 {
                        scratch.spectrum[length - bin] = normal(*sd_a);
                    }
                }
                transform.process_with_scratch(&mut scratch.spectrum, &mut scratch.transform);
                out_a.iter_mut().zip(&scratch.spectrum).for_each(|(out, noise)| *out += noise);
            }
        }
    }
}

/// Smallest even product of powers of 2, 3 and 5 that is at least `least` (and 512, so that the band of a short
/// record is resolved).
fn smooth_even_length(least: usize) -> usize {
    let mut length = least.max(512).next_multiple_of(2);
    loop {
        let mut rest: usize = length;
        for factor in [2, 3, 5] {
            while rest.is_multiple_of(factor) {
                rest /= factor;
            }
        }
        if rest == 1 {
            return length;
        }
        length += 2;
    }
}
