//! Whether samples are real or complex, and how the lags of their correlograms are stored.
//!
//! Check: in the tests of the statistics, for both kinds of samples.

use num_complex::Complex;

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

    /// The numbers of a stored correlogram times one weight for each lag, as far as there are weights.
    pub(crate) fn weighted_lags(
        self,
        numbers: &[f64],
        weights: &[f64],
    ) -> impl Iterator<Item = f64> {
        let lags = numbers.chunks(self.lag_numbers(1)).zip(weights);
        lags.flat_map(|(lag, weight)| lag.iter().map(move |number| number * weight))
    }

    /// Share of its power that a signal has at its own frequencies: real samples carry half of it at the negative ones.
    pub(crate) fn one_sided_share(self) -> f64 {
        match self {
            Self::Real => 0.5,
            Self::Complex => 1.0,
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
