//! When each pass of a fit to a map stops, and which of its minima are the same or compete: the tolerances of all passes in one place.
//!
//! A step is measured in standard errors of the fit (the curvature taken as the inverse covariance), a difference of chi-square in the variance of the
//! velocities.
//!
//! | pass | most evaluations | remaining step | reason |
//! |---|---|---|---|
//! | [`SEARCH`] | 25 | 0.3 | broad cores, whose positions the next pass corrects |
//! | [`MINIMUM`] | 40 | 0.01 | minima are compared in chi-square, which this step changes by 1e-4 |
//! | [`SPACING`] | 40 | 0.1 | alternatives are averaged with their weights, which this step changes by half a per cent |
//! | [`REPORTED`] | 50 | 1e-4 | the minimum that is reported, to more digits than are printed |
//! | [`EVALUATION`] | 1 | any | chi-square of another model at the same wake |
//! | [`MEANS`] | 200 | 0.01 | a smooth model from a rough guess; linear models by reweighted least squares |
//! | [`MEANS_START`] | 200 | 0.1 | as [`MEANS`], but it only leads to a start |
//! | [`ESTIMATES`] | 40 | 0.03 | estimators round: smaller steps do not change the map |
//! | [`STARTS`] | 6 | 0.5 | few positions, from each of several starts: fits to all positions go on from there, but for those that are hopeless |
//! | [`SECONDARY`] | 15 | 0.3 | four vortices: where secondary ones exist, five to ten evaluations suffice |

use crate::vortex_fit::levenberg_marquardt::StoppingRule;

pub(crate) const SEARCH: StoppingRule = StoppingRule::new(25, 0.3);
pub(crate) const MINIMUM: StoppingRule = StoppingRule::new(40, 1e-2);
pub(crate) const SPACING: StoppingRule = StoppingRule::new(40, 0.1);
pub(crate) const REPORTED: StoppingRule = StoppingRule::new(50, 1e-4);
pub(crate) const EVALUATION: StoppingRule = StoppingRule::new(1, f64::INFINITY);
pub(crate) const MEANS: StoppingRule = StoppingRule::new(200, 1e-2);
pub(crate) const MEANS_START: StoppingRule = StoppingRule::new(200, 0.1);
pub(crate) const ESTIMATES: StoppingRule = StoppingRule::new(40, 0.03);
pub(crate) const STARTS: StoppingRule = StoppingRule::new(6, 0.5);
pub(crate) const SECONDARY: StoppingRule = StoppingRule::new(15, 0.3);

/// Estimates that jump keep a fit from smaller steps: it has converged if this step remains after all evaluations, which makes its errors larger by
/// an eighth at most.
pub(crate) const ALMOST_CONVERGED_SIGMAS: f64 = 0.5;
/// A reported fit has not converged if a larger step remains, of which the standard errors would not tell.
pub(crate) const NOT_CONVERGED_SIGMAS: f64 = 0.1;

/// Minima closer than this many standard errors are the same: their difference adds less than a tenth to the variance.
pub(crate) const SAME_SIGMAS: f64 = 0.3;
/// Minima of rough fits that are closer than this many standard errors lead to the same one.
pub(crate) const ONE_SIGMAS: f64 = 1.0;
/// Minima of exact maps are the same if they differ by less than this fraction of a parameter.
pub(crate) const SAME_FRACTION: f64 = 1e-4;
/// Rough minima are the same if they differ by less than this fraction of a parameter, 20 at least, and wakes with broad cores by less than that.
pub(crate) const ROUGHLY_SAME_FRACTION: f64 = 1e-3;
pub(crate) const NEARLY_SAME_FRACTION: f64 = 5e-3;

/// A minimum with a chi-square that is larger by less competes with the best one: three standard errors of one parameter.
pub(crate) const COMPETES: f64 = 9.0;
/// A rough minimum of a fit to means with a chi-square that is larger by more is not followed: what remains of its descent is far less.
pub(crate) const HOPELESS: f64 = 50.0;
/// As [`HOPELESS`], of a fit to estimates, where a start costs more: it would have a weight below a ten thousandth.
pub(crate) const HOPELESS_OF_ESTIMATES: f64 = 20.0;
/// An alternative with a chi-square that is larger by more has no weight (e^-15), nor has what lies beyond it.
pub(crate) const NEGLIGIBLE: f64 = 30.0;

/// Least ratio of a circulation to its standard error at which a vortex is certain.
pub(crate) const CERTAIN_SIGMAS: f64 = 3.0;
