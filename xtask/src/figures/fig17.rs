//! Figure 17: circulation and positions of the vortices, retrieved from maps and from all raw signals, against the truth.

use super::context::*;
use super::fig17_flows as flows;
use crate::fit_trials::trial::{FitTrial, RADIUS_M};
use crate::statistics::mean;
use fixtures::pair::{CIRCULATION_M2_S, PairScan, truth};
use rayon::prelude::*;
use wakescope_estimate::retrieval::Side;
use wakescope_estimate::vortex_fit::{
    CorePrior, FreeParameters, Parameter, Powers, ScanModel, Sharing, Starts, Wake,
};
use wakescope_signal::NoiseModel;
use wakescope_sim::retrieve::name;

const METHODS: [&str; 4] = [
    "map, typical core",
    "map, core fitted",
    "signals, core known",
    "signals, core fitted",
];

/// A fitted wake with its covariance; nothing where a fit failed.
type Found = Option<(Wake, Array2<f64>)>;

struct Fits {
    snr_db: f64,
    scan: usize,
    /// In the order of [`METHODS`]; the signals, which take longest, are fitted for the first scans alone.
    by_method: Vec<Found>,
}

/// One circulation and one core radius for both vortices.
fn free() -> FreeParameters {
    FreeParameters {
        core_radius: Sharing::Common,
        ..FreeParameters::common_circulation()
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    // Eight scans decide the claims on maps; of gates every 8 samples, which overlap, every third is taken in quick. Fits of signals
    // take longest: the few that quick could make decide no claim on their scatter.
    let (scans, of_signals, every) =
        context
            .profile
            .choose((BATCHES, 0, 24), (48, 12, 8), (100, 100, 8));
    let levels_db = context
        .profile
        .choose(vec![0.0], vec![0.0], vec![0.0, 10.0]);
    let mut fits = Vec::new();
    let mut bounds = Vec::new();
    for &snr_db in &levels_db {
        let pair = PairScan::new(NoiseModel::BandLimited, 200e-9, snr_db, every, context.seed)?;
        bounds.push(bound(&pair)?);
        let found: Vec<Fits> = (0..scans)
            .into_par_iter()
            .map(|scan| {
                Ok(Fits {
                    snr_db,
                    scan,
                    by_method: fit(&pair, scan, scan < of_signals)?,
                })
            })
            .collect::<Result<_, Failure>>()?;
        fits.extend(found);
    }
    let parameters = format!(
        "profile = \"{}\"\nscans = {scans}\nscans_of_signals = {of_signals}\ngate_step_samples = {every}\nsnr_db = {levels_db:?}\n",
        context.profile.name()
    );
    let origin = context.provenance_of_formula(&parameters);
    let by_flow = flows::all(context)?;
    let mut panels = picture(&fits).to_vec();
    panels.push(flows::picture(&by_flow));
    let tables = Table::stack(vec![table(&fits), flows::table(&by_flow)])?;
    let mut out = Rendered::new(&tables, &Figure::stacked(panels), &origin)?;
    out.values = vec![RADIUS_M.to_string(), of_signals.to_string()];
    out.claims = claims(&fits, bounds[0]);
    out.claims.extend(flows::claims(&by_flow));
    Ok(out)
}

/// The fits of one scan, of its signals too or of its map alone.
fn fit(pair: &PairScan, scan: usize, signals: bool) -> Result<Vec<Found>, Failure> {
    let trial = FitTrial::new(pair, scan)?;
    let from_map = |core_radius: Sharing| -> Found {
        let fit = trial
            .map(
                FreeParameters {
                    core_radius,
                    ..free()
                },
                Some(CorePrior::TYPICAL),
            )
            .ok()?;
        Some((fit.wake, fit.covariance))
    };
    let (typical, resolved) = (from_map(Sharing::Fixed), from_map(Sharing::Common));
    if !signals {
        return Ok(vec![typical, resolved]);
    }
    let from_signals = |core_radius: Sharing| -> Found {
        let (mut guess, _) = typical.clone()?;
        if core_radius == Sharing::Fixed {
            guess.left.core_radius_m = truth().left.core_radius_m;
            guess.right.core_radius_m = truth().right.core_radius_m;
        }
        let fit = trial
            .signals(
                FreeParameters {
                    core_radius,
                    ..free()
                },
                &guess,
                Starts::Several,
            )
            .ok()?;
        Some((fit.wake, fit.covariance))
    };
    let (known, fitted) = (from_signals(Sharing::Fixed), from_signals(Sharing::Common));
    Ok(vec![typical, resolved, known, fitted])
}

/// Bound on the common circulation \[m^2/s\] with the core known, and with one core radius fitted.
fn bound(pair: &PairScan) -> Result<[f64; 2], Failure> {
    let model = ScanModel::new(&pair.setup()?, |_, _| pair.snr, &truth())?;
    let of = |core_radius| -> Result<f64, Failure> {
        let covariance = model.bound(
            &truth(),
            Powers::default(),
            &FreeParameters {
                core_radius,
                ..free()
            },
            true,
        )?;
        Ok(covariance[[Parameter::LeftCirculation as usize; 2]].sqrt())
    };
    Ok([of(Sharing::Fixed)?, of(Sharing::Common)?])
}

/// Value and standard deviation of a parameter; NaN where the fit failed.
fn value(found: &Found, parameter: Parameter) -> (f64, f64) {
    let place = parameter as usize;
    found
        .as_ref()
        .map_or((f64::NAN, f64::NAN), |(wake, covariance)| {
            (wake.to_array()[place], covariance[[place; 2]].sqrt())
        })
}

fn table(fits: &[Fits]) -> Table {
    let of_method = |f, m| [Side::Left, Side::Right].map(|vortex| (f, m, vortex));
    let rows: Vec<(&Fits, usize, Side)> = fits
        .iter()
        .flat_map(|f| (0..f.by_method.len()).flat_map(move |m| of_method(f, m)))
        .collect();
    let float = |get: &dyn Fn(&Found, [Parameter; 4]) -> f64| -> Vec<f64> {
        rows.iter()
            .map(|(f, m, vortex)| get(&f.by_method[*m], vortex.parameters()))
            .collect()
    };
    let error = |found: &Found, p: Parameter| value(found, p).0 - truth().to_array()[p as usize];
    Table::new()
        .text("flow", rows.iter().map(|_| "analytic pair"))
        .int("scan", rows.iter().map(|r| r.0.scan as i64))
        .text("method", rows.iter().map(|r| METHODS[r.1]))
        .float("gamma_true_m2_s", rows.iter().map(|_| CIRCULATION_M2_S))
        .float("gamma_m2_s", float(&|f, p| value(f, p[0]).0))
        .float("gamma_std_m2_s", float(&|f, p| value(f, p[0]).1))
        .float("y_error_m", float(&|f, p| error(f, p[1])))
        .float("z_error_m", float(&|f, p| error(f, p[2])))
        .text("vortex", rows.iter().map(|r| name(r.2)))
        .float("y_std_m", float(&|f, p| value(f, p[1]).1))
        .float("z_std_m", float(&|f, p| value(f, p[2]).1))
        .float("snr_db", rows.iter().map(|r| r.0.snr_db))
}

fn picture(fits: &[Fits]) -> [CurvePlot; 3] {
    let first: Vec<&Fits> = fits.iter().filter(|f| f.snr_db == fits[0].snr_db).collect();
    [
        ("circulation", "Γ [m^{2}/s]", Parameter::LeftCirculation),
        ("left vortex, lateral", "y [m]", Parameter::LeftLateral),
        ("left vortex, height", "z [m]", Parameter::LeftHeight),
    ]
    .map(|(title, label, parameter)| {
        let mut plot = CurvePlot::new(title, Axis::linear("scan"), Axis::linear(label));
        for (k, method) in METHODS.into_iter().enumerate() {
            let fitted: Vec<(usize, (f64, f64))> = first
                .iter()
                .filter_map(|f| Some((f.scan, value(f.by_method.get(k)?, parameter))))
                .collect();
            if fitted.is_empty() {
                continue;
            }
            let place = |scan: usize| scan as f64 + 0.12 * (k as f64 - 1.5);
            let points = fitted
                .into_iter()
                .map(|(scan, (found, std))| (place(scan), Estimate::stated(found, std)));
            plot = plot.with(banded(method, Style::Markers, points).in_colour(k));
        }
        let exact = truth().to_array()[parameter as usize];
        let ends = [(-0.5, exact), (first.len() as f64 - 0.5, exact)];
        plot.with(Series::new("", Style::Dash, ends).in_colour(6))
    })
}

/// Errors of the circulation of the fits that came to their end, m^2/s.
fn errors(fits: &[Fits], method: usize) -> Vec<f64> {
    let first = fits.iter().filter(|f| f.snr_db == fits[0].snr_db);
    let error = |f: &Fits| {
        Some(value(f.by_method.get(method)?, Parameter::LeftCirculation).0 - CIRCULATION_M2_S)
    };
    first.filter_map(error).filter(|e| e.is_finite()).collect()
}

/// Root of the mean square of some numbers about a place, each scan a batch.
fn root_mean_square(of: &[f64], about: impl Fn(Option<usize>) -> f64) -> Estimate {
    Estimate::of(of.len(), |without| {
        let squares: Vec<f64> = of.iter().map(|x| (x - about(without)).powi(2)).collect();
        mean(&squares, without).sqrt()
    })
}

fn claims(fits: &[Fits], [known_m2_s, fitted_m2_s]: [f64; 2]) -> Vec<Claim> {
    let at_most = |id: &str, bar: f64, unit, found: Estimate| {
        Claim::judged_alone(id, found, unit, Bar::Below(bar))
    };
    let [map, resolved, known, fitted] = [0, 1, 2, 3].map(|method| errors(fits, method));
    let per_cent = 100.0 / CIRCULATION_M2_S;
    let rms = |of: &[f64]| root_mean_square(of, |_| 0.0).times(per_cent);
    // of n numbers about their own mean: n - 1 are free
    let deviation = |of: &[f64]| {
        root_mean_square(of, |without| mean(of, without))
            .times((of.len() as f64 / (of.len() as f64 - 1.0)).sqrt())
    };
    let done = map.len() + resolved.len() + known.len() + fitted.len();
    let tried: usize = fits
        .iter()
        .filter(|f| f.snr_db == fits[0].snr_db)
        .map(|f| f.by_method.len())
        .sum();
    let mut claims = vec![
        at_most("F17a", 5.0, " %", rms(&map)),
        at_most("F17f", 5.0, " %", rms(&resolved)),
        Claim::exact("F17e", format!("{done} fits"), done == tried)
            .expecting(format!("{tried} fits")),
    ];
    let bias = Estimate::mean(&fitted);
    let of_signals = [
        at_most("F17b", 1.5, "", deviation(&known).times(known_m2_s.recip())),
        at_most(
            "F17c",
            1.5,
            "",
            deviation(&fitted).times(fitted_m2_s.recip()),
        ),
        at_most(
            "F17d",
            2.0,
            " m²/s",
            Estimate {
                value: bias.value.abs(),
                ..bias
            },
        ),
    ];
    let tried = !known.is_empty();
    let longest = "profile full, which fits the signals of 100 scans";
    claims.extend(of_signals.map(|claim| if tried { claim } else { claim.open(longest) }));
    claims
}
