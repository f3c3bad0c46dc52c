//! The track of the vortices through several scans: smoothed states with their bands.
//!
//! Check: a series of scans of a pair that sinks, in the tests of the program.

use super::RetrievedScan;
use crate::Error;
use crate::io::Table;
use wakescope_estimate::retrieval::{Measured, ScanResult, Track, TrackedVortex, track};

/// The track of several scans in the order of their times; nothing of a single scan, of scans without times, or without a wake.
///
/// # Errors
/// What the filter refuses.
pub fn track_of(scans: &[RetrievedScan]) -> Result<Option<Track>, Error> {
    let mut results: Vec<&ScanResult> = scans.iter().map(|scan| &scan.result).collect();
    results.sort_by(|a, b| a.reference_time_s.total_cmp(&b.reference_time_s));
    let increase = results.windows(2).all(|pair| pair[1].reference_time_s > pair[0].reference_time_s);
    let found = results.iter().any(|result| !result.vortices.is_empty());
    if results.len() < 2 || !increase || !found {
        return Ok(None);
    }
    Ok(Some(track(&results, Track::ACCELERATION_DENSITY_M2_S3)?))
}

type OfVortex = (&'static str, &'static str, fn(&TrackedVortex) -> Measured);

/// Columns of a track.
pub(super) const COLUMNS: [OfVortex; 6] = [
    ("gamma_m2_s", "gamma_std_m2_s", |v| v.circulation_m2_s),
    ("y_m", "y_std_m", |v| v.lateral_position_m),
    ("z_m", "z_std_m", |v| v.height_m),
    ("y_rate_m_s", "y_rate_std_m_s", |v| v.lateral_velocity_m_s),
    ("z_rate_m_s", "z_rate_std_m_s", |v| v.vertical_velocity_m_s),
    ("decay_per_s", "decay_std_per_s", |v| v.decay_per_s),
];

/// A row for each vortex and time of a track.
pub fn track_table(track: &Track) -> Table {
    let all = track.points.iter().flat_map(|point| point.vortices.iter().map(move |vortex| (point.time_s, vortex)));
    let all: Vec<(f64, &TrackedVortex)> = all.collect();
    let mut table = Table::new()
        .float("time_s", all.iter().map(|(time_s, _)| *time_s))
        .text("side", all.iter().map(|(_, vortex)| super::name(vortex.side)))
        .int("detected", all.iter().map(|(_, vortex)| i64::from(vortex.detected)));
    for (value, std, get) in COLUMNS {
        table = table
            .float(value, all.iter().map(|(_, vortex)| get(vortex).value))
            .float(std, all.iter().map(|(_, vortex)| get(vortex).std));
    }
    table
}
