//! What a velocity of a file is of the air about its range, and how it was estimated: by a scene, as stated, or as files of this program
//! usually are.
//!
//! Check: the scene's pulse and window have the weight of the estimators; gates of files as rectangles and Gaussian pulses; files of one
//! run that keep their scene, its part or nothing, in the tests of the program.

use crate::Error;
use crate::SPEED_OF_LIGHT_M_S;
use crate::io::scans::ReadScan;
use crate::scene::{Scene, SceneFile};
use crate::setup::estimators;
use crate::setup::instrument::Instrument;
use std::path::Path;
use wakescope_estimate::retrieval::Gate;
use wakescope_estimate::vortex_fit::RangeKernel;

/// Points of the weight along the line, m.
const SPACING_M: f64 = 1.25;
/// Sampling of an instrument of which it is not known, Hz.
const WIDE_HZ: f64 = 500e6;
/// Root of 8 ln 2: width at half height of a Gaussian over its standard deviation.
const WIDTH_OVER_STD: f64 = 2.354_820_045_030_949_4;

/// What is told of gates whose weight is not wholly known.
const WITHOUT_PULSE: &str = "the file says nothing of the pulse: --gate-std states the weight of a gate";
const AT_POINTS: &str =
    "velocities are taken for those at points: --gate-std states the weight of a gate, or --scene the instrument";

/// The gate of a scan: as stated, else of the scene, else of what the file says; points if it says nothing, with the remedy.
///
/// # Errors
/// What the estimators refuse of a scene; a checked one gives none.
pub fn gate_of(
    scan: Option<&ReadScan>,
    stated_m: Option<f64>,
    scene: Option<&Scene>,
) -> Result<(Gate, Option<&'static str>), Error> {
    let pulse_width_s = scan.and_then(|scan| scan.pulse_width_s);
    let pulse_m = pulse_width_s.map(|width_s| 0.5 * SPEED_OF_LIGHT_M_S * width_s / WIDTH_OVER_STD);
    let window_m = scan.and_then(|scan| scan.gate_length_m).map(|length_m| length_m / 12f64.sqrt());
    Ok(match (stated_m, scene, pulse_m, window_m) {
        (Some(std_m), ..) => (of_std(std_m), None),
        (None, Some(scene), ..) => (of_scene(scene)?, None),
        (None, None, Some(pulse_m), window_m) => (of_std(pulse_m.hypot(window_m.unwrap_or(0.0))), None),
        (None, None, None, Some(window_m)) => (of_std(window_m), Some(WITHOUT_PULSE)),
        (None, None, None, None) => (Gate::Point, Some(AT_POINTS)),
    })
}

fn of_std(std_m: f64) -> Gate {
    if std_m > 0.0 { Gate::Gaussian { std_m } } else { Gate::Point }
}

/// Pulse and window of a scene.
fn of_scene(scene: &Scene) -> Result<Gate, Error> {
    let window = estimators::weighting(scene).weights(scene.estimator.window_samples)?;
    let sigma_s = Instrument::new(scene)?.pulse.sigma_s();
    let period_s = 1.0 / scene.detector.sampling_hz;
    Ok(Gate::Kernel(RangeKernel::gaussian_gate(sigma_s, &window, period_s, SPACING_M)?))
}

/// What is stated of an instrument in place of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StatedEstimator {
    /// Name of the method, as in scenes.
    pub method: Option<String>,
    /// Full width of the pulse at half its maximum, s; of the file without it.
    pub pulse_s: Option<f64>,
    /// Length of the window, s; of the gates of the file without it.
    pub window_s: Option<f64>,
    /// Weighting of the window, as in scenes.
    pub weighting: Option<String>,
}

/// The scene that a file of this program has in it.
///
/// # Errors
/// A scene that this program does not read, with the key and the remedy.
pub fn scene_of(scan: &ReadScan) -> Result<Option<SceneFile>, Error> {
    let Some(toml) = &scan.scene_toml else { return Ok(None) };
    SceneFile::parse(toml, &scan.path).map(Some).map_err(|error| Error::Input {
        path: scan.path.clone(),
        reason: format!("the scene in it is none that this program reads: {error}; --scene states another"),
    })
}

/// A scene with what is stated, else with what the file says, else with the defaults, at a high signal-to-noise ratio.
///
/// # Errors
/// Words and numbers that no scene may have.
pub fn stated_scene(scan: &ReadScan, stated: &StatedEstimator) -> Result<SceneFile, Error> {
    let mut text = String::from("detector.snr.reference = \"fixed\"\ndetector.snr.snr_db = 10.0\n");
    let mut state = |key: &str, value: Option<String>| {
        text.extend(value.map(|value| format!("{key} = {value}\n")));
    };
    let word = |word: &str| Some(format!("{word:?}"));
    let number = |value: f64| Some(format!("{value:?}"));
    state("pulse.shape.duration_s", stated.pulse_s.or(scan.pulse_width_s).and_then(number));
    if let Some(method) = &stated.method {
        let gate_s = scan.gate_length_m.map(|length_m| 2.0 * length_m / SPEED_OF_LIGHT_M_S);
        let samples = |seconds: f64| Some(((seconds * WIDE_HZ).round().max(1.0) as u64).to_string());
        state("estimator.method.kind", word(method));
        state("estimator.window_samples", stated.window_s.or(gate_s).and_then(samples));
        state("estimator.weighting", word(stated.weighting.as_deref().unwrap_or("rectangular")));
        // Gates of one line each, and a band that is wide enough for all instruments.
        state("estimator.radius_m", number(0.0).filter(|_| method != "periodogram"));
        state("estimator.padded_samples", Some("4096".into()));
        state("detector.sampling_hz", number(WIDE_HZ));
        state("detector.intermediate_frequency_hz", number(0.25 * WIDE_HZ));
        state("detector.bandwidth_hz", number(0.4 * WIDE_HZ));
    }
    Ok(SceneFile::parse(&text, Path::new("what --estimator, --pulse, --window and --weighting state"))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;
    use wakescope_estimate::retrieval::ScanMap;

    #[test]
    fn gates_are_stated_or_those_of_the_file() {
        let map = ScanMap {
            elevation_rad: vec![],
            time_s: vec![],
            range_m: vec![],
            velocity_m_s: ndarray::Array2::zeros((0, 0)),
            sigma_m_s: None,
            fold_m_s: None,
        };
        let mut scan = ReadScan {
            path: PathBuf::new(),
            sweep: 0,
            map,
            reference: None,
            gate_length_m: None,
            pulse_width_s: None,
            scene_toml: None,
            is_own: false,
            scans: 1.0,
        };
        let std_m = |scan: &ReadScan, stated| match gate_of(Some(scan), stated, None).unwrap() {
            (Gate::Gaussian { std_m }, told) => (std_m, told.is_some()),
            (_, told) => (0.0, told.is_some()),
        };
        assert_eq!(std_m(&scan, None), (0.0, true));
        assert_eq!((std_m(&scan, Some(0.0)), std_m(&scan, Some(14.4))), ((0.0, false), (14.4, false)));
        scan.gate_length_m = Some(30.0);
        assert_eq!(std_m(&scan, None), (30.0 / 12f64.sqrt(), true));
        scan.pulse_width_s = Some(200e-9);
        // 200 ns at half height are 12.73 m of standard deviation.
        assert!((std_m(&scan, None).0 - 12.73f64.hypot(8.66)).abs() < 0.01);
    }
}
