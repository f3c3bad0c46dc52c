//! Results that no file can hold, found from their sizes.

use crate::Error;
use crate::io::cf_signals::data_bytes;
use crate::io::hpl::within_a_day;
use crate::io::{UtcTime, cfradial, netcdf};
use crate::plan::Plan;

/// Refuses results that do not fit into the files that their scene requests.
///
/// # Errors
/// Fails with the key, the size or the times, and what is allowed.
pub(super) fn refuse_too_large(plan: &Plan) -> Result<(), Error> {
    let outputs = &plan.scene().outputs;
    let has_map = plan.target.has_map();
    if outputs.netcdf && plan.kept_realisations() > 0 {
        refuse_large_signals(plan)?;
    }
    if outputs.netcdf && has_map {
        refuse_large_map(plan)?;
    }
    if outputs.hpl && has_map {
        let start = UtcTime::parse(&plan.scene().site.start_utc).unwrap_or(UtcTime::SYNTHETIC);
        within_a_day(plan.wind.start_s, plan.scan_end_s(), start).map_err(|e| Error::Key {
            key: "outputs.hpl",
            reason: format!("{e}: choose another site.start_utc"),
        })?;
    }
    Ok(())
}

fn refuse_large_signals(plan: &Plan) -> Result<(), Error> {
    let n = &plan.counts;
    let pulses_per_line = plan.scene().scan.pulses_per_line;
    let pulses = n.lines * (pulses_per_line * plan.kept_realisations()) as f64;
    let bytes = data_bytes([pulses, n.samples, n.parts], [n.lines, n.layers]);
    let remedy = "keep fewer pulses, lines or realisations, or set it to false";
    refuse_large("outputs.signals", "signals.nc", bytes, remedy)
}

fn refuse_large_map(plan: &Plan) -> Result<(), Error> {
    let gates = plan.geometry.gate_range_m.len() as f64;
    refuse_large(
        "estimator.gate_step_samples",
        "map.nc",
        cfradial::data_bytes(plan.counts.lines, gates),
        "make it larger, or scan fewer lines",
    )?;
    let largest_s = crate::io::MAX_TIME_S;
    let last_s = plan.scan_end_s();
    if plan.wind.start_s.abs() <= largest_s && last_s <= largest_s {
        return Ok(());
    }
    Err(Error::Key {
        key: "scan.pulses_per_line",
        reason: format!(
            "the rays end {last_s:e} s after the start of the flow; files hold {largest_s:e} s"
        ),
    })
}

fn refuse_large(key: &'static str, file: &str, bytes: f64, remedy: &str) -> Result<(), Error> {
    let largest_bytes = netcdf::MAX_BYTES as f64;
    if bytes <= largest_bytes {
        return Ok(());
    }
    let reason = format!(
        "{file} would have {:.0} MB, and may have {:.0} MB: {remedy}",
        bytes / 1e6,
        largest_bytes / 1e6
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
