//! A first guess of the wake from the map alone: the best pair on a grid of places.
//!
//! The map is thinned to medians of blocks, which outliers do not move. For vortices at given places their
//! circulations and the wind enter linearly, so every pair of places on a polar grid is tried by least squares, the
//! left one clockwise and the right one anticlockwise as those of an aircraft are. Check: wakes at many places, in
//! noise and among outliers, come out near enough for the fit.

use ndarray::{Array1, Array2};

use crate::error::{Error, enough_velocities};
use crate::parallel::{map_each, map_indexed};
use crate::vortex_fit::map_fit::cells::{orthonormal, remove, scaled};
use crate::vortex_fit::map_fit::data::{block_means, ends, median};
use crate::vortex_fit::map_fit::starts::CORE_OVER_SPACING;
use crate::vortex_fit::top::distinct;
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::range_kernel::LineScratch;
use crate::vortex_fit::{RangeKernel, VelocityMap, Vortex, Wake, WakeModel};

/// Blocks of the thinned map along each axis, at most.
const BLOCKS: usize = 48;
/// Places along each axis.
const PLACES: usize = 26;
/// Vortices are no closer \[m\].
const CLOSEST_M: f64 = 2.0;
/// Pairs of places that fits start from.
const PAIRS: usize = 3;
/// Pairs are different if a vortex of one is that far from that of the other \[m\].
const APART_M: f64 = 12.0;
/// Velocities that a search needs.
const NEEDED: usize = 100;

/// The thinned map: one number per block.
struct Thinned {
    elevation_rad: Vec<f64>,
    range_m: Vec<f64>,
    /// Median velocity \[line, gate\]; 0 without any.
    velocity: Vec<f64>,
    /// One over the median standard deviation; 0 where there is no velocity.
    weight: Vec<f64>,
}

fn thin(map: &VelocityMap<'_>) -> Thinned {
    let (by_line, by_gate) = (
        map.elevation_rad.len().div_ceil(BLOCKS),
        map.range_m.len().div_ceil(BLOCKS),
    );
    let (elevation_rad, range_m) = (
        block_means(map.elevation_rad, by_line),
        block_means(map.range_m, by_gate),
    );
    let block = |index: usize| {
        let known = map.known_in(
            (index / range_m.len(), index % range_m.len()),
            (by_line, by_gate),
        );
        let of = |place: &[usize; 2]| (map.velocity_m_s[*place], map.deviation(place[0], place[1]));
        let (mut velocities, mut deviations): (Vec<f64>, Vec<f64>) = known.iter().map(of).unzip();
        if known.is_empty() {
            (0.0, 0.0)
        } else {
            (median(&mut velocities), median(&mut deviations).recip())
        }
    };
    let (velocity, weight) = (0..elevation_rad.len() * range_m.len()).map(block).unzip();
    Thinned {
        elevation_rad,
        range_m,
        velocity,
        weight,
    }
}

/// A pair of places with the circulations that fit best there.
#[derive(Debug, Clone, Copy)]
struct Pair {
    /// Sum of squares that it explains.
    explained: f64,
    left: usize,
    right: usize,
    strength: (f64, f64),
}

/// The thinned map and what vortices on a grid of places show of it, both without the part that a wind explains.
pub(crate) struct Search {
    /// Lateral coordinate and height of each place \[m\].
    places_m: Vec<(f64, f64)>,
    /// Products of what anticlockwise vortices of unit circulation at the places show, with each other and with the data.
    gram: Array2<f64>,
    towards: Array1<f64>,
}

/// Wakes of the best pairs of vortices on a grid of places, the best first.
///
/// # Errors
/// [`Error::TooFewVelocities`] with less than a hundred velocities, [`Error::NoVortex`] with the statistic `needed` if no pair has the sense of an
/// aircraft's.
pub(crate) fn first_guesses(
    map: &VelocityMap<'_>,
    model: &WakeModel,
    kernel: &RangeKernel,
    needed: f64,
) -> Result<Vec<Wake>, Error> {
    let wakes = Search::new(map, model, kernel)?.wakes();
    if wakes.is_empty() {
        return Err(Error::NoVortex {
            statistic: 0.0,
            needed,
        });
    }
    Ok(wakes)
}

impl Search {
    /// # Errors
    /// [`Error::TooFewVelocities`] with less than a hundred velocities.
    pub(crate) fn new(
        map: &VelocityMap<'_>,
        model: &WakeModel,
        kernel: &RangeKernel,
    ) -> Result<Self, Error> {
        enough_velocities(map.validate()?, NEEDED)?;
        let thinned = thin(map);
        let weighted = |shape: &[f64]| scaled(&thinned.weight, shape);
        let basis = orthonormal(&wind_shapes(&thinned, model).map(|shape| weighted(&shape)));
        let mut data = weighted(&thinned.velocity);
        remove(&basis, &mut data);
        let seen = places(&thinned, model, kernel);
        let rows = map_each(seen.len(), |i| {
            let mut shape = weighted(&seen[i].1);
            remove(&basis, &mut shape);
            shape
        });
        let (data, blocks) = (Array1::from_vec(data), thinned.weight.len());
        let shapes =
            Array2::from_shape_fn((rows.len(), blocks), |(place, block)| rows[place][block]);
        Ok(Self {
            places_m: seen.iter().map(|(place_m, _)| *place_m).collect(),
            gram: shapes.dot(&shapes.t()),
            towards: shapes.dot(&data),
        })
    }

    /// Wakes of the best pairs with different places, the best first.
    pub(crate) fn wakes(&self) -> Vec<Wake> {
        let mut pairs = self.pairs();
        pairs.sort_by(|a, b| b.explained.total_cmp(&a.explained));
        let is_near = |a: &Vortex, b: &Vortex| a.away_m(b.place_m()) < APART_M;
        let is_same = |a: &Wake, b: &Wake| is_near(&a.left, &b.left) && is_near(&a.right, &b.right);
        let mut wakes = distinct(pairs.iter().map(|pair| self.wake(pair)), is_same);
        wakes.truncate(PAIRS);
        wakes
    }

    /// The wake of a pair, without wind.
    fn wake(&self, pair: &Pair) -> Wake {
        let (left, right) = (self.places_m[pair.left], self.places_m[pair.right]);
        let core_m = CORE_OVER_SPACING * (right.0 - left.0);
        Wake::calm(
            Vortex::at(left, pair.strength.0, core_m),
            Vortex::at(right, pair.strength.1, core_m),
        )
    }

    /// For each place of a left vortex the best one of a right vortex with positive circulations of both.
    fn pairs(&self) -> Vec<Pair> {
        let best = |left: usize| {
            // a clockwise vortex shows the opposite shape
            let (a, aa) = (-self.towards[left], self.gram[[left, left]]);
            let pair = |right: usize| {
                let (b, bb, ab) = (
                    self.towards[right],
                    self.gram[[right, right]],
                    -self.gram[[left, right]],
                );
                let determinant = aa * bb - ab * ab;
                let strength = (
                    (a * bb - b * ab) / determinant,
                    (b * aa - a * ab) / determinant,
                );
                let possible = strength.0 > 0.0 && strength.1 > 0.0 && determinant > 1e-6 * aa * bb;
                possible.then_some(Pair {
                    explained: strength.0 * a + strength.1 * b,
                    left,
                    right,
                    strength,
                })
            };
            let apart =
                |right: &usize| self.places_m[*right].0 - self.places_m[left].0 >= CLOSEST_M;
            let pairs = (0..self.places_m.len()).filter(apart).filter_map(pair);
            // the first of equals
            pairs.reduce(|most, next| {
                if next.explained > most.explained {
                    next
                } else {
                    most
                }
            })
        };
        (0..self.places_m.len()).filter_map(best).collect()
    }

    /// The best place of one vortex of that sense of turning (-1 left, +1 right) alone, and its circulation.
    pub(crate) fn single(&self, sense: f64) -> Option<((f64, f64), f64)> {
        let explained = |place: usize| {
            (sense * self.towards[place]).max(0.0).powi(2) / self.gram[[place, place]]
        };
        let best = (0..self.places_m.len())
            .reduce(|a, b| if explained(b) > explained(a) { b } else { a })?;
        let strength = sense * self.towards[best] / self.gram[[best, best]];
        (strength > 0.0).then_some((self.places_m[best], strength))
    }
}

/// The grid of places, with what an anticlockwise vortex of unit circulation at each shows on the thinned map.
fn places(
    thinned: &Thinned,
    model: &WakeModel,
    kernel: &RangeKernel,
) -> Vec<((f64, f64), Vec<f64>)> {
    let (first_rad, last_rad) = ends(&thinned.elevation_rad);
    let (near_m, far_m) = ends(&thinned.range_m);
    let step = |from: f64, to: f64, i: usize| from + (to - from) * (i as f64 + 0.5) / PLACES as f64;
    // half the distance of places across the lines: what is between them is not missed
    let core_m = 0.5 * far_m * (last_rad - first_rad) / PLACES as f64;
    let kernel = kernel.coarser(4);
    map_indexed(PLACES * PLACES, LineScratch::default, |scratch, index| {
        let range_m = step(near_m, far_m, index / PLACES);
        let place_m = model.position_m(range_m, step(first_rad, last_rad, index % PLACES));
        let wake = Wake::of_unit_vortex(place_m, core_m.max(1.0));
        let mut shape = Vec::with_capacity(thinned.velocity.len());
        for &elevation_rad in &thinned.elevation_rad {
            let ray = Ray::new(elevation_rad);
            kernel.apply(
                (model, &wake, ray),
                &thinned.range_m,
                false,
                scratch,
                |_, velocity, _| shape.push(velocity),
            );
        }
        (place_m, shape)
    })
    .into_iter()
    .filter(|((_, height_m), _)| !model.images || *height_m > 0.0)
    .collect()
}

/// What uniform wind and shear show.
fn wind_shapes(thinned: &Thinned, model: &WakeModel) -> [Vec<f64>; 2] {
    let mut shapes = [Vec::new(), Vec::new()];
    for &elevation_rad in &thinned.elevation_rad {
        for &range_m in &thinned.range_m {
            shapes[0].push(elevation_rad.cos());
            shapes[1].push(model.position_m(range_m, elevation_rad).1 * elevation_rad.cos());
        }
    }
    shapes
}
