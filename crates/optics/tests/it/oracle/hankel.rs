//! Free-space irradiance of the truncated beam by a circular-symmetric Fresnel (Hankel) integral.
//!
//! U(r) = (k/R) integral of E(r') exp(j k r'^2 (1/R - 1/F)/2) J0(k r r'/R) r' dr' over the open
//! aperture, and eta_s = (lambda^2 R^2 / A_R) 2 pi integral of |U|^4 r dr, (19) as written. It
//! shares nothing with the pupil-overlap method of the crate.

use super::quadrature::GaussLegendre;
use num_complex::Complex;
use std::f64::consts::PI;
use wakescope_optics::Telescope;

/// Radius of the lit part of the aperture \[m\]: beyond nine 1/e radii a Gaussian is dark.
fn lit_radius_m(telescope: &Telescope) -> f64 {
    let dark_m = 9.0 * telescope.intensity_radius_m();
    telescope.aperture_radius_m.min(dark_m)
}

/// Field of the beam in the aperture \[1/m\] at `radius_m`, for unit power before truncation.
fn aperture_field_per_m(telescope: &Telescope, radius_m: f64) -> f64 {
    let s = telescope.intensity_radius_m();
    if s.is_infinite() {
        let outer = telescope.aperture_radius_m.powi(2);
        let inner = telescope.obscuration_radius_m.powi(2);
        return (PI * (outer - inner)).sqrt().recip();
    }
    (-0.5 * (radius_m / s).powi(2)).exp() / (PI.sqrt() * s)
}

/// Field U(r) \[1/m\] at a distance \[m\] from the axis; `largest_radius_m` is the largest distance
/// at which it is evaluated.
pub(super) fn field_per_m(
    telescope: &Telescope,
    range_m: f64,
    largest_radius_m: f64,
) -> impl Fn(f64) -> Complex<f64> {
    let k = telescope.wavenumber_rad_m();
    let phase_rad_m2 = 0.5 * k * (1.0 / range_m - telescope.focus.curvature_per_m());
    let inner_m = telescope.obscuration_radius_m;
    let outer_m = lit_radius_m(telescope).max(inner_m);
    let phase = phase_rad_m2.abs() * outer_m * outer_m + k * outer_m * largest_radius_m / range_m;
    let panels = 4 + (phase / 6.0) as usize;
    let nodes: Vec<(f64, Complex<f64>)> = GaussLegendre::new(16)
        .on_panels(inner_m, outer_m, panels)
        .into_iter()
        .map(|(r, w)| {
            let weight = k / range_m * aperture_field_per_m(telescope, r) * r * w;
            (r, Complex::from_polar(weight, phase_rad_m2 * r * r))
        })
        .collect();
    move |radius_m| {
        nodes
            .iter()
            .map(|(r, weight)| weight * libm::j0(k / range_m * radius_m * r))
            .sum()
    }
}

/// Free-space efficiency eta_s (19) by the Fresnel-Hankel integral, limited to about 1e-8 by the
/// cut of its tail.
pub(crate) fn free_space_efficiency_hankel(telescope: &Telescope, range_m: f64) -> f64 {
    let k = telescope.wavenumber_rad_m();
    let lit_m = lit_radius_m(telescope);
    let shadow_m = lit_m * (1.0 - range_m * telescope.focus.curvature_per_m()).abs();
    let lobe_m = range_m / (k * lit_m);
    // Beyond the geometric shadow irradiance falls as r^-3, its square times r as r^-5.
    let end_m = 1.5 * shadow_m + 150.0 * lobe_m;
    let field = field_per_m(telescope, range_m, end_m);
    let panels = 8 + (end_m / (3.0 * lobe_m)) as usize;
    let integral = GaussLegendre::new(10).composite(0.0, end_m, panels, |r| {
        2.0 * PI * r * field(r).norm_sqr().powi(2)
    });
    (telescope.wavelength_m * range_m).powi(2) / telescope.aperture_area_m2() * integral
}

mod tests {
    use super::*;
    use wakescope_optics::Focus;

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
        let field = field_per_m(&t, range_m, 0.06);
        for r in [0.0, 0.01, 0.03, 0.06] {
            let j = field(r).norm_sqr();
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
        let field = field_per_m(&t, 1500.0, 2.0);
        let radius = (0..4000).map(|i| (f64::from(i) + 0.5) * 5e-4);
        let power: f64 = radius
            .map(|r| 2.0 * PI * r * 5e-4 * field(r).norm_sqr())
            .sum();
        assert!(
            (power / t.transmitted_fraction() - 1.0).abs() < 5e-3,
            "{power}"
        );
    }
}
