//! Averages of the errors of a map over some of its cells, with their standard errors.
//!
//! A standard error comes from the scatter over the realisations of the mean itself, block of cells by block: estimates of
//! neighbouring cells share windows, those of blocks hardly do, and a few outliers weigh there as they do in the mean. So few
//! blocks are taken as leave some thirty degrees of freedom, none smaller than twice what cells share. Check: the scatter of the
//! averages over independent maps.

use crate::measure::map::{ScanErrors, VelocityEstimates};
use ndarray::Array2;
use std::collections::BTreeMap;

/// Degrees of freedom from which on a variance need not be known better.
const ENOUGH: usize = 30;

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
    /// Over the cells (line, gate) of a map that have an estimate; neighbours share windows over `shared` lines and gates. Standard
    /// errors are NaN for maps that do not hold their scans, or one alone.
    #[must_use]
    pub fn over(map: &VelocityEstimates, cells: &[(usize, usize)], shared: (f64, f64)) -> Self {
        let has_estimate = |cell: &(usize, usize)| map.rms_m_s.get(*cell).is_some_and(|rms| rms.is_finite());
        let known: Vec<(usize, usize)> = cells.iter().copied().filter(has_estimate).collect();
        let mean = |field: &Array2<f64>, power: i32| {
            known.iter().map(|c| field[*c].powi(power)).sum::<f64>() / known.len() as f64
        };
        let (std_m_s, rms_m_s) = (mean(&map.std_m_s, 2).sqrt(), mean(&map.rms_m_s, 2).sqrt());
        let blocks = Blocks::new(map, &known, shared);
        let squares = blocks.variances(|scan, cell| scan.error_m_s[cell].powi(2));
        // Of squares about their own mean: for Gaussian errors of deviation s and bias b a mean of n squares has the variance
        // (2 s^4 + 4 b^2 s^2)/n, that of n - 1 degrees of freedom 2 s^4/(n - 1), n/(n - 1) times as much without bias; where outliers
        // make it, both have the same. Half-way between.
        let n = map.scans.len() as f64;
        let about_mean = blocks.cells.iter().zip(&squares).map(|(cells, variance)| {
            let of =
                |field: &Array2<f64>| cells.iter().map(|c| field[*c].powi(2)).filter(|x| x.is_finite()).sum::<f64>();
            let spread = of(&map.std_m_s);
            let bias = (of(&map.bias_m_s) - spread / n).max(0.0);
            if spread > 0.0 { variance * (n - 0.5) / (n - 1.0) * spread / (spread + 2.0 * bias) } else { 0.0 }
        });
        let about_mean: Vec<f64> = about_mean.collect();
        Self {
            bias_m_s: mean(&map.bias_m_s, 1),
            bias_standard_error_m_s: blocks.error(&blocks.variances(|scan, cell| scan.error_m_s[cell])),
            std_m_s,
            std_standard_error_m_s: blocks.error(&about_mean) / (2.0 * std_m_s),
            rms_m_s,
            standard_error_m_s: blocks.error(&squares) / (2.0 * rms_m_s),
        }
    }

    /// Averages of independent batches of equal size as one.
    #[must_use]
    pub fn joined(batches: impl ExactSizeIterator<Item = Self>) -> Self {
        let n = batches.len() as f64;
        let mut sums = [0.0; 6];
        for b in batches {
            let errors = [b.bias_standard_error_m_s, b.std_standard_error_m_s, b.standard_error_m_s].map(|e| e * e / n);
            let values = [b.bias_m_s, b.std_m_s.powi(2), b.rms_m_s.powi(2)];
            sums.iter_mut().zip([values, errors].concat()).for_each(|(sum, value)| *sum += value / n);
        }
        let [bias_m_s, rest @ ..] = sums;
        let [std_m_s, rms_m_s, bias_standard_error_m_s, std_standard_error_m_s, standard_error_m_s] =
            rest.map(f64::sqrt);
        Self { bias_m_s, bias_standard_error_m_s, std_m_s, std_standard_error_m_s, rms_m_s, standard_error_m_s }
    }
}

/// Part of the estimates of all cells and scans that is flagged, and its standard error: not 0 where none or all are.
#[must_use]
pub fn flagged_fraction(map: &VelocityEstimates, shared: (f64, f64)) -> [f64; 2] {
    let cells: Vec<(usize, usize)> = map.flagged.indexed_iter().map(|(cell, _)| cell).collect();
    let fraction = map.flagged.sum() / cells.len() as f64;
    let blocks = Blocks::new(map, &cells, shared);
    let scattered = blocks.error(&blocks.variances(|scan, cell| f64::from(u8::from(scan.flagged[cell]))));
    [fraction, scattered.max(error_of_fraction(fraction, (cells.len() * map.scans.len()) as f64))]
}

/// Standard error of a fraction of so many: not 0 where none was found.
pub(crate) fn error_of_fraction(fraction: f64, of: f64) -> f64 {
    let found = fraction * of;
    ((found + 1.0) * (of - found + 1.0) / ((of + 2.0).powi(2) * (of + 3.0))).sqrt()
}

/// Cells of a map in blocks that hardly share windows.
struct Blocks<'m> {
    map: &'m VelocityEstimates,
    cells: Vec<Vec<(usize, usize)>>,
    /// Part of the variance of a mean that is seen within blocks.
    seen: f64,
}

impl<'m> Blocks<'m> {
    fn new(map: &'m VelocityEstimates, cells: &[(usize, usize)], shared: (f64, f64)) -> Self {
        let place = |at: usize, edge: f64| (at as f64 / edge) as usize;
        let cut = |times: f64| {
            let mut blocks: BTreeMap<(usize, usize), Vec<(usize, usize)>> = BTreeMap::new();
            for &(line, gate) in cells {
                let of = (place(line, times * shared.0), place(gate, times * shared.1));
                blocks.entry(of).or_default().push((line, gate));
            }
            blocks
        };
        let freedom = map.scans.len().saturating_sub(1);
        let (mut times, mut blocks) = (2.0, cut(2.0));
        loop {
            let larger = cut(2.0 * times);
            if larger.len() == blocks.len() || larger.len() * freedom < ENOUGH {
                break;
            }
            (times, blocks) = (2.0 * times, larger);
        }
        // What cells at the borders have in common falls to nothing as the square of what is left of the windows they share.
        let of = |several: bool| if several { 1.0 - 0.25 / times } else { 1.0 };
        let several = |pick: fn(&(usize, usize)) -> usize| {
            blocks.keys().next().is_some_and(|first| blocks.keys().any(|other| pick(other) != pick(first)))
        };
        let seen = of(several(|block| block.0)) * of(several(|block| block.1));
        Self { map, cells: blocks.into_values().collect(), seen }
    }

    /// What each block adds to the variance of the mean of a value over cells and scans, from its scatter over the scans.
    fn variances(&self, value: impl Fn(&ScanErrors, (usize, usize)) -> f64) -> Vec<f64> {
        let (scans, all) = (self.map.scans.len(), self.cells.iter().map(Vec::len).sum::<usize>() as f64);
        let of_block = |cells: &Vec<(usize, usize)>| {
            let mut sums = vec![0.0; scans];
            for cell in cells {
                let values: Vec<f64> = self.map.scans.iter().map(|scan| value(scan, *cell)).collect();
                let known = || values.iter().filter(|value| value.is_finite());
                let count = known().count() as f64;
                let mean = known().sum::<f64>() / count;
                for (sum, value) in sums.iter_mut().zip(&values).filter(|(_, value)| value.is_finite()) {
                    *sum += (value - mean) / (count * all);
                }
            }
            sums.iter().map(|sum| sum * sum).sum::<f64>() * scans as f64 / (scans as f64 - 1.0)
        };
        self.cells.iter().map(of_block).collect()
    }

    /// The standard error of a mean from what the blocks add to its variance; NaN without two scans. With few degrees of freedom, by
    /// Satterthwaite's rule, it is wider, between Student's factors for one and for two standard errors.
    fn error(&self, variances: &[f64]) -> f64 {
        let (sum, squares) = (variances.iter().sum::<f64>(), variances.iter().map(|v| v * v).sum::<f64>());
        let freedom = (self.map.scans.len() as f64 + 1.0) * sum * sum / squares - 2.0;
        if self.map.scans.len() < 2 {
            return f64::NAN;
        }
        if sum == 0.0 { 0.0 } else { (sum / self.seen).sqrt() * (1.0 + 1.0 / freedom.max(1.0)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    fn uniform(rng: &mut Xoshiro256PlusPlus) -> f64 {
        (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
        (-2.0 * (1.0 - uniform(rng)).ln()).sqrt() * (std::f64::consts::TAU * uniform(rng)).cos()
    }

    /// Errors of 24 lines and 32 gates of which neighbours share three lines and four gates, with a bias about the middle, and outliers
    /// that they do not share.
    fn drawn(rng: &mut Xoshiro256PlusPlus, scans: usize, bias_m_s: f64, bad: f64) -> VelocityEstimates {
        let shape = (24, 32);
        let biased = |i: usize, j: usize| i.abs_diff(12) < 5 && j.abs_diff(16) < 8;
        let scan = |rng: &mut Xoshiro256PlusPlus| {
            let white = Array2::from_shape_simple_fn((shape.0 + 2, shape.1 + 3), || normal(rng));
            let mut error_m_s = Array2::from_shape_fn(shape, |(i, j)| {
                let sum: f64 = white.slice(ndarray::s![i..i + 3, j..j + 4]).sum();
                sum / 12_f64.sqrt() + if biased(i, j) { bias_m_s } else { 0.0 }
            });
            let flagged = Array2::from_shape_simple_fn(shape, || uniform(rng) < bad);
            error_m_s.zip_mut_with(&flagged, |error, flagged| {
                if *flagged {
                    *error = 40.0 * (uniform(rng) - 0.5);
                }
            });
            ScanErrors { error_m_s, flagged }
        };
        let scans: Vec<ScanErrors> = (0..scans).map(|_| scan(rng)).collect();
        let of = |get: &dyn Fn(&[f64]) -> f64| {
            Array2::from_shape_fn(shape, |cell| get(&scans.iter().map(|scan| scan.error_m_s[cell]).collect::<Vec<_>>()))
        };
        let statistics = |values: &[f64]| wakescope_estimate::map::ErrorStatistics::of(values.iter().copied());
        let count = scans.len() as f64;
        VelocityEstimates {
            bias_m_s: of(&|values| statistics(values).bias_m_s),
            std_m_s: of(&|values| statistics(values).std_m_s),
            rms_m_s: of(&|values| statistics(values).rms_m_s),
            flagged: Array2::from_shape_fn(shape, |cell| {
                scans.iter().filter(|scan| scan.flagged[cell]).count() as f64 / count
            }),
            scans,
            ..VelocityEstimates::default()
        }
    }

    /// Shares of an average within one and two of its standard errors, and stated error over scatter.
    fn covered(found: &[[f64; 2]], truth: f64) -> [f64; 3] {
        let n = found.len() as f64;
        let share = |times: f64| found.iter().filter(|[x, e]| (x - truth).abs() < times * e).count() as f64 / n;
        let scatter = (found.iter().map(|[x, _]| (x - truth).powi(2)).sum::<f64>() / n).sqrt();
        [share(1.0), share(2.0), found.iter().map(|[_, e]| e / n).sum::<f64>() / scatter]
    }

    #[test]
    fn standard_errors_of_averages_cover_with_outliers_bias_and_few_realisations() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let cells: Vec<(usize, usize)> = (0..24).flat_map(|i| (0..32).map(move |j| (i, j))).collect();
        for (scans, bias_m_s, bad) in [
            (2, 0.0, 0.0),
            (5, 1.5, 0.0),
            (40, 1.5, 0.0),
            (2, 1.5, 0.01),
            (6, 0.0, 0.01),
            (30, 1.5, 0.004),
            (4, 0.0, 0.3),
        ] {
            let mut found = [const { Vec::new() }; 4];
            for _ in 0..150 {
                let map = drawn(&mut rng, scans, bias_m_s, bad);
                let a = CellAverage::over(&map, &cells, (3.0, 4.0));
                found[0].push([a.bias_m_s, a.bias_standard_error_m_s]);
                found[1].push([a.std_m_s, a.std_standard_error_m_s]);
                found[2].push([a.rms_m_s, a.standard_error_m_s]);
                found[3].push(flagged_fraction(&map, (3.0, 4.0)));
            }
            let squares = (1.0 - bad) + bad * 1600.0 / 12.0;
            let of_bias = bias_m_s * 9.0 * 15.0 / (24.0 * 32.0) * (1.0 - bad);
            let bias_square = bias_m_s * bias_m_s * 9.0 * 15.0 / (24.0 * 32.0) * (1.0 - bad);
            // Outliers are about zero and not about the bias: they take part of its square for variance.
            let square_of_mean = bias_square * (1.0 - bad);
            let truths =
                [of_bias, (squares + bias_square - square_of_mean).sqrt(), (squares + bias_square).sqrt(), bad];
            for (name, (found, truth)) in ["bias", "std", "rms", "flagged"].iter().zip(found.iter().zip(truths)) {
                let [one, two, size] = covered(found, truth);
                let case = format!("{name}, {scans} scans, bias {bias_m_s}, bad {bad}: {one} {two} {size}");
                if *name == "flagged" && bad == 0.0 {
                    assert!(found.iter().all(|[fraction, error]| *fraction == 0.0 && *error > 0.0), "{case}");
                    continue;
                }
                // 150 maps: shares are known to 0.04 and 0.02, a scatter to 0.06, with outliers to 0.1.
                assert!((0.55..0.86).contains(&one) && two > 0.85 && (0.8..1.55).contains(&size), "{case}");
            }
        }
    }

    #[test]
    fn batches_of_equal_errors_keep_them_and_halve_the_standard_error_of_four() {
        let one = CellAverage {
            bias_m_s: -0.2,
            bias_standard_error_m_s: 0.02,
            std_m_s: 0.5,
            std_standard_error_m_s: 0.08,
            rms_m_s: 0.6,
            standard_error_m_s: 0.1,
        };
        let four = CellAverage::joined([one; 4].into_iter());
        assert!((four.bias_m_s + 0.2).abs() < 1e-12 && (four.std_m_s - 0.5).abs() < 1e-12);
        assert!((four.rms_m_s - 0.6).abs() < 1e-12 && (four.standard_error_m_s - 0.05).abs() < 1e-12);
        assert!(
            (four.bias_standard_error_m_s - 0.01).abs() < 1e-12 && (four.std_standard_error_m_s - 0.04).abs() < 1e-12
        );
    }
}
