//! Which flow a case is: a vortex pair, a wake, a user-supplied flow; their limits and their setups.

use super::free::Free;
use super::setup::Setup;
use super::vortex_pair::VortexPairFlow;
use super::wake::WakeFlow;
use crate::Error;
use crate::keys::{Checker, keys};
use std::path::Path;

keys! {
    /// Which flow.
    kinds CaseKind by "kind" {
        /// A vortex pair above ground, in plane or space.
        "vortex_pair" => VortexPair(VortexPairFlow),
        /// The wake of an aircraft near the ground, measured during the run.
        "wake" => Wake(Box<WakeFlow>),
        /// User-supplied mesh, viscosity and initial field, in SI units.
        "free" => Free(Box<Free>),
    }
}

impl CaseKind {
    /// Limits between the keys of a flow.
    pub(super) fn check(&self, p: &mut Checker<'_>) {
        match self {
            Self::VortexPair(pair) => pair.check(p),
            Self::Wake(wake) => wake.check(p),
            Self::Free(free) => free.check(p),
        }
    }

    /// What the mesh of a pair does not resolve of its cores and of the boundary layer under them, in sentences.
    pub(super) fn unresolved(&self) -> Vec<String> {
        let pair = match self {
            Self::VortexPair(pair) => Ok(pair.pair_case()),
            Self::Wake(wake) => wake.pair_case(),
            Self::Free(_) => return Vec::new(),
        };
        // What makes no mesh has been refused.
        pair.and_then(|pair| pair.unresolved_lengths())
            .unwrap_or_default()
    }

    /// Cells along x, y, z.
    pub fn cells(&self) -> [usize; 3] {
        match self {
            Self::VortexPair(pair) => pair.cells,
            Self::Wake(wake) => wake.cells,
            Self::Free(free) => [free.x.cells, free.y.cells, free.z.cells],
        }
    }

    /// The same numbers, to be changed.
    pub(super) fn cells_mut(&mut self) -> [&mut usize; 3] {
        match self {
            Self::VortexPair(pair) => pair.cells.each_mut(),
            Self::Wake(wake) => wake.cells.each_mut(),
            Self::Free(free) => [&mut free.x.cells, &mut free.y.cells, &mut free.z.cells],
        }
    }

    /// Mesh, settings and initial field; `folder` is that of the case file.
    pub(super) fn setup(&self, folder: &Path) -> Result<Setup, Error> {
        match self {
            Self::VortexPair(pair) => pair.setup(),
            Self::Wake(wake) => wake.setup(),
            Self::Free(free) => free.setup(folder),
        }
    }
}
