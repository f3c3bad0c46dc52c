//! Scans of files: circulations by `retrieve` whatever the format, wakes by `detect`, noise that passes for signal.

use super::air::circulation_m2_s;
use super::draw;
use super::ledger::Ledger;
use super::numerics::{average, integral};
use super::program::{Bench, Csv};
use super::random::Random;
use super::scene::Scene;

/// The default scan, with a strong pulse.
fn strong(r: &mut Random) -> Scene {
    let mut s = Scene::default();
    s.set("seed", r.whole(1, 1_000_000))
        .number("pulse.energy_j", 5e-3)
        .number("scan.elevation_step_rad", 6e-3);
    s.set("outputs.svg", false)
        .set("outputs.png", false)
        .set("outputs.flow", false)
        .set("outputs.profile_points", 3);
    s
}

/// What a fit tells of one scan.
struct Fit {
    /// Gamma_5-15 of both vortices and their stated deviations, m^2/s; missing where none is found.
    gamma: [(f64, f64); 2],
    /// Gain of chi-square over wind alone.
    statistic: f64,
}

impl Fit {
    fn new(table: &Csv) -> Self {
        let (side, value, error) = (
            table.words("side"),
            table.f("gamma_5_15_m2_s"),
            table.f("gamma_5_15_std_m2_s"),
        );
        let of = |name| {
            side.iter()
                .position(|s| s == name)
                .map_or((f64::NAN, f64::NAN), |i| (value[i], error[i]))
        };
        Self {
            gamma: ["left", "right"].map(of),
            statistic: table.f("statistic")[0],
        }
    }
}

/// One scan in all formats, the scene in the file or stated: one circulation, that of the flow within what is stated.
pub(crate) fn hold_retrieve(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let mut s = strong(r);
    s.set("outputs.hpl", true)
        .set("estimator.gate_step_samples", 64)
        .number("scan.range_min_m", 268.614);
    s.set("scan.realisations", 1)
        .number("flow.circulation_m2_s", r.between(300.0, 600.0));
    bench.write("s.toml", &s.text());
    if bench
        .must(ledger, &["run", "s.toml", "--out", "o"])
        .is_none()
    {
        return;
    }
    let found = |ledger: &mut Ledger, file: &str, with_scene: bool| {
        let mut words = vec!["retrieve", file, "--out", "r", "--overwrite"];
        words.extend(if with_scene {
            &["--scene", "s.toml"][..]
        } else {
            &[]
        });
        bench.must(ledger, &words);
        Fit::new(&bench.csv(ledger, "r/retrieval.csv"))
    };
    let own = found(ledger, "o/map.nc", false);
    let core = s.f("flow.core_radius_m");
    let right = 0.1
        * integral(5.0, 15.0, 4, |x| {
            circulation_m2_s("algebraic", s.f("flow.circulation_m2_s"), core, x)
        });
    for (file, allowed) in [("o/map.nc", 1e-6), ("o/map.csv", 1e-6), ("o/halo.hpl", 2.0)] {
        let (here, number) = (
            found(ledger, file, true),
            format!("retrieve {}: as of map.nc", &file[2..]),
        );
        // A HALO file has no flags, four digits and angles of hundredths of a degree: other cells, within what two scans scatter (0.28 deviations
        // over 60 scans, one of them 1.1).
        if allowed < 1.0 {
            ledger.equal(
                &format!("{number}, statistic"),
                here.statistic,
                own.statistic,
                1e-6,
            );
        }
        for ((here, _), (there, error)) in here.gamma.into_iter().zip(own.gamma) {
            ledger.equal(&number, here, there, allowed * error);
        }
    }
    for (value, error) in own.gamma {
        ledger.equal("retrieval.csv: gamma_5_15_m2_s", value, right, 4.0 * error);
    }
}

/// Scans without a wake, of means over some realisations: chi-square is one, whether or not the scene is stated.
pub(crate) fn hold_detect(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let mut s = strong(r);
    draw::fixed_ratio(&mut s, 5.0);
    s.word("flow.kind", "uniform")
        .number("flow.lateral_m_s", 5.0)
        .number("flow.vertical_m_s", 0.0);
    s.number("scan.elevation_min_rad", 0.05)
        .number("scan.elevation_max_rad", 0.15)
        .number("scan.elevation_step_rad", 4e-3);
    s.number("scan.range_min_m", 560.0)
        .number("scan.range_max_m", 740.0)
        .set("scan.pulses_per_line", 4);
    s.set("estimator.gate_step_samples", 16)
        .set("scan.realisations", r.pick(&[8, 24]));
    bench.write("s.toml", &s.text());
    if bench
        .must(ledger, &["map", "s.toml", "--out", "o"])
        .is_none()
    {
        return;
    }
    let words = [
        "detect",
        "o/map.csv",
        "--scene",
        "s.toml",
        "--false-alarm",
        "0.05",
        "--empty-scans",
        "2000",
        "--out",
        "d",
    ];
    if bench.must(ledger, &words).is_some() {
        let table = bench.csv(ledger, "d/detection.csv");
        // Its scatter over 100 velocities is 0.14; neighbours that share windows make it more.
        ledger.equal(
            "detection.csv: chi2_per_dof_wind",
            table.f("chi2_per_dof_wind")[0],
            1.0,
            0.55,
        );
    }
}

/// Noise alone passes for a signal as often as is asked for: by the known noise, and by the quietest gates of the file.
pub(crate) fn hold_false_alarms(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    const ASKED: f64 = 0.01;
    // The law is of one gamma variable; what that leaves is less than once more.
    const ALLOWED: f64 = 1.0;
    let error = |gates: f64| (ASKED * (1.0 - ASKED) / gates).sqrt() / ASKED;
    let mut s = draw::scene(r);
    draw::fixed_ratio(&mut s, -80.0);
    s.unset("flow")
        .unset("added_flows")
        .word("flow.kind", "calm")
        .number("estimator.false_alarm", ASKED);
    s.unset("estimator.radius").unset("estimator.method");
    s.word(
        "estimator.method.kind",
        r.pick(&[
            "periodogram_accumulation",
            "autoregressive",
            "first_moment",
            "likelihood",
        ]),
    );
    s.number("estimator.radius_m", r.between(0.0, 3.0));
    s.number("scan.elevation_min_rad", 0.0)
        .number("scan.elevation_step_rad", 0.02)
        .number("scan.range_max_m", 800.0);
    s.set("scan.pulses_per_line", r.whole(1, 3))
        .set("scan.realisations", 20);
    s.set("estimator.gate_step_samples", 100)
        .set("estimator.window_samples", r.pick(&[24, 32, 64]));
    let passed = |table: &Csv| {
        let flagged = table.f("flagged");
        (1.0 - average(&flagged), flagged.len() as f64)
    };
    s.number("scan.elevation_max_rad", 0.4);
    bench.write("s.toml", &s.text());
    if bench.run(&["check", "s.toml"]).is_good
        && bench
            .must(ledger, &["map", "s.toml", "--out", "o"])
            .is_some()
    {
        let (share, gates) = passed(&bench.csv(ledger, "o/map.csv"));
        ledger.equal(
            "map.csv: flagged, of noise alone",
            share / ASKED,
            1.0,
            ALLOWED + 4.0 * error(20.0 * gates),
        );
    }
    // A few lines of a file whose noise nobody states.
    s.number("scan.elevation_max_rad", 0.02 * r.whole(0, 1) as f64)
        .set("scan.realisations", 1);
    s.set("scan.pulses_per_line", 1)
        .set("estimator.gate_step_samples", 64);
    s.word("estimator.method.kind", "periodogram")
        .unset("estimator.radius_m")
        .unset("estimator.method.order");
    s.number("scan.range_max_m", 1800.0);
    let mut shares = Vec::new();
    let mut gates = 0.0;
    for seed in 1..=16 {
        s.set("seed", seed);
        bench.write("s.toml", &s.text());
        if !bench.run(&["check", "s.toml"]).is_good
            || bench
                .must(ledger, &["signal", "s.toml", "--out", "n", "--overwrite"])
                .is_none()
        {
            return;
        }
        // Another energy makes them the data of others; at a fixed ratio it changes nothing else.
        let energy_j = 1.1 * s.f("pulse.energy_j");
        bench.write(
            "other.toml",
            &s.clone().number("pulse.energy_j", energy_j).text(),
        );
        let words = [
            "estimate",
            "n/signals.nc",
            "--scene",
            "other.toml",
            "--noise",
            "quietest",
            "--out",
            "e",
            "--overwrite",
        ];
        if bench.must(ledger, &words).is_none() {
            return;
        }
        let (share, count) = passed(&bench.csv(ledger, "e/map.csv"));
        shares.push(share);
        gates += count;
    }
    let found = average(&shares) / ASKED;
    ledger.equal(
        "estimate --noise quietest: flagged, of noise alone",
        found,
        1.0,
        ALLOWED + 4.0 * error(gates),
    );
}

/// Circulations of a sweep of too few gates for a fit, and limits that a refusal names.
pub(crate) fn hold_words(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let mut s = strong(r);
    s.number("scan.elevation_step_rad", 2e-2)
        .set("scan.pulses_per_line", 1)
        .set("estimator.gate_step_samples", 50);
    s.word("detector.signal", "baseband");
    bench.write("s.toml", &s.text());
    if bench
        .must(
            ledger,
            &["sweep", "s.toml", "--vary", "seed=3", "--out", "w"],
        )
        .is_some()
    {
        let table = bench.csv(ledger, "w/results.csv");
        if table.f("circulation_rms_m2_s")[0].is_nan() {
            ledger.equal(
                "results.csv: circulation_failed_fraction, of no fit that ended",
                table.f("circulation_failed_fraction")[0],
                1.0,
                0.0,
            );
        }
        let (mut nc, names) = (bench.netcdf(ledger, "w/results.nc"), table.names.clone());
        ledger.holds(
            "results.nc: scene_hash",
            nc.names().iter().any(|n| n == "scene_hash"),
            "it is not there",
        );
        for name in names
            .iter()
            .filter(|n| !["scene_hash", "case", "seed"].contains(&n.as_str()))
        {
            let stem = ["_m2_s", "_m_s", "_fraction", "_db", "_m"]
                .iter()
                .find_map(|tag| name.strip_suffix(tag))
                .unwrap_or(name);
            let variable = if nc.names().contains(name) {
                name.clone()
            } else {
                stem.into()
            };
            for (found, right) in nc.f(&variable).into_iter().zip(table.f(name)) {
                ledger.equal(
                    &format!("results.nc: {variable}"),
                    found,
                    right,
                    1e-9 * right.abs(),
                );
            }
        }
    }
    // What a refusal calls allowed is allowed.
    let mut s = strong(r);
    let (fs, b) = (r.pick(&[200e6, 250e6]), r.pick(&[40e6, 60e6]));
    s.number("detector.sampling_hz", fs)
        .number("detector.bandwidth_hz", b);
    let mut at = |fc: f64| {
        bench.write(
            "s.toml",
            &s.number("detector.intermediate_frequency_hz", fc).text(),
        );
        bench.run(&["check", "s.toml"])
    };
    let message = at(0.4 * b).stderr;
    ledger.holds(
        "a band outside of the sampling is refused",
        message.contains("detector."),
        &message,
    );
    if let Some((_, rest)) = message.split_once("between ") {
        let ends = rest
            .split(|c: char| !(c.is_ascii_digit() || "eE.+-".contains(c)))
            .filter_map(|w| w.parse::<f64>().ok());
        for end in ends.take(2).filter(|end| *end > 1e6) {
            let told = at(end);
            ledger.holds(
                "ends of a range that is called allowed",
                told.is_good,
                &format!("{end} Hz: {}", told.stderr.trim()),
            );
        }
    }
    let inside = 0.5 * b + 1e-3 * fs;
    ledger.holds(
        "a band just inside of the sampling",
        at(inside).is_good,
        &format!("{inside} Hz"),
    );
}

/// What is true of a vortex when its line of sight passes it, and how well that is known.
fn true_value(s: &Scene, stem: &str, is_right: bool) -> (f64, f64) {
    let half_m = 0.5 * s.f("flow.spacing_m") * if is_right { 1.0 } else { -1.0 };
    let mut place_m = [
        s.f("flow.lateral_position_m") + half_m,
        s.f("flow.height_m"),
    ];
    let mut gamma_m2_s = s.f("flow.circulation_m2_s");
    if let Some(path) = s.path() {
        let pulses = s.f("scan.pulses_per_line");
        for _ in 0..20 {
            let steps = place_m[1].atan2(place_m[0]) / s.f("scan.elevation_step_rad");
            let time_s = (steps * pulses + 0.5 * (pulses - 1.0)) / s.f("laser.pulse_repetition_hz");
            let Some(vortices) = path.vortices(0.0, time_s) else {
                break;
            };
            (gamma_m2_s, place_m) = vortices[usize::from(is_right)];
        }
        gamma_m2_s = gamma_m2_s.abs();
    }
    // The line that passes is known to a part of itself.
    let is_moving = s.path().is_some();
    let tolerance = |moving: f64, right: f64| {
        if is_moving {
            moving
        } else {
            1e-9 * right.abs().max(1.0)
        }
    };
    match stem {
        "gamma" => (gamma_m2_s, tolerance(0.1, gamma_m2_s)),
        "y" => (place_m[0], tolerance(0.03, place_m[0])),
        "z" => (place_m[1], tolerance(0.03, place_m[1])),
        _ => {
            let core_m = s.f("flow.core_radius_m");
            let of = |x: f64| circulation_m2_s("algebraic", gamma_m2_s, core_m, x);
            let right = 0.1 * integral(5.0, 15.0, 4, of);
            (right, tolerance(0.1, right))
        }
    }
}

/// retrieval_summary.csv: means over the realisations of retrieval.csv.
pub(crate) fn hold_summary(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let mut s = strong(r);
    s.set("scan.realisations", 3)
        .set("retrieval.methods", "[\"rv\"]")
        .set("scan.pulses_per_line", 4);
    s.number("scan.elevation_step_rad", 1e-2);
    if r.chance(0.6) {
        s.word("flow.motion", "transported")
            .number("flow.age_tau", r.between(0.3, 3.0))
            .number("flow.cross_wind_m_s", r.between(-1.0, 1.0))
            .number("flow.dissipation_m2_s3", r.log(1e-5, 2e-2));
        if r.chance(0.5) {
            s.set("flow.rebound", true);
        }
    }
    bench.write("s.toml", &s.text());
    if bench
        .must(ledger, &["run", "s.toml", "--out", "o"])
        .is_none()
    {
        return;
    }
    let rows = bench.csv(ledger, "o/retrieval.csv");
    let summary = bench.csv(ledger, "o/retrieval_summary.csv");
    let (methods, sides) = (rows.words("method"), rows.words("side"));
    for i in 0..summary.len() {
        let word = |name: &str| summary.words(name)[i].clone();
        let number = |name: &str| summary.f(name)[i];
        let quantity = word("quantity");
        let (stem, unit) = [
            ("gamma_5_15", "_m2_s"),
            ("gamma", "_m2_s"),
            ("y", "_m"),
            ("z", "_m"),
        ]
        .into_iter()
        .find(|(stem, unit)| quantity == format!("{stem}{unit}"))
        .unwrap_or(("", ""));
        let column = |what: &str| rows.f(&format!("{stem}{what}{unit}"));
        let (found, truth, stated) = (column(""), column("_true"), column("_std"));
        let own: Vec<usize> = (0..rows.len())
            .filter(|&k| {
                methods[k] == word("method") && sides[k] == word("side") && found[k].is_finite()
            })
            .collect();
        let errors: Vec<f64> = own.iter().map(|&k| found[k] - truth[k]).collect();
        let n = errors.len() as f64;
        let realisations = s.f("scan.realisations");
        let (right, tolerance) = true_value(&s, stem, word("side") == "right");
        ledger.equal(
            "retrieval_summary.csv: truth",
            number("truth"),
            right,
            tolerance,
        );
        let mut hold = |name: &str, right: f64| {
            ledger.equal(
                &format!("retrieval_summary.csv: {name}"),
                number(name),
                right,
                1e-9 * right.abs().max(1.0),
            );
        };
        hold("realisations", realisations);
        hold("failures", realisations - n);
        if n >= 2.0 {
            let bias = average(&errors);
            let square = average(&errors.iter().map(|e| e * e).collect::<Vec<_>>());
            let variance = (square - bias * bias) * n / (n - 1.0);
            hold("bias", bias);
            hold("bias_standard_error", (variance / n).sqrt());
            hold("std", variance.sqrt());
            hold("rms", square.sqrt());
            let told: Vec<f64> = own
                .iter()
                .map(|&k| stated[k])
                .filter(|v| v.is_finite())
                .collect();
            if told.len() == own.len() {
                let found = number("stated_std");
                let (low, high) = told
                    .iter()
                    .fold((f64::MAX, 0.0_f64), |(l, h), &v| (l.min(v), h.max(v)));
                ledger.holds(
                    "retrieval_summary.csv: stated_std",
                    (low - 1e-9..=high + 1e-9).contains(&found),
                    "not among the stated ones",
                );
            }
        }
    }
}
