//! Figure 18: velocity error of every estimator against the Cramer-Rao bound, in a uniform random wind.

use super::context::*;
use crate::work_precision::estimate::bound_m_s;
use fixtures::WINDOW;
use fixtures::uniform::{Air, BAND_M_S, errors};
use rayon::prelude::*;
use wakescope_estimate::map::{GoodAndBad, good_and_bad};
use wakescope_signal::NoiseModel;

const NOISES: [NoiseModel; 2] = [NoiseModel::White, NoiseModel::BandLimited];
/// Estimators that are drawn; the table has all.
const DRAWN: [&str; 5] = [
    "PA",
    "CA, AR(16)",
    "first moment",
    "pulse pair",
    "likelihood",
];
/// Pulses of the picture.
const DRAWN_PULSES: usize = 20;
/// Signal-to-noise ratio at which claims ask for bad estimates, dB.
const MANY_PULSES_DB: f64 = -10.0;

struct Row {
    method: &'static str,
    noise: NoiseModel,
    pulse_s: f64,
    pulses: usize,
    snr_db: f64,
    bound_m_s: f64,
    found: GoodAndBad,
}

impl Row {
    /// Standard deviation of good estimates over the bound.
    fn ratio(&self) -> Estimate {
        Estimate::stated(
            self.found.std_good_m_s / self.bound_m_s,
            self.found.std_good_error_m_s / self.bound_m_s,
        )
    }
}

/// Pulse \[s\], noise and signal-to-noise ratio \[dB\] of some windows.
type Case = (f64, NoiseModel, f64);

/// Trials of all estimators.
fn rows(
    (pulse_s, noise, snr_db): Case,
    pulses: &[usize],
    trials: usize,
    seed: u64,
) -> Result<Vec<Row>, Failure> {
    let air = Air::new(noise, pulse_s, snr_db, seed)?;
    let mut rows = Vec::new();
    for errors in errors(&air, pulses, trials)? {
        rows.push(Row {
            method: errors.method,
            noise,
            pulse_s,
            pulses: errors.pulses,
            snr_db,
            bound_m_s: bound_m_s(&air.known, errors.pulses)?,
            found: good_and_bad(&errors.errors_m_s, BAND_M_S),
        });
    }
    Ok(rows)
}

fn cases(context: &Context) -> Vec<Case> {
    let pulses_s = context
        .profile
        .choose(vec![200e-9], vec![200e-9, 400e-9], vec![200e-9, 400e-9]);
    let mut cases = Vec::new();
    for pulse_s in pulses_s {
        for noise in NOISES {
            for snr_db in (-20..=20).step_by(5) {
                cases.push((pulse_s, noise, f64::from(snr_db)));
            }
        }
    }
    cases
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let counts = context
        .profile
        .choose(vec![1, 20, 60], vec![1, 20, 60], vec![1, 20, 60, 200]);
    let trials = context.profile.choose(250, 2000, 20_000);
    // The tables of the likelihood for each case are made on one thread: cases run side by side.
    let of_cases: Vec<Vec<Row>> = cases(context)
        .into_par_iter()
        .map(|case| {
            let (.., snr_db) = case;
            // The quick profile accumulates the largest number only where a claim needs it.
            let is_short = context.profile == Profile::Quick && snr_db != MANY_PULSES_DB;
            let counts = &counts[..counts.len() - usize::from(is_short)];
            rows(case, counts, trials, context.seed)
        })
        .collect::<Result<_, _>>()?;
    let rows: Vec<Row> = of_cases.into_iter().flatten().collect();
    let parameters = format!(
        "profile = \"{}\"\ntrials = {trials}\nwindow_samples = {WINDOW}\npulses = {counts:?}\n",
        context.profile.name()
    );
    let origin = context.provenance_of_formula(&parameters);
    let mut out = Rendered::new(&table(&rows), &picture(&rows), &origin)?;
    out.values = vec![
        WINDOW.to_string(),
        trials.to_string(),
        DRAWN_PULSES.to_string(),
        counts[counts.len() - 1].to_string(),
    ];
    out.claims = claims(&rows);
    Ok(out)
}

fn name_of(noise: NoiseModel) -> &'static str {
    if noise == NoiseModel::White {
        "white"
    } else {
        "band"
    }
}

fn table(rows: &[Row]) -> Table {
    Table::new()
        .text("estimator", column(rows, |r| r.method))
        .text("noise", column(rows, |r| name_of(r.noise)))
        .float("pulse_s", column(rows, |r| r.pulse_s))
        .int("n_pulses", column(rows, |r| r.pulses as i64))
        .float("snr_db", column(rows, |r| r.snr_db))
        .float("std_good_m_s", column(rows, |r| r.found.std_good_m_s))
        .float("bad_fraction", column(rows, |r| r.found.bad_fraction))
        .float("bias_m_s", column(rows, |r| r.found.bias_m_s))
        .float("bound_m_s", column(rows, |r| r.bound_m_s))
        .float(
            "std_good_standard_error_m_s",
            column(rows, |r| r.found.std_good_error_m_s),
        )
        .float(
            "bad_fraction_standard_error",
            column(rows, |r| r.found.bad_fraction_error),
        )
        .float(
            "bias_standard_error_m_s",
            column(rows, |r| r.found.bias_error_m_s),
        )
        .float("std_good_over_bound", column(rows, |r| r.ratio().value))
}

/// What a row of panels shows.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Quantity {
    GoodEstimates,
    BadEstimates,
    Bias,
}

impl Quantity {
    const ALL: [Self; 3] = [Self::GoodEstimates, Self::BadEstimates, Self::Bias];

    fn title(self) -> &'static str {
        match self {
            Self::GoodEstimates => "good estimates",
            Self::BadEstimates => "bad estimates",
            Self::Bias => "bias",
        }
    }

    fn axis(self) -> Axis {
        match self {
            Self::GoodEstimates => Axis::log("std [m/s]").between(0.03, 4.0),
            Self::BadEstimates => Axis::linear("fraction").between(0.0, 1.0),
            Self::Bias => Axis::linear("bias [m/s]").between(-0.4, 0.4),
        }
    }

    fn estimate(self, found: &GoodAndBad) -> Estimate {
        match self {
            Self::GoodEstimates => Estimate::stated(found.std_good_m_s, found.std_good_error_m_s),
            Self::BadEstimates => Estimate::stated(found.bad_fraction, found.bad_fraction_error),
            Self::Bias => Estimate::stated(found.bias_m_s, found.bias_error_m_s),
        }
    }
}

fn picture(rows: &[Row]) -> Figure {
    let mut panels = Vec::new();
    for quantity in Quantity::ALL {
        for noise in NOISES {
            panels.push(panel(rows, quantity, noise));
        }
    }
    Figure {
        columns: 2,
        width: 1300.0,
        ..Figure::stacked(panels)
    }
}

/// A quantity against the signal-to-noise ratio.
fn panel(rows: &[Row], quantity: Quantity, noise: NoiseModel) -> CurvePlot {
    let title = format!("{}, {} noise", quantity.title(), name_of(noise));
    let mut plot = CurvePlot::new(&title, Axis::linear("SNR [dB]"), quantity.axis());
    plot.shape = 0.62;
    let mut shown: Vec<&Row> = rows.iter().collect();
    shown.retain(|r| r.noise == noise && r.pulses == DRAWN_PULSES && r.pulse_s == 200e-9);
    // One legend is enough.
    let has_legend = noise == NoiseModel::White && quantity == Quantity::BadEstimates;
    for (k, method) in DRAWN.into_iter().enumerate() {
        let points = shown
            .iter()
            .filter(|r| r.method == method)
            .map(|r| (r.snr_db, quantity.estimate(&r.found)));
        let label = if has_legend { method } else { "" };
        plot = plot.with(banded(label, Style::LineMarkers, points).in_colour(k));
    }
    if quantity != Quantity::GoodEstimates {
        return plot;
    }
    let bound = shown
        .iter()
        .filter(|r| r.method == DRAWN[0])
        .map(|r| (r.snr_db, r.bound_m_s));
    plot.with(Series::new("Cramer-Rao bound", Style::Dash, bound).in_colour(6))
}

/// Rows of the likelihood with short pulses between two ratios.
fn likelihood(rows: &[Row], pulses: usize, low_db: f64, high_db: f64) -> Vec<&Row> {
    let mut found = Vec::new();
    for row in rows {
        if row.method == "likelihood"
            && row.pulses == pulses
            && row.pulse_s == 200e-9
            && (low_db..=high_db).contains(&row.snr_db)
        {
            found.push(row);
        }
    }
    found
}

/// Mean of a number of rows.
fn mean_of(rows: &[&Row], number: fn(&Row) -> f64) -> f64 {
    rows.iter().map(|row| number(row)).sum::<f64>() / rows.len() as f64
}

/// Mean fraction of bad estimates of the likelihood at the ratio of the claims.
fn bad_fraction(rows: &[Row], pulses: usize) -> Estimate {
    let rows = likelihood(rows, pulses, MANY_PULSES_DB, MANY_PULSES_DB);
    let error = mean_of(&rows, |r| r.found.bad_fraction_error) / (rows.len() as f64).sqrt();
    Estimate::stated(mean_of(&rows, |r| r.found.bad_fraction), error)
}

/// Mean of the ratio to the bound over rows.
fn mean_ratio(rows: &[&Row]) -> Estimate {
    let ratios: Vec<Estimate> = rows.iter().map(|row| row.ratio()).collect();
    let n = ratios.len() as f64;
    let squares: f64 = ratios
        .iter()
        .map(|r| r.standard_error * r.standard_error)
        .sum();
    Estimate::stated(
        ratios.iter().map(|r| r.value).sum::<f64>() / n,
        squares.sqrt() / n,
    )
}

fn claims(rows: &[Row]) -> Vec<Claim> {
    let near = mean_ratio(&likelihood(rows, 20, 0.0, 15.0));
    let far = mean_ratio(&likelihood(rows, 20, -5.0, 20.0));
    let mut claims = vec![
        Claim::judged_alone("F18a", near, "", Bar::Below(1.05)),
        Claim::judged_alone("F18b", far, "", Bar::Below(1.15)),
        Claim::judged_alone("F18c", bad_fraction(rows, 20), "", Bar::Below(0.1)),
        Claim::judged_alone("F18d", bad_fraction(rows, 60), "", Bar::Below(0.005)),
    ];
    claims.extend(lowest_claim(rows));
    claims
}

/// No standard deviation of good estimates in white noise is below the bound.
fn lowest_claim(rows: &[Row]) -> Option<Claim> {
    let mut good = Vec::new();
    for row in rows {
        // The pulse pair is drawn to the middle of the band and so no unbiased estimator.
        if row.noise == NoiseModel::White
            && row.method != "pulse pair"
            && row.found.bad_fraction < 0.01
        {
            good.push((row, row.ratio()));
        }
    }
    let off = |ratio: &Estimate| (ratio.value - 1.0) / ratio.half_width_of(good.len());
    let (row, ratio) = good
        .iter()
        .min_by(|(_, a), (_, b)| off(a).total_cmp(&off(b)))?;
    let measured = format!(
        "lowest of {}: {}, {} at {} dB, {} pulses",
        good.len(),
        ratio.words(),
        row.method,
        row.snr_db,
        row.pulses
    );
    Some(Claim::exact("F18e", measured, off(ratio) > -1.0))
}
