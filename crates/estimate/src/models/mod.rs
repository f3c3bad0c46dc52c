//! Autoregressive models of a correlogram: the recursion, the order, the poles.

pub(crate) mod autoregressive;
pub(crate) mod levinson;
pub(crate) mod poles;

pub use autoregressive::{Autoregression, OrderChoice};
