//! Robust cost of a wake given a map: residuals, sums over lines, the sandwich.
//!
//! Check: exact maps; the spread of fits over many maps.

use ndarray::{Array1, Array2};

use crate::error::{Error, finite};
use crate::parallel::map_indexed;
use crate::vortex_fit::damped_newton::{Normal, Stop, descend, inverse, solve};
use crate::vortex_fit::map_fit::data::robust_scale;
use crate::vortex_fit::map_fit::residual_covariance::{Cell, alike, filling};
use crate::vortex_fit::map_fit::tangent::Tangent;
use crate::vortex_fit::wake::free_parameters::{gathered, moved};
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::range_kernel::LineScratch;
use crate::vortex_fit::{CorePrior, Loss, PARAMETERS, Parameter, RangeKernel, VelocityMap, Wake, WakeModel};

/// What is expected of a wake.
#[derive(Clone, Copy)]
pub(crate) enum Expected<'a> {
    /// Means over gates.
    Means(&'a RangeKernel),
    /// What an estimator shows, to first order about a wake; its slopes are those of the groups.
    Shown(&'a Tangent),
}

#[derive(Clone, Copy)]
pub(crate) struct Problem<'a, 'm> {
    pub(crate) map: &'a VelocityMap<'m>,
    pub(crate) model: &'a WakeModel,
    pub(crate) expected: Expected<'a>,
    pub(crate) groups: &'a [Vec<usize>],
    pub(crate) loss: Loss,
    /// Standard deviations beyond those of the map.
    pub(crate) learnt: Option<&'a Array2<f64>>,
    /// What is known of cores, and the number of velocities that count as one: as the losses of all of them are added up, so
    /// many times it must count.
    pub(crate) prior: Option<(CorePrior, f64)>,
}

/// Sums over one line.
struct LineSums {
    cost: f64,
    gradient: Vec<f64>,
    /// Sums of j j^T with the weights of the loss, and with its second derivative: rows of the lower triangle.
    weighted: Vec<f64>,
    curved: Vec<f64>,
}

impl Problem<'_, '_> {
    fn lines<T: Send>(&self, f: impl Fn(usize, &mut LineScratch) -> T + Sync + Send) -> Vec<T> {
        map_indexed(self.map.elevation_rad.len(), LineScratch::default, |scratch, line| f(line, scratch))
    }

    /// One round from a start on: the wake and the evaluations.
    pub(crate) fn descend(&self, start: Wake, scale: f64, stop: Stop) -> Result<(Wake, usize), Error> {
        let evaluate = |wake: &Wake| self.normal(wake, scale, self.model.images);
        let step = |wake: &Wake, step: &[f64]| moved(self.groups, wake, step);
        descend(start, stop, evaluate, step).map(|(wake, _, iterations)| (wake, iterations))
    }

    fn deviation(&self, line: usize, gate: usize) -> f64 {
        self.learnt.map_or(1.0, |learnt| learnt[[line, gate]]) * self.map.deviation(line, gate)
    }

    /// Expected velocities of a line, with `slopes` their derivatives by group: `out(gate, velocity, derivatives)`.
    fn each_gate(
        &self,
        (wake, line): (&Wake, usize),
        slopes: bool,
        scratch: &mut LineScratch,
        mut out: impl FnMut(usize, f64, &[f64]),
    ) {
        let mut slope = vec![0.0; self.groups.len()];
        match self.expected {
            Expected::Means(kernel) => {
                let ray = Ray::new(self.map.elevation_rad[line]);
                kernel.apply((self.model, wake, ray), self.map.range_m, slopes, scratch, |gate, velocity, all| {
                    gathered(self.groups, all, &mut slope);
                    out(gate, velocity, &slope);
                });
            }
            Expected::Shown(tangent) => {
                let (to, from) = (wake.to_array(), tangent.at.to_array());
                for gate in 0..self.map.range_m.len() {
                    let mut velocity = tangent.velocity_m_s[[line, gate]];
                    for ((place, slope), of) in self.groups.iter().zip(&mut slope).zip(&tangent.slopes) {
                        *slope = of[[line, gate]];
                        velocity += *slope * (to[place[0]] - from[place[0]]);
                    }
                    if velocity.is_finite() && slope.iter().all(|s| s.is_finite()) {
                        out(gate, velocity, &slope);
                    }
                }
            }
        }
    }

    /// Minimum for velocities that are linear in the parameters, by least squares with weights taken anew: each round
    /// lowers the cost.
    pub(crate) fn reweighted(&self, start: Wake, scale: f64, stop: Stop) -> Result<Wake, Error> {
        let mut wake = start;
        for _ in 0..stop.iterations {
            let Some(normal) = self.normal(&wake, scale, false) else { break };
            let down: Vec<f64> = normal.gradient.iter().map(|g| -g).collect();
            let step = solve(&normal.curvature, &down).ok_or(Error::Linalg {
                what: "curvature of the fit",
                order: down.len(),
                reason: "is singular to working precision: a free parameter does not show in the data",
            })?;
            wake = moved(self.groups, &wake, &step);
            if step.iter().zip(&down).map(|(s, d)| s * d).sum::<f64>() <= stop.sigmas * stop.sigmas {
                break;
            }
        }
        Ok(wake)
    }

    /// Inner product of two steps of the parameters, in variances of the fit.
    pub(crate) fn product(&self, at: &Wake, a: &[f64; PARAMETERS], b: &[f64; PARAMETERS], scale: f64) -> f64 {
        let free = |step: &[f64; PARAMETERS]| self.groups.iter().map(|group| step[group[0]]).collect::<Array1<f64>>();
        self.normal(at, scale, false).map_or(f64::NAN, |normal| free(a).dot(&normal.curvature.dot(&free(b))))
    }

    /// Residuals over their standard deviations, of all velocities.
    pub(crate) fn residuals(&self, wake: &Wake) -> Vec<f64> {
        let lines = self.lines(|line, scratch| {
            let mut residuals = Vec::new();
            self.each_gate((wake, line), false, scratch, |gate, velocity, _| {
                let measured = self.map.velocity_m_s[[line, gate]];
                if measured.is_finite() {
                    residuals.push((measured - velocity) / self.deviation(line, gate));
                }
            });
            residuals
        });
        lines.concat()
    }

    /// Robust scale of the residuals; a millionth of the speeds where the fit is exact.
    pub(crate) fn scale(&self, wake: &Wake) -> Result<f64, Error> {
        let scale = robust_scale(self.residuals(wake).into_iter());
        finite("scale of the residuals", scale)?;
        Ok(scale.max(1e-6))
    }

    fn line_sums(&self, wake: &Wake, scale: f64, line: usize, scratch: &mut LineScratch) -> LineSums {
        let order = self.groups.len();
        let triangle = vec![0.0; order * (order + 1) / 2];
        let mut sums = LineSums { cost: 0.0, gradient: vec![0.0; order], weighted: triangle.clone(), curved: triangle };
        let mut scaled = vec![0.0; order];
        let take = |gate: usize, velocity: f64, slope: &[f64]| {
            let measured = self.map.velocity_m_s[[line, gate]];
            if !measured.is_finite() {
                return;
            }
            let unit = scale * self.deviation(line, gate);
            let residual = (measured - velocity) / unit;
            let (cost, weight, second) = self.loss.at(residual);
            sums.cost += cost;
            scaled.iter_mut().zip(slope).for_each(|(scaled, slope)| *scaled = slope / unit);
            let (mut weighted, mut curved) = (&mut sums.weighted[..], &mut sums.curved[..]);
            for (i, s) in scaled.iter().enumerate() {
                sums.gradient[i] -= weight * residual * s;
                let (row, rest) = weighted.split_at_mut(i + 1);
                let (curved_row, curved_rest) = curved.split_at_mut(i + 1);
                for ((w, c), other) in row.iter_mut().zip(curved_row).zip(&scaled) {
                    let product = s * other;
                    *w += weight * product;
                    *c += second * product;
                }
                (weighted, curved) = (rest, curved_rest);
            }
        };
        self.each_gate((wake, line), true, scratch, take);
        sums
    }

    /// Cost, gradient and curvature; nothing for a wake that is impossible or, with images, below the ground.
    fn normal(&self, wake: &Wake, scale: f64, above_ground: bool) -> Option<Normal> {
        // to first order every wake is possible
        if matches!(self.expected, Expected::Means(_)) {
            wake.validate().ok()?;
            if above_ground && (wake.left.height_m <= 0.0 || wake.right.height_m <= 0.0) {
                return None;
            }
        }
        let order = self.groups.len();
        let mut normal = Normal { cost: 0.0, gradient: vec![0.0; order], curvature: Array2::zeros((order, order)) };
        for sums in self.lines(|line, scratch| self.line_sums(wake, scale, line, scratch)) {
            normal.cost += sums.cost;
            normal.gradient.iter_mut().zip(sums.gradient).for_each(|(n, s)| *n += s);
            add_triangle(&mut normal.curvature, &sums.weighted);
        }
        for (away, slope, weight) in self.known(wake) {
            normal.cost += 0.5 * weight * away * away;
            normal.gradient.iter_mut().zip(&slope).for_each(|(n, s)| *n += weight * away * s);
            add_square(&mut normal.curvature, &slope, weight);
        }
        Some(normal)
    }

    /// Terms of what is known before: distance in deviations, its slopes, how often it counts.
    fn known(&self, wake: &Wake) -> Vec<(f64, Vec<f64>, f64)> {
        let Some((prior, weight)) = self.prior else { return Vec::new() };
        let at = match self.expected {
            Expected::Means(_) => wake,
            Expected::Shown(tangent) => &tangent.at,
        };
        let (from, to) = (at.to_array(), wake.to_array());
        let term = |(away, slope): (f64, Vec<f64>)| {
            let moved: f64 = self.groups.iter().zip(&slope).map(|(group, s)| s * (to[group[0]] - from[group[0]])).sum();
            (away + moved, slope, weight)
        };
        prior.terms(at, self.groups).into_iter().map(term).collect()
    }

    /// Number of velocities that count as one.
    pub(crate) fn alike(&self, wake: &Wake, scale: f64, correlated: usize) -> f64 {
        alike(&self.lines(|line, scratch| self.line_cells(wake, scale, line, scratch)), correlated)
    }

    /// The sandwich, with residuals of lines up to `correlated` apart taken together, and the number of velocities that count
    /// as one.
    pub(crate) fn covariance(&self, wake: &Wake, scale: f64, correlated: usize) -> Result<(Array2<f64>, f64), Error> {
        let order = self.groups.len();
        let (mut bread, mut weighted) = (Array2::zeros((order, order)), Array2::zeros((order, order)));
        for line in self.lines(|line, scratch| self.line_sums(wake, scale, line, scratch)) {
            add_triangle(&mut bread, &line.curved);
            add_triangle(&mut weighted, &line.weighted);
        }
        let known = self.known(wake);
        for (_, slope, weight) in &known {
            add_square(&mut bread, slope, *weight);
            add_square(&mut weighted, slope, *weight);
        }
        // with many outliers the second derivatives need not be positive: their weights are, and are larger
        let bread = inverse("curvature of the fit", &bread).or_else(|_| inverse("curvature of the fit", &weighted))?;
        let cells = self.lines(|line, scratch| self.line_cells(wake, scale, line, scratch));
        let (mut filling, alike) = filling(&cells, &bread, correlated);
        for (_, slope, weight) in &known {
            add_square(&mut filling, slope, weight * weight);
        }
        Ok((bread.dot(&filling).dot(&bread), alike))
    }

    /// Residuals and slopes of a line.
    fn line_cells(&self, wake: &Wake, scale: f64, line: usize, scratch: &mut LineScratch) -> Vec<Option<Cell>> {
        let mut cells = vec![None; self.map.range_m.len()];
        self.each_gate((wake, line), true, scratch, |gate, velocity, slope| {
            let measured = self.map.velocity_m_s[[line, gate]];
            if measured.is_finite() {
                let unit = scale * self.deviation(line, gate);
                let residual = (measured - velocity) / unit;
                let slopes = slope.iter().map(|s| s / unit).collect();
                cells[gate] = Some(Cell { residual: self.loss.at(residual).1 * residual, slopes });
            }
        });
        cells
    }

    /// ln p of the residuals but for a constant, as if all were independent: losses and logarithms of the deviations; with what is
    /// known of cores as often as it counts.
    pub(crate) fn log_likelihood(&self, wake: &Wake, scale: f64) -> f64 {
        let lines = self.lines(|line, scratch| {
            let mut sum = 0.0;
            self.each_gate((wake, line), false, scratch, |gate, velocity, _| {
                let (measured, unit) = (self.map.velocity_m_s[[line, gate]], scale * self.deviation(line, gate));
                if measured.is_finite() {
                    sum -= self.loss.at((measured - velocity) / unit).0 + unit.ln();
                }
            });
            sum
        });
        let known: f64 = self.known(wake).iter().map(|(away, _, weight)| 0.5 * weight * away * away).sum();
        lines.iter().sum::<f64>() - known
    }

    /// The best wind without vortices.
    pub(crate) fn calm(&self, wake: &Wake, scale: f64, stop: Stop) -> Option<Wake> {
        let mut calm = *wake;
        (calm.left.circulation_m2_s, calm.right.circulation_m2_s) = (0.0, 0.0);
        let groups: Vec<Vec<usize>> =
            self.groups.iter().filter(|group| group[0] >= Parameter::Wind as usize).cloned().collect();
        if groups.is_empty() {
            return Some(calm);
        }
        let wind = Problem { groups: &groups, prior: None, ..*self };
        let step = |wake: &Wake, step: &[f64]| moved(&groups, wake, step);
        descend(calm, stop, |wake| wind.normal(wake, scale, false), step).ok().map(|(calm, _, _)| calm)
    }
}

/// a += weight v v^T.
fn add_square(a: &mut Array2<f64>, v: &[f64], weight: f64) {
    a.indexed_iter_mut().for_each(|((i, j), a)| *a += weight * v[i] * v[j]);
}

/// a += the symmetric matrix whose lower triangle `rows` holds row by row.
fn add_triangle(a: &mut Array2<f64>, rows: &[f64]) {
    let places = (0..a.nrows()).flat_map(|i| (0..=i).map(move |j| (i, j)));
    for ((i, j), value) in places.zip(rows) {
        a[[i, j]] += value;
        if i != j {
            a[[j, i]] += value;
        }
    }
}
