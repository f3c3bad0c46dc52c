//! The tops of the likelihood of raw signals: where they may be, and what the lower ones mean for the error of the highest.
//!
//! Few lines cross a core, and each has its speckle: ln p has several tops that differ in the core radius and in the heights
//! by about the distance of lines. Lines far from the vortices know nothing of that; near one top they are a parabola. So core
//! radii and heights are tried on the near lines alone: what a height does is added up for the two vortices, the numbers that
//! ln p is nearly a parabola in (circulations, lateral positions, wind, powers) take the step that the information says, and the
//! best places are climbed from. Check: the top that a start at the truth finds is found.

use ndarray::Array2;

use crate::error::Error;
use crate::linalg::dot;
use crate::vortex_fit::damped_newton::{inverse, solve};
use crate::vortex_fit::signal_fit::ascent::{Ascent, Parabola, State, times};
use crate::vortex_fit::signal_fit::scan_model::Line;
use crate::vortex_fit::top::{SAME_SIGMAS, distinct};
use crate::vortex_fit::{Parameter, ScanModel, SignalFitOptions, Vortex, Wake};

/// Core radii that are tried, over the spacing of the vortices.
pub(crate) const CORES_OVER_SPACING: [f64; 5] = [0.015, 0.025, 0.042, 0.07, 0.12];
/// Lines that pass a vortex within this part of the spacing are near.
const NEAR_OVER_SPACING: f64 = 0.2;
/// Heights are tried so many steps up and down.
const STEPS: i32 = 4;
/// A step of height over its standard deviation.
const STEP_SIGMAS: f64 = 1.5;
/// Places from which the near lines are climbed.
const PLACES: usize = 8;
/// Tops this far below the best do not count: weight exp(-6).
const FAR_BELOW: f64 = 6.0;
/// Of the others, at most so many are reported.
const MOST: usize = 6;
/// Tops of the near lines within this of the best are climbed with all lines; the others keep what the near lines say.
const CLOSE_BELOW: f64 = 2.0;

/// Another top, judged by the near lines.
pub(crate) struct Candidate {
    pub(crate) state: State,
    /// ln p over that of the first top.
    pub(crate) gain: f64,
    /// Whether it may be the highest when judged by all lines.
    pub(crate) close: bool,
}

impl Ascent<'_> {
    /// States near other tops than `top`, the best first, judged by the lines near the vortices.
    ///
    /// `near` is a model of the near lines ([`near_lines`]).
    ///
    /// # Errors
    /// As [`ScanModel::information`].
    pub(crate) fn other_tops(&self, near: &ScanModel, top: State) -> Result<Vec<Candidate>, Error> {
        let Self {
            model,
            signals,
            options,
            ..
        } = self;
        let rough = SignalFitOptions {
            tolerance_sigmas: 0.1,
            information_stride: 2,
            ..**options
        };
        let mut ascent = Ascent {
            model: near,
            signals,
            options: &rough,
            others: None,
        };
        let Some((value_at_top, at_top)) = ascent.value(&top) else {
            return Ok(Vec::new());
        };
        let far = model.of_lines(|line| !near.has(line));
        let information = far.information(
            &top.0,
            top.1,
            &options.free,
            options.fit_powers,
            options.information_stride,
        )?;
        // at the top of all lines those far pull as the near ones do, the other way
        let gradient = at_top.iter().map(|g| -g).collect();
        ascent.others = Some(Parabola {
            about: top,
            gradient,
            information,
        });
        let information = ascent.information(&top, 1)?;
        let starts = ascent.places(&top, &information);
        let ends = starts
            .into_iter()
            .filter_map(|start| ascent.climb(start).ok());
        let mut found = distinct(ends, |other, end| {
            ascent.same(&information, &end.0, &other.0)
        });
        let best = found
            .iter()
            .map(|(_, log_likelihood)| *log_likelihood)
            .fold(value_at_top, f64::max);
        found.retain(|(state, value)| {
            *value > best - FAR_BELOW && !ascent.same(&information, state, &top)
        });
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let candidate = |(state, value): (State, f64)| Candidate {
            state,
            gain: value - value_at_top,
            close: value > best - CLOSE_BELOW,
        };
        Ok(found.into_iter().take(MOST).map(candidate).collect())
    }

    /// Whether two states are the same top.
    pub(crate) fn same(&self, information: &Array2<f64>, a: &State, b: &State) -> bool {
        let apart = self.steps(a, b);
        dot(&times(information, &apart), &apart) < SAME_SIGMAS * SAME_SIGMAS
    }

    /// Places to climb from, the most promising first: no two of them are neighbours.
    fn places(&self, top: &State, information: &Array2<f64>) -> Vec<State> {
        let (heights, cores) = axes(self.options);
        let Ok(covariance) = inverse("information on the wake", information) else {
            return Vec::new();
        };
        let deviations: Vec<f64> = covariance
            .diag()
            .iter()
            .map(|variance| variance.max(0.0).sqrt())
            .collect();
        let rows = if cores.is_empty() {
            1
        } else {
            CORES_OVER_SPACING.len()
        };
        let quick: Vec<usize> = (0..information.nrows())
            .filter(|i| !heights.contains(i) && !cores.contains(i))
            .collect();
        let mut scores: Vec<(f64, usize, Vec<i32>, State)> = Vec::new();
        for (row, over_spacing) in CORES_OVER_SPACING.iter().enumerate().take(rows) {
            let mut at = *top;
            if !cores.is_empty() {
                at.0 = at.0.with_cores(over_spacing * top.0.spacing_m());
            }
            let score = |state: State| self.stepped_quickly(state, information, &quick);
            let Some(middle) = score(at) else { continue };
            // what each height does alone, the other where it is
            let alone: Vec<Vec<Option<(f64, State)>>> = heights
                .iter()
                .map(|&axis| {
                    let of = |step: i32| {
                        if step == 0 {
                            return Some(middle);
                        }
                        let mut by = vec![0.0; deviations.len()];
                        by[axis] = f64::from(step) * STEP_SIGMAS * deviations[axis];
                        score(self.stepped(&middle.1, &by))
                    };
                    (-STEPS..=STEPS).map(of).collect()
                })
                .collect();
            // adds up what the heights do, for all pairs of them
            let count = 2 * STEPS as usize + 1;
            for index in 0..count.pow(heights.len() as u32) {
                let steps: Vec<usize> = (0..heights.len())
                    .map(|axis| index / count.pow(axis as u32) % count)
                    .collect();
                let mut value = middle.0;
                let mut by = vec![0.0; deviations.len()];
                for (axis, &step) in steps.iter().enumerate() {
                    let Some((score, state)) = &alone[axis][step] else {
                        continue;
                    };
                    value += score - middle.0;
                    by.iter_mut()
                        .zip(self.steps(&middle.1, state))
                        .for_each(|(b, s)| *b += s);
                }
                let steps = steps.iter().map(|&step| step as i32 - STEPS).collect();
                scores.push((value, row, steps, self.stepped(&middle.1, &by)));
            }
        }
        chosen(scores)
    }

    /// The step of Newton of the numbers `quick` alone, at most 3 standard deviations long, with the ln p that it promises.
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
        let share = (3.0 / promised.max(0.0).sqrt()).min(1.0);
        let mut by = vec![0.0; gradient.len()];
        quick
            .iter()
            .zip(&step)
            .for_each(|(&i, s)| by[i] = share * s);
        Some((
            value + (share - 0.5 * share * share) * promised,
            self.stepped(&state, &by),
        ))
    }
}

/// The lines near the vortices of a wake.
pub(crate) fn near_lines(model: &ScanModel, wake: &Wake) -> ScanModel {
    let reach_m = NEAR_OVER_SPACING * wake.spacing_m();
    let passes = |line: &Line, vortex: &Vortex| model.wake.passes_m(line.ray, vortex) < reach_m;
    model.of_lines(|line| passes(line, &wake.left) || passes(line, &wake.right))
}

/// The free numbers that move heights, and those that move core radii.
fn axes(options: &SignalFitOptions) -> (Vec<usize>, Vec<usize>) {
    let groups = options.free.groups();
    let of = |places: [Parameter; 2]| {
        (0..groups.len())
            .filter(|&g| {
                groups[g]
                    .iter()
                    .all(|p| places.iter().any(|q| *q as usize == *p))
            })
            .collect()
    };
    (
        of([Parameter::LeftHeight, Parameter::RightHeight]),
        of([Parameter::LeftCore, Parameter::RightCore]),
    )
}

/// The best of the scored places, without neighbours of a better one.
fn chosen(mut scores: Vec<(f64, usize, Vec<i32>, State)>) -> Vec<State> {
    scores.sort_by(|a, b| b.0.total_cmp(&a.0));
    let taken = distinct(
        scores,
        |(_, row, steps, _), (_, other_row, other_steps, _)| {
            row.abs_diff(*other_row) <= 1
                && steps
                    .iter()
                    .zip(other_steps)
                    .all(|(a, b)| (a - b).abs() <= 1)
        },
    );
    taken
        .into_iter()
        .take(PLACES)
        .map(|(_, _, _, state)| state)
        .collect()
}
