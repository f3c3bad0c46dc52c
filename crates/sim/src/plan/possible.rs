//! What a run would refuse after it has begun to compute, found from the sizes and a few points of the wind: lines that leave a flow,
//! results that no file can hold.
//!
//! Check: scenes that only a run used to refuse are refused by the plan, with the words of the run, or with the key and what would do.

use super::{Plan, Stage, Target};
use crate::Error;
use crate::io::UtcTime;
use crate::io::hpl::within_a_day;
use crate::measure::air::radial_velocity_m_s;
use crate::scene::{DetectorSignal, Flow, Outside};
use wakescope_estimate::wake_detection::WakeDetector;

/// Refuses what a run of the plan would refuse: lines that leave a simulated flow, a test for a wake in a scan of a few velocities.
///
/// # Errors
/// The first place outside, in the words of the run; what files cannot hold.
pub(super) fn check(plan: &Plan) -> Result<(), Error> {
    let (scene, g) = (&plan.scene.content, &plan.geometry);
    let velocities = g.elevation_rad.len() * g.gate_range_m.len();
    let is_tested = plan.target == Target::Run
        && scene
            .retrieval
            .as_ref()
            .is_some_and(|r| r.false_alarm.is_some());
    if is_tested && velocities < WakeDetector::NEEDED {
        let reason = format!(
            "the scan has {velocities} velocities: a test for a wake needs {} lines times gates at least, or no retrieval.false_alarm",
            WakeDetector::NEEDED
        );
        return Err(Error::Input {
            path: "retrieval.false_alarm".into(),
            reason,
        });
    }
    if plan.target != Target::Efficiency {
        lines_stay_inside(plan)?;
    }
    files_hold_it(plan)
}

/// Layers of a line that are looked at one by one.
const LAYERS_LOOKED_AT: usize = 1_000_000;

/// A simulated flow is known in a rectangle, so a line is inside if both its ends above the ground are; the line of which one
/// is not is looked at layer by layer.
fn lines_stay_inside(plan: &Plan) -> Result<(), Error> {
    let (scene, g) = (&plan.scene.content, &plan.geometry);
    if !matches!(scene.flow, Flow::Simulated(_) | Flow::Fields(_))
        || scene.scan.outside_flow != (Outside::Error {})
    {
        return Ok(());
    }
    let last_m = g.first_layer_range_m + g.layers.saturating_sub(1) as f64 * g.layer_thickness_m;
    for line in 0..g.schedule.lines.len() {
        // Where a line that points down meets the ground.
        let beam = g.schedule.middle(line);
        let sin = beam.direction.0[2];
        let ground_m = if sin < 0.0 {
            -beam.position_m[2] / sin
        } else {
            f64::INFINITY
        };
        let ends_m = [g.first_layer_range_m, last_m.min(ground_m)];
        if g.first_layer_range_m <= ground_m && radial_velocity_m_s(plan, line, &ends_m).is_err() {
            // The words of the run: the first layer outside.
            let ranges_m: Vec<f64> = g.layer_range_m().take(LAYERS_LOOKED_AT).collect();
            radial_velocity_m_s(plan, line, &ranges_m)?;
            radial_velocity_m_s(plan, line, &ends_m)?;
        }
    }
    Ok(())
}

/// Refuses results that do not fit into the files that their scene asks for.
///
/// # Errors
/// The key, the size or the times, and what is allowed.
fn files_hold_it(plan: &Plan) -> Result<(), Error> {
    let (scene, has_map) = (&plan.scene.content, plan.runs(Stage::Estimates));
    let (first_s, last_s) = (plan.wind.start_s, plan.scan_end_s());
    if scene.outputs.netcdf {
        let (g, kept_realisations) = (&plan.geometry, plan.kept_realisations());
        let rays = g.elevation_rad.len() as f64;
        if kept_realisations > 0 {
            let pulses = rays * (scene.scan.pulses_per_line * kept_realisations) as f64;
            let quadratures = if scene.detector.signal == DetectorSignal::Baseband {
                2.0
            } else {
                1.0
            };
            let bytes = crate::io::cf_signals::data_bytes(
                [pulses, g.samples as f64, quadratures],
                [rays, g.layers as f64],
            );
            let remedy = "keep fewer pulses, lines or realisations, or set it to false";
            fits("outputs.signals", "signals.nc", bytes, remedy)?;
        }
        if has_map {
            let bytes = crate::io::cfradial::data_bytes(rays, g.gate_range_m.len() as f64);
            fits(
                "estimator.gate_step_samples",
                "map.nc",
                bytes,
                "make it larger, or scan fewer lines",
            )?;
            let most_s = crate::io::MAX_TIME_S;
            if first_s.abs() > most_s || last_s > most_s {
                let reason = format!(
                    "the rays end {last_s:e} s after the start of the flow; files hold {most_s:e} s"
                );
                return Err(Error::Key {
                    key: "scan.pulses_per_line",
                    reason,
                });
            }
        }
    }
    if scene.outputs.hpl && has_map {
        let start = UtcTime::parse(&scene.site.start_utc).unwrap_or(UtcTime::SYNTHETIC);
        within_a_day(first_s, last_s, start).map_err(|e| Error::Key {
            key: "outputs.hpl",
            reason: format!("{e}: choose another site.start_utc"),
        })?;
    }
    Ok(())
}

fn fits(key: &'static str, file: &str, bytes: f64, remedy: &str) -> Result<(), Error> {
    let most = crate::io::netcdf::MAX_BYTES as f64;
    if bytes <= most {
        return Ok(());
    }
    let reason = format!(
        "{file} would have {:.0} MB, and may have {:.0} MB: {remedy}",
        bytes / 1e6,
        most / 1e6
    );
    Err(Error::Key { key, reason })
}

#[cfg(test)]
mod tests {
    use crate::plan::{Plan, Target};
    use crate::scene::{Scene, SceneFile, SignalsOf};

    fn refused(change: impl FnOnce(&mut Scene)) -> String {
        let mut scene = Scene::default();
        change(&mut scene);
        Plan::new(SceneFile::new(scene).unwrap(), Target::Run)
            .map_or_else(|e| e.to_string(), |_| String::new())
    }

    #[test]
    fn signals_that_no_file_can_hold_are_refused_before_the_run() {
        let many = |of: SignalsOf| {
            refused(|s| {
                (s.outputs.signals, s.outputs.signals_of) = (true, of);
                s.scan.realisations = 100;
            })
        };
        assert_eq!(many(SignalsOf::First), "");
        let message = many(SignalsOf::All);
        assert!(
            message.contains("outputs.signals") && message.contains("537 MB"),
            "{message}"
        );
        let without = refused(|s| {
            (s.outputs.signals, s.outputs.signals_of, s.outputs.netcdf) =
                (true, SignalsOf::All, false);
            s.scan.realisations = 100;
        });
        assert_eq!(without, "", "no file, no limit");
    }

    #[test]
    fn a_halo_file_across_midnight_is_refused_before_the_run() {
        let at = |start_utc: &str| {
            refused(|s| {
                s.outputs.hpl = true;
                (s.estimator.gate_step_samples, s.scan.range_min_m) = (64, 306.9875);
                s.site.start_utc = start_utc.into();
            })
        };
        assert_eq!(at("2024-01-01T23:59:50Z"), "");
        let message = at("2024-01-01T23:59:58Z");
        assert!(
            message.contains("outputs.hpl") && message.contains("site.start_utc"),
            "{message}"
        );
    }
}
