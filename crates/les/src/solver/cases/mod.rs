//! Flows with known answers: mesh, settings and initial field of each, at any resolution and Reynolds number.
//!
//! All are in the units of their literature (lengths, speeds of order one), which the solver takes as SI.

mod cavity;
mod channel;
mod dipole;
mod orr_sommerfeld;
mod taylor_green;
mod vortex_pair;

pub use cavity::lid_driven_cavity;
pub use channel::{channel, couette, decaying_layer, poiseuille, rayleigh_plate};
pub use dipole::dipole_against_wall;
pub use orr_sommerfeld::TollmienSchlichting;
pub use taylor_green::{taylor_green_3d, taylor_green_eighth, taylor_green_plane, taylor_green_plane_exact};
pub use vortex_pair::VortexPairCase;

use super::mesh::Mesh;
use super::settings::FlowSettings;
use crate::{Error, Flow, StartReport};

/// Velocity at a position \[m\], `(u, v, w)` \[m/s\].
pub type InitialField = Box<dyn Fn([f64; 3]) -> [f64; 3] + Send + Sync>;

/// A flow ready to be simulated.
pub struct Case {
    /// The mesh.
    pub mesh: Mesh,
    /// The settings, which may be changed before the start.
    pub settings: FlowSettings,
    /// The initial field.
    pub initial: InitialField,
    /// Time at which the literature ends \[s\].
    pub end_s: f64,
}

impl Case {
    /// The simulation at its start.
    ///
    /// # Errors
    /// As [`Flow::new`].
    pub fn start(&self) -> Result<(Flow, StartReport), Error> {
        Flow::new(self.mesh.clone(), self.settings.clone(), &self.initial)
    }
}

impl std::fmt::Debug for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Case").field("mesh", &self.mesh).field("settings", &self.settings).finish_non_exhaustive()
    }
}
