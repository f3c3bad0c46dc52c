//! Circulation of a fitted vortex averaged over radii of 5 to 15 m, the measure in which methods are compared.
//!
//! The mean of Gamma(r) over r: closed forms for both profiles, and their derivatives, through which the covariance of a fit becomes
//! a standard deviation. Check: quadrature, difference quotients.

use ndarray::ArrayView2;
use statrs::function::erf::erf;
use std::f64::consts::PI;

use crate::vortex_fit::wake::pair::LAMB_OSEEN_BETA;
use crate::vortex_fit::{CoreProfile, PARAMETERS, Parameter, Wake};

/// Radii between which is averaged, m.
const RADII_M: (f64, f64) = (5.0, 15.0);

impl CoreProfile {
    /// Mean of the circulation over radii of 5 to 15 m for unit circulation, and its derivative by the core radius \[1/m\].
    #[must_use]
    pub fn mean_5_15(self, core_radius_m: f64) -> (f64, f64) {
        let (inner, outer) = RADII_M;
        let width = outer - inner;
        match self {
            Self::Algebraic => {
                let c = core_radius_m;
                let angle = (outer / c).atan() - (inner / c).atan();
                let by_core = inner / (c * c + inner * inner) - outer / (c * c + outer * outer);
                (1.0 - c / width * angle, -(angle + c * by_core) / width)
            }
            Self::LambOseen => {
                let k = LAMB_OSEEN_BETA.sqrt() / core_radius_m;
                let part = PI.sqrt() / (2.0 * k * width) * (erf(outer * k) - erf(inner * k));
                let [inner_bell, outer_bell] = [inner, outer].map(|r| r * (-(r * k).powi(2)).exp());
                // d part / d k = (bells - k part) / k, d k / d core = - k / core
                let slope = ((outer_bell - inner_bell) / width - part) / core_radius_m;
                (1.0 - part, slope)
            }
        }
    }
}

impl Wake {
    /// Circulation over radii of 5 to 15 m of the left and the right vortex, each with its standard deviation \[m^2/s\] given the
    /// covariance of the parameters in the order of [`Parameter`].
    #[must_use]
    pub fn mean_circulations_5_15_m2_s(
        &self,
        profile: CoreProfile,
        covariance: ArrayView2<'_, f64>,
    ) -> [(f64, f64); 2] {
        let sides = [
            (&self.left, Parameter::LeftCirculation, Parameter::LeftCore),
            (
                &self.right,
                Parameter::RightCirculation,
                Parameter::RightCore,
            ),
        ];
        sides.map(|(vortex, circulation, core)| {
            let (share, by_core) = profile.mean_5_15(vortex.core_radius_m);
            let mut slope = [0.0; PARAMETERS];
            slope[circulation as usize] = share;
            slope[core as usize] = vortex.circulation_m2_s * by_core;
            let terms = covariance
                .indexed_iter()
                .map(|((i, j), c)| slope[i] * c * slope[j]);
            (
                vortex.circulation_m2_s * share,
                terms.sum::<f64>().max(0.0).sqrt(),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn means_of_500_m2_s_are_those_of_the_page_and_their_slopes_difference_quotients() {
        for (profile, expected) in [
            (CoreProfile::Algebraic, 466.635),
            (CoreProfile::LambOseen, 499.931),
        ] {
            assert!((500.0 * profile.mean_5_15(2.35).0 - expected).abs() < 1e-3);
            for core in [0.5, 2.35, 6.0, 20.0] {
                let quotient =
                    (profile.mean_5_15(core + 1e-5).0 - profile.mean_5_15(core - 1e-5).0) / 2e-5;
                assert_relative_eq!(
                    profile.mean_5_15(core).1,
                    quotient,
                    max_relative = 1e-6,
                    epsilon = 1e-9
                );
            }
        }
    }

    #[test]
    fn the_standard_deviation_takes_circulation_and_core_and_their_correlation() {
        let wake = Wake::from_array(&[
            500.0, 400.0, 376.5, 45.0, 423.5, 49.0, 2.35, 3.0, 0.0, 0.0, 0.0,
        ]);
        let mut covariance = ndarray::Array2::<f64>::zeros((PARAMETERS, PARAMETERS));
        (covariance[[0, 0]], covariance[[6, 6]]) = (100.0, 0.25);
        (covariance[[0, 6]], covariance[[6, 0]]) = (3.0, 3.0);
        let [left, right] =
            wake.mean_circulations_5_15_m2_s(CoreProfile::Algebraic, covariance.view());
        let (share, by_core) = CoreProfile::Algebraic.mean_5_15(2.35);
        let by_core = 500.0 * by_core;
        let variance =
            share * share * 100.0 + 2.0 * share * by_core * 3.0 + by_core * by_core * 0.25;
        assert_relative_eq!(left.1, variance.sqrt(), max_relative = 1e-12);
        assert_eq!(right.1, 0.0);
    }
}
