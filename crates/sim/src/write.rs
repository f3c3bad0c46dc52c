//! Writes what a run gives: all files of a run appear together, or none.

mod map;
#[cfg(feature = "plots")]
mod pictures;
mod recorded;

pub use map::velocity_map;
pub use recorded::{recorded_names, write_recorded};

use crate::Error;
#[cfg(feature = "plots")]
use crate::io::OutputError;
use crate::io::atomic::try_folder;
use crate::io::lock::FolderLock;
use crate::io::own::refuse_foreign;
use crate::io::signals::{LineVelocities, RawSignals, Recording};
use crate::io::{Existing, FileGroup, Provenance, Table, VelocityMap, hpl, tables};
use crate::measure::beam_winds;
use crate::measure::profile::RangeProfile;
use crate::plan::{Plan, Stage, Target};
use crate::run::RunResult;
use crate::scene::{DetectorSignal, NoiseKind, Pattern, SceneFile};
use crate::setup::beams::{Schedule, SweepMode};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Names of the CfRadial files: one for each kind of sweep.
fn map_stems(scan: &Schedule) -> Vec<String> {
    let mut modes: Vec<SweepMode> = Vec::new();
    for (mode, _) in &scan.sweeps {
        if !modes.contains(mode) {
            modes.push(*mode);
        }
    }
    match modes.len() {
        0 | 1 => vec!["map".into()],
        _ => modes.iter().map(|mode| format!("map_{}", mode.name())).collect(),
    }
}

/// Names of the HALO files, one for each sweep; their tables have the same.
fn halo_stems(sweeps: usize) -> Vec<String> {
    match sweeps {
        0 | 1 => vec!["halo".into()],
        _ => (1..=sweeps).map(|sweep| format!("halo_{sweep:04}")).collect(),
    }
}

/// The sweeps of a map as HALO files, each with its table, where the scene asks for them.
fn add_halo(files: &mut FileGroup, plan: &Plan, map: &VelocityMap, origin: &Provenance) -> Result<(), Error> {
    let outputs = &plan.scene.scene.outputs;
    for (sweep, stem) in halo_stems(map.sweeps.len()).iter().enumerate().filter(|_| outputs.hpl) {
        let name = format!("{stem}.hpl");
        files.add(&name, hpl::hpl_bytes(map, sweep, &name)?)?;
        if outputs.csv {
            files.add(&format!("{stem}.csv"), hpl::hpl_table(map, sweep)?.to_csv(origin)?)?;
        }
    }
    Ok(())
}

/// Finds out, before any computing, whether files of these names can be written to a folder; leaves no trace.
///
/// # Errors
/// The folder cannot be made, is a file, cannot be written to, or another run writes to it; a folder is in the way of a file,
/// or a file that this program did not write and may not replace.
pub fn prepare<'a>(folder: &Path, names: impl IntoIterator<Item = &'a str>, existing: Existing) -> Result<(), Error> {
    prepare_among_others(folder, names, existing, || Ok(FolderLock::take(folder).map(drop)?))
}

/// [`prepare`] for a folder to which several processes may write, each its own files: what else must hold is the caller's.
///
/// # Errors
/// As [`prepare`], and what the caller finds.
pub(crate) fn prepare_among_others<'a>(
    folder: &Path,
    names: impl IntoIterator<Item = &'a str>,
    existing: Existing,
    also: impl FnOnce() -> Result<(), Error>,
) -> Result<(), Error> {
    refuse_foreign(folder, names, existing)?;
    let missing: Vec<&Path> =
        folder.ancestors().filter(|p| !p.as_os_str().is_empty()).take_while(|p| !p.exists()).collect();
    let made = std::fs::create_dir_all(folder);
    let made = made.map_err(|source| Error::Io { action: "make the folder", path: folder.to_owned(), source });
    let tried = made.and_then(|()| {
        try_folder(folder)?;
        also()
    });
    for path in missing {
        // Innermost first; one that was not made cannot be removed, which is what is wanted.
        let _ = std::fs::remove_dir(path);
    }
    tried
}

/// Names of the files that a plan will write.
pub fn names(plan: &Plan) -> Vec<String> {
    let o = &plan.scene.scene.outputs;
    let mut out = vec!["scene.toml".to_owned()];
    let mut add = |stem: &str, kinds: &[(bool, &str)]| {
        out.extend(kinds.iter().filter(|kind| kind.0).map(|kind| format!("{stem}.{}", kind.1)));
    };
    let (netcdf, plots) = (o.netcdf && cfg!(feature = "netcdf"), cfg!(feature = "plots"));
    let pictures = [(o.svg && plots, "svg"), (o.png && plots, "png")];
    if matches!(plan.target, Target::Run | Target::Efficiency) {
        add("profile", &[(o.csv, "csv"), pictures[0], pictures[1]]);
    }
    if plan.runs(Stage::CrossPlane) {
        add("flow", &[(o.csv, "csv"), (netcdf, "nc")]);
    }
    if plan.keeps_signals() {
        add("signals", &[(o.csv, "csv"), (netcdf, "nc")]);
    }
    if plan.runs(Stage::Estimates) {
        add("map", &[(o.csv, "csv")]);
        for stem in map_stems(&plan.geometry.schedule) {
            add(&stem, &[(o.csv && stem != "map", "csv"), (netcdf, "nc")]);
        }
        add("map", &[pictures[0], pictures[1]]);
        for stem in halo_stems(plan.geometry.schedule.sweeps.len()) {
            add(&stem, &[(o.hpl, "hpl"), (o.hpl && o.csv, "csv")]);
        }
        let pattern = &plan.scene.scene.scan.pattern;
        let tells_wind = matches!(pattern, Pattern::Vad(_) | Pattern::Dbs(_));
        add("wind", &[(o.csv && tells_wind, "csv")]);
        let plans = *pattern != Pattern::default();
        add("scan", &[(pictures[0].0 && plans, "svg"), (pictures[1].0 && plans, "png")]);
    }
    if plan.runs(Stage::Retrieval) {
        add("retrieval", &[(o.csv, "csv")]);
        add("retrieval_summary", &[(o.csv, "csv")]);
    }
    out
}

/// Writes the results that the plan's scene asks for; returns the paths of the files.
///
/// # Errors
/// A result that a format cannot hold, a file in the way that may not be replaced, or what the system says. Nothing is
/// left half-written.
pub fn write(plan: &Plan, result: &RunResult, folder: &Path, existing: Existing) -> Result<Vec<PathBuf>, Error> {
    put(files(plan, result, folder)?, folder, existing)
}

/// Writes a picture of the set-up: lidar, lines of sight, ground, vortices. The ending of the path says whether SVG or PNG.
///
/// # Errors
/// [`Error::Input`] for another ending; a file in the way that this program did not write, or what the system says.
#[cfg(feature = "plots")]
pub fn write_set_up(plan: &Plan, path: &Path) -> Result<(), Error> {
    let (figure, origin) = (pictures::scan(plan), provenance(plan));
    let bytes = match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => figure.svg(&origin)?.into_bytes(),
        Some("png") => figure.png(&origin)?,
        _ => {
            let reason = "a picture ends in .svg or .png, such as set-up.svg".into();
            return Err(Error::Input { path: path.to_owned(), reason });
        }
    };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    refuse_foreign(folder, [name.as_ref()], Existing::Own).map_err(|error| match error {
        OutputError::Foreign { path } => {
            let reason = "it was not written by this program, or was changed since: name another file".into();
            Error::Input { path, reason }
        }
        other => other.into(),
    })?;
    Ok(crate::io::write_atomic(path, bytes)?)
}

/// The files of a run, still in memory.
pub(crate) fn files(plan: &Plan, result: &RunResult, folder: &Path) -> Result<FileGroup, Error> {
    let outputs = &plan.scene.scene.outputs;
    let origin = provenance(plan);
    let mut files = FileGroup::new(folder);
    files.add("scene.toml", scene_text(&origin))?;
    if let Some(profile) = &result.profile {
        if outputs.csv {
            files.add("profile.csv", profile_table(profile).to_csv(&origin)?)?;
        }
        #[cfg(feature = "plots")]
        pictures::add(&mut files, plan, "profile", &pictures::profile(plan, profile), &origin)?;
    }
    if let Some(plane) = &result.plane {
        if outputs.csv {
            files.add("flow.csv", tables::planes_table(plane)?.to_csv(&origin)?)?;
        }
        #[cfg(feature = "netcdf")]
        if outputs.netcdf {
            files.add("flow.nc", crate::io::cf_planes::cf_planes_bytes(plane, &origin)?)?;
        }
    }
    if let Some(signals) = raw_signals(plan, result) {
        if outputs.csv {
            files.add("signals.csv", signals.table()?.to_csv(&origin)?)?;
        }
        #[cfg(feature = "netcdf")]
        if outputs.netcdf {
            files.add("signals.nc", crate::io::cf_signals::cf_signals_bytes(&signals, &origin)?)?;
        }
    }
    if let Some(estimates) = &result.map {
        let map = velocity_map(plan, estimates);
        if outputs.csv {
            files.add("map.csv", tables::map_table(&map)?.to_csv(&origin)?)?;
        }
        let stems = map_stems(&plan.geometry.schedule);
        for (stem, mode) in stems.iter().zip(map.modes()) {
            // Readers take the kind of a file from its first sweep.
            let own = if stems.len() == 1 { Cow::Borrowed(&map) } else { Cow::Owned(map.of_mode(mode)) };
            if outputs.csv && stems.len() > 1 {
                files.add(&format!("{stem}.csv"), tables::map_table(&own)?.to_csv(&origin)?)?;
            }
            #[cfg(feature = "netcdf")]
            if outputs.netcdf {
                files.add(&format!("{stem}.nc"), crate::io::cfradial::cfradial_bytes(&own, &origin)?)?;
            }
        }
        add_halo(&mut files, plan, &map, &origin)?;
        let winds = beam_winds::beam_winds(plan, estimates)?;
        if let Some(winds) = winds.as_deref().filter(|_| outputs.csv) {
            files.add("wind.csv", beam_winds::table(winds).to_csv(&origin)?)?;
        }
        #[cfg(feature = "plots")]
        {
            pictures::add_map(&mut files, plan, &map, winds.as_deref(), &origin)?;
            if plan.scene.scene.scan.pattern != Pattern::default() {
                pictures::add(&mut files, plan, "scan", &pictures::scan(plan), &origin)?;
            }
        }
    }
    if let Some(retrieval) = result.retrieval.as_ref().filter(|_| outputs.csv) {
        files.add("retrieval.csv", retrieval.table().to_csv(&origin)?)?;
        files.add("retrieval_summary.csv", retrieval.error_table().to_csv(&origin)?)?;
    }
    Ok(files)
}

/// Puts the files of a run into their folder, where no other run may be writing.
pub(crate) fn put(files: FileGroup, folder: &Path, existing: Existing) -> Result<Vec<PathBuf>, Error> {
    let there = folder.exists();
    let lock = there.then(|| FolderLock::take(folder)).transpose()?;
    // Again: a file may have come while the run computed.
    let names: Vec<String> = files.names().map(str::to_owned).collect();
    refuse_foreign(folder, names.iter().map(String::as_str), existing)?;
    let written = files.commit()?;
    drop(lock);
    Ok(written)
}

/// Where the files of a run come from.
pub fn provenance(plan: &Plan) -> Provenance {
    provenance_of(Some(&plan.scene))
}

/// The same of a scene that may be unknown.
pub(crate) fn provenance_of(scene: Option<&SceneFile>) -> Provenance {
    Provenance {
        program: crate::PROGRAM.into(),
        scene_toml: scene.map_or_else(String::new, |scene| scene.toml.clone()),
        scene_hash: scene.map_or_else(String::new, |scene| scene.hash.clone()),
        seed: scene.map_or(0, |scene| scene.scene.seed),
    }
}

/// The scene with every default written out: running it again gives the same files.
pub(crate) fn scene_text(origin: &Provenance) -> String {
    format!("# {}, scene {}\n{}", origin.program, origin.scene_hash, origin.scene_toml)
}

/// Efficiency and SNR as a table.
pub fn profile_table(profile: &RangeProfile) -> Table {
    let e = &profile.efficiency;
    let table = Table::new()
        .float("range_m", e.range_m.clone())
        .float("efficiency", e.mean.clone())
        .float("efficiency_standard_deviation", e.standard_deviation.clone())
        .float("efficiency_standard_error", e.standard_error.clone())
        .float("snr_db", profile.snr_db.clone());
    profile.others.iter().fold(table, |table, (name, other)| {
        let table = table.float(name, other.mean.clone());
        match other.standard_error.iter().any(|&error| error > 0.0) {
            true => table.float(&format!("{name}_standard_error"), other.standard_error.clone()),
            false => table,
        }
    })
}

/// The raw signals of a run, with what makes them readable.
fn raw_signals<'a>(plan: &Plan, result: &'a RunResult) -> Option<RawSignals<'a>> {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    let all = || (0..g.schedule.pulses()).map(|pulse| (g.schedule.line_of(pulse), pulse));
    let beam = |(line, pulse): (usize, usize)| g.schedule.beam_of_pulse(line, pulse - g.schedule.lines[line].first);
    let is_plane = g.schedule.is_plane();
    let first_s = 2.0 * g.first_range_m / crate::SPEED_OF_LIGHT_M_S;
    let first_pulse_s = plan.wind.start_s;
    Some(RawSignals {
        recording: recording(plan),
        truth: LineVelocities {
            range_m: g.layer_range_m().collect(),
            radial_velocity_m_s: result.line_velocity_m_s.as_ref()?.view(),
        },
        pulse_time_s: all().map(|at| first_pulse_s + beam(at).time_s).collect(),
        current_a: result.signals_a.as_ref()?.view(),
        quadrature_a: result.quadrature_a.as_ref().map(|values| values.view()),
        elevation_rad: all().map(|at| beam(at).elevation_rad).collect(),
        azimuth_rad: if is_plane { Vec::new() } else { all().map(|at| beam(at).azimuth_rad).collect() },
        time_s: (0..g.samples).map(|k| first_s + k as f64 / scene.detector.sampling_hz).collect(),
        first_pulse: g.schedule.lines.iter().map(|line| line.first).collect(),
    })
}

fn recording(plan: &Plan) -> Recording {
    let scene = &plan.scene.scene;
    let (d, receiver) = (&scene.detector, &plan.instrument.receiver);
    let is_baseband = d.signal == DetectorSignal::Baseband;
    // (13) in the band; white noise goes to half the sampling frequency, and to both sides of zero in two quadratures.
    let noise_band_hz = match d.noise {
        NoiseKind::None => 0.0,
        NoiseKind::Band => d.bandwidth_hz,
        NoiseKind::White if is_baseband => d.sampling_hz,
        NoiseKind::White => 0.5 * d.sampling_hz,
    };
    Recording {
        sampling_hz: d.sampling_hz,
        intermediate_frequency_hz: if is_baseband { 0.0 } else { d.intermediate_frequency_hz },
        bandwidth_hz: d.bandwidth_hz,
        wavelength_m: scene.laser.wavelength_m,
        pulse_repetition_hz: scene.laser.pulse_repetition_hz,
        pulse_sigma_s: scene.pulse_sigma_s(),
        noise_power_a2: receiver.noise_density_a2_hz() * noise_band_hz,
    }
}
