//! Signal-to-noise ratio (14) of a heterodyne lidar, with h nu in place of the chapter's hbar nu.
//!
//! Check: the stored narrow-pulse curve for the chapter's Table 2 (-8.436 dB at 400 m), and that the pulse integral
//! tends to it for short pulses.

use crate::Error;
use crate::beam::Telescope;
use crate::error::{not_negative, positive, within};
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
        let (model, range_m) = (self.validated()?, positive("range_m", range_m)?);
        let both_ways = (-2.0 * model.extinction_per_m * range_m).exp();
        Ok(both_ways * model.backscatter_per_m_sr * model.aperture_area_m2 / (range_m * range_m))
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
        let return_per_m = self.return_per_m(range_m)?;
        let efficiency = not_negative("efficiency", efficiency)?;
        Ok(self.photon_factor() * 0.5 * SPEED_OF_LIGHT_M_S * return_per_m * efficiency)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::refused;
    use crate::quadrature::GaussLegendre;

    /// (14), corrected, at time `time_s` after the centre of a pulse of 1/e half-width `sigma_s` of |f|^2 left: the return
    /// integrated over range with the weight |f(t - 2R/c)|^2 of (7), within 6 sigma.
    fn snr_pulse(model: &SnrModel, time_s: f64, sigma_s: f64, efficiency: f64) -> f64 {
        let [sigma_m, centre_m] = [sigma_s, time_s].map(|s| 0.5 * SPEED_OF_LIGHT_M_S * s);
        let integral =
            GaussLegendre::new(16).composite(centre_m - 6.0 * sigma_m, centre_m + 6.0 * sigma_m, 6, |range_m| {
                let x = (range_m - centre_m) / sigma_m;
                (-x * x).exp() / (PI.sqrt() * sigma_s) * model.return_per_m(range_m).unwrap() * efficiency
            });
        model.photon_factor() * integral
    }

    #[test]
    fn pulse_integral_tends_to_the_narrow_pulse_form() {
        let model = SnrModel::table2();
        let range_m = 1000.0;
        let time_s = 2.0 * range_m / SPEED_OF_LIGHT_M_S;
        let narrow = model.snr(range_m, 0.05).unwrap();
        let gap = |sigma_s: f64| snr_pulse(&model, time_s, sigma_s, 0.05) / narrow - 1.0;
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
    }
}
