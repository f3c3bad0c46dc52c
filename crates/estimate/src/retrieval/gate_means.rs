//! Fit of one scan of means over gates: the best wake, whether there is one, and what is known of it.
//!
//! Wind alone, a left vortex, a right one and both are fitted. Of the last three the one with the least chi^2 + k ln N is taken; it is
//! a wake if the statistic, the least chi^2 of the wind alone minus its own, reaches the threshold, and so for each vortex.
//! Check: the reference maps; scatter, bias and stated deviations over many maps.

use crate::error::Error;
use crate::retrieval::aliases::{self, CALM, Unfolded};
use crate::retrieval::alternatives::with_alternatives;
use crate::retrieval::hypotheses::{End, Kind, Stage, least, rivals};
use crate::retrieval::report::{OUTLIER, Report};
use crate::retrieval::scan_turbulence::{Remainder, gate_covariance, gate_positions};
use crate::retrieval::whitening::Whitening;
use crate::retrieval::{
    Flag, Movement, RetrievalOptions, ScanMap, ScanResult, ScanTurbulence, Turbulence,
    without_spikes,
};
use crate::vortex_fit::map_fit::cells::Cell;
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::guess::SEARCHED;
use crate::vortex_fit::tolerances::MINIMUM;
use crate::vortex_fit::{Loss, Sharing, Wake};
use crate::wind_profile::GatePosition;

/// Most velocities that are whitened, and that are fitted: blocks stand for more.
const WHITENED: usize = 1500;
pub(super) const MOST: usize = 16_000;
/// Most winds that are assumed in turn.
const OTHER_WINDS: usize = 3;
/// A statistic below this part of the threshold in medians, which tell two thirds of what all velocities do, is no wake.
const NOTHING: f64 = 0.5;

/// What may be wrong with a pair that moves in the fit and not in the scan.
const DOUBTS: [Flag; 4] = [
    Flag::CoreKept,
    Flag::PoorFit,
    Flag::Ambiguous,
    Flag::NotConverged,
];

/// Places of vortices that one fit does not tell apart from those of another \[m\].
const SAME_PLACE_M: f64 = 3.0;

/// Finds the vortices of a scan whose velocities are means over gates.
///
/// # Errors
/// As [`fit_scan`](crate::retrieval::fit_scan).
pub(super) fn fit_means(map: &ScanMap, options: &RetrievalOptions) -> Result<ScanResult, Error> {
    let found = fit_once(map, options)?;
    let is_clear = found.vortices.len() == 2 && !is_doubtful(&found, options);
    if is_clear || options.movement != Movement::Auto || map.lasts_s() == 0.0 {
        return Ok(found);
    }
    // With times that are not those of the air a search for vortices that move passes by those that stand still, or ends beside them.
    let at_rest = RetrievalOptions {
        movement: Movement::Frozen,
        ..options.clone()
    };
    let standing = fit_in_winds(map, &at_rest)?;
    let least = found.statistic + RetrievalOptions::MOVES;
    let is_better = standing.wake.is_some() && standing.statistic > least;
    Ok(if is_better { standing } else { found })
}

/// The same by one search, in which vortices move unless the scan is short or they are stated to stand still.
///
/// # Errors
/// As [`fit_scan`](crate::retrieval::fit_scan).
pub(super) fn fit_once(map: &ScanMap, options: &RetrievalOptions) -> Result<ScanResult, Error> {
    options.validate()?;
    map.validate()?;
    fit_in_winds(map, options)
}

/// Whether a pair may be at rest though the fit lets it move. Cores that are fixed say nothing of that.
fn is_doubtful(found: &ScanResult, options: &RetrievalOptions) -> bool {
    let are_cores_free = options.free.core_radius != Sharing::Fixed;
    DOUBTS
        .iter()
        .any(|flag| found.has(*flag) && (are_cores_free || *flag != Flag::CoreKept))
}

/// What was `found` in a scan; where that leaves many outliers, which mislead the search, the fit from the wake that the scan shows without them, if it
/// explains more.
///
/// # Errors
/// As [`fit_scan`](crate::retrieval::fit_scan).
pub(super) fn fit_among_outliers(
    map: &ScanMap,
    options: &RetrievalOptions,
    found: ScanResult,
) -> Result<ScanResult, Error> {
    if !found.has(Flag::Outliers) {
        return Ok(found);
    }
    let (clean, _) = without_spikes(map, options.turbulence.as_ref());
    let mut options = options.clone();
    if found.has(Flag::MotionIgnored) {
        options.movement = Movement::Frozen;
    }
    // Too few velocities may be left.
    let in_clean = fit_in_winds(&clean, &options).ok();
    let Some(wake) = in_clean.and_then(|result| result.wake) else {
        return Ok(found);
    };
    if found.wake.is_some_and(|found| are_same(&found, &wake)) {
        return Ok(found);
    }
    options.start = Some(wake);
    let again = fit_in_winds(map, &options)?;
    let is_better =
        again.wake.is_some() && (found.wake.is_none() || again.statistic > found.statistic);
    Ok(if is_better { again } else { found })
}

/// Whether the vortices of two wakes are at the same places, so that one start leads to both.
fn are_same(a: &Wake, b: &Wake) -> bool {
    let left_m = a.left.away_m(b.left.place_m());
    let right_m = a.right.away_m(b.right.place_m());
    left_m.max(right_m) < SAME_PLACE_M
}

/// The result in the wind, among those that folded velocities leave open, that explains the velocities best.
fn fit_in_winds(map: &ScanMap, options: &RetrievalOptions) -> Result<ScanResult, Error> {
    let mut unfolded = Unfolded::new(map, options)?;
    let mut options = options.clone();
    for _ in 0..OTHER_WINDS {
        let (result, better) = fit_unfolded(&unfolded, &options)?;
        let Some((wake, movement)) = better else {
            return Ok(result);
        };
        unfolded = unfolded.about(&wake, &options);
        options.movement = movement;
    }
    Ok(fit_unfolded(&unfolded, &options)?.0)
}

/// The result in the assumed wind, and a wake in another wind that explains the velocities better, with its movement.
fn fit_unfolded(
    unfolded: &Unfolded,
    options: &RetrievalOptions,
) -> Result<(ScanResult, Option<(Wake, Movement)>), Error> {
    let bounded = unfolded.map.medians(if options.turbulence.is_some() {
        WHITENED
    } else {
        MOST
    });
    let map = bounded.as_ref().unwrap_or(&unfolded.map);
    // broad blocks are enough to search in
    let few = map.medians(SEARCHED);
    let gates = Gates::rough(map, options)?;
    let sought = few.as_ref().unwrap_or(map);
    let sought_gates = Gates::rough(sought, options)?;
    let mut all = Stage::new(map, options, &gates);
    let mut search = Stage::new(sought, options, &sought_gates);
    let mut starts = search.starts()?;
    for (_, start) in &mut starts {
        *start = unfolded.with_wind(start);
    }
    let nothing = unfolded.with_wind(&Wake::from_array(&CALM));
    // A start may be impossible: a track that is continued may lead below the ground.
    let mut possible = starts.iter().map(|start| start.1);
    let about = possible.find(|wake| search.wind(wake).is_ok());
    let about = about.unwrap_or(nothing);
    if map.sigma_m_s.is_none() {
        // what the wind leaves, until fits are known
        let winds = (search.wind(&about)?, all.wind(&about)?);
        search = search.rescaled(&winds.0);
        all = all.rescaled(&winds.1);
    }
    let found = search.ends_of(&starts);
    let likely = least(&found, search.squares.cells.len());
    all.thinned = bounded.is_some();
    let whitening = match &options.turbulence {
        None | Some(Turbulence::OfScan) => None,
        Some(turbulence) => {
            if let Some(end) = likely {
                let air_m_s = deviation_m_s(turbulence);
                reject(&mut all, end, |cell| cell.sigma_m_s.hypot(air_m_s));
            }
            Some(whitening(&all, turbulence, &about)?)
        }
    };
    all.squares.whitening = whitening.as_ref();
    let ends = ends_in_all(
        &all,
        &search,
        (&starts, &found),
        (few.is_some(), &about),
        options,
    )?;
    let cells = all.squares.cells.len();
    let (all, scale) = in_scale(all, least(&ends, cells));
    let ends = rivals(&ends, scale);
    match options.turbulence {
        Some(Turbulence::OfScan) => in_turbulence_of_scan(all, &ends, scale, &about),
        _ => finished(all, &ends, scale, &about),
    }
}

/// The result of rough ends of a fit to independent velocities, continued in the turbulence that the likely one leaves: generalised least
/// squares, with the inverse of the information as covariance. Where no wake stands out of that turbulence, the reported one is what the wind
/// leaves: the best of many wakes has taken some of it.
fn in_turbulence_of_scan(
    mut all: Stage<'_>,
    ends: &[End],
    scale: f64,
    about: &Wake,
) -> Result<(ScanResult, Option<(Wake, Movement)>), Error> {
    let Some(likely) = least(ends, all.squares.cells.len()) else {
        return finished(all, ends, scale, about);
    };
    reject(&mut all, likely, |cell| scale * cell.sigma_m_s);
    let remainder = remainder_of(&all, likely);
    let table = gate_covariance(&remainder.gates, all.options.gate.std_m())?;
    let Some(turbulence) = remainder.turbulence(&table)? else {
        return finished(all, ends, scale, about);
    };
    let whitening = remainder.whitening(&turbulence, &table);
    let whitening = whitening.ok_or(singular(remainder.gates.len()))?;
    let options = RetrievalOptions {
        loss: Loss::Squares,
        ..all.options.clone()
    };
    let mut stage = Stage {
        options: &options,
        ..all.clone()
    };
    stage.squares.loss = options.loss;
    stage.is_noise_known = true;
    stage.squares.whitening = Some(&whitening);
    let ends = stage.again(ends);
    let cells = stage.squares.cells.len();
    let (stage, scale) = in_scale(stage, least(&ends, cells));
    let (mut result, better) = finished(stage, &rivals(&ends, scale), scale, about)?;
    result.turbulence = Some(turbulence);
    if result.vortices.is_empty() {
        let wind = all.wind(about)?;
        let calm = remainder_of(&all, &wind).turbulence(&table)?;
        result.turbulence = calm.map(|found| ScanTurbulence {
            is_beside_wake: false,
            ..found
        });
    }
    Ok((result, better))
}

/// What an end leaves of the velocities of a stage.
fn remainder_of(stage: &Stage<'_>, end: &End) -> Remainder {
    let rows = stage.squares.rows(&end.wake.to_array(), &end.groups);
    let cells = stage.squares.cells.iter();
    let noise_std_m_s = cells.map(|cell| cell.sigma_m_s).collect();
    Remainder::new(positions(stage, &end.wake), rows, noise_std_m_s)
}

/// Where the gates of a stage are in air that the wind of a wake carries along.
fn positions(stage: &Stage<'_>, wake: &Wake) -> Vec<GatePosition> {
    gate_positions(stage.map, &stage.squares.cells, stage.gates.model, wake)
}

/// The result of rough ends, followed to their end with vortices that move or stand still, and a wake in another wind that explains the
/// velocities better, with its movement.
fn finished(
    all: Stage<'_>,
    rough: &[End],
    scale: f64,
    about: &Wake,
) -> Result<(ScanResult, Option<(Wake, Movement)>), Error> {
    let map = all.map;
    let options = all.options;
    let dense = Gates::on_grid(map, options, 1)?;
    let frozen = dense.clone().frozen();
    let stage = all.through(&dense);
    let mut ends = stage.onwards(rough, |_| MINIMUM);
    let may_stand = options.movement == Movement::Auto && dense.seconds.is_some();
    let still = stage.clone().through(&frozen);
    let standing = if may_stand {
        ends_at_rest(&stage, &still, &ends, scale)
    } else {
        None
    };
    let at_rest = if map.fold_m_s.is_some() && may_stand {
        still.onwards(&ends, |_| MINIMUM)
    } else {
        Vec::new()
    };
    let better = aliases::better([(&stage, &ends[..]), (&still, &at_rest)], scale);
    let (chosen, gates) = match &standing {
        Some(_) => (&still, frozen.clone()),
        None => (&stage, dense.clone()),
    };
    ends = standing.unwrap_or(ends);
    ends.extend(aliases::rivals(chosen, &ends, scale));
    let fine = gates.fine(&options.gate)?;
    let stage = stage.through(&fine);
    let wind = stage.wind(about)?;
    let ends = stage.fine(&ends);
    let (wind, other_wind_competes) = aliases::best_wind(&stage, wind, scale);
    let mut result = with_alternatives(&Report {
        stage: &stage,
        scale,
        wind: &wind,
        ends: &ends,
    })?;
    if result.wake.is_none() {
        result.set(Flag::Ambiguous, other_wind_competes);
    }
    Ok((result, better))
}

/// The ends in all velocities that come of a search, whose blocks stand for them if they are many.
fn ends_in_all(
    all: &Stage<'_>,
    search: &Stage<'_>,
    (starts, found): (&[(Kind, Wake)], &[End]),
    (is_of_blocks, about): (bool, &Wake),
    options: &RetrievalOptions,
) -> Result<Vec<End>, Error> {
    if all.squares.whitening.is_some() {
        return Ok(all.ends_of(starts));
    }
    let Some(likely) = least(found, search.squares.cells.len()).filter(|_| is_of_blocks) else {
        return Ok(found.to_vec());
    };
    // the scale in which they compete
    let scale = search.residual_scale(likely).max(1.0);
    let report = Report {
        stage: search,
        scale,
        wind: &search.wind(about)?,
        ends: found,
    };
    // where blocks show next to nothing, the best is enough to tell so
    let is_empty = report.chosen()?.statistic < NOTHING * options.threshold;
    Ok(all.again(&if is_empty {
        vec![likely.clone()]
    } else {
        rivals(found, scale)
    }))
}

/// The ends of vortices at rest, where they explain the velocities better than those that move by more than motion costs.
fn ends_at_rest(
    moving: &Stage<'_>,
    still: &Stage<'_>,
    ends: &[End],
    scale: f64,
) -> Option<Vec<End>> {
    let likely = least(ends, moving.squares.cells.len())?;
    let end = still
        .onwards(std::slice::from_ref(likely), |_| MINIMUM)
        .pop()?;
    let sense = if moving.map.lasts_s() < RetrievalOptions::SHORT_S {
        -1.0
    } else {
        1.0
    };
    let margin = RetrievalOptions::MOVES * scale.powi(2) * sense;
    (end.chi2 + margin < likely.chi2).then(|| still.onwards(ends, |_| MINIMUM))
}

/// A stage with deviations or a loss of the scale of the residuals that a likely end leaves, and that scale over the stated deviations.
fn in_scale<'a>(mut stage: Stage<'a>, likely: Option<&End>) -> (Stage<'a>, f64) {
    let Some(likely) = likely else {
        return (stage, 1.0);
    };
    if stage.map.sigma_m_s.is_none() && stage.squares.whitening.is_none() {
        return (stage.rescaled(likely), 1.0);
    }
    let scale = stage.residual_scale(likely).max(1.0);
    if let Loss::Cauchy { width } = &mut stage.squares.loss {
        *width *= scale;
    }
    (stage, scale)
}

/// Standard deviation of the velocities of the air in given turbulence \[m/s\].
fn deviation_m_s(turbulence: &Turbulence) -> f64 {
    match turbulence {
        Turbulence::Exponential { deviation_m_s, .. } => *deviation_m_s,
        Turbulence::VonKarman(found) => found.variance_m2_s2().sqrt(),
        Turbulence::OfScan => 0.0,
    }
}

/// What makes the velocities of a stage white in given turbulence and in the wind of a wake.
fn whitening(stage: &Stage<'_>, turbulence: &Turbulence, about: &Wake) -> Result<Whitening, Error> {
    let cells = &stage.squares.cells;
    let whitening = match turbulence {
        Turbulence::Exponential {
            deviation_m_s,
            length_m,
        } => {
            let mut places = Vec::with_capacity(cells.len());
            for cell in cells {
                let range_m = stage.map.range_m[cell.gate];
                let elevation_rad = stage.map.elevation_rad[cell.line];
                let position_m = stage.gates.model.position_m(range_m, elevation_rad);
                places.push((position_m, cell.sigma_m_s));
            }
            Whitening::exponential(&places, *deviation_m_s, *length_m)
        }
        Turbulence::VonKarman(found) => {
            let sigmas_m_s: Vec<f64> = cells.iter().map(|cell| cell.sigma_m_s).collect();
            let gates = positions(stage, about);
            let table = gate_covariance(&gates, stage.options.gate.std_m())?;
            Whitening::new(found.covariance_m2_s2(&table, &gates, &sigmas_m_s))
        }
        Turbulence::OfScan => None,
    };
    whitening.ok_or(singular(cells.len()))
}

fn singular(order: usize) -> Error {
    Error::Linalg {
        what: "covariance of the velocities",
        order,
        reason: "is singular to working precision: state larger deviations of the velocities",
    }
}

/// Takes away velocities that are farther off a first fit than [`OUTLIER`] times a deviation \[m/s\]: whitening would spread them over their
/// neighbours.
fn reject(stage: &mut Stage<'_>, end: &End, deviation_m_s: impl Fn(&Cell) -> f64) {
    let residuals = stage.squares.rows(&end.wake.to_array(), &[]).residuals;
    let mut residuals = residuals.iter();
    let before = stage.squares.cells.len();
    stage.squares.cells.retain(|cell| {
        let allowed_m_s = OUTLIER * deviation_m_s(cell);
        residuals
            .next()
            .is_none_or(|r| r.abs() * cell.sigma_m_s <= allowed_m_s)
    });
    stage.rejected = before - stage.squares.cells.len();
}
