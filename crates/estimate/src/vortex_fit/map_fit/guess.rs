//! A first guess of the wake from the map alone: the best pair on a grid of places.
//!
//! The map is thinned to medians of blocks, which outliers do not move. For vortices at given places their
//! circulations and the wind enter linearly, so every pair of places on a polar grid is tried by least squares, the
//! left one clockwise and the right one anticlockwise as those of an aircraft are. Check: wakes at many places, in
//! noise and among outliers, come out near enough for the fit; maps of noise hold no vortex.

use multiversion::multiversion;

use crate::error::Error;
use crate::parallel::map_indexed;
use crate::vortex_fit::map_fit::data::median;
use crate::vortex_fit::map_fit::starts::CORE_OVER_SPACING;
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::range_kernel::LineScratch;
use crate::vortex_fit::{RangeKernel, VelocityMap, Vortex, Wake, WakeModel};

/// Blocks of the thinned map along each axis, at most.
const BLOCKS: usize = 48;
/// Places along each axis.
const PLACES: usize = 26;
/// Left vortices that are tried side by side.
const SIDE_BY_SIDE: usize = 4;
/// Vortices are no closer \[m\].
const CLOSEST_M: f64 = 2.0;
/// Velocities that a search needs.
const NEEDED: usize = 100;
/// Least significance: explained sum of squares over the variance of what is left, per number of the pair.
const SIGNIFICANT: f64 = 60.0;

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
    let blocks = |axis: &[f64]| -> Vec<(usize, usize)> {
        let size = axis.len().div_ceil(BLOCKS);
        (0..axis.len()).step_by(size).map(|from| (from, (from + size).min(axis.len()))).collect()
    };
    let middle = |axis: &[f64], (from, to): (usize, usize)| axis[from..to].iter().sum::<f64>() / (to - from) as f64;
    let (lines, gates) = (blocks(map.elevation_rad), blocks(map.range_m));
    let (mut velocity, mut weight) = (Vec::with_capacity(lines.len() * gates.len()), Vec::new());
    for &(first, last) in &lines {
        for &(from, to) in &gates {
            let block = map.velocity_m_s.slice(ndarray::s![first..last, from..to]);
            let known = block.indexed_iter().filter(|(_, v)| v.is_finite());
            let (mut deviations, mut finite): (Vec<f64>, Vec<f64>) =
                known.map(|((line, gate), v)| (map.deviation(first + line, from + gate), *v)).unzip();
            velocity.push(if finite.is_empty() { 0.0 } else { median(&mut finite) });
            weight.push(if deviations.is_empty() { 0.0 } else { median(&mut deviations).recip() });
        }
    }
    Thinned {
        elevation_rad: lines.iter().map(|&block| middle(map.elevation_rad, block)).collect(),
        range_m: gates.iter().map(|&block| middle(map.range_m, block)).collect(),
        velocity,
        weight,
    }
}

/// A place on the grid, and what a vortex of unit circulation there would show.
struct Place {
    lateral_m: f64,
    height_m: f64,
    shape: Vec<f64>,
}

/// A pair of places with the circulations that fit best there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    /// Sum of squares that it explains.
    pub(crate) explained: f64,
    left: usize,
    right: usize,
    strength: (f64, f64),
}

/// The thinned map and what vortices on a grid of places show of it, both without the part that a wind explains.
pub(crate) struct Search {
    places: Vec<Place>,
    shapes: Vec<Vec<f64>>,
    data: Vec<f64>,
    known: Vec<bool>,
}

/// The best pair of vortices on a grid of places.
///
/// # Errors
/// [`Error::TooFewVelocities`] with less than a hundred velocities, [`Error::NoVortex`] if no pair stands out.
pub(crate) fn first_guess(map: &VelocityMap<'_>, model: &WakeModel, kernel: &RangeKernel) -> Result<Wake, Error> {
    let search = Search::new(map, model, kernel)?;
    // the first of equals, whoever computed it
    let best =
        search.pairs().into_iter().reduce(|most, next| if next.explained > most.explained { next } else { most });
    let best = best.ok_or(Error::NoVortex { significance: 0.0, needed: SIGNIFICANT })?;
    let significance = search.significance(&best);
    if significance.is_nan() || significance < SIGNIFICANT {
        return Err(Error::NoVortex { significance, needed: SIGNIFICANT });
    }
    Ok(search.wake(&best))
}

impl Search {
    /// # Errors
    /// [`Error::TooFewVelocities`] with less than a hundred velocities.
    pub(crate) fn new(map: &VelocityMap<'_>, model: &WakeModel, kernel: &RangeKernel) -> Result<Self, Error> {
        let found = map.validate()?;
        if found < NEEDED {
            return Err(Error::TooFewVelocities { found, needed: NEEDED });
        }
        let thinned = thin(map);
        let places = places(&thinned, model, kernel);
        let weighted = |shape: &[f64]| -> Vec<f64> { shape.iter().zip(&thinned.weight).map(|(s, w)| s * w).collect() };
        let basis = orthonormal(wind_shapes(&thinned, model).map(|shape| weighted(&shape)));
        let mut data = weighted(&thinned.velocity);
        remove(&basis, &mut data);
        let shapes = map_indexed(
            places.len(),
            || (),
            |(), i| {
                let mut shape = weighted(&places[i].shape);
                remove(&basis, &mut shape);
                shape
            },
        );
        let known = thinned.weight.iter().map(|w| *w > 0.0).collect();
        Ok(Self { places, shapes, data, known })
    }

    /// What a pair explains over the variance of what is left, per number of the pair.
    fn significance(&self, pair: &Pair) -> f64 {
        let (left, right) = (&self.shapes[pair.left], &self.shapes[pair.right]);
        let mut rest: Vec<f64> = (0..self.data.len())
            .filter(|&i| self.known[i])
            .map(|i| (self.data[i] + pair.strength.0 * left[i] - pair.strength.1 * right[i]).abs())
            .collect();
        let deviation = median(&mut rest) / 0.674_5;
        pair.explained / (deviation * deviation) / 6.0
    }

    /// The wake of a pair, without wind.
    pub(crate) fn wake(&self, pair: &Pair) -> Wake {
        let (left, right) = (&self.places[pair.left], &self.places[pair.right]);
        let core_radius_m = CORE_OVER_SPACING * (right.lateral_m - left.lateral_m);
        let vortex = |place: &Place, circulation_m2_s| Vortex {
            circulation_m2_s,
            lateral_position_m: place.lateral_m,
            height_m: place.height_m,
            core_radius_m,
        };
        Wake {
            left: vortex(left, pair.strength.0),
            right: vortex(right, pair.strength.1),
            lateral_wind_m_s: 0.0,
            wind_shear_per_s: 0.0,
        }
    }
}

/// The grid of places, with what an anticlockwise vortex of unit circulation at each shows on the thinned map.
fn places(thinned: &Thinned, model: &WakeModel, kernel: &RangeKernel) -> Vec<Place> {
    let (first_rad, last_rad) = ends(&thinned.elevation_rad);
    let (near_m, far_m) = ends(&thinned.range_m);
    let step = |from: f64, to: f64, i: usize| from + (to - from) * (i as f64 + 0.5) / PLACES as f64;
    // half the distance of places across the lines: what is between them is not missed
    let core_m = 0.5 * far_m * (last_rad - first_rad) / PLACES as f64;
    let kernel = kernel.coarser(4);
    map_indexed(PLACES * PLACES, LineScratch::default, |scratch, index| {
        let range_m = step(near_m, far_m, index / PLACES);
        let (lateral_m, height_m) = model.position_m(range_m, step(first_rad, last_rad, index % PLACES));
        let alone = |circulation_m2_s, lateral_position_m| Vortex {
            circulation_m2_s,
            lateral_position_m,
            height_m,
            core_radius_m: core_m.max(1.0),
        };
        let wake = Wake {
            left: alone(0.0, lateral_m - 1.0),
            right: alone(1.0, lateral_m),
            lateral_wind_m_s: 0.0,
            wind_shear_per_s: 0.0,
        };
        let mut shape = Vec::with_capacity(thinned.velocity.len());
        for &elevation_rad in &thinned.elevation_rad {
            let ray = Ray::new(elevation_rad);
            kernel.apply((model, &wake, ray), &thinned.range_m, false, scratch, |_, velocity, _| shape.push(velocity));
        }
        Place { lateral_m, height_m, shape }
    })
    .into_iter()
    .filter(|place| !model.images || place.height_m > 0.0)
    .collect()
}

fn ends(axis: &[f64]) -> (f64, f64) {
    (axis.first().copied().unwrap_or(0.0), axis.last().copied().unwrap_or(0.0))
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

/// An orthonormal basis of shapes.
fn orthonormal(shapes: [Vec<f64>; 2]) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut shape in shapes {
        let before = crate::linalg::dot(&shape, &shape);
        remove(&basis, &mut shape);
        let norm = crate::linalg::dot(&shape, &shape);
        if norm > 1e-12 * before {
            shape.iter_mut().for_each(|s| *s /= norm.sqrt());
            basis.push(shape);
        }
    }
    basis
}

/// Scalar products of some shapes with one, each as [`crate::linalg::dot`] forms it, with the widest vectors that the processor has.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn products(shapes: [&[f64]; SIDE_BY_SIDE], other: &[f64]) -> [f64; SIDE_BY_SIDE] {
    let mut sums = [[0.0; 8]; SIDE_BY_SIDE];
    let (chunks, rest) = other.as_chunks::<8>();
    let parts = shapes.map(|shape| shape.as_chunks::<8>());
    for (place, other) in chunks.iter().enumerate() {
        for (sums, (shape, _)) in sums.iter_mut().zip(&parts) {
            for lane in 0..8 {
                sums[lane] += shape[place][lane] * other[lane];
            }
        }
    }
    let mut found = [0.0; SIDE_BY_SIDE];
    for ((found, sums), (_, last)) in found.iter_mut().zip(sums).zip(parts) {
        *found = sums.iter().sum::<f64>() + last.iter().zip(rest).map(|(a, b)| a * b).sum::<f64>();
    }
    found
}

/// Takes the part along the basis away.
fn remove(basis: &[Vec<f64>], shape: &mut [f64]) {
    for direction in basis {
        let part = crate::linalg::dot(direction, shape);
        shape.iter_mut().zip(direction).for_each(|(s, d)| *s -= part * d);
    }
}

impl Search {
    /// For each place of a left vortex the best one of a right vortex with positive circulations of both.
    pub(crate) fn pairs(&self) -> Vec<Pair> {
        let (towards, squares) = self.products();
        // a few left ones at a time, so that the shapes, which are many, are read but once for them
        let some = map_indexed(
            self.places.len().div_ceil(SIDE_BY_SIDE),
            || (),
            |(), group| {
                let lefts: [usize; SIDE_BY_SIDE] =
                    std::array::from_fn(|i| (group * SIDE_BY_SIDE + i).min(self.places.len() - 1));
                let shapes = lefts.map(|left| &self.shapes[left][..]);
                let first_m = lefts.iter().map(|&left| self.places[left].lateral_m).fold(f64::INFINITY, f64::min);
                let mut best: [Option<Pair>; SIDE_BY_SIDE] = [None; SIDE_BY_SIDE];
                for right in 0..self.places.len() {
                    if self.places[right].lateral_m - first_m < CLOSEST_M {
                        continue;
                    }
                    let (b, bb) = (towards[right], squares[right]);
                    let along = products(shapes, &self.shapes[right]);
                    for ((&left, along), best) in lefts.iter().zip(along).zip(&mut best) {
                        // a clockwise vortex shows the opposite shape
                        let (a, aa, ab) = (-towards[left], squares[left], -along);
                        let determinant = aa * bb - ab * ab;
                        let strength = ((a * bb - b * ab) / determinant, (b * aa - a * ab) / determinant);
                        let apart_m = self.places[right].lateral_m - self.places[left].lateral_m;
                        let possible = strength.0 > 0.0 && strength.1 > 0.0 && determinant > 1e-6 * aa * bb;
                        let explained = strength.0 * a + strength.1 * b;
                        if apart_m >= CLOSEST_M && possible && best.is_none_or(|best| explained > best.explained) {
                            *best = Some(Pair { explained, left, right, strength });
                        }
                    }
                }
                best
            },
        );
        let mut best: Vec<Option<Pair>> = some.into_iter().flatten().collect();
        best.truncate(self.places.len());
        best.into_iter().flatten().collect()
    }

    /// The best place of one vortex of that sense of turning (-1 left, +1 right) alone: its circulation, lateral position, height.
    pub(crate) fn single(&self, sense: f64) -> Option<(f64, f64, f64)> {
        let (towards, squares) = self.products();
        let explained = |place: usize| (sense * towards[place]).max(0.0).powi(2) / squares[place];
        let best = (0..self.places.len()).reduce(|a, b| if explained(b) > explained(a) { b } else { a })?;
        let place = &self.places[best];
        let strength = sense * towards[best] / squares[best];
        (strength > 0.0).then_some((strength, place.lateral_m, place.height_m))
    }

    /// Products of the shapes with the data and with themselves.
    fn products(&self) -> (Vec<f64>, Vec<f64>) {
        let product = |shape: &Vec<f64>| (crate::linalg::dot(shape, &self.data), crate::linalg::dot(shape, shape));
        self.shapes.iter().map(product).unzip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_side_by_side_are_scalar_products_to_the_last_bit() {
        let shape = |seed: f64| (0..61).map(|i| (seed * f64::from(i * i)).sin()).collect::<Vec<f64>>();
        let (some, other) = ([1.1, 1.2, 1.3, 1.4].map(shape), shape(0.7));
        let found = products(std::array::from_fn(|i| &some[i][..]), &other);
        assert_eq!(found, some.map(|one| crate::linalg::dot(&one, &other)));
    }
}
