//! Winds seen by a lidar: analytic aircraft wakes and sampled flows behind one trait.
//!
//! The crate computes the velocity of the air at any point and time: aircraft wake vortices over the ground
//! (equations (1)-(5) of the chapter this project follows), uniform winds, sums, and fields given on a mesh, which are
//! interpolated by the M'4 kernel (26), (27). Axes: x along the flight direction, y across it, z up; ground at z = 0.
//! SI units, `f64`; a unit is the suffix of each name.
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
//! | module | what is in it |
//! |---|---|
//! | `wind` | the trait [`Wind`]; [`Calm`], [`Uniform`], [`Sum`] |
//! | `profile` | circulation against radius of one vortex, (3), (4) |
//! | `two_scale` | the two-scale profile |
//! | `vortex` | the pair, its images and its path; [`Aircraft`], (5) |
//! | `grid_wind` | [`GridSnapshot`]: a field on a mesh, interpolated by (26) |
//! | `series` | [`GridSeries`]: snapshots at several times, a wind that moves |
//! | `solver` | [`Flow`], [`Mesh`], [`FlowSettings`]: the simulation; [`Run`]: a run with outputs and checkpoints; [`WakeMeter`]: what a wake is measured by; [`cases`] |
//! | `axis` | one direction of a mesh: stretching, walls, periods |
//! | `kernel` | the M'4 kernel, (27) |
//! | `diagnose` | circulation on circles, (1), and `Gamma_5-15` |
//! | [`decay`] | when the fast decay of a wake begins, how fast its waves grow |
//!
//! Feature `solver` (default): the large-eddy simulation, see [`Flow`]. Without it neither threads nor transforms are compiled.

mod axis;
pub mod decay;
mod diagnose;
mod error;
mod grid_wind;
mod kernel;
mod profile;
mod series;
#[cfg(feature = "solver")]
mod solver;
mod two_scale;
mod vortex;
mod wind;

pub use axis::{Edges, Side};
pub use diagnose::{circulation_m2_s, mean_circulation_5_15_m2_s};
pub use error::{EnergyGrowth, Error, PressureFailure};
pub use grid_wind::{GridSnapshot, OutsidePolicy, PlaneMesh};
pub use kernel::{m4_prime, m4_prime_weights};
pub use profile::CirculationProfile;
pub use series::GridSeries;
#[cfg(feature = "solver")]
pub use solver::{
    CheckpointPlan, CrossPlane, EnergyBudget, Interval, Run, RunObserver, RunPlan, RunSummary, RunWarning, Silent,
    StepRecord, check_checkpoint,
};
#[cfg(feature = "solver")]
pub use solver::{
    Direction, Ends, Flow, FlowSettings, Mapping, MappingFn, Mesh, PressureEquation, PressureMethod, PressureSolved,
    SecondaryRecord, StartReport, StepReport, SubgridModel, TimeScheme, TimeStep, UndampedGrowth, ViscousTreatment,
    VortexRecord, WakeMeter, WakeRecord, WakeScales, Wall, cases,
};
pub use two_scale::TwoScale;
pub use vortex::{Aircraft, Centres, Ground, Motion, VortexPair, VortexPairWind};
pub use wind::{Calm, Sum, Uniform, Wind};
