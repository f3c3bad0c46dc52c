//! A wake-vortex pair that sinks towards the ground, in the units of the pair: `b0 = V0 = 1`, so
//! that time is `tau` and `Gamma0 = 2 pi`; [`VortexPairCase::scaled`] gives it any size.
//!
//! The field is the sum of the two vortices, their images below the ground and periodic copies of
//! all; the projection makes it divergence-free and lets nothing through ground and top. Noise
//! makes it three-dimensional, a cross wind carries it.
//!
//! Check: symmetry of the plane flow to round-off, drift with the wind, scales; the flow against
//! independent codes (tests `references::wakes`).

use std::f64::consts::TAU;

use num_complex::Complex;
use rayon::prelude::*;

use super::super::mesh::{Direction, Ends, Mesh, Spread, Wall};
use super::super::settings::{FlowSettings, TimeScheme, TimeStep};
use super::super::subgrid::SubgridModel;
use super::perturbation::Perturbation;
use super::{Case, Initial, stretched};
use crate::analysis::{WakeMeter, WakeScales};
use crate::error::{Error, check};
use crate::winds::{CirculationProfile, TwoScale};

/// Where the pair is when the case ends, in `tau`.
const END: f64 = 5.0;

/// A vortex pair above a plane, lengths in `b0`, velocities in `V0`.
#[derive(Debug, Clone, PartialEq)]
pub struct VortexPairCase {
    /// Cells in x (1 for a plane flow), y, z.
    pub cells: [usize; 3],
    /// Length, width and height of the box; y runs from minus half the width.
    pub size: [f64; 3],
    /// Refinement of the mesh towards the ground, `a` of [`Spread::TanhLow`]; 0 for equal cells.
    pub ground_stretch: f64,
    /// Refinement of the mesh towards y = 0: its cells are `1 - a` of the mean there and `1 + a` at
    /// the sides.
    pub lateral_stretch: f64,
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
    /// Whether the sides at minus and plus half the width are frictionless planes instead of
    /// periodic.
    pub slip_sides: bool,
    /// Root-mean-square of each component of the noise within 0.3 of the vortices; 0 for none.
    pub perturbation: f64,
    /// Seed of the noise and of the background turbulence; without one the noise is the closed
    /// formula of the reference.
    pub seed: Option<u64>,
    /// Root-mean-square of each component of turbulence that fills the box; 0 for none. Needs
    /// periodic sides.
    pub background: f64,
    /// Cross wind along y at the height of the vortices. Needs periodic sides.
    pub cross_wind: f64,
    /// Roughness length of a logarithmic wind, `ln(1 + z/z0)`; 0 for the same wind at all heights,
    /// which a sticky ground stops in the first step.
    pub wind_roughness: f64,
    /// Subgrid model.
    pub subgrid: SubgridModel,
}

impl VortexPairCase {
    /// How the pair is stepped: over as many revolutions of the cores as a wake lives
    /// Adams-Bashforth, at the same cost, feeds energy to the shortest waves.
    pub const SCHEME: TimeScheme = TimeScheme::RungeKutta3;
    /// Courant number of [`VortexPairCase::steps`]: at it the scheme itself dissipates less than
    /// half a percent of what viscosity does, turbulence on the coarse mesh included.
    pub const COURANT: f64 = 0.65;

    /// The coarse case of the independent reference: 24 x 128 x 80 cells, `Re_Gamma` 5000, `r_c`
    /// 0.1, noise 0.01, no model.
    pub fn coarse() -> Self {
        Self {
            cells: [24, 128, 80],
            size: [1.0, 4.0, 2.5],
            ground_stretch: 1.5,
            lateral_stretch: 0.0,
            height: 1.0,
            core_radius: 0.1,
            profile: CirculationProfile::Algebraic,
            reynolds: 5000.0,
            sticky_ground: true,
            slip_sides: false,
            perturbation: 0.01,
            seed: None,
            background: 0.0,
            cross_wind: 0.0,
            wind_roughness: 0.0,
            subgrid: SubgridModel::None,
        }
    }

    /// The profile of two scales whose span is that of an elliptically loaded wing, `b = 4 b0/pi`,
    /// and core that of the case.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a core too large for its span.
    pub fn with_two_scales(self) -> Result<Self, Error> {
        let span = 4.0 / std::f64::consts::PI;
        let profile = CirculationProfile::TwoScale(TwoScale::new(span / self.core_radius)?);
        Ok(Self { profile, ..self })
    }

    /// Steps of [`VortexPairCase::COURANT`], at most `longest_s`.
    pub fn steps(longest_s: f64) -> TimeStep {
        TimeStep::Courant {
            courant: Self::COURANT,
            longest_s,
        }
    }

    /// The case with the given way to step in time, in the units of the pair.
    ///
    /// # Errors
    /// Values out of range.
    pub fn case(self, time_step: TimeStep) -> Result<Case, Error> {
        self.scaled(&WakeScales::REDUCED, time_step)
    }

    /// The case in SI units: the pair has the given spacing and circulation, and `time_step` is in
    /// seconds.
    ///
    /// # Errors
    /// Values out of range.
    pub fn scaled(self, scales: &WakeScales, time_step: TimeStep) -> Result<Case, Error> {
        scales.validate()?;
        self.validate()?;
        let viscosity_m2_s = scales.circulation_m2_s / self.reynolds;
        let mut settings = FlowSettings::new(viscosity_m2_s, time_step);
        settings.scheme = Self::SCHEME;
        settings.subgrid = self.subgrid;
        // The start is made in the units of the pair and scaled, so that it does not depend on its
        // size.
        let mesh = self.mesh(1.0)?;
        let mut faces = self.faces(&mesh);
        let speed_m_s = scales.descent_speed_m_s();
        faces.iter_mut().flatten().for_each(|v| *v *= speed_m_s);
        let end_s = END * scales.time_unit_s();
        Ok(Case {
            mesh: self.mesh(scales.spacing_m)?,
            settings,
            initial: Initial::Faces(faces),
            end_s,
        })
    }

    /// A meter for this case in the given size.
    ///
    /// # Errors
    /// As [`WakeMeter::new`].
    pub fn meter(&self, scales: &WakeScales) -> Result<WakeMeter, Error> {
        let b0_m = scales.spacing_m;
        let centres_m = [-0.5, 0.5].map(|y| [y * b0_m, self.height * b0_m]);
        let meter = WakeMeter::new(
            &self.mesh(b0_m)?,
            scales.circulation_m2_s / self.reynolds,
            *scales,
            centres_m,
        )?;
        // Point vortices over a plane: dy/dtau = y^2/[2 z (y^2 + z^2)], dz/dtau = -z^2/[2 y (y^2 +
        // z^2)].
        let y = 0.5;
        let z = self.height;
        let scale = scales.descent_speed_m_s() / (2.0 * (y * y + z * z));
        let drift_m_s = self.cross_wind * scales.descent_speed_m_s();
        let [out_m_s, down_m_s] = [scale * y * y / z, -scale * z * z / y];
        Ok(meter.moving_with([-1.0, 1.0].map(|side| [drift_m_s + side * out_m_s, down_m_s])))
    }

    fn validate(&self) -> Result<(), Error> {
        check("height", self.height, "positive, below the top", |h| {
            h > 0.0 && h < self.size[2]
        })?;
        check("core_radius", self.core_radius, "positive", |r| r > 0.0)?;
        check("reynolds", self.reynolds, "positive", |r| r > 0.0)?;
        check(
            "lateral_stretch",
            self.lateral_stretch,
            "from 0 to 0.9",
            |a| (0.0..=0.9).contains(&a),
        )?;
        check("perturbation", self.perturbation, "zero or positive", |p| {
            p >= 0.0
        })?;
        check(
            "wind_roughness",
            self.wind_roughness,
            "zero or positive",
            |r| r >= 0.0,
        )?;
        let periodic = !self.slip_sides;
        check(
            "background",
            self.background,
            "zero or positive, zero between frictionless sides",
            |b| b == 0.0 || (b > 0.0 && periodic),
        )?;
        check(
            "cross_wind",
            self.cross_wind,
            "zero between frictionless sides",
            |w| w == 0.0 || periodic,
        )
    }

    /// The mesh in units of `unit_m` \[m\].
    pub(super) fn mesh(&self, unit_m: f64) -> Result<Mesh, Error> {
        let [length, width, height] = self.size.map(|l| l * unit_m);
        let x = Direction::periodic(self.cells[0], 0.0, length);
        let mut y = Direction::periodic(self.cells[1], -0.5 * width, 0.5 * width);
        if self.slip_sides {
            y.ends = Ends::Walls {
                low: Wall::Slip,
                high: Wall::Slip,
            };
        }
        let y = stretched(y, Spread::Sine.by(self.lateral_stretch));
        let ground = if self.sticky_ground {
            Wall::AT_REST
        } else {
            Wall::Slip
        };
        let z = Direction::between(self.cells[2], 0.0, height, ground, Wall::Slip);
        Mesh::new(x, y, stretched(z, Spread::TanhLow.by(self.ground_stretch)))
    }

    /// The initial velocities at the low faces of the cells of the mesh, in the units of the pair.
    fn faces(&self, mesh: &Mesh) -> [Vec<f64>; 3] {
        // Nothing varies along x in a plane flow.
        let varies = self.cells[0] > 1;
        let noise = (varies && self.perturbation > 0.0)
            .then(|| Perturbation::noise(self.size[0], self.height, self.perturbation, self.seed));
        let background = (varies && self.background > 0.0).then(|| {
            Perturbation::background(self.size, self.background, self.seed.unwrap_or_default())
        });
        let disturbances: Vec<Perturbation> = noise.into_iter().chain(background).collect();
        let [nx, ny, _] = self.cells;
        std::array::from_fn(|component| {
            let [x, y, z] = [0, 1, 2].map(|d| {
                if d == component {
                    mesh.face_m(d)
                } else {
                    mesh.centre_m(d)
                }
            });
            // On the line where the box meets its copy the mean of both sides, so that left and
            // right are equal.
            let seam = (component == 1 && !self.slip_sides).then_some(y[0]);
            let mut field = vec![0.0; self.cells.iter().product()];
            field
                .par_chunks_mut(nx * ny)
                .zip(&z)
                .for_each(|(plane, &z)| {
                    for (row, &y) in plane.chunks_mut(nx).zip(&y) {
                        row.fill(if seam == Some(y) {
                            0.5 * (self.pair(y, z)[1] + self.pair(y + self.size[1], z)[1])
                        } else {
                            self.pair(y, z)[component]
                        });
                        for disturbance in &disturbances {
                            let waves = disturbance.row(component, y, z);
                            for (value, x) in row.iter_mut().zip(&x) {
                                *value += sum_of_waves(&waves, TAU * x / self.size[0]);
                            }
                        }
                    }
                });
            field
        })
    }

    /// Velocity of the vortices with their images and copies, and of the wind.
    fn pair(&self, y: f64, z: f64) -> [f64; 3] {
        let wind = self.cross_wind * self.wind_profile(z) / self.wind_profile(self.height);
        let mut velocity = [0.0, wind, 0.0];
        // Planes mirror the pair, which is its own copy one width further; so copies serve both
        // kinds of sides.
        for (y0, sign) in [(-0.5, -1.0), (0.5, 1.0)] {
            for (z0, sign) in [(self.height, sign), (-self.height, -sign)] {
                for copy in -NEAR_COPIES..=NEAR_COPIES {
                    let dy = y - y0 - f64::from(copy) * self.size[1];
                    let dz = z - z0;
                    let r2 = dy * dy + dz * dz;
                    let rotation_per_s = sign
                        * self
                            .profile
                            .angular_velocity_rad_s(TAU, self.core_radius, r2);
                    velocity[1] -= rotation_per_s * dz;
                    velocity[2] += rotation_per_s * dy;
                }
                let far = sign * far_copies(Complex::new(y - y0, z - z0), self.size[1]);
                velocity[1] += far.im;
                velocity[2] += far.re;
            }
        }
        velocity
    }

    /// Cross wind against height, up to a factor.
    fn wind_profile(&self, z: f64) -> f64 {
        if self.wind_roughness > 0.0 {
            (1.0 + z / self.wind_roughness).ln()
        } else {
            1.0
        }
    }
}

/// Copies on each side that have a core.
const NEAR_COPIES: i32 = 2;
/// Copies on each side that are summed one by one; the rest is an integral.
const FAR_COPIES: i32 = 40;

/// `w + i v` of the point vortices of circulation 2 pi at `n` times `width` to both sides, `n`
/// above [`NEAR_COPIES`], seen from `at = dy + i dz`: the sum of `1/(at - n width)`.
fn far_copies(at: Complex<f64>, width: f64) -> Complex<f64> {
    let square = at * at;
    let mut sum = Complex::from(0.0);
    for n in NEAR_COPIES + 1..=FAR_COPIES {
        sum += 2.0 * at / (square - (f64::from(n) * width).powi(2));
    }
    sum - 2.0 * at / (width * width * (f64::from(FAR_COPIES) + 0.5))
}

/// The sum of waves at the angle of the first, by rotation from one to the next.
fn sum_of_waves(waves: &[[f64; 2]], angle: f64) -> f64 {
    let (step_sin, step_cos) = angle.sin_cos();
    let mut sin = 0.0;
    let mut cos = 1.0;
    let mut sum = 0.0;
    for [a, b] in waves {
        sum += a * cos + b * sin;
        (cos, sin) = (
            cos * step_cos - sin * step_sin,
            sin * step_cos + cos * step_sin,
        );
    }
    sum
}

#[cfg(test)]
#[path = "vortex_pair_tests.rs"]
mod tests;
