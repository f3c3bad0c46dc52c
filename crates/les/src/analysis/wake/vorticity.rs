//! The vorticity of a flow at the edges of its cells, and what is summed from it.
//!
//! Component `c` lies at the edges along `c`: at centres in its own direction, at faces in the two others. Differences are
//! of fourth order ([`Slope`]); the sums are trapezoidal, that of the enstrophy with an end correction at the ground.
//!
//! Check: solid rotation and sheared columns; enstrophy against the dissipation of a decaying exact flow.

use std::ops::Range;

use rayon::prelude::*;

use super::slope::Slope;
use crate::Error;
use crate::solver::flow::Flow;
use crate::solver::mesh::{Ends, Mesh, refused};
use crate::solver::planes::Faces;

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
            return Err(refused(0, "period", 0.0, "there: a wake repeats itself along the flight"));
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
            slope: std::array::from_fn(|along| std::array::from_fn(|c| Slope::new(&directions[along], c))),
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
                *out += sign * taps.iter().map(|(i, weight)| weight * values[*i]).sum::<f64>();
            }
            return;
        }
        let place = if along == 1 { j } else { k };
        for &(cell, weight) in &slope.taps[place] {
            let values = if along == 1 { row(cell, k) } else { row(j, cell) };
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
        if own.end == self.cells[2] { own.start..self.faces[2] } else { own }
    }

    /// Half the integral of the squared vorticity over the box, per length of x \[m^2/s^2\].
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    pub(super) fn enstrophy_m2_s2(&self, velocity: &Faces) -> Result<f64, Error> {
        let nx = self.cells[0];
        let component = |c: usize| {
            let weight = |d: usize| if c == d { &self.cell_m[d] } else { &self.face_m[d] };
            let (x_m, y_m) = (weight(0), weight(1));
            let z_m = if c == 2 { &self.cell_m[2] } else { &self.corrected_m };
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
            let planes = velocity.slabs.all_gather(own.into_par_iter().map(plane).collect())?;
            Ok(0.5 * planes.iter().zip(z_m).map(|(sum, z_m)| sum * z_m).sum::<f64>())
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
        out.par_chunks_mut(shape.plane()).zip(shape.own()).for_each(|(plane, k)| {
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
                    for &(j, k) in ys.iter().flat_map(|j| zs.iter().map(move |k| (*j, *k))).collect::<Vec<_>>().iter() {
                        self.row(velocity, c, j, k, &mut edges);
                        for i in 0..nx {
                            // Components 1 and 2 lie at the faces of x.
                            mean[i] += if c == 0 { edges[i] } else { 0.5 * (edges[i] + edges[next(0, i)]) };
                        }
                    }
                    let count = (ys.len() * zs.len()) as f64;
                    out.iter_mut().zip(&mean).for_each(|(out, mean)| *out += (mean / count).powi(2));
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
        Flow::new(Mesh::new(periodic(), periodic(), z).unwrap(), settings, field).unwrap().0
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
        let (x_m, y_m, z_m) = (flow.mesh().centre_m(0), flow.mesh().centre_m(1), flow.mesh().centre_m(2));
        let largest = 3.0 * PI;
        for (place, found) in found.iter().enumerate() {
            let expected = magnitude([x_m[place % 48], y_m[place / 48 % 48], z_m[place / 48 / 48]]);
            assert!((found - expected).abs() < 0.005 * largest, "{place}: {found} for {expected}");
        }
        // -dE/dt = nu int omega^2 = 2 nu times the enstrophy, between planes without friction.
        let curl = Curl::new(flow.mesh()).unwrap();
        let enstrophy = curl.enstrophy_m2_s2(&flow.faces().unwrap()).unwrap();
        let mut flow = flow;
        let power = flow.step().unwrap().viscous_power_m5_s3 / 2.0;
        assert!((-power / (2.0 * 0.01 * enstrophy) - 1.0).abs() < 1e-4, "{power} for {enstrophy}");
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
        let stream = |[_, y, z]: [f64; 3]| [0.0, (PI * y).sin() * (PI * z).cos(), -(PI * y).cos() * (PI * z).sin()];
        let (flow, _) = Flow::new(mesh, settings, stream).unwrap();
        let velocity = flow.faces().unwrap();
        let mut row = [0.0];
        for (j, k) in [(3, 5), (17, 30), (8, 16)] {
            curl.row(&velocity, 0, j, k, &mut row);
            let (y, z) = (flow.mesh().face_m(1)[j], flow.mesh().face_m(2)[k]);
            let expected = TAU * (PI * y).sin() * (PI * z).sin();
            assert!((row[0] - expected).abs() < 2e-4 * TAU, "{} for {expected}", row[0]);
        }
    }
}
