//! From signals to velocities: the keys that all methods of estimation share, and the limits between them.

use super::{Method, PeriodogramAccumulation, Scene};
use crate::interpolation::interpolate;
use crate::keys::{Checker, Is, Number, keys};
use wakescope_estimate::Refinement;

keys! {
    /// Estimation of velocities from signals.
    table Estimator {
        /// Samples N of a window.
        window_samples: usize = 64 => 4..=65_536,
        /// Weighting h of the window, (29).
        weighting: Weighting = Weighting::Gaussian,
        /// Samples between accumulated windows.
        window_step_samples: usize = 1 => 1..=1_000_000,
        /// Samples between gates of the map.
        gate_step_samples: usize = 5 => 1..=1_000_000,
        /// Points of the zero-padded spectrum; `window_samples` for the literal (29).
        padded_samples: usize = 1024 => 1..=1 << 22,
        /// Refinement of the peak between the points of the spectrum.
        refinement: Refinement = Refinement::Parabola,
        /// Radius of the circular region of accumulation, m.
        radius_m: f64 = 2.0 => 0.0..=1e5,
        /// Probability that noise alone passes for a signal at a gate; estimates whose peak is not above what noise reaches
        /// that often are flagged. 0: no test.
        false_alarm: f64 = 0.01 => Number(
            |rate| rate == 0.0 || (1e-12..=0.5).contains(&rate),
            "0 for no test, or from 1e-12 to 0.5: the probability that noise passes at a gate, for example 0.01",
        ),
        /// Estimator, with its keys.
        method: Method = Method::PeriodogramAccumulation(PeriodogramAccumulation {}),
        /// Dependence of the radius on range.
        radius: RegionRadius = RegionRadius::Fixed {},
    }

    /// Dependence of the radius of the region on range.
    kinds RegionRadius by "kind" {
        /// `radius_m` at every range.
        "fixed" => Fixed {},
        /// Linear interpolation in a table, constant beyond its ends.
        "of_range" => OfRange {
            /// Ranges, m, increasing.
            range_m: Vec<f64> => Is(
                |r: &Vec<f64>| !r.is_empty() && r.windows(2).all(|r| r[1] > r[0]) && r.iter().all(|r| r.is_finite()),
                "at least one range, finite and increasing",
            ),
            /// Radius at each, m.
            radius_m: Vec<f64>,
        },
        /// Smallest radius for which the Cramér-Rao bound of the velocity reaches `std_m_s`.
        "target" => Target {
            /// Standard deviation to reach, m/s.
            standard_deviation_m_s: f64 => 1e-6..=1e3,
            /// Largest radius, m.
            largest_m: f64 => 1e-3..=1e5,
        },
    }

    /// Weighting of the samples of a window.
    choice Weighting {
        /// Gaussian, the default.
        Gaussian = "gaussian",
        /// Uniform.
        Rectangular = "rectangular",
        /// Hann.
        Hann = "hann",
    }
}

impl Estimator {
    /// The key of the samples of a window.
    pub(crate) const WINDOW_SAMPLES: &str = "estimator.window_samples";

    /// The key of the weighting of a window.
    pub(crate) const WEIGHTING: &str = "estimator.weighting";

    /// The key of the number of frequencies of the spectrum.
    pub(crate) const PADDED_SAMPLES: &str = "estimator.padded_samples";

    /// The key of the refinement of the peak.
    pub(crate) const REFINEMENT: &str = "estimator.refinement";

    /// The key of the radius of all regions.
    pub(crate) const RADIUS: &str = "estimator.radius_m";

    /// Whether the map has regions of accumulation.
    pub(crate) fn has_regions(&self) -> bool {
        self.method.behaviour().uses(Self::RADIUS)
    }

    /// Whether the windows have the weighting of the scene.
    pub(crate) fn is_weighted(&self) -> bool {
        self.method.behaviour().uses(Self::WEIGHTING)
    }

    /// Size of the regions, as text.
    pub(crate) fn regions(&self) -> String {
        match &self.radius {
            _ if !self.has_regions() => "no region".to_owned(),
            RegionRadius::Fixed {} => format!("regions of {} m", self.radius_m),
            RegionRadius::OfRange { .. } => "regions whose radius depends on range".to_owned(),
            RegionRadius::Target {
                standard_deviation_m_s,
                ..
            } => {
                format!("regions for a standard deviation of {standard_deviation_m_s} m/s")
            }
        }
    }

    /// Radius of the regions at a range, m; the largest that is allowed for a standard deviation.
    pub(crate) fn largest_radius_m(&self, range_m: f64) -> f64 {
        match &self.radius {
            _ if !self.has_regions() => 0.0,
            RegionRadius::OfRange {
                range_m: at_m,
                radius_m,
            } => interpolate(at_m, radius_m, range_m),
            RegionRadius::Target { largest_m, .. } => *largest_m,
            RegionRadius::Fixed {} => self.radius_m,
        }
    }

    /// Number of lags of a window that are computed, if the method does not need all of an
    /// unweighted window.
    pub(crate) fn few_lags(&self) -> Option<usize> {
        match self.weighting {
            Weighting::Rectangular => self.method.behaviour().lags(),
            _ => None,
        }
    }
}

/// Every limit of the estimator's keys, and those between them.
pub(super) fn check_estimator(scene: &Scene, c: &mut Checker<'_>) {
    let e = &scene.estimator;
    c.compare(
        [Estimator::PADDED_SAMPLES, Estimator::WINDOW_SAMPLES],
        [e.padded_samples, e.window_samples],
        "at least",
    );
    if let RegionRadius::OfRange { range_m, radius_m } = &e.radius {
        let fits =
            radius_m.len() == range_m.len() && radius_m.iter().all(|r| (0.0..=1e5).contains(r));
        let allowed = "one number from 0 to 1e5 m for each of estimator.radius.range_m";
        c.require(fits, "estimator.radius.radius_m", radius_m, allowed);
    }
    e.method.behaviour().check(e, c);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Autoregressive, FirstMoment, Likelihood};

    fn keys(change: impl FnOnce(&mut Estimator)) -> Vec<String> {
        let mut scene = Scene::default();
        change(&mut scene.estimator);
        scene.problems().into_iter().map(|p| p.key).collect()
    }

    #[test]
    fn knobs_of_the_estimators_are_held_to_their_limits() {
        let own = |method| keys(|e| e.method = method);
        let order = Method::Autoregressive(Autoregressive { order: 64 });
        assert_eq!(own(order), ["estimator.method.order"]);
        let reach = Method::FirstMoment(FirstMoment {
            moment_reach: f64::NAN,
        });
        assert_eq!(own(reach), ["estimator.method.moment_reach"]);
        let strong = Method::Likelihood(Likelihood {
            likelihood_snr_db: Some(200.0),
        });
        assert_eq!(own(strong), ["estimator.method.likelihood_snr_db"]);
        let with = |method, change: fn(&mut Estimator)| {
            keys(|e| {
                e.method = method;
                change(e);
            })
        };
        let model = || Method::Autoregressive(Autoregressive { order: 16 });
        assert_eq!(
            with(model(), |e| e.false_alarm = 1.0),
            ["estimator.false_alarm"]
        );
        let table = |e: &mut Estimator| {
            e.radius = RegionRadius::OfRange {
                range_m: vec![300.0, 200.0],
                radius_m: vec![1.0, 2.0],
            };
        };
        assert_eq!(with(model(), table), ["estimator.radius.range_m"]);
    }
}
