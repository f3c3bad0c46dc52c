//! All that a simulation is made of: mesh, settings, initial field, and its start.

use super::wake::WakeHistory;
use crate::Error;
pub(super) use wakescope_les::cases::Initial;
use wakescope_les::solver::{Stability, UndampedGrowth};
use wakescope_les::{Flow, FlowSettings, Mesh};

/// All that a simulation is made of.
pub(super) struct Setup {
    pub(super) mesh: Mesh,
    pub(super) settings: FlowSettings,
    pub(super) initial: Initial,
    /// The case's own end \[s\].
    pub(super) end_s: Option<f64>,
    /// Age of the wake per time \[1/s\]; 1 where there is no wake.
    pub(super) tau_per_s: f64,
    /// What a wake is measured by, still without a record.
    pub(super) wake: Option<WakeHistory>,
    /// Waves for which Runge-Kutta was taken in place of Adams-Bashforth.
    pub(super) undamped: Option<UndampedGrowth>,
}

impl Setup {
    /// How the cells carry and damp the waves of the initial field.
    pub(super) fn stability(&self) -> Stability {
        Stability::of(&self.mesh, &self.settings, self.initial_velocity())
    }

    /// Velocity of the initial field in the cell of the indices along x, y, z: at its centre, or at its low faces.
    pub(super) fn initial_velocity(&self) -> impl Fn([usize; 3]) -> [f64; 3] + Sync {
        let centre_m = [0, 1, 2].map(|axis| self.mesh.centre_m(axis));
        let [nx, ny, _] = self.mesh.cells();
        move |cell| match &self.initial {
            Initial::Field(field) => field([0, 1, 2].map(|axis| centre_m[axis][cell[axis]])),
            Initial::Faces(faces) => faces
                .each_ref()
                .map(|face| face[(cell[2] * ny + cell[1]) * nx + cell[0]]),
        }
    }

    /// The flow at its start, and its kinetic energy before the projection, m^5/s^2.
    pub(super) fn start(self) -> Result<(Flow, f64), Error> {
        let Self {
            mesh,
            settings,
            initial,
            ..
        } = self;
        initial.start(mesh, settings).map_err(Error::Flow)
    }
}
