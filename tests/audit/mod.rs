//! The audit: every number that a command prints or writes, beside its definition in the plainest code that computes it.
//!
//! The definitions are written from the book, not from the program. Each draw is a random scene or case over all keys; the program
//! runs as a user calls it, and its numbers are held with the tolerance that the definition gives: round-off, the error of a
//! quadrature, standard errors. `cargo xtask audit` runs the draws and prints the table; a number of the program that is neither
//! held nor excused with a reason is a fault as much as one that is wrong.
//!
//! | file | what it defines |
//! |---|---|
//! | `draw`, `draw_air` | the random scenes |
//! | `geometry` | lines, gates, windows, times, levels |
//! | `air` | the winds and their weighted means |
//! | `pair`, `eddies` | the path of a pair that decays and moves; what turbulence makes on average |
//! | `power` | efficiency, signal-to-noise ratio, budget, power of the signals |
//! | `bound` | Cramer-Rao bound, n_eff |
//! | `statistics` | moments, means over maps, standard errors over seeds, ratios and widths of spectra |
//! | `fields` | a wind as a file of fields |
//! | `files` | one quantity in two files, and what files say of themselves |
//! | `patterns` | scans in three dimensions, winds of VAD and DBS, places |
//! | `estimator` | the estimator on its own signals; `estimate` |
//! | `keys` | two values of every key, and what differs |
//! | `flow` | histories of flows and wakes, energy, Courant numbers |
//! | `scans` | `retrieve`, `detect`, `estimate`: formats, chi-square, false alarms |
//! | `table` | the list of all numbers, of those awaited and of those without a definition |

// What an audit cannot read or run is a fault: it is caught, and told with its draw.
#![allow(clippy::unwrap_used)]
// Sums over indices, as the equations have them.
#![allow(clippy::needless_range_loop)]

mod air;
mod bound;
mod draw;
mod draw_air;
mod eddies;
mod estimator;
mod fields;
mod files;
mod flow;
mod geometry;
mod keys;
mod ledger;
mod numerics;
mod pair;
mod patterns;
mod power;
mod program;
mod random;
mod scans;
mod scene;
mod statistics;
mod table;

pub use table::Report;

use geometry::Scan;
use ledger::Ledger;
use program::{Bench, Csv};
use random::Random;
use scene::Scene;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What a draw is about.
type Subject = (&'static str, fn(&mut Random, &Bench, &mut Ledger));

/// One after the other: those that cost little come more often.
const SUBJECTS: [Subject; 18] = [
    ("map", map),
    ("power", power_of),
    ("bound", bound_of),
    ("spectra", spectra),
    ("keys", keys::hold),
    ("map", map),
    ("wake", flow::hold_wake),
    ("growth", flow::hold_growth),
    ("cavity", flow::hold_cavity),
    ("pattern", patterns::hold),
    ("estimator", estimator::hold),
    ("turns", estimator::hold_turns),
    ("words", scans::hold_words),
    ("bound", bound_of),
    ("power", power_of),
    ("map", map),
    ("spectra", spectra),
    ("seeds", seeds),
];

/// What takes longer: once in `RARE` draws.
const LONG: [Subject; 5] = [
    ("detect", scans::hold_detect),
    ("summary", scans::hold_summary),
    ("turbulence", through_turbulence),
    ("noise", scans::hold_false_alarms),
    ("retrieve", scans::hold_retrieve),
];
const RARE: usize = 16;

/// Runs draws number `first` to `first + count - 1` of a seed with a program, on as many threads as are told; `keep` is a folder in
/// which their scenes and outputs stay.
pub fn audit(
    program: &Path,
    seed: u64,
    first: usize,
    count: usize,
    threads: usize,
    keep: Option<&Path>,
) -> Report {
    let next = AtomicUsize::new(first);
    let found = Mutex::new(Vec::new());
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= first + count {
                return;
            }
            let ledger = draw_of(program, seed, number, keep);
            found.lock().unwrap().push((number, ledger));
        }
    };
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let mut found = found.into_inner().unwrap();
    found.sort_by_key(|(number, _)| *number);
    let mut all = Ledger::default();
    found.into_iter().for_each(|(_, ledger)| all.add(ledger));
    Report::new(&all, count)
}

fn draw_of(program: &Path, seed: u64, number: usize, keep: Option<&Path>) -> Ledger {
    let (name, subject) = match number % RARE {
        15 => LONG[number / RARE % LONG.len()],
        _ => SUBJECTS[number % SUBJECTS.len()],
    };
    let temporary =
        || std::env::temp_dir().join(format!("wakescope-audit-{}-{number}", std::process::id()));
    let folder = keep.map_or_else(temporary, |keep| keep.join(number.to_string()));
    std::fs::create_dir_all(&folder).unwrap();
    let bench = Bench { program, folder };
    let mut ledger = Ledger::new(format!("{number} ({name})"));
    let mut random = Random::new(seed, number as u64);
    let ended = catch_unwind(AssertUnwindSafe(|| {
        subject(&mut random, &bench, &mut ledger)
    }));
    ledger.holds("every draw comes to its end", ended.is_ok(), "it panicked");
    if keep.is_none() {
        std::fs::remove_dir_all(&bench.folder).unwrap();
    }
    ledger
}

/// Draws until `check` passes a scene; refusals are counted.
fn good_scene(
    r: &mut Random,
    bench: &Bench,
    ledger: &mut Ledger,
    draw: impl Fn(&mut Random) -> Scene,
) -> Option<Scene> {
    for _ in 0..20 {
        let s = draw(r);
        bench.write("s.toml", &s.text());
        let check = bench.run(&["check", "s.toml"]);
        if check.is_good {
            return Some(s);
        }
        let run = bench.run(&["run", "s.toml", "--out", "refused"]);
        let number = "a scene that check refuses does not run";
        ledger.holds(number, !run.is_good, &check.stderr);
        ledger.refused.push(check.stderr);
    }
    None
}

/// The map of a scene with two threads, and the map without turbulence of a dissipation rate of 0, to the last digit.
fn hold_same_maps(r: &mut Random, bench: &Bench, ledger: &mut Ledger, s: &Scene, map: &Csv) {
    let hold = |ledger: &mut Ledger, number: &str, scene: &Scene, out: &str, threads: &str| {
        bench.write("same.toml", &scene.text());
        let ended = bench.run_on(threads, &["run", "same.toml", "--out", out]);
        ledger.holds(
            "a scene that check passes runs",
            ended.is_good,
            &ended.stderr,
        );
        let other = bench.csv(ledger, &format!("{out}/map.csv"));
        ledger.holds(number, other.is_same(map), "other numbers");
    };
    if r.chance(0.2) {
        hold(ledger, "the same map with two threads", s, "threads", "2");
    }
    if eddies::Eddies::of(s).is_none() && r.chance(0.2) {
        let mut still = s.clone();
        let mut added = s
            .get("added_flows")
            .map_or(String::new(), |v| v.to_string());
        added.retain(|c| c != '\n');
        let inner = added.trim_start_matches('[').trim_end_matches(']');
        let none = "{ kind = \"eddies\", dissipation_m2_s3 = 0.0 }";
        let comma = if inner.is_empty() { "" } else { ", " };
        still.set("added_flows", format!("[{inner}{comma}{none}]"));
        hold(
            ledger,
            "the same map with eddies of no dissipation",
            &still,
            "still",
            "1",
        );
    }
}

/// A whole map: places, times, levels, velocities, profile.
fn map(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let draw = |r: &mut Random| {
        let mut s = draw::scene(r);
        s.set("outputs.flow", r.chance(0.3));
        s
    };
    let Some(s) = good_scene(r, bench, ledger, draw) else {
        return;
    };
    let Some(run) = bench.must(ledger, &["run", "s.toml", "--out", "o", "--json"]) else {
        return;
    };
    let scan = Scan::new(&s);
    let map = bench.csv(ledger, "o/map.csv");
    geometry::hold(ledger, &s, &scan, &map, air::start_s(&s));
    geometry::hold_levels(ledger, &s, &scan, &map);
    air::hold(ledger, bench, &s, &scan, &map);
    hold_same_maps(r, bench, ledger, &s, &map);
    statistics::hold_map(ledger, &s, &scan, &map);
    statistics::hold_summary(ledger, &s, &scan, &map, &run.json());
    if let Some(budget) = bench.must(ledger, &["budget", "s.toml"]) {
        statistics::hold_reach(ledger, &s, &scan, &budget.stdout);
    }
    files::hold_map(ledger, bench, &s, &scan, &map);
    files::hold_flow(ledger, bench, &s);
    let profile = bench.csv(ledger, "o/profile.csv");
    power::hold_profile(ledger, &s, &profile);
}

/// What comes back, by every command that tells it, with a focus in or near the scan.
fn power_of(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let draw = |r: &mut Random| {
        let mut s = draw::scene(r);
        let first_m = r.between(150.0, 400.0);
        s.number("scan.range_min_m", first_m)
            .number("scan.range_max_m", first_m + r.between(200.0, 500.0));
        if s.f("telescope.focus_m").is_finite() {
            s.number("telescope.focus_m", r.between(200.0, 900.0));
        }
        s.number("scan.elevation_min_rad", 0.1)
            .number("scan.elevation_max_rad", 0.1);
        s.set("scan.pulses_per_line", 150)
            .set("scan.realisations", 2)
            .word("flow.kind", "calm");
        s.set("estimator.gate_step_samples", 25);
        s.unset("flow").word("flow.kind", "calm");
        // Light that the telescope sends back at once: the signals of long pulses begin with it.
        if s.s("detector.snr.reference") != "fixed" && r.chance(0.4) {
            s.number("telescope.reflection_db", r.between(-90.0, -50.0));
        }
        if r.chance(0.3) {
            let (rise, top) = (r.log(2e-8, 8e-8), r.log(1e-7, 4e-7));
            let end_s = 2.0 * rise + top;
            let time_s: Vec<f64> = (0..=200).map(|i| f64::from(i) * end_s / 200.0).collect();
            let power: Vec<f64> = time_s
                .iter()
                .map(|t| (t.min(end_s - t) / rise).min(1.0))
                .map(|part| (0.5 * std::f64::consts::PI * part).sin().powi(4))
                .collect();
            s.unset("pulse.shape").word("pulse.shape.kind", "sampled");
            s.set("pulse.shape.time_s", format!("{time_s:?}"))
                .set("pulse.shape.power", format!("{power:?}"));
        }
        s
    };
    let Some(s) = good_scene(r, bench, ledger, draw) else {
        return;
    };
    let scan = Scan::new(&s);
    let ranges: Vec<f64> = (0..4)
        .map(|_| r.between(s.f("scan.range_min_m"), s.f("scan.range_max_m")))
        .collect();
    let words = ranges
        .iter()
        .map(f64::to_string)
        .collect::<Vec<_>>()
        .join(",");
    if let Some(budget) = bench.must(ledger, &["budget", "s.toml", "--json", "--range", &words]) {
        power::hold_budget(ledger, &s, &budget.json());
    }
    if bench
        .must(ledger, &["signal", "s.toml", "--out", "o"])
        .is_some()
    {
        power::hold_signals(ledger, bench, &s, &scan, "o/signals.nc");
        files::hold_signals(ledger, bench, &s, &scan, air::start_s(&s));
    }
    if s.s("detector.noise") == "none" {
        return;
    }
    if let Some(bound) = bench.must(ledger, &["bound", "s.toml", "--json"]) {
        let json = bound.json();
        for (gate, point) in json["by_range"]
            .as_array()
            .into_iter()
            .flatten()
            .enumerate()
            .step_by(5)
        {
            let found = point["snr_db"].as_f64().unwrap_or(f64::NAN);
            let right = power::free_space_snr_db(&s, scan.gate_m[gate]);
            ledger.equal("bound: snr_db", found, right, 0.01);
        }
    }
}

/// Bounds and what levels are worth, for any pulse, window and noise.
fn bound_of(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let draw = |r: &mut Random| {
        let mut s = draw::scene(r);
        s.set("estimator.gate_step_samples", 16).set(
            "estimator.window_samples",
            r.pick(&[12, 16, 24, 32, 48, 64]),
        );
        s.number("pulse.shape.duration_s", r.log(6e-8, 4e-7));
        s
    };
    let Some(s) = good_scene(r, bench, ledger, draw) else {
        return;
    };
    if let Some(found) = bench.must(ledger, &["bound", "s.toml", "--json"]) {
        bound::hold(ledger, &s, &Scan::new(&s), &found.json());
    }
}

/// A uniform wind at a fixed ratio, seen by any estimator: the ratio and the width that it shows.
fn spectra(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let draw = |r: &mut Random| {
        let mut s = draw::scene(r);
        draw::fixed_ratio(&mut s, r.between(0.0, 10.0));
        s.unset("flow")
            .unset("added_flows")
            .word("flow.kind", "uniform");
        let reach_m_s = 0.25 * s.f("laser.wavelength_m") * s.f("detector.bandwidth_hz");
        s.number("flow.lateral_m_s", reach_m_s * r.between(-0.5, 0.5))
            .number("flow.vertical_m_s", 0.0);
        s.number("scan.elevation_min_rad", 0.0)
            .number("scan.elevation_step_rad", 0.01)
            .number("scan.elevation_max_rad", 0.2);
        s.set("scan.pulses_per_line", 10)
            .set("scan.realisations", 20)
            .set("estimator.gate_step_samples", 20);
        s.number("estimator.false_alarm", 0.0);
        s
    };
    let Some(s) = good_scene(r, bench, ledger, draw) else {
        return;
    };
    if bench
        .must(ledger, &["map", "s.toml", "--out", "o"])
        .is_some()
    {
        let map = bench.csv(ledger, "o/map.csv");
        statistics::hold_spectra(ledger, &s, &Scan::new(&s), &map);
    }
}

/// Many seeds of one small scene.
fn seeds(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let draw = |r: &mut Random| {
        let mut s = draw::scene(r);
        draw::fixed_ratio(&mut s, r.between(0.0, 12.0));
        s.unset("flow")
            .unset("added_flows")
            .number("flow.cross_wind_m_s", r.between(-3.0, 3.0));
        if r.chance(0.3) {
            draw_air::add(&mut s, &[("eddies", draw_air::eddies(r, false))]);
        }
        s.number("scan.elevation_min_rad", 0.08)
            .number("scan.elevation_step_rad", 4e-3)
            .number("scan.elevation_max_rad", 0.16);
        s.number("scan.range_min_m", 350.0)
            .number("scan.range_max_m", 450.0)
            .set("estimator.window_samples", 32);
        let realisations = r.whole(2, 6);
        s.set("scan.pulses_per_line", if realisations > 3 { 1 } else { 2 })
            .set("scan.realisations", realisations);
        s.set("estimator.gate_step_samples", 12);
        s
    };
    if let Some(s) = good_scene(r, bench, ledger, draw) {
        statistics::hold_seeds(ledger, bench, &s);
    }
}

/// Through a focus in turbulence: the ratio of the signals and that of the budget, each a Monte Carlo of its own.
fn through_turbulence(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let mut s = Scene::default();
    s.number("telescope.focus_m", r.between(260.0, 500.0))
        .word("atmosphere.turbulence.kind", "refractive");
    s.set("atmosphere.turbulence.grid_points", 320);
    let (low, high) = (r.log(3e-15, 2e-14), r.log(3e-15, 2e-14));
    match r.whole(0, 3) {
        0 => s
            .word("atmosphere.turbulence.profile.kind", "hufnagel_valley")
            .number(
                "atmosphere.turbulence.profile.high_wind_m_s",
                r.between(10.0, 40.0),
            )
            .number("atmosphere.turbulence.profile.ground_cn2_m_m23", low),
        1 => s
            .word("atmosphere.turbulence.profile.kind", "table")
            .set(
                "atmosphere.turbulence.profile.heights_m",
                "[5.0, 40.0, 120.0]",
            )
            .set(
                "atmosphere.turbulence.profile.values_m_m23",
                format!("[{low:?}, {high:?}, 5e-15]"),
            ),
        _ => s.number("atmosphere.turbulence.cn2_m_m23", 1e-14),
    };
    // The program has laws at 40 heights a decade.
    let of_law = if s.has("atmosphere.turbulence.profile") {
        1e-3
    } else {
        1e-5
    };
    s.set("atmosphere.turbulence.layers", 10)
        .set("atmosphere.turbulence.realisations", 24);
    s.number("scan.elevation_min_rad", 0.1)
        .number("scan.elevation_max_rad", 0.1)
        .set("scan.pulses_per_line", 1);
    s.number("scan.range_min_m", 150.0)
        .number("scan.range_max_m", 1400.0)
        .set("estimator.gate_step_samples", 60);
    s.number("outputs.profile_range_min_m", 170.0)
        .number("outputs.profile_range_max_m", 1400.0)
        .set("outputs.profile_points", 42);
    bench.write("s.toml", &s.text());
    let gates = Scan::new(&s).gate_m;
    let ranges: Vec<f64> = gates
        .iter()
        .copied()
        .filter(|m| (170.0..1400.0).contains(m))
        .collect();
    let words = ranges
        .iter()
        .map(f64::to_string)
        .collect::<Vec<_>>()
        .join(",");
    let bound = bench.run(&["bound", "s.toml", "--json"]);
    let number = "through turbulence: a scan that begins before the profile";
    ledger.holds(
        number,
        bound.is_good || !bench.run(&["check", "s.toml"]).is_good,
        &bound.stderr,
    );
    let Some(budget) = bench.must(ledger, &["budget", "s.toml", "--json", "--range", &words])
    else {
        return;
    };
    // Free space does not hang on how many realisations are beside it, nor does independent turbulence without scales.
    s.set("atmosphere.turbulence.realisations", 5)
        .word("atmosphere.turbulence.spectrum", "kolmogorov");
    bench.write("s.toml", &s.text());
    if bench
        .must(ledger, &["efficiency", "s.toml", "--out", "o"])
        .is_some()
    {
        let profile = bench.csv(ledger, "o/profile.csv");
        let (range, free) = (profile.f("range_m"), profile.f("efficiency_free_space"));
        let independent = profile.f("efficiency_bistatic_exact");
        for i in (0..range.len()).step_by(7) {
            let right = power::free_space_efficiency(&s, range[i]);
            ledger.equal(
                "profile.csv: efficiency_free_space",
                free[i],
                right,
                1e-6 * right,
            );
            let right = power::independent_efficiency(&s, range[i]);
            ledger.equal(
                "profile.csv: efficiency_bistatic_exact",
                independent[i],
                right,
                of_law * right,
            );
        }
    }
    let (budget, bound) = (budget.json(), bound.json());
    let rows = budget["rows"].as_array().cloned().unwrap_or_default();
    let total = rows
        .iter()
        .find(|row| row["row"] == "= SNR in the band")
        .cloned()
        .unwrap_or_default();
    for (i, range_m) in ranges.iter().enumerate().filter(|_| !bound.is_null()) {
        let points = bound["by_range"].as_array().cloned().unwrap_or_default();
        let here = points.iter().find(|p| {
            p["range_m"]
                .as_f64()
                .is_some_and(|m| (m - range_m).abs() < 1e-3)
        });
        let found = here.and_then(|p| p["snr_db"].as_f64()).unwrap_or(f64::NAN);
        // 24 realisations of either leave some 0.3 dB.
        ledger.equal(
            "bound: snr_db, of the budget in turbulence",
            found,
            total["db"][i].as_f64().unwrap_or(f64::NAN),
            1.2,
        );
    }
}
