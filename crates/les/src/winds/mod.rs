//! Winds that a lidar may see: analytic wakes, uniform winds, sums, and fields sampled on meshes, behind the trait [`Wind`].
//!
//! | file | what is in it |
//! |---|---|
//! | `wind` | the trait [`Wind`]; [`Calm`], [`Uniform`], [`Sum`] |
//! | `profile` | circulation against radius of one vortex, (3), (4) |
//! | `two_scale` | the two-scale profile |
//! | `vortex` | the pair, its images and its path; [`Aircraft`], (5) |
//! | `grid_wind` | [`GridSnapshot`]: a field on a mesh, interpolated by (26) |
//! | `series` | [`GridSeries`]: snapshots at several times, a wind that moves |
//! | `axis` | one direction of a mesh: stretching, walls, periods |
//! | `kernel` | the M'4 kernel, (27) |

pub(crate) mod axis;
pub(crate) mod grid_wind;
mod kernel;
mod profile;
mod series;
mod two_scale;
mod vortex;
mod wind;

pub use axis::{Edges, Side};
pub use grid_wind::{GridSnapshot, OutsidePolicy, PlaneMesh};
pub use kernel::{m4_prime, m4_prime_weights};
pub use profile::CirculationProfile;
pub use series::GridSeries;
pub use two_scale::TwoScale;
pub use vortex::{Aircraft, Centres, Ground, Motion, VortexPair, VortexPairWind};
pub use wind::{Calm, Sum, Uniform, Wind};
