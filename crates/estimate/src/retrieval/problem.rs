//! Cost of a wake given a scan: residuals over their deviations, whitened where they are correlated; its minimum from a start.
//!
//! Check: the reference maps; the spread of fits over many maps.

use ndarray::Array2;

use crate::linalg::dot;
use crate::parallel::map_indexed;
use crate::retrieval::expected::Expected;
use crate::retrieval::whitening::Whitening;
use crate::vortex_fit::damped_newton::{Normal, Stop, lowest};
use crate::vortex_fit::wake::free_parameters::{gathered, moved};
use crate::vortex_fit::wake::range_kernel::LineScratch;
use crate::vortex_fit::{CorePrior, Loss, Wake};

/// A velocity that is used: its line and gate, and its standard deviation \[m/s\].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell {
    pub(crate) line: usize,
    pub(crate) gate: usize,
    pub(crate) sigma_m_s: f64,
}

#[derive(Clone)]
pub(crate) struct Problem<'a> {
    pub(crate) expected: &'a Expected<'a>,
    /// Line by line.
    pub(crate) cells: Vec<Cell>,
    pub(crate) whitening: Option<Whitening>,
    pub(crate) loss: Loss,
    pub(crate) prior: Option<CorePrior>,
}

/// Residuals and, by free number, slopes of the expected velocities, both over their deviations and white.
pub(crate) struct Rows {
    pub(crate) residuals: Vec<f64>,
    pub(crate) slopes: Vec<Vec<f64>>,
}

impl Problem<'_> {
    /// Residuals and slopes by the groups of parameters, in the order of the cells.
    pub(crate) fn rows(&self, wake: &Wake, groups: &[Vec<usize>]) -> Rows {
        let motion = self.expected.motion(wake);
        let map = self.expected.map;
        let lines = map_indexed(map.elevation_rad.len(), LineScratch::default, |scratch, line| {
            let from = self.cells.partition_point(|cell| cell.line < line);
            let cells = &self.cells[from..self.cells.partition_point(|cell| cell.line <= line)];
            let mut numbers = Vec::with_capacity(cells.len() * (groups.len() + 1));
            if cells.is_empty() {
                return numbers;
            }
            let (mut next, mut slope) = (cells.iter().peekable(), vec![0.0; groups.len()]);
            let out = |gate: usize, velocity: f64, all: &[f64; crate::vortex_fit::PARAMETERS]| {
                if let Some(cell) = next.next_if(|cell| cell.gate == gate) {
                    let away = map.velocity_m_s[[line, gate]] - velocity;
                    let away = map.fold_m_s.map_or(away, |fold| away - fold * (away / fold).round());
                    let sigma_m_s = if self.whitening.is_some() { 1.0 } else { cell.sigma_m_s };
                    gathered(groups, all, &mut slope);
                    numbers.push(away / sigma_m_s);
                    numbers.extend(slope.iter().map(|s| s / sigma_m_s));
                }
            };
            self.expected.line((wake, motion.as_ref(), line), !groups.is_empty(), scratch, out);
            numbers
        });
        let numbers = lines.concat();
        let column = |i: usize| numbers.iter().skip(i).step_by(groups.len() + 1).copied().collect::<Vec<f64>>();
        let mut columns = map_indexed(
            groups.len() + 1,
            || (),
            |(), i| {
                let mut column = column(i);
                if let Some(whitening) = &self.whitening {
                    whitening.whiten(&mut column);
                }
                column
            },
        )
        .into_iter();
        Rows { residuals: columns.next().unwrap_or_default(), slopes: columns.collect() }
    }

    /// Cost, gradient and curvature; nothing for a wake that is impossible or, with images, below the ground.
    fn normal(&self, wake: &Wake, groups: &[Vec<usize>]) -> Option<Normal> {
        wake.validate().ok()?;
        if self.expected.model.images && (wake.left.height_m <= 0.0 || wake.right.height_m <= 0.0) {
            return None;
        }
        let rows = self.rows(wake, groups);
        let costs = rows.residuals.iter().map(|r| self.loss.at(*r));
        let (costs, weights): (Vec<f64>, Vec<f64>) = costs.map(|(cost, weight, _)| (cost, weight)).unzip();
        let gradient = rows.slopes.iter().map(|slope| -weighted(&weights, slope, &rows.residuals)).collect();
        let mut normal = Normal { cost: costs.iter().sum(), gradient, curvature: products(&weights, &rows.slopes) };
        for (away, slope) in self.known(wake, groups) {
            normal.cost += 0.5 * away * away;
            normal.gradient.iter_mut().zip(&slope).for_each(|(g, s)| *g += away * s);
            normal.curvature.indexed_iter_mut().for_each(|((i, j), c)| *c += slope[i] * slope[j]);
        }
        Some(normal)
    }

    /// What is known of the cores: distances in deviations and their slopes.
    pub(crate) fn known(&self, wake: &Wake, groups: &[Vec<usize>]) -> Vec<(f64, Vec<f64>)> {
        self.prior.map_or_else(Vec::new, |prior| prior.terms(wake, groups))
    }

    /// The minimum from a start on, its chi-square, twice the cost, and the step that is left in deviations; nothing from an impossible start.
    pub(crate) fn minimum(&self, start: &Wake, groups: &[Vec<usize>], stop: Stop) -> Option<(Wake, f64, f64)> {
        let step = |wake: &Wake, step: &[f64]| moved(groups, wake, step);
        let (wake, end, _, left) = lowest(*start, stop, |wake| self.normal(wake, groups), step)?;
        Some((wake, 2.0 * end.cost, left))
    }
}

/// Sum of w a b.
fn weighted(weights: &[f64], a: &[f64], b: &[f64]) -> f64 {
    let scaled: Vec<f64> = weights.iter().zip(a).map(|(w, a)| w * a).collect();
    dot(&scaled, b)
}

/// Weighted products of the slopes.
pub(crate) fn products(weights: &[f64], slopes: &[Vec<f64>]) -> Array2<f64> {
    let mut out = Array2::zeros((slopes.len(), slopes.len()));
    for (i, a) in slopes.iter().enumerate() {
        let scaled: Vec<f64> = weights.iter().zip(a).map(|(w, a)| w * a).collect();
        for (j, b) in slopes.iter().enumerate().take(i + 1) {
            let product = dot(&scaled, b);
            (out[[i, j]], out[[j, i]]) = (product, product);
        }
    }
    out
}
