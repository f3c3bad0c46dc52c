//! Estimators that fit a model to the accumulated correlogram: CA (the AR spectrum's peak), its pole, and Capon.
//!
//! Computes the peak in the detector band of the AR spectrum (32), of order 16 in the literal form; the pole of the
//! same model that is nearest to the unit circle; and the peak of Capon's minimum-variance spectrum (p + 1) / (e^H
//! R^-1 e) (Capon 1969). Their inverse spectra are trigonometric polynomials of the order of the model and so cheap
//! at any frequency. Check: spectra evaluated frequency by frequency, e^H R^-1 e with R inverted, a stored window,
//! and tones.

use crate::error::Error;
use crate::estimators::search::{PeakSearch, highest, unusable};
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
        let lag_weights = model_lag_weights(order);
        let search = PeakSearch::new(sampling, kind, padded, &lag_weights)?;
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
            search,
            refinement,
            lag_weights,
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
            Ok(()) => self.read(&model, &mut numbers, &mut band),
            Err(_) => GateVelocity::none(Quality::Invalid),
        };
        // The density of a model is not linear in the correlogram: power and detection are those of its lags, which also tell what
        // lines outside leak. How wide a spectrum is a model does not show: its peaks narrow with the signal-to-noise ratio.
        numbers.clear();
        numbers.extend(
            mean.chunks(self.kind.lag_numbers(1))
                .zip(&self.lag_weights)
                .flat_map(|(lag, w)| lag.iter().map(move |r| r * w)),
        );
        if self.zoom.density_into(&numbers, &mut band).is_ok() {
            let found = self.search.locate(&band, Refinement::None, &numbers, || {
                self.whole.density_into(&numbers, &mut scratch.density).ok()?;
                let (place, highest) = highest(&scratch.density);
                Some((highest, place as f64 / self.search.padded() as f64))
            });
            match (estimate.flag, found.flag) {
                (Quality::Good | Quality::OutOfBand, flag @ Quality::NoSignal) => estimate = GateVelocity::none(flag),
                (Quality::Good, flag) => estimate.flag = flag,
                _ => {}
            }
            (estimate.power, estimate.detection) = (self.search.power(found.sum), found.peak);
            estimate.spread_m2_s2 = f64::NAN;
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

    fn read(&self, model: &Autoregression, numbers: &mut Vec<f64>, band: &mut Vec<f64>) -> GateVelocity {
        model.inverse_lags(self.kind, self.reading == Reading::Capon, numbers);
        numbers.resize(self.kind.lag_numbers(self.order + 1), 0.0);
        if self.zoom.density_into(numbers, band).is_err() {
            return GateVelocity::none(Quality::Invalid);
        }
        // a pole on the circle to rounding must not turn the density negative or infinite
        let least = f64::MIN_POSITIVE.max(1e-300 / model.noise_power);
        band.iter_mut().for_each(|value| *value = value.max(least).recip());
        let found = self.search.locate(band, self.refinement, &[], || None);
        let estimate = self.search.velocity(&found, self.search.band.frequency_hz(found.bin));
        match self.reading {
            Reading::Pole if found.flag == Quality::Good => self.at_pole(model, found.peak, estimate),
            _ => estimate,
        }
    }

    /// The same estimate at the pole nearest to the circle, ambiguous where the spectrum does not peak there; out of band if none lies
    /// in it.
    fn at_pole(&self, model: &Autoregression, peak: f64, estimate: GateVelocity) -> GateVelocity {
        match model.nearest_pole(&self.sampling) {
            Ok(Some((frequency_hz, _))) => {
                let is_beside = 2.0 * model.density(frequency_hz, &self.sampling) < peak;
                let flag = if is_beside { Quality::Ambiguous } else { estimate.flag };
                GateVelocity { velocity_m_s: self.sampling.velocity_m_s(frequency_hz), flag, ..estimate }
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
    /// SNR, quality and flags are those of the model's spectrum; where that has less than half of its peak at the pole, the estimate is
    /// [`Quality::Ambiguous`].
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
    /// [`Refinement::Exact`] counts as the parabola.
);
