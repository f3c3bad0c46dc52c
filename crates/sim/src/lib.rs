//! The whole measurement: from a scene file to a radial-velocity map with its errors.

pub mod scene;

/// Speed of light in vacuum, m/s; the index of air changes a range by 0.03 %, which is left out.
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
