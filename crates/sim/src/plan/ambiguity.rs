//! Ranges that pulses sent too fast after each other make ambiguous.
//!
//! A pulse that leaves a time T after another one has its light come back with that from c T/2 farther away. The signals of a
//! scene hold one pulse each, as if the one before were long gone. Check: 1 MHz leaves 150 m.

use crate::SPEED_OF_LIGHT_M_S;
use crate::scene::Scene;
use wakescope_signal::Pulse;

/// A warning if light of the pulse before comes back from the ranges of the scan, or a later one is sent meanwhile.
pub(super) fn warning(scene: &Scene, pulse: &Pulse) -> Option<String> {
    let rate_hz = scene.laser.pulse_repetition_hz;
    let apart_m = 0.5 * SPEED_OF_LIGHT_M_S / rate_hz;
    let (first_s, _) = pulse.support_s();
    // the front of the pulse lights air beyond the range of the last sample
    let reach_m = 0.5 * SPEED_OF_LIGHT_M_S * (-first_s).max(0.0);
    let farthest_m = scene.scan.range_max_m + reach_m;
    (apart_m < farthest_m).then(|| {
        let most_hz = 0.5 * SPEED_OF_LIGHT_M_S / farthest_m;
        // rounded down, so that the number given is good
        let digit = 10f64.powf(most_hz.log10().floor() - 2.0);
        format!(
            "laser.pulse_repetition_hz = {rate_hz}: the pulses are {apart_m:.0} m of range apart, the scan reaches to \
             {farthest_m:.0} m (scan.range_max_m and the pulse): returns of several pulses overlap in a real record, which \
             the simulated one leaves out, but for one with scan.second_trip; up to {:.0} Hz they do not",
            (most_hz / digit).floor() * digit
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Plan, Target};
    use crate::scene::SceneFile;

    fn warnings(rate_hz: f64) -> Vec<String> {
        let mut scene = Scene::default();
        scene.laser.pulse_repetition_hz = rate_hz;
        Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap().warnings
    }

    #[test]
    fn pulses_closer_than_the_scan_is_long_are_warned_of_with_a_rate_that_is_not() {
        let found = warnings(1e6);
        assert!(found.len() == 1 && found[0].contains("150 m") && found[0].contains("scan.range_max_m"), "{found:?}");
        let words: Vec<&str> = found[0].split(' ').collect();
        let at = words.iter().position(|word| *word == "to" && found[0].contains("up to")).unwrap();
        let rate_hz = words[at..].iter().filter_map(|word| word.parse().ok()).next_back().unwrap();
        assert!((200e3..300e3).contains(&rate_hz) && warnings(rate_hz).is_empty(), "{rate_hz}");
        assert!(!warnings(1.02 * rate_hz).is_empty());
        assert!(warnings(Scene::default().laser.pulse_repetition_hz).is_empty());
    }
}
