//! Efficiency (19) through turbulence by Monte Carlo: both receivers, every range, from one set of realisations.
//!
//! Monostatic: transmitted beam and BPLO cross the same screens; bistatic: independent ones, taken as all pairs of different
//! realisations. Realisations run in parallel in groups of fixed size, each screen with a random stream of its own, so
//! that the result has the same bits for any number of threads.
//!
//! Check: bistatic against exact theory for the very screens used, as a z-score; no turbulence gives free space with an
//! error of exactly 0.

use crate::efficiency::{EfficiencyEstimate, EfficiencyProfile};
use crate::grid::Grid;
use crate::kernel::Real;
use crate::path::{Layers, Program};
use crate::propagate::{Propagator, Transfer, TransferKind};
use crate::screen::ScreenGenerator;
use crate::source::{aperture_field, check_grid};
use crate::statistics::{Folding, Sample, bistatic, mean_and_variance};
use crate::walk::Walker;
use crate::{Error, Misalignment, Telescope, Turbulence, theory};
use rustfft::num_complex::Complex;
use std::ops::ControlFlow;

/// Realisations of one unit of work; their sums are added in order.
pub(crate) const GROUP: usize = 8;
/// Groups between two calls of the progress function (and two tests for the end).
pub(crate) const GROUPS_PER_WAVE: usize = 8;

/// How realisations are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sampling {
    /// Independent realisations.
    #[default]
    Independent,
    /// Half of the realisations see the screens of another with the opposite sign, an equally probable path: every
    /// effect odd in the phase cancels in the mean of the two. Means stay unbiased; errors are taken over such pairs.
    Antithetic,
}

/// When the Monte Carlo ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Largest number of realisations.
    pub realisations: usize,
    /// Ends earlier when the relative standard error of the monostatic mean is at most this at every range.
    pub relative_standard_error: Option<f64>,
}

impl Stop {
    /// A fixed number of realisations.
    pub fn after(realisations: usize) -> Self {
        Self { realisations, relative_standard_error: None }
    }
}

/// What the progress function is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Realisations done.
    pub done: usize,
    /// Realisations at which it ends at the latest.
    pub total: usize,
    /// Largest relative standard error of the monostatic mean over the ranges, so far.
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
    /// Layers of the path, one screen each.
    pub layers: Layers,
    /// Ranges at which the efficiency is wanted \[m\], in any order, within the layers; results come in increasing
    /// order, each range once.
    pub range_m: Vec<f64>,
    /// Transfer function of the steps.
    pub transfer: TransferKind,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How realisations are drawn.
    pub sampling: Sampling,
    /// Whether means, scatter and errors are multiplied with the ratio of exact to grid free-space efficiency.
    pub correct_grid: bool,
}

/// Sums of one group.
pub(crate) struct GroupSums<T> {
    /// Summed folded irradiance of the transmitted beam (and of the BPLO, if displaced) at each range.
    pub(crate) planes: [Vec<Vec<T>>; 2],
    /// Samples of each range.
    pub(crate) samples: Vec<Vec<Sample>>,
    /// Single products of two different realisations, at each range.
    pub(crate) products: Vec<Vec<f64>>,
}

/// Everything that is planned once and shared by all realisations.
pub(crate) struct Prepared<T: Real> {
    pub(crate) program: Program,
    pub(crate) propagator: Propagator<T>,
    pub(crate) transfers: Vec<Transfer<T>>,
    pub(crate) screens: Option<ScreenGenerator<T>>,
    /// Start fields: transmitted beam and, if displaced, BPLO.
    pub(crate) start: Vec<Vec<Complex<T>>>,
    pub(crate) folding: Folding,
    /// lambda^2 R^2 / A_R times the area of a pixel, at each range.
    pub(crate) scale: Vec<f64>,
    pub(crate) power: f64,
}

impl MonteCarlo {
    /// The chapter's set-up: 512 x 512 points of 2 mm, 10 layers out to 3 km with a range at the end of each, Table 2.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a Cn2 \[m^(-2/3)\] that is not allowed.
    pub fn chapter(cn2_m_m23: f64, seed: u64) -> Result<Self, Error> {
        let layers = Layers::equal(10, 3000.0)?;
        Ok(Self {
            telescope: Telescope::chapter(),
            misalignment: Misalignment::NONE,
            turbulence: Turbulence::chapter(cn2_m_m23)?,
            grid: Grid::chapter(),
            range_m: layers.end_m().to_vec(),
            layers,
            transfer: TransferKind::Paraxial,
            seed,
            sampling: Sampling::Independent,
            correct_grid: true,
        })
    }

    /// Runs in the number type `T` (f32 is twice as fast; its rounding is far below a Monte-Carlo error).
    ///
    /// `progress` is called between groups of realisations; `ControlFlow::Break` cancels.
    ///
    /// # Errors
    /// [`Error`] for a set-up that is not allowed, [`Error::PowerLost`], [`Error::Cancelled`].
    pub fn run<T: Real>(
        &self,
        stop: Stop,
        mut progress: impl FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<EfficiencyEstimate, Error> {
        let set_up = self.in_order();
        let prepared = set_up.prepare::<T>()?;
        set_up.run_prepared(&prepared, stop, &mut progress)
    }

    /// Mean irradiance overlap without turbulence on this very grid, at each range: the grid's free-space efficiency.
    ///
    /// # Errors
    /// As [`MonteCarlo::run`].
    pub fn grid_free_space<T: Real>(&self) -> Result<Vec<f64>, Error> {
        let calm = Self { turbulence: Turbulence::none(), ..self.in_order() };
        let prepared = calm.prepare::<T>()?;
        let sums = Walker::new(&prepared, calm.seed, calm.sampling).group(0, 1)?;
        Ok(sums.samples.iter().map(|s| s[0].same_path).collect())
    }

    /// The same run with its ranges in increasing order; one that is not a number is refused later, by name.
    fn in_order(&self) -> Self {
        let mut range_m = self.range_m.clone();
        range_m.sort_by(f64::total_cmp);
        range_m.dedup();
        Self { range_m, ..self.clone() }
    }

    pub(crate) fn prepare<T: Real>(&self) -> Result<Prepared<T>, Error> {
        let telescope = self.telescope.validated()?;
        let misalignment = self.misalignment.validated()?;
        let cn2 = self.turbulence.cn2.clone().validated()?;
        crate::efficiency::check_increasing("range_m", &self.range_m)?;
        let furthest = *self.range_m.last().ok_or(Error::Length { field: "range_m", found: 0, expected: 1 })?;
        check_grid(&telescope, &misalignment, &self.grid, furthest)?;
        let lambda = telescope.wavelength_m;
        let program = Program::compile(&self.layers, &self.range_m, &cn2, &self.grid, lambda)?;
        let propagator = Propagator::new(self.grid, lambda, self.transfer)?;
        let transfers = program.distance_m.iter().map(|&d| propagator.transfer(d)).collect::<Result<_, _>>()?;
        let screens = if program.strength.is_empty() {
            None
        } else {
            Some(ScreenGenerator::new(self.grid, self.turbulence.spectrum.clone())?)
        };
        let mut start: Vec<Vec<Complex<T>>> = vec![aperture_field(&telescope, &Misalignment::NONE, &self.grid)];
        let displaced = misalignment != Misalignment::NONE;
        if displaced {
            start.push(aperture_field(&telescope, &misalignment, &self.grid));
        }
        let pixel = self.grid.dx_m * self.grid.dy_m;
        let scale = self.range_m.iter().map(|r| (lambda * r).powi(2) / telescope.aperture_area_m2() * pixel).collect();
        let power = start[0].iter().map(|e| e.norm_sqr().wide()).sum::<f64>() * pixel;
        Ok(Prepared {
            program,
            propagator,
            transfers,
            screens,
            start,
            folding: Folding::new(&self.grid, !displaced),
            scale,
            power,
        })
    }

    pub(crate) fn run_prepared<T: Real>(
        &self,
        prepared: &Prepared<T>,
        stop: Stop,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<EfficiencyEstimate, Error> {
        if stop.realisations == 0 {
            return Err(Error::OutOfRange { field: "realisations", value: 0.0, allowed: "at least 1" });
        }
        if let Some(target) = stop.relative_standard_error {
            crate::error::positive("relative_standard_error", target)?;
        }
        // Without turbulence every realisation is the same.
        let total = if prepared.screens.is_some() { stop.realisations } else { 1 };
        let mut sums: Option<GroupSums<T>> = None;
        let mut done = 0;
        while done < total {
            let wave: Vec<(usize, usize)> = (0..GROUPS_PER_WAVE)
                .map(|g| (done + g * GROUP, (done + (g + 1) * GROUP).min(total)))
                .filter(|(a, b)| a < b)
                .collect();
            done = wave.last().map_or(total, |w| w.1);
            let walk = |&(first, end): &(usize, usize)| {
                Walker::new(prepared, self.seed, self.sampling).group(first, end - first)
            };
            for group in in_parallel(&wave, walk) {
                let group = group?;
                match &mut sums {
                    None => sums = Some(group),
                    Some(all) => all.add(group),
                }
            }
            let error = sums.as_ref().map_or(f64::INFINITY, worst_error);
            let flow = progress(Progress { done, total, relative_standard_error: error });
            if flow.is_break() {
                return Err(Error::Cancelled { realisations: done });
            }
            if stop.relative_standard_error.is_some_and(|target| error <= target) {
                break;
            }
        }
        let sums = sums.ok_or(Error::Cancelled { realisations: 0 })?;
        self.estimate(prepared, &sums, done)
    }

    fn estimate<T: Real>(
        &self,
        prepared: &Prepared<T>,
        sums: &GroupSums<T>,
        realisations: usize,
    ) -> Result<EfficiencyEstimate, Error> {
        let grid_free_space = if prepared.screens.is_some() {
            self.grid_free_space::<T>()?
        } else {
            sums.samples.iter().map(|s| s[0].same_path).collect()
        };
        let exact_free_space = self
            .range_m
            .iter()
            .map(|&r| theory::free_space_efficiency_misaligned(&self.telescope, &self.misalignment, r))
            .collect::<Result<Vec<_>, _>>()?;
        let mut lost_power_fraction = Vec::new();
        let (mut mono, mut bi) = (Columns::default(), Columns::default());
        let [mut single, mut pairs] = [Vec::new(), Vec::new()];
        for (i, samples) in sums.samples.iter().enumerate() {
            let (fraction, _) = mean_and_variance(samples.iter().map(|s| s.lost));
            if fraction.is_nan() || fraction > 0.05 {
                return Err(Error::PowerLost { range_m: self.range_m[i], fraction });
            }
            lost_power_fraction.push(fraction);
            let factor = if self.correct_grid { exact_free_space[i] / grid_free_space[i] } else { 1.0 };
            single.push(samples.iter().flat_map(|s| s.single.iter().map(|eta| factor * eta)).collect());
            pairs.push(sums.products[i].iter().map(|eta| factor * eta).collect());
            if prepared.screens.is_none() {
                mono.push(factor * grid_free_space[i], 0.0, 0.0);
                bi.push(factor * grid_free_space[i], 0.0, 0.0);
                continue;
            }
            let (mean, variance) = mean_and_variance(samples.iter().map(|s| s.same_path));
            let spread = mean_and_variance(samples.iter().flat_map(|s| s.single.iter().copied())).1.sqrt();
            mono.push(factor * mean, factor * spread, factor * (variance / samples.len() as f64).sqrt());
            if samples.len() > 1 {
                let list: Vec<&Sample> = samples.iter().collect();
                let second = if prepared.start.len() > 1 { &sums.planes[1][i] } else { &sums.planes[0][i] };
                let total = prepared.folding.overlap(&sums.planes[0][i], second) * prepared.scale[i];
                let (mean, error) = bistatic(&list, total, &prepared.folding, prepared.scale[i]);
                let spread = mean_and_variance(sums.products[i].iter().copied()).1.sqrt();
                bi.push(factor * mean, factor * spread, factor * error);
            }
        }
        let has_pairs = !bi.mean.is_empty();
        Ok(EfficiencyEstimate {
            monostatic: mono.profile(&self.range_m),
            bistatic: has_pairs.then(|| bi.profile(&self.range_m)),
            monostatic_realisations: single,
            bistatic_realisations: pairs,
            realisations: if prepared.screens.is_some() { realisations } else { 1 },
            independent_samples: sums.samples.first().map_or(0, Vec::len),
            grid_free_space,
            exact_free_space,
            lost_power_fraction,
        })
    }
}

#[derive(Default)]
struct Columns {
    mean: Vec<f64>,
    standard_deviation: Vec<f64>,
    standard_error: Vec<f64>,
}

impl Columns {
    fn push(&mut self, mean: f64, standard_deviation: f64, standard_error: f64) {
        self.mean.push(mean);
        self.standard_deviation.push(standard_deviation);
        self.standard_error.push(standard_error);
    }

    fn profile(self, range_m: &[f64]) -> EfficiencyProfile {
        EfficiencyProfile {
            range_m: range_m.to_vec(),
            mean: self.mean,
            standard_deviation: self.standard_deviation,
            standard_error: self.standard_error,
        }
    }
}

impl<T: Real> GroupSums<T> {
    fn add(&mut self, other: Self) {
        for (mine, theirs) in self.planes.iter_mut().flatten().zip(other.planes.into_iter().flatten()) {
            for (a, b) in mine.iter_mut().zip(theirs) {
                *a = *a + b;
            }
        }
        for (mine, theirs) in self.samples.iter_mut().zip(other.samples) {
            mine.extend(theirs);
        }
        for (mine, theirs) in self.products.iter_mut().zip(other.products) {
            mine.extend(theirs);
        }
    }
}

/// Largest relative standard error of the monostatic mean over the ranges.
fn worst_error<T>(sums: &GroupSums<T>) -> f64 {
    sums.samples.iter().fold(0.0, |worst, samples| {
        let (mean, variance) = mean_and_variance(samples.iter().map(|s| s.same_path));
        let relative = (variance / samples.len() as f64).sqrt() / mean;
        if samples.len() > 1 { worst.max(relative) } else { f64::INFINITY }
    })
}

/// The results of `work` in the order of `items`.
#[cfg(feature = "rayon")]
fn in_parallel<I: Sync, R: Send>(items: &[I], work: impl Fn(&I) -> R + Sync + Send) -> Vec<R> {
    use rayon::prelude::*;
    items.par_iter().map(work).collect()
}

/// The results of `work` in the order of `items`.
#[cfg(not(feature = "rayon"))]
fn in_parallel<I, R>(items: &[I], work: impl Fn(&I) -> R) -> Vec<R> {
    items.iter().map(work).collect()
}
