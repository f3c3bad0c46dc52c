//! Cn2 along the line of sight, constant or a profile over height, and its integrals.
//!
//! Check: the profile integrates exactly on straight pieces, however thin, and is constant beyond its ends.

use crate::Error;
use crate::error::{finite, not_negative};
use crate::quadrature::{GaussLegendre, lagrange};

/// Cn2 along the line of sight.
#[derive(Debug, Clone, PartialEq)]
pub enum Cn2Path {
    /// No turbulence: nothing is drawn and nothing is computed for it.
    None,
    /// The same everywhere (a horizontal path).
    Uniform {
        /// Cn2 \[m^(-2/3)\], above 0.
        cn2_m_m23: f64,
    },
    /// A profile over height along a slanted line; linear between the points, constant below the
    /// lowest and above the highest.
    Heights {
        /// Heights above ground \[m\], increasing strictly.
        height_m: Vec<f64>,
        /// Cn2 at these heights \[m^(-2/3)\].
        cn2_m_m23: Vec<f64>,
        /// Height of the telescope above ground \[m\].
        telescope_height_m: f64,
        /// Elevation of the line of sight \[rad\].
        elevation_rad: f64,
    },
}

impl Cn2Path {
    /// Cn2 \[m^(-2/3)\] at distance `range_m` from the telescope.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a range whose height is not finite.
    pub fn at(&self, range_m: f64) -> Result<f64, Error> {
        match self {
            Self::None => Ok(0.0),
            Self::Uniform { cn2_m_m23 } => Ok(*cn2_m_m23),
            Self::Heights {
                height_m,
                cn2_m_m23,
                telescope_height_m,
                elevation_rad,
            } => {
                let last = height_m.len() - 1;
                let height = telescope_height_m + range_m * elevation_rad.sin();
                let h = finite("height_m", height)?.clamp(height_m[0], height_m[last]);
                let i = height_m.partition_point(|&v| v <= h).clamp(1, last) - 1;
                let t = (h - height_m[i]) / (height_m[i + 1] - height_m[i]);
                Ok(cn2_m_m23[i] * (1.0 - t) + cn2_m_m23[i + 1] * t)
            }
        }
    }

    /// Mean of Cn2 \[m^(-2/3)\] from `start_m` to `end_m` along the path, exact: the profile is
    /// straight between its knots.
    ///
    /// # Errors
    /// As [`Cn2Path::at`].
    pub fn mean(&self, start_m: f64, end_m: f64) -> Result<f64, Error> {
        if !matches!(self, Self::Heights { .. }) || start_m == end_m {
            return self.at(start_m);
        }
        let edges = self.edges_m(start_m, end_m);
        let values = edges
            .iter()
            .map(|&z| self.at(z))
            .collect::<Result<Vec<_>, _>>()?;
        let pieces = edges.windows(2).zip(values.windows(2));
        let integral: f64 = pieces
            .map(|(z, cn2)| 0.5 * (cn2[0] + cn2[1]) * (z[1] - z[0]))
            .sum();
        Ok(integral / (end_m - start_m))
    }

    /// `start_m`, the ranges between at which the profile has a knot, `end_m`.
    fn edges_m(&self, start_m: f64, end_m: f64) -> Vec<f64> {
        let mut edges = vec![start_m];
        if let Self::Heights {
            height_m,
            telescope_height_m,
            elevation_rad,
            ..
        } = self
        {
            let climb = elevation_rad.sin();
            let ranges = height_m.iter().map(|h| (h - telescope_height_m) / climb);
            // A horizontal path gives infinity or NaN, which is between nothing.
            edges.extend(ranges.filter(|&z| z > start_m && z < end_m));
            edges.sort_by(f64::total_cmp);
        }
        edges.push(end_m);
        edges
    }

    /// Positions z \[m\] and weights \[m^(1/3)\] of a quadrature of Cn2(z) f(z) from 0 to
    /// `range_m`, for any f that is smooth along the path or a power of R - z.
    ///
    /// f is interpolated on panels that halve towards the end; its products with the straight
    /// pieces of the profile are then exact, so that the number of positions does not grow with the
    /// number of knots.
    ///
    /// # Errors
    /// As [`Cn2Path::at`].
    pub(crate) fn quadrature(&self, range_m: f64) -> Result<Vec<(f64, f64)>, Error> {
        const HALVED: [f64; 5] = [0.0, 0.5, 0.75, 0.875, 1.0];
        // Between 16 positions f is a polynomial of degree 15; times a straight line, 9 nodes
        // integrate it exactly.
        let positions = GaussLegendre::new(16);
        let exact = GaussLegendre::new(9);
        let mut out = Vec::new();
        match self {
            Self::None => {}
            Self::Uniform { cn2_m_m23 } => {
                for (z, w) in positions.mapped(0.0, range_m) {
                    out.push((z, cn2_m_m23 * w));
                }
            }
            Self::Heights { .. } => {
                for panel in HALVED.windows(2) {
                    let start = panel[0] * range_m;
                    let end = panel[1] * range_m;
                    let at: Vec<f64> = positions.mapped(start, end).map(|(z, _)| z).collect();
                    let mut weight = vec![0.0; at.len()];
                    for piece in self.edges_m(start, end).windows(2) {
                        for (z, dz) in exact.mapped(piece[0], piece[1]) {
                            let cn2_dz = self.at(z)? * dz;
                            for (j, w) in weight.iter_mut().enumerate() {
                                *w += cn2_dz * lagrange(&at, j, z);
                            }
                        }
                    }
                    out.extend(at.into_iter().zip(weight));
                }
            }
        }
        Ok(out)
    }

    /// Whether the path is free of turbulence.
    pub fn is_none(&self) -> bool {
        match self {
            Self::None => true,
            Self::Uniform { cn2_m_m23 } => *cn2_m_m23 == 0.0,
            Self::Heights { cn2_m_m23, .. } => cn2_m_m23.iter().all(|&c| c == 0.0),
        }
    }

    /// The path itself when every number is allowed.
    ///
    /// # Errors
    /// [`Error`] names the field.
    pub fn validated(self) -> Result<Self, Error> {
        match &self {
            Self::None => {}
            Self::Uniform { cn2_m_m23 } => {
                not_negative("cn2_m_m23", *cn2_m_m23)?;
            }
            Self::Heights {
                height_m,
                cn2_m_m23,
                telescope_height_m,
                elevation_rad,
            } => {
                let expected = height_m.len().max(2);
                if cn2_m_m23.len() != expected || height_m.len() < 2 {
                    return Err(Error::Length {
                        field: "cn2_m_m23",
                        found: cn2_m_m23.len(),
                        expected,
                    });
                }
                finite("height_m", height_m[0])?;
                for index in 1..height_m.len() {
                    if finite("height_m", height_m[index])? <= height_m[index - 1] {
                        return Err(Error::NotIncreasing {
                            field: "height_m",
                            index,
                            value: height_m[index],
                        });
                    }
                }
                for &value in cn2_m_m23 {
                    not_negative("cn2_m_m23", value)?;
                }
                finite("telescope_height_m", *telescope_height_m)?;
                finite("elevation_rad", *elevation_rad)?;
            }
        }
        Ok(self)
    }
}

/// Cn2 \[m^(-2/3)\] of the Hufnagel-Valley model at a height: `0.00594 (w/27)^2 (1e-5 z)^10
/// exp(-z/1000) + 2.7e-16 exp(-z/1500) + A exp(-z/100)` with the high wind `w` \[m/s\] and the
/// strength `A` at the ground; 21 and 1.7e-14 make it the model 5/7 (Andrews and Phillips 2005).
pub fn hufnagel_valley_m_m23(height_m: f64, high_wind_m_s: f64, ground_m_m23: f64) -> f64 {
    let wind = high_wind_m_s / 27.0;
    let high = 0.00594 * wind * wind * (1e-5 * height_m).powi(10) * (-height_m / 1000.0).exp();
    high + 2.7e-16 * (-height_m / 1500.0).exp() + ground_m_m23 * (-height_m / 100.0).exp()
}

/// Points of a law in each decade of height: the coherence radius is within 0.1 %.
const POINTS_PER_DECADE: u32 = 40;
/// Least height above 0 of a law, m, and its decades.
const LOWEST_M: f64 = 0.1;
const DECADES: u32 = 9;

impl Cn2Path {
    /// A law of Cn2 \[m^(-2/3)\] over height along a slanted line, in straight pieces between 40
    /// heights a decade.
    pub fn from_law(law: impl Fn(f64) -> f64, telescope_height_m: f64, elevation_rad: f64) -> Self {
        let mut height_m = vec![0.0];
        for i in 0..=DECADES * POINTS_PER_DECADE {
            let decades = f64::from(i) / f64::from(POINTS_PER_DECADE);
            height_m.push(LOWEST_M * 10f64.powf(decades));
        }
        let cn2_m_m23 = height_m.iter().map(|h| law(*h)).collect();
        Self::Heights {
            height_m,
            cn2_m_m23,
            telescope_height_m,
            elevation_rad,
        }
    }
}

/// Hufnagel-Valley 5/7 up to `top_m`, with knots dense near the ground.
#[cfg(test)]
pub(crate) fn hufnagel_valley(top_m: f64, telescope_height_m: f64, elevation_rad: f64) -> Cn2Path {
    let height_m: Vec<f64> = (0..=2000)
        .map(|i| top_m * (f64::from(i) / 2000.0).powi(2))
        .collect();
    let at = |h: &f64| hufnagel_valley_m_m23(*h, 21.0, 1.7e-14);
    let cn2_m_m23 = height_m.iter().map(at).collect();
    Cn2Path::Heights {
        height_m,
        cn2_m_m23,
        telescope_height_m,
        elevation_rad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slanted_path_sees_the_profile_at_its_height() {
        let path = Cn2Path::Heights {
            height_m: vec![0.0, 100.0, 1000.0],
            cn2_m_m23: vec![2e-13, 1e-13, 0.0],
            telescope_height_m: 10.0,
            elevation_rad: 30f64.to_radians(),
        }
        .validated()
        .unwrap();
        assert!((path.at(80.0).unwrap() / 1.5e-13 - 1.0).abs() < 1e-12);
        assert!((path.mean(0.0, 160.0).unwrap() / 1.5e-13 - 1.0).abs() < 0.1);
        assert!((path.mean(20.0, 100.0).unwrap() / 1.6e-13 - 1.0).abs() < 1e-12);
        assert_eq!(crate::error::refused(path.at(f64::INFINITY)), "height_m");
    }

    /// From 20 m above ground through a profile from 10 m to 40 m.
    fn from_within(elevation_deg: f64) -> Cn2Path {
        Cn2Path::Heights {
            height_m: vec![10.0, 20.0, 40.0],
            cn2_m_m23: vec![3e-13, 2e-13, 1e-13],
            telescope_height_m: 20.0,
            elevation_rad: elevation_deg.to_radians(),
        }
        .validated()
        .unwrap()
    }

    #[test]
    fn a_profile_is_constant_beyond_its_ends() {
        let down = from_within(-30.0);
        let up = from_within(30.0);
        for (path, range_m, expected) in [
            (&down, 20.0, 3e-13),
            (&down, 100.0, 3e-13),
            (&up, 40.0, 1e-13),
            (&up, 100.0, 1e-13),
        ] {
            let found = path.at(range_m).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-12, "{range_m}: {found}");
        }
        // To 10 m above ground 2.5e-13 over 20 m, then 3e-13 over 80 m.
        let exact = 20.0 * 2.5e-13 + 80.0 * 3e-13;
        let mean = down.mean(0.0, 100.0).unwrap();
        assert!((100.0 * mean / exact - 1.0).abs() < 1e-12, "{mean}");
        let sum: f64 = down.quadrature(100.0).unwrap().iter().map(|(_, w)| w).sum();
        assert!((sum / exact - 1.0).abs() < 1e-9, "{sum}");
    }

    #[test]
    fn mean_of_hufnagel_valley_is_its_integral() {
        let path = hufnagel_valley(20_000.0, 0.0, std::f64::consts::FRAC_PI_2);
        let mean = path.mean(0.0, 20_000.0).unwrap();
        // Integral from 0 to infinity: 10! x 1000^11 and two exponentials; what lies above 20 km is
        // below 1e-3 of it.
        let high = 0.00594 * (21f64 / 27.0).powi(2) * 1e-50 * 3_628_800.0 * 1e33;
        let exact = (high + 2.7e-16 * 1500.0 + 1.7e-14 * 100.0) / 20_000.0;
        assert!((mean / exact - 1.0).abs() < 1e-3, "{mean:e} {exact:e}");
        assert!((mean - 1.118e-16).abs() < 1e-19, "{mean:e}");
    }

    #[test]
    fn weighted_means_see_every_knot() {
        // A thin strong layer at the ground: nothing may step over it.
        let path = Cn2Path::Heights {
            height_m: vec![0.0, 20.0, 21.0, 3000.0],
            cn2_m_m23: vec![1e-13, 1e-13, 1e-16, 1e-17],
            telescope_height_m: 2.0,
            elevation_rad: 10f64.to_radians(),
        };
        let range_m = 3000.0;
        let slices = 200_000;
        let sum = |f: &dyn Fn(f64) -> f64| {
            let dz = range_m / f64::from(slices);
            (0..slices)
                .map(|i| (f64::from(i) + 0.5) * dz)
                .map(|z| path.at(z).unwrap() * f(z) * dz)
                .sum::<f64>()
        };
        assert!((path.mean(0.0, range_m).unwrap() * range_m / sum(&|_| 1.0) - 1.0).abs() < 1e-6);
        for power in [5.0 / 6.0, 5.0 / 3.0] {
            let f = |z: f64| (1.0 - z / range_m).powf(power);
            let found: f64 = path
                .quadrature(range_m)
                .unwrap()
                .iter()
                .map(|&(z, w)| w * f(z))
                .sum();
            assert!((found / sum(&f) - 1.0).abs() < 1e-6, "{power}");
        }
    }

    fn rows(text: &str) -> Vec<Vec<f64>> {
        let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
        lines
            .map(|line| {
                let cells = line.split(',').filter_map(|cell| cell.parse().ok());
                cells.collect()
            })
            .collect()
    }

    #[test]
    fn hufnagel_valley_and_its_path_integrals_are_those_of_the_tables() {
        let law = |height_m: f64| hufnagel_valley_m_m23(height_m, 21.0, 1.7e-14);
        for row in rows(include_str!("../../../../tests/reference/air/cn2.csv")) {
            assert!((law(row[0]) / row[1] - 1.0).abs() < 1e-8, "{row:?}");
        }
        let wavelength_m = 1.55e-6;
        let k = std::f64::consts::TAU / wavelength_m;
        for row in rows(include_str!(
            "../../../../tests/reference/air/cn2_paths.csv"
        )) {
            let [range_m, elevation_rad, height_m, integral, radius_m, rytov] = row[..] else {
                panic!("{row:?}")
            };
            let dense = hufnagel_valley(8000.0, height_m, elevation_rad);
            let sampled = Cn2Path::from_law(law, height_m, elevation_rad);
            for (path, band) in [(dense, 1e-4), (sampled, 2e-3)] {
                let near = |found: f64, expected: f64| {
                    assert!(
                        (found / expected - 1.0).abs() < band,
                        "{found:e} {expected:e}"
                    );
                };
                near(path.mean(0.0, range_m).unwrap() * range_m, integral);
                let radius = crate::air::coherence_radius_m(&path, wavelength_m, range_m);
                near(radius.unwrap(), radius_m);
                // Of a spherical wave, both ends weigh nothing.
                let mut variance = 0.0;
                for piece in path.edges_m(0.0, range_m).windows(2) {
                    for (z, dz) in GaussLegendre::new(9).mapped(piece[0], piece[1]) {
                        let weight = (z * (range_m - z) / range_m).powf(5.0 / 6.0);
                        variance += path.at(z).unwrap() * weight * dz;
                    }
                }
                near(2.25 * k.powf(7.0 / 6.0) * variance, rytov);
            }
        }
    }
}
