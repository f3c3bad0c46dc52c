//! Fit of the wake to all raw signals of a scan by maximum likelihood.
//!
//! A quasi-Newton ascent, damped as Levenberg and Marquardt do, that starts with the information of a part of the lines as
//! curvature. The covariance of the result is the inverse of the full information, which is the
//! Cramer-Rao bound. Check: standard deviation and bias over scans against the bound.

use ndarray::{Array2, ArrayView2};

use super::band::dot;
use super::free::{FreeParameters, gathered, moved, spread};
use super::likelihood::{Powers, ScanSignals};
use super::scan_model::{ScanModel, ScanSetup};
use super::small::{Normal, Stop, descend, inverse};
use super::wake::{Parameter, Wake};
use crate::error::Error;
use crate::sample::Sample;

/// Fits that leave the surroundings of their guess start again from where they are, this often at most.
const ROUNDS: usize = 4;
/// Where the first, rough ascent ends, in standard deviations.
const ROUGH_SIGMAS: f64 = 0.3;

/// How the signals are fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalFitOptions {
    /// What may change.
    pub free: FreeParameters,
    /// Whether the powers of signal and noise are fitted too, one factor each for the whole scan.
    pub fit_powers: bool,
    /// The ascent begins with the information of every so-manyth line; the covariance of the result uses all.
    pub information_stride: usize,
    /// Most evaluations of the likelihood in a round.
    pub max_iterations: usize,
    /// The fit ends when the step that is left is below this part of its standard deviations.
    pub tolerance_sigmas: f64,
}

impl Default for SignalFitOptions {
    /// All parameters and powers; the information of every fourth line; at most 60 evaluations; to 0.01 standard deviations.
    fn default() -> Self {
        Self {
            free: FreeParameters::default(),
            fit_powers: true,
            information_stride: 4,
            max_iterations: 60,
            tolerance_sigmas: 1e-2,
        }
    }
}

/// Outcome of a fit to raw signals.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalFit {
    /// The most likely wake.
    pub wake: Wake,
    /// The most likely powers relative to the model.
    pub powers: Powers,
    /// Covariance \[10, 10\] of the parameters in the order of [`Parameter`]; zeros where one is fixed. It is the Cramer-Rao
    /// bound at the fitted wake.
    pub covariance: Array2<f64>,
    /// Log-likelihood, but for a constant.
    pub log_likelihood: f64,
    /// How much of it the vortices give: the difference to the same wind without vortices.
    pub log_likelihood_gain: f64,
    /// Rays that were used.
    pub used_rays: usize,
    /// Evaluations of the likelihood.
    pub evaluations: usize,
}

impl SignalFit {
    /// Standard deviation of a parameter, in its unit; 0 if it was fixed.
    #[must_use]
    pub fn standard_deviation(&self, parameter: Parameter) -> f64 {
        self.covariance[[parameter as usize; 2]].sqrt()
    }
}

impl ScanModel {
    /// Cramer-Rao bound: least covariance \[10, 10\], in the order of [`Parameter`], of any unbiased estimate of the
    /// free parameters of `wake` from one scan; zeros where a parameter is fixed.
    ///
    /// # Errors
    /// As [`ScanModel::information`]; [`Error::Linalg`] if a free parameter does not show in the signals.
    pub fn bound(
        &self,
        wake: &Wake,
        powers: Powers,
        free: &FreeParameters,
        powers_free: bool,
    ) -> Result<Array2<f64>, Error> {
        let information = self.information(wake, powers, free, powers_free, 1)?;
        Ok(spread(&free.groups(), &inverse("information on the wake", &information)?))
    }
}

/// Fits the wake to `records` \[ray, sample\] of a scan, from `guess` on, such as the outcome of a fit to a map.
///
/// `snr(range_m, elevation_rad)` is signal power over noise power in the detector band, `noise_power` that noise power in
/// the square of the unit of the samples; with `fit_powers` both need to be right only up to a factor. Rays with
/// missing samples are left out.
///
/// # Errors
/// As [`ScanModel::new`] and [`ScanSignals::new`]; [`Error::NotConverged`]; [`Error::Linalg`] if a free parameter does not show.
pub fn fit_signals<S: Sample>(
    setup: &ScanSetup,
    snr: impl Fn(f64, f64) -> f64,
    records: ArrayView2<'_, S>,
    noise_power: f64,
    guess: &Wake,
    options: &SignalFitOptions,
) -> Result<SignalFit, Error> {
    let mut state = (options.free.start(guess), Powers::default());
    let mut evaluations = 0;
    for round in 0..ROUNDS {
        let model = ScanModel::new(setup, &snr, &state.0)?;
        let signals = ScanSignals::new(&model, records, noise_power)?;
        // The likelihood of a strong signal has many tops; that of the same signal said to be weak leads to the highest.
        let rough = |wake: Wake, snr: f64, evaluations: &mut usize| {
            let weak = Powers { log_signal: (snr / model.largest_snr).ln(), log_noise: 0.0 };
            let rough = SignalFitOptions { fit_powers: false, tolerance_sigmas: ROUGH_SIGMAS, ..*options };
            climb(&model, &signals, (wake, weak), &rough, evaluations).map(|(wake, _)| (wake, Powers::default()))
        };
        if round == 0 && model.largest_snr > 1.0 {
            state = rough(state.0, 1.0, &mut evaluations)?;
        }
        state = match climb(&model, &signals, state, options, &mut evaluations) {
            // astray between two tops: once more, from where a weaker signal leads
            Err(Error::NotConverged { .. }) if round == 0 => {
                let start = rough(state.0, 0.3 * model.largest_snr.min(1.0), &mut evaluations)?;
                climb(&model, &signals, start, options, &mut evaluations)?
            }
            end => end?,
        };
        if model.covers(&state.0) {
            return finish(&model, &signals, state, options, evaluations);
        }
    }
    Err(Error::NotConverged { iterations: evaluations, sigmas_left: f64::INFINITY })
}

/// Goes to the top of the likelihood.
///
/// The few lines through the cores make the likelihood of one scan curve quite differently from its mean over scans, so the
/// information serves only as the first curvature; it is then corrected from gradient to gradient.
fn climb(
    model: &ScanModel,
    signals: &ScanSignals,
    start: (Wake, Powers),
    options: &SignalFitOptions,
    evaluations: &mut usize,
) -> Result<(Wake, Powers), Error> {
    let groups = options.free.groups();
    let powers_free = options.fit_powers;
    let order = groups.len() + if powers_free { 2 } else { 0 };
    let at = |x: &[f64]| {
        let mut powers = start.1;
        if powers_free {
            powers.log_signal += x[order - 2];
            powers.log_noise += x[order - 1];
        }
        (moved(&groups, &start.0, x), powers)
    };
    let stride = options.information_stride.max(1);
    let mut curvature = model.information(&start.0, start.1, &options.free, powers_free, stride)?;
    let mut last: Option<(Vec<f64>, Vec<f64>)> = None;
    let evaluate = |x: &Vec<f64>| {
        *evaluations += 1;
        let (wake, powers) = at(x);
        let value = model.log_likelihood(signals, &wake, powers)?;
        let mut gradient = vec![0.0; order];
        gathered(&groups, &value.by_wake, &mut gradient);
        if powers_free {
            gradient[order - 2] = value.by_log_signal;
            gradient[order - 1] = value.by_log_noise;
        }
        gradient.iter_mut().for_each(|g| *g = -*g);
        if let Some((x_before, gradient_before)) = &last {
            let difference = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
            learn(&mut curvature, &difference(x, x_before), &difference(&gradient, gradient_before));
        }
        last = Some((x.clone(), gradient.clone()));
        Some(Normal { cost: -value.log_likelihood, gradient, curvature: curvature.clone() })
    };
    let step = |x: &Vec<f64>, step: &[f64]| x.iter().zip(step).map(|(x, s)| x + s).collect();
    let stop = Stop { iterations: options.max_iterations, sigmas: options.tolerance_sigmas, learns: true };
    let (end, _, _) = descend(vec![0.0; order], stop, evaluate, step)?;
    Ok(at(&end))
}

/// Corrects the curvature so that it explains the change `y` of the gradient over the step `s`: the update of Broyden, Fletcher,
/// Goldfarb and Shanno, damped after Powell (1978) so that it stays positive definite.
fn learn(curvature: &mut Array2<f64>, s: &[f64], y: &[f64]) {
    let n = s.len();
    let hs: Vec<f64> = (0..n).map(|i| dot(curvature.row(i).as_slice().unwrap_or(&[]), s)).collect();
    let (shs, sy) = (dot(s, &hs), dot(s, y));
    if shs <= 0.0 {
        return;
    }
    let part = if sy >= 0.2 * shs { 1.0 } else { 0.8 * shs / (shs - sy) };
    let r: Vec<f64> = y.iter().zip(&hs).map(|(y, h)| part * y + (1.0 - part) * h).collect();
    let sr = dot(s, &r);
    for ((i, j), c) in curvature.indexed_iter_mut() {
        *c += r[i] * r[j] / sr - hs[i] * hs[j] / shs;
    }
}

fn finish(
    model: &ScanModel,
    signals: &ScanSignals,
    (wake, powers): (Wake, Powers),
    options: &SignalFitOptions,
    evaluations: usize,
) -> Result<SignalFit, Error> {
    let failed = Error::NotConverged { iterations: evaluations, sigmas_left: f64::NAN };
    let value = model.log_likelihood(signals, &wake, powers).ok_or(failed.clone())?;
    let mut calm = wake;
    (calm.left.circulation_m2_s, calm.right.circulation_m2_s) = (0.0, 0.0);
    let without = model.log_likelihood(signals, &calm, powers).ok_or(failed)?;
    let mut information = model.information(&wake, powers, &options.free, options.fit_powers, 1)?;
    information *= signals.used_rays() as f64 / model.rays as f64;
    let covariance = inverse("information on the wake", &information)?;
    Ok(SignalFit {
        wake,
        powers,
        covariance: spread(&options.free.groups(), &covariance),
        log_likelihood: value.log_likelihood,
        log_likelihood_gain: value.log_likelihood - without.log_likelihood,
        used_rays: signals.used_rays(),
        evaluations,
    })
}
