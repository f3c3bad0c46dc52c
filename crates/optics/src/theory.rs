//! Efficiency eta_s (19) where theory is exact: free space, and independent (bistatic) paths in turbulence.
//!
//! Irradiances have unit power before truncation. Check: the stored free-space curve (relative error below 1e-9), the
//! closed form for the untruncated beam, the Fresnel-Hankel quadrature, and the known optimum 0.401179 at
//! a/s = 1.76334 of a focused matched pair (Wang 1988; Rye and Frehlich 1992).

use crate::Error;
use crate::beam::{Misalignment, Telescope};
use crate::error::positive;
use crate::overlap::efficiency_with;
use std::f64::consts::PI;

/// Free-space efficiency eta_s (19) of a matched, aligned pair at `range_m`, by pupil overlap.
///
/// Relative error below 1e-9. The cost grows with the square of the Fresnel number a^2 (1/R - 1/F)/lambda: about
/// 10 ms at 50 m for a 50 mm aperture.
///
/// # Errors
/// [`Error::OutOfRange`] for a telescope or range that is not allowed, [`Error::Convergence`] if the quadrature fails.
pub fn free_space_efficiency(telescope: &Telescope, range_m: f64) -> Result<f64, Error> {
    free_space_efficiency_misaligned(telescope, &Misalignment::NONE, range_m)
}

/// Free-space efficiency (19) when the BPLO is offset and tilted against the transmitted beam.
///
/// For an untruncated Gaussian a displacement d at the target multiplies the efficiency by exp(-d^2/(2 sigma_R^2)).
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

/// Antenna efficiency eta_a = eta_s / T^2 in free space: both beams with unit power AFTER truncation. To be used only
/// with the energy that leaves the telescope.
///
/// # Errors
/// As [`free_space_efficiency`].
pub fn free_space_antenna_efficiency(telescope: &Telescope, range_m: f64) -> Result<f64, Error> {
    let eta = free_space_efficiency(telescope, range_m)?;
    Ok(eta / telescope.transmitted_fraction().powi(2))
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

/// Square of the 1/e irradiance radius of the untruncated beam at `range_m` [m^2].
pub(crate) fn untruncated_radius2_m2(telescope: &Telescope, range_m: f64) -> f64 {
    let s = telescope.intensity_radius_m();
    let geometric = s * (1.0 - range_m * telescope.focus.curvature_per_m());
    let diffraction = range_m / (telescope.wavenumber_rad_m() * s);
    geometric * geometric + diffraction * diffraction
}
