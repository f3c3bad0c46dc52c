//! Real and complex samples behind one trait, and the work space that the caller owns.
//!
//! Check: in the tests of the statistics, for both kinds of samples.

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
    /// Whether one of the parts is `value`.
    fn has_part(self, value: f64) -> bool;
    /// Products `ahead[k]` conj `behind[k]`, real and imaginary parts apart; those of real samples have no imaginary part.
    #[doc(hidden)]
    fn products(ahead: &[Self], behind: &[Self], parts: &mut [Vec<f64>; 2]);
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
    fn has_part(self, value: f64) -> bool {
        self == value
    }
    fn products(ahead: &[Self], behind: &[Self], parts: &mut [Vec<f64>; 2]) {
        parts[0].clear();
        parts[0].extend(ahead.iter().zip(behind).map(|(a, b)| a * b));
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
    fn has_part(self, value: f64) -> bool {
        self.re == value || self.im == value
    }
    fn products(ahead: &[Self], behind: &[Self], parts: &mut [Vec<f64>; 2]) {
        let [re, im] = parts;
        re.clear();
        re.extend(ahead.iter().zip(behind).map(|(a, b)| a.re * b.re + a.im * b.im));
        im.clear();
        im.extend(ahead.iter().zip(behind).map(|(a, b)| a.im * b.re - a.re * b.im));
    }
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
