//! Vortices of Taylor and Green: the decaying ones of the plane, an exact solution, and those of
//! space, which become turbulent.

use std::f64::consts::{PI, TAU};

use super::super::mesh::{Direction, Mesh, Spread, Wall};
use super::super::settings::{FlowSettings, TimeStep};
use super::{Case, Initial, stretched};
use crate::Error;

/// The vortices of the plane on `cells` x `cells` of the unit square in y and z, stretched by sines
/// of the amplitudes `stretch`; the time step is fixed.
///
/// # Errors
/// Cells, stretching or viscosity out of range.
pub fn taylor_green_plane(
    cells: usize,
    stretch: [f64; 2],
    viscosity_m2_s: f64,
    step_s: f64,
) -> Result<Case, Error> {
    let [y, z] = stretch.map(|amplitude| {
        let equal = Direction::periodic(cells, 0.0, 1.0);
        stretched(equal, Spread::Sine.by(amplitude))
    });
    let mesh = Mesh::new(Direction::thin(1.0), y, z)?;
    let settings = FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s });
    Ok(Case {
        mesh,
        settings,
        initial: Initial::Field(Box::new(move |at_m| {
            taylor_green_plane_exact(at_m, 0.0, viscosity_m2_s)
        })),
        end_s: 1.0,
    })
}

/// Velocity of the vortices of the plane at any time:
/// `v = sin(2 pi y) cos(2 pi z) exp(-8 pi^2 nu t)`.
pub fn taylor_green_plane_exact(at_m: [f64; 3], time_s: f64, viscosity_m2_s: f64) -> [f64; 3] {
    let decay = (-2.0 * viscosity_m2_s * TAU * TAU * time_s).exp();
    let y = TAU * at_m[1];
    let z = TAU * at_m[2];
    [0.0, y.sin() * z.cos() * decay, -y.cos() * z.sin() * decay]
}

/// The vortices of space in the box `2 pi` wide, `u = sin x cos y cos z`, `v = -cos x sin y cos z`,
/// `w = 0`, viscosity `1/reynolds`, with a Courant number that the scheme takes by default.
///
/// # Errors
/// Cells or Reynolds number out of range.
pub fn taylor_green_3d(cells: usize, reynolds: f64) -> Result<Case, Error> {
    in_space(|| Direction::periodic(cells, 0.0, TAU), reynolds)
}

/// The eighth of [`taylor_green_3d`] between the planes of symmetry, `cells` over `pi`: the same
/// flow, as these planes are frictionless walls, at an eighth of the cost.
///
/// # Errors
/// Cells or Reynolds number out of range.
pub fn taylor_green_eighth(cells: usize, reynolds: f64) -> Result<Case, Error> {
    in_space(
        || Direction::between(cells, 0.0, PI, Wall::Slip, Wall::Slip),
        reynolds,
    )
}

fn in_space(direction: impl Fn() -> Direction, reynolds: f64) -> Result<Case, Error> {
    let mesh = Mesh::new(direction(), direction(), direction())?;
    let time_step = TimeStep::Courant {
        courant: 0.35,
        longest_s: 0.1,
    };
    let settings = FlowSettings::new(1.0 / reynolds, time_step);
    Ok(Case {
        mesh,
        settings,
        initial: Initial::Field(Box::new(|[x, y, z]| {
            [
                x.sin() * y.cos() * z.cos(),
                -x.cos() * y.sin() * z.cos(),
                0.0,
            ]
        })),
        end_s: 10.0,
    })
}
