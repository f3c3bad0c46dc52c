//! Flows with known answers: mesh, settings and initial field of each, at any resolution and
//! Reynolds number.
//!
//! All are in the units of their literature (lengths, speeds of order one), which the solver takes
//! as SI.

mod boxes;
mod channel;
mod orr_sommerfeld;
mod perturbation;
mod resolution;
mod taylor_green;
mod vortex_pair;

pub use boxes::{dipole_between_walls, dipole_in_a_box, lid_driven_cavity};
pub use channel::{Plates, channel};
pub use orr_sommerfeld::TollmienSchlichting;
pub use taylor_green::{
    taylor_green_3d, taylor_green_eighth, taylor_green_plane, taylor_green_plane_exact,
};
pub use vortex_pair::VortexPairCase;

use super::flow::Flow;
use super::mesh::{Direction, Mapping, Mesh};
use super::settings::FlowSettings;
use crate::Error;

/// What a flow starts from.
pub enum Initial {
    /// A formula: velocity `(u, v, w)` \[m/s\] at a position \[m\].
    Field(Box<dyn Fn([f64; 3]) -> [f64; 3] + Send + Sync>),
    /// Velocities along x, y, z at the low faces of the cells, `[z][y][x]` \[m/s\].
    Faces([Vec<f64>; 3]),
}

impl Initial {
    /// The simulation that starts from this field.
    ///
    /// # Errors
    /// As [`Flow::new`], and [`Error::LengthMismatch`] for velocities that are not one for each
    /// cell.
    pub fn start(&self, mesh: Mesh, settings: FlowSettings) -> Result<(Flow, f64), Error> {
        match self {
            Self::Field(field) => Flow::new(mesh, settings, field),
            Self::Faces(faces) => Flow::at_rest(mesh, settings)?.with_faces(faces),
        }
    }
}

#[cfg(test)]
impl Initial {
    /// As [`Self::start`], with the directions of the memory axes given.
    pub(crate) fn start_in_order(
        &self,
        direction: [usize; 3],
        mesh: Mesh,
        settings: FlowSettings,
    ) -> Result<Flow, Error> {
        let layout =
            super::layout::Layout::in_order(&mesh, direction).shared(settings.ranks.clone())?;
        let flow = Flow::with_layout(mesh, settings, layout)?;
        let started = match self {
            Self::Field(field) => flow.with_field(field),
            Self::Faces(faces) => flow.with_faces(faces),
        };
        started.map(|(flow, _)| flow)
    }
}

/// A direction with its cells spread by `mapping`, or equal ones for the strength 0.
fn stretched(direction: Direction, mapping: Mapping) -> Direction {
    if mapping.strength == 0.0 {
        direction
    } else {
        direction.stretched(mapping)
    }
}

/// A flow ready to be simulated.
pub struct Case {
    /// The mesh.
    pub mesh: Mesh,
    /// The settings, which may be changed before the start.
    pub settings: FlowSettings,
    /// The initial field.
    pub initial: Initial,
    /// Time at which the literature ends \[s\].
    pub end_s: f64,
}

impl Case {
    /// The simulation at its start.
    ///
    /// # Errors
    /// As [`Flow::new`].
    pub fn start(&self) -> Result<(Flow, f64), Error> {
        self.initial.start(self.mesh.clone(), self.settings.clone())
    }
}

impl std::fmt::Debug for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Case")
            .field("mesh", &self.mesh)
            .field("settings", &self.settings)
            .finish_non_exhaustive()
    }
}
