//! What is measured in a wind or a simulated flow; nothing here changes the flow.
//!
//! | file | what is in it |
//! |---|---|
//! | `circulation` | circulation on circles, (1), and `Gamma_5-15` |
//! | `cross_plane` | planes of a simulated flow, as values and as a wind |
//! | [`decay`] | when the fast decay of a wake begins, how fast its waves grow |
//! | `wake` | [`WakeMeter`]: centres, circulations, secondary vortices, spectra, enstrophy of a simulated wake |

mod circulation;
#[cfg(feature = "solver")]
mod cross_plane;
pub mod decay;
#[cfg(feature = "solver")]
mod wake;

pub use circulation::{circulation_m2_s, mean_circulation_5_15_m2_s};
#[cfg(feature = "solver")]
pub use cross_plane::CrossPlane;
#[cfg(feature = "solver")]
pub use wake::{SecondaryRecord, VortexRecord, WakeMeter, WakeRecord, WakeScales};
