//! Spectra of gates as CF NetCDF (classic): density over (line, range, velocity).
//! Check: a test of the program reads the file back.

use super::netcdf::{Data, Layout, described};
use super::provenance::Provenance;
use crate::Error;

/// Spectra \[line, gate, velocity\] of all scans.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectra {
    /// Velocity of each frequency in the band, m/s, positive away from the lidar, increasing.
    pub velocity_m_s: Vec<f64>,
    /// Range of each gate, m.
    pub range_m: Vec<f64>,
    /// Elevation of each line of all scans, rad.
    pub elevation_rad: Vec<f64>,
    /// Time of each line, s.
    pub time_s: Vec<f64>,
    /// Density over that of the scene's noise, or over the mean in the band without noise.
    pub density: Vec<f32>,
}

/// The file's bytes.
///
/// # Errors
/// A result too large for one file.
pub fn cf_spectra_bytes(spectra: &Spectra, provenance: &Provenance) -> Result<Vec<u8>, Error> {
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
