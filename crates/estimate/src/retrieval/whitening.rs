//! Cholesky factor of the covariance of correlated velocities, by which residuals and slopes are made white.
//!
//! C_ik = deviation^2 exp(-distance / length) + sigma_i^2 [i = k]. Check: white residuals of made-up turbulence; the inverse.

use multiversion::multiversion;

use crate::linalg::dot;
use crate::parallel::map_indexed;
use crate::retrieval::Turbulence;

/// Rows that are worked on together while the rows above are read once.
const BLOCK: usize = 48;

/// Lower factor L of C = L L^T, row by row.
pub(crate) struct Whitening {
    rows: Vec<Vec<f64>>,
}

impl Whitening {
    /// Of cells at (lateral position, height) with their standard deviations; nothing if C is singular to working precision.
    pub(crate) fn new(cells: &[((f64, f64), f64)], turbulence: &Turbulence) -> Option<Self> {
        let variance = turbulence.deviation_m_s.powi(2);
        let covariance = |(i, k): (usize, usize)| {
            let (((ya, za), sigma), ((yb, zb), _)) = (cells[i], cells[k]);
            let distance_m = (ya - yb).hypot(za - zb);
            let own = if i == k { sigma * sigma } else { 0.0 };
            variance * (-distance_m / turbulence.length_m).exp() + own
        };
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(cells.len());
        for from in (0..cells.len()).step_by(BLOCK) {
            let to = (from + BLOCK).min(cells.len());
            let block = map_indexed(
                to - from,
                || (),
                |(), i| (0..=from + i).map(|k| covariance((from + i, k))).collect::<Vec<f64>>(),
            );
            eliminate(&mut rows, block)?;
        }
        Some(Self { rows })
    }

    /// Replaces x by L^-1 x.
    pub(crate) fn whiten(&self, x: &mut [f64]) {
        solve_lower(&self.rows, x);
    }
}

/// Turns the rows of a block of C into those of L and puts them below the finished ones.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn eliminate(rows: &mut Vec<Vec<f64>>, mut block: Vec<Vec<f64>>) -> Option<()> {
    let from = rows.len();
    for (k, above) in rows.iter().enumerate() {
        let (done, pivot) = (&above[..k], above[k]);
        for row in &mut block {
            row[k] = (row[k] - dot(done, &row[..k])) / pivot;
        }
    }
    for mut row in block {
        let last = row.len() - 1;
        for k in from..last {
            row[k] = (row[k] - dot(&rows[k][..k], &row[..k])) / rows[k][k];
        }
        let square = row[last] - dot(&row[..last], &row[..last]);
        // also false for NaN
        if !(square > 1e-14 * row[last] && square.is_finite()) {
            return None;
        }
        row[last] = square.sqrt();
        rows.push(row);
    }
    Some(())
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn solve_lower(rows: &[Vec<f64>], x: &mut [f64]) {
    for (i, row) in rows.iter().enumerate() {
        x[i] = (x[i] - dot(&row[..i], &x[..i])) / row[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_times_its_transpose_is_the_covariance() {
        let turbulence = Turbulence { deviation_m_s: 1.2, length_m: 25.0 };
        let cells: Vec<((f64, f64), f64)> = (0..130)
            .map(|i| ((f64::from(i % 13) * 4.0, f64::from(i / 13) * 2.0), 0.3 + 0.01 * f64::from(i % 7)))
            .collect();
        let factor = Whitening::new(&cells, &turbulence).unwrap();
        for (i, k) in [(0, 0), (7, 3), (100, 60), (129, 129)] {
            let (((ya, za), sigma), ((yb, zb), _)) = (cells[i], cells[k]);
            let own = if i == k { sigma * sigma } else { 0.0 };
            let expected = 1.44 * (-(ya - yb).hypot(za - zb) / 25.0).exp() + own;
            let product = dot(&factor.rows[i][..=k], &factor.rows[k][..=k]);
            assert!((product - expected).abs() < 1e-12, "{i} {k}");
        }
        // columns of L become those of the unit matrix
        let mut column: Vec<f64> = factor.rows.iter().map(|row| row.get(60).copied().unwrap_or(0.0)).collect();
        factor.whiten(&mut column);
        assert!(column.iter().enumerate().all(|(i, x)| (x - f64::from(u8::from(i == 60))).abs() < 1e-12));
        // two cells at one place without noise of their own
        assert!(Whitening::new(&[((1.0, 1.0), 0.0), ((1.0, 1.0), 0.0)], &turbulence).is_none());
    }
}
