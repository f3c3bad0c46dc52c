//! The first lags of the biased correlogram of unweighted windows, slid along a record.
//!
//! Computes r_m = (1/N) sum over n of s(n+m) conj(s(n)) for m = 0 .. L-1, what CA of order L - 1 needs. The products of
//! a lag are summed in blocks as long as a window has products, from each product to the end of its block and from the
//! start to each product; every window is the sum of two of these (van Herk 1992). Three operations a product instead
//! of N, and nothing is ever subtracted: the lags of a window depend on its own samples only, so that neither rounding nor a burst
//! nor a missing sample affects another one. Check: against the sum written out, beside bursts and fill values.

use std::marker::PhantomData;

use ndarray::Array2;

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
        check(
            "lags",
            lags as f64,
            allowed,
            (1..=window_samples).contains(&lags),
        )?;
        Ok(Self {
            window_samples,
            lags,
            sample: PhantomData,
        })
    }

    /// Weights of the lags of white data, 1 - m / N.
    #[must_use]
    pub fn lag_weights(&self) -> Vec<f64> {
        let mut weights = unweighted_lags(self.window_samples);
        weights.truncate(self.lags);
        weights
    }

    /// The lags of all windows of a record, `step` samples apart, each after the other. Blocks begin at the multiples of their
    /// length in the whole record, of which this one is the part from `first_sample` on.
    fn evaluate_all(&self, record: &[S], first_sample: usize, step: usize, out: &mut [f64]) {
        let numbers = S::KIND.lag_numbers(self.lags);
        let per_lag = S::KIND.lag_numbers(1);
        let factor = 1.0 / self.window_samples as f64;
        let mut products = Vec::new();
        let mut running = RunningSums::default();
        for m in 0..self.lags {
            let length = self.window_samples - m;
            let skipped = first_sample % length;
            for part in 0..per_lag {
                form_products(&record[m..], record, part, &mut products);
                running.form(&products, skipped, length);
                for (gate, lags) in out.chunks_mut(numbers).enumerate() {
                    lags[per_lag * m + part] = running.sum(gate * step, skipped, length) * factor;
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
        let factor = 1.0 / self.window_samples as f64;
        for (m, parts) in out.chunks_mut(S::KIND.lag_numbers(1)).enumerate() {
            let products = window[m..]
                .iter()
                .zip(window)
                .map(|(a, b)| a.to_complex() * b.to_complex().conj());
            let mean = products.sum::<num_complex::Complex<f64>>() * factor;
            parts.copy_from_slice(&[mean.re, mean.im][..parts.len()]);
        }
    }

    fn product_weights(&self) -> Option<Array2<f64>> {
        let n = self.window_samples;
        Some(Array2::from_shape_fn((n, self.lags), |(k, m)| {
            if k + m < n { 1.0 / n as f64 } else { 0.0 }
        }))
    }

    fn evaluate_record(
        &self,
        record: &[S],
        first_sample: usize,
        step_samples: usize,
        valid: &dyn Fn(usize) -> bool,
        scratch: &mut Scratch,
        each: &mut dyn FnMut(usize, &[f64]),
    ) {
        let n = self.window_samples;
        let numbers = self.statistic_len();
        let windows = record.windows(n).step_by(step_samples);
        let mut means = vec![0.0; windows.len() * numbers];
        // far apart, windows are cheaper one by one
        if 3 * step_samples <= n && !means.is_empty() {
            self.evaluate_all(record, first_sample, step_samples, &mut means);
        } else {
            for (window, mean) in windows.zip(means.chunks_mut(numbers)) {
                self.evaluate(window, scratch, mean);
            }
        }
        for (gate, mean) in means.chunks(numbers).enumerate() {
            if valid(gate) {
                each(gate, mean);
            }
        }
    }
}

/// Real parts (`part` 0) or imaginary parts of the products `ahead[k]` conj `behind[k]`.
fn form_products<S: Sample>(ahead: &[S], behind: &[S], part: usize, products: &mut Vec<f64>) {
    products.clear();
    for (a, b) in ahead.iter().zip(behind) {
        let a = a.to_complex();
        let b = b.to_complex();
        products.push(match (S::KIND, part) {
            (SignalKind::Real, _) => a.re * b.re,
            (SignalKind::Complex, 0) => a.re * b.re + a.im * b.im,
            (SignalKind::Complex, _) => a.im * b.re - a.re * b.im,
        });
    }
}

/// Running sums of the products of one lag.
#[derive(Default)]
struct RunningSums {
    /// From the start of the block to each product.
    to: Vec<f64>,
    /// From each product to the end of the block.
    from: Vec<f64>,
}

impl RunningSums {
    /// Forms the sums in blocks of `length` products, of the first of which `skipped` are missing.
    fn form(&mut self, products: &[f64], skipped: usize, length: usize) {
        self.to.clear();
        self.from.clear();
        self.from.resize(products.len(), 0.0);
        let mut start = 0;
        let mut end = (length - skipped).min(products.len());
        while start < products.len() {
            let block = &products[start..end];
            let mut sum = 0.0;
            for product in block {
                sum += product;
                self.to.push(sum);
            }
            let mut sum = 0.0;
            for (from, product) in self.from[start..end].iter_mut().zip(block).rev() {
                sum += product;
                *from = sum;
            }
            start = end;
            end = (end + length).min(products.len());
        }
    }

    /// Sum of the `length` products from `start` on.
    fn sum(&self, start: usize, skipped: usize, length: usize) -> f64 {
        let end = self.to[start + length - 1];
        if (start + skipped).is_multiple_of(length) {
            end
        } else {
            self.from[start] + end
        }
    }
}
