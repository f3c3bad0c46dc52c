//! The scene: one TOML file that describes a measurement from the laser to the files it writes.
//!
//! Every section and key has a default, and the defaults are the chapter's Table 2 with an
//! analytic vortex pair 400 m away; [`TABLE2_TOML`] writes each of them down with a comment and
//! a test holds it equal to [`Scene::default`]. Unknown keys are refused. Units are in the key
//! names; a key without a unit has none.

mod air;
mod atmosphere;
mod check;
mod estimator;
mod flow;
mod heights;
mod idle;
mod instrument;
mod method;
mod pattern;
mod presets;
mod read;
mod records;
mod retrieval;

pub use crate::document::{Content, Document};
pub use crate::io::Site;
pub use crate::io::hash_of;
pub use crate::keys::Problem;
pub use air::*;
pub use atmosphere::*;
pub use estimator::*;
pub use flow::*;
pub use heights::*;
pub use instrument::*;
pub use method::*;
pub use pattern::*;
pub use presets::{preset_names, preset_toml};
pub use read::SceneFile;
pub use retrieval::*;
pub use wakescope_estimate::Refinement;
pub use wakescope_estimate::vortex_fit::{CoreProfile, LiftSlope, Secondary};
pub use wakescope_optics::{RadiusDefinition, plan::Receiver as ReceiverPath};
pub use wakescope_signal::NoiseModel;

use crate::keys::{Is, keys};
use std::f64::consts::{FRAC_PI_2, TAU};

crate::keys::foreign_choices! {
    CoreProfile { Algebraic = "algebraic", LambOseen = "lamb_oseen" }
    LiftSlope { Span = "span", Semispan = "semispan" }
    NoiseModel { BandLimited = "band", White = "white", None = "none" }
    RadiusDefinition { Intensity = "intensity", Field = "field" }
    ReceiverPath { Monostatic = "monostatic", Bistatic = "bistatic" }
    Refinement { Parabola = "parabola", None = "none" }
    Secondary { Auto = "auto", Never = "never", Always = "always" }
}

/// The commented scene that `wakescope init` writes: every key with its default.
pub const TABLE2_TOML: &str = include_str!("table2.toml");

/// Values of keys that [`TABLE2_TOML`] does not state, for messages.
const SCENE_EXAMPLES: &str = include_str!("examples.toml");

/// The version of the scene format that this program reads and writes.
pub const FORMAT: u32 = 2;

keys! {
    /// A whole measurement. See the [module documentation](self).
    table Scene {
        /// Version of the scene format; only [`FORMAT`] is read.
        format: u32 = FORMAT => Is(|format| *format == FORMAT, format!("{FORMAT}, the format of this program")),
        /// Seed of every random number of the run; TOML integers are signed, a larger one could not be written back.
        seed: u64 = 1 => 0..=i64::MAX as u64,
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
        /// The wind.
        flow: Flow = Flow::VortexPair(VortexPair::default()),
        /// Further winds, added to it.
        added_flows: Vec<Flow> as omitted = Vec::new(),
        /// The scan.
        scan: Scan = Scan::default(),
        /// Estimation of velocities from signals.
        estimator: Estimator = Estimator::default(),
        /// Retrieval of vortices from each realisation; none if absent.
        retrieval: Option<Retrieval> = None,
        /// Output files.
        outputs: Outputs = Outputs::default(),
        /// Place and date, written to the files.
        site: Site = Site::default(),
    }

    /// The scan: a vertical one (RHI) across the runway unless another pattern is given.
    table Scan {
        /// Height of the telescope above the ground, m.
        lidar_height_m: f64 = 0.0 => 0.0..=1e4,
        /// Azimuth of the scan plane, rad, clockwise from north; only written to the files.
        azimuth_rad: f64 = std::f64::consts::FRAC_PI_2 => 0.0..=TAU,
        /// Elevation of the lowest line of sight, rad.
        elevation_min_rad: f64 = 0.0 => -FRAC_PI_2..=FRAC_PI_2,
        /// Upper limit of the elevation of the lines of sight, rad.
        elevation_max_rad: f64 = 0.2304 => -FRAC_PI_2..=FRAC_PI_2,
        /// Angle between lines of sight, rad.
        elevation_step_rad: f64 = 1.25e-3 => 1e-7..=FRAC_PI_2,
        /// Range of the first recorded sample, m.
        range_min_m: f64 = 280.0 => 1.0..=1e6,
        /// Range of the last recorded sample, m.
        range_max_m: f64 = 520.0 => 1.0..=1e6,
        /// Pulses per line of sight.
        pulses_per_line: usize = 16 => 1..=1_000_000,
        /// Independent realisations of the whole scan, from which errors are computed.
        realisations: usize = 4 => 1..=1_000_000,
        /// Second-trip echo; none by default.
        second_trip: Option<SecondTrip> = None,
        /// Treatment of lines below the ground.
        below_ground: Outside = Outside::Error {},
        /// Treatment of lines that leave a simulated flow.
        outside_flow: Outside = Outside::Error {},
        /// Pattern of the lines of sight.
        pattern: Pattern as omitted = Pattern::default(),
        /// Sequence and timing of the lines.
        head: HeadMotionKeys as omitted = HeadMotionKeys::default(),
        /// Position of the lidar.
        lidar: LidarPlace as omitted = LidarPlace::default(),
        /// How often the wind is sampled within a line: once or per pulse.
        wind_of_pulses: WindOfPulses as omitted = WindOfPulses::default(),
        /// Sums over the pulses of a line: drawn at once where exact and cheaper, or from records.
        accumulation: Accumulation as omitted = Accumulation::Auto,
    }

    /// How the pulses of a line are accumulated.
    choice Accumulation {
        /// Their sums drawn at once from the distribution, where that is exact and cheaper.
        Auto = "auto",
        /// Record by record.
        Records = "records",
    }

    /// Output files.
    #[derive(Copy)]
    table Outputs {
        /// Tables (CSV) of all results.
        csv: bool = true,
        /// NetCDF: the map as CfRadial, the flow as CF.
        netcdf: bool = true,
        /// Pictures as SVG.
        svg: bool = true,
        /// Pictures as PNG.
        png: bool = true,
        /// The wind on a plane around the scan.
        flow: bool = true,
        /// The map as a HALO Photonics raw file.
        hpl: bool = false,
        /// The raw signals.
        signals: bool = false,
        /// Realisations whose raw signals are written.
        signals_of: SignalsOf = SignalsOf::First,
        /// First range of the efficiency and SNR profile, m.
        profile_range_min_m: f64 = 100.0 => 1.0..=1e6,
        /// Last range of the profile, m.
        profile_range_max_m: f64 = 3000.0 => 1.0..=1e6,
        /// Ranges in the profile.
        profile_points: usize = 59 => 2..=100_000,
    }

    /// Realisations whose raw signals are written.
    choice SignalsOf {
        /// The first.
        First = "first",
        /// All of them.
        All = "all",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::{Kind, to_table};
    use std::path::Path;

    /// Keys that `wakescope init` does not write.
    const RARE_KEYS: [&str; 12] = [
        "altitude_m",
        "hpl",
        "kind",
        "kind",
        "latitude_deg",
        "longitude_deg",
        "name",
        "policy",
        "policy",
        "signal",
        "signals_of",
        "start_utc",
    ];

    fn scene_of(text: &str) -> Scene {
        SceneFile::without_limits(text, Path::new("s.toml")).unwrap()
    }

    #[test]
    fn choices_of_other_crates_are_read_by_the_names_that_are_offered() {
        fn check<T: crate::keys::Declared>(count: usize) {
            let Kind::Choice(words) = T::kind() else {
                panic!("no choice")
            };
            assert_eq!(words.len(), count);
            for word in words {
                let value = toml::Value::from(word);
                let written = T::from_value(&value).and_then(|choice| choice.to_value());
                assert_eq!(written, Some(value));
            }
        }
        check::<CoreProfile>(2);
        check::<LiftSlope>(2);
        check::<NoiseModel>(3);
        check::<RadiusDefinition>(2);
        check::<ReceiverPath>(2);
        check::<Refinement>(2);
        check::<Secondary>(3);
    }

    #[test]
    fn commented_table2_is_the_default_scene() {
        assert_eq!(scene_of(TABLE2_TOML), Scene::default());
        assert_eq!(scene_of(""), Scene::default());
    }

    #[test]
    fn every_default_is_in_the_commented_file_but_for_rare_keys() {
        let flat = |text: &str| {
            let mut keys: Vec<String> = text
                .lines()
                .filter(|l| !l.trim_start().starts_with('#'))
                .filter_map(|l| l.split_once('=').map(|(k, _)| k.trim().to_owned()))
                .collect();
            keys.sort();
            keys
        };
        let written = flat(TABLE2_TOML);
        let all = flat(&to_table(&Scene::default()).to_string());
        for key in &written {
            assert!(all.contains(key), "{key} is no key");
        }
        // What a first scene does not need is in the tables of the book alone.
        let mut rest = written.clone();
        let mut is_rare = |key: &&String| match rest.iter().position(|w| w == *key) {
            Some(place) => {
                rest.remove(place);
                false
            }
            None => true,
        };
        let rare: Vec<&String> = all.iter().filter(|key| is_rare(key)).collect();
        assert_eq!(rare, RARE_KEYS);
    }

    #[test]
    fn the_turbulence_keys_that_stand_as_comments_are_the_defaults() {
        let commented: String = TABLE2_TOML
            .lines()
            .skip_while(|l| !l.starts_with("# kind = \"refractive\""))
            .take_while(|l| l.starts_with("# "))
            .map(|l| format!("{}\n", &l[2..]))
            .collect();
        let read = scene_of(&format!("[atmosphere.turbulence]\n{commented}"))
            .atmosphere
            .turbulence;
        assert_eq!(
            read,
            Turbulence::Refractive(RefractiveTurbulence::default())
        );
        let keys = commented.lines().filter(|l| l.contains(" = ")).count();
        assert_eq!(keys, to_table(&read).len(), "each key is there");
    }

    #[test]
    fn scene_survives_a_round_trip() {
        let mut scene = Scene::default();
        scene.detector.snr = SnrReference::Fixed { snr_db: 0.1 + 0.2 };
        scene.flow = Flow::Uniform {
            lateral_m_s: 1.0 / 3.0,
            vertical_m_s: -0.0,
        };
        assert_eq!(scene_of(&scene.to_toml()), scene);
    }
}
