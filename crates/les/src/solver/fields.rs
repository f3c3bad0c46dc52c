//! Fields of a flow as plain arrays in the order `[z][y][x]`, whatever their order in memory.
//!
//! Of a flow on several ranks all must ask together. All get the whole field, which each must have
//! room for, and whose values are not finite where a rank is lost, which the next step says; or
//! each gets its own planes across z.
//!
//! Check: round trip, interpolation exact for cubics, values against the closed form they were set
//! from.

use std::ops::Range;

use rayon::prelude::*;

use super::flow::Flow;
use super::layout::Shape;
use super::mesh::{Ends, Mesh};
use super::planes::without_halos;
use super::settings::FlowSettings;
use super::transport::MEAN;
use crate::error::{Error, check_lengths};

/// Fourth-order interpolation from the faces to the first centre at a wall.
const AT_WALL: [f64; 4] = [5.0 / 16.0, 15.0 / 16.0, -5.0 / 16.0, 1.0 / 16.0];

impl Flow {
    /// The mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The settings.
    pub fn settings(&self) -> &FlowSettings {
        &self.settings
    }

    /// Present time \[s\].
    pub fn time_s(&self) -> f64 {
        self.state.time_s
    }

    /// Steps made.
    pub fn steps(&self) -> u64 {
        self.state.step
    }

    /// Kinetic energy, integral of `u^2/2` \[m^5/s^2\].
    pub fn kinetic_energy_m5_s2(&self) -> f64 {
        self.state.energy
    }

    /// Largest divergence over the largest `sum |u_i|/h_i`: what the flow fails to conserve of its
    /// own volume.
    pub fn relative_divergence(&self) -> f64 {
        self.measure_divergence().unwrap_or(f64::NAN)
    }

    pub(super) fn measure_divergence(&self) -> Result<f64, Error> {
        let velocity = self.state.velocity.each_ref().map(|field| &field[..]);
        let [largest] = self
            .layout
            .slabs
            .largest([self.divergence.largest_per_s(velocity)])?;
        Ok(if largest == 0.0 {
            0.0
        } else {
            largest / self.state.courant_per_s
        })
    }

    /// The planes across z that this rank has to show, which the readers that begin with `own`
    /// give: all of them in one process.
    pub fn own_planes(&self) -> Range<usize> {
        self.output_shape().own()
    }

    /// Velocity along `direction` (0, 1, 2 for x, y, z) at the low faces of the cells of
    /// [`Self::own_planes`] \[m/s\], `[z][y][x]`.
    ///
    /// # Errors
    /// [`Error::RankLost`].
    pub fn own_face_velocity_m_s(&self, direction: usize) -> Result<Vec<f64>, Error> {
        self.face(direction)
            .map(|faces| without_halos(self.output_shape(), faces))
    }

    /// Velocity along `direction` at the centres of the cells of [`Self::own_planes`], interpolated
    /// with fourth order \[m/s\], `[z][y][x]`.
    ///
    /// # Errors
    /// [`Error::RankLost`].
    pub fn own_centre_velocity_m_s(&self, direction: usize) -> Result<Vec<f64>, Error> {
        self.face(direction)
            .map(|faces| self.centred(direction, &faces))
    }

    /// Kinematic pressure at the centres of the cells of [`Self::own_planes`] \[m^2/s^2\],
    /// `[z][y][x]`, up to a constant.
    ///
    /// # Errors
    /// [`Error::RankLost`].
    pub fn own_pressure_m2_s2(&self) -> Result<Vec<f64>, Error> {
        self.in_planes(&self.state.pressure)
            .map(|pressure| without_halos(self.output_shape(), pressure))
    }

    /// From the planes of all ranks to the whole field.
    pub(crate) fn whole(&self, own: Result<Vec<f64>, Error>) -> Vec<f64> {
        let whole = own.and_then(|own| self.layout.slabs.all_gather(own));
        whole.unwrap_or_else(|_| vec![f64::NAN; Shape::whole(self.layout.shape.n).len()])
    }

    /// Velocity along `direction` (0, 1, 2 for x, y, z) at the low faces of the cells \[m/s\],
    /// `[z][y][x]`.
    pub fn face_velocity_m_s(&self, direction: usize) -> Vec<f64> {
        self.whole(self.own_face_velocity_m_s(direction))
    }

    /// Largest difference of a component, at the faces where it lies, from
    /// `exact(position_m, time_s) -> velocity_m_s` at the present time \[m/s\]; not finite where a
    /// rank is lost.
    pub fn largest_error_m_s(&self, exact: impl Fn([f64; 3], f64) -> [f64; 3]) -> f64 {
        let at_m = [0, 1, 2].map(|axis| self.face_position_m(axis));
        let largest = self.first_largest(|axis, place| {
            let position_m = at_m[axis](self.layout.shape.index_held(place));
            let velocity_m_s = exact(position_m, self.state.time_s);
            (self.state.velocity[axis][place] - velocity_m_s[self.layout.direction[axis]]).abs()
        });
        largest.map_or(f64::NAN, |(largest_m_s, ..)| largest_m_s)
    }

    /// From the faces of the planes of the output to the centres of those that are owned.
    pub(crate) fn centred(&self, direction: usize, faces: &[f64]) -> Vec<f64> {
        let output = self.output_shape();
        let nx = output.n[0];
        let n = output.n[direction];
        let is_periodic = self.mesh.directions()[direction].ends == Ends::Periodic;
        let mut centred = vec![0.0; output.own_range().len()];
        centred
            .par_chunks_mut(output.plane())
            .zip(output.own())
            .for_each(|(plane, k)| {
                for (place, value) in plane.iter_mut().enumerate() {
                    let cell = [place % nx, place / nx, k];
                    if n == 1 {
                        // Nothing varies, or nothing flows through the one cell.
                        *value = face_value(faces, output, cell, direction, 0);
                        continue;
                    }
                    let (faces_read, weights) = centre_stencil(n, cell[direction], is_periodic);
                    let terms = faces_read.iter().zip(weights);
                    *value = terms
                        .map(|(&face, weight)| {
                            weight * face_value(faces, output, cell, direction, face)
                        })
                        .sum();
                }
            });
        centred
    }

    /// Kinematic pressure at the centres \[m^2/s^2\], `[z][y][x]`, up to a constant.
    pub fn pressure_m2_s2(&self) -> Vec<f64> {
        self.whole(self.own_pressure_m2_s2())
    }

    /// Starts from velocities given at the low faces of the cells, `[z][y][x]` \[m/s\].
    ///
    /// # Errors
    /// As [`Flow::new`], and for arrays of the wrong length.
    pub(super) fn with_faces(self, velocity_m_s: &[Vec<f64>; 3]) -> Result<(Self, f64), Error> {
        let [nx, ny, nz] = self.mesh.cells();
        let direction = self.layout.direction;
        for values in velocity_m_s {
            check_lengths(nx * ny * nz, values.len())?;
        }
        self.with_face_velocity(|axis, index| {
            let mut at = [0; 3];
            (0..3).for_each(|b| at[direction[b]] = index[b]);
            velocity_m_s[direction[axis]][(at[2] * ny + at[1]) * nx + at[0]]
        })
    }
}

/// Faces and weights of the interpolation to the centre `index` of `n` cells along a direction.
fn centre_stencil(n: usize, index: usize, is_periodic: bool) -> ([usize; 4], [f64; 4]) {
    if is_periodic {
        ([0, 1, 2, 3].map(|t| (index + n + t - 1) % n), MEAN)
    } else if index == 0 {
        ([0, 1, 2, 3], AT_WALL)
    } else if index + 1 == n {
        ([n, n - 1, n - 2, n - 3], AT_WALL)
    } else {
        ([index - 1, index, index + 1, index + 2], MEAN)
    }
}

/// Velocity at a face of the line along `direction` through a cell. A bounded direction does not
/// store its high wall, where the normal velocity is zero.
fn face_value(
    faces: &[f64],
    output: Shape,
    cell: [usize; 3],
    direction: usize,
    face: usize,
) -> f64 {
    if face >= output.n[direction] {
        return 0.0;
    }
    let mut at = cell;
    at[direction] = face;
    faces[output.place(at)]
}

#[cfg(test)]
impl Flow {
    /// Eddy viscosity at the centres \[m^2/s\], `[z][y][x]`, of the field that the last step
    /// started from; `None` without a subgrid model.
    pub(crate) fn subgrid_viscosity_m2_s(&self) -> Option<Vec<f64>> {
        let model = self.model.as_ref()?;
        let own = self
            .in_planes(&model.viscosity_m2_s)
            .map(|planes| without_halos(self.output_shape(), planes));
        Some(self.whole(own))
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::{Direction, Wall};
    use super::super::settings::TimeStep;
    use super::*;

    #[test]
    fn fields_come_back_in_the_order_of_the_mesh_and_centred_values_are_of_fourth_order() {
        let error = |n: usize| {
            let mesh = Mesh::new(
                Direction::thin(1.0),
                Direction::periodic(n, 0.0, 1.0),
                Direction::between(n / 2, 0.0, 0.5, Wall::Slip, Wall::Slip),
            )
            .unwrap();
            let tau = std::f64::consts::TAU;
            let field = move |[_, y, z]: [f64; 3]| {
                [
                    0.3,
                    (tau * y).sin() * (tau * z).cos(),
                    -(tau * y).cos() * (tau * z).sin(),
                ]
            };
            let settings = FlowSettings::new(0.0, TimeStep::Fixed { step_s: 1e-3 });
            let (flow, _) = Flow::new(mesh, settings.clone(), field).unwrap();
            let faces = [0, 1, 2].map(|d| flow.face_velocity_m_s(d));
            let (again, _) = Flow::at_rest(flow.mesh().clone(), settings)
                .unwrap()
                .with_faces(&faces)
                .unwrap();
            let mut worst = 0.0_f64;
            for (direction, faces) in faces.iter().enumerate() {
                for (a, b) in again.face_velocity_m_s(direction).iter().zip(faces) {
                    assert!((a - b).abs() < 1e-12);
                }
                let centred = flow.whole(flow.own_centre_velocity_m_s(direction));
                let y_m = flow.mesh().centre_m(1);
                let z_m = flow.mesh().centre_m(2);
                for (place, value) in centred.iter().enumerate() {
                    let expected = field([0.5, y_m[place % n], z_m[place / n]])[direction];
                    worst = worst.max((value - expected).abs());
                }
            }
            worst
        };
        let order = (error(16) / error(32)).log2();
        assert!(order > 3.7, "order {order}");
    }
}
