//! What a real laser and a real receiver add to a scene; every part of it is off by default, and then not written.
//! Check: impossible values and keys without effect are named; what is off is not written.

use super::{Scene, SnrReference};
use crate::keys::{ABOVE_ZERO_OR_INF, Checker, NothingOr, keys, side};
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

impl Scene {
    /// Energy of a pulse, J: that of the laser's amplifier at this repetition rate if the scene has one.
    pub fn pulse_energy_j(&self) -> f64 {
        let Some(LaserAmplifier { mean_power_w, storage_time_s, largest_energy_j }) = self.laser.amplifier else {
            return self.pulse.energy_j;
        };
        transmitter::Amplifier { mean_power_w, storage_time_s, largest_energy_j }
            .energy_j(self.laser.pulse_repetition_hz)
    }

    pub(super) fn check_receiver(&self, c: &mut Checker<'_>) {
        if let Some(a) = &self.laser.amplifier {
            let energy_j = self.pulse_energy_j();
            let allowed =
                format!("one that gives pulses of 1e-12 to 1e3 J at this repetition rate, not of {energy_j:e} J");
            let values = [
                ("laser.amplifier.mean_power_w", a.mean_power_w),
                ("laser.amplifier.largest_energy_j", a.largest_energy_j),
                ("laser.amplifier.storage_time_s", a.storage_time_s),
                ("laser.pulse_repetition_hz", self.laser.pulse_repetition_hz),
            ];
            let sides = values.map(|(key, value)| side(key, value, allowed.clone()));
            c.between(!c.is_good() || (1e-12..=1e3).contains(&energy_j), &sides);
        }
        if matches!(self.detector.snr, SnrReference::Fixed { .. }) {
            let absent = "absent with detector.snr.reference = \"fixed\", which states the ratio of the last pulse's echo to all noises";
            c.require(self.detector.front_end.is_none(), "detector.front_end", "a table", absent);
            c.require(self.scan.second_trip.is_none(), "scan.second_trip", "a table", absent);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::{Scene, SceneFile};
    use std::path::Path;

    fn parse(text: &str) -> Result<SceneFile, String> {
        SceneFile::parse(text, Path::new("s.toml")).map_err(|e| e.to_string())
    }

    #[test]
    fn what_is_off_is_not_written_and_what_is_on_is_read_again() {
        let plain = Scene::default().to_toml();
        for key in ["linewidth", "front_end", "loss", "reflection", "blind", "second_trip", "amplifier", "fibre"] {
            assert!(!plain.contains(key), "{key}");
        }
        assert_eq!(parse("[telescope]\noptics_loss_db = 0.0\nreflection_db = -inf\n").unwrap().toml, plain);
        let real = parse(
            "[laser]\namplifier = { mean_power_w = 0.06 }\nfibre = {}\n[detector.front_end]\nload_ohm = 50.0\n[scan]\nsecond_trip = {}\n",
        )
        .unwrap();
        assert_eq!(parse(&real.toml).unwrap().scene.to_toml(), real.toml);
        assert!(!real.toml.contains("rejection_db") && !real.toml.contains("\nenergy_j = "), "{}", real.toml);
    }

    #[test]
    fn keys_without_effect_and_values_that_are_none_are_refused() {
        for (text, key) in [
            ("[detector.front_end]\nrejection_db = 25.0\n", "detector.front_end.rejection_db = 25.0"),
            ("[detector.front_end]\nload_temperature_k = 77.0\n", "detector.front_end.load_temperature_k = 77.0"),
            ("[detector.front_end]\npoles = 2\n", "detector.front_end.poles = 2"),
            ("[detector.front_end]\nload_ohm = 0.0\n", "detector.front_end.load_ohm = 0.0"),
            ("[detector.front_end]\nintensity_noise_db_hz = 3.0\n", "detector.front_end.intensity_noise_db_hz = 3.0"),
            (
                "[laser]\namplifier = { mean_power_w = 1e-9 }\npulse_repetition_hz = 1e6\n",
                "laser.amplifier.mean_power_w",
            ),
            ("[laser]\namplifier = {}\n[pulse]\nenergy_j = 1e-4\n", "pulse.energy_j"),
            ("[telescope]\nreflection_db = 3.0\n", "telescope.reflection_db = 3.0"),
            ("[detector]\nsnr = { reference = \"fixed\", snr_db = 0.0 }\nfront_end = {}\n", "detector.front_end"),
            (
                "[detector]\nsnr = { reference = \"fixed\", snr_db = 0.0 }\n[telescope]\noptics_loss_db = 1.0\n",
                "telescope.optics_loss_db",
            ),
        ] {
            let message = parse(text).unwrap_err();
            assert!(message.contains(key) && message.contains("is not allowed: "), "{message}");
        }
    }
}
