//! Claims that hold across crates, one module for each family.

mod point_target;
mod power;
mod uniform_wind;
