//! Scans of radial velocity that any instrument or program wrote, as maps for a retrieval.
//!
//! | format | how it is known | sign, angles, gaps |
//! |---|---|---|
//! | CfRadial 1.x in classic NetCDF; in NetCDF-4 also CfRadial 2 and Windcube, a group for each sweep (feature `netcdf4`) | its first bytes | by standard names and units; fill values; sweeps that are no RHI are left out |
//! | HALO `.hpl` | the line `****` | positive away; below an intensity threshold there is noise |
//! | table | the header names `range_m`, an elevation and a velocity | positive away; empty cells |
//!
//! `planes` finds the scans among the rays. Check: what the writers write comes back; files of other hands; damaged ones are refused with their field.

mod cfradial;
mod gate_layout;
mod grid;
mod hpl;
mod planes;
mod rays;
mod store;
mod table;
mod velocities;

pub use planes::{are_of_one_plane, face_alike, plane_numbers};
pub use rays::{Ray, RaySweep, read_rays};
pub use store::StoredLines;

use crate::Error;
use crate::io::netcdf_input::open_groups;
use crate::io::{UtcTime, text_file};
use crate::machine;
use std::path::{Path, PathBuf};
use wakescope_estimate::retrieval::ScanMap;

/// What a file does not say of its velocities.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct ScanFormat {
    /// Variable or column of the velocities.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME"))]
    pub field: Option<String>,
    /// Velocities are positive, or frequencies rise, towards the lidar.
    #[cfg_attr(feature = "cli", arg(long))]
    pub towards: bool,
    /// Skip velocities below this signal-to-noise ratio in dB.
    #[cfg_attr(
        feature = "cli",
        arg(long = "min-snr", value_name = "DB", allow_negative_numbers = true, value_parser = finite)
    )]
    pub min_snr_db: Option<f64>,
    /// Whether velocities that the instrument does not trust are read all the same.
    #[cfg_attr(feature = "cli", arg(skip))]
    pub ignores_status: bool,
}

/// A finite number of the command line.
#[cfg(feature = "cli")]
pub(crate) fn finite(word: &str) -> Result<f64, String> {
    let number = word.trim().parse().ok();
    number
        .filter(|value: &f64| value.is_finite())
        .ok_or_else(|| "a number, e.g. 1.5".into())
}

impl ScanFormat {
    /// 1 where velocities of the file are positive away from the lidar, -1 where they are not.
    fn sign(&self) -> f64 {
        if self.towards { -1.0 } else { 1.0 }
    }

    /// Whether a velocity is skipped for its signal-to-noise ratio, dB: a low or an unknown one.
    fn is_noise(&self, snr_db: f64) -> bool {
        self.min_snr_db
            .is_some_and(|least| snr_db.is_nan() || snr_db < least)
    }
}

/// One scan of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadScan {
    /// The file.
    pub path: PathBuf,
    /// Number of the sweep in the file, from 0.
    pub sweep: usize,
    /// Azimuth of the vertical plane of the scan, rad, from 0 to 2 pi, for elevations below 90 degrees; none if it is unknown.
    pub azimuth_rad: Option<f64>,
    /// Latitude and longitude of an instrument that does not move, degrees, if the file has them.
    pub place_deg: Option<[f64; 2]>,
    /// The velocities; times count from `reference`.
    pub map: ScanMap,
    /// Date from which times count, if the file has one.
    pub reference: Option<UtcTime>,
    /// Length of a gate that touches its neighbours, m, if the file says so.
    pub gate_length_m: Option<f64>,
    /// Duration of a pulse, s, if the file has it.
    pub pulse_width_s: Option<f64>,
    /// The scene that this program wrote the file for.
    pub scene_toml: Option<String>,
    /// Whether this program made its velocities, so that its estimator is that of the scene.
    pub is_own: bool,
    /// Scans of which each velocity is the mean, as the file counts them: 1 for a single scan.
    pub scans: f64,
}

impl ReadScan {
    /// Name of the file without its folder.
    pub fn file_name(&self) -> String {
        self.path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    }

    /// A map that was just made by this program, named `name` in messages.
    pub fn own(name: &str, map: ScanMap) -> Self {
        Self {
            is_own: true,
            ..Self::new(Path::new(name), 0, map)
        }
    }

    /// A map of which nothing else is known.
    pub(crate) fn new(path: &Path, sweep: usize, map: ScanMap) -> Self {
        Self {
            path: path.to_owned(),
            sweep,
            azimuth_rad: None,
            place_deg: None,
            map,
            reference: None,
            gate_length_m: None,
            pulse_width_s: None,
            scene_toml: None,
            is_own: false,
            scans: 1.0,
        }
    }
}

/// What is said of a file without a ratio of signal and noise that is to be held against a least one.
const NO_RATIO: &str = "it has no signal-to-noise ratio, which --min-snr needs: none of its variables is called snr, cnr, \
                        signal_to_noise_ratio or intensity";

/// What follows from times that are rounded too far.
const WITHOUT_TIMES: &str = "its scans have no times and are in no track";

/// Brings the times of scans to the first date from which some of them count; those without a date have no times then, as nothing says
/// how they lie to the others. Returns the files of these.
pub fn share_origin(scans: &mut [&mut ReadScan]) -> Vec<PathBuf> {
    let mut undated = Vec::new();
    let Some(first) = scans.iter().find_map(|scan| scan.reference) else {
        return undated;
    };
    for scan in scans {
        let Some(own) = scan.reference else {
            let has_times = scan.map.time_s.iter().any(|time_s| time_s.is_finite());
            if has_times && undated.last() != Some(&scan.path) {
                undated.push(scan.path.clone());
            }
            scan.map.time_s.fill(f64::NAN);
            continue;
        };
        let later_s = own.seconds_since(first);
        for time_s in &mut scan.map.time_s {
            *time_s += later_s;
        }
        scan.reference = Some(first);
    }
    undated
}

/// What a file or a group of it holds.
#[derive(Default)]
struct Found {
    scans: Vec<ReadScan>,
    /// Sweeps and rays that are of no use, and why.
    skipped: Vec<String>,
    /// What was not understood.
    warnings: Vec<String>,
}

/// Reads the scans of a file; the texts name the sweeps that are skipped and the times that were not understood.
///
/// # Errors
/// A file that cannot be read, is damaged or cut short, has no scan in elevation, or no velocity that is not missing; a variable that
/// cannot be understood.
pub fn read(path: &Path, format: &ScanFormat) -> Result<(Vec<ReadScan>, Vec<String>), Error> {
    let (_, length, magic) = text_file::begin(path)?;
    let found = match &magic[..] {
        [b'C', b'D', b'F', ..] | [0x89, b'H', b'D', b'F', ..] => netcdf(path, format)?,
        _ => text(path, length, format)?,
    };
    if found.scans.is_empty() {
        let reason = match &found.skipped[..] {
            [only] => only.clone(),
            all => format!(
                "it has no scan in elevation (RHI) that can be used: {}",
                all.join("; ")
            ),
        };
        return Err(Error::input(path, reason));
    }
    let mut notes = Vec::new();
    for what in found.skipped {
        notes.push(format!("{what}: skipped"));
    }
    notes.extend(found.warnings);
    Ok((found.scans, notes))
}

fn netcdf(path: &Path, format: &ScanFormat) -> Result<Found, Error> {
    let mut all = Found::default();
    let groups = open_groups(path, "elevation", cfradial::has_rays)?;
    for (sweep, group) in groups.into_iter().enumerate() {
        let found = match cfradial::scans(&group, path, format, sweep) {
            Ok(found) => found,
            Err(reason) => {
                all.skipped.push(group.named(reason));
                continue;
            }
        };
        all.scans.extend(found.scans);
        all.skipped.extend(found.skipped);
        all.warnings.extend(found.warnings);
    }
    Ok(all)
}

fn text(path: &Path, length: u64, format: &ScanFormat) -> Result<Found, Error> {
    let bytes = text_bytes(path, length)?;
    scans_of_text(&bytes, path, format).map_err(|reason| Error::input(path, reason))
}

/// The bytes of a text that is not too large.
fn text_bytes(path: &Path, length: u64) -> Result<Vec<u8>, Error> {
    if length > text_file::LARGEST_DATA_BYTES {
        return Err(Error::input(
            path,
            format!(
                "it has {length} bytes; texts of at most {} are read",
                text_file::LARGEST_DATA_BYTES
            ),
        ));
    }
    std::fs::read(path).map_err(Error::io("read", path))
}

fn scans_of_text(bytes: &[u8], path: &Path, format: &ScanFormat) -> Result<Found, String> {
    let text = decoded(bytes, path, format)?;
    if is_hpl(&text) {
        hpl::scans(&text, path, format)
    } else {
        table::scans(&text, path, format)
    }
}

/// Whether a text is a HALO file of rays, and no table.
fn is_hpl(text: &str) -> bool {
    let mut lines = text.lines().take(60);
    lines.any(|line| line.trim_start().starts_with("****"))
}

/// The text of a file of scans.
///
/// # Errors
/// Bytes that are no text; a file called as those of HALO without their header; a field of a HALO file, which has one column of velocities.
fn decoded(bytes: &[u8], path: &Path, format: &ScanFormat) -> Result<String, String> {
    // The text, and a text of its own for each cell.
    let cells = bytes
        .iter()
        .filter(|byte| matches!(byte, b',' | b';' | b'\n' | b' ' | b'\t'))
        .count();
    machine::holds("its table", 2.0 * bytes.len() as f64 + 64.0 * cells as f64)?;
    if bytes.starts_with(b"PK\x03\x04") {
        return Err("it is a ZIP archive, or a workbook, which is one: unpack it, or store the sheet as CSV".into());
    }
    // Files of instruments have names of places in all encodings; numbers are the same in each.
    let text = text_file::decode(bytes).unwrap_or_else(|_| {
        text_file::with_line_feeds(bytes.iter().map(|byte| char::from(*byte)).collect())
    });
    if text.contains('\0') {
        return Err("it is no text, nor NetCDF: it has bytes of value 0; a table in UTF-8, or UTF-16 behind its mark, a HALO file or NetCDF is \
                    read"
            .into());
    }
    let is_called_hpl = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("hpl"));
    match (is_hpl(&text), is_called_hpl) {
        (true, _) if format.field.is_some() => {
            Err("--field has no effect: a HALO file has one column of velocities".into())
        }
        (false, true) => Err("it has no line ****, which ends the header of a HALO file of rays; profiles of winds and of the background are \
                              not read"
            .into()),
        _ => Ok(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn times_of_files_count_from_one_date_or_from_none() {
        let scan = |name: &str, reference: Option<&str>| {
            let map = ScanMap {
                elevation_rad: vec![0.1, 0.2],
                time_s: vec![1.0, 2.0],
                range_m: vec![300.0],
                velocity_m_s: Array2::zeros((2, 1)),
                sigma_m_s: None,
                fold_m_s: None,
            };
            ReadScan {
                reference: reference.and_then(UtcTime::parse),
                ..ReadScan::new(Path::new(name), 0, map)
            }
        };
        let mut scans = [
            scan("a", Some("2024-01-31T12:00:00Z")),
            scan("b", None),
            scan("c", Some("2024-01-31T12:01:00Z")),
        ];
        let undated = share_origin(&mut scans.iter_mut().collect::<Vec<_>>());
        assert_eq!(undated, [PathBuf::from("b")]);
        assert_eq!(scans[0].map.time_s, [1.0, 2.0]);
        assert!(scans[1].map.time_s.iter().all(|time_s| time_s.is_nan()));
        assert_eq!(scans[2].map.time_s, [61.0, 62.0]);
        assert_eq!(scans[2].reference, scans[0].reference);
        let mut without = [scan("a", None), scan("b", None)];
        assert!(share_origin(&mut without.iter_mut().collect::<Vec<_>>()).is_empty());
        assert_eq!(without[1].map.time_s, [1.0, 2.0]);
    }

    #[test]
    fn what_is_no_text_of_a_scan_is_told_apart() {
        let kind = |bytes: &[u8], name: &str| {
            let text = match decoded(bytes, Path::new(name), &ScanFormat::default()) {
                Ok(text) => text,
                Err(reason) => return reason,
            };
            let kind = if is_hpl(&text) { "hpl" } else { "table" };
            format!("{kind} {}", text.lines().count())
        };
        for end in ["\n", "\r\n", "\r"] {
            let hpl = ["Number of gates: 3", "****", "12.0 90.0 3.0"].join(end);
            assert_eq!(kind(hpl.as_bytes(), "a.hpl"), "hpl 3");
            assert_eq!(kind(hpl.as_bytes(), "a.txt"), "hpl 3");
            let table = ["# x", "a,b", "1,2"].join(end);
            assert_eq!(kind(table.as_bytes(), "a.csv"), "table 3");
        }
        assert_eq!(kind(b"Site:\tZ\xFCrich\n****\n", "a.hpl"), "hpl 2");
        for (bytes, name, words) in [
            (
                &b"12\n 24.0 200.0 5.0\n"[..],
                "Processed.HPL",
                "no line ****",
            ),
            (b"PK\x03\x04\0\0", "a.xlsx", "ZIP archive"),
            (b"a\0,\0b\0", "a.csv", "bytes of value 0"),
        ] {
            let refused = kind(bytes, name);
            assert!(refused.contains(words), "{refused}");
        }
    }
}
