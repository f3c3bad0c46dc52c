//! Figure 17: circulation and positions of the vortices, retrieved from maps and from all raw signals, against the truth.

use super::context::*;
use super::fig17_flows as flows;
use crate::fit_trials::trial::{FitTrial, RADIUS_M};
use crate::statistics::mean;
use fixtures::pair::{CIRCULATION_M2_S, PairScan, truth};
use rayon::prelude::*;
use wakescope_estimate::retrieval::Side;
use wakescope_estimate::vortex_fit::{
    CorePrior, FreeParameters, Parameter, Powers, ScanModel, Sharing, SignalFitOptions, Wake,
};
use wakescope_signal::NoiseModel;
use wakescope_sim::retrieve::name;

const METHODS: [&str; 4] = [
    "map, typical core",
    "map, core fitted",
    "signals, core known",
    "signals, core fitted",
];

/// A fitted wake with its covariance.
type Found = (Wake, Array2<f64>);

/// Fits of one scan; nothing where one failed.
struct Fits {
    snr_db: f64,
    scan: usize,
    /// In the order of [`METHODS`]; the signals, which take longest, are fitted for the first scans alone.
    by_method: Vec<Option<Found>>,
}

impl Fits {
    /// Value and standard deviation of a parameter by a method; NaN where the fit failed.
    fn parameter(&self, method: usize, parameter: Parameter) -> (f64, f64) {
        let index = parameter as usize;
        match self.by_method.get(method) {
            Some(Some((wake, covariance))) => {
                (wake.to_array()[index], covariance[[index; 2]].sqrt())
            }
            _ => (f64::NAN, f64::NAN),
        }
    }
}

/// One circulation and one core radius for both vortices.
fn free() -> FreeParameters {
    FreeParameters {
        core_radius: Sharing::Common,
        ..FreeParameters::common_circulation()
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    // Eight scans decide the claims on maps; of gates every 8 samples, which overlap, every third is
    // taken in quick. Fits of signals need the longest run time: the few that quick could make
    // decide no claim on their scatter.
    let scans = context.profile.choose(BATCHES, 48, 100);
    let scans_of_signals = context.profile.choose(0, 12, 100);
    let gate_step = context.profile.choose(24, 8, 8);
    let levels_db = context
        .profile
        .choose(vec![0.0], vec![0.0], vec![0.0, 10.0]);
    let mut fits = Vec::new();
    let mut bounds = Vec::new();
    for &snr_db in &levels_db {
        let noise = NoiseModel::BandLimited;
        let pair = PairScan::new(noise, 200e-9, snr_db, gate_step, context.seed)?;
        bounds.push(bounds_m2_s(&pair)?);
        fits.extend(fits_of(&pair, snr_db, scans, scans_of_signals)?);
    }
    let parameters = format!(
        "profile = \"{}\"\nscans = {scans}\nscans_of_signals = {scans_of_signals}\ngate_step_samples = {gate_step}\nsnr_db = {levels_db:?}\n",
        context.profile.name()
    );
    let origin = context.provenance_of_formula(&parameters);
    let by_flow = flows::all(context)?;
    let first: Vec<&Fits> = fits.iter().filter(|f| f.snr_db == levels_db[0]).collect();
    let mut panels = pictures(&first);
    panels.push(flows::picture(&by_flow));
    let tables = Table::stack(vec![table(&fits), flows::table(&by_flow)])?;
    let mut out = Rendered::new(&tables, &Figure::stacked(panels), &origin)?;
    let of_signals = match scans_of_signals {
        0 => "no".into(),
        scans => scans.to_string(),
    };
    out.values = vec![RADIUS_M.to_string(), of_signals];
    out.claims = claims(&first, bounds[0]);
    out.claims.extend(flows::claims(&by_flow));
    Ok(out)
}

/// The fits of all scans, of the signals for the first ones alone.
fn fits_of(
    pair: &PairScan,
    snr_db: f64,
    scans: usize,
    scans_of_signals: usize,
) -> Result<Vec<Fits>, Failure> {
    (0..scans)
        .into_par_iter()
        .map(|scan| {
            let trial = FitTrial::new(pair, scan)?;
            let mut by_method = fit_map(&trial);
            if scan < scans_of_signals {
                let signals = fit_signals(&trial, by_method[0].as_ref());
                by_method.extend(signals);
            }
            Ok(Fits {
                snr_db,
                scan,
                by_method,
            })
        })
        .collect()
}

/// The fits of the map of one scan.
fn fit_map(trial: &FitTrial) -> Vec<Option<Found>> {
    let mut fits = Vec::new();
    for core_radius in [Sharing::Fixed, Sharing::Common] {
        let free = FreeParameters {
            core_radius,
            ..free()
        };
        let fit = trial.map(free, Some(CorePrior::TYPICAL)).ok();
        fits.push(fit.map(|fit| (fit.wake, fit.covariance)));
    }
    fits
}

/// The fits of the signals of one scan, started from a fit of its map.
fn fit_signals(trial: &FitTrial, start: Option<&Found>) -> [Option<Found>; 2] {
    [Sharing::Fixed, Sharing::Common].map(|core_radius| {
        let mut guess = start?.0;
        if core_radius == Sharing::Fixed {
            guess.left.core_radius_m = truth().left.core_radius_m;
            guess.right.core_radius_m = truth().right.core_radius_m;
        }
        let free = FreeParameters {
            core_radius,
            ..free()
        };
        let options = SignalFitOptions {
            free,
            ..Default::default()
        };
        let fit = trial.signals(&guess, &options).ok()?;
        Some((fit.wake, fit.covariance))
    })
}

/// Bounds on the common circulation \[m^2/s\] with the core known and with the core fitted.
fn bounds_m2_s(pair: &PairScan) -> Result<[f64; 2], Failure> {
    let model = ScanModel::new(&pair.setup()?, |_, _| pair.snr, &truth())?;
    Ok([
        bound_m2_s(&model, Sharing::Fixed)?,
        bound_m2_s(&model, Sharing::Common)?,
    ])
}

fn bound_m2_s(model: &ScanModel, core_radius: Sharing) -> Result<f64, Failure> {
    let free = FreeParameters {
        core_radius,
        ..free()
    };
    let covariance = model.bound(&truth(), Powers::default(), &free, true)?;
    Ok(covariance[[Parameter::LeftCirculation as usize; 2]].sqrt())
}

/// One row for each vortex of each fit; errors of the lateral position and of the height.
fn table(fits: &[Fits]) -> Table {
    let true_wake = truth().to_array();
    let mut scan = Vec::new();
    let mut snr_db = Vec::new();
    let mut methods = Vec::new();
    let mut vortices = Vec::new();
    let mut gamma = Vec::new();
    let mut y = Vec::new();
    let mut z = Vec::new();
    for fits in fits {
        for (method, method_name) in METHODS.iter().enumerate().take(fits.by_method.len()) {
            for vortex in [Side::Left, Side::Right] {
                scan.push(fits.scan as i64);
                snr_db.push(fits.snr_db);
                methods.push(*method_name);
                vortices.push(name(vortex));
                let [circulation, lateral, height, _] = vortex.parameters();
                gamma.push(fits.parameter(method, circulation));
                let (lateral_m, std_m) = fits.parameter(method, lateral);
                y.push((lateral_m - true_wake[lateral as usize], std_m));
                let (height_m, std_m) = fits.parameter(method, height);
                z.push((height_m - true_wake[height as usize], std_m));
            }
        }
    }
    Table::new()
        .text("flow", column(&scan, |_| "analytic pair"))
        .int("scan", scan)
        .text("method", methods)
        .float("gamma_true_m2_s", column(&gamma, |_| CIRCULATION_M2_S))
        .float("gamma_m2_s", column(&gamma, |g| g.0))
        .float("gamma_std_m2_s", column(&gamma, |g| g.1))
        .float("y_error_m", column(&y, |y| y.0))
        .float("z_error_m", column(&z, |z| z.0))
        .text("vortex", vortices)
        .float("y_std_m", column(&y, |y| y.1))
        .float("z_std_m", column(&z, |z| z.1))
        .float("snr_db", snr_db)
}

fn pictures(fits: &[&Fits]) -> Vec<CurvePlot> {
    let circulation = picture(
        fits,
        "circulation",
        "Γ [m^{2}/s]",
        Parameter::LeftCirculation,
    );
    let lateral = picture(
        fits,
        "left vortex, lateral",
        "y [m]",
        Parameter::LeftLateral,
    );
    let height = picture(fits, "left vortex, height", "z [m]", Parameter::LeftHeight);
    vec![circulation, lateral, height]
}

/// A parameter scan by scan.
fn picture(fits: &[&Fits], title: &str, label: &str, parameter: Parameter) -> CurvePlot {
    let mut plot = CurvePlot::new(title, Axis::linear("scan"), Axis::linear(label));
    for (k, method) in METHODS.into_iter().enumerate() {
        let mut points = Vec::new();
        for fits in fits {
            if k < fits.by_method.len() {
                let (value, std) = fits.parameter(k, parameter);
                let x = fits.scan as f64 + 0.12 * (k as f64 - 1.5);
                points.push((x, Estimate::stated(value, std)));
            }
        }
        if !points.is_empty() {
            plot = plot.with(banded(method, Style::Markers, points).in_colour(k));
        }
    }
    let exact = truth().to_array()[parameter as usize];
    let ends = [(-0.5, exact), (fits.len() as f64 - 0.5, exact)];
    plot.with(Series::new("", Style::Dash, ends).in_colour(6))
}

/// Errors of the circulation of the fits that converged, m^2/s.
fn errors(fits: &[&Fits], method: usize) -> Vec<f64> {
    let mut errors = Vec::new();
    for fits in fits {
        let (value, _) = fits.parameter(method, Parameter::LeftCirculation);
        let error = value - CIRCULATION_M2_S;
        if error.is_finite() {
            errors.push(error);
        }
    }
    errors
}

/// Root of the mean square of some numbers about a value, each scan a batch.
fn root_mean_square(numbers: &[f64], about: impl Fn(Option<usize>) -> f64) -> Estimate {
    Estimate::of(numbers.len(), |without| {
        let squares: Vec<f64> = numbers
            .iter()
            .map(|x| (x - about(without)).powi(2))
            .collect();
        mean(&squares, without).sqrt()
    })
}

/// Root mean square of errors of the circulation, in per cent of it.
fn rms_percent(errors_m2_s: &[f64]) -> Estimate {
    root_mean_square(errors_m2_s, |_| 0.0).times(100.0 / CIRCULATION_M2_S)
}

/// Standard deviation of some numbers: of n numbers about their own mean n - 1 are free.
fn deviation(numbers: &[f64]) -> Estimate {
    let n = numbers.len() as f64;
    let about_mean = root_mean_square(numbers, |without| mean(numbers, without));
    about_mean.times((n / (n - 1.0)).sqrt())
}

fn claims(fits: &[&Fits], [core_known_m2_s, core_fitted_m2_s]: [f64; 2]) -> Vec<Claim> {
    let map = errors(fits, 0);
    let resolved = errors(fits, 1);
    let known = errors(fits, 2);
    let fitted = errors(fits, 3);
    let done = map.len() + resolved.len() + known.len() + fitted.len();
    let tried: usize = fits.iter().map(|f| f.by_method.len()).sum();
    let rms = Bar::Below(5.0);
    let over_bound = Bar::Below(1.5);
    let known_over_bound = deviation(&known).times(core_known_m2_s.recip());
    let fitted_over_bound = deviation(&fitted).times(core_fitted_m2_s.recip());
    let bias = Estimate::mean(&fitted);
    let bias = Estimate {
        value: bias.value.abs(),
        ..bias
    };
    let mut claims = vec![
        Claim::judged_alone("F17a", rms_percent(&map), " %", rms),
        Claim::judged_alone("F17f", rms_percent(&resolved), " %", rms),
        Claim::exact("F17e", format!("{done} fits"), done == tried)
            .expecting(format!("{tried} fits")),
    ];
    let of_signals = [
        Claim::judged_alone("F17b", known_over_bound, "", over_bound),
        Claim::judged_alone("F17c", fitted_over_bound, "", over_bound),
        Claim::judged_alone("F17d", bias, " m²/s", Bar::Below(2.0)),
    ];
    for claim in of_signals {
        claims.push(if known.is_empty() {
            claim.open("profile full, which fits the signals of 100 scans")
        } else {
            claim
        });
    }
    claims
}
