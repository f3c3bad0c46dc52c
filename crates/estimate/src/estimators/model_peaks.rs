//! Estimators that fit a model to the accumulated correlogram: CA (the AR spectrum's peak), its pole, and Capon.
//!
//! Computes the peak in the detector band of the AR spectrum (32), of order 16 in the literal form; the pole of the
//! same model that is nearest to the unit circle; and the peak of Capon's minimum-variance spectrum (p + 1) / (e^H
//! R^-1 e) (Capon 1969). Their inverse spectra are trigonometric polynomials of the order of the model and so cheap
//! at any frequency. Check: spectra evaluated frequency by frequency, e^H R^-1 e with R inverted, a stored window,
//! and tones.

use crate::error::Error;
use crate::estimators::search::{PeakSearch, unusable};
use crate::estimators::{Estimator, GateVelocity, Quality, Refinement};
use crate::models::autoregressive::check_order;
use crate::models::{Autoregression, OrderChoice};
use crate::window::{Sampling, Scratch, SignalKind};

/// What is read of a model of the accumulated correlogram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelReading {
    /// CA: peak of the autoregressive spectrum. The chapter uses order 16; 2048 frequencies or more resolve its peaks.
    Spectrum,
    /// Peak of Capon's minimum-variance spectrum, by filters of one sample more than the order.
    Capon,
    /// The pole of the autoregressive model nearest to the unit circle in the band; frequencies serve the quality figures.
    ///
    /// SNR, quality and flags are those of the model's spectrum; where that has less than half of its peak at the pole, the estimate is
    /// [`Quality::Ambiguous`].
    Pole,
}

/// Velocity from a model of the accumulated correlogram, in the detector band.
#[derive(Clone)]
pub struct ModelPeak {
    reading: ModelReading,
    order: usize,
    choice: OrderChoice,
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
    /// Only `order` + 1 lags are needed. [`Refinement::Exact`] counts as the parabola.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless 1 <= `order` < `lags`; [`Error::Band`] for an impossible band.
    pub fn new(
        reading: ModelReading,
        sampling: &Sampling,
        kind: SignalKind,
        lags: usize,
        order: usize,
        padded_samples: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        check_order(order, lags)?;
        let lag_weights = model_lag_weights(order);
        let search = PeakSearch::new(
            sampling,
            kind,
            (padded_samples, padded_samples),
            &lag_weights,
        )?;
        Ok(Self {
            reading,
            order,
            choice: OrderChoice::Fixed,
            lags,
            search,
            refinement,
            lag_weights,
        })
    }

    /// The same with the order chosen for each estimate; `order` is then the largest.
    #[must_use]
    pub fn choosing(mut self, choice: OrderChoice) -> Self {
        self.choice = choice;
        self
    }

    /// Lowers the order to the one chosen.
    fn choose(&self, model: &mut Autoregression) -> Result<(), Error> {
        if self.choice != OrderChoice::Fixed {
            *model = model.truncated(self.choice.order(&model.reflection)?)?;
        }
        Ok(())
    }

    fn read(
        &self,
        model: &Autoregression,
        numbers: &mut Vec<f64>,
        band: &mut Vec<f64>,
    ) -> GateVelocity {
        model.inverse_lags(
            self.search.kind,
            self.reading == ModelReading::Capon,
            numbers,
        );
        numbers.resize(self.search.statistic_len(), 0.0);
        if self.search.zoom.density_into(numbers, band).is_err() {
            return GateVelocity::none(Quality::Invalid);
        }
        // a pole on the circle to rounding must not turn the density negative or infinite
        let least = f64::MIN_POSITIVE.max(1e-300 / model.noise_power);
        band.iter_mut()
            .for_each(|value| *value = value.max(least).recip());
        let found = self.search.locate(band, self.refinement, &[], || None);
        let estimate = self
            .search
            .velocity(&found, self.search.band.frequency_hz(found.bin));
        match self.reading {
            ModelReading::Pole if found.flag == Quality::Good => {
                self.at_pole(model, found.peak, estimate)
            }
            _ => estimate,
        }
    }

    /// The same estimate at the pole nearest to the circle, ambiguous where the spectrum does not peak there; out of band if none lies
    /// in it.
    fn at_pole(&self, model: &Autoregression, peak: f64, estimate: GateVelocity) -> GateVelocity {
        let sampling = &self.search.sampling;
        match model.nearest_pole(sampling) {
            Ok(Some((frequency_hz, _))) => {
                let is_beside = 2.0 * model.density(frequency_hz, sampling) < peak;
                let flag = if is_beside {
                    Quality::Ambiguous
                } else {
                    estimate.flag
                };
                GateVelocity {
                    velocity_m_s: sampling.velocity_m_s(frequency_hz),
                    flag,
                    ..estimate
                }
            }
            Ok(None) => GateVelocity {
                flag: Quality::OutOfBand,
                ..estimate
            },
            Err(_) => GateVelocity::none(Quality::Invalid),
        }
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
        let solved = model
            .fit(mean, kind, self.order, &mut numbers)
            .and_then(|()| self.choose(&mut model));
        let mut estimate = match solved {
            Ok(()) => self.read(&model, &mut numbers, &mut scratch.band),
            Err(_) => GateVelocity::none(Quality::Invalid),
        };
        // The density of a model is not linear in the correlogram: power and detection are those of its lags, which also tell what
        // lines outside leak. How wide a spectrum is a model does not show: its peaks narrow with the signal-to-noise ratio.
        numbers.clear();
        numbers.extend(kind.weighted_lags(mean, &self.lag_weights));
        if let Some(found) = self.search.find(&numbers, Refinement::None, false, scratch) {
            match (estimate.flag, found.flag) {
                (Quality::Good | Quality::OutOfBand, flag @ Quality::NoSignal) => {
                    estimate = GateVelocity::none(flag)
                }
                (Quality::Good, flag) => estimate.flag = flag,
                _ => {}
            }
            (estimate.power, estimate.detection) = (self.search.power(found.sum), found.peak);
            estimate.spread_m2_s2 = f64::NAN;
        }
        (scratch.model, scratch.numbers) = (model, numbers);
        estimate
    }
}
