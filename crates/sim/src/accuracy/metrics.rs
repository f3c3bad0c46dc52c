//! Metrics of a run, and their shifts between two runs.
//!
//! Runs have the seed in common, so a shift is taken realisation by realisation and its standard error by the jackknife of the
//! ratio (Efron 1982). A shift is no error against the truth: coarse settings smooth, and may look better than fine ones.

use super::mean_wind::mean_wind_m_s;
use crate::Error;
use crate::measure::map::VelocityEstimates;
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::sweep::Retrieval;
use wakescope_estimate::Measured;

crate::keys::keys! {
    /// A result of a run whose error is assessed.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    choice Metric {
        /// Efficiency in the middle of the scan.
        Efficiency = "efficiency",
        /// Root mean square over the map of the mean error against the velocity weighted with pulse and window, without its noise.
        Bias = "bias",
        /// Standard deviation of one estimate, over the map.
        Std = "std",
        /// Root mean square error, over the map.
        Rms = "rms",
        /// Wind along x of a VAD or DBS scan, averaged over sweeps and ranges, over the wind speed.
        U = "u",
        /// Wind along y.
        V = "v",
        /// Wind along z.
        W = "w",
        /// Circulation fitted to each map; of a simulated wake the mean of both vortices.
        Circulation = "circulation",
        /// Height of the vortices of a simulated wake.
        Height = "height",
        /// Kinetic energy of a flow.
        Energy = "energy",
        /// Power that viscosity and the subgrid model dissipate.
        Dissipation = "dissipation",
    }
}

/// A statistic of all realisations, and of all but each one.
#[derive(Debug, Clone)]
struct Jackknife {
    all: f64,
    without: Vec<f64>,
}

impl Jackknife {
    /// Mean of independent numbers; those that are not finite are skipped.
    fn mean(numbers: &[f64]) -> Self {
        let finite: Vec<f64> = numbers.iter().copied().filter(|x| x.is_finite()).collect();
        let sum: f64 = finite.iter().sum();
        let count = finite.len() as f64;
        Self {
            all: sum / count,
            without: finite.iter().map(|x| (sum - x) / (count - 1.0)).collect(),
        }
    }

    fn standard_error(&self) -> f64 {
        let count = self.without.len() as f64;
        let mean = self.without.iter().sum::<f64>() / count;
        let squares: f64 = self.without.iter().map(|x| (x - mean).powi(2)).sum();
        ((count - 1.0) / count * squares).sqrt()
    }

    /// A function of two statistics of the same realisations.
    fn combined(&self, other: &Self, function: impl Fn(f64, f64) -> f64) -> Self {
        let pairs = self.without.iter().zip(&other.without);
        Self {
            all: function(self.all, other.all),
            without: pairs.map(|(a, b)| function(*a, *b)).collect(),
        }
    }

    /// Distance from `reference`, over a scale.
    fn shift(&self, reference: &Self, scale: &Self) -> Measured {
        let difference = self.combined(reference, |a, b| a - b);
        let relative = difference.combined(scale, |difference, scale| difference / scale);
        Measured {
            value: relative.all,
            std: relative.standard_error(),
        }
    }
}

/// Results of a run, realisation by realisation, and its run time.
#[derive(Debug, Clone, Default)]
pub(super) struct Sample {
    /// Efficiency in the middle of the scan, by independent groups of realisations of the path.
    pub(super) efficiency: Vec<f64>,
    /// Errors against the velocity weighted with the pulse, m/s, `[realisation][cell]`.
    error_m_s: Vec<Vec<f64>>,
    /// That velocity less the one weighted with pulse and window, m/s.
    offset_m_s: Vec<f64>,
    wind_m_s: Vec<[f64; 3]>,
    circulation_m2_s: Vec<f64>,
    /// Exact relative shift of the bistatic efficiency by the phase screens, in the middle of the scan and the largest over its stretch.
    pub(super) layer_shift: [f64; 2],
    /// Wall time of efficiencies, and of signals and map, s.
    pub(super) optics_s: f64,
    pub(super) map_s: f64,
}

impl Sample {
    /// Of a map; circulations are fitted only where requested, as fits need long.
    ///
    /// # Errors
    /// What the fits of winds refuse; a checked scene gives none.
    pub(super) fn new(
        plan: &Plan,
        scanner: &Scanner<'_>,
        map: &VelocityEstimates,
        metrics: &[Metric],
    ) -> Result<Self, Error> {
        let offset_m_s = &map.v_pulse_m_s - &map.v_gate_m_s;
        let mut sample = Self {
            offset_m_s: offset_m_s.iter().copied().collect(),
            ..Self::default()
        };
        let retrieval = if metrics.contains(&Metric::Circulation) {
            Retrieval::new(plan, scanner)
        } else {
            None
        };
        for (realisation, scan) in map.scans.iter().enumerate() {
            let velocity_m_s = &scan.error_m_s + map.pulse_truth_m_s(realisation);
            sample.wind_m_s.extend(mean_wind_m_s(plan, &velocity_m_s)?);
            if let Some(retrieval) = &retrieval {
                let fitted = retrieval.circulation_m2_s(&velocity_m_s);
                sample.circulation_m2_s.extend(fitted);
            }
            let errors = scan.error_m_s.iter().copied().collect();
            sample.error_m_s.push(errors);
        }
        Ok(sample)
    }

    /// Whether each cell has an estimate in every realisation.
    fn known(&self) -> Vec<bool> {
        let mut known = Vec::with_capacity(self.offset_m_s.len());
        for (cell, offset_m_s) in self.offset_m_s.iter().enumerate() {
            let are_finite = self.error_m_s.iter().all(|scan| scan[cell].is_finite());
            known.push(are_finite && offset_m_s.is_finite());
        }
        known
    }

    /// Fraction of the cells known to `reference` that this run has no estimate of.
    pub(super) fn lost(&self, reference: &Self) -> f64 {
        let mut all = 0;
        let mut lost = 0;
        for (own, reference) in self.known().into_iter().zip(reference.known()) {
            all += usize::from(reference);
            lost += usize::from(reference && !own);
        }
        lost as f64 / all.max(1) as f64
    }

    /// Shift of a metric from a reference, over cells known to both, of circulations over the maps fitted in both.
    pub(super) fn shift(&self, reference: &Self, metric: Metric) -> Measured {
        if metric == Metric::Circulation {
            let pairs = self
                .circulation_m2_s
                .iter()
                .zip(&reference.circulation_m2_s);
            let both = pairs.filter(|(own, reference)| own.is_finite() && reference.is_finite());
            let (own, reference): (Vec<f64>, Vec<f64>) = both.unzip();
            let reference = Jackknife::mean(&reference);
            return Jackknife::mean(&own).shift(&reference, &reference);
        }
        let mut both = self.known();
        for (own, reference) in both.iter_mut().zip(reference.known()) {
            *own &= reference;
        }
        let scale = reference.scale(metric, &both);
        self.statistic(metric, &both)
            .shift(&reference.statistic(metric, &both), &scale)
    }

    /// Relative standard error of a metric with these realisations.
    pub(super) fn noise(&self, metric: Metric) -> f64 {
        let known = self.known();
        self.statistic(metric, &known).standard_error() / self.scale(metric, &known).all
    }

    /// What the shift of a metric is relative to: the metric itself; for a bias within four standard errors the root mean square
    /// error; for a component of the wind its speed or, in still air, the root mean square error.
    fn scale(&self, metric: Metric, cells: &[bool]) -> Jackknife {
        let own = self.statistic(metric, cells);
        if metric == Metric::Bias && own.all <= 4.0 * own.standard_error() {
            return self.statistic(Metric::Rms, cells);
        }
        if [Metric::U, Metric::V, Metric::W].contains(&metric) {
            let [u, v, w] = [0, 1, 2].map(|component| self.wind(component));
            let speed = u.combined(&v, f64::hypot).combined(&w, f64::hypot);
            return speed.combined(&self.statistic(Metric::Rms, cells), f64::max);
        }
        own
    }

    fn wind(&self, component: usize) -> Jackknife {
        let values: Vec<f64> = self.wind_m_s.iter().map(|wind| wind[component]).collect();
        Jackknife::mean(&values)
    }

    fn statistic(&self, metric: Metric, cells: &[bool]) -> Jackknife {
        match metric {
            Metric::Efficiency => Jackknife::mean(&self.efficiency),
            Metric::U => self.wind(0),
            Metric::V => self.wind(1),
            Metric::W => self.wind(2),
            Metric::Circulation => Jackknife::mean(&self.circulation_m2_s),
            _ => self.over_map(metric, cells),
        }
    }

    /// Root mean over cells of the square that a metric is made of, from the sums over realisations of each cell.
    fn over_map(&self, metric: Metric, cells: &[bool]) -> Jackknife {
        let all = self.error_m_s.len() as f64;
        let mut total = 0.0;
        let mut without = vec![0.0; self.error_m_s.len()];
        let mut count = 0.0;
        for cell in (0..cells.len()).filter(|cell| cells[*cell]) {
            let offset = self.offset_m_s[cell];
            let mut sum = 0.0;
            let mut squares = 0.0;
            for scan in &self.error_m_s {
                sum += scan[cell];
                squares += scan[cell] * scan[cell];
            }
            count += 1.0;
            total += square(metric, all, sum, squares, offset);
            for (out, scan) in without.iter_mut().zip(&self.error_m_s) {
                let e = scan[cell];
                *out += square(metric, all - 1.0, sum - e, squares - e * e, offset);
            }
        }
        for sum in &mut without {
            *sum = root_mean(*sum, count);
        }
        Jackknife {
            all: root_mean(total, count),
            without,
        }
    }
}

/// Root of the mean of a sum over a count; 0 for a sum that rounding makes negative.
fn root_mean(sum: f64, count: f64) -> f64 {
    (sum / count).max(0.0).sqrt()
}

/// Unbiased square of the bias, of the standard deviation or of the error of a cell, from `n` errors.
fn square(metric: Metric, n: f64, sum: f64, squares: f64, offset: f64) -> f64 {
    let variance = (squares - sum * sum / n) / (n - 1.0);
    match metric {
        Metric::Bias => (sum / n + offset).powi(2) - variance / n,
        Metric::Std => variance,
        _ => squares / n,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of zero mean and unit variance.
    fn normals() -> impl FnMut() -> f64 {
        let mut state = 1u64;
        let mut uniform = move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    /// Synthetic errors of zero mean and unit variance, changed by a function.
    fn sample(realisations: usize, cells: usize, change: impl Fn(f64) -> f64) -> Sample {
        let mut normal = normals();
        let error_m_s = (0..realisations)
            .map(|_| (0..cells).map(|_| change(normal())).collect())
            .collect();
        Sample {
            error_m_s,
            offset_m_s: vec![0.5; cells],
            ..Sample::default()
        }
    }

    #[test]
    fn metrics_of_gaussian_errors_and_their_standard_errors_match_closed_forms() {
        let m = 16;
        let n = 4000;
        let own = sample(m, n, |e| e + 1.0);
        let all = vec![true; n];
        let of = |metric| own.statistic(metric, &all);
        // sqrt(2/(M - 1)/cells)/2 of a standard deviation
        let expected = (0.5 / ((m - 1) as f64 * n as f64)).sqrt();
        assert!(
            (of(Metric::Std).all - 1.0).abs() < 4.0 * expected,
            "{:?}",
            of(Metric::Std).all
        );
        assert!(
            (own.noise(Metric::Std) / expected - 1.0).abs() < 0.6,
            "{} {expected}",
            own.noise(Metric::Std)
        );
        // The mean error is 1 against the pulse's velocity and 1.5 against the gate's.
        assert!(
            (of(Metric::Bias).all - 1.5).abs() < 4.0 * of(Metric::Bias).standard_error(),
            "{:?}",
            of(Metric::Bias).all
        );
        assert!((of(Metric::Rms).all - 2f64.sqrt()).abs() < 4.0 * of(Metric::Rms).standard_error());
    }

    #[test]
    fn shifts_paired_by_seed_have_no_noise_where_errors_are_proportional() {
        let fine = sample(8, 500, |e| e);
        let coarse = sample(8, 500, |e| 1.02 * e);
        assert_eq!(fine.shift(&fine, Metric::Std), Measured::default());
        let found = coarse.shift(&fine, Metric::Std);
        assert!(
            (found.value - 0.02).abs() < 1e-12 && found.std < 1e-12,
            "{found:?}"
        );
        assert!(fine.noise(Metric::Std) > 1e-3);
    }

    #[test]
    fn the_standard_error_of_a_paired_shift_is_its_scatter_over_seeds() {
        const TRIALS: usize = 2000;
        let mut normal = normals();
        let mut scatter = 0.0;
        let mut predicted = 0.0;
        for _ in 0..TRIALS {
            let fine: Vec<f64> = (0..16).map(|_| 1.0 + 0.3 * normal()).collect();
            let coarse = fine.iter().map(|x| 1.02 * x + 0.05 * normal()).collect();
            let [coarse, fine] = [coarse, fine].map(|efficiency| Sample {
                efficiency,
                ..Sample::default()
            });
            let found = coarse.shift(&fine, Metric::Efficiency);
            scatter += (found.value - 0.02).powi(2);
            predicted += found.std.powi(2);
            // Unpaired, the scatter of 30 % alone would leave 10 %.
            assert!(found.std < 0.04, "{found:?}");
        }
        let ratio = (predicted / scatter).sqrt();
        assert!((ratio - 1.0).abs() < 0.08, "{ratio}");
    }

    #[test]
    fn a_bias_within_its_error_is_compared_with_the_root_mean_square_error() {
        let still = Sample {
            offset_m_s: vec![0.0; 500],
            ..sample(8, 500, |e| e)
        };
        let noise = still.noise(Metric::Bias);
        let rms = still.noise(Metric::Rms);
        assert!(
            noise.is_finite() && noise < 0.2 && rms < 0.05,
            "{noise} {rms}"
        );
        // Where noise alone is left, whichever realisation is left out, the bias is zero and so is its error.
        let of = |size: f64| {
            (0..8)
                .map(|scan| vec![if scan % 2 == 0 { size } else { -size }; 50])
                .collect()
        };
        let [fine, coarse] = [1.0, 1.1].map(|size| Sample {
            error_m_s: of(size),
            offset_m_s: vec![0.0; 50],
            ..still.clone()
        });
        assert_eq!(coarse.shift(&fine, Metric::Bias), Measured::default());
    }

    #[test]
    fn a_fit_that_did_not_converge_leaves_the_others_in_their_pairs() {
        let fine = Sample {
            circulation_m2_s: vec![480.0, 530.0, 470.0, 515.0, 490.0],
            ..Sample::default()
        };
        let mut coarse = fine.clone();
        coarse
            .circulation_m2_s
            .iter_mut()
            .for_each(|circulation| *circulation *= 1.02);
        coarse.circulation_m2_s[1] = f64::NAN;
        let found = coarse.shift(&fine, Metric::Circulation);
        assert!(
            (found.value - 0.02).abs() < 1e-12 && found.std < 1e-12,
            "{found:?}"
        );
    }

    #[test]
    fn cells_without_an_estimate_are_counted_as_lost() {
        let fine = sample(4, 100, |e| e);
        let mut holes = fine.clone();
        (0..13).for_each(|cell| holes.error_m_s[2][cell] = f64::NAN);
        assert_eq!((holes.lost(&fine), fine.lost(&fine)), (0.13, 0.0));
        assert_eq!(holes.shift(&fine, Metric::Std), Measured::default());
    }
}
