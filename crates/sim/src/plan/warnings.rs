//! What is allowed in a scene but probably not meant, or cannot be done by a real laser or receiver.
//!
//! Check: each warning appears with what it warns of, and not without; remedies that it names leave none; the number of empty gates is that
//! of the gates which a run leaves empty.

use crate::plan::Plan;
use crate::plan::estimators::grid_step_and_bias_m_s;
use crate::scene::EddyDecorrelation;
use crate::{Error, SPEED_OF_LIGHT_M_S};

/// Least shift of velocities by the pulse that is reported, m/s.
const SHIFT_M_S: f64 = 0.01;

/// What the user should know of a scene, except for its phase screens and gates.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub(super) fn of_scene(plan: &Plan) -> Result<Vec<String>, Error> {
    let scene = plan.scene();
    let e = &scene.estimator;
    let mut out = Vec::from_iter(of_fast_air(plan));
    out.extend(of_shifted_pulse(plan));
    if e.padded_samples < 4 * e.window_samples {
        let (step_m_s, off_m_s) = grid_step_and_bias_m_s(scene)?;
        out.push(format!(
            "estimator.padded_samples gives a spectrum in steps of {step_m_s:.2} m/s: with this estimator.refinement a line is found up \
             to {off_m_s:.3} m/s off"
        ));
    }
    out.extend(e.method.behaviour().warning(e));
    if scene.outputs.signals && !scene.outputs.netcdf {
        out.push(
            "outputs.netcdf = false: no file holds the signals that outputs.signals requests"
                .into(),
        );
    }
    if scene.scan.realisations < 2 {
        out.push("one realisation: no standard deviation can be given".into());
    }
    out.extend(of_ambiguous_ranges(plan));
    out.extend(of_frozen_eddies(plan));
    out.extend(of_low_profiles(plan));
    out.extend(of_low_profile(plan));
    if let Some(pair) = &plan.wind.pair {
        out.extend(pair.warnings(plan.oldest_age_s()));
    }
    let first_m = scene.scan.range_min_m;
    let blind_m = scene.telescope.blind_range_m;
    if first_m < blind_m {
        out.push(format!("scan.range_min_m = {first_m}: nothing is seen up to telescope.blind_range_m, {blind_m} m"));
    }
    Ok(out)
}

/// Air that the detector band does not hold.
fn of_fast_air(plan: &Plan) -> Option<String> {
    let scene = plan.scene();
    let fastest_m_s = plan.fastest_m_s;
    let half_band_m_s = 0.25 * scene.laser.wavelength_m * scene.detector.bandwidth_hz;
    let seen = if scene.scan.lidar.velocity_m_s == [0.0; 3] {
        ""
    } else {
        ", seen from the lidar,"
    };
    (fastest_m_s > half_band_m_s).then(|| {
        format!(
            "the air on the lines of sight{seen} reaches {fastest_m_s:.1} m/s, the detector band ends at {half_band_m_s:.1} m/s: faster \
             air is not seen"
        )
    })
}

/// Turbulence that is frozen for longer than its large eddies live.
fn of_frozen_eddies(plan: &Plan) -> Option<String> {
    let eddies = plan.scene().eddies()?;
    let frozen = eddies.decorrelation == EddyDecorrelation::None;
    let lifetime_s = eddies.outer_scale_m / eddies.spectrum()?.variance_m2_s2().sqrt();
    let scan_s = plan.scan_end_s() - plan.wind.start_s;
    (frozen && scan_s > lifetime_s).then(|| {
        format!(
            "the eddies are frozen for {scan_s:.0} s, longer than outer_scale_m over their standard deviation, {lifetime_s:.0} s, after \
             which those of real air have changed: decorrelation = \"sweeping\" changes them"
        )
    })
}

/// A table of Cn2 that ends below the scan.
fn of_low_profile(plan: &Plan) -> Option<String> {
    let scene = plan.scene();
    let end_m = scene.refractive_turbulence()?.profile?.end_m()?;
    let schedule = &plan.geometry.schedule;
    let top_m = (0..schedule.lines.len())
        .map(|line| schedule.middle(line).at_range_m(scene.scan.range_max_m)[2])
        .fold(0.0, f64::max);
    (end_m < top_m).then(|| {
        format!(
            "atmosphere.turbulence.profile ends at {end_m} m, the scan at {top_m:.0} m: Cn2 stays as at its last height"
        )
    })
}

/// Tables of the wind that end below the scan.
fn of_low_profiles(plan: &Plan) -> Vec<String> {
    let schedule = &plan.geometry.schedule;
    let range_m = plan.scene().scan.range_max_m;
    let heights_m = (0..schedule.lines.len()).map(|i| schedule.middle(i).at_range_m(range_m)[2]);
    let highest_m = heights_m.fold(0.0, f64::max);
    let mut out = Vec::new();
    for wind in plan.scene().mean_winds() {
        if let Some(&last_m) = wind.height_m.last()
            && last_m < highest_m
        {
            out.push(format!(
                "height_m of the wind ends at {last_m} m, the scan at {highest_m:.0} m: above, the wind is that of the last height"
            ));
        }
    }
    out
}

/// A pulse whose own mean frequency shifts all velocities.
fn of_shifted_pulse(plan: &Plan) -> Option<String> {
    let mean_hz = plan.instrument.pulse.mean_frequency_hz();
    let shift_m_s = -0.5 * plan.scene().laser.wavelength_m * mean_hz;
    (shift_m_s.abs() >= SHIFT_M_S).then(|| {
        format!(
            "pulse.shape: the mean frequency of the pulse is {:.3} MHz beside that of the laser: it shifts every velocity by {shift_m_s:.2} m/s, \
             which no estimator takes off; a phase less 2 pi x {:.3} MHz x time has none",
            1e-6 * mean_hz,
            1e-6 * mean_hz,
        )
    })
}

/// Pulses so close that light of the one before comes back from the ranges of the scan, or a later one is sent meanwhile: a pulse that leaves
/// a time T after another one has its light come back with that from c T/2 farther away. The signals of a scene hold one pulse each,
/// as if the one before were long gone.
fn of_ambiguous_ranges(plan: &Plan) -> Option<String> {
    let scene = plan.scene();
    let rate_hz = scene.laser.pulse_repetition_hz;
    let apart_m = 0.5 * SPEED_OF_LIGHT_M_S / rate_hz;
    let (first_s, _) = plan.instrument.pulse.support_s();
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
    use crate::plan::{Plan, Target};
    use crate::scene::{Scene, SceneFile};

    fn plan(change: impl FnOnce(&mut Scene)) -> Plan {
        let mut scene = Scene::default();
        change(&mut scene);
        Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap()
    }

    #[test]
    fn pulses_closer_than_the_scan_is_long_are_warned_of_with_a_rate_that_is_not() {
        let warnings = |rate_hz: f64| plan(|s| s.laser.pulse_repetition_hz = rate_hz).warnings;
        let found = warnings(1e6);
        assert!(
            found.len() == 1 && found[0].contains("150 m") && found[0].contains("scan.range_max_m"),
            "{found:?}"
        );
        let words: Vec<&str> = found[0].split(' ').collect();
        let at = words
            .iter()
            .position(|word| *word == "to" && found[0].contains("up to"))
            .unwrap();
        let rate_hz = words[at..]
            .iter()
            .filter_map(|word| word.parse().ok())
            .next_back()
            .unwrap();
        assert!(
            (200e3..300e3).contains(&rate_hz) && warnings(rate_hz).is_empty(),
            "{rate_hz}"
        );
        assert!(!warnings(1.02 * rate_hz).is_empty());
        assert!(warnings(Scene::default().laser.pulse_repetition_hz).is_empty());
    }

    #[test]
    fn a_pulse_with_a_mean_frequency_is_warned_of_with_the_shift_and_one_with_a_symmetric_chirp_is_not()
     {
        use crate::scene::{PulseShape, SampledShape};
        let warnings = |phase: fn(f64) -> f64| {
            plan(|s| {
                let time_s: Vec<f64> = (-100..=100).map(|i| 4e-9 * f64::from(i)).collect();
                s.pulse.shape = PulseShape::Sampled(SampledShape {
                    power: time_s
                        .iter()
                        .map(|t| (-(t / 120e-9).powi(2)).exp())
                        .collect(),
                    phase_rad: time_s.iter().map(|t| phase(*t)).collect(),
                    time_s,
                    centred: true,
                });
            })
            .warnings
        };
        let found = warnings(|time_s| std::f64::consts::TAU * 2e6 * time_s);
        let shift_m_s = -0.5 * Scene::default().laser.wavelength_m * 2e6;
        assert!(
            found.len() == 1
                && found[0].contains("2.000 MHz")
                && found[0].contains(&format!("by {shift_m_s:.2} m/s")),
            "{found:?}"
        );
        assert!(warnings(|time_s| 1e13 * time_s * time_s).is_empty());
    }

    #[test]
    fn signals_without_a_file_are_warned_of() {
        let warnings = |netcdf: bool| {
            plan(|s| (s.outputs.signals, s.outputs.netcdf) = (true, netcdf)).warnings
        };
        assert!(warnings(true).is_empty());
        let found = warnings(false);
        assert!(
            found.len() == 1 && found[0].contains("outputs.netcdf = false"),
            "{found:?}"
        );
    }

    #[test]
    fn ranges_that_are_blind_are_warned_of() {
        let warnings = |change: fn(&mut Scene)| plan(change).warnings;
        let found = warnings(|s| s.telescope.blind_range_m = 350.0);
        assert!(found.len() == 1 && found[0].contains("350 m"), "{found:?}");
        assert!(warnings(|s| s.telescope.blind_range_m = 280.0).is_empty());
    }
}
