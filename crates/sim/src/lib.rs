//! The whole measurement: from a scene file to a radial-velocity map with its errors.

pub mod export;
pub mod geometry;
pub mod join;
pub mod map;
pub mod plan;
mod plane;
pub mod profile;
pub mod progress;
pub mod run;
pub mod scan;
pub mod scene;
pub mod streams;
pub mod write;

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "plots")]
pub mod plot;

mod error;

pub use error::Error;

/// Version of this program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Name and version, as every file carries it.
pub const PROGRAM: &str = concat!("wakescope ", env!("CARGO_PKG_VERSION"));

/// Speed of light in vacuum, m/s; the index of air changes a range by 0.03 %, which is left out.
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
