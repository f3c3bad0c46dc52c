//! Spectra of gates as CF NetCDF (classic): density over (line, range, velocity).
//! Check: a test of the program reads the file back.

use super::error::OutputResult;
use super::netcdf::{Data, Layout, described};
use super::provenance::Provenance;
use crate::measure::recorded::Spectra;

/// The file's bytes.
///
/// # Errors
/// A result too large for one file.
pub fn cf_spectra_bytes(spectra: &Spectra, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    let values = [
        ("velocity", Data::f64_slice(&spectra.velocity_m_s)),
        ("range", Data::f64_slice(&spectra.range_m)),
        ("elevation", Data::f64_slice(&spectra.elevation_rad)),
        ("time", Data::f64_slice(&spectra.time_s)),
        ("density", Data::f32(spectra.density.iter().copied())),
    ];
    let dims = vec![
        ("line", spectra.elevation_rad.len()),
        ("range", spectra.range_m.len()),
        ("velocity", spectra.velocity_m_s.len()),
    ];
    Layout::cf(
        "Spectra of recorded signals",
        dims,
        described(include_str!("cf_spectra.cdl"), values),
        provenance,
    )
    .into_bytes(provenance)
}
