//! Maximum likelihood of velocity and gradient together, for real or complex windows of a known pulse.
//!
//! For each gradient of a list the signal covariance S is that of [`GradientModel`]; M is the noise, and for real
//! windows the mirror image of the signal too, wherever in the detector band that may lie. With M^-1/2 S M^-1/2 = V
//! mu V^H and h_i = M^-1/2 v_i the likelihood depends on the velocity through D = sum over i of P mu_i / (1 + P mu_i)
//! |h_i^H E^H x|^2, E the carrier: a sum of tapered periodograms that accumulates over windows. The unknown level of
//! the signal is the one that suits best, so that -n ln(energy - D) - sum ln(1 + P mu_i) is the logarithm of the
//! likelihood. In white noise n is the number of samples of the window and the energy that of all of them (half of
//! both for real ones: the side of the band); in band-limited noise both are those of the band.
//!
//! What is left of the mirror image shifts the peak by a known amount, a smooth function of the velocity, which is
//! tabulated from the expected statistic and taken away. So is what the parabola through the likelihoods of three gradients
//! of the list reads beside the true one. Check: the bound of [`GradientModel::bound`]; with the
//! gradient 0 alone, that of [`WindowModel::bound_m_s`](crate::bound::WindowModel::bound_m_s).

use ndarray::Array2;
use num_complex::Complex;

use crate::bound::{GradientModel, Noise};
use crate::error::{Error, finite, increasing, length, not_empty, positive};
use crate::estimators::gradient_tapers::{LagWeights, Tapers, band_lag, tapers};
use crate::estimators::search::{PeakSearch, unusable};
use crate::estimators::{Estimator, GateVelocity, NoiseTest, Quality, Refinement, Statistic};
use crate::spectrum::transform::WindowTransform;
use crate::window::{Gates, Sample, Scratch, SignalKind};

type C64 = Complex<f64>;

/// True gradients between two of the list whose readings are tabulated.
const READINGS: u32 = 16;

/// Velocity, gradient and the rest of an estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradientVelocity {
    /// The velocity at the centre of the window, with its flag and figures.
    pub velocity: GateVelocity,
    /// Gradient of the radial velocity along the line of sight, dv/dR \[1/s\]; NaN without a velocity.
    pub gradient_per_s: f64,
}

/// The tapered correlograms of all gradients and the energy in the band.
#[derive(Clone)]
pub struct GradientStatistic<S> {
    tapers: Vec<Tapers>,
    /// What the lags 0, 1, ... of the window weigh in the energy inside the band.
    band_lags: Vec<C64>,
    transform: WindowTransform,
    sample: std::marker::PhantomData<fn(S)>,
}

/// The peak of the likelihood over velocity and gradient.
#[derive(Clone)]
pub struct GradientPeak {
    gradient_per_s: Vec<f64>,
    /// The one nearest to 0, whose spectrum is tested against noise.
    slowest: usize,
    spread: Vec<f64>,
    samples_in_band: f64,
    search: PeakSearch,
    /// For each gradient what the peak reads for increasing true velocities \[m/s\]: (read, true); empty for complex samples.
    corrections: Vec<Vec<(f64, f64)>>,
    /// What the parabola through the likelihoods reads for increasing true gradients \[1/s\]: (read, true).
    gradient_readings: Vec<(f64, f64)>,
}

/// Statistic and estimator of the likelihood, planned together.
#[derive(Clone)]
pub struct GradientLikelihood<S> {
    /// Tapered correlograms of each window.
    pub statistic: GradientStatistic<S>,
    /// Search over velocity and gradient.
    pub estimator: GradientPeak,
}

impl<S: Sample> GradientLikelihood<S> {
    /// Plans the estimator for windows like those of `model` at signal-to-noise ratio `snr` (in the detector band).
    ///
    /// The gradients \[1/s\] increase; between them the likelihood is interpolated, and what that reads for known gradients
    /// is tabulated, so that 0.2 1/s apart will do for a pulse of 200 ns. With a single gradient only the velocity is sought. Each gradient costs some
    /// complex transforms of 2 N samples per window.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if `snr` is not above 0 or the gradients do not increase, [`Error::Empty`] without
    /// gradients, [`Error::Band`] for an impossible band, [`Error::Linalg`] if the covariance cannot be diagonalised.
    pub fn new(
        model: &GradientModel,
        snr: f64,
        gradient_per_s: &[f64],
        padded_samples: usize,
    ) -> Result<Self, Error> {
        positive("snr", snr)?;
        not_empty("gradient_per_s", gradient_per_s.len())?;
        gradient_per_s
            .iter()
            .try_for_each(|&g| finite("gradient_per_s", g))?;
        increasing("gradient_per_s", gradient_per_s)?;
        let (sampling, n) = (&model.sampling, model.window_samples);
        sampling.validate_for(S::KIND)?;
        let share = (sampling.band_hz.1 - sampling.band_hz.0) / sampling.sample_rate_hz;
        let tapers = gradient_per_s
            .iter()
            .map(|&g| tapers(model, g, snr * share, S::KIND))
            .collect::<Result<Vec<_>, _>>()?;
        let size = |&k: &usize| gradient_per_s[k].abs();
        let slowest = (0..tapers.len())
            .min_by(|a, b| size(a).total_cmp(&size(b)))
            .unwrap_or(0);
        // Tapers of other gradients are these with a chirp, which takes out that of the wind.
        let tone = LagWeights::new(&tapers[slowest], n).expected_lags(&Array2::ones((n, n)));
        let weights: Vec<f64> = tone
            .iter()
            .step_by(2)
            .map(|weight| weight / tone[0])
            .collect();
        let search = PeakSearch::new(
            sampling,
            SignalKind::Complex,
            (padded_samples, 4 * n),
            &weights,
        )?;
        let white = model.noise == Noise::White;
        let sides = if S::KIND == SignalKind::Real {
            0.5
        } else {
            1.0
        };
        let band_lags = match white {
            true => std::iter::once(Complex::from(sides))
                .chain(std::iter::repeat_n(Complex::ZERO, n - 1))
                .collect(),
            false => (0..n).map(|m| band_lag(sampling, m, share)).collect(),
        };
        let estimator = GradientPeak {
            corrections: Vec::new(),
            gradient_readings: Vec::new(),
            gradient_per_s: gradient_per_s.to_vec(),
            slowest,
            spread: tapers.iter().map(|tapers| tapers.spread).collect(),
            samples_in_band: if white {
                sides * n as f64
            } else {
                share * n as f64
            },
            search,
        };
        let transform = WindowTransform::new(SignalKind::Complex, 2 * n);
        let statistic = GradientStatistic {
            tapers,
            band_lags,
            transform,
            sample: std::marker::PhantomData,
        };
        let mut planned = Self {
            statistic,
            estimator,
        };
        if S::KIND == SignalKind::Real {
            let read = (0..gradient_per_s.len()).map(|k| planned.readings(model, snr, k));
            planned.estimator.corrections = read.collect::<Result<_, _>>()?;
        }
        planned.estimator.gradient_readings = planned.gradient_readings(model, snr)?;
        Ok(planned)
    }
}

impl<S: Sample> GradientLikelihood<S> {
    /// The test of its estimates against a noise: of the spectrum of the gradient nearest to 0.
    ///
    /// # Errors
    /// As [`NoiseTest::new`].
    pub fn noise_test(&self, gates: &Gates, noise: Noise) -> Result<NoiseTest, Error> {
        let (estimator, padded) = (&self.estimator, self.estimator.search.padded);
        let tapers = &self.statistic.tapers[estimator.slowest].weights;
        NoiseTest::of_complex(
            &estimator.search.sampling,
            gates,
            tapers,
            None,
            padded,
            noise,
        )
    }

    /// The mean statistic of windows whose samples have the autocovariance `lags`, of all lags of a window: that of a noise
    /// ([`Noise::expected_correlogram`] without weighting) or of a signal. What the estimator finds in it is that of both in its spectra.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of lags.
    pub fn mean_statistic(&self, lags: &[f64]) -> Result<Vec<f64>, Error> {
        let n = self.statistic.band_lags.len();
        length("lags", S::KIND.lag_numbers(n), lags.len())?;
        let covariance = Array2::from_shape_fn((n, n), |(i, j)| {
            let lag = S::KIND.lag(lags, i.abs_diff(j));
            if i >= j { lag } else { lag.conj() }
        });
        Ok(self
            .statistic
            .expected(&covariance, &self.statistic.lag_weights()))
    }

    /// What the peak of the expected statistic of a gradient of the list reads for true velocities all over the band.
    fn readings(
        &self,
        model: &GradientModel,
        snr: f64,
        k: usize,
    ) -> Result<Vec<(f64, f64)>, Error> {
        let search = &self.estimator.search;
        let sampling = &search.sampling;
        let (low_m_s, high_m_s) = sampling.velocity_limits_m_s();
        // the sidelobes of a taper pass the image twice as fast as the velocity changes: a quarter of one per step
        let step_m_s =
            0.0625 * sampling.wavelength_m * sampling.sample_rate_hz / model.window_samples as f64;
        let steps = ((high_m_s - low_m_s) / step_m_s).ceil().max(1.0);
        let weights = LagWeights::new(&self.statistic.tapers[k], model.window_samples);
        let [envelope, _] = model.envelope(self.estimator.gradient_per_s[k]);
        let mut scratch = Scratch::new();
        let mut readings = Vec::<(f64, f64)>::with_capacity(steps as usize + 1);
        for k in 0..=steps as usize {
            let velocity_m_s = low_m_s + (high_m_s - low_m_s) * k as f64 / steps;
            let lags = weights.expected_lags(&model.of_samples(
                &envelope,
                velocity_m_s,
                snr,
                SignalKind::Real,
            )?);
            search.zoom.density_into(&lags, &mut scratch.band)?;
            let found = search.locate(&scratch.band, Refinement::Parabola, &[], || None);
            let read_m_s = sampling.velocity_m_s(search.band.frequency_hz(found.bin));
            // at the edges of the band the peak leaves it: only increasing readings can be inverted
            if found.flag == Quality::Good && readings.last().is_none_or(|last| last.0 < read_m_s) {
                readings.push((read_m_s, velocity_m_s));
            }
        }
        Ok(readings)
    }

    /// What the estimator reads for true gradients between the first and the last, in the middle of the band.
    fn gradient_readings(&self, model: &GradientModel, snr: f64) -> Result<Vec<(f64, f64)>, Error> {
        let Self {
            statistic,
            estimator,
        } = self;
        let sampling = &estimator.search.sampling;
        let velocity_m_s = sampling.velocity_m_s(0.5 * (sampling.band_hz.0 + sampling.band_hz.1));
        let weights = statistic.lag_weights();
        let mut readings = Vec::<(f64, f64)>::new();
        for pair in estimator.gradient_per_s.windows(2) {
            for part in 0..=READINGS {
                let gradient_per_s =
                    pair[0] + (pair[1] - pair[0]) * f64::from(part) / f64::from(READINGS);
                let [envelope, _] = model.envelope(gradient_per_s);
                let covariance = model.of_samples(&envelope, velocity_m_s, snr, S::KIND)?;
                let found = estimator.velocity_and_gradient(
                    &statistic.expected(&covariance, &weights),
                    &mut Scratch::new(),
                );
                // the ends of the list read themselves however far off the wind: only increasing readings can be inverted
                if found.gradient_per_s.is_finite()
                    && readings
                        .last()
                        .is_none_or(|last| last.0 < found.gradient_per_s)
                {
                    readings.push((found.gradient_per_s, gradient_per_s));
                }
            }
        }
        Ok(readings)
    }
}

impl<S: Sample> Statistic<S> for GradientStatistic<S> {
    fn window_samples(&self) -> usize {
        self.band_lags.len()
    }

    fn statistic_len(&self) -> usize {
        self.tapers.len() * 2 * self.band_lags.len() + 1
    }

    fn evaluate(&self, window: &[S], scratch: &mut Scratch, out: &mut [f64]) {
        let samples = window.iter().map(|sample| sample.to_complex());
        for (tapers, lags) in self
            .tapers
            .iter()
            .zip(out.chunks_exact_mut(2 * window.len()))
        {
            self.transform.reset(scratch);
            for taper in &tapers.weights {
                let weighted = samples
                    .clone()
                    .zip(taper)
                    .map(|(sample, weight)| sample * weight);
                self.transform.add_power(weighted, 1.0, scratch);
            }
            self.transform.lags_of_power(scratch, lags);
        }
        self.transform.reset(scratch);
        self.transform.add_power(samples, 1.0, scratch);
        let mut lags = std::mem::take(&mut scratch.numbers);
        lags.resize(2 * window.len(), 0.0);
        self.transform.lags_of_power(scratch, &mut lags);
        let in_band = |(m, weight): (usize, &C64)| (SignalKind::Complex.lag(&lags, m) * weight).re;
        out[self.tapers.len() * 2 * window.len()] =
            self.band_lags.iter().enumerate().map(in_band).sum();
        scratch.numbers = lags;
    }
}

impl<S: Sample> GradientStatistic<S> {
    /// What products of samples weigh in the lags of each gradient.
    fn lag_weights(&self) -> Vec<LagWeights> {
        self.tapers
            .iter()
            .map(|tapers| LagWeights::new(tapers, self.band_lags.len()))
            .collect()
    }

    /// The mean statistic of windows of that covariance.
    fn expected(&self, covariance: &Array2<C64>, weights: &[LagWeights]) -> Vec<f64> {
        let n = self.band_lags.len();
        let mut numbers: Vec<f64> = weights
            .iter()
            .flat_map(|weights| weights.expected_lags(covariance))
            .collect();
        let lag = |m: usize| (0..n - m).map(|k| covariance[[k + m, k]]).sum::<C64>();
        numbers.push(
            self.band_lags
                .iter()
                .enumerate()
                .map(|(m, weight)| (lag(m) * weight).re)
                .sum(),
        );
        numbers
    }
}

impl GradientPeak {
    /// Velocity and gradient for the mean statistic `mean`.
    pub fn velocity_and_gradient(&self, mean: &[f64], scratch: &mut Scratch) -> GradientVelocity {
        let none = |flag| GradientVelocity {
            velocity: GateVelocity::none(flag),
            gradient_per_s: f64::NAN,
        };
        if mean.len() != self.statistic_len() {
            return none(Quality::Invalid);
        }
        if let Some(flag) = unusable(mean) {
            return none(flag);
        }
        let energy = mean[mean.len() - 1];
        let mut best: Option<(usize, f64, GateVelocity)> = None;
        let mut at_rest = (f64::NAN, f64::NAN);
        let mut found = Vec::with_capacity(self.spread.len());
        for (k, (lags, spread)) in mean
            .chunks_exact(self.search.statistic_len())
            .zip(&self.spread)
            .enumerate()
        {
            let is_real = !self.corrections.is_empty();
            let Some(located) = self
                .search
                .find(lags, Refinement::Parabola, is_real, scratch)
            else {
                return none(Quality::Invalid);
            };
            let estimate = self
                .search
                .velocity(&located, self.search.band.frequency_hz(located.bin));
            if k == self.slowest {
                at_rest = (estimate.power, estimate.detection);
            }
            // a window of a noise-free line leaves no energy: the logarithm stays finite
            let rest = (energy - located.peak)
                .max(1e-12 * energy)
                .max(f64::MIN_POSITIVE);
            let likelihood = -self.samples_in_band * rest.ln() - spread;
            let read_m_s = estimate.velocity_m_s;
            found.push((
                likelihood,
                self.corrections
                    .get(k)
                    .map_or(read_m_s, |readings| truth(readings, read_m_s)),
            ));
            if best
                .as_ref()
                .is_none_or(|(_, highest, _)| likelihood > *highest)
            {
                best = Some((k, likelihood, estimate));
            }
        }
        let Some((k, _, estimate)) = best else {
            return none(Quality::Invalid);
        };
        let (read_per_s, velocity_m_s) = self.between(&found, k);
        let gradient_per_s = truth(&self.gradient_readings, read_per_s);
        let (power, detection) = at_rest;
        GradientVelocity {
            velocity: GateVelocity {
                velocity_m_s,
                power,
                detection,
                ..estimate
            },
            gradient_per_s,
        }
    }

    /// Gradient and velocity at the top of the parabola through three gradients.
    fn between(&self, found: &[(f64, f64)], k: usize) -> (f64, f64) {
        let at = self.gradient_per_s[k];
        if k == 0 || k + 1 >= found.len() {
            return (at, found[k].1);
        }
        let (left, right) = (
            self.gradient_per_s[k - 1] - at,
            self.gradient_per_s[k + 1] - at,
        );
        // Newton's divided differences about the middle
        let slopes = |value: fn(&(f64, f64)) -> f64| {
            let (down, up) = (
                value(&found[k - 1]) - value(&found[k]),
                value(&found[k + 1]) - value(&found[k]),
            );
            let curvature = (up / right - down / left) / (right - left);
            (up / right - curvature * right, curvature)
        };
        let (slope, curvature) = slopes(|pair| pair.0);
        let step = if curvature < 0.0 {
            (-0.5 * slope / curvature).clamp(0.5 * left, 0.5 * right)
        } else {
            0.0
        };
        let (slope, curvature) = slopes(|pair| pair.1);
        let moved_m_s = slope * step + curvature * step * step;
        // two peaks of like height may change places from one gradient to the next
        let sampling = &self.search.sampling;
        let resolution_m_s = 0.5 * sampling.wavelength_m * sampling.sample_rate_hz
            / self.search.statistic_len() as f64;
        let moved_m_s = if moved_m_s.abs() < resolution_m_s {
            moved_m_s
        } else {
            0.0
        };
        (at + step, found[k].1 + moved_m_s)
    }
}

/// The true value of which `value` is read, linear between the (read, true) of a table; beyond its ends as at the ends.
fn truth(readings: &[(f64, f64)], value: f64) -> f64 {
    let above = readings.partition_point(|(read, _)| *read < value);
    match (readings.get(above.wrapping_sub(1)), readings.get(above)) {
        (Some(low), Some(high)) => low.1 + (high.1 - low.1) * (value - low.0) / (high.0 - low.0),
        (Some(edge), None) | (None, Some(edge)) => value + edge.1 - edge.0,
        (None, None) => value,
    }
}

impl Estimator for GradientPeak {
    fn statistic_len(&self) -> usize {
        self.spread.len() * self.search.statistic_len() + 1
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        self.velocity_and_gradient(mean, scratch).velocity
    }
}
