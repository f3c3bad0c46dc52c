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
use crate::spectrum::ZoomSpectrum;
use crate::window::{Sampling, Scratch, SignalKind};

/// Which spectrum a model is read by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    Spectrum,
    Capon,
    Pole,
}

/// The common part: a model of the correlogram and the search on one over a polynomial.
#[derive(Debug, Clone)]
struct ModelPeak {
    reading: Reading,
    order: usize,
    choice: OrderChoice,
    lags: usize,
    kind: SignalKind,
    sampling: Sampling,
    zoom: ZoomSpectrum,
    whole: ZoomSpectrum,
    padded: usize,
    search: PeakSearch,
    refinement: Refinement,
    /// Weights of the lags for the test against noise.
    lag_weights: Vec<f64>,
}

/// Hann weights of the lags 0 .. `order` of a model: those of the spectrum whose peak its test against noise takes.
#[must_use]
pub fn model_lag_weights(order: usize) -> Vec<f64> {
    let turn = std::f64::consts::PI / (order + 1) as f64;
    (0..=order).map(|m| 0.5 + 0.5 * (turn * m as f64).cos()).collect()
}

impl ModelPeak {
    fn new(
        reading: Reading,
        sampling: &Sampling,
        kind: SignalKind,
        lags: usize,
        order: usize,
        padded: usize,
        refinement: Refinement,
    ) -> Result<Self, Error> {
        check_order(order, lags)?;
        let search = PeakSearch::new(sampling, kind, padded, lags)?;
        let distinct = match kind {
            SignalKind::Real => padded / 2 + 1,
            SignalKind::Complex => padded,
        };
        let spacing_hz = sampling.sample_rate_hz / padded as f64;
        let grid_hz: Vec<f64> = (0..distinct).map(|k| k as f64 * spacing_hz).collect();
        Ok(Self {
            reading,
            order,
            choice: OrderChoice::Fixed,
            lags,
            kind,
            sampling: *sampling,
            zoom: ZoomSpectrum::new(kind, order + 1, sampling, &search.band.with_neighbours_hz())?,
            whole: ZoomSpectrum::new(kind, order + 1, sampling, &grid_hz)?,
            padded,
            search,
            refinement,
            lag_weights: model_lag_weights(order),
        })
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        if let Some(flag) = unusable(mean) {
            return GateVelocity::none(flag);
        }
        let mut model = std::mem::take(&mut scratch.model);
        let mut numbers = std::mem::take(&mut scratch.numbers);
        let mut band = std::mem::take(&mut scratch.band);
        let solved = model.solve(mean, self.kind, self.order, &mut numbers).and_then(|()| self.choose(&mut model));
        let mut estimate = match solved {
            Ok(()) => self.read(&model, mean, &mut numbers, &mut band, &mut scratch.density),
            Err(_) => GateVelocity::none(Quality::Invalid),
        };
        // the density of a model is not linear in the correlogram: power and detection are those of its lags
        numbers.clear();
        numbers.extend(
            mean.chunks(self.kind.lag_numbers(1))
                .zip(&self.lag_weights)
                .flat_map(|(lag, w)| lag.iter().map(move |r| r * w)),
        );
        if self.zoom.density_into(&numbers, &mut band).is_ok() {
            (estimate.power, estimate.detection) = self.search.power_and_detection(&band);
        }
        scratch.model = model;
        scratch.numbers = numbers;
        scratch.band = band;
        estimate
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
        mean: &[f64],
        numbers: &mut Vec<f64>,
        band: &mut Vec<f64>,
        grid: &mut Vec<f64>,
    ) -> GateVelocity {
        model.inverse_lags(self.kind, self.reading == Reading::Capon, numbers);
        numbers.resize(self.kind.lag_numbers(self.order + 1), 0.0);
        if self.zoom.density_into(numbers, band).is_err() {
            return GateVelocity::none(Quality::Invalid);
        }
        // a pole on the circle to rounding must not turn the density negative or infinite
        let least = f64::MIN_POSITIVE.max(1e-300 / model.noise_power);
        let invert = |values: &mut Vec<f64>| values.iter_mut().for_each(|value| *value = value.max(least).recip());
        invert(band);
        let sides = if self.kind == SignalKind::Real { 2.0 } else { 1.0 };
        let found = self.search.locate(band, self.refinement, |_, sum| {
            // what holds half of the power is no sidelobe
            if sides * sum / self.padded as f64 >= 0.5 * mean[0] {
                return None;
            }
            self.whole.density_into(numbers, grid).ok()?;
            let lowest = grid.iter().copied().fold(f64::INFINITY, f64::min);
            let place = grid.iter().position(|value| *value == lowest)?;
            let from_zero = place.min(self.padded - place) as f64 / self.padded as f64;
            Some((lowest.max(least).recip(), from_zero))
        });
        let frequency_hz = self.search.band.frequency_hz(found.bin);
        let estimate = self.search.velocity(&found, frequency_hz);
        if self.reading == Reading::Pole && found.flag == Quality::Good {
            self.at_pole(model, estimate)
        } else {
            estimate
        }
    }

    /// The same estimate at the pole nearest to the circle; out of band if none lies in it.
    fn at_pole(&self, model: &Autoregression, estimate: GateVelocity) -> GateVelocity {
        match model.nearest_pole(&self.sampling) {
            Ok(Some((frequency_hz, _))) => {
                GateVelocity { velocity_m_s: self.sampling.velocity_m_s(frequency_hz), ..estimate }
            }
            Ok(None) => GateVelocity { flag: Quality::OutOfBand, ..estimate },
            Err(_) => GateVelocity::none(Quality::Invalid),
        }
    }
}

macro_rules! model_estimator {
    ($(#[$doc:meta])* $name:ident, $reading:ident, $(#[$new_doc:meta])*) => {
        $(#[$doc])*
        #[derive(Debug, Clone)]
        pub struct $name(ModelPeak);

        impl $name {
            $(#[$new_doc])*
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
                ModelPeak::new(Reading::$reading, sampling, kind, lags, order, padded_samples, refinement).map(Self)
            }

            /// The same with the order chosen for each estimate; `order` is then the largest.
            #[must_use]
            pub fn choosing(mut self, choice: OrderChoice) -> Self {
                self.0.choice = choice;
                self
            }
        }

        impl Estimator for $name {
            fn statistic_len(&self) -> usize {
                self.0.kind.lag_numbers(self.0.lags)
            }

            fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
                self.0.estimate(mean, scratch)
            }
        }
    };
}

model_estimator!(
    /// CA: peak of the autoregressive spectrum of the accumulated correlogram in the detector band.
    AutoregressivePeak,
    Spectrum,
    /// Plans AR(`order`) of correlograms with `lags` lags and a search over `padded_samples` frequencies.
    ///
    /// The chapter uses order 16; 2048 frequencies or more resolve its peaks. [`Refinement::Exact`] counts as
    /// the parabola. Only `order` + 1 lags are needed.
);

model_estimator!(
    /// Velocity of the pole nearest to the unit circle in the detector band, of the autoregressive model of the
    /// accumulated correlogram.
    ///
    /// Width, SNR, quality and flags are those of the model's spectrum.
    AutoregressivePole,
    Pole,
    /// Plans AR(`order`) of correlograms with `lags` lags; `padded_samples` frequencies serve the quality figures.
);

model_estimator!(
    /// Peak of Capon's minimum-variance spectrum of the accumulated correlogram in the detector band.
    CaponPeak,
    Capon,
    /// Plans filters of `order` + 1 samples for correlograms with `lags` lags, and a search over `padded_samples` frequencies.
    ///
    /// [`Refinement::Exact`] counts as the parabola. The width of its peaks says little: they narrow with the SNR.
);
