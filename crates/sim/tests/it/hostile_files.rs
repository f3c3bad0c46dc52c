//! Files that were made to break their reader: each is refused with a message, at once and with little memory.

use super::cli::SMALL;
use super::wakescope;
use std::fs;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use wakescope_sim::io::raw::{RawFormat, RawRecords};

/// An array as numpy stores it.
fn npy(kind: &[u8], shape: &str, numbers: &[u8]) -> Vec<u8> {
    let mut header = b"{'descr': '".to_vec();
    header.extend(kind);
    header.extend(format!("', 'fortran_order': False, 'shape': ({shape}), }}\n").as_bytes());
    [
        b"\x93NUMPY\x01\x00",
        &(header.len() as u16).to_le_bytes()[..],
        &header,
        numbers,
    ]
    .concat()
}

/// Numbers of eight bytes.
fn doubles(values: &[f64]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Writes an archive of arrays that is not compressed; each has so many more bytes of nothing at its end.
fn write_npz(path: &Path, arrays: &[(&str, Vec<u8>, u64)]) {
    let mut file = fs::File::create(path).unwrap();
    let mut table = Vec::new();
    let mut at = 0_u64;
    for (name, bytes, nothing) in arrays {
        let name = format!("{name}.npy");
        let length = bytes.len() as u64 + nothing;
        let mut head = b"PK\x03\x04".to_vec();
        head.resize(26, 0);
        head.extend((name.len() as u32).to_le_bytes());
        head.extend(name.as_bytes());
        file.write_all(&[head.clone(), bytes.clone()].concat())
            .unwrap();
        // A table for files beyond 4 GiB: lengths and places stand in an extra field.
        let mut entry = b"PK\x01\x02".to_vec();
        entry.resize(20, 0);
        entry.extend([0xFF; 8]);
        entry.extend((name.len() as u16).to_le_bytes());
        entry.extend(28_u16.to_le_bytes());
        entry.resize(42, 0);
        entry.extend([0xFF; 4]);
        entry.extend(name.as_bytes());
        entry.extend([1, 0, 24, 0]);
        entry.extend([length, length, at].iter().flat_map(|n| n.to_le_bytes()));
        table.extend(entry);
        at += head.len() as u64 + length;
        file.seek(SeekFrom::Start(at)).unwrap();
    }
    let size = table.len() as u64;
    file.write_all(&table).unwrap();
    let mut end = b"PK\x06\x06".to_vec();
    // Bytes of the record behind this number.
    end.extend(44_u64.to_le_bytes());
    end.resize(32, 0);
    end.extend(
        [arrays.len() as u64, size, at]
            .iter()
            .flat_map(|n| n.to_le_bytes()),
    );
    end.extend(b"PK\x06\x07\0\0\0\0");
    end.extend((at + size).to_le_bytes());
    end.extend([1, 0, 0, 0]);
    end.extend(b"PK\x05\x06\0\0\0\0");
    end.extend([0xFF; 12]);
    end.extend([0, 0]);
    file.write_all(&end).unwrap();
}

fn opened(path: &Path) -> Result<RawRecords, String> {
    RawRecords::open(path, &RawFormat::default(), 3, 1).map_err(|e| e.to_string())
}

#[test]
fn angles_of_an_archive_that_are_not_those_of_the_records_are_refused() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path().join("x.npz");
    let signals = (
        "signals",
        npy(b"<f8", "2, 3", &doubles(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
        0,
    );
    let angles = |count: usize| {
        (
            "elevation_rad",
            npy(b"<f8", &format!("{count},"), &doubles(&vec![0.1; count])),
            0,
        )
    };
    write_npz(&path, &[signals.clone(), angles(2)]);
    assert_eq!(opened(&path).unwrap().elevation_rad, Some(vec![0.1, 0.1]));
    for count in [0, 1, 3, 4] {
        write_npz(&path, &[signals.clone(), angles(count)]);
        let message = opened(&path).unwrap_err();
        assert!(
            message.contains(&format!(
                "elevation_rad has {count} values; one for each of the 2 records"
            )),
            "{message}"
        );
    }
    write_npz(
        &path,
        &[
            signals,
            angles(2),
            ("time_s", npy(b"<f8", "1,", &doubles(&[0.0])), 0),
        ],
    );
    assert!(opened(&path).unwrap_err().contains("time_s has 1 values"));
}

/// 64 GiB of nothing that take no place on the disk.
#[cfg(target_os = "linux")]
#[test]
fn arrays_of_nothing_are_held_against_the_memory_before_they_are_read() {
    const COUNT: u64 = 1 << 36;
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path().join("x.npz");
    let angles = (
        "elevation_rad",
        npy(b"|i1", &format!("{COUNT},"), &[]),
        COUNT,
    );
    write_npz(
        &path,
        &[("signals", npy(b"|i1", "2, 3", &[0; 6]), 0), angles.clone()],
    );
    assert!(
        opened(&path)
            .unwrap_err()
            .contains("one for each of the 2 records")
    );
    write_npz(
        &path,
        &[
            ("signals", npy(b"|i1", &format!("{COUNT}, 1"), &[]), COUNT),
            angles,
        ],
    );
    let message = opened(&path).unwrap_err();
    assert!(
        message.contains("elevation_rad would take 2.7 TB of memory"),
        "{message}"
    );
}

#[test]
fn headers_of_arrays_may_hold_any_byte_and_integers_of_eight() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path().join("x.npy");
    for kind in ["é8".as_bytes(), b"\xff\xfe", "日本".as_bytes(), b"", b"<"] {
        fs::write(&path, npy(kind, "2, 3", &[0; 48])).unwrap();
        let message = opened(&path).unwrap_err();
        assert!(
            message.contains("x.npy") && message.contains("are of the kind"),
            "{message}"
        );
    }
    for (kind, sign) in [(b"<i8", -1_i64), (b"<u8", 1)] {
        let numbers: Vec<u8> = (0..6)
            .flat_map(|i| (sign * 1_000_000_007 * i).to_le_bytes())
            .collect();
        fs::write(&path, npy(kind, "2, 3", &numbers)).unwrap();
        let found = opened(&path).unwrap().read(0..2).unwrap();
        assert!(
            (0..6).all(|i| found[i].re == (sign * 1_000_000_007 * i as i64) as f64),
            "{found:?}"
        );
    }
}

#[cfg(unix)]
#[test]
fn names_that_are_no_text_are_no_obstacle() {
    use std::os::unix::ffi::OsStrExt as _;
    let temp = tempfile::tempdir().unwrap();
    fs::write(temp.path().join("s.toml"), SMALL).unwrap();
    let folder = std::ffi::OsStr::from_bytes(b"o\xff");
    for words in [
        &["efficiency", "s.toml"][..],
        &["efficiency", "s.toml", "--json", "--overwrite"],
    ] {
        let out = std::process::Command::new(env!("CARGO_BIN_EXE_wakescope"))
            .args(words)
            .args(["--quiet", "--out"])
            .arg(folder)
            .current_dir(temp.path())
            .output()
            .unwrap();
        assert!(out.status.success(), "{out:?}");
        assert!(temp.path().join(folder).join("profile.csv").exists());
    }
}

/// A gate that is wider than the scan, and ranges from here to the Moon.
#[test]
fn gates_and_ranges_without_measure_are_refused() {
    let temp = tempfile::tempdir().unwrap();
    let map = |step_m: f64| {
        let rows = (0..900).map(|i| {
            let (line, gate) = (f64::from(i / 30), f64::from(i % 30));
            format!(
                "{},{},{}\n",
                300.0 + step_m * gate,
                0.03 + 4e-3 * line,
                (7.3 * f64::from(i)).sin()
            )
        });
        format!(
            "range_m,elevation_rad,velocity_m_s\n{}",
            rows.collect::<String>()
        )
    };
    fs::write(temp.path().join("near.csv"), map(10.0)).unwrap();
    fs::write(temp.path().join("far.csv"), map(3e7)).unwrap();
    for (words, part) in [
        (
            "retrieve near.csv --gate-std 1e9",
            "std_m of the gate = 1000000000.0: must be at most",
        ),
        (
            "detect near.csv --gate-std 1e9",
            "std_m of the gate = 1000000000.0: must be at most",
        ),
        (
            "retrieve far.csv",
            "far.csv: sweep 0: range reaches 870000300 m",
        ),
        (
            "detect far.csv",
            "far.csv: sweep 0: range reaches 870000300 m",
        ),
    ] {
        let mut all: Vec<&str> = words.split_whitespace().collect();
        all.extend(["--out", "o", "--quiet"]);
        let out = wakescope(temp.path(), &all);
        let message = String::from_utf8(out.stderr).unwrap();
        assert!(
            out.status.code() == Some(2) && message.contains(part),
            "{words}: {message}"
        );
    }
}

/// A limit of the shell counts as memory: what does not fit is refused, and no allocation fails.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_the_shell_counts_as_memory() {
    let temp = tempfile::tempdir().unwrap();
    let lines =
        "[scan]\nelevation_min_rad = 0.0\nelevation_max_rad = 0.09999\nelevation_step_rad = 2e-5\n";
    fs::write(temp.path().join("s.toml"), lines).unwrap();
    let check = |limit: &str| {
        let words = format!(
            "ulimit -v {limit} && exec {} check s.toml --threads 1",
            env!("CARGO_BIN_EXE_wakescope")
        );
        let out = std::process::Command::new("sh")
            .args(["-c", &words])
            .current_dir(temp.path())
            .output()
            .unwrap();
        (out.status.code(), String::from_utf8(out.stderr).unwrap())
    };
    assert_eq!(check("unlimited").0, Some(0));
    let (code, message) = check("1000000");
    assert!(
        code == Some(2) && message.contains("of memory") && message.contains("MB are available"),
        "{message}"
    );
}
