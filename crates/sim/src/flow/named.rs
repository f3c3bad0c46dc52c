//! The flows with known answers: their parameters, and the cases of the solver that these select.

use super::case::{CaseKind, Problems};
use super::setup::Setup;
use crate::scene::{VortexProfile, section};
use crate::{Error, join};
use serde::{Deserialize, Serialize};
use std::path::Path;
use wakescope_les::cases::{self, Case, Resolution, TollmienSchlichting, VortexLengths, VortexPairCase};
use wakescope_les::{Mesh, TimeScheme, TimeStep};

/// Steps from start to end that the longest step gives where a case states none.
const LEAST_STEPS: f64 = 200.0;
/// A step for the constructors of cases with a fixed one; replaced by the case file's.
const ANY_STEP_S: f64 = 1.0;

section! {
    /// `v = sin(2 pi y) cos(2 pi z) exp(-8 pi^2 nu t)` on the unit square.
    #[derive(Copy)]
    TaylorGreenPlane {
        /// Cells along y and along z.
        cells: usize = 64,
        /// Amplitudes of the sines that stretch y and z, -1 to 1.
        stretch: [f64; 2] = [0.4, -0.3],
        /// Kinematic viscosity \[m^2/s\].
        viscosity_m2_s: f64 = 0.01,
    }
}

section! {
    /// Vortices in the box `2 pi` wide.
    #[derive(Copy)]
    TaylorGreen {
        /// Cells along each direction.
        cells: usize = 64,
        /// Reynolds number of unit length and speed.
        reynolds: f64 = 1600.0,
    }
}

section! {
    /// Plates at z = -1 and 1.
    #[derive(Copy)]
    PlateDriven {
        /// Cells between the plates.
        cells: usize = 32,
        /// Strength of the stretching towards the plates; 0 for equal cells.
        stretch: f64 = 1.5,
        /// Kinematic viscosity \[m^2/s\].
        viscosity_m2_s: f64 = 0.1,
        /// Share of the steady profile at the start, of Poiseuille's and Couette's flow.
        initial_share: f64 = 0.0,
    }
}

section! {
    /// A wave of Tollmien and Schlichting, one wave length long, between plates at z = -1 and 1.
    #[derive(Copy)]
    OrrSommerfeld {
        /// Cells along the wave and between the plates.
        cells: [usize; 2] = [64, 128],
        /// Strength of the stretching towards the plates.
        stretch: f64 = 1.5,
        /// Reynolds number of the half height and the centre velocity.
        reynolds: f64 = 7500.0,
        /// Wave number per half height.
        wave_number: f64 = 1.0,
        /// Largest `u` of the wave.
        amplitude: f64 = 1e-4,
    }
}

section! {
    /// Two shielded vortices in the box `[-1, 1]^2`, running along z.
    #[derive(Copy)]
    Dipole {
        /// Cells along y and z.
        cells: [usize; 2] = [384, 384],
        /// Strength of the stretching towards the walls.
        stretch: f64 = 1.5,
        /// Strength of the refinement of y about its middle: the finest cell is `exp(-strength)` times the mean where y is
        /// periodic; 0 for equal cells. If absent 0 where y is periodic, else as `stretch`.
        #[serde(skip_serializing_if = "Option::is_none")]
        lateral_stretch: Option<f64> = None,
        /// Reynolds number.
        reynolds: f64 = 625.0,
        /// Whether walls stand at the sides too; else y is periodic.
        closed_sides: bool = false,
    }
}

section! {
    /// The unit square with a moving lid.
    #[derive(Copy)]
    LidDrivenCavity {
        /// Cells along y and along z.
        cells: usize = 128,
        /// Strength of the stretching towards the walls.
        stretch: f64 = 1.5,
        /// Reynolds number.
        reynolds: f64 = 1000.0,
    }
}

section! {
    /// Turbulent flow in a box of `2 pi x pi x 2` half heights.
    #[derive(Copy)]
    Channel {
        /// Cells along x, y, z.
        cells: [usize; 3] = [96, 96, 96],
        /// Strength of the stretching towards the plates.
        stretch: f64 = 1.8,
        /// Reynolds number of the half height and the friction velocity.
        reynolds_tau: f64 = 180.0,
    }
}

section! {
    /// A vortex pair above ground, lengths in `b0`, velocities in `V0`; time is `tau`. Defaults: the coarse case.
    #[derive(Copy)]
    VortexPairFlow {
        /// Cells along x (1 for a plane flow), y, z.
        cells: [usize; 3] = [24, 128, 80],
        /// Length, width and height of the box.
        size: [f64; 3] = [1.0, 4.0, 2.5],
        /// Strength of the stretching towards the ground; 0 for equal cells.
        ground_stretch: f64 = 1.5,
        /// Height of both vortices.
        height: f64 = 1.0,
        /// Core radius.
        core_radius: f64 = 0.1,
        /// Circulation against radius.
        profile: VortexProfile = VortexProfile::Algebraic,
        /// `Gamma0/nu`.
        reynolds: f64 = 5000.0,
        /// The ground: no-slip if true, else a frictionless plane.
        sticky_ground: bool = true,
        /// Whether the sides are frictionless planes instead of periodic.
        slip_sides: bool = false,
        /// Root-mean-square of each component of the perturbation near the vortices.
        perturbation: f64 = 0.01,
        /// Uniform cross wind.
        cross_wind: f64 = 0.0,
    }
}

impl CaseKind {
    pub(super) fn check(&self, p: &mut Problems) {
        match self {
            Self::TaylorGreenPlane(c) => {
                p.cells("case.cells", &[c.cells]);
                p.not_negative("case.viscosity_m2_s", c.viscosity_m2_s);
                let ok = c.stretch.iter().all(|a| a.abs() < 1.0);
                p.require(ok, "case.stretch", c.stretch, "two numbers between -1 and 1");
            }
            Self::TaylorGreen(c) => {
                p.cells("case.cells", &[c.cells]);
                p.positive("case.reynolds", c.reynolds);
            }
            Self::Poiseuille(c) | Self::Couette(c) | Self::StokesLayer(c) | Self::RayleighPlate(c) => {
                p.cells("case.cells", &[c.cells]);
                p.stretch("case.stretch", c.stretch);
                p.positive("case.viscosity_m2_s", c.viscosity_m2_s);
                p.require(c.initial_share.is_finite(), "case.initial_share", c.initial_share, "finite");
                let has_share = matches!(self, Self::Poiseuille(_) | Self::Couette(_));
                let allowed = "this key is for case.kind = \"poiseuille\" or \"couette\"";
                p.require(has_share || c.initial_share == 0.0, "case.initial_share", c.initial_share, allowed);
            }
            Self::OrrSommerfeld(c) => {
                p.cells("case.cells", &c.cells);
                p.stretch("case.stretch", c.stretch);
                let (re, wave) = (c.reynolds, c.wave_number);
                p.require((500.0..=1e6).contains(&re), "case.reynolds", re, "a number from 500 to 1e6");
                p.require((0.3..=2.0).contains(&wave), "case.wave_number", wave, "a number from 0.3 to 2");
                p.require(c.amplitude.is_finite(), "case.amplitude", c.amplitude, "finite");
            }
            Self::Dipole(c) => {
                p.cells("case.cells", &c.cells);
                p.stretch("case.stretch", c.stretch);
                p.stretch("case.lateral_stretch", c.lateral_stretch());
                p.positive("case.reynolds", c.reynolds);
            }
            Self::LidDrivenCavity(c) => {
                p.cells("case.cells", &[c.cells]);
                p.stretch("case.stretch", c.stretch);
                p.positive("case.reynolds", c.reynolds);
            }
            Self::Channel(c) => {
                p.cells("case.cells", &c.cells);
                p.stretch("case.stretch", c.stretch);
                p.positive("case.reynolds_tau", c.reynolds_tau);
            }
            Self::VortexPair(c) => c.check(p),
            Self::Wake(c) => c.check(p),
            Self::Free(c) => c.check(p),
        }
    }

    /// What `mesh` does not resolve of the vortices and of the boundary layer under them, in sentences.
    pub(super) fn unresolved(&self, mesh: &Mesh) -> Vec<String> {
        let lengths = match self {
            Self::Dipole(c) => Some(VortexLengths::dipole(c.reynolds)),
            Self::VortexPair(c) => Some(VortexLengths::pair(c.core_radius, c.height, c.reynolds, 1.0)),
            Self::Wake(c) => {
                let scales = c.pair.scales().ok();
                scales.map(|scales| VortexLengths::pair(c.core_radius, c.height, c.reynolds, scales.spacing_m))
            }
            _ => None,
        };
        lengths.map_or_else(Vec::new, |lengths| Resolution::new(mesh, &lengths).warnings())
    }

    /// Cells along x, y, z.
    pub fn cells(&self) -> [usize; 3] {
        match *self {
            Self::TaylorGreenPlane(ref c) => [1, c.cells, c.cells],
            Self::TaylorGreen(ref c) => [c.cells; 3],
            Self::Poiseuille(ref c) | Self::Couette(ref c) | Self::StokesLayer(ref c) | Self::RayleighPlate(ref c) => {
                [1, 1, c.cells]
            }
            Self::OrrSommerfeld(ref c) => [c.cells[0], 1, c.cells[1]],
            Self::Dipole(ref c) => [1, c.cells[0], c.cells[1]],
            Self::LidDrivenCavity(ref c) => [1, c.cells, c.cells],
            Self::Channel(ref c) => c.cells,
            Self::VortexPair(ref c) => c.cells,
            Self::Wake(ref c) => c.cells,
            Self::Free(ref c) => [c.x.cells, c.y.cells, c.z.cells],
        }
    }

    /// Mesh, settings and initial field; `folder` is that of the case file.
    pub(super) fn setup(&self, folder: &Path) -> Result<Setup, Error> {
        let steady = |case: Result<Case, wakescope_les::Error>| {
            let mut case = case?;
            let courant = TimeScheme::AdamsBashforth2.default_courant();
            case.settings.time_step = TimeStep::Courant { courant, longest_s: case.end_s / LEAST_STEPS };
            Ok(case)
        };
        let plates =
            |cells, strength, viscosity_m2_s| cases::Plates { cells, strength, viscosity_m2_s, step_s: ANY_STEP_S };
        let case = match *self {
            Self::TaylorGreenPlane(ref c) => {
                steady(cases::taylor_green_plane(c.cells, c.stretch, c.viscosity_m2_s, ANY_STEP_S))
            }
            Self::TaylorGreen(ref c) => cases::taylor_green_3d(c.cells, c.reynolds),
            Self::Poiseuille(ref c) => steady(plates(c.cells, c.stretch, c.viscosity_m2_s).poiseuille(c.initial_share)),
            Self::Couette(ref c) => steady(plates(c.cells, c.stretch, c.viscosity_m2_s).couette(c.initial_share)),
            Self::StokesLayer(ref c) => steady(plates(c.cells, c.stretch, c.viscosity_m2_s).decaying_layer()),
            Self::RayleighPlate(ref c) => steady(plates(c.cells, c.stretch, c.viscosity_m2_s).rayleigh_plate()),
            Self::OrrSommerfeld(ref c) => steady(
                TollmienSchlichting::new(c.reynolds, c.wave_number)
                    .and_then(|wave| wave.case(c.cells, c.stretch, c.amplitude, ANY_STEP_S)),
            ),
            Self::Dipole(ref c) => {
                let dipole = if c.closed_sides { cases::dipole_in_a_box } else { cases::dipole_between_walls };
                dipole(c.cells, [c.lateral_stretch(), c.stretch], c.reynolds)
            }
            Self::LidDrivenCavity(ref c) => cases::lid_driven_cavity(c.cells, c.stretch, c.reynolds),
            Self::Channel(ref c) => cases::channel(c.cells, c.stretch, c.reynolds_tau),
            Self::VortexPair(ref c) => c.case(),
            Self::Wake(ref c) => return c.setup(),
            Self::Free(ref c) => return c.setup(folder),
        };
        let Case { mesh, settings, initial, end_s } = case.map_err(Error::Flow)?;
        Ok(Setup { mesh, settings, initial, end_s: Some(end_s), tau_per_s: 1.0, wake: None, undamped: None })
    }
}

impl Dipole {
    fn lateral_stretch(&self) -> f64 {
        self.lateral_stretch.unwrap_or(if self.closed_sides { self.stretch } else { 0.0 })
    }
}

impl VortexPairFlow {
    fn check(&self, p: &mut Problems) {
        p.cells("case.cells", &self.cells);
        let ok = self.size.iter().all(|l| l.is_finite() && *l > 0.0);
        p.require(ok, "case.size", self.size, "three finite numbers above 0");
        p.stretch("case.ground_stretch", self.ground_stretch);
        let height = self.height;
        p.require(height > 0.0 && height < self.size[2], "case.height", height, "above 0 and below the top");
        p.positive("case.core_radius", self.core_radius);
        p.positive("case.reynolds", self.reynolds);
        p.not_negative("case.perturbation", self.perturbation);
        let still = self.cross_wind == 0.0;
        let wind = self.cross_wind.is_finite() && (still || !self.slip_sides);
        p.require(wind, "case.cross_wind", self.cross_wind, "finite, and 0 between frictionless sides");
    }

    fn case(&self) -> Result<Case, wakescope_les::Error> {
        let Self { cells, size, ground_stretch, height, core_radius, reynolds, .. } = *self;
        let profile = join::circulation_profile(self.profile);
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
