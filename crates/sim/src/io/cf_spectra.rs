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
    let axes = [
        ("velocity", &["velocity"], &spectra.velocity_m_s, "m s-1", "radial velocity, positive away from the lidar"),
        ("range", &["range"], &spectra.range_m, "m", "range to the centre of the window"),
        ("elevation", &["line"], &spectra.elevation_rad, "rad", "elevation of the line of sight above the horizon"),
        ("time", &["line"], &spectra.time_s, "s", "time of the line"),
    ];
    let mut variables = Vec::from(axes.map(|(name, dims, values, units, text)| {
        Variable::in_units(name, dims, Data::f64(values.iter().copied()), units, text)
    }));
    let density = Data::f32(spectra.density.iter().copied());
    let text = "mean power density of the region of a gate over that of noise";
    variables.push(Variable::in_units("density", &["line", "range", "velocity"], density, "1", text));
    let dims = vec![
        ("line", spectra.elevation_rad.len()),
        ("range", spectra.range_m.len()),
        ("velocity", spectra.velocity_m_s.len()),
    ];
    Layout::cf("Spectra of recorded signals", dims, variables, provenance).into_bytes(provenance)
}
