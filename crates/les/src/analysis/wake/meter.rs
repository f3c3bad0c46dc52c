//! The meter: follows the two vortices of a wake from record to record.
//!
//! Check: an analytic pair with its images on a mesh: centres, circulation against radius, secondary vortices, spread.

use rayon::prelude::*;

use super::cores::{Core, EdgeGrid, EdgePlane};
use super::record::{SecondaryRecord, VortexRecord, WakeRecord, WakeScales};
use super::spectrum::mode_energies_m4_s2;
use super::vorticity::Curl;
use crate::analysis::circulation::circulation_m2_s;
use crate::error::{Error, check};
use crate::ranks::Ranks;
use crate::solver::flow::Flow;
use crate::solver::mesh::{Ends, Mesh};
use crate::solver::planes::Faces;
use crate::winds::{GridSnapshot, OutsidePolicy};

/// Radius of the circle of a centroid, in `b0`.
const CORE_RADIUS: f64 = 0.15;
/// Height above which vorticity counts as that of secondary vortices, in `b0`.
const ABOVE_LAYER: f64 = 0.15;
/// A secondary vortex has at least this share of `Gamma0` in its circle.
const LEAST_SECONDARY: f64 = 0.01;
/// Radii that are averaged for `Gamma_5-15`.
const WINDOW_RADII: usize = 21;
/// Radii of the profile, and their spacing in `b0`.
const PROFILE: (usize, f64) = (24, 0.025);
/// Points on a circle.
const POINTS: usize = 96;
/// 5 and 15 m of a spacing of 47 m.
const WINDOW: [f64; 2] = [5.0 / 47.0, 15.0 / 47.0];

/// Measures wakes on one mesh; it remembers where the vortices were.
#[derive(Debug, Clone)]
pub struct WakeMeter {
    scales: WakeScales,
    window: [f64; 2],
    core_radius: f64,
    curl: Curl,
    grid: EdgeGrid,
    viscosity_m2_s: f64,
    first_height_m: f64,
    /// The last two times and centres of the left, then of the right vortex.
    track: [[Fix; 2]; 2],
}

/// Where a vortex was: time, y, z.
type Fix = [f64; 3];

impl WakeMeter {
    /// A meter for flows on `mesh` whose vortices are at `centres_m`, left then right, as (y, z), when it is first used.
    ///
    /// # Errors
    /// [`Error::BadDirection`] unless x is periodic and z bounded; scales out of range.
    pub fn new(
        mesh: &Mesh,
        viscosity_m2_s: f64,
        scales: WakeScales,
        centres_m: [[f64; 2]; 2],
    ) -> Result<Self, Error> {
        scales.validate()?;
        let curl = Curl::new(mesh)?;
        let lateral = &mesh.directions()[1];
        let [y_m, z_m] = [1, 2].map(|d| mesh.face_m(d)[..curl.faces[d]].to_vec());
        let [_, y_length_m, z_length_m] = curl.face_m.clone();
        let period_m = (lateral.ends == Ends::Periodic).then(|| lateral.length_m());
        Ok(Self {
            scales,
            window: WINDOW,
            core_radius: CORE_RADIUS,
            grid: EdgeGrid {
                y_m,
                z_m,
                y_length_m,
                z_length_m,
                period_m,
            },
            viscosity_m2_s,
            first_height_m: mesh.centre_m(2)[0] - mesh.face_m(2)[0],
            track: centres_m.map(|[y, z]| [[f64::NAN; 3], [f64::NAN, y, z]]),
            curl,
        })
    }

    /// The same with another window of radii, in `b0`, for `Gamma_5-15`; by default that of 5 to 15 m at `b0` = 47 m.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless the radii are positive and increase.
    pub fn with_window(self, window: [f64; 2]) -> Result<Self, Error> {
        check("radius of the window", window[0], "positive", |r| r > 0.0)?;
        check("radius of the window", window[1], "above the first", |r| {
            r > window[0]
        })?;
        Ok(Self { window, ..self })
    }

    /// The same with another radius, in `b0`, of the circle of a centroid, 0.15 by default. A small one finds the place of the
    /// strongest vorticity.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a radius that is not positive.
    pub fn with_core_radius(self, core_radius: f64) -> Result<Self, Error> {
        check("core_radius", core_radius, "positive", |r| r > 0.0)?;
        Ok(Self {
            core_radius,
            ..self
        })
    }

    /// The same, told how the two vortices move at first, `(v, w)` \[m/s\]: needed where they move by more than a core radius
    /// between the first two records.
    pub fn moving_with(mut self, velocity_m_s: [[f64; 2]; 2]) -> Self {
        for (track, velocity_m_s) in self.track.iter_mut().zip(velocity_m_s) {
            let unit_s = self.scales.time_unit_s();
            let [_, y_m, z_m] = track[1];
            track[1][0] = 0.0;
            track[0] = [
                -unit_s,
                y_m - velocity_m_s[0] * unit_s,
                z_m - velocity_m_s[1] * unit_s,
            ];
        }
        self
    }

    /// Radii of the circulation profile \[m\].
    pub fn radii_m(&self) -> Vec<f64> {
        (1..=PROFILE.0)
            .map(|i| i as f64 * PROFILE.1 * self.scales.spacing_m)
            .collect()
    }

    /// What the meter remembers, to be kept in a checkpoint.
    pub fn state(&self) -> [f64; 12] {
        std::array::from_fn(|i| self.track.as_flattened().as_flattened()[i])
    }

    /// Takes back what [`Self::state`] gave.
    pub fn restore(&mut self, state: [f64; 12]) {
        self.track
            .as_flattened_mut()
            .as_flattened_mut()
            .copy_from_slice(&state);
    }

    /// Measures the flow, which is on the mesh of the meter and not earlier than the one before. Of a flow on several ranks all
    /// must measure together, and all get the record.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`] for a flow on a mesh of other size; what the interpolation refuses; [`Error::RankLost`].
    pub fn measure(&mut self, flow: &Flow) -> Result<WakeRecord, Error> {
        let cells: usize = self.curl.cell_m.iter().map(Vec::len).product();
        crate::error::check_lengths(cells, flow.mesh().cells().iter().product())?;
        let seen = flow.faces()?;
        let plane = self.mean_vorticity(&seen)?;
        let wind = flow.plane_snapshot(&flow.mean_plane_of(&seen)?, OutsidePolicy::Mask)?;
        let radius_m = self.core_radius * self.scales.spacing_m;
        let time_s = flow.time_s();
        let core =
            |v: usize| seen.core(|| plane.core(guess(&self.track[v], time_s), SIGN[v], radius_m));
        let cores = [core(0)?, core(1)?];
        let mut tracks = self.track;
        for (track, core) in tracks.iter_mut().zip(&cores) {
            let [y_m, z_m] = core.map_or([f64::NAN; 2], |core| core.centre_m);
            // A second record at the same time corrects the first.
            if core.is_some() && track[1][0] == time_s {
                track[1] = [time_s, y_m, z_m];
            } else if core.is_some() {
                *track = [track[1], [time_s, y_m, z_m]];
            }
        }
        let centres_m = tracks.map(|track| [track[1][1], track[1][2]]);
        let (shear, wall_shear_per_s) = self.wall_shear(&seen)?;
        let vortex = |own: usize| {
            let (is_found, floor_m) = (cores[own].is_some(), ABOVE_LAYER * self.scales.spacing_m);
            let side = Side {
                plane: &plane,
                centres_m,
                own,
                is_found,
                floor_m,
            };
            let mut record = self.vortex(&seen, &side, &wind)?;
            let faces = self
                .grid
                .y_m
                .iter()
                .zip(&shear)
                .filter(|(y_m, _)| side.has(**y_m));
            record.outward_shear_per_s = faces
                .map(|(_, shear)| SIGN[own] * shear)
                .fold(f64::NAN, f64::min);
            Ok::<_, Error>(record)
        };
        let length_m: f64 = self.curl.cell_m[0].iter().sum();
        let friction_m_s = (self.viscosity_m2_s * wall_shear_per_s).sqrt();
        let wall_units = if friction_m_s > 0.0 {
            self.first_height_m * friction_m_s / self.viscosity_m2_s
        } else {
            0.0
        };
        let record = WakeRecord {
            time_s,
            left: vortex(0)?,
            right: vortex(1)?,
            energy_m4_s2: flow.kinetic_energy_m5_s2() / length_m,
            mode_energy_m4_s2: mode_energies_m4_s2(&self.curl, &seen)?,
            enstrophy_m2_s2: self.curl.enstrophy_m2_s2(&seen)?,
            wall_shear_per_s,
            wall_units,
        };
        self.track = tracks;
        Ok(record)
    }

    /// Axial vorticity averaged over x.
    fn mean_vorticity(&self, seen: &Faces) -> Result<EdgePlane<'_>, Error> {
        let (ny, x_m) = (self.grid.y_m.len(), &self.curl.cell_m[0]);
        let length_m: f64 = x_m.iter().sum();
        let own = self.curl.own_faces(seen.shape.own());
        let mut mean = vec![0.0; ny * own.len()];
        mean.par_chunks_mut(ny).zip(own).for_each(|(out, k)| {
            let mut row = vec![0.0; x_m.len()];
            for (j, out) in out.iter_mut().enumerate() {
                self.curl.row(seen, 0, j, k, &mut row);
                *out = row.iter().zip(x_m).map(|(w, x_m)| w * x_m).sum::<f64>() / length_m;
            }
        });
        let vorticity_per_s = seen.slabs.all_gather(mean)?;
        Ok(EdgePlane {
            grid: &self.grid,
            vorticity_per_s,
        })
    }

    /// The core in each cross-plane about the one of the mean; NaN where there is none. Each rank seeks it in some of the planes.
    fn slices(
        &self,
        seen: &Faces,
        about: Core,
        sign: f64,
        floor_m: f64,
    ) -> Result<Vec<[f64; 2]>, Error> {
        let radius_m = self.core_radius * self.scales.spacing_m;
        let (ny, nz, nx) = (
            self.grid.y_m.len(),
            self.grid.z_m.len(),
            self.curl.cell_m[0].len(),
        );
        let near = |k: &usize| {
            let z_m = self.grid.z_m[*k];
            z_m > floor_m && (z_m - about.centre_m[1]).abs() < 2.0 * radius_m
        };
        let lateral_m = |j: usize| self.grid.lateral_m(about.centre_m[0], self.grid.y_m[j]);
        let beside: Vec<usize> = (0..ny)
            .filter(|j| lateral_m(*j).abs() < 2.0 * radius_m)
            .collect();
        // Each rank gives the vorticity of its planes across z to all, and seeks in some planes across x.
        let own = self.curl.own_faces(seen.shape.own()).filter(near);
        let rows: Vec<[usize; 2]> = own
            .flat_map(|k| beside.iter().map(move |j| [*j, k]))
            .collect();
        let mut values = vec![0.0; rows.len() * nx];
        values
            .par_chunks_mut(nx)
            .zip(&rows)
            .for_each(|(row, [j, k])| self.curl.row(seen, 0, *j, *k, row));
        let values = seen.slabs.all_gather(values)?;
        let places: Vec<usize> = (0..nz)
            .filter(near)
            .flat_map(|k| beside.iter().map(move |j| k * ny + j))
            .collect();
        let (rank, count) = (seen.slabs.ranks.rank(), seen.slabs.ranks.count());
        let own: Vec<[f64; 2]> = (nx * rank / count..nx * (rank + 1) / count)
            .into_par_iter()
            .map(|i| {
                let mut plane = vec![0.0; ny * nz];
                let column = values.iter().skip(i).step_by(nx);
                places
                    .iter()
                    .zip(column)
                    .for_each(|(place, value)| plane[*place] = *value);
                let core = EdgePlane {
                    grid: &self.grid,
                    vorticity_per_s: plane,
                }
                .core(about.centre_m, sign, radius_m);
                core.map_or([f64::NAN; 2], |core| core.centre_m)
            })
            .collect();
        seen.slabs.planes(own)
    }

    fn vortex(
        &self,
        seen: &Faces,
        side: &Side<'_>,
        wind: &GridSnapshot,
    ) -> Result<VortexRecord, Error> {
        let (sign, centre_m) = (SIGN[side.own], side.centres_m[side.own]);
        let spacing_m = self.scales.spacing_m;
        let circulation = |radius_m: f64| circulation_m2_s(wind, centre_m, radius_m, 0.0, POINTS);
        let [from, to] = self.window.map(|r| r * spacing_m);
        let step_m = (to - from) / (WINDOW_RADII - 1) as f64;
        let mut mean = 0.0;
        for i in 0..WINDOW_RADII {
            mean += circulation(from + i as f64 * step_m)? / WINDOW_RADII as f64;
        }
        let gamma_m2_s = self
            .radii_m()
            .into_iter()
            .map(circulation)
            .collect::<Result<_, _>>()?;
        let slices_m = match seen.core(|| {
            side.plane
                .core(centre_m, sign, self.core_radius * spacing_m)
        })? {
            Some(core) if side.is_found => self.slices(seen, core, sign, f64::NEG_INFINITY)?,
            _ => vec![[f64::NAN; 2]; self.curl.cell_m[0].len()],
        };
        let [y_spread_m, z_spread_m] = spread(&slices_m);
        let missing = if side.is_found { 0.0 } else { f64::NAN };
        Ok(VortexRecord {
            y_m: centre_m[0] + missing,
            z_m: centre_m[1] + missing,
            slices_m,
            y_spread_m,
            z_spread_m,
            gamma_5_15_m2_s: mean + missing,
            gamma_m2_s,
            gamma_opposite_m2_s: side
                .plane
                .circulation_m2_s(-sign, |y_m, z_m| side.has_above(y_m, z_m)),
            secondary: self.secondary(seen, side)?,
            outward_shear_per_s: f64::NAN,
        })
    }

    fn secondary(&self, seen: &Faces, side: &Side<'_>) -> Result<SecondaryRecord, Error> {
        let sign = -SIGN[side.own];
        // The layer at the ground has vorticity of the same sign and would draw the centroid down.
        let mut upper = side.plane.clone();
        let below = self.grid.z_m.partition_point(|z_m| *z_m <= side.floor_m) * self.grid.y_m.len();
        upper.vorticity_per_s[..below].fill(0.0);
        let radius_m = self.core_radius * self.scales.spacing_m;
        // The first vortex of the other side has the same sign: a search that slides over to it has found nothing.
        let core_at = |guess_m: [f64; 2]| {
            upper
                .core(guess_m, sign, radius_m)
                .filter(|core| side.has(core.centre_m[0]))
        };
        let above = |y_m: f64, z_m: f64| side.has_above(y_m, z_m);
        let first = || side.plane.strongest_m(sign, above).and_then(core_at);
        // The strongest vorticity may be that of the sheet which the layer sends up: the vortex is then a second maximum.
        let apart = |y_m: f64, z_m: f64, core: &Core| {
            side.plane
                .grid
                .lateral_m(core.centre_m[0], y_m)
                .hypot(z_m - core.centre_m[1])
                > 2.0 * radius_m
        };
        let second = |core: Core| {
            side.plane
                .strongest_m(sign, |y_m, z_m| above(y_m, z_m) && apart(y_m, z_m, &core))
                .and_then(core_at)
        };
        let size = |core: &Core| core.circulation_m2_s.abs();
        let found = seen.core(|| {
            let first = first();
            first
                .into_iter()
                .chain(first.and_then(second))
                .max_by(|a, b| size(a).total_cmp(&size(b)))
        })?;
        let least_m2_s = LEAST_SECONDARY * self.scales.circulation_m2_s;
        Ok(match found {
            Some(core) if core.circulation_m2_s.abs() >= least_m2_s => {
                let [y_spread_m, z_spread_m] =
                    spread(&self.slices(seen, core, sign, side.floor_m)?);
                let ([y_m, z_m], gamma_m2_s) = (core.centre_m, core.circulation_m2_s);
                // Beside its own vortex, which is counted on over the sides.
                let own_y_m = side.centres_m[side.own][0];
                let y_m = own_y_m + side.plane.grid.lateral_m(own_y_m, y_m);
                SecondaryRecord {
                    y_m,
                    z_m,
                    y_spread_m,
                    z_spread_m,
                    gamma_m2_s,
                }
            }
            _ => SecondaryRecord::NONE,
        })
    }

    /// Lateral shear at the ground averaged over x, at the faces of y, and the largest magnitude of the shear anywhere.
    fn wall_shear(&self, seen: &Faces) -> Result<(Vec<f64>, f64), Error> {
        let (nx, ny) = (self.curl.cell_m[0].len(), self.curl.cell_m[1].len());
        // The first rank has the lowest planes.
        let mut found = seen.slabs.broadcast(|| {
            let (mut along, mut across) = (vec![0.0; nx], vec![0.0; nx]);
            let mut found = Vec::with_capacity(ny + 1);
            let mut largest = 0.0_f64;
            for j in 0..ny {
                // At the ground w does not vary, so that the vorticity is the shear.
                self.curl.row(seen, 0, j, 0, &mut across);
                self.curl.row(seen, 1, j, 0, &mut along);
                found.push(-across.iter().sum::<f64>() / nx as f64);
                largest = across
                    .iter()
                    .zip(&along)
                    .map(|(a, b)| a.hypot(*b))
                    .fold(largest, f64::max);
            }
            found.push(largest);
            found
        })?;
        let largest = found.pop().unwrap_or(f64::NAN);
        Ok((found, largest))
    }
}

impl Faces {
    /// The core that rank 0 finds: which planes are looked at depends on it.
    fn core(&self, find: impl FnOnce() -> Option<Core>) -> Result<Option<Core>, Error> {
        let numbers = |core: Core| vec![core.centre_m[0], core.centre_m[1], core.circulation_m2_s];
        let found = self
            .slabs
            .broadcast(|| find().map_or_else(Vec::new, numbers))?;
        let core = |&[y_m, z_m, circulation_m2_s]: &[f64; 3]| Core {
            centre_m: [y_m, z_m],
            circulation_m2_s,
        };
        Ok(found.first_chunk().map(core))
    }
}

/// Signs of the left and the right vortex.
const SIGN: [f64; 2] = [-1.0, 1.0];

/// The half of the cross-plane that is nearer to one of the two vortices.
struct Side<'a> {
    plane: &'a EdgePlane<'a>,
    centres_m: [[f64; 2]; 2],
    own: usize,
    /// Whether its vortex is there.
    is_found: bool,
    /// Height above which vorticity is not that of the layer at the ground \[m\].
    floor_m: f64,
}

impl Side<'_> {
    fn has(&self, y_m: f64) -> bool {
        let distance = |v: usize| self.plane.grid.lateral_m(self.centres_m[v][0], y_m).abs();
        distance(self.own) <= distance(1 - self.own)
    }

    fn has_above(&self, y_m: f64, z_m: f64) -> bool {
        z_m > self.floor_m && self.has(y_m)
    }
}

/// Where a vortex should be, from its last two places.
fn guess(track: &[Fix; 2], time_s: f64) -> [f64; 2] {
    let [before, last] = *track;
    let share = (time_s - last[0]) / (last[0] - before[0]);
    if !share.is_finite() {
        return [last[1], last[2]];
    }
    [1, 2].map(|c| last[c] + share * (last[c] - before[c]))
}

/// Standard deviations over the slices that have a centre.
fn spread(slices_m: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|c| {
        let values: Vec<f64> = slices_m
            .iter()
            .map(|s| s[c])
            .filter(|x| x.is_finite())
            .collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    })
}

#[cfg(test)]
#[path = "meter_tests.rs"]
mod tests;
