//! Plane flows in a box: a dipole of two shielded vortices that runs straight against a wall
//! (Clercx and Bruneau 2006), and the lid-driven cavity (Ghia, Ghia and Shin 1982; Botella and
//! Peyret 1998).

use super::super::mesh::{Direction, Mesh, Spread, Wall};
use super::super::settings::{FlowSettings, TimeStep};
use super::{Case, Initial, stretched};
use crate::Error;

/// Vorticity at the centres of the two vortices \[1/s\]: makes the energy of the box 2 and its
/// enstrophy 800.
const CENTRE_VORTICITY_PER_S: f64 = 299.528_385_375_226;
/// Radius of the vortices \[m\].
const RADIUS_M: f64 = 0.1;

/// The dipole in the plane y, z of the box `[-1, 1]^2`, running along z between no-slip walls at
/// z = -1 and 1, with y periodic; `1/reynolds` is the viscosity. `strength` refines y in its
/// middle, where the vortices stay ([`Spread::Cluster`]), and z towards its walls; 0 for equal
/// cells.
///
/// # Errors
/// Cells, stretching or Reynolds number out of range.
pub fn dipole_between_walls(
    cells: [usize; 2],
    strength: [f64; 2],
    reynolds: f64,
) -> Result<Case, Error> {
    let middle = Spread::Cluster.by(strength[0]);
    dipole(
        stretched(Direction::periodic(cells[0], -1.0, 1.0), middle),
        cells[1],
        strength[1],
        reynolds,
    )
}

/// The same in a box closed by no-slip walls at y = -1 and 1 as well; y is refined by
/// [`Spread::SinhMiddle`].
///
/// # Errors
/// As [`dipole_between_walls`].
pub fn dipole_in_a_box(
    cells: [usize; 2],
    strength: [f64; 2],
    reynolds: f64,
) -> Result<Case, Error> {
    let middle = Spread::SinhMiddle.by(strength[0]);
    dipole(
        stretched(walls(cells[0]), middle),
        cells[1],
        strength[1],
        reynolds,
    )
}

fn walls(cells: usize) -> Direction {
    Direction::between(cells, -1.0, 1.0, Wall::AT_REST, Wall::AT_REST)
}

fn dipole(y: Direction, cells: usize, strength: f64, reynolds: f64) -> Result<Case, Error> {
    let z = stretched(walls(cells), Spread::TanhBoth.by(strength));
    let mesh = Mesh::new(Direction::thin(1.0), y, z)?;
    let settings = FlowSettings::new(
        1.0 / reynolds,
        TimeStep::Courant {
            courant: 0.35,
            longest_s: 1e-3,
        },
    );
    Ok(Case {
        mesh,
        settings,
        initial: Initial::Field(Box::new(dipole_velocity_m_s)),
        end_s: 0.75,
    })
}

/// Velocity of two shielded vortices of opposite sign.
fn dipole_velocity_m_s([_, y_m, z_m]: [f64; 3]) -> [f64; 3] {
    let mut velocity_m_s = [0.0; 3];
    for (centre_y_m, sign) in [(RADIUS_M, 1.0), (-RADIUS_M, -1.0)] {
        let dy_m = y_m - centre_y_m;
        // The tangential speed over the radius of a shielded vortex.
        let rotation_per_s = 0.5
            * sign
            * CENTRE_VORTICITY_PER_S
            * (-(dy_m * dy_m + z_m * z_m) / RADIUS_M.powi(2)).exp();
        velocity_m_s[1] -= rotation_per_s * z_m;
        velocity_m_s[2] += rotation_per_s * dy_m;
    }
    velocity_m_s
}

/// The unit square in y and z, at rest, whose lid z = 1 moves along y with speed 1; `1/reynolds` is
/// the viscosity.
///
/// # Errors
/// Cells, stretching or Reynolds number out of range.
pub fn lid_driven_cavity(cells: usize, strength: f64, reynolds: f64) -> Result<Case, Error> {
    let lid = Wall::NoSlip {
        velocity_m_s: [0.0, 1.0, 0.0],
    };
    let [y, z] = [Wall::AT_REST, lid].map(|high| {
        let equal = Direction::between(cells, 0.0, 1.0, Wall::AT_REST, high);
        stretched(equal, Spread::TanhBoth.by(strength))
    });
    let mesh = Mesh::new(Direction::thin(1.0), y, z)?;
    let settings = FlowSettings::new(
        1.0 / reynolds,
        TimeStep::Courant {
            courant: 0.35,
            longest_s: 0.02,
        },
    );
    Ok(Case {
        mesh,
        settings,
        initial: Initial::Field(Box::new(|_| [0.0; 3])),
        end_s: 60.0,
    })
}
