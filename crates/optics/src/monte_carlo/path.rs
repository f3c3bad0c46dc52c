//! The path as layers with one screen each, laid out as legs from screen to screen that serve every
//! range in one pass.
//!
//! The screen is in the middle of its layer (half step, screen, half step), and layers end at the
//! ranges. Check: the legs add up to each range; the screens of a range carry the turbulence of
//! the path up to it.

use crate::Error;
use crate::air::cn2::Cn2Path;
use crate::efficiency::check_increasing;
use crate::error::{positive, within};
use crate::screens::grid::Grid;
use crate::theory::ScreenStrength;
use std::collections::BTreeMap;
use std::ops::Range;

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
            return Err(Error::Length {
                field: "end_m",
                found: 0,
                expected: 1,
            });
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
        Self::new(
            (1..=count)
                .map(|i| range_m * i as f64 / count as f64)
                .collect(),
        )
    }

    /// Ends of the layers \[m\].
    pub fn end_m(&self) -> &[f64] {
        &self.end_m
    }

    /// The layers of a run to these ranges: a layer with a range inside is cut there.
    #[must_use]
    pub fn split_at(&self, range_m: &[f64]) -> Self {
        let last_m = self.end_m[self.end_m.len() - 1];
        let mut end_m = self.end_m.clone();
        for &r in range_m {
            let is_end = self.end_m.iter().any(|end| same(*end, r));
            if r > 0.0 && r < last_m && !is_end {
                end_m.push(r);
            }
        }
        end_m.sort_by(f64::total_cmp);
        end_m.dedup_by(|b, a| same(*a, *b));
        Self { end_m }
    }

    /// Start and end of each layer \[m\].
    pub(crate) fn bounds_m(&self) -> impl Iterator<Item = (f64, f64)> {
        let starts = std::iter::once(0.0).chain(self.end_m.iter().copied());
        starts.zip(self.end_m.iter().copied())
    }

    /// The screens that a field arriving at `range_m` has crossed, for the exact bistatic theory of
    /// a simulated path.
    ///
    /// # Errors
    /// What [`Cn2Path::mean`] returns.
    pub fn screens_to(&self, range_m: f64, cn2: &Cn2Path) -> Result<Vec<ScreenStrength>, Error> {
        let mut screens = Vec::new();
        for (start, end) in self.bounds_m() {
            if start >= range_m || cn2.is_none() {
                break;
            }
            let end = if same(end, range_m) {
                end
            } else {
                end.min(range_m)
            };
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

/// Propagation from one screen or range to the next, after the screen of a layer, if any.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Leg {
    pub(crate) screen: Option<usize>,
    /// Index of the distance to a range that the leg passes, the first of `outputs`: one forward
    /// transform serves it and the end of the leg.
    pub(crate) tap: Option<usize>,
    /// Index of the distance of a step.
    pub(crate) distance: usize,
    /// Number of equal steps.
    pub(crate) times: usize,
    /// Ranges that it reaches, all at the end but the one that it passes.
    pub(crate) outputs: Range<usize>,
}

impl Leg {
    /// Ranges that the leg reaches: index, and whether the leg passes it.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = (usize, bool)> {
        let passed = self.tap.map(|_| self.outputs.start);
        self.outputs
            .clone()
            .map(move |output| (output, passed == Some(output)))
    }

    /// Whether the leg is one step to one range.
    fn is_step_to_range(&self) -> bool {
        self.tap.is_none() && self.outputs.len() == 1 && self.times == 1
    }

    /// Whether the leg is one step in free space.
    fn is_free_step(&self) -> bool {
        self.screen.is_none() && self.times == 1
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
    /// Index of each distance by its logarithm in steps of rounding, so that distances are found
    /// fast on paths of thousands of layers and ranges.
    known: BTreeMap<i64, usize>,
}

impl Path {
    /// The path to ranges in increasing order, at which layers end. Without turbulence there
    /// are no screens.
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
            within(
                "range_m",
                r,
                r <= last || same(r, last),
                "within the layers of the path",
            )?;
        }
        let mut path = Self::default();
        let largest_step_m = grid.largest_step_m(wavelength_m);
        let legs = path.legs(layers, range_m, cn2, wavelength_m, largest_step_m)?;
        path.join(legs, largest_step_m);
        Ok(path)
    }

    /// Legs from screen to screen and to the ends of layers with ranges, none of them joined.
    fn legs(
        &mut self,
        layers: &Layers,
        range_m: &[f64],
        cn2: &Cn2Path,
        wavelength_m: f64,
        largest_step_m: f64,
    ) -> Result<Vec<Leg>, Error> {
        let furthest = range_m.last().copied().unwrap_or_default();
        let mut legs = Vec::new();
        let mut from_m = 0.0;
        let mut screen = None;
        let mut reached = 0;
        for (start, end) in layers.bounds_m() {
            if start >= furthest || same(start, furthest) {
                break;
            }
            if !cn2.is_none() {
                let cn2_thickness = cn2.mean(start, end)? * (end - start);
                let middle_m = 0.5 * (start + end);
                legs.push(Leg {
                    screen,
                    outputs: reached..reached,
                    ..self.leg(middle_m - from_m, largest_step_m)
                });
                from_m = middle_m;
                screen = Some(self.strength.len());
                let wavenumber_rad_m = 2.0 * std::f64::consts::PI / wavelength_m;
                self.strength.push(wavenumber_rad_m * cn2_thickness.sqrt());
            }
            let first = reached;
            while reached < range_m.len() && (range_m[reached] < end || same(range_m[reached], end))
            {
                reached += 1;
            }
            if reached > first {
                let to_m = if cn2.is_none() { range_m[first] } else { end };
                legs.push(Leg {
                    screen: screen.take(),
                    outputs: first..reached,
                    ..self.leg(to_m - from_m, largest_step_m)
                });
                from_m = to_m;
            }
        }
        Ok(legs)
    }

    /// A leg of this length in steps of at most `largest_step_m`, without screen and outputs.
    fn leg(&mut self, length_m: f64, largest_step_m: f64) -> Leg {
        let times = (length_m / largest_step_m - 1e-9).ceil().max(1.0);
        Leg {
            screen: None,
            tap: None,
            distance: self.index_of_distance(length_m / times),
            times: times as usize,
            outputs: 0..0,
        }
    }

    /// Appends legs; two become one with a tap where one step reaches past a range.
    fn join(&mut self, legs: Vec<Leg>, largest_step_m: f64) {
        for leg in legs {
            let distance_m = &self.distance_m;
            let joined = self.legs.pop_if(|before| {
                let whole_m = distance_m[before.distance] + distance_m[leg.distance];
                before.is_step_to_range() && leg.is_free_step() && whole_m <= largest_step_m
            });
            let Some(before) = joined else {
                self.legs.push(leg);
                continue;
            };
            let whole_m = self.distance_m[before.distance] + self.distance_m[leg.distance];
            let distance = self.index_of_distance(whole_m);
            self.legs.push(Leg {
                screen: before.screen,
                tap: Some(before.distance),
                distance,
                times: leg.times,
                outputs: before.outputs.start..leg.outputs.end,
            });
        }
    }

    /// Index of a distance, which is appended if it is new.
    fn index_of_distance(&mut self, distance_m: f64) -> usize {
        let key = (distance_m.ln() * 1e9).round() as i64;
        let near = self
            .known
            .range(key - 1..=key + 1)
            .find(|(_, i)| same(self.distance_m[**i], distance_m));
        if let Some((_, index)) = near {
            return *index;
        }
        self.distance_m.push(distance_m);
        self.known.insert(key, self.distance_m.len() - 1);
        self.distance_m.len() - 1
    }

    /// Fourier transform pairs of one realisation.
    pub(crate) fn transform_pairs(&self) -> f64 {
        let mut pairs = 0.0;
        for leg in &self.legs {
            pairs += if leg.tap.is_some() {
                1.5
            } else {
                leg.times as f64
            };
        }
        pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::refused;

    const UNIFORM: Cn2Path = Cn2Path::Uniform { cn2_m_m23: 1e-14 };

    fn path(layers: &Layers, range_m: &[f64], cn2: &Cn2Path) -> Path {
        Path::new(
            &layers.split_at(range_m),
            range_m,
            cn2,
            &Grid::table2(),
            1.55e-6,
        )
        .unwrap()
    }

    #[test]
    fn legs_add_up_to_each_range_and_taps_are_passed() {
        let layers = Layers::equal(10, 3000.0).unwrap();
        let range_m = [40.0, 300.0, 500.0, 900.0, 3000.0];
        for cn2 in [UNIFORM, Cn2Path::None] {
            let p = path(&layers, &range_m, &cn2);
            let mut at = 0.0;
            let mut seen = 0;
            for leg in &p.legs {
                let passed = leg.tap.map(|distance| at + p.distance_m[distance]);
                at += p.distance_m[leg.distance] * leg.times as f64;
                for (output, is_passed) in leg.ranges() {
                    let output_m = if is_passed { passed.unwrap() } else { at };
                    assert!((output_m - range_m[output]).abs() < 1e-9);
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
        assert_eq!(
            refused(Path::new(
                &layers,
                &[1000.5],
                &UNIFORM,
                &Grid::table2(),
                1.55e-6
            )),
            "range_m"
        );
        assert_eq!(refused(Layers::equal(0, 1000.0)), "end_m");
        assert_eq!(refused(Layers::new(vec![10.0, 5.0])), "end_m");
    }
}
