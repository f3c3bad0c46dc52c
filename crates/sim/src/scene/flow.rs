//! The wind of a scene.

use serde::{Deserialize, Serialize};

/// The wind that the lidar sees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
