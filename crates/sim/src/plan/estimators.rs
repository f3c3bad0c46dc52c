//! The estimator of a scene: statistic of the windows, estimator of their mean, the test against
//! noise, models of all for the bound and for fits.

use crate::Error;
use crate::interpolation::{interpolate, linspace};
use crate::plan::instrument::Instrument;
use crate::scene::{NoiseModel, Scene};
use num_complex::Complex;
use std::f64::consts::{PI, TAU};
use wakescope_estimate::bound::{Noise, RecordModel};
use wakescope_estimate::estimators::NoiseTest;
use wakescope_estimate::map::WindowCovariance;
use wakescope_estimate::spectrum::{ShortCorrelogram, Taper};
use wakescope_estimate::window::Sample;
use wakescope_estimate::{
    Correlogram, Estimator, Sampling, Scratch, SignalKind, SpectralPeak, Statistic,
};
use wakescope_signal::Pulse;

/// Density of noise outside its band over that inside, which keeps covariances regular.
const NOISE_FLOOR: f64 = 1e-6;

/// A statistic and the weights of the lags of its windows.
type WeightedStatistic<S> = (Box<dyn Statistic<S>>, Vec<f64>);

/// The statistic of a scene: some methods need few lags of windows without weighting.
fn statistic<S: Sample>(scene: &Scene, tapers: &[Taper]) -> Result<WeightedStatistic<S>, Error> {
    let e = &scene.estimator;
    if let Some(lags) = e.few_lags() {
        let few = ShortCorrelogram::<S>::new(e.window_samples, lags)?;
        let weights = few.lag_weights();
        return Ok((Box::new(few), weights));
    }
    let all = Correlogram::<S>::with_tapers(tapers.to_vec())?;
    let weights = all.lag_weights();
    Ok((Box::new(all), weights))
}

/// Lags of a line at a velocity, as stored for signals of a kind; `sizes` are their absolute values.
fn lags_at(sampling: &Sampling, kind: SignalKind, velocity_m_s: f64, sizes: &[f64]) -> Vec<f64> {
    let turn = TAU * sampling.frequency_hz(velocity_m_s) * sampling.period_s();
    let mut numbers = Vec::with_capacity(kind.lag_numbers(sizes.len()));
    for (m, &size) in sizes.iter().enumerate() {
        let lag = Complex::from_polar(size, turn * m as f64);
        numbers.push(lag.re);
        if kind == SignalKind::Complex {
            numbers.push(lag.im);
        }
    }
    numbers
}

/// Second-order model of the record of a pulse of the scene in a uniform wind, for the bound; a
/// scene without noise has that of white noise.
///
/// # Errors
/// Fails if the estimators refuse the scene; a checked scene is not refused.
pub(crate) fn record_model(scene: &Scene, pulse: &Pulse) -> Result<RecordModel, Error> {
    let noise = match scene.noise_spectrum() {
        Some(Noise::Band { .. }) => Noise::Band { floor: NOISE_FLOOR },
        _ => Noise::White,
    };
    Ok(RecordModel::new(
        &scene.sampling()?,
        scene.signal_kind(),
        noise,
        scene.pulse_correlation(pulse),
        scene.pulse.is_gaussian(),
    )?)
}

/// Covariance between windows of one pulse: of speckle of unit power, and of noise of unit power
/// in the detector band.
///
/// # Errors
/// Fails if the estimators refuse the scene; a checked scene is not refused.
pub(crate) fn window_covariance(scene: &Scene, pulse: &Pulse) -> Result<WindowCovariance, Error> {
    let e = &scene.estimator;
    let d = &scene.detector;
    let window = scene.weighting().weights(e.window_samples)?;
    let correlation = scene.real_pulse_correlation(pulse);
    // Half of a real signal and half of its noise are at the frequency of the peak.
    let band = d.bandwidth_hz / d.sampling_hz;
    Ok(WindowCovariance::new(
        &window,
        e.window_step_samples,
        scene.samples_per_record(),
        |lag| correlation.get(lag).copied().unwrap_or(0.0),
        |lag| noise_covariance(d.noise, band, lag),
    )?)
}

/// Covariance of noise of unit power in the detector band, `band` cycles per sample wide, at a lag in
/// samples, its carrier removed.
fn noise_covariance(noise: NoiseModel, band: f64, lag: usize) -> f64 {
    match (noise, lag) {
        (NoiseModel::None, _) => 0.0,
        (NoiseModel::White, 0) => 1.0 / band,
        (NoiseModel::White, _) => 0.0,
        (NoiseModel::BandLimited, 0) => 1.0,
        (NoiseModel::BandLimited, _) => (PI * band * lag as f64).sin() / (PI * band * lag as f64),
    }
}

/// Statistic and estimator of a scene.
pub struct Toolkit<S> {
    /// Numbers of each window.
    pub statistic: Box<dyn Statistic<S>>,
    /// Velocity of their mean.
    pub estimator: Box<dyn Estimator>,
    /// The test against noise, if the scene has noise.
    pub test: Option<NoiseTest>,
    /// Response of the estimator to the mean statistic of the scene's noise.
    pub noise: NoiseResponse,
}

impl<S: Sample> Toolkit<S> {
    /// Plans the estimator of a scene for samples of its kind and windows of a signal-to-noise ratio
    /// `snr`, a power ratio.
    ///
    /// # Errors
    /// Fails if the estimators refuse the scene, for example if a covariance cannot be diagonalised.
    pub fn new(scene: &Scene, instrument: &Instrument, snr: f64) -> Result<Self, Error> {
        let method = scene.estimator.method.behaviour();
        let tapers = method.tapers(scene, &instrument.pulse, snr)?;
        let (statistic, lag_weights) = statistic::<S>(scene, &tapers)?;
        let estimator = method.estimator(scene, S::KIND, &lag_weights)?;
        let noise = NoiseResponse::new(scene, instrument, &*estimator, &lag_weights)?;
        let test = noise_test(scene, &tapers)?;
        Ok(Self {
            statistic,
            estimator,
            test,
            noise,
        })
    }
}

/// Response of an estimator to the mean statistic of the scene's noise, and of signals beside it;
/// NaN without noise.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseResponse {
    /// Power in the band, A^2.
    pub power_a2: f64,
    /// Highest density in the band, A^2.
    pub density_a2: f64,
    /// Increasing velocities, m/s.
    velocity_m_s: Vec<f64>,
    /// Fraction of the noise's power that is found in the band over that of a signal, at each
    /// velocity: windows spread noise over the edges of its band, and signals near them.
    gain: Vec<f64>,
}

impl NoiseResponse {
    /// The response of an estimator of correlograms whose lags have `lag_weights`.
    fn new(
        scene: &Scene,
        instrument: &Instrument,
        estimator: &dyn Estimator,
        lag_weights: &[f64],
    ) -> Result<Self, Error> {
        let Some(noise) = scene.noise_spectrum() else {
            return Ok(Self {
                power_a2: f64::NAN,
                density_a2: f64::NAN,
                velocity_m_s: Vec::new(),
                gain: Vec::new(),
            });
        };
        let sampling = scene.sampling()?;
        let kind = scene.signal_kind();
        let n = scene.estimator.window_samples;
        let mut lags = noise.expected_correlogram(&sampling, kind, 1.0, &vec![1.0; n])?;
        weigh(&mut lags, kind, lag_weights);
        let of_noise = estimator.estimate(&lags, &mut Scratch::new());
        let pulse = scene.real_pulse_correlation(&instrument.pulse);
        let (low_m_s, high_m_s) = sampling.velocity_limits_m_s();
        let cells = n as f64 * scene.detector.bandwidth_hz / scene.detector.sampling_hz;
        let points = (8.0 * cells).ceil().clamp(65.0, 257.0) as usize;
        let velocity_m_s = linspace(low_m_s, high_m_s, points);
        let mut gain = Vec::with_capacity(points);
        for &velocity_m_s in &velocity_m_s {
            let mut lags = lags_at(&sampling, kind, velocity_m_s, &pulse[..n.min(pulse.len())]);
            weigh(&mut lags, kind, lag_weights);
            let found = estimator.estimate(&lags, &mut Scratch::new());
            gain.push(of_noise.power / found.power);
        }
        let unit_a2 = instrument.receiver.sampled_noise_a2();
        Ok(Self {
            power_a2: of_noise.power * unit_a2,
            density_a2: of_noise.detection * unit_a2,
            velocity_m_s,
            gain,
        })
    }

    /// Signal-to-noise ratio of a signal at a velocity over the excess of the power in the band over
    /// that of the noise; NaN without a velocity.
    pub fn gain(&self, velocity_m_s: f64) -> f64 {
        if velocity_m_s.is_nan() {
            f64::NAN
        } else {
            interpolate(&self.velocity_m_s, &self.gain, velocity_m_s)
        }
    }
}

/// Multiplies lags, stored as for signals of a kind, by their weights; lags without a weight are
/// dropped.
fn weigh(lags: &mut Vec<f64>, kind: SignalKind, lag_weights: &[f64]) {
    let per_lag = kind.lag_numbers(1);
    for (lag, weight) in lags.chunks_mut(per_lag).zip(lag_weights) {
        for number in lag {
            *number *= weight;
        }
    }
    lags.truncate(per_lag * lag_weights.len());
}

/// The bias of an estimator: what it finds in the mean spectrum of air at one velocity in the scene's
/// noise.
pub(crate) struct ExpectedBias {
    estimator: Box<dyn Estimator>,
    sampling: Sampling,
    kind: SignalKind,
    /// Mean statistic of a signal of unit power at rest, by lag.
    signal: Vec<f64>,
    /// Mean statistic of noise of unit power in the band.
    noise: Vec<f64>,
}

impl ExpectedBias {
    /// The bias of an estimator that is planned for windows whose signal is as strong as the noise,
    /// unless the scene requests another ratio; none without noise.
    ///
    /// # Errors
    /// Fails if the estimators refuse the scene; a checked scene is not refused.
    pub(crate) fn new(scene: &Scene, instrument: &Instrument) -> Result<Option<Self>, Error> {
        let kind = scene.signal_kind();
        let sampling = scene.sampling()?;
        let pulse = &instrument.pulse;
        let Some(noise) = scene.noise_spectrum() else {
            return Ok(None);
        };
        let method = scene.estimator.method.behaviour();
        let tapers = method.tapers(scene, pulse, 1.0)?;
        // Real and complex samples have the same weights of lags.
        let (_, lag_weights) = statistic::<f64>(scene, &tapers)?;
        let estimator = method.estimator(scene, kind, &lag_weights)?;
        let noise = noise.expected_correlogram(&sampling, kind, 1.0, &lag_weights)?;
        let mut signal = Vec::with_capacity(lag_weights.len());
        for (weight, lag) in lag_weights.iter().zip(scene.real_pulse_correlation(pulse)) {
            signal.push(weight * lag);
        }
        Ok(Some(Self {
            estimator,
            sampling,
            kind,
            signal,
            noise,
        }))
    }

    /// The estimated velocity minus the true one, m/s, at a signal-to-noise ratio.
    pub(crate) fn m_s(&self, velocity_m_s: f64, snr: f64) -> f64 {
        let sizes: Vec<f64> = self.signal.iter().map(|power| snr * power).collect();
        let mut mean = lags_at(&self.sampling, self.kind, velocity_m_s, &sizes);
        for (number, noise) in mean.iter_mut().zip(&self.noise) {
            *number += noise;
        }
        let found = self.estimator.estimate(&mean, &mut Scratch::new());
        found.velocity_m_s - velocity_m_s
    }
}

/// Distance of the frequencies of a scene's spectra and the largest error of the refined frequency of
/// a line between them, m/s.
///
/// # Errors
/// Fails if the estimators refuse the scene; a checked scene is not refused.
pub(crate) fn grid_step_and_bias_m_s(scene: &Scene) -> Result<(f64, f64), Error> {
    let e = &scene.estimator;
    let sampling = scene.sampling()?;
    let kind = scene.signal_kind();
    let weights = Correlogram::<f64>::new(scene.weighting(), e.window_samples)?.lag_weights();
    let peak = SpectralPeak::new(&sampling, kind, &weights, e.padded_samples, e.refinement)?;
    let step_m_s =
        0.5 * scene.laser.wavelength_m * scene.detector.sampling_hz / e.padded_samples as f64;
    let (low_m_s, high_m_s) = sampling.velocity_limits_m_s();
    let mut bias_m_s = 0.0_f64;
    for part in -32..32 {
        let velocity_m_s = 0.5 * (low_m_s + high_m_s) + step_m_s * f64::from(part) / 64.0;
        let lags = lags_at(&sampling, kind, velocity_m_s, &weights);
        let found = peak.estimate(&lags, &mut Scratch::new());
        bias_m_s = bias_m_s.max((found.velocity_m_s - velocity_m_s).abs());
    }
    Ok((step_m_s, bias_m_s))
}

/// Correlogram of all lags and the scene's estimator of it, for the mean of very many pulses.
pub(crate) enum Response {
    /// Of real samples.
    Real(Correlogram<f64>, Box<dyn Estimator>),
    /// Of complex samples.
    Complex(Correlogram<Complex<f64>>, Box<dyn Estimator>),
}

/// The response of a scene at a signal-to-noise ratio `snr`.
///
/// # Errors
/// Fails if the estimators refuse the scene; a checked scene is not refused.
pub(crate) fn response(scene: &Scene, pulse: &Pulse, snr: f64) -> Result<Response, Error> {
    let kind = scene.signal_kind();
    let method = scene.estimator.method.behaviour();
    let tapers = method.tapers(scene, pulse, snr)?;
    Ok(match kind {
        SignalKind::Real => {
            let all = Correlogram::with_tapers(tapers)?;
            let estimator = method.estimator(scene, kind, &all.lag_weights())?;
            Response::Real(all, estimator)
        }
        SignalKind::Complex => {
            let all = Correlogram::with_tapers(tapers)?;
            let estimator = method.estimator(scene, kind, &all.lag_weights())?;
            Response::Complex(all, estimator)
        }
    })
}

/// The test against noise; none without noise.
fn noise_test(scene: &Scene, tapers: &[Taper]) -> Result<Option<NoiseTest>, Error> {
    let e = &scene.estimator;
    let Some(noise) = scene.noise_spectrum() else {
        return Ok(None);
    };
    let method = e.method.behaviour();
    Ok(Some(NoiseTest::new(
        &scene.sampling()?,
        &scene.gates()?,
        tapers,
        method.test_lag_weights().as_deref(),
        method.frequencies(e),
        noise,
    )?))
}
