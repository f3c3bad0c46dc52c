//! Tests across the crates of wakescope.
