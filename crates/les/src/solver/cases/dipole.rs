//! A dipole of two shielded vortices that runs straight against a wall (Clercx and Bruneau 2006).

use super::super::mesh::{Direction, Mapping, Mesh, Wall};
use super::super::settings::{FlowSettings, TimeStep};
use super::{Case, Initial};
use crate::Error;

/// Vorticity at the centres of the two vortices \[1/s\]: makes the energy of the box 2 and its enstrophy 800.
const CENTRE_VORTICITY_PER_S: f64 = 299.528_385_375_226;
/// Radius of the vortices \[m\].
pub(super) const RADIUS_M: f64 = 0.1;

/// The dipole in the plane y, z of the box `[-1, 1]^2`, running along z; `1/reynolds` is the viscosity. The walls at z = -1
/// and 1 are no-slip; those at y = -1 and 1 too if `closed`, else y is periodic. `strength` refines y in its middle, where the
/// vortices stay ([`Mapping::SinhMiddle`] between walls, else [`Mapping::Cluster`]), and z towards its walls; 0 for equal cells.
///
/// # Errors
/// Cells, stretching or Reynolds number out of range.
pub fn dipole_against_wall(cells: [usize; 2], strength: [f64; 2], reynolds: f64, closed: bool) -> Result<Case, Error> {
    let walls = |n| Direction::between(n, -1.0, 1.0, Wall::AT_REST, Wall::AT_REST);
    let stretched = |d: Direction, strength, mapping| if strength == 0.0 { d } else { d.stretched(mapping) };
    let [lateral, wall] = strength;
    let y = if closed {
        stretched(walls(cells[0]), lateral, Mapping::SinhMiddle { strength: lateral })
    } else {
        let middle = Mapping::Cluster { strength: lateral, place: 0.5 };
        stretched(Direction::periodic(cells[0], -1.0, 1.0), lateral, middle)
    };
    let z = stretched(walls(cells[1]), wall, Mapping::TanhBoth { strength: wall });
    let mesh = Mesh::new(Direction::thin(1.0), y, z)?;
    let settings = FlowSettings::new(1.0 / reynolds, TimeStep::Courant { courant: 0.35, longest_s: 1e-3 });
    let initial = |at_m: [f64; 3]| {
        let mut velocity = [0.0; 3];
        for (y_m, sign) in [(RADIUS_M, 1.0), (-RADIUS_M, -1.0)] {
            let (y, z) = (at_m[1] - y_m, at_m[2]);
            // r times the tangential speed over r^2 of a shielded vortex.
            let rotation_per_s = 0.5 * sign * CENTRE_VORTICITY_PER_S * (-(y * y + z * z) / RADIUS_M.powi(2)).exp();
            velocity[1] -= rotation_per_s * z;
            velocity[2] += rotation_per_s * y;
        }
        velocity
    };
    Ok(Case { mesh, settings, initial: Initial::Field(Box::new(initial)), end_s: 0.75 })
}
