//! Dissipation rate of the layers of all windows, and the outer scale of the run.
//!
//! Velocities of one window and one layer of height are cut into blocks of consecutive lines. Each layer has its own dissipation and noise; the outer
//! scale has one probability over a few values for the whole run, by which both are averaged.
//! Check: `wind` in the tests of the program.

use super::WindOptions;
use super::directions::dot;
use super::heights::{Bin, BinWind, Cell, FoundWind, thinned};
use crate::Error;
use crate::io::scans::Ray;
use ndarray::Array2;
use std::collections::BTreeMap;
use wakescope_estimate::wind_profile::{
    Block, GateCovariance, GatePosition, GateSample, OUTER_SCALES_M, TurbulenceFit,
    outer_scale_probabilities, spectra, turbulence_covariance,
};

/// Most velocities of a block.
const LARGEST_BLOCK: usize = 512;
/// Fewest contrasts of the velocities of a layer that tell of turbulence.
const FEWEST_CONTRASTS: usize = 10;
/// Least probability of a good velocity that is used.
const GOOD: f64 = 0.5;
/// Wind across a stare whose wind is not known, m/s: for standard deviations alone.
const ASSUMED_WIND_M_S: f64 = 5.0;
/// Most velocities of one height whose shared eddies are counted.
const MOST_SHARED: usize = 800;

/// Turbulence of a layer of one window.
#[derive(Debug, Clone)]
pub(super) struct LayerTurbulence {
    /// eps^(2/3) with its standard deviation, m^(4/3)/s^2.
    pub(super) eps23: f64,
    pub(super) eps23_std: f64,
    /// Variance of the noise, m²/s², or the factor of those that are given.
    pub(super) noise_m2_s2: f64,
    /// Standard deviation of the noise, m/s.
    pub(super) noise_std_m_s: f64,
    /// eps^(2/3) at each outer scale times its probability.
    eps23_weights: Vec<f64>,
    /// Whether the variance of the noise is a factor of variances that are given.
    has_sigmas: bool,
}

impl LayerTurbulence {
    /// Variance of the noise of a velocity, m²/s².
    fn variance_m2_s2(&self, cell: &Cell) -> f64 {
        let given = if self.has_sigmas { cell.sigma_m_s } else { 1.0 };
        self.noise_m2_s2 * given * given
    }
}

/// The velocities of a layer of one window.
pub(super) struct Layer {
    /// Number of the window, and of the layer counted from the height of the lidar.
    key: (usize, i64),
    blocks: Vec<Block>,
    /// Velocity of the air by which gates are carried, east, north, up, m/s.
    carried_m_s: [f64; 3],
    /// Mean square of the given standard deviations; 1 without.
    mean_square: f64,
    has_sigmas: bool,
}

/// Turbulence of a run.
pub(super) struct RunTurbulence {
    covariance: Option<GateCovariance>,
    /// Outer scales, m, and their probabilities.
    pub(super) outer_scales: Vec<(f64, f64)>,
    layers: BTreeMap<(usize, i64), LayerTurbulence>,
    carried_m_s: BTreeMap<(usize, i64), [f64; 3]>,
}

/// Number of the layer of a height.
fn layer_number(height_m: f64, layer_m: f64) -> i64 {
    (height_m / layer_m).floor() as i64
}

/// Whether standard deviations are known of all velocities.
fn have_sigmas(bins: &[Bin]) -> bool {
    let mut cells = bins.iter().flat_map(|bin| &bin.cells);
    cells.all(|cell| cell.sigma_m_s > 0.0 && cell.sigma_m_s.is_finite())
}

/// The layers of one window with the velocity by which the air is carried through each, if it is known: else each line is a block. Where it is known
/// but for the part across the plane of the scan (`has_wind_across`), each pass of the scan sees air of its own.
pub(super) fn layers(
    window: usize,
    rays: &[Ray],
    bins: &[Bin],
    options: &WindOptions,
    has_wind_across: bool,
    carried: impl Fn(f64, [f64; 3]) -> Option<[f64; 3]>,
) -> Vec<Layer> {
    let mut numbers: BTreeMap<i64, Vec<&Bin>> = BTreeMap::new();
    for bin in bins {
        if matches!(bin.wind, BinWind::Found(_)) {
            let number = layer_number(bin.height_m, options.layer_m);
            numbers.entry(number).or_default().push(bin);
        }
    }
    let have_sigmas = have_sigmas(bins);
    // Without all times it is not known where the air of each line is.
    let have_times = rays.iter().all(|ray| ray.time_s.is_finite());
    let mut layers = Vec::with_capacity(numbers.len());
    for (number, bins) in numbers {
        let (mean_m_s, height_m) = mean_wind(&bins);
        let known_m_s = carried(height_m, mean_m_s);
        let carried_m_s = known_m_s.unwrap_or_else(|| assumed_m_s(&rays[bins[0].cells[0].line]));
        let (lines, mean_square) = good_samples(&bins, rays, have_sigmas);
        let is_known = known_m_s.is_some() && have_times;
        let strides = options.gate_stride.max(1);
        let mut blocks = Vec::new();
        for first in 0..strides {
            let own = interleaved(&lines, first, strides, rays);
            for pass in passes(&own, has_wind_across) {
                let cut = cut(pass, is_known);
                blocks.extend(cut.iter().map(|block| Block::new(block, carried_m_s)));
            }
        }
        layers.push(Layer {
            key: (window, number),
            blocks,
            carried_m_s,
            mean_square,
            has_sigmas: have_sigmas,
        });
    }
    layers
}

/// Gates with their numbers by lines.
type Lines = BTreeMap<usize, Vec<(usize, GateSample)>>;

/// The good velocities of bins, and the mean square of the standard deviations of their noise.
fn good_samples(bins: &[&Bin], rays: &[Ray], have_sigmas: bool) -> (Lines, f64) {
    let mut lines = Lines::new();
    let mut squares = 0.0;
    let mut count = 0.0;
    for bin in bins {
        let BinWind::Found(found) = &bin.wind else {
            continue;
        };
        for (cell, weight) in bin.cells.iter().zip(found.own_weights(bin.cells.len())) {
            if *weight < GOOD {
                continue;
            }
            let noise_std_m_s = if have_sigmas { cell.sigma_m_s } else { 1.0 };
            squares += noise_std_m_s * noise_std_m_s;
            count += 1.0;
            let time_s = rays[cell.line].time_s;
            let sample = GateSample {
                time_s: if time_s.is_finite() { time_s } else { 0.0 },
                direction: cell.direction,
                range_m: cell.range_m,
                velocity_m_s: unfolded_m_s(cell, found),
                noise_std_m_s,
            };
            lines
                .entry(cell.line)
                .or_default()
                .push((cell.gate, sample));
        }
    }
    (lines, squares / f64::max(count, 1.0))
}

/// Mean wind and mean height of bins.
fn mean_wind(bins: &[&Bin]) -> ([f64; 3], f64) {
    let mut sum_m_s = [0.0; 3];
    let mut height_m = 0.0;
    for bin in bins {
        if let BinWind::Found(found) = &bin.wind {
            for (sum, own) in sum_m_s.iter_mut().zip(found.vector_m_s()) {
                *sum += own / bins.len() as f64;
            }
        }
        height_m += bin.height_m / bins.len() as f64;
    }
    (sum_m_s, height_m)
}

/// A wind across a beam whose wind is not known.
fn assumed_m_s(ray: &Ray) -> [f64; 3] {
    let (east, north) = ray.azimuth_rad.sin_cos();
    [ASSUMED_WIND_M_S * north, -ASSUMED_WIND_M_S * east, 0.0]
}

/// The velocity of a cell about that of the wind, if velocities repeat.
fn unfolded_m_s(cell: &Cell, found: &FoundWind) -> f64 {
    let Some(fold_m_s) = cell.fold_m_s else {
        return cell.velocity_m_s;
    };
    let mut expected_m_s = 0.0;
    for (axis, wind_m_s) in found.axes.iter().zip(&found.fit.wind_m_s) {
        expected_m_s += dot(*axis, cell.direction) * wind_m_s;
    }
    let away_m_s = cell.velocity_m_s - expected_m_s;
    cell.velocity_m_s - fold_m_s * (away_m_s / fold_m_s).round()
}

/// One of the interleaved sets of gates, in the order of the times of their lines.
fn interleaved(lines: &Lines, first: usize, strides: usize, rays: &[Ray]) -> Vec<Vec<GateSample>> {
    let mut own = Vec::with_capacity(lines.len());
    for (line, samples) in lines {
        let mut gates: Vec<GateSample> = Vec::with_capacity(samples.len());
        for (gate, sample) in samples {
            if gate % strides == first {
                gates.push(*sample);
            }
        }
        if !gates.is_empty() {
            own.push((rays[*line].time_s, gates));
        }
    }
    own.sort_by(|a, b| a.0.total_cmp(&b.0));
    own.into_iter().map(|(_, gates)| gates).collect()
}

/// Runs of lines in whose order the beam turns one way, or all lines.
fn passes(lines: &[Vec<GateSample>], has_wind_across: bool) -> Vec<&[Vec<GateSample>]> {
    if !has_wind_across {
        return vec![lines];
    }
    let mut passes = Vec::new();
    let mut first = 0;
    let mut last_step = [0.0; 3];
    for next in 1..lines.len() {
        let [last, own] = [next - 1, next].map(|line| lines[line][0].direction);
        let step: [f64; 3] = std::array::from_fn(|d| own[d] - last[d]);
        if step == [0.0; 3] {
            continue;
        }
        // The step back to where the last pass began belongs to neither.
        if dot(step, last_step) < 0.0 && next - first > 1 {
            passes.push(&lines[first..next]);
            first = next;
        }
        last_step = step;
    }
    passes.push(&lines[first..]);
    passes
}

/// Blocks of equal runs of lines; of single lines unless the air is known to be carried.
fn cut(lines: &[Vec<GateSample>], is_carried: bool) -> Vec<Vec<GateSample>> {
    let most = lines.iter().map(Vec::len).max().unwrap_or(1).max(1);
    let fitting = match is_carried {
        true => (LARGEST_BLOCK / most).max(1),
        false => 1,
    };
    let runs = lines.len().div_ceil(fitting).max(1);
    let mut blocks = Vec::new();
    for run in lines.chunks(lines.len().div_ceil(runs).max(1)) {
        let block = run.concat();
        let pieces = block.len().div_ceil(LARGEST_BLOCK).max(1);
        blocks.extend(
            block
                .chunks(block.len().div_ceil(pieces).max(1))
                .map(<[GateSample]>::to_vec),
        );
    }
    blocks
}

impl RunTurbulence {
    /// Turbulence of the layers of all windows.
    ///
    /// # Errors
    /// Eigenvalues that do not converge.
    pub(super) fn new(layers: &[Layer], options: &WindOptions) -> Result<Self, Error> {
        let outer_scales_m = match options.outer_scale_m {
            Some(outer_scale_m) => vec![outer_scale_m],
            None => OUTER_SCALES_M.to_vec(),
        };
        let mut carried_m_s = BTreeMap::new();
        for layer in layers {
            carried_m_s.insert(layer.key, layer.carried_m_s);
        }
        let farthest_m = layers.iter().map(extent_m).fold(1.0, f64::max);
        let covariance = GateCovariance::new(options.gate_std_m, &outer_scales_m, farthest_m)?;
        let mut fits: Vec<(&Layer, Vec<TurbulenceFit>)> = Vec::new();
        for layer in layers {
            let spectra = spectra(&layer.blocks, &covariance)?;
            if spectra[0].len() < FEWEST_CONTRASTS {
                continue;
            }
            let found: Option<Vec<_>> = spectra.iter().map(|spectrum| spectrum.maximum()).collect();
            fits.extend(found.map(|found| (layer, found)));
        }
        let outer_scales = probabilities(&outer_scales_m, &fits);
        let mut found = BTreeMap::new();
        for (layer, fits) in &fits {
            found.insert(layer.key, averaged(layer, fits, &outer_scales, options)?);
        }
        Ok(Self {
            covariance: (!found.is_empty()).then_some(covariance),
            outer_scales,
            layers: found,
            carried_m_s,
        })
    }

    /// Turbulence of the layer of a height, if it is known.
    pub(super) fn of_height(
        &self,
        window: usize,
        height_m: f64,
        layer_m: f64,
    ) -> Option<&LayerTurbulence> {
        self.layers.get(&(window, layer_number(height_m, layer_m)))
    }

    /// Covariance of the wind of a bin, m²/s², in the turbulence of its layer; none where that is not known.
    ///
    /// # Errors
    /// None for a wind that was found.
    pub(super) fn wind_covariance(
        &self,
        window: usize,
        bin: &Bin,
        found: &FoundWind,
        rays: &[Ray],
        options: &WindOptions,
    ) -> Result<Option<Array2<f64>>, Error> {
        let key = (window, layer_number(bin.height_m, options.layer_m));
        let layer = self.layers.get(&key).zip(self.covariance.as_ref());
        let Some((turbulence, covariance)) = layer else {
            return Ok(None);
        };
        let carried_m_s = self.carried_m_s.get(&key).copied().unwrap_or_default();
        let directions: Vec<[f64; 3]> = found.used.iter().map(|cell| cell.direction).collect();
        let chosen = thinned(&directions, MOST_SHARED);
        let mut gain = Array2::zeros((found.gain.nrows(), chosen.len()));
        let mut gates = Vec::with_capacity(chosen.len());
        for (mut column, (index, count)) in gain.columns_mut().into_iter().zip(chosen) {
            column.assign(&(&found.gain.column(index) * count));
            gates.push(gate_position(&found.used[index], rays, carried_m_s));
        }
        let of_air = wakescope_estimate::wind_profile::wind_covariance(
            gain.view(),
            &gates,
            covariance,
            &turbulence.eps23_weights,
        )?;
        let of_noise = found.noise_covariance_m2_s2(options.gate_stride, |cell| {
            turbulence.variance_m2_s2(cell).sqrt()
        });
        Ok(Some(of_air + of_noise))
    }
}

/// Where the gate of a velocity is in air that is carried along.
fn gate_position(cell: &Cell, rays: &[Ray], carried_m_s: [f64; 3]) -> GatePosition {
    let time_s = rays[cell.line].time_s;
    let time_s = if time_s.is_finite() { time_s } else { 0.0 };
    GatePosition::new(cell.direction, cell.range_m, time_s, carried_m_s)
}

/// Largest distance between gates of a layer along one axis times the root of three, m.
fn extent_m(layer: &Layer) -> f64 {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for gate in layer.blocks.iter().flat_map(Block::gates) {
        for d in 0..3 {
            low[d] = low[d].min(gate.position_m[d]);
            high[d] = high[d].max(gate.position_m[d]);
        }
    }
    (0..3)
        .map(|d| (high[d] - low[d]).powi(2))
        .sum::<f64>()
        .sqrt()
}

/// Probability of each outer scale, from the likelihoods of all layers and from what is known before.
fn probabilities(outer_scales_m: &[f64], fits: &[(&Layer, Vec<TurbulenceFit>)]) -> Vec<(f64, f64)> {
    let mut likelihoods = Vec::with_capacity(fits.len());
    for (_, fits) in fits {
        likelihoods.push(fits.iter().map(|fit| fit.likelihood).collect());
    }
    let probabilities = outer_scale_probabilities(outer_scales_m, &likelihoods);
    outer_scales_m.iter().copied().zip(probabilities).collect()
}

/// Turbulence of a layer, averaged over the outer scales. How much blocks that share eddies widen the deviation is found at the
/// most probable outer scale.
fn averaged(
    layer: &Layer,
    fits: &[TurbulenceFit],
    outer_scales: &[(f64, f64)],
    options: &WindOptions,
) -> Result<LayerTurbulence, Error> {
    let best = (0..fits.len()).max_by(|i, j| outer_scales[*i].1.total_cmp(&outer_scales[*j].1));
    let best = best.unwrap_or(0);
    let mut widening = 1.0;
    if layer.blocks.len() > 1 {
        let outer_scale_m = outer_scales[best].0;
        let farthest_m = extent_m(layer).max(1.0);
        let covariance = GateCovariance::new(options.gate_std_m, &[outer_scale_m], farthest_m)?;
        let stated = turbulence_covariance(&layer.blocks, &covariance, outer_scale_m, &fits[best])?;
        widening = (stated[0][0] / fits[best].covariance[0][0]).max(1.0);
    }
    let mut eps23 = 0.0;
    let mut square = 0.0;
    let mut noise_m2_s2 = 0.0;
    let mut eps23_weights = Vec::with_capacity(fits.len());
    for (fit, (_, probability)) in fits.iter().zip(outer_scales) {
        eps23 += probability * fit.eps23;
        square += probability * (fit.eps23 * fit.eps23 + widening * fit.covariance[0][0]);
        noise_m2_s2 += probability * fit.noise_m2_s2;
        eps23_weights.push(probability * fit.eps23);
    }
    Ok(LayerTurbulence {
        eps23,
        eps23_std: (square - eps23 * eps23).max(0.0).sqrt(),
        noise_m2_s2,
        noise_std_m_s: (noise_m2_s2 * layer.mean_square).sqrt(),
        eps23_weights,
        has_sigmas: layer.has_sigmas,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_end_where_the_beam_turns_back() {
        let of_degrees = |degrees: &[i32]| {
            let mut lines = Vec::new();
            for elevation_deg in degrees {
                let (up, along) = f64::from(*elevation_deg).to_radians().sin_cos();
                lines.push(vec![GateSample {
                    time_s: 0.0,
                    direction: [along, 0.0, up],
                    range_m: 100.0,
                    velocity_m_s: 0.0,
                    noise_std_m_s: 1.0,
                }]);
            }
            let lengths = passes(&lines, true).iter().map(|pass| pass.len()).collect();
            assert_eq!(passes(&lines, false).len(), 1);
            lengths
        };
        let forth_and_back: Vec<usize> = of_degrees(&[10, 20, 30, 30, 20, 10]);
        assert_eq!(forth_and_back, [4, 2]);
        let over_and_over: Vec<usize> = of_degrees(&[10, 20, 30, 10, 20, 30, 10, 20, 30]);
        assert_eq!(over_and_over, [3, 3, 3]);
        let of_one: Vec<usize> = of_degrees(&[10]);
        assert_eq!(of_one, [1]);
    }
}
