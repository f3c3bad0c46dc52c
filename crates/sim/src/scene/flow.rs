//! The wind of a scene.

use serde::{Deserialize, Serialize};

/// The wind that the lidar sees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Flow {
    /// No wind.
    Calm {},
    /// The same wind everywhere.
    Uniform {
        /// Wind away from the lidar, m/s.
        lateral_m_s: f64,
        /// Wind upwards, m/s.
        vertical_m_s: f64,
    },
    /// The analytic vortex pair (3)-(5) with its images below the ground.
    VortexPair(VortexPair),
    /// Cross-planes that `wakescope flow` wrote.
    Simulated(SimulatedFlow),
}

impl Default for Flow {
    fn default() -> Self {
        Flow::VortexPair(VortexPair::default())
    }
}

section! {
    /// The analytic vortex pair (3)-(5).
    #[derive(Copy)]
    VortexPair {
        /// Circulation Gamma0 of each vortex, m^2/s.
        circulation_m2_s: f64 = 500.0,
        /// Distance b0 between the vortices when they were released, m.
        spacing_m: f64 = 47.0,
        /// Core radius r_c, m.
        core_radius_m: f64 = 2.35,
        /// Distance from the lidar to the midpoint of the pair, m.
        lateral_position_m: f64 = 400.0,
        /// Height at which the pair was released, m.
        height_m: f64 = 47.0,
        /// Circulation profile.
        profile: VortexProfile = VortexProfile::Algebraic,
        /// Whether the pair moves.
        motion: VortexMotion = VortexMotion::Frozen,
        /// Age of the pair when the scan begins, in tau = t V0/b0; not 0 only if it moves.
        age_tau: f64 = 0.0,
        /// Uniform cross wind added to the pair, m/s, positive away from the lidar.
        cross_wind_m_s: f64 = 0.0,
    }
}

/// Circulation profile of a vortex.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VortexProfile {
    /// Gamma0 r^2/(r^2 + r_c^2), (3).
    Algebraic,
    /// Lamb-Oseen with the same radius of maximum speed.
    LambOseen,
}

/// Whether the analytic pair moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VortexMotion {
    /// It stays where it was released.
    Frozen,
    /// It follows the inviscid hyperbola over the ground, also during the scan.
    Inviscid,
}

section! {
    /// Cross-planes of a simulated flow.
    SimulatedFlow {
        /// The file of planes, or the beginning of the names of numbered files (`out/plane1` for `out/plane1_0001.nc`, ...),
        /// relative to the folder of the scene.
        planes: String = String::new(),
        /// Whether the flow moves during the scan.
        motion: SimulatedMotion = SimulatedMotion::Moving,
        /// Time of the flow when the scan begins, s; the first of the planes if neither this nor `age_tau` is given.
        #[serde(skip_serializing_if = "Option::is_none")]
        time_s: Option<f64> = None,
        /// The same as an age of the wake.
        #[serde(skip_serializing_if = "Option::is_none")]
        age_tau: Option<f64> = None,
        /// Distance from the lidar to y = 0 of the flow, m.
        lateral_position_m: f64 = 400.0,
        /// Metres in the unit of length of the flow: 1 if that is the metre, b0 for the case `vortex_pair`.
        length_unit_m: f64 = 1.0,
        /// Metres per second in its unit of velocity: 1, or V0 = Gamma0/(2 pi b0).
        velocity_unit_m_s: f64 = 1.0,
    }
}

/// Whether a simulated flow moves during the scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SimulatedMotion {
    /// It stands still as it was when the scan began.
    Frozen,
    /// It moves from plane to plane; the planes must reach to the end of the scan.
    Moving,
}

/// What a line of sight meets where the wind is not known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "policy", rename_all = "snake_case", deny_unknown_fields)]
pub enum Outside {
    /// The scene is refused.
    Error {},
    /// Nothing that returns light.
    Mask {},
    /// Air with this radial velocity.
    Constant {
        /// Radial velocity, m/s, positive away from the lidar.
        radial_velocity_m_s: f64,
    },
}
