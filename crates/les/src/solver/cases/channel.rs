//! Flows between two plates at z = -1 and z = 1: Poiseuille's, Couette's, Rayleigh's layer, and
//! turbulent flow.

use super::super::mesh::{Direction, Mesh, Spread, Wall};
use super::super::settings::{FlowSettings, TimeStep};
use super::{Case, Initial, stretched};
use crate::Error;

/// The plates at z = -1 and 1 with the velocities of the walls along x, `strength` 0 giving equal
/// cells.
pub(super) fn between_plates(cells: usize, strength: f64, velocity_m_s: [f64; 2]) -> Direction {
    let [low, high] = velocity_m_s.map(|u| Wall::NoSlip {
        velocity_m_s: [u, 0.0, 0.0],
    });
    stretched(
        Direction::between(cells, -1.0, 1.0, low, high),
        Spread::TanhBoth.by(strength),
    )
}

/// A laminar flow between the plates at z = -1 and 1, one cell in x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plates {
    /// Cells between the plates.
    pub cells: usize,
    /// Strength of the stretching towards both, 0 for equal cells.
    pub strength: f64,
    /// Kinematic viscosity \[m^2/s\].
    pub viscosity_m2_s: f64,
    /// Fixed time step \[s\].
    pub step_s: f64,
}

impl Plates {
    /// Poiseuille's flow: a force `2 nu` drives `u = 1 - z^2`; it starts from rest plus `share` of
    /// that profile.
    ///
    /// # Errors
    /// Cells, stretching or viscosity out of range.
    pub fn poiseuille(self, share: f64) -> Result<Case, Error> {
        let mut case = self.case([0.0; 2], 10.0, move |z| share * (1.0 - z.powi(2)))?;
        case.settings.force_m_s2 = [2.0 * self.viscosity_m2_s, 0.0, 0.0];
        Ok(case)
    }

    /// Couette's flow: plates at speeds -1 and 1 drag `u = z`; it starts from `share` of that
    /// profile.
    ///
    /// # Errors
    /// As [`Self::poiseuille`].
    pub fn couette(self, share: f64) -> Result<Case, Error> {
        self.case([-1.0, 1.0], 10.0, move |z| share * z)
    }

    /// Slowest decaying mode between plates at rest, `u = cos(pi z/2) exp(-nu pi^2 t/4)`, a Stokes
    /// layer without forcing.
    ///
    /// # Errors
    /// As [`Self::poiseuille`].
    pub fn decaying_layer(self) -> Result<Case, Error> {
        self.case([0.0; 2], 1.0, |z| (0.5 * std::f64::consts::PI * z).cos())
    }

    /// Rayleigh's problem: the low plate starts with speed 1 under a fluid at rest; the high plate
    /// is far away.
    ///
    /// # Errors
    /// As [`Self::poiseuille`].
    pub fn rayleigh_plate(self) -> Result<Case, Error> {
        self.case([1.0, 0.0], 0.05, |_| 0.0)
    }

    /// Walls of speeds `wall_m_s`, an initial `u(z)`, an end after a number of viscous times.
    fn case(
        self,
        wall_m_s: [f64; 2],
        viscous_times: f64,
        u: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> Result<Case, Error> {
        let plates = between_plates(self.cells, self.strength, wall_m_s);
        let mesh = Mesh::new(Direction::thin(1.0), Direction::thin(1.0), plates)?;
        let settings = FlowSettings::new(
            self.viscosity_m2_s,
            TimeStep::Fixed {
                step_s: self.step_s,
            },
        );
        let initial = Initial::Field(Box::new(move |at_m: [f64; 3]| [u(at_m[2]), 0.0, 0.0]));
        Ok(Case {
            mesh,
            settings,
            initial,
            end_s: viscous_times / self.viscosity_m2_s,
        })
    }
}

/// Turbulent channel flow in a box of `2 pi x pi x 2`, driven by the force that balances the
/// friction of `reynolds_tau`; lengths in half heights, velocities in friction velocities. It
/// starts from a mean profile with long streaks and vortices, which trip within a few units of
/// time.
///
/// # Errors
/// Cells, stretching or Reynolds number out of range.
pub fn channel(cells: [usize; 3], strength: f64, reynolds_tau: f64) -> Result<Case, Error> {
    use std::f64::consts::TAU;
    let mesh = Mesh::new(
        Direction::periodic(cells[0], 0.0, TAU),
        Direction::periodic(cells[1], 0.0, 0.5 * TAU),
        between_plates(cells[2], strength, [0.0; 2]),
    )?;
    let mut settings = FlowSettings::new(
        1.0 / reynolds_tau,
        TimeStep::Courant {
            courant: 0.35,
            longest_s: 0.01,
        },
    );
    settings.force_m_s2 = [1.0, 0.0, 0.0];
    Ok(Case {
        mesh,
        settings,
        initial: Initial::Field(Box::new(move |at_m| initial_channel(at_m, reynolds_tau))),
        end_s: 20.0,
    })
}

/// Mean profile of a channel flow with long streaks and vortices.
fn initial_channel([x, y, z]: [f64; 3], reynolds_tau: f64) -> [f64; 3] {
    let wall = 1.0 - z.abs();
    let plus = wall * reynolds_tau;
    // Reichardt's law of the wall.
    let mean = (1.0 + 0.41 * plus).ln() / 0.41
        + 7.8 * (1.0 - (-plus / 11.0).exp() - plus / 11.0 * (-plus / 3.0).exp());
    let shape = (1.0 - z * z).powi(2);
    let streaks = 4.0 * (8.0 * y).cos() * shape * (1.0 + 0.3 * (2.0 * x).sin());
    let v = 1.5 * (4.0 * y + x).sin() * (-4.0 * z * (1.0 - z * z)) / 4.0
        + 0.5 * (3.0 * x).sin() * shape;
    let w = -1.5 * (4.0 * y + x).cos() * shape;
    [mean + streaks, v, w]
}
