//! A first guess of the wake from the map alone: the best pair on a grid of places.
//!
//! The map is thinned to medians of blocks, which outliers do not move. For vortices at given places their
//! circulations and the wind enter linearly, so every pair of places on a polar grid is tried by least squares, the
//! left one clockwise and the right one anticlockwise as those of an aircraft are. Check: wakes at many places, in
//! noise and among outliers, come out near enough for the fit.

use ndarray::{Array1, Array2};

use crate::error::{Error, enough_velocities};
use crate::matched_filter::{Background, Cells, MatchedFilter};
use crate::vortex_fit::map_fit::data::ends;
use crate::vortex_fit::map_fit::starts::CORE_OVER_SPACING;
use crate::vortex_fit::top::distinct;
use crate::vortex_fit::{RangeKernel, VelocityMap, Vortex, Wake, WakeModel};

/// Velocities that are searched: medians of blocks stand for more.
pub(crate) const SEARCHED: usize = 1200;
/// Points of the weight of a gate are that many times as far apart.
const COARSER: usize = 4;
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
        let blocks = map.block_medians(map.blocks(SEARCHED));
        let cells = Cells::new(&blocks.view(), model);
        let velocities = cells.means(blocks.velocity_m_s.view())?;
        let background = Background::new(&cells, None, 0.0)?;
        let (places_m, core_m) = places(map, model);
        let kernel = kernel.coarser(COARSER);
        let (filter, gram) =
            MatchedFilter::new(model, kernel, cells, background, &places_m, core_m);
        let white = filter.white(velocities);
        Ok(Self {
            places_m,
            gram,
            towards: filter.shapes.dot(&white),
        })
    }

    /// Wakes of the best pairs with different places, the best first.
    pub(crate) fn wakes(&self) -> Vec<Wake> {
        let mut pairs = self.pairs();
        pairs.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut wakes = distinct(pairs.into_iter().map(|(_, wake)| wake), |a, b| {
            a.left.away_m(b.left.place_m()) < APART_M && a.right.away_m(b.right.place_m()) < APART_M
        });
        wakes.truncate(PAIRS);
        wakes
    }

    /// For each place of a left vortex the best pair with positive circulations, and the sum of squares that it explains.
    fn pairs(&self) -> Vec<(f64, Wake)> {
        let mut pairs = Vec::new();
        for (left, left_m) in self.places_m.iter().enumerate() {
            let mut best: Option<(f64, Wake)> = None;
            for (right, right_m) in self.places_m.iter().enumerate() {
                if right_m.0 - left_m.0 >= CLOSEST_M
                    && let Some((explained, wake)) = self.pair(left, right)
                    // the first of equals
                    && best.is_none_or(|(most, _)| explained > most)
                {
                    best = Some((explained, wake));
                }
            }
            pairs.extend(best);
        }
        pairs
    }

    /// The sum of squares that a pair at two places explains with the best circulations, and this pair without wind; nothing unless
    /// both circulations are positive.
    fn pair(&self, left: usize, right: usize) -> Option<(f64, Wake)> {
        // a clockwise vortex shows the opposite shape
        let a = -self.towards[left];
        let b = self.towards[right];
        let aa = self.gram[[left, left]];
        let bb = self.gram[[right, right]];
        let ab = -self.gram[[left, right]];
        let determinant = aa * bb - ab * ab;
        let left_m2_s = (a * bb - b * ab) / determinant;
        let right_m2_s = (b * aa - a * ab) / determinant;
        let is_possible = left_m2_s > 0.0 && right_m2_s > 0.0 && determinant > 1e-6 * aa * bb;
        if !is_possible {
            return None;
        }
        let left_m = self.places_m[left];
        let right_m = self.places_m[right];
        let core_m = CORE_OVER_SPACING * (right_m.0 - left_m.0);
        let pair = Wake::calm(
            Vortex::at(left_m, left_m2_s, core_m),
            Vortex::at(right_m, right_m2_s, core_m),
        );
        Some((left_m2_s * a + right_m2_s * b, pair))
    }

    /// The best place of one vortex of that sense of turning (-1 left, +1 right) alone, and its circulation.
    pub(crate) fn single(&self, sense: f64) -> Option<((f64, f64), f64)> {
        let mut best: Option<(usize, f64)> = None;
        for place in 0..self.places_m.len() {
            let explained =
                (sense * self.towards[place]).max(0.0).powi(2) / self.gram[[place, place]];
            if best.is_none_or(|(_, most)| explained > most) {
                best = Some((place, explained));
            }
        }
        let (best, _) = best?;
        let strength = sense * self.towards[best] / self.gram[[best, best]];
        (strength > 0.0).then_some((self.places_m[best], strength))
    }
}

/// A polar grid of places over a scan, and the core radius of vortices there: half the distance of places across the lines, so that what is between
/// them is not missed.
fn places(map: &VelocityMap<'_>, model: &WakeModel) -> (Vec<(f64, f64)>, f64) {
    let (first_rad, last_rad) = ends(map.elevation_rad);
    let (near_m, far_m) = ends(map.range_m);
    let mut places_m = Vec::new();
    for i in 0..PLACES {
        let range_m = near_m + (far_m - near_m) * (i as f64 + 0.5) / PLACES as f64;
        for j in 0..PLACES {
            let elevation_rad =
                first_rad + (last_rad - first_rad) * (j as f64 + 0.5) / PLACES as f64;
            let place_m = model.position_m(range_m, elevation_rad);
            if !model.images || place_m.1 > 0.0 {
                places_m.push(place_m);
            }
        }
    }
    let core_m = 0.5 * far_m * (last_rad - first_rad) / PLACES as f64;
    (places_m, core_m.max(1.0))
}
