//! Spectra of the refractive index, per unit Cn2.
//!
//! Phi_n(kappa) \[m^3\] is the three-dimensional spectrum at the wave number kappa in RADIANS per
//! metre (the propagator's frequencies are in cycles per metre). Check: structure functions against
//! stored quadratures and against the closed form of the Kolmogorov spectrum.

use crate::Error;
use crate::error::{not_negative, positive, within};
use std::fmt::Debug;

/// Constant of (17) as the chapter prints it.
pub const CHAPTER_CONSTANT: f64 = 0.033;
/// Exact constant Gamma(8/3) sin(pi/3) / (4 pi^2), for which Cn2 r^(2/3) is the
/// structure function of the refractive index.
pub const EXACT_CONSTANT: f64 = 0.03300539063636137;

/// An isotropic spectrum of the refractive index. Implement it for a spectrum of your own.
pub trait Spectrum: Debug + Send + Sync {
    /// Phi_n(kappa)/Cn2 \[m^(11/3)\] at the wave number \[rad/m\], finite for every
    /// argument above 0.
    fn density_per_cn2(&self, wavenumber_rad_m: f64) -> f64;
    /// Wave number below which the spectrum is flat \[rad/m\]; 0 without an outer scale.
    fn outer_wavenumber_rad_m(&self) -> f64;
    /// Wave number beyond 7 times of which the spectrum is nil \[rad/m\]; infinite without
    /// an inner scale.
    fn inner_wavenumber_rad_m(&self) -> f64;
}

/// kappa_0, and kappa_m = `cut`/l0, of a spectrum with an outer scale L0 (infinity for none) and an
/// inner scale l0 (0 for none), after the checks that every spectrum needs \[rad/m\].
fn wavenumbers_rad_m(
    outer_scale_m: f64,
    inner_scale_m: f64,
    cut: f64,
) -> Result<(f64, f64), Error> {
    within(
        "outer_scale_m",
        outer_scale_m,
        outer_scale_m > 0.0,
        "a number above 0, infinity for none",
    )?;
    not_negative("inner_scale_m", inner_scale_m)?;
    let outer_rad_m = 1.0 / outer_scale_m;
    let inner_rad_m = cut / inner_scale_m;
    let apart = outer_rad_m < inner_rad_m && outer_scale_m > inner_scale_m;
    within(
        "inner_scale_m",
        inner_scale_m,
        apart,
        "below outer_scale_m, with kappa_m above kappa_0",
    )?;
    Ok((outer_rad_m, inner_rad_m))
}

/// (17): constant exp(-kappa^2/kappa_m^2) / (kappa^2 + kappa_0^2)^(11/6), kappa_m = 5.92/l0.
///
/// Kolmogorov's spectrum is its limit without scales.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VonKarman {
    constant: f64,
    outer_rad_m: f64,
    inner_rad_m: f64,
}

impl VonKarman {
    /// Spectrum with an outer scale L0 \[m\], kappa_0 = 1/L0, infinity for none, and an inner scale
    /// l0 \[m\], 0 for none; `constant` is 0.033 as printed ([`CHAPTER_CONSTANT`]), or
    /// [`EXACT_CONSTANT`].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for L0 <= 0, l0 < 0, not a number, or kappa_0 >= kappa_m.
    pub fn new(outer_scale_m: f64, inner_scale_m: f64, constant: f64) -> Result<Self, Error> {
        let (outer_rad_m, inner_rad_m) = wavenumbers_rad_m(outer_scale_m, inner_scale_m, 5.92)?;
        positive("constant", constant)?;
        Ok(Self {
            constant,
            outer_rad_m,
            inner_rad_m,
        })
    }

    /// The chapter's spectrum: L0 = 1 m with kappa_0 = 1/L0, l0 = 1 cm, constant 0.033.
    pub fn table2() -> Self {
        Self {
            constant: CHAPTER_CONSTANT,
            outer_rad_m: 1.0,
            inner_rad_m: 592.0,
        }
    }

    /// Kolmogorov's spectrum: no scales, exact constant.
    pub fn kolmogorov() -> Self {
        Self {
            constant: EXACT_CONSTANT,
            outer_rad_m: 0.0,
            inner_rad_m: f64::INFINITY,
        }
    }
}

impl Spectrum for VonKarman {
    fn density_per_cn2(&self, wavenumber_rad_m: f64) -> f64 {
        let k2 = wavenumber_rad_m * wavenumber_rad_m;
        let cut = k2 / (self.inner_rad_m * self.inner_rad_m);
        self.constant * (-cut - 11.0 / 6.0 * (k2 + self.outer_rad_m * self.outer_rad_m).ln()).exp()
    }
    fn outer_wavenumber_rad_m(&self) -> f64 {
        self.outer_rad_m
    }
    fn inner_wavenumber_rad_m(&self) -> f64 {
        self.inner_rad_m
    }
}

/// Andrews' analytic form of Hill's spectrum, with the bump near the inner scale (Andrews
/// 1992): constant \[1 + 1.802 x - 0.254 x^(7/6)\] exp(-x^2) / (kappa^2 + kappa_0^2)^(11/6),
/// x = kappa l0 / 3.3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HillAndrews {
    outer_rad_m: f64,
    inner_rad_m: f64,
}

impl HillAndrews {
    /// Spectrum with an outer scale \[m\], infinity for none, and an inner scale above 0 \[m\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for L0 <= 0, l0 <= 0, not a number, or kappa_0 >= 3.3/l0.
    pub fn new(outer_scale_m: f64, inner_scale_m: f64) -> Result<Self, Error> {
        let allowed = "a finite number above 0: the bump of this spectrum is at the inner scale";
        within(
            "inner_scale_m",
            inner_scale_m,
            inner_scale_m.is_finite() && inner_scale_m > 0.0,
            allowed,
        )?;
        let (outer_rad_m, inner_rad_m) = wavenumbers_rad_m(outer_scale_m, inner_scale_m, 3.3)?;
        Ok(Self {
            outer_rad_m,
            inner_rad_m,
        })
    }
}

impl Spectrum for HillAndrews {
    fn density_per_cn2(&self, wavenumber_rad_m: f64) -> f64 {
        let x = wavenumber_rad_m / self.inner_rad_m;
        let k2 = wavenumber_rad_m.powi(2) + self.outer_rad_m.powi(2);
        let bump = 1.0 + 1.802 * x - 0.254 * x.powf(7.0 / 6.0);
        EXACT_CONSTANT * bump * (-x * x - 11.0 / 6.0 * k2.ln()).exp()
    }
    fn outer_wavenumber_rad_m(&self) -> f64 {
        self.outer_rad_m
    }
    fn inner_wavenumber_rad_m(&self) -> f64 {
        self.inner_rad_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_constant_is_the_gamma_function_expression() {
        let exact = libm::tgamma(8.0 / 3.0) * (std::f64::consts::PI / 3.0).sin()
            / (4.0 * std::f64::consts::PI.powi(2));
        assert!((EXACT_CONSTANT / exact - 1.0).abs() < 1e-12, "{exact}");
    }

    #[test]
    fn spectra_have_the_inertial_range_of_kolmogorov() {
        let k = 30.0;
        let kolmogorov = VonKarman::kolmogorov().density_per_cn2(k);
        assert!((kolmogorov / (EXACT_CONSTANT * k.powf(-11.0 / 3.0)) - 1.0).abs() < 1e-12);
        let hill = HillAndrews::new(f64::INFINITY, 1e-6).unwrap();
        assert!((hill.density_per_cn2(k) / kolmogorov - 1.0).abs() < 1e-4);
        let without_outer = VonKarman::new(f64::INFINITY, 1e-6, EXACT_CONSTANT).unwrap();
        assert!((without_outer.density_per_cn2(k) / kolmogorov - 1.0).abs() < 1e-9);
    }

    #[test]
    fn scales_that_cross_or_are_no_numbers_are_refused() {
        let new = |outer, inner| VonKarman::new(outer, inner, 0.033);
        assert_eq!(
            new(f64::INFINITY, 0.0).unwrap().outer_wavenumber_rad_m(),
            0.0
        );
        let named = |result: Result<_, Error>, name| matches!(result, Err(Error::OutOfRange { field, .. }) if field == name);
        for outer in [0.0, -1.0, f64::NAN] {
            assert!(named(new(outer, 0.01), "outer_scale_m"), "{outer}");
        }
        for (outer, inner) in [(1.0, -0.1), (1.0, f64::NAN), (0.01, 0.02)] {
            assert!(named(new(outer, inner), "inner_scale_m"), "{outer} {inner}");
        }
        let hill = HillAndrews::new(1.0, 0.0);
        assert!(matches!(
            hill,
            Err(Error::OutOfRange {
                field: "inner_scale_m",
                ..
            })
        ));
    }
}
