//! Time of a run on one core: what takes nearly all of it, counted and multiplied by unit costs. Good to a factor of two.

use super::sizes::Sizes;
use super::stage::Target;
use crate::scene::{Flow, Method, RegionRadius, RetrievalMethod, Scene, WindOfPulses};

/// Time of a run on one core whose optics take `optics_s`, s; at least that of small files.
pub(super) fn core_s(scene: &Scene, target: Target, n: &Sizes, optics_s: f64) -> f64 {
    let wind_of = |flow: &Flow| match flow {
        Flow::Simulated(_) | Flow::Fields(_) => 4e-7,
        _ => 7e-8,
    };
    let wind_s = std::iter::once(&scene.flow)
        .chain(&scene.added_flows)
        .map(wind_of)
        .sum::<f64>();
    let airs_per_line = match scene.scan.wind_of_pulses {
        WindOfPulses::Line {} => 1,
        WindOfPulses::Pulse {} => scene.scan.pulses_per_line,
    };
    let airs = n.lines * airs_per_line as f64;
    let record_s = n.layers * 5.4e-8 + n.samples * (n.layers_per_sample * 1.2e-10 + 5e-8);
    let kept_s = n.kept * n.records * n.samples * n.parts * 4e-8;
    let signals_s = n.realisations * (n.records * record_s + airs * n.layers * wind_s) + kept_s;
    let maps_s = if matches!(target, Target::Run | Target::Map) {
        maps_s(scene, n)
    } else {
        0.0
    };
    let retrieval_s = if target == Target::Run {
        retrieval_s(scene, n, record_s)
    } else {
        0.0
    };
    0.01 + optics_s + signals_s + maps_s + retrieval_s
}

/// Estimates, their errors, and the files of them.
fn maps_s(scene: &Scene, n: &Sizes) -> f64 {
    let e = &scene.estimator;
    let numbers_s = n.numbers * 6e-9;
    let spectrum_s = n.frequencies * (6e-9 + n.numbers.min(n.window) * 6e-11);
    // Of a window and of a point, and covariances that are decomposed.
    let (window_s, point_s, covariances) = match e.method {
        Method::Likelihood { .. } => {
            // As many tapers as a window has independent parts, about.
            let parts = n.window / (scene.detector.sampling_hz * scene.pulse_sigma_s()).max(1.0);
            (numbers_s * (2.0 + 0.5 * parts), spectrum_s, 1.0)
        }
        _ => (numbers_s, spectrum_s, 0.0),
    };
    let points_s = n.cells * n.realisations * (n.chords * n.numbers * 5e-9 + point_s);
    let bounded = if matches!(e.radius, RegionRadius::Target { .. }) {
        n.chord.powi(3)
    } else {
        0.0
    };
    let planned_s = 4e-8 * (covariances * n.window.powi(3) + bounded);
    let pictures_s = 0.25 * f64::from(u8::from(scene.outputs.svg) + u8::from(scene.outputs.png));
    n.realisations * n.records * n.windows * window_s
        + points_s
        + planned_s
        + n.cells * 3e-6
        + pictures_s
}

/// Of a fit to what an estimator shows, for each velocity of the map; of one to signals, for each sample.
const FIT_S: f64 = 2e-4;
const SIGNAL_FIT_S: f64 = 3e-4;

/// Vortices of every realisation, and the test for a wake, if the scene asks for them.
fn retrieval_s(scene: &Scene, n: &Sizes, record_s: f64) -> f64 {
    let Some(wanted) = &scene.retrieval else {
        return 0.0;
    };
    // The fit of the map is made once for all that need it.
    let map_s = if wanted.methods[..] == [RetrievalMethod::Rv] {
        n.cells * 2e-5
    } else {
        n.cells * FIT_S
    };
    let sample_s = if wanted.methods.contains(&RetrievalMethod::Signals) {
        SIGNAL_FIT_S
    } else {
        0.0
    };
    let test_s = if wanted.false_alarm.is_some() {
        3.0
    } else {
        0.0
    };
    n.realisations * (map_s + n.records * (n.samples * sample_s + record_s)) + test_s
}
