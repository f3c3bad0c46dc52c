//! What a scene may say of a real laser and a real receiver.
//! Check: impossible values and keys without effect are named; what is off is not written.

use super::{LaserAmplifier, Scene, SnrReference};
use crate::keys::Checker;
use wakescope_signal::transmitter;

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
            let side = |key, value: f64| (key, format!("{value:?}"), allowed.clone());
            let sides = [
                side("laser.amplifier.mean_power_w", a.mean_power_w),
                side("laser.amplifier.largest_energy_j", a.largest_energy_j),
                side("laser.amplifier.storage_time_s", a.storage_time_s),
                side("laser.pulse_repetition_hz", self.laser.pulse_repetition_hz),
            ];
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
