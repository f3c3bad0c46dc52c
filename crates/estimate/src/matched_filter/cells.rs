//! The velocities that a test for a wake uses: those that are there, large maps thinned to means of blocks; what they hold besides the
//! wind, noise, and turbulence if there is any; and how both are made white.
//!
//! ```text
//! C = sigma_c^2 exp(-d/L) + diag(sigma^2),   C = A A^T (Cholesky),   white = A^-1 x
//! ```
//!
//! with d the distance of two cells. Check: a mean has the deviation of its block; holes are left out; drawn scans become white; C is
//! symmetric and has the right diagonal.

use ndarray::{Array2, ArrayView2, Axis};

use crate::error::{Error, length, not_negative, positive};
use crate::linalg::cholesky::forward;
use crate::retrieval::{ScanTurbulence, Turbulence, Whitening, gate_covariance};
use crate::vortex_fit::map_fit::data::block_means;
use crate::vortex_fit::{VelocityMap, WakeModel};
use crate::wind_profile::GatePosition;

/// Most cells that are kept: more tell little that is new about a wake of some ten metres, and whitening takes the cube.
const MOST_CELLS: usize = 3000;

/// Means over blocks of a map.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    /// Axes of the thinned map.
    pub(crate) elevation_rad: Vec<f64>,
    pub(crate) range_m: Vec<f64>,
    /// Place (line, gate) on the thinned map, lateral coordinate and height \[m\] and standard deviation \[m/s\] of each cell.
    pub(crate) cells: Vec<Cell>,
    /// Cell of each velocity of the whole map and its weight in the mean; none where nothing was known.
    share: Array2<Option<(usize, f64)>>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell {
    pub(crate) line: usize,
    pub(crate) gate: usize,
    pub(crate) place_m: (f64, f64),
    pub(crate) deviation_m_s: f64,
}

impl Cells {
    pub(crate) fn new(map: &VelocityMap<'_>, model: &WakeModel) -> Self {
        let lines = map.elevation_rad.len();
        let gates = map.range_m.len();
        let (by_line, by_gate) = map.blocks(MOST_CELLS);
        let elevation_rad = block_means(map.elevation_rad, by_line);
        let range_m = block_means(map.range_m, by_gate);

        let mut sums = Array2::<f64>::zeros((elevation_rad.len(), range_m.len()));
        for (line, gate) in (0..lines).flat_map(|line| (0..gates).map(move |gate| (line, gate))) {
            sums[[line / by_line, gate / by_gate]] += weight(map, line, gate).unwrap_or(0.0);
        }
        let mut cells = Vec::new();
        let mut index = Array2::from_elem(sums.raw_dim(), 0);
        for ((line, gate), &sum) in sums.indexed_iter().filter(|(_, sum)| **sum > 0.0) {
            index[[line, gate]] = cells.len();
            let place_m = model.position_m(range_m[gate], elevation_rad[line]);
            cells.push(Cell {
                line,
                gate,
                place_m,
                deviation_m_s: sum.sqrt().recip(),
            });
        }
        let share = Array2::from_shape_fn((lines, gates), |(line, gate)| {
            let block = [line / by_line, gate / by_gate];
            weight(map, line, gate).map(|weight| (index[block], weight / sums[block]))
        });
        Self {
            elevation_rad,
            range_m,
            cells,
            share,
        }
    }

    /// Whether a place is in the sector of the map.
    pub(crate) fn hold(&self, model: &WakeModel, place_m: (f64, f64)) -> bool {
        model.sees((&self.elevation_rad, &self.range_m), place_m)
    }

    /// The means of a map of the same shape; NaN where no velocity of a block is left.
    ///
    /// # Errors
    /// [`Error::Length`] for another shape.
    pub(crate) fn means(&self, velocity_m_s: ArrayView2<'_, f64>) -> Result<Vec<f64>, Error> {
        length(
            "lines of velocity_m_s",
            self.share.nrows(),
            velocity_m_s.nrows(),
        )?;
        length(
            "gates of velocity_m_s",
            self.share.ncols(),
            velocity_m_s.ncols(),
        )?;
        let mut sums = vec![(0.0, 0.0); self.cells.len()];
        for (share, &value) in self.share.iter().zip(&velocity_m_s) {
            if let Some((cell, weight)) = share.filter(|_| value.is_finite()) {
                sums[cell].0 += weight * value;
                sums[cell].1 += weight;
            }
        }
        Ok(sums.into_iter().map(|(sum, weight)| sum / weight).collect())
    }
}

/// Reciprocal variance of a velocity; nothing where there is none.
fn weight(map: &VelocityMap<'_>, line: usize, gate: usize) -> Option<f64> {
    let is_known = map.velocity_m_s[[line, gate]].is_finite();
    is_known.then(|| map.deviation(line, gate).powi(-2))
}

/// Makes the background of a map white, of unit variance.
#[derive(Debug, Clone)]
pub(crate) enum Background {
    /// Independent noise of those standard deviations.
    Noise(Vec<f64>),
    /// With turbulence; with the variance of the noise of each cell \[m²/s²\] and the turbulence where this was found in a scan.
    Turbulent(Whitening, Option<Box<(Vec<f64>, ScanTurbulence)>>),
}

impl Background {
    /// Of gates whose weight has that standard deviation \[m\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible turbulence, [`Error::Linalg`] for a covariance without a factor.
    pub(crate) fn new(
        cells: &Cells,
        turbulence: Option<&Turbulence>,
        gate_std_m: f64,
    ) -> Result<Self, Error> {
        let Cells {
            elevation_rad,
            range_m,
            cells,
            ..
        } = cells;
        let mut found_in_scan = None;
        let whitening = match turbulence {
            None | Some(Turbulence::OfScan) => {
                return Ok(Self::Noise(
                    cells.iter().map(|cell| cell.deviation_m_s).collect(),
                ));
            }
            Some(Turbulence::Exponential {
                deviation_m_s,
                length_m,
            }) => {
                not_negative("deviation_m_s of the turbulence", *deviation_m_s)?;
                positive("length_m of the turbulence", *length_m)?;
                let places: Vec<_> = cells
                    .iter()
                    .map(|cell| (cell.place_m, cell.deviation_m_s))
                    .collect();
                Whitening::exponential(&places, *deviation_m_s, *length_m)
            }
            Some(Turbulence::VonKarman(found)) => {
                let mut gates = Vec::with_capacity(cells.len());
                for cell in cells {
                    let (sine, cosine) = elevation_rad[cell.line].sin_cos();
                    let direction = [cosine, 0.0, sine];
                    let range_m = range_m[cell.gate];
                    gates.push(GatePosition::new(direction, range_m, 0.0, [0.0; 3]));
                }
                let sigmas_m_s: Vec<f64> = cells.iter().map(|cell| cell.deviation_m_s).collect();
                let table = gate_covariance(&gates, gate_std_m)?;
                let variances = sigmas_m_s.iter();
                let noise_m2_s2 = variances.map(|sigma| found.noise_factor * sigma * sigma);
                found_in_scan = Some(Box::new((noise_m2_s2.collect(), *found)));
                Whitening::new(found.covariance_m2_s2(&table, &gates, &sigmas_m_s))
            }
        };
        let reason = "is not positive definite: turbulence without noise in close cells has none";
        let order = cells.len();
        let singular = Error::Linalg {
            what: "covariance of the background",
            order,
            reason,
        };
        let whitening = whitening.ok_or(singular)?;
        Ok(Self::Turbulent(whitening, found_in_scan))
    }

    /// Columns of numbers by cell, made white in place.
    pub(crate) fn whiten(&self, columns: &mut Array2<f64>) {
        match self {
            Self::Noise(deviations) => {
                columns
                    .axis_iter_mut(Axis(0))
                    .zip(deviations)
                    .for_each(|(mut row, deviation)| row /= *deviation);
            }
            Self::Turbulent(whitening, _) => forward(whitening.lower.view(), columns),
        }
    }

    /// One number by cell, made white in place.
    pub(crate) fn whiten_one(&self, numbers: &mut [f64]) {
        match self {
            Self::Noise(deviations) => numbers
                .iter_mut()
                .zip(deviations)
                .for_each(|(x, deviation)| *x /= deviation),
            Self::Turbulent(whitening, _) => whitening.whiten(numbers),
        }
    }

    /// Part of the turbulence that was found in a scan of the variance of the optimum contrast of a white pattern of unit length; none of other
    /// backgrounds.
    pub(crate) fn turbulent_part(&self, pattern: &[f64]) -> Option<f64> {
        let Self::Turbulent(whitening, Some(known)) = self else {
            return None;
        };
        let contrast = whitening.contrast(pattern);
        let mut of_noise = 0.0;
        for (weight, noise_m2_s2) in contrast.iter().zip(&known.0) {
            of_noise += weight * weight * noise_m2_s2;
        }
        Some((1.0 - of_noise).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_map_becomes_means_of_blocks_with_their_deviation_and_without_holes() {
        let elevation_rad: Vec<f64> = (0..120).map(|i| 0.05 + 1e-3 * f64::from(i)).collect();
        let range_m: Vec<f64> = (0..60).map(|i| 300.0 + 3.0 * f64::from(i)).collect();
        let mut velocity =
            Array2::from_shape_fn((120, 60), |(line, gate)| 0.1 * line as f64 + gate as f64);
        velocity[[0, 0]] = f64::NAN;
        velocity.slice_mut(ndarray::s![60.., 30..]).fill(f64::NAN);
        let deviation = Array2::from_elem((120, 60), 0.6);
        let map = VelocityMap {
            elevation_rad: &elevation_rad,
            range_m: &range_m,
            velocity_m_s: velocity.view(),
            standard_deviation_m_s: Some(deviation.view()),
        };
        let cells = Cells::new(&map, &WakeModel::default());
        assert_eq!(map.blocks(MOST_CELLS), (3, 1));
        assert_eq!(cells.cells.len(), 40 * 60 - 20 * 30);
        let means = cells.means(velocity.view()).unwrap();
        assert!(
            (means[0] - 0.15).abs() < 1e-12
                && (cells.cells[0].deviation_m_s - 0.6 / 2f64.sqrt()).abs() < 1e-12
        );
        assert!(
            (means[1] - 1.1).abs() < 1e-12
                && (cells.cells[1].deviation_m_s - 0.6 / 3f64.sqrt()).abs() < 1e-12
        );
        velocity.slice_mut(ndarray::s![3..6, 5]).fill(f64::NAN);
        assert_eq!(
            cells
                .means(velocity.view())
                .unwrap()
                .iter()
                .filter(|v| v.is_nan())
                .count(),
            1
        );
        assert!(cells.means(velocity.slice(ndarray::s![1.., ..])).is_err());
    }
}
