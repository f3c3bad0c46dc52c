//! The estimator of a scene in the words of `estimate`: statistic of the windows, estimator of their mean, models of both.

use crate::Error;
use crate::interpolation::{interpolate, linspace};
use crate::plan::instrument::Instrument;
use crate::scene::{DetectorSignal, Method, NoiseModel, PulseShape, Scene, Weighting};
use ndarray::Array2;
use num_complex::Complex;
use wakescope_estimate::bound::{Noise, RecordModel, WindowModel};
use wakescope_estimate::estimators::{
    FirstMoment, ModelPeak, NoiseTest, PulsePair, likelihood_tapers, model_lag_weights,
};
use wakescope_estimate::spectrum::{ShortCorrelogram, Taper};
use wakescope_estimate::{
    self as estimate, Correlogram, Estimator, Sampling, Scratch, SignalKind, SpectralPeak,
    Statistic,
};
use wakescope_estimate::{map::WindowCovariance, window::Sample};
use wakescope_signal::Pulse;

/// The sampling of the records, in the words of the estimators.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub fn sampling(scene: &Scene) -> Result<Sampling, Error> {
    let d = &scene.detector;
    let lambda_m = scene.laser.wavelength_m;
    let half_hz = 0.5 * d.bandwidth_hz;
    let band_hz = (
        d.intermediate_frequency_hz - half_hz,
        d.intermediate_frequency_hz + half_hz,
    );
    Ok(match d.signal {
        DetectorSignal::IntermediateFrequency => Sampling::new(
            d.sampling_hz,
            d.intermediate_frequency_hz,
            lambda_m,
            band_hz,
        )?,
        DetectorSignal::Baseband => Sampling::baseband(d.sampling_hz, lambda_m, d.bandwidth_hz)?,
    })
}

/// Whether the records are real or complex.
pub fn signal_kind(scene: &Scene) -> SignalKind {
    match scene.detector.signal {
        DetectorSignal::IntermediateFrequency => SignalKind::Real,
        DetectorSignal::Baseband => SignalKind::Complex,
    }
}

/// The windows that are accumulated.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub fn gates(scene: &Scene) -> Result<estimate::Gates, Error> {
    let e = &scene.estimator;
    let first_sample_time_s = 2.0 * scene.scan.range_min_m / crate::SPEED_OF_LIGHT_M_S;
    Ok(estimate::Gates::new(
        e.window_samples,
        e.window_step_samples,
        first_sample_time_s,
    )?)
}

/// The weighting of the windows; the tapers of a likelihood together weigh nearly all samples alike.
pub fn weighting(scene: &Scene) -> estimate::Weighting {
    match scene.estimator.weighting {
        _ if scene.estimator.method.has_own_tapers() => estimate::Weighting::Rectangular,
        Weighting::Gaussian => estimate::Weighting::default(),
        Weighting::Rectangular => estimate::Weighting::Rectangular,
        Weighting::Hann => estimate::Weighting::Hann,
    }
}

/// Real part of the autocorrelation of the pulse at a lag of its samples, its mean frequency taken out; 1 at lag 0.
///
/// `exp(-tau^2/(4 sigma^2))` for a Gaussian.
fn pulse_correlation(scene: &Scene, pulse: &Pulse) -> Vec<f64> {
    let (count, period_s) = (scene.samples_per_record(), 1.0 / scene.detector.sampling_hz);
    if matches!(scene.pulse.shape, PulseShape::Gaussian(_)) {
        let lag = |m: usize| m as f64 * period_s / pulse.sigma_s();
        return (0..count).map(|m| (-0.25 * lag(m).powi(2)).exp()).collect();
    }
    // Fine enough for the spectrum of the pulse; the sum over a smooth pulse that ends at 0 converges fast.
    let parts = (16.0 * pulse.spectral_width_hz() * period_s)
        .ceil()
        .max(1.0) as usize;
    let step_s = period_s / parts as f64;
    let (first_s, last_s) = pulse.support_s();
    let steps = ((last_s - first_s) / step_s).ceil() as usize;
    let turn = -std::f64::consts::TAU * pulse.mean_frequency_hz();
    let at = |i: usize| {
        let time_s = first_s + i as f64 * step_s;
        pulse.envelope_per_sqrt_s(time_s) * Complex::from_polar(1.0, turn * time_s)
    };
    let envelope: Vec<Complex<f64>> = (0..=steps).map(at).collect();
    let lag = |m: usize| -> f64 {
        envelope
            .iter()
            .skip(m * parts)
            .zip(&envelope)
            .map(|(late, early)| (late * early.conj()).re)
            .sum()
    };
    let energy = lag(0);
    (0..count)
        .map(|m| {
            if m * parts <= steps {
                lag(m) / energy
            } else {
                0.0
            }
        })
        .collect()
}

/// Density of noise outside its band over that inside, which keeps covariances regular.
const NOISE_FLOOR: f64 = 1e-6;

/// Correlogram of the windows of a scene; those of the likelihood have tapers that are planned for a signal-to-noise ratio.
///
/// # Errors
/// What the estimators refuse, such as a covariance that cannot be diagonalised.
fn correlogram<S: Sample>(scene: &Scene, pulse: &Pulse, snr: f64) -> Result<Correlogram<S>, Error> {
    let n = scene.estimator.window_samples;
    if !matches!(scene.estimator.method, Method::Likelihood { .. }) {
        return Ok(Correlogram::new(weighting(scene), n)?);
    }
    let correlation = pulse_correlation(scene, pulse);
    let envelope = Array2::from_shape_fn((n, n), |(a, b)| {
        correlation.get(a.abs_diff(b)).copied().unwrap_or(0.0)
    });
    // The tapers are those of white noise and need no inverse, whatever the noise.
    let model = WindowModel::with_envelope(&sampling(scene)?, envelope, Noise::White)?;
    Ok(Correlogram::with_tapers(likelihood_tapers(&model, snr)?)?)
}

/// A statistic, with the weights that its windows give the lags and their tapers.
type Weighted<S> = (Box<dyn Statistic<S>>, Vec<f64>, Vec<Taper>);

/// The statistic of a scene: models of windows without weighting need few lags.
fn statistic<S: Sample>(scene: &Scene, pulse: &Pulse, snr: f64) -> Result<Weighted<S>, Error> {
    let e = &scene.estimator;
    if let Some(lags) = e.few_lags() {
        let few = ShortCorrelogram::<S>::new(e.window_samples, lags)?;
        let (weights, taper) = (few.lag_weights(), Taper::unit(vec![1.0; e.window_samples])?);
        return Ok((Box::new(few), weights, vec![taper]));
    }
    let all = correlogram::<S>(scene, pulse, snr)?;
    let (weights, tapers) = (all.lag_weights(), all.tapers().to_vec());
    Ok((Box::new(all), weights, tapers))
}

/// Signal-to-noise ratio for which a likelihood is planned: as the scene states it, else as it is.
fn planned_snr(scene: &Scene, snr: f64) -> f64 {
    scene
        .estimator
        .method
        .likelihood_snr_db()
        .map_or(snr, |db| 10f64.powf(0.1 * db))
        .clamp(1e-8, 1e8)
}

/// Lags of a line at a velocity, whose sizes are given, as numbers of signals of a kind.
fn lags_at(
    sampling: &Sampling,
    kind: SignalKind,
    velocity_m_s: f64,
    sizes: impl Iterator<Item = f64>,
) -> Vec<f64> {
    let turn = std::f64::consts::TAU * sampling.frequency_hz(velocity_m_s) * sampling.period_s();
    let lag = |(m, size): (usize, f64)| Complex::from_polar(size, turn * m as f64);
    let numbers = kind.lag_numbers(1);
    sizes
        .enumerate()
        .map(lag)
        .flat_map(|lag| [lag.re, lag.im].into_iter().take(numbers))
        .collect()
}

/// Second-order model of the record of a pulse of the scene in a uniform wind, for the bound; white noise stands for none.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub fn record_model(scene: &Scene, pulse: &Pulse) -> Result<RecordModel, Error> {
    let noise = match noise_kind(scene) {
        Some(Noise::Band { .. }) => Noise::Band { floor: NOISE_FLOOR },
        _ => Noise::White,
    };
    let is_gaussian = matches!(scene.pulse.shape, PulseShape::Gaussian(_));
    let correlation = pulse_correlation(scene, pulse);
    Ok(RecordModel::new(
        &sampling(scene)?,
        signal_kind(scene),
        noise,
        correlation,
        is_gaussian,
    )?)
}

/// Covariance between windows of one pulse: of speckle of unit power, and of noise whose power in the detector band is one.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub fn window_covariance(scene: &Scene, pulse: &Pulse) -> Result<WindowCovariance, Error> {
    let (e, d) = (&scene.estimator, &scene.detector);
    let window = weighting(scene).weights(e.window_samples)?;
    let correlation = pulse_correlation(scene, pulse);
    let signal = |lag: usize| correlation.get(lag).copied().unwrap_or(0.0);
    // Half of a real signal and half of its noise stand at the frequency of the peak.
    let band = d.bandwidth_hz / d.sampling_hz;
    let noise = |lag: usize| match (d.noise, lag) {
        (NoiseModel::None, _) => 0.0,
        (NoiseModel::White, 0) => 1.0 / band,
        (NoiseModel::White, _) => 0.0,
        (NoiseModel::BandLimited, 0) => 1.0,
        (NoiseModel::BandLimited, _) => {
            (std::f64::consts::PI * band * lag as f64).sin()
                / (std::f64::consts::PI * band * lag as f64)
        }
    };
    let samples = scene.samples_per_record();
    Ok(WindowCovariance::new(
        &window,
        e.window_step_samples,
        samples,
        signal,
        noise,
    )?)
}

/// Statistic and estimator of a scene.
pub struct Toolkit<S> {
    /// Numbers of each window.
    pub statistic: Box<dyn Statistic<S>>,
    /// Velocity of their mean.
    pub estimator: Box<dyn Estimator>,
    /// The test against noise, if the scene has noise.
    pub test: Option<NoiseTest>,
    /// What the estimator finds in the mean statistic of the scene's noise.
    pub noise: NoiseSeen,
}

/// What an estimator finds in the mean statistic of the scene's noise, and of signals beside it; NaN without noise.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseSeen {
    /// Power in the band, A^2.
    pub power_a2: f64,
    /// Highest density in the band, A^2.
    pub density_a2: f64,
    /// Share of the noise's power that is found in the band over that of a signal, for increasing velocities, m/s: the windows spread
    /// noise over the edges of its band, and signals near them.
    gain: (Vec<f64>, Vec<f64>),
}

impl NoiseSeen {
    /// For an estimator that takes the mean statistic that `seen` makes of the autocovariance of samples.
    fn new(
        scene: &Scene,
        instrument: &Instrument,
        estimator: &dyn Estimator,
        seen: impl Fn(Vec<f64>) -> Vec<f64>,
    ) -> Result<Self, Error> {
        let (Some(noise), sampling, kind) =
            (noise_kind(scene), sampling(scene)?, signal_kind(scene))
        else {
            return Ok(Self {
                power_a2: f64::NAN,
                density_a2: f64::NAN,
                gain: Default::default(),
            });
        };
        let n = scene.estimator.window_samples;
        let found = |lags: Vec<f64>| estimator.estimate(&seen(lags), &mut Scratch::new());
        let of_noise = found(noise.expected_correlogram(&sampling, kind, 1.0, &vec![1.0; n])?);
        let pulse = pulse_correlation(scene, &instrument.pulse);
        let (low_m_s, high_m_s) = sampling.velocity_limits_m_s();
        let cells = n as f64 * scene.detector.bandwidth_hz / scene.detector.sampling_hz;
        let velocity_m_s = linspace(
            low_m_s,
            high_m_s,
            (8.0 * cells).ceil().clamp(65.0, 257.0) as usize,
        );
        let gain = |velocity_m_s: &f64| {
            let lags = lags_at(
                &sampling,
                kind,
                *velocity_m_s,
                pulse.iter().copied().take(n),
            );
            of_noise.power / found(lags).power
        };
        let gain = velocity_m_s.iter().map(gain).collect();
        let unit_a2 = instrument.receiver.noise_variance_a2();
        let (power_a2, density_a2) = (of_noise.power * unit_a2, of_noise.detection * unit_a2);
        Ok(Self {
            power_a2,
            density_a2,
            gain: (velocity_m_s, gain),
        })
    }

    /// Signal-to-noise ratio of a signal of that velocity over the excess of the power in the band over that of the noise; NaN without
    /// a velocity.
    pub fn gain(&self, velocity_m_s: f64) -> f64 {
        if velocity_m_s.is_nan() {
            f64::NAN
        } else {
            interpolate(&self.gain.0, &self.gain.1, velocity_m_s)
        }
    }
}

impl<S: Sample> Toolkit<S> {
    /// Plans the estimator of a scene for samples of its kind and windows of that signal-to-noise ratio, a power ratio.
    ///
    /// # Errors
    /// What the estimators refuse, such as a covariance that cannot be diagonalised.
    pub fn new(scene: &Scene, instrument: &Instrument, snr: f64) -> Result<Self, Error> {
        let snr = planned_snr(scene, snr);
        let (statistic, lag_weights, tapers) = statistic::<S>(scene, &instrument.pulse, snr)?;
        let estimator = of_correlogram(scene, S::KIND, &lag_weights)?;
        let per_lag = S::KIND.lag_numbers(1);
        let seen = |lags: Vec<f64>| {
            let mut weighted = lags;
            for (lag, weight) in weighted.chunks_mut(per_lag).zip(&lag_weights) {
                for number in lag {
                    *number *= weight;
                }
            }
            weighted.truncate(per_lag * lag_weights.len());
            weighted
        };
        let noise = NoiseSeen::new(scene, instrument, &*estimator, seen)?;
        let test = noise_test(scene, &tapers, &lag_weights)?;
        Ok(Self {
            statistic,
            estimator,
            test,
            noise,
        })
    }
}

/// What an estimator of correlograms makes of the mean spectrum of air at one velocity in the scene's noise.
pub(crate) struct ExpectedBias {
    estimator: Box<dyn Estimator>,
    sampling: Sampling,
    kind: SignalKind,
    /// Mean statistic of a signal of unit power at rest, by lag, and of noise whose power in the band is one.
    signal: Vec<f64>,
    noise: Vec<f64>,
}

impl ExpectedBias {
    /// For windows whose signal is as strong as the noise, where the scene plans its estimator for no other ratio; nothing without noise.
    ///
    /// # Errors
    /// What the estimators refuse; a checked scene gives none.
    pub(crate) fn new(scene: &Scene, instrument: &Instrument) -> Result<Option<Self>, Error> {
        let (kind, sampling, pulse) = (signal_kind(scene), sampling(scene)?, &instrument.pulse);
        let Some(noise) = noise_kind(scene) else {
            return Ok(None);
        };
        // Real and complex samples have the same weights of lags.
        let (_, lag_weights, _) = statistic::<f64>(scene, pulse, planned_snr(scene, 1.0))?;
        let estimator = of_correlogram(scene, kind, &lag_weights)?;
        let noise = noise.expected_correlogram(&sampling, kind, 1.0, &lag_weights)?;
        let lags = lag_weights.iter().zip(pulse_correlation(scene, pulse));
        let signal = lags.map(|(weight, lag)| weight * lag).collect();
        Ok(Some(Self {
            estimator,
            sampling,
            kind,
            signal,
            noise,
        }))
    }

    /// The velocity that it finds less the true one, m/s, at a signal-to-noise ratio.
    pub(crate) fn m_s(&self, velocity_m_s: f64, snr: f64) -> f64 {
        let lags = lags_at(
            &self.sampling,
            self.kind,
            velocity_m_s,
            self.signal.iter().map(|power| snr * power),
        );
        let mean: Vec<f64> = lags
            .iter()
            .zip(&self.noise)
            .map(|(signal, noise)| signal + noise)
            .collect();
        self.estimator
            .estimate(&mean, &mut Scratch::new())
            .velocity_m_s
            - velocity_m_s
    }
}

/// Distance of the frequencies of a scene's spectra and the farthest that its refinement leaves a line off between them, m/s.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub(crate) fn grid_step_and_bias_m_s(scene: &Scene) -> Result<(f64, f64), Error> {
    let (e, sampling, kind) = (&scene.estimator, sampling(scene)?, signal_kind(scene));
    let weights = Correlogram::<f64>::new(weighting(scene), e.window_samples)?.lag_weights();
    let peak = SpectralPeak::new(&sampling, kind, &weights, e.padded_samples, e.refinement)?;
    let step_m_s =
        0.5 * scene.laser.wavelength_m * scene.detector.sampling_hz / e.padded_samples as f64;
    let (low_m_s, high_m_s) = sampling.velocity_limits_m_s();
    let off_m_s = |part: i32| {
        let velocity_m_s = 0.5 * (low_m_s + high_m_s) + step_m_s * f64::from(part) / 64.0;
        let lags = lags_at(&sampling, kind, velocity_m_s, weights.iter().copied());
        let found = peak.estimate(&lags, &mut Scratch::new());
        (found.velocity_m_s - velocity_m_s).abs()
    };
    Ok((step_m_s, (-32..32).map(off_m_s).fold(0.0, f64::max)))
}

/// Correlogram of all lags and the scene's estimator of it, for what a mean of very many pulses would show.
pub(crate) type Response = (Correlogram<f64>, Box<dyn Estimator>);

/// The response of a scene at a signal-to-noise ratio `snr`; none for complex signals.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub(crate) fn response(scene: &Scene, pulse: &Pulse, snr: f64) -> Result<Option<Response>, Error> {
    if signal_kind(scene) == SignalKind::Complex {
        return Ok(None);
    }
    let correlogram = correlogram(scene, pulse, planned_snr(scene, snr))?;
    let estimator = of_correlogram(scene, SignalKind::Real, &correlogram.lag_weights())?;
    Ok(Some((correlogram, estimator)))
}

/// Spectrum of a scene's noise.
pub(crate) fn noise_kind(scene: &Scene) -> Option<Noise> {
    match scene.detector.noise {
        NoiseModel::White => Some(Noise::White),
        NoiseModel::BandLimited => Some(Noise::Band { floor: 0.0 }),
        NoiseModel::None => None,
    }
}

/// The test against noise; none without noise.
fn noise_test(
    scene: &Scene,
    tapers: &[Taper],
    lag_weights: &[f64],
) -> Result<Option<NoiseTest>, Error> {
    let e = &scene.estimator;
    let Some(noise) = noise_kind(scene) else {
        return Ok(None);
    };
    let window = e.method.order().map(model_lag_weights);
    let padded = if e.method == (Method::PulsePair {}) {
        4 * lag_weights.len()
    } else {
        e.padded_samples
    };
    let (sampling, gates) = (sampling(scene)?, gates(scene)?);
    Ok(Some(NoiseTest::new(
        &sampling,
        &gates,
        tapers,
        window.as_deref(),
        padded,
        noise,
    )?))
}

/// The estimator of a mean correlogram whose lags carry `lag_weights`.
fn of_correlogram(
    scene: &Scene,
    kind: SignalKind,
    lag_weights: &[f64],
) -> Result<Box<dyn Estimator>, Error> {
    let (e, sampling) = (&scene.estimator, sampling(scene)?);
    let (padded, refinement) = (e.padded_samples, e.refinement);
    Ok(match e.method {
        Method::Periodogram {} | Method::PeriodogramAccumulation {} | Method::Likelihood { .. } => {
            Box::new(SpectralPeak::new(
                &sampling,
                kind,
                lag_weights,
                padded,
                refinement,
            )?)
        }
        Method::Autoregressive { order } => Box::new(ModelPeak::new(
            &sampling,
            kind,
            lag_weights.len(),
            order,
            padded,
            refinement,
        )?),
        Method::PulsePair {} => Box::new(PulsePair::new(&sampling, kind, lag_weights)?),
        Method::FirstMoment { moment_reach } => Box::new(FirstMoment::new(
            &sampling,
            kind,
            lag_weights,
            padded,
            moment_reach,
        )?),
    })
}
