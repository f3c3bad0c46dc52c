//! What a wake does to an aircraft that follows: its rolling-moment coefficient by strip theory.
//!
//! A rectangular wing of span b and aspect ratio A flies along the vortices with speed U; each strip lifts with the slope a times
//! the vertical wind over U. With one vortex of profile (3) seen from the middle of the wing at (o, h), C^2 = r_c^2 + h^2,
//!
//! ```text
//! C_l = a Gamma / (2 pi U b^2) [u - C atan(u / C) + (o / 2) ln(u^2 + C^2)] from u = -b/2 - o to b/2 - o
//! ```
//!
//! and a sum over the vortices and their images. Check: a stored table of an independent quadrature.

use std::f64::consts::PI;

use crate::error::{Error, positive};
use crate::vortex_fit::{Wake, WakeModel};

/// Slope of the lift of a wing of finite span; the literature has both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LiftSlope {
    /// 2 pi A / (A + 2).
    Span,
    /// 2 pi A / (A + 4): the correction of an elliptic wing for its semispan.
    Semispan,
}

/// The aircraft that follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follower {
    /// Span of the wing \[m\].
    pub span_m: f64,
    /// Span squared over the area of the wing.
    pub aspect_ratio: f64,
    /// True air speed \[m/s\].
    pub speed_m_s: f64,
    /// Slope of the lift.
    pub slope: LiftSlope,
}

impl Follower {
    /// Rolling-moment coefficient with the middle of the wing at that place \[m\], positive if the wing at larger y goes up; of the
    /// profile (3).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible aircraft or wake.
    pub fn rolling_moment(
        &self,
        model: &WakeModel,
        wake: &Wake,
        at_m: (f64, f64),
    ) -> Result<f64, Error> {
        positive("span_m", self.span_m)?;
        positive("aspect_ratio", self.aspect_ratio)?;
        positive("speed_m_s", self.speed_m_s)?;
        wake.validate()?;
        let two = match self.slope {
            LiftSlope::Span => 2.0,
            LiftSlope::Semispan => 4.0,
        };
        let slope = 2.0 * PI * self.aspect_ratio / (self.aspect_ratio + two);
        let moments = model.sources(wake).map(|(vortex, _, side, sense)| {
            let away_m = (
                vortex.lateral_position_m - at_m.0,
                side * vortex.height_m - at_m.1,
            );
            let core2 = vortex.core_radius_m.powi(2) + away_m.1.powi(2);
            let core = core2.sqrt();
            let [to_left, to_right] = [-0.5, 0.5].map(|semispan| {
                let u = semispan * self.span_m - away_m.0;
                u - core * (u / core).atan() + 0.5 * away_m.0 * (u * u + core2).ln()
            });
            sense * vortex.circulation_m2_s * (to_right - to_left)
        });
        Ok(slope / (2.0 * PI * self.speed_m_s * self.span_m.powi(2)) * moments.sum::<f64>())
    }
}
