//! The winds of a scene, that of `[flow]` and those that are added to it, and what they may say.
//! Check: each limit is broken once.

use super::air::{EddyField, EddyRealisations, WindProfile, check_eddies, check_wind_profile};
use crate::keys::{ABOVE_ZERO, Checker, Named, keys};
use std::f64::consts::TAU;
use wakescope_estimate::vortex_fit::CoreProfile;

keys! {
    /// The wind that the lidar sees.
    kinds Flow by "kind" {
        /// No wind.
        "calm" => Calm {},
        /// The same wind everywhere.
        "uniform" => Uniform {
            /// Wind away from the lidar, m/s.
            lateral_m_s: f64 => -1e3..=1e3,
            /// Wind upwards, m/s.
            vertical_m_s: f64 => -1e3..=1e3,
        },
        /// A wind that is linear in place and time.
        "linear" => Linear(LinearWind),
        /// A horizontal wind that depends on the height.
        "wind" => Wind(WindProfile),
        /// Turbulence with the spectrum of von Karman.
        "eddies" => Eddies(EddyField),
        /// The analytic vortex pair (3)-(5) with its images below the ground.
        "vortex_pair" => VortexPair(VortexPair),
        /// Cross-planes that `wakescope flow` wrote.
        "simulated" => Simulated(SimulatedFlow),
        /// Whole fields: those of `wakescope flow` and `wake`, or of other programs.
        "fields" => Fields(FieldFlow),
    }

    /// The analytic vortex pair (3)-(5).
    #[derive(Copy)]
    table VortexPair {
        /// Circulation Gamma0 of each vortex, m^2/s.
        circulation_m2_s: f64 = 500.0 => 0.0..=1e5,
        /// Distance b0 between the vortices when they were released, m.
        spacing_m: f64 = 47.0 => 1e-2..=1e4,
        /// Core radius r_c, m.
        core_radius_m: f64 = 2.35 => 1e-3..=1e3,
        /// Distance from the lidar to the midpoint of the pair, m.
        lateral_position_m: f64 = 400.0 => -1e5..=1e5,
        /// Height at which the pair was released, m.
        height_m: f64 = 47.0 => 1e-2..=1e4,
        /// Circulation profile.
        profile: CoreProfile = CoreProfile::Algebraic,
        /// Whether the pair moves.
        motion: VortexMotion = VortexMotion::Frozen,
        /// Age of the pair when the scan begins, in tau = t V0/b0; not 0 only if it moves.
        age_tau: f64 = 0.0 => 0.0..=1e3,
        /// Uniform cross wind added to the pair, m/s, positive away from the lidar; it carries a transported pair alone.
        cross_wind_m_s: f64 = 0.0 => -1e3..=1e3,
        /// How the circulation of a transported pair decays.
        decay: PairDecay as omitted = PairDecay::default(),
        /// Lifetime T of a transported pair, in tau; that of its turbulence and stability if absent.
        lifetime_tau: Option<f64> = None => ABOVE_ZERO,
        /// Eddy dissipation rate that ends a transported pair, m^2/s^3; that of `"eddies"`, or 0, if absent.
        dissipation_m2_s3: Option<f64> = None => 0.0..=10.0,
        /// Brunt-Vaisala frequency of the air, which slows the descent of a transported pair, 1/s.
        buoyancy_per_s: f64 as omitted = 0.0 => 0.0..=0.1,
        /// Whether secondary vortices of the ground let a transported pair rebound.
        rebound: bool as omitted = false,
        /// Whether eddies longer than two spacings move a transported pair as they move its middle.
        meander: bool as omitted = false,
        /// The aircraft, if the wake is the older the farther it is behind it; absent: of one age everywhere.
        aircraft: Option<Aircraft> = None,
    }

    /// How the circulation of a transported pair decays with its age tau and lifetime T.
    #[derive(Copy)]
    kinds PairDecay by "law" {
        /// exp(-slow tau - fast max(0, tau - T)).
        "two_phase" => TwoPhase {
            /// Rate before the lifetime is over, per tau.
            slow: f64 = 0.06 => 0.0..=10.0,
            /// Rate that is added after it, per tau.
            fast: f64 = 0.4 => 0.0..=100.0,
        },
        /// exp(-rate tau/T).
        "sarpkaya" => Sarpkaya {
            /// Decay over one lifetime.
            rate: f64 = 0.45 => 0.0..=100.0,
        },
        /// Refused: no readable source has the constants of the model P2P.
        "p2p" => P2p {},
    }

    /// An aircraft that flies along +x.
    #[derive(Copy)]
    table Aircraft {
        /// Speed, m/s.
        speed_m_s: f64 = 70.0 => 1.0..=1e3,
        /// Its position along x at the start of the scan, m.
        x_m: f64 = 0.0 => -1e6..=1e6,
    }

    /// `u + G x + a t`, from the place of the lidar's foot and the start of the scan.
    #[derive(Copy)]
    table LinearWind {
        /// Wind at the origin when the scan begins (u, v, w), m/s.
        velocity_m_s: [f64; 3] = [0.0; 3] => -1e3..=1e3,
        /// Gradient of u along x, y, z, 1/s.
        gradient_u_per_s: [f64; 3] = [0.0; 3] => -1e3..=1e3,
        /// Gradient of v along x, y, z, 1/s.
        gradient_v_per_s: [f64; 3] = [0.0; 3] => -1e3..=1e3,
        /// Gradient of w along x, y, z, 1/s.
        gradient_w_per_s: [f64; 3] = [0.0; 3] => -1e3..=1e3,
        /// Rate of change in time (u, v, w), m/s^2.
        acceleration_m_s2: [f64; 3] = [0.0; 3] => -1e3..=1e3,
    }

    /// Fields over (time, z, y, x), in one file or one for each time.
    table FieldFlow {
        /// The file, or the beginning of the names of numbered files, relative to the folder of the scene.
        files: String = String::new()
            => Named("a file of fields, or the beginning of the names of numbered ones"),
        /// Names of the variables of u, v, w in the file.
        names: [String; 3] = ["u".into(), "v".into(), "w".into()],
        /// Whether the flow moves during the scan.
        motion: SimulatedMotion = SimulatedMotion::Moving,
        /// Velocity along x and y that carries the field, m/s; only with `motion = "carried"`.
        carried_m_s: [f64; 2] as omitted = [0.0; 2] => -200.0..=200.0,
        /// Time of the flow when the scan begins, s; its first one if absent.
        time_s: Option<f64> = None => -1e9..=1e9,
        /// Place in the scene of the origin of the file's axes, m.
        origin_m: [f64; 3] = [0.0; 3] => -1e7..=1e7,
        /// Angle from the scene's x to the file's x, clockwise seen from above, rad.
        rotation_rad: f64 = 0.0 => -TAU..=TAU,
        /// Whether the file's axes are right-handed, y to the left of x: y and v change their sign.
        mirror_y: bool = false,
        /// Metres in the unit of length of the file.
        length_unit_m: f64 = 1.0 => 1e-6..=1e6,
        /// Metres per second in its unit of velocity.
        velocity_unit_m_s: f64 = 1.0 => 1e-6..=1e6,
        /// Whether the flow repeats itself along the file's x.
        periodic_x: bool = false,
        /// Whether it repeats itself along the file's y.
        periodic_y: bool = false,
        /// Treatment of heights below the lowest nodes.
        ground: FieldGround = FieldGround::Open,
    }

    /// Treatment of heights below the lowest nodes of fields.
    choice FieldGround {
        /// Not known: lines below are outside the flow.
        Open = "open",
        /// No-slip wall at z = 0.
        NoSlip = "no_slip",
        /// Free-slip wall at z = 0.
        Slip = "slip",
    }

    /// Whether the analytic pair moves.
    choice VortexMotion {
        /// It does not move.
        Frozen = "frozen",
        /// It follows the inviscid hyperbola over the ground, also during the scan.
        Inviscid = "inviscid",
        /// It decays, descends, may rebound, and drifts with the wind.
        Transported = "transported",
    }

    /// Cross-planes of a simulated flow.
    table SimulatedFlow {
        /// The file of planes, or the beginning of the names of numbered files (`out/plane1` for `out/plane1_0001.nc`, ...),
        /// relative to the folder of the scene.
        planes: String = String::new()
            => Named("a file of cross-planes, or the beginning of the names of numbered ones"),
        /// Whether the flow moves during the scan.
        motion: SimulatedMotion = SimulatedMotion::Moving,
        /// Time of the flow when the scan begins, s; the first of the planes if neither this nor `age_tau` is given.
        time_s: Option<f64> = None => -1e9..=1e9,
        /// Age of the wake when the scan begins, in place of `time_s`.
        age_tau: Option<f64> = None => -1e9..=1e9,
        /// Distance from the lidar to y = 0 of the flow, m.
        lateral_position_m: f64 = 400.0 => -1e5..=1e5,
        /// Metres in the unit of length of the flow: 1 if that is the metre, b0 for the case `vortex_pair`.
        length_unit_m: f64 = 1.0 => 1e-6..=1e6,
        /// Metres per second in its unit of velocity: 1, or V0 = Gamma0/(2 pi b0).
        velocity_unit_m_s: f64 = 1.0 => 1e-6..=1e6,
    }

    /// Whether a simulated flow moves during the scan.
    choice SimulatedMotion {
        /// Frozen as at the start of the scan.
        Frozen = "frozen",
        /// It moves from plane to plane; the planes must reach to the end of the scan.
        Moving = "moving",
        /// As at the start of the scan, carried by `carried_m_s` (Taylor 1938); for `fields` only.
        Carried = "carried",
    }

    /// Treatment of a line of sight where the wind is not known.
    #[derive(Copy)]
    kinds Outside by "policy" {
        /// The scene is refused.
        "error" => Error {},
        /// No backscatter there.
        "mask" => Mask {},
    }
}

impl Flow {
    /// The analytic vortex pair, if this is one.
    pub(crate) fn pair(&self) -> Option<&VortexPair> {
        match self {
            Self::VortexPair(pair) => Some(pair),
            _ => None,
        }
    }

    /// Whether the wind is read from files.
    pub(crate) fn is_stored(&self) -> bool {
        matches!(self, Self::Simulated(_) | Self::Fields(_))
    }

    /// Whether the flow is that of a wake, which has an age.
    pub(crate) fn is_wake(&self) -> bool {
        matches!(self, Self::VortexPair(_) | Self::Simulated(_))
    }

    /// Whether there are vortices to be found.
    pub(crate) fn has_vortices(&self) -> bool {
        self.is_wake() && self.pair().is_none_or(|pair| pair.circulation_m2_s > 0.0)
    }
}

/// The limits of a wind whose table is at `at`.
pub(super) fn check_flow(flow: &Flow, at: &str, c: &mut Checker<'_>) {
    let key = |name: &str| format!("{at}.{name}");
    match flow {
        Flow::Calm {} | Flow::Uniform { .. } | Flow::Linear(_) => {}
        Flow::Fields(flow) => {
            let is_carried = flow.motion == SimulatedMotion::Carried;
            let has_velocity = flow.carried_m_s != [0.0; 2];
            let allowed = if is_carried {
                "a velocity other than 0: motion = \"carried\" needs one"
            } else {
                "[0.0, 0.0]: another velocity needs motion = \"carried\""
            };
            let is_consistent = is_carried == has_velocity;
            c.require(
                is_consistent,
                &key("carried_m_s"),
                flow.carried_m_s,
                allowed,
            );
        }
        Flow::Wind(wind) => check_wind_profile(wind, at, c),
        Flow::Eddies(eddies) => check_eddies(eddies, at, c),
        Flow::Simulated(flow) => {
            c.require(
                flow.motion != SimulatedMotion::Carried,
                &key("motion"),
                flow.motion.name(),
                "\"frozen\" or \"moving\" for cross-planes",
            );
            if let Some(time_s) = flow.time_s {
                c.require(
                    flow.age_tau.is_none(),
                    &key("time_s"),
                    time_s,
                    "absent beside flow.age_tau",
                );
            }
        }
        Flow::VortexPair(p) => {
            let key = key("age_tau");
            let allowed =
                "0 for a pair at rest; an age needs flow.motion = \"inviscid\" or \"transported\"";
            c.require(
                p.age_tau == 0.0 || p.motion != VortexMotion::Frozen,
                &key,
                p.age_tau,
                allowed,
            );
            let allowed =
                format!("0 with {at}.aircraft, which says how old the wake is at each place");
            c.require(
                p.age_tau == 0.0 || p.aircraft.is_none(),
                &key,
                p.age_tau,
                allowed,
            );
            p.check_transport(at, c);
        }
    }
}

impl Default for PairDecay {
    fn default() -> Self {
        Self::TwoPhase {
            slow: 0.06,
            fast: 0.4,
        }
    }
}

impl VortexPair {
    /// Whether the pair decays and moves with the wind.
    pub(crate) fn is_transported(&self) -> bool {
        self.motion == VortexMotion::Transported
    }

    /// The limits of the keys of a transported pair.
    fn check_transport(&self, at: &str, c: &mut Checker<'_>) {
        let key = |name: &str| format!("{at}.{name}");
        if !self.is_transported() {
            let stated = [
                (
                    "decay",
                    self.decay != PairDecay::default(),
                    format!("{:?}", self.decay.name()),
                ),
                (
                    "lifetime_tau",
                    self.lifetime_tau.is_some(),
                    format!("{:?}", self.lifetime_tau.unwrap_or_default()),
                ),
                (
                    "dissipation_m2_s3",
                    self.dissipation_m2_s3.is_some(),
                    format!("{:?}", self.dissipation_m2_s3.unwrap_or_default()),
                ),
                (
                    "buoyancy_per_s",
                    self.buoyancy_per_s != 0.0,
                    format!("{:?}", self.buoyancy_per_s),
                ),
                ("rebound", self.rebound, format!("{:?}", self.rebound)),
                ("meander", self.meander, format!("{:?}", self.meander)),
            ];
            for (name, is_stated, value) in stated {
                if is_stated {
                    let allowed = format!("absent without {at}.motion = \"transported\"");
                    c.refuse(&key(name), &value, allowed);
                }
            }
            return;
        }
        let allowed = "\"two_phase\" or \"sarpkaya\": no readable source has the constants of P2P";
        let is_known = self.decay != PairDecay::P2p {};
        c.require(is_known, &key("decay.law"), "p2p", allowed);
        let allowed = "above 0: a transported pair moves by its circulation";
        c.require(
            self.circulation_m2_s > 0.0,
            &key("circulation_m2_s"),
            self.circulation_m2_s,
            allowed,
        );
        if let (Some(_), Some(dissipation)) = (self.lifetime_tau, self.dissipation_m2_s3) {
            let allowed = format!("absent beside {at}.lifetime_tau, which it would set");
            c.require(false, &key("dissipation_m2_s3"), dissipation, allowed);
        }
    }
}

impl super::Scene {
    /// The uniform winds that carry transported pairs. One that changes along the path, and a second one, are refused.
    pub(super) fn check_carriers(&self, c: &mut Checker<'_>) {
        let is_transported = |flow: &Flow| flow.pair().is_some_and(VortexPair::is_transported);
        if !self.flows().any(|(_, flow)| is_transported(flow)) {
            return;
        }
        self.check_meander(c);
        let has_mean_wind = self.mean_winds().next().is_some();
        let mut first: Option<String> = None;
        for (at, flow) in self.flows() {
            let (key, value) = match flow {
                Flow::Linear(_) => {
                    let allowed = "no \"linear\" wind beside a transported pair: a \"uniform\" one carries it";
                    c.require(false, &format!("{at}.kind"), "linear", allowed);
                    continue;
                }
                Flow::Uniform { lateral_m_s, .. } if *lateral_m_s != 0.0 => {
                    ("lateral_m_s", format!("{lateral_m_s:?}"))
                }
                // Beside a mean wind it is refused for any pair.
                Flow::VortexPair(pair) if pair.cross_wind_m_s != 0.0 && !has_mean_wind => {
                    ("cross_wind_m_s", format!("{:?}", pair.cross_wind_m_s))
                }
                Flow::Wind(_) => ("kind", "\"wind\"".to_owned()),
                _ => continue,
            };
            let key = format!("{at}.{key}");
            match &first {
                None => first = Some(key),
                Some(first) => {
                    let none = if key.ends_with(".kind") {
                        "absent"
                    } else {
                        "0"
                    };
                    let allowed =
                        format!("{none} beside {first}: one cross wind carries a transported pair");
                    c.refuse(&key, &value, allowed);
                }
            }
        }
    }

    /// Eddies that move a pair have one path for all realisations.
    fn check_meander(&self, c: &mut Checker<'_>) {
        let eddies = self
            .eddies()
            .filter(|eddies| eddies.dissipation_m2_s3 > 0.0);
        let has_one_path =
            eddies.is_some_and(|eddies| eddies.realisations == EddyRealisations::One);
        for (at, flow) in self.flows() {
            if flow.pair().is_some_and(|pair| pair.meander) && !has_one_path {
                let allowed = "absent without a flow of kind \"eddies\" with realisations = \"one\" and a dissipation above 0, \
                               which moves the pair";
                c.refuse(&format!("{at}.meander"), "true", allowed.to_owned());
            }
        }
    }

    /// Whether the air is at rest everywhere.
    pub(crate) fn is_calm(&self) -> bool {
        let is_none =
            |flow: &Flow| matches!(flow, Flow::Eddies(eddies) if eddies.dissipation_m2_s3 == 0.0);
        let has_flow = !matches!(self.flow, Flow::Calm {}) && !is_none(&self.flow);
        !has_flow && self.added_flows.iter().all(is_none)
    }
}
