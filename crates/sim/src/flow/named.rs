//! The parameters of the flows with known answers.

use crate::keys::{ABOVE_ZERO, Checker, FINITE, Is, Number, ZERO_OR_MORE, keys};
use crate::scene::CoreProfile;

use wakescope_les::cases::{Case, VortexPairCase};

/// Strength of the stretching of a mesh.
pub(super) const STRETCH: Number = Number(
    |a| (0.0..=20.0).contains(&a),
    "a number from 0 (equal cells) to 20",
);

keys! {
    /// `v = sin(2 pi y) cos(2 pi z) exp(-8 pi^2 nu t)` on the unit square.
    #[derive(Copy)]
    table TaylorGreenPlane {
        /// Cells along y and along z.
        cells: usize = 64 => 1..=100_000,
        /// Amplitudes of the sines that stretch y and z, -1 to 1.
        stretch: [f64; 2] = [0.4, -0.3] => Is(
            |stretch: &[f64; 2]| stretch.iter().all(|a| a.abs() < 1.0),
            "two numbers between -1 and 1",
        ),
        /// Kinematic viscosity \[m^2/s\].
        viscosity_m2_s: f64 = 0.01 => ZERO_OR_MORE,
    }

    /// Vortices in the box `2 pi` wide.
    #[derive(Copy)]
    table TaylorGreen {
        /// Cells along each direction.
        cells: usize = 64 => 1..=100_000,
        /// Reynolds number of unit length and speed.
        reynolds: f64 = 1600.0 => ABOVE_ZERO,
    }

    /// Plates at z = -1 and 1.
    #[derive(Copy)]
    table PlateDriven {
        /// Cells between the plates.
        cells: usize = 32 => 1..=100_000,
        /// Strength of the stretching towards the plates; 0 for equal cells.
        stretch: f64 = 1.5 => STRETCH,
        /// Kinematic viscosity \[m^2/s\].
        viscosity_m2_s: f64 = 0.1 => ABOVE_ZERO,
        /// Share of the steady profile at the start, of Poiseuille's and Couette's flow.
        initial_share: f64 = 0.0 => FINITE,
    }

    /// A wave of Tollmien and Schlichting, one wave length long, between plates at z = -1 and 1.
    #[derive(Copy)]
    table OrrSommerfeld {
        /// Cells along the wave and between the plates.
        cells: [usize; 2] = [64, 128] => 1..=100_000,
        /// Strength of the stretching towards the plates.
        stretch: f64 = 1.5 => STRETCH,
        /// Reynolds number of the half height and the centre velocity.
        reynolds: f64 = 7500.0 => 500.0..=1e6,
        /// Wave number per half height.
        wave_number: f64 = 1.0 => 0.3..=2.0,
        /// Largest `u` of the wave.
        amplitude: f64 = 1e-4 => FINITE,
    }

    /// Two shielded vortices in the box `[-1, 1]^2`, running along z.
    #[derive(Copy)]
    table Dipole {
        /// Cells along y and z.
        cells: [usize; 2] = [384, 384] => 1..=100_000,
        /// Strength of the stretching towards the walls.
        stretch: f64 = 1.5 => STRETCH,
        /// Strength of the refinement of y about its middle: the finest cell is `exp(-strength)` times the mean where y is
        /// periodic; 0 for equal cells. If absent 0 where y is periodic, else as `stretch`.
        lateral_stretch: Option<f64> = None => STRETCH,
        /// Reynolds number.
        reynolds: f64 = 625.0 => ABOVE_ZERO,
        /// Whether walls stand at the sides too; else y is periodic.
        closed_sides: bool = false,
    }

    /// The unit square with a moving lid.
    #[derive(Copy)]
    table LidDrivenCavity {
        /// Cells along y and along z.
        cells: usize = 128 => 1..=100_000,
        /// Strength of the stretching towards the walls.
        stretch: f64 = 1.5 => STRETCH,
        /// Reynolds number.
        reynolds: f64 = 1000.0 => ABOVE_ZERO,
    }

    /// Turbulent flow in a box of `2 pi x pi x 2` half heights.
    #[derive(Copy)]
    table Channel {
        /// Cells along x, y, z.
        cells: [usize; 3] = [96, 96, 96] => 1..=100_000,
        /// Strength of the stretching towards the plates.
        stretch: f64 = 1.8 => STRETCH,
        /// Reynolds number of the half height and the friction velocity.
        reynolds_tau: f64 = 180.0 => ABOVE_ZERO,
    }

    /// A vortex pair above ground, lengths in `b0`, velocities in `V0`; time is `tau`. Defaults: the coarse case.
    #[derive(Copy)]
    table VortexPairFlow {
        /// Cells along x (1 for a plane flow), y, z.
        cells: [usize; 3] = [24, 128, 80] => 1..=100_000,
        /// Length, width and height of the box.
        size: [f64; 3] = [1.0, 4.0, 2.5] => ABOVE_ZERO,
        /// Strength of the stretching towards the ground; 0 for equal cells.
        ground_stretch: f64 = 1.5 => STRETCH,
        /// Height of both vortices.
        height: f64 = 1.0,
        /// Core radius.
        core_radius: f64 = 0.1 => ABOVE_ZERO,
        /// Circulation against radius.
        profile: CoreProfile = CoreProfile::Algebraic,
        /// `Gamma0/nu`.
        reynolds: f64 = 5000.0 => ABOVE_ZERO,
        /// The ground: no-slip if true, else a frictionless plane.
        sticky_ground: bool = true,
        /// Whether the sides are frictionless planes instead of periodic.
        slip_sides: bool = false,
        /// Root-mean-square of each component of the perturbation near the vortices.
        perturbation: f64 = 0.01 => ZERO_OR_MORE,
        /// Uniform cross wind.
        cross_wind: f64 = 0.0,
    }
}

impl Dipole {
    pub(super) fn lateral_stretch(&self) -> f64 {
        self.lateral_stretch
            .unwrap_or(if self.closed_sides { self.stretch } else { 0.0 })
    }
}

impl VortexPairFlow {
    pub(super) fn case(&self) -> Result<Case, wakescope_les::Error> {
        let Self {
            cells,
            size,
            ground_stretch,
            height,
            core_radius,
            reynolds,
            ..
        } = *self;
        let profile = crate::setup::wind::circulation_profile(self.profile);
        VortexPairCase {
            cells,
            size,
            ground_stretch,
            height,
            core_radius,
            profile,
            reynolds,
            sticky_ground: self.sticky_ground,
            slip_sides: self.slip_sides,
            perturbation: self.perturbation,
            cross_wind: self.cross_wind,
            ..VortexPairCase::coarse()
        }
        .case(VortexPairCase::steps(0.02))
    }
}

/// Limits of a vortex pair in a box of this size, whose cross wind the key `wind` has.
pub(super) fn check_pair(
    p: &mut Checker<'_>,
    (height, size): (f64, [f64; 3]),
    (key, wind): (&str, f64),
    slip_sides: bool,
) {
    p.require(
        height > 0.0 && height < size[2],
        "case.height",
        height,
        "above 0 and below the top",
    );
    let fits = wind.is_finite() && (wind == 0.0 || !slip_sides);
    p.require(fits, key, wind, "finite, and 0 between frictionless sides");
}
