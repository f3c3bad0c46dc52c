//! Estimator that fits an autoregressive model to the accumulated correlogram: CA (Table 3).
//!
//! Computes the peak in the detector band of the AR spectrum (32), of order 16 in the literal form. The inverse spectrum is a
//! trigonometric polynomial of the order of the model and so cheap at any frequency. Check: spectra evaluated frequency by
//! frequency, a stored window, and tones.

use crate::error::Error;
use crate::estimators::search::{PeakSearch, unusable};
use crate::estimators::{Estimator, GateVelocity, Quality, Refinement};
use crate::models::Autoregression;
use crate::models::autoregressive::check_order;
use crate::window::{Sampling, Scratch, SignalKind};

/// Velocity from the peak of the autoregressive spectrum of the accumulated correlogram, in the detector band: CA.
///
/// The chapter uses order 16; 2048 frequencies or more resolve the peaks of the model.
#[derive(Clone)]
pub struct ModelPeak {
    order: usize,
    lags: usize,
    search: PeakSearch,
    refinement: Refinement,
    /// Weights of the lags for the test against noise.
    lag_weights: Vec<f64>,
}

/// Hann weights of the lags 0 .. `order` of a model: those of the spectrum whose peak its test against noise takes.
#[must_use]
pub fn model_lag_weights(order: usize) -> Vec<f64> {
    let turn = std::f64::consts::PI / (order + 1) as f64;
    (0..=order)
        .map(|m| 0.5 + 0.5 * (turn * m as f64).cos())
        .collect()
}

impl ModelPeak {
    /// Plans a model of order `order` of correlograms with `lags` lags and a search over `padded_samples` frequencies.
    ///
    /// Only `order` + 1 lags are needed.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless 1 <= `order` < `lags`; [`Error::Band`] for an impossible band.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        lags: usize,
        order: usize,
        padded_samples: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        check_order(order, lags)?;
        let lag_weights = model_lag_weights(order);
        Ok(Self {
            order,
            lags,
            search: PeakSearch::new(sampling, kind, padded_samples, &lag_weights)?,
            refinement,
            lag_weights,
        })
    }

    fn read(
        &self,
        model: &Autoregression,
        numbers: &mut Vec<f64>,
        band: &mut Vec<f64>,
    ) -> GateVelocity {
        model.inverse_lags(self.search.kind, numbers);
        numbers.resize(self.search.statistic_len(), 0.0);
        if self.search.zoom.density_into(numbers, band).is_err() {
            return GateVelocity::none(Quality::Invalid);
        }
        // a pole on the circle to rounding must not turn the density negative or infinite
        let least = f64::MIN_POSITIVE.max(1e-300 / model.noise_power);
        for value in band.iter_mut() {
            *value = value.max(least).recip();
        }
        let found = self.search.locate(band, self.refinement, &[], &mut || None);
        self.search.velocity(&found)
    }
}

impl Estimator for ModelPeak {
    fn statistic_len(&self) -> usize {
        self.search.kind.lag_numbers(self.lags)
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        if let Some(flag) = unusable(mean) {
            return GateVelocity::none(flag);
        }
        let kind = self.search.kind;
        let mut model = std::mem::take(&mut scratch.model);
        let mut numbers = std::mem::take(&mut scratch.numbers);
        let mut estimate = match model.fit(mean, kind, self.order, &mut numbers) {
            Ok(()) => self.read(&model, &mut numbers, &mut scratch.band),
            Err(_) => GateVelocity::none(Quality::Invalid),
        };
        // The density of a model is not linear in the correlogram: power and detection are those of its lags, which also determine the
        // leakage of lines outside. A model does not resolve the width of a spectrum: its peaks narrow with the signal-to-noise ratio.
        numbers.clear();
        numbers.extend(kind.weighted_lags(mean, &self.lag_weights));
        if let Some(found) = self.search.find(&numbers, Refinement::None, scratch) {
            match (estimate.flag, found.flag) {
                (Quality::Good | Quality::OutOfBand, flag @ Quality::NoSignal) => {
                    estimate = GateVelocity::none(flag)
                }
                (Quality::Good, flag) => estimate.flag = flag,
                _ => {}
            }
            estimate.power = self.search.power(found.sum);
            estimate.detection = found.peak;
            estimate.spread_m2_s2 = f64::NAN;
        }
        scratch.model = model;
        scratch.numbers = numbers;
        estimate
    }
}
