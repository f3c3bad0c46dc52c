//! Fit of the wake to a map of radial velocities.
//!
//! Weighted least squares with a robust loss. What a wake shows is either the mean over the gate ([`fit_map`], by the
//! iteration of Levenberg and Marquardt) or what the estimator of the map itself makes of the wake's spectra
//! ([`fit_map_of_estimator`], by damped steps of Gauss and Newton with difference quotients). The scale of the
//! residuals is their median, taken anew in each of a few rounds. Check: exact maps; noise; outliers; the spread of
//! fits over many maps.

use ndarray::{Array2, ArrayView2};

use super::estimator_response::EstimatorResponse;
use super::free::{FreeParameters, Sharing, spread};
use super::guess::first_guess;
use super::map_problem::{Expected, Problem};
use super::range_kernel::RangeKernel;
use super::small::Stop;
use super::tangent::Tangent;
use super::wake::{PARAMETERS, Parameter, Wake, WakeModel};
use crate::error::{Error, finite, length, positive};

/// The scale of residuals from means is taken anew this often.
const ROUNDS: usize = 5;
/// Most steps of Gauss and Newton, and halvings of one.
const STEPS: usize = 40;
const HALVINGS: i32 = 6;
/// Core radii below this part of a region's radius, or of the distance of lines, do not show in a map.
const SMALLEST_CORE: f64 = 0.25;
/// They end at a step of this many standard deviations at the latest: estimators round.
const NEAR_SIGMAS: f64 = 0.03;

/// A map of radial velocities, such as accumulation gives.
#[derive(Debug, Clone, Copy)]
pub struct VelocityMap<'a> {
    /// Elevation of the lines \[rad\], increasing.
    pub elevation_rad: &'a [f64],
    /// Ranges of the gates \[m\], increasing.
    pub range_m: &'a [f64],
    /// Radial velocities \[m/s\] \[line, gate\], positive away from the lidar; NaN where there is none.
    pub velocity_m_s: ArrayView2<'a, f64>,
    /// Their standard deviations \[m/s\], up to a common factor; equal ones if absent.
    pub standard_deviation_m_s: Option<ArrayView2<'a, f64>>,
}

impl VelocityMap<'_> {
    /// Checks shapes and axes, and counts the velocities.
    pub(super) fn validate(&self) -> Result<usize, Error> {
        let (lines, gates) = (self.elevation_rad.len(), self.range_m.len());
        length("lines of velocity_m_s", lines, self.velocity_m_s.nrows())?;
        length("gates of velocity_m_s", gates, self.velocity_m_s.ncols())?;
        validate_axes(self.elevation_rad, self.range_m)?;
        if let Some(deviation) = &self.standard_deviation_m_s {
            length("lines of standard_deviation_m_s", lines, deviation.nrows())?;
            length("gates of standard_deviation_m_s", gates, deviation.ncols())?;
            for (value, velocity) in deviation.iter().zip(&self.velocity_m_s) {
                if velocity.is_finite() {
                    positive("standard_deviation_m_s", *value)?;
                }
            }
        }
        Ok(self.velocity_m_s.iter().filter(|v| v.is_finite()).count())
    }

    /// Distance of neighbouring lines in the middle of the map.
    fn line_spacing_m(&self) -> f64 {
        let length = |axis: &[f64]| axis.last().copied().unwrap_or(0.0) - axis.first().copied().unwrap_or(0.0);
        let middle_m = self.range_m.first().copied().unwrap_or(0.0) + 0.5 * length(self.range_m);
        middle_m * length(self.elevation_rad) / self.elevation_rad.len() as f64
    }

    /// Standard deviation of one velocity, 1 if none was given.
    pub(super) fn deviation(&self, line: usize, gate: usize) -> f64 {
        self.standard_deviation_m_s.as_ref().map_or(1.0, |d| d[[line, gate]])
    }
}

/// Both axes are finite and increase.
pub(super) fn validate_axes(elevation_rad: &[f64], range_m: &[f64]) -> Result<(), Error> {
    for (field, axis) in [("elevation_rad", elevation_rad), ("range_m", range_m)] {
        axis.iter().try_for_each(|value| finite(field, *value))?;
        if let Some(pair) = axis.windows(2).find(|pair| pair[1] <= pair[0]) {
            return Err(Error::OutOfRange { field, value: pair[1], allowed: "increasing along its axis" });
        }
    }
    Ok(())
}

/// What a residual costs, in units of the scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// r^2/2: least squares.
    Squares,
    /// (c^2/2) ln(1 + (r/c)^2): large residuals hardly count (Cauchy).
    Cauchy {
        /// c, in units of the scale; 2.385 costs 5 % of the efficiency on normal residuals.
        width: f64,
    },
}

impl Loss {
    /// Cost, its slope over the residual (the weight), and its second derivative.
    pub(super) fn at(self, residual: f64) -> (f64, f64, f64) {
        match self {
            Self::Squares => (0.5 * residual * residual, 1.0, 1.0),
            Self::Cauchy { width } => {
                let square = (residual / width).powi(2);
                let weight = 1.0 / (1.0 + square);
                (0.5 * width * width * square.ln_1p(), weight, (1.0 - square) * weight * weight)
            }
        }
    }
}

/// How a map is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapFitOptions {
    /// What may change.
    pub free: FreeParameters,
    /// What residuals cost.
    pub loss: Loss,
    /// Neighbouring lines that share windows: 2 rho over their distance for an accumulated map, 0 for independent lines.
    pub correlated_lines: usize,
    /// Most evaluations of the map in a round.
    pub max_iterations: usize,
    /// The fit ends when the step that is left is below this part of its standard deviations.
    pub tolerance_sigmas: f64,
}

impl Default for MapFitOptions {
    /// All parameters, the loss of Cauchy, 8 correlated lines, at most 200 evaluations, to 0.01 standard deviations.
    fn default() -> Self {
        Self {
            free: FreeParameters::default(),
            loss: Loss::Cauchy { width: 2.385 },
            correlated_lines: 8,
            max_iterations: 200,
            tolerance_sigmas: 1e-2,
        }
    }
}

/// Outcome of a fit to a map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapFit {
    /// The fitted wake.
    pub wake: Wake,
    /// Covariance \[10, 10\] of the parameters in the order of [`Parameter`]; zeros where one is fixed. It tells of scatter, not of
    /// what an estimator of velocity adds to all maps alike.
    pub covariance: Array2<f64>,
    /// Whether core radii were fitted to the end. A core that the map does not resolve keeps the value of the round before, with
    /// zeros in the covariance.
    pub cores_fitted: bool,
    /// Velocities that were used.
    pub used: usize,
    /// Those with a residual above 3 scales.
    pub outliers: usize,
    /// Scale of the residuals over the given standard deviations, from their median; \[m/s\] if none were given. In
    /// uniform wind, for the map of an estimator.
    pub residual_scale: f64,
    /// Part of the robust cost of the best wind without vortices that the vortices take away: near 1 for a good fit.
    pub explained_fraction: f64,
    /// Evaluations of the map in the last round; steps of Gauss and Newton for the map of an estimator.
    pub iterations: usize,
}

impl MapFit {
    /// Standard deviation of a parameter, in its unit; 0 if it was fixed.
    #[must_use]
    pub fn standard_deviation(&self, parameter: Parameter) -> f64 {
        self.covariance[[parameter as usize; 2]].sqrt()
    }
}

/// Fits the wake to a map whose velocities are means over gates, without any prior knowledge: a search for the best pair, then
/// [`refine_map_fit`].
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
    refine_map_fit(map, model, kernel, &guess, options)
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

/// Fits the wake to a map that an estimator of this crate made, without any prior knowledge: as [`fit_map`] with its
/// mean gate, then [`refine_map_fit_of_estimator`].
///
/// # Errors
/// As [`fit_map`] and [`refine_map_fit_of_estimator`].
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
    let start = refine_map_fit(map, model, &kernel, &guess, &MapFitOptions { free, ..*options });
    let start = start.map_or(guess, |fit| fit.wake);
    refine_map_fit_of_estimator(map, model, response, &start, options)
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
    for step in 1..=STEPS {
        let here = prepared.velocities(model, &wake, map.elevation_rad);
        let tangent = Tangent::new((&prepared, model), wake, here.view(), groups, map);
        let learnt = Some(&tangent.deviation);
        let problem = Problem { learnt, ..fit.problem(groups, Expected::Shown(&tangent)) };
        let scale = problem.scale(&wake)?;
        let near = problem.reweighted(wake, scale, fit.stop)?;
        let (from, to) = (wake.to_array(), near.to_array());
        let way: [f64; PARAMETERS] = std::array::from_fn(|i| to[i] - from[i]);
        // where peaks jump the map is not smooth: each time the steps turn round they are shortened, so that their
        // ends are averaged (Kesten 1958)
        turns += usize::from(problem.product(&wake, &way, &last, scale) < 0.0);
        let share = ((1 + turns) as f64).recip();
        sigmas_left = share * problem.product(&wake, &way, &way, scale).sqrt();
        if sigmas_left <= NEAR_SIGMAS.max(options.tolerance_sigmas) {
            return fit.outcome(&problem, wake, scale, step);
        }
        let part = share.min(tangent.reach(&near));
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

/// What both fits share.
struct Fit<'a, 'm> {
    map: &'a VelocityMap<'m>,
    model: &'a WakeModel,
    kernel: &'a RangeKernel,
    options: &'a MapFitOptions,
    groups: Vec<Vec<usize>>,
    stop: Stop,
    used: usize,
}

impl<'a, 'm> Fit<'a, 'm> {
    fn new(
        map: &'a VelocityMap<'m>,
        model: &'a WakeModel,
        kernel: &'a RangeKernel,
        guess: &Wake,
        options: &'a MapFitOptions,
    ) -> Result<Self, Error> {
        let used = map.validate()?;
        guess.validate()?;
        let groups = options.free.groups();
        let needed = 10 * groups.len().max(1);
        if used < needed {
            return Err(Error::TooFewVelocities { found: used, needed });
        }
        let stop = Stop { iterations: options.max_iterations, sigmas: options.tolerance_sigmas, learns: false };
        Ok(Self { map, model, kernel, options, groups, stop, used })
    }

    fn coreless(&self) -> Vec<Vec<usize>> {
        self.groups.iter().filter(|group| !is_core(group)).cloned().collect()
    }

    fn problem<'p>(&'p self, groups: &'p [Vec<usize>], expected: Expected<'p>) -> Problem<'p, 'm> {
        Problem { map: self.map, model: self.model, expected, groups, loss: self.options.loss, learnt: None }
    }

    /// Whether the model exists there: with images, above the ground only.
    fn allows(&self, wake: &Wake) -> bool {
        let above = wake.left.height_m > 0.0 && wake.right.height_m > 0.0;
        wake.validate().is_ok() && (above || !self.model.images)
    }

    fn outcome(&self, problem: &Problem<'_, '_>, wake: Wake, scale: f64, iterations: usize) -> Result<MapFit, Error> {
        let covariance = problem.covariance(&wake, scale, self.options.correlated_lines)?;
        let residuals = problem.residuals(&wake);
        let cost = |residuals: &[f64]| residuals.iter().map(|r| self.options.loss.at(r / scale).0).sum::<f64>();
        // without vortices a gate shows its mean
        let means = Problem { expected: Expected::Means(self.kernel), ..*problem };
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
        })
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

/// Whether a free number moves core radii.
fn is_core(group: &[usize]) -> bool {
    group.iter().all(|&place| place == Parameter::LeftCore as usize || place == Parameter::RightCore as usize)
}

/// Median of the numbers, which are reordered; NaN if there are none.
pub(super) fn median(numbers: &mut [f64]) -> f64 {
    if numbers.is_empty() {
        return f64::NAN;
    }
    let middle = numbers.len() / 2;
    *numbers.select_nth_unstable_by(middle, f64::total_cmp).1
}
