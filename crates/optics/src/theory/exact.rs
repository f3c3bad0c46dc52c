//! Efficiency eta_s (19) where theory is exact: free space, and independent (bistatic)
//! paths in turbulence.
//!
//! Irradiances have unit power before truncation. Check: the stored free-space curve (relative
//! error below 1e-9), the closed form for the untruncated beam, the Fresnel-Hankel quadrature, and
//! the known optimum 0.401179 at a/s = 1.76334 of a focused matched pair (Wang 1988; Rye and
//! Frehlich 1992).

use crate::Error;
use crate::air::cn2::Cn2Path;
use crate::air::structure::StructureTable;
use crate::air::turbulence::Turbulence;
use crate::beam::{Misalignment, Telescope};
use crate::error::{not_negative, positive};
use crate::theory::overlap::efficiency_with;
use std::f64::consts::PI;

/// Free-space efficiency eta_s (19) of a matched, aligned pair at `range_m`, by pupil overlap.
///
/// Relative error below 1e-9. The cost grows with the
/// [`fresnel_number`](crate::theory::fresnel_number);
/// [`quadrature_cost_s`](crate::theory::quadrature_cost_s) forecasts it.
///
/// # Errors
/// [`Error::OutOfRange`] for a telescope or range that is not allowed, [`Error::FresnelNumber`]
/// above [`LARGEST_FRESNEL_NUMBER`](crate::theory::LARGEST_FRESNEL_NUMBER), [`Error::Convergence`]
/// if the quadrature fails.
pub fn free_space_efficiency(telescope: &Telescope, range_m: f64) -> Result<f64, Error> {
    free_space_efficiency_misaligned(telescope, &Misalignment::NONE, range_m)
}

/// Free-space efficiency (19) when the BPLO is offset and tilted against the transmitted beam.
///
/// For an untruncated Gaussian a displacement d at the target multiplies the efficiency by
/// exp(-d^2/(2 sigma_R^2)).
///
/// # Errors
/// As [`free_space_efficiency`], and for a misalignment that is not finite.
pub fn free_space_efficiency_misaligned(
    telescope: &Telescope,
    misalignment: &Misalignment,
    range_m: f64,
) -> Result<f64, Error> {
    efficiency_with(telescope, misalignment, range_m, &|_| 0.0)
}

/// Closed form without truncation: eta = lambda^2 R^2 / (2 pi A_R sigma_R^2),
/// sigma_R^2 = s^2 (1 - R/F)^2 + (R/(k s))^2. The aperture only sets A_R.
///
/// # Errors
/// [`Error::OutOfRange`] for a telescope or range that is not allowed, or an infinite beam radius.
pub fn untruncated_efficiency(telescope: &Telescope, range_m: f64) -> Result<f64, Error> {
    let telescope = telescope.validated()?;
    let range_m = positive("range_m", range_m)?;
    positive("beam_radius_m", telescope.beam_radius_m)?;
    let width2 = untruncated_radius2_m2(&telescope, range_m);
    let area = telescope.aperture_area_m2();
    Ok((telescope.wavelength_m * range_m).powi(2) / (2.0 * PI * area * width2))
}

/// Square of the 1/e irradiance radius of the untruncated beam at `range_m` \[m^2\].
fn untruncated_radius2_m2(telescope: &Telescope, range_m: f64) -> f64 {
    let s = telescope.intensity_radius_m();
    let geometric = s * (1.0 - range_m * telescope.focus.curvature_per_m());
    let diffraction = range_m / (telescope.wavenumber_rad_m() * s);
    geometric * geometric + diffraction * diffraction
}

/// One phase screen of a simulated path, for [`bistatic_efficiency_screens`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScreenStrength {
    /// Distance of the screen from the telescope \[m\].
    pub position_m: f64,
    /// Cn2 of its layer times the thickness of the layer \[m^(1/3)\].
    pub cn2_thickness_m13: f64,
}

/// Mean bistatic efficiency (19) on independent paths through turbulence: exact at any strength
/// (Markov approximation).
///
/// The spherical-wave structure function is D(rho) = k^2 integral of Cn2(z) G(rho (1 - z/R))
/// dz over the path.
///
/// # Errors
/// [`Error`] for arguments that are not allowed or a quadrature that fails.
pub fn bistatic_efficiency(
    telescope: &Telescope,
    misalignment: &Misalignment,
    turbulence: &Turbulence,
    range_m: f64,
) -> Result<f64, Error> {
    let table = StructureTable::new(&*turbulence.spectrum);
    bistatic_efficiency_with(telescope, misalignment, &turbulence.cn2, &table, range_m)
}

/// As [`bistatic_efficiency`], with the structure function tabulated beforehand (a table
/// serves all ranges).
///
/// # Errors
/// As [`bistatic_efficiency`].
pub fn bistatic_efficiency_with(
    telescope: &Telescope,
    misalignment: &Misalignment,
    cn2: &Cn2Path,
    table: &StructureTable,
    range_m: f64,
) -> Result<f64, Error> {
    let cn2 = cn2.clone().validated()?;
    let range_m = positive("range_m", range_m)?;
    let k = telescope.validated()?.wavenumber_rad_m();
    let structure_rad2 = table.of_spherical_waves(k, range_m, cn2.quadrature(range_m)?);
    efficiency_with(telescope, misalignment, range_m, &structure_rad2)
}

/// Mean bistatic efficiency (19) for the very screens of a simulated path: no modelling gap between
/// this number and a Monte Carlo with these screens. Screens at or beyond `range_m` do not count.
///
/// # Errors
/// As [`bistatic_efficiency`].
pub fn bistatic_efficiency_screens(
    telescope: &Telescope,
    misalignment: &Misalignment,
    screens: &[ScreenStrength],
    table: &StructureTable,
    range_m: f64,
) -> Result<f64, Error> {
    let range_m = positive("range_m", range_m)?;
    let k = telescope.validated()?.wavenumber_rad_m();
    let mut places = Vec::new();
    for screen in screens {
        let strength = not_negative("cn2_thickness_m13", screen.cn2_thickness_m13)?;
        if not_negative("position_m", screen.position_m)? < range_m {
            places.push((screen.position_m, strength));
        }
    }
    efficiency_with(
        telescope,
        misalignment,
        range_m,
        &table.of_spherical_waves(k, range_m, places),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Focus;
    use crate::air::turbulence::coherence_radius_m;

    /// Bistatic efficiency of an untruncated beam for a square-law structure function, l0 = 0, L0
    /// infinite and a constant Cn2 (Frehlich and Kavaya 1991): sigma_R^2 -> s^2 (1 - R/F)^2 + (R/(k
    /// s))^2 + (2 R/(k rho_0))^2.
    fn square_law_efficiency(telescope: &Telescope, rho_0: f64, range_m: f64) -> f64 {
        let width2 = untruncated_radius2_m2(telescope, range_m);
        let spread = 2.0 * range_m / (telescope.wavenumber_rad_m() * rho_0);
        untruncated_efficiency(telescope, range_m).unwrap() * width2 / (width2 + spread * spread)
    }

    #[test]
    fn square_law_quadrature_gives_the_closed_form() {
        // An aperture of ten radii and a quadratic structure function 2 (rho/rho_0)^2 are what the
        // closed form assumes.
        let t = Telescope {
            aperture_radius_m: 0.2,
            beam_radius_m: 0.02,
            focus: Focus::At(700.0),
            ..Telescope::table2()
        };
        let cn2 = Cn2Path::Uniform { cn2_m_m23: 3e-14 };
        let range_m = 1200.0;
        let rho_0 = coherence_radius_m(&cn2, 1.55e-6, range_m).unwrap();
        let closed = square_law_efficiency(&t, rho_0, range_m);
        let exact = efficiency_with(&t, &Misalignment::NONE, range_m, &|rho| {
            2.0 * (rho / rho_0).powi(2)
        })
        .unwrap();
        assert!((closed / exact - 1.0).abs() < 1e-9);
        assert!(closed < untruncated_efficiency(&t, range_m).unwrap());
    }

    #[test]
    fn kolmogorov_path_has_three_eighths_of_the_plane_wave_structure_function() {
        // exp(-D) with D = 2 (rho/rho_0)^(5/3), through the integral over the path.
        let t = Telescope::table2();
        let turbulence = Turbulence {
            spectrum: std::sync::Arc::new(crate::air::spectrum::VonKarman::kolmogorov()),
            cn2: Cn2Path::Uniform { cn2_m_m23: 1e-13 },
        };
        let path = bistatic_efficiency(&t, &Misalignment::NONE, &turbulence, 1500.0).unwrap();
        let rho_0 = coherence_radius_m(&turbulence.cn2, 1.55e-6, 1500.0).unwrap();
        let law = efficiency_with(&t, &Misalignment::NONE, 1500.0, &|rho| {
            2.0 * (rho / rho_0).powf(5.0 / 3.0)
        })
        .unwrap();
        assert!((path / law - 1.0).abs() < 2e-4, "{path} {law}");
    }

    #[test]
    fn many_screens_tend_to_the_continuous_path() {
        let t = Telescope::table2();
        let turbulence = Turbulence::table2(1e-13).unwrap();
        let table = StructureTable::new(&*turbulence.spectrum);
        let exact = bistatic_efficiency(&t, &Misalignment::NONE, &turbulence, 1000.0).unwrap();
        let screens = |n: usize, shift: f64| -> f64 {
            let dz = 1000.0 / n as f64;
            let list: Vec<_> = (0..n)
                .map(|i| ScreenStrength {
                    position_m: (i as f64 + shift) * dz,
                    cn2_thickness_m13: 1e-13 * dz,
                })
                .collect();
            bistatic_efficiency_screens(&t, &Misalignment::NONE, &list, &table, 1000.0).unwrap()
                / exact
                - 1.0
        };
        // Mid-layer screens are second order; screens at the start of the layer overweight the
        // turbulence near the lidar.
        assert!(screens(10, 0.5).abs() < 2e-3, "{}", screens(10, 0.5));
        assert!(screens(40, 0.5).abs() < 2e-4);
        assert!(
            (screens(10, 0.0) + 0.067).abs() < 0.005,
            "{}",
            screens(10, 0.0)
        );
    }

    #[test]
    fn path_through_a_thin_strong_layer_is_that_of_thousands_of_slices() {
        let t = Telescope::table2();
        let cn2 = Cn2Path::Heights {
            height_m: vec![0.0, 20.0, 21.0, 3000.0],
            cn2_m_m23: vec![1e-13, 1e-13, 1e-16, 1e-17],
            telescope_height_m: 2.0,
            elevation_rad: 10f64.to_radians(),
        };
        let range_m = 3000.0;
        let turbulence = Turbulence {
            cn2: cn2.clone(),
            ..Turbulence::table2(1e-13).unwrap()
        };
        let found = bistatic_efficiency(&t, &Misalignment::NONE, &turbulence, range_m).unwrap();
        let dz = range_m / 6000.0;
        let slices: Vec<_> = (0..6000)
            .map(|i| (f64::from(i) + 0.5) * dz)
            .map(|z| ScreenStrength {
                position_m: z,
                cn2_thickness_m13: cn2.at(z).unwrap() * dz,
            })
            .collect();
        let table = StructureTable::new(&*turbulence.spectrum);
        let sum =
            bistatic_efficiency_screens(&t, &Misalignment::NONE, &slices, &table, range_m).unwrap();
        assert!((found / sum - 1.0).abs() < 1e-5, "{found} {sum}");
        assert!((found / 0.13243 - 1.0).abs() < 1e-4, "{found}");
    }
}
