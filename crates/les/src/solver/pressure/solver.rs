//! The solver of the pressure equation of one mesh: a method, called again for what it leaves till the residual of the field is
//! what was asked for. The residual is computed anew from the field, so that it holds the round-off of everything.

use rayon::prelude::*;

use super::apply::Operator;
use super::cost::PressureMethod;
use super::direct::Direct;
use super::method::Method;
use super::multigrid::Multigrid;
use crate::error::{Error, PressureFailure, check};
use crate::solver::aligned::Aligned;
use crate::solver::layout::Layout;
use crate::solver::slabs::WHOLE;

/// Solves after which the residual no longer falls.
const MAX_SOLVES: usize = 8;
/// A solve that leaves more than this has stalled.
const STALLED: f64 = 0.5;
/// Part of the tolerance asked of a solve: the residual it sees is not exactly the field's.
const SAFETY: f64 = 0.999;
/// A solution that improves no more is held up by round-off if it leaves at most this multiple of the last digit's share.
const ROUND_OFF: f64 = 4.0;
/// Part of the tolerance that an imbalance may add to the residual.
const BALANCED: f64 = 0.01;

/// What a solve did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Solved {
    /// 2-norm of the residual over that of the right side less what no pressure can balance, measured on the solution.
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
    /// What the solution leaves, once it is solved for.
    left: Aligned,
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
        Self { operator: Operator::new(layout), method, right, left: Aligned::default() }
    }

    /// Replaces the weighted divergence `g` in `field` by `phi`, of zero weighted mean, halos included.
    ///
    /// # Errors
    /// [`Error::PressureNotSolved`] if the residual does not reach `tolerance` (2-norm, relative to the right side); the field is then
    /// the last solution found.
    pub(crate) fn solve(&mut self, field: &mut [f64], tolerance: f64) -> Result<Solved, Error> {
        let Self { operator, method, right, left } = self;
        check("tolerance", tolerance, "above 0 and below 1", |t| t > 0.0 && t < 1.0)?;
        // The methods ignore what no pressure can balance; only the residual must not hold it against them.
        let size = operator.copy_balanced(field, right, BALANCED * tolerance)?;
        if size == 0.0 {
            field.fill(0.0);
            return Ok(Solved { residual: 0.0, iterations: 0, factor: None });
        }
        let own = operator.slabs.shape.own_places();
        let (mut iterations, mut history, mut last, mut attainable) = (0, Vec::new(), 1.0, 0.0);
        let reason = loop {
            // Of a later solve the right side is what the field so far leaves.
            let refines = !history.is_empty();
            let unknown = if refines { &mut left[own.clone()] } else { &mut field[own.clone()] };
            iterations += method.solve(unknown, last * size, f64::max(SAFETY * tolerance, 0.25 * attainable) / last)?;
            if refines {
                field.par_iter_mut().zip(&left[..]).for_each(|(phi, more)| *phi += more);
            }
            operator.slabs.halos(&mut [field], WHOLE)?;
            let residual = operator.residual_norm(right, field)? / size;
            history.push(residual);
            if residual <= tolerance {
                let factor = (iterations > 0).then(|| residual.powf(1.0 / iterations as f64));
                return Ok(Solved { residual, iterations, factor });
            }
            if residual.is_nan() {
                break PressureFailure::NotFinite;
            }
            attainable = operator.round_off(field)? / size;
            if residual > STALLED * last || history.len() == MAX_SOLVES {
                let at_round_off = residual.min(last) <= ROUND_OFF * attainable;
                break if at_round_off { PressureFailure::RoundOff { attainable } } else { PressureFailure::Stalled };
            }
            last = residual;
            if left.is_empty() {
                *left = Aligned::zeros(field.len());
            }
            operator.residual(right, field, left);
            // The methods take the negative of their right side.
            left.par_iter_mut().for_each(|value| *value = -*value);
        };
        Err(Error::PressureNotSolved { method: method.name(), tolerance, reason, iterations, history })
    }
}

/// Takes what a solve reached whose residual round-off holds up, and what is not finite, which a step finds.
///
/// # Errors
/// Those of a solve that stalled, or of the exchange between ranks.
pub(crate) fn unless_stalled(solved: Result<Solved, Error>) -> Result<(), Error> {
    match solved {
        Err(Error::PressureNotSolved { reason: PressureFailure::Stalled, .. }) => solved.map(drop),
        Err(Error::PressureNotSolved { .. }) => Ok(()),
        other => other.map(drop),
    }
}
