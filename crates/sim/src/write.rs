//! Writes what a run gives, and what recorded signals gave: all files appear together, or none.
//! Check: files of a run's own signals have the bytes of the run.

mod limits;
mod map;
#[cfg(feature = "plots")]
mod pictures;
pub(crate) mod stage;

pub use map::velocity_map;

use crate::Error;

use crate::io::signals::RawSignals;
use crate::io::{Existing, Table, VelocityMap, hpl, tables};
use crate::measure::profile::RangeProfile;
use crate::measure::recorded::{Recorded, Spectra, measured_map, predicted_table};
use crate::outputs::Outputs;
use crate::plan::{Plan, Stage, Target};
use crate::run::RunResult;
#[cfg(feature = "plots")]
use crate::scene::Pattern;
use crate::scene::{DetectorSignal, NoiseModel};
use crate::wind::{WindOptions, table_with_truth, winds_of_map};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Names of the files that a plan will write.
///
/// # Errors
/// As [`write()`], but for what the files hold.
pub fn names(plan: &Plan) -> Result<Vec<String>, Error> {
    Outputs::names(plan.scene().outputs, |files| {
        list(plan, &RunResult::default(), files)
    })
}

/// Writes the results that the plan's scene asks for; returns the paths of the files.
///
/// # Errors
/// A result that a format cannot hold, a file in the way that may not be replaced, or what the system says. Nothing is
/// left half-written.
pub fn write(
    plan: &Plan,
    result: &RunResult,
    folder: &Path,
    existing: Existing,
) -> Result<Vec<PathBuf>, Error> {
    let formats = plan.scene().outputs;
    Outputs::write(
        folder,
        existing,
        (formats, plan.file.provenance()),
        |files| list(plan, result, files),
    )
}

/// The files of a run.
pub(crate) fn list(plan: &Plan, result: &RunResult, files: &mut Outputs) -> Result<(), Error> {
    files.add(
        "scene.toml",
        Some(plan),
        |_, origin| Ok(origin.scene_file()),
    )?;
    if matches!(plan.target, Target::Run | Target::Efficiency) {
        let profile = result.profile.as_ref();
        files.table("profile", profile, |profile| Ok(profile_table(profile)))?;
        #[cfg(feature = "plots")]
        files.figure("profile", profile, |profile| {
            Ok(pictures::profile(plan, profile))
        })?;
    }
    if plan.runs(Stage::CrossPlane) {
        let plane = result.plane.as_ref();
        files.table("flow", plane, tables::planes_table)?;
        files.netcdf("flow", plane, |plane, origin| {
            crate::io::cf_planes::cf_planes_bytes(plane, origin)
        })?;
    }
    if plan.kept_realisations() > 0 {
        let signals = raw_signals(plan, result);
        files.netcdf("signals", signals.as_ref(), |signals, origin| {
            crate::io::cf_signals::cf_signals_bytes(signals, origin)
        })?;
    }
    if plan.runs(Stage::Estimates) {
        list_estimates(plan, result, files)?;
    }
    if plan.runs(Stage::Retrieval) {
        files.table("retrieval", result.retrieval.as_ref(), |found| {
            Ok(found.table())
        })?;
        files.table("retrieval_summary", result.retrieval.as_ref(), |found| {
            Ok(found.error_table())
        })?;
    }
    Ok(())
}

/// The files of the estimates of a run: the map, winds of its beams, pictures.
fn list_estimates(plan: &Plan, result: &RunResult, files: &mut Outputs) -> Result<(), Error> {
    let pattern = &plan.scene().scan.pattern;
    let estimates = result.map.as_ref();
    let map = estimates.map(|estimates| velocity_map(plan, estimates));
    list_map(plan, map.as_ref(), files)?;
    let mut winds = None;
    if pattern.has_beam_winds() {
        if let Some(map) = &map {
            winds = Some(winds_of_map(
                plan,
                map,
                &WindOptions::of_scene(plan.scene())?,
            )?);
        }
        files.table("wind", winds.as_ref(), |winds| Ok(table_with_truth(winds)))?;
    }
    #[cfg(feature = "plots")]
    files.figure("map", map.as_ref(), |map| {
        pictures::map(plan, map, winds.as_ref())
    })?;
    #[cfg(feature = "plots")]
    if *pattern != Pattern::default() {
        files.figure("scan", map.as_ref(), |_| Ok(pictures::scan(plan)))?;
    }
    Ok(())
}

/// Names of the files that estimates from records may have.
///
/// # Errors
/// As [`write()`], but for what the files hold.
pub fn recorded_names(plan: &Plan) -> Result<Vec<String>, Error> {
    let mut names = Outputs::names(plan.scene().outputs, |files| {
        of_run(plan, &RunResult::default(), None, files)
    })?;
    // Those that are estimated stay where they are.
    names.retain(|name| !name.starts_with("signals."));
    Ok(names)
}

/// The files of what records gave.
pub(crate) fn list_recorded(
    plan: &Plan,
    found: Recorded,
    files: &mut Outputs,
) -> Result<(), Error> {
    match found {
        Recorded::OfRun { map, spectra } => of_run(
            plan,
            &RunResult {
                map: Some(*map),
                ..RunResult::default()
            },
            spectra,
            files,
        ),
        Recorded::Measured { scans, spectra } => {
            let map = measured_map(plan, &scans)?;
            drop(scans);
            files.add(
                "scene.toml",
                Some(plan),
                |_, origin| Ok(origin.scene_file()),
            )?;
            list_map(plan, Some(&map), files)?;
            #[cfg(feature = "plots")]
            files.figure("map", Some(&map), pictures::measured)?;
            list_spectra(spectra, files)
        }
    }
}

/// Of signals whose truth is known: what a run gives, and what is predicted of its errors.
fn of_run(
    plan: &Plan,
    result: &RunResult,
    spectra: Option<Spectra>,
    files: &mut Outputs,
) -> Result<(), Error> {
    list(plan, result, files)?;
    files.table("predicted", result.map.as_ref(), |map| {
        predicted_table(plan, map)
    })?;
    list_spectra(spectra, files)
}

fn list_spectra(spectra: Option<Spectra>, files: &mut Outputs) -> Result<(), Error> {
    files.add("spectra.nc", spectra.as_ref(), |spectra, origin| {
        crate::io::cf_spectra::cf_spectra_bytes(spectra, origin)
    })
}

/// A map as tables, CfRadial and HALO files.
fn list_map(plan: &Plan, map: Option<&VelocityMap>, files: &mut Outputs) -> Result<(), Error> {
    let schedule = &plan.geometry.schedule;
    let modes = schedule.modes();
    files.table("map", map, tables::map_table)?;
    for mode in &modes {
        // Readers take the kind of a CfRadial file from its first sweep: one for each kind.
        let (stem, own) = match modes.len() {
            1 => ("map".to_owned(), map.map(Cow::Borrowed)),
            _ => (
                format!("map_{}", mode.name()),
                map.map(|map| Cow::Owned(map.of_mode(*mode))),
            ),
        };
        if modes.len() > 1 {
            files.table(&stem, own.as_deref(), tables::map_table)?;
        }
        files.netcdf(&stem, own.as_deref(), |map, origin| {
            crate::io::cfradial::cfradial_bytes(map, origin)
        })?;
    }
    let sweeps = map.map_or(schedule.sweeps.len(), |map| map.sweeps.len());
    for sweep in (0..sweeps).filter(|_| plan.scene().outputs.hpl) {
        let stem = if sweeps == 1 {
            "halo".to_owned()
        } else {
            format!("halo_{:04}", sweep + 1)
        };
        let name = format!("{stem}.hpl");
        files.add(&name, map, |map, _| hpl::hpl_bytes(map, sweep, &name))?;
        files.table(&stem, map, |map| hpl::hpl_table(map, sweep))?;
    }
    Ok(())
}

/// Writes a picture of the set-up: lidar, lines of sight, ground, vortices. The ending of the path says whether SVG or PNG.
///
/// # Errors
/// [`Error::Input`] for another ending; an existing file that may not be replaced, or what the system says.
#[cfg(feature = "plots")]
pub fn write_set_up(plan: &Plan, path: &Path, existing: Existing) -> Result<(), Error> {
    let figure = pictures::scan(plan);
    let origin = plan.file.provenance();
    let bytes = match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => figure.svg(&origin)?.into_bytes(),
        Some("png") => figure.png(&origin)?,
        _ => {
            let reason = "a picture ends in .svg or .png, such as set-up.svg";
            return Err(Error::input(path, reason));
        }
    };
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    existing.check(folder, [name.as_ref()])?;
    crate::io::write_atomic(path, bytes)
}

/// Efficiency and SNR as a table.
pub fn profile_table(profile: &RangeProfile) -> Table {
    let e = &profile.efficiency;
    let mut table = Table::new()
        .float("range_m", e.range_m.clone())
        .float("efficiency", e.mean.clone())
        .float(
            "efficiency_standard_deviation",
            e.standard_deviation.clone(),
        )
        .float("efficiency_standard_error", e.standard_error.clone())
        .float("snr_db", profile.snr_db.clone());
    for (name, other) in &profile.others {
        table = table.float(name, other.mean.clone());
        if other.standard_error.iter().any(|&error| error > 0.0) {
            let name = format!("{name}_standard_error");
            table = table.float(&name, other.standard_error.clone());
        }
    }
    table
}

/// The raw signals of a run, with what makes them readable.
fn raw_signals<'a>(plan: &Plan, result: &'a RunResult) -> Option<RawSignals<'a>> {
    let scene = plan.scene();
    let g = &plan.geometry;
    let mut pulse_time_s = Vec::with_capacity(g.schedule.pulses());
    let mut elevation_rad = Vec::with_capacity(g.schedule.pulses());
    let mut azimuth_rad = Vec::new();
    for pulse in 0..g.schedule.pulses() {
        let beam = g.schedule.beam_of_pulse(pulse);
        pulse_time_s.push(plan.wind.start_s + beam.time_s);
        elevation_rad.push(beam.elevation_rad);
        if !g.schedule.is_plane() {
            azimuth_rad.push(beam.azimuth_rad);
        }
    }
    let detector = &scene.detector;
    let first_s = 2.0 * scene.scan.range_min_m / crate::SPEED_OF_LIGHT_M_S;
    let mut first_pulse = Vec::with_capacity(g.schedule.lines.len());
    for line in &g.schedule.lines {
        first_pulse.push(line.first);
    }
    let mut time_s = Vec::with_capacity(g.samples);
    for sample in 0..g.samples {
        time_s.push(first_s + sample as f64 / detector.sampling_hz);
    }
    Some(RawSignals {
        sampling_hz: detector.sampling_hz,
        intermediate_frequency_hz: match detector.signal {
            DetectorSignal::Baseband => 0.0,
            _ => detector.intermediate_frequency_hz,
        },
        bandwidth_hz: detector.bandwidth_hz,
        wavelength_m: scene.laser.wavelength_m,
        pulse_repetition_hz: scene.laser.pulse_repetition_hz,
        pulse_sigma_s: scene.pulse_sigma_s(),
        noise_power_a2: noise_power_a2(plan),
        range_m: g.layer_range_m().collect(),
        radial_velocity_m_s: result.line_velocity_m_s.as_ref()?.view(),
        pulse_time_s,
        current_a: result.signals_a.as_ref()?.view(),
        quadrature_a: result.quadrature_a.as_ref().map(|values| values.view()),
        elevation_rad,
        azimuth_rad,
        time_s,
        first_pulse,
    })
}

/// Mean square of the noise of a sample before the converter, of both quadratures together, A^2.
fn noise_power_a2(plan: &Plan) -> f64 {
    let detector = &plan.scene().detector;
    let is_baseband = detector.signal == DetectorSignal::Baseband;
    // (13) in the band; white noise goes to half the sampling frequency, and to both sides of zero in two quadratures.
    let noise_band_hz = match detector.noise {
        NoiseModel::None => 0.0,
        NoiseModel::BandLimited => detector.bandwidth_hz,
        NoiseModel::White if is_baseband => detector.sampling_hz,
        NoiseModel::White => 0.5 * detector.sampling_hz,
    };
    plan.instrument.receiver.noise_density_a2_hz() * noise_band_hz
}
