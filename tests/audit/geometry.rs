//! Lines, gates, windows and times: (E1), (G1), Table 3, as lists and double loops.

use super::ledger::Ledger;
use super::program::Csv;
use super::scene::{C_M_S, Scene};

/// A vertical scan as its lists.
pub(crate) struct Scan {
    /// Elevation of each line, rad.
    pub(crate) elevation_rad: Vec<f64>,
    /// Range of each sample, m.
    pub(crate) sample_m: Vec<f64>,
    /// First sample of each gate.
    pub(crate) gate_start: Vec<usize>,
    /// Range of the centre of each gate (E1), m.
    pub(crate) gate_m: Vec<f64>,
    /// First sample of each accumulated window.
    pub(crate) window_start: Vec<usize>,
    pub(crate) pulses: usize,
}

impl Scan {
    /// A plain RHI: from the lowest line up, all with as many pulses.
    pub(crate) fn new(s: &Scene) -> Self {
        let (low, high, step) = (
            s.f("scan.elevation_min_rad"),
            s.f("scan.elevation_max_rad"),
            s.f("scan.elevation_step_rad"),
        );
        let lines = ((high - low) / step + 1e-9).floor() as usize + 1;
        let sample_step_m = 0.5 * C_M_S / s.f("detector.sampling_hz");
        let (near_m, far_m) = (s.f("scan.range_min_m"), s.f("scan.range_max_m"));
        let samples = ((far_m - near_m) / sample_step_m + 1e-9).floor() as usize + 1;
        let n = s.n("estimator.window_samples");
        let starts = |step: usize| (0..=samples - n).step_by(step).collect::<Vec<_>>();
        let gate_start = starts(s.n("estimator.gate_step_samples"));
        // (E1): the centre of the window, N/2 samples behind its first one.
        let centre_m = |start: usize| near_m + sample_step_m * (start as f64 + 0.5 * n as f64);
        Self {
            elevation_rad: (0..lines).map(|i| low + i as f64 * step).collect(),
            sample_m: (0..samples)
                .map(|k| near_m + k as f64 * sample_step_m)
                .collect(),
            gate_m: gate_start.iter().map(|&g| centre_m(g)).collect(),
            gate_start,
            window_start: starts(s.n("estimator.window_step_samples")),
            pulses: s.n("scan.pulses_per_line"),
        }
    }

    /// Distance between two samples in range, m.
    pub(crate) fn sample_step_m(&self) -> f64 {
        self.sample_m[1] - self.sample_m[0]
    }

    /// The window of a gate alone: its first sample, if windows lie there.
    pub(crate) fn own_window(&self, gate: usize) -> Vec<usize> {
        self.window_start
            .iter()
            .copied()
            .filter(|start| *start == self.gate_start[gate])
            .collect()
    }

    /// Windows within `radius_m` of a gate (E7), for each line: their first samples.
    pub(crate) fn region(
        &self,
        line: usize,
        gate: usize,
        radius_m: f64,
        n: usize,
    ) -> Vec<Vec<usize>> {
        let (r1, e1) = (self.gate_m[gate], self.elevation_rad[line]);
        let near = |e2: f64, start: usize| {
            let r2 = self.sample_m[0] + self.sample_step_m() * (start as f64 + 0.5 * n as f64);
            let across = r1 * r1 + r2 * r2 - 2.0 * r1 * r2 * (e1 - e2).cos();
            // On the very edge round-off decides; it is taken as within.
            across.max(0.0).sqrt() <= radius_m + 1e-6
        };
        let of_line = |&e2: &f64| {
            self.window_start
                .iter()
                .copied()
                .filter(|&start| near(e2, start))
                .collect()
        };
        self.elevation_rad.iter().map(of_line).collect()
    }
}

/// Radius of the region at a range, m; nothing where it is sought by the bound.
pub(crate) fn radius_m(s: &Scene, range_m: f64) -> Option<f64> {
    match s.s("estimator.radius.kind").as_str() {
        "fixed" => Some(s.f("estimator.radius_m")),
        "of_range" => Some(super::numerics::straight(
            &s.list("estimator.radius.range_m"),
            &s.list("estimator.radius.radius_m"),
            range_m,
        )),
        _ => None,
    }
}

/// Time of the middle of the pulses of a line after the start of the scan, s.
pub(crate) fn line_time_s(s: &Scene, line: usize) -> f64 {
    let pulses = s.f("scan.pulses_per_line");
    (line as f64 * pulses + 0.5 * (pulses - 1.0)) / s.f("laser.pulse_repetition_hz")
}

/// The places of a map of a plain RHI.
pub(crate) fn hold(ledger: &mut Ledger, s: &Scene, scan: &Scan, map: &Csv, start_s: f64) {
    let gates = scan.gate_m.len();
    ledger.equal(
        "map.csv: rows",
        map.len() as f64,
        (gates * scan.elevation_rad.len()) as f64,
        0.5,
    );
    let f = |name: &str| map.f(name);
    let (range, elevation, y, z, azimuth, time, sweep, ray) = (
        f("range_m"),
        f("elevation_rad"),
        f("y_m"),
        f("z_m"),
        f("azimuth_rad"),
        f("time_s"),
        f("sweep"),
        f("ray"),
    );
    let height_m = s.f("scan.lidar_height_m");
    let place_y_m = s.f("scan.lidar.y_m");
    for row in 0..map.len() {
        let (line, gate) = (row / gates, row % gates);
        let (r, e) = (scan.gate_m[gate], scan.elevation_rad[line]);
        ledger.equal("map.csv: range_m", range[row], r, 1e-9 * r);
        ledger.equal("map.csv: elevation_rad", elevation[row], e, 1e-12);
        ledger.equal("map.csv: y_m", y[row], place_y_m + r * e.cos(), 1e-9 * r);
        ledger.equal("map.csv: z_m", z[row], height_m + r * e.sin(), 1e-9 * r);
        ledger.equal(
            "map.csv: azimuth_rad",
            azimuth[row],
            s.f("scan.azimuth_rad"),
            1e-12,
        );
        ledger.equal(
            "map.csv: time_s",
            time[row],
            start_s + line_time_s(s, line),
            1e-9,
        );
        ledger.equal("map.csv: sweep", sweep[row], 0.0, 0.0);
        ledger.equal("map.csv: ray", ray[row], line as f64, 0.0);
    }
}

/// The levels of a map: all pulses counted (a periodogram alone has no region).
pub(crate) fn hold_levels(ledger: &mut Ledger, s: &Scene, scan: &Scan, map: &Csv) {
    let (gates, n, level) = (
        scan.gate_m.len(),
        s.n("estimator.window_samples"),
        map.f("level"),
    );
    let is_alone = s.s("estimator.method.kind") == "periodogram";
    for row in (0..map.len()).step_by(1 + map.len() / 60) {
        let (line, gate) = (row / gates, row % gates);
        let Some(radius) = radius_m(s, scan.gate_m[gate]) else {
            return;
        };
        let windows = match is_alone {
            true => scan.own_window(gate).len(),
            false => scan
                .region(line, gate, radius, n)
                .iter()
                .map(Vec::len)
                .sum::<usize>(),
        };
        ledger.equal(
            "map.csv: level",
            level[row],
            (windows * scan.pulses) as f64,
            0.5,
        );
    }
}
