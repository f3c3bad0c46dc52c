//! The measurement: from a scene's plan to signals, velocities, their errors and the files.
//!
//! | module | what is in it |
//! |---|---|
//! | [`instrument`], [`estimators`] | a scene in the words of the other crates, made once for a plan |
//! | [`wind`] | the wind: analytic, or the planes of a simulated flow |
//! | [`geometry`], `scan_lines` | lines of sight, samples, gates, layers |
//! | [`profile`] | efficiency and signal-to-noise ratio against range |
//! | `efficiencies` | efficiency curves that several scans share |
//! | `table` | tables of numbers and straight lines between them |
//! | `air`, [`scan`] | air along the lines of sight, and their records |
//! | [`beam_winds`] | winds from the beams of VAD and DBS scans |
//! | [`map`], `map_estimator` | estimates and their errors against the truth |
//! | [`error_law`], [`cell_average`] | the law of these errors, averages of them over cells, their standard errors |
//! | [`recorded`] | the same from the records of a file, measured or simulated |
//! | [`mod@bound`], `ray_information` | the Cramer-Rao bound for a scene; what a pulse tells of the velocity about a range |
//! | [`budget`] | the power budget, from the pulse to the signal-to-noise ratio |
//! | [`mod@run`], [`mod@write`] | running a plan, writing its results |
//! | [`progress`], [`streams`] | who watches a run; one random stream for each pulse |

pub(crate) mod air;
pub mod beam_winds;
pub mod bound;
pub mod budget;
pub mod cell_average;
pub(crate) mod described;
pub(crate) mod efficiencies;
pub mod error_law;
pub mod estimators;
pub mod geometry;
pub mod instrument;
pub mod map;
pub(crate) mod map_estimator;
pub(crate) mod plane;
pub mod profile;
pub mod progress;
pub(crate) mod ray_information;
pub mod recorded;
pub(crate) mod region;
pub(crate) mod response;
pub mod run;
pub mod scan;
pub(crate) mod scan_lines;
#[cfg(test)]
mod standard_error_tests;
pub mod streams;
pub(crate) mod table;
pub mod wind;
pub mod write;
