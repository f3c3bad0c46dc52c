//! Writes what a run gives: all files of a run appear together, or none.

use crate::Error;
use crate::export::signals::RawSignals;
use crate::export::{Field, FileGroup, Provenance, PulseInfo, Ray, Sweep, Table, Unit, VelocityMap, tables};
use crate::map::VelocityEstimates;
use crate::plan::{Plan, Stage, Target};
use crate::profile::RangeProfile;
use crate::run::RunResult;
use std::path::{Path, PathBuf};

/// Finds out, before any computing, whether files can be written to a folder; leaves no trace.
///
/// # Errors
/// The folder cannot be made, is a file, or cannot be written to.
pub fn prepare(folder: &Path) -> Result<(), Error> {
    let io = |action, source| Error::Io { action, path: folder.to_owned(), source };
    let missing: Vec<&Path> =
        folder.ancestors().filter(|p| !p.as_os_str().is_empty()).take_while(|p| !p.exists()).collect();
    let made = std::fs::create_dir_all(folder).map_err(|e| io("make the folder", e));
    let probe = folder.join(".wakescope-probe");
    let tried = made.and_then(|()| {
        std::fs::write(&probe, b"").and_then(|()| std::fs::remove_file(&probe)).map_err(|e| io("write to", e))
    });
    for path in missing {
        // Innermost first; one that was not made cannot be removed, which is what is wanted.
        let _ = std::fs::remove_dir(path);
    }
    tried
}

/// The same for the files of a plan, of which each could meet a folder of its name.
///
/// # Errors
/// As [`prepare`]; a folder that has the name of a file.
pub fn prepare_for(plan: &Plan, folder: &Path) -> Result<(), Error> {
    prepare(folder)?;
    match names(plan).into_iter().map(|name| folder.join(name)).find(|path| path.is_dir()) {
        Some(path) => {
            let source = std::io::Error::new(std::io::ErrorKind::IsADirectory, "a folder of that name is in the way");
            Err(Error::Io { action: "write", path, source })
        }
        None => Ok(()),
    }
}

/// Names of the files that a run of the plan writes, in the order in which [`write()`] writes them.
pub fn names(plan: &Plan) -> Vec<String> {
    let o = plan.scene.scene.outputs;
    let netcdf = o.netcdf && cfg!(feature = "netcdf");
    let (svg, png) = (o.svg && cfg!(feature = "plots"), o.png && cfg!(feature = "plots"));
    let tables = [(o.csv, "csv"), (netcdf, "nc")];
    let pictures = [(svg, "svg"), (png, "png")];
    let profile = matches!(plan.target, Target::Run | Target::Efficiency);
    let mut out = vec!["scene.toml".to_owned()];
    let mut add = |is_made: bool, stem: &str, kinds: &[(bool, &str)]| {
        let kinds = kinds.iter().filter(|(wanted, _)| is_made && *wanted);
        out.extend(kinds.map(|(_, ending)| format!("{stem}.{ending}")));
    };
    add(profile, "profile", &tables[..1]);
    add(profile, "profile", &pictures);
    add(plan.runs(Stage::CrossPlane), "flow", &tables);
    add(plan.keeps_signals(), "signals", &tables);
    add(plan.runs(Stage::Estimates), "map", &tables);
    add(plan.runs(Stage::Estimates), "map", &pictures);
    out
}

/// Writes the results that the plan's scene asks for; returns the paths of the files.
///
/// # Errors
/// A result that a format cannot hold, or what the system says. Nothing is left half-written.
pub fn write(plan: &Plan, result: &RunResult, folder: &Path) -> Result<Vec<PathBuf>, Error> {
    Ok(files(plan, result, folder)?.commit()?)
}

/// The files of a run, still in memory.
pub(crate) fn files(plan: &Plan, result: &RunResult, folder: &Path) -> Result<FileGroup, Error> {
    let outputs = plan.scene.scene.outputs;
    let origin = provenance(plan);
    let mut files = FileGroup::new(folder);
    files.add("scene.toml", scene_text(&origin))?;
    if let Some(profile) = &result.profile {
        if outputs.csv {
            files.add("profile.csv", profile_table(profile).to_csv(&origin)?)?;
        }
        #[cfg(feature = "plots")]
        pictures::add(&mut files, plan, "profile", &pictures::profile(profile), &origin)?;
    }
    if let Some(plane) = &result.plane {
        if outputs.csv {
            files.add("flow.csv", tables::planes_table(plane)?.to_csv(&origin)?)?;
        }
        #[cfg(feature = "netcdf")]
        if outputs.netcdf {
            files.add("flow.nc", crate::export::cf_planes::cf_planes_bytes(plane, &origin)?)?;
        }
    }
    if let Some(current_a) = &result.signals_a {
        let signals = raw_signals(plan, current_a.clone(), result.quadrature_a.clone());
        if outputs.csv {
            files.add("signals.csv", signals.table()?.to_csv(&origin)?)?;
        }
        #[cfg(feature = "netcdf")]
        if outputs.netcdf {
            files.add("signals.nc", crate::export::cf_signals::cf_signals_bytes(&signals, &origin)?)?;
        }
    }
    if let Some(estimates) = &result.map {
        let map = velocity_map(plan, estimates);
        if outputs.csv {
            files.add("map.csv", tables::map_table(&map)?.to_csv(&origin)?)?;
        }
        #[cfg(feature = "netcdf")]
        if outputs.netcdf {
            files.add("map.nc", crate::export::cfradial::cfradial_bytes(&map, &origin)?)?;
        }
        #[cfg(feature = "plots")]
        pictures::add_map(&mut files, plan, &map, &origin)?;
    }
    Ok(files)
}

/// Where the files of a run come from.
pub fn provenance(plan: &Plan) -> Provenance {
    Provenance {
        program: crate::PROGRAM.into(),
        scene_toml: plan.scene.toml.clone(),
        scene_hash: plan.scene.hash.clone(),
        seed: plan.scene.scene.seed,
    }
}

/// The scene with every default written out: running it again gives the same files.
fn scene_text(origin: &Provenance) -> String {
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

/// The raw signals of a plan's first realisation.
fn raw_signals(plan: &Plan, current_a: ndarray::Array2<f64>, quadrature_a: Option<ndarray::Array2<f64>>) -> RawSignals {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    let pulses = scene.scan.pulses_per_line;
    let first_s = 2.0 * g.first_range_m / crate::SPEED_OF_LIGHT_M_S;
    RawSignals {
        current_a,
        quadrature_a,
        elevation_rad: g.elevation_rad.iter().flat_map(|&el| std::iter::repeat_n(el, pulses)).collect(),
        time_s: (0..g.samples).map(|k| first_s + k as f64 / scene.detector.sampling_hz).collect(),
        pulses_per_line: pulses,
    }
}

/// The map of a run in the form that files and pictures take.
pub fn velocity_map(plan: &Plan, e: &VelocityEstimates) -> VelocityMap {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    let azimuth_rad = scene.scan.azimuth_rad;
    let start_s = plan.wind.start_s;
    let away = |what: &str| format!("{what}, positive away from the lidar");
    let speed = |name: &str, text: String, values: &ndarray::Array2<f64>| {
        Field::float(name, Unit::MetrePerSecond, &text, values.clone())
    };
    let number =
        |name: &str, text: &str, values: &ndarray::Array2<f64>| Field::float(name, Unit::One, text, values.clone());
    VelocityMap {
        title: "Radial velocity of a wake-vortex scan".into(),
        rays: (0..g.elevation_rad.len())
            .map(|i| Ray {
                sweep: 0,
                time_s: start_s + g.line_time_s[i],
                elevation_rad: g.elevation_rad[i],
                azimuth_rad,
            })
            .collect(),
        range_m: e.range_m.clone(),
        sweeps: vec![Sweep { tau: plan.wind.tau, azimuth_rad }],
        pulse: PulseInfo {
            prt_s: 1.0 / scene.laser.pulse_repetition_hz,
            pulse_width_s: scene.pulse.duration_s,
            nyquist_velocity_m_s: 0.25 * scene.laser.wavelength_m * scene.detector.sampling_hz,
            samples: scene.scan.pulses_per_line as u32,
            frequency_hz: crate::SPEED_OF_LIGHT_M_S / scene.laser.wavelength_m,
        },
        fields: vec![
            speed("v_exact", away("radial velocity of the air at the gate's centre"), &e.v_exact_m_s),
            speed("v_pulse", away("radial velocity weighted with the pulse"), &e.v_pulse_m_s),
            speed("v_gate", away("radial velocity weighted with pulse and window"), &e.v_gate_m_s),
            speed("radial_velocity", away("mean estimated radial velocity"), &e.v_mean_m_s),
            speed("velocity_standard_deviation", "standard deviation of one estimate".into(), &e.std_m_s),
            speed("rms", "root mean square error against v_pulse".into(), &e.rms_m_s),
            number("level", "windows accumulated for one estimate", &e.level),
            number("n_eff", "independent windows that these are worth", &e.n_eff),
            speed("bias", "mean error against v_pulse".into(), &e.bias_m_s),
            speed("standard_error", "standard error of the root mean square error".into(), &e.standard_error_m_s),
            number("flagged", "fraction of the realisations whose estimate was flagged", &e.flagged),
            number("count", "realisations with a velocity", &e.count),
            speed("width", "mean spectral width beyond that of the window".into(), &e.width_m_s),
            Field::float(
                "signal_to_noise_ratio",
                Unit::Decibel,
                "signal-to-noise ratio in the detector band that the spectra show",
                e.snr_db.clone(),
            ),
            number("quality", "density of the peak over the mean density in the band", &e.quality),
        ],
        lidar_y_m: 0.0,
        lidar_height_m: scene.scan.lidar_height_m,
    }
}

/// The pictures of a run.
#[cfg(feature = "plots")]
mod pictures {
    use super::{Error, FileGroup, Plan, Provenance, RangeProfile, VelocityMap};
    use crate::plot::{Axis, CurvePlot, Figure, MapPlot, Series, Style};
    use crate::scene::Flow;
    use wakescope_optics::EfficiencyProfile;

    /// Adds a figure in the formats that the scene asks for.
    pub(super) fn add(
        files: &mut FileGroup,
        plan: &Plan,
        name: &str,
        figure: &Figure,
        origin: &Provenance,
    ) -> Result<(), Error> {
        let outputs = plan.scene.scene.outputs;
        if outputs.svg {
            files.add(&format!("{name}.svg"), figure.svg(origin)?)?;
        }
        if outputs.png {
            files.add(&format!("{name}.png"), figure.png(origin)?)?;
        }
        Ok(())
    }

    /// Signal-to-noise ratio and efficiency against range, with the standard error as a band.
    pub(super) fn profile(profile: &RangeProfile) -> Figure {
        let e = &profile.efficiency;
        let range = || Axis::linear("range [m]");
        let points = |y: &[f64]| e.range_m.iter().copied().zip(y.iter().copied()).collect::<Vec<_>>();
        let curve = |label: &str, style: Style, profile: &EfficiencyProfile| {
            let series = Series::new(label, style, points(&profile.mean));
            match profile.standard_error.iter().any(|&error| error > 0.0) {
                true => series.with_band(&profile.standard_error),
                false => series,
            }
        };
        let mut efficiency = CurvePlot::new("System efficiency", range(), Axis::linear("efficiency"));
        if profile.others.is_empty() {
            efficiency = efficiency.with(curve("", Style::Line, e));
        }
        let styles = [Style::Line, Style::Dash, Style::DashDot, Style::Dot];
        for ((name, other), style) in profile.others.iter().zip(styles) {
            efficiency = efficiency.with(curve(&name.replace("efficiency_", "").replace('_', " "), style, other));
        }
        Figure::side_by_side([
            CurvePlot::new("Signal-to-noise ratio", range(), Axis::linear("SNR [dB]")).with(Series::new(
                "",
                Style::Line,
                points(&profile.snr_db),
            )),
            efficiency,
        ])
    }

    /// The map of the estimates, and that of their errors, each over the truth where it helps.
    pub(super) fn add_map(
        files: &mut FileGroup,
        plan: &Plan,
        map: &VelocityMap,
        origin: &Provenance,
    ) -> Result<(), Error> {
        let centres_m = match &plan.scene.scene.flow {
            Flow::VortexPair(pair) => {
                let c = crate::join::vortex_pair(pair).centres(plan.wind.start_s);
                vec![(c.left_y_m, c.height_m), (c.right_y_m, c.height_m)]
            }
            _ => Vec::new(),
        };
        let panel = |field: &str, title: &str, label: &str| -> Result<MapPlot, Error> {
            let mut plot = MapPlot::new(map, 0, field)?.titled(title).labelled(label);
            plot.points_m.clone_from(&centres_m);
            Ok(plot)
        };
        let truth = panel("v_pulse", "Radial velocity weighted with the pulse", "v_pulse [m/s]")?;
        let estimate = panel("radial_velocity", "Mean estimated radial velocity", "v [m/s]")?.coloured(truth.colours);
        let error = panel("rms", "Root mean square error", "rms [m/s]")?;
        add(files, plan, "map", &Figure::stacked([truth, estimate, error]), origin)
    }
}
