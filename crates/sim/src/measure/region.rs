//! The radius of the regions of a scene, and the wind of a first map between its points.
//!
//! Check: tables keep their values; a target standard deviation is reached at each gate and not with a smaller radius.

use crate::Error;
use crate::measure::ray_information::RayInformation;
use crate::plan::geometry::Geometry;
use crate::scene::{RegionRadius, Scene};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use wakescope_estimate::{
    Radius,
    map::{PolarPoint, ScanGeometry},
};

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

/// Information on the velocity in regions of a scan about the line in its middle.
///
/// Each record is about its innermost window, with which rows of windows begin: ends of the scan cut chords. Most chords share one.
pub(crate) struct RegionInformation<'a> {
    of_rays: &'a RayInformation<'a>,
    places: &'a ScanGeometry,
    gates_m: Vec<f64>,
    /// Windows of the longest chord.
    most: usize,
    /// Information in 1, 2, .. windows about the gates where it was needed.
    by_gates: BTreeMap<usize, Vec<f64>>,
}

impl<'a> RegionInformation<'a> {
    /// For regions up to a radius, m.
    pub(crate) fn new(
        of_rays: &'a RayInformation<'a>,
        places: &'a ScanGeometry,
        largest_m: f64,
    ) -> Self {
        Self {
            of_rays,
            places,
            gates_m: places.gate_ranges_m(),
            most: places.most_gates(largest_m),
            by_gates: BTreeMap::new(),
        }
    }

    /// Information, 1/(m/s)^2, in the region of a radius, m, about a range, m.
    ///
    /// # Errors
    /// What the estimators refuse; a checked scene gives none.
    pub(crate) fn about(&mut self, range_m: f64, radius_m: f64) -> Result<f64, Error> {
        let point = PolarPoint::on_line(range_m, self.places.lines() / 2);
        let mut of_region = 0.0;
        for (line, gates) in self.places.chords(point, radius_m) {
            let innermost = (gates.start + gates.end - 1) / 2;
            let by_gates = match self.by_gates.entry(innermost) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(place) => {
                    place.insert(self.of_rays.at(self.gates_m[innermost], self.most)?)
                }
            };
            let pulses = self.places.line_rays(line).count();
            of_region += pulses as f64 * by_gates[gates.len().min(self.most) - 1];
        }
        Ok(of_region)
    }
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
    let mut information = RegionInformation::new(of_rays, geometry, largest_m);
    Radius::for_standard_deviation(
        &of_rays.plan.geometry.gate_range_m,
        |range_m, radius_m| information.about(range_m, radius_m),
        standard_deviation_m_s,
        largest_m,
    )
}

#[cfg(test)]
mod tests {
    use crate::interpolation::interpolate;

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
