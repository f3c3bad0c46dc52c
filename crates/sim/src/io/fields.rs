//! A whole velocity field at one time, at the centres of a stretched mesh.
//! Check: wrong lengths and values are refused; the formats' tests read fields back.

use super::checks::{increasing, same_length};
use crate::Error;
use std::ops::Range;

/// Velocity and pressure at the centres of the cells.
#[derive(Debug, Clone, PartialEq)]
pub struct VelocityField {
    /// Title of the file.
    pub title: String,
    /// Time, s.
    pub time_s: f64,
    /// Centres along the flight, m, increasing.
    pub x_m: Vec<f64>,
    /// Centres across it, m, increasing.
    pub y_m: Vec<f64>,
    /// Heights of the centres, m, increasing.
    pub z_m: Vec<f64>,
    /// Lengths of the box along x and y where these are periodic, m.
    pub period_m: [Option<f64>; 2],
    /// Velocities u, v, w, each `[z][y][x]`, m/s.
    pub velocity_m_s: [Vec<f64>; 3],
    /// Pressure over density, `[z][y][x]`, m^2/s^2, up to a constant.
    pub pressure_m2_s2: Vec<f64>,
    /// Magnitude of the vorticity, `[z][y][x]`, 1/s; where it is wanted.
    pub vorticity_per_s: Option<Vec<f64>>,
    /// The planes across z whose values these are; the rank that has the first one writes what belongs to no plane, too.
    pub planes: Range<usize>,
}

impl VelocityField {
    /// Checks axes and shapes.
    ///
    /// # Errors
    /// An axis that is empty or does not increase, an array of another length, a value that is not finite.
    pub fn check(&self) -> Result<(), Error> {
        increasing("x_m", &self.x_m)?;
        increasing("y_m", &self.y_m)?;
        increasing("z_m", &self.z_m)?;
        let cells = self.x_m.len() * self.y_m.len() * self.planes.len();
        for (name, values) in self.named() {
            same_length(name, values.len(), "z_m x y_m x x_m", cells)?;
            if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
                return Err(Error::value(name, bad, "must be finite"));
            }
        }
        Ok(())
    }

    /// The first of the values that are here, in the order of the whole field.
    pub(crate) fn first(&self) -> usize {
        self.planes.start * self.x_m.len() * self.y_m.len()
    }

    /// The fields with their names.
    pub(crate) fn named(&self) -> impl Iterator<Item = (&'static str, &[f64])> {
        let [u, v, w] = &self.velocity_m_s;
        let always: [(&'static str, &[f64]); 4] = [
            ("u_m_s", u),
            ("v_m_s", v),
            ("w_m_s", w),
            ("pressure_m2_s2", &self.pressure_m2_s2),
        ];
        always.into_iter().chain(
            self.vorticity_per_s
                .as_deref()
                .map(|values| ("vorticity_magnitude_hz", values)),
        )
    }
}

#[cfg(test)]
pub(crate) fn example() -> VelocityField {
    let x_m = vec![0.5, 1.5, 3.0];
    let y_m = vec![-1.0, 0.5];
    let z_m = vec![0.1, 0.3, 0.7, 1.5];
    let field = |a: f64| (0..24).map(|i| a + f64::from(i)).collect::<Vec<f64>>();
    VelocityField {
        title: "A flow".into(),
        time_s: 2.5,
        x_m,
        y_m,
        z_m,
        period_m: [None, Some(3.25)],
        velocity_m_s: [field(0.25), field(100.5), field(-300.0)],
        pressure_m2_s2: field(0.125),
        vorticity_per_s: Some(field(7.5)),
        planes: 0..4,
    }
}

/// What each of several ranks has of the example: two planes, none, one, one.
#[cfg(test)]
pub(crate) fn example_on_ranks() -> Vec<VelocityField> {
    let whole = example();
    let rank = |planes: Range<usize>| {
        let part = |values: &Vec<f64>| values[6 * planes.start..6 * planes.end].to_vec();
        VelocityField {
            velocity_m_s: whole.velocity_m_s.each_ref().map(part),
            pressure_m2_s2: part(&whole.pressure_m2_s2),
            vorticity_per_s: whole.vorticity_per_s.as_ref().map(part),
            planes,
            ..whole.clone()
        }
    };
    [0..2, 2..2, 2..3, 3..4].map(rank).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_lengths_and_values_are_refused() {
        let mut short = example();
        short.velocity_m_s[1].pop();
        assert!(matches!(short.check(), Err(Error::Length { .. })));
        let mut bad = example();
        bad.pressure_m2_s2[3] = f64::NAN;
        assert!(matches!(bad.check(), Err(Error::Value { .. })));
    }
}
