//! The wake of an aircraft near the ground: the keys of its case, their limits, the case of the solver.

use super::super::setup::Setup;
use super::super::vortex_pair::{STRETCH, check_pair};
use super::history::WakeHistory;
use crate::Error;
use crate::keys::{ABOVE_ZERO, Checker, Is, ZERO_OR_MORE, keys};
use wakescope_les::cases::{Case, VortexPairCase};
use wakescope_les::{CirculationProfile, analysis::WakeScales, winds::Aircraft};

/// Longest step, in `tau`.
const LONGEST_STEP: f64 = 0.01;

keys! {
    /// Circulation against radius.
    choice WakeProfile {
        /// `Gamma0 r^2/(r^2 + r_c^2)`, (3).
        Algebraic = "algebraic",
        /// Lamb and Oseen's.
        LambOseen = "lamb_oseen",
        /// A viscous core inside a broad distribution over the span `4 b0/pi`.
        TwoScale = "two_scale",
    }

    /// Spacing and circulation of the pair.
    #[derive(Copy)]
    kinds PairScale by "from" {
        /// As given.
        "circulation" => Circulation {
            /// Distance `b0` between the vortices \[m\].
            spacing_m: f64,
            /// Circulation `Gamma0` of each \[m^2/s\].
            circulation_m2_s: f64,
        },
        /// From mass, speed and span, (5).
        "aircraft" => Aircraft {
            /// Mass \[kg\].
            mass_kg: f64,
            /// Flight speed \[m/s\].
            speed_m_s: f64,
            /// Wing span \[m\].
            span_m: f64,
            /// Density of the air \[kg/m^3\].
            air_density_kg_m3: f64,
        },
        /// An A320 at landing.
        "a320" => A320 {},
        /// An A340-300 at landing.
        "a340" => A340 {},
        /// A B747-400 at landing.
        "b747" => B747 {},
        /// An A380-800 at landing.
        "a380" => A380 {},
    }
}

impl PairScale {
    /// The scales.
    ///
    /// # Errors
    /// What is not positive.
    pub fn scales(self) -> Result<WakeScales, wakescope_les::Error> {
        let aircraft = match self {
            Self::Circulation {
                spacing_m,
                circulation_m2_s,
            } => {
                return Ok(WakeScales {
                    spacing_m,
                    circulation_m2_s,
                });
            }
            Self::Aircraft {
                mass_kg,
                speed_m_s,
                span_m,
                air_density_kg_m3,
            } => Aircraft {
                mass_kg,
                speed_m_s,
                span_m,
                air_density_kg_m3,
            },
            Self::A320 {} => Aircraft::A320,
            Self::A340 {} => Aircraft::A340_300,
            Self::B747 {} => Aircraft::B747_400,
            Self::A380 {} => Aircraft::A380_800,
        };
        WakeScales::of_aircraft(&aircraft)
    }
}

keys! {
    /// The wake of an aircraft near the ground. Lengths without a unit are in `b0`, velocities in `V0`. Defaults: `coarse`.
    table WakeFlow {
        /// Spacing and circulation.
        pair: PairScale = PairScale::Circulation { spacing_m: 47.0, circulation_m2_s: 500.0 },
        /// Cells along x (1 for a plane flow), y, z.
        cells: [usize; 3] = [24, 128, 80] => 1..=100_000,
        /// Length, width and height of the box.
        size: [f64; 3] = [1.0, 4.0, 2.5] => ABOVE_ZERO,
        /// Strength of the refinement towards the ground; 0 for equal cells.
        ground_stretch: f64 = 1.5 => STRETCH,
        /// Refinement towards the middle of y, 0 to 0.9: cells are `1 - a` of the mean there, `1 + a` at the sides.
        lateral_stretch: f64 = 0.0 => 0.0..=0.9,
        /// Height of both vortices.
        height: f64 = 1.0,
        /// Core radius.
        core_radius: f64 = 0.1 => ABOVE_ZERO,
        /// Circulation against radius.
        profile: WakeProfile = WakeProfile::Algebraic,
        /// `Gamma0/nu`.
        reynolds: f64 = 5000.0 => ABOVE_ZERO,
        /// The ground: no-slip if true, else a frictionless plane.
        sticky_ground: bool = true,
        /// Whether the sides are frictionless planes instead of periodic.
        slip_sides: bool = false,
        /// Root-mean-square of each component of the noise within 0.3 of the vortices.
        perturbation: f64 = 0.01 => ZERO_OR_MORE,
        /// Seed of noise and background; without one the noise is a closed formula.
        seed: Option<u64> = None,
        /// Root-mean-square of each component of turbulence that fills the box.
        background: f64 = 0.0 => ZERO_OR_MORE,
        /// Cross wind at the height of the vortices \[m/s\].
        cross_wind_m_s: f64 = 0.0,
        /// Roughness length of a logarithmic wind \[m\]; 0 for the same wind at all heights.
        wind_roughness_m: f64 = 0.0 => ZERO_OR_MORE,
        /// Radii between which `Gamma_5-15` is averaged \[m\].
        circulation_radii_m: [f64; 2] = [5.0, 15.0] => Is(
            |[from, to]: &[f64; 2]| *from > 0.0 && to > from && to.is_finite(),
            "two numbers above 0 that increase",
        ),
    }
}

impl WakeFlow {
    pub(in super::super) fn check(&self, p: &mut Checker<'_>) {
        let wind = ("case.cross_wind_m_s", self.cross_wind_m_s);
        check_pair(p, (self.height, self.size), wind, self.slip_sides);
        if let Err(error) = self.pair.scales().and_then(|scales| scales.validate()) {
            p.require(false, "case.pair", self.pair, error.to_string());
        }
    }

    /// Keys that do nothing, or less than they seem to, in sentences.
    pub(in super::super) fn idle(&self) -> Vec<String> {
        let height_m = self
            .pair
            .scales()
            .map_or(f64::INFINITY, |scales| self.height * scales.spacing_m);
        let is_noisy = self.perturbation > 0.0 || self.background > 0.0;
        let [_, to] = self.circulation_radii_m;
        let mut idle = Vec::new();
        if to >= height_m {
            idle.push(format!(
                "case.circulation_radii_m: circles of {to:?} m about vortices at a height of {height_m:?} m leave the flow: their \
                 circulation is empty"
            ));
        }
        if self.wind_roughness_m > 0.0 && self.cross_wind_m_s == 0.0 {
            idle.push("case.wind_roughness_m does nothing without case.cross_wind_m_s".into());
        }
        if self.seed.is_some() && !is_noisy {
            idle.push("case.seed does nothing without case.perturbation or case.background".into());
        }
        idle
    }

    /// The case of the solver.
    ///
    /// # Errors
    /// What the solver refuses.
    pub fn pair_case(&self) -> Result<VortexPairCase, wakescope_les::Error> {
        let scales = self.pair.scales()?;
        let pair = VortexPairCase {
            cells: self.cells,
            size: self.size,
            ground_stretch: self.ground_stretch,
            lateral_stretch: self.lateral_stretch,
            height: self.height,
            core_radius: self.core_radius,
            profile: match self.profile {
                WakeProfile::LambOseen => CirculationProfile::LambOseen,
                WakeProfile::Algebraic | WakeProfile::TwoScale => CirculationProfile::Algebraic,
            },
            reynolds: self.reynolds,
            sticky_ground: self.sticky_ground,
            slip_sides: self.slip_sides,
            perturbation: self.perturbation,
            seed: self.seed,
            background: self.background,
            cross_wind: self.cross_wind_m_s / scales.descent_speed_m_s(),
            wind_roughness: self.wind_roughness_m / scales.spacing_m,
            ..VortexPairCase::coarse()
        };
        if self.profile == WakeProfile::TwoScale {
            pair.with_two_scales()
        } else {
            Ok(pair)
        }
    }

    pub(in super::super) fn setup(&self) -> Result<Setup, Error> {
        let scales = self.pair.scales().map_err(Error::Flow)?;
        let pair = self.pair_case().map_err(Error::Flow)?;
        let unit_s = scales.time_unit_s();
        let window = self.circulation_radii_m.map(|r| r / scales.spacing_m);
        let meter = pair
            .meter(&scales)
            .and_then(|meter| meter.with_window(window))
            .map_err(Error::Flow)?;
        let Case {
            mesh,
            settings,
            initial,
            end_s,
        } = pair
            .scaled(&scales, VortexPairCase::steps(LONGEST_STEP * unit_s))
            .map_err(Error::Flow)?;
        let core_radius_m = self.core_radius * scales.spacing_m;
        let wake = WakeHistory::new(
            meter,
            self.circulation_radii_m,
            scales,
            core_radius_m,
            &mesh,
        );
        Ok(Setup {
            mesh,
            settings,
            initial,
            end_s: Some(end_s),
            tau_per_s: 1.0 / unit_s,
            wake: Some(wake),
            undamped: None,
        })
    }
}
