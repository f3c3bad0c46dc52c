//! Tests of the crate from outside, in one program.
#![allow(clippy::unwrap_used)] // a flow that cannot be set up or stepped has failed the test

mod eddies;
#[cfg(feature = "solver")]
mod exact_flows;
#[cfg(feature = "solver")]
mod extremes;
mod grid_wind;
mod mean_wind;
#[cfg(feature = "solver")]
mod references;
mod scan_winds;
#[cfg(feature = "solver")]
mod stored_cases;
mod transport;
mod vortex;
#[cfg(feature = "solver")]
mod wake_reference;
