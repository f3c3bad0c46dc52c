//! The vortex pair of a scene as winds have it: at rest, inviscid, or decaying and carried by the wind.
//!
//! Check: a transported pair in uniform wind drifts with it, and the truth of its files is its decay.

use super::{Retimed, analytic_wind, circulation_profile, uniform_wind};
use crate::Error;
use crate::scene::{Flow, PairDecay, SceneFile, VortexMotion, VortexPair};
use std::fmt::Write as _;
use std::sync::Arc;
use wakescope_les::winds::decay::{self, DecayLaw};
use wakescope_les::winds::{AlongFlight, Transport, TransportedPair, Vortex};
use wakescope_les::{self as les, Wind};

/// Greatest age of a transported pair, in tau: nothing is left of it then.
const OLDEST_TAU: f64 = 30.0;
/// Eddies longer than this many spacings move the pair as a whole.
const MEANDERING_SPACINGS: f64 = 2.0;
/// Greatest age, and greatest age from the birth of secondary vortices, for which the laws were fitted.
const FITTED_TAU: f64 = 10.0;
const FITTED_AFTER_BIRTH_TAU: f64 = 4.0;

/// The pair of a scene with its path.
#[derive(Clone)]
pub(crate) struct ScenePair {
    /// The pair at its release.
    released: les::VortexPair,
    /// Its path, if it decays.
    path: Option<Arc<TransportedPair>>,
    /// Turbulence in its units, of one that decays.
    eps_star: f64,
}

impl ScenePair {
    /// The pair of a scene, carried by the uniform winds among its flows.
    ///
    /// # Errors
    /// What the pair or its decay refuses; a checked scene gives none.
    pub(super) fn new(pair: &VortexPair, file: &SceneFile) -> Result<Self, Error> {
        let released = vortex_pair(pair);
        if !pair.is_transported() {
            return Ok(Self {
                released,
                path: None,
                eps_star: 0.0,
            });
        }
        let t0_s = released.time_s(1.0);
        let of_eddies_m2_s3 = file.content.eddies().map(|eddies| eddies.dissipation_m2_s3);
        let dissipation_m2_s3 = pair.dissipation_m2_s3.or(of_eddies_m2_s3).unwrap_or(0.0);
        let turbulent_m_s = (dissipation_m2_s3 * pair.spacing_m).cbrt();
        let eps_star = turbulent_m_s / released.descent_speed_m_s();
        let n_star = pair.buoyancy_per_s * t0_s;
        let natural_tau = decay::lifetime(eps_star, n_star)?;
        let transport = Transport {
            law: match pair.decay {
                PairDecay::TwoPhase { slow, fast } => DecayLaw::TwoPhase { slow, fast },
                PairDecay::Sarpkaya { rate } => DecayLaw::Sarpkaya { rate },
                PairDecay::P2p {} => DecayLaw::TWO_PHASE,
            },
            lifetime_tau: match pair.lifetime_tau {
                Some(lifetime_tau) => lifetime_tau.min(decay::stopped_by_buoyancy_tau(n_star)),
                None => natural_tau,
            },
            n_star,
            rebound: pair.rebound,
        };
        let carrier = mean_winds(pair.cross_wind_m_s, file)?;
        let eddies = meandering(pair, file)?;
        let eddies: Option<&dyn Wind> = eddies.as_ref().map(|eddies| eddies as &dyn Wind);
        let path = TransportedPair::new(released, transport, Some(&carrier), eddies, OLDEST_TAU)?;
        Ok(Self {
            released,
            path: Some(Arc::new(path)),
            eps_star,
        })
    }

    /// The wind of the pair, by its age; behind an aircraft older the farther it is behind.
    ///
    /// # Errors
    /// What the wind refuses; a checked scene gives none.
    pub(super) fn wind(&self, pair: &VortexPair) -> Result<Box<dyn Wind>, Error> {
        let of_age: Arc<dyn Wind> = match &self.path {
            Some(path) => path.clone(),
            None => Arc::new(self.released.wind()?),
        };
        Ok(match pair.aircraft {
            Some(a) => Box::new(AlongFlight::new(of_age, a.speed_m_s, a.x_m)?),
            None => Box::new(of_age),
        })
    }

    /// The left and the right vortex at an age, s; before the release as at it.
    ///
    /// # Errors
    /// An age beyond the path of the pair.
    pub(crate) fn vortices(&self, age_s: f64) -> Result<[Vortex; 2], Error> {
        match &self.path {
            Some(path) => Ok(path.primary_vortices(age_s.max(0.0))?),
            None => Ok(self.released.vortices(age_s)),
        }
    }

    /// The last age that is known, s; infinite for a pair that does not decay.
    pub(crate) fn last_age_s(&self) -> f64 {
        self.path
            .as_ref()
            .map_or(f64::INFINITY, |path| path.last_time_s())
    }

    /// What the plan prints of a pair that decays, whose age is at most `age_s` in the scan: its lifetime, and its descent
    /// beside the final one of Holzaepfel (2003).
    pub(crate) fn description(&self, age_s: f64) -> Option<String> {
        let transport = self.path.as_ref()?.transport();
        let [left, right] = self.vortices(age_s).ok()?;
        let start_m2_s = self.released.circulation_m2_s;
        let left_over = 0.5 * (right.circulation_m2_s - left.circulation_m2_s) / start_m2_s;
        let descent_m = self.released.height_m - 0.5 * (left.height_m + right.height_m);
        let final_b0 = decay::holzaepfel_final_descent(self.eps_star, transport.n_star);
        let mut text = format!(
            "lifetime {:.2} tau; at the end of the scan {:.0} % of the circulation, {:.0} m {} the release",
            transport.lifetime_tau,
            100.0 * left_over,
            descent_m.abs(),
            if descent_m < 0.0 { "above" } else { "below" },
        );
        let final_m = final_b0 * self.released.spacing_m;
        // writing to a string cannot fail
        let _ = write!(
            text,
            "; final descent without ground by CoCiP (Holzaepfel 2003) {final_m:.0} m"
        );
        Some(text)
    }

    /// Ages of a pair that decays for which its laws were not fitted.
    pub(crate) fn warnings(&self, age_s: f64) -> Vec<String> {
        let Some(path) = &self.path else {
            return Vec::new();
        };
        let mut out = Vec::new();
        let t0_s = self.released.time_s(1.0);
        let age_tau = age_s / t0_s;
        if age_tau > FITTED_TAU {
            out.push(format!(
                "the vortex pair becomes {age_tau:.1} tau old: its decay is known to {FITTED_TAU} tau"
            ));
        }
        let [left_s, right_s] = path.birth_s();
        let after_birth_tau = (age_s - left_s.min(right_s)) / t0_s;
        if after_birth_tau > FITTED_AFTER_BIRTH_TAU {
            out.push(format!(
                "flow.rebound: the scan ends {after_birth_tau:.1} tau after the birth of the secondary vortices, which were fitted to \
                 {FITTED_AFTER_BIRTH_TAU} tau"
            ));
        }
        out
    }
}

/// The mean winds of a scene: uniform ones, linear ones and profiles, and the cross wind of the pair, m/s. They carry a transported pair,
/// beside which a linear one is refused.
///
/// # Errors
/// What a wind refuses; a checked scene gives none.
pub(crate) fn mean_winds(
    cross_wind_m_s: f64,
    file: &SceneFile,
) -> Result<Vec<Box<dyn Wind>>, Error> {
    let scene = &file.content;
    let mut winds: Vec<Box<dyn Wind>> = vec![Box::new(uniform_wind(cross_wind_m_s, 0.0)?)];
    for flow in std::iter::once(&scene.flow).chain(&scene.added_flows) {
        match flow {
            Flow::Uniform {
                lateral_m_s,
                vertical_m_s,
            } => winds.push(Box::new(uniform_wind(*lateral_m_s, *vertical_m_s)?)),
            Flow::Wind(_) | Flow::Linear(_) => winds.push(analytic_wind(flow)?),
            _ => {}
        }
    }
    Ok(winds)
}

/// The eddies that move a pair, by the time since its release.
fn meandering(
    pair: &VortexPair,
    file: &SceneFile,
) -> Result<Option<Retimed<impl Fn(f64) -> f64>>, Error> {
    if !pair.meander {
        return Ok(None);
    }
    let Some(eddies) = super::eddies::eddies(&file.content, 0)? else {
        return Ok(None);
    };
    // Eddies count from the start of the scan. Behind an aircraft the pair at x = 0 is released when it passes.
    let released_s = match pair.aircraft {
        Some(aircraft) => -aircraft.x_m / aircraft.speed_m_s,
        None => -vortex_pair(pair).time_s(pair.age_tau),
    };
    Ok(Some(Retimed {
        wind: Box::new(eddies.longer_than(MEANDERING_SPACINGS * pair.spacing_m)?),
        time_s: move |since_release_s| since_release_s + released_s,
    }))
}

/// The vortex pair of a scene at its release, with the path that it has if it does not decay.
pub fn vortex_pair(pair: &VortexPair) -> les::VortexPair {
    les::VortexPair {
        circulation_m2_s: pair.circulation_m2_s,
        spacing_m: pair.spacing_m,
        core_radius_m: pair.core_radius_m,
        lateral_position_m: pair.lateral_position_m,
        height_m: pair.height_m,
        ground: les::Ground::Image,
        profile: circulation_profile(pair.profile),
        motion: match pair.motion {
            VortexMotion::Frozen | VortexMotion::Transported => les::Motion::Frozen,
            VortexMotion::Inviscid => les::Motion::Inviscid,
        },
    }
}

/// Age of an analytic flow when the scan begins, s.
pub fn start_s(flow: &Flow) -> f64 {
    match flow.pair() {
        Some(pair) if pair.age_tau > 0.0 && pair.circulation_m2_s > 0.0 => {
            vortex_pair(pair).time_s(pair.age_tau)
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use crate::plan::{Plan, Target};
    use crate::retrieve::truth::true_vortices;
    use crate::scene::{Flow, Scene, SceneFile, SnrReference, VortexMotion, VortexPair};

    /// A plan with a transported pair that is changed, and flows added to it.
    fn plan(added_flows: Vec<Flow>, change: impl FnOnce(&mut VortexPair)) -> Plan {
        let mut scene = Scene::default();
        scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
        scene.added_flows = added_flows;
        if let Flow::VortexPair(pair) = &mut scene.flow {
            pair.motion = VortexMotion::Transported;
            change(pair);
        }
        Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap()
    }

    #[test]
    fn the_truth_of_a_transported_pair_is_its_decay_and_its_drift() {
        let decayed = |cross_wind_m_s: f64| {
            plan(Vec::new(), |pair| {
                pair.age_tau = 4.0;
                pair.dissipation_m2_s3 = Some(1.45e-2);
                pair.cross_wind_m_s = cross_wind_m_s;
            })
        };
        let still = decayed(0.0);
        let lines: Vec<usize> = (0..still.geometry.line_time_s.len()).collect();
        let [left, right] = true_vortices(&still, &lines).unwrap();
        let t0_s = std::f64::consts::TAU * 47.0 * 47.0 / 500.0;
        // eps* = (eps b0)^(1/3)/V0 = 0.52, above the first branch of the lifetime.
        let eps_star = (1.45e-2_f64 * 47.0).cbrt() * t0_s / 47.0;
        let lifetime_tau = (0.7475 / eps_star).powf(0.75);
        for vortex in [&left, &right] {
            let tau = vortex.time_s / t0_s;
            let expected = 500.0 * (-0.06 * tau - 0.4 * (tau - lifetime_tau)).exp();
            let ratio = vortex.circulation_m2_s.value / expected;
            assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
        }
        let moved = true_vortices(&decayed(0.2), &lines).unwrap();
        let shift_m = moved[0].lateral_position_m.value - left.lateral_position_m.value;
        let expected_m = 0.2 * moved[0].time_s;
        // The line passes the moved vortex at another time, in which both move.
        assert!((shift_m - expected_m).abs() < 1.5, "{shift_m} {expected_m}");
    }

    #[test]
    fn a_wind_among_the_added_flows_carries_the_pair_as_its_own_cross_wind_does() {
        let uniform = Flow::Uniform {
            lateral_m_s: 0.7,
            vertical_m_s: 0.0,
        };
        let own = plan(Vec::new(), |pair| pair.cross_wind_m_s = 0.7);
        let added = plan(vec![uniform], |_| ());
        let points_m = [[0.0, 430.0, 30.0], [0.0, 380.0, 55.0]];
        let velocity = |plan: &Plan| {
            let mut out = [[0.0; 3]; 2];
            plan.wind
                .wind()
                .velocity_into(&points_m, 20.0, &mut out)
                .unwrap();
            out
        };
        let own = velocity(&own);
        let added = velocity(&added);
        for (a, b) in own.as_flattened().iter().zip(added.as_flattened()) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    /// Middle of a pair after 60 s in eddies of a seed, m, with its whole drift.
    fn meandered_m(seed: u64, aircraft: Option<crate::scene::Aircraft>) -> f64 {
        let eddies = crate::scene::EddyField {
            dissipation_m2_s3: 5e-4,
            ..crate::scene::EddyField::default()
        };
        let mut scene = Scene {
            seed,
            added_flows: vec![Flow::Eddies(eddies)],
            ..Scene::default()
        };
        scene.detector.snr = SnrReference::Fixed { snr_db: 0.0 };
        if let Flow::VortexPair(pair) = &mut scene.flow {
            pair.motion = VortexMotion::Transported;
            pair.height_m = 300.0;
            pair.meander = true;
            pair.aircraft = aircraft;
        }
        let plan = Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap();
        let pair = plan.wind.pair.as_ref().unwrap();
        let [left, right] = pair.vortices(60.0).unwrap();
        0.5 * (left.lateral_position_m + right.lateral_position_m) - 400.0
    }

    #[test]
    fn a_pair_meanders_in_eddies_from_the_passage_of_its_aircraft_on() {
        let at_rest_m = meandered_m(3, None);
        assert!(at_rest_m.abs() > 1.0, "{at_rest_m}");
        // The scan begins when the aircraft is at x = 0: the same path.
        let passing = crate::scene::Aircraft {
            speed_m_s: 70.0,
            x_m: 0.0,
        };
        let apart_m = meandered_m(3, Some(passing)) - at_rest_m;
        assert!(apart_m.abs() < 1e-9, "{apart_m}");
    }

    /// An independent program has 14 m at this dissipation and an outer scale of 100 m.
    #[test]
    #[ignore = "takes half a minute: paths in 40 fields of eddies"]
    fn eddies_let_a_pair_meander_by_fourteen_metres_in_a_minute() {
        const SEEDS: u64 = 40;
        let mut squares_m2 = 0.0;
        for seed in 0..SEEDS {
            squares_m2 += meandered_m(seed, None).powi(2);
        }
        let rms_m = (squares_m2 / SEEDS as f64).sqrt();
        let error_m = rms_m / (2.0 * SEEDS as f64).sqrt();
        eprintln!("{rms_m:.1} +- {error_m:.1} m");
        assert!((rms_m - 14.0).abs() < 4.0, "{rms_m}");
    }

    #[test]
    fn ages_beyond_what_was_fitted_are_warned_of_and_the_plan_prints_the_descent() {
        let young = plan(Vec::new(), |pair| pair.age_tau = 2.0);
        assert!(young.warnings.is_empty(), "{:?}", young.warnings);
        let text = young.to_string();
        assert!(text.contains("lifetime 9.18 tau"), "{text}");
        // 7.68 x 0.79 + 1.88 times 47 m
        assert!(text.contains("(Holzaepfel 2003) 374 m"), "{text}");
        let old = plan(Vec::new(), |pair| pair.age_tau = 10.0);
        assert!(old.warnings.iter().any(|w| w.contains("known to 10 tau")));
        let rebound = plan(Vec::new(), |pair| {
            pair.age_tau = 6.0;
            pair.rebound = true;
        });
        let told = |w: &String| w.contains("after the birth");
        assert!(rebound.warnings.iter().any(told), "{:?}", rebound.warnings);
    }

    #[test]
    fn behind_an_aircraft_the_pair_has_the_age_since_its_passage() {
        let behind = plan(Vec::new(), |pair| {
            pair.aircraft = Some(crate::scene::Aircraft {
                speed_m_s: 70.0,
                x_m: 1400.0,
            });
        });
        let aged = plan(Vec::new(), |pair| {
            pair.age_tau = 20.0 * 500.0 / (std::f64::consts::TAU * 47.0 * 47.0)
        });
        let lines: Vec<usize> = (0..aged.geometry.line_time_s.len()).collect();
        let [a, _] = true_vortices(&behind, &lines).unwrap();
        let [b, _] = true_vortices(&aged, &lines).unwrap();
        let apart = a.circulation_m2_s.value - b.circulation_m2_s.value;
        assert!(
            apart.abs() < 1e-6 && a.circulation_m2_s.value < 500.0,
            "{apart}"
        );
    }
}
