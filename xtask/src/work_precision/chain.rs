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
    let lacking = || Failure::new("the search tells no standard deviation of the map".into());
    let of_one = 0.5
        * found.noises.first().ok_or_else(lacking)?.now
        * (file.content.scan.realisations as f64).sqrt();
    let finest = found
        .ladders
        .iter()
        .filter_map(|ladder| Some((ladder.key, ladder.steps.first()?.value)));
    let fine = with(&file, &finest.collect::<Vec<_>>())?;
    let mut rows = Vec::new();
    for step in found
        .ladders
        .iter()
        .filter(|ladder| ladder.key == WINDOW_STEP)
        .flat_map(|ladder| &ladder.steps)
    {
        let method = match step.value {
            1.0 => "windows at every sample".into(),
            value => format!("windows {value} samples apart"),
        };
        let shift = match step.verdict {
            Verdict::Finest => Some(Shift::default()),
            // What is left of the gates tells nothing of the map.
            Verdict::Lost(_) => None,
            _ => step.shift(Figure::Std),
        };
        let counts = if shift.is_some() {
            few(&COUNTS, quick)
        } else {
            &COUNTS[..1]
        };
        rows.extend(settings(
            ["one whole map", &method, "realisations"],
            counts,
            |count| {
                let plan = Plan::new(
                    with(&fine, &[(WINDOW_STEP, step.value), (REALISATIONS, count)])?,
                    Target::Map,
                )?;
                let (_, cost) = fastest(|| Ok(run::run(&plan, &Silent)?))?;
                let Some(Shift {
                    shift,
                    error: of_shift,
                }) = shift
                else {
                    return Ok(Found::exact(f64::NAN, cost));
                };
                let error = shift.hypot(of_one / count.sqrt());
                Ok(Found {
                    error,
                    standard_error: (shift / error * of_shift).abs(),
                    cost,
                    set_up_s: 0.0,
                })
            },
        )?);
    }
    Ok(rows)
}
