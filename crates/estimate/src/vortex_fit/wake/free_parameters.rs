//! Which parameters of the wake a fit may change, and how they are tied together.
//!
//! A free number moves one parameter or two by the same amount; derivatives are summed accordingly.
//! Check: spreading a step and gathering a gradient are transposes of each other.

use ndarray::{Array1, Array2};

use crate::vortex_fit::{PARAMETERS, Wake};

/// How a quantity that both vortices have is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sharing {
    /// It keeps its value.
    Fixed,
    /// Both vortices change by the same amount (and start from their mean, lateral positions apart).
    Common,
    /// Each vortex has its own.
    Separate,
}

/// The background wind of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WindFit {
    /// Keeps its value.
    Fixed,
    /// The wind at the ground is fitted, the shear keeps its value.
    Uniform,
    /// Wind and shear are fitted.
    Linear,
    /// Wind, shear and the logarithmic part are fitted.
    LogLinear,
}

/// What a fit may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FreeParameters {
    /// Circulations.
    pub circulation: Sharing,
    /// Lateral positions; `Common` shifts the pair and keeps its spacing.
    pub lateral_position: Sharing,
    /// Heights.
    pub height: Sharing,
    /// Core radii.
    pub core_radius: Sharing,
    /// Background wind.
    pub wind: WindFit,
}

impl Default for FreeParameters {
    /// Circulations, positions and core radii of each vortex and a uniform wind: nine numbers.
    fn default() -> Self {
        Self {
            circulation: Sharing::Separate,
            lateral_position: Sharing::Separate,
            height: Sharing::Separate,
            core_radius: Sharing::Separate,
            wind: WindFit::Uniform,
        }
    }
}

impl FreeParameters {
    /// The same with one circulation for both vortices.
    #[must_use]
    pub fn common_circulation() -> Self {
        Self {
            circulation: Sharing::Common,
            ..Self::default()
        }
    }

    /// Places of the parameters that each free number moves.
    #[must_use]
    pub fn groups(&self) -> Vec<Vec<usize>> {
        let mut groups = Vec::new();
        for (sharing, places) in [
            (self.circulation, [0, 1]),
            (self.lateral_position, [2, 4]),
            (self.height, [3, 5]),
            (self.core_radius, [6, 7]),
        ] {
            match sharing {
                Sharing::Fixed => {}
                Sharing::Common => groups.push(places.to_vec()),
                Sharing::Separate => groups.extend(places.map(|place| vec![place])),
            }
        }
        match self.wind {
            WindFit::Fixed => {}
            WindFit::Uniform => groups.push(vec![8]),
            WindFit::Linear => groups.extend([vec![8], vec![9]]),
            WindFit::LogLinear => groups.extend([vec![8], vec![9], vec![10]]),
        }
        groups
    }

    /// The same without the numbers of a vortex that a wake does not have: one without circulation.
    pub(crate) fn groups_of(&self, wake: &Wake) -> Vec<Vec<usize>> {
        let mut groups = self.groups();
        for group in &mut groups {
            group.retain(|place| match place {
                0 | 2 | 3 | 6 => wake.left.circulation_m2_s != 0.0,
                1 | 4 | 5 | 7 => wake.right.circulation_m2_s != 0.0,
                _ => true,
            });
        }
        groups.retain(|group| !group.is_empty());
        groups
    }

    /// A start that obeys the ties: common quantities at their mean.
    pub(crate) fn start(&self, wake: &Wake) -> Wake {
        let mut p = wake.to_array();
        for (sharing, [a, b]) in [
            (self.circulation, [0, 1]),
            (self.height, [3, 5]),
            (self.core_radius, [6, 7]),
        ] {
            if sharing == Sharing::Common {
                let mean = 0.5 * (p[a] + p[b]);
                p[a] = mean;
                p[b] = mean;
            }
        }
        Wake::from_array(&p)
    }
}

/// A step of the free numbers, from that of all parameters.
pub(crate) fn free_numbers(step: &[f64], groups: &[Vec<usize>]) -> Array1<f64> {
    groups.iter().map(|group| step[group[0]]).collect()
}

/// Parameters after a step of the free numbers.
pub(crate) fn stepped(groups: &[Vec<usize>], p: &[f64], step: &[f64]) -> Vec<f64> {
    let mut p = p.to_vec();
    for (places, by) in groups.iter().zip(step) {
        places.iter().for_each(|&place| p[place] += by);
    }
    p
}

/// Derivatives with respect to the free numbers, of what does not depend on parameters beyond those given.
pub(crate) fn gathered(groups: &[Vec<usize>], slope: &[f64], out: &mut [f64]) {
    for (places, out) in groups.iter().zip(out) {
        *out = places.iter().filter_map(|&place| slope.get(place)).sum();
    }
}

/// Covariance of the parameters of a wake \[11, 11\] from that of the free numbers; fixed parameters have zeros.
pub(crate) fn spread(groups: &[Vec<usize>], covariance: &Array2<f64>) -> Array2<f64> {
    // each place belongs to one free number at most
    let numbers: [Option<usize>; PARAMETERS] =
        std::array::from_fn(|place| groups.iter().position(|group| group.contains(&place)));
    Array2::from_shape_fn((PARAMETERS, PARAMETERS), |(row, column)| {
        numbers[row]
            .zip(numbers[column])
            .map_or(0.0, |(i, j)| covariance[[i, j]])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gathering_a_gradient_is_the_transpose_of_spreading_a_step() {
        let free = FreeParameters {
            circulation: Sharing::Common,
            lateral_position: Sharing::Separate,
            height: Sharing::Common,
            core_radius: Sharing::Fixed,
            wind: WindFit::Linear,
        };
        let groups = free.groups();
        assert_eq!(groups.len(), 6);
        let step: Vec<f64> = (0..6).map(|i| 1.0 + i as f64).collect();
        let slope: [f64; PARAMETERS] = std::array::from_fn(|i| (i as f64 * 1.7).sin());
        let mut gradient = vec![0.0; 6];
        gathered(&groups, &slope, &mut gradient);
        let spread_step = stepped(&groups, &[0.0; PARAMETERS], &step);
        let a: f64 = spread_step.iter().zip(&slope).map(|(x, y)| x * y).sum();
        let b: f64 = step.iter().zip(&gradient).map(|(x, y)| x * y).sum();
        assert!((a - b).abs() < 1e-12);
        assert_eq!(spread_step[6], 0.0);
    }

    #[test]
    fn tied_parameters_share_their_variance_and_fixed_ones_have_none() {
        let groups = FreeParameters::common_circulation().groups();
        let covariance = Array2::from_diag(&ndarray::Array1::from_iter(
            (0..groups.len()).map(|i| 1.0 + i as f64),
        ));
        let all = spread(&groups, &covariance);
        assert_eq!(all[[0, 0]], 1.0);
        assert_eq!(all[[0, 1]], 1.0);
        assert_eq!(all[[9, 9]], 0.0);
        assert_eq!(all[[2, 4]], 0.0);
    }
}
