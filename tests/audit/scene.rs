//! A scene as its keys: what a draw states, and the defaults of the book (docs/src/scene.md) for all others.

use super::pair::Path;
use std::fmt::Display;
use std::sync::{LazyLock, OnceLock};
use toml::{Table, Value};

/// The defaults, as the tables of the page on the scene file have them.
const DEFAULTS: &str = r#"
seed = 1
laser = { wavelength_m = 1.55e-6, pulse_repetition_hz = 400.0, linewidth_hz = 0.0 }
pulse = { energy_j = 150e-6 }
pulse.shape = { kind = "gaussian", duration_s = 200e-9, definition = "fwhm", centred = true }
detector = { bandwidth_hz = 50e6, intermediate_frequency_hz = 80e6, sampling_hz = 250e6, quantum_efficiency = 1.0, local_oscillator_w = 1e-3, noise = "band", signal = "intermediate_frequency" }
detector.digitiser = { kind = "none" }
detector.snr = { reference = "physical" }
detector.front_end = { amplifier_noise_a_rthz = 0.0, load_ohm = inf, load_temperature_k = 290.0, dark_current_a = 0.0, intensity_noise_db_hz = -inf, rejection_db = 0.0, saturation_w = inf, half_power_hz = inf, poles = 1 }
telescope = { aperture_radius_m = 0.05, obscuration_radius_m = 0.0, beam_radius_m = 0.03, beam_radius_definition = "intensity", focus_m = inf, receiver = "monostatic", optics_loss_db = 0.0, reflection_db = -inf, blind_range_m = 0.0 }
atmosphere = { backscatter_per_m_sr = 1e-7, extinction_per_m = 7e-5 }
atmosphere.turbulence = { kind = "none", cn2_m_m23 = 1e-15, spectrum = "von_karman", inner_scale_m = 0.01, outer_scale_m = 1.0, realisations = 400 }
flow = { kind = "vortex_pair", circulation_m2_s = 500.0, spacing_m = 47.0, core_radius_m = 2.35, lateral_position_m = 400.0, height_m = 47.0, profile = "algebraic", motion = "frozen", age_tau = 0.0, cross_wind_m_s = 0.0 }
scan = { lidar_height_m = 0.0, azimuth_rad = 1.5707963267948966, elevation_min_rad = 0.0, elevation_max_rad = 0.2304, elevation_step_rad = 1.25e-3, range_min_m = 280.0, range_max_m = 520.0, pulses_per_line = 16, realisations = 4 }
scan.below_ground = { policy = "error" }
scan.pattern = { kind = "rhi" }
scan.head = { motion = "stepped", sweeps = 1, direction = "same", rate_rad_s = inf, acceleration_rad_s2 = inf, dead_time_s = 0.0 }
scan.lidar = { x_m = 0.0, y_m = 0.0, velocity_m_s = [0.0, 0.0, 0.0] }
scan.wind_of_pulses = { kind = "line" }
estimator = { window_samples = 64, weighting = "gaussian", window_step_samples = 1, gate_step_samples = 5, padded_samples = 1024, refinement = "parabola", radius_m = 2.0, false_alarm = 0.01 }
estimator.method = { kind = "periodogram_accumulation", order = 16, moment_reach = 3.5 }
estimator.radius = { kind = "fixed" }
outputs = { signals = false, signals_of = "first", flow = true, profile_range_min_m = 100.0, profile_range_max_m = 3000.0, profile_points = 59 }
site = { latitude_deg = 0.0, longitude_deg = 0.0, altitude_m = 0.0 }
"#;

/// Speed of light, m/s.
pub(crate) const C_M_S: f64 = 299_792_458.0;
/// Planck's constant, J s.
pub(crate) const H_J_S: f64 = 6.626_070_15e-34;
/// Charge of an electron, C.
pub(crate) const E_C: f64 = 1.602_176_634e-19;
/// Boltzmann's constant, J/K.
pub(crate) const K_J_K: f64 = 1.380_649e-23;

/// The keys that a draw states, as lines of TOML with dotted keys.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scene {
    keys: Vec<(String, String)>,
    /// The same, read.
    stated: OnceLock<Table>,
    /// The path of its pair, if that is transported.
    path: OnceLock<Option<Path>>,
}

impl Scene {
    /// States a number, a list or a table, as it stands in TOML.
    pub(crate) fn set(&mut self, key: &str, value: impl Display) -> &mut Self {
        self.stated = OnceLock::new();
        self.path = OnceLock::new();
        let value = value.to_string();
        match self.keys.iter_mut().find(|(known, _)| known == key) {
            Some((_, old)) => *old = value,
            None => self.keys.push((key.into(), value)),
        }
        self
    }

    /// States a number with a decimal point.
    pub(crate) fn number(&mut self, key: &str, value: f64) -> &mut Self {
        self.set(key, format!("{value:?}"))
    }

    /// States a word.
    pub(crate) fn word(&mut self, key: &str, value: &str) -> &mut Self {
        self.set(key, format!("\"{value}\""))
    }

    /// Takes a key, and all below it, back.
    pub(crate) fn unset(&mut self, key: &str) -> &mut Self {
        self.stated = OnceLock::new();
        self.path = OnceLock::new();
        self.keys
            .retain(|(known, _)| known != key && !known.starts_with(&format!("{key}.")));
        self
    }

    pub(crate) fn text(&self) -> String {
        self.keys
            .iter()
            .map(|(key, value)| format!("{key} = {value}\n"))
            .collect()
    }

    /// The value of a key: what is stated, else the default; nothing where there is neither.
    pub(crate) fn get(&self, key: &str) -> Option<Value> {
        static READ: LazyLock<Table> = LazyLock::new(|| dotted(DEFAULTS));
        let stated = self
            .stated
            .get_or_init(|| self.text().parse().unwrap_or_default());
        below(stated, key).or_else(|| below(&READ, key))
    }

    /// The path of the pair of its flow, if that decays and moves by the mean wind alone.
    pub(crate) fn path(&self) -> Option<&Path> {
        self.path.get_or_init(|| Path::of(self)).as_ref()
    }

    pub(crate) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// A number; NaN where there is none.
    pub(crate) fn f(&self, key: &str) -> f64 {
        self.get(key).and_then(|v| number(&v)).unwrap_or(f64::NAN)
    }

    /// A whole number.
    pub(crate) fn n(&self, key: &str) -> usize {
        self.f(key) as usize
    }

    /// A word; empty where there is none.
    pub(crate) fn s(&self, key: &str) -> String {
        self.get(key)
            .and_then(|v| v.as_str().map(str::to_owned))
            .unwrap_or_default()
    }

    /// Whether a key is stated as true.
    pub(crate) fn is_true(&self, key: &str) -> bool {
        self.get(key).and_then(|v| v.as_bool()) == Some(true)
    }

    /// A list of numbers.
    pub(crate) fn list(&self, key: &str) -> Vec<f64> {
        let list = self
            .get(key)
            .and_then(|v| v.as_array().cloned())
            .unwrap_or_default();
        list.iter().filter_map(number).collect()
    }
}

/// A table whose later lines add to the tables of earlier ones.
fn dotted(text: &str) -> Table {
    let mut out = Table::new();
    for line in text.lines().filter(|l| !l.is_empty()) {
        let (path, _) = line.split_once(" = ").unwrap_or_default();
        let one: Table = line.parse().unwrap_or_default();
        let Some(value) = below(&one, path) else {
            continue;
        };
        let mut at = &mut out;
        let mut parts: Vec<&str> = path.split('.').collect();
        let last = parts.pop().unwrap_or_default();
        for part in parts {
            let inner = at.entry(part).or_insert_with(|| Value::Table(Table::new()));
            let Value::Table(inner) = inner else {
                return out;
            };
            at = inner;
        }
        at.insert(last.into(), value);
    }
    out
}

fn below(table: &Table, key: &str) -> Option<Value> {
    match key.split_once('.') {
        Some((first, rest)) => below(table.get(first)?.as_table()?, rest),
        None => table.get(key).cloned(),
    }
}

fn number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|n| n as f64))
}
