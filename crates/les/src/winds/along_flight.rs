//! A pair whose age grows behind the aircraft: at each place along the flight it is as old as the
//! time since the aircraft passed.
//!
//! Check: a table of ages; before the aircraft the air is at rest.

use super::wind::Wind;
use crate::error::{Error, check, check_lengths};

/// The wake of an aircraft that flies along +x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlongFlight<W> {
    pair: W,
    speed_m_s: f64,
    aircraft_x_m: f64,
}

impl<W: Wind> AlongFlight<W> {
    /// The wake of an aircraft that is at `aircraft_x_m` at time 0, of a pair whose time is its age.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a speed that is not positive.
    pub fn new(pair: W, speed_m_s: f64, aircraft_x_m: f64) -> Result<Self, Error> {
        check("speed_m_s", speed_m_s, "positive", |v| v > 0.0)?;
        check("aircraft_x_m", aircraft_x_m, "finite", |_| true)?;
        Ok(Self {
            pair,
            speed_m_s,
            aircraft_x_m,
        })
    }

    /// Time since the aircraft passed `x_m`, s; negative where it has not yet.
    pub fn age_s(&self, x_m: f64, time_s: f64) -> f64 {
        time_s + (self.aircraft_x_m - x_m) / self.speed_m_s
    }
}

impl<W: Wind> Wind for AlongFlight<W> {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        // Places that follow each other with one x are of one age.
        let mut outs = out_m_s;
        for part in points_m.chunk_by(|a, b| a[0] == b[0]) {
            let (here, rest) = outs.split_at_mut(part.len());
            outs = rest;
            let age_s = self.age_s(part[0][0], time_s);
            if age_s < 0.0 {
                here.fill([0.0; 3]);
            } else {
                self.pair.velocity_into(part, age_s, here)?;
            }
        }
        Ok(())
    }

    /// That of the pair when it is released and at the time that is asked for: the older one is
    /// nearer to the ground.
    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        self.pair.max_gradient_per_s(0.0).max(
            self.pair
                .max_gradient_per_s(self.age_s(-1e4, time_s).max(0.0)),
        )
    }
}
