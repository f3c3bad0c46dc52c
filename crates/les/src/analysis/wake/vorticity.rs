//! The vorticity of a flow at the edges of its cells, and what is summed from it.
//!
//! Component `c` lies at the edges along `c`: at centres in its own direction, at faces in the two others. Differences are
//! of fourth order ([`Slope`]); the sums are trapezoidal, that of the enstrophy with an end correction at the ground.
//!
//! Differences take four values about each face, weighted so that cubics of the position are exact. At a frictionless plane the field
//! is continued by its mirror image, at a no-slip wall the value at the wall is one of the four.
//!
//! Check: solid rotation and sheared columns; enstrophy against the dissipation of a decaying exact flow; cubics, mirror images,
//! periods.

use crate::Error;
use crate::solver::flow::Flow;
use crate::solver::mesh::{Direction, Ends, Mesh, Wall, refused};
use crate::solver::planes::Faces;
use rayon::prelude::*;
use std::ops::Range;

/// Weights of the first faces over those of the trapezoidal rule: 3/8, 7/6, 23/24 for 1/2, 1, 1.
const GREGORY: [f64; 3] = [0.75, 7.0 / 6.0, 23.0 / 24.0];

/// Operators of the vorticity on one mesh whose x is periodic or one cell and whose z is bounded.
#[derive(Debug, Clone)]
pub(super) struct Curl {
    cells: [usize; 3],
    /// Faces of each direction: as many as cells if periodic, else one more.
    pub(super) faces: [usize; 3],
    /// `slope[along][component]`; those of a component along itself are not used.
    slope: [[Slope; 3]; 3],
    /// Lengths about the centres, the cells \[m\].
    pub(super) cell_m: [Vec<f64>; 3],
    /// Lengths about the faces, from centre to centre, half a cell at the ends \[m\].
    pub(super) face_m: [Vec<f64>; 3],
    /// The same along z with Gregory's end correction at the ground: the squared vorticity falls steeply there.
    corrected_m: Vec<f64>,
}

impl Curl {
    /// # Errors
    /// [`Error::BadDirection`] if x is bounded or z periodic: that is no wake above ground.
    pub(super) fn new(mesh: &Mesh) -> Result<Self, Error> {
        let ends = |axis: usize| mesh.directions()[axis].ends;
        if ends(0) != Ends::Periodic {
            return Err(refused(
                0,
                "period",
                0.0,
                "there: a wake repeats itself along the flight",
            ));
        }
        if ends(2) == Ends::Periodic {
            return Err(refused(2, "ground", 0.0, "there: z must be bounded"));
        }
        let directions = mesh.directions();
        let periodic: [bool; 3] = [0, 1, 2].map(|d| ends(d) == Ends::Periodic);
        let cells = mesh.cells();
        let lengths = |d: usize| {
            let (centre_m, face_m) = (mesh.centre_m(d), mesh.face_m(d));
            let cell: Vec<f64> = face_m.windows(2).map(|w| w[1] - w[0]).collect();
            let mut about: Vec<f64> = vec![centre_m[0] - face_m[0]];
            about.extend(centre_m.windows(2).map(|w| w[1] - w[0]));
            let last = face_m[cells[d]] - centre_m[cells[d] - 1];
            if periodic[d] {
                about[0] += last;
            } else {
                about.push(last);
            }
            (cell, about)
        };
        let lengths = [0, 1, 2].map(lengths);
        let mut corrected_m = lengths[2].1.clone();
        for (length_m, factor) in corrected_m.iter_mut().zip(GREGORY) {
            *length_m *= factor;
        }
        Ok(Self {
            corrected_m,
            cells,
            faces: std::array::from_fn(|d| cells[d] + usize::from(!periodic[d])),
            slope: std::array::from_fn(|along| {
                std::array::from_fn(|c| Slope::new(&directions[along], c))
            }),
            cell_m: lengths.each_ref().map(|l| l.0.clone()),
            face_m: lengths.each_ref().map(|l| l.1.clone()),
        })
    }

    /// Vorticity component `c` in the row along x at the places `j`, `k` (of faces or centres as `c` has it) \[1/s\].
    pub(super) fn row(&self, velocity: &Faces, c: usize, j: usize, k: usize, out: &mut [f64]) {
        // curl_c = d_a u_b - d_b u_a with (c, a, b) cyclic.
        let (a, b) = ((c + 1) % 3, (c + 2) % 3);
        out.fill(0.0);
        self.add_slope(velocity, a, b, 1.0, [j, k], out);
        self.add_slope(velocity, b, a, -1.0, [j, k], out);
    }

    /// Adds `sign` times the derivative along `along` of velocity `component`.
    fn add_slope(
        &self,
        velocity: &Faces,
        along: usize,
        component: usize,
        sign: f64,
        [j, k]: [usize; 2],
        out: &mut [f64],
    ) {
        let slope = &self.slope[along][component];
        let field = &velocity.field[component];
        let [_, ny, nz] = self.cells;
        let row = |j: usize, k: usize| {
            // Walls at the high ends are not stored; nothing flows through them.
            let is_wall = (component == 1 && j == ny) || (component == 2 && k == nz);
            (!is_wall).then(|| &field[velocity.shape.row(j, k)])
        };
        if along == 0 {
            let Some(values) = row(j, k) else { return };
            for (out, taps) in out.iter_mut().zip(&slope.taps) {
                *out += sign
                    * taps
                        .iter()
                        .map(|(i, weight)| weight * values[*i])
                        .sum::<f64>();
            }
            return;
        }
        let place = if along == 1 { j } else { k };
        for &(cell, weight) in &slope.taps[place] {
            let values = if along == 1 {
                row(cell, k)
            } else {
                row(j, cell)
            };
            for (out, value) in out.iter_mut().zip(values.unwrap_or_default()) {
                *out += sign * weight * value;
            }
        }
        let wall = slope.from_walls[place];
        if wall != 0.0 {
            out.iter_mut().for_each(|out| *out += sign * wall);
        }
    }

    /// The faces across z of the cells in the planes that are owned; the highest one is with the last cells.
    pub(super) fn own_faces(&self, own: Range<usize>) -> Range<usize> {
        if own.end == self.cells[2] {
            own.start..self.faces[2]
        } else {
            own
        }
    }

    /// Half the integral of the squared vorticity over the box, per length of x \[m^2/s^2\].
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    pub(super) fn enstrophy_m2_s2(&self, velocity: &Faces) -> Result<f64, Error> {
        let nx = self.cells[0];
        let component = |c: usize| {
            let weight = |d: usize| {
                if c == d {
                    &self.cell_m[d]
                } else {
                    &self.face_m[d]
                }
            };
            let (x_m, y_m) = (weight(0), weight(1));
            let z_m = if c == 2 {
                &self.cell_m[2]
            } else {
                &self.corrected_m
            };
            let plane = |k: usize| {
                let mut row = vec![0.0; nx];
                let mut sum = 0.0;
                for (j, y_m) in y_m.iter().enumerate() {
                    self.row(velocity, c, j, k, &mut row);
                    sum += y_m * row.iter().zip(x_m).map(|(w, x_m)| x_m * w * w).sum::<f64>();
                }
                sum
            };
            let own = velocity.shape.own();
            let own = if c == 2 { own } else { self.own_faces(own) };
            // Collected first, so that the order of the sum is that of the planes.
            let planes = velocity
                .slabs
                .all_gather(own.into_par_iter().map(plane).collect())?;
            Ok(0.5
                * planes
                    .iter()
                    .zip(z_m)
                    .map(|(sum, z_m)| sum * z_m)
                    .sum::<f64>())
        };
        let components = [component(0)?, component(1)?, component(2)?];
        Ok(components.iter().sum::<f64>() / self.cell_m[0].iter().sum::<f64>())
    }

    /// Magnitude of the vorticity at the centres in the planes that are owned \[1/s\], `[z][y][x]`: each component is the mean of
    /// the four edges about the centre.
    fn magnitude_per_s(&self, velocity: &Faces) -> Vec<f64> {
        let (shape, nx) = (velocity.shape, self.cells[0]);
        let next = |d: usize, i: usize| (i + 1) % self.faces[d];
        let mut out = vec![0.0; shape.own_places().len()];
        out.par_chunks_mut(shape.plane())
            .zip(shape.own())
            .for_each(|(plane, k)| {
                let mut edges = vec![0.0; nx];
                for (j, out) in plane.chunks_mut(nx).enumerate() {
                    let (j_high, k_high) = (next(1, j), next(2, k));
                    for c in 0..3 {
                        let mut mean = vec![0.0; nx];
                        let (ys, zs): (&[usize], &[usize]) = match c {
                            0 => (&[j, j_high], &[k, k_high]),
                            1 => (&[j], &[k, k_high]),
                            _ => (&[j, j_high], &[k]),
                        };
                        for &(j, k) in ys
                            .iter()
                            .flat_map(|j| zs.iter().map(move |k| (*j, *k)))
                            .collect::<Vec<_>>()
                            .iter()
                        {
                            self.row(velocity, c, j, k, &mut edges);
                            for i in 0..nx {
                                // Components 1 and 2 lie at the faces of x.
                                mean[i] += if c == 0 {
                                    edges[i]
                                } else {
                                    0.5 * (edges[i] + edges[next(0, i)])
                                };
                            }
                        }
                        let count = (ys.len() * zs.len()) as f64;
                        out.iter_mut()
                            .zip(&mean)
                            .for_each(|(out, mean)| *out += (mean / count).powi(2));
                    }
                    out.iter_mut().for_each(|out| *out = out.sqrt());
                }
            });
        out
    }
}

impl Flow {
    /// Magnitude of the vorticity at the centres of the cells in the planes of [`Self::own_planes`] \[1/s\], `[z][y][x]`, for flows that
    /// are periodic in x and bounded in z.
    ///
    /// # Errors
    /// [`Error::BadDirection`] for other flows, [`Error::RankLost`].
    pub fn own_vorticity_magnitude_per_s(&self) -> Result<Vec<f64>, Error> {
        let curl = Curl::new(self.mesh())?;
        Ok(curl.magnitude_per_s(&self.faces()?))
    }
}

/// Values used for one derivative.
const TAPS: usize = 4;

/// What a value of the extended line is.
#[derive(Debug, Clone, Copy)]
enum Node {
    Cell(usize),
    Wall(f64),
}

/// Derivative operator of one direction for one velocity component along the walls.
#[derive(Debug, Clone)]
pub(super) struct Slope {
    /// For each face the cells and their weights \[1/m\]; empty where nothing varies.
    pub(super) taps: Vec<Vec<(usize, f64)>>,
    /// For each face what the walls' own velocity adds \[1/s\].
    pub(super) from_walls: Vec<f64>,
}

impl Slope {
    /// The operator for the component `component` (0, 1, 2 for x, y, z), at the faces 0 to `n` (0 to `n - 1` if periodic).
    pub(super) fn new(direction: &Direction, component: usize) -> Self {
        let n = direction.cells;
        let periodic = direction.ends == Ends::Periodic;
        let faces = if periodic { n } else { n + 1 };
        if n == 1 {
            return Self {
                taps: vec![Vec::new(); faces],
                from_walls: vec![0.0; faces],
            };
        }
        let nodes = extended(direction, component);
        let at_face = |face: usize| {
            let at_m = direction.at(face as f64).0;
            let below = nodes.partition_point(|(x_m, _)| *x_m < at_m);
            let first = below.saturating_sub(TAPS / 2).min(nodes.len() - TAPS);
            let used = &nodes[first..first + TAPS];
            let position_m: [f64; TAPS] = std::array::from_fn(|i| used[i].0);
            let mut taps: Vec<(usize, f64)> = Vec::new();
            let mut from_walls = 0.0;
            for ((_, node), weight) in used.iter().zip(derivative_weights(position_m, at_m)) {
                match *node {
                    Node::Wall(value) => from_walls += weight * value,
                    Node::Cell(cell) => match taps.iter_mut().find(|(c, _)| *c == cell) {
                        Some((_, sum)) => *sum += weight,
                        None => taps.push((cell, weight)),
                    },
                }
            }
            (taps, from_walls)
        };
        let (taps, from_walls) = (0..faces).map(at_face).unzip();
        Self { taps, from_walls }
    }
}

/// The centres with what continues them at both ends, in increasing order.
fn extended(direction: &Direction, component: usize) -> Vec<(f64, Node)> {
    let n = direction.cells;
    let centre = |i: usize| direction.at(i as f64 + 0.5).0;
    let mut nodes: Vec<(f64, Node)> = (0..n).map(|i| (centre(i), Node::Cell(i))).collect();
    match direction.ends {
        Ends::Periodic => {
            let length_m = direction.length_m();
            for i in 0..TAPS / 2 {
                nodes.push((centre(i) + length_m, Node::Cell(i)));
                nodes.push((centre(n - 1 - i) - length_m, Node::Cell(n - 1 - i)));
            }
        }
        Ends::Walls { low, high } => {
            for (wall, at_m, cell) in [(low, direction.low_m, 0), (high, direction.high_m, n - 1)] {
                match wall {
                    Wall::NoSlip { velocity_m_s } => {
                        nodes.push((at_m, Node::Wall(velocity_m_s[component])))
                    }
                    Wall::Slip => {
                        for i in 0..TAPS / 2 {
                            let cell = if cell == 0 { i } else { cell - i };
                            nodes.push((2.0 * at_m - centre(cell), Node::Cell(cell)));
                        }
                    }
                }
            }
        }
    }
    nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
    nodes
}

/// Weights of the derivative at `at_m` of the cubic through four positions.
fn derivative_weights(position_m: [f64; TAPS], at_m: f64) -> [f64; TAPS] {
    std::array::from_fn(|i| {
        let others = || (0..TAPS).filter(move |j| *j != i);
        let scale: f64 = others().map(|j| position_m[i] - position_m[j]).product();
        let sum: f64 = others()
            .map(|left_out| {
                others()
                    .filter(|j| *j != left_out)
                    .map(|j| at_m - position_m[j])
                    .product::<f64>()
            })
            .sum();
        sum / scale
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::mesh::{Direction, Wall};
    use crate::solver::settings::{FlowSettings, TimeStep};
    use std::f64::consts::{PI, TAU};

    fn start(cells: usize, viscosity: f64, field: impl Fn([f64; 3]) -> [f64; 3] + Sync) -> Flow {
        let periodic = || Direction::periodic(cells, 0.0, 2.0);
        let z = Direction::between(cells / 2, 0.0, 1.0, Wall::Slip, Wall::Slip);
        let settings = FlowSettings::new(viscosity, TimeStep::Fixed { step_s: 1e-4 });
        Flow::new(
            Mesh::new(periodic(), periodic(), z).unwrap(),
            settings,
            field,
        )
        .unwrap()
        .0
    }

    /// Free of divergence, no flow through the planes, different in all directions.
    fn field([x, y, z]: [f64; 3]) -> [f64; 3] {
        let (sx, cx) = (PI * x).sin_cos();
        let (sy, cy) = (PI * y).sin_cos();
        let (sz, cz) = (PI * z).sin_cos();
        [sx * cy * cz + 0.3 * sy, cx * sy * cz, -2.0 * cx * cy * sz]
    }

    #[test]
    fn magnitude_is_that_of_the_closed_form_and_enstrophy_that_of_the_dissipation() {
        let magnitude = |[x, y, z]: [f64; 3]| {
            let (sx, cx) = (PI * x).sin_cos();
            let (sy, cy) = (PI * y).sin_cos();
            let (sz, _) = (PI * z).sin_cos();
            let w = [3.0 * cx * sy * sz, -3.0 * sx * cy * sz, -0.3 * cy];
            PI * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]).sqrt()
        };
        let flow = start(48, 0.01, field);
        let found = flow.own_vorticity_magnitude_per_s().unwrap();
        let (x_m, y_m, z_m) = (
            flow.mesh().centre_m(0),
            flow.mesh().centre_m(1),
            flow.mesh().centre_m(2),
        );
        let largest = 3.0 * PI;
        for (place, found) in found.iter().enumerate() {
            let expected = magnitude([x_m[place % 48], y_m[place / 48 % 48], z_m[place / 48 / 48]]);
            assert!(
                (found - expected).abs() < 0.005 * largest,
                "{place}: {found} for {expected}"
            );
        }
        // -dE/dt = nu int omega^2 = 2 nu times the enstrophy, between planes without friction.
        let curl = Curl::new(flow.mesh()).unwrap();
        let enstrophy = curl.enstrophy_m2_s2(&flow.faces().unwrap()).unwrap();
        let mut flow = flow;
        let power = flow.step().unwrap().viscous_power_m5_s3 / 2.0;
        assert!(
            (-power / (2.0 * 0.01 * enstrophy) - 1.0).abs() < 1e-4,
            "{power} for {enstrophy}"
        );
    }

    #[test]
    fn a_plane_flow_has_the_vorticity_of_its_circulation() {
        let mesh = Mesh::new(
            Direction::thin(1.0),
            Direction::periodic(32, 0.0, 2.0),
            Direction::between(32, 0.0, 1.0, Wall::Slip, Wall::Slip),
        )
        .unwrap();
        let curl = Curl::new(&mesh).unwrap();
        let settings = FlowSettings::new(0.0, TimeStep::Fixed { step_s: 1e-3 });
        let stream = |[_, y, z]: [f64; 3]| {
            [
                0.0,
                (PI * y).sin() * (PI * z).cos(),
                -(PI * y).cos() * (PI * z).sin(),
            ]
        };
        let (flow, _) = Flow::new(mesh, settings, stream).unwrap();
        let velocity = flow.faces().unwrap();
        let mut row = [0.0];
        for (j, k) in [(3, 5), (17, 30), (8, 16)] {
            curl.row(&velocity, 0, j, k, &mut row);
            let (y, z) = (flow.mesh().face_m(1)[j], flow.mesh().face_m(2)[k]);
            let expected = TAU * (PI * y).sin() * (PI * z).sin();
            assert!(
                (row[0] - expected).abs() < 2e-4 * TAU,
                "{} for {expected}",
                row[0]
            );
        }
    }
}

#[cfg(test)]
mod slope_tests {
    use super::*;
    use crate::solver::mesh::Spread;

    fn derive(direction: &Direction, component: usize, field: impl Fn(f64) -> f64) -> Vec<f64> {
        let slope = Slope::new(direction, component);
        let value = |i: usize| field(direction.at(i as f64 + 0.5).0);
        let sum = |taps: &Vec<(usize, f64)>| taps.iter().map(|(i, w)| w * value(*i)).sum::<f64>();
        slope
            .taps
            .iter()
            .zip(&slope.from_walls)
            .map(|(taps, wall)| sum(taps) + wall)
            .collect()
    }

    #[test]
    fn cubics_that_meet_a_moving_wall_are_exact_and_mirror_images_flat() {
        let belt = Wall::NoSlip {
            velocity_m_s: [0.0, 0.7, 0.0],
        };
        let line =
            Direction::between(16, 0.0, 2.0, belt, Wall::Slip).stretched(Spread::TanhLow.by(1.5));
        let found = derive(&line, 1, |z| 0.7 + 2.0 * z - 3.0 * z * z + z.powi(3));
        // The last two faces see the mirror image in the plane at the top.
        for (k, slope) in found.iter().enumerate().take(15) {
            let z = line.at(k as f64).0;
            assert!(
                (slope - (2.0 - 6.0 * z + 3.0 * z * z)).abs() < 1e-11,
                "{k}: {slope}"
            );
        }
        assert!(found[16].abs() < 1e-11, "flat at the plane");
        // Of another component the wall is at rest.
        assert!((derive(&line, 0, |z| 4.0 * z)[0] - 4.0).abs() < 1e-11);
    }

    #[test]
    fn periodic_lines_go_round() {
        let tau = std::f64::consts::TAU;
        let line = Direction::periodic(64, -1.0, 1.0);
        for (j, slope) in derive(&line, 2, |y| (0.5 * tau * y).sin())
            .iter()
            .enumerate()
        {
            let exact = 0.5 * tau * (0.5 * tau * line.at(j as f64).0).cos();
            assert!((slope - exact).abs() < 2e-4, "{j}: {slope} for {exact}");
        }
        assert!(derive(&Direction::thin(1.0), 0, |_| 1.0) == [0.0]);
    }
}
