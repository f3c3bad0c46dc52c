//! Fits of the wake to all raw signals of a scan.

pub(crate) mod ascent;
pub(crate) mod banded_cholesky;
pub(crate) mod baseband;
pub(crate) mod fit;
pub(crate) mod likelihood;
pub(crate) mod line_covariance;
pub(crate) mod options;
pub(crate) mod scan_model;
pub(crate) mod tops;
