//! The path as layers with one screen each, compiled into a list of steps that serves every output range in one pass.
//!
//! The screen stands in the middle of its layer (half step, screen, half step). An output range inside a layer branches
//! off at the start of the layer: half of what is left, the layer's screen weakened to that part, the other half.
//! Check: the steps add up to each range; the screens of a range carry the turbulence of the path up to it.

use crate::Error;
use crate::air::cn2::Cn2Path;
use crate::efficiency::check_increasing;
use crate::screens::grid::Grid;
use crate::theory::ScreenStrength;
use std::collections::BTreeMap;

/// Ends of the layers along the path \[m\]; the first layer begins at the telescope.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    end_m: Vec<f64>,
}

impl Layers {
    /// Layers that end at these distances \[m\], increasing.
    ///
    /// # Errors
    /// [`Error`] for an empty list, or ends that are not positive and increasing.
    pub fn new(end_m: Vec<f64>) -> Result<Self, Error> {
        if end_m.is_empty() {
            return Err(Error::Length { field: "end_m", found: 0, expected: 1 });
        }
        check_increasing("end_m", &end_m)?;
        Ok(Self { end_m })
    }

    /// `count` equal layers out to `range_m`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a range that is not positive or no layers.
    pub fn equal(count: usize, range_m: f64) -> Result<Self, Error> {
        crate::error::positive("range_m", range_m)?;
        Self::new((1..=count).map(|i| range_m * i as f64 / count as f64).collect())
    }

    /// Ends of the layers \[m\].
    pub fn end_m(&self) -> &[f64] {
        &self.end_m
    }

    /// Start and end of layer i \[m\].
    pub(crate) fn bounds_m(&self, i: usize) -> (f64, f64) {
        (if i == 0 { 0.0 } else { self.end_m[i - 1] }, self.end_m[i])
    }

    /// The screens that a field arriving at `range_m` has crossed, for the exact bistatic theory of a simulated path.
    ///
    /// # Errors
    /// What [`Cn2Path::mean`] returns.
    pub fn screens_to(&self, range_m: f64, cn2: &Cn2Path) -> Result<Vec<ScreenStrength>, Error> {
        let mut screens = Vec::new();
        for i in 0..self.end_m.len() {
            let (start, end) = self.bounds_m(i);
            if start >= range_m || cn2.is_none() {
                break;
            }
            let end = if same(end, range_m) { end } else { end.min(range_m) };
            screens.push(ScreenStrength {
                position_m: 0.5 * (start + end),
                cn2_thickness_m13: cn2.mean(start, end)? * (end - start),
            });
        }
        Ok(screens)
    }
}

/// Equal up to rounding.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

/// One instruction of a compiled path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Op {
    /// `times` steps with transfer function `transfer`; the screen of a layer, if any, before the first.
    Step { screen: Option<usize>, transfer: usize, times: usize },
    /// A step that also leaves the field of output `output` on its way: transfer functions to the output and to the end.
    Tap { screen: Option<usize>, transfers: [usize; 2], output: usize },
    /// The field is that at output `output`.
    Output { output: usize },
    /// From here to output `output` on a copy: step, the screen of `layer` times `weight`, step.
    Branch(Branch),
}

/// The way to an output inside a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Branch {
    pub(crate) layer: usize,
    /// Factor of the layer's screen: the part of its turbulence that is crossed.
    pub(crate) weight: f64,
    /// Transfer function of a step, and how many there are on either side of the screen.
    pub(crate) transfer: usize,
    pub(crate) times: usize,
    pub(crate) output: usize,
}

/// Steps, distances and screen strengths of one path.
#[derive(Debug, Clone)]
pub(crate) struct Program {
    pub(crate) ops: Vec<Op>,
    /// Distances of the transfer functions \[m\].
    pub(crate) distance_m: Vec<f64>,
    /// sqrt(k^2 Cn2 dz) of each layer; empty without turbulence.
    pub(crate) strength: Vec<f64>,
    /// Index of each distance by its logarithm in steps of rounding: paths of thousands of layers and ranges are compiled too.
    known: BTreeMap<i64, usize>,
}

struct Compiler<'a> {
    program: Program,
    position_m: f64,
    pending: Option<usize>,
    grid: &'a Grid,
    wavelength_m: f64,
}

impl Compiler<'_> {
    /// Index of a transfer function and how often it is applied.
    fn transfer(&mut self, distance_m: f64) -> (usize, usize) {
        let limit = self.grid.largest_step_m(self.wavelength_m);
        let times = (distance_m / limit - 1e-9).ceil().max(1.0) as usize;
        let piece = distance_m / times as f64;
        let index = self.program.transfer_index(piece);
        (index, times)
    }

    fn advance(&mut self, to_m: f64) {
        if to_m > self.position_m && !same(to_m, self.position_m) {
            let (transfer, times) = self.transfer(to_m - self.position_m);
            self.program.ops.push(Op::Step { screen: self.pending.take(), transfer, times });
            self.position_m = to_m;
        }
    }
}

impl Program {
    /// Compiles the path for output ranges in any order. Without turbulence there are no screens.
    pub(crate) fn compile(
        layers: &Layers,
        range_m: &[f64],
        cn2: &Cn2Path,
        grid: &Grid,
        wavelength_m: f64,
    ) -> Result<Self, Error> {
        let mut order: Vec<usize> = (0..range_m.len()).collect();
        order.sort_by(|&a, &b| range_m[a].total_cmp(&range_m[b]));
        let last = layers.end_m[layers.end_m.len() - 1];
        for &r in range_m {
            crate::error::positive("range_m", r)?;
            if r > last && !same(r, last) {
                return Err(Error::OutOfRange { field: "range_m", value: r, allowed: "within the layers of the path" });
            }
        }
        let program = Program { ops: Vec::new(), distance_m: Vec::new(), strength: Vec::new(), known: BTreeMap::new() };
        let mut c = Compiler { program, position_m: 0.0, pending: None, grid, wavelength_m };
        if cn2.is_none() {
            for output in order {
                c.advance(range_m[output]);
                c.program.ops.push(Op::Output { output });
            }
            return Ok(c.program.with_taps(grid.largest_step_m(wavelength_m)));
        }
        let k = 2.0 * std::f64::consts::PI / wavelength_m;
        let furthest = order.last().map_or(0.0, |&o| range_m[o]);
        let mut next = 0;
        for layer in 0..layers.end_m.len() {
            let (start, end) = layers.bounds_m(layer);
            if start >= furthest || same(start, furthest) {
                break;
            }
            let cn2_thickness = cn2.mean(start, end)? * (end - start);
            c.program.strength.push(k * cn2_thickness.sqrt());
            while next < order.len() && range_m[order[next]] < end && !same(range_m[order[next]], end) {
                let output = order[next];
                let part = range_m[output] - start;
                c.advance(start);
                let (transfer, times) = c.transfer(0.5 * part);
                let ratio = cn2.mean(start, range_m[output])? * part / cn2_thickness;
                let weight = if cn2_thickness > 0.0 { ratio.sqrt() } else { 0.0 };
                c.program.ops.push(Op::Branch(Branch { layer, weight, transfer, times, output }));
                next += 1;
            }
            if next == order.len() {
                break;
            }
            c.advance(0.5 * (start + end));
            c.pending = Some(layer);
            while next < order.len() && same(range_m[order[next]], end) {
                c.advance(end);
                c.program.ops.push(Op::Output { output: order[next] });
                next += 1;
            }
        }
        Ok(c.program.with_taps(grid.largest_step_m(wavelength_m)))
    }

    /// Joins step, output, step into one step with a tap where one transfer function reaches.
    fn with_taps(mut self, largest_step_m: f64) -> Self {
        let mut ops: Vec<Op> = Vec::with_capacity(self.ops.len());
        for op in std::mem::take(&mut self.ops) {
            let joined = match (&ops[..], op) {
                (
                    [.., Op::Step { screen, transfer: first, times: 1 }, Op::Output { output }],
                    Op::Step { screen: None, transfer: second, times: 1 },
                ) => Some((*screen, *first, second, *output)),
                _ => None,
            };
            match joined {
                Some((screen, first, second, output))
                    if self.distance_m[first] + self.distance_m[second] <= largest_step_m =>
                {
                    let end = self.transfer_index(self.distance_m[first] + self.distance_m[second]);
                    ops.truncate(ops.len() - 2);
                    ops.push(Op::Tap { screen, transfers: [first, end], output });
                }
                _ => ops.push(op),
            }
        }
        self.ops = ops;
        self
    }

    /// Index of the transfer function of a distance, new if need be.
    fn transfer_index(&mut self, distance_m: f64) -> usize {
        let key = (distance_m.ln() * 1e9).round() as i64;
        let near = self.known.range(key - 1..=key + 1).find(|(_, i)| same(self.distance_m[**i], distance_m));
        if let Some((_, index)) = near {
            return *index;
        }
        self.distance_m.push(distance_m);
        self.known.insert(key, self.distance_m.len() - 1);
        self.distance_m.len() - 1
    }

    /// Fourier transform pairs of one realisation.
    pub(crate) fn transform_pairs(&self) -> f64 {
        let pairs = |op: &Op| match *op {
            Op::Step { times, .. } => times as f64,
            Op::Tap { .. } => 1.5,
            Op::Branch(Branch { times, .. }) => 2.0 * times as f64,
            Op::Output { .. } => 0.0,
        };
        self.ops.iter().map(pairs).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::refused;

    const UNIFORM: Cn2Path = Cn2Path::Uniform { cn2_m_m23: 1e-14 };

    fn compile(layers: &Layers, range_m: &[f64], cn2: &Cn2Path) -> Program {
        Program::compile(layers, range_m, cn2, &Grid::table2(), 1.55e-6).unwrap()
    }

    #[test]
    fn steps_add_up_to_each_range_in_any_order() {
        let layers = Layers::equal(10, 3000.0).unwrap();
        let range_m = [900.0, 40.0, 3000.0, 300.0, 500.0];
        for cn2 in [UNIFORM, Cn2Path::None] {
            let p = compile(&layers, &range_m, &cn2);
            let (mut at, mut seen) = (0.0, 0);
            for op in &p.ops {
                match *op {
                    Op::Step { transfer, times, .. } => at += p.distance_m[transfer] * times as f64,
                    Op::Tap { transfers, output, .. } => {
                        assert!((at + p.distance_m[transfers[0]] - range_m[output]).abs() < 1e-9);
                        at += p.distance_m[transfers[1]];
                        seen += 1;
                    }
                    Op::Output { output } => {
                        assert!((at - range_m[output]).abs() < 1e-9);
                        seen += 1;
                    }
                    Op::Branch(Branch { transfer, times, output, .. }) => {
                        let end = at + 2.0 * p.distance_m[transfer] * times as f64;
                        assert!((end - range_m[output]).abs() < 1e-9);
                        seen += 1;
                    }
                }
            }
            assert_eq!(seen, range_m.len());
        }
    }

    #[test]
    fn no_turbulence_compiles_to_no_screens() {
        let layers = Layers::equal(10, 3000.0).unwrap();
        let p = compile(&layers, &[3000.0], &Cn2Path::Uniform { cn2_m_m23: 0.0 });
        assert!(p.strength.is_empty());
        assert!(p.ops.iter().all(|op| !matches!(op, Op::Step { screen: Some(_), .. } | Op::Branch(_))));
        // 3 km exceeds the limit of one step on this grid.
        assert_eq!(p.transform_pairs(), 3.0);
    }

    #[test]
    fn screens_of_a_range_carry_the_turbulence_up_to_it() {
        let layers = Layers::equal(10, 3000.0).unwrap();
        for range_m in [50.0, 300.0, 1234.0, 3000.0] {
            let screens = layers.screens_to(range_m, &UNIFORM).unwrap();
            let total: f64 = screens.iter().map(|s| s.cn2_thickness_m13).sum();
            assert!((total / (1e-14 * range_m) - 1.0).abs() < 1e-12);
            assert!(screens.iter().all(|s| s.position_m < range_m));
        }
    }

    #[test]
    fn outputs_at_layer_ends_cost_half_a_transform_pair() {
        let layers = Layers::equal(10, 3000.0).unwrap();
        let p = compile(&layers, layers.end_m(), &UNIFORM);
        // First half step, nine layers with a tap, last half step.
        assert_eq!(p.transform_pairs(), 1.0 + 9.0 * 1.5 + 1.0);
    }

    #[test]
    fn ranges_beyond_the_path_are_refused() {
        let layers = Layers::equal(4, 1000.0).unwrap();
        assert_eq!(refused(Program::compile(&layers, &[1000.5], &UNIFORM, &Grid::table2(), 1.55e-6)), "range_m");
        assert_eq!(refused(Layers::equal(0, 1000.0)), "end_m");
        assert_eq!(refused(Layers::new(vec![10.0, 5.0])), "end_m");
    }
}
