//! Real and complex samples behind one trait.
//!
//! Check: in the tests of the statistics, for both kinds of samples.

use crate::window::SignalKind;
use num_complex::Complex;

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
    #[inline]
    fn to_complex(self) -> Complex<f64> {
        Complex::new(self, 0.0)
    }
    #[inline]
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }
    #[inline]
    fn largest_part(self) -> f64 {
        self.abs()
    }
    #[inline]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
    #[inline]
    fn has_part(self, value: f64) -> bool {
        self == value
    }
    #[inline]
    fn products(ahead: &[Self], behind: &[Self], parts: &mut [Vec<f64>; 2]) {
        parts[0].clear();
        parts[0].extend(ahead.iter().zip(behind).map(|(a, b)| a * b));
    }
}

impl Sample for Complex<f64> {
    const KIND: SignalKind = SignalKind::Complex;
    #[inline]
    fn to_complex(self) -> Complex<f64> {
        self
    }
    #[inline]
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }
    #[inline]
    fn largest_part(self) -> f64 {
        self.re.abs().max(self.im.abs())
    }
    #[inline]
    fn is_finite(self) -> bool {
        Complex::is_finite(self)
    }
    #[inline]
    fn has_part(self, value: f64) -> bool {
        self.re == value || self.im == value
    }
    #[inline]
    fn products(ahead: &[Self], behind: &[Self], parts: &mut [Vec<f64>; 2]) {
        let [re, im] = parts;
        re.clear();
        re.extend(ahead.iter().zip(behind).map(|(a, b)| a.re * b.re + a.im * b.im));
        im.clear();
        im.extend(ahead.iter().zip(behind).map(|(a, b)| a.im * b.re - a.re * b.im));
    }
}
