//! What a fit to a map minimises, its minimum from a start on, and what is known of its parameters there.
//!
//! ```text
//! cost = sum over cells of rho(r_i) + counted / 2 sum over what is known before of distances in deviations squared
//! ```
//!
//! r = L^-1 (measured - expected) with L the deviations of the velocities or, where they are correlated, the factor of their covariance, and
//! rho the loss. The covariance of the minimum is the sandwich A^-1 B A^-1 (Huber 1967), A the curvature of the cost and B the covariance of its
//! gradient. Check: the reference maps; the spread of fits over many maps.

use ndarray::{Array2, Axis};

use crate::error::Error;
use crate::linalg::dot;
use crate::linalg::positive_definite::{inverse, singular, solve};
use crate::parallel::map_each;
use crate::retrieval::Whitening;
use crate::vortex_fit::levenberg_marquardt::{Minimum, Normal, StoppingRule, levenberg_marquardt};
use crate::vortex_fit::map_fit::cells::{Cell, Rows, products, scaled};
use crate::vortex_fit::map_fit::data::robust_scale;
use crate::vortex_fit::map_fit::prediction::Prediction;
use crate::vortex_fit::map_fit::residual_covariance::{decaying, of_neighbours};
use crate::vortex_fit::wake::core_prior::secondary_terms;
use crate::vortex_fit::wake::free_parameters::{spread, stepped};
use crate::vortex_fit::wake::log_wind_prior::log_wind_term;
use crate::vortex_fit::{CorePrior, Loss, PARAMETERS, PairPrior, Parameter, Wake};

/// Expected velocities, those that were measured, and what distances between them cost.
#[derive(Clone)]
pub(crate) struct LeastSquares<'a> {
    pub(crate) prediction: &'a dyn Prediction,
    /// Velocities repeat after this width \[m/s\].
    pub(crate) fold_m_s: Option<f64>,
    /// Line by line.
    pub(crate) cells: Vec<Cell>,
    pub(crate) whitening: Option<&'a Whitening>,
    pub(crate) loss: Loss,
    pub(crate) prior: Option<CorePrior>,
    pub(crate) pair_prior: Option<PairPrior>,
    /// Standard deviation of the logarithmic part of the wind before a fit \[m/s\].
    pub(crate) log_wind_std_m_s: f64,
    /// Velocities that count as one: as the losses of all of them are added up, so many times what is known before must count.
    pub(crate) counted: f64,
}

/// Where the covariance of the gradient comes from.
#[derive(Clone, Copy)]
pub(crate) enum Scores<'c> {
    /// From the stated deviations, for normal residuals.
    Stated,
    /// From the correlation of the residuals with those of neighbours, over at most so many lines: right where windows and regions are shared, as
    /// in the maps of our estimators.
    OfNeighbours { lines: usize },
    /// From white noise and a part that decays with the distance, fitted to residuals over blocks of so many lines and gates: right where turbulence
    /// is what they have in common.
    Decaying { blocks: (usize, usize) },
    /// From a covariance of the velocities of two cells, by their numbers, over their deviations.
    Correlated(&'c (dyn Fn(usize, usize) -> f64 + Sync)),
}

impl LeastSquares<'_> {
    /// Residuals and slopes by the groups of parameters, in the order of the cells.
    pub(crate) fn rows(&self, p: &[f64], groups: &[Vec<usize>]) -> Rows {
        let predicted = self.prediction.predict(p, groups);
        let columns = map_each(predicted.slopes.len() + 1, |column| {
            let mut numbers: Vec<f64> = match column.checked_sub(1) {
                Some(slope) => self.slopes_at_cells(&predicted.slopes[slope]),
                None => self.differences_from(&predicted.velocity_m_s),
            };
            if let Some(whitening) = &self.whitening {
                whitening.whiten(&mut numbers);
            }
            numbers
        });
        let mut columns = columns.into_iter();
        Rows {
            residuals: columns.next().unwrap_or_default(),
            slopes: columns.collect(),
        }
    }

    /// Slopes at the cells, over the deviations unless they are made white afterwards.
    fn slopes_at_cells(&self, slopes: &Array2<f64>) -> Vec<f64> {
        self.cells
            .iter()
            .map(|cell| slopes[[cell.line, cell.gate]] / self.divisor(cell))
            .collect()
    }

    /// Measured less predicted velocities, modulo the width after which they repeat, over the deviations unless they are made white
    /// afterwards.
    fn differences_from(&self, predicted_m_s: &Array2<f64>) -> Vec<f64> {
        let mut differences = Vec::with_capacity(self.cells.len());
        for cell in &self.cells {
            let mut difference = cell.velocity_m_s - predicted_m_s[[cell.line, cell.gate]];
            if let Some(fold) = self.fold_m_s {
                difference -= fold * (difference / fold).round();
            }
            differences.push(difference / self.divisor(cell));
        }
        differences
    }

    fn divisor(&self, cell: &Cell) -> f64 {
        if self.whitening.is_some() {
            1.0
        } else {
            cell.sigma_m_s
        }
    }

    /// Scale of the residuals over their deviations, from their median.
    pub(crate) fn residual_scale(&self, p: &[f64]) -> f64 {
        robust_scale(self.rows(p, &[]).residuals.into_iter())
    }

    /// The same with deviations so many times as large; a millionth of a metre per second at least, where a fit is exact.
    pub(crate) fn rescaled(mut self, scale: f64) -> Self {
        self.cells
            .iter_mut()
            .for_each(|cell| cell.sigma_m_s = (cell.sigma_m_s * scale).max(1e-6));
        self
    }

    /// What is known before: distances in deviations, and their slopes.
    fn known(&self, p: &[f64], groups: &[Vec<usize>]) -> Vec<(f64, Vec<f64>)> {
        let at = self.prediction.about(p);
        let mut known = self
            .prior
            .map_or_else(Vec::new, |prior| prior.terms(&Wake::from_list(at), groups));
        if let Some(prior) = self.pair_prior {
            known.extend(prior.terms(&Wake::from_list(at), groups));
        }
        let log_wind = (at[Parameter::LogWind as usize], self.log_wind_std_m_s);
        known.extend(log_wind_term(log_wind, groups));
        if at.len() > PARAMETERS {
            known.extend(secondary_terms(at, groups));
        }
        for (away, slope) in &mut known {
            *away += groups
                .iter()
                .zip(slope)
                .map(|(group, s)| *s * (p[group[0]] - at[group[0]]))
                .sum::<f64>();
        }
        known
    }

    /// Cost, gradient and curvature; nothing where the model does not exist.
    pub(crate) fn normal(&self, p: &[f64], groups: &[Vec<usize>]) -> Option<Normal> {
        if !self.prediction.allows(p) {
            return None;
        }
        let rows = self.rows(p, groups);
        let costs = rows.residuals.iter().map(|r| self.loss.at(*r));
        let (costs, weights): (Vec<f64>, Vec<f64>) =
            costs.map(|(cost, weight, _)| (cost, weight)).unzip();
        let gradient = rows
            .slopes
            .iter()
            .map(|slope| -dot(&scaled(&weights, slope), &rows.residuals))
            .collect();
        let mut normal = Normal {
            cost: costs.iter().sum(),
            gradient,
            curvature: products(&weights, &rows.slopes),
        };
        for (away, slope) in self.known(p, groups) {
            normal.cost += 0.5 * self.counted * away * away;
            normal
                .gradient
                .iter_mut()
                .zip(&slope)
                .for_each(|(g, s)| *g += self.counted * away * s);
            add_square(&mut normal.curvature, &slope, self.counted);
        }
        Some(normal)
    }

    /// The minimum from a start on; nothing from an impossible one.
    pub(crate) fn minimum(
        &self,
        start: &[f64],
        groups: &[Vec<usize>],
        stop: StoppingRule,
    ) -> Option<Minimum<Vec<f64>>> {
        levenberg_marquardt(
            start.to_vec(),
            stop,
            |p| self.normal(p, groups),
            |p, step| stepped(groups, p, step),
        )
    }

    /// The minimum of a model that is linear in the parameters, by least squares with weights taken anew: each round lowers the cost, whatever the
    /// loss.
    pub(crate) fn reweighted(
        &self,
        start: &[f64],
        groups: &[Vec<usize>],
        stop: StoppingRule,
    ) -> Result<Vec<f64>, Error> {
        let mut p = start.to_vec();
        for _ in 0..stop.iterations {
            let Some(Normal {
                gradient,
                curvature,
                ..
            }) = self.normal(&p, groups)
            else {
                break;
            };
            let down: Vec<f64> = gradient.iter().map(|g| -g).collect();
            let step = solve(&curvature, &down).ok_or(singular(CURVATURE, down.len()))?;
            p = stepped(groups, &p, &step);
            if dot(&step, &down) <= stop.sigmas * stop.sigmas {
                break;
            }
        }
        Ok(p)
    }

    /// ln p of the residuals but for a constant, as if all were independent: losses and logarithms of the deviations; with what is known before
    /// as often as it counts.
    pub(crate) fn log_likelihood(&self, p: &[f64], groups: &[Vec<usize>]) -> f64 {
        let losses: f64 = self
            .rows(p, &[])
            .residuals
            .iter()
            .map(|r| self.loss.at(*r).0)
            .sum();
        let deviations: f64 = self.cells.iter().map(|cell| cell.sigma_m_s.ln()).sum();
        let known: f64 = self
            .known(p, groups)
            .iter()
            .map(|(away, _)| 0.5 * self.counted * away * away)
            .sum();
        -losses - deviations - known
    }

    /// Velocities that count as one, from the correlation of the residuals over at most so many lines.
    pub(crate) fn alike(&self, p: &[f64], lines: usize) -> f64 {
        let mut residuals = self.rows(p, &[]).residuals;
        for residual in &mut residuals {
            *residual *= self.loss.at(*residual).1;
        }
        let weighted = Rows {
            residuals,
            slopes: Vec::new(),
        };
        of_neighbours(&self.cells, &weighted, &Array2::zeros((0, 0)), lines).1
    }

    /// What the map tells of the free numbers at a minimum.
    pub(crate) fn uncertainty<'g>(
        &self,
        p: &[f64],
        groups: &'g [Vec<usize>],
        from: Scores<'_>,
    ) -> Result<Uncertainty<'g>, Error> {
        let mut rows = self.rows(p, groups);
        let losses: Vec<_> = rows.residuals.iter().map(|r| self.loss.at(*r)).collect();
        let (weights, curved): (Vec<f64>, Vec<f64>) = losses
            .iter()
            .map(|(_, weight, second)| (*weight, *second))
            .unzip();
        let known = self.known(p, groups);
        let mut of_known = Array2::zeros((groups.len(), groups.len()));
        known
            .iter()
            .for_each(|(_, slope)| add_square(&mut of_known, slope, self.counted));
        if matches!(from, Scores::Stated) {
            let curvature = products(&vec![1.0; weights.len()], &rows.slopes) + &of_known;
            let scores = &curvature * inflation(self.loss);
            return Ok(Uncertainty {
                groups,
                curvature,
                scores,
                alike: 1.0,
            });
        }
        // with many outliers the second derivatives need not be positive: their weights are, and are larger
        let mut a = products(&curved, &rows.slopes) + &of_known;
        if inverse(CURVATURE, &a).is_err() {
            a = products(&weights, &rows.slopes) + &of_known;
        }
        rows.residuals = scaled(&weights, &rows.residuals);
        let (scores, alike) = match from {
            Scores::OfNeighbours { lines } => {
                of_neighbours(&self.cells, &rows, &inverse(CURVATURE, &a)?, lines)
            }
            Scores::Decaying { blocks } => decaying(&self.cells, &rows, blocks),
            Scores::Correlated(covariance) => (of_pairs(&curved, &rows.slopes, covariance), 1.0),
            Scores::Stated => (a.clone(), 1.0),
        };
        Ok(Uncertainty {
            groups,
            curvature: a,
            scores: scores + of_known * self.counted,
            alike,
        })
    }
}

/// Covariance of the gradient of a fit from those of pairs of cells: sum over i, k of c(i, k) g_i g_k^T, g the slopes times the weights.
fn of_pairs(
    weights: &[f64],
    slopes: &[Vec<f64>],
    covariance: &(dyn Fn(usize, usize) -> f64 + Sync),
) -> Array2<f64> {
    let mut columns = Vec::with_capacity(slopes.len());
    for slope in slopes {
        columns.push(scaled(weights, slope));
    }
    let sums = map_each(weights.len(), |i| {
        let mut sums = vec![0.0; columns.len()];
        for k in 0..i {
            let shared = covariance(i, k);
            for (sum, column) in sums.iter_mut().zip(&columns) {
                *sum += shared * column[k];
            }
        }
        let own = 0.5 * covariance(i, i);
        for (sum, column) in sums.iter_mut().zip(&columns) {
            *sum += own * column[i];
        }
        sums
    });
    let mut half = Array2::<f64>::zeros((columns.len(), columns.len()));
    for (i, sums) in sums.iter().enumerate() {
        for ((a, b), value) in half.indexed_iter_mut() {
            *value += columns[a][i] * sums[b];
        }
    }
    &half + &half.t()
}

pub(crate) const CURVATURE: &str = "curvature of the fit";

/// What a map tells of the free numbers of a fit: the curvature A of its cost and the covariance B of the gradient.
pub(crate) struct Uncertainty<'g> {
    pub(crate) groups: &'g [Vec<usize>],
    pub(crate) curvature: Array2<f64>,
    pub(crate) scores: Array2<f64>,
    /// Velocities that count as one.
    pub(crate) alike: f64,
}

impl Uncertainty<'_> {
    /// Covariance A^-1 B A^-1 of the ten parameters of the wake where only those of the wanted groups are free.
    pub(crate) fn covariance(
        &self,
        wanted: impl Fn(&[usize]) -> bool,
    ) -> Result<Array2<f64>, Error> {
        let free: Vec<usize> = (0..self.groups.len())
            .filter(|i| wanted(&self.groups[*i]))
            .collect();
        let bread = inverse(CURVATURE, &submatrix(&self.curvature, &free))?;
        let scores = submatrix(&self.scores, &free);
        let groups: Vec<Vec<usize>> = free.iter().map(|i| self.groups[*i].clone()).collect();
        Ok(spread(&groups, &bread.dot(&scores).dot(&bread)))
    }
}

/// Rows and columns of a matrix with those indices.
pub(crate) fn submatrix(matrix: &Array2<f64>, indices: &[usize]) -> Array2<f64> {
    matrix.select(Axis(0), indices).select(Axis(1), indices)
}

/// Variance of a fit with that loss over that of least squares, for normal residuals.
fn inflation(loss: Loss) -> f64 {
    let mut squares = 0.0;
    let mut curvature = 0.0;
    let mut sum = 0.0;
    for i in -800..=800 {
        let r = 0.01 * f64::from(i);
        let density = (-0.5 * r * r).exp();
        let (_, weight, second) = loss.at(r);
        sum += density;
        squares += density * (weight * r).powi(2);
        curvature += density * second;
    }
    squares * sum / (curvature * curvature)
}

/// a += weight v v^T.
fn add_square(a: &mut Array2<f64>, v: &[f64], weight: f64) {
    a.indexed_iter_mut()
        .for_each(|((i, j), a)| *a += weight * v[i] * v[j]);
}

#[cfg(test)]
mod tests {
    use super::of_pairs;

    /// Five cells whose covariance falls with their distance, two free numbers, against the sum over all pairs.
    #[test]
    fn gradients_have_the_covariance_of_all_pairs_of_cells() {
        let weights = [1.0, 0.5, 0.2, 1.0, 0.8];
        let slopes = [
            vec![1.0, -2.0, 0.5, 3.0, 0.0],
            vec![0.3, 0.1, -1.0, 2.0, 4.0],
        ];
        let covariance = |i: usize, k: usize| (-0.3 * i.abs_diff(k) as f64).exp() + 0.1;
        let found = of_pairs(&weights, &slopes, &covariance);
        for ((a, b), value) in found.indexed_iter() {
            let mut sum = 0.0;
            for i in 0..5 {
                for k in 0..5 {
                    let own = weights[i] * slopes[a][i];
                    sum += own * covariance(i, k) * weights[k] * slopes[b][k];
                }
            }
            assert!((value - sum).abs() < 1e-12, "{a} {b}: {value} {sum}");
        }
    }
}
