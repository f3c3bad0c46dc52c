//! How fields lie in memory, and the operators in that order.
//!
//! Memory axis 0 is contiguous. It is x, unless another direction gives the kernels longer rows to
//! work on: y if it is longer and its cells are equal and periodic, so that the pressure solver has
//! a Fourier transform there, too; in a plane flow the direction with many cells. Every array of
//! the solver has one value per cell, `[axis 2][axis 1][axis 0]`: values at the centres, or at the
//! low face of each cell in the component's own direction.
//!
//! Check: the order of plane and spatial flows.

use std::sync::Arc;

use super::mesh::{Ends, Mesh, Wall};
use super::operators_1d::Operators1d;
pub(crate) use super::shape::Shape;
use super::slabs::Slabs;
use crate::Error;
use crate::ranks::{Ranks, Single, TimedRanks};

/// The operators of the three memory axes.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// Operators of each memory axis.
    pub(crate) line: [Operators1d; 3],
    /// The direction (0, 1, 2 for x, y, z) of each memory axis.
    pub(crate) direction: [usize; 3],
    /// Number of values, and those that this rank holds.
    pub(crate) shape: Shape,
    /// What the ranks exchange.
    pub(crate) slabs: Slabs,
}

impl Layout {
    /// The operators of `mesh` in one process, with the memory axes in the best order.
    pub(crate) fn new(mesh: &Mesh) -> Self {
        Self::in_order(mesh, order(mesh))
    }

    /// The same with the directions of the memory axes given.
    pub(crate) fn in_order(mesh: &Mesh, direction: [usize; 3]) -> Self {
        let line = direction.map(|d| Operators1d::new(&mesh.directions()[d]));
        let shape = Shape::whole(direction.map(|d| mesh.cells()[d]));
        Self {
            line,
            direction,
            shape,
            slabs: Slabs {
                ranks: Arc::new(TimedRanks::new(Arc::new(Single))),
                shape,
            },
        }
    }

    /// The same for one of several ranks.
    ///
    /// # Errors
    /// [`Error::TooManyRanks`].
    pub(crate) fn shared(self, ranks: Arc<dyn Ranks>) -> Result<Self, Error> {
        let slabs = Slabs::new(ranks, self.shape.n)?;
        Ok(Self {
            shape: slabs.shape,
            slabs,
            ..self
        })
    }

    /// The memory axis of direction `d` (0, 1, 2 for x, y, z).
    pub(crate) fn axis_of(&self, d: usize) -> usize {
        self.direction
            .iter()
            .position(|&other| other == d)
            .unwrap_or(d)
    }

    /// Velocity along memory axis `component` of the walls at the low and the high end of memory
    /// axis `axis` \[m/s\]; zero where there is no no-slip wall.
    pub(crate) fn wall_velocity_m_s(&self, axis: usize, component: usize) -> [f64; 2] {
        match self.line[axis].ends {
            Ends::Periodic => [0.0; 2],
            Ends::Walls { low, high } => [low, high].map(|wall| match wall {
                Wall::Slip => 0.0,
                Wall::NoSlip { velocity_m_s } => velocity_m_s[self.direction[component]],
            }),
        }
    }

    /// What the velocity of the walls of memory axis `axis` adds to an operator along it on a
    /// component, from the operator's coefficients of the two walls.
    pub(crate) fn wall_source(
        &self,
        axis: usize,
        component: usize,
        walls: &[[f64; 2]],
    ) -> Vec<f64> {
        let [low, high] = self.wall_velocity_m_s(axis, component);
        walls
            .iter()
            .map(|wall| wall[0] * low + wall[1] * high)
            .collect()
    }
}

/// The best order of the directions in memory.
fn order(mesh: &Mesh) -> [usize; 3] {
    match mesh.cells() {
        [1, ny, nz] if ny > 1 && ny >= nz => [1, 0, 2],
        [1, _, nz] if nz > 1 => [2, 0, 1],
        [nx, ny, _] if ny > nx && Operators1d::new(&mesh.directions()[1]).is_fourier() => [1, 0, 2],
        _ => [0, 1, 2],
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::{Direction, Spread};
    use super::*;

    #[test]
    fn rows_are_long_where_that_costs_no_transform() {
        let d = |n| Direction::periodic(n, 0.0, 1.0);
        let order = |nx, ny, nz| Layout::new(&Mesh::new(d(nx), d(ny), d(nz)).unwrap()).direction;
        assert_eq!(order(8, 16, 32), [1, 0, 2]);
        assert_eq!(order(16, 16, 32), [0, 1, 2]);
        let sine = d(16).stretched(Spread::Sine.by(0.3));
        for y in [
            Direction::between(16, 0.0, 1.0, Wall::Slip, Wall::Slip),
            sine,
        ] {
            assert_eq!(
                Layout::new(&Mesh::new(d(8), y, d(32)).unwrap()).direction,
                [0, 1, 2]
            );
        }
        assert_eq!(order(1, 64, 32), [1, 0, 2]);
        assert_eq!(order(1, 32, 64), [2, 0, 1]);
        assert_eq!(order(32, 1, 64), [0, 1, 2]);
    }
}
