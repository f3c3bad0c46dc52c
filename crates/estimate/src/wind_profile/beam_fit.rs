//! The wind that fits radial velocities best: least squares over the beams, with the covariance of the residuals.
//!
//! On a cone it is the sine fit `a0 + a1 cos(az) + b1 sin(az)` of a VAD (Browning and Wexler 1968), and it needs no even spacing:
//! beams without velocity are skipped.

use crate::error::{Error, length};

/// A wind and the quality of its fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindFit {
    /// Wind in the axes of the directions \[m/s\].
    pub velocity_m_s: [f64; 3],
    /// Covariance of its components for radial velocities of variance 1: the inverse of the normal equations' matrix.
    pub unit_covariance: [[f64; 3]; 3],
    /// Standard deviation of the radial velocities about the fit \[m/s\], with three degrees of freedom taken off; NaN for three
    /// beams.
    pub residual_m_s: f64,
    /// Beams with a velocity.
    pub beams: usize,
}

impl WindFit {
    /// Standard deviations of the components, from the residuals \[m/s\].
    #[must_use]
    pub fn standard_deviation_m_s(&self) -> [f64; 3] {
        std::array::from_fn(|d| self.residual_m_s * self.unit_covariance[d][d].sqrt())
    }
}

/// The wind that fits velocities \[m/s\], positive away from the lidar, along unit vectors; NaN is no velocity. `None` if the
/// beams that have one do not determine three components.
///
/// # Errors
/// [`Error::Length`] if there is not one velocity for each direction.
pub fn fit_wind(direction: &[[f64; 3]], velocity_m_s: &[f64]) -> Result<Option<WindFit>, Error> {
    length("velocity_m_s", direction.len(), velocity_m_s.len())?;
    let mut normal = [[0.0; 3]; 3];
    let mut right = [0.0; 3];
    let mut beams = 0;
    for (e, v) in direction.iter().zip(velocity_m_s) {
        if !v.is_finite() {
            continue;
        }
        beams += 1;
        for i in 0..3 {
            right[i] += e[i] * v;
            for j in 0..3 {
                normal[i][j] += e[i] * e[j];
            }
        }
    }
    let Some(unit_covariance) = inverse(&normal) else {
        return Ok(None);
    };
    let wind_m_s = unit_covariance.map(|row| dot(row, right));
    let mut squares = 0.0;
    for (e, v) in direction.iter().zip(velocity_m_s) {
        if v.is_finite() {
            squares += (v - dot(*e, wind_m_s)).powi(2);
        }
    }
    let residual_m_s = if beams > 3 {
        (squares / (beams - 3) as f64).sqrt()
    } else {
        f64::NAN
    };
    Ok(Some(WindFit {
        velocity_m_s: wind_m_s,
        unit_covariance,
        residual_m_s,
        beams,
    }))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Determinants below this part of the cube of the trace are those of beams in a plane.
const SINGULAR: f64 = 1e-12;

/// The inverse of a symmetric matrix by its adjugate, if its columns span space.
fn inverse(m: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let mut determinant = 0.0;
    for j in 0..3 {
        determinant += m[0][j] * cofactor(m, 0, j);
    }
    let trace = m[0][0] + m[1][1] + m[2][2];
    let regular = determinant > SINGULAR * trace.powi(3);
    regular
        .then(|| std::array::from_fn(|i| std::array::from_fn(|j| cofactor(m, j, i) / determinant)))
}

/// Cofactor of the element (i, j) of a matrix.
fn cofactor(m: &[[f64; 3]; 3], i: usize, j: usize) -> f64 {
    let a = (i + 1) % 3;
    let b = (i + 2) % 3;
    let c = (j + 1) % 3;
    let d = (j + 2) % 3;
    m[a][c] * m[b][d] - m[a][d] * m[b][c]
}
