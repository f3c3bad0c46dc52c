//! The law of the statistic in empty scans, and the threshold that a rate of false alarms needs.
//!
//! No table gives it: over unknown places the statistic is the maximum of a field, and without a wake places do not exist (Davies
//! 1977). So it is drawn. The products of a scan of noise with the bank are normal with a known covariance, whatever the number of
//! cells, and are drawn themselves. Where fewer than 30 draws lie above, the tail of Gumbel goes on,
//!
//! ```text
//! P(T) = 1 - exp(-exp(-(T - mu)/beta)),  beta = sqrt(6) std/pi,  mu = mean - 0.5772 beta  (moments of all draws)
//! ```
//!
//! scaled to meet the draws there. beta must come out near 2: T is the square of a normal number. Check: the same law from whole
//! drawn scans; quantiles of draws from Gumbel's law.

use ndarray::{Array2, s};
use rand::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use std::f64::consts::PI;

use crate::error::{Error, check, finite};
use crate::parallel::map_each;
use crate::wake_detection::WakeDetector;

/// Scans that are drawn together.
const BATCH: usize = 64;
/// Draws above a threshold that is read from the draws.
const COUNTED: usize = 30;
/// Least number of draws.
const FEWEST: usize = 1000;
const EULER: f64 = 0.577_215_664_901_532_9;

/// Statistics of empty scans.
#[derive(Debug, Clone, PartialEq)]
pub struct EmptyScanLaw {
    /// Decreasing.
    statistics: Vec<f64>,
    location: f64,
    scale: f64,
}

impl WakeDetector {
    /// The law of the statistic in scans of wind, noise and the turbulence of the options: `scans` are drawn, each from the
    /// generator that `stream` gives for its number; turbulence that was found in a scan is known as well as it can be found there.
    ///
    /// # Errors
    /// As [`EmptyScanLaw::new`].
    pub fn calibrate<R: Rng>(
        &self,
        scans: usize,
        stream: impl Fn(u64) -> R + Sync + Send,
    ) -> Result<EmptyScanLaw, Error> {
        let products = self.empty_products(scans, &stream);
        let mut statistics = Vec::with_capacity(scans);
        for row in products.rows() {
            statistics.push(self.best(row).0);
        }
        if let Some((turbulence, part)) = self.turbulent_part() {
            let degrees = turbulence.degrees_of_freedom(part);
            let of_variance = stream(scans as u64);
            let is_beside_wake = turbulence.is_beside_wake;
            over_found_variance(&mut statistics, degrees, is_beside_wake, of_variance)?;
        }
        EmptyScanLaw::new(statistics)
    }

    /// Products of empty scans with all places: scans by places.
    pub(super) fn empty_products<R: Rng>(
        &self,
        scans: usize,
        stream: impl Fn(u64) -> R + Sync + Send,
    ) -> Array2<f64> {
        let places = self.factor.nrows();
        let batches = map_each(scans.div_ceil(BATCH), |batch| {
            let first = batch * BATCH;
            let count = BATCH.min(scans - first);
            let mut normal = Array2::<f64>::zeros((count, places));
            for (scan, mut row) in normal.rows_mut().into_iter().enumerate() {
                let mut generator = stream((first + scan) as u64);
                row.mapv_inplace(|_| StandardNormal.sample(&mut generator));
            }
            lower_product(&normal, &self.factor)
        });
        let views: Vec<_> = batches.iter().map(|batch| batch.view()).collect();
        ndarray::concatenate(ndarray::Axis(0), &views)
            .unwrap_or_else(|_| Array2::zeros((0, places)))
    }
}

/// Divides statistics of scans with a known variance by a variance that is found in each scan, chi-square of `degrees` degrees of freedom
/// over these, as in the F distribution. Beside the wind alone the sum of squares has the contrast with the best wake in it, so that a larger one makes the variance larger; the
/// mean of all has the usual best wake in it.
fn over_found_variance(
    statistics: &mut [f64],
    degrees: f64,
    is_beside_wake: bool,
    mut generator: impl Rng,
) -> Result<(), Error> {
    let squares = ChiSquared::new(degrees).map_err(|_| Error::OutOfRange {
        field: "degrees of freedom of the turbulence",
        value: degrees,
        allowed: "a positive number",
    })?;
    let mean = statistics.iter().sum::<f64>() / statistics.len().max(1) as f64;
    for statistic in statistics {
        let mut variance = squares.sample(&mut generator) / degrees;
        if !is_beside_wake {
            variance *= (degrees + *statistic) / (degrees + mean);
        }
        *statistic /= variance;
    }
    Ok(())
}

/// Rows times the transpose of a lower triangular matrix, whose zeros are left out block by block.
fn lower_product(rows: &Array2<f64>, lower: &Array2<f64>) -> Array2<f64> {
    let order = lower.nrows();
    let mut product = Array2::zeros((rows.nrows(), order));
    for first in (0..order).step_by(BATCH) {
        let last = (first + BATCH).min(order);
        let factor = lower.slice(s![first..last, ..last]);
        product
            .slice_mut(s![.., first..last])
            .assign(&rows.slice(s![.., ..last]).dot(&factor.t()));
    }
    product
}

impl EmptyScanLaw {
    /// The law of statistics of empty scans, however they were found: scans that were measured without a wake will do.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with fewer than a thousand, or one that is not finite.
    pub fn new(mut statistics: Vec<f64>) -> Result<Self, Error> {
        let count = statistics.len();
        check(
            "empty scans",
            count as f64,
            "at least 1000: the tail of fewer is not known",
            count >= FEWEST,
        )?;
        statistics
            .iter()
            .try_for_each(|value| finite("statistic of an empty scan", *value))?;
        statistics.sort_by(|a, b| b.total_cmp(a));
        let mean = statistics.iter().sum::<f64>() / count as f64;
        let variance =
            statistics.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / (count - 1) as f64;
        let scale = (6.0 * variance).sqrt() / PI;
        Ok(Self {
            statistics,
            location: mean - EULER * scale,
            scale,
        })
    }

    /// Number of scans.
    #[must_use]
    pub fn scans(&self) -> usize {
        self.statistics.len()
    }

    /// Least rate that is counted; below it the tail of Gumbel's law is used.
    #[must_use]
    pub fn least_counted_rate(&self) -> f64 {
        COUNTED as f64 / self.scans() as f64
    }

    /// mu and beta of Gumbel's law with the mean and the variance of the statistics; beta should be near 2.
    #[must_use]
    pub fn gumbel(&self) -> (f64, f64) {
        (self.location, self.scale)
    }

    fn tail(&self, statistic: f64) -> f64 {
        -(-(-(statistic - self.location) / self.scale).exp()).exp_m1()
    }

    /// The threshold that empty scans exceed with probability `false_alarm`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless the rate lies between 0 and 1.
    pub fn threshold(&self, false_alarm: f64) -> Result<f64, Error> {
        let is_rate = false_alarm > 0.0 && false_alarm < 1.0;
        check(
            "false_alarm",
            false_alarm,
            "between 0 and 1, for example 0.01",
            is_rate,
        )?;
        let least = self.least_counted_rate();
        if false_alarm < least {
            let anchor = self.statistics[COUNTED - 1];
            let share = false_alarm / least;
            let tail = share * self.tail(anchor);
            return Ok(self.location - self.scale * (-(-tail).ln_1p()).ln());
        }
        // between the k-th and the next one, k/n the rate
        let place = (false_alarm * self.scans() as f64).min((self.scans() - 1) as f64);
        let k = place as usize;
        let part = place.fract();
        Ok(self.statistics[k - 1] + part * (self.statistics[k] - self.statistics[k - 1]))
    }

    /// Probability that the statistic of an empty scan is at least as large.
    #[must_use]
    pub fn false_alarm(&self, statistic: f64) -> f64 {
        let above = self.statistics.partition_point(|t| *t >= statistic);
        if above >= COUNTED {
            return above as f64 / self.scans() as f64;
        }
        self.least_counted_rate() * self.tail(statistic) / self.tail(self.statistics[COUNTED - 1])
    }
}
