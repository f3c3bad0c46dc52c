//! What the files of a plan can hold, found before anything is computed.
//! Check: scenes whose results no file can hold are refused, with the key and what would do.

use super::{Plan, Stage};
use crate::Error;
use crate::io::UtcTime;
use crate::io::hpl::within_a_day;
use crate::scene::DetectorSignal;

/// Refuses results that do not fit into the files that their scene asks for.
///
/// # Errors
/// The key, the size or the times, and what is allowed.
pub(super) fn check(plan: &Plan) -> Result<(), Error> {
    let (scene, has_map) = (&plan.scene.scene, plan.runs(Stage::Estimates));
    let (first_s, last_s) = (plan.wind.start_s, plan.scan_end_s());
    if scene.outputs.netcdf {
        let (g, kept_realisations) = (&plan.geometry, plan.kept_realisations());
        let rays = g.elevation_rad.len() as f64;
        if kept_realisations > 0 {
            let pulses = rays * (scene.scan.pulses_per_line * kept_realisations) as f64;
            let quadratures = if scene.detector.signal == DetectorSignal::Baseband { 2.0 } else { 1.0 };
            let bytes =
                crate::io::cf_signals::data_bytes([pulses, g.samples as f64, quadratures], [rays, g.layers as f64]);
            let remedy = "keep fewer pulses, lines or realisations, or set it to false";
            fits("outputs.signals", "signals.nc", bytes, remedy)?;
        }
        if has_map {
            let bytes = crate::io::cfradial::data_bytes(rays, g.gate_range_m.len() as f64);
            fits("estimator.gate_step_samples", "map.nc", bytes, "make it larger, or scan fewer lines")?;
            let most_s = crate::io::MAX_TIME_S;
            if first_s.abs() > most_s || last_s > most_s {
                let reason = format!("the rays end {last_s:e} s after the start of the flow; files hold {most_s:e} s");
                return Err(Error::Key { key: "scan.pulses_per_line", reason });
            }
        }
    }
    if scene.outputs.hpl && has_map {
        let start = UtcTime::parse(&scene.site.start_utc).unwrap_or(UtcTime::SYNTHETIC);
        within_a_day(first_s, last_s, start)
            .map_err(|e| Error::Key { key: "outputs.hpl", reason: format!("{e}: choose another site.start_utc") })?;
    }
    Ok(())
}

fn fits(key: &'static str, file: &str, bytes: f64, remedy: &str) -> Result<(), Error> {
    let most = crate::io::netcdf::MAX_BYTES as f64;
    if bytes <= most {
        return Ok(());
    }
    let reason = format!("{file} would have {:.0} MB, and may have {:.0} MB: {remedy}", bytes / 1e6, most / 1e6);
    Err(Error::Key { key, reason })
}

#[cfg(test)]
mod tests {
    use crate::plan::{Plan, Target};
    use crate::scene::{Scene, SceneFile, SignalsOf};

    fn refused(change: impl FnOnce(&mut Scene)) -> String {
        let mut scene = Scene::default();
        change(&mut scene);
        Plan::new(SceneFile::new(scene).unwrap(), Target::Run).map_or_else(|e| e.to_string(), |_| String::new())
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
        assert!(message.contains("outputs.signals") && message.contains("537 MB"), "{message}");
        let without = refused(|s| {
            (s.outputs.signals, s.outputs.signals_of, s.outputs.netcdf) = (true, SignalsOf::All, false);
            s.scan.realisations = 100;
        });
        assert_eq!(without, "", "tables have no such limit");
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
        assert!(message.contains("outputs.hpl") && message.contains("site.start_utc"), "{message}");
    }
}
