//! The files of velocities from recorded signals.
//! Check: those of a run's own signals have the bytes of the run.

#[cfg(feature = "plots")]
use super::pictures;
use super::{list, list_map};
use crate::Error;
use crate::io::Existing;
use crate::measure::recorded::{Recorded, Spectra, measured_map, predicted_table};
use crate::outputs::Outputs;
use crate::plan::Plan;
use crate::run::RunResult;
use std::path::{Path, PathBuf};

/// Names of the files that estimates from records may have.
///
/// # Errors
/// As [`super::write`], but for what the files hold.
pub fn recorded_names(plan: &Plan) -> Result<Vec<String>, Error> {
    let mut names = Outputs::names(plan.scene.scene.outputs, |files| of_run(plan, &RunResult::default(), None, files))?;
    // Those that are estimated stay where they are.
    names.retain(|name| !name.starts_with("signals."));
    Ok(names)
}

/// Writes what records gave; returns the paths of the files.
///
/// # Errors
/// As [`super::write`].
pub fn write_recorded(plan: &Plan, found: Recorded, folder: &Path, existing: Existing) -> Result<Vec<PathBuf>, Error> {
    let of = (plan.scene.scene.outputs, plan.scene.provenance());
    Outputs::write(folder, existing, of, |files| list_recorded(plan, found, files))
}

/// The files of what records gave.
pub(crate) fn list_recorded(plan: &Plan, found: Recorded, files: &mut Outputs) -> Result<(), Error> {
    match found {
        Recorded::OfRun { map, spectra } => {
            of_run(plan, &RunResult { map: Some(*map), ..RunResult::default() }, spectra, files)
        }
        Recorded::Measured { scans, spectra } => {
            let map = measured_map(plan, &scans)?;
            drop(scans);
            files.add("scene.toml", Some(plan), |_, origin| Ok(origin.scene_file()))?;
            list_map(plan, Some(&map), files)?;
            #[cfg(feature = "plots")]
            files.figure("map", Some(&map), pictures::measured)?;
            list_spectra(spectra, files)
        }
    }
}

/// Of signals whose truth is known: what a run gives, and what is predicted of its errors.
fn of_run(plan: &Plan, result: &RunResult, spectra: Option<Spectra>, files: &mut Outputs) -> Result<(), Error> {
    list(plan, result, files)?;
    files.table("predicted", result.map.as_ref(), |map| predicted_table(plan, map))?;
    list_spectra(spectra, files)
}

fn list_spectra(spectra: Option<Spectra>, files: &mut Outputs) -> Result<(), Error> {
    files.add("spectra.nc", spectra.as_ref(), |spectra, origin| {
        Ok(crate::io::cf_spectra::cf_spectra_bytes(spectra, origin)?)
    })
}
