//! What a laser or a receiver cannot do, though a scene may ask for it.
//!
//! Check: each warning appears with what it warns of, and not without.

use crate::scene::Scene;
use crate::setup::instrument::Instrument;

/// Warnings of Brillouin scattering and of ranges that the receiver does not see.
pub(super) fn warnings(scene: &Scene, instrument: &Instrument) -> Vec<String> {
    let mut out = Vec::new();
    if let Some(fibre) = &scene.laser.fibre {
        let threshold_w = fibre.of_silica().brillouin_threshold_w(instrument.gaussian_fwhm_s());
        let peak_w = instrument.peak_power_w();
        if peak_w > threshold_w {
            out.push(format!(
                "the peak power, {peak_w:.0} W, is {:.1} times the Brillouin threshold of laser.fibre, {threshold_w:.0} W (good to a \
                 factor of 2 to 3)",
                peak_w / threshold_w
            ));
        }
    }
    let (first_m, blind_m) = (scene.scan.range_min_m, scene.telescope.blind_range_m);
    if first_m < blind_m {
        out.push(format!("scan.range_min_m = {first_m}: nothing is seen up to telescope.blind_range_m, {blind_m} m"));
    }
    out
}

#[cfg(test)]
mod tests {
    use crate::plan::{Plan, Target};
    use crate::scene::{AmplifierFibre, Scene, SceneFile};

    fn warnings(change: impl FnOnce(&mut Scene)) -> Vec<String> {
        let mut scene = Scene::default();
        change(&mut scene);
        Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap().warnings
    }

    #[test]
    fn fibres_that_scatter_and_ranges_that_are_blind_are_warned_of() {
        let found = warnings(|s| s.laser.fibre = Some(AmplifierFibre::default()));
        assert!(found.len() == 1 && found[0].contains("5.4 times") && found[0].contains("132 W"), "{found:?}");
        let wide = AmplifierFibre { effective_area_m2: 3e-9, ..AmplifierFibre::default() };
        assert!(warnings(|s| s.laser.fibre = Some(wide)).is_empty());
        let found = warnings(|s| s.telescope.blind_range_m = 350.0);
        assert!(found.len() == 1 && found[0].contains("350 m"), "{found:?}");
        assert!(warnings(|s| s.telescope.blind_range_m = 280.0).is_empty());
    }
}
