//! What retrievals found, as rows and as JSON: in each scan, and as the track through several, smoothed states with their bands.
//!
//! Check: rows of no wake, one vortex and two; a series of scans of a pair that sinks, in the tests of the program.

use crate::Error;
use crate::detection::scan_turbulence::{turbulence_json, with_turbulence};
use crate::io::Table;
use crate::io::scans::{ReadScan, plane_numbers};
use crate::progress::Observer;
use serde::Serialize;
use serde_json::{Value, json};
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{
    RetrievalOptions, ScanResult, Track, TrackedVortex, VortexResult, track,
};
use wakescope_estimate::vortex_fit::Wake;

/// One scan with what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub struct RetrievedScan {
    /// The scan.
    pub scan: ReadScan,
    /// How it was retrieved.
    pub options: RetrievalOptions,
    /// Its vortices, or none.
    pub result: ScanResult,
}

/// An error of the fits with the file that caused it.
pub(super) fn refused(scan: &ReadScan, error: &wakescope_estimate::Error) -> Error {
    Error::Input {
        path: scan.path.clone(),
        reason: format!("sweep {}: {error}", scan.sweep),
    }
}

/// The number of a scan from 1 on, the scan, and one of its vortices.
type Row<'a> = (usize, &'a RetrievedScan, Option<&'a VortexResult>);

/// Each vortex with its scan; a scan without a wake once, without a vortex.
fn vortices_of(scans: &[RetrievedScan]) -> Vec<Row<'_>> {
    let mut of: Vec<Row<'_>> = Vec::new();
    for (number, scan) in scans.iter().enumerate() {
        let none = scan.result.vortices.is_empty().then_some(None);
        of.extend(
            scan.result
                .vortices
                .iter()
                .map(Some)
                .chain(none)
                .map(|vortex| (number + 1, scan, vortex)),
        );
    }
    of
}

/// A row for each vortex and scan; a scan without a wake has one row without a vortex. Turbulence has columns if it was found in a scan.
pub fn rows(scans: &[RetrievedScan]) -> Table {
    let of = vortices_of(scans);
    let read = of.iter().map(|(_, scan, _)| &scan.scan);
    let results = of.iter().map(|(_, scan, _)| &scan.result);
    let vortices = of.iter().map(|(.., vortex)| *vortex);
    let sweeps = read.clone().map(|scan| scan.sweep as i64);
    let azimuths_rad = read
        .clone()
        .map(|scan| scan.azimuth_rad.unwrap_or(f64::NAN));
    let mut times_s = Vec::with_capacity(of.len());
    let mut sides = Vec::with_capacity(of.len());
    for (_, scan, vortex) in &of {
        times_s.push(vortex.map_or(scan.result.reference_time_s, |v| v.time_s));
        sides.push(vortex.map_or_else(|| "none".to_owned(), |v| name(v.side)));
    }
    let mut table = Table::new()
        .int("scan", of.iter().map(|(number, ..)| *number as i64))
        .text("file", read.map(ReadScan::file_name))
        .int("sweep", sweeps)
        .float("azimuth_rad", azimuths_rad)
        .float("time_s", times_s)
        .text("side", sides);
    for (name, get) in VORTEX {
        let numbers = vortices.clone();
        let numbers = numbers.map(|vortex| vortex.and_then(get).unwrap_or(UNKNOWN));
        table = measured(table, name, numbers);
    }
    let winds = results.clone().map(|result| result.lateral_wind_m_s);
    let shears = results.clone().map(|result| result.wind_shear_per_s);
    table = measured(table, "wind_m_s", winds);
    table = measured(table, "shear_per_s", shears);
    let cells_used = results.clone().map(|result| result.cells_used as i64);
    let cells_rejected = results.clone().map(|result| result.cells_rejected as i64);
    let statistics = results.clone().map(|result| result.statistic);
    let thresholds = results.clone().map(|result| result.threshold);
    table = table
        .float(
            "chi2_per_dof",
            results.clone().map(|result| result.chi2_per_dof),
        )
        .int("cells_used", cells_used)
        .int("cells_rejected", cells_rejected)
        .float("statistic", statistics)
        .float("threshold", thresholds);
    let turbulence = results.clone().map(|result| result.turbulence);
    with_turbulence(table, turbulence).text("flags", results.map(flags))
}

/// A column of numbers and one of their deviations.
pub(super) fn measured(
    table: Table,
    name: &str,
    values: impl Iterator<Item = Measured> + Clone,
) -> Table {
    table
        .float(name, values.clone().map(|m| m.value))
        .float(&with(name, "std"), values.map(|m| m.std))
}

/// What is not known.
pub(super) const UNKNOWN: Measured = Measured {
    value: f64::NAN,
    std: f64::NAN,
};

pub(super) type OfVortex = (&'static str, fn(&VortexResult) -> Option<Measured>);

/// Columns of a vortex.
pub(super) const VORTEX: [OfVortex; 5] = [
    ("gamma_m2_s", |v| Some(v.circulation_m2_s)),
    ("gamma_5_15_m2_s", |v| Some(v.circulation_5_15_m2_s)),
    ("y_m", |v| Some(v.lateral_position_m)),
    ("z_m", |v| Some(v.height_m)),
    ("core_m", |v| v.core_radius_m),
];

/// The track of the vortices in one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneTrack {
    /// Number of the plane, from 0, in the order in which scans of it first come.
    pub plane: usize,
    /// Azimuth of the plane, rad, if it is known: that of its first scan.
    pub azimuth_rad: Option<f64>,
    /// The numbers of its scans, from 0.
    pub scans: Vec<usize>,
    /// Where the vortices are at their times.
    pub track: Track,
}

/// The tracks of scans, one for each plane that has one. The observer is warned of scans that are in none as an earlier one of their
/// plane has their time.
///
/// # Errors
/// What the filter refuses.
pub fn tracks_of(
    scans: &[RetrievedScan],
    observer: &dyn Observer,
) -> Result<Vec<PlaneTrack>, Error> {
    let numbers = plane_numbers(scans.iter().map(|scan| &scan.scan));
    let planes = numbers.iter().max().map_or(0, |last| last + 1);
    let mut tracks = Vec::new();
    for plane in 0..planes {
        let own: Vec<usize> = (0..scans.len()).filter(|i| numbers[*i] == plane).collect();
        let results = own.iter().map(|i| &scans[*i].result);
        let times_s: Vec<f64> = results
            .clone()
            .map(|result| result.reference_time_s)
            .collect();
        if let Some(track) = track_of(results)? {
            if let Some(text) = left_out_text(&own, &times_s) {
                observer.warn(&text);
            }
            tracks.push(PlaneTrack {
                plane,
                azimuth_rad: scans[own[0]].scan.azimuth_rad,
                scans: own,
                track,
            });
        }
    }
    Ok(tracks)
}

/// The places of known times in the order of these; of equal ones that of the first.
fn in_order(times_s: &[f64]) -> Vec<usize> {
    let mut places = Vec::with_capacity(times_s.len());
    for (place, time_s) in times_s.iter().enumerate() {
        if time_s.is_finite() {
            places.push(place);
        }
    }
    places.sort_by(|a, b| times_s[*a].total_cmp(&times_s[*b]));
    places.dedup_by_key(|place| times_s[*place]);
    places
}

/// That scans with these numbers, from 0, and times are left out of a track as others before them have their times, if any are.
fn left_out_text(numbers: &[usize], times_s: &[f64]) -> Option<String> {
    let kept = in_order(times_s);
    let mut left_out = Vec::new();
    for (place, (number, time_s)) in numbers.iter().zip(times_s).enumerate() {
        if time_s.is_finite() && !kept.contains(&place) {
            left_out.push(format!("scan {}", number + 1));
        }
    }
    let last = left_out.pop()?;
    Some(match &left_out[..] {
        [] => format!(
            "{last} has the time of an earlier scan of its plane: it is left out of the track"
        ),
        _ => format!(
            "{} and {last} have the times of earlier scans of their plane: they are left out of the track",
            left_out.join(", ")
        ),
    })
}

/// The track of the scans of one plane that have times, in the order of these, of equal ones the first; nothing of a single one, or
/// without a wake.
///
/// # Errors
/// What the filter refuses.
pub fn track_of<'r>(
    results: impl IntoIterator<Item = &'r ScanResult>,
) -> Result<Option<Track>, Error> {
    let all: Vec<&ScanResult> = results.into_iter().collect();
    let times_s: Vec<f64> = all.iter().map(|result| result.reference_time_s).collect();
    let places = in_order(&times_s);
    let results: Vec<&ScanResult> = places.into_iter().map(|place| all[place]).collect();
    let found = results.iter().any(|result| !result.vortices.is_empty());
    if results.len() < 2 || !found {
        return Ok(None);
    }
    Ok(Some(track(&results, Track::ACCELERATION_DENSITY_M2_S3)?))
}

type OfTrack = (&'static str, fn(&TrackedVortex) -> Measured);

/// Columns of a track.
pub(super) const TRACK: [OfTrack; 6] = [
    ("gamma_m2_s", |v| v.circulation_m2_s),
    ("y_m", |v| v.lateral_position_m),
    ("z_m", |v| v.height_m),
    ("y_rate_m_s", |v| v.lateral_velocity_m_s),
    ("z_rate_m_s", |v| v.vertical_velocity_m_s),
    ("decay_per_s", |v| v.decay_per_s),
];

/// A row for each vortex and time of each track.
pub fn track_table(tracks: &[PlaneTrack]) -> Table {
    let mut all: Vec<(f64, f64, &TrackedVortex)> = Vec::new();
    for of_plane in tracks {
        let azimuth_rad = of_plane.azimuth_rad.unwrap_or(f64::NAN);
        for point in &of_plane.track.points {
            let own = point.vortices.iter();
            all.extend(own.map(|vortex| (azimuth_rad, point.time_s, vortex)));
        }
    }
    let azimuths_rad = all.iter().map(|(azimuth_rad, ..)| *azimuth_rad);
    let times_s = all.iter().map(|(_, time_s, _)| *time_s);
    let vortices = all.iter().map(|(.., vortex)| *vortex);
    let detected = vortices.clone().map(|vortex| i64::from(vortex.detected));
    let mut table = Table::new()
        .float("azimuth_rad", azimuths_rad)
        .float("time_s", times_s)
        .text("side", vortices.clone().map(|vortex| name(vortex.side)))
        .int("detected", detected);
    for (name, get) in TRACK {
        table = measured(table, name, vortices.clone().map(get));
    }
    table
}

/// `gamma_m2_s` to `gamma_std_m2_s`: the unit stays at the end.
pub(super) fn with(name: &str, word: &str) -> String {
    let unit = ["_m2_s", "_m_s", "_per_s", "_m"]
        .into_iter()
        .find(|unit| name.ends_with(unit))
        .unwrap_or_default();
    format!("{}_{word}{unit}", name.strip_suffix(unit).unwrap_or(name))
}

/// The name that files have for a side or a flag.
pub fn name(choice: impl Serialize) -> String {
    json!(choice).as_str().unwrap_or_default().to_owned()
}

/// Names of what is to be thought of a result.
pub fn flags(result: &ScanResult) -> String {
    result.flags.iter().map(name).collect::<Vec<_>>().join(" ")
}

/// Everything that was found, with covariances and competing minima of chi-square.
pub fn json(scans: &[RetrievedScan]) -> serde_json::Value {
    let scans = scans.iter().enumerate();
    Value::Array(scans.map(|(i, scan)| scan_json(i + 1, scan)).collect())
}

fn scan_json(number: usize, scan: &RetrievedScan) -> Value {
    let r = &scan.result;
    let vortices: Vec<Value> = r.vortices.iter().map(vortex_json).collect();
    let parameters: Vec<&str> = PARAMETER_NAMES.split(' ').collect();
    let covariance: Vec<Vec<f64>> = r.covariance.outer_iter().map(|row| row.to_vec()).collect();
    let secondary = scan.options.model.secondary.map(|both| both.map(|v| json!({
        "gamma_m2_s": v.circulation_m2_s, "y_m": v.lateral_position_m, "z_m": v.height_m, "core_m": v.core_radius_m,
    })));
    let minima = r.tops.iter();
    let minima: Vec<Value> = minima
        .map(|minimum| json!({ "wake": wake_json(&minimum.wake), "chi2": minimum.chi2 }))
        .collect();
    let mut object = json!({
        "scan": number, "file": scan.scan.path.to_string_lossy(), "sweep": scan.scan.sweep, "azimuth_rad": scan.scan.azimuth_rad,
        "reference_time_s": r.reference_time_s, "vortices": vortices,
        "wind_m_s": r.lateral_wind_m_s, "shear_per_s": r.wind_shear_per_s,
        "chi2_per_dof": r.chi2_per_dof, "cells_used": r.cells_used, "cells_rejected": r.cells_rejected,
        "statistic": r.statistic, "threshold": r.threshold, "flags": r.flags,
        "parameters": parameters, "wake": r.wake.as_ref().map(wake_json), "covariance": covariance,
        "secondary": secondary, "minima": minima,
    });
    if let Some(turbulence) = &r.turbulence {
        object["turbulence"] = turbulence_json(turbulence);
    }
    object
}

/// The parameters of a wake by name. JSON has no NaN: what is not known is null.
fn wake_json(wake: &Wake) -> Value {
    let names = PARAMETER_NAMES.split(' ');
    let named = names.zip(wake.to_array());
    named
        .map(|(name, value)| (name.to_owned(), json!(value)))
        .collect()
}

fn vortex_json(vortex: &VortexResult) -> Value {
    let mut object = json!({ "side": vortex.side, "time_s": vortex.time_s });
    for (name, get) in VORTEX {
        object[name] = json!(get(vortex));
    }
    object
}

/// Names of the parameters of a wake in their order.
const PARAMETER_NAMES: &str = "gamma_left_m2_s gamma_right_m2_s y_left_m z_left_m y_right_m z_right_m core_left_m core_right_m wind_m_s \
                               shear_per_s log_wind_m_s";

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;
    use wakescope_estimate::retrieval::Side;
    use wakescope_estimate::vortex_fit::{PARAMETERS, WakeModel};

    fn known(value: f64, std: f64) -> Measured {
        Measured { value, std }
    }

    /// A scan with a pair of 400 m^2/s that sinks by 0.3 m/s.
    fn scan(time_s: f64) -> ScanResult {
        let height_m = 80.0 - 0.3 * time_s;
        let values = [
            400.0, 400.0, 376.0, height_m, 424.0, height_m, 2.0, 2.0, 1.0, 0.0, 0.0,
        ];
        let wake = Wake::from_array(&values);
        let mut covariance = Array2::<f64>::zeros((PARAMETERS, PARAMETERS));
        for (i, std) in [8.0, 8.0, 0.6, 0.2, 0.6, 0.2].into_iter().enumerate() {
            covariance[[i, i]] = std * std;
        }
        let vortices =
            [(Side::Left, 376.0), (Side::Right, 424.0)].map(|(side, y_m)| VortexResult {
                side,
                time_s,
                circulation_m2_s: known(400.0, 8.0),
                circulation_5_15_m2_s: known(400.0, 8.0),
                lateral_position_m: known(y_m, 0.6),
                height_m: known(height_m, 0.2),
                core_radius_m: None,
            });
        ScanResult {
            vortices: vortices.to_vec(),
            wake: Some(wake),
            reference_time_s: time_s,
            covariance,
            lateral_wind_m_s: known(0.0, f64::NAN),
            wind_shear_per_s: known(0.0, f64::NAN),
            chi2_per_dof: 1.0,
            cells_used: 2000,
            cells_rejected: 0,
            statistic: 1e4,
            threshold: 22.0,
            flags: Vec::new(),
            tops: Vec::new(),
            turbulence: None,
            model: WakeModel::default(),
        }
    }

    #[test]
    fn scans_of_equal_times_do_not_end_a_track() {
        let single: Vec<ScanResult> = [0.0, 10.0, 20.0].map(scan).to_vec();
        let expected = track_of(&single).unwrap();
        assert_eq!(expected.as_ref().map(|track| track.points.len()), Some(3));
        let mut twice = single.clone();
        // The later of two scans is another one, so that it would change the track.
        twice.insert(2, scan(10.0));
        twice[2].vortices.clear();
        twice.push(scan(f64::NAN));
        let found = track_of(&twice).unwrap();
        // As texts, in which what is not known is equal, too.
        assert_eq!(format!("{found:?}"), format!("{expected:?}"));
        assert_eq!(track_of(&twice[1..3]).unwrap(), None);
    }

    #[test]
    fn scans_of_equal_times_are_named() {
        let numbers = [0, 2, 3, 5, 6];
        assert_eq!(
            left_out_text(&numbers, &[0.0, 1.0, f64::NAN, f64::NAN, 2.0]),
            None
        );
        let one = left_out_text(&numbers, &[10.0, 1.0, 10.0, 3.0, 2.0]).unwrap();
        assert!(one.starts_with("scan 4 has the time"), "{one}");
        let several = left_out_text(&numbers, &[1.0, 1.0, 10.0, 1.0, 10.0]).unwrap();
        assert!(
            several.starts_with("scan 3, scan 6 and scan 7 have"),
            "{several}"
        );
    }
}
