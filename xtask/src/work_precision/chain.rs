//! Error against run time of the whole chain: keys of a scene, one at a time, against a finer setting with the same seeds.
//!
//! The scene: half of Table 2's scan about the nearer vortex at 10 dB, four pulses a line, two realisations.

use super::{Found, Knob, Row, few};
use crate::cost::fastest;
use crate::statistics::{Estimate, mean};
use fixtures::failure::Failure;
use std::path::Path;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::run;
use wakescope_sim::scene::{Scene, SceneFile, SnrReference};
use wakescope_sim::setup::progress::Silent;

pub(super) const CASE: &str = "one whole map";

/// Relative distance of a map from that of the reference.
type Distance = fn(&VelocityEstimates, &VelocityEstimates) -> f64;

const MAPS: (&str, Distance) = ("mean map, norm of the difference over the norm", of_maps);
const ERRORS: (&str, Distance) = ("root mean square error over the map, relative", of_errors);

/// A key, how it is set, its values, that of the reference, and what is compared.
type Key = (&'static str, fn(&mut Scene, usize), &'static [f64], usize, (&'static str, Distance));

const KEYS: [Key; 3] = [
    (
        "estimator.padded_samples",
        |scene, value| scene.estimator.padded_samples = value,
        &[128.0, 256.0, 512.0, 1024.0, 2048.0],
        8192,
        MAPS,
    ),
    (
        "estimator.window_step_samples",
        |scene, value| scene.estimator.window_step_samples = value,
        &[16.0, 8.0, 4.0, 2.0],
        1,
        MAPS,
    ),
    ("scan.realisations", |scene, value| scene.scan.realisations = value, &[2.0, 4.0, 8.0, 16.0, 32.0], 128, ERRORS),
];

/// All measurements; few keys, values and seeds if `quick`.
pub(super) fn rows(quick: bool) -> Result<Vec<Row>, Failure> {
    let seeds = if quick { 2 } else { 5 };
    let mut rows = Vec::new();
    for &(key, set, values, finest, (metric, distance)) in if quick { &KEYS[..2] } else { &KEYS[..] } {
        let fine = (0..seeds).map(|seed| map(seed, set, finest)).collect::<Result<Vec<_>, _>>()?;
        let knob = Knob::new([CASE, key, "", metric, "the finest setting of the key, same seeds"]);
        rows.extend(knob.rows(few(values, quick), |value| {
            let (first, cost) = fastest(|| map(0, set, value as usize))?;
            let mut errors = vec![distance(&first, &fine[0])];
            for (seed, fine) in fine.iter().enumerate().skip(1) {
                errors.push(distance(&map(seed as u64, set, value as usize)?, fine));
            }
            let found = Estimate::mean(&errors);
            Ok(Found { error: found.value, standard_error: found.standard_error, cost, set_up_s: 0.0 })
        })?);
    }
    Ok(rows)
}

/// The map of the scene with a key set.
fn map(seed: u64, set: fn(&mut Scene, usize), value: usize) -> Result<VelocityEstimates, Failure> {
    let mut scene = Scene { seed: seed + 1, ..Scene::default() };
    (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.11, 0.14);
    (scene.scan.range_min_m, scene.scan.range_max_m) = (330.0, 430.0);
    (scene.scan.pulses_per_line, scene.scan.realisations) = (4, 2);
    scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
    set(&mut scene, value);
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
        let known: Vec<f64> = map.rms_m_s.iter().filter(|e| e.is_finite()).map(|e| e * e).collect();
        mean(&known, None).sqrt()
    };
    (rms(map) / rms(fine) - 1.0).abs()
}
