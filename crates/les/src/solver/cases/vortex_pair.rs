//! A wake-vortex pair that sinks towards the ground, in the units of the pair: `b0 = V0 = 1`, so that time is `tau` and
//! `Gamma0 = 2 pi`.
//!
//! The field is the sum of the two vortices, their images below the ground and periodic copies of all; the projection makes
//! it divergence-free and lets nothing through ground and top. The three-dimensional perturbation is the curl of a smooth
//! potential given by a closed formula without random numbers, so that any code on any mesh can start from the same field.

use std::f64::consts::TAU;

use super::super::mesh::{Direction, Mapping, Mesh, Wall};
use super::super::settings::{FlowSettings, TimeStep};
use super::Case;
use crate::error::check;
use crate::{CirculationProfile, Error};

/// Amplitude factor of the perturbation at which each component has an rms of 0.01 `V0` within 0.3 `b0` of the vortices.
const PERTURBATION_SCALE: f64 = 0.265_202_26;
/// Modes of the perturbation.
const MODES: usize = 48;

/// A vortex pair above a plane, lengths in `b0`, velocities in `V0`.
#[derive(Debug, Clone, PartialEq)]
pub struct VortexPairCase {
    /// Cells in x (1 for a plane flow), y, z.
    pub cells: [usize; 3],
    /// Length, width and height of the box; y runs from minus half the width.
    pub size: [f64; 3],
    /// Refinement of the mesh towards the ground, `a` of [`Mapping::TanhLow`]; 0 for equal cells.
    pub ground_stretch: f64,
    /// Height of both vortices.
    pub height: f64,
    /// Core radius, that of the largest tangential velocity.
    pub core_radius: f64,
    /// Circulation against radius.
    pub profile: CirculationProfile,
    /// `Gamma0/nu`.
    pub reynolds: f64,
    /// The ground: no-slip if true, else a frictionless plane.
    pub sticky_ground: bool,
    /// Whether the sides at minus and plus half the width are frictionless planes instead of periodic.
    pub slip_sides: bool,
    /// Root-mean-square of each component of the perturbation within 0.3 of the vortices; 0 for none.
    pub perturbation: f64,
    /// Cross wind along y, uniform; zero at a sticky ground after the first step. Needs periodic sides.
    pub cross_wind: f64,
}

impl Default for VortexPairCase {
    /// The coarse case of the independent reference: 24 x 128 x 80 cells, `Re_Gamma` 5000, `r_c` 0.1, noise 0.01.
    fn default() -> Self {
        Self {
            cells: [24, 128, 80],
            size: [1.0, 4.0, 2.5],
            ground_stretch: 1.5,
            height: 1.0,
            core_radius: 0.1,
            profile: CirculationProfile::Algebraic,
            reynolds: 5000.0,
            sticky_ground: true,
            slip_sides: false,
            perturbation: 0.01,
            cross_wind: 0.0,
        }
    }
}

impl VortexPairCase {
    /// The case with the given way to step in time.
    ///
    /// # Errors
    /// Values out of range.
    pub fn case(self, time_step: TimeStep) -> Result<Case, Error> {
        check("height", self.height, "positive, below the top", |h| h > 0.0 && h < self.size[2])?;
        check("core_radius", self.core_radius, "positive", |r| r > 0.0)?;
        check("reynolds", self.reynolds, "positive", |r| r > 0.0)?;
        check("perturbation", self.perturbation, "zero or positive", |p| p >= 0.0)?;
        let periodic = !self.slip_sides;
        check("cross_wind", self.cross_wind, "zero between frictionless sides", |w| w == 0.0 || periodic)?;
        let [length, width, height] = self.size;
        let x =
            if self.cells[0] == 1 { Direction::thin(length) } else { Direction::periodic(self.cells[0], 0.0, length) };
        let y = if self.slip_sides {
            Direction::between(self.cells[1], -0.5 * width, 0.5 * width, Wall::Slip, Wall::Slip)
        } else {
            Direction::periodic(self.cells[1], -0.5 * width, 0.5 * width)
        };
        let ground = if self.sticky_ground { Wall::AT_REST } else { Wall::Slip };
        let z = Direction::between(self.cells[2], 0.0, height, ground, Wall::Slip);
        let z = if self.ground_stretch == 0.0 {
            z
        } else {
            z.stretched(Mapping::TanhLow { strength: self.ground_stretch })
        };
        let mesh = Mesh::new(x, y, z)?;
        let settings = FlowSettings::new(TAU / self.reynolds, time_step);
        let perturbation = (self.perturbation > 0.0).then(|| Perturbation::new(length, self.perturbation));
        let initial = move |at_m: [f64; 3]| {
            let mut velocity = self.pair(at_m[1], at_m[2]);
            if let Some(perturbation) = &perturbation {
                for (v, p) in velocity.iter_mut().zip(perturbation.velocity(at_m)) {
                    *v += p;
                }
            }
            velocity
        };
        Ok(Case { mesh, settings, initial: Box::new(initial), end_s: 5.0 })
    }

    /// Velocity of the vortices with their images and copies.
    fn pair(&self, y: f64, z: f64) -> [f64; 3] {
        let mut velocity = [0.0, self.cross_wind, 0.0];
        // Planes mirror the pair, which is its own copy one width further; so copies serve both kinds of sides.
        for copy in -2..=2 {
            let shift = f64::from(copy) * self.size[1];
            for (y0, sign) in [(-0.5, -1.0), (0.5, 1.0)] {
                for (z0, sign) in [(self.height, sign), (-self.height, -sign)] {
                    let (dy, dz) = (y - y0 - shift, z - z0);
                    let r2 = dy * dy + dz * dz;
                    let turn = sign * self.profile.angular_velocity_rad_s(TAU, self.core_radius, r2);
                    velocity[1] -= turn * dz;
                    velocity[2] += turn * dy;
                }
            }
        }
        velocity
    }
}

/// `C curl A`, `A_c = g(y, z) sum_n cos(k_n . x + phase_nc)/|k_n|`.
#[derive(Debug, Clone)]
struct Perturbation {
    amplitude: f64,
    modes: Vec<Mode>,
}

#[derive(Debug, Clone)]
struct Mode {
    wave: [f64; 3],
    inverse_length: f64,
    phase: [f64; 3],
}

impl Perturbation {
    fn new(length: f64, rms: f64) -> Self {
        let fraction = |x: f64| x - x.floor();
        let mode = |n: usize| {
            let count = n as f64;
            let axial = TAU * (1 + n % 8) as f64 / length;
            let across = TAU * (0.5 + 3.5 * fraction(count * 0.618_033_988_749_894_9));
            let angle = TAU * fraction(count * 2.0_f64.sqrt());
            Mode {
                wave: [axial, across * angle.cos(), across * angle.sin()],
                inverse_length: 1.0 / axial.hypot(across),
                phase: [7.0_f64, 11.0, 13.0].map(|s| TAU * fraction(count * s.sqrt())),
            }
        };
        Self { amplitude: PERTURBATION_SCALE * rms, modes: (0..MODES).map(mode).collect() }
    }

    fn velocity(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        // The envelope and its slopes along y and z.
        let near = 1.0 - (-(z / 0.2).powi(2)).exp();
        let tops = (-(z / 1.6).powi(8) - (y / 1.6).powi(8)).exp();
        let g = near * tops;
        let by_y = -8.0 * y.powi(7) / 1.6_f64.powi(8) * g;
        let by_z = 2.0 * z / 0.04 * (-(z / 0.2).powi(2)).exp() * tops - 8.0 * z.powi(7) / 1.6_f64.powi(8) * g;
        let (mut potential, mut slope) = ([0.0; 3], [[0.0; 3]; 3]);
        for mode in &self.modes {
            let angle = mode.wave[0] * x + mode.wave[1] * y + mode.wave[2] * z;
            for c in 0..3 {
                let (sin, cos) = (angle + mode.phase[c]).sin_cos();
                potential[c] += cos * mode.inverse_length;
                for d in 0..3 {
                    slope[c][d] -= sin * mode.inverse_length * mode.wave[d];
                }
            }
        }
        // d A_c/d d.
        let envelope = [0.0, by_y, by_z];
        let d = |c: usize, along: usize| g * slope[c][along] + envelope[along] * potential[c];
        [d(2, 1) - d(1, 2), d(0, 2) - d(2, 0), d(1, 0) - d(0, 1)].map(|v| self.amplitude * v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_perturbation_is_free_of_divergence_and_as_strong_as_stated() {
        let perturbation = Perturbation::new(1.0, 0.01);
        let h = 1e-5;
        let at = |p: [f64; 3]| perturbation.velocity(p);
        for p in [[0.1, 0.4, 0.9], [0.7, -0.6, 1.2], [0.3, 0.1, 0.15]] {
            let slope = |d: usize| {
                let (mut a, mut b) = (p, p);
                a[d] += h;
                b[d] -= h;
                (at(a)[d] - at(b)[d]) / (2.0 * h)
            };
            assert!((slope(0) + slope(1) + slope(2)).abs() < 1e-8);
        }
        let (mut sum, mut count) = (0.0, 0);
        for i in 0..20 {
            for j in -12..=12 {
                for k in -12..=12 {
                    let (y, z) = (0.025 * f64::from(j), 0.025 * f64::from(k));
                    if y.hypot(z) < 0.3 {
                        for side in [-0.5, 0.5] {
                            sum +=
                                at([0.05 * f64::from(i), side + y, 1.0 + z]).iter().map(|v| v * v).sum::<f64>() / 3.0;
                            count += 1;
                        }
                    }
                }
            }
        }
        let rms = (sum / f64::from(count)).sqrt();
        assert!((rms / 0.01 - 1.0).abs() < 0.02, "rms {rms}");
    }
}
