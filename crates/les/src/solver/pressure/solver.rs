//! The solver of the pressure equation of one mesh: a method, called again for what it leaves till
//! the residual of the field is what was asked for. The residual is computed anew from the field,
//! so that it holds the round-off of everything.
//!
//! Which method a mesh gets, and what it needs, is known before one is built.
//!
//! Check: the directions that a solver names as products with a matrix.

use super::super::layout::Layout;
use super::super::mesh::Mesh;
use super::apply::Operator;
use super::direct;
use super::direct::Direct;
use super::method::Method;
use super::multigrid::Multigrid;
use super::transform::RowTransform;
use crate::error::{Error, PressureFailure, check};
use crate::solver::aligned::Aligned;
use crate::solver::slabs::WHOLE;
use rayon::prelude::*;

/// How the pressure equation is solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PressureMethod {
    /// The faster one for the mesh.
    #[default]
    Auto,
    /// Transforms and a banded factorisation: the residual is round-off.
    Direct,
    /// A transform along one direction, and for each of its modes conjugate gradients with
    /// multigrid in the other two.
    Multigrid,
}

/// Cells of a dense direction from which multigrid is faster to a residual of 1e-6.
const DENSE_LIMIT: usize = 3000;

impl PressureMethod {
    /// Cells of the directions that this method transforms by products with a dense matrix on
    /// `mesh`: a matrix of `n` x `n` takes the time of `n^3` to find, and its products that of `n`
    /// per cell and solve.
    pub fn dense_directions(self, mesh: &Mesh) -> Vec<usize> {
        let layout = Layout::new(mesh);
        let mut dense = if self.takes_multigrid(&layout) {
            Vec::new()
        } else {
            direct::dense_axes(&layout)
        };
        if RowTransform::is_dense(&layout.line[0]) {
            dense.push(0);
        }
        dense
            .into_iter()
            .map(|axis| layout.shape.n[axis])
            .filter(|n| *n > 1)
            .collect()
    }

    /// Whether this method solves the planes of `mesh` by multigrid, in passes over all cells.
    pub fn is_multigrid(self, mesh: &Mesh) -> bool {
        self.takes_multigrid(&Layout::new(mesh))
    }

    pub(super) fn takes_multigrid(self, layout: &Layout) -> bool {
        match self {
            Self::Auto => direct::dense_axes(layout)
                .into_iter()
                .any(|axis| layout.shape.n[axis] > DENSE_LIMIT),
            Self::Direct => false,
            Self::Multigrid => true,
        }
    }
}

/// Solves after which the residual no longer falls.
const MAX_SOLVES: usize = 8;
/// A solve that leaves more than this has stalled.
const STALLED: f64 = 0.5;
/// Fraction of the tolerance that a solve has to reach: its residual is not exactly the field's.
const SAFETY: f64 = 0.999;
/// A solution that improves no more is held up by round-off if it leaves at most this multiple of
/// the last digit's share.
const ROUND_OFF: f64 = 4.0;
/// Part of the tolerance that an imbalance may add to the residual.
const BALANCED: f64 = 0.01;

/// What a solve did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Solved {
    /// 2-norm of the residual over that of the right side less what no pressure can balance,
    /// measured on the solution.
    pub(crate) residual: f64,
    /// Iterations, 0 for a direct solve.
    pub(crate) iterations: usize,
    /// Mean factor by which an iteration reduced the residual.
    pub(crate) factor: Option<f64>,
}

/// A solver of the pressure equation of one mesh.
#[derive(Debug)]
pub(crate) struct PressureSolver {
    pub(super) operator: Operator,
    method: Box<dyn Method>,
    right: Aligned,
    /// Residual of the solution, then the correction that is added to it; empty until needed.
    correction: Aligned,
}

impl PressureSolver {
    /// The solver that `method` asks for.
    pub(crate) fn new(layout: &Layout, method: PressureMethod) -> Self {
        let method: Box<dyn Method> = if method.takes_multigrid(layout) {
            Box::new(Multigrid::new(layout))
        } else {
            Box::new(Direct::new(layout))
        };
        let right = Aligned::zeros(layout.shape.len());
        Self {
            operator: Operator::new(layout),
            method,
            right,
            correction: Aligned::default(),
        }
    }

    /// Replaces the weighted divergence `g` in `field` by `phi`, of zero weighted mean, halos
    /// included.
    ///
    /// # Errors
    /// [`Error::PressureNotSolved`] if the residual does not reach `tolerance` (2-norm, relative to
    /// the right side); the field is then the last solution found.
    pub(crate) fn solve(&mut self, field: &mut [f64], tolerance: f64) -> Result<Solved, Error> {
        check("tolerance", tolerance, "above 0 and below 1", |t| {
            t > 0.0 && t < 1.0
        })?;
        // The methods ignore what no pressure can balance; the residual must not contain it.
        let size = self
            .operator
            .copy_balanced(field, &mut self.right, BALANCED * tolerance)?;
        if size == 0.0 {
            field.fill(0.0);
            return Ok(Solved {
                residual: 0.0,
                iterations: 0,
                factor: None,
            });
        }
        let mut iterations = 0;
        let mut history = Vec::new();
        let mut last = 1.0;
        let mut attainable = 0.0;
        let reason = loop {
            let target = f64::max(SAFETY * tolerance, 0.25 * attainable) / last;
            iterations += if history.is_empty() {
                self.first_solve(field, size, target)?
            } else {
                self.refine(field, last * size, target)?
            };
            self.operator.slabs.halos(&mut [field], WHOLE)?;
            let residual = self.operator.residual_norm(&self.right, field)? / size;
            history.push(residual);
            if residual <= tolerance {
                let factor = (iterations > 0).then(|| residual.powf(1.0 / iterations as f64));
                return Ok(Solved {
                    residual,
                    iterations,
                    factor,
                });
            }
            if residual.is_nan() {
                break PressureFailure::NotFinite;
            }
            attainable = self.operator.round_off(field)? / size;
            if residual > STALLED * last || history.len() == MAX_SOLVES {
                break stalled_or_round_off(residual.min(last), attainable);
            }
            last = residual;
        };
        Err(Error::PressureNotSolved {
            method: self.method.name(),
            tolerance,
            reason,
            iterations,
            history,
        })
    }

    /// Replaces the right side in `field` by a solution; returns the iterations.
    fn first_solve(&self, field: &mut [f64], size: f64, target: f64) -> Result<usize, Error> {
        let own = self.operator.slabs.shape.own_range();
        self.method.solve(&mut field[own], size, target)
    }

    /// Adds to `field` a solution for its residual of norm `size`; returns the iterations.
    fn refine(&mut self, field: &mut [f64], size: f64, target: f64) -> Result<usize, Error> {
        if self.correction.is_empty() {
            self.correction = Aligned::zeros(field.len());
        }
        self.operator
            .residual(&self.right, field, &mut self.correction);
        // The methods take the negative of their right side.
        self.correction
            .par_iter_mut()
            .for_each(|value| *value = -*value);
        let own = self.operator.slabs.shape.own_range();
        let iterations = self.method.solve(&mut self.correction[own], size, target)?;
        field
            .par_iter_mut()
            .zip(&self.correction[..])
            .for_each(|(phi, correction)| *phi += correction);
        Ok(iterations)
    }
}

/// Why a residual falls no more, if round-off leaves about `attainable`.
fn stalled_or_round_off(residual: f64, attainable: f64) -> PressureFailure {
    if residual <= ROUND_OFF * attainable {
        PressureFailure::RoundOff { attainable }
    } else {
        PressureFailure::Stalled
    }
}

/// Accepts a solution whose residual is limited by round-off, and one that is not finite, which
/// the step reports.
///
/// # Errors
/// Those of a solve that stalled, or of the exchange between ranks.
pub(crate) fn accept_round_off(solved: Result<Solved, Error>) -> Result<(), Error> {
    match solved {
        Err(Error::PressureNotSolved {
            reason: PressureFailure::Stalled,
            ..
        }) => solved.map(drop),
        Err(Error::PressureNotSolved { .. }) => Ok(()),
        other => other.map(drop),
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
                let solver = format!(
                    "{:?}",
                    super::super::solver::PressureSolver::new(&Layout::new(&mesh), method)
                );
                assert_eq!(
                    solver.matches("Dense").count(),
                    dense.len(),
                    "{method:?}: {dense:?}"
                );
                assert_eq!(
                    solver.contains("Multigrid"),
                    method.is_multigrid(&mesh),
                    "{method:?}"
                );
                assert!(dense.iter().all(|n| mesh.cells().contains(n)));
            }
        }
    }
}
