//! Winds that a lidar may see: analytic wakes, uniform winds, sums, and fields sampled on meshes,
//! behind the trait [`Wind`].
//!
//! | file | what is in it |
//! |---|---|
//! | `wind` | the trait [`Wind`]; [`SampledLine`]; sums of winds |
//! | `profile` | circulation against radius of one vortex, (3), (4); the two-scale profile |
//! | `vortex` | the pair, its images and its path; [`Aircraft`], (5) |
//! | `decay` | lifetime and decay laws of a pair |
//! | `pair_path`, `transported` | [`TransportedPair`]: a pair that decays and moves |
//! | `along_flight` | the pair, older the farther it is behind the aircraft |
//! | `linear` | [`Linear`]: uniform, or linear in place and time |
//! | `mean_wind` | [`MeanWind`]: logarithmic law, power law or table over the height |
//! | `eddies` | [`Eddies`]: turbulence as a sum of plane waves |
//! | `grid_wind` | [`GridSnapshot`]: a field on a mesh, interpolated by (26) |
//! | `volume` | fields in three dimensions |
//! | `series` | [`Series`]: fields at several times, a wind that moves |
//! | `axis` | one direction of a mesh: stretching, walls, periods; the M'4 kernel, (27) |
//! | `strain` | the largest line gradient of a velocity gradient |

mod along_flight;
pub(crate) mod axis;
pub mod decay;
mod eddies;
pub(crate) mod grid_wind;
mod linear;
mod mean_wind;
mod pair_path;
mod profile;
mod series;
mod strain;
mod transported;
mod volume;
mod vortex;
mod wind;

pub use along_flight::AlongFlight;
pub use axis::{Edges, Side, m4_prime, m4_prime_weights};
pub use eddies::{Eddies, Mode, isotropic_modes};
pub use grid_wind::{GridSnapshot, PlaneMesh};
pub use linear::Linear;
pub use mean_wind::{MeanWind, VON_KARMAN_CONSTANT, WindLaw};
pub use pair_path::Transport;
pub use profile::{CirculationProfile, TwoScale};
pub use series::Series;
pub use transported::TransportedPair;
pub use volume::{VolumeComponent, VolumeSnapshot};
pub use vortex::{Aircraft, Ground, Motion, Vortex, VortexPair};
pub use wind::{SampledLine, Wind};
