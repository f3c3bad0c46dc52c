//! Secondary vortices: what the boundary layer at the ground rolls up into beside each vortex, and which turn against it.
//!
//! Gates that are longer than the distance of a vortex from its secondary one see both at once: a fit of two vortices then puts them metres
//! to the side and some tenths too weak. So the residuals of such a fit are searched for a vortex of the other sense near each of
//! the two, beside all that the pair or another profile of its vortices could do about them. If both together explain enough, all four are
//! fitted at once: secondary vortices are eight parameters more. Of them it is known before how strong they are, how far from their vortex,
//! and how wide. Check: exact maps with four vortices, and with two; simulated wakes.

use ndarray::{Array1, Array2};

use crate::linalg::positive_definite::inverse;
use crate::vortex_fit::map_fit::cells::{products, scaled};
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::least_squares::Scores;
use crate::vortex_fit::map_fit::prediction::Linear;
use crate::vortex_fit::map_fit::setting::Setting;
use crate::vortex_fit::tolerances::SECONDARY;
use crate::vortex_fit::wake::core_prior::{KNOWN_CORE, secondary_ratios};
use crate::vortex_fit::wake::pair::SECONDARY_PARAMETERS;
use crate::vortex_fit::{PARAMETERS, Secondary, Vortex, Wake, WakeModel};

/// What is allowed in the search, and in the end of any opposite circulation, of the circulation over that of the vortex and of the distance over
/// its height.
const RATIOS: (f64, f64) = (-0.8, -0.05);
const DISTANCES: (f64, f64) = (0.25, 1.5);
/// Least distance in the end: two vortices nearer than that are parts of one.
const LEAST_DISTANCE: f64 = 0.4;
/// Heights, over the spacing of the pair, above which a vortex has drawn nothing up from the ground, also after it has rebounded.
const HIGHEST: f64 = 1.5;
/// Distance of the places of the search over the height of the vortex.
const GRID_OVER_HEIGHT: f64 = 0.12;
/// Least gain of the logarithm of the likelihood by both, with velocities that say the same counted once: in the end by what is alike in the residuals
/// of four vortices, in the search by the residuals of the pair, which are alike where it misses vortices.
pub(crate) const LEAST_GAIN: f64 = 20.0;
/// Numbers of the secondary vortices that are fitted.
const NUMBERS: usize = 2 * SECONDARY_PARAMETERS;

/// Secondary vortices, of the left and of the right vortex, that were found beside a pair.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondaryVortices {
    /// The best ones.
    pub vortices: [Vortex; 2],
    /// Whether the map shows them.
    pub shown: bool,
    /// Whether they are fitted: they are where the map shows them, unless the options say [`Secondary::Never`] or [`Secondary::Always`].
    pub fitted: bool,
    /// The pair of the fit of all four.
    pub(crate) wake: Wake,
    /// Of the wake alone \[10, 10\], whatever the secondary vortices are.
    pub(crate) covariance: Array2<f64>,
}

/// Residuals of a pair, over their deviations, and what its free numbers can do about them.
struct Residuals<'a> {
    pair: &'a Wake,
    linear: &'a Linear,
    weights: Vec<f64>,
    /// Weighted.
    residuals: Vec<f64>,
    slopes: Vec<Vec<f64>>,
    /// Of the curvature.
    inverse: Array2<f64>,
    /// Where the free numbers go.
    step: Array1<f64>,
}

/// Whether a secondary vortex is nearer to its own one than to the other: else it may stand for a part of the other, which turns as it does.
fn is_beside(secondary: &Vortex, own: &Vortex, other: &Vortex) -> bool {
    distance_m(secondary, own) < distance_m(secondary, other)
}

fn distance_m(a: &Vortex, b: &Vortex) -> f64 {
    (a.lateral_position_m - b.lateral_position_m).hypot(a.height_m - b.height_m)
}

/// Every `step`th place of the grid in a square about one of them.
fn grid(centre: (i64, i64), reach: i64, step: usize) -> impl Iterator<Item = (i64, i64)> {
    let rows = (centre.0 - reach..=centre.0 + reach).step_by(step);
    let columns = (centre.1 - reach..=centre.1 + reach).step_by(step);
    rows.flat_map(move |i| columns.clone().map(move |j| (i, j)))
}

impl Setting<'_, '_> {
    /// The best wake with secondary vortices, if the map shows any or they are fitted anyway, and the fit of all comes to an end. Without a ground
    /// there are none.
    pub(crate) fn with_secondary(&self, pair: &Wake) -> Option<SecondaryVortices> {
        let vortices = [pair.left, pair.right];
        let are_above_ground = vortices
            .iter()
            .all(|vortex| vortex.circulation_m2_s > 0.0 && vortex.height_m > 0.0);
        if !self.model.images || !are_above_ground {
            return None;
        }
        let always = self.options.secondary == Secondary::Always;
        // what is not understood of one vortex in view may be its partner beyond the scan
        if !always && !vortices.iter().all(|vortex| self.sees(vortex)) {
            return None;
        }
        let lines = self.options.correlated_lines;
        let mut groups = self.options.free.groups();
        let mut start = pair.to_array().to_vec();
        let alone = self.linear(&start, &groups, None).ok()?;
        let counted = self.about(&alone).alike(&start, lines);
        let (secondary, gain, of_profile) = self.search(pair, &alone)?;
        if gain < LEAST_GAIN.max(counted) && !always {
            return None;
        }
        for vortex in secondary {
            start.extend([
                vortex.circulation_m2_s,
                vortex.lateral_position_m,
                vortex.height_m,
                KNOWN_CORE.0.ln(),
            ]);
        }
        groups.extend((PARAMETERS..PARAMETERS + NUMBERS).map(|place| vec![place]));
        let mut settled = self
            .settled(start, &groups, SECONDARY, Some(counted))
            .ok()?;
        // what two vortices miss looks like noise that neighbours share: what four leave tells how many velocities count as one
        settled.counted = self.about(&settled).alike(&settled.at, lines).min(counted);
        let gain = self.gain(&settled, &alone) - of_profile / settled.counted;
        self.found(&settled, gain)
    }

    /// What is reported of a fit of four vortices that gains so much of the logarithm of the likelihood; nothing if the map does not show the
    /// secondary ones and they are not requested.
    fn found(&self, settled: &Linear, gain: f64) -> Option<SecondaryVortices> {
        let p = &settled.at;
        // one far from its vortex stands for something else; a little beyond the scan it may be
        let are_near = secondary_ratios(p).into_iter().all(|(ratio, distance)| {
            (RATIOS.0..0.0).contains(&ratio) && (LEAST_DISTANCE..=DISTANCES.1).contains(&distance)
        });
        let (model, wake) = self.model.with(p);
        let vortices = model.secondary?;
        let are_beside = is_beside(&vortices[0], &wake.left, &wake.right)
            && is_beside(&vortices[1], &wake.right, &wake.left);
        let highest_m = HIGHEST * wake.spacing_m();
        let are_low = wake.left.height_m.max(wake.right.height_m) < highest_m;
        let shown = gain >= LEAST_GAIN && are_near && are_beside && are_low;
        let always = self.options.secondary == Secondary::Always;
        let fitted = always || shown && self.options.secondary == Secondary::Auto;
        if !shown && !fitted {
            return None;
        }
        let scores = Scores::OfNeighbours {
            lines: self.options.correlated_lines,
        };
        let squares = self.about(settled);
        let uncertainty = squares.uncertainty(p, &settled.groups, scores).ok()?;
        Some(SecondaryVortices {
            vortices,
            shown,
            fitted,
            wake,
            covariance: uncertainty.covariance(|_| true).ok()?,
        })
    }

    /// The vortices of the other sense, one beside each of the pair, that explain most of its residuals by their means over gates if the pair
    /// may move along its slopes, how much of the logarithm of the likelihood, and how much these slopes explain.
    fn search(&self, pair: &Wake, alone: &Linear) -> Option<([Vortex; 2], f64, f64)> {
        let groups = self.options.free.groups();
        let rows = self.about(alone).rows(&alone.at, &groups);
        let mut slopes = rows.slopes;
        // a profile that does not fit is not mended by vortices
        let other = self.prediction.of_other_profile(pair) - &alone.here.velocity_m_s;
        let of_profile = alone
            .cells
            .iter()
            .map(|cell| other[[cell.line, cell.gate]] / cell.sigma_m_s);
        slopes.push(
            of_profile
                .map(|slope| if slope.is_finite() { slope } else { 0.0 })
                .collect(),
        );
        let weights: Vec<f64> = rows
            .residuals
            .iter()
            .map(|r| self.options.loss.at(*r).1)
            .collect();
        let residuals = scaled(&weights, &rows.residuals);
        let inverse = inverse("curvature of the fit", &products(&weights, &slopes)).ok()?;
        let gradient: Array1<f64> = slopes
            .iter()
            .map(|slope| crate::linalg::dot(slope, &residuals))
            .collect();
        let step = inverse.dot(&gradient);
        let explained = 0.5 * gradient.dot(&step);
        let free = Residuals {
            pair,
            linear: alone,
            weights,
            residuals,
            slopes,
            inverse,
            step,
        };
        let (left, a) = self.beside(0, &free)?;
        let (right, b) = self.beside(1, &free)?;
        Some(([left, right], a + b, explained))
    }

    /// Every second place of a grid first, then those about the best of them.
    fn beside(&self, side: usize, free: &Residuals<'_>) -> Option<(Vortex, f64)> {
        let count = (DISTANCES.1 / GRID_OVER_HEIGHT).ceil() as i64;
        let (place, _) = self.best_of(side, grid((0, 0), count, 2), free)?;
        let (_, found) = self.best_of(side, grid(place, 1, 1), free)?;
        Some(found)
    }

    /// The place with the vortex that gains most, the last of equals, and what it gains.
    fn best_of(
        &self,
        side: usize,
        places: impl Iterator<Item = (i64, i64)>,
        free: &Residuals<'_>,
    ) -> Option<((i64, i64), (Vortex, f64))> {
        let gains = places.filter_map(|place| Some((place, self.at_place(side, place, free)?)));
        gains.max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1))
    }

    /// The best vortex at a place of the grid about one of the pair, and what it gains; nothing where there can be none.
    fn at_place(
        &self,
        side: usize,
        (i, j): (i64, i64),
        free: &Residuals<'_>,
    ) -> Option<(Vortex, f64)> {
        let own = [free.pair.left, free.pair.right][side];
        let step_m = GRID_OVER_HEIGHT * own.height_m;
        let place_m = (
            own.lateral_position_m + i as f64 * step_m,
            own.height_m + j as f64 * step_m,
        );
        let vortex = Vortex::at(place_m, 1.0, KNOWN_CORE.0 * own.height_m);
        let distance = GRID_OVER_HEIGHT * (i as f64).hypot(j as f64);
        if !(DISTANCES.0..=DISTANCES.1).contains(&distance)
            || vortex.height_m <= 0.0
            || !self.sees(&vortex)
        {
            return None;
        }
        let plain = WakeModel {
            secondary: None,
            ..*self.model
        };
        let nowhere = Vortex {
            circulation_m2_s: 0.0,
            ..own
        };
        let (left, right) = if side == 0 {
            (vortex, nowhere)
        } else {
            (nowhere, vortex)
        };
        let places = (self.map.elevation_rad, self.map.range_m);
        let shown = Gates::at_rest(&plain, self.kernel.clone(), places)
            .velocities(&Wake::calm(left, right));
        let cells = free.linear.cells.iter();
        let shown: Vec<f64> = cells
            .map(|cell| shown[[cell.line, cell.gate]] / cell.sigma_m_s)
            .collect();
        let weighted = scaled(&free.weights, &shown);
        let shared: Array1<f64> = free
            .slopes
            .iter()
            .map(|slope| crate::linalg::dot(slope, &weighted))
            .collect();
        // what the pair could do as well does not count
        let square = crate::linalg::dot(&shown, &weighted) - shared.dot(&free.inverse.dot(&shared));
        let slope = crate::linalg::dot(&shown, &free.residuals) - shared.dot(&free.step);
        let allowed = (
            RATIOS.0 * own.circulation_m2_s,
            RATIOS.1 * own.circulation_m2_s,
        );
        let circulation_m2_s = (slope / square).clamp(allowed.0, allowed.1);
        let gain = circulation_m2_s * (slope - 0.5 * circulation_m2_s * square);
        (square > 0.0 && gain.is_finite()).then_some((
            Vortex {
                circulation_m2_s,
                ..vortex
            },
            gain,
        ))
    }

    /// Whether a centre lies within the scan.
    fn sees(&self, vortex: &Vortex) -> bool {
        self.model
            .sees((self.map.elevation_rad, self.map.range_m), vortex.place_m())
    }
}
