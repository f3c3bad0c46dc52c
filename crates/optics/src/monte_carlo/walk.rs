//! One group of realisations carried along the path, two at a time, and what they leave at each range.
//!
//! Check: the Monte-Carlo tests; a group does not depend on which other groups exist.

use crate::Error;
use crate::monte_carlo::path::{Leg, Path};
use crate::monte_carlo::statistics::{Folding, Sample};
use crate::screens::generator::{ScreenGenerator, stream};
use crate::screens::grid::Work;
use crate::screens::kernel::{self, Real};
use crate::screens::propagate::{Propagator, Transfer};
use rustfft::num_complex::Complex;

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

/// What the realisations of a group, or of all groups, left at one range.
pub(crate) struct AtRange<T> {
    /// Summed folded irradiance of the transmitted beam (and of the BPLO, if displaced).
    pub(crate) planes: Vec<Vec<T>>,
    pub(crate) samples: Vec<Sample>,
    /// Single products of two different realisations.
    pub(crate) products: Vec<f64>,
    /// Marks of either realisation of a pair that wait for their antithetic partners.
    waiting: [Vec<Mark<T>>; 2],
}

/// What one realisation left at one range, before the two of an antithetic pair are joined.
struct Mark<T> {
    same_path: f64,
    lost: f64,
    planes: Vec<Vec<T>>,
}

/// Fields of both beams at one place (transmitted beam, and BPLO if displaced), and the power of the first.
struct Beams<T: Real> {
    fields: Vec<Vec<Complex<T>>>,
    power: f64,
}

/// One realisation under way: its beams here, those at a range that the last step passed, and its two screens at hand.
struct Realisation<T: Real> {
    here: Beams<T>,
    passed: Beams<T>,
    screens: [Vec<T>; 2],
    /// Synthesis that filled `screens`.
    synthesis: Option<usize>,
    stream: u64,
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

impl<T: Real> AtRange<T> {
    /// Adds what the next group left.
    pub(crate) fn add(&mut self, other: Self) {
        for (mine, theirs) in self
            .planes
            .iter_mut()
            .flatten()
            .zip(other.planes.into_iter().flatten())
        {
            *mine = *mine + theirs;
        }
        self.samples.extend(other.samples);
        self.products.extend(other.products);
    }

    /// Joins the marks of each realisation of a pair, those of partners side by side, into one sample and adds them up.
    fn collect(&mut self, folding: &Folding, scale: f64) {
        for marks in &mut self.waiting {
            let count = marks.len() as f64;
            let single: Vec<f64> = marks.iter().map(|m| m.same_path).collect();
            let lost = marks.iter().map(|m| m.lost).sum::<f64>() / count;
            let Some(Mark { mut planes, .. }) = marks.pop() else {
                continue;
            };
            for other in marks.drain(..) {
                for (a, b) in planes
                    .iter_mut()
                    .flatten()
                    .zip(other.planes.into_iter().flatten())
                {
                    *a = (*a + b) * T::of(0.5);
                }
            }
            let rings = |plane: &Vec<T>| {
                folding
                    .ring_sums(plane)
                    .iter()
                    .map(|&v| v as f32)
                    .collect::<Vec<f32>>()
            };
            self.samples.push(Sample {
                same_path: single.iter().sum::<f64>() / count,
                single,
                folded: folding.overlap(&planes[0], &planes[planes.len() - 1]) * scale,
                rings: [
                    rings(&planes[0]),
                    planes.get(1).map_or_else(Vec::new, rings),
                ],
                lost,
            });
            for (t, p) in self
                .planes
                .iter_mut()
                .flatten()
                .zip(planes.iter().flatten())
            {
                *t = *t + *p;
            }
        }
    }
}

impl<'a, T: Real> Walker<'a, T> {
    pub(crate) fn new(prepared: &'a Prepared<T>, seed: u64, sampling: Sampling) -> Self {
        let grid = prepared.propagator.grid();
        let (count, points) = if prepared.screens.is_some() {
            (2, grid.points())
        } else {
            (1, 0)
        };
        let beams = || Beams {
            fields: prepared.start.clone(),
            power: prepared.power,
        };
        let realisation = |_| Realisation {
            here: beams(),
            passed: beams(),
            screens: [vec![T::zero(); points], vec![T::zero(); points]],
            synthesis: None,
            stream: 0,
            sign: 1.0,
        };
        Self {
            prepared,
            seed,
            sampling,
            work: prepared.propagator.work(),
            screen_work: prepared.screens.as_ref().map(|s| s.work()),
            pair: (0..count).map(realisation).collect(),
            rows: std::array::from_fn(|_| vec![T::zero(); grid.nx]),
        }
    }

    /// Realisations `first` to `first + count`, two side by side: what they leave at each range. `watch` is told after each leg how many
    /// have come to the end of the path, and may end the walk.
    pub(crate) fn group(
        mut self,
        first: usize,
        count: usize,
        watch: &(dyn Fn(usize) -> Result<(), Error> + Sync),
    ) -> Result<Vec<AtRange<T>>, Error> {
        let Prepared {
            path,
            scale,
            folding,
            start,
            ..
        } = self.prepared;
        let nothing = |_| AtRange {
            planes: vec![vec![T::zero(); folding.points()]; start.len()],
            samples: Vec::new(),
            products: Vec::new(),
            waiting: [Vec::new(), Vec::new()],
        };
        let mut ranges: Vec<AtRange<T>> = scale.iter().map(nothing).collect();
        for pair in (first..first + count).step_by(2) {
            let active = (first + count - pair).min(self.pair.len());
            for which in 0..active {
                self.begin(which, (pair + which) as u64);
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
                watch(0)?;
            }
            watch(active)?;
        }
        Ok(ranges)
    }

    fn begin(&mut self, which: usize, index: u64) {
        let state = &mut self.pair[which];
        for (field, start) in state.here.fields.iter_mut().zip(&self.prepared.start) {
            field.copy_from_slice(start);
        }
        state.synthesis = None;
        (state.stream, state.sign) = match self.sampling {
            Sampling::Independent => (index, 1.0),
            // Order +A +B -A -B: neighbours are independent.
            Sampling::Antithetic => (
                index / 4 * 4 + index % 2,
                if index % 4 < 2 { 1.0 } else { -1.0 },
            ),
        };
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
            here,
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
        for beam in (0..here.fields.len()).rev() {
            let (field, mut screen) = (&mut here.fields[beam], screen);
            if let Some((_, distance)) = leg.tap {
                let steps = [&transfers[distance], step];
                [passed.power, here.power] = propagator.step_with_tap(
                    field,
                    &mut passed.fields[beam],
                    screen,
                    steps,
                    &mut self.work,
                )?;
                continue;
            }
            for _ in 0..leg.times {
                here.power = propagator.step(field, screen.take(), step, &mut self.work)?;
            }
        }
        Ok(())
    }

    /// Overlaps and folded planes of the realisations at a range, and the product of the two.
    fn measure(&mut self, range: usize, active: usize, is_passed: bool, at: &mut AtRange<T>) {
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
        let (nx, ny) = (prepared.propagator.grid().nx, prepared.propagator.grid().ny);
        let last = start.len() - 1;
        let beams: Vec<_> = pair[..active]
            .iter()
            .map(|one| if is_passed { &one.passed } else { &one.here })
            .collect();
        let mark = |beams: &&Beams<T>| Mark {
            same_path: 0.0,
            lost: 1.0 - beams.power / prepared.power,
            planes: vec![vec![T::zero(); folding.points()]; start.len()],
        };
        let mut marks: Vec<Mark<T>> = beams.iter().map(mark).collect();
        let mut product = 0.0;
        for y in 0..ny {
            for (which, (beams, mark)) in beams.iter().zip(&mut marks).enumerate() {
                for (beam, field) in beams.fields.iter().enumerate() {
                    let row = &mut rows[2 * which + beam];
                    kernel::intensity(&field[y * nx..(y + 1) * nx], row);
                    folding.add_row(y, row, &mut mark.planes[beam]);
                }
                mark.same_path += kernel::dot(&rows[2 * which], &rows[2 * which + last]);
            }
            if active == 2 {
                product += 0.5 * kernel::dot(&rows[0], &rows[2 + last]);
                product += 0.5 * kernel::dot(&rows[2], &rows[last]);
            }
        }
        for (waiting, mut mark) in at.waiting.iter_mut().zip(marks) {
            mark.same_path *= scale[range];
            waiting.push(mark);
        }
        at.products
            .extend((active == 2).then_some(product * scale[range]));
    }
}
