//! Real and complex samples behind one trait, and the work space that the caller owns.
//!
//! Check: scaling is exact because scales are powers of two, so amplitudes of 1e-200 and 1e200 keep
//! their velocity to the last bit.

use crate::autoregressive::Autoregression;
use num_complex::Complex;
use std::fmt;

/// Whether samples are real (intermediate frequency) or complex (analytic signal or baseband).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SignalKind {
    /// Real samples; the spectrum is even and only frequencies 0 .. F_s/2 count.
    Real,
    /// Complex samples; frequencies -F_s/2 .. F_s/2 are distinct.
    Complex,
}

impl SignalKind {
    /// How many `f64` hold `lags` lags of a correlogram: one each if real, (re, im) pairs if complex.
    #[must_use]
    pub fn lag_numbers(self, lags: usize) -> usize {
        match self {
            Self::Real => lags,
            Self::Complex => 2 * lags,
        }
    }

    /// Lag `index` out of a stored correlogram.
    pub(crate) fn lag(self, numbers: &[f64], index: usize) -> Complex<f64> {
        match self {
            Self::Real => Complex::new(numbers[index], 0.0),
            Self::Complex => Complex::new(numbers[2 * index], numbers[2 * index + 1]),
        }
    }
}

impl fmt::Display for SignalKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Real => "real",
            Self::Complex => "complex",
        })
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f64 {}
    impl Sealed for num_complex::Complex<f64> {}
}

/// One sample of a window: `f64` or `Complex<f64>`.
pub trait Sample: Copy + Send + Sync + sealed::Sealed + 'static {
    /// Kind of signal made of such samples.
    const KIND: SignalKind;
    /// The sample as a complex number.
    fn to_complex(self) -> Complex<f64>;
    /// The sample times a real factor.
    fn scaled(self, factor: f64) -> Self;
    /// Largest absolute value of the parts, the measure used for scaling.
    fn largest_part(self) -> f64;
    /// Whether all parts are finite.
    fn is_finite(self) -> bool;
    /// Adds the products of a sample that enters a window with itself and those before it, and takes away those of
    /// one that leaves it.
    ///
    /// `entering` ends with the new sample, `leaving` begins with the old one; both are as long as `sums` has lags.
    #[doc(hidden)]
    fn slide(sums: &mut [f64], entering: &[Self], leaving: &[Self]);
}

impl Sample for f64 {
    const KIND: SignalKind = SignalKind::Real;
    fn to_complex(self) -> Complex<f64> {
        Complex::new(self, 0.0)
    }
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }
    fn largest_part(self) -> f64 {
        self.abs()
    }
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
    fn slide(sums: &mut [f64], entering: &[Self], leaving: &[Self]) {
        let (Some(&new), Some(&old)) = (entering.last(), leaving.first()) else {
            return;
        };
        for ((sum, before), after) in sums.iter_mut().zip(entering.iter().rev()).zip(leaving) {
            *sum += new * before - old * after;
        }
    }
}

impl Sample for Complex<f64> {
    const KIND: SignalKind = SignalKind::Complex;
    fn to_complex(self) -> Complex<f64> {
        self
    }
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }
    fn largest_part(self) -> f64 {
        self.re.abs().max(self.im.abs())
    }
    fn is_finite(self) -> bool {
        Complex::is_finite(self)
    }
    fn slide(sums: &mut [f64], entering: &[Self], leaving: &[Self]) {
        let (Some(&new), Some(&old)) = (entering.last(), leaving.first()) else {
            return;
        };
        let (sums, _) = sums.as_chunks_mut::<2>();
        for ((sum, before), after) in sums.iter_mut().zip(entering.iter().rev()).zip(leaving) {
            let change = new * before.conj() - after * old.conj();
            sum[0] += change.re;
            sum[1] += change.im;
        }
    }
}

/// Power of two next to the largest finite part of the samples; 1 if there is none above 0.
///
/// Dividing by it is exact and brings the samples to order one, so that squares neither overflow nor vanish.
pub(crate) fn binary_scale<S: Sample>(samples: impl Iterator<Item = S>) -> f64 {
    largest_binary_scale(samples).unwrap_or(1.0)
}

/// The same; `None` if there is no sample above 0.
pub(crate) fn largest_binary_scale<S: Sample>(samples: impl Iterator<Item = S>) -> Option<f64> {
    let largest =
        samples.filter(|sample| sample.is_finite()).fold(0.0_f64, |largest, sample| largest.max(sample.largest_part()));
    // clamped so that the scale and its inverse are both normal numbers
    (largest > 0.0).then(|| largest.log2().floor().clamp(-1000.0, 1000.0).exp2())
}

/// Work space owned by the caller; buffers grow on first use and are then reused without allocation.
///
/// One per thread. The contents between calls mean nothing. Estimators of other crates may use the
/// public buffers as they like.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    /// Free real numbers.
    pub real: Vec<f64>,
    /// Free complex numbers.
    pub complex: Vec<Complex<f64>>,
    /// Densities in the detector band and next to it.
    pub(crate) band: Vec<f64>,
    /// Spectrum on the whole grid.
    pub(crate) density: Vec<f64>,
    /// Half spectrum of the transforms.
    pub(crate) half: Vec<Complex<f64>>,
    /// Inner work space of the transforms.
    pub(crate) transform: Vec<Complex<f64>>,
    /// Correlogram on its way into a transform.
    pub(crate) numbers: Vec<f64>,
    /// Correlogram on its way into an estimator of unbiased ones.
    pub(crate) unbiased: Vec<f64>,
    /// Autoregressive model.
    pub(crate) model: Autoregression,
    /// Power spectrum of one window.
    pub(crate) power: Vec<f64>,
}

impl Scratch {
    /// An empty work space.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_is_a_power_of_two_next_to_the_largest_sample() {
        assert_eq!(binary_scale([0.3, -5.0, f64::NAN].into_iter()), 4.0);
        assert_eq!(binary_scale([Complex::new(0.0, 0.25)].into_iter()), 0.25);
        assert_eq!(binary_scale([0.0].into_iter()), 1.0);
        assert!(binary_scale([1e-320].into_iter()).recip().is_finite());
    }
}
