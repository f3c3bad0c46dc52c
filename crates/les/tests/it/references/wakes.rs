//! Vortex pairs near the ground: plane pairs against a spectral code and point vortices; pairs in space against an independent code
//! in the same box with the same noise formula; onset of the fast decay and cross wind.

use std::f64::consts::TAU;

use wakescope_les::analysis::decay::{amplitude_growth, onset, value_at};
use wakescope_les::analysis::{VortexRecord, WakeMeter, WakeRecord, WakeScales};
use wakescope_les::cases::VortexPairCase;
use wakescope_les::solver::{Run, RunObserver, RunPlan, StepRecord};
use wakescope_les::{CirculationProfile, Flow, SubgridModel};

use super::{
    Curve, absolute, assert_at_least, assert_at_most, assert_relative, assert_within,
    largest_difference, relative, stored, stored_curve,
};

/// Time between records.
const EVERY: f64 = 0.05;
/// The flow is laminar until here.
const LAMINAR: f64 = 2.2;
/// Where the runs against the independent code end.
const END: f64 = 5.0;
/// Relative errors of steps and records count from here, when the start is over.
const STEADY_FROM: f64 = 0.1;

/// Records of a pair in its own units, in which time is `tau`.
struct History {
    records: Vec<WakeRecord>,
    /// Largest error of the energy budget of a step relative to the power.
    budget_error: f64,
    /// Largest difference of the dissipation by vorticity, `2 nu Z`, from the viscous power, relative.
    dissipation_error: f64,
}

/// Measures a run as it goes.
struct Recorder {
    meter: WakeMeter,
    /// Dissipation by vorticity over the enstrophy of a record.
    dissipation_per_enstrophy: f64,
    records: Vec<WakeRecord>,
    /// Whether the next step begins with the last record.
    is_recorded: bool,
    /// Time at which the step before began.
    last_start: f64,
    budget_error: f64,
    dissipation_error: f64,
}

impl RunObserver for Recorder {
    fn step(&mut self, _: &Flow, record: &StepRecord) -> Result<(), String> {
        let report = &record.report;
        if let Some(budget) = record.budget_before
            && self.last_start > STEADY_FROM
        {
            let error = (budget.residual_m5_s3() / budget.power_m5_s3).abs();
            self.budget_error = self.budget_error.max(error);
        }
        self.last_start = report.time_s - report.step_s;
        if self.is_recorded && self.last_start > STEADY_FROM {
            let enstrophy = self.records[self.records.len() - 1].enstrophy_m2_s2;
            let dissipation = self.dissipation_per_enstrophy * enstrophy;
            let error = relative(-report.viscous_power_m5_s3, dissipation);
            self.dissipation_error = self.dissipation_error.max(error);
        }
        self.is_recorded = false;
        Ok(())
    }

    fn output(&mut self, flow: &Flow, _: usize) -> Result<(), String> {
        let record = self.meter.measure(flow).map_err(|e| e.to_string())?;
        self.records.push(record);
        self.is_recorded = true;
        Ok(())
    }
}

/// Runs a pair to `end`; its steps are at most `longest` long.
fn history(pair: &VortexPairCase, end: f64, longest: f64) -> History {
    let meter = pair.meter(&WakeScales::REDUCED).unwrap();
    history_with(meter, pair, end, longest)
}

fn history_with(meter: WakeMeter, pair: &VortexPairCase, end: f64, longest: f64) -> History {
    let case = pair.clone().case(VortexPairCase::steps(longest)).unwrap();
    let outputs = (end / EVERY).round() as usize;
    let plan = RunPlan {
        end_s: end,
        output_times_s: (0..=outputs).map(|i| EVERY * i as f64).collect(),
        ..RunPlan::default()
    };
    let mut recorder = Recorder {
        meter,
        dissipation_per_enstrophy: 2.0 * TAU / pair.reynolds * pair.size[0],
        records: Vec::new(),
        is_recorded: false,
        last_start: 0.0,
        budget_error: 0.0,
        dissipation_error: 0.0,
    };
    let (flow, _) = case.start().unwrap();
    assert!(Run::new(flow, plan).unwrap().to_end(&mut recorder).unwrap());
    History {
        records: recorder.records,
        budget_error: recorder.budget_error,
        dissipation_error: recorder.dissipation_error,
    }
}

impl History {
    fn curve(&self, value: impl Fn(&WakeRecord) -> f64) -> Curve {
        self.records.iter().map(|r| (r.time_s, value(r))).collect()
    }

    /// Circulation over that at the start.
    fn gamma_ratio(&self, vortex: fn(&WakeRecord) -> &VortexRecord) -> Curve {
        let first = vortex(&self.records[0]).gamma_5_15_m2_s;
        self.curve(|record| vortex(record).gamma_5_15_m2_s / first)
    }

    /// Mean of both vortices.
    fn mean_gamma_ratio(&self) -> Curve {
        mean(&self.gamma_ratio(left), &self.gamma_ratio(right))
    }

    /// When the fast decay begins, the mean of both vortices.
    fn onset(&self) -> f64 {
        mean_onset(&self.gamma_ratio(left), &self.gamma_ratio(right))
    }
}

fn left(record: &WakeRecord) -> &VortexRecord {
    &record.left
}

fn right(record: &WakeRecord) -> &VortexRecord {
    &record.right
}

fn mean(a: &[(f64, f64)], b: &[(f64, f64)]) -> Curve {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a.0, 0.5 * (a.1 + b.1)))
        .collect()
}

fn mean_onset(left: &[(f64, f64)], right: &[(f64, f64)]) -> f64 {
    0.5 * (onset(left).unwrap() + onset(right).unwrap())
}

/// A plane pair with Lamb-Oseen cores at Re 2500 against a spectral code to tau = 3, the path within `path`.
fn assert_plane_pair(cells: [usize; 3], path: f64) {
    let pair = VortexPairCase {
        cells,
        size: [1.0, 6.0, 3.0],
        core_radius: 0.12,
        profile: CirculationProfile::LambOseen,
        reynolds: 2500.0,
        perturbation: 0.0,
        ..VortexPairCase::coarse()
    };
    // The stored centre is that of the strongest vorticity: a small circle finds it.
    let meter = pair
        .meter(&WakeScales::REDUCED)
        .and_then(|meter| meter.with_window([0.1, 0.3]))
        .and_then(|meter| meter.with_core_radius(0.05))
        .unwrap();
    let found = history_with(meter, &pair, 3.0, 0.01);
    let rows = stored("wake_2d_ground_re2500.csv");
    let range = [0.1, 3.0];
    for (name, curve, column, difference, bar) in [
        (
            "y",
            found.curve(|r| r.right.y_m),
            1,
            absolute as fn(f64, f64) -> f64,
            path,
        ),
        ("z", found.curve(|r| r.right.z_m), 2, absolute, path),
        (
            "circulation",
            found.curve(|r| r.right.gamma_5_15_m2_s / TAU),
            4,
            relative,
            0.02,
        ),
        (
            "enstrophy",
            found.curve(|r| r.enstrophy_m2_s2),
            5,
            relative,
            0.02,
        ),
        (
            "energy",
            found.curve(|r| r.energy_m4_s2),
            6,
            relative,
            0.005,
        ),
    ] {
        let expected = stored_curve(&rows, column);
        let error = largest_difference(&curve, &expected, range, difference);
        assert_at_most(name, error, bar);
    }
    let mut asymmetry = 0.0_f64;
    for record in &found.records {
        asymmetry = asymmetry.max((record.left.y_m + record.right.y_m).abs());
    }
    assert_at_most("left against right", asymmetry, 1e-9);
}

#[test]
#[ignore = "half a minute"]
fn a_plane_pair_above_the_ground_follows_the_spectral_code_on_a_coarse_mesh() {
    assert_plane_pair([1, 192, 96], 0.04);
}

#[test]
#[ignore = "four minutes"]
fn a_plane_pair_above_the_ground_follows_the_spectral_code() {
    assert_plane_pair([1, 384, 192], 0.01);
}

#[test]
#[ignore = "three minutes"]
fn compact_cores_over_a_frictionless_ground_follow_point_vortices() {
    let pair = VortexPairCase {
        cells: [1, 560, 176],
        size: [1.0, 36.0, 11.0],
        ground_stretch: 2.0,
        lateral_stretch: 0.55,
        core_radius: 0.12,
        profile: CirculationProfile::LambOseen,
        reynolds: 1e7,
        perturbation: 0.0,
        sticky_ground: false,
        slip_sides: true,
        ..VortexPairCase::coarse()
    };
    let found = history(&pair, 4.0, 0.01);
    let rows = stored("vortex_pair_inviscid_ground_h1.csv");
    for (name, curve, column) in [
        ("y", found.curve(|r| r.right.y_m), 1),
        ("z", found.curve(|r| r.right.z_m), 2),
    ] {
        let expected = stored_curve(&rows, column);
        let error = largest_difference(&curve, &expected, [0.0, 4.0], absolute);
        assert_at_most(name, error, 0.01);
    }
    let first = found.records[0].energy_m4_s2;
    let last = found.records[found.records.len() - 1].energy_m4_s2;
    assert_at_most("energy lost", (1.0 - last / first).abs(), 1e-3);
}

/// What one mesh must agree in with the independent code.
struct Bars {
    file: &'static str,
    position: f64,
    gamma: f64,
    energy: f64,
    log_energy_3d: f64,
    growth: f64,
    onset: f64,
    /// Time, circulation over its start, difference.
    late: [(f64, f64, f64); 3],
    /// Circulation at the end over that of the plane flow, and its difference.
    over_plane: (f64, f64),
    last_energy: (f64, f64),
    peak: [f64; 2],
    peak_tau: [f64; 2],
}

const COARSE: Bars = Bars {
    file: "wake_3d_ground_re5000_coarse_box4_cans.csv",
    position: 0.02,
    gamma: 0.008,
    energy: 0.005,
    log_energy_3d: 0.7,
    growth: 0.15,
    onset: 0.25,
    late: [(3.0, 0.65, 0.07), (4.0, 0.54, 0.07), (5.0, 0.50, 0.07)],
    over_plane: (0.68, 0.07),
    last_energy: (4.6, 0.35),
    peak: [700.0, 1100.0],
    peak_tau: [2.8, 3.2],
};

const MEDIUM: Bars = Bars {
    file: "wake_3d_ground_re5000_cans.csv",
    position: 0.01,
    gamma: 0.005,
    energy: 0.003,
    log_energy_3d: 0.35,
    growth: 0.08,
    onset: 0.15,
    late: [(3.0, 0.68, 0.04), (4.0, 0.565, 0.04), (5.0, 0.515, 0.05)],
    over_plane: (0.70, 0.05),
    last_energy: (4.75, 0.25),
    peak: [800.0, 1000.0],
    peak_tau: [3.0, 3.2],
};

fn log_ratio(a: f64, b: f64) -> f64 {
    (a / b).ln().abs()
}

/// The laminar phase, which a model must leave alone.
fn assert_laminar(found: &History, bars: &Bars) {
    let rows = stored(bars.file);
    let early = [0.0, 2.0];
    let laminar = [0.0, LAMINAR];
    for (name, curve, column, range, difference, bar) in [
        (
            "y left",
            found.curve(|r| r.left.y_m),
            3,
            early,
            absolute as fn(f64, f64) -> f64,
            bars.position,
        ),
        (
            "z left",
            found.curve(|r| r.left.z_m),
            4,
            early,
            absolute,
            bars.position,
        ),
        (
            "y right",
            found.curve(|r| r.right.y_m),
            5,
            early,
            absolute,
            bars.position,
        ),
        (
            "z right",
            found.curve(|r| r.right.z_m),
            6,
            early,
            absolute,
            bars.position,
        ),
        (
            "gamma left",
            found.gamma_ratio(left),
            1,
            laminar,
            absolute,
            bars.gamma,
        ),
        (
            "gamma right",
            found.gamma_ratio(right),
            2,
            laminar,
            absolute,
            bars.gamma,
        ),
        (
            "energy",
            found.curve(|r| r.energy_m4_s2),
            11,
            [0.1, LAMINAR],
            relative,
            bars.energy,
        ),
        (
            "ln E_3d",
            found.curve(WakeRecord::energy_3d_m4_s2),
            13,
            [0.5, LAMINAR],
            log_ratio,
            bars.log_energy_3d,
        ),
    ] {
        let expected = stored_curve(&rows, column);
        let error = largest_difference(&curve, &expected, range, difference);
        assert_at_most(name, error, bar);
    }
    assert_at_most("energy budget of a step", found.budget_error, 0.005);
    assert_at_most("dissipation by vorticity", found.dissipation_error, 0.005);
    for (mode, column) in [(2, 19), (3, 20)] {
        let energy = found.curve(|r| r.mode_energy_m4_s2[mode]);
        let growth = amplitude_growth(&energy, 1.0, 2.0);
        let expected = amplitude_growth(&stored_curve(&rows, column), 1.0, 2.0);
        assert_relative(
            &format!("growth of mode {mode}"),
            growth,
            expected,
            bars.growth,
        );
    }
}

fn assert_turbulent(found: &History, plane: &History, bars: &Bars) {
    let rows = stored(bars.file);
    let expected = mean_onset(&stored_curve(&rows, 1), &stored_curve(&rows, 2));
    assert_within(
        "onset of the fast decay",
        found.onset(),
        expected,
        bars.onset,
    );
    let gamma = found.mean_gamma_ratio();
    for (tau, expected, bar) in bars.late {
        let name = format!("circulation at {tau}");
        assert_within(&name, value_at(&gamma, tau), expected, bar);
    }
    let of_plane = value_at(&plane.mean_gamma_ratio(), END);
    let (expected, bar) = bars.over_plane;
    let over_plane = value_at(&gamma, END) / of_plane;
    assert_within(
        "circulation over that of the plane flow",
        over_plane,
        expected,
        bar,
    );
    let (expected, bar) = bars.last_energy;
    let energy = found.curve(|r| r.energy_m4_s2);
    assert_within("energy at the end", value_at(&energy, END), expected, bar);
    let mut peak = (0.0, 0.0);
    for (tau, enstrophy) in found.curve(|r| r.enstrophy_m2_s2) {
        if tau > LAMINAR && enstrophy > peak.1 {
            peak = (tau, enstrophy);
        }
    }
    let [low, high] = bars.peak;
    assert_within(
        "second peak of the enstrophy",
        peak.1,
        0.5 * (low + high),
        0.5 * (high - low),
    );
    let [low, high] = bars.peak_tau;
    let bar = 0.5 * (high - low) + 0.5 * EVERY;
    assert_within("its time", peak.0, 0.5 * (low + high), bar);
}

/// The same pair on one cell along the flight.
fn plane(pair: &VortexPairCase) -> VortexPairCase {
    let [_, y, z] = pair.cells;
    VortexPairCase {
        cells: [1, y, z],
        ..pair.clone()
    }
}

fn assert_wake(pair: &VortexPairCase, bars: &Bars) -> History {
    let found = history(pair, END, 0.01);
    assert_laminar(&found, bars);
    assert_turbulent(&found, &history(&plane(pair), END, 0.01), bars);
    found
}

#[test]
#[ignore = "six minutes"]
fn a_wake_on_24_x_128_x_80_cells_is_that_of_the_independent_code() {
    let pair = VortexPairCase::coarse();
    let found = assert_wake(&pair, &COARSE);
    let modelled = VortexPairCase {
        subgrid: SubgridModel::MULTISCALE_WALE,
        ..pair
    };
    let modelled = history(&modelled, LAMINAR, 0.01);
    assert_laminar(&modelled, &COARSE);
    for vortex in [left, right] {
        let gamma = modelled.gamma_ratio(vortex);
        let without = found.gamma_ratio(vortex);
        let error = largest_difference(&gamma, &without, [0.0, LAMINAR], absolute);
        assert_at_most("circulation with the model against none", error, 0.005);
    }
}

#[test]
#[ignore = "half an hour"]
fn a_wake_on_48_x_240_x_128_cells_is_that_of_the_independent_code() {
    let pair = VortexPairCase {
        cells: [48, 240, 128],
        size: [1.0, 5.0, 2.5],
        ..VortexPairCase::coarse()
    };
    assert_wake(&pair, &MEDIUM);
}

/// When the fast decay begins on 16 x 96 x 64 cells.
fn onset_with(perturbation: f64, reynolds: f64) -> f64 {
    let pair = VortexPairCase {
        cells: [16, 96, 64],
        perturbation,
        reynolds,
        ..VortexPairCase::coarse()
    };
    // Late enough for the weakest noise.
    history(&pair, 4.5, 0.01).onset()
}

#[test]
#[ignore = "ten minutes"]
fn the_fast_decay_begins_later_with_less_noise_and_more_viscosity() {
    let mut found = Vec::new();
    for (perturbation, reynolds, expected) in [
        (1e-3, 5000.0, 3.18),
        (3e-3, 5000.0, 2.89),
        (1e-2, 5000.0, 2.46),
        (3e-2, 5000.0, 2.15),
        (1e-2, 2500.0, 2.70),
        (1e-2, 10_000.0, 2.07),
    ] {
        let onset = onset_with(perturbation, reynolds);
        let name = format!("onset with noise {perturbation} at Re {reynolds}");
        assert_within(&name, onset, expected, 0.05);
        found.push(onset);
    }
    // The independent code has 0.7 per decade.
    assert_within("onset per decade of noise", found[0] - found[2], 0.7, 0.25);
}

/// When the strengths are compared: the secondary vortices are up, the flow is still plane.
const COMPARED: f64 = 1.5;

/// Drift of the pair to 1.5, and the strength of the left secondary vortex over that of the right, in a logarithmic cross wind.
fn drift_and_strengths(cross_wind: f64) -> (f64, f64) {
    let pair = VortexPairCase {
        cells: [24, 160, 80],
        size: [1.0, 5.0, 2.5],
        cross_wind,
        wind_roughness: if cross_wind > 0.0 { 0.002 } else { 0.0 },
        ..VortexPairCase::coarse()
    };
    let found = history(&pair, COMPARED + EVERY, 0.01);
    let middle = found.curve(|r| 0.5 * (r.left.y_m + r.right.y_m));
    let strength = |vortex: fn(&WakeRecord) -> &VortexRecord| {
        let secondary = found.curve(|record| vortex(record).secondary.gamma_m2_s);
        value_at(&secondary, COMPARED).abs()
    };
    (
        value_at(&middle, COMPARED),
        strength(left) / strength(right),
    )
}

#[test]
#[ignore = "eight minutes"]
fn a_cross_wind_carries_the_pair_and_makes_its_secondary_vortices_unequal() {
    let (drift, ratio) = drift_and_strengths(0.0);
    assert_at_most("drift without wind", drift.abs(), 1e-3);
    assert_relative("strengths without wind", ratio, 1.0, 0.01);
    let (half, _) = drift_and_strengths(0.5);
    let (whole, ratio) = drift_and_strengths(1.0);
    assert_at_least("drift with V0", whole, 0.8);
    assert_at_least("drift with V0 over that with V0/2", whole / half, 1.8);
    assert_at_least("stronger over weaker with V0", ratio.max(1.0 / ratio), 1.1);
}
