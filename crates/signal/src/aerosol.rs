//! Aerosol over height: extinction from visibility, and a boundary layer with a step at its top.
//!
//! Check: tables of an independent program.

use crate::error::{Error, check, check_positive};
use crate::medium::Medium;

/// Wavelength of visibility, m.
const GREEN_M: f64 = 0.55e-6;
/// Least visibility of the law, m: below it is fog, whose droplets are too large.
pub const LEAST_VISIBILITY_M: f64 = 1000.0;
/// Height over which the backscatter above a layer falls by e, m.
const SCALE_ABOVE_M: f64 = 2000.0;
/// Heights beyond which nothing changes, in scale heights: the backscatter is below 1e-8 there.
const SCALE_HEIGHTS: f64 = 20.0;
/// Points of a table: in the smallest scale height, and in the half width of the step.
const POINTS_PER_SCALE: f64 = 400.0;
const POINTS_PER_STEP: f64 = 300.0;
/// Half widths of the step on each side of the top that have the finer points.
const STEP_REACH: f64 = 8.0;

/// Extinction coefficient \[1/m\], one way, of haze with a meteorological visibility:
/// `3.912/V (lambda/0.55 um)^(-q)` (Kruse), `q` = 1.6 above 50 km, 1.3 above 6 km, else
/// `0.16 V/km + 0.34` (Kim, McArthur and Korevaar 2001).
///
/// # Errors
/// [`Error::OutOfRange`] for a visibility below 1 km, which is fog, or a wavelength that is not
/// positive.
pub fn extinction_of_visibility_per_m(visibility_m: f64, wavelength_m: f64) -> Result<f64, Error> {
    check(
        "visibility_m",
        visibility_m,
        "at least 1000 m: fog is not modelled",
        |v| v >= LEAST_VISIBILITY_M,
    )?;
    check_positive("wavelength_m", wavelength_m)?;
    let visibility_km = 1e-3 * visibility_m;
    let exponent = match visibility_km {
        v if v > 50.0 => 1.6,
        v if v > 6.0 => 1.3,
        v => 0.16 * v + 0.34,
    };
    // 3.912 is -ln 0.02, the contrast of visibility.
    Ok(3.912 / visibility_m * (wavelength_m / GREEN_M).powf(-exponent))
}

/// Aerosol of a boundary layer: exponential below its top and above it, with a smooth step between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AerosolLayer {
    /// Backscatter coefficient at the ground, 1/(m sr).
    pub ground_per_m_sr: f64,
    /// Height over which it falls by e within the layer, m.
    pub scale_height_m: f64,
    /// Height of the top, m.
    pub top_m: f64,
    /// Backscatter coefficient right above the layer, 1/(m sr); it falls by e over 2000 m.
    pub above_per_m_sr: f64,
    /// Half width of the step at the top, m.
    pub step_m: f64,
}

impl AerosolLayer {
    /// Backscatter coefficient \[1/(m sr)\] at a height.
    pub fn backscatter_per_m_sr(&self, height_m: f64) -> f64 {
        let above_m = height_m - self.top_m;
        let step = 0.5 * (1.0 + (above_m / self.step_m).tanh());
        let below = self.ground_per_m_sr * (-height_m / self.scale_height_m).exp();
        let above = self.above_per_m_sr * (-above_m.max(0.0) / SCALE_ABOVE_M).exp();
        below * (1.0 - step) + above * step
    }

    /// The layer as a table over height, with an extinction of `lidar_ratio_sr` times the
    /// backscatter; its values are within 3e-6 of the formula.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for lengths that are not positive, coefficients or a ratio that are
    /// negative.
    pub fn over_height(&self, lidar_ratio_sr: f64) -> Result<Medium, Error> {
        check_positive("scale_height_m", self.scale_height_m)?;
        check_positive("top_m", self.top_m)?;
        check_positive("step_m", self.step_m)?;
        let height_m = self.heights_m();
        let mut backscatter_per_m_sr = Vec::with_capacity(height_m.len());
        for &height_m in &height_m {
            backscatter_per_m_sr.push(self.backscatter_per_m_sr(height_m));
        }
        let extinction_per_m = backscatter_per_m_sr
            .iter()
            .map(|b| lidar_ratio_sr * b)
            .collect();
        Medium::new(height_m, backscatter_per_m_sr, extinction_per_m)
    }

    /// Heights of the table: close about the step, else evenly; the last one is very high.
    fn heights_m(&self) -> Vec<f64> {
        let coarse_m = self.scale_height_m.min(SCALE_ABOVE_M) / POINTS_PER_SCALE;
        let fine_m = coarse_m.min(self.step_m / POINTS_PER_STEP);
        let reach_m = STEP_REACH * self.step_m;
        let end_m = self.top_m + reach_m + SCALE_HEIGHTS * SCALE_ABOVE_M;
        let mut heights_m = Vec::new();
        let mut height_m = 0.0;
        while height_m < end_m {
            heights_m.push(height_m);
            let is_step = (height_m - self.top_m).abs() < reach_m;
            height_m += if is_step { fine_m } else { coarse_m };
        }
        heights_m.push(end_m);
        heights_m.push(end_m + 1e12);
        heights_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Vec<Vec<f64>> {
        let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
        lines
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
            .collect()
    }

    #[test]
    fn extinctions_are_those_of_the_table_and_fog_is_refused() {
        let table = include_str!("../../../tests/reference/air/extinction.csv");
        for row in rows(table) {
            for (column, wavelength_m) in [(1, 1.55e-6), (2, 2.0e-6)] {
                let found = extinction_of_visibility_per_m(1e3 * row[0], wavelength_m).unwrap();
                assert!((found / row[column] - 1.0).abs() < 1e-8, "{row:?} {found}");
            }
        }
        assert!(matches!(
            extinction_of_visibility_per_m(999.0, 1.55e-6),
            Err(Error::OutOfRange {
                field: "visibility_m",
                ..
            })
        ));
    }

    #[test]
    fn a_layer_along_slanted_lines_has_the_backscatter_and_depth_of_the_table() {
        let layer = AerosolLayer {
            ground_per_m_sr: 2e-6,
            scale_height_m: 3000.0,
            top_m: 900.0,
            above_per_m_sr: 5e-8,
            step_m: 60.0,
        };
        let table = include_str!("../../../tests/reference/air/aerosol_layer.csv");
        let over_height = layer.over_height(40.0).unwrap();
        for row in rows(table) {
            let line = over_height.along(0.0, row[0]);
            let backscatter = line.backscatter_per_m_sr(row[1]).unwrap();
            let depth = -line.transmission(row[1]).unwrap().ln();
            assert!(
                (backscatter / row[2] - 1.0).abs() < 1e-5,
                "{row:?} {backscatter}"
            );
            assert!((depth / row[3] - 1.0).abs() < 1e-5, "{row:?} {depth}");
        }
    }
}
