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
        c.within("laser.linewidth_hz", self.laser.linewidth_hz, 0.0, 1e12, "Hz");
        if let Some(a) = &self.laser.amplifier {
            c.within("laser.amplifier.mean_power_w", a.mean_power_w, 1e-9, 1e6, "W");
            c.within("laser.amplifier.storage_time_s", a.storage_time_s, 1e-9, 1e3, "s");
            positive_or_inf(c, "laser.amplifier.largest_energy_j", a.largest_energy_j, "J");
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
        if let Some(f) = &self.laser.fibre {
            c.within("laser.fibre.effective_area_m2", f.effective_area_m2, 1e-14, 1.0, "m^2");
            c.within("laser.fibre.length_m", f.length_m, 1e-6, 1e6, "m");
            c.within("laser.fibre.gain_db", f.gain_db, 0.0, 200.0, "dB");
            c.within("laser.fibre.brillouin_gain_m_w", f.brillouin_gain_m_w, 1e-15, 1e-6, "m/W");
            c.within("laser.fibre.brillouin_width_hz", f.brillouin_width_hz, 1e3, 1e12, "Hz");
        }
        let t = &self.telescope;
        c.within("telescope.optics_loss_db", t.optics_loss_db, 0.0, 200.0, "dB");
        c.within("telescope.polarisation_loss_db", t.polarisation_loss_db, 0.0, 200.0, "dB");
        c.within("telescope.blind_range_m", t.blind_range_m, 0.0, 1e6, "m");
        nothing_or_within(c, "telescope.reflection_db", t.reflection_db, [-300.0, 0.0], "dB");
        if let Some(f) = &self.detector.front_end {
            let key = |name: &str| format!("detector.front_end.{name}");
            c.within(&key("amplifier_noise_a_rthz"), f.amplifier_noise_a_rthz, 0.0, 1.0, "A/sqrt(Hz)");
            positive_or_inf(c, &key("load_ohm"), f.load_ohm, "ohm");
            c.within(&key("load_temperature_k"), f.load_temperature_k, 1e-3, 1e4, "K");
            c.within(&key("dark_current_a"), f.dark_current_a, 0.0, 1.0, "A");
            nothing_or_within(c, &key("intensity_noise_db_hz"), f.intensity_noise_db_hz, [-400.0, 0.0], "dB/Hz");
            c.within(&key("rejection_db"), f.rejection_db, 0.0, 200.0, "dB");
            positive_or_inf(c, &key("saturation_w"), f.saturation_w, "W");
            positive_or_inf(c, &key("half_power_hz"), f.half_power_hz, "Hz");
            c.count(&key("poles"), f.poles as usize, 1, 20);
        }
        if let Some(s) = &self.scan.second_trip {
            c.within("scan.second_trip.radial_velocity_m_s", s.radial_velocity_m_s, -1e3, 1e3, "m/s");
        }
        if matches!(self.detector.snr, SnrReference::Fixed { .. }) {
            let absent = "absent with detector.snr.reference = \"fixed\", which states the ratio of the last pulse's echo to all noises";
            c.require(self.detector.front_end.is_none(), "detector.front_end", "a table", absent);
            c.require(self.scan.second_trip.is_none(), "scan.second_trip", "a table", absent);
        }
    }
}

fn positive_or_inf(c: &mut Checker<'_>, key: &str, value: f64, unit: &str) {
    c.require(value > 0.0, key, value, format!("above 0 {unit}, or inf for none"));
}

fn nothing_or_within(c: &mut Checker<'_>, key: &str, value: f64, [low, high]: [f64; 2], unit: &str) {
    let ok = value == f64::NEG_INFINITY || (low..=high).contains(&value);
    c.require(ok, key, value, format!("a number from {low:?} to {high:?} {unit}, or -inf for none"));
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
