//! The maxima of the likelihood of raw signals: where they may be, and what the lower ones mean for the error of the highest.
//!
//! Few lines cross a core, and each has its speckle: ln p has several maxima that differ in the core radius and in the heights
//! by about the distance of lines. ln p of the lines far from the vortices does not depend on that: near one maximum it is a parabola.
//! So core radii and heights are tried on the near lines alone: the effects of the two heights are added, the numbers in which
//! ln p is nearly a parabola (circulations, lateral positions, wind, powers) take the Newton step of the information, and the
//! ascents start from the best states. Check: the maximum that a start at the truth leads to is found.

use ndarray::Array2;

use crate::error::Error;
use crate::linalg::dot;
use crate::linalg::positive_definite::{inverse, solve};
use crate::vortex_fit::signal_fit::ascent::{Ascent, Parabola, State, times};
use crate::vortex_fit::tolerances::SAME_SIGMAS;
use crate::vortex_fit::top::distinct;
use crate::vortex_fit::{Parameter, ScanModel, SignalFitOptions, Wake};

/// Core radii that are tried, over the spacing of the vortices.
pub(crate) const CORES_OVER_SPACING: [f64; 5] = [0.015, 0.025, 0.042, 0.07, 0.12];
/// Lines that pass a vortex within this fraction of the spacing are near.
const NEAR_OVER_SPACING: f64 = 0.2;
/// Steps up and down by which heights are tried.
const STEPS: i32 = 4;
/// A step of height over its standard deviation.
const STEP_SIGMAS: f64 = 1.5;
/// States from which the ascents of the near lines start.
const PLACES: usize = 8;
/// Maxima this far below the best are ignored: weight exp(-6).
const FAR_BELOW: f64 = 6.0;
/// Most other maxima that are reported.
const MOST: usize = 6;
/// Maxima of the near lines within this of the best are refined with all lines; the others keep the result of the near lines.
const CLOSE_BELOW: f64 = 2.0;

impl Ascent<'_> {
    /// States near other maxima than `top`, the best first, found with the lines near the vortices, each with its gain of ln p over `top`; without a
    /// gain where it may be the highest with all lines.
    ///
    /// `near` is a model of the near lines ([`near_lines`]).
    ///
    /// # Errors
    /// As [`ScanModel::information`].
    pub(crate) fn other_tops(
        &self,
        near: &ScanModel,
        top: State,
    ) -> Result<Vec<(State, Option<f64>)>, Error> {
        let options = self.options;
        let rough = SignalFitOptions {
            tolerance_sigmas: 0.1,
            information_stride: 2,
            ..*options
        };
        let mut ascent = Ascent {
            model: near,
            signals: self.signals,
            options: &rough,
            others: None,
        };
        let Some((value_at_top, at_top)) = ascent.value(&top) else {
            return Ok(Vec::new());
        };
        let far = self.model.with_lines(|line| !near.has(line));
        let information = far.information(
            &top.0,
            top.1,
            &options.free,
            options.fit_powers,
            options.information_stride,
        )?;
        // at the maximum of all lines the gradients of the far and of the near ones cancel
        let gradient = at_top.iter().map(|g| -g).collect();
        ascent.others = Some(Parabola {
            about: top,
            gradient,
            information,
        });
        let information = ascent.information(&top, 1)?;
        let starts = ascent.places(&top, &information);
        let maxima = starts
            .into_iter()
            .filter_map(|start| ascent.climb(start).ok());
        let mut found = distinct(maxima, |other, maximum| {
            ascent.same(&information, &maximum.0, &other.0)
        });
        let mut best = value_at_top;
        for (_, log_likelihood) in &found {
            best = best.max(*log_likelihood);
        }
        found.retain(|(state, value)| {
            *value > best - FAR_BELOW && !ascent.same(&information, state, &top)
        });
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        found.truncate(MOST);
        let mut candidates = Vec::with_capacity(found.len());
        for (state, value) in found {
            let may_be_highest = value > best - CLOSE_BELOW;
            candidates.push((state, (!may_be_highest).then_some(value - value_at_top)));
        }
        Ok(candidates)
    }

    /// Whether two states are the same maximum.
    pub(crate) fn same(&self, information: &Array2<f64>, a: &State, b: &State) -> bool {
        let apart = self.steps(a, b);
        dot(&times(information, &apart), &apart) < SAME_SIGMAS * SAME_SIGMAS
    }

    /// States to climb from, the most promising first: no two of them are neighbours.
    fn places(&self, top: &State, information: &Array2<f64>) -> Vec<State> {
        let groups = self.options.free.groups();
        let heights = free_numbers(&groups, [Parameter::LeftHeight, Parameter::RightHeight]);
        let cores = free_numbers(&groups, [Parameter::LeftCore, Parameter::RightCore]);
        let Ok(covariance) = inverse("information on the wake", information) else {
            return Vec::new();
        };
        let deviations = covariance.diag().mapv(|variance| variance.max(0.0).sqrt());
        let rows = if cores.is_empty() {
            1
        } else {
            CORES_OVER_SPACING.len()
        };
        let quick: Vec<usize> = (0..information.nrows())
            .filter(|i| !heights.contains(i) && !cores.contains(i))
            .collect();
        let mut scores: Vec<Scored> = Vec::new();
        for (row, over_spacing) in CORES_OVER_SPACING.iter().enumerate().take(rows) {
            let mut at = *top;
            if !cores.is_empty() {
                at.0 = at.0.with_cores(over_spacing * top.0.spacing_m());
            }
            let Some(middle) = self.stepped_quickly(at, information, &quick) else {
                continue;
            };
            // the effect of each height alone, the other one fixed
            let mut alone: Vec<Vec<Option<(f64, State)>>> = Vec::new();
            for &axis in &heights {
                let mut of_axis = Vec::new();
                for step in -STEPS..=STEPS {
                    if step == 0 {
                        of_axis.push(Some(middle));
                        continue;
                    }
                    let mut by = vec![0.0; deviations.len()];
                    by[axis] = f64::from(step) * STEP_SIGMAS * deviations[axis];
                    let state = self.stepped(&middle.1, &by);
                    of_axis.push(self.stepped_quickly(state, information, &quick));
                }
                alone.push(of_axis);
            }
            self.score_pairs(row, &middle, &alone, deviations.len(), &mut scores);
        }
        chosen(scores)
    }

    /// Adds the scores of all pairs of heights, the sums of the effects `alone` of each.
    fn score_pairs(
        &self,
        row: usize,
        middle: &(f64, State),
        alone: &[Vec<Option<(f64, State)>>],
        numbers: usize,
        scores: &mut Vec<Scored>,
    ) {
        let count = 2 * STEPS as usize + 1;
        for index in 0..count.pow(alone.len() as u32) {
            let mut value = middle.0;
            let mut by = vec![0.0; numbers];
            let mut steps = Vec::new();
            for (axis, of_axis) in alone.iter().enumerate() {
                let step = index / count.pow(axis as u32) % count;
                steps.push(step as i32 - STEPS);
                let Some((score, state)) = &of_axis[step] else {
                    continue;
                };
                value += score - middle.0;
                for (by, change) in by.iter_mut().zip(self.steps(&middle.1, state)) {
                    *by += change;
                }
            }
            scores.push((value, row, steps, self.stepped(&middle.1, &by)));
        }
    }

    /// The step of Newton of the numbers `quick` alone, at most 3 standard deviations long, with the predicted ln p.
    fn stepped_quickly(
        &self,
        state: State,
        information: &Array2<f64>,
        quick: &[usize],
    ) -> Option<(f64, State)> {
        let (value, gradient) = self.value(&state)?;
        let n = quick.len();
        let part = Array2::from_shape_fn((n, n), |(i, j)| information[[quick[i], quick[j]]]);
        let pull: Vec<f64> = quick.iter().map(|&i| gradient[i]).collect();
        let step = solve(&part, &pull)?;
        let promised = dot(&step, &pull);
        let fraction = (3.0 / promised.max(0.0).sqrt()).min(1.0);
        let mut by = vec![0.0; gradient.len()];
        for (&i, step) in quick.iter().zip(&step) {
            by[i] = fraction * step;
        }
        Some((
            value + (fraction - 0.5 * fraction * fraction) * promised,
            self.stepped(&state, &by),
        ))
    }
}

/// The lines near the vortices of a wake.
pub(crate) fn near_lines(model: &ScanModel, wake: &Wake) -> ScanModel {
    let reach_m = NEAR_OVER_SPACING * wake.spacing_m();
    model.with_lines(|line| {
        let to_left_m = model.wake.passes_m(line.ray, &wake.left);
        let to_right_m = model.wake.passes_m(line.ray, &wake.right);
        to_left_m < reach_m || to_right_m < reach_m
    })
}

/// The free numbers that move nothing but the given parameters.
fn free_numbers(groups: &[Vec<usize>], parameters: [Parameter; 2]) -> Vec<usize> {
    let indices = parameters.map(|parameter| parameter as usize);
    let mut numbers = Vec::new();
    for (number, group) in groups.iter().enumerate() {
        if group.iter().all(|index| indices.contains(index)) {
            numbers.push(number);
        }
    }
    numbers
}

/// ln p, row of the core radius, steps of the heights, and the state.
type Scored = (f64, usize, Vec<i32>, State);

/// The best of the scored states, without neighbours of a better one.
fn chosen(mut scores: Vec<Scored>) -> Vec<State> {
    scores.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen = distinct(scores, are_neighbours);
    chosen.truncate(PLACES);
    chosen.into_iter().map(|(_, _, _, state)| state).collect()
}

/// Whether two states differ by at most one core radius and one step of each height.
fn are_neighbours(a: &Scored, b: &Scored) -> bool {
    let is_near_row = a.1.abs_diff(b.1) <= 1;
    is_near_row && a.2.iter().zip(&b.2).all(|(a, b)| (a - b).abs() <= 1)
}
