//! The instrument of a scene: laser, pulse, detector, telescope.

use super::pattern::is_default;
use super::receiver::{AmplifierFibre, FrontEnd, LaserAmplifier, is_nothing_db};
use crate::keys::{NothingOr, Number, ZERO_OR_MORE, keys};
use wakescope_optics::RadiusDefinition;
use wakescope_optics::plan::Receiver as ReceiverPath;
use wakescope_signal::sampled::Resampling;
use wakescope_signal::{NoiseModel, PulseDuration};

keys! {
    /// The laser source.
    table Laser {
        /// Wavelength, m.
        wavelength_m: f64 = 1.55e-6 => 1e-7..=2e-5,
        /// Pulse repetition frequency, Hz.
        pulse_repetition_hz: f64 = 400.0 => 1e-3..=1e6,
        /// Full width at half maximum of the Lorentzian line, Hz; 0 for none.
        #[serde(skip_serializing_if = "is_default")]
        linewidth_hz: f64 = 0.0 => 0.0..=1e12,
        /// What sets the energy of the pulses, in place of `pulse.energy_j`.
        amplifier: Option<LaserAmplifier> = None,
        /// The fibre of the power amplifier, for a warning of Brillouin scattering.
        fibre: Option<AmplifierFibre> = None,
    }

    /// The transmitted pulse, (6)-(8).
    table Pulse {
        /// Pulse energy at the telescope, before its aperture truncates the beam, J.
        energy_j: f64 = 150e-6 => 1e-12..=1e3,
        /// Rate of the linear chirp, Hz/s: the frequency rises by it.
        chirp_hz_s: f64 = 0.0 => -1e18..=1e18,
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
}

impl PulseShape {
    /// The Gaussian of a full width at half maximum \[s\].
    pub fn gaussian(duration_s: f64) -> Self {
        Self::Gaussian(GaussianShape { duration_s, ..GaussianShape::default() })
    }
}

impl GaussianShape {
    /// Its duration as signals have it.
    pub(crate) fn duration(&self) -> PulseDuration {
        match self.definition {
            PulseDefinition::Fwhm => PulseDuration::FullWidthHalfMaximum(self.duration_s),
            PulseDefinition::OneOverEHalfWidth => PulseDuration::OneOverEHalfWidth(self.duration_s),
        }
    }
}

keys! {
    /// The Gaussian pulse (7).
    #[derive(Copy)]
    table GaussianShape {
        /// Pulse duration, s, as [`PulseDefinition`] has it.
        duration_s: f64 = 200e-9 => 1e-9..=1e-4,
        /// What `duration_s` means.
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
        /// How the envelope is continued between the samples.
        resampling: Resampling = Resampling::CubicSpline,
        /// Whether ranges count from the centroid of the power instead of from time 0.
        centred: bool = true,
    }

    /// What a pulse duration means.
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
        /// What the receiver delivers.
        signal: DetectorSignal = DetectorSignal::IntermediateFrequency,
        /// What the receiver has beyond shot noise.
        front_end: Option<FrontEnd> = None,
        /// The analogue-to-digital converter.
        digitiser: Digitiser = Digitiser::None {},
        /// What sets the signal-to-noise ratio.
        snr: SnrReference = SnrReference::Physical {},
    }

    /// What the receiver delivers.
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
            /// Full scale over the root mean square of the noise in the detector band, (13).
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
        /// Loss of the optics, out and back together, dB.
        #[serde(skip_serializing_if = "is_default")]
        optics_loss_db: f64 = 0.0 => 0.0..=200.0,
        /// Loss of light whose polarisation does not beat, dB.
        #[serde(skip_serializing_if = "is_default")]
        polarisation_loss_db: f64 = 0.0 => 0.0..=200.0,
        /// Part of the pulse that the telescope sends straight to the detector, dB; `-inf` for none.
        #[serde(skip_serializing_if = "is_nothing_db")]
        reflection_db: f64 = f64::NEG_INFINITY => NothingOr(-300.0..=0.0),
        /// Range up to which nothing is seen, because the detector recovers from the reflection, m; 0 for none.
        #[serde(skip_serializing_if = "is_default")]
        blind_range_m: f64 = 0.0 => 0.0..=1e6,
    }
}
