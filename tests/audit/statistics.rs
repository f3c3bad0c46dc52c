//! Errors of estimates and what is stated of them: (E11), means over maps, and standard errors held over many seeds.

use super::air::Line;
use super::bound::independent;
use super::eddies::Eddies;
use super::geometry::{Scan, line_time_s, radius_m};
use super::ledger::Ledger;
use super::numerics::{average, average_and_error};
use super::power::{
    Pulse, Ratios, db, free_space_efficiency, free_space_snr_db, gate_deviation_m, gate_fwhm_m,
};
use super::program::{Bench, Csv, at, see};
use super::scene::{C_M_S, Scene};
use serde_json::Value;
use std::f64::consts::PI;

fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|v| v.is_finite()).collect()
}

/// Root of the mean of the squares of what is there.
fn quadratic(values: &[f64]) -> f64 {
    average(&finite(values).iter().map(|v| v * v).collect::<Vec<_>>()).sqrt()
}

/// The moments of a map among each other (E11), and what a level is worth.
pub(crate) fn hold_map(ledger: &mut Ledger, s: &Scene, scan: &Scan, map: &Csv) {
    let f = |name: &str| map.f(name);
    let (mean, bias, std, rms) = (f("v_mean_m_s"), f("bias_m_s"), f("std_m_s"), f("rms_m_s"));
    let (truth, count, flagged, first) =
        (f("v_pulse_m_s"), f("count"), f("flagged"), f("v_scan_m_s"));
    let (n_eff, tau, quality) = (f("n_eff"), f("tau"), f("quality"));
    let (realisations, gates) = (s.n("scan.realisations"), scan.gate_m.len());
    let n = realisations as f64;
    let age = if s.s("flow.kind") == "vortex_pair" {
        s.f("flow.age_tau")
    } else {
        0.0
    };
    // Realisations with turbulence of their own have truths of their own.
    let own = Eddies::of(s).filter(|eddies| eddies.is_each && realisations > 1);
    for row in 0..map.len() {
        ledger.equal("map.csv: tau", tau[row], age, 1e-12);
        let apart = mean[row] - truth[row];
        match &own {
            None => ledger.equal("map.csv: bias_m_s", bias[row], apart, 1e-9),
            Some(eddies) => {
                let number = "map.csv: bias_m_s, of realisations with truths of their own";
                let turbulent_m_s = 8.0 * eddies.deviation_m_s();
                ledger.equal(number, bias[row], apart, turbulent_m_s);
            }
        }
        // Of each realisation, one velocity.
        ledger.holds(
            "map.csv: count",
            count[row] <= n && count[row].fract() == 0.0,
            "not a number of realisations",
        );
        ledger.equal(
            "map.csv: flagged",
            (flagged[row] * n).round() / n,
            flagged[row],
            1e-9,
        );
        ledger.holds(
            "map.csv: quality",
            quality[row].is_nan() || quality[row] >= 1.0 - 1e-9,
            "a peak below the mean density",
        );
        if count[row] >= 2.0 {
            // std is that of one estimate, unbiased; rms is the root of a mean.
            let share = (count[row] - 1.0) / count[row];
            let right = (bias[row].powi(2) + share * std[row].powi(2)).sqrt();
            ledger.equal("map.csv: rms_m_s", rms[row], right, 1e-9);
            ledger.holds(
                "map.csv: std_m_s",
                std[row] >= 0.0,
                "no deviation of several estimates",
            );
        } else if count[row] == 1.0 {
            ledger.equal("map.csv: rms_m_s", rms[row], bias[row].abs(), 1e-9);
            ledger.equal("map.csv: std_m_s", std[row], f64::NAN, 0.0);
            if realisations == 1 {
                ledger.equal("map.csv: v_scan_m_s", first[row], mean[row], 1e-12);
            }
        }
    }
    let Some(pulse) = Pulse::gaussian(s) else {
        return;
    };
    let ratios = Ratios::new(s, pulse, scan, 3.0);
    for row in (0..map.len()).step_by(1 + map.len() / 8) {
        let (line, gate) = (row / gates, row % gates);
        let Some(radius) = radius_m(s, scan.gate_m[gate]) else {
            return;
        };
        let windows = match s.s("estimator.method.kind") == "periodogram" {
            true => vec![scan.own_window(gate)],
            false => scan.region(line, gate, radius, s.n("estimator.window_samples")),
        };
        if windows.iter().all(Vec::is_empty) {
            ledger.equal("map.csv: n_eff", n_eff[row], 0.0, 0.0);
            continue;
        }
        let right = independent(
            s,
            &pulse,
            &windows,
            scan.pulses,
            ratios.of_window(s, scan, gate),
        );
        ledger.equal("map.csv: n_eff", n_eff[row], right, 2e-3 * right);
    }
}

/// What `run` prints, of its own map and profile.
pub(crate) fn hold_summary(ledger: &mut Ledger, s: &Scene, scan: &Scan, map: &Csv, json: &Value) {
    let results = &json["results"];
    see(ledger, "run results", results);
    let f = |name: &str| finite(&map.f(name));
    let mut hold = |key: &str, right: f64, tolerance: f64| {
        ledger.equal(
            &format!("run results: {key}"),
            at(results, key),
            right,
            tolerance * right.abs().max(1e-3),
        );
    };
    let largest =
        |values: Vec<f64>, sign: f64| sign * values.iter().fold(f64::MIN, |a, v| a.max(sign * v));
    hold("v_max_m_s", largest(f("v_mean_m_s"), 1.0), 1e-9);
    hold("v_min_m_s", largest(f("v_mean_m_s"), -1.0), 1e-9);
    hold("bias_mean_m_s", average(&f("bias_m_s")), 1e-9);
    hold("rms_mean_m_s", quadratic(&map.f("rms_m_s")), 1e-9);
    // A mean of deviations would be too small wherever they differ, by chance too.
    hold("std_mean_m_s", quadratic(&map.f("std_m_s")), 1e-9);
    hold("flagged_fraction", average(&f("flagged")), 1e-9);
    hold("level_mean", average(&f("level")), 1e-9);
    let middle_m = 0.5 * (s.f("scan.range_min_m") + s.f("scan.range_max_m"));
    hold("scan_range_m", middle_m, 1e-12);
    if s.s("atmosphere.turbulence.kind") == "none" {
        let (first, last) = (
            s.f("outputs.profile_range_min_m"),
            s.f("outputs.profile_range_max_m"),
        );
        if (first..=last).contains(&middle_m) {
            hold("scan_efficiency", free_space_efficiency(s, middle_m), 1e-2);
        }
        let (found_db, right_db) = (at(results, "scan_snr_db"), free_space_snr_db(s, middle_m));
        // Of decibels, which pass through 0.
        ledger.equal("run results: scan_snr_db", found_db, right_db, 1e-2);
    }
    hold_schedule(ledger, s, scan, &json["scan"]);
}

/// The schedule that `check` and `run` print.
fn hold_schedule(ledger: &mut Ledger, s: &Scene, scan: &Scan, json: &Value) {
    see(ledger, "scan", json);
    let lines = scan.elevation_rad.len() as f64;
    let prf = s.f("laser.pulse_repetition_hz");
    let pulses = lines * scan.pulses as f64;
    let mut hold = |key: &str, right: f64, tolerance: f64| {
        ledger.equal(&format!("scan: {key}"), at(json, key), right, tolerance)
    };
    hold("lines", lines, 0.0);
    hold("sweeps", 1.0, 0.0);
    hold("pulses", pulses, 0.0);
    let duration_s = (pulses - 1.0) / prf;
    hold("duration_s", duration_s, 1e-9);
    hold("revisit_s", f64::NAN, 0.0);
    hold("ambiguous_range_m", C_M_S / (2.0 * prf), 1e-6);
    hold("smear_rad", 0.0, 0.0);
    hold("smear_m", 0.0, 0.0);
    if s.s("flow.kind") == "vortex_pair" && s.f("flow.circulation_m2_s") > 0.0 {
        // In free air: down with V0 (V8); superposed winds carry no pair.
        let down = s.f("flow.circulation_m2_s") / (2.0 * PI * s.f("flow.spacing_m"));
        hold("wake_moves_m", down * duration_s, 1e-6);
    }
}

/// "flow reaches": the largest radial velocity of the lines of sight, as a budget prints it.
pub(crate) fn hold_reach(ledger: &mut Ledger, s: &Scene, scan: &Scan, budget: &str) {
    let Some(word) = budget
        .split("flow reaches ")
        .nth(1)
        .and_then(|rest| rest.split_whitespace().next())
    else {
        return;
    };
    ledger.saw("budget text", "flow reaches");
    // The path of a pair that meanders depends on the waves.
    if s.is_true("flow.meander") {
        return;
    }
    let found: f64 = word.parse().unwrap_or(f64::NAN);
    let (near_m, far_m) = (scan.sample_m[0], scan.sample_m[scan.sample_m.len() - 1]);
    let of_line = |(line, &e): (usize, &f64)| {
        Line::new(s, e, line_time_s(s, line), near_m, far_m, 0.5).largest_m_s()
    };
    let largest = scan
        .elevation_rad
        .iter()
        .enumerate()
        .map(of_line)
        .fold(0.0, f64::max);
    let turbulent_m_s = Eddies::of(s).map_or(0.0, |eddies| 5.0 * eddies.deviation_m_s());
    // Two digits are printed; the program may look farther than the scan, by a pulse, and between its lines.
    ledger.equal(
        "budget text: flow reaches",
        found,
        largest,
        0.6 + 0.1 * largest + turbulent_m_s,
    );
}

/// Deviations of the values of independent maps from a truth that is a mean of them: what it takes of their scatter is given back.
fn apart(values: &[f64], truth: f64) -> Vec<f64> {
    let n = values.len() as f64;
    values
        .iter()
        .map(|v| (v - truth) * (n / (n - 1.0)).sqrt())
        .collect()
}

/// Shares of a normal law within one and two.
const NORMAL: [f64; 2] = [0.683, 0.954];
/// Of cells: with few realisations, the next may have an outlier that these have not (page Files).
const OF_CELLS: [f64; 2] = [0.6, 0.9];
/// Of averages of squares: with few flagged estimates, or few cells, those without outliers state
/// too little (page Sweeps).
const OF_SQUARES: [f64; 2] = [0.35, 0.8];
/// Of a handful of estimates, which may show none of the outliers of their corner of the map: no share is promised (page Sweeps), their mean square is.
const OF_A_HANDFUL: [f64; 2] = [0.0, 0.0];

/// The share of errors within one and two of what is stated of them, and how far the stated ones are too large or small; `alike` of them in a
/// row share what they are made of.
#[track_caller]
fn hold_stated(
    ledger: &mut Ledger,
    number: &str,
    errors: &[f64],
    stated: &[f64],
    shares: [f64; 2],
    alike: usize,
) {
    let pairs: Vec<(f64, f64)> = errors
        .iter()
        .copied()
        .zip(stated.iter().copied())
        .filter(|(e, s)| e.is_finite() && s.is_finite())
        .collect();
    let (count, n) = (pairs.len() as f64, pairs.len() as f64 / alike as f64);
    // What happened in no seed at all has a stated error, and no scatter to hold it against.
    if n < 20.0 || pairs.iter().all(|(e, _)| e.abs() < 1e-12) {
        return;
    }
    let power = |p: i32| pairs.iter().map(|(e, _)| e.powi(p)).sum::<f64>() / count;
    let scatter = power(2).sqrt();
    let told = (pairs.iter().map(|(_, s)| s * s).sum::<f64>() / count).sqrt();
    // The relative errors of a scatter and of what is stated, by fourth powers; the stated one may be 1.5 times too large, and no smaller.
    let (low, high) = (1.0 / 1.5, 1.0);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let stated_power = |p: i32| pairs.iter().map(|(_, s)| s.powi(p)).sum::<f64>() / count;
    let excess = power(4) / power(2).powi(2) + stated_power(4) / stated_power(2).powi(2) - 2.0;
    let slack = 4.0 * 0.5 * (excess / n).sqrt();
    ledger.equal(
        &format!("{number}, scatter over stated"),
        scatter / told,
        middle,
        half + slack * high,
    );
    let within = |k: f64| pairs.iter().filter(|(e, s)| e.abs() <= k * s).count() as f64 / count;
    // At least as many as the book says, less what chance takes.
    for (k, p) in [1.0, 2.0].into_iter().zip(shares) {
        let short = (p - within(k)).max(0.0);
        ledger.equal(
            &format!("{number}, share within {k}"),
            short,
            0.0,
            p - least_share(p, n),
        );
    }
}

/// The least share of `n` of which each is within with the chance `p`, but for one case in 30 000, as beyond four deviations of a normal number: the
/// binomial law has the longer tail where few are outside.
fn least_share(p: f64, n: f64) -> f64 {
    if n > 200.0 {
        return p - 4.0 * (p * (1.0 - p) / n).sqrt();
    }
    let (mut within, mut chance) = (0.0, (1.0 - p).powf(n));
    let mut sum = chance;
    while sum < 1.0 / 30_000.0 {
        chance *= (n - within) / (within + 1.0) * p / (1.0 - p);
        within += 1.0;
        sum += chance;
    }
    within / n
}

#[test]
fn the_least_share_is_where_the_binomial_law_ends() {
    // Of 40 with 0.954 each, nine or more are outside in one case of 15 000, ten in one of 99 000; four normal deviations would allow seven.
    assert!((least_share(0.954, 40.0) - 31.0 / 40.0).abs() < 1e-12);
    // Far from the ends it is the normal law's.
    let normal = 0.5 - 4.0 * (0.25_f64 / 200.0).sqrt();
    assert!((least_share(0.5, 200.0) - normal).abs() < 0.01);
}

/// Estimates, cells times realisations, below which a stated error is no more than an order of magnitude.
const LEAST_ESTIMATES: f64 = 16.0;

/// One scene with many seeds: standard errors of a sweep and of maps against the scatter of what they belong to.
pub(crate) fn hold_seeds(ledger: &mut Ledger, bench: &Bench, s: &Scene) {
    const SEEDS: usize = 40;
    // Cells are many: the maps of some seeds tell as much of them.
    const MAPS: usize = 16;
    let vary = format!("seed=lin:1:{SEEDS}:{SEEDS}");
    if bench
        .must(
            ledger,
            &[
                "sweep",
                "s.toml",
                "--vary",
                &vary,
                "--no-circulation",
                "--out",
                "w",
            ],
        )
        .is_none()
    {
        return;
    }
    let results = bench.csv(ledger, "w/results.csv");
    let mut maps = Vec::new();
    for seed in 1..=MAPS {
        let out = format!("m{seed}");
        let Some(_) = bench.must(
            ledger,
            &["map", "s.toml", "--seed", &seed.to_string(), "--out", &out],
        ) else {
            return;
        };
        maps.push(bench.csv(ledger, &format!("{out}/map.csv")));
    }
    for (value, error) in [
        ("std_m_s", "std_standard_error_m_s"),
        ("rms_m_s", "rms_standard_error_m_s"),
        ("bias_m_s", "bias_standard_error_m_s"),
        ("std_inside_m_s", "std_inside_standard_error_m_s"),
        ("rms_inside_m_s", "rms_inside_standard_error_m_s"),
        ("bias_inside_m_s", "bias_inside_standard_error_m_s"),
        ("std_outside_m_s", "std_outside_standard_error_m_s"),
        ("rms_outside_m_s", "rms_outside_standard_error_m_s"),
        ("bias_outside_m_s", "bias_outside_standard_error_m_s"),
        ("flagged_fraction", "flagged_standard_error_fraction"),
    ] {
        // Within one air the error of a bias is that of the noise; each seed has an air of its own.
        let is_one_air = Eddies::of(s).is_some_and(|eddies| !eddies.is_each);
        if is_one_air && value.starts_with("bias") {
            continue;
        }
        let (values, errors) = (results.f(value), results.f(error));
        // Of what most seeds do not show, the stated error is that of what could be, and counts of none and one do not scatter as widely.
        if value.starts_with("flagged")
            && 2 * values.iter().filter(|value| **value == 0.0).count() > values.len()
        {
            let without = errors
                .iter()
                .filter(|error| error.is_nan() || **error <= 0.0)
                .count();
            ledger.equal(
                &format!("results.csv: {error}, none told"),
                without as f64,
                0.0,
                0.0,
            );
            continue;
        }
        // Squares have means without bias; roots of them do not.
        let truth = if value.starts_with("bias") || value.starts_with("flagged") {
            average(&finite(&values))
        } else {
            quadratic(&values)
        };
        let shares = match value {
            _ if estimates_of(s, value, &maps[0]) < LEAST_ESTIMATES => OF_A_HANDFUL,
            _ if value.starts_with("std") || value.starts_with("rms") => OF_SQUARES,
            _ => NORMAL,
        };
        hold_stated(
            ledger,
            &format!("results.csv: {error}"),
            &apart(&values, truth),
            &errors,
            shares,
            1,
        );
    }
    // Of the maps of some of the same seeds each cell's rms against that of all of them.
    let of_seed = |name: &str| maps.iter().map(|map| map.f(name)).collect::<Vec<_>>();
    let (rms, error) = (of_seed("rms_m_s"), of_seed("standard_error_m_s"));
    let (mut errors, mut stated) = (Vec::new(), Vec::new());
    // All of them, since outliers are rare; neighbours are counted as one.
    for cell in 0..rms[0].len() {
        let of_cell: Vec<f64> = rms.iter().map(|map| map[cell]).collect();
        errors.extend(apart(&of_cell, quadratic(&of_cell)));
        stated.extend(error.iter().map(|map| map[cell]));
    }
    hold_stated(
        ledger,
        "map.csv: standard_error_m_s",
        &errors,
        &stated,
        OF_CELLS,
        1 + rms[0].len() / 12,
    );
    hold_parts(ledger, bench, s, &results, &maps);
    ledger.equal(
        "results.csv: snr_db",
        results.f("snr_db")[0],
        s.f("detector.snr.snr_db"),
        1e-9,
    );
}

/// Distance of each cell from the nearer centre, m.
fn distances_m(s: &Scene, map: &Csv) -> Vec<f64> {
    let (b0, middle, height) = (
        s.f("flow.spacing_m"),
        s.f("flow.lateral_position_m"),
        s.f("flow.height_m"),
    );
    let apart = |y: f64, z: f64, side: f64| (y - middle - side * 0.5 * b0).hypot(z - height);
    let places = map.f("y_m").into_iter().zip(map.f("z_m"));
    places
        .map(|(y, z)| apart(y, z, -1.0).min(apart(y, z, 1.0)))
        .collect()
}

/// Whether a cell so far from the nearer centre belongs to the part that a column is of: within 8/47 spacings, beyond 30/47, or all.
fn is_in(s: &Scene, column: &str, distance_m: f64) -> bool {
    let of_spacing = 47.0 * distance_m / s.f("flow.spacing_m");
    (!column.contains("_inside") || of_spacing < 8.0)
        && (!column.contains("_outside") || of_spacing > 30.0)
}

/// Estimates that a number of a sweep is the average of.
fn estimates_of(s: &Scene, column: &str, map: &Csv) -> f64 {
    let cells = distances_m(s, map).into_iter().zip(map.f("rms_m_s"));
    cells
        .filter(|(d, rms)| is_in(s, column, *d) && rms.is_finite())
        .count() as f64
        * s.f("scan.realisations")
}

/// Whether some but fewer than 20 estimates of a map are flagged, or a part of it has fewer than 16.
fn has_rough_errors(s: &Scene, map: &Csv) -> bool {
    let flags = map.f("flagged");
    let flagged = (flags.iter().sum::<f64>() * s.f("scan.realisations")).round();
    let has_few = |column: &&str| {
        let estimates = estimates_of(s, column, map);
        estimates > 0.0 && estimates < 16.0
    };
    (flagged > 0.0 && flagged < 20.0) || ["", "_inside", "_outside"].iter().any(has_few)
}

/// Means over parts of the map of each case.
fn hold_parts(ledger: &mut Ledger, bench: &Bench, s: &Scene, results: &Csv, maps: &[Csv]) {
    for (case, map) in maps.iter().enumerate() {
        let distances_m = distances_m(s, map);
        let part = |name: &str, column: &str| -> Vec<f64> {
            let cells = map.f(name).into_iter().zip(&distances_m);
            cells
                .filter(|(_, d)| is_in(s, column, **d))
                .map(|(value, _)| value)
                .collect()
        };
        for name in ["", "_inside", "_outside"] {
            let column = |what: &str| format!("{what}{name}_m_s");
            let bias = finite(&part("bias_m_s", name));
            if bias.is_empty() {
                continue;
            }
            let mut hold = |what: &str, right: f64| {
                ledger.equal(
                    &format!("results.csv: {}", column(what)),
                    results.f(&column(what))[case],
                    right,
                    1e-9,
                );
            };
            hold("bias", average(&bias));
            hold("std", quadratic(&part("std_m_s", name)));
            hold("rms", quadratic(&part("rms_m_s", name)));
        }
        let flagged = average(&map.f("flagged"));
        ledger.equal(
            "results.csv: flagged_fraction",
            results.f("flagged_fraction")[case],
            flagged,
            1e-9,
        );
        ledger.equal(
            "results.csv: standard_errors_rough",
            results.f("standard_errors_rough")[case],
            f64::from(u8::from(has_rough_errors(s, map))),
            0.0,
        );
        ledger.equal(
            "results.csv: case",
            results.f("case")[case],
            case as f64,
            0.0,
        );
        ledger.equal(
            "results.csv: seed",
            results.f("seed")[case],
            (case + 1) as f64,
            0.0,
        );
    }
    // The bound of `bound` in the middle of its gates.
    if let Some(bound) = bench.must(ledger, &["bound", "s.toml", "--json"]) {
        let json = bound.json();
        let points = json["by_range"].as_array().cloned().unwrap_or_default();
        let right = points
            .get(points.len() / 2)
            .map_or(f64::NAN, |p| at(p, "bound_region_m_s"));
        ledger.equal(
            "results.csv: bound_m_s",
            results.f("bound_m_s")[0],
            right,
            1e-6 * right,
        );
    }
    if let Some(pulse) = Pulse::gaussian(s) {
        let (wide, deviation) = (gate_fwhm_m(s, &pulse), gate_deviation_m(s, &pulse));
        ledger.equal(
            "results.csv: resolution_m",
            results.f("resolution_m")[0],
            wide,
            1e-5 * wide,
        );
        ledger.equal(
            "results.csv: resolution_sd_m",
            results.f("resolution_sd_m")[0],
            deviation,
            1e-5 * deviation,
        );
    }
}

/// Ratio and width that a map shows of a uniform wind at a fixed ratio.
pub(crate) fn hold_spectra(ledger: &mut Ledger, s: &Scene, scan: &Scan, map: &Csv) {
    let Some(pulse) = Pulse::gaussian(s) else {
        return;
    };
    let gates = scan.gate_m.len();
    let of_lines = |name: &str, shown: &dyn Fn(f64) -> f64| {
        let values = map.f(name);
        // Lines are independent, gates of one line are not; ends of the scan have half regions, which change nothing here.
        let of_line = |line: usize| {
            let shown: Vec<f64> = values[line * gates..(line + 1) * gates]
                .iter()
                .map(|v| shown(*v))
                .collect();
            average(&if name == "width_m_s" {
                finite(&shown)
            } else {
                shown
            })
        };
        average_and_error(
            &(0..scan.elevation_rad.len())
                .map(of_line)
                .collect::<Vec<_>>(),
        )
    };
    let method = s.s("estimator.method.kind");
    let (ratio, error) = of_lines("snr_db", &|v| 10_f64.powf(0.1 * v));
    let right = 10_f64.powf(0.1 * s.f("detector.snr.snr_db"));
    // Its words: unbiased at any ratio where the velocity is right; where some are left out as too weak, the others are not.
    let band_m_s = 0.5 * s.f("laser.wavelength_m") * s.f("detector.bandwidth_hz");
    let is_right = average(&finite(&map.f("bias_m_s"))).abs() < 0.03 * band_m_s;
    if ratio.is_finite() && average(&map.f("flagged")) < 0.1 && is_right {
        // The velocity of models of few lags is wrong more often, if not on average.
        let own_db = if ["autoregressive", "pulse_pair"].contains(&method.as_str()) {
            0.2
        } else {
            0.05
        };
        ledger.equal(
            "map.csv: snr_db",
            db(ratio),
            db(right),
            own_db + 4.0 * db(1.0 + error / right),
        );
    }
    let (width, error) = of_lines("width_m_s", &|v| v);
    if method == "autoregressive" {
        ledger.equal("map.csv: width_m_s, of models", width, f64::NAN, 0.0);
        return;
    }
    // A uniform wind has the width of the pulse's spectrum (E2). Empty: where a line's peak fills the band, or for broad tapers.
    let right = 0.5 * s.f("laser.wavelength_m") * pulse.spectral_deviation_hz();
    let step = 0.5 * s.f("laser.wavelength_m") * s.f("detector.sampling_hz")
        / s.f("estimator.window_samples");
    let fits = 0.5 * s.f("laser.wavelength_m") * s.f("detector.bandwidth_hz") / step
        > if s.s("estimator.weighting") == "hann" {
            8.0
        } else {
            6.0
        };
    let is_shown = fits
        && s.f("detector.snr.snr_db") >= 5.0
        && right > 0.2 * step
        && !method.contains("likelihood");
    // Where many cells show none, the others are those that came out broad.
    let widths = map.f("width_m_s");
    let are_most = finite(&widths).len() as f64 > 0.9 * widths.len() as f64;
    if is_shown || are_most {
        ledger.equal(
            "map.csv: width_m_s",
            width,
            right,
            0.15 * right + 4.0 * error,
        );
    }
}
