//! The vortex pair near the ground in space, against an independent code in the same box with the same noise formula
//! (`tests/reference/les/wake_3d_*.csv`).

pub(super) mod bars;
pub(super) mod crosswind;
pub(super) mod history;
pub(super) mod onset;
mod read;
