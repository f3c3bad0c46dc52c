//! The radius of the regions of a scene, and the wind of a first map between its points.
//!
//! Check: tables keep their values; a target standard deviation gives larger regions where the signal is weaker.

use crate::Error;
use crate::interpolation::interpolate;
use crate::measure::ray_information::RayInformation;
use crate::plan::geometry::Geometry;
use crate::scene::{RegionRadius, Scene};
use wakescope_estimate::{Radius, map::ScanGeometry};

/// Where the windows of a scan are: in one plane if it is a plain RHI, else on a sphere.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub(crate) fn places(scene: &Scene, g: &Geometry) -> Result<ScanGeometry, Error> {
    let sampling = scene.sampling()?;
    let gates = scene.gates()?;
    let scan = &g.schedule;
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
    let estimator = &of_rays.plan.scene().estimator;
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
            .map(|gates| interpolate(&range_m, &of(gates), at_m))
            .collect()
    };
    Ok(Radius::for_standard_deviation(
        geometry,
        by_gates,
        standard_deviation_m_s,
        largest_m,
    )?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_linear_between_their_points() {
        let x = [1.0, 2.0, 4.0];
        let y = [10.0, 20.0, 0.0];
        for (at, expected) in [
            (0.0, 10.0),
            (1.0, 10.0),
            (1.5, 15.0),
            (3.0, 10.0),
            (4.0, 0.0),
            (9.0, 0.0),
        ] {
            assert_eq!(interpolate(&x, &y, at), expected, "{at}");
        }
    }
}
