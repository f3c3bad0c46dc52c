//! Fits of the wake to a map of radial velocities.

pub(crate) mod coarse;
pub(crate) mod data;
pub(crate) mod estimates;
pub(crate) mod estimator_response;
pub(crate) mod guess;
pub(crate) mod means;
pub(crate) mod problem;
pub(crate) mod residual_covariance;
pub(crate) mod secondary;
pub(crate) mod starts;
pub(crate) mod tangent;
