//! Fit of the wake to a map of radial velocities.
//!
//! Weighted least squares with a robust loss. What a wake shows is either the mean over the gate ([`fit_map`], by the
//! iteration of Levenberg and Marquardt) or what the estimator of the map itself makes of the wake's spectra
//! ([`fit_map_of_estimator`](crate::vortex_fit::fit_map_of_estimator)). The scale of the
//! residuals is their median, taken anew in each of a few rounds. Check: exact maps; noise; outliers; the spread of
//! fits over many maps.

use crate::error::Error;
use crate::vortex_fit::damped_newton::Stop;
use crate::vortex_fit::map_fit::guess::first_guess;
use crate::vortex_fit::map_fit::problem::{Expected, Problem};
use crate::vortex_fit::map_fit::starts::{best_of, starts, with_typical_core};
use crate::vortex_fit::wake::core_prior::is_core;
use crate::vortex_fit::wake::free_parameters::spread;
use crate::vortex_fit::{CorePrior, MapFit, MapFitOptions, MapTop, RangeKernel, VelocityMap, Wake, WakeModel};

/// The scale of residuals from means is taken anew this often.
const ROUNDS: usize = 5;

/// Fits the wake to a map whose velocities are means over gates, without any prior knowledge: a search for the best pair, then
/// [`refine_map_fit`] from there with each of a few core radii, if they are fitted.
///
/// # Errors
/// [`Error::NoVortex`] if no pair stands out; [`Error::TooFewVelocities`]; as [`refine_map_fit`].
pub fn fit_map(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    kernel: &RangeKernel,
    options: &MapFitOptions,
) -> Result<MapFit, Error> {
    let guess = first_guess(map, model, kernel)?;
    let refine = |start: &Wake| refine_map_fit(map, model, kernel, start, options);
    with_typical_core(best_of(&starts(&guess, options), refine)?, options, refine)
}

/// Fits the wake to a map from a given start on. `kernel` is what each velocity sees of the air about its range.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input; [`Error::TooFewVelocities`] with less than ten
/// velocities for each free number; [`Error::NotConverged`]; [`Error::Linalg`] if a free parameter does not show in
/// the map.
pub fn refine_map_fit(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    kernel: &RangeKernel,
    guess: &Wake,
    options: &MapFitOptions,
) -> Result<MapFit, Error> {
    let fit = Fit::new(map, model, kernel, guess, options)?;
    let coreless = fit.coreless();
    let mut problem = fit.problem(&fit.groups, Expected::Means(kernel));
    let mut wake = options.free.start(guess);
    let mut scale = problem.scale(&wake)?;
    let mut iterations = 0;
    for round in 0..ROUNDS {
        problem.prior = fit.prior(problem.groups, fit.alike(&problem, &wake, scale));
        (wake, iterations) = match problem.descend(wake, scale, fit.stop) {
            // a core that the map does not resolve may run away to nothing: it keeps what the last round gave
            Err(Error::NotConverged { .. }) if round > 0 && coreless.len() < problem.groups.len() => {
                problem.groups = &coreless;
                problem.descend(wake, scale, fit.stop)?
            }
            end => end?,
        };
        scale = problem.scale(&wake)?;
    }
    fit.outcome(&problem, wake, scale, iterations)
}

/// What both fits share.
pub(crate) struct Fit<'a, 'm> {
    map: &'a VelocityMap<'m>,
    model: &'a WakeModel,
    kernel: &'a RangeKernel,
    options: &'a MapFitOptions,
    pub(crate) groups: Vec<Vec<usize>>,
    pub(crate) stop: Stop,
    used: usize,
}

impl<'a, 'm> Fit<'a, 'm> {
    pub(crate) fn new(
        map: &'a VelocityMap<'m>,
        model: &'a WakeModel,
        kernel: &'a RangeKernel,
        guess: &Wake,
        options: &'a MapFitOptions,
    ) -> Result<Self, Error> {
        let used = map.validate()?;
        guess.validate()?;
        options.core_prior.as_ref().map_or(Ok(()), CorePrior::validate)?;
        let groups = options.free.groups_of(guess);
        let needed = 10 * groups.len().max(1);
        if used < needed {
            return Err(Error::TooFewVelocities { found: used, needed });
        }
        let stop = Stop { iterations: options.max_iterations, sigmas: options.tolerance_sigmas, learns: false };
        Ok(Self { map, model, kernel, options, groups, stop, used })
    }

    pub(crate) fn coreless(&self) -> Vec<Vec<usize>> {
        self.groups.iter().filter(|group| !is_core(group)).cloned().collect()
    }

    pub(crate) fn problem<'p>(&'p self, groups: &'p [Vec<usize>], expected: Expected<'p>) -> Problem<'p, 'm> {
        let (map, model, loss) = (self.map, self.model, self.options.loss);
        Problem { map, model, expected, groups, loss, learnt: None, prior: None }
    }

    /// Number of velocities that count as one.
    pub(crate) fn alike(&self, problem: &Problem<'_, '_>, wake: &Wake, scale: f64) -> f64 {
        problem.alike(wake, scale, self.options.correlated_lines)
    }

    /// What is known of the cores, if any of the free numbers moves them, and how often it counts.
    pub(crate) fn prior(&self, groups: &[Vec<usize>], alike: f64) -> Option<(CorePrior, f64)> {
        self.options.core_prior.filter(|_| groups.iter().any(|group| is_core(group))).map(|known| (known, alike))
    }

    /// Whether the model exists there: with images, above the ground only.
    pub(crate) fn allows(&self, wake: &Wake) -> bool {
        let above = wake.left.height_m > 0.0 && wake.right.height_m > 0.0;
        wake.validate().is_ok() && (above || !self.model.images)
    }

    pub(crate) fn outcome(
        &self,
        problem: &Problem<'_, '_>,
        wake: Wake,
        scale: f64,
        iterations: usize,
    ) -> Result<MapFit, Error> {
        let (covariance, alike) = problem.covariance(&wake, scale, self.options.correlated_lines)?;
        let residuals = problem.residuals(&wake);
        let cost = |residuals: &[f64]| residuals.iter().map(|r| self.options.loss.at(r / scale).0).sum::<f64>();
        // without vortices a gate shows its mean, which is the wind at its middle, as that is linear in height
        let middle = self.kernel.middle();
        let means = Problem { expected: Expected::Means(&middle), ..*problem };
        let calm_cost = means.calm(&wake, scale, self.stop).map_or(f64::NAN, |calm| cost(&means.residuals(&calm)));
        Ok(MapFit {
            wake,
            covariance: spread(problem.groups, &covariance),
            cores_fitted: problem.groups.iter().any(|group| is_core(group)),
            used: self.used,
            outliers: residuals.iter().filter(|r| r.abs() > 3.0 * scale).count(),
            residual_scale: scale,
            explained_fraction: 1.0 - cost(&residuals) / calm_cost,
            iterations,
            tops: vec![MapTop { wake, log_likelihood: problem.log_likelihood(&wake, scale) / alike }],
        })
    }
}
