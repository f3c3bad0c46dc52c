//! Fit of the wake to a map that an estimator of this crate made.
//!
//! Damped steps of Gauss and Newton on what the estimator itself makes of the wake's spectra, with difference quotients
//! that are taken anew when the wake has moved by more than its error. Check: exact maps of peaks; the spread of fits over many
//! maps.

use ndarray::Array2;

use crate::error::Error;
use crate::vortex_fit::map_fit::guess::first_guess;
use crate::vortex_fit::map_fit::means::Fit;
use crate::vortex_fit::map_fit::problem::{Expected, Problem};
use crate::vortex_fit::map_fit::starts::{best_of, starts, with_typical_core};
use crate::vortex_fit::map_fit::tangent::{Tangent, near};
use crate::vortex_fit::{
    EstimatorResponse, FreeParameters, MapFit, MapFitOptions, PARAMETERS, Sharing, VelocityMap, Wake, WakeModel,
    refine_map_fit,
};

/// Most steps of Gauss and Newton, and halvings of one.
const STEPS: usize = 40;
const HALVINGS: i32 = 6;
/// Core radii below this part of a region's radius, or of the distance of lines, do not show in a map.
const SMALLEST_CORE: f64 = 0.25;
/// They end at a step of this many standard deviations at the latest: estimators round.
const NEAR_SIGMAS: f64 = 0.03;
/// The fit to means, which only leads to the start, may end at such a step.
const ROUGH_SIGMAS: f64 = 0.1;

/// Fits the wake to a map that an estimator of this crate made, without any prior knowledge: as [`fit_map`](crate::vortex_fit::fit_map) with its
/// mean gate, then [`refine_map_fit_of_estimator`].
///
/// # Errors
/// As [`fit_map`](crate::vortex_fit::fit_map) and [`refine_map_fit_of_estimator`].
pub fn fit_map_of_estimator(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    response: &EstimatorResponse<'_>,
    options: &MapFitOptions,
) -> Result<MapFit, Error> {
    map.validate()?;
    let kernel = response.kernel(map.range_m)?;
    let guess = first_guess(map, model, &kernel)?;
    // taken for means, peaks mislead above all the core radius, and may lead nowhere: then the guess is the start
    let free = FreeParameters { core_radius: Sharing::Fixed, ..options.free };
    let rough = MapFitOptions { free, tolerance_sigmas: ROUGH_SIGMAS, ..*options };
    let refine = |start: &Wake| refine_map_fit_of_estimator(map, model, response, start, options);
    let by_means = refine_map_fit(map, model, &kernel.coarser(2), &guess, &rough).map(|fit| fit.wake);
    let first = best_of(&starts(by_means.as_ref().unwrap_or(&guess), options), refine);
    let fit = match (first, by_means) {
        (Err(Error::NotConverged { .. }), Ok(_)) => best_of(&starts(&guess, options), refine),
        (first, _) => first,
    };
    with_typical_core(fit?, options, refine)
}

/// Fits the wake to a map that an estimator made, from a given start on: what is expected of a wake is the estimate from its
/// expected correlograms.
///
/// # Errors
/// As [`refine_map_fit`].
pub fn refine_map_fit_of_estimator(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    response: &EstimatorResponse<'_>,
    guess: &Wake,
    options: &MapFitOptions,
) -> Result<MapFit, Error> {
    map.validate()?;
    let kernel = response.kernel(map.range_m)?;
    let fit = Fit::new(map, model, &kernel, guess, options)?;
    let prepared = response.prepared(map.range_m);
    let least_core_m = SMALLEST_CORE * map.line_spacing_m().max(response.radius_m());
    let coreless = fit.coreless();
    let mut groups = &fit.groups;
    let mut wake = options.free.start(guess);
    let (mut turns, mut last, mut sigmas_left) = (0, [0.0; PARAMETERS], f64::INFINITY);
    let mut slopes: Option<(Wake, Vec<Array2<f64>>)> = None;
    let mut prior = None;
    for step in 1..=STEPS {
        let here = prepared.velocities(model, &wake, map.elevation_rad);
        let known = slopes.take().filter(|(at, slopes)| near(at, &wake) && slopes.len() == groups.len());
        let moved = known.is_none();
        let known = known.unwrap_or_else(|| {
            (wake, Tangent::slopes((&prepared, model), &wake, here.view(), groups, map.elevation_rad))
        });
        let tangent = Tangent::new((&prepared, model), wake, here.view(), &known.1, map);
        slopes = Some(known);
        let learnt = Some(&tangent.deviation);
        let mut problem = Problem { learnt, ..fit.problem(groups, Expected::Shown(&tangent)) };
        let scale = problem.scale(&wake)?;
        if moved {
            prior = fit.prior(&problem, &wake, scale);
        }
        problem.prior = prior;
        let next = problem.reweighted(wake, scale, fit.stop)?;
        let (from, to) = (wake.to_array(), next.to_array());
        let way: [f64; PARAMETERS] = std::array::from_fn(|i| to[i] - from[i]);
        // where peaks jump the map is not smooth: each time the steps turn round they are shortened, so that their
        // ends are averaged (Kesten 1958)
        turns += usize::from(problem.product(&wake, &way, &last, scale) < 0.0);
        let share = ((1 + turns) as f64).recip();
        sigmas_left = share * problem.product(&wake, &way, &way, scale).sqrt();
        if sigmas_left <= NEAR_SIGMAS.max(options.tolerance_sigmas) {
            return fit.outcome(&problem, wake, scale, step);
        }
        let part = share.min(tangent.reach(&next));
        let trial = |halving: i32| {
            let part = part * 0.5_f64.powi(halving);
            let trial = Wake::from_array(&std::array::from_fn(|i| from[i] + part * way[i]));
            fit.allows(&trial).then_some(trial)
        };
        wake = (0..=HALVINGS).find_map(trial).ok_or(Error::NotConverged { iterations: step, sigmas_left })?;
        last = way;
        if groups.len() > coreless.len() && raised(&mut wake, least_core_m) {
            groups = &coreless;
        }
    }
    Err(Error::NotConverged { iterations: STEPS, sigmas_left })
}

/// Raises core radii below the least one, and tells whether there were any.
fn raised(wake: &mut Wake, least_m: f64) -> bool {
    let mut any = false;
    for core_m in [&mut wake.left.core_radius_m, &mut wake.right.core_radius_m] {
        any |= *core_m < least_m;
        *core_m = core_m.max(least_m);
    }
    any
}
