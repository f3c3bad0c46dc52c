//! Independent computations of the efficiency, with which the tests compare the crate.

pub(crate) mod hankel;
mod quadrature;
#[cfg(feature = "screens")]
pub(crate) mod weak;
