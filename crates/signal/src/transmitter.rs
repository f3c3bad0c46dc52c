//! What the laser can send: energy against repetition rate, and the stimulated Brillouin scattering of a fibre amplifier.
//!
//! Check: the stored tables; a steady pump gives its mean power to many pulses.

use std::f64::consts::{LN_2, PI};

use crate::SPEED_OF_LIGHT_M_S;

/// An amplifier that a steady pump fills between the pulses, which empty it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplifier {
    /// Mean power out at high repetition rates, `P` \[W\].
    pub mean_power_w: f64,
    /// Time over which the medium keeps its energy, `tau` \[s\].
    pub storage_time_s: f64,
    /// Largest energy of a pulse, by damage or Brillouin scattering \[J\]; `inf` for none.
    pub largest_energy_j: f64,
}

impl Amplifier {
    /// Energy of a pulse, `min(P tau (1 - exp(-1/(f tau))), E_max)` \[J\].
    pub fn energy_j(&self, pulse_repetition_hz: f64) -> f64 {
        let filled = -(-1.0 / (pulse_repetition_hz * self.storage_time_s)).exp_m1();
        (self.mean_power_w * self.storage_time_s * filled).min(self.largest_energy_j)
    }
}

/// The fibre of a power amplifier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fibre {
    /// Effective area of the mode, `A_eff` \[m^2\].
    pub effective_area_m2: f64,
    /// Length `L` \[m\].
    pub length_m: f64,
    /// Gain from end to end, `G` \[dB\]; 0 for a passive fibre.
    pub gain_db: f64,
    /// Gain coefficient of the Brillouin scattering, `g_B` \[m/W\].
    pub brillouin_gain_m_w: f64,
    /// Its width, `dnu_B` \[Hz\].
    pub brillouin_width_hz: f64,
    /// Refractive index of the glass.
    pub refractive_index: f64,
}

impl Fibre {
    /// Silica about 1.55 um: 2.5e-11 m/W over 50 MHz, index 1.45.
    pub const fn silica(effective_area_m2: f64, length_m: f64, gain_db: f64) -> Self {
        Self {
            effective_area_m2,
            length_m,
            gain_db,
            brillouin_gain_m_w: 2.5e-11,
            brillouin_width_hz: 50e6,
            refractive_index: 1.45,
        }
    }

    /// Length over which the wave grows, `min(L (1 - 1/G)/ln G, c FWHM/(2 n))` \[m\].
    pub fn effective_length_m(&self, pulse_fwhm_s: f64) -> f64 {
        let exponent = self.gain_db * 0.1 * std::f64::consts::LN_10;
        let share = if exponent == 0.0 {
            1.0
        } else {
            -(-exponent).exp_m1() / exponent
        };
        (self.length_m * share).min(0.5 * SPEED_OF_LIGHT_M_S * pulse_fwhm_s / self.refractive_index)
    }

    /// Peak power at which a Gaussian pulse begins to lose to Brillouin scattering,
    /// `21 A_eff/(g_B L_eff) (1 + dnu/dnu_B)`, `dnu = (2 ln 2/pi)/FWHM` \[W\]. Good to a factor of 2 to 3.
    pub fn brillouin_threshold_w(&self, pulse_fwhm_s: f64) -> f64 {
        let widening = 1.0 + pulse_spectrum_hz(pulse_fwhm_s) / self.brillouin_width_hz;
        let length_m = self.effective_length_m(pulse_fwhm_s);
        21.0 * self.effective_area_m2 / (self.brillouin_gain_m_w * length_m) * widening
    }
}

/// Width of the spectrum of a Gaussian pulse, full at half maximum, `(2 ln 2/pi)/FWHM` \[Hz\].
pub fn pulse_spectrum_hz(pulse_fwhm_s: f64) -> f64 {
    2.0 * LN_2 / PI / pulse_fwhm_s
}
