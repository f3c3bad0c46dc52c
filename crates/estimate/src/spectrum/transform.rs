//! Power spectrum of one weighted, zero-padded window: the transform behind periodogram and correlogram.
//!
//! Computes |sum h(n) s(n) exp(-2 pi i k n / M)|^2. Check: against the sum written out (in `periodogram`).

use std::marker::PhantomData;
use std::sync::Arc;

use num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

use crate::window::{Sample, Scratch, SignalKind};

/// Forward and inverse transforms of one length, for real or complex samples.
#[derive(Clone)]
enum Plans {
    Real(Arc<dyn RealToComplex<f64>>, Arc<dyn ComplexToReal<f64>>),
    Complex(Arc<dyn Fft<f64>>, Arc<dyn Fft<f64>>),
}

impl Plans {
    /// Not generic, so that the planner is compiled once, with this crate, and not again by each program that names a sample type.
    fn new(kind: SignalKind, padded: usize) -> Self {
        match kind {
            SignalKind::Real => {
                let mut planner = RealFftPlanner::new();
                Self::Real(planner.plan_fft_forward(padded), planner.plan_fft_inverse(padded))
            }
            SignalKind::Complex => {
                let [forward, inverse] = complex_transforms(padded);
                Self::Complex(forward, inverse)
            }
        }
    }
}

/// The forward and the inverse transform of complex numbers; not generic either.
pub(crate) fn complex_transforms(length: usize) -> [Arc<dyn Fft<f64>>; 2] {
    let mut planner = FftPlanner::new();
    [planner.plan_fft_forward(length), planner.plan_fft_inverse(length)]
}

/// Zero-padded transform of length `padded` for samples of type `S`.
#[derive(Clone)]
pub(crate) struct WindowTransform<S> {
    plans: Plans,
    padded: usize,
    inner: usize,
    sample: PhantomData<fn(S)>,
}

impl<S: Sample> WindowTransform<S> {
    pub(crate) fn new(padded: usize) -> Self {
        let plans = Plans::new(S::KIND, padded);
        let inner = match &plans {
            Plans::Real(forward, inverse) => forward.get_scratch_len().max(inverse.get_scratch_len()),
            Plans::Complex(forward, inverse) => {
                forward.get_inplace_scratch_len().max(inverse.get_inplace_scratch_len())
            }
        };
        Self { plans, padded, inner, sample: PhantomData }
    }

    /// Transform length.
    pub(crate) fn padded(&self) -> usize {
        self.padded
    }

    /// Clears `scratch.power` to the number of distinct frequencies: half if real, all if complex.
    pub(crate) fn reset(&self, scratch: &mut Scratch) {
        let bins = match self.plans {
            Plans::Real(..) => self.padded / 2 + 1,
            Plans::Complex(..) => self.padded,
        };
        scratch.power.clear();
        scratch.power.resize(bins, 0.0);
        if scratch.transform.len() < self.inner {
            scratch.transform.resize(self.inner, Complex::ZERO);
        }
    }

    /// Adds `factor` times the power spectrum of `weights` times `window` to `scratch.power`.
    pub(crate) fn add_power(&self, window: &[S], weights: &[f64], factor: f64, scratch: &mut Scratch) {
        let weighted = window.iter().zip(weights);
        let inner = &mut scratch.transform[..self.inner];
        let spectrum = match &self.plans {
            Plans::Real(forward, _) => {
                scratch.real.clear();
                scratch.real.extend(weighted.map(|(sample, h)| sample.to_complex().re * h));
                scratch.real.resize(self.padded, 0.0);
                scratch.half.resize(self.padded / 2 + 1, Complex::ZERO);
                // the lengths fit by construction, the only error that the transform knows
                let _ = forward.process_with_scratch(&mut scratch.real, &mut scratch.half, inner);
                &scratch.half
            }
            Plans::Complex(forward, _) => {
                scratch.complex.clear();
                scratch.complex.extend(weighted.map(|(sample, h)| sample.to_complex() * h));
                scratch.complex.resize(self.padded, Complex::ZERO);
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
        let inner = &mut scratch.transform[..self.inner];
        let scaled = scratch.power.iter().map(|power| Complex::new(power / self.padded as f64, 0.0));
        match &self.plans {
            Plans::Real(_, inverse) => {
                scratch.half.clear();
                scratch.half.extend(scaled);
                scratch.real.resize(self.padded, 0.0);
                let _ = inverse.process_with_scratch(&mut scratch.half, &mut scratch.real, inner);
                let lags = out.len();
                out.copy_from_slice(&scratch.real[..lags]);
            }
            Plans::Complex(_, inverse) => {
                scratch.complex.clear();
                scratch.complex.extend(scaled);
                inverse.process_with_scratch(&mut scratch.complex, inner);
                for (pair, lag) in out.chunks_exact_mut(2).zip(&scratch.complex) {
                    pair[0] = lag.re;
                    pair[1] = lag.im;
                }
            }
        }
    }
}
