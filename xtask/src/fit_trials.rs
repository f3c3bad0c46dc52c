//! `cargo xtask fit-trials`: fits to many scans of a pair against the truth, their bound and a start at the truth.
//!
//! Every scan is fitted from its map on: the map with the core kept at the typical one, about it and free, then all signals with one core radius
//! fitted or the true one, and once more from the truth on. Each row has its standard error; one thread tells the processor time.

use crate::cost::measured;
use crate::trials::fits::{FitTrial, RADIUS_M};
use crate::trials::map_bound::{MapBound, MapSetting};
use fixtures::WINDOW;
use fixtures::failure::{Failure, Outcome};
use fixtures::pair::{PairCase, PairScan};
use ndarray::Array2;
use wakescope_estimate::Error;
use wakescope_estimate::vortex_fit::{
    CorePrior, FreeParameters, MapFit, PARAMETERS, Parameter, Powers, ScanModel, Sharing, SignalFit, Starts, Wake,
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
const HEIGHTS: [Parameter; 2] = [Parameter::LeftHeight, Parameter::RightHeight];

/// Fits of one kind over the scans.
#[derive(Default)]
struct Fits {
    name: &'static str,
    /// Wake and standard deviations.
    found: Vec<(Wake, [f64; PARAMETERS])>,
    failures: Vec<String>,
    cpu_s: f64,
}

impl Fits {
    fn of(name: &'static str) -> Self {
        Self { name, ..Default::default() }
    }

    /// Keeps a fit, of which `read` tells wake and covariance, or why there is none.
    fn keep<F>(
        &mut self,
        scan: usize,
        (fit, cpu_s): (Result<F, Error>, f64),
        read: impl Fn(&F) -> (Wake, &Array2<f64>),
    ) -> Option<F> {
        match &fit {
            Ok(fit) => {
                let (wake, covariance) = read(fit);
                self.found.push((wake, std::array::from_fn(|i| covariance[[i, i]].sqrt())));
                self.cpu_s += cpu_s;
            }
            Err(error) => self.failures.push(format!("scan {scan}: {error}")),
        }
        fit.ok()
    }

    fn show(&self, truth: &Wake, bound: &[f64; PARAMETERS]) {
        let n = self.found.len() as f64;
        println!(
            "{}: {} fits, {} failed, {:.2} s of processor each",
            self.name,
            self.found.len(),
            self.failures.len(),
            self.cpu_s / n
        );
        self.failures.iter().for_each(|why| println!("  {why}"));
        for (label, parameter) in TOLD {
            let place = parameter as usize;
            let errors: Vec<f64> =
                self.found.iter().map(|(w, _)| w.to_array()[place] - truth.to_array()[place]).collect();
            let mean = errors.iter().sum::<f64>() / n;
            let scatter = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
            let stated = (self.found.iter().map(|(_, s)| s[place].powi(2)).sum::<f64>() / n).sqrt();
            println!(
                "  {label:<25} bias {mean:8.3} +- {:.3}, scatter {scatter:7.3} +- {:.3}, stated {stated:7.3}, bound {:.3}",
                scatter / n.sqrt(),
                scatter / (2.0 * (n - 1.0)).sqrt(),
                bound[place]
            );
        }
    }
}

/// What a map tells of the circulation at best, beside the bound of the signals.
fn show_map_bound(options: &Options, pair: &PairScan, truth: &Wake, circulation: Sharing) -> Outcome {
    let setup = pair.setup()?;
    let setting = MapSetting {
        model: setup.wake,
        sampling: pair.sampling,
        window: WINDOW,
        sigma_s: pair.sigma_s(),
        snr: pair.snr,
        noise: setup.noise,
        radius_m: options.radius_m,
        elevation_rad: &pair.elevation_rad,
        range_m: &pair.range_m,
    };
    let (model, map) = (ScanModel::new(&setup, |_, _| pair.snr, truth)?, MapBound::new(&setting, truth)?);
    let strongest = Parameter::LeftCirculation as usize;
    let truth_m2_s = truth.to_array()[strongest];
    let show = |name: &str, deviation: f64| {
        println!("  {name:<56} {deviation:6.2} m^2/s, {:.2} %", 100.0 * deviation / truth_m2_s);
    };
    for (name, core_radius) in [("one core radius free", Sharing::Common), ("core known", Sharing::Fixed)] {
        println!("left circulation, {name}:");
        let free = FreeParameters { circulation, core_radius, ..Default::default() };
        let bound = model.bound(truth, Powers::default(), &free, true)?;
        show("all signals, Cramer-Rao bound", bound[[strongest; 2]].sqrt());
        let groups = groups(circulation, core_radius);
        for (what, widths) in [("velocities", false), ("velocities and widths", true)] {
            let found = map.deviations(&groups, widths).ok_or_else(|| {
                Failure::new("a free number does not show in the map, or its covariance is singular".to_owned())
            })?;
            show(&format!("{what} of the map, weights of their covariance"), found.best[0]);
            show(&format!("{what} of the map, weights of their variances"), found.by_variance[0]);
        }
    }
    Ok(())
}

/// Places of the parameters that each free number moves, circulations first.
fn groups(circulation: Sharing, core_radius: Sharing) -> Vec<Vec<usize>> {
    let shared = |a: Parameter, b: Parameter, sharing| match sharing {
        Sharing::Common => vec![vec![a as usize, b as usize]],
        Sharing::Separate => vec![vec![a as usize], vec![b as usize]],
        Sharing::Fixed => Vec::new(),
    };
    let mut groups = shared(Parameter::LeftCirculation, Parameter::RightCirculation, circulation);
    groups.extend(shared(Parameter::LeftCore, Parameter::RightCore, core_radius));
    let alone = [
        Parameter::LeftLateral,
        Parameter::LeftHeight,
        Parameter::RightLateral,
        Parameter::RightHeight,
        Parameter::Wind,
        Parameter::Shear,
    ];
    groups.extend(alone.map(|parameter| vec![parameter as usize]));
    groups
}

pub(crate) fn run(options: &Options) -> Outcome {
    let (case, circulation) = match options.case {
        Case::Figures => (PairCase::FIGURES, Sharing::Common),
        Case::Low => (PairCase::LOW, Sharing::Separate),
        Case::SmallCores => (PairCase::SMALL_CORES, Sharing::Separate),
    };
    let truth = case.truth();
    let pair =
        PairScan::of(&case, NoiseModel::BandLimited, (200e-9, options.snr_db), options.gate_step.into(), options.seed)?;
    if options.map_bound {
        return show_map_bound(options, &pair, &truth, circulation);
    }
    let free = |core_radius| FreeParameters { circulation, core_radius, ..Default::default() };
    let of_signals = free(if options.known_core { Sharing::Fixed } else { Sharing::Common });
    let model = ScanModel::new(&pair.setup()?, |_, _| pair.snr, &truth)?;
    let covariance = model.bound(&truth, Powers::default(), &of_signals, true)?;
    let bound: [f64; PARAMETERS] = std::array::from_fn(|i| covariance[[i, i]].sqrt());
    let mut maps =
        [Fits::of("map, core kept"), Fits::of("map, core about the typical one"), Fits::of("map, core fitted freely")];
    let mut signals = [Fits::of("signals"), Fits::of("signals, started at the truth")];
    let mut below = Vec::new();
    let mut widths = HEIGHTS.map(|_| Vec::new());
    let groups = groups(circulation, if options.known_core { Sharing::Fixed } else { Sharing::Common });
    for scan in 0..options.scans as usize {
        let trial = FitTrial::new(&pair, scan, options.radius_m)?;
        let mut guess = None;
        let cores = [(Sharing::Fixed, None), (Sharing::Common, Some(CorePrior::TYPICAL)), (Sharing::Common, None)];
        for (fits, (core, prior)) in maps.iter_mut().zip(cores).take(if options.signals_only { 1 } else { 3 }) {
            let (fit, cost) = measured(|| trial.map(free(core), prior))?;
            let kept = fits.keep(scan, (fit, cost.cpu_s), |fit: &MapFit| (fit.wake, &fit.covariance));
            guess = guess.or(kept.map(|fit| fit.wake));
        }
        let (false, Some(mut guess)) = (options.maps_only, guess) else { continue };
        if options.known_core {
            (guess.left.core_radius_m, guess.right.core_radius_m) =
                (truth.left.core_radius_m, truth.right.core_radius_m);
        }
        let mut fit = |place: usize, guess: &Wake, starts| -> Result<Option<SignalFit>, Failure> {
            let (fit, cost) = measured(|| trial.signals(of_signals, guess, starts))?;
            Ok(signals[place].keep(scan, (fit, cost.cpu_s), |fit: &SignalFit| (fit.wake, &fit.covariance)))
        };
        let (found, at_truth) = (fit(0, &guess, Starts::Several)?, fit(1, &truth, Starts::Guess)?);
        if let (true, Some(found)) = (options.widths, &found) {
            for (widths, parameter) in widths.iter_mut().zip(HEIGHTS) {
                widths.extend(trial.width(&model, found, parameter as usize, (&covariance, &groups))?);
            }
        }
        if let (Some(found), Some(at_truth)) = (found, at_truth) {
            let less = at_truth.log_likelihood - found.log_likelihood;
            let off = |place: usize| (found.wake.to_array()[place] - truth.to_array()[place]) / bound[place];
            let fitted = TOLD.iter().filter(|told| bound[told.1 as usize] > 0.0);
            let worst = fitted.max_by(|a, b| off(a.1 as usize).abs().total_cmp(&off(b.1 as usize).abs()));
            println!(
                "scan {scan}: ln p {less:+.2} below that of the start at the truth; tops {:.2?}; {} off by {:+.1} bounds",
                found.tops.iter().map(|top| top.log_likelihood - found.log_likelihood).collect::<Vec<_>>(),
                worst.map_or("nothing", |told| told.0),
                worst.map_or(0.0, |told| off(told.1 as usize)),
            );
            below.push(less);
        }
    }
    maps.iter().chain(&signals).filter(|fits| fits.found.len() > 1).for_each(|fits| fits.show(&truth, &bound));
    for ((name, widths), parameter) in ["left", "right"].into_iter().zip(&widths).zip(HEIGHTS) {
        let n = widths.len() as f64;
        let over: Vec<f64> = widths.iter().map(|width| width / bound[parameter as usize]).collect();
        let squares: Vec<f64> = over.iter().map(|o| o * o).collect();
        let mean = squares.iter().sum::<f64>() / n;
        let error = (squares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        if n > 1.0 {
            println!(
                "posterior of the {name} height: {:.2} +- {:.2} of the bound, from {:.2} to {:.2} by scan",
                mean.sqrt(),
                0.5 * error / mean.sqrt(),
                over.iter().copied().fold(f64::INFINITY, f64::min),
                over.iter().copied().fold(0.0, f64::max),
            );
        }
    }
    if !below.is_empty() {
        let lower = below.iter().filter(|less| **less > 0.1).count();
        let most = below.iter().fold(f64::NEG_INFINITY, |most, less| most.max(*less));
        println!("{lower} of {} fits of signals end on a top lower by 0.1 or more; the most is {most:.2}", below.len());
    }
    Ok(())
}
