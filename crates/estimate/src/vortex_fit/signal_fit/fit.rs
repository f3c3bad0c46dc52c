//! Fit of the wake to all raw signals of a scan by maximum likelihood.
//!
//! A quasi-Newton ascent, damped as Levenberg and Marquardt do, that starts with the information of a part of the lines as
//! curvature. The covariance of the result is the inverse of the full information, which is the
//! Cramer-Rao bound. Check: standard deviation and bias over scans against the bound.

use ndarray::{Array2, ArrayView2};
use std::rc::Rc;

use crate::error::Error;
use crate::vortex_fit::damped_newton::inverse;
use crate::vortex_fit::signal_fit::ascent::{Ascent, State};
use crate::vortex_fit::signal_fit::tops::{CORES_OVER_SPACING, Candidate, near_lines};
use crate::vortex_fit::top::mixed;
use crate::vortex_fit::wake::free_parameters::spread;
use crate::vortex_fit::{
    FreeParameters, Parameter, Powers, ScanModel, ScanSetup, ScanSignals, Sharing,
    SignalFitOptions, Starts, Top, Wake,
};
use crate::window::Sample;

/// Fits that leave the surroundings of their guess start again from where they are, this often at most.
const ROUNDS: usize = 4;
/// Where the first, rough ascent ends, in standard deviations.
const ROUGH_SIGMAS: f64 = 0.3;
/// Layers of the lines on which tops are looked for, over those that the rule allows.
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
    /// Covariance \[10, 10\] of the parameters in the order of [`Parameter`]; zeros where one is fixed. It is the Cramer-Rao
    /// bound at the tops of the likelihood and their distances from the highest, weighted with the likelihood.
    pub covariance: Array2<f64>,
    /// Cramer-Rao bound \[10, 10\] at the fitted wake.
    pub bound: Array2<f64>,
    /// All tops that were found within 6 of the highest (the fitted wake), which is the first. Those that the lines near the
    /// vortices put more than 2 below it are theirs: ln p to some tenths.
    pub tops: Vec<Top>,
    /// Log-likelihood, but for a constant.
    pub log_likelihood: f64,
    /// How much of it the vortices give: the difference to the same wind without vortices.
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
    /// As [`ScanModel::information`]; [`Error::Linalg`] if a free parameter does not show in the signals.
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
/// missing samples are left out.
///
/// # Errors
/// As [`ScanModel::new`] and [`ScanSignals::new`]; [`Error::NotConverged`] if no start leads to a top; [`Error::Linalg`] if a
/// free parameter does not show.
pub fn fit_signals<S: Sample>(
    setup: &ScanSetup,
    snr: impl Fn(f64, f64) -> f64,
    records: ArrayView2<'_, S>,
    noise_power: f64,
    guess: &Wake,
    options: &SignalFitOptions,
) -> Result<SignalFit, Error> {
    let mut start = options.free.start(guess);
    if options.starts == Starts::Several && options.free.core_radius != Sharing::Fixed {
        // wide cores make few tops
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
    if options.starts == Starts::Several {
        for other in search.others(&tops[0])? {
            let settled = if other.close {
                search.settle(other.state, false)
            } else {
                let log_likelihood = tops[0].log_likelihood + other.gain;
                Ok(Settled {
                    model: Rc::clone(&tops[0].model),
                    state: other.state,
                    log_likelihood,
                })
            };
            // a start that leads nowhere is no top
            tops.extend(settled);
        }
    }
    search.finish(tops)
}

/// A top and the model that was cut for it.
struct Settled {
    model: Rc<ScanModel>,
    state: State,
    log_likelihood: f64,
}

/// The search for tops in one scan.
struct Search<'a, F> {
    setup: &'a ScanSetup,
    snr: &'a F,
    signals: &'a ScanSignals,
    options: &'a SignalFitOptions,
}

impl<F: Fn(f64, f64) -> f64> Search<'_, F> {
    /// The top that a start leads to; with `rough` through ascents with a weaker signal if it is strong, or if the first goes astray.
    fn settle(&self, start: State, rough: bool) -> Result<Settled, Error> {
        let (mut state, signals, options) = (start, self.signals, self.options);
        for round in 0..ROUNDS {
            let model = ScanModel::new(self.setup, self.snr, &state.0)?;
            let ascent = Ascent {
                model: &model,
                signals,
                options,
                others: None,
            };
            // The likelihood of a strong signal has many tops; that of the same signal said to be weak leads to the highest.
            let weaker = |wake: Wake, snr: f64| {
                let weak = Powers {
                    log_signal: (snr / model.largest_snr).ln(),
                    log_noise: 0.0,
                };
                let options = SignalFitOptions {
                    fit_powers: false,
                    tolerance_sigmas: ROUGH_SIGMAS,
                    ..*options
                };
                let ascent = Ascent {
                    model: &model,
                    signals,
                    options: &options,
                    others: None,
                };
                ascent
                    .climb((wake, weak))
                    .map(|((wake, _), _)| (wake, Powers::default()))
            };
            if rough && round == 0 && model.largest_snr > 1.0 {
                state = weaker(state.0, 1.0)?;
            }
            let end = match ascent.climb(state) {
                // astray between two tops: once more, from where a weaker signal leads
                Err(Error::NotConverged { .. }) if rough && round == 0 => {
                    ascent.climb(weaker(state.0, 0.3 * model.largest_snr.min(1.0))?)?
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

    /// States near other tops than the first.
    fn others(&self, first: &Settled) -> Result<Vec<Candidate>, Error> {
        let mut guess = first.state.0;
        if self.options.free.core_radius != Sharing::Fixed {
            guess = guess.with_cores(CORES_OVER_SPACING[1] * guess.spacing_m());
        }
        let rough = ScanModel::with_layers(self.setup, self.snr, &guess, ROUGH_LAYERS)?;
        let near = near_lines(&rough, &first.state.0);
        let ascent = Ascent {
            model: &first.model,
            signals: self.signals,
            options: self.options,
            others: None,
        };
        ascent.other_tops(&near, first.state)
    }

    /// The highest top, and what the others add to its errors.
    fn finish(&self, mut settled: Vec<Settled>) -> Result<SignalFit, Error> {
        let (options, signals) = (self.options, self.signals);
        settled.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
        let failed = Error::NotConverged {
            iterations: ROUNDS,
            sigmas_left: f64::NAN,
        };
        let mut tops: Vec<(&Settled, Array2<f64>, Array2<f64>)> = Vec::new();
        for next in &settled {
            let ascent = Ascent {
                model: &next.model,
                signals,
                options,
                others: None,
            };
            if tops
                .iter()
                .any(|(top, information, _)| ascent.same(information, &top.state, &next.state))
            {
                continue;
            }
            let stride = if tops.is_empty() {
                1
            } else {
                options.information_stride
            };
            let share = signals.used_rays() as f64 / next.model.rays as f64;
            let information = ascent.information(&next.state, stride)? * share;
            let within = spread(
                &options.free.groups(),
                &inverse("information on the wake", &information)?,
            );
            tops.push((next, information, within));
        }
        let (best, _, bound) = tops.first().ok_or(failed.clone())?;
        let (wake, powers) = best.state;
        let without = best
            .model
            .log_likelihood(signals, &wake.wind_alone(), powers)
            .ok_or(failed)?;
        let weight = |top: &Settled| (top.log_likelihood - best.log_likelihood).exp();
        let weighted = tops
            .iter()
            .map(|(top, _, within)| (weight(top), &top.state.0, within));
        let top = |(top, ..): &(&Settled, _, _)| Top {
            wake: top.state.0,
            chi2: -2.0 * top.log_likelihood,
        };
        Ok(SignalFit {
            wake,
            powers,
            covariance: mixed(weighted, &wake),
            bound: bound.clone(),
            tops: tops.iter().map(top).collect(),
            log_likelihood: best.log_likelihood,
            log_likelihood_gain: best.log_likelihood - without.log_likelihood,
            used_rays: signals.used_rays(),
        })
    }
}
