//! Which pressure solver a mesh gets, and what it needs, before one is built.
//!
//! Check: the directions that a solver names as products with a matrix.

use super::super::layout::Layout;
use super::super::mesh::Mesh;
use super::direct;
use super::transform::RowTransform;

/// How the pressure equation is solved.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum PressureMethod {
    /// The faster one for the mesh.
    #[default]
    Auto,
    /// Transforms and a banded factorisation: the residual is round-off.
    Direct,
    /// A transform along one direction, and for each of its modes conjugate gradients with multigrid in the other two.
    Multigrid,
}

/// Cells of a dense direction from which multigrid is faster to a residual of 1e-6.
const DENSE_LIMIT: usize = 3000;

impl PressureMethod {
    /// Cells of the directions that this method transforms by products with a dense matrix on `mesh`: a matrix of `n` x `n` takes
    /// the time of `n^3` to find, and its products that of `n` per cell and solve.
    pub fn dense_directions(self, mesh: &Mesh) -> Vec<usize> {
        let layout = Layout::new(mesh);
        let mut dense = if self.takes_multigrid(&layout) { Vec::new() } else { direct::dense_axes(&layout) };
        if RowTransform::is_dense(&layout.line[0]) {
            dense.push(0);
        }
        dense.into_iter().map(|axis| layout.shape.n[axis]).filter(|n| *n > 1).collect()
    }

    /// Whether this method solves the planes of `mesh` by multigrid, in passes over all cells.
    pub fn is_multigrid(self, mesh: &Mesh) -> bool {
        self.takes_multigrid(&Layout::new(mesh))
    }

    pub(super) fn takes_multigrid(self, layout: &Layout) -> bool {
        match self {
            Self::Auto => direct::dense_axes(layout).into_iter().any(|axis| layout.shape.n[axis] > DENSE_LIMIT),
            Self::Direct => false,
            Self::Multigrid => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::mesh::{Direction, Spread, Wall};
    use super::*;

    #[test]
    fn directions_with_a_matrix_are_those_that_the_solvers_name() {
        let periodic = |n| Direction::periodic(n, 0.0, 1.0);
        let between = |n| Direction::between(n, 0.0, 1.0, Wall::Slip, Wall::Slip);
        let sine = |n| periodic(n).stretched(Spread::Sine.by(0.3));
        for [x, y, z] in [
            [periodic(16), periodic(20), between(24)],
            [periodic(1), sine(20), between(24)],
            [periodic(1), between(20), between(24)],
            [sine(14), periodic(20), between(24)],
        ] {
            let mesh = Mesh::new(x, y, z).unwrap();
            for method in [PressureMethod::Direct, PressureMethod::Multigrid] {
                let dense = method.dense_directions(&mesh);
                let solver = format!("{:?}", super::super::solver::PressureSolver::new(&Layout::new(&mesh), method));
                assert_eq!(solver.matches("Dense").count(), dense.len(), "{method:?}: {dense:?}");
                assert_eq!(solver.contains("Multigrid"), method.is_multigrid(&mesh), "{method:?}");
                assert!(dense.iter().all(|n| mesh.cells().contains(n)));
            }
        }
    }
}
