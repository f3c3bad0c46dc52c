//! The circulation of each vortex of a pair from what is near it alone, where the pair does not explain a scan.
//!
//! What the boundary layer at the ground and turbulence do far from a vortex is no part of the model, and a fit of the whole map pays for it with
//! the circulation: of a wake that the ground has driven apart it finds a quarter too little. So the circulation of each vortex is fitted once more
//! to the velocities about it, in a wind of its own, with all else as the pair has it. Where that explains them no better the pair stands, which
//! takes from the whole map what these fits take from a part. Check: pairs in winds that differ; simulated wakes.

use ndarray::{Array2, s};

use crate::linalg::positive_definite::inverse;
use crate::vortex_fit::levenberg_marquardt::StoppingRule;
use crate::vortex_fit::map_fit::least_squares::{CURVATURE, LeastSquares, Scores, submatrix};
use crate::vortex_fit::map_fit::prediction::Linear;
use crate::vortex_fit::map_fit::setting::Setting;
use crate::vortex_fit::{MapFit, Parameter, Sharing, Wake};

/// How far what is near a vortex reaches: the circle of 15 m over which circulations are averaged, and some more \[m\].
pub(crate) const REACH_M: f64 = 20.0;
/// Least gain of the logarithm of the likelihood by both vortices, with velocities that say the same counted once, for the four numbers that are
/// free: chance alone gives two in the mean. How many maps reach it is in `theory/retrieval.md`.
const LEAST_GAIN: f64 = 6.0;
/// Fewest velocities near a vortex: ten for each free number.
const FEWEST: usize = 20;
pub(crate) const CIRCULATIONS: [Parameter; 2] =
    [Parameter::LeftCirculation, Parameter::RightCirculation];

/// The circulation of one vortex from what is near it.
pub(crate) struct Local {
    circulation_m2_s: f64,
    variance: f64,
    /// Of the logarithm of the likelihood over the pair.
    gain: f64,
}

impl Setting<'_, '_> {
    /// That of one vortex from this map, which holds what is near it alone; nothing where that is too little, turns
    /// the other way round, or the fit comes to no end.
    pub(crate) fn local_circulation(
        &self,
        pair: &Wake,
        side: usize,
        stop: StoppingRule,
    ) -> Option<Local> {
        let best = self.settled_nearby(pair, side, stop)?;
        let alone = self.linear(&pair.to_array(), &best.groups, None).ok()?;
        if best.shared_with(&alone).len() < FEWEST {
            return None;
        }
        let scores = Scores::OfNeighbours {
            lines: self.options.correlated_lines,
        };
        Some(Local {
            circulation_m2_s: best.at[CIRCULATIONS[side] as usize],
            variance: self.local_variance(&best, side, scores)?,
            gain: self.gain(&best, &alone),
        })
    }

    /// The model about the circulation of one vortex and the wind that this map alone gives.
    pub(crate) fn settled_nearby(
        &self,
        pair: &Wake,
        side: usize,
        stop: StoppingRule,
    ) -> Option<Linear> {
        if self.options.free.circulation != Sharing::Separate {
            return None;
        }
        let own = CIRCULATIONS[side] as usize;
        let groups = [vec![own], vec![Parameter::Wind as usize]];
        let start = pair.to_array().to_vec();
        let best = self.settled(start, &groups, stop, None).ok()?;
        (best.cells.len() >= FEWEST && best.at[own] > 0.0).then_some(best)
    }

    /// Variance of the circulation of one vortex from what is near it \[m⁴/s²\].
    pub(crate) fn local_variance(
        &self,
        best: &Linear,
        side: usize,
        scores: Scores<'_>,
    ) -> Option<f64> {
        let own = CIRCULATIONS[side] as usize;
        let squares = self.about(best);
        let uncertainty = squares.uncertainty(&best.at, &best.groups, scores);
        Some(uncertainty.ok()?.covariance(|_| true).ok()?[[own, own]])
    }
}

impl Setting<'_, '_> {
    /// Variance of a local circulation from what is not known of the other numbers of the pair, which it keeps \[m⁴/s²\]: J C J^T, J the shift of
    /// the circulation for that of each of them.
    pub(crate) fn variance_of_pair(
        &self,
        best: &Linear,
        (groups, covariance): (&[Vec<usize>], &Array2<f64>),
    ) -> Option<f64> {
        let own = best.groups.len();
        let mut all = best.groups.clone();
        for group in groups {
            if !best.groups.contains(group) {
                all.push(group.clone());
            }
        }
        let p = &best.at;
        let linear = self.linear(p, &all, None).ok()?;
        let squares = LeastSquares {
            prior: None,
            pair_prior: None,
            ..self.about(&linear)
        };
        let curvature = squares.normal(p, &all)?.curvature;
        let of_own = inverse(CURVATURE, &submatrix(&curvature, &[0, 1])).ok()?;
        let shifts = of_own.dot(&curvature.slice(s![..own, own..]));
        let mut variance = 0.0;
        for (i, a) in all[own..].iter().enumerate() {
            for (j, b) in all[own..].iter().enumerate() {
                variance += shifts[[0, i]] * covariance[[a[0], b[0]]] * shifts[[0, j]];
            }
        }
        Some(variance)
    }
}

/// The pair with such circulations, if both together explain enough more. Their variances are no smaller than those of the pair, whose other numbers
/// and correlations stay.
pub(crate) fn joined(pair: &MapFit, local: &[Option<Local>; 2]) -> Option<MapFit> {
    if local.iter().flatten().map(|local| local.gain).sum::<f64>() < LEAST_GAIN {
        return None;
    }
    let mut p = pair.wake.to_array();
    let mut covariance = pair.covariance.clone();
    for (at, local) in CIRCULATIONS
        .into_iter()
        .map(|parameter| parameter as usize)
        .zip(local)
    {
        let Some(local) = local else { continue };
        p[at] = local.circulation_m2_s;
        covariance[[at, at]] = local.variance.max(covariance[[at, at]]);
    }
    Some(MapFit {
        wake: Wake::from_array(&p),
        covariance,
        ..pair.clone()
    })
}
