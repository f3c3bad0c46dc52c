//! Autocorrelation M(rho) of the aperture field and the efficiency integral built on it.
//!
//! The mean irradiance at range R is the Fourier transform of M(rho) exp(-D(rho)/2), so that for
//! independent paths
//!
//! eta_s = (1/A_R) integral of |M(rho)|^2 exp(-D(rho)) d^2 rho,
//! M(rho) = integral of E(u + rho/2) E*(u - rho/2) exp(j k u.rho (1/R - 1/F)) d^2 u,
//!
//! exactly, at any strength of turbulence (Markov approximation); D = 0 is free space. Both
//! integrals have finite support (|rho| < 2a) and need no grid. Check: M(0) is the transmitted
//! fraction, and an independent Fresnel-Hankel quadrature (an oracle of the tests) gives the
//! same efficiency.

use crate::beam::Telescope;
use crate::quadrature::{GaussLegendre, adaptive};
use crate::theory::descent::Arc;
use crate::{Error, Misalignment};
use std::f64::consts::PI;

/// Beyond this many 1/e radii a Gaussian is below the last bit of its peak.
const GAUSSIAN_REACH: f64 = 6.2;

/// Largest Fresnel number at which quadratures are done: a second on one core.
pub const LARGEST_FRESNEL_NUMBER: f64 = 3000.0;

/// Fresnel number a^2 |1/R - 1/F| / lambda of the lit aperture at `range_m`: the number of half
/// waves by which its edge and its centre differ. Large values are the geometric near field, far
/// from any focus.
pub fn fresnel_number(telescope: &Telescope, range_m: f64) -> f64 {
    let lit_m = telescope
        .aperture_radius_m
        .min(GAUSSIAN_REACH * telescope.intensity_radius_m());
    lit_m * lit_m * (1.0 / range_m - telescope.focus.curvature_per_m()).abs()
        / telescope.wavelength_m
}

/// Forecast of the time of one quadrature of the efficiency at `range_m` on one core of 2023 \[s\];
/// `screens` is the number of phase screens, 0 in free space, 16 for a continuous path of constant
/// strength, 64 for a profile over height.
pub fn quadrature_cost_s(telescope: &Telescope, screens: usize, range_m: f64) -> f64 {
    let fresnel = fresnel_number(telescope, range_m);
    // Nodes grow with the Fresnel number, and so do those of M(rho) at each until steepest
    // descent takes over.
    let overlaps = 1e-4 + (fresnel * (4e-4 + 1.5e-5 * fresnel)).min(0.03 + 3.2e-4 * fresnel);
    let through = (60.0 + 126.0 * fresnel) * 1e-7 * screens as f64;
    let obscured = telescope.obscuration_radius_m / telescope.aperture_radius_m;
    if obscured > 0.0 {
        // Four strips instead of one, and three kinks of M(rho), at which the adaptive integral
        // halves its panels.
        return 3.2e-3 + 0.7 * overlaps * (1.3 + 3.2 * obscured) + through;
    }
    0.7 * overlaps + through
}

pub(crate) fn check_fresnel_number(telescope: &Telescope, range_m: f64) -> Result<(), Error> {
    let found = fresnel_number(telescope, range_m);
    if found <= LARGEST_FRESNEL_NUMBER {
        return Ok(());
    }
    Err(Error::FresnelNumber {
        range_m,
        found,
        largest: LARGEST_FRESNEL_NUMBER,
    })
}

/// Evaluates M(rho) of one telescope for one wave-front curvature.
pub(crate) struct Overlap {
    telescope: Telescope,
    rule: GaussLegendre,
    /// k (1/R - 1/F) \[rad/m^2\].
    phase_rad_m2: f64,
}

impl Overlap {
    pub(crate) fn new(telescope: &Telescope, range_m: f64) -> Self {
        let curvature_per_m = 1.0 / range_m - telescope.focus.curvature_per_m();
        Self {
            telescope: *telescope,
            rule: GaussLegendre::new(20),
            phase_rad_m2: telescope.wavenumber_rad_m() * curvature_per_m,
        }
    }

    /// M(rho), real because the aperture is centro-symmetric.
    pub(crate) fn at(&self, separation_m: f64) -> f64 {
        let a = self.telescope.aperture_radius_m;
        let b = self.telescope.obscuration_radius_m;
        let mut sum = self.lens(a, a, separation_m);
        if b > 0.0 {
            // Annulus = disc minus disc; the two mixed terms are mirror images with
            // equal real parts.
            sum += self.lens(b, b, separation_m) - 2.0 * self.lens(a, b, separation_m);
        }
        let s = self.telescope.intensity_radius_m();
        let envelope = (-(0.5 * separation_m / s).powi(2)).exp();
        self.telescope.peak_irradiance_per_m2() * envelope * sum
    }

    /// Integral of exp(-(x^2 + y^2)/s^2) cos(kappa x) over the part common to the disc of
    /// radius `p` about -rho/2 and the disc of radius `q` about +rho/2. The y integral is an
    /// error function.
    fn lens(&self, p: f64, q: f64, rho: f64) -> f64 {
        let s = self.telescope.intensity_radius_m();
        let reach = GAUSSIAN_REACH * s;
        let low = (-0.5 * rho - p).max(0.5 * rho - q).max(-reach);
        let high = (-0.5 * rho + p).min(0.5 * rho + q).min(reach);
        if low >= high {
            return 0.0;
        }
        // Right of the crossing the first disc bounds y, left of it the second.
        let crossing = if rho > 0.0 {
            ((p * p - q * q) / (2.0 * rho)).clamp(low, high)
        } else {
            [low, 0.0, high][1 + usize::from(p > q) - usize::from(p < q)]
        };
        let right = self.strip(crossing, high, rho, -0.5 * rho, p);
        // Equal discs: the left strip is the mirror image of the right one.
        if p == q {
            2.0 * right
        } else {
            self.strip(low, crossing, rho, 0.5 * rho, q) + right
        }
    }

    /// One strip of the lens, under the arc of radius `radius` about `centre`.
    fn strip(&self, low: f64, high: f64, rho: f64, centre: f64, radius: f64) -> f64 {
        let half = 0.5 * (high - low);
        if half <= 0.0 {
            return 0.0;
        }
        let middle = 0.5 * (high + low);
        let s = self.telescope.intensity_radius_m();
        let kappa = self.phase_rad_m2 * rho;
        let arc = Arc {
            centre_m: centre,
            radius_m: radius,
            intensity_radius_m: s,
        };
        if let Some(integral) = arc.integral(low, high, kappa) {
            return integral;
        }
        // 20 nodes carry up to 16 rad (in the middle of the arc), and about two 1/e radii
        // of the Gaussian.
        let panels = 1 + (kappa.abs() * half / 5.0) as usize + (half / s) as usize;
        // x = middle + half sin(theta) removes the square-root ends of the half height.
        self.rule.composite(-0.5 * PI, 0.5 * PI, panels, |theta| {
            let (sin, cos) = theta.sin_cos();
            let x = middle + half * sin;
            let y = (radius * radius - (x - centre).powi(2)).max(0.0).sqrt();
            half * cos * self.chord(x, y, s) * (kappa * x).cos()
        })
    }

    /// exp(-x^2/s^2) times the integral of exp(-y^2/s^2) from -y to y.
    fn chord(&self, x: f64, y: f64, s: f64) -> f64 {
        if s.is_infinite() {
            2.0 * y
        } else {
            (-(x / s).powi(2)).exp() * s * PI.sqrt() * libm::erf(y / s)
        }
    }

    /// End points of smooth pieces of |M|^2, fine enough for its oscillation.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let t = &self.telescope;
        let a = t.aperture_radius_m;
        let b = t.obscuration_radius_m;
        let s = t.intensity_radius_m();
        let end = (2.0 * a).min(2.0 * GAUSSIAN_REACH * s);
        let mut kinks = vec![0.0, 2.0 * b, a - b, a + b, end];
        kinks.retain(|&x| x <= end);
        kinks.sort_by(f64::total_cmp);
        kinks.dedup();
        let reach = a.min(GAUSSIAN_REACH * s);
        let mut breaks = vec![0.0];
        for pair in kinks.windows(2) {
            let phase = 2.0 * self.phase_rad_m2.abs() * reach * (pair[1] - pair[0]);
            let n = 1 + (phase / 12.0) as usize;
            let h = (pair[1] - pair[0]) / n as f64;
            breaks.extend((1..=n).map(|i| pair[0] + h * i as f64));
        }
        breaks
    }
}

/// Efficiency (19) of independent paths for a phase structure function `structure_rad2(rho)`
/// between two spherical waves from the target whose ends are `rho` apart at the telescope.
///
/// The displacement Delta of the two beams at the target enters as J0(k rho Delta / R).
pub(crate) fn efficiency_with(
    telescope: &Telescope,
    misalignment: &Misalignment,
    range_m: f64,
    structure_rad2: &dyn Fn(f64) -> f64,
) -> Result<f64, Error> {
    let telescope = telescope.validated()?;
    let misalignment = misalignment.validated()?;
    let range_m = crate::error::positive("range_m", range_m)?;
    check_fresnel_number(&telescope, range_m)?;
    let overlap = Overlap::new(&telescope, range_m);
    let shift = telescope.wavenumber_rad_m() * misalignment.separation_m(range_m) / range_m;
    let integral = adaptive(
        &overlap.rule,
        &overlap.breaks(),
        2e-13,
        "efficiency",
        &mut |rho| {
            let damping = (-structure_rad2(rho)).exp();
            if damping == 0.0 {
                return 0.0;
            }
            let j0 = if shift == 0.0 {
                1.0
            } else {
                libm::j0(shift * rho)
            };
            2.0 * PI * rho * overlap.at(rho).powi(2) * damping * j0
        },
    )?;
    Ok(integral / telescope.aperture_area_m2())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlap_at_zero_separation_is_the_transmitted_fraction() {
        for beam_radius_m in [0.004, 0.03, 0.3, f64::INFINITY] {
            for obscuration_radius_m in [0.0, 0.01, 0.03] {
                let t = Telescope {
                    beam_radius_m,
                    obscuration_radius_m,
                    ..Telescope::table2()
                };
                let m0 = Overlap::new(&t, 700.0).at(0.0);
                let exact = t.transmitted_fraction();
                assert!((m0 - exact).abs() < 1e-13, "{beam_radius_m} {m0} {exact}");
            }
        }
    }

    #[test]
    fn uniform_disc_in_focus_has_the_optical_transfer_function_of_a_circular_pupil() {
        let t = Telescope {
            beam_radius_m: f64::INFINITY,
            focus: crate::Focus::At(800.0),
            ..Telescope::table2()
        };
        let overlap = Overlap::new(&t, 800.0);
        for v in [0.0f64, 0.1, 0.5, 0.9, 0.999] {
            let exact = 2.0 / PI * (v.acos() - v * (1.0 - v * v).sqrt());
            assert!((overlap.at(2.0 * 0.05 * v) - exact).abs() < 1e-13);
        }
    }

    #[test]
    fn fresnel_number_without_bound_is_an_error_that_names_it() {
        let focus = crate::Focus::At(1.777e-4);
        let t = Telescope {
            focus,
            ..Telescope::table2()
        };
        match efficiency_with(&t, &Misalignment::NONE, 1000.0, &|_| 0.0) {
            Err(error @ Error::FresnelNumber { range_m, found, .. }) => {
                assert_eq!(range_m, 1000.0);
                assert!(error.to_string().contains("3000.0 at most"), "{error}");
                assert!((found / 9.07e6 - 1.0).abs() < 1e-2, "{found}");
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn shadow_of_geometry_is_the_limit_of_a_large_fresnel_number() {
        // M(rho) is then the transform of the irradiance: eta = (lambda R)^2/A_R integral of j^2
        // with j the shadow of the aperture. What the edge diffracts is of the order of the
        // reciprocal of the Fresnel number.
        let t = Telescope {
            wavelength_m: 1.62e-7,
            ..Telescope::table2()
        };
        let range_m = 50.0;
        assert!(fresnel_number(&t, range_m) > 300.0);
        let eta = efficiency_with(&t, &Misalignment::NONE, range_m, &|_| 0.0).unwrap();
        let a = 0.05f64;
        let s = 0.03f64;
        let squared = (1.0 - (-2.0 * (a / s).powi(2)).exp()) / (2.0 * PI * s * s);
        let shadow = (t.wavelength_m * range_m).powi(2) / (PI * a * a) * squared;
        assert!((eta / shadow - 1.0).abs() < 1e-3, "{eta} {shadow}");
    }
}
