//! Claims that hold across crates, one module for each family.

// A test that cannot set up its scene has failed.
#![allow(clippy::unwrap_used)]

mod circulation;
mod circulations_through_signals;
mod curves;
mod extremes;
mod point_target;
mod power;
mod scan_errors;
mod turbulence;
mod uniform_wind;
