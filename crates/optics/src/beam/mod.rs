//! The telescope and its beam: a Gaussian cut by a circular aperture, with focus and
//! central obscuration.
//!
//! Irradiances are normalised to unit power BEFORE truncation, so that the losses of both beams are
//! part of the efficiency (19). Check: the transmitted fraction of the chapter's beam (30 mm, 50 mm
//! aperture) is 0.937823.

#[cfg(feature = "screens")]
pub(crate) mod source;

use crate::Error;
use crate::error::{finite, not_negative, positive, within};
use std::f64::consts::{PI, SQRT_2};

/// What `beam_radius_m` means: the radius at which one quantity has fallen to 1/e of its
/// value on the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RadiusDefinition {
    /// Irradiance: |E|^2 ~ exp(-r^2/s^2). The chapter's Table 2 is read this way.
    Intensity,
    /// Field: E ~ exp(-r^2/w^2), w = sqrt(2) s; this w is also the 1/e^2 radius of the irradiance.
    Field,
}

/// Where the beam is focused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Focus {
    /// Plane wave front at the aperture (focus at infinity).
    Collimated,
    /// Focus at this distance from the aperture \[m\]; negative values are a diverging beam with
    /// its virtual focus behind.
    At(f64),
}

impl Focus {
    /// 1/F \[1/m\]; 0 for a collimated beam.
    pub fn curvature_per_m(self) -> f64 {
        match self {
            Self::Collimated => 0.0,
            Self::At(focus_m) => 1.0 / focus_m,
        }
    }
}

/// A telescope whose transmitted beam and back-propagated local oscillator (BPLO) are the same
/// truncated Gaussian.
///
/// The fields are plain data; every function of this crate that takes a telescope calls
/// [`Telescope::validated`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Telescope {
    /// Wavelength \[m\], above 0.
    pub wavelength_m: f64,
    /// Radius of the circular aperture \[m\], above 0.
    pub aperture_radius_m: f64,
    /// Radius of a central obscuration \[m\], 0 (none) or above, below the aperture radius.
    pub obscuration_radius_m: f64,
    /// 1/e radius of the beam \[m\], above 0. `f64::INFINITY` is the uniformly lit aperture: the
    /// power before truncation then has no meaning and unit power is counted on the open aperture.
    pub beam_radius_m: f64,
    /// Whether `beam_radius_m` belongs to the irradiance or to the field.
    pub radius_definition: RadiusDefinition,
    /// Focus of the beam.
    pub focus: Focus,
}

impl Telescope {
    /// That of the chapter's Table 2: 1.55 um, 1/e irradiance radius 30 mm, aperture radius 50
    /// mm, collimated.
    pub fn table2() -> Self {
        Self {
            wavelength_m: 1.55e-6,
            aperture_radius_m: 0.05,
            obscuration_radius_m: 0.0,
            beam_radius_m: 0.03,
            radius_definition: RadiusDefinition::Intensity,
            focus: Focus::Collimated,
        }
    }

    /// The telescope itself when every field is allowed.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first field that is not allowed.
    pub fn validated(self) -> Result<Self, Error> {
        positive("wavelength_m", self.wavelength_m)?;
        positive("aperture_radius_m", self.aperture_radius_m)?;
        not_negative("obscuration_radius_m", self.obscuration_radius_m)?;
        within(
            "obscuration_radius_m",
            self.obscuration_radius_m,
            self.obscuration_radius_m < self.aperture_radius_m,
            "below aperture_radius_m",
        )?;
        within(
            "beam_radius_m",
            self.beam_radius_m,
            self.beam_radius_m > 0.0,
            "a number above 0, infinity for a uniformly lit aperture",
        )?;
        if let Focus::At(focus_m) = self.focus {
            finite("focus_m", focus_m)?;
            within(
                "focus_m",
                focus_m,
                focus_m != 0.0,
                "a finite number other than 0",
            )?;
        }
        Ok(self)
    }

    /// Wave number k = 2 pi / lambda \[rad/m\].
    pub fn wavenumber_rad_m(&self) -> f64 {
        2.0 * PI / self.wavelength_m
    }

    /// 1/e radius of the irradiance \[m\], whatever the definition in use.
    pub fn intensity_radius_m(&self) -> f64 {
        match self.radius_definition {
            RadiusDefinition::Intensity => self.beam_radius_m,
            RadiusDefinition::Field => self.beam_radius_m / SQRT_2,
        }
    }

    /// Receiver area A_R of (9), (14) and (19) [m^2]: pi a^2, obscured part included (it is the
    /// reference area of the efficiency, and cancels between (14) and (19)).
    pub fn aperture_area_m2(&self) -> f64 {
        PI * self.aperture_radius_m.powi(2)
    }

    /// Fraction T of the beam's power that passes the aperture: exp(-b^2/s^2) - exp(-a^2/s^2); 1
    /// for uniform light.
    pub fn transmitted_fraction(&self) -> f64 {
        let s = self.intensity_radius_m();
        if s.is_infinite() {
            return 1.0;
        }
        let inner = (self.obscuration_radius_m / s).powi(2);
        let outer = (self.aperture_radius_m / s).powi(2);
        // exp(-i) - exp(-o) without cancellation for wide beams.
        (-inner).exp() * -(inner - outer).exp_m1()
    }

    /// Irradiance of the untruncated beam on its axis \[1/m^2\].
    pub(crate) fn peak_irradiance_per_m2(&self) -> f64 {
        let s = self.intensity_radius_m();
        if s.is_infinite() {
            1.0 / (PI * (self.aperture_radius_m.powi(2) - self.obscuration_radius_m.powi(2)))
        } else {
            1.0 / (PI * s * s)
        }
    }
}

/// Displacement of the BPLO against the transmitted beam: an offset of parallel axes, and an
/// angle between them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Misalignment {
    /// Offset of the two axes at the telescope, x and y \[m\].
    pub offset_m: [f64; 2],
    /// Angle between the two axes, x and y \[rad\].
    pub tilt_rad: [f64; 2],
}

impl Misalignment {
    /// Perfectly aligned beams.
    pub const NONE: Self = Self {
        offset_m: [0.0; 2],
        tilt_rad: [0.0; 2],
    };

    /// The misalignment itself when all four numbers are finite.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the field.
    pub fn validated(self) -> Result<Self, Error> {
        for axis in 0..2 {
            finite("offset_m", self.offset_m[axis])?;
            finite("tilt_rad", self.tilt_rad[axis])?;
        }
        Ok(self)
    }

    /// Distance between the two axes at range `range_m` \[m\].
    pub fn separation_m(&self, range_m: f64) -> f64 {
        let [x, y] = [0, 1].map(|i| self.offset_m[i] + self.tilt_rad[i] * range_m);
        x.hypot(y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chapter_beam_transmits_what_the_reference_states() {
        let t = Telescope::table2();
        assert!((t.transmitted_fraction() - 0.937_823_475_240_2).abs() < 1e-9);
        let field = Telescope {
            radius_definition: RadiusDefinition::Field,
            ..t
        };
        assert!((field.transmitted_fraction() - 0.996_134_080_0).abs() < 1e-6);
    }

    #[test]
    fn transmitted_fraction_is_the_integral_of_the_aperture_irradiance() {
        let rule = crate::quadrature::GaussLegendre::new(20);
        for beam_radius_m in [0.01, 0.03, 1e6, f64::INFINITY] {
            for obscuration_radius_m in [0.0, 0.02] {
                let t = Telescope {
                    beam_radius_m,
                    obscuration_radius_m,
                    ..Telescope::table2()
                };
                let s = t.intensity_radius_m();
                let irradiance = |r: f64| t.peak_irradiance_per_m2() * (-(r / s).powi(2)).exp();
                let power = rule.composite(obscuration_radius_m, 0.05, 20, |r| {
                    2.0 * PI * r * irradiance(r)
                });
                assert!((power / t.transmitted_fraction() - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn bad_fields_are_named() {
        let good = Telescope::table2();
        let cases = [
            (
                Telescope {
                    wavelength_m: -1.0,
                    ..good
                },
                "wavelength_m",
            ),
            (
                Telescope {
                    aperture_radius_m: 0.0,
                    ..good
                },
                "aperture_radius_m",
            ),
            (
                Telescope {
                    beam_radius_m: f64::NAN,
                    ..good
                },
                "beam_radius_m",
            ),
            (
                Telescope {
                    obscuration_radius_m: 0.05,
                    ..good
                },
                "obscuration_radius_m",
            ),
            (
                Telescope {
                    focus: Focus::At(0.0),
                    ..good
                },
                "focus_m",
            ),
            (
                Telescope {
                    focus: Focus::At(f64::NAN),
                    ..good
                },
                "focus_m",
            ),
        ];
        for (bad, name) in cases {
            assert_eq!(crate::error::refused(bad.validated()), name);
        }
    }
}
