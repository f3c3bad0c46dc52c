//! The crate as its users see it: against stored curves, exact theory, its own literal form, and
//! in extreme cases.

mod free_space;
#[cfg(feature = "screens")]
mod literal;
#[cfg(feature = "screens")]
mod monte_carlo;
mod oracle;
#[cfg(feature = "screens")]
mod plan;
#[cfg(feature = "screens")]
mod reciprocity;
mod reference;
#[cfg(feature = "screens")]
mod screens;
mod structure;
