//! From scans of any instrument to vortices: circulation, place, core and their errors, one row for each vortex and scan.
//!
//! | module | content |
//! |---|---|
//! | `own` | signals of a scene that is known, and their maps |
//! | `one_scan` | one map, and what a velocity of it is of the air about its range |
//! | `envelope` | velocity envelopes |
//! | `realisations`, `truth`, `summary` | all realisations of a scene against the vortices of its flow |
//! | `table` | what was found in a scan, and the track through several: rows, and everything as JSON |
//! | `pictures` | velocities, the fitted wake, what is left; tracks |
//!
//! Check: maps of runs are retrieved within their stated deviations, from every format.

mod envelope;
mod one_scan;
mod own;
#[cfg(feature = "plots")]
mod pictures;
pub(crate) mod realisations;
pub(crate) mod stage;
pub(crate) mod summary;
mod table;
pub(crate) mod truth;

pub use envelope::{envelope_table, envelopes};
#[cfg(feature = "cli")]
pub(crate) use one_scan::WIDTH_OVER_STD;
pub use one_scan::{gate_of, gate_of_instrument, options, retrieve_map, scene_in_file, scene_of};

pub use own::{retrieve_signals, scan_of_signals};
#[cfg(feature = "plots")]
pub use pictures::{figure, track_figure};
pub use realisations::{RetrievalRow, SceneRetrieval};
pub use table::{
    PlaneTrack, RetrievedScan, flags, json, name, rows, track_of, track_table, tracks_of,
};
pub use truth::true_vortices;

pub use crate::measure::response::SceneResponse;
pub use crate::scene::RetrievalMethod as Method;
