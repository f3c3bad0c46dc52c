//! The turbulence of a path: spectrum and Cn2 together, and the numbers by which its
//! strength is judged.
//!
//! Check: the Rytov variance of the chapter's medium turbulence (1e-13) is 1 at 690 m; integrals
//! along the path give the printed forms where Cn2 is constant.

use crate::Error;
use crate::air::cn2::Cn2Path;
use crate::air::spectrum::{Spectrum, VonKarman};
use crate::error::{not_negative, positive};
use std::sync::Arc;

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
    pub fn table2(cn2_m_m23: f64) -> Result<Self, Error> {
        Ok(Self {
            spectrum: Arc::new(VonKarman::table2()),
            cn2: Cn2Path::Uniform { cn2_m_m23 }.validated()?,
        })
    }

    /// No turbulence at all.
    pub fn none() -> Self {
        Self {
            spectrum: Arc::new(VonKarman::table2()),
            cn2: Cn2Path::None,
        }
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

/// Rytov variance of a plane wave along a path of changing strength, 2.25 k^(7/6) integral of
/// Cn2(z) (R - z)^(5/6) dz: that of [`rytov_variance`] for a constant Cn2.
///
/// # Errors
/// [`Error`] names the argument that is not allowed; as [`Cn2Path::at`].
pub fn path_rytov_variance(cn2: &Cn2Path, wavelength_m: f64, range_m: f64) -> Result<f64, Error> {
    // For a constant Cn2 the integral is 6/11 R^(11/6) Cn2; the printed 1.23 is 6/11
    // of this number.
    const CONSTANT: f64 = 1.23 * 11.0 / 6.0;
    let k = 2.0 * std::f64::consts::PI / positive("wavelength_m", wavelength_m)?;
    let rest = positive("range_m", range_m)?;
    let places = cn2.clone().validated()?.quadrature(range_m)?;
    Ok(CONSTANT
        * k.powf(7.0 / 6.0)
        * places
            .iter()
            .map(|(z, w)| w * (rest - z).powf(5.0 / 6.0))
            .sum::<f64>())
}

/// Coherence radius rho_0 \[m\] at the telescope of a spherical wave from `range_m`:
/// exp(-(rho/rho_0)^(5/3)) is its mutual coherence, rho_0 = \[1.4572 k^2 integral of Cn2(z) (1 -
/// z/R)^(5/3) dz\]^(-3/5) (Kolmogorov; no factor 2 inside the bracket), \[1.4572 k^2 Cn2 R
/// 3/8\]^(-3/5) for a constant Cn2. Infinite without turbulence.
///
/// # Errors
/// [`Error`] names the argument that is not allowed; as [`Cn2Path::at`].
pub fn coherence_radius_m(cn2: &Cn2Path, wavelength_m: f64, range_m: f64) -> Result<f64, Error> {
    let k = 2.0 * std::f64::consts::PI / positive("wavelength_m", wavelength_m)?;
    let whole = positive("range_m", range_m)?;
    let places = cn2.clone().validated()?.quadrature(range_m)?;
    let weighted: f64 = places
        .iter()
        .map(|(z, w)| w * (1.0 - z / whole).powf(5.0 / 3.0))
        .sum();
    Ok((1.4572 * k * k * weighted).powf(-0.6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::refused;

    #[test]
    fn medium_turbulence_is_strong_beyond_690_m() {
        let rytov = rytov_variance(1e-13, 1.55e-6, 690.0).unwrap();
        assert!((rytov - 1.0).abs() < 0.02, "{rytov}");
        assert_eq!(
            refused(rytov_variance(f64::NAN, 1.55e-6, 690.0)),
            "cn2_m_m23"
        );
    }

    #[test]
    fn bad_cn2_is_named() {
        for cn2 in [-1e-15, f64::NAN, f64::INFINITY] {
            assert_eq!(refused(Turbulence::table2(cn2)), "cn2_m_m23");
        }
    }

    #[test]
    fn weighted_means_of_a_constant_strength_are_the_printed_ones() {
        let uniform = Cn2Path::Uniform { cn2_m_m23: 3e-14 };
        let level = Cn2Path::Heights {
            height_m: vec![0.0, 7.0, 50.0],
            cn2_m_m23: vec![3e-14; 3],
            telescope_height_m: 7.0,
            elevation_rad: 0.0,
        };
        for path in [uniform, level] {
            let rytov = path_rytov_variance(&path, 1.55e-6, 900.0).unwrap();
            assert!(
                (rytov / rytov_variance(3e-14, 1.55e-6, 900.0).unwrap() - 1.0).abs() < 1e-4,
                "{rytov}"
            );
            let radius = coherence_radius_m(&path, 1.55e-6, 900.0).unwrap();
            let k = 2.0 * std::f64::consts::PI / 1.55e-6;
            let printed = (1.4572 * k * k * 3e-14 * 900.0 * 0.375f64).powf(-0.6);
            assert!((radius / printed - 1.0).abs() < 1e-6, "{radius}");
        }
    }
}
