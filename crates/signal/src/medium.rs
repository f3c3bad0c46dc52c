//! Backscatter and extinction of the air by range, and the return (9) that follows.
//!
//! Check: uniform air gives the closed form; extinction integrates exactly, so a table of more
//! points with the same values changes nothing; a cloud attenuates the return from behind it.

use crate::error::{check_each, check_positive};
use crate::table::{check_ranges, check_values, locate, value};
use crate::{Error, LineOfSight};
use std::sync::Arc;

/// Sine of the elevation of a line that is as good as level: heights change by less than a table
/// resolves.
const LEVEL: f64 = 1e-7;

/// Backscatter and extinction along a line of sight, straight lines between the points of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    table: Arc<Table>,
    path: Path,
}

/// The points of a medium.
#[derive(Debug, PartialEq)]
struct Table {
    range_m: Vec<f64>,
    backscatter_per_m_sr: Vec<f64>,
    extinction_per_m: Vec<f64>,
    /// Optical depth from the lidar to each range of the table.
    depth: Vec<f64>,
}

/// How a line of sight goes through the table.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Path {
    /// The air is the same everywhere.
    Uniform,
    /// The table is over range.
    Along,
    /// The table is over height: height of the lidar, m, and sine of the elevation.
    Slanted { height_m: f64, climb: f64 },
}

impl Medium {
    /// Air that changes with range. From the lidar to the first range of the table it is as at the
    /// first range; beyond the last it is unknown.
    ///
    /// # Errors
    /// [`Error::Empty`] without ranges; [`Error::ElementOutOfRange`] for ranges that are negative
    /// or do not increase, or a value that is negative or not finite; [`Error::LengthMismatch`]
    /// unless there is one value per range.
    pub fn new(
        range_m: Vec<f64>,
        backscatter_per_m_sr: Vec<f64>,
        extinction_per_m: Vec<f64>,
    ) -> Result<Self, Error> {
        check_ranges(&range_m)?;
        check_each("range_m", &range_m, "not negative", |r| r >= 0.0)?;
        check_values("backscatter_per_m_sr", &backscatter_per_m_sr, range_m.len())?;
        check_values("extinction_per_m", &extinction_per_m, range_m.len())?;
        let mut depth = vec![range_m[0] * extinction_per_m[0]];
        for (r, alpha) in range_m.windows(2).zip(extinction_per_m.windows(2)) {
            depth.push(depth[depth.len() - 1] + 0.5 * (alpha[0] + alpha[1]) * (r[1] - r[0]));
        }
        Ok(Self {
            table: Arc::new(Table {
                range_m,
                backscatter_per_m_sr,
                extinction_per_m,
                depth,
            }),
            path: Path::Along,
        })
    }

    /// The same air everywhere.
    ///
    /// # Errors
    /// As [`Medium::new`].
    pub fn uniform(backscatter_per_m_sr: f64, extinction_per_m: f64) -> Result<Self, Error> {
        let medium = Self::new(
            vec![0.0],
            vec![backscatter_per_m_sr],
            vec![extinction_per_m],
        )?;
        Ok(Self {
            path: Path::Uniform,
            ..medium
        })
    }

    /// The air of the chapter's Table 2: 1e-7 per m and sr, an extinction of 7e-5 per m.
    pub fn table2() -> Self {
        Self {
            table: Arc::new(Table {
                range_m: vec![0.0],
                backscatter_per_m_sr: vec![1e-7],
                extinction_per_m: vec![7e-5],
                depth: vec![0.0],
            }),
            path: Path::Uniform,
        }
    }

    /// This air with its table over height, along a line of sight from `height_m` with an
    /// elevation; the points are shared.
    pub fn along(&self, height_m: f64, elevation_rad: f64) -> Self {
        let climb = elevation_rad.sin();
        Self {
            table: Arc::clone(&self.table),
            path: Path::Slanted { height_m, climb },
        }
    }

    /// Backscatter `beta` \[1/(m sr)\] and one-way optical depth at a range.
    fn at(&self, range_m: f64) -> Result<(f64, f64), Error> {
        check_positive("range_m", range_m)?;
        match self.path {
            Path::Uniform => Ok((
                self.table.backscatter_per_m_sr[0],
                range_m * self.table.extinction_per_m[0],
            )),
            Path::Along => {
                let (backscatter_per_m_sr, _, depth) = self.table.at(range_m)?;
                Ok((backscatter_per_m_sr, depth))
            }
            Path::Slanted { height_m, climb } => {
                let (_, first_per_m, first_depth) = self.table.at(height_m)?;
                let (backscatter_per_m_sr, last_per_m, last_depth) =
                    self.table.at(height_m + climb * range_m)?;
                let depth = if climb.abs() < LEVEL {
                    0.5 * (first_per_m + last_per_m) * range_m
                } else {
                    (last_depth - first_depth) / climb
                };
                Ok((backscatter_per_m_sr, depth))
            }
        }
    }

    /// Backscatter `beta` \[1/(m sr)\] at a range.
    ///
    /// # Errors
    /// As [`Medium::transmission`].
    pub fn backscatter_per_m_sr(&self, range_m: f64) -> Result<f64, Error> {
        Ok(self.at(range_m)?.0)
    }

    /// One-way transmission `K = exp(-integral of alpha)` from the lidar to a range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a range that is not positive or lies beyond the table.
    pub fn transmission(&self, range_m: f64) -> Result<f64, Error> {
        Ok((-self.at(range_m)?.1).exp())
    }

    /// Return per metre of range `K^2 beta A_R/R^2` \[1/m\], (9) without the heterodyne efficiency,
    /// to an aperture of `aperture_area_m2`.
    ///
    /// # Errors
    /// As [`Medium::transmission`]; [`Error::OutOfRange`] for an aperture that is not positive.
    pub fn return_per_m(&self, range_m: f64, aperture_area_m2: f64) -> Result<f64, Error> {
        check_positive("aperture_area_m2", aperture_area_m2)?;
        let (backscatter_per_m_sr, depth) = self.at(range_m)?;
        Ok(backscatter_per_m_sr * (-2.0 * depth).exp() * aperture_area_m2 / (range_m * range_m))
    }

    /// Sets the weights of a line's layers to [`Medium::return_per_m`]; each [`Shot`](crate::Shot)
    /// brings its efficiency. Layers without scatterers (NaN) get their weight too.
    ///
    /// # Errors
    /// As [`Medium::return_per_m`].
    pub fn weigh(&self, line: &mut LineOfSight, aperture_area_m2: f64) -> Result<(), Error> {
        let mut weight_per_m = Vec::with_capacity(line.layers());
        for layer in 0..line.layers() {
            weight_per_m.push(self.return_per_m(line.range_m(layer), aperture_area_m2)?);
        }
        line.weight_per_m = weight_per_m;
        Ok(())
    }
}

impl Table {
    /// Backscatter, extinction and optical depth at a range of the table.
    fn at(&self, range_m: f64) -> Result<(f64, f64, f64), Error> {
        if range_m <= self.range_m[0] {
            let extinction_per_m = self.extinction_per_m[0];
            let depth = range_m * extinction_per_m;
            return Ok((self.backscatter_per_m_sr[0], extinction_per_m, depth));
        }
        let Some((index, fraction)) = locate(&self.range_m, range_m) else {
            return Err(Error::OutOfRange {
                field: "range_m",
                value: range_m,
                allowed: "within the table of the medium",
            });
        };
        let start = self.extinction_per_m[index];
        let end = value(&self.extinction_per_m, index, fraction);
        let depth = self.depth[index] + 0.5 * (start + end) * (range_m - self.range_m[index]);
        let backscatter_per_m_sr = value(&self.backscatter_per_m_sr, index, fraction);
        Ok((backscatter_per_m_sr, end, depth))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn uniform_air_returns_the_closed_form() {
        let expected = 1e-7 * (-2.0 * 7e-5 * 400.0_f64).exp() * 7.85e-3 / (400.0 * 400.0);
        let uniform = Medium::uniform(1e-7, 7e-5).unwrap();
        let table = Medium::new(vec![50.0, 120.0, 900.0], vec![1e-7; 3], vec![7e-5; 3]).unwrap();
        for medium in [uniform, table] {
            assert_relative_eq!(
                medium.return_per_m(400.0, 7.85e-3).unwrap(),
                expected,
                max_relative = 1e-13
            );
        }
    }

    #[test]
    fn extinction_that_rises_linearly_integrates_exactly() {
        let medium = Medium::new(vec![0.0, 1000.0], vec![1e-7, 3e-7], vec![0.0, 2e-3]).unwrap();
        // alpha = 2e-6 R, so the depth is 1e-6 R^2.
        for range_m in [1.0, 250.0, 1000.0] {
            let transmission = medium.transmission(range_m).unwrap();
            assert_relative_eq!(
                transmission,
                (-1e-6 * range_m * range_m).exp(),
                max_relative = 1e-13
            );
        }
        let ratio =
            medium.return_per_m(500.0, 1.0).unwrap() / medium.return_per_m(250.0, 1.0).unwrap();
        let expected =
            2e-7 / 1.5e-7 / 4.0 * (-2.0 * 1e-6 * (500.0_f64.powi(2) - 250.0_f64.powi(2))).exp();
        assert_relative_eq!(ratio, expected, max_relative = 1e-12);
    }

    #[test]
    fn a_cloud_is_bright_and_darkens_what_lies_behind_it() {
        let ranges = vec![0.0, 400.0, 401.0, 420.0, 421.0, 800.0];
        let cloudy = Medium::new(
            ranges,
            vec![1e-7, 1e-7, 1e-5, 1e-5, 1e-7, 1e-7],
            vec![1e-4, 1e-4, 2e-2, 2e-2, 1e-4, 1e-4],
        )
        .unwrap();
        let clear = Medium::uniform(1e-7, 1e-4).unwrap();
        let ratio = |range_m| {
            cloudy.return_per_m(range_m, 1.0).unwrap() / clear.return_per_m(range_m, 1.0).unwrap()
        };
        assert_relative_eq!(ratio(300.0), 1.0, max_relative = 1e-13);
        assert!(ratio(401.0) > 90.0);
        // 20 m (half of each edge counts) with 0.0199 more per metre, there and back.
        assert_relative_eq!(
            ratio(600.0),
            (-2.0 * 0.0199 * 20.0_f64).exp(),
            max_relative = 1e-12
        );
    }

    #[test]
    fn weights_of_a_line_are_the_return_of_its_layers() {
        let medium = Medium::uniform(1e-7, 7e-5).unwrap();
        let mut line = LineOfSight {
            first_range_m: 100.0,
            layer_thickness_m: 10.0,
            radial_velocity_m_s: vec![0.0; 3],
            weight_per_m: vec![],
        };
        medium.weigh(&mut line, 8e-3).unwrap();
        let expected = medium.return_per_m(120.0, 8e-3).unwrap();
        assert_relative_eq!(line.weight_per_m[2], expected, max_relative = 1e-15);
        line.first_range_m = -5.0;
        assert!(matches!(
            medium.weigh(&mut line, 8e-3),
            Err(Error::OutOfRange {
                field: "range_m",
                ..
            })
        ));
    }

    #[test]
    fn tables_that_are_none_and_ranges_beyond_them_are_refused() {
        let make =
            |r: &[f64], b: &[f64], a: &[f64]| Medium::new(r.to_vec(), b.to_vec(), a.to_vec());
        assert!(matches!(make(&[], &[], &[]), Err(Error::Empty { .. })));
        assert!(matches!(
            make(&[1.0, 1.0], &[1.0; 2], &[1.0; 2]),
            Err(Error::ElementOutOfRange { index: 1, .. })
        ));
        assert!(matches!(
            make(&[-1.0], &[1.0], &[1.0]),
            Err(Error::ElementOutOfRange { index: 0, .. })
        ));
        assert!(matches!(
            make(&[1.0], &[1.0, 2.0], &[1.0]),
            Err(Error::LengthMismatch { .. })
        ));
        let negative = make(&[1.0, 2.0], &[1.0, -1.0], &[1.0; 2]);
        assert!(matches!(
            negative,
            Err(Error::ElementOutOfRange {
                field: "backscatter_per_m_sr",
                index: 1,
                ..
            })
        ));
        let table = make(&[1.0, 2.0], &[1.0; 2], &[1.0; 2]).unwrap();
        assert!(matches!(
            table.return_per_m(2.1, 1.0),
            Err(Error::OutOfRange {
                field: "range_m",
                ..
            })
        ));
        assert!(matches!(
            table.return_per_m(0.0, 1.0),
            Err(Error::OutOfRange {
                field: "range_m",
                ..
            })
        ));
        assert!(matches!(
            table.return_per_m(1.5, 0.0),
            Err(Error::OutOfRange {
                field: "aperture_area_m2",
                ..
            })
        ));
    }
}
