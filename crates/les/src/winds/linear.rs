//! A wind that is linear in place and in time: what lidars assume of the air between their beams.
//!
//! Check: a table of velocities; the largest line gradient is the largest eigenvalue of the strain
//! rate.

use super::strain::largest_strain_per_s;
use super::wind::Wind;
use crate::error::{Error, check, check_lengths};

/// `u + G x + a t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Velocity at the origin at time 0, (u, v, w) \[m/s\].
    pub velocity_m_s: [f64; 3],
    /// `G`, row by row: how fast u, then v, then w change along x, y, z \[1/s\].
    pub gradient_per_s: [[f64; 3]; 3],
    /// `a`, how fast they change in time \[m/s^2\].
    pub acceleration_m_s2: [f64; 3],
}

impl Linear {
    /// The same velocity `(u, v, w)` everywhere and always.
    ///
    /// # Errors
    /// As [`Self::validated`].
    pub fn uniform(velocity_m_s: [f64; 3]) -> Result<Self, Error> {
        Self {
            velocity_m_s,
            gradient_per_s: [[0.0; 3]; 3],
            acceleration_m_s2: [0.0; 3],
        }
        .validated()
    }

    /// Says what is wrong with the wind, if anything.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a number that is not finite.
    pub fn validated(self) -> Result<Self, Error> {
        let numbers = self
            .gradient_per_s
            .iter()
            .flatten()
            .chain(&self.velocity_m_s)
            .chain(&self.acceleration_m_s2);
        for &value in numbers {
            check("linear wind", value, "finite", |_| true)?;
        }
        Ok(self)
    }
}

impl Wind for Linear {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        for (point_m, out) in points_m.iter().zip(out_m_s) {
            for (d, component) in out.iter_mut().enumerate() {
                let along: f64 = self.gradient_per_s[d]
                    .iter()
                    .zip(point_m)
                    .map(|(g, x)| g * x)
                    .sum();
                *component = self.velocity_m_s[d] + along + self.acceleration_m_s2[d] * time_s;
            }
        }
        Ok(())
    }

    /// Exactly the largest eigenvalue of the strain rate.
    fn max_gradient_per_s(&self, _time_s: f64) -> f64 {
        largest_strain_per_s(&self.gradient_per_s)
    }
}
