//! Which scans show secondary vortices, and how far fits of a pair and of all four are then from the truth.
//!
//! Maps of means over gates with white errors, each with its own pair, with secondary vortices and without; scans of such a pair and of a
//! simulated wake through the whole chain, whose velocities are peaks of spectra. No rule was chosen on these draws.

use super::Options;
use crate::figures::fig17_flows::{retrieved, scene};
use crate::statistics::{Estimate, mean};
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use ndarray::Array2;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use serde::Deserialize;
use std::f64::consts::{PI, TAU};
use std::path::Path;
use wakescope_estimate::retrieval::{
    Flag, Gate, Measured, RetrievalOptions, ScanMap, ScanResult, expected_velocities, fit_scan,
    with_secondary_vortices,
};
use wakescope_estimate::vortex_fit::{CorePrior, CoreProfile, Secondary, Vortex, Wake};
use wakescope_sim::retrieve::{self, RetrievalRow};
use wakescope_sim::scene::{
    Flow, Outside, Retrieval, Scene, SimulatedFlow, SimulatedMotion, VortexLines, VortexPair,
};

/// The middle of the wakes \[m\].
const MIDDLE_M: f64 = 400.0;
/// Standard deviation of the weight of gates that do not show cores \[m\], as `retrieve` has it.
const LONG_GATE_M: f64 = 3.0;

/// The names of profiles in the list of kinds.
#[derive(Deserialize)]
#[serde(remote = "CoreProfile", rename_all = "snake_case")]
enum ProfileName {
    Algebraic,
    LambOseen,
}

/// Wakes of one kind, and how they are scanned.
#[derive(Deserialize)]
struct Kind {
    name: String,
    #[serde(with = "ProfileName")]
    profile: CoreProfile,
    shown: bool,
    /// Of the vortices, and of their spacing \[m\]: the least and the most.
    height_m: [f64; 2],
    spacing_m: [f64; 2],
    /// Standard deviation of the weight of gates, and their distance \[m\]; scenes have gates, noise and times of their own.
    #[serde(default)]
    gate_m: (f64, f64),
    /// Standard deviation of the velocities \[m/s\].
    #[serde(default)]
    noise_m_s: f64,
    /// How long a scan takes \[s\].
    #[serde(default)]
    lasts_s: f64,
}

/// Kinds whose maps are drawn, and whose scenes are run.
#[derive(Deserialize)]
struct Kinds {
    map: Vec<Kind>,
    scene: Vec<Kind>,
}

/// What is told of one vortex: errors of the mean circulation \[%\] and in deviations, and of the lateral place \[m\].
#[derive(Clone, Copy)]
struct Errors {
    circulation: f64,
    deviations: f64,
    lateral_m: f64,
}

impl Errors {
    fn of(circulation_m2_s: Measured, true_m2_s: f64, lateral_m: f64) -> Self {
        let away_m2_s = circulation_m2_s.value - true_m2_s;
        Self {
            circulation: 100.0 * away_m2_s / true_m2_s,
            deviations: away_m2_s / circulation_m2_s.std,
            lateral_m,
        }
    }
}

/// Both vortices of one scan, fitted as a pair, and as the program does with so many.
struct Scan {
    shown: bool,
    /// Fitted as a pair and with secondary vortices, whether the scan shows them or not; empty where a vortex was not found.
    fits: [Vec<Errors>; 2],
}

/// Numbers that are the same for one seed.
struct Draw(Xoshiro256PlusPlus);

impl Draw {
    fn within(&mut self, [least, most]: [f64; 2]) -> f64 {
        least + (most - least) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.within([0.0, 1.0])).ln()).sqrt();
        radius * (TAU * self.within([0.0, 1.0])).cos()
    }

    /// A pair, and the secondary vortices that belong to it: outside and above, as the ground makes them.
    fn air(&mut self, kind: &Kind) -> (Wake, [Vortex; 2]) {
        let (circulation_m2_s, spacing_m) =
            (self.within([250.0, 550.0]), self.within(kind.spacing_m));
        let (height_m, core_radius_m) = (self.within(kind.height_m), self.within([2.0, 4.5]));
        let mut sides = [-1.0, 1.0].map(|side| {
            let own = Vortex {
                circulation_m2_s: circulation_m2_s * self.within([0.9, 1.1]),
                lateral_position_m: MIDDLE_M + 0.5 * side * spacing_m,
                height_m: height_m * self.within([0.9, 1.1]),
                core_radius_m,
            };
            let (away_m, angle) = (
                own.height_m * self.within([0.5, 1.1]),
                self.within([0.0, 0.4 * PI]),
            );
            let secondary = Vortex {
                circulation_m2_s: -own.circulation_m2_s * self.within([0.25, 0.45]),
                lateral_position_m: own.lateral_position_m + side * away_m * angle.cos(),
                height_m: own.height_m + away_m * angle.sin(),
                core_radius_m: own.height_m * self.within([0.08, 0.16]),
            };
            (own, secondary)
        });
        let [(left, a), (right, b)] = &mut sides;
        let (lateral_wind_m_s, wind_shear_per_s) =
            (self.within([-4.0, 4.0]), self.within([-0.02, 0.02]));
        (
            Wake {
                left: *left,
                right: *right,
                lateral_wind_m_s,
                wind_shear_per_s,
            },
            [*a, *b],
        )
    }
}

/// One map, fitted as `retrieve` fits that of any instrument. Nothing where it does not show a pair.
fn of_map(kind: &Kind, seed: u64) -> Result<Option<Scan>, Failure> {
    let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(seed));
    let (truth, secondary) = draw.air(kind);
    let elevation_rad: Vec<f64> = (0..60).map(|i| 0.01 + 0.003 * f64::from(i)).collect();
    let range_m: Vec<f64> = (0..)
        .map(|i| MIDDLE_M - 110.0 + kind.gate_m.1 * f64::from(i))
        .take_while(|r| *r < MIDDLE_M + 110.0)
        .collect();
    let size = (elevation_rad.len(), range_m.len());
    let mut map = ScanMap {
        time_s: (0..size.0)
            .map(|i| kind.lasts_s * i as f64 / (size.0 - 1) as f64)
            .collect(),
        elevation_rad,
        range_m,
        velocity_m_s: Array2::zeros(size),
        sigma_m_s: Some(Array2::from_elem(size, kind.noise_m_s)),
        fold_m_s: None,
    };
    let gate = if kind.gate_m.0 > 0.0 {
        Gate::Gaussian {
            std_m: kind.gate_m.0,
        }
    } else {
        Gate::Point
    };
    let core_prior = (kind.gate_m.0 > LONG_GATE_M).then_some(CorePrior::TYPICAL);
    let options = RetrievalOptions {
        gate,
        core_prior,
        ..RetrievalOptions::default()
    };
    let mut air = options.clone();
    air.model.profile = kind.profile;
    air.model.secondary = kind.shown.then_some(secondary);
    map.velocity_m_s = expected_velocities(&map, &air, &truth, kind.lasts_s > 0.0)?;
    map.velocity_m_s
        .mapv_inplace(|v| v + kind.noise_m_s * draw.normal());
    let pair = fit_scan(&map, &options)?;
    let with = |secondary| {
        with_secondary_vortices(
            &map,
            &RetrievalOptions {
                secondary,
                ..options.clone()
            },
            &pair,
        )
    };
    let shown = with(Secondary::Never)?.is_some();
    let four = with(Secondary::Always)?.map_or_else(|| pair.clone(), |(four, _)| four);
    let errors = |found: &ScanResult| -> Vec<Errors> {
        let Some(wake) = found.wake.filter(|_| found.vortices.len() == 2) else {
            return Vec::new();
        };
        let sides = [(&wake.left, &truth.left), (&wake.right, &truth.right)];
        let of = |(vortex, (fitted, truth)): (
            &wakescope_estimate::retrieval::VortexResult,
            (&Vortex, &Vortex),
        )| {
            let true_m2_s = truth.circulation_m2_s * kind.profile.mean_5_15(truth.core_radius_m).0;
            let lateral_m = fitted.lateral_position_m - truth.lateral_position_m;
            Errors::of(vortex.circulation_5_15_m2_s, true_m2_s, lateral_m)
        };
        found.vortices.iter().zip(sides).map(of).collect()
    };
    let fits = [errors(&pair), errors(&four)];
    Ok(fits
        .iter()
        .all(|errors| !errors.is_empty())
        .then_some(Scan { shown, fits }))
}

/// Scans of a scene.
fn of_scene(
    flow: Flow,
    added_flows: Vec<Flow>,
    folder: &Path,
    options: &Options,
) -> Result<Vec<Scan>, Failure> {
    let by = |secondary| {
        let air = (flow.clone(), added_flows.clone());
        let mut scene = Scene {
            seed: options.seed,
            flow: air.0,
            added_flows: air.1,
            ..scene()?
        };
        (scene.scan.realisations, scene.scan.outside_flow) =
            (options.scans as usize, Outside::Mask {});
        retrieved(
            &scene,
            Retrieval {
                secondary,
                ..Retrieval::default()
            },
            folder,
        )
    };
    let (pair, four) = (by(Secondary::Never)?, by(Secondary::Always)?);
    let errors = |rows: &[RetrievalRow]| -> Vec<Errors> {
        let of = |row: &RetrievalRow| {
            let (found, truth) = (row.found?, row.truth);
            let lateral_m = found.lateral_position_m.value - truth.lateral_position_m.value;
            Some(Errors::of(
                found.circulation_5_15_m2_s,
                truth.circulation_5_15_m2_s.value,
                lateral_m,
            ))
        };
        rows.iter()
            .map(of)
            .collect::<Option<_>>()
            .unwrap_or_default()
    };
    let name = retrieve::name(Flag::SecondaryVortices);
    let scans = pair.chunks(2).zip(four.chunks(2)).map(|(pair, four)| Scan {
        shown: pair[0].flags.split(' ').any(|flag| flag == name),
        fits: [errors(pair), errors(four)],
    });
    Ok(scans
        .filter(|scan| scan.fits.iter().all(|errors| !errors.is_empty()))
        .collect())
}

/// A pair of a scene with secondary vortices, or without.
fn pair_of_scene(kind: &Kind, seed: u64) -> (Flow, Vec<Flow>) {
    let (wake, secondary) = Draw(Xoshiro256PlusPlus::seed_from_u64(seed)).air(kind);
    let pair = VortexPair {
        circulation_m2_s: wake.left.circulation_m2_s,
        spacing_m: wake.spacing_m(),
        core_radius_m: wake.left.core_radius_m,
        height_m: wake.left.height_m,
        profile: kind.profile,
        cross_wind_m_s: wake.lateral_wind_m_s,
        ..VortexPair::default()
    };
    // a positive line towards +x turns y towards z, as a right vortex does
    let lines = VortexLines {
        nodes_m: secondary
            .iter()
            .map(|v| {
                [-1.0, 1.0]
                    .map(|x| [x, v.lateral_position_m, v.height_m])
                    .to_vec()
            })
            .collect(),
        circulation_m2_s: vec![
            -secondary[0].circulation_m2_s,
            secondary[1].circulation_m2_s,
        ],
        core_radius_m: secondary[0].core_radius_m,
        ..VortexLines::default()
    };
    (
        Flow::VortexPair(pair),
        if kind.shown {
            vec![Flow::VortexLines(lines)]
        } else {
            Vec::new()
        },
    )
}

/// How often secondary vortices are shown, and how far a pair alone, the rule and four vortices are from the truth.
fn show(name: &str, scans: &[Scan]) {
    let shown = scans.iter().filter(|scan| scan.shown).count();
    println!("{name}: shown by {shown} of {} scans", scans.len());
    if scans.len() < 2 {
        return;
    }
    // By which fit a scan is told that does not show such vortices, and one that does.
    for (what, fits) in [
        ("a pair alone", [0, 0]),
        ("by the rule", [0, 1]),
        ("always four", [1, 1]),
    ] {
        let each = |get: fn(&Errors) -> f64| -> Vec<f64> {
            let of = scans
                .iter()
                .map(|scan| &scan.fits[fits[usize::from(scan.shown)]]);
            of.map(|errors| mean(&errors.iter().map(get).collect::<Vec<_>>(), None))
                .collect()
        };
        let bias = Estimate::mean(&each(|e| e.circulation));
        let root = |get: fn(&Errors) -> f64| mean(&each(get), None).sqrt();
        println!(
            "  {what}: Gamma_5-15 {:6.1} +- {:.1} %, root mean square {:5.1} %, {:4.1} deviations; {:4.1} m aside",
            bias.value,
            bias.standard_error,
            root(|e| e.circulation * e.circulation),
            root(|e| e.deviations * e.deviations),
            root(|e| e.lateral_m * e.lateral_m)
        );
    }
}

pub(super) fn run(options: &Options) -> Outcome {
    if options.wake.is_none() {
        let Kinds { map, scene } = toml::from_str(include_str!("secondary.toml"))?;
        for kind in &map {
            let of = |scan| of_map(kind, options.seed.wrapping_mul(1 << 20) + u64::from(scan));
            let scans = (0..options.scans)
                .into_par_iter()
                .map(of)
                .collect::<Result<Vec<_>, Failure>>()?;
            show(&kind.name, &scans.into_iter().flatten().collect::<Vec<_>>());
        }
        for kind in &scene {
            let (flow, added) = pair_of_scene(kind, options.seed);
            show(&kind.name, &of_scene(flow, added, &root(), options)?);
        }
    }
    let folder = options
        .wake
        .clone()
        .unwrap_or_else(|| root().join("tests/reference/wake"));
    for &tau in &options.tau {
        let (planes, motion) = ("plane1".into(), SimulatedMotion::Frozen);
        let flow = Flow::Simulated(SimulatedFlow {
            planes,
            motion,
            age_tau: Some(tau),
            ..SimulatedFlow::default()
        });
        show(
            &format!("simulated wake, tau = {tau}"),
            &of_scene(flow, Vec::new(), &folder, options)?,
        );
    }
    Ok(())
}
