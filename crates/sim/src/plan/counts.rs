//! Counts of everything that a run works on, for forecasts of its memory and time.
//!
//! All are floating-point numbers: products of what a scene allows exceed the largest integer.

use super::stage::Target;
use crate::plan::geometry::Geometry;
use crate::scene::{DetectorSignal, Scene, SignalsOf};

/// Counts of one run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Counts {
    /// Lines of sight.
    pub(crate) lines: f64,
    /// Records of one realisation.
    pub(crate) records: f64,
    /// Samples of a record.
    pub(crate) samples: f64,
    /// Real numbers of a sample: 2 for two quadratures.
    pub(crate) parts: f64,
    /// Scattering layers of a line.
    pub(crate) layers: f64,
    /// Those of most signals, which may be thicker.
    pub(crate) signal_layers: f64,
    /// Layers of most signals that contribute to one sample.
    pub(crate) layers_per_sample: f64,
    /// Realisations.
    pub(crate) realisations: f64,
    /// Points of the map.
    pub(crate) cells: f64,
    /// Realisations whose raw signals are kept for the files.
    pub(crate) kept: f64,
    /// Threads of the pool in which the run is planned.
    pub(crate) threads: f64,
}

impl Counts {
    /// Those of a scene with its geometry.
    pub(crate) fn new(scene: &Scene, target: Target, g: &Geometry) -> Self {
        let lines = g.elevation_rad.len() as f64;
        let thicker = g.signal_layer_thickness_m / g.layer_thickness_m;
        let kept = kept_realisations(scene, target) as f64;
        Self {
            lines,
            records: g.schedule.pulses() as f64,
            samples: g.samples as f64,
            parts: match scene.detector.signal {
                DetectorSignal::IntermediateFrequency => 1.0,
                DetectorSignal::Baseband => 2.0,
            },
            layers: g.layers as f64,
            signal_layers: (g.layers as f64 / thicker).ceil(),
            layers_per_sample: (g.layers_per_sample as f64 / thicker).ceil(),
            realisations: if target.has_map() {
                scene.scan.realisations as f64
            } else {
                kept
            },
            cells: lines * g.gate_range_m.len() as f64,
            kept,
            threads: rayon::current_num_threads() as f64,
        }
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
