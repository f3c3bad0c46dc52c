//! Turbulence along the path: spectrum and Cn2, and the numbers by which its strength is judged.
//!
//! Check: the profile integrates exactly on straight pieces; the Rytov variance of the chapter's medium turbulence
//! (1e-13) is 1 at 690 m.

use crate::Error;
use crate::error::{finite, not_negative, positive};
use crate::quadrature::GaussLegendre;
use crate::spectrum::{Spectrum, VonKarman};
use std::sync::Arc;

/// Cn2 along the line of sight.
#[derive(Debug, Clone, PartialEq)]
pub enum Cn2Path {
    /// No turbulence: nothing is drawn and nothing is computed for it.
    None,
    /// The same everywhere (a horizontal path).
    Uniform {
        /// Cn2 \[m^(-2/3)\], above 0.
        cn2_m_m23: f64,
    },
    /// A profile over height, seen along a slanted line; linear between the points.
    Heights {
        /// Heights above ground \[m\], increasing strictly.
        height_m: Vec<f64>,
        /// Cn2 at these heights \[m^(-2/3)\].
        cn2_m_m23: Vec<f64>,
        /// Height of the telescope above ground \[m\].
        telescope_height_m: f64,
        /// Elevation of the line of sight \[rad\].
        elevation_rad: f64,
    },
}

impl Cn2Path {
    /// Cn2 \[m^(-2/3)\] at distance `range_m` from the telescope.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a height outside the profile.
    pub fn at(&self, range_m: f64) -> Result<f64, Error> {
        match self {
            Self::None => Ok(0.0),
            Self::Uniform { cn2_m_m23 } => Ok(*cn2_m_m23),
            Self::Heights { height_m, cn2_m_m23, telescope_height_m, elevation_rad } => {
                let h = telescope_height_m + range_m * elevation_rad.sin();
                let last = height_m.len() - 1;
                // A horizontal path along the lowest or highest point must not fail by a rounding error.
                let slack = 1e-9 * (height_m[last] - height_m[0]);
                if !(h >= height_m[0] - slack && h <= height_m[last] + slack) {
                    return Err(Error::OutOfRange {
                        field: "height_m",
                        value: h,
                        allowed: "within the heights of the Cn2 profile along the whole path",
                    });
                }
                let i = height_m.partition_point(|&v| v <= h).clamp(1, last) - 1;
                let t = ((h - height_m[i]) / (height_m[i + 1] - height_m[i])).clamp(0.0, 1.0);
                Ok(cn2_m_m23[i] * (1.0 - t) + cn2_m_m23[i + 1] * t)
            }
        }
    }

    /// Mean of Cn2 \[m^(-2/3)\] from `start_m` to `end_m` along the path.
    ///
    /// # Errors
    /// As [`Cn2Path::at`].
    pub fn mean(&self, start_m: f64, end_m: f64) -> Result<f64, Error> {
        if !matches!(self, Self::Heights { .. }) {
            return self.at(start_m);
        }
        let rule = GaussLegendre::new(4);
        const PANELS: usize = 16;
        let mut failure = None;
        let integral = rule.composite(start_m, end_m, PANELS, |z| match self.at(z) {
            Ok(value) => value,
            Err(error) => {
                failure = Some(error);
                0.0
            }
        });
        failure.map_or(Ok(integral / (end_m - start_m)), Err)
    }

    /// Whether the path is free of turbulence.
    pub fn is_none(&self) -> bool {
        match self {
            Self::None => true,
            Self::Uniform { cn2_m_m23 } => *cn2_m_m23 == 0.0,
            Self::Heights { cn2_m_m23, .. } => cn2_m_m23.iter().all(|&c| c == 0.0),
        }
    }

    /// The path itself when every number is allowed.
    ///
    /// # Errors
    /// [`Error`] names the field.
    pub fn validated(self) -> Result<Self, Error> {
        match &self {
            Self::None => {}
            Self::Uniform { cn2_m_m23 } => {
                not_negative("cn2_m_m23", *cn2_m_m23)?;
            }
            Self::Heights { height_m, cn2_m_m23, telescope_height_m, elevation_rad } => {
                if height_m.len() < 2 || cn2_m_m23.len() != height_m.len() {
                    return Err(Error::Length {
                        field: "cn2_m_m23",
                        found: cn2_m_m23.len(),
                        expected: height_m.len().max(2),
                    });
                }
                finite("height_m", height_m[0])?;
                for index in 1..height_m.len() {
                    if finite("height_m", height_m[index])? <= height_m[index - 1] {
                        return Err(Error::NotIncreasing { field: "height_m", index, value: height_m[index] });
                    }
                }
                for &value in cn2_m_m23 {
                    not_negative("cn2_m_m23", value)?;
                }
                finite("telescope_height_m", *telescope_height_m)?;
                finite("elevation_rad", *elevation_rad)?;
            }
        }
        Ok(self)
    }
}

/// Spectrum and strength of the turbulence along the path.
#[derive(Debug, Clone)]
pub struct Turbulence {
    /// Shape of the spectrum.
    pub spectrum: Arc<dyn Spectrum>,
    /// Strength along the path.
    pub cn2: Cn2Path,
}

impl Turbulence {
    /// The chapter's spectrum (17) with a constant Cn2 \[m^(-2/3)\]; 0 is no turbulence.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a negative Cn2 or one that is not a number.
    pub fn chapter(cn2_m_m23: f64) -> Result<Self, Error> {
        Ok(Self { spectrum: Arc::new(VonKarman::chapter()), cn2: Cn2Path::Uniform { cn2_m_m23 }.validated()? })
    }

    /// No turbulence at all.
    pub fn none() -> Self {
        Self { spectrum: Arc::new(VonKarman::chapter()), cn2: Cn2Path::None }
    }
}

/// Rytov variance of a plane wave, 1.23 Cn2 k^(7/6) R^(11/6): above 1 the turbulence is strong.
///
/// # Errors
/// [`Error::OutOfRange`] names the argument that is not allowed.
pub fn rytov_variance(cn2_m_m23: f64, wavelength_m: f64, range_m: f64) -> Result<f64, Error> {
    let k = 2.0 * std::f64::consts::PI / positive("wavelength_m", wavelength_m)?;
    let cn2 = not_negative("cn2_m_m23", cn2_m_m23)?;
    Ok(1.23 * cn2 * k.powf(7.0 / 6.0) * positive("range_m", range_m)?.powf(11.0 / 6.0))
}

/// Coherence radius rho_0 of a spherical wave \[m\] at the telescope: exp(-(rho/rho_0)^(5/3)) is its mutual coherence,
/// rho_0 = \[1.4572 k^2 Cn2 R 3/8\]^(-3/5) (Kolmogorov; no factor 2 inside the bracket). Infinite for Cn2 = 0.
///
/// # Errors
/// [`Error::OutOfRange`] names the argument that is not allowed.
pub fn coherence_radius_m(cn2_m_m23: f64, wavelength_m: f64, range_m: f64) -> Result<f64, Error> {
    let k = 2.0 * std::f64::consts::PI / positive("wavelength_m", wavelength_m)?;
    let cn2 = not_negative("cn2_m_m23", cn2_m_m23)?;
    Ok((1.4572 * k * k * cn2 * positive("range_m", range_m)? * 0.375).powf(-0.6))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medium_turbulence_is_strong_beyond_690_m() {
        let rytov = rytov_variance(1e-13, 1.55e-6, 690.0).unwrap();
        assert!((rytov - 1.0).abs() < 0.02, "{rytov}");
        assert!(rytov_variance(f64::NAN, 1.55e-6, 690.0).is_err());
    }

    #[test]
    fn slanted_path_sees_the_profile_at_its_height() {
        let path = Cn2Path::Heights {
            height_m: vec![0.0, 100.0, 1000.0],
            cn2_m_m23: vec![2e-13, 1e-13, 0.0],
            telescope_height_m: 10.0,
            elevation_rad: 30f64.to_radians(),
        }
        .validated()
        .unwrap();
        assert!((path.at(80.0).unwrap() / 1.5e-13 - 1.0).abs() < 1e-12);
        assert!((path.mean(0.0, 160.0).unwrap() / 1.5e-13 - 1.0).abs() < 0.1);
        assert!((path.mean(20.0, 100.0).unwrap() / 1.6e-13 - 1.0).abs() < 1e-12);
        assert!(path.at(2000.0).is_err());
    }

    #[test]
    fn bad_cn2_is_named() {
        for cn2 in [-1e-15, f64::NAN, f64::INFINITY] {
            let error = Turbulence::chapter(cn2).unwrap_err().to_string();
            assert!(error.contains("cn2_m_m23"), "{error}");
        }
    }
}
