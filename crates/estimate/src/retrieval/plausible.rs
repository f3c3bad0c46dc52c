//! What the vortices of an aircraft can be, and what a scan can resolve of them.
//!
//! A fit explains any velocities by some pair of vortices. Those of a weather radar, of a front or of a hill have "circulations" of
//! thousands of square metres per second; they are no wake.
//! Check: vortices beyond each limit; those of the largest aircraft are within all of them.

use crate::retrieval::{Flag, ScanMap, ScanResult, VortexResult};
use crate::vortex_fit::WakeModel;

/// Largest spacing of the vortices of an aircraft in service \[m\]: pi/4 of a span of 80 m.
const SPACING_M: f64 = 63.0;

/// Largest circulation \[m^2/s\]. Weight / (density x spacing x speed) of an A380 at 395 t and 75 m/s is 670, at 560 t in cruise 950.
const CIRCULATION_M2_S: f64 = 2000.0;
/// Largest height \[m\].
const HEIGHT_M: f64 = 20_000.0;
/// Fewest velocities within the largest spacing of a vortex.
const VELOCITIES: usize = 10;

/// Velocities of a map within the largest spacing of a vortex.
fn velocities_about(vortex: &VortexResult, map: &ScanMap, model: &WakeModel) -> usize {
    let mut count = 0;
    for ((line, gate), velocity) in map.velocity_m_s.indexed_iter() {
        if velocity.is_finite() {
            let (y_m, z_m) = model.position_m(map.range_m[gate], map.elevation_rad[line]);
            let distance_m =
                (y_m - vortex.lateral_position_m.value).hypot(z_m - vortex.height_m.value);
            count += usize::from(distance_m <= SPACING_M);
        }
    }
    count
}

/// Takes away vortices that are none of an aircraft or that the scan does not resolve, which makes the result one without a wake, flagged
/// [`Flag::Implausible`]; returns what is beyond its limit, in words.
pub fn without_implausible_vortices(
    result: &mut ScanResult,
    map: &ScanMap,
    model: &WakeModel,
) -> Option<String> {
    let mut vortices = result.vortices.iter();
    let reason = vortices.find_map(|vortex| violated_limit(vortex, map, model))?;
    result.vortices.clear();
    result.wake = None;
    // What is said of vortices is not said of none.
    result.flags.retain(|flag| flag.is_of_scan());
    result.set(Flag::NoWake, true);
    result.set(Flag::Implausible, true);
    Some(reason)
}

/// The first limit that a vortex violates, in words.
fn violated_limit(vortex: &VortexResult, map: &ScanMap, model: &WakeModel) -> Option<String> {
    let core_radius_m = vortex.core_radius_m.map_or(0.0, |core| core.value);
    for (quantity, unit, value, most, reason) in [
        (
            "circulation",
            "m^2/s",
            vortex.circulation_m2_s.value,
            CIRCULATION_M2_S,
            "twice that of the largest aircraft in cruise",
        ),
        (
            "core radius",
            "m",
            core_radius_m,
            0.5 * SPACING_M,
            "half the spacing of the vortices of the largest aircraft",
        ),
        (
            "height",
            "m",
            vortex.height_m.value,
            HEIGHT_M,
            "above the ceiling of all aircraft that carry passengers",
        ),
    ] {
        // also of NaN
        let is_within = value <= most;
        if !is_within {
            let value = value.round();
            return Some(format!(
                "the {quantity} of a vortex is {value} {unit}: at most {most} {unit} is allowed, {reason}"
            ));
        }
    }
    let velocities = velocities_about(vortex, map, model);
    (velocities < VELOCITIES).then(|| {
        format!(
            "the number of velocities within {SPACING_M} m of a vortex is {velocities}: at least {VELOCITIES} is allowed, \
             fewer do not resolve the vortices of the largest aircraft"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Measured;
    use crate::retrieval::Side;
    use crate::vortex_fit::PARAMETERS;
    use ndarray::Array2;

    fn map(gate_m: f64, line_rad: f64) -> ScanMap {
        let lines = 60;
        ScanMap {
            elevation_rad: (0..lines).map(|i| 0.02 + line_rad * f64::from(i)).collect(),
            time_s: vec![0.0; lines as usize],
            range_m: (0..100).map(|i| 100.0 + gate_m * f64::from(i)).collect(),
            velocity_m_s: Array2::zeros((lines as usize, 100)),
            sigma_m_s: None,
            fold_m_s: None,
        }
    }

    fn result(circulation: f64, core: f64, place_m: (f64, f64)) -> ScanResult {
        let known = |value: f64| Measured { value, std: 1.0 };
        let vortex = VortexResult {
            side: Side::Left,
            time_s: 0.0,
            circulation_m2_s: known(circulation),
            circulation_5_15_m2_s: known(circulation),
            lateral_position_m: known(place_m.0),
            height_m: known(place_m.1),
            core_radius_m: Some(known(core)),
        };
        ScanResult {
            vortices: vec![vortex],
            wake: None,
            reference_time_s: 0.0,
            covariance: Array2::zeros((PARAMETERS, PARAMETERS)),
            lateral_wind_m_s: known(0.0),
            wind_shear_per_s: known(0.0),
            chi2_per_dof: 1.0,
            cells_used: 1000,
            cells_rejected: 0,
            statistic: 100.0,
            threshold: 22.0,
            flags: vec![Flag::OneVortex, Flag::PoorFit],
            turbulence: None,
            model: WakeModel::default(),
            tops: vec![],
        }
    }

    #[test]
    fn vortices_of_aircraft_stay_and_those_beyond_a_limit_go_with_the_reason() {
        let model = WakeModel::default();
        let fine = map(10.0, 5e-3);
        let beside = (400.0, 50.0);
        for (circulation, core) in [(20.0, 0.5), (950.0, 6.0), (1990.0, 30.0)] {
            let mut large = result(circulation, core, beside);
            let before = large.clone();
            assert_eq!(
                without_implausible_vortices(&mut large, &fine, &model),
                None
            );
            assert_eq!(large, before);
        }
        // Over the lidar, and at half a kilometre in gates of 50 m.
        for (map, place_m) in [(&fine, (100.0, 40.0)), (&map(50.0, 5e-3), (500.0, 60.0))] {
            assert_eq!(
                without_implausible_vortices(&mut result(400.0, 3.0, place_m), map, &model),
                None
            );
        }
        for (mut found, map, part) in [
            (
                result(113_560.0, 3.0, beside),
                &fine,
                "circulation of a vortex is 113560 m^2/s: at most 2000 m^2/s",
            ),
            (
                result(400.0, 200.0, beside),
                &fine,
                "core radius of a vortex is 200 m",
            ),
            (
                result(400.0, 3.0, (3000.0, 25_000.0)),
                &fine,
                "height of a vortex is 25000 m",
            ),
            (
                result(900.0, 20.0, (9000.0, 900.0)),
                &map(250.0, 0.0175),
                "velocities within 63 m of a vortex is 0: at least 10",
            ),
        ] {
            let reason = without_implausible_vortices(&mut found, map, &model).unwrap();
            assert!(reason.contains(part), "{reason}");
            assert!(
                found.vortices.is_empty()
                    && found.has(Flag::Implausible)
                    && found.has(Flag::NoWake)
            );
            assert!(found.has(Flag::PoorFit) && !found.has(Flag::OneVortex));
        }
    }
}
