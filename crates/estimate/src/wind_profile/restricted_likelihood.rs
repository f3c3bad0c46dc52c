//! Dissipation rate and noise from gate velocities, by restricted maximum likelihood.
//!
//! ```text
//! v ~ N(X b, t1 B(L) + t2 I),   Q orthogonal to X,   Q^T B Q = V diag(lambda) V^T,   y = V^T Q^T v
//! l(t1, t2; L) = -1/2 sum_i [ln(t1 lambda_i + t2) + y_i^2/(t1 lambda_i + t2)],   t1 = eps^(2/3),  t2 = variance of the noise
//! ```
//!
//! X holds the components of a mean wind and of its gradient with height, or what else is fitted beside the turbulence, so that neither says
//! anything of it (Patterson and Thompson 1971). Blocks of one geometry share their eigenvalues. Check: `edr_fit.csv`.

use ndarray::Array2;
use std::collections::BTreeMap;

use super::gate_covariance::{GateCovariance, GatePosition};
use crate::error::{Error, length};
use crate::linalg::dot;
use crate::linalg::tridiagonal::eigenvalues_with_components;
use crate::parallel::map_each;
use crate::retrieval::Whitening;

/// Columns of the mean are independent beyond this fraction of the largest one.
pub(super) const RANK: f64 = 1e-4;
/// Largest eps^(2/3) \[m^(4/3)/s^2\].
const MOST_EPS23: f64 = 4.0;
/// Largest fraction by which a step reduces an unknown, and when steps end.
const LARGEST_CUT: f64 = 0.7;
const ROUNDS: usize = 200;
const CONVERGED: f64 = 1e-9;
/// Positions, m, and directions that agree to this are one geometry.
const SAME_GEOMETRY: f64 = 1e-4;

/// A good velocity of one gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateSample {
    /// Time \[s\].
    pub time_s: f64,
    /// Unit vector of the beam (east, north, up), away from the lidar.
    pub direction: [f64; 3],
    /// Range of its centre \[m\].
    pub range_m: f64,
    /// Velocity away from the lidar \[m/s\].
    pub velocity_m_s: f64,
    /// Standard deviation of its noise \[m/s\], up to a common factor; 1 if it is unknown.
    pub noise_std_m_s: f64,
}

impl GateSample {
    /// Height over the lidar \[m\].
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.range_m * self.direction[2]
    }
}

/// Velocities whose covariance is taken into account; those of different blocks count as independent.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    pub(super) gates: Vec<GatePosition>,
    pub(super) velocity_m_s: Vec<f64>,
    pub(super) noise_std_m_s: Vec<f64>,
    /// Heights over the mean one of the block \[m\].
    heights_m: Vec<f64>,
    /// Columns of a mean that is no linear wind, of unit length \[m/s\].
    other_mean: Vec<Vec<f64>>,
    /// Factor of the correlation of the noise; none of independent noise.
    noise_factor: Option<Whitening>,
}

impl Block {
    /// The block of velocities in air that moves with a velocity \[m/s\] (east, north, up).
    #[must_use]
    pub fn new(samples: &[GateSample], carried_m_s: [f64; 3]) -> Self {
        let mut block = Self {
            gates: Vec::with_capacity(samples.len()),
            velocity_m_s: Vec::with_capacity(samples.len()),
            noise_std_m_s: Vec::with_capacity(samples.len()),
            heights_m: Vec::with_capacity(samples.len()),
            other_mean: Vec::new(),
            noise_factor: None,
        };
        let heights: f64 = samples.iter().map(GateSample::height_m).sum();
        let mean_m = heights / samples.len().max(1) as f64;
        for sample in samples {
            let gate =
                GatePosition::new(sample.direction, sample.range_m, sample.time_s, carried_m_s);
            block.gates.push(gate);
            block.velocity_m_s.push(sample.velocity_m_s);
            block.noise_std_m_s.push(sample.noise_std_m_s);
            block.heights_m.push(sample.height_m() - mean_m);
        }
        block
    }

    /// The block of what is left of velocities \[m/s\] after a fit, with the standard deviations of their noise \[m/s\], up to a common
    /// factor. The mean is any combination of `columns`, the derivatives of the fit by its parameters, each in its own unit.
    ///
    /// # Errors
    /// [`Error::Length`] for lists of different lengths.
    pub fn of_residuals(
        gates: Vec<GatePosition>,
        residual_m_s: Vec<f64>,
        noise_std_m_s: Vec<f64>,
        columns: &[Vec<f64>],
    ) -> Result<Self, Error> {
        length("residual_m_s", gates.len(), residual_m_s.len())?;
        length("noise_std_m_s", gates.len(), noise_std_m_s.len())?;
        let mut other_mean = Vec::with_capacity(columns.len());
        for column in columns {
            length("columns", gates.len(), column.len())?;
            let size = dot(column, column).sqrt();
            if size > 0.0 {
                other_mean.push(column.iter().map(|value| value / size).collect());
            }
        }
        Ok(Self {
            heights_m: vec![0.0; gates.len()],
            gates,
            velocity_m_s: residual_m_s,
            noise_std_m_s,
            other_mean,
            noise_factor: None,
        })
    }

    /// The same with the correlation of the noise, of which the lower triangle is read.
    ///
    /// # Errors
    /// [`Error::Length`] for another order, [`Error::Linalg`] for a matrix that is not positive definite.
    pub(crate) fn with_correlated_noise(self, correlation: Array2<f64>) -> Result<Self, Error> {
        let order = correlation.nrows();
        length("correlation of the noise", self.len(), order)?;
        let factor = Whitening::new(correlation).ok_or(Error::Linalg {
            what: "correlation of the noise",
            order,
            reason: "is not positive definite",
        })?;
        Ok(Self {
            noise_factor: Some(factor),
            ..self
        })
    }

    /// Number of velocities.
    #[must_use]
    pub fn len(&self) -> usize {
        self.velocity_m_s.len()
    }

    /// Whether it has no velocity.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.velocity_m_s.is_empty()
    }

    /// Where its gates are.
    #[must_use]
    pub fn gates(&self) -> &[GatePosition] {
        &self.gates
    }

    /// Columns of the mean over the standard deviations of the noise: those that are given, else the components of the directions, and these
    /// times the height over its spread.
    pub(super) fn mean_columns(&self) -> Vec<Vec<f64>> {
        if !self.other_mean.is_empty() {
            let columns = self.other_mean.iter();
            return columns.map(|column| self.over_noise(column)).collect();
        }
        let squares: f64 = self
            .heights_m
            .iter()
            .map(|height_m| height_m * height_m)
            .sum();
        // Heights that differ by less than a metre show no gradient.
        let spread_m = (squares / self.len().max(1) as f64).sqrt().max(1.0);
        let mut columns = Vec::with_capacity(6);
        for power in 0..2 {
            for d in 0..3 {
                let mut column = Vec::with_capacity(self.len());
                for (i, gate) in self.gates.iter().enumerate() {
                    let height = (self.heights_m[i] / spread_m).powi(power);
                    column.push(gate.direction[d] * height / self.noise_std_m_s[i]);
                }
                columns.push(column);
            }
        }
        columns
    }

    /// Velocities with white noise of unit variance.
    fn whitened(&self) -> Vec<f64> {
        self.over_noise(&self.velocity_m_s)
    }

    /// Numbers of the velocities, scaled so that the noise is white and has unit variance.
    fn over_noise(&self, numbers: &[f64]) -> Vec<f64> {
        let both = numbers.iter().zip(&self.noise_std_m_s);
        let mut scaled: Vec<f64> = both.map(|(number, std)| number / std).collect();
        if let Some(factor) = &self.noise_factor {
            factor.whiten(&mut scaled);
        }
        scaled
    }

    /// Positions and directions relative to the first gate, in steps of [`SAME_GEOMETRY`].
    pub(super) fn geometry(&self) -> Vec<i64> {
        let mut key = Vec::with_capacity(8 * self.len());
        for (i, gate) in self.gates.iter().enumerate() {
            for d in 0..3 {
                let from_first_m = gate.position_m[d] - self.gates[0].position_m[d];
                key.push((from_first_m / SAME_GEOMETRY).round() as i64);
                key.push((gate.direction[d] / SAME_GEOMETRY).round() as i64);
            }
            key.push((self.heights_m[i] / SAME_GEOMETRY).round() as i64);
            key.push((self.noise_std_m_s[i] / SAME_GEOMETRY).round() as i64);
        }
        for number in self.other_mean.iter().flatten() {
            key.push((number / SAME_GEOMETRY).round() as i64);
        }
        key
    }

    /// Covariance matrices of the velocities for a dissipation of 1 m²/s³ at each outer scale, scaled so that the noise is white and has
    /// unit variance.
    pub(super) fn covariances(&self, covariance: &GateCovariance) -> Vec<Array2<f64>> {
        let mut scaled = Vec::with_capacity(covariance.len());
        for mut matrix in covariance.matrices(&self.gates) {
            for ((i, j), value) in matrix.indexed_iter_mut() {
                *value /= self.noise_std_m_s[i] * self.noise_std_m_s[j];
            }
            scaled.push(match &self.noise_factor {
                Some(factor) => factor.whitened_both_sides(matrix),
                None => matrix,
            });
        }
        scaled
    }
}

/// Eigenvalues of the covariance of the turbulence, and the squared components of the velocities along their eigenvectors.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spectrum {
    eigenvalues: Vec<f64>,
    squares: Vec<f64>,
}

/// Numbers of blocks in groups of one geometry, in the order in which these first come.
pub(super) fn groups_of_geometry(blocks: &[Block]) -> Vec<Vec<usize>> {
    let mut numbers: BTreeMap<Vec<i64>, usize> = BTreeMap::new();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (number, block) in blocks
        .iter()
        .enumerate()
        .filter(|(_, block)| !block.is_empty())
    {
        let next = groups.len();
        let group = *numbers.entry(block.geometry()).or_insert(next);
        if group == next {
            groups.push(Vec::new());
        }
        groups[group].push(number);
    }
    groups
}

/// The spectra of blocks, together, at each outer scale of a covariance.
///
/// # Errors
/// [`Error::Linalg`] for a velocity, a position or a direction that is not finite.
pub fn spectra(blocks: &[Block], covariance: &GateCovariance) -> Result<Vec<Spectrum>, Error> {
    let groups = groups_of_geometry(blocks);
    let parts = map_each(groups.len(), |group| {
        group_spectra(blocks, &groups[group], covariance)
    });
    let mut all = vec![Spectrum::default(); covariance.len()];
    for part in parts {
        for (all, own) in all.iter_mut().zip(part?) {
            all.eigenvalues.extend(own.eigenvalues);
            all.squares.extend(own.squares);
        }
    }
    Ok(all)
}

/// The spectra of blocks of one geometry.
fn group_spectra(
    blocks: &[Block],
    group: &[usize],
    covariance: &GateCovariance,
) -> Result<Vec<Spectrum>, Error> {
    let first = &blocks[group[0]];
    let mut spectra = Vec::with_capacity(covariance.len());
    for matrix in first.covariances(covariance) {
        let vectors = group
            .iter()
            .map(|block| blocks[*block].whitened())
            .collect();
        let (eigenvalues, components) = eigenvalues_with_components(
            "the covariance of the velocities",
            matrix,
            first.mean_columns(),
            RANK,
            vectors,
        )?;
        let mut spectrum = Spectrum::default();
        for components in components {
            for (eigenvalue, component) in eigenvalues.iter().zip(components) {
                spectrum.eigenvalues.push(eigenvalue.max(0.0));
                spectrum.squares.push(component * component);
            }
        }
        spectra.push(spectrum);
    }
    Ok(spectra)
}

/// The most likely dissipation and noise at one outer scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurbulenceFit {
    /// eps^(2/3) \[m^(4/3)/s^2\].
    pub eps23: f64,
    /// Variance of the noise \[m²/s²\], or the factor of the variances that are given.
    pub noise_m2_s2: f64,
    /// Logarithm of the restricted likelihood, without constants.
    pub likelihood: f64,
    /// Inverse of the Fisher information of both for independent blocks.
    pub covariance: [[f64; 2]; 2],
}

impl Spectrum {
    /// Number of contrasts of the velocities, which the mean wind does not change.
    #[must_use]
    pub fn len(&self) -> usize {
        self.squares.len()
    }

    /// Whether there is no contrast.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.squares.is_empty()
    }

    fn likelihood(&self, theta: [f64; 2]) -> f64 {
        let mut sum = 0.0;
        for (eigenvalue, square) in self.eigenvalues.iter().zip(&self.squares) {
            let variance = theta[0] * eigenvalue + theta[1];
            sum -= 0.5 * (variance.ln() + square / variance);
        }
        sum
    }

    /// Gradient of the likelihood and the Fisher information.
    fn slopes(&self, theta: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let mut gradient = [0.0; 2];
        let mut information = [[0.0; 2]; 2];
        for (eigenvalue, square) in self.eigenvalues.iter().zip(&self.squares) {
            let variance = theta[0] * eigenvalue + theta[1];
            let change = [eigenvalue / variance, variance.recip()];
            for i in 0..2 {
                gradient[i] += 0.5 * change[i] * (square / variance - 1.0);
                for j in 0..2 {
                    information[i][j] += 0.5 * change[i] * change[j];
                }
            }
        }
        (gradient, information)
    }

    /// The maximum of the likelihood, by Fisher scoring; none if the contrasts do not tell turbulence from noise.
    #[must_use]
    pub fn maximum(&self) -> Option<TurbulenceFit> {
        let count = self.len() as f64;
        let power = self.squares.iter().sum::<f64>() / count;
        let eigenvalue = self.eigenvalues.iter().sum::<f64>() / count;
        if !(power > 0.0 && eigenvalue > 0.0) {
            return None;
        }
        let mut theta = [(0.5 * power / eigenvalue).min(MOST_EPS23), 0.5 * power];
        let mut likelihood = self.likelihood(theta);
        for _ in 0..ROUNDS {
            let (gradient, information) = self.slopes(theta);
            let inverse = inverse(information)?;
            let mut step = [0.0; 2];
            for i in 0..2 {
                step[i] = inverse[i][0] * gradient[0] + inverse[i][1] * gradient[1];
            }
            let mut factor = 1.0;
            let (next, next_likelihood) = loop {
                let next = stepped(theta, step, factor);
                let next_likelihood = self.likelihood(next);
                if next_likelihood >= likelihood || factor < 1e-6 {
                    break (next, next_likelihood);
                }
                factor *= 0.5;
            };
            let gain = next_likelihood - likelihood;
            theta = next;
            likelihood = next_likelihood;
            if gain.abs() < CONVERGED {
                break;
            }
        }
        let (_, information) = self.slopes(theta);
        Some(TurbulenceFit {
            eps23: theta[0],
            noise_m2_s2: theta[1],
            likelihood,
            covariance: inverse(information)?,
        })
    }
}

/// Unknowns after a fraction of a step, each cut where it would fall too far.
fn stepped(theta: [f64; 2], step: [f64; 2], factor: f64) -> [f64; 2] {
    let mut next = theta;
    for i in 0..2 {
        next[i] += (factor * step[i]).max(-LARGEST_CUT * theta[i]);
    }
    next[0] = next[0].min(MOST_EPS23);
    next
}

/// Inverse of a symmetric positive definite matrix.
pub(super) fn inverse(a: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let is_regular = determinant > 1e-14 * a[0][0] * a[1][1];
    is_regular.then(|| {
        [
            [a[1][1] / determinant, -a[0][1] / determinant],
            [-a[1][0] / determinant, a[0][0] / determinant],
        ]
    })
}
