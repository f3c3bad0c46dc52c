//! A velocity field in three dimensions at one instant, each component at nodes of its own,
//! interpolated by (26), (27).
//!
//! The interpolation is the tensor product of four weights in each direction, taken in the index
//! coordinates of the mesh, as in a plane. Where the mesh ends at open sides nothing is known
//! beyond: NaN. Check: linear fields are exact on staggered and stretched meshes, the error of a
//! sampled vortex falls with the third power of the cell.

use super::axis::{AXIS_NAMES, Axis, Edges, GHOSTS};
use super::grid_wind::{ghost_places, ghost_value};
use super::strain::largest_strain_per_s;
use super::wind::Wind;
use crate::error::{Error, check, check_lengths};

/// One component of the velocity at its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeComponent {
    /// Places of the nodes along x, y, z \[m\], increasing, four or more each.
    pub nodes_m: [Vec<f64>; 3],
    /// Values `[z][y][x]` \[m/s\].
    pub values: Vec<f64>,
}

/// A velocity field at one instant; the time it is asked for makes no difference.
#[derive(Debug, Clone)]
pub struct VolumeSnapshot {
    components: [Padded; 3],
    max_gradient_per_s: f64,
    max_speed_m_s: f64,
}

/// A component with its ghosts.
#[derive(Debug, Clone)]
struct Padded {
    axes: [Axis; 3],
    /// x fastest.
    values: Vec<f64>,
}

impl VolumeSnapshot {
    /// The field of the components u, v, w with the ends of the mesh along x, y, z.
    ///
    /// # Errors
    /// What [`super::GridSnapshot::new`] refuses of a mesh; [`Error::OutOfRange`] for a velocity
    /// that is not finite and for a number of values that is not that of the nodes.
    pub fn new(components: &[VolumeComponent; 3], edges: [Edges; 3]) -> Result<Self, Error> {
        let [u, v, w] = std::array::from_fn(|c| Padded::new(&components[c], edges, c));
        let components = [u?, v?, w?];
        let squared: f64 = components.iter().map(|p| p.largest().powi(2)).sum();
        let max_speed_m_s = squared.sqrt();
        let mut field = Self {
            components,
            max_gradient_per_s: 0.0,
            max_speed_m_s,
        };
        field.max_gradient_per_s = field.steepest_per_s()?;
        Ok(field)
    }

    /// The largest strain rate in the middle of the cells of u, from differences of their corners.
    fn steepest_per_s(&self) -> Result<f64, Error> {
        let nodes_m = self.components[0].axes.each_ref().map(|axis| {
            let cells = axis.cells();
            &axis.position_m[cells.start..=cells.end]
        });
        let [xs, ys, zs] = nodes_m;
        let nx = xs.len();
        let mut largest = 0.0_f64;
        let mut below = self.plane_m_s(xs, ys, zs[0])?;
        for k in 1..zs.len() {
            let above = self.plane_m_s(xs, ys, zs[k])?;
            for j in 1..ys.len() {
                for i in 1..nx {
                    let widths_m = [xs[i] - xs[i - 1], ys[j] - ys[j - 1], zs[k] - zs[k - 1]];
                    let low = (j - 1) * nx + i - 1;
                    let [near, far] = [low, low + nx];
                    // Corners with the index x + 2 y + 4 z.
                    let corners_m_s = [
                        below[near],
                        below[near + 1],
                        below[far],
                        below[far + 1],
                        above[near],
                        above[near + 1],
                        above[far],
                        above[far + 1],
                    ];
                    let gradient = corner_gradient_per_s(&corners_m_s, widths_m);
                    // A corner outside the mesh of another component makes it NaN, which max
                    // ignores.
                    largest = largest.max(largest_strain_per_s(&gradient));
                }
            }
            below = above;
        }
        Ok(largest)
    }

    /// Velocities \[m/s\] at the crossings of the lines `xs_m` and `ys_m` at one height, x fastest.
    fn plane_m_s(&self, xs_m: &[f64], ys_m: &[f64], z_m: f64) -> Result<Vec<[f64; 3]>, Error> {
        let mut points_m = Vec::with_capacity(xs_m.len() * ys_m.len());
        for &y_m in ys_m {
            points_m.extend(xs_m.iter().map(|&x_m| [x_m, y_m, z_m]));
        }
        let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
        self.velocity_into(&points_m, 0.0, &mut velocity_m_s)?;
        Ok(velocity_m_s)
    }

    /// A speed that no node exceeds \[m/s\]: of the largest values of the components.
    pub fn max_speed_m_s(&self) -> f64 {
        self.max_speed_m_s
    }
}

impl Wind for VolumeSnapshot {
    /// As the trait says; NaN outside the mesh.
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        _time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        for (point_m, out) in points_m.iter().zip(out_m_s) {
            for (component, out) in self.components.iter().zip(out) {
                *out = component.at(point_m).unwrap_or(f64::NAN);
            }
        }
        Ok(())
    }

    /// The largest strain rate in the middle of a cell: second-order accurate, so some percent low
    /// where the mesh has fewer than about ten cells across a core.
    fn max_gradient_per_s(&self, _time_s: f64) -> f64 {
        self.max_gradient_per_s
    }
}

/// Velocity gradient `[component][direction]` in the middle of a cell \[1/s\]: the mean difference
/// of its corners, which have the index x + 2 y + 4 z.
fn corner_gradient_per_s(corners_m_s: &[[f64; 3]; 8], widths_m: [f64; 3]) -> [[f64; 3]; 3] {
    // Index step along each direction, and the four corners at its low side.
    const STEP: [usize; 3] = [1, 2, 4];
    const LOW: [[usize; 4]; 3] = [[0, 4, 2, 6], [0, 4, 1, 5], [0, 2, 1, 3]];
    std::array::from_fn(|c| {
        std::array::from_fn(|d| {
            let across = LOW[d].map(|low| corners_m_s[low + STEP[d]][c] - corners_m_s[low][c]);
            0.25 * across.iter().sum::<f64>() / widths_m[d]
        })
    })
}

impl Padded {
    /// `number` is that of the component of the velocity, 0 for u.
    fn new(component: &VolumeComponent, edges: [Edges; 3], number: usize) -> Result<Self, Error> {
        let [x, y, z] =
            std::array::from_fn(|d| Axis::new(AXIS_NAMES[d], &component.nodes_m[d], edges[d]));
        let axes = [x?, y?, z?];
        let [nx, ny, nz] = axes.each_ref().map(Axis::nodes);
        let values = &component.values;
        let allowed = "as many as nodes along x, y and z give";
        check("number of values", values.len() as f64, allowed, |n| {
            n == (nx * ny * nz) as f64
        })?;
        for &value in values {
            check("velocity_m_s", value, "finite", |_| true)?;
        }
        let [px, py, pz] = axes.each_ref().map(|axis| axis.position_m.len());
        let mut padded = vec![0.0; px * py * pz];
        for (row, from) in values.chunks_exact(nx).enumerate() {
            let start = ((row / ny + GHOSTS) * py + row % ny + GHOSTS) * px + GHOSTS;
            padded[start..start + nx].copy_from_slice(from);
        }
        // Ghosts direction by direction; what is made of places that are not there yet, a later
        // direction replaces.
        let strides = [1, px, px * py];
        for d in 0..3 {
            let mut count = [px, py, pz];
            count[d] = 1;
            for (ghost_at, ghost) in ghost_places(&axes[d]) {
                for k in 0..count[2] {
                    for j in 0..count[1] {
                        for i in 0..count[0] {
                            let base = i + j * strides[1] + k * strides[2];
                            padded[base + ghost_at * strides[d]] =
                                ghost_value(ghost, d, number, |node| {
                                    padded[base + (node + GHOSTS) * strides[d]]
                                });
                        }
                    }
                }
            }
        }
        Ok(Self {
            axes,
            values: padded,
        })
    }

    /// Largest magnitude of the values.
    fn largest(&self) -> f64 {
        self.values.iter().fold(0.0, |most, v| most.max(v.abs()))
    }

    /// The value at a place, (26); none outside.
    fn at(&self, point_m: &[f64; 3]) -> Option<f64> {
        let (i, across_x) = self.axes[0].stencil(point_m[0])?;
        let (j, across_y) = self.axes[1].stencil(point_m[1])?;
        let (k, across_z) = self.axes[2].stencil(point_m[2])?;
        let px = self.axes[0].position_m.len();
        let py = self.axes[1].position_m.len();
        let mut sum = 0.0;
        for (dk, weight_z) in across_z.iter().enumerate() {
            for (dj, weight_y) in across_y.iter().enumerate() {
                let start = ((k + dk) * py + j + dj) * px + i;
                let row: f64 = self.values[start..start + 4]
                    .iter()
                    .zip(&across_x)
                    .map(|(v, w)| v * w)
                    .sum();
                sum += weight_z * weight_y * row;
            }
        }
        Some(sum)
    }
}
