//! Accumulation over circular regions: Table 3, for any statistic and any estimator.
//!
//! Computes the mean of the statistics I_k of all windows within rho of a point, then the velocity of that mean.
//! Along each line of sight the statistics are kept, and their sums over blocks of eight gates, so that a wide region
//! adds few rows. Nothing is subtracted: a region knows of no window but its own. Check: against the plain mean of the
//! windows, its independence of the order of rays and of the number of threads, and that windows with a missing sample
//! are left out and leave every bit of the other regions.

use std::collections::BTreeMap;
use std::ops::Range;

use ndarray::ArrayView2;

use crate::error::{Error, length, not_negative};
use crate::estimators::{Estimator, GateVelocity, Quality, Statistic};
use crate::map::region::effective;
use crate::map::{Chord, PolarPoint, ScanGeometry, WindowCorrelation};
use crate::parallel::map_indexed;
use crate::window::missing::Rule;
use crate::window::{Gates, Sample, Sampling, Scratch};

mod streamed;

pub use streamed::ScanSums;

/// Gates whose sum is kept.
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

/// What accumulation gives at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapPoint {
    /// The velocity with its flag; [`Quality::Empty`] where there is no valid window.
    pub estimate: GateVelocity,
    /// Number of valid windows in the region.
    pub level: usize,
    /// Number of windows of the region that were left out because of a missing sample.
    pub left_out: usize,
    /// Number of independent windows that they are worth; NaN if no correlation was given.
    pub n_eff: f64,
}

/// Statistics of all windows of a scan, ready to be averaged over any region.
///
/// Memory: 9 bytes x lines of sight x gates x numbers per window
/// (185 lines, 937 gates, 64 lags: 100 MB). Pulses of equal elevation share a line.
pub struct Scan {
    geometry: ScanGeometry,
    /// Gates whose windows are known: all, but for [`ScanSums::of_gates`].
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
    scale: f64,
}

impl Scan {
    /// Statistics of all windows of `records` \[ray, sample\]; ray i has elevation `elevation_rad[i]` \[rad\].
    ///
    /// Several pulses along one line of sight are rays of equal elevation. Windows with a missing sample are left out:
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
        let rule = Rule::of(records.iter().copied());
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
        mean.fill(0.0);
        let mut level = 0;
        for chord in self.chords(point, radius_m) {
            level += self.valid(chord);
            self.add_chord(chord, mean);
        }
        if level > 0 {
            let share = 1.0 / level as f64;
            mean.iter_mut().for_each(|value| *value *= share);
        }
        Ok(level)
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
        let state = || (Scratch::new(), vec![0.0; self.numbers]);
        let found = map_indexed(points.len(), state, |(scratch, mean), index| {
            let point = points[index];
            let radius_m = radius.at_m(point.range_m)?;
            let level = self.region_mean(point, radius_m, mean)?;
            let mut estimate = GateVelocity::none(Quality::Empty);
            if level > 0 {
                estimate = estimator.estimate(mean, scratch);
                estimate.scale_power(self.scale * self.scale);
            }
            let of_chord = |chord: Chord| chord.gates() * self.geometry.rays.count(chord.line);
            let windows: usize = self.chords(point, radius_m).map(of_chord).sum();
            Ok(MapPoint {
                estimate,
                level,
                left_out: windows - level,
                n_eff: correlation.map_or(f64::NAN, |gamma| self.n_eff(point, radius_m, gamma)),
            })
        });
        found.into_iter().collect()
    }

    /// Effective number of independent windows of a region, (sum n)^2 / sum of gamma^2 over pairs of one pulse.
    #[must_use]
    pub fn n_eff(&self, point: PolarPoint, radius_m: f64, correlation: &WindowCorrelation) -> f64 {
        let (mut level, mut pairs, start) = (0, 0.0, self.held.start);
        for chord in self.chords(point, radius_m) {
            level += self.valid(chord);
            let whole = correlation.pair_sum(chord.gates());
            for ray in self.geometry.line_rays(chord.line) {
                pairs += match self.invalid.get(&ray) {
                    None => whole,
                    Some(invalid) => valid_pairs(
                        &invalid[chord.first - start..=chord.last - start],
                        correlation,
                    ),
                };
            }
        }
        effective(level, pairs)
    }

    /// Chords of a region, as far as they are held, by increasing elevation.
    fn chords(&self, point: PolarPoint, radius_m: f64) -> impl Iterator<Item = Chord> + '_ {
        self.geometry.chords(point, radius_m).filter_map(|chord| {
            let (first, last) = (
                chord.first.max(self.held.start),
                chord.last.min(self.held.end - 1),
            );
            (first <= last).then_some(Chord {
                first,
                last,
                ..chord
            })
        })
    }

    /// Valid windows of a chord.
    fn valid(&self, chord: Chord) -> usize {
        let row = chord.line * (self.held.len() + 1);
        let before = |gate: usize| self.counts[row + gate - self.held.start];
        before(chord.last + 1) - before(chord.first)
    }

    /// Adds the sum over a chord to `out`: whole blocks, and the gates before and behind them.
    fn add_chord(&self, chord: Chord, out: &mut [f64]) {
        let (start, gates) = (self.held.start, self.held.len());
        let blocks = self.blocks.len() / (self.geometry.line_elevation_rad().len() * self.numbers);
        let of = |table: &'_ [f64], place: usize, out: &mut [f64]| {
            add(
                out,
                &table[place * self.numbers..(place + 1) * self.numbers],
            );
        };
        let mut gate = chord.first;
        while gate <= chord.last {
            if gate.is_multiple_of(BLOCK) && gate + BLOCK <= chord.last + 1 {
                of(
                    &self.blocks,
                    chord.line * blocks + gate / BLOCK - start.div_ceil(BLOCK),
                    out,
                );
                gate += BLOCK;
            } else {
                of(&self.rows, chord.line * gates + gate - start, out);
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
    let valid = || invalid.iter().enumerate().filter(|(_, bad)| !**bad);
    valid()
        .flat_map(|(i, _)| valid().map(move |(j, _)| correlation.squared(i.abs_diff(j))))
        .sum()
}
