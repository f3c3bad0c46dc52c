//! Which scans show secondary vortices, and how far fits of a pair and of all four are then from the truth.
//!
//! Maps of means over gates with white errors, each with its own pair, with secondary vortices and
//! without; scans of a pair and of a simulated wake through the whole chain, whose velocities are
//! peaks of spectra. No rule was chosen on these draws.

use super::FitTrialsArgs;
use crate::figures::fig17_flows::{retrieved, scene};
use crate::statistics::{Estimate, mean};
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use ndarray::Array2;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::path::Path;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{
    Flag, Gate, RetrievalOptions, ScanMap, ScanResult, Velocities, expected_velocities, fit_scan,
};
use wakescope_estimate::vortex_fit::{CorePrior, CoreProfile, Secondary, Vortex, Wake};
use wakescope_sim::retrieve::{self, RetrievalRow};
use wakescope_sim::scene::{
    Flow, Outside, Retrieval, Scene, SimulatedFlow, SimulatedMotion, VortexPair,
};

/// The middle of the wakes \[m\].
const MIDDLE_M: f64 = 400.0;
/// Ranges and the middle of the wakes are no farther apart than this \[m\].
const REACH_M: f64 = 110.0;
/// Lines of the maps.
const LINES: usize = 60;
/// Standard deviation of the weight of gates that do not resolve cores \[m\], as `retrieve` has it.
const LONG_GATE_M: f64 = 3.0;

/// The kind of maps whose pairs are scanned in a scene, too, which has gates and noise of its own.
const IN_SCENE: &str = "low Lamb-Oseen pairs, gates 4 m";

/// A profile by its name in the list of kinds.
fn profile<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<CoreProfile, D::Error> {
    match String::deserialize(deserializer)?.as_str() {
        "algebraic" => Ok(CoreProfile::Algebraic),
        "lamb_oseen" => Ok(CoreProfile::LambOseen),
        name => Err(serde::de::Error::unknown_variant(
            name,
            &["algebraic", "lamb_oseen"],
        )),
    }
}

/// Maps of means over gates of pairs of vortices and their secondary vortices.
#[derive(Deserialize)]
struct MapKind {
    name: String,
    #[serde(deserialize_with = "profile")]
    profile: CoreProfile,
    /// Least and largest height of the vortices \[m\].
    height_m: [f64; 2],
    /// Least and largest spacing of the vortices \[m\].
    spacing_m: [f64; 2],
    /// Whether the wakes have secondary vortices.
    secondary: bool,
    /// Standard deviation of the weight of gates; 0 for points \[m\].
    gate_std_m: f64,
    gate_step_m: f64,
    /// Standard deviation of the velocities \[m/s\].
    noise_m_s: f64,
    /// Duration of a scan \[s\].
    duration_s: f64,
}

/// Errors of one fitted vortex.
#[derive(Clone, Copy)]
struct Errors {
    /// Of the circulation within 5 to 15 m \[%\].
    circulation_percent: f64,
    /// Of the same, in reported standard deviations.
    circulation_deviations: f64,
    /// Of the lateral position \[m\].
    lateral_m: f64,
}

impl Errors {
    fn new(circulation_m2_s: Measured, true_m2_s: f64, lateral_m: f64) -> Self {
        let error_m2_s = circulation_m2_s.value - true_m2_s;
        Self {
            circulation_percent: 100.0 * error_m2_s / true_m2_s,
            circulation_deviations: error_m2_s / circulation_m2_s.std,
            lateral_m,
        }
    }
}

/// Both vortices of one scan, fitted as a pair alone and with secondary vortices.
struct ScanErrors {
    /// Whether the scan shows secondary vortices.
    shows_secondary: bool,
    pair: Vec<Errors>,
    four: Vec<Errors>,
}

impl ScanErrors {
    /// Whether both fits have errors to report: each found both vortices.
    fn is_complete(&self) -> bool {
        !self.pair.is_empty() && !self.four.is_empty()
    }
}

/// The errors of the fit of a scan that a rule chooses.
type ChosenErrors = fn(&ScanErrors) -> &[Errors];

/// Rules by which a fit of a scan is chosen.
const RULES: [(&str, ChosenErrors); 3] = [
    ("a pair alone", |scan| &scan.pair),
    ("by the rule", |scan| {
        if scan.shows_secondary {
            &scan.four
        } else {
            &scan.pair
        }
    }),
    ("always four", |scan| &scan.four),
];

/// A number between two, uniformly distributed.
fn draw_within(rng: &mut Xoshiro256PlusPlus, [least, most]: [f64; 2]) -> f64 {
    least + (most - least) * (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A normally distributed number of variance 1.
fn draw_normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    let radius = (-2.0 * (1.0 - draw_within(rng, [0.0, 1.0])).ln()).sqrt();
    radius * (TAU * draw_within(rng, [0.0, 1.0])).cos()
}

/// A pair, and the secondary vortices that belong to it.
fn draw_wake(rng: &mut Xoshiro256PlusPlus, kind: &MapKind) -> (Wake, [Vortex; 2]) {
    let circulation_m2_s = draw_within(rng, [250.0, 550.0]);
    let spacing_m = draw_within(rng, kind.spacing_m);
    let height_m = draw_within(rng, kind.height_m);
    let core_radius_m = draw_within(rng, [2.0, 4.5]);
    let sides = [-1.0, 1.0].map(|side| {
        let primary = Vortex {
            circulation_m2_s: circulation_m2_s * draw_within(rng, [0.9, 1.1]),
            lateral_position_m: MIDDLE_M + 0.5 * side * spacing_m,
            height_m: height_m * draw_within(rng, [0.9, 1.1]),
            core_radius_m,
        };
        let secondary = draw_secondary(rng, &primary, side);
        (primary, secondary)
    });
    let [(left, left_secondary), (right, right_secondary)] = sides;
    let wake = Wake {
        left,
        right,
        lateral_wind_m_s: draw_within(rng, [-4.0, 4.0]),
        wind_shear_per_s: draw_within(rng, [-0.02, 0.02]),
        log_wind_m_s: 0.0,
    };
    (wake, [left_secondary, right_secondary])
}

/// The secondary vortex of a vortex: outside and above, as the ground makes it.
fn draw_secondary(rng: &mut Xoshiro256PlusPlus, primary: &Vortex, side: f64) -> Vortex {
    let distance_m = primary.height_m * draw_within(rng, [0.5, 1.1]);
    let angle = draw_within(rng, [0.0, 0.4 * PI]);
    Vortex {
        circulation_m2_s: -primary.circulation_m2_s * draw_within(rng, [0.25, 0.45]),
        lateral_position_m: primary.lateral_position_m + side * distance_m * angle.cos(),
        height_m: primary.height_m + distance_m * angle.sin(),
        core_radius_m: primary.height_m * draw_within(rng, [0.08, 0.16]),
    }
}

/// What a retrieval knows of the maps of a kind.
fn options_of(kind: &MapKind) -> RetrievalOptions {
    let gate = if kind.gate_std_m > 0.0 {
        Gate::Gaussian {
            std_m: kind.gate_std_m,
        }
    } else {
        Gate::Point
    };
    RetrievalOptions {
        gate,
        core_prior: (kind.gate_std_m > LONG_GATE_M).then_some(CorePrior::TYPICAL),
        ..RetrievalOptions::default()
    }
}

/// The lines and ranges of a map without velocities.
fn empty_map(kind: &MapKind) -> ScanMap {
    let mut elevation_rad = Vec::new();
    let mut time_s = Vec::new();
    for line in 0..LINES {
        elevation_rad.push(0.01 + 0.003 * line as f64);
        time_s.push(kind.duration_s * line as f64 / (LINES - 1) as f64);
    }
    let mut range_m = Vec::new();
    for gate in 0.. {
        let range = MIDDLE_M - REACH_M + kind.gate_step_m * f64::from(gate);
        if range >= MIDDLE_M + REACH_M {
            break;
        }
        range_m.push(range);
    }
    let shape = (LINES, range_m.len());
    ScanMap {
        time_s,
        elevation_rad,
        range_m,
        velocity_m_s: Array2::zeros(shape),
        sigma_m_s: Some(Array2::from_elem(shape, kind.noise_m_s)),
        fold_m_s: None,
    }
}

/// One map, fitted as `retrieve` fits that of any instrument. Nothing where it does not show a pair.
fn map_errors(kind: &MapKind, seed: u64) -> Result<Option<ScanErrors>, Failure> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (truth, secondary) = draw_wake(&mut rng, kind);
    let options = options_of(kind);
    let mut true_options = options.clone();
    true_options.model.profile = kind.profile;
    true_options.model.secondary = kind.secondary.then_some(secondary);
    let mut map = empty_map(kind);
    map.velocity_m_s = expected_velocities(&map, &true_options, &truth, kind.duration_s > 0.0)?;
    map.velocity_m_s
        .mapv_inplace(|v| v + kind.noise_m_s * draw_normal(&mut rng));
    let with_secondary = |secondary| {
        let options = RetrievalOptions {
            secondary,
            ..options.clone()
        };
        fit_scan(&map, Velocities::Means, &options)
    };
    let pair = with_secondary(Secondary::Never)?;
    let four = with_secondary(Secondary::Always)?;
    let scan = ScanErrors {
        shows_secondary: pair.has(Flag::SecondaryVortices),
        pair: result_errors(&pair, &truth, kind.profile),
        four: result_errors(&four, &truth, kind.profile),
    };
    Ok(scan.is_complete().then_some(scan))
}

/// Errors of both vortices of a fit; none unless it found both.
fn result_errors(found: &ScanResult, truth: &Wake, profile: CoreProfile) -> Vec<Errors> {
    let Some(wake) = found.wake else {
        return Vec::new();
    };
    let [left, right] = found.vortices.as_slice() else {
        return Vec::new();
    };
    let sides = [
        (left, &wake.left, &truth.left),
        (right, &wake.right, &truth.right),
    ];
    let mut errors = Vec::new();
    for (vortex, fitted, truth) in sides {
        let true_m2_s = truth.circulation_m2_s * profile.mean_5_15(truth.core_radius_m).0;
        let lateral_m = fitted.lateral_position_m - truth.lateral_position_m;
        errors.push(Errors::new(
            vortex.circulation_5_15_m2_s,
            true_m2_s,
            lateral_m,
        ));
    }
    errors
}

/// Errors of the scans of a scene.
fn scene_errors(
    flow: &Flow,
    folder: &Path,
    args: &FitTrialsArgs,
) -> Result<Vec<ScanErrors>, Failure> {
    let mut scene = Scene {
        seed: args.seed,
        flow: flow.clone(),
        ..scene()?
    };
    scene.scan.realisations = args.scans as usize;
    scene.scan.outside_flow = Outside::Mask {};
    let rows_with = |secondary| {
        let retrieval = Retrieval {
            secondary,
            ..Retrieval::default()
        };
        retrieved(&scene, retrieval, folder)
    };
    let pairs = rows_with(Secondary::Never)?;
    let fours = rows_with(Secondary::Always)?;
    let flag = retrieve::name(Flag::SecondaryVortices);
    let mut scans = Vec::new();
    for (pair, four) in pairs.chunks(2).zip(fours.chunks(2)) {
        let scan = ScanErrors {
            shows_secondary: pair[0].flags.split(' ').any(|word| word == flag),
            pair: row_errors(pair),
            four: row_errors(four),
        };
        if scan.is_complete() {
            scans.push(scan);
        }
    }
    Ok(scans)
}

/// Errors of both vortices of a scan; none unless both were found.
fn row_errors(rows: &[RetrievalRow]) -> Vec<Errors> {
    let mut errors = Vec::new();
    for row in rows {
        let Some(found) = &row.found else {
            return Vec::new();
        };
        errors.push(Errors::new(
            found.circulation_5_15_m2_s,
            row.truth.circulation_5_15_m2_s.value,
            found.lateral_position_m.value - row.truth.lateral_position_m.value,
        ));
    }
    errors
}

/// A pair of a scene.
fn pair_of_scene(kind: &MapKind, seed: u64) -> Flow {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (wake, _) = draw_wake(&mut rng, kind);
    Flow::VortexPair(VortexPair {
        circulation_m2_s: wake.left.circulation_m2_s,
        spacing_m: wake.spacing_m(),
        core_radius_m: wake.left.core_radius_m,
        height_m: wake.left.height_m,
        profile: kind.profile,
        cross_wind_m_s: wake.lateral_wind_m_s,
        ..VortexPair::default()
    })
}

/// Mean over the vortices of each scan of a number of the errors of the chosen fit.
fn means(scans: &[ScanErrors], chosen: ChosenErrors, number: fn(&Errors) -> f64) -> Vec<f64> {
    let mut means = Vec::new();
    for scan in scans {
        let numbers: Vec<f64> = chosen(scan).iter().map(number).collect();
        means.push(mean(&numbers, None));
    }
    means
}

/// Prints how often secondary vortices are observed, and the errors of the fits by each rule.
fn print(name: &str, scans: &[ScanErrors]) {
    let observed = scans.iter().filter(|scan| scan.shows_secondary).count();
    println!("{name}: observed in {observed} of {} scans", scans.len());
    if scans.len() < 2 {
        return;
    }
    for (rule, chosen) in RULES {
        let bias = Estimate::mean(&means(scans, chosen, |e| e.circulation_percent));
        let squares = means(scans, chosen, |e| e.circulation_percent.powi(2));
        let deviations = means(scans, chosen, |e| e.circulation_deviations.powi(2));
        let lateral = means(scans, chosen, |e| e.lateral_m.powi(2));
        println!(
            "  {rule}: Gamma_5-15 {:6.1} +- {:.1} %, root mean square {:5.1} %, {:4.1} standard deviations; lateral {:4.1} m",
            bias.value,
            bias.standard_error,
            mean(&squares, None).sqrt(),
            mean(&deviations, None).sqrt(),
            mean(&lateral, None).sqrt()
        );
    }
}

/// Draws and scans synthetic pairs.
fn run_pairs(args: &FitTrialsArgs) -> Outcome {
    let kinds: BTreeMap<String, Vec<MapKind>> = toml::from_str(include_str!("secondary.toml"))?;
    let first_seed = args.seed.wrapping_mul(1 << 20);
    for kind in kinds.values().flatten() {
        let scans: Vec<Option<ScanErrors>> = (0..args.scans)
            .into_par_iter()
            .map(|scan| map_errors(kind, first_seed + u64::from(scan)))
            .collect::<Result<_, Failure>>()?;
        let scans: Vec<ScanErrors> = scans.into_iter().flatten().collect();
        print(&kind.name, &scans);
    }
    for kind in kinds.values().flatten() {
        if kind.name == IN_SCENE {
            let flow = pair_of_scene(kind, args.seed);
            let scans = scene_errors(&flow, &root(), args)?;
            print("peaks, low Lamb-Oseen pair", &scans);
        }
    }
    Ok(())
}

pub(super) fn run(args: &FitTrialsArgs) -> Outcome {
    if args.wake.is_none() {
        run_pairs(args)?;
    }
    let stored = root().join("tests/reference/wake");
    let folder = args.wake.as_ref().unwrap_or(&stored);
    for &tau in &args.tau {
        let flow = Flow::Simulated(SimulatedFlow {
            planes: "plane1".into(),
            motion: SimulatedMotion::Frozen,
            age_tau: Some(tau),
            ..SimulatedFlow::default()
        });
        let scans = scene_errors(&flow, folder, args)?;
        print(&format!("simulated wake, tau = {tau}"), &scans);
    }
    Ok(())
}
