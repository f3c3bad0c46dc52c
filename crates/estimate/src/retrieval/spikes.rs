//! Velocities that stand far off their neighbours: outliers of an estimator, which no law of noise holds.
//!
//! Check: single outliers go, wakes and noise stay.

use ndarray::Array2;

use crate::retrieval::{ScanMap, Turbulence};
use crate::vortex_fit::map_fit::data::{median, robust_scale};

/// Standard deviations off the median of its neighbours from which a velocity is an outlier: noise exceeds it once in a million.
const FAR: f64 = 5.0;
/// Deviation of a normal number less the median of eight others, over its own.
const WITH_MEDIAN: f64 = 1.09;

/// The map without its outliers, and their number. Velocities that repeat are put about their median before. Where no deviations
/// are stated, the distances from the neighbours tell them.
#[must_use]
pub fn without_spikes(map: &ScanMap, turbulence: Option<&Turbulence>) -> (ScanMap, usize) {
    let mut kept = map.unfolded();
    let off = Array2::from_shape_fn(kept.velocity_m_s.raw_dim(), |at| {
        off_neighbours(&kept.velocity_m_s, at)
    });
    let of_all = robust_scale(off.iter().copied().filter(|x| x.is_finite()));
    let air_m_s = match turbulence {
        Some(Turbulence::Exponential { deviation_m_s, .. }) => *deviation_m_s,
        Some(Turbulence::VonKarman(found)) => found.variance_m2_s2().sqrt(),
        // Not known yet: at least what neighbours differ by.
        Some(Turbulence::OfScan) => of_all / WITH_MEDIAN,
        None => 0.0,
    };
    let mut spikes = 0;
    for (at, off) in off.indexed_iter() {
        let deviation = kept
            .sigma_m_s
            .as_ref()
            .map_or(of_all, |sigma| WITH_MEDIAN * sigma[at].hypot(air_m_s));
        if off.abs() > FAR * deviation {
            kept.velocity_m_s[at] = f64::NAN;
            spikes += 1;
        }
    }
    (kept, spikes)
}

/// A velocity less the median of the eight about it; NaN without any.
fn off_neighbours(velocity: &Array2<f64>, (line, gate): (usize, usize)) -> f64 {
    let mut about = Vec::with_capacity(8);
    for i in line.saturating_sub(1)..=line + 1 {
        for j in gate.saturating_sub(1)..=gate + 1 {
            let value = velocity
                .get((i, j))
                .filter(|v| v.is_finite() && (i, j) != (line, gate));
            about.extend(value);
        }
    }
    velocity[[line, gate]] - median(&mut about)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vortex_fit::{Wake, WakeModel};

    #[test]
    fn single_outliers_go_and_a_wake_stays_nearly_whole() {
        let elevation_rad: Vec<f64> = (0..60).map(|i| 0.02 + 3e-3 * f64::from(i)).collect();
        let range_m: Vec<f64> = (0..36).map(|i| 330.0 + 4.0 * f64::from(i)).collect();
        let model = WakeModel::default();
        let wake = Wake::from_array(&[
            400.0, 400.0, 377.0, 48.0, 424.0, 48.0, 2.35, 2.35, 2.0, 0.0, 0.0,
        ]);
        let of =
            |(i, j): (usize, usize)| model.radial_velocity_m_s(&wake, range_m[j], elevation_rad[i]);
        let mut map = ScanMap {
            velocity_m_s: Array2::from_shape_fn((60, 36), of),
            sigma_m_s: Some(Array2::from_elem((60, 36), 0.5)),
            time_s: vec![f64::NAN; 60],
            elevation_rad: elevation_rad.clone(),
            range_m: range_m.clone(),
            fold_m_s: None,
        };
        let (_, of_wake) = without_spikes(&map, None);
        assert!(of_wake < 20, "{of_wake}");
        for k in 0..100 {
            map.velocity_m_s[[(7 * k) % 60, (11 * k) % 36]] = if k % 2 == 0 { 15.0 } else { -17.0 };
        }
        let (kept, spikes) = without_spikes(&map, None);
        assert!((100..135).contains(&spikes), "{spikes}");
        assert!(
            kept.velocity_m_s
                .iter()
                .all(|v| v.is_nan() || (-14.9..14.9).contains(v))
        );
        let (_, unstated) = without_spikes(
            &ScanMap {
                sigma_m_s: None,
                ..map
            },
            None,
        );
        assert!(unstated >= 100, "{unstated}");
    }
}
