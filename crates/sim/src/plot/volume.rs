//! A field on a rectilinear mesh and rays through it: where does a ray cross a level, and how does the surface lie there.
//!
//! Between the points the field is the trilinear interpolant; a crossing is found by steps of half the smallest cell and
//! bisection. Rays need no list of triangles, and the surfaces are those of the interpolant itself. Blocks of cells whose
//! values leave all levels on one side are passed in one step: most of a wake is such air.
//! Check: the interpolant is exact for products of lines; a sphere is met at its radius with its own normal; levels that no
//! block can be passed for change nothing.

use crate::io::{OutputError, OutputResult};

/// A field on a rectilinear mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Positions of the points along x, y, z \[m\], increasing, at least two each.
    pub axis_m: [Vec<f64>; 3],
    /// Values `[k][j][i]`, x fastest.
    pub values: Vec<f32>,
    /// Bins of equal width over each axis and the interval in which each begins.
    bins: [Bins; 3],
    /// Half of the smallest interval \[m\].
    step_m: f64,
    /// Smallest and largest value of each block of cells, in the order of the values.
    blocks: Vec<[f32; 2]>,
}

/// What a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crossing {
    /// Distance along the ray \[m\].
    pub(crate) at_m: f64,
    /// Which of the levels.
    pub(crate) level: usize,
    /// Unit normal, down the gradient.
    pub(crate) normal: [f64; 3],
}

#[derive(Debug, Clone, PartialEq)]
struct Bins {
    per_m: f64,
    first: Vec<u32>,
}

const BISECTIONS: usize = 12;
/// Cells of a block along each axis.
const BLOCK: usize = 2;

/// Cell of a position, and the fraction of it that lies below, along each axis.
type Place = [(usize, f64); 3];

impl Volume {
    /// A field with the values in the order z, y, x, x fastest.
    ///
    /// # Errors
    /// Axes with fewer than two points or that do not increase, another number of values than points.
    pub fn new(axis_m: [Vec<f64>; 3], values: Vec<f32>) -> OutputResult<Self> {
        for (name, axis) in ["x axis", "y axis", "z axis"].into_iter().zip(&axis_m) {
            let increasing = axis.windows(2).all(|w| w[0] < w[1]) && axis.iter().all(|a| a.is_finite());
            if axis.len() < 2 || !increasing {
                return Err(OutputError::value(name, axis.len(), "at least two finite, increasing positions"));
            }
        }
        let points = axis_m.iter().map(Vec::len).product::<usize>();
        if values.len() != points {
            return Err(OutputError::value("values", values.len(), format!("one for each of the {points} points")));
        }
        let gaps = axis_m.iter().flat_map(|axis| axis.windows(2).map(|w| w[1] - w[0]));
        let step_m = 0.5 * gaps.fold(f64::INFINITY, f64::min);
        let bins = axis_m.each_ref().map(|axis| Bins::new(axis));
        let blocks = extremes(axis_m.each_ref().map(Vec::len), &values);
        Ok(Self { axis_m, values, bins, step_m, blocks })
    }

    /// Low and high corner \[m\].
    pub(crate) fn corners_m(&self) -> [[f64; 3]; 2] {
        [self.axis_m.each_ref().map(|axis| axis[0]), self.axis_m.each_ref().map(|axis| axis[axis.len() - 1])]
    }

    /// The interpolant; positions outside are moved to the nearest face.
    pub(crate) fn at(&self, at_m: [f64; 3]) -> f64 {
        self.value(self.place(at_m))
    }

    fn place(&self, [x_m, y_m, z_m]: [f64; 3]) -> Place {
        // Written out: a closure for `from_fn` is a call of its own, and this is most of the work of a ray.
        let ([x, y, z], [x_axis, y_axis, z_axis]) = (&self.bins, &self.axis_m);
        [x.place(x_axis, x_m), y.place(y_axis, y_m), z.place(z_axis, z_m)]
    }

    fn value(&self, [x, y, z]: Place) -> f64 {
        let [nx, ny, _] = self.axis_m.each_ref().map(Vec::len);
        let line = |j: usize, k: usize| {
            let start = ((z.0 + k) * ny + y.0 + j) * nx + x.0;
            let (a, b) = (f64::from(self.values[start]), f64::from(self.values[start + 1]));
            a + x.1 * (b - a)
        };
        let plane = |k: usize| {
            let (a, b) = (line(0, k), line(1, k));
            a + y.1 * (b - a)
        };
        let (a, b) = (plane(0), plane(1));
        a + z.1 * (b - a)
    }

    /// Where the ray `from + t along` enters and leaves the mesh.
    pub(crate) fn span_m(&self, from_m: [f64; 3], along: [f64; 3]) -> Option<(f64, f64)> {
        let [low, high] = self.corners_m();
        let mut span = (f64::NEG_INFINITY, f64::INFINITY);
        for d in 0..3 {
            if along[d].abs() < 1e-12 {
                if from_m[d] < low[d] || from_m[d] > high[d] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low[d] - from_m[d]) / along[d], (high[d] - from_m[d]) / along[d]);
            span = (span.0.max(a.min(b)), span.1.min(a.max(b)));
        }
        (span.0 < span.1).then_some(span)
    }

    /// Calls `met` for each crossing of a level along the ray, in order, until it returns false.
    pub(crate) fn cast(
        &self,
        from_m: [f64; 3],
        along: [f64; 3],
        levels: &[f64],
        mut met: impl FnMut(Crossing) -> bool,
    ) {
        let Some((start, end)) = self.span_m(from_m, along) else { return };
        let on_ray = |t: f64| [from_m[0] + t * along[0], from_m[1] + t * along[1], from_m[2] + t * along[2]];
        let step = |number: f64| (start + number * self.step_m).min(end);
        let mut place = self.place(on_ray(start));
        let (mut number, mut value) = (0.0, self.value(place));
        while step(number) < end {
            let block =
                if self.passes(place, levels) { Some(BLOCK) } else { self.cell_passes(place, levels).then_some(1) };
            if let Some(block) = block {
                let left = (self.leaves_m(place, block, from_m, along) - start) / self.step_m - 1e-6;
                number = left.floor().max(number);
                if step(number) >= end {
                    return;
                }
            }
            let (t, next) = (step(number), step(number + 1.0));
            place = self.place(on_ray(next));
            let new = self.value(place);
            let mut crossed: Vec<(f64, usize)> = Vec::new();
            for (level, &wanted) in levels.iter().enumerate() {
                if (value < wanted) != (new < wanted) {
                    crossed.push((self.bisect(on_ray, (t, next), wanted, value < wanted), level));
                }
            }
            crossed.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (at_m, level) in crossed {
                if !met(Crossing { at_m, level, normal: self.normal(on_ray(at_m)) }) {
                    return;
                }
            }
            (number, value) = (number + 1.0, new);
        }
    }

    /// Whether all values of the block of a cell lie on the same side of each level.
    fn passes(&self, place: Place, levels: &[f64]) -> bool {
        let [nx, ny, _] = self.axis_m.each_ref().map(|axis| (axis.len() - 1).div_ceil(BLOCK));
        let [i, j, k] = place.map(|(cell, _)| cell / BLOCK);
        let [low, high] = self.blocks[(k * ny + j) * nx + i].map(f64::from);
        levels.iter().all(|level| (low < *level) == (high < *level))
    }

    /// Whether the values at the corners of a cell lie on the same side of each level.
    fn cell_passes(&self, [x, y, z]: Place, levels: &[f64]) -> bool {
        let [nx, ny, _] = self.axis_m.each_ref().map(Vec::len);
        let start = (z.0 * ny + y.0) * nx + x.0;
        let mut ends = [f32::INFINITY, f32::NEG_INFINITY];
        for row in [start, start + nx, start + nx * ny, start + nx * ny + nx] {
            for value in &self.values[row..row + 2] {
                ends = with_value(ends, *value);
            }
        }
        let [low, high] = ends.map(f64::from);
        levels.iter().all(|level| (low < *level) == (high < *level))
    }

    /// Where the ray leaves the block of so many cells that a cell lies in \[m\].
    fn leaves_m(&self, place: Place, block: usize, from_m: [f64; 3], along: [f64; 3]) -> f64 {
        (0..3).filter(|d| along[*d].abs() > 1e-12).fold(f64::INFINITY, |least, d| {
            let axis = &self.axis_m[d];
            let first = place[d].0 / block * block;
            let side = if along[d] > 0.0 { (first + block).min(axis.len() - 1) } else { first };
            least.min((axis[side] - from_m[d]) / along[d])
        })
    }

    fn bisect(&self, on_ray: impl Fn(f64) -> [f64; 3], span: (f64, f64), wanted: f64, below: bool) -> f64 {
        let (mut low, mut high) = span;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if (self.at(on_ray(middle)) < wanted) == below { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Unit vector down the gradient, by differences over a small cell; the upright one where there is none.
    fn normal(&self, at_m: [f64; 3]) -> [f64; 3] {
        let reach = 2.0 * self.step_m;
        let slope: [f64; 3] = std::array::from_fn(|d| {
            let (mut low, mut high) = (at_m, at_m);
            low[d] -= reach;
            high[d] += reach;
            self.at(low) - self.at(high)
        });
        let length = slope.iter().map(|s| s * s).sum::<f64>().sqrt();
        if length > 0.0 { slope.map(|s| s / length) } else { [0.0, 0.0, 1.0] }
    }
}

/// Smallest and largest value with one more; NaN has no side of any level and is never passed.
#[inline]
fn with_value([low, high]: [f32; 2], value: f32) -> [f32; 2] {
    if value.is_nan() { [f32::NEG_INFINITY, f32::INFINITY] } else { [low.min(value), high.max(value)] }
}

/// Smallest and largest value of each block of cells.
fn extremes([nx, ny, nz]: [usize; 3], values: &[f32]) -> Vec<[f32; 2]> {
    let [bx, by, bz] = [nx, ny, nz].map(|points| (points - 1).div_ceil(BLOCK));
    let points = |block: usize, count: usize| block * BLOCK..=((block + 1) * BLOCK).min(count - 1);
    let mut out = Vec::with_capacity(bx * by * bz);
    for block in 0..bx * by * bz {
        let mut ends = [f32::INFINITY, f32::NEG_INFINITY];
        for k in points(block / (bx * by), nz) {
            for j in points(block / bx % by, ny) {
                let row = (k * ny + j) * nx;
                let cells = points(block % bx, nx);
                for value in &values[row + cells.start()..=row + cells.end()] {
                    ends = with_value(ends, *value);
                }
            }
        }
        out.push(ends);
    }
    out
}

impl Bins {
    fn new(axis: &[f64]) -> Self {
        let count = 8 * axis.len();
        let width = (axis[axis.len() - 1] - axis[0]) / count as f64;
        let first = (0..count)
            .map(|bin| {
                let low = axis[0] + bin as f64 * width;
                axis.partition_point(|a| *a <= low).clamp(1, axis.len() - 1) as u32 - 1
            })
            .collect();
        Self { per_m: 1.0 / width, first }
    }

    /// Interval of a position and the fraction of it that lies below.
    #[inline]
    fn place(&self, axis: &[f64], at_m: f64) -> (usize, f64) {
        let last = axis.len() - 2;
        let bin = ((at_m - axis[0]) * self.per_m).clamp(0.0, (self.first.len() - 1) as f64) as usize;
        let mut index = self.first[bin] as usize;
        while index < last && axis[index + 1] <= at_m {
            index += 1;
        }
        let fraction = (at_m - axis[index]) / (axis[index + 1] - axis[index]);
        (index, fraction.clamp(0.0, 1.0))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    fn axis(n: usize, stretch: f64) -> Vec<f64> {
        (0..n).map(|i| i as f64 / (n - 1) as f64).map(|s| -1.0 + 2.0 * s.powf(stretch)).collect()
    }

    /// Minus the distance from the origin.
    pub(crate) fn cone(n: usize) -> Volume {
        let axes = [axis(n, 1.0), axis(n + 5, 1.1), axis(n + 9, 0.9)];
        let mut values = Vec::new();
        for z in &axes[2] {
            for y in &axes[1] {
                for x in &axes[0] {
                    values.push(-(x * x + y * y + z * z).sqrt() as f32);
                }
            }
        }
        Volume::new(axes, values).unwrap()
    }

    #[test]
    fn the_interpolant_is_exact_for_products_of_lines_on_unequal_steps() {
        let axes = [axis(5, 1.0), axis(7, 1.7), axis(9, 0.6)];
        let field = |x: f64, y: f64, z: f64| (1.0 + x) * (2.0 - y) * (0.5 + z);
        let mut values = Vec::new();
        for z in &axes[2] {
            for y in &axes[1] {
                values.extend(axes[0].iter().map(|x| field(*x, *y, *z) as f32));
            }
        }
        let volume = Volume::new(axes, values).unwrap();
        for i in 0..200 {
            let [x, y, z] = [0.618, 0.755, 0.57].map(|step| -1.0 + 2.0 * (i as f64 * step).fract());
            assert!((volume.at([x, y, z]) - field(x, y, z)).abs() < 1e-6, "{x} {y} {z}");
        }
        assert!((volume.at([9.0, 9.0, 9.0]) - field(1.0, 1.0, 1.0)).abs() < 1e-6, "outside: the nearest face");
    }

    #[test]
    fn rays_meet_a_sphere_at_its_radius_with_its_normal() {
        let volume = cone(60);
        let along = [0.6, 0.48, -0.64];
        let from = [-1.8 + 0.1, -1.44, 1.92];
        let mut met = Vec::new();
        volume.cast(from, along, &[-0.5, -0.8], |crossing| {
            met.push(crossing);
            true
        });
        assert_eq!(met.iter().map(|c| c.level).collect::<Vec<_>>(), [1, 0, 0, 1]);
        for crossing in met {
            let radius = [0.5, 0.8][crossing.level];
            let at: Vec<f64> = (0..3).map(|d| from[d] + crossing.at_m * along[d]).collect();
            let distance = at.iter().map(|a| a * a).sum::<f64>().sqrt();
            assert!((distance - radius).abs() < 1e-3, "{distance} for {radius}");
            let cosine: f64 = (0..3).map(|d| crossing.normal[d] * at[d] / distance).sum();
            assert!(cosine > 0.999, "{cosine}");
        }
    }

    #[test]
    fn blocks_are_passed_without_losing_a_crossing() {
        let whole = cone(37);
        let mut slow = whole.clone();
        slow.blocks.iter_mut().for_each(|block| *block = [f32::NEG_INFINITY, f32::INFINITY]);
        for ray in 0..200 {
            let [a, b, c] = [0.618, 0.755, 0.57].map(|part| 2.0 * (f64::from(ray) * part).fract() - 1.0);
            let length = (a * a + b * b + 1.0_f64).sqrt();
            let along = [a / length, b / length, if ray % 2 == 0 { 1.0 } else { -1.0 } / length];
            let meet = |volume: &Volume| {
                let mut met = Vec::new();
                volume.cast([c, -a, 0.3 * b], along, &[-0.5, -0.8, -1.1], |crossing| {
                    met.push(crossing);
                    true
                });
                met
            };
            assert_eq!(meet(&whole), meet(&slow), "ray {ray}");
        }
    }

    #[test]
    fn axes_and_values_that_do_not_fit_are_refused() {
        let line = || vec![0.0, 1.0];
        assert!(Volume::new([line(), line(), vec![0.0]], vec![0.0; 4]).is_err());
        assert!(Volume::new([line(), line(), vec![1.0, 0.0]], vec![0.0; 8]).is_err());
        assert!(Volume::new([line(), line(), line()], vec![0.0; 7]).is_err());
    }
}
