//! What is known of how the velocities of a file were estimated: by a scene, as stated, or as files of this program usually are.
//!
//! Check: files of one run that keep their scene, its part or nothing, in the tests of the program.

use crate::Error;
use crate::io::scans::ReadScan;
use crate::scene::SceneFile;
use std::path::Path;

/// Sampling of an instrument of which it is not known, Hz.
const WIDE_HZ: f64 = 500e6;

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
        let gate_s = scan.gate_length_m.map(|length_m| 2.0 * length_m / crate::SPEED_OF_LIGHT_M_S);
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
