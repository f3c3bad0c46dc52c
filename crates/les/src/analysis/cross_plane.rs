//! A simulated flow as a wind: the velocity of a cross-plane at any position along the flight.
//!
//! Velocities are brought to the centres of the cells with fourth order, then interpolated along x
//! by the M'4 kernel (27), so that planes between the cells have the third order of the kernel in
//! all directions. Walls and periods of the mesh become those of the snapshot.
//!
//! Check: an analytic field on a stretched mesh with the kernel's order, walls, one-cell
//! directions.

use crate::Error;
use crate::solver::flow::Flow;
use crate::solver::mesh::{AXIS_NAMES, Direction, Ends, Mesh, Wall};
use crate::solver::planes::Faces;
use crate::winds::axis::{Axis, Edges, GHOSTS, Ghost, Side};
use crate::winds::grid_wind::{GridSnapshot, PlaneMesh, ghost_places, ghost_value};

/// Nodes that stand for a direction of one cell: the kernel's stencil.
const THIN_NODES: usize = 4;

/// Velocity in one plane across the flight at the centres of the cells, y fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossPlane {
    /// Position along the flight \[m\].
    pub x_m: f64,
    /// Centres in y \[m\].
    pub y_m: Vec<f64>,
    /// Centres in z \[m\].
    pub z_m: Vec<f64>,
    /// Velocities `(u, v, w)` \[m/s\], `[z][y]`.
    pub velocity_m_s: Vec<[f64; 3]>,
    /// What lies beyond the ends in y: walls or a period of the mesh.
    pub y_edges: Edges,
    /// The same in z.
    pub z_edges: Edges,
}

impl CrossPlane {
    fn new(x_m: f64, mesh: &Mesh, velocity_m_s: Vec<[f64; 3]>) -> Self {
        let [_, y, z] = mesh.directions();
        Self {
            x_m,
            y_m: mesh.centre_m(1),
            z_m: mesh.centre_m(2),
            velocity_m_s,
            y_edges: edges(y),
            z_edges: edges(z),
        }
    }
}

impl Flow {
    /// Velocity at the centres of the cells of the cross-plane at `x_m` \[m\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a position outside the mesh, if x is not periodic, or not finite;
    /// [`Error::RankLost`].
    pub fn cross_plane(&self, x_m: f64) -> Result<CrossPlane, Error> {
        let mesh = self.mesh();
        let [nx, ny, _] = mesh.cells();
        let taps = self.taps_along_flight(x_m)?;
        let mut own = vec![[0.0; 3]; ny * self.own_planes().len()];
        for component in 0..3 {
            let centred = self.own_centre_velocity_m_s(component)?;
            for (velocity_m_s, row) in own.iter_mut().zip(centred.chunks(nx)) {
                for (source, weight) in taps {
                    velocity_m_s[component] +=
                        weight * ghost_value(source, 0, component, |i| row[i]);
                }
            }
        }
        Ok(CrossPlane::new(x_m, mesh, self.layout.slabs.planes(own)?))
    }

    /// Sources and weights of the interpolation to `x_m` \[m\].
    fn taps_along_flight(&self, x_m: f64) -> Result<[(Ghost, f64); 4], Error> {
        let mesh = self.mesh();
        let along = &mesh.directions()[0];
        let refused = Error::OutOfRange {
            field: "x_m",
            value: x_m,
            allowed: "finite, within the mesh",
        };
        if along.cells == 1 {
            return if x_m.is_finite() {
                Ok([1.0, 0.0, 0.0, 0.0].map(|weight| (Ghost::Copy(0), weight)))
            } else {
                Err(refused)
            };
        }
        let axis = Axis::new(AXIS_NAMES[0], &mesh.centre_m(0), edges(along))?;
        let (first, weights) = axis.stencil(x_m).ok_or(refused)?;
        Ok(std::array::from_fn(|i| {
            (source(&axis, first + i), weights[i])
        }))
    }

    /// The velocity at the faces averaged along the flight, at the centres of the cells; its `x_m`
    /// is the middle of the mesh.
    pub(super) fn mean_plane_of(&self, faces: &Faces) -> Result<CrossPlane, Error> {
        let mesh = self.mesh();
        let along = &mesh.directions()[0];
        let length_m: Vec<f64> = mesh.face_m(0).windows(2).map(|w| w[1] - w[0]).collect();
        let nx = length_m.len();
        let mut own = vec![[0.0; 3]; mesh.cells()[1] * self.own_planes().len()];
        for component in 0..3 {
            let centred = self.centred(component, &faces.field[component]);
            for (mean, row) in own.iter_mut().zip(centred.chunks(nx)) {
                let terms = row.iter().zip(&length_m);
                let sum: f64 = terms.map(|(value, length_m)| value * length_m).sum();
                mean[component] = sum / along.length_m();
            }
        }
        Ok(CrossPlane::new(
            0.5 * (along.low_m + along.high_m),
            mesh,
            self.layout.slabs.planes(own)?,
        ))
    }

    /// A plane of this flow as a wind.
    pub(super) fn plane_snapshot(&self, plane: &CrossPlane) -> Result<GridSnapshot, Error> {
        let [_, y, z] = self.mesh().directions();
        let mesh = PlaneMesh {
            y_m: nodes(y, &plane.y_m),
            z_m: nodes(z, &plane.z_m),
            y_edges: plane.y_edges,
            z_edges: plane.z_edges,
        };
        let mut velocity_m_s = Vec::with_capacity(mesh.y_m.len() * mesh.z_m.len());
        for k in 0..mesh.z_m.len() {
            // All nodes of a direction of one cell have its value.
            let k = if z.cells == 1 { 0 } else { k };
            for j in 0..mesh.y_m.len() {
                let j = if y.cells == 1 { 0 } else { j };
                velocity_m_s.push(plane.velocity_m_s[k * y.cells + j]);
            }
        }
        GridSnapshot::new(&mesh, &velocity_m_s)
    }
}

/// Where the value of a padded node comes from.
fn source(axis: &Axis, padded: usize) -> Ghost {
    let ghost = ghost_places(axis).find(|(place, _)| *place == padded);
    ghost.map_or_else(|| Ghost::Copy(padded - GHOSTS), |(_, ghost)| ghost)
}

/// Walls and periods of a direction of the mesh as those of a snapshot.
fn edges(direction: &Direction) -> Edges {
    match direction.ends {
        Ends::Periodic => Edges::Periodic {
            period_m: direction.length_m(),
        },
        Ends::Walls { low, high } => Edges::Bounded {
            low: side(low, direction.low_m),
            high: side(high, direction.high_m),
        },
    }
}

/// A wall of the mesh as the side of a snapshot.
fn side(wall: Wall, position_m: f64) -> Side {
    match wall {
        Wall::Slip => Side::SlipWall { position_m },
        Wall::NoSlip { velocity_m_s } => Side::NoSlipWall {
            position_m,
            velocity_m_s,
        },
    }
}

/// Nodes of a snapshot: the centres, or in a direction of one cell as many as the kernel needs.
fn nodes(direction: &Direction, centre_m: &[f64]) -> Vec<f64> {
    if centre_m.len() > 1 {
        return centre_m.to_vec();
    }
    let cell_m = direction.length_m() / THIN_NODES as f64;
    (0..THIN_NODES)
        .map(|i| direction.low_m + (i as f64 + 0.5) * cell_m)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::mesh::Spread;
    use crate::solver::settings::{FlowSettings, TimeStep};
    use crate::winds::Wind;
    use std::f64::consts::TAU;

    /// The flow of Arnold, Beltrami and Childress, free of divergence and different in all
    /// directions.
    fn beltrami([x, y, z]: [f64; 3]) -> [f64; 3] {
        [
            0.7 * z.sin() + 0.4 * y.cos(),
            x.sin() + 0.7 * z.cos(),
            0.4 * y.sin() + x.cos(),
        ]
    }

    fn start(
        x: Direction,
        y: Direction,
        z: Direction,
        field: impl Fn([f64; 3]) -> [f64; 3] + Sync,
    ) -> Flow {
        let settings = FlowSettings::new(0.01, TimeStep::Fixed { step_s: 0.01 });
        Flow::new(Mesh::new(x, y, z).unwrap(), settings, field)
            .unwrap()
            .0
    }

    fn probe(wind: &GridSnapshot, at_m: [f64; 3]) -> [f64; 3] {
        let mut out = [[0.0; 3]];
        wind.velocity_into(&[at_m], 0.0, &mut out).unwrap();
        out[0]
    }

    #[test]
    fn an_analytic_flow_on_a_stretched_mesh_is_sampled_with_the_order_of_the_kernel() {
        let error = |n: usize| {
            let sine = |a| Direction::periodic(n, 0.0, TAU).stretched(Spread::Sine.by(a));
            let flow = start(
                Direction::periodic(n, 0.0, TAU),
                sine(0.4),
                sine(-0.3),
                beltrami,
            );
            let mut worst = 0.0_f64;
            for i in 0..9_u8 {
                let x_m = 0.713 * f64::from(i) - 1.0;
                let wind = flow
                    .plane_snapshot(&flow.cross_plane(x_m).unwrap())
                    .unwrap();
                for j in 0..200_u16 {
                    let at_m = [x_m, 0.311 * f64::from(j), 0.173 * f64::from(j) - 3.0];
                    for (found, expected) in probe(&wind, at_m).iter().zip(beltrami(at_m)) {
                        worst = worst.max((found - expected).abs());
                    }
                }
            }
            worst
        };
        let coarse = error(16);
        let fine = error(32);
        let order = (coarse / fine).log2();
        assert!(
            order > 2.8 && fine < 5e-3,
            "errors {coarse}, {fine}: order {order}"
        );
    }

    #[test]
    fn walls_of_the_mesh_are_walls_of_the_wind() {
        let belt = Wall::NoSlip {
            velocity_m_s: [0.3, 0.5, 0.0],
        };
        let mapping = Spread::TanhLow.by(1.0);
        let flow = start(
            Direction::between(8, 0.0, 1.0, Wall::Slip, Wall::Slip),
            Direction::periodic(8, 0.0, 1.0),
            Direction::between(16, 0.0, 1.0, belt, Wall::Slip).stretched(mapping),
            |[x, y, z]| [(TAU * x).sin() * z, z + 0.1 * (TAU * y).sin(), 0.2 * z],
        );
        for x_m in [0.01, 0.5, 0.97] {
            let wind = flow
                .plane_snapshot(&flow.cross_plane(x_m).unwrap())
                .unwrap();
            for y in [0.0, 0.13, 0.99] {
                let ground = probe(&wind, [x_m, y, 0.0]);
                assert!(
                    ground
                        .iter()
                        .zip([0.3, 0.5, 0.0])
                        .all(|(a, b)| (a - b).abs() < 1e-13),
                    "{ground:?}"
                );
                assert!(
                    probe(&wind, [x_m, y, 1.0])[2].abs() < 1e-13,
                    "through the top"
                );
            }
            assert!(probe(&wind, [x_m, 0.5, 1.001])[0].is_nan());
        }
        let edge = flow.cross_plane(0.0).unwrap();
        assert!(
            edge.velocity_m_s.iter().all(|v| v[0].abs() < 1e-14),
            "nothing flows through the slip wall at x = 0"
        );
        for x_m in [-0.001, 1.001, f64::NAN] {
            assert!(
                matches!(
                    flow.cross_plane(x_m),
                    Err(Error::OutOfRange { field: "x_m", .. })
                ),
                "{x_m}"
            );
        }
    }

    #[test]
    fn directions_of_one_cell_do_not_vary() {
        let thin = || Direction::thin(0.5);
        let wide = || Direction::periodic(12, 0.0, 1.0);
        let plane = start(thin(), wide(), wide(), |[_, y, z]| {
            [1.0, (TAU * z).sin(), (TAU * y).sin()]
        });
        assert_eq!(
            plane.cross_plane(-7.0).unwrap().velocity_m_s,
            plane.cross_plane(0.1).unwrap().velocity_m_s
        );
        assert!(matches!(
            plane.cross_plane(f64::INFINITY),
            Err(Error::OutOfRange { field: "x_m", .. })
        ));
        let shear = start(wide(), thin(), wide(), |[_, _, z]| {
            [(TAU * z).sin(), 2.0, 0.0]
        });
        let wind = shear
            .plane_snapshot(&shear.cross_plane(0.3).unwrap())
            .unwrap();
        let [a, b] = [0.0, 0.37].map(|y| probe(&wind, [0.3, y, 0.21]));
        assert!(
            a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14) && (a[1] - 2.0).abs() < 1e-14,
            "{a:?} {b:?}"
        );
        let expected = (TAU * 0.21).sin();
        assert!((a[0] / expected - 1.0).abs() < 0.02, "{a:?}, {expected}");
    }
}
