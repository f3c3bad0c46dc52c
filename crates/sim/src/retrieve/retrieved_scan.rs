//! One scan with what was found in it.

use crate::Error;
use crate::io::scans::ReadScan;
use wakescope_estimate::retrieval::{RetrievalOptions, ScanResult};

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

/// An error of the fits with the file that caused it.
pub(super) fn refused(scan: &ReadScan, error: &wakescope_estimate::Error) -> Error {
    Error::Input { path: scan.path.clone(), reason: format!("sweep {}: {error}", scan.sweep) }
}
