//! Lines of sight with their velocities as the grid of a map: sorted by elevation, equal ones averaged, checked.
//!
//! Check: lines of one elevation; what makes no map.

use super::planes::FEWEST_LINES;
use ndarray::Array2;
use wakescope_estimate::retrieval::ScanMap;

/// A line of sight as a file has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct RayRow {
    pub(super) elevation_rad: f64,
    /// NaN if unknown.
    pub(super) azimuth_rad: f64,
    /// NaN if unknown.
    pub(super) time_s: f64,
    pub(super) velocity_m_s: Vec<f64>,
    /// Empty if there are none.
    pub(super) sigma_m_s: Vec<f64>,
}

/// Farthest range of a gate, m: that of a scene.
const FARTHEST_M: f64 = 1e6;
/// Fewest gates and velocities of a map.
const FEWEST_GATES: usize = 3;
const FEWEST_VELOCITIES: usize = 30;

/// Scans of which the scatter tells a deviation.
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
    let (sum, cells) = counts
        .filter(|count| *count > 0.0)
        .fold((0.0, 0.0), |(sum, cells), c| (sum + c, cells + 1.0));
    if cells > 0.0 { sum / cells } else { 1.0 }
}

/// The map of rays; `what` names the scan in messages.
pub(super) fn scan_map(
    mut rays: Vec<RayRow>,
    range_m: Vec<f64>,
    fold_m_s: Option<f64>,
    what: &str,
) -> Result<ScanMap, String> {
    let gates = range_m.len();
    if let Some(pair) = range_m
        .windows(2)
        .find(|pair| pair[1].is_nan() || pair[1] <= pair[0])
    {
        let one_m = pair[0];
        let next_m = pair[1];
        return Err(format!(
            "{what}: range must increase from gate to gate, and {one_m} m is followed by {next_m} m"
        ));
    }
    if !range_m
        .first()
        .is_some_and(|first| *first >= 0.0 && first.is_finite())
    {
        return Err(format!(
            "{what}: range must be at least 0 m at the first gate"
        ));
    }
    if let Some(far) = range_m.last().filter(|last| **last > FARTHEST_M) {
        return Err(format!(
            "{what}: range reaches {far} m: at most {FARTHEST_M} m are read"
        ));
    }
    rays.sort_by(|a, b| a.elevation_rad.total_cmp(&b.elevation_rad));
    let lines: Vec<&[RayRow]> = rays
        .chunk_by(|a, b| a.elevation_rad == b.elevation_rad)
        .collect();
    if lines.len() < FEWEST_LINES || gates < FEWEST_GATES {
        return Err(format!(
            "{what}: it has {} different elevations and {gates} ranges; a scan in elevation (RHI) of at least {FEWEST_LINES} lines and \
             {FEWEST_GATES} gates is needed",
            lines.len()
        ));
    }
    let has_sigma = rays.iter().all(|ray| !ray.sigma_m_s.is_empty());
    let mean_at = |line: &[RayRow], of: &dyn Fn(&RayRow) -> f64| {
        let values: Vec<f64> = line
            .iter()
            .map(of)
            .filter(|value| value.is_finite())
            .collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let sigma_at = |line: usize, gate: usize| {
        let rows = lines[line];
        let count = rows
            .iter()
            .filter(|ray| ray.velocity_m_s[gate].is_finite())
            .count();
        mean_at(rows, &|ray| ray.sigma_m_s[gate]) / (count as f64).sqrt()
    };
    let mut velocity_m_s = Array2::from_shape_fn((lines.len(), gates), |(line, gate)| {
        mean_at(lines[line], &|ray| ray.velocity_m_s[gate])
    });
    let is_known = |sigma: &f64| sigma.is_finite() && *sigma > 0.0;
    let sigma_m_s = has_sigma
        .then(|| Array2::from_shape_fn((lines.len(), gates), |(line, gate)| sigma_at(line, gate)));
    let mut sigma_m_s = sigma_m_s.filter(|sigma| sigma.iter().any(is_known));
    if let Some(sigma) = &mut sigma_m_s {
        // A velocity of unknown error counts for nothing.
        velocity_m_s.zip_mut_with(sigma, |velocity, sigma| {
            *velocity = if is_known(sigma) { *velocity } else { f64::NAN };
        });
        sigma.mapv_inplace(|sigma| if is_known(&sigma) { sigma } else { 1.0 });
    }
    let values = velocity_m_s
        .iter()
        .filter(|value| value.is_finite())
        .count();
    if values < FEWEST_VELOCITIES {
        return Err(match values {
            0 => format!("{what}: all of its velocities are missing"),
            _ => format!(
                "{what}: it has {values} velocities that are not missing; at least {FEWEST_VELOCITIES} are needed"
            ),
        });
    }
    if let Some(bad) = velocity_m_s.iter().find(|value| value.abs() > 500.0) {
        return Err(format!(
            "{what}: a velocity is {bad} m/s: its unit must be m/s, and a missing one its fill value"
        ));
    }
    let time_s: Vec<f64> = lines
        .iter()
        .map(|line| mean_at(line, &|ray| ray.time_s))
        .collect();
    Ok(ScanMap {
        elevation_rad: lines.iter().map(|line| line[0].elevation_rad).collect(),
        // Of all lines, or of none.
        time_s: if time_s.iter().all(|time| time.is_finite()) {
            time_s
        } else {
            vec![f64::NAN; lines.len()]
        },
        range_m,
        velocity_m_s,
        sigma_m_s,
        fold_m_s: fold_m_s.filter(|fold| *fold > 0.0 && fold.is_finite()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays(elevations: impl IntoIterator<Item = f64>) -> Vec<RayRow> {
        let ray = |(i, elevation_rad): (usize, f64)| RayRow {
            elevation_rad,
            azimuth_rad: 1.0,
            time_s: i as f64,
            velocity_m_s: vec![i as f64; 12],
            sigma_m_s: Vec::new(),
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
    fn what_is_no_scan_is_refused_by_name() {
        let refused = |rays: Vec<RayRow>, range_m: Vec<f64>| {
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
        assert!(refused(missing.clone(), range_m()).contains("all of its velocities are missing"));
        missing
            .iter_mut()
            .for_each(|ray| ray.velocity_m_s = vec![-9999.0; 12]);
        assert!(refused(missing, range_m()).contains("fill value"));
    }
}
