//! Files that Python's libraries wrote (`tests/files-of-others/make.py`): each gives the values that its writer put into it.

use super::wakescope;
use std::fs;
use std::path::{Path, PathBuf};
use wakescope_sim::io::csv_input::TextTable;
use wakescope_sim::io::scans::{ReadScan, ScanFormat, read};

fn stored(name: &str) -> PathBuf {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/files-of-others");
    Path::new(folder).join(name)
}

fn scans_of(name: &str, format: &ScanFormat) -> Vec<ReadScan> {
    let (scans, notes) = read(&stored(name), format).unwrap();
    let has_gap = ["angles_with_a_gap.nc", "ranges_of_the_root.nc"].contains(&name);
    assert_eq!(!notes.is_empty(), has_gap, "{name}: {notes:?}");
    scans
}

/// Largest difference of the velocities of a scan from the truth, apart from whole multiples of `fold_m_s`, m/s; and how many are there.
fn held_against_truth(scan: &ReadScan, fold_m_s: Option<f64>) -> (f64, usize) {
    let truth = scans_of("truth.csv", &ScanFormat::default()).remove(0).map;
    let close = |a: &[f64], b: &[f64]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5 * b.abs())
    };
    assert!(close(&scan.map.range_m, &truth.range_m));
    assert!(close(&scan.map.elevation_rad, &truth.elevation_rad));
    let both = scan.map.velocity_m_s.iter().zip(&truth.velocity_m_s);
    let differences = both.filter(|(own, _)| own.is_finite()).map(|(own, truth)| {
        let fold_m_s = fold_m_s.unwrap_or(f64::INFINITY);
        let turns = ((own - truth) / fold_m_s).round();
        match turns == 0.0 {
            true => (own - truth).abs(),
            false => (own - truth - turns * fold_m_s).abs(),
        }
    });
    let all: Vec<f64> = differences.collect();
    (all.iter().copied().fold(0.0, f64::max), all.len())
}

#[test]
fn scans_have_the_values_that_their_writers_put_into_them() {
    for name in [
        "unsigned_shorts_of_xarray.nc",
        "times_in_minutes.nc",
        "ranges_of_each_ray.nc",
        "angles_with_a_gap.nc",
        "gates_before_rays.nc",
        "table_of_savetxt.csv",
        "table_of_a_spreadsheet.csv",
        #[cfg(feature = "netcdf4")]
        "times_after_a_text.nc",
        #[cfg(feature = "netcdf4")]
        "ranges_of_the_root.nc",
        #[cfg(feature = "netcdf4")]
        "types_that_are_not_needed.nc",
        #[cfg(feature = "netcdf4")]
        "dimensions_called_as_variables.nc",
    ] {
        let mut scans = scans_of(name, &ScanFormat::default());
        assert_eq!(scans.len(), 1, "{name}");
        if name == "angles_with_a_gap.nc" {
            let map = &mut scans[0].map;
            // The two rays below the horizon have no velocities.
            let below: Vec<f64> = map.elevation_rad.drain(..2).collect();
            assert!((below[0] + 8f64.to_radians()).abs() < 1e-6, "{below:?}");
            map.velocity_m_s = map.velocity_m_s.slice(ndarray::s![2.., ..]).to_owned();
        }
        let (difference_m_s, count) = held_against_truth(&scans[0], None);
        assert!(difference_m_s < 1e-5, "{name}: {difference_m_s}");
        assert_eq!(count, 31 * 28, "{name}");
        if name.ends_with(".nc") && name != "types_that_are_not_needed.nc" {
            let first_s = match name {
                "angles_with_a_gap.nc" => scans[0].map.time_s[2] - 0.2,
                _ => scans[0].map.time_s[0],
            };
            // To the digits of a time in minutes.
            let first = scans[0].reference.unwrap().after_s(first_s + 1e-6);
            assert_eq!(first.to_string(), "2024-01-31T12:01:00Z", "{name}");
        }
    }
}

#[test]
fn a_least_ratio_counts_bytes_without_sign_and_their_packed_limits() {
    let loud = ScanFormat {
        min_snr_db: Some(0.0),
        ..ScanFormat::default()
    };
    let scans = scans_of("unsigned_bytes_of_a_ratio.nc", &loud);
    let (difference_m_s, count) = held_against_truth(&scans[0], None);
    assert!(
        difference_m_s < 1e-6 && (500..700).contains(&count),
        "{difference_m_s} {count}"
    );
    // The noise of that file has one value, which is taken for a missing one.
    let path = stored("unsigned_bytes_of_a_ratio.nc");
    let (all, notes) = read(&path, &ScanFormat::default()).unwrap();
    assert_eq!(held_against_truth(&all[0], None), (difference_m_s, count));
    assert!(notes[0].contains("velocities are 19 m/s"), "{notes:?}");
}

#[test]
fn each_sweep_and_ray_has_its_own_nyquist_velocity() {
    for name in [
        "nyquist_of_rays.nc",
        #[cfg(feature = "netcdf4")]
        "nyquist_of_sweeps.nc",
    ] {
        let scans = scans_of(name, &ScanFormat::default());
        let folds: Vec<_> = scans.iter().map(|scan| scan.map.fold_m_s).collect();
        assert_eq!(folds, [Some(60.0), Some(15.0)], "{name}");
        for scan in &scans {
            let (difference_m_s, count) = held_against_truth(scan, scan.map.fold_m_s);
            assert!(
                difference_m_s < 1e-5 && count == 31 * 28,
                "{name}: {difference_m_s}"
            );
        }
    }
}

/// The lines of the records of 5 m/s.
const SCENE: &str = "seed = 3\n[scan]\nelevation_min_rad = 0.06\nelevation_max_rad = 0.12\nelevation_step_rad = 0.01\n\
                     range_min_m = 320.0\nrange_max_m = 480.0\npulses_per_line = 4\nrealisations = 1\n";

#[test]
fn samples_without_sign_and_with_an_offset_have_the_velocity_of_the_air() {
    let temp = tempfile::tempdir().unwrap();
    let estimator = "[estimator]\ngate_step_samples = 16\nmethod.kind = \"likelihood\"\n";
    for (name, detector, words) in [
        (
            "samples_of_a_byte.npy",
            "[detector]\nsignal = \"baseband\"\n",
            &["--complex"][..],
        ),
        (
            "samples_of_twelve_bits.npy",
            "[detector]\nsignal = \"baseband\"\n",
            &["--complex"],
        ),
        #[cfg(feature = "netcdf4")]
        ("samples_with_an_offset.nc", "", &[]),
    ] {
        let scene = [SCENE, detector, estimator].concat();
        fs::write(temp.path().join("s.toml"), scene).unwrap();
        let path = stored(name);
        let file = path.to_str().unwrap();
        let given = [
            "estimate",
            file,
            "--scene",
            "s.toml",
            "--out",
            "e",
            "--overwrite",
        ];
        let out = wakescope(temp.path(), &[&given, words].concat());
        assert!(out.status.success(), "{name}: {out:?}");
        let table = TextTable::read(&temp.path().join("e/map.csv")).unwrap();
        let column = table.column("v_mean_m_s").unwrap();
        let values: Vec<f64> = (0..table.rows.len())
            .map(|row| table.number(row, column))
            .filter(|velocity| velocity.is_finite())
            .collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        assert!(
            values.len() > 20 && (mean - 5.0).abs() < 0.2,
            "{name}: {mean} of {values:?}"
        );
    }
}
