//! A vortex pair above ground in its own units: the keys of its case, their limits, the case of the solver.

use super::setup::Setup;
use crate::Error;
use crate::keys::{ABOVE_ZERO, Checker, Number, ZERO_OR_MORE, keys};
use crate::scene::CoreProfile;
use wakescope_les::cases::{Case, VortexPairCase};

/// Strength of the stretching of a mesh.
pub(super) const STRETCH: Number = Number(
    |a| (0.0..=20.0).contains(&a),
    "a number from 0 (equal cells) to 20",
);
/// Longest step.
const LONGEST_STEP: f64 = 0.02;

keys! {
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

impl VortexPairFlow {
    pub(super) fn check(&self, p: &mut Checker<'_>) {
        let wind = ("case.cross_wind", self.cross_wind);
        check_pair(p, (self.height, self.size), wind, self.slip_sides);
    }

    /// The case of the solver.
    pub(super) fn pair_case(&self) -> VortexPairCase {
        VortexPairCase {
            cells: self.cells,
            size: self.size,
            ground_stretch: self.ground_stretch,
            height: self.height,
            core_radius: self.core_radius,
            profile: crate::plan::wind::circulation_profile(self.profile),
            reynolds: self.reynolds,
            sticky_ground: self.sticky_ground,
            slip_sides: self.slip_sides,
            perturbation: self.perturbation,
            cross_wind: self.cross_wind,
            ..VortexPairCase::coarse()
        }
    }

    pub(super) fn setup(&self) -> Result<Setup, Error> {
        let Case {
            mesh,
            settings,
            initial,
            end_s,
        } = self
            .pair_case()
            .case(VortexPairCase::steps(LONGEST_STEP))
            .map_err(Error::Flow)?;
        Ok(Setup {
            mesh,
            settings,
            initial,
            end_s: Some(end_s),
            tau_per_s: 1.0,
            wake: None,
            undamped: None,
        })
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
