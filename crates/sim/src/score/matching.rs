//! Which predicted vortex is which true one, scan by scan.
//!
//! A pair may match if the side is equal or not stated, and the distance is at most half the spacing of the flight. Of all
//! assignments the one is taken with most scored vortices, then most pairs, then the least sum of squared distances, then the
//! earlier rows. There are at most two true vortices, so all assignments are tried.
//! Check: ties, vortices that are ignored, and sides, by hand; the reference case.

use super::predictions::{PredictedScan, PredictedVortex};
use super::truth::{TrueScan, TrueVortex};

/// A scan with what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MatchedScan {
    /// Scored vortices, each with its prediction if it was found.
    pub(super) scored: Vec<(TrueVortex, Option<PredictedVortex>)>,
    /// Predicted vortices that are none.
    pub(super) false_vortices: usize,
    /// Whether no vortex exists. A scan with ignored vortices alone has no wake and is not empty.
    pub(super) is_empty: bool,
    /// Whether anything was predicted.
    pub(super) has_predicted: bool,
    /// How sure the method is of a wake.
    pub(super) score: Option<f64>,
}

impl MatchedScan {
    /// Matches a scan. `reach_m`: largest distance of a pair, m; `least_m2_s`: least circulation of scored vortices, m²/s.
    pub(super) fn new(
        truth: &TrueScan,
        predicted: &PredictedScan,
        reach_m: f64,
        least_m2_s: f64,
    ) -> Self {
        let vortices = &truth.vortices;
        let assignment = assign(vortices, &predicted.vortices, reach_m, least_m2_s);
        let mut scored = Vec::new();
        for (vortex, found) in vortices.iter().zip(&assignment.found) {
            if vortex.is_scored(least_m2_s) {
                scored.push((*vortex, found.map(|index| predicted.vortices[index])));
            }
        }
        Self {
            scored,
            false_vortices: predicted.vortices.len() - assignment.pairs,
            is_empty: vortices.is_empty(),
            has_predicted: !predicted.vortices.is_empty(),
            score: predicted.score,
        }
    }

    /// Whether a scored vortex is there.
    pub(super) fn has_wake(&self) -> bool {
        !self.scored.is_empty()
    }
}

/// Which prediction each of the first true vortices has.
#[derive(Debug, Clone, Default, PartialEq)]
struct Assignment {
    /// Index of the prediction of each true vortex, or none.
    found: Vec<Option<usize>>,
    /// Pairs with a scored vortex.
    scored: usize,
    /// All pairs.
    pairs: usize,
    /// Sum of squared distances, m².
    cost_m2: f64,
}

impl Assignment {
    fn is_better_than(&self, other: &Self) -> bool {
        let counts = (self.scored, self.pairs);
        let others = (other.scored, other.pairs);
        counts > others || (counts == others && self.cost_m2 < other.cost_m2)
    }

    /// With the next true vortex unmatched.
    fn without(&self) -> Self {
        let mut longer = self.clone();
        longer.found.push(None);
        longer
    }

    /// With the next true vortex matched.
    fn with(&self, index: usize, cost_m2: f64, is_scored: bool) -> Self {
        let mut longer = self.clone();
        longer.found.push(Some(index));
        longer.scored += usize::from(is_scored);
        longer.pairs += 1;
        longer.cost_m2 += cost_m2;
        longer
    }
}

/// The best assignment.
fn assign(
    truth: &[TrueVortex],
    predicted: &[PredictedVortex],
    reach_m: f64,
    least_m2_s: f64,
) -> Assignment {
    // Complete after each vortex; earlier rows come first, so that of equal ones the first is kept.
    let mut all = vec![Assignment::default()];
    for vortex in truth {
        let is_scored = vortex.is_scored(least_m2_s);
        let mut longer = Vec::new();
        for before in &all {
            for (index, candidate) in predicted.iter().enumerate() {
                let is_free = !before.found.contains(&Some(index));
                let cost_m2 = squared_distance_m2(vortex, candidate, reach_m);
                if let (true, Some(cost_m2)) = (is_free, cost_m2) {
                    longer.push(before.with(index, cost_m2, is_scored));
                }
            }
            longer.push(before.without());
        }
        all = longer;
    }
    let mut best: Option<Assignment> = None;
    for assignment in all {
        if best
            .as_ref()
            .is_none_or(|best| assignment.is_better_than(best))
        {
            best = Some(assignment);
        }
    }
    best.unwrap_or_default()
}

/// Squared distance of a pair that may match, m².
fn squared_distance_m2(
    vortex: &TrueVortex,
    candidate: &PredictedVortex,
    reach_m: f64,
) -> Option<f64> {
    if candidate.side.is_some_and(|side| side != vortex.side) {
        return None;
    }
    let y_m = candidate.values.y_m - vortex.values.y_m;
    let z_m = candidate.values.z_m - vortex.values.z_m;
    let squared_m2 = y_m * y_m + z_m * z_m;
    (squared_m2 <= reach_m * reach_m).then_some(squared_m2)
}

#[cfg(test)]
mod tests {
    use super::super::truth::VortexValues;
    use super::*;
    use wakescope_estimate::retrieval::Side;

    fn vortex(side: Side, y_m: f64, gamma_5_15_m2_s: f64) -> TrueVortex {
        let values = VortexValues {
            y_m,
            z_m: 50.0,
            gamma_5_15_m2_s,
        };
        TrueVortex {
            side,
            values,
            is_in_view: true,
        }
    }

    fn prediction(side: Option<Side>, y_m: f64) -> PredictedVortex {
        PredictedVortex {
            side,
            values: vortex(Side::Left, y_m, 200.0).values,
            deviations: VortexValues {
                y_m: f64::NAN,
                z_m: f64::NAN,
                gamma_5_15_m2_s: f64::NAN,
            },
        }
    }

    fn found(truth: &[TrueVortex], predicted: &[PredictedVortex]) -> Vec<Option<usize>> {
        assign(truth, predicted, 20.0, 50.0).found
    }

    #[test]
    fn sides_and_distances_decide_what_may_match() {
        let pair = [
            vortex(Side::Left, 0.0, 300.0),
            vortex(Side::Right, 40.0, 300.0),
        ];
        let swapped = [
            prediction(Some(Side::Right), 1.0),
            prediction(Some(Side::Left), 39.0),
        ];
        assert_eq!(found(&pair, &swapped), [None, None]);
        let any = [prediction(None, 39.0), prediction(None, 1.0)];
        assert_eq!(found(&pair, &any), [Some(1), Some(0)]);
        assert_eq!(found(&pair, &[prediction(None, 20.0)]), [Some(0), None]);
        assert_eq!(found(&pair, &[prediction(None, -20.1)]), [None, None]);
    }

    #[test]
    fn scored_vortices_go_before_pairs_and_pairs_before_distances() {
        // One prediction between a vortex that is ignored, nearer, and one that is scored.
        let weak = [
            vortex(Side::Left, 0.0, 40.0),
            vortex(Side::Right, 15.0, 60.0),
        ];
        assert_eq!(found(&weak, &[prediction(None, 2.0)]), [None, Some(0)]);
        // Both are matched although one alone would lie at no distance.
        let pair = [
            vortex(Side::Left, 0.0, 300.0),
            vortex(Side::Right, 15.0, 300.0),
        ];
        let both = [prediction(None, 15.0), prediction(None, 30.0)];
        assert_eq!(found(&pair, &both), [Some(0), Some(1)]);
        // Equal distances: the earlier row.
        let twins = [prediction(None, 3.0), prediction(None, -3.0)];
        assert_eq!(found(&pair[..1], &twins), [Some(0)]);
    }

    #[test]
    fn ignored_vortices_are_neither_found_nor_missed_nor_false() {
        let truth = TrueScan {
            age_tau: 1.0,
            vortices: vec![vortex(Side::Left, 0.0, 40.0)],
        };
        let predicted = PredictedScan {
            vortices: vec![prediction(None, 1.0), prediction(None, 2.0)],
            score: None,
        };
        let matched = MatchedScan::new(&truth, &predicted, 20.0, 50.0);
        assert!(matched.scored.is_empty());
        assert_eq!(matched.false_vortices, 1);
        assert!(!matched.has_wake() && !matched.is_empty && matched.has_predicted);
    }
}
