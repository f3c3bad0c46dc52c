//! A first guess of the wake from the map alone: the best pair on a grid of places.
//!
//! The map is thinned to medians of blocks, which outliers do not move. For vortices at given places their
//! circulations and the wind enter linearly, so every pair of places on a polar grid is tried by least squares, the
//! left one clockwise and the right one anticlockwise as those of an aircraft are. Check: wakes at many places, in
//! noise and among outliers, come out near enough for the fit; maps of noise hold no vortex.

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
/// Velocities that a search needs.
const NEEDED: usize = 100;
/// Least significance: explained sum of squares over the variance of what is left, per number of the pair.
const SIGNIFICANT: f64 = 60.0;

/// The thinned map: one number per block.
struct Thinned {
    elevation_rad: Vec<f64>,
    range_m: Vec<f64>,
    /// Median velocity \[line, gate\]; NaN without any.
    velocity: Vec<f64>,
}

fn thin(map: &VelocityMap<'_>) -> Thinned {
    let blocks = |axis: &[f64]| -> Vec<(usize, usize)> {
        let size = axis.len().div_ceil(BLOCKS);
        (0..axis.len()).step_by(size).map(|from| (from, (from + size).min(axis.len()))).collect()
    };
    let middle = |axis: &[f64], (from, to): (usize, usize)| axis[from..to].iter().sum::<f64>() / (to - from) as f64;
    let (lines, gates) = (blocks(map.elevation_rad), blocks(map.range_m));
    let mut velocity = Vec::with_capacity(lines.len() * gates.len());
    for &(first, last) in &lines {
        for &(from, to) in &gates {
            let block = map.velocity_m_s.slice(ndarray::s![first..last, from..to]);
            let mut finite: Vec<f64> = block.iter().copied().filter(|v| v.is_finite()).collect();
            velocity.push(median(&mut finite));
        }
    }
    Thinned {
        elevation_rad: lines.iter().map(|&block| middle(map.elevation_rad, block)).collect(),
        range_m: gates.iter().map(|&block| middle(map.range_m, block)).collect(),
        velocity,
    }
}

/// A place on the grid, and what a vortex of unit circulation there would show.
struct Place {
    lateral_m: f64,
    height_m: f64,
    shape: Vec<f64>,
}

/// The best pair of vortices on a grid of places.
///
/// # Errors
/// [`Error::TooFewVelocities`] with less than a hundred velocities, [`Error::NoVortex`] if no pair stands out.
pub(crate) fn first_guess(map: &VelocityMap<'_>, model: &WakeModel, kernel: &RangeKernel) -> Result<Wake, Error> {
    let found = map.validate()?;
    if found < NEEDED {
        return Err(Error::TooFewVelocities { found, needed: NEEDED });
    }
    let thinned = thin(map);
    let places = places(&thinned, model, kernel);
    let wind = wind_shapes(&thinned, model);
    let mut data: Vec<f64> = thinned.velocity.clone();
    let known: Vec<bool> = data.iter().map(|v| v.is_finite()).collect();
    data.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
    let basis = orthonormal(wind, &known);
    remove(&basis, &mut data);
    let shapes: Vec<Vec<f64>> = map_indexed(
        places.len(),
        || (),
        |(), i| {
            let mut shape = places[i].shape.clone();
            shape.iter_mut().zip(&known).filter(|(_, known)| !**known).for_each(|(s, _)| *s = 0.0);
            remove(&basis, &mut shape);
            shape
        },
    );
    let (explained, left, right, strength) =
        best_pair(&places, &shapes, &data).ok_or(Error::NoVortex { significance: 0.0, needed: SIGNIFICANT })?;
    let mut rest: Vec<f64> = (0..data.len())
        .filter(|&i| known[i])
        .map(|i| (data[i] + strength.0 * shapes[left][i] - strength.1 * shapes[right][i]).abs())
        .collect();
    let deviation = median(&mut rest) / 0.674_5;
    let significance = explained / (deviation * deviation) / 6.0;
    if significance.is_nan() || significance < SIGNIFICANT {
        return Err(Error::NoVortex { significance, needed: SIGNIFICANT });
    }
    let spacing_m = places[right].lateral_m - places[left].lateral_m;
    let vortex = |place: &Place, circulation_m2_s| Vortex {
        circulation_m2_s,
        lateral_position_m: place.lateral_m,
        height_m: place.height_m,
        core_radius_m: CORE_OVER_SPACING * spacing_m,
    };
    Ok(Wake {
        left: vortex(&places[left], strength.0),
        right: vortex(&places[right], strength.1),
        lateral_wind_m_s: 0.0,
        wind_shear_per_s: 0.0,
    })
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

/// An orthonormal basis of shapes, zero where nothing is known.
fn orthonormal(shapes: [Vec<f64>; 2], known: &[bool]) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut shape in shapes {
        shape.iter_mut().zip(known).filter(|(_, known)| !**known).for_each(|(s, _)| *s = 0.0);
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

/// Takes the part along the basis away.
fn remove(basis: &[Vec<f64>], shape: &mut [f64]) {
    for direction in basis {
        let part = crate::linalg::dot(direction, shape);
        shape.iter_mut().zip(direction).for_each(|(s, d)| *s -= part * d);
    }
}

/// (explained sum of squares, left place, right place, circulations) of the best pair with positive circulations.
fn best_pair(places: &[Place], shapes: &[Vec<f64>], data: &[f64]) -> Option<(f64, usize, usize, (f64, f64))> {
    let towards: Vec<f64> = shapes.iter().map(|shape| crate::linalg::dot(shape, data)).collect();
    let squares: Vec<f64> = shapes.iter().map(|shape| crate::linalg::dot(shape, shape)).collect();
    let best = map_indexed(
        places.len(),
        || (),
        |(), left| {
            let mut best: Option<(f64, usize, usize, (f64, f64))> = None;
            // a clockwise vortex shows the opposite shape
            let (a, aa) = (-towards[left], squares[left]);
            for right in 0..places.len() {
                if places[right].lateral_m - places[left].lateral_m < 2.0 {
                    continue;
                }
                let (b, bb) = (towards[right], squares[right]);
                if a <= 0.0 && b <= 0.0 {
                    continue;
                }
                let ab = -crate::linalg::dot(&shapes[left], &shapes[right]);
                let determinant = aa * bb - ab * ab;
                let strength = ((a * bb - b * ab) / determinant, (b * aa - a * ab) / determinant);
                if !(strength.0 > 0.0 && strength.1 > 0.0 && determinant > 1e-6 * aa * bb) {
                    continue;
                }
                let explained = strength.0 * a + strength.1 * b;
                if best.is_none_or(|(most, ..)| explained > most) {
                    best = Some((explained, left, right, strength));
                }
            }
            best
        },
    );
    // the first of equals, whoever computed it
    best.into_iter().flatten().reduce(|most, next| if next.0 > most.0 { next } else { most })
}
