//! The ascent to a maximum of the likelihood of raw signals.
//!
//! The few lines through the cores make the likelihood of one scan curve quite differently from its mean over scans, so the
//! information serves only as the first curvature; it is then corrected from gradient to gradient.
//! Check: fits of signals against the bound; the ascent with lines far from the vortices replaced by a parabola ends where
//! that with all lines does.

use ndarray::Array2;

use crate::error::Error;
use crate::linalg::dot;
use crate::vortex_fit::levenberg_marquardt::{
    Normal, StoppingRule, converged, levenberg_marquardt,
};
use crate::vortex_fit::signal_fit::likelihood::groups;
use crate::vortex_fit::wake::free_parameters::{gathered, stepped};
use crate::vortex_fit::{PARAMETERS, Powers, ScanModel, ScanSignals, SignalFitOptions, Wake};

/// A wake and the powers of signal and noise.
pub(crate) type State = (Wake, Powers);

/// Contribution to ln p about a state of the lines that a model omits, to second order.
#[derive(Debug, Clone)]
pub(crate) struct Parabola {
    pub(crate) about: State,
    /// Derivatives by the free numbers.
    pub(crate) gradient: Vec<f64>,
    /// Information on them.
    pub(crate) information: Array2<f64>,
}

/// ln p of the free numbers and its ascent.
pub(crate) struct Ascent<'a> {
    pub(crate) model: &'a ScanModel,
    pub(crate) signals: &'a ScanSignals,
    pub(crate) options: &'a SignalFitOptions,
    /// The lines that the model omits.
    pub(crate) others: Option<Parabola>,
}

impl Ascent<'_> {
    fn groups(&self) -> Vec<Vec<usize>> {
        groups(&self.options.free, self.options.fit_powers)
    }

    /// The state after a step of the free numbers.
    pub(crate) fn stepped(&self, state: &State, step: &[f64]) -> State {
        let numbers = stepped(&self.groups(), &numbers(state), step);
        let powers = Powers {
            log_signal: numbers[PARAMETERS],
            log_noise: numbers[PARAMETERS + 1],
        };
        (Wake::from_list(&numbers), powers)
    }

    /// The free numbers of `to`, counted from `from`.
    pub(crate) fn steps(&self, from: &State, to: &State) -> Vec<f64> {
        let from = numbers(from);
        let to = numbers(to);
        let mut steps = Vec::new();
        for group in self.groups() {
            steps.push(to[group[0]] - from[group[0]]);
        }
        steps
    }

    /// ln p and its gradient by the free numbers; nothing where the model does not exist.
    pub(crate) fn value(&self, state: &State) -> Option<(f64, Vec<f64>)> {
        let value = self.model.log_likelihood(self.signals, &state.0, state.1)?;
        let mut slopes = value.by_wake.to_vec();
        slopes.extend(value.by_powers);
        let groups = self.groups();
        let mut gradient = vec![0.0; groups.len()];
        gathered(&groups, &slopes, &mut gradient);
        let mut log_likelihood = value.log_likelihood;
        if let Some(others) = &self.others {
            let away = self.steps(&others.about, state);
            let pull = times(&others.information, &away);
            log_likelihood += dot(&others.gradient, &away) - 0.5 * dot(&pull, &away);
            for (index, slope) in gradient.iter_mut().enumerate() {
                *slope += others.gradient[index] - pull[index];
            }
        }
        Some((log_likelihood, gradient))
    }

    /// Information on the free numbers, from every `stride`-th line of the model.
    pub(crate) fn information(
        &self,
        (wake, powers): &State,
        stride: usize,
    ) -> Result<Array2<f64>, Error> {
        let options = self.options;
        let mut information = self.model.information(
            wake,
            *powers,
            &options.free,
            options.fit_powers,
            stride.max(1),
        )?;
        if let Some(others) = &self.others {
            information += &others.information;
        }
        Ok(information)
    }

    /// Climbs to a maximum of the likelihood; returns the state and its ln p.
    ///
    /// # Errors
    /// [`Error::NotConverged`]; [`Error::Linalg`] if a covariance is not positive definite.
    pub(crate) fn climb(&self, start: State) -> Result<(State, f64), Error> {
        let mut curvature = self.information(&start, self.options.information_stride)?;
        let origin = vec![0.0; curvature.nrows()];
        let mut last: Option<(Vec<f64>, Vec<f64>)> = None;
        let stop = StoppingRule {
            iterations: self.options.max_iterations,
            sigmas: self.options.tolerance_sigmas,
            is_secant: true,
        };
        let end = levenberg_marquardt(
            origin,
            stop,
            |x: &Vec<f64>| {
                let (log_likelihood, mut gradient) = self.value(&self.stepped(&start, x))?;
                for slope in &mut gradient {
                    *slope = -*slope;
                }
                if let Some((last_x, last_gradient)) = &last {
                    let step = difference(x, last_x);
                    let change = difference(&gradient, last_gradient);
                    learn(&mut curvature, &step, &change);
                }
                last = Some((x.clone(), gradient.clone()));
                Some(Normal {
                    cost: -log_likelihood,
                    gradient,
                    curvature: curvature.clone(),
                })
            },
            |x, step| x.iter().zip(step).map(|(x, s)| x + s).collect(),
        );
        let end = converged(end, stop)?;
        Ok((self.stepped(&start, &end.at), -end.normal.cost))
    }
}

/// a - b, element by element.
fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// The parameters of the wake and the logarithms of the powers.
fn numbers((wake, powers): &State) -> Vec<f64> {
    let mut numbers = wake.to_array().to_vec();
    numbers.push(powers.log_signal);
    numbers.push(powers.log_noise);
    numbers
}

/// A matrix times a vector.
pub(crate) fn times(matrix: &Array2<f64>, vector: &[f64]) -> Vec<f64> {
    let rows = matrix.rows().into_iter();
    rows.map(|row| dot(&row.to_vec(), vector)).collect()
}

/// Corrects the curvature so that it explains the change `y` of the gradient over the step `s`: the update of Broyden, Fletcher,
/// Goldfarb and Shanno, damped after Powell (1978) so that it stays positive definite.
fn learn(curvature: &mut Array2<f64>, s: &[f64], y: &[f64]) {
    let hs = times(curvature, s);
    let shs = dot(s, &hs);
    let sy = dot(s, y);
    if shs <= 0.0 {
        return;
    }
    let fraction = if sy >= 0.2 * shs {
        1.0
    } else {
        0.8 * shs / (shs - sy)
    };
    let mut r = Vec::with_capacity(y.len());
    for (y, h) in y.iter().zip(&hs) {
        r.push(fraction * y + (1.0 - fraction) * h);
    }
    let sr = dot(s, &r);
    for ((i, j), c) in curvature.indexed_iter_mut() {
        *c += r[i] * r[j] / sr - hs[i] * hs[j] / shs;
    }
}
