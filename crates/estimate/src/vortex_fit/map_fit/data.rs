//! A map of radial velocities, how it is fitted, and what comes out.
//!
//! Check: exact maps, impossible maps; the two losses agree on clean maps.

use ndarray::{Array2, ArrayView2};

use crate::error::{Error, finite, increasing, length, positive};
use crate::vortex_fit::{CorePrior, FreeParameters, PairPrior, Parameter, Top, Wake};

/// Standard deviation of the median of many normal numbers over that of their mean.
const MEDIAN_OVER_MEAN: f64 = 1.253_314_137_315_500_3;

/// A map of radial velocities, such as accumulation gives.
#[derive(Debug, Clone, Copy)]
pub struct VelocityMap<'a> {
    /// Elevation of the lines \[rad\], increasing.
    pub elevation_rad: &'a [f64],
    /// Ranges of the gates \[m\], increasing.
    pub range_m: &'a [f64],
    /// Radial velocities \[m/s\] \[line, gate\], positive away from the lidar; NaN where there is none.
    pub velocity_m_s: ArrayView2<'a, f64>,
    /// Their standard deviations \[m/s\], up to a common factor; equal ones if absent.
    pub standard_deviation_m_s: Option<ArrayView2<'a, f64>>,
}

impl VelocityMap<'_> {
    /// Checks shapes and axes, and counts the velocities.
    pub(crate) fn validate(&self) -> Result<usize, Error> {
        let lines = self.elevation_rad.len();
        let gates = self.range_m.len();
        length("lines of velocity_m_s", lines, self.velocity_m_s.nrows())?;
        length("gates of velocity_m_s", gates, self.velocity_m_s.ncols())?;
        validate_axes(self.elevation_rad, self.range_m)?;
        if let Some(deviation) = &self.standard_deviation_m_s {
            length("lines of standard_deviation_m_s", lines, deviation.nrows())?;
            length("gates of standard_deviation_m_s", gates, deviation.ncols())?;
            for (value, velocity) in deviation.iter().zip(&self.velocity_m_s) {
                if velocity.is_finite() {
                    positive("standard_deviation_m_s", *value)?;
                }
            }
        }
        Ok(self.velocity_m_s.iter().filter(|v| v.is_finite()).count())
    }

    /// Distance of neighbouring lines in the middle of the map.
    pub(crate) fn line_spacing_m(&self) -> f64 {
        let (near_m, far_m) = ends(self.range_m);
        let (low_rad, high_rad) = ends(self.elevation_rad);
        (near_m + 0.5 * (far_m - near_m)) * (high_rad - low_rad) / self.elevation_rad.len() as f64
    }

    /// Mean distance of neighbouring gates.
    pub(crate) fn gate_spacing_m(&self) -> f64 {
        self.range_m
            .first()
            .zip(self.range_m.last())
            .map_or(0.0, |(a, b)| (b - a) / self.range_m.len() as f64)
    }

    /// Lines and gates of blocks, about as wide as long, of which the map has no more than `most`.
    pub(crate) fn blocks(&self, most: usize) -> (usize, usize) {
        let lines = self.elevation_rad.len();
        let gates = self.range_m.len();
        let line_m = self.line_spacing_m();
        let gate_m = self.gate_spacing_m();
        let mut by_line = 1;
        let mut by_gate = 1;
        while lines.div_ceil(by_line) * gates.div_ceil(by_gate) > most {
            if by_line as f64 * line_m <= by_gate as f64 * gate_m && by_line < lines
                || by_gate >= gates
            {
                by_line += 1;
            } else {
                by_gate += 1;
            }
        }
        (by_line, by_gate)
    }

    /// Medians over blocks of lines and gates, which outliers do not move; NaN where a block has no velocity.
    pub(crate) fn block_medians(&self, (by_line, by_gate): (usize, usize)) -> BlockMedians {
        let elevation_rad = block_means(self.elevation_rad, by_line);
        let range_m = block_means(self.range_m, by_gate);
        let mut velocity_m_s = Array2::from_elem((elevation_rad.len(), range_m.len()), f64::NAN);
        let mut sigma_m_s = Array2::ones(velocity_m_s.raw_dim());
        for ((block, velocity), sigma) in velocity_m_s.indexed_iter_mut().zip(&mut sigma_m_s) {
            let known = self.known_in(block, (by_line, by_gate));
            if known.is_empty() {
                continue;
            }
            let count = known.len() as f64;
            let mut values: Vec<f64> = known.iter().map(|cell| self.velocity_m_s[*cell]).collect();
            values.sort_by(f64::total_cmp);
            *velocity = 0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2]);
            let deviations = known
                .iter()
                .map(|[line, gate]| self.deviation(*line, *gate));
            let deviation = deviations.sum::<f64>() / count;
            let wider = if values.len() > 2 {
                MEDIAN_OVER_MEAN
            } else {
                1.0
            };
            *sigma = deviation * wider / count.sqrt();
        }
        BlockMedians {
            elevation_rad,
            range_m,
            velocity_m_s,
            sigma_m_s,
        }
    }

    /// Places of the known velocities in a block of lines and gates.
    fn known_in(
        &self,
        (line, gate): (usize, usize),
        (by_line, by_gate): (usize, usize),
    ) -> Vec<[usize; 2]> {
        let lines = (line * by_line..self.elevation_rad.len()).take(by_line);
        let gates = (gate * by_gate..self.range_m.len()).take(by_gate);
        let places = lines.flat_map(|line| gates.clone().map(move |gate| [line, gate]));
        places
            .filter(|place| self.velocity_m_s[*place].is_finite())
            .collect()
    }

    /// Standard deviation of one velocity, 1 if none was given.
    pub(crate) fn deviation(&self, line: usize, gate: usize) -> f64 {
        self.standard_deviation_m_s
            .as_ref()
            .map_or(1.0, |d| d[[line, gate]])
    }
}

/// Index of the number of an axis that is nearest to `value`, the first of several; nothing for an empty axis.
pub(crate) fn nearest_index(axis: &[f64], value: f64) -> Option<usize> {
    (0..axis.len()).min_by(|a, b| {
        (axis[*a] - value)
            .abs()
            .total_cmp(&(axis[*b] - value).abs())
    })
}

/// A velocity map that owns its data: medians over blocks of another one.
pub(crate) struct BlockMedians {
    pub(crate) elevation_rad: Vec<f64>,
    pub(crate) range_m: Vec<f64>,
    pub(crate) velocity_m_s: Array2<f64>,
    /// Standard deviations of the medians if those of the velocities are 1 where none are given.
    pub(crate) sigma_m_s: Array2<f64>,
}

impl BlockMedians {
    pub(crate) fn view(&self) -> VelocityMap<'_> {
        VelocityMap {
            elevation_rad: &self.elevation_rad,
            range_m: &self.range_m,
            velocity_m_s: self.velocity_m_s.view(),
            standard_deviation_m_s: Some(self.sigma_m_s.view()),
        }
    }
}

/// The first and the last number of an axis; zeros if it has none.
pub(crate) fn ends(axis: &[f64]) -> (f64, f64) {
    (
        axis.first().copied().unwrap_or(0.0),
        axis.last().copied().unwrap_or(0.0),
    )
}

/// Means of an axis over blocks of this length.
pub(crate) fn block_means(axis: &[f64], by: usize) -> Vec<f64> {
    axis.chunks(by)
        .map(|block| block.iter().sum::<f64>() / block.len() as f64)
        .collect()
}

/// Both axes are finite and increase.
pub(crate) fn validate_axes(elevation_rad: &[f64], range_m: &[f64]) -> Result<(), Error> {
    for (field, axis) in [("elevation_rad", elevation_rad), ("range_m", range_m)] {
        axis.iter().try_for_each(|value| finite(field, *value))?;
        increasing(field, axis)?;
    }
    Ok(())
}

/// What a residual costs, in units of the scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// r^2/2: least squares.
    Squares,
    /// (c^2/2) ln(1 + (r/c)^2): large residuals hardly count (Cauchy).
    Cauchy {
        /// c, in units of the scale; 2.385 costs 5 % of the efficiency on normal residuals.
        width: f64,
    },
}

impl Loss {
    /// Cost, its slope over the residual (the weight), and its second derivative.
    pub(crate) fn at(self, residual: f64) -> (f64, f64, f64) {
        match self {
            Self::Squares => (0.5 * residual * residual, 1.0, 1.0),
            Self::Cauchy { width } => {
                let square = (residual / width).powi(2);
                let weight = 1.0 / (1.0 + square);
                (
                    0.5 * width * width * square.ln_1p(),
                    weight,
                    (1.0 - square) * weight * weight,
                )
            }
        }
    }
}

/// Whether secondary vortices, which the boundary layer at the ground rolls up into, are fitted beside a pair. A map shows them if they explain its
/// residuals far better than chance, and stand where such vortices do.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Secondary {
    /// Where the map shows them.
    #[default]
    Auto,
    /// Never.
    Never,
    /// The best ones, whether the map shows them or not.
    Always,
}

/// How a map is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapFitOptions {
    /// What may change.
    pub free: FreeParameters,
    /// Core radius \[m\] that fixed cores keep; a typical part of the spacing if absent.
    pub core_radius_m: Option<f64>,
    /// What is known of the core radii that may change.
    pub core_prior: Option<CorePrior>,
    /// Prior of the spacing and the circulations of a pair.
    pub pair_prior: Option<PairPrior>,
    /// What residuals cost.
    pub loss: Loss,
    /// Whether secondary vortices are fitted.
    pub secondary: Secondary,
    /// Least [`MapFit::statistic`] of a pair that a search finds.
    pub least_statistic: f64,
    /// Neighbouring lines that share windows: 2 rho over their distance for an accumulated map, 0 for independent lines.
    pub correlated_lines: usize,
    /// Velocities repeat after this width \[m/s\]; they are given about those of a likely wake.
    pub fold_m_s: Option<f64>,
}

impl Default for MapFitOptions {
    /// All parameters free, priors of typical core radii and of pairs behind aircraft, the loss of
    /// Cauchy, 8 correlated lines; a statistic above those of empty scans (the ignored test
    /// `narrow_sectors_of_many_kinds` of the program).
    fn default() -> Self {
        Self {
            free: FreeParameters::default(),
            core_radius_m: None,
            core_prior: Some(CorePrior::TYPICAL),
            pair_prior: Some(PairPrior::AIRCRAFT),
            loss: Loss::Cauchy { width: 2.385 },
            secondary: Secondary::Auto,
            least_statistic: 35.0,
            correlated_lines: 8,
            fold_m_s: None,
        }
    }
}

/// Outcome of a fit to a map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapFit {
    /// The fitted wake.
    pub wake: Wake,
    /// Covariance \[10, 10\] of the parameters in the order of [`Parameter`]; zeros where one is fixed: the sandwich with the
    /// correlation of the residuals, and the distances of other tops, weighted with their likelihood. It tells of scatter, not of
    /// what an estimator of velocity adds to all maps alike.
    pub covariance: Array2<f64>,
    /// Whether core radii were fitted to the end. A core that the map does not resolve keeps the value of the round before, with
    /// zeros in the covariance.
    pub cores_fitted: bool,
    /// Velocities that were used.
    pub used: usize,
    /// Those with a residual above 3 scales.
    pub outliers: usize,
    /// Scale of the residuals over the given standard deviations, from their median; \[m/s\] if none were given. In
    /// uniform wind, for the map of an estimator.
    pub residual_scale: f64,
    /// Chi-square that the vortices take from the best wind without them, over the velocities that count as one.
    pub statistic: f64,
    /// Part of the robust cost of the best wind without vortices that the vortices take away: near 1 for a good fit.
    pub explained_fraction: f64,
    /// All ends of the fit from its starts that are not the same, the best (the fitted wake) first.
    pub tops: Vec<Top>,
}

impl MapFit {
    /// The fit, if its vortices stand out of the wind by that least statistic.
    pub(crate) fn standing_out(self, needed: f64) -> Result<Self, Error> {
        // also of NaN
        if self.statistic >= needed {
            return Ok(self);
        }
        Err(Error::NoVortex {
            statistic: self.statistic,
            needed,
        })
    }

    /// Standard deviation of a parameter, in its unit; 0 if it was fixed.
    #[must_use]
    pub fn standard_deviation(&self, parameter: Parameter) -> f64 {
        self.covariance[[parameter as usize; 2]].sqrt()
    }
}

/// Median of the absolute value of a normal number.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;

/// Standard deviation of normal residuals, from the median of their sizes; NaN if there are none.
pub(crate) fn robust_scale(residuals: impl Iterator<Item = f64>) -> f64 {
    median(&mut residuals.map(f64::abs).collect::<Vec<f64>>()) / NORMAL_MEDIAN
}

/// Median of the numbers, which are reordered; NaN if there are none.
pub(crate) fn median(numbers: &mut [f64]) -> f64 {
    if numbers.is_empty() {
        return f64::NAN;
    }
    let middle = numbers.len() / 2;
    *numbers.select_nth_unstable_by(middle, f64::total_cmp).1
}
