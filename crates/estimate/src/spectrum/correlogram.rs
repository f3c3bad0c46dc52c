//! Biased correlogram of a weighted window, the statistic that is accumulated.
//!
//! Computes r_m = (1 / sum h^2) sum over n of h(n+m) s(n+m) h(n) conj(s(n)) for m = 0 .. N-1, by two transforms of 2 N
//! points, the second of the sum of the power spectra of all records. Its Fourier transform with all lags is the
//! zero-padded periodogram (29), corrected, at every frequency, so PA and CA share it. Check: against the sum written
//! out, and that identity to 1e-12.
//!
//! With several weightings (tapers) it is the weighted sum of their correlograms.

use std::marker::PhantomData;

use ndarray::Array2;

use crate::error::{Error, length, not_empty, positive};
use crate::estimators::Statistic;
use crate::spectrum::transform::WindowTransform;
use crate::window::{Sample, Scratch, Weighting};

/// One weighting and its factor in the sum.
#[derive(Debug, Clone, PartialEq)]
pub struct Taper {
    /// Weights h(n) of the samples.
    pub weights: Vec<f64>,
    /// Factor of its correlogram; 1 / sum h^2 makes white noise read its variance.
    pub factor: f64,
}

impl Taper {
    /// Taper whose factor is 1 / sum h^2.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the sum of squares is not finite and above 0.
    pub fn unit(weights: Vec<f64>) -> Result<Self, Error> {
        let energy: f64 = weights.iter().map(|h| h * h).sum();
        positive("sum of weights squared", energy)?;
        Ok(Self {
            weights,
            factor: energy.recip(),
        })
    }
}

/// Weights 1 - m / N of the lags of white data in windows of N samples without weighting.
#[must_use]
pub fn unweighted_lags(window_samples: usize) -> Vec<f64> {
    (0..window_samples)
        .map(|m| 1.0 - m as f64 / window_samples as f64)
        .collect()
}

/// Biased correlogram with all lags, of one or several weightings.
#[derive(Clone)]
pub struct Correlogram<S> {
    tapers: Vec<Taper>,
    transform: WindowTransform,
    sample: PhantomData<fn(S)>,
}

impl<S: Sample> Correlogram<S> {
    /// Correlogram of windows of `window_samples` samples with one weighting.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an empty window or an impossible weighting.
    pub fn new(weighting: Weighting, window_samples: usize) -> Result<Self, Error> {
        Self::with_tapers(vec![Taper::unit(weighting.weights(window_samples)?)?])
    }

    /// Weighted sum of the correlograms of several tapers of equal length.
    ///
    /// # Errors
    /// [`Error::Empty`] without tapers or samples, [`Error::Length`] if their lengths differ.
    pub fn with_tapers(tapers: Vec<Taper>) -> Result<Self, Error> {
        let window_samples = tapers.first().map_or(0, |taper| taper.weights.len());
        not_empty("tapers", window_samples)?;
        for taper in &tapers {
            length("taper", window_samples, taper.weights.len())?;
        }
        Ok(Self {
            tapers,
            transform: WindowTransform::new(S::KIND, 2 * window_samples),
            sample: PhantomData,
        })
    }

    /// The tapers.
    #[must_use]
    pub fn tapers(&self) -> &[Taper] {
        &self.tapers
    }

    /// Weights of the lags of white data, w_m = sum over tapers of factor times the tapers' correlogram, w_0 = 1: 1 -
    /// m / N without weighting.
    ///
    /// [`SpectralPeak::new`](crate::SpectralPeak::new) needs them to separate spectral width from resolution.
    #[must_use]
    pub fn lag_weights(&self) -> Vec<f64> {
        let mut weights = Vec::with_capacity(self.lags());
        for m in 0..self.lags() {
            let mut sum = 0.0;
            for Taper { weights: h, factor } in &self.tapers {
                let products = h[m..].iter().zip(h).map(|(a, b)| a * b);
                sum += factor * products.sum::<f64>();
            }
            weights.push(sum);
        }
        let first = weights[0];
        for weight in &mut weights {
            *weight /= first;
        }
        weights
    }

    /// Sums the power spectra of a window with its weightings in `scratch.power`.
    fn transform_power(&self, window: &[S], scratch: &mut Scratch) {
        self.transform.reset(scratch);
        for taper in &self.tapers {
            let weighted = window
                .iter()
                .zip(&taper.weights)
                .map(|(sample, h)| sample.to_complex() * h);
            self.transform.add_power(weighted, taper.factor, scratch);
        }
    }

    /// Number of lags N, lag 0 included.
    #[must_use]
    pub fn lags(&self) -> usize {
        self.tapers[0].weights.len()
    }
}

impl<S: Sample> Statistic<S> for Correlogram<S> {
    fn window_samples(&self) -> usize {
        self.lags()
    }

    fn statistic_len(&self) -> usize {
        S::KIND.lag_numbers(self.lags())
    }

    fn evaluate(&self, window: &[S], scratch: &mut Scratch, out: &mut [f64]) {
        self.transform_power(window, scratch);
        self.transform.lags_of_power(scratch, out);
    }

    fn sum_len(&self) -> usize {
        self.transform.frequencies()
    }

    fn statistic_of_sum(&self, sum: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        self.transform.reset(scratch);
        scratch.power.copy_from_slice(sum);
        self.transform.lags_of_power(scratch, out);
    }

    fn evaluate_record(
        &self,
        record: &[S],
        _first_sample: usize,
        step_samples: usize,
        valid: &dyn Fn(usize) -> bool,
        scratch: &mut Scratch,
        each: &mut dyn FnMut(usize, &[f64]),
    ) {
        let windows = record.windows(self.lags()).step_by(step_samples);
        for (gate, window) in windows.enumerate() {
            if valid(gate) {
                self.transform_power(window, scratch);
                each(gate, &scratch.power);
            }
        }
    }

    fn product_weights(&self) -> Option<Array2<f64>> {
        let mut products = Array2::zeros((self.lags(), self.lags()));
        for Taper { weights: h, factor } in &self.tapers {
            for (k, behind) in h.iter().enumerate() {
                for (m, ahead) in h[k..].iter().enumerate() {
                    products[(k, m)] += factor * ahead * behind;
                }
            }
        }
        Some(products)
    }
}
