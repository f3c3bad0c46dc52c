//! One group of realisations propagated along the path, two at a time, and their results at each
//! range.
//!
//! Check: the Monte-Carlo tests; a group does not depend on which other groups exist.

use crate::Error;
use crate::monte_carlo::path::{Leg, Path};
use crate::monte_carlo::statistics::{Folding, Sample};
use crate::screens::generator::{ScreenGenerator, stream};
use crate::screens::grid::{Grid, Work};
use crate::screens::kernel::{self, Real};
use crate::screens::propagate::{Propagator, Transfer};
use rustfft::num_complex::Complex;

/// How realisations are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sampling {
    /// Independent realisations.
    #[default]
    Independent,
    /// Half of the realisations have the screens of another with the opposite sign, an equally
    /// probable path: every effect odd in the phase cancels in the mean of the two. Means stay
    /// unbiased; errors are computed over such pairs.
    Antithetic,
}

/// Everything that is planned once and shared by all realisations.
pub(crate) struct Prepared<T: Real> {
    pub(crate) path: Path,
    pub(crate) propagator: Propagator<T>,
    pub(crate) transfers: Vec<Transfer<T>>,
    /// None without turbulence.
    pub(crate) screens: Option<ScreenGenerator<T>>,
    /// Start fields: transmitted beam and, if displaced, BPLO.
    pub(crate) start: Vec<Vec<Complex<T>>>,
    pub(crate) folding: Folding,
    /// lambda^2 R^2 / A_R times the area of a pixel, at each range.
    pub(crate) scale: Vec<f64>,
    pub(crate) power: f64,
}

/// Results of the realisations of a group, or of all groups, at one range.
pub(crate) struct RangeResult<T> {
    /// Summed folded irradiance of the transmitted beam (and of the BPLO, if displaced).
    pub(crate) planes: Vec<Vec<T>>,
    pub(crate) samples: Vec<Sample>,
    /// Single products of two different realisations.
    pub(crate) products: Vec<f64>,
    /// Results of either realisation of a pair that are not yet joined with those of their
    /// antithetic partners.
    waiting: [Vec<RealisationResult<T>>; 2],
}

/// Results of one realisation at one range.
struct RealisationResult<T> {
    same_path: f64,
    lost: f64,
    planes: Vec<Vec<T>>,
}

/// Fields of both beams at one position (transmitted beam, and BPLO if displaced), and the power of
/// the first.
#[derive(Clone)]
struct Beams<T: Real> {
    fields: Vec<Vec<Complex<T>>>,
    power: f64,
}

/// State of one realisation along the path.
struct Realisation<T: Real> {
    /// Beams after the last step.
    current: Beams<T>,
    /// Beams at the range that the last step passed.
    passed: Beams<T>,
    /// The two screens of `synthesis`.
    screens: [Vec<T>; 2],
    synthesis: Option<usize>,
    /// Random stream of the screens.
    stream: u64,
    /// Sign of the screens, 1 or -1.
    sign: f64,
}

/// Buffers of one thread's realisations.
pub(crate) struct Walker<'a, T: Real> {
    prepared: &'a Prepared<T>,
    seed: u64,
    sampling: Sampling,
    work: Work<T>,
    screen_work: Option<Work<T>>,
    pair: Vec<Realisation<T>>,
    rows: [Vec<T>; 4],
}

impl<T: Real> RangeResult<T> {
    /// No results of `beams` beams on planes of `points` points.
    fn empty(beams: usize, points: usize) -> Self {
        Self {
            planes: vec![vec![T::zero(); points]; beams],
            samples: Vec::new(),
            products: Vec::new(),
            waiting: [Vec::new(), Vec::new()],
        }
    }

    /// Adds the results of the next group.
    pub(crate) fn add(&mut self, other: Self) {
        for (sum, plane) in self.planes.iter_mut().zip(other.planes) {
            for (s, value) in sum.iter_mut().zip(plane) {
                *s = *s + value;
            }
        }
        self.samples.extend(other.samples);
        self.products.extend(other.products);
    }

    /// Joins the waiting results of antithetic partners into one sample for each realisation of a
    /// pair, and adds them to the sums.
    fn collect(&mut self, folding: &Folding, scale: f64) {
        for results in &mut self.waiting {
            let count = results.len() as f64;
            let single: Vec<f64> = results.iter().map(|r| r.same_path).collect();
            let lost = results.iter().map(|r| r.lost).sum::<f64>() / count;
            let Some(RealisationResult { mut planes, .. }) = results.pop() else {
                continue;
            };
            for partner in results.drain(..) {
                for (plane, other) in planes.iter_mut().zip(partner.planes) {
                    for (a, b) in plane.iter_mut().zip(other) {
                        *a = (*a + b) * T::of(0.5);
                    }
                }
            }
            self.samples.push(Sample {
                same_path: single.iter().sum::<f64>() / count,
                single,
                folded: folding.overlap(&planes[0], &planes[planes.len() - 1]) * scale,
                rings: [
                    single_ring_sums(folding, &planes[0]),
                    planes
                        .get(1)
                        .map_or_else(Vec::new, |plane| single_ring_sums(folding, plane)),
                ],
                lost,
            });
            for (sum, plane) in self.planes.iter_mut().zip(&planes) {
                for (s, value) in sum.iter_mut().zip(plane) {
                    *s = *s + *value;
                }
            }
        }
    }
}

/// Ring sums of a folded plane in single precision.
fn single_ring_sums<T: Real>(folding: &Folding, plane: &[T]) -> Vec<f32> {
    let sums = folding.ring_sums(plane);
    sums.iter().map(|&sum| sum as f32).collect()
}

impl<'a, T: Real> Walker<'a, T> {
    pub(crate) fn new(prepared: &'a Prepared<T>, seed: u64, sampling: Sampling) -> Self {
        let grid = prepared.propagator.grid();
        // Without turbulence all realisations are the same.
        let is_turbulent = prepared.screens.is_some();
        let count = if is_turbulent { 2 } else { 1 };
        let points = if is_turbulent { grid.points() } else { 0 };
        let mut pair = Vec::with_capacity(count);
        for _ in 0..count {
            let beams = Beams {
                fields: prepared.start.clone(),
                power: prepared.power,
            };
            pair.push(Realisation {
                current: beams.clone(),
                passed: beams,
                screens: [vec![T::zero(); points], vec![T::zero(); points]],
                synthesis: None,
                stream: 0,
                sign: 1.0,
            });
        }
        Self {
            prepared,
            seed,
            sampling,
            work: prepared.propagator.work(),
            screen_work: prepared.screens.as_ref().map(|s| s.work()),
            pair,
            rows: std::array::from_fn(|_| vec![T::zero(); grid.nx]),
        }
    }

    /// Propagates realisations `first` to `first + count`, two side by side, and returns their
    /// results at each range. After each leg `report` is called with the number of realisations
    /// that have reached the end of the path; its error ends the walk.
    pub(crate) fn run_group(
        mut self,
        first: usize,
        count: usize,
        report: &(dyn Fn(usize) -> Result<(), Error> + Sync),
    ) -> Result<Vec<RangeResult<T>>, Error> {
        let Prepared {
            path,
            scale,
            folding,
            start,
            ..
        } = self.prepared;
        let mut ranges: Vec<RangeResult<T>> = Vec::with_capacity(scale.len());
        for _ in scale {
            ranges.push(RangeResult::empty(start.len(), folding.points()));
        }
        for pair in (first..first + count).step_by(2) {
            let active = (first + count - pair).min(self.pair.len());
            for which in 0..active {
                self.start_realisation(which, (pair + which) as u64);
            }
            let waits = self.sampling == Sampling::Antithetic
                && (pair / 2) % 2 == 0
                && pair + 2 < first + count;
            for leg in &path.legs {
                for which in 0..active {
                    self.propagate(which, leg)?;
                }
                for (range, is_passed) in leg.ranges() {
                    self.measure(range, active, is_passed, &mut ranges[range]);
                    if !waits {
                        ranges[range].collect(folding, scale[range]);
                    }
                }
                report(0)?;
            }
            report(active)?;
        }
        Ok(ranges)
    }

    /// Sets one of the pair to the start of realisation `index`.
    fn start_realisation(&mut self, which: usize, index: u64) {
        let state = &mut self.pair[which];
        for (field, start) in state.current.fields.iter_mut().zip(&self.prepared.start) {
            field.copy_from_slice(start);
        }
        state.synthesis = None;
        match self.sampling {
            Sampling::Independent => {
                state.stream = index;
                state.sign = 1.0;
            }
            Sampling::Antithetic => {
                // Order +A +B -A -B: neighbours are independent.
                state.stream = index / 4 * 4 + index % 2;
                state.sign = if index % 4 < 2 { 1.0 } else { -1.0 };
            }
        }
    }

    /// One leg of a realisation, (16): the screen, then free space, past a range or in equal steps.
    fn propagate(&mut self, which: usize, leg: &Leg) -> Result<(), Error> {
        let Prepared {
            path,
            propagator,
            transfers,
            screens: generator,
            ..
        } = self.prepared;
        let Realisation {
            current,
            passed,
            screens,
            synthesis,
            stream: key,
            sign,
        } = &mut self.pair[which];
        if let (Some(layer), Some(generator), Some(work)) =
            (leg.screen, generator, &mut self.screen_work)
        {
            // Two layers share one synthesis.
            if synthesis.replace(layer / 2) != Some(layer / 2) {
                let [first, second] = &mut *screens;
                generator.fill_pair(
                    &mut stream(self.seed, *key, (layer / 2) as u64),
                    work,
                    first,
                    second,
                )?;
            }
        }
        let screen = leg
            .screen
            .map(|layer| (&screens[layer % 2][..], T::of(*sign * path.strength[layer])));
        let step = &transfers[leg.distance];
        for beam in (0..current.fields.len()).rev() {
            let field = &mut current.fields[beam];
            if let Some(tap) = leg.tap {
                let steps = [&transfers[tap], step];
                [passed.power, current.power] = propagator.step_with_tap(
                    field,
                    &mut passed.fields[beam],
                    screen,
                    steps,
                    &mut self.work,
                )?;
                continue;
            }
            // The screen is at the start of the first step.
            let mut screen = screen;
            for _ in 0..leg.times {
                current.power = propagator.step(field, screen.take(), step, &mut self.work)?;
            }
        }
        Ok(())
    }

    /// Overlaps and folded planes of the realisations at a range, and the product of the two.
    fn measure(
        &mut self,
        range: usize,
        active: usize,
        is_passed: bool,
        found: &mut RangeResult<T>,
    ) {
        let Self {
            prepared,
            pair,
            rows,
            ..
        } = self;
        let Prepared {
            folding,
            start,
            scale,
            ..
        } = prepared;
        let Grid { nx, ny, .. } = *prepared.propagator.grid();
        let last = start.len() - 1;
        let mut beams = Vec::with_capacity(active);
        let mut results = Vec::with_capacity(active);
        for realisation in &pair[..active] {
            let Beams { fields, power } = if is_passed {
                &realisation.passed
            } else {
                &realisation.current
            };
            beams.push(fields);
            results.push(RealisationResult {
                same_path: 0.0,
                lost: 1.0 - power / prepared.power,
                planes: vec![vec![T::zero(); folding.points()]; start.len()],
            });
        }
        let mut product = 0.0;
        for y in 0..ny {
            for (which, (fields, result)) in beams.iter().zip(&mut results).enumerate() {
                for (beam, field) in fields.iter().enumerate() {
                    let row = &mut rows[2 * which + beam];
                    kernel::intensity(&field[y * nx..(y + 1) * nx], row);
                    folding.add_row(y, row, &mut result.planes[beam]);
                }
                result.same_path += kernel::dot(&rows[2 * which], &rows[2 * which + last]);
            }
            if active == 2 {
                product += 0.5 * kernel::dot(&rows[0], &rows[2 + last]);
                product += 0.5 * kernel::dot(&rows[2], &rows[last]);
            }
        }
        for (waiting, mut result) in found.waiting.iter_mut().zip(results) {
            result.same_path *= scale[range];
            waiting.push(result);
        }
        if active == 2 {
            found.products.push(product * scale[range]);
        }
    }
}
