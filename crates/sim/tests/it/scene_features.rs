//! What a scene can say about estimators, pulses, air and the receiver, seen through whole runs.

use ndarray::Array2;
use num_complex::Complex;
use std::path::Path;
use wakescope_estimate::{Scratch, SignalKind, window::Sample};
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plan::estimators::Toolkit;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::run::{RunResult, run};
use wakescope_sim::scene::{NoiseModel, SceneFile};

/// A scene with a few lines; the pieces replace the words in capitals.
const SCENE: &str = r#"
seed = 7
[pulse]
PULSE
[detector]
DETECTOR
[atmosphere]
AIR
[flow]
kind = "uniform"
lateral_m_s = 4.0
vertical_m_s = 0.0
[scan]
elevation_min_rad = 0.05
elevation_max_rad = 0.058
elevation_step_rad = 2e-3
range_min_m = 300.0
range_max_m = 400.0
pulses_per_line = 8
realisations = 3
SCAN
[estimator]
gate_step_samples = 10
ESTIMATOR
[outputs]
signals = true
profile_points = 3
"#;

#[derive(Clone, Copy)]
struct Words {
    pulse: &'static str,
    detector: &'static str,
    air: &'static str,
    scan: &'static str,
    estimator: &'static str,
}

/// 10 dB at every range, nothing else.
const PLAIN: Words = Words {
    pulse: "",
    detector: "snr = { reference = \"fixed\", snr_db = 10.0 }",
    air: "",
    scan: "",
    estimator: "",
};

fn file(words: Words) -> SceneFile {
    let text = SCENE
        .replace("PULSE", words.pulse)
        .replace("DETECTOR", words.detector)
        .replace("AIR", words.air)
        .replace("SCAN", words.scan)
        .replace("ESTIMATOR", words.estimator);
    SceneFile::parse(&text, Path::new("scene.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn result(words: Words, target: Target) -> RunResult {
    run(&Plan::new(file(words), target).unwrap(), &Silent).unwrap()
}

fn map(words: Words) -> VelocityEstimates {
    result(words, Target::Map).map.unwrap()
}

fn with_estimator(estimator: &'static str) -> VelocityEstimates {
    map(Words { estimator, ..PLAIN })
}

/// Mean of the numbers of a field.
fn mean(field: &Array2<f64>) -> f64 {
    let numbers: Vec<f64> = field.iter().copied().filter(|x| x.is_finite()).collect();
    assert!(!numbers.is_empty());
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

const METHODS: [&str; 6] = [
    "periodogram",
    "periodogram_accumulation",
    "autoregressive",
    "pulse_pair",
    "first_moment",
    "likelihood",
];

#[test]
fn every_method_reads_a_uniform_wind_from_real_and_from_complex_samples() {
    for method in METHODS {
        for signal in ["intermediate_frequency", "baseband"] {
            let weighting = if method == "likelihood" {
                ""
            } else {
                "weighting = \"rectangular\"\n"
            };
            let estimator = format!("method.kind = \"{method}\"\n{weighting}");
            let detector = format!(
                "signal = \"{signal}\"\nsnr = {{ reference = \"fixed\", snr_db = 10.0 }}\n"
            );
            let found = map(Words {
                estimator: estimator.leak(),
                detector: detector.leak(),
                ..PLAIN
            });
            let error_m_s = mean(&(&found.v_mean_m_s - &found.v_pulse_m_s));
            // The noise of the band pulls the pulse pair to 0 by the share of its power.
            let bias_m_s = if method == "pulse_pair" {
                -4.0 / 11.0
            } else {
                0.0
            };
            assert!(
                (error_m_s - bias_m_s).abs() < 0.15,
                "{method}, {signal}: {error_m_s}"
            );
            assert_eq!(mean(&found.count), 3.0, "{method}, {signal}");
            assert_eq!(mean(&found.flagged), 0.0, "{method}, {signal}");
            assert!(mean(&found.quality) > 2.0, "{method}, {signal}");
            // lambda/(4 sqrt2 pi sigma) = 0.73 m/s for 200 ns; models show no width, nor do tapers for 10 dB
            match method {
                "autoregressive" | "likelihood" => {
                    assert!(
                        found.width_m_s.iter().all(|width| width.is_nan()),
                        "{method}, {signal}"
                    );
                }
                _ => assert!(
                    (mean(&found.width_m_s) - 0.73).abs() < 0.2,
                    "{method}, {signal}: {:?}",
                    found.width_m_s
                ),
            }
        }
    }
}

#[test]
fn the_periodogram_shows_the_signal_to_noise_ratio_and_the_width_of_the_pulse() {
    let found = with_estimator("");
    // lambda/(4 sqrt2 pi sigma) = 0.73 m/s for 200 ns.
    assert!(
        (mean(&found.snr_db) - 10.0).abs() < 1.5,
        "{}",
        mean(&found.snr_db)
    );
    assert!(
        (mean(&found.width_m_s) - 0.73).abs() < 0.2,
        "{}",
        mean(&found.width_m_s)
    );
}

#[test]
fn widths_are_those_of_the_pulse_or_missing() {
    // 1.45 m/s for 100 ns; the standard error of a map is some 0.1
    for (snr_db, method, true_m_s) in [
        ("30.0", "window_samples = 32\n", 1.45),
        (
            "5.0",
            "method.kind = \"pulse_pair\"\nweighting = \"hann\"\n",
            1.45,
        ),
        ("30.0", "method.kind = \"likelihood\"\n", f64::NAN),
        ("5.0", "window_samples = 16\n", f64::NAN),
        ("-20.0", "", f64::NAN),
    ] {
        let detector =
            format!("noise = \"white\"\nsnr = {{ reference = \"fixed\", snr_db = {snr_db} }}\n");
        let pulse = "shape.duration_s = 100e-9\n";
        let found = map(Words {
            pulse,
            detector: detector.leak(),
            estimator: method,
            ..PLAIN
        })
        .width_m_s;
        match true_m_s.is_nan() {
            true => assert!(
                found.iter().all(|width| width.is_nan()),
                "{snr_db} {method}: {found:?}"
            ),
            false => assert!(
                (mean(&found) / true_m_s - 1.0).abs() < 0.15,
                "{snr_db} {method}: {found:?}"
            ),
        }
    }
}

#[test]
fn knobs_of_the_estimators_reach_them() {
    let velocities = |estimator| with_estimator(estimator).v_mean_m_s;
    let base = "method.kind = \"autoregressive\"\nweighting = \"rectangular\"\n";
    let model = velocities(base);
    for knob in ["method.order = 4", "padded_samples = 256"] {
        let other = velocities(format!("{base}{knob}\n").leak());
        assert_ne!(model, other, "{knob}");
        assert!(
            (mean(&other) - mean(&model)).abs() < 0.2,
            "{knob}: {} {}",
            mean(&other),
            mean(&model)
        );
    }
    let moment = |reach| {
        velocities(
            format!("method.kind = \"first_moment\"\nmethod.moment_reach = {reach:?}\n").leak(),
        )
    };
    assert_ne!(moment(1.5), moment(3.5));
    let likelihood = |snr_db| {
        velocities(
            format!("method.kind = \"likelihood\"\nmethod.likelihood_snr_db = {snr_db:?}\n").leak(),
        )
    };
    assert_ne!(likelihood(-10.0), likelihood(30.0));
    assert_eq!(
        likelihood(10.0),
        velocities("method.kind = \"likelihood\"\n"),
        "the scene's own ratio is 10 dB"
    );
}

#[test]
fn regions_follow_a_table_or_a_target_deviation() {
    let fixed = with_estimator("radius_m = 1.5\n");
    let table =
        with_estimator("radius = { kind = \"of_range\", range_m = [340.0], radius_m = [1.5] }\n");
    assert_eq!(
        (&fixed.level, &fixed.v_mean_m_s),
        (&table.level, &table.v_mean_m_s)
    );
    let grows = with_estimator(
        "radius = { kind = \"of_range\", range_m = [310.0, 390.0], radius_m = [0.7, 6.0] }\n",
    );
    let last = grows.level.dim().1 - 1;
    assert!(
        mean(
            &grows
                .level
                .column(last)
                .to_owned()
                .insert_axis(ndarray::Axis(0))
        ) > 2.0 * fixed.level[[2, 0]]
    );
    let target =
        "radius = { kind = \"target\", standard_deviation_m_s = 0.12, largest_m = 30.0 }\n";
    let n_eff = |detector| {
        mean(
            &map(Words {
                detector,
                estimator: target,
                ..PLAIN
            })
            .n_eff,
        )
    };
    let strong = n_eff("snr = { reference = \"fixed\", snr_db = 10.0 }");
    let weak = n_eff("snr = { reference = \"fixed\", snr_db = -3.0 }");
    assert!(weak > 1.5 * strong, "{weak} {strong}");
}

#[test]
fn the_test_against_noise_flags_noise_and_passes_a_signal() {
    let flagged = |snr_db: f64| {
        let detector = format!("snr = {{ reference = \"fixed\", snr_db = {snr_db:?} }}\n");
        mean(
            &map(Words {
                detector: detector.leak(),
                estimator: "false_alarm = 0.01\n",
                ..PLAIN
            })
            .flagged,
        )
    };
    assert!(flagged(-40.0) > 0.9, "{}", flagged(-40.0));
    assert!(flagged(10.0) < 0.02, "{}", flagged(10.0));
}

/// A map of that many realisations with single pulses, regions of 2 m and a fixed signal-to-noise ratio.
fn single_pulses(
    snr_db: f64,
    realisations: usize,
    detector: &str,
    estimator: &str,
) -> VelocityEstimates {
    let detector = format!("{detector}\nsnr = {{ reference = \"fixed\", snr_db = {snr_db:?} }}\n");
    let mut scene = file(Words {
        detector: detector.leak(),
        estimator: estimator.to_owned().leak(),
        ..PLAIN
    })
    .content;
    scene.scan.elevation_step_rad = 1e-3;
    (scene.scan.pulses_per_line, scene.scan.realisations) = (1, realisations);
    run(
        &Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap(),
        &Silent,
    )
    .unwrap()
    .map
    .unwrap()
}

#[test]
fn by_default_noise_passes_one_time_in_a_hundred_and_estimates_at_minus_14_db_are_flagged() {
    let weak = single_pulses(-14.0, 20, "", "");
    let (flagged, rms_m_s) = (mean(&weak.flagged), mean(&weak.rms_m_s));
    assert!(flagged > 0.9 && rms_m_s > 6.0, "{flagged} {rms_m_s}");
    for (detector, estimator) in [
        ("", ""),
        (
            "noise = \"white\"\n",
            "method.kind = \"autoregressive\"\nweighting = \"rectangular\"\n",
        ),
        (
            "signal = \"baseband\"\n",
            "method.kind = \"first_moment\"\nweighting = \"rectangular\"\n",
        ),
        (
            "noise = \"white\"\n",
            "method.kind = \"likelihood\"\nmethod.likelihood_snr_db = 0.0\n",
        ),
    ] {
        let estimator = format!("false_alarm = 0.1\n{estimator}");
        let noise = single_pulses(-60.0, 60, detector, &estimator);
        // few of the gates are independent
        let passed = 1.0 - mean(&noise.flagged);
        assert!(
            (0.065..0.135).contains(&passed),
            "{detector}{estimator}: {passed}"
        );
    }
    let untested = single_pulses(-14.0, 4, "", "false_alarm = 0.0\n");
    assert!(mean(&untested.flagged) < 0.2, "{}", mean(&untested.flagged));
}

/// The ratio, dB, that an estimator shows in the mean of very many windows of a signal at `velocity_m_s` in noise of a ratio of 1, with
/// the gain of the true velocity and with that of the estimated one.
///
/// A statistic is quadratic in the samples, so its mean is the sum of those of sinusoids with the powers that signal and noise have at
/// their frequencies.
fn shown_db<S: Sample>(plan: &Plan, velocity_m_s: f64, sinusoid: fn(f64, f64) -> S) -> [f64; 2] {
    let (scene, instrument) = (plan.scene(), &plan.instrument);
    let tools = Toolkit::<S>::new(scene, instrument, 1.0).unwrap();
    let sampling = scene.sampling().unwrap();
    let (d, n) = (&scene.detector, scene.estimator.window_samples);
    let mut mean = vec![0.0; tools.statistic.statistic_len()];
    let mut scratch = Scratch::new();
    let mut add = |frequency_hz: f64, power: f64| {
        let turn = std::f64::consts::TAU * frequency_hz / d.sampling_hz;
        // both phases of real sinusoids; complex ones are the same in any phase
        for phase in [0.0, 0.5 * std::f64::consts::PI] {
            let window: Vec<S> = (0..n).map(|k| sinusoid(turn * k as f64, phase)).collect();
            let mut one = vec![0.0; mean.len()];
            tools.statistic.evaluate(&window, &mut scratch, &mut one);
            mean.iter_mut()
                .zip(&one)
                .for_each(|(sum, x)| *sum += 0.5 * power * x);
        }
    };
    let noise_a2 = instrument.receiver.noise_variance_a2();
    let width_hz = instrument.pulse.spectral_width_hz();
    let parts = 12;
    for k in -4 * parts..=4 * parts {
        let place = f64::from(k) / f64::from(parts);
        let share =
            (-0.5 * place * place).exp() / (f64::from(parts) * std::f64::consts::TAU.sqrt());
        add(
            sampling.frequency_hz(velocity_m_s) + place * width_hz,
            noise_a2 * share,
        );
    }
    // Twice as white as it is wide: the density of the band on all frequencies of the samples.
    let (low_hz, high_hz) = match (d.noise, S::KIND) {
        (NoiseModel::White, SignalKind::Real) => (0.0, 0.5 * d.sampling_hz),
        (NoiseModel::White, SignalKind::Complex) => (-0.5 * d.sampling_hz, 0.5 * d.sampling_hz),
        _ => sampling.band_hz,
    };
    let lines = 8 * n;
    for k in 0..lines {
        let share = (k as f64 + 0.5) / lines as f64;
        let power = noise_a2 * (high_hz - low_hz) / d.bandwidth_hz / lines as f64;
        add(low_hz + share * (high_hz - low_hz), power);
    }
    let unit: f64 = mean.iter().fold(0.0, |largest, x| x.abs().max(largest));
    let scaled: Vec<f64> = mean.iter().map(|x| x / unit).collect();
    let (found, noise) = (tools.estimator.estimate(&scaled, &mut scratch), tools.noise);
    let excess = found.power * unit / noise.power_a2 - 1.0;
    [velocity_m_s, found.velocity_m_s]
        .map(|velocity_m_s| 10.0 * (excess * noise.gain(velocity_m_s)).log10())
}

#[test]
fn the_ratio_of_every_method_in_every_noise_is_that_of_the_signal() {
    let flat = "weighting = \"rectangular\"\n";
    let estimators = [
        "".to_owned(),
        flat.to_owned(),
        "weighting = \"hann\"\n".to_owned(),
        format!("{flat}method = {{ kind = \"autoregressive\", order = 8 }}\n"),
        format!("{flat}method = {{ kind = \"autoregressive\", order = 6 }}\n"),
        format!("{flat}method.kind = \"pulse_pair\"\n"),
        format!("{flat}method.kind = \"first_moment\"\n"),
        "method.kind = \"likelihood\"\n".to_owned(),
    ];
    for (window, estimator) in [64, 32, 16]
        .iter()
        .flat_map(|window| estimators.iter().map(move |words| (*window, words)))
    {
        // Methods of few lags, and short windows, read the velocity off by some of their resolution, and the gain with it: most of all
        // pairs, which the noise of a band pulls to its middle.
        let is_coarse = window < 64 || estimator.contains("order");
        let is_pair = estimator.contains("pulse_pair");
        let of_velocity_db = match (is_coarse, is_pair) {
            (true, true) => 0.9,
            (true, false) => 0.2,
            (false, true) => 0.05,
            (false, false) => 0.02,
        };
        let padded = if is_pair {
            ""
        } else {
            "padded_samples = 512\n"
        };
        let words = format!("window_samples = {window}\n{padded}{estimator}");
        for (noise, signal) in [
            ("band", "intermediate_frequency"),
            ("white", "intermediate_frequency"),
            ("band", "baseband"),
            ("white", "baseband"),
        ] {
            let detector = format!(
                "noise = \"{noise}\"\nsignal = \"{signal}\"\nsnr = {{ reference = \"fixed\", snr_db = 0.0 }}\n"
            );
            let scene = file(Words {
                detector: detector.leak(),
                estimator: words.clone().leak(),
                ..PLAIN
            });
            let plan = Plan::new(scene, Target::Map).unwrap();
            for velocity_m_s in [-7.0, 12.0] {
                let shown = match signal {
                    "baseband" => shown_db(&plan, velocity_m_s, |turn, phase| {
                        Complex::from_polar(1.0, turn + phase)
                    }),
                    _ => shown_db(&plan, velocity_m_s, |turn, phase| {
                        2f64.sqrt() * (turn + phase).cos()
                    }),
                };
                assert!(
                    shown[0].abs() < 0.005,
                    "{words}{noise} {signal} {velocity_m_s} m/s: {shown:?} dB"
                );
                assert!(
                    shown[1].abs() < of_velocity_db,
                    "{words}{noise} {signal} {velocity_m_s} m/s: {shown:?} dB"
                );
            }
        }
    }
}

#[test]
fn the_ratio_that_a_map_shows_is_unbiased_or_missing() {
    for (detector, estimator) in [
        ("", ""),
        ("signal = \"baseband\"\n", "method.kind = \"likelihood\"\n"),
        (
            "noise = \"white\"\n",
            "method.kind = \"autoregressive\"\nweighting = \"rectangular\"\n",
        ),
    ] {
        for (snr_db, realisations) in [(0.0, 40), (10.0, 40)] {
            let found = single_pulses(snr_db, realisations, detector, estimator);
            let power = found.snr_db.mapv(|db| 10f64.powf(0.1 * (db - snr_db)));
            assert!(
                power.iter().all(|power| power.is_finite()),
                "{detector}{estimator}{snr_db} dB"
            );
            // gates 40 m apart share no air: columns of one map, in groups
            let parts: Vec<f64> = power
                .axis_chunks_iter(ndarray::Axis(1), 1)
                .map(|part| mean(&part.to_owned()))
                .collect();
            let ratio = parts.iter().sum::<f64>() / parts.len() as f64;
            let scatter = parts.iter().map(|part| (part - ratio).powi(2)).sum::<f64>()
                / (parts.len() - 1) as f64;
            // neighbouring gates, 6 m apart, share some seven
            let error = (7.0 * scatter / parts.len() as f64).sqrt();
            let off = (ratio - 1.0).abs();
            assert!(
                off < 0.012 + 3.0 * error && error < 0.05,
                "{detector}{estimator}{snr_db} dB: {ratio} +- {error}"
            );
        }
        let nothing = single_pulses(-60.0, 20, detector, estimator);
        let shown = nothing.snr_db.iter().filter(|db| db.is_finite()).count() as f64
            / nothing.snr_db.len() as f64;
        assert!(shown < 0.15, "{detector}{estimator}: {shown}");
    }
}

#[test]
fn a_sampled_gaussian_is_the_gaussian_and_its_phase_widens_the_spectrum() {
    let sigma_s = 200e-9 / (2.0 * 2f64.ln().sqrt());
    let times: Vec<f64> = (-60..=60).map(|i| f64::from(i) * 8e-9).collect();
    let power: Vec<f64> = times
        .iter()
        .map(|t| (-(t / sigma_s).powi(2)).exp())
        .collect();
    let shape = format!("kind = \"sampled\", time_s = {times:?}, power = {power:?}");
    let sampled = map(Words {
        pulse: format!("shape = {{ {shape} }}\n").leak(),
        ..PLAIN
    });
    let plain = map(PLAIN);
    assert!((mean(&sampled.v_mean_m_s) - mean(&plain.v_mean_m_s)).abs() < 0.1);
    assert!(
        (&sampled.n_eff - &plain.n_eff)
            .iter()
            .all(|d| d.abs() < 0.01),
        "the windows correlate alike"
    );
    // A chirp of 35 kHz/ns, times sigma/sqrt 2, is its part of the width: 3 MHz, 2.3 m/s.
    let phase_rad: Vec<f64> = times
        .iter()
        .map(|t| std::f64::consts::PI * 3.5e13 * t * t)
        .collect();
    let chirped = map(Words {
        pulse: format!("shape = {{ {shape}, phase_rad = {phase_rad:?} }}\n").leak(),
        ..PLAIN
    });
    assert!(
        mean(&chirped.width_m_s) > 1.8 && mean(&plain.width_m_s) < 1.0,
        "{}",
        mean(&chirped.width_m_s)
    );
    assert!((mean(&chirped.v_mean_m_s) - mean(&plain.v_mean_m_s)).abs() < 0.4);
}

#[test]
fn air_that_changes_with_range_changes_the_return_and_what_lies_behind_it() {
    let snr_db = |air| {
        let profile = result(
            Words {
                air,
                detector: "",
                ..PLAIN
            },
            Target::Efficiency,
        )
        .profile
        .unwrap();
        (profile.efficiency.range_m, profile.snr_db)
    };
    let (range_m, uniform) = snr_db("backscatter_per_m_sr = 1e-7\nextinction_per_m = 7e-5\n");
    assert_eq!(range_m, [100.0, 1550.0, 3000.0]);
    let table = "profile = { range_m = [0.0, 50.0], backscatter_per_m_sr = [1e-7, 1e-7], extinction_per_m = [7e-5, 7e-5] }\n";
    for (a, b) in snr_db(table).1.iter().zip(&uniform) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    // Ten times the backscatter beyond 1 km, and a cloud of optical depth 0.5 on the way there.
    let cloud = "profile = { range_m = [800.0, 900.0, 1000.0, 1100.0], backscatter_per_m_sr = [1e-7, 1e-6, 1e-6, 1e-6], \
                 extinction_per_m = [7e-5, 5.07e-3, 7e-5, 7e-5] }\n";
    let found = snr_db(cloud).1;
    let gain_db = 10.0 - 20.0 * 0.5 * std::f64::consts::LOG10_E;
    for (a, expected) in found
        .iter()
        .zip([uniform[0], uniform[1] + gain_db, uniform[2] + gain_db])
    {
        assert!((a - expected).abs() < 1e-6, "{a} {expected}");
    }
}

#[test]
fn a_converter_rounds_to_its_codes_and_says_what_it_clipped() {
    let detector = "snr = { reference = \"fixed\", snr_db = 10.0 }\ndigitiser = { kind = \"quantised\", bits = 5, full_scale_over_noise = 4.0 }\n";
    let run = result(Words { detector, ..PLAIN }, Target::Run);
    let mut codes: Vec<u64> = run.signals_a.unwrap().iter().map(|a| a.to_bits()).collect();
    codes.sort_unstable();
    codes.dedup();
    assert!(
        codes.len() <= 33,
        "{} codes (zero has two signs)",
        codes.len()
    );
    let map = run.map.unwrap();
    // The current has the variance 11 in units of the noise: 4 is 1.2 standard deviations.
    assert!(
        (map.clipped_fraction - 0.228).abs() < 0.03,
        "{}",
        map.clipped_fraction
    );
    assert!((mean(&map.v_mean_m_s) - 4.0).abs() < 0.3);
}

#[test]
fn baseband_signals_have_two_quadratures_of_equal_power() {
    let detector = "snr = { reference = \"fixed\", snr_db = 10.0 }\nsignal = \"baseband\"\n";
    let run = result(Words { detector, ..PLAIN }, Target::Signal);
    let power = |a: Option<Array2<f64>>| mean(&a.unwrap().mapv(|x| x * x));
    let (i, q) = (power(run.signals_a), power(run.quadrature_a));
    assert!((i / q - 1.0).abs() < 0.1, "{i} {q}");
    assert!(result(PLAIN, Target::Signal).quadrature_a.is_none());
}

#[test]
fn lines_below_the_ground_are_masked_if_the_scene_says_so() {
    let scan = "lidar_height_m = 3.0\nbelow_ground = { policy = \"mask\" }\n";
    let text = SCENE.replace("elevation_min_rad = 0.05", "elevation_min_rad = -0.02");
    let text = ["PULSE", "DETECTOR", "AIR", "ESTIMATOR"]
        .iter()
        .fold(text, |t, word| t.replace(word, ""));
    let masked = SceneFile::parse(&text.replace("SCAN", scan), Path::new("s.toml")).unwrap();
    let found = run(&Plan::new(masked, Target::Map).unwrap(), &Silent)
        .unwrap()
        .map
        .unwrap();
    let below = |i: usize, j: usize| 3.0 + found.range_m[j] * found.elevation_rad[i].sin() < 0.0;
    for ((i, j), v) in found.v_exact_m_s.indexed_iter() {
        assert_eq!(v.is_nan(), below(i, j), "line {i}, gate {j}");
    }
    let refused = SceneFile::parse(
        &text.replace("SCAN", "lidar_height_m = 3.0\n"),
        Path::new("s.toml"),
    )
    .unwrap_err();
    assert!(
        refused.to_string().contains("scan.below_ground.policy"),
        "{refused}"
    );
}

#[test]
fn pulses_have_the_efficiency_of_a_realisation_each_and_their_mean_power_is_that_of_the_mean() {
    let turbulence = |efficiency: &str| {
        format!(
            "turbulence = {{ kind = \"refractive\", cn2_m_m23 = 1e-12, outer_scale_m = 1.0, grid_points = 128, \
             grid_spacing_m = 4e-3, layers = 4, realisations = 64, efficiency = \"{efficiency}\" }}\n"
        )
    };
    let powers = |efficiency: &str| {
        let air: &'static str = turbulence(efficiency).leak();
        let words = Words {
            air,
            detector: "noise = \"none\"\n",
            scan: "",
            ..PLAIN
        };
        let mut file = file(words);
        file.content.scan.pulses_per_line = 64;
        let plan = Plan::new(SceneFile::new(file.content).unwrap(), Target::Signal).unwrap();
        let signals = run(&plan, &Silent).unwrap().signals_a.unwrap();
        signals
            .outer_iter()
            .map(|row| row.mapv(|x| x * x).mean().unwrap())
            .collect::<Vec<f64>>()
    };
    let (fixed, drawn) = (powers("mean"), powers("realisation"));
    let average = |p: &[f64]| p.iter().sum::<f64>() / p.len() as f64;
    let relative_variance = |p: &[f64]| {
        p.iter()
            .map(|x| (x / average(p) - 1.0).powi(2))
            .sum::<f64>()
            / (p.len() - 1) as f64
    };
    let error = (relative_variance(&fixed) / fixed.len() as f64
        + relative_variance(&drawn) / drawn.len() as f64)
        .sqrt();
    let difference = average(&drawn) / average(&fixed) - 1.0;
    assert!(difference.abs() < 4.0 * error, "{difference} {error}");
    // Both have the same speckle: their ratio scatters with the efficiency alone, by 0.3 to 0.43 at one range and less over a record.
    let ratios: Vec<f64> = drawn
        .iter()
        .zip(&fixed)
        .map(|(drawn, fixed)| drawn / fixed)
        .collect();
    let own = relative_variance(&ratios);
    assert!(
        (0.03..0.2).contains(&own),
        "the efficiency adds its own scatter: {own}"
    );
}
