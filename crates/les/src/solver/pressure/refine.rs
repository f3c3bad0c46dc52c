//! Solving again for what a solve leaves, till the residual of the field is what was asked for.
//!
//! The residual is computed anew from the field, so that it holds the round-off of everything.

use rayon::prelude::*;

use super::apply::Operator;
use super::solver::Solved;
use crate::error::{Error, PressureFailure};
use crate::solver::aligned::Aligned;
use crate::solver::slabs::WHOLE;

/// Relative residuals that a pass saw after its iterations; none if it has none.
#[derive(Debug)]
pub(crate) struct Pass(pub(crate) Vec<f64>);

/// Fields kept from solve to solve.
#[derive(Debug, Default)]
pub(crate) struct Refinement {
    right: Aligned,
    left: Aligned,
}

/// Passes after which the residual no longer falls.
const MAX_PASSES: usize = 8;
/// A pass that leaves more than this has stalled.
const STALLED: f64 = 0.5;
/// Part of the tolerance asked of a pass: the residual it sees is not exactly the field's.
const SAFETY: f64 = 0.999;
/// A solution that improves no more is held up by round-off if it leaves at most this multiple of the last digit's share.
const ROUND_OFF: f64 = 4.0;
/// Part of the tolerance that an imbalance may add to the residual.
const BALANCED: f64 = 0.01;

impl Refinement {
    /// A field that is free between solves.
    pub(crate) fn spare(&mut self) -> &mut Aligned {
        &mut self.right
    }

    /// Replaces the right side in `field` by the solution, halos included. `solve` replaces a right side of the given norm by a solution of
    /// about the given relative residual; `method` is its name in errors.
    ///
    /// # Errors
    /// [`Error::PressureNotSolved`] if the residual does not reach `tolerance`; the field is then the last solution found.
    pub(crate) fn run(
        &mut self,
        operator: &Operator,
        field: &mut [f64],
        tolerance: f64,
        method: &'static str,
        mut solve: impl FnMut(&mut [f64], f64, f64) -> Result<Pass, Error>,
    ) -> Result<Solved, Error> {
        let refused = |history, reason| Err(Error::PressureNotSolved { method, tolerance, reason, history });
        // The solvers ignore what no pressure can balance; only the residual must not hold it against them.
        self.right.fit(field.len());
        let [size, imbalance] = operator.copy_balanced(field, &mut self.right, BALANCED * tolerance)?;
        if size == 0.0 {
            field.fill(0.0);
            return Ok(Solved { residual: 0.0, iterations: 0, factor: None, imbalance });
        }
        let (mut iterations, mut history) = (0, Vec::new());
        let (mut last, mut attainable) = (1.0, 0.0);
        for pass in 0..MAX_PASSES {
            // Of a later pass the right side is what the field so far leaves.
            let right = if pass == 0 { &mut *field } else { &mut self.left };
            let Pass(seen) = solve(right, last * size, f64::max(SAFETY * tolerance, 0.25 * attainable) / last)?;
            iterations += seen.len();
            history.extend(seen.iter().map(|residual| residual * last));
            if !seen.is_empty() {
                // Replaced by that of the field.
                history.pop();
            }
            if pass > 0 {
                field.par_iter_mut().zip(&self.left[..]).for_each(|(phi, more)| *phi += more);
            }
            operator.slabs().halos(&mut [field], WHOLE)?;
            let residual = operator.residual_norm(&self.right, field)? / size;
            history.push(residual);
            if residual <= tolerance {
                let factor = (iterations > 0).then(|| residual.powf(1.0 / iterations as f64));
                return Ok(Solved { residual, iterations, factor, imbalance });
            }
            if residual.is_nan() {
                return refused(history, PressureFailure::NotFinite);
            }
            attainable = operator.round_off(field)? / size;
            if residual > STALLED * last {
                break;
            }
            last = residual;
            self.left.fit(field.len());
            operator.residual(&self.right, field, &mut self.left);
            // The solvers take the negative of their right side.
            self.left.par_iter_mut().for_each(|value| *value = -*value);
        }
        let reached = history.last().copied().unwrap_or(f64::NAN);
        let at_round_off = reached.min(last) <= ROUND_OFF * attainable;
        let reason = if at_round_off { PressureFailure::RoundOff { attainable } } else { PressureFailure::Stalled };
        refused(history, reason)
    }
}
