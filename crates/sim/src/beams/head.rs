//! How long a scanning head takes: it speeds up, turns at most at its rate, and slows down.
//!
//! Check: the table of head motions; a head without limits takes no time.

/// What bounds the motion of a scanning head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Head {
    /// Largest rate, rad/s; infinite for none.
    pub rate_rad_s: f64,
    /// Acceleration, rad/s^2; infinite for none.
    pub acceleration_rad_s2: f64,
    /// Time that a line takes beside its pulses, s; the head moves meanwhile.
    pub dead_time_s: f64,
}

impl Head {
    /// Time from rest to rest over an angle, s: `2 sqrt(d/A)` as long as the rate is not reached, `d/S + S/A` beyond.
    pub fn time_s(&self, angle_rad: f64) -> f64 {
        let (angle_rad, rate, acceleration) =
            (angle_rad.abs(), self.rate_rad_s, self.acceleration_rad_s2);
        if acceleration.is_infinite() {
            return angle_rad / rate;
        }
        if angle_rad * acceleration <= rate * rate {
            return 2.0 * (angle_rad / acceleration).sqrt();
        }
        angle_rad / rate + rate / acceleration
    }

    /// Time from leaving the end of a sweep at full rate to coming back to it at full rate, s: `2 S/A`.
    pub fn turn_round_s(&self) -> f64 {
        if self.acceleration_rad_s2.is_infinite() {
            0.0
        } else {
            2.0 * self.rate_rad_s / self.acceleration_rad_s2
        }
    }
}
