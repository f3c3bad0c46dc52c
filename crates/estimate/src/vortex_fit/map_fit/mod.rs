//! Fits of the wake to a map of radial velocities.

pub(crate) mod cells;
pub(crate) mod coarse;
pub(crate) mod data;
pub(crate) mod estimates;
pub(crate) mod estimator_response;
pub(crate) mod gates;
pub(crate) mod guess;
pub(crate) mod least_squares;
pub(crate) mod local_circulation;
pub(crate) mod prediction;
pub(crate) mod residual_covariance;
pub(crate) mod secondary;
pub(crate) mod setting;
pub(crate) mod starts;
