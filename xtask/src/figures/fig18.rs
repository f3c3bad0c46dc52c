//! Figure 18: velocity error of every estimator against the Cramer-Rao bound, in a uniform random wind.

use super::context::*;
use crate::work_precision::estimate::bound_m_s;
use fixtures::WINDOW;
use fixtures::uniform::{Air, BAND_M_S, errors};
use rayon::prelude::*;
use wakescope_estimate::map::{GoodAndBad, good_and_bad};
use wakescope_signal::NoiseModel;

const NOISES: [(NoiseModel, &str); 2] = [
    (NoiseModel::White, "white"),
    (NoiseModel::BandLimited, "band"),
];
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

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let pulses_s = context
        .profile
        .choose(vec![200e-9], vec![200e-9, 400e-9], vec![200e-9, 400e-9]);
    let counts = context
        .profile
        .choose(vec![1, 20, 60], vec![1, 20, 60], vec![1, 20, 60, 200]);
    // the quick profile accumulates the largest number only where a claim asks for it
    let is_short = |snr_db: f64| context.profile == Profile::Quick && snr_db != MANY_PULSES_DB;
    let counts_at = |snr_db| &counts[..counts.len() - usize::from(is_short(snr_db))];
    let trials = context.profile.choose(250, 2000, 20_000);
    let mut cases = Vec::new();
    for &pulse_s in &pulses_s {
        for (noise, _) in NOISES {
            cases.extend(
                (-20..=20)
                    .step_by(5)
                    .map(|snr_db| (pulse_s, noise, f64::from(snr_db))),
            );
        }
    }
    let rows_of = |(pulse_s, noise, snr_db): (f64, NoiseModel, f64)| -> Result<Vec<Row>, Failure> {
        let air = Air::new(noise, pulse_s, snr_db, context.seed)?;
        let found = errors(&air, counts_at(snr_db), trials)?
            .into_iter()
            .map(|errors| {
                let bound_m_s = bound_m_s(&air.known, errors.pulses)?;
                let (method, pulses) = (errors.method, errors.pulses);
                let found = good_and_bad(&errors.errors_m_s, BAND_M_S);
                Ok(Row {
                    method,
                    noise,
                    pulse_s,
                    pulses,
                    snr_db,
                    bound_m_s,
                    found,
                })
            });
        found.collect()
    };
    // the tables of the likelihood for each case are made on one thread: cases run side by side
    let rows: Vec<Vec<Row>> = cases
        .into_par_iter()
        .map(rows_of)
        .collect::<Result<_, _>>()?;
    let rows: Vec<Row> = rows.into_iter().flatten().collect();
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

fn table(rows: &[Row]) -> Table {
    let float = |get: fn(&Row) -> f64| rows.iter().map(get).collect::<Vec<_>>();
    Table::new()
        .text("estimator", rows.iter().map(|r| r.method))
        .text(
            "noise",
            rows.iter().map(|r| {
                if r.noise == NoiseModel::White {
                    "white"
                } else {
                    "band"
                }
            }),
        )
        .float("pulse_s", float(|r| r.pulse_s))
        .int("n_pulses", rows.iter().map(|r| r.pulses as i64))
        .float("snr_db", float(|r| r.snr_db))
        .float("std_good_m_s", float(|r| r.found.std_good_m_s))
        .float("bad_fraction", float(|r| r.found.bad_fraction))
        .float("bias_m_s", float(|r| r.found.bias_m_s))
        .float("bound_m_s", float(|r| r.bound_m_s))
        .float(
            "std_good_standard_error_m_s",
            float(|r| r.found.std_good_error_m_s),
        )
        .float(
            "bad_fraction_standard_error",
            float(|r| r.found.bad_fraction_error),
        )
        .float("bias_standard_error_m_s", float(|r| r.found.bias_error_m_s))
        .float("std_good_over_bound", float(|r| r.ratio().value))
}

fn picture(rows: &[Row]) -> Figure {
    let mut panels = Vec::new();
    type Read = fn(&GoodAndBad) -> [f64; 2];
    let kinds: [(&str, Axis, Read); 3] = [
        (
            "good estimates",
            Axis::log("std [m/s]").between(0.03, 4.0),
            |m| [m.std_good_m_s, m.std_good_error_m_s],
        ),
        (
            "bad estimates",
            Axis::linear("fraction").between(0.0, 1.0),
            |m| [m.bad_fraction, m.bad_fraction_error],
        ),
        ("bias", Axis::linear("bias [m/s]").between(-0.4, 0.4), |m| {
            [m.bias_m_s, m.bias_error_m_s]
        }),
    ];
    for (title, y, read) in kinds {
        for (noise, name) in NOISES {
            let here =
                |r: &&Row| r.noise == noise && r.pulses == DRAWN_PULSES && r.pulse_s == 200e-9;
            let title = format!("{title}, {name} noise");
            let mut plot = CurvePlot::new(&title, Axis::linear("SNR [dB]"), y.clone());
            plot.shape = 0.62;
            for (k, method) in DRAWN.into_iter().enumerate() {
                let point = |r: &Row| {
                    let [value, error] = read(&r.found);
                    (r.snr_db, Estimate::stated(value, error))
                };
                let points = rows
                    .iter()
                    .filter(here)
                    .filter(|r| r.method == method)
                    .map(point);
                // one legend is enough
                let label = if noise == NoiseModel::White && title.starts_with("bad") {
                    method
                } else {
                    ""
                };
                plot = plot.with(banded(label, Style::LineMarkers, points).in_colour(k));
            }
            if title.starts_with("good") {
                let bound = rows
                    .iter()
                    .filter(here)
                    .filter(|r| r.method == DRAWN[0])
                    .map(|r| (r.snr_db, r.bound_m_s));
                plot = plot.with(Series::new("Cramer-Rao bound", Style::Dash, bound).in_colour(6));
            }
            panels.push(plot);
        }
    }
    Figure {
        columns: 2,
        width: 1300.0,
        ..Figure::stacked(panels)
    }
}

/// Mean of a ratio to the bound over rows.
fn mean_ratio<'r>(rows: impl Iterator<Item = &'r Row>) -> Estimate {
    let ratios: Vec<Estimate> = rows.map(Row::ratio).collect();
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
    let likelihood = |pulses: usize, low_db: f64, high_db: f64| {
        let of = move |r: &&Row| {
            r.method == "likelihood"
                && r.pulses == pulses
                && r.pulse_s == 200e-9
                && (low_db..=high_db).contains(&r.snr_db)
        };
        rows.iter().filter(of)
    };
    let at_most =
        |id: &str, bar: f64, found: Estimate| Claim::judged_alone(id, found, "", Bar::Below(bar));
    let bad = |pulses| {
        let found: Vec<&Row> = likelihood(pulses, MANY_PULSES_DB, MANY_PULSES_DB).collect();
        let mean =
            |get: fn(&Row) -> f64| found.iter().map(|r| get(r)).sum::<f64>() / found.len() as f64;
        let error = mean(|r| r.found.bad_fraction_error) / (found.len() as f64).sqrt();
        Estimate::stated(mean(|r| r.found.bad_fraction), error)
    };
    // the pulse pair is drawn to the middle of the band and so no unbiased estimator
    let good = |r: &&Row| {
        r.noise == NoiseModel::White && r.method != "pulse pair" && r.found.bad_fraction < 0.01
    };
    let of: Vec<(&Row, Estimate)> = rows.iter().filter(good).map(|r| (r, r.ratio())).collect();
    let off = |found: &Estimate| (found.value - 1.0) / found.half_width_of(of.len());
    let lowest = of.iter().min_by(|a, b| off(&a.1).total_cmp(&off(&b.1)));
    let mut claims = vec![
        at_most("F18a", 1.05, mean_ratio(likelihood(20, 0.0, 15.0))),
        at_most("F18b", 1.15, mean_ratio(likelihood(20, -5.0, 20.0))),
        at_most("F18c", 0.1, bad(20)),
        at_most("F18d", 0.005, bad(60)),
    ];
    claims.extend(lowest.map(|(row, found)| {
        Claim::exact(
            "F18e",
            format!(
                "lowest of {}: {}, {} at {} dB, {} pulses",
                of.len(),
                found.words(),
                row.method,
                row.snr_db,
                row.pulses
            ),
            off(found) > -1.0,
        )
    }));
    claims
}
