//! The instrument of a scene: laser, pulse, detector, telescope, and what a real laser and a real receiver add; every part of that is off
//! by default, and then not written.
//! Check: impossible values and keys without effect are named; what is off is not written.

use super::Scene;
use crate::keys::{ABOVE_ZERO_OR_INF, Checker, Number, ZERO_OR_MORE, keys};
use wakescope_optics::RadiusDefinition;
use wakescope_optics::plan::Receiver as ReceiverPath;
use wakescope_signal::{GaussianPulse, NoiseModel, Pulse as TransmittedPulse};

keys! {
    /// The laser source.
    table Laser {
        /// Wavelength, m.
        wavelength_m: f64 = 1.55e-6 => 1e-7..=2e-5,
        /// Pulse repetition frequency, Hz.
        pulse_repetition_hz: f64 = 400.0 => 1e-3..=1e6,
        /// Full width at half maximum of the Lorentzian line, Hz; 0 for none.
        linewidth_hz: f64 as omitted = 0.0 => 0.0..=1e12,
    }

    /// The transmitted pulse, (6)-(8).
    table Pulse {
        /// Pulse energy at the telescope, before its aperture truncates the beam, J.
        energy_j: f64 = 150e-6 => 1e-12..=1e3,
        /// Shape of |f|^2, with its duration.
        shape: PulseShape = PulseShape::Gaussian(GaussianShape::default()),
    }

    /// Shape of the pulse.
    kinds PulseShape by "kind" {
        /// The Gaussian (7).
        "gaussian" => Gaussian(GaussianShape),
        /// A table.
        "sampled" => Sampled(SampledShape),
    }

    /// The Gaussian pulse (7).
    #[derive(Copy)]
    table GaussianShape {
        /// Pulse duration, s, by the definition `definition`.
        duration_s: f64 = 200e-9 => 1e-9..=1e-4,
        /// Definition of `duration_s`.
        definition: PulseDefinition = PulseDefinition::Fwhm,
    }

    /// A pulse given by samples.
    table SampledShape {
        /// Times of the samples, s, increasing.
        time_s: Vec<f64> = Vec::new(),
        /// Power |f|^2 at these times, in any unit.
        power: Vec<f64> = Vec::new() => ZERO_OR_MORE,
        /// Phase of f at these times, rad; empty for none.
        phase_rad: Vec<f64> = Vec::new(),
        /// Whether ranges count from the centroid of the power instead of from time 0.
        centred: bool = true,
    }

    /// Definition of the pulse duration.
    choice PulseDefinition {
        /// Full width at half maximum of |f|^2: 2 sqrt(ln 2) sigma.
        Fwhm = "fwhm",
        /// Half width at 1/e of |f|^2: the sigma of (7) itself.
        OneOverEHalfWidth = "one_over_e_half_width",
    }

    /// Photodetector and digitiser, (12)-(14).
    table Detector {
        /// Detector bandwidth B_w, Hz, centred on the intermediate frequency.
        bandwidth_hz: f64 = 50e6 => 1e3..=1e11,
        /// Intermediate frequency f_c, Hz.
        intermediate_frequency_hz: f64 = 80e6 => 1e3..=1e11,
        /// Sampling frequency, Hz.
        sampling_hz: f64 = 250e6 => 1e3..=1e11,
        /// Quantum efficiency eta_Q.
        quantum_efficiency: f64 = 1.0 => 1e-6..=1.0,
        /// Power of the local oscillator on the detector, W. The SNR depends on it only through `front_end`.
        local_oscillator_w: f64 = 1e-3 => 1e-12..=1e3,
        /// Spectrum of the shot noise.
        noise: NoiseModel = NoiseModel::BandLimited,
        /// Output signal of the receiver.
        signal: DetectorSignal = DetectorSignal::IntermediateFrequency,
        /// Noise and response of the receiver beyond shot noise.
        front_end: Option<FrontEnd> = None,
        /// The analogue-to-digital converter.
        digitiser: Digitiser = Digitiser::None {},
        /// What sets the signal-to-noise ratio.
        snr: SnrReference = SnrReference::Physical {},
    }

    /// Output signal of the receiver.
    choice DetectorSignal {
        /// The real current at the intermediate frequency.
        IntermediateFrequency = "intermediate_frequency",
        /// Two quadratures about zero frequency.
        Baseband = "baseband",
    }

    /// The analogue-to-digital converter.
    #[derive(Copy)]
    kinds Digitiser by "kind" {
        /// Samples are neither rounded nor clipped.
        "none" => None {},
        /// Rounding to 2^bits codes, and saturation.
        "quantised" => Quantised {
            /// Bits of a sample.
            bits: u32 => 1..=32,
            /// Full scale over the root mean square of all noise in the detector band.
            full_scale_over_noise: f64 => 1e-6..=1e12,
        },
    }

    /// What sets the signal-to-noise ratio.
    #[derive(Copy)]
    kinds SnrReference by "reference" {
        /// (14) with Planck's constant h: the shot-noise limit.
        "physical" => Physical {},
        /// (14) as the chapter prints it, with h/(2 pi): 8 dB more.
        "chapter" => Chapter {},
        /// The same value at every range, whatever the optics and the aerosol.
        "fixed" => Fixed {
            /// Signal-to-noise ratio in the detector band, dB.
            snr_db: f64 => -100.0..=100.0,
        },
    }

    /// Telescope and beam.
    table Telescope {
        /// Radius of the hard aperture, m.
        aperture_radius_m: f64 = 0.05 => 1e-4..=10.0,
        /// Radius of a central obscuration, m; 0 for none.
        obscuration_radius_m: f64 = 0.0 => 0.0..=10.0,
        /// 1/e radius of the Gaussian beam at the aperture, m.
        beam_radius_m: f64 = 0.03 => 1e-4..=10.0,
        /// Whether `beam_radius_m` is that of the irradiance or of the field.
        beam_radius_definition: RadiusDefinition = RadiusDefinition::Intensity,
        /// Distance of the focus, m; `inf` for a collimated beam.
        focus_m: f64 = f64::INFINITY => Number(
            |focus_m| !focus_m.is_nan() && focus_m != 0.0 && focus_m != f64::NEG_INFINITY,
            "a distance in m other than 0, or inf for a collimated beam",
        ),
        /// Whether transmitted and received light cross the same turbulence.
        receiver: ReceiverPath = ReceiverPath::Monostatic,
        /// Loss of the optics, out and back together, with the light whose polarisation does not beat, dB.
        optics_loss_db: f64 as omitted = 0.0 => 0.0..=200.0,
        /// Reflection of the pulse by the telescope onto the detector, relative to the pulse, dB; `-inf` for none.
        reflection_db: f64 as omitted = f64::NEG_INFINITY => Number(
            |value| value == f64::NEG_INFINITY || (-300.0..=0.0).contains(&value),
            "a number from -300.0 to 0.0 {}, or -inf for none",
        ),
        /// Range below which the detector, saturated by the reflection, measures nothing, m; 0 for none.
        blind_range_m: f64 as omitted = 0.0 => 0.0..=1e6,
    }

    /// Noise and response of the receiver beyond shot noise.
    #[derive(Copy)]
    table FrontEnd {
        /// Current noise of the amplifier, A/sqrt(Hz).
        amplifier_noise_a_rthz: f64 = 0.0 => 0.0..=1.0,
        /// Load resistor of the detector, a source of thermal noise, ohm; `inf` for none.
        load_ohm: f64 = f64::INFINITY => ABOVE_ZERO_OR_INF,
        /// Its temperature, K.
        load_temperature_k: f64 = 290.0 => 1e-3..=1e4,
        /// Dark current of the detector, A.
        dark_current_a: f64 = 0.0 => 0.0..=1.0,
        /// Relative intensity noise of the local oscillator, dB/Hz; `-inf` for none.
        intensity_noise_db_hz: f64 = f64::NEG_INFINITY => Number(
            |value| value == f64::NEG_INFINITY || (-400.0..=0.0).contains(&value),
            "a number from -400.0 to 0.0 {}, or -inf for none",
        ),
        /// Common-mode rejection of a balanced detector, electrical, dB.
        rejection_db: f64 = 0.0 => 0.0..=200.0,
        /// Saturation power: the current is half that of a linear detector there, W; `inf` for none.
        saturation_w: f64 = f64::INFINITY => ABOVE_ZERO_OR_INF,
        /// Half-power cut-off frequency of the detector, Hz; `inf` for none.
        half_power_hz: f64 = f64::INFINITY => ABOVE_ZERO_OR_INF,
        /// Number of poles of this Butterworth low pass.
        poles: u32 = 1 => 1..=20,
    }

    /// Echo of the previous pulse, from c/(2 PRF) farther away.
    #[derive(Copy)]
    table SecondTrip {
        /// Radial velocity of the air at those ranges if the flow is not known there, m/s.
        radial_velocity_m_s: f64 = 0.0 => -1e3..=1e3,
    }
}

impl Pulse {
    /// The pulse that the signal simulation sends.
    ///
    /// # Errors
    /// Fails if the samples of a sampled pulse are no pulse.
    pub(crate) fn simulated(&self) -> Result<TransmittedPulse, wakescope_signal::Error> {
        match &self.shape {
            PulseShape::Gaussian(shape) => {
                Ok(GaussianPulse::new(shape.sigma_s(), self.energy_j)?.into())
            }
            PulseShape::Sampled(shape) => shape.simulated(self.energy_j),
        }
    }

    /// Whether it is a Gaussian.
    pub(crate) fn is_gaussian(&self) -> bool {
        matches!(self.shape, PulseShape::Gaussian(_))
    }
}

impl PulseShape {
    /// The Gaussian of a full width at half maximum \[s\].
    pub fn gaussian(duration_s: f64) -> Self {
        Self::Gaussian(GaussianShape {
            duration_s,
            ..GaussianShape::default()
        })
    }
}

impl SampledShape {
    /// The pulse of these samples with an energy, J.
    fn simulated(&self, energy_j: f64) -> Result<TransmittedPulse, wakescope_signal::Error> {
        let sampled = if self.phase_rad.is_empty() {
            TransmittedPulse::from_power(&self.time_s, &self.power, energy_j)?
        } else {
            TransmittedPulse::from_power_and_phase(
                &self.time_s,
                &self.power,
                &self.phase_rad,
                energy_j,
            )?
        };
        Ok(if self.centred {
            sampled.centred()
        } else {
            sampled
        })
    }
}

impl GaussianShape {
    /// The 1/e half width sigma of |f|^2 in (7), s.
    pub(crate) fn sigma_s(&self) -> f64 {
        match self.definition {
            PulseDefinition::Fwhm => GaussianPulse::sigma_of_full_width_s(self.duration_s),
            PulseDefinition::OneOverEHalfWidth => self.duration_s,
        }
    }
}

impl Scene {
    pub(super) fn check_receiver(&self, c: &mut Checker<'_>) {
        if matches!(self.detector.snr, SnrReference::Fixed { .. }) {
            let absent = "absent with detector.snr.reference = \"fixed\", which states the ratio of the last pulse's echo to all noises";
            c.require(
                self.detector.front_end.is_none(),
                "detector.front_end",
                "a table",
                absent,
            );
            c.require(
                self.scan.second_trip.is_none(),
                "scan.second_trip",
                "a table",
                absent,
            );
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
        for key in [
            "linewidth",
            "front_end",
            "loss",
            "reflection",
            "blind",
            "second_trip",
        ] {
            assert!(!plain.contains(key), "{key}");
        }
        assert_eq!(
            parse("[telescope]\noptics_loss_db = 0.0\nreflection_db = -inf\n")
                .unwrap()
                .toml,
            plain
        );
        let real = parse(
            "[laser]\nlinewidth_hz = 1e3\n[detector.front_end]\nload_ohm = 50.0\n[scan]\nsecond_trip = {}\n",
        )
        .unwrap();
        assert_eq!(parse(&real.toml).unwrap().content.to_toml(), real.toml);
        assert!(!real.toml.contains("rejection_db"), "{}", real.toml);
    }

    #[test]
    fn keys_without_effect_and_values_that_are_none_are_refused() {
        for (text, key) in [
            (
                "[detector.front_end]\nrejection_db = 25.0\n",
                "detector.front_end.rejection_db = 25.0",
            ),
            (
                "[detector.front_end]\nload_temperature_k = 77.0\n",
                "detector.front_end.load_temperature_k = 77.0",
            ),
            (
                "[detector.front_end]\npoles = 2\n",
                "detector.front_end.poles = 2",
            ),
            (
                "[detector.front_end]\nload_ohm = 0.0\n",
                "detector.front_end.load_ohm = 0.0",
            ),
            (
                "[detector.front_end]\nintensity_noise_db_hz = 3.0\n",
                "detector.front_end.intensity_noise_db_hz = 3.0",
            ),
            (
                "[telescope]\nreflection_db = 3.0\n",
                "telescope.reflection_db = 3.0",
            ),
            (
                "[detector]\nsnr = { reference = \"fixed\", snr_db = 0.0 }\nfront_end = {}\n",
                "detector.front_end",
            ),
            (
                "[detector]\nsnr = { reference = \"fixed\", snr_db = 0.0 }\n[telescope]\noptics_loss_db = 1.0\n",
                "telescope.optics_loss_db",
            ),
        ] {
            let message = parse(text).unwrap_err();
            assert!(
                message.contains(key) && message.contains("is not allowed: "),
                "{message}"
            );
        }
    }
}
