//! `wakescope estimate`: signals of a run come out as its own map, from every format; signals that are none are refused.

use super::cli::{SMALL, names};
use super::wakescope;
use std::fs;
use std::path::Path;
use wakescope_sim::Silent;
use wakescope_sim::io::csv_input::TextTable;
use wakescope_sim::io::raw::RawFormat;
use wakescope_sim::measure::recorded::{self, Recorded, RecordedOptions};
use wakescope_sim::plan::Plan;
use wakescope_sim::scene::SceneFile;

mod formats;
mod noise;

pub(super) use formats::{npy, npz};

/// A folder with the scene and its signals, all realisations.
fn recorded_run(words: &str) -> tempfile::TempDir {
    recorded_scan(RHI, words)
}

/// The lines of the small scene.
const RHI: &str =
    "elevation_min_rad = 0.1\nelevation_max_rad = 0.12\nelevation_step_rad = 2.5e-3\n";

/// The same with other lines.
fn recorded_scan(scan: &str, words: &str) -> tempfile::TempDir {
    let temp = tempfile::tempdir().unwrap();
    let lines = "azimuth_rad,elevation_rad,pulses\n0.3,0.2,2\n0.4,0.2,5\n0.5,0.3,1\n";
    fs::write(temp.path().join("lines.csv"), lines).unwrap();
    let scene = SMALL
        .replace(
            "signals = true",
            "signals = true\nsignals_of = \"all\"\npng = false",
        )
        .replace(RHI, scan);
    fs::write(temp.path().join("s.toml"), format!("{scene}{words}")).unwrap();
    let out = wakescope(temp.path(), &["run", "s.toml", "--out", "o", "--quiet"]);
    assert!(out.status.success(), "{out:?}");
    temp
}

/// Numbers of a column, bit by bit.
fn column(path: &Path, name: &str) -> Vec<u64> {
    let table = TextTable::read(path).unwrap();
    let place = table.column(name).unwrap();
    (0..table.rows.len())
        .map(|row| table.number(row, place).to_bits())
        .collect()
}

/// The samples of a `signals.nc`, record after record, and the samples of one.
pub(super) fn samples(path: &Path) -> (Vec<f64>, usize) {
    let mut file = netcdf3::FileReader::open(path).unwrap();
    let samples = file.data_set().dim_size("time").unwrap();
    (file.read_var_f64("current_a").unwrap(), samples)
}

#[test]
fn a_runs_own_signals_give_the_bytes_of_the_run() {
    let temp = recorded_run("");
    let out = wakescope(
        temp.path(),
        &[
            "estimate",
            "o/signals.nc",
            "--scene",
            "s.toml",
            "--out",
            "e",
            "--quiet",
        ],
    );
    assert!(out.status.success(), "{out:?}");
    assert_eq!(
        names(&temp.path().join("e")),
        [
            "map.csv",
            "map.nc",
            "map.svg",
            "predicted.csv",
            "scene.toml"
        ]
    );
    for name in ["map.csv", "map.nc", "map.svg", "scene.toml"] {
        let of = |folder: &str| fs::read(temp.path().join(folder).join(name)).unwrap();
        assert_eq!(of("o"), of("e"), "{name}");
    }
    let predicted = column(&temp.path().join("e/predicted.csv"), "predicted_std_m_s");
    let known: Vec<f64> = predicted
        .into_iter()
        .map(f64::from_bits)
        .filter(|v| v.is_finite())
        .collect();
    // 10 dB, some ten independent windows.
    assert!(
        known.len() > 150 && known.iter().all(|v| (0.01..1.0).contains(v)),
        "{known:?}"
    );
}

#[test]
fn signals_of_any_pattern_give_the_bytes_of_the_run() {
    let estimate = |folder: &Path, out: &'static str, words: &[&str]| {
        let all = [
            &[
                "estimate",
                "o/signals.nc",
                "--scene",
                "s.toml",
                "--out",
                out,
                "--quiet",
            ],
            words,
        ]
        .concat();
        wakescope(folder, &all)
    };
    let back = format!("{RHI}head = {{ sweeps = 3, direction = \"alternate\" }}\n");
    for scan in [
        "pattern = { kind = \"ppi\", azimuth_min_rad = 1.3, azimuth_max_rad = 1.5 }\nwind_of_pulses.kind = \"pulse\"\n\
         head = { motion = \"continuous\", rate_rad_s = 3.0 }\n",
        "pattern = { kind = \"vad\", beams = 6 }\n",
        "pattern = { kind = \"list\", file = \"lines.csv\" }\n",
        &back,
    ] {
        let temp = recorded_scan(scan, "");
        let folder = temp.path();
        let out = estimate(folder, "e", &[]);
        assert!(out.status.success(), "{scan}: {out:?}");
        let found = names(&folder.join("e"));
        assert!(
            found.contains(&"map.nc".to_owned())
                && found.contains(&"scan.svg".to_owned()) == (scan != back),
            "{found:?}"
        );
        for name in found.iter().filter(|name| *name != "predicted.csv") {
            assert!(
                fs::read(folder.join("e").join(name)).unwrap()
                    == fs::read(folder.join("o").join(name)).unwrap(),
                "{name}"
            );
        }
        // Spectra are of records that nothing is known of, whose lines are in a plane; realisations have the same times.
        let out = estimate(folder, "x", &["--spectra"]);
        if scan == back {
            assert!(out.status.success(), "{out:?}");
            // The lines at the turns are lines of their own, and the truth is known as without spectra.
            for name in ["map.csv", "map.nc", "predicted.csv"] {
                assert!(
                    fs::read(folder.join("x").join(name)).unwrap()
                        == fs::read(folder.join("e").join(name)).unwrap(),
                    "{name}"
                );
            }
            let file = netcdf3::FileReader::open(folder.join("x/spectra.nc")).unwrap();
            assert_eq!(file.data_set().dim_size("line"), Some(3 * 3 * 9));
        } else {
            let message = String::from_utf8(out.stderr).unwrap();
            assert!(
                out.status.code() == Some(2) && message.contains("others need kind = \"rhi\""),
                "{message}"
            );
        }
    }
}

/// Another seed draws other signals: files that claim it over these would tell of a run that nobody made.
#[test]
fn signals_of_another_draw_are_not_taken_for_those_of_the_scene() {
    let temp = recorded_run("");
    let scene = fs::read_to_string(temp.path().join("s.toml")).unwrap();
    fs::write(
        temp.path().join("seed.toml"),
        scene.replace("seed = 5", "seed = 6"),
    )
    .unwrap();
    fs::write(
        temp.path().join("more.toml"),
        scene.replace("realisations = 3", "realisations = 7"),
    )
    .unwrap();
    for (words, part) in [
        ("--scene seed.toml", "with seed = 5, and seed is 6"),
        ("--scene s.toml --seed 77", "with seed = 5, and seed is 77"),
        (
            "--scene more.toml",
            "with scan.realisations = 3, and scan.realisations is 7",
        ),
    ] {
        let mut all = vec!["estimate", "o/signals.nc", "--out", "e", "--quiet"];
        all.extend(words.split_whitespace());
        let out = wakescope(temp.path(), &all);
        let message = String::from_utf8(out.stderr).unwrap();
        assert!(
            out.status.code() == Some(2) && message.contains(part),
            "{words}: {message}"
        );
        assert!(!temp.path().join("e").exists());
    }
}

#[test]
fn another_estimator_sees_the_truth_of_the_same_signals() {
    let temp = recorded_run("");
    let scene =
        fs::read_to_string(temp.path().join("s.toml")).unwrap() + "[estimator]\nradius_m = 4.0\n";
    fs::write(temp.path().join("t.toml"), scene).unwrap();
    for (words, folder) in [
        (["map", "t.toml", "--out", "run", "--quiet"].to_vec(), "run"),
        (
            [
                "estimate",
                "o/signals.nc",
                "--scene",
                "t.toml",
                "--out",
                "est",
                "--quiet",
            ]
            .to_vec(),
            "est",
        ),
    ] {
        assert!(wakescope(temp.path(), &words).status.success(), "{folder}");
    }
    let of = |folder: &str| fs::read(temp.path().join(folder).join("map.nc")).unwrap();
    assert_eq!(of("run"), of("est"));
}

#[test]
fn tiles_of_lines_and_gates_change_no_bit() {
    for words in [
        "",
        "method = { kind = \"autoregressive\" }\nweighting = \"rectangular\"",
    ] {
        tiles_change_no_bit(&format!("[estimator]\nradius_m = 6.0\n{words}\n"));
    }
}

fn tiles_change_no_bit(words: &str) {
    let temp = recorded_run(words);
    let scene = SceneFile::read(&temp.path().join("s.toml")).unwrap();
    let with = |block_bytes: Option<usize>| {
        let path = temp.path().join("o/signals.nc");
        let mut records = recorded::open(&path, &RawFormat::default(), &scene.content).unwrap();
        let plan = Plan::new(scene.clone(), wakescope_sim::Target::Map).unwrap();
        let options = RecordedOptions {
            block_bytes,
            ..RecordedOptions::default()
        };
        match recorded::estimate((&plan, false), &mut records, &options, &Silent).unwrap() {
            Recorded::Measured { scans, .. } => scans,
            Recorded::OfRun { .. } => panic!("nothing is known of them"),
        }
    };
    let whole = with(None);
    assert_eq!(whole.len(), 3);
    for bytes in [1, 100_000] {
        for (a, b) in whole.iter().zip(&with(Some(bytes))) {
            let bits = |values: &ndarray::Array2<f64>| values.mapv(f64::to_bits);
            assert_eq!(
                bits(&a.velocity_m_s),
                bits(&b.velocity_m_s),
                "{words} {bytes}"
            );
            assert_eq!(
                (bits(&a.n_eff), &a.flagged, bits(&a.snr_db)),
                (bits(&b.n_eff), &b.flagged, bits(&b.snr_db))
            );
        }
    }
}

#[test]
fn complex_signals_and_spectra_on_request() {
    let temp = recorded_run("[detector]\nsignal = \"baseband\"\n");
    let estimate = |words: &[&str]| {
        let out = wakescope(
            temp.path(),
            &[
                &["estimate", "o/signals.nc", "--scene", "s.toml", "--quiet"],
                words,
            ]
            .concat(),
        );
        assert!(out.status.success(), "{out:?}");
    };
    estimate(&["--out", "own"]);
    let of = |folder: &str| fs::read(temp.path().join(folder).join("map.nc")).unwrap();
    assert_eq!(of("o"), of("own"));
    estimate(&["--out", "spectra", "--spectra"]);
    let mut file = netcdf3::FileReader::open(temp.path().join("spectra/spectra.nc")).unwrap();
    let (density, velocity) = (
        file.read_var_f32("density").unwrap(),
        file.read_var_f64("velocity").unwrap(),
    );
    // The first of three realisations.
    let found = column(&temp.path().join("spectra/map.csv"), "v_scan_m_s");
    assert!(velocity.windows(2).all(|pair| pair[1] > pair[0]));
    assert_eq!(density.len(), 3 * found.len() * velocity.len());
    let step_m_s = velocity[1] - velocity[0];
    for (spectrum, found) in density.chunks(velocity.len()).zip(found) {
        let peak = (0..spectrum.len())
            .max_by(|a, b| spectrum[*a].total_cmp(&spectrum[*b]))
            .unwrap();
        assert!(
            (velocity[peak] - f64::from_bits(found)).abs() < step_m_s,
            "{} {}",
            velocity[peak],
            f64::from_bits(found)
        );
    }
}

/// The spectrum of a receiver that mixes the other way is reversed: its intermediate frequency is
/// mirrored at a quarter of the sampling rate, complex samples are conjugates.
#[test]
fn a_receiver_that_mixes_the_other_way_gives_the_same_velocities() {
    let turned = [
        ("", "[detector]\nintermediate_frequency_hz = 45e6\n"),
        (
            "[detector]\nsignal = \"baseband\"\n",
            "[detector]\nsignal = \"baseband\"\n",
        ),
    ];
    for (detector, turned) in turned {
        let temp = recorded_run(detector);
        let folder = temp.path();
        let is_complex = !detector.is_empty();
        let (mut all, count) = samples(&folder.join("o/signals.nc"));
        let records = all.len() / count;
        let mut shape = vec![records, count];
        if is_complex {
            let mut file = netcdf3::FileReader::open(folder.join("o/signals.nc")).unwrap();
            let second = file.read_var_f64("quadrature_a").unwrap();
            all = all
                .iter()
                .zip(second)
                .flat_map(|(re, im)| [*re, im])
                .collect();
            shape.push(2);
        }
        fs::write(folder.join("plain.npy"), npy(false, &shape, &all)).unwrap();
        for (index, value) in all.iter_mut().enumerate() {
            let sample = if is_complex { index } else { index % count };
            if sample % 2 == 1 {
                *value = -*value;
            }
        }
        fs::write(folder.join("turned.npy"), npy(false, &shape, &all)).unwrap();
        let scene = fs::read_to_string(folder.join("s.toml")).unwrap();
        let scene = scene.replace(detector, "") + turned;
        fs::write(folder.join("turned.toml"), scene).unwrap();
        let estimate = |data: &str, scene: &str, more: &[&str]| {
            let file = format!("{data}.npy");
            let words = [
                "estimate", &file, "--scene", scene, "--out", data, "--quiet",
            ];
            let pairs: &[&str] = if is_complex { &["--complex"] } else { &[] };
            let out = wakescope(folder, &[&words, pairs, more].concat());
            assert!(out.status.success(), "{out:?}");
            let map = folder.join(data).join("map.csv");
            ["v_mean_m_s", "snr_db"].map(|name| column(&map, name))
        };
        let plain = estimate("plain", "s.toml", &[]);
        assert_eq!(plain, estimate("turned", "turned.toml", &["--towards"]));
        fs::remove_dir_all(folder.join("turned")).unwrap();
        let reversed = estimate("turned", "turned.toml", &[]);
        let sums =
            [&plain[0], &reversed[0]].map(|v| v.iter().map(|v| f64::from_bits(*v)).sum::<f64>());
        assert!(sums[0] * sums[1] < 0.0, "{sums:?}");
    }
}
