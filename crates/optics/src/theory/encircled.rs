//! Mean power of the transmitted beam beyond a distance from its axis, in free space or through
//! turbulence of any strength.
//!
//! The mean irradiance is the transform of M(rho) exp(-D(rho)/2), so that the power within
//! r of the axis is
//!
//! P(r) = integral from 0 to 2a of M(rho) exp(-D(rho)/2) (k r/R) J1(k r rho/R) drho.
//!
//! The light diffracted by a hard edge falls only as 1/r: a grid must hold it. Check: the Gaussian
//! beam; the Airy pattern's 1 - J0^2 - J1^2; all of the transmitted power within a large circle.

use crate::Error;
use crate::air::cn2::Cn2Path;
use crate::air::structure::StructureTable;
use crate::beam::Telescope;
use crate::error::{not_negative, positive};
use crate::quadrature::GaussLegendre;
use crate::theory::overlap::{Overlap, check_fresnel_number};

/// Fraction of the transmitted power that arrives at `range_m` beyond each `radius_m` of the axis,
/// in the mean over the turbulence of the path (Markov approximation, any strength).
///
/// # Errors
/// [`Error::OutOfRange`] for arguments that are not allowed, [`Error::FresnelNumber`] as for
/// the efficiencies.
pub fn mean_power_beyond(
    telescope: &Telescope,
    cn2: &Cn2Path,
    table: &StructureTable,
    range_m: f64,
    radius_m: &[f64],
) -> Result<Vec<f64>, Error> {
    let telescope = telescope.validated()?;
    let range_m = positive("range_m", range_m)?;
    check_fresnel_number(&telescope, range_m)?;
    let k = telescope.wavenumber_rad_m();
    let mut largest_m = 0f64;
    for &r in radius_m {
        largest_m = largest_m.max(not_negative("radius_m", r)?);
    }
    let structure_rad2 =
        table.of_spherical_waves(k, range_m, cn2.clone().validated()?.quadrature(range_m)?);
    let overlap = Overlap::new(&telescope, range_m);
    let rule = GaussLegendre::new(12);
    let mut nodes = Vec::new();
    for pair in overlap.breaks().windows(2) {
        // Waves of J1 at the largest radius; the breaks follow those of M.
        let panels = 2 + (k * largest_m / range_m * (pair[1] - pair[0]) / 6.0) as usize;
        for (rho, weight) in rule.on_panels(pair[0], pair[1], panels) {
            let damping = (-0.5 * structure_rad2(rho)).exp();
            if damping > 1e-16 {
                nodes.push((rho, weight * damping * overlap.at(rho)));
            }
        }
    }
    let whole = telescope.transmitted_fraction();
    let mut beyond = Vec::with_capacity(radius_m.len());
    for r in radius_m {
        let scale = k * r / range_m;
        let inside: f64 = nodes
            .iter()
            .map(|(rho, w)| w * scale * libm::j1(scale * rho))
            .sum();
        beyond.push((1.0 - inside / whole).clamp(0.0, 1.0));
    }
    Ok(beyond)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Focus;
    use crate::air::spectrum::VonKarman;

    fn beyond(telescope: &Telescope, cn2: &Cn2Path, range_m: f64, radius_m: &[f64]) -> Vec<f64> {
        let table = StructureTable::new(&VonKarman::kolmogorov());
        mean_power_beyond(telescope, cn2, &table, range_m, radius_m).unwrap()
    }

    #[test]
    fn gaussian_beam_and_airy_pattern_have_the_known_power_beyond_a_circle() {
        let s = 0.02;
        let gauss = Telescope {
            aperture_radius_m: 0.2,
            beam_radius_m: s,
            focus: Focus::At(-900.0),
            ..Telescope::table2()
        };
        let range_m: f64 = 1200.0;
        let k = gauss.wavenumber_rad_m();
        let width2 = (s * (1.0 + range_m / 900.0)).powi(2) + (range_m / (k * s)).powi(2);
        let radius_m = [0.0, 0.02, 0.06, 0.12];
        for (r, found) in radius_m
            .iter()
            .zip(beyond(&gauss, &Cn2Path::None, range_m, &radius_m))
        {
            assert!(
                (found - (-r * r / width2).exp()).abs() < 1e-9,
                "{r}: {found}"
            );
        }
        let airy = Telescope {
            beam_radius_m: f64::INFINITY,
            focus: Focus::At(800.0),
            ..Telescope::table2()
        };
        for v in [1.0f64, 3.8317, 30.0, 150.0] {
            let found = beyond(&airy, &Cn2Path::None, 800.0, &[v * 800.0 / (k * 0.05)])[0];
            let exact = libm::j0(v).powi(2) + libm::j1(v).powi(2);
            assert!((found - exact).abs() < 1e-7, "{v}: {found} {exact}");
        }
    }

    #[test]
    fn square_root_of_the_coherence_spreads_the_mean_beam() {
        // Square law in place of 5/3 within a few per cent: exp(-r^2/w^2) with w^2 + (R/(k s))^2
        // ... + 2 (2R/(k rho_0'))^2/2.
        let t = Telescope {
            aperture_radius_m: 0.2,
            beam_radius_m: 0.03,
            ..Telescope::table2()
        };
        let strong = Cn2Path::Uniform { cn2_m_m23: 3e-13 };
        let calm = beyond(&t, &Cn2Path::None, 2000.0, &[0.1])[0];
        let spread = beyond(&t, &strong, 2000.0, &[0.1, 30.0]);
        assert!(
            spread[0] > 100.0 * calm && spread[0] > 0.3 && spread[1] < 1e-3,
            "{calm} {spread:?}"
        );
    }
}
