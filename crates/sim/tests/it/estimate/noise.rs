//! Noise and scale of signals of other instruments: a converter's zero, the quietest gates, missing samples.

use super::{RHI, column, recorded_run, samples};
use crate::cli::SMALL;
use crate::wakescope;
use std::fs;
use std::path::Path;
use wakescope_sim::plan::Plan;
use wakescope_sim::scene::SceneFile;

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

/// The largest current by size, A.
fn largest(currents: &[f64]) -> f64 {
    currents
        .iter()
        .fold(0.0, |most, current| most.max(current.abs()))
}

#[test]
fn the_zero_of_a_converter_moves_no_velocity() {
    let temp = recorded_run("");
    let folder = temp.path();
    let (currents, _) = samples(&folder.join("o/signals.nc"));
    let largest = largest(&currents);
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

/// Counts of a converter as floats: -9999 is one of them, and nothing but NaN and what dwarfs all others is missing.
#[test]
fn counts_stored_as_floats_are_those_of_integers_and_missing_samples_are_counted() {
    let temp = recorded_run("");
    let folder = temp.path();
    let (currents, _) = samples(&folder.join("o/signals.nc"));
    let largest = largest(&currents);
    let mut counts: Vec<i16> = currents
        .iter()
        .map(|one| (one / largest * 20_000.0).round() as i16)
        .collect();
    counts[70] = -9999;
    let estimate = |name: &str, bytes: Vec<u8>, kind: &str| -> String {
        fs::write(folder.join(name), bytes).unwrap();
        let folder_of = format!("of_{name}");
        let words = [
            "estimate",
            name,
            "--scene",
            "s.toml",
            "--format",
            kind,
            "--out",
            folder_of.as_str(),
            "--quiet",
        ];
        let out = wakescope(folder, &words);
        assert!(out.status.success(), "{out:?}");
        String::from_utf8(out.stderr).unwrap()
    };
    let of_i16 = counts.iter().flat_map(|count| count.to_le_bytes());
    let said = estimate("i16", of_i16.collect(), "i16");
    assert!(!said.contains("samples are missing"), "{said}");
    let of_f32 = counts
        .iter()
        .flat_map(|count| f32::from(*count).to_le_bytes());
    let said = estimate("f32", of_f32.collect(), "f32");
    assert!(!said.contains("samples are missing"), "{said}");
    for name in ["level", "v_mean_m_s"] {
        let [a, b] =
            ["of_i16", "of_f32"].map(|map| column(&folder.join(map).join("map.csv"), name));
        assert_eq!(a, b, "{name}");
    }
    let mut missing: Vec<f64> = counts.iter().map(|count| f64::from(*count)).collect();
    missing[70] = f64::NAN;
    missing[90] = f64::INFINITY;
    missing[3000] = 1e20;
    let of_f64 = missing.iter().flat_map(|count| count.to_le_bytes());
    let said = estimate("f64", of_f64.collect(), "f64");
    let line = format!("3 of {} samples are missing", missing.len());
    assert!(said.contains(&line), "{said}");
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
