//! Retrieval of one map.

use super::own::OwnScene;
use super::retrieved_scan::{RetrievedScan, refused};
use crate::Error;
use crate::io::scans::ReadScan;
use crate::scene::RetrievalMethod as Method;
use wakescope_estimate::retrieval::{RetrievalOptions, fit_scan, radial_velocity_method, with_secondary_vortices};
use wakescope_estimate::vortex_fit::Sharing;

/// Retrieves one map.
///
/// With the scene of a map of this program, its means only lead to the start of the fit to what the estimator shows: taken for means,
/// peaks mislead about the core above all, which is kept until then. Secondary vortices that the map shows are in the options that come
/// back.
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
    let mut found = match (method, own) {
        (Method::Rv, _) => radial_velocity_method(&scan.map, &options).map_err(refuse)?,
        (_, None) => fit_scan(&scan.map, &options).map_err(refuse)?,
        (_, Some(_)) => {
            let mut rough = options.clone();
            rough.free.core_radius = Sharing::Fixed;
            fit_scan(&scan.map, &rough).map_err(refuse)?
        }
    };
    let mut options = options;
    let better = match (method, own) {
        (Method::Rv, _) => None,
        (_, None) => with_secondary_vortices(&scan.map, &options, &found).map_err(refuse)?,
        (_, Some(own)) => own.refined(&scan.map, &options, &found),
    };
    if let Some(better) = better {
        (found, options) = better;
    }
    Ok(RetrievedScan { scan, options, result: found })
}
