//! What is known of the logarithmic part of the wind before a fit.
//!
//! Calm air has no such part, while low vortices and what they do at the ground look like one: its standard deviation is a part of the wind.
//! Check: calm air; the stored wake that the ground has driven apart.

use crate::vortex_fit::map_fit::data::median;
use crate::vortex_fit::{Parameter, VelocityMap};

/// Standard deviation of the logarithmic part before a fit, over the wind: 1 / ln(z / z_0) is 0.09 to 0.26 at 50 m for lengths of 1 mm to 1 m.
const STD_OVER_WIND: f64 = 0.2;
/// Its least value \[m/s\].
const LEAST_STD_M_S: f64 = 0.01;
/// Lines with a smaller cosine of the elevation do not tell the lateral wind.
const LEAST_COSINE: f64 = 0.5;

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
