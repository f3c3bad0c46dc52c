//! Data sets of scans with exact truth: flights drawn by a plan, stored as a Zarr group that any number of processes fill.
//!
//! | module | what is in it |
//! |---|---|
//! | [`plan`] | the plan: keys that vary, the scene of each flight |
//! | [`keys`], `drawn` | what a plan may say; the keys of the scene that vary |
//! | `draw` | distributions and the sequence of their numbers |
//! | [`presets`] | plans that come with the program |
//! | `schema`, `documents` | arrays and coordinates; the files beside them |
//! | `refusals` | plans whose vortices have no truth |
//! | `flight` | one flight, measured and packed |
//! | [`mod@run`] | chunk after chunk of flights, in any number of processes |

mod documents;
mod draw;
mod drawn;
mod flight;
pub mod keys;
pub mod plan;
pub mod presets;
mod refusals;
pub mod run;
mod schema;

pub use crate::io::data_set::GROUP as STORE;

/// Name of the plan there.
pub const PLAN: &str = "plan.toml";
