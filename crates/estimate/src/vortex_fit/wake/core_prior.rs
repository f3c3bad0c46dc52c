//! What is known before a fit: the logarithm of the core radius over the spacing of the vortices is normal, and how strong secondary vortices are and
//! how far from their vortex.
//!
//! A map that does not resolve the cores tells little of them, and the circulation depends on them: kept at a typical value they
//! shift it without a word, fitted freely they run away. With the density of what is known the fit takes as much from either as
//! it tells, and the covariance holds what neither does. Check: difference quotients; the spread of fits over many maps.

use crate::error::{Error, positive};
use crate::vortex_fit::wake::free_parameters::{gathered, stepped};
use crate::vortex_fit::wake::pair::SECONDARY_PARAMETERS;
use crate::vortex_fit::{PARAMETERS, Parameter, Wake};

/// Log-normal density of the core radius over the spacing of the vortices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorePrior {
    /// Its median, a core radius over the spacing.
    pub median_ratio: f64,
    /// Standard deviation of its natural logarithm.
    pub log_deviation: f64,
}

impl CorePrior {
    /// Median 4.5 % (3.5 % of the span of an elliptic wing, pi/4 of which is the spacing; the chapter: 3 to 5 % of the span, 3.8 to 6.4 % of the
    /// spacing); 2.5 and 8 % are 1.2 standard deviations away.
    pub const TYPICAL: Self = Self {
        median_ratio: 0.045,
        log_deviation: 0.5,
    };

    pub(crate) fn validate(&self) -> Result<(), Error> {
        positive("median_ratio", self.median_ratio)?;
        positive("log_deviation", self.log_deviation)
    }

    /// For each free number that moves core radii: how many deviations the core is away, and the derivatives of that by all
    /// free numbers. Nothing for one vortex, which has no spacing.
    pub(crate) fn terms(&self, wake: &Wake, groups: &[Vec<usize>]) -> Vec<(f64, Vec<f64>)> {
        if !wake.is_pair() {
            return Vec::new();
        }
        let p = wake.to_array();
        let spacing_m = wake.spacing_m();
        let mut terms = Vec::new();
        for place in groups
            .iter()
            .filter(|group| is_core(group))
            .map(|group| group[0])
        {
            let away = (p[place] / (self.median_ratio * spacing_m)).ln() / self.log_deviation;
            let mut all = [0.0; PARAMETERS];
            all[place] = (self.log_deviation * p[place]).recip();
            all[Parameter::LeftLateral as usize] = (self.log_deviation * spacing_m).recip();
            all[Parameter::RightLateral as usize] = -all[Parameter::LeftLateral as usize];
            let mut slope = vec![0.0; groups.len()];
            gathered(groups, &all, &mut slope);
            terms.push((away, slope));
        }
        terms
    }
}

/// Circulation of a secondary vortex over that of its vortex, and distance over its height: mean and standard deviation. The strongest one of the
/// medium wake (the mean along x) has -0.2 to -0.3 and 1.1 to 0.5 between tau = 1.25 and 2.5, without the weaker
/// vorticity about it that gates see as well.
const KNOWN_RATIO: (f64, f64) = (-0.4, 0.25);
const KNOWN_DISTANCE: (f64, f64) = (0.8, 0.4);
/// Core radius over the height of its vortex: median and standard deviation of the natural logarithm. Assumed: no measurement stands behind it.
pub(crate) const KNOWN_CORE: (f64, f64) = (0.12, 0.3);

/// For a list of parameters with secondary vortices, left before right: circulation of each over that of its vortex, distance over the height of the latter.
pub(crate) fn secondary_ratios(p: &[f64]) -> [(f64, f64); 2] {
    let wake = Wake::from_list(p);
    [
        (wake.left, PARAMETERS),
        (wake.right, PARAMETERS + SECONDARY_PARAMETERS),
    ]
    .map(|(own, at)| {
        let distance_m = (p[at + 1] - own.lateral_position_m).hypot(p[at + 2] - own.height_m);
        (p[at] / own.circulation_m2_s, distance_m / own.height_m)
    })
}

/// How many deviations each of these is away from what is known, and the derivatives of that by all free numbers.
pub(crate) fn secondary_terms(p: &[f64], groups: &[Vec<usize>]) -> Vec<(f64, Vec<f64>)> {
    let mut slopes: Vec<[f64; 6]> = Vec::with_capacity(groups.len());
    for group in groups {
        let step = 1e-6 * p[group[0]].abs().max(1.0);
        let [ahead, behind] = [step, -step].map(|by| {
            let stepped = stepped(std::slice::from_ref(group), p, &[by]);
            secondary_distances(&stepped)
        });
        slopes.push(std::array::from_fn(|i| {
            (ahead[i] - behind[i]) / (2.0 * step)
        }));
    }
    let mut terms = Vec::with_capacity(6);
    for (i, distance) in secondary_distances(p).into_iter().enumerate() {
        terms.push((distance, slopes.iter().map(|slope| slope[i]).collect()));
    }
    terms
}

/// Circulation, distance and core radius of the left, then of the right secondary vortex, in deviations from what is known of them.
fn secondary_distances(p: &[f64]) -> [f64; 6] {
    let mut distances = [0.0; 6];
    for (side, (ratio, distance)) in secondary_ratios(p).into_iter().enumerate() {
        let log_core = p[PARAMETERS + side * SECONDARY_PARAMETERS + 3];
        distances[3 * side] = (ratio - KNOWN_RATIO.0) / KNOWN_RATIO.1;
        distances[3 * side + 1] = (distance - KNOWN_DISTANCE.0) / KNOWN_DISTANCE.1;
        distances[3 * side + 2] = (log_core - KNOWN_CORE.0.ln()) / KNOWN_CORE.1;
    }
    distances
}

/// Whether a free number moves core radii.
pub(crate) fn is_core(group: &[usize]) -> bool {
    group.iter().all(|&place| {
        place == Parameter::LeftCore as usize || place == Parameter::RightCore as usize
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vortex_fit::wake::free_parameters::stepped;
    use crate::vortex_fit::{FreeParameters, Sharing};

    #[test]
    fn secondary_vortices_are_so_many_deviations_from_what_is_known() {
        let wake = Wake::from_array(&[
            480.0, 520.0, 376.5, 40.0, 423.5, 50.0, 2.0, 2.0, 1.3, 0.0, 0.0,
        ]);
        // one deviation stronger, farther and wider; half of one weaker, nearer and narrower
        let mut p = wake.to_array().to_vec();
        p.extend([-0.65 * 480.0, 376.5 - 1.2 * 40.0, 40.0, 0.12_f64.ln() + 0.3]);
        p.extend([
            -0.275 * 520.0,
            423.5,
            50.0 + 0.6 * 50.0,
            0.12_f64.ln() - 0.15,
        ]);
        let terms = secondary_terms(&p, &[vec![PARAMETERS + 3]]);
        let away: Vec<f64> = terms.iter().map(|(away, _)| *away).collect();
        for (away, right) in away.iter().zip([-1.0, 1.0, 1.0, 0.5, -0.5, -0.5]) {
            assert!((away - right).abs() < 1e-9, "{away} {right}");
        }
        assert!((terms[2].1[0] - 1.0 / 0.3).abs() < 1e-6 && terms[5].1[0] == 0.0);
    }

    #[test]
    fn terms_are_distances_in_deviations_and_their_slopes_difference_quotients() {
        let wake = Wake::from_array(&[
            480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.0, 1.3, 0.02, 0.0,
        ]);
        for core_radius in [Sharing::Common, Sharing::Separate] {
            let groups = FreeParameters {
                core_radius,
                ..Default::default()
            }
            .groups();
            let terms = CorePrior::TYPICAL.terms(&wake, &groups);
            assert_eq!(
                terms.len(),
                if core_radius == Sharing::Common { 1 } else { 2 }
            );
            for (index, (away, slope)) in terms.iter().enumerate() {
                assert!((away - (2.0 / 47.0 / 0.045_f64).ln() / 0.5).abs() < 1e-12);
                for (number, slope) in slope.iter().enumerate() {
                    let at = |by: f64| {
                        let step: Vec<f64> = (0..groups.len())
                            .map(|i| if i == number { by } else { 0.0 })
                            .collect();
                        CorePrior::TYPICAL.terms(
                            &Wake::from_list(&stepped(&groups, &wake.to_array(), &step)),
                            &groups,
                        )[index]
                            .0
                    };
                    assert!(
                        (slope - (at(1e-4) - at(-1e-4)) / 2e-4).abs() < 1e-7,
                        "{number}"
                    );
                }
            }
        }
        let fixed = FreeParameters {
            core_radius: Sharing::Fixed,
            ..Default::default()
        }
        .groups();
        assert!(CorePrior::TYPICAL.terms(&wake, &fixed).is_empty());
    }
}
