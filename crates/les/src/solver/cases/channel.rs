//! Flows between two plates at z = -1 and z = 1: Poiseuille's, Couette's, Rayleigh's layer, and turbulent flow.

use super::super::mesh::{Direction, Mapping, Mesh, Wall};
use super::super::settings::{FlowSettings, TimeStep};
use super::{Case, Initial};
use crate::Error;

/// The plates at z = -1 and 1 with the velocities of the walls along x, `strength` 0 giving equal cells.
pub(super) fn between_plates(cells: usize, strength: f64, velocity_m_s: [f64; 2]) -> Direction {
    let [low, high] = velocity_m_s.map(|u| Wall::NoSlip { velocity_m_s: [u, 0.0, 0.0] });
    let uniform = Direction::between(cells, -1.0, 1.0, low, high);
    if strength == 0.0 { uniform } else { uniform.stretched(Mapping::TanhBoth { strength }) }
}

/// Poiseuille's flow: a force `2 nu` drives `u = 1 - z^2`; it starts from rest plus `share` of that profile.
///
/// # Errors
/// Cells, stretching or viscosity out of range.
pub fn poiseuille(cells: usize, strength: f64, viscosity_m2_s: f64, share: f64, step_s: f64) -> Result<Case, Error> {
    let mesh = Mesh::new(Direction::thin(1.0), Direction::thin(1.0), between_plates(cells, strength, [0.0; 2]))?;
    let mut settings = FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s });
    settings.force_m_s2 = [2.0 * viscosity_m2_s, 0.0, 0.0];
    let initial = move |at_m: [f64; 3]| [share * (1.0 - at_m[2].powi(2)), 0.0, 0.0];
    Ok(Case { mesh, settings, initial: Initial::Field(Box::new(initial)), end_s: 10.0 / viscosity_m2_s })
}

/// Couette's flow: plates at speeds -1 and 1 drag `u = z`; it starts from `share` of that profile.
///
/// # Errors
/// Cells, stretching or viscosity out of range.
pub fn couette(cells: usize, strength: f64, viscosity_m2_s: f64, share: f64, step_s: f64) -> Result<Case, Error> {
    let plates = between_plates(cells, strength, [-1.0, 1.0]);
    let mesh = Mesh::new(Direction::thin(1.0), Direction::thin(1.0), plates)?;
    let settings = FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s });
    let initial = move |at_m: [f64; 3]| [share * at_m[2], 0.0, 0.0];
    Ok(Case { mesh, settings, initial: Initial::Field(Box::new(initial)), end_s: 10.0 / viscosity_m2_s })
}

/// Slowest decaying mode between plates at rest, `u = cos(pi z/2) exp(-nu pi^2 t/4)`, a Stokes layer without forcing.
///
/// # Errors
/// Cells, stretching or viscosity out of range.
pub fn decaying_layer(cells: usize, strength: f64, viscosity_m2_s: f64, step_s: f64) -> Result<Case, Error> {
    let plates = between_plates(cells, strength, [0.0; 2]);
    let mesh = Mesh::new(Direction::thin(1.0), Direction::thin(1.0), plates)?;
    let settings = FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s });
    let initial = |at_m: [f64; 3]| [(0.5 * std::f64::consts::PI * at_m[2]).cos(), 0.0, 0.0];
    Ok(Case { mesh, settings, initial: Initial::Field(Box::new(initial)), end_s: 1.0 / viscosity_m2_s })
}

/// Rayleigh's problem: the low plate starts with speed 1 under a fluid at rest; the high plate is far away.
///
/// # Errors
/// Cells, stretching or viscosity out of range.
pub fn rayleigh_plate(cells: usize, strength: f64, viscosity_m2_s: f64, step_s: f64) -> Result<Case, Error> {
    let plates = between_plates(cells, strength, [1.0, 0.0]);
    let mesh = Mesh::new(Direction::thin(1.0), Direction::thin(1.0), plates)?;
    let settings = FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s });
    Ok(Case { mesh, settings, initial: Initial::Field(Box::new(|_| [0.0; 3])), end_s: 0.05 / viscosity_m2_s })
}

/// Turbulent channel flow in a box of `2 pi x pi x 2`, driven by the force that balances the friction of
/// `reynolds_tau`; lengths in half heights, velocities in friction velocities. It starts from a mean profile with
/// long streaks and vortices, which trip within a few units of time.
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
    let mut settings = FlowSettings::new(1.0 / reynolds_tau, TimeStep::Courant { courant: 0.35, longest_s: 0.01 });
    settings.force_m_s2 = [1.0, 0.0, 0.0];
    let initial = move |at_m: [f64; 3]| {
        let [x, y, z] = at_m;
        let wall = 1.0 - z.abs();
        let plus = wall * reynolds_tau;
        // Reichardt's law of the wall.
        let mean =
            (1.0 + 0.41 * plus).ln() / 0.41 + 7.8 * (1.0 - (-plus / 11.0).exp() - plus / 11.0 * (-plus / 3.0).exp());
        let shape = (1.0 - z * z).powi(2);
        let streaks = 4.0 * (8.0 * y).cos() * shape * (1.0 + 0.3 * (2.0 * x).sin());
        let v = 1.5 * (4.0 * y + x).sin() * (-4.0 * z * (1.0 - z * z)) / 4.0 + 0.5 * (3.0 * x).sin() * shape;
        let w = -1.5 * (4.0 * y + x).cos() * shape;
        [mean + streaks, v, w]
    };
    Ok(Case { mesh, settings, initial: Initial::Field(Box::new(initial)), end_s: 20.0 })
}
