//! What a test for a wake takes for granted.

use crate::retrieval::Turbulence;

/// What a test takes for granted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectorOptions {
    /// Least and largest distance of a pair's vortices that is tried \[m\].
    pub spacing_m: (f64, f64),
    /// Whether single vortices are tried, too: the partner may be out of view.
    pub single_vortices: bool,
    /// The background besides wind and the noise of the map's standard deviations.
    pub turbulence: Option<Turbulence>,
}

impl Default for DetectorOptions {
    /// Wakes of wings of 20 to 80 m (spacing pi/4 of the span), single vortices, and no turbulence.
    fn default() -> Self {
        Self { spacing_m: (16.0, 63.0), single_vortices: true, turbulence: None }
    }
}
