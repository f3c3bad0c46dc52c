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

/// Largest difference of the mean velocities of two maps, m/s.
fn largest_difference_m_s(folder: &Path, maps: [&str; 2]) -> f64 {
    let [a, b] = maps.map(|map| column(&folder.join(map).join("map.csv"), "v_mean_m_s"));
    assert_eq!(a.len(), b.len());
    let differences = a.into_iter().zip(b).map(|both| {
        let (a, b) = (f64::from_bits(both.0), f64::from_bits(both.1));
        assert_eq!(a.is_nan(), b.is_nan());
        if a.is_nan() { 0.0 } else { (a - b).abs() }
    });
    differences.fold(0.0, f64::max)
}

#[test]
fn the_zero_of_a_converter_moves_no_velocity() {
    let temp = recorded_run("");
    let folder = temp.path();
    let (currents, _) = samples(&folder.join("o/signals.nc"));
    let largest = currents
        .iter()
        .fold(0.0_f64, |most, one| most.max(one.abs()));
    let code = |zero: f64| {
        let codes = currents
            .iter()
            .map(move |one| (one / largest * 9000.0 + zero).round());
        codes.map(|code| code as i32)
    };
    let signed: Vec<u8> = code(0.0)
        .flat_map(|code| (code as i16).to_le_bytes())
        .collect();
    let unsigned: Vec<u8> = code(32_768.0)
        .flat_map(|code| (code as u16).to_le_bytes())
        .collect();
    let offset: Vec<u8> = code(3000.0)
        .flat_map(|code| (code as i16).to_le_bytes())
        .collect();
    let rectangular = "weighting = \"rectangular\"\n";
    for (method, weighting) in [
        ("likelihood", ""),
        ("first_moment", rectangular),
        ("pulse_pair", rectangular),
    ] {
        let scene = fs::read_to_string(folder.join("s.toml")).unwrap();
        let estimator = format!("[estimator]\nmethod.kind = \"{method}\"\n{weighting}");
        fs::write(folder.join("m.toml"), scene + &estimator).unwrap();
        for (name, bytes, kind) in [
            ("signed", &signed, "i16"),
            ("unsigned", &unsigned, "u16"),
            ("offset", &offset, "i16"),
        ] {
            fs::write(folder.join(name), bytes).unwrap();
            let out = wakescope(
                folder,
                &[
                    "estimate",
                    name,
                    "--format",
                    kind,
                    "--scene",
                    "m.toml",
                    "--out",
                    "e",
                    "--overwrite",
                ],
            );
            assert!(out.status.success(), "{method} {name}: {out:?}");
            let message = String::from_utf8_lossy(&out.stderr).into_owned();
            assert_eq!(
                message.contains("it is subtracted"),
                name == "offset",
                "{message}"
            );
            fs::rename(folder.join("e"), folder.join(format!("{method}-{name}"))).unwrap();
        }
        let of = |name: &str| format!("{method}-{name}");
        let both = |name: &str| largest_difference_m_s(folder, [&of("signed"), &of(name)]);
        assert_eq!(both("unsigned"), 0.0, "{method}");
        // The mean of the codes without an offset is not 0, but far below their scatter.
        assert!(both("offset") < 0.02, "{method}: {}", both("offset"));
    }
}

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

/// An array of doubles as numpy.save writes it.
pub(super) fn npy(is_fortran: bool, shape: &[usize], values: &[f64]) -> Vec<u8> {
    let order = if is_fortran { "True" } else { "False" };
    let shape: String = shape.iter().map(|length| format!("{length},")).collect();
    let header = format!("{{'descr': '<f8', 'fortran_order': {order}, 'shape': ({shape}), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// A record of `samples` real numbers of white noise for each line, as bytes of a binary file.
fn noise_bytes(count: usize, seed: u64, also: impl Fn(usize) -> f64) -> Vec<u8> {
    use rand_xoshiro::rand_core::{Rng, SeedableRng};
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut uniform = || (rng.next_u64() as f64 + 0.5) / 2f64.powi(64);
    let mut normal = || (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
    (0..count)
        .flat_map(|i| (normal() + also(i)).to_le_bytes())
        .collect()
}

#[test]
fn the_quietest_gates_tell_the_noise_for_any_number_of_lines() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    for (lines, files) in [(1, 24), (3, 12), (30, 2)] {
        let scene = SMALL.replace(
            RHI,
            &format!(
                "elevation_min_rad = 0.1\nelevation_max_rad = {}\nelevation_step_rad = 1e-2\n",
                0.095 + 0.01 * f64::from(lines)
            ),
        );
        let scene = scene.replace(
            "range_max_m = 430.0\npulses_per_line = 2",
            "range_max_m = 750.0\npulses_per_line = 1",
        );
        let scene = scene.replace(
            "[detector.snr]",
            "[detector]\nnoise = \"white\"\n[detector.snr]",
        ) + "[estimator]\ngate_step_samples = 16\n";
        fs::write(folder.join("s.toml"), scene).unwrap();
        let plan = Plan::new(
            SceneFile::read(&folder.join("s.toml")).unwrap(),
            wakescope_sim::Target::Map,
        )
        .unwrap();
        let (samples, count) = (plan.geometry.samples, plan.geometry.elevation_rad.len());
        assert_eq!(count, lines as usize);
        let (mut passed, mut gates, mut tones) = (0.0, 0.0, Vec::new());
        for file in 0..files {
            // a tone of 10 dB in half of the record: the band has 0.4 of the noise
            let tone = |i: usize| {
                let place = i % samples;
                let is_lit = file % 2 == 1 && place < samples / 2;
                if is_lit {
                    8f64.sqrt() * (0.3 * std::f64::consts::TAU * place as f64).cos()
                } else {
                    0.0
                }
            };
            fs::write(
                folder.join("n.bin"),
                noise_bytes(samples * count, 10 + file, tone),
            )
            .unwrap();
            let words = [
                "estimate",
                "n.bin",
                "--scene",
                "s.toml",
                "--format",
                "f64",
                "--out",
                "x",
                "--quiet",
                "--overwrite",
            ];
            let out = wakescope(folder, &words);
            assert!(out.status.success(), "{out:?}");
            let of = |name: &str| {
                column(&folder.join("x/map.csv"), name)
                    .into_iter()
                    .map(f64::from_bits)
            };
            if file % 2 == 0 {
                passed += of("flagged").filter(|flagged| *flagged == 0.0).count() as f64;
                gates += of("flagged").count() as f64;
            } else {
                let per_line = plan.geometry.gate_range_m.len();
                let near = of("snr_db")
                    .enumerate()
                    .filter(|(i, _)| i % per_line < per_line / 4);
                tones.push(near.clone().map(|(_, db)| db).sum::<f64>() / near.count() as f64);
            }
        }
        let snr_db = tones.iter().sum::<f64>() / tones.len() as f64;
        println!(
            "{lines} lines: {} of {gates} pass, tone {snr_db} dB",
            passed
        );
        // of one line the noise itself is known to a tenth, which raises the rate
        let error = (0.01 * gates).sqrt() / gates;
        assert!(
            passed / gates < 0.016 + 3.0 * error,
            "{lines} lines: {passed} of {gates}"
        );
        assert!(
            (snr_db - 10.0).abs() < 0.25 + 0.6 / f64::from(lines).sqrt(),
            "{lines} lines: {snr_db}"
        );
    }
}

#[test]
fn missing_samples_of_any_kind_cost_their_windows_alone() {
    let temp = recorded_run("");
    let folder = temp.path();
    let (all, samples) = samples(&folder.join("o/signals.nc"));
    let level = |name: &str, words: &[&str]| -> Vec<f64> {
        let mut every = vec![
            "estimate",
            name,
            "--scene",
            "s.toml",
            "--out",
            "x",
            "--quiet",
            "--overwrite",
        ];
        every.extend(words);
        let out = wakescope(folder, &every);
        assert!(out.status.success(), "{out:?}");
        let of = |name: &str| {
            column(&folder.join("x/map.csv"), name)
                .into_iter()
                .map(f64::from_bits)
                .collect::<Vec<_>>()
        };
        assert!(
            of("snr_db").iter().all(|db| db.is_nan() || *db <= 30.0),
            "{name}"
        );
        of("level")
    };
    let binary = |missing: f64| {
        let at = |i: usize| if i == 70 { missing } else { all[i] };
        fs::write(
            folder.join("a.bin"),
            (0..all.len() / 3)
                .flat_map(|i| at(i).to_le_bytes())
                .collect::<Vec<u8>>(),
        )
        .unwrap();
        level("a.bin", &["--format", "f64"])
    };
    let whole = binary(all[70]);
    let nan = binary(f64::NAN);
    assert!(nan != whole && nan.iter().zip(&whole).all(|(a, b)| a <= b) && samples > 70);
    for missing in [-9999.0, 15.0 * 119f64.exp2(), 1e30, -1e300] {
        assert_eq!(binary(missing), nan, "{missing}");
    }
}

#[test]
fn own_signals_obey_noise_and_scale() {
    let temp = recorded_run("");
    let estimate = |out: &'static str, words: &[&str]| {
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
        let done = wakescope(temp.path(), &all);
        assert!(done.status.success(), "{done:?}");
        let found: Vec<f64> = column(&temp.path().join(out).join("map.csv"), "snr_db")
            .into_iter()
            .map(f64::from_bits)
            .collect();
        found.iter().sum::<f64>() / found.len() as f64
    };
    let own_db = estimate("own", &[]);
    let scene = SceneFile::read(&temp.path().join("s.toml")).unwrap();
    let plan = Plan::new(scene, wakescope_sim::Target::Map).unwrap();
    let noise_a2 = plan.instrument.receiver.noise_variance_a2();
    let loud_db = estimate("loud", &["--noise", &format!("{:e}", 2.0 * noise_a2)]);
    assert!((own_db - loud_db - 3.2).abs() < 0.4, "{own_db} {loud_db}");
    // ten times the current in the noise of the scene: no map that has the truth beside it
    let scaled_db = estimate("scaled", &["--scale", "10", "--noise", "scene"]);
    assert!((scaled_db - own_db - 20.4).abs() < 0.6, "{scaled_db}");
    let head = fs::read_to_string(temp.path().join("scaled/map.csv")).unwrap();
    assert!(!head.contains("v_exact_m_s"), "{head}");
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

/// An archive of arrays of doubles as numpy.savez writes it, without checksums.
pub(super) fn npz(arrays: &[(&str, &[f64], &[usize])]) -> Vec<u8> {
    let (mut out, mut table) = (Vec::new(), Vec::new());
    for (name, values, shape) in arrays {
        let shape: Vec<String> = shape.iter().map(|length| format!("{length},")).collect();
        let header = format!(
            "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}), }}\n",
            shape.concat()
        );
        let mut data = [
            &b"\x93NUMPY\x01\x00"[..],
            &(header.len() as u16).to_le_bytes(),
            header.as_bytes(),
        ]
        .concat();
        data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
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
