//! Sums from which the efficiencies and their errors follow, for both receivers from one set
//! of realisations.
//!
//! Monostatic: mean of q_i = integral of j_i^2. Bistatic: all pairs of different realisations,
//! \[integral of (sum j)^2 - sum of integral j_i^2\] / (n (n - 1)). The irradiance is folded onto
//! one quadrant, which is exact for beams symmetric about the axes; its error is the jackknife over
//! realisations, for which the overlap of one realisation with all others is taken on rings. Check:
//! against the double sum over pairs and the full jackknife.

use crate::screens::grid::Grid;
use crate::screens::kernel::{self, Real};

/// Width of a ring in grid spacings.
const RING: f64 = 2.0;

/// Folding of a grid onto the quadrant x, y >= 0 (or no folding for displaced beams), and rings
/// about the axis.
#[derive(Debug)]
pub(crate) struct Folding {
    grid: Grid,
    folded: bool,
    /// Points of the folded grid along x and y.
    size: [usize; 2],
    /// Ring of each folded point.
    ring: Vec<u16>,
    /// Points of the full grid in each ring.
    ring_points: Vec<f64>,
}

impl Folding {
    /// Onto the quadrant, for beams symmetric about both axes, or the grid as it is, for
    /// displaced beams.
    pub(crate) fn new(grid: &Grid, folded: bool) -> Self {
        let Grid { nx, ny, dx_m, dy_m } = *grid;
        let size = if folded {
            [nx / 2 + 1, ny / 2 + 1]
        } else {
            [nx, ny]
        };
        let unit = RING * dx_m.min(dy_m);
        let rings = (0.5 * grid.smallest_width_m() / unit).ceil() as usize + 1;
        let mut this = Self {
            grid: *grid,
            folded,
            size,
            ring: Vec::new(),
            ring_points: vec![0.0; rings],
        };
        for y in 0..size[1] {
            for x in 0..size[0] {
                let radius_m = this.offset_m(nx, dx_m, x).hypot(this.offset_m(ny, dy_m, y));
                let ring = ((radius_m / unit) as usize).min(rings - 1);
                this.ring.push(ring as u16);
                this.ring_points[ring] += this.multiplicity(x, y);
            }
        }
        this
    }

    /// Distance of point `i` of the folded grid, along an axis of `n` points, from the axis \[m\].
    fn offset_m(&self, n: usize, spacing_m: f64, i: usize) -> f64 {
        if self.folded {
            i as f64 * spacing_m
        } else {
            Grid::offset_m(n, spacing_m, i)
        }
    }

    pub(crate) fn points(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Points of the full grid that fold onto (x, y).
    fn multiplicity(&self, x: usize, y: usize) -> f64 {
        if !self.folded {
            return 1.0;
        }
        multiplicity_along(x, self.grid.nx) * multiplicity_along(y, self.grid.ny)
    }

    /// Adds row `y` of the full grid to the folded plane.
    pub(crate) fn add_row<T: Real>(&self, y: usize, row: &[T], plane: &mut [T]) {
        let width = self.size[0];
        if !self.folded {
            let target = &mut plane[y * width..(y + 1) * width];
            for (t, r) in target.iter_mut().zip(row) {
                *t = *t + *r;
            }
            return;
        }
        let fy = y.abs_diff(self.grid.ny / 2);
        let target = &mut plane[fy * width..(fy + 1) * width];
        let centre = self.grid.nx / 2;
        for (t, r) in target.iter_mut().zip(&row[centre..]) {
            *t = *t + *r;
        }
        for (t, r) in target[1..].iter_mut().zip(row[..centre].iter().rev()) {
            *t = *t + *r;
        }
    }

    /// Integral over the full grid of the product of two symmetrised planes (in points,
    /// without the area).
    pub(crate) fn overlap<T: Real>(&self, a: &[T], b: &[T]) -> f64 {
        let width = self.size[0];
        let mut sum = 0.0;
        for y in 0..self.size[1] {
            let row = y * width..(y + 1) * width;
            let a = &a[row.clone()];
            let b = &b[row];
            let whole = kernel::dot(a, b);
            if !self.folded {
                sum += whole;
                continue;
            }
            // Most columns are two of the full grid; the first and, for even sizes,
            // the last are one.
            let mut line = 0.5 * whole + 0.5 * (a[0] * b[0]).wide();
            let last = width - 1;
            if self.grid.nx.is_multiple_of(2) {
                line += 0.5 * (a[last] * b[last]).wide();
            }
            sum += line / self.multiplicity(0, y);
        }
        sum
    }

    /// Sums of a folded plane over the rings.
    pub(crate) fn ring_sums<T: Real>(&self, plane: &[T]) -> Vec<f64> {
        let mut sums = vec![0.0; self.ring_points.len()];
        for (value, &ring) in plane.iter().zip(&self.ring) {
            sums[usize::from(ring)] += value.wide();
        }
        sums
    }

    /// Overlap of one sample with all others on rings (per point, both ways), from its ring sums
    /// and those of all samples. `other` is the index of the ring sums of j_B: 0 for aligned beams.
    fn overlap_with_others(&self, sample: &Sample, sums: &[Vec<f64>; 2], other: usize) -> f64 {
        let mut overlap = 0.0;
        for (i, points) in self.ring_points.iter().enumerate() {
            if *points > 0.0 {
                let t = f64::from(sample.rings[0][i]);
                let b = f64::from(sample.rings[other][i]);
                overlap += (t * (sums[other][i] - b) + b * (sums[0][i] - t)) / points;
            }
        }
        overlap
    }
}

/// Number of points of the full grid, along an axis of `n` points, that fold onto point `i`.
fn multiplicity_along(i: usize, n: usize) -> f64 {
    if i > 0 && i < n.div_ceil(2) { 2.0 } else { 1.0 }
}

/// An independent sample (a realisation or an antithetic pair) at one range. Overlaps are in units
/// of the efficiency.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    /// eta of the same path, integral of j_T j_B.
    pub(crate) same_path: f64,
    /// Its values for the single realisations of this sample (two if antithetic).
    pub(crate) single: Vec<f64>,
    /// The same for the symmetrised planes: subtracted from the square of the sum.
    pub(crate) folded: f64,
    /// Ring sums of j_T and (displaced beams only) j_B.
    pub(crate) rings: [Vec<f32>; 2],
    /// Fraction of the power that the border absorbed.
    pub(crate) lost: f64,
}

/// Mean and variance of a list; the variance of fewer than two values is NaN.
pub(crate) fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let squares: f64 = values.map(|v| (v - mean) * (v - mean)).sum();
    let variance = if n > 1.0 {
        squares / (n - 1.0)
    } else {
        f64::NAN
    };
    (mean, variance)
}

/// Bistatic efficiency of all pairs and its jackknife standard error, NaN for fewer
/// than three samples.
///
/// `total` is the overlap of the two summed planes, `scale` turns a product of ring sums (per
/// point) into an efficiency.
pub(crate) fn bistatic(
    samples: &[Sample],
    total: f64,
    folding: &Folding,
    scale: f64,
) -> (f64, f64) {
    let n = samples.len() as f64;
    let own: f64 = samples.iter().map(|s| s.folded).sum();
    let mean = (total - own) / (n * (n - 1.0));
    if samples.len() < 3 {
        return (mean, f64::NAN);
    }
    let mut sums = [(); 2].map(|()| vec![0.0; folding.ring_points.len()]);
    for sample in samples {
        for (sum, rings) in sums.iter_mut().zip(&sample.rings) {
            for (s, r) in sum.iter_mut().zip(rings) {
                *s += f64::from(*r);
            }
        }
    }
    // Aligned beams have the same irradiance.
    let other = usize::from(!samples[0].rings[1].is_empty());
    let mut jackknifed = Vec::with_capacity(samples.len());
    for sample in samples {
        // The overlap of a sample with itself, which rings would smooth, is in neither term.
        let with_others = folding.overlap_with_others(sample, &sums, other) * scale;
        jackknifed.push((total - own - with_others) / ((n - 1.0) * (n - 2.0)));
    }
    let (_, variance) = mean_and_variance(jackknifed.iter().copied());
    // Jackknife: (n - 1)/n sum (theta_i - mean)^2 = (n - 1)^2/n variance.
    (mean, (variance / n).sqrt() * (n - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(grid: &Grid, width: f64, height: f64) -> Vec<f64> {
        let mut out = Vec::new();
        for y in 0..grid.ny {
            for x in 0..grid.nx {
                let px = Grid::offset_m(grid.nx, grid.dx_m, x);
                let py = Grid::offset_m(grid.ny, grid.dy_m, y);
                out.push(height * (-(px * px + py * py) / (width * width)).exp());
            }
        }
        out
    }

    #[test]
    fn folded_overlap_is_the_overlap_for_symmetric_planes() {
        for (nx, ny) in [(32, 24), (31, 25)] {
            let grid = Grid {
                nx,
                ny,
                dx_m: 1.0,
                dy_m: 1.0,
            };
            let a = plane(&grid, 6.0, 1.0);
            let b = plane(&grid, 9.0, 2.0);
            let exact: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            for folding in [Folding::new(&grid, true), Folding::new(&grid, false)] {
                let mut planes = [vec![0.0; folding.points()], vec![0.0; folding.points()]];
                for (full, plane) in [&a, &b].iter().zip(&mut planes) {
                    for y in 0..ny {
                        folding.add_row(y, &full[y * nx..(y + 1) * nx], plane);
                    }
                }
                let found = folding.overlap(&planes[0], &planes[1]);
                assert!(
                    (found / exact - 1.0).abs() < 1e-12,
                    "{nx} {:?}: {found} {exact}",
                    folding.size
                );
                assert_eq!(folding.ring_points.iter().sum::<f64>(), (nx * ny) as f64);
            }
        }
    }

    #[test]
    fn pairs_and_jackknife_agree_with_the_double_sums() {
        let grid = Grid {
            nx: 48,
            ny: 48,
            dx_m: 1.0,
            dy_m: 1.0,
        };
        let folding = Folding::new(&grid, true);
        let planes: Vec<Vec<f64>> = (0..7)
            .map(|i| {
                plane(
                    &grid,
                    9.0 + 0.7 * f64::from(i),
                    1.0 + 0.2 * f64::from(i % 3),
                )
            })
            .collect();
        let mut total = vec![0.0; folding.points()];
        let mut samples = Vec::new();
        for p in &planes {
            let mut own = vec![0.0; folding.points()];
            for y in 0..48 {
                folding.add_row(y, &p[y * 48..(y + 1) * 48], &mut own);
                folding.add_row(y, &p[y * 48..(y + 1) * 48], &mut total);
            }
            let rings = folding.ring_sums(&own).iter().map(|&v| v as f32).collect();
            let folded = folding.overlap(&own, &own);
            samples.push(Sample {
                same_path: folded,
                single: vec![folded],
                folded,
                rings: [rings, Vec::new()],
                lost: 0.0,
            });
        }
        let (mean, error) = bistatic(&samples, folding.overlap(&total, &total), &folding, 1.0);
        let pairs = |left_out: Option<usize>| {
            let mut sum = 0.0;
            let mut count = 0.0;
            for i in (0..7).filter(|i| Some(*i) != left_out) {
                for j in (0..7).filter(|j| Some(*j) != left_out && *j != i) {
                    sum += planes[i]
                        .iter()
                        .zip(&planes[j])
                        .map(|(a, b)| a * b)
                        .sum::<f64>();
                    count += 1.0;
                }
            }
            sum / count
        };
        assert!((mean / pairs(None) - 1.0).abs() < 1e-12);
        let left_out: Vec<f64> = (0..7).map(|i| pairs(Some(i))).collect();
        let centre = left_out.iter().sum::<f64>() / 7.0;
        let exact = (left_out.iter().map(|v| (v - centre).powi(2)).sum::<f64>() * 6.0 / 7.0).sqrt();
        assert!((error / exact - 1.0).abs() < 0.02, "{error} {exact}");
    }

    /// A bright speckle meets itself far more than it meets others: taken as it is in one place and
    /// on rings in another, this overlap cancels the scatter.
    #[test]
    fn few_realisations_with_bright_speckles_state_their_error() {
        let grid = Grid {
            nx: 48,
            ny: 48,
            dx_m: 1.0,
            dy_m: 1.0,
        };
        let folding = Folding::new(&grid, false);
        let speckled = |i: usize| {
            let height = 3 * i % 7;
            let angle = 2.4 * i as f64;
            let a = height as f64 / 7.0;
            let mut out = plane(&grid, 9.0, 0.8 + 0.4 * a);
            for (at, value) in out.iter_mut().enumerate() {
                let x = Grid::offset_m(48, 1.0, at % 48) - 4.0 * angle.cos();
                let y = Grid::offset_m(48, 1.0, at / 48) - 4.0 * angle.sin();
                *value += 7.0 * (0.5 + a) * (-(x * x + y * y) / 4.0).exp();
            }
            out
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let planes: Vec<Vec<f64>> = (0..5).map(speckled).collect();
        let mut total = vec![0.0; folding.points()];
        planes
            .iter()
            .for_each(|p| total.iter_mut().zip(p).for_each(|(t, v)| *t += v));
        let sample = |p: &Vec<f64>| {
            let rings = folding.ring_sums(p).iter().map(|&v| v as f32).collect();
            let own = dot(p, p);
            Sample {
                same_path: own,
                single: vec![own],
                folded: own,
                rings: [rings, Vec::new()],
                lost: 0.0,
            }
        };
        let samples: Vec<Sample> = planes.iter().map(sample).collect();
        let (_, error) = bistatic(&samples, dot(&total, &total), &folding, 1.0);
        let pairs = |left_out: usize| {
            let others = || (0..5).filter(move |i| *i != left_out);
            let of = |i: usize| {
                others()
                    .filter(move |j| *j != i)
                    .map(|j| dot(&planes[i], &planes[j]))
                    .sum::<f64>()
            };
            others().map(of).sum::<f64>() / 12.0
        };
        let (_, variance) = mean_and_variance((0..5).map(pairs).collect::<Vec<_>>().into_iter());
        let exact = (variance / 5.0).sqrt() * 4.0;
        // Rings do not see that speckles miss each other: a little too large, and never too small.
        assert!((0.95..1.4).contains(&(error / exact)), "{error} {exact}");
    }
}
