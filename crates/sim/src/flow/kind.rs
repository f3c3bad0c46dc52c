//! Which flow a case is: the flows with known answers, the wake, a flow of one's own; their limits and their setups.

use super::free::Free;
use super::named::{
    Channel, Dipole, LidDrivenCavity, OrrSommerfeld, PlateDriven, TaylorGreen, TaylorGreenPlane,
    VortexPairFlow, check_pair,
};
use super::setup::Setup;
use super::wake::WakeFlow;
use crate::Error;
use crate::keys::{Checker, keys};
use std::path::Path;
use wakescope_les::cases::{self, Case, Resolution, TollmienSchlichting, VortexLengths};
use wakescope_les::{Mesh, TimeScheme, TimeStep};

/// Steps from start to end that the longest step gives where a case states none.
const LEAST_STEPS: f64 = 200.0;
/// A step for the constructors of cases with a fixed one; replaced by the case file's.
const ANY_STEP_S: f64 = 1.0;

keys! {
    /// Which flow. The first ones have known answers and are in the units of their literature.
    kinds CaseKind by "kind" {
        /// Decaying vortices of the plane, an exact solution.
        "taylor_green_plane" => TaylorGreenPlane(TaylorGreenPlane),
        /// Vortices of space that become turbulent.
        "taylor_green" => TaylorGreen(TaylorGreen),
        /// Pressure-driven flow between plates.
        "poiseuille" => Poiseuille(PlateDriven),
        /// Flow between plates that move.
        "couette" => Couette(PlateDriven),
        /// The slowest mode between plates, which decays.
        "stokes_layer" => StokesLayer(PlateDriven),
        /// A plate that starts suddenly.
        "rayleigh_plate" => RayleighPlate(PlateDriven),
        /// A wave of Tollmien and Schlichting on Poiseuille's flow.
        "orr_sommerfeld" => OrrSommerfeld(OrrSommerfeld),
        /// A dipole that runs against a wall.
        "dipole" => Dipole(Dipole),
        /// A cavity whose lid moves.
        "lid_driven_cavity" => LidDrivenCavity(LidDrivenCavity),
        /// Turbulent flow between plates.
        "channel" => Channel(Channel),
        /// A vortex pair above ground, in plane or space.
        "vortex_pair" => VortexPair(VortexPairFlow),
        /// The wake of an aircraft near the ground, measured while it runs.
        "wake" => Wake(Box<WakeFlow>),
        /// A mesh, viscosity and initial field of one's own, in SI units.
        "free" => Free(Box<Free>),
    }
}

impl CaseKind {
    /// Limits between the keys of a flow.
    pub(super) fn check(&self, p: &mut Checker<'_>) {
        match self {
            Self::StokesLayer(c) | Self::RayleighPlate(c) => {
                let allowed = "this key is for case.kind = \"poiseuille\" or \"couette\"";
                p.require(
                    c.initial_share == 0.0,
                    "case.initial_share",
                    c.initial_share,
                    allowed,
                );
            }
            Self::VortexPair(c) => check_pair(
                p,
                (c.height, c.size),
                ("case.cross_wind", c.cross_wind),
                c.slip_sides,
            ),
            Self::Wake(c) => c.check(p),
            Self::Free(c) => c.check(p),
            _ => {}
        }
    }

    /// What `mesh` does not resolve of the vortices and of the boundary layer under them, in sentences.
    pub(super) fn unresolved(&self, mesh: &Mesh) -> Vec<String> {
        let lengths = match self {
            Self::Dipole(c) => Some(VortexLengths::dipole(c.reynolds)),
            Self::VortexPair(c) => Some(VortexLengths::pair(
                c.core_radius,
                c.height,
                c.reynolds,
                1.0,
            )),
            Self::Wake(c) => {
                let scales = c.pair.scales().ok();
                scales.map(|scales| {
                    VortexLengths::pair(c.core_radius, c.height, c.reynolds, scales.spacing_m)
                })
            }
            _ => None,
        };
        lengths.map_or_else(Vec::new, |lengths| {
            Resolution::new(mesh, &lengths).warnings()
        })
    }

    /// Cells along x, y, z.
    pub fn cells(&self) -> [usize; 3] {
        match *self {
            Self::TaylorGreenPlane(ref c) => [1, c.cells, c.cells],
            Self::TaylorGreen(ref c) => [c.cells; 3],
            Self::Poiseuille(ref c)
            | Self::Couette(ref c)
            | Self::StokesLayer(ref c)
            | Self::RayleighPlate(ref c) => [1, 1, c.cells],
            Self::OrrSommerfeld(ref c) => [c.cells[0], 1, c.cells[1]],
            Self::Dipole(ref c) => [1, c.cells[0], c.cells[1]],
            Self::LidDrivenCavity(ref c) => [1, c.cells, c.cells],
            Self::Channel(ref c) => c.cells,
            Self::VortexPair(ref c) => c.cells,
            Self::Wake(ref c) => c.cells,
            Self::Free(ref c) => [c.x.cells, c.y.cells, c.z.cells],
        }
    }

    /// The same numbers, to be changed.
    pub(super) fn cells_mut(&mut self) -> Vec<&mut usize> {
        match self {
            Self::TaylorGreenPlane(c) => vec![&mut c.cells],
            Self::TaylorGreen(c) => vec![&mut c.cells],
            Self::Poiseuille(c)
            | Self::Couette(c)
            | Self::StokesLayer(c)
            | Self::RayleighPlate(c) => {
                vec![&mut c.cells]
            }
            Self::OrrSommerfeld(c) => c.cells.iter_mut().collect(),
            Self::Dipole(c) => c.cells.iter_mut().collect(),
            Self::LidDrivenCavity(c) => vec![&mut c.cells],
            Self::Channel(c) => c.cells.iter_mut().collect(),
            Self::VortexPair(c) => c.cells.iter_mut().collect(),
            Self::Wake(c) => c.cells.iter_mut().collect(),
            Self::Free(c) => vec![&mut c.x.cells, &mut c.y.cells, &mut c.z.cells],
        }
    }

    /// Mesh, settings and initial field; `folder` is that of the case file.
    pub(super) fn setup(&self, folder: &Path) -> Result<Setup, Error> {
        let steady = |case: Result<Case, wakescope_les::Error>| {
            let mut case = case?;
            let courant = TimeScheme::AdamsBashforth2.default_courant();
            case.settings.time_step = TimeStep::Courant {
                courant,
                longest_s: case.end_s / LEAST_STEPS,
            };
            Ok(case)
        };
        let plates = |c: &PlateDriven| cases::Plates {
            cells: c.cells,
            strength: c.stretch,
            viscosity_m2_s: c.viscosity_m2_s,
            step_s: ANY_STEP_S,
        };
        let case = match *self {
            Self::TaylorGreenPlane(ref c) => steady(cases::taylor_green_plane(
                c.cells,
                c.stretch,
                c.viscosity_m2_s,
                ANY_STEP_S,
            )),
            Self::TaylorGreen(ref c) => cases::taylor_green_3d(c.cells, c.reynolds),
            Self::Poiseuille(ref c) => steady(plates(c).poiseuille(c.initial_share)),
            Self::Couette(ref c) => steady(plates(c).couette(c.initial_share)),
            Self::StokesLayer(ref c) => steady(plates(c).decaying_layer()),
            Self::RayleighPlate(ref c) => steady(plates(c).rayleigh_plate()),
            Self::OrrSommerfeld(ref c) => steady(
                TollmienSchlichting::new(c.reynolds, c.wave_number)
                    .and_then(|wave| wave.case(c.cells, c.stretch, c.amplitude, ANY_STEP_S)),
            ),
            Self::Dipole(ref c) => {
                let dipole = if c.closed_sides {
                    cases::dipole_in_a_box
                } else {
                    cases::dipole_between_walls
                };
                dipole(c.cells, [c.lateral_stretch(), c.stretch], c.reynolds)
            }
            Self::LidDrivenCavity(ref c) => {
                cases::lid_driven_cavity(c.cells, c.stretch, c.reynolds)
            }
            Self::Channel(ref c) => cases::channel(c.cells, c.stretch, c.reynolds_tau),
            Self::VortexPair(ref c) => c.case(),
            Self::Wake(ref c) => return c.setup(),
            Self::Free(ref c) => return c.setup(folder),
        };
        let Case {
            mesh,
            settings,
            initial,
            end_s,
        } = case.map_err(Error::Flow)?;
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
