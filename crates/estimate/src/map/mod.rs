//! From a scan to a map: regions, accumulation, errors against the truth.

pub(crate) mod accumulate;
pub(crate) mod auto_radius;
pub(crate) mod error_statistics;
pub(crate) mod mixture;
pub(crate) mod region;

pub use accumulate::{MapPoint, Radius, Scan, ScanSums};
pub use error_statistics::ErrorStatistics;
pub use mixture::{GoodAndBad, good_and_bad};
pub use region::{
    LineOfSight, PolarPoint, ScanGeometry, WindowCorrelation, WindowCovariance, polar_points,
};
