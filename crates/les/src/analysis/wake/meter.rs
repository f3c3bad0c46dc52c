//! The meter: follows the two vortices of a wake from record to record.
//!
//! Check: an analytic pair with its images on a mesh: centres, circulation against radius,
//! secondary vortices, spread.

use rayon::prelude::*;

use super::cores::{Core, EdgeGrid};
use super::record::{SecondaryRecord, VortexRecord, WakeRecord, WakeScales};
use super::spectrum::mode_energies_m4_s2;
use super::vorticity::Curl;
use crate::analysis::circulation::circulation_m2_s;
use crate::error::{Error, check};
use crate::ranks::Ranks;
use crate::solver::flow::Flow;
use crate::solver::mesh::{Ends, Mesh};
use crate::solver::planes::Faces;
use crate::winds::GridSnapshot;

/// Radius of the circle of a centroid, in `b0`.
const CORE_RADIUS: f64 = 0.15;
/// Height above which vorticity counts as that of secondary vortices, in `b0`.
const ABOVE_LAYER: f64 = 0.15;
/// A secondary vortex has at least this fraction of `Gamma0` in its circle.
const LEAST_SECONDARY: f64 = 0.01;
/// Radii that are averaged for `Gamma_5-15`.
const WINDOW_RADII: usize = 21;
/// Radii of the profile.
const PROFILE_RADII: usize = 24;
/// Spacing of the radii of the profile, in `b0`.
const PROFILE_SPACING: f64 = 0.025;
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
    track: [[TrackPoint; 2]; 2],
}

/// Where a vortex was: time, y, z.
type TrackPoint = [f64; 3];

impl WakeMeter {
    /// A meter for flows on `mesh` whose vortices are at `centres_m`, left then right, as (y, z),
    /// when it is first used.
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

    /// The same with another window of radii, in `b0`, for `Gamma_5-15`; by default that of 5 to 15
    /// m at `b0` = 47 m.
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

    /// The same with another radius, in `b0`, of the circle of a centroid, 0.15 by default. A small
    /// one finds the place of the strongest vorticity.
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

    /// The same meter with the initial velocities of the two vortices, `(v, w)` \[m/s\]: needed
    /// where they move by more than a core radius between the first two records.
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
        (1..=PROFILE_RADII)
            .map(|i| i as f64 * PROFILE_SPACING * self.scales.spacing_m)
            .collect()
    }

    /// The last positions of the vortices, to be stored in a checkpoint.
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

    /// Measures the flow, which is on the mesh of the meter and not earlier than the one before. Of
    /// a flow on several ranks all must measure together, and all get the record.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`] for a flow on a mesh of other size; what the interpolation
    /// refuses; [`Error::RankLost`].
    pub fn measure(&mut self, flow: &Flow) -> Result<WakeRecord, Error> {
        let cells: usize = self.curl.cell_m.iter().map(Vec::len).product();
        crate::error::check_lengths(cells, flow.mesh().cells().iter().product())?;
        let faces = flow.faces()?;
        let vorticity_per_s = self.mean_vorticity_per_s(&faces)?;
        let wind = flow.plane_snapshot(&flow.mean_plane_of(&faces)?)?;
        let time_s = flow.time_s();
        let radius_m = self.core_radius * self.scales.spacing_m;
        let mut cores = [None; 2];
        for (v, core) in cores.iter_mut().enumerate() {
            let guess_m = guess(&self.track[v], time_s);
            *core = faces.core(|| self.grid.core(&vorticity_per_s, guess_m, SIGN[v], radius_m))?;
        }
        let mut tracks = self.track;
        for (track, core) in tracks.iter_mut().zip(&cores) {
            follow(track, *core, time_s);
        }
        let centres_m = tracks.map(|track| [track[1][1], track[1][2]]);
        let (shear_per_s, wall_shear_per_s) = self.wall_shear(&faces)?;
        let [left, right] = [0, 1].map(|own| Side {
            grid: &self.grid,
            vorticity_per_s: &vorticity_per_s,
            centres_m,
            own,
            is_found: cores[own].is_some(),
            floor_m: ABOVE_LAYER * self.scales.spacing_m,
        });
        let length_m: f64 = self.curl.cell_m[0].iter().sum();
        let record = WakeRecord {
            time_s,
            left: self.vortex(&faces, &left, &wind, &shear_per_s)?,
            right: self.vortex(&faces, &right, &wind, &shear_per_s)?,
            energy_m4_s2: flow.kinetic_energy_m5_s2() / length_m,
            mode_energy_m4_s2: mode_energies_m4_s2(&self.curl, &faces)?,
            enstrophy_m2_s2: self.curl.enstrophy_m2_s2(&faces)?,
            wall_shear_per_s,
            wall_units: self.wall_units(wall_shear_per_s),
        };
        self.track = tracks;
        Ok(record)
    }

    /// Height of the first centre in wall units of a shear; 0 without friction.
    fn wall_units(&self, wall_shear_per_s: f64) -> f64 {
        let friction_m_s = (self.viscosity_m2_s * wall_shear_per_s).sqrt();
        if friction_m_s > 0.0 {
            self.first_height_m * friction_m_s / self.viscosity_m2_s
        } else {
            0.0
        }
    }

    /// Axial vorticity averaged over x \[1/s\], `[z][y]`.
    fn mean_vorticity_per_s(&self, faces: &Faces) -> Result<Vec<f64>, Error> {
        let ny = self.grid.y_m.len();
        let x_m = &self.curl.cell_m[0];
        let length_m: f64 = x_m.iter().sum();
        let own = self.curl.own_faces(faces.shape.own());
        let mut mean = vec![0.0; ny * own.len()];
        mean.par_chunks_mut(ny).zip(own).for_each(|(out, k)| {
            let mut row = vec![0.0; x_m.len()];
            for (j, out) in out.iter_mut().enumerate() {
                self.curl.row(faces, 0, j, k, &mut row);
                *out = row.iter().zip(x_m).map(|(w, x_m)| w * x_m).sum::<f64>() / length_m;
            }
        });
        faces.slabs.all_gather(mean)
    }

    /// The core in each cross-plane about the one of the mean; NaN where there is none. Each rank
    /// seeks it in some of the planes.
    fn slices(
        &self,
        faces: &Faces,
        mean: Core,
        sign: f64,
        floor_m: f64,
    ) -> Result<Vec<[f64; 2]>, Error> {
        let radius_m = self.core_radius * self.scales.spacing_m;
        let grid = &self.grid;
        let ny = grid.y_m.len();
        let nz = grid.z_m.len();
        let nx = self.curl.cell_m[0].len();
        let near_z: Vec<usize> = (0..nz)
            .filter(|&k| {
                let dz_m = grid.z_m[k] - mean.centre_m[1];
                grid.z_m[k] > floor_m && dz_m.abs() < 2.0 * radius_m
            })
            .collect();
        let near_y: Vec<usize> = (0..ny)
            .filter(|&j| grid.lateral_m(mean.centre_m[0], grid.y_m[j]).abs() < 2.0 * radius_m)
            .collect();
        // Each rank gives the vorticity of its planes across z to all, and seeks in some planes
        // across x.
        let own_z = self.curl.own_faces(faces.shape.own());
        let mut own_rows = Vec::new();
        let mut places = Vec::with_capacity(near_z.len() * near_y.len());
        for &k in &near_z {
            for &j in &near_y {
                places.push(k * ny + j);
                if own_z.contains(&k) {
                    own_rows.push([j, k]);
                }
            }
        }
        let mut values = vec![0.0; own_rows.len() * nx];
        values
            .par_chunks_mut(nx)
            .zip(&own_rows)
            .for_each(|(row, [j, k])| self.curl.row(faces, 0, *j, *k, row));
        let values = faces.slabs.all_gather(values)?;
        let rank = faces.slabs.ranks.rank();
        let count = faces.slabs.ranks.count();
        let own: Vec<[f64; 2]> = (nx * rank / count..nx * (rank + 1) / count)
            .into_par_iter()
            .map(|i| {
                let mut vorticity_per_s = vec![0.0; ny * nz];
                for (place, row) in places.iter().zip(values.chunks(nx)) {
                    vorticity_per_s[*place] = row[i];
                }
                let core = grid.core(&vorticity_per_s, mean.centre_m, sign, radius_m);
                core.map_or([f64::NAN; 2], |core| core.centre_m)
            })
            .collect();
        faces.slabs.planes(own)
    }

    /// The record of the vortex of a side; `shear_per_s` is the lateral shear at the ground.
    fn vortex(
        &self,
        faces: &Faces,
        side: &Side<'_>,
        wind: &GridSnapshot,
        shear_per_s: &[f64],
    ) -> Result<VortexRecord, Error> {
        let sign = SIGN[side.own];
        let centre_m = side.centres_m[side.own];
        let spacing_m = self.scales.spacing_m;
        let [from, to] = self.window.map(|r| r * spacing_m);
        let step_m = (to - from) / (WINDOW_RADII - 1) as f64;
        let mut mean = 0.0;
        for i in 0..WINDOW_RADII {
            let radius_m = from + i as f64 * step_m;
            let gamma_m2_s = circulation_m2_s(wind, centre_m, radius_m, 0.0, POINTS)?;
            mean += gamma_m2_s / WINDOW_RADII as f64;
        }
        let mut gamma_m2_s = Vec::with_capacity(PROFILE_RADII);
        for radius_m in self.radii_m() {
            gamma_m2_s.push(circulation_m2_s(wind, centre_m, radius_m, 0.0, POINTS)?);
        }
        let radius_m = self.core_radius * spacing_m;
        let found = faces.core(|| {
            self.grid
                .core(side.vorticity_per_s, centre_m, sign, radius_m)
        })?;
        let slices_m = match found {
            Some(core) if side.is_found => self.slices(faces, core, sign, f64::NEG_INFINITY)?,
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
            gamma_opposite_m2_s: self.grid.circulation_m2_s(
                side.vorticity_per_s,
                -sign,
                |y_m, z_m| side.has_above(y_m, z_m),
            ),
            secondary: self.secondary(faces, side)?,
            outward_shear_per_s: self.outward_shear_per_s(side, shear_per_s),
        })
    }

    /// Least outward shear at the ground of a side.
    fn outward_shear_per_s(&self, side: &Side<'_>, shear_per_s: &[f64]) -> f64 {
        let mut least = f64::NAN;
        for (y_m, shear_per_s) in self.grid.y_m.iter().zip(shear_per_s) {
            if side.has(*y_m) {
                least = least.min(SIGN[side.own] * shear_per_s);
            }
        }
        least
    }

    fn secondary(&self, faces: &Faces, side: &Side<'_>) -> Result<SecondaryRecord, Error> {
        let found = faces.core(|| self.secondary_core(side))?;
        let least_m2_s = LEAST_SECONDARY * self.scales.circulation_m2_s;
        let Some(core) = found.filter(|core| core.circulation_m2_s.abs() >= least_m2_s) else {
            return Ok(SecondaryRecord::NONE);
        };
        let slices_m = self.slices(faces, core, -SIGN[side.own], side.floor_m)?;
        let [y_spread_m, z_spread_m] = spread(&slices_m);
        // Beside its own vortex, whose y may lie beyond the ends of a periodic box.
        let own_y_m = side.centres_m[side.own][0];
        let [y_m, z_m] = core.centre_m;
        Ok(SecondaryRecord {
            y_m: own_y_m + self.grid.lateral_m(own_y_m, y_m),
            z_m,
            y_spread_m,
            z_spread_m,
            gamma_m2_s: core.circulation_m2_s,
        })
    }

    /// The strongest secondary vortex of a side: about the strongest vorticity of the other sign,
    /// or, as that may be in the sheet which the layer sends up, about the strongest one apart from
    /// it.
    fn secondary_core(&self, side: &Side<'_>) -> Option<Core> {
        let sign = -SIGN[side.own];
        let radius_m = self.core_radius * self.scales.spacing_m;
        // The layer at the ground has vorticity of the same sign and would draw the centroid down.
        let grid = &self.grid;
        let mut upper_per_s = side.vorticity_per_s.to_vec();
        let rows_below = grid.z_m.partition_point(|z_m| *z_m <= side.floor_m);
        upper_per_s[..rows_below * grid.y_m.len()].fill(0.0);
        let first_guess_m = grid.strongest_m(side.vorticity_per_s, sign, |y_m, z_m| {
            side.has_above(y_m, z_m)
        })?;
        let first = side.core_in(&upper_per_s, first_guess_m, radius_m)?;
        let second_guess_m = grid.strongest_m(side.vorticity_per_s, sign, |y_m, z_m| {
            let dy_m = grid.lateral_m(first.centre_m[0], y_m);
            let dz_m = z_m - first.centre_m[1];
            side.has_above(y_m, z_m) && dy_m.hypot(dz_m) > 2.0 * radius_m
        });
        let second =
            second_guess_m.and_then(|guess_m| side.core_in(&upper_per_s, guess_m, radius_m));
        match second {
            Some(second) if second.circulation_m2_s.abs() >= first.circulation_m2_s.abs() => {
                Some(second)
            }
            _ => Some(first),
        }
    }

    /// Lateral shear at the ground averaged over x, at the faces of y, and the largest magnitude of
    /// the shear anywhere.
    fn wall_shear(&self, faces: &Faces) -> Result<(Vec<f64>, f64), Error> {
        let nx = self.curl.cell_m[0].len();
        let ny = self.curl.cell_m[1].len();
        // The first rank has the lowest planes.
        let mut found = faces.slabs.broadcast(|| {
            let mut along = vec![0.0; nx];
            let mut across = vec![0.0; nx];
            let mut found = Vec::with_capacity(ny + 1);
            let mut largest = 0.0_f64;
            for j in 0..ny {
                // At the ground w does not vary, so that the vorticity is the shear.
                self.curl.row(faces, 0, j, 0, &mut across);
                self.curl.row(faces, 1, j, 0, &mut along);
                found.push(-across.iter().sum::<f64>() / nx as f64);
                for (a, b) in across.iter().zip(&along) {
                    largest = largest.max(a.hypot(*b));
                }
            }
            found.push(largest);
            found
        })?;
        let largest = found.pop().unwrap_or(f64::NAN);
        Ok((found, largest))
    }
}

impl Faces {
    /// The core that rank 0 finds: which planes are searched depends on it.
    fn core(&self, find: impl FnOnce() -> Option<Core>) -> Result<Option<Core>, Error> {
        let found = self.slabs.broadcast(|| match find() {
            Some(core) => vec![core.centre_m[0], core.centre_m[1], core.circulation_m2_s],
            None => Vec::new(),
        })?;
        let [y_m, z_m, circulation_m2_s] = found[..] else {
            return Ok(None);
        };
        Ok(Some(Core {
            centre_m: [y_m, z_m],
            circulation_m2_s,
        }))
    }
}

/// Signs of the left and the right vortex.
const SIGN: [f64; 2] = [-1.0, 1.0];

/// The half of the cross-plane that is nearer to one of the two vortices.
struct Side<'a> {
    grid: &'a EdgeGrid,
    /// Axial vorticity averaged over x \[1/s\].
    vorticity_per_s: &'a [f64],
    centres_m: [[f64; 2]; 2],
    own: usize,
    /// Whether its vortex is there.
    is_found: bool,
    /// Height above which vorticity is not that of the layer at the ground \[m\].
    floor_m: f64,
}

impl Side<'_> {
    fn has(&self, y_m: f64) -> bool {
        let distances_m = self
            .centres_m
            .map(|[centre_y_m, _]| self.grid.lateral_m(centre_y_m, y_m).abs());
        distances_m[self.own] <= distances_m[1 - self.own]
    }

    fn has_above(&self, y_m: f64, z_m: f64) -> bool {
        z_m > self.floor_m && self.has(y_m)
    }

    /// The secondary vortex about a guess. The first vortex of the other side has the same sign: a
    /// search that slides over to it has found nothing.
    fn core_in(&self, upper_per_s: &[f64], guess_m: [f64; 2], radius_m: f64) -> Option<Core> {
        let core = self
            .grid
            .core(upper_per_s, guess_m, -SIGN[self.own], radius_m)?;
        self.has(core.centre_m[0]).then_some(core)
    }
}

/// Adds the position of a core at a time to a track; a second record at the same time corrects the
/// first.
fn follow(track: &mut [TrackPoint; 2], core: Option<Core>, time_s: f64) {
    let Some(core) = core else { return };
    let point = [time_s, core.centre_m[0], core.centre_m[1]];
    if track[1][0] == time_s {
        track[1] = point;
    } else {
        *track = [track[1], point];
    }
}

/// Where a vortex should be, from its last two places.
fn guess(track: &[TrackPoint; 2], time_s: f64) -> [f64; 2] {
    let [before, last] = *track;
    let fraction = (time_s - last[0]) / (last[0] - before[0]);
    if !fraction.is_finite() {
        return [last[1], last[2]];
    }
    [1, 2].map(|c| last[c] + fraction * (last[c] - before[c]))
}

/// Standard deviations over the slices that have a centre.
fn spread(slices_m: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|c| {
        let values = slices_m.iter().map(|s| s[c]);
        let values: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        (squares / count).sqrt()
    })
}

#[cfg(test)]
#[path = "meter_tests.rs"]
mod tests;
