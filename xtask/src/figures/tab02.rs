//! Table 2: the lidar's parameters, read back from a scene that went through a file.

use super::context::*;
use std::path::Path;
use wakescope_sim::scene::TABLE2_TOML;

/// A row: name, value of the chapter, and where a scene has it.
type Row = (&'static str, f64, fn(&Scene) -> f64);

const ROWS: [Row; 11] = [
    ("wavelength_m", 1.55e-6, |s| s.laser.wavelength_m),
    ("pulse_energy_j", 150e-6, |s| s.pulse.energy_j),
    ("detector_bandwidth_hz", 50e6, |s| s.detector.bandwidth_hz),
    ("pulse_repetition_hz", 400.0, |s| {
        s.laser.pulse_repetition_hz
    }),
    ("intermediate_frequency_hz", 80e6, |s| {
        s.detector.intermediate_frequency_hz
    }),
    ("sampling_hz", 250e6, |s| s.detector.sampling_hz),
    ("angular_resolution_rad", 1.25e-3, |s| {
        s.scan.elevation_step_rad
    }),
    ("beam_radius_m", 0.03, |s| s.telescope.beam_radius_m),
    ("aperture_radius_m", 0.05, |s| s.telescope.aperture_radius_m),
    ("backscatter_per_m_sr", 1e-7, |s| {
        s.atmosphere.backscatter_per_m_sr
    }),
    ("extinction_per_m", 7e-5, |s| s.atmosphere.extinction_per_m),
];

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let file = SceneFile::parse(TABLE2_TOML, Path::new("table2.toml"))?;
    let plan = Plan::new(context.scene_file(file.content)?, Target::Run)?;
    // What counts is the scene as the run writes it down, not as it was read.
    let back = SceneFile::parse(&plan.file.toml, Path::new("scene.toml"))?.content;
    let values: Vec<f64> = ROWS.iter().map(|r| (r.2)(&back)).collect();
    let table = Table::new()
        .text("parameter", column(&ROWS, |r| r.0))
        .float("chapter", column(&ROWS, |r| r.1))
        .float("scene", values.iter().copied());
    let mut out = Rendered::of_table(&table, &plan.file.provenance())?;
    let equal = ROWS.iter().zip(&values).filter(|(r, v)| r.1 == **v).count();
    out.claims.push(Claim::exact(
        "T2",
        format!("{equal} of {} equal", ROWS.len()),
        equal == ROWS.len(),
    ));
    Ok(out)
}
