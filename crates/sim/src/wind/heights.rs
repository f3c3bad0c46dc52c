//! Winds over height in one window: bins of height, and in each the most likely wind among bad velocities.
//!
//! Check: `wind` in the tests of the program.

use super::WindOptions;
use super::directions::{Components, UP, dot};
use crate::Error;
use crate::io::scans::Ray;
use ndarray::{Array2, s};
use wakescope_estimate::wind_profile::{MixtureFit, RadialVelocities, fit_mixture};

/// Bins of fewer velocities are fitted together with their neighbours.
const FEW: usize = 16;
/// Elevations of one cone, degrees, and the least step of heights that are those of gates, m.
const SAME_ELEVATION_DEG: f64 = 0.2;
const LEAST_STEP_M: f64 = 0.05;
/// Heights nearer than this are those of one gate, m.
const SAME_HEIGHT_M: f64 = 1e-3;
/// Step of heights of scans of several elevations, m.
const USUAL_STEP_M: f64 = 25.0;

/// Largest vertical wind in the mean over a scan, m/s: updraughts of thunderstorms reach 50 m/s, and are narrower. Velocities that are
/// folded together shift the vertical wind by the width of the band over the sine of the elevation.
const MOST_UP_M_S: f64 = 30.0;
/// Standard errors of noise by which a vertical wind must exceed that.
const SURE: f64 = 3.0;

/// Step of a sequence of low discrepancy: the golden ratio less 1.
const GOLDEN: f64 = 0.618_033_988_7;

/// A velocity of one gate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    /// Number of its ray in the window.
    pub(super) line: usize,
    /// Number of its gate in the ray.
    pub(super) gate: usize,
    pub(super) direction: [f64; 3],
    pub(super) range_m: f64,
    pub(super) velocity_m_s: f64,
    /// NaN if it is unknown.
    pub(super) sigma_m_s: f64,
    pub(super) fold_m_s: Option<f64>,
}

/// A bin of height and its wind.
#[derive(Debug, Clone)]
pub(super) struct Bin {
    pub(super) height_m: f64,
    pub(super) cells: Vec<Cell>,
    pub(super) wind: BinWind,
}

/// What a bin tells of the wind.
#[derive(Debug, Clone)]
pub(super) enum BinWind {
    /// Its directions do not determine it.
    Undetermined,
    /// Its velocities are noise.
    Noise { likelihood: f64 },
    /// Its vertical wind is none that air has.
    Impossible { likelihood: f64 },
    /// A wind.
    Found(Box<FoundWind>),
}

/// The wind of a bin.
#[derive(Debug, Clone)]
pub(super) struct FoundWind {
    pub(super) fit: MixtureFit,
    /// Unit vectors of the components that were fitted.
    pub(super) axes: Vec<[f64; 3]>,
    pub(super) has_no_up: bool,
    /// Whether neighbouring bins were fitted together with this one.
    pub(super) has_few_cells: bool,
    /// The velocities that were fitted.
    pub(super) used: Vec<Cell>,
    /// Where those of this bin begin among them.
    pub(super) first_own: usize,
    /// How the components depend on the velocities \[component, velocity\].
    pub(super) gain: Array2<f64>,
}

impl FoundWind {
    /// The wind at the height of the bin (east, north, up), as far as it was fitted, m/s.
    pub(super) fn vector_m_s(&self) -> [f64; 3] {
        let mut vector = [0.0; 3];
        for (axis, value) in self.axes.iter().zip(&self.fit.wind_m_s) {
            for d in 0..3 {
                vector[d] += axis[d] * value;
            }
        }
        vector
    }

    /// Covariance of the components from noise of these deviations, m²/s². Gates of one ray share fewer samples of it the farther they are
    /// apart, and none from `stride` gates on.
    pub(super) fn noise_covariance_m2_s2(
        &self,
        stride: usize,
        std_m_s: impl Fn(&Cell) -> f64,
    ) -> Array2<f64> {
        let mut order: Vec<usize> = (0..self.used.len()).collect();
        order.sort_by_key(|index| (self.used[*index].line, self.used[*index].gate));
        let count = self.gain.nrows();
        let mut noise = Array2::zeros((count, count));
        for (at, i) in order.iter().enumerate() {
            let one = &self.used[*i];
            for ((a, b), sum) in noise.indexed_iter_mut() {
                *sum += std_m_s(one).powi(2) * self.gain[[a, *i]] * self.gain[[b, *i]];
            }
            for j in &order[at + 1..] {
                let other = &self.used[*j];
                let apart = other.gate.abs_diff(one.gate);
                if other.line != one.line || apart >= stride {
                    break;
                }
                let part = 1.0 - apart as f64 / stride as f64;
                let covariance = part * std_m_s(one) * std_m_s(other);
                for ((a, b), sum) in noise.indexed_iter_mut() {
                    let both = self.gain[[a, *i]] * self.gain[[b, *j]]
                        + self.gain[[a, *j]] * self.gain[[b, *i]];
                    *sum += covariance * both;
                }
            }
        }
        noise
    }

    /// Probabilities of the velocities of this bin to be good.
    pub(super) fn own_weights(&self, count: usize) -> &[f64] {
        &self.fit.weights[self.first_own..self.first_own + count]
    }
}

/// At most `most` of velocities in these directions, each with the number of velocities that it stands for: one of each run of velocities of nearly
/// the same direction, at places that differ from run to run. Variances of sums are too large by it, as each is paired with itself for all
/// of its run, and never negative.
pub(super) fn thinned(directions: &[[f64; 3]], most: usize) -> Vec<(usize, f64)> {
    let mut order: Vec<usize> = (0..directions.len()).collect();
    let length = order.len().div_ceil(most).max(1);
    if length > 1 {
        order.sort_by(|i, j| {
            let [one, other] = [i, j].map(|index| directions[*index]);
            let by_azimuth = one[0].atan2(one[1]).total_cmp(&other[0].atan2(other[1]));
            by_azimuth.then(one[2].total_cmp(&other[2]))
        });
    }
    let mut chosen = Vec::with_capacity(most);
    for (number, run) in order.chunks(length).enumerate() {
        let part = (0.5 + GOLDEN * number as f64).fract();
        let index = (part * run.len() as f64) as usize;
        chosen.push((run[index.min(run.len() - 1)], run.len() as f64));
    }
    chosen
}

/// The velocities of rays.
fn cells(rays: &[Ray]) -> Vec<Cell> {
    let mut cells = Vec::new();
    for (line, ray) in rays.iter().enumerate() {
        let direction = ray.direction();
        for (gate, (range_m, velocity_m_s)) in ray.range_m.iter().zip(&ray.velocity_m_s).enumerate()
        {
            if range_m.is_finite() && velocity_m_s.is_finite() {
                cells.push(Cell {
                    line,
                    gate,
                    direction,
                    range_m: *range_m,
                    velocity_m_s: *velocity_m_s,
                    sigma_m_s: ray.sigma_m_s.get(gate).copied().unwrap_or(f64::NAN),
                    fold_m_s: ray.fold_m_s,
                });
            }
        }
    }
    cells
}

fn is_up(ray: &Ray) -> bool {
    ray.elevation_rad.cos().abs() < SAME_ELEVATION_DEG.to_radians().sin()
}

/// Heights of the gates of rays of one slanted elevation, or of vertical ones, increasing, m; none of rays of several elevations.
fn gate_heights_m(rays: &[Ray]) -> Option<Vec<f64>> {
    let all_up = rays.iter().all(is_up);
    let own: Vec<&Ray> = rays.iter().filter(|ray| all_up || !is_up(ray)).collect();
    let longest = own.iter().rev().max_by_key(|ray| ray.range_m.len())?;
    let up = longest.direction()[2];
    let mut apart_rad = own.iter().map(|ray| ray.direction()[2].asin() - up.asin());
    if apart_rad.any(|apart_rad| apart_rad.abs() > SAME_ELEVATION_DEG.to_radians()) {
        return None;
    }
    // A ray need not have all gates, and in a table without their order each may have one.
    let of_all = own.iter().flat_map(|ray| &ray.range_m);
    stepped_heights_of_gates_m(of_all, up)
        .or_else(|| stepped_heights_of_gates_m(longest.range_m.iter(), up))
}

/// Heights of different ranges along one elevation, increasing, m; none if there are less than two or some are too near to one another.
fn stepped_heights_of_gates_m<'r>(
    range_m: impl Iterator<Item = &'r f64>,
    up: f64,
) -> Option<Vec<f64>> {
    let mut heights_m: Vec<f64> = range_m.map(|range_m| range_m * up).collect();
    heights_m.retain(|height_m| height_m.is_finite());
    heights_m.sort_by(f64::total_cmp);
    heights_m.dedup_by(|next, last| *next - *last < SAME_HEIGHT_M);
    let is_stepped = |pair: &[f64]| pair[1] - pair[0] >= LEAST_STEP_M;
    (heights_m.len() > 1 && heights_m.windows(2).all(is_stepped)).then_some(heights_m)
}

/// Middles of the multiples of a step in which there are velocities, increasing, m.
fn stepped_heights_m(cells: &[Cell], step_m: f64) -> Vec<f64> {
    let mut numbers: Vec<i64> = Vec::with_capacity(cells.len());
    for cell in cells {
        numbers.push((cell.range_m * cell.direction[2] / step_m).floor() as i64);
    }
    numbers.sort_unstable();
    numbers.dedup();
    let middles = numbers.iter().map(|number| (*number as f64 + 0.5) * step_m);
    middles.collect()
}

/// Velocities in bins of height, the lowest first, without a wind as yet.
fn bins(rays: &[Ray], height_step_m: Option<f64>) -> Vec<Bin> {
    let cells = cells(rays);
    let of_gates = match height_step_m {
        None => gate_heights_m(rays),
        Some(_) => None,
    };
    let usual_step_m = height_step_m.unwrap_or(USUAL_STEP_M);
    let centres_m = of_gates.unwrap_or_else(|| stepped_heights_m(&cells, usual_step_m));
    let mut bins = Vec::with_capacity(centres_m.len());
    for height_m in &centres_m {
        bins.push(Bin {
            height_m: *height_m,
            cells: Vec::new(),
            wind: BinWind::Undetermined,
        });
    }
    let step_m = |bin: usize| -> f64 {
        let below = bin.saturating_sub(1);
        let above = (bin + 1).min(centres_m.len() - 1);
        match above - below {
            0 => usual_step_m,
            steps => (centres_m[above] - centres_m[below]) / steps as f64,
        }
    };
    for cell in cells {
        let height_m = cell.range_m * cell.direction[2];
        let above = centres_m.partition_point(|centre_m| *centre_m < height_m);
        let near = [above.saturating_sub(1), above.min(centres_m.len() - 1)];
        let from_m = near.map(|bin| (centres_m[bin] - height_m).abs());
        let nearest = if from_m[0] <= from_m[1] {
            near[0]
        } else {
            near[1]
        };
        if from_m[0].min(from_m[1]) <= 0.5 * step_m(nearest) * (1.0 + 1e-9) {
            bins[nearest].cells.push(cell);
        }
    }
    bins
}

/// The winds of one window, from the lowest height up.
///
/// # Errors
/// What the fit refuses; velocities that are finite give none.
pub(super) fn winds(
    rays: &[Ray],
    components: &Components,
    half_band_m_s: f64,
    options: &WindOptions,
) -> Result<Vec<Bin>, Error> {
    let mut bins = bins(rays, options.height_step_m);
    let mut below: Option<Vec<f64>> = None;
    for number in 0..bins.len() {
        let wind = wind_of(&bins, number, components, half_band_m_s, below.as_deref())?;
        if let BinWind::Found(found) = &wind {
            below = Some(found.fit.wind_m_s.clone());
        }
        bins[number].wind = wind;
    }
    Ok(bins)
}

/// The bins that are fitted together with one of few velocities: as few about it as have enough.
fn stack(bins: &[Bin], number: usize) -> std::ops::Range<usize> {
    let mut range = number..number + 1;
    let mut count = bins[number].cells.len();
    while count < FEW && (range.start > 0 || range.end < bins.len()) {
        let below_m = match range.start {
            0 => f64::INFINITY,
            start => bins[number].height_m - bins[start - 1].height_m,
        };
        let above_m = match bins.get(range.end) {
            None => f64::INFINITY,
            Some(bin) => bin.height_m - bins[number].height_m,
        };
        if below_m < above_m {
            range.start -= 1;
            count += bins[range.start].cells.len();
        } else {
            count += bins[range.end].cells.len();
            range.end += 1;
        }
    }
    range
}

/// Heights of the velocities of bins that are fitted together over that of one of them; a difference of 1 is all of these bins.
fn heights_over(bins: &[Bin], number: usize, range: std::ops::Range<usize>) -> Vec<f64> {
    let span_m = bins[range.end - 1].height_m - bins[range.start].height_m;
    let mut heights = Vec::new();
    for bin in &bins[range] {
        let over_m = bin.height_m - bins[number].height_m;
        heights.resize(heights.len() + bin.cells.len(), over_m / span_m.max(1.0));
    }
    heights
}

/// How velocities depend on the components along `axes`, and on their slopes over height if these are fitted.
fn rows(cells: &[Cell], axes: &[[f64; 3]], heights: &[f64], has_slopes: bool) -> Array2<f64> {
    let count = axes.len();
    let columns = if has_slopes { 2 * count } else { count };
    Array2::from_shape_fn((cells.len(), columns), |(i, j)| {
        let along = dot(cells[i].direction, axes[j % count]);
        if j < count { along } else { along * heights[i] }
    })
}

/// The wind of one bin, from its own velocities or those of neighbours too where it has few.
fn wind_of(
    bins: &[Bin],
    number: usize,
    components: &Components,
    half_band_m_s: f64,
    below_m_s: Option<&[f64]>,
) -> Result<BinWind, Error> {
    let own = &bins[number].cells;
    let directions: Vec<[f64; 3]> = own.iter().map(|cell| cell.direction).collect();
    let axes = components.determined_by(&directions).to_vec();
    if axes.is_empty() {
        return Ok(BinWind::Undetermined);
    }
    let mut found = BinWind::Undetermined;
    // Neighbours without velocities do not determine slopes over height.
    for range in [stack(bins, number), number..number + 1] {
        let of = (bins, number, range);
        found = wind_of_bins(of, &axes, half_band_m_s, below_m_s)?;
        if !matches!(found, BinWind::Undetermined) {
            break;
        }
    }
    if let BinWind::Found(found) = &mut found {
        found.has_no_up = axes.len() < components.axes.len();
    }
    Ok(found)
}

/// The wind of one bin from the velocities of a range of bins, linear in height if these are several.
fn wind_of_bins(
    (bins, number, range): (&[Bin], usize, std::ops::Range<usize>),
    axes: &[[f64; 3]],
    half_band_m_s: f64,
    below_m_s: Option<&[f64]>,
) -> Result<BinWind, Error> {
    let has_few_cells = range.len() > 1;
    let used: Vec<Cell> = bins[range.clone()]
        .iter()
        .flat_map(|bin| bin.cells.iter().copied())
        .collect();
    let before = bins[range.start..number].iter();
    let first_own = before.map(|bin| bin.cells.len()).sum();
    let heights = heights_over(bins, number, range);
    let count = axes.len();
    let rows = rows(&used, axes, &heights, has_few_cells);
    let velocities: Vec<f64> = used.iter().map(|cell| cell.velocity_m_s).collect();
    let folds = used.iter().map(|cell| cell.fold_m_s);
    let folds_m_s: Vec<f64> = folds.map(|fold| fold.unwrap_or(f64::INFINITY)).collect();
    let data = RadialVelocities {
        rows: rows.view(),
        velocity_m_s: &velocities,
        half_band_m_s,
        folds_m_s: &folds_m_s,
    };
    let start_m_s = below_m_s.filter(|start| start.len() == count).map(|start| {
        let mut start = start.to_vec();
        start.resize(rows.ncols(), 0.0);
        start
    });
    let Some(mut fit) = fit_mixture(&data, start_m_s.as_deref())? else {
        return Ok(BinWind::Undetermined);
    };
    let gain = fit.gain(rows.view()).filter(|_| fit.is_accepted());
    let Some(gain) = gain else {
        return Ok(BinWind::Noise {
            likelihood: fit.likelihood,
        });
    };
    if is_impossible(axes, &fit, &gain) {
        return Ok(BinWind::Impossible {
            likelihood: fit.likelihood,
        });
    }
    fit.wind_m_s.truncate(count);
    Ok(BinWind::Found(Box::new(FoundWind {
        gain: gain.slice(s![..count, ..]).to_owned(),
        has_no_up: false,
        has_few_cells,
        axes: axes.to_vec(),
        fit,
        used,
        first_own,
    })))
}

/// Whether the vertical wind among several components is beyond what air has, by more than its noise.
fn is_impossible(axes: &[[f64; 3]], fit: &MixtureFit, gain: &Array2<f64>) -> bool {
    let up = axes.iter().position(|axis| *axis == UP);
    let Some(up) = up.filter(|_| axes.len() > 1) else {
        return false;
    };
    let squares: f64 = gain.row(up).iter().map(|part| part * part).sum();
    let noise_std_m_s = fit.std_m_s * squares.sqrt();
    fit.wind_m_s[up].abs() > MOST_UP_M_S + SURE * noise_std_m_s
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over the velocities of half an hour and more of DBS, a turn in 8 s, with a correlation that falls in 60 s.
    #[test]
    fn some_velocities_stand_for_all_of_each_direction() {
        let beams = [
            [0.5, 0.0, 0.9],
            [0.0, 0.5, 0.9],
            [-0.5, 0.0, 0.9],
            [0.0, -0.5, 0.9],
            [0.0, 0.0, 1.0],
        ];
        let correlation = |i: usize, j: usize| (-(i.abs_diff(j) as f64) * 1.6 / 60.0).exp();
        for turns in [240, 720] {
            let directions = beams.repeat(turns);
            let chosen = thinned(&directions, 800);
            assert!(chosen.len() <= 800);
            for beam in beams {
                let own = chosen.iter().filter(|(i, _)| directions[*i] == beam);
                let count: f64 = own.map(|(_, count)| count).sum();
                assert!(
                    (count / turns as f64 - 1.0).abs() < 0.02,
                    "{beam:?}: {count}"
                );
            }
            let mut exact = 0.0;
            for i in 0..directions.len() {
                let near = i.saturating_sub(400)..(i + 400).min(directions.len());
                exact += near.map(|j| correlation(i, j)).sum::<f64>();
            }
            let mut found = 0.0;
            for (i, of_i) in &chosen {
                for (j, of_j) in &chosen {
                    found += of_i * of_j * correlation(*i, *j);
                }
            }
            assert!(
                (0.98..1.2).contains(&(found / exact)),
                "{turns}: {}",
                found / exact
            );
        }
        let all = thinned(&beams, 800);
        assert_eq!(all, [0, 1, 2, 3, 4].map(|index| (index, 1.0)));
    }
}
