//! The first lags of the biased correlogram of unweighted windows, slid along a record.
//!
//! Computes r_m = (1/N) sum over n of s(n+m) conj(s(n)) for m = 0 .. L-1, what CA of order L - 1 needs. The products of
//! a lag are summed in blocks as long as a window has products, from each place to the end of its block and from the
//! start to each place; every window is the sum of two of these (van Herk 1992). Three operations a product instead
//! of N, and nothing is ever subtracted: a window knows of no sample but its own, so that neither rounding nor a burst
//! nor a missing sample reaches another one. Check: against the sum written out, beside bursts and fill values.

use std::marker::PhantomData;

use crate::error::{Error, check};
use crate::estimators::Statistic;
use crate::spectrum::correlogram::unweighted_lags;
use crate::window::{Sample, Scratch, SignalKind};

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
        let allowed = "at least 1 and at most the number of samples of the window";
        check("lags", lags as f64, allowed, (1..=window_samples).contains(&lags))?;
        Ok(Self { window_samples, lags, sample: PhantomData })
    }

    /// Weights of the lags of white data, 1 - m / N.
    #[must_use]
    pub fn lag_weights(&self) -> Vec<f64> {
        let mut weights = unweighted_lags(self.window_samples);
        weights.truncate(self.lags);
        weights
    }

    /// The sums of products of one window, not divided by N.
    fn sums(&self, window: &[S], out: &mut [f64]) {
        for (m, parts) in out.chunks_mut(S::KIND.lag_numbers(1)).enumerate() {
            let products = window[m..].iter().zip(window).map(|(a, b)| a.to_complex() * b.to_complex().conj());
            let sum: num_complex::Complex<f64> = products.sum();
            parts.copy_from_slice(&[sum.re, sum.im][..parts.len()]);
        }
    }

    /// The same of all windows of a record, `step` samples apart, each after the other. Blocks begin at the multiples of their
    /// length in the whole record, of which this one is the part from `first_sample` on.
    fn sums_of_all(&self, record: &[S], first_sample: usize, step: usize, out: &mut [f64]) {
        let numbers = S::KIND.lag_numbers(self.lags);
        let per_lag = S::KIND.lag_numbers(1);
        let (mut products, mut running) = (Vec::new(), Running::default());
        for m in 0..self.lags {
            let length = self.window_samples - m;
            for part in 0..per_lag {
                form_products(&record[m..], record, part, &mut products);
                running.form(&products, first_sample % length, length);
                for (gate, sums) in out.chunks_mut(numbers).enumerate() {
                    sums[per_lag * m + part] = running.of(gate * step, first_sample % length, length);
                }
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
        first_sample: usize,
        step_samples: usize,
        valid: &dyn Fn(usize) -> bool,
        _: &mut Scratch,
        each: &mut dyn FnMut(usize, &[f64]),
    ) {
        let n = self.window_samples;
        if record.len() < n {
            return;
        }
        let gates = (record.len() - n) / step_samples + 1;
        let numbers = self.statistic_len();
        // far apart, windows are cheaper one by one
        let mut means = vec![0.0; gates * numbers];
        if 3 * step_samples <= n {
            self.sums_of_all(record, first_sample, step_samples, &mut means);
        } else {
            let windows = record.windows(n).step_by(step_samples);
            windows.zip(means.chunks_mut(numbers)).for_each(|(window, sums)| self.sums(window, sums));
        }
        let share = 1.0 / n as f64;
        for (gate, mean) in means.chunks_mut(numbers).enumerate().filter(|(gate, _)| valid(*gate)) {
            mean.iter_mut().for_each(|value| *value *= share);
            each(gate, mean);
        }
    }
}

/// Real parts (`part` 0) or imaginary parts of the products `ahead[k]` conj `behind[k]`.
fn form_products<S: Sample>(ahead: &[S], behind: &[S], part: usize, products: &mut Vec<f64>) {
    let pairs = ahead.iter().zip(behind).map(|(a, b)| (a.to_complex(), b.to_complex()));
    products.clear();
    match (S::KIND, part) {
        (SignalKind::Real, _) => products.extend(pairs.map(|(a, b)| a.re * b.re)),
        (SignalKind::Complex, 0) => products.extend(pairs.map(|(a, b)| a.re * b.re + a.im * b.im)),
        (SignalKind::Complex, _) => products.extend(pairs.map(|(a, b)| a.im * b.re - a.re * b.im)),
    }
}

/// Running sums of the products of one lag.
#[derive(Default)]
struct Running {
    /// From the start of the block to each place.
    to: Vec<f64>,
    /// From each place to the end of the block.
    from: Vec<f64>,
}

impl Running {
    /// Forms the sums in blocks of `length` products, of the first of which `skipped` are missing.
    fn form(&mut self, products: &[f64], skipped: usize, length: usize) {
        self.to.clear();
        self.from.clear();
        self.from.resize(products.len(), 0.0);
        let (first, rest) = products.split_at((length - skipped).min(products.len()));
        let (first_from, rest_from) = self.from.split_at_mut(first.len());
        let blocks = std::iter::once((first, first_from)).chain(rest.chunks(length).zip(rest_from.chunks_mut(length)));
        for (block, from) in blocks {
            let mut sum = 0.0;
            self.to.extend(block.iter().map(|product| {
                sum += product;
                sum
            }));
            let mut sum = 0.0;
            for (from, product) in from.iter_mut().zip(block).rev() {
                sum += product;
                *from = sum;
            }
        }
    }

    /// Sum of the `length` products from `start` on.
    fn of(&self, start: usize, skipped: usize, length: usize) -> f64 {
        let end = self.to[start + length - 1];
        if (start + skipped).is_multiple_of(length) { end } else { self.from[start] + end }
    }
}
