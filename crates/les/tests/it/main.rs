//! Tests of the crate from outside, in one program.
#![allow(clippy::unwrap_used)] // a flow that cannot be set up or stepped has failed the test

#[cfg(feature = "solver")]
mod exact_flows;
#[cfg(feature = "solver")]
mod extremes;
mod grid_wind;
mod scan_winds;
mod vortex;
#[cfg(feature = "solver")]
mod wake_reference;
