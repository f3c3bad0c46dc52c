//! Retrieval of one map.

use super::own::OwnScene;
use super::retrieved_scan::{RetrievedScan, refused};
use crate::Error;
use crate::io::scans::ReadScan;
use crate::scene::RetrievalMethod as Method;
use wakescope_estimate::retrieval::{RetrievalOptions, fit_scan, radial_velocity_method};
use wakescope_estimate::vortex_fit::Sharing;

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
