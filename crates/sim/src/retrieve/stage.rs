//! The stage of the retrieval: what it needs, and scans too small for the test for a wake.

use crate::Error;
use crate::measure::accumulation::record_s;
use crate::plan::{Plan, PlannedStage, Stage, Target};
use crate::scene::{Retrieval, RetrievalMethod};
use wakescope_estimate::wake_detection::WakeDetector;

/// Numbers of a cell that fits hold.
const RETRIEVED_NUMBERS: f64 = 60.0;
/// Time of a fit to the estimator's response for each velocity of the map, s.
const FIT_S: f64 = 2e-4;
/// Time of a fit to signals for each sample, s.
const SIGNAL_FIT_S: f64 = 3e-4;

/// The stage of the vortices of every realisation, if the scene requests them.
///
/// # Errors
/// Fails if the test for a wake is requested of a scan of too few velocities.
pub(crate) fn planned(plan: &Plan) -> Result<Option<PlannedStage>, Error> {
    let retrieval = plan.scene().retrieval.as_ref();
    let Some(retrieval) = retrieval.filter(|_| plan.target == Target::Run) else {
        return Ok(None);
    };
    refuse_small_scan(plan, retrieval)?;
    let n = &plan.counts;
    let methods = &retrieval.methods;
    let signals = if methods.contains(&RetrievalMethod::Signals)
        || methods.contains(&RetrievalMethod::Envelope)
    {
        3.0
    } else {
        0.0
    };
    let working_bytes = n.cells * 8.0 * (n.realisations + RETRIEVED_NUMBERS)
        + signals * n.records * n.samples * n.parts * 8.0;
    let kept_bytes = n.realisations * retrieval.methods.len() as f64 * 600.0;
    let mut names = Vec::new();
    for method in &retrieval.methods {
        names.push(method.name());
    }
    let reason = format!("{} scans by {}", n.realisations, names.join(", "));
    let stage = PlannedStage::running(Stage::Retrieval, reason)
        .with_memory(working_bytes, kept_bytes, plan.fewer_points())
        .with_time(retrieval_s(plan, retrieval));
    Ok(Some(stage))
}

/// Refuses a test for a wake in a scan of too few velocities.
fn refuse_small_scan(plan: &Plan, retrieval: &Retrieval) -> Result<(), Error> {
    let velocities = plan.geometry.elevation_rad.len() * plan.geometry.gate_range_m.len();
    let needed = WakeDetector::NEEDED;
    if retrieval.false_alarm.is_none() || velocities >= needed {
        return Ok(());
    }
    Err(Error::Key {
        key: "retrieval.false_alarm",
        reason: format!(
            "the scan has {velocities} velocities: a test for a wake needs {needed} lines times gates at least, or no retrieval.false_alarm"
        ),
    })
}

/// Time of the fits and of the test for a wake, s of one core.
fn retrieval_s(plan: &Plan, retrieval: &Retrieval) -> f64 {
    let n = &plan.counts;
    // The fit of the map is made once for all that need it.
    let map_s = if retrieval.methods[..] == [RetrievalMethod::Rv] {
        n.cells * 2e-5
    } else {
        n.cells * FIT_S
    };
    let sample_s = if retrieval.methods.contains(&RetrievalMethod::Signals) {
        SIGNAL_FIT_S
    } else {
        0.0
    };
    let test_s = match retrieval.false_alarm {
        Some(_) => 3.0,
        None => 0.0,
    };
    n.realisations * (map_s + n.records * (n.samples * sample_s + record_s(plan))) + test_s
}
