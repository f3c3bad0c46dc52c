//! The units of a vortex pair: lengths in `b0`, velocities in `V0 = Gamma0/(2 pi b0)`, times in `b0/V0`.
//!
//! Check: against the analytic pair.

use std::f64::consts::TAU;

use crate::error::{Error, check};
use crate::winds::Aircraft;

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
    pub const REDUCED: Self = Self { spacing_m: 1.0, circulation_m2_s: TAU };

    /// The scales of the wake of an aircraft, equation (5).
    ///
    /// # Errors
    /// As [`Aircraft::circulation_m2_s`].
    pub fn of_aircraft(aircraft: &Aircraft) -> Result<Self, Error> {
        Ok(Self { spacing_m: aircraft.spacing_m()?, circulation_m2_s: aircraft.circulation_m2_s()? })
    }

    /// # Errors
    /// [`Error::OutOfRange`] for a scale that is not positive.
    pub fn validate(&self) -> Result<(), Error> {
        check("spacing_m", self.spacing_m, "positive", |b| b > 0.0)?;
        check("circulation_m2_s", self.circulation_m2_s, "positive", |g| g > 0.0)
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
        let scales = WakeScales { spacing_m: 47.0, circulation_m2_s: 500.0 };
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
        let aircraft = Aircraft { mass_kg: 2.5e5, speed_m_s: 70.0, span_m: 60.0, air_density_kg_m3: 1.2 };
        let scales = WakeScales::of_aircraft(&aircraft).unwrap();
        // M g = rho U b0 Gamma0.
        let lift_n = 1.2 * 70.0 * scales.spacing_m * scales.circulation_m2_s;
        assert!((lift_n / (2.5e5 * 9.806_65) - 1.0).abs() < 1e-14);
        assert!(WakeScales { spacing_m: -1.0, circulation_m2_s: 1.0 }.validate().is_err());
    }
}
