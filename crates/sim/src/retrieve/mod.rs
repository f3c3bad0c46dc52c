//! From scans of any instrument to vortices: circulation, place, core and their errors, one row for each vortex and scan.
//!
//! | module | content |
//! |---|---|
//! | `gate` | what a velocity of a file is of the air about its range |
//! | `own` | maps and signals of this program's scenes: what their estimator makes of a wake |
//! | `others` | velocity envelopes, circulation against radius |
//! | `tracks` | the vortices through several scans |
//! | `realisations`, `truth`, `summary` | all realisations of a scene against the vortices of its flow |
//! | `table` | rows, and everything as JSON |
//! | `pictures` | velocities, the fitted wake, what is left |
//!
//! Check: maps of runs are retrieved within their stated deviations, from every format.

mod gate;
mod others;
mod own;
#[cfg(feature = "plots")]
mod pictures;
mod realisations;
mod summary;
mod table;
mod tracks;
mod truth;

pub use gate::gate_of;
pub use others::{envelope_table, envelopes, profile_table};
pub use own::{OwnScene, retrieve_signals, scan_of_signals};
#[cfg(feature = "plots")]
pub use pictures::figure;
pub(crate) use realisations::of_realisations;
pub use realisations::{RetrievalRow, SceneRetrieval};
pub use summary::RetrievalErrors;
pub(crate) use summary::name;
#[cfg(feature = "sweep")]
pub use table::json;
pub use table::rows;
#[cfg(feature = "plots")]
pub use tracks::track_figure;
pub use tracks::{track_of, track_table};
pub use truth::TrueVortex;

use crate::Error;
use crate::io::scans::ReadScan;
pub use crate::scene::RetrievalMethod as Method;
use wakescope_estimate::retrieval::{RetrievalOptions, ScanResult, fit_scan, radial_velocity_method};
use wakescope_estimate::vortex_fit::Sharing;

/// One scan with what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub struct RetrievedScan {
    /// The scan.
    pub scan: ReadScan,
    /// How it was retrieved.
    pub options: RetrievalOptions,
    /// Its vortices, or none.
    pub result: ScanResult,
}

/// Retrieves one map.
///
/// With the scene of a map of this program, its means only lead to the start of the fit to what the estimator shows: taken for means,
/// peaks mislead about the core above all, which is kept until then.
///
/// # Errors
/// What the fits refuse, with the file and the sweep.
pub fn retrieve_map(
    scan: ReadScan,
    method: Method,
    options: RetrievalOptions,
    own: Option<&OwnScene>,
) -> Result<RetrievedScan, Error> {
    let refuse = |error: wakescope_estimate::Error| refused(&scan, &error);
    let result = match (method, own) {
        (Method::Rv, _) => radial_velocity_method(&scan.map, &options).map_err(refuse)?,
        (_, None) => fit_scan(&scan.map, &options).map_err(refuse)?,
        (_, Some(own)) => {
            let mut rough = options.clone();
            rough.free.core_radius = Sharing::Fixed;
            let found = fit_scan(&scan.map, &rough).map_err(refuse)?;
            own.refined(&scan.map, &options, &found).unwrap_or(found)
        }
    };
    Ok(RetrievedScan { scan, options, result })
}

/// An error of the fits with the file that caused it.
fn refused(scan: &ReadScan, error: &wakescope_estimate::Error) -> Error {
    Error::Input { path: scan.path.clone(), reason: format!("sweep {}: {error}", scan.sweep) }
}
