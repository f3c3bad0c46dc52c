//! The receiver: what it samples, its responsivity, its noise (13) and the reference of the
//! signal-to-noise ratio (14).
//!
//! | module | what is in it |
//! |---|---|
//! | `front_end` | [`FrontEnd`]: properties of a real receiver beyond shot noise |
//! | `penalties` | [`NoiseDensities`], [`Penalties`]: noises and losses of a real receiver |
//! | `converter` | [`Converter`]: noise of rounding and clipping |
//! | [`phase_noise`] | effect of the laser's linewidth |
//! | [`echoes`] | reflex of the telescope, echo of the previous pulse |
//!
//! Check: the variance of the noise, the ratio of the two Planck conventions (2 pi), the band
//! inside Nyquist.

mod converter;
pub mod echoes;
mod front_end;
mod penalties;
pub mod phase_noise;

pub use converter::{Clipping, Converter};
pub use front_end::FrontEnd;
pub use penalties::{NoiseDensities, Penalties};

use std::f64::consts::PI;

use crate::constants::{ELEMENTARY_CHARGE_C, PLANCK_J_S, SPEED_OF_LIGHT_M_S};
use crate::error::{check, check_positive};
use crate::{Error, LayerLimits};

/// Which quantum of energy (14) divides by.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PlanckConvention {
    /// `h nu`: physics; the shot-noise limit `eta_Q P/(h nu B)`.
    #[default]
    H,
    /// `hbar nu`, as the chapter prints: the signal has `2 pi` times (8.0 dB) more power for
    /// the same noise.
    Hbar,
}

/// Which noise is added to the signal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum NoiseModel {
    /// Flat in the detector band, nothing outside; variance (13).
    #[default]
    BandLimited,
    /// The same density from zero to half the sampling rate: the variance is (13)
    /// times `(F_s/2)/B`.
    White,
    /// No noise; no random number is drawn for it.
    None,
}

/// Sampling, detector and noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Wavelength of the laser \[m\].
    pub wavelength_m: f64,
    /// Sampling rate `F_s` \[Hz\].
    pub sample_rate_hz: f64,
    /// Frequency of the return from air at rest, `f_c` \[Hz\].
    pub intermediate_frequency_hz: f64,
    /// Width of the detector band, centred on `f_c`, `B` \[Hz\]. It limits the noise only: a return
    /// beyond it is not filtered.
    pub bandwidth_hz: f64,
    /// Electrons per photon, `eta_Q`, above 0 and at most 1.
    pub quantum_efficiency: f64,
    /// Power of the local oscillator \[W\]. Signal and shot noise scale with it alike.
    pub local_oscillator_w: f64,
    /// Reference of the signal-to-noise ratio.
    pub planck: PlanckConvention,
    /// Noise added to the signal.
    pub noise: NoiseModel,
    /// Properties beyond shot noise.
    pub front_end: FrontEnd,
}

impl Receiver {
    /// That of the chapter's Table 2, with what it does not state: quantum efficiency 1, a local
    /// oscillator of 1 mW, (14) with `h`, noise in the detector band.
    pub const fn table2() -> Self {
        Self {
            wavelength_m: 1.55e-6,
            sample_rate_hz: 250e6,
            intermediate_frequency_hz: 80e6,
            bandwidth_hz: 50e6,
            quantum_efficiency: 1.0,
            local_oscillator_w: 1e-3,
            planck: PlanckConvention::H,
            noise: NoiseModel::BandLimited,
            front_end: FrontEnd::IDEAL,
        }
    }

    /// Limits on the layers of air for this receiver in a wind with this largest gradient along
    /// any line \[1/s\].
    pub fn layer_limits(&self, max_gradient_per_s: f64) -> LayerLimits {
        let Self {
            sample_rate_hz,
            wavelength_m,
            ..
        } = *self;
        LayerLimits {
            sample_rate_hz,
            wavelength_m,
            max_gradient_per_s,
        }
    }

    /// Checks a receiver of real currents.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the field that is not allowed; [`Error::BandBeyondNyquist`] if
    /// `f_c -+ B/2` is not within 0 and `F_s/2`.
    pub fn validate(&self) -> Result<(), Error> {
        self.validate_values()?;
        self.validate_band()
    }

    /// Checks a receiver of two quadratures: its band is within `-F_s/2` and `F_s/2` about `f_c`,
    /// which lies above half of it.
    ///
    /// # Errors
    /// As [`Receiver::validate`].
    pub fn validate_baseband(&self) -> Result<(), Error> {
        self.validate_values()?;
        let half_hz = 0.5 * self.bandwidth_hz;
        let nyquist_hz = 0.5 * self.sample_rate_hz;
        if half_hz >= nyquist_hz || half_hz > self.intermediate_frequency_hz {
            return Err(Error::BandBeyondNyquist {
                low_hz: -half_hz,
                high_hz: half_hz,
                nyquist_hz,
            });
        }
        Ok(())
    }

    fn validate_values(&self) -> Result<(), Error> {
        check_positive("wavelength_m", self.wavelength_m)?;
        check_positive("sample_rate_hz", self.sample_rate_hz)?;
        check_positive("intermediate_frequency_hz", self.intermediate_frequency_hz)?;
        check_positive("bandwidth_hz", self.bandwidth_hz)?;
        check(
            "quantum_efficiency",
            self.quantum_efficiency,
            "above 0 and at most 1",
            |q| q > 0.0 && q <= 1.0,
        )?;
        check_positive("local_oscillator_w", self.local_oscillator_w)?;
        self.front_end.validate()
    }

    /// Whether a real current holds the band.
    pub(crate) fn validate_band(&self) -> Result<(), Error> {
        let low_hz = self.intermediate_frequency_hz - 0.5 * self.bandwidth_hz;
        let high_hz = self.intermediate_frequency_hz + 0.5 * self.bandwidth_hz;
        let nyquist_hz = 0.5 * self.sample_rate_hz;
        if low_hz < 0.0 || high_hz >= nyquist_hz {
            return Err(Error::BandBeyondNyquist {
                low_hz,
                high_hz,
                nyquist_hz,
            });
        }
        Ok(())
    }

    /// Energy of a photon, `h c/lambda` \[J\].
    pub fn photon_energy_j(&self) -> f64 {
        PLANCK_J_S * SPEED_OF_LIGHT_M_S / self.wavelength_m
    }

    /// Responsivity `S = eta_Q e/(h nu)` \[A/W\] (the chapter calls it quantum efficiency).
    pub fn responsivity_a_w(&self) -> f64 {
        self.quantum_efficiency * ELEMENTARY_CHARGE_C / self.photon_energy_j()
    }

    /// Variance of the noise in the detector band before the converter \[A^2\], `2 e S P_LO B`,
    /// (13), where there is only shot noise; whatever the noise model.
    pub fn noise_variance_a2(&self) -> f64 {
        self.noise_density_a2_hz() * self.bandwidth_hz
    }

    /// One-sided density of the noise before the converter, `2 e S P_LO` where there is only shot
    /// noise \[A^2/Hz\].
    pub fn noise_density_a2_hz(&self) -> f64 {
        self.noise_densities().total_a2_hz()
    }

    /// Variance of the noise that the signal-to-noise ratio counts: with that of the converter.
    pub(crate) fn snr_noise_a2(&self) -> f64 {
        self.noise_variance_a2()
            * (1.0 + self.front_end.rounding_noise + self.front_end.clipping_noise)
    }

    /// Noise of the samples in the detector band \[A^2\]: what the converter leaves of the noise before it, and its own, whose density is that
    /// of the band.
    pub fn sampled_noise_a2(&self) -> f64 {
        self.snr_noise_a2() * self.front_end.clipping_gain.powi(2)
    }

    /// Power of the complex envelope per joule sent and per unit of returned fraction and
    /// `|f|^2`, `2 S^2 P_LO` \[A^2/W\], from (10), (11), (15), corrected by a further `sqrt 2` so
    /// that (14) holds; times `2 pi` with [`PlanckConvention::Hbar`], and what a saturated or
    /// slow detector leaves of it.
    pub fn heterodyne_gain_a2_w(&self) -> f64 {
        let responsivity = self.responsivity_a_w();
        let convention = match self.planck {
            PlanckConvention::H => 1.0,
            PlanckConvention::Hbar => 2.0 * PI,
        };
        2.0 * responsivity * responsivity * self.local_oscillator_w * convention * self.beat_gain()
    }

    /// Signal-to-noise ratio of a pulse of `energy_j` where the return `weight_per_m` changes
    /// slowly over the pulse: `(eta_Q E_t/(h nu B)) (c/2) weight`, (14), corrected (with `hbar` if
    /// the convention says so).
    pub fn slowly_varying_snr(&self, energy_j: f64, weight_per_m: f64) -> f64 {
        self.heterodyne_gain_a2_w() * energy_j * 0.5 * SPEED_OF_LIGHT_M_S * weight_per_m
            / self.snr_noise_a2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn receiver() -> Receiver {
        Receiver {
            quantum_efficiency: 0.8,
            ..Receiver::table2()
        }
    }

    #[test]
    fn responsivity_of_a_perfect_detector_is_1_25_ampere_per_watt_at_1550_nm() {
        let perfect = Receiver {
            quantum_efficiency: 1.0,
            ..receiver()
        };
        assert_relative_eq!(
            perfect.responsivity_a_w(),
            1.55 / 1.239_841_984,
            max_relative = 1e-6
        );
    }

    #[test]
    fn noise_is_2_e_s_p_b() {
        let expected = 2.0 * 1.602_176_634e-19 * receiver().responsivity_a_w() * 1e-3 * 50e6;
        assert_relative_eq!(
            receiver().noise_variance_a2(),
            expected,
            max_relative = 1e-14
        );
    }

    #[test]
    fn snr_is_the_shot_noise_limit_and_does_not_depend_on_the_local_oscillator() {
        // Table 2 at 400 m with eta_s = 0.0088 and eta_Q = 1: -8.4 dB.
        let solid_angle = PI * 0.05 * 0.05 / (400.0 * 400.0);
        let weight_per_m = (-2.0 * 7e-5 * 400.0_f64).exp() * 1e-7 * solid_angle * 0.0088;
        for local_oscillator_w in [1e-6, 1.0] {
            let perfect = Receiver {
                quantum_efficiency: 1.0,
                local_oscillator_w,
                ..receiver()
            };
            let snr = perfect.slowly_varying_snr(150e-6, weight_per_m);
            let received_w = 150e-6 * 0.5 * SPEED_OF_LIGHT_M_S * weight_per_m;
            let limit = received_w / (perfect.photon_energy_j() * 50e6);
            assert_relative_eq!(snr, limit, max_relative = 1e-13);
            assert!((10.0 * snr.log10() + 8.4).abs() < 0.1);
        }
    }

    #[test]
    fn printed_hbar_gives_two_pi_times_the_power() {
        let printed = Receiver {
            planck: PlanckConvention::Hbar,
            ..receiver()
        };
        let ratio = printed.slowly_varying_snr(1.0, 1.0) / receiver().slowly_varying_snr(1.0, 1.0);
        assert_relative_eq!(ratio, 2.0 * PI, max_relative = 1e-14);
        assert_eq!(printed.noise_variance_a2(), receiver().noise_variance_a2());
    }

    #[test]
    fn bands_beyond_nyquist_or_below_zero_and_bad_numbers_are_refused() {
        assert_eq!(receiver().validate(), Ok(()));
        for (intermediate_frequency_hz, bandwidth_hz) in
            [(101e6, 50e6), (20e6, 50e6), (80e6, 90.1e6)]
        {
            let bad = Receiver {
                intermediate_frequency_hz,
                bandwidth_hz,
                ..receiver()
            };
            assert!(matches!(
                bad.validate(),
                Err(Error::BandBeyondNyquist { .. })
            ));
        }
        let bad = Receiver {
            quantum_efficiency: 1.1,
            ..receiver()
        };
        assert!(matches!(
            bad.validate(),
            Err(Error::OutOfRange {
                field: "quantum_efficiency",
                ..
            })
        ));
        let bad = Receiver {
            wavelength_m: f64::NAN,
            ..receiver()
        };
        assert!(matches!(
            bad.validate(),
            Err(Error::OutOfRange {
                field: "wavelength_m",
                ..
            })
        ));
    }
}
