//! From one scan's map of radial velocities to its vortices: circulation, place, core and their errors, or no wake.
//!
//! | module | content |
//! |---|---|
//! | `scan_map`, `options`, `result` | what goes in, how, what comes out |

mod fit;
mod options;
mod result;
mod scan_map;

pub use fit::fit_scan;
pub use options::{Covariance, Gate, RetrievalOptions, Turbulence};
pub use result::{Flag, Measured, ScanResult, Side, Top, VortexResult};
pub use scan_map::ScanMap;
