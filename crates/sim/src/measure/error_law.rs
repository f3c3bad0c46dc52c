//! The law of the errors of a map, from few realisations: what a cell alone does not tell, its neighbours do.
//!
//! Neighbouring cells have nearly the same variance, so it is pooled over as many of them as have enough degrees of freedom
//! together; a cell has a bias of its own. Outliers, which may be rarer than the realisations of a cell, are counted over the whole map.
//! Check: errors of many realisations, given out a few at a time.

use crate::Error;
use crate::measure::ray_information::range_filter;
use crate::plan::Plan;
use ndarray::Array2;
use std::collections::BTreeMap;

/// Degrees of freedom of a pooled variance of Gaussian errors, for each unit of the variance of their squares.
const FREEDOM: f64 = 6.0;
/// Most of these units: beyond, more neighbours would be too unlike.
const MOST_UNITS: f64 = 4.0;
/// Degrees of freedom over which it is asked whether squares of errors scatter less than those of Gaussian ones.
const FREEDOM_OF_SCATTER: f64 = 120.0;
/// Part of the cells that share windows over which squares of errors are alike.
const ALIKE: f64 = 0.25;
/// Outliers are beyond so many medians of the errors about them: four standard deviations of Gaussian ones.
const OUTLIER: f64 = 6.0;

/// Neighbouring lines and gates of a plan's map that share windows.
///
/// # Errors
/// What the crates refuse; a checked scene gives none.
pub(crate) fn shared_cells(plan: &Plan) -> Result<[f64; 2], Error> {
    let scene = plan.scene();
    let g = &plan.geometry;
    let middle_m = g
        .gate_range_m
        .get(g.gate_range_m.len() / 2)
        .copied()
        .unwrap_or(1.0);
    // From one line to the next of the same sweep; lines of which each is alone share nothing.
    let schedule = &g.schedule;
    let next = |i: &usize| {
        schedule
            .lines
            .get(i + 1)
            .is_some_and(|next| next.group == schedule.lines[*i].group)
    };
    let apart = |i: usize| {
        let [a, b] = [i, i + 1].map(|line| schedule.middle(line).direction.0);
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
    };
    let mut steps: Vec<f64> = (0..schedule.lines.len()).filter(next).map(apart).collect();
    steps.sort_by(f64::total_cmp);
    let line_m = middle_m * steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY);
    let gate_m = scene.estimator.gate_step_samples as f64 * g.sample_spacing_m;
    let across_m = 2.0 * scene.estimator.largest_radius_m(middle_m);
    let lines = (across_m / line_m).floor() + 1.0;
    let gates = (range_filter(plan)?
        .full_width_half_maximum_m()
        .hypot(across_m)
        / gate_m)
        .max(1.0);
    Ok([
        lines.min(g.elevation_rad.len() as f64),
        gates.min(g.gate_range_m.len() as f64),
    ])
}

/// What one realisation shows, each \[line, gate\].
#[derive(Debug, Clone, PartialEq)]
pub struct ScanErrors {
    /// Error against the velocity weighted with the pulse, m/s.
    pub error_m_s: Array2<f64>,
    /// Whether the estimate was flagged.
    pub flagged: Array2<bool>,
    /// True velocities weighted with the pulse, and with pulse and window, m/s, of a realisation
    /// that has turbulence of its own.
    pub own_truth_m_s: Option<[Array2<f64>; 2]>,
}

/// What the realisations of a map say of the law of its errors, each array \[line, gate\].
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorLaw {
    /// Neighbouring lines and gates that share windows.
    pub(crate) shared: [f64; 2],
    /// Half the width of the band of velocities, m/s.
    pub(crate) half_band_m_s: f64,
    /// Realisations with an estimate.
    count: Array2<f64>,
    /// Mean error of those that are no outliers, m/s.
    bias_m_s: Array2<f64>,
    /// Their variance, pooled, (m/s)^2.
    variance: Array2<f64>,
    /// Variance of the squares of their deviations over the square of the variance: 2 for Gaussian ones.
    of_squares: f64,
    /// Variance of the squares of the errors as the realisations show it.
    scatter: Array2<f64>,
    /// Outliers found.
    outliers: Array2<f64>,
    /// Their part of all estimates of the map.
    outlier_part: f64,
    /// Mean square and fourth power of outliers, as expected in a cell.
    powers: [Array2<f64>; 2],
}

impl ErrorLaw {
    /// Of the realisations of a map; `shared` is the number of lines and gates over which neighbours
    /// share windows, `half_band_m_s` the half width of the band of estimates. None of fewer than
    /// two realisations.
    #[must_use]
    pub fn new(scans: &[ScanErrors], shared: [f64; 2], half_band_m_s: f64) -> Option<Self> {
        let shape = scans.get(1)?.error_m_s.dim();
        let n = scans.len() as f64;
        let freedom = n - 1.0;
        let near = reach(shared, 2.0 * FREEDOM / freedom);
        let median_m_s = medians(scans, near);
        let finite = |cell| {
            scans
                .iter()
                .map(move |scan| scan.error_m_s[cell])
                .filter(|error| error.is_finite())
        };
        let is_far = |cell, error: &f64| error.abs() > OUTLIER * median_m_s[cell];
        let count = Array2::from_shape_fn(shape, |cell| finite(cell).count() as f64);
        let outliers = Array2::from_shape_fn(shape, |cell| {
            finite(cell).filter(|e| is_far(cell, e)).count() as f64
        });
        // Guesses over the band are alike in all cells, long tails go with what is usual about them: the lesser.
        let powers = [2, 4].map(|power| {
            let far = median_m_s.indexed_iter().flat_map(|(cell, m)| {
                finite(cell)
                    .filter(move |e| is_far(cell, e))
                    .map(move |e| [e.powi(power), (e / m).powi(power)])
            });
            let sum = far.fold([0.0; 2], |sum, far| [sum[0] + far[0], sum[1] + far[1]]);
            let mean = sum.map(|sum| sum / outliers.sum().max(1.0));
            median_m_s.mapv(|m| {
                mean[0].min(if m > 0.0 {
                    mean[1] * m.powi(power)
                } else {
                    f64::INFINITY
                })
            })
        });
        let near_count = &count - &outliers;
        let central = |power: i32, about: Option<&Array2<f64>>| {
            Array2::from_shape_fn(shape, |cell| {
                let middle = about.map_or(0.0, |about| about[cell]);
                finite(cell)
                    .filter(|e| !is_far(cell, e))
                    .map(|e| (e - middle).powi(power))
                    .sum::<f64>()
            })
        };
        let bias_m_s = central(1, None) / near_count.mapv(|n| n.max(1.0));
        let squares = central(2, Some(&bias_m_s));
        let fourths = central(4, Some(&bias_m_s));
        let freedoms = near_count.mapv(|n| (n - 1.0).max(0.0));
        let pooled = |reach| sums_about(&squares, reach) / sums_about(&freedoms, reach);
        // The excess of deviations from a mean of few is a part of that of the errors.
        let variance = pooled(near);
        let fourth =
            sums_about(&fourths, near) / sums_about(&near_count, near) * (n / freedom).powi(2);
        let ratios: Vec<f64> = fourth
            .iter()
            .zip(&variance)
            .map(|(f, v)| f / (v * v))
            .filter(|ratio| ratio.is_finite())
            .collect();
        let cells = near
            .iter()
            .map(|reach| (2 * reach + 1) as f64)
            .product::<f64>()
            / (ALIKE * shared[0] * shared[1]);
        let seen = freedom * cells.max(1.0);
        let fourth =
            ratios.iter().sum::<f64>() / (ratios.len() as f64).max(1.0) * (seen + 2.0) / seen;
        let of_squares = 2.0 + (fourth - 3.0).max(0.0) * n * n * freedom / (freedom.powi(3) + 1.0);
        let variance = pooled(reach(
            shared,
            FREEDOM * of_squares.min(MOST_UNITS) / freedom,
        ));
        let scatter = Array2::from_shape_fn(shape, |cell| {
            let mean = finite(cell).map(|e| e * e).sum::<f64>() / count[cell].max(1.0);
            finite(cell).map(|e| (e * e - mean).powi(2)).sum::<f64>() / (count[cell] - 1.0).max(1.0)
        });
        let outlier_part = outliers.sum() / count.sum().max(1.0);
        Some(Self {
            shared,
            half_band_m_s,
            count,
            bias_m_s,
            variance,
            of_squares,
            scatter,
            outliers,
            outlier_part,
            powers,
        })
    }

    /// Expected part of outliers among `count` estimates that have `found`: those of the map count as one more.
    fn expected(&self, found: f64, count: f64) -> f64 {
        if self.outlier_part > 0.0 {
            (found + 1.0) / (count + 1.0 / self.outlier_part)
        } else {
            0.0
        }
    }

    /// Standard error of the root mean square of each cell, m/s; NaN for fewer than two estimates.
    ///
    /// Squares of errors that scatter less than those of Gaussian ones over many neighbours, such as of guesses at either edge of the band,
    /// count with what they scatter.
    #[must_use]
    pub fn rms_standard_errors(&self) -> Array2<f64> {
        let outliers = |cell| {
            let part = self.expected(self.outliers[cell], self.count[cell]);
            self.powers.each_ref().map(|power| part * power[cell])
        };
        // What the scatter adds to it is taken off: it may be below zero.
        let squared_bias =
            |cell| self.bias_m_s[cell].powi(2) - self.variance[cell] / self.count[cell];
        let of_squares = |cell, squared_bias: f64| {
            let (variance, [far, _]) = (self.variance[cell], outliers(cell));
            4.0 * squared_bias * (variance + far)
                + self.of_squares * variance.powi(2)
                + 2.0 * variance * far
        };
        let freedom = self.count.mapv(|n| (n - 1.0).max(0.0));
        let wide = reach(
            self.shared,
            FREEDOM_OF_SCATTER / freedom.mean().unwrap_or(1.0).max(1.0),
        );
        let about = |of: &dyn Fn((usize, usize)) -> f64| {
            let one = |cell| {
                if self.variance[cell] > 0.0 {
                    freedom[cell] * of(cell)
                } else {
                    0.0
                }
            };
            sums_about(&Array2::from_shape_fn(freedom.dim(), one), wide)
        };
        let seen = about(&|cell| self.scatter[cell] / self.variance[cell].powi(2));
        let law = about(&|cell| of_squares(cell, squared_bias(cell)) / self.variance[cell].powi(2));
        let freedoms = about(&|_| 1.0);
        Array2::from_shape_fn(self.count.dim(), |cell| {
            let n = self.count[cell];
            if n < 2.0 {
                return f64::NAN;
            }
            // The variance of a chi-square is known to the root of 14 over its degrees of freedom; as much more is borne.
            let independent = (freedoms[cell] / (ALIKE * self.shared[0] * self.shared[1])).max(1.0);
            let less = (seen[cell] / law[cell] * (1.0 + (14.0 / independent).sqrt())).min(1.0);
            let [far, of_far] = outliers(cell);
            let squared_bias = squared_bias(cell).max(0.0);
            let of_mean = less * of_squares(cell, squared_bias) / n;
            error_of_root(
                squared_bias + self.variance[cell],
                of_mean,
                [far, of_far / n],
            )
        })
    }

    /// What the outliers of the map that these cells have not shown yet would add to the mean square of their errors, and to the variance of
    /// that mean; the first over the number of estimates is what they add to the variance of the mean error.
    pub(crate) fn unseen(&self, cells: &[(usize, usize)]) -> ([f64; 2], f64) {
        let sum = |of: &Array2<f64>| cells.iter().map(|cell| of[*cell]).sum::<f64>();
        let count = sum(&self.count);
        let found = sum(&self.outliers);
        let part = (self.expected(found, count) - found / count).max(0.0);
        let [square, fourth] = self
            .powers
            .each_ref()
            .map(|power| part * sum(power) / cells.len() as f64);
        ([square, fourth / count], square / count)
    }
}

/// Standard error of the root of a mean square that has a variance, and of what rare outliers add to both.
///
/// E (rms - t)^2 = 2 t (t - E rms) for the true root t. E rms is that of a gamma law of this mean and variance, to 1 %: exact for one
/// or many Gaussian errors. Outliers take at most t less the root without them from it.
pub(crate) fn error_of_root(square: f64, variance: f64, [rare_square, of_rare]: [f64; 2]) -> f64 {
    let sum = square + rare_square;
    if sum <= 0.0 {
        return 0.0;
    }
    let excess = variance / (4.0 * sum * sum);
    let stretch = (1.0 + excess).sqrt();
    let rare = (of_rare / (4.0 * sum)).min(2.0 * sum.sqrt() * (sum.sqrt() - square.sqrt()));
    (2.0 * sum * excess / (stretch * (1.0 + stretch)) + rare).sqrt()
}

/// How many lines and gates to each side are pooled, where each cell has one degree of freedom in so many as are wanted.
fn reach(shared: [f64; 2], wanted: f64) -> [usize; 2] {
    shared.map(|cells| (0.5 * (ALIKE * wanted).sqrt() * cells + 0.25).floor() as usize)
}

/// Sums over the neighbours of each cell, itself included.
fn sums_about(values: &Array2<f64>, reach: [usize; 2]) -> Array2<f64> {
    let (lines, gates) = values.dim();
    let mut table = Array2::<f64>::zeros((lines + 1, gates + 1));
    for ((i, j), value) in values.indexed_iter() {
        table[(i + 1, j + 1)] = value + table[(i, j + 1)] + table[(i + 1, j)] - table[(i, j)];
    }
    Array2::from_shape_fn((lines, gates), |(i, j)| {
        let first = i.saturating_sub(reach[0]);
        let end = (i + reach[0] + 1).min(lines);
        let left = j.saturating_sub(reach[1]);
        let right = (j + reach[1] + 1).min(gates);
        let sum =
            table[(end, right)] - table[(first, right)] - table[(end, left)] + table[(first, left)];
        sum.max(0.0)
    })
}

/// Medians of the sizes of the errors in parts of the map that have at least as many cells as are near one; 0 where there is none.
fn medians(scans: &[ScanErrors], reach: [usize; 2]) -> Array2<f64> {
    let (lines, gates) = scans[0].error_m_s.dim();
    let place = |at: usize, of: usize, reach: usize| at * (of / (2 * reach + 1)).max(1) / of;
    let part = |(i, j)| (place(i, lines, reach[0]), place(j, gates, reach[1]));
    let mut parts: BTreeMap<(usize, usize), Vec<f64>> = BTreeMap::new();
    for scan in scans {
        for (cell, error) in scan
            .error_m_s
            .indexed_iter()
            .filter(|(_, error)| error.is_finite())
        {
            parts.entry(part(cell)).or_default().push(error.abs());
        }
    }
    let median = |mut sizes: Vec<f64>| {
        let middle = sizes.len() / 2;
        *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let medians: BTreeMap<_, f64> = parts
        .into_iter()
        .map(|(part, sizes)| (part, median(sizes)))
        .collect();
    Array2::from_shape_fn((lines, gates), |cell| {
        medians.get(&part(cell)).copied().unwrap_or(0.0)
    })
}
