//! Logarithmic part of the wind over height, and what is known of it before a fit.
//!
//! Mean wind near the ground is logarithmic in neutral air, u_*/kappa ln(z/z_0), and has a linear part in stable air. Fitted with a straight line
//! alone, its curvature looks like noise that all velocities have in common, which hides wakes. The roughness length z_0 is not fitted: over the
//! heights of a sector it shifts the profile by a constant. Calm air has no such part, while low vortices and what they do at the ground look
//! like one: before a fit its standard deviation is a part of the wind.
//! Check: the straight line by least squares; a wake in logarithmic wind; the stored wake that the ground has driven apart.

use crate::vortex_fit::map_fit::data::median;
use crate::vortex_fit::{Parameter, VelocityMap};

/// Height \[m\] that is added to each, so that the logarithm is finite at the ground; scans have hardly a gate below it.
const LOWEST_M: f64 = 1.0;
/// Straight line next to ln(1 + z / 1 m) over the lowest 100 m, by least squares: at the ground, and per metre.
const LINE: f64 = 2.271_109_873_67;
const LINE_PER_M: f64 = 0.027_803_236_967;
/// Standard deviation of the logarithmic part before a fit, over the wind: 1 / ln(z / z_0) is 0.09 to 0.26 at 50 m for lengths of 1 mm to 1 m.
const STD_OVER_WIND: f64 = 0.2;
/// Its least value \[m/s\].
const LEAST_STD_M_S: f64 = 0.01;
/// Lines with a smaller cosine of the elevation do not tell the lateral wind.
const LEAST_COSINE: f64 = 0.5;

/// ln(1 + z / 1 m) of a height z \[m\] without its straight line over the lowest 100 m; below the ground as at the ground.
pub(crate) fn log_of_height(height_m: f64) -> f64 {
    (1.0 + height_m.max(0.0) / LOWEST_M).ln() - LINE - LINE_PER_M * height_m
}

/// Standard deviation of the logarithmic part before a fit \[m/s\], from the median wind of a map.
pub(crate) fn log_wind_std_m_s(map: &VelocityMap<'_>) -> f64 {
    let mut winds_m_s = Vec::new();
    for (line, elevation_rad) in map.velocity_m_s.rows().into_iter().zip(map.elevation_rad) {
        let cosine = elevation_rad.cos();
        if cosine.abs() >= LEAST_COSINE {
            let known = line.iter().filter(|velocity| velocity.is_finite());
            winds_m_s.extend(known.map(|velocity| velocity / cosine));
        }
    }
    // also the least value for NaN, where no line tells the wind
    (STD_OVER_WIND * median(&mut winds_m_s).abs()).max(LEAST_STD_M_S)
}

/// Distance of a logarithmic part from what is known in deviations \[m/s\], and its derivatives by all free numbers; nothing where it is not
/// free.
pub(crate) fn log_wind_term(
    (log_wind_m_s, std_m_s): (f64, f64),
    groups: &[Vec<usize>],
) -> Option<(f64, Vec<f64>)> {
    let place = Parameter::LogWind as usize;
    let number = groups.iter().position(|group| group.contains(&place))?;
    let mut slope = vec![0.0; groups.len()];
    slope[number] = std_m_s.recip();
    Some((log_wind_m_s / std_m_s, slope))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vortex_fit::{FreeParameters, WindFit};

    /// Means over the lowest 100 m of what no straight line explains, and of that times the height, vanish.
    #[test]
    fn the_logarithm_has_no_straight_line_over_the_lowest_hundred_metres() {
        let steps = 100_000;
        let mut mean = 0.0;
        let mut moment_m = 0.0;
        let mut square = 0.0;
        for i in 0..steps {
            let height_m = 100.0 * (f64::from(i) + 0.5) / f64::from(steps);
            let value = log_of_height(height_m) / f64::from(steps);
            mean += value;
            moment_m += value * height_m;
            square += value * value * f64::from(steps);
        }
        assert!(mean.abs() < 1e-5, "{mean}");
        assert!(moment_m.abs() < 1e-3, "{moment_m}");
        assert!(square > 0.05);
        let step = log_of_height(40.0) - log_of_height(20.0);
        assert!((step - (41.0_f64 / 21.0).ln() + 20.0 * LINE_PER_M).abs() < 1e-12);
    }

    #[test]
    fn only_a_free_logarithm_has_a_term() {
        let mut free = FreeParameters::default();
        assert!(log_wind_term((0.5, 0.8), &free.groups()).is_none());
        free.wind = WindFit::LogLinear;
        let groups = free.groups();
        let (away, slope) = log_wind_term((0.5, 0.8), &groups).unwrap();
        assert_eq!(away, 0.5 / 0.8);
        let sum: f64 = slope.iter().sum();
        assert_eq!(sum, slope[groups.len() - 1]);
        assert_eq!(sum, 1.0 / 0.8);
    }

    #[test]
    fn calm_air_has_no_logarithmic_part_and_wind_one_in_proportion() {
        let std_m_s = |wind_m_s: f64| {
            // the last line is too steep, and one velocity is missing
            let elevation_rad = [0.0, 0.5, 1.5];
            let mut velocity_m_s = ndarray::Array2::from_shape_fn((3, 4), |(line, _)| {
                wind_m_s * f64::cos(elevation_rad[line])
            });
            velocity_m_s.row_mut(2).fill(30.0);
            velocity_m_s[[0, 1]] = f64::NAN;
            log_wind_std_m_s(&VelocityMap {
                elevation_rad: &elevation_rad,
                range_m: &[100.0, 110.0, 120.0, 130.0],
                velocity_m_s: velocity_m_s.view(),
                standard_deviation_m_s: None,
            })
        };
        assert_eq!(std_m_s(0.0), LEAST_STD_M_S);
        assert!((std_m_s(-5.0) - 5.0 * STD_OVER_WIND).abs() < 1e-12);
        assert_eq!(std_m_s(f64::NAN), LEAST_STD_M_S);
    }
}
