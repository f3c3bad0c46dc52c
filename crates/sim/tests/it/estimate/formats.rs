//! Every format of raw signals, and files that are none.

use super::{column, recorded_run, samples};
use crate::cli::{SMALL, names};
use crate::wakescope;
use std::fs;
use std::path::Path;
use wakescope_sim::io::raw::RawFormat;
use wakescope_sim::measure::recorded;
use wakescope_sim::plan::Plan;
use wakescope_sim::scene::SceneFile;

#[test]
fn every_format_and_order_gives_the_velocities_of_the_run() {
    let temp = recorded_run("");
    let (all, samples) = samples(&temp.path().join("o/signals.nc"));
    let one = &all[..all.len() / 3];
    let rows = one.len() / samples;
    let bytes = |at: &dyn Fn(usize) -> f64| {
        (0..one.len())
            .flat_map(|i| at(i).to_be_bytes())
            .collect::<Vec<u8>>()
    };
    let npy = {
        let header =
            format!("{{'descr': '>f8', 'fortran_order': False, 'shape': ({rows}, {samples}), }}\n");
        let length = (header.len() as u16).to_le_bytes();
        [
            b"\x93NUMPY\x01\x00",
            &length[..],
            header.as_bytes(),
            &bytes(&|i| one[i]),
        ]
        .concat()
    };
    let lines = rows / 2;
    // One time for all pulses of a line.
    let scene = SceneFile::read(&temp.path().join("s.toml")).unwrap();
    let elevation_rad = Plan::new(scene, wakescope_sim::Target::Map)
        .unwrap()
        .geometry
        .elevation_rad
        .clone();
    let rays: Vec<String> = elevation_rad
        .iter()
        .enumerate()
        .map(|(i, e)| format!("{e},{i}\n"))
        .collect();
    fs::write(
        temp.path().join("rays.csv"),
        format!("elevation_rad,time_s\n{}", rays.concat()),
    )
    .unwrap();
    for (name, content, words) in [
        (
            "a.bin",
            [b"head".to_vec(), bytes(&|i| one[i])].concat(),
            "--format f64 --byte-order big --header-bytes 4",
        ),
        // [pulse, line, sample] and [sample, line, pulse] of [line, pulse, sample].
        (
            "b.bin",
            bytes(&|i| {
                one[(i / samples % lines * 2 + i / samples / lines) * samples + i % samples]
            }),
            "--format f64 --byte-order big --order pulse-major",
        ),
        (
            "c.bin",
            bytes(&|i| one[i % rows * samples + i / rows]),
            "--format f64 --byte-order big --order sample-major",
        ),
        ("d.npy", npy.clone(), "--rays rays.csv"),
        ("e.npy", npy, ""),
    ] {
        fs::write(temp.path().join(name), content).unwrap();
        let mut all = vec![
            "estimate",
            name,
            "--scene",
            "s.toml",
            "--out",
            name.split('.').next().unwrap(),
            "--quiet",
            "--noise",
            "scene",
        ];
        all.extend(words.split_whitespace());
        let out = wakescope(temp.path(), &all);
        assert!(out.status.success(), "{name}: {out:?}");
        let found = temp
            .path()
            .join(name.split('.').next().unwrap())
            .join("map.csv");
        let run = temp.path().join("o/map.csv");
        assert_eq!(
            column(&found, "v_mean_m_s"),
            column(&run, "v_scan_m_s"),
            "{name}"
        );
        assert_eq!(column(&found, "n_eff"), column(&run, "n_eff"), "{name}");
        let snr_db: Vec<f64> = column(&found, "snr_db")
            .into_iter()
            .map(f64::from_bits)
            .collect();
        let mean_db = snr_db.iter().sum::<f64>() / snr_db.len() as f64;
        assert!((8.0..12.0).contains(&mean_db), "{name}: {mean_db}");
    }
}

#[test]
fn arrays_that_numpy_wrote_are_read_by_name() {
    // np.savez("numpy.npz", signals=np.arange(24, dtype="<i2").reshape(4, 6), elevation_rad=[0.1, 0.1, 0.2, 0.2])
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/sim/numpy.npz");
    let scene = SceneFile::parse(SMALL, Path::new("s.toml")).unwrap();
    let mut records = recorded::open(&path, &RawFormat::default(), &scene.content).unwrap();
    assert_eq!(
        (records.records, records.samples, records.is_complex),
        (4, 6, false)
    );
    assert_eq!(records.elevation_rad, Some(vec![0.1, 0.1, 0.2, 0.2]));
    let found: Vec<f64> = records.read(1..3).unwrap().iter().map(|z| z.re).collect();
    assert_eq!(found, (6..18).map(f64::from).collect::<Vec<_>>());
}

/// An array of doubles as numpy.save writes it.
pub(crate) fn npy(is_fortran: bool, shape: &[usize], values: &[f64]) -> Vec<u8> {
    let order = if is_fortran { "True" } else { "False" };
    let shape: String = shape.iter().map(|length| format!("{length},")).collect();
    let header = format!("{{'descr': '<f8', 'fortran_order': {order}, 'shape': ({shape}), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// An archive of arrays of doubles as numpy.savez writes it, without checksums.
pub(crate) fn npz(arrays: &[(&str, &[f64], &[usize])]) -> Vec<u8> {
    let (mut out, mut table) = (Vec::new(), Vec::new());
    for (name, values, shape) in arrays {
        let data = npy(false, shape, values);
        let (name, at) = (format!("{name}.npy"), out.len() as u32);
        let size = (data.len() as u32).to_le_bytes();
        let head = [
            &[0_u8; 12][..],
            &[0; 4],
            &size,
            &size,
            &(name.len() as u16).to_le_bytes(),
            &[0; 2],
        ]
        .concat();
        out.extend([&b"PK\x03\x04"[..], &head[2..], name.as_bytes(), &data].concat());
        table.extend(
            [
                &b"PK\x01\x02"[..],
                &[0; 2],
                &head[2..],
                &[0; 10],
                &at.to_le_bytes(),
                name.as_bytes(),
            ]
            .concat(),
        );
    }
    let (at, size, count) = (
        out.len() as u32,
        table.len() as u32,
        (arrays.len() as u16).to_le_bytes(),
    );
    out.extend(table);
    out.extend(
        [
            &b"PK\x05\x06"[..],
            &[0; 4],
            &count,
            &count,
            &size.to_le_bytes(),
            &at.to_le_bytes(),
            &[0; 2],
        ]
        .concat(),
    );
    out
}

/// A `signals.nc` whose samples all have one value.
fn with_all_samples(nc: &[u8], all: &[f64], value: f64) -> Vec<u8> {
    let stored: Vec<u8> = all.iter().flat_map(|sample| sample.to_be_bytes()).collect();
    let at = nc
        .windows(stored.len())
        .position(|part| part == stored)
        .unwrap();
    let mut out = nc.to_vec();
    out[at..at + stored.len()].copy_from_slice(
        &all.iter()
            .flat_map(|_| value.to_be_bytes())
            .collect::<Vec<u8>>(),
    );
    out
}

#[test]
fn signals_that_are_none_are_refused_and_nothing_is_written() {
    let temp = recorded_run("");
    let folder = temp.path();
    let (all, samples) = samples(&folder.join("o/signals.nc"));
    let one: Vec<f64> = all[..all.len() / 3].to_vec();
    let binary = |scale: f64| {
        one.iter()
            .flat_map(|a| ((a * scale) as i16).to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let counts = binary(1000.0 / one.iter().fold(0.0_f64, |m, a| m.max(a.abs())));
    let nc = fs::read(folder.join("o/signals.nc")).unwrap();
    fs::write(folder.join("cut.nc"), &nc[..nc.len() - 4000]).unwrap();
    fs::write(folder.join("c.bin"), &counts).unwrap();
    fs::write(folder.join("cut.bin"), &counts[..counts.len() - 7]).unwrap();
    fs::write(folder.join("zero.bin"), vec![0_u8; counts.len()]).unwrap();
    fs::write(folder.join("few.bin"), &counts[..2 * samples * 4]).unwrap();
    fs::write(folder.join("text.csv"), "1,2,3\n4,5,6\n").unwrap();
    fs::write(
        folder.join("short.npy"),
        b"\x93NUMPY\x01\x00\x46\x00{'descr': '<f8', 'fortran_order': False, 'shape': (18, 167), }         \n",
    )
    .unwrap();
    fs::write(folder.join("rays.csv"), "elevation_deg,time_s\n1,0\n2,1\n").unwrap();
    let scene = fs::read_to_string(folder.join("s.toml")).unwrap();
    fs::write(
        folder.join("fast.toml"),
        format!("{scene}[detector]\nsampling_hz = 260e6\n"),
    )
    .unwrap();
    fs::write(
        folder.join("wave.toml"),
        format!("{scene}[laser]\nwavelength_m = 1.6e-6\n"),
    )
    .unwrap();
    fs::write(
        folder.join("base.toml"),
        format!("{scene}[detector]\nsignal = \"baseband\"\n"),
    )
    .unwrap();
    let bits =
        "[detector]\ndigitiser = { kind = \"quantised\", bits = 8, full_scale_over_noise = 5.0 }\n";
    fs::write(folder.join("bits.toml"), format!("{scene}{bits}")).unwrap();
    for (name, value) in [("void.nc", f64::NAN), ("still.nc", 0.0)] {
        fs::write(folder.join(name), with_all_samples(&nc, &all, value)).unwrap();
    }
    let angles: Vec<f64> = (0..2 * all.len() / samples)
        .map(|i| 0.1 + 1e-3 * i as f64)
        .collect();
    fs::write(
        folder.join("more.npz"),
        npz(&[
            ("signals", &all, &[all.len() / samples, samples]),
            ("elevation_rad", &angles, &[angles.len()]),
        ]),
    )
    .unwrap();
    let before = names(folder);
    for (words, parts) in [
        (
            "void.nc --scene s.toml",
            &["void.nc", "all of its samples are missing"][..],
        ),
        (
            "still.nc --scene s.toml",
            &["still.nc", "all of its samples are 0"],
        ),
        (
            "more.npz --scene s.toml",
            &["more.npz", "elevation_rad has 108 values", "54 records"],
        ),
        ("none.nc --scene s.toml", &["none.nc"][..]),
        (
            "cut.nc --scene s.toml",
            &["cut.nc", "more than the file holds"],
        ),
        ("s.toml --scene s.toml", &["s.toml", "--format"]),
        ("c.bin --scene s.toml", &["--format i16"]),
        (
            "cut.bin --scene s.toml --format i16",
            &["cut.bin", "records of 167 samples", "left over"],
        ),
        (
            "few.bin --scene s.toml --format i16",
            &["few.bin", "4 records", "9 lines", "scan.pulses_per_line"],
        ),
        (
            "zero.bin --scene s.toml --format i16",
            &["zero.bin", "all of its samples are 0"],
        ),
        (
            "c.bin --scene bits.toml --format i16",
            &["c.bin", "beyond the 8 bits of detector.digitiser"],
        ),
        ("text.csv --scene s.toml", &["text.csv", "--format"]),
        ("short.npy --scene s.toml", &["short.npy", "cut short"]),
        (
            "o/signals.nc --scene s.toml --variable voltage",
            &["no variable voltage"],
        ),
        (
            "o/signals.nc --scene s.toml --rays rays.csv",
            &["rays.csv", "2 rows", "54 records"],
        ),
        (
            "o/signals.nc --scene fast.toml",
            &["signals.nc", "samples", "scan.range_max_m"],
        ),
        (
            "o/signals.nc --scene wave.toml",
            &["signals.nc", "its wavelength is", "laser.wavelength_m"],
        ),
        (
            "o/signals.nc --scene base.toml",
            &["signals.nc", "its samples are real", "detector.signal"],
        ),
        ("o/signals.nc --scene s.toml --noise loud", &["--noise"]),
    ] {
        let mut all = vec!["estimate"];
        all.extend(words.split_whitespace());
        all.extend(["--out", "x", "--quiet"]);
        let out = wakescope(folder, &all);
        let message = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(2), "{words}: {message}");
        for part in parts {
            assert!(
                message.contains(part),
                "{words}: {part} is not in: {message}"
            );
        }
        assert_eq!(names(folder), before, "{words}");
    }
}
