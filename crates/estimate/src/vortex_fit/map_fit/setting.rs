//! A map with what is expected of it, and its fit from a start on: the problem, and both ways to its minimum.
//!
//! Means over gates are smooth, and their slopes known: Levenberg and Marquardt, with the scale of the residuals, their median, taken anew in each
//! of a few rounds. What an estimator shows is neither: damped steps of Gauss and Newton, each to the least squares of the model made linear, with
//! slopes that are taken anew when the wake has moved by more than its error. Its velocities scatter the more the broader the air's are: the
//! logarithm of the residuals is fitted by a straight line over ln(1 + variance of the air / its median), whose slope p gives standard deviations
//! (1 + ...)^p. Check: exact maps; the power of made-up residuals; the spread of fits over many maps.

use ndarray::Array2;

use crate::error::{Error, enough_velocities, finite};
use crate::vortex_fit::levenberg_marquardt::{StoppingRule, converged};
use crate::vortex_fit::map_fit::cells::{Cell, cells};
use crate::vortex_fit::map_fit::data::{median, robust_scale};
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::least_squares::{LeastSquares, Scores};
use crate::vortex_fit::map_fit::prediction::{Linear, Predicted, Prediction};
use crate::vortex_fit::tolerances::{ALMOST_CONVERGED_SIGMAS, MEANS};
use crate::vortex_fit::wake::core_prior::is_core;
use crate::vortex_fit::wake::free_parameters::free_numbers;
use crate::vortex_fit::wake::log_wind_prior::log_wind_std_m_s;
use crate::vortex_fit::{
    CorePrior, MapFit, MapFitOptions, PairPrior, Parameter, RangeKernel, Top, VelocityMap, Wake,
    WakeModel,
};

/// The scale of residuals from means is taken anew this often.
const ROUNDS: usize = 5;

/// What is fitted, and to what.
pub(crate) struct Setting<'a, 'm> {
    pub(crate) map: &'a VelocityMap<'m>,
    pub(crate) model: &'a WakeModel,
    pub(crate) prediction: &'a dyn Prediction,
    /// What gates see in the mean.
    pub(crate) kernel: &'a RangeKernel,
    pub(crate) options: &'a MapFitOptions,
    /// Core radii below this do not show \[m\].
    pub(crate) least_core_m: f64,
}

impl Setting<'_, '_> {
    /// Free numbers of a fit from that start on.
    fn groups(&self, start: &Wake) -> Result<Vec<Vec<usize>>, Error> {
        let found = self.map.validate()?;
        start.validate()?;
        self.options
            .core_prior
            .as_ref()
            .map_or(Ok(()), CorePrior::validate)?;
        self.options
            .pair_prior
            .as_ref()
            .map_or(Ok(()), PairPrior::validate)?;
        let groups = self.options.free.groups_of(start);
        enough_velocities(found, 10 * groups.len().max(1))?;
        Ok(groups)
    }

    fn squares<'s>(&'s self, prediction: &'s dyn Prediction, cells: Vec<Cell>) -> LeastSquares<'s> {
        let loss = self.options.loss;
        let prior = self.options.core_prior;
        LeastSquares {
            prediction,
            fold_m_s: self.options.fold_m_s,
            cells,
            whitening: None,
            loss,
            prior,
            pair_prior: self.options.pair_prior,
            log_wind_std_m_s: log_wind_std_m_s(self.map),
            counted: 1.0,
        }
    }

    /// Least squares about the parameters at which the model was made linear.
    pub(crate) fn about<'s>(&'s self, linear: &'s Linear) -> LeastSquares<'s> {
        LeastSquares {
            counted: linear.counted,
            ..self.squares(linear, linear.cells.clone())
        }
    }

    /// What a model gains over another one in the logarithm of the likelihood, with as many velocities counted once for both as for it. Deviations
    /// are the same for both, those that it leaves: a scale that each fit takes from its own residuals changes by chance, and with it the likelihood
    /// of all.
    pub(crate) fn gain(&self, better: &Linear, than: &Linear) -> f64 {
        let cells = better.shared_with(than);
        let counted = better.counted;
        let [of_better, of_other] = [better, than].map(|linear| {
            let squares = LeastSquares {
                cells: cells.clone(),
                counted,
                ..self.about(linear)
            };
            squares.log_likelihood(&linear.at, &linear.groups)
        });
        (of_better - of_other) / counted
    }

    /// The fit by descent from a start on.
    pub(crate) fn descended(&self, start: &Wake, stop: StoppingRule) -> Result<MapFit, Error> {
        let mut groups = self.groups(start)?;
        let coreless: Vec<Vec<usize>> = groups
            .iter()
            .filter(|group| !is_core(group))
            .cloned()
            .collect();
        let mut p = self.options.free.start(start).to_array().to_vec();

        for round in 0..ROUNDS {
            let (squares, _) = self.rescaled(&p)?;
            let mut end = converged(squares.minimum(&p, &groups, stop), stop);
            // a core that the map does not resolve may run away to nothing: it keeps what the last round gave
            if end.is_err() && round > 0 && coreless.len() < groups.len() {
                groups.clone_from(&coreless);
                end = converged(squares.minimum(&p, &groups, stop), stop);
            }
            p = end?.at;
        }
        let (squares, scale) = self.rescaled(&p)?;
        self.outcome(&squares, &p, &groups, scale)
    }

    /// Least squares with the deviations and the correlation that the residuals have at `p`, and the scale of the residuals over the stated
    /// deviations.
    fn rescaled(&self, p: &[f64]) -> Result<(LeastSquares<'_>, f64), Error> {
        let squares = self.squares(self.prediction, cells(self.map));
        let scale = squares.residual_scale(p);
        finite("scale of the residuals", scale)?;
        let squares = squares.rescaled(scale.max(1e-6));
        let counted = squares.alike(p, self.options.correlated_lines);
        Ok((LeastSquares { counted, ..squares }, scale))
    }

    /// The fit by steps of Gauss and Newton from a start on, with neighbours that are alike counted once.
    pub(crate) fn refined(&self, start: &Wake, stop: StoppingRule) -> Result<MapFit, Error> {
        let groups = self.groups(start)?;
        let start = self.options.free.start(start).to_array().to_vec();
        self.outcome_of(&self.settled(start, &groups, stop, None)?)
    }

    /// Where the steps of Gauss and Newton from a start on are after those that `stop` allows.
    pub(crate) fn approached(&self, start: &Wake, stop: StoppingRule) -> Result<MapFit, Error> {
        let groups = self.groups(start)?;
        let start = self.options.free.start(start).to_array().to_vec();
        self.outcome_of(&self.descent(start, &groups, stop, None)?.0)
    }

    /// The end of steps of Gauss and Newton. How many velocities count as one is given or taken from the residuals.
    pub(crate) fn settled(
        &self,
        start: Vec<f64>,
        groups: &[Vec<usize>],
        stop: StoppingRule,
        counted: Option<f64>,
    ) -> Result<Linear, Error> {
        let (linear, sigmas_left) = self.descent(start, groups, stop, counted)?;
        if sigmas_left <= stop.sigmas.max(ALMOST_CONVERGED_SIGMAS) {
            Ok(linear)
        } else {
            Err(not_converged(stop.iterations, sigmas_left))
        }
    }

    /// Steps of Gauss and Newton until a small one is left or there have been as many as `stop` allows, and the step that is left \[standard
    /// deviations\].
    fn descent(
        &self,
        mut p: Vec<f64>,
        all: &[Vec<usize>],
        stop: StoppingRule,
        counted: Option<f64>,
    ) -> Result<(Linear, f64), Error> {
        let mut groups = all.to_vec();
        let mut are_cores_released = false;
        let mut turns = 0;
        let mut last = vec![0.0; p.len()];
        let mut sigmas_left = f64::INFINITY;
        let mut known: Option<Linear> = None;
        let mut alike = 1.0;
        let mut steps = 0;
        let mut most = stop.iterations;
        while steps < most {
            steps += 1;
            let linear = self.next_linear(&p, &groups, known.take(), counted)?;
            alike = linear.counted;
            let squares = self.about(&linear);
            let next = squares.reweighted(&p, &groups, MEANS)?;
            let normal = squares
                .normal(&p, &groups)
                .ok_or(not_converged(steps, sigmas_left))?;
            let way: Vec<f64> = next.iter().zip(&p).map(|(next, p)| next - p).collect();
            let step = free_numbers(&way, &groups);
            let last_step = free_numbers(&last, &groups);
            let curved = normal.curvature.dot(&last_step);
            let share = averaged(&mut turns, step.dot(&curved), last_step.dot(&curved));
            sigmas_left = share * (step.dot(&normal.curvature.dot(&step)) / alike).sqrt();
            if sigmas_left <= stop.sigmas {
                // a core that shrank on the way, as where the pair was narrow, may show where it ends
                if groups.len() < all.len() && !are_cores_released {
                    groups = all.to_vec();
                    are_cores_released = true;
                    most = steps + stop.iterations;
                    continue;
                }
                return Ok((linear, sigmas_left));
            }
            let longest = share.min(linear.reach(&next));
            p = self
                .moved(&p, &way, longest)
                .ok_or(not_converged(steps, sigmas_left))?;
            last = way;
            keep_small_cores(&mut p, &mut groups, self.least_core_m);
            if groups.len() == linear.groups.len() && linear.serves(&p, &normal.curvature) {
                known = Some(linear);
            }
        }
        let mut linear = self.linear(&p, &groups, None)?;
        linear.counted = alike;
        Ok((linear, sigmas_left))
    }

    /// The model made linear about `p`, with slopes that are known or taken anew. How many velocities count as one is given or taken from the
    /// residuals wherever slopes are.
    fn next_linear(
        &self,
        p: &[f64],
        groups: &[Vec<usize>],
        known: Option<Linear>,
        counted: Option<f64>,
    ) -> Result<Linear, Error> {
        let counted = counted.or(known.as_ref().map(|known| known.counted));
        let mut linear = self.linear(p, groups, known)?;
        linear.counted = match counted {
            Some(counted) => counted,
            None => self.about(&linear).alike(p, self.options.correlated_lines),
        };
        Ok(linear)
    }

    /// The parameters after the largest part of a step, at most `longest`, at which the model exists.
    fn moved(&self, p: &[f64], step: &[f64], longest: f64) -> Option<Vec<f64>> {
        halved(longest, |part| {
            let trial: Vec<f64> = p
                .iter()
                .zip(step)
                .map(|(p, step)| p + part * step)
                .collect();
            self.prediction.allows(&trial).then_some(trial)
        })
    }

    /// The model made linear about `p`, with slopes that are known from parameters near by or taken anew.
    pub(crate) fn linear(
        &self,
        p: &[f64],
        groups: &[Vec<usize>],
        known: Option<Linear>,
    ) -> Result<Linear, Error> {
        let mut here = self
            .prediction
            .predict(p, if known.is_some() { &[] } else { groups });
        let mut slopes_at = p.to_vec();
        if let Some(known) = known {
            slopes_at = known.slopes_at;
            here.slopes = known.here.slopes;
        }
        let mut cells = cells(self.map);
        cells.retain(|cell| {
            let place = [cell.line, cell.gate];
            here.velocity_m_s[place].is_finite()
                && here.slopes.iter().all(|slope| slope[place].is_finite())
        });
        if let Some(variances) = self.prediction.air_variances(p) {
            let deviations =
                learnt_deviations(&variances, &cells, |cell| self.residual(cell, &here));
            cells
                .iter_mut()
                .zip(deviations)
                .for_each(|(cell, deviation)| cell.sigma_m_s *= deviation);
        }
        let scale = robust_scale(cells.iter().map(|cell| self.residual(cell, &here)));
        finite("scale of the residuals", scale)?;
        let scale = scale.max(1e-6);
        cells.iter_mut().for_each(|cell| cell.sigma_m_s *= scale);
        Ok(Linear {
            at: p.to_vec(),
            here,
            slopes_at,
            groups: groups.to_vec(),
            cells,
            scale,
            counted: 1.0,
        })
    }

    /// Difference of a measured velocity from the predicted one in standard deviations.
    fn residual(&self, cell: &Cell, predicted: &Predicted) -> f64 {
        let mut away_m_s = cell.velocity_m_s - predicted.velocity_m_s[[cell.line, cell.gate]];
        if let Some(fold_m_s) = self.options.fold_m_s {
            away_m_s -= fold_m_s * (away_m_s / fold_m_s).round();
        }
        away_m_s / cell.sigma_m_s
    }

    fn outcome_of(&self, linear: &Linear) -> Result<MapFit, Error> {
        let squares = self.about(linear);
        self.outcome(&squares, &linear.at, &linear.groups, linear.scale)
    }

    fn outcome(
        &self,
        squares: &LeastSquares<'_>,
        p: &[f64],
        groups: &[Vec<usize>],
        scale: f64,
    ) -> Result<MapFit, Error> {
        let from = Scores::OfNeighbours {
            lines: self.options.correlated_lines,
        };
        let uncertainty = squares.uncertainty(p, groups, from)?;
        let residuals = squares.rows(p, &[]).residuals;
        let cost: f64 = residuals.iter().map(|r| self.options.loss.at(*r).0).sum();
        // without vortices a gate shows its mean, which is the wind at its middle, as that is nearly linear along a gate
        let places = (self.map.elevation_rad, self.map.range_m);
        let middle = Gates::at_rest(self.model, self.kernel.middle(), places);
        let wind: Vec<Vec<usize>> = groups
            .iter()
            .filter(|group| group[0] >= Parameter::Wind as usize)
            .cloned()
            .collect();
        let mut calm = p.to_vec();
        calm[..2].fill(0.0);
        let calm = LeastSquares {
            prediction: &middle,
            prior: None,
            pair_prior: None,
            ..squares.clone()
        }
        .minimum(&calm, &wind, MEANS);
        let calm_cost = calm.map_or(f64::NAN, |calm| calm.normal.cost);
        let wake = Wake::from_list(p);
        Ok(MapFit {
            wake,
            covariance: uncertainty.covariance(|_| true)?,
            cores_fitted: groups.iter().any(|group| is_core(group)),
            used: self.map.validate()?,
            outliers: residuals.iter().filter(|r| r.abs() > 3.0).count(),
            residual_scale: scale,
            statistic: 2.0 * (calm_cost - cost) / uncertainty.alike,
            explained_fraction: 1.0 - cost / calm_cost,
            tops: vec![Top {
                wake,
                chi2: -2.0 * squares.log_likelihood(p, groups) / uncertainty.alike,
            }],
        })
    }
}

fn not_converged(iterations: usize, sigmas_left: f64) -> Error {
    Error::NotConverged {
        iterations,
        sigmas_left,
    }
}

/// A step back by more than this part of the one before turns round.
const TURNED: f64 = 0.3;
/// Most halvings of a step.
const HALVINGS: i32 = 6;

/// The part of a step of a fit to what is not smooth, as where peaks jump, from its product with the step before and that of the latter with
/// itself: `turns` counts how often steps turned round, so that their ends are averaged (Kesten 1958). What only corrects a step that
/// went too far is none of those.
fn averaged(turns: &mut u32, with_last: f64, of_last: f64) -> f64 {
    *turns += u32::from(-with_last > TURNED * of_last);
    f64::from(1 + *turns).recip()
}

/// The first end that there is of a part of a step, its half, its quarter and so on.
fn halved<T>(part: f64, end: impl Fn(f64) -> Option<T>) -> Option<T> {
    (0..=HALVINGS).find_map(|halving| end(part * 0.5_f64.powi(halving)))
}

/// Standard deviations of the velocities of cells over those in uniform wind, as their residuals tell: ln|r| is a straight line over ln(1 +
/// variance / its median).
fn learnt_deviations(
    variances: &Array2<f64>,
    cells: &[Cell],
    residual: impl Fn(&Cell) -> f64,
) -> Vec<f64> {
    let typical =
        median(&mut variances.iter().copied().collect::<Vec<f64>>()).max(f64::MIN_POSITIVE);
    let broad: Vec<f64> = cells
        .iter()
        .map(|cell| (variances[[cell.line, cell.gate]] / typical).ln_1p())
        .collect();
    let [mut n, mut x, mut y, mut xx, mut xy] = [0.0; 5];
    for (cell, broad) in cells.iter().zip(&broad) {
        let log = residual(cell).abs().ln();
        if log.is_finite() {
            n += 1.0;
            x += broad;
            y += log;
            xx += broad * broad;
            xy += broad * log;
        }
    }
    let power = ((n * xy - x * y) / (n * xx - x * x)).clamp(0.0, 1.0);
    broad
        .into_iter()
        .map(|broad| {
            if power.is_finite() {
                (power * broad).exp()
            } else {
                1.0
            }
        })
        .collect()
}

/// Raises free core radii below the least one, which are kept from then on; those of the other vortex stay free.
pub(crate) fn keep_small_cores(p: &mut [f64], groups: &mut Vec<Vec<usize>>, least_m: f64) {
    groups.retain(|group| {
        let is_small = is_core(group) && group.iter().any(|&place| p[place] < least_m);
        if is_small {
            group
                .iter()
                .for_each(|&place| p[place] = p[place].max(least_m));
        }
        !is_small
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_core_that_does_not_show_is_kept_alone() {
        let wake = Wake::from_array(&[
            480.0, 20.0, 376.5, 45.0, 423.5, 49.0, 4.0, 0.3, 1.3, 0.0, 0.0,
        ]);
        let (mut p, mut groups) = (
            wake.to_array().to_vec(),
            vec![vec![0], vec![6], vec![7], vec![8]],
        );
        keep_small_cores(&mut p, &mut groups, 0.5);
        assert_eq!(
            (p[6], p[7], groups),
            (4.0, 0.5, vec![vec![0], vec![6], vec![8]])
        );
        let mut common = vec![vec![6, 7]];
        keep_small_cores(&mut p, &mut common, 0.6);
        assert_eq!((p[6], p[7], common.len()), (4.0, 0.6, 0));
    }

    /// Residuals whose size grows with the variance of the air to a known power.
    #[test]
    fn the_power_of_the_scatter_is_learnt_from_the_residuals() {
        let variance = Array2::from_shape_fn((40, 50), |(i, j)| {
            0.1 * (0.2 * i as f64).exp() + 0.01 * j as f64
        });
        let typical = median(&mut variance.iter().copied().collect::<Vec<f64>>());
        let grown = |power: f64| variance.mapv(|v| (1.0 + v / typical).powf(power));
        for (power, learnt) in [(0.4, 0.4), (0.0, 0.0), (-0.3, 0.0)] {
            let mut place = 0.0_f64;
            // uniform numbers between -0.5 and 0.5
            let residual = grown(power).mapv(|size| {
                place += 1.0;
                let number = (place * 12.9898).sin() * 43_758.545;
                size * (number - number.floor() - 0.5)
            });
            let cell = |((line, gate), v): ((usize, usize), &f64)| Cell {
                line,
                gate,
                velocity_m_s: *v,
                sigma_m_s: 1.0,
            };
            let cells: Vec<Cell> = residual.indexed_iter().map(cell).collect();
            let found = learnt_deviations(&variance, &cells, |cell| cell.velocity_m_s);
            let worst = found
                .iter()
                .zip(&grown(learnt))
                .fold(0.0_f64, |worst, (a, b)| worst.max((a / b).ln().abs()));
            assert!(worst < 0.2, "{power}: {worst}");
        }
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
