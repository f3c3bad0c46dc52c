//! Where and when the lidar looks: lines of sight, samples, gates and scattering layers of a scene.
//!
//! Only arithmetic on the scene, so that the plan can state sizes before anything is allocated.

use crate::Error;
use crate::SPEED_OF_LIGHT_M_S;
use crate::beams::Schedule;
use crate::plan::scan_lines;
use crate::plan::wind::SceneWind;
use crate::scene::{Scene, SceneFile, WindOfPulses};
use wakescope_signal::{LayerLimits, Pulse};

/// Layers of scenes with a transported pair are this many times as thick as the rule of [`Pulse::layer_thickness_m`] has them, that is
/// `D = lambda/(8 sigma g)`. In a gradient `g` all along a pulse a sum over layers misses `exp(-(lambda/(4 sigma g D))^2)` of the power
/// in the covariance of a record of a Gaussian pulse, 2 % (`measure/scan/layers.rs`); in a core, which is smaller than the pulse, less.
const TRANSPORTED_THICKNESS: f64 = 2.0;
/// Numbers of samples that layers may hold where winds change little along a line.
const SAMPLES_PER_LAYER: [f64; 2] = [4.0, 2.0];
/// Layers of several samples are at most this fraction of the shortest wavelength of eddies. Sampled at these distances waves keep
/// their variance, and appear at most 1/(1/0.6 - 1) = 1.5 times as long as the shortest (`measure/scan/layers.rs`).
const EDDY_FRACTION: f64 = 0.6;

/// The sampling of one scan in angle, range and time.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    /// The lines of sight and the beams of their pulses.
    pub schedule: Schedule,
    /// Elevation of the middle of each line of sight, rad.
    pub elevation_rad: Vec<f64>,
    /// Time of the middle of the pulses of each line, s from the start of the scan.
    pub line_time_s: Vec<f64>,
    /// Samples recorded of each pulse.
    pub samples: usize,
    /// Distance between samples c T_s/2, m.
    pub sample_spacing_m: f64,
    /// Range of the first sample, m.
    pub first_sample_m: f64,
    /// Range of each gate of the map, that is of the centre of its window, m.
    pub gate_range_m: Vec<f64>,
    /// Thickness of the scattering layers, m.
    pub layer_thickness_m: f64,
    /// Thickness of the layers of most signals, m: where lines have their own, that of lines far from any vortex core.
    pub(crate) signal_layer_thickness_m: f64,
    /// Range of the first layer, m.
    pub first_layer_range_m: f64,
    /// Number of layers of a line.
    pub layers: usize,
    /// Layers that contribute to one sample, 2 L_c + 1 for a Gaussian pulse.
    pub layers_per_sample: usize,
}

impl Geometry {
    /// The sampling of a checked scene; the layers are as thin as its steepest wind needs.
    ///
    /// # Errors
    /// What the wind or the layers refuse, which is nothing for a checked scene; a list of lines that cannot be read or followed,
    /// beams below the ground.
    pub fn new(file: &SceneFile, pulse: &Pulse, wind: &SceneWind) -> Result<Self, Error> {
        let (scene, scan) = (&file.content, &file.content.scan);
        let schedule = scan_lines::schedule(file)?;
        let middles: Vec<_> = (0..schedule.lines.len())
            .map(|line| schedule.middle(line))
            .collect();
        let line_time_s: Vec<f64> = middles.iter().map(|beam| beam.time_s).collect();
        let max_gradient_per_s = wind.max_gradient_per_s(&wind_times_s(scene, &schedule));
        let sample_spacing_m = scene.sample_spacing_m();
        let samples = scene.samples_per_record();
        let window = scene.estimator.window_samples;
        let first_samples = (0..=samples - window).step_by(scene.estimator.gate_step_samples);
        // Windows are indexed by their centre, R = c (t_p + N T_s/2)/2.
        let centre_m = |first: usize| {
            scan.range_min_m + (first as f64 + 0.5 * window as f64) * sample_spacing_m
        };
        let limits = layer_limits(scene, max_gradient_per_s);
        let layer_thickness_m = pulse.layer_thickness_m(limits)?;
        let signal_layer_thickness_m = match scene.has_layers_of_each_line() {
            true => signal_layer_thickness_m(scene, pulse, 0.0)?,
            false => layer_thickness_m,
        };
        // Layers before and behind the range of a sample that the pulse lights.
        let (first_s, last_s) = pulse.support_s();
        let reach = |time_s: f64| {
            (time_s * 0.5 * SPEED_OF_LIGHT_M_S / layer_thickness_m)
                .max(0.0)
                .ceil() as usize
        };
        let (near, far) = (reach(last_s), reach(-first_s));
        let layers_per_sample = near.saturating_add(far).saturating_add(1);
        let record_m = (samples - 1) as f64 * sample_spacing_m;
        Ok(Self {
            elevation_rad: middles.iter().map(|beam| beam.elevation_rad).collect(),
            schedule,
            line_time_s,
            samples,
            sample_spacing_m,
            first_sample_m: scan.range_min_m,
            gate_range_m: first_samples.map(centre_m).collect(),
            layer_thickness_m,
            signal_layer_thickness_m,
            first_layer_range_m: scan.range_min_m - near as f64 * layer_thickness_m,
            layers: ((record_m / layer_thickness_m).ceil() as usize)
                .saturating_add(layers_per_sample),
            layers_per_sample,
        })
    }

    /// Centre of each layer along a line, m.
    pub fn layer_range_m(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.layers).map(|l| self.first_layer_range_m + l as f64 * self.layer_thickness_m)
    }
}

/// Times from the start of the scan for which a wind is asked, s: the middle of each line, or its first and last pulse where pulses have
/// winds of their own.
pub(crate) fn wind_times_s(scene: &Scene, schedule: &Schedule) -> Vec<f64> {
    match scene.scan.wind_of_pulses {
        WindOfPulses::Line {} => (0..schedule.lines.len())
            .map(|line| schedule.middle(line).time_s)
            .collect(),
        WindOfPulses::Pulse {} => schedule.ends().map(|beam| beam.time_s).collect(),
    }
}

/// Limits of the layers of a scene in a wind with this gradient, 1/s.
pub(crate) fn layer_limits(scene: &Scene, max_gradient_per_s: f64) -> LayerLimits {
    let thicker = if scene.has_transported_pair() {
        TRANSPORTED_THICKNESS
    } else {
        1.0
    };
    LayerLimits {
        sample_rate_hz: scene.detector.sampling_hz,
        wavelength_m: scene.laser.wavelength_m,
        max_gradient_per_s: max_gradient_per_s / thicker,
    }
}

/// Thickness of the layers of the signals of a line with this steepest wind, 1/s: a few samples where that wind and the smallest eddies
/// allow it.
///
/// # Errors
/// As [`Pulse::layer_thickness_m`].
pub(crate) fn signal_layer_thickness_m(
    scene: &Scene,
    pulse: &Pulse,
    steepest_per_s: f64,
) -> Result<f64, Error> {
    let limits = layer_limits(scene, steepest_per_s);
    let most_m = match scene.eddies() {
        Some(eddies) => EDDY_FRACTION * eddies.smallest_m,
        None => f64::INFINITY,
    };
    for samples in SAMPLES_PER_LAYER {
        let thickness_m = pulse.layer_thickness_m(LayerLimits {
            sample_rate_hz: limits.sample_rate_hz / samples,
            ..limits
        })?;
        let is_whole = thickness_m > 0.999 * samples * scene.sample_spacing_m();
        if is_whole && thickness_m <= most_m {
            return Ok(thickness_m);
        }
    }
    Ok(pulse.layer_thickness_m(limits)?)
}
