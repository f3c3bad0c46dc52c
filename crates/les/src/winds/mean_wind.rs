//! A horizontal wind that depends on the height alone: the neutral logarithmic law, a power law, or
//! a table.
//!
//! Logarithmic law: `U = (u_*/kappa) ln((z - d)/z0)` with `kappa` = 0.4; power law:
//! `U = U_r (z/z_r)^p`. Both have an endless gradient at the ground. Below
//! [`MeanWind::linear_below_m`] the speed is therefore linear in the height, down to 0.
//!
//! Check: stored tables; the largest gradient is that of a search over heights.

use super::wind::Wind;
use crate::error::{Error, check, check_lengths};

/// The constant of von Karman, kappa.
pub const VON_KARMAN_CONSTANT: f64 = 0.4;

/// Roughness lengths below which the logarithmic law is linear.
const LINEAR_ROUGHNESSES: f64 = 10.0;
/// Least height below which a law is linear \[m\].
const LEAST_LINEAR_M: f64 = 1.0;

/// The speed, or the velocity, of a mean wind against the height.
#[derive(Debug, Clone, PartialEq)]
pub enum WindLaw {
    /// The neutral logarithmic law.
    Logarithmic {
        /// Friction velocity `u_*` \[m/s\].
        friction_velocity_m_s: f64,
        /// Roughness length `z0` \[m\].
        roughness_m: f64,
        /// Displacement height `d` \[m\].
        displacement_m: f64,
    },
    /// The power law.
    Power {
        /// Speed `U_r` at the reference height \[m/s\].
        speed_m_s: f64,
        /// Reference height `z_r` \[m\].
        reference_height_m: f64,
        /// Exponent `p`.
        exponent: f64,
    },
    /// Straight lines of both components between heights; constant outside.
    Table {
        /// Heights, increasing \[m\].
        height_m: Vec<f64>,
        /// Speed at each height \[m/s\].
        speed_m_s: Vec<f64>,
        /// Direction towards which the air moves at each height, clockwise from +x \[rad\].
        toward_rad: Vec<f64>,
    },
}

/// A horizontal wind that depends on the height alone.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanWind {
    law: WindLaw,
    /// Unit vector (x, y) of laws with one direction.
    toward: [f64; 2],
}

impl MeanWind {
    /// A wind of one law. `toward_rad` is the direction towards which the air moves, clockwise from
    /// +x; a table has its own directions.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for numbers that are not finite, a roughness or reference height that is
    /// not above 0, a table with columns of different lengths or heights that do not increase.
    pub fn new(law: WindLaw, toward_rad: f64) -> Result<Self, Error> {
        check("toward_rad", toward_rad, "finite", |_| true)?;
        match &law {
            WindLaw::Logarithmic {
                friction_velocity_m_s,
                roughness_m,
                displacement_m,
            } => {
                not_negative("friction_velocity_m_s", *friction_velocity_m_s)?;
                check("roughness_m", *roughness_m, "above 0", |z| z > 0.0)?;
                not_negative("displacement_m", *displacement_m)?;
            }
            WindLaw::Power {
                speed_m_s,
                reference_height_m,
                exponent,
            } => {
                not_negative("speed_m_s", *speed_m_s)?;
                check(
                    "reference_height_m",
                    *reference_height_m,
                    "above 0",
                    |height_m| height_m > 0.0,
                )?;
                check("exponent", *exponent, "from 0 to 1", |p| {
                    (0.0..=1.0).contains(&p)
                })?;
            }
            WindLaw::Table {
                height_m,
                speed_m_s,
                toward_rad,
            } => check_table(height_m, speed_m_s, toward_rad)?,
        }
        let (sin, cos) = toward_rad.sin_cos();
        Ok(Self {
            law,
            toward: [cos, sin],
        })
    }

    /// Friction velocity \[m/s\] of the logarithmic law that has `speed_m_s` at `height_m`, which is
    /// above `displacement_m + roughness_m`.
    pub fn friction_velocity_m_s(
        speed_m_s: f64,
        height_m: f64,
        roughness_m: f64,
        displacement_m: f64,
    ) -> f64 {
        VON_KARMAN_CONSTANT * speed_m_s / ((height_m - displacement_m) / roughness_m).ln()
    }

    /// Height above the displacement below which the speed is linear \[m\]: 10 roughness lengths, and
    /// at least 1 m; 0 for a table.
    pub fn linear_below_m(&self) -> f64 {
        match &self.law {
            WindLaw::Logarithmic { roughness_m, .. } => {
                (LINEAR_ROUGHNESSES * roughness_m).max(LEAST_LINEAR_M)
            }
            WindLaw::Power { .. } => LEAST_LINEAR_M,
            WindLaw::Table { .. } => 0.0,
        }
    }

    /// Components (x, y) at a height \[m/s\].
    pub fn velocity_m_s(&self, height_m: f64) -> [f64; 2] {
        if height_m.is_nan() {
            return [f64::NAN; 2];
        }
        let speed_m_s = match &self.law {
            WindLaw::Logarithmic { displacement_m, .. } => {
                self.law_speed_m_s(height_m - displacement_m)
            }
            WindLaw::Power { .. } => self.law_speed_m_s(height_m),
            WindLaw::Table {
                height_m: heights_m,
                speed_m_s,
                toward_rad,
            } => return table_m_s(heights_m, speed_m_s, toward_rad, height_m),
        };
        self.toward.map(|part| part * speed_m_s)
    }

    /// Speed of a law at a height above its displacement, linear near the ground \[m/s\].
    fn law_speed_m_s(&self, above_m: f64) -> f64 {
        let linear_m = self.linear_below_m();
        let fraction = (above_m / linear_m).clamp(0.0, 1.0);
        let at_m = above_m.max(linear_m);
        let speed_m_s = match &self.law {
            WindLaw::Logarithmic {
                friction_velocity_m_s,
                roughness_m,
                ..
            } => friction_velocity_m_s / VON_KARMAN_CONSTANT * (at_m / roughness_m).ln(),
            WindLaw::Power {
                speed_m_s,
                reference_height_m,
                exponent,
            } => speed_m_s * (at_m / reference_height_m).powf(*exponent),
            WindLaw::Table { .. } => 0.0,
        };
        fraction * speed_m_s
    }
}

impl Wind for MeanWind {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        _time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        for (point_m, out) in points_m.iter().zip(out_m_s) {
            let [x_m_s, y_m_s] = self.velocity_m_s(point_m[2]);
            *out = [x_m_s, y_m_s, 0.0];
        }
        Ok(())
    }

    /// Exactly half of the largest change with height: `e . grad(u) . e = e_h e_z dU/dz`.
    fn max_gradient_per_s(&self, _time_s: f64) -> f64 {
        let steepest = match &self.law {
            // The linear part is steeper than the law above it: ln(10) > 1, p <= 1.
            WindLaw::Logarithmic { .. } | WindLaw::Power { .. } => {
                let linear_m = self.linear_below_m();
                self.law_speed_m_s(linear_m) / linear_m
            }
            WindLaw::Table {
                height_m,
                speed_m_s,
                toward_rad,
            } => steepest_of_table_per_s(height_m, speed_m_s, toward_rad),
        };
        0.5 * steepest
    }
}

/// Fails if a number is negative or not finite.
fn not_negative(field: &'static str, value: f64) -> Result<(), Error> {
    check(field, value, "0 or above", |value| value >= 0.0)
}

/// Fails if the columns differ in length, the heights do not increase, or a number is not finite.
fn check_table(height_m: &[f64], speed_m_s: &[f64], toward_rad: &[f64]) -> Result<(), Error> {
    let rows = height_m.len() as f64;
    check("rows of height_m", rows, "at least 1", |rows| rows >= 1.0)?;
    for (field, column) in [("speed_m_s", speed_m_s), ("toward_rad", toward_rad)] {
        if column.len() != height_m.len() {
            return Err(Error::OutOfRange {
                field,
                value: column.len() as f64,
                allowed: "as many values as heights",
            });
        }
        for value in column {
            check(field, *value, "finite", |_| true)?;
        }
    }
    let mut before_m = f64::NEG_INFINITY;
    for value_m in height_m {
        check(
            "height_m",
            *value_m,
            "finite and above the height before it",
            |value_m| value_m > before_m,
        )?;
        before_m = *value_m;
    }
    Ok(())
}

/// Components (x, y) of one row of a table \[m/s\].
fn row_m_s(speed_m_s: f64, toward_rad: f64) -> [f64; 2] {
    let (sin, cos) = toward_rad.sin_cos();
    [speed_m_s * cos, speed_m_s * sin]
}

/// Components (x, y) at a height, on straight lines between the rows \[m/s\].
fn table_m_s(heights_m: &[f64], speed_m_s: &[f64], toward_rad: &[f64], z_m: f64) -> [f64; 2] {
    let above = heights_m.partition_point(|height_m| *height_m <= z_m);
    if above == 0 || above == heights_m.len() {
        let row = above.saturating_sub(1);
        return row_m_s(speed_m_s[row], toward_rad[row]);
    }
    let low = row_m_s(speed_m_s[above - 1], toward_rad[above - 1]);
    let high = row_m_s(speed_m_s[above], toward_rad[above]);
    let fraction = (z_m - heights_m[above - 1]) / (heights_m[above] - heights_m[above - 1]);
    [0, 1].map(|d| low[d] + fraction * (high[d] - low[d]))
}

/// Largest change of the velocity with height \[1/s\].
fn steepest_of_table_per_s(heights_m: &[f64], speed_m_s: &[f64], toward_rad: &[f64]) -> f64 {
    let mut steepest = 0.0_f64;
    for i in 1..heights_m.len() {
        let low = row_m_s(speed_m_s[i - 1], toward_rad[i - 1]);
        let high = row_m_s(speed_m_s[i], toward_rad[i]);
        let change_m_s = (high[0] - low[0]).hypot(high[1] - low[1]);
        steepest = steepest.max(change_m_s / (heights_m[i] - heights_m[i - 1]));
    }
    steepest
}
