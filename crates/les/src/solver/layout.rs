//! How fields lie in memory, and the operators in that order.
//!
//! Memory axis 0 is contiguous. It is x, but for plane flows in which x has one cell: then a direction with many cells takes
//! its place, so that the kernels have long rows to work on. Every array of the solver has one value per cell, `[axis 2][axis
//! 1][axis 0]`: values at the centres, or at the low face of each cell in the component's own direction.
//!
//! Check: the order of plane and spatial flows.

use super::mesh::{Ends, Mesh, Wall};
use super::operators_1d::Operators1d;

/// Number of values along the three memory axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Values along the axes; axis 0 is contiguous.
    pub(crate) n: [usize; 3],
}

impl Shape {
    /// Number of values of a field.
    pub(crate) fn len(self) -> usize {
        self.n.iter().product()
    }

    /// Number of values of a plane at one index of axis 2.
    pub(crate) fn plane(self) -> usize {
        self.n[0] * self.n[1]
    }

    /// Indices along the axes of a place in memory.
    pub(crate) fn index(self, place: usize) -> [usize; 3] {
        [place % self.n[0], place / self.n[0] % self.n[1], place / self.plane()]
    }

    /// Place in memory of indices along the axes.
    pub(crate) fn place(self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.n[1] + j) * self.n[0] + i
    }

    /// Places of the row at indices `j` of axis 1 and `k` of axis 2.
    pub(crate) fn row(self, j: usize, k: usize) -> std::ops::Range<usize> {
        let start = self.place([0, j, k]);
        start..start + self.n[0]
    }
}

/// The operators of the three memory axes.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// Operators of each memory axis.
    pub(crate) line: [Operators1d; 3],
    /// The direction (0, 1, 2 for x, y, z) of each memory axis.
    pub(crate) direction: [usize; 3],
    /// Number of values.
    pub(crate) shape: Shape,
}

impl Layout {
    /// The operators of `mesh`, with the memory axes in the order `direction`, or in the best one.
    pub(crate) fn new(mesh: &Mesh, direction: Option<[usize; 3]>) -> Self {
        let cells = mesh.cells();
        let direction = direction.unwrap_or(match cells {
            [1, ny, nz] if ny > 1 && ny >= nz => [1, 0, 2],
            [1, _, nz] if nz > 1 => [2, 0, 1],
            _ => [0, 1, 2],
        });
        let line = direction.map(|d| Operators1d::new(&mesh.directions()[d]));
        let shape = Shape { n: direction.map(|d| cells[d]) };
        Self { line, direction, shape }
    }

    /// The memory axis of direction `d` (0, 1, 2 for x, y, z).
    pub(crate) fn axis_of(&self, d: usize) -> usize {
        self.direction.iter().position(|&other| other == d).unwrap_or(d)
    }

    /// Velocity along memory axis `component` of the walls at the low and the high end of memory axis `axis` \[m/s\]; zero
    /// where there is no no-slip wall.
    pub(crate) fn wall_velocity_m_s(&self, axis: usize, component: usize) -> [f64; 2] {
        match self.line[axis].ends {
            Ends::Periodic => [0.0; 2],
            Ends::Walls { low, high } => [low, high].map(|wall| match wall {
                Wall::Slip => 0.0,
                Wall::NoSlip { velocity_m_s } => velocity_m_s[self.direction[component]],
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Direction;
    use super::*;

    #[test]
    fn rows_are_long_in_plane_flows() {
        let order = |nx, ny, nz| {
            let d = |n| Direction::periodic(n, 0.0, 1.0);
            Layout::new(&Mesh::new(d(nx), d(ny), d(nz)).unwrap(), None).direction
        };
        assert_eq!(order(8, 16, 32), [0, 1, 2]);
        assert_eq!(order(1, 64, 32), [1, 0, 2]);
        assert_eq!(order(1, 32, 64), [2, 0, 1]);
        assert_eq!(order(32, 1, 64), [0, 1, 2]);
    }
}
