//! One group of realisations carried along the path, two at a time, and what they leave at each range.
//!
//! Check: the Monte-Carlo tests; a group does not depend on which other groups exist.

use crate::Error;
use crate::monte_carlo::path::Leg;
use crate::monte_carlo::prepared::Prepared;
use crate::monte_carlo::statistics::Sample;
use crate::screens::generator::{ScreenWork, stream};
use crate::screens::kernel::Real;
use crate::screens::propagate::PropagatorWork;
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

/// Sums of one group.
pub(crate) struct GroupSums<T> {
    /// Summed folded irradiance of the transmitted beam (and of the BPLO, if displaced) at each range.
    pub(crate) planes: [Vec<Vec<T>>; 2],
    /// Samples of each range.
    pub(crate) samples: Vec<Vec<Sample>>,
    /// Single products of two different realisations, at each range.
    pub(crate) products: Vec<Vec<f64>>,
}

impl<T: Real> GroupSums<T> {
    /// Adds the sums of the next group.
    pub(crate) fn add(&mut self, other: Self) {
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

/// Buffers of one thread's realisations.
pub(crate) struct Walker<'a, T: Real> {
    prepared: &'a Prepared<T>,
    seed: u64,
    sampling: Sampling,
    work: PropagatorWork<T>,
    screen_work: Option<ScreenWork<T>>,
    lanes: Vec<Lane<T>>,
    rows: [Vec<T>; 4],
}

/// Fields of both beams at one place (transmitted beam, and BPLO if displaced), and the power of the first.
struct Fields<T: Real> {
    beams: Vec<Vec<Complex<T>>>,
    power: f64,
}

/// One realisation under way: its fields, those that a tap leaves, and its two screens at hand.
struct Lane<T: Real> {
    here: Fields<T>,
    tap: Fields<T>,
    screens: [Vec<T>; 2],
    /// Synthesis that filled `screens`.
    synthesis: Option<usize>,
    stream: u64,
    sign: f64,
}

/// What one realisation left at one range, before the two of an antithetic pair are joined.
struct Mark<T> {
    same_path: f64,
    lost: f64,
    planes: Vec<Vec<T>>,
}

impl<'a, T: Real> Walker<'a, T> {
    pub(crate) fn new(prepared: &'a Prepared<T>, seed: u64, sampling: Sampling) -> Self {
        let grid = prepared.propagator.grid();
        let empty = || vec![T::zero(); if prepared.screens.is_some() { grid.points() } else { 0 }];
        let count = if prepared.screens.is_some() { 2 } else { 1 };
        let fields = || Fields { beams: prepared.start.clone(), power: prepared.power };
        let lane = || Lane {
            here: fields(),
            tap: fields(),
            screens: [empty(), empty()],
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
            lanes: (0..count).map(|_| lane()).collect(),
            rows: std::array::from_fn(|_| vec![T::zero(); grid.nx]),
        }
    }

    /// Realisations `first` to `first + count`, two side by side.
    pub(crate) fn group(mut self, first: usize, count: usize) -> Result<GroupSums<T>, Error> {
        let prepared = self.prepared;
        let outputs = prepared.scale.len();
        let zero = |on: bool| vec![vec![T::zero(); prepared.folding.points()]; if on { outputs } else { 0 }];
        let mut sums = GroupSums {
            planes: [zero(true), zero(prepared.start.len() > 1)],
            samples: vec![Vec::new(); outputs],
            products: vec![Vec::new(); outputs],
        };
        // Marks of the two lanes, kept until their antithetic partners come.
        let mut waiting: Vec<Vec<Vec<Mark<T>>>> = (0..outputs).map(|_| Vec::new()).collect();
        for pair in (first..first + count).step_by(2) {
            let active = (first + count - pair).min(self.lanes.len());
            for lane in 0..active {
                self.start_lane(lane, (pair + lane) as u64);
            }
            let waits = self.sampling == Sampling::Antithetic && (pair / 2) % 2 == 0 && pair + 2 < first + count;
            for leg in &prepared.path.legs {
                for lane in 0..active {
                    self.propagate(lane, leg)?;
                }
                let tapped = leg.tap.map(|(output, _)| (output, true));
                for (output, is_tap) in tapped.into_iter().chain(leg.outputs.iter().map(|&output| (output, false))) {
                    let (marks, product) = self.measure(output, active, is_tap);
                    sums.products[output].extend(product);
                    waiting[output].push(marks);
                    if !waits {
                        self.collect(output, std::mem::take(&mut waiting[output]), &mut sums);
                    }
                }
            }
        }
        Ok(sums)
    }

    fn start_lane(&mut self, lane: usize, realisation: u64) {
        let state = &mut self.lanes[lane];
        for (field, start) in state.here.beams.iter_mut().zip(&self.prepared.start) {
            field.copy_from_slice(start);
        }
        state.synthesis = None;
        (state.stream, state.sign) = match self.sampling {
            Sampling::Independent => (realisation, 1.0),
            // Order +A +B -A -B: neighbours are independent.
            Sampling::Antithetic => {
                let first = realisation / 4 * 4 + realisation % 2;
                (first, if realisation % 4 < 2 { 1.0 } else { -1.0 })
            }
        };
    }

    /// One leg of a lane: the screen, then free space, past a tap or in equal steps.
    fn propagate(&mut self, lane: usize, leg: &Leg) -> Result<(), Error> {
        let Self { prepared, work, .. } = self;
        let state = &mut self.lanes[lane];
        if let (Some(layer), Some(generator), Some(work)) = (leg.screen, &prepared.screens, &mut self.screen_work) {
            // Two layers share one synthesis.
            if state.synthesis.replace(layer / 2) != Some(layer / 2) {
                let [first, second] = &mut state.screens;
                generator.fill_pair(&mut stream(self.seed, state.stream, (layer / 2) as u64), work, first, second)?;
            }
        }
        let Lane { here, tap, screens, sign, .. } = state;
        let phase = |layer: usize| (&screens[layer % 2][..], T::of(*sign * prepared.path.strength[layer]));
        let step = &prepared.transfers[leg.distance];
        for beam in (0..here.beams.len()).rev() {
            let field = &mut here.beams[beam];
            let mut screen = leg.screen.map(phase);
            if let Some((_, distance)) = leg.tap {
                let steps = [&prepared.transfers[distance], step];
                [tap.power, here.power] =
                    prepared.propagator.step_with_tap(field, &mut tap.beams[beam], screen, steps, work)?;
                continue;
            }
            for _ in 0..leg.times {
                here.power = prepared.propagator.step(field, screen.take(), step, work)?;
            }
        }
        Ok(())
    }

    /// Overlaps and folded planes of the lanes at an output, and the product of the two lanes.
    fn measure(&mut self, output: usize, active: usize, is_tap: bool) -> (Vec<Mark<T>>, Option<f64>) {
        let Self { prepared, lanes, rows, .. } = self;
        let (nx, ny) = (prepared.propagator.grid().nx, prepared.propagator.grid().ny);
        let beams = prepared.start.len();
        let fields: Vec<&Fields<T>> = lanes[..active].iter().map(|l| if is_tap { &l.tap } else { &l.here }).collect();
        let mut marks: Vec<Mark<T>> = fields
            .iter()
            .map(|fields| Mark {
                same_path: 0.0,
                lost: 1.0 - fields.power / prepared.power,
                planes: vec![vec![T::zero(); prepared.folding.points()]; beams],
            })
            .collect();
        let mut product = 0.0;
        for y in 0..ny {
            for (lane, (fields, mark)) in fields.iter().zip(&mut marks).enumerate() {
                for beam in 0..beams {
                    let row = &mut rows[2 * lane + beam];
                    T::intensity(&fields.beams[beam][y * nx..(y + 1) * nx], T::one(), row);
                    prepared.folding.add_row(y, row, &mut mark.planes[beam]);
                }
                mark.same_path += T::dot(&rows[2 * lane], &rows[2 * lane + beams - 1]);
            }
            if active == 2 {
                product += 0.5 * T::dot(&rows[0], &rows[1 + beams]);
                product += 0.5 * T::dot(&rows[2], &rows[beams - 1]);
            }
        }
        for mark in &mut marks {
            mark.same_path *= prepared.scale[output];
        }
        (marks, (active == 2).then_some(product * prepared.scale[output]))
    }

    /// Joins the marks of each lane, those of partners side by side, into one sample and adds them up.
    fn collect(&self, output: usize, marks: Vec<Vec<Mark<T>>>, sums: &mut GroupSums<T>) {
        let folding = &self.prepared.folding;
        let mut lanes: [Vec<Mark<T>>; 2] = [Vec::new(), Vec::new()];
        for side_by_side in marks {
            for (lane, mark) in lanes.iter_mut().zip(side_by_side) {
                lane.push(mark);
            }
        }
        for mut marks in lanes {
            let count = marks.len() as f64;
            let single: Vec<f64> = marks.iter().map(|m| m.same_path).collect();
            let lost = marks.iter().map(|m| m.lost).sum::<f64>() / count;
            let Some(mut joined) = marks.pop() else { continue };
            for other in marks {
                for (a, b) in joined.planes.iter_mut().flatten().zip(other.planes.into_iter().flatten()) {
                    *a = (*a + b) * T::of(0.5);
                }
            }
            let last = joined.planes.len() - 1;
            let folded = folding.overlap(&joined.planes[0], &joined.planes[last]) * self.prepared.scale[output];
            let rings = |plane: &Vec<T>| folding.ring_sums(plane).iter().map(|&v| v as f32).collect::<Vec<f32>>();
            let second = if last > 0 { rings(&joined.planes[1]) } else { Vec::new() };
            sums.samples[output].push(Sample {
                same_path: single.iter().sum::<f64>() / count,
                single,
                folded,
                rings: [rings(&joined.planes[0]), second],
                lost,
            });
            for (total, plane) in sums.planes.iter_mut().zip(&joined.planes) {
                for (t, p) in total[output].iter_mut().zip(plane) {
                    *t = *t + *p;
                }
            }
        }
    }
}
