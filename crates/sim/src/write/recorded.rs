//! The files of velocities from recorded signals.
//! Check: those of a run's own signals have the bytes of the run.

#[cfg(feature = "plots")]
use super::pictures;
use super::{add_halo, provenance, put, scene_text};
use crate::Error;
use crate::io::{Existing, FileGroup, VelocityMap, tables};
use crate::measure::recorded::{Recorded, measured_map, predicted_table};
use crate::plan::{Plan, Stage};
use crate::run::RunResult;
use std::path::{Path, PathBuf};

const SPECTRA: &str = "spectra.nc";
const PREDICTED: &str = "predicted.csv";

/// Names of the files that estimates from records may have.
pub fn recorded_names(plan: &Plan) -> Vec<String> {
    let of_run = super::names(plan).into_iter().filter(|name| !name.starts_with("signals."));
    debug_assert!(plan.runs(Stage::Estimates));
    of_run.chain([SPECTRA, PREDICTED].map(str::to_owned)).collect()
}

/// Writes what records gave; returns the paths of the files.
///
/// # Errors
/// As [`super::write`].
pub fn write_recorded(plan: &Plan, found: Recorded, folder: &Path, existing: Existing) -> Result<Vec<PathBuf>, Error> {
    let origin = provenance(plan);
    let outputs = &plan.scene.scene.outputs;
    let (mut files, spectra) = match found {
        Recorded::OfRun { map, spectra } => {
            let predicted = predicted_table(plan, &map)?;
            let result = RunResult { map: Some(*map), ..RunResult::default() };
            let mut files = super::files(plan, &result, folder)?;
            if outputs.csv {
                files.add(PREDICTED, predicted.to_csv(&origin)?)?;
            }
            (files, spectra)
        }
        Recorded::Measured { scans, spectra } => {
            let map = measured_map(plan, &scans)?;
            drop(scans);
            let mut files = FileGroup::new(folder);
            files.add("scene.toml", scene_text(&origin))?;
            add_map(&mut files, plan, &map)?;
            (files, spectra)
        }
    };
    #[cfg(feature = "netcdf")]
    if let Some(spectra) = &spectra {
        files.add(SPECTRA, crate::io::cf_spectra::cf_spectra_bytes(spectra, &origin)?)?;
    }
    #[cfg(not(feature = "netcdf"))]
    let _ = (&mut files, spectra);
    put(files, folder, existing)
}

/// The map in the formats that the scene asks for.
fn add_map(files: &mut FileGroup, plan: &Plan, map: &VelocityMap) -> Result<(), Error> {
    let (outputs, origin) = (&plan.scene.scene.outputs, provenance(plan));
    if outputs.csv {
        files.add("map.csv", tables::map_table(map)?.to_csv(&origin)?)?;
    }
    #[cfg(feature = "netcdf")]
    if outputs.netcdf {
        files.add("map.nc", crate::io::cfradial::cfradial_bytes(map, &origin)?)?;
    }
    add_halo(files, plan, map, &origin)?;
    #[cfg(feature = "plots")]
    pictures::add_measured(files, plan, map, &origin)?;
    Ok(())
}
