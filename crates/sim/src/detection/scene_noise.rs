//! The noise of a scene's velocities, measured on scans of still air: its deviation at each range and on the outer lines, and how
//! many lines and gates apart velocities are independent.
//!
//! The estimator, its regions, speckle and noise are those of the scene; so a rate of false alarms is that of the instrument, not
//! of a bound. Regions of the outer lines lie half outside of the scan, which makes their velocities noisier by a third: taken as
//! quiet as the others, they raise an alarm twice as often as is set. Check: deviations against those of a whole run, outer lines
//! among them; regions that overlap are told.

use crate::Error;
use crate::interpolation::interpolate;
use crate::measure::map::velocities;
use crate::plan::{Plan, Target};
use crate::progress::Observer;
use ndarray::{Array2, s};
use wakescope_estimate::retrieval::ScanMap;

/// Lines of a scan of still air at most, and of all of them together: a few hundred independent velocities at each range, its deviation
/// within some 4 % and that of all ranges within 1 or 2 %. A rate of false alarms near 0.1 grows by half for 3 %.
const LINES: f64 = 96.0;
const LINES_OF_ALL: f64 = 1536.0;
/// Their seed differs from the scene's in one bit: a run of the scene itself does not share their noise.
const SEED_BIT: u64 = 1 << 62;
/// Velocities that are less correlated are taken as independent; the next where one leaves less than so many of a scan. What the last ones leave is
/// alike, which `excess` counts.
const INDEPENDENT: [f64; 7] = [0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0];
const NEEDED: usize = 60;
/// Median of the absolute value of a normal number.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;
/// What is so many deviations off is an outlier.
const FAR: f64 = 5.0;

/// Noise of the velocities of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneNoise {
    /// Ranges of the gates, m.
    pub range_m: Vec<f64>,
    /// Standard deviation of one velocity at each, m/s, on inner lines and without outliers.
    pub sigma_m_s: Vec<f64>,
    /// Deviation over that of inner lines, of the first and last line, of those next to them, and so on.
    pub outer: Vec<f64>,
    /// Lines and gates after which velocities are nearly independent.
    pub stride: (usize, usize),
    /// What correlation is left between velocities so far apart: the variance of their sum over the sum of their variances, at
    /// least 1. A wake is found from sums, so that the test takes variances for that much larger.
    pub excess: f64,
}

impl SceneNoise {
    /// Measures the noise of a planned scene on a few scans of still air.
    ///
    /// # Errors
    /// What the crates refuse.
    pub fn new(plan: &Plan, observer: &dyn Observer) -> Result<Self, Error> {
        let mut scene = plan.file.of_one_scan_in_still_air()?.content;
        scene.seed ^= SEED_BIT;
        let middle_rad = 0.5 * (scene.scan.elevation_min_rad + scene.scan.elevation_max_rad);
        let half_rad = 0.5 * LINES * scene.scan.elevation_step_rad;
        scene.scan.elevation_min_rad = scene.scan.elevation_min_rad.max(middle_rad - half_rad);
        scene.scan.elevation_max_rad = scene.scan.elevation_max_rad.min(middle_rad + half_rad);
        let lines = (scene.scan.elevation_max_rad - scene.scan.elevation_min_rad)
            / scene.scan.elevation_step_rad
            + 1.0;
        scene.scan.realisations = (LINES_OF_ALL / lines).ceil() as usize;
        let still = Plan::without_stages(plan.file.with(scene)?, Target::Map)?;
        let maps = velocities(&still, observer)?;
        Ok(Self::of_maps(
            still.geometry.gate_range_m.clone(),
            &maps,
            plan.geometry.elevation_rad.len(),
        ))
    }

    /// From maps of still air, for scans of so many lines.
    fn of_maps(range_m: Vec<f64>, maps: &[Array2<f64>], scan_lines: usize) -> Self {
        let (lines, gates) = maps.first().map_or((1, 1), Array2::dim);
        let white = whitened(maps, &deviations(maps, 0));
        let power = mean_product(&white, 0, 0);
        let across: Vec<f64> = (0..(lines / 2).max(2))
            .map(|k| mean_product(&white, k, 0) / power)
            .collect();
        let along: Vec<f64> = (0..(gates / 2).max(2))
            .map(|k| mean_product(&white, 0, k) / power)
            .collect();
        let strides = INDEPENDENT.map(|limit| {
            let lines = first_below(&across, limit);
            (lines, first_below(&along, limit))
        });
        let stride = strides
            .into_iter()
            .find(|stride| scan_lines.div_ceil(stride.0) * gates.div_ceil(stride.1) >= NEEDED)
            .unwrap_or((1, 1));
        let excess = variance_factor(&across, stride.0) * variance_factor(&along, stride.1);
        // velocities are alike over as many lines as a region has, half of which are near the end
        let ends = stride.0.min(lines / 4);
        let sigma_m_s = deviations(maps, ends);
        let white = whitened(maps, &sigma_m_s);
        let mut outer = Vec::with_capacity(ends);
        for line in 0..ends {
            let both = white.iter().flat_map(|map| {
                let first = map.row(line).into_iter();
                first.chain(map.row(lines - 1 - line))
            });
            outer.push(mean(both.map(|v| v * v)).sqrt());
        }
        Self {
            range_m,
            outer,
            sigma_m_s,
            stride,
            excess,
        }
    }

    /// Deviations, by range and line, of a map that is the mean of so many `scans`, where it states none or smaller ones: those that
    /// a few scans show of themselves are often far too small. They are those of velocities in sums, with [`excess`](Self::excess).
    pub fn give(&self, map: &mut ScanMap, scans: f64) {
        let mut least_m_s = Vec::with_capacity(map.range_m.len());
        for range_m in &map.range_m {
            let sigma_m_s = interpolate(&self.range_m, &self.sigma_m_s, *range_m);
            least_m_s.push(sigma_m_s * (self.excess / scans.max(1.0)).sqrt());
        }
        let shape = map.velocity_m_s.raw_dim();
        let stated = map.sigma_m_s.take().unwrap_or_else(|| Array2::zeros(shape));
        map.sigma_m_s = Some(Array2::from_shape_fn(shape, |at| {
            let from_end = at.0.min(shape[0] - 1 - at.0);
            let outer = self.outer.get(from_end).copied().unwrap_or(1.0);
            stated[at].max(outer * least_m_s[at.1])
        }));
    }

    /// A scan of still air without noise on the grid of the scene, with the deviations.
    #[must_use]
    pub fn empty_scan(&self, plan: &Plan) -> ScanMap {
        let elevation_rad = plan.geometry.elevation_rad.clone();
        let mut map = ScanMap {
            time_s: vec![f64::NAN; elevation_rad.len()],
            velocity_m_s: Array2::zeros((elevation_rad.len(), self.range_m.len())),
            elevation_rad,
            range_m: self.range_m.clone(),
            sigma_m_s: None,
            fold_m_s: None,
        };
        self.give(&mut map, 1.0);
        map
    }
}

/// Mean product of white velocities that are so many lines and gates apart.
fn mean_product(white: &[Array2<f64>], lines: usize, gates: usize) -> f64 {
    mean(white.iter().flat_map(|map| {
        let near = map.slice(s![..map.nrows() - lines, ..map.ncols() - gates]);
        (&map.slice(s![lines.., gates..]) * &near).into_iter()
    }))
}

/// First distance at which a correlation is below a limit; the number of distances if it is nowhere.
fn first_below(correlation: &[f64], limit: f64) -> usize {
    let mut distances = 1..correlation.len();
    let first = distances.find(|&k| correlation[k] < limit);
    first.unwrap_or(correlation.len())
}

/// Variance of the mean of velocities a stride apart over that of independent ones: the sum of their correlations on both sides of each, as far
/// as these are positive; 1 where there is no velocity so far away.
fn variance_factor(correlation: &[f64], stride: usize) -> f64 {
    let neighbours = correlation.iter().skip(stride).step_by(stride);
    let alike: f64 = neighbours.take_while(|c| **c > 0.0).sum();
    1.0 + 2.0 * alike
}

/// Mean of what is not NaN.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values
        .filter(|x| x.is_finite())
        .fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / count
}

/// Root mean square at each gate, without so many lines at both ends and without outliers, which the median tells.
fn deviations(maps: &[Array2<f64>], ends: usize) -> Vec<f64> {
    let gates = maps.first().map_or(0, Array2::ncols);
    let mut deviations = Vec::with_capacity(gates);
    for gate in 0..gates {
        let mut sizes = Vec::new();
        for map in maps {
            let inner = map.slice(s![ends..map.nrows() - ends, gate]);
            sizes.extend(inner.iter().filter(|v| v.is_finite()).map(|v| v.abs()));
        }
        sizes.sort_by(f64::total_cmp);
        let far = sizes
            .get(sizes.len() / 2)
            .map_or(f64::NAN, |median| FAR * median / NORMAL_MEDIAN);
        let squares = sizes.into_iter().filter(|v| *v < far).map(|v| v * v);
        deviations.push(mean(squares).sqrt());
    }
    deviations
}

/// Velocities over the deviations of their gates; NaN for outliers, which say nothing of the others.
fn whitened(maps: &[Array2<f64>], sigma_m_s: &[f64]) -> Vec<Array2<f64>> {
    let mut white = Vec::with_capacity(maps.len());
    for map in maps {
        white.push(Array2::from_shape_fn(map.raw_dim(), |at| {
            let white = map[at] / sigma_m_s[at.1];
            if white.abs() < FAR { white } else { f64::NAN }
        }));
    }
    white
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Flow, Scene, SceneFile, SnrReference};
    use crate::{Silent, run};

    #[test]
    fn deviations_are_those_of_sums_where_neighbours_that_are_left_are_still_alike() {
        use rand_xoshiro::Xoshiro256PlusPlus;
        use rand_xoshiro::rand_core::{Rng, SeedableRng};
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        // the sum of twelve uniform numbers has variance 1
        let mut normal = || {
            (0..12)
                .map(|_| rng.next_u64() as f64 / 2f64.powi(64) - 0.5)
                .sum::<f64>()
        };
        let (cells, share) = (100, 0.6_f64);
        let mut map = || {
            let mut map = Array2::from_shape_simple_fn((cells, cells), &mut normal);
            // each velocity like the one before it, along lines and gates
            for (i, j) in (0..cells).flat_map(|i| (1..cells).map(move |j| (i, j))) {
                map[[i, j]] = share * map[[i, j - 1]] + (1.0 - share * share).sqrt() * map[[i, j]];
            }
            for (i, j) in (1..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
                map[[i, j]] = share * map[[i - 1, j]] + (1.0 - share * share).sqrt() * map[[i, j]];
            }
            map
        };
        let maps: Vec<Array2<f64>> = (0..40).map(|_| map()).collect();
        let noise = SceneNoise::of_maps((0..cells).map(|gate| gate as f64).collect(), &maps, cells);
        assert_eq!(noise.stride, (6, 6));
        let mut squares = Vec::new();
        for map in &maps {
            let left = map.slice(s![..;6, ..;6]);
            squares.extend(
                left.exact_chunks((4, 4))
                    .into_iter()
                    .map(|block| block.sum().powi(2)),
            );
        }
        let measured = squares.iter().sum::<f64>() / squares.len() as f64;
        let stated = 16.0 * noise.excess;
        // 1.04 in closed form, known to 0.05; without what is left 0.87
        assert!(
            (0.95..1.2).contains(&(stated / measured)),
            "{stated} {measured}"
        );
    }

    #[test]
    fn scans_in_which_all_velocities_are_alike_keep_enough_of_them() {
        use rand_xoshiro::Xoshiro256PlusPlus;
        use rand_xoshiro::rand_core::{Rng, SeedableRng};
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        let (lines, gates, wide) = (40, 20, 12);
        let mut map = || {
            let size = (lines + wide, gates + wide);
            let white = Array2::from_shape_simple_fn(size, || {
                (0..12)
                    .map(|_| rng.next_u64() as f64 / 2f64.powi(64) - 0.5)
                    .sum::<f64>()
            });
            Array2::<f64>::from_shape_fn((lines, gates), |(i, j)| {
                white.slice(s![i..i + wide, j..j + wide]).sum() / wide as f64
            })
        };
        let maps: Vec<Array2<f64>> = (0..60).map(|_| map()).collect();
        let noise = SceneNoise::of_maps((0..gates).map(|gate| gate as f64).collect(), &maps, lines);
        let (by_line, by_gate) = noise.stride;
        let left = lines.div_ceil(by_line) * gates.div_ceil(by_gate);
        // independent ones would be 4 x 2
        assert!(left >= NEEDED, "{:?}", noise.stride);
        // and what they share is counted: sums of all that are left
        let squares = maps
            .iter()
            .map(|map| map.slice(s![..;by_line, ..;by_gate]).sum().powi(2));
        let measured = squares.sum::<f64>() / maps.len() as f64;
        let stated = left as f64 * noise.excess;
        assert!(
            (0.6..2.5).contains(&(stated / measured)),
            "{stated} {measured} {:?}",
            noise.stride
        );
    }

    #[test]
    fn noise_of_a_scene_is_that_of_its_runs_and_overlapping_regions_are_parted() {
        let mut scene = Scene::default();
        scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
        (scene.scan.elevation_min_rad, scene.scan.elevation_max_rad) = (0.08, 0.12);
        (scene.scan.range_min_m, scene.scan.range_max_m) = (340.0, 460.0);
        (scene.scan.pulses_per_line, scene.scan.realisations) = (1, 8);
        let plan =
            |scene: &Scene| Plan::new(SceneFile::new(scene.clone()).unwrap(), Target::Map).unwrap();
        let noise = SceneNoise::new(&plan(&scene), &Silent).unwrap();
        // the air is still, whatever winds the scene adds up
        scene.added_flows = vec![Flow::Uniform {
            lateral_m_s: 4.0,
            vertical_m_s: 1.0,
        }];
        assert_eq!(SceneNoise::new(&plan(&scene), &Silent).unwrap(), noise);
        scene.added_flows.clear();
        (scene.flow, scene.retrieval, scene.scan.realisations) = (Flow::Calm {}, None, 100);
        let std_m_s = run(&plan(&scene), &Silent).unwrap().map.unwrap().std_m_s;
        let of_run =
            (std_m_s.iter().map(|std| std * std).sum::<f64>() / std_m_s.len() as f64).sqrt();
        let found = (noise.sigma_m_s.iter().map(|std| std * std).sum::<f64>()
            / noise.sigma_m_s.len() as f64)
            .sqrt();
        assert!((found / of_run - 1.0).abs() < 0.08, "{found} {of_run}");
        // half of the region of an outer line lies outside of the scan
        let of_lines = |lines: std::ops::Range<usize>| {
            let rows = std_m_s.slice(s![lines, ..]);
            rows.iter().map(|std| std * std).sum::<f64>() / rows.len() as f64
        };
        let last = std_m_s.nrows() - 1;
        let outer =
            (0.5 * (of_lines(0..1) + of_lines(last..last + 1)) / of_lines(8..last - 8)).sqrt();
        assert!(
            noise.outer[0] > 1.2 && (noise.outer[0] / outer - 1.0).abs() < 0.12,
            "{:?} {outer}",
            noise.outer
        );
        assert!(
            noise
                .outer
                .iter()
                .skip(4)
                .all(|ratio| (ratio - 1.0).abs() < 0.12),
            "{:?}",
            noise.outer
        );
        // regions of 2 m on lines half a metre apart, windows of 38 m on gates 3 m apart; a scan that small keeps sixty
        assert!(
            (2..=9).contains(&noise.stride.0) && (3..=16).contains(&noise.stride.1),
            "{:?}",
            noise.stride
        );
        let map = noise.empty_scan(&plan(&scene));
        assert_eq!(map.validate().unwrap(), map.velocity_m_s.len());
    }
}
