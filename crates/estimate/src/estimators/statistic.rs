//! The two traits that an estimator is made of, so that others can plug in their own.
//!
//! A [`Statistic`] turns a window into numbers whose mean over windows makes sense; an
//! [`Estimator`] turns such a mean into a velocity. Accumulation stands between the two and knows neither.
//! Check: the mean over a region equals the mean of the statistics of its windows.

use ndarray::Array2;

use crate::error::{Error, length};
use crate::estimators::{GateVelocity, Quality};
use crate::window::missing::MissingRule;
use crate::window::{Sample, Scratch};

/// Numbers drawn from one window, to be averaged over windows: I_k of Table 3.
pub trait Statistic<S: Sample>: Sync {
    /// Samples of one window.
    fn window_samples(&self) -> usize;
    /// How many numbers one window gives.
    fn statistic_len(&self) -> usize;
    /// Writes the numbers of `window` into `out`.
    ///
    /// The caller passes exactly [`Statistic::window_samples`] finite samples, scaled to order one,
    /// and [`Statistic::statistic_len`] places. The result must be quadratic in the samples.
    fn evaluate(&self, window: &[S], scratch: &mut Scratch, out: &mut [f64]);

    /// Weights w(k, m) with which the numbers follow from products of samples: number m is
    /// sum over k of w(k, m) s(k+m) conj(s(k)), a real number or its two parts. So windows of many
    /// records can be averaged from the sums of their products.
    ///
    /// `None`, as here, if the numbers are not such sums: they are then computed of each record.
    fn product_weights(&self) -> Option<Array2<f64>> {
        None
    }

    /// How many numbers of a window [`Statistic::evaluate_record`] hands over.
    fn sum_len(&self) -> usize {
        self.statistic_len()
    }

    /// Writes the numbers of a window into `out`, from the sum over records of what [`Statistic::evaluate_record`] hands over for it.
    ///
    /// That is their sum, as here, unless a transform that all of them need is left for the sum.
    fn statistic_of_sum(&self, sum: &[f64], _scratch: &mut Scratch, out: &mut [f64]) {
        out.copy_from_slice(sum);
    }

    /// Hands the numbers of all valid windows of a record, `step_samples` apart, to `each` with the index of the window.
    ///
    /// `record` may be a part of a longer one, in which it begins at `first_sample`; a window has the same numbers to the last bit
    /// in every part. `valid` says which windows are to be used: those without a missing sample, which may be anything. The form given here calls
    /// [`Statistic::evaluate`] for every window; a statistic that can go on from the window before replaces it.
    fn evaluate_record(
        &self,
        record: &[S],
        _first_sample: usize,
        step_samples: usize,
        valid: &dyn Fn(usize) -> bool,
        scratch: &mut Scratch,
        each: &mut dyn FnMut(usize, &[f64]),
    ) {
        let mut one = vec![0.0; self.statistic_len()];
        for (gate, window) in record
            .windows(self.window_samples())
            .step_by(step_samples)
            .enumerate()
        {
            if valid(gate) {
                self.evaluate(window, scratch, &mut one);
                each(gate, &one);
            }
        }
    }
}

/// Velocity from the mean of a [`Statistic`].
pub trait Estimator: Send + Sync {
    /// How many numbers the mean has.
    fn statistic_len(&self) -> usize;
    /// The velocity for the mean statistic `mean`.
    ///
    /// The samples behind `mean` were scaled by a power of two, so nothing but `power` and `detection` may depend on
    /// their scale; the caller scales these back.
    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity;
}

impl Estimator for Box<dyn Estimator> {
    fn statistic_len(&self) -> usize {
        (**self).statistic_len()
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        (**self).estimate(mean, scratch)
    }
}

/// Velocity of a single window, without accumulation; [`Quality::Invalid`] if it holds a missing sample,
/// as [`Scan::new`](crate::Scan::new) has it.
///
/// # Errors
/// [`Error::Length`] if the window has the wrong length or statistic and estimator do not match.
pub fn estimate_window<S: Sample>(
    statistic: &impl Statistic<S>,
    estimator: &impl Estimator,
    window: &[S],
    scratch: &mut Scratch,
) -> Result<GateVelocity, Error> {
    length("window", statistic.window_samples(), window.len())?;
    length(
        "statistic",
        estimator.statistic_len(),
        statistic.statistic_len(),
    )?;
    let rule = MissingRule::from_samples(window.iter().copied());
    if !window.iter().all(|sample| rule.is_measured(*sample)) {
        return Ok(GateVelocity::none(Quality::Invalid));
    }
    let scale = rule.binary_scale(window.iter().copied()).unwrap_or(1.0);
    let scaled: Vec<S> = window
        .iter()
        .map(|sample| sample.scaled(scale.recip()))
        .collect();
    let mut numbers = vec![0.0; statistic.statistic_len()];
    statistic.evaluate(&scaled, scratch, &mut numbers);
    let mut estimate = estimator.estimate(&numbers, scratch);
    estimate.scale_power(scale * scale);
    Ok(estimate)
}
