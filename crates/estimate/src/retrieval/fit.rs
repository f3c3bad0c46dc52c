//! Fit of one scan: the best wake, whether there is one, and what is known of it.
//!
//! Wind alone, a left vortex, a right one and both are fitted. Of the last three the one with the least chi^2 + k ln N is taken; it is
//! a wake if the statistic, the least chi^2 of the wind alone minus its own, reaches the threshold, and so for each vortex.
//! Check: the reference maps; scatter, bias and stated deviations over many maps.

use crate::error::Error;
use crate::retrieval::alternatives::with_alternatives;
use crate::retrieval::expected::Expected;
use crate::retrieval::hypotheses::{End, Fits, ROUGH, least, rivals, starts};
use crate::retrieval::problem::{Cell, Problem};
use crate::retrieval::report::{OUTLIER, Report};
use crate::retrieval::whitening::Whitening;
use crate::retrieval::{Movement, RetrievalOptions, ScanMap, ScanResult, Turbulence};
use crate::vortex_fit::map_fit::data::robust_scale;
use crate::vortex_fit::{Loss, Wake};

/// Most velocities that are whitened, that are fitted, and that are searched for a wake: blocks stand for more.
const WHITENED: usize = 1500;
const MOST: usize = 16_000;
const SEARCHED: usize = 1200;
/// A statistic below this part of the threshold in medians, which tell two thirds of what all velocities do, is no wake.
const NOTHING: f64 = 0.5;

/// Finds the vortices of one scan. No wake is a result, not an error.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input; [`Error::TooFewVelocities`] with less than a hundred;
/// [`Error::Linalg`] if what is free does not show in the map or velocities are so correlated that they cannot be whitened.
pub fn fit_scan(map: &ScanMap, options: &RetrievalOptions) -> Result<ScanResult, Error> {
    options.validate()?;
    map.validate()?;
    let unfolded = map.unfolded();
    let bounded = unfolded.medians(if options.turbulence.is_some() { WHITENED } else { MOST });
    let map = bounded.as_ref().unwrap_or(&unfolded);
    let expected = Expected::rough(map, options)?;
    let mut problem = problem_of(&expected, options);
    // broad blocks are enough to search in
    let few = map.medians(SEARCHED);
    let sought = Expected::rough(few.as_ref().unwrap_or(map), options)?;
    let mut search = problem_of(&sought, options);
    let starts = starts(sought.map, &search, options)?;
    let about = starts.first().map_or(Wake::from_array(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]), |s| s.1);
    if map.sigma_m_s.is_none() {
        // what the wind leaves, until fits are known
        for problem in [&mut search, &mut problem] {
            let wind = Fits { problem, options }.wind(&about)?;
            rescale(problem, &wind);
        }
    }
    let found = Fits { problem: &search, options }.ends_of(&starts);
    let (thinned, mut rejected) = (bounded.is_some(), 0);
    let mut ends = found.clone();
    if let Some(turbulence) = &options.turbulence {
        rejected = whiten(&mut problem, turbulence, least(&found, search.cells.len()))?;
        ends = Fits { problem: &problem, options }.ends_of(&starts);
    } else if let (Some(few), Some(likely)) = (&few, least(&found, search.cells.len())) {
        // the scale in which they compete
        let scale = residual_scale(&search, likely).max(1.0);
        let wind = Fits { problem: &search, options }.wind(&about)?;
        let (wind, ends_there) = (&wind, &found[..]);
        let report = Report {
            map: few,
            options,
            problem: &search,
            scale,
            rejected,
            thinned,
            is_noise_left: true,
            wind,
            ends: ends_there,
        };
        // where blocks show next to nothing, the best is enough to tell so
        let is_empty = report.result()?.statistic < NOTHING * options.threshold;
        let rivals = if is_empty { vec![likely.clone()] } else { rivals(&found, scale) };
        ends = Fits { problem: &problem, options }.again(&rivals);
    }
    let mut scale = 1.0;
    if let Some(end) = least(&ends, problem.cells.len()) {
        if map.sigma_m_s.is_none() && problem.whitening.is_none() {
            rescale(&mut problem, end);
        } else {
            scale = residual_scale(&problem, end).max(1.0);
        }
        problem.loss = match options.loss {
            Loss::Cauchy { width } => Loss::Cauchy { width: width * scale },
            loss => loss,
        };
    }
    let dense = Expected::on_grid(map, options, 1)?;
    problem.expected = &dense;
    let mut ends = Fits { problem: &problem, options }.onwards(&rivals(&ends, scale), |_| ROUGH);
    let frozen = dense.frozen();
    let likely = least(&ends, problem.cells.len()).filter(|_| options.movement == Movement::Auto && dense.moves());
    if let Some(likely) = likely {
        problem.expected = &frozen;
        let fits = Fits { problem: &problem, options };
        let still = fits.onwards(std::slice::from_ref(likely), |_| ROUGH);
        let sense = if map.lasts_s() < RetrievalOptions::SHORT_S { -1.0 } else { 1.0 };
        let margin = RetrievalOptions::MOVES * scale.powi(2) * sense;
        if still.first().is_some_and(|still| still.chi2 + margin < likely.chi2) {
            ends = fits.onwards(&ends, |_| ROUGH);
        } else {
            problem.expected = &dense;
        }
    }
    let fine = problem.expected.fine(options)?;
    problem.expected = &fine;
    let ends = Fits { problem: &problem, options }.fine(&ends);
    let wind = Fits { problem: &problem, options }.wind(&about)?;
    let (problem, wind, ends) = (&problem, &wind, &ends[..]);
    with_alternatives(&Report { map, options, problem, scale, rejected, thinned, is_noise_left: true, wind, ends })
}

/// Rough, with all velocities of the map.
fn problem_of<'a>(expected: &'a Expected<'a>, options: &RetrievalOptions) -> Problem<'a> {
    let cells = cells(expected.map);
    Problem { expected, cells, whitening: None, loss: options.loss, prior: options.core_prior }
}

/// Makes residuals white: the velocities far off a first fit are taken away, as whitening would spread them over their neighbours. Tells how many.
fn whiten(problem: &mut Problem<'_>, turbulence: &Turbulence, first: Option<&End>) -> Result<usize, Error> {
    let before = problem.cells.len();
    reject(problem, turbulence, first);
    let rejected = before - problem.cells.len();
    let (map, model) = (problem.expected.map, problem.expected.model);
    let place = |cell: &Cell| (model.position_m(map.range_m[cell.gate], map.elevation_rad[cell.line]), cell.sigma_m_s);
    let places: Vec<_> = problem.cells.iter().map(place).collect();
    problem.whitening = Some(Whitening::new(&places, turbulence).ok_or(Error::Linalg {
        what: "covariance of the velocities",
        order: places.len(),
        reason: "is singular to working precision: state larger deviations of the velocities",
    })?);
    Ok(rejected)
}

/// The velocities that there are.
pub(crate) fn cells(map: &ScanMap) -> Vec<Cell> {
    let known = map.velocity_m_s.indexed_iter().filter(|(_, velocity)| velocity.is_finite());
    known
        .map(|((line, gate), _)| {
            let sigma_m_s = map.sigma_m_s.as_ref().map_or(1.0, |sigma| sigma[[line, gate]]);
            Cell { line, gate, sigma_m_s }
        })
        .collect()
}

/// Scale of the residuals over their deviations, from their median.
fn residual_scale(problem: &Problem<'_>, end: &End) -> f64 {
    robust_scale(problem.rows(&end.wake, &[]).residuals.into_iter())
}

/// Where no deviations are stated, they are those of the residuals; a millionth of a metre per second where the fit is exact.
pub(crate) fn rescale(problem: &mut Problem<'_>, end: &End) {
    let scale = residual_scale(problem, end);
    problem.cells.iter_mut().for_each(|cell| cell.sigma_m_s = (cell.sigma_m_s * scale).max(1e-6));
}

/// Takes away velocities far off a first fit, which whitening would spread over their neighbours.
fn reject(problem: &mut Problem<'_>, turbulence: &Turbulence, end: Option<&End>) {
    let Some(end) = end else { return };
    let residuals = problem.rows(&end.wake, &[]).residuals;
    let mut residuals = residuals.iter();
    problem.cells.retain(|cell| {
        let deviation_m_s = cell.sigma_m_s.hypot(turbulence.deviation_m_s);
        residuals.next().is_none_or(|r| r.abs() * cell.sigma_m_s <= OUTLIER * deviation_m_s)
    });
}
