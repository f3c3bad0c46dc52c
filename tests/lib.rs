//! Tests across the crates of wakescope, and the [audit] of the program's numbers.

pub mod audit;
