//! How often a wake of a given circulation is found, and the smallest that nearly always is.
//!
//! A wake adds its own products with the bank to those of the background, so trials cost no more than empty scans; all circulations
//! see the same backgrounds, so the curve is smooth. With places known it would be Phi(Gamma/sigma_Gamma - sqrt(T_c)). Check:
//! against that form; whole drawn scans.

use crate::Measured;
use ndarray::{Array1, Array2};
use rand::{Rng, RngExt};

use crate::error::{Error, not_empty, positive};
use crate::vortex_fit::{Vortex, Wake};
use crate::wake_detection::WakeDetector;

/// The 0.9 quantile of a normal number.
const NINE_OF_TEN: f64 = 1.281_551_565_544_600_4;
/// How often a spacing is drawn, and a place for each, until a pair lies in the scan.
const TRIES: (usize, usize) = (50, 400);
/// Groups of wakes whose scatter tells the error of a circulation.
const GROUPS: usize = 10;

/// Backgrounds with wakes, one in each, of a circulation that is chosen later.
#[derive(Debug, Clone)]
pub struct DetectionTrials<'a> {
    detector: &'a WakeDetector,
    empty: Array2<f64>,
    /// Products of wakes of unit mean circulation.
    wakes: Vec<Array1<f64>>,
    circulation_std_m2_s: Vec<f64>,
}

impl WakeDetector {
    /// So many pairs of unit circulation: each as far apart as any that are asked for, anywhere in the scan with both vortices in it, with
    /// cores of 5 % of their spacing. Fewer where the scan has hardly room for a pair.
    pub fn draw_wakes<R: Rng>(&self, count: usize, stream: impl Fn(u64) -> R) -> Vec<Wake> {
        (0..count)
            .map_while(|index| self.draw_wake(&mut stream(index as u64)))
            .collect()
    }

    /// One pair of unit circulation in the scan; `None` if no trial finds one.
    fn draw_wake<R: Rng>(&self, generator: &mut R) -> Option<Wake> {
        for _ in 0..TRIES.0 {
            let spacing_m = uniform(generator, self.spacing_m);
            for _ in 0..TRIES.1 {
                let left_m = uniform(generator, self.bank.lateral_m);
                let height_m = uniform(generator, self.bank.up_m);
                let [left, right] = [left_m, left_m + spacing_m]
                    .map(|lateral_m| Vortex::at((lateral_m, height_m), 1.0, 0.05 * spacing_m));
                let are_in_scan = [left, right].iter().all(|vortex| {
                    let cells = &self.filter.cells;
                    cells.hold(&self.filter.model, vortex.place_m())
                });
                if are_in_scan {
                    return Some(Wake::calm(left, right));
                }
            }
        }
        None
    }

    /// Trials with the given wakes, in turn, in this number of drawn backgrounds.
    ///
    /// # Errors
    /// [`Error::Empty`] without wakes, [`Error::OutOfRange`] for one that is impossible or has no circulation.
    pub fn trials<R: Rng>(
        &self,
        wakes: &[Wake],
        trials: usize,
        stream: impl Fn(u64) -> R + Sync + Send,
    ) -> Result<DetectionTrials<'_>, Error> {
        not_empty("wakes and trials", wakes.len().min(trials))?;
        let mut products = Vec::new();
        let mut deviations = Vec::new();
        for wake in wakes {
            wake.validate()?;
            let mean_m2_s = 0.5 * (wake.left.circulation_m2_s + wake.right.circulation_m2_s);
            positive("mean of circulation_m2_s", mean_m2_s)?;
            let (product, length) = self.products_of(wake);
            products.push(product / mean_m2_s);
            deviations.push(mean_m2_s / length);
        }
        let empty = self.empty_products(trials, stream);
        Ok(DetectionTrials {
            detector: self,
            empty,
            wakes: products,
            circulation_std_m2_s: deviations,
        })
    }
}

impl DetectionTrials<'_> {
    /// Statistics of all trials with wakes of that circulation \[m^2/s\].
    #[must_use]
    pub fn statistics(&self, circulation_m2_s: f64) -> Vec<f64> {
        let mut statistics = Vec::with_capacity(self.empty.nrows());
        for (i, empty) in self.empty.rows().into_iter().enumerate() {
            let wake = &self.wakes[i % self.wakes.len()];
            let products = &empty + circulation_m2_s * wake;
            statistics.push(self.detector.best(products.view()).0);
        }
        statistics
    }

    /// Shares of the wakes of each circulation \[m^2/s\] whose statistic exceeds a threshold, which must not be negative.
    #[must_use]
    pub fn detection(&self, circulation_m2_s: &[f64], threshold: f64) -> Vec<Measured> {
        let missed = self.missed_m2_s(threshold);
        circulation_m2_s
            .iter()
            .map(|circulation| share(&missed, *circulation))
            .collect()
    }

    /// The circulations between which each trial stays below a threshold \[m^2/s\]: scores are linear in the circulation, so the largest of them is
    /// convex.
    fn missed_m2_s(&self, threshold: f64) -> Vec<[f64; 2]> {
        let root = threshold.max(0.0).sqrt();
        let slopes: Vec<Vec<f64>> = self
            .wakes
            .iter()
            .map(|wake| self.detector.scores(wake.view()).collect())
            .collect();
        let mut missed = Vec::with_capacity(self.empty.nrows());
        for (i, empty) in self.empty.rows().into_iter().enumerate() {
            let lines = self.detector.scores(empty).zip(&slopes[i % slopes.len()]);
            missed.push(lines.fold(
                [f64::NEG_INFINITY, f64::INFINITY],
                |[low, high], (score, slope)| match (root - score) / slope {
                    reached if *slope > 0.0 => [low, high.min(reached)],
                    reached if *slope < 0.0 => [low.max(reached), high],
                    _ if score > root => [f64::INFINITY, f64::NEG_INFINITY],
                    _ => [low, high],
                },
            ));
        }
        missed
    }

    /// Bound on the circulation of the wakes were their places known \[m^2/s\], root mean square.
    #[must_use]
    pub fn circulation_std_m2_s(&self) -> f64 {
        let squares: f64 = self.circulation_std_m2_s.iter().map(|std| std * std).sum();
        (squares / self.circulation_std_m2_s.len() as f64).sqrt()
    }

    /// The circulation that is found with probability 0.9 \[m^2/s\]: measured; its standard error, from its scatter between groups of wakes,
    /// NaN with less than twenty wakes; and as the bound predicts, sigma_Gamma (sqrt(T_c) + 1.28).
    #[must_use]
    pub fn smallest_detectable_m2_s(&self, threshold: f64) -> [f64; 3] {
        let foretold = self.circulation_std_m2_s() * (threshold.max(0.0).sqrt() + NINE_OF_TEN);
        let missed = self.missed_m2_s(threshold);
        let mut groups = Vec::new();
        for group in (0..GROUPS).filter(|_| self.wakes.len() >= 2 * GROUPS) {
            let of_group: Vec<[f64; 2]> = (0..missed.len())
                .filter(|i| i % self.wakes.len() % GROUPS == group)
                .map(|i| missed[i])
                .collect();
            groups.push(found_nine_times(&of_group, foretold));
        }
        let count = groups.len() as f64;
        let mean = groups.iter().sum::<f64>() / count;
        let squares: f64 = groups.iter().map(|x| (x - mean).powi(2)).sum();
        [
            found_nine_times(&missed, foretold),
            (squares / (count - 1.0) / count).sqrt(),
            foretold,
        ]
    }
}

/// The circulation that nine in ten trials find, sought from `about` on \[m^2/s\].
fn found_nine_times(missed: &[[f64; 2]], about: f64) -> f64 {
    let mut low = 0.0;
    let mut high = 2.0 * about;
    while share(missed, high).value < 0.9 && high < 64.0 * about {
        high *= 2.0;
    }
    while high - low > 2e-3 * high {
        let middle = 0.5 * (low + high);
        if share(missed, middle).value < 0.9 {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

/// Share of trials that find a circulation, of those between which each misses it.
fn share(missed_m2_s: &[[f64; 2]], circulation_m2_s: f64) -> Measured {
    let misses = missed_m2_s
        .iter()
        .filter(|[low, high]| (*low..=*high).contains(&circulation_m2_s))
        .count();
    Measured::share(missed_m2_s.len() - misses, missed_m2_s.len())
}

/// A number between two others.
fn uniform<R: Rng>(generator: &mut R, (low, high): (f64, f64)) -> f64 {
    low + (high - low) * generator.random::<f64>()
}
