//! Fields of a flow as plain arrays in the order `[z][y][x]`, whatever their order in memory.
//!
//! Of a flow on several ranks all must ask together, and all get the whole field; where a rank is lost, which the next step
//! says, its values are not finite.
//!
//! Check: round trip, interpolation exact for cubics, values against the closed form they were set from.

use std::borrow::Cow;

use super::flow::Flow;
use super::layout::{Layout, Shape};
use super::mesh::Mesh;
use super::settings::FlowSettings;
use crate::Error;

/// Fourth-order interpolation from the faces to the first centre at a wall.
const AT_WALL: [f64; 4] = [5.0 / 16.0, 15.0 / 16.0, -5.0 / 16.0, 1.0 / 16.0];
/// Fourth-order interpolation from the faces to a centre.
const INSIDE: [f64; 4] = [-1.0 / 16.0, 9.0 / 16.0, 9.0 / 16.0, -1.0 / 16.0];

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

    /// Largest divergence over the largest `sum |u_i|/h_i`: what the flow fails to conserve of its own volume.
    pub fn relative_divergence(&self) -> f64 {
        self.measure_divergence().unwrap_or(f64::NAN)
    }

    pub(super) fn measure_divergence(&self) -> Result<f64, Error> {
        let velocity = self.state.velocity.each_ref().map(Vec::as_slice);
        let [largest] = self.layout.slabs.largest([self.divergence.largest_per_s(velocity)])?;
        Ok(if largest == 0.0 { 0.0 } else { largest / self.state.courant_per_s })
    }

    /// A whole field from those of all ranks.
    fn whole<'a>(&self, field: &'a [f64]) -> Cow<'a, [f64]> {
        let lost = |_| Cow::Owned(vec![f64::NAN; Shape::whole(self.layout.shape.n).len()]);
        self.layout.slabs.whole(field, true).unwrap_or_else(lost)
    }

    /// Velocity along `direction` (0, 1, 2 for x, y, z) at the low faces of the cells \[m/s\], `[z][y][x]`.
    pub fn face_velocity_m_s(&self, direction: usize) -> Vec<f64> {
        to_xyz(&self.layout, &self.whole(&self.state.velocity[self.layout.axis_of(direction)]))
    }

    /// Velocity along `direction` at the centres of the cells, interpolated with fourth order \[m/s\], `[z][y][x]`.
    pub fn centre_velocity_m_s(&self, direction: usize) -> Vec<f64> {
        let axis = self.layout.axis_of(direction);
        let shape = self.layout.shape;
        let line = &self.layout.line[axis];
        let n = line.cells;
        let stride = [1, shape.n[0], shape.plane()][axis];
        let field = self.whole(&self.state.velocity[axis]);
        let mut centred = vec![0.0; field.len()];
        for (place, value) in centred.iter_mut().enumerate() {
            let index = place / stride % n;
            let origin = place - index * stride;
            // A bounded direction does not store its high wall, where the normal velocity is zero.
            let face = |i: usize| if i < n { field[origin + i * stride] } else { 0.0 };
            *value = if n == 1 {
                // One cell: nothing varies, or nothing flows through it.
                field[place]
            } else if line.is_periodic() {
                (0..4).map(|t| INSIDE[t] * face((index + n + t - 1) % n)).sum()
            } else if index == 0 {
                (0..4).map(|t| AT_WALL[t] * face(t)).sum()
            } else if index + 1 == n {
                (0..4).map(|t| AT_WALL[t] * face(n - t)).sum()
            } else {
                (0..4).map(|t| INSIDE[t] * face(index + t - 1)).sum()
            };
        }
        to_xyz(&self.layout, &centred)
    }

    /// Kinematic pressure at the centres \[m^2/s^2\], `[z][y][x]`, up to a constant.
    pub fn pressure_m2_s2(&self) -> Vec<f64> {
        to_xyz(&self.layout, &self.whole(&self.state.pressure))
    }

    /// Eddy viscosity at the centres \[m^2/s\], `[z][y][x]`, of the field that the last step started from; `None` without a
    /// subgrid model.
    pub fn subgrid_viscosity_m2_s(&self) -> Option<Vec<f64>> {
        self.model.as_ref().map(|model| to_xyz(&self.layout, &self.whole(model.viscosity_m2_s())))
    }

    /// A flow that starts from velocities given at the low faces of the cells, `[z][y][x]` \[m/s\]; they are projected.
    ///
    /// # Errors
    /// As [`Flow::new`], and for arrays of the wrong length.
    pub fn from_face_velocities(
        mesh: Mesh,
        settings: FlowSettings,
        velocity_m_s: [&[f64]; 3],
    ) -> Result<(Self, super::StartReport), Error> {
        let mut flow = Self::at_rest(mesh, settings)?;
        let cells = Shape::whole(flow.layout.shape.n).len();
        for (direction, values) in velocity_m_s.into_iter().enumerate() {
            if values.len() != cells {
                return Err(Error::LengthMismatch { points: cells, out: values.len() });
            }
            let axis = flow.layout.axis_of(direction);
            let first = flow.layout.line[axis].first_face();
            let stride = [1, flow.layout.shape.n[0], flow.layout.shape.plane()][axis];
            let count = flow.layout.shape.n[axis];
            let mut field = from_xyz(&flow.layout, values);
            for (place, value) in field.iter_mut().enumerate() {
                if place / stride % count < first {
                    *value = 0.0;
                }
            }
            flow.layout.slabs.take_own(&field, &mut flow.state.velocity[axis]);
        }
        let report = flow.start()?;
        Ok((flow, report))
    }
}

/// Place in memory of each place in the order `[z][y][x]`.
fn places(layout: &Layout) -> impl Iterator<Item = usize> + '_ {
    let shape = layout.shape;
    let stride = |d: usize| [1, shape.n[0], shape.plane()][layout.axis_of(d)];
    let count = |d: usize| shape.n[layout.axis_of(d)];
    let (counts, strides) = ([count(0), count(1), count(2)], [stride(0), stride(1), stride(2)]);
    (0..counts[2]).flat_map(move |k| {
        (0..counts[1]).flat_map(move |j| (0..counts[0]).map(move |i| i * strides[0] + j * strides[1] + k * strides[2]))
    })
}

pub(crate) fn to_xyz(layout: &Layout, field: &[f64]) -> Vec<f64> {
    places(layout).map(|place| field[place]).collect()
}

pub(crate) fn from_xyz(layout: &Layout, values: &[f64]) -> Vec<f64> {
    let mut field = vec![0.0; values.len()];
    for (place, value) in places(layout).zip(values) {
        field[place] = *value;
    }
    field
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
            let field =
                move |[_, y, z]: [f64; 3]| [0.3, (tau * y).sin() * (tau * z).cos(), -(tau * y).cos() * (tau * z).sin()];
            let settings = FlowSettings::new(0.0, TimeStep::Fixed { step_s: 1e-3 });
            let (flow, _) = Flow::new(mesh, settings.clone(), field).unwrap();
            let faces = [0, 1, 2].map(|d| flow.face_velocity_m_s(d));
            let (again, _) =
                Flow::from_face_velocities(flow.mesh().clone(), settings, faces.each_ref().map(Vec::as_slice)).unwrap();
            let mut worst = 0.0_f64;
            for (direction, faces) in faces.iter().enumerate() {
                for (a, b) in again.face_velocity_m_s(direction).iter().zip(faces) {
                    assert!((a - b).abs() < 1e-12);
                }
                let centred = flow.centre_velocity_m_s(direction);
                let (y_m, z_m) = (flow.mesh().centre_m(1), flow.mesh().centre_m(2));
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
