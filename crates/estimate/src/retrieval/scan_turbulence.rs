//! Turbulence of a scan, found in the scan itself: dissipation rate, outer scale and noise from what a fit leaves.
//!
//! ```text
//! K = sum_L p(L) (t1 B(L) + t2 diag(sigma^2)),   t1 = eps^(2/3)
//! ```
//!
//! Contrasts of the velocities that are orthogonal to the derivatives of the fit by its parameters hold nothing of the wake, to first order, so
//! that no velocity has to be skipped. Their restricted likelihood gives t1, t2 and the probability p of each outer scale. Blocks of a few
//! hundred velocities of consecutive lines count as independent.
//! Check: `circulations_in_turbulence` in the tests of the program.

use ndarray::{Array2, s};

use crate::Measured;
use crate::error::Error;
use crate::parallel::map_each;
use crate::retrieval::{ScanMap, Whitening};
use crate::turbulence::VonKarman;
use crate::vortex_fit::map_fit::cells::Cell;
use crate::vortex_fit::map_fit::cells::Rows;
use crate::vortex_fit::{Wake, WakeModel};
use crate::wind_profile::{
    Block, GateCovariance, GatePosition, OUTER_SCALES_M, outer_scale_probabilities, spectra,
};

/// Most velocities of a block: the time of its eigenvalues grows with the cube.
const LARGEST_BLOCK: usize = 512;
/// Fewest degrees of freedom that the variance of a contrast has.
const FEWEST_DEGREES: f64 = 5.0;
/// As many are as good as a known variance.
const MOST_DEGREES: f64 = 1e6;
/// Fewest contrasts that tell turbulence from noise.
const FEWEST_CONTRASTS: usize = 30;

/// Standard deviations that turbulence has to exceed, as in `wakescope wind`.
const STANDS_OUT: f64 = 2.0;

/// Isotropic turbulence with the spectrum of von Karman, as a scan shows it beside its wake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanTurbulence {
    /// eps^(2/3) \[m^(4/3)/s^2\], averaged over the outer scales; its standard deviation contains what is not known of them.
    pub eps23: Measured,
    /// Standard deviation of the noise \[m/s\], root mean square over the velocities.
    pub noise_std_m_s: f64,
    /// Probability of each of [`OUTER_SCALES_M`].
    pub outer_scale_probability: [f64; OUTER_SCALES_M.len()],
    /// eps^(2/3) at each outer scale times its probability.
    pub(crate) eps23_weights: [f64; OUTER_SCALES_M.len()],
    /// Covariance of eps^(2/3) and of the factor of the noise were the outer scale known.
    pub(crate) known_scale_covariance: [[f64; 2]; 2],
    /// Variance of the noise over that of the given standard deviations.
    pub(crate) noise_factor: f64,
    /// Whether it was found beside a wake, not beside the wind alone.
    pub is_beside_wake: bool,
}

impl ScanTurbulence {
    /// Cube root of the dissipation rate \[m^(2/3)/s\]: its value, and the ends of its interval of 95 %.
    #[must_use]
    pub fn edr_m23_s(&self) -> [f64; 3] {
        let Measured { value, std } = self.eps23;
        [value, value - 1.96 * std, value + 1.96 * std].map(|eps23| eps23.max(0.0).sqrt())
    }

    /// Whether it exceeds two of its standard deviations.
    pub(crate) fn stands_out(&self) -> bool {
        self.eps23.value > STANDS_OUT * self.eps23.std
    }

    /// Outer scale \[m\]: mean of the logarithm over the probabilities.
    #[must_use]
    pub fn outer_scale_m(&self) -> f64 {
        let all = OUTER_SCALES_M.iter().zip(self.outer_scale_probability);
        let logarithm: f64 = all.map(|(scale_m, p)| p * scale_m.ln()).sum();
        logarithm.exp()
    }

    /// Degrees of freedom of the variance of a contrast, of which `part` is of this turbulence and the rest noise: 2 over its relative variance. What
    /// is not known of the outer scale moves eps^(2/3) the other way and leaves the variance of patterns of the size of a wake, so that it does not
    /// count.
    pub(crate) fn degrees_of_freedom(&self, part: f64) -> f64 {
        let of_turbulence = part / self.eps23.value.max(f64::MIN_POSITIVE);
        let of_noise = (1.0 - part) / self.noise_factor.max(f64::MIN_POSITIVE);
        let [[turbulence, both], [_, noise]] = self.known_scale_covariance;
        let of_both = 2.0 * of_turbulence * of_noise * both;
        let relative = of_turbulence.powi(2) * turbulence + of_both + of_noise.powi(2) * noise;
        (2.0 / relative.max(0.0)).clamp(FEWEST_DEGREES, MOST_DEGREES)
    }

    /// Variance of a component of the velocity at a point \[m²/s²\].
    #[must_use]
    pub fn variance_m2_s2(&self) -> f64 {
        let mut variance_m2_s2 = 0.0;
        for (outer_scale_m, weight) in OUTER_SCALES_M.into_iter().zip(self.eps23_weights) {
            let unit = VonKarman {
                dissipation_m2_s3: 1.0,
                outer_scale_m,
                kolmogorov_constant: 1.5,
            };
            variance_m2_s2 += weight * unit.variance_m2_s2();
        }
        variance_m2_s2
    }

    /// Covariance \[m²/s²\] of the velocities of the air in two gates.
    pub(crate) fn covariance_of_air_m2_s2(
        &self,
        table: &GateCovariance,
        [a, b]: [&GatePosition; 2],
    ) -> f64 {
        let mut of_scales = [0.0; OUTER_SCALES_M.len()];
        table.covariance_into(a, b, &mut of_scales);
        let mut sum_m2_s2 = 0.0;
        for (value, weight) in of_scales.iter().zip(self.eps23_weights) {
            sum_m2_s2 += weight * value;
        }
        sum_m2_s2
    }

    /// Covariance \[m²/s²\] of the velocities of gates, the lower triangle filled, from the standard deviations of their noise \[m/s\] as they
    /// were given. The table is that of [`gate_covariance`] for these gates.
    pub(crate) fn covariance_m2_s2(
        &self,
        table: &GateCovariance,
        gates: &[GatePosition],
        noise_std_m_s: &[f64],
    ) -> Array2<f64> {
        let rows = map_each(gates.len(), |i| {
            let mut row = Vec::with_capacity(i + 1);
            for other in &gates[..=i] {
                row.push(self.covariance_of_air_m2_s2(table, [&gates[i], other]));
            }
            row
        });
        let mut covariance = Array2::zeros((gates.len(), gates.len()));
        for (i, row) in rows.into_iter().enumerate() {
            for (j, value) in row.into_iter().enumerate() {
                covariance[[i, j]] = value;
            }
            covariance[[i, i]] += self.noise_factor * noise_std_m_s[i].powi(2);
        }
        covariance
    }
}

/// What a fit leaves of the velocities of a scan, line by line.
pub(crate) struct Remainder {
    pub(crate) gates: Vec<GatePosition>,
    residual_m_s: Vec<f64>,
    /// Standard deviations of the noise \[m/s\], up to a common factor.
    noise_std_m_s: Vec<f64>,
    /// Correlation of the noise, the lower triangle; none of independent noise.
    noise_correlation: Option<Array2<f64>>,
    /// Derivatives of the fit by its parameters.
    slopes: Vec<Vec<f64>>,
}

impl Remainder {
    /// From residuals and slopes over the standard deviations of the noise \[m/s\].
    pub(crate) fn new(gates: Vec<GatePosition>, rows: Rows, noise_std_m_s: Vec<f64>) -> Self {
        let mut remainder = Self {
            gates,
            residual_m_s: rows.residuals,
            slopes: rows.slopes,
            noise_std_m_s,
            noise_correlation: None,
        };
        let Self {
            residual_m_s,
            slopes,
            noise_std_m_s,
            ..
        } = &mut remainder;
        for column in slopes.iter_mut().chain([residual_m_s]) {
            for (number, std_m_s) in column.iter_mut().zip(&*noise_std_m_s) {
                *number *= std_m_s;
            }
        }
        remainder
    }

    /// The same with the correlation of the noise, of which the lower triangle is read.
    pub(crate) fn with_correlated_noise(self, correlation: Array2<f64>) -> Self {
        Self {
            noise_correlation: Some(correlation),
            ..self
        }
    }

    /// What makes the velocities white in turbulence, with independent noise; nothing if their covariance is singular.
    pub(crate) fn whitening(
        &self,
        turbulence: &ScanTurbulence,
        table: &GateCovariance,
    ) -> Option<Whitening> {
        Whitening::new(turbulence.covariance_m2_s2(table, &self.gates, &self.noise_std_m_s))
    }

    /// The turbulence; none where the velocities are too few to tell it from noise.
    ///
    /// # Errors
    /// [`Error::Linalg`] for numbers that are not finite.
    pub(crate) fn turbulence(
        &self,
        table: &GateCovariance,
    ) -> Result<Option<ScanTurbulence>, Error> {
        let spectra = spectra(&self.blocks()?, table)?;
        if spectra[0].len() < FEWEST_CONTRASTS {
            return Ok(None);
        }
        let mut fits = Vec::with_capacity(spectra.len());
        for spectrum in &spectra {
            let Some(fit) = spectrum.maximum() else {
                return Ok(None);
            };
            fits.push(fit);
        }
        let likelihoods = fits.iter().map(|fit| fit.likelihood).collect();
        let probabilities = outer_scale_probabilities(&OUTER_SCALES_M, &[likelihoods]);
        let mut found = ScanTurbulence {
            eps23: Measured::default(),
            noise_std_m_s: 0.0,
            outer_scale_probability: [0.0; OUTER_SCALES_M.len()],
            eps23_weights: [0.0; OUTER_SCALES_M.len()],
            known_scale_covariance: [[0.0; 2]; 2],
            noise_factor: 0.0,
            is_beside_wake: true,
        };
        let mut square = 0.0;
        for (i, (fit, probability)) in fits.iter().zip(probabilities).enumerate() {
            found.outer_scale_probability[i] = probability;
            found.eps23_weights[i] = probability * fit.eps23;
            found.eps23.value += probability * fit.eps23;
            found.noise_factor += probability * fit.noise_m2_s2;
            square += probability * (fit.eps23 * fit.eps23 + fit.covariance[0][0]);
            let sums = found.known_scale_covariance.iter_mut().flatten();
            for (sum, own) in sums.zip(fit.covariance.iter().flatten()) {
                *sum += probability * own;
            }
        }
        found.eps23.std = (square - found.eps23.value.powi(2)).max(0.0).sqrt();
        let squares: f64 = self.noise_std_m_s.iter().map(|std| std * std).sum();
        let mean_square = squares / self.noise_std_m_s.len() as f64;
        found.noise_std_m_s = (found.noise_factor * mean_square).sqrt();
        Ok(Some(found))
    }

    /// Blocks of nearly equal length.
    fn blocks(&self) -> Result<Vec<Block>, Error> {
        let count = self.gates.len();
        let pieces = count.div_ceil(LARGEST_BLOCK).max(1);
        let length = count.div_ceil(pieces).max(1);
        let mut blocks = Vec::with_capacity(pieces);
        for first in (0..count).step_by(length) {
            let range = first..(first + length).min(count);
            let mut columns = Vec::with_capacity(self.slopes.len());
            for slope in &self.slopes {
                columns.push(slope[range.clone()].to_vec());
            }
            let block = Block::of_residuals(
                self.gates[range.clone()].to_vec(),
                self.residual_m_s[range.clone()].to_vec(),
                self.noise_std_m_s[range.clone()].to_vec(),
                &columns,
            )?;
            blocks.push(match &self.noise_correlation {
                Some(all) => {
                    let own = all.slice(s![range.clone(), range]);
                    block.with_correlated_noise(own.to_owned())?
                }
                None => block,
            });
        }
        Ok(blocks)
    }
}

/// Covariance of the velocities of gates with a Gaussian weight of that standard deviation \[m\] at all of [`OUTER_SCALES_M`].
///
/// # Errors
/// [`Error::OutOfRange`] for a negative width of the gates.
pub(crate) fn gate_covariance(
    gates: &[GatePosition],
    gate_std_m: f64,
) -> Result<GateCovariance, Error> {
    GateCovariance::new(gate_std_m, &OUTER_SCALES_M, farthest_m(gates))
}

/// Where the gates of cells of a scan are in air that the wind of a wake carries along, in the plane of the scan.
pub(super) fn gate_positions(
    map: &ScanMap,
    cells: &[Cell],
    model: &WakeModel,
    wake: &Wake,
) -> Vec<GatePosition> {
    let carried_m_s = [mean_wind_m_s(map, cells, model, wake), 0.0, 0.0];
    let mut gates = Vec::with_capacity(cells.len());
    for cell in cells {
        let (sine, cosine) = map.elevation_rad[cell.line].sin_cos();
        let time_s = match map.has_times() {
            true => map.time_s[cell.line],
            false => 0.0,
        };
        let range_m = map.range_m[cell.gate];
        let direction = [cosine, 0.0, sine];
        gates.push(GatePosition::new(direction, range_m, time_s, carried_m_s));
    }
    gates
}

/// Lateral wind of a wake at the mean height of cells of a scan \[m/s\].
fn mean_wind_m_s(map: &ScanMap, cells: &[Cell], model: &WakeModel, wake: &Wake) -> f64 {
    let mut height_m = 0.0;
    for cell in cells {
        let range_m = map.range_m[cell.gate];
        let elevation_rad = map.elevation_rad[cell.line];
        height_m += model.position_m(range_m, elevation_rad).1;
    }
    wake.wind_at_m_s(height_m / cells.len().max(1) as f64)
}

/// A distance that no two gates exceed \[m\], at least 1 m.
fn farthest_m(gates: &[GatePosition]) -> f64 {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for gate in gates {
        for d in 0..3 {
            low[d] = low[d].min(gate.position_m[d]);
            high[d] = high[d].max(gate.position_m[d]);
        }
    }
    let squares = (0..3).map(|d| (high[d] - low[d]).powi(2));
    squares.sum::<f64>().sqrt().max(1.0)
}
