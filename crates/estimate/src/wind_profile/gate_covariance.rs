//! Covariance of the velocities of two gates in isotropic turbulence, each the mean of the air along its beam with a Gaussian weight.
//!
//! ```text
//! B = ∫∫ g(a) g(b) e1·R(d + a e1 - b e2)·e2,   R = B_NN + (B_LL - B_NN) r r / r^2,   d = x1 - x2 - U (t1 - t2)
//! ```
//!
//! Beams less than 0.1 rad apart count as parallel: the weights of both gates are one Gaussian of sqrt(2) times the standard deviation, and the
//! covariance depends on the distances s along and y across the mean direction alone. It is tabulated over (sqrt s, sqrt y). The cosine of
//! their angle, by which it is smaller, leaves no step at 0.1 rad, which could make a covariance matrix indefinite.
//! Other beams take seven Gauss-Hermite nodes along each gate, or three where the gates are far apart.
//! Check: tables by an independent quadrature in `tests/reference/wind`.

use ndarray::Array2;

use super::correlation::{Correlation, FARTHEST, unit_turbulence};
use crate::error::{Error, not_empty, not_negative, positive};

/// Angle below which beams count as parallel \[rad\].
const PARALLEL_RAD: f64 = 0.1;
/// Nodes and weights of the Gauss-Hermite rule of seven nodes for a normal distribution.
const NODES: [(f64, f64); 7] = [
    (-3.750_439_717_725_742, 5.482_688_559_722_18e-4),
    (-2.366_759_410_734_541, 3.075_712_396_758_65e-2),
    (-1.154_405_394_739_968, 0.240_123_178_605_012_7),
    (0.0, 0.457_142_857_142_857_1),
    (1.154_405_394_739_968, 0.240_123_178_605_012_7),
    (2.366_759_410_734_541, 3.075_712_396_758_65e-2),
    (3.750_439_717_725_742, 5.482_688_559_722_18e-4),
];
/// The rule of three nodes, for gates at least [`FAR_APART`] standard deviations apart: the sixth moment, the first that it misses, changes a
/// correlation that grows with the distance to the power of 2/3 by less than 1e-6 there.
const FAR_NODES: [(f64, f64); 3] = [
    (-1.732_050_807_568_877_2, 1.0 / 6.0),
    (0.0, 2.0 / 3.0),
    (1.732_050_807_568_877_2, 1.0 / 6.0),
];
const FAR_APART: f64 = 10.0;
/// Gates that are shorter than this fraction of an outer scale have no table.
const SHORTEST: f64 = 1e-3;
/// Knots of a table along each axis in square roots of the standard deviation, and their limits.
const KNOTS_PER_ROOT: f64 = 8.0;
const FEWEST_KNOTS: usize = 40;
const MOST_KNOTS: usize = 200;
/// Standard deviations after which a Gaussian weight ends in the quadrature of a table.
const REACH: f64 = 7.0;
/// Distance across beams, in standard deviations, that stands for 0: the quadrature steps in multiples of it.
const LEAST_ACROSS: f64 = 1e-4;

/// Where a gate is in air that is carried along, and where it looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GatePosition {
    /// Centre of the gate less the way of the air until its time \[m\].
    pub position_m: [f64; 3],
    /// Unit vector of the beam, away from the lidar.
    pub direction: [f64; 3],
}

impl GatePosition {
    /// The gate at a range \[m\] along a unit vector, at a time \[s\], in air that moves with a velocity \[m/s\].
    #[must_use]
    pub fn new(direction: [f64; 3], range_m: f64, time_s: f64, carried_m_s: [f64; 3]) -> Self {
        let mut position_m = [0.0; 3];
        for (d, coordinate_m) in position_m.iter_mut().enumerate() {
            *coordinate_m = direction[d] * range_m - carried_m_s[d] * time_s;
        }
        Self {
            position_m,
            direction,
        }
    }
}

/// Covariance of gate velocities for turbulence of a dissipation of 1 m²/s³, at several outer scales; it grows with eps^(2/3).
#[derive(Debug, Clone)]
pub struct GateCovariance {
    correlation: Correlation,
    gate_std_m: f64,
    scales: Vec<Scale>,
    /// Whether parallel beams have tables at all outer scales.
    has_tables: bool,
}

/// The covariance at one outer scale.
#[derive(Debug, Clone)]
struct Scale {
    /// L^(-2/3).
    per_w: f64,
    variance_m2_s2: f64,
    /// For parallel beams; none for points and very short gates.
    parallel: Option<Table>,
}

impl GateCovariance {
    /// For gates with a Gaussian weight of standard deviation `gate_std_m` \[m\], 0 for points, at each outer scale \[m\]; gates of parallel beams
    /// that are more than `farthest_m` apart are taken as that far apart.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a negative width, or an outer scale or a distance that is not above 0; [`Error::Empty`] without outer scales.
    pub fn new(gate_std_m: f64, outer_scale_m: &[f64], farthest_m: f64) -> Result<Self, Error> {
        not_negative("gate_std_m", gate_std_m)?;
        not_empty("outer_scale_m", outer_scale_m.len())?;
        positive("farthest_m", farthest_m)?;
        let correlation = Correlation::new();
        let mut scales = Vec::with_capacity(outer_scale_m.len());
        for outer_scale_m in outer_scale_m {
            positive("outer_scale_m", *outer_scale_m)?;
            let end_m = farthest_m.min(FARTHEST * outer_scale_m);
            let parallel = match gate_std_m < SHORTEST * outer_scale_m {
                true => None,
                false => Some(Table::new(&correlation, gate_std_m, *outer_scale_m, end_m)),
            };
            scales.push(Scale {
                per_w: outer_scale_m.powf(-2.0 / 3.0),
                variance_m2_s2: unit_turbulence(*outer_scale_m).variance_m2_s2(),
                parallel,
            });
        }
        Ok(Self {
            correlation,
            gate_std_m,
            has_tables: scales.iter().all(|scale| scale.parallel.is_some()),
            scales,
        })
    }

    /// Number of outer scales.
    #[must_use]
    pub fn len(&self) -> usize {
        self.scales.len()
    }

    /// Whether there is no outer scale; there always is one.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.scales.is_empty()
    }

    /// Covariance \[m²/s²\] of the velocities of two gates at each outer scale, (A12) or (A13).
    ///
    /// # Panics
    /// If `out_m2_s2` has not one number for each outer scale.
    pub fn covariance_into(&self, a: &GatePosition, b: &GatePosition, out_m2_s2: &mut [f64]) {
        assert_eq!(
            out_m2_s2.len(),
            self.scales.len(),
            "one covariance for each outer scale"
        );
        let mut apart_m = [0.0; 3];
        for (d, apart) in apart_m.iter_mut().enumerate() {
            *apart = a.position_m[d] - b.position_m[d];
        }
        let mut mean = [0.0; 3];
        for (d, mean) in mean.iter_mut().enumerate() {
            *mean = a.direction[d] + b.direction[d];
        }
        let cosine = dot(a.direction, b.direction);
        let is_parallel = cosine > PARALLEL_RAD.cos();
        if !self.has_tables || !is_parallel {
            self.wide_into(apart_m, a.direction, b.direction, out_m2_s2);
            return;
        }
        let along_m = dot(apart_m, mean) / dot(mean, mean).sqrt();
        let across_m = (dot(apart_m, apart_m) - along_m * along_m).max(0.0).sqrt();
        let along_root = along_m.abs().sqrt();
        let across_root = across_m.sqrt();
        for (scale, out) in self.scales.iter().zip(out_m2_s2) {
            let table = scale.parallel.as_ref();
            *out = table.map_or(0.0, |table| cosine * table.at(along_root, across_root));
        }
    }

    /// Covariance of gates of any directions, by nodes along both.
    fn wide_into(&self, apart_m: [f64; 3], a: [f64; 3], b: [f64; 3], out_m2_s2: &mut [f64]) {
        out_m2_s2.fill(0.0);
        let cosine = dot(a, b);
        let far_m = FAR_APART * self.gate_std_m;
        let nodes = if self.gate_std_m == 0.0 {
            &NODES[3..4]
        } else if dot(apart_m, apart_m) > far_m * far_m {
            &FAR_NODES[..]
        } else {
            &NODES[..]
        };
        for (node_a, weight_a) in nodes {
            for (node_b, weight_b) in nodes {
                let mut r_m = apart_m;
                for d in 0..3 {
                    r_m[d] += self.gate_std_m * (node_a * a[d] - node_b * b[d]);
                }
                let r2 = dot(r_m, r_m);
                let w = r2.powf(1.0 / 3.0);
                // Of two equal points the separation has no direction, and B_LL is B_NN.
                let product = dot(a, r_m) * dot(b, r_m) / r2.max(f64::MIN_POSITIVE);
                for (scale, out) in self.scales.iter().zip(out_m2_s2.iter_mut()) {
                    let (f, g) = self.correlation.at(w * scale.per_w);
                    *out += weight_a * weight_b * ((f - g) * cosine + g * product);
                }
            }
        }
        let total: f64 = nodes.iter().map(|(_, weight)| weight).sum();
        for (scale, out) in self.scales.iter().zip(out_m2_s2) {
            *out *= scale.variance_m2_s2 / (total * total);
        }
    }

    /// Covariance matrices of gates at each outer scale, the lower triangle filled.
    #[must_use]
    pub fn matrices(&self, gates: &[GatePosition]) -> Vec<Array2<f64>> {
        let order = gates.len();
        let mut matrices = vec![Array2::zeros((order, order)); self.scales.len()];
        let mut values = vec![0.0; self.scales.len()];
        for i in 0..order {
            for j in 0..=i {
                self.covariance_into(&gates[i], &gates[j], &mut values);
                for (matrix, value) in matrices.iter_mut().zip(&values) {
                    matrix[[i, j]] = *value;
                }
            }
        }
        matrices
    }

    /// Covariance matrices of the gates of two blocks at each outer scale.
    #[must_use]
    pub fn between(&self, a: &[GatePosition], b: &[GatePosition]) -> Vec<Array2<f64>> {
        let mut matrices = vec![Array2::zeros((a.len(), b.len())); self.scales.len()];
        let mut values = vec![0.0; self.scales.len()];
        for (i, one) in a.iter().enumerate() {
            for (j, other) in b.iter().enumerate() {
                self.covariance_into(one, other, &mut values);
                for (matrix, value) in matrices.iter_mut().zip(&values) {
                    matrix[[i, j]] = *value;
                }
            }
        }
        matrices
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Covariance of parallel gates on a grid of square roots of the distances along and across.
#[derive(Debug, Clone)]
struct Table {
    /// \[across, along\], one knot beyond the end.
    values_m2_s2: Vec<f64>,
    knots: usize,
    per_root: f64,
}

impl Table {
    fn new(correlation: &Correlation, gate_std_m: f64, outer_scale_m: f64, end_m: f64) -> Self {
        // Of the difference of two positions.
        let std_m = std::f64::consts::SQRT_2 * gate_std_m;
        let wanted = (KNOTS_PER_ROOT * (end_m / std_m.max(1e-9)).sqrt()).ceil();
        let knots = (wanted as usize).clamp(FEWEST_KNOTS, MOST_KNOTS);
        let step = end_m.sqrt() / (knots - 2) as f64;
        let mut values_m2_s2 = Vec::with_capacity(knots * knots);
        let along_m: Vec<f64> = (0..knots).map(|i| (step * i as f64).powi(2)).collect();
        for across_m in &along_m {
            let row = covariances_m2_s2(correlation, outer_scale_m, std_m, *across_m, &along_m);
            values_m2_s2.extend(row);
        }
        Self {
            values_m2_s2,
            knots,
            per_root: step.recip(),
        }
    }

    /// Covariance at distances of which the square roots are given \[sqrt m\]: cubic polynomials through four knots each way.
    #[inline]
    fn at(&self, along_root: f64, across_root: f64) -> f64 {
        let (along, along_weights) = self.stencil(along_root);
        let (across, across_weights) = self.stencil(across_root);
        let mut sum = 0.0;
        for (row, weight) in across.into_iter().zip(across_weights) {
            let row = &self.values_m2_s2[row * self.knots..(row + 1) * self.knots];
            let mut line = 0.0;
            for (column, weight) in along.into_iter().zip(along_weights) {
                line += weight * row[column];
            }
            sum += weight * line;
        }
        sum
    }

    /// Four knots about a position and Lagrange's weights of them. The covariance is even in the square roots.
    #[inline]
    fn stencil(&self, root: f64) -> ([usize; 4], [f64; 4]) {
        let last = (self.knots - 2) as f64;
        let knot = (root * self.per_root).min(last - 1e-9);
        let index = knot as usize;
        let t = knot - index as f64;
        let before = if index == 0 { 1 } else { index - 1 };
        let weights = [
            -t * (t - 1.0) * (t - 2.0) / 6.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * t * (t - 1.0) / 6.0,
        ];
        (
            [before, index, index + 1, (index + 2).min(self.knots - 1)],
            weights,
        )
    }
}

/// Step of t, and of Gaussian weights far from the least separation in standard deviations: the trapezoidal rule is exact to
/// 1e-8 with both.
const STEP: f64 = 0.1;
const FAR_STEP: f64 = 0.5;
/// Distance along the beam in standard deviations from which the other gate does not reach the least separation.
const FAR: f64 = 7.5;

/// Covariances \[m²/s²\] of parallel gates at one distance across their beams and some along them. Where they are near, the correlation is
/// summed on nodes that crowd where the separation is least: positions y sinh t, on which the separation is y cosh t.
fn covariances_m2_s2(
    correlation: &Correlation,
    outer_scale_m: f64,
    std_m: f64,
    across_m: f64,
    along_m: &[f64],
) -> Vec<f64> {
    let across_m = across_m.max(LEAST_ACROSS * std_m);
    let per_w = outer_scale_m.powf(-2.0 / 3.0);
    // Positions along the beam, increasing, and the correlation there times the step.
    let mut nodes = Vec::new();
    let end = ((FAR + REACH) * std_m / across_m).asinh();
    let count = (end / STEP).ceil() as i32;
    for i in -count..=count {
        let t = STEP * f64::from(i);
        let position_m = across_m * t.sinh();
        let width_m = STEP * across_m * t.cosh();
        let value = correlation_along(correlation, per_w, across_m, position_m);
        nodes.push((position_m, value * width_m));
    }
    let variance_m2_s2 = unit_turbulence(outer_scale_m).variance_m2_s2();
    let mut covariances_m2_s2 = Vec::with_capacity(along_m.len());
    for &along_m in along_m {
        let mut sum = 0.0;
        let mut total = 0.0;
        let reach_m = REACH * std_m;
        // Gates that are wide apart, or whose correlation is smooth over a weight.
        if along_m > FAR * std_m || across_m > 4.0 * std_m {
            let count = (REACH / FAR_STEP) as i32;
            for i in -count..=count {
                let deviations = FAR_STEP * f64::from(i);
                let weight = (-0.5 * deviations * deviations).exp();
                let position_m = along_m + deviations * std_m;
                sum += weight * correlation_along(correlation, per_w, across_m, position_m);
                total += weight;
            }
        } else {
            let first = nodes.partition_point(|node| node.0 < along_m - reach_m);
            let own = nodes[first..].iter();
            for (position_m, value) in own.take_while(|node| node.0 <= along_m + reach_m) {
                let deviations = (position_m - along_m) / std_m;
                sum += value * (-0.5 * deviations * deviations).exp();
            }
            total = (2.0 * std::f64::consts::PI).sqrt() * std_m;
        }
        covariances_m2_s2.push(variance_m2_s2 * sum / total);
    }
    covariances_m2_s2
}

/// Correlation of the components along the beams of two points, `position_m` apart along them.
fn correlation_along(correlation: &Correlation, per_w: f64, across_m: f64, position_m: f64) -> f64 {
    let across2 = across_m * across_m;
    let r2 = position_m * position_m + across2;
    let (f, g) = correlation.at(r2.cbrt() * per_w);
    f - g * across2 / r2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On either side of the angle from which beams are not parallel: a step of half a per cent of the variance, without the cosine, makes the
    /// covariance of some hundred gates in strong turbulence indefinite.
    #[test]
    fn beams_that_count_as_parallel_have_the_covariance_of_those_that_do_not() {
        let covariance = GateCovariance::new(14.0, &[30.0, 300.0], 1000.0).unwrap();
        let at = |angle_rad: f64, position_m: [f64; 3]| {
            let own = GatePosition {
                position_m: [0.0; 3],
                direction: [0.0, 0.0, 1.0],
            };
            let other = GatePosition {
                position_m,
                direction: [angle_rad.sin(), 0.0, angle_rad.cos()],
            };
            let mut out = [0.0; 2];
            covariance.covariance_into(&own, &other, &mut out);
            out
        };
        let own = at(0.0, [0.0; 3]);
        for position_m in [[20.0, 0.0, 0.0], [40.0, 0.0, 30.0], [5.0, 20.0, 60.0]] {
            let parallel = at(PARALLEL_RAD * (1.0 - 1e-9), position_m);
            let wide = at(PARALLEL_RAD * (1.0 + 1e-9), position_m);
            for scale in 0..2 {
                let step = (parallel[scale] - wide[scale]).abs() / own[scale];
                assert!(step < 1e-3, "{position_m:?}: {step}");
            }
        }
    }

    /// On either side of the distance from which beams that are not parallel take three nodes.
    #[test]
    fn three_nodes_of_far_gates_give_the_covariance_of_seven() {
        let gate_std_m = 14.0;
        let covariance = GateCovariance::new(gate_std_m, &[30.0, 300.0], 1000.0).unwrap();
        let at = |apart_m: f64, beam: [f64; 3]| {
            let own = GatePosition {
                position_m: [0.0; 3],
                direction: [0.0, 0.0, 1.0],
            };
            let other = GatePosition {
                position_m: [0.6 * apart_m, 0.0, 0.8 * apart_m],
                direction: beam,
            };
            let mut out = [0.0; 2];
            covariance.covariance_into(&own, &other, &mut out);
            out
        };
        let limit_m = FAR_APART * gate_std_m;
        for beam in [[0.6, 0.0, 0.8], [0.0, 0.6, 0.8], [-0.6, 0.0, 0.8]] {
            let near = at(limit_m * (1.0 - 1e-9), beam);
            let far = at(limit_m * (1.0 + 1e-9), beam);
            let own = at(0.0, [0.0, 0.0, 1.0]);
            for scale in 0..2 {
                let error = (far[scale] - near[scale]).abs() / own[scale];
                assert!(error < 2e-6, "{beam:?}: {error}");
            }
        }
    }
}
