//! A line of sight: radial velocity and return of each thin layer of air, and the largest
//! thickness of a layer.
//!
//! Check: the thickness divides the range step of one sample and obeys the rule of the
//! steepest gradient.

use crate::error::{check, check_amounts, check_any, check_each, check_length, check_positive};
use crate::{Error, SPEED_OF_LIGHT_M_S};

/// The air along one line of sight, cut into layers of equal thickness.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LineOfSight {
    /// Range of the centre of the first layer \[m\].
    pub first_range_m: f64,
    /// Thickness of each layer, `DeltaR` \[m\]; layer `l` is centred on
    /// `first_range_m + l layer_thickness_m`.
    pub layer_thickness_m: f64,
    /// Radial velocity of each layer \[m/s\], positive away from the lidar. NaN: no scatterers
    /// there (masked).
    pub radial_velocity_m_s: Vec<f64>,
    /// Return of each layer per metre of range, `K^2 beta A_R eta_s/R^2` \[1/m\], (9): `beta` in
    /// 1/(m sr) times the solid angle `A_R/R^2` in sr, the round-trip transmission and the
    /// efficiency. Finite and not negative.
    pub weight_per_m: Vec<f64>,
}

impl LineOfSight {
    /// Checks the line.
    ///
    /// # Errors
    /// [`Error::Empty`] without layers; [`Error::LengthMismatch`] if velocities and weights differ
    /// in number; [`Error::OutOfRange`], [`Error::ElementOutOfRange`] for values that are not
    /// allowed (an infinite velocity, a weight that is negative or not finite).
    pub fn validate(&self) -> Result<(), Error> {
        check("first_range_m", self.first_range_m, "finite", |_| true)?;
        check_positive("layer_thickness_m", self.layer_thickness_m)?;
        check_any("radial_velocity_m_s", self.radial_velocity_m_s.len())?;
        check_length(
            "weight_per_m",
            self.weight_per_m.len(),
            self.radial_velocity_m_s.len(),
        )?;
        let allowed = "finite, or NaN where there are no scatterers";
        check_each(
            "radial_velocity_m_s",
            &self.radial_velocity_m_s,
            allowed,
            |v| !v.is_infinite(),
        )?;
        check_amounts("weight_per_m", &self.weight_per_m)
    }

    /// Number of layers.
    pub fn layers(&self) -> usize {
        self.radial_velocity_m_s.len()
    }

    /// Whether nothing returns from layer `index`.
    pub(crate) fn is_masked(&self, index: usize) -> bool {
        self.radial_velocity_m_s[index].is_nan()
    }

    /// Range of the centre of layer `index` \[m\].
    pub fn range_m(&self, index: usize) -> f64 {
        self.first_range_m + index as f64 * self.layer_thickness_m
    }
}

/// Limits on the thickness of the layers, in addition to those of the pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerLimits {
    /// Sampling rate `F_s` \[Hz\].
    pub sample_rate_hz: f64,
    /// Wavelength of the laser \[m\].
    pub wavelength_m: f64,
    /// Largest change of the radial velocity along any line, `g_max` \[1/s\]; 0 for a uniform wind.
    pub max_gradient_per_s: f64,
}

impl LayerLimits {
    /// The largest thickness \[m\] that divides the range step of a sample, `c/(2 F_s)`, and is at
    /// most `lambda/(16 sigma g_max)` and `c sigma/2`.
    ///
    /// The second limit makes the scatterers of neighbouring layers overlap in frequency: two
    /// layers then drift apart by less than an eighth of a cycle while the pulse passes. Thicker
    /// layers give errors of up to 15 % inside a vortex core. With the third, the sum over the
    /// layers of a pulse is its integral within 1e-4, however short the pulse. The division makes
    /// the Gaussian weights repeat from sample to sample, which the fast summation uses.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if a field or `sigma_s` is not positive (the gradient may be zero).
    pub(crate) fn thickness_m(self, sigma_s: f64) -> Result<f64, Error> {
        let Self {
            sample_rate_hz,
            wavelength_m,
            max_gradient_per_s,
        } = self;
        check_positive("sample_rate_hz", sample_rate_hz)?;
        check_positive("wavelength_m", wavelength_m)?;
        check_positive("sigma_s", sigma_s)?;
        check(
            "max_gradient_per_s",
            max_gradient_per_s,
            "finite and not negative",
            |g| g >= 0.0,
        )?;
        let step_m = SPEED_OF_LIGHT_M_S / (2.0 * sample_rate_hz);
        let by_gradient = step_m * 16.0 * sigma_s * max_gradient_per_s / wavelength_m;
        let by_pulse = step_m / (0.5 * SPEED_OF_LIGHT_M_S * sigma_s);
        Ok(step_m / by_gradient.max(by_pulse).ceil().max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn limits(max_gradient_per_s: f64) -> LayerLimits {
        LayerLimits {
            sample_rate_hz: 250e6,
            wavelength_m: 1.55e-6,
            max_gradient_per_s,
        }
    }

    fn line() -> LineOfSight {
        LineOfSight {
            first_range_m: 100.0,
            layer_thickness_m: 0.5,
            radial_velocity_m_s: vec![1.0, f64::NAN, 3.0],
            weight_per_m: vec![1e-16; 3],
        }
    }

    #[test]
    fn layers_are_no_thicker_than_a_short_pulse() {
        let sigma_s = 0.6e-9;
        let thickness_m = limits(0.0).thickness_m(sigma_s).unwrap();
        assert!(thickness_m <= 0.5 * SPEED_OF_LIGHT_M_S * sigma_s);
        let per_step = SPEED_OF_LIGHT_M_S / (2.0 * 250e6) / thickness_m;
        assert_relative_eq!(per_step, per_step.round(), max_relative = 1e-12);
    }

    #[test]
    fn layers_obey_the_gradient_of_a_heavy_wake_and_divide_the_range_step() {
        let gradient = 500.0 / (8.0 * std::f64::consts::PI * 2.35 * 2.35);
        for (sigma_s, rule_m) in [(120.112e-9, 0.22), (240.224e-9, 0.11)] {
            let thickness = limits(gradient).thickness_m(sigma_s).unwrap();
            let limit = 1.55e-6 / (16.0 * sigma_s * gradient);
            assert_relative_eq!(limit, rule_m, max_relative = 0.03);
            let parts = SPEED_OF_LIGHT_M_S / (2.0 * 250e6) / thickness;
            assert_relative_eq!(parts, parts.round(), max_relative = 1e-14);
            let coarser = SPEED_OF_LIGHT_M_S / (2.0 * 250e6) / (parts.round() - 1.0);
            assert!(thickness <= limit && coarser > limit);
        }
    }

    #[test]
    fn layers_of_a_uniform_wind_are_as_thick_as_the_range_step() {
        let thickness = limits(0.0).thickness_m(120e-9).unwrap();
        assert_relative_eq!(thickness, 0.599_584_916, max_relative = 1e-14);
    }

    #[test]
    fn a_line_may_be_masked_but_not_empty_ragged_or_infinite() {
        assert_eq!(line().validate(), Ok(()));
        assert_eq!(line().range_m(2), 101.0);
        let empty = LineOfSight {
            radial_velocity_m_s: vec![],
            weight_per_m: vec![],
            ..line()
        };
        assert_eq!(
            empty.validate(),
            Err(Error::Empty {
                field: "radial_velocity_m_s"
            })
        );
        let ragged = LineOfSight {
            weight_per_m: vec![1.0],
            ..line()
        };
        assert!(matches!(
            ragged.validate(),
            Err(Error::LengthMismatch {
                found: 1,
                expected: 3,
                ..
            })
        ));
        let infinite = LineOfSight {
            radial_velocity_m_s: vec![0.0, f64::INFINITY, 0.0],
            ..line()
        };
        assert!(matches!(
            infinite.validate(),
            Err(Error::ElementOutOfRange { index: 1, .. })
        ));
        for bad in [-1.0, f64::NAN] {
            let negative = LineOfSight {
                weight_per_m: vec![1.0, 1.0, bad],
                ..line()
            };
            assert!(matches!(
                negative.validate(),
                Err(Error::ElementOutOfRange { index: 2, .. })
            ));
        }
        let flat = LineOfSight {
            layer_thickness_m: 0.0,
            ..line()
        };
        assert!(matches!(
            flat.validate(),
            Err(Error::OutOfRange {
                field: "layer_thickness_m",
                ..
            })
        ));
    }
}
