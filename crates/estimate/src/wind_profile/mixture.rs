//! Wind from radial velocities of which some are bad: uniform over the band, as estimates of noise are (Frehlich and Yadlowsky
//! 1994).
//!
//! ```text
//! l(u, s, p) = sum ln[(1 - p) phi(r_i; s) 2 v_B + p],   r_i = v_i - a_i·u
//! ```
//!
//! phi is the normal density with standard deviation s, v_B half the band, p the fraction of bad velocities. Its logarithm is zero
//! if all are bad. This is the filtered sine wave fit (Smalikho 2003) with its width and fraction found from the data.
//! The maximum is sought by expectation maximisation from least squares, from the solution of a neighbour, and from exact
//! solutions of few velocities. Check: `mixture_fit.csv`; noise; a linear wind without bad velocities.

use ndarray::{Array1, Array2, ArrayView2};

use crate::error::{Error, length, positive};
use crate::linalg::positive_definite::{inverse, solve};

/// Exact solutions of few velocities from which the search starts, and the strides of a sequence of low discrepancy that picks them
/// (Roberts 2018, the R3 sequence).
const STARTS: usize = 300;
const STRIDES: [f64; 3] = [0.819_172_5, 0.671_043_6, 0.549_700_5];
/// Starts whose determinant is below this fraction of the median are skipped.
const LEAST_DETERMINANT: f64 = 0.2;
/// Standard deviations at which starts are compared \[m/s\]; the best of each are improved.
const START_STD_M_S: [f64; 2] = [0.5, 1.5];
const BEST_STARTS: usize = 3;
/// Least standard deviation \[m/s\], and the largest in half bands.
const LEAST_STD_M_S: f64 = 0.15;
const LARGEST_STD: f64 = 1.0 / 6.0;
const LEAST_FRACTION: f64 = 1e-3;
const ROUNDS: usize = 60;
const CONVERGED_M_S: f64 = 1e-6;

/// Log-likelihood over that of bad velocities alone from which on a wind is accepted: noise of 8 to 72 velocities has a larger one
/// once in a thousand times.
pub const LEAST_LIKELIHOOD: f64 = 20.0;

/// Radial velocities and the model of their wind.
#[derive(Debug, Clone, Copy)]
pub struct RadialVelocities<'a> {
    /// \[velocity, component\]: what a component of the wind of 1 m/s adds to each velocity.
    pub rows: ArrayView2<'a, f64>,
    /// Velocities \[m/s\], all finite.
    pub velocity_m_s: &'a [f64],
    /// Half the width of the band of bad velocities that do not repeat \[m/s\]; that of others is half the width after which they do.
    pub half_band_m_s: f64,
    /// Width after which each velocity repeats \[m/s\], infinite for one that does not; empty if none does.
    pub folds_m_s: &'a [f64],
}

/// A wind and the quality of its fit.
#[derive(Debug, Clone, PartialEq)]
pub struct MixtureFit {
    /// The components \[m/s\].
    pub wind_m_s: Vec<f64>,
    /// Standard deviation of good velocities about the wind \[m/s\].
    pub std_m_s: f64,
    /// Fraction of bad velocities.
    pub bad_fraction: f64,
    /// Probability of each velocity to be good.
    pub weights: Vec<f64>,
    /// Log-likelihood over that of bad velocities alone.
    pub likelihood: f64,
}

impl MixtureFit {
    /// Good velocities, as many as their probabilities add up to.
    #[must_use]
    pub fn good(&self) -> f64 {
        self.weights.iter().sum()
    }

    /// Whether the likelihood is beyond that of noise, and there are as many good velocities as components.
    #[must_use]
    pub fn is_accepted(&self) -> bool {
        self.likelihood >= LEAST_LIKELIHOOD && self.good() >= self.wind_m_s.len() as f64
    }

    /// G of u = G v: how the wind depends on each velocity \[component, velocity\], with the final weights; none if they do not determine
    /// the components.
    #[must_use]
    pub fn gain(&self, rows: ArrayView2<'_, f64>) -> Option<Array2<f64>> {
        let mut weighted = rows.to_owned();
        for (mut row, weight) in weighted.rows_mut().into_iter().zip(&self.weights) {
            row *= *weight;
        }
        let normal = inverse("the wind", &weighted.t().dot(&rows)).ok()?;
        Some(normal.dot(&weighted.t()))
    }
}

/// The most likely wind with its standard deviation and its fraction of bad velocities; none if the velocities do not determine the
/// components. `start_m_s` is one more start, as the solution of a neighbouring height.
///
/// # Errors
/// [`Error::Length`] unless there is a row and, if any, a width for each velocity; [`Error::OutOfRange`] for a band or a width that is
/// not above 0.
pub fn fit_mixture(
    data: &RadialVelocities<'_>,
    start_m_s: Option<&[f64]>,
) -> Result<Option<MixtureFit>, Error> {
    let count = data.velocity_m_s.len();
    let components = data.rows.ncols();
    length("velocity_m_s", data.rows.nrows(), count)?;
    positive("half_band_m_s", data.half_band_m_s)?;
    if !data.folds_m_s.is_empty() {
        length("folds_m_s", data.folds_m_s.len(), count)?;
    }
    for fold_m_s in data.folds_m_s {
        if *fold_m_s != f64::INFINITY {
            positive("folds_m_s", *fold_m_s)?;
        }
    }
    if count < components {
        return Ok(None);
    }
    let ones = vec![1.0; count];
    let mut starts = Vec::new();
    starts.extend(data.weighted_step(&ones, data.velocity_m_s));
    if starts.is_empty() {
        return Ok(None);
    }
    if let Some(start_m_s) = start_m_s.filter(|start| start.len() == components) {
        starts.push(start_m_s.to_vec());
    }
    starts.extend(data.exact_solutions());
    let mut best: Option<MixtureFit> = None;
    for std_m_s in START_STD_M_S {
        let mut ranked: Vec<(f64, &Vec<f64>)> = Vec::with_capacity(starts.len());
        for start in &starts {
            ranked.push((data.likelihood(start, std_m_s, 0.5), start));
        }
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, start) in ranked.into_iter().take(BEST_STARTS) {
            let fit = data.maximise(start.clone(), std_m_s);
            if best
                .as_ref()
                .is_none_or(|best| fit.likelihood > best.likelihood)
            {
                best = Some(fit);
            }
        }
    }
    Ok(best)
}

impl RadialVelocities<'_> {
    /// Velocity less that of a wind \[m/s\], the multiple of the fold that is nearest to 0.
    fn residual_m_s(&self, index: usize, wind_m_s: &[f64]) -> f64 {
        let mut residual = self.velocity_m_s[index];
        for (a, wind) in self.rows.row(index).iter().zip(wind_m_s) {
            residual -= a * wind;
        }
        match self.folds_m_s.get(index) {
            Some(fold) if *fold != f64::INFINITY => residual - fold * (residual / fold).round(),
            _ => residual,
        }
    }

    /// Width of the band in which a velocity is if it is bad \[m/s\].
    fn band_m_s(&self, index: usize) -> f64 {
        match self.folds_m_s.get(index) {
            Some(fold_m_s) if fold_m_s.is_finite() => *fold_m_s,
            _ => 2.0 * self.half_band_m_s,
        }
    }

    /// Density of the residual of a velocity over that of bad ones.
    fn density_ratio(&self, index: usize, residual_m_s: f64, std_m_s: f64) -> f64 {
        let deviations = residual_m_s / std_m_s;
        let height = self.band_m_s(index) / (std_m_s * (2.0 * std::f64::consts::PI).sqrt());
        height * (-0.5 * deviations * deviations).exp()
    }

    fn likelihood(&self, wind_m_s: &[f64], std_m_s: f64, bad_fraction: f64) -> f64 {
        let mut sum = 0.0;
        for i in 0..self.velocity_m_s.len() {
            let ratio = self.density_ratio(i, self.residual_m_s(i, wind_m_s), std_m_s);
            sum += ((1.0 - bad_fraction) * ratio + bad_fraction).ln();
        }
        sum
    }

    /// (A^T W A)^-1 A^T W r.
    fn weighted_step(&self, weights: &[f64], residual_m_s: &[f64]) -> Option<Vec<f64>> {
        let components = self.rows.ncols();
        let mut normal = Array2::zeros((components, components));
        let mut right = vec![0.0; components];
        for (row, (weight, residual)) in self
            .rows
            .rows()
            .into_iter()
            .zip(weights.iter().zip(residual_m_s))
        {
            for i in 0..components {
                right[i] += weight * row[i] * residual;
                for j in 0..=i {
                    normal[[i, j]] += weight * row[i] * row[j];
                    normal[[j, i]] = normal[[i, j]];
                }
            }
        }
        solve(&normal, &right)
    }

    /// Winds that as many velocities as there are components have exactly; of more than three components the others are 0.
    fn exact_solutions(&self) -> Vec<Vec<f64>> {
        let components = self.rows.ncols();
        let solved = components.min(STRIDES.len());
        let count = self.velocity_m_s.len() as f64;
        let mut found: Vec<(f64, Vec<f64>)> = Vec::with_capacity(STARTS);
        for m in 1..=STARTS {
            let mut a = Array2::zeros((solved, solved));
            let mut b = Array1::zeros(solved);
            for (k, stride) in STRIDES.iter().take(solved).enumerate() {
                let index = (count * (0.5 + m as f64 * stride).fract()) as usize;
                for j in 0..solved {
                    a[[k, j]] = self.rows[[index, j]];
                }
                b[k] = self.velocity_m_s[index];
            }
            if let Some((determinant, mut wind_m_s)) = eliminate(a, b) {
                wind_m_s.resize(components, 0.0);
                found.push((determinant.abs(), wind_m_s));
            }
        }
        let mut determinants: Vec<f64> = found.iter().map(|one| one.0).collect();
        determinants.sort_by(f64::total_cmp);
        let median = determinants
            .get(determinants.len() / 2)
            .copied()
            .unwrap_or(0.0);
        found.retain(|one| one.0 >= LEAST_DETERMINANT * median);
        found.into_iter().map(|one| one.1).collect()
    }

    /// The maximum of the likelihood that expectation maximisation reaches from a wind.
    fn maximise(&self, mut wind_m_s: Vec<f64>, mut std_m_s: f64) -> MixtureFit {
        let count = self.velocity_m_s.len();
        let components = wind_m_s.len() as f64;
        let mut bad_fraction = 0.5;
        for _ in 0..ROUNDS {
            let (weights, residuals) = self.expectation(&wind_m_s, std_m_s, bad_fraction);
            let good: f64 = weights.iter().sum();
            let Some(step) = self.weighted_step(&weights, &residuals) else {
                break;
            };
            let mut longest: f64 = 0.0;
            for (wind, step) in wind_m_s.iter_mut().zip(&step) {
                *wind += step;
                longest = longest.max(step.abs());
            }
            let mut squares = 0.0;
            for (i, weight) in weights.iter().enumerate() {
                squares += weight * self.residual_m_s(i, &wind_m_s).powi(2);
            }
            let variance = squares / (good - components).max(1.0);
            std_m_s = variance.sqrt().clamp(LEAST_STD_M_S, self.largest_std_m_s());
            bad_fraction = (1.0 - (good + 1.0) / (count as f64 + 2.0))
                .clamp(LEAST_FRACTION, 1.0 - LEAST_FRACTION);
            if longest < CONVERGED_M_S {
                break;
            }
        }
        let (weights, _) = self.expectation(&wind_m_s, std_m_s, bad_fraction);
        MixtureFit {
            likelihood: self.likelihood(&wind_m_s, std_m_s, bad_fraction),
            wind_m_s,
            std_m_s,
            bad_fraction,
            weights,
        }
    }

    fn largest_std_m_s(&self) -> f64 {
        let bands_m_s = (0..self.velocity_m_s.len()).map(|index| self.band_m_s(index));
        let narrowest_m_s = bands_m_s.fold(2.0 * self.half_band_m_s, f64::min);
        (LARGEST_STD * 0.5 * narrowest_m_s).max(LEAST_STD_M_S)
    }

    /// Probability of each velocity to be good, and its residual \[m/s\].
    fn expectation(
        &self,
        wind_m_s: &[f64],
        std_m_s: f64,
        bad_fraction: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let mut weights = Vec::with_capacity(self.velocity_m_s.len());
        let mut residuals = Vec::with_capacity(self.velocity_m_s.len());
        for i in 0..self.velocity_m_s.len() {
            let residual = self.residual_m_s(i, wind_m_s);
            let good = (1.0 - bad_fraction) * self.density_ratio(i, residual, std_m_s);
            weights.push(good / (good + bad_fraction));
            residuals.push(residual);
        }
        (weights, residuals)
    }
}

/// Determinant of `a` and x of a x = b, by elimination with pivots; none of a singular matrix.
fn eliminate(mut a: Array2<f64>, mut b: Array1<f64>) -> Option<(f64, Vec<f64>)> {
    let order = b.len();
    let mut determinant = 1.0;
    for k in 0..order {
        let below = k..order;
        let pivot = below.max_by(|i, j| a[[*i, k]].abs().total_cmp(&a[[*j, k]].abs()))?;
        if pivot != k {
            for j in 0..order {
                a.swap([k, j], [pivot, j]);
            }
            b.swap(k, pivot);
            determinant = -determinant;
        }
        determinant *= a[[k, k]];
        if a[[k, k]].abs() < 1e-12 {
            return None;
        }
        for i in k + 1..order {
            let factor = a[[i, k]] / a[[k, k]];
            for j in k..order {
                a[[i, j]] -= factor * a[[k, j]];
            }
            b[i] -= factor * b[k];
        }
    }
    let mut x = vec![0.0; order];
    for i in (0..order).rev() {
        let mut sum = b[i];
        for j in i + 1..order {
            sum -= a[[i, j]] * x[j];
        }
        x[i] = sum / a[[i, i]];
    }
    Some((determinant, x))
}
