//! The circulation of one vortex as a function of the distance from its centre, equations (3) and
//! (4).
//!
//! The two-scale profile of a rolled-up wake has a viscous core inside a broad distribution of
//! circulation: `Gamma(r) = Gamma0 [1 - exp(-q)]`,
//! `q = beta_i (r/b)^2/{1 + [(beta_i/beta_o) (r/b)^(5/4)]^3}^(1/3)` with the wing span `b` and
//! `beta_o` = 10 (Winckelmans; Gerz, Holzaepfel and Darracq 2002). Near the centre it is a
//! Lamb-Oseen core, far away `q = beta_o (r/b)^(3/4)`: a fifth of the circulation lies further out
//! than a twelfth of the span, a third further out than an eighteenth.
//!
//! Check: the tangential velocity is largest at the core radius, and `Gamma0/(4 pi r_c)` there for
//! the algebraic profile; the largest line gradient agrees with a search over radius and direction;
//! both limits of `q`.

use crate::error::{Error, check};
use std::f64::consts::PI;

/// Root of `2 s + 1 = exp(s)`: makes `r_c` the radius of the largest tangential velocity of a
/// Lamb-Oseen vortex.
const LAMB_OSEEN_BETA: f64 = 1.256_431_208_626_169_6;

/// Root of `1 + s + s^2 = exp(s)`, `s = beta r^2/r_c^2`: where the strain of a Lamb-Oseen vortex is
/// largest.
const LAMB_OSEEN_STRAIN_ROOT: f64 = 1.793_282_132_900_760_4;

/// How the circulation grows with the distance from the centre of a vortex.
///
/// All profiles tend to the full circulation far away and have their largest tangential velocity at
/// `core_radius_m`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum CirculationProfile {
    /// `Gamma0 r^2/(r^2 + r_c^2)`, equation (3); Burnham and Hallock (1982). Its largest velocity
    /// is half that of a point vortex at the same radius.
    #[default]
    Algebraic,
    /// `Gamma0 (1 - exp(-1.2564 r^2/r_c^2))`: the vortex of Lamb and Oseen, a solution of the
    /// Navier-Stokes equations (Lamb 1932, section 334a).
    LambOseen,
    /// A viscous core inside a broad distribution of circulation, as after the roll-up of a wing's
    /// vortex sheet.
    TwoScale(TwoScale),
}

impl CirculationProfile {
    /// Circulation \[m^2/s\] on the circle of `radius_m` about an isolated vortex, equation (3) or
    /// its Lamb-Oseen counterpart.
    pub fn circulation_m2_s(self, circulation_m2_s: f64, core_radius_m: f64, radius_m: f64) -> f64 {
        let r2 = radius_m * radius_m;
        2.0 * PI * r2 * self.angular_velocity_rad_s(circulation_m2_s, core_radius_m, r2)
    }

    /// Tangential velocity \[m/s\] at `radius_m` from an isolated vortex, equation (4).
    pub fn tangential_velocity_m_s(
        self,
        circulation_m2_s: f64,
        core_radius_m: f64,
        radius_m: f64,
    ) -> f64 {
        radius_m * self.angular_velocity_rad_s(circulation_m2_s, core_radius_m, radius_m * radius_m)
    }

    /// Largest gradient of the velocity component along any straight line through an isolated
    /// vortex \[1/s\]: the largest strain rate, `|r d(u_theta/r)/dr|/2`.
    ///
    /// For the algebraic profile exactly `Gamma0/(8 pi r_c^2)` = 0.0398 `Gamma0/r_c^2`, found at
    /// the core radius along lines at 45 degrees to it; 0.0597 `Gamma0/r_c^2` for Lamb-Oseen.
    pub fn max_line_gradient_per_s(self, circulation_m2_s: f64, core_radius_m: f64) -> f64 {
        let scale = circulation_m2_s / (2.0 * PI * core_radius_m * core_radius_m);
        match self {
            Self::Algebraic => 0.25 * scale,
            Self::LambOseen => {
                let s = LAMB_OSEEN_STRAIN_ROOT;
                scale * LAMB_OSEEN_BETA * (-(-s).exp_m1() / s - (-s).exp())
            }
            Self::TwoScale(_) => self.max_strain_rate_per_s(circulation_m2_s, core_radius_m),
        }
    }

    /// The largest strain rate \[1/s\] by a search in thirds: it has one maximum, beyond the core
    /// radius.
    fn max_strain_rate_per_s(self, circulation_m2_s: f64, core_radius_m: f64) -> f64 {
        // The interval in core radii.
        let mut low = 0.0;
        let mut high = 4.0;
        for _ in 0..100 {
            let third = (high - low) / 3.0;
            let [left, right] = [low + third, high - third];
            let [left_per_s, right_per_s] = [left, right].map(|radius| {
                self.strain_rate_per_s(circulation_m2_s, core_radius_m, radius * core_radius_m)
            });
            if left_per_s < right_per_s {
                low = left;
            } else {
                high = right;
            }
        }
        self.strain_rate_per_s(circulation_m2_s, core_radius_m, low * core_radius_m)
    }

    /// Angular velocity `u_theta/r` \[rad/s\] from the squared distance: what the velocity of a
    /// point needs, without a division by zero at the centre.
    pub(crate) fn angular_velocity_rad_s(
        self,
        circulation_m2_s: f64,
        core_radius_m: f64,
        radius_squared_m2: f64,
    ) -> f64 {
        let core2 = core_radius_m * core_radius_m;
        match self {
            Self::Algebraic => circulation_m2_s / (2.0 * PI * (radius_squared_m2 + core2)),
            Self::LambOseen => {
                let s = LAMB_OSEEN_BETA * radius_squared_m2 / core2;
                // (1 - exp(-s))/s tends to 1 - s/2 at the centre.
                let ratio = if s < 1e-8 {
                    1.0 - 0.5 * s
                } else {
                    -(-s).exp_m1() / s
                };
                circulation_m2_s * LAMB_OSEEN_BETA / (2.0 * PI * core2) * ratio
            }
            Self::TwoScale(shape) => {
                let s2 = (radius_squared_m2 / core2).max(1e-12);
                circulation_m2_s / (2.0 * PI * core2) * -(-shape.exponent(s2).0).exp_m1() / s2
            }
        }
    }

    /// Strain rate \[1/s\] of an isolated vortex at `radius_m`, an upper bound of the line gradient
    /// there.
    pub(crate) fn strain_rate_per_s(
        self,
        circulation_m2_s: f64,
        core_radius_m: f64,
        radius_m: f64,
    ) -> f64 {
        let core2 = core_radius_m * core_radius_m;
        let r2 = radius_m * radius_m;
        match self {
            Self::Algebraic => circulation_m2_s / (2.0 * PI) * r2 / ((r2 + core2) * (r2 + core2)),
            Self::LambOseen => {
                let s = LAMB_OSEEN_BETA * r2 / core2;
                let core = LAMB_OSEEN_BETA * circulation_m2_s / (2.0 * PI * core2);
                if s < 1e-4 {
                    core * 0.5 * s
                } else {
                    core * (-(-s).exp_m1() / s - (-s).exp())
                }
            }
            Self::TwoScale(shape) => {
                let s2 = r2 / core2;
                if s2 < 1e-6 {
                    return 0.0;
                }
                // |r d(omega)/dr|/2 of omega = Gamma/(2 pi r^2).
                let (q, slope) = shape.exponent(s2);
                circulation_m2_s / (2.0 * PI * r2) * (-(-q).exp_m1() - 0.5 * slope * (-q).exp())
            }
        }
    }
}

/// `beta_o`: the outer scale.
const OUTER: f64 = 10.0;
/// Power that joins the two parts.
const POWER: f64 = 3.0;

/// The parameters of a two-scale profile in units of its core radius; made by [`TwoScale::new`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoScale {
    /// `beta_i (r_c/b)^2`.
    inner: f64,
    /// `(beta_i/beta_o) (r_c/b)^(5/4)`.
    joint: f64,
}

impl TwoScale {
    /// The profile whose largest tangential velocity is at `r_c = b/span_over_core`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless the ratio is from 5 to 1000.
    pub fn new(span_over_core: f64) -> Result<Self, Error> {
        check("span_over_core", span_over_core, "from 5 to 1000", |r| {
            (5.0..=1000.0).contains(&r)
        })?;
        // The velocity grows with r at the core radius while r q' > exp(q) - 1; the stronger the
        // core, the less.
        let mut low = 1e-6_f64;
        let mut high = 1e3_f64;
        for _ in 0..200 {
            let middle = (low * high).sqrt();
            let (q, slope) = Self::with_inner(middle, span_over_core).exponent(1.0);
            if slope > q.exp_m1() {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(Self::with_inner(low, span_over_core))
    }

    /// The profile with the inner parameter `beta_i (r_c/b)^2`.
    fn with_inner(inner: f64, span_over_core: f64) -> Self {
        Self {
            inner,
            joint: inner * span_over_core.powi(2) / OUTER * span_over_core.powf(-1.25),
        }
    }

    /// `q` and `r dq/dr` at the squared distance `s2` in core radii.
    pub(crate) fn exponent(&self, s2: f64) -> (f64, f64) {
        let outer = (self.joint * s2.powf(0.625)).powf(POWER);
        let q = self.inner * s2 / (1.0 + outer).powf(1.0 / POWER);
        (q, q * (2.0 - 1.25 * outer / (1.0 + outer)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const COMPACT: [CirculationProfile; 2] =
        [CirculationProfile::Algebraic, CirculationProfile::LambOseen];

    fn profiles() -> [CirculationProfile; 3] {
        let broad = CirculationProfile::TwoScale(TwoScale::new(25.0).unwrap());
        [
            CirculationProfile::Algebraic,
            CirculationProfile::LambOseen,
            broad,
        ]
    }

    #[test]
    fn algebraic_peak_velocity_is_gamma0_over_4_pi_core_radius() {
        let u = CirculationProfile::Algebraic.tangential_velocity_m_s(500.0, 2.35, 2.35);
        assert_relative_eq!(u, 500.0 / (4.0 * PI * 2.35), max_relative = 1e-14);
    }

    #[test]
    fn tangential_velocity_is_largest_at_the_core_radius() {
        for profile in profiles() {
            let at = |r: f64| profile.tangential_velocity_m_s(500.0, 2.35, r);
            assert!(at(2.35) > at(2.35 * 0.999) && at(2.35) > at(2.35 * 1.001));
            let slope = (at(2.35 + 1e-5) - at(2.35 - 1e-5)) / 2e-5;
            assert!(slope.abs() < 1e-8 * at(2.35) / 1e-5, "{profile:?}: {slope}");
        }
    }

    #[test]
    fn profiles_are_within_four_percent_of_a_point_vortex_beyond_five_core_radii() {
        for profile in COMPACT {
            for step in 0..100 {
                let r = 2.35 * (5.0 + 0.5 * f64::from(step));
                let point = 500.0 / (2.0 * PI * r);
                let u = profile.tangential_velocity_m_s(500.0, 2.35, r);
                assert!(
                    u < point * (1.0 + 1e-14) && u > 0.96 * point,
                    "{profile:?} at {r} m"
                );
            }
        }
    }

    #[test]
    fn circulation_is_that_of_equation_3() {
        let gamma = CirculationProfile::Algebraic.circulation_m2_s(500.0, 2.0, 3.0);
        assert_relative_eq!(gamma, 500.0 * 9.0 / 13.0, max_relative = 1e-14);
        let gamma = CirculationProfile::LambOseen.circulation_m2_s(500.0, 2.0, 3.0);
        let expected = 500.0 * (1.0 - (-LAMB_OSEEN_BETA * 2.25).exp());
        assert_relative_eq!(gamma, expected, max_relative = 1e-14);
    }

    #[test]
    fn largest_line_gradient_is_that_found_by_search_over_radius_and_direction() {
        for profile in profiles() {
            let gamma = 500.0;
            let core = 2.35;
            let velocity = |y: f64, z: f64| {
                let omega = profile.angular_velocity_rad_s(gamma, core, y * y + z * z);
                [-omega * z, omega * y]
            };
            let mut largest = 0.0_f64;
            for i in 0..400 {
                let r = core * f64::from(i) * 0.01;
                for j in 0..64 {
                    let (e_z, e_y) = (PI * f64::from(j) / 64.0).sin_cos();
                    let h = 1e-4;
                    let ahead = velocity(r + h * e_y, h * e_z);
                    let behind = velocity(r - h * e_y, -h * e_z);
                    let gradient = (0..2)
                        .map(|k| (ahead[k] - behind[k]) * [e_y, e_z][k])
                        .sum::<f64>()
                        / (2.0 * h);
                    largest = largest.max(gradient.abs());
                }
            }
            let stated = profile.max_line_gradient_per_s(gamma, core);
            assert_relative_eq!(largest, stated, max_relative = 1e-4);
        }
        let algebraic = CirculationProfile::Algebraic.max_line_gradient_per_s(1.0, 1.0);
        assert_relative_eq!(algebraic, 1.0 / (8.0 * PI), max_relative = 1e-15);
    }

    #[test]
    fn strain_rate_peaks_at_the_largest_line_gradient_and_vanishes_at_the_centre() {
        for profile in profiles() {
            let peak = (0..100_000)
                .map(|i| profile.strain_rate_per_s(500.0, 2.0, 1e-4 * f64::from(i)))
                .fold(0.0, f64::max);
            let stated = profile.max_line_gradient_per_s(500.0, 2.0);
            assert_relative_eq!(peak, stated, max_relative = 1e-7);
            assert_eq!(profile.strain_rate_per_s(500.0, 2.0, 0.0), 0.0);
        }
    }
}

#[cfg(test)]
mod two_scale_tests {
    use super::*;

    #[test]
    fn core_and_far_field_have_their_own_scales() {
        for span in [15.0, 40.0] {
            let profile = TwoScale::new(span).unwrap();
            let (near, slope) = profile.exponent(1e-6);
            assert!(
                (near / (profile.inner * 1e-6) - 1.0).abs() < 1e-6
                    && (slope / near - 2.0).abs() < 1e-6
            );
            let far = 30.0 * span;
            let (q, slope) = profile.exponent(far * far);
            assert!(
                (q / (10.0 * (far / span).powf(0.75)) - 1.0).abs() < 1e-3,
                "{q}"
            );
            assert!((slope / q - 0.75).abs() < 1e-3);
            let velocity = |s: f64| -(-profile.exponent(s * s).0).exp_m1() / s;
            assert!(velocity(1.0) > velocity(0.998) && velocity(1.0) > velocity(1.002));
        }
        // With the constants of the literature, beta_i = 500, the core is 4.1 % of the span.
        let usual = |core_over_span: f64| {
            TwoScale::new(core_over_span.recip()).unwrap().inner / core_over_span.powi(2)
        };
        assert!(
            usual(0.0405) > 500.0 && usual(0.0415) < 500.0,
            "{} {}",
            usual(0.0405),
            usual(0.0415)
        );
        // What lies beyond a part of the span.
        let beyond = |span: f64, part: f64| {
            (-TwoScale::new(span)
                .unwrap()
                .exponent((part * span).powi(2))
                .0)
                .exp()
        };
        for span in [25.0, 33.0, 40.0] {
            assert!(
                (beyond(span, 1.0 / 12.0) - 0.215).abs() < 0.01
                    && (beyond(span, 1.0 / 18.0) - 0.333).abs() < 0.025
            );
        }
        assert!(TwoScale::new(1.0).is_err() && TwoScale::new(f64::NAN).is_err());
    }
}
