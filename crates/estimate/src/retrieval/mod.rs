//! From one scan's map of radial velocities to its vortices: circulation, place, core and their errors, or no wake.
//!
//! | module | content |
//! |---|---|
//! | `scan_map`, `options`, `result` | what goes in, how, what comes out |

mod correlated_residuals;
mod expected;
mod fit;
mod hypotheses;
mod motion;
mod options;
mod problem;
mod report;
mod result;
mod scan_map;
mod whitening;

pub use fit::fit_scan;
pub(crate) use fit::unfolded;
pub use options::{Covariance, Gate, Movement, RetrievalOptions, Turbulence};
pub use result::{Flag, Measured, ScanResult, Side, Top, VortexResult};
pub use scan_map::ScanMap;
