//! What a [`WakeMeter`](super::WakeMeter) finds at one instant, and the units of a vortex pair:
//! lengths in `b0`, velocities in `V0 = Gamma0/(2 pi b0)`, times in `b0/V0`.
//!
//! Check: scaling there and back; the units against the analytic pair.

use crate::error::{Error, check};
use crate::winds::Aircraft;
use std::f64::consts::TAU;

/// The state of a wake at one instant. Quantities of the whole flow are per length of x.
#[derive(Debug, Clone, PartialEq)]
pub struct WakeRecord {
    /// Time \[s\].
    pub time_s: f64,
    /// The vortex that began at smaller y, of negative circulation.
    pub left: VortexRecord,
    /// The vortex that began at larger y.
    pub right: VortexRecord,
    /// Kinetic energy, half the integral of the squared speed over the cross-section \[m^4/s^2\].
    pub energy_m4_s2: f64,
    /// That of each axial mode `m = 0, 1, ...`, wavelength `L_x/m`; `m = 0` is the plane part
    /// \[m^4/s^2\].
    pub mode_energy_m4_s2: Vec<f64>,
    /// Half the integral of the squared vorticity over the cross-section, ground included
    /// \[m^2/s^2\].
    pub enstrophy_m2_s2: f64,
    /// Largest shear at the ground \[1/s\].
    pub wall_shear_per_s: f64,
    /// Height of the first centre above the ground in wall units of that shear; 0 without friction.
    pub wall_units: f64,
}

/// One vortex and the secondary vortices on its side. Missing values are NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct VortexRecord {
    /// Centre `y`: centroid of the vorticity averaged over x, of the vortex's own sign, within 0.15
    /// `b0` of itself \[m\].
    pub y_m: f64,
    /// Height of the centre \[m\].
    pub z_m: f64,
    /// The same centroid `(y, z)` in each cross-plane of the mesh \[m\].
    pub slices_m: Vec<[f64; 2]>,
    /// Standard deviation of their y \[m\].
    pub y_spread_m: f64,
    /// Standard deviation of their z \[m\].
    pub z_spread_m: f64,
    /// Circulation averaged over 21 radii of the window, with its sign, of the flow averaged over x
    /// \[m^2/s\].
    pub gamma_5_15_m2_s: f64,
    /// Circulation at [`WakeMeter::radii_m`](super::WakeMeter::radii_m) \[m^2/s\].
    pub gamma_m2_s: Vec<f64>,
    /// Vorticity of the other sign on this side, above 0.15 `b0`, summed \[m^2/s\].
    pub gamma_opposite_m2_s: f64,
    /// The strongest secondary vortex of this side.
    pub secondary: SecondaryRecord,
    /// Least shear of the outward velocity at the ground, averaged over x: negative where the
    /// boundary layer has separated \[1/s\].
    pub outward_shear_per_s: f64,
}

/// A secondary vortex: about the strongest vorticity of the other sign above 0.15 `b0`. NaN before
/// there is one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondaryRecord {
    /// Centroid `y` \[m\].
    pub y_m: f64,
    /// Its height \[m\].
    pub z_m: f64,
    /// Standard deviation over x of `y` \[m\].
    pub y_spread_m: f64,
    /// Standard deviation over x of `z` \[m\].
    pub z_spread_m: f64,
    /// Vorticity of its sign within 0.15 `b0` of it, summed \[m^2/s\].
    pub gamma_m2_s: f64,
}

impl SecondaryRecord {
    /// None is there.
    pub(super) const NONE: Self = Self {
        y_m: f64::NAN,
        z_m: f64::NAN,
        y_spread_m: f64::NAN,
        z_spread_m: f64::NAN,
        gamma_m2_s: f64::NAN,
    };
}

impl WakeRecord {
    /// Energy of all that varies along x \[m^4/s^2\].
    pub fn energy_3d_m4_s2(&self) -> f64 {
        self.mode_energy_m4_s2.iter().skip(1).sum()
    }
}

/// Initial spacing and circulation of a pair: its units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WakeScales {
    /// Distance `b0` between the vortices \[m\].
    pub spacing_m: f64,
    /// Circulation `Gamma0` of each \[m^2/s\].
    pub circulation_m2_s: f64,
}

impl WakeScales {
    /// `b0` = 1 m and `Gamma0` = 2 pi m^2/s: then `V0` = 1 m/s, and seconds are `tau`.
    pub const REDUCED: Self = Self {
        spacing_m: 1.0,
        circulation_m2_s: TAU,
    };

    /// The scales of the wake of an aircraft, equation (5).
    ///
    /// # Errors
    /// As [`Aircraft::circulation_m2_s`].
    pub fn of_aircraft(aircraft: &Aircraft) -> Result<Self, Error> {
        Ok(Self {
            spacing_m: aircraft.spacing_m()?,
            circulation_m2_s: aircraft.circulation_m2_s()?,
        })
    }

    /// Checks both scales.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a scale that is not positive.
    pub fn validate(&self) -> Result<(), Error> {
        check("spacing_m", self.spacing_m, "positive", |b| b > 0.0)?;
        check("circulation_m2_s", self.circulation_m2_s, "positive", |g| {
            g > 0.0
        })
    }

    /// Initial speed of descent `V0` \[m/s\].
    pub fn descent_speed_m_s(&self) -> f64 {
        self.circulation_m2_s / (TAU * self.spacing_m)
    }

    /// `Gamma0/b0^2` \[1/s\].
    pub fn vorticity_per_s(&self) -> f64 {
        self.circulation_m2_s / self.spacing_m.powi(2)
    }

    /// Time `b0/V0` in which `tau` grows by one \[s\].
    pub fn time_unit_s(&self) -> f64 {
        self.spacing_m / self.descent_speed_m_s()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_those_of_the_analytic_pair_and_of_the_aircraft() {
        let scales = WakeScales {
            spacing_m: 47.0,
            circulation_m2_s: 500.0,
        };
        let pair = crate::winds::VortexPair {
            circulation_m2_s: 500.0,
            spacing_m: 47.0,
            core_radius_m: 2.0,
            lateral_position_m: 0.0,
            height_m: 47.0,
            ground: crate::winds::Ground::Image,
            profile: crate::winds::CirculationProfile::Algebraic,
            motion: crate::winds::Motion::Frozen,
        };
        assert_eq!(scales.descent_speed_m_s(), pair.descent_speed_m_s());
        assert!((scales.time_unit_s() - pair.time_s(1.0)).abs() < 1e-12);
        assert_eq!(WakeScales::REDUCED.time_unit_s(), 1.0);
        let aircraft = Aircraft {
            mass_kg: 2.5e5,
            speed_m_s: 70.0,
            span_m: 60.0,
            air_density_kg_m3: 1.2,
        };
        let scales = WakeScales::of_aircraft(&aircraft).unwrap();
        // M g = rho U b0 Gamma0.
        let lift_n = 1.2 * 70.0 * scales.spacing_m * scales.circulation_m2_s;
        assert!((lift_n / (2.5e5 * 9.806_65) - 1.0).abs() < 1e-14);
        assert!(
            WakeScales {
                spacing_m: -1.0,
                circulation_m2_s: 1.0
            }
            .validate()
            .is_err()
        );
    }
}
