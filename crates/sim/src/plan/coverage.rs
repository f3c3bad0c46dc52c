//! Gates whose regions hold no window: windows may be farther apart than regions are wide.
//!
//! Check: the number that is warned of is that of the gates which a run leaves empty, and the remedy leaves none.

use crate::Error;
use crate::scene::Scene;
use crate::setup::geometry::Geometry;
use crate::setup::region::{largest_radius_m, places};
use wakescope_estimate::map::PolarPoint;

/// A warning if a line has gates without a window. Regions as large as a standard deviation asks for are not looked at.
pub(super) fn warning(scene: &Scene, g: &Geometry) -> Result<Option<String>, Error> {
    let e = &scene.estimator;
    let places = places(scene, g)?;
    let elevation_rad = places.line_elevation_rad()[0];
    let is_empty = |range_m: f64| {
        places.chords(PolarPoint { range_m, elevation_rad }, largest_radius_m(scene, range_m)).next().is_none()
    };
    let empty = g.gate_range_m.iter().filter(|range_m| is_empty(**range_m)).count();
    let step_m = e.window_step_samples as f64 * scene.sample_spacing_m();
    let windows_m = places.gate_ranges_m();
    let nearest_m = |gate_m: &f64| windows_m.iter().map(|at_m| (at_m - gate_m).abs()).fold(f64::INFINITY, f64::min);
    let farthest_m = g.gate_range_m.iter().map(nearest_m).fold(0.0, f64::max);
    Ok((empty > 0).then(|| {
        format!(
            "{empty} of {} gates of a line have no window in their region and stay empty: windows are {step_m:.2} m apart \
             (estimator.window_step_samples = {}), regions are {:.2} m wide; none is empty with an estimator.radius_m of {:.3} or more, or \
             with windows that gates are a multiple of apart",
            g.gate_range_m.len(),
            e.window_step_samples,
            2.0 * largest_radius_m(scene, g.gate_range_m[0]),
            // rounded up, so that the number given is good
            (1000.0 * farthest_m).ceil() / 1000.0,
        )
    }))
}

#[cfg(test)]
mod tests {
    use crate::plan::{Plan, Target};
    use crate::scene::{Scene, SceneFile};
    use wakescope_estimate::map::ScanGeometry;

    fn plan(step: usize, radius_m: f64) -> Plan {
        let mut scene = Scene::default();
        (scene.estimator.window_step_samples, scene.estimator.radius_m) = (step, radius_m);
        Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap()
    }

    #[test]
    fn gates_that_no_window_is_near_are_counted_with_a_remedy() {
        for (step, radius_m) in [(16, 2.0), (7, 0.5), (12, 1.5)] {
            let plan = plan(step, radius_m);
            let found: Vec<&String> = plan.warnings.iter().filter(|text| text.contains("have no window")).collect();
            let text = found.first().unwrap_or_else(|| panic!("{step} {radius_m}: {:?}", plan.warnings));
            let empty: usize = text.split(' ').next().unwrap().parse().unwrap();
            // by the distances themselves
            let (g, scene) = (&plan.geometry, &plan.scene.scene);
            let places: ScanGeometry = crate::setup::region::places(scene, g).unwrap();
            let windows_m = places.gate_ranges_m();
            let near = |gate_m: &f64| windows_m.iter().any(|window_m| (window_m - gate_m).abs() <= radius_m + 1e-5);
            assert_eq!(empty, g.gate_range_m.iter().filter(|gate_m| !near(gate_m)).count(), "{text}");
            let words = text.split("estimator.radius_m of ").nth(1).unwrap();
            let good_m: f64 = words.split(' ').next().unwrap().parse().unwrap();
            assert!(self::plan(step, good_m).warnings.iter().all(|text| !text.contains("have no window")), "{text}");
        }
        assert!(plan(1, 1.0).warnings.is_empty());
    }
}
