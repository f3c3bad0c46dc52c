//! Accumulation over circular regions: Table 3, for any statistic and any estimator.
//!
//! Computes the mean of the statistics I_k of all windows within rho of a point, then the velocity of that mean.
//! Along each line of sight the statistics are stored, and their sums over blocks of eight gates, so that a wide region
//! adds few rows. Nothing is subtracted: the sum of a region has no term of another window. Check: against the plain mean of the
//! windows, its independence of the order of rays and of the number of threads, and that windows with a missing sample
//! are skipped and do not change a bit of other regions.

use std::collections::BTreeMap;
use std::ops::Range;

use ndarray::ArrayView2;

use crate::error::{Error, length, not_negative};
use crate::estimators::{Estimator, GateVelocity, Quality, Statistic};
use crate::map::region::effective;
use crate::map::{PolarPoint, ScanGeometry, WindowCorrelation};
use crate::parallel::map_indexed;
use crate::window::missing::MissingRule;
use crate::window::{Gates, Sample, Sampling, Scratch};

mod streamed;

pub use streamed::ScanSums;

/// Gates of a block, whose sum is stored.
const BLOCK: usize = 8;

/// Radius rho of the region of a map point \[m\].
pub enum Radius {
    /// The same everywhere.
    Fixed {
        /// rho \[m\].
        radius_m: f64,
    },
    /// rho(R): range \[m\] to radius \[m\].
    OfRange(Box<dyn Fn(f64) -> f64 + Send + Sync>),
}

impl Radius {
    /// The radius \[m\] at `range_m`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is negative or not finite.
    pub fn at_m(&self, range_m: f64) -> Result<f64, Error> {
        let radius_m = match self {
            Self::Fixed { radius_m } => *radius_m,
            Self::OfRange(radius_m) => radius_m(range_m),
        };
        not_negative("radius_m", radius_m)?;
        Ok(radius_m)
    }
}

/// Result of accumulation at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapPoint {
    /// The velocity with its flag; [`Quality::Empty`] where there is no valid window.
    pub estimate: GateVelocity,
    /// Number of valid windows in the region.
    pub level: usize,
    /// Number of windows of the region that were skipped because of a missing sample.
    pub left_out: usize,
    /// Effective number of independent windows; NaN if no correlation was given.
    pub n_eff: f64,
}

/// Statistics of all windows of a scan, ready to be averaged over any region.
///
/// Memory: 9 bytes x lines of sight x gates x numbers per window
/// (185 lines, 937 gates, 64 lags: 100 MB). Pulses of equal elevation share a line.
pub struct Scan {
    geometry: ScanGeometry,
    /// Gates whose windows are stored: all, except with [`ScanSums::of_gates`].
    held: Range<usize>,
    numbers: usize,
    /// Statistics of each gate held, the pulses of a line added.
    rows: Vec<f64>,
    /// Sums over [`BLOCK`] gates, from the first multiple of it held; the last of a line over what is left.
    blocks: Vec<f64>,
    /// Valid windows before each gate held, one more than gates per line.
    counts: Vec<usize>,
    /// Validity of the windows held of the rays with one that is not.
    invalid: BTreeMap<usize, Vec<bool>>,
    /// Whether the rays of a line were added together, without a missing sample.
    of_products: bool,
    scale: f64,
}

impl Scan {
    /// Statistics of all windows of `records` \[ray, sample\]; ray i has elevation `elevation_rad[i]` \[rad\].
    ///
    /// Several pulses along one line of sight are rays of equal elevation. Windows with a missing sample are skipped:
    /// one that is not finite, a fill value ([`FILL_VALUES`](crate::window::FILL_VALUES)), or one that dwarfs all others
    /// ([`SampleSizes::outsized`](crate::window::SampleSizes::outsized)).
    ///
    /// # Errors
    /// [`Error::Length`] if lengths do not match; as [`ScanGeometry::new`].
    pub fn new<S: Sample>(
        statistic: &(impl Statistic<S> + ?Sized),
        sampling: &Sampling,
        gates: &Gates,
        elevation_rad: &[f64],
        records: ArrayView2<'_, S>,
    ) -> Result<Self, Error> {
        let (rays, samples) = records.dim();
        length("elevation_rad", rays, elevation_rad.len())?;
        let geometry = ScanGeometry::new(sampling, gates, elevation_rad, samples)?;
        let rule = MissingRule::from_samples(records.iter().copied());
        let mut sums = ScanSums::new(statistic, gates, geometry, samples)?.with_rule(rule);
        sums.add(0, records)?;
        Ok(sums.finish())
    }

    /// Where the windows are.
    #[must_use]
    pub fn geometry(&self) -> &ScanGeometry {
        &self.geometry
    }

    /// Numbers of the statistic per window.
    #[must_use]
    pub fn statistic_len(&self) -> usize {
        self.numbers
    }

    /// The power of two by which the samples were divided.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Mean statistic of the valid windows within `radius_m` of `point`, written to `mean`; returns their number.
    ///
    /// The samples are in units of [`Scan::scale`]. Zeros and level 0 if there is none.
    ///
    /// # Errors
    /// [`Error::Length`] if `mean` has not [`Scan::statistic_len`] places.
    pub fn region_mean(
        &self,
        point: PolarPoint,
        radius_m: f64,
        mean: &mut [f64],
    ) -> Result<usize, Error> {
        length("mean", self.numbers, mean.len())?;
        let [level, _] = self.mean_and_windows(point, radius_m, mean);
        Ok(level)
    }

    /// [`Self::region_mean`]; returns the numbers of valid windows, and of those that are stored, valid or not.
    fn mean_and_windows(&self, point: PolarPoint, radius_m: f64, mean: &mut [f64]) -> [usize; 2] {
        mean.fill(0.0);
        let mut level = 0;
        let mut windows = 0;
        for (line, gates) in self.chords(point, radius_m) {
            level += self.valid(line, &gates);
            windows += gates.len() * self.geometry.rays.count(line);
            self.add_chord(line, &gates, mean);
        }
        if level > 0 {
            let weight = 1.0 / level as f64;
            for value in mean {
                *value *= weight;
            }
        }
        [level, windows]
    }

    /// Velocities at `points`, in their order; with `correlation` also n_eff.
    ///
    /// # Errors
    /// [`Error::Length`] if the estimator is for another statistic, [`Error::OutOfRange`] for an impossible radius.
    pub fn map(
        &self,
        points: &[PolarPoint],
        radius: &Radius,
        correlation: Option<&WindowCorrelation>,
        estimator: &(impl Estimator + ?Sized),
    ) -> Result<Vec<MapPoint>, Error> {
        length("statistic", estimator.statistic_len(), self.numbers)?;
        let found = map_indexed(
            points.len(),
            || (Scratch::new(), vec![0.0; self.numbers]),
            |(scratch, mean), index| {
                let point = points[index];
                let radius_m = radius.at_m(point.range_m)?;
                let [level, windows] = self.mean_and_windows(point, radius_m, mean);
                let mut estimate = GateVelocity::none(Quality::Empty);
                if level > 0 {
                    estimate = estimator.estimate(mean, scratch);
                    estimate.scale_power(self.scale * self.scale);
                }
                Ok(MapPoint {
                    estimate,
                    level,
                    left_out: windows - level,
                    n_eff: correlation.map_or(f64::NAN, |gamma| self.n_eff(point, radius_m, gamma)),
                })
            },
        );
        found.into_iter().collect()
    }

    /// Effective number of independent windows of a region, (sum n)^2 / sum of gamma^2 over pairs of one pulse.
    #[must_use]
    pub fn n_eff(&self, point: PolarPoint, radius_m: f64, correlation: &WindowCorrelation) -> f64 {
        let start = self.held.start;
        let mut level = 0;
        let mut pairs = 0.0;
        for (line, gates) in self.chords(point, radius_m) {
            level += self.valid(line, &gates);
            let whole = correlation.pair_sum(gates.len());
            if self.of_products {
                pairs += self.geometry.rays.count(line) as f64 * whole;
                continue;
            }
            for ray in self.geometry.line_rays(line) {
                pairs += match self.invalid.get(&ray) {
                    None => whole,
                    Some(invalid) => valid_pairs(
                        &invalid[gates.start - start..gates.end - start],
                        correlation,
                    ),
                };
            }
        }
        effective(level, pairs)
    }

    /// Chords of a region within the stored gates, by increasing elevation.
    fn chords(
        &self,
        point: PolarPoint,
        radius_m: f64,
    ) -> impl Iterator<Item = (usize, Range<usize>)> + '_ {
        let chords = self.geometry.chords(point, radius_m);
        chords.filter_map(|(line, gates)| {
            let held = gates.start.max(self.held.start)..gates.end.min(self.held.end);
            (!held.is_empty()).then_some((line, held))
        })
    }

    /// Valid windows of a chord.
    fn valid(&self, line: usize, gates: &Range<usize>) -> usize {
        let row = line * (self.held.len() + 1);
        let counts = &self.counts[row..row + self.held.len() + 1];
        counts[gates.end - self.held.start] - counts[gates.start - self.held.start]
    }

    /// Adds the sum over a chord to `out`: whole blocks, and the gates before and behind them.
    fn add_chord(&self, line: usize, gates: &Range<usize>, out: &mut [f64]) {
        let start = self.held.start;
        let numbers = self.numbers;
        let line_numbers = self.held.len() * numbers;
        let line_blocks = self.blocks.len() / self.geometry.lines();
        let rows = &self.rows[line * line_numbers..][..line_numbers];
        let blocks = &self.blocks[line * line_blocks..][..line_blocks];
        let mut gate = gates.start;
        while gate < gates.end {
            if gate.is_multiple_of(BLOCK) && gate + BLOCK <= gates.end {
                let block = gate / BLOCK - start.div_ceil(BLOCK);
                add(out, &blocks[block * numbers..][..numbers]);
                gate += BLOCK;
            } else {
                add(out, &rows[(gate - start) * numbers..][..numbers]);
                gate += 1;
            }
        }
    }
}

fn add(sum: &mut [f64], term: &[f64]) {
    for (sum, term) in sum.iter_mut().zip(term) {
        *sum += term;
    }
}

/// Sum of gamma^2 over the ordered pairs of valid windows of one ray.
fn valid_pairs(invalid: &[bool], correlation: &WindowCorrelation) -> f64 {
    let mut sum = 0.0;
    for (i, i_invalid) in invalid.iter().enumerate() {
        for (j, j_invalid) in invalid.iter().enumerate() {
            if !i_invalid && !j_invalid {
                sum += correlation.squared(i.abs_diff(j));
            }
        }
    }
    sum
}
