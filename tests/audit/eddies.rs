//! Turbulence of `kind = "eddies"`: what its waves make on average, and velocities that follow from the layers of signals.nc.

use super::air::radial_m_s;
use super::geometry::{Scan, line_time_s};
use super::ledger::Ledger;
use super::power::{Pulse, window_powers};
use super::program::{Bench, Csv};
use super::scene::Scene;
use toml::Value;

/// Mean and standard deviation of the power 2/3 of the size of a standard normal number, which is nearly normal.
const SIZE_MEAN: f64 = 0.802_37;
const SIZE_DEVIATION: f64 = 0.432_52;

/// The turbulence of a scene: von Karman's spectrum from 0.1/L to 2 pi/smallest.
pub(crate) struct Eddies {
    pub(crate) dissipation_m2_s3: f64,
    outer_m: f64,
    smallest_m: f64,
    constant: f64,
    pub(crate) is_blocked: bool,
    /// Each realisation has its own.
    pub(crate) is_each: bool,
}

impl Eddies {
    /// The turbulence of a scene, unless its dissipation rate is 0.
    pub(crate) fn of(s: &Scene) -> Option<Self> {
        let own = s.get("flow").into_iter();
        let added = s.get("added_flows").and_then(|v| v.as_array().cloned());
        let mut flows = own.chain(added.into_iter().flatten());
        let table =
            flows.find(|flow| flow.get("kind").and_then(Value::as_str) == Some("eddies"))?;
        let number = |key: &str, default: f64| {
            let value = table.get(key);
            value.and_then(Value::as_float).unwrap_or(default)
        };
        let word = |key: &str| table.get(key).and_then(Value::as_str).unwrap_or_default();
        let dissipation_m2_s3 = number("dissipation_m2_s3", 5e-4);
        (dissipation_m2_s3 > 0.0).then(|| Self {
            dissipation_m2_s3,
            outer_m: number("outer_scale_m", 100.0),
            smallest_m: number("smallest_m", 2.0),
            constant: number("kolmogorov_constant", 1.5),
            is_blocked: word("ground") == "blocked",
            is_each: word("realisations") == "each",
        })
    }

    /// Integral over the waves of E(k) and a factor, by steps in ln k.
    fn over_waves(&self, factor: impl Fn(f64) -> f64) -> f64 {
        const STEPS: usize = 4000;
        let (low, high) = (
            0.1 / self.outer_m,
            2.0 * std::f64::consts::PI / self.smallest_m,
        );
        let step = (high / low).ln() / STEPS as f64;
        let of_wave = |i: usize| {
            let k = low * (step * (i as f64 + 0.5)).exp();
            let x = k * self.outer_m;
            let shape = x.powi(4) / (1.0 + x * x).powf(17.0 / 6.0);
            shape * factor(k) * k * step
        };
        let scale = self.dissipation_m2_s3.powf(2.0 / 3.0) * self.outer_m.powf(5.0 / 3.0);
        self.constant * scale * (0..STEPS).map(of_wave).sum::<f64>()
    }

    /// Standard deviation of a component, m/s; with a blocked ground the largest.
    pub(crate) fn deviation_m_s(&self) -> f64 {
        let free = (2.0 / 3.0 * self.over_waves(|_| 1.0)).sqrt();
        if self.is_blocked {
            1.5_f64.sqrt() * free
        } else {
            free
        }
    }

    /// Mean square of the difference along a line, m^2/s^2.
    fn structure_m2_s2(&self, distance_m: f64) -> f64 {
        self.over_waves(|k| {
            let x = k * distance_m;
            let along = match x < 1e-2 {
                true => 1.0 / 3.0 - x * x / 30.0,
                false => (x.sin() - x * x.cos()) / x.powi(3),
            };
            4.0 * (1.0 / 3.0 - along)
        })
    }
}

/// The velocities of a map in turbulence: those of points scatter as the waves do, and those of pulses and gates are means over the
/// layers of signals.nc.
pub(crate) fn hold_map(
    ledger: &mut Ledger,
    bench: &Bench,
    s: &Scene,
    scan: &Scan,
    map: &Csv,
    eddies: &Eddies,
) {
    hold_scatter(ledger, s, scan, map, eddies);
    let Some(pulse) = Pulse::gaussian(s) else {
        return;
    };
    if bench
        .must(ledger, &["signal", "s.toml", "--out", "layers"])
        .is_none()
    {
        return;
    }
    let mut nc = bench.netcdf(ledger, "layers/signals.nc");
    let (range, velocity) = (nc.f("range"), nc.f("radial_velocity"));
    let (of_pulse, of_gate) = (map.f("v_pulse_m_s"), map.f("v_gate_m_s"));
    let (h2, gates) = (window_powers(s), scan.gate_m.len());
    for line in [0, scan.elevation_rad.len() / 2] {
        let layers = &velocity[line * range.len()..(line + 1) * range.len()];
        let mean = |weight: &dyn Fn(f64) -> f64| {
            let (mut sum, mut total) = (0.0, 0.0);
            for (&r, &v) in range.iter().zip(layers) {
                sum += weight(r) * v;
                total += weight(r);
            }
            sum / total
        };
        let fast = layers.iter().fold(1e-3_f64, |a, v| a.max(v.abs()));
        for gate in (0..gates).step_by(1 + gates / 5) {
            let row = line * gates + gate;
            let right = mean(&|r| pulse.power_over_range(scan.gate_m[gate] - r));
            ledger.equal("map.csv: v_pulse_m_s", of_pulse[row], right, 2e-6 * fast);
            let samples = &scan.sample_m[scan.gate_start[gate]..];
            let right = mean(&|r| {
                let of_sample = |(&m, h2): (&f64, &f64)| h2 * pulse.power_over_range(m - r);
                samples.iter().zip(&h2).map(of_sample).sum()
            });
            ledger.equal("map.csv: v_gate_m_s", of_gate[row], right, 2e-6 * fast);
        }
    }
}

/// A velocity, and the difference of two of a line, against what the waves make on average.
fn hold_scatter(ledger: &mut Ledger, s: &Scene, scan: &Scan, map: &Csv, eddies: &Eddies) {
    // Where waves move the pair, its velocities hang on them.
    if s.is_true("flow.meander") {
        return;
    }
    let (line, gates) = (scan.elevation_rad.len() / 2, scan.gate_m.len());
    let exact = map.f("v_exact_m_s");
    let turbulent = |gate: usize| {
        let (e, r) = (scan.elevation_rad[line], scan.gate_m[gate]);
        exact[line * gates + gate] - radial_m_s(s, e, line_time_s(s, line), r)
    };
    let (near, far) = (gates / 3, gates - 1);
    let deviation_m_s = eddies.deviation_m_s();
    ledger.mean(
        "map.csv: v_exact_m_s, of turbulence",
        turbulent(near),
        0.0,
        deviation_m_s,
    );
    if near == far || eddies.is_blocked {
        return;
    }
    let square_m2_s2 = eddies.structure_m2_s2(scan.gate_m[far] - scan.gate_m[near]);
    let size = ((turbulent(far) - turbulent(near)).abs() / square_m2_s2.sqrt()).powf(2.0 / 3.0);
    let number = "map.csv: v_exact_m_s, size of differences in turbulence";
    ledger.mean(number, size, SIZE_MEAN, SIZE_DEVIATION);
}
