//! Error against run time of the whole chain: the standard deviation of a map by the realisations of the scan and by the step between
//! windows, as `wakescope accuracy` tells its shift and its noise.

use super::{Found, Row, few, settings};
use crate::cost::fastest;
use fixtures::failure::Failure;
use std::path::Path;
use wakescope_sim::accuracy::figures::{Figure, Shift};
use wakescope_sim::accuracy::keys::{REALISATIONS, WINDOW_STEP, with};
use wakescope_sim::accuracy::ladder::Verdict;
use wakescope_sim::accuracy::{Accuracy, Request};
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::run;
use wakescope_sim::scene::SceneFile;
use wakescope_sim::setup::progress::Silent;

/// Realisations of the scan.
const COUNTS: [f64; 6] = [2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// Target of the search, a relative error, and what it may take in runs of the scene: enough that every step is looked at.
const SEARCH: (f64, f64) = (0.03, 100.0);

/// All measurements; few realisations if `quick`.
pub(super) fn rows(quick: bool) -> Result<Vec<Row>, Failure> {
    let file = SceneFile::parse(include_str!("chain.toml"), Path::new("chain.toml"))?;
    let request = Request {
        budget: SEARCH.1,
        ..Request::new(SEARCH.0, &[Figure::Std])
    };
    let found = Accuracy::of(&file, &request, &Silent)?;
    let noise = found.noises.first().ok_or_else(|| {
        Failure::new("the search reports no standard deviation of the map".into())
    })?;
    let realisations = file.content.scan.realisations as f64;
    let of_one = 0.5 * noise.now * realisations.sqrt();
    let mut finest = Vec::new();
    for ladder in &found.ladders {
        if let Some(step) = ladder.steps.first() {
            finest.push((ladder.key, step.value));
        }
    }
    let fine = with(&file, &finest)?;
    let mut rows = Vec::new();
    for ladder in found
        .ladders
        .iter()
        .filter(|ladder| ladder.key == WINDOW_STEP)
    {
        for step in &ladder.steps {
            let shift = match step.verdict {
                Verdict::Finest => Some(Shift::default()),
                // What is left of the gates tells nothing of the map.
                Verdict::Lost(_) => None,
                _ => step.shift(Figure::Std),
            };
            rows.extend(rows_of_step(&fine, step.value, shift, of_one, quick)?);
        }
    }
    Ok(rows)
}

/// The map with windows some samples apart, by the number of realisations; errors are the shift of the step and the noise of the
/// realisations, of which one has the noise `of_one`.
fn rows_of_step(
    fine: &SceneFile,
    step: f64,
    shift: Option<Shift>,
    of_one: f64,
    quick: bool,
) -> Result<Vec<Row>, Failure> {
    let method = if step == 1.0 {
        "windows at every sample".into()
    } else {
        format!("windows {step} samples apart")
    };
    let counts = if shift.is_some() {
        few(&COUNTS, quick)
    } else {
        &COUNTS[..1]
    };
    settings(
        ["one whole map", &method, "realisations"],
        counts,
        |count| {
            let scene = with(fine, &[(WINDOW_STEP, step), (REALISATIONS, count)])?;
            let plan = Plan::new(scene, Target::Map)?;
            let (_, cost) = fastest(|| Ok(run::run(&plan, &Silent)?))?;
            let Some(shift) = shift else {
                return Ok(Found::exact(f64::NAN, cost));
            };
            let error = shift.shift.hypot(of_one / count.sqrt());
            Ok(Found {
                error,
                standard_error: (shift.shift / error * shift.error).abs(),
                cost,
                set_up_s: 0.0,
            })
        },
    )
}
