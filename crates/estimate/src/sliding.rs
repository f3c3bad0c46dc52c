//! The first lags of the biased correlogram of unweighted windows, slid along a record.
//!
//! Computes r_m = (1/N) sum over n of s(n+m) conj(s(n)) for m = 0 .. L-1, what CA of order L - 1 needs. From one
//! window to the next a sample enters and one leaves: 2 L products instead of N L. Check: against the sum written
//! out, also after a missing sample and after a burst.
//!
//! Rounding cannot build up: the sums start afresh every 256 windows, and after windows that were left out.

use std::marker::PhantomData;

use crate::error::Error;
use crate::sample::{Sample, Scratch, SignalKind};
use crate::statistic::Statistic;

/// Windows after which the sums are formed anew.
const AFRESH: usize = 256;

/// The first `lags` lags of the biased correlogram of unweighted windows.
#[derive(Debug, Clone)]
pub struct ShortCorrelogram<S> {
    window_samples: usize,
    lags: usize,
    sample: PhantomData<fn(S)>,
}

impl<S: Sample> ShortCorrelogram<S> {
    /// Lags 0 .. `lags` - 1 of windows of `window_samples` samples; AR(16) needs 17.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless 1 <= `lags` <= `window_samples`.
    pub fn new(window_samples: usize, lags: usize) -> Result<Self, Error> {
        if lags == 0 || lags > window_samples {
            return Err(Error::OutOfRange {
                field: "lags",
                value: lags as f64,
                allowed: "at least 1 and at most the number of samples of the window",
            });
        }
        Ok(Self { window_samples, lags, sample: PhantomData })
    }

    /// Number of lags, lag 0 included.
    #[must_use]
    pub fn lags(&self) -> usize {
        self.lags
    }

    /// Kind of the samples.
    #[must_use]
    pub fn kind(&self) -> SignalKind {
        S::KIND
    }

    /// Weights of the lags of white data, 1 - m / N.
    #[must_use]
    pub fn lag_weights(&self) -> Vec<f64> {
        (0..self.lags).map(|m| 1.0 - m as f64 / self.window_samples as f64).collect()
    }

    /// The sums of products of one window, not divided by N.
    fn sums(&self, window: &[S], out: &mut [f64]) {
        out.fill(0.0);
        for m in 0..self.lags {
            let sum: num_complex::Complex<f64> = window[m..]
                .iter()
                .zip(window)
                .map(|(ahead, behind)| ahead.to_complex() * behind.to_complex().conj())
                .sum();
            match S::KIND {
                SignalKind::Real => out[m] = sum.re,
                SignalKind::Complex => out[2 * m..2 * m + 2].copy_from_slice(&[sum.re, sum.im]),
            }
        }
    }
}

impl<S: Sample> Statistic<S> for ShortCorrelogram<S> {
    fn window_samples(&self) -> usize {
        self.window_samples
    }

    fn statistic_len(&self) -> usize {
        S::KIND.lag_numbers(self.lags)
    }

    fn evaluate(&self, window: &[S], _: &mut Scratch, out: &mut [f64]) {
        self.sums(window, out);
        let share = 1.0 / self.window_samples as f64;
        out.iter_mut().for_each(|value| *value *= share);
    }

    fn evaluate_record(
        &self,
        record: &[S],
        step_samples: usize,
        valid: &dyn Fn(usize) -> bool,
        _: &mut Scratch,
        each: &mut dyn FnMut(usize, &[f64]),
    ) {
        let (n, lags) = (self.window_samples, self.lags);
        if record.len() < n {
            return;
        }
        let share = 1.0 / n as f64;
        let (mut sums, mut mean) = (vec![0.0; self.statistic_len()], vec![0.0; self.statistic_len()]);
        // windows since the sums were formed; none yet
        let mut age = None;
        for gate in 0..=(record.len() - n) / step_samples {
            let start = gate * step_samples;
            if !valid(gate) {
                age = None;
                continue;
            }
            match age {
                Some(windows) if windows < AFRESH && 2 * step_samples <= n => {
                    for first in start - step_samples..start {
                        let end = first + n + 1;
                        // a sample pairs with those of its own window only: the new one with the window's last lags
                        S::slide(&mut sums, &record[end - lags..end], &record[first..first + lags]);
                    }
                    age = Some(windows + 1);
                }
                _ => {
                    self.sums(&record[start..start + n], &mut sums);
                    age = Some(1);
                }
            }
            mean.iter_mut().zip(&sums).for_each(|(mean, sum)| *mean = sum * share);
            each(gate, &mean);
        }
    }
}
