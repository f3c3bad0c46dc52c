//! Beams: when, from where and in which direction each pulse leaves, from the motion of the scanning head.
//!
//! Plain geometry, which knows nothing of scenes, winds or signals. A pulse is a [`Beam`]; a scan is a [`Schedule`] of lines, so
//! that memory does not grow with the pulses. Check: tables of directions, Doppler velocities from the air, head motion and
//! sweeps back and forth, of independent origin, to 1e-9.
//!
//! | module | what is in it |
//! |---|---|
//! | [`direction`] | unit vectors from azimuth and elevation; the radial velocity that a moving lidar sees |
//! | [`head`] | how long the head takes from angle to angle |
//! | [`path`] | sweeps: the stops of the head, or its ways, of each kind of scan |
//! | [`schedule`] | the lines of a scan on the clock of the pulses; their beams |

pub mod direction;
pub mod head;
pub mod path;
pub mod schedule;

#[cfg(test)]
mod tests;

pub use direction::Direction;
pub use head::Head;
pub use path::{Stop, SweepMode};
pub use schedule::{Beam, Crossing, Line, Mount, Schedule};
