//! The vorticity of a flow at the edges of its cells, and what is summed from it.
//!
//! Component `c` lies at the edges along `c`: at centres in its own direction, at faces in the two
//! others. Differences are of fourth order ([`Slope`]); the sums are trapezoidal, that of the
//! enstrophy with an end correction at the ground.
//!
//! Differences take four values about each face, weighted so that cubics of the position are exact.
//! At a frictionless plane the field is continued by its mirror image, at a no-slip wall the value
//! at the wall is one of the four.
//!
//! Check: solid rotation and sheared columns; enstrophy against the dissipation of a decaying exact
//! flow; cubics, mirror images, periods.

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
    /// The same along z with Gregory's end correction at the ground: the squared vorticity falls
    /// steeply there.
    corrected_m: Vec<f64>,
}

impl Curl {
    /// # Errors
    /// [`Error::BadDirection`] if x is bounded or z periodic: that is no wake above ground.
    pub(super) fn new(mesh: &Mesh) -> Result<Self, Error> {
        let directions = mesh.directions();
        if directions[0].ends != Ends::Periodic {
            let allowed = "there: a wake repeats itself along the flight";
            return Err(refused(0, "period", 0.0, allowed));
        }
        if directions[2].ends == Ends::Periodic {
            return Err(refused(2, "ground", 0.0, "there: z must be bounded"));
        }
        let face_m = [0, 1, 2].map(|d| lengths_about_faces_m(mesh, d));
        let mut corrected_m = face_m[2].clone();
        for (length_m, factor) in corrected_m.iter_mut().zip(GREGORY) {
            *length_m *= factor;
        }
        Ok(Self {
            corrected_m,
            cells: mesh.cells(),
            faces: face_m.each_ref().map(Vec::len),
            slope: std::array::from_fn(|along| {
                std::array::from_fn(|c| Slope::new(&directions[along], c))
            }),
            cell_m: [0, 1, 2].map(|d| cell_lengths_m(mesh, d)),
            face_m,
        })
    }

    /// Vorticity component `c` in the row along x at the places `j`, `k` (of faces or centres as
    /// `c` has it) \[1/s\].
    pub(super) fn row(&self, velocity: &Faces, c: usize, j: usize, k: usize, out: &mut [f64]) {
        // curl_c = d_a u_b - d_b u_a with (c, a, b) cyclic.
        let a = (c + 1) % 3;
        let b = (c + 2) % 3;
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
        if along == 0 {
            let values = self.stored_row(velocity, component, j, k);
            if values.is_empty() {
                return;
            }
            for (out, taps) in out.iter_mut().zip(&slope.taps) {
                let sum: f64 = taps.iter().map(|(i, weight)| weight * values[*i]).sum();
                *out += sign * sum;
            }
            return;
        }
        let place = if along == 1 { j } else { k };
        for &(cell, weight) in &slope.taps[place] {
            let [j, k] = if along == 1 { [cell, k] } else { [j, cell] };
            let values = self.stored_row(velocity, component, j, k);
            for (out, value) in out.iter_mut().zip(values) {
                *out += sign * weight * value;
            }
        }
        let wall = slope.from_walls[place];
        if wall != 0.0 {
            out.iter_mut().for_each(|out| *out += sign * wall);
        }
    }

    /// A row of a component; empty at the high walls, which are not stored and through which
    /// nothing flows.
    fn stored_row<'a>(
        &self,
        velocity: &'a Faces,
        component: usize,
        j: usize,
        k: usize,
    ) -> &'a [f64] {
        let [_, ny, nz] = self.cells;
        if (component == 1 && j == ny) || (component == 2 && k == nz) {
            return &[];
        }
        &velocity.field[component][velocity.shape.row(j, k)]
    }

    /// The faces across z of the cells in the planes that are owned; the highest one is with the
    /// last cells.
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
        let components = [
            self.component_enstrophy(velocity, 0)?,
            self.component_enstrophy(velocity, 1)?,
            self.component_enstrophy(velocity, 2)?,
        ];
        Ok(components.iter().sum::<f64>() / self.cell_m[0].iter().sum::<f64>())
    }

    /// Half the integral of the square of one component over the box \[m^3/s^2\].
    fn component_enstrophy(&self, velocity: &Faces, c: usize) -> Result<f64, Error> {
        let own = velocity.shape.own();
        let own = if c == 2 { own } else { self.own_faces(own) };
        let z_m = if c == 2 {
            &self.cell_m[2]
        } else {
            &self.corrected_m
        };
        // Collected first, so that the order of the sum is that of the planes.
        let own: Vec<f64> = own
            .into_par_iter()
            .map(|k| self.plane_square(velocity, c, k))
            .collect();
        let planes = velocity.slabs.all_gather(own)?;
        let terms = planes.iter().zip(z_m).map(|(square, z_m)| square * z_m);
        Ok(0.5 * terms.sum::<f64>())
    }

    /// Integral of the square of one component over a plane across z \[m^2/s^2\].
    fn plane_square(&self, velocity: &Faces, c: usize, k: usize) -> f64 {
        let [x_m, y_m] = [0, 1].map(|d| {
            if c == d {
                &self.cell_m[d]
            } else {
                &self.face_m[d]
            }
        });
        let mut row = vec![0.0; self.cells[0]];
        let mut sum = 0.0;
        for (j, y_m) in y_m.iter().enumerate() {
            self.row(velocity, c, j, k, &mut row);
            sum += y_m * row.iter().zip(x_m).map(|(w, x_m)| x_m * w * w).sum::<f64>();
        }
        sum
    }

    /// Magnitude of the vorticity at the centres in the planes that are owned \[1/s\], `[z][y][x]`:
    /// each component is the mean of the four edges about the centre.
    fn magnitude_per_s(&self, velocity: &Faces) -> Vec<f64> {
        let shape = velocity.shape;
        let nx = self.cells[0];
        let mut out = vec![0.0; shape.own_range().len()];
        out.par_chunks_mut(shape.plane())
            .zip(shape.own())
            .for_each(|(plane, k)| {
                for (j, out) in plane.chunks_mut(nx).enumerate() {
                    for c in 0..3 {
                        let mean = self.row_at_centres(velocity, c, j, k);
                        for (out, mean) in out.iter_mut().zip(mean) {
                            *out += mean.powi(2);
                        }
                    }
                    out.iter_mut().for_each(|out| *out = out.sqrt());
                }
            });
        out
    }

    /// Vorticity component `c` at the centres of a row of cells: the mean of its edges about them.
    fn row_at_centres(&self, velocity: &Faces, c: usize, j: usize, k: usize) -> Vec<f64> {
        let nx = self.cells[0];
        let j_high = (j + 1) % self.faces[1];
        let k_high = (k + 1) % self.faces[2];
        let rows: &[[usize; 2]] = match c {
            0 => &[[j, k], [j, k_high], [j_high, k], [j_high, k_high]],
            1 => &[[j, k], [j, k_high]],
            _ => &[[j, k], [j_high, k]],
        };
        let mut edges = vec![0.0; nx];
        let mut mean = vec![0.0; nx];
        for &[j, k] in rows {
            self.row(velocity, c, j, k, &mut edges);
            for i in 0..nx {
                // Components 1 and 2 lie at the faces of x.
                mean[i] += if c == 0 {
                    edges[i]
                } else {
                    0.5 * (edges[i] + edges[(i + 1) % self.faces[0]])
                };
            }
        }
        let count = rows.len() as f64;
        mean.iter_mut().for_each(|mean| *mean /= count);
        mean
    }
}

/// Lengths of the cells of a direction \[m\].
fn cell_lengths_m(mesh: &Mesh, d: usize) -> Vec<f64> {
    mesh.face_m(d).windows(2).map(|w| w[1] - w[0]).collect()
}

/// Lengths about the faces of a direction, from centre to centre, half a cell at the ends \[m\].
fn lengths_about_faces_m(mesh: &Mesh, d: usize) -> Vec<f64> {
    let centre_m = mesh.centre_m(d);
    let face_m = mesh.face_m(d);
    let cells = centre_m.len();
    let mut lengths_m = vec![centre_m[0] - face_m[0]];
    lengths_m.extend(centre_m.windows(2).map(|w| w[1] - w[0]));
    let last_m = face_m[cells] - centre_m[cells - 1];
    if mesh.directions()[d].ends == Ends::Periodic {
        lengths_m[0] += last_m;
    } else {
        lengths_m.push(last_m);
    }
    lengths_m
}

impl Flow {
    /// Magnitude of the vorticity at the centres of the cells in the planes of [`Self::own_planes`]
    /// \[1/s\], `[z][y][x]`, for flows that are periodic in x and bounded in z.
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
    /// The operator for the component `component` (0, 1, 2 for x, y, z), at the faces 0 to `n` (0
    /// to `n - 1` if periodic).
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
        let mut slope = Self {
            taps: Vec::with_capacity(faces),
            from_walls: Vec::with_capacity(faces),
        };
        for face in 0..faces {
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
            slope.taps.push(taps);
            slope.from_walls.push(from_walls);
        }
        slope
    }
}

/// The centres with what continues them at both ends, in increasing order.
fn extended(direction: &Direction, component: usize) -> Vec<(f64, Node)> {
    let n = direction.cells;
    let centre_m: Vec<f64> = (0..n).map(|i| direction.at(i as f64 + 0.5).0).collect();
    let mut nodes: Vec<(f64, Node)> = Vec::with_capacity(n + TAPS);
    for (cell, &centre_m) in centre_m.iter().enumerate() {
        nodes.push((centre_m, Node::Cell(cell)));
    }
    match direction.ends {
        Ends::Periodic => {
            let length_m = direction.length_m();
            for low in 0..TAPS / 2 {
                let high = n - 1 - low;
                nodes.push((centre_m[low] + length_m, Node::Cell(low)));
                nodes.push((centre_m[high] - length_m, Node::Cell(high)));
            }
        }
        Ends::Walls { low, high } => {
            for (wall, at_m, cells) in [
                (low, direction.low_m, [0, 1]),
                (high, direction.high_m, [n - 1, n - 2]),
            ] {
                match wall {
                    Wall::NoSlip { velocity_m_s } => {
                        nodes.push((at_m, Node::Wall(velocity_m_s[component])))
                    }
                    Wall::Slip => nodes
                        .extend(cells.map(|cell| (2.0 * at_m - centre_m[cell], Node::Cell(cell)))),
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
        let mut scale = 1.0;
        let mut sum = 0.0;
        for omitted in (0..TAPS).filter(|j| *j != i) {
            scale *= position_m[i] - position_m[omitted];
            let factors = (0..TAPS).filter(|j| *j != i && *j != omitted);
            sum += factors.map(|j| at_m - position_m[j]).product::<f64>();
        }
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
        let x_m = flow.mesh().centre_m(0);
        let y_m = flow.mesh().centre_m(1);
        let z_m = flow.mesh().centre_m(2);
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
            let y = flow.mesh().face_m(1)[j];
            let z = flow.mesh().face_m(2)[k];
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
