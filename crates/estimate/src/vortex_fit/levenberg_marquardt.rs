//! The iteration of Levenberg and Marquardt (Marquardt 1963) on a handful of parameters, which all fits share.
//!
//! Robust and quadratic losses differ in what `evaluate` returns. Check: a curved valley (Rosenbrock) is followed to its end; a point that cannot be
//! evaluated is stepped back from.

use ndarray::Array2;

use crate::error::Error;
use crate::linalg::positive_definite::solve;

/// Cost, gradient and a positive approximation of the second derivatives at one point.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    pub(crate) cost: f64,
    pub(crate) gradient: Vec<f64>,
    pub(crate) curvature: Array2<f64>,
}

/// With a secant curvature, longer steps than this many standard deviations are cut short.
const LONGEST_SIGMAS: f64 = 4.0;

/// When an iteration stops.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StoppingRule {
    /// Most evaluations.
    pub(crate) iterations: usize,
    /// The step that remains, in standard deviations of the fit.
    pub(crate) sigmas: f64,
    /// Whether the curvature of the cost comes from the changes of the gradient between points (a quasi-Newton update), so that a rejected step
    /// improves it too; else it comes from the derivatives at each point.
    pub(crate) is_secant: bool,
}

impl StoppingRule {
    /// With the exact curvature.
    pub(crate) const fn new(iterations: usize, sigmas: f64) -> Self {
        Self {
            iterations,
            sigmas,
            is_secant: false,
        }
    }
}

/// The end of a descent.
pub(crate) struct Minimum<P> {
    pub(crate) at: P,
    pub(crate) normal: Normal,
    iterations: usize,
    /// The step that is left \[standard deviations\].
    pub(crate) sigmas_left: f64,
}

/// A minimum that was found.
///
/// # Errors
/// [`Error::NotConverged`] after `stop.iterations` evaluations, or where no step goes downhill or there is no model.
pub(crate) fn converged<P>(
    end: Option<Minimum<P>>,
    stop: StoppingRule,
) -> Result<Minimum<P>, Error> {
    match end {
        Some(end) if end.sigmas_left <= stop.sigmas => Ok(end),
        end => {
            let (iterations, sigmas_left) =
                end.map_or((0, f64::INFINITY), |end| (end.iterations, end.sigmas_left));
            Err(Error::NotConverged {
                iterations,
                sigmas_left,
            })
        }
    }
}

/// Goes downhill from `start` until the step that is left is below `stop.sigmas` standard deviations (the curvature taken
/// as the inverse covariance), no step goes downhill or there are no evaluations left.
/// `evaluate` returns nothing where the model does not exist, `moved` adds a step. Nothing if it does not at the start.
pub(crate) fn levenberg_marquardt<P: Clone>(
    start: P,
    stop: StoppingRule,
    mut evaluate: impl FnMut(&P) -> Option<Normal>,
    moved: impl Fn(&P, &[f64]) -> P,
) -> Option<Minimum<P>> {
    let mut at = start;
    let mut normal = evaluate(&at)?;
    let mut damping = 1e-3;
    let mut sigmas_left = f64::INFINITY;
    let mut iterations = 0;
    while iterations < stop.iterations && damping <= 1e12 {
        iterations += 1;
        let down: Vec<f64> = normal.gradient.iter().map(|g| -g).collect();
        if let Some(newton) = solve(&normal.curvature, &down) {
            sigmas_left = product(&newton, &down).max(0.0).sqrt();
            if sigmas_left <= stop.sigmas {
                break;
            }
        }
        let mut step = damped_step(&normal, &down, damping);
        if let Some(step) = step
            .as_mut()
            .filter(|_| stop.is_secant && sigmas_left > LONGEST_SIGMAS)
        {
            step.iter_mut()
                .for_each(|s| *s *= LONGEST_SIGMAS / sigmas_left);
        }
        let trial = step.as_ref().map(|step| moved(&at, step));
        let trial_normal = trial.as_ref().and_then(&mut evaluate);
        // gain promised by the quadratic model
        let promised = step.map_or(0.0, |step| 0.5 * product(&step, &down));
        match (trial, trial_normal) {
            (Some(trial), Some(trial_normal))
                if normal.cost - trial_normal.cost > 1e-4 * promised =>
            {
                let ratio = (normal.cost - trial_normal.cost) / promised;
                if ratio > 0.75 {
                    damping = (damping * 0.1).max(1e-9);
                }
                at = trial;
                normal = trial_normal;
            }
            (_, rejected) => {
                if let Some(rejected) = rejected.filter(|_| stop.is_secant) {
                    normal.curvature = rejected.curvature;
                }
                damping = (damping * 10.0).max(1e-4);
            }
        }
    }
    Some(Minimum {
        at,
        normal,
        iterations,
        sigmas_left,
    })
}

/// Step of the quadratic model with a curvature whose diagonal is larger by the damping; nothing if the curvature is singular.
fn damped_step(normal: &Normal, down: &[f64], damping: f64) -> Option<Vec<f64>> {
    let mut damped = normal.curvature.clone();
    damped.diag_mut().mapv_inplace(|d| d * (1.0 + damping));
    solve(&damped, down)
}

fn product(step: &[f64], down: &[f64]) -> f64 {
    step.iter().zip(down).map(|(s, d)| s * d).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    /// Rosenbrock's valley as a sum of squares, which does not exist beyond a wall.
    fn valley(p: &[f64; 2]) -> Option<Normal> {
        if p[0] > 1.5 {
            return None;
        }
        let residual = [1.0 - p[0], 10.0 * (p[1] - p[0] * p[0])];
        let jacobian = array![[-1.0, 0.0], [-20.0 * p[0], 10.0]];
        let gradient = jacobian.t().dot(&ndarray::arr1(&residual)).to_vec();
        let cost = 0.5 * residual.iter().map(|r| r * r).sum::<f64>();
        Some(Normal {
            cost,
            gradient,
            curvature: jacobian.t().dot(&jacobian),
        })
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let moved = |p: &[f64; 2], s: &[f64]| [p[0] + s[0], p[1] + s[1]];
        let stop = StoppingRule::new(100, 1e-9);
        let descend =
            |start, stop| converged(levenberg_marquardt(start, stop, valley, moved), stop);
        let Minimum {
            at: end, normal, ..
        } = descend([-1.2, 1.0], stop).unwrap();
        assert!((end[0] - 1.0).abs() < 1e-8 && (end[1] - 1.0).abs() < 1e-8 && normal.cost < 1e-16);
        let hasty = descend(
            [-1.2, 1.0],
            StoppingRule {
                iterations: 3,
                ..stop
            },
        );
        assert!(matches!(
            hasty,
            Err(Error::NotConverged { iterations: 3, .. })
        ));
        assert!(descend([2.0, 1.0], stop).is_err());
    }
}
