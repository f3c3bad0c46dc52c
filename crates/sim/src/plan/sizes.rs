//! How many there are of everything that a run works on, from the scene alone.
//!
//! All are floating-point numbers: products of what a scene may say go far beyond what an integer holds.

use super::stage::Target;
use crate::measure::efficiency_model::drawn_turbulence;
use crate::plan::geometry::Geometry;
use crate::scene::{DetectorSignal, Flow, Scene, SignalsOf};

/// Fields of a map of estimates.
pub(super) const MAP_FIELDS: f64 = 16.0;

/// Numbers of things in one run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sizes {
    /// Lines of sight.
    pub(super) lines: f64,
    /// Records of one realisation.
    pub(super) records: f64,
    /// Samples of a record.
    pub(super) samples: f64,
    /// Real numbers of a sample: 2 for two quadratures.
    pub(super) parts: f64,
    /// Scattering layers of a line.
    pub(super) layers: f64,
    /// Layers that contribute to one sample.
    pub(super) layers_per_sample: f64,
    /// Realisations.
    pub(super) realisations: f64,
    /// Samples of a window.
    pub(super) window: f64,
    /// Samples of the longest record whose covariance a bound takes: of the windows of a chord, or so many that more tell nothing new.
    pub(super) chord: f64,
    /// Windows of a record.
    pub(super) windows: f64,
    /// Real numbers that are kept of a window.
    pub(super) numbers: f64,
    /// Points of the map.
    pub(super) cells: f64,
    /// Frequencies at which a spectrum is sought for its peak.
    pub(super) frequencies: f64,
    /// Lines of sight that a region touches in the middle of the scan.
    pub(super) chords: f64,
    /// Realisations whose raw signals are kept for the files.
    pub(super) kept: f64,
    /// Realisations of the efficiency from which pulses take theirs.
    pub(super) drawn: f64,
    /// Threads of the pool in which the run is planned.
    pub(super) threads: f64,
}

impl Sizes {
    pub(super) fn new(scene: &Scene, target: Target, g: &Geometry) -> Self {
        let (e, d) = (&scene.estimator, &scene.detector);
        let lines = g.elevation_rad.len() as f64;
        let parts = if d.signal == DetectorSignal::Baseband {
            2.0
        } else {
            1.0
        };
        let window = e.window_samples as f64;
        let maps = matches!(target, Target::Run | Target::Map);
        let middle_m = g
            .gate_range_m
            .get(g.gate_range_m.len() / 2)
            .copied()
            .unwrap_or(1.0);
        let radius_m = g
            .gate_range_m
            .iter()
            .map(|range_m| e.largest_radius_m(*range_m))
            .fold(0.0, f64::max);
        let half_rad = if radius_m < middle_m {
            (radius_m / middle_m).asin()
        } else {
            std::f64::consts::PI
        };
        let samples_kept =
            window + g.layers_per_sample as f64 * g.layer_thickness_m / g.sample_spacing_m;
        Self {
            lines,
            records: g.schedule.pulses() as f64,
            samples: g.samples as f64,
            parts,
            layers: g.layers as f64,
            layers_per_sample: g.layers_per_sample as f64,
            realisations: if maps {
                scene.scan.realisations
            } else {
                kept_realisations(scene, target)
            } as f64,
            window,
            chord: (window + 2.0 * radius_m / g.sample_spacing_m).min(samples_kept.max(256.0)),
            windows: ((g.samples - e.window_samples) / e.window_step_samples + 1) as f64,
            numbers: parts * e.few_lags().map_or(window, |lags| lags as f64),
            cells: lines * g.gate_range_m.len() as f64,
            frequencies: e.padded_samples as f64 * d.bandwidth_hz / d.sampling_hz,
            chords: (2.0 * half_rad / step_rad(scene, g) + 1.0).min(lines),
            kept: kept_realisations(scene, target) as f64,
            drawn: drawn_turbulence(scene).map_or(0.0, |t| t.realisations as f64),
            threads: rayon::current_num_threads() as f64,
        }
    }
}

/// Angle between lines that follow each other, rad; half a turn where no two share a region.
fn step_rad(scene: &Scene, g: &Geometry) -> f64 {
    match &g.schedule.lines[..] {
        _ if g.schedule.is_plane() => scene.scan.elevation_step_rad,
        [first, second, ..] if first.group == second.group => {
            let [a, b] = [0, 1].map(|line| g.schedule.middle(line).direction);
            a.cos_sin_to(&b).1.max(1e-7)
        }
        _ => std::f64::consts::PI,
    }
}

/// Realisations whose raw signals are kept for the files.
pub(super) fn kept_realisations(scene: &Scene, target: Target) -> usize {
    let keeps = match target {
        Target::Signal => true,
        Target::Run => scene.outputs.signals,
        Target::Efficiency | Target::Map => false,
    };
    match scene.outputs.signals_of {
        _ if !keeps => 0,
        SignalsOf::First => 1,
        SignalsOf::All => scene.scan.realisations,
    }
}

/// Whether the air is at rest everywhere.
pub(super) fn is_calm(scene: &Scene) -> bool {
    matches!(scene.flow, Flow::Calm {}) && scene.added_flows.is_empty()
}
