//! Damped Newton steps on a handful of parameters: equations scaled to a unit diagonal and the iteration of Levenberg and
//! Marquardt (Marquardt 1963), shared by the fit of a map and the fit of signals; how fits to what is not smooth shorten their steps.
//!
//! Check: inverse times matrix; a curved valley (Rosenbrock) is followed to its end; a point that cannot be evaluated is
//! stepped back from; only steps that turn round are shortened.

use ndarray::Array2;

use crate::error::Error;
use crate::linalg::cholesky::{cholesky, forward_one};

/// Cost, gradient and a positive approximation of the second derivatives at one point.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    pub(crate) cost: f64,
    pub(crate) gradient: Vec<f64>,
    pub(crate) curvature: Array2<f64>,
}

/// A pivot below this, of a matrix with a unit diagonal, is rounding.
const SINGULAR: f64 = 1e-14;

/// x of a x = b for a symmetric positive definite a.
pub(crate) fn solve(a: &Array2<f64>, b: &[f64]) -> Option<Vec<f64>> {
    // rows and columns scaled to a unit diagonal: parameters have units of very different size
    let n = b.len();
    let scale: Vec<f64> = (0..n).map(|i| a[[i, i]].sqrt().recip()).collect();
    if scale.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let lower = cholesky(Array2::from_shape_fn((n, n), |(i, j)| {
        a[[i, j]] * scale[i] * scale[j]
    }))?;
    // what is left of a diagonal of ones
    if lower.diag().iter().any(|pivot| pivot * pivot < SINGULAR) {
        return None;
    }
    let mut x: Vec<f64> = b.iter().zip(&scale).map(|(b, s)| b * s).collect();
    forward_one(lower.as_slice()?, &mut x);
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| lower[[k, i]] * x[k]).sum();
        x[i] = (x[i] - sum) / lower[[i, i]];
    }
    x.iter_mut().zip(&scale).for_each(|(x, s)| *x *= s);
    Some(x)
}

/// The error of a matrix that is not positive definite.
pub(crate) fn singular(what: &'static str, order: usize) -> Error {
    let reason = "is singular to working precision: a free parameter does not show in the data";
    Error::Linalg {
        what,
        order,
        reason,
    }
}

/// Inverse of a symmetric positive definite matrix.
///
/// # Errors
/// [`Error::Linalg`] named `what` if it is singular to working precision.
pub(crate) fn inverse(what: &'static str, a: &Array2<f64>) -> Result<Array2<f64>, Error> {
    let n = a.nrows();
    let mut inverse = Array2::zeros((n, n));
    for j in 0..n {
        let unit: Vec<f64> = (0..n).map(|i| if i == j { 1.0 } else { 0.0 }).collect();
        let column = solve(a, &unit).ok_or(singular(what, n))?;
        (0..n).for_each(|i| inverse[[i, j]] = column[i]);
    }
    Ok(inverse)
}

/// With a learnt curvature, longer steps than this many standard deviations are cut short.
const LONGEST_SIGMAS: f64 = 4.0;

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stop {
    pub(crate) iterations: usize,
    /// The step that is left, in standard deviations of the fit.
    pub(crate) sigmas: f64,
    /// Whether the curvature that `evaluate` returns is learnt from all points, so that a refused step improves it too.
    pub(crate) learns: bool,
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
pub(crate) fn converged<P>(end: Option<Minimum<P>>, stop: Stop) -> Result<Minimum<P>, Error> {
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
pub(crate) fn lowest<P: Clone>(
    start: P,
    stop: Stop,
    mut evaluate: impl FnMut(&P) -> Option<Normal>,
    moved: impl Fn(&P, &[f64]) -> P,
) -> Option<Minimum<P>> {
    let mut at = start;
    let mut here = evaluate(&at)?;
    let (mut damping, mut left) = (1e-3, f64::INFINITY);
    let end = |at, normal, iterations, sigmas_left| {
        Some(Minimum {
            at,
            normal,
            iterations,
            sigmas_left,
        })
    };
    for iteration in 1..=stop.iterations {
        let down: Vec<f64> = here.gradient.iter().map(|g| -g).collect();
        if let Some(newton) = solve(&here.curvature, &down) {
            left = newton
                .iter()
                .zip(&down)
                .map(|(s, d)| s * d)
                .sum::<f64>()
                .max(0.0)
                .sqrt();
            if left <= stop.sigmas {
                return end(at, here, iteration, left);
            }
        }
        let mut damped = here.curvature.clone();
        damped.diag_mut().mapv_inplace(|d| d * (1.0 + damping));
        let mut step = solve(&damped, &down);
        if let (true, Some(step)) = (stop.learns && left > LONGEST_SIGMAS, &mut step) {
            step.iter_mut().for_each(|s| *s *= LONGEST_SIGMAS / left);
        }
        let trial = step.as_ref().map(|step| moved(&at, step));
        let there = trial.as_ref().and_then(&mut evaluate);
        // gain promised by the quadratic model
        let promised = step.map_or(0.0, |s| {
            0.5 * s.iter().zip(&down).map(|(s, d)| s * d).sum::<f64>()
        });
        match (trial, there) {
            (Some(trial), Some(there)) if here.cost - there.cost > 1e-4 * promised => {
                let ratio = (here.cost - there.cost) / promised;
                damping = if ratio > 0.75 {
                    (damping * 0.1).max(1e-9)
                } else {
                    damping
                };
                (at, here) = (trial, there);
            }
            (_, refused) => {
                if let (true, Some(refused)) = (stop.learns, refused) {
                    here.curvature = refused.curvature;
                }
                damping = (damping * 10.0).max(1e-4);
            }
        }
        if damping > 1e12 {
            return end(at, here, iteration, left);
        }
    }
    end(at, here, stop.iterations, left)
}

/// A step back by more than this part of the one before turns round.
const TURNED: f64 = 0.3;
/// Most halvings of a step.
const HALVINGS: i32 = 6;

/// The part of a step of a fit to what is not smooth, as where peaks jump, from its product with the step before and that of the latter with
/// itself: `turns` counts how often steps turned round, so that their ends are averaged (Kesten 1958). What only corrects a step that
/// went too far is none of those.
pub(crate) fn averaged(turns: &mut u32, with_last: f64, of_last: f64) -> f64 {
    *turns += u32::from(-with_last > TURNED * of_last);
    f64::from(1 + *turns).recip()
}

/// The first end that there is of a part of a step, its half, its quarter and so on.
pub(crate) fn halved<T>(part: f64, end: impl Fn(f64) -> Option<T>) -> Option<T> {
    (0..=HALVINGS).find_map(|halving| end(part * 0.5_f64.powi(halving)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn inverse_times_matrix_is_one_in_spite_of_units_of_different_size() {
        let a = array![[4e12, 1e5, 2e-1], [1e5, 3e-1, 1e-8], [2e-1, 1e-8, 5e-12]];
        let product = inverse("test", &a).unwrap().dot(&a);
        for ((i, j), value) in product.indexed_iter() {
            let scale = (a[[j, j]] / a[[i, i]]).sqrt();
            assert!(
                (value - f64::from(u8::from(i == j))).abs() < 1e-11 * scale.max(1.0),
                "{product}"
            );
        }
        assert!(inverse("test", &array![[1.0, 1.0], [1.0, 1.0]]).is_err());
        assert!(inverse("test", &array![[1.0, 0.0], [0.0, 0.0]]).is_err());
        // what is left of the second pivot is rounding, and just is not
        assert!(inverse("test", &array![[1.0, 1.0], [1.0, 1.0 + 4e-15]]).is_err());
        assert!(inverse("test", &array![[1.0, 1.0], [1.0, 1.0 + 4e-14]]).is_ok());
    }

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
        let stop = Stop {
            iterations: 100,
            sigmas: 1e-9,
            learns: false,
        };
        let descend = |start, stop| converged(lowest(start, stop, valley, moved), stop);
        let Minimum {
            at: end, normal, ..
        } = descend([-1.2, 1.0], stop).unwrap();
        assert!((end[0] - 1.0).abs() < 1e-8 && (end[1] - 1.0).abs() < 1e-8 && normal.cost < 1e-16);
        let hasty = descend(
            [-1.2, 1.0],
            Stop {
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

    #[test]
    fn steps_are_shortened_where_they_turn_round_and_halved_to_where_there_is_an_end() {
        let mut turns = 0;
        let products = [
            (0.0, 0.0),
            (2.0, 4.0),
            (-1.0, 4.0),
            (-2.0, 4.0),
            (1.0, 4.0),
            (-4.0, 4.0),
        ];
        let parts = products.map(|(with_last, of_last)| averaged(&mut turns, with_last, of_last));
        assert_eq!(parts, [1.0, 1.0, 1.0, 0.5, 0.5, 1.0 / 3.0]);
        assert_eq!(halved(0.8, |part| (part < 0.3).then_some(part)), Some(0.2));
        assert_eq!(halved(1.0, |part| (part < 0.01).then_some(part)), None);
    }
}
