//! Solving again for what a solve leaves, till the residual of the field is what was asked for.
//!
//! The residual is computed anew from the field, so that it holds the round-off of everything.

use rayon::prelude::*;

use super::apply::{Operator, norm};

/// Relative residuals that a pass saw after its iterations; none if it has none.
#[derive(Debug)]
pub(crate) struct Pass(pub(crate) Vec<f64>);

/// What was reached.
#[derive(Debug)]
pub(crate) struct Done {
    pub(crate) residual: f64,
    pub(crate) iterations: usize,
    pub(crate) imbalance: f64,
}

/// Fields kept from solve to solve.
#[derive(Debug, Default)]
pub(crate) struct Refinement {
    right: Vec<f64>,
    left: Vec<f64>,
}

/// Passes after which the residual no longer falls.
const MAX_PASSES: usize = 5;
/// A pass that leaves more than this has stalled.
const STALLED: f64 = 0.5;
/// Part of the tolerance asked of a pass: the residual it sees is not exactly the field's.
const SAFETY: f64 = 0.999;

impl Refinement {
    /// Replaces the right side in `field` by the solution. `solve` replaces a right side of the given norm by a solution of
    /// about the given relative residual.
    ///
    /// # Errors
    /// The residuals, if they do not reach `tolerance`.
    pub(crate) fn run(
        &mut self,
        operator: &Operator,
        field: &mut [f64],
        tolerance: f64,
        mut solve: impl FnMut(&mut [f64], f64, f64) -> Pass,
    ) -> Result<Done, Vec<f64>> {
        let imbalance = operator.remove_imbalance(field);
        self.right.clear();
        self.right.extend_from_slice(field);
        self.left.resize(field.len(), 0.0);
        let size = norm(operator.shape(), field);
        let relative = |length: f64| if size > 0.0 { length / size } else { length };
        let (mut iterations, mut history) = (0, Vec::new());
        let mut last = 1.0;
        for pass in 0..MAX_PASSES {
            // Of a later pass the right side is what the field so far leaves.
            let right = if pass == 0 { &mut *field } else { &mut self.left };
            let Pass(seen) = solve(right, last * size, SAFETY * tolerance / last);
            iterations += seen.len();
            history.extend(seen.iter().map(|residual| residual * last));
            if !seen.is_empty() {
                // Replaced by that of the field.
                history.pop();
            }
            if pass > 0 {
                field.par_iter_mut().zip(&self.left).for_each(|(phi, more)| *phi += more);
            }
            operator.residual(&self.right, field, &mut self.left);
            let residual = relative(norm(operator.shape(), &self.left));
            history.push(residual);
            if residual <= tolerance {
                return Ok(Done { residual, iterations, imbalance });
            }
            if residual.is_nan() || residual > STALLED * last {
                break;
            }
            last = residual;
            // The solvers take the negative of their right side.
            self.left.par_iter_mut().for_each(|value| *value = -*value);
        }
        Err(history)
    }
}
