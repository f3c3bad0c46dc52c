//! Free-space irradiance of the truncated beam by a circular-symmetric Fresnel (Hankel) integral.
//!
//! U(r) = (k/R) integral of E(r') exp(j k r'^2 (1/R - 1/F)/2) J0(k r r'/R) r' dr' over the open aperture, and
//! eta_s = (lambda^2 R^2 / A_R) 2 pi integral of |U|^4 r dr, (19) as it stands. It shares nothing but the Gauss rule
//! with the pupil-overlap method. Check: total power is the transmitted fraction; the two methods agree.

use crate::Error;
use crate::beam::Telescope;
use crate::error::positive;
use crate::quadrature::GaussLegendre;
use crate::theory::overlap::check_fresnel_number;
use num_complex::Complex;
use std::f64::consts::PI;

/// Field U(r) \[1/m\] at a distance \[m\] from the axis; `largest_radius_m` is the largest at which it will be asked for.
pub(crate) fn field_per_m(
    telescope: &Telescope,
    range_m: f64,
    largest_radius_m: f64,
) -> impl Fn(f64) -> Complex<f64> {
    let k = telescope.wavenumber_rad_m();
    let chirp = 0.5 * k * (1.0 / range_m - telescope.focus.curvature_per_m());
    let (b, a) = (telescope.obscuration_radius_m, telescope.aperture_radius_m);
    let a = a.min(9.0 * telescope.intensity_radius_m());
    let phase = chirp.abs() * a * a + k * a * largest_radius_m / range_m;
    let panels = 4 + (phase / 6.0) as usize;
    let peak = telescope.peak_irradiance_per_m2().sqrt();
    // All that does not depend on the place.
    let weighted = |(r, w): (f64, f64)| {
        let field = peak * telescope.relative_irradiance(r).sqrt();
        let weight = k / range_m * field * r * w;
        let (sin, cos) = (chirp * r * r).sin_cos();
        (r, Complex::new(weight * cos, weight * sin))
    };
    let nodes: Vec<_> = GaussLegendre::new(16)
        .on_panels(b, a.max(b), panels)
        .map(weighted)
        .collect();
    move |radius_m| {
        nodes
            .iter()
            .map(|(r, weight)| weight * libm::j0(k / range_m * radius_m * r))
            .sum()
    }
}

/// Free-space efficiency eta_s (19) by the Fresnel-Hankel integral: the independent check of
/// [`crate::theory::free_space_efficiency`], slower, limited to about 1e-8 by the cut of its tail.
///
/// # Errors
/// [`Error::OutOfRange`] for a telescope or range that is not allowed, [`Error::FresnelNumber`] as there.
pub fn free_space_efficiency_hankel(telescope: &Telescope, range_m: f64) -> Result<f64, Error> {
    let telescope = telescope.validated()?;
    let range_m = positive("range_m", range_m)?;
    check_fresnel_number(&telescope, range_m)?;
    let (k, a) = (
        telescope.wavenumber_rad_m(),
        telescope
            .aperture_radius_m
            .min(9.0 * telescope.intensity_radius_m()),
    );
    let geometric = a * (1.0 - range_m * telescope.focus.curvature_per_m()).abs();
    let lobe = range_m / (k * a);
    // Beyond the geometric shadow irradiance falls as r^-3, its square times r as r^-5.
    let end = 1.5 * geometric + 150.0 * lobe;
    let field_per_m = field_per_m(&telescope, range_m, end);
    let panels = 8 + (end / (3.0 * lobe)) as usize;
    let rule = GaussLegendre::new(10);
    let integral = rule.composite(0.0, end, panels, |r| {
        2.0 * PI * r * field_per_m(r).norm_sqr().powi(2)
    });
    let scale = (telescope.wavelength_m * range_m).powi(2) / telescope.aperture_area_m2();
    Ok(scale * integral)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Focus;

    #[test]
    fn wide_aperture_gives_the_gaussian_beam_of_the_closed_form() {
        let s = 0.02;
        let t = Telescope {
            aperture_radius_m: 0.3,
            beam_radius_m: s,
            focus: Focus::At(400.0),
            ..Telescope::table2()
        };
        let range_m = 900.0;
        let width2 =
            (s * (1.0 - range_m / 400.0)).powi(2) + (range_m / (t.wavenumber_rad_m() * s)).powi(2);
        let radius = [0.0, 0.01, 0.03, 0.06];
        let field_per_m = field_per_m(&t, range_m, 0.06);
        for r in radius {
            let j = field_per_m(r).norm_sqr();
            let exact = (-r * r / width2).exp() / (PI * width2);
            assert!((j / exact - 1.0).abs() < 1e-10, "{r} {j} {exact}");
        }
    }

    #[test]
    fn power_at_the_target_is_the_transmitted_fraction() {
        let t = Telescope {
            obscuration_radius_m: 0.01,
            ..Telescope::table2()
        };
        let field_per_m = field_per_m(&t, 1500.0, 2.0);
        let radius = (0..4000).map(|i| (f64::from(i) + 0.5) * 5e-4);
        let power: f64 = radius
            .map(|r| 2.0 * PI * r * 5e-4 * field_per_m(r).norm_sqr())
            .sum();
        assert!(
            (power / t.transmitted_fraction() - 1.0).abs() < 5e-3,
            "{power}"
        );
    }
}
