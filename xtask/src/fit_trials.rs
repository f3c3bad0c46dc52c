//! `cargo xtask fit-trials`: fits to many scans of a pair against the truth, their bound and a start at the truth.
//!
//! Every scan is fitted from its map on: the map with the core radius fixed at the typical one, with
//! a prior about it, and free; then all signals with one core radius fitted, and once more started
//! at the truth. Each row has its standard error; processor times are those of all threads.

mod secondary;
pub(crate) mod trial;

use crate::cost::measured;
use crate::statistics::{Estimate, mean};
use fixtures::failure::{Failure, Outcome};
use fixtures::pair::{PairCase, PairScan};
use ndarray::Array2;
use std::fmt::Display;
use std::path::PathBuf;
use trial::FitTrial;
use wakescope_estimate::vortex_fit::{
    CorePrior, FreeParameters, PARAMETERS, Parameter, Powers, ScanModel, Sharing, SignalFit,
    SignalFitOptions, Wake,
};
use wakescope_signal::NoiseModel;

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct FitTrialsArgs {
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
    /// Fit the maps only, which needs seconds instead of minutes.
    #[arg(long)]
    maps_only: bool,
    /// Fit scans with and without secondary vortices instead of scans of a pair.
    #[arg(long, conflicts_with = "maps_only")]
    secondary: bool,
    /// Folder of a simulated wake to scan; by default the stored one and synthetic pairs.
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

impl Case {
    fn pair(self) -> PairCase {
        match self {
            Self::Figures => PairCase::FIGURES,
            Self::Low => PairCase::LOW,
            Self::SmallCores => PairCase::SMALL_CORES,
        }
    }

    /// Whether fits have one circulation for both vortices.
    fn circulation(self) -> Sharing {
        match self {
            Self::Figures => Sharing::Common,
            Self::Low | Self::SmallCores => Sharing::Separate,
        }
    }
}

/// Duration of the pulses, full width at half maximum \[s\].
const PULSE_S: f64 = 200e-9;

/// Samples from one gate of the maps to the next.
const GATE_STEP: usize = 8;

/// Parameters that are reported for each kind of fit.
const REPORTED: [(&str, Parameter); 7] = [
    ("left circulation, m^2/s", Parameter::LeftCirculation),
    ("right circulation, m^2/s", Parameter::RightCirculation),
    ("left lateral, m", Parameter::LeftLateral),
    ("right lateral, m", Parameter::RightLateral),
    ("left height, m", Parameter::LeftHeight),
    ("right height, m", Parameter::RightHeight),
    ("core radius, m", Parameter::LeftCore),
];

/// A fit of the signals whose likelihood is lower than that of a start at the truth by this is counted.
const LOWER: f64 = 0.1;

/// Fits of one kind over the scans.
struct Fits {
    name: &'static str,
    wakes: Vec<Wake>,
    covariances: Vec<Array2<f64>>,
    failures: usize,
    cpu_s: f64,
}

impl Fits {
    fn new(name: &'static str) -> Self {
        Self {
            name,
            wakes: Vec::new(),
            covariances: Vec::new(),
            failures: 0,
            cpu_s: 0.0,
        }
    }

    /// Retains a fit.
    fn add(&mut self, wake: Wake, covariance: &Array2<f64>, cpu_s: f64) {
        self.wakes.push(wake);
        self.covariances.push(covariance.clone());
        self.cpu_s += cpu_s;
    }

    /// Counts a fit that failed and prints why it did.
    fn add_failure(&mut self, scan: usize, error: &impl Display) {
        println!("scan {scan}, {}: {error}", self.name);
        self.failures += 1;
    }

    /// Prints bias, scatter, reported standard deviation and bound of each parameter.
    fn print(&self, truth: &Wake, bound: &[f64; PARAMETERS]) {
        let n = self.wakes.len() as f64;
        println!(
            "{}: {n} fits, {} failed, {:.2} s of processor each",
            self.name,
            self.failures,
            self.cpu_s / n
        );
        let truth = truth.to_array();
        for (label, parameter) in REPORTED {
            let index = parameter as usize;
            let mut errors = Vec::new();
            for wake in &self.wakes {
                errors.push(wake.to_array()[index] - truth[index]);
            }
            let mut variances = Vec::new();
            for covariance in &self.covariances {
                variances.push(covariance[[index, index]]);
            }
            let bias = Estimate::mean(&errors);
            let scatter = Estimate::deviation(&errors);
            println!(
                "  {label:<25} bias {:8.3} +- {:.3}, scatter {scatter:7.3} +- {:.3}, reported {:7.3}, bound {:.3}",
                bias.value,
                bias.standard_error,
                scatter / (2.0 * (n - 1.0)).sqrt(),
                mean(&variances, None).sqrt(),
                bound[index]
            );
        }
    }
}

/// Fits of all kinds.
struct Trials {
    case: PairCase,
    circulation: Sharing,
    map_core_fixed: Fits,
    map_core_prior: Fits,
    map_core_free: Fits,
    signals: Fits,
    signals_from_truth: Fits,
    /// ln p of fits of the signals below that of the same fit started at the truth.
    deficits: Vec<f64>,
}

impl Trials {
    fn new(case: Case) -> Self {
        Self {
            case: case.pair(),
            circulation: case.circulation(),
            map_core_fixed: Fits::new("map, core fixed"),
            map_core_prior: Fits::new("map, core about the typical one"),
            map_core_free: Fits::new("map, core free"),
            signals: Fits::new("signals"),
            signals_from_truth: Fits::new("signals, started at the truth"),
            deficits: Vec::new(),
        }
    }

    fn free(&self, core_radius: Sharing) -> FreeParameters {
        FreeParameters {
            circulation: self.circulation,
            core_radius,
            ..FreeParameters::default()
        }
    }

    /// Fits the map of a scan three times; returns the first wake found, from which fits of the signals start.
    fn fit_maps(&mut self, trial: &FitTrial, scan: usize) -> Result<Option<Wake>, Failure> {
        let fixed = self.free(Sharing::Fixed);
        let common = self.free(Sharing::Common);
        let kinds = [
            (&mut self.map_core_fixed, fixed, None),
            (&mut self.map_core_prior, common, Some(CorePrior::TYPICAL)),
            (&mut self.map_core_free, common, None),
        ];
        let mut guess = None;
        for (fits, free, prior) in kinds {
            let (fit, cost) = measured(|| Ok(trial.map(free, prior)))?;
            match fit {
                Ok(fit) => {
                    fits.add(fit.wake, &fit.covariance, cost.cpu_s);
                    guess = guess.or(Some(fit.wake));
                }
                Err(error) => fits.add_failure(scan, &error),
            }
        }
        Ok(guess)
    }

    /// Fits the signals of a scan from a guess and from the truth, and compares the likelihoods.
    fn fit_signals(&mut self, trial: &FitTrial, scan: usize, guess: &Wake) -> Outcome {
        let options = SignalFitOptions {
            free: self.free(Sharing::Common),
            ..Default::default()
        };
        let truth = self.case.truth();
        let fit = fit_signals(&mut self.signals, scan, || trial.signals(guess, &options))?;
        let alone = SignalFitOptions {
            several_starts: false,
            ..options
        };
        let from_truth = fit_signals(&mut self.signals_from_truth, scan, || {
            trial.signals(&truth, &alone)
        })?;
        let (Some(fit), Some(from_truth)) = (fit, from_truth) else {
            return Ok(());
        };
        let deficit = from_truth.log_likelihood - fit.log_likelihood;
        let mut maxima = Vec::new();
        for top in &fit.tops {
            maxima.push(-0.5 * top.chi2 - fit.log_likelihood);
        }
        println!(
            "scan {scan}: ln p {deficit:+.2} below that of the start at the truth; other maxima {maxima:.2?}"
        );
        self.deficits.push(deficit);
        Ok(())
    }

    fn print(&self, bound: &[f64; PARAMETERS]) {
        let kinds = [
            &self.map_core_fixed,
            &self.map_core_prior,
            &self.map_core_free,
            &self.signals,
            &self.signals_from_truth,
        ];
        for fits in kinds {
            if fits.wakes.len() > 1 {
                fits.print(&self.case.truth(), bound);
            }
        }
        let Some(largest) = self.deficits.iter().copied().max_by(f64::total_cmp) else {
            return;
        };
        let lower = self.deficits.iter().filter(|d| **d > LOWER).count();
        println!(
            "{lower} of {} fits of signals converge to a maximum lower by {LOWER} or more; the most is {largest:.2}",
            self.deficits.len()
        );
    }
}

/// Fits signals once and adds the fit to those of its kind.
fn fit_signals(
    fits: &mut Fits,
    scan: usize,
    fit: impl FnOnce() -> Result<SignalFit, wakescope_estimate::Error>,
) -> Result<Option<SignalFit>, Failure> {
    let (fit, cost) = measured(|| Ok(fit()))?;
    match fit {
        Ok(fit) => {
            fits.add(fit.wake, &fit.covariance, cost.cpu_s);
            Ok(Some(fit))
        }
        Err(error) => {
            fits.add_failure(scan, &error);
            Ok(None)
        }
    }
}

/// Cramer-Rao bound of each parameter, one core radius fitted.
fn bound_of_signals(
    pair: &PairScan,
    truth: &Wake,
    free: &FreeParameters,
) -> Result<[f64; PARAMETERS], Failure> {
    let model = ScanModel::new(&pair.setup()?, |_, _| pair.snr, truth)?;
    let covariance = model.bound(truth, Powers::default(), free, true)?;
    Ok(std::array::from_fn(|i| covariance[[i, i]].sqrt()))
}

pub(crate) fn run(args: &FitTrialsArgs) -> Outcome {
    if args.secondary {
        return secondary::run(args);
    }
    let mut trials = Trials::new(args.case);
    let pair = PairScan::of(
        &trials.case,
        NoiseModel::BandLimited,
        PULSE_S,
        args.snr_db,
        GATE_STEP,
        args.seed,
    )?;
    for scan in 0..args.scans as usize {
        let trial = FitTrial::new(&pair, scan)?;
        let guess = trials.fit_maps(&trial, scan)?;
        if let Some(guess) = guess.filter(|_| !args.maps_only) {
            trials.fit_signals(&trial, scan, &guess)?;
        }
    }
    let free = trials.free(Sharing::Common);
    let bound = bound_of_signals(&pair, &trials.case.truth(), &free)?;
    trials.print(&bound);
    Ok(())
}
