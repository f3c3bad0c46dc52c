//! Efficiency, signal-to-noise ratio, power budget and the power of the signals: (O1) to (O10), (S1) to (S10), (R1) to (R10).

use super::geometry::Scan;
use super::ledger::Ledger;
use super::numerics::{average_and_error, integral, straight};
use super::program::{Bench, Csv, at};
use super::scene::{C_M_S, E_C, H_J_S, K_J_K, Scene};
use serde_json::Value;
use std::f64::consts::{LN_2, PI};

/// A Gaussian pulse (S1).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pulse {
    pub(crate) sigma_s: f64,
}

impl Pulse {
    /// The pulse of a scene, unless it is sampled.
    pub(crate) fn gaussian(s: &Scene) -> Option<Self> {
        let duration_s = s.f("pulse.shape.duration_s");
        let sigma_s = match s.s("pulse.shape.definition").as_str() {
            "fwhm" => duration_s / (2.0 * LN_2.sqrt()),
            _ => duration_s,
        };
        (s.s("pulse.shape.kind") == "gaussian").then_some(Self { sigma_s })
    }

    /// |f(t)|^2, 1/s (S1).
    pub(crate) fn power(&self, t_s: f64) -> f64 {
        (-(t_s / self.sigma_s).powi(2)).exp() / (PI.sqrt() * self.sigma_s)
    }

    /// c sigma/2, m.
    pub(crate) fn scale_m(&self) -> f64 {
        0.5 * C_M_S * self.sigma_s
    }

    /// |f|^2 over range, 1/m: its integral is one (S11).
    pub(crate) fn power_over_range(&self, distance_m: f64) -> f64 {
        self.power(2.0 * distance_m / C_M_S) * 2.0 / C_M_S
    }

    /// Full width at half maximum of the power, s.
    pub(crate) fn fwhm_s(&self) -> f64 {
        2.0 * LN_2.sqrt() * self.sigma_s
    }

    /// Standard deviation of the power spectrum, Hz.
    pub(crate) fn spectral_deviation_hz(&self) -> f64 {
        1.0 / (2.0 * PI * 2_f64.sqrt() * self.sigma_s)
    }
}

/// h^2 of the samples of a window (page Estimation, Periodogram), the largest near 1; the tapers of a likelihood see all alike.
pub(crate) fn window_powers(s: &Scene) -> Vec<f64> {
    let n = s.n("estimator.window_samples");
    let from_middle = |i: usize| i as f64 - 0.5 * (n as f64 - 1.0);
    let h2 = |i: usize| match s.s("estimator.weighting").as_str() {
        _ if s.s("estimator.method.kind") == "likelihood" => 1.0,
        "gaussian" => (-(from_middle(i) / (0.25 * n as f64)).powi(2)).exp(),
        "hann" => (PI * from_middle(i) / n as f64).cos().powi(4),
        _ => 1.0,
    };
    (0..n).map(h2).collect()
}

/// The telescope's beam (O1).
struct Beam {
    a_m: f64,
    b_m: f64,
    s_m: f64,
    /// Wave number, 1/m.
    k: f64,
    /// 1/F, 1/m.
    curvature: f64,
}

impl Beam {
    fn new(s: &Scene) -> Self {
        let radius_m = s.f("telescope.beam_radius_m");
        let s_m = if s.s("telescope.beam_radius_definition") == "field" {
            radius_m / 2_f64.sqrt()
        } else {
            radius_m
        };
        Self {
            a_m: s.f("telescope.aperture_radius_m"),
            b_m: s.f("telescope.obscuration_radius_m"),
            s_m,
            k: 2.0 * PI / s.f("laser.wavelength_m"),
            curvature: 1.0 / s.f("telescope.focus_m"),
        }
    }

    /// Transmitted part of the power (O2).
    fn transmission(&self) -> f64 {
        (-(self.b_m / self.s_m).powi(2)).exp() - (-(self.a_m / self.s_m).powi(2)).exp()
    }

    fn area_m2(&self) -> f64 {
        PI * self.a_m.powi(2)
    }

    /// M(rho) of (O4), at a range: the lens that two discs share, less the obscuration of either.
    fn overlap(&self, rho: f64, range_m: f64) -> f64 {
        let q = self.k * rho * (1.0 / range_m - self.curvature);
        let edge = self.a_m - 0.5 * rho;
        let of_x = |x: f64| {
            let high = (self.a_m.powi(2) - (x + 0.5 * rho).powi(2)).max(0.0).sqrt();
            let low = (self.b_m.powi(2) - (x - 0.5 * rho).powi(2)).max(0.0).sqrt();
            if low >= high {
                return 0.0;
            }
            let panels = 1 + ((high - low) / self.s_m) as usize;
            let across = integral(low, high, panels, |y| (-(y / self.s_m).powi(2)).exp());
            let along = (-(x * x + 0.25 * rho * rho) / self.s_m.powi(2)).exp() * (q * x).cos();
            4.0 * along * across / (PI * self.s_m.powi(2))
        };
        // Smooth between the edges of aperture and obscuration, with square roots there, which the sine takes away.
        let ends = between(0.0, edge, &[0.5 * rho - self.b_m, 0.5 * rho + self.b_m]);
        let of_piece = |ends: &[f64]| {
            let (middle, half) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
            let panels = 2 + (q * half).abs() as usize / 3;
            integral(-0.5 * PI, 0.5 * PI, panels, |t| {
                half * t.cos() * of_x(middle + half * t.sin())
            })
        };
        ends.windows(2).map(of_piece).sum()
    }

    /// (O5), and (P3) with the structure function of independent paths.
    fn efficiency(&self, range_m: f64, structure: impl Fn(f64) -> f64) -> f64 {
        let waves = self.k * self.a_m.powi(2) * (1.0 / range_m - self.curvature).abs();
        let f = |rho: f64| rho * self.overlap(rho, range_m).powi(2) * (-structure(rho)).exp();
        let ends = between(
            0.0,
            2.0 * self.a_m,
            &[self.a_m - self.b_m, 2.0 * self.b_m, self.a_m + self.b_m],
        );
        let of_piece = |ends: &[f64]| {
            let share = 0.5 * (ends[1] - ends[0]) / self.a_m;
            integral(ends[0], ends[1], 3 + (share * waves) as usize / 4, f)
        };
        2.0 * PI * ends.windows(2).map(of_piece).sum::<f64>() / self.area_m2()
    }
}

/// The ends of an interval with the places between them, in order, each once.
fn between(low: f64, high: f64, places: &[f64]) -> Vec<f64> {
    let mut out: Vec<f64> = places
        .iter()
        .copied()
        .filter(|x| low < *x && *x < high)
        .chain([low, high])
        .collect();
    out.sort_by(f64::total_cmp);
    out.dedup();
    out
}

/// eta_s in free space (O5).
pub(crate) fn free_space_efficiency(s: &Scene, range_m: f64) -> f64 {
    Beam::new(s).efficiency(range_m, |_| 0.0)
}

/// eta_s over independent paths through even turbulence without scales (P3), of spherical waves (P4).
pub(crate) fn independent_efficiency(s: &Scene, range_m: f64) -> f64 {
    let beam = Beam::new(s);
    // Structure function of a plane wave over k^2 C_n^2 R rho^(5/3).
    const PLANE: f64 = 2.914_381;
    let of_path = PLANE * beam.k.powi(2) * spherical_cn2_m13(s, range_m);
    beam.efficiency(range_m, |rho| of_path * rho.powf(5.0 / 3.0))
}

/// Integral of C_n^2 along the line in the middle of the scan with the weight of a spherical wave, m^(1/3).
fn spherical_cn2_m13(s: &Scene, range_m: f64) -> f64 {
    let lines = Scan::new(s).elevation_rad;
    let (sin, foot_m) = (lines[lines.len() / 2].sin(), s.f("scan.lidar_height_m"));
    let key = |name: &str| format!("atmosphere.turbulence.profile.{name}");
    let (heights_m, values) = (s.list(&key("heights_m")), s.list(&key("values_m_m23")));
    let cn2 = |along_m: f64| {
        let z = foot_m + along_m * sin;
        match s.s(&key("kind")).as_str() {
            "table" => straight(&heights_m, &values, z),
            "hufnagel_valley" => {
                let wind = (s.f(&key("high_wind_m_s")) / 27.0).powi(2);
                0.00594 * wind * (1e-5 * z).powi(10) * (-z / 1000.0).exp()
                    + 2.7e-16 * (-z / 1500.0).exp()
                    + s.f(&key("ground_cn2_m_m23")) * (-z / 100.0).exp()
            }
            _ => s.f("atmosphere.turbulence.cn2_m_m23"),
        }
    };
    let kinks: Vec<f64> = heights_m.iter().map(|z| (z - foot_m) / sin).collect();
    let weighted = |x: f64| cn2(x) * (1.0 - x / range_m).powf(5.0 / 3.0);
    let ends = between(0.0, range_m, &kinks);
    ends.windows(2)
        .map(|ends| integral(ends[0], ends[1], 60, weighted))
        .sum()
}

/// Backscatter at a height, 1/(m sr), of an aerosol that is stated by its kind.
fn aerosol_per_m_sr(s: &Scene, height_m: f64) -> f64 {
    let f = |key: &str| s.f(&format!("atmosphere.aerosol.{key}"));
    if s.s("atmosphere.aerosol.kind") == "visibility" {
        let km = 1e-3 * f("visibility_m");
        let q = match km {
            _ if km > 50.0 => 1.6,
            _ if km > 6.0 => 1.3,
            _ => 0.16 * km + 0.34,
        };
        let of_wavelength = (s.f("laser.wavelength_m") / 0.55e-6).powf(-q);
        return 3.912 / km * of_wavelength / 1000.0 / f("lidar_ratio_sr");
    }
    let step = 0.5 * (1.0 + ((height_m - f("top_m")) / f("step_m")).tanh());
    let below = f("ground_backscatter_per_m_sr") * (-height_m / f("scale_height_m")).exp();
    let above_m = (height_m - f("top_m")).max(0.0);
    let above = f("above_backscatter_per_m_sr") * (-above_m / 2000.0).exp();
    (1.0 - step) * below + step * above
}

/// K^2 beta at a range of the line in the middle of the scan: backscatter, and extinction out and back.
fn air(s: &Scene, range_m: f64) -> (f64, f64) {
    if s.has("atmosphere.aerosol") {
        let lines = Scan::new(s).elevation_rad;
        let sin = lines[lines.len() / 2].sin();
        let beta = |r: f64| aerosol_per_m_sr(s, s.f("scan.lidar_height_m") + r * sin);
        let panels = 2 + (range_m / 20.0) as usize;
        let depth = s.f("atmosphere.aerosol.lidar_ratio_sr") * integral(0.0, range_m, panels, beta);
        return (beta(range_m), (-2.0 * depth).exp());
    }
    if !s.has("atmosphere.profile") {
        let (beta, alpha) = (
            s.f("atmosphere.backscatter_per_m_sr"),
            s.f("atmosphere.extinction_per_m"),
        );
        return (beta, (-2.0 * alpha * range_m).exp());
    }
    let list = |key: &str| s.list(&format!("atmosphere.profile.{key}"));
    let (r, beta, alpha) = (
        list("range_m"),
        list("backscatter_per_m_sr"),
        list("extinction_per_m"),
    );
    // Straight lines: the trapezoids between the knots are exact.
    let mut knots: Vec<f64> = [0.0]
        .into_iter()
        .chain(r.iter().copied().filter(|&x| x < range_m))
        .collect();
    knots.push(range_m);
    let depth: f64 = knots
        .windows(2)
        .map(|k| 0.5 * (k[1] - k[0]) * (straight(&r, &alpha, k[0]) + straight(&r, &alpha, k[1])))
        .sum();
    (straight(&r, &beta, range_m), (-2.0 * depth).exp())
}

/// What the receiver takes from the shot-noise limit, as power ratios (R1) to (R6); all at most 1.
pub(crate) struct Receiver {
    saturation: f64,
    amplifier: f64,
    dark: f64,
    intensity: f64,
    poles: f64,
    converter: f64,
    /// Noise in the band, A^2 (S10), with all of these but the converter.
    pub(crate) noise_a2: f64,
}

impl Receiver {
    pub(crate) fn new(s: &Scene) -> Self {
        let f = |key: &str| s.f(&format!("detector.{key}"));
        let (nu, lo_w) = (C_M_S / s.f("laser.wavelength_m"), f("local_oscillator_w"));
        let responsivity = f("quantum_efficiency") * E_C / (H_J_S * nu);
        let saturated = 1.0 + lo_w / f("front_end.saturation_w");
        let shot = 2.0 * E_C * responsivity * lo_w / saturated;
        let amplifier = f("front_end.amplifier_noise_a_rthz").powi(2)
            + 4.0 * K_J_K * f("front_end.load_temperature_k") / f("front_end.load_ohm");
        let dark = 2.0 * E_C * f("front_end.dark_current_a");
        let relative =
            10_f64.powf(0.1 * (f("front_end.intensity_noise_db_hz") - f("front_end.rejection_db")));
        let intensity = (responsivity * lo_w).powi(2) * saturated.powi(-4) * relative;
        let poles = f("front_end.poles");
        // Butterworth.
        let g = 1.0
            / (1.0
                + (f("intermediate_frequency_hz") / f("front_end.half_power_hz"))
                    .powf(2.0 * poles));
        let sum = shot + amplifier + dark + intensity;
        let filtered = g * (shot + dark + intensity) + amplifier;
        let converter = match s.s("detector.digitiser.kind").as_str() {
            "quantised" => {
                let (bits, k) = (
                    s.f("detector.digitiser.bits"),
                    s.f("detector.digitiser.full_scale_over_noise"),
                );
                k * k / (3.0 * 4_f64.powf(bits)) * 2.0 * f("bandwidth_hz") / f("sampling_hz")
            }
            _ => 0.0,
        };
        Self {
            saturation: saturated.powi(-3),
            amplifier: shot / (shot + amplifier),
            dark: (shot + amplifier) / (shot + amplifier + dark),
            intensity: (shot + amplifier + dark) / sum,
            poles: g * sum / filtered,
            converter: 1.0 / (1.0 + converter),
            noise_a2: filtered * f("bandwidth_hz"),
        }
    }

    pub(crate) fn gain(&self) -> f64 {
        self.saturation * self.amplifier * self.dark * self.intensity * self.poles * self.converter
    }
}

/// Losses of the telescope besides efficiency.
fn losses(s: &Scene) -> f64 {
    10_f64.powf(-0.1 * s.f("telescope.optics_loss_db"))
}

/// Photons that a detector counts of a whole pulse, over the bandwidth, s.
fn photons(s: &Scene) -> f64 {
    let h = if s.s("detector.snr.reference") == "chapter" {
        H_J_S / (2.0 * PI)
    } else {
        H_J_S
    };
    let nu = C_M_S / s.f("laser.wavelength_m");
    s.f("detector.quantum_efficiency") * s.f("pulse.energy_j")
        / (h * nu * s.f("detector.bandwidth_hz"))
}

/// Signal-to-noise ratio of the reflex (R7) over |f(t)|^2, s.
fn reflex_s(s: &Scene) -> f64 {
    photons(s) * 10_f64.powf(0.1 * s.f("telescope.reflection_db")) * Receiver::new(s).gain()
}

/// (O10) with the receiver's noises, given the efficiency.
pub(crate) fn snr(s: &Scene, range_m: f64, efficiency: f64) -> f64 {
    if s.s("detector.snr.reference") == "fixed" {
        return 10_f64.powf(0.1 * s.f("detector.snr.snr_db"));
    }
    if range_m < s.f("telescope.blind_range_m") {
        return 0.0;
    }
    let (beta, k2) = air(s, range_m);
    let beam = Beam::new(s);
    photons(s) * 0.5 * C_M_S * k2 * beta * beam.area_m2() / range_m.powi(2)
        * efficiency
        * losses(s)
        * Receiver::new(s).gain()
}

/// (O10) in free space, dB; missing where nothing returns.
pub(crate) fn free_space_snr_db(s: &Scene, range_m: f64) -> f64 {
    let efficiency = if s.s("detector.snr.reference") == "fixed" {
        1.0
    } else {
        free_space_efficiency(s, range_m)
    };
    let ratio = snr(s, range_m, efficiency);
    if ratio > 0.0 { db(ratio) } else { f64::NAN }
}

/// Ratios of the air in free space, and of what samples see of it through the pulse (O9), by layers.
pub(crate) struct Ratios {
    pulse: Pulse,
    range_m: Vec<f64>,
    snr: Vec<f64>,
}

impl Ratios {
    pub(crate) fn new(s: &Scene, pulse: Pulse, scan: &Scan, step_m: f64) -> Self {
        let reach_m = 4.5 * pulse.scale_m();
        let (near_m, far_m) = (
            (scan.sample_m[0] - reach_m).max(30.0),
            scan.sample_m[scan.sample_m.len() - 1] + reach_m,
        );
        let count = 4 + ((far_m - near_m) / step_m) as usize;
        let range_m: Vec<f64> = (0..count)
            .map(|i| near_m + (far_m - near_m) * i as f64 / (count - 1) as f64)
            .collect();
        // Away from a focus and behind a whole aperture the efficiency over the square of the range is smooth; near the lidar, where next
        // to nothing of the pulse is, its quadrature is long. What the air returns may have kinks anywhere.
        let is_focused = (0.5 * near_m..2.0 * far_m).contains(&s.f("telescope.focus_m"));
        let is_obscured = s.f("telescope.obscuration_radius_m") > 0.0;
        let is_dense = |r: f64| (is_focused || is_obscured) && r > 0.7 * scan.sample_m[0];
        let last = range_m.len() - 1;
        let known = range_m
            .iter()
            .enumerate()
            .filter(|&(i, &r)| is_dense(r) || i % 8 == 0 || i == last);
        let known_m: Vec<f64> = known.map(|(_, &r)| r).collect();
        let is_fixed = s.s("detector.snr.reference") == "fixed";
        let smooth = |&r: &f64| {
            if is_fixed {
                1.0
            } else {
                free_space_efficiency(s, r) / r.powi(2)
            }
        };
        let known: Vec<f64> = known_m.iter().map(smooth).collect();
        let snr = range_m
            .iter()
            .map(|&r| snr(s, r, straight(&known_m, &known, r) * r.powi(2)))
            .collect();
        Self {
            pulse,
            range_m,
            snr,
        }
    }

    /// Mean ratio of a sample that sees a range: a sum over layers, so that records of them have a covariance.
    pub(crate) fn seen(&self, r: f64) -> f64 {
        let of_layers = self.range_m.iter().zip(&self.snr);
        let sum: f64 = of_layers
            .map(|(&x, snr)| snr * self.pulse.power_over_range(r - x))
            .sum();
        sum * (self.range_m[1] - self.range_m[0])
    }

    /// Mean ratio of the window of a gate: of its samples, with h^2.
    pub(crate) fn of_window(&self, s: &Scene, scan: &Scan, gate: usize) -> f64 {
        let h2 = window_powers(s);
        let samples = scan.sample_m[scan.gate_start[gate]..].iter().zip(&h2);
        samples.map(|(&m, h2)| h2 * self.seen(m)).sum::<f64>() / h2.iter().sum::<f64>()
    }
}

pub(crate) fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// Relative error that the own quadrature may have: with an obscuration its panels end at kinks.
fn quadrature_error(s: &Scene) -> f64 {
    if s.f("telescope.obscuration_radius_m") > 0.0 {
        3e-4
    } else {
        2e-6
    }
}

/// profile.csv in free space, at a few of its ranges.
pub(crate) fn hold_profile(ledger: &mut Ledger, s: &Scene, profile: &Csv) {
    let ranges = profile.f("range_m");
    let (first, last) = (
        s.f("outputs.profile_range_min_m"),
        s.f("outputs.profile_range_max_m"),
    );
    let points = s.n("outputs.profile_points");
    ledger.equal("profile.csv: rows", ranges.len() as f64, points as f64, 0.0);
    let (efficiency, snr_db) = (profile.f("efficiency"), profile.f("snr_db"));
    let deviation = profile.f("efficiency_standard_deviation");
    let standard_error = profile.f("efficiency_standard_error");
    for i in (0..points).step_by(1 + points / 5) {
        let r = first + (last - first) * i as f64 / (points - 1) as f64;
        ledger.equal("profile.csv: range_m", ranges[i], r, 1e-9 * r);
        let right = free_space_efficiency(s, r);
        // In a null of the efficiency by the quadrature of its parts, which cancel there.
        let error = quadrature_error(s) * (1.0 + 1e-5 / right);
        ledger.equal(
            "profile.csv: efficiency",
            efficiency[i],
            right,
            error * right,
        );
        ledger.equal(
            "profile.csv: snr_db",
            snr_db[i],
            free_space_snr_db(s, r),
            5.0 * error,
        );
        ledger.equal(
            "profile.csv: efficiency_standard_deviation, of theory",
            deviation[i],
            0.0,
            0.0,
        );
        ledger.equal(
            "profile.csv: efficiency_standard_error, of theory",
            standard_error[i],
            0.0,
            0.0,
        );
    }
}

/// Every row of a budget in free space, and its limits.
pub(crate) fn hold_budget(ledger: &mut Ledger, s: &Scene, json: &Value) {
    let ranges: Vec<f64> = json["range_m"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect();
    let receiver = Receiver::new(s);
    let beam = Beam::new(s);
    let nu = C_M_S / s.f("laser.wavelength_m");
    let is_fixed = s.s("detector.snr.reference") == "fixed";
    for row in json["rows"].as_array().into_iter().flatten() {
        let name = row["row"].as_str().unwrap_or_default().to_owned();
        ledger.saw("budget", &name);
        for (i, &r) in ranges.iter().enumerate() {
            let found = row["db"][i].as_f64().unwrap_or(f64::NAN);
            let efficiency = || free_space_efficiency(s, r);
            let fixed_db = s.f("detector.snr.snr_db");
            let right = match name.as_str() {
                "stated by the scene" => fixed_db,
                "photons sent" => db(s.f("pulse.energy_j") / (H_J_S * nu)),
                "per bandwidth" => -db(s.f("detector.bandwidth_hz")),
                "range per time" => db(0.5 * C_M_S),
                "backscatter" => db(air(s, r).0),
                "solid angle" => db(beam.area_m2() / r.powi(2)),
                "air, out and back" => db(air(s, r).1),
                "truncation, two beams" => 2.0 * db(beam.transmission()),
                "antenna efficiency" => db(efficiency() / beam.transmission().powi(2)),
                "optics" => -s.f("telescope.optics_loss_db"),
                "quantum efficiency" => db(s.f("detector.quantum_efficiency")),
                "hbar for h" => db(2.0 * PI),
                "= shot-noise limit" => db(snr(s, r, efficiency()) / receiver.gain()),
                "saturation" => db(receiver.saturation),
                "amplifier noise" => db(receiver.amplifier),
                "dark current" => db(receiver.dark),
                "intensity noise of the LO" => db(receiver.intensity),
                "response of the detector" => db(receiver.poles),
                "converter" => db(receiver.converter),
                "= SNR in the band" if is_fixed => fixed_db,
                "= SNR in the band" => db(snr(s, r, efficiency())),
                "= in the width of the pulse" => match spectral_fwhm_hz(s) {
                    Some(width_hz) => {
                        free_space_snr_db(s, r) + db(s.f("detector.bandwidth_hz") / width_hz)
                    }
                    None => continue,
                },
                _ => continue,
            };
            // The width of a sampled pulse is read off a transform of either side.
            let is_read =
                name.starts_with("= in the width") && s.s("pulse.shape.kind") == "sampled";
            // Layers of aerosol are tables over height, whose lines are within 3e-6 of the formula.
            let is_layer = s.has("atmosphere.aerosol") && s.s("atmosphere.aerosol.kind") == "layer";
            let tolerance = if is_read {
                0.01
            } else if is_layer {
                db(1.0 + 3e-6) + 5.0 * quadrature_error(s)
            } else {
                5.0 * quadrature_error(s)
            };
            ledger.equal(&format!("budget: {name}"), found, right, tolerance);
        }
    }
    hold_limits(ledger, s, &json["limits"]);
}

/// Full width at half maximum of the spectrum of the pulse, Hz.
pub(crate) fn spectral_fwhm_hz(s: &Scene) -> Option<f64> {
    if let Some(pulse) = Pulse::gaussian(s) {
        return Some(2.0 * (2.0 * LN_2).sqrt() * pulse.spectral_deviation_hz());
    }
    // A sampled pulse without phase, of samples so close that straight lines join its amplitudes: |F|^2 by quadrature, the first
    // frequency where it is a half.
    if s.has("pulse.shape.phase_rad") {
        return None;
    }
    let (t, power) = (s.list("pulse.shape.time_s"), s.list("pulse.shape.power"));
    let p: Vec<f64> = power.iter().map(|p| p.sqrt()).collect();
    let middle = 0.5 * (t[0] + t[t.len() - 1]);
    let part = |f: f64, phase: f64| {
        let of = |x: f64| straight(&t, &p, x) * (2.0 * PI * f * (x - middle) + phase).cos();
        integral(t[0], t[t.len() - 1], 24 * t.len(), of)
    };
    let power = |f: f64| part(f, 0.0).powi(2) + part(f, 0.5 * PI).powi(2);
    // The largest is not at zero where the phase turns; here it is.
    let (half, step) = (0.5 * power(0.0), 1e-2 / (t[t.len() - 1] - t[0]));
    let beyond = (1..10_000)
        .map(|i| i as f64 * step)
        .find(|&f| power(f) < half)?;
    let (mut low, mut high) = (beyond - step, beyond);
    for _ in 0..40 {
        let mid = 0.5 * (low + high);
        if power(mid) < half {
            high = mid
        } else {
            low = mid
        }
    }
    Some(low + high)
}

fn hold_limits(ledger: &mut Ledger, s: &Scene, limits: &Value) {
    super::program::see(ledger, "budget limits", limits);
    let (lambda, prf) = (s.f("laser.wavelength_m"), s.f("laser.pulse_repetition_hz"));
    let (fc, fs) = (
        s.f("detector.intermediate_frequency_hz"),
        s.f("detector.sampling_hz"),
    );
    let is_baseband = s.s("detector.signal") == "baseband";
    let mut hold = |key: &str, right: f64, tolerance: f64| {
        ledger.equal(
            &format!("budget limits: {key}"),
            at(limits, key),
            right,
            tolerance * right.abs(),
        );
    };
    hold("ambiguous_range_m", C_M_S / (2.0 * prf), 1e-9);
    hold(
        "band_m_s",
        0.25 * lambda * s.f("detector.bandwidth_hz"),
        1e-9,
    );
    hold("mean_power_w", s.f("pulse.energy_j") * prf, 1e-9);
    // (E2) at the ends of the unambiguous interval: 0 and half the sampling frequency, or half of it to each side.
    let (from, to) = if is_baseband {
        (-0.25 * lambda * fs, 0.25 * lambda * fs)
    } else {
        (0.5 * lambda * (fc - 0.5 * fs), 0.5 * lambda * fc)
    };
    hold("sampled_from_m_s", from, 1e-9);
    hold("sampled_to_m_s", to, 1e-9);
    if let Some(pulse) = Pulse::gaussian(s) {
        hold(
            "peak_power_w",
            s.f("pulse.energy_j") * pulse.power(0.0),
            1e-9,
        );
        hold("pulse_resolution_m", 0.5 * C_M_S * pulse.fwhm_s(), 1e-6);
        hold("gate_resolution_m", gate_fwhm_m(s, &pulse), 1e-5);
        // Where (R7) falls to -20 dB.
        let above = (reflex_s(s) * pulse.power(0.0) / 0.01).ln().max(0.0);
        hold("reflex_range_m", pulse.scale_m() * above.sqrt(), 1e-9);
    }
}

/// Full width at half maximum of |f|^2 summed over the samples of a window with h^2, m.
pub(crate) fn gate_fwhm_m(s: &Scene, pulse: &Pulse) -> f64 {
    let (h2, step_m) = (window_powers(s), 0.5 * C_M_S / s.f("detector.sampling_hz"));
    let middle = 0.5 * (h2.len() as f64 - 1.0);
    let weight = |r: f64| -> f64 {
        h2.iter()
            .enumerate()
            .map(|(n, h2)| h2 * pulse.power_over_range(r - (n as f64 - middle) * step_m))
            .sum()
    };
    let (mut low, mut high) = (0.0, 10.0 * pulse.scale_m() + step_m * h2.len() as f64);
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if weight(mid) > 0.5 * weight(0.0) {
            low = mid
        } else {
            high = mid
        }
    }
    low + high
}

/// Standard deviation of the same weight, m.
pub(crate) fn gate_deviation_m(s: &Scene, pulse: &Pulse) -> f64 {
    let (h2, step_m) = (window_powers(s), 0.5 * C_M_S / s.f("detector.sampling_hz"));
    let middle = 0.5 * (h2.len() as f64 - 1.0);
    let total: f64 = h2.iter().sum();
    let square: f64 = h2
        .iter()
        .enumerate()
        .map(|(n, h2)| h2 * ((n as f64 - middle) * step_m).powi(2))
        .sum();
    (square / total + 0.5 * pulse.scale_m().powi(2)).sqrt()
}

/// The mean power of the signals of `signals.nc` over range, against (O9) and (S10).
pub(crate) fn hold_signals(ledger: &mut Ledger, bench: &Bench, s: &Scene, scan: &Scan, file: &str) {
    let Some(pulse) = Pulse::gaussian(s) else {
        return;
    };
    let mut nc = bench.netcdf(ledger, file);
    let (current, quadrature) = (nc.f("current_a"), nc.f("quadrature_a"));
    let is_baseband = s.s("detector.signal") == "baseband";
    let receiver = Receiver::new(s);
    // (S10) to half the sampling frequency, or to both sides of zero.
    let (fs, b) = (s.f("detector.sampling_hz"), s.f("detector.bandwidth_hz"));
    let wider = match (s.s("detector.noise").as_str(), is_baseband) {
        ("none", _) => 0.0,
        ("band", _) => 1.0,
        (_, true) => fs / b,
        _ => 0.5 * fs / b,
    };
    let noise_a2 = receiver.noise_a2 * wider;
    ledger.equal(
        "signals.nc: noise_power",
        nc.f("noise_power")[0],
        noise_a2,
        1e-6 * noise_a2.max(1e-40),
    );
    let samples = scan.sample_m.len();
    let pulses = current.len() / samples;
    let power = |p: usize, k: usize| {
        let at = p * samples + k;
        current[at].powi(2) + quadrature.get(at).map_or(0.0, |q| q * q)
    };
    let (ratios, reflex) = (Ratios::new(s, pulse, scan, 6.0), reflex_s(s));
    const BINS: usize = 6;
    for bin in 0..BINS {
        let ks: Vec<usize> = (bin * samples / BINS..(bin + 1) * samples / BINS).collect();
        let of_pulse: Vec<f64> = (0..pulses)
            .map(|p| ks.iter().map(|&k| power(p, k)).sum::<f64>() / ks.len() as f64)
            .collect();
        let (mean, error) = average_and_error(&of_pulse);
        let expected = ks
            .iter()
            .step_by(4)
            .map(|&k| ratios.seen(scan.sample_m[k]))
            .sum::<f64>()
            / ks.iter().step_by(4).count() as f64;
        let of_reflex = |&k: &usize| reflex * pulse.power(2.0 * scan.sample_m[k] / C_M_S);
        let expected = expected + ks.iter().map(of_reflex).sum::<f64>() / ks.len() as f64;
        let right = receiver.noise_a2 * expected + noise_a2;
        // A converter clips what is as strong as its full scale.
        let full_scale = if s.s("detector.digitiser.kind") == "quantised" {
            s.f("detector.digitiser.full_scale_over_noise")
        } else {
            f64::INFINITY
        };
        if full_scale.powi(2) * receiver.noise_a2 < 16.0 * right {
            continue;
        }
        ledger.mean(
            "signals.nc: current_a, mean power (O9)",
            mean / receiver.noise_a2,
            right / receiver.noise_a2,
            error / receiver.noise_a2,
        );
    }
}
