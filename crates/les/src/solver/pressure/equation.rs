//! The pressure equation of a mesh, for use outside the flow solver.

use super::super::layout::Layout;
use super::super::mesh::Mesh;
use super::cost::PressureMethod;
use super::solver::{PressureSolver, Solved, check_length};
use crate::Error;

/// Poisson's equation on a staggered mesh, `div grad phi = d` with zero normal gradient at the planes that bound the mesh, in
/// fourth order.
///
/// Divergence and gradient are those of the flow solver: summation-by-parts operators on the mapped mesh, so that the
/// discrete problem is symmetric, has a solution whenever the sum of `d` times the cells' masses is zero, and leaves no
/// divergence beyond its residual. A field has one value for each cell, `[z][y][x]` with x contiguous.
///
/// ```
/// use wakescope_les::solver::{PressureEquation, PressureMethod};
/// use wakescope_les::{Direction, Mapping, Mesh, Wall};
///
/// let x = Direction::periodic(16, 0.0, 2.0);
/// let y = Direction::between(20, -1.0, 1.0, Wall::Slip, Wall::Slip);
/// let z = Direction::between(24, 0.0, 3.0, Wall::AT_REST, Wall::Slip).stretched(Mapping::TanhLow { strength: 2.0 });
/// let mut equation = PressureEquation::new(&Mesh::new(x, y, z)?, PressureMethod::Auto);
/// let mut right = vec![0.0; 16 * 20 * 24];
/// right[5] = 1.0;
/// right[5000] = -1.0; // A source and a sink of the same strength.
/// let mut phi = right.clone();
/// equation.solve(&mut phi, 1e-10)?;
/// assert!(equation.residual(&right, &phi)? < 1e-10);
/// # Ok::<(), wakescope_les::Error>(())
/// ```
#[derive(Debug)]
pub struct PressureEquation {
    layout: Layout,
    solver: PressureSolver,
}

impl PressureEquation {
    /// Prepares the solver that `method` asks for.
    pub fn new(mesh: &Mesh, method: PressureMethod) -> Self {
        // With one cell in x, `[z][y][x]` has y contiguous.
        let order = if mesh.cells()[0] == 1 { [1, 2, 0] } else { [0, 1, 2] };
        let layout = Layout::in_order(mesh, order);
        Self { solver: PressureSolver::new(&layout, method), layout }
    }

    /// Turns a divergence `d` into the equation's right side `g`: multiplies each value by the mass of its cell, which is its
    /// volume \[m^3\] but for the three cells at a no-slip wall.
    ///
    /// # Errors
    /// [`Error::WrongFieldLength`].
    pub fn weigh(&self, divergence: &mut [f64]) -> Result<(), Error> {
        check_length(self.layout.shape, divergence)?;
        self.solver.operator.weigh(divergence);
        Ok(())
    }

    /// Replaces the right side `g` in `field` by the solution `phi`, whose mean over the masses is zero.
    ///
    /// What no `phi` can balance, a sum of `g` that is not zero, is removed and reported.
    ///
    /// # Errors
    /// [`Error::WrongFieldLength`], [`Error::OutOfRange`] for a tolerance outside (0, 1), and [`Error::PressureNotSolved`] if
    /// the residual does not reach `tolerance` (2-norm, relative to the right side).
    pub fn solve(&mut self, field: &mut [f64], tolerance: f64) -> Result<Solved, Error> {
        self.solver.solve(field, tolerance)
    }

    /// 2-norm of what `phi` leaves of the right side `g`, relative to that of `g`.
    ///
    /// # Errors
    /// [`Error::WrongFieldLength`].
    pub fn residual(&self, g: &[f64], phi: &[f64]) -> Result<f64, Error> {
        check_length(self.layout.shape, g)?;
        check_length(self.layout.shape, phi)?;
        self.solver.operator.relative_residual(g, phi)
    }

    /// The method and what it does in each direction.
    pub fn describe(&self) -> String {
        self.solver.describe()
    }
}
