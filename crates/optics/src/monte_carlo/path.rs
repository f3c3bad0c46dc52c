//! The path as layers with one screen each, laid out as legs from screen to screen that serve every range in one pass.
//!
//! The screen stands in the middle of its layer (half step, screen, half step), and layers end at the ranges.
//! Check: the legs add up to each range; the screens of a range carry the turbulence of the path up to it.

use crate::Error;
use crate::air::cn2::Cn2Path;
use crate::efficiency::check_increasing;
use crate::error::{positive, within};
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
        positive("range_m", range_m)?;
        Self::new((1..=count).map(|i| range_m * i as f64 / count as f64).collect())
    }

    /// Ends of the layers \[m\].
    pub fn end_m(&self) -> &[f64] {
        &self.end_m
    }

    /// The layers of a run to these ranges: one with a range inside ends there, and the next begins.
    #[must_use]
    pub fn split_at(&self, range_m: &[f64]) -> Self {
        let last = self.end_m[self.end_m.len() - 1];
        let inside = |r: &&f64| **r > 0.0 && **r < last && !self.end_m.iter().any(|end| same(*end, **r));
        let mut end_m: Vec<f64> = self.end_m.iter().chain(range_m.iter().filter(inside)).copied().collect();
        end_m.sort_by(f64::total_cmp);
        end_m.dedup_by(|b, a| same(*a, *b));
        Self { end_m }
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

/// The way from one place at which something happens to the next, after the screen of a layer, if any.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Leg {
    pub(crate) screen: Option<usize>,
    /// A range on the way, and the distance to it, where one transform from the same field serves both.
    pub(crate) tap: Option<(usize, usize)>,
    /// Distance of a step, and how many lead to the end.
    pub(crate) distance: usize,
    pub(crate) times: usize,
    /// Ranges at the end.
    pub(crate) outputs: Vec<usize>,
}

impl Leg {
    /// Ranges that the leg reaches: index, and whether it is one on the way.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = (usize, bool)> {
        let at_the_end = self.outputs.iter().map(|&output| (output, false));
        self.tap.iter().map(|&(output, _)| (output, true)).chain(at_the_end)
    }
}

/// Legs, distances and screen strengths of one path.
#[derive(Debug, Clone, Default)]
pub(crate) struct Path {
    pub(crate) legs: Vec<Leg>,
    /// Distances of the steps \[m\].
    pub(crate) distance_m: Vec<f64>,
    /// sqrt(k^2 Cn2 dz) of each layer; empty without turbulence.
    pub(crate) strength: Vec<f64>,
    /// Index of each distance by its logarithm in steps of rounding: paths of thousands of layers and ranges are laid out too.
    known: BTreeMap<i64, usize>,
}

/// A place on the path with a screen or ranges.
struct Stop {
    at_m: f64,
    screen: Option<usize>,
    outputs: Vec<usize>,
}

impl Path {
    /// The path to ranges in increasing order, at which layers end. Without turbulence there are no screens.
    pub(crate) fn new(
        layers: &Layers,
        range_m: &[f64],
        cn2: &Cn2Path,
        grid: &Grid,
        wavelength_m: f64,
    ) -> Result<Self, Error> {
        let last = layers.end_m[layers.end_m.len() - 1];
        for &r in range_m {
            positive("range_m", r)?;
            within("range_m", r, r <= last || same(r, last), "within the layers of the path")?;
        }
        let mut path = Self::default();
        let mut stops: Vec<Stop> = Vec::new();
        let mut output = 0;
        let furthest = range_m.last().copied().unwrap_or_default();
        for (start, end) in (0..layers.end_m.len()).map(|i| layers.bounds_m(i)) {
            if start >= furthest || same(start, furthest) {
                break;
            }
            if !cn2.is_none() {
                let cn2_thickness = cn2.mean(start, end)? * (end - start);
                let screen = Some(path.strength.len());
                path.strength.push(2.0 * std::f64::consts::PI / wavelength_m * cn2_thickness.sqrt());
                stops.push(Stop { at_m: 0.5 * (start + end), screen, outputs: Vec::new() });
            }
            while let Some(&r) = range_m.get(output).filter(|r| **r < end || same(**r, end)) {
                match stops.last_mut().filter(|stop| same(stop.at_m, r)) {
                    Some(stop) => stop.outputs.push(output),
                    None => stops.push(Stop {
                        at_m: if same(r, end) && !cn2.is_none() { end } else { r },
                        screen: None,
                        outputs: vec![output],
                    }),
                }
                output += 1;
            }
        }
        path.lay(stops, grid.largest_step_m(wavelength_m));
        Ok(path)
    }

    /// Legs from stop to stop; two become one with a tap where one step reaches past a range.
    fn lay(&mut self, stops: Vec<Stop>, largest_step_m: f64) {
        let mut legs: Vec<Leg> = Vec::new();
        let mut from = Stop { at_m: 0.0, screen: None, outputs: Vec::new() };
        for mut stop in stops {
            let length_m = stop.at_m - from.at_m;
            let times = (length_m / largest_step_m - 1e-9).ceil().max(1.0);
            let (distance, outputs) = (self.step(length_m / times), std::mem::take(&mut stop.outputs));
            legs.push(Leg { screen: from.screen, tap: None, distance, times: times as usize, outputs });
            from = stop;
        }
        for leg in legs {
            match self.legs.pop() {
                Some(Leg { screen, tap: None, distance, times: 1, outputs })
                    if outputs.len() == 1
                        && (leg.screen, leg.times) == (None, 1)
                        && self.distance_m[distance] + self.distance_m[leg.distance] <= largest_step_m =>
                {
                    let whole = self.step(self.distance_m[distance] + self.distance_m[leg.distance]);
                    self.legs.push(Leg { screen, tap: Some((outputs[0], distance)), distance: whole, ..leg });
                }
                before => self.legs.extend(before.into_iter().chain([leg])),
            }
        }
    }

    /// Index of the distance of a step, new if need be.
    fn step(&mut self, distance_m: f64) -> usize {
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
        self.legs.iter().map(|leg| if leg.tap.is_some() { 1.5 } else { leg.times as f64 }).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::refused;

    const UNIFORM: Cn2Path = Cn2Path::Uniform { cn2_m_m23: 1e-14 };

    fn path(layers: &Layers, range_m: &[f64], cn2: &Cn2Path) -> Path {
        Path::new(&layers.split_at(range_m), range_m, cn2, &Grid::table2(), 1.55e-6).unwrap()
    }

    #[test]
    fn legs_add_up_to_each_range_and_taps_are_passed() {
        let layers = Layers::equal(10, 3000.0).unwrap();
        let range_m = [40.0, 300.0, 500.0, 900.0, 3000.0];
        for cn2 in [UNIFORM, Cn2Path::None] {
            let p = path(&layers, &range_m, &cn2);
            let (mut at, mut seen) = (0.0, 0);
            for leg in &p.legs {
                if let Some((output, distance)) = leg.tap {
                    assert!((at + p.distance_m[distance] - range_m[output]).abs() < 1e-9);
                    seen += 1;
                }
                at += p.distance_m[leg.distance] * leg.times as f64;
                for &output in &leg.outputs {
                    assert!((at - range_m[output]).abs() < 1e-9);
                    seen += 1;
                }
            }
            assert_eq!(seen, range_m.len());
        }
    }

    #[test]
    fn no_turbulence_means_no_screens() {
        let layers = Layers::equal(10, 3000.0).unwrap();
        let p = path(&layers, &[3000.0], &Cn2Path::Uniform { cn2_m_m23: 0.0 });
        assert!(p.strength.is_empty());
        assert!(p.legs.iter().all(|leg| leg.screen.is_none()));
        // 3 km exceeds the limit of one step on this grid.
        assert_eq!(p.transform_pairs(), 3.0);
    }

    #[test]
    fn layers_end_at_ranges_and_each_has_its_part_of_the_turbulence() {
        let layers = Layers::equal(3, 900.0).unwrap();
        let range_m = [50.0, 300.0, 450.0, 900.0];
        let split = layers.split_at(&range_m);
        assert_eq!(split.end_m(), [50.0, 300.0, 450.0, 600.0, 900.0]);
        let p = path(&layers, &range_m, &UNIFORM);
        let k = 2.0 * std::f64::consts::PI / 1.55e-6;
        for (strength, thickness_m) in p.strength.iter().zip([50.0, 250.0, 150.0, 150.0, 300.0]) {
            assert!((strength.powi(2) / (k * k * 1e-14 * thickness_m) - 1.0).abs() < 1e-12);
        }
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
        let p = path(&layers, layers.end_m(), &UNIFORM);
        // First half step, nine layers with a tap, last half step.
        assert_eq!(p.transform_pairs(), 1.0 + 9.0 * 1.5 + 1.0);
    }

    #[test]
    fn ranges_beyond_the_path_are_refused() {
        let layers = Layers::equal(4, 1000.0).unwrap();
        assert_eq!(refused(Path::new(&layers, &[1000.5], &UNIFORM, &Grid::table2(), 1.55e-6)), "range_m");
        assert_eq!(refused(Layers::equal(0, 1000.0)), "end_m");
        assert_eq!(refused(Layers::new(vec![10.0, 5.0])), "end_m");
    }
}
