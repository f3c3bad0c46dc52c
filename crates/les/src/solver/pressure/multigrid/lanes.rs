//! Modes that are solved side by side.

/// How many.
pub(super) const LANES: usize = 16;
/// One value of each mode, in the precision of the cycle.
pub(super) type Lanes = [f32; LANES];
/// One value of each mode.
pub(super) type Wide = [f64; LANES];
