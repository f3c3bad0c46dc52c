//! Isotropic turbulence with the spectrum of von Karman (1948): its spectra, covariances and
//! structure functions in closed form.
//!
//! `E(k) = alpha eps^(2/3) L^(5/3) (k L)^4/(1 + (k L)^2)^(17/6)` (A1), with the dissipation rate
//! `eps`, the outer scale `L` and the Kolmogorov constant `alpha`. `alpha` is a convention: the
//! same air has a dissipation rate 2 % lower with 1.521, which makes `C2` = 2.
//!
//! Check: stored tables, made by an independent quadrature, to 1e-8; the inertial range.

use super::bessel::scaled_bessel_k;
use crate::error::{Error, positive};
use statrs::function::gamma::gamma;

/// Isotropic turbulence with the spectrum of von Karman, (A1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VonKarman {
    /// Rate at which kinetic energy is dissipated, `eps` \[m^2/s^3\].
    pub dissipation_m2_s3: f64,
    /// Outer scale `L` \[m\]; the largest eddies are a few times larger.
    pub outer_scale_m: f64,
    /// Kolmogorov constant `alpha` of `E = alpha eps^(2/3) k^(-5/3)`, mostly 1.5.
    pub kolmogorov_constant: f64,
}

impl VonKarman {
    /// Turbulence of the given dissipation rate and outer scale.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless all three are finite and above 0.
    pub fn new(
        dissipation_m2_s3: f64,
        outer_scale_m: f64,
        kolmogorov_constant: f64,
    ) -> Result<Self, Error> {
        positive("dissipation_m2_s3", dissipation_m2_s3)?;
        positive("outer_scale_m", outer_scale_m)?;
        positive("kolmogorov_constant", kolmogorov_constant)?;
        Ok(Self {
            dissipation_m2_s3,
            outer_scale_m,
            kolmogorov_constant,
        })
    }

    /// Energy spectrum `E` \[m^3/s^2\] at a wave number \[rad/m\], (A1): its integral over all wave
    /// numbers is 3/2 of the variance of one component.
    #[must_use]
    pub fn energy_m3_s2(&self, wavenumber_rad_m: f64) -> f64 {
        let x2 = (wavenumber_rad_m * self.outer_scale_m).powi(2);
        self.strength() * self.outer_scale_m.powf(5.0 / 3.0) * x2 * x2 / (1.0 + x2).powf(17.0 / 6.0)
    }

    /// Variance of one component `u'^2 = 1.0325 (eps L)^(2/3)` \[m^2/s^2\] for `alpha` = 1.5, (A2).
    #[must_use]
    pub fn variance_m2_s2(&self) -> f64 {
        // alpha/3 times the beta function of 5/2 and 1/3.
        let beta = gamma(2.5) * gamma(1.0 / 3.0) / gamma(17.0 / 6.0);
        self.strength() * self.outer_scale_m.powf(2.0 / 3.0) * beta / 3.0
    }

    /// Integral scale of the longitudinal correlation, 0.7468 `L` \[m\], (A2).
    #[must_use]
    pub fn integral_scale_m(&self) -> f64 {
        let ratio = gamma(5.0 / 6.0) / gamma(1.0 / 3.0);
        std::f64::consts::PI.sqrt() * ratio * self.outer_scale_m
    }

    /// Covariances `(B_LL, B_NN)` \[m^2/s^2\] of the components along and across a separation
    /// \[m\], (A3).
    #[must_use]
    pub fn covariances_m2_s2(&self, separation_m: f64) -> (f64, f64) {
        let x = separation_m.abs() / self.outer_scale_m;
        let scale = self.variance_m2_s2() * 2.0_f64.powf(2.0 / 3.0) / gamma(1.0 / 3.0);
        let third = scaled_bessel_k(1.0 / 3.0, x);
        let two_thirds = x.powf(2.0 / 3.0) * scaled_bessel_k(2.0 / 3.0, x);
        (scale * third, scale * (third - 0.5 * two_thirds))
    }

    /// Structure functions `(D_LL, D_NN)` \[m^2/s^2\] of the components along and across a
    /// separation \[m\], (A4).
    #[must_use]
    pub fn structure_functions_m2_s2(&self, separation_m: f64) -> (f64, f64) {
        let variance = self.variance_m2_s2();
        let (along, across) = self.covariances_m2_s2(separation_m);
        (2.0 * (variance - along), 2.0 * (variance - across))
    }

    /// One-sided spectrum `F_L` \[m^3/s^2\] along a line of the component along it, (A5): its
    /// integral over wave numbers above 0 \[rad/m\] is the variance.
    #[must_use]
    pub fn longitudinal_spectrum_m3_s2(&self, wavenumber_rad_m: f64) -> f64 {
        let inverse_m2 = self.outer_scale_m.powi(-2) + wavenumber_rad_m.powi(2);
        18.0 / 55.0 * self.strength() * inverse_m2.powf(-5.0 / 6.0)
    }

    /// One-sided spectrum `F_T` \[m^3/s^2\] along a line of a component across it, (A5).
    #[must_use]
    pub fn transverse_spectrum_m3_s2(&self, wavenumber_rad_m: f64) -> f64 {
        let outer_m2 = self.outer_scale_m.powi(-2);
        let k2 = wavenumber_rad_m.powi(2);
        let ratio = (outer_m2 + 8.0 / 3.0 * k2) / (outer_m2 + k2);
        0.5 * ratio * self.longitudinal_spectrum_m3_s2(wavenumber_rad_m)
    }

    /// `alpha eps^(2/3)` \[m^(4/3)/s^2\].
    fn strength(&self) -> f64 {
        self.kolmogorov_constant * self.dissipation_m2_s3.powf(2.0 / 3.0)
    }
}
