//! Lines of sight with their velocities as the grid of a map: sorted by elevation, equal ones averaged, checked.
//!
//! Check: lines of one elevation; what makes no map.

use super::planes::FEWEST_LINES;
use super::rays::Ray;
use crate::interpolation::interpolate;
use ndarray::Array2;
use wakescope_estimate::retrieval::ScanMap;

/// Farthest range of the last gate, m: that of a scene; and the nearest.
const FARTHEST_M: f64 = 1e6;
const NEAREST_M: f64 = 10.0;
/// Least width of a scan at its farthest gate, m: none of a vortex fits into less.
const NARROWEST_M: f64 = 5.0;
/// Fewest gates and velocities of a map.
const FEWEST_GATES: usize = 3;
const FEWEST_VELOCITIES: usize = 30;

/// Largest fraction of the lines of a scan that get times from their neighbours.
const MOST_WITHOUT_TIME: f64 = 0.1;

/// Fewest scans whose scatter gives a standard deviation.
const ENOUGH_SCANS: f64 = 20.0;

/// Standard deviation of a velocity that is the mean of `count` scans, whose scatter gave the deviation of one; unknown of few.
pub(super) fn of_mean(sigma_m_s: f64, count: Option<f64>) -> f64 {
    match count {
        None => sigma_m_s,
        Some(count) if count >= ENOUGH_SCANS => sigma_m_s / count.sqrt(),
        Some(_) => f64::NAN,
    }
}

/// Scans of which the velocities of a map are means, from those of each cell; 1 where none are counted.
pub(super) fn mean_count(counts: impl Iterator<Item = f64>) -> f64 {
    let mut sum = 0.0;
    let mut cells = 0.0;
    for count in counts {
        if count > 0.0 {
            sum += count;
            cells += 1.0;
        }
    }
    if cells > 0.0 { sum / cells } else { 1.0 }
}

/// The map of rays, all with the gates of `range_m`; `what` names the scan in messages.
pub(super) fn scan_map(
    mut rays: Vec<Ray>,
    mut range_m: Vec<f64>,
    fold_m_s: Option<f64>,
    what: &str,
) -> Result<ScanMap, String> {
    drop_empty_gates(&mut rays, &mut range_m);
    check_ranges(&range_m).map_err(|reason| format!("{what}: {reason}"))?;
    let gates = range_m.len();
    rays.sort_by(|a, b| a.elevation_rad.total_cmp(&b.elevation_rad));
    let lines: Vec<&[Ray]> = rays
        .chunk_by(|a, b| a.elevation_rad == b.elevation_rad)
        .collect();
    if lines.len() < FEWEST_LINES || gates < FEWEST_GATES {
        return Err(format!(
            "{what}: it has {} different elevations and {gates} ranges; a scan in elevation (RHI) of at least {FEWEST_LINES} lines and \
             {FEWEST_GATES} gates is needed",
            lines.len()
        ));
    }
    let mut velocity_m_s = Array2::from_shape_fn((lines.len(), gates), |(line, gate)| {
        let velocities = lines[line].iter().map(|ray| ray.velocity_m_s[gate]);
        finite_mean(velocities.collect())
    });
    let sigma_m_s = line_sigmas_m_s(&lines, &mut velocity_m_s);
    check_velocities(&velocity_m_s).map_err(|reason| format!("{what}: {reason}"))?;
    check_width(&lines, &range_m).map_err(|reason| format!("{what}: {reason}"))?;
    let mut elevation_rad = Vec::with_capacity(lines.len());
    let mut time_s = Vec::with_capacity(lines.len());
    for line in &lines {
        elevation_rad.push(line[0].elevation_rad);
        time_s.push(finite_mean(line.iter().map(|ray| ray.time_s).collect()));
    }
    fill_times(&elevation_rad, &mut time_s);
    Ok(ScanMap {
        elevation_rad,
        time_s,
        range_m,
        velocity_m_s,
        sigma_m_s,
        fold_m_s: fold_m_s.filter(|fold| *fold > 0.0 && fold.is_finite()),
    })
}

/// Gives the few lines without a time one between those of their neighbours; where many have none, no line has.
fn fill_times(elevation_rad: &[f64], time_s: &mut [f64]) {
    let mut elevations_rad = Vec::with_capacity(time_s.len());
    let mut times_s = Vec::with_capacity(time_s.len());
    for (elevation_rad, time_s) in elevation_rad.iter().zip(&*time_s) {
        if time_s.is_finite() {
            elevations_rad.push(*elevation_rad);
            times_s.push(*time_s);
        }
    }
    let missing = time_s.len() - times_s.len();
    if missing as f64 > MOST_WITHOUT_TIME * time_s.len() as f64 {
        time_s.fill(f64::NAN);
        return;
    }
    for (elevation_rad, time_s) in elevation_rad.iter().zip(time_s) {
        if time_s.is_nan() {
            *time_s = interpolate(&elevations_rad, &times_s, *elevation_rad);
        }
    }
}

/// Removes gates of unknown range, those at the lidar, and those before it without velocities.
fn drop_empty_gates(rays: &mut [Ray], range_m: &mut Vec<f64>) {
    let mut kept = Vec::with_capacity(range_m.len());
    for (gate, range_m) in range_m.iter().enumerate() {
        let has_velocities = || rays.iter().any(|ray| ray.velocity_m_s[gate].is_finite());
        if *range_m > 0.0 || (*range_m < 0.0 && has_velocities()) {
            kept.push(gate);
        }
    }
    if kept.len() == range_m.len() {
        return;
    }
    *range_m = kept.iter().map(|gate| range_m[*gate]).collect();
    for ray in rays {
        for values in [&mut ray.velocity_m_s, &mut ray.sigma_m_s] {
            if !values.is_empty() {
                *values = kept.iter().map(|gate| values[*gate]).collect();
            }
        }
    }
}

/// Refuses ranges that do not increase or lie beyond what a scene allows.
fn check_ranges(range_m: &[f64]) -> Result<(), String> {
    for pair in range_m.windows(2) {
        let one_m = pair[0];
        let next_m = pair[1];
        if next_m.is_nan() || next_m <= one_m {
            return Err(format!(
                "range must increase from gate to gate, and {one_m} m is followed by {next_m} m"
            ));
        }
    }
    if !range_m
        .first()
        .is_some_and(|first| *first >= 0.0 && first.is_finite())
    {
        return Err("range must be at least 0 m at the first gate".into());
    }
    check_extent(range_m.last().copied().unwrap_or(f64::NAN))
}

/// Refuses ranges that end too near or too far, whose unit is another one.
pub(super) fn check_extent(farthest_m: f64) -> Result<(), String> {
    if farthest_m > FARTHEST_M {
        return Err(format!(
            "range reaches {farthest_m} m: at most {FARTHEST_M} m are read"
        ));
    }
    match farthest_m < NEAREST_M {
        true => Err(format!(
            "range reaches {farthest_m} m: at least {NEAREST_M} m are needed; ranges in km need that unit"
        )),
        false => Ok(()),
    }
}

/// Refuses elevations that span too little for a vortex, such as radians that are said to be degrees.
fn check_width(lines: &[&[Ray]], range_m: &[f64]) -> Result<(), String> {
    let lowest_rad = lines[0][0].elevation_rad;
    let highest_rad = lines[lines.len() - 1][0].elevation_rad;
    let width_m = (highest_rad - lowest_rad) * range_m[range_m.len() - 1];
    match width_m < NARROWEST_M {
        true => Err(format!(
            "its elevations from {:.4} to {:.4} degrees span {width_m:.2} m at the farthest gate: at least {NARROWEST_M} m are needed; \
             elevations in radians need that unit",
            lowest_rad.to_degrees(),
            highest_rad.to_degrees()
        )),
        false => Ok(()),
    }
}

/// Refuses too few velocities.
fn check_velocities(velocity_m_s: &Array2<f64>) -> Result<(), String> {
    let values = velocity_m_s
        .iter()
        .filter(|value| value.is_finite())
        .count();
    if values < FEWEST_VELOCITIES {
        return Err(match values {
            0 => "all of its velocities are missing".into(),
            _ => format!(
                "it has {values} velocities that are not missing; at least {FEWEST_VELOCITIES} are needed"
            ),
        });
    }
    Ok(())
}

/// Standard deviations of the velocities of lines, if rays have them; velocities of unknown standard deviation become missing.
fn line_sigmas_m_s(lines: &[&[Ray]], velocity_m_s: &mut Array2<f64>) -> Option<Array2<f64>> {
    let mut rays = lines.iter().copied().flatten();
    if rays.any(|ray| ray.sigma_m_s.is_empty()) {
        return None;
    }
    let mut sigma_m_s = Array2::from_shape_fn(velocity_m_s.dim(), |(line, gate)| {
        let rays = lines[line];
        let finite = rays.iter().filter(|ray| ray.velocity_m_s[gate].is_finite());
        let count = finite.count() as f64;
        finite_mean(rays.iter().map(|ray| ray.sigma_m_s[gate]).collect()) / count.sqrt()
    });
    if !sigma_m_s.iter().copied().any(is_known_sigma) {
        return None;
    }
    velocity_m_s.zip_mut_with(&sigma_m_s, |velocity, sigma| {
        if !is_known_sigma(*sigma) {
            *velocity = f64::NAN;
        }
    });
    sigma_m_s.mapv_inplace(|sigma| if is_known_sigma(sigma) { sigma } else { 1.0 });
    Some(sigma_m_s)
}

fn is_known_sigma(sigma_m_s: f64) -> bool {
    sigma_m_s.is_finite() && sigma_m_s > 0.0
}

/// Mean of the finite values; NaN if there are none.
fn finite_mean(mut values: Vec<f64>) -> f64 {
    values.retain(|value| value.is_finite());
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays(elevations: impl IntoIterator<Item = f64>) -> Vec<Ray> {
        let ray = |(i, elevation_rad): (usize, f64)| Ray {
            elevation_rad,
            azimuth_rad: 1.0,
            time_s: i as f64,
            velocity_m_s: vec![i as f64; 12],
            ..Ray::default()
        };
        elevations.into_iter().enumerate().map(ray).collect()
    }

    fn range_m() -> Vec<f64> {
        (1..=12).map(|i| 10.0 * f64::from(i)).collect()
    }

    #[test]
    fn lines_are_sorted_and_equal_ones_averaged() {
        let map = scan_map(rays([0.3, 0.2, 0.2, 0.1]), range_m(), Some(20.0), "it").unwrap();
        assert_eq!(map.elevation_rad, [0.1, 0.2, 0.3]);
        assert_eq!(
            (map.time_s.clone(), map.velocity_m_s[[1, 5]]),
            (vec![3.0, 1.5, 0.0], 1.5)
        );
        assert_eq!((map.fold_m_s, map.sigma_m_s.clone()), (Some(20.0), None));
        assert!(map.validate().is_ok());
    }

    #[test]
    fn few_lines_without_a_time_get_one_from_their_neighbours() {
        let mut lines = rays((0..20).map(|i| 0.1 + 0.01 * f64::from(i)));
        lines[7].time_s = f64::NAN;
        lines[8].time_s = f64::NAN;
        let map = scan_map(lines.clone(), range_m(), None, "it").unwrap();
        for (line, time_s) in map.time_s.iter().enumerate() {
            assert!((time_s - line as f64).abs() < 1e-9, "{line}: {time_s}");
        }
        lines[12].time_s = f64::NAN;
        let map = scan_map(lines, range_m(), None, "it").unwrap();
        assert!(map.time_s.iter().all(|time_s| time_s.is_nan()));
    }

    #[test]
    fn gates_that_see_no_air_are_left_out() {
        let mut ranges = range_m();
        ranges[0] = -5.0;
        ranges[1] = 0.0;
        ranges[11] = f64::NAN;
        let mut lines = rays([0.1, 0.2, 0.3, 0.4]);
        for ray in &mut lines {
            ray.sigma_m_s = vec![0.5; 12];
            ray.velocity_m_s = (0..12).map(f64::from).collect();
        }
        let refused = scan_map(lines.clone(), ranges.clone(), None, "it").unwrap_err();
        assert!(refused.contains("range must be at least 0 m"), "{refused}");
        lines
            .iter_mut()
            .for_each(|ray| ray.velocity_m_s[0] = f64::NAN);
        let map = scan_map(lines, ranges.clone(), None, "it").unwrap();
        assert_eq!(map.range_m, ranges[2..11]);
        assert_eq!(map.velocity_m_s.row(0).to_vec()[..2], [2.0, 3.0]);
        assert_eq!(map.sigma_m_s.unwrap().dim(), (4, 9));
    }

    #[test]
    fn what_is_no_scan_is_refused_by_name() {
        let refused = |rays: Vec<Ray>, range_m: Vec<f64>| {
            scan_map(rays, range_m, None, "sweep 3").unwrap_err()
        };
        assert!(
            refused(rays([0.1; 9]), range_m()).contains("sweep 3: it has 1 different elevations")
        );
        let mut falling = range_m();
        falling.swap(3, 4);
        assert!(refused(rays([0.1, 0.2, 0.3]), falling).contains("range must increase"));
        let far = range_m().into_iter().map(|range_m| 1e7 * range_m).collect();
        assert!(
            refused(rays([0.1, 0.2, 0.3]), far)
                .contains("range reaches 1200000000 m: at most 1000000 m")
        );
        let mut missing = rays([0.1, 0.2, 0.3]);
        missing
            .iter_mut()
            .for_each(|ray| ray.velocity_m_s = vec![f64::NAN; 12]);
        assert!(refused(missing, range_m()).contains("all of its velocities are missing"));
    }

    #[test]
    fn angles_and_ranges_in_other_units_than_stated_are_refused() {
        let degrees = rays([0.1, 0.2, 0.3].map(f64::to_radians));
        let refused = scan_map(degrees, range_m(), None, "it").unwrap_err();
        assert!(
            refused.contains("from 0.1000 to 0.3000 degrees span 0.42 m"),
            "{refused}"
        );
        let near = range_m().into_iter().map(|range_m| range_m / 1e3).collect();
        let refused = scan_map(rays([0.1, 0.2, 0.3]), near, None, "it").unwrap_err();
        assert!(
            refused.contains("range reaches 0.12 m: at least 10 m"),
            "{refused}"
        );
    }
}
