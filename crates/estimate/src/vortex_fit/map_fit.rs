//! Fit of the wake to a map of radial velocities.
//!
//! Weighted least squares with a robust loss by the iteration of Levenberg and Marquardt. The scale of the residuals is their
//! median, and what a peak is off the mean velocity is that of the last wake; both are taken anew in each of a few rounds. Velocities of one line share air and noise, and neighbouring lines share windows where
//! a map is accumulated, so the covariance is the sandwich A^-1 B A^-1 (Huber 1967), with B from the sums of the gradients over
//! lines, neighbours tapered (Newey and West 1987). Check: exact maps; noise; outliers; the spread of fits over many maps.

use ndarray::{Array2, ArrayView2};

use super::free::{FreeParameters, gathered, moved, spread};
use super::guess::first_guess;
use super::range_kernel::{LineScratch, RangeKernel};
use super::small::{Normal, Stop, descend, inverse};
use super::wake::{PARAMETERS, Parameter, Ray, Wake, WakeModel};
use crate::error::{Error, finite, length, positive};
use crate::parallel::map_indexed;

/// Median of the absolute value of a normal number.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;
/// Scale and shifts of peaks are taken anew this often.
const ROUNDS: usize = 5;

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
        for (field, axis) in [("elevation_rad", self.elevation_rad), ("range_m", self.range_m)] {
            axis.iter().try_for_each(|value| finite(field, *value))?;
            if let Some(pair) = axis.windows(2).find(|pair| pair[1] <= pair[0]) {
                return Err(Error::OutOfRange { field, value: pair[1], allowed: "increasing along its axis" });
            }
        }
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

    /// Standard deviation of one velocity, 1 if none was given.
    pub(super) fn deviation(&self, line: usize, gate: usize) -> f64 {
        self.standard_deviation_m_s.as_ref().map_or(1.0, |d| d[[line, gate]])
    }
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
    fn at(self, residual: f64) -> (f64, f64, f64) {
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
    /// Scale of the residuals over the given standard deviations, from their median; \[m/s\] if none were given.
    pub residual_scale: f64,
    /// Part of the robust cost of the best wind without vortices that the vortices take away: near 1 for a good fit.
    pub explained_fraction: f64,
    /// Evaluations of the map in the last round.
    pub iterations: usize,
}

impl MapFit {
    /// Standard deviation of a parameter, in its unit; 0 if it was fixed.
    #[must_use]
    pub fn standard_deviation(&self, parameter: Parameter) -> f64 {
        self.covariance[[parameter as usize; 2]].sqrt()
    }
}

/// Fits the wake to a map without any prior knowledge: a search for the best pair, then [`refine_map_fit`].
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
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input; [`Error::TooFewVelocities`] with less than ten velocities for each free
/// number; [`Error::NotConverged`]; [`Error::Linalg`] if a free parameter does not show in the map.
pub fn refine_map_fit(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    kernel: &RangeKernel,
    guess: &Wake,
    options: &MapFitOptions,
) -> Result<MapFit, Error> {
    let used = map.validate()?;
    guess.validate()?;
    let groups = options.free.groups();
    let needed = 10 * groups.len().max(1);
    if used < needed {
        return Err(Error::TooFewVelocities { found: used, needed });
    }
    let coreless: Vec<Vec<usize>> = groups.iter().filter(|group| !is_core(group)).cloned().collect();
    let mut problem = Problem { map, model, kernel, groups: &groups, loss: options.loss, shifts: Vec::new() };
    let stop = Stop { iterations: options.max_iterations, sigmas: options.tolerance_sigmas, learns: false };
    let mut wake = options.free.start(guess);
    let mut scale = problem.scale(&wake)?;
    let mut iterations = 0;
    for round in 0..ROUNDS {
        (wake, iterations) = match problem.descend(wake, scale, stop) {
            // a core that the map does not resolve may run away to nothing: it keeps what the last round gave
            Err(Error::NotConverged { .. }) if round > 0 && coreless.len() < problem.groups.len() => {
                problem.groups = &coreless;
                problem.descend(wake, scale, stop)?
            }
            end => end?,
        };
        problem.shifts = problem.lines(|line, scratch| {
            kernel.peak_shifts(model, &wake, Ray::new(map.elevation_rad[line]), map.range_m, scratch)
        });
        scale = problem.scale(&wake)?;
    }
    let covariance = problem.covariance(&wake, scale, options.correlated_lines)?;
    let residuals = problem.residuals(&wake);
    let cost = |residuals: &[f64]| residuals.iter().map(|r| options.loss.at(r / scale).0).sum::<f64>();
    let calm_cost = problem.calm(&wake, scale, stop).map_or(f64::NAN, |calm| cost(&problem.residuals(&calm)));
    Ok(MapFit {
        wake,
        covariance: spread(problem.groups, &covariance),
        cores_fitted: problem.groups.iter().any(|group| is_core(group)),
        used,
        outliers: residuals.iter().filter(|r| r.abs() > 3.0 * scale).count(),
        residual_scale: scale,
        explained_fraction: 1.0 - cost(&residuals) / calm_cost,
        iterations,
    })
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

struct Problem<'a, 'm> {
    map: &'a VelocityMap<'m>,
    model: &'a WakeModel,
    kernel: &'a RangeKernel,
    groups: &'a [Vec<usize>],
    loss: Loss,
    /// What a peak is off the mean, for each line, at the wake of the last round; none at first.
    shifts: Vec<Vec<f64>>,
}

/// Sums over one line.
struct LineSums {
    cost: f64,
    gradient: Vec<f64>,
    /// Sums of j j^T with the weights of the loss, and with its second derivative.
    weighted: Array2<f64>,
    curved: Array2<f64>,
}

impl Problem<'_, '_> {
    fn lines<T: Send>(&self, f: impl Fn(usize, &mut LineScratch) -> T + Sync + Send) -> Vec<T> {
        map_indexed(self.map.elevation_rad.len(), LineScratch::default, |scratch, line| f(line, scratch))
    }

    /// One round from a start on: the wake and the evaluations.
    fn descend(&self, start: Wake, scale: f64, stop: Stop) -> Result<(Wake, usize), Error> {
        let evaluate = |wake: &Wake| self.normal(wake, scale, self.model.images);
        let step = |wake: &Wake, step: &[f64]| moved(self.groups, wake, step);
        descend(start, stop, evaluate, step).map(|(wake, _, iterations)| (wake, iterations))
    }

    fn shift(&self, line: usize, gate: usize) -> f64 {
        self.shifts.get(line).map_or(0.0, |shifts| shifts[gate])
    }

    /// Residuals over their standard deviations, of all velocities.
    fn residuals(&self, wake: &Wake) -> Vec<f64> {
        let lines = self.lines(|line, scratch| {
            let mut residuals = Vec::new();
            let ray = Ray::new(self.map.elevation_rad[line]);
            self.kernel.apply((self.model, wake, ray), self.map.range_m, false, scratch, |gate, velocity, _| {
                let measured = self.map.velocity_m_s[[line, gate]];
                if measured.is_finite() {
                    residuals.push((measured - velocity - self.shift(line, gate)) / self.map.deviation(line, gate));
                }
            });
            residuals
        });
        lines.concat()
    }

    /// Robust scale of the residuals; a millionth of the speeds where the fit is exact.
    fn scale(&self, wake: &Wake) -> Result<f64, Error> {
        let mut residuals: Vec<f64> = self.residuals(wake).iter().map(|r| r.abs()).collect();
        let scale = median(&mut residuals) / NORMAL_MEDIAN;
        finite("scale of the residuals", scale)?;
        Ok(scale.max(1e-6))
    }

    fn line_sums(&self, wake: &Wake, scale: f64, line: usize, scratch: &mut LineScratch) -> LineSums {
        let order = self.groups.len();
        let mut sums = LineSums {
            cost: 0.0,
            gradient: vec![0.0; order],
            weighted: Array2::zeros((order, order)),
            curved: Array2::zeros((order, order)),
        };
        let mut slope = vec![0.0; order];
        let ray = Ray::new(self.map.elevation_rad[line]);
        let take = |gate: usize, velocity: f64, slopes: &[f64; PARAMETERS]| {
            let measured = self.map.velocity_m_s[[line, gate]];
            if !measured.is_finite() {
                return;
            }
            let unit = scale * self.map.deviation(line, gate);
            gathered(self.groups, slopes, &mut slope);
            let residual = (measured - velocity - self.shift(line, gate)) / unit;
            let (cost, weight, second) = self.loss.at(residual);
            sums.cost += cost;
            for i in 0..order {
                let s = slope[i] / unit;
                sums.gradient[i] -= weight * residual * s;
                for (j, other) in slope.iter().enumerate().take(i + 1) {
                    let product = s * other / unit;
                    sums.weighted[[i, j]] += weight * product;
                    sums.curved[[i, j]] += second * product;
                }
            }
        };
        self.kernel.apply((self.model, wake, ray), self.map.range_m, true, scratch, take);
        sums
    }

    /// Cost, gradient and curvature; nothing for a wake that is impossible or, with images, below the ground.
    fn normal(&self, wake: &Wake, scale: f64, above_ground: bool) -> Option<Normal> {
        wake.validate().ok()?;
        if above_ground && (wake.left.height_m <= 0.0 || wake.right.height_m <= 0.0) {
            return None;
        }
        let order = self.groups.len();
        let mut normal = Normal { cost: 0.0, gradient: vec![0.0; order], curvature: Array2::zeros((order, order)) };
        for sums in self.lines(|line, scratch| self.line_sums(wake, scale, line, scratch)) {
            normal.cost += sums.cost;
            normal.gradient.iter_mut().zip(sums.gradient).for_each(|(n, s)| *n += s);
            normal.curvature += &sums.weighted;
        }
        mirror(&mut normal.curvature);
        Some(normal)
    }

    /// The sandwich, with gradients of lines up to `correlated` apart taken together.
    fn covariance(&self, wake: &Wake, scale: f64, correlated: usize) -> Result<Array2<f64>, Error> {
        let order = self.groups.len();
        let lines = self.lines(|line, scratch| self.line_sums(wake, scale, line, scratch));
        let (mut bread, mut weighted) = (Array2::zeros((order, order)), Array2::zeros((order, order)));
        let mut filling = Array2::<f64>::zeros((order, order));
        for (a, line) in lines.iter().enumerate() {
            bread += &line.curved;
            weighted += &line.weighted;
            for (b, other) in lines.iter().enumerate().skip(a.saturating_sub(correlated)).take(2 * correlated + 1) {
                let distance = a.abs_diff(b);
                if distance <= correlated {
                    let taper = 1.0 - distance as f64 / (correlated + 1) as f64;
                    for ((i, j), f) in filling.indexed_iter_mut() {
                        *f += taper * line.gradient[i] * other.gradient[j];
                    }
                }
            }
        }
        mirror(&mut bread);
        mirror(&mut weighted);
        // with many outliers the second derivatives need not be positive: their weights are, and are larger
        let bread = inverse("curvature of the fit", &bread).or_else(|_| inverse("curvature of the fit", &weighted))?;
        Ok(bread.dot(&filling).dot(&bread))
    }

    /// The best wind without vortices.
    fn calm(&self, wake: &Wake, scale: f64, stop: Stop) -> Option<Wake> {
        let mut calm = *wake;
        (calm.left.circulation_m2_s, calm.right.circulation_m2_s) = (0.0, 0.0);
        let groups: Vec<Vec<usize>> =
            self.groups.iter().filter(|group| group[0] >= Parameter::Wind as usize).cloned().collect();
        if groups.is_empty() {
            return Some(calm);
        }
        let wind = Problem {
            map: self.map,
            model: self.model,
            kernel: self.kernel,
            groups: &groups,
            loss: self.loss,
            shifts: Vec::new(),
        };
        let step = |wake: &Wake, step: &[f64]| moved(&groups, wake, step);
        descend(calm, stop, |wake| wind.normal(wake, scale, false), step).ok().map(|(calm, _, _)| calm)
    }
}

/// Copies the lower triangle to the upper one.
fn mirror(a: &mut Array2<f64>) {
    for i in 0..a.nrows() {
        for j in 0..i {
            a[[j, i]] = a[[i, j]];
        }
    }
}
