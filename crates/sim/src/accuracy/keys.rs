//! Settings that trade accuracy for time, by the paths of their keys, and scenes with other values of them.

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
/// Distance between points of the screens; their width is retained.
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

/// A scene with another value of a key; another spacing of the screens comes with as many points as retain their width.
///
/// # Errors
/// What the scene does not allow.
pub fn with(file: &SceneFile, key: &'static str, number: f64) -> Result<SceneFile, Error> {
    let scene = &file.content;
    let mut table = to_table(scene);
    if key == GRID_SPACING {
        let width_m = value(scene, GRID_POINTS) * value(scene, GRID_SPACING);
        let points = (width_m / number).round() as i64;
        set(&mut table, GRID_POINTS, Value::Integer(points));
        set(&mut table, key, Value::Float(number));
    } else {
        set(&mut table, key, Value::Integer(number.round() as i64));
    }
    let changed = from_table(table).ok_or_else(|| Error::Key {
        key,
        reason: format!("a value other than {number}"),
    })?;
    file.with(changed)
}
