//! Winds seen by a lidar: analytic aircraft wakes and sampled flows behind one trait.
//!
//! The crate computes the velocity of the air at any point and time: aircraft wake vortices over
//! the ground (equations (1)-(5) of the chapter this project follows), uniform winds, sums, and
//! fields given on a mesh, which are interpolated by the M'4 kernel (26), (27). Axes: x along the
//! flight direction, y across it, z up; ground at z = 0. SI units, `f64`; a unit is the suffix of
//! each name.
//!
//! ```
//! use wakescope_les::{CirculationProfile, Ground, Motion, VortexPair, Wind};
//!
//! let pair = VortexPair {
//!     circulation_m2_s: 500.0,
//!     spacing_m: 47.0,
//!     core_radius_m: 2.35,
//!     lateral_position_m: 400.0,
//!     height_m: 47.0,
//!     ground: Ground::Image,
//!     profile: CirculationProfile::Algebraic,
//!     motion: Motion::Frozen,
//! };
//! let mut velocity_m_s = [[0.0; 3]];
//! pair.wind()?.velocity_into(&[[0.0, 400.0, 47.0]], 0.0, &mut velocity_m_s)?;
//! assert!(velocity_m_s[0][2] < -5.0, "the air between the vortices moves down");
//! # Ok::<(), wakescope_les::Error>(())
//! ```
//!
//! What a first program needs is exported here; the rest is in its module.
//!
//! | module | what is in it |
//! |---|---|
//! | [`winds`] | the trait [`Wind`]: analytic vortices, uniform winds, sums, fields on meshes |
//! | [`solver`] | [`Flow`]: the large-eddy simulation, its mesh, settings, pressure equation, runs with checkpoints |
//! | [`ranks`] | processes or threads that share a flow |
//! | [`cases`] | flows with known solutions, and the wake above ground |
//! | [`analysis`] | what is measured in a wind or a flow: circulations, cross-planes, the state of a wake |
//!
//! Feature `solver` (default): the large-eddy simulation, see [`Flow`]. Without it neither threads
//! nor transforms are compiled.

#![warn(clippy::too_many_lines, clippy::type_complexity)]

#[cfg(all(doctest, feature = "solver"))]
#[doc = include_str!("../README.md")]
mod readme {}

// The threads that stand for ranks in tests name the crate as other crates do.
#[cfg(test)]
extern crate self as wakescope_les;

pub mod analysis;
mod error;
#[cfg(feature = "solver")]
pub mod ranks;
#[cfg(feature = "solver")]
pub mod solver;
pub mod winds;

pub use error::{Error, Place, PressureFailure};
#[cfg(feature = "solver")]
pub use solver::{
    Direction, Flow, FlowSettings, Mapping, Mesh, Spread, SubgridModel, TimeScheme, TimeStep, Wall,
    cases,
};
pub use winds::{CirculationProfile, GridSnapshot, Ground, Motion, VortexPair, Wind};
