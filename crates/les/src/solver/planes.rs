//! Fields as they are measured and written: planes across z in the order `[z][y][x]`, whatever
//! their order in memory.
//!
//! Of a flow on several ranks each has some of these planes, with halos about them. Where z is the
//! last direction in memory they are those that it owns, and nothing is exchanged; otherwise, which
//! is so in plane flows, all give all what they own.
//!
//! Check: fields on ranks against those of one process, every order in memory, fewer planes across
//! z than ranks.

use rayon::prelude::*;

use super::flow::Flow;
use super::layout::Shape;
use super::slabs::Slabs;
use crate::Error;
use crate::ranks::Ranks;

/// Velocity at the low faces of the cells \[m/s\] in the planes across z that a rank measures,
/// halos included.
#[derive(Debug, Clone)]
pub(crate) struct Faces {
    pub(crate) shape: Shape,
    pub(crate) field: [Vec<f64>; 3],
    /// Asks the other ranks.
    pub(crate) slabs: Slabs,
}

impl Flow {
    /// The planes across z that this rank measures and writes; all of them in one process.
    pub(crate) fn output_shape(&self) -> Shape {
        let ranks = &self.layout.slabs.ranks;
        Shape::slab(self.mesh.cells(), ranks.rank(), ranks.count())
    }

    /// Velocity at the faces in these planes.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn faces(&self) -> Result<Faces, Error> {
        let field = [self.face(0)?, self.face(1)?, self.face(2)?];
        Ok(Faces {
            shape: self.output_shape(),
            field,
            slabs: self.layout.slabs.clone(),
        })
    }

    /// One component of it.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn face(&self, direction: usize) -> Result<Vec<f64>, Error> {
        self.in_planes(&self.state.velocity[self.layout.axis_of(direction)])
    }

    /// A field of this rank, whose halos are up to date, in the planes that it shows, halos
    /// included.
    ///
    /// # Errors
    /// Those of [`Ranks::all_to_all`].
    pub(crate) fn in_planes(&self, field: &[f64]) -> Result<Vec<f64>, Error> {
        let layout = &self.layout;
        if layout.direction[2] == 2 || layout.slabs.is_alone() {
            return Ok(self.reordered(field, layout.shape));
        }
        let own = field[layout.shape.own_range()].to_vec();
        let whole = layout.slabs.all_gather(own)?;
        Ok(self.reordered(&whole, Shape::whole(layout.shape.n)))
    }

    /// The planes that this rank outputs, `[z][y][x]`, from a field of `shape` in the order of
    /// memory.
    fn reordered(&self, field: &[f64], shape: Shape) -> Vec<f64> {
        let direction = self.layout.direction;
        let output = self.output_shape();
        let [nx, ny, _] = output.n;
        let mut out = vec![0.0; output.len()];
        let held: Vec<usize> = output.held().collect();
        out.par_chunks_mut(nx * ny)
            .zip(held)
            .for_each(|(plane, k)| {
                for (j, row) in plane.chunks_mut(nx).enumerate() {
                    for (i, value) in row.iter_mut().enumerate() {
                        let at = [i, j, k];
                        *value = field[shape.place(direction.map(|d| at[d]))];
                    }
                }
            });
        out
    }
}

/// The planes of `shape` without its halos.
pub(crate) fn without_halos(shape: Shape, mut planes: Vec<f64>) -> Vec<f64> {
    let own = shape.own_range();
    planes.truncate(own.end);
    planes.drain(..own.start);
    planes
}

#[cfg(test)]
mod tests {
    use super::super::cases::{Initial, taylor_green_3d};
    use super::super::mesh::{Direction, Mesh};
    use super::super::settings::{FlowSettings, TimeStep};
    use crate::ranks::{Ranks, Single, on_threads};
    use crate::solver::Flow;
    use std::sync::Arc;

    /// A flow that differs in all directions.
    fn start(mesh: &Mesh, ranks: Arc<dyn Ranks>, order: [usize; 3]) -> Flow {
        let field = |[x, y, z]: [f64; 3]| {
            [
                (7.0 * x + z).sin(),
                (5.0 * y - x).cos(),
                (3.0 * z + 2.0 * y).sin(),
            ]
        };
        let settings = FlowSettings {
            ranks,
            ..FlowSettings::new(0.0, TimeStep::Fixed { step_s: 1e-3 })
        };
        Initial::Field(Box::new(field))
            .start_in_order(order, mesh.clone(), settings)
            .unwrap()
    }

    #[test]
    fn planes_and_their_halos_are_those_of_one_process_in_every_order_in_memory() {
        let case = taylor_green_3d(16, 100.0).unwrap();
        let flat = Mesh::new(
            Direction::periodic(24, 0.0, 1.0),
            Direction::periodic(28, 0.0, 1.0),
            Direction::thin(0.1),
        )
        .unwrap();
        let orders = [[0, 1, 2], [1, 0, 2], [0, 2, 1], [2, 0, 1], [1, 2, 0]];
        for (mesh, orders) in [(case.mesh, &orders[..]), (flat, &orders[2..])] {
            for &order in orders {
                let alone = start(&mesh, Arc::new(Single), order);
                let whole = alone.faces().unwrap();
                let centred = alone.own_centre_velocity_m_s(2).unwrap();
                assert!(whole.field.iter().flatten().any(|value| *value != 0.0));
                for count in [2, 3, 4] {
                    let found = on_threads(count, |ranks| {
                        let flow = start(&mesh, ranks, order);
                        let faces = flow.faces().unwrap();
                        for (d, field) in faces.field.iter().enumerate() {
                            for k in faces.shape.held() {
                                let row = faces.shape.row(3, k);
                                assert_eq!(
                                    field[row],
                                    whole.field[d][whole.shape.row(3, k)],
                                    "{order:?}, {count}, {k}"
                                );
                            }
                        }
                        assert_eq!(flow.whole(flow.own_centre_velocity_m_s(2)), centred);
                        (
                            flow.own_planes(),
                            flow.own_centre_velocity_m_s(2).unwrap().len(),
                        )
                    });
                    let [nx, ny, nz] = mesh.cells();
                    let planes: usize =
                        found.iter().flatten().map(|(planes, _)| planes.len()).sum();
                    let values: usize = found.iter().flatten().map(|(_, values)| values).sum();
                    assert_eq!(
                        (planes, values),
                        (nz, nx * ny * nz),
                        "{order:?}, {count} ranks"
                    );
                }
            }
        }
    }
}
