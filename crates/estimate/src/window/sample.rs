//! Real and complex samples behind one trait.
//!
//! Check: in the tests of the statistics, for both kinds of samples.

use crate::window::SignalKind;
use num_complex::Complex;
use std::ops::Mul;

/// One sample of a window: `f64` or `Complex<f64>`.
pub trait Sample:
    Copy + Send + Sync + Into<Complex<f64>> + Mul<f64, Output = Self> + 'static
{
    /// Kind of signal made of such samples.
    const KIND: SignalKind;

    /// The sample as a complex number.
    #[inline]
    fn to_complex(self) -> Complex<f64> {
        self.into()
    }

    /// The sample from a complex number; of a real one, its real part.
    fn from_complex(value: Complex<f64>) -> Self;

    /// The sample times a real factor.
    #[inline]
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }

    /// Largest absolute value of the parts, the measure used for scaling.
    #[inline]
    fn largest_part(self) -> f64 {
        let sample = self.to_complex();
        sample.re.abs().max(sample.im.abs())
    }

    /// Whether all parts are finite.
    #[inline]
    fn is_finite(self) -> bool {
        self.to_complex().is_finite()
    }

    /// Whether one of the parts is `value`.
    #[inline]
    fn has_part(self, value: f64) -> bool {
        let sample = self.to_complex();
        sample.re == value || (Self::KIND == SignalKind::Complex && sample.im == value)
    }
}

impl Sample for f64 {
    const KIND: SignalKind = SignalKind::Real;

    #[inline]
    fn from_complex(value: Complex<f64>) -> Self {
        value.re
    }
}

impl Sample for Complex<f64> {
    const KIND: SignalKind = SignalKind::Complex;

    #[inline]
    fn from_complex(value: Complex<f64>) -> Self {
        value
    }
}
