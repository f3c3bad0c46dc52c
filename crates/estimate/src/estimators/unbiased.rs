//! The unbiased correlogram: the biased one over the weights that the window gives its lags.
//!
//! Computes r_m / w_m, w_m = 1 - m / N without weighting: its mean is the autocovariance of the signal. It is offered
//! for comparison and for the pulse pair; CA takes the biased form. Dividing raises the last lags, which few products
//! support, and the result need not be positive semi-definite: the noise of a band-limited receiver has next to no
//! power outside its band, so that small errors there make the density negative, the reflection coefficients leave
//! the unit circle and no model of order 16 exists ([`Quality::Invalid`](crate::estimators::Quality::Invalid)). Check: its mean
//! over noise of known covariance; how often a model fails.

use crate::error::{Error, check, length};
use crate::estimators::{Estimator, GateVelocity};
use crate::window::{Scratch, SignalKind};

/// Any estimator, on the unbiased correlogram instead of the biased one that was accumulated.
#[derive(Debug, Clone)]
pub struct Unbiased<E> {
    estimator: E,
    kind: SignalKind,
    gains: Vec<f64>,
}

impl<E: Estimator> Unbiased<E> {
    /// Wraps an estimator of correlograms; `lag_weights` are those of the window, one per lag
    /// ([`Correlogram::lag_weights`](crate::Correlogram::lag_weights)).
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one weight per lag, [`Error::OutOfRange`] for a weight that is 0 or not finite.
    pub fn new(estimator: E, kind: SignalKind, lag_weights: &[f64]) -> Result<Self, Error> {
        length(
            "lag_weights",
            estimator.statistic_len(),
            kind.lag_numbers(lag_weights.len()),
        )?;
        let usable = |&w: &f64| {
            check(
                "lag_weights",
                w,
                "finite and not 0",
                w.is_finite() && w != 0.0,
            )
        };
        lag_weights.iter().try_for_each(usable)?;
        Ok(Self {
            estimator,
            kind,
            gains: lag_weights.iter().map(|weight| weight.recip()).collect(),
        })
    }
}

impl<E: Estimator> Estimator for Unbiased<E> {
    fn statistic_len(&self) -> usize {
        self.estimator.statistic_len()
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        let mut numbers = std::mem::take(&mut scratch.unbiased);
        numbers.clear();
        numbers.extend(self.kind.weighted_lags(mean, &self.gains));
        let estimate = self.estimator.estimate(&numbers, scratch);
        scratch.unbiased = numbers;
        estimate
    }
}
