//! The measurement: from what is made of a scene to signals, velocities and their errors.
//!
//! | module | what is in it |
//! |---|---|
//! | [`profile`], `screens` | efficiency and signal-to-noise ratio against range; its phase screens |
//! | [`scan`], `scan_stages` | the records of the lines of sight; what they need |
//! | `accumulation` | whether the products of a line are summed over records or drawn at once |
//! | [`map`], `map_stages`, `map_estimator`, `gate_estimates` | estimates and their errors against the truth; what they need |
//! | [`error_law`], [`cell_average`] | the law of these errors, averages of them over cells, their standard errors |
//! | [`recorded`] | the same from the records of a file, measured or simulated |
//! | [`mod@bound`] | the Cramer-Rao bound for a scene |
//! | [`budget`], `clipping` | the power budget, from the pulse to the signal-to-noise ratio; samples that the converter clips |
//! | `efficiency_model` | the cheapest model of the efficiency that is valid, and the ranges at which it is computed |
//! | `region`, `ray_information` | radius of regions; information of a pulse on the velocity about a range |
//! | `response`, `plane` | what the estimators show of a wake; the wind on a cross-plane |

pub(crate) mod accumulation;
pub mod bound;
pub mod budget;
pub mod cell_average;
pub(crate) mod clipping;
pub(crate) mod efficiency_model;
pub mod error_law;
pub(crate) mod gate_estimates;
pub mod map;
pub(crate) mod map_estimator;
pub(crate) mod map_stages;
pub(crate) mod plane;
pub mod profile;
pub(crate) mod ray_information;
pub mod recorded;
pub(crate) mod region;
pub(crate) mod response;
pub mod scan;
pub(crate) mod scan_stages;
pub(crate) mod screens;
#[cfg(test)]
mod standard_error_tests;
