//! What a real laser and a real receiver add to a scene; every part of it is off by default, and then not written.

use crate::keys::{ABOVE_ZERO_OR_INF, NothingOr, keys};
use wakescope_signal::transmitter;

keys! {
    /// What the receiver has beyond shot noise.
    #[derive(Copy)]
    table FrontEnd {
        /// Current noise of the amplifier, A/sqrt(Hz).
        amplifier_noise_a_rthz: f64 = 0.0 => 0.0..=1.0,
        /// Resistor whose thermal noise the amplifier sees, ohm; `inf` for none.
        load_ohm: f64 = f64::INFINITY => ABOVE_ZERO_OR_INF,
        /// Its temperature, K.
        load_temperature_k: f64 = 290.0 => 1e-3..=1e4,
        /// Dark current of the detector, A.
        dark_current_a: f64 = 0.0 => 0.0..=1.0,
        /// Relative intensity noise of the local oscillator, dB/Hz; `-inf` for none.
        intensity_noise_db_hz: f64 = f64::NEG_INFINITY => NothingOr(-400.0..=0.0),
        /// Rejection of what both halves of a balanced detector see, electrical, dB.
        rejection_db: f64 = 0.0 => 0.0..=200.0,
        /// Power at which the current has fallen to half of the linear one, W; `inf` for none.
        saturation_w: f64 = f64::INFINITY => ABOVE_ZERO_OR_INF,
        /// Frequency at which the response of the detector has fallen to half the power, Hz; `inf` for none.
        half_power_hz: f64 = f64::INFINITY => ABOVE_ZERO_OR_INF,
        /// Poles of this response, a Butterworth low pass.
        poles: u32 = 1 => 1..=20,
    }

    /// An amplifier that a steady pump fills between the pulses.
    #[derive(Copy)]
    table LaserAmplifier {
        /// Mean power at high repetition rates, W.
        mean_power_w: f64 = 1.0 => 1e-9..=1e6,
        /// Time over which the medium keeps its energy, s.
        storage_time_s: f64 = 2e-4 => 1e-9..=1e3,
        /// Largest energy of a pulse, J; `inf` for none.
        largest_energy_j: f64 = f64::INFINITY => ABOVE_ZERO_OR_INF,
    }

    /// The fibre of the power amplifier.
    #[derive(Copy)]
    table AmplifierFibre {
        /// Effective area of the mode, m^2.
        effective_area_m2: f64 = 3e-10 => 1e-14..=1.0,
        /// Length, m.
        length_m: f64 = 2.0 => 1e-6..=1e6,
        /// Gain from end to end, dB.
        gain_db: f64 = 0.0 => 0.0..=200.0,
        /// Gain coefficient of the Brillouin scattering, m/W.
        brillouin_gain_m_w: f64 = 2.5e-11 => 1e-15..=1e-6,
        /// Its width, Hz.
        brillouin_width_hz: f64 = 50e6 => 1e3..=1e12,
    }

    /// The echo of the pulse before, from c/(2 PRF) farther away.
    #[derive(Copy)]
    table SecondTrip {
        /// Radial velocity of the air there where the flow is not known, m/s.
        radial_velocity_m_s: f64 = 0.0 => -1e3..=1e3,
    }
}

pub(super) fn is_nothing_db(value: &f64) -> bool {
    *value == f64::NEG_INFINITY
}

impl AmplifierFibre {
    /// The fibre in the words of the simulation of signals.
    pub fn of_silica(&self) -> transmitter::Fibre {
        transmitter::Fibre {
            brillouin_gain_m_w: self.brillouin_gain_m_w,
            brillouin_width_hz: self.brillouin_width_hz,
            ..transmitter::Fibre::silica(self.effective_area_m2, self.length_m, self.gain_db)
        }
    }
}
