//! What a plan is for.

use crate::air::turbulence::Turbulence;
use crate::beam::{Misalignment, Telescope};

/// What a Monte Carlo is to simulate.
#[derive(Debug, Clone)]
pub struct Case {
    /// Telescope of both beams.
    pub telescope: Telescope,
    /// Displacement of the BPLO against the transmitted beam.
    pub misalignment: Misalignment,
    /// Turbulence along the path.
    pub turbulence: Turbulence,
    /// Realisations to be done: their standard error bounds that of the layers.
    pub realisations: usize,
}
