//! What a scene may say of its files, and of the place and date that they carry.
//! Check: impossible values are named with what is allowed.

use super::Scene;
use crate::keys::Checker;

impl Scene {
    /// A HALO raw file counts gates from the lidar and knows their length alone.
    pub(super) fn check_hpl(&self, c: &mut Checker<'_>) {
        let e = &self.estimator;
        let window = e.window_samples;
        if !c.require(
            e.gate_step_samples == window,
            "outputs.hpl",
            true,
            format!(
                "only with gates that touch and do not overlap: estimator.gate_step_samples = {window}, as \
                 estimator.window_samples, not {}",
                e.gate_step_samples
            ),
        ) {
            return;
        }
        let gate_m = window as f64 * self.sample_spacing_m();
        let number = (self.scan.range_min_m / gate_m).round();
        let near_m = |number: f64| (number * gate_m * 1e4).round() / 1e4;
        c.require(
            // A millimetre is below what readers of the format keep.
            (number * gate_m - self.scan.range_min_m).abs() <= 1e-3,
            "scan.range_min_m",
            self.scan.range_min_m,
            format!(
                "a whole number of gates of {gate_m:.4} m with outputs.hpl, such as {} or {} m",
                near_m((self.scan.range_min_m / gate_m).floor()),
                near_m((self.scan.range_min_m / gate_m).floor() + 1.0)
            ),
        );
        c.require(
            self.samples_per_record() >= 2 * window,
            "scan.range_max_m",
            self.scan.range_max_m,
            format!("at least {:.4} m with outputs.hpl, which needs two gates", self.scan.range_min_m + 2.0 * gate_m),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(change: impl FnOnce(&mut Scene)) -> Vec<String> {
        let mut scene = Scene::default();
        change(&mut scene);
        scene.problems().into_iter().map(|p| p.key).collect()
    }

    #[test]
    fn place_and_date_have_limits() {
        assert_eq!(keys(|s| s.site.latitude_deg = 91.0), ["site.latitude_deg"]);
        assert_eq!(keys(|s| s.site.longitude_deg = f64::NAN), ["site.longitude_deg"]);
        assert_eq!(keys(|s| s.site.altitude_m = 1e6), ["site.altitude_m"]);
        assert_eq!(keys(|s| s.site.start_utc = "yesterday".into()), ["site.start_utc"]);
        assert_eq!(keys(|s| s.site.name = "two\nlines".into()), ["site.name"]);
    }

    #[test]
    fn a_halo_file_needs_gates_that_touch_and_begin_at_the_lidar() {
        let problems = |step: usize, range_min_m: f64| {
            let mut scene = Scene::default();
            scene.outputs.hpl = true;
            (scene.estimator.gate_step_samples, scene.scan.range_min_m) = (step, range_min_m);
            scene.problems().iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        let overlap = problems(5, 280.0).join(" ");
        assert!(overlap.contains("outputs.hpl") && overlap.contains("gate_step_samples = 64"), "{overlap}");
        let shifted = problems(64, 280.0).join(" ");
        assert!(shifted.contains("scan.range_min_m = 280") && shifted.contains("306.9875"), "{shifted}");
        assert_eq!(problems(64, 306.9875), Vec::<String>::new());
    }
}
