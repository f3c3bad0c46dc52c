//! Error against run time of the whole chain: keys of a scene, one at a time, against a finer setting with the same seeds.
//!
//! The scene: half of Table 2's scan about the nearer vortex at 10 dB, four pulses a line, two realisations.

use super::{Row, few, mean_and_error};
use crate::cost::fastest;
use fixtures::failure::Failure;
use std::path::Path;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::run;
use wakescope_sim::scene::{Scene, SceneFile, SnrReference};
use wakescope_sim::setup::progress::Silent;

/// A key of the scene, its values, the value of the reference, and what is compared.
struct Knob {
    case: &'static str,
    key: &'static str,
    values: &'static [usize],
    reference: usize,
    set: fn(&mut Scene, usize),
    quantity: &'static str,
    /// Relative distance of a map from that of the reference.
    distance: fn(&VelocityEstimates, &VelocityEstimates) -> f64,
}

const KNOBS: [Knob; 3] = [
    Knob {
        case: "scene, padding",
        key: "estimator.padded_samples",
        values: &[128, 256, 512, 1024, 2048],
        reference: 8192,
        set: |scene, value| scene.estimator.padded_samples = value,
        quantity: "mean map, norm of the difference over the norm",
        distance: of_maps,
    },
    Knob {
        case: "scene, spacing of windows",
        key: "estimator.window_step_samples",
        values: &[16, 8, 4, 2],
        reference: 1,
        set: |scene, value| scene.estimator.window_step_samples = value,
        quantity: "mean map, norm of the difference over the norm",
        distance: of_maps,
    },
    Knob {
        case: "scene, realisations",
        key: "scan.realisations",
        values: &[2, 4, 8, 16, 32],
        reference: 128,
        set: |scene, value| scene.scan.realisations = value,
        quantity: "root mean square error over the map, relative",
        distance: of_errors,
    },
];

/// All measurements; few keys, values and seeds if `quick`.
pub(super) fn rows(quick: bool) -> Result<Vec<Row>, Failure> {
    let seeds = if quick { 2 } else { 5 };
    let mut rows = Vec::new();
    for knob in few(&KNOBS, quick) {
        let of = |value: usize, seed: u64| {
            let mut scene = scene(seed);
            (knob.set)(&mut scene, value);
            map(scene)
        };
        let fine = (0..seeds).map(|seed| of(knob.reference, seed)).collect::<Result<Vec<_>, _>>()?;
        for &value in few(knob.values, quick) {
            let (first, cost) = fastest(|| of(value, 0))?;
            let mut errors = vec![(knob.distance)(&first, &fine[0])];
            for (seed, fine) in fine.iter().enumerate().skip(1) {
                errors.push((knob.distance)(&of(value, seed as u64)?, fine));
            }
            let words = [knob.quantity, "the finest setting of the key, same seeds"];
            rows.push(Row::new(knob.case, knob.key, (knob.key, value as f64), mean_and_error(&errors), words, cost));
        }
    }
    Ok(rows)
}

fn scene(seed: u64) -> Scene {
    let mut scene = Scene { seed: seed + 1, ..Scene::default() };
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.11, 0.14);
    (scene.scan.range_min_m, scene.scan.range_max_m) = (330.0, 430.0);
    (scene.scan.pulses_per_line, scene.scan.realisations) = (4, 2);
    scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
    scene
}

fn map(scene: Scene) -> Result<VelocityEstimates, Failure> {
    let plan = Plan::new(SceneFile::parse(&scene.to_toml(), Path::new("chain.toml"))?, Target::Map)?;
    run::run(&plan, &Silent)?.map.ok_or_else(|| Failure::new("the plan gave no map".into()))
}

/// Norm of the difference of the mean maps over the norm of the reference, where both have an estimate.
fn of_maps(map: &VelocityEstimates, fine: &VelocityEstimates) -> f64 {
    let known = map.v_mean_m_s.iter().zip(&fine.v_mean_m_s).filter(|(a, b)| (*a + *b).is_finite());
    let (difference, norm) = known.fold((0.0, 0.0), |(d, n), (a, b)| (d + (a - b).powi(2), n + b * b));
    f64::sqrt(difference / norm)
}

/// Relative difference of the root mean square errors.
fn of_errors(map: &VelocityEstimates, fine: &VelocityEstimates) -> f64 {
    let rms = |map: &VelocityEstimates| {
        let known = map.rms_m_s.iter().filter(|e| e.is_finite());
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), e| (sum + e * e, count + 1.0));
        f64::sqrt(sum / count)
    };
    (rms(map) / rms(fine) - 1.0).abs()
}
