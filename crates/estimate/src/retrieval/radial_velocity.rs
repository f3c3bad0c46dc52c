//! Method of radial velocities (Smalikho, Banakh, Holzaepfel, Rahm 2015; with images Smalikho 2019): centres from the extremes of
//! each gate, circulations by linear least squares.
//!
//! The wind is fitted robustly and taken away. On each gate a left vortex has its largest velocity above its smallest one, a right
//! vortex below; with D the largest square of such a difference, a core is where D is largest over the gates, at the middle of both
//! elevations. Gate averaging moves the extremes inwards by a metre or more, which costs some per cent of circulation, and noise more.
//! Check: the errors that the literature and an independent program have.

use ndarray::Array2;
use std::ops::Range;

use crate::Measured;
use crate::error::{Error, enough_velocities};
use crate::retrieval::aliases::{CALM, Unfolded};
use crate::retrieval::hypotheses::{End, Kind, Stage};
use crate::retrieval::report::{Chosen, Report};
use crate::retrieval::{Movement, RetrievalOptions, ScanMap, ScanResult};
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::starts::CORE_OVER_SPACING;
use crate::vortex_fit::{FreeParameters, Loss, Sharing, Vortex, Wake};

/// Gates that are averaged.
const GATES: usize = 3;

/// Vortices of one scan by the method of radial velocities; `options.model.images` chooses the variant. Core radii are kept; positions
/// have no standard deviation (NaN), those of circulations are of the linear fit alone.
///
/// # Errors
/// As [`fit_scan`](crate::retrieval::fit_scan).
pub fn radial_velocity_method(
    map: &ScanMap,
    options: &RetrievalOptions,
) -> Result<ScanResult, Error> {
    options.validate()?;
    enough_velocities(map.validate()?, 100)?;
    let linear = of_linear_fit(options);
    let unfolded = Unfolded::new(map, options)?;
    let nothing = unfolded.with_wind(&Wake::from_array(&CALM));
    let unfolded = unfolded.map;
    let gates = Gates::rough(&unfolded, &linear)?.fine(&linear.gate)?;
    let mut stage = Stage::new(&unfolded, &linear, &gates);
    stage.squares.loss = options.loss;
    stage.is_noise_left = false;
    if map.sigma_m_s.is_none() {
        let calm = stage.wind(&nothing)?;
        stage = stage.rescaled(&calm);
    }
    let calm = stage.wind(&nothing)?;
    stage.squares.loss = Loss::Squares;
    let wake = wake_of_extremes(&stage, &calm.wake);
    let mut ends = linear_fits(&stage, wake.as_ref());
    let best = ends.iter().min_by(|a, b| a.chi2.total_cmp(&b.chi2));
    if let Some(best) = best.filter(|_| map.sigma_m_s.is_none()).cloned() {
        stage = stage.rescaled(&best);
        ends = linear_fits(&stage, wake.as_ref());
    }
    let report = Report {
        stage: &stage,
        scale: 1.0,
        wind: &stage.wind(&calm.wake)?,
        ends: &ends,
    };
    let Chosen {
        end,
        covariance,
        statistic,
        ..
    } = report.chosen()?;
    let mut result = report.result(end, covariance, statistic);
    for vortex in &mut result.vortices {
        for place in [&mut vortex.lateral_position_m, &mut vortex.height_m] {
            *place = Measured {
                std: f64::NAN,
                ..*place
            };
        }
    }
    Ok(result)
}

/// Options of a fit of circulations and wind to a scan without motion, which is linear.
fn of_linear_fit(options: &RetrievalOptions) -> RetrievalOptions {
    RetrievalOptions {
        free: FreeParameters {
            lateral_position: Sharing::Fixed,
            height: Sharing::Fixed,
            core_radius: Sharing::Fixed,
            ..options.free
        },
        loss: Loss::Squares,
        movement: Movement::Frozen,
        turbulence: None,
        core_prior: None,
        ..options.clone()
    }
}

/// The wind of `calm` with a left and a right vortex at the extremes of what it leaves of the map.
fn wake_of_extremes(stage: &Stage<'_>, calm: &Wake) -> Option<Wake> {
    let mut rest = Array2::from_elem(stage.map.velocity_m_s.dim(), f64::NAN);
    let residuals = stage.squares.rows(&calm.to_array(), &[]).residuals;
    for (cell, residual) in stage.squares.cells.iter().zip(residuals) {
        rest[[cell.line, cell.gate]] = residual * cell.sigma_m_s;
    }
    let left_m = centre_m(stage, &rest, true)?;
    let right_m = centre_m(stage, &rest, false)?;
    let core_m = stage
        .options
        .core_radius_m
        .unwrap_or(CORE_OVER_SPACING * (right_m.0 - left_m.0).abs());
    Some(Wake {
        left: Vortex::at(left_m, 1.0, core_m),
        right: Vortex::at(right_m, 1.0, core_m),
        ..*calm
    })
}

/// Circulations of one vortex and of both at the positions of a wake, and the wind.
fn linear_fits(stage: &Stage<'_>, wake: Option<&Wake>) -> Vec<End> {
    let Some(wake) = wake else {
        return vec![];
    };
    let kinds = [Kind::Left, Kind::Right, Kind::Both].map(|kind| End {
        kind,
        wake: kind.of(wake),
        chi2: f64::INFINITY,
        sigmas_left: f64::INFINITY,
        groups: stage.groups(kind),
    });
    stage.fine(&kinds)
}

/// Largest square of a difference of ordered velocities of a gate and the middle of their elevations.
fn spread(elevation_rad: &[f64], velocity: &[f64], left: bool) -> (f64, f64) {
    // a right vortex is a left one with the velocities turned round
    let sign = if left { 1.0 } else { -1.0 };
    let mut lowest = (f64::INFINITY, 0.0);
    let mut best = (0.0, 0.0);
    for (elevation, velocity) in elevation_rad
        .iter()
        .zip(velocity)
        .filter(|(_, v)| v.is_finite())
    {
        let difference = sign * velocity - lowest.0;
        if difference > best.0 {
            best = (difference, 0.5 * (elevation + lowest.1));
        }
        if sign * velocity < lowest.0 {
            lowest = (sign * velocity, *elevation);
        }
    }
    (best.0 * best.0, best.1)
}

/// The gate and its neighbours, over which velocities are averaged.
fn neighbours(gate: usize, gates: usize) -> Range<usize> {
    gate.saturating_sub(GATES / 2)..(gate + GATES / 2 + 1).min(gates)
}

/// Mean of the velocities of a line over neighbouring gates.
fn smoothed(rest: &Array2<f64>, line: usize, gate: usize) -> f64 {
    let mut sum = 0.0;
    let mut count = 0.0;
    for gate in neighbours(gate, rest.ncols()) {
        let velocity = rest[[line, gate]];
        if velocity.is_finite() {
            sum += velocity;
            count += 1.0;
        }
    }
    sum / count
}

/// Lateral coordinate and height \[m\] of the centre of the left or the right vortex in a map without wind.
fn centre_m(stage: &Stage<'_>, rest: &Array2<f64>, left: bool) -> Option<(f64, f64)> {
    let map = stage.map;
    let gates = map.range_m.len();
    let mut spreads = Vec::with_capacity(gates);
    for gate in 0..gates {
        let lines = 0..map.elevation_rad.len();
        let column: Vec<f64> = lines.map(|line| smoothed(rest, line, gate)).collect();
        spreads.push(spread(&map.elevation_rad, &column, left));
    }
    let best = (0..gates).max_by(|a, b| spreads[*a].0.total_cmp(&spreads[*b].0))?;
    let mut range_m = map.range_m[best];
    if best > 0 && best + 1 < gates {
        let [before, at, after] = [best - 1, best, best + 1].map(|gate| spreads[gate].0);
        let bend = before - 2.0 * at + after;
        let part = if bend < 0.0 {
            0.5 * (before - after) / bend
        } else {
            0.0
        };
        range_m += part * 0.5 * (map.range_m[best + 1] - map.range_m[best - 1]);
    }
    let about = neighbours(best, gates);
    let weights: f64 = spreads[about.clone()]
        .iter()
        .map(|(square, _)| square)
        .sum();
    let elevation: f64 = spreads[about]
        .iter()
        .map(|(square, elevation)| square * elevation)
        .sum();
    (weights > 0.0).then(|| {
        let model = &stage.options.model;
        model.position_m(range_m, elevation / weights)
    })
}
