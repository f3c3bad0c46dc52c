//! What a velocity of a scan is of the air about its range, on points that are as many as a fit needs, and what a wake shows there.
//!
//! Check: the reference maps; a wake without circulation shows its wind.

use ndarray::Array2;

use crate::error::Error;
use crate::retrieval::{Gate, Movement, RetrievalOptions, ScanMap};
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::{RangeKernel, Wake};

/// Standard deviations after which a Gaussian weight is cut off, and the points at which the final fit samples it.
const REACH: f64 = 3.5;
const POINTS: usize = 41;
/// Points of a search are farther apart by this factor.
const COARSER: usize = 2;

impl<'a> Gates<'a> {
    /// For the search of a wake, with few points.
    pub(crate) fn rough(map: &'a ScanMap, options: &'a RetrievalOptions) -> Result<Self, Error> {
        Self::on_grid(map, options, COARSER)
    }

    /// For the way to the end of a fit: the points of a weight lie on one grid with the gates, which is quick, about `coarser` times as
    /// far apart as in the end.
    pub(crate) fn on_grid(
        map: &'a ScanMap,
        options: &'a RetrievalOptions,
        coarser: usize,
    ) -> Result<Self, Error> {
        options.gate.validate(&map.range_m)?;
        let step_m = uniform_step_m(&map.range_m);

        let kernel = match &options.gate {
            Gate::Gaussian { std_m } if *std_m > 0.0 => {
                let longest_m = longest_spacing_m(*std_m, coarser);
                let spacing_m = step_m.map_or(longest_m, |step| step / (step / longest_m).ceil());
                gaussian(
                    *std_m,
                    spacing_m,
                    (REACH * std_m / spacing_m).ceil() as usize,
                )?
            }
            Gate::Kernel(kernel) => {
                let longest_m = longest_spacing_m(kernel.width_m(), coarser);
                let factor = kernel.points_within(longest_m).max(coarser);
                step_m.map_or_else(
                    || kernel.coarser(factor),
                    |step_m| kernel.dividing(step_m, factor),
                )
            }
            Gate::Point | Gate::Gaussian { .. } => {
                RangeKernel::new(0.0, step_m.unwrap_or(1.0), &[1.0])?
            }
        };
        let moves = options.movement != Movement::Frozen && map.lasts_s() > 0.0;
        let seconds = moves.then(|| map.after_middle_s());
        let places = (&map.elevation_rad[..], &map.range_m[..]);
        Ok(Self {
            seconds,
            shared_points: step_m.is_some(),
            ..Self::at_rest(&options.model, kernel, places)
        })
    }

    /// For the end of a fit: every gate has its own points, each at its place.
    pub(crate) fn fine(mut self, gate: &Gate) -> Result<Self, Error> {
        match gate {
            Gate::Kernel(kernel) => self.kernel = kernel.clone(),
            Gate::Gaussian { std_m } if *std_m > 0.0 => {
                self.kernel = gaussian(
                    *std_m,
                    2.0 * REACH * std_m / (POINTS - 1) as f64,
                    POINTS / 2,
                )?;
                self.shared_points = false;
            }
            Gate::Point | Gate::Gaussian { .. } => {}
        }
        Ok(self)
    }

    /// The same with vortices that stand still.
    pub(crate) fn frozen(self) -> Self {
        Self {
            seconds: None,
            ..self
        }
    }
}

/// Largest distance of the points of a weight of that standard deviation, `coarser` times that of the end of a fit.
fn longest_spacing_m(std_m: f64, coarser: usize) -> f64 {
    coarser as f64 * 2.0 * REACH * std_m / (POINTS - 1) as f64
}

/// A Gaussian weight of N points on either side.
fn gaussian(std_m: f64, spacing_m: f64, points: usize) -> Result<RangeKernel, Error> {
    let mut weights = Vec::with_capacity(2 * points + 1);
    for i in 0..=2 * points {
        let sigmas = (i as f64 - points as f64) * spacing_m / std_m;
        weights.push((-0.5 * sigmas.powi(2)).exp());
    }
    RangeKernel::new(-(points as f64) * spacing_m, spacing_m, &weights)
}

/// Distance of the gates if it is the same everywhere.
fn uniform_step_m(range_m: &[f64]) -> Option<f64> {
    let first = range_m.first()?;
    let last = range_m.last()?;
    let step = (last - first) / (range_m.len() - 1) as f64;
    let even = range_m
        .iter()
        .enumerate()
        .all(|(i, r)| (r - first - i as f64 * step).abs() < 1e-4 * step);
    (even && step > 0.0).then_some(step)
}

/// Radial velocities \[m/s\] \[line, gate\] of `wake`, given at the reference time of the scan, as the options see it; vortices stand
/// still unless `moving`.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input.
pub fn expected_velocities(
    map: &ScanMap,
    options: &RetrievalOptions,
    wake: &Wake,
    moving: bool,
) -> Result<Array2<f64>, Error> {
    options.validate()?;
    map.validate()?;
    let movement = if moving {
        Movement::Moving
    } else {
        Movement::Frozen
    };
    let options = RetrievalOptions {
        movement,
        ..options.clone()
    };
    Ok(Gates::rough(map, &options)?
        .fine(&options.gate)?
        .velocities(wake))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wind_without_vortices_is_seen_along_the_lines() {
        let map = ScanMap {
            elevation_rad: vec![0.0, 0.3],
            time_s: vec![f64::NAN; 2],
            range_m: vec![100.0, 110.0],
            velocity_m_s: Array2::from_elem((2, 2), 0.0),
            sigma_m_s: None,
            fold_m_s: None,
        };
        let wind = Wake::from_array(&[0.0, 0.0, 90.0, 20.0, 110.0, 20.0, 1.0, 1.0, 2.0, 0.1, 0.0]);
        let found = expected_velocities(&map, &RetrievalOptions::default(), &wind, true).unwrap();
        let at = |line: usize, gate: usize| {
            let angle = map.elevation_rad[line];
            let range_m = map.range_m[gate];
            (2.0 + 0.1 * range_m * angle.sin()) * angle.cos()
        };
        for ((line, gate), velocity) in found.indexed_iter() {
            assert!((velocity - at(line, gate)).abs() < 1e-12, "{found}");
        }
    }
}
