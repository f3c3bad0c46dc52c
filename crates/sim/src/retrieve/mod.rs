//! From scans of any instrument to vortices: circulation, place, core and their errors, one row for each vortex and scan.
//!
//! | module | content |
//! |---|---|
//! | `gate`, `instrument` | what a velocity of a file is of the air about its range, and how it was estimated |
//! | `own` | maps and signals of a scene that is known: what its estimator makes of a wake |
//! | `one_scan`, `retrieved_scan` | one map, and what was found in it |
//! | `others` | velocity envelopes, circulation against radius |
//! | `tracks` | the vortices through several scans |
//! | `realisations`, `truth`, `summary` | all realisations of a scene against the vortices of its flow |
//! | `table` | rows, and everything as JSON |
//! | `pictures` | velocities, the fitted wake, what is left |
//!
//! Check: maps of runs are retrieved within their stated deviations, from every format.

mod gate;
mod instrument;
mod one_scan;
mod others;
mod own;
#[cfg(feature = "plots")]
mod pictures;
pub(crate) mod realisations;
mod retrieved_scan;
pub(crate) mod summary;
mod table;
mod tracks;
mod truth;

pub use gate::gate_of;
pub use instrument::{StatedEstimator, scene_of, stated_scene};
pub use one_scan::{Velocities, options, retrieve_map};
pub use others::{envelope_table, envelopes, profile_table};
pub use own::{retrieve_signals, scan_of_signals};
#[cfg(feature = "plots")]
pub use pictures::figure;
pub use realisations::{RetrievalRow, SceneRetrieval};
pub use retrieved_scan::RetrievedScan;
pub use table::json;
pub use table::{rows, side};
#[cfg(feature = "plots")]
pub use tracks::track_figure;
pub use tracks::{track_of, track_table};
pub use truth::TrueVortex;

pub use crate::measure::response::SceneResponse;
pub use crate::scene::RetrievalMethod as Method;
