//! The wake of an aircraft as an analytic flow: two counter-rotating vortices over a plane,
//! equations (1)-(5).
//!
//! The flow is two-dimensional: nothing depends on x and the axial velocity is zero. The vortex at
//! smaller y turns clockwise, the one at larger y anticlockwise (y to the right, z up), so that the
//! air between them, and the pair itself, moves down. Images of opposite sign below the ground make
//! it a streamline.
//!
//! Check: the vertical velocity at z = 0 is exactly zero, the divergence vanishes, the pair
//! descends at `Gamma0/(2 pi b0)`, and its path keeps `1/y^2 + 1/z^2`.

use std::f64::consts::PI;

use super::profile::CirculationProfile;
use super::wind::Wind;
use crate::error::{Error, check, check_lengths};

/// Standard acceleration of gravity (exact by definition).
const GRAVITY_M_S2: f64 = 9.806_65;

/// What lies at z = 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Ground {
    /// A frictionless plane, made by image vortices of opposite circulation.
    #[default]
    Image,
    /// Nothing: the pair is far from any ground.
    None,
}

/// How the pair moves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Motion {
    /// The pair stays where it is.
    #[default]
    Frozen,
    /// Each vortex is carried by the others (and by the images) as if all were point vortices:
    /// straight down at `V0` without a ground, along a hyperbola-like path over one.
    Inviscid,
}

/// A pair of counter-rotating vortices, equations (3) and (4), over the ground or without one.
///
/// Plain data; [`VortexPair::validate`] or [`VortexPair::wind`] says whether it makes sense.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VortexPair {
    /// Circulation of each vortex, `Gamma0` \[m^2/s\], not negative.
    pub circulation_m2_s: f64,
    /// Distance between the two centres at time 0, `b0` \[m\].
    pub spacing_m: f64,
    /// Radius of the largest tangential velocity, `r_c` \[m\].
    pub core_radius_m: f64,
    /// Lateral coordinate of the middle of the pair \[m\].
    pub lateral_position_m: f64,
    /// Height of both centres at time 0 \[m\]; positive where there is a ground.
    pub height_m: f64,
    /// What lies at z = 0.
    pub ground: Ground,
    /// Circulation against radius.
    pub profile: CirculationProfile,
    /// How the pair moves.
    pub motion: Motion,
}

/// One vortex at some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vortex {
    /// Circulation \[m^2/s\], anticlockwise positive: negative for the vortex at smaller y.
    pub circulation_m2_s: f64,
    /// Lateral coordinate of the centre \[m\].
    pub lateral_position_m: f64,
    /// Height of the centre \[m\].
    pub height_m: f64,
}

impl VortexPair {
    /// Says what is wrong with the pair, if anything.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the first field that is not allowed.
    pub fn validate(&self) -> Result<(), Error> {
        check(
            "circulation_m2_s",
            self.circulation_m2_s,
            "zero or positive",
            |v| v >= 0.0,
        )?;
        check("spacing_m", self.spacing_m, "positive", |v| v > 0.0)?;
        check("core_radius_m", self.core_radius_m, "positive", |v| v > 0.0)?;
        check(
            "lateral_position_m",
            self.lateral_position_m,
            "finite",
            |_| true,
        )?;
        match self.ground {
            Ground::Image => check(
                "height_m",
                self.height_m,
                "positive, above the ground",
                |v| v > 0.0,
            ),
            Ground::None => check("height_m", self.height_m, "finite", |_| true),
        }
    }

    /// The same pair, checked: it is the wind that it makes.
    ///
    /// # Errors
    /// As [`VortexPair::validate`].
    pub fn wind(self) -> Result<Self, Error> {
        self.validate()?;
        Ok(self)
    }

    /// Initial speed of descent out of ground effect, `V0 = Gamma0/(2 pi b0)` \[m/s\].
    pub fn descent_speed_m_s(&self) -> f64 {
        self.circulation_m2_s / (2.0 * PI * self.spacing_m)
    }

    /// Time \[s\] of the dimensionless time `tau = t V0/b0`; infinite if the circulation is zero.
    pub fn time_s(&self, reduced_time: f64) -> f64 {
        reduced_time * self.spacing_m / self.descent_speed_m_s()
    }

    /// `Gamma_5-15`: the circulation of one vortex averaged over radii from 5 to 15 m \[m^2/s\],
    /// without the other vortices.
    ///
    /// In closed form for the algebraic profile,
    /// `Gamma0 [1 - (r_c/10)(atan(15/r_c) - atan(5/r_c))]`; by Simpson's rule, to round-off, for
    /// the others.
    pub fn circulation_5_15_m2_s(&self) -> f64 {
        let core = self.core_radius_m;
        match self.profile {
            CirculationProfile::Algebraic => {
                let lost = 0.1 * core * ((15.0 / core).atan() - (5.0 / core).atan());
                self.circulation_m2_s * (1.0 - lost)
            }
            CirculationProfile::LambOseen | CirculationProfile::TwoScale(_) => {
                let step = 10.0 / f64::from(SIMPSON_PANELS);
                let sum: f64 = (0..=SIMPSON_PANELS)
                    .map(|i| {
                        let radius_m = 5.0 + f64::from(i) * step;
                        let is_end = i == 0 || i == SIMPSON_PANELS;
                        let weight = if is_end {
                            1.0
                        } else {
                            f64::from(2 + 2 * (i % 2))
                        };
                        weight
                            * self
                                .profile
                                .circulation_m2_s(self.circulation_m2_s, core, radius_m)
                    })
                    .sum();
                sum * step / 30.0
            }
        }
    }

    /// The vortices at smaller and at larger y at `time_s`; both have the same height.
    ///
    /// With [`Motion::Inviscid`] over a ground the path of the point vortices and their images is
    /// used in closed form: with `1/y^2 + 1/z^2 = C` (y the half distance) and `tan(theta) = y/z`,
    /// `cot(2 theta)` falls linearly in time, at the rate `C Gamma0/(8 pi)`. Valid for negative
    /// times too.
    pub fn vortices(&self, time_s: f64) -> [Vortex; 2] {
        let half_m = 0.5 * self.spacing_m;
        let (half_m, height_m) = match (self.motion, self.ground) {
            (Motion::Frozen, _) => (half_m, self.height_m),
            (Motion::Inviscid, Ground::None) => {
                (half_m, self.height_m - self.descent_speed_m_s() * time_s)
            }
            (Motion::Inviscid, Ground::Image) => self.path_over_ground(half_m, time_s),
        };
        [-1.0, 1.0].map(|sign| Vortex {
            circulation_m2_s: sign * self.circulation_m2_s,
            lateral_position_m: self.lateral_position_m + sign * half_m,
            height_m,
        })
    }

    /// Velocity `(v, w)` of a vortex with this circulation, anticlockwise if positive, and the
    /// profile of the pair, at `(dy, dz)` from its centre.
    fn vortex_velocity(&self, circulation_m2_s: f64, dy_m: f64, dz_m: f64) -> [f64; 2] {
        let square_m2 = dy_m * dy_m + dz_m * dz_m;
        let omega =
            self.profile
                .angular_velocity_rad_s(circulation_m2_s, self.core_radius_m, square_m2);
        [-omega * dz_m, omega * dy_m]
    }

    /// Writes the velocity of some vortices with the core and the ground of the pair.
    pub(super) fn sum_into(
        &self,
        vortices: &[Vortex],
        points_m: &[[f64; 3]],
        out_m_s: &mut [[f64; 3]],
    ) {
        for (&[_, y_m, z_m], out) in points_m.iter().zip(out_m_s) {
            let mut sum = [0.0; 2];
            for vortex in vortices {
                let circulation_m2_s = vortex.circulation_m2_s;
                let dy_m = y_m - vortex.lateral_position_m;
                let mut velocity =
                    self.vortex_velocity(circulation_m2_s, dy_m, z_m - vortex.height_m);
                if self.ground == Ground::Image {
                    // Added to its own vortex first, so that the two vertical velocities cancel to
                    // the bit at z = 0.
                    let image =
                        self.vortex_velocity(-circulation_m2_s, dy_m, z_m + vortex.height_m);
                    velocity[0] += image[0];
                    velocity[1] += image[1];
                }
                sum[0] += velocity[0];
                sum[1] += velocity[1];
            }
            *out = [0.0, sum[0], sum[1]];
        }
    }

    /// Half distance and height \[m\] of the point vortices over a plane at `time_s`.
    fn path_over_ground(&self, half_m: f64, time_s: f64) -> (f64, f64) {
        let invariant = 1.0 / (half_m * half_m) + 1.0 / (self.height_m * self.height_m);
        let tangent = half_m / self.height_m;
        let cot_start = 0.5 * (1.0 / tangent - tangent);
        let cot = cot_start - invariant * self.circulation_m2_s * time_s / (8.0 * PI);
        // The root of tan^2 + 2 cot tan - 1 that is positive, without cancellation for either sign.
        let root = cot.hypot(1.0);
        let tangent = if cot > 0.0 {
            1.0 / (cot + root)
        } else {
            root - cot
        };
        let half_m = tangent.hypot(1.0) / invariant.sqrt();
        (half_m, half_m / tangent)
    }
}

/// Intervals of Simpson's rule for `Gamma_5-15` (even).
const SIMPSON_PANELS: i32 = 400;

impl Wind for VortexPair {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        check("time_s", time_s, "finite", |_| true)?;
        self.sum_into(&self.vortices(time_s), points_m, out_m_s);
        Ok(())
    }

    /// The strain of one vortex at its own core radius
    /// ([`CirculationProfile::max_line_gradient_per_s`]) plus what the others can add where that
    /// one is the nearest. Never too small; 4 % too large for cores of 5 % of the spacing.
    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        let [left, right] = self.vortices(time_s);
        gradient_about_per_s(self, &left, &[right])
    }
}

/// The largest line gradient of vortices with the core and the ground of a pair: the largest of
/// those where each one is the nearest.
pub(super) fn largest_gradient_per_s(pair: &VortexPair, vortices: &[Vortex]) -> f64 {
    let mut largest_per_s = 0.0_f64;
    for (i, own) in vortices.iter().enumerate() {
        let mut others = vortices.to_vec();
        others.remove(i);
        largest_per_s = largest_per_s.max(gradient_about_per_s(pair, own, &others));
    }
    largest_per_s
}

/// Upper bound of the line gradient where one vortex is the nearest: its own strain and what
/// others and the images can add there.
fn gradient_about_per_s(pair: &VortexPair, own: &Vortex, others: &[Vortex]) -> f64 {
    let core_m = pair.core_radius_m;
    let strain_per_s = |vortex: &Vortex, distance_m: f64| {
        let circulation_m2_s = vortex.circulation_m2_s.abs();
        // A point is nearest to one vortex, so each other one is at least half their distance away;
        // beyond the peak of the strain, which lies within 1.2 core radii, the strain only falls.
        if distance_m > 2.4 * core_m {
            pair.profile
                .strain_rate_per_s(circulation_m2_s, core_m, 0.5 * distance_m)
        } else {
            pair.profile
                .max_line_gradient_per_s(circulation_m2_s, core_m)
        }
    };
    let apart_m = |other: &Vortex| other.lateral_position_m - own.lateral_position_m;
    let mut added_per_s = 0.0;
    for other in others {
        let distance_m = apart_m(other).hypot(other.height_m - own.height_m);
        added_per_s += strain_per_s(other, distance_m);
    }
    if pair.ground == Ground::Image {
        added_per_s += strain_per_s(own, 2.0 * own.height_m);
        for other in others {
            let distance_m = apart_m(other).hypot(other.height_m + own.height_m);
            added_per_s += strain_per_s(other, distance_m);
        }
    }
    strain_per_s(own, 0.0) + added_per_s
}

/// An aircraft as far as its wake is concerned, equation (5): `M g = rho U b0 Gamma0`,
/// `b0 = pi b/4`.
///
/// The spacing is that of an elliptically loaded wing (Prandtl's lifting line).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aircraft {
    /// Mass `M` \[kg\].
    pub mass_kg: f64,
    /// Flight speed `U` \[m/s\].
    pub speed_m_s: f64,
    /// Wing span `b` \[m\].
    pub span_m: f64,
    /// Density of the air `rho` \[kg/m^3\].
    pub air_density_kg_m3: f64,
}

impl Aircraft {
    /// A320 at its largest landing mass, in standard air at sea level.
    pub const A320: Self = Self::landing(66_000.0, 34.1);
    /// A340-300 at its largest landing mass.
    pub const A340_300: Self = Self::landing(190_000.0, 60.3);
    /// B747-400 at its largest landing mass.
    pub const B747_400: Self = Self::landing(285_800.0, 64.4);
    /// A380-800 at its largest landing mass.
    pub const A380_800: Self = Self::landing(391_000.0, 79.8);

    /// At 70 m/s, the approach speed of the chapter, in standard air at sea level.
    const fn landing(mass_kg: f64, span_m: f64) -> Self {
        Self {
            mass_kg,
            speed_m_s: 70.0,
            span_m,
            air_density_kg_m3: 1.225,
        }
    }

    /// Distance between the vortices, `b0 = pi b/4` \[m\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the span is not positive.
    pub fn spacing_m(&self) -> Result<f64, Error> {
        check("span_m", self.span_m, "positive", |v| v > 0.0)?;
        Ok(0.25 * PI * self.span_m)
    }

    /// Circulation of each vortex \[m^2/s\] from equation (5).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if a field is not positive.
    pub fn circulation_m2_s(&self) -> Result<f64, Error> {
        check("mass_kg", self.mass_kg, "positive", |v| v > 0.0)?;
        check("speed_m_s", self.speed_m_s, "positive", |v| v > 0.0)?;
        check(
            "air_density_kg_m3",
            self.air_density_kg_m3,
            "positive",
            |v| v > 0.0,
        )?;
        let lift_n = self.mass_kg * GRAVITY_M_S2;
        Ok(lift_n / (self.air_density_kg_m3 * self.speed_m_s * self.spacing_m()?))
    }
}
