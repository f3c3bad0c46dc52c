//! Averages of the errors of a map over some of its cells, with their standard errors.
//!
//! A standard error comes from the scatter over the realisations of the mean itself: the
//! covariances of cells that share windows are summed, those of others are nothing but noise. So
//! outliers weigh as they do in the mean. Outliers that did not occur in these cells, but may, are
//! added: as many as the whole map or the flagged estimates lead to expect. Check: the scatter of
//! the averages over independent maps.

use crate::measure::error_law::{ErrorLaw, ScanErrors, error_of_root};
use crate::measure::map::VelocityEstimates;
use ndarray::{Array2, Axis};
use std::collections::BTreeMap;

/// Reach of the weights of covariances over that of shared windows: they are near 1 where covariances are large.
const REACH: f64 = 1.5;
/// Least degrees of freedom of a variance that a factor makes up for; with fewer one standard error would hold too much.
const LEAST_FREEDOM: f64 = 4.0;

/// Outliers, uniform over the band, per flagged estimate: most flagged estimates are near the
/// truth. Measured by the variance of the mean square error: 0.017 to 0.06 at -3 and 4 dB, for real
/// and complex samples and regions of 1 to 88 cells.
const OUTLIERS_PER_FLAG: f64 = 0.03;
/// Most groups of outliers that are added. For a Poisson number k, two roots of k + 4/3 cover the
/// mean nine times in ten, also where k is 0.
const MOST_ADDED: f64 = 4.0 / 3.0;

/// Errors over a set of cells: the mean bias, and root means of squares; NaN for no cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellAverage {
    /// Mean error against the velocity weighted with the pulse, m/s.
    pub bias_m_s: f64,
    /// Standard error of `bias_m_s`, m/s.
    pub bias_standard_error_m_s: f64,
    /// Standard deviation of one realisation, m/s.
    pub std_m_s: f64,
    /// Standard error of `std_m_s`, m/s.
    pub std_standard_error_m_s: f64,
    /// Root mean square error, m/s.
    pub rms_m_s: f64,
    /// Standard error of `rms_m_s`, m/s.
    pub standard_error_m_s: f64,
}

impl CellAverage {
    /// Over the cells (line, gate) of a map that have an estimate. Standard errors are NaN for one realisation.
    #[must_use]
    pub fn over(map: &VelocityEstimates, cells: &[(usize, usize)]) -> Self {
        let [known, scattered] = with_estimates(map, cells);
        let means = Self::without_errors(map, cells);
        let Some(law) = map.law.as_ref().filter(|_| !known.is_empty()) else {
            return means;
        };
        let error = |scan: &ScanErrors, cell| scan.error_m_s[cell];
        let squared = |scan: &ScanErrors, cell| scan.error_m_s[cell].powi(2);
        let (of_map, of_bias) = law.unseen(&known);
        let of_flags = unseen_by_flags(map, law, &known);
        let unseen = if of_flags[1] > of_map[1] {
            of_flags
        } else {
            of_map
        };
        let [variance, square] = [
            mean(&scattered, &map.std_m_s, 2),
            mean(&known, &map.rms_m_s, 2),
        ];
        let of_variance = variance_of_mean(map, law, &scattered, error, of_variance);
        let of_square = variance_of_mean(map, law, &known, squared, about_mean);
        Self {
            bias_standard_error_m_s: (variance_of_mean(map, law, &known, error, about_mean)
                + of_bias)
                .sqrt(),
            std_standard_error_m_s: error_of_root(variance, of_variance, unseen),
            standard_error_m_s: error_of_root(square, of_square, unseen),
            ..means
        }
    }

    /// The same with NaN for the standard errors, which take most of the time.
    #[must_use]
    pub fn without_errors(map: &VelocityEstimates, cells: &[(usize, usize)]) -> Self {
        let [known, scattered] = with_estimates(map, cells);
        Self {
            bias_m_s: mean(&known, &map.bias_m_s, 1),
            bias_standard_error_m_s: f64::NAN,
            std_m_s: mean(&scattered, &map.std_m_s, 2).sqrt(),
            std_standard_error_m_s: f64::NAN,
            rms_m_s: mean(&known, &map.rms_m_s, 2).sqrt(),
            standard_error_m_s: f64::NAN,
        }
    }
}

/// The cells that have an estimate, and those of them that have several: a cell with one has an error, but no scatter.
fn with_estimates(map: &VelocityEstimates, cells: &[(usize, usize)]) -> [Vec<(usize, usize)>; 2] {
    let are_finite = |field: &Array2<f64>, cells: &[(usize, usize)]| {
        cells
            .iter()
            .copied()
            .filter(|cell| field.get(*cell).is_some_and(|value| value.is_finite()))
            .collect::<Vec<_>>()
    };
    let known = are_finite(&map.rms_m_s, cells);
    let scattered = are_finite(&map.std_m_s, &known);
    [known, scattered]
}

/// Mean of a power of a field over some cells.
fn mean(cells: &[(usize, usize)], field: &Array2<f64>, power: i32) -> f64 {
    cells.iter().map(|c| field[*c].powi(power)).sum::<f64>() / cells.len() as f64
}

/// Part of the estimates of all cells and scans that is flagged, and its standard error: not 0 where none or all are.
#[must_use]
pub fn flagged_fraction(map: &VelocityEstimates) -> [f64; 2] {
    let cells: Vec<(usize, usize)> = map.flagged.indexed_iter().map(|(cell, _)| cell).collect();
    let fraction = map.flagged.sum() / cells.len() as f64;
    let scattered = map
        .law
        .as_ref()
        .map(|law| variance_of_mean(map, law, &cells, flag, about_mean).sqrt());
    // Cells that share windows may be flagged together; where none is, nothing tells how many: between one and all of them.
    let shared = map
        .law
        .as_ref()
        .filter(|_| fraction == 0.0)
        .map_or(1.0, |law| law.shared.iter().product());
    let together = f64::sqrt(shared).max(1.0);
    let least = error_of_fraction(fraction, (cells.len() * map.scans.len()) as f64 / together);
    [
        fraction,
        scattered.map_or(f64::NAN, |error| error.max(least)),
    ]
}

/// Standard error of a fraction of so many: not 0 where none was found.
pub(crate) fn error_of_fraction(fraction: f64, of: f64) -> f64 {
    let found = fraction * of;
    ((found + 1.0) * (of - found + 1.0) / ((of + 2.0).powi(2) * (of + 3.0))).sqrt()
}

/// Deviations from the mean.
fn about_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

/// Deviations whose mean square over n is the variance of the sample variance: those of the pseudo-values of the jackknife. Of two values, which
/// have the same square, signed squares, between what Gaussian ones and outliers have; their covariances are between those of
/// squares and of the values themselves.
fn of_variance(errors: &[f64]) -> Vec<f64> {
    let n = errors.len() as f64;
    let apart = about_mean(errors);
    if errors.len() == 2 {
        return apart
            .iter()
            .map(|x| 2.0 * (5.0_f64 / 6.0).sqrt() * x * x.abs())
            .collect();
    }
    about_mean(
        &apart
            .iter()
            .map(|x| n / (n - 2.0) * x * x)
            .collect::<Vec<_>>(),
    )
}

/// What outliers that did not occur may add to the mean square error of some cells, and to the
/// variance of that mean.
///
/// An outlier is a guess at any velocity of the band, shared by the cells that are flagged
/// together. Outliers are rarer than flagged estimates and may be missing by chance; the number of
/// flagged estimates tells how many were to be expected. Cells that are flagged in every
/// realisation show their outliers and do not count.
fn unseen_by_flags(map: &VelocityEstimates, law: &ErrorLaw, cells: &[(usize, usize)]) -> [f64; 2] {
    let scans = map.scans.len() as f64;
    let estimates = cells.len() as f64 * scans;
    let of_flags = scatter_of_mean(map, law, cells, flag, about_mean);
    let flagged = of_flags.apart * estimates * estimates * scans / (scans - 1.0);
    let together = (of_flags.together / of_flags.apart).max(1.0);
    let groups = (OUTLIERS_PER_FLAG * flagged / together).min(MOST_ADDED);
    // Mean square and fourth power of a number that is uniform over the band.
    let square = law.half_band_m_s.powi(2) / 3.0;
    let fourth = law.half_band_m_s.powi(4) / 5.0;
    [
        groups * together / estimates * square,
        groups * (together / estimates).powi(2) * fourth,
    ]
}

/// 1 where the estimate of a cell is flagged, else 0.
fn flag(scan: &ScanErrors, cell: (usize, usize)) -> f64 {
    f64::from(u8::from(scan.flagged[cell]))
}

/// Sums of products of deviations over the realisations, of a mean over cells.
struct MeanScatter {
    /// Squares alone: the variance if no cell shared anything with another.
    apart: f64,
    /// Those of cells that share windows, too.
    together: f64,
    /// Degrees of freedom, by Satterthwaite's rule.
    freedom: f64,
}

/// Variance of the mean over cells and realisations of a value. With few degrees of freedom it is
/// wider: with Student's factor for two standard errors.
fn variance_of_mean(
    map: &VelocityEstimates,
    law: &ErrorLaw,
    cells: &[(usize, usize)],
    value: impl Fn(&ScanErrors, (usize, usize)) -> f64,
    deviations: fn(&[f64]) -> Vec<f64>,
) -> f64 {
    let scatter = scatter_of_mean(map, law, cells, value, deviations);
    let n = map.scans.len() as f64;
    let factor = 1.0 + 1.2 / (scatter.freedom.max(LEAST_FREEDOM) - 1.0);
    scatter.together.max(scatter.apart) * n / (n - 1.0) * factor * factor
}

/// Scatter of the mean over cells and realisations of a value, by deviations over the realisations
/// of a cell; where a cell has one value, by that from the mean of all cells.
fn scatter_of_mean(
    map: &VelocityEstimates,
    law: &ErrorLaw,
    cells: &[(usize, usize)],
    value: impl Fn(&ScanErrors, (usize, usize)) -> f64,
    deviations: fn(&[f64]) -> Vec<f64>,
) -> MeanScatter {
    let mut of_scans = vec![Array2::<f64>::zeros(map.flagged.dim()); map.scans.len()];
    let value = &value;
    let values_of = |cell| {
        map.scans
            .iter()
            .map(move |scan| value(scan, cell))
            .enumerate()
            .filter(|(_, v)| v.is_finite())
    };
    let all: Vec<f64> = cells
        .iter()
        .flat_map(|cell| values_of(*cell))
        .map(|(_, value)| value)
        .collect();
    let middle = all.iter().sum::<f64>() / all.len() as f64;
    for &cell in cells {
        let (scans, values): (Vec<usize>, Vec<f64>) = values_of(cell).unzip();
        let share = 1.0 / (values.len() * cells.len()) as f64;
        let apart = if values.len() == 1 {
            vec![values[0] - middle]
        } else {
            deviations(&values)
        };
        for (scan, deviation) in scans.into_iter().zip(apart) {
            of_scans[scan][cell] = share * deviation;
        }
    }
    let mut apart = 0.0;
    let mut blocks = BTreeMap::<(usize, usize), f64>::new();
    let block = |at: usize, axis: usize| (at as f64 / law.shared[axis]) as usize;
    for scan in &of_scans {
        let near = weighted_sums(scan, law.shared);
        for &(line, gate) in cells {
            let value = scan[(line, gate)];
            apart += value * value;
            *blocks.entry((block(line, 0), block(gate, 1))).or_default() +=
                value * near[(line, gate)];
        }
    }
    let n = map.scans.len() as f64;
    let together = blocks.values().sum::<f64>();
    let squares = blocks.values().map(|v| v * v).sum::<f64>();
    MeanScatter {
        apart,
        together,
        freedom: (n + 1.0) * together * together / squares - 2.0,
    }
}

/// Sums over the neighbours of each cell that share windows, with weights that are flat where covariances are large.
fn weighted_sums(values: &Array2<f64>, shared: [f64; 2]) -> Array2<f64> {
    let along = |values: Array2<f64>, axis: usize| {
        let mut sums = Array2::zeros(values.dim());
        let reach = REACH * shared[axis];
        let weight = |away: usize| (1.0 - (away as f64 / reach).powi(4)).max(0.0);
        let weights: Vec<f64> = (0..values.len_of(Axis(axis))).map(weight).collect();
        for (mut to, from) in sums
            .lanes_mut(Axis(axis))
            .into_iter()
            .zip(values.lanes(Axis(axis)))
        {
            for (at, sum) in to.indexed_iter_mut() {
                let near =
                    at.saturating_sub(reach as usize)..(at + reach as usize + 1).min(from.len());
                *sum = near
                    .map(|other| weights[at.abs_diff(other)] * from[other])
                    .sum::<f64>();
            }
        }
        sums
    };
    along(along(values.clone(), 0), 1)
}
