//! Tests across the crates of wakescope: the [audit] of the program's numbers, the [curves] that are stored, [extreme] cases.

pub mod audit;
pub mod curves;
pub mod extreme;
