//! Error against run time of the whole chain: the standard deviation of a map by the realisations of the scan and by the step between
//! windows, with the shift and the noise that `wakescope accuracy` reports.

use super::{Found, Row, few, settings};
use crate::cost::fastest;
use crate::profile::Profile;
use fixtures::failure::Failure;
use std::path::Path;
use wakescope_estimate::Measured;
use wakescope_sim::accuracy::keys::{REALISATIONS, WINDOW_STEP, with};
use wakescope_sim::accuracy::metrics::Metric;
use wakescope_sim::accuracy::{Report, Request, Setting};
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::run;
use wakescope_sim::scene::SceneFile;

/// Realisations of the scan.
const COUNTS: [f64; 6] = [2.0, 4.0, 8.0, 16.0, 32.0, 64.0];

/// All measurements; few realisations unless `profile` is full.
pub(super) fn rows(profile: Profile) -> Result<Vec<Row>, Failure> {
    let file = SceneFile::parse(include_str!("chain.toml"), Path::new("chain.toml"))?;
    let request = Request {
        within: 0.03,
        of: vec![Metric::Std],
    };
    let report = Report::of_scene(&file, &request, &Silent)?;
    let given = setting(&report, REALISATIONS)?
        .given_row()
        .ok_or_else(|| lacking(REALISATIONS))?;
    let noise = given
        .shift(Metric::Std)
        .ok_or_else(|| lacking(REALISATIONS))?;
    let of_one = noise.std * given.value.sqrt();
    let mut rows = Vec::new();
    for row in &setting(&report, WINDOW_STEP)?.rows {
        // The gates that are left say nothing of the map.
        let shift = row.shift(Metric::Std).filter(|_| row.is_usable());
        rows.extend(rows_of_step(&file, row.value, shift, of_one, profile)?);
    }
    Ok(rows)
}

/// The map with windows some samples apart, by the number of realisations; errors are the shift of the step and the noise of the
/// realisations, of which one has the noise `of_one`.
fn rows_of_step(
    file: &SceneFile,
    step: f64,
    shift: Option<Measured>,
    of_one: f64,
    profile: Profile,
) -> Result<Vec<Row>, Failure> {
    let method = if step == 1.0 {
        "windows at every sample".into()
    } else {
        format!("windows {step} samples apart")
    };
    let counts = if shift.is_some() {
        few(&COUNTS, profile)
    } else {
        &COUNTS[..1]
    };
    let spaced = with(file, WINDOW_STEP, step)?;
    settings(
        ["one whole map", &method, "realisations"],
        counts,
        |count| {
            let plan = Plan::new(with(&spaced, REALISATIONS, count)?, Target::Map)?;
            let (_, cost) = fastest(|| Ok(run::run(&plan, &Silent)?))?;
            let Some(shift) = shift else {
                return Ok(Found::exact(f64::NAN, cost));
            };
            let error = shift.value.hypot(of_one / count.sqrt());
            Ok(Found {
                error,
                standard_error: (shift.value / error * shift.std).abs(),
                cost,
                set_up_s: 0.0,
            })
        },
    )
}

fn setting<'r>(report: &'r Report, key: &'static str) -> Result<&'r Setting, Failure> {
    let mut settings = report.settings.iter();
    settings
        .find(|setting| setting.key == key)
        .ok_or_else(|| lacking(key))
}

fn lacking(key: &str) -> Failure {
    Failure::new(format!("the report has no standard deviation for {key}"))
}
