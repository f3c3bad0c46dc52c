//! Keys that trade error for time, by their paths, and scenes with other values of them.
//!
//! Check: the search, which makes scenes of them.

use crate::Error;
use crate::keys::{from_table, to_table, value_at};
use crate::scene::{Scene, SceneFile};
use crate::sweep::set;
use toml::Value;

/// Samples between windows.
pub const WINDOW_STEP: &str = "estimator.window_step_samples";
/// Points of the spectrum.
pub const PADDED: &str = "estimator.padded_samples";
/// Phase screens along the path.
pub const LAYERS: &str = "atmosphere.turbulence.layers";
/// Points along a side of the screens.
pub const GRID_POINTS: &str = "atmosphere.turbulence.grid_points";
/// Distance between points of the screens; here their width stays.
pub const GRID_SPACING: &str = "atmosphere.turbulence.grid_spacing_m";
/// Realisations of the path.
pub const PATHS: &str = "atmosphere.turbulence.realisations";
/// Cells of a flow along each direction.
pub const CELLS: &str = "case.cells";
/// Realisations of the scan.
pub const REALISATIONS: &str = "scan.realisations";

/// The number that a key has in a scene; NaN where it has none.
pub(super) fn value(scene: &Scene, key: &str) -> f64 {
    let whole = Value::Table(to_table(scene));
    match value_at(&whole, key) {
        Some(Value::Integer(number)) => *number as f64,
        Some(Value::Float(number)) => *number,
        _ => f64::NAN,
    }
}

/// A scene with other values of some keys, one after the other; another spacing of the screens comes with as many points as keep their width.
///
/// # Errors
/// What the scene does not allow.
pub fn with(file: &SceneFile, values: &[(&'static str, f64)]) -> Result<SceneFile, Error> {
    let mut scene = file.content.clone();
    for &(key, number) in values {
        let whole = |number: f64| Value::Integer(number.round() as i64);
        let mut table = to_table(&scene);
        if key == GRID_SPACING {
            let width_m = value(&scene, GRID_POINTS) * value(&scene, GRID_SPACING);
            set(&mut table, GRID_POINTS, whole(width_m / number));
        }
        set(
            &mut table,
            key,
            if key == GRID_SPACING {
                Value::Float(number)
            } else {
                whole(number)
            },
        );
        scene = from_table(table).ok_or_else(|| Error::Key {
            key,
            reason: format!("a value other than {number}"),
        })?;
    }
    Ok(file.with(scene)?)
}
