//! Retrieval of one map: what its velocities are of the air about their ranges, as stated, by a scene, or as the file says; how it is
//! fitted; the fit.
//!
//! Check: the scene's pulse and window have the weight of the estimators; gates of files as rectangles and Gaussian pulses; files of one
//! run that keep their scene, its part or nothing, in the tests of the program.

use super::table::{RetrievedScan, refused};
use crate::io::scans::ReadScan;
use crate::plan::instrument::Instrument;
use crate::progress::Observer;
use crate::scene::{RetrievalMethod as Method, RetrievalTurbulence, Scene, SceneFile};
use crate::{Error, SPEED_OF_LIGHT_M_S};
use std::path::Path;
use wakescope_estimate::retrieval::{
    Gate, RetrievalOptions, Turbulence, Velocities, fit_scan, radial_velocity_method,
    without_implausible_vortices,
};
use wakescope_estimate::vortex_fit::{CorePrior, RangeKernel, Sharing, WakeModel};

/// Standard deviation of the weight of gates that do not show cores, m.
const LONG_GATE_M: f64 = 3.0;

/// Distance of the points of the weight along the line, m; between a least and a largest number of them in a gate of a file.
const SPACING_M: f64 = 1.25;
const POINTS: (f64, f64) = (8.0, 32.0);
/// Root of 8 ln 2: width at half height of a Gaussian over its standard deviation.
pub(crate) const WIDTH_OVER_STD: f64 = 2.354_820_045_030_949_4;

/// What is told of gates whose weight is not wholly known.
const WITHOUT_PULSE: &str =
    "the file says nothing of the pulse: --gate-std states the weight of a gate";
const AT_POINTS: &str = "velocities are taken for those at points: --gate-std states the weight of a gate, or --scene the instrument";

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
    let gate_length_m = scan.and_then(|scan| scan.gate_length_m);
    gate_of_instrument(pulse_width_s, gate_length_m, stated_m, scene)
}

/// The gate of an instrument: as stated, else of the scene, else of its pulse and the length of its gates; points if nothing is known,
/// with the remedy.
///
/// # Errors
/// As [`gate_of`].
pub fn gate_of_instrument(
    pulse_width_s: Option<f64>,
    gate_length_m: Option<f64>,
    stated_m: Option<f64>,
    scene: Option<&Scene>,
) -> Result<(Gate, Option<&'static str>), Error> {
    // Some files state 0 where they know no length.
    let gate_length_m = gate_length_m.filter(|length_m| *length_m > 0.0);
    let pulse_m = pulse_width_s.map(|width_s| 0.5 * SPEED_OF_LIGHT_M_S * width_s / WIDTH_OVER_STD);
    Ok(match (stated_m, scene, pulse_m, gate_length_m) {
        (Some(std_m), ..) => (of_std(std_m), None),
        (None, Some(scene), ..) => (of_scene(scene)?, None),
        (None, None, Some(pulse_m), None) => (of_std(pulse_m), None),
        (None, None, Some(pulse_m), Some(length_m)) => (rectangle(pulse_m, length_m)?, None),
        (None, None, None, Some(length_m)) => (rectangle(0.0, length_m)?, Some(WITHOUT_PULSE)),
        (None, None, None, None) => (Gate::Point, Some(AT_POINTS)),
    })
}

fn of_std(std_m: f64) -> Gate {
    if std_m > 0.0 {
        Gate::Gaussian { std_m }
    } else {
        Gate::Point
    }
}

/// A gate of that length behind a pulse.
fn rectangle(pulse_std_m: f64, length_m: f64) -> Result<Gate, Error> {
    let whole_m = length_m.max(WIDTH_OVER_STD * pulse_std_m);
    let spacing_m = SPACING_M.clamp(whole_m / POINTS.1, whole_m / POINTS.0);
    let kernel = RangeKernel::rectangular_gate(pulse_std_m, length_m, spacing_m)?;
    Ok(Gate::Kernel(kernel))
}

/// Pulse and window of a scene.
fn of_scene(scene: &Scene) -> Result<Gate, Error> {
    let window = scene.weighting().weights(scene.estimator.window_samples)?;
    let sigma_s = Instrument::new(scene)?.pulse.sigma_s();
    let period_s = 1.0 / scene.detector.sampling_hz;
    Ok(Gate::Kernel(RangeKernel::gaussian_gate(
        sigma_s, &window, period_s, SPACING_M,
    )?))
}

/// The scene that a file of this program has in it; the observer is warned of keys that are skipped.
///
/// # Errors
/// A scene that this program does not read, with the key and the remedy.
pub fn scene_of(scan: &ReadScan, observer: &dyn Observer) -> Result<Option<SceneFile>, Error> {
    scene_in_file(&scan.path, scan.scene_toml.as_deref(), observer)
}

/// The scene of this program that a file has as a text; the observer is warned of keys that are skipped.
///
/// # Errors
/// As [`scene_of`].
pub fn scene_in_file(
    path: &Path,
    toml: Option<&str>,
    observer: &dyn Observer,
) -> Result<Option<SceneFile>, Error> {
    let Some(toml) = toml else {
        return Ok(None);
    };
    let (scene, warning) = SceneFile::embedded(toml, path).map_err(|error| Error::Input {
        path: path.to_owned(),
        reason: format!(
            "the scene in it is none that this program reads: {error}; --scene states another"
        ),
    })?;
    warning.iter().for_each(|text| observer.warn(text));
    Ok(Some(scene))
}

/// How scans are retrieved: with the ground, the profile and the secondary vortices of the scene, if it is known; cores are fitted
/// unless one is to be kept.
pub fn options(scene: Option<&Scene>, gate: Gate, core_radius_m: Option<f64>) -> RetrievalOptions {
    let pair = scene.and_then(|scene| scene.flow.pair());
    let profile = pair.map(|pair| pair.profile);
    // Long gates do not show cores: without what is known of them they run away with the circulation.
    let is_short = gate.std_m() <= LONG_GATE_M;
    let lidar_height_m = scene.map_or(0.0, |scene| scene.scan.lidar_height_m);
    let wanted = scene.and_then(|scene| scene.retrieval.as_ref());
    let mut options = RetrievalOptions {
        model: WakeModel {
            profile: profile.unwrap_or_default(),
            lidar_height_m,
            ..WakeModel::default()
        },
        gate,
        core_radius_m,
        core_prior: (!is_short).then_some(CorePrior::TYPICAL),
        other_profile: profile.is_none(),
        secondary: wanted.map(|wanted| wanted.secondary).unwrap_or_default(),
        ..RetrievalOptions::default()
    };
    if wanted.is_some_and(|wanted| wanted.turbulence == RetrievalTurbulence::Auto) {
        options.turbulence = Some(Turbulence::OfScan);
    }
    if core_radius_m.is_some() {
        options.free.core_radius = Sharing::Fixed;
    }
    options
}

/// Retrieves one map. Secondary vortices that the map shows are in the options that come back. Vortices that no aircraft makes are no wake; the text
/// says why.
///
/// # Errors
/// What the fits refuse, with the file and the sweep.
pub fn retrieve_map(
    scan: ReadScan,
    method: Method,
    mut options: RetrievalOptions,
    velocities: Velocities<'_>,
) -> Result<(RetrievedScan, Option<String>), Error> {
    let fitted = if method == Method::Rv {
        radial_velocity_method(&scan.map, &options)
    } else {
        fit_scan(&scan.map, velocities, &options)
    };
    let mut result = fitted.map_err(|error| refused(&scan, &error))?;
    options.model = result.model;
    let reason = without_implausible_vortices(&mut result, &scan.map, &options.model);
    let found = RetrievedScan {
        scan,
        options,
        result,
    };
    Ok((found, reason))
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let mut scan = ReadScan::new(Path::new(""), 0, map);
        let std_m = |scan: &ReadScan, stated| {
            let (gate, remark) = gate_of(Some(scan), stated, None).unwrap();
            (gate.std_m(), remark.is_some())
        };
        assert_eq!(std_m(&scan, None), (0.0, true));
        assert_eq!(
            (std_m(&scan, Some(0.0)), std_m(&scan, Some(14.4))),
            ((0.0, false), (14.4, false))
        );
        scan.gate_length_m = Some(30.0);
        let (of_rectangle_m, has_remark) = std_m(&scan, None);
        assert!((of_rectangle_m - 30.0 / 12f64.sqrt()).abs() < 0.05 && has_remark);
        scan.gate_length_m = Some(3.0);
        let (of_short_m, _) = std_m(&scan, None);
        assert!(
            (of_short_m - 3.0 / 12f64.sqrt()).abs() < 0.02,
            "{of_short_m}"
        );
        scan.gate_length_m = Some(30.0);
        scan.pulse_width_s = Some(200e-9);
        // 200 ns at half height are 12.73 m of standard deviation.
        assert!((std_m(&scan, None).0 - 12.73f64.hypot(8.66)).abs() < 0.03);
    }
}
