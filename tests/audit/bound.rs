//! The Cramer-Rao bound and what a level is worth: (E8) to (E12), by own matrices and sums.

use super::geometry::{Scan, radius_m};
use super::ledger::Ledger;
use super::numerics::{Complex, information};
use super::power::{Pulse, Ratios, window_powers};
use super::scene::Scene;
use serde_json::Value;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Density of what is left of band noise outside of the band, in that of the band (page on the scene file, The bound).
const FLOOR: f64 = 1e-6;

/// Information of a record of `n` samples about the velocity of a uniform wind at rest (E12), s^2/m^2; noise in the band has unit power, the
/// signal the ratio so many samples behind the middle of the record.
fn record_information(s: &Scene, pulse: &Pulse, n: usize, snr: impl Fn(f64) -> f64) -> f64 {
    let (ts, lambda) = (1.0 / s.f("detector.sampling_hz"), s.f("laser.wavelength_m"));
    let (b, fc) = (
        s.f("detector.bandwidth_hz") * ts,
        s.f("detector.intermediate_frequency_hz") * ts,
    );
    let is_baseband = s.s("detector.signal") == "baseband";
    let is_band = s.s("detector.noise") == "band";
    // c(l) of the signal, of unit power.
    let c = |l: f64| (-(l * ts / (2.0 * pulse.sigma_s)).powi(2)).exp();
    let sinc = |x: f64| {
        if x == 0.0 {
            1.0
        } else {
            (PI * x).sin() / (PI * x)
        }
    };
    let delta = |l: f64| if l == 0.0 { 1.0 } else { 0.0 };
    // The density of the noise goes on beyond the band where it is white.
    let noise = |l: f64| match (is_band, is_baseband) {
        (false, true) => delta(l) / b,
        (false, false) => delta(l) * 0.5 / b,
        (true, true) => (1.0 - FLOOR) * sinc(b * l) + FLOOR / b * delta(l),
        (true, false) => {
            (1.0 - FLOOR) * sinc(b * l) * (2.0 * PI * fc * l).cos() + 0.5 * FLOOR / b * delta(l)
        }
    };
    // Two samples of a Gaussian pulse share the air about the middle between them.
    let between: Vec<f64> = (0..2 * n)
        .map(|sum| snr(0.5 * sum as f64 - 0.5 * (n as f64 - 1.0)))
        .collect();
    let rate = 4.0 * PI * ts / lambda;
    // Of lag and power.
    let matrix = |of: &dyn Fn(f64, f64) -> Complex| {
        let row = |i: usize| {
            (0..n)
                .map(|j| of(i as f64 - j as f64, between[i + j]))
                .collect()
        };
        (0..n).map(row).collect::<Vec<Vec<_>>>()
    };
    let (r, d, share) = match is_baseband {
        true => (
            matrix(&|l, p| Complex::from(p * c(l) + noise(l))),
            matrix(&|l, p| Complex::new(0.0, -rate * l * p * c(l))),
            1.0,
        ),
        // The real part of the same on its carrier.
        false => (
            matrix(&|l, p| Complex::from(p * c(l) * (2.0 * PI * fc * l).cos() + noise(l))),
            matrix(&|l, p| Complex::from(rate * l * p * c(l) * (2.0 * PI * fc * l).sin())),
            0.5,
        ),
    };
    share * information(&r, &d)
}

/// Squared correlation gamma^2 of two windows `apart` samples apart (E9), (E10), with the noise of its density.
fn correlation2(s: &Scene, pulse: &Pulse, apart: usize, snr: f64) -> f64 {
    let ts = 1.0 / s.f("detector.sampling_hz");
    let h: Vec<f64> = window_powers(s).iter().map(|h2| h2.sqrt()).collect();
    // White noise has F_s/B times the power in the band; that of the band alone is alike over its inverse.
    let b = s.f("detector.bandwidth_hz") * ts;
    let noise = |l: i64| match (s.s("detector.noise").as_str(), l) {
        ("none", _) => 0.0,
        ("white", 0) => 1.0 / (b * snr),
        ("white", _) => 0.0,
        (_, 0) => 1.0 / snr,
        (_, l) => (PI * b * l as f64).sin() / (PI * b * l as f64) / snr,
    };
    let c = |l: i64| {
        let of_signal = (-(l as f64 * ts / (2.0 * pulse.sigma_s)).powi(2)).exp();
        of_signal + noise(l)
    };
    let sum = |shift: i64| {
        let mut sum = 0.0;
        for (n, hn) in h.iter().enumerate() {
            for (m, hm) in h.iter().enumerate() {
                sum += hn * hm * c(shift + n as i64 - m as i64);
            }
        }
        sum
    };
    (sum(apart as i64) / sum(0)).powi(2)
}

/// n_eff of a region (E8): `windows` are the first samples of the windows of each line.
pub(crate) fn independent(
    s: &Scene,
    pulse: &Pulse,
    windows: &[Vec<usize>],
    pulses: usize,
    snr: f64,
) -> f64 {
    let mut known = BTreeMap::new();
    let (mut count, mut pairs) = (0.0, 0.0);
    for starts in windows {
        for a in starts {
            count += 1.0;
            for b in starts {
                let apart = a.abs_diff(*b);
                pairs += *known
                    .entry(apart)
                    .or_insert_with(|| correlation2(s, pulse, apart, snr));
            }
        }
    }
    pulses as f64 * count * count / pairs
}

/// The bound of a region: each line's record that its windows cover, every pulse of it, (E12) for independent records; `record` takes its
/// length, and how far its middle is behind that of the windows that begin at a sample.
fn region_m_s(
    n: usize,
    windows: &[Vec<usize>],
    pulses: usize,
    record: impl Fn(usize, f64) -> f64,
    begin: f64,
) -> f64 {
    let mut known = BTreeMap::new();
    let mut sum = 0.0;
    for starts in windows.iter().filter(|starts| !starts.is_empty()) {
        let (first, last) = (starts[0], starts[starts.len() - 1]);
        let behind = 0.5 * (first + last) as f64 - begin;
        sum += *known
            .entry((first, last))
            .or_insert_with(|| record(last - first + n, behind));
    }
    1.0 / (pulses as f64 * sum).sqrt()
}

/// `bound --json`: windows, levels, n_eff and regions at a few ratios and ranges.
pub(crate) fn hold(ledger: &mut Ledger, s: &Scene, scan: &Scan, json: &Value) {
    let Some(pulse) = Pulse::gaussian(s) else {
        return;
    };
    let n = s.n("estimator.window_samples");
    let line = scan.elevation_rad.len() / 2;
    let gates = scan.gate_m.len();
    let by_snr = json["by_snr"].as_array().cloned().unwrap_or_default();
    let by_range = json["by_range"].as_array().cloned().unwrap_or_default();
    ledger.equal(
        "bound: rows",
        (by_snr.len() + by_range.len()) as f64,
        (91 + gates) as f64,
        0.0,
    );
    for point in by_snr.first().into_iter() {
        super::program::see(ledger, "bound", point);
    }
    let chosen = |points: &[Value], rows: &[usize]| {
        rows.iter()
            .filter_map(|&i| points.get(i).cloned())
            .collect::<Vec<_>>()
    };
    let at_ratio = chosen(&by_snr, &[10, 30, 50])
        .into_iter()
        .map(|p| (p, gates / 2, false));
    let ends = [0, gates / 2, gates - 1];
    let at_range = chosen(&by_range, &ends)
        .into_iter()
        .zip(ends)
        .map(|(p, gate)| (p, gate, true));
    let ratios = Ratios::new(s, pulse, scan, 3.0);
    for (point, gate, is_of_range) in at_ratio.chain(at_range) {
        let f = |key: &str| point[key].as_f64().unwrap_or(f64::NAN);
        let air = 10_f64.powf(0.1 * f("snr_db"));
        ledger.equal("bound: range_m", f("range_m"), scan.gate_m[gate], 1e-6);
        if air.is_nan() {
            continue;
        }
        let Some(radius) = radius_m(s, scan.gate_m[gate]) else {
            continue;
        };
        let windows = match s.s("estimator.method.kind") == "periodogram" {
            true => vec![scan.own_window(gate)],
            false => scan.region(line, gate, radius, n),
        };
        let count = windows.iter().map(Vec::len).sum::<usize>();
        ledger.equal(
            "bound: level",
            f("level"),
            (count * scan.pulses) as f64,
            0.5,
        );
        if count == 0 {
            ledger.equal("bound: n_eff", f("n_eff"), 0.0, 0.0);
            ledger.equal(
                "bound: bound_region_m_s",
                f("bound_region_m_s"),
                f64::NAN,
                0.0,
            );
            continue;
        }
        let here = if is_of_range {
            ratios.of_window(s, scan, gate)
        } else {
            air
        };
        let right = independent(s, &pulse, &windows, scan.pulses, here);
        ledger.equal("bound: n_eff", f("n_eff"), right, 1e-3 * right);
        let longest = windows
            .iter()
            .filter_map(|w| Some(w.last()? - w.first()? + n))
            .max()
            .unwrap_or(n);
        if f("snr_db") > 30.0 || longest > 200 {
            continue;
        }
        let begin = (scan.gate_m[gate] - scan.sample_m[0]) / scan.sample_step_m() - 0.5 * n as f64;
        let seen =
            |samples: f64| ratios.seen(scan.gate_m[gate] + (samples - 0.5) * scan.sample_step_m());
        let information = |n: usize, behind: f64| match is_of_range {
            true => record_information(s, &pulse, n, |samples| seen(samples + behind)),
            false => record_information(s, &pulse, n, |_| here),
        };
        // Ratios are held to a hundredth of a decibel, and where the noise rules the bound goes as their inverse.
        let tolerance = if is_of_range {
            10_f64.powf(1e-3) - 1.0
        } else {
            1e-4
        };
        let right = 1.0 / information(n, 0.0).sqrt();
        ledger.equal(
            "bound: bound_window_m_s",
            f("bound_window_m_s"),
            right,
            tolerance * right,
        );
        let right = region_m_s(n, &windows, scan.pulses, information, begin);
        ledger.equal(
            "bound: bound_region_m_s",
            f("bound_region_m_s"),
            right,
            tolerance.max(1e-3) * right,
        );
    }
}
