//! Power spectrum of zero-padded samples and its inverse transform to lags: the transform behind every correlogram.
//!
//! Computes |sum s(n) exp(-2 pi i k n / M)|^2 of weighted samples s. Check: correlograms and spectra against the sums written out.

use std::sync::Arc;

use num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

use crate::window::{Scratch, SignalKind};

/// The forward and the inverse transform of complex numbers.
pub(crate) fn complex_transforms(length: usize) -> [Arc<dyn Fft<f64>>; 2] {
    let mut planner = FftPlanner::new();
    [
        planner.plan_fft_forward(length),
        planner.plan_fft_inverse(length),
    ]
}

/// Forward and inverse transforms of one length, for real or complex samples that zeros fill up to
/// that length.
#[derive(Clone)]
pub(crate) enum WindowTransform {
    Real(Arc<dyn RealToComplex<f64>>, Arc<dyn ComplexToReal<f64>>),
    Complex([Arc<dyn Fft<f64>>; 2]),
}

impl WindowTransform {
    pub(crate) fn new(kind: SignalKind, padded: usize) -> Self {
        match kind {
            SignalKind::Real => {
                let mut planner = RealFftPlanner::new();
                let forward = planner.plan_fft_forward(padded);
                Self::Real(forward, planner.plan_fft_inverse(padded))
            }
            SignalKind::Complex => Self::Complex(complex_transforms(padded)),
        }
    }

    /// Length of the transforms.
    fn padded(&self) -> usize {
        match self {
            Self::Real(forward, _) => forward.len(),
            Self::Complex([forward, _]) => forward.len(),
        }
    }

    /// Length of the buffer that both transforms need.
    fn inner(&self) -> usize {
        match self {
            Self::Real(forward, inverse) => {
                forward.get_scratch_len().max(inverse.get_scratch_len())
            }
            Self::Complex(both) => both[0]
                .get_inplace_scratch_len()
                .max(both[1].get_inplace_scratch_len()),
        }
    }

    /// Number of distinct frequencies: half if real, all if complex.
    pub(crate) fn frequencies(&self) -> usize {
        match self {
            Self::Real(..) => self.padded() / 2 + 1,
            Self::Complex(..) => self.padded(),
        }
    }

    /// Clears `scratch.power` to the number of frequencies.
    pub(crate) fn reset(&self, scratch: &mut Scratch) {
        scratch.power.clear();
        scratch.power.resize(self.frequencies(), 0.0);
        scratch
            .transform
            .resize(self.inner().max(scratch.transform.len()), Complex::ZERO);
    }

    /// Adds `factor` times the power spectrum of `samples` to `scratch.power`; real transforms take the real parts.
    pub(crate) fn add_power(
        &self,
        samples: impl Iterator<Item = Complex<f64>>,
        factor: f64,
        scratch: &mut Scratch,
    ) {
        let padded = self.padded();
        let inner = &mut scratch.transform[..self.inner()];
        let spectrum = match self {
            Self::Real(forward, _) => {
                scratch.real.clear();
                scratch.real.extend(samples.map(|sample| sample.re));
                scratch.real.resize(padded, 0.0);
                scratch.half.resize(padded / 2 + 1, Complex::ZERO);
                // the lengths fit by construction, the only error that the transform knows
                let _ = forward.process_with_scratch(&mut scratch.real, &mut scratch.half, inner);
                &scratch.half
            }
            Self::Complex([forward, _]) => {
                scratch.complex.clear();
                scratch.complex.extend(samples);
                scratch.complex.resize(padded, Complex::ZERO);
                forward.process_with_scratch(&mut scratch.complex, inner);
                &scratch.complex
            }
        };
        for (power, value) in scratch.power.iter_mut().zip(spectrum) {
            *power += factor * value.norm_sqr();
        }
    }

    /// Inverse transform of `scratch.power`, its first lags written to `out` (as `SignalKind::lag_numbers` says).
    pub(crate) fn lags_of_power(&self, scratch: &mut Scratch, out: &mut [f64]) {
        let padded = self.padded();
        let inner = &mut scratch.transform[..self.inner()];
        let scaled = scratch
            .power
            .iter()
            .map(|power| Complex::new(power / padded as f64, 0.0));
        match self {
            Self::Real(_, inverse) => {
                scratch.half.clear();
                scratch.half.extend(scaled);
                scratch.real.resize(padded, 0.0);
                let _ = inverse.process_with_scratch(&mut scratch.half, &mut scratch.real, inner);
                out.copy_from_slice(&scratch.real[..out.len()]);
            }
            Self::Complex([_, inverse]) => {
                scratch.complex.clear();
                scratch.complex.extend(scaled);
                inverse.process_with_scratch(&mut scratch.complex, inner);
                for (pair, lag) in out.as_chunks_mut::<2>().0.iter_mut().zip(&scratch.complex) {
                    *pair = [lag.re, lag.im];
                }
            }
        }
    }
}
