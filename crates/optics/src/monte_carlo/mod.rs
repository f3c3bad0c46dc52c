//! Efficiency (19) through turbulence by Monte Carlo: both receivers, every range, from one set
//! of realisations.
//!
//! Monostatic: transmitted beam and BPLO cross the same screens; bistatic: independent ones, taken
//! as all pairs of different realisations. Realisations run in parallel in groups of fixed size,
//! each screen with a random stream of its own, so that the result has the same bits for any
//! number of threads.
//!
//! Means, scatter and errors are multiplied with the ratio of exact to grid free-space efficiency.
//!
//! Check: bistatic against exact theory for the very screens used, as a z-score, in every run; no
//! turbulence gives free space with an error of exactly 0.

mod against_theory;
#[cfg(test)]
mod mutation_tests;
pub(crate) mod path;
mod statistics;
mod walk;

pub use path::Layers;
pub use walk::Sampling;

use crate::beam::source::{aperture_field, check_grid};
use crate::efficiency::{EfficiencyPoint, EfficiencyProfile};
use crate::error::{positive, within};
use crate::monte_carlo::path::Path;
use crate::monte_carlo::statistics::{Folding, bistatic, mean_and_variance};
use crate::monte_carlo::walk::{Prepared, RangeResult, Walker};
use crate::screens::generator::ScreenGenerator;
use crate::screens::grid::Grid;
use crate::screens::kernel::Real;
use crate::screens::propagate::Propagator;
use crate::{Error, Misalignment, Telescope, Turbulence, theory};
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

/// Realisations of one unit of work; their sums are added in order.
pub(crate) const GROUP: usize = 8;
/// Groups between two tests for the end.
pub(crate) const GROUPS_PER_WAVE: usize = 8;

/// When the Monte Carlo ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Largest number of realisations.
    pub realisations: usize,
    /// Ends earlier when the relative standard error of the monostatic mean is at most this
    /// at every range.
    pub relative_standard_error: Option<f64>,
}

impl Stop {
    /// A fixed number of realisations.
    pub fn after(realisations: usize) -> Self {
        Self {
            realisations,
            relative_standard_error: None,
        }
    }

    fn validate(&self) -> Result<(), Error> {
        within(
            "realisations",
            self.realisations as f64,
            self.realisations > 0,
            "at least 1",
        )?;
        if let Some(target) = self.relative_standard_error {
            positive("relative_standard_error", target)?;
        }
        Ok(())
    }
}

/// Argument of the progress function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Realisations done.
    pub done: usize,
    /// Realisations at which it ends at the latest.
    pub total: usize,
    /// Largest relative standard error of the monostatic mean over the ranges at the last
    /// test for the end.
    pub relative_standard_error: f64,
}

/// A Monte-Carlo run: everything it depends on.
#[derive(Debug, Clone)]
pub struct MonteCarlo {
    /// Telescope of both beams.
    pub telescope: Telescope,
    /// Displacement of the BPLO against the transmitted beam; none costs nothing.
    pub misalignment: Misalignment,
    /// Turbulence along the path.
    pub turbulence: Turbulence,
    /// Transverse grid.
    pub grid: Grid,
    /// Layers of the path, one screen each; a range inside a layer cuts it ([`Layers::split_at`]).
    pub layers: Layers,
    /// Ranges at which the efficiency is wanted \[m\], in any order, within the layers; results
    /// come in increasing order, each range once.
    pub range_m: Vec<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How realisations are drawn.
    pub sampling: Sampling,
}

/// Result of a Monte-Carlo run.
#[derive(Debug, Clone, PartialEq)]
pub struct EfficiencyEstimate {
    /// Both beams through the same path.
    pub monostatic: EfficiencyProfile,
    /// Beams through independent paths; none from a single realisation, which has no pairs.
    pub bistatic: Option<EfficiencyProfile>,
    /// Efficiency of each realisation at each range, `[range][realisation]`, both beams through the
    /// same path; a realisation has the same index at every range. One without turbulence.
    pub monostatic_realisations: Vec<Vec<f64>>,
    /// The same for beams through the independent paths of two realisations each;
    /// empty without pairs.
    pub bistatic_realisations: Vec<Vec<f64>>,
    /// Realisations done (1 without turbulence).
    pub realisations: usize,
    /// Independent samples among them, from which the errors are taken: an antithetic pair is one.
    /// Two are needed for the error of the monostatic mean, three for that of the bistatic one;
    /// below, these are NaN.
    pub independent_samples: usize,
    /// Free-space efficiency of the same steps on the same grid; times this over
    /// `exact_free_space`, the means are those of the grid as it is.
    pub grid_free_space: Vec<f64>,
    /// Exact free-space efficiency.
    pub exact_free_space: Vec<f64>,
    /// Mean fraction of the power that the absorbing border took before each range. Above 0.01 the
    /// result is doubtful; above 0.05 it is refused.
    pub lost_power_fraction: Vec<f64>,
}

impl MonteCarlo {
    /// The chapter's set-up: 512 x 512 points of 2 mm, 10 layers out to 3 km with a range at the
    /// end of each, Table 2.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a Cn2 \[m^(-2/3)\] that is not allowed.
    pub fn table2(cn2_m_m23: f64, seed: u64) -> Result<Self, Error> {
        let layers = Layers::equal(10, 3000.0)?;
        Ok(Self {
            telescope: Telescope::table2(),
            misalignment: Misalignment::NONE,
            turbulence: Turbulence::table2(cn2_m_m23)?,
            grid: Grid::table2(),
            range_m: layers.end_m().to_vec(),
            layers,
            seed,
            sampling: Sampling::Independent,
        })
    }

    /// Runs a number of realisations in single precision.
    ///
    /// # Errors
    /// As [`MonteCarlo::run_in`].
    pub fn run(&self, realisations: usize) -> Result<EfficiencyEstimate, Error> {
        self.run_in::<f32>(Stop::after(realisations), |_| ControlFlow::Continue(()))
    }

    /// Runs in the number type `T` (f32 is twice as fast; its rounding is far below a
    /// Monte-Carlo error).
    ///
    /// `progress` is called after each layer of two realisations, by the thread that carried them;
    /// `ControlFlow::Break` cancels.
    ///
    /// # Errors
    /// [`Error`] for a set-up that is not allowed, [`Error::PowerLost`], [`Error::AgainstTheory`],
    /// [`Error::Cancelled`].
    pub fn run_in<T: Real>(
        &self,
        stop: Stop,
        mut progress: impl FnMut(Progress) -> ControlFlow<()> + Send,
    ) -> Result<EfficiencyEstimate, Error> {
        let set_up = self.sorted();
        let prepared = set_up.prepare::<T>()?;
        set_up.run_prepared(&prepared, stop, &mut progress)
    }

    /// Mean irradiance overlap without turbulence on this very grid, at each range: the grid's
    /// free-space efficiency.
    ///
    /// # Errors
    /// As [`MonteCarlo::run_in`].
    pub fn grid_free_space<T: Real>(&self) -> Result<Vec<f64>, Error> {
        let calm = Self {
            turbulence: Turbulence::none(),
            ..self.sorted()
        };
        let prepared = calm.prepare::<T>()?;
        let walker = Walker::new(&prepared, calm.seed, calm.sampling);
        let ranges = walker.run_group(0, 1, &|_| Ok(()))?;
        Ok(ranges.iter().map(|at| at.samples[0].same_path).collect())
    }

    /// The same run with its ranges in increasing order, each at the end of a layer; `prepare`
    /// refuses ranges that are not numbers.
    fn sorted(&self) -> Self {
        let mut range_m = self.range_m.clone();
        range_m.sort_by(f64::total_cmp);
        range_m.dedup();
        Self {
            layers: self.layers.split_at(&range_m),
            range_m,
            ..self.clone()
        }
    }

    /// Plans everything that all realisations share.
    pub(crate) fn prepare<T: Real>(&self) -> Result<Prepared<T>, Error> {
        let telescope = self.telescope.validated()?;
        let misalignment = self.misalignment.validated()?;
        let cn2 = self.turbulence.cn2.clone().validated()?;
        crate::efficiency::check_increasing("range_m", &self.range_m)?;
        let furthest = *self.range_m.last().ok_or(Error::Length {
            field: "range_m",
            found: 0,
            expected: 1,
        })?;
        check_grid(&telescope, &misalignment, &self.grid, furthest)?;
        let lambda = telescope.wavelength_m;
        let path = Path::new(&self.layers, &self.range_m, &cn2, &self.grid, lambda)?;
        let propagator = Propagator::new(self.grid, lambda)?;
        let is_displaced = misalignment != Misalignment::NONE;
        let mut start = vec![aperture_field::<T>(
            &telescope,
            &Misalignment::NONE,
            &self.grid,
        )];
        if is_displaced {
            start.push(aperture_field(&telescope, &misalignment, &self.grid));
        }
        let mut transfers = Vec::with_capacity(path.distance_m.len());
        for &distance_m in &path.distance_m {
            transfers.push(propagator.transfer(distance_m)?);
        }
        let screens = if path.strength.is_empty() {
            None
        } else {
            let spectrum = self.turbulence.spectrum.clone();
            Some(ScreenGenerator::new(self.grid, spectrum)?)
        };
        let pixel = self.grid.dx_m * self.grid.dy_m;
        Ok(Prepared {
            transfers,
            screens,
            folding: Folding::new(&self.grid, !is_displaced),
            scale: self
                .range_m
                .iter()
                .map(|r| (lambda * r).powi(2) / telescope.aperture_area_m2() * pixel)
                .collect(),
            power: start[0].iter().map(|e| e.norm_sqr().wide()).sum::<f64>() * pixel,
            path,
            propagator,
            start,
        })
    }

    /// Runs waves of groups of realisations until `stop`.
    pub(crate) fn run_prepared<T: Real>(
        &self,
        prepared: &Prepared<T>,
        stop: Stop,
        progress: &mut ProgressFunction<'_>,
    ) -> Result<EfficiencyEstimate, Error> {
        stop.validate()?;
        // Without turbulence all realisations are the same.
        let total = if prepared.screens.is_some() {
            stop.realisations
        } else {
            1
        };
        let reported = Mutex::new((0, progress));
        let mut ranges: Vec<RangeResult<T>> = Vec::new();
        let mut done = 0;
        let mut relative_standard_error = f64::INFINITY;
        while done < total {
            let firsts: Vec<usize> = (done..total).step_by(GROUP).take(GROUPS_PER_WAVE).collect();
            let groups = in_parallel(&firsts, |&first| {
                let count = GROUP.min(total - first);
                let walker = Walker::new(prepared, self.seed, self.sampling);
                walker.run_group(first, count, &|more| {
                    report(&reported, more, total, relative_standard_error)
                })
            });
            for group in groups {
                let group = group?;
                if ranges.is_empty() {
                    ranges = group;
                    continue;
                }
                for (sum, result) in ranges.iter_mut().zip(group) {
                    sum.add(result);
                }
            }
            done = (done + GROUPS_PER_WAVE * GROUP).min(total);
            relative_standard_error = ranges.iter().map(relative_error).fold(0.0, f64::max);
            if stop
                .relative_standard_error
                .is_some_and(|target| relative_standard_error <= target)
            {
                break;
            }
        }
        self.estimate(prepared, &ranges, done)
    }

    /// Means, scatter and errors of both receivers at each range, times the ratio of exact to grid
    /// free-space efficiency.
    fn estimate<T: Real>(
        &self,
        prepared: &Prepared<T>,
        ranges: &[RangeResult<T>],
        realisations: usize,
    ) -> Result<EfficiencyEstimate, Error> {
        let is_calm = prepared.screens.is_none();
        let grid_free_space = if is_calm {
            ranges.iter().map(|at| at.samples[0].same_path).collect()
        } else {
            self.grid_free_space::<T>()?
        };
        let mut out = EfficiencyEstimate {
            monostatic: EfficiencyProfile::default(),
            bistatic: None,
            monostatic_realisations: Vec::new(),
            bistatic_realisations: Vec::new(),
            realisations,
            independent_samples: ranges.first().map_or(0, |at| at.samples.len()),
            grid_free_space,
            exact_free_space: self.exact_free_space()?,
            lost_power_fraction: Vec::new(),
        };
        let mut pairs = EfficiencyProfile::default();
        for (i, (at, &range_m)) in ranges.iter().zip(&self.range_m).enumerate() {
            let (fraction, _) = mean_and_variance(at.samples.iter().map(|s| s.lost));
            if fraction.is_nan() || fraction > 0.05 {
                return Err(Error::PowerLost { range_m, fraction });
            }
            out.lost_power_fraction.push(fraction);
            let factor = out.exact_free_space[i] / out.grid_free_space[i];
            let single = at.samples.iter().flat_map(|s| &s.single);
            out.monostatic_realisations
                .push(single.map(|eta| factor * eta).collect());
            out.bistatic_realisations
                .push(at.products.iter().map(|eta| factor * eta).collect());
            if is_calm {
                let point = EfficiencyPoint::exact(factor * out.grid_free_space[i]);
                out.monostatic.push(range_m, point);
                pairs.push(range_m, point);
                continue;
            }
            out.monostatic
                .push(range_m, monostatic_point(at).times(factor));
            if at.samples.len() > 1 {
                let point = bistatic_point(at, &prepared.folding, prepared.scale[i]);
                pairs.push(range_m, point.times(factor));
            }
        }
        out.bistatic = (!pairs.range_m.is_empty()).then_some(pairs);
        if let Some(screens) = &prepared.screens {
            against_theory::check(self, screens, &out)?;
        }
        Ok(out)
    }

    /// Exact free-space efficiency at each range.
    fn exact_free_space(&self) -> Result<Vec<f64>, Error> {
        let mut efficiencies = Vec::with_capacity(self.range_m.len());
        for &range_m in &self.range_m {
            efficiencies.push(theory::free_space_efficiency_misaligned(
                &self.telescope,
                &self.misalignment,
                range_m,
            )?);
        }
        Ok(efficiencies)
    }
}

/// The caller's progress function.
type ProgressFunction<'a> = dyn FnMut(Progress) -> ControlFlow<()> + Send + 'a;

/// Counts `more` realisations as done and calls the progress function, from any thread; the count
/// is under its lock, so that the reported numbers do not decrease.
fn report(
    reported: &Mutex<(usize, &mut ProgressFunction<'_>)>,
    more: usize,
    total: usize,
    relative_standard_error: f64,
) -> Result<(), Error> {
    let mut reported = reported.lock().unwrap_or_else(PoisonError::into_inner);
    reported.0 += more;
    let done = reported.0;
    let flow = (reported.1)(Progress {
        done,
        total,
        relative_standard_error,
    });
    match flow {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Error::Cancelled { realisations: done }),
    }
}

/// Efficiency of beams through the same path.
fn monostatic_point<T>(at: &RangeResult<T>) -> EfficiencyPoint {
    let (mean, variance_of_samples) = mean_and_variance(at.samples.iter().map(|s| s.same_path));
    let single = at.samples.iter().flat_map(|s| s.single.iter().copied());
    let (_, variance) = mean_and_variance(single);
    EfficiencyPoint {
        mean,
        standard_deviation: variance.sqrt(),
        standard_error: (variance_of_samples / at.samples.len() as f64).sqrt(),
    }
}

/// Efficiency of beams through independent paths; `scale` as in [`Prepared`].
fn bistatic_point<T: Real>(at: &RangeResult<T>, folding: &Folding, scale: f64) -> EfficiencyPoint {
    let last = at.planes.len() - 1;
    let total = folding.overlap(&at.planes[0], &at.planes[last]) * scale;
    let (mean, standard_error) = bistatic(&at.samples, total, folding, scale);
    let (_, variance) = mean_and_variance(at.products.iter().copied());
    EfficiencyPoint {
        mean,
        standard_deviation: variance.sqrt(),
        standard_error,
    }
}

/// Relative standard error of the monostatic mean; infinite while it is not known.
fn relative_error<T>(at: &RangeResult<T>) -> f64 {
    let point = monostatic_point(at);
    if at.samples.len() > 1 {
        point.standard_error / point.mean
    } else {
        f64::INFINITY
    }
}

/// The results of `work` in the order of `items`.
fn in_parallel<I: Sync, R: Send>(items: &[I], work: impl Fn(&I) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        items.par_iter().map(work).collect()
    }
    #[cfg(not(feature = "rayon"))]
    items.iter().map(work).collect()
}
