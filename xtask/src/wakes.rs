//! Simulated wakes read from their files. Figures share one, which is run once for a profile and continued where it was
//! interrupted, or lies in a folder that was named. A wake is kept as long as its case and the code that computes it.
//!
//! The chapter's flow has a subgrid model and a core of 3 to 5 % of the span. What resolves that takes longer than the profile quick has:
//! it reads the cross-planes and the history of such a run that are stored with the repository, and runs a coarser flow for the surfaces,
//! as long as claims need it.
//!
//! Check: what is stored is of the case that is run here.

use crate::cause::cause;
use crate::figures::context::Context;
use crate::profile::Profile;
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use wakescope_sim::Silent;
use wakescope_sim::flow::{
    self, Begin, CaseFile, CaseKind, FileFormat, FinishedWake, FlowCase, Subgrid, WakePreset,
};
use wakescope_sim::scene::Content as _;

/// Ages of the cross-planes that are kept, for pictures that move.
const SERIES_EVERY: f64 = 0.1;
/// What computes and writes a wake.
const COMPUTED_BY: [&str; 4] = [
    "crates/les/src",
    "crates/sim/src/flow",
    "crates/sim/src/io",
    "Cargo.lock",
];
/// What `bless` calls the stored wake; where it is, and the ages of its cross-planes.
pub(crate) const NAME: &str = "wake";
const STORED: &str = "tests/reference/wake";
const STORED_TABLES: [&str; 2] = ["case.toml", "wake.csv"];
const STORED_TAU: [f64; 4] = [1.0, EARLY_TAU, 4.0, 5.0];
/// The age that figures 10 to 14 and 25 call early.
const EARLY_TAU: f64 = 2.5;
/// Age at which the claims on surfaces and short waves are decided.
const DECIDED_TAU: f64 = 2.0;
/// Folders of the wakes that this process has made: two figures must not run the same one at the same time, nor twice.
static MADE: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// The flow of the preset `fine` on a mesh of 0.5 to 0.7 core radii, with a few cross-planes alone: twenty minutes of one core.
fn stored() -> FlowCase {
    let mut case = WakePreset::Fine.case();
    case.output.fields.clear();
    if let CaseKind::Wake(flow) = &mut case.case {
        flow.cells = [32, 160, 96];
    }
    if let Some(output) = &mut case.wake {
        output.planes_tau = Some(STORED_TAU.to_vec());
        output.fields_tau = Some(Vec::new());
    }
    case
}

/// A case with whole fields and the planes of pictures that move.
fn pictured(mut case: FlowCase) -> FlowCase {
    case.output.fields = vec![FileFormat::Netcdf];
    if let Some(output) = &mut case.wake {
        output.fields_tau = None;
        output.series_tau = Some([0.0, output.end_tau]);
        output.series_every_tau = SERIES_EVERY;
    }
    case
}

/// The flow that the lidar looks at: the wake that was named, or that of the profile.
pub(crate) fn of(context: &Context) -> Result<FinishedWake, Failure> {
    match (&context.wake, context.profile) {
        (Some(folder), _) => Ok(FinishedWake::read(folder)?),
        (None, Profile::Quick) => Ok(FinishedWake::read(&root().join(STORED))?),
        (None, Profile::Standard) => run(&pictured(stored()), &context.stages, context.anew),
        (None, Profile::Full) => run(
            &pictured(WakePreset::Chapter.case()),
            &context.stages,
            context.anew,
        ),
    }
}

/// A flow with whole fields: the same, but where planes alone are stored one that is coarser.
pub(crate) fn whole(context: &Context) -> Result<FinishedWake, Failure> {
    if context.profile != Profile::Quick || context.wake.is_some() {
        return of(context);
    }
    let mut case = WakePreset::Coarse.case();
    case.solver.subgrid = Subgrid::MultiscaleWale {
        constant: None,
        order: None,
    };
    // Four cells for the shortest wave along the flight that a claim is about.
    if let CaseKind::Wake(flow) = &mut case.case {
        flow.cells = [20, 80, 50];
    }
    if let Some(output) = &mut case.wake {
        output.end_tau = DECIDED_TAU;
        output.planes_tau = Some(vec![DECIDED_TAU]);
    }
    run(&pictured(case), &context.stages, context.anew)
}

/// Mean of both vortices against tau, the left one times a sign.
pub(crate) fn mean(wake: &FinishedWake, name: &str, sign: f64) -> Result<Vec<(f64, f64)>, Failure> {
    let left = wake.curve(&format!("{name}_left"))?;
    let right = wake.curve(&format!("{name}_right"))?;
    let mut mean = Vec::new();
    for ((tau, left), (_, right)) in left.into_iter().zip(right) {
        mean.push((tau, 0.5 * (sign * left + right)));
    }
    Ok(mean)
}

/// Writes the stored wake anew.
///
/// # Errors
/// A run that fails, a folder that cannot be written.
pub(crate) fn bless() -> Outcome {
    let stages = root().join("target/figures-cache/stages");
    let from = run(&stored(), &stages, false)?.folder;
    let to = root().join(STORED);
    std::fs::create_dir_all(&to)?;
    let mut names: Vec<String> = STORED_TABLES.map(String::from).to_vec();
    for k in 1..=STORED_TAU.len() {
        names.push(format!("plane1_{k:04}.nc"));
    }
    for name in names {
        std::fs::copy(from.join(&name), to.join(&name))?;
    }
    Ok(())
}

/// A wake from the cache, or run.
pub(crate) fn run(case: &FlowCase, stages: &Path, anew: bool) -> Result<FinishedWake, Failure> {
    let file = CaseFile::parse(&case.to_toml(), Path::new("wake"))?;
    let key = cause(&root(), &[&file.hash], &COMPUTED_BY)?;
    let folder = stages.join(format!("wake-{key}"));
    let done = folder.join("done");
    {
        let mut made = MADE
            .lock()
            .map_err(|_| Failure::new("another figure failed".into()))?;
        if anew && !made.contains(&folder) && folder.exists() {
            std::fs::remove_dir_all(&folder)?;
        }
        if !done.exists() {
            // From its last good checkpoint, or anew where there is none.
            flow::run(&file, &folder, Begin::Restart, &Silent)?;
            std::fs::write(&done, &file.hash)?;
        }
        made.insert(folder.clone());
    }
    Ok(FinishedWake::read(&folder)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_computes_a_wake_is_where_it_is_said_to_be() {
        let of = |places: &[&str]| cause(&root(), &["case"], places);
        assert_ne!(of(&COMPUTED_BY).unwrap(), of(&COMPUTED_BY[..1]).unwrap());
    }

    #[test]
    fn what_is_stored_is_of_the_case_that_is_run_and_has_its_ages() {
        let stored_case = FinishedWake::read(&root().join(STORED)).unwrap().file.toml;
        let case = CaseFile::parse(&stored().to_toml(), Path::new("wake")).unwrap();
        assert_eq!(stored_case, case.toml);
    }
}
