//! What a velocity of a file is of the air about its range: as stated, by a scene, or as the file says.
//!
//! Check: the scene's pulse and window have the weight of the estimators; gates of files as rectangles and Gaussian pulses; files of one
//! run that keep their scene, its part or nothing, in the tests of the program.

use crate::Error;
use crate::SPEED_OF_LIGHT_M_S;
use crate::io::scans::ReadScan;
use crate::scene::{Scene, SceneFile};
use crate::setup::estimators;
use crate::setup::instrument::Instrument;
use wakescope_estimate::retrieval::Gate;
use wakescope_estimate::vortex_fit::RangeKernel;

/// Points of the weight along the line, m.
const SPACING_M: f64 = 1.25;
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
