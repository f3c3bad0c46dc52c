//! The scene: one TOML file that describes a measurement from the laser to the files it writes.
//!
//! Every section and key has a default, and the defaults are the chapter's Table 2 with an
//! analytic vortex pair 400 m away; [`TABLE2_TOML`] writes each of them down with a comment and
//! a test holds it equal to [`Scene::default`]. Unknown keys are refused. Units are in the key
//! names; a key without a unit has none.

macro_rules! section {
    ($(#[$doc:meta])* $name:ident { $($(#[$fdoc:meta])* $field:ident: $ty:ty = $default:expr,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name { $($(#[$fdoc])* pub $field: $ty,)* }
        impl Default for $name {
            fn default() -> Self { Self { $($field: $default,)* } }
        }
    };
}
#[cfg(feature = "flow")]
pub(crate) use section;

mod atmosphere;
mod check;
mod flow;
mod read;

pub use atmosphere::{
    Atmosphere, OuterScaleWavenumber, RefractiveTurbulence, ScreenSampling, SpectrumKind, Turbulence,
};
pub use check::Problem;
pub use flow::{Flow, VortexMotion, VortexPair, VortexProfile};
pub use read::{Located, SceneError, SceneFile};
#[cfg(feature = "flow")]
pub(crate) use read::{invalid, malformed};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// The commented scene that `wakescope init` writes: every key with its default.
pub const TABLE2_TOML: &str = include_str!("table2.toml");

/// The version of the scene format that this program reads and writes.
pub const FORMAT: u32 = 1;

section! {
    /// A whole measurement. See the [module documentation](self).
    Scene {
        /// Version of the scene format; only [`FORMAT`] is read.
        format: u32 = FORMAT,
        /// Seed of every random number of the run.
        seed: u64 = 1,
        /// The laser source.
        laser: Laser = Laser::default(),
        /// The transmitted pulse, (6)-(8).
        pulse: Pulse = Pulse::default(),
        /// Photodetector and digitiser, (12)-(14).
        detector: Detector = Detector::default(),
        /// Telescope and beam.
        telescope: Telescope = Telescope::default(),
        /// Aerosol and refractive turbulence.
        atmosphere: Atmosphere = Atmosphere::default(),
        /// The wind that the lidar sees.
        flow: Flow = Flow::default(),
        /// Where the lidar looks.
        scan: Scan = Scan::default(),
        /// From signals to velocities.
        estimator: Estimator = Estimator::default(),
        /// What is written.
        outputs: Outputs = Outputs::default(),
    }
}

section! {
    /// The laser source.
    Laser {
        /// Wavelength, m.
        wavelength_m: f64 = 1.55e-6,
        /// Pulse repetition frequency, Hz.
        pulse_repetition_hz: f64 = 400.0,
    }
}

section! {
    /// The transmitted pulse, (6)-(8).
    Pulse {
        /// Pulse energy at the telescope, before its aperture truncates the beam, J.
        energy_j: f64 = 150e-6,
        /// Pulse duration, s, as [`PulseDefinition`] has it.
        duration_s: f64 = 200e-9,
        /// What `duration_s` means.
        definition: PulseDefinition = PulseDefinition::Fwhm,
    }
}

/// What a pulse duration means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PulseDefinition {
    /// Full width at half maximum of |f|^2: 2 sqrt(ln 2) sigma.
    Fwhm,
    /// Half width at 1/e of |f|^2: the sigma of (7) itself.
    OneOverEHalfWidth,
}

section! {
    /// Photodetector and digitiser, (12)-(14).
    Detector {
        /// Detector bandwidth B_w, Hz, centred on the intermediate frequency.
        bandwidth_hz: f64 = 50e6,
        /// Intermediate frequency f_c, Hz.
        intermediate_frequency_hz: f64 = 80e6,
        /// Sampling frequency, Hz.
        sampling_hz: f64 = 250e6,
        /// Quantum efficiency eta_Q.
        quantum_efficiency: f64 = 1.0,
        /// Power of the local oscillator on the detector, W. The SNR does not depend on it.
        local_oscillator_w: f64 = 1e-3,
        /// Spectrum of the shot noise.
        noise: NoiseKind = NoiseKind::Band,
        /// What sets the signal-to-noise ratio.
        snr: SnrReference = SnrReference::Physical {},
    }
}

/// Spectrum of the shot noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseKind {
    /// Flat in the detector band, nothing outside, variance (13).
    Band,
    /// The same density up to half the sampling frequency.
    White,
    /// No noise, and no random numbers drawn for it.
    None,
}

/// What sets the signal-to-noise ratio.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "reference", rename_all = "snake_case", deny_unknown_fields)]
pub enum SnrReference {
    /// (14) with Planck's constant h: the shot-noise limit.
    Physical {},
    /// (14) as the chapter prints it, with h/(2 pi): 8 dB more.
    Chapter {},
    /// The same value at every range, whatever the optics and the aerosol.
    Fixed {
        /// Signal-to-noise ratio in the detector band, dB.
        snr_db: f64,
    },
}

section! {
    /// Telescope and beam.
    Telescope {
        /// Radius of the hard aperture, m.
        aperture_radius_m: f64 = 0.05,
        /// Radius of a central obscuration, m; 0 for none.
        obscuration_radius_m: f64 = 0.0,
        /// 1/e radius of the Gaussian beam at the aperture, m.
        beam_radius_m: f64 = 0.03,
        /// Whether `beam_radius_m` is that of the irradiance or of the field.
        beam_radius_definition: BeamRadiusDefinition = BeamRadiusDefinition::Intensity,
        /// Distance of the focus, m; `inf` for a collimated beam.
        focus_m: f64 = f64::INFINITY,
        /// Whether transmitted and received light cross the same turbulence.
        receiver: ReceiverPath = ReceiverPath::Monostatic,
    }
}

/// Whether transmitted and received light cross the same turbulence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReceiverPath {
    /// One telescope: the same path out and back.
    Monostatic,
    /// Two telescopes: independent paths; in free space they are taken to coincide.
    Bistatic,
}

/// Which 1/e radius is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BeamRadiusDefinition {
    /// Of the irradiance, |E|^2 ~ exp(-r^2/w^2).
    Intensity,
    /// Of the field, E ~ exp(-r^2/w^2).
    Field,
}

section! {
    /// Where the lidar looks: a vertical scan (RHI) across the runway.
    Scan {
        /// Height of the telescope above the ground, m.
        lidar_height_m: f64 = 0.0,
        /// Azimuth of the scan plane, rad, clockwise from north; only written to the files.
        azimuth_rad: f64 = std::f64::consts::FRAC_PI_2,
        /// Lowest line of sight, rad above the horizon.
        elevation_min_rad: f64 = 0.0,
        /// Upper limit of the lines of sight, rad.
        elevation_max_rad: f64 = 0.2304,
        /// Angle between lines of sight, rad.
        elevation_step_rad: f64 = 1.25e-3,
        /// Range of the first recorded sample, m.
        range_min_m: f64 = 280.0,
        /// No sample beyond this range is recorded, m.
        range_max_m: f64 = 520.0,
        /// Pulses sent along each line.
        pulses_per_line: usize = 16,
        /// Independent repetitions of the whole scan, for the errors.
        realisations: usize = 4,
    }
}

section! {
    /// From signals to velocities.
    Estimator {
        /// Which estimator.
        method: Method = Method::PeriodogramAccumulation,
        /// Samples N of a window.
        window_samples: usize = 64,
        /// Weighting h of the window, (29).
        weighting: Weighting = Weighting::Gaussian,
        /// Samples between windows that are accumulated.
        window_step_samples: usize = 1,
        /// Samples between gates of the map.
        gate_step_samples: usize = 5,
        /// Points of the zero-padded spectrum; `window_samples` for the literal (29).
        padded_samples: usize = 1024,
        /// How the peak is refined between the points of the spectrum.
        refinement: Refinement = Refinement::Parabola,
        /// Radius of the circular region of accumulation, m.
        radius_m: f64 = 2.0,
    }
}

/// Which estimator makes the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Mean periodogram of the pulses of one line at one range.
    Periodogram,
    /// Mean periodogram of all windows within `radius_m` (Table 3).
    PeriodogramAccumulation,
}

/// Weighting of the samples of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weighting {
    /// Gaussian, as the chapter's default.
    Gaussian,
    /// All samples alike.
    Rectangular,
    /// Hann.
    Hann,
}

/// How a spectral peak is refined between the points of the spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refinement {
    /// Parabola through the logarithms of three points.
    Parabola,
    /// None: the velocity of the highest point.
    None,
}

section! {
    /// What is written.
    #[derive(Copy)]
    Outputs {
        /// Tables of every number.
        csv: bool = true,
        /// NetCDF: the map as CfRadial, the flow as CF.
        netcdf: bool = true,
        /// Pictures as SVG.
        svg: bool = true,
        /// Pictures as PNG.
        png: bool = true,
        /// The wind on a cross-plane around the scan.
        flow: bool = true,
        /// The raw signals of the first realisation.
        signals: bool = false,
        /// First range of the efficiency and SNR profile, m.
        profile_range_min_m: f64 = 100.0,
        /// Last range of the profile, m.
        profile_range_max_m: f64 = 3000.0,
        /// Ranges in the profile.
        profile_points: usize = 59,
    }
}

/// The short name of a text: the first 16 hexadecimal digits of its SHA-256.
pub fn hash_of(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().take(8).map(|b| format!("{b:02x}")).collect()
}

impl Scene {
    /// The scene with every default written out, as TOML.
    ///
    /// Equal scenes give equal text; the hash of it names the scene.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_else(|e| unreachable!("a scene is plain data: {e}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commented_table2_is_the_default_scene() {
        let scene: Scene = toml::from_str(TABLE2_TOML).unwrap();
        assert_eq!(scene, Scene::default());
        let empty: Scene = toml::from_str("").unwrap();
        assert_eq!(empty, Scene::default());
    }

    #[test]
    fn every_default_is_written_down() {
        let flat = |text: &str| {
            let mut keys: Vec<String> = text
                .lines()
                .filter(|l| !l.trim_start().starts_with('#'))
                .filter_map(|l| l.split_once('=').map(|(k, _)| k.trim().to_owned()))
                .collect();
            keys.sort();
            keys
        };
        assert_eq!(flat(TABLE2_TOML), flat(&Scene::default().to_toml()));
    }

    #[test]
    fn the_turbulence_keys_that_stand_as_comments_are_the_defaults() {
        let commented: String = TABLE2_TOML
            .lines()
            .skip_while(|l| !l.starts_with("# kind = \"refractive\""))
            .take_while(|l| l.starts_with("# "))
            .map(|l| format!("{}\n", &l[2..]))
            .collect();
        let read: Turbulence = toml::from_str(&commented).unwrap();
        assert_eq!(read, Turbulence::Refractive(RefractiveTurbulence::default()));
        let keys = commented.lines().filter(|l| l.contains(" = ")).count();
        assert_eq!(keys, toml::to_string(&read).unwrap().lines().count(), "each key is there");
    }

    #[test]
    fn scene_survives_a_round_trip() {
        let mut scene = Scene::default();
        scene.detector.snr = SnrReference::Fixed { snr_db: 0.1 + 0.2 };
        scene.flow = Flow::Uniform { lateral_m_s: 1.0 / 3.0, vertical_m_s: -0.0 };
        let back: Scene = toml::from_str(&scene.to_toml()).unwrap();
        assert_eq!(back, scene);
    }
}
