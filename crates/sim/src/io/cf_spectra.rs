//! Spectra of gates as CF NetCDF (classic): density over (line, range, velocity).
//! Check: a test of the program reads the file back.

use super::error::OutputResult;
use super::netcdf::{Data, Layout, Variable};
use super::provenance::Provenance;
use crate::measure::recorded::Spectra;

/// The file's bytes.
///
/// # Errors
/// A result too large for one file.
pub fn cf_spectra_bytes(spectra: &Spectra, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    let axis = |name: &'static str, dims: &'static [&'static str], values: &[f64], units: &str, text: &str| {
        Variable::new(name, dims, Data::f64(values.iter().copied())).text("units", units).text("long_name", text)
    };
    let variables = vec![
        axis(
            "velocity",
            &["velocity"],
            &spectra.velocity_m_s,
            "m s-1",
            "radial velocity, positive away from the lidar",
        ),
        axis("range", &["range"], &spectra.range_m, "m", "range to the centre of the window"),
        axis("elevation", &["line"], &spectra.elevation_rad, "rad", "elevation of the line of sight above the horizon"),
        axis("time", &["line"], &spectra.time_s, "s", "time of the line"),
        Variable::new("density", &["line", "range", "velocity"], Data::f32(spectra.density.iter().copied()))
            .text("units", "1")
            .text("long_name", "mean power density of the region of a gate over that of noise"),
    ];
    let dims = vec![
        ("line", spectra.elevation_rad.len()),
        ("range", spectra.range_m.len()),
        ("velocity", spectra.velocity_m_s.len()),
    ];
    Layout::cf("Spectra of recorded signals", dims, variables, provenance).into_bytes(provenance)
}
