//! Method of radial velocities (Smalikho, Banakh, Holzaepfel, Rahm 2015; with images Smalikho 2019): centres from the extremes of
//! each gate, circulations by linear least squares.
//!
//! The wind is fitted robustly and taken away. On each gate a left vortex has its largest velocity above its smallest one, a right
//! vortex below; with D the largest square of such a difference, a core is where D is largest over the gates, at the middle of both
//! elevations. Gate averaging moves the extremes inwards by a metre or more, which costs some per cent of circulation, and noise more.
//! Check: the errors that the literature and an independent program have.

use ndarray::Array2;

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
    let fixed = Sharing::Fixed;
    let free = FreeParameters {
        lateral_position: fixed,
        height: fixed,
        core_radius: fixed,
        ..options.free
    };
    let linear = RetrievalOptions {
        free,
        loss: Loss::Squares,
        movement: Movement::Frozen,
        turbulence: None,
        core_prior: None,
        ..options.clone()
    };
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
    let mut rest = Array2::from_elem(map.velocity_m_s.dim(), f64::NAN);
    for (cell, residual) in stage
        .squares
        .cells
        .iter()
        .zip(stage.squares.rows(&calm.wake.to_array(), &[]).residuals)
    {
        rest[[cell.line, cell.gate]] = residual * cell.sigma_m_s;
    }
    let centre = |left: bool| {
        let (range_m, elevation_rad) = core(map, &rest, left)?;
        Some(options.model.position_m(range_m, elevation_rad))
    };
    let fits = |stage: &Stage<'_>| -> Vec<End> {
        let (Some(left), Some(right)) = (centre(true), centre(false)) else {
            return vec![];
        };
        let core_m = options
            .core_radius_m
            .unwrap_or(CORE_OVER_SPACING * (right.0 - left.0).abs());
        let [left, right] = [left, right].map(|place_m| Vortex::at(place_m, 1.0, core_m));
        let wake = Wake {
            left,
            right,
            ..calm.wake
        };
        let kinds = [Kind::Left, Kind::Right, Kind::Both].map(|kind| End {
            kind,
            wake: kind.of(&wake),
            chi2: f64::INFINITY,
            sigmas_left: f64::INFINITY,
            groups: stage.groups(kind),
        });
        stage.fine(&kinds)
    };
    let mut ends = fits(&stage);
    if let (None, Some(best)) = (
        &map.sigma_m_s,
        ends.iter()
            .min_by(|a, b| a.chi2.total_cmp(&b.chi2))
            .cloned(),
    ) {
        stage = stage.rescaled(&best);
        ends = fits(&stage);
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

/// Range and elevation of a core.
fn core(map: &ScanMap, rest: &Array2<f64>, left: bool) -> Option<(f64, f64)> {
    let gates = map.range_m.len();
    let about = |gate: usize| gate.saturating_sub(GATES / 2)..(gate + GATES / 2 + 1).min(gates);
    let smooth = |line: usize, gate: usize| {
        let known = about(gate)
            .map(|gate| rest[[line, gate]])
            .filter(|v| v.is_finite());
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        sum / count
    };
    let of = |gate: usize| {
        let column: Vec<f64> = (0..map.elevation_rad.len())
            .map(|line| smooth(line, gate))
            .collect();
        spread(&map.elevation_rad, &column, left)
    };
    let spreads: Vec<(f64, f64)> = (0..gates).map(of).collect();
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
    let weights: f64 = about(best).map(|gate| spreads[gate].0).sum();
    let elevation: f64 = about(best)
        .map(|gate| spreads[gate].0 * spreads[gate].1)
        .sum();
    (weights > 0.0).then(|| (range_m, elevation / weights))
}
