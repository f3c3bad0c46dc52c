//! Prior density of the pair behind an aircraft: its spacing is that of a wing, and both vortices carry the lift of one wing.
//!
//! Where a map shows little of a vortex, two kinds of pairs that no aircraft makes are as likely
//! without it: circulations of 1000 m^2/s and more a few metres apart, and a vortex beyond the last
//! gate, the stronger the farther away. Their covariance hides the circulation of the true pair.
//! Check: difference quotients; the spread of fits over many maps.

use crate::error::{Error, positive};
use crate::vortex_fit::wake::free_parameters::gathered;
use crate::vortex_fit::{PARAMETERS, Parameter, Wake};

const CIRCULATIONS: [usize; 2] = [
    Parameter::LeftCirculation as usize,
    Parameter::RightCirculation as usize,
];
const LATERAL: [usize; 2] = [
    Parameter::LeftLateral as usize,
    Parameter::RightLateral as usize,
];

/// Prior density of the spacing and the circulations of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairPrior {
    /// Median of the spacing, which is log-normal \[m\].
    pub median_spacing_m: f64,
    /// Standard deviation of the natural logarithm of the spacing.
    pub log_deviation: f64,
    /// Standard deviation of the difference of the circulations over their mean, which is normal about 0.
    pub relative_difference: f64,
}

impl PairPrior {
    /// Spacings of 16 to 63 m, pi/4 of spans of 20 to 80 m, are within 1.4 standard deviations; so are circulations in the ratio of 1 to 1.8.
    pub const AIRCRAFT: Self = Self {
        median_spacing_m: 32.0,
        log_deviation: 0.5,
        relative_difference: 0.4,
    };

    pub(crate) fn validate(&self) -> Result<(), Error> {
        positive("median_spacing_m", self.median_spacing_m)?;
        positive("log_deviation", self.log_deviation)?;
        positive("relative_difference", self.relative_difference)
    }

    /// Distances from the prior in standard deviations, and their derivatives by all free numbers: of the spacing where both lateral positions are
    /// free, of the circulations where both are.
    pub(crate) fn terms(&self, wake: &Wake, groups: &[Vec<usize>]) -> Vec<(f64, Vec<f64>)> {
        let mut terms = Vec::new();
        let [left, right] = [wake.left.circulation_m2_s, wake.right.circulation_m2_s];
        let sum = left + right;
        if are_free(CIRCULATIONS, groups) && sum > 0.0 {
            let away = 2.0 * (left - right) / sum / self.relative_difference;
            let by = 4.0 / (sum * sum * self.relative_difference);
            let slopes = slopes(CIRCULATIONS, [by * right, -by * left], groups);
            terms.push((away, slopes));
        }
        let spacing_m = wake.spacing_m();
        if are_free(LATERAL, groups) && spacing_m > 0.0 {
            let away = (spacing_m / self.median_spacing_m).ln() / self.log_deviation;
            let by = (self.log_deviation * spacing_m).recip();
            terms.push((away, slopes(LATERAL, [-by, by], groups)));
        }
        terms
    }
}

/// Whether both parameters of a pair are free.
fn are_free(pair: [usize; 2], groups: &[Vec<usize>]) -> bool {
    pair.iter()
        .all(|place| groups.iter().any(|group| group.contains(place)))
}

/// Derivatives by all free numbers, given those by a pair of parameters.
fn slopes(pair: [usize; 2], by_pair: [f64; 2], groups: &[Vec<usize>]) -> Vec<f64> {
    let mut all = [0.0; PARAMETERS];
    all[pair[0]] = by_pair[0];
    all[pair[1]] = by_pair[1];
    let mut slopes = vec![0.0; groups.len()];
    gathered(groups, &all, &mut slopes);
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vortex_fit::wake::free_parameters::stepped;
    use crate::vortex_fit::{FreeParameters, Sharing};

    #[test]
    fn terms_are_distances_in_deviations_and_their_slopes_difference_quotients() {
        let prior = PairPrior::AIRCRAFT;
        let wake = Wake::from_array(&[
            360.0, 440.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.0, 1.3, 0.02, 0.0,
        ]);
        let groups = FreeParameters::default().groups();
        let terms = prior.terms(&wake, &groups);
        assert!((terms[0].0 + 0.2 / 0.4).abs() < 1e-12);
        assert!((terms[1].0 - (47.0_f64 / 32.0).ln() / 0.5).abs() < 1e-12);
        for (index, (_, slope)) in terms.iter().enumerate() {
            for (group, slope) in groups.iter().zip(slope) {
                let at = |by: f64| {
                    let p = stepped(std::slice::from_ref(group), &wake.to_array(), &[by]);
                    prior.terms(&Wake::from_list(&p), &groups)[index].0
                };
                let quotient = (at(1e-4) - at(-1e-4)) / 2e-4;
                assert!((slope - quotient).abs() < 1e-7, "{group:?}");
            }
        }
    }

    #[test]
    fn what_is_not_free_or_not_there_has_no_terms() {
        let wake = Wake::from_array(&[
            360.0, 0.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.0, 1.3, 0.02, 0.0,
        ]);
        let one_vortex = FreeParameters::default().groups_of(&wake);
        assert!(PairPrior::AIRCRAFT.terms(&wake, &one_vortex).is_empty());
        let common = FreeParameters {
            circulation: Sharing::Fixed,
            ..FreeParameters::default()
        };
        assert_eq!(PairPrior::AIRCRAFT.terms(&wake, &common.groups()).len(), 1);
    }
}
