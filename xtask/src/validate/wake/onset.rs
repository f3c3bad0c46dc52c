//! When the fast decay begins: against the level of the noise and the Reynolds number, on 16 x 96 x 64 cells.

use super::history::{History, run};
use crate::claim::Claim;
use crate::profile::Profile;
use crate::validate::shown::Shown;
use fixtures::failure::Failure;
use rayon::prelude::*;
use wakescope_les::analysis::decay::onset;
use wakescope_les::cases::VortexPairCase;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

const LEVELS: [f64; 4] = [1e-3, 3e-3, 1e-2, 3e-2];
const REYNOLDS: [f64; 3] = [2500.0, 5000.0, 10_000.0];
/// Coarser than the coarse preset: six runs are made.
const CELLS: [usize; 3] = [16, 96, 64];
/// Late enough for the weakest noise.
const END: f64 = 4.5;

pub(crate) fn show(profile: Profile) -> Result<Shown, Failure> {
    // The quick form has only the two levels of the claim.
    let quick = profile == Profile::Quick;
    let mut wanted: Vec<(f64, f64)> = LEVELS.map(|level| (level, 5000.0)).to_vec();
    wanted.extend(REYNOLDS.into_iter().filter(|re| *re != 5000.0).map(|re| (1e-2, re)));
    if quick {
        wanted.retain(|(level, re)| (*level == 1e-3 || *level == 1e-2) && *re == 5000.0);
    }
    let runs: Vec<(f64, f64, History)> = wanted
        .into_par_iter()
        .map(|(perturbation, reynolds)| {
            let pair = VortexPairCase { cells: CELLS, perturbation, reynolds, ..VortexPairCase::coarse() };
            Ok((perturbation, reynolds, run(&pair, END)?))
        })
        .collect::<Result<_, Failure>>()?;
    let times: Vec<[f64; 2]> = runs
        .iter()
        .map(|(_, _, flow)| [false, true].map(|right| onset(&flow.gamma(right)).unwrap_or(f64::NAN)))
        .collect();
    let mean = |level: f64, re: f64| {
        let place = runs.iter().position(|(l, r, _)| *l == level && *r == re);
        place.map_or(f64::NAN, |i| 0.5 * (times[i][0] + times[i][1]))
    };
    // The independent code: 0.7 per decade.
    let later = mean(1e-3, 5000.0) - mean(1e-2, 5000.0);
    let checks = vec![Claim::within("onset, noise 1e-3 after 1e-2", later, 0.7, 0.25)];
    let table = Table::new()
        .float("noise_rms", runs.iter().map(|r| r.0))
        .float("reynolds", runs.iter().map(|r| r.1))
        .float("onset_left", times.iter().map(|t| t[0]))
        .float("onset_right", times.iter().map(|t| t[1]))
        .float("gamma_ratio_at_4", runs.iter().map(|r| r.2.mean_gamma(4.0)));
    let points = |of: &dyn Fn(usize) -> Option<f64>| -> Vec<(f64, f64)> {
        (0..runs.len()).filter_map(|i| Some((of(i)?, 0.5 * (times[i][0] + times[i][1])))).collect()
    };
    let by_level = CurvePlot::new(
        "Re 5000",
        Axis::log("noise, rms of a component [V₀]"),
        Axis::linear("onset of the fast decay, tau"),
    )
    .with(Series::new("16 x 96 x 64", Style::LineMarkers, points(&|i| (runs[i].1 == 5000.0).then_some(runs[i].0))));
    let mut by_reynolds = points(&|i| (runs[i].0 == 1e-2).then_some(runs[i].1));
    by_reynolds.sort_by(|a, b| a.0.total_cmp(&b.0));
    let by_reynolds = CurvePlot::new("Noise 0.01", Axis::log("Re_Gamma"), Axis::linear("onset of the fast decay, tau"))
        .with(Series::new("16 x 96 x 64", Style::LineMarkers, by_reynolds));
    let mut decay =
        CurvePlot::new("Circulation", Axis::linear("tau"), Axis::linear("Gamma_5-15 / initial").between(0.3, 1.02));
    for (level, re, flow) in &runs {
        let mean = flow.gamma(false).into_iter().zip(flow.gamma(true)).map(|(a, b)| (a.0, 0.5 * (a.1 + b.1)));
        decay = decay.with(Series::new(&format!("noise {level}, Re {re}"), Style::Line, mean));
    }
    Ok(Shown { checks, table, figure: Figure::stacked([by_level, by_reynolds, decay]) })
}
