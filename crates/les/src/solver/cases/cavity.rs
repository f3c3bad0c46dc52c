//! The lid-driven cavity (Ghia, Ghia and Shin 1982; Botella and Peyret 1998).

use super::super::mesh::{Direction, Mesh, Spread, Wall};
use super::super::settings::{FlowSettings, TimeStep};
use super::{Case, Initial, stretched};
use crate::Error;

/// The unit square in y and z, at rest, whose lid z = 1 moves along y with speed 1; `1/reynolds` is the viscosity.
///
/// # Errors
/// Cells, stretching or Reynolds number out of range.
pub fn lid_driven_cavity(cells: usize, strength: f64, reynolds: f64) -> Result<Case, Error> {
    let lid = Wall::NoSlip { velocity_m_s: [0.0, 1.0, 0.0] };
    let direction = |high| {
        let uniform = Direction::between(cells, 0.0, 1.0, Wall::AT_REST, high);
        stretched(uniform, Spread::TanhBoth.by(strength))
    };
    let mesh = Mesh::new(Direction::thin(1.0), direction(Wall::AT_REST), direction(lid))?;
    let settings = FlowSettings::new(1.0 / reynolds, TimeStep::Courant { courant: 0.35, longest_s: 0.02 });
    Ok(Case { mesh, settings, initial: Initial::Field(Box::new(|_| [0.0; 3])), end_s: 60.0 })
}
