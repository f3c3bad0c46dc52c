//! Vortices from what a scene measures: methods, the test for a wake, an aircraft that follows.

use super::{Flow, NoiseModel, Pattern, Scan, Scene, Weighting};
use crate::beams::direction::sin_cos_of_turn;
use crate::keys::{Checker, Is, keys};
use wakescope_estimate::vortex_fit::{LiftSlope, Secondary};

keys! {
    /// Retrieval method.
    #[derive(Default)]
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    choice RetrievalMethod {
        /// Fit of the wake to the map.
        #[default]
        Fit = "fit",
        /// Fit of the wake to all raw signals.
        Signals = "signals",
        /// Radial-velocity method: positions from extremes, circulations by linear least squares.
        Rv = "rv",
        /// Velocity envelopes of the spectra of raw signals about the wake fitted to their map.
        Envelope = "envelope",
    }

    /// Turbulence in the covariance of the velocities.
    #[derive(Default)]
    choice RetrievalTurbulence {
        /// Independent errors.
        #[default]
        None = "none",
        /// Isotropic turbulence, found in each scan.
        Auto = "auto",
    }

    /// Retrieval of vortices from each realisation, compared with the truth of the flow.
    table Retrieval {
        /// Retrieval methods; each is applied to every realisation.
        methods: Vec<RetrievalMethod> = vec![RetrievalMethod::Fit] => Is(
            |list: &Vec<RetrievalMethod>| !list.is_empty() && (1..list.len()).all(|i| !list[..i].contains(&list[i])),
            "at least one of \"fit\", \"signals\", \"rv\", \"envelope\", each once, for example [\"fit\", \"rv\"]",
        ),
        /// Fixed core radius of the fits, m; fitted if absent.
        core_radius_m: Option<f64> = None => 1e-3..=1e3,
        /// Whether secondary vortices are fitted beside a pair.
        secondary: Secondary = Secondary::Auto,
        /// Turbulence in the covariance of the velocities of fits to maps.
        turbulence: RetrievalTurbulence as omitted = RetrievalTurbulence::None,
        /// False-alarm rate per scan at which the maps are tested for a wake; no test if absent.
        false_alarm: Option<f64> = None => 1e-9..=0.5,
        /// The following aircraft; none if absent.
        follower: Option<FollowingAircraft> = None,
    }

    /// An aircraft in the wake: rectangular wing, strip theory.
    #[derive(Copy)]
    table FollowingAircraft {
        /// Span of the wing, m.
        span_m: f64 = 34.0 => 0.1..=1e3,
        /// Span squared over the area of the wing.
        aspect_ratio: f64 = 9.4 => 0.1..=1e3,
        /// True air speed, m/s.
        speed_m_s: f64 = 70.0 => 0.1..=1e3,
        /// Slope of the lift.
        slope: LiftSlope = LiftSlope::Span,
    }
}

/// What a scene may say of its retrievals.
pub(super) fn check_retrieval(scene: &Scene, c: &mut Checker<'_>) {
    let Some(r) = &scene.retrieval else { return };
    let key = "retrieval.methods";
    let estimator = &scene.estimator;
    let lacks = |method| !r.methods.contains(&method);
    let has_edges = estimator.weighting == Weighting::Gaussian && estimator.is_weighted();
    let allowed = "another method unless estimator.weighting = \"gaussian\" and the windows are weighted with it, as all are but those of the \
                   likelihoods";
    c.require(
        lacks(RetrievalMethod::Envelope) || has_edges,
        key,
        "envelope",
        allowed,
    );
    let one = "another method with more than one sweep (scan.head.sweeps)";
    c.require(
        scene.scan.head.sweeps == 1 || lacks(RetrievalMethod::Envelope),
        key,
        "envelope",
        one,
    );
    if let Some(rate) = r.false_alarm {
        let noise = scene.detector.noise != NoiseModel::None;
        c.require(
            noise,
            "retrieval.false_alarm",
            rate,
            "absent where detector.noise = \"none\": nothing is by chance",
        );
    }
    if r.turbulence == RetrievalTurbulence::Auto {
        check_turbulence(r, c);
    }
    let across = "absent but for scan.pattern.kind = \"rhi\" in the plane across the flight, where vortices are sought: with \
                  scan.lidar.velocity_m_s = [0.0, 0.0, 0.0], y_m = 0.0, and flight_azimuth_rad absent or a quarter turn before scan.azimuth_rad";
    c.require(scene.scan.is_across(), "retrieval", "a table", across);
    let one = "absent with more than one sweep (scan.head.sweeps): scans are tested one at a time";
    c.require(
        r.false_alarm.is_none() || scene.scan.head.sweeps == 1,
        "retrieval.false_alarm",
        "a rate",
        one,
    );
    let has_vortices = scene.flow.has_vortices();
    let allowed =
        "a flow with vortices: flow.kind = \"vortex_pair\" with a circulation, or \"simulated\"";
    c.require(has_vortices, "retrieval", "a table", allowed);
    let allowed = "absent with vortices among added_flows: the truth of fits is that of the pair of flow alone";
    let has_one_pair = !scene.added_flows.iter().any(Flow::has_vortices);
    c.require(has_one_pair, "retrieval", "a table", allowed);
    let allowed = "another method where detector.noise = \"none\" or the pulse is sampled: their signals have no likelihood here";
    for method in [RetrievalMethod::Signals, RetrievalMethod::Envelope] {
        let is_likely = scene.pulse.is_gaussian() && scene.detector.noise != NoiseModel::None;
        c.require(lacks(method) || is_likely, key, method.name(), allowed);
    }
}

/// What a scene may say of its retrievals beside turbulence that is found in each scan.
fn check_turbulence(r: &Retrieval, c: &mut Checker<'_>) {
    let key = "retrieval.turbulence";
    let has = |method| r.methods.contains(&method);
    let allowed = "\"none\" without retrieval.methods = [\"fit\"] or [\"envelope\"]: other methods know of no turbulence";
    let has_fit = has(RetrievalMethod::Fit) || has(RetrievalMethod::Envelope);
    c.require(
        has_fit && !has(RetrievalMethod::Signals),
        key,
        "auto",
        allowed,
    );
    let allowed = "\"none\" beside retrieval.secondary: in turbulence a pair alone is fitted";
    c.require(r.secondary == Secondary::Auto, key, "auto", allowed);
    let allowed = "\"none\" beside retrieval.false_alarm, whose test for a wake is that of still air; see wakescope detect --turbulence auto";
    c.require(r.false_alarm.is_none(), key, "auto", allowed);
}

impl Scan {
    /// Whether all lines are in the plane across the flight, seen from the origin of its lateral coordinate: where vortices are sought.
    pub(crate) fn is_across(&self) -> bool {
        let lidar = &self.lidar;
        let is_quarter =
            |azimuth_rad: f64| sin_cos_of_turn(self.azimuth_rad - azimuth_rad) == (1.0, 0.0);
        self.pattern == Pattern::default()
            && (lidar.velocity_m_s, lidar.y_m) == ([0.0; 3], 0.0)
            && lidar.flight_azimuth_rad.is_none_or(is_quarter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneFile;
    use std::path::Path;

    fn keys(text: &str) -> Vec<String> {
        let scene = SceneFile::without_limits(text, Path::new("s.toml")).unwrap();
        scene.problems().into_iter().map(|p| p.key).collect()
    }

    #[test]
    fn retrievals_are_held_to_their_limits_and_need_vortices() {
        for text in [
            "[retrieval]\nsecondary = \"never\"\n",
            "[retrieval]\nturbulence = \"auto\"\nmethods = [\"rv\", \"envelope\"]\n",
            "[retrieval]\nmethods = [\"fit\", \"signals\", \"rv\", \"envelope\"]\nfalse_alarm = 0.01\n",
            "[retrieval]\n[scan]\nazimuth_rad = 1.0\n[scan.head]\nsweeps = 3\ndirection = \"alternate\"\n",
            "[retrieval]\n[scan]\nazimuth_rad = 2.0\n[scan.lidar]\nflight_azimuth_rad = 0.42920367320510344\n",
        ] {
            assert_eq!(keys(text), Vec::<String>::new(), "{text}");
        }
        for (text, key) in [
            ("[retrieval]\nmethods = []\n", "retrieval.methods"),
            (
                "[retrieval]\nmethods = [\"rv\", \"fit\", \"rv\"]\n",
                "retrieval.methods",
            ),
            (
                "[retrieval]\nmethods = [\"envelope\"]\n[estimator]\nweighting = \"hann\"\n",
                "retrieval.methods",
            ),
            (
                "[retrieval]\nmethods = [\"envelope\"]\n[detector]\nnoise = \"none\"\n",
                "retrieval.methods",
            ),
            (
                "[retrieval]\nmethods = [\"envelope\"]\n[scan.head]\nsweeps = 2\n",
                "retrieval.methods",
            ),
            (
                "[retrieval]\nmethods = [\"signals\"]\n[detector]\nnoise = \"none\"\n",
                "retrieval.methods",
            ),
            ("[retrieval]\nfalse_alarm = 0.9\n", "retrieval.false_alarm"),
            (
                "[retrieval]\nturbulence = \"auto\"\nmethods = [\"fit\", \"signals\"]\n",
                "retrieval.turbulence",
            ),
            (
                "[retrieval]\nturbulence = \"auto\"\nmethods = [\"rv\"]\n",
                "retrieval.turbulence",
            ),
            (
                "[retrieval]\nturbulence = \"auto\"\nsecondary = \"always\"\n",
                "retrieval.turbulence",
            ),
            (
                "[retrieval]\nturbulence = \"auto\"\nfalse_alarm = 0.01\n",
                "retrieval.turbulence",
            ),
            (
                "[retrieval]\ncore_radius_m = 0.0\n",
                "retrieval.core_radius_m",
            ),
            (
                "[retrieval]\n[retrieval.follower]\nspan_m = -1.0\n",
                "retrieval.follower.span_m",
            ),
            ("[retrieval]\n[flow]\nkind = \"calm\"\n", "retrieval"),
            (
                "[retrieval]\n[[added_flows]]\nkind = \"vortex_pair\"\n",
                "retrieval",
            ),
            (
                "[retrieval]\n[scan.pattern]\nkind = \"stare\"\n",
                "retrieval",
            ),
            ("[retrieval]\n[scan.lidar]\ny_m = 5.0\n", "retrieval"),
            (
                "[retrieval]\n[scan.lidar]\nflight_azimuth_rad = 0.3\n",
                "retrieval",
            ),
            (
                "[retrieval]\nfalse_alarm = 0.01\n[scan.head]\nsweeps = 2\n",
                "retrieval.false_alarm",
            ),
        ] {
            assert_eq!(keys(text), [key], "{text}");
        }
        let refused = SceneFile::without_limits(
            "[retrieval]\nsecondary = \"sometimes\"\n",
            Path::new("s.toml"),
        )
        .unwrap_err();
        assert!(
            refused.to_string().contains("retrieval.secondary"),
            "{refused}"
        );
    }

    #[test]
    fn a_scene_without_the_table_is_written_as_before() {
        assert!(!Scene::default().to_toml().contains("retrieval"));
    }
}
