//! One group of realisations carried along the path, two at a time, and what they leave at each range.
//!
//! Check: the Monte-Carlo tests; a group does not depend on which other groups exist.

use crate::Error;
use crate::monte_carlo::path::{Branch, Op};
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

/// One realisation under way: its fields (transmitted beam, and BPLO if displaced) and its two screens at hand.
struct Lane<T: Real> {
    fields: Vec<Vec<Complex<T>>>,
    /// Fields that a tap leaves.
    taps: Vec<Vec<Complex<T>>>,
    power: Vec<f64>,
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

/// Output, marks of the lanes, and the product of two different realisations.
type Measured<T> = (usize, Vec<Mark<T>>, Option<f64>);

impl<'a, T: Real> Walker<'a, T> {
    pub(crate) fn new(prepared: &'a Prepared<T>, seed: u64, sampling: Sampling) -> Self {
        let grid = prepared.propagator.grid();
        let empty = || vec![T::zero(); if prepared.screens.is_some() { grid.points() } else { 0 }];
        let count = if prepared.screens.is_some() { 2 } else { 1 };
        let lanes = (0..count)
            .map(|_| Lane {
                fields: prepared.start.clone(),
                taps: prepared.start.clone(),
                power: vec![prepared.power; prepared.start.len()],
                screens: [empty(), empty()],
                synthesis: None,
                stream: 0,
                sign: 1.0,
            })
            .collect();
        Self {
            prepared,
            seed,
            sampling,
            work: prepared.propagator.work(),
            screen_work: prepared.screens.as_ref().map(|s| s.work()),
            lanes,
            rows: std::array::from_fn(|_| vec![T::zero(); grid.nx]),
        }
    }

    /// Realisations `first` to `first + count`, two side by side.
    pub(crate) fn group(mut self, first: usize, count: usize) -> Result<GroupSums<T>, Error> {
        let outputs = self.prepared.scale.len();
        let points = self.prepared.folding.points();
        let beams = self.prepared.start.len();
        let zero = |on: bool| if on { vec![vec![T::zero(); points]; outputs] } else { Vec::new() };
        let mut sums = GroupSums {
            planes: [zero(true), zero(beams > 1)],
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
            let partner = self.sampling == Sampling::Antithetic && (pair / 2) % 2 == 1;
            for op in &self.prepared.program.ops {
                if let Some((output, marks, product)) = self.execute(*op, active)? {
                    sums.products[output].extend(product);
                    waiting[output].push(marks);
                    let more = self.sampling == Sampling::Antithetic && !partner && pair + 2 < first + count;
                    if !more {
                        let marks = std::mem::take(&mut waiting[output]);
                        self.collect(output, marks, &mut sums);
                    }
                }
            }
        }
        Ok(sums)
    }

    fn start_lane(&mut self, lane: usize, realisation: u64) {
        let state = &mut self.lanes[lane];
        for (field, start) in state.fields.iter_mut().zip(&self.prepared.start) {
            field.copy_from_slice(start);
        }
        state.power.fill(self.prepared.power);
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

    /// Makes sure that the lane holds the screen of `layer`; two layers share one synthesis.
    fn fetch_screen(&mut self, lane: usize, layer: usize) -> Result<(), Error> {
        let (Some(generator), Some(work)) = (&self.prepared.screens, &mut self.screen_work) else {
            return Ok(());
        };
        let state = &mut self.lanes[lane];
        if state.synthesis != Some(layer / 2) {
            state.synthesis = Some(layer / 2);
            let mut rng = stream(self.seed, state.stream, (layer / 2) as u64);
            let [first, second] = &mut state.screens;
            generator.fill_pair(&mut rng, work, first, second)?;
        }
        Ok(())
    }

    fn execute(&mut self, op: Op, active: usize) -> Result<Option<Measured<T>>, Error> {
        let strength = &self.prepared.program.strength;
        match op {
            Op::Step { screen, transfer, times } => {
                for lane in 0..active {
                    if let Some(layer) = screen {
                        self.fetch_screen(lane, layer)?;
                    }
                    let state = &mut self.lanes[lane];
                    for (field, power) in state.fields.iter_mut().zip(&mut state.power) {
                        for time in 0..times {
                            let at_hand = screen.filter(|_| time == 0);
                            let phase = at_hand.map(|layer| phase(&state.screens, layer, state.sign * strength[layer]));
                            let transfer = &self.prepared.transfers[transfer];
                            *power = self.prepared.propagator.step(field, phase, transfer, &mut self.work)?;
                        }
                    }
                }
                Ok(None)
            }
            Op::Tap { screen, transfers, output } => {
                let mut kept = Vec::with_capacity(active);
                for lane in 0..active {
                    kept.push(self.tap(lane, screen, transfers)?);
                }
                let (marks, product) = self.measure(output, active);
                for (state, power) in self.lanes.iter_mut().zip(kept) {
                    std::mem::swap(&mut state.fields, &mut state.taps);
                    state.power = power;
                }
                Ok(Some((output, marks, product)))
            }
            Op::Output { output } => {
                let (marks, product) = self.measure(output, active);
                Ok(Some((output, marks, product)))
            }
            Op::Branch(branch) => self.branch(branch, active).map(Some),
        }
    }

    /// A step of one lane with a tap, after which the tapped fields stand in the place of the fields; the powers at the end.
    fn tap(&mut self, lane: usize, screen: Option<usize>, transfers: [usize; 2]) -> Result<Vec<f64>, Error> {
        if let Some(layer) = screen {
            self.fetch_screen(lane, layer)?;
        }
        let strength = &self.prepared.program.strength;
        let state = &mut self.lanes[lane];
        let mut ends = Vec::with_capacity(state.fields.len());
        let steps = transfers.map(|t| &self.prepared.transfers[t]);
        for ((field, tap), power) in state.fields.iter_mut().zip(&mut state.taps).zip(&mut state.power) {
            let phase = screen.map(|layer| phase(&state.screens, layer, state.sign * strength[layer]));
            let [at_tap, at_end] = self.prepared.propagator.step_with_tap(field, tap, phase, steps, &mut self.work)?;
            *power = at_tap;
            ends.push(at_end);
        }
        std::mem::swap(&mut state.fields, &mut state.taps);
        Ok(ends)
    }

    /// To an output inside a layer, and back to where it began.
    fn branch(&mut self, branch: Branch, active: usize) -> Result<Measured<T>, Error> {
        let Branch { layer, weight, transfer, times, output } = branch;
        let mut kept = Vec::new();
        for lane in 0..active {
            self.fetch_screen(lane, layer)?;
            let state = &mut self.lanes[lane];
            let strength = state.sign * weight * self.prepared.program.strength[layer];
            kept.push((state.fields.clone(), state.power.clone()));
            let step = &self.prepared.transfers[transfer];
            for (field, power) in state.fields.iter_mut().zip(&mut state.power) {
                for time in 0..2 * times {
                    let phase = (time == times).then(|| phase(&state.screens, layer, strength));
                    *power = self.prepared.propagator.step(field, phase, step, &mut self.work)?;
                }
            }
        }
        let (marks, product) = self.measure(output, active);
        for (lane, (fields, power)) in kept.into_iter().enumerate() {
            self.lanes[lane].fields = fields;
            self.lanes[lane].power = power;
        }
        Ok((output, marks, product))
    }

    /// Overlaps and folded planes of the lanes at an output, and the product of the two lanes.
    fn measure(&mut self, output: usize, active: usize) -> (Vec<Mark<T>>, Option<f64>) {
        let prepared = self.prepared;
        let (nx, ny) = (prepared.propagator.grid().nx, prepared.propagator.grid().ny);
        let beams = prepared.start.len();
        let mut marks: Vec<Mark<T>> = (0..active)
            .map(|lane| Mark {
                same_path: 0.0,
                lost: 1.0 - self.lanes[lane].power[0] / prepared.power,
                planes: vec![vec![T::zero(); prepared.folding.points()]; beams],
            })
            .collect();
        let mut product = 0.0;
        for y in 0..ny {
            for (lane, mark) in marks.iter_mut().enumerate() {
                for beam in 0..beams {
                    let row = &mut self.rows[2 * lane + beam];
                    T::intensity(&self.lanes[lane].fields[beam][y * nx..(y + 1) * nx], T::one(), row);
                    prepared.folding.add_row(y, row, &mut mark.planes[beam]);
                }
                let (sent, received) = (&self.rows[2 * lane], &self.rows[2 * lane + beams - 1]);
                mark.same_path += T::dot(sent, received);
            }
            if active == 2 {
                let last = beams - 1;
                product += 0.5 * T::dot(&self.rows[0], &self.rows[2 + last]);
                product += 0.5 * T::dot(&self.rows[2], &self.rows[last]);
            }
        }
        for mark in &mut marks {
            mark.same_path *= prepared.scale[output];
        }
        (marks, (active == 2).then_some(product * prepared.scale[output]))
    }

    /// Joins the marks of each lane into one sample and adds them up.
    fn collect(&mut self, output: usize, marks: Vec<Vec<Mark<T>>>, sums: &mut GroupSums<T>) {
        let folding = &self.prepared.folding;
        let mut lanes: Vec<Vec<Mark<T>>> = (0..2).map(|_| Vec::new()).collect();
        for side_by_side in marks {
            for (lane, mark) in side_by_side.into_iter().enumerate() {
                lanes[lane].push(mark);
            }
        }
        for mut marks in lanes {
            let count = marks.len() as f64;
            let single: Vec<f64> = marks.iter().map(|m| m.same_path).collect();
            let lost = marks.iter().map(|m| m.lost).sum::<f64>() / count;
            let Some(mut joined) = marks.pop() else { continue };
            for other in marks {
                for (a, b) in joined.planes.iter_mut().zip(other.planes) {
                    for (a, b) in a.iter_mut().zip(b) {
                        *a = (*a + b) * T::of(0.5);
                    }
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

/// The screen of a layer with its strength.
fn phase<T: Real>(screens: &[Vec<T>; 2], layer: usize, strength: f64) -> (&[T], T) {
    (&screens[layer % 2], T::of(strength))
}
