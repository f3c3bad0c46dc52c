//! `cargo xtask fit-trials`: fits to many scans of a pair against the truth, their bound and a start at the truth.
//!
//! Every scan is fitted from its map on: the map with the core kept at the typical one, about it and free, then all signals with one core radius
//! fitted or the true one, and once more from the truth on. Each row has its standard error; one thread tells the processor time.

mod banded;
mod map_bound;
mod posterior;
mod secondary;
pub(crate) mod trial;

use crate::cost::measured;
use crate::statistics::{Estimate, mean};
use fixtures::failure::{Failure, Outcome};
use fixtures::pair::{PairCase, PairScan};
use map_bound::{MapBound, MapSetting};
use ndarray::Array2;
use std::fmt::Display;
use std::path::PathBuf;
use trial::{FitTrial, RADIUS_M};
use wakescope_estimate::vortex_fit::{
    CorePrior, FreeParameters, MapFit, PARAMETERS, Parameter, Powers, ScanModel, Sharing,
    SignalFit, Starts, Wake, WindFit,
};
use wakescope_signal::NoiseModel;

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The pair that is scanned.
    #[arg(long, value_enum, default_value_t = Case::Low)]
    case: Case,
    /// Number of scans.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    scans: u32,
    /// Signal-to-noise ratio in the detector band, dB.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    snr_db: f64,
    /// Seed of speckle and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Fit the signals with the true core radius, which is then not fitted.
    #[arg(long)]
    known_core: bool,
    /// Samples from one gate of the maps to the next.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=64))]
    gate_step: u16,
    /// Fit the maps only, which takes seconds instead of minutes.
    #[arg(long)]
    maps_only: bool,
    /// Fit no more maps than the signals need to start from: that with the core kept.
    #[arg(long, conflicts_with = "maps_only")]
    signals_only: bool,
    /// State how wide the likelihood of each scan is in the heights, beside the bound that holds its mean curvature.
    #[arg(long, conflicts_with = "maps_only")]
    widths: bool,
    /// Fit nothing: state what velocities of such maps could tell at best, alone and with the widths of their spectra.
    #[arg(long, conflicts_with_all = ["maps_only", "signals_only", "known_core", "widths"])]
    map_bound: bool,
    /// Radius of the regions of the maps, m.
    #[arg(long, default_value_t = RADIUS_M)]
    radius_m: f64,
    /// Of none of these pairs, but of pairs with secondary vortices and without, and of a simulated wake: which scans show such vortices, and how far
    /// fits with them and without are from the truth.
    #[arg(long, conflicts_with_all = ["maps_only", "signals_only", "known_core", "widths", "map_bound"])]
    secondary: bool,
    /// Folder of a simulated wake, which alone is scanned; without it also the stored one.
    #[arg(long, requires = "secondary")]
    wake: Option<PathBuf>,
    /// Ages of the simulated wake.
    #[arg(long, requires = "secondary", value_delimiter = ',', default_values_t = [1.0, 2.5, 4.0])]
    tau: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Case {
    /// 500 m^2/s, 47 m apart and high, cores of 2.35 m: that of the figures.
    Figures,
    /// 380 and 340 m^2/s, 40 m apart, cores of 3 m, 30 m high, 2 m/s of wind.
    Low,
    /// The same with cores of 0.8 m.
    SmallCores,
}

/// What is told of each fit.
const TOLD: [(&str, Parameter); 7] = [
    ("left circulation, m^2/s", Parameter::LeftCirculation),
    ("right circulation, m^2/s", Parameter::RightCirculation),
    ("left lateral, m", Parameter::LeftLateral),
    ("right lateral, m", Parameter::RightLateral),
    ("left height, m", Parameter::LeftHeight),
    ("right height, m", Parameter::RightHeight),
    ("core radius, m", Parameter::LeftCore),
];

/// Whose likelihood is looked at scan by scan.
const HEIGHTS: [(&str, Parameter); 2] = [
    ("left", Parameter::LeftHeight),
    ("right", Parameter::RightHeight),
];

/// Wake and covariance of a fit.
type Found = (Wake, Array2<f64>);

/// Fits of one kind over the scans: what was found, and how many failed; what they took.
#[derive(Default)]
struct Fits {
    name: &'static str,
    found: Vec<Found>,
    failures: usize,
    cpu_s: f64,
}

impl Fits {
    /// Keeps a fit, or tells why there is none.
    fn keep(&mut self, scan: usize, fit: Result<Found, impl Display>, cpu_s: f64) -> Option<Wake> {
        let found = fit
            .inspect_err(|error| println!("scan {scan}, {}: {error}", self.name))
            .ok();
        let wake = found.as_ref().map(|(wake, _)| *wake);
        self.failures += usize::from(wake.is_none());
        self.cpu_s += wake.map_or(0.0, |_| cpu_s);
        self.found.extend(found);
        wake
    }

    fn show(&self, truth: &Wake, bound: &[f64; PARAMETERS]) {
        let n = self.found.len() as f64;
        let (name, failures, each_s) = (self.name, self.failures, self.cpu_s / n);
        println!("{name}: {n} fits, {failures} failed, {each_s:.2} s of processor each");
        for (label, parameter) in TOLD {
            let place = parameter as usize;
            let errors: Vec<f64> = self
                .found
                .iter()
                .map(|(wake, _)| wake.to_array()[place] - truth.to_array()[place])
                .collect();
            let bias = Estimate::mean(&errors);
            let scatter = Estimate::deviation(&errors);
            let variances: Vec<f64> = self
                .found
                .iter()
                .map(|(_, covariance)| covariance[[place; 2]])
                .collect();
            println!(
                "  {label:<25} bias {:8.3} +- {:.3}, scatter {scatter:7.3} +- {:.3}, stated {:7.3}, bound {:.3}",
                bias.value,
                bias.standard_error,
                scatter / (2.0 * (n - 1.0)).sqrt(),
                mean(&variances, None).sqrt(),
                bound[place]
            );
        }
    }
}

/// What a map tells of the circulation at best, beside the bound of the signals.
fn show_map_bound(
    options: &Options,
    pair: &PairScan,
    truth: &Wake,
    circulation: Sharing,
) -> Outcome {
    let setup = pair.setup()?;
    let (snr, radius_m, range_m) = (pair.snr, options.radius_m, &pair.range_m);
    let setting = MapSetting {
        scan: &setup,
        sigma_s: pair.sigma_s(),
        snr,
        radius_m,
        range_m,
    };
    let (model, map) = (
        ScanModel::new(&setup, |_, _| pair.snr, truth)?,
        MapBound::new(&setting, truth)?,
    );
    let strongest = Parameter::LeftCirculation as usize;
    let show = |name: &str, deviation: f64| {
        println!(
            "  {name:<56} {deviation:6.2} m^2/s, {:.2} %",
            100.0 * deviation / truth.to_array()[strongest]
        );
    };
    for (name, core_radius) in [
        ("one core radius free", Sharing::Common),
        ("core known", Sharing::Fixed),
    ] {
        println!("left circulation, {name}:");
        let free = FreeParameters {
            circulation,
            core_radius,
            ..Default::default()
        };
        let bound = model.bound(truth, Powers::default(), &free, true)?;
        show(
            "all signals, Cramer-Rao bound",
            bound[[strongest; 2]].sqrt(),
        );
        let groups = FreeParameters {
            wind: WindFit::Linear,
            ..free
        }
        .groups();
        for (what, widths) in [("velocities", false), ("velocities and widths", true)] {
            let found = map.deviations(&groups, widths);
            let [best, by_variance] = found
                .ok_or_else(|| Failure::new("the covariance of the map is singular".into()))?;
            show(
                &format!("{what} of the map, weights of their covariance"),
                best,
            );
            show(
                &format!("{what} of the map, weights of their variances"),
                by_variance,
            );
        }
    }
    Ok(())
}

pub(crate) fn run(options: &Options) -> Outcome {
    if options.secondary {
        return secondary::run(options);
    }
    let (case, circulation) = match options.case {
        Case::Figures => (PairCase::FIGURES, Sharing::Common),
        Case::Low => (PairCase::LOW, Sharing::Separate),
        Case::SmallCores => (PairCase::SMALL_CORES, Sharing::Separate),
    };
    let truth = case.truth();
    let pair = PairScan::of(
        &case,
        NoiseModel::BandLimited,
        (200e-9, options.snr_db),
        options.gate_step.into(),
        options.seed,
    )?;
    if options.map_bound {
        return show_map_bound(options, &pair, &truth, circulation);
    }
    let free = |core_radius| FreeParameters {
        circulation,
        core_radius,
        ..Default::default()
    };
    let of_signals = free(if options.known_core {
        Sharing::Fixed
    } else {
        Sharing::Common
    });
    let model = ScanModel::new(&pair.setup()?, |_, _| pair.snr, &truth)?;
    let covariance = model.bound(&truth, Powers::default(), &of_signals, true)?;
    let bound: [f64; PARAMETERS] = std::array::from_fn(|i| covariance[[i, i]].sqrt());
    let of = |name| Fits {
        name,
        ..Default::default()
    };
    let mut maps = [
        "map, core kept",
        "map, core about the typical one",
        "map, core fitted freely",
    ]
    .map(of);
    let mut signals = ["signals", "signals, started at the truth"].map(of);
    let (mut below, mut widths) = (Vec::new(), HEIGHTS.map(|_| Vec::new()));
    for scan in 0..options.scans as usize {
        let trial = FitTrial::new(&pair, scan, options.radius_m)?;
        let mut guess = None;
        let cores = [
            (Sharing::Fixed, None),
            (Sharing::Common, Some(CorePrior::TYPICAL)),
            (Sharing::Common, None),
        ];
        for (fits, (core, prior)) in
            maps.iter_mut()
                .zip(cores)
                .take(if options.signals_only { 1 } else { 3 })
        {
            let (fit, cost) = measured(|| Ok(trial.map(free(core), prior)))?;
            let found = fit.map(
                |MapFit {
                     wake, covariance, ..
                 }| (wake, covariance),
            );
            let kept = fits.keep(scan, found, cost.cpu_s);
            guess = guess.or(kept);
        }
        let (false, Some(mut guess)) = (options.maps_only, guess) else {
            continue;
        };
        if options.known_core {
            (guess.left.core_radius_m, guess.right.core_radius_m) =
                (case.core_radius_m, case.core_radius_m);
        }
        let mut fit = |place: usize, guess: &Wake, starts| -> Result<Option<SignalFit>, Failure> {
            let (fit, cost) = measured(|| Ok(trial.signals(of_signals, guess, starts)))?;
            signals[place].keep(
                scan,
                fit.as_ref().map(|fit| (fit.wake, fit.covariance.clone())),
                cost.cpu_s,
            );
            Ok(fit.ok())
        };
        let (Some(found), at_truth) = (
            fit(0, &guess, Starts::Several)?,
            fit(1, &truth, Starts::Guess)?,
        ) else {
            continue;
        };
        for (widths, (_, height)) in widths.iter_mut().zip(HEIGHTS).filter(|_| options.widths) {
            widths.extend(trial.width(
                &model,
                &found,
                height as usize,
                (&covariance, &of_signals.groups()),
            )?);
        }
        if let Some(at_truth) = at_truth {
            let less = at_truth.log_likelihood - found.log_likelihood;
            let tops: Vec<f64> = found
                .tops
                .iter()
                .map(|top| -0.5 * top.chi2 - found.log_likelihood)
                .collect();
            println!(
                "scan {scan}: ln p {less:+.2} below that of the start at the truth; tops {tops:.2?}"
            );
            below.push(less);
        }
    }
    maps.iter()
        .chain(&signals)
        .filter(|fits| fits.found.len() > 1)
        .for_each(|fits| fits.show(&truth, &bound));
    for (widths, (name, height)) in widths
        .iter()
        .zip(HEIGHTS)
        .filter(|(widths, _)| widths.len() > 1)
    {
        let mut over: Vec<f64> = widths
            .iter()
            .map(|width| width / bound[height as usize])
            .collect();
        over.sort_by(f64::total_cmp);
        let square = Estimate::mean(&over.iter().map(|o| o * o).collect::<Vec<_>>());
        let (root, error) = (
            square.value.sqrt(),
            0.5 * square.standard_error / square.value.sqrt(),
        );
        let (least, most) = (over[0], over[over.len() - 1]);
        println!(
            "posterior of the {name} height: {root:.2} +- {error:.2} of the bound, from {least:.2} to {most:.2} by scan"
        );
    }
    if let Some(most) = below.iter().copied().max_by(f64::total_cmp) {
        let lower = below.iter().filter(|less| **less > 0.1).count();
        println!(
            "{lower} of {} fits of signals end on a top lower by 0.1 or more; the most is {most:.2}",
            below.len()
        );
    }
    Ok(())
}
