//! Fit of the wake to a map that an estimator of this crate made.
//!
//! Damped steps of Gauss and Newton on what the estimator itself makes of the wake's spectra, with difference quotients
//! that are taken anew when the wake has moved by more than its error. Residuals are those of all places, so that the fit ends
//! where it must; slopes only weigh them, and are taken at every few lines and gates, linear between. There, too, the fits from
//! all starts begin: all places are asked from their ends on. Check: exact maps of peaks; the spread of fits over many maps.

use ndarray::Array2;

use crate::error::Error;
use crate::vortex_fit::damped_newton::{Averaging, halved};
use crate::vortex_fit::map_fit::coarse::Coarse;
use crate::vortex_fit::map_fit::estimator_response::Prepared;
use crate::vortex_fit::map_fit::guess::first_guess;
use crate::vortex_fit::map_fit::means::Fit;
use crate::vortex_fit::map_fit::problem::{Expected, Problem};
use crate::vortex_fit::map_fit::secondary::{Found, Setting};
use crate::vortex_fit::map_fit::starts::{best_of, distinct, starts, with_typical_core};
use crate::vortex_fit::map_fit::tangent::{Tangent, near};
use crate::vortex_fit::{
    EstimatorResponse, FreeParameters, MapFit, MapFitOptions, PARAMETERS, RangeKernel, Sharing, VelocityMap, Vortex,
    Wake, WakeModel, refine_map_fit,
};

/// Most steps of Gauss and Newton.
const STEPS: usize = 40;
/// The least core radius over a region's radius, or over the distance of lines.
const SMALLEST_CORE: f64 = 0.25;
/// Fits end at a step of this many standard deviations at the latest, with neighbours that are alike counted once: estimators
/// round.
const NEAR_SIGMAS: f64 = 0.03;
/// Fits that only lead to a start may end at such a step.
const ROUGH_SIGMAS: f64 = 0.1;
/// So may those to few places, which all places correct at once.
const COARSE_SIGMAS: f64 = 0.5;
/// Places that tell nearly all of a map: no farther apart than this part of the radius of its regions, for starts and for slopes (half the
/// radius for these saves a tenth of the time, but heights scatter by some per cent more), and of the width of its gates.
const LINES_OVER_RADIUS: [f64; 2] = [0.8, 0.3];
const GATES_OVER_WIDTH: f64 = 0.6;
/// Nodes of the air are so much farther apart there.
const COARSER_NODES: f64 = 2.0;

/// Fits the wake to a map that an estimator of this crate made, without any prior knowledge: as [`fit_map`](crate::vortex_fit::fit_map) with its
/// mean gate, then [`refine_map_fit_of_estimator`] of every few lines and gates with each of a few core radii, if they are fitted, then of all
/// from the ends that differ.
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
    let whole = Shown::new(*map, model, response, options, 1.0)?;
    let coarse = LINES_OVER_RADIUS.map(|part| whole.coarse(response, part));
    let few = |place: usize| coarse[place].as_ref().map(|few| Few::new(few, model, response, options)).transpose();
    let (for_starts, for_slopes) = (few(0)?, few(1)?);
    let guess = first_guess(map, model, &whole.kernel)?;
    // taken for means, peaks mislead above all the core radius, and may lead nowhere: then the guess is the start
    let free = FreeParameters { core_radius: Sharing::Fixed, ..options.free };
    let rough = MapFitOptions { free, tolerance_sigmas: ROUGH_SIGMAS, ..*options };
    let by_means = match &for_starts {
        Some(Few { shown, .. }) => refine_map_fit(&shown.map, model, &shown.kernel, &guess, &rough),
        None => refine_map_fit(map, model, &whole.kernel.coarser(2), &guess, &rough),
    };
    let by_means = by_means.map(|fit| fit.wake);
    let refine = |start: &Wake| whole.refined(start, for_slopes.as_ref(), NEAR_SIGMAS);
    let from = |about: &Wake| {
        let starts = starts(about, options);
        let ends = for_starts.as_ref().map_or_else(Vec::new, |few| few.ends(&starts));
        best_of(if ends.is_empty() { &starts } else { &ends }, refine)
    };
    let fit = match (from(by_means.as_ref().unwrap_or(&guess)), by_means) {
        (Err(Error::NotConverged { .. }), Ok(_)) => from(&guess),
        (first, _) => first,
    };
    with_typical_core(fit?, options, refine)
}

/// Fits the wake to a map that an estimator made, from a given start on: what is expected of a wake is the estimate from its
/// expected correlograms. A vortex that has no circulation at the start is none: its numbers are not fitted.
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
    let whole = Shown::new(*map, model, response, options, 1.0)?;
    let coarse = whole.coarse(response, LINES_OVER_RADIUS[1]);
    let few = coarse.as_ref().map(|coarse| Few::new(coarse, model, response, options)).transpose()?;
    whole.refined(guess, few.as_ref(), NEAR_SIGMAS)
}

/// The pair of a fit with secondary vortices beside it, if the map shows them: both are fitted at once, then the pair once more with the others
/// as they are. The covariance counts what is not known of them.
///
/// # Errors
/// As [`refine_map_fit_of_estimator`].
pub fn fit_secondary_vortices(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    response: &EstimatorResponse<'_>,
    pair: &Wake,
    options: &MapFitOptions,
) -> Result<Option<(MapFit, [Vortex; 2])>, Error> {
    map.validate()?;
    pair.validate()?;
    let whole = Shown::new(*map, model, response, options, 1.0)?;
    let coarse = whole.coarse(response, LINES_OVER_RADIUS[0]);
    let few = coarse.as_ref().map(|coarse| Few::new(coarse, model, response, options)).transpose()?;
    let found = match &few {
        Some(few) => few.shown.with_secondary(pair),
        None => whole.with_secondary(pair),
    };
    let Some(found) = found else { return Ok(None) };
    let model = WakeModel { secondary: Some(found.secondary), ..*model };
    let fit = refine_map_fit_of_estimator(map, &model, response, &found.wake, options)?;
    Ok(Some((MapFit { covariance: found.covariance, ..fit }, found.secondary)))
}

/// The few places of a map that tell nearly all of it, and what an estimator shows there.
struct Few<'a> {
    coarse: &'a Coarse,
    shown: Shown<'a, 'a>,
}

impl<'a> Few<'a> {
    fn new(
        coarse: &'a Coarse,
        model: &'a WakeModel,
        response: &'a EstimatorResponse<'a>,
        options: &MapFitOptions,
    ) -> Result<Self, Error> {
        let correlated_lines = options.correlated_lines.div_ceil(coarse.line_step());
        let options = MapFitOptions { correlated_lines, ..*options };
        Ok(Self { coarse, shown: Shown::new(coarse.map(), model, response, &options, COARSER_NODES)? })
    }

    /// Where the fits from some starts end that do, without those that are one.
    fn ends(&self, starts: &[Wake]) -> Vec<Wake> {
        let refine = |start: &Wake| self.shown.refined(start, None, COARSE_SIGMAS);
        let end = |start: &Wake| with_typical_core(refine(start)?, &self.shown.options, refine);
        distinct(starts.iter().filter_map(|start| end(start).ok()).collect())
    }

    /// Slopes at all places of a map of that size, from those at the few.
    fn slopes(&self, at: &Wake, groups: &[Vec<usize>], size: (usize, usize)) -> Vec<Array2<f64>> {
        let prepared = &self.shown.prepared;
        let here = prepared.velocities(at);
        let some = Tangent::slopes(prepared, at, here.view(), groups);
        some.iter().map(|slope| self.coarse.everywhere(slope, size)).collect()
    }
}

/// A map, and what an estimator shows at its places.
struct Shown<'a, 'm> {
    map: VelocityMap<'m>,
    model: &'a WakeModel,
    prepared: Prepared<'a>,
    kernel: RangeKernel,
    options: MapFitOptions,
    /// Core radii below this do not show \[m\].
    least_core_m: f64,
}

impl<'a, 'm: 'a> Shown<'a, 'm> {
    /// With nodes of the air `coarser` times as far apart as need be.
    fn new(
        map: VelocityMap<'m>,
        model: &'a WakeModel,
        response: &'a EstimatorResponse<'a>,
        options: &MapFitOptions,
        coarser: f64,
    ) -> Result<Self, Error> {
        let prepared = response.prepared(model, (map.elevation_rad, map.range_m), coarser);
        let kernel = prepared.kernel()?;
        let least_core_m = SMALLEST_CORE * map.line_spacing_m().max(response.least_radius_m(map.range_m));
        Ok(Self { map, model, prepared, kernel, options: *options, least_core_m })
    }

    /// Four vortices in place of a pair, if they explain the map better.
    fn with_secondary(&self, pair: &Wake) -> Option<Found> {
        let Self { map, model, prepared, kernel, options, .. } = self;
        let groups = &options.free.groups();
        Setting { map, model, prepared: Some(prepared), kernel, seconds: None, options, groups }.find(pair)
    }

    /// The places that tell nearly all of the map.
    fn coarse(&self, response: &EstimatorResponse<'_>, lines_over_radius: f64) -> Option<Coarse> {
        let line_m = lines_over_radius * response.least_radius_m(self.map.range_m);
        Coarse::of(&self.map, line_m, GATES_OVER_WIDTH * self.kernel.width_m())
    }

    /// The fit from a start on until the step that is left is below `near_sigmas` or the tolerance, with slopes from `few` places, if there
    /// are such.
    fn refined(&self, guess: &Wake, few: Option<&Few<'_>>, near_sigmas: f64) -> Result<MapFit, Error> {
        let options = &self.options;
        let fit = Fit::new(&self.map, self.model, &self.kernel, guess, options)?;
        let coreless = fit.coreless();
        let mut groups = &fit.groups;
        let mut wake = options.free.start(guess);
        let (mut averaging, mut last, mut sigmas_left) = (Averaging::default(), [0.0; PARAMETERS], f64::INFINITY);
        let mut slopes: Option<(Wake, Vec<Array2<f64>>)> = None;
        let (mut alike, mut released) = (1.0, false);
        let (mut step, mut most) = (0, STEPS);
        while step < most {
            step += 1;
            let here = self.prepared.velocities(&wake);
            let known = slopes.take().filter(|(at, slopes)| near(at, &wake) && slopes.len() == groups.len());
            let moved = known.is_none();
            let known = known.unwrap_or_else(|| {
                let slopes = match few {
                    Some(few) => few.slopes(&wake, groups, here.dim()),
                    None => Tangent::slopes(&self.prepared, &wake, here.view(), groups),
                };
                (wake, slopes)
            });
            let tangent = Tangent::new(&self.prepared, wake, here.view(), &known.1, &self.map);
            slopes = Some(known);
            let learnt = Some(&tangent.deviation);
            let mut problem = Problem { learnt, ..fit.problem(groups, Expected::Shown(&tangent)) };
            let scale = problem.scale(&wake)?;
            if moved {
                alike = fit.alike(&problem, &wake, scale);
            }
            problem.prior = fit.prior(groups, alike);
            let next = problem.reweighted(wake, scale, fit.stop)?;
            let (from, to) = (wake.to_array(), next.to_array());
            let way: [f64; PARAMETERS] = std::array::from_fn(|i| to[i] - from[i]);
            let [with_last, of_last] = [&way, &last].map(|step| problem.product(&wake, step, &last, scale));
            let share = averaging.part(with_last, of_last);
            sigmas_left = share * (problem.product(&wake, &way, &way, scale) / alike).sqrt();
            if sigmas_left <= near_sigmas.max(options.tolerance_sigmas) {
                // a core that shrank on the way, as where the pair was narrow, may show where it ends
                if groups.len() < fit.groups.len() && !released {
                    (groups, released, most) = (&fit.groups, true, step + STEPS);
                    continue;
                }
                return fit.outcome(&problem, wake, scale, step);
            }
            let next = halved(share.min(tangent.reach(&next)), |part| {
                let trial = Wake::from_array(&std::array::from_fn(|i| from[i] + part * way[i]));
                fit.allows(&trial).then_some(trial)
            });
            wake = next.ok_or(Error::NotConverged { iterations: step, sigmas_left })?;
            last = way;
            if groups.len() > coreless.len() && raised(&mut wake, self.least_core_m) {
                groups = &coreless;
            }
        }
        Err(Error::NotConverged { iterations: step, sigmas_left })
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bound::Noise;
    use crate::estimators::{Refinement, SpectralPeak};
    use crate::spectrum::Correlogram;
    use crate::vortex_fit::PulseShape;
    use crate::window::{Sampling, SignalKind, Weighting};

    /// Slopes at every few lines and gates, linear between, against difference quotients at all places.
    #[test]
    fn slopes_from_few_places_are_near_those_of_all() {
        let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap();
        let peak = SpectralPeak::new(&sampling, SignalKind::Real, 64, 1024, Refinement::Parabola).unwrap();
        let statistic = Correlogram::<f64>::new(Weighting::default(), 64).unwrap();
        let pulse = PulseShape::gaussian(120e-9).unwrap();
        let response = EstimatorResponse::new(&statistic, &peak, &sampling, &pulse, (Noise::White, 1.0), 2.0).unwrap();
        let (elevation_rad, range_m): (Vec<f64>, Vec<f64>) = (
            (0..130).map(|i| 0.05 + f64::from(i) * 1e-3).collect(),
            (0..40).map(|i| 320.0 + 4.0 * f64::from(i)).collect(),
        );
        let wake = Wake::from_array(&[480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.3, 0.0]);
        let (model, options) = (WakeModel::default(), MapFitOptions::default());
        let velocity_m_s = response.map(&model, &wake, &elevation_rad, &range_m).unwrap();
        let map = VelocityMap {
            elevation_rad: &elevation_rad,
            range_m: &range_m,
            velocity_m_s: velocity_m_s.view(),
            standard_deviation_m_s: None,
        };
        let whole = Shown::new(map, &model, &response, &options, 1.0).unwrap();
        let coarse = whole.coarse(&response, LINES_OVER_RADIUS[1]).unwrap();
        assert!(2 * coarse.map().velocity_m_s.len() <= velocity_m_s.len());
        let few = Few::new(&coarse, &model, &response, &options).unwrap();
        let groups = options.free.groups();
        let some = few.slopes(&wake, &groups, velocity_m_s.dim());
        let all = Tangent::slopes(&whole.prepared, &wake, velocity_m_s.view(), &groups);
        for ((group, some), all) in groups.iter().zip(&some).zip(&all) {
            let product = |a: &Array2<f64>, b: &Array2<f64>| (a * b).sum();
            let size = (product(some, some) / product(all, all)).sqrt();
            let alike = product(some, all) / (product(some, some) * product(all, all)).sqrt();
            // slopes of cores are narrow, and peaks that jump make them rough
            let least = if group[0] == 6 || group[0] == 7 { 0.8 } else { 0.93 };
            assert!((size - 1.0).abs() < 0.15 && alike > least, "{group:?}: {size} {alike}");
        }
    }
}
