//! The radius of the regions of a scene, and the wind of a first map between its points.
//!
//! Check: tables keep their values; a target standard deviation gives larger regions where the signal is weaker.

use crate::scene::{RegionRadius, Scene};
use crate::setup::geometry::Geometry;
use crate::setup::ray_information::RayInformation;
use crate::setup::table::of_table;
use crate::{Error, setup::estimators};
use ndarray::Array2;
use wakescope_estimate::{
    Radius,
    map::{PolarPoint, ScanGeometry},
};

/// Where the windows of a scan are: in one plane if it is a plain RHI, else on a sphere.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub(crate) fn places(scene: &Scene, g: &Geometry) -> Result<ScanGeometry, Error> {
    let (sampling, gates, scan) = (
        estimators::sampling(scene)?,
        estimators::gates(scene)?,
        &g.schedule,
    );
    if scan.is_plane() {
        let pulses = scan.lines.first().map_or(1, |line| line.pulses);
        return Ok(ScanGeometry::regular(
            &sampling,
            &gates,
            &g.elevation_rad,
            pulses,
            g.samples,
        )?);
    }
    let direction: Vec<[f64; 3]> = (0..scan.lines.len())
        .map(|line| scan.middle(line).direction.0)
        .collect();
    let group: Vec<usize> = scan.lines.iter().map(|line| line.group).collect();
    let first: Vec<usize> = scan
        .lines
        .iter()
        .map(|line| line.first)
        .chain([scan.pulses()])
        .collect();
    Ok(ScanGeometry::on_sphere(
        &sampling, &gates, &direction, &group, &first, g.samples,
    )?)
}

/// The radius of a scene's regions.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub(crate) fn region_radius(
    of_rays: &RayInformation<'_>,
    geometry: &ScanGeometry,
) -> Result<Radius, Error> {
    let estimator = &of_rays.setup.scene.content.estimator;
    let RegionRadius::Target {
        standard_deviation_m_s,
        largest_m,
    } = estimator.radius
    else {
        let own = estimator.clone();
        return Ok(Radius::OfRange(Box::new(move |range_m| {
            own.largest_radius_m(range_m)
        })));
    };
    let all_m = geometry.gate_ranges_m();
    let range_m: Vec<f64> = all_m
        .iter()
        .copied()
        .step_by(all_m.len().div_ceil(16))
        .collect();
    let count = geometry.most_gates(largest_m);
    let known = range_m
        .iter()
        .map(|at_m| of_rays.at(*at_m, count))
        .collect::<Result<Vec<_>, Error>>()?;
    let by_gates = |at_m: f64| -> Vec<f64> {
        let of = |gates: usize| {
            known
                .iter()
                .map(|by_gates| by_gates[gates])
                .collect::<Vec<f64>>()
        };
        (0..count)
            .map(|gates| of_table(&range_m, &of(gates), at_m))
            .collect()
    };
    Ok(Radius::for_standard_deviation(
        geometry,
        by_gates,
        standard_deviation_m_s,
        largest_m,
    )?)
}

/// The wind of a map \[line, gate\] anywhere, bilinear between its points; NaN outside and where a neighbour is NaN.
pub(crate) fn interpolated(
    points: &[PolarPoint],
    velocity_m_s: Array2<f64>,
) -> impl Fn(PolarPoint) -> f64 + Sync {
    let (lines, gates) = velocity_m_s.dim();
    let range_m: Vec<f64> = points[..gates].iter().map(|p| p.range_m).collect();
    let elevation_rad: Vec<f64> = (0..lines)
        .map(|i| points[i * gates].elevation_rad)
        .collect();
    let place = |axis: &[f64], at: f64| -> Option<(usize, f64)> {
        let (first, last) = (axis.first()?, axis.last()?);
        if axis.len() == 1 || !(at >= *first && at <= *last) {
            return (at == *first).then_some((0, 0.0));
        }
        let below = (axis.partition_point(|x| *x <= at) - 1).min(axis.len() - 2);
        Some((below, (at - axis[below]) / (axis[below + 1] - axis[below])))
    };
    move |point: PolarPoint| {
        let (Some((i, a)), Some((j, b))) = (
            place(&elevation_rad, point.elevation_rad),
            place(&range_m, point.range_m),
        ) else {
            return f64::NAN;
        };
        // A neighbour without weight may be missing.
        let at = |di: usize, dj: usize, weight: f64| {
            if weight == 0.0 {
                0.0
            } else {
                weight * velocity_m_s[[i + di, j + dj]]
            }
        };
        at(0, 0, (1.0 - a) * (1.0 - b))
            + at(0, 1, (1.0 - a) * b)
            + at(1, 0, a * (1.0 - b))
            + at(1, 1, a * b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wakescope_estimate::polar_points;

    #[test]
    fn tables_and_maps_are_linear_between_their_points() {
        let (x, y) = ([1.0, 2.0, 4.0], [10.0, 20.0, 0.0]);
        for (at, expected) in [
            (0.0, 10.0),
            (1.0, 10.0),
            (1.5, 15.0),
            (3.0, 10.0),
            (4.0, 0.0),
            (9.0, 0.0),
        ] {
            assert_eq!(of_table(&x, &y, at), expected, "{at}");
        }
        let points = polar_points(&[0.1, 0.2, 0.4], &[100.0, 110.0, 130.0]);
        let plane = |p: &PolarPoint| 3.0 * p.elevation_rad + 0.5 * p.range_m;
        let values: Vec<f64> = points.iter().map(plane).collect();
        let wind = interpolated(&points, Array2::from_shape_vec((3, 3), values).unwrap());
        for (elevation_rad, range_m) in [(0.1, 100.0), (0.13, 128.0), (0.4, 130.0), (0.39, 105.0)] {
            let p = PolarPoint {
                range_m,
                elevation_rad,
            };
            assert!((wind(p) - plane(&p)).abs() < 1e-12, "{p:?}");
        }
        assert!(
            wind(PolarPoint {
                range_m: 99.0,
                elevation_rad: 0.2
            })
            .is_nan()
        );
    }
}
