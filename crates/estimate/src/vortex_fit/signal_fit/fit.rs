//! Fit of the wake to all raw signals of a scan by maximum likelihood.
//!
//! A quasi-Newton ascent, damped after Levenberg and Marquardt, that starts with the information of a fraction of the lines as
//! curvature. The covariance of the result is the inverse of the full information, which is the
//! Cramer-Rao bound. Check: standard deviation and bias over scans against the bound.

use ndarray::{Array2, ArrayView2};
use std::rc::Rc;

use crate::error::Error;
use crate::linalg::positive_definite::inverse;
use crate::vortex_fit::signal_fit::ascent::{Ascent, State};
use crate::vortex_fit::signal_fit::tops::{CORES_OVER_SPACING, near_lines};
use crate::vortex_fit::top::mixed;
use crate::vortex_fit::wake::free_parameters::spread;
use crate::vortex_fit::{
    FreeParameters, Parameter, Powers, ScanModel, ScanSetup, ScanSignals, Sharing,
    SignalFitOptions, Top, Wake,
};
use crate::window::Sample;

/// Most restarts of fits that leave the neighbourhood of their guess.
const ROUNDS: usize = 4;
/// Tolerance of the first, rough ascent in standard deviations.
const ROUGH_SIGMAS: f64 = 0.3;
/// Thickness of the layers in the search for other maxima, over that which the rule allows.
const ROUGH_LAYERS: f64 = 2.0;
/// Core radius of the first start over the spacing.
const FIRST_CORE_OVER_SPACING: f64 = 0.06;

/// Outcome of a fit to raw signals.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalFit {
    /// The most likely wake.
    pub wake: Wake,
    /// The most likely powers relative to the model.
    pub powers: Powers,
    /// Covariance \[10, 10\] of the parameters in the order of [`Parameter`]; zeros where one is fixed. It is the mean, weighted with
    /// the likelihood, of the Cramer-Rao bound at each maximum and of the squared distance from the highest.
    pub covariance: Array2<f64>,
    /// Cramer-Rao bound \[10, 10\] at the fitted wake.
    pub bound: Array2<f64>,
    /// All maxima that were found within 6 of the highest (the fitted wake), which is the first. Those more than 2 below it are fits of
    /// the lines near the vortices only: ln p to some tenths.
    pub tops: Vec<Top>,
    /// Log-likelihood, but for a constant.
    pub log_likelihood: f64,
    /// Contribution of the vortices: the difference to the same wind without vortices.
    pub log_likelihood_gain: f64,
    /// Rays that were used.
    pub used_rays: usize,
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
    /// As [`ScanModel::information`]; [`Error::Linalg`] if the signals do not determine a free parameter.
    pub fn bound(
        &self,
        wake: &Wake,
        powers: Powers,
        free: &FreeParameters,
        powers_free: bool,
    ) -> Result<Array2<f64>, Error> {
        let information = self.information(wake, powers, free, powers_free, 1)?;
        Ok(spread(
            &free.groups(),
            &inverse("information on the wake", &information)?,
        ))
    }
}

/// Fits the wake to `records` \[ray, sample\] of a scan, from `guess` on, such as the outcome of a fit to a map.
///
/// `snr(range_m, elevation_rad)` is signal power over noise power in the detector band, `noise_power` that noise power in
/// the square of the unit of the samples; with `fit_powers` both need to be right only up to a factor. Rays with
/// missing samples are skipped.
///
/// # Errors
/// As [`ScanModel::new`] and [`ScanSignals::new`]; [`Error::NotConverged`] if no start leads to a maximum; [`Error::Linalg`] if the
/// signals do not determine a free parameter.
pub fn fit_signals<S: Sample>(
    setup: &ScanSetup,
    snr: impl Fn(f64, f64) -> f64,
    records: ArrayView2<'_, S>,
    noise_power: f64,
    guess: &Wake,
    options: &SignalFitOptions,
) -> Result<SignalFit, Error> {
    let mut start = options.free.start(guess);
    if options.several_starts && options.free.core_radius != Sharing::Fixed {
        // wide cores have few maxima
        start = start.with_cores(FIRST_CORE_OVER_SPACING * start.spacing_m());
    }
    let model = ScanModel::new(setup, &snr, &start)?;
    let signals = ScanSignals::new(&model, records, noise_power)?;
    let search = Search {
        setup,
        snr: &snr,
        signals: &signals,
        options,
    };
    let mut tops = vec![search.settle((start, Powers::default()), true)?];
    if options.several_starts {
        for (state, gain) in search.others(&tops[0])? {
            let settled = match gain {
                None => search.settle(state, false),
                Some(gain) => Ok(Settled {
                    model: Rc::clone(&tops[0].model),
                    state,
                    log_likelihood: tops[0].log_likelihood + gain,
                }),
            };
            // a start that does not converge is no maximum
            tops.extend(settled);
        }
    }
    search.finish(tops)
}

/// A maximum and the model whose layers were made for it.
struct Settled {
    model: Rc<ScanModel>,
    state: State,
    log_likelihood: f64,
}

/// The search for maxima in one scan.
struct Search<'a> {
    setup: &'a ScanSetup,
    snr: &'a dyn Fn(f64, f64) -> f64,
    signals: &'a ScanSignals,
    options: &'a SignalFitOptions,
}

impl Search<'_> {
    /// The maximum that a start leads to. With `rough` ascents with a weaker signal come first if the signal is strong, or if the first
    /// ascent does not converge.
    fn settle(&self, start: State, rough: bool) -> Result<Settled, Error> {
        let mut state = start;
        for round in 0..ROUNDS {
            let model = ScanModel::new(self.setup, self.snr, &state.0)?;
            let is_rough = rough && round == 0;
            if is_rough && model.largest_snr > 1.0 {
                state = self.climb_weaker(&model, state.0, 1.0)?;
            }
            let ascent = self.ascent(&model, self.options);
            let end = match ascent.climb(state) {
                // between two maxima: once more, from the maximum of a weaker signal
                Err(Error::NotConverged { .. }) if is_rough => {
                    let snr = 0.3 * model.largest_snr.min(1.0);
                    ascent.climb(self.climb_weaker(&model, state.0, snr)?)?
                }
                end => end?,
            };
            state = end.0;
            if model.covers(&state.0) {
                return Ok(Settled {
                    model: Rc::new(model),
                    state,
                    log_likelihood: end.1,
                });
            }
        }
        Err(Error::NotConverged {
            iterations: ROUNDS,
            sigmas_left: f64::INFINITY,
        })
    }

    /// The maximum of the likelihood for a signal assumed to be as weak as `snr`: that of a strong signal has many maxima, that of a
    /// weak one leads to the highest.
    fn climb_weaker(&self, model: &ScanModel, wake: Wake, snr: f64) -> Result<State, Error> {
        let weak = Powers {
            log_signal: (snr / model.largest_snr).ln(),
            log_noise: 0.0,
        };
        let options = SignalFitOptions {
            fit_powers: false,
            tolerance_sigmas: ROUGH_SIGMAS,
            ..*self.options
        };
        let ((wake, _), _) = self.ascent(model, &options).climb((wake, weak))?;
        Ok((wake, Powers::default()))
    }

    fn ascent<'s>(&'s self, model: &'s ScanModel, options: &'s SignalFitOptions) -> Ascent<'s> {
        Ascent {
            model,
            signals: self.signals,
            options,
            others: None,
        }
    }

    /// States near other maxima than the first.
    fn others(&self, first: &Settled) -> Result<Vec<(State, Option<f64>)>, Error> {
        let mut guess = first.state.0;
        if self.options.free.core_radius != Sharing::Fixed {
            guess = guess.with_cores(CORES_OVER_SPACING[1] * guess.spacing_m());
        }
        let rough = ScanModel::with_layers(self.setup, self.snr, &guess, ROUGH_LAYERS)?;
        let near = near_lines(&rough, &first.state.0);
        let ascent = self.ascent(&first.model, self.options);
        ascent.other_tops(&near, first.state)
    }

    /// The highest maximum, with the contribution of the others to its errors.
    fn finish(&self, mut settled: Vec<Settled>) -> Result<SignalFit, Error> {
        let options = self.options;
        let signals = self.signals;
        settled.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
        let failed = Error::NotConverged {
            iterations: ROUNDS,
            sigmas_left: f64::NAN,
        };
        let mut maxima: Vec<(&Settled, Array2<f64>, Array2<f64>)> = Vec::new();
        for next in &settled {
            let ascent = self.ascent(&next.model, options);
            if maxima
                .iter()
                .any(|(other, information, _)| ascent.same(information, &other.state, &next.state))
            {
                continue;
            }
            let stride = if maxima.is_empty() {
                1
            } else {
                options.information_stride
            };
            let fraction = signals.used_rays() as f64 / next.model.rays as f64;
            let information = ascent.information(&next.state, stride)? * fraction;
            let within = spread(
                &options.free.groups(),
                &inverse("information on the wake", &information)?,
            );
            maxima.push((next, information, within));
        }
        let (best, _, bound) = maxima.first().ok_or(failed.clone())?;
        let (wake, powers) = best.state;
        let without = best
            .model
            .log_likelihood(signals, &wake.wind_alone(), powers)
            .ok_or(failed)?;
        let mut weighted = Vec::new();
        let mut tops = Vec::new();
        for (maximum, _, within) in &maxima {
            let weight = (maximum.log_likelihood - best.log_likelihood).exp();
            weighted.push((weight, &maximum.state.0, within));
            tops.push(Top {
                wake: maximum.state.0,
                chi2: -2.0 * maximum.log_likelihood,
            });
        }
        Ok(SignalFit {
            wake,
            powers,
            covariance: mixed(weighted.into_iter(), &wake),
            bound: bound.clone(),
            tops,
            log_likelihood: best.log_likelihood,
            log_likelihood_gain: best.log_likelihood - without.log_likelihood,
            used_rays: signals.used_rays(),
        })
    }
}
