//! A velocity field given at the nodes of a plane mesh, interpolated by the M'4 kernel, (26), (27).
//!
//! The plane is y-z: the field does not depend on x. The interpolation is the tensor product of
//! four weights in y and four in z, taken in the index coordinates of the mesh, so nodes may be
//! stretched. A stencil that reaches beyond the mesh uses the boundary condition of the flow; it is
//! never cut.
//!
//! Check: linear functions are exact, the error of a sampled vortex falls with the third power of
//! the cell, no air crosses a wall.

use super::axis::{Axis, Edges, GHOSTS, Ghost, Side};
use super::wind::Wind;
use crate::error::{Error, check, check_lengths};

/// Nodes and boundaries of a plane mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneMesh {
    /// Lateral coordinates of the nodes \[m\], strictly increasing, four or more.
    pub y_m: Vec<f64>,
    /// Heights of the nodes \[m\], strictly increasing, four or more.
    pub z_m: Vec<f64>,
    /// The two ends in y.
    pub y_edges: Edges,
    /// The two ends in z, such as a wall at the ground below and open air above.
    pub z_edges: Edges,
}

/// A velocity field at one instant on a [`PlaneMesh`]; the time it is asked for makes no
/// difference.
#[derive(Debug, Clone)]
pub struct GridSnapshot {
    y: Axis,
    z: Axis,
    /// Velocities with ghosts, y fastest.
    velocity_m_s: Vec<[f64; 3]>,
    max_gradient_per_s: f64,
}

impl GridSnapshot {
    /// A field with the velocity `velocity_m_s[i_z * y_m.len() + i_y]` = `(u, v, w)` at each node.
    ///
    /// # Errors
    /// [`Error::BadDirection`] for a mesh that cannot be interpolated; [`Error::OutOfRange`] for a
    /// velocity that is not finite and for a number of them that is not that of the nodes.
    pub fn new(mesh: &PlaneMesh, velocity_m_s: &[[f64; 3]]) -> Result<Self, Error> {
        let y = Axis::new("y", &mesh.y_m, mesh.y_edges)?;
        let z = Axis::new("z", &mesh.z_m, mesh.z_edges)?;
        let nodes = (y.nodes() * z.nodes()) as f64;
        check(
            "number of velocities",
            velocity_m_s.len() as f64,
            "one for each node",
            |n| n == nodes,
        )?;
        for &component in velocity_m_s.iter().flatten() {
            check("velocity_m_s", component, "finite", |_| true)?;
        }
        let velocity_m_s = with_ghosts(&y, &z, velocity_m_s);
        let max_gradient_per_s = largest_strain_per_s(&y, &z, &velocity_m_s);
        Ok(Self {
            y,
            z,
            velocity_m_s,
            max_gradient_per_s,
        })
    }

    /// Velocity at `(y, z)`, or `None` outside, (26).
    fn interpolate(&self, y_m: f64, z_m: f64) -> Option<[f64; 3]> {
        let (first_y, weights_y) = self.y.stencil(y_m)?;
        let (first_z, weights_z) = self.z.stencil(z_m)?;
        let mut sum = [0.0; 3];
        for (row, weight_z) in weights_z.iter().enumerate() {
            let start = (first_z + row) * self.y.position_m.len() + first_y;
            let nodes = &self.velocity_m_s[start..start + 4];
            for (velocity, weight_y) in nodes.iter().zip(&weights_y) {
                let weight = weight_y * weight_z;
                for (s, v) in sum.iter_mut().zip(velocity) {
                    *s += weight * v;
                }
            }
        }
        Some(sum)
    }
}

impl Wind for GridSnapshot {
    /// As the trait says; NaN outside the mesh. x is not read.
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        _time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        for (&[_, y_m, z_m], out) in points_m.iter().zip(out_m_s) {
            *out = self.interpolate(y_m, z_m).unwrap_or([f64::NAN; 3]);
        }
        Ok(())
    }

    /// The largest strain rate in the middle of a cell, from differences of its four corners:
    /// second-order accurate, so some percent low where the mesh has fewer than about ten cells
    /// across a core.
    fn max_gradient_per_s(&self, _time_s: f64) -> f64 {
        self.max_gradient_per_s
    }
}

/// The nodes with their ghosts: first beyond the ends in y, then, for the widened rows, beyond the
/// ends in z.
fn with_ghosts(y: &Axis, z: &Axis, velocity_m_s: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let width = y.position_m.len();
    let nodes_y = y.nodes();
    let mut padded = vec![[0.0; 3]; width * z.position_m.len()];
    for (i_z, row) in velocity_m_s.chunks_exact(nodes_y).enumerate() {
        let start = (i_z + GHOSTS) * width;
        padded[start + GHOSTS..start + GHOSTS + nodes_y].copy_from_slice(row);
        for (i, ghost) in ghost_places(y) {
            padded[start + i] =
                std::array::from_fn(|c| ghost_value(ghost, 1, c, |node| row[node][c]));
        }
    }
    for (i, ghost) in ghost_places(z) {
        for column in 0..width {
            padded[i * width + column] = std::array::from_fn(|c| {
                ghost_value(ghost, 2, c, |node| {
                    padded[(node + GHOSTS) * width + column][c]
                })
            });
        }
    }
    padded
}

/// Each ghost of a direction with its padded index.
pub(crate) fn ghost_places(axis: &Axis) -> impl Iterator<Item = (usize, Ghost)> {
    let above = GHOSTS + axis.nodes();
    let [low, high] = axis.ghosts;
    [
        (GHOSTS - 1, low[0]),
        (GHOSTS - 2, low[1]),
        (above, high[0]),
        (above + 1, high[1]),
    ]
    .into_iter()
}

/// Component `component` of the velocity of a ghost beyond an end across direction `across`, from
/// those at the nodes.
pub(crate) fn ghost_value(
    ghost: Ghost,
    across: usize,
    component: usize,
    at: impl Fn(usize) -> f64,
) -> f64 {
    match ghost {
        Ghost::Copy(node) => at(node),
        Ghost::Parabola([a, b, c]) => 3.0 * at(a) - 3.0 * at(b) + at(c),
        Ghost::Image(
            node,
            Side::NoSlipWall {
                velocity_m_s: wall, ..
            },
        ) => 2.0 * wall[component] - at(node),
        Ghost::Image(node, Side::Open | Side::SlipWall { .. }) => {
            if across == component {
                -at(node)
            } else {
                at(node)
            }
        }
    }
}

/// The largest strain rate over the middles of the cells between nodes: the largest eigenvalue of
/// its in-plane part, plus the shear of the axial velocity.
fn largest_strain_per_s(y: &Axis, z: &Axis, velocity_m_s: &[[f64; 3]]) -> f64 {
    let width = y.position_m.len();
    let mut largest = 0.0_f64;
    for j in z.cells() {
        for i in y.cells() {
            let low = j * width + i;
            let high = low + width;
            let [a, b] = [velocity_m_s[low], velocity_m_s[low + 1]];
            let [c, d] = [velocity_m_s[high], velocity_m_s[high + 1]];
            let per_y = 0.5 / (y.position_m[i + 1] - y.position_m[i]);
            let per_z = 0.5 / (z.position_m[j + 1] - z.position_m[j]);
            // Derivatives of u, v, w along y and z.
            let by_y: [f64; 3] = std::array::from_fn(|k| (b[k] - a[k] + d[k] - c[k]) * per_y);
            let by_z: [f64; 3] = std::array::from_fn(|k| (c[k] - a[k] + d[k] - b[k]) * per_z);
            let stretch_y = by_y[1];
            let stretch_z = by_z[2];
            let shear = 0.5 * (by_z[1] + by_y[2]);
            let in_plane =
                0.5 * (stretch_y + stretch_z).abs() + (0.5 * (stretch_y - stretch_z)).hypot(shear);
            largest = largest.max(in_plane + 0.5 * by_y[0].hypot(by_z[0]));
        }
    }
    largest
}
