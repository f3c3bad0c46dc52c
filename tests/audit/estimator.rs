//! The estimator on its own signals: (E3), (E7), (E2) by sums over samples; the same signals by `estimate`.

use super::draw;
use super::geometry::{Scan, radius_m};
use super::ledger::Ledger;
use super::numerics::Complex;
use super::power::window_powers;
use super::program::Bench;
use super::random::Random;
use std::f64::consts::PI;

/// Records of a scan: every pulse, every sample.
struct Records {
    samples: usize,
    values: Vec<Complex>,
}

/// Mean density of windows at a frequency (E3), (E7).
fn density(records: &Records, h: &[f64], windows: &[(usize, usize)], cycles: f64) -> f64 {
    let total: f64 = h.iter().map(|h| h * h).sum();
    let of_window = |&(ray, start): &(usize, usize)| {
        let mut sum = Complex::default();
        for (n, h) in h.iter().enumerate() {
            sum += records.values[ray * records.samples + start + n]
                * Complex::from_polar(*h, -2.0 * PI * cycles * n as f64);
        }
        sum.norm_sqr() / total
    };
    windows.iter().map(of_window).sum::<f64>() / windows.len() as f64
}

pub(crate) fn hold(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let mut s = draw::scene(r);
    draw::fixed_ratio(&mut s, r.between(3.0, 20.0));
    s.unset("estimator.method").word(
        "estimator.method.kind",
        r.pick(&["periodogram", "periodogram_accumulation"]),
    );
    s.unset("estimator.radius")
        .unset("estimator.radius_m")
        .set("estimator.window_samples", r.pick(&[16, 32, 48]));
    if s.s("estimator.method.kind") != "periodogram" {
        s.number("estimator.radius_m", r.between(0.0, 1.5));
    }
    s.set("estimator.padded_samples", r.pick(&[256, 512]))
        .word("estimator.refinement", r.pick(&["parabola", "none"]));
    s.set("scan.realisations", 1)
        .set("outputs.signals", true)
        .set("scan.pulses_per_line", r.whole(1, 2));
    bench.write("s.toml", &s.text());
    if !bench.run(&["check", "s.toml"]).is_good
        || bench
            .must(ledger, &["run", "s.toml", "--out", "o"])
            .is_none()
    {
        return;
    }
    let (map, mut nc, scan) = (
        bench.csv(ledger, "o/map.csv"),
        bench.netcdf(ledger, "o/signals.nc"),
        Scan::new(&s),
    );
    let (current, quadrature) = (nc.f("current_a"), nc.f("quadrature_a"));
    let value = |i: usize| Complex::new(current[i], quadrature.get(i).copied().unwrap_or(0.0));
    let records = Records {
        samples: scan.sample_m.len(),
        values: (0..current.len()).map(value).collect(),
    };
    let h: Vec<f64> = window_powers(&s).iter().map(|h2| h2.sqrt()).collect();
    let (fs, b, padded) = (
        s.f("detector.sampling_hz"),
        s.f("detector.bandwidth_hz"),
        s.n("estimator.padded_samples") as i64,
    );
    let is_baseband = s.s("detector.signal") == "baseband";
    let fc = if is_baseband {
        0.0
    } else {
        s.f("detector.intermediate_frequency_hz")
    };
    let grid: Vec<i64> = (-padded / 2..=padded / 2)
        .filter(|k| (*k as f64 * fs / padded as f64 - fc).abs() <= 0.5 * b)
        .collect();
    let (velocity, gates) = (map.f("v_mean_m_s"), scan.gate_m.len());
    for row in (0..map.len()).step_by(1 + map.len() / 6) {
        let (line, gate) = (row / gates, row % gates);
        let lines = match (
            s.s("estimator.method.kind") == "periodogram",
            radius_m(&s, scan.gate_m[gate]),
        ) {
            (false, Some(radius)) => scan.region(line, gate, radius, h.len()),
            _ => (0..scan.elevation_rad.len())
                .map(|l| {
                    if l == line {
                        scan.own_window(gate)
                    } else {
                        vec![]
                    }
                })
                .collect(),
        };
        let pulses = |l: usize| (0..scan.pulses).map(move |p| l * scan.pulses + p);
        let windows: Vec<(usize, usize)> = lines
            .iter()
            .enumerate()
            .flat_map(|(l, starts)| {
                pulses(l).flat_map(move |ray| starts.iter().map(move |start| (ray, *start)))
            })
            .collect();
        if windows.is_empty() {
            ledger.equal(
                "map.csv: v_mean_m_s, of an empty region",
                velocity[row],
                f64::NAN,
                0.0,
            );
            continue;
        }
        let at = |k: i64| density(&records, &h, &windows, k as f64 / padded as f64);
        let spectrum: Vec<f64> = grid.iter().map(|&k| at(k)).collect();
        let place = (0..grid.len())
            .max_by(|&a, &b| spectrum[a].total_cmp(&spectrum[b]))
            .unwrap_or(0);
        if place == 0 || place + 1 == grid.len() {
            continue; // on an edge of the band: flagged
        }
        let [low, middle, high] = [-1, 0, 1].map(|d| spectrum[(place as i64 + d) as usize].ln());
        let is_refined = s.s("estimator.refinement") == "parabola";
        let shift = if is_refined {
            0.5 * (low - high) / (low - 2.0 * middle + high)
        } else {
            0.0
        };
        let f = (grid[place] as f64 + shift) * fs / padded as f64;
        let right = 0.5 * s.f("laser.wavelength_m") * (fc - f);
        ledger.equal(
            "map.csv: v_mean_m_s, by (E3), (E7)",
            velocity[row],
            right,
            1e-5,
        );
    }
    hold_again(ledger, bench);
}

/// The run's own signals by `estimate` make its own map; with spectra, too.
fn hold_again(ledger: &mut Ledger, bench: &Bench) {
    let map = |folder: &str| {
        let text =
            std::fs::read_to_string(bench.folder.join(folder).join("map.csv")).unwrap_or_default();
        text.lines()
            .filter(|l| !l.starts_with('#'))
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    if bench
        .must(
            ledger,
            &[
                "estimate",
                "o/signals.nc",
                "--scene",
                "s.toml",
                "--out",
                "e",
            ],
        )
        .is_some()
    {
        ledger.holds(
            "estimate: the map of the run",
            map("e") == map("o"),
            "another map.csv",
        );
        bench.csv(ledger, "e/predicted.csv");
    }
    let words = [
        "estimate",
        "o/signals.nc",
        "--scene",
        "s.toml",
        "--noise",
        "1e-30",
        "--out",
        "n",
    ];
    let is_refused = !bench.run(&words).is_good;
    ledger.holds(
        "estimate: --noise of own signals",
        is_refused || map("n") != map("o"),
        "ignored in silence",
    );
}

/// Signals of sweeps back and forth by `estimate`, with and without spectra: the lines of the run.
pub(crate) fn hold_turns(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let mut s = draw::scene(r);
    s.unset("estimator")
        .set("outputs.signals", true)
        .set("scan.realisations", 1)
        .set("scan.head.sweeps", 2);
    s.word("scan.head.direction", "alternate")
        .set("estimator.gate_step_samples", 25);
    s.set("estimator.window_step_samples", 3)
        .set("scan.pulses_per_line", r.whole(1, 2));
    s.number("scan.elevation_min_rad", 0.08)
        .number("scan.elevation_step_rad", 1e-2)
        .number("scan.elevation_max_rad", 0.12);
    bench.write("s.toml", &s.text());
    if !bench.run(&["check", "s.toml"]).is_good
        || bench
            .must(ledger, &["run", "s.toml", "--out", "o"])
            .is_none()
    {
        return;
    }
    hold_again(ledger, bench);
    if bench
        .must(
            ledger,
            &[
                "estimate",
                "o/signals.nc",
                "--scene",
                "s.toml",
                "--spectra",
                "--out",
                "s",
            ],
        )
        .is_some()
    {
        let (run, again) = (
            bench.csv(ledger, "o/map.csv"),
            bench.csv(ledger, "s/map.csv"),
        );
        ledger.equal(
            "estimate --spectra: rows",
            again.len() as f64,
            run.len() as f64,
            0.0,
        );
        for (a, b) in again.f("v_mean_m_s").into_iter().zip(run.f("v_mean_m_s")) {
            ledger.equal("estimate --spectra: v_mean_m_s", a, b, 1e-6);
        }
    }
}
