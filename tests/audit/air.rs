//! The air: closed forms of the winds, and what pulse and window make of them, (V1) to (V10), (S11), (S12).

use super::eddies::{self, Eddies};
use super::geometry::{Scan, line_time_s};
use super::ledger::Ledger;
use super::power::Pulse;
use super::program::{Bench, Csv};
use super::scene::Scene;
use std::f64::consts::PI;
use toml::Value;

/// Error that the path of a transported pair may have, of the largest velocity.
const OF_PATH: f64 = 1e-5;

/// One wind of a scene, as its keys.
struct Wind<'a>(&'a dyn Fn(&str) -> Option<Value>);

fn number(value: &Value) -> f64 {
    value
        .as_float()
        .or(value.as_integer().map(|n| n as f64))
        .unwrap_or(f64::NAN)
}

fn numbers(value: Option<Value>) -> Vec<f64> {
    value
        .and_then(|v| v.as_array().cloned())
        .unwrap_or_default()
        .iter()
        .map(number)
        .collect()
}

/// Gamma(r) of a vortex, (V1) or (V2).
pub(crate) fn circulation_m2_s(profile: &str, gamma_m2_s: f64, core_m: f64, r_m: f64) -> f64 {
    match profile {
        // The root of 2 beta + 1 = exp(beta).
        "lamb_oseen" => gamma_m2_s * (1.0 - (-1.256_431_208_626_17 * (r_m / core_m).powi(2)).exp()),
        _ => gamma_m2_s * r_m * r_m / (r_m * r_m + core_m * core_m),
    }
}

impl Wind<'_> {
    fn f(&self, key: &str) -> f64 {
        (self.0)(key).as_ref().map_or(f64::NAN, number)
    }

    fn or(&self, key: &str, default: f64) -> f64 {
        (self.0)(key).as_ref().map_or(default, number)
    }

    fn s(&self, key: &str) -> String {
        (self.0)(key)
            .and_then(|v| v.as_str().map(str::to_owned))
            .unwrap_or_default()
    }

    /// Velocity (u, v, w) at a point, `time_s` after the scan began.
    fn at(&self, p: [f64; 3], time_s: f64) -> [f64; 3] {
        match self.s("kind").as_str() {
            // What is random in turbulence is held by its averages.
            "calm" | "eddies" => [0.0; 3],
            "wind" => self.mean_wind(p[2]),
            "uniform" => [0.0, self.f("lateral_m_s"), self.f("vertical_m_s")],
            "linear" => {
                let (start, a) = (
                    numbers((self.0)("velocity_m_s")),
                    numbers((self.0)("acceleration_m_s2")),
                );
                let of = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(0.0);
                let gradients = ["gradient_u_per_s", "gradient_v_per_s", "gradient_w_per_s"];
                std::array::from_fn(|i| {
                    let g = numbers((self.0)(gradients[i]));
                    of(&start, i)
                        + of(&a, i) * time_s
                        + (0..3).map(|j| of(&g, j) * p[j]).sum::<f64>()
                })
            }
            _ => self.pair(p, time_s),
        }
    }

    /// A mean wind at a height: laws that are linear near the ground, or straight lines of a table.
    fn mean_wind(&self, z_m: f64) -> [f64; 3] {
        if self.s("profile") == "table" {
            return self.table_wind(z_m);
        }
        let is_power = self.s("profile") == "power";
        let (roughness_m, top_m) = (self.or("roughness_m", 0.03), self.or("displacement_m", 0.0));
        let linear_m = if is_power {
            1.0
        } else {
            (10.0 * roughness_m).max(1.0)
        };
        let shape = |above_m: f64| match is_power {
            true => above_m.powf(self.or("exponent", 0.143)),
            false => (above_m / roughness_m).ln(),
        };
        let (above_m, z0_m) = (z_m - top_m, self.or("reference_height_m", 10.0) - top_m);
        let at = shape(above_m.max(linear_m)) * (above_m / linear_m).clamp(0.0, 1.0);
        // Draws state both components or none; the pair of the default scene has a cross wind.
        let head_wind_m_s = self.f("head_wind_m_s");
        let (mut u, mut v) = (-head_wind_m_s, self.f("cross_wind_m_s"));
        if head_wind_m_s.is_nan() {
            let toward = self.or("toward_rad", 0.5 * PI);
            let speed = self.or("speed_m_s", 5.0);
            (u, v) = (speed * toward.cos(), speed * toward.sin());
        }
        let mut over = at / shape(z0_m);
        if self.f("friction_velocity_m_s").is_finite() {
            let toward = self.or("toward_rad", 0.5 * PI);
            (u, v) = (toward.cos(), toward.sin());
            over = self.f("friction_velocity_m_s") / 0.4 * at;
        }
        [over * u, over * v, 0.0]
    }

    fn table_wind(&self, z_m: f64) -> [f64; 3] {
        let heights = numbers((self.0)("height_m"));
        let speeds = numbers((self.0)("speeds_m_s"));
        let towards = numbers((self.0)("towards_rad"));
        let mut out = [0.0; 3];
        for (i, &height_m) in heights.iter().enumerate() {
            // A hat about each height, flat beyond the ends.
            let mut share = 1.0_f64;
            if z_m < height_m && i > 0 {
                share = ((z_m - heights[i - 1]) / (height_m - heights[i - 1])).max(0.0);
            }
            if z_m > height_m && i + 1 < heights.len() {
                share = ((heights[i + 1] - z_m) / (heights[i + 1] - height_m)).max(0.0);
            }
            out[0] += share * speeds[i] * towards[i].cos();
            out[1] += share * speeds[i] * towards[i].sin();
        }
        out
    }

    /// Half the distance, and the height, of the vortices at a time: (V8) to (V10).
    fn path_m(&self, time_s: f64) -> (f64, f64) {
        let (b0, z0, gamma) = (
            self.or("spacing_m", 47.0),
            self.or("height_m", 47.0),
            self.or("circulation_m2_s", 500.0),
        );
        if self.s("motion") != "inviscid" || gamma == 0.0 {
            return (0.5 * b0, z0);
        }
        let t = self.or("age_tau", 0.0) * b0 * 2.0 * PI * b0 / gamma + time_s;
        let (y, z) = (0.5 * b0, z0);
        let c = 1.0 / (y * y) + 1.0 / (z * z);
        // tan phi = y/z, and cot 2 phi falls evenly.
        let cot = 0.5 * (z / y - y / z) - c * gamma * t / (8.0 * PI);
        // 2 phi lies between 0 and pi.
        let phi = 0.5 * (0.5 * PI - cot.atan());
        (1.0 / (c.sqrt() * phi.cos()), 1.0 / (c.sqrt() * phi.sin()))
    }

    /// (V5): two vortices and their images.
    fn pair(&self, p: [f64; 3], time_s: f64) -> [f64; 3] {
        let (half, z) = self.path_m(time_s);
        let (gamma, core) = (
            self.or("circulation_m2_s", 500.0),
            self.or("core_radius_m", 2.35),
        );
        let middle = self.or("lateral_position_m", 400.0);
        let mut out = [0.0, self.or("cross_wind_m_s", 0.0), 0.0];
        for (y0, z0, sign) in [
            (middle - half, z, -1.0),
            (middle + half, z, 1.0),
            (middle - half, -z, 1.0),
            (middle + half, -z, -1.0),
        ] {
            let (dy, dz) = (p[1] - y0, p[2] - z0);
            let r2 = dy * dy + dz * dz;
            if r2 > 0.0 {
                let strength = sign * circulation_m2_s(&self.s("profile"), gamma, core, r2.sqrt())
                    / (2.0 * PI * r2);
                out[1] -= strength * dz;
                out[2] += strength * dy;
            }
        }
        out
    }
}

/// Velocity of the air of a scene at a point, `time_s` after the scan began: all its winds added.
pub(crate) fn velocity_m_s(s: &Scene, p: [f64; 3], time_s: f64) -> [f64; 3] {
    let mut out = match s.path() {
        Some(path) => path.velocity_m_s(p, time_s),
        None => Wind(&|key| s.get(&format!("flow.{key}"))).at(p, time_s),
    };
    for added in added_flows(s) {
        let more = Wind(&|key| added.get(key).cloned()).at(p, time_s);
        (0..3).for_each(|i| out[i] += more[i]);
    }
    out
}

fn added_flows(s: &Scene) -> Vec<Value> {
    let added = s.get("added_flows");
    added
        .and_then(|v| v.as_array().cloned())
        .unwrap_or_default()
}

/// The uniform and the mean winds that are added to a pair, at a height, m/s.
pub(crate) fn mean_wind_m_s(s: &Scene, z_m: f64) -> [f64; 3] {
    let mut out = [0.0; 3];
    for added in added_flows(s) {
        let more = Wind(&|key| added.get(key).cloned()).at([0.0, 0.0, z_m], 0.0);
        (0..3).for_each(|i| out[i] += more[i]);
    }
    out
}

/// How old the flow is when the scan begins, s (V8).
pub(crate) fn start_s(s: &Scene) -> f64 {
    match s.s("flow.kind") == "vortex_pair"
        && s.s("flow.motion") != "frozen"
        && s.f("flow.circulation_m2_s") > 0.0
    {
        true => {
            s.f("flow.age_tau") * s.f("flow.spacing_m").powi(2) * 2.0 * PI
                / s.f("flow.circulation_m2_s")
        }
        false => 0.0,
    }
}

/// Radial velocity along a line of a plain RHI at a range (M3), m/s; NaN below the ground.
pub(crate) struct Line {
    range_m: Vec<f64>,
    v_m_s: Vec<f64>,
}

impl Line {
    /// The line, known every `step_m` from `from_m` to `to_m`.
    pub(crate) fn new(
        s: &Scene,
        elevation_rad: f64,
        time_s: f64,
        from_m: f64,
        to_m: f64,
        step_m: f64,
    ) -> Self {
        let count = ((to_m - from_m) / step_m).ceil() as usize + 1;
        let range_m: Vec<f64> = (0..count).map(|i| from_m + i as f64 * step_m).collect();
        let v_m_s = range_m
            .iter()
            .map(|&r| radial_m_s(s, elevation_rad, time_s, r))
            .collect();
        Self { range_m, v_m_s }
    }

    /// Mean velocity with a weight of range.
    fn mean(&self, weight: impl Fn(f64) -> f64) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (&r, &v) in self.range_m.iter().zip(&self.v_m_s) {
            sum += weight(r) * v;
            total += weight(r);
        }
        sum / total
    }

    /// Largest absolute velocity of the line, m/s.
    pub(crate) fn largest_m_s(&self) -> f64 {
        self.v_m_s.iter().fold(0.0, |a, v| a.max(v.abs()))
    }
}

/// (M3), m/s.
pub(crate) fn radial_m_s(s: &Scene, elevation_rad: f64, time_s: f64, range_m: f64) -> f64 {
    let (sin, cos) = elevation_rad.sin_cos();
    let p = [
        0.0,
        s.f("scan.lidar.y_m") + range_m * cos,
        s.f("scan.lidar_height_m") + range_m * sin,
    ];
    let u = velocity_m_s(s, p, time_s);
    u[1] * cos + u[2] * sin
}

/// Exact and weighted velocities of a few lines of a map.
pub(crate) fn hold(ledger: &mut Ledger, bench: &Bench, s: &Scene, scan: &Scan, map: &Csv) {
    if let Some(eddies) = Eddies::of(s) {
        return eddies::hold_map(ledger, bench, s, scan, map, &eddies);
    }
    let Some(pulse) = Pulse::gaussian(s) else {
        return;
    };
    let (exact, of_pulse, of_gate) = (
        map.f("v_exact_m_s"),
        map.f("v_pulse_m_s"),
        map.f("v_gate_m_s"),
    );
    let h2 = super::power::window_powers(s);
    let reach_m = 4.5 * pulse.scale_m();
    let gates = scan.gate_m.len();
    let step_m = (pulse.scale_m() / 40.0).min(0.12);
    for line in [0, scan.elevation_rad.len() / 2] {
        let (e, time_s) = (scan.elevation_rad[line], line_time_s(s, line));
        let (first_m, last_m) = (
            scan.sample_m[0] - reach_m,
            scan.sample_m[scan.sample_m.len() - 1] + reach_m,
        );
        let air = Line::new(s, e, time_s, first_m, last_m, step_m);
        let fast = air.largest_m_s().max(1e-3);
        // Both sides integrate the path of a transported pair.
        let path_m_s = if s.path().is_some() {
            OF_PATH * fast
        } else {
            0.0
        };
        for gate in (0..gates).step_by(1 + gates / 5) {
            let (row, r) = (line * gates + gate, scan.gate_m[gate]);
            ledger.equal(
                "map.csv: v_exact_m_s",
                exact[row],
                radial_m_s(s, e, time_s, r),
                1e-11 * fast.max(1.0) + path_m_s,
            );
            // (S11); what the sum of (S7) leaves out bears on the seventh digit.
            let weight = |rho: f64| pulse.power_over_range(r - rho);
            ledger.equal(
                "map.csv: v_pulse_m_s",
                of_pulse[row],
                air.mean(weight),
                2e-6 * fast + path_m_s,
            );
            // (S12): each sample of the window has the pulse's weight about its own range.
            let samples = &scan.sample_m[scan.gate_start[gate]..];
            let weight = |rho: f64| {
                samples
                    .iter()
                    .zip(&h2)
                    .map(|(&m, h2)| h2 * pulse.power_over_range(m - rho))
                    .sum()
            };
            ledger.equal(
                "map.csv: v_gate_m_s",
                of_gate[row],
                air.mean(weight),
                2e-6 * fast + path_m_s,
            );
        }
    }
}
