//! From one scan's map of radial velocities to its vortices: circulation, place, core and their errors, or no wake.
//!
//! | module | content |
//! |---|---|
//! | `scan_map`, `options`, `result` | what goes in, how, what comes out |

mod correlated_residuals;
mod envelope;
mod expected;
mod expected_map;
mod fit;
mod hypotheses;
mod integral;
mod motion;
mod options;
mod problem;
mod radial_velocity;
mod report;
mod result;
mod scan_map;
mod track;
mod whitening;

pub use envelope::{EnvelopeResult, ScanSpectra, SpectralShape, velocity_envelopes};
pub use expected_map::expected_velocities;
pub use fit::fit_scan;
pub(crate) use fit::unfolded;
pub use integral::{ProfilePoint, circulation_profile};
pub use options::{Covariance, Gate, Movement, RetrievalOptions, Turbulence};
pub use radial_velocity::radial_velocity_method;
pub use result::{Flag, Measured, ScanResult, Side, Top, VortexResult};
pub use scan_map::ScanMap;
pub use track::{Track, TrackOptions, TrackPoint, TrackedVortex, track};
pub(crate) use whitening::Whitening;
