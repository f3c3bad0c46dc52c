//! Signal-to-noise ratio (14) of a heterodyne lidar, with h nu in place of the chapter's hbar nu.
//!
//! Check: the stored narrow-pulse curve for the chapter's Table 2 (-8.436 dB at 400 m), and that the pulse integral
//! tends to it for short pulses.

use crate::Error;
use crate::beam::Telescope;
use crate::error::{finite, not_negative, positive, within};
use crate::quadrature::GaussLegendre;
use std::f64::consts::PI;

/// Speed of light \[m/s\].
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
/// Planck constant \[J s\].
pub const PLANCK_J_S: f64 = 6.626_070_15e-34;

/// Which constant multiplies the optical frequency in (14).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanckConvention {
    /// h nu, the energy of a photon: the shot-noise limit.
    H,
    /// hbar nu, as the chapter prints it: 2 pi (8 dB) too high a ratio.
    Hbar,
}

/// Everything in (14) except the efficiency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SnrModel {
    /// Wavelength \[m\].
    pub wavelength_m: f64,
    /// Receiver area A_R \[m^2\], the one that normalises the efficiency.
    pub aperture_area_m2: f64,
    /// Pulse energy E_t \[J\], counted before the aperture (as the efficiency is).
    pub pulse_energy_j: f64,
    /// Quantum efficiency eta_Q, 0 to 1.
    pub quantum_efficiency: f64,
    /// Detector (noise) bandwidth B_w \[Hz\].
    pub bandwidth_hz: f64,
    /// Backscatter coefficient beta \[1/(m sr)\].
    pub backscatter_per_m_sr: f64,
    /// Extinction coefficient alpha \[1/m\]; K = exp(-alpha R) one way, K^2 for the round trip.
    pub extinction_per_m: f64,
    /// h nu or hbar nu.
    pub planck: PlanckConvention,
}

impl SnrModel {
    /// The chapter's Table 2 with quantum efficiency 1 and h nu.
    pub fn table2() -> Self {
        Self {
            wavelength_m: 1.55e-6,
            aperture_area_m2: Telescope::table2().aperture_area_m2(),
            pulse_energy_j: 150e-6,
            quantum_efficiency: 1.0,
            bandwidth_hz: 50e6,
            backscatter_per_m_sr: 1e-7,
            extinction_per_m: 7e-5,
            planck: PlanckConvention::H,
        }
    }

    /// The model itself when every field is allowed.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first field that is not allowed.
    pub fn validated(self) -> Result<Self, Error> {
        positive("wavelength_m", self.wavelength_m)?;
        positive("aperture_area_m2", self.aperture_area_m2)?;
        not_negative("pulse_energy_j", self.pulse_energy_j)?;
        positive("bandwidth_hz", self.bandwidth_hz)?;
        not_negative("backscatter_per_m_sr", self.backscatter_per_m_sr)?;
        not_negative("extinction_per_m", self.extinction_per_m)?;
        let quantum = self.quantum_efficiency;
        within("quantum_efficiency", quantum, quantum > 0.0 && quantum <= 1.0, "above 0, at most 1")?;
        Ok(self)
    }

    /// Energy of a photon \[J\] in the convention chosen: h c / lambda, or hbar c / lambda.
    pub fn photon_energy_j(&self) -> f64 {
        let h_nu = PLANCK_J_S * SPEED_OF_LIGHT_M_S / self.wavelength_m;
        match self.planck {
            PlanckConvention::H => h_nu,
            PlanckConvention::Hbar => h_nu / (2.0 * PI),
        }
    }

    /// Return per metre of range for an efficiency of 1, K^2 beta A_R / R^2 \[1/m\], (9): what a layer of air at `range_m`
    /// sends back, before the heterodyne mixing.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a model or range that is not allowed.
    pub fn return_per_m(&self, range_m: f64) -> Result<f64, Error> {
        Ok(self.validated()?.backscatter_factor_per_m(positive("range_m", range_m)?))
    }

    /// K^2 beta A_R / R^2 at `range_m` \[1/m\], the variance (9) per unit length and unit efficiency.
    fn backscatter_factor_per_m(&self, range_m: f64) -> f64 {
        (-2.0 * self.extinction_per_m * range_m).exp() * self.backscatter_per_m_sr * self.aperture_area_m2
            / (range_m * range_m)
    }

    /// eta_Q E_t / (h nu B_w) of (14).
    fn photon_factor(&self) -> f64 {
        self.quantum_efficiency * self.pulse_energy_j / (self.photon_energy_j() * self.bandwidth_hz)
    }

    /// SNR at `range_m` for a pulse short against the changes of the path:
    /// (eta_Q E_t/(h nu B_w)) (c/2) K^2 beta A_R eta_s / R^2, a power ratio.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a model, range or efficiency that is not allowed.
    pub fn snr(&self, range_m: f64, efficiency: f64) -> Result<f64, Error> {
        let model = self.validated()?;
        let range_m = positive("range_m", range_m)?;
        let efficiency = not_negative("efficiency", efficiency)?;
        Ok(model.photon_factor() * 0.5 * SPEED_OF_LIGHT_M_S * model.backscatter_factor_per_m(range_m) * efficiency)
    }

    /// SNR (14), corrected, at time `time_s` after the centre of the pulse left: the integral over range weighted with
    /// the pulse |f(t - 2R/c)|^2 of (7).
    ///
    /// `pulse_sigma_s` is sigma of (7) \[s\] (1/e half-width of |f|^2); `efficiency(range_m)` is eta_s. The part of the
    /// pulse within 6 sigma counts, and only ranges above 0.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a model or time that is not allowed, or what `efficiency` returns.
    pub fn snr_pulse(
        &self,
        time_s: f64,
        pulse_sigma_s: f64,
        mut efficiency: impl FnMut(f64) -> Result<f64, Error>,
    ) -> Result<f64, Error> {
        let model = self.validated()?;
        let time_s = finite("time_s", time_s)?;
        let sigma_m = 0.5 * SPEED_OF_LIGHT_M_S * positive("pulse_sigma_s", pulse_sigma_s)?;
        let centre_m = 0.5 * SPEED_OF_LIGHT_M_S * time_s;
        let low_m = centre_m - 6.0 * sigma_m;
        let whole = "beyond 6 pulse_sigma_s, so that the whole pulse has left the telescope";
        within("time_s", time_s, low_m > 0.0, whole)?;
        let mut sum = 0.0;
        for (range_m, weight_m) in GaussLegendre::new(16).on_panels(low_m, low_m + 12.0 * sigma_m, 6) {
            let x = (range_m - centre_m) / sigma_m;
            let pulse_per_s = (-x * x).exp() / (PI.sqrt() * pulse_sigma_s);
            let efficiency = not_negative("efficiency", efficiency(range_m)?)?;
            sum += weight_m * pulse_per_s * model.backscatter_factor_per_m(range_m) * efficiency;
        }
        Ok(model.photon_factor() * sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::refused;

    #[test]
    fn pulse_integral_tends_to_the_narrow_pulse_form() {
        let model = SnrModel::table2();
        let range_m = 1000.0;
        let time_s = 2.0 * range_m / SPEED_OF_LIGHT_M_S;
        let narrow = model.snr(range_m, 0.05).unwrap();
        let gap = |sigma_s: f64| model.snr_pulse(time_s, sigma_s, |_| Ok(0.05)).unwrap() / narrow - 1.0;
        // Second order in the length: sigma_R^2/4 times the second derivative of K^2/R^2 over itself.
        let sigma_m = 0.5 * SPEED_OF_LIGHT_M_S * 120e-9;
        let a = 2.0 * model.extinction_per_m;
        let curvature = 6.0 / range_m.powi(2) + 4.0 * a / range_m + a * a;
        let expected = 0.25 * sigma_m * sigma_m * curvature;
        assert!((gap(120e-9) / expected - 1.0).abs() < 0.02);
        assert!(gap(1e-9).abs() < 1e-7);
    }

    #[test]
    fn hbar_is_two_pi_higher_and_bad_input_is_named() {
        let h = SnrModel::table2();
        let hbar = SnrModel { planck: PlanckConvention::Hbar, ..h };
        let ratio = hbar.snr(500.0, 0.01).unwrap() / h.snr(500.0, 0.01).unwrap();
        assert!((ratio - 2.0 * PI).abs() < 1e-12);
        assert_eq!(refused(h.snr(-1.0, 0.01)), "range_m");
        assert_eq!(refused(h.snr(500.0, f64::NAN)), "efficiency");
        assert_eq!(refused(SnrModel { quantum_efficiency: 1.5, ..h }.validated()), "quantum_efficiency");
        assert_eq!(refused(h.snr_pulse(1e-9, 120e-9, |_| Ok(0.1))), "time_s");
    }
}
