//! What is expected of the velocities of a map, with slopes.
//!
//! The parameters are a list: the ten of a wake and, if secondary vortices are fitted, those of each. What
//! gates show in the mean ([`Gates`](crate::vortex_fit::map_fit::gates::Gates)) and what an estimator shows have no more in common than this
//! trait; of the latter, least squares see the [`Linear`]. Check: fits of exact maps; difference quotients.

use ndarray::{Array2, Zip};

use crate::vortex_fit::map_fit::cells::Cell;
use crate::vortex_fit::wake::free_parameters::{free_numbers, stepped};
use crate::vortex_fit::wake::pair::SECONDARY_PARAMETERS;
use crate::vortex_fit::{PARAMETERS, Wake};

/// Velocities \[m/s\] \[line, gate\], and their derivatives by free number; NaN where there are none.
pub(crate) struct Predicted {
    pub(crate) velocity_m_s: Array2<f64>,
    pub(crate) slopes: Vec<Array2<f64>>,
}

/// A model of the velocities of a map.
pub(crate) trait Prediction: Sync {
    /// Whether the model exists there.
    fn allows(&self, p: &[f64]) -> bool;

    /// Velocities at the parameters `p`, and their slopes by `groups` of them.
    fn predict(&self, p: &[f64], groups: &[Vec<usize>]) -> Predicted;

    /// Where the model is exact: everywhere, or where it was linearised.
    fn about<'p>(&'p self, p: &'p [f64]) -> &'p [f64] {
        p
    }

    /// Velocities with the other profile of the cores.
    fn of_other_profile(&self, wake: &Wake) -> Array2<f64>;

    /// Variance of the air's velocities at each place \[m^2/s^2\], if measured ones scatter the more the larger it is.
    fn air_variances(&self, _p: &[f64]) -> Option<Array2<f64>> {
        None
    }
}

/// Slopes of a map about `p`, where it is `here`: difference quotients over steps of about a third of what a scan tells of a parameter. Peaks
/// of spectra jump, and over such a step enough of them do for a mean slope.
pub(crate) fn quotients(
    velocities: impl Fn(&[f64]) -> Array2<f64>,
    p: &[f64],
    here: &Array2<f64>,
    groups: &[Vec<usize>],
) -> Vec<Array2<f64>> {
    let mut quotients = Vec::with_capacity(groups.len());
    for group in groups {
        let step = step(p, group[0]);
        let stepped = stepped(std::slice::from_ref(group), p, &[step]);
        quotients.push((velocities(&stepped) - here) / step);
    }
    quotients
}

/// Slopes about one list of parameters serve for another while no parameter is more than so many steps, each a third of an error, away.
const NEAR: f64 = 3.0;
/// Or while the step to it is less than this many standard errors.
const NEAR_SIGMAS: f64 = 1.0;
/// The map is linear enough over this many steps.
const REACH: f64 = 12.0;
/// Spacing that stands for that of a vortex without a partner \[m\].
pub(crate) const LONE_M: f64 = 45.0;
/// Steps of secondary vortices over the circulation and the height of their vortex, and of the logarithm of their core radii.
const SECONDARY: f64 = 0.02;
const LOG_CORE: f64 = 0.1;

/// Step of a difference quotient.
fn step(p: &[f64], place: usize) -> f64 {
    let wake = Wake::from_list(p);
    let spacing_m = if wake.is_pair() {
        wake.spacing_m()
    } else {
        LONE_M
    };
    match place {
        0 | 1 => 0.01 * p[place].abs().max(1.0),
        2..=5 => 0.006 * spacing_m,
        6 | 7 => 0.002 * spacing_m,
        8 | 10 => 0.1,
        9 => 0.1 / spacing_m,
        _ => {
            let own = [wake.left, wake.right][(place - PARAMETERS) / SECONDARY_PARAMETERS];
            match (place - PARAMETERS) % SECONDARY_PARAMETERS {
                0 => SECONDARY * own.circulation_m2_s.abs().max(1.0),
                3 => LOG_CORE,
                _ => SECONDARY * own.height_m,
            }
        }
    }
}

/// Whether slopes about one list of parameters serve for another.
pub(crate) fn near(a: &[f64], b: &[f64]) -> bool {
    (0..a.len()).all(|place| (b[place] - a[place]).abs() <= NEAR * step(a, place))
}

/// A model to first order about `at`, with the deviations that the residuals tell there.
pub(crate) struct Linear {
    pub(crate) at: Vec<f64>,
    pub(crate) here: Predicted,
    /// Where the slopes were taken.
    pub(crate) slopes_at: Vec<f64>,
    /// Its free numbers.
    pub(crate) groups: Vec<Vec<usize>>,
    pub(crate) cells: Vec<Cell>,
    /// Of the residuals over the stated deviations in uniform wind.
    pub(crate) scale: f64,
    /// Velocities that count as one.
    pub(crate) counted: f64,
}

impl Linear {
    /// Its cells at which another one has a velocity, too.
    pub(crate) fn shared_with(&self, other: &Self) -> Vec<Cell> {
        let velocity_m_s = &other.here.velocity_m_s;
        let mut cells = self.cells.clone();
        cells.retain(|cell| velocity_m_s[[cell.line, cell.gate]].is_finite());
        cells
    }

    /// Whether its slopes serve for other parameters, too; `curvature` is that of the sum of squares.
    pub(crate) fn serves(&self, p: &[f64], curvature: &Array2<f64>) -> bool {
        let away: Vec<f64> = p
            .iter()
            .zip(&self.slopes_at)
            .map(|(p, at)| p - at)
            .collect();
        let away = free_numbers(&away, &self.groups);
        let sigmas = (away.dot(&curvature.dot(&away)) / self.counted).sqrt();
        near(&self.slopes_at, p) || sigmas <= NEAR_SIGMAS
    }

    /// The part of the way to other parameters that the slopes can speak for.
    pub(crate) fn reach(&self, to: &[f64]) -> f64 {
        let mut reach = 1.0_f64;
        for (place, (to, at)) in to.iter().zip(&self.at).enumerate() {
            let away = (to - at).abs().max(f64::MIN_POSITIVE);
            reach = reach.min(REACH * step(&self.at, place) / away);
        }
        reach
    }
}

impl Prediction for Linear {
    /// To first order everything is possible.
    fn allows(&self, _p: &[f64]) -> bool {
        true
    }

    fn predict(&self, p: &[f64], groups: &[Vec<usize>]) -> Predicted {
        let mut velocity_m_s = self.here.velocity_m_s.clone();
        for (group, slope) in groups.iter().zip(&self.here.slopes) {
            let away = p[group[0]] - self.at[group[0]];
            Zip::from(&mut velocity_m_s)
                .and(slope)
                .for_each(|velocity, slope| *velocity += slope * away);
        }
        Predicted {
            velocity_m_s,
            slopes: self.here.slopes.clone(),
        }
    }

    fn about<'p>(&'p self, _p: &'p [f64]) -> &'p [f64] {
        &self.at
    }

    fn of_other_profile(&self, _wake: &Wake) -> Array2<f64> {
        self.here.velocity_m_s.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circulation known to 40 m^2/s, of 400 with steps of 4: slopes serve for an error, and where errors are small for three steps.
    #[test]
    fn slopes_serve_for_less_than_a_standard_error_or_for_a_few_steps() {
        let at = Wake::from_array(&[
            400.0, 400.0, 376.5, 45.0, 423.5, 45.0, 2.0, 2.0, 0.0, 0.0, 0.0,
        ])
        .to_array()
        .to_vec();
        let velocity_m_s = Array2::zeros((1, 1));
        let linear = Linear {
            here: Predicted {
                slopes: vec![velocity_m_s.clone()],
                velocity_m_s,
            },
            slopes_at: at.clone(),
            at: at.clone(),
            groups: vec![vec![0]],
            cells: Vec::new(),
            scale: 1.0,
            counted: 2.0,
        };
        let serves_after = |away_m2_s: f64, error_m2_s: f64| {
            let mut p = at.clone();
            p[0] += away_m2_s;
            // two velocities count as one
            linear.serves(&p, &Array2::from_elem((1, 1), 2.0 / error_m2_s.powi(2)))
        };
        assert!(serves_after(39.0, 40.0) && !serves_after(41.0, 40.0));
        assert!(serves_after(11.0, 1.0) && !serves_after(13.0, 1.0));
    }
}
