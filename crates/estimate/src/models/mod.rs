//! Autoregressive models of a correlogram.

pub(crate) mod autoregressive;
pub(crate) mod levinson;

pub use autoregressive::Autoregression;
